"""Compiled code that carries out programs: at given places, and for means over a half period or a lap.

The means are those of the midpoint rule in phase angles, which converges as fast as the trapezoidal rule and needs no
values at turning points, where V**2 and the divided differences of the potential vanish together. Near a separatrix it
would need too many nodes; there Gauss's rules on the panels of the motion are used.
"""

from math import fabs, inf

import numpy as np
from numba import types

from gqm_sym.runtime.arithmetic.elementary import HALF_PI
from gqm_sym.runtime.compiled.jit import Inlined, Inner, entry
from gqm_sym.runtime.compiled.registers import borrowed
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, VECTOR, Array
from gqm_sym.runtime.double_double.arithmetic import UNIT, add, divide, multiply
from gqm_sym.runtime.double_double.interpreter import BLOCK, ERROR, LOW, ROW, call_interpreter
from gqm_sym.runtime.double_double.nodes import LEVELS, RULE
from gqm_sym.runtime.double_double.quadrature import MAX_PANELS, MIN_PANELS, fill_panel
from gqm_sym.runtime.gradients.programs import Program
from gqm_sym.runtime.quadrature.trapezoid import LIBRATION

# The rule has converged if the largest of the changes, each as a share of the mean of the absolute values, has shrunk
# by this factor and the next one would be smaller than the second number. Errors decrease geometrically: the first
# change, from 16 to 32 nodes, is about the square root of the next one.
MAX_RATIO, MAX_NEXT_CHANGE = 1e-3, 1e-20

# The largest rounding error of a mean, as a share of the mean of the absolute values.
MAX_ROUNDING = 1e-17

# The largest change of an integral over a panel when the panel is halved, as a share of the integral of the absolute
# values.
MAX_PANEL_CHANGE = 1e-20

# The number of Newton steps to the turning points, starting from doubles.
NEWTON_STEPS = 2

# The codes in place of the number of nodes: digits were lost, or the nodes are too few with any number of digits.
LOST_DIGITS, NOT_SMOOTH = 0, -1

# The number of values for each mean: the high and the low double, a bound on the error, and the mean of the absolute
# values.
MEAN = 4

# A program as compiled code takes it (`programs.Program.operands`), with its work space.
PROGRAM = types.Tuple((INTEGER, types.int64[:, ::1], INTEGER, INTEGER, types.int64[::1]))
CUBE = types.float64[:, :, ::1]


@Inner
def fill_registers(inputs, count, lanes, work):  # type: ignore[no-untyped-def]
    """Fill the registers of the inputs for a number of places."""
    for k in range(count):
        for i in range(lanes):
            for part in range(3):
                work[k * ROW + part * BLOCK + i] = inputs[part, k]


@Inner
def begin(program, work, inputs, lanes=BLOCK):  # type: ignore[no-untyped-def]
    """Fill the registers of the inputs, and all that do not depend on the place, for a number of places."""
    address, operations, first, count, _ = program
    fill_registers(inputs, count, lanes, work)
    call_interpreter(address, operations, 0, first, work, lanes)


@Inner
def set_coordinate(work, register, high, low):  # type: ignore[no-untyped-def]
    """Fill the register of a coordinate of places."""
    for i in range(high.size):
        at = register * ROW + i
        work[at], work[at + LOW], work[at + ERROR] = high[i], low[i], UNIT * fabs(high[i]) if low[i] != 0.0 else 0.0


@Inner
def evaluate_block(program, work, high, low):  # type: ignore[no-untyped-def]
    """Evaluate a program at places of one coordinate, at most BLOCK of them."""
    address, operations, first, count, _ = program
    set_coordinate(work, count, high, low)
    call_interpreter(address, operations, first, operations.shape[0], work, high.size)


