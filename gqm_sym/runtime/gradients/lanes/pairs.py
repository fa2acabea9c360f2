"""Compiled code for gradients of many half periods, laps or turning points in double-double arithmetic, with one orbit
in each lane; and of half periods that are arithmetic-geometric means, of which only small shares are doubles.
"""

from math import fabs, inf, nan

import numpy as np
from numba import types

from gqm_sym.runtime.compiled.intrinsics import choose
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, VECTOR
from gqm_sym.runtime.double_double.arithmetic import UNIT, add, multiply
from gqm_sym.runtime.double_double.interpreter import BLOCK, ROW, call_interpreter
from gqm_sym.runtime.double_double.nodes import LEVELS
from gqm_sym.runtime.gradients.evaluation import (
    MAX_LAP_CHANGE,
    MAX_NEXT_CHANGE,
    MAX_RATIO,
    MAX_ROUNDING,
    MEAN,
    PROGRAM,
    is_significant,
    rounding_of,
)
from gqm_sym.runtime.gradients.lanes.evaluation import (
    ANSWERED,
    LANE_PROGRAM,
    OPEN,
    WIDTH,
    fill_column,
    fill_inputs,
    fill_place,
    fill_turns,
    rows_of,
    take_step,
)

# The number of Newton steps to the turning points, starting from doubles.
NEWTON_STEPS = 2

# The largest relative difference of two numbers whose arithmetic-geometric mean is their mean, as double precision
# needs it.
MAX_DIFFERENCE = 3e-9

# The rows of the state of an orbit: the change by the last level, and whether the rule has converged (-1 if it never
# will, because digits are lost).
CHANGE, DONE = range(2)


@Inner
def fill_ends(ends, works, launches, lanes, first, target):  # type: ignore[no-untyped-def]
    """Fill the inputs of the orbits' program from register ``first`` on: the turning points, then their derivatives.

    The turning points are the columns of the launches from ``first`` on: both, or the upper one. They are improved by
    NEWTON_STEPS steps of Newton's method.
    """
    places = np.empty((3, BLOCK))
    for program, work in ((ends[0], works[0]), (ends[1], works[1])):
        fill_inputs(work, program[3], launches, lanes)
        call_interpreter(program[0], program[1], 0, program[2], work, lanes)
    (step, moves), sides = ends, launches[0].shape[0] - first
    wanted = moves[4].size
    for end in range(sides):
        fill_column(places[0], launches, first + end, lanes)
        places[1:, :] = 0.0
        found = rows_of(target, (first + end) * ROW)
        for number in range(NEWTON_STEPS):
            fill_place(step, works[0], places, lanes)
            take_step(works[0], step[4][0], number > 0, lanes, places, found)
        for i in range(lanes):  # the slope at a turning point of a small swing is small, and changes much
            places[2, i] = found[2][i]
        fill_place(moves, works[1], places, lanes)
        for j in range(wanted):
            source, to = moves[4][j], (first + sides + end * wanted + j) * ROW
            target[to : to + ROW] = works[1][source : source + ROW]


@Inner
def add_node(program, work, mirrored, is_second, lanes, sums):  # type: ignore[no-untyped-def]
    """Add the results at one node to the sums: both doubles, the bounds on errors, and the sums of absolute values.

    Of orbits that are mirror images of themselves only the first half counts, whoever their neighbours are.
    """
    for j in range(program[4].size):
        values, rests, errors = rows_of(work, program[4][j])
        high, low, error, size = sums[j, 0], sums[j, 1], sums[j, 2], sums[j, 3]
        for i in range(lanes):
            side = choose((mirrored[i] == 1.0) & is_second, 0.0, 1.0)
            total, rest = add(high[i], low[i], side * values[i], side * rests[i])
            high[i], low[i] = total, rest
            error[i] += side * (errors[i] + UNIT * fabs(total))
            size[i] += side * fabs(values[i])


