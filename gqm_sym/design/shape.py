"""How the time along a track through points changes when its points move up or down: all points in one pass.

A spline's knots are its own arc lengths at its points (`runtime.charts.sampled`). When a point moves, the spline
changes because it passes through another point, and because all knots change. The time follows from the normal
displacement ``dn`` of the curve alone (and from the shift of its end):

    dT = int (U_n/V**3 - kappa/V) dn ds,

with the potential's derivative U_n along the normal. The time is an integral over the track, so that the change by all
points takes one set of nodes.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial.legendre import leggauss

from gqm_sym.literals.namespaces import ARRAYS
from gqm_sym.runtime.charts.sampled import DEGREE, arc_length_knots
from gqm_sym.runtime.compiled.types import Array

# The number of Gauss-Legendre nodes between two points. The lengths between points change by this many iterations, each
# of which gains some digits.
NODES, ITERATIONS = 16, 8


class _Nodes(NamedTuple):
    """Nodes along a spline, with weights.

    Attributes
    ----------
    place, weight : (n, NODES) arrays
        The parameter at the nodes between two points, and the weights.
    first, second : (2, n, NODES) arrays
        The derivatives of the coordinates.
    """

    place: Array
    weight: Array
    first: Array
    second: Array


def displacements(points: Array, moved: list[int]) -> tuple[Any, _Nodes, Array]:
    """Return the spline through points, its nodes, and its displacements there for each point that moves up.

    Returns
    -------
    spline : scipy.interpolate.BSpline
        The spline.
    nodes : _Nodes
        The nodes, and behind those between the last two points the end of the track with the weight 0.
    change : (2, n, NODES + 1, k) array
        The changes of both coordinates at fixed values of the spline's parameter.
    """
    from scipy.interpolate import make_interp_spline

    knots = arc_length_knots(points, closed=False)
    spline = make_interp_spline(knots, points, k=DEGREE)
    nodes, weights = leggauss(NODES)
    # The distance from the launch is the square of a variable, in which the time of a body from rest is smooth.
    roots = np.sqrt(knots - knots[0])
    middles, halves = 0.5 * (roots[1:] + roots[:-1])[:, None], 0.5 * np.diff(roots)[:, None]
    root = middles + halves * nodes
    place, weight = knots[0] + root * root, 2.0 * root * halves * weights
    place, weight = np.hstack([place, knots[1:, None]]), np.hstack([weight, np.zeros((len(weight), 1))])
    first, second = (np.moveaxis(spline(place, order), -1, 0) for order in (1, 2))
    tangent = first / np.hypot(*first)
    # The powers of the distance behind each knot, by which a spline changes when the knot moves: its fifth derivative
    # jumps there.
    pieces = spline(0.5 * (knots[1:] + knots[:-1]), DEGREE)
    jumps = np.zeros_like(points)
    jumps[1:-1] = np.diff(pieces, axis=0)
    units, at_knots = np.eye(len(points))[:, moved], spline(knots, 1)
    cardinal = make_interp_spline(knots, units, k=DEGREE)
    straight, rate = cardinal(place), cardinal(place, 1)

    def behind(where: Array, power: int) -> Array:
        """Return the powers of the distances behind all knots, divided by the factorial."""
        found: Array = np.maximum(where[..., None] - knots, 0.0) ** power / (24.0 if power == 4 else 6.0)
        return found

    lengths = np.einsum("ni,nik->nk", weight * tangent[1], rate)
    change, moves = np.zeros((2, *straight.shape)), lengths
    for _ in range(ITERATIONS):
        shifts = np.vstack([np.zeros(len(moved)), np.cumsum(moves, axis=0)])
        moves = lengths.copy()
        for axis in range(2):
            kicks = -jumps[:, axis, None] * shifts
            missing = -at_knots[:, axis, None] * shifts - behind(knots, 4) @ kicks
            filled = make_interp_spline(knots, missing, k=DEGREE)
            change[axis] = filled(place) + behind(place, 4) @ kicks
            slope = filled(place, 1) + behind(place, 3) @ kicks
            moves += np.einsum("ni,nik->nk", weight * tangent[axis], slope)
        # The length between two knots also changes because they move.
        speed = np.hypot(*at_knots.T)[:, None]
        moves += np.diff(speed * shifts, axis=0)
    change[1] += straight
    return spline, _Nodes(place, weight, first, second), change


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
    spline, nodes, change = displacements(points, moved)
    x, z = np.moveaxis(spline(nodes.place), -1, 0)
    u, by_x, by_z = (np.broadcast_to(part, x.shape) for part in potential(ARRAYS, x, z, p))
    speed = np.hypot(*nodes.first)
    tx, tz = nodes.first / speed
    kappa = (tx * nodes.second[1] - tz * nodes.second[0]) / speed**2
    start = potential(ARRAYS, *points[0], p)[0]
    v = np.sqrt(v0 * v0 + 2.0 * (start - u))
    normal = change[1] * tx[..., None] - change[0] * tz[..., None]
    density = ((by_z * tx - by_x * tz) / v**3 - kappa / v) * speed * nodes.weight
    ends = np.array([float(number == len(points) - 1) for number in moved])
    found: Array = np.einsum("ni,nik->k", density, normal) + ends * tz[-1, -1] / v[-1, -1]
    return found
