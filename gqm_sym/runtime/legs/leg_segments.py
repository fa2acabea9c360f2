"""Segments of a dissipative motion, from the panels of its legs."""

from math import inf
from typing import NamedTuple

import numpy as np
from numba import types

from gqm_sym.runtime.arithmetic.doubledouble import ULP, Pair, two_sum
from gqm_sym.runtime.compiled.jit import entry
from gqm_sym.runtime.compiled.registers import borrowed
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, REAL, VECTOR, Array
from gqm_sym.runtime.launch.functions import BoundFunctions
from gqm_sym.runtime.legs.advance import END_LIFTOFF_AT_ONCE
from gqm_sym.runtime.legs.frames.local_frame import Frame
from gqm_sym.runtime.legs.leg_reading import to_integral, to_plain
from gqm_sym.runtime.legs.leg_record import (
    AHEAD,
    BACK,
    BEGIN,
    BEGIN_LOW,
    CHANGE_COUNT,
    COLUMNS,
    END,
    END_LOW,
    FIELD_COLUMNS,
    HALF_C,
    HEAD,
    HEADING,
    LAPS_BEFORE,
    RIGHT,
    START,
    TIME_ERROR,
    TIME_FROM_END,
    TIME_FROM_START,
    USED,
    WHOLE,
    WHOLE_WIDTH,
    Y_ROW,
)
from gqm_sym.runtime.legs.panels.polynomials import WIDE
from gqm_sym.runtime.legs.runs.ends import END_ASYMPTOTE, END_PAUSE, END_TURN
from gqm_sym.runtime.legs.runs.whole_panels import lay_panels
from gqm_sym.runtime.motion.events import Leg
from gqm_sym.runtime.motion.segments.segment import Segment
from gqm_sym.runtime.quadrature.running_totals import totals_of
from gqm_sym.runtime.quadrature.substitution import FROM_TURN, REGULAR, TO_EQUILIBRIUM
from gqm_sym.runtime.quadrature.time_panels import CONVERGED

# The largest phase angle on a leg that tends to an equilibrium. The distance from there is then exp(-MAX_PHASE_ANGLE)
# times the length of the leg, the smallest that doubles can represent.
MAX_PHASE_ANGLE = 690.0

# The name of the end of a leg that ends at a turn.
TURN = "turn"


@entry(
    types.Tuple((VECTOR, VECTOR, VECTOR, MATRIX, MATRIX, REAL, VECTOR, MATRIX))(MATRIX, REAL),
    checked=False,
)
def read_panels(panels, time):  # type: ignore[no-untyped-def]
    """Return a leg's panels in the form of `time_panels.lay`; their times add up to ``time``.

    Returns
    -------
    edges, edge_times, lengths, time_terms, length_terms, error
        As in `time_panels.lay`; the last phase angle is 1.
    low_times : array
        The low parts of the times at the edges, as two doubles.
    speed_terms : (n, WIDE) array
        Legendre coefficients of Y.
    """
    n = panels.shape[0]
    edges, lengths = np.zeros(n + 1), np.zeros(n + 1)
    time_terms, length_terms, speed_terms = np.empty((n, WIDE)), np.empty((n, WIDE)), np.empty((n, WIDE))
    out, error, last = np.empty(3 * WIDE), 0.0, panels[n - 1, RIGHT]
    for k in range(n):
        half = 0.5 * (panels[k, RIGHT] - (panels[k - 1, RIGHT] if k > 0 else 0.0))
        at = k * COLUMNS
        to_integral(panels, at, out, 0)
        to_integral(panels, at + WIDE, out, WIDE)
        to_plain(panels, at + Y_ROW, out, 2 * WIDE)
        length = 0.0
        for j in range(WIDE):
            time_terms[k, j], length_terms[k, j] = half * out[j], half * out[WIDE + j]
            speed_terms[k, j] = out[2 * WIDE + j]
            length += length_terms[k, j]
        edges[k + 1] = panels[k, RIGHT] / last
        lengths[k + 1] = lengths[k] + length
        error += panels[k, TIME_ERROR]
    edge_times, low_times = totals_of(time_terms, time)
    error = error / time + ULP if time > 0.0 else ULP
    return edges, edge_times, lengths, time_terms, length_terms, error, low_times, speed_terms


def panelled(record: Array) -> Array:
    """Return a record with panels in place of rows of the whole leg."""
    with_panels: Array = lay_panels(record) if record[WHOLE] else record
    return with_panels


