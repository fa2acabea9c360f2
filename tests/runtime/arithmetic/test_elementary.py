"""Elementary functions that vectorise agree with mpmath with digits to spare."""

import math
import random
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from mpmath import mp, mpf
from numba import njit

from gqm_sym.runtime.arithmetic import elementary

# Worst measured on 5000 arguments of each kind: 0.75 (cosine), 0.62 (exp), 0.93 (sinh), 0.86 (cosh).
ULPS = 1.0
# The same where the argument is a ratio, which takes one more sum. Worst measured on 20,000 arguments: 1.05.
RATIO_ULPS = 1.1
DIGITS = 60
# The number of roundings of a very large argument that its sine may correspond to. Worst measured: 5.
LARGE = 8
# Below this the rounding of the last sum of the argument's low parts counts, which is 2**-106 of the argument.
SMALL_SINE = 1e-12
COUNT = 500

FUNCTIONS: dict[str, Callable[[mpf], mpf]] = {"sin": mp.sin, "cos": mp.cos}

# Kinds of arguments, and strategies that draw them.
KINDS: dict[str, Callable[[random.Random], float]] = {
    "kernel": lambda source: source.uniform(-0.8, 0.8),
    "turns": lambda source: source.uniform(-10, 10),
    "many turns": lambda source: source.uniform(-1e6, 1e6),
    "a thousand times more": lambda source: source.uniform(-1e9, 1e9),
    "tiny": lambda source: source.choice((-1, 1)) * 10.0 ** source.uniform(-310, -1),
    "next to a quarter turn": lambda source: float(source.randrange(-600000, 600000) * mp.pi / 2),
    "where kernels meet": lambda source: float((source.randrange(-600000, 600000) + mpf("0.5")) * mp.pi / 2),
}


def arguments(name: str) -> Iterator[float]:
    """Draw arguments of one kind."""
    source = random.Random(name)
    return (KINDS[name](source) for _ in range(COUNT))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", FUNCTIONS)
def test_error_is_below_one_last_place(name: str, kind: str) -> None:
    """The error is below one last place everywhere up to 1e9, also next to zeros."""
    with mp.workdps(DIGITS):
        for x in arguments(kind):
            truth = FUNCTIONS[name](mpf(x))
            error = abs(mpf(getattr(elementary, name)(x)) - truth) / mpf(np.spacing(abs(float(truth))))
            assert error <= ULPS, x


@pytest.mark.parametrize("name", FUNCTIONS)
def test_no_rounding_of_a_sum_counts(name: str) -> None:
    """The sine of a phase and a rate times a place in two doubles and an offset is that of the exact sum."""
    source = random.Random(name)
    with mp.workdps(DIGITS):
        for _ in range(COUNT):
            phase, rate, middle, offset = (source.uniform(-size, size) for size in (3.0, 9.0, 20.0, 2.0))
            rest = source.uniform(-0.5, 0.5) * np.spacing(middle)
            truth = FUNCTIONS[name](phase + mpf(rate) * (mpf(middle) + rest + offset))
            found = getattr(elementary, f"{name}_of_sum")(phase, rate, middle, rest, offset)
            assert abs(mpf(found) - truth) <= ULPS * np.spacing(max(abs(float(truth)), SMALL_SINE))


GROWING: dict[str, Callable[[mpf], mpf]] = {"exp": mp.exp, "sinh": mp.sinh, "cosh": mp.cosh}


@pytest.mark.parametrize("reach", [1e-9, 0.4, 1.0, 2.0, 20.0, 708.0])
@pytest.mark.parametrize("name", GROWING)
def test_growing_functions_too(name: str, reach: float) -> None:
    """Growing functions are right up to where they overflow, and next to zero."""
    source = random.Random(name)
    with mp.workdps(DIGITS):
        for _ in range(COUNT):
            x = source.uniform(-reach, reach)
            truth = GROWING[name](mpf(x))
            error = abs(mpf(getattr(elementary, name)(x)) - truth) / mpf(np.spacing(abs(float(truth))))
            assert error <= ULPS, x


