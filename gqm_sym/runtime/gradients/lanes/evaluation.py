"""Compiled code for gradients of many half periods: turning points, then the trapezoidal rule, in batches of orbits."""

from math import fabs, inf, pi

import numpy as np
from numba import types

from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, VECTOR
from gqm_sym.runtime.double_double.arithmetic import UNIT, add
from gqm_sym.runtime.double_double.interpreter import BLOCK, ERROR, LOW, ROW, call_interpreter
from gqm_sym.runtime.gradients.evaluation import PROGRAM
from gqm_sym.runtime.quadrature.trapezoid import (
    MIN_INTERVALS,
    NODE_SHARES,
    has_converged,
)

# The largest numbers of intervals of the trapezoidal rule, in successive passes over the orbits that are left. More of
# them would take longer than double-double arithmetic.
PASSES = (32, 128)

# The smallest ratio of the smallest to the largest regular factor of V**2.
MIN_FACTOR_RATIO = 0.1

# The largest variance of the rounding errors of a mean, as a share of its square, in units of
# ROUNDING**2, so that the standard deviation is at most two thirds of a unit in the last place.
MAX_VARIANCE = 4.7

# The largest condition of an integral, the mean of the absolute values over the absolute mean, by which rounding errors
# may be larger.
MAX_CONDITION = 4.0

# The largest relative difference of two numbers whose arithmetic-geometric mean is their mean, as double precision
# needs it, and the largest error of a derivative as a share of it.
MAX_DIFFERENCE, MAX_ERROR = 3e-9, 1e-18

