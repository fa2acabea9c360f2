"""The effect of the forces between two breaks of the curve on a body, kept for all bodies that pass.

If the forces are linear in V**2, bodies pass such a gap by these data. Then ``V**2 = (w + G)/(1 + E)`` with w = V**2 at
the first break, E = exp(q) - 1, and the integral G of exp(q) P (`panels.equation`): E and G depend on the place alone.
With the middle M of G's range in ``u = w + M``, and the rest of it in ``H = G - M``, the time over the gap is the
integral of ``ds sqrt(1 + E)/sqrt(u + H)``. As a series it is a sum of powers of 1/u, each with the integral of ``ds
sqrt(1 + E) H**k``, which is kept. The series is used if H is small compared with u; nearer to a turn V**2 and the rate
of time are found at nodes from the rows that are kept.
"""

from math import fabs, inf, nan, sqrt
from typing import NamedTuple

import numpy as np

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.compiled.intrinsics import fma
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import over_rows
from gqm_sym.runtime.legs.leg_record import (
    COLUMNS,
    HEAD,
    NO_RATES,
    NO_VALUES,
    NORMAL_LOAD,
    PASSAGE,
    PEAKS,
    RIGHT,
    TIME,
    TIME_ERROR,
    Y_ROW,
    has_space,
)
from gqm_sym.runtime.legs.panels.breaks import clearance, offset
from gqm_sym.runtime.legs.panels.equation import (
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
    SPEED,
    TAILS,
    TIME_RATE,
    March,
    Panel,
    W,
    begin_panel,
    copy,
    fill_force,
    load_per_mass_row,
    load_row,
    load_size_row,
    marched,
    product,
    root_row,
    solution_row,
    time_rate_row,
)
from gqm_sym.runtime.legs.panels.polynomials import COUNT, LEBESGUE, WIDE, extent, size_of, to_means, to_tails
from gqm_sym.runtime.legs.panels.resolution import (
    FAR_FROM_ZERO_RATIO,
    ONE_SIGN_RATIO,
    are_resolved,
    examine,
    is_curve_resolved,
    keeps_sign,
    kink,
    size_at,
)
from gqm_sym.runtime.legs.runs.route import CurveAhead

# The ratio of V**2 to the largest V**2 so far above which gaps are passed by kept data. Near a turn a rounding of the
# largest V**2 has a larger effect on the time, but panels laid one by one take far longer.
GAP_V2_RATIO = 2.0**-6

# The largest share of u that H may be, and the number of powers that are summed then.
MAX_SHARE, POWERS = 0.1, 16

# The data kept of a gap: whether it is FILLED, or REFUSED because it is not resolved; E and G at its end; M and the
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

undamped_row = over_rows(lambda ds, expm1, width: ds * np.sqrt(1.0 + expm1) * width, WIDE)
share_row = over_rows(lambda gained, middle, largest: (gained - middle) / largest, WIDE)


@Inner
def range_of(work, row):  # type: ignore[no-untyped-def]
    """Return bounds of the polynomial through a row of values."""
    low, high = extent(work, row)
    beyond = 0.5 * (LEBESGUE - 1.0) * (high - low)
    return low - beyond, high + beyond


@Inner
def fill_gap(forces, march, panel, width, gaps, at, work):  # type: ignore[no-untyped-def]
    """Fill the data kept of a gap, the panel from one break to the next, from ``gaps[at]`` on."""
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
    """Bounds of V**2 and of the contact force per mass on a gap."""

    least_v2: float
    most_v2: float
    least_load: float
    most_load: float


@Inner
def pass_by_powers(v2, contact_sign, gaps, at):  # type: ignore[no-untyped-def]
    """Return the time over a gap at whose start V**2 is ``v2``, V**2 at its end, and bounds on the gap.

    The time is NaN if V**2 changes too much for a few powers, or N may be near zero.
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
    """Return the time over a gap, V**2 at its end, and the largest V**2 on it; fill V**2, Y and the rate of time at
    nodes.

    The time is NaN if the curve or the time is not resolved, V**2 vanishes, or N may change its sign.
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


# The relative error of times that are summed in another order.
ROUNDINGS_OF_TIMES = 1e-12


class RunState(NamedTuple):
    """The state of a run.

    Attributes
    ----------
    left, run_length : float
        The march variable and the distance from the origin.
    v2, largest_v2 : float
        V**2 there, and the largest so far.
    ahead : CurveAhead
    panel_count : int
        The number of recorded panels.
    """

    left: float
    run_length: float
    v2: float
    largest_v2: float
    ahead: CurveAhead
    panel_count: int


