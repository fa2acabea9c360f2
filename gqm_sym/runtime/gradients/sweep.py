"""Gradients of periods, turning points and extremes of many launches, by compiled loops in threads."""

from math import fabs, inf, nan

import numpy as np
from numba import types

from gqm_sym.literals.namespaces import ARRAYS
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.threads import run_in_threads
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, VECTOR, Array
from gqm_sym.runtime.double_double.arithmetic import add, multiply
from gqm_sym.runtime.double_double.interpreter import BLOCK, ERROR, LOW
from gqm_sym.runtime.gradients.evaluation import PROGRAM, begin, evaluate_block, fill_turns
from gqm_sym.runtime.gradients.formula_orbit import source_of
from gqm_sym.runtime.gradients.lanes.launches import Launches
from gqm_sym.runtime.gradients.lanes.periods import period_gradients
from gqm_sym.runtime.gradients.programs import extreme_program, turning_point_program
from gqm_sym.runtime.launch.formulas import Formulas
from gqm_sym.runtime.launch.kinds import EXTREMES
from gqm_sym.runtime.quadrature.trapezoid import CIRCULATION, LIBRATION

# The number of launches from which on a thread is worth starting.
MIN_LAUNCHES_PER_THREAD = 64

# Quantities whose gradients compiled code computes: periods, each with its number of half periods, and others.
PERIODS = {"half_period": 1.0, "period": 2.0}
COMPILED = (*PERIODS, "turning_points", *EXTREMES)

# The grid on which an extreme is found, in shares of a lap and of a libration's width. At most so many steps of
# Newton's method follow, until one is below the first share of the width.
LAP_SHARES = np.arange(BLOCK) / BLOCK
WIDTH_SHARES = np.sin(0.5 * np.pi * np.arange(BLOCK) / (BLOCK - 1)) ** 2
MAX_STEPS, LAST_STEP = 8, 1e-12

# The largest error of a derivative, as a share of it or of the extreme, and the largest difference between the extreme
# found here and that of the sweep, as a share of the largest value on the grid.
MAX_ERROR, MAX_DIFFERENCE = 1e-17, 1e-10


@Inner
def fill_total(program, work, i, tangent, found):  # type: ignore[no-untyped-def]
    """Fill the derivatives of a quantity at place ``i`` of the block, which moves by ``tangent``; they are NaN if
    digits are lost.

    ``program`` is that of `programs.extreme_program`.
    """
    outputs = program[4]
    size, slope = fabs(work[outputs[0] + i]), outputs[1] + i
    for k in range(tangent.shape[1]):
        at = outputs[3 + k] + i
        high, low = multiply(work[slope], work[slope + LOW], tangent[0, k], tangent[1, k])
        high, low = add(high, low, work[at], work[at + LOW])
        error = work[at + ERROR] + fabs(tangent[0, k]) * work[slope + ERROR] + fabs(work[slope]) * tangent[2, k]
        found[k] = high if error <= MAX_ERROR * max(fabs(high), size) else nan


@Inner
def fill_extreme(program, work, sign, ends, tangents, shares, found):  # type: ignore[no-untyped-def]
    """Fill the extreme between two places, the largest size of the quantity on a grid, and the derivatives of the
    extreme.

    Parameters
    ----------
    sign : float
        1 for the largest, -1 for the smallest.
    ends : (2, 2) array
        Both places: a row of high doubles, and one of low ones.
    tangents : (2, 3, n) array
        The changes of both places; empty for a lap, which has no ends.
    shares : (k,) array
        The grid.
    found : (n + 2,) array
        Filled with these.
    """
    outputs, has_ends = program[4], tangents.shape[2] > 0
    places, still = np.zeros((2, BLOCK)), np.zeros((3, outputs.size - 3))
    width = ends[0, 1] - ends[0, 0]
    for i in range(BLOCK):
        places[0, i] = ends[0, 0] + width * shares[i]
    if has_ends:
        for part in range(2):
            places[part, 0], places[part, BLOCK - 1] = ends[part, 0], ends[part, 1]
    evaluate_block(program, work, places[0], places[1])
    best, peak, size = 0, -inf, 0.0
    for i in range(BLOCK):
        value = work[outputs[0] + i]
        size = max(size, fabs(value))
        if sign * value > peak:
            best, peak = i, sign * value
    found[0], found[1] = work[outputs[0] + best], size
    outward = sign * work[outputs[1] + best]
    if has_ends and ((best == 0 and outward <= 0.0) or (best == BLOCK - 1 and outward >= 0.0)):
        fill_total(program, work, best, tangents[min(best, 1)], found[2:])
        return
    place, step = places[:, best : best + 1].copy(), inf
    for _ in range(MAX_STEPS):
        if fabs(step) <= LAST_STEP * fabs(width):
            break
        curvature = work[outputs[2] + best]
        if not sign * curvature < 0.0:
            break
        step = -work[outputs[1] + best] / curvature
        place[0, 0], place[1, 0] = place[0, 0] + step, 0.0
        evaluate_block(program, work, place[0], place[1])
        best = 0
    found[0] = work[outputs[0] + best]
    if fabs(step) <= LAST_STEP * fabs(width):
        fill_total(program, work, 0, still, found[2:])


