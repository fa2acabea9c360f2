"""Small motions about an equilibrium e that is not at 0, or on a chart, with distances from e as places, and the force
at these places.

Doubles resolve a place next to e to a rounding of e, and the force there to a rounding of the terms that cancel at e.
Along a chart these roundings are no smaller about 0, where it may begin and end.
So the force on a body at rest, P(lam), is fitted by a polynomial ``C(d)`` with ``C(0) = 0``, where d is the distance
from e. Functions of the interface then serve the legs with distances for places: P becomes
``C(d) + (P(e + d, W) - P(e + d, 0))``, and all else, which does not vanish at e, is evaluated at e + d.

Small swings about a stable equilibrium stay near it. A body launched near an unstable equilibrium departs from it,
later if it was nearer, and leaves the frame; its distance at launch is computed in extended precision (`refined`).
"""

from collections.abc import Callable, Sequence
from functools import cache
from math import fabs
from typing import Any, NamedTuple

import numpy as np
from numba import carray, types
from numpy.polynomial import chebyshev

from gqm_sym.literals.numbers import Number
from gqm_sym.runtime.arithmetic.doubledouble import ULP, add, two_sum
from gqm_sym.runtime.charts.chart import MAGNIFIED
from gqm_sym.runtime.compiled.calls import call_speed_equation
from gqm_sym.runtime.compiled.emitted import compiler
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.registers import on_stack
from gqm_sym.runtime.compiled.types import MATRIX, VECTOR, Array
from gqm_sym.runtime.interface import INTERFACE, SPEED_EQUATION, STATIC_BALANCE, Dissipation, ExactLaw
from gqm_sym.runtime.legs.advance import DISSIPATION
from gqm_sym.runtime.legs.body import FIRST_STEP, HIGH, LEAST_SIZE, LOW, V2
from gqm_sym.runtime.legs.body import PLACE as BODY_PLACE
from gqm_sym.runtime.legs.leg_record import CHANGE_COUNT, END, MIDDLE, START, change_at
from gqm_sym.runtime.legs.panels.equation import Forces
from gqm_sym.runtime.legs.panels.point import LEAST_V2, point_buffer, slope_of_v2
from gqm_sym.runtime.legs.panels.polynomials import WIDE
from gqm_sym.runtime.multiprecision.exact_problem import GUARD_DIGITS, PRECISIONS

# A motion is small if it is below these shares of the distance of e from 0, and of the range of the polynomial. A
# motion wider than a quarter of that distance loses at most two bits if its places are rounded to doubles. On the
# middle quarter of a range the noise of a polynomial's slope is hardly more than DEGREE times that of the polynomial,
# and not DEGREE**2 times as at the ends. The width, which is estimated from the slope of the force at e, can only be
# four times as large if the force is a sixteenth of the estimate.
SMALL_SHARE, RANGE_SHARE = 0.25, 0.25

# The number of places at which the force is fitted; the degree; the size of the last coefficients on a range that is
# narrow enough; the largest number of times that the range is halved; and the largest number of times that the fit is
# moved to the zero of the force.
NODES, DEGREE, RESOLVED, MAX_HALVINGS, MAX_MOVES = 64, 20, 1e-14, 12, 4
SHARES = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)

# The largest number of steps of the secant method to an equilibrium that is known in doubles, and the relative distance
# of its first two places.
MAX_SECANTS, SECANT_SHARE = 40, 2.0**-30

# There is no friction if the forces on a body at rest in the two directions differ by less than this share.
FRICTIONLESS_SHARE = 1e-12

