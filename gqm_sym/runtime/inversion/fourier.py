"""Where the body of a periodic motion is, as a trigonometric polynomial of the phase.

The place on a libration is an even function of the phase from the lower turning point, and what the place on a
circulation has ahead of a steady pace is periodic. Both are analytic where the curve is smooth: a few tens of terms, a
hundred next to a separatrix, hold them to rounding, and a sum over many times at once by Clenshaw's recurrence fills
vector registers (`series`). Motions whose series is longer have none, and take the table (`orbits`), at three times
the cost.
"""

from math import cos, fabs, pi, sin

import numpy as np
from numba import types

from gqm_sym.runtime.arithmetic.clenshaw import GROUP, legendre_sum, sum_group
from gqm_sym.runtime.arithmetic.doubledouble import two_product, two_sum
from gqm_sym.runtime.arithmetic.elementary import turn_cosine, turn_sine
from gqm_sym.runtime.compiled.intrinsics import fma, nearest_whole
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.types import VECTOR
from gqm_sym.runtime.inversion.table import anomaly_on
from gqm_sym.runtime.quadrature.time_panels import derivative

# Nodes of the first fit and of the last one tried: beyond it the fit takes longer than the table.
FEWEST, MOST = 16, 256

# A fit is resolved when the last quarter of its coefficients is below this share of the swing: rounding of the nodes.
RESOLVED = 4e-16

# Trailing coefficients below this, half a unit in the last place of the swing, are dropped.
NOTHING = 1.2e-16

# Coefficients fall as a power: with as many times the nodes the tail is that power of itself. Above this no number of
# nodes up to the most will do.
HOPE = 1e-12

# Times summed together.
BLOCK = 128
_SERIES = types.Tuple((VECTOR, VECTOR))


@Inner
def equal_phase_angles(edges, times, times_low, terms, n, known, out, rests):  # type: ignore[no-untyped-def]
    """Anomalies at n + 1 equal steps of time, n a power of two; ``times + times_low`` is the clock at the edges.

    ``out`` has room for `MOST` steps; with ``known`` it holds every other of these n already. ``rests`` is what they
    leave over as doubles.
    """
    slopes, gap = np.empty(terms.shape[1]), MOST // n
    whole, panel, x, pace = times[-1], -1, -1.0, 1.0
    out[0], out[MOST] = edges[0], edges[-1]
    for i in range(1, n, 2 if known else 1):
        t, low = two_product(whole, i / n)
        low += times_low[-1] * i / n
        while panel < 0 or (panel < edges.size - 2 and t >= times[panel + 1]):
            panel += 1
            derivative(terms[panel], slopes)
            duration = (times[panel + 1] - times[panel]) + (times_low[panel + 1] - times_low[panel])
            x, pace = -1.0, legendre_sum(terms[panel], 1.0) / duration
        half = 0.5 * (edges[panel + 1] - edges[panel])
        x = anomaly_on(terms[panel], slopes, ((t - times[panel]) + (low - times_low[panel])) * pace, x)
        out[i * gap], rests[i * gap] = two_sum(edges[panel], half * (1.0 + x))


@Inner
def cosine_at(phi, rests, i):  # type: ignore[no-untyped-def]
    """The cosine of an anomaly and what it leaves over: between nodes the errors at them grow."""
    return cos(phi[i]) - sin(phi[i]) * rests[i]


@Inner
def turned(values, table, k, begin):  # type: ignore[no-untyped-def]
    """The sum of values times every k-th entry of a table that closes upon itself, from an entry on.

    What rounding takes from the sum is summed apart: of a hundred terms it would be several last places.
    """
    total, lost, entry = 0.0, 0.0, begin
    for i in range(values.size):
        total, rest = two_sum(total, values[i] * table[entry])
        lost += rest
        entry += k
        if entry >= table.size:
            entry -= table.size
    return total + lost


