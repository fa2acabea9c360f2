"""How large the rounding errors of a tape in doubles are: their variances, recorded as formulas on the same tape.

Each operation has a rounding error of its own, and a result changes by it times its derivative with respect to the
operation's result, whichever ways lead from one to the other: errors that numerator and denominator have in common
cancel. Roundings count as independent, and those of what does not depend on the place count as zero, except where
digits may have cancelled. Variances are in units of the square of a typical rounding error (`operations.ROUNDING`).
"""

from collections.abc import Sequence
from fractions import Fraction

from gqm_sym.runtime.double_double import interpreter
from gqm_sym.runtime.double_double.recording import TapeNumber
from gqm_sym.runtime.gradients.adjoints import partials
from gqm_sym.runtime.gradients.lanes.operations import SINC, SINC_PAIR, LaneRecorder
from gqm_sym.runtime.gradients.lanes.scaling import Terms, combined

# The second derivative of S(p) at 0, and the derivatives of S[p, p, q], by the operations and the numbers of the
# results whose derivatives they are. These derivatives are not on the tape.
SECOND, THIRD = Fraction(1, 60), Fraction(1, 2520)
SLOPES = {
    (SINC, 1): SECOND,
    (SINC_PAIR, 2): SECOND,
    (SINC_PAIR, 3): SECOND,
    (SINC_PAIR, 4): THIRD,
    (SINC_PAIR, 5): THIRD,
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
    total, adjoints = op.number(0), {wanted: op.number(1)}
    for k in range(wanted, -1, -1):
        if k not in adjoints:
            continue
        adjoint = adjoints[k]
        if not op.depends(k):
            if k in op.uncertain:
                total = _with_square(total, adjoint * op.error_bound(k))
            continue
        if not _is_exact(op, k):
            total = _with_square(total, adjoint * op.at(k))
        for operand, partial in _partials(op, k):
            part = adjoint * partial
            adjoints[operand] = adjoints[operand] + part if operand in adjoints else part
    return total


def _with_square(total: TapeNumber, change: TapeNumber) -> TapeNumber:
    """Return a sum with the square of one more change."""
    return change * change if total.known == 0 else total + change * change


def _partials(op: LaneRecorder, k: int) -> list[tuple[int, TapeNumber]]:
    """Return the operands of an entry, each with the entry's partial derivative by it; of those that are not on the
    tape, with the absolute value of that at 0.
    """
    base, which = op.base(k)
    code, *operands = op.entries[base]
    if (code, which) in SLOPES:
        return [(operand, op.number(SLOPES[code, which])) for operand in operands]
    return list(partials(op, k))


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
