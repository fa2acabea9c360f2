"""The propagation of errors along a leg: those of its start, of V**2 there and of the time, by derivatives.

Assume that the body starts from rest at a and turns at b. With q the integral of Q from a on, V**2 at a place changes
by ``-P(a) exp(-q) da``, and therefore the turn by ``db/da = P(a) exp(-q)/P(b)``. At a given distance from a, V**2
changes by ``(P - Q W - P(a) exp(-q)) da``; this is small next to a, and gives the change of the time from a to the
middle of the run. From b to the middle the same holds with the direction reversed. The rounding error of V**2 is a few
units in the last place of the sum of all gains and losses by its terms, reduced by the resistance since then; it also
changes the time. The driving and the resisting forces may nearly cancel: the sum of their sizes is the larger one of
the forces on bodies that move in either direction. Terms of the force on a body at rest may cancel too: their size
follows from a running bound on the roundings of the module's formulas (`variations.force_errors`). Along
a chart it follows from the forces on charts that are changed by the possible errors of their rows (`Chart.rounded`). If
the law is not linear in V**2, it contains a square root at the turn. Panels that run into the turn then may have nine
digits only, while those that are followed back from it have all digits. The difference between both in the middle gives
the error of the turn.
"""

from math import fabs, inf, nan
from typing import NamedTuple

import numpy as np
from numba import types

from gqm_sym.runtime.arithmetic.doubledouble import ULP
from gqm_sym.runtime.arithmetic.matrices import multiply
from gqm_sym.runtime.charts.chart import MAGNIFIED
from gqm_sym.runtime.compiled.calls import call_speed_equation
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.registers import borrowed, on_stack
from gqm_sym.runtime.compiled.types import MATRIX, REAL, VECTOR, Array
from gqm_sym.runtime.legs.advance import DISSIPATION
from gqm_sym.runtime.legs.leg_reading import march_of
from gqm_sym.runtime.legs.leg_record import (
    AHEAD,
    BACK,
    COLUMNS,
    END,
    END_LOW,
    HEAD,
    INHERITED,
    NORMAL_LOAD,
    RIGHT,
    START,
    START_LOW,
    START_V2,
    TIME_ERROR,
    TIME_FROM_END,
    TIME_FROM_START,
)
from gqm_sym.runtime.legs.panels.equation import (
    ARC_RATE,
    DS,
    EXPM1_Q,
    GRADED,
    LOAD,
    MEAN,
    OFFSET,
    TAILS,
    TIME_RATE,
    D,
    March,
    P,
    Panel,
    Q,
    W,
    fill_rates,
    forces_on,
    panel_buffer,
    set_nodes,
    slope_at,
)
from gqm_sym.runtime.legs.panels.point import LEAST_V2, point_buffer, slope_of_v2
from gqm_sym.runtime.legs.panels.polynomials import COUNT, SHARES, TO_COEFFICIENTS, WIDE, to_tails
from gqm_sym.runtime.legs.panels.solving import begin_panel, solve_panel

# Roundings of V**2, of a place and of a time, in units in the last place. Laws that are not linear in V**2 take many
# panels to a turn, each of which rounds V**2.
V2_ROUNDINGS, NONLINEAR_V2_ROUNDINGS = 4.0, 16.0
PLACE_ROUNDINGS, TIME_ROUNDINGS = 1.0, 6.0


def _slopes() -> Array:
    """Return the matrix that maps values at a panel's nodes to the derivative with respect to the share of the panel, a
    row for each node.
    """
    degree, x = np.arange(COUNT), 2.0 * SHARES - 1.0
    angle = np.arccos(np.clip(x, -1.0, 1.0))
    at_nodes = 2.0 * degree * np.sin(np.outer(angle, degree)) / np.sin(angle)[:, None]
    slopes: Array = at_nodes @ TO_COEFFICIENTS
    return slopes


to_slopes = multiply(_slopes().T)

# A buffer for places, V**2 there, and the rows of the speed equation.
sample_buffer = on_stack(7 * WIDE)


class Errors(NamedTuple):
    """Bounds of the errors with which a leg begins.

    Attributes
    ----------
    place : float
        The bound for the place.
    v2 : float
        The bound for V**2 there; 0 if the body turns there.
    time : float
        The bound for the time in s.
    """

    place: float
    v2: float
    time: float


class RunHalf(NamedTuple):
    """Data of the motion on the panels from one end of the run to its middle.

    Attributes
    ----------
    by_place, by_v2 : float
        The derivatives of the time with respect to the place where the panels begin, at a given distance from there,
        and V**2 there.
    damping : float
        The factor by which resistance reduces a change of V**2.
    gained : float
        The sum of the sizes of all gains and losses of V**2 by each of its terms, reduced by the resistance since then.
    rounded : float
        The change of the time by a relative error of all these gains and losses.
    slope : float
        The increase of V**2 per distance where the panels begin.
    rate : float
        The time rate per distance in the middle; 0 if there are no panels.
    least, most : float
        The smallest and the largest rate at which V**2 grows with the curve's parameter.
    v2 : float
        V**2 in the middle.
    """

    by_place: float
    by_v2: float
    damping: float
    gained: float
    rounded: float
    slope: float
    rate: float
    least: float
    most: float
    v2: float


