"""Arithmetic on rows of numbers in vector registers.

LLVM unrolls a loop of known length before it looks for operations that could be done in parallel, and then does not
vectorise it. So the vector operations are written here. A row is a part of a contiguous array that fills some
registers; it is given by the index at which it begins.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.cgutils import get_or_insert_function
from numba.extending import intrinsic

from gqm_sym.runtime.compiled.trial import go_on
from gqm_sym.runtime.compiled.uncompiled import fma_of_arrays, in_python

# Doubles in a register.
LANES = 8
REAL, INDEX = ir.DoubleType(), ir.IntType(32)
REGISTER = ir.VectorType(REAL, LANES)


def line_of(context: Any, builder: Any, kind: Any, array: Any) -> Any:
    """Return the address of the first number of a contiguous array."""
    assert kind.layout == "C"
    return context.make_array(kind)(context, builder, array).data


def register(builder: Any, line: Any, offset: int) -> Any:
    """Return the address of a register's numbers in an array."""
    return builder.bitcast(builder.gep(line, [ir.Constant(INDEX, offset)]), REGISTER.as_pointer())


def broadcast(builder: Any, value: Any) -> Any:
    """Return a register with the same number in all lanes."""
    one = builder.insert_element(ir.Constant(REGISTER, ir.Undefined), value, ir.Constant(INDEX, 0))
    return builder.shuffle_vector(one, one, ir.Constant(ir.VectorType(INDEX, LANES), [0] * LANES))


def operation(builder: Any, name: str, *values: Any) -> Any:
    """Apply one of LLVM's operations to registers, lane by lane: "fma", "sqrt" or "fabs"."""
    kind = ir.FunctionType(REGISTER, [REGISTER] * len(values))
    return builder.call(get_or_insert_function(builder.module, kind, f"llvm.{name}.v{LANES}f64"), values)


class Lanes:
    """A register while code is generated: its operators emit LLVM instructions."""

    def __init__(self, builder: Any, value: Any) -> None:
        self.builder, self.value = builder, value

    def _with(self, other: Any, make: Callable[[Any, Any], Any], *, turned: bool = False) -> "Lanes":
        given = other.value if isinstance(other, Lanes) else ir.Constant(REGISTER, [float(other)] * LANES)
        return Lanes(self.builder, make(given, self.value) if turned else make(self.value, given))

    def __add__(self, other: Any) -> "Lanes":
        return self._with(other, self.builder.fadd)

    def __radd__(self, other: Any) -> "Lanes":
        return self._with(other, self.builder.fadd, turned=True)

    def __sub__(self, other: Any) -> "Lanes":
        return self._with(other, self.builder.fsub)

    def __mul__(self, other: Any) -> "Lanes":
        return self._with(other, self.builder.fmul)

    def __rmul__(self, other: Any) -> "Lanes":
        return self._with(other, self.builder.fmul, turned=True)

    def __truediv__(self, other: Any) -> "Lanes":
        return self._with(other, self.builder.fdiv)

    def sqrt(self) -> "Lanes":
        """Emit a square root; `numpy.sqrt` calls a method of this name."""
        return self._called("sqrt")

    def __abs__(self) -> "Lanes":
        return self._called("fabs")

    def _called(self, name: str) -> "Lanes":
        return Lanes(self.builder, operation(self.builder, name, self.value))


def fused(x: Any, y: Any, z: Any) -> Any:
    """Return x * y + z with one rounding, for the formulas of rows; ``z`` may be a number."""
    if isinstance(x, Lanes):
        total = z.value if isinstance(z, Lanes) else ir.Constant(REGISTER, [float(z)] * LANES)
        return Lanes(x.builder, operation(x.builder, "fma", x.value, y.value, total))
    return fma_of_arrays()(x, y, z).astype(np.float64)


