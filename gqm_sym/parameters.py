"""Names of run-time parameters and their exact default values."""

from collections.abc import Container, Iterable, Mapping
from decimal import Decimal, Inexact, localcontext
from fractions import Fraction
from math import isfinite
from numbers import Integral, Real
from typing import Any, TypeAlias

import sympy as sp

from gqm_sym.arguments import names, short
from gqm_sym.errors import DeclarationError, NumberError
from gqm_sym.expressions import check_name, name_or_value, read_expression
from gqm_sym.literals.rationals import is_numpy_span
from gqm_sym.literals.units import Unit, is_quantity, read_unit, scale_of, split_unit, unit_of_quantity

Value: TypeAlias = float | int | str
"""A default: a float means its binary value, an int or a text exactly the number that is written."""

Given: TypeAlias = Value | Decimal | Fraction | sp.Expr
# Parameters as they are declared: names with their defaults, or names alone.
Parameters: TypeAlias = Mapping[str, Given | None] | Iterable[str]
"""The types that a user may give for a value."""

# A number with more decimal places than this is not written as a decimal.
_PLACES = 60

# Mass and gravity have the same meaning everywhere, so several sources may use these two names.
COMMON = ("g", "m")
COMMON_DEFAULTS: dict[str, Value] = {"g": "9.81", "m": "1"}

# The coordinates of the plane, in which potentials are written, so that no parameter may have these names.
COORDINATES = ("x", "z")


def read_value(given: Given | Any, *, where: str) -> Value:
    """Return a finite real number in the form in which it is kept, exactly as it was given."""
    if isinstance(given, bool):
        raise NumberError(f"{where}: must be a number, got {given}")
    if isinstance(given, Measured):
        return given
    if is_quantity(given):
        unit = unit_of_quantity(given)
        quantity: Any = given
        return Measured(in_si(read_value(quantity.magnitude, where=where), unit), unit)
    if isinstance(given, str):
        measured = split_unit(given)
        if measured is not None:
            return Measured(in_si(read_value(measured[0], where=where), measured[2]), measured[2])
        _check_number(read_expression(given, where=where), given, where)
        return given.strip()
    if is_numpy_span(given):
        raise NumberError(f"{where}: must be a number, got timedelta64")
    if isinstance(given, Integral):
        return int(given)
    if isinstance(given, sp.Expr):
        exact = read_expression(given, where=where)
        _check_number(exact, given, where)
        # The grammar writes Euler's number with a small letter.
        return str(exact.xreplace({sp.E: sp.Symbol("e")}))
    if isinstance(given, Decimal | Fraction):
        if isinstance(given, Decimal) and not given.is_finite():
            raise NumberError(f"{where}: must be a finite number, got {given}")
        return str(given)
    if isinstance(given, Real):
        if not isfinite(given):
            raise NumberError(f"{where}: must be a finite number, got {float(given)!r}")
        return float(given)
    raise NumberError(f"{where}: must be a number, got {type(given).__name__}")


class Measured(str):
    """A default that was given with a unit: the number in SI units, with the unit, whose dimension the parameter must
    have.

    Attributes
    ----------
    unit : str
        The unit that was given.
    """

    unit: str

    def __new__(cls, number: str, unit: str) -> "Measured":
        """Make the text of a number that was given in a unit."""
        made = super().__new__(cls, number)
        made.unit = unit
        return made

    def __reduce__(self) -> tuple[type["Measured"], tuple[str, str]]:
        return Measured, (str(self), self.unit)


def in_si(value: Value, unit: str) -> str:
    """Return the text of the number in SI base units that equals an exact number given in a unit."""
    scale = read_unit(unit, where="") if unit else Unit()
    if scale.is_si and isinstance(value, str):
        return value
    factor = sp.Rational(scale.factor.numerator, scale.factor.denominator) * sp.pi**scale.turns
    exact = exact_value(value) * factor
    return _decimal(exact) if exact.is_Rational else str(read_value(exact, where="value"))


def check_measured(defaults: Mapping[str, Value | None], units: Mapping[str, str], *, where: str, final: bool) -> None:
    """Refuse defaults that were given in units of another dimension than their parameters have.

    Parameters
    ----------
    defaults
        Parameters with their defaults.
    units
        The units of the parameters, as far as they are known.
    final
        Whether a parameter with an unknown unit is refused too.

    Raises
    ------
    DeclarationError
    """
    for name, value in defaults.items():
        if isinstance(value, Measured) and (units.get(name) or final):
            try:
                scale_of(value.unit, units.get(name) or None, where=f"{where}: {name}")
            except NumberError as error:
                raise DeclarationError(str(error)) from None


def _decimal(number: sp.Rational) -> str:
    """Return a rational number as a decimal if that is finite, otherwise as a fraction."""
    with localcontext(prec=_PLACES) as context:
        context.traps[Inexact] = True
        try:
            return f"{Decimal(number.p) / Decimal(number.q):f}"
        except Inexact:
            return str(number)


def _check_number(expression: sp.Expr, given: object, where: str) -> None:
    free = sorted(symbol.name for symbol in expression.free_symbols)
    if free:
        raise NumberError(f"{where}: must be a number, got {given!s}, which contains {free[0]!r}")


