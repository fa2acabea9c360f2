"""A batch of orbits: an array with a row for each quantity and a column for each orbit.

The run-time parameters are stored with it, a row each. Every step over a batch is a loop over the columns without
branches, which vectorises. Columns fill whole registers; the last orbit is repeated to fill the last one.

==================== ==================================================================== ======================
row                  meaning                                                              used by
==================== ==================================================================== ======================
INDEX                index of the launch in the caller's arrays                           all
SUM                  sum of the time integrand over all nodes so far                      time
REST                 what rounding took from that sum                                     time
VALUE                the mean of the time integrand by the last level of nodes            time
CHANGE               relative change of the time by that level                            time
LACKING              what that sum lacks at the first nodes by values of the integrand in  time
                     double-double arithmetic
FACTOR_LOW           smallest value of V**2's regular factor at the nodes                 time
FACTOR_HIGH          its largest value                                                    time
FACTOR_AT_TURN       its smallest value at turning points that are rounded                 time
OFFSET_LOW           offset of the lower end of the orbit from the launch place           time, proof
OFFSET_HIGH          offset of the upper end                                              time, proof
END_LOW, END_HIGH    both ends as values of the curve's parameter                         time of librations
LAUNCH_PLACE         the launch place                                                     all
LAUNCH_V2            V**2 at launch                                                       all
HALF_WIDTH           half the orbit's width if it is known to more digits than its ends,   time about axes
                     otherwise NaN
HALF_REST            what rounding took from it                                            time about axes
SEARCH_DIRECTION     the sign of the direction in which is searched; 0 for none           search
SEARCH_LENGTH        how far the search goes at most                                      search
LENGTH_BEHIND        how far it goes the other way; CLOSED on a closed curve              search
STATE                SEEKING, FOUND or NOWHERE                                            search, proof
BRACKET_LOW          distance up to which V**2 > 0 is known of Newton's method            search
BRACKET_HIGH         smallest distance at which V**2 < 0 is known, or inf                 search
TRIAL                distance that Newton's method tries next                             search
ZERO                 distance of the zero of V**2 ahead                                   search
AXIS_OFFSET          offset of the launch from the axis of its own well, with one         search
                     rounding; NaN if there is no such axis
AXIS_DISTANCE        distance to the axis of symmetry that the orbit may have             search, proof
AXIS_SPACING         distance from one axis to the next, 0 if there is only one           search
AXIS_NUMBER          how many such distances that axis is from the one that is known      search
ZERO_BEHIND          distance of the zero of V**2 behind; NaN while it is not known       search
V2_REST              what rounding took from V**2 at launch                               search
CHECK_LOW,           V**2's regular factor at the nodes in CHECKED from double-double      time
CHECK_HIGH           arithmetic; NaN if that is not known
LEVEL, LEVEL_REST    U + V**2/2, as two doubles                                           exact time
LACK_LOW, LACK_HIGH  what OFFSET_LOW and OFFSET_HIGH lack as doubles                      exact time
==================== ==================================================================== ======================

After its first two levels the quadrature in doubles needs only the rows before TIME_ROWS.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import borrowed
from gqm_sym.runtime.compiled.types import Array

# The number of orbits in a batch, so that its arrays stay in the first-level cache; and the largest number of orbits in
# a register.
BATCH, LANES = 128, 8

# The largest number of orbits that wait: fewer than a batch, and another one.
CAPACITY = 2 * BATCH

INDEX, SUM, REST, VALUE, CHANGE, LACKING, FACTOR_LOW, FACTOR_HIGH, FACTOR_AT_TURN, OFFSET_LOW, OFFSET_HIGH = range(11)
END_LOW, END_HIGH, LAUNCH_PLACE, LAUNCH_V2, HALF_WIDTH, HALF_REST, SEARCH_DIRECTION, SEARCH_LENGTH = range(11, 19)
LENGTH_BEHIND, STATE, BRACKET_LOW, BRACKET_HIGH, TRIAL = range(19, 24)
ZERO, AXIS_OFFSET, AXIS_DISTANCE, AXIS_SPACING, AXIS_NUMBER, ZERO_BEHIND, V2_REST = range(24, 31)
CHECK_LOW, CHECK_HIGH, LEVEL, LEVEL_REST, LACK_LOW, LACK_HIGH, ROWS = range(31, 38)
TIME_ROWS, AXIS_LIBRATION_ROWS = SEARCH_DIRECTION, OFFSET_LOW

# The LENGTH_BEHIND of a closed curve: both zeros lie within one period.
CLOSED = -1.0

# The states of a search.
SEEKING, FOUND, NOWHERE = 0.0, 1.0, 2.0


class Orbits(NamedTuple):
    """Orbits side by side.

    Attributes
    ----------
    size : int
        The number of columns that are filled, a multiple of LANES.
    rows : (ROWS, BATCH) array
        A row for each quantity.
    params : array
        The rows of run-time parameters and of invariants, ``size`` numbers each, one after the other.
    """

    size: int
    rows: Array
    params: Array


class Waiting(NamedTuple):
    """Orbits of several batches that wait until they are enough for blocks in double-double arithmetic.

    Attributes
    ----------
    number : (1,) int array
        How many they are.
    rows : (ROWS, CAPACITY) array
        A row for each quantity.
    params : array
        The rows of run-time parameters, CAPACITY numbers each.
    """

    number: NDArray[np.int64]
    rows: Array
    params: Array


class OrbitKind(NamedTuple):
    """The common data of the orbits of a batch.

    Attributes
    ----------
    kind : int
        LIBRATION, CIRCULATION, AXIS_LIBRATION or AGM_LIBRATION.
    mirrored : bool
        Whether each orbit is even about an axis of symmetry.
    proved : bool
        Whether the turning points need no further proof.
    about_axis : bool
        Whether each orbit is about the axis of symmetry of `Wells`.
    shared : bool
        Whether a proof may serve all orbits of a well.
    """

    kind: int
    mirrored: bool
    proved: bool
    about_axis: bool
    shared: bool


class Scratch(NamedTuple):
    """The work space of a batch.

    Attributes
    ----------
    param_count : int
        The number of run-time parameters.
    layout : (int, int, int)
        The number of values that `orbit_invariants` and `integrand_invariants` of the module fill for an orbit, and the
        row of the parameter beta if the inertia is 1 + beta, else -1.
    chosen, others : int arrays
        Lists of columns.
    work : (13, BATCH) array
        Rows for intermediate results.
    ends : (6, BATCH) array
        Rows for orbits whose ends are found in double-double arithmetic.
    careful : bool
        Whether these are launches that batches left before.
    exact : RecordedFormulas
        The module's formulas as a tape; empty if there is none.
    columns : array
        The launches, as `strided.pointers` gives them.
    rates : array
        A row for each node of a series of dt/dphi; none if no arrivals are asked for.
    """

    param_count: int
    layout: tuple[int, int, int]
    chosen: NDArray[np.int64]
    others: NDArray[np.int64]
    work: Array
    ends: Array
    careful: bool
    exact: Any
    columns: NDArray[np.int64]
    rates: Array


@Inner
def borrowed_orbits(orbits):  # type: ignore[no-untyped-def]
    """Return the orbits with arrays whose references numba does not count."""
    return Orbits(orbits.size, borrowed(orbits.rows), borrowed(orbits.params))


@Inner
def waiting_room(param_count):  # type: ignore[no-untyped-def]
    """Return space for orbits that wait."""
    return Waiting(np.zeros(1, dtype=np.int64), np.empty((ROWS, CAPACITY)), np.empty(param_count * CAPACITY))


@Inner
def borrowed_waiting(waiting):  # type: ignore[no-untyped-def]
    """Return orbits that wait with arrays whose references numba does not count."""
    return Waiting(borrowed(waiting.number), borrowed(waiting.rows), borrowed(waiting.params))


@Inner
def contains_positive(row):  # type: ignore[no-untyped-def]
    """Return whether a number in a row is positive."""
    found = False
    for v in row:
        found |= v > 0.0
    return found


@Inner
def has_tape(scratch):  # type: ignore[no-untyped-def]
    """Return whether the module's formulas are known as a tape."""
    return scratch.exact.work.size > 0


