"""The panels of a leg: each as wide as V**2, the forces and the time rate can be resolved on it by a polynomial.

What the forces between two breaks do to a body is kept, and bodies pass that gap by it where forces are linear in V**2.
Then ``V**2 = (w + G)/(1 + E)`` with w = V**2 at the first break, E = exp(q) - 1, and the integral G of exp(q) P
(`leg_equation`): E and G depend on the place alone. With the middle M of G's range in ``u = w + M``, and the rest of it
in ``H = G - M``, the time over the gap is the integral of ``ds sqrt(1 + E)/sqrt(u + H)``. As a series it is a sum of
powers of 1/u, each with the integral of ``ds sqrt(1 + E) H**k``, which is kept. It is used where H is small against u;
nearer to a turn V**2 and the rate of time follow at nodes from the rows that are kept.
"""

from math import fabs, inf, nan, sqrt
from typing import NamedTuple

import numpy as np

from gqm_sym.runtime.compiled.calls import call_speed_equation
from gqm_sym.runtime.compiled.intrinsics import bits, fma, from_bits
from gqm_sym.runtime.compiled.jit import Inlined, Inner
from gqm_sym.runtime.compiled.registers import on_stack, over_rows
from gqm_sym.runtime.legs.leg_breaks import offset, within
from gqm_sym.runtime.legs.leg_equation import (
    DS,
    EXPM1_Q,
    FORCE,
    KAPPA,
    LOAD,
    MEAN,
    N0,
    OFFSET,
    Q_RATE,
    SERIES,
    SIZES,
    SPEED,
    TAILS,
    TIME_RATE,
    W_FACTOR,
    D,
    P,
    W,
    as_factor,
    begin_panel,
    distance,
    fill_force,
    fill_rates,
    load_row,
    load_size_row,
    product,
    root_row,
    slope_at,
    solution_row,
    solve_panel,
    time_rate_row,
)
from gqm_sym.runtime.legs.leg_record import change_at, copy, tail_of
from gqm_sym.runtime.legs.polynomials import (
    COUNT,
    LEBESGUE,
    SHARES,
    WIDE,
    extent,
    first_change,
    size_of,
    to_coefficients,
    to_means,
    to_tails,
)

# The last coefficients of a resolved function against the largest one; noise in them is about 1e-16.
TAIL_RATIO = 4e-16

# Below this ratio coefficients that no longer decrease are rounding noise, not structure.
NOISE_LEVEL = 1e-9

# The last coefficients of N against the largest one that suffice where N has one sign at all nodes, because its changes
# of sign are decided to no more than that (`leg_run.ZERO_TOLERANCE`); and those where it is far from zero throughout.
ONE_SIGN_RATIO, FAR_FROM_ZERO_RATIO = 1e-14, 1e-7

# What rounding may leave of a function that vanishes by cancellation, as a share of its parts.
CANCELLATION_NOISE = 1e-15

# A width of a few units in the last place of the curve's parameter.
MIN_RELATIVE_WIDTH = 1e-15

# Coefficients that decrease by this factor with each degree reach TAIL_RATIO at the end; those in the middle are this
# many degrees from the first.
DECREASE, DEGREES = 5.4, 15

# The bits of 1.0, and those that x**(-1/DEGREES) has for x = 1 if logarithms are linear between powers of two.
ONE = 0x3FF0000000000000
LINEAR_LOGARITHM = ONE + ONE // DEGREES

# From this ratio on of its coefficients to all others the time rate is taken to have a turning point ahead.
TURNING_RATIO = 10.0

# How far a singularity is from the panel's middle, in half widths, if coefficients decrease by that factor.
SINGULARITY_DISTANCE = 0.5 * (DECREASE + 1.0 / DECREASE)

# A factor by which panels are narrower than they seem to be allowed to be, and the most by which they grow.
SAFETY_FACTOR, MAX_GROWTH = 0.9, 4.0

# The ratio of V**2 at a panel's end to the largest V**2 so far above which time is resolved. Below it a turn is
# expected, and time is counted from there.
HIGH_V2_RATIO = 0.25

# The share of a panel on which V**2 is resolved within which structure of the time rate can only be noise.
NOISE_WIDTH_RATIO = 2.0**-20

