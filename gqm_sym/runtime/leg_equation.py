"""V**2 on one panel of a leg, from one linear equation (MATHS, section 2).

On a leg ``dW/dlam = P - Q W``. The distance run from the leg's *origin*, where it was begun, is ``d = w (g w + c)``
with w the *march variable*: g is 0 and c is 1 where nothing is special; from a turning point g is 1 and c is 0, so that
W/w**2 and the pace of time are smooth; after a slow launch with W = W0, W' > 0, g is 1 and c is 2 sqrt(W0/W') (MATHS,
section 2). With ``h = g (w + c/2) + 1 - g`` the speed is h Y and ``dt/dw = (1 + g) ds/Y``, Y smooth.

With q the integral of Q from the panel's start, where W is ``base``, ``W = exp(-q) (base + integral of exp(q) P)``.
Integrals come from running means, so that nothing is subtracted however short they are: W has all its digits at a
turning point too.
"""

from math import fabs, factorial, inf, sqrt

from gqm_sym.runtime.chebyshev import (
    COUNT,
    ENDS_BY_NODE,
    GRADED_BY_NODE,
    MEANS_BY_NODE,
    WIDE,
    extent,
    to_ends,
)
from gqm_sym.runtime.crossing import call_drive
from gqm_sym.runtime.fused import fma, polynomial
from gqm_sym.runtime.jit import Inner

# V**2 over a panel may not change by more than this factor's logarithm through resistance alone.
STEEPEST = 2.0
# exp(q) - 1 is summed to rounding below this; beyond, by doubling.
SUMMED = 0.25
SWELLING = tuple(1.0 / factorial(k) for k in range(13, 1, -1))
MOST_ROUNDS = 40
# A distance beyond any other: no number would be left of an infinite one.
FARTHEST = 1e300
# Rows of a panel's values, all over the panel's nodes; those before JUDGED may be judged, W and what follows holds the
# panel's end as well. BARE is what W is made of: W over the distance from a turning point, be it one behind a slow
# launch; W itself elsewhere.
DS, PULL, FORCE, BARE, LOAD, PACE, JUDGED = *range(6), 6
W, D, SWELL, MEAN, GRADED, SPEED, ARC, PLACE = range(6, 14)
ROWS = 14


@Inner
def distance(w, g, c):  # type: ignore[no-untyped-def]
    """The distance from the origin."""
    return w * (g * w + c)


@Inner
def marched(d, g, c):  # type: ignore[no-untyped-def]
    """The march variable at a distance from the origin."""
    d = min(d, FARTHEST)
    return 2.0 * d / (c + sqrt(c * c + 4.0 * g * d)) if d > 0.0 else 0.0


@Inner
def grow(work, q, out):  # type: ignore[no-untyped-def]
    """Fill row ``out`` with exp - 1 of row ``q``, side by side."""
    low, high = extent(work, q * WIDE)
    scale, doublings = 1.0, 0
    while max(-low, high, fabs(work[q, COUNT])) * scale > SUMMED:
        scale, doublings = 0.5 * scale, doublings + 1
    for j in range(WIDE):
        x = work[q, j] * scale
        work[out, j] = fma(polynomial(SWELLING, x) * x, x, x)
    for _ in range(doublings):
        for j in range(WIDE):
            work[out, j] *= work[out, j] + 2.0


@Inner
def begin_panel(drive, p, linear, origin, u, g, c, left, width, base, v, nu, rows, work):  # type: ignore[no-untyped-def]
    """Lay out a panel from w = ``left`` on, run towards growing (u = 1) or falling (u = -1) parameters.

    Where forces are linear in V**2, fills ``rows`` by ``drive``, and DS and PULL of ``work``.
    """
    near = 2.0 * g * left + c
    begin = origin + u * distance(left, g, c)
    for j in range(WIDE):
        y = width * ENDS_BY_NODE[j]
        work[PLACE, j] = y
        work[D, j] = y * (near + g * y)
        work[ARC, j] = begin + u * work[D, j]
        work[W, j] = base
    if linear:
        sample(drive, p, u, g, near, v, nu, rows, work)


@Inner
def sample(drive, p, u, g, near, v, nu, rows, work):  # type: ignore[no-untyped-def]
    """Fill ``rows`` by ``drive``, and DS and PULL, at the panel's places for V**2 as it is taken to be there.

    At its end too, which fills the registers; there they may not be numbers.
    """
    call_drive(drive, WIDE, work[ARC], work[W], float(v), float(nu), p, rows)
    for j in range(WIDE):
        work[DS, j] = rows[0, j]
        work[PULL, j] = u * rows[2, j] * (near + 2.0 * g * work[PLACE, j])


