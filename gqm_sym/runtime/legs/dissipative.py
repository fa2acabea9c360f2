"""Motions with friction, drag or resistance: leg after leg, each computed when it is asked for."""

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
from gqm_sym.runtime.legs.leg_breaks import grain
from gqm_sym.runtime.legs.leg_record import BEFORE, COLUMNS, END, END_LOW, MIDDLE
from gqm_sym.runtime.legs.leg_run import ASYMPTOTE, FULL, LIFTOFF, LIMIT, NARROWED, PAUSED, SPENT, TURN
from gqm_sym.runtime.legs.leg_segments import Run, along_field, along_panels
from gqm_sym.runtime.motion.aperiodic import MotionAtRest
from gqm_sym.runtime.motion.events import passages
from gqm_sym.runtime.motion.motion import Motion
from gqm_sym.runtime.motion.segment import Segment
from gqm_sym.runtime.motion.trajectory import TimedSegment, Trajectory
from gqm_sym.runtime.multiprecision.exact_problem import NOWHERE

# The first panel, in first steps of a search: early times keep the more digits the shorter it is.
FIRST = 0.25

# On a curve without ends, how many stretches in a row without a turn `legs` and `events` look for one.
MOST_PAUSES = 12

# Turns after which `legs` and `events` stop looking for the rest.
MOST_TURNS = 20000

# Pieces of legs that are kept, each some kilobytes.
MOST_PIECES = 250_000

# Panels that a leg is expected to have at most; where it has more it is followed once more.
FEW = 12

# The only sign that N can have, 0 for both.
SIDES = {"bilateral": 0, "above": 1, "below": -1}


def dissipate(formulas: Formulas, p: ParameterValues, launch: Launch) -> Motion:
    """The motion that a launch begins where forces dissipate."""
    functions = bind(formulas, p, launch)
    problem = Problem(formulas, launch, p, functions, formulas.domain(p))
    if problem.w0 > 0.0:
        return DissipativeMotion(problem, launch.direction)
    way = _leaves(problem, problem.lam0, launch.direction)
    return DissipativeMotion(problem, way) if way else MotionAtRest(problem)


def launch_leg(formulas: Formulas, p: ParameterValues, launch: Launch, places: Array) -> Array:
    """V**2 at places of the launch leg, through changes of contact sign up to its first turn; NaN elsewhere."""
    motion = dissipate(formulas, p, launch)
    v2 = np.full(places.shape, np.nan)
    if isinstance(motion, DissipativeMotion):
        motion.fill_launch_leg(places, v2)
    v2[places == launch.lam0.value] = launch.v0.value**2
    return v2


def _leaves(problem: Problem, lam: float, asked: int) -> int:
    """Which way a body leaves a place where it is at rest; 0 if it stays.

    At a corner the planes on both sides say so; where it would slide down either, it goes the way that is ``asked``.
    """
    f, domain = problem.functions, problem.domain
    off = grain.py_func(lam, domain.period or max(abs(domain.low), abs(domain.high))) if _is_break(f, lam) else 0.0
    way: int = follow.way_from_rest(_loss(problem).hold, f.p, lam - off, lam + off, asked)
    return way


def _is_break(f: BoundFunctions, lam: float) -> bool:
    """Whether the curve is not smooth at a place."""
    return bool(f.between(f.breaks, *np.nextafter(lam, (-inf, inf)).tolist()).size)


def _loss(problem: Problem) -> Dissipation:
    """What the model adds to a conservative one."""
    loss = problem.formulas.dissipation
    assert loss is not None
    return loss