@entry(types.void(PROGRAM, VECTOR, PROGRAM, VECTOR, INTEGER, types.float64, MATRIX, MATRIX), nogil=True)
def fill_extremes(turns, turns_work, extreme, work, kind, sign, launches, found):  # type: ignore[no-untyped-def]
    """Fill the extremes of half of V**2, or of the contact force, with their derivatives; NaN where there are none.

    Parameters
    ----------
    turns, turns_work, extreme, work
        The programs of a turning point and of an extreme, each with its work space.
    kind : int
        LIBRATION or CIRCULATION.
    sign : float
        1 for the largest, -1 for the smallest.
    launches : (m, n + 2) array
        The n variables of each launch, and the turning points of a libration to the accuracy of doubles, or both ends
        of a lap.
    found : (m, n + 2) array
        The extreme, the largest size on the grid, and the derivatives.
    """
    n, swings = launches.shape[1] - 2, kind == LIBRATION
    variables, inputs, ends = np.zeros((3, n)), np.zeros((3, n + 2 + 2 * n)), np.zeros((2, 2))
    tangents, shares = np.zeros((2, 3, n if swings else 0)), WIDTH_SHARES if swings else LAP_SHARES
    for m in range(launches.shape[0]):
        variables[0], found[m], ends[0] = launches[m, :n], nan, launches[m, n:]
        if swings:
            fill_turns(turns, turns_work, variables, launches[m, n:], inputs)
            for i in range(2):
                ends[0, i], ends[1, i] = inputs[0, n + i], inputs[1, n + i]
                tangents[i] = inputs[:, n + 2 + i * n : n + 2 + (i + 1) * n]
        begin(extreme, work, variables)
        fill_extreme(extreme, work, sign, ends, tangents, shares, found[m])


@entry(types.void(PROGRAM, VECTOR, MATRIX, MATRIX), nogil=True)
def fill_ends(turns, turns_work, launches, found):  # type: ignore[no-untyped-def]
    """Fill the derivatives of the lower and then of the upper turning point, with respect to all variables.

    Parameters
    ----------
    turns, turns_work
        The program of a turning point, with its work space.
    launches : (m, n + 2) array
        The n variables of each launch, and its turning points to the accuracy of doubles.
    found : (m, 2*n) array
        Filled with the derivatives.
    """
    n = launches.shape[1] - 2
    variables, inputs = np.zeros((3, n)), np.zeros((3, n + 2 + 2 * n))
    for m in range(launches.shape[0]):
        variables[0] = launches[m, :n]
        fill_turns(turns, turns_work, variables, launches[m, n:], inputs)
        found[m] = inputs[0, n + 2 :]


def launch_gradients(
    formulas: Formulas, quantity: str, launches: Launches, values: Array, rows: tuple[int, ...]
) -> Array:
    """Return the derivatives of a quantity: a row for each launch, NaN where double-double arithmetic does not suffice.

    Parameters
    ----------
    formulas : Formulas
        The model of a generated module.
    quantity : str
        One of COMPILED.
    launches : Launches
        The launches.
    values : array
        The quantity of each launch.
    rows : tuple of int
        The variables of differentiation.

    Returns
    -------
    array
        Of shape (m, k), or (m, 2, k) for turning points.
    """
    if quantity in PERIODS:
        slopes = period_gradients(formulas, launches, values.reshape(-1) / PERIODS[quantity], rows)
        if PERIODS[quantity] != 1.0:
            slopes *= np.where(launches.circulates, 1.0, PERIODS[quantity])[:, np.newaxis]
        return slopes
    if quantity == "turning_points":
        turns, table = turning_point_program(source_of(formulas)), launches.table
        ends = np.empty((len(table), 2, table.shape[1] - 2))

        def work(part: slice) -> None:
            fill_ends(turns.operands, turns.work.copy(), table[part], ends[part].reshape(-1, ends[0].size))

        run_in_threads(work, len(table), MIN_LAUNCHES_PER_THREAD)
        return ends[:, :, list(rows)]
    return _extreme_gradients(formulas, quantity, launches, values)[:, list(rows)]


def _extreme_gradients(formulas: Formulas, quantity: str, launches: Launches, values: Array) -> Array:
    """Return the derivatives of extremes of V or of the contact force with respect to all variables.

    They are also NaN where the extreme differs from that of the sweep, as it may near a pole.
    """
    of_speed, sign = quantity.startswith("v_"), 1.0 if quantity.endswith("_max") else -1.0
    source, table, circulates = source_of(formulas), launches.table, launches.circulates
    turns, program = turning_point_program(source), extreme_program(source, of_speed)
    found = np.full((len(table), table.shape[1]), nan)
    if circulates.any():
        assert formulas.domain_of is not None
        laps = np.broadcast_to(formulas.domain_of(ARRAYS, tuple(launches.lines))[2], circulates.shape)
        begins = np.broadcast_to(launches.lines[-2], circulates.shape)
        table[circulates, -2:] = np.stack([begins, begins + laps], axis=1)[circulates]

    def work(part: slice) -> None:
        programs = (turns.operands, turns.work.copy(), program.operands, program.work.copy())
        for kind in (LIBRATION, CIRCULATION):
            some = np.flatnonzero(circulates[part] == (kind == CIRCULATION)) + part.start
            out = np.empty((some.size, found.shape[1]))
            fill_extremes(*programs, kind, sign, table[some], out)
            found[some] = out

    run_in_threads(work, len(table), MIN_LAUNCHES_PER_THREAD)
    extremes, sizes, slopes = found[:, 0], found[:, 1], found[:, 2:]
    is_same = np.abs(extremes - (0.5 * values**2 if of_speed else values)) <= MAX_DIFFERENCE * sizes
    if of_speed:
        with np.errstate(divide="ignore", invalid="ignore"):
            slopes = np.where(values[:, np.newaxis] == 0.0, 0.0, slopes / values[:, np.newaxis])
    return np.where(is_same[:, np.newaxis], slopes, nan)
