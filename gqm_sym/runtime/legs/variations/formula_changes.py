"""The changes of a motion with losses along a curve with formulas, in one call of compiled code.

The law at the nodes of panels is evaluated in doubles, whose roundings average out. Where runs begin and end, the force
is evaluated in double-double arithmetic, because it may be a small difference there.
"""

from math import fabs, inf

import numpy as np
from numba import types

from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.registers import borrowed
from gqm_sym.runtime.compiled.types import MATRIX, REAL, VECTOR
from gqm_sym.runtime.double_double.interpreter import BLOCK, ROW, call_interpreter
from gqm_sym.runtime.gradients.evaluation import PROGRAM, fill_signed_values_of
from gqm_sym.runtime.gradients.lanes.evaluation import LANE_PROGRAM
from gqm_sym.runtime.legs.leg_record import END, HEADING, START
from gqm_sym.runtime.legs.leg_record import WHOLE as WHOLE_LEG
from gqm_sym.runtime.legs.panels.point import LEAST_V2
from gqm_sym.runtime.legs.panels.polynomials import COUNT
from gqm_sym.runtime.legs.runs.whole_panels import with_panels
from gqm_sym.runtime.legs.variations.chain import CUSP_SHARE, FOLLOWED, follow
from gqm_sym.runtime.legs.variations.divided import MAX_DIVISIONS, divided, joined_law, states_of_parts
from gqm_sym.runtime.legs.variations.equation import (
    MARKS,
    PLACE,
    PLACE_LOW,
    STATE_HEADING,
    WHOLE,
    W,
    lay_panels,
    lay_states,
)

# The largest distance of a motion from the zero of the curve's parameter, in its width, for which places in doubles
# suffice at the nodes of panels.
MAX_DISTANCE = 10.0

# How far from a cusp, as a share of the leg, the ratio of ds/dlam to dW/dlam is its limit, within as large a share.
AHEAD_SHARE = 2.0**-53

# The programs of the law in doubles, of the law in double-double arithmetic, and of ds/dlam and dW/dlam alone, each
# with its work space.
PROGRAMS = types.Tuple((LANE_PROGRAM, VECTOR, PROGRAM, VECTOR, PROGRAM, VECTOR))


@Inner
def fill_in_doubles(program, work, inputs, places, first, found):  # type: ignore[no-untyped-def]
    """Fill the results of a program at places, in double precision, in the last rows.

    Parameters
    ----------
    program, work
        The program (`assembly.LaneProgram.operands`), with its work space.
    inputs : (3, m) array
        The inputs: high and low doubles, and bounds on the errors.
    places : (k, n) array
        The coordinates of the places.
    first : int
        The first place for which results are needed.
    found : (m, n) array
        Its last rows are filled with the results.
    """
    work, places, found = borrowed(work), borrowed(places), borrowed(found)
    count, row, lanes = places.shape[1], found.shape[0] - program[5].size, min(BLOCK, places.shape[1] - first)
    for k in range(inputs.shape[1]):
        for part in range(3):
            register, value = work[k * ROW + part * BLOCK :], inputs[part, k]
            for i in range(lanes):
                register[i] = value
    call_interpreter(program[0][0], program[1], 0, program[1].shape[0], work, lanes)
    for start in range(first, count, BLOCK):
        n = min(BLOCK, count - start)
        for k in range(places.shape[0]):
            register, line = work[program[4][k] :], places[k, start:]
            for i in range(n):
                register[i] = line[i]
        call_interpreter(program[0][1], program[2], 0, program[2].shape[0], work, n)
        for k in range(program[5].size):
            register, line = work[program[5][k] :], found[row + k, start:]
            for i in range(n):
                line[i] = register[i]


@Inner
def exact_values(program, work, inputs, states):  # type: ignore[no-untyped-def]
    """Return the results of a program in states, computed in double-double arithmetic and rounded to doubles."""
    n, found = states.shape[1], np.empty((program[4].size, 1, states.shape[1]))
    places = np.zeros((4, n))
    for i in range(n):
        places[0, i], places[1, i], places[2, i] = states[PLACE, i], states[PLACE_LOW, i], max(states[W, i], LEAST_V2)
    fill_signed_values_of(program, work, inputs, places, states, found)
    return found.reshape(found.shape[0], n)


@Inner
def is_far(states, marks):  # type: ignore[no-untyped-def]
    """Return whether doubles do not resolve the places of a motion, because they are so near to each other."""
    low, high = inf, -inf
    for i in range(marks):
        low, high = min(low, states[PLACE, i]), max(high, states[PLACE, i])
    return MAX_DISTANCE * (high - low) < max(-low, high)


