"""Units of measurement, given as text or by quantities of pint, and read as exact multiples of SI units.

Units are written in the grammar of expressions, ``km/h`` or ``m/s**2``; their names are pint's, which is imported only
for a name that is not in `_SI`. Nothing is rounded: a foot is 381/1250 m, and a degree is pi/180. A quantity is
recognised by its attributes, so that pint need not be imported.
"""

import re
from ast import expr
from fractions import Fraction
from functools import lru_cache
from typing import Any, NamedTuple

from gqm_sym.budgets import outside_budgets
from gqm_sym.errors import ExpressionError, InputError, NumberError
from gqm_sym.literals import rationals
from gqm_sym.literals.grammar import parse
from gqm_sym.literals.trees import evaluate


class Unit(NamedTuple):
    """The unit ``factor * pi**turns * m**metre * kg**kilogram * s**second * rad**radian``, in which everything is
    exact.
    """

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
        """Whether values in this unit are values in SI units."""
        return self.factor == 1 and self.turns == 0


_SI = {
    "kg": Unit(kilogram=1),
    "m": Unit(metre=1),
    "rad": Unit(radian=1),
    "s": Unit(second=1),
    "N": Unit(kilogram=1, metre=1, second=-2),
    "J": Unit(kilogram=1, metre=2, second=-2),
}

# Numerator and denominator of a unit's size in SI units are no larger. Those of all units of physics are far smaller.
MAX_FACTOR = 10**150

# The space between a number and its unit, in a text such as "30 deg" or "30deg".
_GAP = re.compile(
    r"(?<=[\w.)])\s+(?=(?:1\s*/\s*)?[(A-Za-z\u00b0\u00b5])|(?<=[\d.)])(?=[A-Za-z\u00b0\u00b5])(?![eE][+-]?\d)"
)
# Signs that the grammar does not have.
_SIGNS = {"\u00b0": "deg", "\u00b5": "micro", "%": "percent"}


def read_unit(text: str, *, where: str) -> Unit:
    """Read a unit of mechanics.

    Raises
    ------
    ExpressionError
        If the text is not a unit; the message gives the column of the mistake.
    """
    unit = evaluate(parse(text, where=where), _Units(), where=where)
    if not unit.factor:
        raise InputError(f"{where}: {text} is zero, which is not a unit")
    if max(abs(unit.factor.numerator), unit.factor.denominator) > MAX_FACTOR:
        raise InputError(f"{where}: must be a unit of ordinary size; numbers of up to 150 digits can be converted")
    return unit


def check_unit(text: str, wanted: str | None) -> None:
    """Refuse a unit whose dimension is not that of ``wanted``; if that is None, any unit is accepted.

    Raises
    ------
    InputError
    """
    if wanted is None or read_unit(text, where="").dimension == read_unit(wanted, where="").dimension:
        return
    right = "a plain number or an angle" if wanted == "1" else f"in {wanted} or a multiple of it"
    raise InputError(f"must be {right}, got {text}")


def is_quantity(value: object) -> bool:
    """Return whether a value has a magnitude and units, as a quantity of pint does."""
    return hasattr(value, "magnitude") and hasattr(value, "units")


def unit_of_quantity(value: Any) -> str:
    """Return the units of a quantity as text that `read_unit` reads."""
    text = f"{value.units:D}"
    return "1" if text in ("", "dimensionless") else text


@lru_cache(maxsize=256)
def split_unit(text: str) -> tuple[str, expr, str] | None:
    """Split a text such as "30 deg" into a number, its tree, and a unit; return None if it is not such a text."""
    for gap in _GAP.finditer(text):
        number, unit = text[: gap.start()], text[gap.end() :]
        for sign, name in _SIGNS.items():
            unit = unit.replace(sign, name)
        try:
            tree = parse(number, where="number")
            read_unit(unit, where="unit")
        except InputError:
            continue
        return number.strip(), tree, unit.strip()
    return None


def scale_of(unit: str, wanted: str | None, *, where: str) -> Unit:
    """Return the size of a unit in SI units, if it has the required dimension.

    Parameters
    ----------
    unit
        The unit that was given.
    wanted
        The SI unit of the value for which it was given, "1" for a plain number or an angle; None if that is not known.

    Raises
    ------
    NumberError
        If it is of another dimension, or no dimension is known.
    """
    try:
        if wanted is None:
            raise InputError(f"a unit is not known for it, got {unit}; give a plain number, in SI units and radians")
        check_unit(unit, wanted)
        return read_unit(unit, where="")
    except ExpressionError as error:
        raise NumberError(f"{where}: unit {unit}: {error}") from None
    except InputError as error:
        raise NumberError(f"{where}: {error}") from None


def _power(symbol: str, power: int) -> str:
    return symbol if power == 1 else f"{symbol}**{power}"


@lru_cache(maxsize=1)
def _registry() -> Any:
    with outside_budgets():  # loading takes longer than a file may, but happens once in a process
        from pint import UnitRegistry

        return UnitRegistry(non_int_type=Fraction)


def _named(name: str) -> Unit:
    """Return a unit of pint by its name."""
    registry = _registry()
    from pint import PintError  # imported after the registry, whose import is not counted in the time for reading

    try:
        one = registry.Quantity(Fraction(1), name).to_root_units()
    except (PintError, AttributeError, TypeError, ValueError):
        raise ValueError(f"there is no unit {name!r}; known are m, cm, ft, kg, s, min, deg, N and the like") from None
    powers = {str(base): power for base, power in one._units.items()}
    known = {"meter", "gram", "second", "radian"}
    if not powers.keys() <= known or any(power.denominator != 1 for power in powers.values()):
        raise ValueError(f"{name!r} is not a unit of mechanics, which is made of lengths, masses, times and angles")
    length, mass, time, angle = (int(powers.get(base, 0)) for base in ("meter", "gram", "second", "radian"))
    # pint measures mass in grams, and writes pi with 50 digits; the right power of pi is the one that leaves a short
    # number.
    factor = Fraction(one.magnitude) / 1000**mass
    pi = Fraction(registry.get_root_units("pi")[0])
    turns = min((0, 1, -1, 2, -2), key=lambda k: (factor / pi**k).numerator * (factor / pi**k).denominator)
    return Unit(factor / pi**turns, turns, kilogram=mass, metre=length, radian=angle, second=time)


class _Units:
    """The algebra of units: products, quotients and integer powers."""

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
        raise ValueError(f"{function} cannot be part of a unit")
