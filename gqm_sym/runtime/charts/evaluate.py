"""Evaluation of a chart in compiled code: its rows and enclosures of them.

The flat array of a chart (`chart.Chart.block`) contains, one after the other::

    size, count, low, high, period, turn      of the chart; then, for n = count pieces,
    edges (n+1)                               arc length at their edges
    turned (n+1)                              bound of how much alpha turns from the first edge to each edge
    most (n)                                  bound of |kappa| on each piece
    records (n, RECORD)                       middle, one over the half length, x and z at the middle as two doubles
                                              each, then powers of u in [-1, 1] for x, z, alpha and kappa
"""

from math import fabs, floor, inf

import numpy as np
from numba import carray

from gqm_sym.runtime.arithmetic.power_rows import filling
from gqm_sym.runtime.compiled.intrinsics import polynomial
from gqm_sym.runtime.compiled.jit import Inlined, Inner
from gqm_sym.runtime.compiled.registers import LANES, borrowed

TERMS = 16
ROWS = 4
EDGES = 6
RECORD = 6 + ROWS * TERMS

# The margin of an enclosure of alpha, as a share of the numbers that it is computed from.
ALPHA_ERROR_SHARE = 1e-12

# The number by which `chart_rows` is asked for the size of the terms of a coordinate in space whose slope is at most 1.
SIZES = 4


@Inner
def chart_of(p, count):  # type: ignore[no-untyped-def]
    """Return the chart that follows ``count`` run-time parameters."""
    size = int(carray(p, count + 1)[count])
    return carray(p, count + size)[count:]


@Inner
def _piece(chart, s):  # type: ignore[no-untyped-def]
    """Return the piece on which an arc length within the first lap lies."""
    below, above = 0, int(chart[1])
    while above - below > 1:
        middle = (below + above) // 2
        if s >= chart[EDGES + middle]:
            below = middle
        else:
            above = middle
    return below


@Inlined
def _piece_near(chart, s, k):  # type: ignore[no-untyped-def]
    """Return the piece on which an arc length within the first lap lies, which is probably ``k`` or one next to it."""
    last = int(chart[1]) - 1
    k += int(s >= chart[EDGES + min(k, last - 1) + 1]) - int(s < chart[EDGES + k])
    k = min(max(k, 0), last)
    inside = (s >= chart[EDGES + k] or k == 0) and (s < chart[EDGES + k + 1] or k == last)
    return k if inside else _piece(chart, s)


@Inlined
def _reduced(chart, s):  # type: ignore[no-untyped-def]
    """Reduce an arc length to the first lap of a closed curve; return it with the number of laps that were removed."""
    period = chart[4]
    laps = floor((s - chart[2]) / period) if period > 0.0 else 0.0
    return s - laps * period, laps


@Inner
def find(chart, s):  # type: ignore[no-untyped-def]
    """Return the piece of an arc length, the place u in [-1, 1] on it, and the number of laps of a closed curve."""
    s, laps = _reduced(chart, s)
    below = _piece(chart, s)
    start = EDGES + 3 * int(chart[1]) + 2 + below * RECORD
    u = (s - chart[start]) * chart[start + 1]
    if chart[4] > 0.0:
        u = min(max(u, -1.0), 1.0)
    return below, u, laps


@Inlined
def powers_of(chart, start, row):  # type: ignore[no-untyped-def]
    """Return the coefficients of a row on the piece whose record begins at ``start``, highest power first."""
    c, at = chart, start + 6 + row * TERMS
    high = c[at + 15], c[at + 14], c[at + 13], c[at + 12], c[at + 11], c[at + 10], c[at + 9], c[at + 8]
    return (*high, c[at + 7], c[at + 6], c[at + 5], c[at + 4], c[at + 3], c[at + 2], c[at + 1], c[at])


@Inlined
def constant_of(chart, start, row, laps):  # type: ignore[no-untyped-def]
    """Return the constant that is added to the polynomial of a row, as two numbers."""
    if row < 2:
        return chart[start + 2 + 2 * row], chart[start + 3 + 2 * row]
    return (laps * chart[5] if row == 2 else 0.0), 0.0


@Inner
def chart_row(chart, row, s):  # type: ignore[no-untyped-def]
    """Return one row of the chart: 0 is x, 1 is z, 2 is alpha, 3 is kappa."""
    k, u, laps = find(chart, s)
    start = EDGES + 3 * int(chart[1]) + 2 + k * RECORD
    high, low = constant_of(chart, start, row, laps)
    return high + (low + polynomial(powers_of(chart, start, row), u))


# One register is filled, or several, which together take less time than one by one.
SEVERAL = 4
fill_lanes, fill_several = filling(1, TERMS - 1), filling(SEVERAL, TERMS - 1)


