"""Motions with friction, drag or resistance: leg after leg, each computed when it is needed."""

from math import inf, isfinite
from typing import Any

import numpy as np

from gqm_sym.errors import BudgetError, InputError, SolutionError
from gqm_sym.runtime.arithmetic.doubledouble import ULP, ZERO, Pair, two_sum
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.interface import Dissipation
from gqm_sym.runtime.launch.ends import CUSP_SHARE, domain_end, leaving_at_once, starting_step
from gqm_sym.runtime.launch.formulas import Formulas, ParameterValues
from gqm_sym.runtime.launch.functions import BoundFunctions
from gqm_sym.runtime.launch.problem import Problem, bind
from gqm_sym.runtime.launch.request import Launch
from gqm_sym.runtime.launch.speed import path_and_force_at
from gqm_sym.runtime.launch.zeros import MAX_PARAMETER
from gqm_sym.runtime.legs import follow
from gqm_sym.runtime.legs.leg_breaks import clearance
from gqm_sym.runtime.legs.leg_record import COLUMNS, END, END_LOW, MIDDLE, TIME_FROM_START
from gqm_sym.runtime.legs.leg_run import ASYMPTOTE, FULL, LIFTOFF, LIMIT, NARROWED, PAUSED, SPENT, TURN, Route, Start
from gqm_sym.runtime.legs.leg_segments import Run, along_field, along_panels
from gqm_sym.runtime.motion.aperiodic import MotionAtRest
from gqm_sym.runtime.motion.events import passages
from gqm_sym.runtime.motion.locking import locked
from gqm_sym.runtime.motion.motion import Motion
from gqm_sym.runtime.motion.segment import Segment
from gqm_sym.runtime.motion.trajectory import TimedSegment, Trajectory
from gqm_sym.runtime.multiprecision.exact_problem import NOWHERE

# The first panel as a share of the first step of a search. The shorter it is, the more digits early times have.
FIRST_PANEL_SHARE = 0.25

# On a curve without ends, after how many runs in a row without a turn `legs` and `events` no longer look for one.
MAX_PAUSES = 12

# The number of turns after which `legs` and `events` no longer look for the place where the body comes to rest.
MAX_TURNS = 20000

# The most segments that are stored; each takes some kilobytes.
MAX_SEGMENTS = 250_000

# How many panels a record has space for at first; a leg with more is followed again with a larger record.
FEW_PANELS = 12

# The only sign that N can have for each kind of contact; 0 if it can have both.
ONLY_SIGN = {"bilateral": 0, "above": 1, "below": -1}


def dissipate(formulas: Formulas, p: ParameterValues, launch: Launch) -> Motion:
    """The motion of a launch where forces dissipate."""
    functions = bind(formulas, p, launch)
    problem = Problem(formulas, launch, p, functions, formulas.domain(p))
    if problem.w0 > 0.0:
        return DissipativeMotion(problem, launch.direction)
    direction = _direction_from_rest(problem, problem.lam0, launch.direction)
    return DissipativeMotion(problem, direction) if direction else MotionAtRest(problem)


def launch_leg(formulas: Formulas, p: ParameterValues, launch: Launch, places: Array) -> Array:
    """V**2 at places of the launch leg, through changes of contact sign up to its first turn; NaN elsewhere."""
    motion = dissipate(formulas, p, launch)
    v2 = np.full(places.shape, np.nan)
    if isinstance(motion, DissipativeMotion):
        motion.fill_launch_leg(places, v2)
    v2[places == launch.lam0.value] = launch.v0.value**2
    return v2


def _direction_from_rest(problem: Problem, lam: float, preferred: int) -> int:
    """The direction in which a body at rest leaves a place; 0 if it stays.

    At a corner both planes decide; where it could slide down either of them, it takes the ``preferred`` direction.
    """
    f, domain = problem.functions, problem.domain
    off = clearance.py_func(lam, domain.period or max(abs(domain.low), abs(domain.high))) if _is_break(f, lam) else 0.0
    balance = _loss(problem).static_balance
    direction: int = follow.direction_from_rest(balance, f.p, lam - off, lam + off, preferred)
    return direction


def _is_break(f: BoundFunctions, lam: float) -> bool:
    """Whether the curve is not smooth at a place."""
    return bool(f.between(f.breaks, *np.nextafter(lam, (-inf, inf)).tolist()).size)


def _loss(problem: Problem) -> Dissipation:
    """The dissipation of the model."""
    loss = problem.formulas.dissipation
    assert loss is not None
    return loss