@Inner
def law_on_panels(programs, inputs, states, marks, far):  # type: ignore[no-untyped-def]
    """Return the law in states, as far as the programs have it; in the first ``marks`` of them, of which nothing else
    is needed, ds/dlam and dW/dlam have all digits, and in all states if they are ``far`` from zero.
    """
    doubles, doubles_work, exact, exact_work, rates, rates_work = programs
    if far:
        return exact_values(exact, exact_work, inputs, states)
    parameters = inputs.shape[1] - 2
    found = np.empty((2 * parameters + 5, states.shape[1]))
    fill_in_doubles(doubles, doubles_work, inputs[:, :parameters], states, marks, found)
    if marks > 0:
        both = exact_values(rates, rates_work, inputs, states[:, :marks].copy())
        found[0, :marks], found[parameters + 2, :marks] = both[0], both[1]
    return found


@Inner
def take_from_ahead(programs, inputs, record, states, law):  # type: ignore[no-untyped-def]
    """Replace ds/dlam and dW/dlam at a launch from a cusp, where both vanish, by those a little ahead, whose ratio is
    the limit of theirs.
    """
    parameters = inputs.shape[1] - 2
    ahead = states[:, :1].copy()
    ahead[PLACE_LOW, 0] += record[HEADING] * AHEAD_SHARE * fabs(record[END] - record[START])
    both = exact_values(programs[4], programs[5], inputs, ahead)
    law[0, 0], law[parameters + 2, 0] = both[0, 0], both[1, 0]


@Inner
def panelled(records, begins):  # type: ignore[no-untyped-def]
    """Return the records of runs with panels in place of rows of whole legs, and the indices at which they begin."""
    runs, is_whole = begins.size, False
    for k in range(runs):
        is_whole = is_whole or records[begins[k] + WHOLE_LEG] > 0.0
    if not is_whole:
        return records, begins
    parts, total = [records[:0]], 0
    for k in range(runs):
        record = records[begins[k] : begins[k + 1] if k + 1 < runs else records.size]
        parts.append(with_panels(record) if record[WHOLE_LEG] > 0.0 else record)
        total += parts[k + 1].size
    line, starts, at = np.empty(total), np.empty(runs, dtype=np.int64), 0
    for k in range(runs):
        starts[k], size = at, parts[k + 1].size
        line[at : at + size] = parts[k + 1]
        at += size
    return line, starts


@entry(
    types.Tuple((WHOLE, MATRIX, FOLLOWED))(
        *(VECTOR, WHOLE, PROGRAMS, MATRIX, types.Tuple((REAL, REAL, types.boolean)), VECTOR, VECTOR, types.boolean)
    ),
    checked=False,
)
def changes_along_formulas(records, begins, programs, inputs, launch, moves, lap, timed):  # type: ignore[no-untyped-def]
    """Return the panels of runs (`equation.lay_panels`), and the changes on them (`chain.follow`).

    Parameters
    ----------
    records, begins
        As for `equation.lay_panels`; the records may have rows of whole legs.
    programs : PROGRAMS
        `programs.law_in_doubles`, `programs.law_program` and `programs.rates_program`.
    inputs : (3, n + 2) array
        The inputs of the latter two; the last two are set here.
    launch : (float, float, bool)
        The launch speed, the chosen direction, and whether the law may have kinks within panels.
    moves, lap, timed
        As for `chain.follow`. Without changes of times the first program is that without ds/dlam.
    """
    records, begins = panelled(records, begins)
    first, panels = lay_panels(records, begins)
    states, (v0, direction, is_rough) = lay_states(records, begins, first, panels), launch
    marks, heading, other_force = MARKS * begins.size, records[begins[0] + HEADING], 0.0
    far = is_far(states, marks)
    law = law_on_panels(programs, inputs, states, marks, far)
    for _ in range(MAX_DIVISIONS if is_rough else 0):
        # The row of F_W is the last but that of the parameters.
        first, panels, before = divided(first, panels, law[law.shape[0] - inputs.shape[1] + 1, marks:])
        of_parts = states_of_parts(panels, before)
        if of_parts.size == 0:
            break
        law = joined_law(law, marks, law_on_panels(programs, inputs, of_parts, 0, far), before)
    if timed and v0 == 0.0 and law[0, 0] <= CUSP_SHARE * law[0, marks + COUNT // 2]:
        take_from_ahead(programs, inputs, records[begins[0] :], states, law)
    elif v0 == 0.0 and direction != heading:
        turned = states[:, :1].copy()
        turned[STATE_HEADING, 0], turned[W, 0] = -heading, 0.0
        other_force = exact_values(programs[4], programs[5], inputs, turned)[1, 0]
    laid = records, begins, first, panels
    thrown = v0, direction, other_force
    return first, panels, follow(laid, law, moves, thrown, lap, np.empty(0), timed)
