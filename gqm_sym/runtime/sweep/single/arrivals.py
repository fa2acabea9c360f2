"""The first time at a place on one of many orbits, by a sine series in the phase angle or by panels."""

from math import atan2, cos, fabs, inf, pi, sin, sqrt

import numpy as np

from gqm_sym.runtime.arithmetic.matrices import multiply
from gqm_sym.runtime.compiled.calls import call_effective_potential, call_potential_divdiff1, call_potential_divdiff2
from gqm_sym.runtime.compiled.intrinsics import fma
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.quadrature.substitution import FROM_TURN, REGULAR, TURN_TURN
from gqm_sym.runtime.quadrature.time_panels import (
    MIN_CANCELLATION_RATIO,
    are_accurate,
    joints_between,
    orbit_panels,
    read_off,
)
from gqm_sym.runtime.sweep.orbit import Orbit

# The numbers of terms of the series that are tried in turn.
FEW_TERMS, MORE_TERMS, MAX_TERMS = 32, 64, 128

# Where the rates at the nodes so far begin in the work space, behind the four rows of a call.
KEPT = 4 * (MAX_TERMS + 1)

# The number of last coefficients that must be small, and their largest ratio to the first. Integration divides each
# coefficient by its index, so that their share of the time is even smaller.
TAIL_LENGTH, TAIL_RATIO = 4, 1e-14

# The width of a segment to an end of the curve, as a share of the segment's ends, below which their rounding spoils
# times.
MIN_WIDTH_SHARE = 2.0**-5

# The share of an orbit's width within which a turning point counts as near the launch.
NEAR_LAUNCH = 1e-3


def _cosines(n: int) -> np.ndarray:
    """Return the matrix that maps values at n + 1 equal steps over [0, pi] to coefficients of cosines, a row for each
    node.
    """
    steps = np.outer(np.arange(n + 1), np.arange(n + 1)) % (2 * n)
    matrix = np.array([cos(pi * m / n) for m in range(2 * n)])[steps] * (2.0 / n)
    matrix[[0, n]] *= 0.5
    matrix[:, [0, n]] *= 0.5
    return matrix


few_cosines, more_cosines = multiply(_cosines(FEW_TERMS)), multiply(_cosines(MORE_TERMS))
most_cosines = multiply(_cosines(MAX_TERMS))

# The distances of the nodes from the lower end, as shares of the width; from the upper end they are the same reversed.
WIDTH_SHARES = np.sin(0.5 * pi * np.arange(MAX_TERMS + 1) / MAX_TERMS) ** 2


@Inner
def fill_cosine_series(n, values, series):  # type: ignore[no-untyped-def]
    """Fill the cosine series of n terms with given values at n + 1 equal steps over [0, pi]."""
    if n == FEW_TERMS:
        few_cosines(values, 0, series, 0)
    elif n == MORE_TERMS:
        more_cosines(values, 0, series, 0)
    else:
        most_cosines(values, 0, series, 0)


@Inner
def is_resolved(series, n):  # type: ignore[no-untyped-def]
    """Return whether the last coefficients of a series are small."""
    tail = 0.0
    for k in range(n - TAIL_LENGTH, n + 1):
        tail = max(tail, fabs(series[k]))
    return tail <= TAIL_RATIO * series[0]