@Inlined
def run_of_places(chart, places, begin, piece):  # type: ignore[no-untyped-def]
    """Return the piece on which the place number ``begin`` lies, which is probably ``piece`` or one next to it; the
    number of laps before it; and the number of the first place after it that lies elsewhere.
    """
    count, closed = int(chart[1]), chart[4] > 0.0
    s, laps = _reduced(chart, places[begin])
    piece, lap = _piece_near(chart, s, piece), laps * chart[4]
    low = chart[EDGES + piece] if piece > 0 or closed else -inf
    high = chart[EDGES + piece + 1] if piece < count - 1 or closed else inf
    end = begin + 1
    while end < places.size and low <= places[end] - lap < high:
        end += 1
    return piece, laps, end


@Inner
def fill_run(powers, terms, numbers, places, run, out, to):  # type: ignore[no-untyped-def]
    """Fill a row of ``out``, which begins at ``to``, at places that lie on the same piece.

    Parameters
    ----------
    powers, terms
        An array, and where in it the powers of u begin.
    numbers : (lap, middle, scale, limit, whole, low)
        As in `filling`.
    places : (n,) array
    run : (begin, end)
        The places to fill; n is at least the number of lanes.
    """
    begin, end = run
    filled, last = begin, places.size - LANES
    while filled + SEVERAL * LANES <= end:
        fill_several(powers, terms, places, filled, out, to + filled, 0, numbers)
        filled += SEVERAL * LANES
    # A register at the end of the places also takes places before the first one, whose values it does not store.
    for j in range(filled, end, LANES):
        at = min(j, last)
        fill_lanes(powers, terms, places, at, out, to + at, begin - at, numbers)