# The most panels of a leg, and the most widths that are tried for one.
MAX_PANELS, MAX_WIDTHS = 20000, 2100

# The ratio of V**2 to the largest V**2 so far above which gaps are passed. The time that a rounding of the largest V**2
# costs grows with the root of this ratio, and panels laid one by one take far longer.
GAP_V2_RATIO = 2.0**-6

# The most that H may be as a share of u, and how many powers are summed then.
MAX_SHARE, POWERS = 0.1, 16

# What is kept of a gap: whether it is FILLED, or REFUSED because it is not resolved; E and G at its end; M and the
# largest H; the smallest and the largest 1/(1 + E); bounds of n0 and of the curvature; the factors of the powers; and
# rows from which V**2, N and time follow.
STATE, END_EXPM1, END_GAINED, MIDDLE_GAINED, LARGEST_REST, LEAST_DAMPING, MOST_DAMPING = range(7)
LEAST_N0, MOST_N0, LEAST_KAPPA, MOST_KAPPA = range(7, 11)
FACTORS = 16
FIRST_ROW = FACTORS + POWERS
GAP_ROWS = (EXPM1_Q, SPEED, DS, N0, KAPPA)
GAP_COLUMNS = FIRST_ROW + len(GAP_ROWS) * WIDE
FILLED, REFUSED = 1.0, 2.0

# N on a gap is far from zero if it is more than this share of the largest values of its parts.
FAR_SHARE = 4.0 * FAR_FROM_ZERO_RATIO

# How far it is from the node next to an end of a panel to that end, against the distance of the next node.
TO_END = float(SHARES[0] / (SHARES[1] - SHARES[0]))

# Where ds/dlam changes by this factor or more on a panel, and would vanish within so many units in the last place of
# its start, it does: narrower panels would step over that place, which their roundings hide.
CUSP_RATIO, CUSP_UNITS = 1.5, 32.0
# At a cusp that roots of a polynomial give, ds/dlam is no more than this share of what it is about it.
CUSP_SHARE = 1e-7

# A buffer for the start of a panel, V**2 there, and the five numbers of the speed equation.
start_buffer = on_stack(7)

undamped_row = over_rows(lambda ds, expm1, width: ds * np.sqrt(1.0 + expm1) * width, WIDE)
share_row = over_rows(lambda gained, middle, largest: (gained - middle) / largest, WIDE)

# Whether time has to be resolved.
NEVER, MAYBE, ALWAYS = range(3)


class PanelRequest(NamedTuple):
    """What is asked of the next panel.

    Attributes
    ----------
    max_width : float
        How wide it may be, in the march variable.
    step : float
        The width to begin with.
    largest_v2 : float
        The largest V**2 on the leg so far, less what resistance alone takes of it since.
    timing : int
        ALWAYS if time must be resolved, NEVER if not; MAYBE if it must unless V**2 is below HIGH_V2_RATIO of the
        largest at both ends.
    resolve_load : bool
        Whether N must be resolved as far as its changes of sign need it.
    """

    max_width: float
    step: float
    largest_v2: float
    timing: int
    resolve_load: bool


@Inlined
def size_at(row):  # type: ignore[no-untyped-def]
    """The index of the size that a row's coefficients are compared with."""
    return SIZES + row // WIDE


@Inner
def set_sizes(v2, factor, work):  # type: ignore[no-untyped-def]
    """Set the sizes that coefficients are compared with, but that of the time rate; returns the largest V**2.

    At the panel's start V**2 has the value ``v2``, which is ``factor`` in the unit of W_FACTOR.
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


@Inner
def examine(work, row, size):  # type: ignore[no-untyped-def]
    """The size of a function's last coefficients, that of some in the middle, and whether the function is resolved."""
    to_tails(work, row, work, TAILS)
    tail, middle = tail_of(work), max(fabs(work[TAILS + 3]), max(fabs(work[TAILS + 4]), fabs(work[TAILS + 5])))
    return tail, middle, tail <= TAIL_RATIO * size or (middle <= NOISE_LEVEL * size and tail >= 0.05 * middle)


