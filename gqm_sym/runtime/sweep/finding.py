"""The orbit of one launch: on the table of its curve, or by a search along the curve."""

from math import fabs, inf, isfinite, sqrt

import numpy as np

from gqm_sym.runtime.compiled.jit import Inlined, Inner
from gqm_sym.runtime.compiled.strided import (
    AXIS,
    AXIS_STEP,
    DIRECTION,
    DOMAIN_HIGH,
    DOMAIN_LOW,
    DOMAIN_PERIOD,
    LAM0,
    PARAMETERS,
    V0,
    element,
)
from gqm_sym.runtime.launch.domain import DomainNumbers
from gqm_sym.runtime.launch.ends import CUSP_SHARE, NO_ORBIT, ends, orbit_kind
from gqm_sym.runtime.launch.zeros import CUSP, LIMIT, STEPS_SPENT, TURN, SearchArrays, speed_squared
from gqm_sym.runtime.quadrature.trapezoid import CIRCULATION
from gqm_sym.runtime.sweep.orbit import CURVE_ENDS, Orbit
from gqm_sym.runtime.sweep.quantities import ANSWERED, NOT_FINITE, NOT_PERIODIC, OUTSIDE_DOMAIN, UNDECIDED
from gqm_sym.runtime.sweep.tables.passage import NOWHERE, are_level, find_passage, passage_of
from gqm_sym.runtime.sweep.tables.turning_points import MIN_LEAVING_SHARE

# The range of places within which an orbit is sought on an endless curve, if that is the whole curve.
EVERYWHERE = (-inf, inf)


@Inlined
def within_range(lam0, first, last, period, within):  # type: ignore[no-untyped-def]
    """Return the ends of the curve, or where it is endless those of the range ``within`` which an orbit is sought."""
    if period > 0.0:
        return first, last
    low, high = min(within[0], lam0), max(within[1], lam0)
    return first if isfinite(first) else low, last if isfinite(last) else high


# The distance, in units of the larger of 1 and the size of the launch place, at which it is judged whether a motion
# goes on for ever. `solve` follows it about as far.
FAR = 1e3


@Inner
def orbit_that_leaves(curve, lam0, v2, direction, ahead, behind):  # type: ignore[no-untyped-def]
    """Return the orbit of a body that leaves the curve; `Orbit.leaves` is 0 if it stays, or if that is not certain."""
    last, turn = (ahead, 0.0) if ahead.what == LIMIT else (behind, ahead.near)
    end, leaves = last.near, direction if ahead.what == LIMIT else -direction
    none = Orbit(False, False, direction, lam0, v2, 0.0, 0.0, 0)
    if direction == 0 or last.what != LIMIT or curve.ends != CURVE_ENDS or curve.period > 0.0 or not isfinite(end):
        return none
    if not (ahead.what == TURN or (ahead.what == LIMIT and end != 0.0)):
        return none
    arrays = SearchArrays(np.empty(2), np.empty((2, 1)), np.empty(4))
    speed_squared(curve.fns, curve.p, lam0, v2, 0.0, arrays)
    ds = arrays.rows[1, 0]
    v2_there, size = speed_squared(curve.fns, curve.p, lam0, v2, end, arrays)
    if not (v2_there > MIN_LEAVING_SHARE * size and arrays.rows[1, 0] > CUSP_SHARE * ds):
        return none
    return Orbit(False, False, direction, lam0, v2, min(end, turn), max(end, turn), leaves)


@Inner
def ends_at_cusp(curve, lam0, v2, ahead, behind):  # type: ignore[no-untyped-def]
    """Return whether it is certain that a motion ends at a cusp, which the body reaches with a speed above zero."""
    last = behind if ahead.what == TURN else ahead
    if last.what != CUSP or last.near == 0.0 or not isfinite(last.near):
        return False
    arrays = SearchArrays(np.empty(2), np.empty((2, 1)), np.empty(4))
    v2_there, size = speed_squared(curve.fns, curve.p, lam0, v2, last.near, arrays)
    return v2_there > MIN_LEAVING_SHARE * size


@Inner
def time_per_share(curve, lam0, v2, offset):  # type: ignore[no-untyped-def]
    """Return the time that a body takes for each share of its distance from the launch, at an offset from that."""
    arrays = SearchArrays(np.empty(2), np.empty((2, 1)), np.empty(4))
    v2_there, _ = speed_squared(curve.fns, curve.p, lam0, v2, offset, arrays)
    return fabs(offset) * arrays.rows[1, 0] / sqrt(v2_there) if v2_there > 0.0 else 0.0


