"""The orbit of one of many launches as far as a question needs it, and the part that a body passes up to a time."""

from math import fabs, inf, isfinite, nan, pi, sqrt

import numpy as np

from gqm_sym.runtime.arithmetic.elementary import cos, sin
from gqm_sym.runtime.compiled.jit import Inlined, Inner
from gqm_sym.runtime.compiled.strided import DOMAIN_HIGH, DOMAIN_LOW, DOMAIN_PERIOD, LAM0, element
from gqm_sym.runtime.inversion.table import place_on_panel
from gqm_sym.runtime.quadrature.substitution import FROM_TURN, REGULAR, TURN_TURN
from gqm_sym.runtime.quadrature.time_panels import (
    DEGREE,
    FLOOR,
    are_accurate,
    derivative,
    joints_between,
    orbit_panels,
    panel_of,
    read_off,
)
from gqm_sym.runtime.sweep.extremes import EXTREMES
from gqm_sym.runtime.sweep.finding import EVERYWHERE, find_orbit
from gqm_sym.runtime.sweep.orbit import CURVE_ENDS, Orbit
from gqm_sym.runtime.sweep.quantities import ANSWERED, ARRIVAL_TIME, END_TIME, NEVER_THERE, UNDECIDED
from gqm_sym.runtime.sweep.single.arrivals import arrival, phase_of, refined_end, with_refined_ends
from gqm_sym.runtime.sweep.single.orbit_extremes import WHOLE

# The distances from the launch, in units of `unit_of`, within which both turning points of a body on an endless curve
# are sought first, and then the place that it reaches in time; how often the latter is doubled; and after how many
# inaccurate times the search is given up.
TO_TURNS, FIRST_DISTANCE, MAX_DOUBLINGS, MAX_UNKNOWN = 64.0, 1.0, 40, 4

# The unit of distances as a share of the place of the launch, but at least 1.
UNIT_SHARE = 2.0**-4

# The distance from a turning point as a share of the way there within which the place of a body does not have all the
# digits of its speed.
NEAR_TURN = 2.0**-7

# If cancellation leaves no less than this part of V**2, the place of a body at a time is known to some nine digits.
ROUGH_RATIO = 1e-7

# How accurately the part of an orbit up to a time is known.
UNDECIDED_PART, ROUGH_PART, ACCURATE_PART = range(3)

# The share of a time by which another one must differ to be later beyond doubt.
ROUNDED_TIME = 1e-12

# The distance of places, as a share of a place, below which it is not known which of them a body comes to first.
ROUNDED_PLACE = 1e-12


@Inlined
def is_endless(columns, k):  # type: ignore[no-untyped-def]
    """Return whether a launch is on a curve without an end on one side at least."""
    low, high = element(columns, DOMAIN_LOW, k), element(columns, DOMAIN_HIGH, k)
    return element(columns, DOMAIN_PERIOD, k) == 0.0 and not isfinite(high - low)


@Inlined
def find_for(curve, columns, k, monotone, spans, known, asked, buffers):  # type: ignore[no-untyped-def]
    """Return what `find_orbit` does, on an endless curve as far as a question needs it.

    ``asked`` is the quantity, the place for ARRIVAL_TIME, and the last time. A body that goes on for ever leaves its
    orbit at that place, or after that time.
    """
    quantity, target, t_max = asked
    lam0, within, unknown, distance = element(columns, LAM0, k), EVERYWHERE, 0, TO_TURNS
    unit = max(1.0, UNIT_SHARE * fabs(lam0))
    by_time = t_max < inf and (quantity == END_TIME or quantity in EXTREMES) and is_endless(columns, k)
    if quantity == ARRIVAL_TIME and curve.ends == CURVE_ENDS:
        within = (target, inf) if target < lam0 else (-inf, target)
    for doublings in range(-1, MAX_DOUBLINGS):
        if by_time:
            within = (lam0 - distance * unit, lam0 + distance * unit)
        status, orbit, passage = find_orbit(curve, columns, k, monotone, spans, known, within)
        is_open = status == ANSWERED and orbit.leaves != 0 and passage.panels == 0
        if not by_time or not (is_open or (status == UNDECIDED and doublings < 0)):
            break
        if doublings < 0:
            distance = FIRST_DISTANCE
            continue
        time = arrival(curve, orbit, nan, buffers.work, buffers.series)
        if time > t_max:
            break
        unknown += 1 if time != time else 0
        distance *= 2.0
        if unknown == MAX_UNKNOWN or doublings == MAX_DOUBLINGS - 1:
            status = UNDECIDED
            break
    return status, orbit, passage


