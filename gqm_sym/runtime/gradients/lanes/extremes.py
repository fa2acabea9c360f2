"""Gradients of the extremes of V and of the contact force of many launches, with one orbit in each lane.

An extreme is sought on a grid in double precision. Then Newton's method finds its place in double-double arithmetic,
in which the derivatives at this place are those of the extreme, unless it is at a turning point, which moves.
"""

from functools import lru_cache
from math import fabs, inf, nan

import numpy as np
from numba import types

from gqm_sym.literals.namespaces import ARRAYS
from gqm_sym.runtime.compiled.intrinsics import choose
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.threads import run_in_threads
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, VECTOR, Array
from gqm_sym.runtime.double_double.arithmetic import UNIT, add, multiply
from gqm_sym.runtime.double_double.interpreter import BLOCK, ROW, call_interpreter
from gqm_sym.runtime.gradients.evaluation import PROGRAM
from gqm_sym.runtime.gradients.formula_orbit import source_of
from gqm_sym.runtime.gradients.lanes.assembly import LaneProgram, assemble
from gqm_sym.runtime.gradients.lanes.evaluation import (
    LANE_PROGRAM,
    WIDTH,
    fill_column,
    fill_inputs,
    fill_place,
    rows_of,
)
from gqm_sym.runtime.gradients.lanes.launches import Launches
from gqm_sym.runtime.gradients.lanes.operations import LaneRecorder
from gqm_sym.runtime.gradients.lanes.pairs import fill_ends
from gqm_sym.runtime.gradients.lanes.periods import MIN_LAUNCHES_PER_THREAD, end_program, programs_for
from gqm_sym.runtime.gradients.programs import Source, extreme_program, extreme_quantity
from gqm_sym.runtime.launch.formulas import Formulas
from gqm_sym.runtime.quadrature.trapezoid import CIRCULATION, LIBRATION

# The grid on which an extreme is found, in shares of a lap and of a libration's width. At most so many steps of
# Newton's method follow, until one is below the last share of the width.
NODES = 64
SHARES = {
    LIBRATION: np.sin(0.5 * np.pi * np.arange(NODES) / (NODES - 1)) ** 2,
    CIRCULATION: np.arange(NODES) / NODES,
}
MAX_STEPS, LAST_STEP = 8, 1e-12

# The largest error of a derivative, as a share of it or of the extreme, and the largest difference between the extreme
# found here and that of the sweep, as a share of the largest value on the grid.
MAX_ERROR, MAX_DIFFERENCE = 1e-17, 1e-10

# The rows of numbers for the orbits of a block: both ends of the grid; the best place on it as two doubles, with its
# number and its value times the sign; the largest size on the grid; the last step of Newton's method; and whether the
# extreme is at a turning point.
LOW_END, HIGH_END, PLACE, PLACE_LOW, BEST, PEAK, SIZE, STEP, STAYS, ROWS = range(10)


@lru_cache(maxsize=64)
def grid_program(source: Source, of_speed: bool) -> LaneProgram:
    """Return the program in double precision of the quantity of `programs.extreme_program`."""
    op = LaneRecorder(source.variables, 1)
    return assemble(op, [extreme_quantity(op, source, of_speed)])


@Inner
def search_grid(program, work, shares, sign, lanes, state):  # type: ignore[no-untyped-def]
    """Fill the best place of each orbit on the grid."""
    state[PEAK, :], state[SIZE, :], state[BEST, :] = -inf, 0.0, 0.0
    low, high, place, best = state[LOW_END], state[HIGH_END], state[PLACE], state[BEST]
    peak, size, coordinate = state[PEAK], state[SIZE], rows_of(work, program[4][0])[0]
    for node in range(shares.size):
        for i in range(lanes):
            coordinate[i] = low[i] + (high[i] - low[i]) * shares[node]
        call_interpreter(program[0][1], program[2], 0, program[2].shape[0], work, lanes)
        values = rows_of(work, program[5][0])[0]
        for i in range(lanes):
            value = values[i]
            is_better = sign * value > peak[i]
            best[i] = choose(is_better, 1.0 * node, best[i])
            place[i] = choose(is_better, coordinate[i], place[i])
            peak[i] = choose(is_better, sign * value, peak[i])
            size[i] = choose(fabs(value) > size[i], fabs(value), size[i])


@Inner
def set_at_ends(target, first, has_ends, last, lanes, state):  # type: ignore[no-untyped-def]
    """Set the places that are turning points to these as two doubles."""
    state[PLACE_LOW, :] = 0.0
    for end in range(2 if has_ends else 0):
        high, low, _ = rows_of(target, (first + end) * ROW)
        for i in range(lanes):
            is_here = state[BEST, i] == end * last
            state[PLACE, i] = choose(is_here, high[i], state[PLACE, i])
            state[PLACE_LOW, i] = choose(is_here, low[i], state[PLACE_LOW, i])