@Inner
def are_resolved(work, first, last):  # type: ignore[no-untyped-def]
    """Whether rows ``first`` to ``last`` (excluded) are resolved; and their largest ratio of middle coefficients.

    Noise counts as no more than it usually is: where terms of the force cancel, panels would stay narrow for nothing.
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
    """The factor by which coefficients decrease with each degree, by those in the middle; right to a few per cent."""
    return from_bits(LINEAR_LOGARITHM - bits(ratio) // DEGREES)


@Inner
def growth(ratio):  # type: ignore[no-untyped-def]
    """The factor by which a panel may grow, if coefficients are powers of the distance to a singularity."""
    return min(SAFETY_FACTOR / DECREASE * decrease(ratio), MAX_GROWTH) if ratio < inf else 0.5


@Inner
def growth_towards(ratio, side):  # type: ignore[no-untyped-def]
    """The factor by which a panel may grow if the singularity lies ahead, as a turn does for time.

    It is meant for the panel itself (``side`` 1) or for the one that begins at its end (-1). Coefficients decrease as
    for an ellipse through the singularity.
    """
    if not ratio < inf:
        return 0.5
    factor = decrease(ratio)
    return min(SAFETY_FACTOR * (0.5 * (factor + 1.0 / factor) + side) / (SINGULARITY_DISTANCE + 1.0), MAX_GROWTH)


@Inner
def narrower(width, factor):  # type: ignore[no-untyped-def]
    """The width to try next."""
    return width * max(min(factor, 0.9), 0.2)


@Inner
def keeps_sign(work, row, noise):  # type: ignore[no-untyped-def]
    """Whether a function's values are so far from zero that the polynomial through them has no zero."""
    low, high = extent(work, row)
    return fabs(0.5 * (low + high)) > 0.5 * LEBESGUE * (high - low) + noise


@Inner
def is_load_resolved(work):  # type: ignore[no-untyped-def]
    """Whether N is resolved as far as its changes of sign need it, and its ratio of middle coefficients."""
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
    """`first_change` of a row of values; coefficients are computed only if the values leave a doubt."""
    if keeps_sign(work, row, noise):
        found = 1 if work[row] > 0.0 else -1
        if sign == 0 or found == sign:
            return 2.0, found, 2.0
    to_coefficients(work, row, work, SERIES)
    return first_change(work[SERIES : SERIES + COUNT], sign, noise)


@Inner
def kink(work):  # type: ignore[no-untyped-def]
    """The place x where the curvature changes sign: 2 if it does not, -1 if that is not resolved.

    The sign is taken from ds kappa, which is smooth at cusps too.
    """
    product(work, LOAD, DS, KAPPA)
    size = size_of(work, LOAD)
    if not examine(work, LOAD, size)[2]:
        return -1.0
    return first_change_of(work, LOAD, 0, CANCELLATION_NOISE * size)[0]


@Inner
def is_curve_resolved(width, work):  # type: ignore[no-untyped-def]
    """Whether the rows that do not depend on V**2 are resolved, and their largest ratio of middle coefficients."""
    work[size_at(DS)], work[size_at(Q_RATE)] = size_of(work, DS), max(size_of(work, Q_RATE), 1.0 / width)
    return are_resolved(work, Q_RATE, P)


@Inner
def resolve_time(march, panel, request, largest_v2, worst, is_sliver, work):  # type: ignore[no-untyped-def]
    """Whether a panel will do as far as time is concerned.

    ``worst`` is the ratio of middle coefficients of the other functions. On so small a part of a smooth panel that it
    ``is_sliver`` only noise is unresolved, which the error of the time includes.

    Returns
    -------
    done : bool
        Whether the panel will do.
    factor : float
        By how much the next panel may be wider; or this one, if it will not do.
    timed : bool
        Whether time is resolved.
    """
    top, end, factor = max(request.largest_v2, largest_v2), work[W + COUNT], growth(worst)
    is_high = end >= HIGH_V2_RATIO * top or panel.v2 < HIGH_V2_RATIO * top
    needed = request.timing == ALWAYS or (request.timing == MAYBE and is_high)
    timed, ratio = False, 0.0
    if request.timing != NEVER:
        fill_rates(march, panel, work)
        work[size_at(TIME_RATE)] = size_of(work, TIME_RATE)
        timed, ratio = are_resolved(work, TIME_RATE, LOAD)
    timed = timed or (needed and is_sliver and work[TAILS] < inf)
    # Where only time needs narrow panels while V**2 decreases, there is a turn ahead.
    turning = end < panel.v2 and ratio > TURNING_RATIO * worst
    if timed:
        factor = min(factor, growth_towards(ratio, -1.0) if turning else growth(ratio))
    elif needed:
        factor = growth_towards(ratio, 1.0) if turning else growth(ratio)
    return timed or not needed, factor, timed


