"""The errors of the force along a leg in doubles, where terms of it may cancel.

Double-double arithmetic has a running bound on the error of each number, which grows with the unit of rounding.
"""

from math import fabs, inf

import numpy as np
from numba import types

from gqm_sym.runtime.arithmetic.doubledouble import ULP
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.registers import borrowed
from gqm_sym.runtime.compiled.types import MATRIX, REAL, VECTOR
from gqm_sym.runtime.double_double.arithmetic import UNIT
from gqm_sym.runtime.gradients.evaluation import PROGRAM, fill_signed_values_of
from gqm_sym.runtime.legs.leg_record import (
    AHEAD,
    BACK,
    COLUMNS,
    END,
    HALF_C,
    HEAD,
    HEADING,
    NORMAL_LOAD,
    RIGHT,
    START,
)
from gqm_sym.runtime.legs.panels.point import LEAST_V2
from gqm_sym.runtime.legs.panels.polynomials import COUNT

# The ratio of the rounding errors of doubles to those of double-double arithmetic.
ROUNDING_RATIO = 0.5 * ULP / UNIT

# The number of places of a panel at which errors are found: both ends and the middle.
PLACES = 3


@Inner
def fill_places(record, origin, sense, half_c, panels, k, states):  # type: ignore[no-untyped-def]
    """Fill the columns of ``states`` for panels of one half of a leg, from the k-th panel of the leg on.

    ``panels`` are the position of the first of them in the record, and their number.
    """
    (begin, count), left = panels, 0.0
    for i in range(count):
        at = begin + i * COLUMNS
        right = record[at + RIGHT]
        for j in range(PLACES):
            w = left if j == 0 else (0.5 * (left + right) if j == 1 else right)
            column = PLACES * (k + i) + j
            states[0, column] = origin + sense * (w * (w + 2.0 * half_c) if half_c < inf else w)
            states[1, column], states[2, column], states[3, column] = 0.0, LEAST_V2, record[HEADING]
            states[4, column] = 1.0 if record[at + NORMAL_LOAD + COUNT // 2] > 0.0 else -1.0
        left = right


@entry(VECTOR(PROGRAM, VECTOR, MATRIX, types.boolean, REAL, VECTOR), checked=False)
def force_errors_on(program, work, inputs, by_field, share, record):  # type: ignore[no-untyped-def]
    """Return the errors of dW/dlam of a body at rest on the panels of a leg, beginning with those from its start.

    They are errors by rounding, and by the rounding of the place; each is the largest one at three places of a panel,
    and 0 if it is not known.

    Parameters
    ----------
    program, work
        `programs.force_program`, and its work space.
    inputs : (3, m) array
        Its inputs (`evaluation.fill_means`).
    by_field : bool
        Whether the leg tends to an equilibrium, so that it has a field in place of panels from its end.
    share : float
        The errors are returned as multiples of this number.
    record : array
        The record of the leg (`leg_record`).
    """
    address, operations, first, count, outputs = program
    program = (address, borrowed(operations), first, count, borrowed(outputs))
    work, inputs, record = borrowed(work), borrowed(inputs), borrowed(record)
    ahead, v = int(record[AHEAD]), record[HEADING]
    back = 0 if by_field else int(record[BACK])
    errors, states = np.empty(ahead + int(record[BACK])), np.empty((5, PLACES * (ahead + back)))
    fill_places(record, record[START], v, record[HALF_C], (HEAD, ahead), 0, states)
    fill_places(record, record[END], -v, 0.0, (HEAD + ahead * COLUMNS, back), ahead, states)
    places, found = np.zeros((4, states.shape[1])), np.empty((2, 3, states.shape[1]))
    places[0], places[2] = states[0], states[2]
    fill_signed_values_of(program, work, inputs, places, states, found)
    for k in range(errors.size):
        errors[k] = 0.0
        for i in range(PLACES * k, min(PLACES * (k + 1), states.shape[1])):
            error = ROUNDING_RATIO * found[0, 2, i] + 0.5 * ULP * fabs(states[0, i] * found[1, 0, i])
            if errors[k] < error < inf:
                errors[k] = error
        errors[k] /= share
    return errors
