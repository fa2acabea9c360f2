"""Chebyshev series at the places of a row, in vector registers."""

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from gqm_sym.runtime.compiled.registers import INDEX, LANES, REGISTER, Lanes, broadcast, fused, line_of, register
from gqm_sym.runtime.compiled.trial import go_on
from gqm_sym.runtime.compiled.uncompiled import in_python


def series_rows(width: int, count: int) -> Any:
    """Return a compiled function ``f(array, out, twice_x, terms)`` that fills a row with a series.

    The places, twice which are in the row ``twice_x``, are from -1 to 1, and the array has the coefficients from
    ``terms`` on. The sums of Clenshaw's recurrence stay in registers.

    Parameters
    ----------
    width : int
        Numbers of a row, a multiple of LANES.
    count : int
        Coefficients of a series.
    """

    def add_up(twice_x: Any, terms: list[Any], zero: Any) -> Any:
        here, after = zero, zero
        for term in reversed(terms[1:]):
            here, after = fused(twice_x, here, term - after), here
        return fused(twice_x * 0.5, here, terms[0] - after)

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        line = line_of(context, builder, signature.args[0], args[0])
        out, places, first = (builder.gep(line, [at]) for at in args[1:])
        numbers = [builder.load(builder.gep(first, [ir.Constant(INDEX, k)])) for k in range(count)]
        terms = [Lanes(builder, broadcast(builder, number)) for number in numbers]
        zero = Lanes(builder, ir.Constant(REGISTER, [0.0] * LANES))
        rows = [Lanes(builder, builder.load(register(builder, places, at), align=8)) for at in range(0, width, LANES)]
        for k, row in enumerate(rows):
            builder.store(add_up(row, terms, zero).value, register(builder, out, k * LANES), align=8)
        return context.get_dummy_value()

    @intrinsic
    def fill_row(_, line, out, twice_x, terms):  # type: ignore[no-untyped-def]
        """``line[out:] = series(line[terms:], line[twice_x:]/2)``."""
        return types.void(line, types.intp, types.intp, types.intp), lower

    @in_python(fill_row)
    def fill(line: Any, out: int, twice_x: int, terms: int) -> None:
        go_on()
        numbers = line.reshape(-1)
        row = numbers[twice_x : twice_x + width]
        each = [np.full(width, value) for value in numbers[terms : terms + count]]
        numbers[out : out + width] = add_up(row, each, np.zeros(width))

    return fill_row
