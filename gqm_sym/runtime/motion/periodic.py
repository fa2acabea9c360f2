"""Motions that repeat: libration between two turning points, and circulation round a closed curve."""

from math import inf
from typing import Any

import numpy as np

from gqm_sym.errors import SolutionError
from gqm_sym.literals.numbers import read_number
from gqm_sym.runtime.arithmetic.doubledouble import ULP, ZERO
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.motion import timing
from gqm_sym.runtime.motion.events import Event
from gqm_sym.runtime.motion.motion import Motion, State
from gqm_sym.runtime.motion.rows import Rows
from gqm_sym.runtime.motion.sampler import Sampler, plain_time, plain_times
from gqm_sym.runtime.motion.segment import Segment
from gqm_sym.runtime.motion.trajectory import TimedSegment, Trajectory, libration
from gqm_sym.runtime.multiprecision.exact_problem import NOWHERE
from gqm_sym.runtime.quadrature.time_panels import slopes

# A turning point may be told this share of it beside the end of the stretch.
BESIDE = 1e-14

# What the rounding of a chart may do to a period, of it: most at flat bottoms and on splines (14 roundings measured).
CHARTED = 16 * ULP

# Pieces of a chart that a stretch may have for its times to be taken in extended precision unasked.
MOST_PIECES = 250