@Inner
def solve_panel(drive, p, linear, u, g, c, left, base, v, nu, rows, work):  # type: ignore[no-untyped-def]
    """W on a panel that was begun (`begin_panel`).

    Fills all of ``work`` that does not ask for W > 0. Returns q over the panel, inf where it is too wide for an answer.
    """
    near = 2.0 * g * left + c
    if not linear:  # Newton's method begins with what W does at once; laws may ask for its root
        work[W, 0] = max(base, 1e-300)
        call_drive(drive, 1, work[ARC], work[W], float(v), float(nu), p, rows)
        rise = max(u * (rows.flat[1] - rows.flat[2] * work[W, 0]), 0.0)
        for j in range(WIDE):
            work[W, j] = base + rise * work[D, j]
    stop, settled = inf, linear
    for _ in range(1 if linear else MOST_ROUNDS):
        if not linear:
            sample(drive, p, u, g, near, v, nu, rows, work)
        to_ends(MEANS_BY_NODE, work, PULL * WIDE, work, SPEED * WIDE)
        for j in range(WIDE):
            work[SPEED, j] *= work[PLACE, j]
        far = work[SPEED, COUNT]
        if not fabs(far) <= STEEPEST:
            return inf
        grow(work, SPEED, SWELL)
        for j in range(WIDE):
            work[FORCE, j] = u * rows[1, j] * (1.0 + work[SWELL, j])
        # The integral over the distance: means, and where the march is graded those with the weight y.
        to_ends(MEANS_BY_NODE, work, FORCE * WIDE, work, MEAN * WIDE)
        if g > 0.0:
            to_ends(GRADED_BY_NODE, work, FORCE * WIDE, work, GRADED * WIDE)
            for j in range(WIDE):
                y = work[PLACE, j]
                work[SPEED, j] = y * (near * work[MEAN, j] + y * work[GRADED, j])
        else:
            for j in range(WIDE):
                work[SPEED, j] = work[PLACE, j] * work[MEAN, j]
        for j in range(WIDE):
            work[SPEED, j] = base + (work[SPEED, j] - base * work[SWELL, j]) / (1.0 + work[SWELL, j])
        moved, size = 0.0, 0.0
        if not linear:
            for j in range(WIDE):
                moved, size = max(moved, fabs(work[SPEED, j] - work[W, j])), max(size, fabs(work[SPEED, j]))
        for j in range(WIDE):
            work[W, j] = work[SPEED, j]
        if linear:
            break
        # Each round squares the miss, and the last ones only stir the rounding.
        if not moved < inf:
            return inf
        settled = moved <= 4e-16 * size or (moved <= 1e-13 * size and moved >= 0.5 * stop)
        if settled:
            break
        stop = moved
    if not settled:
        return inf
    if base == 0.0:
        for j in range(WIDE):
            kept = 1.0 + work[SWELL, j]
            work[BARE, j] = (work[GRADED, j] if g > 0.0 else work[MEAN, j]) / kept
    else:
        slow = g > 0.0 and left == 0.0
        for j in range(WIDE):
            h = work[PLACE, j] + 0.5 * c if slow else 1.0
            work[BARE, j] = work[W, j] / (h * h)
    for j in range(WIDE):
        work[LOAD, j] = rows[0, j] * (rows[3, j] + rows[4, j] * work[W, j])
    return far


@Inner
def as_bare(w, g, c, left):  # type: ignore[no-untyped-def]
    """A value of W in the units of BARE, at the start of a panel from w = ``left`` on."""
    return w / (0.25 * c * c) if g > 0.0 and left == 0.0 and c > 0.0 else w


@Inner
def pace(g, c, left, base, work):  # type: ignore[no-untyped-def]
    """Fill in Y, the pace of time and that of arc length: not numbers where W is not positive."""
    for j in range(WIDE):
        w = left + work[PLACE, j]
        h = g * (w + 0.5 * c) + (1.0 - g)
        bare = work[BARE, j] if base == 0.0 else work[W, j] / (h * h)
        work[SPEED, j] = sqrt(bare)
        work[PACE, j] = (1.0 + g) * work[DS, j] / work[SPEED, j]
        work[ARC, j] = work[DS, j] * (2.0 * g * w + c)
