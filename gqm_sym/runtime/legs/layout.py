"""The segments of a motion with losses, one after the other from launch."""

from collections.abc import Iterable
from itertools import pairwise

import numpy as np

from gqm_sym.runtime.arithmetic.doubledouble import ULP, ZERO, Pair
from gqm_sym.runtime.launch.functions import BoundFunctions
from gqm_sym.runtime.legs.advance import END_LIFTOFF_AT_ONCE
from gqm_sym.runtime.legs.leg_record import (
    AHEAD,
    BACK,
    BEGIN,
    BEGIN_LOW,
    END,
    END_LOW,
    HALF_C,
    HEAD,
    LAPS_BEFORE,
    MIDDLE,
    MIDDLE_LOW,
    START,
    START_LOW,
    TIME_FROM_END,
    TIME_FROM_START,
)
from gqm_sym.runtime.legs.leg_segments import Run, along_field, along_panels
from gqm_sym.runtime.legs.runs.ends import END_ASYMPTOTE, END_LIFTOFF
from gqm_sym.runtime.motion.segments.segment import Segment
from gqm_sym.runtime.motion.trajectory import TimedSegment, stop_time

# A change of the contact force's sign within this many roundings of the end of a piece counts as the end.
END_ROUNDINGS = 8.0


class Layout:
    """The segments of runs that follow each other from launch.

    Parameters
    ----------
    functions : BoundFunctions
        The functions of the launch.

    Attributes
    ----------
    runs : list of Run
        The runs, each with its panels.
    segments : list of TimedSegment
        Their segments, cut where N changes its sign.
    """

    def __init__(self, functions: BoundFunctions) -> None:
        self._functions = functions
        self.runs: list[Run] = []
        self.segments: list[TimedSegment] = []
        self._clock, self._arc, self._laps = ZERO, 0.0, 0

    def lay(self, run: Run) -> None:
        """Make segments of the next run."""
        f, head = self._functions, run.record[:HEAD].tolist()
        end, middle = (head[END], head[END_LOW]), (head[MIDDLE], head[MIDDLE_LOW])
        self.runs.append(run)
        self._clock, self._laps = (head[BEGIN], head[BEGIN_LOW]), int(head[LAPS_BEFORE])
        if head[AHEAD]:
            start, time = (head[START], head[START_LOW]), head[TIME_FROM_START]
            segment = along_panels(f, start, middle, head[HALF_C], time, run.panels_ahead)
            if run.what == END_LIFTOFF_AT_ONCE:
                self._append(segment, 1, [(ZERO, 0.0)] * 2, run.end)
                return
            self._add(segment, 1, run, "" if head[BACK] else run.end)
        if run.what == END_ASYMPTOTE and head[BACK]:
            self._add(along_field(f, middle[0], end[0], run.field), 1, run, run.end)
        elif head[BACK]:
            segment = along_panels(f, end, middle, 0.0, head[TIME_FROM_END], run.panels_back)
            self._add(segment, -1, run, run.end)

    def _add(self, segment: Segment, sense: int, run: Run, end: str) -> None:
        """Append a segment, cut where N changes its sign."""
        cuts, ends_at_change = _changes_on(segment, sense, run, is_open=not end)
        times = segment.times(np.array(cuts)).tolist() if cuts else ()
        marks = [(ZERO, 0.0), *(((r, 0.0), phi) for r, phi in zip(times, cuts, strict=True))]
        marks.append(((segment.duration, 0.0), segment.stop))
        marks.sort(key=lambda mark: sense * mark[1])
        self._append(segment, sense, marks, "contact-sign" if ends_at_change else end)

    def _append(self, segment: Segment, sense: int, marks: list[tuple[Pair, float]], end: str) -> None:
        """Append the parts of a segment between marks, each a time from its end ``a`` and a phase angle."""
        arc = segment.direction * segment.length
        for k, ((r_start, phi_start), (r_stop, phi_stop)) in enumerate(pairwise(marks)):
            t_start, self._clock = self._clock, stop_time(sense, r_start, r_stop, self._clock)
            piece = TimedSegment(
                segment=segment,
                sense=sense,
                r_start=r_start,
                r_stop=r_stop,
                phi_start=phi_start,
                phi_stop=phi_stop,
                t_start=t_start,
                t_stop=self._clock,
                s_a=self._arc if sense > 0 else self._arc - arc,
                end=end if k == len(marks) - 2 else "contact-sign",
                laps=self._laps,
                leg=len(self.runs) - 1,
            )
            self.segments.append(piece)
        self._arc += sense * arc


def _changes_on(segment: Segment, sense: int, run: Run, *, is_open: bool) -> tuple[list[float], bool]:
    """Return the phase angles inside a segment at which N changes its sign, and whether it does so at the end of a
    segment that another one continues (``is_open``).
    """
    changes = run.changes
    if not changes:
        return [], False
    low, high = sorted((segment.a, segment.b))
    rounding = END_ROUNDINGS * ULP * max(abs(low), abs(high))

    def without(changes: Iterable[float], place: float) -> list[float]:
        return [change for change in changes if abs(change - place) > rounding]

    # A change in the middle of a run belongs to the part that it ends, and not to the next one.
    changes = without(changes, segment.b) if sense < 0 and run.ahead else changes
    found = len(changes)
    if is_open or run.what == END_LIFTOFF:
        changes = without(changes, segment.b if sense > 0 else segment.a)
    inside = [segment.phase_angle_of(*segment.offsets(place)) for place in changes if low < place < high]
    return inside, is_open and len(changes) < found