@Inner
def hides_cusp(forces, march, panel, work):  # type: ignore[no-untyped-def]
    """Whether ds/dlam vanishes between an end of a panel and the node next to it, where no values show it.

    The nodes then make it negative at that end, of the size that it has there.
    """
    last = DS + COUNT - 1
    at_end = work[last] + TO_END * (work[last] - work[last - 1])
    if at_end < 0.0 and work[DS + COUNT] > -0.5 * at_end:
        return True
    at_start = work[DS] + TO_END * (work[DS] - work[DS + 1])
    if at_start >= 0.0:
        return False
    return ds_at(forces, march, panel, distance(panel.left, march)) > -0.5 * at_start


@Inner
def ds_at(forces, march, panel, far):  # type: ignore[no-untyped-def]
    """ds/dlam at a distance from the origin of the march."""
    point, v = start_buffer(), forces.direction
    point[0] = within(march.origin[0] + march.direction * far, panel.span)
    point[1] = panel.v2
    call_speed_equation(forces.speed_equation, 1, point, (0, 1, 2), float(v), float(panel.contact_sign), forces.params)
    return point[2]


@Inner
def is_cusp(forces, march, panel, far, work):  # type: ignore[no-untyped-def]
    """Whether ds/dlam vanishes at a place on a panel, at which the curvature changes sign.

    There the curve turns back on itself, and no panel may end: the next one would begin behind the end of the motion.
    """
    return ds_at(forces, march, panel, far) <= CUSP_SHARE * max(work[DS], work[DS + COUNT - 1])


@Inner
def is_at_cusp(length, unit, work):  # type: ignore[no-untyped-def]
    """Whether ds/dlam vanishes next to the start of a panel of a length, given a unit in the last place."""
    first, last = work[DS], work[DS + COUNT - 1]
    if last > first:  # it vanishes as far before the start as it takes to grow to its first value
        return last > CUSP_RATIO * first and length * first <= CUSP_UNITS * unit * last
    return first > CUSP_RATIO * last and length <= CUSP_UNITS * unit


