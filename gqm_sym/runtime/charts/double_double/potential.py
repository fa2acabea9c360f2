"""The effective potential along a chart in double-double arithmetic, with its derivative."""

from math import fabs, sqrt
from typing import Any, NamedTuple

from gqm_sym.runtime.charts.double_double.offset_path import fill_path
from gqm_sym.runtime.charts.double_double.pieces import (
    DX,
    DX_LOW,
    DY,
    DY_LOW,
    DZ,
    DZ_LOW,
    SHARE,
    X_LOW,
    Y_LOW,
    Z_LOW,
    X,
    Y,
    Z,
    is_in_space,
    piece_of,
    squared_rate,
    stacked_places,
    stacked_points,
)
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.double_double.arithmetic import add, multiply
from gqm_sym.runtime.double_double.interpreter import ERROR, LOW, ROW, call_interpreter
from gqm_sym.runtime.double_double.nodes import RULE


class Path(NamedTuple):
    """The inputs of the time along a curve: the curve, the tape of the potential, its registers, and the level.

    The energy level consists of two doubles, a bound on the error of differences from it at turning points, and a bound
    on its own error, which shifts the turning points.
    """

    curve: Any
    tape: Any
    work: Any
    level: Any


@Inner
def fill_registers(curve, tape, work, n, points, error):  # type: ignore[no-untyped-def]
    """Fill the registers of the coordinates from points of a curve."""
    place = tape[3][1]
    for i in range(n):
        x, z = place + i, place + ROW + i
        work[x], work[x + LOW], work[x + ERROR] = points[X + i], points[X_LOW + i], error
        work[z], work[z + LOW], work[z + ERROR] = points[Z + i], points[Z_LOW + i], error
        if is_in_space(curve):
            y = z + ROW
            work[y], work[y + LOW], work[y + ERROR] = points[Y + i], points[Y_LOW + i], error


@Inner
def fill_potential(path, number, n, u, points, last):  # type: ignore[no-untyped-def]
    """Fill the points of the body's path at places on a piece, and the registers of the potential there, up to the
    operation ``last`` of the tape; return the bounds on errors of `fill_path`.
    """
    curve, tape, work, _ = path
    address, operations, parts, _ = tape
    error, rate_error = fill_path(curve, number, n, u, points)
    fill_registers(curve, tape, work, n, points, error)
    call_interpreter(address, operations, parts[0], last, work, n)
    return error, rate_error


@Inner
def energy_at(path, number, place):  # type: ignore[no-untyped-def]
    """Return the potential (two doubles, error) at a place on a piece, its derivative with respect to u, and the
    derivative of arc length with respect to u.

    The potential is that on the body's path; the arc length is that of the curve.
    """
    curve, tape, work, _ = path
    u, points = stacked_places(), stacked_points()
    u[0], u[RULE] = place
    fill_potential(path, number, 1, u, points, tape[2][2])
    _, _, value, by_x, by_z, by_y = tape[3]
    s, s_low = multiply(work[by_x], work[by_x + LOW], points[DX], points[DX_LOW])
    t, t_low = multiply(work[by_z], work[by_z + LOW], points[DZ], points[DZ_LOW])
    slope = add(s, s_low, t, t_low)
    if is_in_space(curve):
        t, t_low = multiply(work[by_y], work[by_y + LOW], points[DY], points[DY_LOW])
        slope = add(slope[0], slope[1], t, t_low)
    speed = sqrt(squared_rate(curve, points, 0)[0]) / fabs(points[SHARE])
    return (work[value], work[value + LOW], work[value + ERROR]), slope, speed


@Inner
def position(curve, number, place):  # type: ignore[no-untyped-def]
    """Return the approximate arc length of a place."""
    count = curve.counts.shape[0]
    k = piece_of(curve, number)
    low, high = curve.edges[k], curve.edges[k + 1]
    return low + 0.5 * (1.0 + place) * (high - low) + (number // count) * curve.period
