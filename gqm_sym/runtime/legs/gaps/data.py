"""The data kept of the gaps between two breaks of the curve (`passing`), and V**2 on a gap with friction in space."""

from itertools import accumulate
from math import inf, nan, sqrt
from typing import NamedTuple

import numpy as np

from gqm_sym.runtime.arithmetic.matrices import multiply
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import over_rows
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.legs.panels.equation import (
    ARC_RATE,
    AT_REST,
    DS,
    EXPM1_Q,
    FORCE,
    GRADED,
    KAPPA,
    LENGTH,
    LOAD,
    MEAN,
    MIXED,
    N0,
    NODES,
    OFFSET,
    PLAIN_P,
    PLAIN_Q,
    Q_RATE,
    RUBBING,
    SERIES,
    SPEED,
    TAILS,
    TIME_RATE,
    TURNING,
    D,
    March,
    Panel,
    W,
    copy,
    copy_row,
    fill_force,
    fill_square,
    length_row,
    linear_row,
    load_row,
    load_size_row,
    product,
    solution_row,
)
from gqm_sym.runtime.legs.panels.few_nodes import ROOM_FOR_FEW, keep_few
from gqm_sym.runtime.legs.panels.polynomials import (
    COUNT,
    LEBESGUE,
    WIDE,
    extent,
    series_at,
    size_of,
    to_coefficients,
    to_means,
    to_tails,
)
from gqm_sym.runtime.legs.panels.resolution import (
    FAR_FROM_ZERO_RATIO,
    ONE_SIGN_RATIO,
    are_resolved,
    examine,
    fits,
    is_curve_resolved,
    kink,
    size_at,
)
from gqm_sym.runtime.legs.panels.solving import begin_panel, solve_nonlinear

# The largest share of u that H may be; the number of powers of the share in whose sum all others are below rounding
# then; and the number of coefficients of a polynomial that differs from this sum by less than a rounding.
MAX_SHARE, POWERS, COEFFICIENTS = 0.3, 32, 16

# The number of gaps of a block, which are passed as one where V**2 changes little.
BLOCK = 6

# With friction in space, the number of coefficients of a function of V**2 on an octave of it, the number of values that
# are kept for an octave, and the number of octaves of a block for which there is room beside the data of each gap
# (`gaps.octaves`).
OCTAVE_TERMS, OCTAVE_COLUMNS, OCTAVES_OF_GAP = 16, 40, 2

# The data kept of a gap: whether it is FILLED, or REFUSED because it is not resolved; E and G at its end; M and the
# largest H; the smallest and the largest 1/(1 + E); bounds of n0 and of the curvature, and of the coefficients of
# (N/m)**2; the coefficients of the polynomial for time; and rows from which V**2, N and time follow. With friction in
# space the first two of the rows are those of P and Q without friction, and WITH_FEW tells whether the gap is so short
# that few nodes suffice (`panels.few_nodes`), whose rows come next. The data of the block that begins with the gap, up
# to the coefficients, come next; their state is 0 as long as they are not known. Octaves of the block in which the gap
# lies come last.
STATE, END_EXPM1, END_GAINED, MIDDLE_GAINED, LARGEST_REST, LEAST_DAMPING, MOST_DAMPING = range(7)
LEAST_N0, MOST_N0, LEAST_KAPPA, MOST_KAPPA = range(7, 11)
BOUNDS_OF_SQUARE, WITH_FEW, FACTORS = 11, 17, 24
LOWER_BOUNDS = (LEAST_DAMPING, LEAST_N0, LEAST_KAPPA, *range(BOUNDS_OF_SQUARE, WITH_FEW, 2))
FIRST_ROW = FACTORS + COEFFICIENTS
GAP_ROWS, FRICTION_ROWS = (EXPM1_Q, MEAN, DS, N0, KAPPA, FORCE), (PLAIN_P, PLAIN_Q, DS, N0, KAPPA)
SQUARE_ROWS = (AT_REST, MIXED, TURNING, RUBBING)
FIRST_SQUARE = FIRST_ROW + len(GAP_ROWS) * WIDE
FIRST_OF_FEW = FIRST_SQUARE + len(SQUARE_ROWS) * WIDE
FIRST_OF_BLOCK = FIRST_OF_FEW + ROOM_FOR_FEW
FIRST_OF_OCTAVES = FIRST_OF_BLOCK + FIRST_ROW

