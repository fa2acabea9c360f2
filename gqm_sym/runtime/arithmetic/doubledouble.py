"""Sums and products of two doubles kept exactly, for the reduction of a time by its period (MATHS, section 5)."""

from math import floor

import numpy as np
from numba import types

from gqm_sym.runtime.compiled.jit import Inlined, Inner, entry
from gqm_sym.runtime.compiled.types import REAL, VECTOR

# The distance from 1.0 to the next double.
ULP = 2.220446049250313e-16


@Inlined
def two_sum(a, b):  # type: ignore[no-untyped-def]
    """Return the rounded sum a + b and its error (Knuth)."""
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


@Inner
def two_product(a, b):  # type: ignore[no-untyped-def]
    """Return the rounded product a * b and its error (Dekker, Veltkamp)."""
    p = a * b
    c = 134217729.0 * a
    a_hi = c - (c - a)
    a_lo = a - a_hi
    c = 134217729.0 * b
    b_hi = c - (c - b)
    b_lo = b - b_hi
    return p, ((a_hi * b_hi - p) + a_hi * b_lo + a_lo * b_hi) + a_lo * b_lo


@Inner
def add(a, a_low, b, b_low):  # type: ignore[no-untyped-def]
    """Return (a + a_low) + (b + b_low) as two doubles, accurate however much cancels."""
    s, e = two_sum(a, b)
    t, f = two_sum(a_low, b_low)
    s, e = two_sum(s, e + t)
    return two_sum(s, e + f)


@Inner
def reduce(t, t_low, period, period_low):  # type: ignore[no-untyped-def]
    """Return the number of whole periods in t, and the remainder in [0, period) as two doubles.

    The product count * period is exact up to 2**-106 of itself. So the remainder is accurate to half an ulp of the
    period for counts up to 2**52.
    """
    count = float(floor(t / period))
    whole, error = two_product(count, period)
    remainder, remainder_low = add(t, t_low, -whole, -(error + count * period_low))
    # The quotient was rounded, so the count may be wrong by one. Only one correction is made, so that rounding at a
    # boundary cannot alternate between two counts.
    if remainder < 0.0 or (remainder == 0.0 and remainder_low < 0.0):
        count -= 1.0
        remainder, remainder_low = add(remainder, remainder_low, period, period_low)
    else:
        over, over_low = add(remainder, remainder_low, -period, -period_low)
        if over > 0.0 or (over == 0.0 and over_low >= 0.0):
            count += 1.0
            remainder, remainder_low = over, over_low
    return count, remainder, remainder_low


Pair = tuple[float, float]
ZERO: Pair = (0.0, 0.0)


def plus(a: Pair, b: Pair) -> Pair:
    """Return the sum of two numbers of two doubles each."""
    s, e = two_sum.py_func(a[0], b[0])
    t, f = two_sum.py_func(a[1], b[1])
    s, e = two_sum.py_func(s, e + t)
    return two_sum.py_func(s, e + f)  # type: ignore[no-any-return]


def minus(a: Pair, b: Pair) -> Pair:
    """Return the difference of two numbers of two doubles each."""
    return plus(a, (-b[0], -b[1]))


@entry(types.Tuple((VECTOR, VECTOR, VECTOR))(VECTOR, VECTOR, REAL, REAL))
def reduce_many(t, t_low, period, period_low):  # type: ignore[no-untyped-def]
    """Call `reduce` for many times from Python."""
    count, remainder, remainder_low = np.empty(t.size), np.empty(t.size), np.empty(t.size)
    for i in range(t.size):
        count[i], remainder[i], remainder_low[i] = reduce(t[i], t_low[i], period, period_low)
    return count, remainder, remainder_low
