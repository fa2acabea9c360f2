"""Pass 3: the phase angle as a function of time, tabulated as polynomials on segments of time.

On each panel, time is an analytic and increasing function of the phase angle, so its inverse is analytic too. The
panel's time is divided into equal segments, as few as a Chebyshev fit of fixed degree needs to be resolved to rounding.
A small uniform index over time finds the segment of a time at once.
"""

from math import fabs, pi
from typing import Any, NamedTuple

import numpy as np
from numba import types

from gqm_sym.runtime.arithmetic.clenshaw import legendre_sum
from gqm_sym.runtime.arithmetic.doubledouble import ULP, two_sum
from gqm_sym.runtime.compiled.buffers import longer, with_rows
from gqm_sym.runtime.compiled.intrinsics import fma, item_at
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.types import MATRIX, VECTOR, Array
from gqm_sym.runtime.quadrature.time_panels import NEGLIGIBLE_SHARE, derivative

# The number of coefficients of a segment's polynomial, and the index of the last one.
TERMS = 15
LAST = TERMS - 1

# COSINES[j, i] = cos(j*theta_i) at the nodes of the fit. Both ends of a segment are nodes, where the fit adds no error.
# The angles are reduced to a quarter turn first, because the rounding of larger ones would be the largest error of the
# table.
_HALF_TURNS = np.abs((np.outer(np.arange(TERMS), np.arange(TERMS)) + LAST) % (2 * LAST) - LAST)
COSINES = np.sin(np.pi * (0.5 * LAST - _HALF_TURNS) / LAST)


def _chebyshev(shift: float, rate: float) -> Array:
    """Return the coefficients of the Chebyshev polynomials of shift + rate*x in powers of x: those of degree j in row
    j.
    """
    rows = np.zeros((TERMS, TERMS))
    rows[0, 0], rows[1, :2] = 1.0, (shift, rate)
    for j in range(2, TERMS):
        rows[j] = 2.0 * (shift * rows[j - 1] + rate * np.append(0.0, rows[j - 1, :-1])) - rows[j - 2]
    return rows


# In powers of the distance from the middle of a segment, in units of half its length, and of that from its beginning,
# in units of its length, which are used for this share of the first one.
BEGINNING = 1.0 / 32.0
FROM_MIDDLE, FROM_BEGINNING = _chebyshev(0.0, 1.0), _chebyshev(-1.0, 2.0)

# A fit is resolved when its last two coefficients are below this share of the largest phase angle.
MAX_TAIL_RATIO = 2e-16

# Coefficients that stop decreasing below this share are rounding noise.
MAX_NOISE_RATIO = 1e-13

# The largest number of segments of a panel, and of those that are tried first. Near a cusp the phase angle varies like
# the square root of the remaining time, so segments become ever shorter.
MAX_CUTS = 2**52
MAX_FIRST_CUTS = 8

# If a panel is divided into at least so many segments, an error of the phase angle is accepted that corresponds to no
# more than this share of the whole time, because the rounding of the time itself has a larger effect near a cusp.
MANY_CUTS = 2**12
MAX_TIME_ERROR = 4e-16

# Newton's method ends with a step this short: the error after it is the square of the step, which is below rounding.
LAST_NEWTON_STEP = 1e-10

# The number of equal parts of the whole time for each segment. The more there are, the more often the first segment of
# a part is the right one for a time, and the better a processor foresees that no other one is tried.
PARTS_PER_SEGMENT = 32

# The phase angle from which on its distance from pi follows from the time that is left. Where the two differ by more
# than the second number, more than a rounding, the last part of the segment takes too little time to be in the table.
BESIDE_END, MAX_ROUNDING = 3.0, 8.0 * ULP

# What the double pi lacks to pi.
PI_LOW = 1.2246467991473532e-16

# The number of times that are looked up together.
BLOCK = 64


class Table(NamedTuple):
    """Polynomials for the phase angle over time, on n segments of time.

    Attributes
    ----------
    middles, lows : (n,) arrays
        The middle of each segment in s, as two doubles. The first one is the beginning of the second one, and has its
        beginning here, so that small phase angles have all their digits.
    scales : (n,) array
        One over half its length, in 1/s; for the first one over the length of the second one.
    powers : (n, TERMS) array
        Coefficients of the phase angle in powers of ``(t - middle) * scale``.
    index : (k,) array of int
        The first segment that can contain a time in each of k equal parts of the whole time.
    ends : (n,) array
        The end of each segment in s.
    """

    middles: Any
    lows: Any
    scales: Any
    powers: Any
    index: Any
    ends: Any


@Inner
def place_on_panel(terms, slope_terms, target, guess):  # type: ignore[no-untyped-def]
    """Return the place x in [-1, 1] of a panel where its time is ``target``, by Newton's method inside a bracket.

    ``terms`` are the Legendre coefficients of the time, and ``slope_terms`` those of its derivative.
    """
    lo, hi, x = -1.0, 1.0, guess
    for _ in range(60):
        residual = legendre_sum(terms, x) - target
        if residual > 0.0:
            hi = x
        else:
            lo = x
        slope = legendre_sum(slope_terms, x)
        new = x - residual / slope if slope > 0.0 else 0.5 * (lo + hi)
        if not (lo <= new <= hi):
            new = 0.5 * (lo + hi)
        if fabs(new - x) <= LAST_NEWTON_STEP or hi - lo <= 1.2e-16:
            return new
        x = new
    return x


