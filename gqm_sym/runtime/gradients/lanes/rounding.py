"""How large the rounding errors of a tape in doubles are: their variances, recorded as formulas on the same tape.

Each operation has a rounding error of its own and passes on those of its operands by its partial derivatives. Errors
count as independent, and those of what does not depend on the place count as zero, except where digits may have
cancelled. Variances are in units of the square of a typical rounding error (`operations.ROUNDING`).
"""

from collections.abc import Iterable, Sequence
from fractions import Fraction

from gqm_sym.runtime.double_double import interpreter
from gqm_sym.runtime.double_double.recording import TapeNumber
from gqm_sym.runtime.gradients.adjoints import partials
from gqm_sym.runtime.gradients.lanes.operations import SINC, SINC_PAIR, LaneRecorder

# The squares of the second derivative of S(p) at 0, and of the derivatives of S[p, p, q], by the operations and the
# numbers of the results whose derivatives they are. These derivatives are not on the tape.
SECOND, THIRD = Fraction(1, 60) ** 2, Fraction(1, 2520) ** 2
BOUNDS = {
    (SINC, 1): SECOND,
    (SINC_PAIR, 2): SECOND,
    (SINC_PAIR, 3): SECOND,
    (SINC_PAIR, 4): THIRD,
    (SINC_PAIR, 5): THIRD,
}

# Factors by which a product is exact.
POWERS = {Fraction(2) ** k for k in range(-6, 7)}


def variances(op: LaneRecorder, live: Iterable[int], wanted: Sequence[int]) -> list[TapeNumber]:
    """Return the variances of the rounding errors of some registers.

    Parameters
    ----------
    op : LaneRecorder
        The tape, to which the variances are added.
    live : iterable of int
        The registers from which the wanted ones are computed.
    wanted : sequence of int
        The registers.
    """
    bounds = {k: op.error_bound(k) for k in op.uncertain}
    found = {k: bound * bound for k, bound in bounds.items()}
    for k in sorted(live):
        if op.depends(k):
            found[k] = _variance(op, k, found)
    return [found.get(k, op.number(0)) for k in wanted]


def _variance(op: LaneRecorder, k: int, known: dict[int, TapeNumber]) -> TapeNumber:
    """Return the variance of one register, from those of its operands."""
    out, (base, which) = op.at(k), op.base(k)
    total = op.number(0) if _is_exact(op, k) else out * out
    if (op.entries[base][0], which) in BOUNDS:
        bound = op.number(BOUNDS[op.entries[base][0], which])
        return sum((bound * known[operand] for operand in op.entries[base][1:] if operand in known), total)
    joined: dict[int, TapeNumber] = {}
    for operand, partial in partials(op, k):
        joined[operand] = joined[operand] + partial if operand in joined else partial
    for operand, partial in joined.items():
        if operand in known:
            square = partial * partial
            part = known[operand] if square.known == 1 else square * known[operand]
            total = part if total.known == 0 else total + part
    return total


def _is_exact(op: LaneRecorder, k: int) -> bool:
    """Return whether an operation is a product with a power of two or an absolute value, which is not rounded."""
    code, *operands = op.entries[k]
    if code == interpreter.ABSOLUTE:
        return True
    if code != interpreter.MULTIPLY:
        return False
    factors = [op.exact.get(operand) for operand in operands]
    return any(isinstance(factor, Fraction) and abs(factor) in POWERS for factor in factors)