@Inner
def fill_turns(program, work, variables, span, inputs):  # type: ignore[no-untyped-def]
    """Fill the inputs of a libration: its variables, both turning points near ``span``, and of each the derivatives
    that `programs.turning_point_program` has.
    """
    count, outputs = variables.shape[1], program[4]
    rows = outputs.size - 1
    places = np.zeros((2, 2))
    places[0, 0], places[0, 1] = span[0], span[1]
    begin(program, work, variables)
    for step in range(NEWTON_STEPS + 1):
        evaluate_block(program, work, places[0], places[1])
        if step < NEWTON_STEPS:
            for i in range(2):
                at = outputs[0] + i
                places[0, i], places[1, i] = add(places[0, i], places[1, i], work[at], work[at + LOW])
    inputs[:, :count] = variables
    for i in range(2):
        at = outputs[0] + i
        inputs[0, count + i], inputs[1, count + i] = places[0, i], places[1, i]
        inputs[2, count + i] = fabs(work[at]) + work[at + ERROR] + UNIT * fabs(places[0, i])
        for k in range(rows):
            at, to = outputs[1 + k] + i, count + 2 + i * rows + k
            inputs[0, to], inputs[1, to], inputs[2, to] = work[at], work[at + LOW], work[at + ERROR]


@Inner
def add_midpoints(program, work, nodes, n, sums):  # type: ignore[no-untyped-def]
    """Fill the sums of each result over n nodes (high and low double, and error), and the sums of the absolute
    values.
    """
    outputs = program[4]
    sums[:, :] = 0.0
    for start in range(n, 2 * n, BLOCK):
        stop = min(start + BLOCK, 2 * n)
        evaluate_block(program, work, nodes[0, start:stop], nodes[1, start:stop])
        for j in range(outputs.size):
            high, low, error, size = sums[j, 0], sums[j, 1], sums[j, 2], sums[j, 3]
            for i in range(stop - start):
                at = outputs[j] + i
                high, low = add(high, low, work[at], work[at + LOW])
                error += work[at + ERROR] + UNIT * fabs(high)
                size += fabs(work[at])
            sums[j, 0], sums[j, 1], sums[j, 2], sums[j, 3] = high, low, error, size


@Inlined
def is_significant(j, size, error):  # type: ignore[no-untyped-def]
    """Return whether a mean is not zero within its rounding. The first one, the time, never is zero."""
    return j == 0 or not size <= error


@Inlined
def rounding_of(j, size, error, time):  # type: ignore[no-untyped-def]
    """Return the rounding of a mean as a share of it; of one that is zero within its rounding, as a share of the time.

    A derivative may vanish, but it must not count as zero because all of its digits are lost.
    """
    return error / (size if is_significant(j, size, error) else time)


@Inner
def clear_rounding(found):  # type: ignore[no-untyped-def]
    """Set means to zero that are zero within their rounding, except for the first one.

    So that this does not happen to a derivative all digits of which are lost, `rounding_of` must be small.
    """
    for j in range(1, found.shape[0]):
        if fabs(found[j, 0]) <= found[j, 2]:
            found[j, 0], found[j, 1] = 0.0, 0.0


@Inner
def fill_means_of(program, work, inputs, nodes, found):  # type: ignore[no-untyped-def]
    """Fill the means of all results, as `fill_means` does."""
    begin(program, work, inputs)
    sums, before, rounding = np.empty((found.shape[0], MEAN)), 1.0, inf
    for level in range(1, len(LEVELS) - 1):
        n = LEVELS[level]
        add_midpoints(program, work, nodes, n, sums)
        change, rounding = 0.0, 0.0
        for j in range(found.shape[0]):
            size = sums[j, 3] / n
            high, low = sums[j, 0] / n, sums[j, 1] / n
            if is_significant(j, size, sums[j, 2] / n):
                step = fabs(add(high, low, -found[j, 0], -found[j, 1])[0]) / size
                change = step if not step <= change else change
            rounding = max(rounding, rounding_of(j, size, sums[j, 2] / n, sums[0, 3] / n))
            found[j, 0], found[j, 1], found[j, 2], found[j, 3] = high, low, sums[j, 2] / n, size
        has_converged = change <= MAX_RATIO * before and change * change <= MAX_NEXT_CHANGE * before
        if level > 1 and rounding <= MAX_ROUNDING and (has_converged or change <= rounding):
            clear_rounding(found)
            return n
        before = change if level > 1 else 1.0
    return NOT_SMOOTH if rounding <= MAX_ROUNDING else LOST_DIGITS


