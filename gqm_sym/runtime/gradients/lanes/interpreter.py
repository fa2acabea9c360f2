"""A program in double precision, carried out for many orbits at once, one in each lane.

A register is a row of the work space with a double for each lane. Numbers that do not depend on the place are pairs of
doubles, in registers of the interpreter in double-double arithmetic.
"""

from fractions import Fraction
from math import fabs, factorial, log, nan, sqrt

import numpy as np
from numba import carray, types

from gqm_sym.runtime.arithmetic.elementary import atan, cos, exp, inverse_root, sin
from gqm_sym.runtime.compiled.emitted import Emitted
from gqm_sym.runtime.compiled.intrinsics import choose, fma, polynomial_pair
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import on_stack
from gqm_sym.runtime.double_double.arithmetic import split
from gqm_sym.runtime.double_double.interpreter import (
    ADD,
    ARC_TANGENT,
    BLOCK,
    DIVIDE,
    ERROR,
    EXPONENTIAL,
    LOGARITHM,
    LOW,
    MULTIPLY,
    SINE_COSINE,
    SQUARE_ROOT,
    SUBTRACT,
)
from gqm_sym.runtime.gradients.lanes.operations import ERROR_BOUND, INVERSE_ROOT, ROUNDING, SINC, WAVE_DIFFERENCES

# Operations of which one operand does not depend on the place: node + pair, node - pair, pair - node, node * pair,
# pair / node, the product with a double, and the pair itself.
PLUS_PAIR, MINUS_PAIR, PAIR_MINUS, TIMES_PAIR, PAIR_OVER, SCALE, FROM_PAIR = range(
    WAVE_DIFFERENCES + 1, WAVE_DIFFERENCES + 8
)

# The power series of S(p) = sin(sqrt(p))/sqrt(p), highest power first, and the range of p in which it has all digits.
TERMS, MIN_SQUARE, MAX_SQUARE = 18, -16.0, 16.0
SERIES = tuple((-1.0) ** k / factorial(2 * k + 1) for k in reversed(range(TERMS)))

# With ``t = tilt``, three results of WAVE_DIFFERENCES are sums of these coefficients, lowest power first, times
# ``1 + t**2 + t**4 + ... + t**(2*n)`` and a power of p: C[q, p] and the derivatives of C[q, p] and S[q, p], which have
# one power less. The fourth follows: ``3 S[q, p] = C[q, p] - 2 p dS[q, p]/dp``, because ``2 p S'(p) = C(p) - S(p)``.
# Coefficients are two doubles each, because their roundings would be common to all nodes.
EVEN, ODD = ([Fraction((-1) ** (n + 1), factorial(2 * n + last)) for n in range(TERMS - 1)] for last in (2, 3))
SUMS = [EVEN, *([n * number for n, number in enumerate(row)] for row in (EVEN, ODD))]
WAVES, RESTS = (np.array([[split(number)[part] for number in row] for row in SUMS]) for part in (0, 1))
FIRST_TERMS, RESULT_OF_SUM, THIRD = (0, 1, 1), (0, 2, 3), split(Fraction(1, 3))

# Work space on the stack.
sums_of_powers = on_stack(TERMS)

# The smallest normal number.
MIN_NORMAL = 2.0**-1022


@Inner
def fill_sums(n, sign, a, b, out):  # type: ignore[no-untyped-def]
    """Fill a register with a + sign*b."""
    for i in range(n):
        out[i] = a[i] + sign * b[i]


@Inner
def fill_products(n, a, b, out):  # type: ignore[no-untyped-def]
    """Fill a register with a*b."""
    for i in range(n):
        out[i] = a[i] * b[i]


@Inner
def fill_quotients(n, a, b, out):  # type: ignore[no-untyped-def]
    """Fill a register with a/b."""
    for i in range(n):
        out[i] = a[i] / b[i]


@Inner
def fill_pair_products(n, a, high, low, out):  # type: ignore[no-untyped-def]
    """Fill a register with a*(high + low)."""
    for i in range(n):
        out[i] = fma(a[i], high[i], a[i] * low[i])


@Inner
def fill_pair_sums(n, signs, a, high, low, out):  # type: ignore[no-untyped-def]
    """Fill a register with sums of a and a pair, each with a sign."""
    for i in range(n):
        out[i] = (signs[0] * a[i] + signs[1] * high[i]) + signs[1] * low[i]


@Inner
def fill_pair_quotients(n, a, high, low, out):  # type: ignore[no-untyped-def]
    """Fill a register with (high + low)/a."""
    for i in range(n):
        out[i] = (high[i] + low[i]) / a[i]


@Inner
def fill_scaled(n, a, factor, out):  # type: ignore[no-untyped-def]
    """Fill a register with a double times a."""
    for i in range(n):
        out[i] = factor * a[i]


@Inner
def fill_square_roots(n, a, out):  # type: ignore[no-untyped-def]
    """Fill a register with square roots."""
    for i in range(n):
        out[i] = sqrt(a[i])


@Inner
def fill_inverse_roots(n, a, b, out):  # type: ignore[no-untyped-def]
    """Fill a register with 1/sqrt(a) with the sign of b, and NaN where a is no normal number."""
    for i in range(n):
        value = choose(a[i] >= MIN_NORMAL, inverse_root(a[i]), nan)
        out[i] = choose(b[i] < 0.0, -value, value)