# The nodes at which the variances of rounding errors are found: one end, the middle, and the other end.
NOISE_NODES = (0, MIN_INTERVALS // 2, MIN_INTERVALS)

# The states of an orbit.
OPEN, ANSWERED, LEFT = range(3)

# The number of intervals from which on means are known well enough to leave an orbit to other arithmetic.
MIN_HOPE = 16

# The number of orbits in a register of the processor.
WIDTH = 8

CODES, POSITIONS = types.int64[:, ::1], types.int64[::1]
LANE_PROGRAM = types.Tuple((types.UniTuple(INTEGER, 3), CODES, CODES, CODES, POSITIONS, POSITIONS, POSITIONS, MATRIX))


@Inner
def fill_input(work, register, launches, column, size, lanes):  # type: ignore[no-untyped-def]
    """Fill a register with a column of the launches; the last launch is repeated."""
    for i in range(lanes):
        at = register * ROW + i
        work[at], work[at + LOW], work[at + ERROR] = launches[min(i, size - 1), column], 0.0, 0.0


@Inner
def fill_place(program, work, places, lanes):  # type: ignore[no-untyped-def]
    """Carry out what depends on the place in a program in double-double arithmetic.

    The rows of ``places`` are two doubles and a bound on the error.
    """
    address, operations, first, count, _ = program
    for i in range(lanes):
        at = count * ROW + i
        work[at], work[at + LOW], work[at + ERROR] = places[0, i], places[1, i], places[2, i]
    call_interpreter(address, operations, first, operations.shape[0], work, lanes)


@Inner
def fill_ends(ends, works, launches, steps, lanes, first, target):  # type: ignore[no-untyped-def]
    """Fill the inputs of the orbits' program from register ``first`` on: both turning points, then their derivatives.

    The turning points of the launches are improved by some steps of Newton's method.
    """
    size, places = launches.shape[0], np.empty((3, BLOCK))
    for program, work in ((ends[0], works[0]), (ends[1], works[1])):
        for k in range(program[3]):
            fill_input(work, k, launches, k, size, lanes)
        call_interpreter(program[0], program[1], 0, program[2], work, lanes)
    (step, moves), count = ends, launches.shape[1] - 2
    wanted = moves[4].size
    for end in range(2):
        for i in range(lanes):
            places[0, i], places[1, i], places[2, i] = launches[min(i, size - 1), count + end], 0.0, 0.0
        for number in range(steps):
            fill_place(step, works[0], places, lanes)
            for i in range(lanes):
                at, to = step[4][0] + i, (first + end) * ROW + i
                places[0, i], places[1, i] = add(places[0, i], places[1, i], works[0][at], works[0][at + LOW])
                last = fabs(works[0][at]) if number > 0 else 0.0  # the first step is far larger than what remains
                target[to], target[to + LOW] = places[0, i], places[1, i]
                target[to + ERROR] = works[0][at + ERROR] + UNIT * fabs(places[0, i]) + last
        for i in range(lanes):  # the slope at a turning point of a small swing is small, and changes much
            places[2, i] = target[(first + end) * ROW + i + ERROR]
        fill_place(moves, works[1], places, lanes)
        for j in range(wanted):
            source, to = moves[4][j], (first + 2 + end * wanted + j) * ROW
            for i in range(lanes):
                for part in range(0, ROW, BLOCK):
                    target[to + part + i] = works[1][source + part + i]


@Inner
def fill_inputs(ends, works, launches, count, steps, lanes, target):  # type: ignore[no-untyped-def]
    """Fill the inputs of the orbits' program: the first columns of the launches, then what `fill_ends` fills.

    If ``ends`` has no results, the program does not depend on the turning points.
    """
    for k in range(count):
        fill_input(target, k, launches, k, launches.shape[0], lanes)
    if ends[0][4].size > 0:
        fill_ends(ends, works, launches, steps, lanes, count, target)


@Inner
def carry_out(program, address, operations, node, work, lanes):  # type: ignore[no-untyped-def]
    """Carry out operations of the orbits' program at one node of the trapezoidal rule."""
    coordinates, places = program[4], program[7]
    share, rest = coordinates[0], coordinates[1]
    for i in range(lanes):
        work[share + i], work[rest + i] = places[0, node], places[1, node]
    call_interpreter(address, operations, 0, operations.shape[0], work, lanes)


@Inner
def fill_variances(program, mirrored, whole, work, lanes, found):  # type: ignore[no-untyped-def]
    """Fill the mean variances of rounding errors of each result, by the trapezoidal rule on NOISE_NODES.

    Of an orbit that is a mirror image of itself, nodes come in pairs with the same errors.
    """
    positions = program[6]
    found[:, :] = 0.0
    for number in range(2 if whole else 3):
        node = NOISE_NODES[number]
        carry_out(program, program[0][2], program[3], node, work, lanes)
        for k in range(positions.size):
            at = positions[k]
            for i in range(lanes):
                weight = 0.25 if number == 0 else (0.5 if number == 1 else 0.25)
                if mirrored[i]:
                    weight = 1.0 if number < 2 else 0.0
                found[k, i] += weight * work[at + i]


@Inner
def add_node(program, work, weights, lanes, sums, factors):  # type: ignore[no-untyped-def]
    """Add the results at one node to the sums: these, what rounding took from them, and the sums of absolute values."""
    outputs = program[5]
    for i in range(lanes):
        factor = work[outputs[0] + i]
        low, high = factors[0, i], factors[1, i]
        factors[0, i], factors[1, i] = low if factor >= low else factor, factor if factor > high else high
    for k in range(outputs.size - 1):
        at, total, lost, size = outputs[1 + k], sums[0, k], sums[1, k], sums[2, k]
        for i in range(lanes):
            value = weights[i] * work[at + i]
            term = value - lost[i]
            more = total[i] + term
            lost[i] = (more - total[i]) - term
            total[i] = more
            size[i] += fabs(value)


@Inner
def judge(rule, lanes, sums, means, changes, factors, variances, answers):  # type: ignore[no-untyped-def]
    """Fill the answers of orbits for which the rule has converged, and their states; return whether further nodes
    would help none of them in this call.

    Further nodes are needed while rounding errors do not average out.

    Parameters
    ----------
    rule : (int, int, int)
        The number of nodes, and the largest numbers of them in this call and in any call.
    changes : array
        The relative changes by the last level; -1 once the rule has converged.
    answers : tuple of arrays
        The derivatives and the states.
    """
    (nodes, limit, most), (found, states), count, is_done = rule, answers, sums.shape[1], True
    for i in range(lanes):
        change, spread = 0.0, 0.0
        for k in range(count):
            mean, size = sums[0, k, i] / nodes, sums[2, k, i] / nodes
            if size != 0.0:
                step = fabs(mean - means[k, i]) / size
                change = step if not step <= change else change
                largest = min(size, MAX_CONDITION * fabs(mean))
                ratio = variances[k, i] / (MAX_VARIANCE * largest * largest)
                spread = ratio if not ratio <= spread else spread
            means[k, i] = mean
        if states[i] == OPEN:
            converged = changes[i] < 0.0 or has_converged(changes[i], change)
            if converged and spread <= nodes and factors[0, i] >= MIN_FACTOR_RATIO * factors[1, i]:
                states[i] = ANSWERED
                for k in range(count):
                    found[i, k] = pi * means[k, i]
            elif nodes >= MIN_HOPE and not (spread <= 2.0 * most and factors[0, i] > 0.0):
                states[i] = LEFT
            changes[i] = -1.0 if converged else change
        # Means have some digits from MIN_HOPE nodes on, by which the number of nodes is known that would suffice.
        is_done = is_done and (states[i] != OPEN or (nodes >= MIN_HOPE and spread > 2.0 * limit))
    return is_done


@Inner
def fill_batch(program, mirrored, limits, work, lanes, sums, answers):  # type: ignore[no-untyped-def]
    """Fill the derivatives of a batch by the trapezoidal rule, whose number of nodes is doubled until it converges.

    Of orbits that are mirror images of themselves, only nodes up to the middle count.
    """
    count = program[5].size - 1
    means, variances = np.zeros((count, BLOCK)), np.empty((count, BLOCK))
    changes, weights, factors = np.full(BLOCK, inf), np.zeros(BLOCK), np.zeros((2, BLOCK))
    whole = True
    for i in range(lanes):
        whole = whole and mirrored[i]
    fill_variances(program, mirrored, whole, work, lanes, variances)
    sums[:, :, :], factors[0, :], factors[1, :] = 0.0, inf, 0.0
    first, nodes = 0, MIN_INTERVALS
    while True:
        for node in range(first, nodes + 1):
            share = NODE_SHARES[node]
            if whole and share > 0.5:
                continue
            edge = 0.5 if share == 0.0 or share == 1.0 else 1.0
            for i in range(lanes):
                side = 1.0 if share == 0.5 or not mirrored[i] else (2.0 if share < 0.5 else 0.0)
                weights[i] = edge * side
            carry_out(program, program[0][1], program[2], node, work, lanes)
            add_node(program, work, weights, lanes, sums, factors)
            if first == 0 and node % 2 == 0:
                for k in range(count):
                    at = program[5][1 + k]
                    for i in range(lanes):
                        means[k, i] += 2.0 * weights[i] * work[at + i] / MIN_INTERVALS
        rule = (nodes, limits[0], limits[1])
        if judge(rule, lanes, sums, means, changes, factors, variances, answers) or nodes == limits[0]:
            return
        first, nodes = nodes + 1, 2 * nodes


@entry(
    types.void(
        *(types.UniTuple(PROGRAM, 2), types.UniTuple(VECTOR, 2), LANE_PROGRAM, VECTOR, types.UniTuple(INTEGER, 3)),
        *(MATRIX, types.boolean[::1], types.Tuple((MATRIX, types.int8[::1]))),
    ),
    nogil=True,
)
def fill_lane_gradients(ends, works, program, work, limits, launches, mirrored, answers):  # type: ignore[no-untyped-def]
    """Fill the derivatives of half periods, as far as double precision suffices.

    Parameters
    ----------
    ends, works
        The programs of the Newton step to a turning point, and of the derivatives of a turning point
        (`programs.end_programs`), with their work spaces; without results for launches from rest.
    program, work
        The program of an orbit (`assembly.LaneProgram.operands`), with its work space.
    limits : (int, int, int)
        The number of columns of the launches that are inputs of the program, and the largest numbers of intervals in
        this call and in any call.
    launches : (m, n + 2) array
        The n variables of each launch, and its turning points to the accuracy of doubles; for launches from rest, the
        inputs of the program (`programs.Orbits`).
    mirrored : (m,) array
        Whether each orbit is a mirror image of itself.
    answers : ((m, k) array, (m,) array)
        The derivatives, and the states: OPEN where more intervals are needed, and LEFT where digits are lost.
    """
    found, states = answers
    count, inputs = found.shape[1], limits[0]
    sums, values, even = np.empty((3, count, BLOCK)), np.empty((BLOCK, count)), np.zeros(BLOCK, np.bool_)
    kinds = np.zeros(BLOCK, np.int8)
    for start in range(0, launches.shape[0], BLOCK):
        stop = min(start + BLOCK, launches.shape[0])
        size, some = stop - start, launches[start:stop]
        lanes = -(-size // WIDTH) * WIDTH
        for i in range(lanes):
            even[i], kinds[i] = mirrored[start + min(i, size - 1)], OPEN
        fill_inputs(ends, works, some, inputs, 1, lanes, work)
        call_interpreter(program[0][0], program[1], 0, program[1].shape[0], work, lanes)
        fill_batch(program, even, limits[1:], work, lanes, sums, (values, kinds))
        for i in range(size):
            found[start + i], states[start + i] = values[i], kinds[i]


@entry(
    types.void(
        *(types.UniTuple(PROGRAM, 2), types.UniTuple(VECTOR, 2), PROGRAM, VECTOR, INTEGER),
        *(MATRIX, types.Tuple((MATRIX, types.int8[::1]))),
    ),
    nogil=True,
)
def fill_mean_gradients(ends, works, program, work, inputs, launches, answers):  # type: ignore[no-untyped-def]
    """Fill the derivatives of half periods that are pi over an arithmetic-geometric mean.

    The arguments are as for `fill_lane_gradients`, except that the orbit's program is `programs.mean_program`, and that
    ``inputs`` is the number of columns of the launches that are its inputs.
    """
    found, states = answers
    address, operations, _, _, outputs = program
    for start in range(0, launches.shape[0], BLOCK):
        stop = min(start + BLOCK, launches.shape[0])
        some, lanes = launches[start:stop], -(-(stop - start) // WIDTH) * WIDTH
        fill_inputs(ends, works, some, inputs, 1, lanes, work)
        call_interpreter(address, operations, 0, operations.shape[0], work, lanes)
        for i in range(stop - start):
            is_known = fabs(work[outputs[0] + i]) <= MAX_DIFFERENCE
            for j in range(found.shape[1]):
                at = outputs[1 + j] + i
                found[start + i, j] = work[at]
                is_known &= work[at + ERROR] <= MAX_ERROR * fabs(work[at])
            states[start + i] = ANSWERED if is_known else OPEN
