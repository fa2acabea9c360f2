"""Pass 2: adaptive Gauss-Kronrod panels for time and arc length along one segment of the curve.

Each accepted panel stores the Legendre coefficients of both antiderivatives, so that time and arc length can be
evaluated anywhere on it.
"""

from math import atan2, ceil, fabs, floor, inf, pi, sqrt
from typing import Any, NamedTuple

import numpy as np
from numba import types

from gqm_sym.runtime.arithmetic.clenshaw import DECAY, GROWTH, legendre_growth, legendre_sum
from gqm_sym.runtime.compiled.buffers import longer, with_rows
from gqm_sym.runtime.compiled.jit import Inlined, Inner, entry
from gqm_sym.runtime.compiled.types import ADDRESSES, MATRIX, REAL, VECTOR
from gqm_sym.runtime.quadrature.integrands import NO_FUNCTIONS, Integrand, cancellation_range, fill_rates
from gqm_sym.runtime.quadrature.kronrod import EVEN, GAUSS_WEIGHTS, KRONROD_WEIGHTS, NODES, ODD
from gqm_sym.runtime.quadrature.substitution import FROM_SLOW, FROM_SLOW_TURN, REGULAR, TO_EQUILIBRIUM, TURN_TURN

# Status of a segment's quadrature.
CONVERGED, FLOOR, EXHAUSTED, FAILED, ILL_CONDITIONED = range(5)

# Nodes of a panel, and coefficients of its antiderivatives.
COUNT = 21
DEGREE = 22

# A panel is resolved when its last Legendre coefficients are below this share of the largest; their rounding noise is
# about 5e-16.
MAX_TAIL_RATIO = 2e-15

# Coefficients that stop decreasing below this share of the largest are rounding noise, not structure.
MAX_NOISE_RATIO = 1e-7

# They have stopped decreasing when the last ones are at least this share of those in the middle.
MIN_FLAT_RATIO = 0.05

# Noise above FLOOR_RATIO remains when the panel is halved. If less than KEPT_SHARE of it remains, it was due to
# structure beyond the panel's end, with small and slowly decreasing coefficients.
FLOOR_RATIO, KEPT_SHARE = 50.0 * MAX_TAIL_RATIO, 0.1

# The values of a resolved panel by the Kronrod and the Gauss rule differ by no more than this share.
MAX_RULE_DIFFERENCE = 1e-6

MAX_PANELS = 4096

# If cancellation leaves less than this part of V**2, panels in doubles are not worth laying.
MIN_USABLE_RATIO = 1e-9

# If cancellation leaves less than this part of V**2, the half period in doubles is off by more than a few ulp.
MIN_CANCELLATION_RATIO = 1e-2

# The narrowest panel, as a share of its distance from the start of the segment; next to the start a slow body gains its
# speed over the shortest distance that doubles resolve. And the narrowest panel at the start itself, as a share of the
# whole segment.
MIN_PANEL_SHARE, MIN_FIRST_PANEL_SHARE = 2.0**-48, 2.0**-960

# The number of panels, besides the first ones, that may wait while those before them are halved; it limits how often
# the first panel is halved.
MAX_WAITING = 1000

# A duration below this share of the time so far does not change it, even as two doubles.
NEGLIGIBLE_SHARE = 2.0**-104


class Panels(NamedTuple):
    """The panels of a segment.

    Attributes
    ----------
    edges : (n+1,) array
        Phase angles at the edges of the panels.
    times, lengths : (n+1,) arrays
        Time in s and arc length in m from the first edge to each edge.
    time_terms, length_terms : (n, DEGREE) arrays
        Legendre coefficients of both antiderivatives on each panel.
    error : float
        Estimated relative error of the whole time by quadrature, rounding included.
    cancellation : float
        The part of V**2 that cancellation leaves: the ratio of its smallest to its largest regular factor. It is small
        near a separatrix.
    status : int
        CONVERGED, FLOOR (the coefficients level off above rounding), EXHAUSTED (too many panels), FAILED (an integrand
        is not finite) or ILL_CONDITIONED (V**2 nearly vanishes inside: panels must be laid in extended precision).
    """

    edges: Any
    times: Any
    lengths: Any
    time_terms: Any
    length_terms: Any
    error: Any
    cancellation: Any
    status: Any


