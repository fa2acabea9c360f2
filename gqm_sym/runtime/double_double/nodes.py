"""Nodes of quadrature rules in double-double arithmetic, computed by compiled code when they are first needed."""

from functools import cache
from math import cos, pi, sin

import numpy as np

from gqm_sym.runtime.arithmetic.elementary import HALF_PI
from gqm_sym.runtime.compiled.jit import entry
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, Array
from gqm_sym.runtime.double_double.arithmetic import add, divide, multiply, sine_and_cosine
from gqm_sym.runtime.quadrature.trapezoid import LIBRATION

# The indices at which the levels of the trapezoidal rule begin and end; with each level the number of nodes doubles.
LEVELS = (0, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096)

# The number of nodes of a Gauss-Legendre rule, and the number of Newton iterations that find them from starting values
# of three digits.
RULE, NEWTON_STEPS = 16, 6

# The number of places at which a polynomial about a slow place is found, which is odd: one of them is the slow place.
WINDOW = 17


@entry(MATRIX(INTEGER))
def node_tables(kind):  # type: ignore[no-untyped-def]
    """Return the nodes of all levels of the rule: those of the first level, then those that each doubling adds.

    Returns
    -------
    rows : (4, n) array
        The share of the way from ``a`` to ``b`` at each node, as two doubles, and the factor of the integrand there.
        These are the square of the sine of phi/2, and sin(phi)/2; for a lap, the phase angle itself and 1. The first
        node of a libration would be one of the ends; the node in the middle takes its place, with the factor zero.
    """
    rows = np.empty((4, LEVELS[-1]))
    for k in range(LEVELS[-1]):
        level = 1
        while LEVELS[level] <= k:
            level += 1
        n = LEVELS[level]
        share = k / n if level == 1 else (2.0 * k + 1.0) / n - 1.0
        if kind == LIBRATION:
            high, low = multiply(share, 0.0, HALF_PI[0], HALF_PI[1])
            s, s_low, c, c_low = sine_and_cosine(high, low)
            rows[0, k], rows[1, k] = multiply(s, s_low, s, s_low)
            rows[2, k], rows[3, k] = multiply(s, s_low, c, c_low)
            if k == 0:
                rows[0, k] = 0.5
        else:
            rows[0, k], rows[1, k], rows[2, k], rows[3, k] = share, 0.0, 1.0, 0.0
    return rows


@entry(MATRIX())
def legendre_rule():  # type: ignore[no-untyped-def]
    """Return the nodes of a Gauss-Legendre rule on [0, 1], and its weights, as rows of two doubles each."""
    rows = np.empty((4, RULE))
    for k in range(RULE):
        x, x_low, slope, slope_low = -cos(pi * (k + 0.75) / (RULE + 0.5)), 0.0, 0.0, 0.0
        for _ in range(NEWTON_STEPS):
            p, p_low, before, before_low = x, x_low, 1.0, 0.0
            for n in range(2, RULE + 1):
                up, up_low = multiply(x, x_low, p, p_low)
                up, up_low = multiply(up, up_low, 2.0 * n - 1.0, 0.0)
                down, down_low = multiply(before, before_low, 1.0 - n, 0.0)
                before, before_low = p, p_low
                p, p_low = add(up, up_low, down, down_low)
                p, p_low = divide(p, p_low, float(n), 0.0)
            # P_n' (x**2 - 1) = n (x P_n - P_(n-1))
            up, up_low = multiply(x, x_low, p, p_low)
            up, up_low = add(up, up_low, -before, -before_low)
            square, square_low = multiply(x, x_low, x, x_low)
            square_less_one, square_less_one_low = add(square, square_low, -1.0, 0.0)
            slope, slope_low = divide(RULE * up, RULE * up_low, square_less_one, square_less_one_low)
            step, step_low = divide(p, p_low, slope, slope_low)
            x, x_low = add(x, x_low, -step, -step_low)
        slope, slope_low = multiply(slope, slope_low, slope, slope_low)
        slope, slope_low = multiply(slope, slope_low, -square_less_one, -square_less_one_low)
        rows[0, k], rows[1, k] = add(0.5 * x, 0.5 * x_low, 0.5, 0.0)
        rows[2, k], rows[3, k] = divide(1.0, 0.0, slope, slope_low)
    return rows


@entry(MATRIX())
def powers_table():  # type: ignore[no-untyped-def]
    """Return what turns values at nodes of [-1, 1] into coefficients of powers.

    Returns
    -------
    rows : (1 + 2 n, n) array
        The nodes, of which the one in the middle is 0; then, for each power, the factors of the values at the nodes: n
        rows of high parts and n rows of low parts. The first power is 1, and its coefficient is the value at 0 alone.
    """
    n = WINDOW
    rows = np.zeros((1 + 2 * n, n))
    for j in range(n):
        rows[0, j] = sin(0.5 * pi * (2.0 * j / (n - 1.0) - 1.0))
    for j in range(n):
        # Lagrange's polynomial of the node is multiplied out, factor by factor.
        rows[1, j], degree = 1.0, 0
        for m in range(n):
            if m == j:
                continue
            gap, gap_low = add(rows[0, j], 0.0, -rows[0, m], 0.0)
            degree += 1
            for k in range(degree, -1, -1):
                high, low = multiply(rows[1 + k, j], rows[1 + n + k, j], -rows[0, m], 0.0)
                if k > 0:
                    high, low = add(high, low, rows[k, j], rows[n + k, j])
                rows[1 + k, j], rows[1 + n + k, j] = divide(high, low, gap, gap_low)
    return rows


@cache
def trapezoidal_nodes(kind: int) -> Array:
    """Return the table of `node_tables`, which is computed once."""
    table: Array = node_tables(kind)
    return table


@cache
def panel_rule() -> Array:
    """Return the rule of `legendre_rule`, which is computed once."""
    rule: Array = legendre_rule()
    return rule


@cache
def powers() -> Array:
    """Return the table of `powers_table`, which is computed once."""
    table: Array = powers_table()
    return table