@pytest.mark.parametrize("reach", [1e-9, 1.0, 20.0, 70.0])
def test_no_rounding_of_a_ratio_counts(reach: float) -> None:
    """The hyperbolic sine of a number times another and divided by a third is that of the exact ratio."""
    source = random.Random(reach)
    with mp.workdps(DIGITS):
        for _ in range(COUNT):
            above, below, x = source.uniform(1.0, 9.0), source.uniform(1.0, 9.0), source.uniform(-reach, reach)
            truth = mp.sinh(mpf(above) * mpf(x) / mpf(below))
            error = abs(mpf(elementary.sinh_of_ratio(above, x, below)) - truth) / np.spacing(abs(float(truth)))
            assert error <= RATIO_ULPS


@pytest.mark.parametrize("reach", [1e-300, 1e-9, 0.1, 0.4, 0.6, 1.2, 3.0, 20.0, 1e300])
def test_hyperbolic_tangent(reach: float) -> None:
    """The hyperbolic tangent is right next to zero and up to where it is 1. Worst measured: 0.61."""
    source = random.Random(reach)
    with mp.workdps(DIGITS):
        for _ in range(COUNT):
            x = source.uniform(-reach, reach)
            truth = mp.tanh(mpf(x))
            assert abs(mpf(elementary.tanh(x)) - truth) <= ULPS * mpf(np.spacing(abs(float(truth)))), x
    assert [elementary.tanh(x) for x in (math.inf, -math.inf)] == [1.0, -1.0]
    assert [math.copysign(1.0, elementary.tanh(x)) for x in (0.0, -0.0)] == [1.0, -1.0]
    assert math.isnan(elementary.tanh(math.nan))


