"""What compiled code reads from a chart (`chart`): its rows, their divided differences, and bounds.

The flat array holds, one after the other::

    size, count, low, high, period, turn      of the chart; then, n = count pieces,
    edges (n+1)                               arc length at their edges
    turned (n+1)                              bound of how much alpha turns from the first edge to each edge
    most (n)                                  bound of |kappa| on each piece
    records (n, RECORD)                       middle, one over the half length, x and z at the middle as two doubles
                                              each, then powers of u in [-1, 1] for x, z, alpha and kappa

Divided differences subtract no coordinates of one piece or of neighbours; farther apart, coordinates as two doubles.
"""

from math import fabs, floor, inf

from numba import carray

from gqm_sym.runtime.compiled.jit import Inner

TERMS = 16
ROWS = 4
EDGES = 6
RECORD = 6 + ROWS * TERMS

# A jump of a derivative between neighbours that is smaller than this share of it is rounding.
JUMP = 1e-11


@Inner
def chart_of(p, count):  # type: ignore[no-untyped-def]
    """The chart that follows ``count`` run-time parameters."""
    size = int(carray(p, count + 1)[count])
    return carray(p, count + size)[count:]


@Inner
def find(chart, s):  # type: ignore[no-untyped-def]
    """The piece of an arc length, the place u in [-1, 1] on it, and how many times round the closed curve it is."""
    count, low, period = int(chart[1]), chart[2], chart[4]
    laps = 0.0
    if period > 0.0:
        laps = floor((s - low) / period)
        s = s - laps * period
    below, above = 0, count
    while above - below > 1:
        middle = (below + above) // 2
        if s >= chart[EDGES + middle]:
            below = middle
        else:
            above = middle
    start = EDGES + 3 * count + 2 + below * RECORD
    u = (s - chart[start]) * chart[start + 1]
    if period > 0.0:
        u = min(max(u, -1.0), 1.0)
    return below, u, laps


@Inner
def chart_row(chart, row, s):  # type: ignore[no-untyped-def]
    """One row of the chart: 0 is x, 1 is z, 2 is alpha, 3 is kappa."""
    k, u, laps = find(chart, s)
    start = EDGES + 3 * int(chart[1]) + 2 + k * RECORD
    total = 0.0
    for j in range(TERMS - 1, -1, -1):
        total = total * u + chart[start + 6 + row * TERMS + j]
    if row < 2:
        total = chart[start + 2 + 2 * row] + (chart[start + 3 + 2 * row] + total)
    elif row == 2:
        total += laps * chart[5]
    return total


@Inner
def chart_x(chart, s):  # type: ignore[no-untyped-def]
    """Horizontal coordinate."""
    return chart_row(chart, 0, s)


@Inner
def chart_z(chart, s):  # type: ignore[no-untyped-def]
    """Height."""
    return chart_row(chart, 1, s)


@Inner
def chart_alpha(chart, s):  # type: ignore[no-untyped-def]
    """Angle of the tangent."""
    return chart_row(chart, 2, s)


@Inner
def chart_kappa(chart, s):  # type: ignore[no-untyped-def]
    """Signed curvature."""
    return chart_row(chart, 3, s)


@Inner
def _power(chart, row, start, j):  # type: ignore[no-untyped-def]
    """What a row is made of, but for a constant; the angle's differences are means of the curvature."""
    if row < 2:
        return chart[start + 6 + row * TERMS + j]
    return chart[start + 5 + 3 * TERMS + j] / (j * chart[start + 1]) if j > 0 else 0.0


@Inner
def _slope(chart, row, k, u, v):  # type: ignore[no-untyped-def]
    """The first divided difference of a row over two places of one piece."""
    start = EDGES + 3 * int(chart[1]) + 2 + k * RECORD
    value, first = 0.0, 0.0
    for j in range(TERMS - 1, -1, -1):
        first = first * v + value
        value = value * u + _power(chart, row, start, j)
    return first * chart[start + 1]


