"""Numbers whose value is exactly the one that was written, read without SymPy.

A float stands for its binary value. An int, text such as ``"9.81"`` or ``"-pi/2 + 6/5"``, a Decimal, a Fraction and a
SymPy number stand for exactly the number written. mpmath is imported only for irrational numbers and for ``Number.at``.
"""

import ast
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from gqm_sym.errors import ExpressionError, NumberError
from gqm_sym.literals import rationals
from gqm_sym.literals.angles import enclose_angle
from gqm_sym.literals.enclosures import Interval, enclose
from gqm_sym.literals.grammar import parse
from gqm_sym.literals.sympy_tree import is_sympy, tree_of
from gqm_sym.literals.units import Unit, is_quantity, scale_of, split_unit, unit_of_quantity

if TYPE_CHECKING:
    from decimal import Decimal

# The precision at which both parts of a double-double are correctly rounded, except with a probability of 2**-80.
_PAIR_BITS = 192

# The precision to which a number next to the midpoint of two doubles is rounded first, so that a tie is recognised.
_TIE_BITS = 700

# pi with the digits of extended doubles, if the machine has them.
_PI = np.longdouble("3.14159265358979323846264338327950288")

# The limit below which all integers are doubles, and the number of bytes of a double.
_EXACT_BELOW, _DOUBLE_SIZE = 2.0**53, 8

# Extra bits beyond the precision that ``at`` returns, so that its result is rounded only once.
_GUARD_BITS = 16


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Number:
    """A finite real number that is known exactly; ``read_number`` makes it.

    Attributes
    ----------
    value : float
        The nearest double.
    """

    value: float
    # If the number is not a double: the nearest double of the remainder, the source of the number, and its text.
    _remainder: tuple[float, Fraction | ast.expr, str] | None

    @property
    def low(self) -> float:
        """The double nearest to the difference between the number and ``value``."""
        return 0.0 if self._remainder is None else self._remainder[0]

    @property
    def _source(self) -> float | Fraction | ast.expr:
        return self.value if self._remainder is None else self._remainder[1]

    @property
    def fraction(self) -> Fraction | None:
        """The exact value of a number that was written as a rational number; None for other numbers."""
        if isinstance(self._source, ast.expr):
            return None
        return Fraction(self._source)

    @property
    def text(self) -> str:
        """The number as it was written."""
        return repr(self.value) if self._remainder is None else self._remainder[2]

    def at(self, ctx: Any) -> Any:
        """Return the number in an mpmath context at its working precision.

        In ``mpmath.mp`` it is rounded once; in ``mpmath.iv`` it is an interval that contains the number.
        """
        from mpmath import MPIntervalContext, libmp

        source = self._source
        if isinstance(source, ast.expr):
            bits = ctx.prec + _GUARD_BITS
            exact: Fraction | Interval = enclose(source, bits, where=self.text)
        else:
            exact = Fraction(source)
        interval = isinstance(ctx, MPIntervalContext)
        if isinstance(exact, Fraction):
            ends = exact.numerator, exact.denominator, ctx.prec
            if interval:
                pair = libmp.from_rational(*ends, "f"), libmp.from_rational(*ends, "c")
                return ctx.make_mpf(pair)
            return ctx.make_mpf(libmp.from_rational(*ends, "n"))
        low, high = exact
        if interval:
            return ctx.make_mpf((libmp.mpf_pos(low, ctx.prec, "f"), libmp.mpf_pos(high, ctx.prec, "c")))
        return ctx.make_mpf(libmp.mpf_pos(low, ctx.prec, "n"))

    def __float__(self) -> float:
        return self.value

    def __repr__(self) -> str:
        return f"Number({self.text!r})"

    def __str__(self) -> str:
        return self.text

    def __eq__(self, other: object) -> bool:
        """Compare exact values; irrational numbers are compared by their first 32 digits."""
        if not isinstance(other, Number):
            return NotImplemented
        return (self.value, self.low, self.fraction) == (other.value, other.low, other.fraction)

    def __hash__(self) -> int:
        return hash((self.value, self.low))


# Two numbers, usually doubles, are made for every launch. This avoids the constructor of a frozen class, which is slow.
_new, _set_value, _set_remainder = object.__new__, *(vars(Number)[name].__set__ for name in Number.__slots__)
Doubles: TypeAlias = NDArray[np.float64]
Source: TypeAlias = "str | int | float | Fraction | Decimal | Number | Any"


