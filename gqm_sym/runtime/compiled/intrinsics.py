"""Operations of LLVM that Python's ``math`` lacks: fused products, rounding, bits, selection, loads, polynomials.

Loops over these vectorise. Loops over functions of the C library, such as ``math.sin``, do not.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic


@intrinsic
def fma(_, x, y, z):  # type: ignore[no-untyped-def]
    """Return x * y + z, rounded once."""

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
    """Return the nearest integer, as a float."""
    return _rounding("llvm.rint")


@intrinsic
def floor_of(_, x):  # type: ignore[no-untyped-def]
    """Return the largest integer that is not above x, as a float."""
    return _rounding("llvm.floor")


@intrinsic
def bits(_, x):  # type: ignore[no-untyped-def]
    """Return the bits of a float as an integer."""

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.bitcast(args[0], ir.IntType(64))

    return types.int64(types.float64), lower


@intrinsic
def from_bits(_, n):  # type: ignore[no-untyped-def]
    """Return the float that has these bits."""

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.bitcast(args[0], ir.DoubleType())

    return types.float64(types.int64), lower


@intrinsic
def item_at(_, array, index):  # type: ignore[no-untyped-def]
    """Return ``array[index]`` for a contiguous array and an index that is not negative, without numba's test of its
    sign.
    """

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, args[0]).data
        return builder.load(builder.gep(data, [args[1]]))

    return array.dtype(array, types.intp), lower


@intrinsic
def choose(_, condition, x, y):  # type: ignore[no-untyped-def]
    """Return ``x if condition else y``, where both are computed, because a branch would keep a loop from being
    vectorised.
    """

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.select(*args)

    real = types.float64
    return real(types.boolean, real, real), lower


def _horner(builder: Any, coefficients: Any, count: int, s: Any, t: Any) -> tuple[Any, Any]:
    """Emit Horner's scheme without a loop: the value at t, and the divided difference [s,t]."""
    value, slope = ir.Constant(ir.DoubleType(), 0.0), ir.Constant(ir.DoubleType(), 0.0)
    for k in range(count):
        slope = builder.fma(slope, s, value)
        value = builder.fma(value, t, builder.extract_value(coefficients, k))
    return value, slope


@intrinsic
def polynomial(_, coefficients, t):  # type: ignore[no-untyped-def]
    """Return the value at t of the polynomial with these coefficients, highest power first."""

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return _horner(builder, args[0], coefficients.count, args[1], args[1])[0]

    return types.float64(coefficients, types.float64), lower


@intrinsic
def polynomial_pair(_, coefficients, s, t):  # type: ignore[no-untyped-def]
    """Return the value at t of a polynomial, and its divided difference [s,t]."""

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return context.make_tuple(
            builder, signature.return_type, _horner(builder, args[0], coefficients.count, args[1], args[2])
        )

    real = types.float64
    return types.UniTuple(real, 2)(coefficients, real, real), lower
