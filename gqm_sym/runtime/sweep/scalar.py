"""One quantity for each of many launches, in one compiled loop over the launches.

The loop answers the launches that batches leave, in doubles and without tables. An orbit that doubles cannot decide, or
whose time is not accurate to the last places, stays undecided, and `sweep` solves it separately.
"""

from math import inf, isfinite, nan
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from gqm_sym.runtime.compiled.jit import Inlined, Inner, entry
from gqm_sym.runtime.compiled.registers import borrowed
from gqm_sym.runtime.compiled.strided import (
    DOMAIN_PERIOD,
    LAM0,
    PARAMETERS,
    TARGET,
    V0,
    element,
)
from gqm_sym.runtime.compiled.types import ADDRESSES, MATRIX, REAL, VECTOR, Array
from gqm_sym.runtime.quadrature.time_panels import joints_between
from gqm_sym.runtime.quadrature.trapezoid import (
    CIRCULATION,
    LIBRATION,
    time_by_panels,
    time_by_trapezoid,
    trapezoid_rates,
    trapezoid_workspace,
)
from gqm_sym.runtime.sweep.extremes import EXTREMES, extreme_by_itself, extreme_on, extreme_on_table
from gqm_sym.runtime.sweep.orbit import CONTACT_ENDS, Orbit, SweptCurve
from gqm_sym.runtime.sweep.quantities import (
    ANSWERED,
    ANSWERS,
    ARRIVAL_TIME,
    END_TIME,
    HALF_PERIOD,
    MIN_SPEED,
    NEVER_THERE,
    NOT_PERIODIC,
    PERIOD,
    SINGLE,
    SPAN_KNOWN,
    SPANS,
    TURNING_POINTS,
    UNDECIDED,
)
from gqm_sym.runtime.sweep.single.arrivals import arrival, refined_end
from gqm_sym.runtime.sweep.single.liftoff import LEAVES, UNKNOWN, loss_by_itself, until_loss
from gqm_sym.runtime.sweep.single.orbit_extremes import MAX_GRIDS
from gqm_sym.runtime.sweep.single.slow_places import EXACT, RecordedFormulas, passing_time, turns_at
from gqm_sym.runtime.sweep.single.until import checked_arrival, find_for, is_later, part_until, stops_beside_turn
from gqm_sym.runtime.sweep.tables.layout import TABLE, CurveTable
from gqm_sym.runtime.sweep.tables.liftoff import KEPT, loss_of_contact
from gqm_sym.runtime.sweep.tables.panel_forces import take_factors
from gqm_sym.runtime.sweep.tables.passage import fill_half_v2_at_edges
from gqm_sym.runtime.sweep.tables.rests import fill_at_rest, rests_on_level
from gqm_sym.runtime.sweep.tables.times import time_on_panel_of_both, travel_time

# The quantities that only motions that repeat have.
PERIODIC = (HALF_PERIOD, PERIOD, TURNING_POINTS, SPANS)


class GivenCurve(NamedTuple):
    """The common data of the launches of a loop.

    Attributes
    ----------
    parameters : array
        A buffer for the parameters of one launch, followed by the chart if the curve has one.
    joints : array
        The places at which the curve is not smooth, within one period.
    table : CurveTable
        The table of the curve; empty if it is not tabulated.
    factor_columns : (n, 2) array
        For each part of the potential and the load, the factors of the launches, as `strided.pointers` gives them.
    factors, rows, levels : arrays
        Buffers for the attributes of `SweptCurve` with these names; the levels are 0.
    mass : int
        The index of the mass of the body among the run-time parameters.
    ends : int
        The kind of both ends of the table (`SweptCurve`).
    side : int
        1 if the track can only push along the normal, -1 if only against it, 0 if it can push and pull.
    t_max : float
        The last time in s, infinite if there is none; END_TIME, ARRIVAL_TIME and extremes depend on it.
    exact : RecordedFormulas
        The formulas as a tape; empty at first, because few launches need it.
    signed, path_in_space, directed, rider_loads : bool, int, bool, int
        As in `SweptCurve`.
    """

    parameters: Array
    joints: Array
    table: CurveTable
    factor_columns: NDArray[np.int64]
    factors: Array
    rows: Array
    levels: NDArray[np.int8]
    mass: int
    ends: int
    side: int
    t_max: float
    exact: RecordedFormulas
    signed: bool
    path_in_space: int
    directed: bool
    rider_loads: int


