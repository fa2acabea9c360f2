"""Integrals from a turning point to the launch and to the place, for orbits that are slow somewhere else.

At fixed phase angles of the whole orbit, places move with both turning points, and times by what a slow passage takes;
both cancel in a way that does not contain it. So all places move here with one turning point, from which on the phase
angle is counted to the launch, and once more to the place (`gradients/passages/arrival.py`).
"""

from functools import cache
from math import fabs, nan

import numpy as np
from numba import types

from gqm_sym.runtime.compiled.intrinsics import choose
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.types import MATRIX, VECTOR, Array
from gqm_sym.runtime.double_double.arithmetic import UNIT
from gqm_sym.runtime.double_double.interpreter import BLOCK, ROW, call_interpreter
from gqm_sym.runtime.double_double.nodes import RULE, panel_rule
from gqm_sym.runtime.gradients.evaluation import PROGRAM, is_significant, rounding_of
from gqm_sym.runtime.gradients.lanes.arrivals.changes import MAX_ERROR, evaluate_at, total_change
from gqm_sym.runtime.gradients.lanes.arrivals.integrals import (
    DONE,
    ERRORS,
    INTEGRALS,
    LOST,
    MASS,
    MAX_ROUNDING,
    OPEN,
    SCALE,
    SUMS,
    TOTAL,
    VALUE,
    add_node,
)
from gqm_sym.runtime.gradients.lanes.arrivals.programs import SQUARE
from gqm_sym.runtime.gradients.lanes.arrivals.weights import FLIP, LAUNCH_SIGN, PLACE_SIGN, ROWS
from gqm_sym.runtime.gradients.lanes.evaluation import WIDTH, fill_inputs, rows_of
from gqm_sym.runtime.gradients.lanes.pairs import fill_ends
from gqm_sym.runtime.gradients.panels import shares_on
from gqm_sym.runtime.gradients.passages.arrival import counts_from_upper
from gqm_sym.runtime.quadrature.trapezoid import LIBRATION

# The numbers of panels with Gauss's rule that are tried in turn, and the largest change of an integral by the last
# doubling, as a share of the integral of the absolute values. The turning point of the next well is a branch point
# beyond the end of the interval, z half widths of the last panel from its middle: the error is about
# exp(-2 * RULE * acosh(z)). Halving the panel puts 2 z - 1 in place of z, and leaves less than a rounding.
PANELS, MAX_CHANGE = (1, 2, 4, 8), 1e-12


@cache
def gauss_nodes() -> Array:
    """Return the nodes of all numbers of panels: shares as two doubles, and weights."""
    parts = []
    for count in PANELS:
        edges = np.pi * np.arange(count + 1) / count
        shares = shares_on(LIBRATION, edges[:-1], edges[1:])
        parts.append(np.vstack([shares, np.tile(panel_rule()[2] * (np.pi / count), count)]))
    found: Array = np.ascontiguousarray(np.hstack(parts))
    return found


@Inner
def choose_ends(asked, v0, kept, shape, lanes, state, ends):  # type: ignore[no-untyped-def]
    """Choose the turning points from which times are counted (`counts_from_upper`), and fill the signs of both times.

    Parameters
    ----------
    asked : (m, 4) array
        As for `times.fill_swing_arrivals`.
    v0 : array
        The launch speeds.
    kept : array
        The inputs of the orbits' program, with both turning points and the changes of the lower and of the upper one.
    shape : (int, int)
        The numbers of inputs before the turning points, and of variables.
    lanes, state
        As for `integrals.integrate`.
    ends : array
        Filled with 1 for the upper and 0 for the lower turning point.
    """
    first, wanted = shape
    below, above = rows_of(kept, first * ROW)[0], rows_of(kept, (first + 1) * ROW)[0]
    for i in range(lanes):
        lam0, direction, place, _ = asked[min(i, asked.shape[0] - 1)]
        rests, upwards = v0[i] == 0.0, direction > 0.0
        has_turned = not rests and direction * (place - lam0) < 0.0
        lower, upper = 0.0, 0.0
        for j in range(wanted):
            lower += fabs(kept[(first + 2 + j) * ROW + i])
            upper += fabs(kept[(first + 2 + wanted + j) * ROW + i])
        is_upper = counts_from_upper(lam0, direction, rests, place, (below[i], above[i]), (lower, upper))
        towards = is_upper == upwards
        ends[i], state[FLIP, i] = 1.0 if is_upper else 0.0, -1.0 if is_upper else 1.0
        state[LAUNCH_SIGN, i] = 1.0 if towards else -1.0
        state[PLACE_SIGN, i] = -1.0 if towards and not has_turned and not rests else 1.0


