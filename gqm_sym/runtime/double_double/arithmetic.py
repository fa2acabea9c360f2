"""Numbers of some 31 digits, each the sum of two doubles, with the functions that formulas are made of.

A function takes and returns the high and the low double of each number. None of them branches, so loops over them
vectorise. The low double is at most half a unit in the last place of the high one. Relative errors are given in units
of ``UNIT`` = 2**-104.

The sums and products are those of Dekker (Numerische Mathematik 18, 1971) with fused products. They need numbers
between about 1e-290 and 1e290; outside this range, results are not numbers or lose their low digits.
"""

from fractions import Fraction
from math import factorial, nan, sqrt
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.arithmetic.elementary import HALF_PI, ONE_OVER_LOG2, ROUND, TWO_OVER_PI, power_of_two
from gqm_sym.runtime.compiled.intrinsics import bits, choose, fma, polynomial
from gqm_sym.runtime.compiled.jit import Inlined
from gqm_sym.runtime.compiled.uncompiled import fma as plain_fma
from gqm_sym.runtime.compiled.uncompiled import in_python

UNIT = 2.0**-104

# log 2 as three doubles.
LOG2 = (0.6931471805599453, 2.3190468138462996e-17, 5.707708438416212e-34)

# An argument of exp is divided by 2**SQUARINGS, and the result is squared SQUARINGS times.
SQUARINGS = 5
SHARE = 0.5**SQUARINGS
MAX_EXPONENT = 700.0


def split(number: Fraction) -> tuple[float, float]:
    """Return the two doubles nearest to a rational number."""
    high = number.numerator / number.denominator
    residual = number - Fraction(high)
    return high, residual.numerator / residual.denominator


def _coefficients(first: int, step: int, precise: int, count: int) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Coefficients of a Taylor series, highest power first: 1/first!, 1/(first + step)!, ..., with alternating signs
    if ``step`` is 2.

    Returns
    -------
    low_powers : tuple of float
        The first ``precise`` coefficients, as two doubles each.
    high_powers : tuple of float
        The others of ``count`` in all, as doubles.
    """
    sign = -1 if step == 2 else 1
    terms = [Fraction(sign**k, factorial(first + step * k)) for k in range(count)]
    low_powers = [part for term in reversed(terms[:precise]) for part in split(term)]
    return tuple(low_powers), tuple(float(term) for term in reversed(terms[precise:]))


# (sin(r)/r - 1)/r**2, negated, and cos(r), in r**2 for |r| <= pi/4; (exp(r) - 1)/r for |r| <= log(2)/64.
SINE, SINE_TAIL = _coefficients(3, 2, 7, 14)
COSINE, COSINE_TAIL = _coefficients(0, 2, 9, 16)
EXPONENTIAL, EXPONENTIAL_TAIL = _coefficients(1, 1, 6, 14)


@Inlined
def fast_sum(a, b):  # type: ignore[no-untyped-def]
    """Return the rounded sum a + b and its error, if a is zero or not smaller than b."""
    s = a + b
    return s, b - (s - a)


@Inlined
def product(a, b):  # type: ignore[no-untyped-def]
    """Return the rounded product of two doubles and its error."""
    p = a * b
    return p, fma(a, b, -p)


@Inlined
def add(a, a_low, b, b_low):  # type: ignore[no-untyped-def]
    """Return the sum, within 1 UNIT however much cancels."""
    s, e = two_sum(a, b)
    t, f = two_sum(a_low, b_low)
    s, e = fast_sum(s, e + t)
    return fast_sum(s, e + f)


@Inlined
def multiply(a, a_low, b, b_low):  # type: ignore[no-untyped-def]
    """Return the product, within 1 UNIT."""
    p, e = product(a, b)
    return fast_sum(p, fma(a, b_low, fma(a_low, b, e)))


@Inlined
def divide(a, a_low, b, b_low):  # type: ignore[no-untyped-def]
    """Return the quotient, within 2 UNIT."""
    q = a / b
    residual = fma(-q, b, a) + fma(-q, b_low, a_low)
    return fast_sum(q, residual / b)


@Inlined
def square_root(a, a_low):  # type: ignore[no-untyped-def]
    """Return the square root of a positive number, within 1 UNIT: one step of Newton's method from the double."""
    s = sqrt(a)
    return fast_sum(s, (fma(-s, s, a) + a_low) / (2.0 * s))


@intrinsic
def series(_, coefficients, z, z_low, start):  # type: ignore[no-untyped-def]
    """Return the value at z of a polynomial by Horner's scheme.

    ``coefficients`` are two doubles each, highest power first, and ``start`` stands for the powers above them. The
    terms must decrease.
    """

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        terms, z, z_low, high = args
        low: Any = ir.Constant(ir.DoubleType(), 0.0)
        for k in range(0, signature.args[0].count, 2):
            c, c_low = builder.extract_value(terms, k), builder.extract_value(terms, k + 1)
            p = builder.fmul(high, z)
            e = builder.fma(high, z, builder.fneg(p))
            e = builder.fma(high, z_low, builder.fma(low, z, e))
            high = builder.fadd(c, p)
            low = builder.fadd(builder.fsub(p, builder.fsub(high, c)), builder.fadd(c_low, e))
        return context.make_tuple(builder, signature.return_type, (high, low))

    real = types.float64
    return types.UniTuple(real, 2)(coefficients, real, real, real), lower


