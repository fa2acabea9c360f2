"""The force about an equilibrium as polynomials of the distance from it, to doubles or to twice as many digits.

The force on a body at rest is sampled on each part of the surroundings on which the curve is smooth. The part with the
equilibrium has a factor ``d`` divided out; on the others the force begins with the value that it has at the break
towards the equilibrium, because it is continuous there: a curve that bends abruptly has one tangent.
"""

from collections.abc import Sequence
from itertools import pairwise
from math import inf
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev, polynomial

from gqm_sym.literals.numbers import Number
from gqm_sym.runtime.arithmetic.doubledouble import ULP, add, plus, two_sum
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.interface import Dissipation, ExactLaw
from gqm_sym.runtime.legs.body import LEAST_SIZE, V2
from gqm_sym.runtime.legs.body import PLACE as BODY_PLACE
from gqm_sym.runtime.legs.body import PLACE_LOW as BODY_PLACE_LOW
from gqm_sym.runtime.legs.frames.local_frame import (
    BEGIN,
    CENTRE,
    DEGREE,
    FIRST_PLACE,
    FORCE,
    HALF_WIDTH,
    LAST_PLACE,
    ORIGIN,
    PLACE,
    PLACE_LOW,
    RANGE,
    ROW_SIZE,
    ROWS,
    SMALL_SHARE,
    TERMS,
    UNKNOWN_RETRY_SHARE,
    Frame,
    force_at_rest,
    frame_functions,
    sense_on,
    slope_at_origin,
)
from gqm_sym.runtime.legs.variations.law_at_rest import LawAtRest
from gqm_sym.runtime.multiprecision.exact_problem import GUARD_DIGITS, PRECISIONS

# The number of places on a part at which the force is fitted; the size of the last coefficients on a range that is
# narrow enough; the largest number of times that the range is halved; and the largest number of times that the fit is
# moved to the zero of the force.
NODES, RESOLVED, MAX_HALVINGS, MAX_MOVES = 64, 1e-14, 12, 4
SHARES = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)

# The matrices that take values at these nodes to coefficients of Chebyshev polynomials, by least squares, and these to
# coefficients of powers.
TO_SERIES = chebyshev.chebvander(SHARES, DEGREE).T * np.array([[1.0], *[[2.0]] * DEGREE]) / NODES
TO_POWERS = np.zeros((DEGREE + 1, DEGREE + 1))
for _k in range(DEGREE + 1):
    TO_POWERS[: _k + 1, _k] = chebyshev.cheb2poly([0.0] * _k + [1.0])

# The largest number of breaks in a range, which ends before the next one, and before one that lies within this share of
# its end.
MAX_BREAKS, THIN_SHARE = 2, 0.0625

# The largest number of steps of Newton's method to the zero of a polynomial, and the number of those in double-double
# arithmetic to an equilibrium at a break: the first ones may have begun on the other side of it.
MAX_STEPS, STEPS_AT_BREAK = 8, 3

# The distance from the start of a part at which its slope there is taken, as a share of its width.
INSIDE_SHARE = 2.0**-70

# The largest number of steps of the secant method to an equilibrium that is known in doubles, and the relative distance
# of its first two places.
MAX_SECANTS, SECANT_SHARE = 40, 2.0**-30

# There is no friction if the forces on a body at rest in the two directions differ by less than this share.
FRICTIONLESS_SHARE = 1e-12


class Breaks(NamedTuple):
    """The places about an equilibrium where the curve is not smooth but has one tangent, in increasing order.

    Attributes
    ----------
    places : array
        Their doubles.
    clearance : float
        The distance from them at which a double certainly lies on one side.
    """

    places: Array = np.empty(0)
    clearance: float = 0.0


class TryLater(NamedTuple):
    """What is known of a motion that is too large for the range about an equilibrium, or of a range in which the force
    is not resolved.

    Attributes
    ----------
    share : float
        The share of the present motion at which another attempt makes sense.
    """

    share: float


class _Fit(NamedTuple):
    """The force on a range about a place: on each part a polynomial in powers of x, which is between -1 and 1 there.

    Attributes
    ----------
    edges : array
        The distances from the place at which the parts meet, and both ends of the range.
    powers : list of array
        The coefficients on each part.
    noise : float
        The noise of the force.
    """

    edges: Array
    powers: list[Array]
    noise: float

    def middle(self, k: int) -> tuple[float, float]:
        """Return the centre and half the width of a part."""
        low, high = self.edges[k : k + 2].tolist()
        return 0.5 * (low + high), 0.5 * (high - low)

    def zero(self) -> tuple[int, float]:
        """Return the part with the zero of the force next to the place, and that zero; infinity if there is none."""
        found = []
        outer = [-inf, *self.edges[1:-1].tolist(), inf]
        for k, powers in enumerate(self.powers):
            (centre, half), slopes = self.middle(k), polynomial.polyder(powers)
            x = min(max(-centre / half, -1.0), 1.0)
            for _ in range(MAX_STEPS):
                slope = float(polynomial.polyval(x, slopes))
                step = float(polynomial.polyval(x, powers)) / slope if slope else inf
                x -= step
                if not ULP * abs(x) < abs(step) < inf:
                    break
            zero = centre + half * x if abs(x) < inf else inf
            found.append((max(outer[k] - zero, zero - outer[k + 1], 0.0), abs(zero), k, zero))
        # By rounding, a zero at a break may lie beyond it on both sides.
        beyond, _, k, zero = min(found)
        return k, zero if beyond == 0.0 else min(max(zero, outer[k]), outer[k + 1])


