"""The cars of a train: their places, the contact force on each, and the force in each coupling."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from gqm_sym.errors import InputError
from gqm_sym.literals.namespaces import FLOATS
from gqm_sym.runtime.charts.train import TrackOfTrain
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.launch.rider import STANDARD_GRAVITY, rider_loads
from gqm_sym.runtime.launch.speed import length as vector_length
from gqm_sym.runtime.launch.speed import path_and_force_at, path_in_space


class Cars(NamedTuple):
    """The cars of a train at given times, numbered along increasing arc length, the last car first.

    Attributes
    ----------
    t : float or array
        Times from launch in s, as given.
    lam : array
        Arc length in m at the middle of each car. The first axis of this array, and of those below, is the cars.
    x, y, z : array
        Coordinates of these places in m; z is up, and y is 0 along a planar track.
    normal_force : array
        Contact force of each car in N, that of a body of its mass at its middle. As in `State` it has a sign along a
        planar track, and is the length of the vector in space.
    normal_x, normal_y, normal_z : array
        The same force as a vector.
    coupling_force : array
        Force in each coupling in N, positive where it pulls the cars together. The first axis is the couplings, one
        fewer than the cars.
    """

    t: Any
    lam: Any
    x: Any
    y: Any
    z: Any
    normal_force: Any
    normal_x: Any
    normal_y: Any
    normal_z: Any
    coupling_force: Any


class CarsOfRiders(NamedTuple):
    """The cars of a train on a banked track at given times: the fields of `Cars`, and the loads on riders in each car.

    Attributes
    ----------
    t, lam, x, y, z, normal_force, normal_x, normal_y, normal_z, coupling_force
        As in `Cars`.
    n_vertical, n_lateral, n_longitudinal : array
        Loads on riders at the middle of each car upwards, to the left and ahead, in units of 9.80665 m/s**2.
    """

    t: Any
    lam: Any
    x: Any
    y: Any
    z: Any
    normal_force: Any
    normal_x: Any
    normal_y: Any
    normal_z: Any
    coupling_force: Any
    n_vertical: Any
    n_lateral: Any
    n_longitudinal: Any


def cars(motion: Any, t: Any) -> Cars | CarsOfRiders:
    """Return the cars of a train at times, on a banked track with the loads on riders in each car.

    Raises
    ------
    InputError
        If the body is not a train, or a time is not a number.
    """
    problem = motion.problem
    formulas, f, track = problem.formulas, problem.functions, problem.formulas.chart
    if not isinstance(track, TrackOfTrain):
        raise InputError("cars: this body is not a train; add Train(length=..., cars=...) to its forces")
    state, values = motion.state(t), problem.p.values.tolist()
    length, _, friction, rate, *_ = (float(number) for number in track.numbers(FLOATS, values))
    chart = formulas.charted(problem.p)
    mass, count = f.mass, track.cars
    middle, v2 = np.atleast_1d(state.lam), np.atleast_1d(state.v2)
    shares = np.arange(2 * count + 1) / (2 * count) - 0.5
    places = middle + length * shares.reshape(-1, *np.ones(middle.ndim, dtype=int))
    lam, speeds = places.ravel(), np.broadcast_to(v2, places.shape).ravel()
    x, z, _, _, force = path_and_force_at(f.addresses, f.p, lam, speeds)
    if formulas.path_in_space is None:
        angle = chart.points(lam)[2]
        y, along_x, along_y, along_z = 0.0 * lam, -force * np.sin(angle), 0.0 * lam, force * np.cos(angle)
    else:
        directions = np.broadcast_to(np.atleast_1d(state.v), places.shape).ravel()
        y, *vector = path_in_space(formulas, f.p, lam, speeds, directions)
        along_x, along_y, along_z = vector
        if formulas.directed:
            force = vector_length(np.stack(vector))
    # Ends and couplings are at the even places, middles of cars at the odd ones.
    found = [row.reshape(places.shape)[1::2] for row in (lam, x, y, z)]
    found += [row.reshape(places.shape)[1::2] / count for row in (force, along_x, along_y, along_z)]
    energies = track.potential(chart, values, places[::2])[0]
    # The force of a coupling is that of the potential on the cars behind it, less their mass times the acceleration of
    # the train.
    share = shares[2:-2:2].reshape(-1, *np.ones(middle.ndim, dtype=int)) + 0.5
    behind = (energies[1:-1] - energies[0]) - share * (energies[-1] - energies[0])
    coupling = mass / length * behind
    if friction:
        # The same holds for the friction on the cars behind, which is unknown for a train that stays at rest. At a turn
        # it is that of the motion afterwards.
        velocity, size = np.atleast_1d(state.v), np.abs(found[4])
        resting = motion._resting(np.atleast_1d(state.t).ravel()).reshape(velocity.shape)
        if rate and formulas.path_in_space is None:  # the frame pushes the cars out of the plane too
            aside = 2.0 * rate * velocity * np.cos(chart.points(found[0].ravel())[2]).reshape(size.shape)
            size = vector_length(np.stack([size, mass / count * aside]))
        rubbing = np.cumsum(friction * np.where(resting, 0.0, np.copysign(1.0, velocity)) * size, axis=0)
        coupling += rubbing[:-1] - share * rubbing[-1]
    rows: list[Array] = [*found, coupling]
    kind: type[Cars] | type[CarsOfRiders] = Cars
    if formulas.rider_loads is not None:
        rows, kind = [*rows, *_loads(problem, state, found[0], partial(track.potential, chart, values))], CarsOfRiders
    return kind(state.t, *(row if np.ndim(state.lam) else row[:, 0] for row in rows))


def _loads(
    problem: Problem, state: Any, places: Array, potential: Callable[[Array], tuple[Array, Array]]
) -> tuple[Array, Array, Array]:
    """Return the loads on riders upwards, to the left and ahead at places of a train; ``potential`` is that of
    `TrackOfTrain` at places.
    """
    lam, v, ahead = (np.atleast_1d(row) for row in (state.lam, state.v, state.n_longitudinal))
    speeds, direction = (np.broadcast_to(row, places.shape).ravel() for row in (v * v, np.sign(v)))
    formulas, p, car_places = problem.formulas, problem.functions.p, places.ravel()
    upwards, sideways = rider_loads(formulas, p, car_places, speeds, direction, np.zeros(car_places.size))[:2]
    # The acceleration is that of the train; the component of the applied force along the track is that at the car.
    slopes, slope = (potential(at)[1] for at in (places, lam))
    felt = ahead + (slopes - slope) / STANDARD_GRAVITY
    return upwards.reshape(places.shape), sideways.reshape(places.shape), felt