# For laws that depend on the speed, the places of the nodes (`places`), and the lines of `flows`.
LINES, LINE_COLUMNS = 33, 13 + 2 * WIDE
TAG, FIRST_LINE = 0, FIRST_ROW + WIDE

# V**2 above which bodies do not reach a turn on the next gaps, as far as lines show.
FASTEST = 1

GAP_COLUMNS = max(FIRST_OF_OCTAVES + OCTAVES_OF_GAP * OCTAVE_COLUMNS, FIRST_LINE + LINES * LINE_COLUMNS)
FILLED, REFUSED = 1.0, 2.0

# The share of the square of the contact force in its terms below which it loses digits.
LEAST_SHARE = 1e-2

# N on a gap is far from zero if it is more than this share of the largest values of its parts.
FAR_SHARE = 4.0 * FAR_FROM_ZERO_RATIO

# The part of a gap on which a turn is sought is longer than the estimated distance of the turn by this factor.
ENOUGH = 1.03

# Where the force almost vanishes along a whole gap, as where friction balances the weight, its coefficients are
# compared with this share of n0, because a rounding of a chart's angle changes it by a rounding of n0.
NOISE_OF_FORCE = 2.0**-5

# Rows of a panel that are not needed here, for the integrals of powers of H.
MOMENTS = TIME_RATE


def _to_coefficients() -> np.ndarray:
    """Return the matrix that takes the integrals of the powers of H, in units of the largest H, to the coefficients of
    the polynomial for time, in terms of t from -1, where the share H of u is 0, to 1, where it is MAX_SHARE.
    """
    rows = []
    for k, binomial in enumerate(accumulate(range(1, POWERS), lambda b, k: -b * (k - 0.5) / k, initial=1.0)):
        power = binomial * (0.5 * MAX_SHARE) ** k * np.polynomial.polynomial.polypow((1.0, 1.0), k)
        series = np.polynomial.chebyshev.poly2cheb(power)[:COEFFICIENTS]
        polynomial = np.polynomial.chebyshev.cheb2poly(series)
        rows.append(np.pad(polynomial, (0, COEFFICIENTS - polynomial.size)))
    return np.array(rows)


to_time_coefficients = multiply(_to_coefficients())
square_size_row = over_rows(lambda a, c, w: a + c * (w * w), WIDE)
undamped_row = over_rows(lambda ds, expm1, width: ds * np.sqrt(1.0 + expm1) * width, WIDE)
share_row = over_rows(lambda gained, middle, largest: (gained - middle) / largest, WIDE)


@Inner
def range_of(work, row):  # type: ignore[no-untyped-def]
    """Return bounds of the polynomial through a row of values."""
    low, high = extent(work, row)
    beyond = 0.5 * (LEBESGUE - 1.0) * (high - low)
    return low - beyond, high + beyond


@Inner
def keep_rows(forces, gaps, at, work):  # type: ignore[no-untyped-def]
    """Keep the rows of a gap."""
    if forces.linear:
        for k, row in enumerate(GAP_ROWS):
            copy(gaps, at + FIRST_ROW + k * WIDE, work, row)
    else:
        for k, row in enumerate(FRICTION_ROWS):
            copy(gaps, at + FIRST_ROW + k * WIDE, work, row)
    for k, row in enumerate(SQUARE_ROWS):
        copy(gaps, at + FIRST_SQUARE + k * WIDE, work, row)


@Inner
def is_square_kept(gaps, at, work):  # type: ignore[no-untyped-def]
    """Keep bounds of the coefficients of (N/m)**2; return whether these are resolved."""
    is_resolved, first, last = True, size_of(work, AT_REST), size_of(work, TURNING)
    for row, size in ((AT_REST, first), (MIXED, 2.0 * sqrt(first * last)), (TURNING, last)):
        is_resolved = is_resolved and examine(work, row, size)[0] <= ONE_SIGN_RATIO * size
    to = at + BOUNDS_OF_SQUARE
    gaps[to], gaps[to + 1] = range_of(work, AT_REST)
    gaps[to + 2], gaps[to + 3] = range_of(work, MIXED)
    gaps[to + 4], gaps[to + 5] = range_of(work, TURNING)
    return is_resolved


