"""One quantity of one of many orbits, by the first method that is accurate."""

from math import fabs, nan, sqrt

from gqm_sym.runtime.compiled.jit import Inlined, Inner
from gqm_sym.runtime.quadrature.time_panels import joints_between
from gqm_sym.runtime.quadrature.trapezoid import CIRCULATION, LIBRATION, time_by_panels, time_by_trapezoid
from gqm_sym.runtime.sweep.extremes import EXTREMES, extreme_by_itself, extreme_on
from gqm_sym.runtime.sweep.orbit import Orbit
from gqm_sym.runtime.sweep.quantities import ARRIVAL_TIME, HALF_PERIOD, MIN_SPEED, PERIOD
from gqm_sym.runtime.sweep.single.arrivals import arrival, refined_end
from gqm_sym.runtime.sweep.single.orbit_extremes import MAX_GRIDS, WHOLE
from gqm_sym.runtime.sweep.single.slow_places import passing_time, turns_at
from gqm_sym.runtime.sweep.single.until import is_later
from gqm_sym.runtime.sweep.tables.liftoff import NO_STOP
from gqm_sym.runtime.sweep.tables.times import time_on_panel_of_both, travel_time

# The largest number of panels of a passage on which formulas are more accurate than a table that is not exact.
FEW_PANELS = 2

# The share of a time by which a body must have passed a turning point beyond doubt, and, in units of the root of a last
# place of that point as a share of the way there, what its rounding adds.
REST_MARGIN, REST_ROUNDINGS, LAST_PLACE = 2.0**-20, 4.0, 2.0**-52


@Inner
def orbit_time(curve, orbit):  # type: ignore[no-untyped-def]
    """Return the half period of a libration, or the time of a circulation's lap; NaN if it is not accurate in
    doubles.
    """
    kind, width = LIBRATION, orbit.high - orbit.low
    a, b = orbit.lam0 + orbit.low, orbit.lam0 + orbit.high
    if orbit.circulates:
        kind, width = CIRCULATION, orbit.high + orbit.low  # one of them is zero
        a, b = orbit.lam0, orbit.lam0 + width
    joints = joints_between(curve.joints, curve.period, min(a, b), max(a, b))
    value = nan
    if joints.size == 0:
        value = time_by_trapezoid(curve.fns, curve.p, kind, orbit.lam0, orbit.v2, a, b, width)
    return value if value > 0.0 else time_by_panels(curve.fns, curve.p, kind, orbit.lam0, orbit.v2, a, b, joints)


@Inlined
def follows_formulas(curve):  # type: ignore[no-untyped-def]
    """Return whether the formulas of a tabulated curve are as accurate as its table."""
    return curve.joints.size == 0 and not curve.table.is_exact


@Inner
def value_from_table(curve, orbit, passage, quantity, target, half_v2_at_edges):  # type: ignore[no-untyped-def]
    """Return the half period or lap time, the arrival or an extreme on a tabulated curve; NaN if it is not accurate."""
    low, high, is_extreme = orbit.lam0 + orbit.low, orbit.lam0 + orbit.high, quantity in EXTREMES
    stays, is_short = orbit.leaves == 0, passage.panels <= FEW_PANELS
    by_itself = (stays and is_extreme) or (is_short and (stays or follows_formulas(curve)))
    if by_itself and not curve.table.is_exact and joints_between(curve.joints, curve.period, low, high).size == 0:
        return nan  # computed without the table, they are more accurate than on it
    if is_extreme:
        value = nan
        if orbit.leaves != 0 and follows_formulas(curve):  # one grid is faster, if it suffices
            value = extreme_by_itself(curve, orbit, quantity, WHOLE, 1)
        return value if value == value else extreme_on(curve, orbit, passage, NO_STOP, half_v2_at_edges, quantity)
    return travel_time(curve, orbit, passage, half_v2_at_edges, target if quantity == ARRIVAL_TIME else nan, False)


