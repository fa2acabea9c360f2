"""The potential, the metric and the contact force along one curve, tabulated for all launches with its parameters.

The curve is cut into panels on which they are polynomials to rounding. The potential on a panel is that above its left
edge, so that it has all its digits however small the panel is.
"""

from math import fabs, inf
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numpy.polynomial.legendre import leg2poly, leggauss, legvander

from gqm_sym.runtime.arithmetic.matrices import multiply
from gqm_sym.runtime.compiled.calls import (
    call_effective_potential,
    call_path_and_contact_force,
    call_potential_divdiff1,
)
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.types import ADDRESSES, MATRIX, REAL, VECTOR, Array

# Gauss points of a panel, of the rule for panels far from turning points, and places at which loads are sampled.
NODES, FEW_NODES, SAMPLES = 16, 8, 10

# Bernstein ellipses (sums of half axes) in which V**2 must not vanish for these rules to be accurate to rounding.
ELLIPSE, FEW_ELLIPSE = 3.2, 10.0

# Legendre coefficients behind the last one above this share of the largest value are rounding noise; a panel is halved
# if its last two are above the second share.
MAX_NOISE_RATIO, MAX_TAIL_RATIO = 4e-16, 1e-13

# Values below this share of what is usual on the curve need no relative accuracy of their own.
NEGLIGIBLE = 1e-2

# How many panels a piece of the curve may be cut into on average.
MAX_PARTS = 4

# A row of the table: values at the Gauss points and weights in m; the same for fewer points; powers of x in [-1, 1] for
# the potential as (1 + x)*left(x) = INCREASE - (1 - x)*right(x), for ds/dlam, m*kappa and m*n0; the potential, m*kappa
# and m*n0 at the samples; and single numbers.
POTENTIAL, WEIGHTS = 0, NODES
FEW_POTENTIAL, FEW_WEIGHTS = 2 * NODES, 2 * NODES + FEW_NODES
LEFT_TERMS, RIGHT_TERMS, DS_TERMS, KAPPA_TERMS, LOAD_TERMS = (2 * FEW_NODES + k * NODES for k in range(2, 7))
POTENTIAL_SAMPLES = LOAD_TERMS + NODES
KAPPA_SAMPLES, LOAD_SAMPLES = POTENTIAL_SAMPLES + SAMPLES, POTENTIAL_SAMPLES + 2 * SAMPLES
# The potential of the left edge above the reference; its increase from edge to edge; whether the potential rises (1) or
# falls (-1) throughout, 0 if neither is certain; its mean; by how much it differs from that in both ellipses, at most.
BASE, INCREASE, SLOPE_SIGN, MIDDLE, REACH, FEW_REACH = range(LOAD_SAMPLES + SAMPLES, LOAD_SAMPLES + SAMPLES + 6)
ROW = FEW_REACH + 1


def _gauss(n: int) -> tuple[Array, Array, Array]:
    """Gauss points, their weights, and factors that take values at the points to Legendre coefficients.

    They are exact for the points as doubles; the weights of `leggauss` are off by 70 last places.
    """
    points = leggauss(n)[0]
    values = legvander(points.astype(np.longdouble), n - 1)
    factors = np.linalg.inv(values.astype(np.float64)).astype(np.longdouble)
    for _ in range(2):
        factors = factors + factors @ (np.eye(n) - values @ factors)
    return points, (2.0 * factors[0]).astype(np.float64), factors.T.astype(np.float64)


# FIT takes values at the Gauss points to Legendre coefficients, and `powers` takes these to powers.
POINTS, GAUSS_WEIGHTS, FIT = _gauss(NODES)
FEW_POINTS, FEW_GAUSS_WEIGHTS, _ = _gauss(FEW_NODES)
SAMPLE_POINTS = np.concatenate([[-1.0], FEW_POINTS, [1.0]])
_POWERS = np.array([np.pad(leg2poly(row[: k + 1]), (0, NODES - 1 - k)) for k, row in enumerate(np.eye(NODES))])
fit, powers = multiply(FIT), multiply(_POWERS)
# The largest values of Legendre polynomials in the ellipses.
GROWTH, FEW_GROWTH = (legvander(np.array([0.5 * (e + 1.0 / e)]), NODES - 1)[0] for e in (ELLIPSE, FEW_ELLIPSE))


