"""Rectification: a curve in any parameter is divided into pieces in arc length, from which a chart is assembled.

On each piece the arc length is the integral of ds/dlam, a polynomial as accurate as the fit of ds/dlam. Newton's method
inverts it at the Chebyshev nodes, where the curve itself then gives the tangent's angle and the curvature.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import fabs
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numpy.polynomial.chebyshev import chebint
from numpy.typing import NDArray

from gqm_sym.budgets import check_budget
from gqm_sym.errors import BudgetError, SolutionError
from gqm_sym.runtime.charts.chart import FIT, NODES, WEIGHTS
from gqm_sym.runtime.charts.evaluate import TERMS
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.types import Array

# A curve: a function of places (n,) and of offsets from each of them (n, m) that returns x, z, ds/dlam, dx/ds, dz/ds
# and kappa as an array (6, n, m); of a curve in space x, y, z, ds/dlam and the first and second derivatives of the
# coordinates with respect to arc length, as an array (10, n, m), possibly followed by further rows that belong to the
# curve.
Rows = Callable[[Array, Array], Array]
Flags = NDArray[np.bool_]
Indices = NDArray[np.integer[Any]]

# A piece is resolved if the last two coefficients of each row are below this share of the row's size.
MAX_TAIL_RATIO = 5e-16

# Below this share, coefficients that do not fall by this factor when a piece is halved are rounding noise of the curve.
MAX_NOISE_RATIO = 1e-11
MIN_FALL = 8.0

# If a piece shorter than this share of the curve is not resolved, the curve is not smooth there.
MIN_PIECE_SHARE = 1e-11

# A curve that needs more pieces oscillates, or is noise.
MAX_PIECES = 100_000

# Newton steps of the inversion; usually three are enough.
MAX_NEWTON_STEPS = 20


@dataclass(frozen=True, slots=True, kw_only=True)
class Pieces:
    """The n pieces of a curve, in their order.

    Attributes
    ----------
    places : (n, 2) array
        Where each piece begins and ends in the curve's own parameter.
    lengths : (n,) array
        Arc lengths.
    anchors : (n, 2) array
        x and z at the left edges.
    angles, curvatures : (n, TERMS) arrays
        The tangent's angle in radians, and the curvature, at the nodes.
    """

    places: Array
    lengths: Array
    anchors: Array
    angles: Array
    curvatures: Array


def joined(parts: list[Pieces]) -> Pieces:
    """Return the pieces of several curves as those of one."""
    return Pieces(
        places=np.concatenate([part.places for part in parts]),
        lengths=np.concatenate([part.lengths for part in parts]),
        anchors=np.concatenate([part.anchors for part in parts]),
        angles=np.concatenate([part.angles for part in parts]),
        curvatures=np.concatenate([part.curvatures for part in parts]),
    )


def summed(lengths: Array) -> Array:
    """Return the arc length at the edges of pieces of these lengths; each sum has about one rounding error."""
    total: Array = np.concatenate([[0.0], np.cumsum(lengths, dtype=np.longdouble).astype(np.float64)])
    return total


def unwrapped(angles: Array, start: float) -> Array:
    """Return angles along a curve without jumps by whole turns, the first within half a turn of ``start``.

    Parameters
    ----------
    angles : (n, m) array
        Angles at the m nodes of n pieces; the nodes are in decreasing order.
    start : float
        Angle at the beginning.
    """
    forwards = np.concatenate([[start], angles[:, ::-1].ravel()])
    turns = np.cumsum(np.round(np.diff(forwards) / (2.0 * np.pi)))
    smooth: Array = angles - 2.0 * np.pi * turns.reshape(angles.shape)[:, ::-1]
    return smooth


class Division(NamedTuple):
    """A curve divided into n pieces in arc length.

    Attributes
    ----------
    places : (n, 2) array
        Where each piece begins and ends in the curve's own parameter.
    lengths : (n,) array
        Arc lengths.
    at_nodes : (k, n, TERMS) array
        The rows that the curve's function returns after ds/dlam, at the nodes.
    at_edges : (k, n) array
        All rows that it returns, at the left edges.
    """

    places: Array
    lengths: Array
    at_nodes: Array
    at_edges: Array


def rectify(rows: Rows, edges: Array, *, where: str) -> Pieces:
    """Divide a planar curve into pieces in arc length, and halve them until each is resolved.

    Their angles are unwrapped, beginning with the tangent's angle at the first edge. Arguments and errors are those of
    `divided`.
    """
    places, lengths, (dxds, dzds, curvatures), anchors = divided(rows, edges, 2, where=where)
    start = float(np.arctan2(anchors[4, 0], anchors[3, 0]))
    return Pieces(
        places=places,
        lengths=lengths,
        anchors=anchors[:2].T,
        angles=unwrapped(np.arctan2(dzds, dxds), start),
        curvatures=curvatures,
    )


def divided(rows: Rows, edges: Array, dimension: int, *, where: str) -> Division:
    """Divide a curve into pieces in arc length, and halve them until each is resolved.

    Parameters
    ----------
    rows
        The curve.
    edges : (n+1,) array
        Places in the curve's own parameter, increasing; the curve is analytic between them.
    dimension
        The number of its coordinates.
    where
        Name of the curve in messages.

    Raises
    ------
    SolutionError
        If the curve has a cusp or a pole, or is not defined everywhere.
    BudgetError
        If it needs more than MAX_PIECES pieces.
    """
    low, high = edges[:-1], edges[1:]
    before = np.full(low.size, np.inf)
    shortest = MIN_PIECE_SHARE * (edges[-1] - edges[0])
    found = []
    while low.size:
        check_budget()
        if low.size > MAX_PIECES + edges.size:
            raise BudgetError(
                f"chart: {where}: not resolved by {MAX_PIECES} pieces near {float(low[0])!r}; "
                "give a shorter domain, or a curve that oscillates less"
            )
        half = 0.5 * (high - low)
        middle = low + half
        values = rows(low, half[:, None] * (1.0 + NODES))
        _check(np.all(np.isfinite(values), axis=(0, 2)), middle, where, "is not finite")
        speeds = values[dimension]
        rates = np.ascontiguousarray((half[:, None] * speeds) @ FIT.T)
        gains = np.ascontiguousarray(chebint(rates, lbnd=-1, axis=1))
        lengths = (half * (speeds.astype(np.longdouble) @ WEIGHTS)).astype(np.float64)
        # The mean rate is subtracted: the remainder is small, so that its rounding does not limit Newton's method.
        gains[:, :2] -= 0.5 * lengths[:, None]
        values = rows(low, half[:, None] * (1.0 + _invert(lengths, rates, gains)))[dimension + 1 :]
        turns = values[dimension : 2 * dimension] * lengths[:, None]
        tail = np.max([_tail(speeds), *(_tail(row, 1.0) for row in (*values[:dimension], *turns))], axis=0)
        good = (tail <= MAX_TAIL_RATIO) | ((tail <= MAX_NOISE_RATIO) & (tail > before / MIN_FALL))
        _check(good | (half > shortest), middle, where, "has a cusp or a pole, or is not smooth")
        found.append((low[good], lengths[good], values[:, good]))
        low, high, before = _halves(low[~good], middle[~good], high[~good], tail[~good])
    starts, lengths = (np.concatenate([one[k] for one in found]) for k in range(2))
    order = np.argsort(starts)
    starts = starts[order]
    return Division(
        places=np.stack([starts, np.append(starts[1:], edges[-1])], axis=1),
        lengths=lengths[order],
        at_nodes=np.concatenate([one[2] for one in found], axis=1)[:, order],
        at_edges=rows(starts, np.zeros((starts.size, 1)))[:, :, 0],
    )


def _check(good: Flags, places: Array, where: str, what: str) -> None:
    if not good.all():
        raise SolutionError(
            f"{where}: the curve {what} near {float(places[~good][0])!r}; "
            "give a domain, or points, in which it is smooth"
        )


def _halves(low: Array, middle: Array, high: Array, tail: Array) -> tuple[Array, Array, Array]:
    return np.concatenate([low, middle]), np.concatenate([middle, high]), np.concatenate([tail, tail])


def _tail(values: Array, min_size: float = 0.0) -> Array:
    """Return the last coefficients of rows of values as a share of the rows' sizes, or of ``min_size``."""
    size = np.maximum(np.abs(values).max(axis=-1), min_size)
    tail: Array = np.abs(values @ FIT[-2:].T).max(axis=-1) / size
    return tail


@Inner
def clenshaw(terms, u):  # type: ignore[no-untyped-def]
    """Return the value of a Chebyshev series, rounded otherwise than by `arithmetic.clenshaw.chebyshev_sum`."""
    one, two = 0.0, 0.0
    for j in range(terms.size - 1, 0, -1):
        one, two = 2.0 * u * one - two + terms[j], one
    return u * one - two + terms[0]


@entry(types.float64[:, ::1](types.float64[::1], types.float64[:, ::1], types.float64[:, ::1]))
def _invert(lengths, rates, gains):  # type: ignore[no-untyped-def]
    """Return, for each piece, the places u in [-1, 1] whose arc lengths are distributed over the piece like the nodes
    over [-1, 1].
    """
    out = np.empty((rates.shape[0], TERMS))
    for k in range(rates.shape[0]):
        half = 0.5 * lengths[k]
        for i in range(TERMS):
            u = NODES[i]
            for _ in range(MAX_NEWTON_STEPS):
                step = (clenshaw(gains[k], u) + half * (u - NODES[i])) / clenshaw(rates[k], u)
                u = min(max(u - step, -1.0), 1.0)
                if not fabs(step) > 1e-15:
                    break
            out[k, i] = u
    return out