@entry(_SERIES(VECTOR, VECTOR, VECTOR, types.float64[:, ::1], types.boolean))
def fit_wave(edges, times, times_low, terms, there_and_back):  # type: ignore[no-untyped-def]
    """Coefficients of cosines and of sines of the phase; empty where more than `MOST` nodes would be needed.

    For a libration (``there_and_back``) the series is that of cos(phi) over half a period, phi the anomaly. For a
    circulation it is that of the share of the lap that the body is ahead of a steady pace.
    """
    n, phi, rests = FEWEST, np.empty(MOST + 1), np.zeros(MOST + 1)
    while n <= MOST:
        equal_phase_angles(edges, times, times_low, terms, n, n > FEWEST, phi, rests)
        gap, half = MOST // n, n // 2
        steps = 2 * n if there_and_back else n  # in a whole period
        table = np.empty(steps)
        for i in range(steps):  # from angles within a quarter turn, which rounding moves least
            table[i] = sin(pi * (0.5 * steps - 2.0 * min(i, steps - i)) / steps)
        if there_and_back:
            cosines, sines = np.empty(n), np.empty(0)
            # Of a wave and its mirror image: what is even about the middle has even terms alone, and odd ones the rest.
            even, odd = np.empty(half + 1), np.empty(half)
            for i in range(half):
                one, other = cosine_at(phi, rests, i * gap), cosine_at(phi, rests, (n - i) * gap)
                even[i], odd[i] = one + other, one - other
            even[half] = cosine_at(phi, rests, half * gap)
            even[0], odd[0] = 0.0, 1.0  # the ends count half
            for k in range(n):
                cosines[k] = 2.0 * (turned(even, table, k, 0) if k % 2 == 0 else turned(odd, table, k, 0)) / n
        else:
            cosines, sines = np.empty(half), np.empty(half)
            values = np.empty(n)
            for i in range(n):
                values[i] = ((phi[i * gap] - edges[0]) + rests[i * gap]) / (edges[-1] - edges[0]) - i / n
            for k in range(half):
                cosines[k] = 2.0 * turned(values, table, k, 0) / n
                sines[k] = 2.0 * turned(values, table, k, 3 * n // 4) / n
        cosines[0] *= 0.5
        size = cosines.size
        levels = np.abs(cosines)
        if sines.size:
            levels = np.maximum(levels, np.abs(sines))
        tail = levels[size - size // 4 :].max()
        if tail <= RESOLVED:
            last = size
            while last > 1 and levels[last - 1] <= NOTHING:
                last -= 1
            return cosines[:last].copy(), sines[:last].copy()
        if not tail ** (MOST // n) <= HOPE:
            break
        n *= 2
    return np.empty(0), np.empty(0)


@Inner
def sum_cosines(c, x, n, out, work):  # type: ignore[no-untyped-def]
    """The sums of c_k cos(k phi) at n places x = cos(phi); the arrays have room for whole groups.

    The first two terms, the largest, are added last, where they are rounded least.
    """
    for j in range(0, n, GROUP):
        sum_group(c, x, j, out, work)
    first, second = c[0], c[1] if c.size > 1 else 0.0
    for j in range(n):
        out[j] = first + fma(second, x[j], fma(fma(2.0 * x[j], x[j], -1.0), out[j], -x[j] * work[j]))


@Inner
def sum_sines(c, x, n, out, work):  # type: ignore[no-untyped-def]
    """The sums of c_k sin(k phi)/sin(phi), as `sum_cosines`."""
    for j in range(0, n, GROUP):
        sum_group(c, x, j, out, work)
    second = c[1] if c.size > 1 else 0.0
    for j in range(n):
        out[j] = second + fma(2.0 * x[j], out[j], -work[j])


@Inner
def sum_wave(dial, cosines, sines, t, out, begin, end):  # type: ignore[no-untyped-def]
    """Fill ``out`` with the curve's parameter at times ``t``, from the index ``begin`` to ``end``.

    ``dial`` holds the period as two doubles, its inverse as two doubles, the phase at launch as two doubles, both
    ends, the launch place and the lap (0 for a libration).
    """
    period, period_low, inverse, inverse_low = dial[0], dial[1], dial[2], dial[3]
    phase, phase_low, a, b, launch, lap = dial[4], dial[5], dial[6], dial[7], dial[8], dial[9]
    half = 0.5 * (b - a)
    room = np.empty((7, BLOCK))
    w, f, f_low, x, c, work, laps = room[0], room[1], room[2], room[3], room[4], room[5], room[6]
    x[:] = 0.0  # whole groups are summed
    for start in range(begin, end, BLOCK):
        n = min(BLOCK, end - start)
        given, found = t[start : start + n], out[start : start + n]
        for j in range(n):
            w[j] = given[j]
        for j in range(n):
            s = w[j] + phase
            back = s - w[j]
            e = (w[j] - (s - back)) + (phase - back)
            count = nearest_whole(s * inverse)
            rest = fma(-count, period, s)  # exact: a whole number of last places, and less than a period
            e = fma(-count, period_low, e + phase_low)
            share = rest * inverse
            share_low = fma(rest, inverse, -share) + fma(rest, inverse_low, e * inverse)
            laps[j], f[j] = count, share + share_low
            f_low[j] = share_low - (f[j] - share)
        for j in range(n):
            x[j] = turn_cosine(f[j], f_low[j])
        sum_cosines(cosines, x, n, c, work)
        if lap == 0.0:
            for j in range(n):
                place = a + half * (1.0 - c[j]) if c[j] >= 0.0 else b - half * (1.0 + c[j])
                w[j] = launch if w[j] == 0.0 else place
        else:
            for j in range(n):
                f_low[j] += c[j]
            sum_sines(sines, x, n, c, work)
            for j in range(n):
                near = fabs(f[j])
                sine = turn_sine(near if near <= 0.25 else 0.5 - near, 0.0)
                ahead = f_low[j] + (sine if f[j] >= 0.0 else -sine) * c[j]
                place = laps[j] * lap + (launch + lap * (f[j] + ahead))
                w[j] = launch if w[j] == 0.0 else place
        for j in range(n):
            found[j] = w[j]
