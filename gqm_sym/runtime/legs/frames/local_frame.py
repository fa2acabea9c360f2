"""Small motions about an equilibrium e that is not at 0, or on a chart, with distances from e as places, and the force
at these places.

Doubles resolve a place next to e to a rounding of e, and the force there to a rounding of the terms that cancel at e.
Along a chart these roundings are no smaller about 0, where it may begin and end.
So the force on a body at rest, P(lam), is known as a function C(d) with ``C(0) = 0``, where d is the distance from e
(`fitting`). C is one polynomial between two places where the curve is not smooth, which may lie at e itself.
Functions of the interface then serve the legs with distances for places: P becomes
``C(d) + (P(e + d, W) - P(e + d, 0))``, and all else, which does not vanish at e, is evaluated at e + d.

With sliding friction e is the place at which it balances the other forces on a body that moves in one direction, with
one sign of N, and the frame serves one leg, in that direction.

Small swings about a stable equilibrium stay near it. A body launched near an unstable equilibrium departs from it,
later if it was nearer, and leaves the frame; its distance at launch is computed in extended precision
(`fitting.refined`).
"""

from functools import cache
from math import fabs
from typing import Any, NamedTuple

import numpy as np
from numba import carray, types

from gqm_sym.runtime.arithmetic.doubledouble import add
from gqm_sym.runtime.charts.chart import MAGNIFIED
from gqm_sym.runtime.compiled.calls import call_speed_equation, call_static_balance
from gqm_sym.runtime.compiled.emitted import compiler
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.registers import on_stack
from gqm_sym.runtime.compiled.types import INTEGER, VECTOR, Array
from gqm_sym.runtime.interface import INTERFACE, SPEED_EQUATION, STATIC_BALANCE, Dissipation
from gqm_sym.runtime.legs.advance import DISSIPATION
from gqm_sym.runtime.legs.body import DIRECTION, FIRST_STEP, HIGH, LEAST_SIZE, LOW, V2
from gqm_sym.runtime.legs.body import PLACE as BODY_PLACE
from gqm_sym.runtime.legs.leg_record import CHANGE_COUNT, END, MIDDLE, START, change_at
from gqm_sym.runtime.legs.panels.equation import forces_on
from gqm_sym.runtime.legs.panels.point import LEAST_V2, point_buffer, sign_of_load, slope_of_v2
from gqm_sym.runtime.legs.panels.polynomials import WIDE

# A motion is small if it is below these shares of the distance of e from 0, and of the range of the polynomials. A
# motion wider than a quarter of that distance loses at most two bits if its places are rounded to doubles. On the
# middle quarter of a range the noise of a polynomial's slope is hardly more than DEGREE times that of the polynomial,
# and not DEGREE**2 times as at the ends. The width, which is estimated from the slope of the force at e, can only be
# four times as large if the force is a sixteenth of the estimate.
SMALL_SHARE, RANGE_SHARE = 0.25, 0.25

# A motion that is not small is examined again when it has decreased to the share that makes it so, but for a margin,
# and always when it has decreased to the smallest share; to the third one if the range, or the force, is the reason.
RETRY_MARGIN, LEAST_RETRY_SHARE, UNKNOWN_RETRY_SHARE = 1.02, 0.7, 0.875

# The degree of C.
DEGREE = 20

# The numbers before the module's parameters: the address of its speed equation, and with friction that of its static
# balance, else 0; e as two doubles; the range; and the number of parts between places where the curve is not smooth,
# with a row for each.
ADDRESS, BALANCE, PLACE, PLACE_LOW, RANGE, PARTS, ROWS = range(7)

# A row: the distance at which the part begins; the places between which the module's functions are evaluated on it; and
# ``C(d) = FORCE + (d - ORIGIN) D(x)`` with ``x = (d - CENTRE)/HALF_WIDTH``, where TERMS are the coefficients of D in
# powers of x. ORIGIN is the distance on the part that is next to e: 0 on the part with e, where FORCE is 0 too.
BEGIN, FIRST_PLACE, LAST_PLACE, ORIGIN, FORCE, CENTRE, HALF_WIDTH, TERMS = range(8)
ROW_SIZE = TERMS + DEGREE

rows_buffer = on_stack(12 * WIDE)


