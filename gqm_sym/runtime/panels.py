"""Pass 2: adaptive Gauss-Kronrod panels for time and arc length along one stretch of the curve.

A *stretch* is a part of the curve that is run through in one direction. Its ends decide the substitution that makes
the integrands smooth (MATHS, section 4); the new variable is the stretch's *anomaly* ``phi``:

=============== ======================================= ================================
kind            lam                                     phi
=============== ======================================= ================================
TURN_TURN       a + (b-a) sin(phi/2)**2                 0 to pi
FROM_TURN       a + (b-a) phi**2                        0 to 1
REGULAR         a + (b-a) phi                           0 to 1
TO_EQUILIBRIUM  b + (a-b) exp(-phi)                     0 onwards
=============== ======================================= ================================

V**2 comes from the climb, or, where forces dissipate, from a field (`fields`).

Each accepted panel keeps the Legendre coefficients of both antiderivatives, so that time and arc length can be read off
anywhere on it.
"""

from math import cos, exp, fabs, inf, sin, sqrt

import numpy as np

from gqm_sym.runtime.crossing import call_bend, call_rise
from gqm_sym.runtime.fields import along
from gqm_sym.runtime.jit import Inner
from gqm_sym.runtime.kronrod import EVEN, GAUSS_WEIGHTS, KRONROD_WEIGHTS, NODES, ODD

TURN_TURN, FROM_TURN, REGULAR, TO_EQUILIBRIUM = range(4)

# How a stretch's quadrature ended.
CONVERGED, FLOOR, EXHAUSTED, FAILED, ILL_CONDITIONED = range(5)

COUNT = 21
DEGREE = 22  # coefficients of an antiderivative
TAIL = 2e-15  # last Legendre coefficients against the largest: noise in them is about 5e-16
PLATEAU = 1e-7  # coefficients that have stopped falling below this level are rounding noise, not structure
MOST_PANELS = 4096
# Below this balance doubles keep too few digits of V**2 to be worth laying panels on.
HOPELESS = 1e-9
LEAST_WIDTH = 2.0**-48  # of the stretch
# Legendre's recurrence: P_(k+1) = GROWTH[k] x P_k - DECAY[k-1] P_(k-1).
GROWTH = np.array([(2 * k + 1) / (k + 1) for k in range(DEGREE + 1)])
DECAY = np.array([(k + 1) / (k + 2) for k in range(DEGREE + 1)])


@Inner
def rates(fns, p, kind, a, b, ref, w, field, phi, work, out):  # type: ignore[no-untyped-def]
    """Fill ``out`` with dt/dphi and ds/dphi at each phi. ``w`` is V**2 at ``ref`` (used where no end is special)."""
    n = phi.size
    da, db, rows = work[0, :n], work[1, :n], work[2:4, :n]
    if field.size > 0:
        whole = fabs(b - a)
        for i in range(n):
            if kind == FROM_TURN:
                d = whole * phi[i] * phi[i]
                _, share, ds = along(field, d, 1)
                out[0, i] = ds * 2.0 * sqrt(whole / share)
                out[1, i] = ds * 2.0 * whole * phi[i]
            elif kind == REGULAR:
                v2, _, ds = along(field, whole * phi[i], 0)
                out[0, i] = ds * whole / sqrt(v2)
                out[1, i] = ds * whole
            else:
                d = whole * exp(-phi[i])
                _, share, ds = along(field, d, 2)
                out[0, i] = ds / sqrt(share)
                out[1, i] = ds * d
    elif kind == TURN_TURN:
        for i in range(n):
            s, c = sin(0.5 * phi[i]), cos(0.5 * phi[i])
            da[i] = (b - a) * s * s
            db[i] = (b - a) * c * c
        call_bend(fns[3], n, a, b, da, db, p, rows)
        for i in range(n):
            out[0, i] = rows[1, i] / sqrt(rows[0, i])
            out[1, i] = rows[1, i] * sqrt(da[i] * db[i])
    elif kind == FROM_TURN:
        for i in range(n):
            da[i] = (b - a) * phi[i] * phi[i]
            db[i] = a + da[i]
        call_rise(fns[2], n, a, db, da, p, rows)
        root = 2.0 * sqrt(fabs(b - a))
        for i in range(n):
            fall = -rows[0, i] if b > a else rows[0, i]
            out[0, i] = rows[1, i] * root / sqrt(fall)
            out[1, i] = rows[1, i] * 2.0 * fabs(b - a) * phi[i]
    elif kind == REGULAR:
        for i in range(n):
            da[i] = (a - ref) + (b - a) * phi[i]
            db[i] = ref + da[i]
        call_rise(fns[2], n, ref, db, da, p, rows)
        for i in range(n):
            out[0, i] = rows[1, i] * fabs(b - a) / sqrt(w - da[i] * rows[0, i])
            out[1, i] = rows[1, i] * fabs(b - a)
    else:
        for i in range(n):
            da[i] = (a - b) * exp(-phi[i])
            db[i] = -da[i]
        call_bend(fns[3], n, b, b, da, db, p, rows)
        for i in range(n):
            out[0, i] = rows[1, i] / sqrt(-rows[0, i])
            out[1, i] = rows[1, i] * fabs(da[i])