@Inner
def evaluate_at_places(program, work, places, lanes, state):  # type: ignore[no-untyped-def]
    """Evaluate a program in double-double arithmetic at the places of all orbits."""
    for i in range(lanes):
        places[0, i], places[1, i] = state[PLACE, i], state[PLACE_LOW, i]
        places[2, i] = choose(places[1, i] == 0.0, 0.0, UNIT * fabs(places[0, i]))
    fill_place(program, work, places, lanes)


@Inner
def improve(program, work, sign, lanes, places, state):  # type: ignore[no-untyped-def]
    """Move the places by steps of Newton's method until they do not change any more; places at turning points at
    which the quantity grows outwards, whose step is zero, stay.
    """
    slopes, curvatures = rows_of(work, program[4][1])[0], rows_of(work, program[4][2])[0]
    for _ in range(MAX_STEPS):
        moves = False
        for i in range(lanes):
            width = fabs(state[HIGH_END, i] - state[LOW_END, i])
            is_open = (fabs(state[STEP, i]) > LAST_STEP * width) & (sign * curvatures[i] < 0.0)
            if is_open:
                state[STEP, i] = -slopes[i] / curvatures[i]
                state[PLACE, i] += state[STEP, i]
                state[PLACE_LOW, i] = 0.0
                moves = True
        if not moves:
            return
        evaluate_at_places(program, work, places, lanes, state)


@Inner
def fill_totals(program, work, tangents, lanes, state, found):  # type: ignore[no-untyped-def]
    """Fill the extremes, the largest sizes on the grid, and the derivatives of the extremes; these are NaN if digits
    are lost.

    Parameters
    ----------
    program, work
        The program of an extreme, evaluated at the places.
    tangents : (array, int)
        The registers of both turning points and their derivatives, and the first of them.
    lanes : int
        The number of orbits.
    state : (ROWS, BLOCK) array
        The state of the orbits.
    found : (n + 2, BLOCK) array
        Filled.
    """
    (target, first), outputs, count = tangents, program[4], found.shape[0] - 2
    values, (slopes, rests, slope_errors) = rows_of(work, outputs[0])[0], rows_of(work, outputs[1])
    for i in range(lanes):
        found[0, i], found[1, i] = values[i], state[SIZE, i]
    for j in range(count):
        partials, lows, errors = rows_of(work, outputs[3 + j])
        at_low, at_high = (first + 2 + j) * ROW, (first + 2 + count + j) * ROW
        for i in range(lanes):
            high, low, error = 0.0, 0.0, 0.0
            if state[STAYS, i] == 1.0:
                at = (at_low if state[BEST, i] == 0.0 else at_high) + i
                high, low, error = target[at], target[at + BLOCK], target[at + 2 * BLOCK]
            error = errors[i] + fabs(high) * slope_errors[i] + fabs(slopes[i]) * error
            high, low = multiply(slopes[i], rests[i], high, low)
            high, low = add(high, low, partials[i], lows[i])
            width = fabs(state[HIGH_END, i] - state[LOW_END, i])
            is_exact = error <= MAX_ERROR * max(fabs(high), fabs(values[i]))
            is_known = is_exact & (fabs(state[STEP, i]) <= LAST_STEP * width)
            found[2 + j, i] = high if is_known else nan


