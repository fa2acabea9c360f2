"""The first place where V**2 vanishes in one direction from the launch, with proof that none is missed.

The curve is searched in steps from the launch. On each step, interval bounds of the slope of the effective potential
prove one of three things: V**2 stays away from zero, or it grows, or it falls throughout (then its sign at the far end
of the step decides). A step on which they prove none of these is halved. Bounds of ds find cusps in the same way
(MATHS, section 3).
"""

from math import fabs, inf, isfinite
from typing import NamedTuple

import numpy as np

from gqm_sym.runtime.compiled.calls import call_bounds, call_effective_potential, call_potential_divdiff1
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.types import Array

# The codes of what ends a search: a zero of V**2, the length to search, a place that doubles cannot decide, a cusp, the
# number of steps, a value that is not finite.
TURN, LIMIT, CRITICAL, CUSP, STEPS_SPENT, NOT_FINITE = range(6)
MAX_STEPS = 4096

# The limit of the parameter, as a multiple of its value at the launch; a larger parameter counts as infinite. Powers of
# a parameter this large still lie within the range of doubles.
MAX_PARAMETER = 1e50

# The value of V**2 above which a value that is not finite means overflow and not a pole.
OVERFLOW_V2 = 1e100

# V**2 counts as constant in doubles over a step if its possible change is below this share of the terms it consists of.
CONSTANT_SHARE = 1e-13

# The factor by which the terms of V**2 on a step may be larger than at the zero on the step and before it. It must
# cover larger terms inside the formulas, which are not known here: CONSTANT_SHARE allows for 450 roundings, so that
# divided differences may cancel to their last three or four digits. If it is too large, extended precision is used in
# vain.
TERMS_GROWTH = 1e3

# ds below this share of its largest value so far, on the narrowest step, is a cusp.
CUSP_SHARE = 1e-6

# V**2 has a pole on a narrow step on which its slope has no bound if it gains no less than the first share of what it
# gained before, each time that the distance is divided by the second number, beginning with the third times the width
# of the step. Near a logarithm these gains are equal; where only the slope is infinite, as for a root, they decrease.
POLE_GAIN, POLE_RATIO, POLE_BEGIN = 0.8, 256.0, 2.0**24

# Width of the narrowest step as a share of the parameter: a few units in the last place.
MIN_STEP_SHARE = 1e-15

# The largest number of steps to a zero. Halving the bracket needs 1,100 of them between the smallest and the largest
# double, and so many are taken only if a zero lies that near to the launch.
MAX_ZERO_STEPS = 2200

# Half-width of the surroundings of a zero that are searched for an equilibrium, as a share of the parameter.
MAX_ZERO_ERROR_SHARE = 1e-6


class FoundEnd(NamedTuple):
    """The result of a search.

    Attributes
    ----------
    what : int
        TURN (V**2 has its first zero at ``near``), LIMIT (searched as far as was asked), CUSP (ds vanishes at ``far``),
        CRITICAL (V**2 and its slope are too close to zero between ``near`` and ``far`` for doubles to decide),
        STEPS_SPENT (as many steps as are allowed were taken with V**2 > 0, up to ``near``, or numbers overflow beyond)
        or NOT_FINITE (a value is not finite near ``far``).
    near, far : float
        Signed offsets from the launch place.
    """

    what: int
    near: float
    far: float


class SearchArrays(NamedTuple):
    """The work arrays of a search.

    Attributes
    ----------
    point : (2,) array
        A place and its offset from the launch.
    rows : (2, 1) array
        The rows that the model's functions fill for one place.
    bounds : (4,) array
        Enclosures of the effective potential's slope and of ds.
    """

    point: Array
    rows: Array
    bounds: Array


@Inner
def speed_squared(fns, p, lam0, w0, offset, arrays):  # type: ignore[no-untyped-def]
    """Return V**2 at lam0 + offset, and the size of its terms, without subtracting potentials."""
    point, rows = arrays.point, arrays.rows
    point[0], point[1] = lam0 + offset, offset
    call_potential_divdiff1(fns.potential_divdiff1, 1, lam0, point[:1], point[1:], p, rows)
    lost = 2.0 * offset * rows[0, 0]
    return w0 - lost, w0 + fabs(lost)