@Inner
def antiderivative(values, half, c, out):  # type: ignore[no-untyped-def]
    """Fill ``out`` with the Legendre coefficients of an integral from the left end of a panel.

    Parameters
    ----------
    values : (COUNT,) array
        The integrand at the nodes.
    half : float
        Half the width of the panel.
    c : (DEGREE + 1,) array
        Filled with the integrand's Legendre coefficients.

    Returns
    -------
    size, tail, middle : float
        The largest coefficient of the integrand, the largest of the last three, and of three in the middle.
    """
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


@Inlined
def _accumulate(total, low, value):  # type: ignore[no-untyped-def]
    """Add a value to a running total of two doubles."""
    new = total + (value + low)
    return new, (value + low) - (new - total)


@Inner
def _panel_sums(values, half):  # type: ignore[no-untyped-def]
    """Return duration and length of a panel by the Kronrod rule, and the difference between that duration and the one
    by the Gauss rule.
    """
    gauss, duration, length = 0.0, 0.0, 0.0
    for i in range(10, 0, -1):
        pair = values[0, 10 + i] + values[0, 10 - i]
        duration += KRONROD_WEIGHTS[i] * pair
        gauss += GAUSS_WEIGHTS[i] * pair
        length += KRONROD_WEIGHTS[i] * (values[1, 10 + i] + values[1, 10 - i])
    duration = half * (duration + KRONROD_WEIGHTS[0] * values[0, 10])
    length = half * (length + KRONROD_WEIGHTS[0] * values[1, 10])
    return duration, length, fabs(duration - half * gauss)


@Inlined
def _place_nodes(middle, half, phi):  # type: ignore[no-untyped-def]
    """Fill the phase angles of a panel's nodes."""
    for i in range(11):
        phi[10 + i] = middle + half * NODES[i]
        phi[10 - i] = middle - half * NODES[i]


@Inlined
def _is_noise(size, tail, middle):  # type: ignore[no-untyped-def]
    """Return whether coefficients have stopped decreasing at the level of rounding noise."""
    return middle <= MAX_NOISE_RATIO * size and tail >= MIN_FLAT_RATIO * middle