@Inner
def _index_of(ends, total):  # type: ignore[no-untyped-def]
    """Return the index over time of segments that end at ``ends``."""
    index = np.empty(PARTS_PER_SEGMENT * ends.size, dtype=np.int64)
    segment = 0
    for i in range(index.size):
        while segment < ends.size - 1 and ends[segment] <= total * i / index.size:
            segment += 1
        index[i] = segment
    return index


@Inner
def tabulate(edges, times, times_low, time_terms):  # type: ignore[no-untyped-def]
    """Fit polynomials to the phase angle over time.

    Parameters
    ----------
    edges : (m+1,) array
        Phase angles at the edges of the panels.
    times, times_low : (m+1,) arrays
        The time at the edges as two doubles, so that short panels keep their own digits after a long time. The time on
        each panel is scaled such that it agrees with these at both edges.
    time_terms : (m, DEGREE) array
        Legendre coefficients of the time on each panel.

    Returns
    -------
    middles, lows, scales, powers, index, ends
        As `Table` has them.
    errors : (n,) array
        The unresolved part of the phase angle on each segment, beyond what MAX_TIME_ERROR permits.
    """
    capacity = 32
    middles, lows, scales = np.empty(capacity), np.empty(capacity), np.empty(capacity)
    ends, errors = np.empty(capacity), np.empty(capacity)
    powers = np.empty((capacity, TERMS))
    values, c, slope_terms = np.empty(TERMS), np.empty(TERMS), np.empty(time_terms.shape[1])
    size = max(fabs(edges[0]), fabs(edges[-1]))
    count, cuts = 0, 1
    for k in range(edges.size - 1):
        left, half = edges[k], 0.5 * (edges[k + 1] - edges[k])
        duration = (times[k + 1] - times[k]) + (times_low[k + 1] - times_low[k])
        if k > 0 and duration <= NEGLIGIBLE_SHARE * times[k]:
            continue
        scale = legendre_sum(time_terms[k], 1.0) / duration
        derivative(time_terms[k], slope_terms)
        # ``done`` of ``cuts`` equal segments are complete; the first number of cuts to try is suggested by the panel
        # before.
        done, cuts = 0, min(cuts, MAX_FIRST_CUTS)
        while done < cuts:
            # Times from the panel's left edge.
            start, stop = duration * done / cuts, duration * (done + 1) / cuts
            middle, reach = 0.5 * (start + stop), 0.5 * (stop - start)
            guess, steepest = 2.0 * (done + 0.5) / cuts - 1.0, 0.0
            for i in range(TERMS):
                if i == 0 and done + 1 == cuts:
                    guess = 1.0
                elif i == LAST and done == 0:
                    guess = -1.0
                else:
                    target = (middle + reach * COSINES[1, i]) * scale
                    guess = place_on_panel(time_terms[k], slope_terms, target, guess)
                values[i] = guess
                slope = legendre_sum(slope_terms, guess)
                steepest = max(steepest, slope)
                if i < LAST and slope > 0.0:
                    next_guess = guess + scale * reach * (COSINES[1, i + 1] - COSINES[1, i]) / slope
                    guess = min(max(next_guess, -1.0), 1.0)
            _fit(values, c)
            tail = half * max(fabs(c[LAST]), fabs(c[LAST - 1]))
            before = half * max(fabs(c[LAST - 4]), fabs(c[LAST - 5]))
            resolved = tail <= MAX_TAIL_RATIO * size or (before <= MAX_NOISE_RATIO * size and tail > 0.2 * before)
            accepted = not resolved and cuts >= MANY_CUTS and tail / half * steepest <= MAX_TIME_ERROR * times[-1]
            if not resolved and not accepted and cuts < MAX_CUTS:
                done, cuts = 2 * done, 2 * cuts
                continue
            if count == capacity:
                capacity *= 2
                middles, lows, scales = longer(middles, capacity), longer(lows, capacity), longer(scales, capacity)
                ends, errors = longer(ends, capacity), longer(errors, capacity)
                powers = with_rows(powers, capacity)
            if count == 0:
                _to_powers(c, FROM_BEGINNING, half, powers[0])
                middles[0], lows[0], scales[0], powers[0, 0] = times[0], times_low[0], 1.0 / stop, edges[0]
                ends[0], errors[0], count = times[0] + BEGINNING * stop, 0.0 if accepted else tail, 1
            _to_powers(c, FROM_MIDDLE, half, powers[count])
            middles[count], low = two_sum(times[k], middle)
            lows[count], scales[count], ends[count] = low + times_low[k], 1.0 / reach, times[k] + stop
            errors[count] = 0.0 if accepted else tail
            powers[count, 0] += left + half
            count += 1
            done += 1
            while done % 2 == 0 and cuts > 1 and done < cuts:  # try segments of twice the length next
                done, cuts = done // 2, cuts // 2
    ends[count - 1] = times[-1]
    return (
        middles[:count].copy(),
        lows[:count].copy(),
        scales[:count].copy(),
        powers[:count].copy(),
        _index_of(ends[:count], times[-1]),
        ends[:count].copy(),
        errors[:count].copy(),
    )


