"""Half periods and lap times by the trapezoidal rule, which converges geometrically on a periodic integrand.

The nodes are phase angles (`substitution`): a half period is an integral over [0, pi], a lap time over [0, 1].
"""

from math import fabs, inf, isqrt, pi, sqrt
from typing import Any, NamedTuple

import numpy as np

from gqm_sym.runtime.compiled.calls import call_potential_divdiff1, call_potential_divdiff2
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import on_stack
from gqm_sym.runtime.quadrature.substitution import REGULAR, TURN_TURN
from gqm_sym.runtime.quadrature.time_panels import MIN_CANCELLATION_RATIO, are_accurate, orbit_panels

# Kinds of orbits.
LIBRATION, CIRCULATION = range(2)

# The rule begins with MIN_INTERVALS intervals and doubles their number at most MAX_DOUBLINGS times.
MIN_INTERVALS, MAX_DOUBLINGS = 8, 7
MAX_NODES = MIN_INTERVALS * 2**MAX_DOUBLINGS

# The error of the rule is a sum of terms c*r**n times a cosine of the number n of nodes. Each doubling replaces r**n by
# its square, and c may be as small as 1e-5 because of branch points of ds/dlam. A change between two levels may be
# small by accident, but hardly two changes in a row, so both are limited.
MAX_LAST_CHANGE, MAX_CHANGE_BEFORE = 1e-11, 3e-6

# Work space of `fill_integrand`, on the stack.
trapezoid_workspace, trapezoid_rates = on_stack(4 * MAX_NODES), on_stack(MAX_NODES)


class Orbit(NamedTuple):
    """The inputs of the integrand of a half period or of a lap time.

    Attributes
    ----------
    fns : Addresses
        Addresses of the model's compiled functions.
    p : array
        Run-time parameters.
    kind : int
        LIBRATION or CIRCULATION.
    lam0, w0 : float
        The launch place, and V**2 there in (m/s)**2.
    a, b : float
        Turning points, or both ends of a lap.
    width : float
        b - a from the offsets of both ends, which is more accurate than the difference of the rounded ends.
    """

    fns: Any
    p: Any
    kind: Any
    lam0: Any
    w0: Any
    a: Any
    b: Any
    width: Any


def _node_shares() -> np.ndarray:
    """Return the nodes of all levels as shares of the interval: those of the first level, then those that each doubling
    adds.
    """
    levels = [np.arange(MIN_INTERVALS + 1) / MIN_INTERVALS]
    for k in range(MAX_DOUBLINGS):
        n = MIN_INTERVALS * 2**k
        levels.append((np.arange(n) + 0.5) / n)
    return np.concatenate(levels)


def _squares_of_sines() -> np.ndarray:
    """Return ``sin(pi*k/(2*MAX_NODES))**2`` for k up to MAX_NODES, correctly rounded.

    Cosines of half the angles follow from square roots of integers. Errors of the nodes would be common to all orbits.
    """
    one = 1 << 120
    cosines = [one, 0]  # of angles up to a right angle
    while len(cosines) <= MAX_NODES // 2:
        cosines = [isqrt((one + c) << 119) for c in cosines] + [isqrt((one - c) << 119) for c in cosines[-2::-1]]
    cosines += [-c for c in cosines[-2::-1]]
    return np.array([(one - c) / (2 * one) for c in cosines])


# The nodes, and the squares of the sine and cosine of half the phase angle at them, which are the offsets from both
# turning points as shares of the width (`substitution`, TURN_TURN); and those of the phase angle itself.
NODE_SHARES = _node_shares()
_SQUARES, _NUMBERS = _squares_of_sines(), np.rint(MAX_NODES * NODE_SHARES).astype(int)
OFFSETS_FROM_A, OFFSETS_TO_B = _SQUARES[_NUMBERS], _SQUARES[MAX_NODES - _NUMBERS]
SINES_SQUARED = _SQUARES[MAX_NODES - np.abs(MAX_NODES - 2 * _NUMBERS)]
COSINES_SQUARED = _SQUARES[np.abs(MAX_NODES - 2 * _NUMBERS)]


