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

import numpy as np

from gqm_sym.runtime.compiled.calls import call_speed_equation
from gqm_sym.runtime.compiled.intrinsics import fma, polynomial
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import on_stack, over_rows
from gqm_sym.runtime.legs.leg_breaks import within
from gqm_sym.runtime.legs.polynomials import COUNT, ENDS_BY_NODE, WIDE, size_of, to_graded_means, to_means

# V**2 over a panel may not change by more than this factor's logarithm through resistance alone.
STEEPEST = 2.0

# exp(q) - 1 is summed to rounding below this; beyond, by doubling.
SUMMED = 0.25
SWELLING = tuple(1.0 / factorial(k) for k in range(13, 1, -1))
MOST_ROUNDS = 40

# A distance beyond any other: no number would be left of an infinite one.
FARTHEST = 1e300

# Where the rows of a panel's values begin in one line of numbers. Each has the values at the nodes, and one at the
# panel's end that is a value only where a row holds the end as well: W, those that follow it, and what ``drive`` gives.
# Those before P may be judged. BARE is what W is made of: W over the distance from a turning point, be it one behind a
# slow launch; W itself elsewhere. Behind the rows of values are those of what is told from them.
PACE, LOAD, BARE, FORCE, PULL, DS, P, Q, N0, KAPPA = range(0, 10 * WIDE, WIDE)
W, D, SWELL, MEAN, GRADED, SPEED, ARC, PLACE, SERIES, SIZES, TAILS, NODES = range(10 * WIDE, 22 * WIDE, WIDE)
panel_room = on_stack(22 * WIDE)

# Rows of a panel by those before; y is the march variable from the panel's start, where it grows with ``near``.
same = over_rows(lambda row: row, WIDE)
product = over_rows(lambda one, other: one * other, WIDE)
away = over_rows(lambda y, near, g: y * (near + g * y), WIDE)
place = over_rows(lambda d, begin, u: begin + u * d, WIDE)
pull = over_rows(lambda q, y, near, g, u: u * q * (near + 2.0 * g * y), WIDE)
swelled_force = over_rows(lambda p, swell, u: u * p * (1.0 + swell), WIDE)
swelled = over_rows(lambda gained, swell, base: base + (gained - base * swell) / (1.0 + swell), WIDE)
graded_gain = over_rows(lambda y, mean, graded, near: y * (near * mean + y * graded), WIDE)
shrunk = over_rows(lambda mean, swell: mean / (1.0 + swell), WIDE)
shared = over_rows(lambda w, y, shift: w / ((y + shift) * (y + shift)), WIDE)
push = over_rows(lambda ds, n0, kappa, w: ds * (n0 + kappa * w), WIDE)
push_sizes = over_rows(lambda ds, n0, kappa, w: abs(ds) * (abs(n0) + abs(kappa * w)), WIDE)
root = over_rows(np.sqrt, WIDE)
slowness = over_rows(lambda ds, speed, share: share * ds / speed, WIDE)
arc_pace = over_rows(lambda ds, y, near, g: ds * (near + 2.0 * g * y), WIDE)


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
    """Fill the row at ``out`` with exp - 1 of the row at ``q``, side by side."""
    most, scale, doublings = max(size_of(work, q), fabs(work[q + COUNT])), 1.0, 0
    while most * scale > SUMMED:
        scale, doublings = 0.5 * scale, doublings + 1
    for j in range(WIDE):
        x = work[q + j] * scale
        work[out + j] = fma(polynomial(SWELLING, x) * x, x, x)
    for _ in range(doublings):
        for j in range(WIDE):
            work[out + j] *= work[out + j] + 2.0


@Inner
def set_nodes(work):  # type: ignore[no-untyped-def]
    """Write down the nodes, once for all panels."""
    for j in range(WIDE):
        work[NODES + j] = ENDS_BY_NODE[j]


@Inner
def begin_panel(drive, p, linear, origin, span, u, g, c, left, width, base, v, nu, work):  # type: ignore[no-untyped-def]
    """Lay out a panel from w = ``left`` on, run towards growing (u = 1) or falling (u = -1) parameters.

    ``origin`` is two doubles; the curve is asked within ``span`` (`leg_breaks`). Where forces are linear in V**2, fills
    what ``drive`` gives, and PULL.
    """
    near = 2.0 * g * left + c
    product(work, PLACE, NODES, width)
    away(work, D, PLACE, near, g)
    place(work, ARC, D, origin[0] + (u * distance(left, g, c) + origin[1]), float(u))
    if span[0] > -inf or span[1] < inf:
        for j in range(WIDE):
            work[ARC + j] = within(work[ARC + j], span)
    same(work, W, base)
    if linear:
        sample(drive, p, u, g, near, v, nu, work)


