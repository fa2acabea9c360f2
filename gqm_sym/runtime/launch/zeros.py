"""The first place where V**2 vanishes, each way from the launch, none missed.

The curve is walked in steps from the launch. On each step interval bounds of the climb's slope prove one of three
things: V**2 keeps away from zero, or it grows, or it falls throughout (then its sign at the far end decides). What
they cannot prove is halved. Bounds of ds find cusps the same way (MATHS, section 3).
"""

from math import fabs, inf, isfinite

import numpy as np

from gqm_sym.runtime.compiled.calls import call_bounds, call_effective_potential, call_potential_divdiff1
from gqm_sym.runtime.compiled.jit import Inner

# What ended a walk.
TURN, LIMIT, CRITICAL, CUSP, MARCHED, BROKEN = range(6)
MOST_STEPS = 4096

# As good as infinity: powers of a parameter this large still lie within the range of doubles.
FARTHEST = 1e50

# V**2 beyond which a value that is not finite means overflow, not a pole.
OVERFLOWING = 1e100

# V**2 whose possible change over a step is this small against its parts is as good as constant in doubles.
UNRESOLVED = 1e-13

# ds below this share of its largest value so far, on the narrowest step, is a cusp.
CUSP_SHARE = 1e-6

# A step of a few units in the last place of the parameter.
NARROW = 1e-15


@Inner
def speed_squared(fns, p, lam0, w0, offset, spot, rows):  # type: ignore[no-untyped-def]
    """V**2 at lam0 + offset, and the size of its parts, without subtracting heights."""
    spot[0], spot[1] = lam0 + offset, offset
    call_potential_divdiff1(fns.potential_divdiff1, 1, lam0, spot[:1], spot[1:], p, rows)
    lost = offset * rows[0, 0]
    return w0 - lost, w0 + fabs(lost)


@Inner
def polish_zero(fns, p, lam0, w0, lo, hi, spot, rows):  # type: ignore[no-untyped-def]
    """The zero of V**2 between offsets lo (V**2 > 0) and hi (V**2 < 0), by Newton's method kept inside the bracket."""
    x = 0.5 * (lo + hi)
    for _ in range(200):
        value, _size = speed_squared(fns, p, lam0, w0, x, spot, rows)
        if value == 0.0:
            return x
        if value > 0.0:
            lo = x
        else:
            hi = x
        spot[0] = lam0 + x
        call_effective_potential(fns.effective_potential, 1, spot, p, rows)
        slope = -rows[1, 0]
        new = x - value / slope if slope != 0.0 else inf
        if not (min(lo, hi) < new < max(lo, hi)):
            new = 0.5 * (lo + hi)
        if new == x or new == lo or new == hi or fabs(new - x) <= 1e-16 * fabs(new):
            return new
        x = new
    return x


@Inner
def first_zero(fns, p, lam0, w0, direction, begin, reach, step):  # type: ignore[no-untyped-def]
    """Walk from lam0 + direction * begin to ``reach`` (may be infinite) from lam0, beginning with steps of ``step``.

    Returns
    -------
    what : int
        TURN (V**2 has its first zero at ``near``), LIMIT (walked all of ``reach``), CUSP (ds vanishes at ``far``),
        CRITICAL (V**2 and its slope are too close to zero between ``near`` and ``far`` for doubles to decide), MARCHED
        (steps spent with V**2 > 0 up to ``near``) or BROKEN (a value that is not a number near ``far``).
    near, far : float
        Offsets from lam0, signed.
    """
    spot, rows, box = np.empty(2), np.empty((2, 1)), np.empty(4)
    left, w_left = begin, w0
    if begin > 0.0:
        w_left, _size = speed_squared(fns, p, lam0, w0, direction * begin, spot, rows)
    widest_ds, size = 0.0, w0
    for _ in range(MOST_STEPS):
        if left >= reach:
            return LIMIT, direction * reach, direction * reach
        right = min(left + step, reach)
        if right > FARTHEST * max(1.0, fabs(lam0)):
            return MARCHED, direction * left, direction * left
        narrow = right - left <= NARROW * max(fabs(lam0), right)
        here, there = lam0 + direction * left, lam0 + direction * right
        call_bounds(fns.bounds, min(here, there), max(here, there), p, box)
        # Change of V**2 per unit of offset: its climb is lost going forward, gained going back.
        lower, upper = (-box[1], -box[0]) if direction > 0 else (box[0], box[1])
        if box[2] <= 0.0:
            if narrow:
                if box[3] <= CUSP_SHARE * widest_ds or not isfinite(box[3]):
                    return CUSP, direction * left, direction * right
                return BROKEN, direction * left, direction * right
            step = 0.5 * (right - left)
            continue
        w_right, parts = speed_squared(fns, p, lam0, w0, direction * right, spot, rows)
        widest_ds = max(widest_ds, rows[1, 0])
        width = right - left
        if not isfinite(w_right):
            if w_left > OVERFLOWING:
                return MARCHED, direction * left, direction * left
            if narrow:
                return BROKEN, direction * left, direction * right
            step = 0.5 * width
            continue
        size = max(size, parts)
        clear = lower >= 0.0
        if not clear:
            if upper <= 0.0 and w_right <= 0.0:
                root = polish_zero(fns, p, lam0, w0, direction * left, direction * right, spot, rows)
                # What doubles know of the root: an equilibrium that close makes it another matter.
                spot[0] = lam0 + root
                call_effective_potential(fns.effective_potential, 1, spot, p, rows)
                farthest = max(width, 1e-6 * (fabs(lam0) + fabs(root)))
                slope = fabs(rows[1, 0])
                unsure = min(UNRESOLVED * size / slope, farthest) if slope > 0.0 else farthest
                call_bounds(fns.bounds, lam0 + root - unsure, lam0 + root + unsure, p, box)
                if box[0] <= 0.0 <= box[1]:
                    return CRITICAL, direction * left, root + direction * unsure
                return TURN, root, direction * right
            # The least V**2 can be, from either end of the step.
            least = max(w_left + lower * width, w_right - upper * width)
            clear = upper <= 0.0 or least > UNRESOLVED * size
            change = max(fabs(lower), fabs(upper)) * width
            if not clear and (narrow or change <= UNRESOLVED * size):
                if min(w_left, w_right) > 10.0 * UNRESOLVED * size:
                    clear = True
                else:
                    return CRITICAL, direction * left, direction * right
        if clear:
            left, w_left = right, w_right
            step = 2.0 * width
        else:
            step = 0.5 * width
    return MARCHED, direction * left, direction * left
