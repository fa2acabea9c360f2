"""A tape, that is, a formula as a list of operations, evaluated in double-double arithmetic at many places at once.

A register is a row of the work space with the value at each place of a block: the high doubles, the low ones, and a
bound on the absolute error of each, to first order. Each operation is one loop over the places, which LLVM turns into
vector code. The tape belongs to a module, but the interpreter does not: it is compiled once per installation.
"""

from math import fabs, log
from typing import Any

from llvmlite import ir
from numba import carray, types
from numba.extending import intrinsic

from gqm_sym.runtime.arithmetic.elementary import atan
from gqm_sym.runtime.compiled.emitted import Emitted, run_at
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import on_stack
from gqm_sym.runtime.compiled.uncompiled import in_python
from gqm_sym.runtime.double_double.arithmetic import (
    UNIT,
    add,
    divide,
    exponential,
    improved_arc_tangent,
    improved_logarithm,
    multiply,
    sine_and_cosine,
    square_root,
)

# The number of places that are evaluated together, and the number of doubles of a register.
BLOCK = 64
LOW, ERROR, ROW = BLOCK, 2 * BLOCK, 3 * BLOCK

# Operations. SINE_COSINE fills its register with the sine, and the next one with the cosine.
ADD, SUBTRACT, MULTIPLY, DIVIDE, SQUARE_ROOT, SINE_COSINE, EXPONENTIAL, LOGARITHM, ARC_TANGENT, ABSOLUTE = range(10)


stacked_scratch = on_stack(2 * ROW)


@Inner
def fill_sums(n, sign, a, b, out):  # type: ignore[no-untyped-def]
    """Fill a register with a + sign*b."""
    for i in range(n):
        out[i], out[LOW + i] = add(a[i], a[LOW + i], sign * b[i], sign * b[LOW + i])
        out[ERROR + i] = a[ERROR + i] + b[ERROR + i] + UNIT * fabs(out[i])


@Inner
def fill_products(n, a, b, out):  # type: ignore[no-untyped-def]
    """Fill a register with a*b."""
    for i in range(n):
        out[i], out[LOW + i] = multiply(a[i], a[LOW + i], b[i], b[LOW + i])
        out[ERROR + i] = fabs(a[i]) * b[ERROR + i] + fabs(b[i]) * a[ERROR + i] + UNIT * fabs(out[i])


@Inner
def fill_quotients(n, a, b, out):  # type: ignore[no-untyped-def]
    """Fill a register with a/b."""
    for i in range(n):
        out[i], out[LOW + i] = divide(a[i], a[LOW + i], b[i], b[LOW + i])
        size = fabs(out[i])
        out[ERROR + i] = (a[ERROR + i] + size * b[ERROR + i]) / fabs(b[i]) + 2.0 * UNIT * size


@Inner
def fill_square_roots(n, a, out):  # type: ignore[no-untyped-def]
    """Fill a register with square roots."""
    for i in range(n):
        out[i], out[LOW + i] = square_root(a[i], a[LOW + i])
        out[ERROR + i] = 0.5 * a[ERROR + i] / out[i] + UNIT * out[i]


@Inner
def fill_sines(n, a, out, other):  # type: ignore[no-untyped-def]
    """Fill a register with sines, and another one with cosines."""
    for i in range(n):
        out[i], out[LOW + i], other[i], other[LOW + i] = sine_and_cosine(a[i], a[LOW + i])
        out[ERROR + i] = fabs(other[i]) * a[ERROR + i] + UNIT * min(1.0, 2.0 * fabs(a[i]))
        other[ERROR + i] = fabs(out[i]) * a[ERROR + i] + UNIT


@Inner
def fill_exponentials(n, a, out):  # type: ignore[no-untyped-def]
    """Fill a register with exponentials."""
    for i in range(n):
        out[i], out[LOW + i] = exponential(a[i], a[LOW + i])
        out[ERROR + i] = out[i] * (a[ERROR + i] + 2.0 * UNIT)


