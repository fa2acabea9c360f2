"""A motion with losses as far as it has been followed: its legs, their segments, and the errors with which they
begin.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from copy import copy
from functools import partial
from math import inf, isfinite

import numpy as np

from gqm_sym.errors import BudgetError, InputError, SolutionError
from gqm_sym.runtime.arithmetic.doubledouble import Pair
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.legs.body import DIRECTION, MAY_END, PANEL_COUNT, PAUSES, STATUS, TURNS, VALUE
from gqm_sym.runtime.legs.conditions import follow_first_legs
from gqm_sym.runtime.legs.driver import Driver
from gqm_sym.runtime.legs.inherited import InheritedErrors
from gqm_sym.runtime.legs.layout import Layout
from gqm_sym.runtime.legs.leg_record import HEADING
from gqm_sym.runtime.legs.leg_segments import Run, Runs
from gqm_sym.runtime.legs.questions import MAX_PAUSES, MAX_TURNS, may_still_end, turns_at_this_rate
from gqm_sym.runtime.legs.runs.ends import END_TURN
from gqm_sym.runtime.motion.events import Leg, passages
from gqm_sym.runtime.motion.locking import computed_once
from gqm_sym.runtime.motion.motion import Motion
from gqm_sym.runtime.motion.parts.tabulated import Tabulated
from gqm_sym.runtime.motion.trajectory import PhasePoints, TimedSegment, Trajectory

# The number of legs that are followed in one call once a body swings, where the end of its motion is searched for.
LEGS_OF_SWINGS = 64


class FollowedMotion(Tabulated, Motion):
    """A motion that loses energy, followed as far as required; `DissipativeMotion` answers the questions about it."""

    _whole: Trajectory | None = None
    # The number of runs up to the first turn, 0 before it is known; and whether the motion is known to have no end.
    _runs_to_turn, _has_no_end = 0, False

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem, "dissipative", problem.launch.direction)
        self._first = first = follow_first_legs(problem, self._horizon)
        number = first.body.item
        if number(VALUE) > 1.0 or (first.what == END_TURN and not number(STATUS)):
            heading = first.records.item(HEADING)
        else:  # the leg is stored at once, so that an impossible launch is refused
            runs = self._driver.runs.all()
            heading = runs[0].record[HEADING] if runs else 0
        if problem.w0 == 0.0:
            self.direction = int(heading)

    @computed_once
    def _driver(self) -> Driver:
        """The body, which has been driven along the first legs."""
        return Driver(self.problem, self._horizon, self._first)

    # -- what `Motion` needs ------------------------------------------------------------------

    @property
    def _internal_ends(self) -> tuple[str, ...]:
        return ("",) if self._driver.dissipation.friction else ("", "contact-sign")

    def _trajectory(self, reach: float) -> Trajectory:
        self._follow(reach)
        if self._whole is None or len(self._whole.segments) != len(self._pieces):
            self._whole = Trajectory(segments=tuple(self._pieces), lap=self.problem.period)
        return self._whole

    def _up_to_turn(self, turns: int) -> Trajectory | None:
        driver = self._driver
        while driver.number(TURNS) < turns:
            if driver.ending or driver.number(PAUSES) >= MAX_PAUSES:
                return None
            self._follow_next()
        segments = self._lay(lambda laid: len(_turns_of(laid)) >= turns)
        ends = _turns_of(segments)
        if len(ends) < turns:
            return None
        return Trajectory(segments=tuple(segments[: ends[turns - 1] + 1]), lap=self.problem.period)

    def _history(self) -> tuple[TimedSegment, ...]:
        self._look_ahead()
        segments = self._trajectory(0.0).segments
        return tuple(timed for timed in segments if timed.leg < self._beginning) if self._beginning else segments

    def _contact_changes(self, piece: TimedSegment) -> list[tuple[Pair, float]]:
        return []  # segments end there

    def _check_end(self, t: float) -> None:
        self._follow(t)
        driver, end = self._driver, self._known_end()
        if t > end:
            raise InputError(f"t: the motion ends at {end!r} s ({self._end_text()}), got {t!r}")
        if driver.ending == "asymptote" and not driver.last_swing and t > self._pieces[-1].t_stop[0]:
            raise SolutionError(
                f"t = {t!r}: by then the body is closer to the equilibrium at "
                f"{self.problem.formulas.parameter} = {driver.place!r} than doubles can tell"
            )

    def _phase_points(self, t: Array, t_low: Array) -> PhasePoints:
        if not self._driver.last_swing:
            return super()._phase_points(t, t_low)
        # After a swing has died away, the body stays where it turned last.
        last, last_low = self._pieces[-1].t_stop
        return super()._phase_points(np.minimum(t, last), np.where(t < last, t_low, last_low))

    def _time_error(self, t: Array) -> Array:
        return np.zeros_like(t)

    def _errors_before(self, timed: TimedSegment, phi: Array) -> tuple[float, Array]:
        return self._inherited.before(timed, phi)

    def _end_text(self) -> str:
        driver = self._driver
        if not driver.ending or driver.elapsed > self._horizon:
            return super()._end_text()
        return f"{driver.ending} at {self.problem.formulas.parameter} = {driver.reached!r}"

    def _first_passages(self, lam: float, low: float) -> list[float]:
        done, driver = 0, self._driver
        while True:
            segments = tuple(self._lay(partial(_are_more, than=done)))
            if len(segments) > done:
                trajectory = Trajectory(segments=segments, lap=self.problem.period)
                found = passages(segments[done:], trajectory, lam, low)
                if found:
                    return found
                done = len(segments)
                continue
            # A body that has turned at two points reaches no place outside of them any more.
            settled = driver.number(TURNS) >= (1.0 if self.problem.w0 == 0.0 else 2.0)
            if driver.ending or settled or driver.elapsed >= self._horizon:
                return []
            self._follow_next()

    # -- leg after leg ------------------------------------------------------------------------

    @computed_once
    def _layout(self) -> Layout:
        """The segments so far of runs that have been laid."""
        return Layout(self.problem.functions)

    @computed_once
    def _inherited(self) -> InheritedErrors:
        """The errors with which the legs begin."""
        return InheritedErrors(self._driver, self._layout.runs)

    @property
    def _pieces(self) -> list[TimedSegment]:
        """All segments so far."""
        return self._lay(lambda _: False)

    def _pieces_up_to(self, t: float) -> Sequence[TimedSegment]:
        return self._lay(lambda laid: bool(laid) and laid[-1].t_stop[0] > t)

    def _lay(self, are_enough: Callable[[list[TimedSegment]], bool]) -> list[TimedSegment]:
        """Return the segments from launch. Of the runs so far, as many are laid as are needed for enough segments."""
        layout, runs, done = self._layout, self._driver.runs.all(), 0
        try:
            while done < len(runs) and not are_enough(layout.segments):
                for part in self._in_parts(runs[done], len(layout.runs)):
                    layout.lay(part)
                done += 1
        finally:
            self._driver.runs.replace(runs[done:])
        return layout.segments

    def _in_parts(self, run: Run, number: int) -> list[Run]:
        """Return a run with panels, for which it is followed once more if it has none, in as many parts as necessary;
        ``number`` is that of the runs before it.
        """
        if run.has_panels:
            return [run]
        parts = self._driver.with_panels(run)
        if number < self._runs_to_turn:
            self._runs_to_turn += len(parts) - 1
        return parts

    @property
    def _all_runs(self) -> list[Run]:
        """The runs so far."""
        layout: Layout | None = self.__dict__.get("_layout")
        runs = self._driver.runs.all()
        return runs if layout is None else [*layout.runs, *runs]

    def _runs_as_legs(self) -> list[Leg]:
        """Return the runs of `legs`, which are not cut at changes of the contact sign and at corners."""
        found, stop, lap = [], self._driver.elapsed, self.problem.period
        for part in reversed([*self._layout.runs, *self._driver.runs.parts]):
            legs = part.legs(lap, stop)
            found.append(legs)
            stop = legs[0].t_start
        shown = [leg for legs in reversed(found) for leg in legs]
        return shown[: self._beginning or None]

    def _has_changes(self) -> bool:
        """Return whether N changes its sign on a run of `legs`."""
        parts = [*self._layout.runs, *self._driver.runs.parts]
        return any([count for part in parts for count in part.change_counts][: self._beginning or None])

    def _known_end(self) -> float:
        """Return the time at which the motion ends, as far as is known; infinite if it is not."""
        return self._end_of(self._driver)

    def _end_of(self, driver: Driver) -> float:
        ends = driver.ending not in ("", "asymptote")
        return min(self._horizon, driver.elapsed if ends else inf)

    @property
    def _beginning(self) -> int:
        """The number of runs up to the first turn of a motion for which `_look_ahead` finds no end; 0 as long as that
        is not known.
        """
        if not self._has_no_end and self._horizon == inf:
            driver = self._driver
            if not self._runs_to_turn and (driver.number(TURNS) or driver.is_endless):
                self._runs_to_turn = len(self._layout.runs) + len(driver.runs)
            self._has_no_end = not driver.ending and driver.is_endless
        return self._runs_to_turn if self._has_no_end else 0

    def _follow_next(self, legs: int = 1) -> None:
        """Follow the body to its next turn, to the end of the motion, or as far as one run goes; or by several legs."""
        _ = self._beginning  # the runs up to the first turn are counted before there are more
        self._driver.go_on(legs)

    def _follow(self, reach: float) -> None:
        """Compute legs up to a time in s, and up to the horizon if there is one."""
        if isfinite(self._horizon):
            reach = max(reach, self._horizon)
        while not self._driver.ending and self._driver.elapsed < reach:
            self._follow_next()

    def _follow_amply(self, enough: float) -> None:
        """Follow the motion until there are enough pieces, or as far as it can be followed."""
        with suppress(SolutionError, BudgetError):  # the error is raised when the failed part is requested
            while len(self._pieces) < enough and not self._driver.ending and self._driver.elapsed < self._horizon:
                self._follow_next()

    def _look_ahead(self) -> None:
        """Compute the whole motion if it ends, and at least its first leg if it does not."""
        driver, horizon = self._driver, self._horizon
        if horizon < inf:
            while not driver.ending and driver.elapsed < horizon:
                driver.go_on()
            return
        while not driver.ending and not self._beginning:
            self._follow_next(1 if driver.number(TURNS) < 2.0 else LEGS_OF_SWINGS)

    @computed_once
    def _driver_at_end(self) -> Driver:
        """The body at the end of its motion; it is followed to there without storing its legs, if they are many.

        Raises
        ------
        BudgetError
            If it turns too often for that.
        """
        self._look_ahead()
        driver = self._driver
        if driver.ending or self._horizon < inf or not driver.number(MAY_END) or driver.number(TURNS) <= MAX_TURNS:
            return driver
        driver = copy(driver)
        driver.body = driver.body.copy()
        while not driver.ending and may_still_end.py_func(driver.body[0]):
            driver.runs, driver.body[0, PANEL_COUNT] = Runs(), 0.0
            driver.go_on(LEGS_OF_SWINGS)
        turns = driver.number(TURNS)
        if not driver.ending and driver.number(MAY_END) and (rate := turns_at_this_rate.py_func(driver.body[0])) < inf:
            expected = f"and at this rate would swing on for some {rate:.1e} turns; " if rate else ""
            raise BudgetError(
                f"motion: after {turns:.0f} turns, at t = {driver.elapsed!r}, the body has not come to an end, "
                f"{expected}give a horizon, t_max"
            )
        return driver

    def _follow_again(self) -> None:
        """Follow the runs without panels once more for their panels, each in as many parts as necessary."""
        runs = list[Run]()
        for run in self._driver.runs.all():
            runs += self._in_parts(run, len(self._layout.runs) + len(runs))
        self._driver.runs.replace(runs)

    def _is_ahead(self, places: Array) -> bool:
        """Return whether one of the places lies ahead of the part that has been computed."""
        return bool(np.any((places - self._driver.reached) * self._driver.number(DIRECTION) > 0.0))


def _turns_of(segments: Sequence[TimedSegment]) -> list[int]:
    """Return the numbers of the segments that end at turns."""
    return [k for k, timed in enumerate(segments) if timed.end == "turn"]


def _are_more(segments: Sequence[TimedSegment], than: int) -> bool:
    return len(segments) > than