@Inner
def _fit(values, c):  # type: ignore[no-untyped-def]
    """Fill ``c`` with Chebyshev coefficients from the values at the nodes."""
    for j in range(TERMS):
        total = 0.5 * (values[0] * COSINES[j, 0] + values[LAST] * COSINES[j, LAST])
        for i in range(1, LAST):
            total += values[i] * COSINES[j, i]
        c[j] = 2.0 * total / LAST
    c[0] *= 0.5
    c[LAST] *= 0.5


@Inner
def _to_powers(c, rows, size, out):  # type: ignore[no-untyped-def]
    """Fill ``out`` with coefficients of powers from Chebyshev coefficients ``c`` in units of 1/size, by the rows of the
    polynomials in these powers.

    No digits are lost, because the coefficients fall fast.
    """
    for i in range(TERMS):
        out[i] = 0.0
    for j in range(TERMS):
        for i in range(TERMS):
            out[i] += c[j] * rows[j, i]
    for i in range(TERMS):
        out[i] *= size


@Inner
def look_up(table, t, t_low, n, segments, out):  # type: ignore[no-untyped-def]
    """Fill ``out`` with the phase angles at n times.

    Parameters
    ----------
    table : Table
        The table.
    t, t_low : (n,) arrays
        Times in s, as two doubles each.
    segments : (n,) array of int
        Filled with the index of each time's segment.
    """
    middles, lows, scales, powers, index, ends = table
    slots, last = index.size / ends[-1] if ends[-1] > 0.0 else 0.0, ends.size - 1
    for i in range(n):
        k = item_at(index, min(max(np.int64(t[i] * slots), 0), index.size - 1))
        while k < last and t[i] >= item_at(ends, k):
            k += 1
        segments[i] = k
    for i in range(n):  # apart from the search, so that the sums of several times overlap
        k = segments[i]
        x, at = ((t[i] - item_at(middles, k)) + (t_low[i] - item_at(lows, k))) * item_at(scales, k), k * TERMS
        phi = item_at(powers, at + LAST)
        for j in range(LAST - 1, -1, -1):
            phi = fma(phi, x, item_at(powers, at + j))
        out[i] = phi


@Inner
def angle_to_end(scales, powers, left, phi):  # type: ignore[no-untyped-def]
    """Return what a phase angle next to the turning point at the end of a segment lacks to pi.

    Most of it is lost where the angle is rounded. It follows from the time that is left, by the divided difference of
    the polynomial over this time and the end.

    Parameters
    ----------
    scales, powers
        As `Table` has them.
    left : float
        The time in s to the end.
    phi : float
        The rounded phase angle.
    """
    k, rounded = scales.size - 1, (pi - phi) + PI_LOW
    share = left * scales[k]
    if not 0.0 < share <= 2.0:  # the end, or beyond the last segment
        return rounded
    total = quotient = powers[k, LAST]
    for j in range(LAST - 1, 0, -1):
        total += powers[k, j]
        quotient = fma(quotient, 1.0 - share, total)
    exact = share * quotient
    return exact if fabs(exact - rounded) <= MAX_ROUNDING else rounded


TABLE_TYPE = types.Tuple((VECTOR, VECTOR, VECTOR, MATRIX, types.int64[::1], VECTOR, VECTOR))


@entry(TABLE_TYPE(VECTOR, VECTOR, VECTOR, MATRIX))
def build_table(edges, times, times_low, time_terms):  # type: ignore[no-untyped-def]
    """Call `tabulate` from Python."""
    return tabulate(edges, times, times_low, time_terms)


@entry(VECTOR(VECTOR, VECTOR, VECTOR, MATRIX, types.int64[::1], VECTOR, VECTOR, VECTOR))
def phase_angles(middles, lows, scales, powers, index, ends, t, t_low):  # type: ignore[no-untyped-def]
    """Return the phase angles at many times, as two doubles each; the other arguments are those of `Table`."""
    out, table = np.empty(t.size), Table(middles, lows, scales, powers, index, ends)
    segments = np.empty(BLOCK, dtype=np.int64)
    for start in range(0, t.size, BLOCK):
        n = min(BLOCK, t.size - start)
        block = slice(start, start + n)
        look_up(table, t[block], t_low[block], n, segments, out[block])
    return out


@entry(VECTOR(VECTOR, MATRIX, VECTOR, VECTOR))
def angles_to_end(scales, powers, left, phi):  # type: ignore[no-untyped-def]
    """Return what many phase angles lack to pi (`angle_to_end`)."""
    found = np.empty(phi.size)
    for i in range(phi.size):
        found[i] = angle_to_end(scales, powers, left[i], phi[i]) if phi[i] > BESIDE_END else pi - phi[i]
    return found
