"""Motions that do not repeat: to an end of the curve, to an equilibrium, to infinity or a pole, and rest."""

from dataclasses import dataclass, replace
from math import inf, isfinite

import numpy as np

from gqm_sym.budgets import budget
from gqm_sym.errors import InputError, SolutionError
from gqm_sym.runtime.arithmetic.doubledouble import ULP, ZERO, plus
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch import zeros
from gqm_sym.runtime.launch.ends import first_zero_from, search_beyond_barriers
from gqm_sym.runtime.launch.kinds import MotionKind
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.launch.speed import path_and_force_at
from gqm_sym.runtime.launch.zeros import MAX_PARAMETER, MIN_STEP_SHARE
from gqm_sym.runtime.motion.events import Event, liftoff
from gqm_sym.runtime.motion.motion import Motion
from gqm_sym.runtime.motion.rows import Rows
from gqm_sym.runtime.motion.segment import Segment, through, toward_equilibrium
from gqm_sym.runtime.motion.trajectory import PhasePoints, TimedSegment, Trajectory
from gqm_sym.runtime.quadrature.time_panels import NEGLIGIBLE_SHARE


@dataclass(slots=True)
class OpenEnd:
    """How far a motion to infinity or to a pole has been computed; it is continued when more is asked for.

    Attributes
    ----------
    place : float
        The curve parameter up to which it has been computed.
    direction : int
        The sign of its further change.
    limit : float
        What it tends to: infinity, or a place where the curve or the potential is not finite.
    step : float
        The length of the next segment, in units of the parameter.
    """

    place: float
    direction: int
    limit: float
    step: float = 1.0

    @property
    def target(self) -> float:
        """The end of the next segment; it is at most half-way to a pole."""
        if isfinite(self.limit):
            return self.place + self.direction * min(self.step, 0.5 * abs(self.limit - self.place))
        return self.place + self.direction * self.step