@Inner
def add_nodes(program, work, nodes, n, mirrored, lanes, sums):  # type: ignore[no-untyped-def]
    """Fill the means of each result over n midpoints (`evaluation.add_midpoints`)."""
    address, operations, first, count, outputs = program
    share, rest, error = rows_of(work, count * ROW)
    halved = 1.0
    for i in range(lanes):
        halved = choose(mirrored[i] == 1.0, halved, 0.0)
    sums[:, :, :] = 0.0
    for node in range(n, n + n // 2 if halved == 1.0 else 2 * n):
        for i in range(lanes):
            share[i], rest[i], error[i] = nodes[0, node], nodes[1, node], UNIT * nodes[0, node]
        call_interpreter(address, operations, first, operations.shape[0], work, lanes)
        add_node(program, work, mirrored, node >= n + n // 2, lanes, sums)
    for j in range(outputs.size):
        for part in range(MEAN):
            values = sums[j, part]
            for i in range(lanes):
                values[i] *= choose(mirrored[i] == 1.0, 2.0, 1.0) / n


@Inner
def judge_means(level, is_last, lanes, sums, means, states, limits):  # type: ignore[no-untyped-def]
    """Take the means of a level for orbits for which the rule has not converged; return whether there is none left.

    The criteria are those of `evaluation.fill_means_of`. The ``limits`` are for the next change, as a share of each
    mean, and for the change before. Of a level that is the last one it is known that the rule has converged.
    """
    is_done, (most, max_before) = True, limits
    for i in range(lanes):
        if states[DONE, i] != 0.0:
            continue
        change, rounding, condition = 0.0, 0.0, 0.0
        for j in range(sums.shape[0]):
            size = sums[j, 3, i]
            if is_significant(j, size, sums[j, 2, i]):
                step = fabs(add(sums[j, 0, i], sums[j, 1, i], -means[j, 0, i], -means[j, 1, i])[0]) / size
                change = step if not step <= change else change
            share = rounding_of(j, size, sums[j, 2, i], sums[0, 3, i])
            rounding = share if not share <= rounding else rounding
            means[j, 0, i], means[j, 1, i], means[j, 2, i] = sums[j, 0, i], sums[j, 1, i], 0.0
            if is_significant(j, size, sums[j, 2, i]):
                means[j, 2, i] = sums[j, 2, i]
                condition = max(condition, size / fabs(sums[j, 0, i]) if sums[j, 0, i] != 0.0 else inf)
        before = states[CHANGE, i]
        has_converged = change <= MAX_RATIO * before and change * change <= MAX_NEXT_CHANGE * before
        has_converged = has_converged and before <= max_before and not change * change * condition > most * before
        if not rounding <= MAX_ROUNDING:
            states[DONE, i] = -1.0
        elif is_last or (level > 1 and has_converged):
            states[DONE, i] = 1.0
        states[CHANGE, i] = change if level > 1 else 1.0
        is_done = is_done and states[DONE, i] != 0.0
    return is_done


@entry(
    types.void(
        *(types.UniTuple(PROGRAM, 2), types.UniTuple(VECTOR, 2), PROGRAM, VECTOR),
        *(types.Tuple((INTEGER, types.UniTuple(types.float64, 2), MATRIX, types.float64, INTEGER)),),
        *(MATRIX, types.boolean[::1], MATRIX),
    ),
    nogil=True,
)
def fill_pair_gradients(ends, works, program, work, rule, launches, mirrored, found):  # type: ignore[no-untyped-def]
    """Fill the derivatives of half periods, or of times of laps, with NaN where double-double arithmetic does not
    suffice.

    Parameters
    ----------
    ends, works
        The programs of the Newton step to a turning point, and of the derivatives of a turning point
        (`programs.end_programs`), with their work spaces; without results where the program needs no turning points.
    program, work
        The program of an orbit, whose first result is dt/dphi, and its work space.
    rule : (int, (float, float), (4, k) array, float, int)
        The number of columns of the launches that are inputs of the program; the range of the phase, as two doubles;
        the table of shares (`nodes.trapezoidal_nodes`); the largest error of a derivative as a share of it, in addition
        to the share of the mean of absolute values; and the number of nodes with which the rule has converged, or 0 if
        it is not known.
    launches : (n, m) array
        The inputs of the program, and then turning points to the accuracy of doubles if the program needs them.
    mirrored : (m,) array
        Whether each orbit is a mirror image of itself.
    found : (m, k) array
        Filled with the derivatives.
    """
    count, (inputs, phase, nodes, most, enough), even = found.shape[1], rule, np.zeros(BLOCK)
    # The time itself is never zero, so that its rounding shows where all digits of derivatives are lost.
    max_before = MAX_LAP_CHANGE if phase[0] == 1.0 else inf  # the phase of laps is the share
    sums, means, states = np.empty((1 + count, MEAN, BLOCK)), np.empty((1 + count, 3, BLOCK)), np.empty((2, BLOCK))
    for start in range(0, launches.shape[1], BLOCK):
        size = min(BLOCK, launches.shape[1] - start)
        some, lanes = (launches, start, size), -(-size // WIDTH) * WIDTH
        for i in range(lanes):
            even[i] = 1.0 if mirrored[start + min(i, size - 1)] else 0.0
        fill_inputs(work, inputs, some, lanes)
        if ends[0][4].size > 0:
            fill_ends(ends, works, some, lanes, inputs, work)
        call_interpreter(program[0], program[1], 0, program[2], work, lanes)
        means[:, :, :], states[CHANGE, :], states[DONE, :] = 0.0, inf, 0.0
        for level in range(1, len(LEVELS) - 1):
            if LEVELS[level] < enough:
                continue
            add_nodes(program, work, nodes, LEVELS[level], even, lanes, sums)
            if judge_means(level, enough > 0, lanes, sums, means, states, (most, max_before)):
                break
        for i in range(size):
            for j in range(count):
                high, low, error = means[1 + j, 0, i], means[1 + j, 1, i], means[1 + j, 2, i]
                is_known = states[DONE, i] == 1.0 and not error > most * fabs(high)
                found[start + i, j] = multiply(high, low, phase[0], phase[1])[0] if is_known else nan


@entry(types.void(types.UniTuple(PROGRAM, 2), types.UniTuple(VECTOR, 2), MATRIX, MATRIX), nogil=True)
def fill_turn_gradients(ends, works, launches, found):  # type: ignore[no-untyped-def]
    """Fill the derivatives of the lower and then of the upper turning point.

    Parameters
    ----------
    ends, works
        As for `fill_pair_gradients`.
    launches : (n + 2, m) array
        The n variables of each launch, and its turning points to the accuracy of doubles.
    found : (m, 2*k) array
        Filled with the derivatives.
    """
    first = launches.shape[0] - 2
    target = np.zeros((first + 2 + found.shape[1]) * ROW)
    for start in range(0, launches.shape[1], BLOCK):
        size = min(BLOCK, launches.shape[1] - start)
        lanes = -(-size // WIDTH) * WIDTH
        fill_ends(ends, works, (launches, start, size), lanes, first, target)
        for j in range(found.shape[1]):
            values = rows_of(target, (first + 2 + j) * ROW)[0]
            for i in range(size):
                found[start + i, j] = values[i]


@entry(
    types.void(
        *(PROGRAM, VECTOR, LANE_PROGRAM, VECTOR, INTEGER),
        *(MATRIX, types.Tuple((MATRIX, types.int8[::1]))),
    ),
    nogil=True,
)
def fill_mean_gradients(turn, turn_work, program, work, inputs, launches, answers):  # type: ignore[no-untyped-def]
    """Fill the derivatives of half periods that are pi over an arithmetic-geometric mean.

    The arguments are as for `evaluation.fill_lane_gradients`, except that the orbit's program is
    `programs.mean_program`, and that ``inputs`` is the number of columns of the launches that are its inputs.
    """
    found, states = answers
    coordinates, outputs = program[4], program[5]
    first = outputs.size - found.shape[1]
    for start in range(0, launches.shape[1], BLOCK):
        size = min(BLOCK, launches.shape[1] - start)
        some, lanes = (launches, start, size), -(-size // WIDTH) * WIDTH
        fill_inputs(work, inputs, some, lanes)
        fill_turns(turn, turn_work, some, lanes, inputs, work)
        call_interpreter(program[0][0], program[1], 0, program[1].shape[0], work, lanes)
        one = rows_of(work, coordinates[0])[0]
        one[:lanes] = 1.0
        call_interpreter(program[0][1], program[2], 0, program[2].shape[0], work, lanes)
        known = rows_of(work, outputs[0])[0]
        for i in range(lanes):
            known[i] = choose(fabs(known[i]) <= MAX_DIFFERENCE, 1.0, 0.0)
        for j in range(1, first):
            loss = rows_of(work, outputs[j])[0]
            for i in range(lanes):
                known[i] = choose(loss[i] <= 0.0, known[i], 0.0)
        for j in range(found.shape[1]):
            values = rows_of(work, outputs[first + j])[0]
            for i in range(size):
                found[start + i, j] = values[i]
        for i in range(size):
            states[start + i] = ANSWERED if known[i] == 1.0 else OPEN
