"""Motions that do not repeat: they leave through an end, approach an equilibrium, go on for ever, or stay at rest."""

from dataclasses import dataclass, replace
from math import inf, isfinite

import numpy as np

from gqm_sym.budgets import budget, spend
from gqm_sym.errors import InputError, SolutionError
from gqm_sym.runtime.arithmetic.doubledouble import ULP, ZERO, plus
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch import zeros
from gqm_sym.runtime.launch.ends import first_zero_from
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.launch.speed import path_and_force_at
from gqm_sym.runtime.launch.zeros import FARTHEST, NARROW
from gqm_sym.runtime.motion.events import Event, liftoff
from gqm_sym.runtime.motion.motion import Motion
from gqm_sym.runtime.motion.rows import Rows
from gqm_sym.runtime.motion.segment import Segment, through, toward_equilibrium
from gqm_sym.runtime.motion.trajectory import PhasePoints, TimedSegment, Trajectory
from gqm_sym.runtime.quadrature.time_panels import NEGLIGIBLE_SHARE


@dataclass(slots=True)
class OpenEnd:
    """How far a motion has been computed that goes on for ever, or towards a pole: stretch by stretch when asked.

    Attributes
    ----------
    place : float
        Where it has been computed to.
    limit : float
        What it moves towards: infinity, or a place where the curve or the force is not finite.
    """

    place: float
    direction: int
    limit: float
    step: float = 1.0

    @property
    def target(self) -> float:
        """The end of the next stretch: twice as far as the last one, but never more than half-way to a pole."""
        if isfinite(self.limit):
            return self.place + self.direction * min(self.step, 0.5 * abs(self.limit - self.place))
        return self.place + self.direction * self.step