@Inner
def value_by_itself(curve, orbit, quantity, target, buffers):  # type: ignore[no-untyped-def]
    """Return the same as `value_from_table`, without a table."""
    if quantity in (HALF_PERIOD, PERIOD):
        return orbit_time(curve, orbit)
    if quantity == ARRIVAL_TIME:
        return arrival(curve, orbit, target, buffers.work, buffers.series)
    inside = joints_between(curve.joints, curve.period, orbit.lam0 + orbit.low, orbit.lam0 + orbit.high)
    if inside.size:
        return nan
    return extreme_by_itself(curve, orbit, quantity, WHOLE, MAX_GRIDS)


@Inner
def value_in_parts(curve, orbit, quantity, target, buffers):  # type: ignore[no-untyped-def]
    """Return a time on an orbit on which V**2 almost vanishes; NaN if it is not accurate, or if this method does not
    apply.
    """
    if curve.exact.work.size == 0 or quantity not in (HALF_PERIOD, PERIOD, ARRIVAL_TIME):
        return nan
    low, high = orbit.low, orbit.high
    turns = turns_at(orbit)
    if turns[0]:
        low = refined_end(curve.fns, curve.p, orbit, low, buffers.work)
    if turns[1]:
        high = refined_end(curve.fns, curve.p, orbit, high, buffers.work)
    better = Orbit(orbit.circulates, False, orbit.direction, orbit.lam0, orbit.v2, low, high, orbit.leaves)
    return passing_time(curve, better, target if quantity == ARRIVAL_TIME else nan)


@Inner
def best_value(curve, orbit, passage, tabulated, quantity, target, buffers):  # type: ignore[no-untyped-def]
    """Return a quantity of an orbit by the first method that is accurate: on the table, without it, or in parts; NaN if
    none is.
    """
    value = value_from_table(curve, orbit, passage, quantity, target, buffers.half_v2_at_edges) if tabulated else nan
    if quantity in (HALF_PERIOD, PERIOD) and passage.panels == 1 and passage.is_polished and curve.table.is_exact:
        value = time_on_panel_of_both(curve, passage)
    by_formulas = orbit.leaves == 0 or not passage.is_polished or follows_formulas(curve)
    if value != value and by_formulas and not (quantity in (HALF_PERIOD, PERIOD) and curve.table.is_exact):
        value = value_by_itself(curve, orbit, quantity, target, buffers)
    if value != value:
        value = value_in_parts(curve, orbit, quantity, target, buffers)
    return value


@Inner
def passes_extreme(curve, orbit, passage, tabulated, asked, buffers):  # type: ignore[no-untyped-def]
    """Return whether a body certainly passes, before the last time, all of its orbit on which an extreme may lie.

    For the least speed that is the launch at rest, or the way to the turning point ahead if there is one; else it is
    the whole orbit, in both directions if it turns.
    ``asked`` is the quantity, the last time, and whether contact is lost after that time.
    """
    quantity, t_max, is_lost = asked
    to_turn = quantity == MIN_SPEED and not orbit.circulates and orbit.leaves != orbit.direction
    if quantity == MIN_SPEED and orbit.v2 == 0.0:
        return True
    if is_lost and not to_turn:
        return False
    way = orbit.high if orbit.direction > 0 else orbit.low
    turn = orbit.lam0 + way
    what, target = (ARRIVAL_TIME, turn) if to_turn else (HALF_PERIOD if orbit.leaves == 0 else ARRIVAL_TIME, nan)
    time = best_value(curve, orbit, passage, tabulated, what, target, buffers)
    if to_turn:
        # A place that is rounded by this much is passed so much earlier or later.
        rounded = REST_MARGIN + REST_ROUNDINGS * sqrt(LAST_PLACE * fabs(turn / way))
        return time <= t_max * (1.0 - rounded)
    if orbit.leaves == 0 and not orbit.circulates:
        time *= 2.0
    return is_later(t_max, time)
