"""Charts: curves without formulas, as piecewise polynomials in arc length.

A chart gives four rows as functions of arc length s: the coordinates x and z, the tangent's angle alpha (continuous;
dx/ds = cos alpha, dz/ds = sin alpha) and the signed curvature kappa. Angle and curvature are known at the nodes of each
piece, both accurate to rounding. The coordinates are integrals of the angle's cosine and sine, so that their divided
differences do not cancel. Compiled code reads a chart from one flat array that follows the run-time parameters in ``p``
(`evaluate`).
"""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field
from math import inf
from typing import Any, NamedTuple, Protocol

import numpy as np
from numba import types
from numpy.polynomial.chebyshev import cheb2poly, chebint

from gqm_sym.runtime.arithmetic.doubledouble import ULP, two_sum
from gqm_sym.runtime.charts.evaluate import EDGES, RECORD, ROWS, TERMS, chart_rows
from gqm_sym.runtime.compiled.jit import entry
from gqm_sym.runtime.compiled.types import Array

NODES: Array = np.cos(np.pi * (np.arange(TERMS) + 0.5) / TERMS)
"""Chebyshev points of the first kind on [-1, 1], in decreasing order."""

# The matrix FIT takes values at the nodes to Chebyshev coefficients, AT_NODES takes these back to values, and _POWERS
# takes them to coefficients of powers of u. Angles are reduced before they are rounded, because noise of several ulp
# would remain otherwise. (The fits of `level_pieces` are not reduced, and differ in last bits.)
_QUARTERS = np.outer(np.arange(TERMS), 2 * np.arange(TERMS) + 1) % (4 * TERMS)
FIT: Array = (2.0 / TERMS) * np.cos(np.pi * _QUARTERS / (2 * TERMS))
FIT[0] *= 0.5

WEIGHTS: Array = (2.0 / (1.0 - np.arange(0, TERMS, 2) ** 2)) @ FIT[::2]
"""Integrals over [-1, 1] are sums of values at the nodes with these weights."""

AT_NODES: Array = np.cos(np.pi * _QUARTERS / (2 * TERMS))
_POWERS = np.array([np.pad(cheb2poly(row[: k + 1]), (0, TERMS - 1 - k)) for k, row in enumerate(np.eye(TERMS))])

# Coefficients after the last one above this share of the largest value are rounding noise, and are set to zero.
MAX_NOISE_RATIO = 2e-16

# The possible error of a row of a chart, in units in the last place of the row's size, and the factor by which such a
# change is magnified to find out its effect.
ROW_ROUNDINGS, MAGNIFIED = 3.0, 2.0**20

# A place within so many units in the last place of a corner counts as the corner, because places of points are rounded.
CORNER_ROUNDINGS = 4.0

# The distance from a corner at which its two tangents are read, as a share of the curve's length.
_CORNER_DISTANCE_SHARE = 2.0**-40

# The number of places on each piece among which the search for the nearest point begins.
_SAMPLES = 8


class ChartMaker(Hashable, Protocol):
    """A curve that makes its chart for values of the run-time parameters."""

    @property
    def shaped_by(self) -> tuple[int, ...] | None:
        """The run-time parameters that the curve depends on, by their place; None if that is not known."""

    def chart(self, p: tuple[float, ...]) -> "Chart":
        """Return the chart for parameter values in the module's order."""

    def true_curve(self, context: Any, p: tuple[Any, ...], chart: "Chart") -> Any:
        """Return the curve itself in extended precision (`exact_normals.TrueCurve`)."""

    def true_pieces(self, p: Any, chart: "Chart") -> Any:
        """Return the curve in double-double arithmetic (`double_double.pieces`), for parameters as exact numbers.

        It is None if the curve is known in doubles only.
        """

    def is_exact(self, chart: "Chart") -> bool:
        """Return whether the curve can be evaluated in extended precision everywhere on a chart."""


