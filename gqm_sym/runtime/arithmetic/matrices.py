"""Products of small constant matrices with vectors, and the extremes of a vector, in vector registers.

numba keeps the order in which a dot product is summed, so it is not vectorised. Here eight results are summed side by
side, row by row of the transposed matrix. Since each sum must wait for the one before, several of them, over
alternating rows, run at the same time. The products are loops: written out for each matrix and each place where it is
used, they would take a twentieth more of the time in which legs are compiled, and no less time when they run.
"""

from collections.abc import Callable, Sequence
from functools import cache, partial, reduce
from itertools import chain
from typing import Any, NamedTuple

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

# Integers of numba's functions.
WHOLE = ir.IntType(64)


class _Layout(NamedTuple):
    """How tables are read, *block* by block; a block is as wide as the first table.

    Attributes
    ----------
    registers : int
        The width of a block in registers. Several blocks side by side are multiplied one after another.
    chains : int
        The number of sums for each result, over alternating rows.
    rest : int
        The number of rows that are left over where the rows are taken by as many as there are chains.
    """

    registers: int
    chains: int
    rest: int


def _laid_out(tables: Sequence[Any]) -> tuple[_Layout, list[Any]]:
    """Return the layout of tables whose blocks have the width of the first table, and the tables by block, row and
    column, padded with zeros to whole registers.
    """
    padded = [np.pad(table, ((0, 0), (0, -table.shape[1] % LANES))) for table in tables]
    width = padded[0].shape[1]
    chains = max(PARALLEL_SUMS // (width // LANES), 1)
    rests = {len(table) % chains for table in padded}
    assert len(rests) == 1, "the tables leave over different numbers of rows"
    blocks = [table.reshape(len(table), -1, width).transpose(1, 0, 2) for table in padded]
    return _Layout(width // LANES, chains, rests.pop()), blocks


def _constant(builder: Any, kind: Any, values: Any) -> Any:
    """Return the address of the first of some constants in memory."""
    held = global_constant(builder, "table", ir.Constant(ir.ArrayType(kind, len(values)), values))
    held.align = 8 * LANES
    return builder.bitcast(held, kind.as_pointer())


def _opaque(builder: Any, value: Any) -> Any:
    """Return a value about which LLVM knows nothing, by an empty piece of assembly.

    Otherwise it would write out a loop over the rows, make single constants of a table's entries, load each from an
    address of its own, and keep all of them on the stack during a loop around it.
    """
    return builder.asm(ir.FunctionType(value.type, [value.type]), "", "=r,0", [value], side_effect=False)


def _emit(builder: Any, values: Any, out: Any, layout: _Layout, entries: Any, groups: Any, blocks: Any) -> None:
    """Emit the product of the numbers at the address ``values`` with a table.

    The table begins at the address ``entries``. It has ``blocks`` blocks, each with ``groups`` groups of as many rows
    as there are chains, and then the rest.
    """
    width, zero = layout.registers * LANES, ir.Constant(REGISTER, [0.0] * LANES)
    held = [[alloca_once_value(builder, zero) for _ in range(layout.registers)] for _ in range(layout.chains)]
    whole_rows = builder.mul(groups, ir.Constant(WHOLE, layout.chains))
    rows = builder.add(whole_rows, ir.Constant(WHOLE, layout.rest))

    def add(block: Any, first: Any, number: int) -> None:
        row = builder.add(first, ir.Constant(WHOLE, number))
        each = broadcast(builder, builder.load(builder.gep(values, [row])))
        at = builder.mul(builder.add(builder.mul(block, rows), row), ir.Constant(WHOLE, width))
        line = builder.gep(entries, [at])
        for k, place in enumerate(held[number]):
            entry = builder.load(register(builder, line, k * LANES), align=8 * LANES)
            builder.store(operation(builder, "fma", each, entry, builder.load(place)), place)

    with for_range(builder, blocks) as block:
        for place in chain.from_iterable(held):
            builder.store(zero, place)
        with for_range(builder, groups) as group:
            first = builder.mul(group.index, ir.Constant(WHOLE, layout.chains))
            for k in range(layout.chains):
                add(block.index, first, k)
        for k in range(layout.rest):
            add(block.index, whole_rows, k)
        line = builder.gep(out, [builder.mul(block.index, ir.Constant(WHOLE, width))])
        for k, parts in enumerate(zip(*held, strict=True)):
            total = reduce(builder.fadd, map(builder.load, parts))
            builder.store(total, register(builder, line, k * LANES), align=8)


def _add_up(values: Any, at: int, out: Any, to: int, layout: _Layout, table: Any) -> None:
    """Do in Python what `_emit` emits."""
    go_on()
    fma, (_, rows, width) = fma_of_arrays(), table.shape
    for block in table:
        totals = [np.zeros(width)] * layout.chains
        for row, value in enumerate(values.reshape(-1)[at : at + rows]):
            totals[row % layout.chains] = fma(value, block[row], totals[row % layout.chains])
        out.reshape(-1)[to : to + width] = reduce(np.add, totals)
        to += width


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
    layout, (laid_out,) = _laid_out([table])

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        entries = _opaque(builder, _constant(builder, REAL, laid_out.ravel().tolist()))
        groups = _opaque(builder, ir.Constant(WHOLE, len(table) // layout.chains))
        addresses = _addresses(context, builder, signature.args, args)
        _emit(builder, *addresses, layout, entries, groups, ir.Constant(WHOLE, 1))
        return context.get_dummy_value()

    @intrinsic
    def sums(_, values, at, out, to):  # type: ignore[no-untyped-def]
        """``out[to:] = values[at:] @ table``."""
        return types.void(values, types.intp, out, types.intp), lower

    @in_python(sums)
    def add_up(values: Any, at: int, out: Any, to: int) -> None:
        _add_up(values, at, out, to, layout, laid_out)

    return sums


def multiply_one_of(tables: Sequence[Callable[[], Any]]) -> Any:
    """Return the compiled function ``f(which, values, at, out, to)`` that multiplies a vector with one of some constant
    matrices, as that of `multiply` does; ``which`` counts from 1.

    The width of each matrix, padded to whole registers, is a multiple of that of the first, so that one piece of code
    serves all of them. A matrix is the result of a function, which is called when the product is compiled or Python
    runs it.
    """

    @cache
    def laid_out() -> tuple[_Layout, list[Any]]:
        return _laid_out([table() for table in tables])

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        layout, blocks = laid_out()
        entries = np.concatenate([table.ravel() for table in blocks])
        starts = np.cumsum([0, *(table.size for table in blocks[:-1])])
        which = builder.sub(args[0], ir.Constant(WHOLE, 1))

        def of_table(numbers: Any) -> Any:
            held = _constant(builder, WHOLE, [int(number) for number in numbers])
            return builder.load(builder.gep(held, [which]))

        start = builder.gep(_constant(builder, REAL, entries.tolist()), [of_table(starts)])
        groups = of_table([table.shape[1] // layout.chains for table in blocks])
        addresses = _addresses(context, builder, signature.args[1:], args[1:])
        _emit(builder, *addresses, layout, start, groups, of_table([len(table) for table in blocks]))
        return context.get_dummy_value()

    @intrinsic
    def sums(_, which, values, at, out, to):  # type: ignore[no-untyped-def]
        """``out[to:] = values[at:] @ tables[which - 1]``."""
        return types.void(types.intp, values, types.intp, out, types.intp), lower

    @in_python(sums)
    def add_up(which: int, values: Any, at: int, out: Any, to: int) -> None:
        layout, blocks = laid_out()
        _add_up(values, at, out, to, layout, blocks[which - 1])

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
