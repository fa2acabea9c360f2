"""Where a motion is at a time: pieces of stretches that follow each other, repeated where the motion is periodic."""

from dataclasses import dataclass

import numpy as np

from gqm_sym.runtime.doubledouble import two_sum
from gqm_sym.runtime.entries import reduce_many
from gqm_sym.runtime.stretch import Array, Stretch

Pair = tuple[float, float]
ZERO: Pair = (0.0, 0.0)


def plus(a: Pair, b: Pair) -> Pair:
    """Sum of two numbers that are each two doubles."""
    s, e = two_sum.py_func(a[0], b[0])
    t, f = two_sum.py_func(a[1], b[1])
    s, e = two_sum.py_func(s, e + t)
    return two_sum.py_func(s, e + f)  # type: ignore[no-any-return]


def minus(a: Pair, b: Pair) -> Pair:
    """Difference of two numbers that are each two doubles."""
    return plus(a, (-b[0], -b[1]))


@dataclass(frozen=True, slots=True, kw_only=True)
class Piece:
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

    stretch: Stretch
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
class Course:
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

    pieces: tuple[Piece, ...]
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

    def anomalies(self, piece: Piece, rest: Array, rest_low: Array) -> Array:
        """Anomalies on a piece's stretch at reduced times."""
        s, e = two_sum.py_func(rest, -piece.t_start[0])
        e = e + (rest_low - piece.t_start[1])
        r, low = two_sum.py_func(piece.r_start[0], piece.sense * s)
        low = low + (piece.r_start[1] + piece.sense * e)
        # The table runs on the stretch's own clock, which may be a unit in the last place fast or slow.
        low = low + r * self.pace
        return piece.stretch.anomaly(np.ascontiguousarray(r), np.ascontiguousarray(low))


def libration(stretch: Stretch, *, direction: int, tau: Pair, phase: Pair, phi: float) -> tuple[Piece, ...]:
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
    pieces: list[Piece] = []
    t = ZERO
    for sense, (start, phi_start), (stop, phi_stop), end in cuts:
        if start == stop:
            continue
        piece = Piece(
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
