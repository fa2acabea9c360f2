"""The times of motions that repeat, computed in the arithmetic that each question requires."""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf

import numpy as np

from gqm_sym.errors import SolutionError
from gqm_sym.runtime.arithmetic.doubledouble import ULP
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.double_double.orbit_time import Orbit
from gqm_sym.runtime.launch.kinds import MotionKind
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.motion import timing
from gqm_sym.runtime.motion.locking import computed_once, locked
from gqm_sym.runtime.motion.motion import Motion
from gqm_sym.runtime.motion.sampler import Sampler
from gqm_sym.runtime.motion.segments import errors
from gqm_sym.runtime.motion.segments.kinds import with_turning_points
from gqm_sym.runtime.motion.segments.segment import Segment
from gqm_sym.runtime.motion.trajectory import Repeated, TimedSegment, Trajectory, circulation, libration
from gqm_sym.runtime.quadrature.time_panels import slopes

# The largest relative change of a period by the rounding of a chart. It is largest at flat minima of the potential and
# on splines (14 roundings were measured).
CHART_ROUNDING = 16 * ULP

# The latest time that is computed in doubles if double-double arithmetic does not suffice, in periods from launch.
MAX_PERIODS_IN_DOUBLES = 0.999

# The largest number of pieces of a chart on a segment for which times are computed in extended precision by default.
MAX_CHART_PIECES = 250


@dataclass(slots=True)
class Times:
    """The times of a motion to some accuracy, with the trajectory that has these times.

    Attributes
    ----------
    timing : Timing
        The times.
    repeated : Repeated
        The part of the motion that is repeated.
    span : (float, float)
        The range of distances in s from launch, later or earlier, for which they serve: above the first, up to the
        second.
    sampler : Sampler, optional
        The sampler that reads them at many times, once it has been asked for.
    trajectory : Trajectory, optional
        One period, once it has been asked for.
    """

    timing: timing.Timing
    repeated: Repeated
    span: tuple[float, float]
    sampler: Sampler | None = None
    trajectory: Trajectory | None = None