@Inner
def size_of_terms(forces, panel, least, charts, work):  # type: ignore[no-untyped-def]
    """Return the size of the terms of FORCE on a panel that was just solved (`solve_panel`), which is at least
    ``least``.

    The possible error of a chart (``charts``, as in `carry`) counts as the rounding of further terms.
    """
    rows, v, nu, size = sample_buffer(), float(forces.direction), float(panel.contact_sign), 0.0
    for j in range(WIDE):
        rows[j], rows[WIDE + j] = work[ARC_RATE + j], max(work[W + j], LEAST_V2)
    call_speed_equation(forces.speed_equation, WIDE, rows, (0, WIDE, 2 * WIDE), -v, nu, forces.params)
    for j in range(COUNT):
        terms = max(least, max(fabs(work[P + j]), fabs(rows[3 * WIDE + j])))
        size = max(size, terms * (1.0 + work[EXPM1_Q + j]))
    unit = MAGNIFIED * ULP * (V2_ROUNDINGS if forces.linear else NONLINEAR_V2_ROUNDINGS)
    for k in range(charts.shape[0]):
        call_speed_equation(forces.speed_equation, WIDE, rows, (0, WIDE, 2 * WIDE), v, nu, charts[k])
        most = 0.0
        for j in range(COUNT):
            change = (rows[3 * WIDE + j] - work[P + j]) - (rows[4 * WIDE + j] - work[Q + j]) * work[W + j]
            most = max(most, fabs(change) * (1.0 + work[EXPM1_Q + j]))
        size += most / unit
    return size


