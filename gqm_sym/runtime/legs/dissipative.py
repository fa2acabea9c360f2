"""Motions with friction, drag or resistance: leg after leg, each computed when it is needed."""

from bisect import bisect_right
from collections.abc import Callable, Sequence
from math import inf, isnan, nan
from typing import Any, NamedTuple

import numpy as np

from gqm_sym.runtime.compiled.threads import run_in_threads
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.gradients.quantities import selected
from gqm_sym.runtime.gradients.sensitivity import Sensitivity
from gqm_sym.runtime.inversion.leg_tables import place_on_leg, places_along_legs, state_on_leg, states_along_legs
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
from gqm_sym.runtime.legs.tabulation import TabulatedPiece, leg_record, tabulated
from gqm_sym.runtime.legs.variations.answers import (
    MarchPoints,
    Switch,
    gradient,
    nearest_switch,
    places_at,
    points_by_record,
    points_of,
    states_at,
    turning_points,
)
from gqm_sym.runtime.legs.variations.changes import Changes
from gqm_sym.runtime.motion.aperiodic import MotionAtRest
from gqm_sym.runtime.motion.events import Leg
from gqm_sym.runtime.motion.locking import computed_once, locked
from gqm_sym.runtime.motion.motion import Motion
from gqm_sym.runtime.motion.parts.history import merged
from gqm_sym.runtime.motion.rows import Rows
from gqm_sym.runtime.motion.sampler import (
    MIN_PLACES_PER_THREAD,
    MIN_STATES_PER_THREAD,
    STATE_ROWS,
    STATE_ROWS_IN_SPACE,
    plain_time,
    plain_times,
)
from gqm_sym.runtime.motion.state import State
from gqm_sym.runtime.motion.trajectory import TimedSegment

# When the record that compiled code reads is extended to later times, its number of pieces grows by this factor, so
# that successive questions do not copy it for each leg.
EXTENSION = 1.25


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
        motion.fill_launch_leg(places, v2)
    v2[places == launch.lam0.value] = launch.v0.value**2
    return v2


def _times_from_launch(t: Any) -> tuple[Array, float] | None:
    """Return an array of times from launch on as doubles, with the largest; None if they are not such numbers."""
    times = plain_times(t)
    return (times[0], times[2]) if times is not None and 0.0 <= times[1] <= times[2] < inf else None


class Reading(NamedTuple):
    """The record of a motion for compiled code.

    Attributes
    ----------
    record : array
        `leg_segments.leg_record`.
    until : float
        The time in s up to which it holds.
    since : float
        The time in s from which on it holds.
    pieces : sequence of TabulatedPiece
        The pieces that the record contains.
    """

    record: Array = np.empty(0)
    until: float = -1.0
    since: float = 0.0
    pieces: Sequence[TabulatedPiece] = ()

    def has(self, t: float, errors: bool) -> bool:
        """Return whether it holds up to a time, with all errors if these are required."""
        return t <= self.until and (self.pieces[-1].has_all_errors or not errors)


