"""A body with losses, driven leg after leg along the curve, or by its distance from an equilibrium close by."""

from collections.abc import Callable
from math import inf

import numpy as np

from gqm_sym.errors import BudgetError, SolutionError
from gqm_sym.literals.numbers import Number
from gqm_sym.runtime.arithmetic.doubledouble import ULP
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.interface import Dissipation
from gqm_sym.runtime.launch.ends import leaving_at_once, starting_step
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.legs.advance import CREEPING_SHARE, END_OUT_OF_DOMAIN, END_OVERFLOW, END_REST
from gqm_sym.runtime.legs.answers import END_NEAR_EQUILIBRIUM, Track, drive_along
from gqm_sym.runtime.legs.body import (
    CONTACT_SIGN,
    DIRECTION,
    ELAPSED,
    ELAPSED_LOW,
    ENDING,
    FIRST_STEP,
    HIGH,
    LAM0,
    LAPS,
    LAST_AT,
    LEAST_SWING,
    LEG_TIME,
    LOW,
    MAY_END,
    NO_TURN_UNTIL,
    PANEL_COUNT,
    PAUSES,
    PERIOD,
    PLACE,
    PLACE_LOW,
    REACH,
    RETRY_WIDTH,
    STATUS,
    STEP,
    TOTAL,
    TURNS,
    V2,
    VALUE,
)
from gqm_sym.runtime.legs.conditions import FEW_PANELS, LEGS_PER_CALL, SMOOTH, FirstLegs, conditions_of
from gqm_sym.runtime.legs.endings import check_fall, check_steepness, cusp_ahead, end_name, failure, force_cancels
from gqm_sym.runtime.legs.frames.entering import LAST_DIGIT, Entry, entry_near
from gqm_sym.runtime.legs.frames.fitting import TryLater
from gqm_sym.runtime.legs.frames.local_frame import LEAST_RETRY_SHARE, RETRY_MARGIN, Frame
from gqm_sym.runtime.legs.frames.swings import may_have_died_away, move_swings, swings_per_call
from gqm_sym.runtime.legs.leg_record import (
    BEGIN,
    BEGIN_LOW,
    COLUMNS,
    END,
    END_LOW,
    HEADING,
    LAPS_BEFORE,
    MIDDLE,
    MIDDLE_LOW,
    START,
    START_LOW,
    START_V2,
)
from gqm_sym.runtime.legs.leg_segments import Run, Runs, TurnedLegs, panelled
from gqm_sym.runtime.legs.questions import LEGS, MAX_PAUSES, MAX_TURNS, RUN_AGAIN
from gqm_sym.runtime.legs.runs.ends import (
    END_ASYMPTOTE,
    END_LIMIT,
    END_PAUSE,
    END_RECORD_FULL,
    END_SLOW,
    END_TOO_MANY_PANELS,
    END_TOO_NARROW,
    END_TURN,
)
from gqm_sym.runtime.multiprecision.exact_problem import NOWHERE

# The largest number of panels of legs that are stored; each takes some kilobytes.
MAX_STORED = 250_000


# If a body creeps towards an equilibrium and no panel is narrow enough any more, its distance from the equilibrium is
# at most this share of its place, or of the length of the leg.
NEAR_EQUILIBRIUM = 1e-13


# The codes for the end of a leg that may have been followed without panels, by the data kept of gaps
# (`answers.follow_leg`).
PASSED = END_TURN, END_REST, END_LIMIT

# In a frame with breaks, panels keep away from them by a share of this many times the size of the motion, which is
# always far below the size of the motion then, and no swing is larger.
SWINGS_AHEAD = 4.0


