"""States of a motion at given times with their errors, and the time at a place."""

from abc import ABC, abstractmethod
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gqm_sym.arguments import ChecksArguments
from gqm_sym.errors import InputError, SolutionError
from gqm_sym.literals.namespaces import FLOATS
from gqm_sym.literals.numbers import read_number, read_numbers
from gqm_sym.runtime.arithmetic.doubledouble import ULP
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.ends import is_cusp
from gqm_sym.runtime.launch.equilibria import Potential
from gqm_sym.runtime.launch.kinds import MotionKind
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.launch.speed import length, path_and_force_at, path_in_space, path_in_space_once
from gqm_sym.runtime.motion.events import Leg, passages
from gqm_sym.runtime.motion.locking import computed_once, locked
from gqm_sym.runtime.motion.parts.before_joint import before_joint
from gqm_sym.runtime.motion.parts.beside_cusp import force_beside_cusp
from gqm_sym.runtime.motion.riding.loads import loads_on_rider
from gqm_sym.runtime.motion.sampler import STATE_ROWS
from gqm_sym.runtime.motion.segments import errors
from gqm_sym.runtime.motion.state import Energy, State, StateInSpace, StateOfRider
from gqm_sym.runtime.motion.trajectory import PhasePoints, TimedSegment, Trajectory, locate


