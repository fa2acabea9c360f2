"""Breaks, which are the places at which the curve is not smooth: their distances, and the side on which a body is.

A leg begins at a place of two doubles and a break is one double, so that the distance between them has all its digits
however short it is: a body that moves between two planes may come to within 1e-300 of their joint. Curves are evaluated
at single doubles, which do not resolve such distances; so these doubles are kept away from the breaks on both sides of
a panel.
"""

from math import fabs, inf

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.compiled.jit import Inlined, Inner

# The distance from a break at which a place certainly lies on one side of it, as a share of the range of places. It is
# more than one rounding, because laps of a closed curve are subtracted before places are compared.
CLEARANCE_SHARE = 2.0**-51


@Inner
def clearance(start, limit):  # type: ignore[no-untyped-def]
    """Return the distance from breaks that evaluations of the curve between two places must keep."""
    return CLEARANCE_SHARE * max(fabs(start), fabs(limit))


@Inlined
def offset(place, origin, u):  # type: ignore[no-untyped-def]
    """Return the distance of a place from an origin of two doubles, in direction u."""
    return u * ((place - origin[0]) - origin[1])


@Inner
def place_after(origin, d):  # type: ignore[no-untyped-def]
    """Return the place at a signed distance from an origin, both as two doubles."""
    high, low = two_sum(origin[0], d)
    return two_sum(high, low + origin[1])


@Inner
def located(origin, v, distance, breaks, upcoming):  # type: ignore[no-untyped-def]
    """Return the place at a distance from an origin, as two doubles; it is exactly a break if the distance is that of a
    break.

    Breaks after the one at ``upcoming`` are farther away.
    """
    for k in range(min(upcoming, breaks.size - 1), -1, -1):
        far = offset(breaks[k], origin, v)
        if far == distance:
            return breaks[k], 0.0
        if far < distance:
            break
    return place_after(origin, v * distance)


@Inner
def span_before(breaks, upcoming, v, off):  # type: ignore[no-untyped-def]
    """Return the places between which the curve may be evaluated before the break at ``upcoming``, at the distance
    ``off`` from the breaks.
    """
    behind = breaks[upcoming - 1] if upcoming > 0 else -v * inf
    ahead = breaks[upcoming] if upcoming < breaks.size else v * inf
    return (behind + off, ahead - off) if v > 0 else (ahead + off, behind - off)


@Inlined
def within(place, span):  # type: ignore[no-untyped-def]
    """Return the place within a span that is nearest to a given place."""
    return min(max(place, span[0]), span[1])
