"""Motions that repeat: libration between two turning points, and circulation round a closed curve."""

from dataclasses import dataclass
from functools import cached_property, partial
from math import inf
from typing import Any

import numpy as np

from gqm_sym.errors import InputError, SolutionError
from gqm_sym.literals.namespaces import FLOATS
from gqm_sym.literals.numbers import read_number
from gqm_sym.runtime.arithmetic.doubledouble import ULP
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.double_double.orbit_time import Orbit
from gqm_sym.runtime.gradients.charts.orbit import ChartOrbitDerivatives
from gqm_sym.runtime.gradients.formula_orbit import FormulaOrbitDerivatives
from gqm_sym.runtime.gradients.multiprecision import UNDECIDED
from gqm_sym.runtime.gradients.orbit import OrbitDerivatives, asked_for, without_formulas
from gqm_sym.runtime.gradients.quantities import gradient, second_gradient, selected
from gqm_sym.runtime.gradients.sensitivity import OrbitSensitivity, Sensitivity
from gqm_sym.runtime.gradients.spectrum import Fourier, fourier
from gqm_sym.runtime.launch.kinds import MotionKind
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.launch.speed import path_and_force_at
from gqm_sym.runtime.motion import timing
from gqm_sym.runtime.motion.events import Event
from gqm_sym.runtime.motion.locking import locked
from gqm_sym.runtime.motion.motion import Motion
from gqm_sym.runtime.motion.rows import Rows
from gqm_sym.runtime.motion.sampler import Sampler, plain_time, plain_times
from gqm_sym.runtime.motion.segment import Segment
from gqm_sym.runtime.motion.state import State
from gqm_sym.runtime.motion.trajectory import Repeated, TimedSegment, Trajectory, circulation, libration
from gqm_sym.runtime.multiprecision.exact_problem import NOWHERE
from gqm_sym.runtime.quadrature.time_panels import slopes

# The largest difference between a turning point and the rounded end of the segment, as a share of its value.
MAX_TURN_ROUNDING = 1e-14

# The largest relative change of a period by the rounding of a chart. It is largest at flat minima of the potential and
# on splines (14 roundings were measured).
CHART_ROUNDING = 16 * ULP

# The least distance between two edges of a chart, as a share of the phase; at a smaller one they are the same edge.
MIN_PANEL = 1e-13

# The latest time that doubles answer where double-double arithmetic does not suffice, in periods from launch.
EARLY = 0.999

# The most events that `events_between` lists.
MAX_EVENTS = 1_000_000

# The most pieces of a chart on a segment whose times are computed in extended precision without being asked for.
MAX_CHART_PIECES = 250


@dataclass(slots=True)
class _Times:
    """The times of a motion to some accuracy, with the trajectory that has them.

    Attributes
    ----------
    timing : Timing
        The times.
    repeated : Repeated
        What repeats itself.
    span : (float, float)
        The distances in s from launch, later or earlier, that they answer: above the first, up to the second.
    sampler : Sampler, optional
        What reads them at many times, once that was asked for.
    trajectory : Trajectory, optional
        One period, once that was asked for.
    """

    timing: timing.Timing
    repeated: Repeated
    span: tuple[float, float]
    sampler: Sampler | None = None
    trajectory: Trajectory | None = None


