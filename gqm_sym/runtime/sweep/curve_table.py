"""The parts of the potential and of the contact force along one curve, tabulated for all forces on it.

The curve is cut into panels on which they are polynomials to rounding. The potential on a panel is that above its left
edge, so that it has all its digits however small the panel is. Potential and load are sums of parts, each times a
factor that depends on run-time parameters alone (`interface.SeparatedTerms`): the table has the parts, and a launch
puts together its own potential on the panels that it comes to (`panel_forces`). Where a curve is known in double-double
arithmetic (`charts.true_parts`), parts of the potential and lengths of panels are rounded from there: the places of a
chart of many short pieces are doubles, whose differences have few digits.
"""

from math import fabs
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numpy.polynomial.legendre import leg2poly, leggauss, legvander

from gqm_sym.runtime.arithmetic.doubledouble import add
from gqm_sym.runtime.arithmetic.matrices import multiply
from gqm_sym.runtime.charts.true_parts import TRUE_PARTS, fill_differences
from gqm_sym.runtime.compiled.calls import (
    call_path_and_contact_force,
    call_potential_divdiff1,
    call_separated_terms,
)
from gqm_sym.runtime.compiled.jit import Inlined, Inner, entry
from gqm_sym.runtime.compiled.types import ADDRESSES, MATRIX, VECTOR, Array
from gqm_sym.runtime.double_double.arithmetic import multiply as multiply_pairs
from gqm_sym.runtime.double_double.orbit_time import fill_parameters
from gqm_sym.runtime.interface import PATH_ROWS

# Gauss points of a panel, of the rule for panels far from turning points, and places at which loads are sampled.
NODES, FEW_NODES, SAMPLES = 16, 8, 10

# Bernstein ellipses (sums of half axes) in which V**2 must not vanish for these rules to be accurate to rounding.
ELLIPSE, FEW_ELLIPSE = 3.2, 10.0

# Legendre coefficients behind the last one above this share of the largest value are rounding noise; a panel is halved
# if its last two are above the second share.
MAX_NOISE_RATIO, MAX_TAIL_RATIO = 4e-16, 1e-13

# The second share where values come from double-double arithmetic; and how often the fit is corrected then.
MAX_TRUE_TAIL_RATIO, CORRECTIONS = 1e-15, 2

# The same next to an edge at which the potential is level: its slope there is at most such a share of what it is on
# average. Small swings there have far less energy than what the panel spreads over, and still need all their digits.
# If the potential has one part, panels are cut where it is level farther than so much from their edges, at multiples of
# such a share of a piece. A sum of several is level where its factors say.
MAX_LEVEL_TAIL_RATIO, LEVEL_SHARE, MIN_CUT, CUT_STEP = 1e-20, 1e-3, 1e-3, 2.0**-20

# How often an interval is halved to find a level place.
HALVINGS = 50

# Values below this share of what is usual on the curve need no relative accuracy of their own.
NEGLIGIBLE = 1e-2

# How many panels a piece of the curve may be cut into on average.
MAX_PARTS = 4

