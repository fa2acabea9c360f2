"""Intervals contain what they must, are tight where signs depend on it, and are never NaN."""

import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from mpmath import mp, mpf

from gqm_sym.runtime.arithmetic import intervals

Interval = tuple[float, float]

ALL = (-math.inf, math.inf)
# The widening of both ends: that for the C library's functions, and the rounding.
WIDTH = 2 * (2.0**-50 + 2.0**-52)
DIGITS = 40
# This is large enough for every overflow and underflow, while mpmath is still fast.
LARGEST = 1e9

UNARY = {
    "exp": (mp.exp, -LARGEST, LARGEST),
    "sin": (mp.sin, -LARGEST, LARGEST),
    "cos": (mp.cos, -LARGEST, LARGEST),
    "tan": (mp.tan, -LARGEST, LARGEST),
    "sinh": (mp.sinh, -LARGEST, LARGEST),
    "cosh": (mp.cosh, -LARGEST, LARGEST),
    "tanh": (mp.tanh, -LARGEST, LARGEST),
    "atan": (mp.atan, -1e300, 1e300),
    "asinh": (mp.asinh, -1e150, 1e150),
    "abs": (abs, -1e300, 1e300),
    "sqrt": (mp.sqrt, 0.0, 1e300),
    "log": (mp.log, 5e-324, 1e300),
    "acosh": (mp.acosh, 1.0, 1e300),
    "asin": (mp.asin, -1.0, 1.0),
    "acos": (mp.acos, -1.0, 1.0),
    "atanh": (mp.atanh, math.nextafter(-1.0, 0.0), math.nextafter(1.0, 0.0)),
}

wide = st.floats(-1e300, 1e300)
near = st.floats(-10.0, 10.0)
exponents = st.integers(-12, 12)


def holds(interval: Interval, true: mpf) -> bool:
    """Return whether the exact number lies in the interval."""
    return mpf(interval[0]) <= true <= mpf(interval[1])


def drawn(data: st.DataObject, low: float, high: float) -> tuple[Interval, float]:
    """Draw an interval and a number in it, often close to each other or to the ends of the domain."""
    narrow = st.floats(max(low, -10.0), min(high, 10.0))
    lo, hi = sorted(data.draw(st.tuples(*[narrow | st.floats(low, high)] * 2)))
    inside = st.just(lo) if lo == hi else st.floats(lo, hi) | st.sampled_from([lo, hi])
    return (lo, hi), data.draw(inside)


@pytest.mark.parametrize("name", UNARY)
@given(data=st.data())
def test_function_holds_every_value(name: str, data: st.DataObject) -> None:
    """The value at a number in the interval lies in the bounds, overflow and underflow included."""
    true, low, high = UNARY[name]
    interval, x = drawn(data, low, high)
    bounds = getattr(intervals, f"i{name}")(interval)
    with mp.workdps(DIGITS):
        assert holds(bounds, true(mpf(x))), f"i{name}({interval}) = {bounds} misses {name}({x!r})"


@pytest.mark.sample(3)
@pytest.mark.parametrize("name", UNARY)
@given(data=st.data())
def test_function_of_a_number_is_tight(name: str, data: st.DataObject) -> None:
    """A point gives an interval of a few ulps."""
    _true, low, high = UNARY[name]
    x = data.draw(st.floats(max(low, -3.0), min(high, 3.0), allow_subnormal=False))
    lo, hi = getattr(intervals, f"i{name}")((x, x))
    assume(name != "tan" or abs(abs(x) - math.pi / 2) >= 1e-12)  # otherwise a pole is too close
    if name in ("sin", "cos") and math.cos(2 * x) ** 2 > 1 - 1e-14:
        assert hi - lo <= 1e-14  # a zero or an extremum is too close
    else:
        assert hi - lo <= WIDTH * max(abs(lo), abs(hi)) + 1e-322


BINARY: dict[str, Callable[[Fraction, Fraction], Fraction]] = {
    "add": lambda x, y: x + y,
    "mul": lambda x, y: x * y,
    "div": lambda x, y: x / y,
}


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", BINARY)
@given(data=st.data())
def test_arithmetic_holds_every_value(name: str, data: st.DataObject) -> None:
    """The result x op y lies in X op Y, in exact rational arithmetic."""
    (a, x), (b, y) = drawn(data, -1e300, 1e300), drawn(data, -1e300, 1e300)
    assume(name != "div" or y != 0.0)
    lo, hi = getattr(intervals, f"i{name}")(a, b)
    true = BINARY[name](Fraction(x), Fraction(y))
    assert lo == -math.inf or Fraction(lo) <= true
    assert hi == math.inf or true <= Fraction(hi)


@given(data=st.data(), n=exponents)
def test_whole_powers_hold_every_value(data: st.DataObject, n: int) -> None:
    """The power x**n lies in X**n, poles included."""
    interval, x = drawn(data, -1e60, 1e60)
    assume(n >= 0 or x != 0.0)
    with mp.workdps(DIGITS):
        assert holds(intervals.ipow(interval, n), mpf(x) ** n)


@given(data=st.data(), p=st.floats(-12.0, 12.0))
def test_real_powers_hold_every_value(data: st.DataObject, p: float) -> None:
    """The power x**p lies in X**p, also for the exponents that p may be the rounding of."""
    interval, x = drawn(data, 0.0, 1e300)
    assume(p >= 0 or x != 0.0)
    bounds = intervals.irpow(interval, p)
    with mp.workdps(DIGITS):
        for share in (-1, 0, 1):
            assert holds(bounds, mpf(x) ** (mpf(p) * (1 + share * mpf(2) ** -53)))


