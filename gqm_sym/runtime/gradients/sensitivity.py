"""Derivatives of states at given times with respect to launch and parameters, after any number of periods.

At a fixed phase angle everything changes smoothly. When a variable changes, the body reaches a phase angle earlier or
later, by the changes of the time along the orbit, of the time of the launch on it, and of the elapsed periods. Below,
``delay`` is the time by which the body is further along the changed orbit.
"""

from typing import Any, NamedTuple

import numpy as np

from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.gradients.orbit import OrbitDerivatives, PathRows

# The rows of launch place and speed among the variables (`programs.Source`).
LAM0, V0 = -3, -2


class Sensitivity(NamedTuple):
    """The derivatives of a state at given times.

    Each array has one row for each name in ``wrt``, of the shape of the times.

    Attributes
    ----------
    wrt : tuple of str
        The variables of differentiation: run-time parameters, the launch place ``lam0`` and the launch speed ``v0``.
    lam, s, x, z, v, normal_force, y : array
        Derivatives of the curve parameter, of arc length from launch, of the coordinates, of the velocity ds/dt and of
        the contact force, at fixed times. That of y is 0 along a planar curve.
    """

    wrt: tuple[str, ...]
    lam: Array
    s: Array
    x: Array
    z: Array
    v: Array
    normal_force: Array
    y: Array


class _Along(NamedTuple):
    """The changes along an orbit at fixed shares of its phase: a column for each share, a row for each variable.

    Attributes
    ----------
    times : array
        The change of the time since the beginning of the phase.
    places : array
        The change of the place within the lap.
    speeds : array
        The relative change of the velocity.
    arcs : array
        The change of the arc length since the beginning of the phase: for a libration between fixed places, for a
        circulation at a fixed share.
    acceleration : array
        The acceleration along the curve in m/s2, of the shape of the times.
    path : PathRows
        The path there.
    """

    times: Array
    places: Array
    speeds: Array
    arcs: Array
    acceleration: Array
    path: PathRows


