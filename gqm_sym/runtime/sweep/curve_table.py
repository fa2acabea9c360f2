"""The parts of the potential and of the contact force along one curve, tabulated for all forces on it.

The curve is cut into panels on which they are polynomials to rounding. The potential on a panel is that above its left
edge, so that it has all its digits however small the panel is. Potential and load are sums of parts, each times a
factor that depends on run-time parameters alone (`interface.SeparatedTerms`): the table has the parts, and a launch
puts together its own potential on the panels that it comes to (`panel_forces`).
"""

from math import fabs
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numpy.polynomial.legendre import leg2poly, leggauss, legvander

from gqm_sym.runtime.arithmetic.matrices import multiply
from gqm_sym.runtime.compiled.calls import (
    call_path_and_contact_force,
    call_potential_divdiff1,
    call_separated_terms,
)
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.types import ADDRESSES, MATRIX, VECTOR, Array
from gqm_sym.runtime.interface import PATH_ROWS

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

# What a panel has of the path: weights in m at the Gauss points, and at fewer of them; powers of x in [-1, 1] for
# ds/dlam and kappa; kappa at the samples; and whether ds may vanish.
WEIGHTS, FEW_WEIGHTS, DS_TERMS, KAPPA_TERMS = 0, NODES, NODES + FEW_NODES, 2 * NODES + FEW_NODES
KAPPA_SAMPLES = KAPPA_TERMS + NODES
MAY_STOP = KAPPA_SAMPLES + SAMPLES
PATH_ROW = MAY_STOP + 1
# What it has of a part of the potential. Numbers that suffice far from turning points: the potential of the left edge
# above the reference; its increase from edge to edge; its mean; by how much it differs from that on the panel and in
# both ellipses, at most; the size of what the first is a sum of; and the potential at the samples.
BASE, INCREASE, MIDDLE, SPREAD, REACH, FEW_REACH, BASE_SIZE, POTENTIAL_SAMPLES = range(8)
FEW_POTENTIAL = POTENTIAL_SAMPLES + 1
# Then powers of x for the potential as (1 + x)*left(x) = INCREASE - (1 - x)*right(x), its values at the Gauss points,
# and its Legendre coefficients.
LEFT_TERMS = POTENTIAL_SAMPLES + SAMPLES
RIGHT_TERMS, POTENTIAL, SERIES = (LEFT_TERMS + k * NODES for k in range(1, 4))
POTENTIAL_ROW = SERIES + NODES
# What it has of a part of the load n0: powers of x, and values at the samples. A row of `panel_forces` has both.
LOAD_TERMS, LOAD_SAMPLES = POTENTIAL_ROW, POTENTIAL_ROW + NODES
LOAD_ROW = NODES + SAMPLES


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
    paths : (n, PATH_ROW) array
        What the panels have of the path.
    parts : (n, potentials*POTENTIAL_ROW + loads*LOAD_ROW) array
        What they have of the parts of the potential and of the load.
    potentials : int
        How many parts the potential has.
    """

    edges: Any
    paths: Any
    parts: Any
    potentials: Any


class Source(NamedTuple):
    """What a table is made from.

    Attributes
    ----------
    fns : Addresses
        The module's compiled functions.
    separated_terms : int
        The address of the function of that name; 0 if potential and load are tabulated as a whole.
    potentials, loads : int
        How many parts they have.
    mass : int
        Which run-time parameter is the mass of the body.
    """

    fns: Any
    separated_terms: int
    potentials: int
    loads: int
    mass: int


TABLE = types.NamedTuple((VECTOR, MATRIX, MATRIX, types.int64), CurveTable)
SOURCE = types.NamedTuple((ADDRESSES, types.int64, types.int64, types.int64, types.int64), Source)
NO_TABLE = CurveTable(np.empty(0), np.empty((0, PATH_ROW)), np.empty((0, 0)), 0)


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
def fill_terms_at(source, p, n, a, places, offsets, out):  # type: ignore[no-untyped-def]
    """Fill the rows of ``separated_terms`` at n places."""
    if source.separated_terms != 0:
        call_separated_terms(source.separated_terms, n, a, places, offsets, p, out)
        return
    frame = np.empty((PATH_ROWS, n))
    call_potential_divdiff1(source.fns.potential_divdiff1, n, a, places, offsets, p, out)
    call_path_and_contact_force(source.fns.path_and_contact_force, n, places, np.zeros(n), p, frame)
    for i in range(n):
        out[2, i], out[3, i] = frame[3, i], frame[4, i] / p[source.mass]


@Inner
def fill_path(half, ds, kappa, row):  # type: ignore[no-untyped-def]
    """Fill what a panel has of the path from ds/dlam and kappa at the Gauss points; returns whether it is resolved."""
    work, one = np.empty(NODES), row.reshape(1, PATH_ROW)
    resolved = fill_terms(ds, work, row, DS_TERMS, 0.0)
    least_ds = 2.0 * work[0]
    for j in range(NODES):
        least_ds -= fabs(work[j])
        row[WEIGHTS + j] = half * GAUSS_WEIGHTS[j] * ds[j]
    row[MAY_STOP] = 0.0 if least_ds > 0.0 else 1.0
    resolved &= fill_terms(kappa, work, row, KAPPA_TERMS, NEGLIGIBLE / row[WEIGHTS])
    for j in range(SAMPLES):
        row[KAPPA_SAMPLES + j] = value_on(one, 0, KAPPA_TERMS, SAMPLE_POINTS[j])
    for j in range(FEW_NODES):
        row[FEW_WEIGHTS + j] = half * FEW_GAUSS_WEIGHTS[j] * value_on(one, 0, DS_TERMS, FEW_POINTS[j])
    return resolved


@Inner
def fill_potential(half, from_left, from_right, slope, row):  # type: ignore[no-untyped-def]
    """Fill what a panel has of a part of the potential, all but its base; returns whether it is resolved.

    ``from_left`` and ``from_right`` are its divided differences from both edges, and ``slope`` is how steep the part is
    elsewhere on the curve.
    """
    values, work, one = np.empty(NODES), np.empty(NODES), row.reshape(1, POTENTIAL_ROW)
    for j in range(NODES):
        values[j] = half * from_right[j]
    resolved = fill_terms(values, work, row, RIGHT_TERMS, NEGLIGIBLE * half * slope)
    for j in range(NODES):
        values[j] = half * from_left[j]
    resolved &= fill_terms(values, work, row, LEFT_TERMS, NEGLIGIBLE * half * slope)
    total, reach, few_reach, spread = 0.0, 0.0, 0.0, 0.0
    for j in range(NODES):
        total += row[LEFT_TERMS + j]
        row[POTENTIAL + j] = half * (1.0 + POINTS[j]) * from_left[j]
    fit(row, POTENTIAL, row, SERIES)
    for j in range(1, NODES):
        size = fabs(row[SERIES + j])
        reach += size * GROWTH[j]
        few_reach += size * FEW_GROWTH[j]
        spread += size
    row[INCREASE], row[MIDDLE], row[SPREAD] = 2.0 * total, row[SERIES], spread
    row[REACH], row[FEW_REACH] = reach, few_reach
    for j in range(SAMPLES):
        row[POTENTIAL_SAMPLES + j] = potential_on(one, 0, SAMPLE_POINTS[j])
    return resolved


@Inner
def fill_panel(source, p, left, right, scales, path, parts):  # type: ignore[no-untyped-def]
    """Fill what a panel has of the path and of all parts, but not their bases; returns whether all are resolved.

    ``scales`` is how steep the parts of the potential are elsewhere on the curve, and how large those of the load.
    """
    half, potentials = 0.5 * (right - left), source.potentials
    places, gaps, rests, work = np.empty(NODES), np.empty(NODES), np.empty(NODES), np.empty(NODES)
    from_left, from_right = np.empty((scales.size + 2, NODES)), np.empty((scales.size + 2, NODES))
    for j in range(NODES):
        gaps[j] = half * (1.0 + POINTS[j])
        places[j], rests[j] = left + gaps[j], -half * (1.0 - POINTS[j])
    fill_terms_at(source, p, NODES, right, places, rests, from_right)
    fill_terms_at(source, p, NODES, left, places, gaps, from_left)
    resolved = fill_path(half, from_left[potentials], from_left[potentials + 1], path)
    for i in range(potentials):
        part = parts[i * POTENTIAL_ROW : (i + 1) * POTENTIAL_ROW]
        resolved &= fill_potential(half, from_left[i], from_right[i], scales[i], part)
    for i in range(potentials, scales.size):
        at = potentials * POTENTIAL_ROW + (i - potentials) * LOAD_ROW
        part = parts[at : at + LOAD_ROW]
        resolved &= fill_terms(from_left[i + 2], work, part, 0, NEGLIGIBLE * scales[i])
        for j in range(SAMPLES):
            part[NODES + j] = value_on(part.reshape(1, LOAD_ROW), 0, 0, SAMPLE_POINTS[j])
    return resolved


@Inner
def scales_of(source, p, pieces):  # type: ignore[no-untyped-def]
    """How steep the parts of the potential are at the edges of pieces, and how large those of the load, at most."""
    scales, offset = np.zeros(source.potentials + source.loads), np.zeros(1)
    out = np.empty((scales.size + 2, 1))
    for k in range(pieces.size):
        fill_terms_at(source, p, 1, pieces[k], pieces[k : k + 1], offset, out)
        for i in range(scales.size):
            scales[i] = max(scales[i], fabs(out[i if i < source.potentials else i + 2, 0]))
    return scales


@Inner
def fill_bases(source, p, edges, parts):  # type: ignore[no-untyped-def]
    """Fill the parts of the potential at the left edges of panels, each above the edge where it is lowest."""
    count = parts.shape[0]
    lefts, gaps, out = edges[:count], np.empty(count), np.empty((source.potentials + source.loads + 2, count))
    for i in range(source.potentials):
        lowest = lefts[0]
        for step in range(2):
            for k in range(count):
                gaps[k] = lefts[k] - lowest
            fill_terms_at(source, p, count, lowest, lefts, gaps, out)
            if step == 0:
                lowest = lefts[np.argmin(gaps * out[i])]
        for k in range(count):
            base = gaps[k] * out[i, k]
            parts[k, i * POTENTIAL_ROW + BASE], parts[k, i * POTENTIAL_ROW + BASE_SIZE] = base, fabs(base)


@entry(TABLE(SOURCE, VECTOR, VECTOR))
def tabulate(source, p, pieces):  # type: ignore[no-untyped-def]
    """Tabulate a curve.

    Parameters
    ----------
    source : Source
        The module's functions.
    p : array
        Run-time parameters, of which those count that the functions read, and the chart behind them.
    pieces : (n+1,) array
        The edges of the pieces that the curve is smooth on.

    Returns
    -------
    CurveTable
        An empty one if the pieces would have to be cut into too many panels.
    """
    capacity = MAX_PARTS * (pieces.size - 1)
    width = source.potentials * POTENTIAL_ROW + source.loads * LOAD_ROW
    edges, paths, parts = np.empty(capacity + 1), np.empty((capacity, PATH_ROW)), np.empty((capacity, width))
    pending, count, scales = np.empty(64), 0, scales_of(source, p, pieces)
    edges[0] = pieces[0]
    for k in range(pieces.size - 1):
        waiting, left = 1, pieces[k]
        pending[0] = pieces[k + 1]
        while waiting > 0:
            right = pending[waiting - 1]
            if count == capacity or waiting == pending.size:
                return CurveTable(np.empty(0), np.empty((0, PATH_ROW)), np.empty((0, width)), source.potentials)
            if fill_panel(source, p, left, right, scales, paths[count], parts[count]):
                count, waiting = count + 1, waiting - 1
                left = edges[count] = right
            else:
                pending[waiting] = 0.5 * (left + right)
                waiting += 1
    parts = parts[:count].copy()
    fill_bases(source, p, edges, parts)
    return CurveTable(edges[: count + 1].copy(), paths[:count].copy(), parts, source.potentials)
