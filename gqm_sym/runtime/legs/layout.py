"""The segments of a motion with losses, one after the other from launch."""

from collections.abc import Iterable
from itertools import pairwise

import numpy as np

from gqm_sym.runtime.arithmetic.doubledouble import ULP, ZERO, Pair
from gqm_sym.runtime.launch.functions import BoundFunctions
from gqm_sym.runtime.legs.advance import END_LIFTOFF_AT_ONCE
from gqm_sym.runtime.legs.leg_record import BEGIN, END, MIDDLE, START, TIME_FROM_START
from gqm_sym.runtime.legs.leg_segments import Run, along_field, along_panels
from gqm_sym.runtime.legs.runs.ends import END_ASYMPTOTE, END_LIFTOFF
from gqm_sym.runtime.motion.segments.segment import Segment
from gqm_sym.runtime.motion.trajectory import TimedSegment

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
        self._clock, self._arc = ZERO, 0.0

    def lay(self, run: Run) -> None:
        """Make segments of the next run."""
        f, end, middle = self._functions, run.pair(END), run.pair(MIDDLE)
        self.runs.append(run)
        self._clock, (ahead, back) = run.pair(BEGIN), run.pair(TIME_FROM_START)
        if run.ahead:
            segment = along_panels(f, run.pair(START), middle, run.half_c, ahead, run.panels_ahead)
            if run.what == END_LIFTOFF_AT_ONCE:
                self._append(segment, 1, [(ZERO, 0.0)] * 2, run.end, run.laps)
                return
            self._add(segment, 1, run, "" if run.back else run.end)
        if run.what == END_ASYMPTOTE and run.back:
            self._add(along_field(f, middle[0], end[0], run.field), 1, run, run.end)
        elif run.back:
            self._add(along_panels(f, end, middle, 0.0, back, run.panels_back), -1, run, run.end)

    def _add(self, segment: Segment, sense: int, run: Run, end: str) -> None:
        """Append a segment, cut where N changes its sign."""
        low, high = sorted((segment.a, segment.b))
        rounding = END_ROUNDINGS * ULP * max(abs(low), abs(high))

        def without(changes: Iterable[float], place: float) -> list[float]:
            return [change for change in changes if abs(change - place) > rounding]

        # A change in the middle of a run belongs to the part that it ends, and not to the next one.
        changes = without(run.changes, segment.b) if sense < 0 and run.ahead else list(run.changes)
        if not end or run.what == END_LIFTOFF:
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
                leg=len(self.runs) - 1,
            )
            self.segments.append(piece)
            self._clock = piece.t_stop
        self._arc += sense * segment.direction * segment.length
