"""The parts into which sweeps split sines and cosines about the middle of an orbit agree with mpmath."""

import math
import random

from mpmath import mp, mpf

from gqm_sym.runtime.arithmetic.divided_differences.trigonometric import (
    MAX_HYPERBOLIC_SPAN,
    MAX_WAVE_SPAN,
    divdiff1_cos_in_square,
    divdiff1_sinc_in_square,
    divdiff2_cosh_near,
    divdiff2_sinh_near,
    sinc_near,
)

# The absolute tolerances of values up to 1/2, 1/6 and 1. Worst on 2000 pairs: 1.1e-16, 5.0e-17, 2.4e-16.
EVEN, ODD, SINC = 1.5e-16, 8e-17, 3e-16
# The relative tolerance of second differences of cosh, and of sinh for points of one sign. Worst on 1000 triples of
# points: 8.0e-16, most of it from the rounding of exponential functions.
HYPERBOLIC = 1e-15


def pairs(count: int) -> list[tuple[float, float]]:
    """Draw gaps to both ends of orbits of all sizes."""
    draw = random.Random(4)
    found = []
    for _ in range(count):
        h = min(10.0 ** draw.uniform(-8.0, math.log10(MAX_WAVE_SPAN)), 0.999 * MAX_WAVE_SPAN)
        share = draw.choice((draw.random(), 10.0 ** -draw.uniform(0.0, 12.0)))
        found.append((2.0 * h * share, 2.0 * h * (1.0 - share)))
    return found


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
