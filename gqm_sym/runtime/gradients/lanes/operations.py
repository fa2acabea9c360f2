"""A tape for double precision: the operations of other tapes, and divided differences of waves without cancellation.

With ``S(t**2) = sin(t)/t`` and ``C(t**2) = cos(t)``, the divided differences of sines and cosines over places at the
same distance on both sides of a middle and one between them are products of these and of divided differences of S and
C; for exponentials the squares are negative (MATHS, section 3). The operations below also give their derivatives, so
that formulas with them can be differentiated.
"""

from collections.abc import Iterator
from fractions import Fraction
from typing import Any

from gqm_sym.runtime.double_double.interpreter import ABSOLUTE, ADD, DIVIDE, MULTIPLY, SINE_COSINE, SUBTRACT
from gqm_sym.runtime.double_double.recording import TapeNumber
from gqm_sym.runtime.gradients.adjoints import RecorderOfMore

# Operations after those of the interpreter in double-double arithmetic. SINC gives S(p) and its derivative.
# INVERSE_ROOT gives 1/sqrt(x) with the sign of another number.
SINC, INVERSE_ROOT = ABSOLUTE + 1, ABSOLUTE + 2

# The operation that gives the bound on the error of a number in double-double arithmetic, in units of ROUNDING: a
# typical rounding error of a double near 1.
ERROR_BOUND, ROUNDING = INVERSE_ROOT + 1, 0.3 * 2.0**-52

# The operation for the square p of a phase at the ends of an orbit, which does not depend on the place, and for the
# coordinate ``tilt`` of the place, at which the square of the phase is ``q = p*tilt**2``. It gives the divided
# differences C[q, p] and S[q, p], and their derivatives with respect to p. The place is the same for all orbits.
WAVE_DIFFERENCES = ERROR_BOUND + 1

# The number of results of each operation that has several; they are in consecutive registers.
RESULTS = {SINE_COSINE: 2, SINC: 2, WAVE_DIFFERENCES: 4}

# The largest number of terms of a divided difference of a power.
MAX_TERMS = 24


class WithoutRuleError(Exception):
    """A formula contains an operation whose divided differences have no rule here."""


