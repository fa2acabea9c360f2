"""Curves in a parameter of their own as pieces in arc length: what charts are assembled from.

On each piece the length is the integral of ds/dlam, a polynomial that is as exact as ds/dlam is resolved; Newton's
method turns it round at the nodes. Angle and curvature are then read from the curve itself, there.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import fabs
from typing import Any

import numpy as np
from numba import types
from numpy.polynomial.chebyshev import chebint
from numpy.typing import NDArray

from gqm_sym.budgets import spend
from gqm_sym.errors import BudgetError, SolutionError
from gqm_sym.runtime.charts.chart import FIT, NODES
from gqm_sym.runtime.charts.evaluate import TERMS
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.types import Array

# From places (n) and offsets from each of them (n, m) to rows x, z, ds/dlam, dx/ds, dz/ds and kappa (6, n, m).
Rows = Callable[[Array, Array], Array]
Flags = NDArray[np.bool_]
Indices = NDArray[np.integer[Any]]

# The last coefficients of a row, as a share of its size, on a piece that is short enough.
TAIL = 5e-16

# Below this level, coefficients that halving a piece does not bring down are the curve's own rounding noise.
PLATEAU = 1e-11
FALLING = 8.0

# A piece this short, as a share of the whole, that is not resolved: the curve is not smooth there.
SHORTEST = 1e-11

# Pieces beyond those that were given: a curve that needs more oscillates, or is noise.
MOST_PIECES = 100_000
_SOLUTIONS = 20  # Newton steps; from where they begin, three are enough


@dataclass(frozen=True, slots=True, kw_only=True)
class Pieces:
    """Pieces of a curve in their order: lengths, left edges' coordinates, and angle and curvature at the nodes.

    ``places`` are where each begins and ends in the curve's own parameter, (n, 2).
    """

    places: Array
    lengths: Array
    anchors: Array
    angles: Array
    curvatures: Array


def joined(parts: list[Pieces]) -> Pieces:
    """Pieces one after the other."""
    return Pieces(
        places=np.concatenate([part.places for part in parts]),
        lengths=np.concatenate([part.lengths for part in parts]),
        anchors=np.concatenate([part.anchors for part in parts]),
        angles=np.concatenate([part.angles for part in parts]),
        curvatures=np.concatenate([part.curvatures for part in parts]),
    )


def summed(lengths: Array) -> Array:
    """Arc length at the edges of pieces of these lengths: each sum rounded once or so."""
    total: Array = np.concatenate([[0.0], np.cumsum(lengths, dtype=np.longdouble).astype(np.float64)])
    return total


def unwrapped(angles: Array, start: float) -> Array:
    """Angles along a curve without jumps of whole turns, the first of them within half a turn of ``start``.

    ``angles`` are at the nodes of pieces, in rows; the nodes run backwards.
    """
    forwards = np.concatenate([[start], angles[:, ::-1].ravel()])
    turns = np.cumsum(np.round(np.diff(forwards) / (2.0 * np.pi)))
    smooth: Array = angles - 2.0 * np.pi * turns.reshape(angles.shape)[:, ::-1]
    return smooth


def rectify(rows: Rows, edges: Array, *, where: str) -> Pieces:
    """The pieces of a curve between edges in its own parameter, halved until each is resolved.

    Parameters
    ----------
    rows
        The curve.
    edges : (n+1,) array
        Places, growing, where pieces must begin: the curve is analytic between them.
    where
        What is being rectified, for messages.

    Returns
    -------
    Pieces
        Whose angles are unwrapped, from the angle of the tangent at the first edge.

    Raises
    ------
    SolutionError
        If the curve has a cusp or a pole, or is not defined throughout.
    """
    low, high = edges[:-1], edges[1:]
    before = np.full(low.size, np.inf)
    shortest = SHORTEST * (edges[-1] - edges[0])
    found = []
    while low.size:
        spend()
        if low.size > MOST_PIECES + edges.size:
            raise BudgetError(
                f"chart: {where}: not resolved by {MOST_PIECES} pieces near {float(low[0])!r}; "
                "give a shorter domain, or a curve that oscillates less"
            )
        half = 0.5 * (high - low)
        middle = low + half
        values = rows(low, half[:, None] * (1.0 + NODES))
        _check(np.all(np.isfinite(values), axis=(0, 2)), middle, where, "is not finite")
        rates = np.ascontiguousarray((half[:, None] * values[2]) @ FIT.T)
        gains = np.ascontiguousarray(chebint(rates, lbnd=-1, axis=1))
        lengths = gains.sum(axis=1)
        # What the length is beyond that at the mean rate, which is little: so Newton's steps are not rounded as it is.
        gains[:, :2] -= 0.5 * lengths[:, None]
        speeds = values[2]
        values = rows(low, half[:, None] * (1.0 + _invert(lengths, rates, gains)))
        bends = values[5] * lengths[:, None]
        tail = np.max([_tail(speeds), _tail(values[3], 1.0), _tail(values[4], 1.0), _tail(bends, 1.0)], axis=0)
        good = (tail <= TAIL) | ((tail <= PLATEAU) & (tail > before / FALLING))
        _check(good | (half > shortest), middle, where, "has a cusp or a pole, or is not smooth")
        angles = np.arctan2(values[4], values[3])
        found.append((low[good], lengths[good], angles[good], values[5][good]))
        low, high, before = _halves(low[~good], middle[~good], high[~good], tail[~good])
    places, lengths, angles, curvatures = (np.concatenate(columns) for columns in zip(*found, strict=True))
    order = np.argsort(places)
    anchors = rows(places[order], np.zeros((places.size, 1)))[:, :, 0]
    start = float(np.arctan2(anchors[4, 0], anchors[3, 0]))
    return Pieces(
        places=np.stack([places[order], np.append(places[order][1:], edges[-1])], axis=1),
        lengths=lengths[order],
        anchors=anchors[:2].T,
        angles=unwrapped(angles[order], start),
        curvatures=curvatures[order],
    )


def _check(good: Flags, places: Array, where: str, what: str) -> None:
    if not good.all():
        raise SolutionError(
            f"{where}: the curve {what} near {float(places[~good][0])!r}; "
            "give a domain, or points, in which it is smooth"
        )


def _halves(low: Array, middle: Array, high: Array, tail: Array) -> tuple[Array, Array, Array]:
    return np.concatenate([low, middle]), np.concatenate([middle, high]), np.concatenate([tail, tail])


def _tail(values: Array, least: float = 0.0) -> Array:
    """The last coefficients of rows of values, as a share of the rows' sizes, which are ``least`` at least."""
    size = np.maximum(np.abs(values).max(axis=-1), least)
    tail: Array = np.abs(values @ FIT[-2:].T).max(axis=-1) / size
    return tail


@Inner
def clenshaw(terms, u):  # type: ignore[no-untyped-def]
    """The value of a Chebyshev series."""
    one, two = 0.0, 0.0
    for j in range(terms.size - 1, 0, -1):
        one, two = 2.0 * u * one - two + terms[j], one
    return u * one - two + terms[0]


@entry(types.float64[:, ::1](types.float64[::1], types.float64[:, ::1], types.float64[:, ::1]))
def _invert(lengths, rates, gains):  # type: ignore[no-untyped-def]
    """Where on [-1, 1] the length has come to the nodes' shares of the whole, for each piece."""
    out = np.empty((rates.shape[0], TERMS))
    for k in range(rates.shape[0]):
        half = 0.5 * lengths[k]
        for i in range(TERMS):
            u = NODES[i]
            for _ in range(_SOLUTIONS):
                step = (clenshaw(gains[k], u) + half * (u - NODES[i])) / clenshaw(rates[k], u)
                u = min(max(u - step, -1.0), 1.0)
                if not fabs(step) > 1e-15:
                    break
            out[k, i] = u
    return out
