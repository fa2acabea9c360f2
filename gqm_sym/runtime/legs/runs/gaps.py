"""The effect of the forces between two breaks of the curve on a body, kept for all bodies that pass.

If the forces are linear in V**2, bodies pass such a gap by these data. Then ``V**2 = (w + G)/(1 + E)`` with w = V**2 at
the first break, E = exp(q) - 1, and the integral G of exp(q) P (`panels.equation`): E and G depend on the place alone.
With the middle M of G's range in ``u = w + M``, and the rest of it in ``H = G - M``, the time over the gap is the
integral of ``ds sqrt(1 + E)/sqrt(u + H)``. As a series it is a sum of powers of 1/u, each with the integral of ``ds
sqrt(1 + E) H**k``, which is kept. The series is used if H is small compared with u; nearer to a turn V**2 and the rate
of time are found at nodes from the rows that are kept.

Along curves in space the rows also give the square of N/m as a polynomial in V**2 (`interface`). If the law contains
its root because of friction, it is the kept rows of the rest of the law, and friction, from which V**2 follows by
Newton's method, without another look at the curve; on a short gap by one step of it with a few nodes
(`panels.few_nodes`).
"""

from math import fabs, inf, nan, sqrt
from typing import NamedTuple

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.compiled.intrinsics import fma
from gqm_sym.runtime.compiled.jit import Inner
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
    KAPPA,
    LOAD,
    MEAN,
    N0,
    NODES,
    SERIES,
    SPEED,
    TAILS,
    TIME_RATE,
    March,
    Panel,
    W,
    copy,
    load_per_mass_row,
    load_row,
    load_size_row,
    marched,
    product,
    root_row,
    solution_row,
    time_rate_row,
)
from gqm_sym.runtime.legs.panels.few_nodes import pass_few
from gqm_sym.runtime.legs.panels.point import ZERO_TOLERANCE
from gqm_sym.runtime.legs.panels.polynomials import COUNT, WIDE, extent, size_of, sum_and_slope, to_coefficients
from gqm_sym.runtime.legs.panels.resolution import (
    CANCELLATION_NOISE,
    FAR_FROM_ZERO_RATIO,
    examine,
    first_change_of,
    keeps_sign,
)
from gqm_sym.runtime.legs.runs.gap_data import (
    END_EXPM1,
    END_GAINED,
    FACTORS,
    FILLED,
    FIRST_OF_FEW,
    FIRST_ROW,
    GAP_COLUMNS,
    GAP_ROWS,
    LARGEST_REST,
    LEAST_DAMPING,
    LEAST_KAPPA,
    LEAST_N0,
    MAX_SHARE,
    MIDDLE_GAINED,
    MOST_DAMPING,
    MOST_KAPPA,
    MOST_N0,
    POWERS,
    WITH_FEW,
    Bounds,
    fill_gap,
    fill_length_on_gap,
    lengths_on,
    range_of,
    solve_on_gap,
    solve_towards_turn,
)
from gqm_sym.runtime.legs.runs.route import CurveAhead

# The ratio of V**2 to the largest V**2 so far above which gaps are passed by kept data. Near a turn a rounding of the
# largest V**2 has a larger effect on the time, but panels laid one by one take far longer.
GAP_V2_RATIO = 2.0**-6

# N on a gap is far from zero if it is more than this share of the largest values of its parts.
FAR_SHARE = 4.0 * FAR_FROM_ZERO_RATIO


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
def read_rows(v2, width, gaps, at, work):  # type: ignore[no-untyped-def]
    """Read the rows kept of a gap at whose start V**2 is ``v2``, for forces that are linear in V**2, and fill W."""
    for k, row in enumerate(GAP_ROWS):
        copy(work, row, gaps, at + FIRST_ROW + k * WIDE)
    product(work, SPEED, NODES, width)
    product(work, SPEED, SPEED, MEAN)
    solution_row(work, W, SPEED, EXPM1_Q, v2)


@Inner
def fill_load(work):  # type: ignore[no-untyped-def]
    """Fill the row LOAD, and the size of its terms in MEAN."""
    load_row(work, LOAD, DS, N0, KAPPA, W)
    load_size_row(work, MEAN, DS, N0, KAPPA, W)