@Inner
def _bend(chart, row, k, u, v, w):  # type: ignore[no-untyped-def]
    """The second divided difference of a row over three places of one piece."""
    start = EDGES + 3 * int(chart[1]) + 2 + k * RECORD
    value, first, second = 0.0, 0.0, 0.0
    for j in range(TERMS - 1, -1, -1):
        second = second * w + first
        first = first * v + value
        value = value * u + _power(chart, row, start, j)
    return second * chart[start + 1] * chart[start + 1]


@Inner
def _first(chart, row, s, t, h):  # type: ignore[no-untyped-def]
    """The first divided difference over places s and t = s + h, in any order."""
    if h < 0.0:
        s, t, h = t, s, -h
    ks, us, laps_s = find(chart, s)
    kt, ut, laps_t = find(chart, t)
    apart = (kt - ks) + (laps_t - laps_s) * chart[1]
    if apart == 0.0:
        return _slope(chart, row, ks, us, ut)
    base = EDGES + 3 * int(chart[1]) + 2
    from_s, from_t = base + ks * RECORD, base + kt * RECORD
    if apart == 1.0:  # neighbours: what both sides of their common edge add
        before, after = (1.0 - us) / chart[from_s + 1], (ut + 1.0) / chart[from_t + 1]
        if not before + after > 0.0:  # both at the joint, but for rounding
            return _slope(chart, row, kt, -1.0, ut)
        gained = before * _slope(chart, row, ks, us, 1.0) + after * _slope(chart, row, kt, -1.0, ut)
        return gained / (before + after)
    one, two = 0.0, 0.0
    for j in range(TERMS - 1, -1, -1):
        one = one * us + chart[from_s + 6 + row * TERMS + j]
        two = two * ut + chart[from_t + 6 + row * TERMS + j]
    if row >= 2:  # an angle: it grows with each lap
        return ((laps_t - laps_s) * chart[5] + (two - one)) / h
    whole = chart[from_t + 2 + 2 * row] - chart[from_s + 2 + 2 * row]
    rest = (chart[from_t + 3 + 2 * row] - chart[from_s + 3 + 2 * row]) + (two - one)
    return (whole + rest) / h


@Inner
def _second(chart, row, r, s, t, h1, h2):  # type: ignore[no-untyped-def]
    """The second divided difference over r, s = r + h1 and t = s + h2, in any order."""
    if h1 < 0.0:
        r, s, h1, h2 = s, r, -h1, h1 + h2
    if h2 < 0.0:
        s, t, h1, h2 = t, s, h1 + h2, -h2
    if h1 < 0.0:
        r, s, h1, h2 = s, r, -h1, h1 + h2
    kr, ur, laps_r = find(chart, r)
    ks, us, laps_s = find(chart, s)
    kt, ut, laps_t = find(chart, t)
    span = (kt - kr) + (laps_t - laps_r) * chart[1]
    if span == 0.0:
        return _bend(chart, row, kr, ur, us, ut)
    if span == 1.0:
        count = int(chart[1])
        base = EDGES + 3 * count + 2
        before, after = (1.0 - ur) / chart[base + kr * RECORD + 1], (ut + 1.0) / chart[base + kt * RECORD + 1]
        left, right = _slope(chart, row, kr, 1.0, 1.0), _slope(chart, row, kt, -1.0, -1.0)
        jump = right - left
        # The slope of a coordinate is at most one, that of the angle the curvature.
        largest = 1.0 if row < 2 else max(chart[EDGES + 2 * (count + 1) + kr], chart[EDGES + 2 * (count + 1) + kt])
        if fabs(jump) <= JUMP * largest:
            jump = 0.0
        # The difference over the outer places is a weighted mean of those with the common edge put in between.
        if ks == kr and laps_s == laps_r:
            near = (1.0 - us) / chart[base + ks * RECORD + 1]
            over = after * _bend(chart, row, kt, -1.0, -1.0, ut) + near * _bend(chart, row, kr, us, 1.0, 1.0) + jump
            if near + after > 0.0:
                over /= near + after
                return (before * _bend(chart, row, kr, ur, us, 1.0) + after * over) / (before + after)
        else:
            near = (us + 1.0) / chart[base + ks * RECORD + 1]
            over = near * _bend(chart, row, kt, -1.0, -1.0, us) + before * _bend(chart, row, kr, ur, 1.0, 1.0) + jump
            if near + before > 0.0:
                over /= near + before
                return (before * over + after * _bend(chart, row, kt, -1.0, us, ut)) / (before + after)
    return (_first(chart, row, s, t, h2) - _first(chart, row, r, s, h1)) / (h1 + h2)


