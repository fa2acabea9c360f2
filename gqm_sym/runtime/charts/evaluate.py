"""Evaluation of a chart in compiled code: its rows, their divided differences, and enclosures.

The flat array of a chart (`chart.Chart.block`) contains, one after the other::

    size, count, low, high, period, turn      of the chart; then, for n = count pieces,
    edges (n+1)                               arc length at their edges
    turned (n+1)                              bound of how much alpha turns from the first edge to each edge
    most (n)                                  bound of |kappa| on each piece
    records (n, RECORD)                       middle, one over the half length, x and z at the middle as two doubles
                                              each, then powers of u in [-1, 1] for x, z, alpha and kappa

Divided differences on one piece, or on two neighbours, subtract no coordinates. Between other pieces they subtract
coordinates that are two doubles each.
"""

from math import fabs, floor, inf
from typing import Any

import numpy as np
from llvmlite import ir
from numba import carray, types
from numba.extending import intrinsic

from gqm_sym.runtime.compiled.intrinsics import item_at, polynomial
from gqm_sym.runtime.compiled.jit import Inlined, Inner
from gqm_sym.runtime.compiled.registers import INDEX, LANES, REGISTER, broadcast, line_of, operation, register
from gqm_sym.runtime.compiled.uncompiled import fma, in_python

TERMS = 16
ROWS = 4
EDGES = 6
RECORD = 6 + ROWS * TERMS

# The number by which `chart_rows` is asked for the size of the terms of a coordinate in space whose slope is at most 1.
SIZES = 4

# A jump of a derivative between neighbouring pieces that is smaller than this share of the derivative is due to
# rounding.
MAX_ROUNDING_JUMP = 1e-11


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


@Inner
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
def _powers(chart, start, row):  # type: ignore[no-untyped-def]
    """Return the coefficients of a row on the piece whose record begins at ``start``, highest power first."""
    c, at = chart, start + 6 + row * TERMS
    high = c[at + 15], c[at + 14], c[at + 13], c[at + 12], c[at + 11], c[at + 10], c[at + 9], c[at + 8]
    return (*high, c[at + 7], c[at + 6], c[at + 5], c[at + 4], c[at + 3], c[at + 2], c[at + 1], c[at])


@Inlined
def _constant(chart, start, row, laps):  # type: ignore[no-untyped-def]
    """Return the constant that is added to the polynomial of a row, as two numbers."""
    if row < 2:
        return chart[start + 2 + 2 * row], chart[start + 3 + 2 * row]
    return (laps * chart[5] if row == 2 else 0.0), 0.0


@Inner
def chart_row(chart, row, s):  # type: ignore[no-untyped-def]
    """Return one row of the chart: 0 is x, 1 is z, 2 is alpha, 3 is kappa."""
    k, u, laps = find(chart, s)
    start = EDGES + 3 * int(chart[1]) + 2 + k * RECORD
    high, low = _constant(chart, start, row, laps)
    return high + (low + polynomial(_powers(chart, start, row), u))


def _filling(count: int) -> Any:
    """Return a function that fills so many registers' numbers of a row at a time, a term of all of them after the
    other, so that none waits for the last operation on itself.

    It is called with ``(chart, terms, places, at, out, to, first, numbers)``: the powers of u are stored at ``terms``
    of the chart, the places from ``at`` on in ``places``, and the values from ``to`` on in ``out``. Lanes before
    ``first`` keep their values. The ``numbers`` are the length of all laps before, the piece's middle and scale, the
    limit of u, and two numbers that the polynomial is added to.
    """

    @intrinsic
    def fill(_, chart, terms, places, at, out, to, first, numbers):  # type: ignore[no-untyped-def]
        def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            lines = [line_of(context, builder, signature.args[k], args[k]) for k in (0, 2, 4)]
            powers, given, target = (builder.gep(line, [args[k]]) for line, k in zip(lines, (1, 3, 5), strict=True))
            lap, middle, scale, limit, whole, low = (
                broadcast(builder, builder.extract_value(args[7], k)) for k in range(6)
            )
            below, us = builder.fneg(limit), []
            for k in range(count):
                s = builder.load(register(builder, given, k * LANES), align=8)
                u = builder.fmul(builder.fsub(builder.fsub(s, lap), middle), scale)
                u = builder.select(builder.fcmp_ordered("<", u, below), below, u)
                us.append(builder.select(builder.fcmp_ordered(">", u, limit), limit, u))
            values = [ir.Constant(REGISTER, [0.0] * LANES)] * count
            for k in range(TERMS - 1, -1, -1):
                term = broadcast(builder, builder.load(builder.gep(powers, [ir.Constant(INDEX, k)])))
                values = [operation(builder, "fma", value, u, term) for value, u in zip(values, us, strict=True)]
            values = [builder.fadd(whole, builder.fadd(low, value)) for value in values]
            old = builder.load(register(builder, target, 0), align=8)
            lane = ir.Constant(ir.VectorType(ir.IntType(64), LANES), list(range(LANES)))
            bound = ir.Constant(ir.VectorType(ir.IntType(64), LANES), ir.Undefined)
            for k in range(LANES):
                bound = builder.insert_element(bound, args[6], ir.Constant(INDEX, k))
            values[0] = builder.select(builder.icmp_signed("<", lane, bound), old, values[0])
            for k, value in enumerate(values):
                builder.store(value, register(builder, target, k * LANES), align=8)
            return context.get_dummy_value()

        return types.void(chart, terms, places, at, out, to, first, numbers), lower

    @in_python(fill)
    def _fill(chart: Any, terms: int, places: Any, at: int, out: Any, to: int, first: int, numbers: Any) -> None:
        lap, middle, scale, limit, whole, low = numbers
        for lane in range(max(first, 0), count * LANES):
            u = min(max(((places[at + lane] - lap) - middle) * scale, -limit), limit)
            value = 0.0
            for k in range(TERMS - 1, -1, -1):
                value = fma(value, u, chart[terms + k])
            out.reshape(-1)[to + lane] = whole + (low + value)

    return fill


