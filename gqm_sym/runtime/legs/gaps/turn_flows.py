"""The turns that bodies leave or reach on gaps, for laws that depend on the speed (`places`).

Seen from a turn, V**2 and the time are analytic in the root s of the distance between the turn and the end of its gap,
as the speed is, whatever gaps follow: also where the body is so slow at a break that neither is smooth in V**2 there.
They are kept for all bodies as Chebyshev series in s, as in `flows`. A turn ahead is the zero of such a series less
V**2, found by Newton's method.
"""

from math import fabs, nan, sqrt
from typing import NamedTuple

from gqm_sym.runtime.arithmetic.clenshaw import chebyshev_sum
from gqm_sym.runtime.compiled.jit import Inlined, Inner
from gqm_sym.runtime.legs.gaps.blocks import ends_of_gap, gap_behind, kept_gap
from gqm_sym.runtime.legs.gaps.data import FASTEST, FILLED, FIRST_LINE, LINE_COLUMNS, REFUSED, TAG, Bounds
from gqm_sym.runtime.legs.gaps.flows import (
    BOTTOM,
    FIRST,
    FIRST_SERIES,
    HALVES,
    LEFT,
    LIMIT,
    MAX_REACHED,
    MIDDLE_LIMIT,
    NOTHING,
    REACHED,
    SECOND,
    STATE_OF_LINE,
    TERMS,
    TOP,
    UNKNOWN,
    Travelled,
    Trip,
    both_series,
    bounds_in,
    keep_series,
    travel,
    value_buffer,
    widen,
)
from gqm_sym.runtime.legs.panels.breaks import clearance, place_after, within
from gqm_sym.runtime.legs.panels.equation import March
from gqm_sym.runtime.legs.panels.point import LEAST_V2 as AT_REST
from gqm_sym.runtime.legs.panels.point import point_buffer, slope_of_v2
from gqm_sym.runtime.legs.panels.polynomials import COUNT, SHARES, size_of, sum_and_slope

# The parts of a gap, from its end, on which turns are sought: the first one at the far end of which a body can turn.
PARTS = (1.0, 0.95, 0.8, 0.6, 0.4, 0.2)

# The largest number of steps of Newton's method, and the change, as a share of the largest speed, after which the next
# step would be rounding only.
MAX_STEPS, LAST_STEP = 12, 1e-9


@Inner
def travel_with_turn(forces, route, to_end, gap, count, is_left, contact_sign, work):  # type: ignore[no-untyped-def]
    """Return what a body does between a turn and the end of some gaps, or their start, where ``end`` is V**2.

    The turn lies in the gap with the index ``gap``, at the distance ``to_end`` from its end, if it ``is_left`` from
    there, or else from its start.
    """
    v = forces.direction
    u = v if is_left else -v
    low, high = ends_of_gap(route.all_breaks, route.period, gap)
    turn, off = place_after((high if u > 0 else low, 0.0), -u * to_end), clearance(low, high)
    here, point = within(turn[0], (low + off, high - off)), point_buffer()
    # A body turns only where the forces drive it away from there.
    if not v * u * slope_of_v2(forces, here, AT_REST, contact_sign, point) > 0.0:
        return Travelled(nan, nan, NOTHING, NOTHING, NOTHING)
    march = March(turn, u, 1.0, 0.0)
    return travel(forces, route, march, 0.0, to_end, (gap, count), contact_sign, work)


@Inner
def fill_turn(forces, route, gap, count, is_left, contact_sign, to, work):  # type: ignore[no-untyped-def]
    """Fill the line of turns in a gap; the parameters are those of `travel_with_turn`.

    V**2 at the end of the gap in which a turn is left is small beside a turn there. So it is kept over the square of s,
    and the time over s. In a gap that ends at an equilibrium neither is smooth.
    """
    gaps, values = route.gaps, value_buffer()
    gaps[to + STATE_OF_LINE], bottom = REFUSED, gaps[to + BOTTOM]
    for j in range(COUNT):
        s = bottom + (gaps[to + TOP] - bottom) * SHARES[j]
        trip = travel_with_turn(forces, route, s * s, gap, count, is_left, contact_sign, work)
        if not trip.time > 0.0:
            return
        widen(gaps, to, trip.end, trip, j == 0)
        is_beside = is_left and count == 1
        values[FIRST + j] = trip.end / (s * s) if is_beside else trip.end
        values[SECOND + j] = trip.time / s if is_beside else trip.time
    if keep_series(values, size_of(values, FIRST), gaps, to):
        gaps[to + STATE_OF_LINE] = FILLED