class Driver:
    """A body that is driven by some more legs at each request.

    Parameters
    ----------
    problem : Problem
        The launch.
    horizon : float
        The time in s up to which all legs are needed; infinite if there is none.
    first : FirstLegs
        The first legs of the launch.

    Attributes
    ----------
    problem : Problem
    runs : Runs
        The runs so far that have not been removed from it.
    body : array
        The lines of the body (`legs.body`); the first one is its present state.
    ending : str
        The name of the end of the motion; empty as long as there is none.
    last_swing : float
        The distance of the last turn from the equilibrium, once the swing has died away.
    force_error : float
        The relative error of the force next to the unstable equilibrium of a frame.
    launch_error : float or None
        The error of the body's distance from there at launch.
    """

    ending = ""
    last_swing = 0.0
    force_error = 0.0
    launch_error: float | None = None
    _last_record: Array = np.empty(0)
    _frame: Frame | None = None
    _track_in_frame, _reach_in_frame = SMOOTH, 0.0
    # The place of a body that is followed by its distance from an equilibrium.
    _place_in_frame = 0.0
    # The number of panels for which a record has space, if it is not that of the conditions.
    _space = 0

    def __init__(self, problem: Problem, horizon: float, first: FirstLegs) -> None:
        self.problem, self._horizon, self.body = problem, horizon, first.body
        self._conditions = conditions_of(problem)
        self.runs = Runs()
        self._store(*self._completed(first.what, first.records))

    @property
    def dissipation(self) -> Dissipation:
        """The forces on the body."""
        return self._conditions.dissipation

    @property
    def track(self) -> Track:
        """The curve."""
        return self._conditions.track

    @property
    def place(self) -> float:
        """The place of the body, within one lap."""
        return self.number(PLACE) if self._frame is None else self._place_in_frame

    @property
    def reached(self) -> float:
        """The place up to which the body has been driven."""
        return self.place + self.number(LAPS) * self.problem.period

    @property
    def elapsed(self) -> float:
        """The time in s up to which the body has been driven."""
        elapsed: float = self.body.item(ELAPSED)
        return elapsed

    def number(self, at: int) -> float:
        """Return one of the numbers of the body (`legs.body`)."""
        number: float = self.body.item(at)
        return number

    @property
    def is_endless(self) -> bool:
        """Whether so many legs have been followed that no end of the motion is searched for any more."""
        number = self.body.item
        turns = number(TURNS)
        return bool((turns and not number(MAY_END)) or turns > MAX_TURNS or number(PAUSES) >= MAX_PAUSES)

    def go_on(self, legs: int = 1) -> None:
        """Follow the body to its next turn, to the end of the motion, or as far as one run goes; or by several legs, if
        there is a horizon, or as many are given.
        """
        number = self.body.item
        if number(PANEL_COUNT) >= MAX_STORED:
            if self._force_cancels(self._last_record):
                raise self._failure(self._last_record)
            raise BudgetError(
                f"motion: {number(PANEL_COUNT):.0f} pieces of legs reach t = {self.elapsed!r} only; "
                "give a shorter t_max, or ask for earlier times and nearer places"
            )
        self._store(*self._completed(*self._drive(LEGS_PER_CALL if self._horizon < inf else legs)))

    def _store(self, what: int, records: Array) -> None:
        """Store the runs of some legs, given the code for the end of the last of them (`advance`)."""
        number = self.body.item
        if what != END_TURN and not number(DIRECTION) and not number(TURNS):
            return  # the body stays where it is
        count, at = int(number(VALUE)), int(number(LAST_AT))
        line = records.reshape(-1)[: int(number(TOTAL))]
        if 2 * line.size < records.size:  # many legs take a small part of the space
            line = line.copy()
        conditions, frame = self._conditions, self._frame
        before = self.body[1 : 1 + count].copy() if conditions.passes and frame is None else None
        self._last_record = last = line[at:]
        if what == END_TURN and frame is None and not number(STATUS):
            # This avoids the constructor of a named tuple, which is slow.
            self.runs.append(tuple.__new__(TurnedLegs, (line, count, at, before, None)))
            return
        if count > 1:
            if frame is not None:
                move_swings(frame, line, count - 1)
            self.runs.append(TurnedLegs(line, count - 1, -1, before, frame))
        if what == END_PAUSE and frame is None and not number(STATUS) and not self._creeps(number):
            self.runs.append(tuple.__new__(Run, (last, what, "", None, None, None)))
        else:
            self._end_run(what, last, None if before is None else before[-1])

    def _creeps(self, number: Callable[[int], float]) -> bool:
        """Return whether a body without friction, of which some ``number`` is given, creeps towards an equilibrium."""
        return not self.dissipation.friction and number(STEP) <= CREEPING_SHARE * number(FIRST_STEP)

    def with_panels(self, run: Run) -> list[Run]:
        """Return a run divided into parts with panels; the run alone if its panels are known."""
        if run.before is None or run.has_rows:
            return [run.as_panels(self._horizon)]
        parts: list[Array] = []
        space, body = FEW_PANELS + self.track.breaks.size, run.before.reshape(1, -1).copy()
        left = abs(float(run.record[END] - run.record[START]))
        for _ in range(MAX_PAUSES):
            record = np.empty((1, space * COLUMNS))
            what = drive_along(self.track, self.dissipation, self._conditions.parameters, RUN_AGAIN, body, record)
            # A lap is long enough for a pause too, where the run comes to the end of the leg but for a rounding.
            part = abs(float(record[0, END] - record[0, START]))
            if what in PASSED or (what == END_PAUSE and abs(left - part) <= ULP * self.problem.period):
                return run.with_panels([*parts, panelled(record[0])], self._horizon, self.problem.period)
            if what == END_RECORD_FULL:
                space *= 4
            elif what in (END_PAUSE, END_SLOW):
                parts.append(record[0])
                left -= part
                if run.what == END_LIMIT:
                    body[0, REACH] = left  # the rest ends where the run did, and not a lap after this part
            else:
                break
        raise self._failure(record[0])

    def _end_run(self, what: int, record: Array, before: Array | None) -> None:
        """Store a run after which the body is followed in another way, or not at all."""
        problem, frame = self.problem, self._frame
        if frame is not None:
            frame.move(record, 1)
            self._place_in_frame = float(record[END])
        heading, at_limit = int(record[HEADING]), frame is not None and what == END_LIMIT
        is_inside = abs(self.body[0, PLACE]) < self._reach_in_frame
        if frame is not None and self.dissipation.friction and what == END_TURN and not self.number(ENDING):
            self._leave_frame(record)  # with friction it serves one leg
        elif frame is not None and frame.breaks.size and is_inside:
            self._limit_frame(frame)
            self.body[0, ENDING] = 0.0 if at_limit else self.body[0, ENDING]
        elif at_limit:
            self._leave_frame(record)
        if self._slides_nearby(what, record):
            self._store(*self._completed(*self._drive(1)))
            return
        self._decide_at_equilibrium(what, float(record[START]), float(record[END]))
        if what == END_OUT_OF_DOMAIN:
            raise leaving_at_once(problem, heading, "end of the domain")
        if frame is None and self.elapsed <= self._horizon:
            check_steepness(problem, what, record)
            creeps = what == END_PAUSE and self._creeps(self.number)
            if creeps or what in (END_TOO_NARROW, END_TOO_MANY_PANELS):
                check_fall(problem, record, self.number(V2), self.elapsed)
        name = "" if at_limit else end_name(problem, what, record)
        if name == "cusp" and what == END_TOO_NARROW:
            record[[MIDDLE, MIDDLE_LOW]] = record[[END, END_LOW]] = cusp_ahead(problem, record), 0.0
        # At a cusp dW/dlam vanishes, so that its rounding error is large compared with it there too.
        if what == END_TOO_MANY_PANELS or (what == END_TOO_NARROW and name != "cusp" and self._force_cancels(record)):
            raise self._failure(record)
        self.runs.append(Run(record, what, name, frame, before if what in PASSED else None))
        if self.number(ENDING):
            self.ending = name
        if what == END_OVERFLOW:
            raise SolutionError(
                f"the motion leaves the range of doubles at {problem.formulas.parameter} = {self.place!r}; "
                "give a shorter t_max"
            )

    def _drive(self, legs: int) -> tuple[int, Array]:
        """Follow the next legs; return the code for the end of the last of them (`advance`), and their records."""
        (dissipation, track, parameters, *_), frame = self._conditions, self._frame
        if frame is not None:
            legs = swings_per_call(frame) if legs > 1 else 1
            track, dissipation, parameters = self._track_in_frame, frame.dissipation, frame.p[None]
        records = np.empty((legs, (self._space or self._conditions.space) * COLUMNS))
        before = None if frame is None or legs == 1 else self.body.copy()
        what = drive_along(track, dissipation, parameters, LEGS, self.body, records)
        if frame is not None and before is not None:
            earlier = int(self.number(VALUE)) - 1
            if may_have_died_away(frame, records.reshape(-1), earlier):
                self.body[:] = before
                return self._drive(1)
        return what, records

    def _completed(self, what: int, records: Array) -> tuple[int, Array]:
        """Return the code and an array that begins with the records, after launching the body next to an equilibrium,
        or with larger records, if that is necessary.
        """
        while True:
            if what == END_NEAR_EQUILIBRIUM:
                self._launch_nearby()
            elif what != END_RECORD_FULL:
                return what, records
            elif self.body[0, VALUE]:
                return END_TURN, records
            else:
                self._space = 4 * (self._space or self._conditions.space)
            what, records = self._drive(1)

    def _decide_at_equilibrium(self, what: int, start: float, end: float) -> None:
        """Decide whether a run has come so close to an equilibrium that the motion ends there, or is followed in a
        frame.
        """
        in_frame, linear = self._frame is not None, self.dissipation.linear
        if what in (END_TURN, END_PAUSE) and self._has_died_away(start, end):
            self.ending = "asymptote"
        elif what == END_ASYMPTOTE and not linear:
            self.last_swing = NEAR_EQUILIBRIUM * max(abs(end), abs(end - start))
        elif not in_frame and not self.dissipation.friction:  # with friction it slides (`_slides_nearby`)
            turns_nearby = what == END_TURN and self.number(STATUS)
            if turns_nearby or (what == END_PAUSE and self._creeps(self.body.item)):
                self._enter_frame(width=abs(end - start))

    def _slides_nearby(self, what: int, record: Array) -> bool:
        """Return whether a leg from rest is so short that it loses digits, or cannot be followed, by places; from its
        start, the body is then followed by the distance from where sliding friction balances the other forces.
        """
        if self._frame is not None or not self.dissipation.friction:
            return False
        failed = what in (END_TOO_MANY_PANELS, END_TOO_NARROW)
        if record[START_V2] or not (failed or self.number(STATUS)):
            return False
        line, after = self.body[0], self.body[0].copy()
        line[[PLACE, PLACE_LOW, LAPS, DIRECTION]] = record[[START, START_LOW, LAPS_BEFORE, HEADING]]
        line[[ELAPSED, ELAPSED_LOW]] = record[[BEGIN, BEGIN_LOW]]
        line[[V2, CONTACT_SIGN, NO_TURN_UNTIL, LEG_TIME, ENDING]] = 0.0
        self._enter_frame()
        if self._frame is None:
            line[:] = after
        return self._frame is not None

    def _failure(self, record: Array) -> SolutionError:
        """Return the error that says why a leg could not be followed."""
        return failure(self.problem, record, cancels=self._force_cancels(record))

    def _force_cancels(self, record: Array) -> bool:
        """Return whether terms of the force cancel on a leg; in a frame they do not."""
        return self._frame is None and force_cancels(self.problem, record)

    def _has_died_away(self, start: float, end: float) -> bool:
        """Return whether the body is, or swings, so close to an equilibrium that its place does not show it any
        more.
        """
        frame = self._frame
        swing = max(abs(start), abs(end)) if frame is None else abs(self.body[0, PLACE])
        # From an unstable equilibrium the body departs, however near it turns.
        shown = LAST_DIGIT * abs(end) if frame is not None and frame.is_stable else 0.0
        if swing >= max(shown, LEAST_SWING):
            return False
        self.last_swing = swing
        return True

    def _launch_nearby(self) -> None:
        """Launch the body next to an equilibrium."""
        lam0 = self.problem.launch.lam0
        self.body[0, PLACE_LOW] = lam0.low
        self._enter_frame(lam0)
        if self._frame is None:
            self.body[0, PLACE_LOW] = 0.0
        else:  # the body is launched again, at its distance from the equilibrium
            self.body[0, STEP] = 0.0
            self.launch_error = ULP * abs(float(self.body[0, PLACE]))

    def _enter_frame(self, lam0: Number | None = None, width: float = 0.0) -> None:
        """From here on, follow the body by its distance from an equilibrium, if it is close to one and stays there for
        a while.

        A body does not stay near an unstable equilibrium, so this is done only for a launch there, at ``lam0``. If the
        last leg, of a given ``width``, was too wide, it is not tried again before that makes sense.
        """
        line = self.body[0]
        entry = entry_near(self.problem, self.dissipation, line, lam0)
        if isinstance(entry, TryLater):
            line[RETRY_WIDTH] = width * max(min(RETRY_MARGIN * entry.share, 1.0), LEAST_RETRY_SHARE)
        if not isinstance(entry, Entry):
            return
        self._frame, self._place_in_frame, self._reach_in_frame = entry.frame, float(line[PLACE]), entry.reach
        frame = entry.frame
        self._track_in_frame = Track(NOWHERE, frame.breaks, NOWHERE, NOWHERE)
        self.force_error = 0.0 if frame.is_stable else frame.error / frame.reach
        line[PLACE], line[PLACE_LOW], line[LAM0] = entry.distance, entry.low, entry.distance
        line[FIRST_STEP], line[PERIOD] = entry.reach, 0.0
        self._limit_frame(frame)

    def _limit_frame(self, frame: Frame) -> None:
        """Limit the distance from an equilibrium to which the body is followed; to the size of its motion if there are
        breaks.
        """
        line, reach = self.body[0], self._reach_in_frame
        if frame.breaks.size:
            reach = min(reach, SWINGS_AHEAD * frame.size(float(line[PLACE]), float(line[V2])))
        line[LOW], line[HIGH] = -reach, reach

    def _leave_frame(self, record: Array) -> None:
        """Return to following the body by its place; the record has places."""
        problem, line = self.problem, self.body[0]
        self._frame = None
        domain, step = problem.domain, starting_step(problem)
        line[PLACE], line[PLACE_LOW], line[ENDING] = record[END], record[END_LOW], 0.0
        line[LAM0], line[LOW], line[HIGH], line[PERIOD] = problem.lam0, domain.low, domain.high, domain.period
        line[FIRST_STEP], line[REACH] = step, domain.period or step