@Inner
def pass_by_rows(forces, v2, contact_sign, width, gaps, at, work):  # type: ignore[no-untyped-def]
    """Return the time over a gap, V**2 at its end, the largest V**2 on it, and E at its end; fill V**2, Y and the rate
    of time at nodes.

    The time is NaN if the curve or the time is not resolved, V**2 vanishes, or N may change its sign.
    """
    if gaps[at] != FILLED:
        return nan, nan, nan, nan
    if forces.linear:
        read_rows(v2, width, gaps, at, work)
    elif not solve_on_gap(forces, v2, width, gaps, at, work):
        return nan, nan, nan, nan
    fill_load(work)
    end, (low, high), lost = work[W + COUNT], extent(work, W), work[EXPM1_Q + COUNT]
    if not (min(low, end) > 0.0 and contact_sign * work[LOAD] > 0.0):
        return nan, end, high, lost
    root_row(work, SPEED, W)
    time_rate_row(work, TIME_RATE, DS, SPEED, 1.0)
    fine = examine(work, TIME_RATE, size_of(work, TIME_RATE))[2]
    if not (fine and keeps_sign(work, LOAD, FAR_SHARE * extent(work, MEAN)[1])):
        return nan, end, high, lost
    return width * work[TAILS + 6], end, high, lost


# A turn nearer to the start of a gap than this share of it is sought with the mean force from there, which must be more
# than a share of its largest values.
SHORT_SHARE, LEAST_MEAN = 0.25, 0.125