class DissipativeMotion(Motion):
    """A motion that loses energy: leg after leg, until the body rests or leaves the track, or for ever.

    Each leg begins with V**2 = 0 at a turning point, so that its accuracy does not depend on the legs before it; times
    are summed as two doubles. Legs are computed when they are needed. Without ``t_max``, `legs` and `events` of a
    motion that never ends cover what has been computed so far, and at least the first leg.
    """

    # The state with which a motion begins.
    _ending = ""
    _elapsed = _elapsed_low = _arc = _no_turn_until = _low = 0.0
    # The time since the last turn, and the two times from turn to turn before it.
    _leg_time = 0.0
    _leg_times = (inf, inf)
    _contact_sign = _laps = _turns = _pauses = 0
    _could_stay = True
    _whole: Trajectory | None = None

    def __init__(self, problem: Problem, direction: int) -> None:
        self._runs: list[tuple[Any, ...]] = []
        self._segments: list[TimedSegment] = []
        super().__init__(problem, "dissipative", direction)
        launch = problem.launch
        self._place, self._w, self._direction = launch.lam0.value, launch.v0.value**2, direction
        step = starting_step(problem)
        self._step, self._reach = FIRST_PANEL_SHARE * step, problem.period or step
        self._go_on()

    # -- what the motion answers --------------------------------------------------------------

    @property
    @locked
    def t_end(self) -> float:
        """The time in s at which the body rests or leaves the track, or ``t_max``; infinite if there is neither."""
        self._look_ahead()
        return self._known_end()

    @property
    @locked
    def turning_points(self) -> tuple[float, ...]:
        """The turning points so far in the order of time; the place of a launch from rest is one."""
        turns = [leg.lam_end for leg in self.legs if leg.end == "turn"]
        return (*((self.problem.lam0,) if self.problem.w0 == 0.0 else ()), *turns)

    def fill_launch_leg(self, places: Array, v2: Array) -> None:
        """Fill in V**2 at the places that lie on the launch leg."""
        done, lap = 0, self.problem.period
        while True:
            for piece in self._pieces[done:]:
                segment = piece.segment
                within = places - piece.laps * lap
                on = (within >= min(segment.a, segment.b)) & (within <= max(segment.a, segment.b)) & np.isnan(v2)
                phi = [segment.phase_angle_of(*segment.offsets(place)) for place in within[on].tolist()]
                v2[on] = segment.speeds(np.minimum(phi, segment.stop)) ** 2
                if piece.end not in ("", "contact-sign"):
                    return
            done = len(self._pieces)
            if not self._is_ahead(places):
                return
            self._go_on()

    def _is_ahead(self, places: Array) -> bool:
        """Whether one of the places lies ahead of what has been computed."""
        reached = self._place + self._laps * self.problem.period
        return bool(np.any((places - reached) * self._direction > 0.0))

    # -- what `Motion` needs ------------------------------------------------------------------

    @property
    def _internal_ends(self) -> tuple[str, ...]:
        return ("",) if _loss(self.problem).friction else ("", "contact-sign")

    def _trajectory(self, reach: float) -> Trajectory:
        if isfinite(self._horizon):
            reach = max(reach, self._horizon)
        while not self._ending and self._elapsed + self._elapsed_low < reach:
            self._go_on()
        if self._whole is None or len(self._whole.segments) != len(self._pieces):
            self._whole = Trajectory(segments=tuple(self._pieces), lap=self.problem.period)
        return self._whole

    def _history(self) -> tuple[TimedSegment, ...]:
        self._look_ahead()
        return self._trajectory(0.0).segments

    def _contact_changes(self, piece: TimedSegment) -> list[tuple[Pair, float]]:
        return []  # segments end there

    def _check_end(self, t: float) -> None:
        self._trajectory(t)
        end = self._known_end()
        if t > end:
            raise InputError(f"t: the motion ends at {end!r} s ({self._end_text()}), got {t!r}")
        if self._ending == "asymptote" and t > self._pieces[-1].t_stop[0]:
            raise SolutionError(
                f"t = {t!r}: by then the body is closer to the equilibrium at "
                f"{self.problem.formulas.parameter} = {self._place!r} than doubles can tell"
            )

    def _time_error(self, t: Array) -> Array:
        trajectory = self._trajectory(float(np.abs(t).max()) if t.size else 0.0)
        worst = max(piece.segment.relative_error for piece in trajectory.segments)
        return np.abs(t) * (worst + 4.0 * ULP)

    def _end_text(self) -> str:
        if not self._ending or self._pieces[-1].t_stop[0] > self._horizon:
            return super()._end_text()
        return (
            f"{self._ending} at {self.problem.formulas.parameter} = {self._place + self._laps * self.problem.period!r}"
        )

    def _first_passages(self, lam: float, low: float) -> list[float]:
        done = 0
        while True:
            trajectory = self._trajectory(0.0)
            found = passages(trajectory.segments[done:], trajectory, lam, low)
            done = len(trajectory.segments)
            # A body that turns at two points reaches no place outside of them any more.
            settled = self._turns >= 2 or (self._turns and self.problem.w0 == 0.0)
            if found or self._ending or settled or trajectory.segments[-1].t_stop[0] >= self._horizon:
                return found
            self._go_on()

    # -- leg after leg ------------------------------------------------------------------------

    def _known_end(self) -> float:
        """The time at which the motion ends, as far as is known; infinite if it is not."""
        ends = self._ending not in ("", "asymptote")
        return min(self._horizon, self._pieces[-1].t_stop[0] if ends else inf)

    def _look_ahead(self) -> None:
        """Compute the whole motion if it ends, and at least its first leg if it does not."""
        if isfinite(self._horizon):
            self._trajectory(self._horizon)
            return
        while not self._ending and self._pauses < MAX_PAUSES:
            if self._turns and (not self._could_stay or self._turns > MAX_TURNS):
                return
            self._go_on()

    @property
    def _pieces(self) -> list[TimedSegment]:
        """All segments so far."""
        for run in self._runs:
            self._lay(Run(*run))
        self._runs.clear()
        return self._segments

    def _go_on(self) -> None:
        """Follow the body to its next turn, to the end of the motion, or as far as one run goes."""
        if len(self._segments) + len(self._runs) >= MAX_SEGMENTS:
            raise BudgetError(
                f"motion: {MAX_SEGMENTS} pieces of legs reach t = {self._pieces[-1].t_stop[0]!r} only; "
                "give a shorter t_max, or ask for earlier times and nearer places"
            )
        problem, direction, start, low = self.problem, self._direction, self._place, self._low
        domain, period = problem.domain, problem.domain.period
        end = domain.high if direction > 0 else domain.low
        # The breaks of a closed curve are listed for some laps.
        limit = start + direction * 8.0 * period if period else end
        pause = inf if isfinite(end) else self._reach
        route = Route(self._breaks_before(limit), limit, pause, ONLY_SIGN[problem.launch.contact])
        launch = Start(start, low, self._w, direction, self._contact_sign, self._step, self._no_turn_until)
        dissipation, p, size = _loss(problem), problem.functions.p, FEW_PANELS * COLUMNS
        while True:
            record = np.empty(size)
            what, contact_sign, new_direction, could_stay, ahead, back, place, v2, step, no_turn_until, time = (
                follow.follow(dissipation, p, launch, route, record)
            )
            if what != FULL:
                break
            size *= 4
        if what == LIFTOFF and not ahead:
            self._lift_off_at_once(launch, route)
            return
        if not ahead and what == LIMIT:
            raise leaving_at_once(problem, direction, "end of the domain")
        if not (ahead or back) or what == SPENT or (what == ASYMPTOTE and not back):
            raise SolutionError(
                f"V**2 beyond {problem.formulas.parameter} = {place!r} could not be followed; "
                "are the curve and the force smooth there?"
            )
        new_low = float(record[END_LOW])
        self._leg_time += time
        if what == TURN:
            stays = new_direction == 0 or (place == start and new_low == low and self._w == 0.0)
            name = "rest" if stays or self._comes_to_rest_between(place, time) else "turn"
            self._leg_times, self._leg_time = (self._leg_times[1], self._leg_time), 0.0
        else:
            name = self._end_name(what, place)
        self._runs.append(((start, low), ahead, back, record, what, name, self._laps))
        self._place, self._low, self._w, self._direction = place, new_low, v2, new_direction
        self._contact_sign, self._step, self._no_turn_until = contact_sign, step, no_turn_until
        self._elapsed, rounding = two_sum.py_func(self._elapsed, time)
        self._elapsed_low += rounding
        if what == TURN:
            self._turns, self._could_stay, self._no_turn_until, self._pauses = self._turns + 1, could_stay, 0.0, 0
        else:
            self._pauses = self._pauses + 1 if what == PAUSED and not period and not isfinite(end) else 0
        if name not in ("", "turn", "contact-sign"):
            self._ending = name
            return
        if period:
            self._fold(period)
        if abs(place) > MAX_PARAMETER and abs(place) > MAX_PARAMETER * abs(problem.lam0):
            raise SolutionError(
                f"the motion leaves the range of doubles at {problem.formulas.parameter} = {place!r}; "
                "give a shorter t_max"
            )
        if what == PAUSED and not period:
            self._reach *= 2.0

    def _breaks_before(self, limit: float) -> Array:
        """The breaks from here to a limit in the order of the motion.

        They include those a little behind, which show on which piece of the curve the body is.
        """
        f, direction = self.problem.functions, self._direction
        if not f.breaks.size:
            return NOWHERE
        begin = self._place - direction * starting_step(self.problem)
        return np.ascontiguousarray(f.between(f.breaks, begin, limit)[::direction])

    def _fold(self, period: float) -> None:
        """Count whole laps of a closed curve separately, so that places keep their digits."""
        count = int(np.trunc((self._place - self.problem.lam0) / period))
        self._place, low = two_sum.py_func(self._place, -count * period)
        self._low += low
        self._laps += count

    def _comes_to_rest_between(self, place: float, time: float) -> bool:
        """Whether the body, which turns at a place, has come to rest on a corner there as far as times can tell.

        Between two planes the times from turn to turn decrease geometrically, those in either direction by the same
        factor. The body is at rest if the sum of all that follow is less than a rounding of the time.
        """
        f, (before_last, last), leg_time = self.problem.functions, self._leg_times, self._leg_time
        if not (f.corners.size and before_last < inf and leg_time < before_last):
            return False
        remaining = leg_time * (last + leg_time) / (before_last - leg_time)
        now = self._elapsed + time
        return now + remaining == now and _is_break(f, place) and _direction_from_rest(self.problem, place, 0) == 0

    def _end_name(self, what: int, place: float) -> str:
        """The name of the end of a run that does not turn."""
        problem, f, start = self.problem, self.problem.functions, self._place
        if what == LIMIT and not problem.period:
            return domain_end(problem, self._direction).what
        if what == NARROWED:
            ds = path_and_force_at(f.addresses, f.p, np.array([start, place]), np.zeros(2))[2]
            return "cusp" if ds[1] <= CUSP_SHARE * ds[0] else "singular-point"
        return {LIFTOFF: "liftoff", ASYMPTOTE: "asymptote"}.get(what, "")

    def _lift_off_at_once(self, launch: Start, route: Route) -> None:
        """End the motion as it begins, because the track would have to pull the body at once."""
        record = np.empty(FEW_PANELS * COLUMNS)
        launch, route = launch._replace(no_turn_until=inf), route._replace(pause=0.0, only_sign=0)
        what, _, _, _, ahead, *_ = follow.follow(_loss(self.problem), self.problem.functions.p, launch, route, record)
        first = Run((self._place, self._low), ahead, 0, record, what, "liftoff", self._laps)
        segment = self._panels_of(first)
        self._segments.append(self._piece(segment, 1, (ZERO, 0.0), (ZERO, 0.0), "liftoff", self._laps))
        self._ending = "liftoff"

    def _lay(self, run: Run) -> None:
        """Make segments of a run."""
        f, end, middle = self.problem.functions, run.pair(END), run.pair(MIDDLE)
        if run.ahead:
            self._add(self._panels_of(run), 1, run, "" if run.back else run.end)
        if run.what == ASYMPTOTE:
            self._add(along_field(f, middle[0], end[0], run.field), 1, run, run.end)
        elif run.back:
            self._add(
                along_panels(f, end, middle, 0.0, run.pair(TIME_FROM_START)[1], run.panels_back), -1, run, run.end
            )

    def _panels_of(self, run: Run) -> Segment:
        """The segment from a run's start to the place up to which time is counted from there."""
        f, middle, (before, _) = self.problem.functions, run.pair(MIDDLE), run.pair(TIME_FROM_START)
        return along_panels(f, run.start, middle, run.half_c, before, run.panels_ahead)

    def _add(self, segment: Segment, sense: int, run: Run, end: str) -> None:
        """Append a segment to the motion, cut where N changes its sign."""
        if not end and segment.b in run.changes:  # up to there time is counted from the turn
            end = "contact-sign"
        low, high = sorted((segment.a, segment.b))
        cuts = [segment.phase_angle_of(*segment.offsets(place)) for place in run.changes if low < place < high]
        times = segment.times(np.array(cuts)) if cuts else ()
        marks = [(ZERO, 0.0), *(((float(r), 0.0), phi) for r, phi in zip(times, cuts, strict=True))]
        marks.append(((segment.duration, 0.0), segment.stop))
        marks.sort(key=lambda mark: sense * mark[1])
        for k in range(len(marks) - 1):
            name = end if k == len(marks) - 2 else "contact-sign"
            self._segments.append(self._piece(segment, sense, marks[k], marks[k + 1], name, run.laps))
        self._arc += sense * segment.direction * segment.length

    def _piece(
        self, segment: Segment, sense: int, start: tuple[Pair, float], stop: tuple[Pair, float], end: str, laps: int
    ) -> TimedSegment:
        return TimedSegment(
            segment=segment,
            sense=sense,
            r_start=start[0],
            r_stop=stop[0],
            phi_start=start[1],
            phi_stop=stop[1],
            t_start=self._segments[-1].t_stop if self._segments else ZERO,
            s_a=self._arc if sense > 0 else self._arc - segment.direction * segment.length,
            end=end,
            laps=laps,
        )
