"""Compiled code for gradients of many half periods: turning points, then the trapezoidal rule, in batches of orbits."""

from math import fabs, inf

import numpy as np
from numba import types

from gqm_sym.runtime.arithmetic.elementary import HALF_PI
from gqm_sym.runtime.compiled.intrinsics import choose, fma
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, VECTOR
from gqm_sym.runtime.double_double.arithmetic import UNIT, add
from gqm_sym.runtime.double_double.interpreter import BLOCK, ERROR, LOW, ROW, call_interpreter
from gqm_sym.runtime.gradients.evaluation import PROGRAM
from gqm_sym.runtime.quadrature.trapezoid import MIN_INTERVALS, NODE_SHARES, has_converged

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

# The nodes at which the variances of rounding errors are found. A program of them with more than so many operations is
# carried out at every other one only, where it may find variances up to a half too large.
NOISE_NODES, MAX_NOISE_OPERATIONS = tuple(MIN_INTERVALS * k // 4 for k in range(5)), 1024

# The states of an orbit. To the last one the level is added from which double-double arithmetic needs only the nodes,
# 1 for twice MIN_INTERVALS and so on; 0 if it is not known.
OPEN, ANSWERED, LEFT = range(3)

# The error of the rule with n intervals is c*r**n, and c is at least 1e-5 (`quadrature.trapezoid`). So the square of
# the change by the last doubling, over c, is a bound on the error, which is below 1e-20 up to the first of these
# changes; up to the second one it is after another doubling. Changes decrease by a factor at least, unless they are as
# small as this, where roundings contribute to them.
MAX_CHANGE, MAX_CHANGE_EARLIER = 3e-13, 1.7e-9
MAX_SHRINK, MIN_BEFORE = 1e-3, 1e-10

# The change from which on such changes are waited for, and the number of intervals up to which they are.
MAX_NEAR, MAX_WAIT = 1e-3, 64

# The rows of numbers for the orbits of a batch: the state; the changes by the last level, or -1 once the rule has
# converged, and by this one; the number of nodes that rounding errors need; the smallest and the largest regular factor
# of V**2; whether the orbit is a mirror image of itself; the weight of a node; whether this level has answered it; the
# number of intervals that suffices in double-double arithmetic, 0 if it is not known.
STATE, BEFORE, CHANGE, SPREAD, SMALLEST, LARGEST, MIRRORED, WEIGHT, NEW, ENOUGH, ROWS = range(11)

# The share of orbits of a batch up to which those that are open are left to another call.
MAX_OPEN = 0.375

# Pi as two doubles.
PI_HIGH, PI_LOW = 2.0 * HALF_PI[0], 2.0 * HALF_PI[1]

# The number of intervals from which on means are known well enough to leave an orbit to other arithmetic.
MIN_HOPE = 16

# The number of orbits in a register of the processor.
WIDTH = 8

CODES, POSITIONS = types.int64[:, ::1], types.int64[::1]
LANE_PROGRAM = types.Tuple((types.UniTuple(INTEGER, 3), CODES, CODES, CODES, POSITIONS, POSITIONS, POSITIONS, MATRIX))


@Inner
def rows_of(work, position):  # type: ignore[no-untyped-def]
    """Return the rows of a register: high doubles, low doubles and bounds on the errors.

    Loops over rows are vectorised; those over indices that are sums are not, because these could be negative.
    """
    low, error = position + LOW, position + ERROR
    return work[position : position + BLOCK], work[low : low + BLOCK], work[error : error + BLOCK]


@Inner
def fill_column(row, launches, column, lanes):  # type: ignore[no-untyped-def]
    """Fill a row with a column of some of the launches; the last of these is repeated.

    Parameters
    ----------
    row : array
        The row.
    launches : ((k, m) array, int, int)
        All launches, the first of those that are meant, and how many these are.
    column, lanes : int
        The column, and the number of launches with repetitions.
    """
    table, start, size = launches
    values = table[column, start : start + size]
    for i in range(size):
        row[i] = values[i]
    for i in range(size, lanes):
        row[i] = values[size - 1]


@Inner
def fill_inputs(work, count, launches, lanes):  # type: ignore[no-untyped-def]
    """Fill the first registers with so many columns of some of the launches (`fill_column`), which are exact."""
    for k in range(count):
        high, low, error = rows_of(work, k * ROW)
        fill_column(high, launches, k, lanes)
        for i in range(lanes):
            low[i], error[i] = 0.0, 0.0


@Inner
def fill_place(program, work, places, lanes):  # type: ignore[no-untyped-def]
    """Carry out what depends on the place in a program in double-double arithmetic.

    The rows of ``places`` are two doubles and a bound on the error.
    """
    address, operations, first, count, _ = program
    high, low, error = rows_of(work, count * ROW)
    for i in range(lanes):
        high[i], low[i], error[i] = places[0, i], places[1, i], places[2, i]
    call_interpreter(address, operations, first, operations.shape[0], work, lanes)


@Inner
def take_step(work, position, is_last, lanes, places, found):  # type: ignore[no-untyped-def]
    """Move places by a Newton step in a register, and fill the rows of another one with them.

    The first step is far larger than what remains; a later one is a bound on that.
    """
    step, rest, error = rows_of(work, position)
    high, low, bound = found
    for i in range(lanes):
        places[0, i], places[1, i] = add(places[0, i], places[1, i], step[i], rest[i])
        last = fabs(step[i]) if is_last else 0.0
        high[i], low[i] = places[0, i], places[1, i]
        bound[i] = error[i] + UNIT * fabs(places[0, i]) + last


@Inner
def fill_turns(turn, work, launches, lanes, first, target):  # type: ignore[no-untyped-def]
    """Fill inputs of the orbits' program from register ``first`` on: the turning points, their derivatives, and the
    slope of the potential at the launch place.

    The turning points are the columns of the launches from ``first`` on: both, or the upper one. They are improved by a
    step of Newton's method (`programs.turn_program`). If that program has no results, that of the orbits does not need
    them.
    """
    outputs, sides = turn[4], launches[0].shape[0] - first
    if outputs.size == 0:
        return
    places, wanted = np.empty((3, BLOCK)), outputs.size - 2
    fill_inputs(work, turn[3], launches, lanes)
    call_interpreter(turn[0], turn[1], 0, turn[2], work, lanes)
    for end in range(sides):
        fill_column(places[0], launches, first + end, lanes)
        places[1:, :] = 0.0
        fill_place(turn, work, places, lanes)
        take_step(work, outputs[1], False, lanes, places, rows_of(target, (first + end) * ROW))
        for j in range(wanted):
            source, to = outputs[2 + j], (first + sides + end * wanted + j) * ROW
            target[to : to + ROW] = work[source : source + ROW]
    to = (first + sides * (1 + wanted)) * ROW
    target[to : to + ROW] = work[outputs[0] : outputs[0] + ROW]


@Inner
def carry_out(program, address, operations, node, work, lanes):  # type: ignore[no-untyped-def]
    """Carry out operations of the orbits' program at one node of the trapezoidal rule."""
    coordinates, places = program[4], program[7]
    share, rest = rows_of(work, coordinates[0])[0], rows_of(work, coordinates[1])[0]
    for i in range(lanes):
        share[i], rest[i] = places[0, node], places[1, node]
    call_interpreter(address, operations, 0, operations.shape[0], work, lanes)


@Inner
def fill_weights(state, edge, share, lanes):  # type: ignore[no-untyped-def]
    """Fill the weights of a node at a share of the orbit: nodes of an orbit that is its own mirror image come in pairs,
    of which the second has no weight.
    """
    weights, mirrored = state[WEIGHT], state[MIRRORED]
    paired = 1.0 if share == 0.5 else (2.0 if share < 0.5 else 0.0)
    for i in range(lanes):
        weights[i] = edge * choose(mirrored[i] == 1.0, paired, 1.0)


@Inner
def fill_variances(program, is_mirrored, work, lanes, state, found):  # type: ignore[no-untyped-def]
    """Fill the mean variances of rounding errors of each result, by the trapezoidal rule on NOISE_NODES, which include
    the places where they are largest: the ends, and the middle if there is a hilltop.

    Both nodes of a pair have the same errors, so that these average out half as well.
    """
    positions, mirrored = program[6], state[MIRRORED]
    step = 1 if program[3].shape[0] <= MAX_NOISE_OPERATIONS else 2
    found[:, :] = 0.0
    for number in range(0, 3 if is_mirrored else 5, step):
        single = (0.125 if number % 4 == 0 else 0.25) * step
        paired = (4.0 if number < 2 else 2.0 if number == 2 else 0.0) * single
        carry_out(program, program[0][2], program[3], NOISE_NODES[number], work, lanes)
        for k in range(positions.size):
            values, total = rows_of(work, positions[k])[0], found[k]
            for i in range(lanes):
                total[i] += choose(mirrored[i] == 1.0, paired, single) * values[i]


@Inner
def add_node(program, work, lanes, state, sums):  # type: ignore[no-untyped-def]
    """Add the results at one node to the sums: these, what rounding took from them, and the sums of absolute values."""
    outputs, weights, smallest, largest = program[5], state[WEIGHT], state[SMALLEST], state[LARGEST]
    factors = rows_of(work, outputs[0])[0]
    for i in range(lanes):
        factor, low, high = factors[i], smallest[i], largest[i]
        smallest[i], largest[i] = choose(factor >= low, low, factor), choose(factor > high, factor, high)
    for k in range(outputs.size - 1):
        values, total, lost, size = rows_of(work, outputs[1 + k])[0], sums[0, k], sums[1, k], sums[2, k]
        for i in range(lanes):
            value = weights[i] * values[i]
            term = value - lost[i]
            more = total[i] + term
            lost[i] = (more - total[i]) - term
            total[i] = more
            size[i] += fabs(value)


@Inner
def compare_levels(nodes, lanes, sums, means, variances, state):  # type: ignore[no-untyped-def]
    """Fill the means of a level, their largest relative change, and the number of nodes over which rounding errors
    average out.
    """
    change, spread = state[CHANGE], state[SPREAD]
    change[:lanes], spread[:lanes], share = 0.0, 0.0, 1.0 / nodes
    for k in range(sums.shape[1]):
        total, sizes, before, variance = sums[0, k], sums[2, k], means[k], variances[k]
        for i in range(lanes):
            mean, size = share * total[i], share * sizes[i]
            bound = MAX_CONDITION * fabs(mean)
            bound = choose(size < bound, size, bound)
            step, ratio = fabs(mean - before[i]) / size, variance[i] / (MAX_VARIANCE * bound * bound)
            # A change that is NaN remains.
            change[i] = choose((size == 0.0) | (step <= change[i]) | (change[i] != change[i]), change[i], step)
            spread[i] = choose((size == 0.0) | (ratio <= spread[i]), spread[i], ratio)
            before[i] = mean


@Inner
def fill_enough(nodes, lanes, state):  # type: ignore[no-untyped-def]
    """Fill how many intervals suffice in double-double arithmetic, once it is known.

    Other orbits of the batch make no difference to it, so that it has to be known by the same level in any batch.
    """
    before, change, enough = state[BEFORE], state[CHANGE], state[ENOUGH]
    for i in range(lanes):
        is_regular = (before[i] < inf) & ((change[i] <= MAX_SHRINK * before[i]) | (fabs(before[i]) <= MIN_BEFORE))
        number = choose(change[i] <= MAX_CHANGE, 1.0 * nodes, choose(change[i] <= MAX_CHANGE_EARLIER, 2.0 * nodes, 0.0))
        enough[i] = choose(is_regular & (enough[i] == 0.0), number, enough[i])


@Inner
def judge(rule, lanes, sums, means, state, found):  # type: ignore[no-untyped-def]
    """Fill the derivatives of orbits for which the rule has converged, and the states of all; return the numbers of
    orbits that are open, and of those among them for which this call would suffice.

    Further nodes are needed while rounding errors do not average out.

    Parameters
    ----------
    rule : (int, int, int, float)
        The number of nodes, the largest numbers of them in this call and in any call, and the largest change by the
        last level but one.
    """
    nodes, limit, most, max_before = rule
    kinds, before, change, spread = state[STATE], state[BEFORE], state[CHANGE], state[SPREAD]
    smallest, largest, is_new, enough = state[SMALLEST], state[LARGEST], state[NEW], state[ENOUGH]
    some, soon = 0, 0
    for i in range(lanes):
        kind, is_clear = kinds[i], smallest[i] >= MIN_FACTOR_RATIO * largest[i]
        has_settled = (before[i] < 0.0) | has_converged(before[i], change[i], max_before)
        is_answered = (kind == OPEN) & has_settled & (spread[i] <= nodes) & is_clear
        # Means have some digits from MIN_HOPE nodes on, by which the number of nodes is known that would suffice.
        has_hope = (nodes < MIN_HOPE) | ((nodes < most) & (spread[i] <= 2.0 * most) & (smallest[i] > 0.0))
        is_near = (enough[i] == 0.0) & (change[i] <= MAX_NEAR) & (nodes < MAX_WAIT)
        has_hope = has_hope | is_near
        kind = choose(is_answered, 1.0 * ANSWERED, choose(has_hope | (kind != OPEN), kind, 1.0 * LEFT))
        kinds[i], is_new[i] = kind, choose(is_answered, 1.0, 0.0)
        before[i] = choose(has_settled, -1.0, change[i])
        some += kind == OPEN
        soon += (kind == OPEN) & ((nodes < MIN_HOPE) | (spread[i] <= limit) | (is_near & (limit == most)))
    for k in range(found.shape[0]):
        mean, lost, values = means[k], sums[1, k], found[k]
        for i in range(lanes):
            rest = mean[i] * PI_LOW - (PI_HIGH / nodes) * lost[i]
            values[i] = choose(is_new[i] == 1.0, fma(mean[i], PI_HIGH, rest), values[i])
    return some, soon


@Inner
def begin_means(program, work, lanes, state, means):  # type: ignore[no-untyped-def]
    """Add the results at every other node of the first level to means, which give a first change."""
    weights = state[WEIGHT]
    for k in range(means.shape[0]):
        values, mean = rows_of(work, program[5][1 + k])[0], means[k]
        for i in range(lanes):
            mean[i] += 2.0 * weights[i] * values[i] / MIN_INTERVALS


@Inner
def fill_batch(program, is_mirrored, limits, work, lanes, state, rows):  # type: ignore[no-untyped-def]
    """Fill the derivatives of a batch by the trapezoidal rule, whose number of nodes is doubled until it converges.

    If all orbits of the batch are mirror images of themselves, only nodes up to the middle are evaluated. Beyond the
    limit of this call the rule goes on while many orbits are open, for which beginning again would take longer.
    """
    sums, means, variances, found = rows
    fill_variances(program, is_mirrored, work, lanes, state, variances)
    sums[:, :, :], means[:, :] = 0.0, 0.0
    state[STATE, :], state[BEFORE, :], state[SMALLEST, :], state[LARGEST, :] = OPEN, inf, inf, 0.0
    state[ENOUGH, :] = 0.0
    first, nodes = 0, MIN_INTERVALS
    while True:
        for node in range(first, nodes + 1):
            share = NODE_SHARES[node]
            if is_mirrored and share > 0.5:
                continue
            fill_weights(state, 0.5 if share == 0.0 or share == 1.0 else 1.0, share, lanes)
            carry_out(program, program[0][1], program[2], node, work, lanes)
            add_node(program, work, lanes, state, sums)
            if first == 0 and node % 2 == 0:
                begin_means(program, work, lanes, state, means)
        compare_levels(nodes, lanes, sums, means, variances, state)
        fill_enough(nodes, lanes, state)
        some, soon = judge((nodes, limits[0], limits[1], limits[2]), lanes, sums, means, state, found)
        if some == 0 or (some <= MAX_OPEN * lanes and (nodes >= limits[0] or soon == 0)):
            return
        first, nodes = nodes + 1, 2 * nodes


@entry(
    types.void(
        *(PROGRAM, VECTOR, LANE_PROGRAM, VECTOR, types.Tuple((INTEGER, INTEGER, INTEGER, types.float64))),
        *(MATRIX, types.boolean[::1], types.Tuple((MATRIX, types.int8[::1]))),
    ),
    nogil=True,
)
def fill_lane_gradients(turn, turn_work, program, work, limits, launches, mirrored, answers):  # type: ignore[no-untyped-def]
    """Fill the derivatives of half periods, as far as double precision suffices.

    Parameters
    ----------
    turn, turn_work
        The program of a turning point and its derivatives (`programs.turn_program`), with its work space; without
        results if the orbit's program does not need them.
    program, work
        The program of an orbit (`assembly.LaneProgram.operands`), with its work space.
    limits : (int, int, int, float)
        The number of columns of the launches that are inputs of the program, the largest numbers of intervals in this
        call and in any call, and the largest change by the last level but one (`quadrature.trapezoid`).
    launches : (k, m) array
        The inputs of the program, and then turning points to the accuracy of doubles if the program needs them
        (`launches`).
    mirrored : (m,) array
        Whether each orbit is a mirror image of itself.
    answers : ((m, k) array, (m,) array)
        The derivatives, and the states: OPEN where more intervals are needed, and from LEFT on where digits are lost.
    """
    found, states = answers
    count, inputs, state = found.shape[1], limits[0], np.empty((ROWS, BLOCK))
    shape = (count, BLOCK)
    rows = (np.empty((3, count, BLOCK)), np.empty(shape), np.empty(shape), np.empty(shape))
    for start in range(0, launches.shape[1], BLOCK):
        size = min(BLOCK, launches.shape[1] - start)
        some, lanes, is_mirrored = (launches, start, size), -(-size // WIDTH) * WIDTH, True
        for i in range(lanes):
            even = mirrored[start + min(i, size - 1)]
            state[MIRRORED, i], is_mirrored = 1.0 if even else 0.0, is_mirrored and even
        fill_inputs(work, inputs, some, lanes)
        fill_turns(turn, turn_work, some, lanes, inputs, work)
        call_interpreter(program[0][0], program[1], 0, program[1].shape[0], work, lanes)
        fill_batch(program, is_mirrored, limits[1:], work, lanes, state, rows)
        values = rows[3]
        for i in range(size):
            kind, intervals = int(state[STATE, i]), MIN_INTERVALS
            if kind == LEFT or (kind == OPEN and limits[1] == limits[2]):
                kind = LEFT
                while intervals < state[ENOUGH, i]:
                    kind, intervals = kind + 1, 2 * intervals
            states[start + i] = kind
            for k in range(count):
                found[start + i, k] = values[k, i]
