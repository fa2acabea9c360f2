"""Samples of a curve F(x, z) = 0 in double-double arithmetic: points at which normals meet it, by Newton's method."""

from math import fabs, sqrt

import numpy as np
from numba import types

from gqm_sym.runtime.charts.double_double.making import SAMPLES
from gqm_sym.runtime.charts.double_double.pieces import NODES
from gqm_sym.runtime.charts.evaluate import EDGES, RECORD, TERMS
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, VECTOR
from gqm_sym.runtime.double_double.arithmetic import UNIT, add, multiply, product
from gqm_sym.runtime.double_double.interpreter import ERROR, LOW, ROW, call_interpreter
from gqm_sym.runtime.double_double.quadrature import TAPE, fill_parameters

# Newton steps from a chart to the curve, or to one next to it; the last one is rounding.
STEPS = 3

# Rows of points: x and z, their low doubles, and likewise a vector along the curve, to which normals are perpendicular.
ROWS = 8

# A tape of F with its work space and its parameters.
LEVEL = types.Tuple((TAPE, VECTOR, MATRIX))


@Inner
def fill_chart(k, block, places, out):  # type: ignore[no-untyped-def]
    """Fill the points of a piece of a chart at places, which are rows of two doubles each. The vectors along it are in
    doubles, because the curve is no farther from the chart than its rounding.
    """
    start = EDGES + 3 * int(block[1]) + 2 + k * RECORD
    for row in range(2):
        for i in range(places.shape[1]):
            high, low, rate = 0.0, 0.0, 0.0
            for j in range(TERMS - 1, -1, -1):
                rate = rate * places[0, i] + high
                high, low = multiply(high, low, places[0, i], places[1, i])
                high, low = add(high, low, block[start + 6 + row * TERMS + j], 0.0)
            high, low = add(high, low, block[start + 2 + 2 * row], block[start + 3 + 2 * row])
            out[row, i], out[2 + row, i], out[4 + row, i], out[6 + row, i] = high, low, rate, 0.0


@Inner
def evaluate(level, out):  # type: ignore[no-untyped-def]
    """Evaluate F and its derivatives at points."""
    (address, operations, parts, (_, place, _, _, _, _)), work, _ = level
    for i in range(out.shape[1]):
        for row in range(2):
            at = place + row * ROW + i
            work[at], work[at + LOW], work[at + ERROR] = out[row, i], out[2 + row, i], 0.0
    call_interpreter(address, operations, parts[0], parts[2], work, out.shape[1])


@Inner
def approach(level, out):  # type: ignore[no-untyped-def]
    """Move points along their normals to the curve; return their error."""
    (_, _, _, (_, _, value, by_x, by_z, _)), work, _ = level
    error = 0.0
    for _ in range(STEPS):
        evaluate(level, out)
        error = 0.0
        for i in range(out.shape[1]):
            dx, dz = out[4, i], out[5, i]
            slope = work[by_x + i] * dz - work[by_z + i] * dx
            step, step_low = -work[value + i] / slope, -work[value + LOW + i] / slope
            for row, rate, rate_low in ((0, dz, out[7, i]), (1, -dx, -out[6, i])):
                high, low = multiply(step, step_low, rate, rate_low)
                out[row, i], out[2 + row, i] = add(out[row, i], out[2 + row, i], high, low)
            # The relative error of the step is at most this.
            uncertainty = work[value + ERROR + i] + 1e-14 * fabs(work[value + i])
            error = max(error, uncertainty / fabs(slope) * sqrt(dx * dx + dz * dz))
    return error


@Inner
def fill_points(k, following, block, nodes, level, out):  # type: ignore[no-untyped-def]
    """Fill the points at which the normals of a piece of a chart meet the curve; return their error.

    Normals at the common edge of two pieces differ by rounding. So the piece is sampled up to the beginning of the
    ``following`` one (negative if there is none).
    """
    places = nodes.copy()
    if following >= 0:
        edge, end, begin = np.zeros((2, 1)), np.empty((ROWS, 1)), np.empty((ROWS, 1))
        edge[0, 0] = 1.0
        fill_chart(k, block, edge, end)
        approach(level, end)
        edge[0, 0] = -1.0
        fill_chart(following, block, edge, begin)
        approach(level, begin)
        ahead, square = 0.0, 0.0
        for row in range(2):
            gap, gap_low = add(begin[row, 0], begin[2 + row, 0], -end[row, 0], -end[2 + row, 0])
            ahead += (gap + gap_low) * end[4 + row, 0]
            square += end[4 + row, 0] ** 2
        for i in range(NODES):
            beyond, beyond_low = product(0.5 * ahead / square, 1.0 + nodes[0, i])
            places[0, i], places[1, i] = add(nodes[0, i], nodes[1, i], beyond, beyond_low)
    fill_chart(k, block, places, out)
    return approach(level, out)


@Inner
def samples_of(out, error):  # type: ignore[no-untyped-def]
    """Return points as samples of a piece (`making.Samples`)."""
    samples = np.empty((2, 2, NODES))
    for row in range(2):
        samples[row, 0], samples[row, 1] = out[row], out[2 + row]
    return samples, error + 2.0 * UNIT * np.abs(samples).max()


@entry(SAMPLES(INTEGER, INTEGER, VECTOR, MATRIX, LEVEL))
def sample_level(k, following, block, nodes, level):  # type: ignore[no-untyped-def]
    """Return the samples of a piece of a curve F = 0: the points at which the normals of its chart meet it."""
    out = np.empty((ROWS, NODES))
    tape, work, p = level
    fill_parameters(tape, p, work)
    return samples_of(out, fill_points(k, following, block, nodes, level, out))


@entry(SAMPLES(INTEGER, INTEGER, VECTOR, MATRIX, LEVEL, LEVEL))
def sample_beside(k, following, block, nodes, level, base):  # type: ignore[no-untyped-def]
    """Return the samples of a piece of a curve F = 0 that has no chart: the points at which the normals of the curve
    ``base`` next to it, at the samples of that, meet it.

    Unlike the normals of the chart, those of the curve have no rounding, which displacements would show.
    """
    out = np.empty((ROWS, NODES))
    tape, work, p = base
    fill_parameters(tape, p, work)
    fill_points(k, following, block, nodes, base, out)
    evaluate(base, out)
    by_x, by_z = tape[3][3], tape[3][4]
    for i in range(NODES):
        out[4, i], out[6, i] = work[by_z + i], work[by_z + LOW + i]
        out[5, i], out[7, i] = -work[by_x + i], -work[by_x + LOW + i]
    tape, work, p = level
    fill_parameters(tape, p, work)
    return samples_of(out, approach(level, out))
