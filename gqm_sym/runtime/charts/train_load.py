"""The contact force on the cars of a train, which determines the friction on each car. Generated modules call these
functions, for many places of the train at once.

The first argument of each is the charts of the track. If other potentials than gravity act, they are followed by those
of the static load per unit mass on a body across the track under these potentials: along x, y and z, or along the
normal of a planar track. The angle of such a chart is the load, and its curvature the derivative of that.
"""

from math import fabs, sqrt

import numpy as np

from gqm_sym.runtime.arithmetic.elementary import cos
from gqm_sym.runtime.charts.evaluate import chart_rows, rows_of_charts
from gqm_sym.runtime.compiled.jit import Inlined, Inner


@Inner
def speeds_at_rest(n):  # type: ignore[no-untyped-def]
    """Return V**2 of a train that rests at n places."""
    return np.zeros(n)


@Inlined
def _fill_places_of_car(places, length, cars, car, at):  # type: ignore[no-untyped-def]
    """Fill the places of the middle of a car, from those of the middle of the train."""
    shift = length * ((car + 0.5) / cars - 0.5)
    for i in range(places.size):
        at[i] = places[i] + shift


@Inlined
def _force(w, g, aside, tangent, bend, other):  # type: ignore[no-untyped-def]
    """Return N/m, given V**2, the tangent and its derivative by arc length, and the load under other potentials.

    ``aside`` is the Coriolis acceleration across the track for each unit of horizontal component of the tangent.
    """
    (tx, ty, tz), (kx, ky, kz) = tangent, bend
    force_x = w * kx - g * tz * tx + other[0] - aside * ty
    force_y = w * ky - g * tz * ty + other[1] + aside * tx
    force_z = w * kz + g * (tx * tx + ty * ty) + other[2]
    return force_x, force_y, force_z, sqrt(force_x * force_x + force_y * force_y + force_z * force_z)


@Inlined
def _divided_by_speed(turning, root):  # type: ignore[no-untyped-def]
    """Return the derivative of ``turning*sqrt(w)`` with respect to w; 0 at rest, where it is infinite."""
    return 0.5 * turning / root if root > 0.0 else 0.0


@Inner
def train_loads(charts, places, speeds, length, cars, g, turning, out):  # type: ignore[no-untyped-def]
    """Fill the last two rows of ``out`` with the mean of |N|/m over the cars of a train on a track in space, and its
    derivative with respect to V**2.

    Parameters
    ----------
    charts : tuple of array
        As above.
    places, speeds : (n,) array
        The place of the middle of the train, and V**2.
    length, g : float
        The length of the train and the acceleration of gravity.
    cars : int
        The number of cars.
    turning : float
        The Coriolis acceleration across the track for each unit of horizontal speed: 2*Omega, negative for a train that
        moves backwards.
    out : (m, n) array
        At least two rows.
    """
    n, load, slope = places.size, out.shape[0] - 2, out.shape[0] - 1
    at, rows, other = np.empty(n), np.empty((6, n)), np.zeros((3, n))
    sums = np.zeros((2, n))
    for car in range(cars):
        _fill_places_of_car(places, length, cars, car, at)
        rows_of_charts(charts[:3], (2, 3), at, rows)
        if len(charts) > 3:
            for axis in range(3):
                chart_rows(charts[min(3 + axis, len(charts) - 1)], (2,), at, other[: axis + 1])
        for i in range(n):
            w, tx, ty, tz = speeds[i], rows[0, i], rows[2, i], rows[4, i]
            kx, ky, kz = rows[1, i], rows[3, i], rows[5, i]
            root = sqrt(w) if turning != 0.0 else 0.0
            aside, change = turning * root, _divided_by_speed(turning, root)
            load_of_others = other[0, i], other[1, i], other[2, i]
            force_x, force_y, force_z, size = _force(w, g, aside, (tx, ty, tz), (kx, ky, kz), load_of_others)
            bent = force_x * (kx - change * ty) + force_y * (ky + change * tx) + force_z * kz
            sums[0, i] += size
            sums[1, i] += bent / size if size > 0.0 else 0.0
    for i in range(n):
        out[load, i] = sums[0, i] / cars
        out[slope, i] = sums[1, i] / cars


@Inner
def train_load_rates(charts, places, speeds, length, cars, g, turning, out):  # type: ignore[no-untyped-def]
    """Fill the last row of ``out`` with the derivative of the mean of |N|/m with respect to the place, for a track in
    space; see `train_loads`.
    """
    n, rate = places.size, out.shape[0] - 1
    at, rows, other = np.empty(n), np.empty((9, n)), np.zeros((6, n))
    total = np.zeros(n)
    for car in range(cars):
        _fill_places_of_car(places, length, cars, car, at)
        rows_of_charts(charts[:3], (0, 2, 3), at, rows)  # in space x of a chart is the derivative of its curvature
        if len(charts) > 3:
            for axis in range(3):
                chart_rows(charts[min(3 + axis, len(charts) - 1)], (2, 3), at, other[: 2 * axis + 2])
        for i in range(n):
            w, tx, ty, tz = speeds[i], rows[1, i], rows[4, i], rows[7, i]
            cx, cy, cz, kx, ky, kz = rows[0, i], rows[3, i], rows[6, i], rows[2, i], rows[5, i], rows[8, i]
            aside = turning * sqrt(w) if turning != 0.0 else 0.0
            load_of_others = other[0, i], other[2, i], other[4, i]
            force_x, force_y, force_z, size = _force(w, g, aside, (tx, ty, tz), (kx, ky, kz), load_of_others)
            # The derivatives of these, without their components along the track.
            change_x = w * cx - g * (kz * tx + tz * kx) + other[1, i] - aside * ky
            change_y = w * cy - g * (kz * ty + tz * ky) + other[3, i] + aside * kx
            change_z = w * cz - 2.0 * g * tz * kz + other[5, i]
            turned = force_x * change_x + force_y * change_y + force_z * change_z
            total[i] += turned / size if size > 0.0 else 0.0
    for i in range(n):
        out[rate, i] = total[i] / cars


@Inner
def train_loads_in_plane(charts, places, speeds, length, cars, g, turning, out):  # type: ignore[no-untyped-def]
    """Fill the last two rows of ``out`` with the same as `train_loads` for a planar track, whose contact force has a
    component out of the plane if the frame turns.
    """
    n, load, slope = places.size, out.shape[0] - 2, out.shape[0] - 1
    at, rows, other = np.empty(n), np.empty((2, n)), np.zeros((1, n))
    sums = np.zeros((2, n))
    for car in range(cars):
        _fill_places_of_car(places, length, cars, car, at)
        chart_rows(charts[0], (2, 3), at, rows)
        if len(charts) > 1:
            chart_rows(charts[len(charts) - 1], (2,), at, other)
        if turning == 0.0:
            for i in range(n):
                kappa = rows[1, i]
                force = kappa * speeds[i] + g * cos(rows[0, i]) + other[0, i]
                sums[0, i] += fabs(force)
                sums[1, i] += kappa if force >= 0.0 else -kappa
            continue
        for i in range(n):
            kappa, level = rows[1, i], cos(rows[0, i])
            force, aside = kappa * speeds[i] + g * level + other[0, i], turning * level
            size = sqrt(force * force + aside * aside * speeds[i])
            sums[0, i] += size
            sums[1, i] += (force * kappa + 0.5 * aside * aside) / size if size > 0.0 else 0.0
    for i in range(n):
        out[load, i] = sums[0, i] / cars
        out[slope, i] = sums[1, i] / cars