def room_kept(breaks: int, *, with_blocks: bool) -> Array:
    """Return room for the data kept of a curve with so many breaks; blocks of gaps are kept only if that is asked for,
    because they pay only if many bodies pass them.
    """
    room = np.zeros(4 * GAP_COLUMNS * breaks + 1)
    room[-1] = 0.0 if with_blocks else REFUSED
    return room


@Inner
def forget(gaps):  # type: ignore[no-untyped-def]
    """Forget the data kept of all gaps and blocks, because the next body has other run-time parameters."""
    for at in range(0, gaps.size - 1, GAP_COLUMNS):
        gaps[at] = gaps[at + FIRST_OF_BLOCK] = 0.0


@Inner
def keeps_blocks(gaps):  # type: ignore[no-untyped-def]
    """Return whether data of blocks are kept."""
    return gaps[gaps.size - 1] != REFUSED


@Inner
def read_gained(width, gaps, at, work):  # type: ignore[no-untyped-def]
    """Read the rows kept of a gap, for forces that are linear in V**2, and fill the row SPEED with G."""
    for k, row in enumerate(GAP_ROWS):
        copy(work, row, gaps, at + FIRST_ROW + k * WIDE)
    product(work, SPEED, NODES, width)
    product(work, SPEED, SPEED, MEAN)


@Inner
def read_rows(v2, width, gaps, at, work):  # type: ignore[no-untyped-def]
    """Read the rows kept of a gap at whose start V**2 is ``v2``, for forces that are linear in V**2, and fill W."""
    read_gained(width, gaps, at, work)
    solution_row(work, W, SPEED, EXPM1_Q, v2)


@Inner
def fill_load(work):  # type: ignore[no-untyped-def]
    """Fill the row LOAD, and the size of its terms in MEAN."""
    load_row(work, LOAD, DS, N0, KAPPA, W)
    load_size_row(work, MEAN, DS, N0, KAPPA, W)


@Inner
def clear_moments(work):  # type: ignore[no-untyped-def]
    """Set the integrals of powers of H to 0."""
    for k in range(POWERS):
        work[MOMENTS + k] = 0.0


@Inner
def add_moments(width, before, middle, largest, work):  # type: ignore[no-untyped-def]
    """Add the integrals of powers of H over a gap, from its rows, where G is the row SPEED.

    ``before`` is E and G at the start of the gap, which are not 0 if other gaps lie before it in a block.
    """
    scale = 1.0 + before[0]
    undamped_row(work, SERIES, DS, EXPM1_Q, width * sqrt(scale))
    linear_row(work, MEAN, SPEED, before[1], scale)
    share_row(work, MEAN, MEAN, middle, largest)
    for k in range(POWERS):
        to_tails(work, SERIES, work, TAILS)
        work[MOMENTS + k] += work[TAILS + 6]
        product(work, SERIES, SERIES, MEAN)


@Inner
def keep_range(low, high, gaps, at, work):  # type: ignore[no-untyped-def]
    """Keep the middle of the range of G, and the largest H, of a gap or a block; return them."""
    middle, largest = 0.5 * (low + high), max(0.5 * (high - low), 1e-300)
    gaps[at + MIDDLE_GAINED], gaps[at + LARGEST_REST] = middle, largest
    clear_moments(work)
    return middle, largest


