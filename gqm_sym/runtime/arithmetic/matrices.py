"""Products of small constant matrices with vectors, and the extremes of a vector, in vector registers.

numba keeps the order in which a dot product is summed, so it is not vectorised. Here eight results are summed side by
side, row by row of the transposed matrix. Since each sum must wait for the one before, several of them, over
alternating rows, run at the same time.
"""

from collections.abc import Callable, Sequence
from functools import partial, reduce
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core.cgutils import alloca_once_value, for_range, global_constant
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
from gqm_sym.runtime.compiled.trial import go_on
from gqm_sym.runtime.compiled.uncompiled import fma_of_arrays, in_python

# The number of sums that run at the same time.
PARALLEL_SUMS = 6


# The largest number of products of registers that are written out; more of them are done in a loop over the rows.
MAX_WRITTEN_OUT = 128


def _padded(table: Any) -> Any:
    """Return a table whose rows are padded with zeros to whole registers, and the number of sums for each result."""
    table = np.pad(table, ((0, 0), (0, -table.shape[1] % LANES)))
    return table, max(PARALLEL_SUMS // (table.shape[1] // LANES), 1)


def _emit(builder: Any, values: Any, out: Any, table: Any) -> None:
    """Emit the product of the numbers at the address ``values`` with a table."""
    table, chains = _padded(table)
    rows, width = table.shape
    blocks = range(width // LANES)
    numbers = ir.Constant(ir.ArrayType(REAL, table.size), table.ravel().tolist())
    held = global_constant(builder, "table", numbers)
    held.align = 8 * LANES
    # LLVM would turn the entries of a constant table into single constants: it would load each from an address of its
    # own, and keep all of them on the stack during a loop. An empty piece of assembly hides the table.
    opaque = ir.FunctionType(REAL.as_pointer(), [REAL.as_pointer()])
    entries = builder.asm(opaque, "", "=r,0", [builder.bitcast(held, REAL.as_pointer())], side_effect=False)
    zero = ir.Constant(REGISTER, [0.0] * LANES)

    def add(row: Any, line: Any, sums: list[Any]) -> list[Any]:
        each = broadcast(builder, builder.load(builder.gep(values, [row])))
        loaded = [builder.load(register(builder, line, block * LANES), align=8 * LANES) for block in blocks]
        return [operation(builder, "fma", each, entry, total) for entry, total in zip(loaded, sums, strict=True)]

    totals = [[zero] * len(blocks) for _ in range(chains)]
    if rows * len(blocks) <= MAX_WRITTEN_OUT:
        for row in range(rows):
            line = builder.gep(entries, [ir.Constant(INDEX, row * width)])
            totals[row % chains] = add(ir.Constant(INDEX, row), line, totals[row % chains])
    else:
        assert chains == 1
        held_sums = [alloca_once_value(builder, zero) for _ in blocks]
        with for_range(builder, ir.Constant(ir.IntType(64), rows)) as loop:
            line = builder.gep(entries, [builder.mul(loop.index, ir.Constant(ir.IntType(64), width))])
            for held_sum, total in zip(
                held_sums, add(loop.index, line, list(map(builder.load, held_sums))), strict=True
            ):
                builder.store(total, held_sum)
        totals = [list(map(builder.load, held_sums))]
    for block, parts in enumerate(zip(*totals, strict=True)):
        builder.store(reduce(builder.fadd, parts), register(builder, out, block * LANES), align=8)


def _add_up(values: Any, at: int, out: Any, to: int, table: Any) -> None:
    """Do in Python what `_emit` emits."""
    go_on()
    table, chains = _padded(table)
    rows, width = table.shape
    fma, totals = fma_of_arrays(), [np.zeros(width)] * chains
    for row, value in enumerate(values.reshape(-1)[at : at + rows]):
        totals[row % chains] = fma(value, table[row], totals[row % chains])
    out.reshape(-1)[to : to + width] = reduce(np.add, totals)


def _addresses(context: Any, builder: Any, kinds: Any, args: Any) -> tuple[Any, Any]:
    """Return the addresses of the numbers that a product begins to read and to write, from its arguments."""
    values, out = (builder.gep(line_of(context, builder, kinds[k], args[k]), [args[k + 1]]) for k in (0, 2))
    return values, out


def multiply(table: Any) -> Any:
    """Return the compiled function ``f(values, at, out, to)`` that multiplies a vector with a constant matrix.

    The function computes ``out[to : to + width] = values[at : at + rows] @ table``, where the rows of the table are
    padded with zeros to whole registers. The arrays are read as sequences of numbers from the given indices on, because
    a slice would take longer than the sums. Nothing is checked.
    """

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        _emit(builder, *_addresses(context, builder, signature.args, args), table)
        return context.get_dummy_value()

    @intrinsic
    def sums(_, values, at, out, to):  # type: ignore[no-untyped-def]
        """``out[to:] = values[at:] @ table``."""
        return types.void(values, types.intp, out, types.intp), lower

    @in_python(sums)
    def add_up(values: Any, at: int, out: Any, to: int) -> None:
        _add_up(values, at, out, to, table)

    return sums


def multiply_one_of(tables: Sequence[Callable[[], Any]]) -> Any:
    """Return the compiled function ``f(which, values, at, out, to)`` that multiplies a vector with one of some constant
    matrices, as that of `multiply` does; ``which`` counts from 1.

    A matrix is the result of a function, which is called when the product is compiled or Python runs it.
    """

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        addresses = _addresses(context, builder, signature.args[1:], args[1:])
        for k, table in enumerate(tables):
            with builder.if_then(builder.icmp_signed("==", args[0], ir.Constant(args[0].type, 1 + k))):
                _emit(builder, *addresses, table())
        return context.get_dummy_value()

    @intrinsic
    def sums(_, which, values, at, out, to):  # type: ignore[no-untyped-def]
        """``out[to:] = values[at:] @ tables[which - 1]``."""
        return types.void(types.intp, values, types.intp, out, types.intp), lower

    @in_python(sums)
    def add_up(which: int, values: Any, at: int, out: Any, to: int) -> None:
        _add_up(values, at, out, to, tables[which - 1]())

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