@Inner
def rows_of_charts(charts, rows, places, out):  # type: ignore[no-untyped-def]
    """Fill the last rows of ``out`` with these rows of each of some charts at many places, of which neighbours often
    lie on the same piece.

    Parameters
    ----------
    charts : tuple of array
        Charts with the same pieces, as those of the coordinates of a curve in space.
    rows : tuple of int
        As in `chart_row`, or `SIZES`.
    places : (n,) array
    out : (m, n) array
        Has at least as many rows as ``rows`` names for all charts.
    """
    places, out, chart, each = borrowed(places), borrowed(out), charts[0], len(rows)
    count, limit = int(chart[1]), 1.0 if chart[4] > 0.0 else inf
    end, n, first, piece = 0, places.size, out.shape[0] - len(charts) * each, count // 2
    while end < n:
        begin = end
        piece, laps, end = run_of_places(chart, places, begin, piece)
        start = EDGES + 3 * count + 2 + piece * RECORD
        middle, scale, lap = chart[start], chart[start + 1], laps * chart[4]
        for k in range(len(charts) * each):
            of, row, to = charts[k // each], rows[k % each], first + k
            if row == SIZES:
                out[to, begin:end] = fabs(of[start + 4]) + 1.0 / scale
                continue
            terms, (whole, low) = start + 6 + row * TERMS, constant_of(of, start, row, laps)
            if n < LANES:
                for j in range(begin, end):
                    u = min(max(((places[j] - lap) - middle) * scale, -limit), limit)
                    out[to, j] = whole + (low + polynomial(powers_of(of, start, row), u))
                continue
            numbers = lap, middle, scale, limit, whole, low
            fill_run(of, terms, numbers, places, (begin, end), out, to * n)


@Inner
def chart_rows(chart, rows, places, out):  # type: ignore[no-untyped-def]
    """Fill the last rows of ``out`` with these rows of one chart at many places (`rows_of_charts`)."""
    rows_of_charts((chart,), rows, places, out)


@Inner
def spare_rows(count, n):  # type: ignore[no-untyped-def]
    """Return an array for so many rows of charts at n places."""
    return np.empty((count, n))


@Inner
def chart_x(chart, s):  # type: ignore[no-untyped-def]
    """Return the horizontal coordinate."""
    return chart_row(chart, 0, s)


@Inner
def chart_z(chart, s):  # type: ignore[no-untyped-def]
    """Return the height."""
    return chart_row(chart, 1, s)


@Inner
def chart_alpha(chart, s):  # type: ignore[no-untyped-def]
    """Return the angle of the tangent."""
    return chart_row(chart, 2, s)


@Inner
def chart_kappa(chart, s):  # type: ignore[no-untyped-def]
    """Return the signed curvature."""
    return chart_row(chart, 3, s)


@Inner
def derivatives_at(chart, k, u, laps):  # type: ignore[no-untyped-def]
    """Return alpha, kappa and x at a place that `find` has found; for a curve in space, the derivatives of a
    coordinate.
    """
    start = EDGES + 3 * int(chart[1]) + 2 + k * RECORD
    first = laps * chart[5] + polynomial(powers_of(chart, start, 2), u)
    high, low = constant_of(chart, start, 0, laps)
    return first, polynomial(powers_of(chart, start, 3), u), high + (low + polynomial(powers_of(chart, start, 0), u))


@Inner
def _turned(chart, s):  # type: ignore[no-untyped-def]
    """Return a bound on the change of alpha from the first edge to a place."""
    k, u, laps = find(chart, s)
    count = int(chart[1])
    start = EDGES + 3 * count + 2 + k * RECORD
    part = (u + 1.0) / chart[start + 1] * chart[EDGES + 2 * (count + 1) + k]
    return laps * chart[EDGES + 2 * count + 1] + chart[EDGES + count + 1 + k] + part


@Inner
def ichart_alpha(chart, s):  # type: ignore[no-untyped-def]
    """Return an enclosure of alpha over an interval of arc length."""
    return _ichart_alpha(chart, s, 1.0)


@Inner
def ichart_slope(chart, s):  # type: ignore[no-untyped-def]
    """Return an enclosure of alpha, which is the slope of the mean of a part of a potential, over an interval of arc
    length.

    Its rounding is compared with what it changes along the chart, as it has no scale.
    """
    return _ichart_alpha(chart, s, min(1.0, chart[EDGES + 2 * int(chart[1]) + 1]))


@Inlined
def _ichart_alpha(chart, s, scale):  # type: ignore[no-untyped-def]
    low, high = s
    first, left, laps = find(chart, low)
    last, right, more = find(chart, high)
    if first == last and laps == more:
        return _ichart_alpha_on_piece(chart, first, left, right, laps)
    middle = 0.5 * (low + high)
    value, here = chart_row(chart, 2, middle), _turned(chart, middle)
    reach = max(here - _turned(chart, low), _turned(chart, high) - here)
    margin = ALPHA_ERROR_SHARE * (scale + fabs(value))
    return value - reach - margin, value + reach + margin


@Inner
def _ichart_alpha_on_piece(chart, k, left, right, laps):  # type: ignore[no-untyped-def]
    """Return an enclosure of alpha between two places u on one piece.

    Rounding is compared with the terms of the piece's own polynomial, so that a straight line in the direction of an
    axis has no slope at all.
    """
    count = int(chart[1])
    start = EDGES + 3 * count + 2 + k * RECORD
    constant = laps * chart[5]
    value = constant + polynomial(powers_of(chart, start, 2), 0.5 * (left + right))
    terms = fabs(constant)
    for j in range(TERMS):
        terms += fabs(chart[start + 6 + 2 * TERMS + j])
    reach = 0.5 * (right - left) / chart[start + 1] * chart[EDGES + 2 * (count + 1) + k]
    margin = ALPHA_ERROR_SHARE * terms
    return value - reach - margin, value + reach + margin


@Inner
def ichart_kappa(chart, s):  # type: ignore[no-untyped-def]
    """Return an enclosure of the curvature over an interval of arc length, from the polynomial of each piece about its
    middle.
    """
    count = int(chart[1])
    first, left, laps = find(chart, s[0])
    last, right, more = find(chart, s[1])
    pieces = int(last - first + (more - laps) * count) + 1
    if pieces > count:  # the whole curve
        pieces, left, right = count, -1.0, 1.0
    low, high = inf, -inf
    for k in range(pieces):
        begin = left if k == 0 else -1.0
        end = right if k == pieces - 1 else 1.0
        start = EDGES + 3 * count + 2 + (first + k) % count * RECORD + 6 + 3 * TERMS
        middle, reach = 0.5 * (begin + end), 0.5 * fabs(end - begin)
        value, slope = 0.0, 0.0
        for j in range(TERMS - 1, -1, -1):
            value = value * middle + chart[start + j]
            slope += j * fabs(chart[start + j])
        margin = reach * slope + 1e-13 * (fabs(value) + slope)
        low, high = min(low, value - margin), max(high, value + margin)
    return low, high


@Inner
def _ichart(chart, row, s):  # type: ignore[no-untyped-def]
    """Return an enclosure of a coordinate, which changes by no more than the arc length does."""
    low, high = s
    value = chart_row(chart, row, 0.5 * (low + high))
    reach = 0.5 * (high - low) * (1.0 + 1e-12) + 1e-14 * fabs(value)
    return value - reach, value + reach


@Inner
def ichart_x(chart, s):  # type: ignore[no-untyped-def]
    """Return an enclosure of x over an interval of arc length."""
    return _ichart(chart, 0, s)


@Inner
def ichart_z(chart, s):  # type: ignore[no-untyped-def]
    """Return an enclosure of z over an interval of arc length."""
    return _ichart(chart, 1, s)
