"""Programs as machine code: straight-line code for eight orbits at once, in place of an interpreter.

Each operation is the one that the interpreters carry out, so that the results have the same bits; but numbers stay in
the registers of the processor. LLVM takes some tenths of a second for a program, which many launches are worth.
"""

from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from llvmlite import binding, ir
from numpy.typing import NDArray

from gqm_sym.runtime.compiled import jit
from gqm_sym.runtime.compiled.emitted import MachineCode
from gqm_sym.runtime.double_double import interpreter
from gqm_sym.runtime.double_double.arithmetic import UNIT
from gqm_sym.runtime.double_double.interpreter import BLOCK, ERROR, INTERPRETER, LOW, ROW
from gqm_sym.runtime.gradients.lanes import interpreter as in_lanes
from gqm_sym.runtime.gradients.lanes.assembly import LaneProgram
from gqm_sym.runtime.gradients.lanes.interpreter import LANES_INTERPRETER
from gqm_sym.runtime.gradients.lanes.operations import ERROR_BOUND, RESULTS, ROUNDING, SINC, SINC_PAIR
from gqm_sym.runtime.gradients.programs import Program

# The number of orbits in a vector, which every number of orbits that a program is called with is a multiple of.
WIDTH = 8

REAL, WHOLE = ir.DoubleType(), ir.IntType(64)
VECTOR = ir.VectorType(REAL, WIDTH)

# The type of a number: its high double, its low one, and the bound on the error.
PAIR = tuple[Any, Any, Any]


class _Body:
    """The code that carries out operations for the eight orbits that begin at an index.

    Parameters
    ----------
    builder : ir.IRBuilder
        The builder of the function.
    here : ir.Value
        The address of the first orbit's double in the first register.
    scratch : ir.Value
        The address of memory for operations that an interpreter carries out.
    kept : list
        A list that keeps the arrays alive whose addresses are in the code.
    """

    def __init__(self, builder: ir.IRBuilder, here: ir.Value, scratch: ir.Value, kept: list[Any]) -> None:
        self.builder, self._here, self._scratch, self._kept = builder, here, scratch, kept
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

    def interpreted(self, address: int, code: int, operands: Sequence[ir.Value], places: Sequence[int]) -> Any:
        """Let an interpreter carry out an operation with one operand, and return what it stores.

        Parameters
        ----------
        address : int
            The memory cell with the address of the interpreter.
        code : int
            The operation.
        operands : sequence of vectors
            The vectors of the operand's register.
        places : sequence of int
            The positions of the results relative to the beginning of the first register of results.
        """
        first, builder = 2 * ROW, self.builder
        for k, value in enumerate(operands):
            self.store(value, k * BLOCK, self._scratch)
        operation = np.array([[code, first, 0, 0]], dtype=np.int64)
        self._kept.append(operation)
        pointer = WHOLE.as_pointer()
        kind = ir.FunctionType(ir.VoidType(), [pointer, WHOLE, WHOLE, REAL.as_pointer(), WHOLE])
        cell = builder.inttoptr(ir.Constant(WHOLE, address), kind.as_pointer().as_pointer())
        row = builder.inttoptr(ir.Constant(WHOLE, operation.ctypes.data), pointer)
        function = builder.load(cell)
        zero, one = ir.Constant(WHOLE, 0), ir.Constant(WHOLE, 1)
        builder.call(function, [row, zero, one, self._scratch, ir.Constant(WHOLE, WIDTH)])
        return [self.load(first + place, self._scratch) for place in places]


