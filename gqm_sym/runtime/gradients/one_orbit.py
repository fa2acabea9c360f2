"""The derivatives of the half period or the time of a lap of one motion along a curve with formulas, in one call of
compiled code, or in two beside a hilltop.
"""

from functools import lru_cache
from typing import Any

import numpy as np
from numba import types

from gqm_sym.runtime.arithmetic.elementary import HALF_PI
from gqm_sym.runtime.compiled.jit import entry
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, REAL, VECTOR, Array
from gqm_sym.runtime.double_double.arithmetic import multiply
from gqm_sym.runtime.double_double.nodes import trapezoidal_nodes
from gqm_sym.runtime.gradients.evaluation import MEAN, PROGRAM, fill_means_of, fill_turns, set_variable
from gqm_sym.runtime.gradients.formula_orbit import source_of
from gqm_sym.runtime.gradients.passages.slow_orbits import slow_gradients
from gqm_sym.runtime.gradients.programs import (
    LAUNCH_VARIABLES,
    Source,
    circulation_program,
    libration_program,
    turning_point_program,
)
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.quadrature.trapezoid import CIRCULATION, LIBRATION


@entry(
    types.boolean(
        *(types.Tuple((PROGRAM, PROGRAM)), types.UniTuple(VECTOR, 2)),
        *(INTEGER, MATRIX, types.UniTuple(REAL, 6), MATRIX, VECTOR),
    ),
    checked=False,
)
def fill_period_gradient(programs, works, kind, parameters, launch, nodes, found):  # type: ignore[no-untyped-def]
    """Fill derivatives of a half period or of the time of a lap; return whether double-double arithmetic suffices.

    Parameters
    ----------
    programs, works
        The programs of a turning point and of an orbit, with their work spaces. Laps do not need the former.
    kind : int
        LIBRATION or CIRCULATION.
    parameters : (2, n) array
        The run-time parameters, as two doubles each.
    launch : tuple of float
        The launch place and the launch speed, as two doubles each, and both turning points to the accuracy of doubles.
    nodes : (4, k) array
        The table of shares (`nodes.trapezoidal_nodes`).
    found : (k,) array
        Filled with the derivatives.
    """
    n, count, (program, work) = parameters.shape[1], found.size, (programs[1], works[1])
    variables = np.zeros((3, n + LAUNCH_VARIABLES))
    for k in range(n):
        set_variable(variables, k, parameters[0, k], parameters[1, k])
    for k in range(2):
        set_variable(variables, n + k, launch[2 * k], launch[2 * k + 1])
    inputs, means = np.zeros((3, program[3])), np.zeros((1 + count, MEAN))
    if kind == LIBRATION:
        fill_turns(programs[0], works[0], variables, (launch[4], launch[5]), inputs)
    else:
        inputs[:, : variables.shape[1]] = variables
        inputs[:, variables.shape[1]] = variables[:, n]  # a lap begins at the launch
    if fill_means_of(program, work, inputs, kind, nodes, means) <= 0:
        return False
    for k in range(count):
        high, low = means[1 + k, 0], means[1 + k, 1]
        if kind == LIBRATION:
            found[k] = multiply(high, low, 2.0 * HALF_PI[0], 2.0 * HALF_PI[1])[0]
        else:
            found[k] = high + low
    return True


@lru_cache(maxsize=256)
def _programs(source: Source, direction: int, rows: tuple[int, ...]) -> tuple[Any, ...]:
    """Return the first three arguments of compiled code, and the table of nodes."""
    program = circulation_program(source, direction, rows) if direction else libration_program(source, rows)
    both = program if direction else turning_point_program(source, rows), program
    kind = CIRCULATION if direction else LIBRATION
    return tuple(one.operands for one in both), tuple(one.work for one in both), kind, trapezoidal_nodes(kind)


def period_gradient(problem: Problem, direction: int, span: tuple[float, float], rows: tuple[int, ...]) -> Array | None:
    """Return the derivatives of the half period of a libration, or of the time of a lap; None where double-double
    arithmetic does not suffice.

    Parameters
    ----------
    problem : Problem
        The launch with its module.
    direction : int
        0 for a libration, else the sign of ds/dt.
    span : (float, float)
        The turning points of a libration to the accuracy of doubles.
    rows : tuple of int
        The variables of differentiation (`programs.Source`).
    """
    source = source_of(problem.formulas)
    programs, works, kind, nodes = _programs(source, direction, rows)
    lam0, v0 = problem.launch.lam0, problem.launch.v0
    launch, found = (lam0.value, lam0.low, v0.value, v0.low, *span), np.empty(len(rows))
    parameters = np.array([[n.value for n in problem.p], [n.low for n in problem.p]])
    if fill_period_gradient(programs, works, kind, parameters, launch, nodes, found):
        return found
    ends = ((lam0.value,), (lam0.low,)) if direction else (span, (0.0, 0.0))  # a lap begins at the launch
    given = [[*parameters[0], lam0.value, v0.value, 0.0, *ends[0]], [*parameters[1], lam0.low, v0.low, 0.0, *ends[1]]]
    (found,) = slow_gradients(source, direction, rows, np.array(given)[:, :, np.newaxis])
    return None if np.isnan(found).any() else found
