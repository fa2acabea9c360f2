"""Divided differences of multiples of x*cot(x) have no terms that cancel beside 0."""

import pytest
import sympy as sp
from mpmath import mp, mpf

from gqm_sym.derivation.algebra.difference import Differences

X, A, B, DA, DB, P = sp.symbols("x a b da db p", real=True)


def _sinc_slope(x: mpf, y: mpf, h: mpf) -> mpf:
    return (mp.sinc(x + y) - mp.sinc(h)) / (4 * x * y)


HELPERS = {
    "difference_of_sinc": _sinc_slope,
    "divdiff1_difference_of_sinc": lambda x, y, w, h, k: (_sinc_slope(y, w, k) - _sinc_slope(x, y, h)) / (w - x),
    "divdiff1_sin": lambda x, y, h: (mp.sin(y) - mp.sin(x)) / h,
    "divdiff1_cos": lambda x, y, h: (mp.cos(y) - mp.cos(x)) / h,
}


@pytest.mark.parametrize(
    ("form", "is_known"),
    [
        (X * sp.cos(P * X) / sp.sin(P * X), True),
        (-P * X * (1 + 2 * sp.cos(X / P) / sp.sin(X / P)) / 3, True),
        (X * (1 + 1 / X) + X * sp.cos(X) / sp.sin(X), True),
        (sp.cos(X) / sp.sin(X), False),
        (X * sp.cos(X + P) / sp.sin(X + P), False),
    ],
)
def test_against_the_definition(form: sp.Expr, is_known: bool) -> None:
    """First and second differences are those of the definition; other products with cotangents have other rules."""
    rules = Differences(X, (A, X, B), {(0, 1): DA, (1, 2): DB, (0, 2): B - A})
    first, second = rules.first(form, 0, 1), rules.second(form)
    assert first.has(sp.Function("difference_of_sinc")) == is_known
    if not is_known:
        return
    with mp.workdps(40):
        a, x, b, p = places = mpf("0.05"), mpf("0.7"), mpf("1.9"), mpf("1.25")
        at = [sp.lambdify((X, P), form, "mpmath")(place, p) for place in places[:3]]
        slopes = [(at[1] - at[0]) / (x - a), (at[2] - at[1]) / (b - x)]
        values = (a, x, b, x - a, b - x, p)
        found = [sp.lambdify((A, X, B, DA, DB, P), d, [HELPERS, "mpmath"])(*values) for d in (first, second)]
        assert found[0] == pytest.approx(slopes[0], rel=1e-35)
        assert found[1] == pytest.approx((slopes[1] - slopes[0]) / (b - a), rel=1e-33)
