"""The contact force on the cars of a train, which determines the friction on each car. Generated modules call these
functions.

The first argument of each is the charts of the track. If other potentials than gravity act, they are followed by those
of the static load per unit mass on a body across the track under these potentials: along x, y and z, or along the
normal of a planar track. The angle of such a chart is the load, and its curvature the derivative of that.
"""

from math import fabs, sqrt

from gqm_sym.runtime.arithmetic.elementary import cos
from gqm_sym.runtime.charts.evaluate import derivatives_at, find
from gqm_sym.runtime.compiled.jit import Inlined, Inner


@Inlined
def _place_of_car(s, length, cars, car):  # type: ignore[no-untyped-def]
    """Return the arc length at the middle of a car of a train with its middle at s."""
    return s + length * ((car + 0.5) / cars - 0.5)


@Inner
def train_load(charts, s, w, length, cars, g):  # type: ignore[no-untyped-def]
    """Return the mean of |N|/m over the cars of a train with its middle at s, where V**2 = w."""
    total = 0.0
    for car in range(cars):
        force, _, _ = _force_on_car(charts, _place_of_car(s, length, cars, car), w, g)
        total += sqrt(force[0] ** 2 + force[1] ** 2 + force[2] ** 2)
    return total / cars


@Inner
def train_load_slope(charts, s, w, length, cars, g):  # type: ignore[no-untyped-def]
    """Return the derivative of `train_load` with respect to w."""
    return _change_of_load(charts, s, w, length, cars, g, 0)


@Inner
def train_load_rate(charts, s, w, length, cars, g):  # type: ignore[no-untyped-def]
    """Return the derivative of `train_load` with respect to s."""
    return _change_of_load(charts, s, w, length, cars, g, 1)


@Inner
def _change_of_load(charts, s, w, length, cars, g, which):  # type: ignore[no-untyped-def]
    total = 0.0
    for car in range(cars):
        force, bend, change = _force_on_car(charts, _place_of_car(s, length, cars, car), w, g)
        more = bend if which == 0 else change
        size = sqrt(force[0] ** 2 + force[1] ** 2 + force[2] ** 2)
        if size > 0.0:
            total += (force[0] * more[0] + force[1] * more[1] + force[2] * more[2]) / size
    return total / cars


@Inlined
def _force_on_car(charts, s, w, g):  # type: ignore[no-untyped-def]
    """Return N/m at a place, and its derivatives with respect to w and s without their components along the track."""
    along_z = charts[2]
    k, u, laps = find(along_z, s)
    tx, kx, cx = derivatives_at(charts[0], k, u, laps)
    ty, ky, cy = derivatives_at(charts[1], k, u, laps)
    tz, kz, cz = derivatives_at(along_z, k, u, laps)
    load_x, change_x = _other_load(charts, 3, s)
    load_y, change_y = _other_load(charts, 4, s)
    load_z, change_z = _other_load(charts, 5, s)
    force = (
        w * kx - g * tz * tx + load_x,
        w * ky - g * tz * ty + load_y,
        w * kz + g * (tx * tx + ty * ty) + load_z,
    )
    change = (
        w * cx - g * (kz * tx + tz * kx) + change_x,
        w * cy - g * (kz * ty + tz * ky) + change_y,
        w * cz - 2.0 * g * tz * kz + change_z,
    )
    return force, (kx, ky, kz), change


@Inlined
def _other_load(charts, which, s):  # type: ignore[no-untyped-def]
    """Return a component of the load under other potentials and its derivative with respect to s; zeros if there are
    none.
    """
    load, change = 0.0, 0.0
    if which < len(charts):
        chart = charts[min(which, len(charts) - 1)]
        load, change, _ = derivatives_at(chart, *find(chart, s))
    return load, change


@Inner
def train_load_in_plane(charts, s, w, length, cars, g):  # type: ignore[no-untyped-def]
    """Return the mean of |N|/m over the cars of a train on a planar track."""
    total = 0.0
    for car in range(cars):
        force, _ = _force_in_plane(charts, _place_of_car(s, length, cars, car), w, g)
        total += fabs(force)
    return total / cars


@Inner
def train_load_slope_in_plane(charts, s, w, length, cars, g):  # type: ignore[no-untyped-def]
    """Return the derivative of `train_load_in_plane` with respect to w."""
    total = 0.0
    for car in range(cars):
        force, kappa = _force_in_plane(charts, _place_of_car(s, length, cars, car), w, g)
        total += kappa if force >= 0.0 else -kappa
    return total / cars


@Inlined
def _force_in_plane(charts, s, w, g):  # type: ignore[no-untyped-def]
    """Return N/m at a place of a planar track, and the curvature."""
    angle, kappa, _ = derivatives_at(charts[0], *find(charts[0], s))
    load, _ = _other_load(charts, 1, s)
    return kappa * w + g * cos(angle) + load, kappa