class Positions(ChecksArguments, ABC):
    """The places and states of a motion.

    Attributes
    ----------
    kind, direction, problem
        As in `Motion`.
    """

    _called = "motion"
    kind: MotionKind
    direction: int

    def __init__(self, problem: Problem, kind: MotionKind, direction: int) -> None:
        self.problem = problem
        self.kind = kind
        self.direction = direction
        horizon = problem.launch.t_max
        self._horizon = inf if horizon is None else horizon.value

    # -- what subclasses say ------------------------------------------------------------------

    @abstractmethod
    def _trajectory(self, end_time: float) -> Trajectory:
        """Return the trajectory, computed for times up to ``end_time`` from launch at least."""

    def _up_to_turn(self, _: int) -> Trajectory | None:
        """Return the trajectory from launch to a turn, counted from 1, of a motion with losses; None if it has none."""
        return None

    @property
    def _listed_trajectory(self) -> Trajectory:
        """The trajectory from which legs, events and passages are read; for a motion that repeats, one period."""
        return self._trajectory(0.0)

    @abstractmethod
    def _time_error(self, t: Array) -> Array:
        """Return the estimated error in s of the time at which the body reaches its segment of the trajectory."""

    def _errors_before(self, timed: TimedSegment, phi: Array) -> tuple[float, Array]:
        """Return bounds of the errors inherited by a timed segment: those of its place, and of the times at phase
        angles.
        """
        return 0.0, np.zeros_like(phi)

    def _known_end(self) -> float:
        """Return the time in s at which the motion ends, as far as it has been computed; infinite if that is not
        known.
        """
        return self._horizon

    @property
    def t_end(self) -> float:
        """The time in s at which the motion ends, or the horizon ``t_max``; infinite if there is neither."""
        return self._known_end()

    def _end_text(self) -> str:
        return "the horizon t_max"

    @property
    @abstractmethod
    def legs(self) -> tuple[Leg, ...]:
        """The legs of the motion in the order of time."""

    # -- accuracy -----------------------------------------------------------------------------

    @property
    @locked
    def quadrature_error(self) -> float:
        """Estimated relative error of a time of flight by quadrature, for the exact numbers of the launch."""
        return max((timed.segment.relative_error for timed in self._history()), default=0.0)

    @property
    @locked
    def condition_number(self) -> float:
        """The largest relative change of a time of flight per relative change of the numbers of the launch.

        It is a property of the problem. Near a separatrix it is large, and a launch of 16 digits then determines the
        motion to correspondingly fewer digits. From 100 on, the computation itself uses extended precision.
        """
        return max((timed.segment.condition_number for timed in self._history()), default=1.0)

    def _history(self) -> tuple[TimedSegment, ...]:
        """Return the timed segments that `legs` and `events` list."""
        return self._listed_trajectory.segments

    # -- positions ----------------------------------------------------------------------------

    @locked
    def lam(self, t: Any) -> Any:
        """Return the curve parameter at given times (the inverse of the time of flight; MATHS, section 5).

        Parameters
        ----------
        t : number or array_like
            Times in s from launch, at most ``t_end``; they may be negative if the motion is periodic. Strings, ints
            and Fractions are exact.

        Returns
        -------
        float or ndarray
            Values of the shape of ``t``. In circulation the parameter increases lap by lap.

        Raises
        ------
        InputError
            If a time is not a number, negative where the motion does not repeat, or beyond ``t_end``.
        SolutionError
            If the motion cannot be followed so far.
        """
        times, low, shape = self._times(t)
        points = self._phase_points(times, low)
        return _shaped(self._places(points) + points.laps * points.trajectory.lap, shape)

    @locked
    def state(self, t: Any) -> State:
        """Return curve parameter, arc length, position, velocity, curvature and contact force at given times.

        Parameters
        ----------
        t : number or array_like
            Times in s from launch, as for `lam`.

        Returns
        -------
        State
            Floats, or arrays of the shape of ``t``.

        Raises
        ------
        InputError
            If a time is not a number, negative where the motion does not repeat, or beyond ``t_end``.
        SolutionError
            If the motion cannot be followed so far.
        """
        times, low, shape = self._times(t)
        return self._state_of(_shaped(times, shape), self._rows_of_states(times, low))

    def _rows_of_states(self, times: Array, low: Array) -> Array:
        """Return rows of lam, s, x, z, v, v**2, kappa, normal force, the error of lam and the place within the lap at
        times, each given as two doubles.
        """
        points = self._phase_points(times, low)
        f, trajectory = self.problem.functions, points.trajectory
        reduced, s, v = self._places(points), points.arc_lengths(), self._velocities(points)
        v2 = v**2
        if trajectory.segments:
            reduced = before_joint(trajectory.segments[-1], reduced)
        x, z, ds, kappa, force = path_and_force_at(f.addresses, f.p, reduced, v2)
        error = self._bound(times, points, reduced, v, ds)
        lam = reduced + points.laps * trajectory.lap
        s = (s + points.laps * trajectory.lap_length) + self.problem.arc_origin
        return np.array([lam, s, x, z, v, v2, kappa, force, error, reduced])

    def _in_space(
        self, times: Array, places: Array, v: Array, v2: Array, force: Array
    ) -> tuple[type[State], tuple[Array, ...]]:
        """Return the class of states on a space curve, and their fields in addition to those of `State`, as rows.

        In a rotating frame the contact ``force`` is filled, too.
        """
        formulas, p = self.problem.formulas, self.problem.functions.p
        rows = path_in_space(formulas, p, places, v2, v)
        if formulas.directed:
            force[:] = length(rows[1:])
        if formulas.rider_loads is None:
            return StateInSpace, (*rows,)
        return StateOfRider, (*rows, *loads_on_rider(self.problem, places, v, v2, force, self._resting(times)))

    def _resting(self, times: Array) -> NDArray[np.bool_]:
        """Return whether the body is at rest for good at times from launch."""
        if self.kind == "rest":
            return np.ones(times.size, dtype=np.bool_)
        if self.kind != "dissipative" or not times.size or (last := float(times.max())) < self._known_end():
            return np.zeros(times.size, dtype=np.bool_)
        return times >= (last if self.legs[-1].end == "rest" else inf)

    @computed_once
    def _is_at_rest_in_cusp(self) -> bool:
        """Whether the body is launched at rest in a cusp."""
        problem = self.problem
        return problem.w0 == 0.0 and is_cusp(problem, problem.lam0)

    @computed_once
    def _is_released_at_cusp(self) -> bool:
        """Whether the body is released at rest from a cusp and moves."""
        return self.kind != "rest" and self._is_at_rest_in_cusp

    @computed_once
    def _force_beside_cusp(self) -> float:
        """The contact force in N just after a release from a cusp."""
        return force_beside_cusp(self.problem, self.problem.lam0, self.direction)

    def _state_of(self, t: Any, rows: Array) -> State:
        """Return the state at one time, or at an array of times, from the rows of `_rows_of_states`."""
        kind, fields, at_launch = State, (*rows[:STATE_ROWS],), np.asarray(t == 0.0).reshape(-1)
        if at_launch.any() and self._is_released_at_cusp:
            rows[7, at_launch] = self._force_beside_cusp
        if self.problem.formulas.path_in_space is not None:
            times = np.atleast_1d(np.asarray(t, dtype=np.float64)).reshape(-1)
            kind, more = self._in_space(times, rows[STATE_ROWS], rows[4], rows[5], rows[7])
            fields += more
        shape = np.shape(t)
        return kind(t, *(_shaped(field, shape) for field in fields))

    def _state_at(self, found: tuple[float, ...]) -> State:
        """Return the state at one time from the time and the items of a column of `_rows_of_states`."""
        formulas = self.problem.formulas
        if formulas.rider_loads is not None or (found[0] == 0.0 and self._is_released_at_cusp):
            return self._state_of(found[0], np.array(found[1:]).reshape(-1, 1))
        if formulas.path_in_space is None:
            return State(*found[:-1])
        t, lam, s, x, z, v, v2, kappa, force, error, place = found
        address = formulas.path_in_space.address
        *more, size = path_in_space_once(address, self.problem.functions.p, place, v2, v)
        return StateInSpace(t, lam, s, x, z, v, v2, kappa, size if formulas.directed else force, error, *more)

    @locked
    def time_at(self, lam: Any) -> float:
        """Return the first time at which the body is at a place.

        Parameters
        ----------
        lam : number
            A value of the curve parameter, in its unit; on a closed curve laps are counted (lam + period is the next
            lap).

        Returns
        -------
        float
            Time in s from launch; 0.0 at the launch place.

        Raises
        ------
        SolutionError
            If the motion does not reach the place before ``t_end``.
        """
        formulas = self.problem.formulas
        place = read_number(lam, where=formulas.parameter, unit=formulas.units.get(formulas.parameter))
        origin = self.problem.launch.lam0
        if place.value == origin.value and place.low == origin.low:
            return 0.0
        times = self._first_passages(place.value, place.low)
        times = [t for t in times if t <= self._horizon]
        if not times:
            where = f"{self.problem.formulas.parameter} = {place.text}"
            raise SolutionError(f"time_at: the motion is never at {where}; {self._extent_text()}")
        return min(times)

    @locked
    def error_bound(self, t: Any) -> Any:
        """Return a bound on the error of ``lam(t)``, the sum of quadrature, inversion (paper, eq. 32) and rounding.

        Parameters
        ----------
        t : number or array_like
            Times in s from launch, as for `lam`.

        Returns
        -------
        float or ndarray
            Bounds in the unit of the curve parameter, of the shape of ``t``. They hold for the exact numbers of the
            launch and for exact times.

        Raises
        ------
        InputError
            As `lam`.
        """
        times, low, shape = self._times(t)
        points = self._phase_points(times, low)
        f, reduced, v = self.problem.functions, self._places(points), self._velocities(points)
        ds = path_and_force_at(f.addresses, f.p, reduced, v**2)[2]
        return _shaped(self._bound(times, points, reduced, v, ds), shape)

    def _bound(self, times: Array, points: PhasePoints, reduced: Array, v: Array, ds: Array) -> Array:
        """Return `error_bound`, given the places within the lap, the velocities and ds/dlam."""
        with np.errstate(divide="ignore", invalid="ignore"):
            rate = np.where(ds > 0.0, np.abs(v) / ds, 0.0)
        time_error, inversion_error = self._time_error(times), np.zeros_like(times)
        for timed, mask, phi in points.segments:
            place_before, time_before = self._errors_before(timed, phi)
            time_error[mask] += time_before + errors.time_error(timed.segment, phi)
            inversion_error[mask] = place_before + errors.inversion_error(timed.segment, phi)
        # The length of a lap, its multiple and the sum are rounded.
        rounding = ULP * (1.5 * np.abs(points.laps * points.trajectory.lap) + 2.0 * np.abs(reduced))
        # If nothing is known of the time, nothing is known of the place, even at rest.
        of_time = np.multiply(rate, time_error, out=np.full_like(rate, np.inf), where=time_error < np.inf)
        bound: Array = of_time + inversion_error + rounding
        return bound

    # -- energy -------------------------------------------------------------------------------

    @locked
    def energy(self, t: Any) -> Energy:
        """Return kinetic and potential energy at given times, and the energy lost since launch (MATHS, section 2).

        Parameters
        ----------
        t : number or array_like
            Times in s from launch, as for `lam`.

        Returns
        -------
        Energy
            Floats, or arrays of the shape of ``t``, in J.

        Raises
        ------
        InputError
            As `state`.
        """
        state, launch = self.state(t), self.state(0.0)
        formulas, p = self.problem.formulas, self.problem.p
        mass = self.problem.functions.mass
        inertia = 1.0 if formulas.inertia is None else float(formulas.inertia(FLOATS, p.values.tolist()))
        potential = Potential(formulas, p)

        def energies(at: State) -> tuple[Array, Array]:
            level = potential.rows(at.lam)[0].reshape(np.shape(at.lam))
            return 0.5 * mass * inertia * np.asarray(at.v2), mass * inertia * level

        kinetic, height = energies(state)
        lost = np.zeros_like(kinetic)
        if formulas.dissipation is not None:
            lost = sum(energies(launch)) - (kinetic + height)
        return Energy(*(_shaped(np.atleast_1d(array), np.shape(state.t)) for array in (kinetic, height, lost)))

    # -- inside -------------------------------------------------------------------------------

    def _times(self, t: Any) -> tuple[Array, Array, tuple[int, ...]]:
        times, low, shape = read_numbers(t, where="t", unit="s")
        if times.size:
            if not np.isfinite(times).all():
                raise InputError("t: must be finite numbers, got NaN or an infinite one")
            self._check_end(float(times.max()))
            if times.min() < 0.0 and self._trajectory(0.0).period is None:
                raise InputError(f"t: cannot be negative for a motion that does not repeat, got {float(times.min())!r}")
        return times, low, shape

    def _check_end(self, t: float) -> None:
        """Refuse a time beyond the end of the motion."""
        self._trajectory(min(t, self._horizon))
        end = self._known_end()
        if t > end:
            raise InputError(f"t: the motion ends at {end!r} s ({self._end_text()}), got {t!r}")

    def _extent_text(self) -> str:
        return "it moves " + ", ".join(f"from {leg.lam_start!r} to {leg.lam_end!r}" for leg in self.legs)

    def _phase_points(self, t: Array, t_low: Array) -> PhasePoints:
        return locate(self._trajectory(float(np.abs(t).max()) if t.size else 0.0), t, t_low)

    def _places(self, points: PhasePoints) -> Array:
        """Return the curve parameter within the lap; at launch it is exactly the launch place."""
        return points.places(self.problem.lam0)

    def _velocities(self, points: PhasePoints) -> Array:
        return points.velocities(self.direction * self.problem.launch.v0.value)

    def _first_passages(self, lam: float, low: float) -> list[float]:
        """Return the times at which the body passes a place, the first time on each segment."""
        trajectory = self._listed_trajectory
        return passages(trajectory.segments, trajectory, lam, low)


def _shaped(array: Array, shape: tuple[int, ...]) -> Any:
    return float(array[0]) if shape == () else array.reshape(shape)