@Inner
def sample(drive, p, u, g, near, v, nu, work):  # type: ignore[no-untyped-def]
    """Fill what ``drive`` gives, and PULL, at the panel's places for V**2 as it is taken to be there.

    At its end too, which fills the registers; there they may not be numbers.
    """
    call_speed_equation(drive, WIDE, work, (ARC, W, DS), float(v), float(nu), p)
    pull(work, PULL, Q, PLACE, near, g, float(u))


@Inner
def integrate(u, g, c, left, base, out, work):  # type: ignore[no-untyped-def]
    """W over the panel, in the row at ``out``, for the forces that were sampled; q over the panel."""
    near = 2.0 * g * left + c
    to_means(work, PULL, work, SPEED)
    product(work, SPEED, SPEED, PLACE)
    far = work[SPEED + COUNT]
    if not fabs(far) <= STEEPEST:
        return inf
    grow(work, SPEED, SWELL)
    swelled_force(work, FORCE, P, SWELL, float(u))
    # The integral over the distance: means, and where the march is graded those with the weight y.
    to_means(work, FORCE, work, MEAN)
    if g > 0.0:
        to_graded_means(work, FORCE, work, GRADED)
        graded_gain(work, SPEED, PLACE, MEAN, GRADED, near)
    else:
        product(work, SPEED, PLACE, MEAN)
    swelled(work, out, SPEED, SWELL, base)
    return far


@Inner
def settle(drive, p, u, g, c, left, base, v, nu, work):  # type: ignore[no-untyped-def]
    """`integrate` for forces that are not linear in V**2, by Newton's method; inf where that does not settle."""
    work[W] = max(base, 1e-300)  # it begins with what W does at once; laws may ask for its root
    call_speed_equation(drive, 1, work, (ARC, W, MEAN), float(v), float(nu), p)
    rise = max(u * (work[MEAN + 1] - work[MEAN + 2] * work[W]), 0.0)
    place(work, W, D, base, rise)
    stop = inf
    for _ in range(MOST_ROUNDS):
        sample(drive, p, u, g, 2.0 * g * left + c, v, nu, work)
        far = integrate(u, g, c, left, base, SPEED, work)
        if not far < inf:
            return inf
        moved, size = 0.0, 0.0
        for j in range(WIDE):
            moved, size = max(moved, fabs(work[SPEED + j] - work[W + j])), max(size, fabs(work[SPEED + j]))
        same(work, W, SPEED)
        # Each round squares the miss, and the last ones only stir the rounding.
        if not moved < inf:
            return inf
        if moved <= 4e-16 * size or (moved <= 1e-13 * size and moved >= 0.5 * stop):
            return far
        stop = moved
    return inf


@Inner
def solve_panel(drive, p, linear, u, g, c, left, base, v, nu, work):  # type: ignore[no-untyped-def]
    """W on a panel that was begun (`begin_panel`).

    Fills all of ``work`` that does not ask for W > 0. Returns q over the panel, inf where it is too wide for an answer.
    """
    far = integrate(u, g, c, left, base, W, work) if linear else settle(drive, p, u, g, c, left, base, v, nu, work)
    if not far < inf:
        return inf
    if base == 0.0:
        shrunk(work, BARE, GRADED if g > 0.0 else MEAN, SWELL)
    elif g > 0.0 and left == 0.0:
        shared(work, BARE, W, PLACE, 0.5 * c)
    else:
        same(work, BARE, W)
    push(work, LOAD, DS, N0, KAPPA, W)
    return far


@Inner
def as_bare(w, g, c, left):  # type: ignore[no-untyped-def]
    """A value of W in the units of BARE, at the start of a panel from w = ``left`` on."""
    return w / (0.25 * c * c) if g > 0.0 and left == 0.0 and c > 0.0 else w


@Inner
def pace(g, c, left, base, work):  # type: ignore[no-untyped-def]
    """Fill in Y, the pace of time and that of arc length: not numbers where W is not positive."""
    if base == 0.0 or g == 0.0:
        root(work, SPEED, BARE)
    else:
        shared(work, SPEED, W, PLACE, left + 0.5 * c)
        root(work, SPEED, SPEED)
    slowness(work, PACE, DS, SPEED, 1.0 + g)
    arc_pace(work, ARC, DS, PLACE, 2.0 * g * left + c, g)
