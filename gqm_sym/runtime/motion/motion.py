"""The motion that a launch begins, and the states, events and errors that can be asked of it."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from math import inf, isfinite
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gqm_sym.arguments import one_of, short
from gqm_sym.errors import InputError, SolutionError, renamed
from gqm_sym.export.html import page, summary
from gqm_sym.literals.namespaces import FLOATS
from gqm_sym.literals.numbers import Number, read_number, read_numbers
from gqm_sym.runtime.arithmetic.doubledouble import ULP, Pair
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.gradients.orbit import check_force
from gqm_sym.runtime.gradients.sensitivity import Sensitivity
from gqm_sym.runtime.gradients.spectrum import Fourier
from gqm_sym.runtime.launch.equilibria import Potential
from gqm_sym.runtime.launch.kinds import QUANTITIES, MotionKind
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.launch.request import Launch, LaunchRequest
from gqm_sym.runtime.launch.speed import length, path_and_force_at, path_in_space
from gqm_sym.runtime.motion.events import (
    Event,
    Leg,
    contact_changes,
    corner_crossings,
    crossings,
    passages,
)
from gqm_sym.runtime.motion.extremes import SPEED, Extreme, extreme, force_of
from gqm_sym.runtime.motion.locking import Lock, locked
from gqm_sym.runtime.motion.riding.cars import Cars, CarsOfRiders, cars
from gqm_sym.runtime.motion.riding.exceedance import Exceedance, exceedance
from gqm_sym.runtime.motion.riding.loads import felt, load_extreme
from gqm_sym.runtime.motion.rolling import slip_times
from gqm_sym.runtime.motion.rows import Rows
from gqm_sym.runtime.motion.state import Energy, State, StateInSpace, StateOfRider
from gqm_sym.runtime.motion.trajectory import PhasePoints, TimedSegment, Trajectory, locate


class Motion(ABC):
    """A motion along a curve, computed as far as it is asked for; many threads may ask at once.

    Attributes
    ----------
    kind : str
        "libration", "circulation", "transit", "asymptotic", "rest" or "dissipative" (MATHS, section 6). A motion to
        infinity is a transit, and any motion with friction, drag or resistance that moves at all is dissipative.
    direction : int
        The sign of ds/dt after launch.
    problem : Problem
        The launch and the module that it is of.
    """

    kind: MotionKind
    direction: int

    def __init__(self, problem: Problem, kind: MotionKind, direction: int) -> None:
        self.problem = problem
        self.kind = kind
        self.direction = direction
        self._lock = Lock()
        horizon = problem.launch.t_max
        self._horizon = inf if horizon is None else horizon.value

    if not TYPE_CHECKING:
        __getattr__ = renamed({"conditioning": "condition_number"}, "a motion")

    # -- what subclasses say ------------------------------------------------------------------

    @property
    def _internal_ends(self) -> tuple[str, ...]:
        """Ends of timed segments that end no leg."""
        return ("",)

    @abstractmethod
    def _trajectory(self, end_time: float) -> Trajectory:
        """The trajectory, computed for times up to ``end_time`` from launch at least."""

    @property
    def _course(self) -> Trajectory:
        """The trajectory that legs, events and passages are read off: of a motion that repeats, one period."""
        return self._trajectory(0.0)

    @abstractmethod
    def _time_error(self, t: Array) -> Array:
        """Estimated error in s of the time at which the body comes to its segment of the trajectory."""

    def _errors_before(self, timed: TimedSegment, phi: Array) -> tuple[float, Array]:
        """Bounds of the errors from before a timed segment: of its place, and of the times at phase angles."""
        return 0.0, np.zeros_like(phi)

    @property
    def turning_points(self) -> tuple[float, ...]:
        """The turning points, as values of the curve parameter in the order of time.

        A launch from rest counts as a turning point at t = 0.
        """
        return ()

    @property
    def t_end(self) -> float:
        """The time in s at which the motion ends, or the horizon ``t_max``; infinite if there is neither."""
        return self._known_end()

    @property
    def rest_position(self) -> float:
        """Where the body rests in the end, as a value of the curve parameter.

        Raises
        ------
        SolutionError
            If the motion does not come to rest, or not before ``t_max``.
        """
        if self.kind == "rest":
            return self.problem.lam0
        if not self.t_end < inf:
            raise SolutionError("rest_position: this motion goes on for ever and does not come to rest")
        last = self.legs[-1]
        if last.end != "rest":
            raise SolutionError(f"rest_position: this motion does not come to rest; it ends with {last.end!r}")
        return last.lam_end

    # -- periods ------------------------------------------------------------------------------

    @property
    def half_period(self) -> float:
        """Time in s from one turning point to the other (libration only; MATHS, section 4).

        Raises
        ------
        SolutionError
            If the motion is of another kind.
        """
        raise SolutionError(f"half_period: only a libration has one; this motion is of kind {self.kind!r}")

    @property
    def period(self) -> float:
        """Time in s after which the motion repeats (libration and circulation).

        Raises
        ------
        SolutionError
            If the motion does not repeat.
        """
        raise SolutionError(f"period: this motion is of kind {self.kind!r} and does not repeat")

    def period_to(self, digits: int) -> str:
        """The period in s as a decimal string.

        Parameters
        ----------
        digits : int
            The number of correct digits, from 1 to 1000.

        Returns
        -------
        str
            The decimal string, rounded to nearest.

        Raises
        ------
        InputError
            If the number of digits is out of range.
        SolutionError
            If the motion does not repeat, or its curve is known in doubles only.
        """
        raise SolutionError(f"period_to: this motion is of kind {self.kind!r} and does not repeat")

    # -- gradients ----------------------------------------------------------------------------

    def gradient(self, quantity: str, wrt: Any = None, *, lam: Any = None, order: int = 1) -> dict[str, Any]:
        """The derivatives of a quantity of this motion by its launch and run-time parameters.

        Parameters
        ----------
        quantity : str
            "turning_points", "v_max", "v_min", "normal_force_max", "normal_force_min", "time_at" or "t_end"; of a
            periodic motion also "half_period", "period" or "action", and of one with losses "rest_position".
        wrt : str or sequence of str, optional
            What the derivatives are by: run-time parameters, "lam0" and "v0"; all of them if not given.
        lam : number, optional
            For "time_at": the place, as of `time_at`.
        order : int
            2 for the second derivatives of "half_period" or "period".

        Returns
        -------
        dict
            A float for each name; of turning points a tuple, in the order of `turning_points`. At ``v0 = 0`` the
            derivative by v0 is that for greater speeds. Of second derivatives a dict for each name, with a float for
            each other.

        Raises
        ------
        InputError
            If there is no such quantity or parameter.
        SolutionError
            If the motion does not have the quantity, or gradients are not there yet for motions of its kind.
        """
        one_of(quantity, QUANTITIES, where="gradient: quantity")
        if (lam is None) == (quantity == "time_at"):
            raise InputError(f"lam: is the place that 'time_at' asks about, got {short(lam)} with {quantity!r}")
        if type(order) is not int or order not in (1, 2):
            raise InputError(f"gradient: order must be 1 or 2, got {short(order)}")
        if order == 2:
            return self._second_gradient(quantity, wrt)
        check_force(self.problem.formulas, quantity)
        return self._gradient(quantity, wrt) if lam is None else self._arrival_gradient(lam, wrt)

    def _gradient(self, quantity: str, wrt: Any) -> dict[str, Any]:
        raise self._without_gradients()

    def _second_gradient(self, quantity: str, wrt: Any) -> dict[str, dict[str, float]]:
        raise SolutionError(f"gradient: only periodic motions have second derivatives; this one is {self.kind!r}")

    def _arrival_gradient(self, lam: Any, wrt: Any) -> dict[str, Any]:
        """The derivatives of the time at which the body is at a place: what carries it on makes that earlier."""
        t = self.time_at(lam)
        state, changes, f = self.state(t), self._sensitivity(t, wrt), self.problem.functions
        if state.v == 0.0:
            raise SolutionError("gradient: time_at of a place where the body turns has none")
        rate = state.v / path_and_force_at(f.addresses, f.p, np.array([state.lam]), np.zeros(1))[2, 0]
        return dict(zip(changes.wrt, (-changes.lam / rate).tolist(), strict=True))

    @property
    def nearest_switch(self) -> Any:
        """The turn at which a motion with friction comes nearest to resting, or to one leg more; None if there is none.

        Returns
        -------
        Switch or None
            Its time ``t``, its place ``lam``, and ``margin``: by how much the pull along the track is larger there than
            what can hold the body, as a share of the latter, negative where it stays. The derivatives of a motion are
            those for the legs that it has; at a margin of 0 they are one-sided.
        """
        return None

    def sensitivity(self, t: Any, wrt: Any = None) -> Sensitivity:
        """The derivatives of the state at given times by launch and run-time parameters.

        Of a periodic motion they are as exact, and take as long, after a million periods as after one. With losses they
        are carried from leg to leg.

        Parameters
        ----------
        t : number or array_like
            Times in s from launch, as for `lam`.
        wrt : str or sequence of str, optional
            What the derivatives are by, as for `gradient`.

        Returns
        -------
        Sensitivity
            Arrays with one row for each name, of the shape of ``t``.

        Raises
        ------
        InputError
            If there is no such parameter, or as `lam`.
        SolutionError
            If gradients are not there yet for motions of this kind, or on curves in space.
        """
        check_force(self.problem.formulas, "sensitivity")
        return self._sensitivity(t, wrt)

    def _sensitivity(self, t: Any, wrt: Any) -> Sensitivity:
        """`sensitivity`, of which the contact force is right only where that has a sign."""
        raise self._without_gradients()

    def place_changes(self, t: Any, wrt: Any) -> Array:
        """The derivatives of the curve parameter alone, as of `sensitivity`, which takes longer."""
        return self._sensitivity(t, wrt).lam

    @property
    def action(self) -> float:
        """The integral of (1 + beta) V ds over one period, per mass, in m2/s (libration and circulation).

        Raises
        ------
        SolutionError
            As `gradient`.
        """
        raise self._without_period("action")

    @property
    def period_slope(self) -> float:
        """dT/dE, the derivative of the period by the energy per mass, in s3/m2; raises what `action` does."""
        raise self._without_period("period_slope")

    def fourier(self, quantity: str, n: int) -> Fourier:
        """The Fourier coefficients of a quantity over one period (libration and circulation).

        Parameters
        ----------
        quantity : str
            "x", "z", "v" or "normal_force"; of a libration also "lam" or "s".
        n : int
            The order of the last coefficient.

        Returns
        -------
        Fourier
            Arrays ``a`` and ``b`` from order 0 to n: the quantity is the sum of a[k] cos(2 pi k t/T) and
            b[k] sin(2 pi k t/T), with t from launch.

        Raises
        ------
        InputError
            If there is no such quantity or order.
        SolutionError
            If the quantity does not repeat.
        """
        raise SolutionError(f"fourier: only a motion that repeats has coefficients; it is of kind {self.kind!r}")

    def _without_period(self, asked: str) -> SolutionError:
        """What is raised by motions that do not repeat, by the name of what was asked for."""
        return SolutionError(
            f"{asked}: only a libration or a circulation has one; this motion is of kind {self.kind!r}"
        )

    def _without_gradients(self) -> SolutionError:
        """What is raised by motions without gradients."""
        return SolutionError(
            "gradients: only librations, circulations and motions with losses have them yet; "
            f"this motion is of kind {self.kind!r}"
        )

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

    # -- positions ----------------------------------------------------------------------------

    @locked
    def lam(self, t: Any) -> Any:
        """The curve parameter at times (the inverse of the time of flight; MATHS, section 5).

        Parameters
        ----------
        t : number or array_like
            Times in s from launch, at most ``t_end``; they may be negative if the motion is periodic. Strings, ints
            and Fractions are exact.

        Returns
        -------
        float or ndarray
            Values of the shape of ``t``. In circulation the parameter grows lap by lap.

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
        """Curve parameter, arc length, position, velocity, curvature and contact force at times.

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
        points = self._phase_points(times, low)
        f, trajectory = self.problem.functions, points.trajectory
        reduced, s, v = self._places(points), points.arc_lengths(), self._velocities(points)
        v2 = v**2
        x, z, ds, kappa, force = path_and_force_at(f.addresses, f.p, reduced, v2)
        error = self._bound(times, points, reduced, v, ds)
        lam = reduced + points.laps * trajectory.lap
        s = (s + points.laps * trajectory.lap_length) + self.problem.arc_origin
        kind, more = self._in_space(times, reduced, v, v2, force)
        found = [_shaped(array, shape) for array in (times, lam, s, x, z, v, v2, kappa, force, error)]
        return kind(*found, *(_shaped(array, shape) for array in more))

    def _in_space(self, times: Array, places: Array, v: Array, v2: Array, force: Array) -> tuple[type[State], Array]:
        """The kind of state that there is on the curve, and what it has beside the fields of `State`, as rows.

        In a frame that turns the contact ``force`` is filled, too.
        """
        formulas, p = self.problem.formulas, self.problem.functions.p
        if formulas.path_in_space is None:
            return State, np.empty((0, 0))
        rows = path_in_space(formulas, p, places, v2, v)
        if formulas.directed:
            force[:] = length(rows[1:])
        if formulas.rider_loads is None:
            return StateInSpace, rows
        return StateOfRider, np.concatenate([rows, felt(self.problem, places, v, v2, force, self._resting(times))])

    def _resting(self, times: Array) -> NDArray[np.bool_]:
        """Whether the body is at rest for good at times from launch."""
        if self.kind == "rest":
            return np.ones(times.size, dtype=np.bool_)
        if self.kind != "dissipative" or not times.size or (last := float(times.max())) < self._known_end():
            return np.zeros(times.size, dtype=np.bool_)
        return times >= (last if self.legs[-1].end == "rest" else inf)

    def _state_of(self, t: Any, rows: Array) -> State:
        """The state at one time, or at an array of times, from the rows of `Sampler.states` at places within a lap."""
        times = np.atleast_1d(np.asarray(t, dtype=np.float64)).reshape(-1)
        kind, more = self._in_space(times, rows[0], rows[4], rows[5], rows[7])
        rows = np.concatenate([rows, more]) if more.size else rows
        return kind(t, *rows.reshape(-1, *t.shape)) if np.ndim(t) else kind(t, *rows[:, 0].tolist())

    @locked
    def time_at(self, lam: Any) -> float:
        """The first time at which the body is at a place.

        Parameters
        ----------
        lam : number
            A value of the curve parameter, in its unit; on a closed curve laps count (lam + period is the next lap).

        Returns
        -------
        float
            Time in s from launch; 0.0 at the launch place.

        Raises
        ------
        SolutionError
            If the motion is never there before ``t_end``.
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
        """A bound of the error of ``lam(t)``: the parts of quadrature and of inversion (paper, eq. 32), and rounding.

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
        """`error_bound`, from the places within the lap, the velocities and ds/dlam."""
        with np.errstate(divide="ignore", invalid="ignore"):
            rate = np.where(ds > 0.0, np.abs(v) / ds, 0.0)
        time_error, inversion_error = self._time_error(times), np.zeros_like(times)
        for timed, mask, phi in points.segments:
            place_before, time_before = self._errors_before(timed, phi)
            time_error[mask] += time_before + timed.segment.time_error(phi)
            inversion_error[mask] = place_before + timed.segment.inversion_error(phi)
        # The length of a lap, its multiple and the sum are rounded.
        rounding = ULP * (1.5 * np.abs(points.laps * points.trajectory.lap) + 2.0 * np.abs(reduced))
        # Where nothing is known of the time, nothing is known of the place, at rest too.
        of_time = np.multiply(rate, time_error, out=np.full_like(rate, np.inf), where=time_error < np.inf)
        bound: Array = of_time + inversion_error + rounding
        return bound

    # -- energy and extremes ------------------------------------------------------------------

    @locked
    def energy(self, t: Any) -> Energy:
        """Kinetic and potential energy at times, and what has been lost since launch (MATHS, section 2).

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
        mass = float(p.values[list(formulas.parameters).index("m")])
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

    @property
    @locked
    def v_max(self) -> Extreme:
        """The largest speed, its time and its place, over one period or over the whole motion.

        Raises
        ------
        SolutionError
            If the motion goes on for ever without repeating; give it a horizon, ``t_max``.
        """
        return extreme(self, SPEED, 1)

    @property
    @locked
    def v_min(self) -> Extreme:
        """The least speed; as `v_max`. It is 0 at a turning point."""
        return extreme(self, SPEED, -1)

    @property
    @locked
    def normal_force_max(self) -> Extreme:
        """The largest contact force along the normal; as `v_max`."""
        return extreme(self, force_of(self.problem), 1)

    @property
    @locked
    def normal_force_min(self) -> Extreme:
        """The least contact force along the normal, which may be negative; as `v_max`."""
        return extreme(self, force_of(self.problem), -1)

    n_vertical_max, n_vertical_min = load_extreme("vertical", 1), load_extreme("vertical", -1)
    n_lateral_max, n_lateral_min = load_extreme("lateral", 1), load_extreme("lateral", -1)
    n_longitudinal_max, n_longitudinal_min = load_extreme("longitudinal", 1), load_extreme("longitudinal", -1)

    @locked
    def exceedance(self, load: str, levels: Any, *, side: str = "above", limits: Any = None) -> Exceedance:
        """How long a load on a rider is beyond each of some levels, over one period or over the whole motion.

        Parameters
        ----------
        load : {"vertical", "lateral", "longitudinal"}
            Which load.
        levels : number or array_like
            Levels in units of 9.80665 m/s**2.
        side : {"above", "below"}
            Which side of a level is beyond it.
        limits : sequence of pairs, optional
            What may be felt: pairs of a duration in s and a level, both as numbers, of which the levels fall (rise, if
            the side is "below") as durations grow. Between them the limit is linear.

        Returns
        -------
        Exceedance
            ``total`` and ``longest`` times in s, and beside them the times that the limits ``allow``.

        Raises
        ------
        InputError
            If there is no such load, no roll was declared, or levels or limits are none.
        SolutionError
            If the motion goes on for ever without repeating; give it a horizon, ``t_max``.
        """
        return exceedance(self, load, levels, side, limits)

    @locked
    def cars(self, t: Any) -> Cars | CarsOfRiders:
        """Where the cars of a train are, what forces act on each, and on banked tracks what riders feel.

        Parameters
        ----------
        t : number or array_like
            Times in s from launch, as for `lam`.

        Returns
        -------
        Cars, or CarsOfRiders on a banked track
            Arrays whose first axis is the cars, or the couplings between them.

        Raises
        ------
        InputError
            If the body is no train, or a time is none.
        """
        return cars(self, t)

    # -- history ------------------------------------------------------------------------------

    @property
    @locked
    def legs(self) -> tuple[Leg, ...]:
        """The legs of the motion in the order of time, over one period from launch if it is periodic.

        Returns
        -------
        tuple of Leg
            Of a motion that goes on for ever, those of its beginning; ``t_max`` says how far to go.
        """
        legs = []
        course = self._course
        for timed in self._history():
            corners = corner_crossings(timed, timed.segment.functions.corners, course.time_scale_error)
            last = "corner" if corners and corners[-1][1] == timed.phi_stop else timed.end
            corners = corners[:-1] if last != timed.end else corners
            marks = [(timed.t_start, timed.phi_start), *corners, (timed.t_stop, timed.phi_stop)]
            lam = self._places_at(timed, marks) + timed.laps * course.lap
            for k, ((start, _), (stop, _)) in enumerate(pairwise(marks)):
                end = last if k == len(marks) - 2 else "corner"
                legs.append(Leg(float(lam[k]), float(lam[k + 1]), start[0], stop[0], timed.direction, end))
            if timed.end == "asymptote":
                legs[-1] = replace(legs[-1], lam_end=timed.segment.b + timed.laps * course.lap, t_end=inf)
        return Rows(self._up_to_horizon(merged(legs, self._internal_ends)))

    def _places_at(self, timed: TimedSegment, marks: Sequence[tuple[Pair, float]]) -> Array:
        """The places at phase angles of a segment, each with its time; at launch it is exactly the launch place."""
        lam = timed.segment.places(np.array([phi for _, phi in marks]))
        lam[[time[0] == 0.0 for time, _ in marks]] = self.problem.lam0
        return lam

    @property
    @locked
    def events(self) -> tuple[Event, ...]:
        """The events of the motion in the order of time, over one period from launch if it is periodic.

        Returns
        -------
        tuple of Event
            For a periodic motion, `events_between` gives those of other periods; of any other motion that goes on for
            ever these are the events of its beginning.
        """
        return Rows(self._events_along(self._history()))

    def _events_along(self, segments: Sequence[TimedSegment], until: float = inf) -> list[Event]:
        """The events on timed segments from launch, and the horizon if it is not later than a time in s."""
        found: list[Event] = []
        time_scale_error = self._course.time_scale_error
        for timed in segments:
            found_here = [("contact-sign", *m) for m in self._contact_changes(timed)]
            found_here += [
                ("corner", *m) for m in corner_crossings(timed, timed.segment.functions.corners, time_scale_error)
            ]
            found_here += [("slip", *m) for m in slip_times(self.problem, timed, time_scale_error)]
            found += [self._event(kind, when, timed, phi) for kind, when, phi in sorted(found_here, key=lambda m: m[1])]
            if timed.end == "asymptote":
                found.append(self._asymptote(timed))
            elif timed.end not in ("", "horizon"):
                found.append(self._event(timed.end, timed.t_stop, timed, timed.phi_stop))
        end = self._known_end()
        if end < inf and end <= until and not (found and found[-1].t == end):
            found = [event for event in found if event.t < end]
            state = self.state(end)
            found.append(Event("horizon", end, state.lam, state.x, state.z))
        return found

    @locked
    def events_between(self, t1: Any, t2: Any) -> tuple[Event, ...]:
        """The events from one time to another, over as many periods as that takes.

        Parameters
        ----------
        t1, t2 : number
            Times in s from launch, both of them included.

        Returns
        -------
        tuple of Event
            The events in the order of time; none beyond ``t_end``.

        Raises
        ------
        InputError
            If a time is not a number.
        """
        start, stop = read_number(t1, where="t1", unit="s").value, read_number(t2, where="t2", unit="s").value
        found = self._events_along(self._trajectory(min(stop, self._horizon)).segments, stop)
        return Rows(event for event in found if start <= event.t <= stop)

    def _up_to_horizon(self, legs: list[Leg]) -> list[Leg]:
        """The legs up to the horizon, at which the last one is cut."""
        end = self._horizon
        out = [leg for leg in legs if leg.t_start < end or leg.t_end == end]
        if out and (out[-1].t_end > end or out[-1].end == ""):
            last = out.pop()
            cut = last.t_end > end
            place, when = (self._place_on_last_leg(end), end) if cut else (last.lam_end, last.t_end)
            out.append(Leg(last.lam_start, place, last.t_start, when, last.direction, "horizon"))
        return out

    def _place_on_last_leg(self, t: float) -> float:
        """The curve parameter at a time on the last of the legs."""
        return float(self.lam(t))

    # -- pictures -----------------------------------------------------------------------------

    def plot(self, what: str = "track", *, axes: Any = None) -> Any:
        """Draw the motion with Matplotlib.

        Parameters
        ----------
        what : {"track", "speed_and_force", "portrait"}
            The track, coloured by the sign and size of the contact force; speed and contact force against arc
            length; or the phase portrait round the orbit. All events are marked on the first two.
        axes : matplotlib Axes, optional
            Where to draw (a pair of them for "speed_and_force"); a new figure if not given.

        Returns
        -------
        matplotlib.figure.Figure
            The figure.

        Raises
        ------
        InputError
            If ``what`` is another word.
        """
        from gqm_sym.figures.motions import drawing

        return drawing(self, what, axes)

    def to_xarray(self, t: Any = None) -> Any:
        """The states at times as an xarray Dataset, with units and with what the motion was computed from.

        Parameters
        ----------
        t : array_like, optional
            Times in s from launch; equally spaced over one period, or over the whole motion, if not given.

        Returns
        -------
        xarray.Dataset
            One variable for each field of `State`, over the coordinate t.
        """
        from gqm_sym.export.datasets import dataset

        return dataset(self, t)

    def _repr_html_(self) -> str:
        return page(self)

    def __str__(self) -> str:
        """A few lines for people: the kind, the launch, times and parameters."""
        rows = summary(self)
        width = max(len(label) for label, _ in rows)
        texts = ((label, repr(value) if isinstance(value, float) else value) for label, value in rows)
        lines = (f"  {label:<{width}}  {text}" for label, text in texts)
        return "\n".join([f"Motion of {self.problem.formulas.name}", *lines])

    def __repr__(self) -> str:
        launch = self.problem.launch
        return f"<{self.kind} of {self.problem.formulas.name}: lam0 = {launch.lam0.text}, v0 = {launch.v0.text}>"

    def __reduce__(self) -> tuple[Any, ...]:
        """By its model, launch and parameters: the copy is solved again, and answers with the same digits."""
        problem = self.problem
        return _solved_again, (problem.formulas, problem.launch, tuple(problem.p))

    def _shown_time(self) -> float:
        """The time in s up to which a motion without an end is shown in pictures and tables."""
        return max((leg.t_end for leg in self.legs if isfinite(leg.t_end)), default=1.0)

    # -- inside -------------------------------------------------------------------------------

    def _history(self) -> tuple[TimedSegment, ...]:
        """The timed segments that `legs` and `events` list."""
        return self._course.segments

    def _contact_changes(self, timed: TimedSegment) -> list[tuple[Pair, float]]:
        """The times at which N changes sign on a timed segment, each with its phase angle."""
        return crossings(timed, contact_changes(self.problem.formulas, timed), self._course.time_scale_error)

    def _asymptote(self, timed: TimedSegment) -> Event:
        """The approach to an equilibrium, which the body reaches after infinite time."""
        f, lam = self.problem.functions, timed.segment.b
        x, z = path_and_force_at(f.addresses, f.p, np.array([lam]), np.zeros(1))[:2, 0]
        return Event("asymptote", inf, lam + timed.laps * self._course.lap, float(x), float(z))

    def _event(self, kind: str, when: Pair, timed: TimedSegment, phi: float) -> Event:
        f = self.problem.functions
        lam = self._places_at(timed, [(when, phi)])
        x, z = path_and_force_at(f.addresses, f.p, lam, np.zeros(1))[:2, 0]
        return Event(kind, when[0], float(lam[0]) + timed.laps * self._course.lap, float(x), float(z))

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

    def _known_end(self) -> float:
        """The time in s at which the motion ends by what has been computed of it; infinite if that is not known."""
        return self._horizon

    def _end_text(self) -> str:
        return "the horizon t_max"

    def _extent_text(self) -> str:
        return "it moves " + ", ".join(f"from {leg.lam_start!r} to {leg.lam_end!r}" for leg in self.legs)

    def _phase_points(self, t: Array, t_low: Array) -> PhasePoints:
        return locate(self._trajectory(float(np.abs(t).max()) if t.size else 0.0), t, t_low)

    def _places(self, points: PhasePoints) -> Array:
        """The curve parameter within the lap; at launch it is exactly the launch place."""
        return points.places(self.problem.lam0)

    def _velocities(self, points: PhasePoints) -> Array:
        return points.velocities(self.direction * self.problem.launch.v0.value)

    def _first_passages(self, lam: float, low: float) -> list[float]:
        """Times at which the body passes a place, the first time on each segment."""
        trajectory = self._course
        return passages(trajectory.segments, trajectory, lam, low)


def _solved_again(model: Any, launch: Launch, parameters: tuple[Number, ...]) -> "Motion":
    """The motion that a launch of a compiled model begins, as it began before."""
    lam0, v0, direction, contact, t_max, point = launch
    place = (lam0, None) if point is None else (None, point)
    request = LaunchRequest(place[0], v0, direction, place[1], t_max, contact)
    motion: Motion = model.solve(request, parameters)
    return motion


def _shaped(array: Array, shape: tuple[int, ...]) -> Any:
    return float(array[0]) if shape == () else array.reshape(shape)


def merged(legs: list[Leg], internal_ends: tuple[str, ...]) -> list[Leg]:
    """The legs, joined where the end of one matters to the computation only."""
    out: list[Leg] = []
    for leg in legs:
        if out and out[-1].end in internal_ends:
            last = out.pop()
            leg = Leg(last.lam_start, leg.lam_end, last.t_start, leg.t_end, leg.direction, leg.end)
        out.append(leg)
    return out


def horizon(motion: "Motion") -> float:
    """The time in s from launch up to which a motion is shown: one period, its end, or what has been computed of it."""
    if motion.kind in ("libration", "circulation"):
        return motion.period
    if isfinite(motion.t_end):
        return motion.t_end
    return motion._shown_time()