@Inner
def is_later(one, other):  # type: ignore[no-untyped-def]
    """Return whether a time is later than another one beyond doubt."""
    return one * (1.0 - ROUNDED_TIME) >= other


@Inner
def checked_arrival(status, quantity, t_max, out):  # type: ignore[no-untyped-def]
    """Return the status of an answer in the row ``out``, where an arrival after the last time is none."""
    if quantity != ARRIVAL_TIME or status != ANSWERED or is_later(t_max, out[0]):
        return status
    status, out[0] = NEVER_THERE if is_later(out[0], t_max) else UNDECIDED, nan
    return status


@Inner
def comes_before(orbit, place, stop):  # type: ignore[no-untyped-def]
    """Return whether a body comes to a place before it comes to a `Stop`, and whether it would only come there after
    that; neither if they are the same place to rounding.
    """
    v = orbit.direction if orbit.direction * (place - orbit.lam0) > 0.0 else -orbit.direction
    turns, left = 0 if v == orbit.direction else 1, v * (stop.place - place)
    if turns != stop.turns:
        return turns < stop.turns, turns > stop.turns
    rounded = ROUNDED_PLACE * max(fabs(stop.place), fabs(orbit.lam0))
    return left > rounded, left < -rounded


@Inner
def phase_at(panels, time):  # type: ignore[no-untyped-def]
    """Return the phase angle at a time from the first edge of panels."""
    edges, times, slopes = panels.edges, panels.times, np.empty(DEGREE)
    k = panel_of(times, time)
    terms, half, passed = panels.time_terms[k], 0.5 * (edges[k + 1] - edges[k]), time - times[k]
    derivative(terms, slopes)
    x = place_on_panel(terms, slopes, passed, 2.0 * passed / (times[k + 1] - times[k]) - 1.0)
    return edges[k] + half * (1.0 + x)


@Inner
def part_of(orbit, one, other, leaves):  # type: ignore[no-untyped-def]
    """Return the part of an orbit between two offsets, as the orbit of a body that leaves the curve there."""
    low, high = min(one, other), max(one, other)
    return Orbit(False, False, orbit.direction, orbit.lam0, orbit.v2, low, high, leaves)


