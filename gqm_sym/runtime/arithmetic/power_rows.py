"""Polynomials in powers of a place at many places, in vector registers."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from gqm_sym.runtime.compiled.registers import INDEX, LANES, REGISTER, broadcast, line_of, operation, register
from gqm_sym.runtime.compiled.uncompiled import fma, in_python


def filling(count: int, degree: int) -> Any:
    """Return a function that fills so many registers' numbers of a row at a time, a term of all of them after the
    other, so that none waits for the last operation on itself.

    It is called with ``(chart, terms, places, at, out, to, first, numbers)``: the powers of u are stored at ``terms``
    of the chart, the places from ``at`` on in ``places``, and the values from ``to`` on in ``out``. Lanes before
    ``first`` keep their values. The ``numbers`` are the length of all laps before, the piece's middle and scale, the
    limit of u, and two numbers that the polynomial is added to.
    """

    @intrinsic
    def fill(_, chart, terms, places, at, out, to, first, numbers):  # type: ignore[no-untyped-def]
        def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            lines = [line_of(context, builder, signature.args[k], args[k]) for k in (0, 2, 4)]
            powers, given, target = (builder.gep(line, [args[k]]) for line, k in zip(lines, (1, 3, 5), strict=True))
            lap, middle, scale, limit, whole, low = (
                broadcast(builder, builder.extract_value(args[7], k)) for k in range(6)
            )
            below, us = builder.fneg(limit), []
            for k in range(count):
                s = builder.load(register(builder, given, k * LANES), align=8)
                u = builder.fmul(builder.fsub(builder.fsub(s, lap), middle), scale)
                u = builder.select(builder.fcmp_ordered("<", u, below), below, u)
                us.append(builder.select(builder.fcmp_ordered(">", u, limit), limit, u))
            values = [ir.Constant(REGISTER, [0.0] * LANES)] * count
            for k in range(degree, -1, -1):
                term = broadcast(builder, builder.load(builder.gep(powers, [ir.Constant(INDEX, k)])))
                values = [operation(builder, "fma", value, u, term) for value, u in zip(values, us, strict=True)]
            values = [builder.fadd(whole, builder.fadd(low, value)) for value in values]
            old = builder.load(register(builder, target, 0), align=8)
            lane = ir.Constant(ir.VectorType(ir.IntType(64), LANES), list(range(LANES)))
            bound = ir.Constant(ir.VectorType(ir.IntType(64), LANES), ir.Undefined)
            for k in range(LANES):
                bound = builder.insert_element(bound, args[6], ir.Constant(INDEX, k))
            values[0] = builder.select(builder.icmp_signed("<", lane, bound), old, values[0])
            for k, value in enumerate(values):
                builder.store(value, register(builder, target, k * LANES), align=8)
            return context.get_dummy_value()

        return types.void(chart, terms, places, at, out, to, first, numbers), lower

    @in_python(fill)
    def _fill(chart: Any, terms: int, places: Any, at: int, out: Any, to: int, first: int, numbers: Any) -> None:
        lap, middle, scale, limit, whole, low = numbers
        for lane in range(max(first, 0), count * LANES):
            u = min(max(((places[at + lane] - lap) - middle) * scale, -limit), limit)
            value = 0.0
            for k in range(degree, -1, -1):
                value = fma(value, u, chart[terms + k])
            out.reshape(-1)[to + lane] = whole + (low + value)

    return fill