@Inner
def speeds(fns, p, kind, a, b, ref, w, field, phi, work, out):  # type: ignore[no-untyped-def]
    """Fill ``out`` with V at each phi: no difference of heights, and exactly zero at a turning point."""
    n = phi.size
    da, db, rows = work[0, :n], work[1, :n], work[2:4, :n]
    if field.size > 0:
        whole = fabs(b - a)
        for i in range(n):
            if kind == TO_EQUILIBRIUM:
                d = whole * exp(-phi[i])
                out[i] = d * sqrt(along(field, d, 2)[1])
            else:
                d = whole * phi[i] * (phi[i] if kind == FROM_TURN else 1.0)
                out[i] = sqrt(max(along(field, d, 0)[0], 0.0))
    elif kind == TURN_TURN or kind == TO_EQUILIBRIUM:
        for i in range(n):
            if kind == TURN_TURN:
                s, c = sin(0.5 * phi[i]), cos(0.5 * phi[i])
                da[i] = (b - a) * s * s
                db[i] = (b - a) * c * c
            else:
                da[i] = (a - b) * exp(-phi[i])
                db[i] = -da[i]
        call_bend(fns[3], n, a if kind == TURN_TURN else b, b, da, db, p, rows)
        for i in range(n):
            if kind == TURN_TURN:
                out[i] = sqrt(da[i] * db[i] * rows[0, i])
            else:  # V**2 may lie below the least double
                out[i] = fabs(da[i]) * sqrt(-rows[0, i])
    else:
        start = a if kind == FROM_TURN else ref
        for i in range(n):
            da[i] = (b - a) * phi[i] * (phi[i] if kind == FROM_TURN else 1.0) + (a - start)
            db[i] = start + da[i]
        call_rise(fns[2], n, start, db, da, p, rows)
        for i in range(n):
            out[i] = sqrt(max(w - da[i] * rows[0, i], 0.0))


@Inner
def shares(kind, w, field, work, n, peak):  # type: ignore[no-untyped-def]
    """What is left of V**2 where it cancels, over the places last filled.

    Between two turning points that is its regular factor, least and largest. From where V**2 is known it is V**2
    itself, against the largest on the way, ``peak``: a body that has been fast and is slow again passes a barrier.

    Returns
    -------
    low, high : float
        Their ratio is the share that is left.
    peak : float
        The largest V**2 on the way up to the last place.
    """
    low, high = 1.0, 1.0
    if field.size > 0:
        return low, high, peak
    if kind == TURN_TURN:
        low, high = inf, 0.0
        for i in range(n):
            low, high = min(low, work[2, i]), max(high, work[2, i])
    elif kind != TO_EQUILIBRIUM:
        # Towards the place where V**2 is known it only grows more certain.
        outwards = fabs(work[0, 0]) <= fabs(work[0, n - 1])
        for i in range(n):
            lost = work[0, i] * work[2, i]
            if outwards:
                peak = max(peak, w - lost)
            if peak > 0.0 or not outwards:
                low = min(low, (w - lost) / max(peak, w + fabs(lost)))
    return low, high, peak


