"""Derivatives of half periods and of times of laps for bodies that are slow somewhere, by panels of the phase.

Beside a hilltop equal steps of the phase angle would be too many. The panels of each orbit are halved until polynomials
resolve the time and its derivatives.
"""

from functools import lru_cache, partial
from math import fabs, nan

import numpy as np
from numba import types

from gqm_sym.runtime.arithmetic.elementary import HALF_PI
from gqm_sym.runtime.compiled.jit import entry
from gqm_sym.runtime.compiled.threads import run_in_threads
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, VECTOR, Array
from gqm_sym.runtime.double_double.arithmetic import multiply
from gqm_sym.runtime.gradients.evaluation import (
    CUBE,
    MEAN,
    PROGRAM,
    fill_panel_means_of,
    fill_turns,
    set_variable,
)
from gqm_sym.runtime.gradients.panels import rule_with_tails
from gqm_sym.runtime.gradients.passages.from_turns import fill_other_side, from_turn_program
from gqm_sym.runtime.gradients.programs import (
    Program,
    Source,
    circulation_program,
    libration_program,
    turning_point_program,
)
from gqm_sym.runtime.quadrature.trapezoid import CIRCULATION, LIBRATION

# The largest error of a derivative as a share of it. In a small swing the values along the orbit all but cancel,
# because its turning points move much farther than its half period changes.
MAX_SHARE = 2.0**-54

# The number of launches from which on a thread is worth starting.
MIN_LAUNCHES_PER_THREAD = 8


@entry(
    types.void(types.UniTuple(PROGRAM, 2), types.UniTuple(VECTOR, 2), types.UniTuple(INTEGER, 2), CUBE, MATRIX, MATRIX),
    nogil=True,
)
def fill_slow_gradients(programs, works, form, launches, rule, found):  # type: ignore[no-untyped-def]
    """Fill the derivatives of half periods, or of times of laps, by panels of the phase; NaN where digits are lost.

    Parameters
    ----------
    programs, works
        The programs of a turning point and of an orbit, with their work spaces. Laps do not need the former.
    form : (int, int)
        LIBRATION or CIRCULATION, and the number of parts of an orbit: 2 for `from_turn_program`.
    launches : (2, n, m) or (1, n, m) array
        The inputs of the orbits' program for each launch, then both turning points of a libration; as two doubles, or
        as one, each.
    rule : (6, k) array
        As for `evaluation.fill_panel_means`.
    found : (m, k) array
        Filled with the derivatives.
    """
    (turns, program), (work_of_turns, work), (kind, parts) = programs, works, form
    first = launches.shape[1] - (2 if kind == LIBRATION else 0)
    variables, inputs = np.zeros((3, first)), np.zeros((parts, 3, program[3]))
    means, has_low = np.empty((1 + found.shape[1], MEAN)), launches.shape[0] > 1
    whole = (2.0 * HALF_PI[0], 2.0 * HALF_PI[1]) if kind == LIBRATION else (1.0, 0.0)
    for i in range(launches.shape[2]):
        for k in range(first):
            set_variable(variables, k, launches[0, k, i], launches[1, k, i] if has_low else 0.0)
        inputs[0, :, :first] = variables
        if kind == LIBRATION:
            span = launches[0, first, i], launches[0, first + 1, i]
            fill_turns(turns, work_of_turns, variables, span, inputs[0])
        if parts > 1:
            fill_other_side(inputs, first)
        is_known = fill_panel_means_of(program, work, inputs, kind, rule, means) > 0
        for k in range(found.shape[1]):
            high, low, error = means[1 + k, 0], means[1 + k, 1], means[1 + k, 2]
            is_exact = is_known and error <= MAX_SHARE * fabs(high)
            found[i, k] = multiply(high, low, whole[0], whole[1])[0] if is_exact else nan


@lru_cache(maxsize=64)
def programs_for(source: Source, direction: int, rows: tuple[int, ...]) -> tuple[tuple[Program, int], ...]:
    """Return the programs of an orbit that are tried in turn, each with the number of parts of an orbit."""
    if direction:
        return ((circulation_program(source, direction, rows), 1),)
    from_turns, plain = from_turn_program(source, rows), (libration_program(source, rows), 1)
    return (plain,) if from_turns is None else ((from_turns, 2), plain)


def slow_gradients(source: Source, direction: int, rows: tuple[int, ...], launches: Array) -> Array:
    """Return the derivatives of half periods, or of times of laps; NaN where double-double arithmetic does not suffice.

    Parameters
    ----------
    source : Source
        The formulas.
    direction : int
        0 for librations, else the sign of ds/dt.
    rows : tuple of int
        The variables of differentiation.
    launches : (1, n, m) or (2, n, m) array
        As for `fill_slow_gradients`.
    """
    found = np.full((launches.shape[2], len(rows)), nan)
    turns, kind = turning_point_program(source, rows), CIRCULATION if direction else LIBRATION
    for program, parts in programs_for(source, direction, rows):
        which = np.flatnonzero(np.isnan(found).any(axis=1))
        some, out = launches[:, :, which], np.empty((which.size, len(rows)))

        def work(part: slice, program: Program, parts: int, some: Array, out: Array) -> None:
            works = turns.work.copy(), program.work.copy()
            of_part, operands = np.ascontiguousarray(some[:, :, part]), (turns.operands, program.operands)
            fill_slow_gradients(operands, works, (kind, parts), of_part, rule_with_tails(), out[part])

        given = partial(work, program=program, parts=parts, some=some, out=out)
        run_in_threads(given, which.size, MIN_LAUNCHES_PER_THREAD)
        found[which] = out
    return found