@Inner
def part_of_swing(orbit, panels, t_max, exact):  # type: ignore[no-untyped-def]
    """Return the part of a libration with refined ends that a body passes up to a time, as `part_until` does."""
    v, low, high, half_period = orbit.direction, orbit.low, orbit.high, panels.times[-1]
    launch = phase_of(-low, high)
    start = read_off(panels.edges, panels.times, panels.time_terms, launch)
    if t_max >= 2.0 * half_period:
        return orbit, WHOLE
    # Times are counted from the passage of the turning point behind the launch.
    start, ahead = (start, high) if v > 0 else (half_period - start, low)
    time, turns = start + t_max, 0
    if time > half_period:
        time, turns = 2.0 * half_period - time, 1
        if time <= 0.0:
            time, turns = -time, 2
    if turns == 2 and not exact:
        return orbit, WHOLE
    if turns == 1 and time >= start and not exact:
        return part_of(orbit, 0.0, ahead, -v), WHOLE
    phi = phase_at(panels, time if v > 0 else half_period - time)
    if exact:
        first, last = 0.5 * launch / pi, 0.5 * phi / pi
        if v < 0:
            first = 1.0 - first
        since_low = turns + (v < 0)  # turns since the lower turning point, at which the period began
        return orbit, (first, (since_low + 1) // 2 + (last if since_low % 2 == 0 else -last))
    below, above = (high - low) * sin(0.5 * phi) ** 2, (high - low) * cos(0.5 * phi) ** 2
    end = low + below if below < above else high - above
    if turns == 0:
        return part_of(orbit, 0.0, end, v), WHOLE
    return part_of(orbit, end, ahead, -v), WHOLE


@Inner
def part_of_way(orbit, panels, ways, t_max, exact):  # type: ignore[no-untyped-def]
    """Return the part of a way that a body passes up to a time, as `part_until` does.

    ``ways`` has the offsets of the turning point at which the way begins, which is NaN if there is none, and of its
    end.
    """
    turn, end = ways
    v, turns, last, before = orbit.direction, turn == turn, panels.times[-1], 0.0
    begin = turn if turns else 0.0
    if turns and begin != 0.0:
        launch = sqrt(begin / (begin - end))
        before = read_off(panels.edges, panels.times, panels.time_terms, launch)
    is_inwards = turns and v * (end - begin) < 0.0
    time = t_max - before if is_inwards else t_max + before
    if time >= last:
        return orbit
    if is_inwards and 0.0 <= time <= before and not exact:
        return part_of(orbit, 0.0, begin, -v)
    share = phase_at(panels, fabs(time))
    offset = begin + (end - begin) * (share * share if turns else share)
    return part_of(orbit, offset, begin, -v) if is_inwards and time > 0.0 else part_of(orbit, offset, 0.0, v)


@Inner
def part_until(curve, orbit, t_max, exact, work):  # type: ignore[no-untyped-def]
    """Return what a body passes of an orbit up to a time, before which it does not pass the orbit in both directions.

    Parameters
    ----------
    exact : bool
        Whether it matters in which direction the body passes a place. Otherwise the part need not contain a place
        twice.

    Returns
    -------
    what : int
        UNDECIDED_PART, ROUGH_PART (of which only the end is not accurate) or ACCURATE_PART.
    part : Orbit
        The part of the orbit, as the orbit of a body that leaves the curve where it ends.
    shares : (first, last)
        Of an exact part of a libration, which is returned whole, the ends as shares of the period
        (`orbit_extremes.moving_at`).
    """
    kind, low, high, turn = REGULAR, orbit.low, orbit.high, nan
    if orbit.leaves == 0 and not orbit.circulates:
        orbit, kind = with_refined_ends(curve, orbit, work), TURN_TURN
        begin, end = orbit.low, orbit.high
    elif orbit.circulates:
        begin, end = 0.0, orbit.direction * (high - low)
    else:
        begin, end = (low, high) if orbit.leaves > 0 else (high, low)
        if orbit.v2 == 0.0 or orbit.leaves != orbit.direction:
            begin, kind = refined_end(curve.fns, curve.p, orbit, begin, work), FROM_TURN
            turn = begin
    a, b = orbit.lam0 + begin, orbit.lam0 + end
    if joints_between(curve.joints, curve.period, min(a, b), max(a, b)).size:
        return UNDECIDED_PART, orbit, WHOLE
    panels = orbit_panels(curve.fns, curve.p, kind, a, b, orbit.lam0, orbit.v2, curve.joints[:0])
    what = ACCURATE_PART if are_accurate(panels) else ROUGH_PART
    if panels.status > FLOOR or panels.cancellation < ROUGH_RATIO:
        return UNDECIDED_PART, orbit, WHOLE
    if kind == TURN_TURN:
        part, shares = part_of_swing(orbit, panels, t_max, exact)
        return what, part, shares
    return what, part_of_way(orbit, panels, (turn, end), t_max, exact), WHOLE


@Inner
def stops_beside_turn(orbit, part):  # type: ignore[no-untyped-def]
    """Return whether the part of an orbit that a body passes ends so near to the turning point ahead of it that the
    speed there has lost digits.
    """
    return is_beside_turn(orbit, 0 if part.leaves == orbit.direction else 1, part.high + part.low)


@Inner
def ends_beside_turn(orbit, part, last):  # type: ignore[no-untyped-def]
    """Return whether a part of an orbit (`part_until`) ends so near to a turning point that the speed there has lost
    digits.
    """
    width = orbit.high - orbit.low
    if orbit.circulates:
        return False
    if orbit.leaves == 0:
        return fabs(sin(2.0 * pi * last)) < 2.0 * sqrt(NEAR_TURN)
    return fabs((part.high if part.leaves > 0 else part.low) - (orbit.low if orbit.leaves > 0 else orbit.high)) < (
        NEAR_TURN * width
    )


@Inlined
def is_beside_turn(orbit, turns, offset):  # type: ignore[no-untyped-def]
    """Return whether an offset to which a body moves after so many turns is that near to the turning point ahead."""
    if turns != 0 or orbit.circulates or orbit.leaves == orbit.direction:
        return False
    ahead = orbit.high if orbit.direction > 0 else -orbit.low
    passed = orbit.direction * offset
    return passed < ahead and ahead - passed < NEAR_TURN * ahead
