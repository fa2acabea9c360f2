"""The record of the timed segments of a motion for compiled code: tables of places, states and panels."""

from collections.abc import Sequence
from math import nan
from typing import NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from gqm_sym.runtime.arithmetic.doubledouble import ULP, two_sum
from gqm_sym.runtime.arithmetic.elementary import exp, sin
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.types import MATRIX, Array
from gqm_sym.runtime.inversion import leg_tables, records
from gqm_sym.runtime.inversion.leg_tables import WIDE
from gqm_sym.runtime.inversion.table import PARTS_PER_SEGMENT, TERMS, tabulate
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.motion.segments.errors import MAX_END_ROUNDINGS, MAX_SLOPES, end_errors, time_errors_of_panels
from gqm_sym.runtime.motion.segments.segment import Segment
from gqm_sym.runtime.motion.trajectory import TimedSegment
from gqm_sym.runtime.quadrature.substitution import FROM_TURN, REGULAR, TO_EQUILIBRIUM, TURN_TURN

# The nodes of the Gauss-Legendre rule on [-1, 1], and the matrix from values at them to Legendre coefficients.
NODES = np.polynomial.legendre.leggauss(WIDE)[0]
TO_LEGENDRE = np.linalg.inv(np.polynomial.legendre.legvander(NODES, WIDE - 1)).T

# The matrices from the coefficients of a series to those on its halves, and to its value in the middle.
LEFT_HALF, RIGHT_HALF = (
    np.polynomial.legendre.legvander(0.5 * (NODES + side), WIDE - 1).T @ TO_LEGENDRE for side in (-1.0, 1.0)
)
AT_MIDDLE = np.polynomial.legendre.legvander(np.zeros(1), WIDE - 1)[0]

# The series of a speed is resolved if its last two coefficients are below this share of the largest one.
# Panels are halved so often until it is.
MAX_SPEED_TAIL, MAX_HALVINGS = 2e-15, 6


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
        The march variable at the last phase angle, which is 1; NaN if the segment has none.
    is_resolved : bool
        Whether the series of the speed have all digits.
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
    is_resolved: bool = True
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
    kind : float
        The kind of the segment.
    growth, first_growth : float
        As `growth` of `Segment`.
    turn_offset : float
        As `turn_offset` of `Segment`.
    error_a, error_b : float
        The errors of the ends that are turning points, in units of the curve parameter.
    lam_before : float
        The growth of the curve parameter over all laps before it.
    """

    kind: float
    growth: float
    first_growth: float
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
    error_a: float
    error_b: float


@Inner
def time_from_launch(r, r_low, timing):  # type: ignore[no-untyped-def]
    """Convert a time from the segment's end ``a`` to a time from launch, both as two doubles."""
    s, e = two_sum(r, -timing.r_start)
    high, rounding = two_sum(timing.t_start, timing.sense * s)
    return two_sum(high, rounding + timing.t_start_low + timing.sense * (e + r_low - timing.r_start_low))


@Inner
def largest_place_error(timing, start, stop, error):  # type: ignore[no-untyped-def]
    """Return the largest error of places on an interval, as `errors.inversion_error` has it at phase angles.

    The interval is from the phase angle ``start`` to ``stop``, the rounding of which is not counted; ``error`` is that
    of its polynomial.
    """
    kind, width = int(timing.kind), abs(timing.width)
    if kind == TO_EQUILIBRIUM:
        # phi exp(-phi) is largest at 1.
        farthest = min(max(start, 1.0), stop)
        return width * (exp(-start) * (error + 3.0 * ULP) + 3.0 * ULP * farthest * exp(-farthest))
    bounded = width * (MAX_SLOPES[kind] * error + 3.0 * ULP)
    if kind == REGULAR:
        return bounded
    low = start * start if kind == FROM_TURN else sin(0.5 * start) ** 2
    high = stop * stop if kind == FROM_TURN else sin(0.5 * stop) ** 2
    return bounded + timing.error_a * (1.0 - low) + timing.error_b * high


TIMING = types.NamedUniTuple(types.float64, len(Timing._fields), Timing)


