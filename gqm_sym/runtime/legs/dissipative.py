"""Motions with friction, drag or resistance: leg after leg, each computed when it is needed."""

from collections.abc import Sequence
from math import isnan, nan
from typing import Any

import numpy as np

from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.gradients.quantities import selected
from gqm_sym.runtime.gradients.sensitivity import Sensitivity
from gqm_sym.runtime.launch.formulas import Formulas, ParameterValues
from gqm_sym.runtime.launch.problem import Problem, bind_all
from gqm_sym.runtime.launch.request import Launch
from gqm_sym.runtime.legs.followed import FollowedMotion
from gqm_sym.runtime.legs.leg_reading import place_at
from gqm_sym.runtime.legs.leg_record import (
    BEGIN,
    BEGIN_LOW,
    LAPS_BEFORE,
)
from gqm_sym.runtime.legs.leg_segments import TURN, Run
from gqm_sym.runtime.legs.variations.answers import (
    MarchPoints,
    Switch,
    gradient,
    nearest_switch,
    places_at,
    points_by_record,
    points_of,
    sensitivities_at,
    turning_points,
)
from gqm_sym.runtime.legs.variations.changes import Changes
from gqm_sym.runtime.motion.at_rest import MotionAtRest
from gqm_sym.runtime.motion.events import Leg
from gqm_sym.runtime.motion.locking import computed_once, kept, locked
from gqm_sym.runtime.motion.motion import Motion
from gqm_sym.runtime.motion.parts.history import merged
from gqm_sym.runtime.motion.parts.tabulated import times_from_launch
from gqm_sym.runtime.motion.rows import Rows
from gqm_sym.runtime.motion.sampler import (
    plain_time,
)


def dissipate(formulas: Formulas, p: ParameterValues, launch: Launch) -> Motion:
    """Return the motion of a launch with dissipative forces."""
    problem = Problem(formulas, launch, p, formulas.domain(p), bind_all(formulas, p))
    motion = DissipativeMotion(problem)
    return motion if motion.direction else MotionAtRest(problem)


def launch_leg(formulas: Formulas, p: ParameterValues, launch: Launch, places: Array) -> Array:
    """Return V**2 at places of the launch leg, through changes of contact sign up to its first turn; NaN elsewhere."""
    motion = dissipate(formulas, p, launch)
    v2 = np.full(places.shape, np.nan)
    if isinstance(motion, DissipativeMotion):
        motion._fill_launch_leg(places, v2)
    v2[places == launch.lam0.value] = launch.v0.value**2
    return v2


