"""Where the body of a periodic motion is, as a trigonometric polynomial of the phase.

The place on a libration is an even function of the phase from the lower turning point, and what the place on a
circulation has ahead of a steady pace is periodic. Both are analytic where the curve is smooth: a few tens of terms
hold them to rounding, and a sum over many times at once by Clenshaw's recurrence fills vector registers. Motions whose
series is longer have none, and take the table (`orbits`).
"""

from math import cos, fabs, pi, sin

import numpy as np
from numba import types

from gqm_sym.runtime.doubledouble import two_product
from gqm_sym.runtime.fused import fma, nearest_whole, turn_cosine, turn_sine
from gqm_sym.runtime.inversion import anomaly_on, derivative
from gqm_sym.runtime.jit import Inner, entry
from gqm_sym.runtime.panels import legendre_sum

# Nodes of the first fit and of the last one tried: beyond it the table is as fast.
FEWEST, MOST = 16, 128
# A fit is resolved when the last quarter of its coefficients is below this share of the swing: rounding of the nodes.
RESOLVED = 4e-16
# Trailing coefficients below this, half a unit in the last place of the swing, are dropped.
NOTHING = 1.2e-16
# Times summed together.
BLOCK = 128

# What a wave is made of: a libration's ends or a circulation's start and lap, its clock, and its two series.
_LINE = types.float64[::1]
_SERIES = types.Tuple((_LINE, _LINE))


@Inner
def anomalies_in_step(edges, times, times_low, terms, n, out):  # type: ignore[no-untyped-def]
    """Anomalies at n + 1 equal steps of time, n a power of two; ``times + times_low`` is the clock at the edges."""
    slopes = np.empty(terms.shape[1])
    whole, panel, x, pace = times[-1], -1, -1.0, 1.0
    out[0], out[n] = edges[0], edges[-1]
    for i in range(1, n):
        t, low = two_product(whole, i / n)
        low += times_low[-1] * i / n
        while panel < 0 or (panel < edges.size - 2 and t >= times[panel + 1]):
            panel += 1
            derivative(terms[panel], slopes)
            duration = (times[panel + 1] - times[panel]) + (times_low[panel + 1] - times_low[panel])
            x, pace = -1.0, legendre_sum(terms[panel], 1.0) / duration
        half = 0.5 * (edges[panel + 1] - edges[panel])
        x = anomaly_on(terms[panel], slopes, ((t - times[panel]) + (low - times_low[panel])) * pace, x)
        out[i] = edges[panel] + half * (1.0 + x)


@entry(_SERIES(_LINE, _LINE, _LINE, types.float64[:, ::1], types.boolean))
def fit_wave(edges, times, times_low, terms, there_and_back):  # type: ignore[no-untyped-def]
    """Coefficients of cosines and of sines of the phase; empty where more than `MOST` nodes were needed.

    For a libration (``there_and_back``) the series is that of cos(phi) over half a period, phi the anomaly. For a
    circulation it is that of the share of the lap that the body is ahead of a steady pace.
    """
    n = FEWEST
    while n <= MOST:
        phi, values = np.empty(n + 1), np.empty(n + 1)
        anomalies_in_step(edges, times, times_low, terms, n, phi)
        steps = 2 * n if there_and_back else n  # in a whole period
        table = np.empty(steps)
        for i in range(steps):  # from angles within a quarter turn, which rounding moves least
            table[i] = sin(pi * (0.5 * steps - 2.0 * min(i, steps - i)) / steps)
        if there_and_back:
            cosines, sines = np.empty(n), np.empty(0)
            for i in range(n + 1):
                values[i] = cos(phi[i])
            values[0], values[n] = 0.5, -0.5  # the ends count half
            for k in range(n):
                total = 0.0
                for i in range(n + 1):
                    total += values[i] * table[i * k % steps]
                cosines[k] = 2.0 * total / n
        else:
            cosines, sines = np.empty(n // 2), np.empty(n // 2)
            for i in range(n):
                values[i] = (phi[i] - edges[0]) / (edges[-1] - edges[0]) - i / n
            for k in range(n // 2):
                even, odd = 0.0, 0.0
                for i in range(n):
                    even += values[i] * table[i * k % steps]
                    odd += values[i] * table[(i * k + 3 * n // 4) % steps]
                cosines[k], sines[k] = 2.0 * even / n, 2.0 * odd / n
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
        n *= 2
    return np.empty(0), np.empty(0)


@Inner
def sum_up(c, x, n, high, low):  # type: ignore[no-untyped-def]
    """Clenshaw's sums b_0 (in ``high``) and b_1 (in ``low``) of the coefficients c at each of n places x."""
    for j in range(n):
        high[j], low[j] = 0.0, 0.0
    k = c.size - 1
    if k % 2 == 0:
        for j in range(n):
            high[j] = c[k]
        k -= 1
    while k > 0:
        first, second = c[k], c[k - 1]
        for j in range(n):
            twice = 2.0 * x[j]
            before = high[j]
            new = fma(twice, before, first - low[j])
            low[j] = new
            high[j] = fma(twice, new, second - before)
        k -= 2


@Inner
def sum_wave(dial, cosines, sines, t, out, begin, end):  # type: ignore[no-untyped-def]
    """Fill ``out`` with the curve's parameter at times ``t``, from the index ``begin`` to ``end``.

    ``dial`` holds the period as two doubles, its inverse as two doubles, the phase at launch as two doubles, both
    ends, the launch place and the lap (0 for a libration).
    """
    period, period_low, inverse, inverse_low = dial[0], dial[1], dial[2], dial[3]
    phase, phase_low, a, b, launch, lap = dial[4], dial[5], dial[6], dial[7], dial[8], dial[9]
    half = 0.5 * (b - a)
    w, f, f_low = np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK)
    x, high, low, laps = np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK)
    for start in range(begin, end, BLOCK):
        n = min(BLOCK, end - start)
        for j in range(n):
            w[j] = t[start + j]
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
        sum_up(cosines, x, n, high, low)
        if lap == 0.0:
            for j in range(n):
                c = fma(-x[j], low[j], high[j])
                place = a + half * (1.0 - c) if c >= 0.0 else b - half * (1.0 + c)
                w[j] = launch if w[j] == 0.0 else place
        else:
            for j in range(n):
                f_low[j] += fma(-x[j], low[j], high[j])
            sum_up(sines, x, n, high, low)
            for j in range(n):
                near = fabs(f[j])
                sine = turn_sine(near if near <= 0.25 else 0.5 - near, 0.0)
                ahead = f_low[j] + (sine if f[j] >= 0.0 else -sine) * low[j]
                place = laps[j] * lap + (launch + lap * (f[j] + ahead))
                w[j] = launch if w[j] == 0.0 else place
        for j in range(n):
            out[start + j] = w[j]