@Inner
def goes_on_for_ever(curve, lam0, v2, ahead, behind, reach):  # type: ignore[no-untyped-def]
    """Return the sign of the direction in which a body goes on for ever on an endless curve; 0 if that is not certain.

    ``reach`` holds the places up to which the search may go. Most such bodies take ever longer to double their distance
    from the launch. The others may come to the centre of a spiral in a finite time.
    """
    last = behind if ahead.what == TURN else ahead
    unit = max(1.0, fabs(lam0))
    if last.what != STEPS_SPENT or isfinite(reach[1] if last.near > 0.0 else reach[0]) or fabs(last.near) < FAR * unit:
        return 0
    way = 1 if last.near > 0.0 else -1
    soon, late = time_per_share(curve, lam0, v2, way * unit), time_per_share(curve, lam0, v2, way * FAR * unit)
    return way if soon > 0.0 and soon <= late < inf else 0


@Inlined
def find_orbit(curve, columns, k, monotone, spans, known, within):  # type: ignore[no-untyped-def]
    """Return the status of launch k, which is ANSWERED if it has an orbit, this orbit, and the panels that it passes in
    a table. The status is NOT_PERIODIC if the motion ends at a cusp, and if it goes on for ever, to an infinite end of
    the orbit.

    The orbit's span is taken from ``spans`` if it is ``known``. A body on an endless curve leaves it where it leaves
    the range of places ``within`` which its orbit is sought.
    """
    lam0, v0, direction = element(columns, LAM0, k), element(columns, V0, k), int(element(columns, DIRECTION, k))
    first, last, period = (
        element(columns, DOMAIN_LOW, k),
        element(columns, DOMAIN_HIGH, k),
        element(columns, DOMAIN_PERIOD, k),
    )
    axis, step = element(columns, AXIS, k) if monotone else np.nan, element(columns, AXIS_STEP, k)
    even, v2 = axis == axis, v0 * v0
    none, nowhere = Orbit(False, even, direction, lam0, v2, 0.0, 0.0, 0), NOWHERE
    total = lam0 + v0
    for row in range(columns.shape[0] - PARAMETERS):
        total += curve.p[row]
    if not isfinite(total):
        return NOT_FINITE, none, nowhere
    if not first <= lam0 <= last:
        return OUTSIDE_DOMAIN, none, nowhere
    if known:
        low, high = spans[k, 0], spans[k, 1]
        circulates = high != high
        if circulates:
            low, high = min(low, 0.0), max(low, 0.0)
        elif v0 == 0.0:
            direction = 1 if high > -low else -1
        return ANSWERED, Orbit(circulates, even, direction, lam0, v2, low, high, 0), nowhere
    orbit, passage = find_passage(curve, lam0, v0, direction)
    if passage.panels > 0:
        return ANSWERED, orbit, passage
    first, last = within_range(lam0, first, last, period, within)
    domain = DomainNumbers(first, last, period, axis, step)
    direction, ahead, behind = ends(curve.fns, curve.p, lam0, v0, direction, domain)
    kind = orbit_kind(direction, ahead, behind, v0, period)
    if kind == NO_ORBIT:
        orbit = orbit_that_leaves(curve, lam0, v2, direction, ahead, behind)
        if orbit.leaves == 0 and direction != 0 and ends_at_cusp(curve, lam0, v2, ahead, behind):
            return NOT_PERIODIC, orbit, nowhere
        way = goes_on_for_ever(curve, lam0, v2, ahead, behind, (first, last)) if orbit.leaves == 0 and direction else 0
        if way != 0:
            low, high = (0.0, inf) if way > 0 else (-inf, 0.0)
            return NOT_PERIODIC, Orbit(False, False, direction, lam0, v2, low, high, 0), nowhere
        return (ANSWERED, orbit, passage_of(curve, orbit)) if orbit.leaves != 0 else (UNDECIDED, orbit, nowhere)
    circulates = kind == CIRCULATION
    one, other = (direction * period, 0.0) if circulates else (ahead.near, behind.near)
    orbit = Orbit(circulates, even, direction, lam0, v2, min(one, other), max(one, other), 0)
    passage = passage_of(curve, orbit)
    return ANSWERED if are_level(curve, passage) else UNDECIDED, orbit, passage
