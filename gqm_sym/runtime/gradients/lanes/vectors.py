"""The operations of programs as code of LLVM, for eight orbits at once.

Each operation is the one that the interpreters carry out, so that the results have the same bits; but numbers stay in
the registers of the processor.
"""

from collections.abc import Callable, Iterable, Sequence

from llvmlite import ir

from gqm_sym.runtime.arithmetic.elementary import ROOT_BITS
from gqm_sym.runtime.double_double import interpreter
from gqm_sym.runtime.double_double.arithmetic import UNIT
from gqm_sym.runtime.double_double.interpreter import BLOCK, ERROR, LOW
from gqm_sym.runtime.gradients.lanes import interpreter as in_lanes
from gqm_sym.runtime.gradients.lanes.operations import (
    ERROR_BOUND,
    INVERSE_ROOT,
    RESULTS,
    ROUNDING,
    SINC,
)

# The number of orbits in a vector, which every number of orbits that a program is called with is a multiple of.
WIDTH = 8

REAL, WHOLE = ir.DoubleType(), ir.IntType(64)
VECTOR = ir.VectorType(REAL, WIDTH)

PAIR = tuple[ir.Value, ir.Value, ir.Value]
"""A number in double-double arithmetic: its high double, its low one, and the bound on the error."""

BodyArguments = tuple[ir.IRBuilder, ir.Value, ir.Value, tuple[ir.IRBuilder, ir.Value]]
"""The arguments of `Body`."""


class Body:
    """The code that carries out operations for the eight orbits that begin at an index.

    Parameters
    ----------
    builder : ir.IRBuilder
        The builder of the function.
    here : ir.Value
        The address of the first orbit's double in the first register.
    scratch : ir.Value
        The same address in memory for numbers that later loops need.
    before : (ir.IRBuilder, ir.Value)
        The builder of what is done once before the loop over orbits, and the address of the first register.
    """

    def __init__(
        self, builder: ir.IRBuilder, here: ir.Value, scratch: ir.Value, before: tuple[ir.IRBuilder, ir.Value]
    ) -> None:
        self.builder, self._here, self.scratch, self.before = builder, here, scratch, before
        self._loaded: dict[int, ir.Value] = {}

    def constant(self, value: float) -> ir.Value:
        """Return a vector with the same double for each orbit."""
        return ir.Constant(VECTOR, [ir.Constant(REAL, value)] * WIDTH)

    def called(self, name: str, *values: ir.Value) -> ir.Value:
        """Return the result of one of LLVM's functions."""
        kind = ir.FunctionType(VECTOR, [VECTOR] * len(values))
        module, full = self.builder.module, f"llvm.{name}.v{WIDTH}f64"
        function = module.globals.get(full) or ir.Function(module, kind, full)
        return self.builder.call(function, values)

    def _at(self, start: ir.Value, position: int) -> ir.Value:
        place = self.builder.gep(start, [ir.Constant(WHOLE, position)])
        return self.builder.bitcast(place, VECTOR.as_pointer())

    def load(self, position: int, start: ir.Value | None = None) -> ir.Value:
        """Return the vector at a position of the work space."""
        if start is not None:
            return self.builder.load(self._at(start, position), align=8)
        if position not in self._loaded:
            self._loaded[position] = self.load(position, self._here)
        return self._loaded[position]

    def store(self, value: ir.Value, position: int, start: ir.Value | None = None) -> None:
        """Store a vector at a position of the work space."""
        self.builder.store(value, self._at(self._here if start is None else start, position), align=8)


