"""Compiled code that carries out programs: at given places, and for means over a half period or a lap.

The means are those of the midpoint rule in phase angles, which converges as fast as the trapezoidal rule and needs no
values at turning points, where V**2 and the divided differences of the potential vanish together. Near a separatrix it
would need too many nodes; there Gauss's rule is used on panels that are halved where the body is slow.
"""

from math import fabs, floor, inf

import numpy as np
from numba import types

from gqm_sym.runtime.arithmetic.elementary import HALF_PI
from gqm_sym.runtime.compiled.jit import Inlined, Inner, entry
from gqm_sym.runtime.compiled.registers import borrowed
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, VECTOR, Array
from gqm_sym.runtime.double_double.arithmetic import UNIT, add, multiply
from gqm_sym.runtime.double_double.interpreter import BLOCK, ERROR, LOW, ROW, call_interpreter
from gqm_sym.runtime.double_double.nodes import LEVELS, RULE
from gqm_sym.runtime.double_double.quadrature import fill_panel
from gqm_sym.runtime.gradients.programs import LAUNCH_VARIABLES, Program
from gqm_sym.runtime.quadrature.trapezoid import LIBRATION

# The rule has converged if the largest of the changes, each as a share of the mean of the absolute values, has shrunk
# by this factor and the next one would be smaller than the second number. Errors decrease geometrically: the first
# change, from 16 to 32 nodes, is about the square root of the next one.
MAX_RATIO, MAX_NEXT_CHANGE = 1e-3, 1e-20

# A lap begins at any phase of the harmonics that the rule takes for the mean, so that one change may be small by
# accident. The change before it is limited, too, so that the error is below rounding whatever the last change is.
MAX_LAP_CHANGE = 3e-8

# The largest rounding error of a mean, as a share of the mean of the absolute values.
MAX_ROUNDING = 1e-17

# A panel is resolved if the last two Legendre coefficients of each result are below this share of the mean of the
# absolute values so far, or below its rounding: Gauss's rule is exact for twice as many powers, and its error about the
# square of this. The smallest width of a panel as a share of the phase, and the largest number of panels.
MAX_TAIL, MIN_PANEL, MAX_PANELS = 1e-10, 2.0**-48, 1024

# The largest rounding error of a mean by panels, as a share of the mean of the absolute values. The answer is rounded
# to a double.
MAX_PANEL_ROUNDING = 2.0**-54

# The smallest number of Newton steps to the turning points, starting from doubles, and the largest, which few launches
# beside a hilltop need.
NEWTON_STEPS, MAX_NEWTON_STEPS = 2, 6

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
def set_variable(variables, k, high, low):  # type: ignore[no-untyped-def]
    """Set one of the variables of a launch (`formula_orbit.variables_of`)."""
    variables[0, k], variables[1, k], variables[2, k] = high, low, 0.25 * UNIT * fabs(high) if low != 0.0 else 0.0


@Inner
def fill_turns(program, work, variables, span, inputs):  # type: ignore[no-untyped-def]
    """Fill the inputs of a libration: its variables, both turning points near ``span``, and of each the derivatives
    that `programs.turning_point_program` has.

    A launch from rest is one of the turning points, and is not improved.
    """
    count, outputs = variables.shape[1], program[4]
    rows, launch, rests = outputs.size - 1, count - LAUNCH_VARIABLES, variables[0, count - LAUNCH_VARIABLES + 1] == 0.0
    places, is_done = np.zeros((2, 2)), False
    is_launch = rests and span[0] == variables[0, launch], rests and span[1] == variables[0, launch]
    for i in range(2):
        places[0, i], places[1, i] = span[i], variables[1, launch] if is_launch[i] else 0.0
    begin(program, work, variables)
    for step in range(MAX_NEWTON_STEPS + 1):
        evaluate_block(program, work, places[0], places[1])
        is_done = step >= NEWTON_STEPS
        for i in range(2):
            at = outputs[0] + i
            is_done = is_done and (is_launch[i] or not fabs(work[at]) > work[at + ERROR])
        if is_done:
            break
        for i in range(2):
            at = outputs[0] + i
            if not is_launch[i]:
                places[0, i], places[1, i] = add(places[0, i], places[1, i], work[at], work[at + LOW])
    inputs[:, :count] = variables
    for i in range(2):
        at = outputs[0] + i
        inputs[0, count + i], inputs[1, count + i] = places[0, i], places[1, i]
        inputs[2, count + i] = fabs(work[at]) + work[at + ERROR] + UNIT * fabs(places[0, i])
        if is_launch[i]:
            inputs[2, count + i] = variables[2, launch]
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
def fill_means_of(program, work, inputs, kind, nodes, found):  # type: ignore[no-untyped-def]
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
        has_converged = (has_converged or change <= rounding) and (kind == LIBRATION or before <= MAX_LAP_CHANGE)
        if level > 1 and rounding <= MAX_ROUNDING and has_converged:
            clear_rounding(found)
            return n
        before = change if level > 1 else 1.0
    return NOT_SMOOTH if rounding <= MAX_ROUNDING else LOST_DIGITS


