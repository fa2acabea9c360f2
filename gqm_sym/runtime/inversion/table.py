"""Pass 3: the anomaly as a function of time, tabulated as polynomials on segments of time.

Each panel's time is analytic and grows with the anomaly, so its inverse is analytic too. It is cut into equal
segments, as few as a
Chebyshev fit of fixed degree needs to be resolved to rounding. A small uniform index over time finds the segment at
once.
"""

from math import fabs

import numpy as np
from numba import types

from gqm_sym.runtime.arithmetic.clenshaw import legendre_sum
from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.compiled.buffers import longer, taller
from gqm_sym.runtime.compiled.intrinsics import fma
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.types import MATRIX, VECTOR
from gqm_sym.runtime.quadrature.time_panels import NOTHING, derivative

TERMS = 15
LAST = TERMS - 1

# cos(j theta_i) at the nodes of the fit, both ends of a segment among them; there the fit adds no error of its own.
# They come from angles within a quarter turn: the rounding of larger ones would be the table's largest error.
_HALF_TURNS = np.abs((np.outer(np.arange(TERMS), np.arange(TERMS)) + LAST) % (2 * LAST) - LAST)
COSINES = np.sin(np.pi * (0.5 * LAST - _HALF_TURNS) / LAST)
RESOLVED = 2e-16  # last two Chebyshev coefficients against the whole range of the anomaly
MOST_CUTS = 2**52  # at a cusp the anomaly goes like the root of the time that is left: ever shorter segments
MOST_AT_FIRST = 8
LEVEL = 1e-13  # coefficients that have stopped falling below this share are rounding noise

# From so many cuts of a panel on, an anomaly that is off by no more than this share of the whole time is good enough:
# at a cusp the rounding of the time moves it further than a table can tell.
DEEP = 2**12
TIMED = 4e-16
NEWTON = 1e-10

# Times looked up together.
BLOCK = 64


@Inner
def anomaly_on(terms, rates_sum, target, guess):  # type: ignore[no-untyped-def]
    """The place x in [-1, 1] of a panel where its time is ``target``, by Newton's method inside a bracket."""
    lo, hi, x = -1.0, 1.0, guess
    for _ in range(60):
        miss = legendre_sum(terms, x) - target
        if miss > 0.0:
            hi = x
        else:
            lo = x
        slope = legendre_sum(rates_sum, x)
        new = x - miss / slope if slope > 0.0 else 0.5 * (lo + hi)
        if not (lo <= new <= hi):
            new = 0.5 * (lo + hi)
        # Steps shrink as their squares: after one this short the next would be below rounding.
        if fabs(new - x) <= NEWTON or hi - lo <= 1.2e-16:
            return new
        x = new
    return x


@Inner
def tabulate(edges, times, times_low, time_terms):  # type: ignore[no-untyped-def]
    """Polynomials for the anomaly over time.

    ``times + times_low`` is the clock at the panels' edges: short panels that come late, where the body rushes, keep
    their own digits. Each panel's own time runs at the pace that meets the clock at both edges.

    Returns
    -------
    middles, lows, scales : (n,) arrays
        Middle of each segment in time, as two doubles, and one over half its length.
    powers : (n, TERMS) array
        Coefficients of the anomaly in powers of ``(t - middle) * scale``.
    index : (k,) array of int
        First segment that can hold a time in each of k equal parts of the whole time.
    ends : (n,) array
        Where each segment ends in time.
    errors : (n,) array
        Unresolved part of the anomaly on each segment, beyond what ``TIMED`` allows.
    """
    room = 32
    middles, lows, scales, ends = np.empty(room), np.empty(room), np.empty(room), np.empty(room)
    errors = np.empty(room)
    powers = np.empty((room, TERMS))
    values, c = np.empty(TERMS), np.empty(TERMS)
    slope_terms = np.empty(time_terms.shape[1])
    scale = max(fabs(edges[0]), fabs(edges[-1]))
    count, cuts = 0, 1
    for k in range(edges.size - 1):
        left, half = edges[k], 0.5 * (edges[k + 1] - edges[k])
        duration = (times[k + 1] - times[k]) + (times_low[k + 1] - times_low[k])
        if k > 0 and duration <= NOTHING * times[k]:
            continue
        pace = legendre_sum(time_terms[k], 1.0) / duration
        derivative(time_terms[k], slope_terms)
        # ``done`` of ``cuts`` equal segments of the panel's time are laid; the panel before tells how many to try.
        done, cuts = 0, min(cuts, MOST_AT_FIRST)
        while done < cuts:
            # From the panel's left edge.
            start, stop = duration * done / cuts, duration * (done + 1) / cuts
            middle, reach = 0.5 * (start + stop), 0.5 * (stop - start)
            guess, steepest = 2.0 * (done + 0.5) / cuts - 1.0, 0.0
            for i in range(TERMS):
                if i == 0 and done + 1 == cuts:
                    guess = 1.0
                elif i == LAST and done == 0:
                    guess = -1.0
                else:
                    target = (middle + reach * COSINES[1, i]) * pace
                    guess = anomaly_on(time_terms[k], slope_terms, target, guess)
                values[i] = guess
                slope = legendre_sum(slope_terms, guess)
                steepest = max(steepest, slope)
                if i < LAST and slope > 0.0:
                    ahead = guess + pace * reach * (COSINES[1, i + 1] - COSINES[1, i]) / slope
                    guess = min(max(ahead, -1.0), 1.0)
            for j in range(TERMS):
                total = 0.5 * (values[0] * COSINES[j, 0] + values[LAST] * COSINES[j, LAST])
                for i in range(1, LAST):
                    total += values[i] * COSINES[j, i]
                c[j] = 2.0 * total / LAST
            c[0] *= 0.5
            c[LAST] *= 0.5
            tail = half * max(fabs(c[LAST]), fabs(c[LAST - 1]))
            before = half * max(fabs(c[LAST - 4]), fabs(c[LAST - 5]))
            settled = tail <= RESOLVED * scale or (before <= LEVEL * scale and tail > 0.2 * before)
            timed = not settled and cuts >= DEEP and tail / half * steepest <= TIMED * times[-1]
            if not settled and not timed and cuts < MOST_CUTS:
                done, cuts = 2 * done, 2 * cuts
                continue
            if count == room:
                room *= 2
                middles, lows, errors, scales, ends = (
                    longer(middles, room),
                    longer(lows, room),
                    longer(errors, room),
                    longer(scales, room),
                    longer(ends, room),
                )
                powers = taller(powers, room)
            middles[count], low = two_sum(times[k], middle)
            lows[count], scales[count], ends[count] = low + times_low[k], 1.0 / reach, times[k] + stop
            errors[count] = 0.0 if timed else tail
            _to_powers(c, powers[count])
            for j in range(TERMS):
                powers[count, j] *= half
            powers[count, 0] += left + half
            count += 1
            done += 1
            while done % 2 == 0 and cuts > 1 and done < cuts:  # widen again where the panel allows it
                done, cuts = done // 2, cuts // 2
    whole = times[-1]
    ends[count - 1] = whole
    index = np.empty(4 * count, dtype=np.int64)
    segment = 0
    for i in range(index.size):
        while segment < count - 1 and ends[segment] <= whole * i / index.size:
            segment += 1
        index[i] = segment
    return (
        middles[:count].copy(),
        lows[:count].copy(),
        scales[:count].copy(),
        powers[:count].copy(),
        index,
        ends[:count].copy(),
        errors[:count].copy(),
    )