class AperiodicMotion(Motion):
    """A motion that does not repeat: its segments follow each other, and each is passed once in each direction at most.

    If the track can push from one side only, the motion ends as soon as contact is lost.
    """

    def __init__(self, problem: Problem, kind: MotionKind, direction: int) -> None:
        super().__init__(problem, kind, direction)
        self._segments: list[TimedSegment] = []
        self.open_end: OpenEnd | None = None
        self._approached: tuple[float, float] | None = None

    @property
    def lifted_off(self) -> bool:
        """Whether contact has been lost."""
        return bool(self._segments) and self._segments[-1].end == "liftoff"

    def add(self, segment: Segment, sense: int, end: str) -> None:
        """Append a whole segment: from its end ``a`` if ``sense`` is +1, towards it if -1; ``end`` is what ends it."""
        total_time = segment.total_time
        start, stop = (ZERO, total_time) if sense > 0 else (total_time, ZERO)
        if not self._segments:
            start = plus(start, (self._launch_delay(segment), 0.0))
        t, s = (self._segments[-1].t_stop, self._arc_end()) if self._segments else (ZERO, 0.0)
        s_a = s if sense > 0 else s - segment.direction * segment.length
        phi_start, phi_stop = (0.0, segment.stop) if sense > 0 else (segment.stop, 0.0)
        self.append(
            TimedSegment(
                segment=segment,
                sense=sense,
                r_start=start,
                r_stop=stop,
                phi_start=phi_start,
                phi_stop=phi_stop,
                t_start=t,
                s_a=s_a,
                end=end,
            )
        )

    def _launch_delay(self, segment: Segment) -> float:
        """The time in s from the double nearest to the launch place to that place itself."""
        low, speed = self.problem.launch.lam0.low, self.problem.launch.v0.value
        if segment.from_multiprecision or low == 0.0 or speed == 0.0:
            return 0.0
        f = self.problem.functions
        ds = path_and_force_at(f.addresses, f.p, np.array([self.problem.lam0]), np.zeros(1))[2, 0]
        return segment.direction * low * float(ds) / speed

    def append(self, timed: TimedSegment) -> None:
        """Append a timed segment, as far as contact lasts."""
        if self.lifted_off:
            return
        side = {"bilateral": 0, "above": 1, "below": -1}[self.problem.launch.contact]
        lost = liftoff(timed, side, first=not self._segments) if side else None
        if lost is not None:
            timed = replace(timed, r_stop=lost[0], phi_stop=lost[1], end="liftoff")
            self.kind = "transit"
            self.open_end = self._approached = None
        self._segments.append(timed)
        if lost is not None:
            self.t_end = min(self.t_end, timed.t_stop[0])

    def approach(self, start: float, equilibrium: float) -> None:
        """Append the approach to an equilibrium from ``start``, which takes infinite time."""
        if self.lifted_off:
            return
        self._approached = (start, equilibrium)
        self.add(toward_equilibrium(self.problem.functions, start, equilibrium, 0.0), 1, "asymptote")

    def finish(self) -> "AperiodicMotion":
        """Compute the first segment at least, and find the end in time; returns the motion itself."""
        if self.open_end is not None and not self._segments:
            self._extend()
        if self.open_end is None and self._approached is None:
            self.t_end = min(self.t_end, self._segments[-1].t_stop[0])
        return self

    @property
    def turning_points(self) -> tuple[float, ...]:
        """The turning points so far in the order of time; a launch from rest counts as one."""
        turns = [float(p.segment.places(np.array([p.phi_stop]))[0]) for p in self._segments if p.end == "turn"]
        return (*((self.problem.lam0,) if self.problem.w0 == 0.0 else ()), *turns)

    def _arc_end(self) -> float:
        last = self._segments[-1]
        return last.s_a + (last.segment.direction * last.segment.length if last.sense > 0 else 0.0)

    def _trajectory(self, end_time: float) -> Trajectory:
        end_time = max(end_time, self.t_end if isfinite(self.t_end) else 0.0)
        while self._segments[-1].t_stop[0] < end_time:
            if self.open_end is not None:
                self._extend()
            elif self._approached is not None:
                last = self._segments[-1]
                longer = toward_equilibrium(self.problem.functions, *self._approached, end_time - last.t_start[0])
                if not longer.duration > last.segment.duration:
                    raise SolutionError(
                        f"t = {end_time!r}: by then the body is closer to the equilibrium at "
                        f"{self.problem.formulas.parameter} = {self._approached[1]!r} than doubles can tell"
                    )
                self._segments.pop()
                self.add(longer, 1, "asymptote")
            else:
                break
        if end_time > self.t_end:
            raise InputError(f"t: the motion ends at {self.t_end!r} s ({self._end_text()}), got {end_time!r}")
        return Trajectory(segments=tuple(self._segments))

    def _first_passages(self, lam: float, low: float) -> list[float]:
        while self._is_ahead(lam, low) and self._segments[-1].t_stop[0] < self.t_end:
            if self.open_end is not None:
                self._extend()
            else:
                self._trajectory(min(2.0 * self._segments[-1].t_stop[0], self.t_end))
        return super()._first_passages(lam, low)

    def _is_ahead(self, lam: float, low: float) -> bool:
        """Whether the motion will come to a place beyond what has been computed of it."""
        end, last = self.open_end, self._segments[-1].segment
        if end is not None:
            return (lam - end.place) * end.direction > 0.0 and (end.limit - lam) * end.direction > 0.0
        if self._approached is None or (last.b - lam) * last.direction <= 0.0:
            return False
        return bool(last.phase_angle_of(*last.offsets(lam, low)) > last.edges[-1])

    @budget("motion", 60.0, "give a shorter t_max, or ask for earlier times")
    def _extend(self) -> None:
        """Append one more segment of a motion to infinity or to a pole."""
        end, problem = self.open_end, self.problem
        assert end is not None
        f, lam0 = problem.functions, problem.lam0
        target = end.target
        if abs(target - end.place) <= MIN_STEP_SHARE * max(abs(end.place), abs(lam0)):
            self._end_here()
            return
        if abs(target) > MAX_PARAMETER * max(1.0, abs(lam0)):
            raise SolutionError(
                f"the motion leaves the range of doubles at {problem.formulas.parameter} = {end.place!r}; "
                "give a shorter t_max"
            )
        begin, length = abs(end.place - lam0), abs(target - lam0)
        found = first_zero_from(f.addresses, f.p, lam0, problem.w0, end.direction, begin, length, end.step)
        (what, near, _), _ = search_beyond_barriers(problem, end.direction, found, length, end.step)
        if what != zeros.LIMIT:
            raise SolutionError(
                f"the motion beyond {problem.formulas.parameter} = {lam0 + near!r} could not be followed; "
                "give a domain that ends there"
            )
        segment = through(f, end.place, target, lam0, problem.w0)
        if self._segments and (
            segment.duration <= NEGLIGIBLE_SHARE * self._segments[-1].t_stop[0]
            and segment.length <= NEGLIGIBLE_SHARE * abs(self._arc_end())
        ):
            self._end_here()  # the motion along a spiral has come to its centre
            return
        self.add(segment, 1, "")
        end.place, end.step = target, 2.0 * end.step

    def _end_here(self) -> None:
        """End the motion at a singular point: the rest of it takes no time, and has no length, within rounding."""
        self._segments[-1] = replace(self._segments[-1], end="singular-point")
        self.t_end = min(self.t_end, self._segments[-1].t_stop[0])
        self.open_end = None

    def _time_error(self, t: Array) -> Array:
        trajectory = self._trajectory(float(np.abs(t).max()) if t.size else 0.0)
        errors = [
            abs(timed.r_stop[0] - timed.r_start[0]) * (timed.segment.relative_error + ULP)
            for timed in trajectory.segments
        ]
        before: Array = np.cumsum([0.0, *errors])[trajectory.segment_indices(t)]
        return before

    def _end_text(self) -> str:
        end = self._segments[-1].end
        return f"{end} at {self.problem.formulas.parameter} = {self.legs[-1].lam_end!r}" if self.t_end < inf else end


class MotionAtRest(Motion):
    """A body that stays where it is."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem, "rest", problem.launch.direction)

    def _phase_points(self, t: Array, t_low: Array) -> PhasePoints:
        return PhasePoints((), np.ones(t.shape, dtype=bool), np.zeros_like(t), self._trajectory(0.0))

    def _trajectory(self, end_time: float) -> Trajectory:
        return Trajectory(segments=(), period=ZERO)

    def _time_error(self, t: Array) -> Array:
        return np.zeros_like(t)

    @property
    def events(self) -> tuple[Event, ...]:
        """The one event "rest", at the launch."""
        state = self.state(0.0)
        return Rows([Event("rest", 0.0, state.lam, state.x, state.z)])

    def _extent_text(self) -> str:
        return f"it rests at {self.problem.lam0!r}"