# The number of gaps on which a turn is sought. Gaps before the one with the turn are passed as elsewhere.
GAPS_TO_TURN = 4

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
def kept_gap(forces, route, upcoming, v, contact_sign, work):  # type: ignore[no-untyped-def]
    """Return the position of the data kept of the gap ahead of the break at ``upcoming``, and its width; the data are
    filled in if they are not known yet.
    """
    gaps, gap = route.gaps, (route.first_break + (upcoming if v > 0 else -upcoming - 1)) % route.all_breaks.size
    low, high = ends_of_gap(route.all_breaks, route.period, gap)
    at, width = GAP_COLUMNS * (4 * gap + (v + 1) + (contact_sign + 1) // 2), high - low
    if gaps[at] == 0.0:
        off, begin_at = clearance(low, high), low if v > 0 else high
        panel = Panel(0.0, 0.0, contact_sign, (low + off, high - off))
        fill_gap(forces, March((begin_at, 0.0), v, 0.0, 1.0), panel, width, gaps, at, work)
    return at, width


@Inner
def may_be_peak(reading, bounds):  # type: ignore[no-untyped-def]
    """Return whether the extreme to be found may be on a gap with these bounds."""
    if reading.force:
        return (bounds.most_load if reading.sign > 0.0 else -bounds.least_load) > reading.best
    return (sqrt(bounds.most_v2) if reading.sign > 0.0 else -sqrt(bounds.least_v2)) > reading.best


@Inner
def pass_gap(forces, reading, v2, contact_sign, width, gaps, at, work):  # type: ignore[no-untyped-def]
    """Return what `pass_by_rows` does, by powers or few nodes if that is possible and rows are not read; and whether
    they are.
    """
    time, lost, reads = nan, 0.0, reading.what == PEAKS
    end, bounds = nan, Bounds(0.0, inf, 0.0, inf)
    if forces.linear:
        time, end, bounds = pass_by_powers(v2, contact_sign, gaps, at)
        lost = gaps[at + END_EXPM1]
    elif gaps[at] == FILLED and gaps[at + WITH_FEW] > 0.0:
        time, end, low, high, lost = pass_few(v2, gaps, at + FIRST_OF_FEW)
        bounds = lengths_on(gaps, at, max(low, 0.0), high)
    if forces.linear and reads and time > 0.0 and reading.length:
        bounds = lengths_on(gaps, at, bounds.least_v2, bounds.most_v2)
    top, has_values = bounds.most_v2, reads and not (time > 0.0 and not may_be_peak(reading, bounds))
    if has_values or not time > 0.0:
        time, end, top, lost = pass_by_rows(forces, v2, contact_sign, width, gaps, at, work)
    if has_values and not forces.linear and time > 0.0:
        low, high = range_of(work, W)
        has_values = may_be_peak(reading, lengths_on(gaps, at, max(low, 0.0), high))
    return time, end, top, lost, has_values


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
    breaks, gaps, upcoming = route.breaks, route.gaps, ahead.upcoming
    to, total, total_low, may_join = HEAD + count * COLUMNS, 0.0, 0.0, False
    for k in range(count):
        spent += record[HEAD + k * COLUMNS + TIME]
    while gaps.size > 0 and upcoming + 1 < breaks.size and v2 >= GAP_V2_RATIO * largest_v2:
        start, stop = breaks[upcoming], breaks[upcoming + 1]
        # If a panel is laid once more, the break may lie behind already.
        is_ahead = offset(start, march.origin, v) == run_length
        if contact_sign in (0, -route.only_sign) or not (is_ahead and has_space(record, to, 0)):
            break
        at, width = kept_gap(forces, route, upcoming, v, contact_sign, work)
        time, end, top, lost, has_values = pass_gap(forces, route.reading, v2, contact_sign, width, gaps, at, work)
        if not time > 0.0 or is_read_inside(route, (start, stop), (spent, spent + time)):
            break
        largest_v2 = max(largest_v2 / (1.0 + lost), max(v2, top))
        v2, upcoming, spent = end, upcoming + 1, spent + time
        run_length = offset(stop, march.origin, v)
        # Successive gaps from which only the time is read become one entry of the record.
        to += COLUMNS if may_join and has_values else 0
        total, rounding = two_sum(total if may_join and not has_values else 0.0, time)
        total_low = rounding + (total_low if may_join and not has_values else 0.0)
        if has_values:
            if route.reading.length:
                fill_length_on_gap(gaps, at, work)
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


@Inner
def distance_to_turn(v2, turn, width, work):  # type: ignore[no-untyped-def]
    """Return the distance from the start of a gap or of its first part, where V**2 is ``v2``, at which it vanishes,
    near the zero x = ``turn`` of the series of W; infinity if that has none, and 0 if the distance is not resolved.

    Of a short distance that series has few digits. But the force times exp(q) has the mean ``-v2/d`` up to the distance
    d where V**2 vanishes, and this mean has its digits if it is not small.
    """
    share = 0.5 * (1.0 + turn)
    if share > SHORT_SHARE:
        return width * share if share <= 1.0 else inf
    to_coefficients(work, MEAN, work, SERIES)
    c = work[SERIES : SERIES + COUNT]
    far = v2 / -sum_and_slope(c, turn)[0]
    # A step of Newton's method, written so that nothing is subtracted from the distance.
    share = far / width
    mean, slope = sum_and_slope(c, 2.0 * share - 1.0)
    far = (v2 - 2.0 * share * far * slope) / -(mean + 2.0 * share * slope)
    return far if -mean >= LEAST_MEAN * size_of(work, MEAN) else 0.0


@Inner
def turn_on_gaps(forces, march, route, timed, largest_v2, ahead, work):  # type: ignore[no-untyped-def]
    """Return the distance at which a body that becomes slower turns, by the rows kept of the next gaps, and the data of
    the curve ahead of it there; the distance is 0 if they do not show a turn, or N may change its sign before.

    V**2 is a polynomial on each gap, so that the curve is not evaluated.

    Parameters
    ----------
    timed : LastTimed
        The break at which the body is, with V**2 and the sign of N there.
    largest_v2 : float
        The largest V**2 so far.
    ahead : CurveAhead
    """
    v, nu, v2, first, breaks = march.direction, timed.contact_sign, timed.v2, ahead.upcoming, route.breaks
    if nu in (0, -route.only_sign) or route.gaps.size == 0 or first + 1 >= breaks.size:
        return 0.0, ahead
    # If a panel is laid once more, the break at which the body is lies behind already.
    if offset(breaks[first], march.origin, v) != timed.distance:
        return 0.0, ahead
    for upcoming in range(first, min(first + GAPS_TO_TURN, breaks.size - 1)):
        begin = offset(breaks[upcoming], march.origin, v)
        at, width = kept_gap(forces, route, upcoming, v, nu, work)
        if route.gaps[at] != FILLED:
            break
        part = width
        if forces.linear:
            read_rows(v2, width, route.gaps, at, work)
        else:
            part = solve_towards_turn(forces, v2, width, route.gaps, at, work)
        if part == 0.0:
            break
        noise = CANCELLATION_NOISE * max(largest_v2, extent(work, W)[1])
        turn, _, touch = first_change_of(work, W, 1, noise)
        far = distance_to_turn(v2, turn, part, work)
        fill_load(work)
        load, _, no_load = first_change_of(work, LOAD, nu, ZERO_TOLERANCE * extent(work, MEAN)[1])
        # Behind the turn V**2 is negative, and N may be anything.
        if not (touch > 1.0 and min(load, no_load) > min(turn, 1.0) and far > 0.0):
            break
        if far < inf:
            return begin + far, CurveAhead(upcoming + 1, ahead.span, inf, True)
        v2 = work[W + COUNT]
        # Where the body does not become slower, this is not the end of its leg.
        if part < width or not noise < v2 <= work[W]:
            break
    return 0.0, ahead
