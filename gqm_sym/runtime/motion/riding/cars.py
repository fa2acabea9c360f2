"""The cars of a train: where they are, what the track does to each, and what each coupling carries."""

from typing import Any, NamedTuple

import numpy as np

from gqm_sym.errors import InputError
from gqm_sym.literals.namespaces import FLOATS
from gqm_sym.runtime.charts.train import TrackOfTrain
from gqm_sym.runtime.launch.speed import path_and_force_at, path_in_space_at


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


def cars(motion: Any, t: Any) -> Cars:
    """Return the cars of a train at times.

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
    length, gravity = (float(number) for number in track.numbers(FLOATS, values))
    mass, count = values[list(formulas.parameters).index("m")], track.cars
    middle, v2 = np.atleast_1d(state.lam), np.atleast_1d(state.v2)
    shares = np.arange(2 * count + 1) / (2 * count) - 0.5
    places = middle + length * shares.reshape(-1, *np.ones(middle.ndim, dtype=int))
    at, speeds = places.ravel(), np.broadcast_to(v2, places.shape).ravel()
    x, z, _, _, force = path_and_force_at(f.addresses, f.p, at, speeds)
    if formulas.path_in_space is None:
        angle = formulas.charted(problem.p).points(at)[2]
        y, along_x, along_y, along_z = 0.0 * at, -force * np.sin(angle), 0.0 * at, force * np.cos(angle)
    else:
        y, along_x, along_y, along_z = path_in_space_at(formulas.path_in_space.address, f.p, at, speeds)
    # Ends and couplings are the even places, middles of cars the odd ones.
    found = [row.reshape(places.shape)[1::2] for row in (at, x, y, z)]
    found += [row.reshape(places.shape)[1::2] / count for row in (force, along_x, along_y, along_z)]
    heights = z.reshape(places.shape)[::2]
    # Gravity on the cars behind a coupling, less what is left for them of the acceleration of all.
    share = shares[2:-2:2].reshape(-1, *np.ones(middle.ndim, dtype=int)) + 0.5
    behind = (heights[1:-1] - heights[0]) - share * (heights[-1] - heights[0])
    rows = (*found, mass * gravity / length * behind)
    return Cars(state.t, *(row if np.ndim(state.lam) else row[:, 0] for row in rows))