@Inner
def antiderivative(values, half, c, out):  # type: ignore[no-untyped-def]
    """Legendre coefficients of the integral from the left end; returns size, tail and plateau of the integrand's."""
    for j in range(11):
        total = EVEN[11 * j] * values[10]
        for i in range(1, 11):
            total += EVEN[11 * j + i] * (values[10 + i] + values[10 - i])
        c[2 * j] = total
    for j in range(10):
        total = 0.0
        for i in range(10):
            total += ODD[10 * j + i] * (values[11 + i] - values[9 - i])
        c[2 * j + 1] = total
    c[21] = c[22] = 0.0
    size = 0.0
    for j in range(COUNT):
        size = max(size, fabs(c[j]))
    out[0] = half * (c[0] - c[1] / 3.0)
    for k in range(1, DEGREE):
        out[k] = half * (c[k - 1] / (2 * k - 1) - c[k + 1] / (2 * k + 3))
    tail = max(fabs(c[18]), fabs(c[19]), fabs(c[20]))
    middle = max(fabs(c[12]), fabs(c[13]), fabs(c[14]))
    return size, tail, middle


@Inner
def legendre_sum(c, x):  # type: ignore[no-untyped-def]
    """The Legendre series with coefficients c, at x, by Clenshaw's recurrence."""
    high, low = 0.0, 0.0
    for k in range(c.size - 1, 0, -1):
        high, low = c[k] + GROWTH[k] * x * high - DECAY[k] * low, high
    return c[0] + x * high - 0.5 * low


