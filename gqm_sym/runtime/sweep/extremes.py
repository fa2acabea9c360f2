"""The smallest and largest speed or contact force of one of many launches, by formulas or on the table of a curve."""

from math import fabs, inf, nan, pi, sin, sqrt

from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.quadrature.time_panels import MIN_CANCELLATION_RATIO
from gqm_sym.runtime.sweep.orbit import Orbit
from gqm_sym.runtime.sweep.quantities import MAX_FORCE, MAX_SPEED, MIN_FORCE, MIN_SPEED
from gqm_sym.runtime.sweep.single.orbit_extremes import (
    FORCE,
    FORCE_SQUARED,
    V2,
    WHOLE,
    extreme,
    fill_force,
    fill_squares,
    frame_buffer,
    point_buffer,
    sample_loads,
)
from gqm_sym.runtime.sweep.single.slow_places import exact_extreme_speed
from gqm_sym.runtime.sweep.tables.extremes import passage_extreme
from gqm_sym.runtime.sweep.tables.liftoff import NO_STOP
from gqm_sym.runtime.sweep.tables.stretches import stretch_after_turn, stretch_before_turn, stretch_of

# The share up to which an extreme is taken for the value at the end of a motion.
STOP_SHARE = 1e-3

# The difference of V**2 from that at launch, as a share of the largest V**2/2, below which it is the same to rounding.
LAUNCH_ROUNDING = 2.0**-46

EXTREMES = (MIN_SPEED, MAX_SPEED, MIN_FORCE, MAX_FORCE)


@Inner
def sought_for(curve, orbit, quantity, shares):  # type: ignore[no-untyped-def]
    """Return the function whose extreme a quantity is, with the direction of launch if it depends on that and the
    shares of the period between which it is sought, as `orbit_extremes.is_loop` takes them; and 1 for the largest
    value, -1 for the smallest.
    """
    force, sign = quantity in (MIN_FORCE, MAX_FORCE), 1.0 if quantity in (MAX_SPEED, MAX_FORCE) else -1.0
    function = V2 if not force else FORCE if curve.signed else FORCE_SQUARED
    direction = orbit.direction if function == FORCE_SQUARED and curve.directed else 0
    return (function, direction, *shares), sign


@Inner
def extreme_by_itself(curve, orbit, quantity, shares, max_grids):  # type: ignore[no-untyped-def]
    """Return an extreme of speed or contact force on an orbit without a table, from up to ``max_grids`` grids; NaN if
    it is not accurate.

    ``shares`` of the period are the ends of what is passed of a libration, if the force depends on the direction of
    motion (`orbit_extremes.WHOLE`).
    """
    sought, sign = sought_for(curve, orbit, quantity, shares)
    low, high = orbit.low, orbit.high
    if orbit.leaves == orbit.direction:  # the body does not come to the turning point behind it
        low, high = (0.0, high) if orbit.leaves > 0 else (low, 0.0)
    passed = Orbit(orbit.circulates, orbit.even, orbit.direction, orbit.lam0, orbit.v2, low, high, orbit.leaves)
    value, share = extreme(curve, passed, sought, sign, max_grids)
    if quantity not in (MIN_SPEED, MAX_SPEED):
        return value
    return exact_extreme_speed(curve, passed, value, share if passed.circulates else sin(0.5 * pi * share) ** 2)


@Inner
def is_extreme_at_stop(curve, part, quantity, shares, value):  # type: ignore[no-untyped-def]
    """Return whether an extreme may be the value where the part of an orbit ends (`until.part_until`)."""
    places, values, frame = point_buffer(), point_buffer(), frame_buffer()
    sought = sought_for(curve, part, quantity, shares)[0]
    places[0] = 0.0 if sought[1] == 0 and part.leaves < 0 else 1.0
    sample_loads(curve, part, sought, places, 1, values, frame, False)
    stop = values[0] if sought[0] == FORCE else sqrt(values[0])
    return not fabs(stop - value) > STOP_SHARE * fabs(value)


