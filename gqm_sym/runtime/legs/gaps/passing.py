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
(`panels.few_nodes`). Blocks of short gaps are passed by functions of V**2 that are kept (`gaps.octaves`).
"""

from math import fabs, inf, nan, sqrt
from typing import NamedTuple

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.compiled.intrinsics import fma
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.legs.gaps.blocks import kept_block, kept_gap
from gqm_sym.runtime.legs.gaps.data import (
    BLOCK,
    COEFFICIENTS,
    END_EXPM1,
    END_GAINED,
    FACTORS,
    FAR_SHARE,
    FILLED,
    FIRST_OF_BLOCK,
    FIRST_OF_FEW,
    LARGEST_REST,
    LEAST_DAMPING,
    LEAST_KAPPA,
    LEAST_N0,
    MAX_SHARE,
    MIDDLE_GAINED,
    MOST_DAMPING,
    MOST_KAPPA,
    MOST_N0,
    WITH_FEW,
    Bounds,
    fill_length_on_gap,
    fill_load,
    lengths_on,
    loads_on,
    range_of,
    read_rows,
    solve_on_gap,
)
from gqm_sym.runtime.legs.gaps.flows import pass_by_flow
from gqm_sym.runtime.legs.gaps.octaves import pass_by_octave
from gqm_sym.runtime.legs.gaps.places import has_flows, solve_on_places
from gqm_sym.runtime.legs.gaps.turn_flows import reach_by_flow
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
    TIMES,
    Y_ROW,
    has_space,
)
from gqm_sym.runtime.legs.panels.breaks import offset
from gqm_sym.runtime.legs.panels.equation import (
    DS,
    EXPM1_Q,
    KAPPA,
    LOAD,
    MEAN,
    N0,
    SPEED,
    TAILS,
    TIME_RATE,
    W,
    copy,
    load_per_mass_row,
    marched,
    root_row,
    time_rate_row,
)
from gqm_sym.runtime.legs.panels.few_nodes import SQUARED, V2, few_buffer, pass_few, rises
from gqm_sym.runtime.legs.panels.polynomials import COUNT, extent, size_of
from gqm_sym.runtime.legs.panels.resolution import (
    examine,
    keeps_sign,
)
from gqm_sym.runtime.legs.runs.route import CurveAhead, Reading

# The ratio of V**2 to the largest V**2 so far above which gaps are passed by kept data. Near a turn a rounding of the
# largest V**2 has a larger effect on the time, but panels laid one by one take far longer.
GAP_V2_RATIO = 2.0**-6


@Inner
def is_load_far(contact_sign, bounds, gaps, at):  # type: ignore[no-untyped-def]
    """Return whether N has this sign, and is far from zero, on a gap with these bounds."""
    of_n0 = max(fabs(gaps[at + LEAST_N0]), fabs(gaps[at + MOST_N0]))
    of_kappa = max(fabs(gaps[at + LEAST_KAPPA]), fabs(gaps[at + MOST_KAPPA]))
    load = bounds.least_load if contact_sign > 0 else -bounds.most_load
    return load > FAR_SHARE * (of_n0 + of_kappa * bounds.most_v2)


@Inner
def pass_by_powers(v2, contact_sign, gaps, at):  # type: ignore[no-untyped-def]
    """Return the time over a gap or a block at whose start V**2 is ``v2``, V**2 at its end, and bounds on it.

    The time is NaN if V**2 changes too much for a few powers, or N may be near zero.
    """
    u, h = v2 + gaps[at + MIDDLE_GAINED], gaps[at + LARGEST_REST]
    low, high = (u - h) * gaps[at + LEAST_DAMPING], (u + h) * gaps[at + MOST_DAMPING]
    bounds = loads_on(gaps, at, low, high)
    if gaps[at] != FILLED or not h <= MAX_SHARE * u or not is_load_far(contact_sign, bounds, gaps, at):
        return nan, nan, bounds
    # The terms of even and of odd degree are summed side by side.
    t, even, odd = 2.0 / MAX_SHARE * (h / u) - 1.0, 0.0, 0.0
    for k in range(COEFFICIENTS - 2, -1, -2):
        odd = fma(odd, t * t, gaps[at + FACTORS + k + 1])
        even = fma(even, t * t, gaps[at + FACTORS + k])
    lost = gaps[at + END_EXPM1]
    return fma(odd, t, even) / sqrt(u), v2 + (gaps[at + END_GAINED] - v2 * lost) / (1.0 + lost), bounds


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
    elif has_flows(forces):
        if not solve_on_places(forces, v2, width, contact_sign, gaps, at, work):
            return nan, nan, nan, nan
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
def may_be_peak(reading, bounds):  # type: ignore[no-untyped-def]
    """Return whether the extreme to be found may be on a gap with these bounds."""
    if reading.force:
        return (bounds.most_load if reading.sign > 0.0 else -bounds.least_load) > reading.best
    return (sqrt(bounds.most_v2) if reading.sign > 0.0 else -sqrt(bounds.least_v2)) > reading.best


@Inner
def pass_gap(forces, reading, v2, contact_sign, kept, gaps, has_next, work):  # type: ignore[no-untyped-def]
    """Return what `pass_by_rows` does, by powers or few nodes if that is possible and rows are not read; and whether
    they are.

    ``kept`` is what `kept_gap` returns. If there is a next gap (``has_next``), an extreme at the end is left to that.
    """
    time, lost, reads, few, rises_to_end = nan, 0.0, reading.what == PEAKS, few_buffer(), False
    (at, width), end, bounds = kept, nan, Bounds(0.0, inf, 0.0, inf)
    if forces.linear:
        time, end, bounds = pass_by_powers(v2, contact_sign, gaps, at)
        lost = gaps[at + END_EXPM1]
    elif gaps[at] == FILLED and gaps[at + WITH_FEW] > 0.0:
        time, end, low, high, lost, least, most = pass_few(v2, gaps, at + FIRST_OF_FEW, few)
        bounds = Bounds(max(low, 0.0), high, sqrt(max(least, 0.0)), sqrt(most))
        rises_to_end = reads and has_next and time > 0.0 and rises(few, SQUARED if reading.force else V2, reading.sign)
    if forces.linear and reads and time > 0.0 and reading.length:
        bounds = lengths_on(gaps, at, bounds.least_v2, bounds.most_v2)
    top, has_values = bounds.most_v2, reads and not (time > 0.0 and (rises_to_end or not may_be_peak(reading, bounds)))
    if has_values or not time > 0.0:
        time, end, top, lost = pass_by_rows(forces, v2, contact_sign, width, gaps, at, work)
    if has_values and not forces.linear and time > 0.0:
        low, high = range_of(work, W)
        has_values = may_be_peak(reading, lengths_on(gaps, at, max(low, 0.0), high))
    return time, end, top, lost, has_values


@Inner
def pass_block(forces, route, reading, v2, v, contact_sign, upcoming, work):  # type: ignore[no-untyped-def]
    """Return the time over the block ahead of the break at ``upcoming``, V**2 at its end, the largest V**2 on it, and E
    at its end; the time is NaN if there is no such block, it cannot be passed as one, or it has to be read.
    """
    at = kept_block(forces, route, upcoming, v, contact_sign, work)
    if at < 0:
        return nan, nan, nan, nan
    if forces.linear:
        time, end, bounds = pass_by_powers(v2, contact_sign, route.gaps, at)
        lost = route.gaps[at + END_EXPM1]
    else:
        time, end, bounds, lost = pass_by_octave(v2, v, route.gaps, at - FIRST_OF_BLOCK)
    if reading.what == PEAKS and time > 0.0:
        if reading.length:
            bounds = lengths_on(route.gaps, at, bounds.least_v2, bounds.most_v2)
        time = nan if may_be_peak(reading, bounds) else time
    return time, end, bounds.most_v2, lost


@Inner
def is_read_inside(route, places, times):  # type: ignore[no-untyped-def]
    """Return whether a gap contains the place or the time up to which a leg is read, which requires a panel."""
    if route.reading.what == TIMES:
        return False
    if route.reading.what == PASSAGE:
        return min(places) <= route.target <= max(places)
    near = ROUNDINGS_OF_TIMES * times[1]
    return times[0] - near <= route.until <= times[1] + near


class Passed(NamedTuple):
    """A gap or a block that a body has passed.

    Attributes
    ----------
    gap_count : int
        The number of gaps; 0 if the next one cannot be passed.
    time : float
    end, top : float
        V**2 at the end, and the largest.
    lost : float
        E at the end.
    has_values : bool
        Whether V**2 and the contact force are in the buffer of rows, to be read.
    at : int
        The position of the data kept of the gap.
    """

    gap_count: int
    time: float
    end: float
    top: float
    lost: float
    has_values: bool
    at: int


@Inner
def pass_next_by_flow(forces, route, reading, body, upcoming, spent, work):  # type: ignore[no-untyped-def]
    """Do the work of `pass_next` by what is kept of laws that are not linear (`gaps.flows`), or by a single panel."""
    breaks, (v2, v, contact_sign), at = route.breaks, body, 0
    count, time, end, top, lost, has_values = BLOCK, nan, v2, v2, 0.0, False
    while count > 0 and not time > 0.0:
        trip = pass_by_flow(forces, route, upcoming, v2, contact_sign, count, work)
        if trip.time > 0.0 and not (reading.what == PEAKS and may_be_peak(reading, trip.bounds)):
            time, end, top = trip.time, trip.end, max(v2, trip.end)
            if count > 1 and is_read_inside(route, (breaks[upcoming], breaks[upcoming + count]), (spent, spent + time)):
                time = nan
        count = count if time > 0.0 else (1 if count > 1 else 0)
    if not time > 0.0:
        (at, width), count = kept_gap(forces, route, upcoming, v, contact_sign, work), 1
        time, end, top, lost = pass_by_rows(forces, v2, contact_sign, width, route.gaps, at, work)
        has_values = reading.what == PEAKS
    places, times = (breaks[upcoming], breaks[upcoming + count]), (spent, spent + time)
    count = count if time > 0.0 and not is_read_inside(route, places, times) else 0
    return Passed(count, time, end, top, lost, has_values, at)


@Inner
def pass_next(forces, route, reading, body, upcoming, spent, work):  # type: ignore[no-untyped-def]
    """Pass the block ahead of the break at ``upcoming``, or the gap.

    Parameters
    ----------
    forces, route, work
        As for `pass_gaps`.
    reading : Reading
        What is read from the record.
    body : (float, int, int)
        V**2, the direction of motion, and the sign of N.
    upcoming : int
        The index of the break.
    spent : float
        The time up to there.
    """
    breaks, (v2, v, contact_sign) = route.breaks, body
    if has_flows(forces):
        return pass_next_by_flow(forces, route, reading, body, upcoming, spent, work)
    time, end, top, lost = pass_block(forces, route, reading, v2, v, contact_sign, upcoming, work)
    if time > 0.0 and not is_read_inside(route, (breaks[upcoming], breaks[upcoming + BLOCK]), (spent, spent + time)):
        return Passed(BLOCK, time, end, top, lost, False, 0)
    kept, has_next = kept_gap(forces, route, upcoming, v, contact_sign, work), upcoming + 2 < breaks.size
    time, end, top, lost, has_values = pass_gap(forces, reading, v2, contact_sign, kept, route.gaps, has_next, work)
    places, times = (breaks[upcoming], breaks[upcoming + 1]), (spent, spent + time)
    count = 1 if time > 0.0 and not is_read_inside(route, places, times) else 0
    return Passed(count, time, end, top, lost, has_values, kept[0])


@Inner
def with_better(reading, work):  # type: ignore[no-untyped-def]
    """Return a reading that seeks only what exceeds the values in the rows SPEED and MEAN."""
    low, high = extent(work, MEAN if reading.force else SPEED)
    best = max(reading.best, high if reading.sign > 0.0 else -low)
    return Reading(reading.what, reading.force, reading.length, reading.sign, best)


@Inner
def pass_gaps(forces, march, route, contact_sign, before, record, work):  # type: ignore[no-untyped-def]
    """Pass gaps from the break ahead on, as long as V**2 is large and follows from the kept data."""
    (left, run_length, v2, largest_v2, ahead, count), v, spent = before, march.direction, 0.0
    breaks, gaps, reading, upcoming = route.breaks, route.gaps, route.reading, ahead.upcoming
    to, total, total_low, may_join = HEAD + count * COLUMNS, 0.0, 0.0, False
    for k in range(count):
        spent += record[HEAD + k * COLUMNS + TIME]
    is_flow = has_flows(forces)
    while gaps.size > 0 and upcoming + 1 < breaks.size and (is_flow or v2 >= GAP_V2_RATIO * largest_v2):
        # If a panel is laid once more, the break may lie behind already.
        is_ahead = offset(breaks[upcoming], march.origin, v) == run_length
        if contact_sign in (0, -route.only_sign) or not (is_ahead and has_space(record, to, 0)):
            break
        if is_flow and reach_by_flow(forces, route, upcoming, v2, contact_sign, work).gap_count != 0:
            break
        passed = pass_next(forces, route, reading, (v2, v, contact_sign), upcoming, spent, work)
        if passed.gap_count == 0:
            break
        time, has_values = passed.time, passed.has_values
        largest_v2 = max(largest_v2 / (1.0 + passed.lost), max(v2, passed.top))
        v2, upcoming, spent = passed.end, upcoming + passed.gap_count, spent + time
        run_length = offset(breaks[upcoming], march.origin, v)
        # Successive gaps from which only the time is read become one entry of the record.
        to += COLUMNS if may_join and has_values else 0
        total, rounding = two_sum(total if may_join and not has_values else 0.0, time)
        total_low = rounding + (total_low if may_join and not has_values else 0.0)
        if has_values:
            if reading.length:
                fill_length_on_gap(gaps, passed.at, work)
            load_per_mass_row(work, MEAN, N0, KAPPA, W)
            copy(record, to + Y_ROW, work, SPEED)
            copy(record, to + NORMAL_LOAD, work, MEAN)
            if not forces.linear:
                reading = with_better(reading, work)
        record[to + RIGHT], record[to + TIME] = marched(run_length, march), total + total_low
        record[to + TIME_ERROR], may_join = NO_RATES if has_values else NO_VALUES, not has_values
        to += COLUMNS if has_values else 0
    if upcoming > ahead.upcoming:
        left, ahead = marched(run_length, march), CurveAhead(upcoming, ahead.span, inf, True)
        count = (to - HEAD) // COLUMNS + (1 if may_join else 0)
    return RunState(left, run_length, v2, largest_v2, ahead, count)