@Inner
def fill_logarithms(n, a, out, powers):  # type: ignore[no-untyped-def]
    """Fill a register with logarithms, and another one with the inverses of their exponentials."""
    for i in range(n):
        guess = log(a[i])
        out[i], out[LOW + i], out[ERROR + i] = -guess, 0.0, 0.0
    fill_exponentials(n, out, powers)
    for i in range(n):
        out[i], out[LOW + i] = improved_logarithm(a[i], a[LOW + i], -out[i], powers[i], powers[LOW + i])
        out[ERROR + i] = a[ERROR + i] / a[i] + 2.0 * UNIT * max(1.0, fabs(out[i]))


@Inner
def fill_arc_tangents(n, a, out, sines, cosines):  # type: ignore[no-untyped-def]
    """Fill a register with arc tangents, and two others with their sines and cosines."""
    for i in range(n):
        out[i], out[LOW + i], out[ERROR + i] = atan(a[i]), 0.0, 0.0
    fill_sines(n, out, sines, cosines)
    for i in range(n):
        sine, cosine = (sines[i], sines[LOW + i]), (cosines[i], cosines[LOW + i])
        out[i], out[LOW + i] = improved_arc_tangent(a[i], a[LOW + i], out[i], sine, cosine)
        out[ERROR + i] = a[ERROR + i] / (1.0 + a[i] * a[i]) + 2.0 * UNIT


@Inner
def fill_absolute_values(n, a, out):  # type: ignore[no-untyped-def]
    """Fill a register with absolute values."""
    for i in range(n):
        sign = -1.0 if a[i] < 0.0 else 1.0
        out[i], out[LOW + i], out[ERROR + i] = sign * a[i], sign * a[LOW + i], a[ERROR + i]


def evaluate(operations, first, last, work, n):  # type: ignore[no-untyped-def]
    """Carry out the operations from ``first`` to before ``last`` of a tape at n places.

    Parameters
    ----------
    operations : (m, 4) array of int
        Each operation, with the positions in the work space at which the registers of its result and of its operands
        begin.
    work : array
        The registers. The register of a result is none of those of its operands.
    n : int
        The number of places, at most BLOCK.
    """
    rows, scratch = carray(operations, (last, 4)), stacked_scratch()
    for k in range(first, last):
        operation, at, left, right = rows[k, 0], rows[k, 1], rows[k, 2], rows[k, 3]
        results = 2 if operation == SINE_COSINE else 1
        registers = carray(work, max(at + results * ROW, left + ROW, right + ROW))
        out, a, b = registers[at : at + ROW], registers[left : left + ROW], registers[right : right + ROW]
        if operation == MULTIPLY:
            fill_products(n, a, b, out)
        elif operation <= SUBTRACT:
            fill_sums(n, 1.0 if operation == ADD else -1.0, a, b, out)
        elif operation == DIVIDE:
            fill_quotients(n, a, b, out)
        elif operation == SQUARE_ROOT:
            fill_square_roots(n, a, out)
        elif operation == SINE_COSINE:
            fill_sines(n, a, out, registers[at + ROW : at + 2 * ROW])
        elif operation == EXPONENTIAL:
            fill_exponentials(n, a, out)
        elif operation == LOGARITHM:
            fill_logarithms(n, a, out, scratch[:ROW])
        elif operation == ARC_TANGENT:
            fill_arc_tangents(n, a, out, scratch[:ROW], scratch[ROW:])
        else:
            fill_absolute_values(n, a, out)


# The interpreter, which other compiled functions call by its address. As a part of them it would be optimised again
# with each, which takes seconds.
INTERPRETER = Emitted(
    evaluate,
    types.void(types.CPointer(types.int64), types.intp, types.intp, types.CPointer(types.float64), types.intp),
)


@intrinsic
def call_interpreter(_, address, operations, first, last, work, n):  # type: ignore[no-untyped-def]
    """Call `evaluate` by the address in a memory cell."""

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        address, operations, first, last, work, n = args
        kinds = signature.args
        values = [
            context.make_array(kinds[1])(context, builder, operations).data,
            *(first, last),
            context.make_array(kinds[4])(context, builder, work).data,
            n,
        ]
        function = ir.FunctionType(ir.VoidType(), [value.type for value in values])
        builder.call(builder.load(builder.inttoptr(address, function.as_pointer().as_pointer())), values)
        return context.get_dummy_value()

    size = types.intp
    return types.void(address, operations, size, size, work, size), lower


in_python(call_interpreter)(run_at)
