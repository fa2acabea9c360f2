"""Compiled code for gradients of many half periods that are pi over an arithmetic-geometric mean."""

from math import fabs

from numba import types

from gqm_sym.runtime.compiled.intrinsics import choose
from gqm_sym.runtime.compiled.jit import entry
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, VECTOR
from gqm_sym.runtime.double_double.interpreter import BLOCK, call_interpreter
from gqm_sym.runtime.gradients.evaluation import PROGRAM
from gqm_sym.runtime.gradients.lanes.evaluation import (
    ANSWERED,
    LANE_PROGRAM,
    OPEN,
    WIDTH,
    fill_inputs,
    fill_turns,
    rows_of,
)

# The largest relative difference of two numbers whose arithmetic-geometric mean is their mean, as double precision
# needs it.
MAX_DIFFERENCE = 3e-9


@entry(
    types.void(
        *(PROGRAM, VECTOR, LANE_PROGRAM, VECTOR, INTEGER),
        *(MATRIX, types.Tuple((MATRIX, types.int8[::1]))),
    ),
    nogil=True,
)
def fill_mean_gradients(turn, turn_work, program, work, inputs, launches, answers):  # type: ignore[no-untyped-def]
    """Fill the derivatives of half periods that are pi over an arithmetic-geometric mean.

    The arguments are as for `evaluation.fill_lane_gradients`, except that the orbit's program is
    `programs.mean_program`, and that ``inputs`` is the number of columns of the launches that are its inputs.
    """
    found, states = answers
    coordinates, outputs = program[4], program[5]
    first = outputs.size - found.shape[1]
    for start in range(0, launches.shape[1], BLOCK):
        size = min(BLOCK, launches.shape[1] - start)
        some, lanes = (launches, start, size), -(-size // WIDTH) * WIDTH
        fill_inputs(work, inputs, some, lanes)
        fill_turns(turn, turn_work, some, lanes, inputs, work)
        call_interpreter(program[0][0], program[1], 0, program[1].shape[0], work, lanes)
        one = rows_of(work, coordinates[0])[0]
        one[:lanes] = 1.0
        call_interpreter(program[0][1], program[2], 0, program[2].shape[0], work, lanes)
        known = rows_of(work, outputs[0])[0]
        for i in range(lanes):
            known[i] = choose(fabs(known[i]) <= MAX_DIFFERENCE, 1.0, 0.0)
        for j in range(1, first):
            loss = rows_of(work, outputs[j])[0]
            for i in range(lanes):
                known[i] = choose(loss[i] <= 0.0, known[i], 0.0)
        for j in range(found.shape[1]):
            values = rows_of(work, outputs[first + j])[0]
            for i in range(size):
                found[start + i, j] = values[i]
        for i in range(size):
            states[start + i] = ANSWERED if known[i] == 1.0 else OPEN
