"""Operations that LLVM has and Python's ``math`` has not, and a sine that vectorises.

numba's loops over ``math.sin`` stay scalar, as the C library has no sine of vectors; polynomials of reduced arguments
do not. A fused product and sum rounds once, and keeps what a product loses.
"""

from math import fabs, factorial, pi
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from gqm_sym.runtime.jit import Inner

# 2 pi as two doubles, and the Taylor coefficients of sin(2 pi g) from g**3 on: cut below 2e-18 at g = 1/4.
TURN, TURN_LOW = 2.0 * pi, 2.4492935982947064e-16
SINE = tuple((-1.0) ** k * TURN ** (2 * k + 1) / factorial(2 * k + 1) for k in reversed(range(1, 12)))


@intrinsic
def fma(_, x, y, z):  # type: ignore[no-untyped-def]
    """X * y + z, rounded once."""

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.fma(*args)

    real = types.float64
    return real(real, real, real), lower


def _rounding(name: str) -> Any:
    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.call(builder.module.declare_intrinsic(name, [ir.DoubleType()]), args)

    return types.float64(types.float64), lower


@intrinsic
def nearest_whole(_, x):  # type: ignore[no-untyped-def]
    """The nearest whole number, as a float."""
    return _rounding("llvm.rint")


@intrinsic
def whole_below(_, x):  # type: ignore[no-untyped-def]
    """The largest whole number that is not above, as a float."""
    return _rounding("llvm.floor")


@Inner
def turn_sine(g, low):  # type: ignore[no-untyped-def]
    """sin(2 pi (g + low)) for ``|g|`` <= 1/4 and ``low`` a rounding of g."""
    z = g * g
    slope = fma(fma(64.9, z, -19.7), z, 1.0)  # of the sine: enough digits for what a rounding does
    tail = 0.0
    for c in SINE:
        tail = fma(tail, z, c)
    lead = TURN * g
    return lead + fma(tail, z * g, fma(TURN, g, -lead) + fma(TURN_LOW, g, TURN * slope * low))


@Inner
def turn_cosine(f, low):  # type: ignore[no-untyped-def]
    """cos(2 pi (f + low)) for ``|f|`` <= 1/2 and ``low`` a rounding of f."""
    g = 0.25 - fabs(f)
    lost = (0.25 - g) - fabs(f)
    return turn_sine(g, lost + (low if f < 0.0 else -low))


@intrinsic
def bits(_, x):  # type: ignore[no-untyped-def]
    """The bits of a float, as a whole number."""

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.bitcast(args[0], ir.IntType(64))

    return types.int64(types.float64), lower


@intrinsic
def from_bits(_, n):  # type: ignore[no-untyped-def]
    """The float of these bits."""

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.bitcast(args[0], ir.DoubleType())

    return types.float64(types.int64), lower


@intrinsic
def choose(_, condition, x, y):  # type: ignore[no-untyped-def]
    """``x if condition else y``, both worked out: a branch would keep a loop scalar."""

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.select(*args)

    real = types.float64
    return real(types.boolean, real, real), lower


def _horner(builder: Any, coefficients: Any, count: int, s: Any, t: Any) -> tuple[Any, Any]:
    """Horner's scheme without a loop: the value at t, and the divided difference [s,t]."""
    value, slope = ir.Constant(ir.DoubleType(), 0.0), ir.Constant(ir.DoubleType(), 0.0)
    for k in range(count):
        slope = builder.fma(slope, s, value)
        value = builder.fma(value, t, builder.extract_value(coefficients, k))
    return value, slope


@intrinsic
def polynomial(_, coefficients, t):  # type: ignore[no-untyped-def]
    """The polynomial of these coefficients, highest power first, at t."""

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return _horner(builder, args[0], coefficients.count, args[1], args[1])[0]

    return types.float64(coefficients, types.float64), lower


@intrinsic
def polynomial_pair(_, coefficients, s, t):  # type: ignore[no-untyped-def]
    """The polynomial's value at t, and its divided difference [s,t]."""

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return context.make_tuple(
            builder, signature.return_type, _horner(builder, args[0], coefficients.count, args[1], args[2])
        )

    real = types.float64
    return types.UniTuple(real, 2)(coefficients, real, real), lower
