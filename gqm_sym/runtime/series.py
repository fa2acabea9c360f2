"""Chebyshev sums at many places at once, in vector registers.

Between two terms of Clenshaw's recurrence arrays in memory would be read and written: as much again as the sums. Some
registers of places, side by side, wait for no result of their own.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

# Places in a register, registers side by side, and so places of a group.
LANES, ABREAST = 8, 4
GROUP = LANES * ABREAST

_REAL, _COUNT, _INDEX = ir.DoubleType(), ir.IntType(64), ir.IntType(32)
_LANES = ir.VectorType(_REAL, LANES)
_FMA = ir.FunctionType(_LANES, [_LANES] * 3)


@intrinsic
def sum_group(_, c, x, at, high, low):  # type: ignore[no-untyped-def]
    """Clenshaw's sums b_2 (in ``high``) and b_3 (in ``low``) of the coefficients c, at a group of places x."""

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        terms, places, first, last = (
            context.make_array(signature.args[k])(context, builder, args[k]) for k in (0, 1, 3, 4)
        )
        fma = cgutils.get_or_insert_function(builder.module, _FMA, f"llvm.fma.v{LANES}f64")
        zero, blank = ir.Constant(_LANES, [0.0] * LANES), ir.Constant(_LANES, ir.Undefined)
        everywhere = ir.Constant(ir.VectorType(_INDEX, LANES), [0] * LANES)

        def lanes(base: Any, k: int) -> Any:
            offset = builder.add(args[2], ir.Constant(_COUNT, LANES * k))
            return builder.bitcast(builder.gep(base, [offset]), _LANES.as_pointer())

        ahead = [cgutils.alloca_once_value(builder, zero) for _ in range(ABREAST)]
        behind = [cgutils.alloca_once_value(builder, zero) for _ in range(ABREAST)]
        for k in range(ABREAST):
            builder.store(zero, ahead[k])
            builder.store(zero, behind[k])
        twice = []
        for k in range(ABREAST):
            place = builder.load(lanes(places.data, k), align=8)
            twice.append(builder.fadd(place, place))
        size = builder.extract_value(terms.shape, 0)
        start, stop, step = builder.sub(size, ir.Constant(_COUNT, 1)), ir.Constant(_COUNT, 1), ir.Constant(_COUNT, -1)
        with cgutils.for_range_slice(builder, start, stop, step, inc=False) as (index, _):
            one = builder.insert_element(blank, builder.load(builder.gep(terms.data, [index])), ir.Constant(_INDEX, 0))
            term = builder.shuffle_vector(one, blank, everywhere)
            for k in range(ABREAST):
                before = builder.load(ahead[k])
                left = builder.fsub(term, builder.load(behind[k]))
                builder.store(before, behind[k])
                builder.store(builder.call(fma, [twice[k], before, left]), ahead[k])
        for k in range(ABREAST):
            builder.store(builder.load(ahead[k]), lanes(first.data, k), align=8)
            builder.store(builder.load(behind[k]), lanes(last.data, k), align=8)
        return context.get_dummy_value()

    assert all(array.layout == "C" for array in (c, x, high, low))
    return types.void(c, x, types.intp, high, low), lower
