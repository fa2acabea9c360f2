"""Divided differences of the rows of a chart in compiled code.

On one piece, or on two neighbours, they subtract no coordinates. Between other pieces they subtract coordinates that
are two doubles each. Over a fixed place and many others they are, on each piece, polynomials in the place or sums of
such a polynomial and a constant.
"""

from math import fabs, inf

import numpy as np

from gqm_sym.runtime.charts.evaluate import EDGES, RECORD, TERMS, constant_of, fill_run, find, powers_of, run_of_places
from gqm_sym.runtime.compiled.intrinsics import item_at, polynomial
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import LANES

# A jump of a derivative between neighbouring pieces that is smaller than this share of the derivative is due to
# rounding.
MAX_ROUNDING_JUMP = 1e-11


@Inner
def _power(chart, row, start, j):  # type: ignore[no-untyped-def]
    """Return a coefficient of a row up to its constant; the angle is the integral of the curvature."""
    if row < 2:
        return item_at(chart, start + 6 + row * TERMS + j)
    return item_at(chart, start + 5 + 3 * TERMS + j) / (j * chart[start + 1]) if j > 0 else 0.0


@Inner
def _divdiff1_on_piece(chart, row, k, u, v):  # type: ignore[no-untyped-def]
    """Return the first divided difference of a row over two places of one piece."""
    start = EDGES + 3 * int(chart[1]) + 2 + k * RECORD
    value, first = 0.0, 0.0
    for j in range(TERMS - 1, -1, -1):
        first = first * v + value
        value = value * u + _power(chart, row, start, j)
    return first * chart[start + 1]


@Inner
def _divdiff2_on_piece(chart, row, k, u, v, w):  # type: ignore[no-untyped-def]
    """Return the second divided difference of a row over three places of one piece."""
    start = EDGES + 3 * int(chart[1]) + 2 + k * RECORD
    value, first, second = 0.0, 0.0, 0.0
    for j in range(TERMS - 1, -1, -1):
        second = second * w + first
        first = first * v + value
        value = value * u + _power(chart, row, start, j)
    return second * chart[start + 1] * chart[start + 1]


@Inner
def _divdiff1(chart, row, s, t, h):  # type: ignore[no-untyped-def]
    """Return the first divided difference over places s and t = s + h, in any order."""
    if h < 0.0:
        s, t, h = t, s, -h
    return _divdiff1_between(chart, row, find(chart, s), find(chart, t), h)


@Inner
def _divdiff1_between(chart, row, lower, upper, h):  # type: ignore[no-untyped-def]
    """Return the first divided difference over places that `find` has found, the upper one ``h`` above the lower."""
    (ks, us, laps_s), (kt, ut, laps_t) = lower, upper
    apart = (kt - ks) + (laps_t - laps_s) * chart[1]
    if apart == 0.0:
        return _divdiff1_on_piece(chart, row, ks, us, ut)
    base = EDGES + 3 * int(chart[1]) + 2
    from_s, from_t = base + ks * RECORD, base + kt * RECORD
    if apart == 1.0:  # neighbours: the mean of the differences on both sides of the common edge
        before, after = (1.0 - us) / chart[from_s + 1], (ut + 1.0) / chart[from_t + 1]
        if not before + after > 0.0:  # both places are at the joint, up to rounding
            return _divdiff1_on_piece(chart, row, kt, -1.0, ut)
        gained = before * _divdiff1_on_piece(chart, row, ks, us, 1.0) + after * _divdiff1_on_piece(
            chart, row, kt, -1.0, ut
        )
        return gained / (before + after)
    one, two = polynomial(powers_of(chart, from_s, row), us), polynomial(powers_of(chart, from_t, row), ut)
    if row >= 2:  # the angle increases with each lap
        return ((laps_t - laps_s) * chart[5] + (two - one)) / h
    whole = chart[from_t + 2 + 2 * row] - chart[from_s + 2 + 2 * row]
    difference = (chart[from_t + 3 + 2 * row] - chart[from_s + 3 + 2 * row]) + (two - one)
    return (whole + difference) / h


