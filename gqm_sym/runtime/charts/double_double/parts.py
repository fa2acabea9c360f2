"""Divided differences of functions of coordinates along a chart, in arc length and from double-double arithmetic."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numba import types

from gqm_sym.literals.numbers import Number
from gqm_sym.runtime.arithmetic.doubledouble import ZERO, Pair, plus
from gqm_sym.runtime.charts.double_double.making import TruePieces
from gqm_sym.runtime.charts.double_double.offset_path import fill_path
from gqm_sym.runtime.charts.double_double.pieces import (
    SHARE,
    TRUE_CURVE,
    TrueCurve,
    place_at,
    stacked_places,
    stacked_points,
)
from gqm_sym.runtime.charts.double_double.potential import fill_registers
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.types import MATRIX, VECTOR
from gqm_sym.runtime.double_double.arithmetic import add, divide, multiply
from gqm_sym.runtime.double_double.interpreter import LOW, call_interpreter
from gqm_sym.runtime.double_double.nodes import RULE
from gqm_sym.runtime.double_double.quadrature import TAPE
from gqm_sym.runtime.double_double.recording import NOWHERE
from gqm_sym.runtime.double_double.tapes import bind, record_values


class TrueParts(NamedTuple):
    """Functions of the coordinates along a curve.

    Attributes
    ----------
    curve : TrueCurve
        The curve, all pieces of which have been made; it has no pieces if only the chart is known.
    origins : (n+1, 2) array
        Arc lengths from the start point to the edges of its pieces, two doubles each.
    tape, work, parameters
        The functions with the values of their parameters, as `turning_points.locate` takes them.
    values : array of int
        The registers of the functions' values.
    """

    curve: Any
    origins: Any
    tape: Any
    work: Any
    parameters: Any
    values: Any


TRUE_PARTS = types.NamedTuple((TRUE_CURVE, MATRIX, TAPE, VECTOR, MATRIX, types.int64[::1]), TrueParts)

_NONE = np.empty((0, 2))
NO_PARTS = TrueParts(
    TrueCurve(np.empty((0, 4, 0)), np.empty((0, 2), np.int64), _NONE, _NONE, np.empty(0), 0.0, _NONE, _NONE),
    _NONE,
    (0, np.empty((0, 4), np.int64), (0,) * 3, (0,) * 6),
    np.empty(0),
    _NONE,
    np.empty(0, np.int64),
)


@Inner
def fill_values(parts, number, n, u, values, shares):  # type: ignore[no-untyped-def]
    """Fill the values of the functions at n places on a piece, two doubles each, and the length of the body's path over
    that of the curve.
    """
    address, operations, ends, _ = parts.tape
    points = stacked_points()
    fill_path(parts.curve, number, n, u, points)
    for i in range(n):
        shares[i] = points[SHARE + i]
    fill_registers(parts.curve, parts.tape, parts.work, n, points, 0.0)
    call_interpreter(address, operations, ends[0], ends[1], parts.work, n)
    for row in range(parts.values.size):
        for i in range(n):
            at = parts.values[row] + i
            values[row, 0, i], values[row, 1, i] = parts.work[at], parts.work[at + LOW]


@Inner
def fill_differences(parts, number, span, points, differences, ends, shares):  # type: ignore[no-untyped-def]
    """Fill divided differences of the functions over arc length on a part of a piece; return half the part's length.

    Parameters
    ----------
    parts : TrueParts
        The functions.
    number : int
        The piece.
    span : (float, float)
        The start and the end of the part, as shares of the piece. Their difference is exact in doubles.
    points : (RULE,) array
        Places in [-1, 1] on the part.
    differences : (2, m, 2, RULE) array
        Filled with the differences of each function between the left edge of the part and the places, then between the
        places and the right edge, two doubles each.
    ends : (m, 2, 2) array
        Filled with the values of each function at the edges of the part. The second axis is that of the high and the
        low double, the third that of the left and the right edge.
    shares : (RULE,) array
        Filled with the length of the body's path over that of the curve at the places.
    """
    u, values = stacked_places(), np.empty((parts.values.size, 2, RULE))
    length, length_low, _ = parts.curve.lengths[number]
    for i in range(2):
        u[i], u[RULE + i] = 2.0 * span[i] - 1.0, 0.0
        if 0.0 < span[i] < 1.0:
            _, (u[i], u[RULE + i]) = place_at(parts.curve, number, multiply(length, length_low, span[i], 0.0))
    fill_values(parts, number, 2, u, values, shares)
    for row in range(parts.values.size):
        for k in range(2):
            ends[row, k, 0], ends[row, k, 1] = values[row, k, 0], values[row, k, 1]
    begin, begin_low = multiply(length, length_low, span[0], 0.0)
    half, half_low = multiply(length, length_low, 0.5 * (span[1] - span[0]), 0.0)
    for i in range(RULE):
        place, place_low = add(1.0, 0.0, points[i], 0.0)
        place, place_low = multiply(place, place_low, half, half_low)
        place, place_low = add(place, place_low, begin, begin_low)
        _, (u[i], u[RULE + i]) = place_at(parts.curve, number, (place, place_low))
    fill_values(parts, number, RULE, u, values, shares)
    for row in range(parts.values.size):
        for i in range(RULE):
            for side in range(2):
                sign = 1.0 - 2.0 * side
                gain, gain_low = values[row, 0, i], values[row, 1, i]
                gain, gain_low = add(gain, gain_low, -ends[row, 0, side], -ends[row, 1, side])
                place, place_low = add(1.0, 0.0, sign * points[i], 0.0)
                place, place_low = multiply(place, place_low, sign * half, sign * half_low)
                differences[side, row, 0, i], differences[side, row, 1, i] = divide(gain, gain_low, place, place_low)
    return half


def parts_along(
    pieces: TruePieces, function: Callable[..., Any], count: int, p: Sequence[Number], offset: Pair = ZERO
) -> TrueParts | None:
    """Return the first functions that ``function(op, x, z, p)`` gives, or ``function(op, x, y, z, p)`` in space, along
    a curve; None if their formulas are too long.

    ``offset`` is the distance of the body's path to the left of the curve (`TrueCurve`); the coordinates are those of
    that path.
    """
    found = bind(record_values(function, len(p), count, pieces.curve.terms.shape[1] // 2), p)
    if found is None:
        return None
    pieces.make(0, len(pieces.curve.counts) - 1)
    (address, operations, ends, registers), work, parameters = found.operands
    registers, values = (*registers[:2], *(NOWHERE,) * 4), np.array(registers[2:-1], dtype=np.int64)
    origins = np.zeros((len(pieces.curve.counts) + 1, 2))
    for k, (high, low, _) in enumerate(pieces.curve.lengths.tolist()):
        origins[k + 1] = plus(tuple(origins[k].tolist()), (high, low))
    before = plus(tuple(origins[pieces.begin].tolist()), pieces.start_length)
    for row in origins:
        row[:] = plus(tuple(row.tolist()), (-before[0], -before[1]))
    curve = pieces.curve._replace(offset=offset)
    return TrueParts(curve, origins, (address, operations, ends, registers), work, parameters, values)
