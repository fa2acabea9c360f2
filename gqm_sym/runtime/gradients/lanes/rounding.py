"""How large the rounding errors of a tape in doubles are: their variances, recorded as formulas on the same tape.

Each operation has a rounding error of its own, and a result changes by it times its derivative with respect to the
operation's result, whichever ways lead from one to the other: errors that numerator and denominator have in common
cancel. Roundings count as independent, and those of what does not depend on the place count as zero, except where
digits may have cancelled. Variances are in units of the square of a typical rounding error (`operations.ROUNDING`).
"""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from fractions import Fraction

from gqm_sym.runtime.double_double import interpreter
from gqm_sym.runtime.double_double.recording import TapeNumber
from gqm_sym.runtime.gradients.adjoints import partials
from gqm_sym.runtime.gradients.lanes.operations import INVERSE_ROOT, SINC, WAVE_DIFFERENCES, LaneRecorder
from gqm_sym.runtime.gradients.lanes.scaling import Terms, combined

# The second derivatives at 0 of S(p), and of the differences that WAVE_DIFFERENCES gives, at the ends of an orbit, by
# the operations and the numbers of the results whose derivatives they are. These derivatives are not on the tape.
SLOPES = {
    (SINC, 1): Fraction(1, 60),
    (WAVE_DIFFERENCES, 2): Fraction(1, 120),
    (WAVE_DIFFERENCES, 3): Fraction(1, 840),
}

# The rounding errors of the results of WAVE_DIFFERENCES are those of the largest terms of their series, although these
# may cancel: the terms of zeroth order at the ends of an orbit.
LARGEST_TERMS = (Fraction(1, 2), Fraction(1, 6), Fraction(1, 12), Fraction(1, 60))

# The relative changes of the results of operations by those of their operands, where they are constants.
MULTIPLES: dict[int, tuple[Fraction, ...]] = {
    interpreter.MULTIPLY: (Fraction(1), Fraction(1)),
    interpreter.DIVIDE: (Fraction(1), Fraction(-1)),
    interpreter.SQUARE_ROOT: (Fraction(1, 2),),
    INVERSE_ROOT: (Fraction(-1, 2),),
    interpreter.ABSOLUTE: (Fraction(1),),
}

# Factors by which a product is exact.
POWERS = {Fraction(2) ** k for k in range(-6, 7)}


def variances(op: LaneRecorder, rates: Sequence[TapeNumber], terms: Sequence[Terms]) -> list[TapeNumber]:
    """Return the variances of the rounding errors of sums of products.

    Those of sums of several terms follow from the sums themselves, because errors that terms have in common may cancel.

    Parameters
    ----------
    op : LaneRecorder
        The tape, to which the variances are added.
    rates : sequence of TapeNumber
        The numbers that the products contain.
    terms : sequence of Terms
        The products.
    """
    by_rate = {which: _variance(op, op.register(rates[which])) for which in _alone(terms)}
    return [
        (some[0][0] * some[0][0]) * by_rate[some[0][1]] if len(some) == 1 else _variance(op, op.register(total))
        for total, some in zip(combined(op, terms, rates), terms, strict=True)
    ]


def _alone(terms: Sequence[Terms]) -> list[int]:
    """Return the positions of the rates that are the only ones in a sum."""
    return sorted({some[0][1] for some in terms if len(some) == 1})


def _variance(op: LaneRecorder, wanted: int) -> TapeNumber:
    """Return the variance of one register: the sum of the squares of the changes by all roundings on the way to it."""
    ways = _Ways(op, wanted)
    shares, others = defaultdict[int, Fraction](Fraction), list[TapeNumber]()
    for k in range(wanted, -1, -1):
        if not ways.lead_from(k):
            continue
        if not op.depends(k):
            if k in op.uncertain:
                others.append(ways.slope(k) * op.error_bound(k))
            continue
        share, base = ways.change(k)
        operation, which = op.base(k)
        if op.entries[operation][0] == WAVE_DIFFERENCES:
            others.append(ways.slope(k) * LARGEST_TERMS[which])
        elif share and not _is_exact(op, k):
            shares[op.register(base)] += share * share
        ways.follow(k)
    found = [_square(op.at(register)) * share for register, share in shares.items()]
    return sum([*found, *map(_square, others)], op.number(0))