class PeriodicTimes(Motion):
    """A motion that repeats, with its segment, its turning points and its times, from which `PeriodicMotion` answers
    questions.

    Its times come from double-double arithmetic. If that does not suffice, doubles are used within the first period,
    and extended precision beyond it and for the legs and events of a period. The choice depends on the latest time in
    the call, and not on earlier calls. A segment that is given by a function, which makes it when it is needed, has a
    known duration.
    """

    def __init__(
        self,
        problem: Problem,
        kind: MotionKind,
        direction: int,
        segment: Segment | Callable[[], Segment],
        offsets: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        super().__init__(problem, kind, direction)
        self._given_segment, self._given_offsets, self._offsets = segment, offsets, offsets

    @computed_once
    def _segment_in_doubles(self) -> Segment:
        """Its segment between the turning points that doubles have found."""
        given = self._given_segment
        return given if isinstance(given, Segment) else given()

    @computed_once
    def _segment(self) -> Segment:
        """The segment, which ends at the doubles nearest to the true turning points.

        If terms of the force cancel, as in small swings about an equilibrium of large forces, the errors of turning
        points in doubles exceed their rounding.
        """
        segment = self._segment_in_doubles
        if self.kind != "libration" or segment.ends != (None, None):
            return segment
        ends = timing.true_turning_points(self.problem, segment, self._offsets, self._orbit_by_rule)
        if ends is None:
            return segment
        (a, a_low), (b, b_low), lam0, (behind, ahead) = *ends, self.problem.launch.lam0, self._offsets
        # A launch from rest is a turning point itself.
        a, behind = (segment.a, 0.0) if behind == 0.0 else (a, (lam0.value - a) + (lam0.low - a_low))
        b, ahead = (segment.b, 0.0) if ahead == 0.0 else (b, (b - lam0.value) + (b_low - lam0.low))
        a, b = max(a, self.problem.low), min(b, self.problem.high)
        if not a < b:  # both are the same double, and only extended precision distinguishes their places
            return segment
        self._offsets = behind, ahead
        if a == segment.a and b == segment.b:
            return segment
        known = segment.known_duration is not None
        orbit = timing.orbit_of(self.problem, self.kind, self.direction, self._offsets) if known else None
        self._orbit_by_rule = orbit if self._orbit_by_rule is not None else None
        return with_turning_points(segment, a, b, None if orbit is None else orbit.duration.high)

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
            # At an end of the curve a root may lie beyond it by a rounding of extended precision.
            found = timing.turning_points(self.problem, self._segment)
            low, high = max(found[0], self.problem.low), min(found[1], self.problem.high)
        in_order = (high, low) if self.direction > 0 else (low, high)
        return (self.problem.lam0, in_order[0]) if self.problem.w0 == 0.0 else in_order

    @property
    def _has_multiprecision(self) -> bool:
        """Whether mpmath can compute the period within some seconds."""
        f, s = self.problem.functions, self._segment
        return f.exact is not None and f.between(f.exact.edges, s.a, s.b).size <= MAX_CHART_PIECES

    @computed_once
    def _is_exact(self) -> bool:
        """Whether the period can be computed to more digits than doubles hold."""
        return self._has_multiprecision or self._orbit is not None

    @computed_once
    def _orbit_by_rule(self) -> Orbit | None:
        """The orbit of a launch from a turning point, or of a circulation, for which the trapezoidal rule has converged
        in doubles; None for others, and along charts.
        """
        given = self._given_segment
        has_duration = not isinstance(given, Segment) or given.known_duration is not None
        is_smooth = has_duration and self.problem.formulas.chart is None
        if not is_smooth or (self.kind == "libration" and self.problem.w0 > 0.0):
            return None
        return timing.orbit_of(self.problem, self.kind, self.direction, self._offsets)

    @computed_once
    def _orbit(self) -> Orbit | None:
        """Duration and turning points in double-double arithmetic; None if that does not suffice."""
        launch = self.problem, self.kind, self.direction, self._offsets
        orbit = self._orbit_by_rule or timing.orbit_of(*launch)
        if orbit is not None or self.problem.formulas.chart is not None:
            return orbit
        return timing.orbit_of(*launch, timing.times_along(self._segment, is_thrown=False))

    @computed_once
    def _in_doubles(self) -> Times:
        times = timing.in_doubles(self.kind, self._segment, self._offsets)
        return Times(times, self._repeated(times), (-inf, self._latest_in_doubles if self._is_exact else inf))

    @computed_once
    def _in_double_double(self) -> Times | None:
        if not self._is_exact:
            return None
        segment, launch = self._segment, (self.problem, self.kind, self.direction)
        times = timing.in_double_double(*launch, segment, self._offsets, self._orbit_by_rule)
        return None if times is None else Times(times, self._repeated(times), (-inf, times.max_time))

    @computed_once
    def _in_multiprecision(self) -> Times:
        launch, known = (self.problem, self.kind, self.direction), self._in_double_double
        times = timing.in_multiprecision(*launch, self._segment)
        return Times(times, self._repeated(times), (self._latest_in_doubles if known is None else known.span[1], inf))

    @property
    def _latest_in_doubles(self) -> float:
        """The largest distance in s of a time from launch for which extended precision would take too long."""
        if self._segment.from_multiprecision:
            return -inf
        return MAX_PERIODS_IN_DOUBLES * self._segment.duration * (2.0 if self.kind == "libration" else 1.0)

    def _times_until(self, end_time: float) -> Times:
        """Return the times with as many digits as a phase requires at ``end_time`` in s from launch."""
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
        """Return the period in s as a decimal string with that many correct digits (up to 1000); see
        `Motion.period_to`.
        """
        if self.problem.functions.exact is None:
            if self._orbit is not None:
                return timing.period_from(self._orbit.duration, self.kind, digits)
            raise SolutionError(
                "period_to: along this track no more digits are known than those of `period`; declare the curve by "
                "formulas for more"
            )
        return timing.period_to(self.problem, self.kind, self.direction, self._segment, digits)

    def _trajectory(self, end_time: float) -> Trajectory:
        return self._trajectory_of(self._times_until(end_time))

    @property
    def _listed_trajectory(self) -> Trajectory:
        return self._trajectory(self._segment.duration * (2.0 if self.kind == "libration" else 1.0))

    def _repeated(self, times: timing.Timing) -> Repeated:
        """Return the repeated part of a motion, with these times."""
        duration = times.duration
        segment = self._segment if times.edge_times is None else self._segment.with_edge_times(times.edge_times)
        total = segment.total_time
        time_scale_error = ((total[0] - duration[0]) + (total[1] - duration[1])) / duration[0]
        if self.kind == "libration":
            return Repeated(segment, (2.0 * duration[0], 2.0 * duration[1]), 0.0, time_scale_error)
        return Repeated(segment, duration, self.direction * self.problem.period, time_scale_error)

    def _trajectory_of(self, times: Times) -> Trajectory:
        """Return one period with these times, which is made on the first request."""
        if times.trajectory is None:
            (segment, period, lap, time_scale_error), duration = times.repeated, times.timing.duration
            if self.kind == "libration":
                segments = libration(
                    segment, self.direction, duration, times.timing.phase_time, *self._launch_on(times)
                )
            else:
                segments = (circulation(segment, duration),)
            times.trajectory = Trajectory(
                segments=segments,
                period=period,
                lap=lap,
                lap_length=self._lap_length(times),
                time_scale_error=time_scale_error,
            )
        return times.trajectory

    def _lap_length(self, times: Times) -> float:
        """Return the growth of the arc length in m in one lap; 0 for a libration."""
        return 0.0 if self.kind == "libration" else self.direction * times.repeated.segment.length

    def _launch_on(self, times: Times) -> tuple[float, float]:
        """Return the phase angle of the launch on the segment, and the arc length in m from there to its end ``a``."""
        if self.kind == "circulation":
            return 0.0, 0.0
        segment = times.repeated.segment
        phi = segment.phase_angle_of(*times.timing.offsets)
        return phi, -float(segment.lengths(np.array([phi]))[0])

    def _time_error(self, t: Array) -> Array:
        at_launch, drift = self._time_drift(self._times_until(float(np.abs(t).max()) if t.size else 0.0))
        return at_launch + np.abs(t) * drift

    def _time_drift(self, times: Times) -> tuple[float, float]:
        """Return the estimated error in s of a trajectory's times at launch, and its growth per second."""
        if times is not self.__dict__.get("_in_doubles"):  # these times are accurate at launch
            return 0.0, times.timing.relative_error
        # The errors are those of the quadratures of the time to the launch and of the period, and the rounding of the
        # launch's phase angle.
        segment, start = self._segment, np.array([self._trajectory_of(times).segments[0].phi_start])
        launch = errors.time_error(segment, start) + ULP * start * slopes(segment.edges, segment.panels[3], start)
        rounding = ULP if self.problem.formulas.chart is None else CHART_ROUNDING
        return float(launch[0]), segment.relative_error + rounding