@entry(INTEGER(PROGRAM, VECTOR, MATRIX, INTEGER, MATRIX, MATRIX), checked=False)
def fill_means(program, work, inputs, kind, nodes, found):  # type: ignore[no-untyped-def]
    """Fill the means of all results of a program over its range, and return the number of nodes or a code of failure.

    Parameters
    ----------
    program, work
        The program (`programs.Program.operands`), and its work space.
    inputs : (3, m) array
        The inputs: high and low doubles, and bounds on the errors.
    kind : int
        LIBRATION or CIRCULATION.
    nodes : (4, n) array
        The table of shares (`nodes.trapezoidal_nodes`).
    found : (k, 4) array
        For each result the mean as two doubles (0 if it is zero within its rounding), a bound on its rounding error,
        and the mean of the absolute values.
    """
    address, operations, first, count, outputs = program
    program = (address, borrowed(operations), first, count, borrowed(outputs))
    return fill_means_of(program, borrowed(work), borrowed(inputs), kind, borrowed(nodes), borrowed(found))


@Inner
def add_panels(program, work, kind, whole, rule, found):  # type: ignore[no-untyped-def]
    """Add the means of all results over phases from 0 to ``whole`` by Gauss's rule on panels, which are halved until
    polynomials resolve the results; return whether they do.
    """
    outputs, nodes, here = program[4], np.empty((4, RULE)), np.empty((program[4].size, MEAN))
    start, width, panels, is_resolved = 0.0, 1.0, 0, True
    while start < 1.0 and width >= MIN_PANEL and panels < MAX_PANELS:
        left, step = multiply(whole[0], whole[1], start, 0.0), (width * whole[0], width * whole[1])
        fill_panel(kind, left, step, 0, rule, nodes)
        evaluate_block(program, work, nodes[0], nodes[1])
        for j in range(outputs.size):
            high, low, error, size, tail, next_tail = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for k in range(RULE):
                at = outputs[j] + k
                value, rest = multiply(work[at], work[at + LOW], rule[2, k], rule[3, k])
                high, low = add(high, low, value, rest)
                error += rule[2, k] * work[at + ERROR] + UNIT * fabs(high)
                size += fabs(value)
                tail, next_tail = tail + rule[4, k] * work[at], next_tail + rule[5, k] * work[at]
            here[j, 0], here[j, 1], here[j, 2], here[j, 3] = width * high, width * low, width * error, width * size
            tail = width * (fabs(tail) + fabs(next_tail))
            is_resolved = tail <= max(MAX_TAIL * (found[j, 3] + here[j, 3]), here[j, 2])
            if not is_resolved:
                break
        panels += 1
        if not is_resolved:
            width *= 0.5
            continue
        for j in range(outputs.size):
            found[j, 0], found[j, 1] = add(found[j, 0], found[j, 1], here[j, 0], here[j, 1])
            found[j, 2], found[j, 3] = found[j, 2] + here[j, 2], found[j, 3] + here[j, 3]
        start += width
        while start < 1.0 and 0.5 * start / width == floor(0.5 * start / width):
            width *= 2.0  # both halves of a panel are done
    return start == 1.0


@Inner
def fill_panel_means_of(program, work, inputs, kind, rule, found):  # type: ignore[no-untyped-def]
    """Fill the means of all results, as `fill_panel_means` does."""
    sides = inputs.shape[0]
    whole = (2.0 * HALF_PI[0] / sides, 2.0 * HALF_PI[1] / sides) if kind == LIBRATION else (1.0 / sides, 0.0)
    found[:, :] = 0.0
    for side in range(sides):
        begin(program, work, inputs[side])
        if not add_panels(program, work, kind, whole, rule, found):
            return NOT_SMOOTH
    rounding = 0.0
    for j in range(found.shape[0]):
        rounding = max(rounding, rounding_of(j, found[j, 3], found[j, 2], found[0, 3]))
        for part in range(MEAN):
            found[j, part] /= sides
    clear_rounding(found)
    return sides if rounding <= MAX_PANEL_ROUNDING else LOST_DIGITS


@entry(INTEGER(PROGRAM, VECTOR, CUBE, INTEGER, MATRIX, MATRIX), checked=False)
def fill_panel_means(program, work, inputs, kind, rule, found):  # type: ignore[no-untyped-def]
    """Fill the means of all results, as `fill_means` does, for a motion that passes near an equilibrium.

    Parameters
    ----------
    program, work, found
        As for `fill_means`.
    inputs : (1, 3, m) or (2, 3, m) array
        The inputs of the program, whose phase then goes from 0 to its end; or those for each half of the phase, which
        goes from 0 to the middle twice.
    kind : int
        LIBRATION or CIRCULATION.
    rule : (6, n) array
        The nodes of a panel, and what finds the last two Legendre coefficients from values there
        (`panels.rule_with_tails`).

    Returns
    -------
    int
        The number of sets of inputs, or a code of failure.
    """
    return fill_panel_means_of(program, work, inputs, kind, rule, found)


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