@Inner
def lay(integrand, marks):  # type: ignore[no-untyped-def]
    """Lay panels until time and arc length are resolved to rounding.

    Parameters
    ----------
    integrand : Integrand
        The segment.
    marks : (m,) array
        Phase angles: the first and the last one, and between them those at which a panel must begin because the curve
        is not smooth there.

    Returns
    -------
    Panels
    """
    capacity = 16
    edges, times, lengths = np.empty(capacity + 1), np.empty(capacity + 1), np.empty(capacity + 1)
    time_terms, length_terms = np.empty((capacity, DEGREE)), np.empty((capacity, DEGREE))
    phi, work, values, c = np.empty(COUNT), np.empty((4, COUNT)), np.empty((2, COUNT)), np.empty(DEGREE + 1)
    start, stop = marks[0], marks[-1]
    waiting = marks.size - 1
    pending = np.empty(waiting + MAX_WAITING)  # right edges of the remaining panels, the next one last
    for k in range(waiting):
        pending[k] = marks[waiting - k]
    before_halving = np.full(pending.size, inf)  # the shares of their last coefficients before they were halved
    max_panels = MAX_PANELS + waiting
    edges[0], times[0], lengths[0] = start, 0.0, 0.0
    left, count, error, status = start, 0, 0.0, CONVERGED
    time_low, length_low, min_width = 0.0, 0.0, MIN_FIRST_PANEL_SHARE * fabs(stop - start)
    smallest, largest, peak = inf, 0.0, 0.0
    while waiting > 0:
        right = pending[waiting - 1]
        half, middle = 0.5 * (right - left), 0.5 * (right + left)
        _place_nodes(middle, half, phi)
        fill_rates(integrand, phi, work, values)
        low, high, new_peak = cancellation_range(integrand, work, COUNT, peak)
        smallest, largest = min(smallest, low), max(largest, high)
        if largest > 0.0 and smallest < MIN_USABLE_RATIO * largest:
            status = ILL_CONDITIONED
            break
        if count == capacity:
            capacity *= 2
            edges, times, lengths = (
                longer(edges, capacity + 1),
                longer(times, capacity + 1),
                longer(lengths, capacity + 1),
            )
            time_terms, length_terms = with_rows(time_terms, capacity), with_rows(length_terms, capacity)
        length_size, length_tail, length_middle = antiderivative(values[1], half, c, length_terms[count])
        size, tail, level = antiderivative(values[0], half, c, time_terms[count])
        duration, length, difference = _panel_sums(values, half)
        length_resolved = length_tail <= MAX_TAIL_RATIO * length_size
        resolved = tail <= MAX_TAIL_RATIO * size and length_resolved and difference <= MAX_RULE_DIFFERENCE * duration
        keeps = tail <= FLOOR_RATIO * size or tail >= KEPT_SHARE * before_halving[waiting - 1] * size
        noise = _is_noise(size, tail, level) and (length_resolved or _is_noise(length_size, length_tail, length_middle))
        narrow = fabs(right - left) <= max(MIN_PANEL_SHARE * fabs(right - start), min_width)
        full = count + waiting >= max_panels or waiting >= pending.size - 1
        # This occurs at the end of a spiral, whose further turns are below the last bit of the time and the length so
        # far.
        negligible = (
            duration >= 0.0
            and duration <= NEGLIGIBLE_SHARE * times[count]
            and length <= NEGLIGIBLE_SHARE * lengths[count]
        )
        if not ((duration > 0.0 or negligible) and duration < inf):
            if narrow or full:
                status = FAILED
                break
        elif resolved or (noise and keeps) or narrow or full or negligible:
            if not (resolved or negligible):
                if noise and tail > FLOOR_RATIO * size:
                    status = max(status, FLOOR)
                elif not noise:
                    status = EXHAUSTED
            error += tail / size * duration if size > 0.0 else 0.0
            times[count + 1], time_low = _accumulate(times[count], time_low, duration)
            lengths[count + 1], length_low = _accumulate(lengths[count], length_low, length)
            left = edges[count + 1] = right
            peak = new_peak
            count += 1
            waiting -= 1
            continue
        before_halving[waiting - 1] = before_halving[waiting] = tail / size if size > 0.0 else inf
        pending[waiting] = middle
        waiting += 1
    return Panels(
        edges[: count + 1].copy(),
        times[: count + 1].copy(),
        lengths[: count + 1].copy(),
        time_terms[:count].copy(),
        length_terms[:count].copy(),
        error / times[count] + 2.3e-16 if times[count] > 0.0 else inf,
        smallest / largest if largest > 0.0 else 0.0,
        status,
    )


@Inner
def panel_of(edges, phi):  # type: ignore[no-untyped-def]
    """Return the index of the panel on which a phase angle lies."""
    return min(max(np.searchsorted(edges, phi, side="right") - 1, 0), edges.size - 2)


@Inner
def read_off(edges, marks, terms, phi):  # type: ignore[no-untyped-def]
    """Return the time (or the arc length) from the first edge to a phase angle.

    Parameters
    ----------
    edges : (n+1,) array
        Phase angles at the edges of the panels.
    marks : (n+1,) array
        Time (or arc length) at the edges.
    terms : (n, DEGREE) array
        Legendre coefficients on each panel.
    phi : float
        The phase angle.
    """
    k = panel_of(edges, phi)
    half = 0.5 * (edges[k + 1] - edges[k])
    return marks[k] + legendre_growth(terms[k], (phi - edges[k]) / half)


@Inner
def sum_block(edges, terms, phi, n, panels, work, out):  # type: ignore[no-untyped-def]
    """Fill ``out`` with the sums of the panels' Legendre series at n phase angles on known panels, in vector registers.

    ``work`` has three rows of n.
    """
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
        out[i] = terms[panels[i], 0] + x[i] * high[i] - 0.5 * low[i]


PANELS_TYPE = types.NamedTuple((VECTOR, VECTOR, VECTOR, MATRIX, MATRIX, REAL, REAL, types.int64), Panels)


@entry(PANELS_TYPE(ADDRESSES, VECTOR, types.int64, REAL, REAL, REAL, REAL, VECTOR), checked=False)
def lay_panels(fns, p, kind, a, b, ref, w0, marks):  # type: ignore[no-untyped-def]
    """Call `lay` from Python; the arguments are those of `Integrand`."""
    return lay(Integrand(fns, p, kind, a, b, ref, w0, np.empty((0, 0))), marks)


