"""Waves far from zero are those of the place, of which neither the rounding nor that of their rate counts."""

from fractions import Fraction

import pytest
from sympy import Expr, Rational, S, Symbol, cos, symbols

from gqm_sym.derivation.algebra.angles import of_sum


def argument(form: Expr, numbers: dict[Symbol, Rational]) -> Fraction:
    """Return the argument that the runtime forms of a wave's numbers, of which the rate is a double."""
    phase, rate, place, rest, offset = (Fraction(str(arg.xreplace(numbers))) for arg in form.args)
    return phase + Fraction(float(rate)) * (place + rest + offset)


@pytest.mark.parametrize("rate", [Rational(2, 3), Rational(-1, 7), Rational(10**6, 7), Rational(3, 2)])
def test_rates_that_are_no_doubles(rate: Rational) -> None:
    """The argument of a wave is its exact rate times the place; the rounding of 2/3 alone was six roundings of a sine
    17 away from zero.
    """
    # The cosine is even, so the sign of its argument is free.
    point, middle, rest, offset = symbols("point middle rest offset")
    form = of_sum(cos(rate * point + 1), (point,), (middle, rest, offset))
    numbers = {middle: Rational(17), rest: S.Zero, offset: Rational(1, 4)}
    truth = 1 + Fraction(rate.p, rate.q) * Fraction(69, 4)
    assert abs(abs(argument(form, numbers)) - abs(truth)) < Fraction(2) ** -100 * abs(truth)