@Inner
def polish_zero(fns, p, lam0, w0, lo, hi, arrays):  # type: ignore[no-untyped-def]
    """Return the zero of V**2 between offsets lo (V**2 > 0) and hi (V**2 < 0), by Newton's method kept inside the
    bracket.
    """
    point, rows = arrays.point, arrays.rows
    x, moved = 0.5 * (lo + hi), fabs(hi - lo)
    for _ in range(MAX_ZERO_STEPS):
        value, _size = speed_squared(fns, p, lam0, w0, x, arrays)
        if value == 0.0:
            return x
        if value > 0.0:
            lo = x
        else:
            hi = x
        point[0] = lam0 + x
        call_effective_potential(fns.effective_potential, 1, point, p, rows)
        slope = -2.0 * rows[1, 0]
        new = x - value / slope if slope != 0.0 else inf
        # On an exponential wall the steps are all equal. Halving the bracket is faster than steps that shrink less.
        if not (min(lo, hi) < new < max(lo, hi)) or fabs(new - x) > 0.5 * moved:
            new = 0.5 * (lo + hi)
        if new == x or new == lo or new == hi or fabs(new - x) <= 1e-16 * fabs(new):
            return new
        x, moved = new, fabs(new - x)
    return x


@Inner
def zero_on_step(fns, p, lam0, w0, near, far, sizes, arrays):  # type: ignore[no-untyped-def]
    """Return the zero of V**2 on a step on which it decreases throughout, as TURN; CRITICAL next to an equilibrium.

    ``near`` and ``far`` are the signed offsets of the ends of the step, and ``sizes`` those of the terms of V**2 up to
    the end of the step, and up to its beginning.
    """
    point, rows, bounds = arrays
    direction = 1.0 if far > near else -1.0
    root = polish_zero(fns, p, lam0, w0, near, far, arrays)
    # At the far end of the step the terms of V**2 may be arbitrarily large, as next to a pole. At the zero itself they
    # may all vanish, so those before it count too.
    terms = max(sizes[1], speed_squared(fns, p, lam0, w0, root, arrays)[1])
    terms = max(terms, speed_squared(fns, p, lam0, w0, 0.5 * (near + root), arrays)[1])
    size = min(sizes[0], TERMS_GROWTH * terms)
    # The distance by which rounding may move the zero; if an equilibrium is that close, doubles cannot decide.
    point[0] = lam0 + root
    call_effective_potential(fns.effective_potential, 1, point, p, rows)
    largest = max(fabs(far) - fabs(near), MAX_ZERO_ERROR_SHARE * (fabs(lam0) + fabs(root)))
    slope = 2.0 * fabs(rows[1, 0])
    error = min(CONSTANT_SHARE * size / slope, largest) if slope > 0.0 else largest
    call_bounds(fns.bounds, lam0 + root - error, lam0 + root + error, p, bounds)
    if bounds[0] <= 0.0 <= bounds[1]:
        return FoundEnd(CRITICAL, near, root + direction * error)
    return FoundEnd(TURN, root, far)


@Inner
def stays_positive(lower, upper, width, narrow, v2_near, v2_far, size):  # type: ignore[no-untyped-def]
    """Decide whether V**2 > 0 on a whole step, from bounds on its slope and its values at both ends.

    The result is 1 if it is, 0 if the step must be halved for a decision, and -1 if doubles cannot decide.
    """
    least = max(v2_near + lower * width, v2_far - upper * width)
    if upper <= 0.0 or least > CONSTANT_SHARE * size:
        return 1
    change = max(fabs(lower), fabs(upper)) * width
    if narrow or change <= CONSTANT_SHARE * size:
        return 1 if min(v2_near, v2_far) > 10.0 * CONSTANT_SHARE * size else -1
    return 0


@Inner
def is_pole(fns, p, lam0, w0, near, far, arrays):  # type: ignore[no-untyped-def]
    """Return whether V**2 becomes infinite on a narrow step, given the signed offsets of its ends, on which its slope
    has no bound.
    """
    width = POLE_BEGIN * (far - near)
    before, _size = speed_squared(fns, p, lam0, w0, near - width, arrays)
    gained = 0.0
    for _ in range(3):
        width /= POLE_RATIO
        v2, _size = speed_squared(fns, p, lam0, w0, near - width, arrays)
        if not v2 - before > POLE_GAIN * gained:
            return False
        before, gained = v2, v2 - before
    return True


