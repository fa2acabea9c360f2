"""Units of measurement: read as exact multiples of SI units, and which ones fit where.

Units are written in the grammar of expressions, ``km/h`` or ``m/s**2``; their names are pint's, which is imported only
for a name that is not in `_SI`. Nothing is rounded: a foot is 381/1250 m, and a degree is pi/180.
"""

from collections.abc import Mapping
from decimal import Decimal, Inexact, localcontext
from fractions import Fraction
from functools import lru_cache
from types import MappingProxyType
from typing import Any, NamedTuple

import sympy as sp

from gqm_sym.budgets import apart
from gqm_sym.declare import Curve
from gqm_sym.declare.measures import curve_formulas, parameter_dimension
from gqm_sym.dimensions import NUMBER, Dimension, Formulas, dimension, found_dimensions, unit_of
from gqm_sym.errors import InputError
from gqm_sym.expressions import name_or_value
from gqm_sym.kernels import KERNELS, Kernel
from gqm_sym.kernels.base import UNITS, kernel_formulas
from gqm_sym.literals import rationals
from gqm_sym.literals.grammar import parse
from gqm_sym.literals.trees import evaluate
from gqm_sym.parameters import exact_value, read_value

# More places than this are not written as a decimal.
_PLACES = 60


class Unit(NamedTuple):
    """``factor * pi**turns * m**metre * kg**kilogram * s**second * rad**radian``, everything exact."""

    factor: Fraction = Fraction(1)
    turns: int = 0
    kilogram: int = 0
    metre: int = 0
    radian: int = 0
    second: int = 0

    @property
    def dimension(self) -> tuple[int, int, int]:
        """Powers of mass, length and time; an angle is a number."""
        return self.kilogram, self.metre, self.second

    @property
    def name(self) -> str:
        """The SI unit of the same dimension, in base units; empty for a number."""
        powers = zip(("kg", "m", "rad", "s"), self[2:], strict=True)
        known = {symbol: power for symbol, power in powers if power}
        above = "*".join(_power(symbol, power) for symbol, power in known.items() if power > 0)
        below = "/".join(_power(symbol, -power) for symbol, power in known.items() if power < 0)
        return "/".join(part for part in (above or ("1" if below else ""), below) if part)

    @property
    def is_si(self) -> bool:
        """Whether values in it are values in SI."""
        return self.factor == 1 and self.turns == 0


_SI = {
    "kg": Unit(kilogram=1),
    "m": Unit(metre=1),
    "rad": Unit(radian=1),
    "s": Unit(second=1),
    "N": Unit(kilogram=1, metre=1, second=-2),
    "J": Unit(kilogram=1, metre=2, second=-2),
}

# What is measured in what: parameters of the kernels by their arguments, and the numbers of a launch.
KERNEL_UNITS = UNITS
LAUNCH_UNITS = {"v0": "m/s", "t_max": "s"}


def read_unit(text: str, *, where: str) -> Unit:
    """Read a unit of mechanics.

    Raises
    ------
    ExpressionError
        If it is none, with the column of what is wrong.
    """
    unit = evaluate(parse(text, where=where), _Units(), where=where)
    if not unit.factor:
        raise InputError(f"{where}: {text} is nothing; a unit is more than that")
    return unit


def check_unit(text: str, wanted: str | None) -> None:
    """Refuse a unit of another dimension than that of ``wanted``; None: any will do.

    Raises
    ------
    InputError
    """
    if wanted is None or read_unit(text, where="").dimension == read_unit(wanted, where="").dimension:
        return
    right = "a plain number or an angle" if wanted == "1" else f"in {wanted} or a multiple of it"
    raise InputError(f"must be {right}, got {text}")


def in_si(value: str, unit: str) -> str:
    """The text of an exact number given in a unit, as the same number in SI base units."""
    scale = read_unit(unit, where="") if unit else Unit()
    if scale.is_si:
        return value
    factor = sp.Rational(scale.factor.numerator, scale.factor.denominator) * sp.pi**scale.turns
    exact = exact_value(value) * factor
    return _decimal(exact) if exact.is_Rational else str(read_value(exact, where="value"))


def expected_units(
    data: Mapping[str, Any],
    curve: Curve | None,
    kernel: Kernel | None,
    given: Mapping[str, str] = MappingProxyType({}),
) -> dict[str, str]:
    """What the run-time parameters of a curve file are measured in: by their roles, and by the formulas they stand in.

    Parameters
    ----------
    data
        The file, as far as it is right.
    curve, kernel
        What it declares, None where that is wrong.
    given
        Units of parameters, in order: where formulas leave several free, the first tell what the next must be.
    """
    units = _by_role(data)
    formulas = Formulas() if curve is None else curve_formulas(curve)
    if kernel is not None:
        formulas += kernel_formulas(kernel)
    if curve is not None and not curve.charted:
        formulas.variables[curve.parameter.name] = parameter_dimension(curve)
    known = {name: _dimension(unit) for name, unit in units.items()}
    for name, unit in given.items():
        if name not in (found := found_dimensions(formulas, known)) and name not in units:
            known[name] = _dimension(unit)
        elif unit_of(found.get(name)):
            units.setdefault(name, unit_of(found[name]))
    last = {name: unit_of(own) for name, own in found_dimensions(formulas, known).items()}
    told = {name: unit for name, unit in last.items() if unit and name not in {*given, *formulas.variables}}
    return {**told, **units}


