"""Half periods, lap times and turning points of single orbits in double-double arithmetic, for orbits on which doubles
lose digits.

Next to a hilltop a small change of the energy moves the turning point of a body far and changes its time much, so that
the rounding of V**2 in doubles costs more digits the closer the body comes. Few launches of a sweep are so close, and
curves with formulas have a tape for them (`double_double.orbit_time`).
"""

import numpy as np
from numba import types
from numpy.typing import NDArray

from gqm_sym.runtime.compiled.jit import entry
from gqm_sym.runtime.compiled.registers import borrowed
from gqm_sym.runtime.compiled.strided import LAM0, PARAMETERS, V0, element
from gqm_sym.runtime.compiled.types import MATRIX, Array
from gqm_sym.runtime.double_double.orbit_time import MAX_ERROR, find_orbit_time, rules_for
from gqm_sym.runtime.quadrature.trapezoid import CIRCULATION, LIBRATION
from gqm_sym.runtime.sweep.quantities import (
    ANSWERED,
    ANSWERS,
    NOT_PERIODIC,
    PERIOD,
    SPAN_KNOWN,
    TURNING_POINTS,
    UNDECIDED,
    Answers,
)
from gqm_sym.runtime.sweep.single.slow_places import EXACT, RecordedFormulas

# The largest error of a turning point, as a share of the orbit's width, and of the rules for the time, as shares of it:
# the answer is rounded to a double.
MAX_TURN_ERROR, MAX_RULE_ERRORS = 2.0**-54, (1e-19, 1e-19)

RULES = types.UniTuple(MATRIX, 3)


@entry(
    types.void(EXACT, types.int64[:, ::1], types.int64, MATRIX, ANSWERS, types.UniTuple(RULES, 2)),
    nogil=True,
)
def fill_orbits(exact, columns, quantity, spans, answers, rules):  # type: ignore[no-untyped-def]
    """Fill the answer of each launch whose status is SPAN_KNOWN; the status becomes UNDECIDED if double-double
    arithmetic does not suffice.

    Parameters
    ----------
    exact : RecordedFormulas
        The formulas.
    columns : array
        The launches, as `strided.pointers` gives them.
    quantity : int
        HALF_PERIOD, PERIOD or TURNING_POINTS.
    spans : (n, 2) array
        For each launch, the answer to SPANS.
    answers : Answers
        Filled in.
    rules : pair
        The rules for librations and for laps (`orbit_time.rules_for`).
    """
    (address, operations, parts, registers), work, p = exact
    tape, work, p = (address, borrowed(operations), parts, registers), borrowed(work), borrowed(p)
    (nodes, rule, table), (lap_nodes, _, _) = rules
    rule, table = borrowed(rule), borrowed(table)
    half, lap = (borrowed(nodes), rule, table), (borrowed(lap_nodes), rule, table)
    columns, spans, values = borrowed(columns), borrowed(spans), borrowed(answers.values)
    statuses = borrowed(answers.status)
    for k in range(statuses.size):
        if statuses[k] != SPAN_KNOWN:
            continue
        low, high = spans[k, 0], spans[k, 1]
        circulates, direction = high != high, 0
        if circulates and quantity != PERIOD:
            statuses[k] = NOT_PERIODIC
            continue
        if circulates:
            direction = 1 if low > 0.0 else -1
        for row in range(p.shape[1]):
            p[0, row] = element(columns, PARAMETERS + row, k)
        launch = element(columns, LAM0, k), 0.0, element(columns, V0, k), 0.0
        chosen = lap if circulates else half
        found = find_orbit_time(tape, work, p, launch, (low, high), direction, chosen, MAX_RULE_ERRORS)
        duration, lower, upper, _ = found
        if quantity == TURNING_POINTS:
            values[k, 0], values[k, 1] = lower[0], upper[0]
            enough = MAX_TURN_ERROR * (high - low)
            decided = lower[2] <= enough and upper[2] <= enough  # false for NaN
        else:
            values[k, 0] = 2.0 * duration[0] if quantity == PERIOD and not circulates else duration[0]
            decided = duration[2] <= MAX_ERROR * duration[0]
        statuses[k] = ANSWERED if decided else UNDECIDED


def answer_exactly(
    exact: RecordedFormulas, columns: NDArray[np.int64], quantity: int, spans: Array, answers: Answers
) -> None:
    """Call `fill_orbits` for launches whose spans are known."""
    wanted = quantity != TURNING_POINTS
    rules = rules_for(LIBRATION, wanted=wanted), rules_for(CIRCULATION, wanted=wanted)
    fill_orbits(exact, columns, quantity, spans, answers, rules)
