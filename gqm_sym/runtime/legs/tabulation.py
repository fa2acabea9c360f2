"""The record of the segments of a motion with losses for compiled code: tables of places, states and panels."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from gqm_sym.runtime.arithmetic.doubledouble import ULP, two_sum
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.types import MATRIX, Array
from gqm_sym.runtime.inversion import leg_tables, records
from gqm_sym.runtime.inversion.table import MAX_TIME_ERROR, TERMS, tabulate
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.legs.panels.polynomials import WIDE
from gqm_sym.runtime.motion.segments.errors import MAX_END_ROUNDINGS, MAX_SLOPES
from gqm_sym.runtime.motion.trajectory import TimedSegment
from gqm_sym.runtime.quadrature.substitution import FROM_TURN, REGULAR

# The number of equal parts of the time for each interval; they serve to find the interval of a time.
SLOTS_PER_INTERVAL = 4


class TabulatedPiece(NamedTuple):
    """The record of a piece of a motion for compiled code, as rows of the sections of `inversion.leg_tables`.

    Attributes
    ----------
    intervals, states, panels : arrays
        INTERVALS, STATES and PANELS; panels are counted from the first one of the piece.
    edges : array
        The phase angles at the edges of its panels.
    leg, sense, laps : int
        As in `TimedSegment`.
    last : float
        The march variable at the last phase angle, which is 1.
    has_all_errors : bool
        Whether the errors in STATES are those of times and places from launch, or of this piece alone.
    """

    intervals: Array
    states: Array
    panels: Array
    edges: Array
    leg: int
    sense: int
    laps: int
    last: float
    has_all_errors: bool = False

    def with_errors(self, of_place: float, of_times: Array) -> "TabulatedPiece":
        """Return the piece with the inherited errors included: those of places, and of the times on each panel."""
        states = self.states.copy()
        states[:, leg_tables.TIME_ERROR] += of_times[states[:, leg_tables.PANEL].astype(np.intp)]
        states[:, leg_tables.PLACE_ERROR] += of_place
        return self._replace(states=states, has_all_errors=True)


class Timing(NamedTuple):
    """The numbers that convert the table of a segment to rows for times from launch, as in `TimedSegment`.

    Attributes
    ----------
    from_turn : float
        1 if the segment begins at a turning point, or close to one; 0 if it is REGULAR.
    last, turn_offset : float
        As in `Segment.speed_series` and in `Segment`.
    relative_error : float
        The relative error of its times.
    lam_before : float
        The growth of the curve parameter over all laps before it.
    """

    from_turn: float
    last: float
    turn_offset: float
    a: float
    a_low: float
    b: float
    b_low: float
    width: float
    lam_before: float
    sense: float
    s_a: float
    r_start: float
    r_start_low: float
    t_start: float
    t_start_low: float
    t_stop: float
    relative_error: float


@Inner
def time_from_launch(r, r_low, timing):  # type: ignore[no-untyped-def]
    """Convert a time from the segment's end ``a`` to a time from launch, both as two doubles."""
    s, e = two_sum(r, -timing.r_start)
    high, rounding = two_sum(timing.t_start, timing.sense * s)
    return two_sum(high, rounding + timing.t_start_low + timing.sense * (e + r_low - timing.r_start_low))


TIMING = types.NamedUniTuple(types.float64, len(Timing._fields), Timing)