# One register is filled, or several, which together take less time than one by one.
SEVERAL = 4
fill_lanes, fill_several = _filling(1), _filling(SEVERAL)


@Inner
def chart_rows(chart, rows, places, out):  # type: ignore[no-untyped-def]
    """Fill the last rows of ``out`` with these rows of the chart at many places, of which neighbours often lie on the
    same piece.

    Parameters
    ----------
    rows : tuple of int
        As in `chart_row`, or `SIZES`.
    places : (n,) array
    out : (m, n) array
        Has at least as many rows as ``rows`` names.
    """
    count, closed = int(chart[1]), chart[4] > 0.0
    limit = 1.0 if closed else inf
    i, n, first, piece = 0, places.size, out.shape[0] - len(rows), count // 2
    while i < n:
        s, laps = _reduced(chart, places[i])
        piece, begin = _piece_near(chart, s, piece), i
        start = EDGES + 3 * count + 2 + piece * RECORD
        middle, scale, lap = chart[start], chart[start + 1], laps * chart[4]
        low = chart[EDGES + piece] if piece > 0 or closed else -inf
        high = chart[EDGES + piece + 1] if piece < count - 1 or closed else inf
        i += 1
        while i < n and low <= places[i] - lap < high:
            i += 1
        for k in range(len(rows)):
            row = rows[k]
            if row == SIZES:
                out[first + k, begin:i] = fabs(chart[start + 4]) + 1.0 / scale
                continue
            terms, (whole, constant_low) = start + 6 + row * TERMS, _constant(chart, start, row, laps)
            if n < LANES:
                for j in range(begin, i):
                    u = min(max(((places[j] - lap) - middle) * scale, -limit), limit)
                    out[first + k, j] = whole + (constant_low + polynomial(_powers(chart, start, row), u))
                continue
            numbers, filled = (lap, middle, scale, limit, whole, constant_low), begin
            while filled + SEVERAL * LANES <= i:
                fill_several(chart, terms, places, filled, out, (first + k) * n + filled, 0, numbers)
                filled += SEVERAL * LANES
            # A register at the end of the places also takes places before the first one, whose values it does not
            # store.
            for j in range(filled, i, LANES):
                at = min(j, n - LANES)
                fill_lanes(chart, terms, places, at, out, (first + k) * n + at, begin - at, numbers)


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
    first = laps * chart[5] + polynomial(_powers(chart, start, 2), u)
    high, low = _constant(chart, start, 0, laps)
    return first, polynomial(_powers(chart, start, 3), u), high + (low + polynomial(_powers(chart, start, 0), u))


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
    one, two = polynomial(_powers(chart, from_s, row), us), polynomial(_powers(chart, from_t, row), ut)
    if row >= 2:  # the angle increases with each lap
        return ((laps_t - laps_s) * chart[5] + (two - one)) / h
    whole = chart[from_t + 2 + 2 * row] - chart[from_s + 2 + 2 * row]
    difference = (chart[from_t + 3 + 2 * row] - chart[from_s + 3 + 2 * row]) + (two - one)
    return (whole + difference) / h


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
    middle = 0.5 * (low + high)
    value, here = chart_row(chart, 2, middle), _turned(chart, middle)
    reach = max(here - _turned(chart, low), _turned(chart, high) - here)
    margin = 1e-12 * (scale + fabs(value))
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
