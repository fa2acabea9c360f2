"""Motions that do not repeat: those to an end of the curve, to an equilibrium, to infinity or to a pole."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, isfinite, sqrt
from typing import Any

import numpy as np

from gqm_sym.budgets import budget
from gqm_sym.errors import SolutionError
from gqm_sym.runtime.arithmetic.doubledouble import ULP, ZERO, Pair, plus
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.gradients.orbit import without_formulas
from gqm_sym.runtime.gradients.passages.passage import PassageChanges
from gqm_sym.runtime.gradients.passages.quantities import gradient
from gqm_sym.runtime.gradients.quantities import selected
from gqm_sym.runtime.gradients.sensitivity import STATE_ROWS, Sensitivity
from gqm_sym.runtime.interface import ExactFormulas
from gqm_sym.runtime.launch import zeros
from gqm_sym.runtime.launch.ends import first_zero_from, is_steep, search_beyond_barriers, too_steep
from gqm_sym.runtime.launch.kinds import PERIODIC_QUANTITIES, MotionKind
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.launch.request import ONLY_SIGN
from gqm_sym.runtime.launch.speed import path_and_force_at
from gqm_sym.runtime.launch.zeros import MAX_PARAMETER, MIN_STEP_SHARE
from gqm_sym.runtime.motion.events import liftoff
from gqm_sym.runtime.motion.locking import computed_once, locked
from gqm_sym.runtime.motion.motion import Motion
from gqm_sym.runtime.motion.parts.tabulated import Tabulated
from gqm_sym.runtime.motion.segments.conditioning import v2_correction
from gqm_sym.runtime.motion.segments.kinds import through, toward_equilibrium
from gqm_sym.runtime.motion.segments.segment import Segment
from gqm_sym.runtime.motion.trajectory import TimedSegment, Trajectory, stop_time
from gqm_sym.runtime.quadrature.time_panels import NEGLIGIBLE_SHARE

# The number of segments of a motion to infinity that `legs` and `events` cover, and the number of panels; its end is
# searched for on these. Each segment is twice as long as the one before, so that they reach as far as for motions with
# losses.
MAX_SEGMENTS_AHEAD, MAX_PANELS_AHEAD = 12, 200

# The next segment is twice as long unless the last one has more panels than this.
MAX_PANELS_TO_DOUBLE = 64

# The distance from a pole, as a share of the parameter, within which contact forces are rounding: they grow as the
# distance to the power -1, and the rounding of places in them as its power -3.
NEAR_POLE = 1e-7

# The phase angle up to which the approach to an equilibrium is shown; the rest of the way is less than a thousandth of
# it.
SHOWN_PHASE = 8.0


@dataclass(slots=True)
class OpenEnd:
    """The open end of a motion to infinity or to a pole, which is continued on request.

    Attributes
    ----------
    place : float
        The curve parameter up to which it has been computed.
    direction : int
        The sign of its further change.
    limit : float
        The limit of the curve parameter: infinity, or a place where the curve or the potential is not finite.
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


