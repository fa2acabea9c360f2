"""Where a motion is at many times."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gqm_sym.runtime.course import Course, Piece
from gqm_sym.runtime.stretch import Array


@dataclass(frozen=True, slots=True)
class Located:
    """Where a motion is at times: which of them fall on a piece, and the anomalies of its stretch there."""

    pieces: tuple[tuple[Piece, NDArray[np.bool_], Array], ...]
    at_launch: NDArray[np.bool_]
    laps: Array
    course: Course

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


def locate(course: Course, t: Array, t_low: Array) -> Located:
    """Where on a course times fall."""
    laps, rest, rest_low = course.reduced(t, t_low)
    which = course.piece_of(rest)
    pieces = []
    for k in np.unique(which):
        piece, mask = course.pieces[k], which == k
        laps[mask] += piece.laps
        phi = course.anomalies(piece, rest[mask], rest_low[mask])
        pieces.append((piece, mask, np.clip(phi, 0.0, piece.stretch.edges[-1])))
    return Located(tuple(pieces), (rest == 0.0) & (rest_low == 0.0), laps, course)
