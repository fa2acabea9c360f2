"""The parts into which sweeps split sines, cosines and hyperbolic functions about the middle of an orbit agree with
mpmath.
"""

import math
import random

import pytest
from mpmath import mp, mpf

from gqm_sym.runtime.arithmetic.divided_differences.trigonometric import (
    MAX_HYPERBOLIC_SPAN,
    MAX_WAVE_SPAN,
    difference_of_sech,
    difference_of_sinhc,
    divdiff1_cos_in_square,
    divdiff1_cosh_in_square,
    divdiff1_sinc_in_square,
    divdiff1_sinhc_in_square,
    divdiff2_cosh_near,
    divdiff2_sinh_near,
    mean_sech,
    sinc_near,
    sinhc_near,
    sum_of_sinhc,
)

# The absolute tolerances of values up to 1/2, 1/6 and 1. Worst on 2000 pairs: 1.1e-16, 5.0e-17, 2.4e-16.
EVEN, ODD, SINC = 1.5e-16, 8e-17, 3e-16
# The relative tolerance of second differences of cosh, and of sinh for points of one sign. Worst on 1000 triples of
# points: 8.0e-16, most of it from the rounding of exponential functions.
HYPERBOLIC = 1e-15
# The relative tolerances of the factors of second differences of hyperbolic functions, and the absolute one of the
# second difference of tanh, which is up to 0.38. Worst on 2000 and 1000 triples: 2.9e-16, 1.9e-16.
FACTOR, TANH = 4e-16, 3e-16


def pairs(count: int) -> list[tuple[float, float]]:
    """Draw gaps to both ends of orbits of all sizes."""
    draw = random.Random(4)
    found = []
    for _ in range(count):
        h = min(10.0 ** draw.uniform(-8.0, math.log10(MAX_WAVE_SPAN)), 0.999 * MAX_WAVE_SPAN)
        share = draw.choice((draw.random(), 10.0 ** -draw.uniform(0.0, 12.0)))
        found.append((2.0 * h * share, 2.0 * h * (1.0 - share)))
    return found


@pytest.mark.extended
def test_second_differences_about_the_middle() -> None:
    """Second differences of cos and sin over -h, v, h are right from the gaps alone."""
    for h1, h2 in pairs(2000):
        with mp.workdps(80):
            h, v = (mpf(h1) + mpf(h2)) / 2, (mpf(h1) - mpf(h2)) / 2
            below = v**2 - h**2
            even, odd = (mp.cos(v) - mp.cos(h)) / below, (mp.sinc(v) - mp.sinc(h)) / below
            assert abs(divdiff1_cos_in_square(h1, h2) - even) <= EVEN
            assert abs(divdiff1_sinc_in_square(h1, h2) - odd) <= ODD
            assert abs(sinc_near(float(h)) - mp.sinc(mpf(float(h)))) <= SINC


def test_wider_than_a_turn_it_is_nan() -> None:
    """An orbit wider than a turn has no such form, and the result is NaN."""
    assert math.isnan(divdiff1_cos_in_square(MAX_WAVE_SPAN, 1.001 * MAX_WAVE_SPAN))
    with mp.workdps(40):
        h, v = (
            (mpf(MAX_WAVE_SPAN) + mpf(0.999 * MAX_WAVE_SPAN)) / 2,
            (mpf(MAX_WAVE_SPAN) - mpf(0.999 * MAX_WAVE_SPAN)) / 2,
        )
        truth = (mp.cos(v) - mp.cos(h)) / (v**2 - h**2)
        assert abs(divdiff1_cos_in_square(MAX_WAVE_SPAN, 0.999 * MAX_WAVE_SPAN) - truth) <= EVEN


def test_second_differences_of_hyperbolic_functions() -> None:
    """The closed forms keep their digits up to the widest orbits that they are for, and are NaN beyond."""
    draw = random.Random(7)
    for _ in range(1000):
        left, right = (draw.random() * MAX_HYPERBOLIC_SPAN for _ in range(2))
        middle = left + draw.uniform(0.5, 2.0)
        points = (middle - left, middle, middle + right)
        with mp.workdps(60):
            x, y, w = mpf(middle) - mpf(left), mpf(middle), mpf(middle) + mpf(right)
            for function, found in ((mp.cosh, divdiff2_cosh_near), (mp.sinh, divdiff2_sinh_near)):
                slopes = (function(y) - function(x)) / (y - x), (function(w) - function(y)) / (w - y)
                truth = (slopes[1] - slopes[0]) / (w - x)
                assert abs(found(*points, left, right) / truth - 1) <= HYPERBOLIC
    assert math.isnan(divdiff2_cosh_near(-2.1, 0.0, 2.1, 2.1, 2.1))
    assert math.isnan(divdiff2_sinh_near(-2.1, 0.0, 2.1, 2.1, 2.1))


def test_factors_of_second_differences_of_hyperbolic_functions() -> None:
    """Those of cosh and of sinh(h)/h in the square are right to a few last places, from the gaps alone."""
    wide = MAX_HYPERBOLIC_SPAN / MAX_WAVE_SPAN
    for h1, h2 in ((wide * h1, wide * h2) for h1, h2 in pairs(2000)):
        with mp.workdps(80):
            h, v = (mpf(h1) + mpf(h2)) / 2, (mpf(h1) - mpf(h2)) / 2
            below = v**2 - h**2
            even = (mp.cosh(v) - mp.cosh(h)) / below
            odd = ((mp.sinh(v) / v if v else mpf(1)) - mp.sinh(h) / h) / below
            assert abs(divdiff1_cosh_in_square(h1, h2) / even - 1) <= FACTOR
            assert abs(divdiff1_sinhc_in_square(h1, h2) / odd - 1) <= FACTOR
            assert abs(sinhc_near(float(h)) * mpf(float(h)) / mp.sinh(mpf(float(h))) - 1) <= FACTOR
    assert math.isnan(divdiff1_cosh_in_square(MAX_HYPERBOLIC_SPAN, 1.001 * MAX_HYPERBOLIC_SPAN))


@pytest.mark.extended
def test_second_difference_of_the_hyperbolic_tangent() -> None:
    """Its factors of both ends and of the gaps give it up to the widest orbits that they are for."""
    draw = random.Random(8)
    for _ in range(1000):
        left, right = (draw.random() * MAX_HYPERBOLIC_SPAN for _ in range(2))
        middle = draw.uniform(-3.0, 3.0)
        with mp.workdps(60):
            x, y, w = mpf(middle) - mpf(left), mpf(middle), mpf(middle) + mpf(right)
            slopes = (mp.tanh(y) - mp.tanh(x)) / (y - x), (mp.tanh(w) - mp.tanh(y)) / (w - y)
            truth = (slopes[1] - slopes[0]) / (w - x)
            ends = float(x), float(w)
            odd = mean_sech(*ends) * difference_of_sinhc(left, right)
            even = 0.5 * difference_of_sech(*ends, float(w - x)) * sum_of_sinhc(left, right)
            assert abs((odd + even) / math.cosh(middle) - truth) <= TANH
    assert math.isnan(sum_of_sinhc(2.1, 2.1))
