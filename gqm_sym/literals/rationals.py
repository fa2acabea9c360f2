"""Exact rational numbers of bounded size: conversion from Python's number types, and arithmetic.

The bound prevents ``9**9**9**9`` from being computed. Arithmetic raises ``ValueError`` with the reason, to which the
caller adds the place.
"""

import math
from collections.abc import Iterable
from decimal import Decimal
from fractions import Fraction
from numbers import Integral
from typing import Any

from gqm_sym.errors import NumberError

# The largest exponent of a constant power: 2**1000 is close to the largest double.
MAX_EXPONENT = 1000

# The largest decimal exponent of a literal or of a Decimal.
MAX_DECIMAL_EXPONENT = 400

# The largest size of a numerator or denominator (4200 digits). It is enough for 1.0001**1000, keeps arithmetic fast,
# and stays below the 4300 digits beyond which Python refuses to print an integer.
MAX_BITS = 14_000


def bounded(value: Fraction) -> Fraction:
    """Return ``value``, or raise ValueError if it is too large."""
    if max(value.numerator.bit_length(), value.denominator.bit_length()) > MAX_BITS:
        raise ValueError("an exact number of more than 4200 digits; write it as a decimal")
    return value


def total(terms: Iterable[Fraction]) -> Fraction:
    """Return a sum, or raise ValueError as soon as it is too large."""
    result = Fraction(0)
    for term in terms:
        result = bounded(result + term)
    return result


def product(factors: Iterable[Fraction]) -> Fraction:
    """Return a product, or raise ValueError as soon as it is too large."""
    result = Fraction(1)
    for factor in factors:
        result = bounded(result * factor)
    return result


def reciprocal(value: Fraction) -> Fraction:
    """Return ``1/value``."""
    if value == 0:
        raise ValueError("division by zero")
    return 1 / value


def check_exponent(exponent: Fraction) -> None:
    """Raise ValueError for a constant exponent that is too large for doubles."""
    if abs(exponent) > MAX_EXPONENT:
        raise ValueError(f"an exponent beyond {MAX_EXPONENT}; exponents lie within -1000 and 1000")


def power(base: Fraction, exponent: int) -> Fraction:
    """Return ``base**exponent`` for an integer exponent; the size is checked before anything is computed."""
    check_exponent(Fraction(exponent))
    if base == 0 and exponent < 0:
        raise ValueError("division by zero")
    # floor(log2) of the larger of numerator and denominator; it is 0 for 1 and -1, all powers of which are allowed.
    bits = max(abs(base.numerator), base.denominator).bit_length() - 1
    if bits * abs(exponent) > MAX_BITS:
        raise ValueError("an exact power of more than 4200 digits; write it as a decimal")
    return base**exponent


def from_mpf(value: Any) -> Fraction:
    """Return the exact value of an mpmath or SymPy float from its ``(sign, mantissa, exponent, bits)``."""
    sign, mantissa, exponent, _ = value
    if mantissa == 0 and exponent != 0:
        raise ValueError("not a finite number")
    if abs(exponent) > MAX_BITS:
        raise ValueError("a number far outside the range of doubles")
    magnitude = Fraction(int(mantissa)) * Fraction(2) ** int(exponent)
    return -magnitude if sign else magnitude


def is_numpy_span(value: object) -> bool:
    """Return whether a value is a time span of NumPy, which counts these among the integers."""
    return type(value).__name__ == "timedelta64"


def read_exact(value: object, *, where: str) -> Fraction | None:
    """Return the exact value of an object of a rational number type, or None for any other object.

    Parameters
    ----------
    value
        An int, float, Fraction, Decimal, NumPy scalar, or mpmath or SymPy float; anything else gives None.
    where
        The name of the value in messages of errors.

    Raises
    ------
    NumberError
        If the value is a truth value, complex, not finite, or too large.
    """
    name = type(value).__name__
    if isinstance(value, bool | complex) or name in ("bool", "bool_", "complex64", "clongdouble"):
        raise NumberError(f"{where}: {value!r} is of type {name}; give a real number")
    if is_numpy_span(value) or name in ("timedelta", "datetime64"):
        raise NumberError(f"{where}: {value!r} is of type {name}; give a number of seconds, or text such as '5 ms'")
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
        # NumPy has floats of several widths, of which only float64 is a subclass of Python's float.
        if isinstance(value, float) or _is_numpy_float(value):
            return Fraction(*value.as_integer_ratio())  # type: ignore[attr-defined]
    except (ValueError, OverflowError) as error:
        reason = "not a finite number" if _is_special(value) else str(error)
        raise NumberError(f"{where}: {name} given: {reason}; give a finite real number") from None
    return None


def _is_numpy_float(value: object) -> bool:
    return any(base.__module__ == "numpy" and base.__name__ == "floating" for base in type(value).__mro__)


def _is_special(value: Any) -> bool:
    """Return whether a value is NaN or infinite; comparing a signalling NaN raises an error."""
    try:
        return not -math.inf < value < math.inf
    except (ArithmeticError, TypeError, ValueError):
        return True