_BUFFERS = types.int64[:, ::1], VECTOR, MATRIX, types.int8[::1]
GIVEN = types.NamedTuple(
    (
        *(VECTOR, VECTOR, TABLE, *_BUFFERS, types.int64, types.int64, types.int64, REAL, EXACT),
        *(types.boolean, types.int64, types.boolean, types.int64),
    ),
    GivenCurve,
)


class Buffers(NamedTuple):
    """Work space for the trapezoidal rule (``work``, ``series``), and for V**2/2 at the edges of panels."""

    work: Any
    series: Any
    half_v2_at_edges: Any


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
    stays, is_short = orbit.leaves == 0, passage.panels <= 2
    by_itself = (stays and is_extreme) or (is_short and (stays or follows_formulas(curve)))
    if by_itself and not curve.table.is_exact and joints_between(curve.joints, curve.period, low, high).size == 0:
        return nan  # computed without the table, they are more accurate than on it
    if is_extreme:
        value = nan
        if orbit.leaves != 0 and follows_formulas(curve):  # one grid is faster, if it suffices
            value = extreme_by_itself(curve, orbit, quantity, 1)
        return value if value == value else extreme_on(curve, orbit, passage, KEPT, half_v2_at_edges, quantity)
    return travel_time(curve, orbit, passage, half_v2_at_edges, target if quantity == ARRIVAL_TIME else nan)


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
    return extreme_by_itself(curve, orbit, quantity, MAX_GRIDS)


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
def fill_value(curve, orbit, passage, tabulated, asked, buffers, out):  # type: ignore[no-untyped-def]
    """Fill the row ``out`` with a time or an extreme on an orbit; return the status.

    ``asked`` is the quantity, the place for ARRIVAL_TIME, the place before which the body must arrive there (NaN if
    there is none), and the largest value.
    """
    quantity, target, lost, limit = asked
    value = best_value(curve, orbit, passage, tabulated, quantity, target, buffers)
    if value != value and quantity in EXTREMES and passage.panels > 0:
        value = extreme_on_table(curve, orbit, passage, KEPT, (buffers.half_v2_at_edges, False), quantity)
    if value == inf:
        return NEVER_THERE
    if lost == lost:
        until = best_value(curve, orbit, passage, tabulated, ARRIVAL_TIME, lost, buffers)
        if not value <= until:
            return NEVER_THERE if value > until else UNDECIDED
    out[0] = 2.0 * value if quantity == PERIOD and not orbit.circulates else min(value, limit)
    return ANSWERED if isfinite(value) else UNDECIDED


@Inner
def passes_all(curve, orbit, passage, tabulated, t_max, buffers):  # type: ignore[no-untyped-def]
    """Return whether a body passes its whole orbit, in both directions if it turns, before the last time."""
    quantity = HALF_PERIOD if orbit.leaves == 0 else ARRIVAL_TIME
    time = best_value(curve, orbit, passage, tabulated, quantity, nan, buffers)
    if orbit.leaves == 0 and not orbit.circulates:
        time *= 2.0
    return is_later(t_max, time)


@Inner
def extreme_until(curve, orbit, passage, quantity, t_max, buffers):  # type: ignore[no-untyped-def]
    """Return an extreme up to the last time, before which a body does not pass its whole orbit; NaN if it is not
    accurate, depends on the direction of motion, or the orbit is on a table.
    """
    if passage.panels > 0 or curve.directed:
        return nan
    decided, part = part_until(curve, orbit, t_max, buffers.work)
    decided = decided and not (quantity == MIN_SPEED and stops_beside_turn(orbit, part))
    return value_by_itself(curve, part, quantity, nan, buffers) if decided else nan