class Frame(NamedTuple):
    """The surroundings of an equilibrium, as a model whose places are distances from it.

    Attributes
    ----------
    dissipation : Dissipation
        The functions of the model, which take distances.
    p : array
        Their parameters.
    error : float
        The error of the place of the equilibrium.
    is_sharp : bool
        Whether the equilibrium and the force come from double-double arithmetic (`fitting.sharpened`).
    sense : (int, int)
        The direction of motion and the sign of N for which the force is known; both are 1 without friction, where they
        make no difference.
    """

    dissipation: Dissipation
    p: Array
    error: float
    is_sharp: bool = False
    sense: tuple[int, int] = (1, 1)

    @property
    def parts(self) -> Array:
        """The rows of the parts."""
        count = int(self.p[PARTS])
        return self.p[ROWS : ROWS + count * ROW_SIZE].reshape(count, ROW_SIZE)

    @property
    def own_parameters(self) -> Array:
        """The run-time parameters of the module."""
        return self.p[ROWS + int(self.p[PARTS]) * ROW_SIZE :]

    @property
    def breaks(self) -> Array:
        """The distances at which the curve is not smooth."""
        return self.parts[1:, BEGIN].copy()

    def slopes(self, distance: float) -> Array:
        """Return the slope of the force on each part that begins within a distance from the equilibrium, where it
        begins.
        """
        parts = self.parts
        return np.array([slope_at_origin(row) for row in parts[np.abs(parts[:, ORIGIN]) <= distance]])

    @property
    def slope(self) -> float:
        """The slope of the force at the equilibrium; if that is a break, on one side of it."""
        return float(self.slopes(0.0)[0])

    @property
    def is_stable(self) -> bool:
        """Whether bodies swing about the equilibrium instead of departing from it."""
        return self.slope < 0.0

    def size(self, distance: float, v2: float) -> float:
        """Return the size of a motion about the equilibrium, from a distance from it and V**2 there; NaN if it passes
        into a part on which the force has no such slope.
        """
        size, slopes = abs(distance), self.slopes(0.0)
        for _ in range(int(self.p[PARTS])):
            steepness = slopes * np.sign(slopes[0])
            if not steepness.min() > 0.0:
                return float("nan")
            size = float(np.sqrt((distance**2 * steepness.max() + 2.0 * v2) / steepness.min()))
            slopes = self.slopes(size)
        return size

    @property
    def reach(self) -> float:
        """Return the distance from the equilibrium up to which the force is accurate."""
        return RANGE_SHARE * float(self.p[RANGE])

    def distance(self, place: float, low: float) -> tuple[float, float]:
        """Return the distance from the equilibrium of a place that is given as two doubles."""
        distance: tuple[float, float] = add(place, low, -float(self.p[PLACE]), -float(self.p[PLACE_LOW]))
        return distance

    def move(self, record: Array, sense: int) -> None:
        """Replace distances by places in the record of a leg, or places by distances if ``sense`` is -1."""
        place, low = sense * float(self.p[PLACE]), sense * float(self.p[PLACE_LOW])
        for k in (START, END, MIDDLE):
            record[k], record[k + 1] = add(float(record[k]), float(record[k + 1]), place, low)
        for k in range(int(record[CHANGE_COUNT])):
            record[change_at(record, k)] += place


def slope_at_origin(row: Array) -> float:
    """Return the slope of C where a part begins, seen from the equilibrium."""
    x = (row[ORIGIN] - row[CENTRE]) / row[HALF_WIDTH]
    return float(np.polynomial.polynomial.polyval(x, row[TERMS:]))


@Inner
def sense_of(dissipation, p, body):  # type: ignore[no-untyped-def]
    """Return the direction of motion and the sign of N that the force on a body depends on (`Frame.sense`)."""
    if not dissipation.friction:
        return 1, 1
    direction = int(body[DIRECTION])
    return direction, sign_of_load(forces_on(dissipation, p, direction), body[BODY_PLACE], body[V2], point_buffer())


@Inner
def distance_of_search(corners, body):  # type: ignore[no-untyped-def]
    """Return the distance from a body within which an equilibrium is looked for."""
    place = body[BODY_PLACE]
    reach = min(body[FIRST_STEP], fabs(body[LOW] - place), fabs(body[HIGH] - place))
    for known in corners:
        reach = min(reach, fabs(known - place))
    return min(SMALL_SHARE * max(fabs(place), body[LEAST_SIZE]), RANGE_SHARE * reach)


@Inner
def may_be_small(dissipation, p, corners, body):  # type: ignore[no-untyped-def]
    """Return whether `fitting.frame_near` may find a frame for a body, because the force on it at rest changes its sign
    nearby.
    """
    place, point = body[BODY_PLACE], point_buffer()
    if dissipation.kinked or max(fabs(place), body[LEAST_SIZE]) == 0.0:
        return False
    around = distance_of_search(corners, body)
    direction, contact_sign = sense_of(dissipation, p, body)
    forces = forces_on(dissipation, p, direction)
    behind = slope_of_v2(forces, place - around, LEAST_V2, contact_sign, point)
    ahead = slope_of_v2(forces, place + around, LEAST_V2, contact_sign, point)
    return ahead * behind < 0.0 and body[V2] < around * fabs(behind - ahead)


@entry(types.boolean(DISSIPATION, VECTOR, VECTOR, VECTOR))
def is_small(dissipation, p, corners, body):  # type: ignore[no-untyped-def]
    """Call `may_be_small` from Python."""
    return may_be_small(dissipation, p, corners, body)


@entry(types.UniTuple(INTEGER, 2)(DISSIPATION, VECTOR, VECTOR))
def sense_on(dissipation, p, body):  # type: ignore[no-untyped-def]
    """Call `sense_of` from Python."""
    return sense_of(dissipation, p, body)


