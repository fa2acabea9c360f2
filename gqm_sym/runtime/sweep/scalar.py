"""One quantity for each of many launches, in one compiled loop over the launches.

The loop answers the launches that batches leave, in doubles and without tables. An orbit that doubles cannot decide, or
whose time is not accurate to the last places, stays undecided, and `sweep` solves it separately.
"""

from math import inf, isfinite, nan
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from gqm_sym.runtime.compiled.jit import Inner, entry
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
from gqm_sym.runtime.launch.request import LEAST_SPEED
from gqm_sym.runtime.quadrature.trapezoid import trapezoid_rates, trapezoid_workspace
from gqm_sym.runtime.sweep.extremes import (
    EXTREMES,
    extreme_by_itself,
    extreme_on_table,
    is_extreme_at_stop,
    load_at,
    sought_for,
)
from gqm_sym.runtime.sweep.orbit import CONTACT_ENDS, SweptCurve
from gqm_sym.runtime.sweep.quantities import (
    ANSWERED,
    ANSWERS,
    ARRIVAL_TIME,
    END_TIME,
    HALF_PERIOD,
    MAX_SPEED,
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
from gqm_sym.runtime.sweep.single.liftoff import LEAVES, UNKNOWN, loss_by_itself, until_loss
from gqm_sym.runtime.sweep.single.orbit_extremes import MAX_GRIDS, WHOLE
from gqm_sym.runtime.sweep.single.slow_places import EXACT, RecordedFormulas
from gqm_sym.runtime.sweep.single.until import (
    ROUGH_PART,
    UNDECIDED_PART,
    checked_arrival,
    comes_before,
    ends_beside_turn,
    find_for,
    is_beside_turn,
    is_later,
    part_until,
    stops_beside_turn,
)
from gqm_sym.runtime.sweep.single.values import FEW_PANELS, best_value, follows_formulas, passes_extreme
from gqm_sym.runtime.sweep.tables.last_places import stop_at
from gqm_sym.runtime.sweep.tables.layout import TABLE, CurveTable
from gqm_sym.runtime.sweep.tables.liftoff import NO_STOP, Stop, loss_of_contact
from gqm_sym.runtime.sweep.tables.panel_forces import take_factors
from gqm_sym.runtime.sweep.tables.passage import fill_half_v2_at_edges
from gqm_sym.runtime.sweep.tables.rests import fill_at_rest, rests_on_level
from gqm_sym.runtime.sweep.tables.times import travel_time

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
def time_of_stop(curve, orbit, passage, tabulated, stop, buffers):  # type: ignore[no-untyped-def]
    """Return the time at which a body comes to a `Stop`; NaN if it is not accurate."""
    onwards = orbit.direction * (stop.place - orbit.lam0) > 0.0
    if stop.turns > (0 if onwards else 1):
        edges = buffers.half_v2_at_edges
        return travel_time(curve, orbit, passage, edges, stop.place, True) if tabulated else nan
    return best_value(curve, orbit, passage, tabulated, ARRIVAL_TIME, stop.place, buffers)


@Inner
def fill_value(curve, orbit, passage, tabulated, asked, buffers, out):  # type: ignore[no-untyped-def]
    """Fill the row ``out`` with a time or an extreme on an orbit; return the status.

    ``asked`` is the quantity, the place for ARRIVAL_TIME, and the `Stop` before which the body must arrive there.
    """
    quantity, target, stop = asked
    value = best_value(curve, orbit, passage, tabulated, quantity, target, buffers)
    if value != value and quantity in EXTREMES and passage.panels > 0:
        value = extreme_on_table(curve, orbit, passage, NO_STOP, (buffers.half_v2_at_edges, False), quantity)
    if value == inf:
        return NEVER_THERE
    if stop.place == stop.place and value != 0.0:
        before, after = comes_before(orbit, target, stop)
        if not before:
            return NEVER_THERE if after else UNDECIDED
    out[0] = 2.0 * value if quantity == PERIOD and not orbit.circulates else value
    is_beyond_doubles = quantity == MAX_SPEED and value < LEAST_SPEED
    return ANSWERED if isfinite(value) and not is_beyond_doubles else UNDECIDED


@Inner
def extreme_until(curve, orbit, passage, tabulated, asked, buffers):  # type: ignore[no-untyped-def]
    """Return an extreme up to the last time, before which a body does not pass its whole orbit; NaN if it is not
    accurate.

    ``asked`` is the quantity and the last time.
    """
    (quantity, t_max), value, edges = asked, nan, buffers.half_v2_at_edges
    is_directed = sought_for(curve, orbit, quantity, WHOLE)[0][1] != 0
    if passage.panels <= FEW_PANELS or follows_formulas(curve):  # beside hilltops they have more digits than the table
        what, part, shares = part_until(curve, orbit, t_max, is_directed, buffers.work)
        # Where the part ends roughly at the last time, it has an extreme if that is not at its end.
        if what != UNDECIDED_PART and not (quantity == MIN_SPEED and stops_beside_turn(orbit, part)):
            value = extreme_by_itself(curve, part, quantity, shares, MAX_GRIDS)
            is_rough = what == ROUGH_PART or (is_directed and ends_beside_turn(orbit, part, shares[1]))
            if is_rough and is_extreme_at_stop(curve, part, quantity, shares, value):
                value = nan
    if value != value and tabulated and (passage.panels > FEW_PANELS or curve.directed):
        decided, stop = stop_at(curve, orbit, passage, edges, t_max)
        if decided and not (quantity == MIN_SPEED and is_beside_turn(orbit, stop.turns, stop.place - orbit.lam0)):
            value = extreme_on_table(curve, orbit, passage, stop, (edges, tabulated), quantity)
    return value


@Inner
def loss_of(curve, orbit, passage, half_v2_at_edges, asked):  # type: ignore[no-untyped-def]
    """Return whether it is decided if a body leaves the track; the `Stop` at which it does, which has a place only
    then; and the orbit up to this place, which is found without a table.

    ``asked`` is the side as in `GivenCurve`, and whether the orbit is on the table.
    """
    side, on_table = asked
    if side == 0:
        return True, NO_STOP, orbit
    if on_table:
        return True, loss_of_contact(curve, orbit, passage, half_v2_at_edges, side), orbit
    what, offset, has_turned = loss_by_itself(curve, orbit, side)
    if what == LEAVES:
        stop = Stop(orbit.lam0 + offset, -1, 0.0, 1 if has_turned else 0)
        return True, stop, until_loss(orbit, offset, has_turned)
    return what != UNKNOWN, NO_STOP, orbit


@Inner
def fill_up_to_loss(curve, orbit, passage, tabulated, asked, buffers, out):  # type: ignore[no-untyped-def]
    """Fill the row ``out`` with the time of the end of a motion, or with an extreme up to a loss of contact; return the
    status, which is SPAN_KNOWN for an extreme if the last time is over before.

    ``asked`` is the quantity, the last time, and the `Stop` at which contact is lost with the orbit up to it.
    """
    quantity, t_max, stop, left = asked
    if stop.place == stop.place:
        time = (
            time_of_stop(curve, orbit, passage, tabulated, stop, buffers)
            if quantity == END_TIME or t_max < inf
            else 0.0
        )
    elif orbit.leaves != 0:
        time = best_value(curve, orbit, passage, tabulated, ARRIVAL_TIME, nan, buffers)
    else:
        out[0] = t_max if t_max < inf else nan
        return ANSWERED if t_max < inf else NOT_PERIODIC
    if quantity == END_TIME:
        out[0] = min(time, t_max)
        return ANSWERED if isfinite(time) else UNDECIDED
    if t_max < inf and not is_later(t_max, time):
        return SPAN_KNOWN if is_later(time, t_max) else UNDECIDED
    if stop.place == orbit.lam0 and stop.turns == 0:
        out[0] = load_at(curve, orbit, quantity, 0.0, orbit.v2)
    elif stop.panel >= 0:
        edges = buffers.half_v2_at_edges, tabulated
        out[0] = extreme_on_table(curve, orbit, passage, stop, edges, quantity)
    else:
        out[0] = extreme_by_itself(curve, left, quantity, WHOLE, MAX_GRIDS)
    return ANSWERED if isfinite(out[0]) else UNDECIDED


@Inner
def fill_answer(curve, orbit, passage, asked, buffers, out):  # type: ignore[no-untyped-def]
    """Fill the row ``out`` with a quantity of an orbit; return the status, which is SPAN_KNOWN for SPANS.

    ``asked`` is the quantity, the place for ARRIVAL_TIME, and the side and the last time as in `GivenCurve`.
    """
    (quantity, target, side, t_max), stop = asked, NO_STOP
    by_ends, needs_period = quantity in (TURNING_POINTS, SPANS), quantity in PERIODIC
    on_table = passage.panels > 0 and (not by_ends or side != 0)
    tabulated = on_table and fill_half_v2_at_edges(curve, passage, buffers.half_v2_at_edges)
    if orbit.leaves != 0 and needs_period:
        return NOT_PERIODIC
    if side != 0 or quantity == END_TIME:
        decided, stop, left = loss_of(curve, orbit, passage, buffers.half_v2_at_edges, (side, on_table))
        is_lost = stop.place == stop.place
        if not decided or (not is_lost and orbit.leaves != 0 and curve.ends == CONTACT_ENDS):
            return UNDECIDED
        if is_lost and needs_period:
            return NOT_PERIODIC
        if quantity == END_TIME or (is_lost and quantity in EXTREMES):
            until = quantity, t_max, stop, left
            status = fill_up_to_loss(curve, orbit, passage, tabulated, until, buffers, out)
            if status != SPAN_KNOWN:
                return status
    if by_ends or (orbit.circulates and quantity == HALF_PERIOD):
        return fill_ends(orbit, quantity, out)
    until_last = quantity in EXTREMES and t_max < inf
    if until_last:
        needed = quantity, t_max, stop.place == stop.place
        until_last = not passes_extreme(curve, orbit, passage, tabulated, needed, buffers)
    if until_last:
        out[0] = extreme_until(curve, orbit, passage, tabulated, (quantity, t_max), buffers)
        return ANSWERED if isfinite(out[0]) else UNDECIDED
    return fill_value(curve, orbit, passage, tabulated, (quantity, target, stop), buffers, out)


@Inner
def fill_ends(orbit, quantity, out):  # type: ignore[no-untyped-def]
    """Fill the row ``out`` with both ends of an orbit; return the status, which is SPAN_KNOWN for SPANS."""
    if quantity == SPANS:
        out[0], out[1] = orbit.low, orbit.high
        if orbit.circulates:
            out[0], out[1] = orbit.low + orbit.high, nan
        return SPAN_KNOWN
    if orbit.circulates:
        return NOT_PERIODIC
    out[0], out[1] = orbit.lam0 + orbit.low, orbit.lam0 + orbit.high
    return ANSWERED


@Inner
def without_period(orbit, asked):  # type: ignore[no-untyped-def]
    """Return the status of the answer for a body that comes to a cusp, or goes on for ever to an infinite end of its
    ``orbit``; ``asked`` is the quantity, the place for ARRIVAL_TIME, and the side as in `GivenCurve`.
    """
    quantity, target, side = asked
    if side != 0:
        return UNDECIDED
    if quantity in PERIODIC:
        return NOT_PERIODIC
    if isfinite(orbit.high - orbit.low) or target == orbit.lam0:
        return UNDECIDED
    return NEVER_THERE if quantity == ARRIVAL_TIME else NOT_PERIODIC


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
        elif status == NOT_PERIODIC:
            status = without_period(orbit, (quantity, target, side))
        statuses[k], routes[k] = status, SINGLE
