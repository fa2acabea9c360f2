"""Half periods and loop times by the trapezoidal rule, which converges geometrically on a periodic integrand."""

from math import fabs, inf, pi, sqrt

import numpy as np

from gqm_sym.runtime.compiled.calls import call_potential_divdiff1, call_potential_divdiff2
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import on_stack
from gqm_sym.runtime.quadrature.time_panels import LEAST_BALANCE, orbit_panels, to_rounding

# Kinds of orbits.
LIBRATION, CIRCULATION = range(2)

# The trapezoidal rule doubles its nodes so often, from FEWEST intervals on.
MIN_INTERVALS, MAX_DOUBLINGS = 8, 7
MAX_NODES = MIN_INTERVALS * 2**MAX_DOUBLINGS

# The rule's error is a sum of terms c*r**nodes, times a cosine of the nodes. It squares with each doubling, over c,
# which branch points of ds make as small as 1e-5. A change may also be small by accident; two in a row hardly are.
MAX_LAST_CHANGE, MAX_CHANGE_BEFORE = 1e-11, 3e-6
work_room, rate_room = on_stack(4 * MAX_NODES), on_stack(MAX_NODES)


def _anomalies() -> np.ndarray:
    """Anomalies of all levels of the rule over [0, 1] half periods: the first's, then what each doubling adds."""
    levels = [np.arange(MIN_INTERVALS + 1) / MIN_INTERVALS]
    for k in range(MAX_DOUBLINGS):
        n = MIN_INTERVALS * 2**k
        levels.append((np.arange(n) + 0.5) / n)
    return np.concatenate(levels)


SHARES = _anomalies()
FROM_A, FROM_B = np.sin(0.5 * pi * SHARES) ** 2, np.cos(0.5 * pi * SHARES) ** 2


@Inner
def fill_integrand(fns, p, kind, lam0, w0, a, b, width, first, n, work, rates):  # type: ignore[no-untyped-def]
    """dt/dphi at n nodes of the rule from the ``first`` on; returns the least and largest regular factor of V**2.

    ``width`` is the orbit's, from offsets: closer than the difference of its rounded ends.
    """
    da, db, rows = work[:n], work[n : 2 * n], work[2 * n : 4 * n]
    low, high = inf, 0.0
    if kind == LIBRATION:
        for i in range(n):
            da[i], db[i] = width * FROM_A[first + i], width * FROM_B[first + i]
        call_potential_divdiff2(fns.potential_divdiff2, n, a, b, da, db, p, rows)
        for i in range(n):
            rates[i] = pi * rows[n + i] / sqrt(rows[i])
            low, high = min(low, rows[i]), max(high, rows[i])
    else:
        for i in range(n):
            db[i] = width * SHARES[first + i]
            da[i] = lam0 + db[i]
        call_potential_divdiff1(fns.potential_divdiff1, n, lam0, da, db, p, rows)
        for i in range(n):
            lost = db[i] * rows[i]
            rates[i] = fabs(width) * rows[n + i] / sqrt(w0 - lost)
            low = min(low, (w0 - lost) / (w0 + fabs(lost)))
        high = 1.0
    return low, high


@Inner
def has_converged(before, change):  # type: ignore[no-untyped-def]
    """Whether the trapezoidal rule has come to its value, by its last two relative changes."""
    return (before <= MAX_CHANGE_BEFORE) & (change <= MAX_LAST_CHANGE)


@Inner
def time_by_trapezoid(fns, p, kind, lam0, w0, a, b, width):  # type: ignore[no-untyped-def]
    """Half period or loop time by the trapezoidal rule; NaN where it did not converge or V**2 all but vanishes."""
    work, rates = work_room(), rate_room()
    low, high = fill_integrand(fns, p, kind, lam0, w0, a, b, width, 0, MIN_INTERVALS + 1, work, rates)
    total = 0.5 * (rates[0] + rates[MIN_INTERVALS])
    half = total
    for i in range(1, MIN_INTERVALS):
        total += rates[i]
        half += (i % 2 == 0) * rates[i]
    value, n, first = total / MIN_INTERVALS, MIN_INTERVALS, MIN_INTERVALS + 1
    before = fabs(2.0 * half - total) / total
    while n < MAX_NODES:
        least, most = fill_integrand(fns, p, kind, lam0, w0, a, b, width, first, n, work, rates)
        low, high = min(low, least), max(high, most)
        if not low > LEAST_BALANCE * high:
            return np.nan
        more = 0.0
        for i in range(n):
            more += rates[i]
        total += more
        first += n
        n *= 2
        new = total / n
        change = fabs(new - value) / new
        value = new
        if has_converged(before, change):
            return value
        before = change
    return np.nan


@Inner
def time_by_panels(fns, p, kind, lam0, w0, a, b):  # type: ignore[no-untyped-def]
    """Half period or loop time by adaptive panels; NaN where they did not converge."""
    panels = orbit_panels(fns, p, kind == CIRCULATION, a, b, lam0, w0)
    if not to_rounding(panels):
        return np.nan
    return panels[1][-1]