class PeriodicMotion(Motion):
    """A libration or a circulation: one stretch, repeated for ever.

    Its course is first built from times in doubles. Beyond one period from launch the period is needed as two
    doubles; it is then evaluated once in extended precision. ``offsets`` are the distances of a libration's ends from
    the launch.
    """

    def __init__(
        self, problem: Problem, kind: str, direction: int, stretch: Segment, offsets: tuple[float, float] = (0.0, 0.0)
    ) -> None:
        super().__init__(problem, kind, direction)
        self._stretch, self._offsets = stretch, offsets
        self._plain: Trajectory | None = None
        self._precise: Trajectory | None = None
        self._exact: timing.Timing | None = None
        self._sampler: Sampler | None = None

    @property
    def turning_points(self) -> tuple[float, ...]:
        """Both turning points of a libration, each the double nearest to the exact one."""
        if self.kind != "libration":
            return ()
        low, high = self._stretch.a, self._stretch.b
        if self._is_exact:
            low, high = timing.turning_points(self.problem, self._stretch)
        met = (high, low) if self.direction > 0 else (low, high)
        return (self.problem.lam0, met[0]) if self.problem.w0 == 0.0 else met

    @property
    def _is_exact(self) -> bool:
        """Whether more digits can be had than doubles hold, in some seconds at most."""
        f, s = self.problem.functions, self._stretch
        return f.exact is not None and f.between(f.exact.edges, s.a, s.b).size <= MOST_PIECES

    @property
    def _timing(self) -> timing.Timing:
        if not self._is_exact:
            return timing.plain(self.kind, self._stretch, self._offsets)
        if self._exact is None:
            self._exact = timing.exact(self.problem, self.kind, self.direction, self._stretch)
        return self._exact

    @property
    def one_period(self) -> tuple[TimedSegment, ...]:
        """The pieces of one period from launch."""
        return self._course(0.0).pieces

    @property
    def half_period(self) -> float:
        """Time from one turning point to the other, the double nearest to the exact one (libration only)."""
        if self.kind != "libration":
            return super().half_period
        return self._timing.duration[0]

    @property
    def period(self) -> float:
        """Time after which the motion repeats, the double nearest to the exact one."""
        duration = self._timing.duration[0]
        return 2.0 * duration if self.kind == "libration" else duration

    def period_to(self, digits: int) -> str:
        """The period as a decimal string with that many correct digits (up to 1000)."""
        if self.problem.functions.exact is None:
            raise SolutionError(
                "period_to: this curve is a chart in doubles, whose period has no more digits than `period`; "
                "declare the curve by formulas for more"
            )
        return timing.period_to(self.problem, self.kind, self.direction, self._stretch, digits)

    def lam(self, t: Any) -> Any:
        """The curve's parameter at times, as `Motion.lam`; doubles take one compiled loop."""
        time = plain_time(t)
        if time is not None:
            sampler = self._sampler_for(time, time)
            return super().lam(t) if sampler is None else sampler.place(time)
        times = plain_times(t)
        sampler = None if times is None else self._sampler_for(times[1], times[2])
        if times is None or sampler is None:
            return super().lam(t)
        return sampler.places(times[0]).reshape(t.shape)

    def state(self, t: Any) -> State:
        """Everything about the body at times, as `Motion.state`; doubles take one compiled loop."""
        time = plain_time(t)
        times = plain_times(t) if time is None else (NOWHERE, time, time)
        sampler = None if times is None else self._sampler_for(times[1], times[2])
        if times is None or sampler is None:
            return super().state(t)
        if self._stretch.from_exact:  # its speeds are known to its panels alone
            return super().state(t)._replace(lam=self.lam(t))
        if time is not None:
            return State(*sampler.state(time))
        return State(t, *sampler.states(times[0]).reshape(-1, *t.shape))

    def _sampler_for(self, least: float, greatest: float) -> Sampler | None:
        """What samples times from ``least`` to ``greatest``; None for times that cannot be, or not as doubles."""
        reach = max(-least, greatest)
        if not (reach < inf and greatest <= self.t_end):
            return None
        sampler = self._sampler
        if sampler is not None and sampler.course is self._precise and reach <= sampler.reach:
            return sampler
        course = self._course(reach)
        if sampler is None or sampler.course is not course:
            clock = self._timing if course is self._precise else timing.plain(self.kind, self._stretch, self._offsets)
            sampler = self._sampler = Sampler(
                self.problem, course, clock.phase, self.direction, lambda: self._clock_drift(course)
            )
        return sampler if reach <= sampler.reach else None

    def _course(self, reach: float) -> Trajectory:
        whole = self._stretch.duration * (2.0 if self.kind == "libration" else 1.0)
        if (
            self._is_exact
            and self._precise is None
            and (reach > whole or self._exact is not None or self._stretch.from_exact)
        ):
            self._precise = self._build(self._timing)
        if self._precise is not None:
            return self._precise
        if self._plain is None:
            self._plain = self._build(timing.plain(self.kind, self._stretch, self._offsets))
        return self._plain

    def _build(self, clock: timing.Timing) -> Trajectory:
        tau = clock.duration
        stretch = self._stretch if clock.marks is None else self._stretch.timed(clock.marks)
        own = stretch.whole
        pace = ((own[0] - tau[0]) + (own[1] - tau[1])) / tau[0]
        if self.kind == "libration":
            phi = stretch.anomaly_of(*clock.offsets)
            pieces = libration(stretch, direction=self.direction, tau=tau, phase=clock.phase, phi=phi)
            return Trajectory(pieces=pieces, period=(2.0 * tau[0], 2.0 * tau[1]), pace=pace)
        piece = TimedSegment(
            stretch=stretch,
            sense=1,
            r_start=ZERO,
            r_stop=tau,
            phi_start=0.0,
            phi_stop=stretch.stop,
            t_start=ZERO,
            s_a=0.0,
            end="horizon",
        )
        lap, length = self.direction * self.problem.period, self.direction * stretch.length
        return Trajectory(pieces=(piece,), period=tau, lap=lap, lap_length=length, pace=pace)

    def _clock_error(self, t: Array) -> Array:
        late, drift = self._clock_drift(self._course(float(np.abs(t).max()) if t.size else 0.0))
        return late + np.abs(t) * drift

    def _clock_drift(self, course: Trajectory) -> tuple[float, float]:
        """Estimated error of a course's clock at launch, and by how much it grows with time."""
        if course is self._precise:
            return 0.0, 2.0**-104
        # What the stretch's own clock says of the launch and of the period, and the rounded anomaly of the launch.
        stretch, start = self._stretch, np.array([course.pieces[0].phi_start])
        launch = stretch.clock_error(start) + ULP * start * slopes(stretch.edges, stretch.panels[3], start)
        rounding = ULP if self.problem.formulas.chart is None else CHARTED
        return float(launch[0]), stretch.relative_error + rounding

    def events_between(self, t1: Any, t2: Any) -> tuple[Event, ...]:
        """Events at times from t1 to t2, over as many periods as that takes."""
        start, stop = read_number(t1, where="t1").value, read_number(t2, where="t2").value
        period = self.period
        lap = self._course(0.0).lap
        out = []
        for k in range(int(np.floor(start / period)), int(np.floor(stop / period)) + 1):
            for event in self._one_period():
                t = event.t + k * period
                if start <= t <= min(stop, self.t_end):
                    out.append(Event(event.kind, t, event.lam + k * lap, event.x, event.z))
        return Rows(out)

    def _one_period(self) -> tuple[Event, ...]:
        return tuple(event for event in self.events if event.kind != "horizon")

    def _at_end(self, lam: float, low: float) -> float:
        """The end of the stretch where a place is a turning point as `turning_points` rounds it, else the place."""
        for end in (self._stretch.a, self._stretch.b):
            beside = 0.0 < abs(lam - end) <= BESIDE * abs(end)
            if beside and low == 0.0 and lam in self.turning_points:
                return end
        return lam

    def _first_passages(self, lam: float, low: float) -> list[float]:
        lap = self._course(0.0).lap
        if not lap:
            return super()._first_passages(self._at_end(lam, low), low)
        count = np.floor((lam - self.problem.lam0) / lap)
        if count < 0:
            return []
        within = super()._first_passages(lam - count * lap, low)
        return [t + count * self.period for t in within] if count else within