@Inner
def _to_powers(c, out):  # type: ignore[no-untyped-def]
    """Powers of x from Chebyshev coefficients (which fall fast enough for this to keep every digit)."""
    n = c.size
    one, two = np.zeros(n), np.zeros(n)
    out[:] = 0.0
    one[0] = 1.0
    out[0] = c[0]
    two[1] = 1.0
    out[1] = c[1]
    for j in range(2, n):
        # one, two <- T_(j-1), T_j
        previous = one.copy()
        one[:] = two
        two[0] = -previous[0]
        for i in range(1, n):
            two[i] = 2.0 * one[i - 1] - previous[i]
        for i in range(n):
            out[i] += c[j] * two[i]


@Inner
def look_up(middles, lows, scales, powers, index, ends, t, t_low, n, segments, x, out):  # type: ignore[no-untyped-def]
    """The anomalies at n times t + t_low of a table, side by side, and on which segments they are.

    ``x`` is room for n numbers.
    """
    slots = index.size / ends[-1] if ends[-1] > 0.0 else 0.0
    for i in range(n):
        segment = index[min(max(np.int64(t[i] * slots), 0), index.size - 1)]
        while segment < ends.size - 1 and t[i] >= ends[segment]:
            segment += 1
        segments[i] = segment
    for i in range(n):
        k = segments[i]
        x[i] = ((t[i] - middles[k]) + (t_low[i] - lows[k])) * scales[k]
        out[i] = powers[k, LAST]
    for j in range(LAST - 1, -1, -1):
        for i in range(n):
            out[i] = fma(out[i], x[i], powers[segments[i], j])


@Inner
def look_up_many(middles, lows, scales, powers, index, ends, t, t_low, out):  # type: ignore[no-untyped-def]
    """The anomaly at many times of one table."""
    segments, x = np.empty(BLOCK, dtype=np.int64), np.empty(BLOCK)
    for start in range(0, t.size, BLOCK):
        n = min(BLOCK, t.size - start)
        place = slice(start, start + n)
        look_up(middles, lows, scales, powers, index, ends, t[place], t_low[place], n, segments, x, out[place])


TABLE_TYPE = types.Tuple((VECTOR, VECTOR, VECTOR, MATRIX, types.int64[::1], VECTOR, VECTOR))


@entry(TABLE_TYPE(VECTOR, VECTOR, VECTOR, MATRIX))
def build_table(edges, times, times_low, time_terms):  # type: ignore[no-untyped-def]
    """`inversion.tabulate`, for Python."""
    return tabulate(edges, times, times_low, time_terms)


@entry(VECTOR(VECTOR, VECTOR, VECTOR, MATRIX, types.int64[::1], VECTOR, VECTOR, VECTOR))
def anomalies(middles, lows, scales, powers, index, ends, t, t_low):  # type: ignore[no-untyped-def]
    """`inversion.look_up_many`, for Python."""
    out = np.empty(t.size)
    look_up_many(middles, lows, scales, powers, index, ends, t, t_low, out)
    return out