@entry(
    types.void(
        *(types.UniTuple(PROGRAM, 2), types.UniTuple(VECTOR, 2)),
        *(types.Tuple((LANE_PROGRAM, PROGRAM)), types.UniTuple(VECTOR, 2)),
        *(types.Tuple((VECTOR, INTEGER, types.float64)), MATRIX, MATRIX),
    ),
    nogil=True,
)
def fill_extreme_gradients(ends, works, programs, spaces, rule, launches, found):  # type: ignore[no-untyped-def]
    """Fill the extremes of half of V**2, or of the contact force, with their derivatives; NaN where there are none.

    Parameters
    ----------
    ends, works
        As for `pairs.fill_pair_gradients`.
    programs, spaces
        The programs of the quantity in double precision, and of an extreme, with their work spaces.
    rule : (array, int, float)
        The shares of the grid; LIBRATION or CIRCULATION; 1 for the largest value, or -1 for the smallest.
    launches : (n + 2, m) array
        The n variables of each launch, and the turning points of a libration to the accuracy of doubles, or both ends
        of a lap.
    found : (m, k + 2) array
        The extreme, the largest size on the grid, and the derivatives.
    """
    (grid, program), (grid_work, work) = programs, spaces
    (shares, kind, sign), first, count = rule, launches.shape[0] - 2, found.shape[1] - 2
    has_ends, last = kind == LIBRATION, shares.size - 1
    target, state = np.zeros((first + 2 + 2 * count) * ROW), np.zeros((ROWS, BLOCK))
    places, rows = np.zeros((3, BLOCK)), np.empty((count + 2, BLOCK))
    for start in range(0, launches.shape[1], BLOCK):
        size = min(BLOCK, launches.shape[1] - start)
        lanes, some = -(-size // WIDTH) * WIDTH, (launches, start, size)
        fill_inputs(grid_work, first, some, lanes)
        fill_inputs(work, first, some, lanes)
        call_interpreter(grid[0][0], grid[1], 0, grid[1].shape[0], grid_work, lanes)
        call_interpreter(program[0], program[1], 0, program[2], work, lanes)
        fill_column(state[LOW_END], some, first, lanes)
        fill_column(state[HIGH_END], some, first + 1, lanes)
        if has_ends:
            fill_ends(ends, works, some, lanes, first, target)
        search_grid(grid, grid_work, shares, sign, lanes, state)
        set_at_ends(target, first, has_ends, last, lanes, state)
        evaluate_at_places(program, work, places, lanes, state)
        slopes = rows_of(work, program[4][1])[0]
        for i in range(lanes):
            outward = sign * slopes[i]
            at_low, at_high = state[BEST, i] == 0.0, state[BEST, i] == last
            stays = has_ends and ((at_low and outward <= 0.0) or (at_high and outward >= 0.0))
            state[STEP, i], state[STAYS, i] = (0.0, 1.0) if stays else (inf, 0.0)
        improve(program, work, sign, lanes, places, state)
        fill_totals(program, work, (target, first), lanes, state, rows)
        for i in range(size):
            found[start + i] = rows[:, i]


def extreme_gradients(
    formulas: Formulas, quantity: str, launches: Launches, values: Array, rows: tuple[int, ...]
) -> Array:
    """Return the derivatives of extremes of V or of the contact force, a row for each launch.

    They are NaN where double-double arithmetic does not suffice, and where the extreme differs from that of the sweep,
    as it may near a pole.

    Parameters
    ----------
    formulas : Formulas
        The model of a generated module.
    quantity : str
        One of EXTREMES.
    launches : Launches
        The launches.
    values : array
        The quantity of each launch.
    rows : tuple of int
        The variables of differentiation.
    """
    of_speed, sign = quantity.startswith("v_"), 1.0 if quantity.endswith("_max") else -1.0
    source, table, circulates = source_of(formulas), launches.table, launches.circulates
    count = circulates.size
    found = np.full((count, len(rows) + 2), nan)
    if circulates.any():
        assert formulas.domain_of is not None
        laps = np.broadcast_to(formulas.domain_of(ARRAYS, tuple(launches.lines))[2], circulates.shape)
        begins = np.broadcast_to(launches.lines[-2], circulates.shape)
        table[-2:, circulates] = np.stack([begins, begins + laps])[:, circulates]
    ends = [(end_program, end, source, rows) for end in range(2)]
    own = [(grid_program, source, of_speed), (extreme_program, source, of_speed, 1, rows, LaneRecorder)]
    programs, in_code = programs_for([*ends, *own], count)
    low, high, grid, program = (one.operands for one in in_code)

    def work(part: slice) -> None:
        spaces = [one.work.copy() for one in programs]
        for kind in (LIBRATION, CIRCULATION):
            some = np.flatnonzero(circulates[part] == (kind == CIRCULATION)) + part.start
            out, rule = np.empty((some.size, found.shape[1])), (SHARES[kind], kind, sign)
            given = (low, high), tuple(spaces[:2]), (grid, program), tuple(spaces[2:])
            fill_extreme_gradients(*given, rule, np.ascontiguousarray(table[:, some]), out)
            found[some] = out

    run_in_threads(work, count, MIN_LAUNCHES_PER_THREAD)
    extremes, sizes, slopes = found[:, 0], found[:, 1], found[:, 2:]
    is_same = np.abs(extremes - (0.5 * values**2 if of_speed else values)) <= MAX_DIFFERENCE * sizes
    if of_speed:
        with np.errstate(divide="ignore", invalid="ignore"):
            slopes = np.where(values[:, np.newaxis] == 0.0, 0.0, slopes / values[:, np.newaxis])
    return np.where(is_same[:, np.newaxis], slopes, nan)