@Inner
def loss_of(curve, orbit, passage, half_v2_at_edges, asked):  # type: ignore[no-untyped-def]
    """Return whether it is decided if a body leaves the track, the place at which it does (NaN if it keeps contact),
    the `Loss` on the table, and the orbit up to this place, which is found without a table.

    ``asked`` is the side as in `GivenCurve`, and whether the orbit is on the table.
    """
    side, on_table = asked
    if side == 0:
        return True, nan, KEPT, orbit
    if on_table:
        loss = loss_of_contact(curve, orbit, passage, half_v2_at_edges, side)
        return True, loss.place, loss, orbit
    what, offset, has_turned = loss_by_itself(curve, orbit, side)
    if what == LEAVES:
        return True, orbit.lam0 + offset, KEPT, until_loss(orbit, offset, has_turned)
    return what != UNKNOWN, nan, KEPT, orbit


@Inner
def extreme_until_loss(curve, orbit, passage, found, edges, quantity):  # type: ignore[no-untyped-def]
    """Return an extreme of speed or contact force up to a loss of contact, which is ``found`` on the table or without
    it (`loss_of`).
    """
    loss, left = found
    if loss.panel >= 0:
        return extreme_on_table(curve, orbit, passage, loss, edges, quantity)
    return extreme_by_itself(curve, left, quantity, MAX_GRIDS)


@Inner
def fill_answer(curve, orbit, passage, asked, buffers, out):  # type: ignore[no-untyped-def]
    """Fill the row ``out`` with a quantity of an orbit; return the status, which is SPAN_KNOWN for SPANS.

    ``asked`` is the quantity, the place for ARRIVAL_TIME, and the side and the last time as in `GivenCurve`.
    """
    (quantity, target, side, t_max), limit, half_v2_at_edges = asked, inf, buffers.half_v2_at_edges
    lost = nan  # the place at which a body that is to arrive elsewhere leaves the track
    by_ends, needs_period = quantity in (TURNING_POINTS, SPANS), quantity in PERIODIC
    on_table = passage.panels > 0 and (not by_ends or side != 0)
    tabulated = on_table and fill_half_v2_at_edges(curve, passage, half_v2_at_edges)
    if orbit.leaves != 0 and needs_period:
        return NOT_PERIODIC
    if side != 0 or quantity == END_TIME:
        decided, place, loss, left = loss_of(curve, orbit, passage, half_v2_at_edges, (side, on_table))
        if not decided:
            return UNDECIDED
        if place == place and needs_period:
            return NOT_PERIODIC
        if quantity in EXTREMES and place == place:
            out[0] = extreme_until_loss(curve, orbit, passage, (loss, left), (half_v2_at_edges, tabulated), quantity)
            return ANSWERED if isfinite(out[0]) else UNDECIDED
        if place != place and orbit.leaves != 0 and curve.ends == CONTACT_ENDS:
            return UNDECIDED
        if quantity == END_TIME and place != place and orbit.leaves == 0:
            out[0] = t_max if t_max < inf else nan
            return ANSWERED if t_max < inf else NOT_PERIODIC
        if quantity == END_TIME:
            quantity, target, limit = ARRIVAL_TIME, place, t_max
        elif quantity == ARRIVAL_TIME:
            lost = place
    if quantity == SPANS:
        out[0], out[1] = orbit.low, orbit.high
        if orbit.circulates:
            out[0], out[1] = orbit.low + orbit.high, nan
        return SPAN_KNOWN
    if orbit.circulates and quantity in (HALF_PERIOD, TURNING_POINTS):
        return NOT_PERIODIC
    if quantity == TURNING_POINTS:
        out[0], out[1] = orbit.lam0 + orbit.low, orbit.lam0 + orbit.high
        return ANSWERED
    if quantity in EXTREMES and t_max < inf and not passes_all(curve, orbit, passage, tabulated, t_max, buffers):
        out[0] = extreme_until(curve, orbit, passage, quantity, t_max, buffers)
        return ANSWERED if isfinite(out[0]) else UNDECIDED
    return fill_value(curve, orbit, passage, tabulated, (quantity, target, lost, limit), buffers, out)