class DissipativeMotion(FollowedMotion):
    """A motion that loses energy, leg by leg until the body rests or leaves the track, or for ever.

    Each leg begins with V**2 = 0 at a turning point, so that its accuracy does not depend on the legs before it; times
    are summed as two doubles. Legs are computed when they are needed. Without ``t_max``, `legs` and `events` of a
    motion that never ends are those of its beginning, up to its first turn, whatever else has been computed.
    """

    _known_changes: Changes | None = None
    _reading = Reading()
    # The data of the first piece for which a single time was requested.
    _first_reading = Reading()

    @property
    @locked
    def t_end(self) -> float:
        """The time in s at which the body rests or leaves the track, or ``t_max``; infinite if there is neither."""
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
    @locked
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

    def lam(self, t: Any) -> Any:
        """Return the curve parameter at times; see `Motion.lam`. For doubles this is one call of compiled code."""
        one = self._one_time(t, errors=False)
        if one is not None:
            return place_on_leg(*one)
        times = _times_from_launch(t)
        if times is None:
            return super().lam(t)
        return self._read(*times, 1, self._read_places, super().lam)[0].reshape(times[0].shape)

    def state(self, t: Any) -> State:
        """Return the state of the body at times; see `Motion.state`. For doubles this is one call of compiled code."""
        one = self._one_time(t, errors=True)
        if one is not None:
            return self._state_at(state_on_leg(one[0], self.problem.functions.p, one[1]))
        times = _times_from_launch(t)
        if times is None:
            return super().state(t)

        def by_segments(later: Array) -> Array:
            return self._rows_of_states(*self._times(later)[:2])[:rows]

        rows = STATE_ROWS if self.problem.formulas.path_in_space is None else STATE_ROWS_IN_SPACE
        return self._state_of(times[0], self._read(*times, rows, self._read_states, by_segments))

    def error_bound(self, t: Any) -> Any:
        """Return a bound of the error of ``lam(t)``; see `Motion.error_bound`."""
        return self.state(t).error

    def _one_time(self, t: Any, errors: bool) -> tuple[Array, float] | None:
        """Return the record that compiled code reads at a single time, and the time; None for any other times."""
        time = plain_time(t)
        if time is None or not 0.0 <= time < inf:
            return None
        reading = self._reading_at(time, errors)
        return (reading.record, time) if time <= reading.until else None

    def _read(
        self,
        times: Array,
        greatest: float,
        rows: int,
        by_record: Callable[[Array, Array, Array], None],
        by_segments: Callable[[Array], Array],
    ) -> Array:
        """Return rows of numbers at times, as far as possible from the record that compiled code reads."""
        read = self._reading_at if times.size == 1 else self._reading_up_to
        record, until = read(greatest, rows > 1)[:2]
        times = times.reshape(-1)
        out = np.empty((rows, times.size))
        if greatest <= until:
            by_record(record, times, out)
            return out
        within = times <= until
        part = np.empty((rows, np.count_nonzero(within)))
        by_record(record, times[within], part)
        out[:, within], out[:, ~within] = part, by_segments(times[~within])
        return out

    def _read_places(self, record: Array, times: Array, out: Array) -> None:
        run_in_threads(
            lambda part: places_along_legs(record, times, out[0], part.start, part.stop),
            times.size,
            MIN_PLACES_PER_THREAD,
        )

    def _read_states(self, record: Array, times: Array, out: Array) -> None:
        p = self.problem.functions.p
        run_in_threads(
            lambda part: states_along_legs(record, p, times, out, part.start, part.stop),
            times.size,
            MIN_STATES_PER_THREAD,
        )

    def _reading_up_to(self, t: float, errors: bool) -> Reading:
        """Return the record for compiled code up to a time, or up to an approach to an equilibrium before it."""
        return self._reading if self._reading.has(t, errors) else self._extended(t, errors)

    def _reading_at(self, t: float, errors: bool) -> Reading:
        """Return the record for compiled code at one time.

        If only times on one piece are requested, one after the other, only that piece is tabulated.
        """
        first = self._first_reading
        if self._reading.has(t, errors=False):
            return self._reading_up_to(t, errors)
        is_first = first.since <= t < first.until and first.has(t, errors)
        return first if is_first else self._read_first(t, errors)

    @locked
    def _read_first(self, t: float, errors: bool) -> Reading:
        """Return the record of `_reading_at` after following the motion up to the time."""
        self._check_end(t)
        pieces, first = self._pieces, self._first_reading
        k = bisect_right(pieces, t, key=lambda timed: timed.t_stop[0])
        is_known = first.until >= 0.0
        if k == len(pieces) or pieces[k].segment.v2 is not None or (is_known and pieces[k].t_start[0] != first.since):
            return self._extended(t, errors)
        made = first.pieces if is_known else [tabulated(pieces[k], self.problem.period)]
        made = self._with_errors(made, pieces[k:]) if errors else made
        self._first_reading = Reading(self._record_of(made), pieces[k].t_stop[0], pieces[k].t_start[0], made)
        return self._first_reading

    def _with_errors(self, made: Sequence[TabulatedPiece], pieces: Sequence[TimedSegment]) -> list[TabulatedPiece]:
        """Return tabulated pieces with all errors."""
        return [
            piece
            if piece.has_all_errors
            else piece.with_errors(*self._errors_before(timed, 0.5 * (piece.edges[1:] + piece.edges[:-1])))
            for piece, timed in zip(made, pieces, strict=False)
        ]

    def _record_of(self, pieces: Sequence[TabulatedPiece]) -> Array:
        return leg_record(self.problem, self.direction * self.problem.launch.v0.value, pieces)

    @locked
    def _extended(self, t: float, errors: bool) -> Reading:
        """Return the record of `_reading_up_to` after following the motion up to the time."""
        self._check_end(t)
        before = self._reading
        if before.has(t, errors):  # another thread has extended it
            return before
        made = list(before.pieces)
        if t > before.until:
            self._follow_amply(EXTENSION * len(made))
            ahead = [timed for timed in self._pieces[len(made) :] if timed.segment.v2 is None]
            made += [tabulated(timed, self.problem.period) for timed in ahead]
        # Once errors have been requested, they are computed for later pieces too.
        errors = errors or (len(before.pieces) > 0 and before.pieces[0].has_all_errors)
        if len(made) > len(before.pieces) or (made and errors and not made[0].has_all_errors):
            made = self._with_errors(made, self._pieces) if errors else made
            until = min(self._known_end(), self._pieces[len(made) - 1].t_stop[0])
            self._reading = Reading(self._record_of(made), until, 0.0, made)
        return self._reading

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
        found = states_at(self._changes, points)
        fields = (getattr(found, name) for name in Sensitivity._fields[1:])
        return Sensitivity(tuple(rows), *(field[list(rows.values())].reshape(len(rows), *shape) for field in fields))

    @locked
    def place_changes(self, t: Any, wrt: Any) -> Array:
        """Return the derivatives of the curve parameter at given times; see `Motion.place_changes`."""
        rows = selected(self.problem.formulas.parameters, wrt)
        points, shape = self._march_points(t)
        found: Array = places_at(self, self._changes, points)[list(rows.values())].reshape(len(rows), *shape)
        self._check_known("sensitivity", rows, found)
        return found

    def _march_points(self, t: Any) -> tuple[MarchPoints, tuple[int, ...]]:
        """Return the points of the motion at times, and the shape of the times."""
        one = plain_time(t)
        given = _times_from_launch(t if one is None else [one])
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
            self._follow_next()
