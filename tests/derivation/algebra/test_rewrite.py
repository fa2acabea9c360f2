"""Simplification finds short forms, keeps forms that do not cancel, and leaves other expressions as they are."""

import pytest
import sympy as sp
from mpmath import mp, mpf

from gqm_sym.declare import Curve
from gqm_sym.derivation.algebra.algebra import Algebra
from gqm_sym.derivation.algebra.differentiate import differentiate
from gqm_sym.derivation.algebra.generators import OverBudget
from gqm_sym.derivation.algebra.normal_form import spell
from gqm_sym.derivation.algebra.rewrite import magnitude, product, spell_product, tidy, without_poles
from gqm_sym.derivation.algebra.signs import Signs
from gqm_sym.derivation.geometry.geometry import geometry
from gqm_sym.errors import DeclarationError
from gqm_sym.expressions import read_expression

a, b, t = (sp.Symbol(name, real=True) for name in "abt")


def read(text: str) -> sp.Expr:
    """Read an expression in t and parameters."""
    return read_expression(text, where="test")


def factored(text: str) -> sp.Expr:
    """Write an expression as a product, with its angles halved if that is necessary."""
    expression = read(text)
    algebra = Algebra([expression], t)
    found = algebra.fraction(expression)
    uneven = algebra.uneven((found.top, found.bottom))
    if uneven:
        algebra = Algebra([expression], t, uneven)
        found = algebra.fraction(expression)
    return product(spell_product(algebra, found.top, found.bottom))


def signs(domain=(None, None), positive=(), may_be_positive=()) -> Signs:
    """Return the signs on a domain of t."""
    ends = tuple(None if end is None else read(end) for end in domain)
    return Signs(parameter=t, domain=ends, positive=positive, may_be_positive=may_be_positive)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1 - cos(t)", "2*sin(t/2)**2"),
        ("1 + cos(3*t)", "2*cos(3*t/2)**2"),
        ("cosh(t)**2 - 1", "sinh(t)**2"),
        ("1 + sinh(a*t)**2", "cosh(a*t)**2"),
        ("cosh(t) - 1", "2*sinh(t/2)**2"),
        ("sin(t)**2 + cos(t)**2", "1"),
        ("sin(2*t)/cos(t)", "2*sin(t)"),
        ("2 + 2*cos(2*t) + sin(t)**2", "3*cos(t)**2 + 1"),
        ("(a**2 - t**2)/(a - t)", "a + t"),
        ("exp(2*t)/exp(t)", "exp(t)"),
        ("cosh(t) - sinh(t)", "exp(-t)"),
    ],
)
def test_identities_are_found_by_factoring(text, expected):
    """Half angles, Pythagoras' theorem and common factors are found by exact algebra."""
    assert sp.expand(factored(text) - read(expected)) == 0
    assert sp.count_ops(factored(text)) <= sp.count_ops(read(expected)) + 1


@pytest.mark.parametrize(
    ("text", "expected"),
    [("1 - cos(t)", "2*sin(t/2)**2"), ("cosh(t) - 1", "2*sinh(t/2)**2")],
)
def test_a_half_angle_keeps_the_digits(text, expected):
    """The factored form is not only equal, but it does not cancel."""
    assert factored(text) == read(expected)


def test_a_sum_without_minus_signs_is_preferred():
    """1 + s² and 2 - c² are equally long, but the second may cancel."""
    algebra = Algebra([sp.sin(t)], t)
    polynomial = algebra.fraction(2 - sp.cos(t) ** 2).top
    assert spell(algebra, polynomial) == sp.sin(t) ** 2 + 1


def test_powers_that_cancel_are_written_as_multiple_angles():
    """A short sum of powers, part of the curvature of a knot, whose terms are 36 times as large as its values, is
    written in multiple angles and keeps its digits.
    """
    powers = read("300*cos(t)**7 - 440*cos(t)**5 - 30*cos(t)**4 + 185*cos(t)**3 + 23*cos(t)**2 - 11")
    algebra = Algebra([powers], t)
    written = sp.lambdify(t, spell(algebra, algebra.fraction(powers).top), "math")
    true, places = sp.lambdify(t, powers, "mpmath"), [k / 100 for k in range(150)]
    with mp.workdps(30):
        errors = [abs(float(true(mpf(place)) - written(place))) for place in places]
    assert max(errors) < 8e-16 * 27  # the largest value; in powers the error is 28e-16 of it