@entry(
    types.void(ADDRESSES, types.int64[:, ::1], types.boolean, types.int64, MATRIX, ANSWERS, GIVEN),
    nogil=True,
)
def answer_one_by_one(fns, columns, monotone, quantity, spans, answers, given):  # type: ignore[no-untyped-def]
    """Fill the answer of each launch whose status is UNDECIDED or SPAN_KNOWN so far, if doubles decide it.

    Parameters
    ----------
    fns : Addresses
        The module's compiled functions.
    columns : array
        The launches, as `strided.pointers` gives them.
    monotone : bool
        Whether V**2 is monotone between neighbouring axes of symmetry.
    quantity : int
        One of HALF_PERIOD to END_TIME.
    spans : (n, 2) array
        For each launch of status SPAN_KNOWN, the answer of batches to SPANS.
    answers : Answers
        Filled in: both turning points or spans, or one number in the first column.
    given : GivenCurve
        The data that all launches share.
    """
    panels, count = given.levels.size, given.factors.size
    buffers = Buffers(trapezoid_workspace(), trapezoid_rates(), np.empty(panels + 1))
    taken = np.empty(count)
    p, joints, side, t_max = borrowed(given.parameters), borrowed(given.joints), given.side, given.t_max
    edges, lows = borrowed(given.table.edges), borrowed(given.table.edge_lows)
    paths, parts = borrowed(given.table.paths), borrowed(given.table.parts)
    table = CurveTable(edges, lows, paths, parts, *given.table[4:])
    rows, levels, factors = borrowed(given.rows), borrowed(given.levels), borrowed(given.factors)
    (address, operations, tape_parts, registers), work, exact_p = given.exact
    tape = address, borrowed(operations), tape_parts, registers
    exact = RecordedFormulas(tape, borrowed(work), borrowed(exact_p))
    columns, spans, values = borrowed(columns), borrowed(spans), borrowed(answers.values)
    statuses, routes = borrowed(answers.status), borrowed(answers.route)
    for k in range(statuses.size):
        known = statuses[k] == SPAN_KNOWN
        if statuses[k] != UNDECIDED and not known:
            continue
        for row in range(columns.shape[0] - PARAMETERS):
            p[row] = element(columns, PARAMETERS + row, k)
        period = element(columns, DOMAIN_PERIOD, k)
        v0 = element(columns, V0, k)
        made = fns, p, joints, period, given.ends, p[given.mass], table, factors, rows, levels
        of_force = given.signed, given.path_in_space, given.directed, given.rider_loads
        curve = SweptCurve(*made, v0, exact, *of_force)
        for i in range(count):
            taken[i] = element(given.factor_columns, i, k)
        take_factors(curve, taken)
        lam0, target = element(columns, LAM0, k), element(columns, TARGET, k)
        far = quantity, target, t_max
        status, orbit, passage = find_for(curve, columns, k, monotone, spans, known, far, buffers)
        if status == UNDECIDED and v0 == 0.0 and rests_on_level(curve, lam0):
            status = fill_at_rest(curve, lam0, (quantity, target, side, t_max), values[k])
        elif status == ANSWERED:
            status = fill_answer(curve, orbit, passage, (quantity, target, side, t_max), buffers, values[k])
            status = checked_arrival(status, quantity, t_max, values[k])
        elif status == NOT_PERIODIC and (quantity not in PERIODIC or side != 0):
            status = UNDECIDED
        statuses[k], routes[k] = status, SINGLE