@Inner
def fill_waves(n, a, out, other):  # type: ignore[no-untyped-def]
    """Fill a register with sines, and another one with cosines."""
    for i in range(n):  # both share the reduction of the argument
        angle = a[i]
        out[i], other[i] = sin(angle), cos(angle)


@Inner
def is_inside(p):  # type: ignore[no-untyped-def]
    """Return whether a number is in the range of the power series."""
    return (p >= MIN_SQUARE) & (p <= MAX_SQUARE)


@Inner
def fill_sincs(n, p, out):  # type: ignore[no-untyped-def]
    """Fill two registers with S(p) and its derivative."""
    for i in range(n):
        value, slope = polynomial_pair(SERIES, p[i], p[i])
        out[i], out[BLOCK + i] = choose(is_inside(p[i]), value, nan), slope


@Inner
def fill_wave_differences(n, tilts, high, low, out):  # type: ignore[no-untyped-def]
    """Fill four registers with the results of WAVE_DIFFERENCES for the number high + low."""
    square, powers = tilts[0] * tilts[0], sums_of_powers()
    powers[0] = 1.0
    for k in range(1, TERMS - 1):
        powers[k] = fma(powers[k - 1], square, 1.0)
    for which in range(3):
        at = RESULT_OF_SUM[which] * BLOCK
        row = out[at : at + n]
        row[:] = 0.0
        for k in range(TERMS - 2, FIRST_TERMS[which] - 1, -1):
            term = fma(WAVES[which, k], powers[k], RESTS[which, k] * powers[k])
            for i in range(n):
                row[i] = fma(row[i], high[i], term)
    for i in range(n):
        even, slope = out[i], out[3 * BLOCK + i]
        threefold = fma(-2.0 * high[i], slope, even)
        odd = fma(THIRD[0], threefold, THIRD[1] * threefold)
        out[i] = choose(is_inside(high[i]), fma(low[i], out[2 * BLOCK + i], even), nan)
        out[BLOCK + i] = choose(is_inside(high[i]), fma(low[i], slope, odd), nan)


@Inner
def fill_function(operation, n, a, out):  # type: ignore[no-untyped-def]
    """Fill a register with values of a function that few formulas contain."""
    if operation == EXPONENTIAL:
        for i in range(n):
            out[i] = exp(a[i])
    elif operation == LOGARITHM:
        for i in range(n):
            out[i] = log(a[i])
    elif operation == ARC_TANGENT:
        for i in range(n):
            out[i] = atan(a[i])
    else:
        for i in range(n):
            out[i] = fabs(a[i])


@Inner
def carry_out_pair(operation, n, a, high, low, out):  # type: ignore[no-untyped-def]
    """Carry out an operation of which one operand is a pair."""
    if operation == WAVE_DIFFERENCES:
        fill_wave_differences(n, a, high, low, out)
    elif operation == TIMES_PAIR:
        fill_pair_products(n, a, high, low, out)
    elif operation <= PAIR_MINUS:
        signs = (-1.0 if operation == PAIR_MINUS else 1.0, -1.0 if operation == MINUS_PAIR else 1.0)
        fill_pair_sums(n, signs, a, high, low, out)
    elif operation == SCALE:
        fill_scaled(n, a, high[0], out)
    elif operation == PAIR_OVER:
        fill_pair_quotients(n, a, high, low, out)
    else:
        for i in range(n):
            out[i] = high[i] + low[i]


def evaluate(operations, first, last, work, n):  # type: ignore[no-untyped-def]
    """Carry out the operations from ``first`` to before ``last`` of a program for n orbits.

    Parameters
    ----------
    operations : (m, 4) array of int
        Each operation, with the positions in the work space at which the registers of its results and of its operands
        begin.
    work : array
        The registers. The registers of results are none of those of operands.
    n : int
        The number of orbits, at most BLOCK.
    """
    rows = carray(operations, (last, 4))
    for k in range(first, last):
        operation, at, left, right = rows[k, 0], rows[k, 1], rows[k, 2], rows[k, 3]
        registers = carray(work, max(at + 6 * BLOCK, left + 3 * BLOCK, right + 2 * BLOCK))
        out, a, b = registers[at : at + 6 * BLOCK], registers[left : left + BLOCK], registers[right : right + BLOCK]
        if operation == MULTIPLY:
            fill_products(n, a, b, out)
        elif operation <= SUBTRACT:
            fill_sums(n, 1.0 if operation == ADD else -1.0, a, b, out)
        elif operation == ERROR_BOUND:
            fill_scaled(n, registers[left + ERROR : left + ERROR + BLOCK], 1.0 / ROUNDING, out)
        elif operation > ERROR_BOUND:
            carry_out_pair(operation, n, a, b, registers[right + LOW : right + LOW + BLOCK], out)
        elif operation == DIVIDE:
            fill_quotients(n, a, b, out)
        elif operation == SQUARE_ROOT:
            fill_square_roots(n, a, out)
        elif operation == INVERSE_ROOT:
            fill_inverse_roots(n, a, b, out)
        elif operation == SINE_COSINE:
            fill_waves(n, a, out, registers[at + BLOCK : at + 2 * BLOCK])
        elif operation == SINC:
            fill_sincs(n, a, out)
        else:
            fill_function(operation, n, a, out)


# The interpreter, which other compiled functions call by its address.
LANES_INTERPRETER = Emitted(
    evaluate,
    types.void(types.CPointer(types.int64), types.intp, types.intp, types.CPointer(types.float64), types.intp),
)
