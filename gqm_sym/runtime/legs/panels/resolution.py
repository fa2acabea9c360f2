"""Tests whether functions of the place on a panel are resolved by polynomials, and the factors by which panels may be
wider.
"""

from math import fabs, inf

from gqm_sym.runtime.compiled.intrinsics import bits, from_bits
from gqm_sym.runtime.compiled.jit import Inlined, Inner
from gqm_sym.runtime.legs.panels.equation import (
    DS,
    FORCE,
    KAPPA,
    LOAD,
    MEAN,
    N0,
    NODES,
    OFFSET,
    Q_RATE,
    SERIES,
    SIZES,
    TAILS,
    W_FACTOR,
    D,
    P,
    Q,
    W,
    load_size_row,
    product,
)
from gqm_sym.runtime.legs.panels.polynomials import (
    COUNT,
    LEBESGUE,
    WIDE,
    extent,
    first_change,
    size_of,
    to_coefficients,
    to_tails,
)

# The largest ratio of the last coefficients of a resolved function to its largest one; the noise in them is about
# 1e-16.
TAIL_RATIO = 4e-16

# Below this ratio coefficients that no longer decrease are rounding noise, not structure.
NOISE_LEVEL = 1e-9

# The same for a function that may have branch points at its ends. Its coefficients decrease like a power of the degree,
# which looks like noise.
STRICT_LEVEL = 1e-14

# The same ratio for N if it has one sign at all nodes, because its changes of sign are not decided more accurately
# (`point.ZERO_TOLERANCE`); and the ratio if N is far from zero throughout.
ONE_SIGN_RATIO, FAR_FROM_ZERO_RATIO = 1e-14, 1e-7

# The rounding error of a function that vanishes by cancellation, as a share of its terms.
CANCELLATION_NOISE = 1e-15

# Coefficients that decrease by this factor with each degree reach TAIL_RATIO at the end; those in the middle are this
# many degrees from the first.
DECREASE, DEGREES = 5.4, 15

# The bits of 1.0, and the constant that gives the bits of x**(-1/DEGREES) if logarithms are taken as linear between
# powers of two.
ONE = 0x3FF0000000000000
LINEAR_LOGARITHM = ONE + ONE // DEGREES

# The distance of a singularity from the panel's middle, in half widths, if coefficients decrease by that factor.
SINGULARITY_DISTANCE = 0.5 * (DECREASE + 1.0 / DECREASE)

# A change of Q from node to node is a jump if it is more than this share of all its changes on a panel, and alters the
# logarithm of V**2 by more than rounding.
JUMP_SHARE, ROUNDED_CHANGE = 0.25, 1e-14

# A safety factor on the width of panels, and the largest factor by which they grow.
SAFETY_FACTOR, MAX_GROWTH = 0.9, 4.0


@Inlined
def size_at(row):  # type: ignore[no-untyped-def]
    """Return the index of the size that a row's coefficients are compared with."""
    return SIZES + row // WIDE


@Inner
def set_sizes(v2, factor, work):  # type: ignore[no-untyped-def]
    """Set the sizes that coefficients are compared with, except that of the time rate; return the largest V**2.

    At the panel's start V**2 is ``v2``, which is ``factor`` in the unit of W_FACTOR.
    """
    load_size_row(work, MEAN, DS, N0, KAPPA, W)
    largest_v2, q_rate = max(v2, extent(work, W)[1]), size_of(work, Q_RATE)
    width = work[OFFSET + COUNT]
    work[size_at(DS)] = size_of(work, DS)
    work[size_at(FORCE)] = max(size_of(work, FORCE), q_rate * largest_v2 * width / work[D + COUNT])
    work[size_at(Q_RATE)] = max(q_rate, 1.0 / width)
    work[size_at(W_FACTOR)] = max(size_of(work, W_FACTOR), factor)
    work[size_at(LOAD)] = extent(work, MEAN)[1]
    return largest_v2


@Inlined
def are_fine(tail, middle, size, noise):  # type: ignore[no-untyped-def]
    """Return whether last coefficients of the size ``tail``, and some in the middle, are those of a resolved
    function; ``noise`` is NOISE_LEVEL, or STRICT_LEVEL.
    """
    return tail <= TAIL_RATIO * size or (middle <= noise * size and tail >= 0.05 * middle)


@Inner
def examine(work, row, size):  # type: ignore[no-untyped-def]
    """Return the size of a function's last coefficients, that of some coefficients in the middle, and whether the
    function is resolved.
    """
    to_tails(work, row, work, TAILS)
    tail, middle = tail_of(work), max(fabs(work[TAILS + 3]), max(fabs(work[TAILS + 4]), fabs(work[TAILS + 5])))
    return tail, middle, are_fine(tail, middle, size, NOISE_LEVEL)


@Inner
def are_resolved(work, first, last):  # type: ignore[no-untyped-def]
    """Return whether rows ``first`` to ``last`` (excluded) are resolved, and the largest ratio of their middle
    coefficients to their sizes.

    The noise is taken to be that without cancellation: panels would not become more accurate by being narrower where
    terms of the force cancel.
    """
    resolved, worst = True, 0.0
    for row in range(first, last, WIDE):
        size = work[size_at(row)]
        tail, middle, fine = examine(work, row, size)
        if not (tail < inf and middle < inf):
            return False, inf
        if size > 0.0:
            is_noise = fine and tail > TAIL_RATIO * size
            worst = max(worst, min(middle / size, CANCELLATION_NOISE) if is_noise else middle / size)
        resolved = resolved and fine
    return resolved, worst