@Inner
def line_of_turn(forces, route, upcoming, count, is_left, contact_sign, work):  # type: ignore[no-untyped-def]
    """Return the position of the line of turns that are left in the gap ahead of the break at ``upcoming``, and the
    index of the gap with the turn; or of those that are reached ``count`` gaps ahead.

    For a new line, the part of the gap is found in which turns may be, and V**2 for one at its far end; 0 if there is
    none.
    """
    v, gaps = forces.direction, route.gaps
    at, _ = kept_gap(forces, route, upcoming, v, contact_sign, work)
    gap = gap_behind(route, upcoming if is_left else upcoming + count - 1, v)
    to = at + FIRST_LINE + ((LEFT if is_left else REACHED) + count - 1) * LINE_COLUMNS
    if gaps[to + TAG] == 0.0:
        gaps[to + TAG], gaps[to + STATE_OF_LINE] = 1.0, 0.0
        low, high = ends_of_gap(route.all_breaks, route.period, gap)
        gaps[to + LIMIT] = 0.0
        for part in PARTS:
            far = part * (high - low)
            trip = travel_with_turn(forces, route, far, gap, count, is_left, contact_sign, work)
            if trip.time > 0.0:
                gaps[to + LIMIT], gaps[to + TOP], gaps[to + BOTTOM] = trip.end, sqrt(far), 0.0
                break
    return to, gap


@Inner
def filled_line(forces, route, way, is_left, at_turn, contact_sign, to, work):  # type: ignore[no-untyped-def]
    """Return the position of the line at ``to``, or of that of half of its turns, that holds a turn; -1 if none does.

    ``at_turn`` is the root of the distance of the turn if it ``is_left``, or else V**2 at the break.
    """
    gaps, (gap, count) = route.gaps, way
    if gaps[to + STATE_OF_LINE] == 0.0:
        fill_turn(forces, route, gap, count, is_left, contact_sign, to, work)
        middle = 0.5 * gaps[to + TOP]
        trip = travel_with_turn(forces, route, middle * middle, gap, count, is_left, contact_sign, work)
        gaps[to + MIDDLE_LIMIT] = trip.end if trip.time > 0.0 else 0.0
        near = to + (HALVES + (LEFT if is_left else REACHED) + count - 1) * LINE_COLUMNS
        for half in range(2):
            line = near + half * LINE_COLUMNS
            gaps[line + STATE_OF_LINE], gaps[line + BOTTOM] = 0.0, half * middle
            gaps[line + TOP] = middle if half == 0 else gaps[to + TOP]
            gaps[line + LIMIT] = gaps[to + MIDDLE_LIMIT] if half == 0 else gaps[to + LIMIT]
    if gaps[to + STATE_OF_LINE] == FILLED:
        return to
    if gaps[to + MIDDLE_LIMIT] == 0.0:
        return -1
    is_near = at_turn <= (0.5 * gaps[to + TOP] if is_left else gaps[to + MIDDLE_LIMIT])
    line = to + (HALVES + (LEFT if is_left else REACHED) + count - 1 + (0 if is_near else 1)) * LINE_COLUMNS
    if gaps[line + STATE_OF_LINE] == 0.0:
        fill_turn(forces, route, gap, count, is_left, contact_sign, line, work)
    return line if gaps[line + STATE_OF_LINE] == FILLED else -1