def read_number(value: Source, *, where: str, unit: str | None = None) -> Number:
    """Read a number exactly.

    Parameters
    ----------
    value
        A float, int, text, quantity, Decimal, Fraction, NumPy scalar, mpmath float, SymPy number or Number.
    where
        The name of the number in messages of errors, such as ``lam0``.
    unit
        The SI unit of the number, "1" for a plain number or an angle; quantities of pint, and text such as "30 deg",
        are converted to it. None if it is not known; they are then refused.

    Returns
    -------
    Number

    Raises
    ------
    NumberError
        If the value is not a finite real number, or is too large to be evaluated.
    """
    if type(value) is float:
        if value - value != 0.0:
            raise NumberError(f"{where}: {value!r} given; give a finite number")
        number = _new(Number)
        _set_value(number, value)
        _set_remainder(number, None)
        return number
    if isinstance(value, Number):
        return value
    try:
        if isinstance(value, str):
            return _read_text(value, where, unit)
        if type(value) is int:
            return _read_int(value, where)
        if is_quantity(value):
            return _of_quantity(value, where, unit)
        exact = rationals.read_exact(value, where=where)
        if exact is not None:
            return _from_fraction(exact, str(value), where)
        if is_sympy(value):
            return _from_tree(tree_of(value, where=where), str(value), where)
    except ExpressionError as error:
        raise NumberError(str(error)) from None
    except ValueError as error:
        raise NumberError(f"{where}: {error}") from None
    if isinstance(value, np.ndarray) and value.ndim == 0:
        return read_number(value[()], where=where, unit=unit)
    remedy = "give one number" if hasattr(value, "__len__") else "give a number"
    raise NumberError(f"{where}: {type(value).__name__} given; {remedy}, or text such as '9.81' or 'pi/2'")


def flat_doubles(array: Doubles) -> Doubles:
    """Return the elements of an array of doubles in the form that compiled code requires: contiguous, aligned and
    writable.

    Columns of a DataFrame and arrays made by broadcasting are often not writable.
    """
    flat = np.ascontiguousarray(array).reshape(-1)
    return flat if flat.flags.writeable and flat.flags.aligned else flat.copy()


def doubles_at_once(values: Any) -> Doubles | None:
    """Return numbers that are exactly doubles as an array of their shape; None for others, which are read one by one.

    Parameters
    ----------
    values
        An array, a column of a DataFrame, a range, or a list or tuple of Python's floats and ints.
    """
    if isinstance(values, np.ndarray) and values.dtype == np.float64:
        return values
    if isinstance(values, range):
        ends = max(abs(values.start), abs(values.stop))
        return np.arange(values.start, values.stop, values.step, dtype=np.float64) if ends < _EXACT_BELOW else None
    if isinstance(values, list | tuple):
        kinds = set(map(type, values))
        if not kinds <= {float, int}:
            return None
        array, exact = np.array(values), kinds <= {float}
    else:
        array = values.to_numpy() if hasattr(values, "to_numpy") else values
        if not isinstance(array, np.ndarray) or array.dtype.kind not in "fiu" or array.dtype.itemsize > _DOUBLE_SIZE:
            return None
        exact = array.dtype.kind == "f"
    if array.dtype.kind not in "fiu":
        return None
    doubles = array.astype(np.float64, copy=False)
    return doubles if (np.isfinite(doubles) if exact else np.abs(doubles) < _EXACT_BELOW).all() else None


def read_numbers(values: Any, *, where: str, unit: str | None = None) -> tuple[Doubles, Doubles, tuple[int, ...]]:
    """Read a number or an array of numbers into a flat array of doubles, one of remainders, and the shape.

    The arguments are those of `read_number`.
    """
    doubles = doubles_at_once(values)
    if doubles is not None:
        flat = flat_doubles(doubles)
        return flat, np.zeros_like(flat), doubles.shape
    if is_quantity(values) and np.ndim(values.magnitude):
        return _of_quantities(values, where, unit)
    array = np.asarray(_plain(values, where, unit), dtype=object)
    numbers = [read_number(v, where=where, unit=unit) for v in array.reshape(-1)]
    high = np.array([n.value for n in numbers], dtype=np.float64)
    low = np.array([n.low for n in numbers], dtype=np.float64)
    return high, low, array.shape


@lru_cache(maxsize=1024)
def _read_text(text: str, where: str, unit: str | None) -> Number:
    # The cache is for the defaults of parameters, which are read at every launch.
    try:
        tree = parse(text, where=where)
    except ExpressionError:
        measured = split_unit(text)
        if measured is None:
            raise
        scale = scale_of(measured[2], unit, where=where)
        return _scaled(_read_text(measured[0], where, None), scale, where)
    return _from_tree(tree, text.strip(), where)


def _of_quantity(value: Any, where: str, unit: str | None) -> Number:
    """Return a quantity as a number of SI units."""
    scale = scale_of(unit_of_quantity(value), unit, where=where)
    return _scaled(read_number(value.magnitude, where=where), scale, where)


