"""Turns that are found by the data kept of the gaps between two breaks of the curve, and the gaps next to turns.

On the gaps before a turn, and after one, neither is the curve evaluated nor are panels laid (`beside_turns`).
"""

from math import inf, nan
from typing import NamedTuple

from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import on_stack
from gqm_sym.runtime.legs.gaps.beside_turns import (
    GAPS_BEFORE,
    keep_series,
    leave_turn,
    series_store,
    time_near_turn,
    time_to_turn,
)
from gqm_sym.runtime.legs.gaps.blocks import ends_of_gap, gap_behind, kept_gap
from gqm_sym.runtime.legs.gaps.data import (
    FILLED,
    NOISE_OF_FORCE,
    Bounds,
    fill_load,
    lengths_on,
    loads_on,
    range_of,
    read_rows,
    solve_on_gap,
    solve_towards_turn,
)
from gqm_sym.runtime.legs.gaps.flows import MAX_LEFT
from gqm_sym.runtime.legs.gaps.passing import RunState, is_load_far, is_read_inside, may_be_peak
from gqm_sym.runtime.legs.gaps.places import has_flows
from gqm_sym.runtime.legs.gaps.turn_flows import leave_by_flow, reach_by_flow
from gqm_sym.runtime.legs.leg_record import (
    HEAD,
    NO_VALUES,
    PEAKS,
    RIGHT,
    TIME,
    TIME_ERROR,
)
from gqm_sym.runtime.legs.panels.breaks import offset
from gqm_sym.runtime.legs.panels.equation import KAPPA, LOAD, MEAN, N0, SERIES, W, load_per_mass_row, marched
from gqm_sym.runtime.legs.panels.point import ZERO_TOLERANCE
from gqm_sym.runtime.legs.panels.polynomials import COUNT, extent, size_of, sum_and_slope, to_coefficients
from gqm_sym.runtime.legs.panels.resolution import CANCELLATION_NOISE, first_change_of
from gqm_sym.runtime.legs.runs.route import CurveAhead

# A turn nearer to the start of a gap than this share of it is sought with the mean force from there, which must be more
# than a share of its largest values.
SHORT_SHARE, LEAST_MEAN = 0.25, 0.125

# The number of gaps on which a turn is sought. Gaps before the one with the turn are passed as elsewhere.
GAPS_TO_TURN = GAPS_BEFORE + 1
width_store = on_stack(GAPS_BEFORE)


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
def may_be_peak_on_gap(reading, gaps, at, work):  # type: ignore[no-untyped-def]
    """Return whether the extreme to be found may be on a gap with the row W."""
    high = extent(work, W)[1]
    if reading.length:
        return may_be_peak(reading, lengths_on(gaps, at, 0.0, high))
    load_per_mass_row(work, SERIES, N0, KAPPA, W)
    least, most = range_of(work, SERIES)
    return may_be_peak(reading, Bounds(0.0, high, least, most))


class TurnOnGaps(NamedTuple):
    """A turn that is found by the rows kept of gaps.

    Attributes
    ----------
    distance : float
        Its distance from the origin; 0 if there is none.
    time : float
        The time up to it; NaN if it is not known, or an extreme may be on the way.
    ahead : CurveAhead
        The data of the curve ahead of the body there.
    """

    distance: float
    time: float
    ahead: CurveAhead


@Inner
def turn_by_flow(forces, march, route, v2, contact_sign, ahead, work):  # type: ignore[no-untyped-def]
    """Do the work of `turn_on_gaps` by what is kept of laws that are not linear (`gaps.flows`)."""
    reached = reach_by_flow(forces, route, ahead.upcoming, v2, contact_sign, work)
    if reached.gap_count <= 0:
        return TurnOnGaps(0.0, nan, ahead)
    far = offset(route.breaks[ahead.upcoming + reached.gap_count - 1], march.origin, march.direction) + reached.distance
    is_read = route.reading.what == PEAKS and may_be_peak(route.reading, reached.bounds)
    time = nan if is_read else reached.time
    return TurnOnGaps(far, time, CurveAhead(ahead.upcoming + reached.gap_count, ahead.span, inf, True))


