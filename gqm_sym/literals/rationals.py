"""Exact rational numbers of bounded size: read from Python's number types, and their arithmetic.

The bound is what keeps ``9**9**9**9`` from being computed. Arithmetic refuses with ``ValueError``,
whose text says why; the caller knows where.
"""

import math
from collections.abc import Iterable
from decimal import Decimal
from fractions import Fraction
from numbers import Integral
from typing import Any

from gqm_sym.errors import NumberError

# No double needs an exponent beyond this: 2**1000 is near the largest.
MAX_EXPONENT = 1000

# Decimal exponents of literals and of Decimal objects.
MAX_DECIMAL_EXPONENT = 400

# Of numerator or denominator, 4200 digits: enough for 1.0001**1000, cheap to compute with, and less
# than the 4300 digits from which Python refuses to print an integer.
MAX_BITS = 14_000


def bounded(value: Fraction) -> Fraction:
    """Return ``value``, or refuse it for its size."""
    if max(value.numerator.bit_length(), value.denominator.bit_length()) > MAX_BITS:
        raise ValueError("an exact number of more than 4200 digits; write it as a decimal")
    return value


def total(terms: Iterable[Fraction]) -> Fraction:
    """Sum, refused as soon as it outgrows the bound."""
    result = Fraction(0)
    for term in terms:
        result = bounded(result + term)
    return result


def product(factors: Iterable[Fraction]) -> Fraction:
    """Product, refused as soon as it outgrows the bound."""
    result = Fraction(1)
    for factor in factors:
        result = bounded(result * factor)
    return result


def reciprocal(value: Fraction) -> Fraction:
    """``1/value``."""
    if value == 0:
        raise ValueError("division by zero")
    return 1 / value


def check_exponent(exponent: Fraction) -> None:
    """Refuse a constant exponent that no double could stand."""
    if abs(exponent) > MAX_EXPONENT:
        raise ValueError(f"an exponent beyond {MAX_EXPONENT}; exponents lie within -1000 and 1000")


def power(base: Fraction, exponent: int) -> Fraction:
    """``base**exponent`` for a whole exponent; the size is checked before anything is computed."""
    check_exponent(Fraction(exponent))
    if base == 0 and exponent < 0:
        raise ValueError("division by zero")
    # floor(log2) of the larger part, so that powers of 1 and -1 cost nothing and are never refused.
    bits = max(abs(base.numerator), base.denominator).bit_length() - 1
    if bits * abs(exponent) > MAX_BITS:
        raise ValueError("an exact power of more than 4200 digits; write it as a decimal")
    return base**exponent


def from_mpf(value: Any) -> Fraction:
    """Binary value of an mpmath or SymPy float, by its ``(sign, mantissa, exponent, bits)``."""
    sign, mantissa, exponent, _ = value
    if mantissa == 0 and exponent != 0:
        raise ValueError("not a finite number")
    if abs(exponent) > MAX_BITS:
        raise ValueError("a number far outside the range of doubles")
    magnitude = Fraction(int(mantissa)) * Fraction(2) ** int(exponent)
    return -magnitude if sign else magnitude


def read_exact(value: object, *, where: str) -> Fraction | None:
    """Exact value of a number object; None if it is none of the types that are rational by nature.

    Parameters
    ----------
    value
        An int, float, Fraction, Decimal, NumPy scalar, or mpmath or SymPy float; anything else
        gives None.
    where
        What the value is for, as errors should call it.

    Raises
    ------
    NumberError
        If it is a truth value, complex, not finite, or of an absurd size.
    """
    name = type(value).__name__
    if isinstance(value, bool | complex) or name in ("bool", "bool_", "complex64", "clongdouble"):
        raise NumberError(f"{where}: {value!r} is of type {name}; give a real number")
    try:
        if isinstance(value, Fraction):
            return bounded(value)
        if isinstance(value, Integral):
            return bounded(Fraction(int(value)))
        if isinstance(value, Decimal):
            if value.is_finite() and abs(value.adjusted()) > MAX_DECIMAL_EXPONENT:
                raise ValueError(f"a decimal exponent beyond {MAX_DECIMAL_EXPONENT}")
            return bounded(Fraction(value))
        if hasattr(value, "_mpf_"):
            return bounded(from_mpf(value._mpf_))
        # Python's floats and NumPy's of any width, of which only one is a float to Python.
        if isinstance(value, float) or _is_numpy_float(value):
            return Fraction(*value.as_integer_ratio())  # type: ignore[attr-defined]
    except (ValueError, OverflowError) as error:
        reason = "not a finite number" if _is_special(value) else str(error)
        raise NumberError(f"{where}: {name} given: {reason}; give a finite real number") from None
    return None


def _is_numpy_float(value: object) -> bool:
    return any(base.__module__ == "numpy" and base.__name__ == "floating" for base in type(value).__mro__)


def _is_special(value: Any) -> bool:
    """NaN or an infinity, of whatever type; a signalling NaN even refuses to be compared."""
    try:
        return not -math.inf < value < math.inf
    except (ArithmeticError, TypeError, ValueError):
        return True