def _cut(breaks: Array, size: float) -> tuple[float, Array]:
    """Return the range, which is at most ``size``, and its edges, given the distances of breaks."""
    far = np.sort(np.abs(breaks))
    if far.size > MAX_BREAKS:
        size = min(size, float(far[MAX_BREAKS]))
    for distance in far[::-1].tolist():
        if (1.0 - THIN_SHARE) * size < distance < size:
            size = distance
    return size, np.array([-size, *breaks[np.abs(breaks) < size], size])


def _fit(dissipation: Dissipation, p: Array, sense: tuple[int, int], place: float, edges: Array) -> _Fit | None:
    """Return the force about a place; None if it is not resolved, or, without sliding friction, depends on the
    direction of motion.
    """
    spans = [(0.5 * (low + high), 0.5 * (high - low)) for low, high in pairwise(edges.tolist())]
    places = place + np.concatenate([centre + half * SHARES for centre, half in spans])
    force = force_at_rest(dissipation, p, places, *sense)
    largest = float(np.max(np.abs(force)))
    if not dissipation.friction:
        backwards = force_at_rest(dissipation, p, places, -1, 1)
        if not np.max(np.abs(force - backwards)) <= FRICTIONLESS_SHARE * largest:
            return None
    samples = force.reshape(len(spans), NODES).T
    series = TO_SERIES @ samples
    noise = float(np.max(np.abs(chebyshev.chebval(SHARES, series).T - samples)))
    if not noise <= RESOLVED * largest:
        return None
    powers = []
    for terms in series.T:
        kept = np.flatnonzero(np.abs(terms) > noise / np.sqrt(NODES))
        count = kept[-1] + 1 if kept.size else 0
        powers.append(TO_POWERS[:, :count] @ terms[:count])
    return _Fit(edges, powers, noise)


def frame_near(
    dissipation: Dissipation,
    p: Array,
    line: Array,
    reach: float,
    breaks: Breaks,
) -> Frame | TryLater | None:
    """Return the frame of the equilibrium next to a body; `TryLater` if there may be one for a smaller motion, and None
    if there is none.

    Parameters
    ----------
    dissipation : Dissipation
    p : array
        Run-time parameters.
    line : array
        The body (`legs.body`).
    reach : float
        The distance from there over which functions are expected to be smooth between breaks.
    breaks : Breaks
    """
    place, place_low, v2 = line[[BODY_PLACE, BODY_PLACE_LOW, V2]].tolist()
    sense = sense_on(dissipation, p, line)
    middle, (size, edges) = place, _cut(breaks.places - place, reach)
    fit = None
    for _ in range(MAX_HALVINGS):
        fit = _fit(dissipation, p, sense, middle, edges)
        if fit is not None:
            break
        size, edges = _cut(breaks.places - middle, 0.5 * size)
    for _ in range(MAX_MOVES):
        if fit is None:
            return TryLater(UNKNOWN_RETRY_SHARE)
        moved = fit.zero()[1]
        if not abs(moved) <= 0.5 * size:
            return TryLater(0.5 * size / abs(moved)) if middle == place else None
        if abs(moved) <= ULP * abs(middle):
            break
        middle += moved
        size, edges = _cut(breaks.places - middle, size)
        fit = _fit(dissipation, p, sense, middle, edges)
    if fit is None:
        return TryLater(UNKNOWN_RETRY_SHARE)
    own, low = fit.zero()
    rows = _rows(middle, low, edges[1:-1], breaks.clearance)
    for k in _outwards(own, len(rows)):
        centre, half = fit.middle(k)
        row = rows[k]
        row[CENTRE], row[HALF_WIDTH] = centre - low, half
        _begin(rows, own, k)
        row[TERMS:] = _divided(fit.powers[k], (row[ORIGIN] - row[CENTRE]) / half) / half
    speed_equation, static_balance = frame_functions()
    friction = dissipation.friction
    flags = friction, False, dissipation.linear, False
    functions = Dissipation(speed_equation.address, static_balance.address, *flags, 0, 0)
    addresses = float(dissipation.speed_equation), float(dissipation.static_balance) if friction else 0.0
    head = [*addresses, middle, low, size, float(len(rows))]
    frame = Frame(functions, np.array([*head, *rows.ravel(), *p]), 0.0, sense=sense)
    if not frame.slope:
        return None
    # The distance from an unstable equilibrium needs more digits than places of that size have.
    of_places = max(abs(middle), float(line[LEAST_SIZE]) if frame.is_stable else 0.0)
    motion, largest = frame.size((place - middle) + (place_low - low), v2), min(SMALL_SHARE * of_places, frame.reach)
    if not motion <= largest:
        return TryLater(largest / motion if motion > largest else UNKNOWN_RETRY_SHARE)
    return frame._replace(error=fit.noise / abs(frame.slope) + ULP * abs(middle))


