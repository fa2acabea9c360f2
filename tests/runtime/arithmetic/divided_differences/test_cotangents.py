"""The parts of divided differences of x*cot(x) agree with mpmath beside 0, across the branch about 0 and beyond it."""

import math
import random

import pytest
from mpmath import mp, mpf

from gqm_sym.runtime.arithmetic.divided_differences.cotangents import difference_of_sinc, divdiff1_difference_of_sinc

# In halves of an ulp of 1/6 and of 1/60, their sizes at 0. Worst on 1000 triples of each range: 3.4 and 6.9.
FIRST_ROUNDINGS, SECOND_ROUNDINGS = 4.0, 8.0


def _exact(x: mpf, y: mpf) -> mpf:
    return (mp.sinc(x + y) - mp.sinc(y - x)) / (4 * x * y)


@pytest.mark.parametrize(("low", "high"), [(1e-4, 0.3), (0.01, 3.1), (-3.0, -0.2), (3.3, 6.2), (7.0, 9.0)])
def test_differences_of_sinc(low: float, high: float) -> None:
    """Both have all digits for points at any distance, also where the poles of the cotangents cancel."""
    draw = random.Random(5)
    for _ in range(200):
        x, y, w = sorted(draw.uniform(low, high) for _ in range(3))
        if draw.random() < 0.3:
            y, w = x + 1e-4 * (y - x), x + 1e-4 * (w - x)
        h1, h2 = y - x, w - y
        y, w = x + h1, x + h1 + h2
        with mp.workdps(40):
            at = mpf(x), mpf(x) + mpf(h1), mpf(x) + mpf(h1) + mpf(h2)
            first = _exact(at[0], at[1])
            second = (_exact(at[1], at[2]) - first) / (at[2] - at[0])
        assert abs(difference_of_sinc(x, y, h1) - first) <= FIRST_ROUNDINGS * 2.0**-53 / 6.0
        assert abs(divdiff1_difference_of_sinc(x, y, w, h1, h2) - second) <= SECOND_ROUNDINGS * 2.0**-53 / 60.0


@pytest.mark.parametrize("x", [1e-3, 0.7, 3.0])
def test_points_that_coincide(x: float) -> None:
    """Over one place three times they are the function and its derivative, by mpmath's differentiation."""
    with mp.workdps(40):
        place = mpf(x)
        first = (mp.sinc(2 * place) - 1) / (4 * place**2)
        second = mp.diff(lambda w: _exact(place, w), place)
    assert math.isclose(difference_of_sinc(x, x, 0.0), first, rel_tol=1e-14)
    assert abs(divdiff1_difference_of_sinc(x, x, x, 0.0, 0.0) - second) <= SECOND_ROUNDINGS * 2.0**-53 / 60.0
