"""When one of many orbits is first at a place: the time as a sine series in the anomaly, or by panels."""

from math import atan2, cos, fabs, inf, pi, sin, sqrt

import numpy as np

from gqm_sym.runtime.arithmetic.matrices import multiply
from gqm_sym.runtime.compiled.calls import call_effective_potential, call_potential_divdiff1, call_potential_divdiff2
from gqm_sym.runtime.compiled.intrinsics import fma
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.quadrature.time_panels import MIN_CANCELLATION_RATIO, are_accurate, orbit_panels, read_off

# Terms of the series that are tried; how small the last ones must be against the first, for the time they stand for is
# divided by their number.
SHORT, LONG, LONGEST, LAST, SMALL = 32, 64, 128, 4, 1e-14

# A turning point is near a launch within this share of the orbit's width.
NEAR_LAUNCH = 1e-3


def _cosines(n: int) -> np.ndarray:
    """The matrix from values at n + 1 equal steps of half a turn to coefficients of cosines: a row for each node."""
    steps = np.outer(np.arange(n + 1), np.arange(n + 1)) % (2 * n)
    matrix = np.array([cos(pi * m / n) for m in range(2 * n)])[steps] * (2.0 / n)
    matrix[[0, n]] *= 0.5
    matrix[:, [0, n]] *= 0.5
    return matrix


OF_LONGEST = _cosines(LONGEST)
of_short, of_long = multiply(_cosines(SHORT)), multiply(_cosines(LONG))
NEAR = np.sin(0.5 * pi * np.arange(LONGEST + 1) / LONGEST) ** 2


@Inner
def pace_series(fns, p, a, b, width, n, work, series):  # type: ignore[no-untyped-def]
    """Fill the cosine series of dt/dphi over half a turn; returns whether it is resolved, and V**2 balanced."""
    m = n + 1
    da, db, rows = work[:m], work[m : 2 * m], work[2 * m : 4 * m]
    for j in range(m):
        node = j * (LONGEST // n)
        da[j], db[j] = width * NEAR[node], width * NEAR[LONGEST - node]
    call_potential_divdiff2(fns.potential_divdiff2, m, a, b, da, db, p, rows)
    low, high, tail = inf, 0.0, 0.0
    for j in range(m):
        q = rows[j]
        low, high = min(low, q), max(high, q)
        da[j] = rows[m + j] / sqrt(q)
    if n == SHORT:
        of_short(work, 0, series, 0)
    elif n == LONG:
        of_long(work, 0, series, 0)
    else:
        for k in range(m):
            series[k] = 0.0
        for j in range(m):
            for k in range(m):
                series[k] += OF_LONGEST[j, k] * da[j]
    for k in range(n - LAST, n + 1):
        tail = max(tail, fabs(series[k]))
    return tail <= SMALL * series[0] and low > MIN_CANCELLATION_RATIO * high


@Inner
def times_from(series, n, phi, psi, flip):  # type: ignore[no-untyped-def]
    """The times from an end to two anomalies; ``flip`` is -1 for the second end.

    The integral of a cosine series, by Clenshaw's scheme for sines: two sums side by side, for each step waits for the
    one before.
    """
    twice, double, sign = 2.0 * cos(phi), 2.0 * cos(psi), flip if n % 2 else 1.0
    one, two, first, second = 0.0, 0.0, 0.0, 0.0
    for k in range(n, 0, -1):
        term = sign * series[k] / k
        one, two = fma(twice, one, term - two), one
        first, second = fma(double, first, term - second), first
        sign *= flip
    return series[0] * phi + one * sin(phi), series[0] * psi + first * sin(psi)


@Inner
def sharpened(fns, p, lam0, w0, end, width, work):  # type: ignore[no-untyped-def]
    """How far a turning point is from the launch, with all digits: one that is near may be known as a rounded sum."""
    if w0 == 0.0 or fabs(end) > NEAR_LAUNCH * width:
        return end
    spot, offset, rows = work[:1], work[1:2], work[2:4]
    spot[0], offset[0] = lam0 + end, end
    call_potential_divdiff1(fns.potential_divdiff1, 1, lam0, spot, offset, p, rows)
    left = w0 - end * rows[0]
    call_effective_potential(fns.effective_potential, 1, spot, p, rows)
    better = end + left / rows[1]
    return better if better * end >= 0.0 and fabs(better) <= NEAR_LAUNCH * width else end


@Inner
def arrival(fns, p, going_round, direction, lam0, w0, least, most, place, work, series):  # type: ignore[no-untyped-def]
    """When the body is first at a place; NaN for the exact problem, infinity if never.

    ``least`` and ``most`` are offsets of both ends from the launch, or of a lap.
    """
    ahead = place - lam0
    if ahead == 0.0:
        return 0.0
    if going_round:
        lap = direction * (most - least)
        laps = np.floor(ahead / lap)
        if laps < 0.0:
            return inf
        panels = orbit_panels(fns, p, going_round, lam0, lam0 + lap, lam0, w0)
        if not are_accurate(panels):
            return np.nan
        return laps * panels.times[-1] + read_off(panels.edges, panels.times, panels.time_terms, ahead / lap - laps)
    width = most - least
    least = sharpened(fns, p, lam0, w0, least, width, work)
    most = sharpened(fns, p, lam0, w0, most, width, work)
    a, b = lam0 + least, lam0 + most
    if not a <= place <= b:
        return inf
    n, resolved = SHORT // 2, False
    while n < LONGEST and not resolved:
        n *= 2
        resolved = pace_series(fns, p, a, b, width, n, work, series)
    # Times are told from the end that is nearer to the launch: of a launch there they have all their digits.
    from_b = -least > most
    near, far = (most, -least) if from_b else (-least, most)
    there = (most - ahead, ahead - least) if from_b else (ahead - least, most - ahead)
    if resolved:
        here = 2.0 * atan2(sqrt(near), sqrt(far))
        then = 2.0 * atan2(sqrt(max(there[0], 0.0)), sqrt(max(there[1], 0.0)))
        whole, (start, stop) = series[0] * pi, times_from(series, n, here, then, -1.0 if from_b else 1.0)
    else:
        panels = orbit_panels(fns, p, going_round, a, b, lam0, w0)
        if not are_accurate(panels):
            return np.nan
        whole = panels.times[-1]
        start = read_off(panels.edges, panels.times, panels.time_terms, 2.0 * atan2(sqrt(-least), sqrt(most)))
        at = 2.0 * atan2(sqrt(max(ahead - least, 0.0)), sqrt(max(most - ahead, 0.0)))
        stop = read_off(panels.edges, panels.times, panels.time_terms, at)
        if from_b:
            start, stop = whole - start, whole - stop
    onwards = direction * ahead > 0.0
    if (direction > 0) == from_b:  # towards that end
        return start - stop if onwards else start + stop
    return stop - start if onwards else (whole - start) + (whole - stop)