@Inner
def load_at(curve, orbit, quantity, offset, v2):  # type: ignore[no-untyped-def]
    """Return the speed or the contact force of which an extreme is asked for, at an offset from the launch; the motion
    has the direction of the launch.
    """
    (function, direction, _, _), _ = sought_for(curve, orbit, quantity, WHOLE)
    places, squares, out, frame = point_buffer(), point_buffer(), point_buffer(), frame_buffer()
    places[0], squares[0] = orbit.lam0 + offset, v2
    if function == V2:
        return sqrt(v2)
    if direction != 0:
        fill_squares(curve, direction, 1, places, squares, out)
        return sqrt(out[0])
    fill_force(curve, FORCE, 1, places, squares, frame, out)
    return out[0]


@Inner
def extreme_on(curve, orbit, passage, stop, half_v2_at_edges, quantity):  # type: ignore[no-untyped-def]
    """Return an extreme of speed or contact force on an orbit's passage through a table, up to a `Stop`; NaN if it is
    not accurate.

    If the force depends on the direction of motion and the body turns, what it passes in each direction is searched by
    itself.
    """
    (function, direction, _, _), sign = sought_for(curve, orbit, quantity, WHOLE)
    turns, passes_whole = stop.turns, stop.panel < 0
    if passes_whole and not (orbit.circulates or orbit.leaves == orbit.direction):
        turns = 1
    turned_twice = turns == 2 or (passes_whole and turns == 1 and orbit.leaves == 0)
    value = -sign * inf
    for k in range(3 if direction != 0 else 0):
        # At a turning point V**2 is a rounding on the table, and its root is no rounding of V.
        if (turns > 0, turned_twice, orbit.v2 == 0.0)[k]:
            offset = 0.0 if k == 2 else orbit.high if (direction > 0) == (k == 0) else orbit.low
            value = sign * max(sign * value, sign * load_at(curve, orbit, quantity, offset, 0.0))
    if direction == 0 or turns == 0:
        stretch = stretch_of(curve, orbit, passage, stop)
        other = passage_extreme(curve, orbit, passage, stretch, half_v2_at_edges, (function, direction), sign)
        return sign * max(sign * value, sign * other)
    stretch, way = stretch_after_turn(orbit, passage, stop), direction if turns == 2 else -direction
    other = passage_extreme(curve, orbit, passage, stretch, half_v2_at_edges, (function, way), sign)
    value = sign * max(sign * value, sign * other)
    for turned in range(turns):
        if turned == 1 or (passes_whole and turned_twice):
            stretch = stretch_after_turn(orbit, passage, NO_STOP)
        else:
            stretch = stretch_before_turn(curve, orbit, passage)
        way = direction if turned == 0 else -direction
        other = passage_extreme(curve, orbit, passage, stretch, half_v2_at_edges, (function, way), sign)
        value = sign * max(sign * value, sign * other)
    return value


@Inner
def extreme_on_table(curve, orbit, passage, stop, edges, quantity):  # type: ignore[no-untyped-def]
    """Return the result of `extreme_on`; NaN if it is a speed that has lost digits.

    ``edges`` contains V**2/2 at the edges of panels, and whether it keeps enough digits everywhere. The contact force
    has as many digits as the largest V**2.
    """
    half_v2_at_edges, keeps_digits = edges
    value, peak = extreme_on(curve, orbit, passage, stop, half_v2_at_edges, quantity), 0.5 * orbit.v2
    if quantity not in (MIN_SPEED, MAX_SPEED) or not value > 0.0 or (keeps_digits and quantity == MAX_SPEED):
        return value
    for j in range(passage.panels):
        peak = max(peak, half_v2_at_edges[j])
    if fabs(value * value - orbit.v2) <= LAUNCH_ROUNDING * peak:
        return sqrt(orbit.v2)
    return value if 0.5 * value * value >= MIN_CANCELLATION_RATIO * peak else nan
