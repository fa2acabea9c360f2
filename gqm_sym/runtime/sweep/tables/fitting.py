"""Polynomials through the values of a function at the Gauss points of a panel."""

from math import fabs

import numpy as np
from numpy.polynomial.legendre import leg2poly

from gqm_sym.runtime.arithmetic.doubledouble import add
from gqm_sym.runtime.arithmetic.matrices import multiply
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.double_double.arithmetic import multiply as multiply_pairs
from gqm_sym.runtime.sweep.tables.layout import FIT, NODES, POINTS

# Legendre coefficients after the last one above this share of the largest value are rounding noise; a panel is halved
# if its last two are above the second share.
MAX_NOISE_RATIO, MAX_TAIL_RATIO = 4e-16, 1e-13

# The second share for values from double-double arithmetic, and the number of corrections of the fit to these.
MAX_TRUE_TAIL_RATIO, CORRECTIONS = 1e-15, 2
_POWERS = np.array([np.pad(leg2poly(row[: k + 1]), (0, NODES - 1 - k)) for k, row in enumerate(np.eye(NODES))])
fit, powers = multiply(FIT), multiply(_POWERS)


@Inner
def fill_terms(values, work, row, at, size):  # type: ignore[no-untyped-def]
    """Fit a polynomial to values at the Gauss points, with its Legendre terms in ``work``; return whether it is
    resolved.

    Coefficients after the last significant one are set to zero. ``size`` is the size of the values elsewhere; values
    that are much smaller are rounding noise.
    """
    off = np.empty(NODES)
    for j in range(NODES):
        off[j], size = values[j] - values[0], max(size, fabs(values[j]))
    fit(off, 0, work, 0)
    work[0] += values[0]  # a constant is then fitted without rounding
    resolved = max(fabs(work[NODES - 2]), fabs(work[NODES - 1])) <= MAX_TAIL_RATIO * size
    for j in range(NODES - 1, -1, -1):
        if fabs(work[j]) > MAX_NOISE_RATIO * size:
            break
        work[j] = 0.0
    powers(work, 0, row, at)
    return resolved


@Inner
def fill_true_terms(values, work, sums, size):  # type: ignore[no-untyped-def]
    """Fit a polynomial as `fill_terms` does, but to values of two doubles, with coefficients of powers as two doubles.

    Return the size of the last Legendre terms, and the size with which it is compared.
    """
    residuals, terms, series = values[0].copy(), np.empty(NODES), np.empty(NODES)
    for j in range(NODES):
        size, sums[0, j], sums[1, j] = max(size, fabs(residuals[j])), 0.0, 0.0
    for turn in range(CORRECTIONS + 1):
        fit(residuals, 0, series, 0)
        powers(series, 0, terms, 0)
        for j in range(NODES):
            sums[0, j], sums[1, j] = add(sums[0, j], sums[1, j], terms[j], 0.0)
            work[j] = series[j] if turn == 0 else work[j] + series[j]
        for i in range(NODES):
            value, low = 0.0, 0.0
            for j in range(NODES - 1, -1, -1):
                value, low = multiply_pairs(value, low, POINTS[i], 0.0)
                value, low = add(value, low, sums[0, j], sums[1, j])
            residuals[i] = add(values[0, i], values[1, i], -value, -low)[0]
    return max(fabs(work[NODES - 2]), fabs(work[NODES - 1])), size


@Inner
def move_terms(sums, edge, terms, middle):  # type: ignore[no-untyped-def]
    """Fill the coefficients of powers about an edge, for a polynomial whose coefficients of powers of x, ``sums``, are
    two doubles each and are overwritten.

    Also fill ``middle`` with the coefficients of x, x**2, ... of its product with the distance from the edge.
    """
    for j in range(NODES - 1):
        middle[j] = add(sums[0, j], sums[1, j], -edge * sums[0, j + 1], -edge * sums[1, j + 1])[0]
    middle[NODES - 1] = sums[0, NODES - 1]
    for i in range(NODES):
        for j in range(NODES - 2, i - 1, -1):
            sums[0, j], sums[1, j] = add(sums[0, j], sums[1, j], edge * sums[0, j + 1], edge * sums[1, j + 1])
        terms[i] = sums[0, i]