@Inner
def decrease(ratio):  # type: ignore[no-untyped-def]
    """Return the factor by which coefficients decrease with each degree, estimated from those in the middle to a few
    per cent.
    """
    return from_bits(LINEAR_LOGARITHM - bits(ratio) // DEGREES)


@Inner
def growth(ratio):  # type: ignore[no-untyped-def]
    """Return the factor by which a panel may grow if coefficients decrease as powers of the distance to a
    singularity.
    """
    return min(SAFETY_FACTOR / DECREASE * decrease(ratio), MAX_GROWTH) if ratio < inf else 0.5


@Inner
def growth_towards(ratio, side):  # type: ignore[no-untyped-def]
    """Return the factor by which a panel may grow if the singularity lies ahead, as a turn does for the time rate.

    The factor is for the panel itself (``side`` 1) or for the one that begins at its end (-1). Coefficients decrease as
    for the Bernstein ellipse through the singularity.
    """
    if not ratio < inf:
        return 0.5
    factor = decrease(ratio)
    return min(SAFETY_FACTOR * (0.5 * (factor + 1.0 / factor) + side) / (SINGULARITY_DISTANCE + 1.0), MAX_GROWTH)


@Inner
def narrower(width, factor):  # type: ignore[no-untyped-def]
    """Return the width to try next."""
    return width * max(min(factor, 0.9), 0.2)


@Inner
def keeps_sign(work, row, noise):  # type: ignore[no-untyped-def]
    """Return whether a function's values are so far from zero that the polynomial through them has no zero."""
    low, high = extent(work, row)
    return fabs(0.5 * (low + high)) > 0.5 * LEBESGUE * (high - low) + noise


@Inner
def is_load_resolved(work):  # type: ignore[no-untyped-def]
    """Return whether N is resolved as far as its changes of sign require, and the ratio of its middle coefficients."""
    size = work[size_at(LOAD)]
    tail, middle, fine = examine(work, LOAD, size)
    if not (tail < inf and middle < inf):
        return False, inf
    if not fine:
        low, high = extent(work, LOAD)
        one_sign = low * high > 0.0 and low * work[LOAD + COUNT] > 0.0
        fine = (one_sign and tail <= ONE_SIGN_RATIO * size) or (
            tail <= FAR_FROM_ZERO_RATIO * size and keeps_sign(work, LOAD, 4.0 * FAR_FROM_ZERO_RATIO * size)
        )
    return fine, 0.0 if fine else middle / size


@Inner
def first_change_of(work, row, sign, noise):  # type: ignore[no-untyped-def]
    """Return `first_change` of a row of values; coefficients are computed only if the values leave a doubt."""
    if keeps_sign(work, row, noise):
        found = 1 if work[row] > 0.0 else -1
        if sign == 0 or found == sign:
            return 2.0, found, 2.0
    to_coefficients(work, row, work, SERIES)
    return first_change(work[SERIES : SERIES + COUNT], sign, noise)


@Inner
def fits(forces, work):  # type: ignore[no-untyped-def]
    """Return whether a body with a radius fits into its track all along a panel."""
    return not forces.has_radius or first_change_of(work, DS, 1, 0.0)[0] > 1.0


@Inner
def kink(work):  # type: ignore[no-untyped-def]
    """Return the place x where the curvature changes sign; 2 if it does not, -1 if that is not resolved.

    The sign is that of ds kappa, which is also smooth at cusps.
    """
    product(work, LOAD, DS, KAPPA)
    size = size_of(work, LOAD)
    if not examine(work, LOAD, size)[2]:
        return -1.0
    return first_change_of(work, LOAD, 0, CANCELLATION_NOISE * size)[0]


@Inner
def first_jump(at_start, work):  # type: ignore[no-untyped-def]
    """Return the shares of a panel at the node that is one before the first jump of Q, and at the node behind it; or 1
    and 2 if there is none. At the start Q is ``at_start``, and both ends count as nodes.

    Where friction has a kink, its derivative with respect to V**2 jumps. Between the first node returned and the jump
    there is some room, so that a panel that begins there has nodes on both sides of it.
    """
    low, high = extent(work, Q)
    least = max(JUMP_SHARE * (high - low), ROUNDED_CHANGE / work[D + COUNT])
    earlier, before, value = 0.0, 0.0, at_start
    for j in range(WIDE):
        if fabs(work[Q + j] - value) > least:
            return earlier, work[NODES + j]
        earlier, before, value = before, work[NODES + j], work[Q + j]
    return 1.0, 2.0


@Inner
def is_curve_resolved(width, work):  # type: ignore[no-untyped-def]
    """Return whether the rows that do not depend on V**2 are resolved, and their largest ratio of middle
    coefficients.
    """
    work[size_at(DS)], work[size_at(Q_RATE)] = size_of(work, DS), max(size_of(work, Q_RATE), 1.0 / width)
    return are_resolved(work, Q_RATE, P)


@Inlined
def tail_of(work):  # type: ignore[no-untyped-def]
    """Return the largest of the last coefficients of the row examined last."""
    return max(abs(work[TAILS]), max(abs(work[TAILS + 1]), abs(work[TAILS + 2])))