def _square(number: TapeNumber) -> TapeNumber:
    """Return the square of a number."""
    return number * number


class _Ways:
    """The ways on which changes of registers lead to one of them, found from its operations back to its operands.

    A relative change of one factor changes the result as much as the same relative change of the product does. So most
    changes are multiples of others, and take no operation; the derivatives by registers are recorded where they are
    needed.

    Parameters
    ----------
    op : LaneRecorder
        The tape.
    wanted : int
        The register that changes.
    """

    def __init__(self, op: LaneRecorder, wanted: int) -> None:
        self._op = op
        self._slopes = {wanted: op.number(1)}
        # For each register, the operations on it with its partial derivatives, and changes as multiples of others.
        self._uses = defaultdict[int, list[tuple[int, TapeNumber]]](list)
        self._changes = defaultdict[int, dict[int, Fraction]](dict)
        self._changes[wanted] = {wanted: Fraction(1)}

    def lead_from(self, k: int) -> bool:
        """Return whether a way leads from a register."""
        return k in self._slopes or k in self._uses

    def slope(self, k: int) -> TapeNumber:
        """Return the derivative by a register."""
        if k not in self._slopes:
            self._slopes[k] = sum((self.slope(use) * by for use, by in self._uses[k]), self._op.number(0))
        return self._slopes[k]

    def change(self, k: int) -> tuple[Fraction, TapeNumber]:
        """Return the derivative by a register times the number in it, as a multiple of another number."""
        op, parts = self._op, {base: share for base, share in self._changes[k].items() if share}
        if len(parts) != 1:
            total = sum((op.at(base) * share for base, share in parts.items()), op.number(0))
            parts = {} if total.known == 0 else {op.register(total): Fraction(1)}
            self._changes[k] = parts
        base, share = next(iter(parts.items()), (k, Fraction(0)))
        return share, op.at(base)

    def follow(self, k: int) -> None:
        """Let ways lead to a register from its operands."""
        op, (share, base) = self._op, self.change(k)
        for operand, partial, multiple in _partials(op, k):
            self._uses[operand].append((k, partial))
            if not op.depends(operand):
                continue
            number, part = base, share
            if multiple is None:
                number, part = self.slope(k) * partial * op.at(operand), Fraction(1)
            else:
                part = share * multiple
            changes, register = self._changes[operand], op.register(number)
            changes[register] = changes.get(register, Fraction(0)) + part


def _partials(op: LaneRecorder, k: int) -> Iterator[tuple[int, TapeNumber, Fraction | None]]:
    """Yield the operands of an entry, each with the entry's partial derivative by it, and the relative change of the
    entry by one of the operand if that is a constant (otherwise None).

    Of partial derivatives that are not on the tape, the absolute value at 0 is taken.
    """
    base, which = op.base(k)
    code, *operands = op.entries[base]
    if (code, which) in SLOPES:
        for operand in operands:
            yield operand, op.number(SLOPES[code, which]), None
        return
    multiples = MULTIPLES.get(code, (None, None))
    for (operand, partial), multiple in zip(partials(op, k), multiples, strict=False):
        yield operand, partial, multiple


def _is_exact(op: LaneRecorder, k: int) -> bool:
    """Return whether a number is a coordinate, a product with a power of two or an absolute value.

    These have no rounding error of their own.
    """
    code, *operands = op.entries[k]
    if code == "place" or code == interpreter.ABSOLUTE:
        return True
    if code != interpreter.MULTIPLY:
        return False
    factors = [op.exact.get(operand) for operand in operands]
    return any(isinstance(factor, Fraction) and abs(factor) in POWERS for factor in factors)