class LaneRecorder(RecorderOfMore):
    """A tape that is being recorded, with the operations SINC, WAVE_DIFFERENCES and INVERSE_ROOT.

    Attributes
    ----------
    uncertain : set of int
        The registers of numbers in double-double arithmetic of which many digits may have cancelled.
    by_inverses : bool
        Whether quotients are products with inverses, which have a rounding more, but which derivatives share.
    """

    def __init__(self, parameters: int, coordinates: int, *, by_inverses: bool = False) -> None:
        self.uncertain, self.by_inverses = set[int](), by_inverses
        self._depends: list[bool] = []
        self.exact: dict[int, Fraction | str] = {}
        super().__init__(parameters, coordinates)

    def _entry(self, *entry: Any) -> int:
        is_new = entry not in self._known
        register = super()._entry(*entry)
        if is_new and entry[0] in (SINC, WAVE_DIFFERENCES):
            self.entries += [("result", register, k) for k in range(1, RESULTS[entry[0]])]
        return register

    def at(self, register: int) -> TapeNumber:
        """Return the number in a register; a constant as such, so that it is joined with others."""
        constant = self.exact.get(register)
        return self.number(constant) if isinstance(constant, Fraction) else super().at(register)

    def depends(self, register: int) -> bool:
        """Return whether a register depends on the place."""
        found = self._depends
        for code, *operands in self.entries[len(found) :]:
            if code == ERROR_BOUND:
                found.append(True)
            elif code == "result":
                found.append(found[operands[0]])
            else:
                is_operation = not isinstance(code, str) or code == "cosine"
                found.append(any(found[k] for k in operands) if is_operation else code == "place")
        return found[register]

    def result(self, code: int, *operands: TapeNumber) -> TapeNumber:
        """Record an operation in its simplest form.

        A quotient by what does not depend on the place becomes a product with its inverse; products with constants are
        joined, and negative signs move into sums.
        """
        simple = self._simplified(code, *operands) if len(operands) == 2 else None
        return super().result(code, *operands) if simple is None else simple

    def _simplified(self, code: int, a: TapeNumber, b: TapeNumber) -> TapeNumber | None:
        """Return the result of an operation with two operands in another form; None if there is no simpler one."""
        if code == MULTIPLY:
            if a.known is None and b.known is None:
                return self._regrouped(a, b)
            return self._product(*((a, b) if a.known is not None else (b, a)))
        if code in (ADD, SUBTRACT):
            if b.known == 0:
                return a
            if a.known == 0:
                return b if code == ADD else -b
            negative = self._negated(b)
            if negative is not None:
                return a - negative if code == ADD else a + negative
            negative = self._negated(a) if code == ADD else None
            return None if negative is None else b - negative
        if code == DIVIDE and a.known == 0:
            return a
        return self._quotient(a, b) if code == DIVIDE else None

    def _quotient(self, a: TapeNumber, b: TapeNumber) -> TapeNumber | None:
        """Return a quotient as a product with an inverse that others share; None if there is none."""
        if b.known is not None:
            return a * (1 / b.known) if b.known else None
        if self.depends(b.register):
            return self._by_inverse(a, b) if self.by_inverses else None
        if self.depends(self.register(a)):
            return a * (self.number(1) / b)
        code, *operands = self.entries[b.register]
        is_multiple = code == MULTIPLY and all(self.entries[k][0] in ("parameter", "constant") for k in operands)
        return self._by_inverse(a, b) if is_multiple or code == "parameter" else None

    def _by_inverse(self, a: TapeNumber, b: TapeNumber) -> TapeNumber | None:
        """Return a quotient as a product with an inverse; None if it is one."""
        if a.known != 1:
            return a * (self.number(1) / b)
        code, *operands = self.entries[b.register] if b.known is None else (None,)
        for one, rest in (operands, operands[::-1]) if code == MULTIPLY else ():
            constant = self.exact.get(one)
            if isinstance(constant, Fraction) and constant != 0:
                return self.number(1 / constant) * (self.number(1) / self.at(rest))
        return None

    def _product(self, factor: TapeNumber, other: TapeNumber) -> TapeNumber | None:
        """Return the product with a constant in its simplest form."""
        if factor.known is None:
            return None
        if factor.known in (0, 1):
            return other if factor.known else factor
        code, *operands = self.entries[other.register]
        if code == MULTIPLY:
            for one, rest in (operands, operands[::-1]):
                constant = self.exact.get(one)
                if isinstance(constant, Fraction):
                    return self.number(constant * factor.known) * self.at(rest)
        return None

    def _regrouped(self, a: TapeNumber, b: TapeNumber) -> TapeNumber | None:
        """Return the product of a number with what does not depend on the place, with all such factors as one."""
        for number, fixed in ((a, b), (b, a)):
            code, *operands = self.entries[number.register]
            if code == MULTIPLY and self.depends(number.register) and not self.depends(fixed.register):
                for one, rest in (operands, operands[::-1]):
                    if not self.depends(one):
                        return self.at(rest) * (self.at(one) * fixed)
        return None

    def _negated(self, number: TapeNumber) -> TapeNumber | None:
        """Return minus a number that was recorded as a product with -1; None for other numbers."""
        if number.known is not None:
            return None
        code, *operands = self.entries[number.register]
        if code == MULTIPLY:
            for one, rest in (operands, operands[::-1]):
                if self.exact.get(one) == -1:
                    return self.at(rest)
        return None

    def divdiff1_ipow(self, x: TapeNumber, y: TapeNumber, h: TapeNumber, n: int) -> TapeNumber:
        """Record the divided difference of the power with an integer exponent, as a sum of products."""
        if n < 0:
            a, b = 1 / x, 1 / y
            return -1 * (self.divdiff1_ipow(a, b, h, -n) * (a * b))
        return sum((x.to(k) * y.to(n - 1 - k) for k in range(n)), self.number(0))

    def divdiff1_rpow(self, x: TapeNumber, y: TapeNumber, h: TapeNumber, exponent: TapeNumber) -> TapeNumber:
        """Record the divided difference of the power with a rational exponent, by roots of both numbers."""
        known = self.number(exponent).known
        if known is None or abs(known.numerator) + known.denominator > MAX_TERMS:
            raise WithoutRuleError
        a, b = (number ** Fraction(1, known.denominator) for number in (x, y))
        above, below = (self.divdiff1_ipow(a, b, h, n) for n in (known.numerator, known.denominator))
        return above / below

    def root_of_quotient(self, above: TapeNumber, below: TapeNumber) -> tuple[TapeNumber, TapeNumber]:
        """Record sqrt(above/below), and 1/sqrt(above*below) with the sign of both, as one of which the other follows.

        If they depend on the place, this takes less time than a root and a division.
        """
        product = above * below
        if not self.depends(self.register(product)):
            rate = self.sqrt(above / below)
            return rate, rate / above
        one = above if self.depends(self.register(above)) else below
        inverse = self.result(INVERSE_ROOT, product, one)
        return above * inverse, inverse

    def sinc(self, t: TapeNumber, sign: int) -> TapeNumber:
        """Record sin(t)/t, or sinh(t)/t for the sign -1."""
        if not self.depends(self.register(t)):
            return (self.sin(t) if sign > 0 else self.sinh(t)) / t
        return self.result(SINC, sign * (t * t))

    def wave_differences(self, p: TapeNumber, tilt: TapeNumber) -> tuple[TapeNumber, TapeNumber]:
        """Record C[q, p] and S[q, p] for ``q = p*tilt**2``."""
        of_even = self.result(WAVE_DIFFERENCES, p, tilt)
        return of_even, self.at(of_even.register + 1)

    def error_bound(self, register: int) -> TapeNumber:
        """Record the bound on the error of a number that does not depend on the place."""
        return self.result(ERROR_BOUND, self.at(register))

    def base(self, register: int) -> tuple[int, int]:
        """Return the register of the operation that fills a register, and the number of the result among its
        results.
        """
        code, *operands = self.entries[register]
        if code == "cosine":
            return register - 1, 1
        return (operands[0], operands[1]) if code == "result" else (register, 0)

    def is_other(self, register: int) -> bool:
        """Return whether a register is filled by SINC, WAVE_DIFFERENCES or INVERSE_ROOT."""
        return self.entries[self.base(register)[0]][0] in (SINC, WAVE_DIFFERENCES, INVERSE_ROOT)

    def other_partials(self, register: int) -> Iterator[tuple[int, TapeNumber]]:
        """Yield the operands of a result of these operations, each with the result's partial derivative by it."""
        base, which = self.base(register)
        code, *operands = self.entries[base]
        if code == INVERSE_ROOT:
            inverse = self.at(base)
            yield operands[0], Fraction(-1, 2) * (inverse * (inverse * inverse))
        elif code == SINC:
            yield operands[0], self.at(base + 1)
        else:
            yield operands[0], self.at(base + 2 + which)