class DissipativeMotion(FollowedMotion):
    """A motion that loses energy, leg by leg until the body rests or leaves the track, or for ever.

    Each leg begins with V**2 = 0 at a turning point, so that its accuracy does not depend on the legs before it; times
    are summed as two doubles. Legs are computed when they are needed. Without ``t_max``, `legs` and `events` of a
    motion that never ends are those of its beginning, up to its first turn, whatever else has been computed.
    """

    _known_changes: Changes | None = None

    @property
    @locked
    def t_end(self) -> float:
        """The time in s at which the body rests or leaves the track, or ``t_max``; infinite if there is neither.

        It is also infinite if no loss of energy shows in doubles.

        Raises
        ------
        BudgetError
            If the body turns more than a million times, and there is no ``t_max``.
        """
        return self._end_of(self._driver_at_end)

    def _last_end(self) -> tuple[str, float]:
        driver = self._driver_at_end
        return super()._last_end() if driver is self._driver else (driver.ending, driver.reached)

    @locked
    def _end_of_legs(self) -> float:
        self._look_ahead()
        return self._known_end()

    @property
    @locked
    def turning_points(self) -> tuple[float, ...]:
        """The turning points on `legs` in the order of time; the place of a launch from rest is one."""
        self._look_ahead()
        turns = [leg.lam_end for leg in self._runs_as_legs() if leg.end == "turn" and leg.t_end <= self._horizon]
        return (*((self.problem.lam0,) if self.problem.w0 == 0.0 else ()), *turns)

    @property
    @kept
    def legs(self) -> tuple[Leg, ...]:
        """The legs of the motion in the order of time; see `Motion.legs`."""
        self._look_ahead()
        cuts_at_changes = "contact-sign" not in self._internal_ends
        if self._driver.track.corners.size or (cuts_at_changes and self._has_changes()):
            return super().legs
        return Rows(self._up_to_horizon(merged(self._runs_as_legs(), self._internal_ends)))

    def _place_on_last_leg(self, t: float) -> float:
        record = self._driver.runs.last_turned
        place = self._place_on(record, t) if record is not None and record[BEGIN] <= t else nan
        if isnan(place):
            run = next(run for run in reversed(self._all_runs) if run.record[BEGIN] <= t)
            place = self._place_on(run.record if run.passed is None else run.passed, t)
            if isnan(place):  # if the leg has no panels, it alone is followed once more
                parts = [run] if run.before is None else self._driver.with_panels(run)
                place = self._place_on(next(part.record for part in reversed(parts) if part.record[BEGIN] <= t), t)
        return float(self.lam(t)) if isnan(place) else place

    def _place_on(self, record: Array, t: float) -> float:
        """Return the place at a time on a leg; NaN if its record does not determine it."""
        place = place_at(record, (t - record[BEGIN]) - record[BEGIN_LOW])
        return float(place + record[LAPS_BEFORE] * self.problem.period)

    @locked
    def _gradient(self, quantity: str, wrt: Any) -> dict[str, Any]:
        rows = selected(self.problem.formulas.parameters, wrt)
        self._look_ahead()
        if quantity == "turning_points":
            columns = self._turning_changes
            return {name: columns[row] if columns else () for name, row in rows.items()}
        found = gradient(self, quantity).tolist()
        return {name: found[row] for name, row in rows.items()}

    @locked
    def _sensitivity(self, t: Any, wrt: Any) -> Sensitivity:
        rows = selected(self.problem.formulas.parameters, wrt)
        points, shape = self._march_points(t)
        found = sensitivities_at(self._changes_at(points), points, list(rows.values()))
        return Sensitivity(tuple(rows), *found.reshape(len(found), len(rows), *shape))

    @locked
    def place_changes(self, t: Any, wrt: Any = None) -> Array:
        """Return the derivatives of the curve parameter at given times; see `Motion.place_changes`."""
        rows = selected(self.problem.formulas.parameters, wrt)
        points, shape = self._march_points(t)
        found = places_at(self, self._changes_at(points), points, list(rows.values())).reshape(len(rows), *shape)
        self._check_known("sensitivity", rows, found)
        return found

    def _march_points(self, t: Any) -> tuple[MarchPoints, tuple[int, ...]]:
        """Return the points of the motion at times, and the shape of the times."""
        one = plain_time(t)
        given = times_from_launch(t if one is None else [one])
        if given is not None:
            times, greatest = given
            reading = (self._reading_at if times.size == 1 else self._reading_up_to)(greatest, errors=False)
            if greatest <= reading.until:
                shape = times.shape if one is None else ()
                return points_by_record(reading.record, reading.pieces, times.reshape(-1)), shape
        times, low, shape = self._times(t)
        self._trajectory(float(times.max(initial=0.0)))
        found = self._phase_points(times, low)
        return points_of(found, self._velocities(found)), shape

    @property
    @locked
    def nearest_switch(self) -> Switch | None:
        """The turn at which the motion is nearest to another number of legs; see `Motion.nearest_switch`."""
        turns = [leg for leg in self.legs if leg.end in ("turn", "rest")]
        functions = self.problem.functions
        return nearest_switch(self._driver.dissipation.static_balance, functions.p, turns, self.problem.period)

    @property
    def _changes(self) -> Changes:
        """The derivatives of the legs so far."""
        return self._changes_along(self._varied_runs)

    def _changes_at(self, points: MarchPoints) -> Changes:
        """Return the derivatives of the legs up to the last of some points at least."""
        known, count, runs = self._known_changes, int(points.half.max(initial=0)) // 2 + 1, self._layout.runs
        followed = 0 if known is None else known.followed
        # Each time many more are followed, lest later and later points are asked for one by one.
        return self._changes_along(runs[: count if followed >= count else max(count, 2 * followed)])

    def _changes_along(self, runs: Sequence[Run]) -> Changes:
        """Return the derivatives of the first runs."""
        known = self._known_changes
        if known is None or known.followed < len(runs):
            known = self._known_changes = Changes(self.problem, runs)
        return known

    @property
    def _varied_runs(self) -> list[Run]:
        """The runs so far, with panels along charts, where they are followed in as many parts as necessary."""
        if self.problem.formulas.chart is not None:
            self._follow_again()
        return self._all_runs

    @computed_once
    def _turning_changes(self) -> list[tuple[float, ...]]:
        """The derivatives of the turning points with respect to each variable; empty if there are no such points."""
        return list(zip(*turning_points(self), strict=True))

    def _turns_with_runs(self) -> tuple[list[int], list[Run]]:
        """Return the numbers of the runs at the ends of which are the turning points of the motion, without the launch,
        and the runs up to the last of them.
        """
        runs = self._varied_runs
        turns = [k for k, run in enumerate(runs[: self._beginning or None]) if run.end == TURN]
        if turns and turns[-1] + 1 == len(runs) and self._driver.elapsed > self._horizon:
            turns.pop()
        return turns, runs[: turns[-1] + 1] if turns else []

    def _fill_launch_leg(self, places: Array, v2: Array) -> None:
        """Fill in V**2 at the places that lie on the launch leg."""
        done, lap, laps = 0, self.problem.period, 0.0
        order = np.argsort(places, kind="stable")
        ordered, squares = places[order], v2[order]
        within = ordered
        while True:
            for piece in self._pieces[done:]:
                segment = piece.segment
                if piece.laps != laps:
                    laps, within = piece.laps, ordered - piece.laps * lap
                first = int(np.searchsorted(within, min(segment.a, segment.b)))
                last = int(np.searchsorted(within, max(segment.a, segment.b), side="right"))
                on = first + np.flatnonzero(np.isnan(squares[first:last]))
                if on.size:
                    phi = segment.phase_angles_of(within[on])
                    squares[on] = segment.speeds(np.minimum(phi, segment.stop)) ** 2
                if piece.end not in ("", "contact-sign"):
                    v2[order] = squares
                    return
            done = len(self._pieces)
            if not self._is_ahead(places):
                v2[order] = squares
                return
            self._follow_next()