def read_parameters(
    given: Mapping[str, Given | None] | Iterable[str] | None,
    *,
    found: Iterable[str],
    where: str,
) -> tuple[tuple[str, Value | None], ...]:
    """Join the parameters that were declared with those that were found in the expressions.

    Parameters
    ----------
    given
        Names with their defaults (None: must be given at run time), or names alone, or nothing.
    found
        The free symbols, in order of appearance.
    where
        The name of the declared object, for messages.
    """
    order = tuple(found)
    if given is None:
        declared: dict[str, Given | None] = {}
    elif isinstance(given, Mapping):
        declared = dict(given)
    else:
        declared = dict.fromkeys(names(given, where=f"{where}: parameters"))
    pairs: list[tuple[str, Value | None]] = []
    for name in (*declared, *(name for name in order if name not in declared)):
        if not isinstance(name, str):
            raise DeclarationError(f"{where}: parameters: {name!r:.60} is not a name; names are text")
        check_parameter(name, where=where)
        if name not in order:
            raise DeclarationError(
                f"{where}: parameter {short(name)} is declared but not used; "
                f"remove it or use it (in use: {', '.join(order) or 'none'})"
            )
        value = declared.get(name, COMMON_DEFAULTS.get(name))
        pairs.append((name, None if value is None else read_value(value, where=f"{where}: {name}")))
    return tuple(pairs)


def check_parameter(name: str, *, where: str) -> str:
    """Return ``name`` if a run-time parameter may have this name."""
    if name in COORDINATES:
        raise DeclarationError(
            f"{where}: {name!r} is a coordinate and cannot be a run-time parameter; give the parameter another name"
        )
    return check_name(name, where=where)


def read_argument(given: Given | None, name: str, *, where: str) -> tuple[str, Value | None]:
    """Read the argument of a kernel or a family for a parameter: another name, a value or nothing.

    The function returns the parameter's name and default.
    """
    called: str = name
    value: Given | None = given
    if isinstance(given, str):
        called, value = name_or_value(given, name)
    check_parameter(called, where=where)
    if value is None:
        value = COMMON_DEFAULTS.get(name)
    return called, None if value is None else read_value(value, where=f"{where}: {called}")


def exact_value(value: Value) -> sp.Expr:
    """Return the exact number that a default means."""
    return read_expression(value, where="default")


def tried_values(defaults: Mapping[str, Value | None], small: Container[sp.Basic] = ()) -> dict[sp.Symbol, sp.Expr]:
    """Return values of parameters with which to try a form: their defaults, or numbers near 1, or near 1/1000 for those
    that are small beside the others.
    """
    tried = {}
    for place, (name, value) in enumerate(defaults.items()):
        symbol, number = sp.Symbol(name, real=True), sp.Rational(17 + 2 * place, 16 + place)
        tried[symbol] = exact_value(value) if value is not None else number / 1000 if symbol in small else number
    return tried


def in_words(defaults: Mapping[str, Value | None], units: Mapping[str, str]) -> str:
    """Return parameters with their defaults and units on one line, such as ``L = 2 m, b (1/m, no default)``."""
    entries = []
    for name, value in defaults.items():
        unit = "" if units.get(name, "1") == "1" else units[name]
        if value is None:
            entries.append(f"{name} ({unit + ', ' if unit else ''}no default)")
        else:
            entries.append(f"{name} = {value} {unit}".rstrip())
    return ", ".join(entries) or "none"


def is_positive(value: Value | None) -> bool:
    """Return whether a default allows its parameter to be taken as positive, as the absence of a default does."""
    return value is None or bool(exact_value(value) > 0)


def refuse_out_of_range(
    values: Mapping[str, Value | None],
    positive: Iterable[str],
    at_least: Iterable[tuple[str, str]],
    *,
    where: str,
) -> None:
    """Refuse defaults that are not positive, or that fall below a number or another parameter's default."""
    for name in positive:
        if not is_positive(values.get(name)):
            raise DeclarationError(f"{where}: {name!r} must be positive, got {values[name]}")
    for name, least in at_least:
        value, bound = values.get(name), values.get(least, least)
        if value is None or bound is None:
            continue
        if exact_value(value) < exact_value(bound):
            what = f"at least {least} = {bound}" if least in values else f"at least {least}"
            raise DeclarationError(f"{where}: {name!r} must be {what}, got {value}")


def names_in_order(*expressions: sp.Expr) -> tuple[str, ...]:
    """Return the names of the free symbols in the order of their first appearance, which is the same in every
    process.
    """
    seen: dict[str, None] = {}
    for expression in expressions:
        for node in sp.preorder_traversal(expression):
            if isinstance(node, sp.Symbol):
                seen.setdefault(node.name)
    return tuple(seen)


__all__ = [
    "COMMON",
    "COORDINATES",
    "Given",
    "Value",
    "check_parameter",
    "exact_value",
    "is_positive",
    "names_in_order",
    "read_argument",
    "read_parameters",
    "read_value",
    "refuse_out_of_range",
    "tried_values",
]