class AperiodicMotion(Tabulated, Motion):
    """A motion that does not repeat: its segments follow each other, and each is passed at most once in each direction.

    If the track can push from one side only, the motion ends as soon as contact is lost. A motion to infinity or to a
    pole is continued when later times or farther places are requested; `t_end`, `legs` and `events` cover as many
    segments as `MAX_SEGMENTS_AHEAD` and `MAX_PANELS_AHEAD` allow, whatever was requested before.

    `conservative.solve` appends its first segments by methods that begin with an underscore, because users have no
    business with them.
    """

    def __init__(self, problem: Problem, kind: MotionKind, direction: int) -> None:
        super().__init__(problem, kind, direction)
        self._segments: list[TimedSegment] = []
        self._open_end: OpenEnd | None = None
        # The reason for which a motion to infinity cannot be followed any farther.
        self._obstacle = ""
        self._segments_at_first, self._is_endless = 0, False
        self._pole = inf  # the place of the pole into which the body falls

    @property
    @locked
    def t_end(self) -> float:
        """The time in s at which the motion ends, or the horizon ``t_max``; infinite if there is neither.

        The end of a motion to infinity is searched for up to a limited distance only.
        """
        return min(self._horizon, _end_time(self._history()))

    @property
    def _lifted_off(self) -> bool:
        """Whether contact has been lost."""
        return bool(self._segments) and self._segments[-1].end == "liftoff"

    def _add(self, segment: Segment, sense: int, end: str) -> None:
        """Append a whole segment, passed from its end ``a`` if ``sense`` is +1 and towards ``a`` if it is -1; ``end``
        is the name of its end.
        """
        total_time = segment.total_time
        start, stop = (ZERO, total_time) if sense > 0 else (total_time, ZERO)
        if not self._segments:
            start = plus(start, (self._launch_delay(segment), 0.0))
        t, s = (self._segments[-1].t_stop, self._arc_end()) if self._segments else (ZERO, 0.0)
        s_a = s if sense > 0 else s - segment.direction * segment.length
        phi_start, phi_stop = (0.0, segment.stop) if sense > 0 else (segment.stop, 0.0)
        self._append(
            TimedSegment(
                segment=segment,
                sense=sense,
                r_start=start,
                r_stop=stop,
                phi_start=phi_start,
                phi_stop=phi_stop,
                t_start=t,
                t_stop=stop_time(sense, start, stop, t),
                s_a=s_a,
                end=end,
            )
        )

    def _launch_delay(self, segment: Segment) -> float:
        """Return the time in s from the double nearest to the launch place to that place itself."""
        low, speed = self.problem.launch.lam0.low, self.problem.launch.v0.value
        if segment.from_multiprecision or low == 0.0 or speed == 0.0:
            return 0.0
        f = self.problem.functions
        ds = path_and_force_at(f.addresses, f.p, np.array([self.problem.lam0]), np.zeros(1))[2, 0]
        at_double = sqrt(max(0.0, speed * speed + v2_correction(f.addresses, f.p, self.problem.launch.lam0)))
        return segment.direction * low * float(ds) * 2.0 / (speed + at_double)

    def _append(self, timed: TimedSegment) -> None:
        """Append a timed segment, as far as contact lasts."""
        if self._lifted_off:
            return
        side = ONLY_SIGN[self.problem.launch.contact]
        lost = liftoff(self.problem.formulas, timed, side, first=not self._segments) if side else None
        if lost is not None and not self._is_at_pole(timed, lost[1]):
            t_stop = stop_time(timed.sense, timed.r_start, lost[0], timed.t_start)
            timed = timed._replace(r_stop=lost[0], phi_stop=lost[1], t_stop=t_stop, end="liftoff")
            self.kind, self._open_end = "transit", None
        self._segments.append(timed)

    def _approach(self, start: float, equilibrium: float) -> None:
        """Append the approach to an equilibrium from ``start``, which takes infinite time."""
        if not self._lifted_off:
            self._add(toward_equilibrium(self.problem.functions, start, equilibrium), 1, "asymptote")

    def _is_at_pole(self, timed: TimedSegment, phi: float) -> bool:
        """Return whether a phase angle of a timed segment is so near to the pole into which the body falls that the
        sign of the contact force there is rounding.
        """
        if not isfinite(self._pole):
            return False
        place = float(timed.segment.places(np.array([phi]))[0])
        return abs(place - self._pole) <= NEAR_POLE * (abs(self._pole) + abs(self.problem.lam0))

    def _contact_changes(self, timed: TimedSegment) -> list[tuple[Pair, float]]:
        changes = super()._contact_changes(timed)
        return [change for change in changes if not self._is_at_pole(timed, change[1])]

    def _leave_open(self, end: OpenEnd) -> None:
        """Let the motion be continued beyond its segments, unless contact is lost on them."""
        if not self._lifted_off:
            self._open_end, self._pole = end, end.limit

    def _finish(self) -> "AperiodicMotion":
        """Compute at least the first segment; return the motion itself."""
        end = self._open_end
        self._is_endless = end is not None and not isfinite(end.limit)
        if end is not None and not self._segments:
            self._extend()
            if not self._segments:
                raise SolutionError(self._obstacle)
        self._segments_at_first = len(self._segments)
        return self

    @property
    def turning_points(self) -> tuple[float, ...]:
        """The turning points so far in the order of time; a launch from rest counts as one."""
        turns = [float(p.segment.places(np.array([p.phi_stop]))[0]) for p in self._segments if p.end == "turn"]
        return (*((self.problem.lam0,) if self.problem.w0 == 0.0 else ()), *turns)

    def _has_turned(self, t: float) -> bool:
        """Return whether the body has turned by a time."""
        return any(timed.end == "turn" and t > timed.t_stop[0] for timed in self._segments)

    @computed_once
    def _in_legs(self) -> Motion | None:
        """The same motion along a chart, followed as one with losses that vanish, which has derivatives; None along a
        curve with formulas.
        """
        from gqm_sym.runtime.legs.variations.without_losses import followed_in_legs

        return None if self.problem.formulas.chart is None else followed_in_legs(self.problem)

    @computed_once
    def _passage(self) -> PassageChanges:
        """The changes of the motion along a curve with formulas."""
        formulas = self.problem.formulas
        if not isinstance(formulas.exact, ExactFormulas):
            raise without_formulas()
        turns, last = self.turning_points, self._segments[-1]
        limit = last.segment.b if last.end == "asymptote" else self.legs[-1].lam_end if isfinite(self.t_end) else inf
        turn, has_asymptote = turns[0] if turns else None, last.end == "asymptote"
        return PassageChanges(self.problem, self.direction, turn, limit, has_asymptote=has_asymptote)

    @locked
    def _gradient(self, quantity: str, wrt: Any) -> dict[str, Any]:
        rows = selected(self.problem.formulas.parameters, wrt)
        if quantity in PERIODIC_QUANTITIES:
            raise SolutionError(
                f"gradient: a motion of kind {self.kind!r} does not repeat, and so it has no {quantity}"
            )
        if self._in_legs is not None:
            return self._in_legs._gradient(quantity, wrt)
        found = gradient(self, self._passage, quantity)
        if quantity == "turning_points":
            return {name: tuple(found[:, row].tolist()) for name, row in rows.items()}
        return {name: float(found[row]) for name, row in rows.items()}

    @locked
    def _sensitivity(self, t: Any, wrt: Any) -> Sensitivity:
        rows = selected(self.problem.formulas.parameters, wrt)
        if self._in_legs is not None:
            return self._in_legs._sensitivity(t, wrt)
        passage = self._passage
        times, _, shape = self._times(t)
        states, turned = self.state(times), np.array([self._has_turned(time) for time in times.tolist()], dtype=bool)
        made = passage.states(np.atleast_1d(states.lam), np.atleast_1d(states.v), turned)[:, list(rows.values())]
        return Sensitivity(tuple(rows), *made.reshape(STATE_ROWS, len(rows), *shape))

    def _arc_end(self) -> float:
        last = self._segments[-1]
        return last.s_a + (last.segment.direction * last.segment.length if last.sense > 0 else 0.0)

    def _trajectory(self, end_time: float) -> Trajectory:
        while self._open_end is not None and self._segments[-1].t_stop[0] <= end_time:
            self._extend()
        if self._obstacle and self._segments[-1].t_stop[0] < end_time:
            raise SolutionError(self._obstacle)
        return Trajectory(segments=tuple(self._segments))

    def _history(self) -> tuple[TimedSegment, ...]:
        if isfinite(self._horizon):
            return self._trajectory(self._horizon).segments
        # One more segment shows whether the last of them leads to the end.
        while self._open_end is not None and len(self._segments) <= self._segments_ahead():
            self._extend()
        count = self._segments_ahead()
        return tuple(self._segments if count == inf else self._segments[: int(count)])

    def _segments_ahead(self) -> float:
        """Return the number of segments of `legs` and `events`; infinity if there are fewer so far, or if all lead to a
        pole.
        """
        panels = 0
        for k, timed in enumerate(self._segments if self._is_endless else ()):
            panels += timed.segment.edges.size
            if k + 1 == MAX_SEGMENTS_AHEAD or panels >= MAX_PANELS_AHEAD:
                return k + 1
        return inf

    def _known_end(self) -> float:
        return min(self._horizon, _end_time(self._segments))

    def _check_end(self, t: float) -> None:
        super()._check_end(t)
        last = self._segments[-1]
        if last.end == "asymptote" and t > last.t_stop[0]:
            raise SolutionError(
                f"t = {t!r}: by then the body is closer to the equilibrium at "
                f"{self.problem.formulas.parameter} = {last.segment.b!r} than doubles can tell"
            )

    def _first_passages(self, lam: float, low: float) -> list[float]:
        while self._is_ahead(lam) and self._segments[-1].t_stop[0] < self._horizon:
            self._extend()
        found = super()._first_passages(lam, low)
        if self._obstacle and not found:
            raise SolutionError(self._obstacle)
        return found

    def _is_ahead(self, lam: float) -> bool:
        """Return whether the motion will reach a place beyond the part that has been computed."""
        end = self._open_end
        return end is not None and (lam - end.place) * end.direction > 0.0 and (end.limit - lam) * end.direction > 0.0

    def _shown_time(self) -> float:
        last = self._segments[self._segments_at_first - 1]
        if last.end != "asymptote":
            return last.t_stop[0]
        return last.t_start[0] + float(last.segment.times(np.array([SHOWN_PHASE]))[0])

    @budget("motion", 60.0, "give a shorter t_max, or ask for earlier times")
    def _extend(self) -> None:
        """Append one more segment of a motion to infinity or to a pole."""
        end, problem = self._open_end, self.problem
        assert end is not None
        f, lam0, name = problem.functions, problem.lam0, problem.formulas.parameter
        target = end.target
        if abs(target - end.place) <= MIN_STEP_SHARE * max(abs(end.place), abs(lam0)):
            if is_steep(problem, end.direction, end.place):
                raise too_steep(problem, end.limit)
            self._end_here()
            return
        if abs(target) > MAX_PARAMETER * max(1.0, abs(lam0)):
            self._stop_following(f"the motion leaves the range of doubles at {name} = {end.place!r}")
            return
        begin, length = abs(end.place - lam0), abs(target - lam0)
        found = first_zero_from(f.addresses, f.p, lam0, problem.w0, end.direction, begin, length, end.step)
        (what, near, far), _ = search_beyond_barriers(problem, end.direction, found, length, end.step)
        if what == zeros.STEPS_SPENT and abs(near) > begin:
            target = lam0 + near  # one search ends here, and the next one begins here
        elif what == zeros.CUSP:
            self._add(through(f, end.place, lam0 + far, lam0, problem.w0), 1, "cusp")
            self._open_end = None
            return
        elif what != zeros.LIMIT:
            self._stop_following(f"the motion beyond {name} = {lam0 + near!r} could not be followed")
            return
        segment = through(f, end.place, target, lam0, problem.w0)
        if self._segments and (
            segment.duration <= NEGLIGIBLE_SHARE * self._segments[-1].t_stop[0]
            and segment.length <= NEGLIGIBLE_SHARE * abs(self._arc_end())
        ):
            self._end_here()  # the motion along a spiral has reached its centre
            return
        self._add(segment, 1, "")
        end.place = target
        if segment.edges.size <= MAX_PANELS_TO_DOUBLE:
            end.step *= 2.0

    def _stop_following(self, why: str) -> None:
        """Stop the computation of a motion to infinity."""
        self._open_end, self._obstacle = None, f"{why}; give a shorter t_max, or a domain that ends there"

    def _end_here(self) -> None:
        """End the motion at a singular point, because the rest of it has no duration and no length within rounding."""
        self._segments[-1] = self._segments[-1]._replace(end="singular-point")
        self._open_end = None

    def _time_error(self, t: Array) -> Array:
        return np.zeros_like(t)

    def _errors_before(self, timed: TimedSegment, phi: Array) -> tuple[float, Array]:
        before = 0.0
        for earlier in self._segments:
            if earlier is timed:
                break
            before += abs(earlier.r_stop[0] - earlier.r_start[0]) * (earlier.segment.relative_error + ULP)
        return 0.0, np.full_like(phi, before)

    @property
    def _pieces(self) -> Sequence[TimedSegment]:
        return self._segments

    def _end_text(self) -> str:
        last = self._segments[-1]
        if last.t_stop[0] > self._horizon:
            return super()._end_text()
        place = float(self._places_at(last, [(last.t_stop, last.phi_stop)])[0])
        return f"{last.end} at {self.problem.formulas.parameter} = {place!r}"


def _end_time(segments: Sequence[TimedSegment]) -> float:
    """Return the time in s at which the last of these segments ends the motion; infinity if it does not."""
    return segments[-1].t_stop[0] if segments[-1].end not in ("", "asymptote") else inf
