"""Chebyshev and Legendre series by Clenshaw's recurrence, and sums at many places at once in vector registers."""

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from gqm_sym.runtime.compiled.intrinsics import fma
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import LANES, REGISTER, broadcast, line_of, operation, register
from gqm_sym.runtime.compiled.uncompiled import fma as plain_fma
from gqm_sym.runtime.compiled.uncompiled import in_python

# The longest Legendre series that the runtime sums.
MAX_TERMS = 32
# Legendre's recurrence: P_(k+1) = GROWTH[k] x P_k - DECAY[k-1] P_(k-1).
GROWTH = np.array([(2 * k + 1) / (k + 1) for k in range(MAX_TERMS)])
DECAY = np.array([(k + 1) / (k + 2) for k in range(MAX_TERMS)])

# The number of registers that are computed in parallel, and the number of places that they hold together.
PARALLEL_REGISTERS = 4
GROUP = LANES * PARALLEL_REGISTERS
_COUNT = ir.IntType(64)


@intrinsic
def sum_group(_, c, x, at, high, low):  # type: ignore[no-untyped-def]
    """Fill Clenshaw's sums b_2 (``high``) and b_3 (``low``) of coefficients c, at GROUP places x from index ``at``."""

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        terms = context.make_array(signature.args[0])(context, builder, args[0])
        places, first, last = (
            builder.gep(line_of(context, builder, signature.args[k], args[k]), [args[2]]) for k in (1, 3, 4)
        )
        zero = ir.Constant(REGISTER, [0.0] * LANES)
        ahead = [cgutils.alloca_once_value(builder, zero) for _ in range(PARALLEL_REGISTERS)]
        behind = [cgutils.alloca_once_value(builder, zero) for _ in range(PARALLEL_REGISTERS)]
        for k in range(PARALLEL_REGISTERS):
            builder.store(zero, ahead[k])
            builder.store(zero, behind[k])
        twice = []
        for k in range(PARALLEL_REGISTERS):
            place = builder.load(register(builder, places, LANES * k), align=8)
            twice.append(builder.fadd(place, place))
        size = builder.extract_value(terms.shape, 0)
        start, stop, step = builder.sub(size, ir.Constant(_COUNT, 1)), ir.Constant(_COUNT, 1), ir.Constant(_COUNT, -1)
        with cgutils.for_range_slice(builder, start, stop, step, inc=False) as (index, _):
            term = broadcast(builder, builder.load(builder.gep(terms.data, [index])))
            for k in range(PARALLEL_REGISTERS):
                before = builder.load(ahead[k])
                left = builder.fsub(term, builder.load(behind[k]))
                builder.store(before, behind[k])
                builder.store(operation(builder, "fma", twice[k], before, left), ahead[k])
        for k in range(PARALLEL_REGISTERS):
            builder.store(builder.load(ahead[k]), register(builder, first, LANES * k), align=8)
            builder.store(builder.load(behind[k]), register(builder, last, LANES * k), align=8)
        return context.get_dummy_value()

    assert c.layout == "C"
    return types.void(c, x, types.intp, high, low), lower


@in_python(sum_group)
def _sum_group(c: Any, x: Any, at: int, high: Any, low: Any) -> None:
    for k in range(at, at + GROUP):
        ahead, behind, twice = np.float64(0.0), np.float64(0.0), x[k] + x[k]
        for term in c[:1:-1]:
            ahead, behind = plain_fma(twice, ahead, term - behind), ahead
        high[k], low[k] = ahead, behind


@Inner
def chebyshev_sum(c, x):  # type: ignore[no-untyped-def]
    """Return the Chebyshev series with coefficients c at x."""
    high, low, twice = 0.0, 0.0, 2.0 * x
    for k in range(c.size - 1, 0, -1):
        high, low = fma(twice, high, c[k] - low), high
    return fma(x, high, c[0] - low)


@Inner
def legendre_sum(c, x):  # type: ignore[no-untyped-def]
    """Return the Legendre series with coefficients c at x."""
    high, low = 0.0, 0.0
    for k in range(c.size - 1, 0, -1):
        high, low = (c[k] - DECAY[k] * low) + (GROWTH[k] * x) * high, high
    return c[0] + x * high - 0.5 * low


@Inner
def legendre_growth(c, x_from_start):  # type: ignore[no-untyped-def]
    """Return by how much the Legendre series with coefficients c grows from -1 to a place, given by its distance from
    there.

    Its relative error stays small for small distances, because each polynomial is divided by the distance:
    P_k(x) - P_k(-1) = (1 + x) Q_k(x), and (k+1) Q_(k+1) = (2k+1) (x Q_k + (-1)^k) - k Q_(k-1).
    """
    before, here, sign, total = 0.0, 1.0, -1.0, 0.0
    x = x_from_start - 1.0
    for k in range(1, c.size):
        total = fma(c[k], here, total)
        before, here, sign = here, GROWTH[k] * fma(x, here, sign) - DECAY[k - 1] * before, -sign
    return x_from_start * total


@Inner
def growth_beside_rest(c, distance, heading):  # type: ignore[no-untyped-def]
    """Return by how much the Legendre series with coefficients c differs from its value at an end of the range at which
    its slope vanishes, given the distance from there.

    Its relative error stays small for small distances y, because each polynomial is divided by y twice: at -1,
    P_k - P_k(-1) = y P_k'(-1) + y**2 R_k, the sum of the first terms is zero but for roundings, and
    (k+1) R_(k+1) = (2k+1) (P_k'(-1) + (y-1) R_k) - k R_(k-1).

    Parameters
    ----------
    c : array
        The coefficients.
    distance : float
        The distance from the end, much smaller than 1.
    heading : float
        1 for the end at -1, and -1 for that at 1.
    """
    before, here, sign, total, x = 0.0, 0.0, heading, 0.0, distance - 1.0
    for k in range(1, c.size):
        total = fma(sign * c[k], here, total)
        slope = 0.5 * k * (k + 1) if k % 2 else -0.5 * k * (k + 1)
        before, here = here, GROWTH[k] * fma(x, here, slope) - DECAY[k - 1] * before
        sign *= heading
    return distance * distance * total
