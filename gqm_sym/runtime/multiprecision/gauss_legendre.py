"""Gauss-Legendre quadrature in extended precision, by as many nodes as each panel needs."""

from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import pairwise
from math import ceil
from typing import Any

from gqm_sym.errors import SolutionError

# Nodes to begin with, and of the smallest rule.
FIRST, FEWEST = 20, 8

# Halvings of a panel; what is not smooth after so many is not analytic.
MOST_HALVINGS = 40


def gauss(context: Any, rate: Callable[[Any], Any], edges: Sequence[Any], digits: int) -> list[Any]:
    """The integral over each panel between edges of a function that is analytic on it.

    The rule with n nodes leaves about the coefficient 2n of the Legendre series, which falls geometrically: the square
    of its coefficient n. The last two that the nodes themselves tell say whether they were enough, and how many the
    next panel will take.

    Raises
    ------
    SolutionError
        If it is not analytic, as far as can be seen.
    """
    most = 2 * ceil(digits / 2) + 8
    settled = context.mpf(10) ** (-(digits // 2) - 2)
    count, parts = min(FIRST, most), []
    for left, right in pairwise(edges):
        total, pending, halvings = context.mpf(0), [right], 0
        while pending:
            value, tail = _panel(context, rate, left, pending[-1], count)
            if tail <= settled:
                total += value
                left = pending.pop()
            elif count < most:
                count = most
                continue
            elif halvings < MOST_HALVINGS:
                pending.append((left + pending[-1]) / 2)
                halvings += 1
                continue
            else:
                raise SolutionError("extended precision: the time of flight is not analytic where it should be")
            # From how fast the coefficients fell, by fours: every rule has to be made.
            fall = -float(context.log10(tail)) / count if tail else 2.0
            count = min(max(4 * ceil((digits / 2 + 4) / fall / 4), FEWEST), most)
        parts.append(total)
    return parts


def _panel(context: Any, rate: Callable[[Any], Any], left: Any, right: Any, count: int) -> tuple[Any, Any]:
    """The integral over one panel, and the size of its last Legendre coefficients against the first."""
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
    """Positive nodes of the Gauss-Legendre rule with an even number of them, weights, and P_(count-1) there."""
    import numpy as np
    from mpmath.ctx_mp import MPContext

    context = MPContext()
    context.dps = digits + 5
    guesses = np.polynomial.legendre.leggauss(count)[0]
    rule = []
    for guess in guesses[count // 2 :]:
        x = context.mpf(float(guess))
        for _ in range(digits.bit_length() + 2):
            before, here = context.mpf(1), x
            for k in range(2, count + 1):
                before, here = here, ((2 * k - 1) * x * here - (k - 1) * before) / k
            slope = count * (x * here - before) / (x * x - 1)
            step = here / slope
            x -= step
            if abs(step) <= context.mpf(10) ** -digits:
                break  # only now: the weight needs the slope at the node itself
        rule.append((x, 2 / ((1 - x * x) * slope**2), before))
    return tuple(rule)
