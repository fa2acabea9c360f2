"""The time at each edge of a segment's panels, as a running total of two doubles."""

import numpy as np
from numba import types

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.types import MATRIX, REAL, VECTOR

# The number of partial sums of a row of numbers, and the largest row that is not halved first.
PARTIAL_SUMS, MAX_ROW = 8, 128

# More halves than can be pending, because each of them is at most some half of the one before.
MAX_PENDING = 128


@Inner
def sum_of_row(values, begin, count):  # type: ignore[no-untyped-def]
    """Return the sum of ``count`` numbers from ``begin`` on, by PARTIAL_SUMS partial sums."""
    total, whole = 0.0, count - count % PARTIAL_SUMS
    if whole > 0:
        a, b, c, d = values[begin], values[begin + 1], values[begin + 2], values[begin + 3]
        e, f, g, h = values[begin + 4], values[begin + 5], values[begin + 6], values[begin + 7]
        for i in range(begin + PARTIAL_SUMS, begin + whole, PARTIAL_SUMS):
            a, b, c, d = a + values[i], b + values[i + 1], c + values[i + 2], d + values[i + 3]
            e, f, g, h = e + values[i + 4], f + values[i + 5], g + values[i + 6], h + values[i + 7]
        total = ((a + b) + (c + d)) + ((e + f) + (g + h))
    for i in range(begin + whole, begin + count):
        total += values[i]
    return total


@Inner
def pairwise_sum(values):  # type: ignore[no-untyped-def]
    """Return the sum of numbers in the order of ``numpy.sum``, whose rounding error grows with the logarithm of their
    number: more than MAX_ROW numbers are halved, and the sums of both halves are added.
    """
    pending, sums = np.empty(MAX_PENDING, dtype=np.int64), np.empty(MAX_PENDING)
    pending[0], left, begin, found = values.size, 1, 0, 0
    while left > 0:
        left -= 1
        count = pending[left]
        if count < 0:  # both halves have been summed
            found -= 1
            sums[found - 1] += sums[found]
        elif count > MAX_ROW:
            half = count // 2 - (count // 2) % PARTIAL_SUMS
            pending[left], pending[left + 1], pending[left + 2] = -1, count - half, half
            left += 3
        else:
            sums[found] = sum_of_row(values, begin, count)
            begin, found = begin + count, found + 1
    return sums[0]


@Inner
def totals_of(terms, duration):  # type: ignore[no-untyped-def]
    """Return the running totals of the panels' times as two doubles each, scaled to end at ``duration``.

    ``terms`` are the Legendre coefficients of the time on each panel.
    """
    n, total = terms.shape[0], 0.0
    own, high, low = np.empty(n), np.zeros(n + 1), np.zeros(n + 1)
    for k in range(n):
        own[k] = sum_of_row(terms[k], 0, terms.shape[1])  # all Legendre polynomials are 1 at the right edge
    total = pairwise_sum(own)
    scale = duration / (total if total != 0.0 else 1.0)  # all times are 0 if both ends are the same place
    for k in range(n - 1):
        high[k + 1], rounding = two_sum(high[k], own[k] * scale)
        low[k + 1] = low[k] + rounding
    high[n] = duration
    return high, low


@entry(types.UniTuple(VECTOR, 2)(MATRIX, REAL), checked=False)
def running_totals(terms, duration):  # type: ignore[no-untyped-def]
    """Call `totals_of` from Python."""
    return totals_of(terms, duration)