@entry(types.Tuple((MATRIX, MATRIX, MATRIX))(MATRIX, MATRIX, MATRIX, MATRIX, TIMING), checked=False)
def tabulate_piece(marks, time_terms, length_terms, speed_terms, timing):  # type: ignore[no-untyped-def]
    """Return the arrays of a `TabulatedPiece`.

    Parameters
    ----------
    marks : (4, n+1) array
        Phase angles at the edges of n panels, the times there as two doubles, and the arc lengths.
    time_terms, length_terms, speed_terms : arrays
        As in `read_panels`.
    timing : Timing
    """
    edges, times, lengths = marks[0], marks[1], marks[3]
    middles, lows, scales, powers, _, ends, errors = tabulate(edges, times, marks[2], time_terms)
    count, panel_count, sense, width = ends.size, edges.size - 1, timing.sense, timing.width
    intervals, states = np.empty((count, leg_tables.INTERVAL_COLUMNS)), np.empty((count, leg_tables.STATE_COLUMNS))
    share, is_from_turn = 1.0 / (1.0 + 2.0 * timing.turn_offset), timing.from_turn > 0.0
    linear = 2.0 * timing.turn_offset * share if is_from_turn else 1.0
    direction, slope = (1.0 if width > 0.0 else -1.0), MAX_SLOPES[FROM_TURN if is_from_turn else REGULAR]
    growth = (timing.last, timing.last * timing.turn_offset) if is_from_turn else (0.0, 1.0)
    kept = 0
    for k in range(count):
        i = k if sense > 0.0 else count - 1 - k
        begin = ends[i - 1] if i > 0 else 0.0
        until = time_from_launch(ends[i] if sense > 0.0 else begin, 0.0, timing)[0]
        since = time_from_launch(begin if sense > 0.0 else ends[i], 0.0, timing)[0]
        # A piece that ends where it begins has the interval of its beginning.
        if not (until > timing.t_start and (kept == 0 or since < timing.t_stop)) and (kept > 0 or k < count - 1):
            continue
        row, state, start, stop = intervals[kept], states[kept], 0.0, 0.0
        for m in range(TERMS):
            start, stop = start + (powers[i, m] if m % 2 == 0 else -powers[i, m]), stop + powers[i, m]
            row[leg_tables.POWERS + m] = powers[i, m]
        row[leg_tables.UNTIL] = until
        row[leg_tables.MIDDLE], row[leg_tables.MIDDLE_LOW] = time_from_launch(middles[i], lows[i], timing)
        row[leg_tables.SCALE], row[leg_tables.STOP] = sense * scales[i], edges[-1]
        row[leg_tables.SQUARE], row[leg_tables.LINEAR] = timing.from_turn * share, linear
        row[leg_tables.PLACE_A], row[leg_tables.PLACE_A_LOW] = timing.a, timing.a_low
        row[leg_tables.PLACE_B], row[leg_tables.PLACE_B_LOW] = timing.b, timing.b_low
        row[leg_tables.WIDTH], row[leg_tables.LAPS] = width, timing.lam_before
        panel = min(int(np.searchsorted(edges[1:-1], 0.5 * (start + stop), side="right")), panel_count - 1)
        state[leg_tables.PANEL], state[leg_tables.DIRECTION] = panel, direction
        state[leg_tables.HEADING], state[leg_tables.ARC_A] = sense * direction, timing.s_a
        state[leg_tables.GROWTH], state[leg_tables.FIRST_GROWTH] = growth
        state[leg_tables.TIME_ERROR] = (timing.relative_error + ULP + MAX_TIME_ERROR) * times[panel + 1]
        # The error due to a turn, as in `Segment`, is largest next to it.
        of_turn = MAX_END_ROUNDINGS * ULP * (1.0 - start * start) if is_from_turn else 0.0
        state[leg_tables.PLACE_ERROR] = abs(width) * (slope * errors[i] + 3.0 * ULP + of_turn)
        kept += 1
    intervals[kept - 1, leg_tables.UNTIL] = timing.t_stop
    panels = np.empty((panel_count, leg_tables.PANEL_COLUMNS))
    for k in range(panel_count):
        panels[k, leg_tables.EDGE], panels[k, leg_tables.HALF] = edges[k], 0.5 * (edges[k + 1] - edges[k])
        panels[k, leg_tables.ARC] = lengths[k]
        panels[k, leg_tables.SERIES : leg_tables.SERIES + WIDE] = length_terms[k]
        panels[k, leg_tables.SERIES + WIDE :] = speed_terms[k]
    return intervals[:kept].copy(), states[:kept].copy(), panels


def tabulated(timed: TimedSegment, lap: float) -> TabulatedPiece:
    """Return the record of a piece, which is not an approach to an equilibrium, with its own errors."""
    segment = timed.segment
    assert segment.speed_series is not None
    edges, _, lengths, time_terms, length_terms, error = segment.panels[:6]
    last, speed_terms = segment.speed_series
    timing = Timing(
        *(float(segment.kind == FROM_TURN), last, segment.turn_offset, segment.a, segment.low_parts[0], segment.b),
        *(segment.low_parts[1], segment.width, timed.laps * lap, float(timed.sense), timed.s_a, *timed.r_start),
        *(*timed.t_start, timed.t_stop[0], error),
    )
    marks = np.array([edges, *segment.edge_times, lengths])
    intervals, states, panels = tabulate_piece(marks, time_terms, length_terms, speed_terms, timing)
    return TabulatedPiece(intervals, states, panels, edges, timed.leg, timed.sense, timed.laps, last)


def leg_record(problem: Problem, v0: float, pieces: Sequence[TabulatedPiece]) -> Array:
    """Return the record from which compiled code finds places and states on pieces that follow each other from launch.

    ``v0`` is the signed speed of the launch.
    """
    intervals, states, panels = pieces[0][:3]
    if len(pieces) > 1:
        intervals, states, panels = (np.concatenate([piece[k] for piece in pieces]) for k in range(3))
        counts = [len(piece.panels) for piece in pieces]
        states[:, leg_tables.PANEL] += np.repeat(np.cumsum([0, *counts[:-1]]), [len(piece.states) for piece in pieces])
    until = intervals[:, leg_tables.UNTIL]
    parts, last = SLOTS_PER_INTERVAL * len(until), len(until) - 1
    slots: NDArray[np.int64] = np.zeros(parts + 1, dtype=np.int64)
    # Rounding may assign a time to the slot after its own.
    slots[1:] = until.searchsorted(until[-1] / parts * np.arange(parts), side="right")
    slots[0] = slots[1]
    slots = np.minimum(slots, last) * leg_tables.INTERVAL_COLUMNS
    address = problem.functions.addresses.path_and_contact_force
    return records.record(
        {
            leg_tables.FUNCTION: np.array([address], dtype=np.int64),
            leg_tables.LAUNCH: np.array([problem.lam0, v0, problem.arc_origin, until[-1]], dtype=np.float64),
            leg_tables.SLOTS: slots,
            leg_tables.INTERVALS: intervals,
            leg_tables.STATES: states,
            leg_tables.PANELS: panels,
        }
    )