class CurveTable(NamedTuple):
    """A tabulated curve.

    Attributes
    ----------
    edges : (n+1,) array
        The places at the edges of the panels; n is 0 if there is no table.
    tops : (n,) array
        An upper bound of the potential on each panel above that of the reference; infinite where ds may vanish.
    rows : (n, ROW) array
        The panels.
    """

    edges: Any
    tops: Any
    rows: Any


TABLE = types.NamedTuple((VECTOR, VECTOR, MATRIX), CurveTable)
NO_TABLE = CurveTable(np.empty(0), np.empty(0), np.empty((0, ROW)))


@Inner
def value_on(rows, k, at, x):  # type: ignore[no-untyped-def]
    """The polynomial of panel k that begins at column ``at``, at a place x in [-1, 1]."""
    total = 0.0
    for j in range(NODES - 1, -1, -1):
        total = total * x + rows[k, at + j]
    return total


@Inner
def potential_on(rows, k, x):  # type: ignore[no-untyped-def]
    """The potential of panel k above its left edge at a place x in [-1, 1]."""
    return (1.0 + x) * value_on(rows, k, LEFT_TERMS, x)


@Inner
def difference_on(rows, k, x, y):  # type: ignore[no-untyped-def]
    """The first divided difference of the potential of panel k over two places on it, by x.

    It is taken from the nearer edge: there the slope of a fitted polynomial is less accurate than its value.
    """
    at, near = (LEFT_TERMS, 1.0 + y) if x + y < 0.0 else (RIGHT_TERMS, y - 1.0)
    value, first = 0.0, 0.0
    for j in range(NODES - 1, -1, -1):
        first = first * y + value
        value = value * x + rows[k, at + j]
    return value + near * first


@Inner
def fill_terms(values, work, row, at, size):  # type: ignore[no-untyped-def]
    """Fit a polynomial to values at the Gauss points; returns whether it is resolved. ``work`` has its Legendre terms.

    Coefficients behind the last significant one are set to zero. ``size`` is how large the values are elsewhere: where
    they are much smaller than that, they are rounding noise.
    """
    fit(values, 0, work, 0)
    for j in range(NODES):
        size = max(size, fabs(values[j]))
    resolved = max(fabs(work[NODES - 2]), fabs(work[NODES - 1])) <= MAX_TAIL_RATIO * size
    for j in range(NODES - 1, -1, -1):
        if fabs(work[j]) > MAX_NOISE_RATIO * size:
            break
        work[j] = 0.0
    powers(work, 0, row, at)
    return resolved