@pytest.mark.parametrize(
    ("text", "domain", "sign"),
    [
        ("sin(t/2)", ("0", "2*pi"), 1),
        ("sin(t/2)", ("0", "3*pi"), None),
        ("sin(t)", ("3.25", "6.17"), -1),
        ("cos(t)", ("-pi/2", "pi/2"), 1),
        ("t", ("0", None), 1),
        ("t", (None, "0"), -1),
        ("2*t - 3", ("2", "5"), 1),
        ("sinh(t)", ("0.1", "4"), 1),
        ("t**2 + exp(t)", (None, None), 1),
        ("a", (None, None), None),
        ("1 - t", (None, None), None),
        ("sin(t)", ("0", "pi"), 1),
        ("cos(t)", ("-3*pi/2", "-pi/2"), -1),
        ("sin(10**300*t)", ("-2", "2"), None),
    ],
)
def test_signs_on_a_domain(text, domain, sign):
    """Signs are known where the structure of the expression and the ends of the domain prove them, and only there."""
    assert signs(domain).sign(read(text)) == sign


def test_parameters_are_taken_as_positive_only_where_allowed():
    """A parameter with a negative default is not taken as positive; a sum of positive ones is positive."""
    some = signs(may_be_positive=("a",))
    some.assume(b)
    assert some.positive == ()
    some.assume(a)
    assert some.positive == ("a",)
    more = signs(may_be_positive=("a", "b"))
    more.assume(a - b)
    assert more.positive == ()
    more.assume(a + 2 * b)
    assert more.positive == ("a", "b")


def test_poles_that_cancel_are_multiplied_out_and_nothing_else():
    """(b/s - a) s is b - a s, but (a - b)(a + b) stays."""
    sine = sp.sin(t)
    assert without_poles((b / sine - a) * sine) == b - a * sine
    assert without_poles((a - b) * (a + b)) == (a - b) * (a + b)


def test_the_magnitude_of_a_product_with_a_root():
    """A root is not negative, also where SymPy does not know that it is real; it would write a complex conjugate."""
    root = sp.sqrt(sp.Symbol("unknown") - 1)
    place = sp.Symbol("place", real=True)
    assert magnitude(-2 * place / root) == 2 * sp.Abs(place) / root


def test_tidy_takes_common_factors_out():
    """`tidy` takes out common factors, and leaves short expressions as they are."""
    assert tidy(a * sp.cos(t) - a * sp.cos(b)) == a * (sp.cos(t) - sp.cos(b))
    assert tidy(a * t**2) == a * t**2


POWERS = ("sin(t)**a", "t**a", "abs(t)**3", "log(t)**2", "a**t", "sqrt(1 + t**2)")
FUNCTIONS = ("tan(t)", "tanh(t)", "asin(t)*acos(t)", "asinh(t)*atan(t)", "acosh(t)", "atanh(t)")


@pytest.mark.parametrize("text", [*POWERS, *FUNCTIONS, "exp(-t**2)"])
def test_derivatives_are_right(text):
    """Derivatives agree with SymPy's at a place where both are regular."""
    expression = read(text)
    place = {a: sp.Rational(5, 3), t: sp.Rational(3, 2) if "acosh" in text else sp.Rational(3, 5)}
    ours = differentiate(expression, t).subs(place).evalf(40)
    assert abs(ours - sp.diff(expression, t).subs(place).evalf(40)) < 1e-37


def test_the_derivative_of_a_power_has_no_quotient():
    """The derivative of a power is p u^(p-1) u', not p u^p/u, which is 0/0 at u = 0."""
    assert differentiate(t**a, t) == a * t ** (a - 1)
    assert differentiate(sp.sin(t) ** a, t) == a * sp.sin(t) ** (a - 1) * sp.cos(t)


def test_long_products_do_not_explode():
    """The length of a second derivative grows little faster than the product's."""
    names = [sp.Symbol(f"c{k}", real=True) for k in range(100)]
    second = differentiate(differentiate(sp.Mul(*(t + name for name in names)), t), t)
    # Multiplied out it has 9900 terms of 98 factors.
    assert sp.count_ops(second) < 40_000