# What a panel has of the path: weights in m at the Gauss points, and at fewer of them; powers of x in [-1, 1] for
# ds/dlam and kappa; kappa at the samples; whether ds may vanish; and half the panel's length in lam.
WEIGHTS, FEW_WEIGHTS, DS_TERMS, KAPPA_TERMS = 0, NODES, NODES + FEW_NODES, 2 * NODES + FEW_NODES
KAPPA_SAMPLES = KAPPA_TERMS + NODES
MAY_STOP = KAPPA_SAMPLES + SAMPLES
HALF = MAY_STOP + 1
PATH_ROW = HALF + 1
# What it has of a part of the potential. Numbers that suffice far from turning points: the potential of the left edge
# above the reference, two doubles; its increase from edge to edge; its mean; by how much it differs from that on the
# panel and in both ellipses, at most; the size of what the first is a sum of; and the potential at the samples.
BASE, BASE_LOW, INCREASE, MIDDLE, SPREAD, REACH, FEW_REACH, BASE_SIZE, POTENTIAL_SAMPLES = range(9)
FEW_POTENTIAL = POTENTIAL_SAMPLES + 1
# Then the potential from either edge: above that of the left edge it is r*(c0 + c1*r + c2*r**2 + ...) with r = 1 + x,
# and above that of the right edge the same with r = x - 1, so that it has all its digits next to an edge, however many
# of the first coefficients vanish there. Then the coefficients of x, x**2, ... about the middle of the panel; at last
# its values at the Gauss points, and its Legendre coefficients.
LEFT_TERMS = POTENTIAL_SAMPLES + SAMPLES
RIGHT_TERMS, MIDDLE_TERMS, POTENTIAL, SERIES = (LEFT_TERMS + k * NODES for k in range(1, 5))
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
    edge_lows : (n+1,) array
        What these are rounded by.
    paths : (n, PATH_ROW) array
        What the panels have of the path.
    parts : (n, potentials*POTENTIAL_ROW + loads*LOAD_ROW) array
        What they have of the parts of the potential and of the load.
    potentials : int
        How many parts the potential has.
    is_exact : bool
        Whether potential and lengths were rounded from double-double arithmetic.
    """

    edges: Any
    edge_lows: Any
    paths: Any
    parts: Any
    potentials: Any
    is_exact: Any


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


TABLE = types.NamedTuple((VECTOR, VECTOR, MATRIX, MATRIX, types.int64, types.boolean), CurveTable)
SOURCE = types.NamedTuple((ADDRESSES, types.int64, types.int64, types.int64, types.int64), Source)
NO_TABLE = CurveTable(np.empty(0), np.empty(0), np.empty((0, PATH_ROW)), np.empty((0, 0)), 0, False)


@Inner
def value_on(rows, k, at, x):  # type: ignore[no-untyped-def]
    """The polynomial of panel k whose coefficients begin at column ``at``, at x."""
    total = 0.0
    for j in range(NODES - 1, -1, -1):
        total = total * x + rows[k, at + j]
    return total


@Inner
def rise_on(rows, k, at, r):  # type: ignore[no-untyped-def]
    """The potential on panel k above that of the edge whose numbers begin at column ``at``.

    The place is ``r`` away from it in halves of the panel.
    """
    return r * value_on(rows, k, at, r)


@Inner
def potential_on(rows, k, x):  # type: ignore[no-untyped-def]
    """The potential of panel k above its left edge at a place x in [-1, 1]."""
    return rise_on(rows, k, LEFT_TERMS, 1.0 + x)


@Inner
def difference_from(rows, k, at, r, q):  # type: ignore[no-untyped-def]
    """The first divided difference of the potential of panel k over two places, which are r and q away from an edge."""
    value, first = 0.0, 0.0
    for j in range(NODES - 1, -1, -1):
        first = first * q + value
        value = value * r + rows[k, at + j]
    return value + q * first


@Inner
def difference_on(rows, k, x, y):  # type: ignore[no-untyped-def]
    """The first divided difference of the potential of panel k over two places on it, by x.

    It is taken from the nearer edge: there the slope of a fitted polynomial is less accurate than its value.
    """
    at, edge = (LEFT_TERMS, -1.0) if x + y < 0.0 else (RIGHT_TERMS, 1.0)
    return difference_from(rows, k, at, x - edge, y - edge)


@Inner
def fill_terms(values, work, row, at, size):  # type: ignore[no-untyped-def]
    """Fit a polynomial to values at the Gauss points; returns whether it is resolved. ``work`` has its Legendre terms.

    Coefficients behind the last significant one are set to zero. ``size`` is how large the values are elsewhere: where
    they are much smaller than that, they are rounding noise.
    """
    off = np.empty(NODES)
    for j in range(NODES):
        off[j], size = values[j] - values[0], max(size, fabs(values[j]))
    fit(off, 0, work, 0)
    work[0] += values[0]  # so that a constant is fitted without rounding
    resolved = max(fabs(work[NODES - 2]), fabs(work[NODES - 1])) <= MAX_TAIL_RATIO * size
    for j in range(NODES - 1, -1, -1):
        if fabs(work[j]) > MAX_NOISE_RATIO * size:
            break
        work[j] = 0.0
    powers(work, 0, row, at)
    return resolved


@Inner
def fill_true_terms(values, work, sums, size):  # type: ignore[no-untyped-def]
    """As `fill_terms`, from values of two doubles, and with powers of two doubles.

    Returns the last Legendre terms, and what they are compared with.
    """
    rest, terms, series = values[0].copy(), np.empty(NODES), np.empty(NODES)
    for j in range(NODES):
        size, sums[0, j], sums[1, j] = max(size, fabs(rest[j])), 0.0, 0.0
    for turn in range(CORRECTIONS + 1):
        fit(rest, 0, series, 0)
        powers(series, 0, terms, 0)
        for j in range(NODES):
            sums[0, j], sums[1, j] = add(sums[0, j], sums[1, j], terms[j], 0.0)
            work[j] = series[j] if turn == 0 else work[j] + series[j]
        for i in range(NODES):
            value, low = 0.0, 0.0
            for j in range(NODES - 1, -1, -1):
                value, low = multiply_pairs(value, low, POINTS[i], 0.0)
                value, low = add(value, low, sums[0, j], sums[1, j])
            rest[i] = add(values[0, i], values[1, i], -value, -low)[0]
    return max(fabs(work[NODES - 2]), fabs(work[NODES - 1])), size


@Inner
def move_terms(sums, edge, terms, middle):  # type: ignore[no-untyped-def]
    """Fill the powers about an edge of a polynomial with powers of x of two doubles, which are changed.

    And ``middle`` with those of x, x**2, ... in its product with the distance from the edge.
    """
    for j in range(NODES - 1):
        middle[j] = add(sums[0, j], sums[1, j], -edge * sums[0, j + 1], -edge * sums[1, j + 1])[0]
    middle[NODES - 1] = sums[0, NODES - 1]
    for i in range(NODES):
        for j in range(NODES - 2, i - 1, -1):
            sums[0, j], sums[1, j] = add(sums[0, j], sums[1, j], edge * sums[0, j + 1], edge * sums[1, j + 1])
        terms[i] = sums[0, i]


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
    row[MAY_STOP], row[HALF] = 0.0 if least_ds > 0.0 else 1.0, half
    resolved &= fill_terms(kappa, work, row, KAPPA_TERMS, NEGLIGIBLE / row[WEIGHTS])
    for j in range(SAMPLES):
        row[KAPPA_SAMPLES + j] = value_on(one, 0, KAPPA_TERMS, SAMPLE_POINTS[j])
    for j in range(FEW_NODES):
        row[FEW_WEIGHTS + j] = half * FEW_GAUSS_WEIGHTS[j] * value_on(one, 0, DS_TERMS, FEW_POINTS[j])
    return resolved


@Inner
def fill_potential(half, differences, is_exact, slope, row):  # type: ignore[no-untyped-def]
    """Fill what a panel has of a part of the potential, all but its base; returns whether it is resolved.

    ``differences`` (2, 2, NODES) are its divided differences from both edges, two doubles each, of which the second
    count only where ``is_exact``; and ``slope`` is how steep the part is elsewhere on the curve.
    """
    values, work, one, resolved = np.empty((2, NODES)), np.empty(NODES), row.reshape(1, POTENTIAL_ROW), True
    sums, size = np.zeros((2, NODES)), NEGLIGIBLE * half * slope
    for side, at, edge in ((1, RIGHT_TERMS, 1.0), (0, LEFT_TERMS, -1.0)):
        for j in range(NODES):
            high, low = differences[side, 0, j], differences[side, 1, j] if is_exact else 0.0
            values[0, j], values[1, j] = multiply_pairs(half, 0.0, high, low)
        tail, largest = 0.0, 0.0
        if is_exact:
            tail, largest = fill_true_terms(values, work, sums, size)
        else:
            resolved &= fill_terms(values[0], work, sums[0], 0, size)
            sums[1] = 0.0
        move_terms(sums, edge, row[at : at + NODES], row[MIDDLE_TERMS : MIDDLE_TERMS + NODES])
        far = fabs(values[0, 0 if edge > 0.0 else NODES - 1])
        is_level = fabs(row[at]) <= LEVEL_SHARE * far
        resolved &= tail <= (MAX_LEVEL_TAIL_RATIO if is_level else MAX_TRUE_TAIL_RATIO) * largest
    reach, few_reach, spread = 0.0, 0.0, 0.0
    for j in range(NODES):
        row[POTENTIAL + j] = (1.0 + POINTS[j]) * values[0, j]
    fit(row, POTENTIAL, row, SERIES)
    for j in range(1, NODES):
        size = fabs(row[SERIES + j])
        reach += size * GROWTH[j]
        few_reach += size * FEW_GROWTH[j]
        spread += size
    row[INCREASE], row[MIDDLE], row[SPREAD] = rise_on(one, 0, LEFT_TERMS, 2.0), row[SERIES], spread
    row[REACH], row[FEW_REACH] = reach, few_reach
    for j in range(SAMPLES):
        row[POTENTIAL_SAMPLES + j] = potential_on(one, 0, SAMPLE_POINTS[j])
    return resolved


@Inner
def level_place(row):  # type: ignore[no-untyped-def]
    """Where inside a panel a part of the potential that is not monotone on it is stationary; NaN if it is nowhere."""
    low, high, sign, x = -1.0, 1.0, row[LEFT_TERMS], 0.0
    if not sign * row[RIGHT_TERMS] < 0.0:
        return np.nan
    for _ in range(HALVINGS):
        x, slope = 0.5 * (low + high), 0.0
        for j in range(NODES - 1, -1, -1):
            slope = slope * x + (j + 1) * row[MIDDLE_TERMS + j]
        if sign * slope > 0.0:
            low = x
        else:
            high = x
    return x if fabs(x) < 1.0 - MIN_CUT else np.nan


@Inner
def cut_between(part, begin, end):  # type: ignore[no-untyped-def]
    """The share of a piece at which to cut a panel between two shares, for the potential is level; NaN if it is not."""
    cut = CUT_STEP * np.rint((begin + 0.5 * (1.0 + level_place(part)) * (end - begin)) / CUT_STEP)
    return cut if begin < cut < end else np.nan


@Inner
def fill_panel(source, true, p, panel, scales, path, parts):  # type: ignore[no-untyped-def]
    """Fill what a panel has of the path and of all parts; returns whether all are resolved.

    The values of the potential at its left edge are filled in only where they are known (`fill_bases`).

    Parameters
    ----------
    source, true, p
        As `tabulate` takes them.
    panel : (left, right, piece, span)
        The places of its edges, the piece that it lies on, and its beginning and end there.
    scales : array
        How steep the parts of the potential are elsewhere on the curve, and how large those of the load.
    path, parts : arrays
        Filled.
    """
    left, right, piece, span = panel
    half, potentials = 0.5 * (right - left), source.potentials
    places, gaps, rests, work = np.empty(NODES), np.empty(NODES), np.empty(NODES), np.empty(NODES)
    from_left, from_right = np.empty((scales.size + 2, NODES)), np.empty((scales.size + 2, NODES))
    differences, ends, is_exact = (
        np.empty((2, potentials, 2, NODES)),
        np.empty((potentials, 2, 2)),
        true.values.size > 0,
    )
    for j in range(NODES):
        gaps[j] = half * (1.0 + POINTS[j])
        places[j], rests[j] = left + gaps[j], -half * (1.0 - POINTS[j])
    fill_terms_at(source, p, NODES, left, places, gaps, from_left)
    if is_exact:
        half = fill_differences(true, piece, span, POINTS, differences, ends)
    else:
        fill_terms_at(source, p, NODES, right, places, rests, from_right)
        for i in range(potentials):
            differences[0, i, 0], differences[1, i, 0] = from_left[i], from_right[i]
    resolved = fill_path(half, from_left[potentials], from_left[potentials + 1], path)
    for i in range(potentials):
        part = parts[i * POTENTIAL_ROW : (i + 1) * POTENTIAL_ROW]
        resolved &= fill_potential(half, differences[:, i], is_exact, scales[i], part)
        if is_exact:
            part[BASE], part[BASE_LOW] = ends[i, 0, 0], ends[i, 1, 0]
            part[INCREASE] = add(ends[i, 0, 1], ends[i, 1, 1], -ends[i, 0, 0], -ends[i, 1, 0])[0]
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
def fill_bases(parts, potentials, known):  # type: ignore[no-untyped-def]
    """Fill the parts of the potential at the left edges of panels, each above the edge where it is lowest.

    They are sums of the increases before, unless they are ``known`` above another reference.
    """
    for i in range(potentials):
        rows = parts[:, i * POTENTIAL_ROW : (i + 1) * POTENTIAL_ROW]
        base, low, least, least_low = 0.0, 0.0, np.inf, 0.0
        for k in range(rows.shape[0]):
            if not known:
                rows[k, BASE], rows[k, BASE_LOW] = base, low
                base, low = add(base, low, rows[k, INCREASE], 0.0)
            if rows[k, BASE] < least:
                least, least_low = rows[k, BASE], rows[k, BASE_LOW]
        for k in range(rows.shape[0]):
            rows[k, BASE], rows[k, BASE_LOW] = add(rows[k, BASE], rows[k, BASE_LOW], -least, -least_low)
            rows[k, BASE_SIZE] = rows[k, BASE]


@Inlined
def place_on_piece(true, pieces, k, share):  # type: ignore[no-untyped-def]
    """The place at a share of piece k, as two doubles."""
    if true.values.size > 0:
        high, low, _ = true.curve.lengths[k]
        high, low = multiply_pairs(high, low, share, 0.0)
        return add(true.origins[k, 0], true.origins[k, 1], high, low)
    return pieces[k] + share * (pieces[k + 1] - pieces[k]) if share < 1.0 else pieces[k + 1], 0.0


@entry(TABLE(SOURCE, TRUE_PARTS, VECTOR, VECTOR))
def tabulate(source, true, p, pieces):  # type: ignore[no-untyped-def]
    """Tabulate a curve.

    Parameters
    ----------
    source : Source
        The module's functions.
    true : TrueParts
        The parts of the potential in double-double arithmetic, on the same pieces; of no size if there are none.
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
    edges, lows = np.empty(capacity + 1), np.empty(capacity + 1)
    paths, parts = np.empty((capacity, PATH_ROW)), np.empty((capacity, width))
    pending, count, scales = np.empty(64), 0, scales_of(source, p, pieces)
    is_exact = true.values.size > 0
    if is_exact:
        fill_parameters(true.tape, true.parameters, true.work)
    for k in range(pieces.size - 1):
        waiting, begin = 1, 0.0
        pending[0] = 1.0
        while waiting > 0:
            end = pending[waiting - 1]
            if count == capacity or waiting == pending.size:
                none = np.empty((0, PATH_ROW)), np.empty((0, width))
                return CurveTable(np.empty(0), np.empty(0), none[0], none[1], source.potentials, False)
            edges[count], lows[count] = place_on_piece(true, pieces, k, begin)
            edges[count + 1], lows[count + 1] = place_on_piece(true, pieces, k, end)
            panel = edges[count], edges[count + 1], k, (begin, end)
            cut = 0.5 * (begin + end)
            if fill_panel(source, true, p, panel, scales, paths[count], parts[count]):
                cut = cut_between(parts[count], begin, end) if is_exact and source.potentials == 1 else np.nan
            if cut == cut:
                pending[waiting] = cut
                waiting += 1
            else:
                count, waiting, begin = count + 1, waiting - 1, end
    parts = parts[:count].copy()
    fill_bases(parts, source.potentials, is_exact)
    edges, lows, paths = edges[: count + 1].copy(), lows[: count + 1].copy(), paths[:count].copy()
    return CurveTable(edges, lows, paths, parts, source.potentials, is_exact)
