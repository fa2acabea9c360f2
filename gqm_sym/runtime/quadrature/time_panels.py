"""Pass 2: adaptive Gauss-Kronrod panels for time and arc length along one stretch of the curve.

Each accepted panel keeps the Legendre coefficients of both antiderivatives, so that time and arc length can be read off
anywhere on it.
"""

from math import fabs, inf, pi

import numpy as np
from numba import types

from gqm_sym.runtime.arithmetic.clenshaw import DECAY, GROWTH, legendre_sum
from gqm_sym.runtime.compiled.buffers import longer, taller
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.types import ADDRESSES, MATRIX, REAL, VECTOR
from gqm_sym.runtime.quadrature.integrands import NO_FUNCTIONS, REGULAR, TO_EQUILIBRIUM, TURN_TURN, rates, shares
from gqm_sym.runtime.quadrature.kronrod import EVEN, GAUSS_WEIGHTS, KRONROD_WEIGHTS, NODES, ODD

# How a stretch's quadrature ended.
CONVERGED, FLOOR, EXHAUSTED, FAILED, ILL_CONDITIONED = range(5)
COUNT = 21
DEGREE = 22  # coefficients of an antiderivative
LONGEST = 32  # of a series in Legendre polynomials
TAIL = 2e-15  # last Legendre coefficients against the largest: noise in them is about 5e-16
PLATEAU = 1e-7  # coefficients that have stopped falling below this level are rounding noise, not structure
MOST_PANELS = 4096

# Below this balance doubles keep too few digits of V**2 to be worth laying panels on.
HOPELESS = 1e-9

# Below this balance the half period in doubles is off by more than a few units in the last place.
LEAST_BALANCE = 1e-2
LEAST_WIDTH = 2.0**-48  # of the stretch
NOTHING = 2.0**-104  # a share of the time so far that two doubles do not hold


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
        # At the end of a spiral, where it winds on below the last bit of what there is.
        nothing = duration >= 0.0 and duration <= NOTHING * times[count] and length <= NOTHING * lengths[count]
        if not ((duration > 0.0 or nothing) and duration < inf):
            if narrow or full:
                status = FAILED
                break
        elif settled or floor or narrow or full or nothing:
            if not (settled or nothing):
                if floor and tail > 50.0 * TAIL * size:
                    status = max(status, FLOOR)
                elif not floor:
                    status = EXHAUSTED
            error += tail / size * duration if size > 0.0 else 0.0
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
def panel_of(edges, phi):  # type: ignore[no-untyped-def]
    """The panel on which an anomaly lies."""
    return min(max(np.searchsorted(edges, phi, side="right") - 1, 0), edges.size - 2)


@Inner
def read_off(edges, marks, terms, phi):  # type: ignore[no-untyped-def]
    """Time (or arc length) from the first edge to anomaly phi."""
    k = panel_of(edges, phi)
    half = 0.5 * (edges[k + 1] - edges[k])
    x = ((phi - edges[k]) - half) / half
    return marks[k] + legendre_sum(terms[k], x)


@Inner
def read_off_block(edges, marks, terms, phi, n, panels, work, out):  # type: ignore[no-untyped-def]
    """`read_off` at n anomalies on known panels, side by side; ``work`` is room for three rows of n."""
    x, high, low = work[0], work[1], work[2]
    for i in range(n):
        left, half = edges[panels[i]], 0.5 * (edges[panels[i] + 1] - edges[panels[i]])
        x[i], high[i], low[i] = ((phi[i] - left) - half) / half, 0.0, 0.0
    for k in range(DEGREE - 1, 0, -1):
        growth, decay = GROWTH[k], DECAY[k]
        for i in range(n):
            new = terms[panels[i], k] + growth * x[i] * high[i] - decay * low[i]
            low[i], high[i] = high[i], new
    for i in range(n):
        out[i] = marks[panels[i]] + (terms[panels[i], 0] + x[i] * high[i] - 0.5 * low[i])


PANELS_TYPE = types.Tuple((VECTOR, VECTOR, VECTOR, MATRIX, MATRIX, REAL, REAL, types.int64))


@entry(PANELS_TYPE(ADDRESSES, VECTOR, types.int64, REAL, REAL, REAL, REAL, VECTOR))
def lay_panels(fns, p, kind, a, b, ref, w, marks):  # type: ignore[no-untyped-def]
    """`panels.lay`, for Python."""
    return lay(fns, p, kind, a, b, ref, w, np.empty((0, 0)), marks)


@entry(PANELS_TYPE(REAL, REAL, MATRIX, VECTOR))
def lay_along(a, b, field, marks):  # type: ignore[no-untyped-def]
    """`panels.lay` towards an equilibrium b where V**2 is a field."""
    return lay(NO_FUNCTIONS, np.empty(0), TO_EQUILIBRIUM, a, b, a, 0.0, field, marks)


@entry(VECTOR(VECTOR, MATRIX, VECTOR))
def slopes(edges, terms, phi):  # type: ignore[no-untyped-def]
    """Derivatives of the panels' Legendre series at anomalies."""
    out, series = np.empty(phi.size), np.empty(terms.shape[1])
    for i in range(phi.size):
        k = panel_of(edges, phi[i])
        half = 0.5 * (edges[k + 1] - edges[k])
        derivative(terms[k], series)
        out[i] = legendre_sum(series, ((phi[i] - edges[k]) - half) / half) / half
    return out


@entry(VECTOR(VECTOR, VECTOR, MATRIX, VECTOR))
def read_off_many(edges, marks, terms, phi):  # type: ignore[no-untyped-def]
    """Time or arc length from the first edge to many anomalies."""
    out = np.empty(phi.size)
    for i in range(phi.size):
        out[i] = read_off(edges, marks, terms, phi[i])
    return out


@Inner
def orbit_panels(fns, p, going_round, a, b, lam0, w0):  # type: ignore[no-untyped-def]
    """Adaptive panels over half a libration, or over a lap: one call, for compiling each takes long."""
    kind, ref, w, stop = (REGULAR, lam0, w0, 1.0) if going_round else (TURN_TURN, a, 0.0, pi)
    return lay(fns, p, kind, a, b, ref, w, np.empty((0, 0)), np.array([0.0, stop]))


@Inner
def to_rounding(panels):  # type: ignore[no-untyped-def]
    """Whether panels tell time to the last places."""
    return not (panels[7] >= FLOOR or panels[6] < LEAST_BALANCE)


@Inner
def derivative(terms, out):  # type: ignore[no-untyped-def]
    """Legendre coefficients of the derivative (with respect to x) of a Legendre series."""
    n = terms.size
    out[:] = 0.0
    for k in range(n - 1, 0, -1):
        out[k - 1] = (2 * k - 1) * (terms[k] + (out[k + 1] / (2 * k + 3) if k + 1 < n else 0.0))