@Inner
def fill_integrand(orbit, first, n, work, rates):  # type: ignore[no-untyped-def]
    """Fill ``rates`` with the integrand at n nodes.

    Parameters
    ----------
    orbit : Orbit
        The orbit.
    first : int
        Index of the first node in NODE_SHARES.
    work : (4*n,) array
        Work space.
    rates : (n,) array
        Filled with the time per share of the interval, in s.

    Returns
    -------
    low, high : float
        The smallest and the largest regular factor of V**2; their ratio is the part that cancellation leaves.
    """
    fns, p, kind, lam0, w0, a, b, width = orbit
    da, db, rows = work[:n], work[n : 2 * n], work[2 * n : 4 * n]
    low, high = inf, 0.0
    if kind == LIBRATION:
        for i in range(n):
            da[i], db[i] = width * OFFSETS_FROM_A[first + i], width * OFFSETS_TO_B[first + i]
        call_potential_divdiff2(fns.potential_divdiff2, n, a, b, da, db, p, rows)
        for i in range(n):
            rates[i] = pi * rows[n + i] / sqrt(2.0 * rows[i])
            low, high = min(low, rows[i]), max(high, rows[i])
    else:
        for i in range(n):
            db[i] = width * NODE_SHARES[first + i]
            da[i] = lam0 + db[i]
        call_potential_divdiff1(fns.potential_divdiff1, n, lam0, da, db, p, rows)
        for i in range(n):
            loss = 2.0 * db[i] * rows[i]
            rates[i] = fabs(width) * rows[n + i] / sqrt(w0 - loss)
            low = min(low, (w0 - loss) / (w0 + fabs(loss)))
        high = 1.0
    return low, high


@Inner
def has_converged(before, change, max_before):  # type: ignore[no-untyped-def]
    """Return whether the trapezoidal rule has converged, judged by its last two relative changes; the first of them is
    at most ``max_before``.
    """
    return (before <= max_before) & (change <= MAX_LAST_CHANGE)


@Inner
def time_by_trapezoid(fns, p, kind, lam0, w0, a, b, width):  # type: ignore[no-untyped-def]
    """Return the half period or the lap time in s by the trapezoidal rule; the arguments are those of `Orbit`.

    It is NaN if the rule does not converge, or if V**2 nearly vanishes.
    """
    orbit = Orbit(fns, p, kind, lam0, w0, a, b, width)
    work, rates = trapezoid_workspace(), trapezoid_rates()
    low, high = fill_integrand(orbit, 0, MIN_INTERVALS + 1, work, rates)
    total = 0.5 * (rates[0] + rates[MIN_INTERVALS])
    half = total
    for i in range(1, MIN_INTERVALS):
        total += rates[i]
        half += (i % 2 == 0) * rates[i]
    value, n, first = total / MIN_INTERVALS, MIN_INTERVALS, MIN_INTERVALS + 1
    before = fabs(2.0 * half - total) / total
    while n < MAX_NODES:
        new_low, new_high = fill_integrand(orbit, first, n, work, rates)
        low, high = min(low, new_low), max(high, new_high)
        if not low > MIN_CANCELLATION_RATIO * high:
            return np.nan
        added = 0.0
        for i in range(n):
            added += rates[i]
        total += added
        first += n
        n *= 2
        new = total / n
        change = fabs(new - value) / new
        value = new
        if has_converged(before, change, MAX_CHANGE_BEFORE):
            return value
        before = change
    return np.nan


@Inner
def time_by_panels(fns, p, kind, lam0, w0, a, b, joints):  # type: ignore[no-untyped-def]
    """Return the half period or the lap time in s by adaptive panels from joint to joint; NaN if not accurate."""
    panels = orbit_panels(fns, p, REGULAR if kind == CIRCULATION else TURN_TURN, a, b, lam0, w0, joints)
    if not are_accurate(panels):
        return np.nan
    return panels.times[-1]