@entry(VECTOR(DISSIPATION, VECTOR, VECTOR, INTEGER, INTEGER))
def force_at_rest(dissipation, p, places, direction, contact_sign):  # type: ignore[no-untyped-def]
    """Return the increase of V**2 per unit of the curve parameter for a body that is at rest and begins to move in a
    direction, for a sign of N.
    """
    out, point = np.empty(places.size), point_buffer()
    forces = forces_on(dissipation, p, direction)
    for i in range(places.size):
        out[i] = direction * slope_of_v2(forces, places[i], LEAST_V2, contact_sign, point)
    return out


@Inner
def part_at(frame, distance):  # type: ignore[no-untyped-def]
    """Return where the row of the part at a distance begins."""
    at = ROWS
    for k in range(1, int(frame[PARTS])):
        row = ROWS + k * ROW_SIZE
        at = row if distance >= frame[row + BEGIN] else at
    return at


@Inner
def force_on(frame, at, distance):  # type: ignore[no-untyped-def]
    """Return C at a distance on the part whose row begins at an index."""
    x, total = (distance - frame[at + CENTRE]) / frame[at + HALF_WIDTH], 0.0
    for k in range(DEGREE):
        total = total * x + frame[at + TERMS + DEGREE - 1 - k]
    return frame[at + FORCE] + (distance - frame[at + ORIGIN]) * total


@cache
def frame_functions() -> tuple[Any, Any]:
    """Return the speed equation and the static balance of all frames."""
    compiled = compiler(__file__, interface=INTERFACE)

    @compiled(SPEED_EQUATION)
    def speed_equation(n, places, speeds, v, nu, p, out):  # type: ignore[no-untyped-def]
        own = ROWS + int(carray(p, ROWS)[PARTS]) * ROW_SIZE
        frame, work = carray(p, own + 1), rows_buffer()
        places, speeds, out = carray(places, n), carray(speeds, n), carray(out, 5 * n)
        at_rest, moving = 2 * WIDE, 7 * WIDE
        for begin in range(0, n, WIDE):  # a whole leg may have more nodes than the buffer has space for
            count = min(WIDE, n - begin)
            for i in range(count):
                distance = places[begin + i]
                at, place = part_at(frame, distance), frame[PLACE] + (distance + frame[PLACE_LOW])
                work[i] = min(max(place, frame[at + FIRST_PLACE]), frame[at + LAST_PLACE])
                work[WIDE + i] = LEAST_V2
            call_speed_equation(int(frame[ADDRESS]), count, work, (0, WIDE, at_rest), v, nu, frame[own:])
            for i in range(count):
                work[WIDE + i] = speeds[begin + i]
            call_speed_equation(int(frame[ADDRESS]), count, work, (0, WIDE, moving), v, nu, frame[own:])
            for i in range(count):
                for row in range(5):
                    out[row * n + begin + i] = work[moving + row * count + i]
                at_place = force_on(frame, part_at(frame, places[begin + i]), places[begin + i])
                change = work[moving + count + i] - work[at_rest + count + i]
                out[n + begin + i] = at_place + change

    @compiled(STATIC_BALANCE)
    def static_balance(n, places, p, out):  # type: ignore[no-untyped-def]
        own = ROWS + int(carray(p, ROWS)[PARTS]) * ROW_SIZE
        frame, work = carray(p, own + 1), rows_buffer()
        places, out = carray(places, n), carray(out, 2 * n)
        for i in range(n):
            at, place = part_at(frame, places[i]), frame[PLACE] + (places[i] + frame[PLACE_LOW])
            out[i] = out[n + i] = force_on(frame, at, places[i])
            if frame[BALANCE] != 0.0:
                work[0] = min(max(place, frame[at + FIRST_PLACE]), frame[at + LAST_PLACE])
                call_static_balance(int(frame[BALANCE]), 1, work, frame[own:], work[1:])
                out[i], out[n + i] = work[1], work[2]

    return speed_equation, static_balance


def error_of_chart(frame: Frame, dissipation: Dissipation, charts: Array) -> tuple[float, float]:
    """Return the error of the place of the equilibrium and the relative error of the force next to it, including the
    errors of the chart.

    Parameters
    ----------
    frame : Frame
        The frame.
    dissipation : Dissipation
        The module's compiled functions.
    charts : array
        As in `leg_errors.carry`.
    """
    reach, steepness = frame.reach, abs(frame.slope)
    places = float(frame.p[PLACE]) + reach * np.array([-1.0, 0.0, 1.0])
    known = force_at_rest(dissipation, frame.own_parameters, places, *frame.sense)
    of_place, of_force = frame.error, 0.0
    for p in charts:
        changes = (force_at_rest(dissipation, p, places, *frame.sense) - known) / (MAGNIFIED * steepness)
        of_place += abs(float(changes[1]))
        of_force += float(np.abs(changes - changes[1]).max()) / reach
    return of_place, of_force
