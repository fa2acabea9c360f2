"""Gradients of the first times at places of many launches, with one orbit in each lane.

The times from an end of a libration to its launch and to the place are integrals of the time per phase angle; with the
half period, their sum or difference is the time asked for. The time per phase angle and its derivatives at the same
phase angle are evaluated in double-double arithmetic, and integrated by one quadrature (`weights`). To these
derivatives come those of the phases of the launch and of the place, which lie at fixed places while the ends move. Next
to an end they are large, and of those of the launch parts cancel there, so that they too are evaluated in double-double
arithmetic.
"""

from math import atan2, nan, sqrt
from typing import Any

import numpy as np
from numba import types
from numpy.typing import NDArray

from gqm_sym.literals.namespaces import ARRAYS
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.threads import run_in_threads
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, VECTOR, Array
from gqm_sym.runtime.double_double.interpreter import BLOCK, ROW, call_interpreter
from gqm_sym.runtime.double_double.nodes import trapezoidal_nodes
from gqm_sym.runtime.gradients.evaluation import PROGRAM
from gqm_sym.runtime.gradients.formula_orbit import source_of
from gqm_sym.runtime.gradients.lanes.arrivals.beside_hilltops import fill_beside_hilltops, gauss_nodes
from gqm_sym.runtime.gradients.lanes.arrivals.changes import LAM0, MAX_ERROR, PARAMETER, V0, evaluate_at, total_change
from gqm_sym.runtime.gradients.lanes.arrivals.integrals import DONE, INTEGRALS, VALUE, integrate, work_space
from gqm_sym.runtime.gradients.lanes.arrivals.programs import (
    ABOVE,
    BELOW,
    SQUARE,
    has_fixed_laps,
    place_program,
    small_swing_program,
)
from gqm_sym.runtime.gradients.lanes.arrivals.weights import (
    FLIP,
    LAUNCH,
    LAUNCH_SIGN,
    PASSES,
    PLACE,
    PLACE_SIGN,
    ROWS,
    WHOLE,
)
from gqm_sym.runtime.gradients.lanes.evaluation import WIDTH, fill_inputs
from gqm_sym.runtime.gradients.lanes.launches import EVEN, Launches
from gqm_sym.runtime.gradients.lanes.operations import LaneRecorder
from gqm_sym.runtime.gradients.lanes.pairs import fill_ends
from gqm_sym.runtime.gradients.lanes.periods import MIN_LAUNCHES_PER_THREAD, end_program, programs_for
from gqm_sym.runtime.gradients.programs import Source, circulation_program, libration_program
from gqm_sym.runtime.launch.formulas import Formulas
from gqm_sym.runtime.quadrature.trapezoid import CIRCULATION, LIBRATION

WHICH, LIMITS = types.int64[:, ::1], types.UniTuple(INTEGER, 2)


@Inner
def phase_from(near, far):  # type: ignore[no-untyped-def]
    """Return the phase angle from an end, given the distances from this end and from the other one."""
    return 2.0 * atan2(sqrt(max(near, 0.0)), sqrt(max(far, 0.0)))


@Inner
def fill_phases(asked, v0, here, there, lanes, state):  # type: ignore[no-untyped-def]
    """Fill the phases of librations from the end nearer to the launch (`sweep.single.arrivals`).

    Parameters
    ----------
    asked : (m, 4) array
        As for `fill_swing_arrivals`.
    v0 : array
        The launch speeds.
    here, there : arrays
        The results of `evaluate_at` at the launch and at the place.
    lanes, state
        As for `integrate`.
    """
    for i in range(lanes):
        lam0, direction, place, _ = asked[min(i, asked.shape[0] - 1)]
        from_upper, rests = here[BELOW, 0, i] > here[ABOVE, 0, i], v0[i] == 0.0
        near, far = (ABOVE, BELOW) if from_upper else (BELOW, ABOVE)
        towards, onwards = (direction > 0.0) == from_upper, rests or direction * (place - lam0) > 0.0
        state[LAUNCH, i] = 0.0 if rests else phase_from(here[near, 0, i], here[far, 0, i])
        state[PLACE, i] = phase_from(there[near, 0, i], there[far, 0, i])
        state[LAUNCH_SIGN, i], state[FLIP, i] = 1.0 if towards else -1.0, -1.0 if from_upper else 1.0
        passes_far_end = not rests and not towards and not onwards
        state[PLACE_SIGN, i] = -1.0 if passes_far_end or (towards and onwards and not rests) else 1.0
        state[WHOLE, i] = 2.0 if passes_far_end else 0.0


