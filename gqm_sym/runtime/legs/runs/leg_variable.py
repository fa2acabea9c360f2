"""The variable in which a leg from turn to turn is a polynomial: the share of the way, or one stretched by a sinh map.

The arc length per parameter, ds, has branch points where its square vanishes. One close to the real axis at ``c + i
b``, as beside the bottom of a parabola, makes the coefficients of all that depends on ds decrease slowly. With ``lam =
c + b sinh(u)`` it lies at ``u = i pi/2``, and is none of ds/du: ``ds**2`` has a single zero there in lam, and lam - c -
i b a double one in u. (Such maps are those of T. W. Tee and L. N. Trefethen, A rational spectral collocation method
with adaptively transformed Chebyshev grid points, SIAM J. Sci. Comput. 28, 2006.)

The variable y runs through u from 0 at one turn to 1 at the other in equal steps. All formulas of a leg hold in y if
ds, P and Q are multiplied by J, the derivative of the share of the way. The distance from the leg's start is ``E
(rising + falling/(1 + E))`` with ``E = expm1(extent y)``, in which nothing is subtracted; from the leg's end it has the
same form.
"""

from math import expm1, log1p, sqrt
from typing import NamedTuple

from gqm_sym.runtime.arithmetic import exponential_rows
from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.arithmetic.elementary import power_of_two, scaled_exp
from gqm_sym.runtime.compiled.intrinsics import fma
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import fused, over_rows
from gqm_sym.runtime.legs.panels.breaks import offset
from gqm_sym.runtime.legs.panels.equation import ARC_RATE, DS, EXPM1_Q, NODES, D, P, Q, product
from gqm_sym.runtime.legs.panels.polynomials import WIDE

# A leg that is shorter than this many times the height of the branch point is resolved without a map.
LEAST_SHARE = 1.0


class BranchPoint(NamedTuple):
    """A pair of branch points of ds, at ``place`` plus and minus i times ``height``.

    Attributes
    ----------
    place : float
        The real part.
    height : float
        The imaginary part; 0 if none is known, infinite if legs are not to be stretched.
    """

    place: float
    height: float


class LegVariable(NamedTuple):
    """The variable of a leg.

    Attributes
    ----------
    width : float
        The distance from turn to turn.
    rising, falling, extent : float
        The distance at the share y is ``rising*expm1(extent*y) - falling*expm1(-extent*y)``; with the extent 0 it is
        ``width*y``.
    """

    width: float
    rising: float
    falling: float
    extent: float


grown_row = over_rows(lambda y, extent: exponential_rows.expm1(y * extent), WIDE)
stretched_row = over_rows(lambda e, rising, falling: fused(e, rising, falling * (e / (e + 1.0))), WIDE)
stretching_row = over_rows(lambda e, rising, falling: rising * (e + 1.0) + falling / (e + 1.0), WIDE)


@Inner
def unstretched(width):  # type: ignore[no-untyped-def]
    """Return the share of the way as the variable of a leg."""
    return LegVariable(width, 0.0, 0.0, 0.0)


@Inner
def growth_at(rising, falling, d):  # type: ignore[no-untyped-def]
    """Return expm1(extent*y) at a distance, the positive root of ``rising*E**2 + (rising + falling - d)*E = d``."""
    b = (rising + falling) - d
    root = sqrt(b * b + 4.0 * rising * d)
    return 2.0 * d / (b + root) if b > 0.0 else 0.5 * (root - b) / rising


@Inner
def width_at(rising, falling, extent):  # type: ignore[no-untyped-def]
    """Return the distance at the end of a variable, rounded once: a turning point has its error."""
    lead, rest, k = scaled_exp(extent)
    high, scale = lead + rest, power_of_two(k)
    growth, low = high * scale, (rest - (high - lead)) * scale
    inverse = 1.0 / growth
    inverse_low = inverse * (fma(-growth, inverse, 1.0) - low * inverse)
    up, up_low = two_sum(growth, -1.0)
    down, down_low = two_sum(1.0, -inverse)
    one, other = rising * up, falling * down
    total, rounding = two_sum(one, other)
    one_low = fma(rising, up, -one) + rising * (up_low + low)
    other_low = fma(falling, down, -other) + falling * (down_low - inverse_low)
    return total + (rounding + (one_low + other_low))