class _PairBody(_Body):
    """Operations in double-double arithmetic, with bounds on the errors, as in `double_double.interpreter`."""

    def carry_out(self, codes: Iterable[Sequence[int]], stored: dict[int, set[int]]) -> None:
        """Carry out operations, and store the rows of registers that are needed later."""
        found: dict[int, PAIR] = {}

        def at(position: int) -> PAIR:
            if position not in found:
                found[position] = tuple(self.load(position + row) for row in (0, LOW, ERROR))
            return found[position]

        for code, out, left, right in codes:
            if code == interpreter.SINE_COSINE:
                both = self.interpreted(INTERPRETER.address, code, at(left), range(0, 2 * ROW, BLOCK))
                found[out], found[out + ROW] = tuple(both[:3]), tuple(both[3:])
            elif code in _PAIR_OPERATIONS:
                found[out] = _PAIR_OPERATIONS[code](self, at(left), at(right))
            else:
                found[out] = tuple(self.interpreted(INTERPRETER.address, code, at(left), range(0, ROW, BLOCK)))
        for position, rows in stored.items():
            if position in found:
                for row in sorted(rows):
                    self.store(found[position][row // BLOCK], position + row)

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


_PAIR_OPERATIONS: dict[int, Callable[[_PairBody, PAIR, PAIR], PAIR]] = {
    interpreter.ADD: _PairBody.sum_of,
    interpreter.SUBTRACT: _PairBody.difference,
    interpreter.MULTIPLY: _PairBody.product,
    interpreter.DIVIDE: _PairBody.quotient,
    interpreter.SQUARE_ROOT: _PairBody.square_root,
}


class _DoubleBody(_Body):
    """Operations in doubles, as in `lanes.interpreter`."""

    def carry_out(self, codes: Iterable[Sequence[int]], outputs: Iterable[int]) -> None:
        """Carry out operations, and store the results."""
        self._found: dict[int, ir.Value] = {}
        for code, out, left, right in codes:
            if code in RESULTS:
                results = self._several(code, self._number(left), right)
                self._found.update({out + BLOCK * k: value for k, value in enumerate(results)})
            else:
                self._found[out] = self._one(code, left, right)
        for position in sorted(set(outputs)):
            self.store(self._number(position), position)

    def _number(self, position: int) -> ir.Value:
        """Return the number in a register of doubles."""
        return self._found[position] if position in self._found else self.load(position)

    def _one(self, code: int, left: int, right: int) -> ir.Value:
        """Return the result of an operation that has one."""
        builder = self.builder
        if code == ERROR_BOUND:
            return builder.fmul(self.constant(1.0 / ROUNDING), self.load(left + ERROR))
        a = self._number(left)
        if code > ERROR_BOUND:
            high, low = self.load(right), self.load(right + LOW)
            if code == in_lanes.TIMES_PAIR:
                return self.called("fma", a, high, builder.fmul(a, low))
            if code == in_lanes.SCALE:
                return builder.fmul(high, a)
            if code == in_lanes.PAIR_MINUS:
                return builder.fadd(builder.fsub(high, a), low)
            step = builder.fsub if code == in_lanes.MINUS_PAIR else builder.fadd
            if code in (in_lanes.PLUS_PAIR, in_lanes.MINUS_PAIR):
                return step(step(a, high), low)
            whole = builder.fadd(high, low)
            return builder.fdiv(whole, a) if code == in_lanes.PAIR_OVER else whole
        simple = {
            interpreter.ADD: builder.fadd,
            interpreter.SUBTRACT: builder.fsub,
            interpreter.MULTIPLY: builder.fmul,
            interpreter.DIVIDE: builder.fdiv,
        }
        if code in simple:
            return simple[code](a, self._number(right))
        if code == interpreter.SQUARE_ROOT:
            return self.called("sqrt", a)
        return self.interpreted(LANES_INTERPRETER.address, code, [a], [0])[0]

    def _several(self, code: int, a: ir.Value, right: int) -> Sequence[ir.Value]:
        """Return the results of an operation that has several."""
        if code == interpreter.SINE_COSINE:
            found: Sequence[ir.Value] = self.interpreted(LANES_INTERPRETER.address, code, [a], [0, BLOCK])
            return found
        b = a if code == SINC else self._number(right)
        at_a, at_b, slope, by_a, by_b, slope_a, slope_b = self._series(a, b)
        inside = self._is_inside(a)
        if code == SINC_PAIR:
            inside = self.builder.and_(inside, self._is_inside(b))
        value = at_a if code == SINC else self.builder.fadd(at_a, at_b)
        value = self.builder.select(inside, value, self.constant(float("nan")))
        return (value, by_a) if code == SINC else (value, slope, by_a, by_b, slope_a, slope_b)

    def _is_inside(self, p: ir.Value) -> ir.Value:
        """Return whether numbers are in the range of the power series."""
        low = self.builder.fcmp_ordered(">=", p, self.constant(in_lanes.MIN_SQUARE))
        return self.builder.and_(low, self.builder.fcmp_ordered("<=", p, self.constant(in_lanes.MAX_SQUARE)))

    def _series(self, p: ir.Value, q: ir.Value) -> tuple[ir.Value, ...]:
        """Return what `interpreter.sinc_series` does."""
        at_p = at_q = slope = by_p = by_q = slope_p = slope_q = self.constant(0.0)
        for coefficient in in_lanes.SERIES:
            slope_q = self.called("fma", slope_q, q, slope)
            slope_p = self.called("fma", slope_p, q, by_p)
            slope = self.called("fma", slope, q, at_p)
            by_p, by_q = self.called("fma", by_p, p, at_p), self.called("fma", by_q, q, at_q)
            at_p = self.called("fma", at_p, p, self.constant(coefficient))
            at_q = self.called("fma", at_q, q, self.constant(coefficient))
        return at_p, at_q, slope, by_p, by_q, slope_p, slope_q


class CodedProgram(NamedTuple):
    """A program with machine code for it.

    Attributes
    ----------
    operands : tuple
        The operands of the program, with the addresses of this code in place of the interpreters'.
    codes : tuple of MachineCode
        The code, which is removed from memory with this object, so that who runs it keeps the object.
    """

    operands: tuple[Any, ...]
    codes: tuple[MachineCode, ...]


def coded(program: Program | LaneProgram) -> CodedProgram:
    """Return a program with machine code for it."""
    if isinstance(program, Program):
        results = {position: {0, LOW, ERROR} for position in program.outputs.tolist()}
        code = of_pairs(program.operations, program.first, results)
        return CodedProgram((code.address, *program.operands[1:]), (code,))
    stored = defaultdict[int, set[int]](set)
    for kind, _, left, right in [*program.nodes.tolist(), *program.noise.tolist()]:
        if kind == ERROR_BOUND:
            stored[left].add(ERROR)
        elif kind > ERROR_BOUND:
            stored[right] |= {0, LOW}
    codes = (
        of_pairs(program.before, len(program.before), stored),
        of_doubles(program.nodes, program.outputs),
        of_doubles(program.noise, program.variances),
    )
    return CodedProgram((tuple(code.address for code in codes), *program.operands[1:]), codes)


def of_pairs(codes: NDArray[np.int64], cut: int, stored: dict[int, set[int]]) -> MachineCode:
    """Return the machine code of a program in double-double arithmetic.

    Parameters
    ----------
    codes : (m, 4) array of int
        The operations.
    cut : int
        The only number of operations, besides none and all, at which callers begin or end.
    stored : dict
        The positions of the registers that are needed afterwards, each with the rows (0, LOW, ERROR) that are.
    """
    parts = [codes[:cut].tolist(), codes[cut:].tolist()]
    later = {position for row in parts[1] for position in row[2:]}
    everything = {position: {0, LOW, ERROR} for position in later} | stored
    return _compiled(
        [
            (cut, lambda body: _PairBody(*body).carry_out(parts[0], everything)),
            (len(codes), lambda body: _PairBody(*body).carry_out(parts[1], stored)),
        ]
    )


def of_doubles(codes: NDArray[np.int64], outputs: NDArray[np.int64]) -> MachineCode:
    """Return the machine code of operations in doubles, of which the ``outputs`` are stored."""
    rows = codes.tolist()
    return _compiled([(len(codes), lambda body: _DoubleBody(*body).carry_out(rows, outputs.tolist()))])


def _compiled(parts: Sequence[tuple[int, Callable[[Any], None]]]) -> MachineCode:
    """Return a function with the arguments of an interpreter.

    Each part has the number of the operation before which it ends; it is carried out if the operations that are asked
    for end there or later and begin before.
    """
    module, kept = ir.Module(), list[Any]()
    pointer = REAL.as_pointer()
    kind = ir.FunctionType(ir.VoidType(), [WHOLE.as_pointer(), WHOLE, WHOLE, pointer, WHOLE])
    function = ir.Function(module, kind, "carry_out")
    _, first, last, work, count = function.args
    builder = ir.IRBuilder(function.append_basic_block())
    scratch = builder.bitcast(builder.alloca(ir.ArrayType(REAL, 5 * ROW)), pointer)
    for end, write in parts:
        stop = ir.Constant(WHOLE, end)
        is_asked = builder.and_(builder.icmp_signed("<", first, stop), builder.icmp_signed(">=", last, stop))
        before, loop, after = builder.block, function.append_basic_block(), function.append_basic_block()
        builder.cbranch(is_asked, loop, after)
        builder.position_at_end(loop)
        index = builder.phi(WHOLE)
        index.add_incoming(ir.Constant(WHOLE, 0), before)
        write((builder, builder.gep(work, [index]), scratch, kept))
        following = builder.add(index, ir.Constant(WHOLE, WIDTH))
        index.add_incoming(following, builder.block)
        builder.cbranch(builder.icmp_signed("<", following, count), loop, after)
        builder.position_at_end(after)
    builder.ret_void()
    with jit.COMPILING:
        target = binding.Target.from_default_triple()
        machine = target.create_target_machine(
            cpu=binding.get_host_cpu_name(), features=binding.get_host_cpu_features().flatten(), opt=2, jit=True
        )
        engine = binding.create_mcjit_compiler(binding.parse_assembly(str(module)), machine)
        engine.finalize_object()
    return MachineCode(engine.get_function_address("carry_out"), INTERPRETER.signature, (engine, kept))