@Inner
def chart_differences(chart, rows, s, places, offsets, out):  # type: ignore[no-untyped-def]
    """Fill the last rows of ``out`` with the first divided differences of these rows of the chart over s and each of
    many places, of which neighbours often lie on the same piece.

    Parameters
    ----------
    rows : tuple of int
        As in `evaluate.chart_row`.
    s : float
        The place that all differences have in common.
    places, offsets : (n,) arrays
        The other places, and how far they are from s.
    out : (m, n) array
        Has at least as many rows as ``rows`` names.
    """
    count, limit = int(chart[1]), 1.0 if chart[4] > 0.0 else inf
    held = find(chart, s)
    end, n, first, piece, powers = 0, places.size, out.shape[0] - len(rows), held[0], np.empty(TERMS)
    if n < LANES:
        for k in range(len(rows)):
            for j in range(n):
                out[first + k, j] = _divdiff1(chart, rows[k], s, places[j], offsets[j])
        return
    while end < n:
        begin = end
        piece, laps, end = run_of_places(chart, places, begin, piece)
        start = EDGES + 3 * count + 2 + piece * RECORD
        lap, middle, scale = laps * chart[4], chart[start], chart[start + 1]
        for k in range(len(rows)):
            at, run = (first + k) * n, (begin, end)
            line, apart = out[first + k], (piece - held[0]) + (laps - held[2]) * count
            if fabs(apart) > 1.0:
                high, low = _constants_between(chart, rows[k], held, (piece, laps))
                numbers = lap, middle, scale, limit, high, low
                fill_run(chart, start + 6 + rows[k] * TERMS, numbers, places, run, out, at)
                for j in range(begin, end):
                    line[j] /= offsets[j]
                continue
            # The edge towards s replaces it on the next piece.
            _divide_out(chart, rows[k], start, held[1] if apart == 0.0 else -apart, powers)
            fill_run(powers, 0, (lap, middle, scale, limit, 0.0, 0.0), places, run, out, at)
            near, over = _up_to_edge(chart, rows[k], held, apart)
            for j in range(begin, end):
                line[j] *= scale
                if apart != 0.0:
                    u = min(max(((places[j] - lap) - middle) * scale, -limit), limit)
                    beyond = (1.0 + apart * u) / scale
                    # Both places may be at the edge, up to rounding.
                    line[j] = (over + beyond * line[j]) / (near + beyond) if near + beyond > 0.0 else line[j]


@Inner
def _constants_between(chart, row, held, other):  # type: ignore[no-untyped-def]
    """Return the two numbers that are added to the polynomial of a row on a piece for its change from a place that
    `find` has found; ``other`` is that piece and the number of laps.
    """
    (k, u, laps), (piece, more) = held, other
    base = EDGES + 3 * int(chart[1]) + 2
    high, low = constant_of(chart, base + k * RECORD, row, laps)
    other_high, other_low = constant_of(chart, base + piece * RECORD, row, more)
    return other_high - high, (other_low - low) - polynomial(powers_of(chart, base + k * RECORD, row), u)


@Inner
def _divide_out(chart, row, start, u, powers):  # type: ignore[no-untyped-def]
    """Fill in the powers of v in the divided difference over u and v of a row on the piece whose record begins at
    ``start``.
    """
    value = 0.0
    for j in range(TERMS - 1, -1, -1):
        powers[j] = value
        value = value * u + _power(chart, row, start, j)


@Inner
def _up_to_edge(chart, row, held, side):  # type: ignore[no-untyped-def]
    """Return how far a place that `find` has found is from the upper (side 1) or lower (-1) edge of its piece, and that
    distance times the divided difference of a row; two zeros for side 0.
    """
    k, u, _ = held
    distance = (1.0 - side * u) / chart[EDGES + 3 * int(chart[1]) + 3 + k * RECORD] if side != 0.0 else 0.0
    return distance, distance * _divdiff1_on_piece(chart, row, k, u, side)