@entry(types.float64[:, ::1](types.float64[::1], types.float64[::1]))
def _read(block, s):  # type: ignore[no-untyped-def]
    out = np.empty((ROWS, s.size))
    chart_rows(block, (0, 1, 2, 3), s, out)
    return out


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Chart:
    """A curve in arc length.

    Attributes
    ----------
    block : array
        The numbers that compiled code reads (`evaluate`).
    low, high : float
        The domain in arc length; 0 and the period of a closed curve.
    period : float
        Length of a closed curve; 0 if the curve is open.
    ends : pair of str
        What lies at both ends of an open curve: "domain-end" or "singular-point".
    breaks : array
        Arc lengths inside the domain at which the curvature or a higher derivative jumps; panels begin there.
    corners : array
        Those of them at which the tangent itself jumps.
    origins : (n, 3) array
        For each piece, the index of the part of the track that it belongs to, and where it begins and ends in that
        part's own parameter; empty if the track has no parts.
    joints : array
        The arc length at the edges of all charts in the block, if it holds other charts than those of the curve.
    from_points : bool
        Whether its slopes are those of a spline through points, which have the rounding of the points divided by their
        distance.
    """

    block: Array
    low: float
    high: float
    period: float = 0.0
    ends: tuple[str, str] = ("domain-end", "domain-end")
    breaks: Array = field(default_factory=lambda: np.empty(0))
    corners: Array = field(default_factory=lambda: np.empty(0))
    origins: Array = field(default_factory=lambda: np.empty((0, 3)))
    joints: Array = field(default_factory=lambda: np.empty(0))
    from_points: bool = False

    @property
    def range(self) -> tuple[float, float, float]:
        """Return both ends of the arc length, infinite for a closed curve, and the period, 0 for an open one."""
        return (-inf, inf, self.period) if self.period else (self.low, self.high, 0.0)

    @property
    def edges(self) -> Array:
        """Return the arc length at the edges of the pieces."""
        return self.joints if self.joints.size else self.block[EDGES : EDGES + int(self.block[1]) + 1]

    @property
    def inner_edges(self) -> Array:
        """Return the arc length where two pieces meet, within one period."""
        return self.edges[0 if self.period else 1 : -1]

    def points(self, s: Any) -> Array:
        """Return x, z, alpha and kappa at arc lengths, as rows."""
        rows: Array = _read(self.block, np.ascontiguousarray(s, dtype=np.float64).reshape(-1))
        return rows

    def coordinates(self, s: Any) -> Array:
        """Return x and z at arc lengths, as rows."""
        return self.points(s)[:2]

    @property
    def bends(self) -> Array:
        """Return the sign of the tangent's turn at each corner: 1 where the curve bends to the left."""
        if not self.corners.size:
            return self.corners
        off = _CORNER_DISTANCE_SHARE * (self.high - self.low)
        before, after = self.points(np.append(self.corners - off, self.corners + off))[2].reshape(2, -1)
        signs: Array = np.sign(after - before)
        return signs

    def rounded(self, values: tuple[float, ...] = ()) -> Array:
        """Return rows of values, each followed by a copy of the block in which one row of one chart, or its places, are
        changed.

        The change is `MAGNIFIED` times the possible rounding error. On a closed chart whole laps are subtracted from
        places.
        """
        changes, begin = [], 0
        while begin < self.block.size:
            count, first = int(self.block[begin + 1]), begin + EDGES + 3 * int(self.block[begin + 1]) + 2
            records = self.block[first : first + count * RECORD].reshape(count, RECORD)
            sizes = np.abs(records[:, 6:]).reshape(count, ROWS, TERMS).sum(axis=2)
            # Coordinates are summed along the curve, so that their rounding error is that of the largest of them.
            sizes[:, :2] = (sizes[:, :2] + np.abs(records[:, 2:6:2])).max(axis=0)
            sizes[:, 2] = np.maximum(sizes[:, 2], 1.0)
            if self.from_points:
                slopes = sizes[:, :2].max(axis=1) * records[:, 1]
                sizes[:, 2] += slopes
                sizes[:, 3] += slopes * records[:, 1]
            end = first + count * RECORD
            changes += [(first + 6 + row * TERMS, end, ROW_ROUNDINGS * sizes[:, row]) for row in range(ROWS)]
            if self.period:
                changes.append((first, end, self.period))
            begin += int(self.block[begin])
        rows = np.empty((len(changes), len(values) + self.block.size))
        rows[:, : len(values)], blocks = values, rows[:, len(values) :]
        blocks[:] = self.block
        for block, (start, end, change) in zip(blocks, changes, strict=True):
            block[start:end:RECORD] += MAGNIFIED * ULP * change
        return rows

    def nearest(self, x: float, z: float) -> tuple[float, float]:
        """Return the arc length of the point of the curve nearest to (x, z), and the distance to it."""
        edges = self.edges
        shares = np.arange(_SAMPLES) / _SAMPLES
        s = np.append((edges[:-1, None] + np.diff(edges)[:, None] * shares).ravel(), edges[-1])
        rows = self.points(s)
        k = int(np.argmin(np.hypot(rows[0] - x, rows[1] - z)))
        step = max(s[min(k + 1, s.size - 1)] - s[k], s[k] - s[max(k - 1, 0)])
        place = float(s[k])
        for _ in range(50):
            row = self.points([place])[:, 0]
            ahead = (x - row[0]) * np.cos(row[2]) + (z - row[1]) * np.sin(row[2])
            aside = (z - row[1]) * np.cos(row[2]) - (x - row[0]) * np.sin(row[2])
            factor = max(1.0 - row[3] * aside, 0.25)
            move = float(np.clip(ahead / factor, -step, step))
            new = place + move
            if not self.period:
                new = min(max(new, self.low), self.high)
            if abs(new - place) <= 1e-16 * max(abs(place), step):
                break
            place = new
        if self.period:
            place -= self.period * np.floor((place - self.low) / self.period)
        for corner in self.corners:
            if abs(corner - place) <= CORNER_ROUNDINGS * np.spacing(max(abs(place), abs(x), abs(z))):
                place = float(corner)
        row = self.points([place])[:, 0]
        return float(place), float(np.hypot(row[0] - x, row[1] - z))


