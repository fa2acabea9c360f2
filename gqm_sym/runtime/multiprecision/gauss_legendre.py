"""Gauss-Legendre quadrature in extended precision, with as many nodes as each panel needs."""

from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import pairwise
from math import ceil
from typing import Any

from gqm_sym.errors import SolutionError

# The number of nodes of the first rule, and of the smallest one.
FIRST_NODES, MIN_NODES = 20, 8

# Bits of a fixed-point number beyond those of the result: the errors of a recurrence grow with its length squared.
GUARD_BITS = 32

# A function that is not resolved after this number of halvings of a panel is not analytic.
MAX_HALVINGS = 40


def gauss(context: Any, rate: Callable[[Any], Any], edges: Sequence[Any], digits: int) -> list[Any]:
    """Integrate a function over each panel between edges, on which it is analytic.

    The error of the rule with n nodes is about the coefficient 2n of the Legendre series. The coefficients decrease
    geometrically, so this is about the square of coefficient n. The last two coefficients that the nodes give decide
    whether the rule has converged, and the number of nodes for the next panel.

    Raises
    ------
    SolutionError
        If the rules do not converge.
    """
    max_nodes = 2 * ceil(digits / 2) + 8
    tolerance = context.mpf(10) ** (-(digits // 2) - 2)
    count, parts = min(FIRST_NODES, max_nodes), []
    for left, right in pairwise(edges):
        total, pending, halvings = context.mpf(0), [right], 0
        while pending:
            value, tail = _panel(context, rate, left, pending[-1], count)
            if tail <= tolerance:
                total += value
                left = pending.pop()
            elif count < max_nodes:
                count = max_nodes
                continue
            elif halvings < MAX_HALVINGS:
                pending.append((left + pending[-1]) / 2)
                halvings += 1
                continue
            else:
                raise SolutionError("extended precision: the integrand of the time of flight is not analytic")
            # This follows from the rate at which the coefficients decrease; it is a multiple of four, because every new
            # rule must be computed.
            fall = -float(context.log10(tail)) / count if tail else 2.0
            count = min(max(4 * ceil((digits / 2 + 4) / fall / 4), MIN_NODES), max_nodes)
        parts.append(total)
    return parts


def _panel(context: Any, rate: Callable[[Any], Any], left: Any, right: Any, count: int) -> tuple[Any, Any]:
    """Return the integral over one panel, and its last two Legendre coefficients as a share of the first."""
    half, middle = (right - left) / 2, (right + left) / 2
    total = odd = even = context.mpf(0)
    for x, weight, last in legendre_rule(count, context.dps):
        one, two = rate(middle + half * x), rate(middle - half * x)
        both = weight * (one + two)
        total += both
        odd += weight * last * (one - two)
        even += last * x * both
    # P_(n-2) is (2n - 1) x P_(n-1)/(n - 1) at the zeros of P_n.
    odd, even = odd * (2 * count - 1), even * (2 * count - 3) * (2 * count - 1) / (count - 1)
    return half * total, (abs(odd) + abs(even)) / abs(total) if total else context.mpf(1)


@lru_cache(maxsize=256)
def legendre_rule(count: int, digits: int) -> tuple[tuple[Any, Any, Any], ...]:
    """Return the positive nodes of a Gauss-Legendre rule of even size, its weights there, and P_(count-1) there."""
    import numpy as np
    from mpmath.ctx_mp import MPContext

    context = MPContext()
    context.dps = digits + 5
    bits = context.prec + GUARD_BITS
    guesses = np.polynomial.legendre.leggauss(count)[0]
    rule = []
    for guess in guesses[count // 2 :]:
        x = context.mpf(float(guess))
        for _ in range(digits.bit_length() + 2):
            # Fixed-point numbers take a fraction of the time of mpmath's, and are as precise between -1 and 1.
            place = int(context.ldexp(x, bits))
            before, here = 1 << bits, place
            for k in range(2, count + 1):
                before, here = here, (((2 * k - 1) * place * here >> bits) - (k - 1) * before) // k
            before, here = (context.ldexp(context.mpf(value), -bits) for value in (before, here))
            slope = count * (x * here - before) / (x * x - 1)
            step = here / slope
            x -= step
            if abs(step) <= context.mpf(10) ** -digits:
                break  # slope and P_(count-1) are known at the node up to this negligible step
        rule.append((x, 2 / ((1 - x * x) * slope**2), before))
    return tuple(rule)