@Inner
def _divdiff2(chart, row, r, s, t, h1, h2):  # type: ignore[no-untyped-def]
    """Return the second divided difference over r, s = r + h1 and t = s + h2, in any order."""
    if h1 < 0.0:
        r, s, h1, h2 = s, r, -h1, h1 + h2
    if h2 < 0.0:
        s, t, h1, h2 = t, s, h1 + h2, -h2
    if h1 < 0.0:
        r, s, h1, h2 = s, r, -h1, h1 + h2
    lower, inner, upper = find(chart, r), find(chart, s), find(chart, t)
    (kr, ur, laps_r), (ks, us, laps_s), (kt, ut, laps_t) = lower, inner, upper
    span = (kt - kr) + (laps_t - laps_r) * chart[1]
    if span == 0.0:
        return _divdiff2_on_piece(chart, row, kr, ur, us, ut)
    if span == 1.0:
        count = int(chart[1])
        base = EDGES + 3 * count + 2
        before, after = (1.0 - ur) / chart[base + kr * RECORD + 1], (ut + 1.0) / chart[base + kt * RECORD + 1]
        left, right = _divdiff1_on_piece(chart, row, kr, 1.0, 1.0), _divdiff1_on_piece(chart, row, kt, -1.0, -1.0)
        jump = right - left
        # The slope of a coordinate is at most one, that of the angle the curvature.
        largest = (
            max(1.0, fabs(left), fabs(right))
            if row < 2
            else max(chart[EDGES + 2 * (count + 1) + kr], chart[EDGES + 2 * (count + 1) + kt])
        )
        if fabs(jump) <= MAX_ROUNDING_JUMP * largest:
            jump = 0.0
        # The difference over all three is a weighted mean of those in which the common edge replaces an outer place.
        if ks == kr and laps_s == laps_r:
            near = (1.0 - us) / chart[base + ks * RECORD + 1]
            over = (
                after * _divdiff2_on_piece(chart, row, kt, -1.0, -1.0, ut)
                + near * _divdiff2_on_piece(chart, row, kr, us, 1.0, 1.0)
                + jump
            )
            if near + after > 0.0:
                over /= near + after
                return (before * _divdiff2_on_piece(chart, row, kr, ur, us, 1.0) + after * over) / (before + after)
        else:
            near = (us + 1.0) / chart[base + ks * RECORD + 1]
            over = (
                near * _divdiff2_on_piece(chart, row, kt, -1.0, -1.0, us)
                + before * _divdiff2_on_piece(chart, row, kr, ur, 1.0, 1.0)
                + jump
            )
            if near + before > 0.0:
                over /= near + before
                return (before * over + after * _divdiff2_on_piece(chart, row, kt, -1.0, us, ut)) / (before + after)
    upward, downward = _divdiff1_between(chart, row, inner, upper, h2), _divdiff1_between(chart, row, lower, inner, h1)
    return (upward - downward) / (h1 + h2)


@Inner
def divdiff1_chart_x(chart, s, t, h):  # type: ignore[no-untyped-def]
    """x[s, t] with h = t - s."""
    return _divdiff1(chart, 0, s, t, h)


@Inner
def divdiff1_chart_z(chart, s, t, h):  # type: ignore[no-untyped-def]
    """z[s, t] with h = t - s."""
    return _divdiff1(chart, 1, s, t, h)


@Inner
def divdiff1_chart_alpha(chart, s, t, h):  # type: ignore[no-untyped-def]
    """alpha[s, t] with h = t - s."""
    return _divdiff1(chart, 2, s, t, h)


@Inner
def divdiff2_chart_x(chart, r, s, t, h1, h2):  # type: ignore[no-untyped-def]
    """x[r, s, t] with h1 = s - r and h2 = t - s."""
    return _divdiff2(chart, 0, r, s, t, h1, h2)


@Inner
def divdiff2_chart_z(chart, r, s, t, h1, h2):  # type: ignore[no-untyped-def]
    """z[r, s, t] with h1 = s - r and h2 = t - s."""
    return _divdiff2(chart, 1, r, s, t, h1, h2)


@Inner
def divdiff2_chart_alpha(chart, r, s, t, h1, h2):  # type: ignore[no-untyped-def]
    """alpha[r, s, t] with h1 = s - r and h2 = t - s."""
    return _divdiff2(chart, 2, r, s, t, h1, h2)