class Run(NamedTuple):
    """One run of the body as found by compiled code (`runs.follow`), from which segments are made when they are needed.

    Attributes
    ----------
    record : array
        The record of the leg (`leg_record`).
    what : int
        The code for its end (`runs.ends`).
    end : str
        The name of its end, as in `Leg.end`.
    frame : Frame or None
        The frame of the equilibrium in which it was followed.
    before : array or None
        The line of the body before it (`legs.body`), if the record has only the times of its panels.
    passed : array or None
        The record without panels, if the run has been followed again for its panels and the motion may end on it. It
        determines the place of the end.
    """

    record: Array
    what: int
    end: str
    frame: Frame | None
    before: Array | None = None
    passed: Array | None = None

    def with_panels(self, records: list[Array], until: float, lap: float) -> "list[Run]":
        """Return the run as parts with panels, the last of which ends at the same place and time up to rounding.

        ``until`` is the last time of the motion, and ``lap`` the curve's period, or 0. A part may begin laps later than
        the run, without which it has its places.
        """
        own, last, passed = self.record, records[-1], self._passed(until)
        clock = [BEGIN, BEGIN_LOW, TIME_FROM_START, TIME_FROM_END]
        last[TIME_FROM_END if last[BACK] else TIME_FROM_START] += sum((own[clock] - last[clock]).tolist())
        last[END], low = two_sum.py_func(own[END], (own[LAPS_BEFORE] - last[LAPS_BEFORE]) * lap)
        last[END_LOW] = own[END_LOW] + low
        earlier = [Run(record, END_PAUSE, "", None, None, passed) for record in records[:-1]]
        return [*earlier, self._replace(record=last, before=None, passed=passed)]

    def as_panels(self, until: float) -> "Run":
        """Return the run with panels, if its record has rows of the whole leg; ``until`` is as in `with_panels`."""
        if not self.record.item(WHOLE):
            return self
        return tuple.__new__(Run, (lay_panels(self.record), *self[1:4], None, self._passed(until)))

    def _passed(self, until: float) -> Array | None:
        """Return the record, if the motion may end at the time ``until`` within the run."""
        number = self.record.item
        begin, times = number(BEGIN), number(TIME_FROM_START) + number(TIME_FROM_END)
        return self.record if begin <= until <= begin + 2.0 * times else None

    @property
    def has_rows(self) -> bool:
        """Whether its record has rows of the whole leg, from which panels can be made."""
        return self.record.item(WHOLE) > 0.0 and self.record.item(WHOLE_WIDTH) > 0.0

    @property
    def has_panels(self) -> bool:
        """Whether its record has panels, and not only their times or rows of the whole leg."""
        return self.before is None and not self.record.item(WHOLE)

    @property
    def laps(self) -> int:
        """Whole laps of a closed curve that are not part of its places."""
        return int(self.record[LAPS_BEFORE])

    @property
    def ahead(self) -> int:
        """The number of panels from the start."""
        return int(self.record[AHEAD])

    @property
    def back(self) -> int:
        """The number of panels or rows of a field from the end."""
        return int(self.record[BACK])

    def pair(self, at: int) -> Pair:
        """Return two doubles of the record: a place, or the times from the start and from the end."""
        high, low = self.record[at : at + 2].tolist()
        return high, low

    @property
    def half_c(self) -> float:
        """``c/2`` of the march variable; infinite if that is the distance."""
        return float(self.record[HALF_C])

    def legs(self, lap: float, t_end: float) -> list[Leg]:
        """Return the run as one leg, which ends at a time in s; the curve's period is ``lap``, or 0."""
        head = self.record[: END + 1].tolist()
        start, before = head[START], head[LAPS_BEFORE] * lap
        end = start if self.what == END_LIFTOFF_AT_ONCE else head[END]
        t_end = inf if self.what == END_ASYMPTOTE else t_end
        return [Leg(start + before, end + before, head[BEGIN], t_end, int(head[HEADING]), self.end)]

    @property
    def change_counts(self) -> list[float]:
        """How often N changes its sign, as an item of a list."""
        return [self.record.item(CHANGE_COUNT)]

    @property
    def changes(self) -> list[float]:
        """Places at which N changes sign."""
        places: list[float] = self.record[self.record.size - int(self.record[CHANGE_COUNT]) :].tolist()
        return places

    @property
    def panels_ahead(self) -> Array:
        """Panels from the start."""
        return self._rows(HEAD, self.ahead, COLUMNS)

    @property
    def panels_back(self) -> Array:
        """Panels from the turn."""
        return self._rows(HEAD + self.ahead * COLUMNS, self.back, COLUMNS)

    @property
    def field(self) -> Array:
        """V**2 next to an equilibrium (`quadrature.equilibrium`)."""
        return self._rows(HEAD + self.ahead * COLUMNS, self.back, FIELD_COLUMNS)

    def _rows(self, begin: int, count: int, columns: int) -> Array:
        return self.record[begin : begin + count * columns].reshape(count, columns)


