"""Where a motion is at a time: segments that follow each other, repeated where the motion is periodic."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gqm_sym.runtime.arithmetic.doubledouble import ZERO, Pair, minus, plus, reduce_many, two_sum
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.motion.segment import Segment


@dataclass(frozen=True, slots=True, kw_only=True)
class TimedSegment:
    """A part of a stretch that is run through once.

    Attributes
    ----------
    sense : int
        +1 where it is run from the stretch's end ``a``, -1 where towards it.
    r_start, r_stop : pair of float
        Time from the stretch's end ``a`` at the piece's start and stop, each as two doubles.
    phi_start, phi_stop : float
        The anomalies there.
    t_start : pair of float
        When it begins.
    s_a : float
        Arc length of the stretch's end ``a``, from the launch.
    end : str
        What ends it.
    laps : int
        How many times the closed curve has been run round before: places on the stretch are within one lap.
    """

    stretch: Segment
    sense: int
    r_start: Pair
    r_stop: Pair
    phi_start: float
    phi_stop: float
    t_start: Pair
    s_a: float
    end: str
    laps: int = 0

    @property
    def t_stop(self) -> Pair:
        """When it ends."""
        spent = minus(self.r_stop, self.r_start)
        return plus(self.t_start, (self.sense * spent[0], self.sense * spent[1]))

    @property
    def direction(self) -> int:
        """The sign of ds/dt."""
        return self.sense * self.stretch.direction


@dataclass(frozen=True, slots=True, kw_only=True)
class Trajectory:
    """Pieces in the order of time.

    Attributes
    ----------
    pieces : tuple of Piece
    period : pair of float or None
        After which they repeat.
    lap, lap_length : float
        By how much the parameter and the arc length grow in a period (circulation).
    pace : float
        Relative difference of the stretches' own clocks from the exact time, where that is known.
    """

    pieces: tuple[TimedSegment, ...]
    period: Pair | None = None
    lap: float = 0.0
    lap_length: float = 0.0
    pace: float = 0.0

    def reduced(self, t: Array, t_low: Array) -> tuple[Array, Array, Array]:
        """Whole periods, and the time that is left."""
        if self.period is None:
            return np.zeros_like(t), t, t_low
        count, rest, rest_low = reduce_many(t, t_low, *self.period)
        return count, rest, rest_low

    def piece_of(self, rest: Array) -> np.ndarray:
        """Which piece each reduced time falls on."""
        starts = np.array([piece.t_start[0] for piece in self.pieces])
        return np.clip(np.searchsorted(starts, rest, side="right") - 1, 0, len(self.pieces) - 1)

    def anomalies(self, piece: TimedSegment, rest: Array, rest_low: Array) -> Array:
        """Anomalies on a piece's stretch at reduced times."""
        s, e = two_sum.py_func(rest, -piece.t_start[0])
        e = e + (rest_low - piece.t_start[1])
        r, low = two_sum.py_func(piece.r_start[0], piece.sense * s)
        low = low + (piece.r_start[1] + piece.sense * e)
        # The table runs on the stretch's own clock, which may be a unit in the last place fast or slow.
        low = low + r * self.pace
        return piece.stretch.anomaly(np.ascontiguousarray(r), np.ascontiguousarray(low))


def libration(stretch: Segment, *, direction: int, tau: Pair, phase: Pair, phi: float) -> tuple[TimedSegment, ...]:
    """One period between two turning points.

    ``phase`` is the time from the end ``a`` to the launch place, whose anomaly is ``phi``.
    """
    a, b, launch = (ZERO, 0.0), (tau, stretch.stop), (phase, phi)
    first, second = (a, b) if direction > 0 else (b, a)
    cuts = [
        (direction, launch, second, "turn"),
        (-direction, second, first, "turn"),
        (direction, first, launch, "horizon"),
    ]
    s_a = -float(stretch.lengths(np.array([phi]))[0])
    pieces: list[TimedSegment] = []
    t = ZERO
    for sense, (start, phi_start), (stop, phi_stop), end in cuts:
        if start == stop:
            continue
        piece = TimedSegment(
            stretch=stretch,
            sense=sense,
            r_start=start,
            r_stop=stop,
            phi_start=phi_start,
            phi_stop=phi_stop,
            t_start=t,
            s_a=s_a,
            end=end,
        )
        pieces.append(piece)
        t = piece.t_stop
    return tuple(pieces)


@dataclass(frozen=True, slots=True)
class PhasePoints:
    """Where a motion is at times: which of them fall on a piece, and the anomalies of its stretch there."""

    pieces: tuple[tuple[TimedSegment, NDArray[np.bool_], Array], ...]
    at_launch: NDArray[np.bool_]
    laps: Array
    course: Trajectory

    def places(self, launch: float) -> Array:
        """The parameter within the lap; exactly the launch place at launch."""
        lam = np.full_like(self.laps, launch)
        for piece, mask, phi in self.pieces:
            lam[mask] = piece.stretch.places(phi)
        lam[self.at_launch] = launch
        return lam

    def arc_lengths(self) -> Array:
        """Arc length from the launch, within the lap."""
        s = np.zeros_like(self.laps)
        for piece, mask, phi in self.pieces:
            s[mask] = piece.s_a + piece.stretch.direction * piece.stretch.lengths(phi)
        s[self.at_launch] = 0.0
        return s

    def velocities(self, launch: float) -> Array:
        """ds/dt; exactly that of the launch at launch."""
        v = np.zeros_like(self.laps)
        for piece, mask, phi in self.pieces:
            v[mask] = piece.direction * piece.stretch.speeds(phi)
        v[self.at_launch] = launch
        return v


def locate(course: Trajectory, t: Array, t_low: Array) -> PhasePoints:
    """Where on a course times fall."""
    laps, rest, rest_low = course.reduced(t, t_low)
    which = course.piece_of(rest)
    pieces = []
    for k in np.unique(which):
        piece, mask = course.pieces[k], which == k
        laps[mask] += piece.laps
        phi = course.anomalies(piece, rest[mask], rest_low[mask])
        pieces.append((piece, mask, np.clip(phi, 0.0, piece.stretch.edges[-1])))
    return PhasePoints(tuple(pieces), (rest == 0.0) & (rest_low == 0.0), laps, course)