def _scaled(number: Number, scale: Unit, where: str) -> Number:
    """Convert a number of other units to a number of SI units, with a text as a person would write it."""
    if scale.is_si:
        return number
    power = {0: "", 1: "*pi"}.get(scale.turns, f"*pi**({scale.turns})")
    if number.fraction is None:
        return _read_text(f"({number.text})*({scale.factor}){power}", where, None)
    exact = number.fraction * scale.factor
    if not power:
        value = repr(_split(exact, where)[0])
        return _from_fraction(exact, value if Fraction(value) == exact else str(exact), where)
    if abs(exact.numerator) == 1 and scale.turns == 1:
        power = "pi" if exact.numerator > 0 else "-pi"
    else:
        power = f"{exact.numerator}{power}"
    return _read_text(power if exact.denominator == 1 else f"{power}/{exact.denominator}", where, None)


def _of_quantities(values: Any, where: str, unit: str | None) -> tuple[Doubles, Doubles, tuple[int, ...]]:
    """Return an array of quantities as numbers of SI units; doubles are converted all at once."""
    scale = scale_of(unit_of_quantity(values), unit, where=where)
    magnitude = np.asarray(values.magnitude)
    if scale.is_si:
        return read_numbers(magnitude, where=where)
    if magnitude.dtype == object:
        high, low, _ = read_numbers([v * values.units for v in magnitude.reshape(-1)], where=where, unit=unit)
        return high, low, magnitude.shape
    exact = magnitude.astype(np.longdouble) * scale.factor.numerator / scale.factor.denominator * _PI**scale.turns
    if not np.isfinite(exact).all():
        raise NumberError(f"{where}: not a finite number among the quantities; give finite ones")
    high = exact.astype(np.float64).reshape(-1)
    return high, (exact.reshape(-1) - high).astype(np.float64), magnitude.shape


def without_unit(value: Any, *, where: str, unit: str | None) -> Any:
    """Convert quantities, or texts with units, and return anything else unchanged.

    The arguments are those of `read_number`.
    """
    if type(value) is float or value is None or (isinstance(value, np.ndarray) and value.dtype != object):
        return value
    if isinstance(value, str):
        return read_number(value, where=where, unit=unit) if split_unit(value) else value
    if is_quantity(value) and np.ndim(value.magnitude):
        high, _, shape = read_numbers(value, where=where, unit=unit)
        return high.reshape(shape)
    if is_quantity(value):
        return read_number(value, where=where, unit=unit)
    if isinstance(value, list | tuple):
        return [without_unit(item, where=where, unit=unit) for item in value]
    return value


def _plain(values: Any, where: str, unit: str | None) -> Any:
    """Convert the quantities among values, because NumPy would remove their units."""
    if is_quantity(values):
        return read_number(values, where=where, unit=unit)
    if isinstance(values, list | tuple):
        return [_plain(value, where, unit) for value in values]
    return values


def _from_tree(tree: ast.expr, text: str, where: str) -> Number:
    angle = enclose_angle(tree, where=where)
    if angle is not None and angle[0] != angle[1]:
        near = _split(angle[0], where)
        if near == _split(angle[1], where):
            return _number(near, tree, text)
    exact = enclose(tree, _PAIR_BITS, where=where)
    if isinstance(exact, Fraction):
        return _from_fraction(exact, text, where)
    low, high = (_split(rationals.from_mpf(end), where) for end in exact)
    if low != high:
        # The number is at or next to the midpoint of two doubles, as sqrt(2)**2 may be.
        exact = enclose(tree, _TIE_BITS + _GUARD_BITS, where=where)
        low = _split(_nearest(exact), where)
    return _number(low, tree, text)


@lru_cache(maxsize=1024)
def _read_int(value: int, where: str) -> Number:
    # The cache is for launches, which often have the same small integers.
    exact = rationals.read_exact(value, where=where)
    assert exact is not None
    return _from_fraction(exact, str(value), where)


def _from_fraction(exact: Fraction, text: str, where: str) -> Number:
    return _number(_split(exact, where), exact, text)


def _number(pair: tuple[float, float], source: Fraction | ast.expr, text: str) -> Number:
    value, low = pair
    return Number(value, (low, source, text))


def _split(exact: Fraction, where: str) -> tuple[float, float]:
    """Return the nearest double and the double nearest to the remainder. Python divides integers with correct
    rounding.
    """
    try:
        value = exact.numerator / exact.denominator
    except OverflowError:
        what = "beyond the largest double, 1.8e308; give a smaller number"
        raise NumberError(f"{where}: {what}") from None
    remainder = exact - Fraction(value)
    return value, remainder.numerator / remainder.denominator


def _nearest(exact: Fraction | Interval) -> Fraction:
    if isinstance(exact, Fraction):
        return exact
    from mpmath import libmp

    return rationals.from_mpf(libmp.mpf_pos(exact[0], _TIE_BITS, "n"))