@Inner
def up_to(variable, width):  # type: ignore[no-untyped-def]
    """Return the variable of a leg with the same start and another width."""
    if variable.extent == 0.0:
        return unstretched(width)
    rising, falling, e = variable.rising, variable.falling, growth_at(variable.rising, variable.falling, width)
    extent = log1p(e)
    missing = width - width_at(rising, falling, extent)
    return LegVariable(width, rising, falling, extent + missing / (rising * (e + 1.0) + falling / (e + 1.0)))


@Inner
def distance_at(variable, y):  # type: ignore[no-untyped-def]
    """Return the distance from the start at a share of the variable."""
    if variable.extent == 0.0:
        return variable.width * y
    e = expm1(variable.extent * y)
    return e * (variable.rising + variable.falling / (e + 1.0))


@Inner
def share_at(variable, d):  # type: ignore[no-untyped-def]
    """Return the share of the variable at a distance from the start, and J there."""
    if variable.extent == 0.0:
        return d / variable.width, 1.0
    e = growth_at(variable.rising, variable.falling, d)
    slope = variable.rising * (e + 1.0) + variable.falling / (e + 1.0)
    return log1p(e) / variable.extent, variable.extent / variable.width * slope


@Inner
def lengthened(variable, factor, room):  # type: ignore[no-untyped-def]
    """Return the variable of a leg whose variable runs ``factor`` times as far, or of one with the width ``room`` if
    that is less.
    """
    if variable.extent == 0.0:
        return unstretched(min(variable.width * factor, room))
    extent = variable.extent * factor
    width = width_at(variable.rising, variable.falling, extent)
    if not width < room:
        return up_to(variable, room)
    return LegVariable(width, variable.rising, variable.falling, extent)


@Inner
def reversed_variable(variable):  # type: ignore[no-untyped-def]
    """Return the variable of a leg seen from its end."""
    growth = expm1(variable.extent) + 1.0
    return LegVariable(variable.width, variable.falling / growth, variable.rising * growth, variable.extent)


@Inner
def variable_for(branch, origin, direction, width):  # type: ignore[no-untyped-def]
    """Return the variable for a leg of about this width: stretched if it passes by a known branch point closely."""
    d, b = offset(branch.place, origin, float(direction)), branch.height
    if not (0.0 < LEAST_SHARE * b < width and -b < d < width + b):
        return unstretched(width)
    root = sqrt(d * d + b * b)
    falling = 0.5 * (root + d) if d > 0.0 else 0.5 * b * b / (root - d)
    return up_to(LegVariable(width, 0.25 * b * b / falling, falling, 1.0), width)


@Inner
def lay_places(variable, blocks, work):  # type: ignore[no-untyped-def]
    """Fill the row ARC_RATE with the distances of the nodes, and the row D with J, for a stretched variable."""
    _, rising, falling, extent = variable
    rate = extent / variable.width
    for at in range(0, blocks * WIDE, WIDE):
        grown_row(work, blocks * EXPM1_Q + at, blocks * NODES + at, extent)
        stretching_row(work, blocks * D + at, blocks * EXPM1_Q + at, rate * rising, rate * falling)
        stretched_row(work, blocks * ARC_RATE + at, blocks * EXPM1_Q + at, rising, falling)


@Inner
def stretch_law(blocks, work):  # type: ignore[no-untyped-def]
    """Multiply the rows DS, P and Q by J."""
    for row in (DS, P, Q):
        for at in range(0, blocks * WIDE, WIDE):
            product(work, blocks * row + at, blocks * row + at, blocks * D + at)