@entry(
    types.void(
        *(types.UniTuple(PROGRAM, 2), types.UniTuple(VECTOR, 2), types.UniTuple(PROGRAM, 2)),
        *(types.UniTuple(VECTOR, 2), types.Tuple((MATRIX, WHICH, LIMITS)), MATRIX, MATRIX, MATRIX),
    ),
    nogil=True,
)
def fill_swing_arrivals(ends, works, programs, spaces, rule, launches, asked, found):  # type: ignore[no-untyped-def]
    """Fill the derivatives of first times at places of librations; NaN where digits are lost.

    Parameters
    ----------
    ends, works
        As for `pairs.fill_pair_gradients`.
    programs, spaces
        The programs of the time per phase (`programs.libration_program`), and of a place
        (`arrivals.programs.place_program`), with their work spaces.
    rule : ((4, n) array, (2, k) array, (int, int))
        The table of shares (`nodes.trapezoidal_nodes`); for each derivative the kind of the variable and its number
        among those of the programs; and the numbers of nodes of a pass (`weights.PASSES`).
    launches : (n + 2, m) array
        The variables of each launch, and both turning points to the accuracy of doubles.
    asked : (m, 4) array
        The launch place, the direction of the launch, the place asked for, and 1 if the orbit is a mirror image of
        itself.
    found : (m, k) array
        Filled.
    """
    (orbit, at_place), (work, place_work), (nodes, which, limits), v0 = programs, spaces, rule, np.empty(BLOCK)
    functions, variables = orbit[4].size, launches.shape[0] - 2
    state, integrals = np.zeros((ROWS, BLOCK)), np.empty((functions, INTEGRALS, BLOCK))
    ample, both = work_space(functions), np.empty((2, at_place[4].size, 2, BLOCK))
    here, there, filled = both[0], both[1], orbit[3] * ROW
    for start in range(0, launches.shape[1], BLOCK):
        size = min(BLOCK, launches.shape[1] - start)
        lanes, some, wanted = -(-size // WIDTH) * WIDTH, (launches, start, size), asked[start : start + size]
        fill_inputs(work, variables, some, lanes)
        fill_ends(ends, works, some, lanes, variables, work)
        place_work[:filled] = work[:filled]
        call_interpreter(at_place[0], at_place[1], 0, at_place[2], place_work, lanes)
        evaluate_at(at_place, place_work, wanted, 0, lanes, here)
        evaluate_at(at_place, place_work, wanted, 2, lanes, there)
        for i in range(lanes):
            at = min(i, size - 1)
            v0[i], ample[4][i] = launches[variables - 2, start + at], wanted[at, 3]
        fill_phases(wanted, v0, here, there, lanes, state)
        integrate(orbit, work, (LIBRATION, nodes, limits), lanes, state, ample, integrals)
        for i in range(size):
            is_known = ample[5][i] == DONE and wanted[i, 0] != wanted[i, 2] and there[SQUARE, 0, i] > 0.0
            for k in range(which.shape[1]):
                found[start + i, k] = nan
                if is_known:
                    given = which[0, k], which[1, k]
                    value, error = total_change(given, i, v0[i], here, there, state, integrals)
                    found[start + i, k] = value if error <= MAX_ERROR else nan


@entry(
    types.void(PROGRAM, VECTOR, types.Tuple((MATRIX, INTEGER, LIMITS)), MATRIX, MATRIX, MATRIX),
    nogil=True,
)
def fill_lap_arrivals(program, work, rule, launches, asked, found):  # type: ignore[no-untyped-def]
    """Fill the derivatives of first times at places of circulations; NaN where digits are lost.

    Parameters
    ----------
    program, work
        The program of the time per lap (`programs.circulation_program`), and its work space.
    rule : ((4, n) array, int, (int, int))
        The table of shares; the number of the derivative with respect to the launch place, or -1 if there is none; and
        the numbers of nodes of a pass.
    launches : (n, m) array
        The inputs of the program.
    asked : (m, 2) array
        The distance of the place asked for from the launch, in laps, and the length of a lap in lam with its sign.
    found : (m, k) array
        Filled.
    """
    (nodes, launch_row, limits), functions = rule, program[4].size
    state, integrals = np.zeros((ROWS, BLOCK)), np.empty((functions, INTEGRALS, BLOCK))
    ample, rates, begin = work_space(functions), np.empty((functions, 2, BLOCK)), np.zeros((1, 1))
    for start in range(0, launches.shape[1], BLOCK):
        size = min(BLOCK, launches.shape[1] - start)
        lanes, some, wanted = -(-size // WIDTH) * WIDTH, (launches, start, size), asked[start : start + size]
        for i in range(lanes):
            state[PLACE, i] = wanted[min(i, size - 1), 0]
        fill_inputs(work, launches.shape[0], some, lanes)
        integrate(program, work, (CIRCULATION, nodes, limits), lanes, state, ample, integrals)
        evaluate_at(program, work, begin, 0, lanes, rates)
        for i in range(size):
            for k in range(found.shape[1]):
                at_launch = rates[0, 0, i] / wanted[i, 1] if k == launch_row else 0.0
                is_known = ample[5][i] == DONE and wanted[i, 0] > 0.0
                found[start + i, k] = integrals[1 + k, VALUE, i] - at_launch if is_known else nan


def arrival_gradients(formulas: Formulas, launches: Launches, places: Array, rows: tuple[int, ...]) -> Array:
    """Return the derivatives of the first times at places, a row for each launch.

    They are NaN where this quadrature does not converge, and where a place is a turning point or that of the launch.

    Parameters
    ----------
    formulas : Formulas
        The model of a generated module.
    launches : Launches
        The launches.
    places : array
        The places: a vector, or one number that all launches have in common.
    rows : tuple of int
        The variables of differentiation.
    """
    source, circulates = source_of(formulas), launches.circulates
    found = np.full((circulates.size, len(rows)), nan)
    if not rows:
        return found
    general, small = (libration_program, LaneRecorder), (small_swing_program,)
    for (make, *last), limits in ((general, PASSES[0]), (small, PASSES[0]), (general, None), (general, PASSES[1])):
        is_open = np.flatnonzero(~circulates & np.isnan(found).any(axis=1))
        if is_open.size:
            _fill_swings(source, launches, places, rows, (make, last, limits), (is_open, found))
    if circulates.any() and has_fixed_laps(source):
        assert formulas.domain_of is not None
        lap = np.broadcast_to(formulas.domain_of(ARRAYS, tuple(launches.lines))[2], circulates.shape)
        for direction in (1, -1):
            for limits in PASSES:
                is_open = circulates & (launches.directions == direction) & np.isnan(found).any(axis=1)
                if is_open.any():
                    asked, filled = (places, direction * np.abs(lap)), (np.flatnonzero(is_open), found)
                    _fill_laps(source, launches, asked, (direction, rows, limits), filled)
    return found


def _fill_swings(
    source: Source,
    launches: Launches,
    places: Array,
    rows: tuple[int, ...],
    stage: tuple[Any, Any, tuple[int, int] | None],
    filled: tuple[NDArray[np.intp], Array],
) -> None:
    """Fill the derivatives of some librations.

    Parameters
    ----------
    source : Source
        The formulas.
    launches, places, rows
        As for `arrival_gradients`.
    stage : (callable, sequence, (int, int))
        The function that makes the program of the time per phase (None if there is none), its last arguments, and the
        numbers of nodes of a pass; None in place of these for integrals from one turning point (`beside_hilltops`).
    filled : pair of arrays
        The numbers of the launches, and the derivatives of all launches.
    """
    (make, last, limits), (chosen, found), n, energy = stage, filled, source.parameters, source.variables - 1
    wanted = (*((energy,) if max(rows) >= n else ()), *sorted({k for k in rows if k < n}))
    if make(source, wanted, *last) is None:
        return
    kinds = [PARAMETER if k < n else LAM0 if k == n else V0 for k in rows]
    which = np.array([kinds, [wanted.index(k if k < n else energy) for k in rows]], dtype=np.int64)
    makers = [*((end_program, end, source, wanted) for end in range(2)), (place_program, source, wanted)]
    programs, in_code = programs_for([*makers, (make, source, wanted, *last)], chosen.size)
    low, high, place, orbit = (one.operands for one in in_code)
    ways, out = np.empty((found.shape[0], 4)), np.empty((chosen.size, len(rows)))
    ways[:, 0], ways[:, 1], ways[:, 2] = launches.lines[-2], launches.directions, places
    ways[:, 3] = launches.kinds >= EVEN
    table, ways = launches.table[:, chosen], ways[chosen]

    def work(part: slice) -> None:
        *spaces, place_space, space = (one.work.copy() for one in programs)
        given = (low, high), tuple(spaces), (orbit, place), (space, place_space)
        of_part = np.ascontiguousarray(table[:, part]), ways[part], out[part]
        if limits is None:
            fill_beside_hilltops(*given, (gauss_nodes(), which), *of_part)
        else:
            fill_swing_arrivals(*given, (trapezoidal_nodes(LIBRATION), which, limits), *of_part)

    run_in_threads(work, chosen.size, MIN_LAUNCHES_PER_THREAD)
    found[chosen] = out


def _fill_laps(
    source: Source,
    launches: Launches,
    asked: tuple[Array, Array],
    given: tuple[int, tuple[int, ...], tuple[int, int]],
    filled: tuple[NDArray[np.intp], Array],
) -> None:
    """Fill the derivatives of some circulations.

    Parameters
    ----------
    source, launches, filled
        As for `_fill_swings`.
    asked : pair of arrays
        The places, and the lengths of a lap in lam, with the sign of the direction.
    given : (int, tuple of int, (int, int))
        The direction of the launches, the variables of differentiation, and the numbers of nodes of a pass.
    """
    (places, lap), (chosen, found), n, (direction, rows, limits) = asked, filled, source.parameters, given
    table = launches.table[:, chosen]
    ahead = np.broadcast_to(places, lap.shape)[chosen] - table[n]  # a lap begins at lam0
    ways, laps = np.stack([ahead / lap[chosen], lap[chosen]], axis=1), np.vstack([table[: source.variables], table[n]])
    programs, in_code = programs_for([(circulation_program, source, direction, rows)], chosen.size)
    operands, out = in_code[0].operands, np.empty((chosen.size, len(rows)))
    rule = trapezoidal_nodes(CIRCULATION), rows.index(n) if n in rows else -1, limits

    def work(part: slice) -> None:
        fill_lap_arrivals(
            operands, programs[0].work.copy(), rule, np.ascontiguousarray(laps[:, part]), ways[part], out[part]
        )

    run_in_threads(work, chosen.size, MIN_LAUNCHES_PER_THREAD)
    found[chosen] = out