def _by_role(data: Mapping[str, Any]) -> dict[str, str]:
    """Units of what the kernels are given, as far as they are mappings of names and values."""
    terms = data.get("kernel")
    units: dict[str, str] = {}
    for key, term in terms.items() if isinstance(terms, Mapping) else ():
        if key not in KERNELS or not isinstance(term, Mapping):
            continue
        for argument in KERNELS[key].arguments:
            called = term.get(argument)
            if argument in KERNEL_UNITS and (called is None or isinstance(called, str)):
                units[_called(called, argument)] = KERNEL_UNITS[argument]
    return {**units, "m": "kg", "g": "m/s**2"}


def launch_units(curve: Curve | None) -> dict[str, str]:
    """What the numbers of a launch are measured in; the curve's parameter only where the kind of curve tells it."""
    own = None if curve is None else parameter_dimension(curve)
    # A parametric curve's parameter may be anything; that of its waves is an angle.
    lam0 = {} if own is None else {"lam0": "rad" if own == NUMBER else "m"}
    return {**LAUNCH_UNITS, **lam0}


def _dimension(unit: str) -> Dimension:
    return dimension(*read_unit(unit, where="unit").dimension)


def _called(given: str | None, argument: str) -> str:
    return argument if given is None else name_or_value(given, argument)[0]


def _power(symbol: str, power: int) -> str:
    return symbol if power == 1 else f"{symbol}**{power}"


def _decimal(number: sp.Rational) -> str:
    """A rational number as a decimal where it ends, else as a fraction."""
    with localcontext(prec=_PLACES) as context:
        context.traps[Inexact] = True
        try:
            return f"{Decimal(number.p) / Decimal(number.q):f}"
        except Inexact:
            return str(number)


@lru_cache(maxsize=1)
def _registry() -> Any:
    with apart():  # loading takes longer than a file may, once a process
        from pint import UnitRegistry

        return UnitRegistry(non_int_type=Fraction)


def _named(name: str) -> Unit:
    """A unit that pint knows by name."""
    registry = _registry()
    from pint import PintError  # only now: the registry imports pint apart from what reading may take

    try:
        one = registry.Quantity(Fraction(1), name).to_root_units()
    except (PintError, AttributeError, TypeError, ValueError):
        raise ValueError(f"there is no unit {name!r}; known are m, cm, ft, kg, s, min, deg, N and the like") from None
    powers = {str(base): power for base, power in one._units.items()}
    known = {"meter", "gram", "second", "radian"}
    if not powers.keys() <= known or any(power.denominator != 1 for power in powers.values()):
        raise ValueError(f"{name!r} is no unit of mechanics, made of lengths, masses, times and angles")
    length, mass, time, angle = (int(powers.get(base, 0)) for base in ("meter", "gram", "second", "radian"))
    # pint measures mass in grams, and writes pi with 50 digits: whichever power of it leaves a short number is right.
    factor = Fraction(one.magnitude) / 1000**mass
    pi = Fraction(registry.get_root_units("pi")[0])
    turns = min((0, 1, -1, 2, -2), key=lambda k: (factor / pi**k).numerator * (factor / pi**k).denominator)
    return Unit(factor / pi**turns, turns, kilogram=mass, metre=length, radian=angle, second=time)


class _Units:
    """The algebra of units: products, quotients and whole powers."""

    def number(self, value: Fraction) -> Unit:
        return Unit(value)

    def name(self, name: str) -> Unit:
        if name == "pi":
            return Unit(turns=1)
        return _SI[name] if name in _SI else _named(name)

    def negate(self, value: Unit) -> Unit:
        raise ValueError("a unit has no sign; write it with the value")

    def total(self, terms: list[Unit]) -> Unit:
        raise ValueError("units cannot be added; write products and quotients, as in m/s**2")

    def product(self, factors: list[Unit]) -> Unit:
        powers = (sum(column) for column in zip(*(unit[1:] for unit in factors), strict=True))
        return Unit(rationals.product(unit.factor for unit in factors), *powers)

    def reciprocal(self, value: Unit) -> Unit:
        return Unit(rationals.reciprocal(value.factor), *(-power for power in value[1:]))

    def power(self, base: Unit, exponent: Unit) -> Unit:
        n = exponent.factor
        if exponent[1:] != Unit()[1:] or n.denominator != 1:
            raise ValueError("an exponent must be a whole number")
        return Unit(rationals.power(base.factor, int(n)), *(power * int(n) for power in base[1:]))

    def call(self, function: str, argument: Unit) -> Unit:
        raise ValueError(f"{function} is no part of a unit")
