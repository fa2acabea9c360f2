"""Motions with friction, drag or resistance: leg after leg, each computed when it is needed."""

from bisect import bisect_right
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from itertools import pairwise
from math import inf, isfinite, isnan, nan
from typing import Any, NamedTuple

import numpy as np

from gqm_sym.errors import BudgetError, InputError, LaunchError, SolutionError
from gqm_sym.literals.numbers import Number
from gqm_sym.runtime.arithmetic.doubledouble import ULP, ZERO, Pair
from gqm_sym.runtime.compiled.threads import run_in_threads
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.gradients.quantities import selected
from gqm_sym.runtime.gradients.sensitivity import Sensitivity
from gqm_sym.runtime.interface import Dissipation, ExactLaw
from gqm_sym.runtime.inversion.leg_tables import places_along_legs, states_along_legs
from gqm_sym.runtime.launch.ends import CUSP_SHARE, domain_end, leaving_at_once, starting_step
from gqm_sym.runtime.launch.formulas import Formulas, ParameterValues
from gqm_sym.runtime.launch.problem import Problem, bind_all
from gqm_sym.runtime.launch.request import ONLY_SIGN, Launch
from gqm_sym.runtime.launch.speed import path_and_force_at
from gqm_sym.runtime.legs.advance import AT_ONCE, BEYOND, CREEPING_SHARE, LEAVES, RESTS
from gqm_sym.runtime.legs.answers import (
    FIRST_LEGS,
    LEAST_SWING,
    LEGS,
    MAX_PAUSES,
    MAX_TURNS,
    NEARBY,
    RUN_AGAIN,
    Track,
    drive_along,
)
from gqm_sym.runtime.legs.body import (
    DIRECTION,
    ELAPSED,
    ENDING,
    FIRST_STEP,
    HIGH,
    LAM0,
    LAPS,
    LOW,
    MAY_REST,
    PANEL_COUNT,
    PAUSES,
    PERIOD,
    PLACE,
    PLACE_LOW,
    REACH,
    STATUS,
    STEP,
    TURNS,
    V2,
    VALUE,
    launched,
)
from gqm_sym.runtime.legs.frames.local_frame import PLACE as PLACE_IN_FRAME
from gqm_sym.runtime.legs.frames.local_frame import SMALL_SHARE, Frame, frame_near, is_small, refined, sharpened
from gqm_sym.runtime.legs.leg_errors import Errors, carry, rounding_share
from gqm_sym.runtime.legs.leg_reading import place_at
from gqm_sym.runtime.legs.leg_record import (
    BEGIN,
    BEGIN_LOW,
    CHANGE_COUNT,
    COLUMNS,
    END,
    END_LOW,
    HEADING,
    INHERITED,
    LAPS_BEFORE,
    MIDDLE,
    START,
    TIME_FROM_END,
    TIME_FROM_START,
)
from gqm_sym.runtime.legs.leg_run import ASYMPTOTE, FULL, LIFTOFF, LIMIT, NARROWED, PAUSED, SLOWED, SPENT, TURN
from gqm_sym.runtime.legs.leg_segments import Run, TabulatedPiece, along_field, along_panels, leg_record, tabulated
from gqm_sym.runtime.legs.variations.answers import Switch, gradient, nearest_switch, places_at, states_at
from gqm_sym.runtime.legs.variations.changes import Changes
from gqm_sym.runtime.legs.variations.equation import Law
from gqm_sym.runtime.motion.aperiodic import MotionAtRest
from gqm_sym.runtime.motion.events import Leg, passages
from gqm_sym.runtime.motion.locking import locked
from gqm_sym.runtime.motion.motion import Motion
from gqm_sym.runtime.motion.parts.history import merged
from gqm_sym.runtime.motion.rows import Rows
from gqm_sym.runtime.motion.sampler import (
    MIN_PLACES_PER_THREAD,
    MIN_STATES_PER_THREAD,
    STATE_ROWS,
    plain_time,
    plain_times,
)
from gqm_sym.runtime.motion.segments.segment import Segment
from gqm_sym.runtime.motion.state import State
from gqm_sym.runtime.motion.trajectory import PhasePoints, TimedSegment, Trajectory
from gqm_sym.runtime.multiprecision.exact_problem import NOWHERE

# The most panels of legs that are stored; each takes some kilobytes.
MAX_STORED = 250_000

# When the record that compiled code reads is made anew for later times, it has this many times the pieces, so that many
# questions one after the other do not copy it for each leg.
EXTENSION = 1.25

# How many panels a record has space for beside one for each break; a leg with more is followed again with a larger
# record. How many legs are followed in one call of a motion that has a horizon, whose legs are all needed.
FEW_PANELS, LEGS_PER_CALL = 12, 8

# A change of the contact force's sign this many roundings from the end of a piece is there.
END_ROUNDINGS = 8.0

# A swing about an equilibrium has died away when it is below this share of the last digit of its place, or below
# `LEAST_SWING`.
LAST_DIGIT = ULP / 64.0

