"""Sums, products and reductions of two doubles agree with exact rational arithmetic."""

import math
from collections.abc import Iterable
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from gqm_sym.runtime.arithmetic.doubledouble import add, minus, plus, reduce_many, two_product, two_sum

U = Fraction(1, 2**53)
# The bound is proved for the accurate sum of two pairs: Joldes, Muller, Popescu, ACM TOMS 44 (2017), theorem 3.1.
SUM_OF_PAIRS = 3 * U**2 / (1 - 4 * U)
# The error of the remainder of a time by the period: the product with the count is right to 2**-106 of itself, and two
# rounded additions follow, each within SUM_OF_PAIRS of numbers no larger than the time. The unit is 2**-106 of the
# time.
REDUCTION = 8

# In this range nothing overflows, and no error of a product falls below the smallest double.
SIZES = st.floats(2.0**-200, 2.0**200)
NUMBERS = st.one_of(st.just(0.0), SIZES, SIZES.map(lambda x: -x))
# A low part is given in units of the high part's last place, and is at most half of one.
SHARES = st.floats(-0.5, 0.5)
PERIODS = st.floats(1e-3, 1e3)
COUNTS = st.one_of(
    st.integers(-(2**52), 2**52),
    st.integers(-1000, 1000),
    st.integers(0, 52).map(lambda n: 2**n),
    st.integers(1, 52).map(lambda n: 2**n - 1),
)


def exact(parts: Iterable[float]) -> Fraction:
    """Return the exact sum of doubles."""
    return sum((Fraction(float(part)) for part in parts), Fraction(0))


def pair(high: float, share: float) -> tuple[float, float]:
    """Draw two doubles, the first of which is the double nearest to their sum."""
    low = share * math.ulp(high)
    return (high, low) if high + low == high else (high, 0.0)


def nearest_pair(value: Fraction) -> tuple[float, float]:
    """Return a rational number as two doubles."""
    high = float(value)
    return high, float(value - Fraction(high))


def reduced(t: tuple[float, float], period: tuple[float, float]) -> tuple[int, Fraction]:
    """Return the whole periods in a time, and exactly the remainder that the pair gives."""
    count, rest, low = reduce_many(np.array([t[0]]), np.array([t[1]]), *period)
    assert count[0] == int(count[0])
    return int(count[0]), exact((rest[0], low[0]))


@given(NUMBERS, NUMBERS)
def test_a_sum_and_its_error_are_exact(a: float, b: float) -> None:
    """The rounded sum is IEEE's own, and together with its error it is the exact sum, in Python and compiled."""
    s, e = two_sum(a, b)
    assert s == a + b
    assert exact((s, e)) == exact((a, b))
    assert two_sum.py_func(a, b) == (s, e)


@given(NUMBERS, NUMBERS)
def test_a_product_and_its_error_are_exact(a: float, b: float) -> None:
    """The rounded product is IEEE's own, and together with its error it is the exact product."""
    p, e = two_product(a, b)
    assert p == a * b
    assert exact((p, e)) == Fraction(a) * Fraction(b)


@given(NUMBERS, SHARES, NUMBERS, SHARES)
@example(1.0, 0.25, -1.0, 0.375)
@example(1.0, -0.5, -(1.0 - 2.0**-53), 0.5)
def test_pairs_add_to_the_proved_bound(a: float, a_share: float, b: float, b_share: float) -> None:
    """The sum of two pairs keeps its relative accuracy however much cancels, and is zero only if the exact sum is."""
    first, second = pair(a, a_share), pair(b, b_share)
    truth = exact((*first, *second))
    assert abs(exact(add(*first, *second)) - truth) <= SUM_OF_PAIRS * abs(truth)
    assert abs(exact(plus(first, second)) - truth) <= SUM_OF_PAIRS * abs(truth)
    apart = exact(first) - exact(second)
    assert abs(exact(minus(first, second)) - apart) <= SUM_OF_PAIRS * abs(apart)


@given(PERIODS, SHARES, COUNTS, st.floats(0.0, 1.0), SHARES)
def test_a_time_is_its_whole_periods_and_what_is_left(
    high: float, share: float, whole: int, part: float, t_share: float
) -> None:
    """Count and remainder add up to the time; the remainder is at least zero and less than a period, for negative times
    too.
    """
    period = pair(high, share)
    t = pair(float((whole + Fraction(part)) * exact(period)), t_share)
    count, rest = reduced(t, period)
    allowed = REDUCTION * U**2 * abs(exact(t))
    assert abs(count * exact(period) + rest - exact(t)) <= allowed
    assert -allowed <= rest < exact(period) + allowed


@given(PERIODS, SHARES, COUNTS)
@example(2.2, 0.3, 2**52)
@example(0.1, 0.0, 3)
@example(1.0, -0.5, 2**52 - 1)
def test_at_a_whole_count_of_periods(high: float, share: float, whole: int) -> None:
    """Exactly at a boundary the reduction ends, and the remainder is zero or one period, to rounding of the pair.

    This once alternated for ever.
    """
    period = pair(high, share)
    t = nearest_pair(whole * exact(period))
    count, rest = reduced(t, period)
    allowed = REDUCTION * U**2 * abs(exact(t))
    assert count in (whole, whole - 1)
    assert abs(rest - (whole - count) * exact(period)) <= allowed


@given(PERIODS, st.integers(-(2**52), 2**52))
def test_a_boundary_that_doubles_can_tell_is_kept(high: float, whole: int) -> None:
    """If the period and its multiple are exact, the count is exact and the remainder is zero."""
    period = math.ldexp(math.floor(math.ldexp(math.frexp(high)[0], 20)), -20)
    t = nearest_pair(whole * Fraction(period))
    assert exact(t) == whole * Fraction(period)
    assert reduced(t, (period, 0.0)) == (whole, 0)


@given(PERIODS, st.integers(-(2**40), 2**40))
def test_next_to_a_boundary_the_count_is_that_of_its_side(high: float, whole: int) -> None:
    """A double above a multiple of the period counts that period, and the double below it does not."""
    period = math.ldexp(math.floor(math.ldexp(math.frexp(high)[0], 12)), -12)
    boundary = whole * period
    assert Fraction(boundary) == whole * Fraction(period)
    for t in (math.nextafter(boundary, math.inf), math.nextafter(boundary, -math.inf)):
        count, rest = reduced((t, 0.0), (period, 0.0))
        assert count == math.floor(Fraction(t) / Fraction(period))
        assert abs(rest - (Fraction(t) - count * Fraction(period))) <= REDUCTION * U**2 * max(abs(Fraction(t)), 1)


@pytest.mark.parametrize(("t", "count"), [(0.0, 0), (-0.0, 0), (5e-324, 0), (1.0, 1), (-1.0, -1), (-0.25, -1)])
def test_at_and_about_zero(t: float, count: int) -> None:
    """Zero of either sign belongs to the first period, and a time before it to the period before."""
    assert reduced((t, 0.0), (1.0, 0.0)) == (count, Fraction(t) - count)


@given(PERIODS, SHARES, st.lists(st.tuples(COUNTS, st.floats(0.0, 1.0)), min_size=1, max_size=8))
def test_many_times_are_reduced_as_each_alone(high: float, share: float, places: list[tuple[int, float]]) -> None:
    """The other times in an array do not change a result."""
    period = pair(high, share)
    times = np.array([(whole + part) * high for whole, part in places])
    together = reduce_many(times, np.zeros_like(times), *period)
    for k, t in enumerate(times):
        alone = reduce_many(np.array([t]), np.zeros(1), *period)
        assert [float(column[k]) for column in together] == [float(column[0]) for column in alone]
