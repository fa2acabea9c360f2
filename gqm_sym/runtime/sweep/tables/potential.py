"""The potential on the panels of a tabulated curve relative to its value at an edge, so that small differences keep all
digits.
"""

from gqm_sym.runtime.compiled.jit import Inlined, Inner
from gqm_sym.runtime.sweep.tables.layout import BASE, BASE_LOW, INCREASE, LEFT_TERMS, NODES, RIGHT_TERMS


@Inner
def value_on(rows, k, at, x):  # type: ignore[no-untyped-def]
    """Return the value at x of the polynomial of panel k whose coefficients begin at column ``at``."""
    total = 0.0
    for j in range(NODES - 1, -1, -1):
        total = total * x + rows[k, at + j]
    return total


@Inner
def rise_on(rows, k, at, r):  # type: ignore[no-untyped-def]
    """Return the potential on panel k relative to the edge whose numbers begin at column ``at``.

    The place is at the distance ``r`` from the edge, in units of half the panel.
    """
    return r * value_on(rows, k, at, r)


@Inner
def potential_on(rows, k, x):  # type: ignore[no-untyped-def]
    """Return the potential of panel k relative to its left edge at a place x in [-1, 1]."""
    return rise_on(rows, k, LEFT_TERMS, 1.0 + x)


@Inner
def difference_from(rows, k, at, r, q):  # type: ignore[no-untyped-def]
    """Return the first divided difference of the potential of panel k over two places at the distances r and q from an
    edge.
    """
    value, first = 0.0, 0.0
    for j in range(NODES - 1, -1, -1):
        first = first * q + value
        value = value * r + rows[k, at + j]
    return value + q * first


@Inner
def difference_on(rows, k, x, y):  # type: ignore[no-untyped-def]
    """Return the first divided difference of the potential of panel k, as a function of x, over two places on the
    panel.

    It is computed from the nearer edge, because the slope of a fitted polynomial is less accurate there than its value.
    """
    at, edge = (LEFT_TERMS, -1.0) if x + y < 0.0 else (RIGHT_TERMS, 1.0)
    return difference_from(rows, k, at, x - edge, y - edge)


@Inner
def rise_from_left(rows, k, x, near):  # type: ignore[no-untyped-def]
    """Return the potential at a place of panel k relative to the left edge."""
    if x <= 0.0:
        return rise_on(rows, k, LEFT_TERMS, near)
    return rows[k, INCREASE] + rise_on(rows, k, RIGHT_TERMS, -near)


@Inner
def rise_from_right(rows, k, x, near):  # type: ignore[no-untyped-def]
    """Return the potential at a place of panel k relative to the right edge."""
    if x > 0.0:
        return rise_on(rows, k, RIGHT_TERMS, -near)
    return rise_on(rows, k, LEFT_TERMS, near) - rows[k, INCREASE]


@Inlined
def rise_between(rows, k, other):  # type: ignore[no-untyped-def]
    """Return the potential at the left edge of another panel relative to that at the left edge of panel k."""
    return (rows[other, BASE] - rows[k, BASE]) + (rows[other, BASE_LOW] - rows[k, BASE_LOW])