class PeriodicMotion(Motion):
    """A libration or a circulation: one segment that is repeated for ever.

    Its times come from double-double arithmetic. Where that does not suffice, doubles answer within the first period,
    and extended precision beyond it and for what is listed of a period. Which of them answers depends on the latest
    time that is asked for, and on no question before.

    Parameters
    ----------
    problem : Problem
        The launch and the module that it is of.
    kind : {"libration", "circulation"}
        The kind of motion.
    direction : int
        The sign of ds/dt after launch.
    segment : Segment
        The segment from one turning point to the other, or a lap from the launch.
    offsets : (float, float)
        The distances of a libration's lower and upper end from the launch, in units of the curve parameter.
    """

    def __init__(
        self,
        problem: Problem,
        kind: MotionKind,
        direction: int,
        segment: Segment,
        offsets: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        super().__init__(problem, kind, direction)
        self._segment_in_doubles, self._offsets = segment, offsets
        self._sampler: Sampler | None = None

    @cached_property
    def _segment(self) -> Segment:
        """Its segment, which ends at the doubles nearest to the true turning points.

        Where terms of the force cancel, as in small swings about an equilibrium of large forces, the turning points in
        doubles are off by more than their rounding.
        """
        segment = self._segment_in_doubles
        if self.kind != "libration" or segment.ends != (None, None):
            return segment
        ends = timing.true_turning_points(self.problem, segment, self._offsets)
        if ends is None:
            return segment
        (a, a_low), (b, b_low), lam0, (behind, ahead) = *ends, self.problem.launch.lam0, self._offsets
        # A launch from rest is a turning point itself.
        a, behind = (segment.a, 0.0) if behind == 0.0 else (a, (lam0.value - a) + (lam0.low - a_low))
        b, ahead = (segment.b, 0.0) if ahead == 0.0 else (b, (b - lam0.value) + (b_low - lam0.low))
        a, b = max(a, self.problem.low), min(b, self.problem.high)
        if not a < b:  # the same double: extended precision tells them apart from where doubles have them
            return segment
        self._offsets = behind, ahead
        if a == segment.a and b == segment.b:
            return segment
        known = segment.known_duration is not None
        orbit = timing.orbit_of(self.problem, self.kind, self.direction, self._offsets) if known else None
        return segment.with_turning_points(a, b, None if orbit is None else orbit.duration.high)

    @property
    @locked
    def turning_points(self) -> tuple[float, ...]:
        """The turning points of a libration in the order of time, each the double nearest to the exact one."""
        if self.kind != "libration":
            return ()
        low, high = self._segment.a, self._segment.b
        orbit = self._orbit
        if orbit is not None and orbit.low.is_decided and orbit.high.is_decided:
            low, high = orbit.low.high, orbit.high.high
        elif self._has_multiprecision:
            # At an end of the curve a root is a rounding of extended precision beyond it.
            found = timing.turning_points(self.problem, self._segment)
            low, high = max(found[0], self.problem.low), min(found[1], self.problem.high)
        in_order = (high, low) if self.direction > 0 else (low, high)
        return (self.problem.lam0, in_order[0]) if self.problem.w0 == 0.0 else in_order

    @property
    def _has_multiprecision(self) -> bool:
        """Whether mpmath can compute the period within some seconds."""
        f, s = self.problem.functions, self._segment
        return f.exact is not None and f.between(f.exact.edges, s.a, s.b).size <= MAX_CHART_PIECES

    @cached_property
    def _is_exact(self) -> bool:
        """Whether the period can be computed to more digits than doubles hold."""
        return self._has_multiprecision or self._orbit is not None

    @cached_property
    def _orbit(self) -> Orbit | None:
        """Duration and turning points in double-double arithmetic; None where that does not suffice."""
        launch = self.problem, self.kind, self.direction, self._offsets
        is_charted = self.problem.formulas.chart is not None
        # No panels are needed where the trapezoidal rule has converged in doubles.
        if is_charted or self._segment_in_doubles.known_duration is not None:
            orbit = timing.orbit_of(*launch)
            if is_charted or orbit is not None:
                return orbit
        return timing.orbit_of(*launch, timing.times_along(self._segment, is_thrown=False))

    @cached_property
    def _in_doubles(self) -> _Times:
        times = timing.in_doubles(self.kind, self._segment, self._offsets)
        return _Times(times, self._repeated(times), (-inf, self._latest_in_doubles if self._is_exact else inf))

    @cached_property
    def _in_double_double(self) -> _Times | None:
        launch = self.problem, self.kind, self.direction
        times = timing.in_double_double(*launch, self._segment, self._offsets) if self._is_exact else None
        return None if times is None else _Times(times, self._repeated(times), (-inf, times.max_time))

    @cached_property
    def _in_multiprecision(self) -> _Times:
        launch, known = (self.problem, self.kind, self.direction), self._in_double_double
        times = timing.in_multiprecision(*launch, self._segment)
        return _Times(times, self._repeated(times), (self._latest_in_doubles if known is None else known.span[1], inf))

    @property
    def _latest_in_doubles(self) -> float:
        """The largest distance in s of a time from launch for which extended precision would be too dear."""
        if self._segment.from_multiprecision:
            return -inf
        return EARLY * self._segment.duration * (2.0 if self.kind == "libration" else 1.0)

    def _times_until(self, end_time: float) -> _Times:
        """The times with as many digits as a phase needs at ``end_time`` in s from launch."""
        known = self._in_double_double
        if known is not None and (end_time <= known.span[1] or not self._has_multiprecision):
            return known
        return self._in_doubles if end_time <= self._in_doubles.span[1] else self._in_multiprecision

    @property
    def _duration(self) -> float:
        """Half period or loop time in s, the double nearest to the exact one."""
        orbit = self._orbit
        if orbit is not None and orbit.duration.is_decided:
            return orbit.duration.high
        return self._times_until(inf).timing.duration[0]

    @property
    @locked
    def one_period(self) -> tuple[TimedSegment, ...]:
        """The timed segments of one period from launch."""
        return self._trajectory(0.0).segments

    @property
    @locked
    def half_period(self) -> float:
        """Time in s from one turning point to the other, the double nearest to the exact one (libration only)."""
        if self.kind != "libration":
            return super().half_period
        return self._duration

    @property
    @locked
    def period(self) -> float:
        """Time in s after which the motion repeats, the double nearest to the exact one."""
        return 2.0 * self._duration if self.kind == "libration" else self._duration

    @locked
    def period_to(self, digits: int) -> str:
        """The period in s as a decimal string with that many correct digits (up to 1000); see `Motion.period_to`."""
        if self.problem.functions.exact is None:
            raise SolutionError(
                "period_to: this curve is a chart in doubles, whose period has no more digits than `period`; "
                "declare the curve by formulas for more"
            )
        return timing.period_to(self.problem, self.kind, self.direction, self._segment, digits)

    @cached_property
    def _derivatives(self) -> OrbitDerivatives:
        """The orbit with its derivatives."""
        direction = self.direction if self.kind == "circulation" else 0
        if self.problem.formulas.chart is not None:
            return self._derivatives_along_chart(direction)
        return FormulaOrbitDerivatives(self.problem, self._orbit, direction, self._offsets, self._segment.edges)

    def _derivatives_along_chart(self, direction: int) -> ChartOrbitDerivatives:
        segment, f = self._segment, self.problem.functions
        if self.problem.true_pieces is None or self.problem.tape is None:
            raise without_formulas()
        passage = timing.passage_of(self.problem, self.kind, self.direction, self._offsets)
        if passage is None:
            raise SolutionError(UNDECIDED)
        # Where pieces of the chart meet; the seam of a closed one is its first edge and its last.
        ends = segment.a, segment.b
        places = f.between(self.problem.formulas.charted(self.problem.p).edges, *ends)
        last, edges = 1.0, np.sort((places - ends[0]) / (ends[1] - ends[0]))
        if not direction:
            last, edges = np.pi, 2.0 * np.arctan2(np.sqrt(places - ends[0]), np.sqrt(ends[1] - places))
        edges = edges[np.diff(edges, prepend=0.0) > MIN_PANEL * last]
        return ChartOrbitDerivatives(self.problem, passage, direction, np.concatenate([[0.0], edges, [last]]))

    @cached_property
    def _orbit_sensitivity(self) -> OrbitSensitivity:
        return OrbitSensitivity(self._derivatives)

    @locked
    def _gradient(self, quantity: str, wrt: Any) -> dict[str, Any]:
        return gradient(self._derivatives, self, quantity, wrt)

    @locked
    def _second_gradient(self, quantity: str, wrt: Any) -> dict[str, dict[str, float]]:
        return second_gradient(self._derivatives, self, quantity, wrt)

    @property
    @locked
    def action(self) -> float:
        """The integral of (1 + beta) V ds over one period, per mass, in m2/s."""
        with asked_for("action"):
            return self._derivatives.action

    @property
    @locked
    def period_slope(self) -> float:
        """dT/dE, the derivative of the period by the energy per mass, in s3/m2."""
        formulas = self.problem.formulas
        inertia = 1.0 if formulas.inertia is None else formulas.inertia(FLOATS, self.problem.p.values.tolist())
        with asked_for("period_slope"):
            return float(self._derivatives.period_gradient[-1] / inertia)

    @locked
    def _sensitivity(self, t: Any, wrt: Any) -> Sensitivity:
        rows = selected(self.problem.formulas.parameters, wrt)
        times, low, shape = self._times(t)
        points = self._phase_points(times, low)
        found = self._orbit_sensitivity.at(self, points, self._places(points), self._velocities(points))
        chosen = [array[list(rows.values())].reshape(len(rows), *shape) for array in found]
        return Sensitivity(tuple(rows), *chosen)

    @locked
    def place_changes(self, t: Any, wrt: Any) -> Array:
        """The derivatives of the curve parameter at given times; see `Motion.place_changes`."""
        if self.problem.formulas.chart is not None:
            return super().place_changes(t, wrt)
        rows = selected(self.problem.formulas.parameters, wrt)
        times, low, shape = self._times(t)
        points, f = self._phase_points(times, low), self.problem.functions
        v = self._velocities(points)
        ds = path_and_force_at(f.addresses, f.p, self._places(points), v**2)[2]
        found = self._orbit_sensitivity.places_at(self, points, v, ds)
        return found[list(rows.values())].reshape(len(rows), *shape)

    @locked
    def fourier(self, quantity: str, n: int) -> Fourier:
        """The Fourier coefficients of a quantity over one period; see `Motion.fourier`."""
        return fourier(self, quantity, n)

    def lam(self, t: Any) -> Any:
        """The curve parameter at times; see `Motion.lam`. For doubles this is one call of compiled code."""
        time = plain_time(t)
        if time is not None:
            sampler = self._sampler_for(time, time)
            return super().lam(t) if sampler is None else sampler.place(time)
        times = plain_times(t)
        sampler = None if times is None else self._sampler_for(times[1], times[2])
        if times is None or sampler is None:
            return super().lam(t)
        return sampler.places(times[0].reshape(-1)).reshape(times[0].shape)

    def state(self, t: Any) -> State:
        """The state of the body at times; see `Motion.state`. For doubles this is one call of compiled code."""
        time = plain_time(t)
        times = plain_times(t) if time is None else (NOWHERE, time, time)
        sampler = None if times is None else self._sampler_for(times[1], times[2])
        if times is None or sampler is None:
            return super().state(t)
        # The speeds of some segments can be computed from their panels only, and what is in space by places in a lap.
        in_space = self.problem.formulas.path_in_space is not None
        if self._segment.from_multiprecision or (in_space and self.kind == "circulation"):
            return super().state(t)._replace(lam=self.lam(t))
        if time is not None and not in_space:
            return State(*sampler.state(time))
        if time is not None:
            return self._state_of(time, np.array(sampler.state(time)[1:]).reshape(-1, 1))
        return self._state_of(times[0], sampler.states(times[0].reshape(-1)))

    def _sampler_for(self, least: float, greatest: float) -> Sampler | None:
        """The sampler for times from ``least`` to ``greatest``; None if they are impossible or too late for doubles."""
        end_time = max(-least, greatest)
        if not (end_time < inf and greatest <= self.t_end):
            return None
        sampler = self._sampler
        if sampler is not None and sampler.min_time < end_time <= sampler.max_time:
            return sampler
        return self._new_sampler_for(end_time)

    @locked
    def _new_sampler_for(self, end_time: float) -> Sampler | None:
        """The sampler for times up to ``end_time``, made if there is none yet."""
        times = self._times_until(end_time)
        if times.sampler is None:
            of_states = partial(self._constants_of_states, times)
            times.sampler = Sampler(
                self.problem, times.repeated, times.timing, times.span, self.direction, of_states, self._lock
            )
        self._sampler = times.sampler
        return self._sampler if end_time <= self._sampler.max_time else None

    def _constants_of_states(self, times: _Times) -> tuple[float, ...]:
        trajectory = self._trajectory_of(times)
        return trajectory.lap_length, self.problem.arc_origin, trajectory.segments[0].s_a, *self._time_drift(times)

    def _trajectory(self, end_time: float) -> Trajectory:
        return self._trajectory_of(self._times_until(end_time))

    @property
    def _course(self) -> Trajectory:
        return self._trajectory(self._segment.duration * (2.0 if self.kind == "libration" else 1.0))

    def _repeated(self, times: timing.Timing) -> Repeated:
        """What repeats itself, with these times."""
        duration = times.duration
        segment = self._segment if times.edge_times is None else self._segment.with_edge_times(times.edge_times)
        total = segment.total_time
        time_scale_error = ((total[0] - duration[0]) + (total[1] - duration[1])) / duration[0]
        if self.kind == "libration":
            return Repeated(segment, (2.0 * duration[0], 2.0 * duration[1]), 0.0, time_scale_error)
        return Repeated(segment, duration, self.direction * self.problem.period, time_scale_error)

    def _trajectory_of(self, times: _Times) -> Trajectory:
        """One period with these times, made when it is first asked for."""
        if times.trajectory is None:
            (segment, period, lap, time_scale_error), duration = times.repeated, times.timing.duration
            if self.kind == "libration":
                phi, phase_time = segment.phase_angle_of(*times.timing.offsets), times.timing.phase_time
                segments = libration(
                    segment, direction=self.direction, duration=duration, phase_time=phase_time, phi=phi
                )
                length = 0.0
            else:
                segments, length = (circulation(segment, duration),), self.direction * segment.length
            times.trajectory = Trajectory(
                segments=segments, period=period, lap=lap, lap_length=length, time_scale_error=time_scale_error
            )
        return times.trajectory

    def _time_error(self, t: Array) -> Array:
        at_launch, drift = self._time_drift(self._times_until(float(np.abs(t).max()) if t.size else 0.0))
        return at_launch + np.abs(t) * drift

    def _time_drift(self, times: _Times) -> tuple[float, float]:
        """Estimated error in s of a trajectory's times at launch, and its growth per second."""
        if times is not self.__dict__.get("_in_doubles"):  # those are not computed for the question
            return 0.0, times.timing.relative_error
        # The quadrature errors of the time to the launch and of the period; the rounding of the launch's phase angle.
        segment, start = self._segment, np.array([self._trajectory_of(times).segments[0].phi_start])
        launch = segment.time_error(start) + ULP * start * slopes(segment.edges, segment.panels[3], start)
        rounding = ULP if self.problem.formulas.chart is None else CHART_ROUNDING
        return float(launch[0]), segment.relative_error + rounding

    @locked
    def events_between(self, t1: Any, t2: Any) -> tuple[Event, ...]:
        """The events from time t1 to t2 over as many periods as that takes; see `Motion.events_between`."""
        start, stop = read_number(t1, where="t1", unit="s").value, read_number(t2, where="t2", unit="s").value
        period = self.period
        lap, within = self._course.lap, self._one_period()
        if not within:
            return Rows([])
        first, last = int(np.floor(start / period)), int(np.floor(min(stop, self.t_end) / period))
        if (last - first) * len(within) > MAX_EVENTS:
            raise InputError(
                f"events_between: {len(within)} events in each of {last - first} periods are more than {MAX_EVENTS}; "
                "ask for a shorter interval"
            )
        out = []
        for k in range(first, last + 1):
            for event in within:
                if k and event.kind == "slip" and event.t == 0.0:
                    continue  # a body that slips at launch begins to slip then, and once only
                t = event.t + k * period
                if start <= t <= min(stop, self.t_end):
                    out.append(Event(event.kind, t, event.lam + k * lap, event.x, event.z))
        return Rows(out)

    def _one_period(self) -> tuple[Event, ...]:
        return tuple(event for event in self.events if event.kind != "horizon")

    def _at_end(self, lam: float, low: float) -> float:
        """The end of the segment if a place is a turning point as `turning_points` rounds it, else the place."""
        for end in (self._segment.a, self._segment.b):
            is_near = 0.0 < abs(lam - end) <= MAX_TURN_ROUNDING * abs(end)
            if is_near and low == 0.0 and lam in self.turning_points:
                return end
        return lam

    def _first_passages(self, lam: float, low: float) -> list[float]:
        lap = self._course.lap
        if not lap:
            return super()._first_passages(self._at_end(lam, low), low)
        count = np.floor((lam - self.problem.lam0) / lap)
        if count < 0:
            return []
        within = super()._first_passages(lam - count * lap, low)
        return [t + count * self.period for t in within] if count else within