@Inner
def divdiff1_chart_x(chart, s, t, h):  # type: ignore[no-untyped-def]
    """x[s, t] with h = t - s."""
    return _first(chart, 0, s, t, h)


@Inner
def divdiff1_chart_z(chart, s, t, h):  # type: ignore[no-untyped-def]
    """z[s, t] with h = t - s."""
    return _first(chart, 1, s, t, h)


@Inner
def divdiff1_chart_alpha(chart, s, t, h):  # type: ignore[no-untyped-def]
    """alpha[s, t] with h = t - s."""
    return _first(chart, 2, s, t, h)


@Inner
def divdiff2_chart_x(chart, r, s, t, h1, h2):  # type: ignore[no-untyped-def]
    """x[r, s, t] with h1 = s - r and h2 = t - s."""
    return _second(chart, 0, r, s, t, h1, h2)


@Inner
def divdiff2_chart_z(chart, r, s, t, h1, h2):  # type: ignore[no-untyped-def]
    """z[r, s, t] with h1 = s - r and h2 = t - s."""
    return _second(chart, 1, r, s, t, h1, h2)


@Inner
def divdiff2_chart_alpha(chart, r, s, t, h1, h2):  # type: ignore[no-untyped-def]
    """alpha[r, s, t] with h1 = s - r and h2 = t - s."""
    return _second(chart, 2, r, s, t, h1, h2)


@Inner
def _turned(chart, s):  # type: ignore[no-untyped-def]
    """Bound of how much alpha turns from the first edge to a place."""
    k, u, laps = find(chart, s)
    count = int(chart[1])
    start = EDGES + 3 * count + 2 + k * RECORD
    part = (u + 1.0) / chart[start + 1] * chart[EDGES + 2 * (count + 1) + k]
    return laps * chart[EDGES + 2 * count + 1] + chart[EDGES + count + 1 + k] + part


@Inner
def ichart_alpha(chart, s):  # type: ignore[no-untyped-def]
    """Enclosure of alpha over an interval of arc length."""
    low, high = s
    middle = 0.5 * (low + high)
    value, here = chart_row(chart, 2, middle), _turned(chart, middle)
    reach = max(here - _turned(chart, low), _turned(chart, high) - here)
    slack = 1e-12 * (1.0 + fabs(value))
    return value - reach - slack, value + reach + slack


@Inner
def ichart_kappa(chart, s):  # type: ignore[no-untyped-def]
    """Enclosure of the curvature over an interval of arc length: on each piece its middle, and bounds of its terms."""
    count = int(chart[1])
    first, left, laps = find(chart, s[0])
    last, right, more = find(chart, s[1])
    pieces = int(last - first + (more - laps) * count) + 1
    if pieces > count:  # all round
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
        slack = reach * slope + 1e-13 * (fabs(value) + slope)
        low, high = min(low, value - slack), max(high, value + slack)
    return low, high


@Inner
def _ichart(chart, row, s):  # type: ignore[no-untyped-def]
    """Enclosure of a coordinate: it changes by no more than the arc length does."""
    low, high = s
    value = chart_row(chart, row, 0.5 * (low + high))
    reach = 0.5 * (high - low) * (1.0 + 1e-12) + 1e-14 * fabs(value)
    return value - reach, value + reach


@Inner
def ichart_x(chart, s):  # type: ignore[no-untyped-def]
    """Enclosure of x over an interval of arc length."""
    return _ichart(chart, 0, s)


@Inner
def ichart_z(chart, s):  # type: ignore[no-untyped-def]
    """Enclosure of z over an interval of arc length."""
    return _ichart(chart, 1, s)