@given(a=st.tuples(*[st.floats(allow_nan=True)] * 2), b=st.tuples(*[st.floats(allow_nan=True)] * 2))
def test_never_nan(a: Interval, b: Interval) -> None:
    """No bound is NaN for any input, even NaN and infinities."""
    assume(not (a[0] > a[1] or b[0] > b[1]))  # NaN is accepted
    results = [getattr(intervals, f"i{name}")(a, b) for name in BINARY]
    results += [intervals.ipow(a, 2), intervals.ipow(a, 3), intervals.ipow(a, -1), intervals.ipow(a, -2)]
    results += [intervals.irpow(a, 0.3), intervals.irpow(a, -0.3)]
    results += [getattr(intervals, f"i{name}")(a) for name in UNARY if name != "abs"]
    for bounds in results:
        assert bounds[0] <= bounds[1]


# A row has an operation, its arguments, which end of the result is meant (None: both), and the expected value.
EXACT = [
    (intervals.ipow, [(-2.0, 1.0), 2], 0, 0.0),
    (intervals.ipow, [(-2.0, 1.0), 4], 0, 0.0),
    (intervals.iabs, [(-2.0, 1.0)], None, (0.0, 2.0)),
    (intervals.isqrt, [(0.0, 0.0)], None, (0.0, 0.0)),
    (intervals.imul, [(0.0, 3.0), (-math.inf, math.inf)], None, ALL),
    (intervals.imul, [(0.0, 0.0), ALL], None, (0.0, 0.0)),
    (intervals.imul, [(0.0, 1e-200), (0.0, 1e-200)], 0, 0.0),
    (intervals.imul, [(1e-200, 1.0), (1e-200, 1.0)], 0, 0.0),
    (intervals.iadd, [(0.0, 1.0), (0.0, 1.0)], 0, 0.0),
    (intervals.icosh, [(-1.0, 2.0)], 0, 1.0),
    (intervals.isin, [(1.0, 2.0)], 1, 1.0),
    (intervals.icos, [(3.0, 4.0)], 0, -1.0),
    (intervals.icos, [(-1.0, 1.0)], 1, 1.0),
    (intervals.isin, [(0.0, 7.0)], None, (-1.0, 1.0)),
    (intervals.isin, [(1e300, 1e300)], None, (-1.0, 1.0)),
    (intervals.itanh, [(-1e3, 1e3)], None, (-1.0, 1.0)),
    (intervals.iexp, [(-math.inf, 0.0)], 0, 0.0),
    (intervals.iconst, [2], None, (2.0, 2.0)),
]


@pytest.mark.parametrize(("operation", "arguments", "end", "expected"), EXACT)
def test_signs_and_extrema_are_exact(
    operation: Callable[..., Interval], arguments: list[Any], end: int | None, expected: float | Interval
) -> None:
    """Zeros, extrema and clamps are not widened: signs are proved by them."""
    bounds = operation(*arguments)
    assert (bounds if end is None else bounds[end]) == expected


@pytest.mark.parametrize(
    ("operation", "arguments"),
    [
        (intervals.isqrt, [(-1.0, 4.0)]),
        (intervals.ilog, [(-1.0, 4.0)]),
        (intervals.iasin, [(0.0, 1.5)]),
        (intervals.iacos, [(-1.5, 0.0)]),
        (intervals.iacosh, [(0.5, 2.0)]),
        (intervals.iatanh, [(0.0, 1.5)]),
        (intervals.irpow, [(-1.0, 2.0), 0.5]),
        (intervals.itan, [(1.0, 2.0)]),
        (intervals.idiv, [(1.0, 2.0), (-1.0, 1.0)]),
        (intervals.idiv, [(1.0, 2.0), (0.0, 0.0)]),
        (intervals.ipow, [(-1.0, 1.0), -3]),
        (intervals.isqrt, [(math.nan, 1.0)]),
    ],
)
def test_gaps_in_the_domain_prove_nothing(operation: Callable[..., Interval], arguments: list[Any]) -> None:
    """An interval partly outside the domain, or across a pole, gives bounds without information."""
    assert operation(*arguments) == ALL


def test_pole_at_an_end_bounds_one_side() -> None:
    """At a pole at one end of an interval the values go to one infinity."""
    assert intervals.idiv((1.0, 2.0), (0.0, 4.0)) == (pytest.approx(0.25), math.inf)
    assert intervals.idiv((1.0, 2.0), (-4.0, 0.0)) == (-math.inf, pytest.approx(-0.25))
    assert intervals.ilog((0.0, 1.0)) == (-math.inf, 0.0)
    assert intervals.iatanh((0.0, 1.0)) == (0.0, math.inf)
    assert intervals.irpow((0.0, 4.0), -0.5) == (pytest.approx(0.5), math.inf)


def test_overflow_is_no_infinite_lower_bound() -> None:
    """The lower bound of a number that overflows is the largest float."""
    assert intervals.iexp((1e3, 1e4)) == (math.nextafter(math.inf, 0.0), math.inf)
    assert intervals.imul((1e300, 1e300), (-1e300, -1e300)) == (-math.inf, -math.nextafter(math.inf, 0.0))


def test_rounded_constants_hold_what_they_stand_for() -> None:
    """The enclosures of constants rounded to floats contain 1/10 and pi."""
    lo, hi = intervals.ipoint(0.1)
    assert Fraction(lo) < Fraction(1, 10) < Fraction(hi)
    with mp.workdps(DIGITS):
        assert holds(intervals.ipi(), +mp.pi)
