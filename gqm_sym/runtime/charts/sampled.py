"""Tracks given by points: an interpolating spline, or planes stitched together (paper, eq. 1).

The spline is quintic (`charts.interpolation`), so that its curvature has two continuous derivatives.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import sqrt
from typing import Any

import numpy as np
from numba import types

from gqm_sym.literals.numbers import Number, read_number
from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.charts.arc_length import Indices, Pieces, divided, rectify, summed, unwrapped
from gqm_sym.runtime.charts.chart import NODES, Chart, PieceData, assemble, assemble_in_space
from gqm_sym.runtime.charts.double_double.making import SAMPLES, TruePieces, sample_places
from gqm_sym.runtime.charts.double_double.pieces import IN_SAMPLES
from gqm_sym.runtime.charts.double_double.pieces import NODES as NODES_OF_PIECES
from gqm_sym.runtime.charts.exact_parts import Part, Parts, polynomial
from gqm_sym.runtime.charts.interpolation import DEGREE, arc_length_knots, interpolated, polynomials, thinned
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.types import MATRIX, VECTOR, Array
from gqm_sym.runtime.double_double.arithmetic import UNIT, add, divide, multiply

# The column of points in space that has the roll angle.
ROLL = 3

# A turn between two lines that is smaller than this, relative to the rounding of the points, does not count as a
# corner.
MIN_TURN = 8.0 * 2.0**-52


@dataclass(frozen=True, slots=True)
class Sampled:
    """A sampled track, which makes its chart.

    Attributes
    ----------
    points : str
        x and z of the points one after the other, separated by blanks; for a track in space x, y and z, followed by the
        roll angle if there is one.
    kind : {"spline", "linear"}
        What lies between the points.
    closed : bool
        Whether the track continues from the last point to the first. The first point is not repeated.
    in_space : bool
        Whether the points have three coordinates.
    banked : bool
        Whether points in space have a roll angle, in radians.
    keeps_all : bool
        Whether no point is left out, not even if the spline through the others is the same to rounding.
    """

    points: str
    kind: str = "spline"
    closed: bool = False
    in_space: bool = False
    banked: bool = False
    keeps_all: bool = False

    @property
    def shaped_by(self) -> tuple[int, ...]:
        """No run-time parameter shapes the track."""
        return ()

    def chart(self, p: tuple[float, ...]) -> Chart:
        """Return the chart, which does not depend on the run-time parameters."""
        return _made(self)[0]

    def is_exact(self, chart: Chart) -> bool:
        """Return whether the track lies in the plane of x and z; one in space is known to the digits of double-double
        arithmetic.
        """
        return not self.in_space

    def true_curve(self, context: Any, p: tuple[Any, ...], chart: Chart) -> Parts:
        """Return the track in extended precision, from its points as written or from the coefficients of its spline."""
        spline = _made(self)[1]
        if spline is not None:
            return Parts(context, chart, lambda k: _exact_polynomial(context, spline.t, spline.c, k))
        numbers = [read_number(number, where="points").at(context) for number in self.points.split()]
        count = len(numbers) // 2

        def ends(k: int) -> tuple[list[Any], list[Any]]:
            begin, end = (numbers[2 * i : 2 * i + 2] for i in (k, (k + 1) % count))
            return begin, end

        def plane(k: int) -> Part:
            (x, z), (to_x, to_z) = ends(k)
            return polynomial(context, 0, 1, (x, to_x - x), (z, to_z - z))

        def width(k: int) -> Any:
            (x, z), (to_x, to_z) = ends(k)
            return context.hypot(to_x - x, to_z - z)

        return Parts(context, chart, plane, width)

    def true_pieces(self, p: Sequence[Number], chart: Chart) -> TruePieces:
        """Return the track in double-double arithmetic."""
        spline, nodes = _made(self)[1], sample_places()
        if spline is None:
            numbers = np.array(
                [(n.value, n.low) for n in (read_number(t, where="points") for t in self.points.split())]
            )
            corners = numbers.reshape(-1, 2 * (2 + self.in_space))
            count = len(corners)
            return TruePieces(
                chart,
                lambda k: sample_plane(corners[k], corners[(k + 1) % count], nodes),
                in_space=self.in_space,
            )
        t, c = spline.t, np.ascontiguousarray(spline.c)
        places = [(int(part), low, high) for part, low, high in chart.origins.tolist()]
        return TruePieces(chart, lambda k: sample_spline(t, c, places[k], nodes), in_space=self.in_space)


@entry(SAMPLES(VECTOR, VECTOR, MATRIX))
def sample_plane(begin, end, nodes):  # type: ignore[no-untyped-def]
    """Return the samples of a straight line between two points, whose coordinates are two doubles each
    (`pieces.Samples`).
    """
    dimension = begin.size // 2
    samples = np.empty((dimension, 2, NODES_OF_PIECES))
    for i in range(NODES_OF_PIECES):
        share, share_low = add(0.5 * nodes[0, i], 0.5 * nodes[1, i], 0.5, 0.0)
        for row in range(dimension):
            column = row if dimension == 2 else IN_SAMPLES[row]
            x, x_low = begin[2 * column], begin[2 * column + 1]
            gap, gap_low = add(end[2 * column], end[2 * column + 1], -x, -x_low)
            gap, gap_low = multiply(gap, gap_low, share, share_low)
            samples[row, 0, i], samples[row, 1, i] = add(x, x_low, gap, gap_low)
    return samples, 4.0 * UNIT * np.abs(samples).max()


@entry(SAMPLES(VECTOR, MATRIX, types.Tuple((types.int64, types.float64, types.float64)), MATRIX))
def sample_spline(t, c, place, nodes):  # type: ignore[no-untyped-def]
    """Return the samples of a piece of a spline with the knots t and the coefficients c, by de Boor's algorithm.

    ``place`` contains the index of the piece's first knot, and the values of the spline's parameter at which the piece
    begins and ends.
    """
    k, begin, end = place
    dimension = min(c.shape[1], ROLL)
    samples, terms = np.empty((dimension, 2, NODES_OF_PIECES)), np.empty((DEGREE + 1, 2))
    width, width_low = two_sum(0.5 * end, -0.5 * begin)
    for i in range(NODES_OF_PIECES):
        share, share_low = add(nodes[0, i], nodes[1, i], 1.0, 0.0)
        at, at_low = multiply(width, width_low, share, share_low)
        at, at_low = add(at, at_low, begin, 0.0)
        for row in range(dimension):
            column = row if dimension == 2 else IN_SAMPLES[row]
            for j in range(DEGREE + 1):
                terms[j, 0], terms[j, 1] = c[k - DEGREE + j, column], 0.0
            for order in range(1, DEGREE + 1):
                for j in range(DEGREE, order - 1, -1):
                    left = t[k - DEGREE + j]
                    ahead, ahead_low = add(at, at_low, -left, 0.0)
                    span, span_low = two_sum(t[k + 1 + j - order], -left)
                    ahead, ahead_low = divide(ahead, ahead_low, span, span_low)
                    gap, gap_low = add(terms[j, 0], terms[j, 1], -terms[j - 1, 0], -terms[j - 1, 1])
                    gap, gap_low = multiply(gap, gap_low, ahead, ahead_low)
                    terms[j, 0], terms[j, 1] = add(terms[j - 1, 0], terms[j - 1, 1], gap, gap_low)
            samples[row, 0, i], samples[row, 1, i] = terms[DEGREE, 0], terms[DEGREE, 1]
    return samples, 16.0 * UNIT * np.abs(samples).max()


def _exact_polynomial(context: Any, t: Array, c: Array, k: int) -> Part:
    """Return the polynomial of a spline on [t_k, t_(k+1)] in powers of the share of that interval, by de Boor's
    algorithm.
    """
    knots = [context.mpf(float(knot)) for knot in t[k - DEGREE : k + DEGREE + 1]]
    unit = knots[DEGREE + 1] - knots[DEGREE]
    rows = []
    for row in range(2):
        found = [[context.mpf(float(value))] for value in c[k - DEGREE : k + 1, row]]
        for order in range(1, DEGREE + 1):
            for i in range(DEGREE, order - 1, -1):
                change = [high - low for high, low in zip(found[i], found[i - 1], strict=True)]
                span = knots[i + DEGREE + 1 - order] - knots[i]
                ahead = (knots[DEGREE] - knots[i]) / span
                by_power = zip([*found[i - 1], 0], [*change, 0], [0, *change], strict=True)
                found[i] = [low + ahead * same + lower * unit / span for low, same, lower in by_power]
        rows.append(found[DEGREE])
    return polynomial(context, knots[DEGREE], unit, *rows)


@lru_cache(maxsize=4)
def _made(track: Sampled) -> tuple[Chart, Any]:
    """Return the chart of a track, and its spline; None for stitched planes."""
    points = np.array(track.points.split(), dtype=np.float64).reshape(-1, 2 + track.in_space + track.banked)
    if track.closed:
        points = np.concatenate([points, points[:1]])
    if track.banked:  # roll changes by less than half a turn from point to point
        points[:, ROLL] = np.unwrap(points[:, ROLL])
    if track.kind == "spline":
        return _splined(points, track.closed, keeps_all=track.keeps_all)
    return (_lines_in_space if track.in_space else _planes)(points, track.closed), None


def _planes(points: Array, closed: bool) -> Chart:
    """Return the chart of straight pieces from point to point; each turn of the tangent is a corner."""
    steps = np.diff(points, axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    edges = summed(lengths)
    angles = np.repeat(np.arctan2(steps[:, 1], steps[:, 0])[:, None], NODES.size, axis=1)
    angles = unwrapped(angles, float(angles[0, 0]))
    # The turn at each point, from the plane before it to the one after it. The plane before the first point is the last
    # one.
    turns = np.diff(angles[:, 0], prepend=angles[-1, 0])
    turns[0] = np.remainder(turns[0] + np.pi, 2.0 * np.pi) - np.pi
    shorter = np.minimum(np.roll(lengths, 1), lengths)
    bent = np.abs(turns) > MIN_TURN * (1.0 + np.abs(points).max() / shorter)
    bent[0] &= closed
    corners = edges[:-1][bent]
    turn = 2.0 * np.pi * round(turns.sum() / (2.0 * np.pi)) if closed else 0.0
    places = np.repeat([[0.0, 1.0]], lengths.size, axis=0)
    pieces = Pieces(
        places=places, lengths=lengths, anchors=points[:-1], angles=angles, curvatures=np.zeros_like(angles)
    )
    return _assembled(pieces, np.arange(lengths.size), edges, turn, closed, corners, corners)


def _lines_in_space(points: Array, closed: bool) -> Chart:
    """Return the chart in space of straight pieces from point to point; each turn of the tangent is a corner."""
    steps = np.diff(points, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    edges, tangents = summed(lengths), steps / lengths[:, None]
    turns = np.linalg.norm(tangents - np.roll(tangents, 1, axis=0), axis=1)
    shorter = np.minimum(np.roll(lengths, 1), lengths)
    bent = turns > MIN_TURN * (1.0 + np.abs(points).max() / shorter)
    bent[0] &= closed
    corners, places = edges[:-1][bent], np.repeat([[0.0, 1.0]], lengths.size, axis=0)
    slopes = np.repeat(tangents[:, :, None], NODES.size, axis=2)
    chart = assemble_in_space(
        edges,
        points[:-1],
        [slopes, np.zeros_like(slopes), np.zeros_like(slopes)],
        period=edges[-1] if closed else 0.0,
        breaks=corners,
        origins=np.column_stack([np.arange(lengths.size), places]),
    )
    return replace(chart, corners=corners, from_points=True)


def _splined(points: Array, closed: bool, *, keeps_all: bool) -> tuple[Chart, Any]:
    """Return the chart of the interpolating spline; each of its polynomials becomes one or more pieces of the chart."""
    knots, ends = arc_length_knots(points[:, :ROLL], closed)
    # The increase of the roll angle over a lap is taken as linear, and the rest is periodic.
    rates = (points[-1] - points[0]) / knots[-1] if closed else np.zeros(points.shape[1])
    points = points - rates * knots[:, None]
    points, knots = (points, knots) if keeps_all else thinned(points, knots, ends)
    spline = interpolated(points, knots, ends)
    terms = polynomials(spline, knots)
    terms[:, :, 0] += rates * knots[:-1, None]
    terms[:, :, 1] += rates
    if points.shape[1] > 2:
        return _in_space(knots, terms, spline, closed), spline
    pieces = rectify(lambda left, offsets: _evaluate(knots, terms, left, offsets), knots, where="sampled")
    edges, turn = summed(pieces.lengths), 0.0
    if closed:
        turn = 2.0 * np.pi * round((pieces.angles[-1, 0] - pieces.angles[0, -1]) / (2.0 * np.pi))
    # The fifth derivative jumps at the points; on panels across them, the coefficients would stop decreasing at 1e-7 of
    # the integrand.
    breaks = edges[:-1] if closed else edges[1:-1]
    return _assembled(pieces, _intervals(spline, pieces.places), edges, turn, closed, breaks, ()), spline


def _intervals(spline: Any, places: Array) -> Indices:
    """Return the index of the first knot of the spline's interval on which each piece lies."""
    found: Indices = np.searchsorted(spline.t, places.mean(axis=1), side="right") - 1
    return found