@Inner
def turn_on_gaps(forces, march, route, timed, largest_v2, ahead, work):  # type: ignore[no-untyped-def]
    """Return the turn of a body that becomes slower, by the rows kept of the next gaps, if these show one and N does
    not change its sign before.

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
    none, time, store, widths = TurnOnGaps(0.0, nan, ahead), 0.0, series_store(), width_store()
    if nu in (0, -route.only_sign) or route.gaps.size == 0 or first + 1 >= breaks.size:
        return none
    # If a panel is laid once more, the break at which the body is lies behind already.
    if offset(breaks[first], march.origin, v) != timed.distance:
        return none
    if has_flows(forces):
        return turn_by_flow(forces, march, route, v2, nu, ahead, work)
    for k in range(min(GAPS_TO_TURN, breaks.size - 1 - first)):
        begin = offset(breaks[first + k], march.origin, v)
        at, width = kept_gap(forces, route, first + k, v, nu, work)
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
        if route.reading.what == PEAKS and may_be_peak_on_gap(route.reading, route.gaps, at, work):
            time = nan
        start = 0.0
        if time >= 0.0 and far == inf and k < GAPS_BEFORE:
            widths[k] = width
            keep_series(store, k, False, work)
        elif time >= 0.0 and 0.0 < far < inf:
            time, start = time_to_turn(part, far / part, work)
        fill_load(work)
        load, _, no_load = first_change_of(work, LOAD, nu, ZERO_TOLERANCE * extent(work, MEAN)[1])
        # Behind the turn V**2 is negative, and N may be anything.
        if not (touch > 1.0 and min(load, no_load) > min(turn, 1.0) and far > 0.0):
            break
        # Where friction almost balances the weight, the kept rows do not give the force to enough digits.
        if far < inf and v2 <= NOISE_OF_FORCE * size_of(work, N0) * far:
            break
        if far < inf:
            time += time_before(far, start, k, store, widths, work)
            return TurnOnGaps(begin + far, time, CurveAhead(first + k + 1, ahead.span, inf, True))
        v2 = work[W + COUNT]
        # Where the body does not become slower, this is not the end of its leg.
        if part < width or not noise < v2 <= work[W]:
            break
    return none


@Inner
def time_before(far, v2, count, store, widths, work):  # type: ignore[no-untyped-def]
    """Return the time over the gaps before that with a turn, which lies at the distance ``far`` from the last one,
    where V**2 is ``v2``; NaN if it is not resolved.
    """
    total = 0.0
    for k in range(count - 1, -1, -1):
        time, v2 = time_near_turn(far, widths[k], v2, False, store, k, work)
        total, far = total + time, far + widths[k]
    return total


@Inner
def may_be_peak_up_to(forces, reading, v2, gaps, at):  # type: ignore[no-untyped-def]
    """Return whether the extreme to be found may be on a gap where V**2 is at most ``v2``."""
    if reading.what != PEAKS:
        return False
    bounds = lengths_on(gaps, at, 0.0, v2) if forces.squared_contact != 0 else loads_on(gaps, at, 0.0, v2)
    return may_be_peak(reading, bounds)


@Inner
def pass_after_turn(forces, v2, far, width, gaps, at, work):  # type: ignore[no-untyped-def]
    """Return the time over the gap that begins at the distance ``far`` from a turn, where V**2 is ``v2``, and V**2 at
    its end; the time is NaN if it is not resolved.
    """
    if gaps[at] != FILLED:
        return nan, v2
    if forces.linear:
        read_rows(v2, width, gaps, at, work)
    elif not solve_on_gap(forces, v2, width, gaps, at, work):
        return nan, v2
    store, end = series_store(), work[W + COUNT]
    keep_series(store, 0, True, work)
    return (time_near_turn(far, width, v2, True, store, 0, work)[0] if end > 0.0 else nan), end


@Inner
def begin_by_flow(forces, march, route, contact_sign, before, to, record, work):  # type: ignore[no-untyped-def]
    """Do the work of `begin_on_gaps` by what is kept of laws that are not linear (`gaps.flows`); ``to`` is the distance
    of the next break.
    """
    upcoming, breaks, here = before.ahead.upcoming, route.breaks, march.origin[0]
    for count in range(min(MAX_LEFT, breaks.size - upcoming), 0, -1):
        trip, last = leave_by_flow(forces, route, upcoming, to, count, contact_sign, work), upcoming + count - 1
        if not trip.time > 0.0 or is_read_inside(route, (here, breaks[last]), (0.0, trip.time)):
            continue
        if route.reading.what == PEAKS and may_be_peak(route.reading, trip.bounds):
            continue
        passed = offset(breaks[last], march.origin, march.direction)
        left = marched(passed, march)
        record[HEAD + RIGHT], record[HEAD + TIME], record[HEAD + TIME_ERROR] = left, trip.time, NO_VALUES
        return RunState(left, passed, trip.end, trip.end, CurveAhead(last, before.ahead.span, inf, True), 1)
    return before


@Inner
def begin_on_gaps(forces, march, route, contact_sign, before, record, work):  # type: ignore[no-untyped-def]
    """Leave a turn by the rows kept of the gap in which it is, and of the next one; the state is as ``before`` if this
    is not possible.
    """
    v, upcoming, breaks, passed = march.direction, before.ahead.upcoming, route.breaks, 0.0
    if contact_sign in (0, -route.only_sign) or route.gaps.size == 0 or upcoming + 1 >= breaks.size or before.v2 > 0.0:
        return before
    to = offset(breaks[upcoming], march.origin, v)
    low, high = ends_of_gap(route.all_breaks, route.period, gap_behind(route, upcoming - 1, v))
    if not 0.0 < to < high - low:
        return before
    if has_flows(forces):
        return begin_by_flow(forces, march, route, contact_sign, before, to, record, work)
    at, width = kept_gap(forces, route, upcoming - 1, v, contact_sign, work)
    if route.gaps[at] != FILLED:
        return before
    v2, total, largest, state = 0.0, 0.0, 0.0, before
    for k in range(2):
        if k == 0:
            time, end = leave_turn(forces, to, width, route.gaps, at, work)
        else:
            at, length = kept_gap(forces, route, upcoming, v, contact_sign, work)
            time, end = pass_after_turn(forces, v2, passed, length, route.gaps, at, work)
            upcoming += 1
        places, high = (march.origin[0] + v * passed, breaks[upcoming]), range_of(work, W)[1]
        # With friction in space N was examined where V**2 was found.
        is_far = not forces.linear or is_load_far(contact_sign, loads_on(route.gaps, at, 0.0, high), route.gaps, at)
        if not (time > 0.0 and is_far):
            break
        if is_read_inside(route, places, (total, total + time)) or may_be_peak_up_to(
            forces, route.reading, high, route.gaps, at
        ):
            break
        passed, total, v2 = offset(breaks[upcoming], march.origin, v), total + time, end
        left, largest = marched(passed, march), max(largest, max(end, extent(work, W)[1]))
        record[HEAD + RIGHT], record[HEAD + TIME], record[HEAD + TIME_ERROR] = left, total, NO_VALUES
        state = RunState(left, passed, v2, largest, CurveAhead(upcoming, before.ahead.span, inf, True), 1)
    return state
