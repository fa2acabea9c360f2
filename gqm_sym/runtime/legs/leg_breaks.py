"""Places at which the curve is not smooth, as a leg meets them: how far they are, and on which side of them a body is.

A leg begins at a place in two doubles. A break is one double, so that its distance from there has all its digits
however short it is: a body between two planes comes to their joint as near as 1e-300. Curves are asked at one double,
which such a distance does not change: that double is kept off the breaks on both sides of a panel.
"""

from math import fabs, inf

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.compiled.jit import Inlined, Inner

# How far off a break a place is on one side of it for sure, as a share of the range of places: several laps of a closed
# curve are taken off places before they are compared.
GRAIN = 2.0**-51


@Inner
def grain(start, limit):  # type: ignore[no-untyped-def]
    """How far off the breaks between two places curves are asked."""
    return GRAIN * max(fabs(start), fabs(limit))


@Inlined
def offset(place, origin, u):  # type: ignore[no-untyped-def]
    """How far a place is from an origin in two doubles, in direction u."""
    return u * ((place - origin[0]) - origin[1])


@Inner
def located(origin, v, gone, breaks, coming):  # type: ignore[no-untyped-def]
    """The place at a distance from an origin, as two doubles: a break itself where the distance is that of one.

    The breaks behind that at ``coming`` are farther.
    """
    for k in range(min(coming, breaks.size - 1), -1, -1):
        far = offset(breaks[k], origin, v)
        if far == gone:
            return breaks[k], 0.0
        if far < gone:
            break
    high, low = two_sum(origin[0], v * gone)
    return two_sum(high, low + origin[1])


@Inner
def between(breaks, coming, v, off):  # type: ignore[no-untyped-def]
    """The span in which the curve is asked on its piece before the break at ``coming``; ``off`` is kept off breaks."""
    behind = breaks[coming - 1] if coming > 0 else -v * inf
    ahead = breaks[coming] if coming < breaks.size else v * inf
    return (behind + off, ahead - off) if v > 0 else (ahead + off, behind - off)


@Inlined
def within(place, span):  # type: ignore[no-untyped-def]
    """The place in a span that is nearest to one."""
    return min(max(place, span[0]), span[1])