class DissipativeMotion(Motion):
    """A motion that loses energy: legs until it rests or leaves, or for ever.

    Each leg begins with V**2 = 0 at a turning point, so that it owes nothing to the accuracy of those before; times are
    summed as two doubles. Legs are computed as they are asked for. Without ``t_max``, `legs` and `events` tell of a
    motion that never ends as far as it has been asked for, and of its first leg at least.
    """

    # What a motion begins with.
    _horizon = inf
    _ending = ""
    _elapsed = _rest = _arc = _strict = _low = 0.0
    # How long the body took from turn to turn: on the leg it is on, and on the last ones.
    _swing = 0.0
    _swings = (inf, inf)
    _nu = _laps = _turns = _pauses = 0
    _held = True
    _whole: Trajectory | None = None

    def __init__(self, problem: Problem, direction: int) -> None:
        self._runs: list[tuple[Any, ...]] = []
        self._done: list[TimedSegment] = []
        super().__init__(problem, "dissipative", direction)
        launch = problem.launch
        self._place, self._w, self._way = launch.lam0.value, launch.v0.value**2, direction
        step = starting_step(problem)
        self._step, self._reach = FIRST * step, problem.period or step
        self._go_on()

    # -- what the motion says -----------------------------------------------------------------

    @property
    def t_end(self) -> float:
        """When the motion ends: when the body rests or leaves, or at the horizon; infinite if it does not."""
        self._look_ahead()
        return self._known_end()

    @t_end.setter
    def t_end(self, value: float) -> None:
        self._horizon = value

    @property
    def turning_points(self) -> tuple[float, ...]:
        """Turning points so far, in the order met; a launch from rest counts."""
        turns = [leg.lam_end for leg in self.legs if leg.end == "turn"]
        return (*((self.problem.lam0,) if self.problem.w0 == 0.0 else ()), *turns)

    def fill_launch_leg(self, places: Array, v2: Array) -> None:
        """Fill in V**2 at those places that lie on the launch leg."""
        done, lap = 0, self.problem.period
        while True:
            for piece in self._pieces[done:]:
                stretch = piece.segment
                within = places - piece.laps * lap
                on = (within >= min(stretch.a, stretch.b)) & (within <= max(stretch.a, stretch.b)) & np.isnan(v2)
                phi = [stretch.phase_angle_of(*stretch.offsets(place)) for place in within[on].tolist()]
                v2[on] = stretch.speeds(np.minimum(phi, stretch.stop)) ** 2
                if piece.end not in ("", "contact-sign"):
                    return
            done = len(self._pieces)
            if not self._is_ahead(places):
                return
            self._go_on()

    def _is_ahead(self, places: Array) -> bool:
        """Whether one of some places lies beyond what has been computed."""
        reached = self._place + self._laps * self.problem.period
        return bool(np.any((places - reached) * self._way > 0.0))

    # -- what `Motion` asks -------------------------------------------------------------------

    @property
    def _internal_ends(self) -> tuple[str, ...]:
        return ("",) if _loss(self.problem).friction else ("", "contact-sign")

    def _trajectory(self, reach: float) -> Trajectory:
        if isfinite(self._horizon):
            reach = max(reach, self._horizon)
        while not self._ending and self._elapsed + self._rest < reach:
            self._go_on()
        if self._whole is None or len(self._whole.segments) != len(self._pieces):
            self._whole = Trajectory(segments=tuple(self._pieces), lap=self.problem.period)
        return self._whole

    def _history(self) -> tuple[TimedSegment, ...]:
        self._look_ahead()
        return self._trajectory(0.0).segments

    def _contact_changes(self, piece: TimedSegment) -> list[tuple[Pair, float]]:
        return []  # pieces end there

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
        course = self._trajectory(float(np.abs(t).max()) if t.size else 0.0)
        worst = max(piece.segment.relative_error for piece in course.segments)
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
            course = self._trajectory(0.0)
            found = passages(course.segments[done:], course, lam, low)
            done = len(course.segments)
            # What turns between two points comes back to no place outside them.
            settled = self._turns >= 2 or (self._turns and self.problem.w0 == 0.0)
            if found or self._ending or settled or course.segments[-1].t_stop[0] >= self._horizon:
                return found
            self._go_on()

    # -- leg after leg ------------------------------------------------------------------------

    def _known_end(self) -> float:
        """When the motion ends, as far as has been computed."""
        ends = self._ending not in ("", "asymptote")
        return min(self._horizon, self._pieces[-1].t_stop[0] if ends else inf)

    def _look_ahead(self) -> None:
        """Compute the whole motion where it ends, and else its first leg at least."""
        if isfinite(self._horizon):
            self._trajectory(self._horizon)
            return
        while not self._ending and self._pauses < MOST_PAUSES:
            if self._turns and (not self._held or self._turns > MOST_TURNS):
                return
            self._go_on()

    @property
    def _pieces(self) -> list[TimedSegment]:
        """All pieces so far."""
        for run in self._runs:
            self._lay(Run(*run))
        self._runs.clear()
        return self._done

    def _go_on(self) -> None:
        """Follow the body to its next turn, to an end, or as far as one run goes."""
        if len(self._done) + len(self._runs) >= MOST_PIECES:
            raise BudgetError(
                f"motion: {MOST_PIECES} pieces of legs reach t = {self._pieces[-1].t_stop[0]!r} only; "
                "give a shorter t_max, or ask for earlier times and nearer places"
            )
        problem, way, start, low = self.problem, self._way, self._place, self._low
        f, domain, loss = problem.functions, problem.domain, problem.formulas.dissipation
        end, period = domain.high if way > 0 else domain.low, domain.period
        assert loss is not None
        far = 8.0 * period if period else end  # a closed curve's breaks are listed for some laps
        limit = start + way * far if period else end
        breaks = NOWHERE
        if f.breaks.size:  # those a little behind tell which piece of the curve the body is on
            breaks = np.ascontiguousarray(f.between(f.breaks, start - way * starting_step(problem), limit)[::way])
        reach = inf if isfinite(end) else self._reach
        run = (*loss, f.p, start, low, self._w, way, self._nu, breaks, limit)
        side, room = SIDES[problem.launch.contact], FEW * COLUMNS
        while True:
            record = np.empty(room)
            what, nu, new_way, held, ahead, back, place, w_end, step, strict, time = follow.follow(
                *run, reach, self._step, side, self._strict, record
            )
            if what != FULL:
                break
            room *= 4
        if what == LIFTOFF and not ahead:
            self._lift_off_at_once(run)
            return
        if not ahead and what == LIMIT:
            raise leaving_at_once(problem, way, "end of the domain")
        if not (ahead or back) or what == SPENT or (what == ASYMPTOTE and not back):
            raise SolutionError(
                f"V**2 beyond {problem.formulas.parameter} = {place!r} could not be followed; "
                "are the curve and the force smooth there?"
            )
        new_low = float(record[END_LOW])
        self._swing += time
        if what == TURN:
            stays = new_way == 0 or (place == start and new_low == low and self._w == 0.0)
            name = "rest" if stays or self._comes_to_rest_between(place, time) else "turn"
            self._swings, self._swing = (self._swings[1], self._swing), 0.0
        else:
            name = self._end_name(what, place)
        self._runs.append(((start, low), ahead, back, record, what, name, self._laps))
        self._place, self._low, self._w, self._way, self._nu, self._step, self._strict = (
            *(place, new_low, w_end, new_way),
            *(nu, step, strict),
        )
        self._elapsed, lost = two_sum.py_func(self._elapsed, time)
        self._rest += lost
        if what == TURN:
            self._turns, self._held, self._strict, self._pauses = self._turns + 1, held, 0.0, 0
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

    def _fold(self, period: float) -> None:
        """Count whole laps of a closed curve apart, so that places keep their digits."""
        count = int(np.trunc((self._place - self.problem.lam0) / period))
        self._place, low = two_sum.py_func(self._place, -count * period)
        self._low += low
        self._laps += count

    def _comes_to_rest_between(self, place: float, time: float) -> bool:
        """Whether the body, turning at a place, has come to rest on the corner there as far as times can tell.

        Between two planes swings fall geometrically, those either way by the same factor: what all others will take
        is less than a rounding of the time.
        """
        f, (before_last, last), swing = self.problem.functions, self._swings, self._swing
        if not (f.corners.size and before_last < inf and swing < before_last):
            return False
        left = swing * (last + swing) / (before_last - swing)
        now = self._elapsed + time
        return now + left == now and _is_break(f, place) and _leaves(self.problem, place, 0) == 0

    def _end_name(self, what: int, place: float) -> str:
        """What ends a run that does not turn."""
        problem, f, start = self.problem, self.problem.functions, self._place
        if what == LIMIT and not problem.period:
            return domain_end(problem, self._way).what
        if what == NARROWED:
            ds = path_and_force_at(f.addresses, f.p, np.array([start, place]), np.zeros(2))[2]
            return "cusp" if ds[1] <= CUSP_SHARE * ds[0] else "singular-point"
        return {LIFTOFF: "liftoff", ASYMPTOTE: "asymptote"}.get(what, "")

    def _lift_off_at_once(self, run: tuple[Any, ...]) -> None:
        """A motion that ends as it begins: the track would have to pull at once."""
        record = np.empty(FEW * COLUMNS)
        what, _, _, _, ahead, *_ = follow.follow(*run, 0.0, self._step, 0, inf, record)
        first = Run((self._place, self._low), ahead, 0, record, what, "liftoff", self._laps)
        stretch = self._panels_of(first)
        self._done.append(self._piece(stretch, 1, (ZERO, 0.0), (ZERO, 0.0), "liftoff", self._laps))
        self._ending = "liftoff"

    def _lay(self, run: Run) -> None:
        """Make pieces of a run."""
        f, end, middle = self.problem.functions, run.pair(END), run.pair(MIDDLE)
        if run.ahead:
            self._add(self._panels_of(run), 1, run, "" if run.back else run.end)
        if run.what == ASYMPTOTE:
            self._add(along_field(f, middle[0], end[0], run.field), 1, run, run.end)
        elif run.back:
            self._add(along_panels(f, end, middle, 0.0, run.pair(BEFORE)[1], run.panels_back), -1, run, run.end)

    def _panels_of(self, run: Run) -> Segment:
        """The stretch from a run's start to where time is counted from it."""
        f, middle, (before, _) = self.problem.functions, run.pair(MIDDLE), run.pair(BEFORE)
        return along_panels(f, run.start, middle, run.slack, before, run.panels_ahead)

    def _add(self, stretch: Segment, sense: int, run: Run, end: str) -> None:
        """Run through a whole stretch next, cut where N changes sign."""
        if not end and stretch.b in run.changes:  # where counting time from the turn begins
            end = "contact-sign"
        low, high = sorted((stretch.a, stretch.b))
        cuts = [stretch.phase_angle_of(*stretch.offsets(place)) for place in run.changes if low < place < high]
        times = stretch.times(np.array(cuts)) if cuts else ()
        marks = [(ZERO, 0.0), *(((float(r), 0.0), phi) for r, phi in zip(times, cuts, strict=True))]
        marks.append(((stretch.duration, 0.0), stretch.stop))
        marks.sort(key=lambda mark: sense * mark[1])
        for k in range(len(marks) - 1):
            name = end if k == len(marks) - 2 else "contact-sign"
            self._done.append(self._piece(stretch, sense, marks[k], marks[k + 1], name, run.laps))
        self._arc += sense * stretch.direction * stretch.length

    def _piece(
        self, stretch: Segment, sense: int, start: tuple[Pair, float], stop: tuple[Pair, float], end: str, laps: int
    ) -> TimedSegment:
        return TimedSegment(
            segment=stretch,
            sense=sense,
            r_start=start[0],
            r_stop=stop[0],
            phi_start=start[1],
            phi_stop=stop[1],
            t_start=self._done[-1].t_stop if self._done else ZERO,
            s_a=self._arc if sense > 0 else self._arc - stretch.direction * stretch.length,
            end=end,
            laps=laps,
        )
