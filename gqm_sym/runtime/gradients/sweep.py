"""Gradients of the periods of many launches, by a compiled loop over the launches in threads."""

from math import fabs, nan

import numpy as np
from numba import types
from numpy.typing import NDArray

from gqm_sym.runtime.arithmetic.elementary import QUARTER
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.threads import run_in_threads
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, VECTOR, Array
from gqm_sym.runtime.double_double.arithmetic import UNIT, add, multiply
from gqm_sym.runtime.double_double.interpreter import ERROR, LOW
from gqm_sym.runtime.double_double.nodes import trapezoidal_nodes
from gqm_sym.runtime.gradients.evaluation import MEAN, PROGRAM, begin, evaluate_block, fill_means_of
from gqm_sym.runtime.gradients.orbit import source_of
from gqm_sym.runtime.gradients.programs import Program, circulation_program, libration_program, turning_point_program
from gqm_sym.runtime.launch.formulas import Formulas
from gqm_sym.runtime.quadrature.trapezoid import CIRCULATION, LIBRATION

# From how many launches on a thread is worth starting.
MIN_LAUNCHES_PER_THREAD = 64

# Quantities whose gradients compiled code has, each with how many half periods it is.
PERIODS = {"half_period": 1.0, "period": 2.0}

# Steps of Newton's method to the turning points, from doubles.
NEWTON_STEPS = 2


@Inner
def fill_turns(program, work, variables, span, inputs):  # type: ignore[no-untyped-def]
    """Fill the inputs of a libration: its variables, both turning points near ``span``, and their derivatives."""
    count, outputs = variables.shape[1], program[4]
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
        for k in range(count):
            at, to = outputs[1 + k] + i, count + 2 + i * count + k
            inputs[0, to], inputs[1, to], inputs[2, to] = work[at], work[at + LOW], work[at + ERROR]


@entry(types.void(PROGRAM, VECTOR, PROGRAM, VECTOR, INTEGER, MATRIX, MATRIX, MATRIX), nogil=True)
def fill_gradients(turns, turns_work, orbit, work, kind, launches, nodes, found):  # type: ignore[no-untyped-def]
    """Fill the gradients of half periods, or of times of laps; NaN where double-double arithmetic does not suffice.

    Parameters
    ----------
    turns, turns_work, orbit, work
        The programs of a turning point and of an orbit (`programs.Program.operands`), each with its work space.
    kind : int
        LIBRATION or CIRCULATION.
    launches : (m, n + 2) array
        The n variables of each launch, and the turning points of a libration as doubles know them.
    nodes : (4, k) array
        The table of shares (`nodes.trapezoidal_nodes`).
    found : (m, k) array
        The derivatives by the variables that the orbit's program has.
    """
    n = launches.shape[1] - 2
    variables, inputs = np.zeros((3, n)), np.zeros((3, orbit[3]))
    means = np.empty((orbit[4].size, MEAN))
    for m in range(launches.shape[0]):
        variables[0] = launches[m, :n]
        if kind == LIBRATION:
            fill_turns(turns, turns_work, variables, launches[m, n:], inputs)
        else:
            inputs[:, :n] = variables
            inputs[0, n] = launches[m, n - 3]  # the lap begins at lam0
        means[:, :] = 0.0
        count = fill_means_of(orbit, work, inputs, nodes, means)
        for j in range(means.shape[0]):
            high, low = means[j, 0], means[j, 1]
            if kind == LIBRATION:
                high, low = multiply(high, low, 2.0 * QUARTER[0], 2.0 * QUARTER[1])
            found[m, j] = high if count > 0 else nan


def period_gradients(
    formulas: Formulas, launches: Array, directions: Array, spans: Array, rows: tuple[int, ...]
) -> Array:
    """The derivatives of half periods, or of times of laps: a row for each launch.

    Parameters
    ----------
    formulas : Formulas
        The model of a generated module.
    launches : (m, n) array
        The run-time parameters, lam0 and v0 of each launch.
    directions : (m,) array
        The sign of ds/dt at launch.
    spans : (m, 2) array
        The turning points of each launch; NaN for a circulation.
    rows : tuple of int
        The variables that derivatives are wanted by.
    """
    source, found = source_of(formulas), np.full((len(launches), len(rows)), nan)
    table = np.hstack([launches, np.zeros((len(launches), 1)), spans])
    turns, turned = turning_point_program(source), np.isnan(spans[:, 0])

    def fill(program: Program, kind: int, chosen: NDArray[np.bool_]) -> None:
        which = np.flatnonzero(chosen)

        def work(part: slice) -> None:
            some = which[part]
            out = np.empty((some.size, len(rows)))
            programs = (turns.operands, turns.work.copy(), program.operands, program.work.copy())
            fill_gradients(*programs, kind, table[some], trapezoidal_nodes(kind), out)
            found[some] = out

        run_in_threads(work, which.size, MIN_LAUNCHES_PER_THREAD)

    fill(libration_program(source, rows), LIBRATION, ~turned)
    for direction in (1, -1):
        if (chosen := turned & (directions == direction)).any():
            fill(circulation_program(source, direction, rows), CIRCULATION, chosen)
    return found