class AperiodicMotion(Motion):
    """A motion that runs through each of its stretches once (or out to a turning point and back).

    Where the track can push from one side only, it ends as soon as it would have to pull.
    """

    def __init__(self, problem: Problem, kind: str, direction: int) -> None:
        super().__init__(problem, kind, direction)
        self._pieces: list[TimedSegment] = []
        self.open_end: OpenEnd | None = None
        self._target: tuple[float, float] | None = None

    @property
    def lifted_off(self) -> bool:
        """Whether contact has been lost."""
        return bool(self._pieces) and self._pieces[-1].end == "liftoff"

    def add(self, stretch: Segment, sense: int, end: str) -> None:
        """Run through a whole stretch next."""
        whole = stretch.whole
        start, stop = (ZERO, whole) if sense > 0 else (whole, ZERO)
        if not self._pieces:
            start = plus(start, (self._off_launch(stretch), 0.0))
        t, s = (self._pieces[-1].t_stop, self._arc_end()) if self._pieces else (ZERO, 0.0)
        s_a = s if sense > 0 else s - stretch.direction * stretch.length
        phi_start, phi_stop = (0.0, stretch.stop) if sense > 0 else (stretch.stop, 0.0)
        self.append(
            TimedSegment(
                stretch=stretch,
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

    def _off_launch(self, stretch: Segment) -> float:
        """How long the body takes from the double nearest to the launch place to that place itself."""
        low, speed = self.problem.launch.lam0.low, self.problem.launch.v0.value
        if stretch.from_exact or low == 0.0 or speed == 0.0:
            return 0.0
        f = self.problem.functions
        ds = path_and_force_at(f.addresses, f.p, np.array([self.problem.lam0]), np.zeros(1))[2, 0]
        return stretch.direction * low * float(ds) / speed

    def append(self, piece: TimedSegment) -> None:
        """Run through a piece next, as far as contact lasts."""
        if self.lifted_off:
            return
        side = {"bilateral": 0, "above": 1, "below": -1}[self.problem.launch.contact]
        lost = liftoff(piece, side, first=not self._pieces) if side else None
        if lost is not None:
            piece = replace(piece, r_stop=lost[0], phi_stop=lost[1], end="liftoff")
            self.kind = "transit"
            self.open_end = self._target = None
        self._pieces.append(piece)
        if lost is not None:
            self.t_end = min(self.t_end, piece.t_stop[0])

    def approach(self, start: float, top: float) -> None:
        """Come ever closer to an equilibrium, from ``start``."""
        if self.lifted_off:
            return
        self._target = (start, top)
        self.add(toward_equilibrium(self.problem.functions, start, top, 0.0), 1, "asymptote")

    def finish(self) -> "AperiodicMotion":
        """Close the list of pieces: what they are is known now."""
        if self.open_end is not None and not self._pieces:
            self._go_on()
        if self.open_end is None and self._target is None:
            self.t_end = min(self.t_end, self._pieces[-1].t_stop[0])
        return self

    @property
    def turning_points(self) -> tuple[float, ...]:
        """Turning points so far, in the order met; a launch from rest counts."""
        turns = [float(p.stretch.places(np.array([p.phi_stop]))[0]) for p in self._pieces if p.end == "turn"]
        return (*((self.problem.lam0,) if self.problem.w0 == 0.0 else ()), *turns)

    def _arc_end(self) -> float:
        last = self._pieces[-1]
        return last.s_a + (last.stretch.direction * last.stretch.length if last.sense > 0 else 0.0)

    def _course(self, reach: float) -> Trajectory:
        reach = max(reach, self.t_end if isfinite(self.t_end) else 0.0)
        while self._pieces[-1].t_stop[0] < reach:
            if self.open_end is not None:
                self._go_on()
            elif self._target is not None:
                last = self._pieces[-1]
                begun = last.t_start[0]
                longer = toward_equilibrium(self.problem.functions, *self._target, reach - begun)
                if not longer.duration > last.stretch.duration:
                    raise SolutionError(
                        f"t = {reach!r}: by then the body is closer to the equilibrium at "
                        f"{self.problem.formulas.parameter} = {self._target[1]!r} than doubles can tell"
                    )
                self._pieces.pop()
                self.add(longer, 1, "asymptote")
            else:
                break
        if reach > self.t_end:
            raise InputError(f"t: the motion ends at {self.t_end!r} s ({self._how_it_ends()}), got {reach!r}")
        return Trajectory(pieces=tuple(self._pieces))

    def _first_passages(self, lam: float, low: float) -> list[float]:
        while self._is_ahead(lam, low) and self._pieces[-1].t_stop[0] < self.t_end:
            if self.open_end is not None:
                self._go_on()
            else:
                self._course(min(2.0 * self._pieces[-1].t_stop[0], self.t_end))
        return super()._first_passages(lam, low)

    def _is_ahead(self, lam: float, low: float) -> bool:
        """Whether a place lies beyond what has been computed of a motion without an end, and before its limit."""
        end, last = self.open_end, self._pieces[-1].stretch
        if end is not None:
            return (lam - end.place) * end.direction > 0.0 and (end.limit - lam) * end.direction > 0.0
        if self._target is None or (last.b - lam) * last.direction <= 0.0:
            return False
        return bool(last.anomaly_of(*last.offsets(lam, low)) > last.edges[-1])

    @budget("motion", 60.0, "give a shorter t_max, or ask for earlier times")
    def _go_on(self) -> None:
        """One more stretch of a motion without an end."""
        end, problem = self.open_end, self.problem
        assert end is not None
        f, lam0 = problem.functions, problem.lam0
        target = end.target
        if abs(target - end.place) <= NARROW * max(abs(end.place), abs(lam0)):
            self._ends_here()
            return
        if abs(target) > FARTHEST * max(1.0, abs(lam0)):
            raise SolutionError(
                f"the motion leaves the range of doubles at {problem.formulas.parameter} = {end.place!r}; "
                "give a shorter t_max"
            )
        begun = abs(end.place - lam0)
        while True:
            spend()
            what, near, far = first_zero_from(
                f.addresses,
                f.p,
                lam0,
                problem.w0,
                end.direction,
                begun,
                abs(target - lam0),
                end.step,
            )
            if what != zeros.CRITICAL:
                break
            if problem.decider.resolve(lam0 + near, lam0 + far, end.direction).what != "clear":
                break
            begun = abs(far)  # a barrier that is barely cleared
        if what != zeros.LIMIT:
            raise SolutionError(
                f"the motion beyond {problem.formulas.parameter} = {lam0 + near!r} could not be followed; "
                "give a domain that ends there"
            )
        stretch = through(f, end.place, target, lam0, problem.w0)
        if self._pieces and (
            stretch.duration <= NEGLIGIBLE_SHARE * self._pieces[-1].t_stop[0]
            and stretch.length <= NEGLIGIBLE_SHARE * abs(self._arc_end())
        ):
            self._ends_here()  # a spiral has come to its centre
            return
        self.add(stretch, 1, "")
        end.place, end.step = target, 2.0 * end.step

    def _ends_here(self) -> None:
        """What is ahead takes neither time nor way."""
        self._pieces[-1] = replace(self._pieces[-1], end="singular-point")
        self.t_end = min(self.t_end, self._pieces[-1].t_stop[0])
        self.open_end = None

    def _clock_error(self, t: Array) -> Array:
        course = self._course(float(np.abs(t).max()) if t.size else 0.0)
        spent = [
            abs(piece.r_stop[0] - piece.r_start[0]) * (piece.stretch.relative_error + ULP) for piece in course.pieces
        ]
        before: Array = np.cumsum([0.0, *spent])[course.piece_of(t)]
        return before

    def _how_it_ends(self) -> str:
        end = self._pieces[-1].end
        return f"{end} at {self.problem.formulas.parameter} = {self.legs[-1].lam_end!r}" if self.t_end < inf else end


class MotionAtRest(Motion):
    """A body that stays where it is."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem, "rest", problem.launch.direction)

    def _located(self, t: Array, t_low: Array) -> PhasePoints:
        return PhasePoints((), np.ones(t.shape, dtype=bool), np.zeros_like(t), self._course(0.0))

    def _course(self, reach: float) -> Trajectory:
        return Trajectory(pieces=(), period=ZERO)

    def _clock_error(self, t: Array) -> Array:
        return np.zeros_like(t)

    @property
    def events(self) -> tuple[Event, ...]:
        """At rest from the launch on."""
        state = self.state(0.0)
        return Rows([Event("rest", 0.0, state.lam, state.x, state.z)])

    def _extent(self) -> str:
        return f"it rests at {self.problem.lam0!r}"