@entry(MATRIX(VECTOR, INTEGER, REAL, REAL), checked=False)
def rows_of_turned(line, count, lap, stop):  # type: ignore[no-untyped-def]
    """Return, for each of some legs that end at turns, both ends, the times there, the direction, and how often
    N changes its sign.

    Parameters
    ----------
    line : array
        The records of the legs, one directly behind the other.
    count : int
        The number of legs.
    lap : float
        The curve's period, or 0.
    stop : float
        The time at which the last leg ends.
    """
    line, rows, at = borrowed(line), np.empty((count, 6)), 0
    for k in range(count):
        record = line[at:]
        before = record[LAPS_BEFORE] * lap
        rows[k, 0], rows[k, 1], rows[k, 2] = record[START] + before, record[END] + before, record[BEGIN]
        rows[k, 3], rows[k, 4], rows[k, 5] = stop, record[HEADING], record[CHANGE_COUNT]
        if k > 0:
            rows[k - 1, 3] = record[BEGIN]
        at += int(record[USED])
    return rows


class TurnedLegs(NamedTuple):
    """Legs that one call of compiled code has followed, each of which ends at a turn.

    Attributes
    ----------
    line : array
        Their records, one directly behind the other (`leg_record`).
    size : int
        The number of legs.
    last_at : int
        Where the record of the last one begins; -1 if other runs follow.
    before : array or None
        The line of the body before each leg, as in `Run`.
    frame : Frame or None
        The frame in which all of them were followed, as in `Run`.
    """

    line: Array
    size: int
    last_at: int
    before: Array | None
    frame: Frame | None = None

    def runs(self) -> list[Run]:
        """Return a run for each leg."""
        line, size, last_at, lines_before, frame = self
        if last_at == 0:  # there is one
            before = None if lines_before is None else lines_before[0]
            return [tuple.__new__(Run, (line, END_TURN, TURN, frame, before, None))]
        runs, at = [], 0
        for k in range(size):
            end = at + int(line.item(at + USED))
            before = None if lines_before is None else lines_before[k]
            # This avoids the constructor of a named tuple, which is slow.
            runs.append(tuple.__new__(Run, (line[at:end], END_TURN, TURN, frame, before, None)))
            at = end
        return runs

    def legs(self, lap: float, t_end: float) -> list[Leg]:
        """Return the legs, the last of which ends at a time in s; the curve's period is ``lap``, or 0."""
        rows = rows_of_turned(self.line, self.size, lap, t_end).tolist()
        return [Leg(start, end, since, until, int(v), TURN) for start, end, since, until, v, _ in rows]

    @property
    def change_counts(self) -> list[float]:
        """How often N changes its sign on each leg."""
        counts: list[float] = rows_of_turned(self.line, self.size, 0.0, 0.0)[:, 5].tolist()
        return counts


class Runs:
    """The runs of a body that have no segments yet, in the order of time.

    Legs that end at turns stay as compiled code has left them until they are needed one by one, because of most motions
    only the legs or the end are asked for.
    """

    def __init__(self) -> None:
        self._parts: list[Run | TurnedLegs] = []

    def append(self, part: Run | TurnedLegs) -> None:
        """Append a run, or legs."""
        self._parts.append(part)

    def replace(self, runs: list[Run]) -> None:
        """Replace all runs by others."""
        self._parts = list(runs)

    def __len__(self) -> int:
        return sum(part.size if isinstance(part, TurnedLegs) else 1 for part in self._parts)

    def all(self) -> list[Run]:
        """Return all runs."""
        runs: list[Run] = []
        for part in self._parts:
            if isinstance(part, TurnedLegs):
                runs += part.runs()
            else:
                runs.append(part)
        self._parts = [*runs]
        return runs

    @property
    def parts(self) -> list[Run | TurnedLegs]:
        """The runs, and legs that are not runs yet."""
        return self._parts

    @property
    def last_turned(self) -> Array | None:
        """The record of the last run, if it is among the legs that stay as compiled code has left them."""
        last = self._parts[-1] if self._parts else None
        return last.line[last.last_at :] if isinstance(last, TurnedLegs) and last.last_at >= 0 else None


def along_panels(f: BoundFunctions, a: Pair, b: Pair, half_c: float, time: float, panels: Array) -> Segment:
    """Return a segment made from panels whose times add up to ``time``; its ends are two doubles each.

    ``half_c`` is c/2 of the march variable of the panels; it is infinite if that is the distance.
    """
    *laid, low_times, speed_terms = read_panels(panels, time)
    last = float(panels[-1, RIGHT])
    return Segment(
        functions=f,
        kind=REGULAR if half_c == inf else FROM_TURN,
        a=a[0],
        b=b[0],
        low_parts=(a[1], b[1]),
        turn_offset=0.0 if half_c == inf else half_c / last,
        stored_panels=(*laid, 1.0, CONVERGED),
        known_edge_times=(laid[1], low_times),
        speed_terms=speed_terms,
        march_end=last,
    )


def along_field(f: BoundFunctions, a: float, b: float, field: Array) -> Segment:
    """Return a segment towards an equilibrium b, made from the field of V**2 there; its panels begin where the rows of
    the field do.
    """
    hints = tuple(float(place) for place in b + np.sign(a - b) * field[:-1, 1])
    return Segment(functions=f, kind=TO_EQUILIBRIUM, a=a, b=b, v2=field, stop=MAX_PHASE_ANGLE, panel_breaks=hints)
