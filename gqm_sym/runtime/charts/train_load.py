"""The contact force on the cars of a train, which determines the friction on each car. Generated modules call these
functions.
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
def train_load(along_x, along_y, along_z, s, w, length, cars, g):  # type: ignore[no-untyped-def]
    """Return the mean of |N|/m over the cars of a train with its middle at s, where V**2 = w."""
    total = 0.0
    for car in range(cars):
        force, _, _ = _force_on_car((along_x, along_y, along_z), _place_of_car(s, length, cars, car), w, g)
        total += sqrt(force[0] ** 2 + force[1] ** 2 + force[2] ** 2)
    return total / cars


@Inner
def train_load_slope(along_x, along_y, along_z, s, w, length, cars, g):  # type: ignore[no-untyped-def]
    """Return the derivative of `train_load` with respect to w."""
    return _change_of_load((along_x, along_y, along_z), s, w, length, cars, g, 0)


@Inner
def train_load_rate(along_x, along_y, along_z, s, w, length, cars, g):  # type: ignore[no-untyped-def]
    """Return the derivative of `train_load` with respect to s."""
    return _change_of_load((along_x, along_y, along_z), s, w, length, cars, g, 1)


@Inner
def _change_of_load(along, s, w, length, cars, g, which):  # type: ignore[no-untyped-def]
    total = 0.0
    for car in range(cars):
        force, bend, change = _force_on_car(along, _place_of_car(s, length, cars, car), w, g)
        more = bend if which == 0 else change
        size = sqrt(force[0] ** 2 + force[1] ** 2 + force[2] ** 2)
        if size > 0.0:
            total += (force[0] * more[0] + force[1] * more[1] + force[2] * more[2]) / size
    return total / cars


@Inlined
def _force_on_car(along, s, w, g):  # type: ignore[no-untyped-def]
    """Return N/m at a place, and its derivatives with respect to w and s without their components along the track."""
    along_x, along_y, along_z = along
    k, u, laps = find(along_z, s)
    tx, kx, cx = derivatives_at(along_x, k, u, laps)
    ty, ky, cy = derivatives_at(along_y, k, u, laps)
    tz, kz, cz = derivatives_at(along_z, k, u, laps)
    force = w * kx - g * tz * tx, w * ky - g * tz * ty, w * kz + g * (tx * tx + ty * ty)
    change = (
        w * cx - g * (kz * tx + tz * kx),
        w * cy - g * (kz * ty + tz * ky),
        w * cz - 2.0 * g * tz * kz,
    )
    return force, (kx, ky, kz), change


@Inner
def train_load_in_plane(chart, s, w, length, cars, g):  # type: ignore[no-untyped-def]
    """Return the mean of |N|/m over the cars of a train on a planar track."""
    total = 0.0
    for car in range(cars):
        angle, kappa, _ = derivatives_at(chart, *find(chart, _place_of_car(s, length, cars, car)))
        total += fabs(kappa * w + g * cos(angle))
    return total / cars


@Inner
def train_load_slope_in_plane(chart, s, w, length, cars, g):  # type: ignore[no-untyped-def]
    """Return the derivative of `train_load_in_plane` with respect to w."""
    total = 0.0
    for car in range(cars):
        angle, kappa, _ = derivatives_at(chart, *find(chart, _place_of_car(s, length, cars, car)))
        total += kappa if kappa * w + g * cos(angle) >= 0.0 else -kappa
    return total / cars
