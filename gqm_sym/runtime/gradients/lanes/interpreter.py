"""A program in double precision, carried out for many orbits at once, one in each lane.

A register is a row of the work space with a double for each lane. Numbers that do not depend on the place are pairs of
doubles, in registers of the interpreter in double-double arithmetic.
"""

from math import fabs, factorial, log, nan, sqrt
from typing import Any

from llvmlite import ir
from numba import carray, types
from numba.extending import intrinsic

from gqm_sym.runtime.arithmetic.elementary import atan, cos, exp, inverse_root, sin
from gqm_sym.runtime.compiled.emitted import Emitted
from gqm_sym.runtime.compiled.intrinsics import choose, fma
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.uncompiled import fma as fma_in_python
from gqm_sym.runtime.compiled.uncompiled import in_python
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
from gqm_sym.runtime.gradients.lanes.operations import ERROR_BOUND, INVERSE_ROOT, ROUNDING, SINC, SINC_PAIR

# Operations of which one operand does not depend on the place: node + pair, node - pair, pair - node, node * pair,
# pair / node, the product with a double, and the pair itself.
PLUS_PAIR, MINUS_PAIR, PAIR_MINUS, TIMES_PAIR, PAIR_OVER, SCALE, FROM_PAIR = range(ERROR_BOUND + 1, ERROR_BOUND + 8)

# The power series of S(p) = sin(sqrt(p))/sqrt(p), highest power first, and the range of p in which it has all digits.
TERMS, MIN_SQUARE, MAX_SQUARE = 18, -16.0, 16.0
SERIES = tuple((-1.0) ** k / factorial(2 * k + 1) for k in reversed(range(TERMS)))

# The smallest normal number.
MIN_NORMAL = 2.0**-1022


@intrinsic
def sinc_series(_, p, q):  # type: ignore[no-untyped-def]
    """Return S(p), S(q), S[p, q], S'(p), S'(q), S[p, p, q] and S[p, q, q], by Horner's scheme without a loop."""

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        p, q = args
        real = ir.DoubleType()
        at_p = at_q = slope = by_p = by_q = slope_p = slope_q = ir.Constant(real, 0.0)
        for coefficient in SERIES:
            slope_q = builder.fma(slope_q, q, slope)
            slope_p = builder.fma(slope_p, q, by_p)
            slope = builder.fma(slope, q, at_p)
            by_p, by_q = builder.fma(by_p, p, at_p), builder.fma(by_q, q, at_q)
            at_p = builder.fma(at_p, p, ir.Constant(real, coefficient))
            at_q = builder.fma(at_q, q, ir.Constant(real, coefficient))
        found = at_p, at_q, slope, by_p, by_q, slope_p, slope_q
        return context.make_tuple(builder, signature.return_type, found)

    return types.UniTuple(types.float64, 7)(types.float64, types.float64), lower


@in_python(sinc_series)
def _sinc_series(p: Any, q: Any) -> Any:
    at_p = at_q = slope = by_p = by_q = slope_p = slope_q = 0.0
    for coefficient in SERIES:
        slope_q = fma_in_python(slope_q, q, slope)
        slope_p = fma_in_python(slope_p, q, by_p)
        slope = fma_in_python(slope, q, at_p)
        by_p, by_q = fma_in_python(by_p, p, at_p), fma_in_python(by_q, q, at_q)
        at_p, at_q = fma_in_python(at_p, p, coefficient), fma_in_python(at_q, q, coefficient)
    return at_p, at_q, slope, by_p, by_q, slope_p, slope_q


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
def fill_sincs(n, p, out):  # type: ignore[no-untyped-def]
    """Fill two registers with S(p) and its derivative."""
    for i in range(n):
        value, _, _, slope, _, _, _ = sinc_series(p[i], p[i])
        out[i], out[BLOCK + i] = choose((p[i] >= MIN_SQUARE) & (p[i] <= MAX_SQUARE), value, nan), slope


@Inner
def fill_sinc_pairs(n, p, q, out):  # type: ignore[no-untyped-def]
    """Fill six registers with the results of SINC_PAIR."""
    for i in range(n):
        at_p, at_q, slope, by_p, by_q, slope_p, slope_q = sinc_series(p[i], q[i])
        inside = (p[i] >= MIN_SQUARE) & (p[i] <= MAX_SQUARE) & (q[i] >= MIN_SQUARE) & (q[i] <= MAX_SQUARE)
        out[i], out[BLOCK + i] = choose(inside, at_p + at_q, nan), slope
        out[2 * BLOCK + i], out[3 * BLOCK + i] = by_p, by_q
        out[4 * BLOCK + i], out[5 * BLOCK + i] = slope_p, slope_q


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
    if operation == TIMES_PAIR:
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
        elif operation == SINC_PAIR:
            fill_sinc_pairs(n, a, b, out)
        else:
            fill_function(operation, n, a, out)


# The interpreter, which other compiled functions call by its address.
LANES_INTERPRETER = Emitted(
    evaluate,
    types.void(types.CPointer(types.int64), types.intp, types.intp, types.CPointer(types.float64), types.intp),
)