@Inner
def contains(row, value):  # type: ignore[no-untyped-def]
    """Return whether a value is in a row. This is a loop of its own, because a loop that also counts is not
    vectorised.
    """
    found = False
    for v in row:
        found |= v == value
    return found


@Inner
def gather(orbits, param_count, columns, number, target, row_count):  # type: ignore[no-untyped-def]
    """Copy ``number`` columns and their parameters to ``target``; return the number of columns that this fills."""
    rows, params, n = orbits.rows, orbits.params, orbits.size
    to_rows, to_params, full = target.rows, target.params, -(-number // LANES) * LANES
    for row in range(row_count):
        for j in range(number):
            to_rows[row, j] = rows[row, columns[j]]
        for j in range(number, full):
            to_rows[row, j] = to_rows[row, number - 1]
    for row in range(param_count):
        for j in range(number):
            to_params[row * full + j] = params[row * n + columns[j]]
        for j in range(number, full):
            to_params[row * full + j] = to_params[row * full + number - 1]
    return full


@Inner
def append(orbits, param_count, columns, number, waiting):  # type: ignore[no-untyped-def]
    """Append ``number`` columns and their parameters to orbits that wait."""
    first, n = waiting.number[0], orbits.size
    for row in range(ROWS):
        for j in range(number):
            waiting.rows[row, first + j] = orbits.rows[row, columns[j]]
    for row in range(param_count):
        for j in range(number):
            waiting.params[row * CAPACITY + first + j] = orbits.params[row * n + columns[j]]
    waiting.number[0] = first + number


@Inner
def shrink(orbits, param_count, columns, number, row_count):  # type: ignore[no-untyped-def]
    """Keep only ``number`` columns, listed in ascending order; return the remaining orbits."""
    n = orbits.size
    if number != n:
        n = gather(orbits, param_count, columns, number, orbits, row_count)
    return Orbits(n, orbits.rows, orbits.params)


@Inner
def partition(state, found, others):  # type: ignore[no-untyped-def]
    """List the columns whose state is FOUND, and the others; return the numbers of both."""
    if not contains(state, NOWHERE):
        for j in range(state.size):
            found[j] = j
        return state.size, 0
    found_count, other_count = 0, 0
    for j in range(state.size):
        found[found_count] = others[other_count] = j
        found_count += state[j] == FOUND
        other_count += state[j] != FOUND
    return found_count, other_count