@Inner
def lay_moves(kept, shape, ends, lanes, work):  # type: ignore[no-untyped-def]
    """Let all places move as the chosen turning point does: fill the changes of both ends with its own."""
    first, wanted = shape
    for j in range(wanted):
        for part in range(3):
            low, high = (first + 2 + j) * ROW + part * BLOCK, (first + 2 + wanted + j) * ROW + part * BLOCK
            lower, upper = kept[low : low + BLOCK], kept[high : high + BLOCK]
            to_lower, to_upper = work[low : low + BLOCK], work[high : high + BLOCK]
            for i in range(lanes):
                move = choose(ends[i] == 1.0, upper[i], lower[i])
                to_lower[i], to_upper[i] = move, move


@Inner
def lay_ends(kept, shape, ends, asked, column, lanes, work):  # type: ignore[no-untyped-def]
    """Fill the ends of the interval from the chosen turning point to the places in a column."""
    low, high = shape[0] * ROW, (shape[0] + 1) * ROW
    for part in range(3):
        below, above = kept[low + part * BLOCK :][:BLOCK], kept[high + part * BLOCK :][:BLOCK]
        to_below, to_above = work[low + part * BLOCK :][:BLOCK], work[high + part * BLOCK :][:BLOCK]
        for i in range(lanes):
            place = asked[min(i, asked.shape[0] - 1), column] if part == 0 else 0.0
            to_below[i] = choose(ends[i] == 1.0, place, below[i])
            to_above[i] = choose(ends[i] == 1.0, above[i], place)


@Inner
def integrate_to(program, work, nodes, lanes, sums, found, states):  # type: ignore[no-untyped-def]
    """Fill the integrals of all results of a program over the whole phase, by Gauss's rule on panels.

    Parameters
    ----------
    program, work
        The program of the time per phase, whose inputs are filled.
    nodes : (3, n) array
        The nodes (`gauss_nodes`).
    lanes : int
        The number of orbits.
    sums : (k, SUMS, BLOCK) array
        Work space.
    found : (k, INTEGRALS, BLOCK) array
        Filled.
    states : array
        Filled with the states of the quadrature.
    """
    (share, rest, error), start = rows_of(work, program[3] * ROW), 0
    weights, no_terms = np.empty(BLOCK), np.empty(0)
    call_interpreter(program[0], program[1], 0, program[2], work, lanes)
    states[:lanes], found[:, :, :] = OPEN, 0.0
    for count in PANELS:
        sums[:, :, :] = 0.0
        for node in range(start, start + count * RULE):
            for i in range(lanes):
                share[i], rest[i], error[i] = nodes[0, node], nodes[1, node], UNIT * nodes[0, node]
                weights[i] = nodes[2, node]
            call_interpreter(program[0], program[1], program[2], program[1].shape[0], work, lanes)
            add_node(program, work, (weights, weights, weights), no_terms, lanes, sums)
        start, left = start + count * RULE, 0
        for i in range(lanes):
            if states[i] != OPEN:
                continue
            has_converged, is_exact = count > 1, True
            for j in range(sums.shape[0]):
                total, mass, bound = sums[j, TOTAL, i], sums[j, MASS, i], sums[j, ERRORS, i]
                is_exact = is_exact and rounding_of(j, mass, bound, sums[0, MASS, i]) <= MAX_ROUNDING
                has_converged = has_converged and (
                    fabs(total - found[j, VALUE, i]) <= MAX_CHANGE * mass or not is_significant(j, mass, bound)
                )
                found[j, VALUE, i], found[j, SCALE, i] = total, mass
            states[i] = (DONE if has_converged else OPEN) if is_exact else LOST
            left += states[i] == OPEN
        if left == 0:
            return