@entry(INTEGER(PROGRAM, VECTOR, MATRIX, MATRIX, MATRIX), checked=False)
def fill_means(program, work, inputs, nodes, found):  # type: ignore[no-untyped-def]
    """Fill the means of all results of a program over its range, and return the number of nodes or a code of failure.

    Parameters
    ----------
    program, work
        The program (`programs.Program.operands`), and its work space.
    inputs : (3, m) array
        The inputs: high and low doubles, and bounds on the errors.
    nodes : (4, n) array
        The table of shares (`nodes.trapezoidal_nodes`).
    found : (k, 4) array
        For each result the mean as two doubles (0 if it is zero within its rounding), a bound on its rounding error,
        and the mean of the absolute values.
    """
    address, operations, first, count, outputs = program
    program = (address, borrowed(operations), first, count, borrowed(outputs))
    return fill_means_of(program, borrowed(work), borrowed(inputs), borrowed(nodes), borrowed(found))


@Inner
def integrate(program, work, kind, left, width, panels, rule, found):  # type: ignore[no-untyped-def]
    """Fill the integrals of all results over an interval of phase angles, by Gauss's rule on panels of equal width."""
    outputs, n = program[4], RULE * panels
    step, nodes = (width[0] / panels, width[1] / panels), np.empty((4, n))
    for panel in range(panels):
        fill_panel(kind, left, step, panel, rule, nodes)
    found[:, :] = 0.0
    for start in range(0, n, BLOCK):
        stop = min(start + BLOCK, n)
        evaluate_block(program, work, nodes[0, start:stop], nodes[1, start:stop])
        for j in range(outputs.size):
            for i in range(stop - start):
                at, k = outputs[j] + i, (start + i) % RULE
                value, low = multiply(work[at], work[at + LOW], rule[2, k], rule[3, k])
                found[j, 0], found[j, 1] = add(found[j, 0], found[j, 1], value, low)
                found[j, 2] += rule[2, k] * work[at + ERROR] + UNIT * fabs(found[j, 0])
                found[j, 3] += fabs(value)
    for j in range(outputs.size):
        found[j, 0], found[j, 1] = multiply(found[j, 0], found[j, 1], step[0], step[1])
        found[j, 2], found[j, 3] = step[0] * found[j, 2], step[0] * found[j, 3]


@entry(INTEGER(PROGRAM, VECTOR, MATRIX, INTEGER, VECTOR, MATRIX, MATRIX), checked=False)
def fill_panel_means(program, work, inputs, kind, edges, rule, found):  # type: ignore[no-untyped-def]
    """Fill the means of all results, as `fill_means` does, for a motion that passes near an equilibrium.

    Parameters
    ----------
    program, work, inputs, found
        As for `fill_means`.
    kind : int
        LIBRATION or CIRCULATION.
    edges : (n,) array
        Phase angles, from the first to the last one, between which the integrands are smooth.
    rule : (4, n) array
        The nodes of a panel (`nodes.panel_rule`).

    Returns
    -------
    int
        The number of intervals, or a code of failure.
    """
    begin(program, work, inputs)
    now, before = np.empty((found.shape[0], MEAN)), np.empty((found.shape[0], MEAN))
    found[:, :] = 0.0
    for k in range(edges.size - 1):
        # The upper turning point is at the angle pi itself.
        right = edges[k + 1], 2.0 * HALF_PI[1] if kind == LIBRATION and k == edges.size - 2 else 0.0
        left, panels, change = (edges[k], 0.0), MIN_PANELS, inf
        width = add(right[0], right[1], -left[0], 0.0)
        while not change <= MAX_PANEL_CHANGE:
            if panels > MAX_PANELS:
                return NOT_SMOOTH
            integrate(program, work, kind, left, width, panels, rule, now)
            change = 0.0 if panels > MIN_PANELS else inf
            for j in range(found.shape[0]):
                size = now[j, 3] + found[j, 3]
                if panels > MIN_PANELS and is_significant(j, size, now[j, 2]):
                    step = max(0.0, fabs(add(now[j, 0], now[j, 1], -before[j, 0], -before[j, 1])[0]) - now[j, 2]) / size
                    change = step if not step <= change else change
                before[j, 0], before[j, 1] = now[j, 0], now[j, 1]
            panels *= 2
        for j in range(found.shape[0]):
            found[j, 0], found[j, 1] = add(found[j, 0], found[j, 1], now[j, 0], now[j, 1])
            found[j, 2], found[j, 3] = found[j, 2] + now[j, 2], found[j, 3] + now[j, 3]
    rounding, whole = 0.0, (edges[edges.size - 1], 2.0 * HALF_PI[1] if kind == LIBRATION else 0.0)
    for j in range(found.shape[0]):
        rounding = max(rounding, rounding_of(j, found[j, 3], found[j, 2], found[0, 3]))
        found[j, 0], found[j, 1] = divide(found[j, 0], found[j, 1], whole[0], whole[1])
        found[j, 2], found[j, 3] = found[j, 2] / whole[0], found[j, 3] / whole[0]
    clear_rounding(found)
    return edges.size - 1 if rounding <= MAX_ROUNDING else LOST_DIGITS


