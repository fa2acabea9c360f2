"""Bodies that are launched at rest on a level part of a tabulated curve, and stay there or leave the track at once."""

from math import inf, nan

from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.sweep.quantities import (
    ANSWERED,
    ARRIVAL_TIME,
    END_TIME,
    MAX_FORCE,
    MAX_SPEED,
    MIN_FORCE,
    MIN_SPEED,
    NEVER_THERE,
    NOT_PERIODIC,
    UNDECIDED,
)
from gqm_sym.runtime.sweep.single.liftoff import force_of
from gqm_sym.runtime.sweep.single.orbit_extremes import FORCE, fill_force, frame_buffer, point_buffer
from gqm_sym.runtime.sweep.tables.layout import BASE_SIZE, SPREAD
from gqm_sym.runtime.sweep.tables.panel_forces import FAR, prepare
from gqm_sym.runtime.sweep.tables.places import locate, neighbour

# The range of the potential on a panel up to which it is level, as a share of the potential there and on the panels
# beside it. An exact table has some 31 digits.
LEVEL_SHARE = 2.0**-96


@Inner
def rests_on_level(curve, lam0):  # type: ignore[no-untyped-def]
    """Return whether a body at rest is inside a panel on which the potential is constant, as far as an exact table
    determines it.
    """
    count = curve.levels.size
    if count == 0 or not curve.table.is_exact:
        return False
    index, _, near = locate(curve.table, curve.period, lam0)
    if near == 0.0:
        return False
    k, size = index % count, 0.0
    for step in range(-1, 2):
        other = neighbour(k, step, count)
        prepare(curve, other, FAR)
        size = max(size, curve.rows[other, BASE_SIZE], curve.rows[other, SPREAD])
    return curve.rows[k, SPREAD] <= LEVEL_SHARE * size


@Inner
def fill_at_rest(curve, lam0, asked, out):  # type: ignore[no-untyped-def]
    """Fill the row ``out`` with a quantity of a body that rests, or that leaves the track at once; return the status.

    ``asked`` is the quantity, the place for ARRIVAL_TIME, and the side and the last time as in `GivenCurve`.
    """
    quantity, target, side, t_max = asked
    places, v2, force, frame = point_buffer(), point_buffer(), point_buffer(), frame_buffer()
    places[0], v2[0], value, leaves = lam0, 0.0, nan, False
    if side != 0:
        fill_force(curve, force_of(curve)[0], 1, places, v2, frame, force)
        leaves = side * force[0] < 0.0
        if not (leaves or side * force[0] > 0.0):
            return UNDECIDED
    fill_force(curve, FORCE, 1, places, v2, frame, force)
    if quantity == ARRIVAL_TIME and target != lam0:
        return UNDECIDED if curve.period > 0.0 and not leaves else NEVER_THERE
    if quantity in (ARRIVAL_TIME, MIN_SPEED, MAX_SPEED):
        value = 0.0
    elif quantity in (MIN_FORCE, MAX_FORCE):
        value = force[0]
    elif quantity == END_TIME and leaves:
        value = 0.0
    elif quantity == END_TIME and t_max < inf:
        value = t_max
    out[0] = value
    return ANSWERED if value == value else NOT_PERIODIC