# A body that creeps towards an equilibrium, and for which no panel is narrow enough any more, is no farther from it
# than this share of its place and of the length of the leg.
NEAR_EQUILIBRIUM = 1e-13

# How near to an unstable equilibrium a body may be launched from rest, as a share of its place, where what resists the
# body is no product of a factor and V**2: it is a difference of forces there that agree to a rounding.
NEAREST_SHARE = 1e-20

# What ends a leg along a chart that may have been passed by what is kept of the curve (`answers.follow_leg`).
PASSED = TURN, RESTS, LIMIT

# The names of what ends a run, where the code alone says it.
END_NAMES = {
    TURN: "turn",
    RESTS: "rest",
    LIFTOFF: "liftoff",
    AT_ONCE: "liftoff",
    ASYMPTOTE: "asymptote",
}


def dissipate(formulas: Formulas, p: ParameterValues, launch: Launch) -> Motion:
    """The motion of a launch where forces dissipate."""
    problem = Problem(formulas, launch, p, bind_all(formulas, p), formulas.domain(p))
    motion = DissipativeMotion(problem)
    return motion if motion.direction else MotionAtRest(problem)


def launch_leg(formulas: Formulas, p: ParameterValues, launch: Launch, places: Array) -> Array:
    """V**2 at places of the launch leg, through changes of contact sign up to its first turn; NaN elsewhere."""
    motion = dissipate(formulas, p, launch)
    v2 = np.full(places.shape, np.nan)
    if isinstance(motion, DissipativeMotion):
        motion.fill_launch_leg(places, v2)
    v2[places == launch.lam0.value] = launch.v0.value**2
    return v2


def _plain_times(t: Any) -> tuple[Array, float, float] | None:
    """Times from launch on as doubles, with the least and the greatest; None if they are not that."""
    time = plain_time(t)
    times = plain_times(t) if time is None else (np.array([time]), time, time)
    return times if times is not None and 0.0 <= times[1] <= times[2] < inf else None


def _known(errors: tuple[float, float, float]) -> Errors:
    """Bounds of errors, which are infinite where they come out as no numbers."""
    return Errors(*(inf if isnan(error) else error for error in errors))


def _loss(problem: Problem) -> Dissipation:
    """The dissipation of the model."""
    loss = problem.functions.dissipation
    assert loss is not None
    return loss


def _track(problem: Problem) -> Track:
    """The curve of a motion, with all places where it, or its chart, is not smooth."""
    f = problem.functions
    return Track(f.chart, f.joints, f.corners, f.drops(ONLY_SIGN[problem.launch.contact])) if f.chart.size else SMOOTH


# Curves with formulas are smooth, and so is any curve next to an equilibrium (`Frame`).
SMOOTH = Track(NOWHERE, NOWHERE, NOWHERE, NOWHERE)


class Reading(NamedTuple):
    """What compiled code reads of a motion.

    Attributes
    ----------
    record : array
        `leg_segments.leg_record`.
    until : float
        The time in s up to which it holds.
    since : float
        The time in s from which on it holds.
    pieces : sequence of TabulatedPiece
        What it is made of.
    """

    record: Array = np.empty(0)
    until: float = -1.0
    since: float = 0.0
    pieces: Sequence[TabulatedPiece] = ()

    def has(self, t: float, errors: bool) -> bool:
        """Whether it holds up to a time, with all errors if these are asked for."""
        return t <= self.until and (self.pieces[-1].has_all_errors or not errors)


