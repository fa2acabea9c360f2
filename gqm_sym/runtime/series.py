"""Chebyshev sums at many places at once, in vector registers.

Between two terms of Clenshaw's recurrence arrays in memory would be read and written: as much again as the sums. Some
registers of places, side by side, wait for no result of their own.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from gqm_sym.runtime.lanes import LANES, REGISTER, line_of, operation, register, spread

# Registers side by side, and so places of a group.
ABREAST = 4
GROUP = LANES * ABREAST

_COUNT = ir.IntType(64)


@intrinsic
def sum_group(_, c, x, at, high, low):  # type: ignore[no-untyped-def]
    """Clenshaw's sums b_2 (in ``high``) and b_3 (in ``low``) of the coefficients c, at a group of places x."""

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        terms = context.make_array(signature.args[0])(context, builder, args[0])
        places, first, last = (
            builder.gep(line_of(context, builder, signature.args[k], args[k]), [args[2]]) for k in (1, 3, 4)
        )
        zero = ir.Constant(REGISTER, [0.0] * LANES)
        ahead = [cgutils.alloca_once_value(builder, zero) for _ in range(ABREAST)]
        behind = [cgutils.alloca_once_value(builder, zero) for _ in range(ABREAST)]
        for k in range(ABREAST):
            builder.store(zero, ahead[k])
            builder.store(zero, behind[k])
        twice = []
        for k in range(ABREAST):
            place = builder.load(register(builder, places, LANES * k), align=8)
            twice.append(builder.fadd(place, place))
        size = builder.extract_value(terms.shape, 0)
        start, stop, step = builder.sub(size, ir.Constant(_COUNT, 1)), ir.Constant(_COUNT, 1), ir.Constant(_COUNT, -1)
        with cgutils.for_range_slice(builder, start, stop, step, inc=False) as (index, _):
            term = spread(builder, builder.load(builder.gep(terms.data, [index])))
            for k in range(ABREAST):
                before = builder.load(ahead[k])
                left = builder.fsub(term, builder.load(behind[k]))
                builder.store(before, behind[k])
                builder.store(operation(builder, "fma", twice[k], before, left), ahead[k])
        for k in range(ABREAST):
            builder.store(builder.load(ahead[k]), register(builder, first, LANES * k), align=8)
            builder.store(builder.load(behind[k]), register(builder, last, LANES * k), align=8)
        return context.get_dummy_value()

    assert c.layout == "C"
    return types.void(c, x, types.intp, high, low), lower
