"""Values of run-time parameters are kept exactly as given, or refused."""

from decimal import Decimal
from fractions import Fraction
from typing import Any

import pytest
import sympy as sp

import gqm_sym as gqm
from gqm_sym.errors import DeclarationError, GQMError
from gqm_sym.parameters import exact_value, read_value


@pytest.mark.parametrize(
    ("given", "kept", "exact"),
    [
        (Decimal("0.10"), "0.10", sp.Rational(1, 10)),
        (Fraction(1, 3), "1/3", sp.Rational(1, 3)),
        (0.1, 0.1, sp.Rational(0.1)),
        (" pi/2 ", "pi/2", sp.pi / 2),
        (2 * sp.E, "2*e", 2 * sp.E),
        ("acosh(2)", "acosh(2)", sp.acosh(2)),
    ],
)
def test_a_value_is_kept_as_it_was_given(given: Any, kept: Any, exact: sp.Expr) -> None:
    """A value is kept as it was given, and means the same when it is read again."""
    assert read_value(given, where="q") == kept
    assert exact_value(kept) == exact


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (Decimal("Infinity"), "q: must be a finite number, got Infinity"),
        (Decimal("NaN"), "q: must be a finite number, got NaN"),
        (float("inf"), "q: must be a finite number, got inf"),
        (True, "q: must be a number, got True"),
        ("R + 1", r"q: must be a number, got R \+ 1, which contains 'R'"),
        (sp.sqrt(-1), "q: I is not real"),
        (sp.asin(2), "q: asin of a number outside"),
        ([1], "q: must be a number, got list"),
    ],
)
def test_what_is_no_value(given: Any, message: str) -> None:
    """Values that are not finite, not real, or no numbers are refused."""
    with pytest.raises(GQMError, match=f"^{message}"):
        read_value(given, where="q")


@pytest.mark.parametrize("parameters", ["a", ["a"], ("a",), {"a": None}])
def test_names_alone(parameters: Any) -> None:
    """One name, several names, or a mapping are parameters to be given at run time."""
    assert gqm.Curve.graph("a*x**2", parameters=parameters).defaults == (("a", None),)
    with pytest.raises(DeclarationError, match=r"'a' is declared but not used; remove it or use it \(in use: b\)"):
        gqm.Curve.graph("b*x**2", parameters=parameters)


@pytest.mark.parametrize(("name", "value"), [("e", "2.71828"), ("pi", "3.14159")])
def test_a_constant_is_no_parameter(name: str, value: str) -> None:
    """Who declares a constant as a parameter is told so, and not that the parameter is not used."""
    with pytest.raises(GQMError, match=rf"'{name}' cannot be a name: it is a constant \({value}\)"):
        gqm.Curve.graph(f"{name}*x**2", parameters={name: 1})
