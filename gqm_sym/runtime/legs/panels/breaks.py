"""Breaks, the places at which the curve is not smooth: how far they are, and on which side of them a body is.

A leg begins at a place in two doubles and a break is one double, so that the distance between them has all its digits
however short it is: a body that moves between two planes comes to within 1e-300 of their joint. Curves are evaluated at
one double, which such a distance does not change; that double is kept off the breaks on both sides of a panel.
"""

from math import fabs, inf

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.compiled.jit import Inlined, Inner

# How far a place must be from a break to lie certainly on one side of it, as a share of the range of places. Laps of a
# closed curve are subtracted before places are compared, so that this is more than one rounding.
CLEARANCE_SHARE = 2.0**-51


@Inner
def clearance(start, limit):  # type: ignore[no-untyped-def]
    """The distance from breaks between two places at which curves are evaluated."""
    return CLEARANCE_SHARE * max(fabs(start), fabs(limit))


@Inlined
def offset(place, origin, u):  # type: ignore[no-untyped-def]
    """The distance of a place from an origin in two doubles, in direction u."""
    return u * ((place - origin[0]) - origin[1])


@Inner
def located(origin, v, distance, breaks, upcoming):  # type: ignore[no-untyped-def]
    """The place at a distance from an origin, as two doubles; exactly a break if the distance is that of one.

    Breaks after the one at ``upcoming`` are farther away.
    """
    for k in range(min(upcoming, breaks.size - 1), -1, -1):
        far = offset(breaks[k], origin, v)
        if far == distance:
            return breaks[k], 0.0
        if far < distance:
            break
    high, low = two_sum(origin[0], v * distance)
    return two_sum(high, low + origin[1])


@Inner
def span_before(breaks, upcoming, v, off):  # type: ignore[no-untyped-def]
    """The places between which the curve may be evaluated before the break at ``upcoming``, ``off`` from the breaks."""
    behind = breaks[upcoming - 1] if upcoming > 0 else -v * inf
    ahead = breaks[upcoming] if upcoming < breaks.size else v * inf
    return (behind + off, ahead - off) if v > 0 else (ahead + off, behind - off)


@Inlined
def within(place, span):  # type: ignore[no-untyped-def]
    """The place within a span that is nearest to another."""
    return min(max(place, span[0]), span[1])