class OrbitSensitivity:
    """The derivatives of the states of one orbit by all variables.

    Parameters
    ----------
    derivatives : OrbitDerivatives
        The orbit.
    """

    def __init__(self, derivatives: OrbitDerivatives) -> None:
        self._derivatives = derivatives
        self._scale, self._width = 1.0 if derivatives.direction else 2.0 * np.pi, derivatives.width
        self._rates, self._arcs, self._lap_gradient = derivatives.series
        self._launches: dict[float, _Along] = {}

    def _by_all(self, rows: Array) -> Array:
        """Extend derivatives by the run-time parameters to derivatives by all variables, where the others are zero."""
        return np.vstack([rows, np.zeros((self._derivatives.source.variables - len(rows), rows.shape[1]))])

    def _places(self, share: Array) -> Array:
        """Return the changes of places at shares of the phase, within the lap."""
        if self._derivatives.direction:
            return self._lap_gradient * share
        upper = np.sin(np.pi * share) ** 2
        low, high = (end[:, None] for end in self._derivatives.moved_ends.T)
        places: Array = low * (1.0 - upper) + high * upper
        return places

    def _along(self, share: Array, lam: Array, v: Array) -> _Along:
        """Return the changes at shares of the phase, given the places and velocities there."""
        derivatives = self._derivatives
        (rates, times), arcs = self._rates(share), self._arcs(share)[1]
        path, places = derivatives.at_places(lam), self._places(share)
        if derivatives.direction:
            widening = self._lap_gradient / self._width
        else:
            low, high = (end[:, None] for end in derivatives.moved_ends.T)
            widening = (high - low) / self._width
        ds, potential = path.ds, path.potential
        assert potential is not None
        stretch = (self._by_all(ds[1:-1]) + ds[-1] * places) / ds[0]
        return _Along(
            times=self._scale * times[1:],
            places=places,
            speeds=v * (widening + stretch - rates[1:] / rates[0]),
            arcs=self._scale * arcs,
            acceleration=-potential[-1] / ds[0],
            path=path,
        )

    def _at_launch(self, motion: Any, points: Any) -> _Along:
        """Return the changes at the launch; its phase angle gains digits once the period is known exactly."""
        phi = points.trajectory.segments[0].phi_start
        if phi not in self._launches:
            v0 = motion.direction * motion.problem.launch.v0.value
            places = np.array([phi / self._scale]), np.array([motion.problem.lam0]), np.array([v0])
            self._launches[phi] = self._along(*places)
        return self._launches[phi]

    def _launch_delay(self, launch: _Along, motion: Any) -> Array:
        """Return the derivatives of the time from the lower turning point to the launch of a libration.

        This time follows from the launch place and also from the launch speed; the speed is used near turning points,
        the place elsewhere.
        """
        direction, given = motion.direction, motion.problem.launch
        v0, ds, acceleration = given.v0.value, launch.path.ds[0], launch.acceleration
        own: Array = np.zeros_like(launch.times)
        if v0**2 < abs(acceleration[0]) * ds[0] * self._width:
            own[V0] = given.direction  # at rest, the direction that a speed would have
            passed: Array = direction * (own - launch.speeds) / acceleration
        else:
            own[:] = self._derivatives.launch_moves[:, None]
            passed = ds / v0 * (own - launch.places)
        passed += launch.times
        return passed

    def at(self, motion: Any, points: Any, lam: Array, v: Array) -> list[Array]:
        """Return the derivatives of lam, s, x, z, v, N and y at times: a row for each variable.

        Parameters
        ----------
        motion : motion.periodic.PeriodicMotion
            The motion.
        points : motion.trajectory.PhasePoints
            The points on the orbit at the times.
        lam, v : array
            The places within the lap, and the velocities.
        """
        along, launch, laps = self._along(self._share(points), lam, v), self._at_launch(motion, points), points.laps
        delay = self._delay(along.times, launch, motion, points)
        arcs = along.arcs - launch.arcs + v * delay
        launched = self._derivatives.launch_moves[:, None]
        arcs -= launch.path.ds[0] * launched
        if self._derivatives.direction:
            arcs += laps * self._arcs(np.ones(1))[1]
        else:
            arcs += along.path.ds[0] * along.places
        places = along.places + v / along.path.ds[0] * delay
        speeds = along.speeds + along.acceleration * delay
        path = along.path

        def changed(rows: Array) -> Array:
            found: Array = self._by_all(rows[1:-1]) + rows[-1] * places
            return found

        y = np.zeros_like(places) if path.y is None else changed(path.y)
        others = [changed(path.x), changed(path.z), speeds, path.force_changes(v, speeds, changed), y]
        if not self._derivatives.by_arc_length:
            return [places + laps * self._lap_gradient, arcs, *others]
        arcs[LAM0] += 1.0  # from the start point of the curve
        return [arcs, arcs, *others]

    def places_at(self, motion: Any, points: Any, v: Array, ds: Array) -> Array:
        """Return the derivatives of lam alone, as in `at`, given v and ds/dlam."""
        share, launch = self._share(points), self._at_launch(motion, points)
        delay = self._delay(self._scale * self._rates(share)[1][1:], launch, motion, points)
        found: Array = self._places(share) + v / ds * delay + points.laps * self._lap_gradient
        return found

    def _share(self, points: Any) -> Array:
        """Return the shares of the phase at points."""
        share: Array = np.zeros_like(points.laps)
        for _, mask, phi in points.segments:
            share[mask] = phi / self._scale
        return share

    def _delay(self, times: Array, launch: _Along, motion: Any, points: Any) -> Array:
        """Return the delays at the times of points."""
        gradient = self._derivatives.duration_gradient[:, None]
        if self._derivatives.direction:
            delay: Array = -times - points.laps * gradient
            moves = self._derivatives.launch_moves[:, None]
            delay += motion.direction * launch.path.ds[0] / motion.problem.launch.v0.value * moves
            return delay
        sense, swings = np.ones_like(points.laps), 2.0 * points.laps
        first, half_period = points.trajectory.segments[0], 0.5 * points.trajectory.period[0]
        for timed, mask, _ in points.segments:
            before = timed.t_start[0] - timed.sense * timed.r_start[0] + motion.direction * first.r_start[0]
            sense[mask] = timed.sense
            swings[mask] += round(before / half_period)
        delay = motion.direction * self._launch_delay(launch, motion) - swings * gradient - sense * times
        return delay
