"""The place of a body on a periodic motion as a Fourier series of the phase.

On a libration the place is an even function of the phase from the lower turning point. On a circulation the difference
between the place and that of a uniform motion is periodic. Both are analytic where the curve is smooth, and some tens
of terms represent them to rounding. The series is summed for many times at once by Clenshaw's recurrence in vector
registers (`clenshaw.sum_group`). Motions that would need more terms, such as those next to a separatrix, have no series
and use the table (`records`), which takes as long as some 60 terms.
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
from gqm_sym.runtime.inversion.table import place_on_panel
from gqm_sym.runtime.quadrature.time_panels import derivative

# The number of nodes of the first fit, and of the last one that is tried; the terms of a larger fit would take longer
# than the table.
MIN_NODES, MAX_NODES = 16, 64

# A fit is resolved when the last quarter of its coefficients is below this share of half the swing or of the lap, which
# is the rounding of the nodes.
MAX_TAIL = 4e-16

# Trailing coefficients below this, half a unit in the last place, are dropped.
MAX_DROPPED = 1.2e-16

# The coefficients decrease geometrically: with m times as many nodes the tail becomes its m-th power. If that is above
# this limit for MAX_NODES, no larger fit is tried.
MAX_PREDICTED_TAIL = 1e-12

# The number of times for which the series is summed together.
BLOCK = 128
_SERIES = types.Tuple((VECTOR, VECTOR))


@Inner
def equal_phase_angles(edges, times, times_low, terms, n, known, out, lows):  # type: ignore[no-untyped-def]
    """Fill ``out`` with the phase angles at n equal steps of time.

    Parameters
    ----------
    edges, times, times_low, terms
        The panels, as `table.tabulate` takes them.
    n : int
        Number of steps, a power of two.
    known : bool
        Whether every second of these phase angles is in ``out`` already.
    out, lows : (MAX_NODES + 1,) arrays
        Filled with the phase angles as two doubles each; a step of time is MAX_NODES/n elements.
    """
    slopes, gap = np.empty(terms.shape[1]), MAX_NODES // n
    total, panel, x, scale = times[-1], -1, -1.0, 1.0
    out[0], out[MAX_NODES] = edges[0], edges[-1]
    for i in range(1, n, 2 if known else 1):
        t, low = two_product(total, i / n)
        low += times_low[-1] * i / n
        while panel < 0 or (panel < edges.size - 2 and t >= times[panel + 1]):
            panel += 1
            derivative(terms[panel], slopes)
            duration = (times[panel + 1] - times[panel]) + (times_low[panel + 1] - times_low[panel])
            x, scale = -1.0, legendre_sum(terms[panel], 1.0) / duration
        half = 0.5 * (edges[panel + 1] - edges[panel])
        x = place_on_panel(terms[panel], slopes, ((t - times[panel]) + (low - times_low[panel])) * scale, x)
        out[i * gap], lows[i * gap] = two_sum(edges[panel], half * (1.0 + x))


@Inner
def cosine_at(phi, lows, i):  # type: ignore[no-untyped-def]
    """Return the cosine of a phase angle of two doubles. If the angle were rounded to one double, the error would be
    amplified between the nodes.
    """
    return cos(phi[i]) - sin(phi[i]) * lows[i]


@Inner
def circular_sum(values, table, k, begin):  # type: ignore[no-untyped-def]
    """Return the sum of values times every k-th entry of a cyclic table, beginning with the entry ``begin``.

    The rounding errors of the sum are added up and corrected for; over a hundred terms they would be several ulp.
    """
    total, lost, entry = 0.0, 0.0, begin
    for i in range(values.size):
        total, error = two_sum(total, values[i] * table[entry])
        lost += error
        entry += k
        if entry >= table.size:
            entry -= table.size
    return total + lost


@entry(_SERIES(VECTOR, VECTOR, VECTOR, types.float64[:, ::1], types.boolean), checked=False)
def fit_wave(edges, times, times_low, terms, is_libration):  # type: ignore[no-untyped-def]
    """Fit a Fourier series.

    Parameters
    ----------
    edges, times, times_low, terms
        The panels, as `table.tabulate` takes them.
    is_libration : bool
        Whether the motion is a libration. The series is then that of cos(phi) over half a period; otherwise it is that
        of the difference from a uniform motion, as a share of the lap.

    Returns
    -------
    cosines, sines : arrays
        Coefficients of cosines and of sines of the phase; empty if more than MAX_NODES nodes would be needed.
    """
    n, phi, lows = MIN_NODES, np.empty(MAX_NODES + 1), np.zeros(MAX_NODES + 1)
    while n <= MAX_NODES:
        equal_phase_angles(edges, times, times_low, terms, n, n > MIN_NODES, phi, lows)
        gap, half = MAX_NODES // n, n // 2
        steps = 2 * n if is_libration else n  # in one period
        table = np.empty(steps)
        for i in range(steps):  # the angles are within a quarter turn, where their rounding is smallest
            table[i] = sin(pi * (0.5 * steps - 2.0 * min(i, steps - i)) / steps)
        if is_libration:
            cosines, sines = np.empty(n), np.empty(0)
            # The part that is even about the middle has only even coefficients, and the odd part only odd ones.
            even, odd = np.empty(half + 1), np.empty(half)
            for i in range(half):
                one, other = cosine_at(phi, lows, i * gap), cosine_at(phi, lows, (n - i) * gap)
                even[i], odd[i] = one + other, one - other
            even[half] = cosine_at(phi, lows, half * gap)
            even[0], odd[0] = 0.0, 1.0  # the ends count half
            for k in range(n):
                cosines[k] = (
                    2.0 * (circular_sum(even, table, k, 0) if k % 2 == 0 else circular_sum(odd, table, k, 0)) / n
                )
        else:
            cosines, sines = np.empty(half), np.empty(half)
            values = np.empty(n)
            for i in range(n):
                values[i] = ((phi[i * gap] - edges[0]) + lows[i * gap]) / (edges[-1] - edges[0]) - i / n
            for k in range(half):
                cosines[k] = 2.0 * circular_sum(values, table, k, 0) / n
                sines[k] = 2.0 * circular_sum(values, table, k, 3 * n // 4) / n
        cosines[0] *= 0.5
        size = cosines.size
        levels = np.abs(cosines)
        if sines.size:
            levels = np.maximum(levels, np.abs(sines))
        tail = levels[size - size // 4 :].max()
        if tail <= MAX_TAIL:
            last = size
            while last > 1 and levels[last - 1] <= MAX_DROPPED:
                last -= 1
            return cosines[:last].copy(), sines[:last].copy()
        if not tail ** (MAX_NODES // n) <= MAX_PREDICTED_TAIL:
            break
        n *= 2
    return np.empty(0), np.empty(0)


@Inner
def sum_cosines(c, x, n, out, work):  # type: ignore[no-untyped-def]
    """Fill ``out`` with the sums of c_k cos(k phi) at n places x = cos(phi).

    The arrays have room for a multiple of GROUP numbers. The first two terms, which are the largest, are added last, so
    that the sum has the smallest rounding error.
    """
    for j in range(0, n, GROUP):
        sum_group(c, x, j, out, work)
    first, second = c[0], c[1] if c.size > 1 else 0.0
    for j in range(n):
        out[j] = first + fma(second, x[j], fma(fma(2.0 * x[j], x[j], -1.0), out[j], -x[j] * work[j]))


@Inner
def sum_sines(c, x, n, out, work):  # type: ignore[no-untyped-def]
    """Fill ``out`` with the sums of c_k sin(k phi)/sin(phi), as `sum_cosines` does."""
    for j in range(0, n, GROUP):
        sum_group(c, x, j, out, work)
    second = c[1] if c.size > 1 else 0.0
    for j in range(n):
        out[j] = second + fma(2.0 * x[j], out[j], -work[j])


@Inner
def sum_wave(wave, cosines, sines, t, out, begin, end):  # type: ignore[no-untyped-def]
    """Fill ``out`` with the curve parameter at times ``t``, from the index ``begin`` to ``end``.

    Parameters
    ----------
    wave : (10,) array
        The period, one over it, and the time from the end ``a`` to the launch, as two doubles each; both ends; the
        launch place; and the lap (0 for a libration).
    cosines, sines : arrays
        The coefficients of `fit_wave`.
    t, out : arrays
        Times from launch in s, and the places.
    """
    period, period_low, inverse, inverse_low = wave[0], wave[1], wave[2], wave[3]
    phase, phase_low, a, b, launch, lap = wave[4], wave[5], wave[6], wave[7], wave[8], wave[9]
    half = 0.5 * (b - a)
    buffer = np.empty((7, BLOCK))
    w, f, f_low, x, c, work, laps = buffer[0], buffer[1], buffer[2], buffer[3], buffer[4], buffer[5], buffer[6]
    x[:] = 0.0  # the sums run over whole groups
    for start in range(begin, end, BLOCK):
        n = min(BLOCK, end - start)
        times, places = t[start : start + n], out[start : start + n]
        for j in range(n):
            w[j] = times[j]
        for j in range(n):
            s = w[j] + phase
            back = s - w[j]
            e = (w[j] - (s - back)) + (phase - back)
            count = nearest_whole(s * inverse)
            remainder = fma(-count, period, s)  # exact: a multiple of the last place, and less than a period
            e = fma(-count, period_low, e + phase_low)
            share = remainder * inverse
            share_low = fma(remainder, inverse, -share) + fma(remainder, inverse_low, e * inverse)
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
            places[j] = w[j]
