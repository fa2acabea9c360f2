"""The derivative of a time, put together from integrals and from what changes at the launch and at the place."""

from math import fabs, sqrt

from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.double_double.interpreter import ROW, call_interpreter
from gqm_sym.runtime.gradients.lanes.arrivals.integrals import SCALE, VALUE
from gqm_sym.runtime.gradients.lanes.arrivals.programs import DS, MOVED, SHIFTS, SLOPE, SQUARE
from gqm_sym.runtime.gradients.lanes.arrivals.weights import FLIP, LAUNCH_SIGN, PLACE_SIGN
from gqm_sym.runtime.gradients.lanes.evaluation import rows_of

# The largest bound on the rounding errors of the derivatives of phases, as a share of the terms of a sum.
MAX_ERROR = 1e-15

# The kinds of variables: a run-time parameter, and the place and the speed of the launch.
PARAMETER, LAM0, V0 = range(3)


@Inner
def evaluate_at(program, work, places, column, lanes, found):  # type: ignore[no-untyped-def]
    """Fill the results of a program at places, which are a column, and the bounds on their errors."""
    high, low, error = rows_of(work, program[3] * ROW)
    for i in range(lanes):
        high[i], low[i], error[i] = places[min(i, places.shape[0] - 1), column], 0.0, 0.0
    call_interpreter(program[0], program[1], program[2], program[1].shape[0], work, lanes)
    for j in range(program[4].size):
        values, _, errors = rows_of(work, program[4][j])
        for i in range(lanes):
            found[j, 0, i], found[j, 1, i] = values[i], errors[i]


@Inner
def total_change(which, i, v0, here, there, state, integrals):  # type: ignore[no-untyped-def]
    """Return the derivative of a time of a libration, and the bound on its error as a share of its terms.

    Parameters
    ----------
    which : (int, int)
        The kind of the variable, and the number of its derivatives among those of the program.
    i : int
        The number of the orbit.
    v0, here, there, state, integrals
        As for `fill_phases` and `integrate`.
    """
    (kind, j), rests = which, v0 == 0.0
    along = state[FLIP, i] * state[PLACE_SIGN, i] * there[DS, 0, i] / sqrt(there[SQUARE, 0, i])
    speed = 1.0 if kind == V0 or rests else v0
    from_launch = state[FLIP, i] * state[LAUNCH_SIGN, i] * here[DS, 0, i] / speed
    factor = here[SLOPE, 0, i] if kind == LAM0 else (v0 if kind == V0 else 1.0)
    row = MOVED if kind == LAM0 else SHIFTS + j
    inside, at_place = factor * integrals[1 + j, VALUE, i], factor * along * there[SHIFTS + j, 0, i]
    # A launch at rest is an end of the orbit, except for other speeds.
    from_launch = 0.0 if rests and kind != V0 else from_launch
    at_launch = from_launch * here[row, 0, i]
    error = fabs(factor * along) * there[SHIFTS + j, 1, i] + fabs(from_launch) * here[row, 1, i]
    error += 0.5 * fabs(at_place) * there[SQUARE, 1, i] / there[SQUARE, 0, i]
    size = fabs(factor) * integrals[1 + j, SCALE, i] + fabs(at_place) + fabs(at_launch)
    return inside + (at_place + at_launch), error / size if size > 0.0 else error