@Inner
def fill_gap(forces, march, panel, width, gaps, at, work):  # type: ignore[no-untyped-def]
    """Fill the data kept of a gap, the panel from one break to the next, from ``gaps[at]`` on."""
    gaps[at] = REFUSED
    begin_panel(forces, march, panel, width, work)
    if not forces.linear:
        if is_curve_resolved(width, work)[0] and is_square_kept(gaps, at, work) and size_of(work, PLAIN_Q) < inf:
            keep_rows(forces, gaps, at, work)
            is_short = keep_few(width, forces.direction, work, gaps, at + FIRST_OF_FEW)
            gaps[at], gaps[at + WITH_FEW] = FILLED, 1.0 if is_short else 0.0
        return
    if not fill_force(march, work) < inf:
        return
    to_means(work, FORCE, work, MEAN)
    product(work, SPEED, OFFSET, MEAN)
    work[size_at(FORCE)] = max(size_of(work, FORCE), NOISE_OF_FORCE * size_of(work, N0))
    if not (is_curve_resolved(width, work)[0] and are_resolved(work, FORCE, Q_RATE)[0]):
        return
    if (forces.kinked and not kink(work) > 1.0) or not fits(forces, work):
        return
    for row in (N0, KAPPA):
        if not examine(work, row, size_of(work, row))[0] <= ONE_SIGN_RATIO * size_of(work, row):
            return
    if forces.squared_contact != 0:
        fill_square(forces, ARC_RATE, work)
        if not is_square_kept(gaps, at, work):
            return
    keep_rows(forces, gaps, at, work)
    (least, most), (low, high) = extent(work, EXPM1_Q), extent(work, SPEED)
    gaps[at + END_EXPM1], gaps[at + END_GAINED] = work[EXPM1_Q + COUNT], work[SPEED + COUNT]
    gaps[at + LEAST_DAMPING], gaps[at + MOST_DAMPING] = 1.0 / (1.0 + most), 1.0 / (1.0 + least)
    gaps[at + LEAST_N0], gaps[at + MOST_N0] = range_of(work, N0)
    gaps[at + LEAST_KAPPA], gaps[at + MOST_KAPPA] = range_of(work, KAPPA)
    middle, largest = keep_range(low, high, gaps, at, work)
    add_moments(width, (0.0, 0.0), middle, largest, work)
    to_time_coefficients(work, MOMENTS, gaps, at + FACTORS)
    gaps[at] = FILLED


@Inner
def behind_gap(before, gaps, at):  # type: ignore[no-untyped-def]
    """Return E and G at the end of a gap in a block, from those at its start."""
    scale = 1.0 + before[0]
    return before[0] + scale * gaps[at + END_EXPM1], before[1] + scale * gaps[at + END_GAINED]


@Inner
def widen_range(extremes, before, gaps, at):  # type: ignore[no-untyped-def]
    """Return the range of G on the first gaps of a block, from that on the gaps before and E and G at the start of the
    last one.
    """
    scale = 1.0 + before[0]
    middle, rest = before[1] + scale * gaps[at + MIDDLE_GAINED], scale * gaps[at + LARGEST_REST]
    return min(extremes[0], middle - rest), max(extremes[1], middle + rest)


@Inner
def widen_bounds(scale, is_first, gaps, at, to):  # type: ignore[no-untyped-def]
    """Widen the bounds kept of a block, from ``gaps[to]`` on, for one more gap, at whose start 1 + E is ``scale``."""
    for low in LOWER_BOUNDS:
        share = 1.0 / scale if low == LEAST_DAMPING else 1.0
        least, most = share * gaps[at + low], share * gaps[at + low + 1]
        gaps[to + low] = least if is_first else min(least, gaps[to + low])
        gaps[to + low + 1] = most if is_first else max(most, gaps[to + low + 1])


class Bounds(NamedTuple):
    """Bounds of V**2 and of the contact force per mass on a gap."""

    least_v2: float
    most_v2: float
    least_load: float
    most_load: float


@Inner
def loads_on(gaps, at, low, high):  # type: ignore[no-untyped-def]
    """Return bounds of V**2 and of the contact force on a gap where V**2 lies between two values."""
    flat, steep = gaps[at + LEAST_KAPPA], gaps[at + MOST_KAPPA]
    least, most = gaps[at + LEAST_N0], gaps[at + MOST_N0]
    return Bounds(low, high, least + min(flat * low, flat * high), most + max(steep * low, steep * high))


@Inner
def lengths_on(gaps, at, low, high):  # type: ignore[no-untyped-def]
    """Return bounds of V**2 and of the length of the contact force on a gap where V**2 lies between two values."""
    to = at + BOUNDS_OF_SQUARE
    least = gaps[to] + min(gaps[to + 2] * low, gaps[to + 2] * high) + gaps[to + 4] * low * low
    most = gaps[to + 1] + max(gaps[to + 3] * low, gaps[to + 3] * high) + gaps[to + 5] * high * high
    return Bounds(low, high, sqrt(max(least, 0.0)), sqrt(max(most, 0.0)))