@Inner
def leave_by_flow(forces, route, upcoming, far, count, contact_sign, work):  # type: ignore[no-untyped-def]
    """Return the `Trip` over a number of gaps of a body that leaves a turn in the gap before the break at ``upcoming``,
    at the distance ``far`` from there.
    """
    to, gap = line_of_turn(forces, route, upcoming - 1, count, True, contact_sign, work)
    gaps = route.gaps
    s = sqrt(far)
    if gaps[to + LIMIT] == 0.0 or not s <= gaps[to + TOP]:
        return Trip(nan, nan, UNKNOWN)
    to = filled_line(forces, route, (gap, count), True, s, contact_sign, to, work)
    if to < 0:
        return Trip(nan, nan, UNKNOWN)
    x = place_in_line(s, gaps, to)
    end, time = both_series(x, gaps, to)
    time, end = (s * time, far * end) if count == 1 else (time, end)
    return Trip(time, end, bounds_in(gaps, to, end))


@Inlined
def place_in_line(s, gaps, to):  # type: ignore[no-untyped-def]
    """Return the place of a root of the distance of a turn between those of a line, from -1 to 1."""
    return 2.0 * ((s - gaps[to + BOTTOM]) / (gaps[to + TOP] - gaps[to + BOTTOM])) - 1.0


class Reached(NamedTuple):
    """A turn that a body reaches.

    Attributes
    ----------
    gap_count : int
        The number of gaps up to and with that of the turn; 0 if it is not reached so, -1 if no line holds it.
    distance : float
        The distance of the turn from the start of its gap.
    time : float
        The time up to it.
    bounds : Bounds
        Bounds of V**2 and of the contact force per mass.
    """

    gap_count: int
    distance: float
    time: float
    bounds: Bounds


@Inner
def root_at_turn(v2, gaps, to):  # type: ignore[no-untyped-def]
    """Return the root s of the distance of a turn for a body with V**2 = ``v2``, from a line, by Newton's method."""
    first, bottom, top = to + FIRST_SERIES, gaps[to + BOTTOM], gaps[to + TOP]
    coefficients = gaps[first : first + int(gaps[to + TERMS])]
    before = chebyshev_sum(coefficients, -1.0)
    # V**2 is nearly linear in the distance.
    share = min(max((v2 - before) / (gaps[to + LIMIT] - before), 0.0), 1.0)
    s = sqrt(bottom * bottom + share * (top * top - bottom * bottom))
    for _ in range(MAX_STEPS):
        value, slope = sum_and_slope(coefficients, place_in_line(s, gaps, to))
        step = 0.5 * (top - bottom) * (v2 - value) / slope if slope > 0.0 else 0.0
        s = min(max(s + step, max(0.5 * s, bottom)), top)
        if fabs(step) <= LAST_STEP * s:
            break
    return s


@Inner
def reach_by_flow(forces, route, upcoming, v2, contact_sign, work):  # type: ignore[no-untyped-def]
    """Return the turn on the next gaps of a body with V**2 = ``v2`` at the break at ``upcoming``."""
    gaps, most, fastest = route.gaps, min(MAX_REACHED, route.breaks.size - 1 - upcoming), 0.0
    at, _ = kept_gap(forces, route, upcoming, forces.direction, contact_sign, work)
    if v2 > gaps[at + FASTEST]:
        return Reached(0, nan, nan, UNKNOWN)
    for count in range(1, most + 1):
        to, gap = line_of_turn(forces, route, upcoming, count, False, contact_sign, work)
        limit = gaps[to + LIMIT]
        if limit == 0.0:
            break
        fastest = limit
        if v2 <= limit:
            line = filled_line(forces, route, (gap, count), False, v2, contact_sign, to, work)
            if line < 0:
                return Reached(-1, nan, nan, UNKNOWN)
            s = root_at_turn(v2, gaps, line)
            time = both_series(place_in_line(s, gaps, line), gaps, line)[1]
            return Reached(count, s * s, time, bounds_in(gaps, line, v2))
        low, high = ends_of_gap(route.all_breaks, route.period, gap)
        if gaps[to + TOP] < sqrt(high - low):
            break  # the turn may be in the rest of the gap
    if most == MAX_REACHED:
        gaps[at + FASTEST] = fastest
    return Reached(0, nan, nan, UNKNOWN)