def over_rows(formula: Callable[..., Any], width: int) -> Any:
    """Return a compiled function ``f(array, out, ...)`` that fills a row by a formula.

    An integer argument is the index at which a row begins; a float is the same in all lanes.

    Parameters
    ----------
    formula
        A function of registers, made of ``+ - * /``, ``abs``, ``numpy.sqrt`` and `fused`.
    width : int
        Numbers of a row, a multiple of LANES.
    """

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        line = line_of(context, builder, signature.args[0], args[0])
        rows = [
            None if isinstance(kind, types.Float) else builder.gep(line, [at])
            for kind, at in zip(signature.args[1:], args[1:], strict=True)
        ]
        numbers = [
            broadcast(builder, value) if row is None else None for row, value in zip(rows, args[1:], strict=True)
        ]
        found = []
        for offset in range(0, width, LANES):
            given = [
                Lanes(builder, number if row is None else builder.load(register(builder, row, offset), align=8))
                for row, number in zip(rows[1:], numbers[1:], strict=True)
            ]
            found.append(formula(*given).value)
        for k, value in enumerate(found):
            builder.store(value, register(builder, rows[0], k * LANES), align=8)
        return context.get_dummy_value()

    def typed(line: Any, out: Any, *given: Any) -> Any:
        return types.void(line, out, *given), lower

    # numba reads the number of arguments from the function's signature.
    forms: tuple[Callable[..., Any], ...] = (
        lambda _, line, out, a: typed(line, out, a),
        lambda _, line, out, a, b: typed(line, out, a, b),
        lambda _, line, out, a, b, c: typed(line, out, a, b, c),
        lambda _, line, out, a, b, c, d: typed(line, out, a, b, c, d),
        lambda _, line, out, a, b, c, d, e: typed(line, out, a, b, c, d, e),
    )
    form = forms[(formula.nin if isinstance(formula, np.ufunc) else formula.__code__.co_argcount) - 1]
    form.__name__ = "fill_row"
    filler = intrinsic(form)

    @in_python(filler)
    def fill(line: Any, out: int, *given: Any) -> None:
        go_on()
        numbers = line.reshape(-1)
        rows = (value if isinstance(value, float) else numbers[value : value + width] for value in given)
        numbers[out : out + width] = formula(*rows)

    return filler


def copied(width: int) -> Any:
    """Return a compiled function ``f(target, to, source, at)`` that copies a row of ``width`` numbers."""

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        target, line = (
            builder.gep(line_of(context, builder, signature.args[k], args[k]), [args[k + 1]]) for k in (0, 2)
        )
        rows = [builder.load(register(builder, line, offset), align=8) for offset in range(0, width, LANES)]
        for k, row in enumerate(rows):
            builder.store(row, register(builder, target, k * LANES), align=8)
        return context.get_dummy_value()

    @intrinsic
    def copy_row(_, target, to, line, at):  # type: ignore[no-untyped-def]
        """``target[to:] = line[at:]``."""
        return types.void(target, types.intp, line, types.intp), lower

    @in_python(copy_row)
    def copy(target: Any, to: int, line: Any, at: int) -> None:
        target.reshape(-1)[to : to + width] = line.reshape(-1)[at : at + width]

    return copy_row


@intrinsic
def opaque(_, count):  # type: ignore[no-untyped-def]
    """Return an integer unknown to LLVM, which vectorises a loop of that length; it would unroll it otherwise."""

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        whole = ir.IntType(64)  # an empty piece of assembly, through which LLVM does not look
        return builder.asm(ir.FunctionType(whole, [whole]), "", "=r,0", [args[0]], side_effect=False)

    return types.int64(types.int64), lower


@intrinsic
def borrowed(_, array):  # type: ignore[no-untyped-def]
    """Return an array whose references numba does not count, for calls that end before its owner does."""

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        held = context.make_array(signature.args[0])(context, builder, args[0])
        held.meminfo = cgutils.get_null_value(held.meminfo.type)
        held.parent = cgutils.get_null_value(held.parent.type)
        return held._getvalue()

    return array(array), lower


@in_python(opaque)
@in_python(borrowed)
def _same(given: Any) -> Any:
    return given


def on_stack(count: int) -> Any:
    """Return a compiled function ``f()`` that returns an array of ``count`` numbers on the stack of its caller.

    The array is valid until the caller returns. numba does not count references to it, as it does for other arrays at
    every call.
    """
    kind, whole = types.Array(types.float64, 1, "C"), ir.IntType(64)

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        with builder.goto_entry_block():
            data = builder.alloca(ir.ArrayType(REAL, count))
        data.align = 8 * LANES
        array = context.make_array(kind)(context, builder)
        size, length = ir.Constant(whole, 8), [ir.Constant(whole, count)]
        context.populate_array(
            array,
            data=builder.bitcast(data, REAL.as_pointer()),
            shape=length,
            strides=[size],
            itemsize=size,
            meminfo=None,
        )
        return array._getvalue()

    @intrinsic
    def stacked(_):  # type: ignore[no-untyped-def]
        """Return the array."""
        return kind(), lower

    in_python(stacked)(lambda: np.empty(count))
    return stacked