@Inner
def fill_time_rate_series(fns, p, ends, n, factors, work, series):  # type: ignore[no-untyped-def]
    """Fill the cosine series of dt/dphi over [0, pi].

    ``ends`` are both ends of the orbit and its width. If n is more than FEW_TERMS, the series of half as many terms has
    been filled before: its nodes are every other one of these, and their rates are in ``work``.

    Returns
    -------
    resolved : bool
        Whether the series is resolved and V**2 is far from vanishing.
    factors : (float, float)
        The smallest and the largest regular factor of V**2 at all nodes so far, given that of the series before.
    """
    (a, b, width), (low, high), step = ends, factors, MAX_TERMS // n
    first, every, m = (0, step, n + 1) if n == FEW_TERMS else (step, 2 * step, n // 2)
    da, db, rows, rates = work[:m], work[m : 2 * m], work[2 * m : 4 * m], work[KEPT : KEPT + MAX_TERMS + 1]
    for j in range(m):
        node = first + j * every
        da[j], db[j] = width * WIDTH_SHARES[node], width * WIDTH_SHARES[MAX_TERMS - node]
    call_potential_divdiff2(fns.potential_divdiff2, m, a, b, da, db, p, rows)
    for j in range(m):
        q = rows[j]
        low, high = min(low, q), max(high, q)
        rates[first + j * every] = rows[m + j] / sqrt(2.0 * q)
    for j in range(n + 1):
        work[j] = rates[j * step]
    fill_cosine_series(n, work, series)
    return is_resolved(series, n) and low > MIN_CANCELLATION_RATIO * high, (low, high)


@Inner
def times_from(series, n, phi, psi, flip):  # type: ignore[no-untyped-def]
    """Return the times from an end to two phase angles; ``flip`` is 1 for the lower end and -1 for the upper one.

    They are the integral of a cosine series, summed by Clenshaw's recurrence for sines. Both sums are computed at the
    same time, because each step of one has to wait for the step before.
    """
    two_cos_phi, two_cos_psi, sign = 2.0 * cos(phi), 2.0 * cos(psi), flip if n % 2 else 1.0
    phi_sum, phi_before, psi_sum, psi_before = 0.0, 0.0, 0.0, 0.0
    for k in range(n, 0, -1):
        term = sign * series[k] / k
        phi_sum, phi_before = fma(two_cos_phi, phi_sum, term - phi_before), phi_sum
        psi_sum, psi_before = fma(two_cos_psi, psi_sum, term - psi_before), psi_sum
        sign *= flip
    return series[0] * phi + phi_sum * sin(phi), series[0] * psi + psi_sum * sin(psi)


@Inner
def refined_end(fns, p, orbit, end, work):  # type: ignore[no-untyped-def]
    """Return the offset of a turning point from the launch, accurate to all digits.

    The offset of a turning point near the launch may be known only as a rounded sum; it is improved by one step of
    Newton's method.
    """
    width = orbit.high - orbit.low
    if orbit.v2 == 0.0 or fabs(end) > NEAR_LAUNCH * width:
        return end
    place, offset, rows = work[:1], work[1:2], work[2:4]
    place[0], offset[0] = orbit.lam0 + end, end
    call_potential_divdiff1(fns.potential_divdiff1, 1, orbit.lam0, place, offset, p, rows)
    v2 = orbit.v2 - 2.0 * end * rows[0]
    call_effective_potential(fns.effective_potential, 1, place, p, rows)
    better = end + v2 / (2.0 * rows[1])
    return better if better * end >= 0.0 and fabs(better) <= NEAR_LAUNCH * width else end


@Inner
def with_refined_ends(curve, orbit, work):  # type: ignore[no-untyped-def]
    """Return a libration with turning points that are accurate to all digits (`refined_end`)."""
    low = refined_end(curve.fns, curve.p, orbit, orbit.low, work)
    high = refined_end(curve.fns, curve.p, orbit, orbit.high, work)
    return Orbit(False, orbit.even, orbit.direction, orbit.lam0, orbit.v2, low, high, 0)


@Inner
def phase_of(below, above):  # type: ignore[no-untyped-def]
    """Return the phase angle of a place, given its distances from the lower and the upper end."""
    return 2.0 * atan2(sqrt(below), sqrt(above))


@Inner
def times_by_series(series, n, low, high, ahead):  # type: ignore[no-untyped-def]
    """Return what `times_from_end` does, by a series that is resolved; ``low`` and ``high`` are the orbit's offsets."""
    from_upper = -low > high
    near, far = (high, -low) if from_upper else (-low, high)
    to_near, to_far = (high - ahead, ahead - low) if from_upper else (ahead - low, high - ahead)
    launch, target = phase_of(near, far), phase_of(max(to_near, 0.0), max(to_far, 0.0))
    start, stop = times_from(series, n, launch, target, -1.0 if from_upper else 1.0)
    return series[0] * pi, start, stop, from_upper


@Inner
def first_passage(times, direction, ahead):  # type: ignore[no-untyped-def]
    """Return the first time at the offset ``ahead``, from what `times_from_end` gives and the direction at launch."""
    half_period, start, stop, from_upper = times
    onwards = direction * ahead > 0.0
    if (direction > 0) == from_upper:  # the body is launched towards that end
        return start - stop if onwards else start + stop
    return stop - start if onwards else (half_period - start) + (half_period - stop)


@Inner
def arrival_on_lap(curve, orbit, ahead):  # type: ignore[no-untyped-def]
    """Return the time at which a body on a closed curve has moved by the offset ``ahead``, in the form of `arrival`."""
    lap = orbit.direction * (orbit.high - orbit.low)
    laps = np.floor(ahead / lap)
    if laps < 0.0:
        return inf
    end = orbit.lam0 + lap
    joints = joints_between(curve.joints, curve.period, min(orbit.lam0, end), max(orbit.lam0, end))
    panels = orbit_panels(curve.fns, curve.p, REGULAR, orbit.lam0, end, orbit.lam0, orbit.v2, joints)
    if not are_accurate(panels):
        return np.nan
    return laps * panels.times[-1] + read_off(panels.edges, panels.times, panels.time_terms, ahead / lap - laps)


@Inner
def times_from_end(curve, orbit, width, ahead, work, series):  # type: ignore[no-untyped-def]
    """Return the times from one end of a libration to the launch and to the offset ``ahead``.

    The end is the one nearer to the launch, so that times are accurate to all digits for a launch close to it.

    Returns
    -------
    half_period, start, stop : float
        Times in seconds; NaN if they are left to the exact problem.
    from_upper : bool
        Whether the end is the upper one.
    """
    low, high, a, b = orbit.low, orbit.high, orbit.lam0 + orbit.low, orbit.lam0 + orbit.high
    joints = joints_between(curve.joints, curve.period, a, b)
    n, resolved, factors = FEW_TERMS // 2 if joints.size == 0 else MAX_TERMS, False, (inf, 0.0)
    while n < MAX_TERMS and not resolved:
        n *= 2
        resolved, factors = fill_time_rate_series(curve.fns, curve.p, (a, b, width), n, factors, work, series)
    if resolved:
        return times_by_series(series, n, low, high, ahead)
    from_upper = -low > high
    panels = orbit_panels(curve.fns, curve.p, TURN_TURN, a, b, orbit.lam0, orbit.v2, joints)
    if not are_accurate(panels):
        return np.nan, np.nan, np.nan, from_upper
    half_period = panels.times[-1]
    start = read_off(panels.edges, panels.times, panels.time_terms, phase_of(-low, high))
    target = phase_of(max(ahead - low, 0.0), max(high - ahead, 0.0))
    stop = read_off(panels.edges, panels.times, panels.time_terms, target)
    if from_upper:
        start, stop = half_period - start, half_period - stop
    return half_period, start, stop, from_upper


@Inner
def arrival_on_way_out(curve, orbit, ahead, work):  # type: ignore[no-untyped-def]
    """Return the time to the offset ``ahead``, or if that is NaN to the end, for a body that leaves the curve, in the
    form of `arrival`.
    """
    end, turn = (orbit.high, orbit.low) if orbit.leaves > 0 else (orbit.low, orbit.high)
    turns = orbit.v2 == 0.0 or orbit.leaves != orbit.direction
    turn = refined_end(curve.fns, curve.p, orbit, turn, work) if turns else 0.0
    width, far = end - turn, ahead if ahead == ahead else end
    share = (far - turn) / width
    if not 0.0 <= share <= 1.0:
        return inf
    a, b = orbit.lam0 + turn, orbit.lam0 + end
    if fabs(width) < MIN_WIDTH_SHARE * max(fabs(a), fabs(b)):
        return np.nan
    joints = joints_between(curve.joints, curve.period, min(a, b), max(a, b))
    panels = orbit_panels(curve.fns, curve.p, FROM_TURN if turns else REGULAR, a, b, orbit.lam0, orbit.v2, joints)
    if not are_accurate(panels):
        return np.nan
    edges, times, terms = panels.edges, panels.times, panels.time_terms
    time = panels.times[-1] if far == end else read_off(edges, times, terms, sqrt(share) if turns else share)
    if not turns or orbit.v2 == 0.0:
        return time
    before = read_off(edges, times, terms, sqrt(-turn / width))
    return before - time if orbit.direction * far > 0.0 else before + time


@Inner
def arrival(curve, orbit, place, work, series):  # type: ignore[no-untyped-def]
    """Return the first time at which the body is at ``place``; NaN if this is left to the exact problem, inf if it
    never is.

    If ``place`` is NaN, return the time at which a body that leaves the curve reaches its end.
    """
    ahead = place - orbit.lam0
    if ahead == 0.0:
        return 0.0
    if orbit.leaves != 0:
        return arrival_on_way_out(curve, orbit, ahead, work)
    if orbit.circulates:
        return arrival_on_lap(curve, orbit, ahead)
    orbit, width = with_refined_ends(curve, orbit, work), orbit.high - orbit.low
    if not orbit.lam0 + orbit.low <= place <= orbit.lam0 + orbit.high:
        return inf
    times = times_from_end(curve, orbit, width, ahead, work, series)
    return first_passage(times, orbit.direction, ahead)