@Inner
def lay(fns, p, kind, a, b, ref, w, field, marks):  # type: ignore[no-untyped-def]
    """Lay panels until time and arc length are resolved to rounding.

    ``field`` is V**2 along the stretch where forces dissipate, else empty. ``marks`` are anomalies: the first and the
    last, and between them those at which a panel must begin because the curve is not smooth there.

    Returns
    -------
    edges, times, lengths : (n+1,) arrays
        Panel edges in phi; time and arc length from ``start`` at each edge.
    time_terms, length_terms : (n, DEGREE) arrays
        Legendre coefficients of both antiderivatives on each panel.
    error : float
        Estimated relative error of the whole time by quadrature, rounding included.
    balance : float
        Smallest against largest regular factor of V**2: what is left of it where most of it cancels. Near a
        separatrix it is small.
    status : int
        CONVERGED, FLOOR (coefficients levelled off above rounding), EXHAUSTED (too many panels), FAILED (not
        finite) or ILL_CONDITIONED (V**2 all but vanishes
        inside: extended precision must lay the panels).
    """
    room = 16
    edges, times, lengths = np.empty(room + 1), np.empty(room + 1), np.empty(room + 1)
    time_terms, length_terms = np.empty((room, DEGREE)), np.empty((room, DEGREE))
    phi, work, values, c = (
        np.empty(COUNT),
        np.empty((4, COUNT)),
        np.empty((2, COUNT)),
        np.empty(DEGREE + 1),
    )
    start, stop = marks[0], marks[-1]
    waiting = marks.size - 1
    pending = np.empty(waiting + 128)  # right edges still to do, nearest last
    pending[:waiting] = marks[:0:-1]
    most = MOST_PANELS + waiting
    edges[0], times[0], lengths[0] = start, 0.0, 0.0
    left, count, error, status = start, 0, 0.0, CONVERGED
    time_low, length_low = 0.0, 0.0
    least = LEAST_WIDTH * fabs(stop - start)
    smallest, largest, peak = inf, 0.0, 0.0
    while waiting > 0:
        right = pending[waiting - 1]
        half, middle = 0.5 * (right - left), 0.5 * (right + left)
        for i in range(11):
            phi[10 + i] = middle + half * NODES[i]
            phi[10 - i] = middle - half * NODES[i]
        rates(fns, p, kind, a, b, ref, w, field, phi, work, values)
        low, high, reached = shares(kind, w, field, work, COUNT, peak)
        smallest, largest = min(smallest, low), max(largest, high)
        if largest > 0.0 and smallest < HOPELESS * largest:
            status = ILL_CONDITIONED
            break
        if count == room:
            room *= 2
            edges, times, lengths = (
                longer(edges, room + 1),
                longer(times, room + 1),
                longer(lengths, room + 1),
            )
            time_terms, length_terms = taller(time_terms, room), taller(length_terms, room)
        length_size, length_tail, length_middle = antiderivative(values[1], half, c, length_terms[count])
        size, tail, level = antiderivative(values[0], half, c, time_terms[count])
        kronrod, gauss, duration, length = 0.0, 0.0, 0.0, 0.0
        for i in range(10, 0, -1):
            pair = values[0, 10 + i] + values[0, 10 - i]
            duration += KRONROD_WEIGHTS[i] * pair
            gauss += GAUSS_WEIGHTS[i] * pair
            length += KRONROD_WEIGHTS[i] * (values[1, 10 + i] + values[1, 10 - i])
        duration = half * (duration + KRONROD_WEIGHTS[0] * values[0, 10])
        length = half * (length + KRONROD_WEIGHTS[0] * values[1, 10])
        kronrod = fabs(duration - half * gauss)
        settled = tail <= TAIL * size and length_tail <= TAIL * length_size and kronrod <= 1e-6 * duration
        floor = (
            level <= PLATEAU * size
            and tail >= 0.05 * level
            and (
                length_tail <= TAIL * length_size
                or (length_middle <= PLATEAU * length_size and length_tail >= 0.05 * length_middle)
            )
        )
        narrow = fabs(right - left) <= least
        full = count + waiting >= most or waiting >= pending.size - 1
        if not (duration > 0.0 and duration < inf):
            if narrow or full:
                status = FAILED
                break
        elif settled or floor or narrow or full:
            if not settled:
                if floor and tail > 50.0 * TAIL * size:
                    status = max(status, FLOOR)
                elif not floor:
                    status = EXHAUSTED
            error += tail / size * duration
            # Two-sum: the running totals keep what a double would lose.
            total = times[count] + (duration + time_low)
            time_low = (duration + time_low) - (total - times[count])
            times[count + 1] = total
            total = lengths[count] + (length + length_low)
            length_low = (length + length_low) - (total - lengths[count])
            lengths[count + 1] = total
            edges[count + 1] = right
            left = right
            peak = reached
            count += 1
            waiting -= 1
            continue
        pending[waiting] = middle
        waiting += 1
    whole = times[count]
    relative = error / whole + 2.3e-16 if whole > 0.0 else inf
    return (
        edges[: count + 1].copy(),
        times[: count + 1].copy(),
        lengths[: count + 1].copy(),
        time_terms[:count].copy(),
        length_terms[:count].copy(),
        relative,
        smallest / largest if largest > 0.0 else 0.0,
        status,
    )


@Inner
def longer(array, size):  # type: ignore[no-untyped-def]
    """The array with room for more."""
    out = np.empty(size)
    out[: array.size] = array
    return out


@Inner
def taller(array, rows):  # type: ignore[no-untyped-def]
    """The table with room for more rows."""
    out = np.empty((rows, array.shape[1]))
    out[: array.shape[0]] = array
    return out


@Inner
def read_off(edges, marks, terms, phi):  # type: ignore[no-untyped-def]
    """Time (or arc length) from the first edge to anomaly phi."""
    k = min(max(np.searchsorted(edges, phi, side="right") - 1, 0), edges.size - 2)
    half = 0.5 * (edges[k + 1] - edges[k])
    x = ((phi - edges[k]) - half) / half
    return marks[k] + legendre_sum(terms[k], x)