# The numbers before the module's parameters: the address of its speed equation, e as two doubles, the range, and the
# coefficients of C(d)/d in powers of d divided by the range.
ADDRESS, PLACE, PLACE_LOW, RANGE, TERMS = range(5)
OWN = TERMS + DEGREE

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
    """

    dissipation: Dissipation
    p: Array
    error: float

    @property
    def is_stable(self) -> bool:
        """Whether bodies swing about the equilibrium instead of departing from it."""
        return bool(self.p[TERMS] < 0.0)

    def size(self, distance: float, v2: float) -> float:
        """Return the size of a motion about the equilibrium, from a distance from it and V**2 there."""
        return float(np.sqrt(distance**2 + 2.0 * v2 / abs(self.p[TERMS])))

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


@Inner
def may_be_small(dissipation, p, breaks, body):  # type: ignore[no-untyped-def]
    """Return whether `frame_near` may find a frame for a body, because the force on it at rest changes its sign
    nearby.
    """
    place, reach, point = body[BODY_PLACE], body[FIRST_STEP], point_buffer()
    size = max(fabs(place), body[LEAST_SIZE])
    if dissipation.friction or dissipation.kinked or size == 0.0:
        return False
    reach = min(reach, fabs(body[LOW] - place), fabs(body[HIGH] - place))
    for known in breaks:
        reach = min(reach, fabs(known - place))
    around = min(SMALL_SHARE * size, RANGE_SHARE * reach)
    forces = Forces(dissipation.speed_equation, p, False, False, dissipation.linear, 1)
    behind = slope_of_v2(forces, place - around, LEAST_V2, 0, point)
    ahead = slope_of_v2(forces, place + around, LEAST_V2, 0, point)
    return ahead * behind < 0.0 and body[V2] < around * fabs(behind - ahead)


@entry(types.boolean(DISSIPATION, VECTOR, VECTOR, VECTOR))
def is_small(dissipation, p, breaks, body):  # type: ignore[no-untyped-def]
    """Call `may_be_small` from Python."""
    return may_be_small(dissipation, p, breaks, body)


@entry(MATRIX(DISSIPATION, VECTOR, VECTOR))
def force_at_rest(dissipation, p, places):  # type: ignore[no-untyped-def]
    """Return the increase of V**2 per unit of the curve parameter for a body at rest, a row for each direction of
    motion.
    """
    out, point = np.empty((2, places.size)), point_buffer()
    for row, v in enumerate((1, -1)):
        forces = Forces(dissipation.speed_equation, p, False, False, dissipation.linear, v)
        for i in range(places.size):
            out[row, i] = v * slope_of_v2(forces, places[i], LEAST_V2, 0, point)
    return out


@cache
def _functions() -> tuple[Any, Any]:
    """Return the speed equation and the static balance of all frames."""
    compiled = compiler(__file__, interface=INTERFACE)

    @compiled(SPEED_EQUATION)
    def speed_equation(n, places, speeds, v, nu, p, out):  # type: ignore[no-untyped-def]
        frame, work = carray(p, OWN + 1), rows_buffer()
        places, speeds, out = carray(places, n), carray(speeds, n), carray(out, 5 * n)
        for i in range(n):
            work[i], work[WIDE + i] = frame[PLACE] + (places[i] + frame[PLACE_LOW]), LEAST_V2
        at_rest, moving = 2 * WIDE, 7 * WIDE
        call_speed_equation(int(frame[ADDRESS]), n, work, (0, WIDE, at_rest), v, nu, frame[OWN:])
        for i in range(n):
            work[WIDE + i] = speeds[i]
        call_speed_equation(int(frame[ADDRESS]), n, work, (0, WIDE, moving), v, nu, frame[OWN:])
        for i in range(n):
            total, d = 0.0, places[i]
            for k in range(DEGREE):
                total = total * (d / frame[RANGE]) + frame[TERMS + DEGREE - 1 - k]
            for row in range(5):
                out[row * n + i] = work[moving + row * n + i]
            out[n + i] = d * total + (work[moving + n + i] - work[at_rest + n + i])

    @compiled(STATIC_BALANCE)
    def static_balance(n, places, p, out):  # type: ignore[no-untyped-def]
        frame, places, out = carray(p, OWN), carray(places, n), carray(out, 2 * n)
        for i in range(n):
            total = 0.0
            for k in range(DEGREE):
                total = total * (places[i] / frame[RANGE]) + frame[TERMS + DEGREE - 1 - k]
            out[i] = out[n + i] = places[i] * total

    return speed_equation, static_balance


def frame_near(
    dissipation: Dissipation, p: Array, start: tuple[float, float, float], reach: float, least_size: float
) -> Frame | None:
    """Return the frame of the equilibrium next to a body; None if there is none, or the motion about it is not small.

    Parameters
    ----------
    dissipation : Dissipation
    p : array
        Run-time parameters.
    start : (float, float, float)
        A place as two doubles, and V**2 there.
    reach : float
        The distance from there over which functions are expected to be smooth.
    least_size : float
        A size of places below which their roundings do not decrease (`legs.body`).
    """
    middle, size = start[0], reach
    for _ in range(MAX_HALVINGS):
        moved, fitted = _fit(dissipation, p, middle, size)
        if fitted is not None:
            break
        size *= 0.5
    for _ in range(MAX_MOVES):
        if fitted is None or abs(moved) > 0.5:
            return None
        if abs(moved) * size <= ULP * abs(middle):
            break
        middle += moved * size
        moved, fitted = _fit(dissipation, p, middle, size)
    if fitted is None:
        return None
    terms, noise = fitted
    low, steepness = moved * size, -float(terms[0])
    away = (start[0] - middle) + (start[1] - low)
    # The distance from an unstable equilibrium needs more digits than places of that size have.
    of_places = max(abs(middle), least_size if steepness > 0.0 else 0.0)
    if not steepness or away**2 + 2.0 * start[2] / abs(steepness) > (
        min(SMALL_SHARE * of_places, RANGE_SHARE * size) ** 2
    ):
        return None
    speed_equation, static_balance = _functions()
    functions = Dissipation(speed_equation.address, static_balance.address, False, False, dissipation.linear)
    head = [float(dissipation.speed_equation), middle, low, size, *terms]
    return Frame(functions, np.array([*head, *p]), noise / abs(steepness) + ULP * abs(middle))


def sharpened(frame: Frame, at_rest: Callable[[Array, Array], tuple[Array, Array]]) -> Frame:
    """Return the frame with the equilibrium and the force on a body at rest computed in double-double arithmetic.

    Doubles locate the equilibrium only to a rounding of e, and the fitted force has a few roundings of its own.

    Parameters
    ----------
    frame : Frame
        The frame to the accuracy of doubles.
    at_rest : callable
        The force on a body at rest, and its derivative with respect to the place, at places that are given as two
        doubles each.
    """
    place, low, size = (float(frame.p[k]) for k in (PLACE, PLACE_LOW, RANGE))
    force, slope = at_rest(np.array([place]), np.array([low]))
    place, low = add(place, low, -float(force[0] / slope[0]), 0.0)  # Newton's method doubles the digits
    distances = size * np.append(SHARES, 0.0)
    high, rounding = two_sum.py_func(np.full(NODES + 1, place), distances)
    forces, slopes = at_rest(high, rounding + low)
    terms = chebyshev.cheb2poly(chebyshev.chebfit(SHARES, forces[:NODES] / distances[:NODES], DEGREE - 1))
    terms[0] = slopes[NODES]
    p = frame.p.copy()
    p[PLACE], p[PLACE_LOW], p[TERMS:OWN] = place, low, terms
    return frame._replace(p=p, error=ULP**2 * abs(place))


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
    reach, terms = frame.reach, frame.p[TERMS:OWN]
    places = float(frame.p[PLACE]) + reach * np.array([-1.0, 0.0, 1.0])
    known, of_place, of_force = force_at_rest(dissipation, frame.p[OWN:], places)[0], frame.error, 0.0
    for p in charts:
        changes = (force_at_rest(dissipation, p, places)[0] - known) / (MAGNIFIED * abs(float(terms[0])))
        of_place += abs(float(changes[1]))
        of_force += float(np.abs(changes - changes[1]).max()) / reach
    return of_place, of_force


def refined(frame: Frame, law: ExactLaw, parameters: Sequence[Number], lam0: Number) -> tuple[Frame, float] | None:
    """Return the frame with its equilibrium from extended precision, and the distance of a launch place from that.

    Parameters
    ----------
    frame : Frame
        The frame to the accuracy of doubles.
    law : ExactLaw
        The formulas of the forces, none of which is friction.
    parameters : sequence of Number
        Run-time parameters.
    lam0 : Number
        The launch place.

    Returns
    -------
    (Frame, float) or None
        The distance is 0 if the launch is at the equilibrium. None if the secant method does not converge to it.
    """
    from mpmath.ctx_mp import MPContext

    context, near, distance = MPContext(), float(frame.p[PLACE]), 0.0
    e: Any = near
    for digits in PRECISIONS:
        context.dps = digits
        values, place, zero = tuple(number.at(context) for number in parameters), lam0.at(context), context.mpf(0)
        tolerance = context.mpf(10) ** (GUARD_DIGITS - digits) * abs(place)
        before, e = context.mpf(near), context.mpf(near) * (1 + SECANT_SHARE)
        force_before = law.speed_slope(context, before, zero, 1, 0, values)
        for _ in range(MAX_SECANTS):
            force = law.speed_slope(context, e, zero, 1, 0, values)
            if abs(e - before) <= tolerance or force == force_before:
                break
            before, e, force_before = e, e - force * (e - before) / (force - force_before), force
        if not (abs(e - before) <= tolerance and abs(e - near) <= SMALL_SHARE * abs(near)):
            return None
        if abs(place - e) > tolerance:
            distance = float(place - e)
            break
    p = frame.p.copy()
    p[PLACE], p[PLACE_LOW] = float(e), float(e - float(e))
    return frame._replace(p=p, error=0.0), distance


def _fit(dissipation: Dissipation, p: Array, middle: float, size: float) -> tuple[float, tuple[Array, float] | None]:
    """Return the zero of the force, as a share of the range; the coefficients of C(d)/d; and the noise of the force.

    There are no coefficients if the force is not resolved on the range, or depends on the direction of motion.
    """
    forwards, backwards = force_at_rest(dissipation, p, middle + size * np.append(SHARES, 0.0))
    largest = float(np.max(np.abs(forwards)))
    if not np.max(np.abs(forwards - backwards)) <= FRICTIONLESS_SHARE * largest:
        return 0.0, None
    series = chebyshev.chebfit(SHARES, forwards[:NODES], DEGREE)
    noise = float(np.max(np.abs(chebyshev.chebval(SHARES, series) - forwards[:NODES])))
    if not noise <= RESOLVED * largest:
        return 0.0, None
    kept = np.flatnonzero(np.abs(series) > noise / np.sqrt(NODES))
    powers = np.zeros(DEGREE + 1)
    found = chebyshev.cheb2poly(series[: kept[-1] + 1])
    powers[: found.size] = found
    moved = -float(forwards[NODES] / powers[1]) if powers[1] else 1.0
    return moved, (powers[1:] / size, noise)