class PairBody(Body):
    """Operations in double-double arithmetic, with bounds on the errors, as in `double_double.interpreter`."""

    def carry_out(self, codes: Iterable[Sequence[int]], stored: dict[int, set[int]]) -> None:
        """Carry out operations, and store the rows of registers that are needed later."""
        found: dict[int, PAIR] = {}

        def at(position: int) -> PAIR:
            if position not in found:
                found[position] = tuple(self.load(position + row) for row in (0, LOW, ERROR))
            return found[position]

        for code, out, left, right in codes:
            found[out] = PAIR_OPERATIONS[code](self, at(left), at(right))
            for row in sorted(stored.get(out, ())):
                self.store(found[out][row // BLOCK], out + row)

    def size(self, value: ir.Value) -> ir.Value:
        """Return absolute values."""
        return self.called("fabs", value)

    def fast_sum(self, a: ir.Value, b: ir.Value) -> tuple[ir.Value, ir.Value]:
        """Return what `arithmetic.fast_sum` does."""
        builder = self.builder
        s = builder.fadd(a, b)
        return s, builder.fsub(b, builder.fsub(s, a))

    def two_sum(self, a: ir.Value, b: ir.Value) -> tuple[ir.Value, ir.Value]:
        """Return what `doubledouble.two_sum` does."""
        builder = self.builder
        s = builder.fadd(a, b)
        t = builder.fsub(s, a)
        return s, builder.fadd(builder.fsub(a, builder.fsub(s, t)), builder.fsub(b, t))

    def _rounded(self, error: ir.Value, value: ir.Value, units: float = 1.0) -> ir.Value:
        """Return an error with that of rounding a value added."""
        builder = self.builder
        return builder.fadd(error, builder.fmul(self.constant(units * UNIT), self.size(value)))

    def sum_of(self, a: PAIR, b: PAIR) -> PAIR:
        """Return a sum."""
        builder = self.builder
        (s, e), (t, f) = self.two_sum(a[0], b[0]), self.two_sum(a[1], b[1])
        s, e = self.fast_sum(s, builder.fadd(e, t))
        s, e = self.fast_sum(s, builder.fadd(e, f))
        return s, e, self._rounded(builder.fadd(a[2], b[2]), s)

    def difference(self, a: PAIR, b: PAIR) -> PAIR:
        """Return a difference, as the sum with the negative number."""
        minus = self.constant(-1.0)
        return self.sum_of(a, (self.builder.fmul(minus, b[0]), self.builder.fmul(minus, b[1]), b[2]))

    def product(self, a: PAIR, b: PAIR) -> PAIR:
        """Return a product."""
        builder = self.builder
        p = builder.fmul(a[0], b[0])
        e = self.called("fma", a[0], b[0], builder.fneg(p))
        p, e = self.fast_sum(p, self.called("fma", a[0], b[1], self.called("fma", a[1], b[0], e)))
        error = builder.fadd(builder.fmul(self.size(a[0]), b[2]), builder.fmul(self.size(b[0]), a[2]))
        return p, e, self._rounded(error, p)

    def quotient(self, a: PAIR, b: PAIR) -> PAIR:
        """Return a quotient."""
        builder = self.builder
        q = builder.fdiv(a[0], b[0])
        minus = builder.fneg(q)
        rest = builder.fadd(self.called("fma", minus, b[0], a[0]), self.called("fma", minus, b[1], a[1]))
        q, e = self.fast_sum(q, builder.fdiv(rest, b[0]))
        size = self.size(q)
        error = builder.fdiv(builder.fadd(a[2], builder.fmul(size, b[2])), self.size(b[0]))
        return q, e, builder.fadd(error, builder.fmul(self.constant(2.0 * UNIT), size))

    def square_root(self, a: PAIR, _: PAIR) -> PAIR:
        """Return a square root."""
        builder = self.builder
        s = self.called("sqrt", a[0])
        rest = builder.fadd(self.called("fma", builder.fneg(s), s, a[0]), a[1])
        s, e = self.fast_sum(s, builder.fdiv(rest, builder.fmul(self.constant(2.0), s)))
        error = builder.fdiv(builder.fmul(self.constant(0.5), a[2]), s)
        return s, e, builder.fadd(error, builder.fmul(self.constant(UNIT), s))


PAIR_OPERATIONS: dict[int, Callable[[PairBody, PAIR, PAIR], PAIR]] = {
    interpreter.ADD: PairBody.sum_of,
    interpreter.SUBTRACT: PairBody.difference,
    interpreter.MULTIPLY: PairBody.product,
    interpreter.DIVIDE: PairBody.quotient,
    interpreter.SQUARE_ROOT: PairBody.square_root,
}


# The operations in doubles that are written as code. An interpreter carries out all others.
DOUBLE_OPERATIONS = {
    *(interpreter.ADD, interpreter.SUBTRACT, interpreter.MULTIPLY, interpreter.DIVIDE, interpreter.SQUARE_ROOT),
    *(SINC, INVERSE_ROOT, *range(ERROR_BOUND, in_lanes.FROM_PAIR + 1)),
}


class DoubleBody(Body):
    """Operations in doubles, as in `lanes.interpreter`.

    Parameters
    ----------
    body : tuple
        The arguments of `Body`.
    kept : dict
        The positions of numbers in the memory for later loops.
    """

    def __init__(self, body: BodyArguments, kept: dict[int, int]) -> None:
        super().__init__(*body)
        self._found, self._kept = dict[int, ir.Value](), kept
        self._terms_at: dict[int, list[dict[int, ir.Value]]] = {}

    def carry_out(self, codes: Iterable[Sequence[int]], copied: Iterable[int], stored: dict[int, int]) -> None:
        """Carry out operations, of which each result has a negative number.

        Parameters
        ----------
        codes : iterable of sequences
            The operations.
        copied : iterable of int
            Positions in the work space of numbers that are copied for later loops.
        stored : dict
            The positions in the work space at which numbers are stored.
        """
        for position in copied:
            self.store(self.load(position), self._kept[position], self.scratch)
        for code, out, left, right in codes:
            several = code in RESULTS
            results = self._several(code, left, right) if several else [self._one(code, left, right)]
            for k, value in enumerate(results):
                self._found[out - k] = value
                if out - k in self._kept:
                    self.store(value, self._kept[out - k], self.scratch)
                if out - k in stored:
                    self.store(value, stored[out - k])

    def _number(self, number: int) -> ir.Value:
        """Return a number: that of another operation, or in a register of doubles."""
        if number >= 0:
            return self.load(number)
        if number not in self._found:
            self._found[number] = self.load(self._kept[number], self.scratch)
        return self._found[number]

    def _one(self, code: int, left: int, right: int) -> ir.Value:
        """Return the result of an operation that has one."""
        builder = self.builder
        if code == ERROR_BOUND:
            return builder.fmul(self.constant(1.0 / ROUNDING), self.load(left + ERROR))
        if code == in_lanes.FROM_PAIR:
            return builder.fadd(self.load(right), self.load(right + LOW))
        a = self._number(left)
        if code == INVERSE_ROOT:
            return self._inverse_root(a, self._number(right))
        if code > ERROR_BOUND:
            high, low = self.load(right), self.load(right + LOW)
            if code == in_lanes.TIMES_PAIR:
                return self.called("fma", a, high, builder.fmul(a, low))
            if code == in_lanes.SCALE:
                return builder.fmul(high, a)
            if code == in_lanes.PAIR_MINUS:
                return builder.fadd(builder.fsub(high, a), low)
            if code == in_lanes.PAIR_OVER:
                return builder.fdiv(builder.fadd(high, low), a)
            step = builder.fsub if code == in_lanes.MINUS_PAIR else builder.fadd
            return step(step(a, high), low)
        simple = {
            interpreter.ADD: builder.fadd,
            interpreter.SUBTRACT: builder.fsub,
            interpreter.MULTIPLY: builder.fmul,
            interpreter.DIVIDE: builder.fdiv,
        }
        return simple[code](a, self._number(right)) if code in simple else self.called("sqrt", a)

    def _inverse_root(self, x: ir.Value, other: ir.Value) -> ir.Value:
        """Return what `interpreter.fill_inverse_roots` does."""
        builder, half, one = self.builder, self.constant(0.5), self.constant(1.0)
        wholes = ir.VectorType(WHOLE, WIDTH)
        shift, bits = (ir.Constant(wholes, [ir.Constant(WHOLE, n)] * WIDTH) for n in (1, ROOT_BITS))
        y = builder.bitcast(builder.sub(bits, builder.ashr(builder.bitcast(x, wholes), shift)), VECTOR)

        def rest(y: ir.Value) -> ir.Value:
            return self.called("fma", builder.fneg(builder.fmul(x, y)), y, one)

        for _ in range(2):
            left = rest(y)
            step = self.called("fma", self.constant(0.375), left, half)
            y = self.called("fma", builder.fmul(y, left), step, y)
        y = self.called("fma", builder.fmul(half, y), rest(y), y)
        is_normal = builder.fcmp_ordered(">=", x, self.constant(in_lanes.MIN_NORMAL))
        y = builder.select(is_normal, y, self.constant(float("nan")))
        return builder.select(builder.fcmp_ordered("<", other, self.constant(0.0)), builder.fneg(y), y)

    def _several(self, code: int, left: int, right: int) -> Sequence[ir.Value]:
        """Return the results of an operation that has several."""
        if code == SINC:
            a = self._number(left)
            value = slope = self.constant(0.0)
            for coefficient in in_lanes.SERIES:
                slope = self.called("fma", slope, a, value)
                value = self.called("fma", value, a, self.constant(coefficient))
            return self._where_inside(a, value), slope
        return self._wave_differences(left, self.load(right), self.load(right + LOW))

    def _where_inside(self, p: ir.Value, value: ir.Value) -> ir.Value:
        """Return values where p is in the range of the power series, and NaN elsewhere."""
        low = self.builder.fcmp_ordered(">=", p, self.constant(in_lanes.MIN_SQUARE))
        inside = self.builder.and_(low, self.builder.fcmp_ordered("<=", p, self.constant(in_lanes.MAX_SQUARE)))
        return self.builder.select(inside, value, self.constant(float("nan")))

    def _wave_differences(self, tilt: int, high: ir.Value, low: ir.Value) -> Sequence[ir.Value]:
        """Return what `interpreter.fill_wave_differences` does."""
        sums = [self.constant(0.0)] * 3
        for terms in reversed(self._terms(tilt)):  # the sums side by side, so that none waits for another
            for which, term in terms.items():
                sums[which] = self.called("fma", sums[which], high, term)
        even, by_even, by_odd = sums
        odd = self.called("fma", self.builder.fmul(self.constant(-2.0), high), by_odd, even)
        third, rest = map(self.constant, in_lanes.THIRD)
        odd = self.called("fma", third, odd, self.builder.fmul(rest, odd))
        values = [self.called("fma", low, by, value) for by, value in ((by_even, even), (by_odd, odd))]
        return [*(self._where_inside(high, value) for value in values), by_even, by_odd]

    def _terms(self, tilt: int) -> list[dict[int, ir.Value]]:
        """Return the terms of the series of `interpreter.fill_wave_differences`, which all orbits have in common: for
        each number of them, those of the three sums that have it.
        """
        if tilt in self._terms_at:
            return self._terms_at[tilt]
        (builder, work), one = self.before, ir.Constant(REAL, 1.0)
        place = builder.load(builder.gep(work, [ir.Constant(WHOLE, tilt)]))
        square, power, found = builder.fmul(place, place), one, list[dict[int, ir.Value]]()
        nothing, zero = ir.Constant(VECTOR, ir.Undefined), ir.Constant(ir.IntType(32), 0)
        everywhere = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
        for number, coefficients in enumerate(zip(in_lanes.WAVES.T.tolist(), in_lanes.RESTS.T.tolist(), strict=True)):
            power = builder.fma(power, square, one) if number else one
            terms = {}
            for which, pair in enumerate(zip(*coefficients, strict=True)):
                if number >= in_lanes.FIRST_TERMS[which]:
                    high, low = (ir.Constant(REAL, part) for part in pair)
                    term = builder.fma(high, power, builder.fmul(low, power))
                    term = builder.insert_element(nothing, term, zero)
                    terms[which] = builder.shuffle_vector(term, nothing, everywhere)
            found.append(terms)
        self._terms_at[tilt] = found
        return found