@pytest.mark.parametrize("power", [-300, -15, -8, -2, 0, 2, 15, 300])
def test_logarithm_next_to_one(power: int) -> None:
    """The logarithm of 1 + x is right for all x >= 0. Worst measured: 0.73."""
    source = random.Random(power)
    with mp.workdps(DIGITS + 320):
        for _ in range(COUNT // 2):
            x = source.uniform(0.1, 10.0) * 10.0**power
            truth = mp.log1p(mpf(x))
            assert abs(mpf(elementary.log1p(x)) - truth) <= ULPS * mpf(np.spacing(float(truth))), x
    assert [elementary.log1p(x) for x in (0.0, math.inf)] == [0.0, math.inf]
    assert math.isnan(elementary.log1p(math.nan))


@pytest.mark.parametrize("reach", [1e-300, 1e-9, 0.5, 1.0, 2.0, 3.0, 1e3, 1e20, 1e300])
def test_arc_tangent(reach: float) -> None:
    """The arc tangent is right in all three of its forms."""
    source = random.Random(reach)
    with mp.workdps(DIGITS):
        for _ in range(COUNT):
            x = source.uniform(-reach, reach)
            truth = mp.atan(mpf(x))
            assert abs(mpf(elementary.atan(x)) - truth) <= ULPS * mpf(np.spacing(abs(float(truth)))), x


@pytest.mark.parametrize("reach", [1e-300, 1e-9, 1.0, 1e9, 1e300])
def test_angle_of_a_direction(reach: float) -> None:
    """The angle of a direction is right in all quadrants, and 0 where there is none. Worst measured: 1.5."""
    source = random.Random(reach)
    with mp.workdps(DIGITS):
        for _ in range(COUNT):
            x, y = source.uniform(-reach, reach), source.uniform(-1.0, 1.0)
            truth = mp.atan2(mpf(y), mpf(x))
            assert abs(mpf(elementary.atan2(y, x)) - truth) <= 2 * mpf(np.spacing(abs(float(truth)))), (y, x)
    quarter = math.pi / 2
    axes = {(0.0, 1.0): 0.0, (1.0, 0.0): quarter, (0.0, -1.0): math.pi, (-1.0, 0.0): -quarter, (0.0, 0.0): 0.0}
    assert all(elementary.atan2(*direction) == angle for direction, angle in axes.items())
    assert math.isnan(elementary.atan2(math.nan, 1.0))
    assert math.isnan(elementary.atan2(1.0, math.nan))


def test_limits_of_the_arc_tangent() -> None:
    """The arc tangent is a quarter turn at infinity, and keeps signed zeros and NaN."""
    assert [elementary.atan(x) for x in (math.inf, -math.inf)] == [math.pi / 2, -math.pi / 2]
    assert [math.copysign(1.0, elementary.atan(x)) for x in (0.0, -0.0)] == [1.0, -1.0]
    assert math.isnan(elementary.atan(math.nan))


@pytest.mark.parametrize("power", [-1022, -700, -2, -1, 0, 1, 53, 1022])
def test_inverse_root(power: int) -> None:
    """The inverse root is right from the smallest normal numbers to the largest, over a whole period of its first
    guess.
    """
    source = random.Random(power)
    with mp.workdps(DIGITS):
        for x in (math.ldexp(source.uniform(1.0, 2.0), power + odd) for odd in (0, 1) for _ in range(COUNT)):
            truth = 1 / mp.sqrt(mpf(x))
            assert abs(mpf(elementary.inverse_root(x)) - truth) <= ULPS * mpf(np.spacing(float(truth))), x


@pytest.mark.parametrize("x", [0.0, -0.0, 710.4, -710.4, 709.782712893384, 750.0, -745.0, -750.0, math.inf, -math.inf])
@pytest.mark.parametrize("name", GROWING)
def test_limits_are_those_of_the_library(name: str, x: float) -> None:
    """At overflow, underflow, signed zeros, infinities and NaN the results are those of the library."""
    with np.errstate(over="ignore"):
        expected = float(getattr(np, name)(x))
    actual = getattr(elementary, name)(x)
    assert actual == expected or abs(actual - expected) <= 1e-15 * abs(expected)
    assert math.copysign(1.0, actual) == math.copysign(1.0, expected)
    assert math.isnan(getattr(elementary, name)(math.nan))


@pytest.mark.parametrize("x", [3e11, -7.7e13, 1.2e15, 8e15, -4.3e16, 1e17, 6e22, 1e300, -1.7e308])
@pytest.mark.parametrize("name", FUNCTIONS)
def test_beyond_it_is_that_of_an_argument_nearby(name: str, x: float) -> None:
    """Beyond the limit the result is the sine of x*(1 + eps), with eps a few roundings; if such arguments span a turn,
    it is anything from -1 to 1.
    """
    value = getattr(elementary, name)(x)
    assert -1.0 <= value <= 1.0
    with mp.workdps(400):
        reach = LARGE * abs(mpf(x)) * mpf(2) ** -53
        truth, slope = FUNCTIONS[name](mpf(x)), 1.0
        assert reach > 1 or abs(mpf(value) - truth) <= slope * reach + 1e-16


@pytest.mark.parametrize("x", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("name", FUNCTIONS)
def test_what_is_not_a_finite_number_gives_nan(name: str, x: float) -> None:
    """NaN and infinities give NaN without a warning."""
    assert math.isnan(getattr(elementary, name)(x))


def test_zero_keeps_its_sign() -> None:
    """Signed zeros keep their signs, as in the C library."""
    assert math.copysign(1.0, elementary.sin(-0.0)) == -1.0
    assert math.copysign(1.0, elementary.sin(0.0)) == 1.0
    assert elementary.cos(0.0) == 1.0


def test_a_loop_fills_vector_registers() -> None:
    """LLVM turns the loop into one over packed doubles, without branches and calls."""
    sin, cos = elementary.sin, elementary.cos

    @njit(error_model="numpy")
    def both(x: np.ndarray, out: np.ndarray) -> None:
        for i in range(x.size):
            out[i] = sin(x[i]) + cos(x[i])

    x = np.linspace(-9.0, 9.0, 1001)
    out = np.empty_like(x)
    both(x, out)
    assert np.abs(out - (np.sin(x) + np.cos(x))).max() <= 4e-16
    assert " x double>" in both.inspect_llvm(both.signatures[0])


@pytest.mark.parametrize("reach", [1e-300, 1e-9, 0.4, 1.0, 3.0, 45.0, 1e300])
def test_what_is_lost_in_falling(reach: float) -> None:
    """exp(x) - 1 for x <= 0 is right to the last place, also next to zero."""
    source = random.Random(reach)
    with mp.workdps(DIGITS):
        for _ in range(COUNT):
            x = -reach * source.random()
            truth = mp.expm1(mpf(x))
            error = abs(mpf(elementary.expm1_below(x)) - truth) / mpf(np.spacing(abs(float(truth))))
            assert error <= ULPS, x
