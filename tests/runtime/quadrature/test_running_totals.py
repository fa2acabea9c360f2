"""The times at the edges of panels are totals of two doubles each."""

from fractions import Fraction
from itertools import accumulate

import numpy as np
import pytest

from gqm_sym.runtime.quadrature.running_totals import MAX_ROW, PARTIAL_SUMS, pairwise_sum, running_totals

SIZES = [1, PARTIAL_SUMS - 1, PARTIAL_SUMS, 2 * PARTIAL_SUMS + 5, MAX_ROW, MAX_ROW + 1, 2 * MAX_ROW + 17, 5000]


@pytest.mark.parametrize("size", SIZES)
def test_sums_in_the_order_of_numpy(size: int) -> None:
    """The sum is that of NumPy to the last bit, for few numbers and for many."""
    values = np.random.default_rng(size).normal(size=size) * 10.0 ** np.random.default_rng(7).integers(-9, 9, size)
    assert pairwise_sum(values).hex() == float(values.sum()).hex()


@pytest.mark.parametrize("panels", SIZES)
def test_totals_have_the_digits_of_two_doubles(panels: int) -> None:
    """The totals are the exact sums of the panels' times, up to a rounding of their low parts."""
    times = np.random.default_rng(panels).uniform(0.5, 2.0, panels)
    terms = np.zeros((panels, 22))
    terms[:, 0] = times
    high, low = running_totals(terms, float(times.sum()))  # so that no time is scaled
    exact = [*accumulate(map(Fraction, times.tolist()), initial=Fraction(0))]
    for k in range(panels):
        error = abs(Fraction(high[k]) + Fraction(low[k]) - exact[k])
        assert error <= exact[k] * k * Fraction(2) ** -104
    assert (high[-1], low[-1]) == (times.sum(), 0.0)


def test_totals_of_no_time() -> None:
    """If both ends of a segment are the same place, all times are zero."""
    high, low = running_totals(np.zeros((3, 22)), 0.0)
    assert high.tolist() == low.tolist() == [0.0] * 4