@in_python(series)
def _series(coefficients: Any, z: Any, z_low: Any, start: Any) -> tuple[Any, Any]:
    high, low = start, np.float64(0.0)
    for c, c_low in zip(coefficients[::2], coefficients[1::2], strict=True):
        p = high * z
        e = plain_fma(high, z_low, plain_fma(low, z, plain_fma(high, z, -p)))
        high = c + p
        low = (p - (high - c)) + (c_low + e)
    return high, low


@Inlined
def remainder(x, x_low, k, unit):  # type: ignore[no-untyped-def]
    """Return x - k*unit for a unit that is three doubles. The first product is nearly x, so that its subtraction is
    exact.
    """
    p, e = product(k, unit[1])
    s, t = two_sum(fma(-k, unit[0], x), -p)
    s, f = two_sum(s, x_low)
    return fast_sum(s, (t + f) - fma(k, unit[2], e))


@Inlined
def sine_and_cosine(x, x_low):  # type: ignore[no-untyped-def]
    """Return the sine and the cosine with an absolute error of at most UNIT, for |x| below 1e6."""
    shifted = fma(x, TWO_OVER_PI, ROUND)
    k = shifted - ROUND
    turns = bits(shifted)
    r, r_low = remainder(x, x_low, k, HALF_PI)
    z, z_low = multiply(r, r_low, r, r_low)
    f, f_low = series(SINE, z, z_low, polynomial(SINE_TAIL, z))
    f, f_low = multiply(f, f_low, z, z_low)
    f, f_low = multiply(f, f_low, r, r_low)
    s, t = fast_sum(r, -f)
    s, s_low = fast_sum(s, t + (r_low - f_low))
    c, c_low = series(COSINE, z, z_low, polynomial(COSINE_TAIL, z))
    c, c_low = fast_sum(c, c_low)
    is_odd, is_sine_negative, is_cosine_negative = turns & 1 == 1, turns & 2 == 2, (turns + 1) & 2 == 2
    sine, sine_low = choose(is_odd, c, s), choose(is_odd, c_low, s_low)
    cosine, cosine_low = choose(is_odd, s, c), choose(is_odd, s_low, c_low)
    sign, other = choose(is_sine_negative, -1.0, 1.0), choose(is_cosine_negative, -1.0, 1.0)
    return sign * sine, sign * sine_low, other * cosine, other * cosine_low


@Inlined
def exponential(x, x_low):  # type: ignore[no-untyped-def]
    """Return exp(x) within 2 UNIT, for |x| up to MAX_EXPONENT."""
    shifted = fma(x, ONE_OVER_LOG2, ROUND)
    k = shifted - ROUND
    r, r_low = remainder(x, x_low, k, LOG2)
    r, r_low = r * SHARE, r_low * SHARE
    f, f_low = series(EXPONENTIAL, r, r_low, polynomial(EXPONENTIAL_TAIL, r))
    # f is exp(r) - 1, whose digits are kept by squaring as (1 + f)**2 - 1 = 2 f + f**2.
    f, f_low = multiply(f, f_low, r, r_low)
    for _ in range(SQUARINGS):
        g, g_low = multiply(f, f_low, f, f_low)
        s, t = fast_sum(2.0 * f, g)
        f, f_low = fast_sum(s, t + (2.0 * f_low + g_low))
    s, t = fast_sum(1.0, f)
    s, t = fast_sum(s, t + f_low)
    scale = choose(abs(x) > MAX_EXPONENT, nan, power_of_two(bits(shifted)))
    return scale * s, scale * t


@Inlined
def improved_logarithm(x, x_low, guess, e, e_low):  # type: ignore[no-untyped-def]
    """Return log(x) with an error of at most 2 UNIT max(1, |log(x)|), from the double nearest to it and exp of minus
    that double.
    """
    p, p_low = multiply(x, x_low, e, e_low)
    residual = (p - 1.0) + p_low
    return fast_sum(guess, residual - 0.5 * residual * residual)


@Inlined
def improved_arc_tangent(x, x_low, guess, sine, cosine):  # type: ignore[no-untyped-def]
    """Return the arc tangent with an absolute error of at most 2 UNIT, from the double nearest to it and its sine and
    cosine.
    """
    p, p_low = multiply(x, x_low, cosine[0], cosine[1])
    residual, residual_low = add(p, p_low, -sine[0], -sine[1])
    return fast_sum(guess, (residual + residual_low) / (cosine[0] + x * sine[0]))