@Inner
def half_of_leg(forces, march, panels, v2, errors, sizes, record):  # type: ignore[no-untyped-def]
    """Solve the panels of a half of the leg once more, and accumulate the growth of errors on them.

    Parameters
    ----------
    panels : (int, int)
        The position of the first of them in the record, and their number.
    v2 : float
        V**2 where they begin.
    errors : (float, float, float)
        The errors of the place where they begin and of V**2 there, and the relative error of gains and losses.
        INHERITED of each panel is set to the largest error that these cause in the times to places of the panel, which
        are given by their distance from there.
    sizes : (array, array)
        ``terms`` and ``charts``, as in `carry`.
    """
    work = panel_buffer()
    set_nodes(work)
    (begin, count), left, u, (terms, charts) = panels, 0.0, float(march.direction), sizes
    by_place, by_v2, damping, gained, rounded, slope, rate = 0.0, 0.0, 1.0, v2, 0.0, 0.0, 0.0
    least, most = inf, -inf
    for k in range(count):
        at = begin + k * COLUMNS
        right = record[at + RIGHT]
        contact_sign = 1 if record[at + NORMAL_LOAD + COUNT // 2] > 0.0 else -1
        panel = Panel(left, v2, contact_sign, (-inf, inf))
        begin_panel(forces, march, panel, right - left, work)
        if not solve_panel(forces, march, panel, nan, work) < inf:
            return RunHalf(inf, inf, 1.0, inf, inf, slope, rate, -inf, inf, v2)
        size = size_of_terms(forces, panel, terms[(at - HEAD) // COLUMNS], charts, work)
        fill_rates(march, panel, work)
        if k == 0:
            slope = u * (work[P] - work[Q] * work[W])
        to_slopes(work, DS, work, MEAN)
        for j in range(WIDE):
            remains = 1.0 / (1.0 + work[EXPM1_Q + j])
            kept = damping * remains
            grows = (right - left) * (slope_at(left, march) + 2.0 * march.g * work[OFFSET + j])
            ds_growth = work[MEAN + j] / (grows * work[DS + j])
            by_parameter = work[P + j] - work[Q + j] * work[W + j]
            least, most = min(least, by_parameter), max(most, by_parameter)
            change = (u * by_parameter - slope * kept) / work[W + j]
            work[LOAD + j] = work[TIME_RATE + j] * (ds_growth - 0.5 * change)
            work[MEAN + j] = work[TIME_RATE + j] * kept / work[W + j]
            rounding = remains * (gained + size * work[D + j])
            work[GRADED + j] = work[TIME_RATE + j] * rounding / work[W + j]
        to_tails(work, LOAD, work, TAILS)
        inherited = fabs(by_place) * errors[0] + fabs(by_v2) * errors[1] + rounded * errors[2]
        by_place += (right - left) * work[TAILS + 6]
        to_tails(work, MEAN, work, TAILS)
        by_v2 -= 0.5 * (right - left) * work[TAILS + 6]
        to_tails(work, GRADED, work, TAILS)
        rounded += 0.5 * (right - left) * work[TAILS + 6]
        carried = fabs(by_place) * errors[0] + fabs(by_v2) * errors[1] + rounded * errors[2]
        record[at + INHERITED] = max(inherited, carried)
        share = 1.0 / (1.0 + work[EXPM1_Q + COUNT])
        damping, gained = damping * share, (gained + size * work[D + COUNT]) * share
        last = right - 0.5 * (right - left) * (1.0 - SHARES[COUNT - 1])
        rate = work[TIME_RATE + COUNT - 1] / slope_at(last, march)
        left, v2 = right, max(work[W + COUNT], 0.0)
    return RunHalf(by_place, by_v2, damping, gained, rounded, slope, rate, least, most, v2)


def rounding_share(linear: bool) -> float:
    """Return the relative rounding error of the gains and losses of V**2 by each of its terms."""
    return (V2_ROUNDINGS if linear else NONLINEAR_V2_ROUNDINGS) * ULP


@Inner
def own_time_error(record, begin, count):  # type: ignore[no-untyped-def]
    """Return the sum of the errors of the times of panels, as estimated from their last coefficients."""
    error = 0.0
    for k in range(count):
        error += record[begin + k * COLUMNS + TIME_ERROR]
    return error


@entry(
    types.UniTuple(REAL, 3)(
        DISSIPATION, VECTOR, types.boolean, types.NamedUniTuple(REAL, 3, Errors), REAL, VECTOR, MATRIX, VECTOR
    ),
    checked=False,
)
def carry(dissipation, p, turns, before, share, terms, charts, record):  # type: ignore[no-untyped-def]
    """Return the errors at the end of a leg, with which the next one begins.

    Parameters
    ----------
    dissipation : Dissipation
        The module's compiled functions, and the kind of its forces.
    p : array
        Run-time parameters.
    turns : bool
        Whether V**2 vanishes at the end of the leg, from which times are then counted back.
    before : Errors
    share : float
        The relative error of the gains and losses of V**2 by each of its terms (`rounding_share`).
    terms : array
        For each panel of the record, the size of the terms of the force that may cancel; 0 if it is not known.
    charts : array
        Rows of run-time parameters, each with another chart (`Chart.rounded`); none for a curve with formulas.
    record : array
        The record of the leg (`leg_record`). INHERITED is filled in; for panels from the end it is the effect of a unit
        error of the place of the end.

    Returns
    -------
    place, v2, time : float
        As in `Errors`.
    """
    p, record, forward = borrowed(p), borrowed(record), march_of(record)
    ahead, back, v = int(record[AHEAD]), int(record[BACK]), forward.direction
    forces = forces_on(dissipation, p, v)
    errors, sizes = (before.place, before.v2, share), (terms, borrowed(charts))
    first = half_of_leg(forces, forward, (HEAD, ahead), record[START_V2], errors, sizes, record)
    rounding = PLACE_ROUNDINGS * ULP * max(fabs(record[START]), fabs(record[END]))
    own = own_time_error(record, HEAD, ahead) + TIME_ROUNDINGS * ULP * record[TIME_FROM_START] + share * first.rounded
    if not turns or back == 0:
        moved = fabs(first.by_place - first.rate) * before.place + fabs(first.by_v2) * before.v2
        of_v2 = first.damping * (before.v2 + fabs(first.slope) * before.place)
        return rounding, of_v2 + share * first.gained, before.time + moved + own
    backward = March((record[END], record[END_LOW]), -v, 1.0, 0.0)
    second = half_of_leg(forces, backward, (HEAD + ahead * COLUMNS, back), 0.0, (1.0, 0.0, 0.0), sizes, record)
    damping = first.damping / second.damping
    off = (share * (first.gained + second.gained) + fabs(first.v2 - second.v2)) / second.damping
    start_slope, rate = first.slope, first.rate
    if ahead == 0:
        start_slope, rate = slope_of_v2(forces, record[START], record[START_V2], 0, point_buffer()), second.rate
    by_place, by_v2 = -start_slope * damping / second.slope, damping / second.slope
    at_end = rate - second.by_place  # the derivative of the time from the middle to the end, by the place of the end
    # The end is stored as two doubles, but forces are evaluated at doubles; this shifts the end in proportion to their
    # variation on the leg.
    varied = max(first.most, second.most) - min(first.least, second.least)
    rounding *= max(ULP, min(1.0, varied / fabs(second.slope)))
    width = fabs((record[END] - record[START]) + (record[END_LOW] - record[START_LOW]))
    of_end = off / second.slope + (rounding + PLACE_ROUNDINGS * ULP * width)
    place = fabs(by_place) * before.place + fabs(by_v2) * before.v2 + of_end
    moved = fabs(first.by_place - rate + by_place * at_end) * before.place
    moved += fabs(first.by_v2 + by_v2 * at_end) * before.v2 + fabs(at_end) * of_end
    own += own_time_error(record, HEAD + ahead * COLUMNS, back) + TIME_ROUNDINGS * ULP * record[TIME_FROM_END]
    own += share * second.rounded
    return place, 0.0, before.time + moved + own