@Inner
def ends_of_gap(all_breaks, period, gap):  # type: ignore[no-untyped-def]
    """Return the places between which a gap lies; the last gap of a closed curve extends to the first break of the next
    lap.
    """
    return all_breaks[gap], (all_breaks[gap + 1] if gap + 1 < all_breaks.size else all_breaks[0] + period)


@Inner
def may_be_peak(reading, bounds):  # type: ignore[no-untyped-def]
    """Return whether the extreme to be found may be on a gap with these bounds."""
    if reading.force:
        return (bounds.most_load if reading.sign > 0.0 else -bounds.least_load) > reading.best
    return (sqrt(bounds.most_v2) if reading.sign > 0.0 else -sqrt(bounds.least_v2)) > reading.best


@Inner
def is_read_inside(route, places, times):  # type: ignore[no-untyped-def]
    """Return whether a gap contains the place or the time up to which a leg is read, which requires a panel."""
    if route.reading.what == PASSAGE:
        return min(places) <= route.target <= max(places)
    near = ROUNDINGS_OF_TIMES * times[1]
    return times[0] - near <= route.until <= times[1] + near


@Inner
def pass_gaps(forces, march, route, contact_sign, before, record, work):  # type: ignore[no-untyped-def]
    """Pass gaps from the break ahead on, as long as V**2 is large and follows from the kept data."""
    (left, run_length, v2, largest_v2, ahead, count), v, spent = before, march.direction, 0.0
    breaks, gaps, upcoming, reads = route.breaks, route.gaps, ahead.upcoming, route.reading.what
    to, total, total_low, may_join = HEAD + count * COLUMNS, 0.0, 0.0, False
    for k in range(count):
        spent += record[HEAD + k * COLUMNS + TIME]
    while gaps.size > 0 and upcoming + 1 < breaks.size and v2 >= GAP_V2_RATIO * largest_v2:
        start, stop = breaks[upcoming], breaks[upcoming + 1]
        # If a panel is laid once more, the break may lie behind already.
        is_ahead = offset(start, march.origin, v) == run_length
        if contact_sign in (0, -route.only_sign) or not (is_ahead and has_space(record, to, 0)):
            break
        gap = (route.first_break + (upcoming if v > 0 else -upcoming - 1)) % route.all_breaks.size
        low, high = ends_of_gap(route.all_breaks, route.period, gap)
        at, width = GAP_COLUMNS * (4 * gap + (v + 1) + (contact_sign + 1) // 2), high - low
        if gaps[at] == 0.0:
            off, begin_at = clearance(low, high), low if v > 0 else high
            panel = Panel(0.0, 0.0, contact_sign, (low + off, high - off))
            fill_gap(forces, March((begin_at, 0.0), v, 0.0, 1.0), panel, width, gaps, at, work)
        time, end, bounds = pass_by_powers(v2, contact_sign, gaps, at)
        top, has_values = bounds.most_v2, reads == PEAKS and not (time > 0.0 and not may_be_peak(route.reading, bounds))
        if has_values or not time > 0.0:
            time, end, top = pass_by_rows(v2, contact_sign, width, gaps, at, work)
        if not time > 0.0 or is_read_inside(route, (start, stop), (spent, spent + time)):
            break
        largest_v2 = max(largest_v2 / (1.0 + gaps[at + END_EXPM1]), max(v2, top))
        v2, upcoming, spent = end, upcoming + 1, spent + time
        run_length = offset(stop, march.origin, v)
        # Successive gaps from which only the time is read become one entry of the record.
        to += COLUMNS if may_join and has_values else 0
        total, rounding = two_sum(total if may_join and not has_values else 0.0, time)
        total_low = rounding + (total_low if may_join and not has_values else 0.0)
        if has_values:
            load_per_mass_row(work, MEAN, N0, KAPPA, W)
            copy(record, to + Y_ROW, work, SPEED)
            copy(record, to + NORMAL_LOAD, work, MEAN)
        record[to + RIGHT], record[to + TIME] = marched(run_length, march), total + total_low
        record[to + TIME_ERROR], may_join = NO_RATES if has_values else NO_VALUES, not has_values
        to += COLUMNS if has_values else 0
    if upcoming > ahead.upcoming:
        left, ahead = marched(run_length, march), CurveAhead(upcoming, ahead.span, inf, True)
        count = (to - HEAD) // COLUMNS + (1 if may_join else 0)
    return RunState(left, run_length, v2, largest_v2, ahead, count)