@Inner
def next_panel(forces, march, panel, request, work):  # type: ignore[no-untyped-def]
    """The widest panel from a start on that can be resolved.

    Returns
    -------
    width : float
        In the march variable; 0 if no width suffices that doubles can represent.
    step : float
        The width to begin with on the next panel.
    timed : bool
        Whether time is resolved.
    """
    step, ends_at_kink, widest = request.step, False, 0.0
    start, slope = distance(panel.left, march), slope_at(panel.left, march)
    unit = MIN_RELATIVE_WIDTH * max(fabs(march.origin[0] + march.direction * start), start)
    # What is left of a leg may be hardly wider than the last panel may be narrow.
    width = min(max(step, 4.0 * unit / (slope + sqrt(slope * slope + 8.0 * march.g * unit))), request.max_width)
    # Where rows are known before V**2 is, they show most panels that are too wide.
    curve_first = forces.linear and not forces.kinked
    last = Q_RATE if curve_first else P
    for _ in range(MAX_WIDTHS):
        length = width * (slope + march.g * width)
        # A panel may be narrower than places in doubles if its end is given: distances on it keep their digits.
        if (length <= unit and width < request.max_width) or length < 1e-300:
            return 0.0, step, False
        begin_panel(forces, march, panel, width, work)
        ratio = 0.0
        if curve_first:
            fine, ratio = is_curve_resolved(width, work)
            if not fine:
                width = narrower(width, growth(ratio))
                continue
        q = solve_panel(forces, march, panel, work)
        if forces.kinked and not ends_at_kink and (q < inf or forces.linear):
            x = kink(work)
            to_kink = width * (0.5 * (1.0 + x) if x > -1.0 else 0.5)
            # A leg that begins at a kink may begin a rounding before it.
            far = to_kink * (slope + march.g * to_kink)
            if x <= 1.0 and far > unit and not (x > -1.0 and is_cusp(forces, march, panel, start + far, work)):
                width, ends_at_kink = to_kink, x > -1.0
                continue
            load_row(work, LOAD, DS, N0, KAPPA, W)
        if not q < inf:
            width, ends_at_kink = 0.5 * width, False
            continue
        largest_v2 = set_sizes(panel.v2, as_factor(panel.v2, march, panel.left), work)
        fine, worst = are_resolved(work, W_FACTOR, last)
        worst = max(worst, ratio)
        if request.resolve_load:
            load_fine, ratio = is_load_resolved(work)
            fine, worst = fine and load_fine, max(worst, ratio)
        factor = growth(worst)
        if fine and not hides_cusp(forces, march, panel, work):
            widest = max(widest, width)
            is_sliver = width <= NOISE_WIDTH_RATIO * widest
            done, factor, timed = resolve_time(march, panel, request, largest_v2, worst, is_sliver, work)
            if is_at_cusp(length, unit, work):
                return 0.0, step, False
            if done:
                grown = width * factor
                return width, max(step, grown) if ends_at_kink or width == request.max_width else grown, timed
        width, ends_at_kink = narrower(width, factor), False
    return 0.0, step, False


@Inner
def range_of(work, row):  # type: ignore[no-untyped-def]
    """Bounds of the polynomial through a row of values."""
    low, high = extent(work, row)
    beyond = 0.5 * (LEBESGUE - 1.0) * (high - low)
    return low - beyond, high + beyond


@Inner
def fill_gap(forces, march, panel, width, gaps, at, work):  # type: ignore[no-untyped-def]
    """Fill what is kept of a panel from break to break, from ``gaps[at]`` on."""
    gaps[at] = REFUSED
    begin_panel(forces, march, panel, width, work)
    if not fill_force(march, work) < inf:
        return
    to_means(work, FORCE, work, MEAN)
    product(work, SPEED, OFFSET, MEAN)
    work[size_at(FORCE)] = size_of(work, FORCE)
    if not (is_curve_resolved(width, work)[0] and are_resolved(work, FORCE, Q_RATE)[0]):
        return
    if forces.kinked and not kink(work) > 1.0:
        return
    for row in (N0, KAPPA):
        if not examine(work, row, size_of(work, row))[0] <= ONE_SIGN_RATIO * size_of(work, row):
            return
    for k, row in enumerate(GAP_ROWS):
        copy(gaps, at + FIRST_ROW + k * WIDE, work, row)
    (least, most), (low, high) = extent(work, EXPM1_Q), extent(work, SPEED)
    middle, largest = 0.5 * (low + high), max(0.5 * (high - low), 1e-300)
    gaps[at + END_EXPM1], gaps[at + END_GAINED] = work[EXPM1_Q + COUNT], work[SPEED + COUNT]
    gaps[at + MIDDLE_GAINED], gaps[at + LARGEST_REST] = middle, largest
    gaps[at + LEAST_DAMPING], gaps[at + MOST_DAMPING] = 1.0 / (1.0 + most), 1.0 / (1.0 + least)
    gaps[at + LEAST_N0], gaps[at + MOST_N0] = range_of(work, N0)
    gaps[at + LEAST_KAPPA], gaps[at + MOST_KAPPA] = range_of(work, KAPPA)
    undamped_row(work, SERIES, DS, EXPM1_Q, width)
    share_row(work, MEAN, SPEED, middle, largest)
    binomial = 1.0
    for k in range(POWERS):
        to_tails(work, SERIES, work, TAILS)
        gaps[at + FACTORS + k] = binomial * work[TAILS + 6]
        product(work, SERIES, SERIES, MEAN)
        binomial *= -(k + 0.5) / (k + 1.0)
    gaps[at] = FILLED


