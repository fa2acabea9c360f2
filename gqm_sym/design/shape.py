"""How the time along a track through points changes when its points move up or down: all points in one pass.

A spline's knots are its own arc lengths at its points (`runtime.charts.sampled`). When a point moves, the spline
changes because it passes through another point, and because all knots change. The time follows from the normal
displacement ``dn`` of the curve alone (and from the shift of its end):

    dT = int (U_n/V**3 - kappa/V) dn ds,

with the potential's derivative U_n along the normal. The time is an integral over the track, so that the change by all
points takes one set of nodes.
"""

from functools import cached_property
from math import factorial
from typing import Any

import numpy as np
from numpy.polynomial.legendre import leggauss

from gqm_sym.literals.namespaces import ARRAYS
from gqm_sym.runtime.charts.interpolation import DEGREE, Ends, arc_length_knots, interpolated
from gqm_sym.runtime.compiled.types import Array

# The number of Gauss-Legendre nodes between two points, and of Newton steps to the place at a length.
NODES, ITERATIONS = 16, 8
_NODES, _WEIGHTS = leggauss(NODES)
SHARES, WEIGHTS = 0.5 + 0.5 * _NODES, 0.5 * _WEIGHTS

# The rule for the lengths between points from which knots follow (`charts.interpolation`): places, as shares of an
# interval, and weights.
LENGTH_SHARES = np.arange(9) / 8.0
LENGTH_WEIGHTS = (8.0 * np.array([1, 4, 2, 4, 2, 4, 2, 4, 1]) - np.array([1, 0, 4, 0, 2, 0, 4, 0, 1])) / 180.0