@Inner
def fill_row(fns, p, left, right, mass, slope, row):  # type: ignore[no-untyped-def]
    """Fill the row of one panel, all but its BASE.

    Returns whether its polynomials are resolved, and the potential's upper bound above the left edge. ``slope`` is how
    steep the potential is elsewhere on the curve.
    """
    half = 0.5 * (right - left)
    places, gaps, rests, values = np.empty(NODES), np.empty(NODES), np.empty(NODES), np.empty(NODES)
    work, zeros = np.empty(NODES), np.zeros(NODES)
    rows, frame = np.empty((2, NODES)), np.empty((5, NODES))
    for j in range(NODES):
        gaps[j] = half * (1.0 + POINTS[j])
        places[j], rests[j] = left + gaps[j], -half * (1.0 - POINTS[j])
    call_potential_divdiff1(fns.potential_divdiff1, NODES, right, places, rests, p, rows)
    for j in range(NODES):
        values[j] = half * rows[0, j]
    resolved = fill_terms(values, work, row, RIGHT_TERMS, NEGLIGIBLE * half * slope)
    call_potential_divdiff1(fns.potential_divdiff1, NODES, left, places, gaps, p, rows)
    for j in range(NODES):
        values[j] = half * rows[0, j]
    resolved &= fill_terms(values, work, row, LEFT_TERMS, NEGLIGIBLE * half * slope)
    call_path_and_contact_force(fns.path_and_contact_force, NODES, places, zeros, p, frame)
    for j in range(NODES):
        values[j] = row[POTENTIAL + j] = gaps[j] * rows[0, j]
        row[WEIGHTS + j] = half * GAUSS_WEIGHTS[j] * rows[1, j]
    fit(values, 0, work, 0)
    reach, few_reach, spread = 0.0, 0.0, 0.0
    for j in range(1, NODES):
        reach += fabs(work[j]) * GROWTH[j]
        few_reach += fabs(work[j]) * FEW_GROWTH[j]
        spread += fabs(work[j])
    row[MIDDLE], row[REACH], row[FEW_REACH] = work[0], reach, few_reach
    total, change, slope = 0.0, NODES * fabs(row[LEFT_TERMS + NODES - 1]), row[LEFT_TERMS] + row[LEFT_TERMS + 1]
    for j in range(NODES):
        total += row[LEFT_TERMS + j]
        change += j * fabs(row[LEFT_TERMS + j] + row[LEFT_TERMS + j - 1]) if j > 1 else 0.0
    row[INCREASE], row[SLOPE_SIGN] = 2.0 * total, 0.0
    if fabs(slope) > change:
        row[SLOPE_SIGN] = 1.0 if slope > 0.0 else -1.0
    top = max(row[INCREASE], 0.0) if row[SLOPE_SIGN] != 0.0 else work[0] + spread
    for j in range(NODES):
        values[j] = rows[1, j]
    resolved &= fill_terms(values, work, row, DS_TERMS, 0.0)
    least_ds = 2.0 * work[0]
    for j in range(NODES):
        least_ds -= fabs(work[j])
    for j in range(NODES):
        values[j] = mass * frame[3, j]
    resolved &= fill_terms(values, work, row, KAPPA_TERMS, NEGLIGIBLE * mass / row[WEIGHTS])
    for j in range(NODES):
        values[j] = frame[4, j]
    resolved &= fill_terms(values, work, row, LOAD_TERMS, NEGLIGIBLE * mass * slope)
    one = row.reshape(1, ROW)
    for j in range(SAMPLES):
        x = SAMPLE_POINTS[j]
        row[POTENTIAL_SAMPLES + j] = potential_on(one, 0, x)
        row[KAPPA_SAMPLES + j] = value_on(one, 0, KAPPA_TERMS, x)
        row[LOAD_SAMPLES + j] = value_on(one, 0, LOAD_TERMS, x)
    for j in range(FEW_NODES):
        row[FEW_POTENTIAL + j] = row[POTENTIAL_SAMPLES + 1 + j]
        row[FEW_WEIGHTS + j] = half * FEW_GAUSS_WEIGHTS[j] * value_on(one, 0, DS_TERMS, FEW_POINTS[j])
    return resolved, top if least_ds > 0.0 else inf


@entry(TABLE(ADDRESSES, VECTOR, VECTOR, REAL))
def tabulate(fns, p, pieces, mass):  # type: ignore[no-untyped-def]
    """Tabulate a curve for the parameter values ``p``.

    Parameters
    ----------
    pieces : (n+1,) array
        The edges of the pieces that the curve is smooth on.
    mass : float
        The mass of the body.

    Returns
    -------
    CurveTable
        An empty one if the pieces would have to be cut into too many panels.
    """
    capacity = MAX_PARTS * (pieces.size - 1)
    edges, tops, rows = np.empty(capacity + 1), np.empty(capacity), np.zeros((capacity, ROW))
    pending, count, slopes = np.empty(64), 0, np.empty((2, pieces.size))
    call_effective_potential(fns.effective_potential, pieces.size, pieces, p, slopes)
    slope = np.max(np.abs(slopes[1]))
    edges[0] = pieces[0]
    for k in range(pieces.size - 1):
        waiting, left = 1, pieces[k]
        pending[0] = pieces[k + 1]
        while waiting > 0:
            right = pending[waiting - 1]
            if count == capacity or waiting == pending.size:
                return CurveTable(np.empty(0), np.empty(0), np.empty((0, ROW)))
            resolved, tops[count] = fill_row(fns, p, left, right, mass, slope, rows[count])
            if resolved:
                count, waiting = count + 1, waiting - 1
                left = edges[count] = right
            else:
                pending[waiting] = 0.5 * (left + right)
                waiting += 1
    lefts, gaps, values = edges[:count].copy(), np.empty(count), np.empty((2, count))
    call_effective_potential(fns.effective_potential, count, lefts, p, values)
    lowest = lefts[np.argmin(values[0])]
    for k in range(count):
        gaps[k] = lefts[k] - lowest
    call_potential_divdiff1(fns.potential_divdiff1, count, lowest, lefts, gaps, p, values)
    for k in range(count):
        rows[k, BASE] = gaps[k] * values[0, k]
        tops[k] += rows[k, BASE]
    return CurveTable(edges[: count + 1].copy(), tops[:count].copy(), rows[:count].copy())