@entry(types.void(PROGRAM, VECTOR, MATRIX, MATRIX, CUBE), checked=False)
def fill_values(program, work, inputs, places, found):  # type: ignore[no-untyped-def]
    """Fill the results of a program at places.

    Parameters
    ----------
    program, work, inputs
        As for `fill_means`.
    places : (2*k, n) array
        The k coordinates of the places, as two doubles each.
    found : (k, 3, n) or (k, 1, n) array
        For each result and place the value as two doubles and a bound on its error, or the value alone.
    """
    begin(program, work, inputs)
    (address, operations, first, count, outputs), n = program, places.shape[1]
    for start in range(0, n, BLOCK):
        stop = min(start + BLOCK, n)
        for k in range(places.shape[0] // 2):
            set_coordinate(work, count + k, places[2 * k, start:stop], places[2 * k + 1, start:stop])
        call_interpreter(address, operations, first, operations.shape[0], work, stop - start)
        for j in range(outputs.size):
            for part in range(found.shape[1]):
                for i in range(stop - start):
                    found[j, part, start + i] = work[outputs[j] + part * BLOCK + i]


@Inner
def fill_signed_values_of(program, work, inputs, places, states, found):  # type: ignore[no-untyped-def]
    """Fill the results of a program in states, as `fill_signed_values` does."""
    (address, operations, first, count, outputs), n = program, places.shape[1]
    coordinates, headings, signs = places.shape[0] // 2, states[states.shape[0] - 2], states[states.shape[0] - 1]
    chosen, some = np.empty(n, dtype=np.int64), np.empty((2, BLOCK))
    for pair in range(4):
        heading, sign, total = 1.0 if pair < 2 else -1.0, 1.0 if pair % 2 == 0 else -1.0, 0
        for i in range(n):
            if headings[i] == heading and signs[i] == sign:
                chosen[total] = i
                total += 1
        if total > 0:
            inputs[0, count - 2], inputs[0, count - 1] = heading, sign
            begin(program, work, inputs, min(BLOCK, total))
        for start in range(0, total, BLOCK):
            size = min(BLOCK, total - start)
            for k in range(coordinates):
                for i in range(size):
                    at = chosen[start + i]
                    some[0, i], some[1, i] = places[2 * k, at], places[2 * k + 1, at]
                set_coordinate(work, count + k, some[0, :size], some[1, :size])
            call_interpreter(address, operations, first, operations.shape[0], work, size)
            for j in range(outputs.size):
                for part in range(found.shape[1]):
                    for i in range(size):
                        found[j, part, chosen[start + i]] = work[outputs[j] + part * BLOCK + i]


@entry(types.void(PROGRAM, VECTOR, MATRIX, MATRIX, MATRIX, CUBE), checked=False)
def fill_signed_values(program, work, inputs, places, states, found):  # type: ignore[no-untyped-def]
    """Fill the results of a program as `fill_values` does, for signs of dlam/dt and of N at each place.

    These signs are the last two inputs of the program, and the last two rows of ``states``.

    The places of the same signs are evaluated together.
    """
    fill_signed_values_of(program, work, inputs, places, states, found)


def values(
    program: Program, inputs: Array, high: Array, low: Array | None = None, *others: Array, parts: int = 3
) -> Array:
    """Return the results of a program at places: ``parts`` rows for each, as in `fill_values`.

    ``others`` are coordinates after the first, as doubles.
    """
    zero = np.zeros_like(high)
    places = np.array([high, zero if low is None else low, *(row for other in others for row in (other, zero))])
    found = np.empty((program.outputs.size, parts, high.size))
    fill_values(program.operands, program.work, inputs, places, found)
    return found
