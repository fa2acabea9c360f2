"""Products of small constant matrices with vectors, and the extremes of a vector, in vector registers.

numba keeps the order in which a dot product is summed, so it is not vectorised. Here eight results are summed side by
side, row by row of the transposed matrix. Since each sum must wait for the one before, several of them, over
alternating rows, run at the same time.
"""

from functools import partial, reduce
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core.cgutils import global_constant
from numba.extending import intrinsic

from gqm_sym.runtime.compiled.registers import (
    INDEX,
    LANES,
    REAL,
    REGISTER,
    Lanes,
    broadcast,
    line_of,
    operation,
    register,
)
from gqm_sym.runtime.compiled.uncompiled import fma_of_arrays, go_on, in_python

# The number of sums that run at the same time.
PARALLEL_SUMS = 6


def multiply(table: Any) -> Any:
    """Return the compiled function ``f(values, at, out, to)`` that multiplies a vector with a constant matrix.

    The function computes ``out[to : to + width] = values[at : at + rows] @ table``, where the rows of the table are
    padded with zeros to whole registers. The arrays are read as sequences of numbers from the given indices on, because
    a slice would take longer than the sums. Nothing is checked.
    """
    table = np.pad(table, ((0, 0), (0, -table.shape[1] % LANES)))
    rows, width = table.shape
    blocks = width // LANES
    chains = max(PARALLEL_SUMS // blocks, 1)
    numbers = ir.Constant(ir.ArrayType(REAL, table.size), table.ravel().tolist())

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        values, out = (
            builder.gep(line_of(context, builder, signature.args[k], args[k]), [args[k + 1]]) for k in (0, 2)
        )
        held = global_constant(builder, "table", numbers)
        held.align = 8 * LANES
        # LLVM would turn the entries of a constant table into single constants: it would load each from an address of
        # its own, and keep all of them on the stack during a loop. An empty piece of assembly hides the table.
        opaque = ir.FunctionType(REAL.as_pointer(), [REAL.as_pointer()])
        entries = builder.asm(opaque, "", "=r,0", [builder.bitcast(held, REAL.as_pointer())], side_effect=False)
        totals = [[ir.Constant(REGISTER, [0.0] * LANES)] * blocks for _ in range(chains)]
        for row in range(rows):
            each = broadcast(builder, builder.load(builder.gep(values, [ir.Constant(INDEX, row)])))
            chain = totals[row % chains]
            for block in range(blocks):
                entry = builder.load(register(builder, entries, row * width + block * LANES), align=8 * LANES)
                chain[block] = operation(builder, "fma", each, entry, chain[block])
        for block, parts in enumerate(zip(*totals, strict=True)):
            builder.store(reduce(builder.fadd, parts), register(builder, out, block * LANES), align=8)
        return context.get_dummy_value()

    @intrinsic
    def sums(_, values, at, out, to):  # type: ignore[no-untyped-def]
        """``out[to:] = values[at:] @ table``."""
        return types.void(values, types.intp, out, types.intp), lower

    @in_python(sums)
    def add_up(values: Any, at: int, out: Any, to: int) -> None:
        go_on()
        fma, totals = fma_of_arrays(), [np.zeros(width)] * chains
        for row, value in enumerate(values.reshape(-1)[at : at + rows]):
            totals[row % chains] = fma(value, table[row], totals[row % chains])
        out.reshape(-1)[to : to + width] = reduce(np.add, totals)

    return sums


def _folded(builder: Any, order: str, value: Any) -> Any:
    """Return the smallest or the largest of a register's lanes."""
    lanes = LANES
    while lanes > 1:
        lanes //= 2
        halves = (
            builder.shuffle_vector(value, value, ir.Constant(ir.VectorType(INDEX, lanes), list(range(k, k + lanes))))
            for k in (0, lanes)
        )
        value = _of_two(builder, order, *halves)
    return builder.extract_element(value, ir.Constant(INDEX, 0))


def _of_two(builder: Any, order: str, one: Any, other: Any) -> Any:
    return builder.select(builder.fcmp_ordered(order, one, other), one, other)


def _registers(context: Any, builder: Any, signature: Any, args: Any, count: int) -> list[Any]:
    """Return registers that hold ``count`` numbers of an array, some of them twice."""
    values = builder.gep(line_of(context, builder, signature.args[0], args[0]), [args[1]])
    return [builder.load(register(builder, values, min(at, count - LANES)), align=8) for at in range(0, count, LANES)]


def span(count: int) -> Any:
    """Return the compiled function ``f(values, at)`` that returns the smallest and the largest of ``count`` numbers,
    eight or more.

    A NaN among them may be ignored.
    """

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        found = _registers(context, builder, signature, args, count)
        ends = [_folded(builder, order, reduce(partial(_of_two, builder, order), found)) for order in ("<", ">")]
        return context.make_tuple(builder, signature.return_type, ends)

    @intrinsic
    def smallest_and_largest(_, values, at):  # type: ignore[no-untyped-def]
        """Return the smallest and the largest of the numbers."""
        return types.UniTuple(types.float64, 2)(values, types.intp), lower

    @in_python(smallest_and_largest)
    def extent(values: Any, at: int) -> tuple[Any, Any]:
        part = values.reshape(-1)[at : at + count]
        return np.fmin.reduce(part), np.fmax.reduce(part)

    return smallest_and_largest


def largest(count: int) -> Any:
    """Return the compiled function ``f(values, at)`` that returns the largest absolute value of ``count`` numbers, as
    `span` does.
    """

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        found = _registers(context, builder, signature, args, count)
        sizes = [abs(Lanes(builder, value)).value for value in found]
        return _folded(builder, ">", reduce(partial(_of_two, builder, ">"), sizes))

    @intrinsic
    def size(_, values, at):  # type: ignore[no-untyped-def]
        """Return the largest absolute value of the numbers."""
        return types.float64(values, types.intp), lower

    in_python(size)(lambda values, at: np.fmax.reduce(np.abs(values.reshape(-1)[at : at + count])))
    return size
