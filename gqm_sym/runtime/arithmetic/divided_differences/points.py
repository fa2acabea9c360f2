"""Helpers of second divided differences: three points in any order, and even series over two arguments."""

from math import fabs

from gqm_sym.runtime.compiled.intrinsics import choose, fma, polynomial_pair
from gqm_sym.runtime.compiled.jit import Inlined, Inner


@Inlined
def series_pair(c, s, t):  # type: ignore[no-untyped-def]
    """Return the sum of a polynomial's values at s and t, and its divided difference [s,t]."""
    value, slope = polynomial_pair(c, s, t)
    return fma(s - t, slope, 2.0 * value), slope


@Inner
def ordered(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """Return the points in ascending order and the two gaps between them."""
    if h1 >= 0.0 and h2 >= 0.0:
        return x, y, w, h1, h2
    if h1 <= 0.0 and h2 <= 0.0:
        return w, y, x, -h2, -h1
    # Here y is the lowest or the highest point. The gap between x and w is w - x if x and w are small compared with the
    # gaps.
    gap = h1 + h2 if fabs(h1) <= fabs(x) + fabs(w) else w - x
    if h1 > 0.0:
        return (x, w, y, gap, -h2) if gap >= 0.0 else (w, x, y, -gap, h1)
    return (y, x, w, -h1, gap) if gap >= 0.0 else (y, w, x, h2, -gap)


@Inlined
def around(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """Two pairs of points that share the middle one, their gaps, and the gap between the outer two.

    Returns p, q, their gap, r, s, their gap, and d, so that ``f[x,y,w] = (f[r,s] - f[p,q])/d``.
    """
    y_between = h1 * h2 >= 0.0
    x_between, w_between = (not y_between) & (fabs(h1) < fabs(h2)), (not y_between) & (fabs(h1) >= fabs(h2))
    # If y is the lowest or the highest point, the gap between x and w is w - x if these are small compared with the
    # gaps.
    gap = choose(fabs(h1) <= fabs(x) + fabs(w), h1 + h2, w - x)
    return (
        *(x, choose(w_between, w, y), choose(w_between, gap, h1)),
        *(choose(x_between, x, y), w, choose(x_between, gap, h2)),
        choose(x_between, h2, choose(w_between, h1, h1 + h2)),
    )


@Inlined
def ascending_gaps(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """Return the gaps between three points in ascending order, and the highest point."""
    _p, _q, first, _r, _s, second, _d = around(x, y, w, h1, h2)
    w_between = (h1 * h2 < 0.0) & (fabs(h1) >= fabs(h2))
    second_is_upper = ((second > 0.0) | ((second == 0.0) & (first > 0.0))) != w_between
    lower, upper = choose(second_is_upper, first, second), choose(second_is_upper, second, first)
    higher = choose(x > y, x, y)
    return fabs(lower), fabs(upper), choose(higher > w, higher, w)