@entry(PANELS_TYPE(REAL, REAL, MATRIX, VECTOR))
def lay_along(a, b, field, marks):  # type: ignore[no-untyped-def]
    """Call `lay` from Python for a segment from ``a`` to an equilibrium ``b``, with V**2 from `equilibrium`."""
    return lay(Integrand(NO_FUNCTIONS, np.empty(0), TO_EQUILIBRIUM, a, b, a, 0.0, field), marks)


@entry(VECTOR(VECTOR, MATRIX, VECTOR))
def slopes(edges, terms, phi):  # type: ignore[no-untyped-def]
    """Return the derivatives with respect to phi of the panels' Legendre series at phase angles."""
    out, series = np.empty(phi.size), np.empty(terms.shape[1])
    for i in range(phi.size):
        k = panel_of(edges, phi[i])
        half = 0.5 * (edges[k + 1] - edges[k])
        derivative(terms[k], series)
        out[i] = legendre_sum(series, ((phi[i] - edges[k]) - half) / half) / half
    return out


@entry(VECTOR(VECTOR, VECTOR, MATRIX, VECTOR))
def read_off_many(edges, marks, terms, phi):  # type: ignore[no-untyped-def]
    """Evaluate `read_off` at many phase angles."""
    out = np.empty(phi.size)
    for i in range(phi.size):
        out[i] = read_off(edges, marks, terms, phi[i])
    return out


@Inner
def joints_between(joints, period, low, high):  # type: ignore[no-untyped-def]
    """Return the places strictly between ``low`` and ``high`` at which the curve is not smooth, in ascending order.

    ``joints`` are such places within one period; on a closed curve they are repeated with the period.
    """
    first, laps = 0.0, 1
    if joints.size == 0:
        return joints
    if period > 0.0:
        first = floor((low - joints[-1]) / period)
        laps = int(ceil((high - joints[0]) / period) - first) + 1
    found, count = np.empty(laps * joints.size), 0
    for lap in range(laps):
        for joint in joints:
            place = joint + (first + lap) * period
            if low < place < high:
                found[count] = place
                count += 1
    return found[:count]


@Inner
def orbit_panels(fns, p, kind, a, b, lam0, w0, joints):  # type: ignore[no-untyped-def]
    """Lay panels over half a period of a libration, a lap, or the way to an end of the curve, from joint to joint.

    All cases share one call of `lay`, because each call takes long to compile.

    Parameters
    ----------
    kind : int
        TURN_TURN, FROM_TURN, REGULAR, FROM_SLOW or FROM_SLOW_TURN (`substitution`).
    a, b : float
        The ends of the segment; a single turning point is ``a``.
    lam0, w0 : float
        The launch place, and V**2 there; not used by TURN_TURN and FROM_TURN segments (`Integrand`).
    joints : array
        The places inside the segment at which the curve is not smooth, in ascending order.
    """
    from_place, stop = kind in (REGULAR, FROM_SLOW, FROM_SLOW_TURN), pi if kind == TURN_TURN else 1.0
    ref, w = (lam0, w0) if from_place else (a, 0.0)
    marks = np.empty(joints.size + 2)
    marks[0], marks[-1] = 0.0, stop
    for i in range(joints.size):
        place = joints[i] if b > a else joints[joints.size - 1 - i]
        share = (place - a) / (b - a)
        marks[i + 1] = share if kind in (REGULAR, FROM_SLOW) else sqrt(share)
        if kind == TURN_TURN:
            marks[i + 1] = 2.0 * atan2(sqrt(place - a), sqrt(b - place))
    return lay(Integrand(fns, p, kind, a, b, ref, w, np.empty((0, 0))), marks)


@Inner
def are_accurate(panels):  # type: ignore[no-untyped-def]
    """Return whether the time by these panels is accurate to a few ulp."""
    return not (panels.status >= FLOOR or panels.cancellation < MIN_CANCELLATION_RATIO)


@Inner
def derivative(terms, out):  # type: ignore[no-untyped-def]
    """Fill ``out`` with the Legendre coefficients of the derivative of a Legendre series."""
    n = terms.size
    out[:] = 0.0
    for k in range(n - 1, 0, -1):
        out[k - 1] = (2 * k - 1) * (terms[k] + (out[k + 1] / (2 * k + 3) if k + 1 < n else 0.0))