def _rows(middle: float, low: float, breaks: Array, clearance: float) -> Array:
    """Return the rows of the parts between breaks, at distances from ``middle``, with the places on them; the
    equilibrium is at the distance ``low``.
    """
    rows = np.zeros((breaks.size + 1, ROW_SIZE))
    rows[0, BEGIN], rows[0, FIRST_PLACE], rows[-1, LAST_PLACE] = -inf, -inf, inf
    rows[1:, BEGIN] = breaks - low
    rows[1:, FIRST_PLACE], rows[:-1, LAST_PLACE] = middle + breaks + clearance, middle + breaks - clearance
    return rows


def _outwards(own: int, count: int) -> list[int]:
    """Return the parts in an order in which each follows its neighbour towards the equilibrium."""
    return [*range(own, count), *range(own - 1, -1, -1)]


def _begin(rows: Array, own: int, k: int) -> None:
    """Fill in the distance on a part that is next to the equilibrium, and the force there."""
    if k != own:
        origin = float(rows[k if k > own else k + 1, BEGIN])
        inner = rows[k - 1 if k > own else k + 1]
        x = (origin - inner[CENTRE]) / inner[HALF_WIDTH]
        rows[k, ORIGIN] = origin
        rows[k, FORCE] = inner[FORCE] + (origin - inner[ORIGIN]) * polynomial.polyval(x, inner[TERMS:])


def _divided(powers: Array, x: float) -> Array:
    """Return the coefficients of ``(C(y) - C(x))/(y - x)`` for a polynomial C."""
    quotient, last = np.zeros(powers.size - 1), 0.0
    for k in range(powers.size - 1, 0, -1):
        last = powers[k] + x * last
        quotient[k - 1] = last
    return quotient


def sharpened(frame: Frame, law: LawAtRest) -> Frame:
    """Return the frame with the equilibrium and the force on a body at rest computed in double-double arithmetic.

    Doubles locate the equilibrium and breaks only to a rounding of e, and the fitted force has a few roundings of its
    own.
    """
    place, low, size = (float(frame.p[k]) for k in (PLACE, PLACE_LOW, RANGE))
    for _ in range(STEPS_AT_BREAK if frame.breaks.size else 1):
        force, slope = law.at_rest(np.array([place]), np.array([low]), frame.sense)
        place, low = add(place, low, -float(force[0] / slope[0]), 0.0)  # Newton's method doubles the digits
    doubles = float(frame.p[PLACE]) + (frame.breaks + float(frame.p[PLACE_LOW]))
    breaks, error = [law.nearest_break(double) for double in doubles.tolist()], ULP**2 * abs(place) + law.place_error
    for known in breaks:
        if abs(sum(plus(known, (-place, -low)))) <= error:
            place, low = known  # the equilibrium is the break, as far as can be known
    rows = frame.parts.copy()
    rows[:, ORIGIN] = rows[:, FORCE] = 0.0
    rows[1:, BEGIN] = [sum(plus(known, (-place, -low))) for known in breaks]
    own = int(np.searchsorted(rows[1:, BEGIN], 0.0, side="right"))
    edges = np.array([-size, *rows[1:, BEGIN], size])
    for k in _outwards(own, len(rows)):
        row = rows[k]
        row[CENTRE], row[HALF_WIDTH] = 0.5 * (edges[k] + edges[k + 1]), 0.5 * (edges[k + 1] - edges[k])
        _begin(rows, own, k)
        inside = row[ORIGIN] + INSIDE_SHARE * (row[CENTRE] - row[ORIGIN])
        distances = np.append(row[CENTRE] + row[HALF_WIDTH] * SHARES, inside)
        high, rounding = two_sum.py_func(np.full(NODES + 1, place), distances)
        forces, slopes = law.at_rest(high, rounding + low, frame.sense)
        quotients = (forces[:NODES] - row[FORCE]) / (distances[:NODES] - row[ORIGIN])
        row[TERMS:] = TO_POWERS[:DEGREE, :DEGREE] @ (TO_SERIES[:DEGREE] @ quotients)
        row[TERMS] += slopes[NODES] - slope_at_origin(row)
    p = frame.p.copy()
    p[PLACE], p[PLACE_LOW], p[ROWS : ROWS + rows.size] = place, low, rows.ravel()
    return frame._replace(p=p, error=error, is_sharp=True)


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