BLOCK_ORDER = (2, 0, 1, 3)
"""The coordinates, followed by the roll angle, in the order of their charts in the block of a `SpaceChart`."""

DERIVATIVE_ROWS = (1, 2, 3, 0)
"""The rows of such a chart that have a coordinate and its derivatives."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SpaceChart(Chart):
    """A curve in space in arc length.

    Its block is that of the chart of z, followed by those of x and y, and of the roll angle if there is one. In the
    chart of a coordinate, the row of the height contains this coordinate, and the rows of angle, curvature and x
    contain its first three derivatives with respect to arc length.

    Attributes
    ----------
    banked : bool
        Whether there is a roll angle.
    """

    banked: bool = False

    def coordinates(self, s: Any) -> Array:
        """Return x, y and z at arc lengths, as rows."""
        return self.derivatives(s, 0)[:3]

    def derivatives(self, s: Any, order: int) -> Array:
        """Return the derivatives of x, y and z with respect to arc length, and of the roll angle if there is one, as
        rows.

        Parameters
        ----------
        s
            Arc lengths.
        order
            The order of the derivatives, 0 (the functions themselves) to 3.
        """
        places, size = np.ascontiguousarray(s, dtype=np.float64).reshape(-1), int(self.block[0])
        order_in_block = BLOCK_ORDER[: 3 + self.banked]
        blocks = self.block[: len(order_in_block) * size].reshape(-1, size)
        return np.stack([_read(blocks[k], places)[DERIVATIVE_ROWS[order]] for k in np.argsort(order_in_block)])


class PieceData(NamedTuple):
    """The data from which the pieces of a chart are made.

    Attributes
    ----------
    anchors : (n, 2) array
        x and z at the left edge of each piece.
    angles, curvatures : (n, TERMS) arrays
        alpha and kappa at the nodes.
    tangents : (n, 2, TERMS) array, optional
        Cosine and sine of alpha at the nodes, if they are known more accurately than from alpha (near pi, for example).
    anchor_lows : (n, 2) array, optional
        The low parts of anchors that are known as two doubles.
    """

    anchors: Any
    angles: Any
    curvatures: Any
    tangents: Any = None
    anchor_lows: Any = 0.0


def assemble(
    edges: Any,
    data: PieceData,
    *,
    period: float = 0.0,
    turn: float = 0.0,
    ends: tuple[str, str] = ("domain-end", "domain-end"),
    breaks: Any = (),
    corners: Any = (),
    origins: Any = (),
) -> Chart:
    """Assemble a chart from its pieces.

    Parameters
    ----------
    edges : (n+1,) array
        Arc length at the edges of the pieces, increasing.
    data : PieceData
        The pieces.
    period, turn : float
        Length of a closed curve, and the increase of alpha over it.
    ends, breaks, corners, origins
        As `Chart` has them.
    """
    anchors, angles, curvatures, tangents, anchor_lows = data
    edges, anchors = np.asarray(edges, dtype=np.float64), np.asarray(anchors, dtype=np.float64)
    angles, half = np.asarray(angles, dtype=np.float64), 0.5 * np.diff(edges)
    known = np.stack(tangents_of(angles), axis=1) if tangents is None else np.asarray(tangents)
    second = half[:, None, None] * np.asarray(curvatures)[:, None] * np.stack([-known[:, 1], known[:, 0]], axis=1)
    constants, powers, _ = _integrated(half, (anchors, anchor_lows), known, second)
    return Chart(
        block=_block(edges, constants, powers, _fitted(angles), np.asarray(curvatures), (period, turn)),
        low=float(edges[0]),
        high=float(edges[-1]),
        period=float(period),
        ends=ends,
        breaks=np.asarray(breaks, dtype=np.float64),
        corners=np.asarray(corners, dtype=np.float64),
        origins=np.asarray(origins, dtype=np.float64).reshape(-1, 3),
    )


def assemble_in_space(
    edges: Array,
    anchors: Array,
    derivatives: Sequence[Array],
    *,
    period: float = 0.0,
    breaks: Any = (),
    origins: Any = (),
) -> "SpaceChart":
    """Assemble the chart of a track in space from a chart of each coordinate, in which that coordinate is the height.

    Parameters
    ----------
    edges : (n+1,) array
        Arc length at the edges of the pieces, increasing.
    anchors : (n, d) array
        x, y and z at the left edge of each piece, and the roll angle if there is one; floats longer than doubles keep
        their digits.
    derivatives : three (n, d, TERMS) arrays
        Their first three derivatives with respect to arc length at the nodes.
    period, breaks, origins
        As `Chart` has them.
    """
    left = np.asarray(anchors, dtype=np.float64)
    blocks = blocks_of(edges, (left, np.asarray(anchors - left, dtype=np.float64)), derivatives, period)
    return SpaceChart(
        block=np.concatenate([blocks[axis] for axis in BLOCK_ORDER[: len(blocks)]]),
        low=float(edges[0]),
        high=float(edges[-1]),
        period=float(period),
        breaks=np.asarray(breaks, dtype=np.float64),
        origins=np.asarray(origins, dtype=np.float64).reshape(-1, 3),
        banked=len(blocks) > 3,
    )


def blocks_of(edges: Array, anchors: tuple[Any, Any], derivatives: Sequence[Array], period: float) -> list[Array]:
    """Return the blocks of d charts, each of which has one of d functions of arc length as its height.

    The arguments are those of `assemble_in_space`, except that ``anchors`` are pairs of doubles; third derivatives may
    be omitted.
    """
    half, (slopes, bends, *thirds) = 0.5 * np.diff(edges), derivatives
    constants, powers, turning = _integrated(half, anchors, slopes, half[:, None, None] * bends)
    blocks = []
    for axis in range(bends.shape[1]):
        own, terms = np.zeros((half.size, 4)), np.zeros((half.size, 2, TERMS))
        own[:, 2:], terms[:, 1] = constants[:, 2 * axis : 2 * axis + 2], powers[:, axis]
        for third in thirds:
            terms[:, 0] = _fitted(third[:, axis]) @ _POWERS
        blocks.append(_block(edges, own, terms, turning[:, axis], bends[:, axis], (period, 0.0)))
    return blocks


def _integrated(half: Array, anchors: tuple[Any, Any], known: Array, second: Array) -> tuple[Array, Array, Array]:
    """Return constants and powers of u of coordinates, and Chebyshev coefficients of their slopes.

    Parameters
    ----------
    half : (n,) array
        Half the lengths of the pieces.
    anchors : pair of (n, d) arrays
        The coordinates at the left edges, as two doubles.
    known, second : (n, d, TERMS) arrays
        Their derivatives with respect to arc length at the nodes, and the derivatives of these with respect to u.
    """
    left, lows = anchors[0], np.broadcast_to(anchors[1], np.shape(anchors[0]))
    count, rows = left.shape
    constants, powers = np.empty((count, 2 * rows)), np.empty((count, rows, TERMS))
    # Second derivatives are as accurate as first ones: the tangent is integrated from them, and only its mean is
    # fitted.
    turning = np.asarray(chebint(_fitted(second), axis=2), dtype=np.float64)[:, :, :TERMS]
    turning[:, :, 0] += np.mean(known - turning @ AT_NODES, axis=2)
    for row in range(rows):
        gained = chebint(turning[:, row], lbnd=-1, axis=1)[:, :TERMS]
        powers[:, row] = half[:, None] * (gained @ _POWERS)
        # The constant term is stored as two doubles, because differences of coordinates are differences of these.
        constants[:, 2 * row], constants[:, 2 * row + 1] = two_sum.py_func(left[:, row], powers[:, row, 0])
        constants[:, 2 * row + 1] += lows[:, row]
        powers[:, row, 0] = 0.0
    return constants, powers, turning


def _block(
    edges: Array, constants: Array, coordinates: Array, angle: Array, curvatures: Array, lap: tuple[float, float]
) -> Array:
    """Return the numbers that compiled code reads, from constants and powers of the coordinates and coefficients."""
    half, (period, turn) = 0.5 * np.diff(edges), lap
    count, curvature = half.size, _fitted(np.asarray(curvatures, dtype=np.float64))
    powers, records = np.empty((count, ROWS, TERMS)), np.empty((count, RECORD))
    records[:, 0], records[:, 1], records[:, 2:6] = edges[:-1] + half, 1.0 / half, constants
    powers[:, :2], powers[:, 2], powers[:, 3] = coordinates, angle @ _POWERS, curvature @ _POWERS
    records[:, 6:] = powers.reshape(count, -1)
    # A bound on the change of alpha from the start, from bounds on the curvature and from jumps between pieces.
    bounds = np.abs(curvature).sum(axis=1)
    left, right = (powers[:, 2] @ (side ** np.arange(TERMS)) for side in (-1.0, 1.0))
    jumps = np.append(np.abs(left[1:] - right[:-1]), abs(left[0] + turn - right[-1]) if period else 0.0)
    turned = np.append(0.0, np.cumsum(2.0 * half * bounds + jumps))
    block = np.concatenate([[0.0, count, edges[0], edges[-1], period, turn], edges, turned, bounds, records.ravel()])
    block[0] = block.size
    return block


def tangents_of(angles: Array) -> tuple[Array, Array]:
    """Return cosines and sines, exactly 0 where an angle is a multiple of pi/2 up to rounding."""
    waves = np.cos(angles), np.sin(angles)
    cosines, sines = (np.where(np.abs(wave) <= ULP * np.abs(angles), 0.0, wave) for wave in waves)
    return cosines, sines


def _fitted(values: Array) -> Array:
    """Return the Chebyshev coefficients of values at the nodes (the last axis), without trailing noise."""
    coefficients = (values - values[..., :1]) @ FIT.T
    size = np.abs(values).max(axis=-1, keepdims=True)
    significant = np.abs(coefficients) > MAX_NOISE_RATIO * size
    used = np.flip(np.logical_or.accumulate(np.flip(significant, axis=-1), axis=-1), axis=-1)
    coefficients = np.where(used, coefficients, 0.0)
    coefficients[..., 0] += values[..., 0]
    return coefficients