@entry(
    types.void(
        *(types.UniTuple(PROGRAM, 2), types.UniTuple(VECTOR, 2), types.UniTuple(PROGRAM, 2)),
        *(types.UniTuple(VECTOR, 2), types.Tuple((MATRIX, types.int64[:, ::1])), MATRIX, MATRIX, MATRIX),
    ),
    nogil=True,
)
def fill_beside_hilltops(ends, works, programs, spaces, rule, launches, asked, found):  # type: ignore[no-untyped-def]
    """Fill the derivatives of first times at places of librations; NaN where the way contains a slow passage.

    Parameters
    ----------
    ends, works, programs, spaces, launches, asked, found
        As for `times.fill_swing_arrivals`.
    rule : ((3, n) array, (2, k) array)
        The nodes (`gauss_nodes`); for each derivative the kind of the variable and its number among those of the
        programs.
    """
    (orbit, at_place), (work, place_work), (nodes, which), v0 = programs, spaces, rule, np.empty(BLOCK)
    functions, first, filled = orbit[4].size, launches.shape[0] - 2, orbit[3] * ROW
    shape, kept, chosen = (first, functions - 1), np.empty(filled), np.empty(BLOCK)
    state, sums = np.zeros((ROWS, BLOCK)), np.empty((functions, SUMS, BLOCK))
    to_place, to_launch = np.empty((functions, INTEGRALS, BLOCK)), np.empty((functions, INTEGRALS, BLOCK))
    known, also = np.empty(BLOCK, dtype=np.int64), np.empty(BLOCK, dtype=np.int64)
    both = np.empty((2, at_place[4].size, 2, BLOCK))
    here, there = both[0], both[1]
    for start in range(0, launches.shape[1], BLOCK):
        size = min(BLOCK, launches.shape[1] - start)
        lanes, some, wanted = -(-size // WIDTH) * WIDTH, (launches, start, size), asked[start : start + size]
        for i in range(lanes):
            v0[i] = launches[first - 2, start + min(i, size - 1)]
        fill_inputs(work, first, some, lanes)
        fill_ends(ends, works, some, lanes, first, work)
        kept[:] = work[:filled]
        choose_ends(wanted, v0, kept, shape, lanes, state, chosen)
        lay_moves(kept, shape, chosen, lanes, work)
        place_work[:filled] = work[:filled]
        call_interpreter(at_place[0], at_place[1], 0, at_place[2], place_work, lanes)
        evaluate_at(at_place, place_work, wanted, 0, lanes, here)
        evaluate_at(at_place, place_work, wanted, 2, lanes, there)
        lay_ends(kept, shape, chosen, wanted, 0, lanes, work)
        integrate_to(orbit, work, nodes, lanes, sums, to_launch, also)
        lay_ends(kept, shape, chosen, wanted, 2, lanes, work)
        integrate_to(orbit, work, nodes, lanes, sums, to_place, known)
        for i in range(size):
            rests = v0[i] == 0.0
            is_known = known[i] == DONE and (rests or also[i] == DONE) and there[SQUARE, 0, i] > 0.0
            for j in range(functions):
                to_place[j, VALUE, i] *= state[PLACE_SIGN, i]
                if not rests:
                    to_place[j, VALUE, i] += state[LAUNCH_SIGN, i] * to_launch[j, VALUE, i]
                    to_place[j, SCALE, i] += to_launch[j, SCALE, i]
            for k in range(which.shape[1]):
                found[start + i, k] = nan
                if is_known and wanted[i, 0] != wanted[i, 2]:
                    given = which[0, k], which[1, k]
                    value, error = total_change(given, i, v0[i], here, there, state, to_place)
                    found[start + i, k] = value if error <= MAX_ERROR else nan
