"""Small matrices of fixed size times vectors, and the span of a vector, in vector registers.

numba keeps the order in which a dot product is summed, and so keeps it scalar. Summed over the rows of the transposed
matrix, eight results side by side, the same order fills the registers.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

LANES = 8
_REAL, _INDEX = ir.DoubleType(), ir.IntType(32)
_LANES = ir.VectorType(_REAL, LANES)


def columns(rows: int, width: int) -> Any:
    """A compiled function ``f(table, values, at, out, to)``, table of ``rows`` rows of ``width``.

    It does ``out[to : to + width] = values[at : at + rows] @ table``, the arrays read as one line of numbers: a slice
    would cost more than the sums. ``width`` is a multiple of `LANES`; nothing is checked.
    """

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        table, values, out = (context.make_array(signature.args[k])(context, builder, args[k]).data for k in (0, 1, 3))
        values, out = builder.gep(values, [args[2]]), builder.gep(out, [args[4]])

        def lanes(base: Any, offset: int) -> Any:
            place = builder.gep(base, [ir.Constant(_INDEX, offset)])
            return builder.bitcast(place, _LANES.as_pointer())

        totals = [ir.Constant(_LANES, [0.0] * LANES)] * (width // LANES)
        blank, spread = ir.Constant(_LANES, ir.Undefined), ir.Constant(ir.VectorType(_INDEX, LANES), [0] * LANES)
        for row in range(rows):
            value = builder.load(builder.gep(values, [ir.Constant(_INDEX, row)]))
            one = builder.insert_element(blank, value, ir.Constant(_INDEX, 0))
            each = builder.shuffle_vector(one, blank, spread)
            for block in range(width // LANES):
                entries = builder.load(lanes(table, row * width + block * LANES), align=8)
                totals[block] = builder.fadd(totals[block], builder.fmul(each, entries))
        for block, total in enumerate(totals):
            builder.store(total, lanes(out, block * LANES), align=8)
        return context.get_dummy_value()

    @intrinsic
    def sums(_, table, values, at, out, to):  # type: ignore[no-untyped-def]
        """``out[to:] = values[at:] @ table``."""
        assert all(array.layout == "C" for array in (table, values, out))
        return types.void(table, values, types.intp, out, types.intp), lower

    return sums


def span(count: int) -> Any:
    """A compiled function ``f(values, at)``: the least and the greatest of ``count`` numbers, four or more.

    What is not a number may be passed over.
    """
    four = ir.VectorType(_REAL, 4)

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        kind = signature.args[0]
        values = builder.gep(context.make_array(kind)(context, builder, args[0]).data, [args[1]])

        def part(at: int) -> Any:
            place = builder.gep(values, [ir.Constant(_INDEX, min(4 * at, count - 4))])
            return builder.load(builder.bitcast(place, four.as_pointer()), align=8)

        def most(order: str, found: list[Any]) -> Any:
            while len(found) > 1:
                left, right, *rest = found
                found = [*rest, builder.select(builder.fcmp_ordered(order, left, right), left, right)]
            return found[0]

        ends = []
        for order in ("<", ">"):
            lanes = most(order, [part(at) for at in range(-(-count // 4))])
            ends.append(most(order, [builder.extract_element(lanes, ir.Constant(_INDEX, k)) for k in range(4)]))
        return context.make_tuple(builder, signature.return_type, ends)

    @intrinsic
    def least_and_greatest(_, values, at):  # type: ignore[no-untyped-def]
        """The least and the greatest."""
        return types.UniTuple(types.float64, 2)(values, types.intp), lower

    return least_and_greatest