@Inner
def fill_length_on_gap(gaps, at, work):  # type: ignore[no-untyped-def]
    """Replace the rows N0 and KAPPA by the length of the contact force per mass, and 0."""
    for k, row in enumerate(SQUARE_ROWS):
        copy(work, row, gaps, at + FIRST_SQUARE + k * WIDE)
    length_row(work, N0, AT_REST, MIXED, TURNING, W)
    copy_row(work, KAPPA, 0.0)


@Inner
def read_friction_rows(gaps, at, work):  # type: ignore[no-untyped-def]
    """Read the rows kept of a gap for a law with friction in space."""
    for k, row in enumerate(FRICTION_ROWS):
        copy(work, row, gaps, at + FIRST_ROW + k * WIDE)
    for k, row in enumerate(SQUARE_ROWS):
        copy(work, row, gaps, at + FIRST_SQUARE + k * WIDE)


@Inner
def share_to_turn(forces, v2, width, work):  # type: ignore[no-untyped-def]
    """Return about the share of a gap after which the body turns, from the rows that are read, with friction as on
    average between the start of the gap and a place where the body is at rest; 1 if it does not turn, and infinity if
    it is not slower at the end.
    """
    fast, at_rest = sqrt(work[AT_REST] + v2 * (work[MIXED] + v2 * work[TURNING])), sqrt(work[AT_REST])
    rubbed = 0.5 * (fast + at_rest) * work[RUBBING]
    to_means(work, PLAIN_P, work, MEAN)
    before, y_before = v2, 0.0
    for j in range(WIDE):
        y = work[NODES + j]
        w = v2 + width * y * forces.direction * (work[MEAN + j] - rubbed)
        if not w > 0.0:
            return y_before + (y - y_before) * before / (before - w)
        before, y_before = w, y
    return 1.0 if before < v2 else inf


@Inner
def shorten(begin, share, work):  # type: ignore[no-untyped-def]
    """Replace the rows kept of a gap by those of a part of it."""
    linear_row(work, GRADED, NODES, 4.0 * begin - 2.0, 4.0 * share)
    for row in FRICTION_ROWS + SQUARE_ROWS:
        to_coefficients(work, row, work, SERIES)
        series_at(work, row, GRADED, SERIES)


@Inner
def solve_towards_turn(forces, v2, width, gaps, at, work):  # type: ignore[no-untyped-def]
    """Return the width of the part of a gap on which a turn may be sought, and fill its rows as `solve_on_gap` does for
    the gap; 0 if it is not resolved, or the body does not become slower.

    Far behind a turn, where V**2 is negative, the law may not be resolved.
    """
    read_friction_rows(gaps, at, work)
    share = ENOUGH * share_to_turn(forces, v2, width, work)
    if not share < inf:
        return 0.0
    if share < 1.0:
        width *= share
        shorten(0.0, share, work)
    return width if solve_on_rows(forces, v2, width, work) else 0.0


@Inner
def solve_on_gap(forces, v2, width, gaps, at, work):  # type: ignore[no-untyped-def]
    """Fill the rows W, FORCE and MEAN for a law with friction in space; return whether it converges and V**2, the force
    and N are resolved.
    """
    read_friction_rows(gaps, at, work)
    return solve_on_rows(forces, v2, width, work)


@Inner
def solve_on_rows(forces, v2, width, work):  # type: ignore[no-untyped-def]
    """Do the work of `solve_on_gap` by the rows that are read."""
    product(work, OFFSET, NODES, width)
    copy_row(work, D, OFFSET)
    march, panel = March((0.0, 0.0), forces.direction, 0.0, 1.0), Panel(0.0, v2, 1, (-inf, inf))
    if not solve_nonlinear(forces, march, panel, nan, work) < inf:
        return False
    square_size_row(work, GRADED, AT_REST, TURNING, W)
    low = extent(work, LENGTH)[0]
    return low * low > LEAST_SHARE * extent(work, GRADED)[1] and examine(work, FORCE, size_of(work, FORCE))[2]