class Bounds(NamedTuple):
    """Between which numbers V**2 and the contact force per mass are on a gap."""

    least_v2: float
    most_v2: float
    least_load: float
    most_load: float


@Inner
def pass_by_powers(v2, contact_sign, gaps, at):  # type: ignore[no-untyped-def]
    """The time over a gap at whose start V**2 is ``v2``, V**2 at its end, and bounds on it.

    The time is NaN where V**2 changes too much for a few powers, or N may be near zero.
    """
    u, h = v2 + gaps[at + MIDDLE_GAINED], gaps[at + LARGEST_REST]
    low, high = (u - h) * gaps[at + LEAST_DAMPING], (u + h) * gaps[at + MOST_DAMPING]
    flat, steep = gaps[at + LEAST_KAPPA], gaps[at + MOST_KAPPA]
    least, most = gaps[at + LEAST_N0], gaps[at + MOST_N0]
    size = max(fabs(least), fabs(most)) + max(fabs(flat), fabs(steep)) * high
    bounds = Bounds(low, high, least + min(flat * low, flat * high), most + max(steep * low, steep * high))
    load = bounds.least_load if contact_sign > 0 else -bounds.most_load
    if gaps[at] != FILLED or not h <= MAX_SHARE * u or not load > FAR_SHARE * size:
        return nan, nan, bounds
    share, total = h / u, 0.0
    for k in range(POWERS - 1, -1, -1):
        total = fma(total, share, gaps[at + FACTORS + k])
    lost = gaps[at + END_EXPM1]
    return total / sqrt(u), v2 + (gaps[at + END_GAINED] - v2 * lost) / (1.0 + lost), bounds


@Inner
def pass_by_rows(v2, contact_sign, width, gaps, at, work):  # type: ignore[no-untyped-def]
    """The time over a gap, V**2 at its end, and the largest V**2 on it; fills V**2, Y and the rate of time at nodes.

    The time is NaN where the curve or time is not resolved, V**2 vanishes or N may change its sign.
    """
    if gaps[at] != FILLED:
        return nan, nan, nan
    for k, row in enumerate(GAP_ROWS):
        copy(work, row, gaps, at + FIRST_ROW + k * WIDE)
    solution_row(work, W, SPEED, EXPM1_Q, v2)
    load_row(work, LOAD, DS, N0, KAPPA, W)
    load_size_row(work, MEAN, DS, N0, KAPPA, W)
    end, (low, high) = work[W + COUNT], extent(work, W)
    if not (min(low, end) > 0.0 and contact_sign * work[LOAD] > 0.0):
        return nan, end, high
    root_row(work, SPEED, W)
    time_rate_row(work, TIME_RATE, DS, SPEED, 1.0)
    fine = examine(work, TIME_RATE, size_of(work, TIME_RATE))[2]
    if not (fine and keeps_sign(work, LOAD, FAR_SHARE * extent(work, MEAN)[1])):
        return nan, end, high
    return width * work[TAILS + 6], end, high


@Inner
def next_stop(march, passed, length_back, record, breaks, remaining):  # type: ignore[no-untyped-def]
    """On the way back, the distance at which the next panel must end.

    Parameters
    ----------
    passed, length_back : float
        The distance that was followed back so far, and that to follow.
    remaining : (int, int, int)
        The index of the next change of N's sign, that of the next break, and the sign of N.

    Returns
    -------
    stop : float
    remaining : (int, int, int)
    """
    change, upcoming, contact_sign = remaining
    origin, u, stop = march.origin, march.direction, length_back
    # Distances are compared, because the distance to a stop was given as such: its place may be a rounding farther.
    while change >= 0 and offset(record[change_at(record, change)], origin, u) <= passed:
        change, contact_sign = change - 1, -contact_sign
    while upcoming >= 0 and offset(breaks[upcoming], origin, u) <= passed:
        upcoming -= 1
    if change >= 0:
        stop = min(stop, offset(record[change_at(record, change)], origin, u))
    if upcoming >= 0:
        stop = min(stop, offset(breaks[upcoming], origin, u))
    return stop, (change, upcoming, contact_sign)
