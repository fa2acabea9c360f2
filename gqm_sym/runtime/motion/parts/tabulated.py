"""Places and states of a motion that does not repeat, with one call of compiled code."""

from abc import abstractmethod
from bisect import bisect_right
from collections.abc import Callable, Sequence
from math import inf
from typing import Any, NamedTuple

import numpy as np

from gqm_sym.runtime.compiled.threads import run_in_threads
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.inversion.leg_tables import place_on_leg, places_along_legs, state_on_leg, states_along_legs
from gqm_sym.runtime.motion.locking import locked
from gqm_sym.runtime.motion.parts.before_joint import loss_at_joint
from gqm_sym.runtime.motion.parts.positions import Positions
from gqm_sym.runtime.motion.sampler import (
    MIN_PLACES_PER_THREAD,
    MIN_STATES_PER_THREAD,
    STATE_ROWS,
    STATE_ROWS_IN_SPACE,
    plain_time,
    plain_times,
)
from gqm_sym.runtime.motion.segments.tabulation import TabulatedPiece, leg_record, tabulated
from gqm_sym.runtime.motion.state import State
from gqm_sym.runtime.motion.trajectory import TimedSegment

# When the record that compiled code reads is extended to later times, its number of pieces grows by this factor, so
# that successive questions do not copy it for each leg.
EXTENSION = 1.25


def times_from_launch(t: Any) -> tuple[Array, float] | None:
    """Return an array of times from launch on as doubles, with the largest; None if they are not such numbers."""
    times = plain_times(t)
    return (times[0], times[2]) if times is not None and 0.0 <= times[1] <= times[2] < inf else None


class Reading(NamedTuple):
    """The record of a motion for compiled code.

    Attributes
    ----------
    record : array
        `segments.tabulation.leg_record`.
    until : float
        The time in s up to which it holds.
    since : float
        The time in s from which on it holds.
    pieces : sequence of TabulatedPiece
        The pieces that the record contains.
    has_speeds : bool
        Whether the series of all speeds have all digits.
    """

    record: Array = np.empty(0)
    until: float = -1.0
    since: float = 0.0
    pieces: Sequence[TabulatedPiece] = ()
    has_speeds: bool = True

    def has(self, t: float, errors: bool) -> bool:
        """Return whether it holds up to a time, with all errors if these are required."""
        return t <= self.until and (self.pieces[-1].has_all_errors or not errors)


class Tabulated(Positions):
    """The places and states of a motion that is made of timed segments, which follow each other from launch.

    The segments are tabulated as far as times have been requested, and compiled code reads their tables.
    """

    _reading = Reading()
    # The data of the first piece for which a single time was requested.
    _first_reading = Reading()

    @property
    @abstractmethod
    def _pieces(self) -> Sequence[TimedSegment]:
        """All segments so far."""

    def _pieces_up_to(self, _: float) -> Sequence[TimedSegment]:
        """Return the first segments so far, up to the one on which a time falls at least."""
        return self._pieces

    def _follow_amply(self, enough: float) -> None:
        """Follow the motion until there are enough pieces, if this is worth its time."""

    def lam(self, t: Any) -> Any:
        """Return the curve parameter at times; see `Motion.lam`. For doubles this is one call of compiled code."""
        one = self._one_time(t, errors=False)
        if one is not None:
            return place_on_leg(*one)
        times = times_from_launch(t)
        if times is None:
            return super().lam(t)
        return self._read(*times, 1, self._read_places, super().lam)[0].reshape(times[0].shape)

    def state(self, t: Any) -> State:
        """Return the state of the body at times; see `Motion.state`. For doubles this is one call of compiled code."""
        one = self._one_time(t, errors=True)
        if one is not None:
            return self._state_at(state_on_leg(one[0], self.problem.functions.p, one[1]))
        times = times_from_launch(t)
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
        has_digits = reading.has_speeds or not errors
        return (reading.record, time) if time <= reading.until and has_digits else None

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
        record, until, *_, has_speeds = read(greatest, rows > 1)
        times = times.reshape(-1)
        if rows > 1 and not has_speeds:
            return by_segments(times)
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
        """Return the record for compiled code up to a time, as far as there are segments."""
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
        pieces, first = self._pieces_up_to(t), self._first_reading
        k = bisect_right(pieces, t, key=lambda timed: timed.t_stop[0])
        is_known = first.until >= 0.0
        if k == len(pieces) or (is_known and pieces[k].t_start[0] != first.since):
            return self._extended(t, errors)
        made = first.pieces if is_known else [tabulated(pieces[k], self.problem.period)]
        made = self._with_errors(made, pieces[k:]) if errors else made
        self._first_reading = self._reading_of(made, pieces[k : k + 1])
        return self._first_reading

    def _with_errors(self, made: Sequence[TabulatedPiece], pieces: Sequence[TimedSegment]) -> list[TabulatedPiece]:
        """Return tabulated pieces with all errors."""
        return [
            piece
            if piece.has_all_errors
            else piece.with_errors(*self._errors_before(timed, 0.5 * (piece.edges[1:] + piece.edges[:-1])))
            for piece, timed in zip(made, pieces, strict=False)
        ]

    def _reading_of(self, pieces: Sequence[TabulatedPiece], timed: Sequence[TimedSegment]) -> Reading:
        """Return the record of tabulated pieces, which are those of timed segments that follow each other."""
        record = leg_record(self.problem, self.direction * self.problem.launch.v0.value, pieces)
        until, has_speeds = min(self._known_end(), timed[-1].t_stop[0]), all(piece.is_resolved for piece in pieces)
        loss = loss_at_joint(timed[-1])
        until = until if loss is None else min(until, loss.since)
        return Reading(record, until, timed[0].t_start[0], pieces, has_speeds)

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
            made += [tabulated(timed, self.problem.period) for timed in self._pieces[len(made) :]]
        # Once errors have been requested, they are computed for later pieces too.
        errors = errors or (len(before.pieces) > 0 and before.pieces[0].has_all_errors)
        if len(made) > len(before.pieces) or (made and errors and not made[0].has_all_errors):
            made = self._with_errors(made, self._pieces) if errors else made
            self._reading = self._reading_of(made, self._pieces[: len(made)])
        return self._reading