def _in_space(knots: Array, terms: Array, spline: Any, closed: bool) -> Chart:
    """Return the chart of a spline in space, perhaps with a roll angle behind its coordinates."""

    def rows(left: Array, offsets: Array) -> Array:
        k = np.clip(np.searchsorted(knots, left, side="right") - 1, 0, knots.size - 2)
        part, place = terms[k], (left - knots[k])[:, None] + offsets
        value, first, second, third = (np.zeros((terms.shape[1], *offsets.shape)) for _ in range(4))
        for power in range(DEGREE, -1, -1):
            third = third * place + 3.0 * second
            second = second * place + 2.0 * first
            first = first * place + value
            value = value * place + part[:, :, power].T[:, :, None]
        speed = np.sqrt((first[:ROLL] ** 2).sum(axis=0))
        # All columns are differentiated with respect to arc length, as the coordinates are; gain and growth are the
        # derivatives of the speed.
        tangent = first / speed
        gain = (tangent * second)[:ROLL].sum(axis=0)
        bend = (second - tangent * gain) / (speed * speed)
        growth = (speed * bend * second + tangent * third)[:ROLL].sum(axis=0)
        change = (third - tangent * growth - 3.0 * speed * gain * bend) / speed**3
        parts = [part[:ROLL] for part in (value, speed[None], tangent, bend, change)]
        return np.concatenate([*parts, *(part[ROLL:] for part in (value, tangent, bend, change))])

    found = divided(rows, knots, ROLL, where="sampled")
    edges, behind = summed(found.lengths), 3 * ROLL + 1
    anchors = np.concatenate([found.at_edges[:ROLL], found.at_edges[ROLL + behind :][:1]])
    derivatives = [
        np.concatenate([found.at_nodes[ROLL * k : ROLL * (k + 1)], found.at_nodes[behind + k :][:1]]).swapaxes(0, 1)
        for k in range(3)
    ]
    chart = assemble_in_space(
        edges,
        anchors.T,
        derivatives,
        period=edges[-1] if closed else 0.0,
        breaks=edges[:-1] if closed else edges[1:-1],
        origins=np.column_stack([_intervals(spline, found.places), found.places]),
    )
    return replace(chart, from_points=True)