@entry(types.Tuple((MATRIX, MATRIX, MATRIX))(MATRIX, MATRIX, MATRIX, MATRIX, TIMING), checked=False)
def tabulate_piece(marks, time_terms, length_terms, speed_terms, timing):  # type: ignore[no-untyped-def]
    """Return the arrays of a `TabulatedPiece`.

    Parameters
    ----------
    marks : (5, n+1) array
        Phase angles at the edges of n panels, the times there as two doubles, and the arc lengths; and for each panel
        the error of its times.
    time_terms, length_terms, speed_terms : arrays
        Legendre coefficients of time, arc length and of the regular factor of the speed on each panel.
    timing : Timing
    """
    edges, times, lengths = marks[0], marks[1], marks[3]
    middles, lows, scales, powers, _, ends, errors = tabulate(edges, times, marks[2], time_terms)
    count, panel_count, sense, width = ends.size, edges.size - 1, timing.sense, timing.width
    intervals, states = np.empty((count, leg_tables.INTERVAL_COLUMNS)), np.empty((count, leg_tables.STATE_COLUMNS))
    kind, share = timing.kind, 1.0 / (1.0 + 2.0 * timing.turn_offset)
    is_from_turn = kind == FROM_TURN
    linear = 2.0 * timing.turn_offset * share if is_from_turn else 1.0
    direction = 1.0 if width > 0.0 else -1.0
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
        if i == 0:
            start = edges[0]
        row[leg_tables.UNTIL] = until
        row[leg_tables.MIDDLE], row[leg_tables.MIDDLE_LOW] = time_from_launch(middles[i], lows[i], timing)
        row[leg_tables.SCALE], row[leg_tables.STOP] = sense * scales[i], edges[-1]
        row[leg_tables.SQUARE], row[leg_tables.LINEAR] = (share if is_from_turn else 0.0), linear
        row[leg_tables.KIND] = kind
        row[leg_tables.PLACE_A], row[leg_tables.PLACE_A_LOW] = timing.a, timing.a_low
        row[leg_tables.PLACE_B], row[leg_tables.PLACE_B_LOW] = timing.b, timing.b_low
        row[leg_tables.WIDTH], row[leg_tables.LAPS] = width, timing.lam_before
        panel = min(int(np.searchsorted(edges[1:-1], 0.5 * (start + stop), side="right")), panel_count - 1)
        state[leg_tables.PANEL], state[leg_tables.DIRECTION] = panel, direction
        state[leg_tables.HEADING], state[leg_tables.ARC_A] = sense * direction, timing.s_a
        state[leg_tables.GROWTH], state[leg_tables.FIRST_GROWTH] = timing.growth, timing.first_growth
        state[leg_tables.TIME_ERROR] = marks[4, panel]
        state[leg_tables.PLACE_ERROR] = largest_place_error(timing, start, stop, errors[i])
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
    """Return the record of a piece with its own errors."""
    segment = timed.segment
    _, _, lengths, time_terms, length_terms = segment.panels[:5]
    marks = np.array([segment.edges, *segment.edge_times, lengths, np.append(time_errors_of_panels(segment), 0.0)])
    last, is_resolved = nan if segment.march_end is None else segment.march_end, True
    if segment.speed_terms is None:
        marks, *series, is_resolved = _with_speeds(segment, marks, time_terms, length_terms)
    else:
        series = [_of_full_width(terms) for terms in (time_terms, length_terms, segment.speed_terms)]
    timing = Timing(
        *(float(segment.kind), *segment.growth, segment.turn_offset, segment.a, segment.low_parts[0]),
        *(segment.b, segment.low_parts[1], segment.width, timed.laps * lap, float(timed.sense), timed.s_a),
        *(*timed.r_start, *timed.t_start, timed.t_stop[0], *_errors_of_ends(segment)),
    )
    intervals, states, panels = tabulate_piece(marks, *series, timing)
    return TabulatedPiece(
        intervals, states, panels, marks[0], timed.leg, timed.sense, timed.laps, last, is_resolved=is_resolved
    )


def _with_speeds(
    segment: Segment, marks: Array, time_terms: Array, length_terms: Array
) -> tuple[Array, Array, Array, Array, bool]:
    """Return the arguments of `tabulate_piece` for a segment without `Segment.speed_terms`, and whether the series of
    its speed are resolved; panels are halved until they are.
    """
    series = np.array([_of_full_width(time_terms), segment.width_ratio * _of_full_width(length_terms)])
    marks[3] *= segment.width_ratio
    for _ in range(MAX_HALVINGS):
        speed_terms = _speed_terms(segment, marks[0])
        tails, largest = np.abs(speed_terms[:, -2:]).max(axis=1), np.abs(speed_terms).max(axis=1)
        coarse = ~(tails <= MAX_SPEED_TAIL * largest)
        if not coarse.any():
            return marks, *series, speed_terms, True
        marks, series = _halved(marks, series, coarse)
    return marks, *series, _speed_terms(segment, marks[0]), False


def _of_full_width(terms: Array) -> Array:
    """Return the Legendre coefficients of each panel with zeros behind them, so that there are WIDE of them."""
    wide = np.zeros((len(terms), WIDE))
    wide[:, : terms.shape[1]] = terms
    return wide


def _halved(marks: Array, series: Array, which: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Return the marks and the series of time and arc length after some panels have been halved."""
    edges, times, lows, lengths, errors = marks
    cut = np.flatnonzero(which)
    passed = series[:, cut] @ AT_MIDDLE
    time, rounding = two_sum.py_func(times[cut], passed[0])
    columns = [0.5 * (edges[cut] + edges[cut + 1]), time, lows[cut] + rounding, lengths[cut] + passed[1], errors[cut]]
    left = cut + np.arange(len(cut))
    series = np.repeat(series, 1 + which, axis=1)
    series[:, left + 1] = series[:, left] @ RIGHT_HALF
    series[:, left + 1, 0] -= passed
    series[:, left] = series[:, left] @ LEFT_HALF
    return np.insert(marks, cut + 1, columns, axis=1), series


def _speed_terms(segment: Segment, edges: Array) -> Array:
    """Return the Legendre coefficients of the regular factor of the speed on panels with these edges."""
    halves = 0.5 * np.diff(edges)
    phi = ((edges[:-1] + halves)[:, None] + halves[:, None] * NODES).ravel()
    slope, rest = segment.growth
    growth = {TURN_TURN: np.sin(phi), TO_EQUILIBRIUM: np.exp(-phi)}.get(segment.kind, slope * phi + rest)
    factors = (segment.speeds(phi) / growth).reshape(-1, WIDE)
    # Without the differences the rounding of the matrix would be that of the largest speed.
    middles = factors[:, WIDE // 2 :][:, :1]
    terms: Array = (factors - middles) @ TO_LEGENDRE
    terms[:, :1] += middles
    return terms


def _errors_of_ends(segment: Segment) -> tuple[float, float]:
    """Return the errors of those ends of a segment that are turning points in doubles."""
    if segment.march_end is not None:
        return MAX_END_ROUNDINGS * ULP * abs(segment.width) if segment.kind == FROM_TURN else 0.0, 0.0
    is_exact = segment.kind in (REGULAR, TO_EQUILIBRIUM) or segment.from_multiprecision
    return (0.0, 0.0) if is_exact else end_errors(segment)


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
    parts, last = PARTS_PER_SEGMENT * len(until), len(until) - 1
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