@Inner
def without_length(near, far, ds_high, last_ds, widest_ds):  # type: ignore[no-untyped-def]
    """Return what ends a search at a step on which ds > 0 cannot be proved.

    ``ds_high`` is an upper bound of ds on the step, ``last_ds`` its value at the beginning, and ``widest_ds`` the
    largest value so far.
    """
    if isfinite(ds_high):
        return FoundEnd(CUSP if ds_high <= CUSP_SHARE * widest_ds else NOT_FINITE, near, far)
    if last_ds <= CUSP_SHARE * widest_ds < inf:
        return FoundEnd(CUSP, near, far)
    return FoundEnd(STEPS_SPENT, near, near)  # terms of a formula overflow


@Inner
def first_zero(fns, p, lam0, w0, direction, begin, length, step):  # type: ignore[no-untyped-def]
    """Search from lam0 + direction * begin to lam0 + direction * length, beginning with a step of ``step``.

    Parameters
    ----------
    lam0, w0 : float
        The launch place, and V**2 there.
    begin, length : float
        Distances from the launch place; the second may be infinite.

    Returns
    -------
    FoundEnd
        The first end that was found.
    """
    arrays = SearchArrays(np.empty(2), np.empty((2, 1)), np.empty(4))
    bounds = arrays.bounds
    near, v2_near = begin, w0
    if begin > 0.0:
        v2_near, _size = speed_squared(fns, p, lam0, w0, direction * begin, arrays)
    widest_ds, last_ds, size, passed = 0.0, 0.0, w0, w0
    for _ in range(MAX_STEPS):
        if near >= length:
            return FoundEnd(LIMIT, direction * length, direction * length)
        far = min(near + step, length)
        if far > MAX_PARAMETER * max(1.0, fabs(lam0)):
            return FoundEnd(STEPS_SPENT, direction * near, direction * near)
        width = far - near
        narrow = width <= MIN_STEP_SHARE * max(fabs(lam0), far)
        here, there = lam0 + direction * near, lam0 + direction * far
        call_bounds(fns.bounds, min(here, there), max(here, there), p, bounds)
        # Bounds of the change of V**2 per unit of distance: -2*dU/dlam going forwards, 2*dU/dlam going back.
        lower, upper = (-2.0 * bounds[1], -2.0 * bounds[0]) if direction > 0 else (2.0 * bounds[0], 2.0 * bounds[1])
        ds_low, ds_high = bounds[2], bounds[3]
        if ds_low <= 0.0:
            if narrow:
                return without_length(direction * near, direction * far, ds_high, last_ds, widest_ds)
            step = 0.5 * width
            continue
        v2_far, terms = speed_squared(fns, p, lam0, w0, direction * far, arrays)
        far_ds = arrays.rows[1, 0]
        widest_ds = max(widest_ds, far_ds)
        if not (isfinite(v2_far) and isfinite(upper - lower)):  # there may be a pole on the step
            if not isfinite(v2_far) and v2_near > OVERFLOW_V2:
                return FoundEnd(STEPS_SPENT, direction * near, direction * near)
            if not narrow:
                step = 0.5 * width
                continue
            if not isfinite(v2_far) or is_pole(fns, p, lam0, w0, direction * near, direction * far, arrays):
                return FoundEnd(NOT_FINITE, direction * near, direction * far)
        reached = max(size, terms)
        positive = 1
        if not lower >= 0.0:
            if upper <= 0.0 and v2_far <= 0.0:
                return zero_on_step(fns, p, lam0, w0, direction * near, direction * far, (reached, passed), arrays)
            positive = stays_positive(lower, upper, width, narrow, v2_near, v2_far, reached)
        if positive < 0:
            return FoundEnd(CRITICAL, direction * near, direction * far)
        if positive:
            # What V**2 consists of beyond a step that is halved says nothing about its rounding before.
            near, v2_near, last_ds, size, passed = far, v2_far, far_ds, reached, max(passed, terms)
            step = 2.0 * width
        else:
            step = 0.5 * width
    return FoundEnd(STEPS_SPENT, direction * near, direction * near)