@pytest.mark.parametrize(
    "text",
    [
        "sin(sin(sin(sin(sin(sin(sin(sin(t))))))))",
        "+".join(f"a{k}*sin(b{k}*t)" for k in range(12)),
        "+".join(f"{k}*sin({k}*t)" for k in range(1, 42)),
    ],
)
def test_what_is_too_large_is_left_as_it_is_and_says_so(text):
    """An expression beyond the budget is not simplified: the definitions are kept, and a note says so."""
    shape = geometry(Curve.parametric(x="t", z=text, parameter="t"), may_be_positive=())
    (note,) = shape.notes
    assert "unsimplified" in note
    place = {symbol: sp.Rational(1, 3) for symbol in shape.ds.free_symbols}
    slope = sp.diff(read(text), t).subs(place).evalf(30)
    assert abs(shape.ds.subs(place).evalf(30) - sp.sqrt(1 + slope**2)) < 1e-25


def test_the_budget_counts_and_does_not_wait():
    """A huge power is refused before it is computed."""
    with pytest.raises(OverBudget):
        Algebra([(a + b + t) ** 30], t).fraction((a + b + t) ** 30)


def test_a_hidden_point_is_refused():
    """sin² + cos² contains t, but does not depend on it; such a point is refused."""
    with pytest.raises(DeclarationError, match="point"):
        geometry(Curve.parametric(x="sin(t)**2 + cos(t)**2", z="a", parameter="t"), may_be_positive=())


LONG, OTHER = (sum(name**k for k in range(40)) for name in (a, b))


@pytest.mark.parametrize(
    ("made_of", "expression", "message"),
    [
        (sp.sin(t) + sp.sin(41 * t), sp.sin(41 * t), "an angle 41 times another"),
        (a + b + t, LONG * OTHER, "a product of 40 by 40 terms"),
        (sp.sin(t), sp.sin(t) ** 30 * sp.cos(t) ** 30, "degree 60 in one angle"),
        (t, sp.sqrt(t), r"sqrt\(t\) came up on the way"),
    ],
)
def test_each_limit_says_what_was_too_large(made_of, expression, message):
    """Each limit is checked before anything large is computed, and its message says what was too large."""
    with pytest.raises(OverBudget, match=message):
        Algebra([made_of], t).fraction(expression)


def test_a_double_angle_that_is_too_long_is_not_taken():
    """A double angle is not used if it is longer: sixteen terms of degree 30 are some 180 in its sine and cosine."""
    mixed = sum(a**k * sp.sin(t) ** (2 * k) * sp.cos(t) ** (30 - 2 * k) for k in range(16))
    algebra = Algebra([mixed], t)
    (pair,) = algebra.pairs
    assert algebra.doubled(algebra.fraction(mixed).top, pair) is None
    _, found, number = algebra.doubled(algebra.fraction(sp.sin(t) * sp.cos(t)).top, pair)
    assert (found, number) == (algebra.generators[pair.sine], 2)


def test_odd_and_even_functions_whoever_wrote_the_sign():
    """Odd and even functions are recognised although SymPy puts minus signs in front of sines."""
    minus = sp.Mul(-1, t, evaluate=False)
    algebra = Algebra([sp.sin(t)], t)
    assert algebra.fraction(sp.sin(minus, evaluate=False)) == algebra.fraction(-sp.sin(t))
    assert algebra.fraction(sp.cos(minus, evaluate=False)) == algebra.fraction(sp.cos(t))


def test_angles_that_have_nothing_in_common_stay_apart():
    """A product of functions of two unrelated angles is no function of one angle."""
    assert factored("sin(t)*sin(a)") == read("sin(t)*sin(a)")
    assert factored("(1 - cos(t))*(1 - cos(a))") == read("4*sin(a/2)**2*sin(t/2)**2")


def test_what_is_too_long_is_not_looked_at():
    """A common factor is taken out of 100 terms, and not of 300."""
    for count, taken in ((100, True), (300, False)):
        long = sum(t * sp.Symbol(f"a{k}", real=True) for k in range(count))
        assert (tidy(long) != long) is taken
