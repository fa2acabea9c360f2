"""Tracks that are given as polynomials, piece by piece, with the origin of the arc length at one of their joints."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval

from gqm_sym.literals.numbers import Number
from gqm_sym.runtime.charts.arc_length import Indices, Pieces, rectify, summed
from gqm_sym.runtime.charts.chart import Chart, PieceData, assemble
from gqm_sym.runtime.charts.double_double.making import TruePieces, starting_context
from gqm_sym.runtime.charts.exact_parts import Parts, polynomial
from gqm_sym.runtime.compiled.types import Array


class PiecePolynomials(NamedTuple):
    """A piece as it is declared: the ends of its parameter, and the coefficients of x and z, lowest power first."""

    begin: str
    end: str
    x: list[str]
    z: list[str]


@dataclass(frozen=True, slots=True)
class Polynomials:
    """A track of polynomials, which makes its chart.

    Attributes
    ----------
    pieces : str
        A line for each piece: both ends of its parameter u, then the coefficients of x and as many of z, in powers of
        u, as decimal numbers separated by blanks. Pieces meet exactly.
    origin : int
        The number of pieces before the place where arc length is 0.
    breaks : tuple of int
        The numbers of pieces before joints at which the curvature or a higher derivative jumps.
    """

    pieces: str
    origin: int = 0
    breaks: tuple[int, ...] = ()

    @property
    def shaped_by(self) -> tuple[int, ...]:
        """No run-time parameter shapes the track."""
        return ()

    def chart(self, p: tuple[float, ...]) -> Chart:
        """Return the chart, which does not depend on the run-time parameters."""
        return _made(self)

    def is_exact(self, chart: Chart) -> bool:
        """Return True: polynomials are known exactly."""
        return True

    def true_curve(self, context: Any, p: tuple[Any, ...], chart: Chart) -> Parts:
        """Return the track in extended precision."""
        rows = [
            [[context.mpf(term) for term in row] for row in (piece.x, piece.z)] for piece in read_pieces(self.pieces)
        ]
        return Parts(context, chart, lambda k: polynomial(context, 0, 1, *rows[k]))

    def true_pieces(self, p: Sequence[Number], chart: Chart) -> TruePieces:
        """Return the track in double-double arithmetic."""
        context = starting_context()
        return TruePieces(chart, self.true_curve(context, (), chart).sample)


def read_pieces(text: str) -> list[PiecePolynomials]:
    """Read the lines of a track of polynomials."""
    pieces = []
    for line in text.strip().splitlines():
        begin, end, *terms = line.split()
        pieces.append(PiecePolynomials(begin, end, terms[: len(terms) // 2], terms[len(terms) // 2 :]))
    return pieces


@lru_cache(maxsize=4)
def _made(track: Polynomials) -> Chart:
    """Return the chart, in which each polynomial becomes one or more pieces."""
    found: list[Pieces] = []
    parts: list[Indices] = []
    for number, piece in enumerate(read_pieces(track.pieces)):
        coordinates = [np.array(row, dtype=np.float64) for row in (piece.x, piece.z)]
        found.append(
            rectify(
                lambda left, offsets, rows=coordinates: _rows(rows, left[:, None] + offsets),  # type: ignore[misc]
                np.array([piece.begin, piece.end], dtype=np.float64),
                where="track of polynomials",
            )
        )
        parts.append(np.full(found[-1].lengths.size, number))
    angles: list[Array] = []
    for part in found:  # each begins with an angle between -pi and pi
        gap = angles[-1][-1, 0] - part.angles[0, -1] if angles else 0.0
        angles.append(part.angles + 2.0 * np.pi * np.round(gap / (2.0 * np.pi)))
    which, lengths = np.concatenate(parts), np.concatenate([part.lengths for part in found])
    before = which < track.origin
    # Arc length is summed from its origin in both directions, so that it is fully accurate near the origin.
    edges = np.append(-summed(lengths[before][::-1])[:0:-1], summed(lengths[~before]))
    joints = np.flatnonzero(np.diff(which)) + 1
    return assemble(
        edges,
        PieceData(
            np.concatenate([part.anchors for part in found]),
            np.concatenate(angles),
            np.concatenate([part.curvatures for part in found]),
        ),
        breaks=[edges[joint] for joint in joints if which[joint] in track.breaks],
        origins=np.column_stack([which, np.concatenate([part.places for part in found])]),
    )


def _rows(coordinates: list[Array], u: Array) -> Array:
    """Return x, z, ds/du, dx/ds, dz/ds and kappa at values of a piece's parameter (`arc_length.Rows`)."""
    (x, dx, ddx), (z, dz, ddz) = (
        [polyval(u, terms) for terms in (row, polyder(row), polyder(row, 2))] for row in coordinates
    )
    speed = np.hypot(dx, dz)
    return np.stack([x, z, speed, dx / speed, dz / speed, (dx * ddz - dz * ddx) / speed**3])