def _assembled(
    pieces: Pieces, parts: Indices, edges: Array, turn: float, closed: bool, breaks: object, corners: object
) -> Chart:
    chart = assemble(
        edges,
        PieceData(pieces.anchors, pieces.angles, pieces.curvatures),
        period=edges[-1] if closed else 0.0,
        turn=turn,
        breaks=breaks,
        corners=corners,
        origins=np.column_stack([parts, pieces.places]),
    )
    return replace(chart, from_points=True)


@Inner
def taylor(terms, t):  # type: ignore[no-untyped-def]
    """Return a polynomial and its first two derivatives."""
    value, first, second = 0.0, 0.0, 0.0
    for power in range(DEGREE, -1, -1):
        second = second * t + 2.0 * first
        first = first * t + value
        value = value * t + terms[power]
    return value, first, second


@entry(types.float64[:, :, ::1](types.float64[::1], types.float64[:, :, ::1], types.float64[::1], MATRIX))
def _evaluate(knots, terms, left, offsets):  # type: ignore[no-untyped-def]
    """Return x, z, ds/du, dx/ds, dz/ds and kappa of the spline at offsets from places."""
    out = np.empty((6, *offsets.shape))
    for k in range(left.size):
        low, high = 0, knots.size - 1
        while high - low > 1:
            middle = (low + high) // 2
            if left[k] >= knots[middle]:
                low = middle
            else:
                high = middle
        for i in range(offsets.shape[1]):
            t = (left[k] - knots[low]) + offsets[k, i]
            x, dx, ddx = taylor(terms[low, 0], t)
            z, dz, ddz = taylor(terms[low, 1], t)
            speed = sqrt(dx * dx + dz * dz)
            out[0, k, i], out[1, k, i], out[2, k, i] = x, z, speed
            out[3, k, i], out[4, k, i] = dx / speed, dz / speed
            out[5, k, i] = (dx * ddz - dz * ddx) / speed**3
    return out
