"""Divided differences of quotients of polynomials have the digits of the polynomials that remain."""

from fractions import Fraction

import numpy as np
import pytest
import sympy as sp

from gqm_sym.derivation.algebra.difference import Differences

X, A, B, DA, DB, P = sp.symbols("x a b da db p", real=True)

# The formula of one term has some 12 roundings, each at most half a last place of its factors.
FORMULA_ROUNDINGS = 12 * 2.0**-53


def differences_over(form: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    """Return ``form[a, x]`` and ``form[a, x, b]`` by the rules."""
    rules = Differences(X, (A, X, B), {(0, 1): DA, (1, 2): DB, (0, 2): B - A})
    return rules.first(form, 0, 1), rules.second(form)


@pytest.mark.parametrize(
    "form",
    [
        1 / (P + 3 * X + 2 * X**2),
        X / (P - X),
        (1 + X) ** 2 / (P + X**2),
        X**3 / (2 + P * X + 3 * X**2),
        P * X * (3 - X**2) / (1 + X**2),
        1 / (1 + (X - P) ** 2),
        (X + P) ** 3 / (1 + (X + P) ** 2) + X**2,
        X**3 / (1 + X**2 + X**3),
        X**2 / ((1 + X) * (2 + X)),
        (1 + 1 / (P + X**2)) / (P + X**2),
    ],
)
def test_against_the_definition(form: sp.Expr) -> None:
    """Both differences are those of the definition, exactly."""
    a, x, b = places = (sp.Rational(-7, 3), sp.Rational(2, 5), sp.Rational(11, 4))
    at = [form.xreplace({X: place, P: sp.Rational(17, 2)}) for place in places]
    slopes = [(at[1] - at[0]) / (x - a), (at[2] - at[1]) / (b - x)]
    found = [
        d.xreplace({A: a, X: x, B: b, DA: x - a, DB: b - x, P: sp.Rational(17, 2)}) for d in differences_over(form)
    ]
    assert found == [slopes[0], (slopes[1] - slopes[0]) / (b - a)]


def test_of_a_function() -> None:
    """Quotients of polynomials in a function are differences of that function times those of the quotient."""
    form = sp.sin(2 * X) / (2 + sp.sin(2 * X) ** 2)
    first, second = differences_over(form)
    names = {"divdiff1_sin": lambda x, y, h: (np.sin(y) - np.sin(x)) / h}
    names["divdiff2_sin"] = lambda x, y, w, h, k: ((np.sin(w) - np.sin(y)) / k - (np.sin(y) - np.sin(x)) / h) / (w - x)
    a, x, b = -1.25, 0.5, 2.0
    at = [float(form.xreplace({X: sp.Float(place, 30)})) for place in (a, x, b)]
    slopes = [(at[1] - at[0]) / (x - a), (at[2] - at[1]) / (b - x)]
    symbols, values = (A, X, B, DA, DB), (a, x, b, x - a, b - x)
    assert sp.lambdify(symbols, first, [names, "numpy"])(*values) == pytest.approx(slopes[0], rel=1e-14)
    found = sp.lambdify(symbols, second, [names, "numpy"])(*values)
    assert found == pytest.approx((slopes[1] - slopes[0]) / (b - a), rel=1e-14)


def test_digits_on_the_trisectrix() -> None:
    """The height t*(3 - t**2)/(1 + t**2) of Maclaurin's trisectrix, whose second difference is
    4*(a*b*t - a - b - t)/((1 + a**2)*(1 + b**2)*(1 + t**2)), keeps the digits of this formula.
    """
    second = differences_over(X * (3 - X**2) / (1 + X**2))[1]
    evaluate = sp.lambdify((A, X, B), second)
    rng = np.random.default_rng(20261127)
    for a, share, b in rng.uniform((-2.5, 0, -0.6), (-0.7, 1, 0.5), (300, 3)):
        t = a + share * (b - a)
        fa, ft, fb = Fraction(a), Fraction(t), Fraction(b)
        divisor = (1 + fa**2) * (1 + ft**2) * (1 + fb**2)
        terms = [4 * term / divisor for term in (fa * fb * ft, -fa, -fb, -ft)]
        assert abs(Fraction(evaluate(a, t, b)) - sum(terms)) <= FORMULA_ROUNDINGS * sum(map(abs, terms))