class SplineChanges:
    """How a spline through points changes when some of them move up.

    Parameters
    ----------
    points : (n, 2) array
        The points.
    moved : list of int
        The k points that move.

    Attributes
    ----------
    spline : scipy.interpolate.BSpline
        The spline.
    knots : (n,) array
        Its knots, which are its arc lengths at the points.
    shifts : (n, k) array
        The changes of the knots.
    lengthening : (k,) array
        The changes of its length.
    place, weight : (n - 1, NODES + 1) arrays
        Nodes between two points, as values of the spline's parameter, and weights. The last node is at the second of
        the points and has the weight 0.
    """

    def __init__(self, points: Array, moved: list[int]) -> None:
        self.knots, ends = arc_length_knots(points, closed=False)
        knots, self.spline = self.knots, interpolated(points, self.knots, ends)
        nodes, weights = leggauss(NODES)
        # The distance from the launch is the square of a variable, in which the time of a body from rest is smooth.
        roots = np.sqrt(knots - knots[0])
        middles, halves = 0.5 * (roots[1:] + roots[:-1])[:, None], 0.5 * np.diff(roots)[:, None]
        root = middles + halves * nodes
        place, weight = knots[0] + root * root, 2.0 * root * halves * weights
        self.place = np.hstack([place, knots[1:, None]])
        self.weight = np.hstack([weight, np.zeros((len(weight), 1))])
        self._ends, cardinal = ends, interpolated(np.eye(len(points))[:, moved], knots, ends)
        # A spline changes by a power of the distance behind each knot that moves: its fifth derivative jumps there.
        pieces = self.spline(0.5 * (knots[1:] + knots[:-1]), DEGREE)
        self._jumps = np.zeros_like(points)
        self._jumps[1:-1] = np.diff(pieces, axis=0)
        # The knots are the lengths, which change with the points and with the knots themselves.
        by_points = self._lengths_after(np.zeros((len(points), len(moved))), cardinal)
        by_knots = self._lengths_after(np.eye(len(points)), None)
        shifts = np.asarray(np.linalg.solve(np.eye(len(points)) - by_knots, by_points), dtype=np.float64)
        self._move(shifts, cardinal)
        self.shifts: Array = shifts
        self.lengthening = self.lengthened(knots[-1:])[0] + np.hypot(*self.spline(knots[-1], 1)) * shifts[-1]

    def _move(self, shifts: Array, cardinal: Any) -> None:
        """Let the knots move by ``shifts``, and the points as ``cardinal`` says; None if they stay."""
        self._cardinal = cardinal
        self._kicks = [-self._jumps[:, axis, None] * shifts for axis in range(2)]
        self._filled = [self._passing(axis, shifts, self._ends) for axis in range(2)]

    def _lengths_after(self, shifts: Array, cardinal: Any) -> Array:
        """Return the changes of the lengths up to all knots after `_move`, by the rule from which the knots follow."""
        self._move(shifts, cardinal)
        widths = np.diff(self.knots)
        place = self.knots[:-1, None] + widths[:, None] * LENGTH_SHARES
        first, second = self.spline(place, 1), self.spline(place, 2)
        speed = np.linalg.norm(first, axis=-1)
        moved = shifts[:-1, None] + np.diff(shifts, axis=0)[:, None] * LENGTH_SHARES[:, None]  # with the knots
        rates = np.moveaxis(self.at(place, 1), 0, 2) + second[..., None] * moved[:, :, None]
        faster = np.einsum("nia,niak->nik", first / speed[..., None], rates)
        moves = np.einsum("nik,i,n->nk", faster, LENGTH_WEIGHTS, widths)
        moves += (speed @ LENGTH_WEIGHTS)[:, None] * np.diff(shifts, axis=0)
        return np.vstack([np.zeros(shifts.shape[1]), np.cumsum(moves, axis=0)])

    def _passing(self, axis: int, shifts: Array, ends: Ends) -> Any:
        """Return the change of a coordinate, less the powers behind its knots, if the knots move by ``shifts``.

        It makes up for the shifts at the points, and at the last one, which moves, for those of the derivatives that
        vanish there on a natural spline.
        """
        kicks, knots = self._kicks[axis], self.knots
        third, fourth = ((self._behind(knots[-1:], order) @ kicks)[0] for order in (3, 4))
        at_end = -third, -fourth - self.spline(knots[-1], DEGREE)[axis] * shifts[-1]
        heights = -self.spline(knots, 1)[:, axis, None] * shifts - self._behind(knots, 0) @ kicks
        return interpolated(heights, knots, ends, at_end)

    def _behind(self, place: Array, order: int) -> Array:
        """Return the powers of the distances behind all knots, divided by the factorial, or a derivative of them."""
        power = DEGREE - 1 - order
        if power < 0:
            return np.zeros((*place.shape, len(self.knots)))
        distance = place[..., None] - self.knots
        found: Array = np.where(distance > 0.0, distance**power / factorial(power), 0.0)
        return found

    def at(self, place: Array, order: int) -> Array:
        """Return the changes of both coordinates, or of their derivatives, at fixed values of the spline's parameter.

        Returns
        -------
        (2, ..., k) array
            A number for each coordinate, place, and point that moves.
        """
        behind = self._behind(place, order)
        found = np.array(
            [filled(place, order) + behind @ kicks for filled, kicks in zip(self._filled, self._kicks, strict=True)]
        )
        if self._cardinal is not None:
            found[1] += self._cardinal(place, order)
        return found

    def _longer(self, begin: Array, end: Array) -> Array:
        """Return the changes of the lengths of parts of the spline, between fixed values of its parameter."""
        widths = end - begin
        inner = begin[:, None] + widths[:, None] * SHARES
        first = self.spline(inner, 1)
        tangent = first / np.linalg.norm(first, axis=-1, keepdims=True)
        longer: Array = np.einsum("nia,anik,i,n->nk", tangent, self.at(inner, 1), WEIGHTS, widths)
        return longer

    @cached_property
    def _longer_before(self) -> Array:
        """The changes of the lengths up to all knots."""
        longer = self._longer(self.knots[:-1], self.knots[1:])
        return np.vstack([np.zeros(longer.shape[1]), np.cumsum(longer, axis=0)])

    def lengthened(self, place: Array) -> Array:
        """Return the changes of the lengths from the first point to fixed values of the spline's parameter: a row for
        each.
        """
        number = np.clip(np.searchsorted(self.knots, place, side="right") - 1, 0, len(self.knots) - 2)
        found: Array = self._longer_before[number] + self._longer(self.knots[number], place)
        return found

    def at_lengths(self, lengths: Array, moved: Array) -> tuple[Array, Array]:
        """Return the coordinates at arc lengths, and their changes if the arc lengths change by ``moved``.

        Parameters
        ----------
        lengths : (m,) array
            Arc lengths from the first point.
        moved : (m, k) array
            Their changes.

        Returns
        -------
        (6, m) and (6, m, k) arrays
            x, z, their first derivatives with respect to the spline's parameter, and their second ones.
        """
        shares, weights = SHARES, WEIGHTS

        def ahead(begin: Array, end: Array) -> Array:
            """Return the lengths of parts of the spline."""
            first = self.spline(begin[:, None] + (end - begin)[:, None] * shares, 1)
            found: Array = (end - begin) * (np.linalg.norm(first, axis=-1) @ weights)
            return found

        # The knots are lengths to some digits only.
        edges = np.append(0.0, np.cumsum(ahead(self.knots[:-1], self.knots[1:])))
        number = np.clip(np.searchsorted(edges, lengths, side="right") - 1, 0, len(self.knots) - 2)
        begin, place = self.knots[number], lengths.copy()
        for _ in range(ITERATIONS):
            missing = lengths - edges[number] - ahead(begin, place)
            place = place + missing / np.hypot(*self.spline(place, 1).T)
        orders = [np.moveaxis(self.spline(place, order), -1, 0) for order in range(4)]
        shift = (moved - self.lengthened(place)) / np.hypot(*orders[1])[:, None]
        changes = [self.at(place, order) + orders[order + 1][..., None] * shift for order in range(3)]
        return np.concatenate(orders[:3]), np.concatenate(changes)


def time_gradient(points: Array, moved: list[int], potential: Any, p: tuple[float, ...], v0: float) -> Array:
    """Return the derivatives of the time from the first to the last point of a track, by the heights of its points.

    Parameters
    ----------
    points : (n, 2) array
        The points, the first of which does not move.
    moved : list of int
        The points that move.
    potential : callable
        ``f(op, x, z, p)`` gives the effective potential U and its derivatives with respect to x and z.
    p : tuple of float
        The run-time parameters.
    v0 : float
        The speed at the first point.
    """
    changes = SplineChanges(points, moved)
    (x, z), first, second = (np.moveaxis(changes.spline(changes.place, order), -1, 0) for order in range(3))
    u, by_x, by_z = (np.broadcast_to(part, x.shape) for part in potential(ARRAYS, x, z, p))
    speed = np.hypot(*first)
    tx, tz = first / speed
    kappa = (tx * second[1] - tz * second[0]) / speed**2
    start = potential(ARRAYS, *points[0], p)[0]
    v = np.sqrt(v0 * v0 + 2.0 * (start - u))
    change = changes.at(changes.place, 0)
    normal = change[1] * tx[..., None] - change[0] * tz[..., None]
    density = ((by_z * tx - by_x * tz) / v**3 - kappa / v) * speed * changes.weight
    ends = np.array([float(number == len(points) - 1) for number in moved])
    found: Array = np.einsum("ni,nik->k", density, normal) + ends * tz[-1, -1] / v[-1, -1]
    return found