class DissipativeMotion(Motion):
    """A motion that loses energy: leg after leg, until the body rests or leaves the track, or for ever.

    Each leg begins with V**2 = 0 at a turning point, so that its accuracy does not depend on the legs before it; times
    are summed as two doubles. Legs are computed when they are needed. Without ``t_max``, `legs` and `events` of a
    motion that never ends are those of its beginning, up to its first turn, whatever else has been computed.
    """

    _ending = ""
    # How far from the equilibrium the body turned last, once its swing has died away.
    _last_swing = 0.0
    # By what share the force next to the unstable equilibrium of a frame may be wrong.
    _force_error = 0.0
    # What its distance from there may be wrong by at launch.
    _launch_error: float | None = None
    _arc = 0.0
    _whole: Trajectory | None = None
    _known_changes: Changes | None = None
    _reading = Reading()
    # What is read of the first piece that one time was asked of.
    _first_reading = Reading()
    # How many runs `_look_ahead` computes of a motion that it finds no end of; 0 while that is not known.
    _beginning = 0

    def __init__(self, problem: Problem) -> None:
        self._runs: list[Run] = []
        self._segments: list[TimedSegment] = []
        self._laid: list[Run] = []
        # For each panel of runs how large the terms of the force are that may cancel.
        self._terms: list[Array] = []
        launch, domain = problem.launch, problem.domain
        super().__init__(problem, "dissipative", launch.direction)
        self._dissipation, self._track = _loss(problem), _track(problem)
        # If legs are passed by what is kept of the curve, and may have to be followed again.
        self._passes = passes = self._track.is_kept(self._dissipation)
        self._space = FEW_PANELS + (0 if passes else self._track.breaks.size)
        ends, asked = domain.numbers[:3], (ONLY_SIGN[launch.contact], self._horizon, nan)
        given = (launch.lam0.value, *ends, launch.direction, *asked, problem.w0)
        self._body = launched((given,), LEGS_PER_CALL if passes else 0)
        self._at: list[float] = []
        self._frame: Frame | None = None
        # The errors with which the legs begin, once they are asked for.
        self._errors: list[Errors] = []
        self._go_on()
        self.direction = int(self._runs[0].record[HEADING]) if self._runs else 0

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
        """The turning points on `legs` in the order of time; the place of a launch from rest is one."""
        self._look_ahead()
        turns = [leg.lam_end for leg in self._up_to_horizon(self._runs_as_legs()) if leg.end == "turn"]
        return (*((self.problem.lam0,) if self.problem.w0 == 0.0 else ()), *turns)

    @property
    @locked
    def legs(self) -> tuple[Leg, ...]:
        """The legs of the motion in the order of time; see `Motion.legs`."""
        self._look_ahead()
        cuts_at_changes = "contact-sign" not in self._internal_ends
        shown = self._all_runs[: self._beginning or None]
        if self._track.corners.size or (cuts_at_changes and any(run.record[CHANGE_COUNT] for run in shown)):
            return super().legs
        return Rows(self._up_to_horizon(merged(self._runs_as_legs(), self._internal_ends)))

    @property
    def _all_runs(self) -> list[Run]:
        """The runs so far."""
        return [*self._laid, *self._runs]

    def _runs_as_legs(self) -> list[Leg]:
        """The runs that `legs` tells of, which changes of contact sign and corners do not cut."""
        everything, lap = self._all_runs, self.problem.period
        stops = [*(float(run.record[BEGIN]) for run in everything[1:]), self._elapsed]
        shown = everything[: self._beginning or None]
        return [run.leg(lap, stop) for run, stop in zip(shown, stops, strict=False)]

    def _place_on_last_leg(self, t: float) -> float:
        run = next(run for run in reversed(self._all_runs) if run.record[BEGIN] <= t)
        record = run.record if run.passed is None else run.passed
        place = place_at(record, (t - record[BEGIN]) - record[BEGIN_LOW])
        return float(self.lam(t)) if isnan(place) else place + float(record[LAPS_BEFORE]) * self.problem.period

    def lam(self, t: Any) -> Any:
        """The curve parameter at times; see `Motion.lam`. For doubles this is one call of compiled code."""
        times = _plain_times(t)
        if times is None:
            return super().lam(t)
        out = self._read(*times, 1, self._read_places, super().lam)[0]
        return out.reshape(times[0].shape) if np.ndim(t) else float(out[0])

    def state(self, t: Any) -> State:
        """The state of the body at times; see `Motion.state`. For doubles this is one call of compiled code."""
        times = _plain_times(t)
        if times is None or (self.problem.formulas.path_in_space is not None and self.problem.period):
            return super().state(t)

        def by_segments(later: Array) -> Array:
            return np.array(Motion.state(self, later)[1 : 1 + STATE_ROWS])

        out = self._read(*times, STATE_ROWS, self._read_states, by_segments)
        if not np.ndim(t) and self.problem.formulas.path_in_space is None:
            return State(float(times[0][0]), *out[:, 0].tolist())
        return self._state_of(times[0] if np.ndim(t) else float(times[0][0]), out)

    def error_bound(self, t: Any) -> Any:
        """A bound of the error of ``lam(t)``; see `Motion.error_bound`. For doubles it is that of `state`."""
        return super().error_bound(t) if _plain_times(t) is None else self.state(t).error

    def _read(
        self,
        times: Array,
        _: float,
        greatest: float,
        rows: int,
        by_record: Callable[[Array, Array, Array], None],
        by_segments: Callable[[Array], Array],
    ) -> Array:
        """Rows of numbers at times, from the record that compiled code reads as far as it goes."""
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
        """What compiled code reads of the motion up to a time, or up to an approach to an equilibrium before it."""
        return self._reading if self._reading.has(t, errors) else self._extended(t, errors)

    def _reading_at(self, t: float, errors: bool) -> Reading:
        """What compiled code reads of the motion at one time.

        Of a motion of which only times on one piece are asked, one after the other, only that piece is tabulated.
        """
        first = self._first_reading
        if self._reading.has(t, errors=False):
            return self._reading_up_to(t, errors)
        is_first = first.since <= t < first.until and first.has(t, errors)
        return first if is_first else self._read_first(t, errors)

    @locked
    def _read_first(self, t: float, errors: bool) -> Reading:
        """`_reading_at`, once the motion is followed so far."""
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
        """Tabulated pieces with all errors."""
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
        """`_reading_up_to`, once the motion is followed so far."""
        self._check_end(t)
        before = self._reading
        if before.has(t, errors):  # another thread has followed it
            return before
        made = list(before.pieces)
        if t > before.until:
            self._follow_amply(len(made))
            ahead = [timed for timed in self._pieces[len(made) :] if timed.segment.v2 is None]
            made += [tabulated(timed, self.problem.period) for timed in ahead]
        # Once errors have been asked for, they are found for later pieces too.
        errors = errors or (len(before.pieces) > 0 and before.pieces[0].has_all_errors)
        if len(made) > len(before.pieces) or (made and errors and not made[0].has_all_errors):
            made = self._with_errors(made, self._pieces) if errors else made
            until = min(self._known_end(), self._pieces[len(made) - 1].t_stop[0])
            self._reading = Reading(self._record_of(made), until, 0.0, made)
        return self._reading

    def _follow_amply(self, count: int) -> None:
        """Follow the motion until there are enough new pieces for another record, or as far as it can be followed.

        ``count`` is how many the last one was made of.
        """
        enough = EXTENSION * count
        with suppress(SolutionError, BudgetError):  # it is raised when that is asked for
            while len(self._pieces) < enough and not self._ending and self._elapsed < self._horizon:
                self._go_on()

    @locked
    def _gradient(self, quantity: str, wrt: Any) -> dict[str, Any]:
        rows = selected(self.problem.formulas.parameters, wrt)
        self._look_ahead()
        found = gradient(self, self._changes, quantity)
        return {
            name: tuple(found[row].tolist()) if found.ndim == 2 else float(found[row]) for name, row in rows.items()
        }

    @locked
    def _sensitivity(self, t: Any, wrt: Any) -> Sensitivity:
        rows = selected(self.problem.formulas.parameters, wrt)
        times, low, shape = self._times(t)
        self._trajectory(float(times.max(initial=0.0)))
        found = states_at(self, self._changes, times, low)
        fields = (getattr(found, name) for name in Sensitivity._fields[1:])
        return Sensitivity(tuple(rows), *(field[list(rows.values())].reshape(len(rows), *shape) for field in fields))

    @locked
    def place_changes(self, t: Any, wrt: Any) -> Array:
        """The derivatives of the curve parameter at given times; see `Motion.place_changes`."""
        rows = selected(self.problem.formulas.parameters, wrt)
        times, low, shape = self._times(t)
        self._trajectory(float(times.max(initial=0.0)))
        found: Array = places_at(self, self._changes, times, low)[list(rows.values())].reshape(len(rows), *shape)
        return found

    @property
    @locked
    def nearest_switch(self) -> Switch | None:
        """The turn at which the motion is nearest to another number of legs; see `Motion.nearest_switch`."""
        turns = [leg for leg in self.legs if leg.end in ("turn", "rest")]
        functions = self.problem.functions
        return nearest_switch(self._dissipation.static_balance, functions.p, turns, self.problem.period)

    @property
    def _changes(self) -> Changes:
        """How the legs so far change."""
        self._follow_again()
        runs = self._all_runs
        if self._known_changes is None or self._known_changes.followed < len(runs):
            self._known_changes = Changes(self.problem, runs)
        return self._known_changes

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
        return bool(np.any((places - self._reached) * self._at[DIRECTION] > 0.0))

    @property
    def _reached(self) -> float:
        """The place up to which the motion has been computed."""
        place: float = self._at[PLACE] + self._at[LAPS] * self.problem.period
        return place

    @property
    def _elapsed(self) -> float:
        """The time in s up to which the motion has been computed."""
        elapsed: float = self._at[ELAPSED]
        return elapsed

    # -- what `Motion` needs ------------------------------------------------------------------

    @property
    def _internal_ends(self) -> tuple[str, ...]:
        return ("",) if self._dissipation.friction else ("", "contact-sign")

    def _follow(self, reach: float) -> None:
        """Compute legs up to a time in s, and up to the horizon if there is one."""
        if isfinite(self._horizon):
            reach = max(reach, self._horizon)
        while not self._ending and self._elapsed < reach:
            self._go_on()

    def _trajectory(self, reach: float) -> Trajectory:
        self._follow(reach)
        if self._whole is None or len(self._whole.segments) != len(self._pieces):
            self._whole = Trajectory(segments=tuple(self._pieces), lap=self.problem.period)
        return self._whole

    def _history(self) -> tuple[TimedSegment, ...]:
        self._look_ahead()
        segments = self._trajectory(0.0).segments
        return tuple(timed for timed in segments if timed.leg < self._beginning) if self._beginning else segments

    def _contact_changes(self, piece: TimedSegment) -> list[tuple[Pair, float]]:
        return []  # segments end there

    def _check_end(self, t: float) -> None:
        self._follow(t)
        end = self._known_end()
        if t > end:
            raise InputError(f"t: the motion ends at {end!r} s ({self._end_text()}), got {t!r}")
        if self._ending == "asymptote" and not self._last_swing and t > self._pieces[-1].t_stop[0]:
            raise SolutionError(
                f"t = {t!r}: by then the body is closer to the equilibrium at "
                f"{self.problem.formulas.parameter} = {self._at[PLACE]!r} than doubles can tell"
            )

    def _phase_points(self, t: Array, t_low: Array) -> PhasePoints:
        if not self._last_swing:
            return super()._phase_points(t, t_low)
        # A swing that has died away stays where it turned last.
        last, last_low = self._pieces[-1].t_stop
        return super()._phase_points(np.minimum(t, last), np.where(t < last, t_low, last_low))

    def _time_error(self, t: Array) -> Array:
        return np.zeros_like(t)

    def _errors_before(self, timed: TimedSegment, phi: Array) -> tuple[float, Array]:
        if not self._errors:
            self._errors = [self._errors_at_launch()]
        while len(self._errors) <= timed.leg + 1:
            self._errors.append(self._carried(len(self._errors) - 1))
        run, (before, after) = self._laid[timed.leg], self._errors[timed.leg : timed.leg + 2]
        if timed.segment.v2 is not None:  # the approach to an equilibrium
            return after.place, np.full_like(phi, after.time)
        of_frame = 0.0 if run.frame is None else run.frame.error
        swing = 2.0 * self._last_swing if timed.leg == len(self._laid) - 1 else 0.0
        if swing and run.what != ASYMPTOTE:
            # So small a V**2 may have no error in the range of doubles, but the body stays where it is.
            return before.place + of_frame + swing, np.zeros_like(phi)
        panels = run.panels_ahead if timed.sense > 0 else run.panels_back
        which = np.searchsorted(timed.segment.edges[1:-1], phi, side="right")
        inherited = panels[which, INHERITED]
        if timed.sense > 0:
            return before.place + of_frame + swing, before.time + inherited + self._time_error_of_force(run)
        return after.place + of_frame + swing, after.time + after.place * inherited

    def _errors_at_launch(self) -> Errors:
        lam0, v0 = self.problem.launch[:2]
        place = abs(lam0.low) if self._launch_error is None else self._launch_error
        return Errors(place, 2.0 * v0.value * abs(v0.low) + ULP * self.problem.w0, 0.0)

    def _time_error_of_force(self, run: Run) -> float:
        """What the error of the force makes of the time in which a body departs from an equilibrium."""
        departs = run.frame is not None and not run.frame.is_stable
        return self._force_error * float(run.record[TIME_FROM_START] + run.record[TIME_FROM_END]) if departs else 0.0

    def _carried(self, leg: int) -> Errors:
        """The errors at the end of a leg, given those with which it begins; in a frame, errors of distances."""
        run, before = self._laid[leg], self._errors[leg]
        frame, turns = run.frame, run.what in (TURN, RESTS)
        share, terms = rounding_share(self._dissipation.linear), self._terms_of(leg)
        if frame is None:
            loss, p = self._dissipation, self.problem.functions.p
            return _known(carry(loss, p, turns, before, share, terms, run.record))
        if leg == 0 or self._laid[leg - 1].frame is None:
            before = before._replace(place=before.place + frame.error)
        frame.move(run.record, -1)
        share += 0.0 if frame.is_stable else self._force_error
        after = _known(carry(frame.dissipation, frame.p, turns, before, share, terms, run.record))
        after = after._replace(time=after.time + self._time_error_of_force(run))
        frame.move(run.record, 1)
        return after._replace(place=after.place + frame.error) if run.what == LIMIT else after

    def _terms_of(self, leg: int) -> Array:
        """For each panel of a leg how large the terms of the force are that may cancel; 0 where that is not known."""
        missing, exact = self._laid[len(self._terms) :], self.problem.formulas.exact
        if missing:
            terms = [np.zeros(run.ahead + run.back) for run in missing]
            by_place = [k for k, run in enumerate(missing) if run.frame is None]
            if by_place and isinstance(exact, ExactLaw):
                with suppress(SolutionError):  # formulas may be too long
                    errors = Law(self.problem).force_errors_along([missing[k] for k in by_place])
                    for k, of_panels in zip(by_place, errors, strict=True):
                        terms[k] = of_panels / rounding_share(self._dissipation.linear)
            self._terms += terms
        return self._terms[leg]

    def _end_text(self) -> str:
        if not self._ending or self._elapsed > self._horizon:
            return super()._end_text()
        return f"{self._ending} at {self.problem.formulas.parameter} = {self._reached!r}"

    def _first_passages(self, lam: float, low: float) -> list[float]:
        done = 0
        while True:
            trajectory = self._trajectory(0.0)
            found = passages(trajectory.segments[done:], trajectory, lam, low)
            done = len(trajectory.segments)
            # A body that turns at two points reaches no place outside of them any more.
            settled = self._at[TURNS] >= (1.0 if self.problem.w0 == 0.0 else 2.0)
            if found or self._ending or settled or self._elapsed >= self._horizon:
                return found
            self._go_on()

    # -- leg after leg ------------------------------------------------------------------------

    def _known_end(self) -> float:
        """The time at which the motion ends, as far as is known; infinite if it is not."""
        ends = self._ending not in ("", "asymptote")
        return min(self._horizon, self._elapsed if ends else inf)

    def _look_ahead(self) -> None:
        """Compute the whole motion if it ends, and at least its first leg if it does not."""
        if isfinite(self._horizon):
            self._follow(self._horizon)
        while not self._ending and not self._beginning and self._elapsed < self._horizon:
            self._go_on()

    @property
    def _goes_on_for_ever(self) -> bool:
        """Whether the body has done so much that an end of the motion is not looked for any further."""
        turns, pauses = self._at[TURNS], self._at[PAUSES]
        return bool(pauses >= MAX_PAUSES or turns > MAX_TURNS or (turns and not self._at[MAY_REST]))

    @property
    def _pieces(self) -> list[TimedSegment]:
        """All segments so far."""
        self._follow_again()
        for run in self._runs:
            self._lay(run)
        self._runs.clear()
        return self._segments

    def _follow_again(self) -> None:
        """Follow runs once more whose panels are not known, each in as many parts as that takes."""
        runs: list[Run] = []
        for run in self._runs:
            parts = self._with_panels(run)
            if len(self._laid) + len(runs) < self._beginning:
                self._beginning += len(parts) - 1
            runs += parts
        self._runs = runs

    def _go_on(self) -> None:
        """Follow the body to its next turn, to the end of the motion, or as far as one run goes."""
        if self._at and self._at[PANEL_COUNT] >= MAX_STORED:
            raise BudgetError(
                f"motion: {self._at[PANEL_COUNT]:.0f} pieces of legs reach t = {self._elapsed!r} only; "
                "give a shorter t_max, or ask for earlier times and nearer places"
            )
        what, records = self._followed()
        frame, at = self._frame, self._body[0].tolist()
        before = self._body[1 : 1 + len(records)].copy() if self._passes and frame is None else [None] * len(records)
        if not at[DIRECTION] and not at[TURNS]:
            return  # the body stays where it is
        self._at, record = at, records[-1]
        if len(records) > 1:
            earlier = zip(records[:-1], before[:-1], strict=True)
            self._runs += [Run(leg, TURN, END_NAMES[TURN], None, line) for leg, line in earlier]
        if what == TURN and frame is None and not at[STATUS]:
            self._runs.append(Run(record, TURN, END_NAMES[TURN], None, before[-1]))
        else:
            self._end_run(what, record, before[-1])
        if self._horizon == inf and not self._beginning and not self._ending and self._goes_on_for_ever:
            self._beginning = len(self._laid) + len(self._runs)

    def _end_run(self, what: int, record: Array, before: Array | None) -> None:
        """Note a run that another follows in another way, or none."""
        problem, frame = self.problem, self._frame
        if frame is not None:
            frame.move(record, 1)
            self._at[PLACE] = float(record[END])
        heading, leaves_frame = int(record[HEADING]), frame is not None and what == LIMIT
        if leaves_frame:
            self._leave_frame(record)
        self._settle(what, float(record[START]), float(record[END]))
        if what == LEAVES:
            raise leaving_at_once(problem, heading, "end of the domain")
        if what == SPENT or (what == NARROWED and self._force_cancels(record)):
            raise self._lost(record)
        name = "" if leaves_frame else self._end_name(what, record, heading)
        self._runs.append(Run(record, what, name, frame, before if what in PASSED else None))
        if self._at[ENDING]:
            self._ending = name
        if what == BEYOND:
            raise SolutionError(
                f"the motion leaves the range of doubles at {problem.formulas.parameter} = {self._at[PLACE]!r}; "
                "give a shorter t_max"
            )

    def _followed(self) -> tuple[int, Array]:
        """What ended the last of the next legs (`advance`), and the records of all of them; one if the body stays."""
        legs, question = (LEGS_PER_CALL if self._horizon < inf else 1, LEGS) if self._at else (1, FIRST_LEGS)
        while True:
            records = np.empty((legs if self._frame is None else 1, self._space * COLUMNS))
            what = self._drive(question, self._body, records)
            count = int(self._body[0, VALUE])
            if what == NEARBY:
                self._launch_nearby()
                question = LEGS
            elif what != FULL or count:
                return (what if what != FULL else TURN), records[: max(count, 1)]
            else:
                legs, self._space = 1, 4 * self._space

    def _drive(self, question: int, bodies: Array, records: Array) -> int:
        """Drive the body along the curve, or by its distance from an equilibrium (`answers.drive`)."""
        frame = self._frame
        if frame is not None:
            return drive_along(SMOOTH, frame.dissipation, frame.p.reshape(1, -1), question, bodies, records)
        p = self.problem.functions.p.reshape(1, -1)
        return drive_along(self._track, self._dissipation, p, question, bodies, records)

    def _with_panels(self, run: Run) -> list[Run]:
        """A run in parts with panels; the run alone if these are known."""
        if run.before is None:
            return [run]
        parts: list[Array] = []
        space, body = FEW_PANELS + self._track.breaks.size, run.before.reshape(1, -1).copy()
        p = self.problem.functions.p.reshape(1, -1)
        for _ in range(MAX_PAUSES):
            record = np.empty((1, space * COLUMNS))
            what = drive_along(self._track, self._dissipation, p, RUN_AGAIN, body, record)
            if what in PASSED:
                return run.with_panels([*parts, record[0]], self._horizon)
            if what == FULL:
                space *= 4
            elif what in (PAUSED, SLOWED):
                parts.append(record[0])
            else:
                break
        raise self._lost(record[0])

    def _settle(self, what: int, start: float, end: float) -> None:
        """Look whether a run has come so close to an equilibrium that the motion ends there, or goes on in a frame."""
        in_frame, linear = self._frame is not None, self._dissipation.linear
        if what in (TURN, PAUSED) and self._has_died_away(start, end):
            self._ending = "asymptote"
        elif what == ASYMPTOTE and not linear:
            self._last_swing = NEAR_EQUILIBRIUM * max(abs(end), abs(end - start))
        elif not in_frame:
            turns_nearby = what == TURN and abs(end - start) < SMALL_SHARE * abs(end)
            creeps = what == PAUSED and self._at[STEP] <= CREEPING_SHARE * self._at[FIRST_STEP]
            if turns_nearby or creeps:
                self._enter_frame()

    def _lost(self, record: Array) -> SolutionError:
        """Why a leg could not be followed."""
        place = f"V**2 beyond {self.problem.formulas.parameter} = {float(record[END])!r}"
        if 0.0 < abs(record[[START, END]]).max() < LEAST_SWING:
            return SolutionError(
                f"{place} comes to the end of the range of doubles; launch the body more than {LEAST_SWING!r} from the "
                "equilibrium, or faster"
            )
        if self._force_cancels(record):
            return SolutionError(
                f"{place} could not be followed: terms of the force cancel there to fewer digits than doubles need; "
                "declare the sum of such forces as one, or make them smaller"
            )
        return SolutionError(f"{place} could not be followed; are the curve and the force smooth there?")

    def _force_cancels(self, record: Array) -> bool:
        """Whether terms of the force cancel where a leg ends, or starts, so that doubles do not tell it."""
        with suppress(SolutionError):  # curves without formulas have no bound on its rounding, nor have very long ones
            law, heading = Law(self.problem), int(record[HEADING])
            return self._frame is None and any(law.cancels(float(record[end]), heading) for end in (START, END))
        return False

    def _has_died_away(self, start: float, end: float) -> bool:
        """Whether the body is, or swings, so closely about an equilibrium that its place shows no more of it."""
        frame = self._frame
        swing = max(abs(start), abs(end)) if frame is None else abs(self._body[0, PLACE])
        # From an unstable equilibrium the body departs, however near it turns.
        shown = LAST_DIGIT * abs(end) if frame is not None and frame.is_stable else 0.0
        if swing >= max(shown, LEAST_SWING):
            return False
        self._last_swing = swing
        return True

    def _launch_nearby(self) -> None:
        """Launch the body next to an equilibrium."""
        lam0 = self.problem.launch.lam0
        self._body[0, PLACE_LOW] = lam0.low
        self._enter_frame(lam0)
        if self._frame is None:
            self._body[0, PLACE_LOW] = 0.0
        else:  # it is launched there again, by its distance
            self._body[0, STEP] = 0.0
            self._launch_error = ULP * abs(float(self._body[0, PLACE]))

    def _enter_frame(self, lam0: Number | None = None) -> None:
        """Follow the body from here on by its distance from an equilibrium, if it is, and for a while stays, close.

        About an unstable equilibrium it does not stay, so that only its launch, ``lam0``, is worth that.
        """
        problem, line, loss = self.problem, self._body[0], self._dissipation
        if not is_small(loss, problem.functions.p, problem.functions.breaks, line):
            return
        place, low, v2 = line[[PLACE, PLACE_LOW, V2]].tolist()
        ends = np.abs(np.append(problem.functions.breaks, (problem.low, problem.high)) - place)
        reach = min(starting_step(problem), float(ends.min()))
        frame = frame_near(loss, problem.functions.p, (place, low, v2), reach)
        if frame is None or not (frame.is_stable or lam0):
            return
        if isinstance(problem.formulas.exact, ExactLaw):
            frame = sharpened(frame, Law(problem).at_rest)
        line[PLACE], line[PLACE_LOW] = frame.distance(place, low)
        self._force_error = 0.0 if frame.is_stable else frame.error / frame.reach
        unknown, exact = (LAST_DIGIT * abs(place) if frame.is_stable else frame.error), problem.formulas.exact
        if not frame.is_stable and lam0 and isinstance(exact, ExactLaw):
            known = refined(frame, exact, problem.p, lam0)
            if known is not None:
                (frame, line[PLACE]), line[PLACE_LOW], unknown = known, 0.0, 0.0
        if v2 == 0.0 and abs(line[PLACE]) < unknown:
            line[PLACE] = 0.0  # there it stays
        self._check_distance(frame.size(line[PLACE], v2), frame)
        reach = reach if frame.is_stable else min(reach, frame.reach)
        self._frame = frame
        line[LAM0], line[LOW], line[HIGH], line[PERIOD] = line[PLACE], -reach, reach, 0.0
        line[FIRST_STEP] = reach

    def _check_distance(self, size: float, frame: Frame) -> None:
        """Refuse a launch so near to an unstable equilibrium that doubles do not hold what makes the body depart."""
        place = float(frame.p[PLACE_IN_FRAME])
        nearest = LEAST_SWING if self._dissipation.linear else NEAREST_SHARE * abs(place)
        if not frame.is_stable and 0.0 < size < nearest:
            raise LaunchError(
                f"lam0: a motion from so near to the unstable equilibrium at {self.problem.formulas.parameter} = "
                f"{place!r} cannot be computed; launch at least {nearest:.1g} from it, faster, or, by exact text, at "
                "the equilibrium itself"
            )

    def _leave_frame(self, record: Array) -> None:
        """Follow the body by its place again; the record has places."""
        problem, line = self.problem, self._body[0]
        self._frame = None
        domain, step = problem.domain, starting_step(problem)
        line[PLACE], line[PLACE_LOW], line[ENDING] = record[END], record[END_LOW], 0.0
        line[LAM0], line[LOW], line[HIGH], line[PERIOD] = problem.lam0, domain.low, domain.high, domain.period
        line[FIRST_STEP], line[REACH] = step, domain.period or step
        self._at = line.tolist()

    def _end_name(self, what: int, record: Array, heading: int) -> str:
        """The name of what ended a run."""
        problem, f = self.problem, self.problem.functions
        if what == LIMIT and not problem.period:
            return domain_end(problem, heading).what
        if what == NARROWED:
            ds = path_and_force_at(f.addresses, f.p, record[[START, END]], np.zeros(2))[2]
            return "cusp" if ds[1] <= CUSP_SHARE * ds[0] else "singular-point"
        return END_NAMES.get(what, "")

    def _lay(self, run: Run) -> None:
        """Make segments of a run."""
        f, end, middle = self.problem.functions, run.pair(END), run.pair(MIDDLE)
        self._laid.append(run)
        self._clock, (ahead, back) = run.pair(BEGIN), run.pair(TIME_FROM_START)
        if run.ahead:
            segment = along_panels(f, run.pair(START), middle, run.half_c, ahead, run.panels_ahead)
            if run.what == AT_ONCE:
                self._append(segment, 1, [(ZERO, 0.0)] * 2, run.end, run.laps)
                return
            self._add(segment, 1, run, "" if run.back else run.end)
        if run.what == ASYMPTOTE and run.back:
            self._add(along_field(f, middle[0], end[0], run.field), 1, run, run.end)
        elif run.back:
            self._add(along_panels(f, end, middle, 0.0, back, run.panels_back), -1, run, run.end)

    def _add(self, segment: Segment, sense: int, run: Run, end: str) -> None:
        """Append a segment to the motion, cut where N changes its sign."""
        low, high = sorted((segment.a, segment.b))
        rounding = END_ROUNDINGS * ULP * max(abs(low), abs(high))

        def without(changes: Iterable[float], place: float) -> list[float]:
            return [change for change in changes if abs(change - place) > rounding]

        # A change in the middle of a run ends the part before it, and is none of the part behind.
        changes = without(run.changes, segment.b) if sense < 0 and run.ahead else list(run.changes)
        if not end or run.what == LIFTOFF:
            found, changes = len(changes), without(changes, segment.b if sense > 0 else segment.a)
            end = "contact-sign" if not end and len(changes) < found else end
        inside = [place for place in changes if low < place < high]
        cuts = [segment.phase_angle_of(*segment.offsets(place)) for place in inside]
        times = segment.times(np.array(cuts)) if cuts else ()
        marks = [(ZERO, 0.0), *(((float(r), 0.0), phi) for r, phi in zip(times, cuts, strict=True))]
        marks.append(((segment.duration, 0.0), segment.stop))
        marks.sort(key=lambda mark: sense * mark[1])
        self._append(segment, sense, marks, end, run.laps)

    def _append(self, segment: Segment, sense: int, marks: list[tuple[Pair, float]], end: str, laps: int) -> None:
        """Append the parts of a segment between marks, each a time from its end ``a`` and a phase angle."""
        for k, ((r_start, phi_start), (r_stop, phi_stop)) in enumerate(pairwise(marks)):
            piece = TimedSegment(
                segment=segment,
                sense=sense,
                r_start=r_start,
                r_stop=r_stop,
                phi_start=phi_start,
                phi_stop=phi_stop,
                t_start=self._clock,
                s_a=self._arc if sense > 0 else self._arc - segment.direction * segment.length,
                end=end if k == len(marks) - 2 else "contact-sign",
                laps=laps,
                leg=len(self._laid) - 1,
            )
            self._segments.append(piece)
            self._clock = piece.t_stop
        self._arc += sense * segment.direction * segment.length
