"""Times on the gaps next to a turn, by the rows kept of them.

Over the distance d from a turn, ``W (1 + E)`` is the mean of exp(q) P between the turn and there, up to its sign. The
means are those of the force on the part of the gap next to the turn. They are not derived from the means from the start
of the gap that are kept: the difference of these, divided by the distance, has 7 times their rounding errors where the
turn is in the middle of the gap, and 70 times or more where it is at the end. So V**2 has all its digits next to the
turn, and the time is an integral over the root of the distance from there, as in `runs.arrival`. Where friction almost
balances the weight, the rows kept of the gap do not give the force to enough digits, and no time is returned.

On the gap before that with the turn, or after it, time is not resolved by a polynomial of the place, because the turn
is near, but by one in the root of the distance from there. There ``W (1 + E)`` is its value at the end of the gap that
is next to the turn, and the distance e from that end times the mean of exp(q) P on it.
"""

from math import nan, sqrt

import numpy as np

from gqm_sym.runtime.arithmetic.matrices import multiply
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import on_stack, over_rows
from gqm_sym.runtime.legs.gaps.data import NOISE_OF_FORCE, read_friction_rows, read_gained, shorten, solve_on_rows
from gqm_sym.runtime.legs.panels.equation import (
    DS,
    EXPM1_Q,
    FORCE,
    GRADED,
    MEAN,
    N0,
    NODES,
    OFFSET,
    Q_RATE,
    SERIES,
    SPEED,
    TAILS,
    TIME_RATE,
    W_FACTOR,
    P,
    W,
    copy,
    damped_row,
    linear_row,
    product,
)
from gqm_sym.runtime.legs.panels.polynomials import (
    COUNT,
    WIDE,
    arrival_weights,
    extent,
    series_at,
    size_of,
    to_coefficients,
    to_means,
)
from gqm_sym.runtime.legs.panels.resolution import examine

to_time = multiply(arrival_weights(COUNT))

# The largest number of gaps before that with a turn, and the room for the series of M, E and ds on a gap.
GAPS_BEFORE, ROOM_FOR_SERIES = 3, 3 * WIDE
series_store = on_stack(GAPS_BEFORE * ROOM_FOR_SERIES)

beside_turn_row = over_rows(lambda mean, expm1, sign: sign * mean / (1.0 + expm1), WIDE)
rate_row = over_rows(lambda ds, factor, h: ds * np.sqrt(h / factor), WIDE)
distance_row = over_rows(lambda y, first, rise: (rise * y) * (2.0 * first + rise * y), WIDE)
from_end_row = over_rows(lambda e, mean, expm1, v2, sign: (v2 + sign * e * mean) / (1.0 + expm1), WIDE)
root_rate_row = over_rows(lambda ds, root, w: 2.0 * root * ds / np.sqrt(w), WIDE)


@Inner
def fill_beside_turn(turn, step, work):  # type: ignore[no-untyped-def]
    """Fill the rows Q_RATE and W_FACTOR with ds and with W over the distance from a turn, on the part of a gap from the
    share ``turn`` of it to the share ``turn + step``, at the nodes from the turn on; return the mean force on it.
    """
    linear_row(work, GRADED, NODES, 4.0 * turn - 2.0, 4.0 * step)
    for row, to in ((FORCE, SPEED), (DS, Q_RATE), (EXPM1_Q, TIME_RATE)):
        to_coefficients(work, row, work, SERIES)
        series_at(work, to, GRADED, SERIES)
    to_means(work, SPEED, work, P)
    beside_turn_row(work, W_FACTOR, P, TIME_RATE, 1.0 if step > 0.0 else -1.0)
    return work[P + COUNT]


@Inner
def are_rates_resolved(h, work):  # type: ignore[no-untyped-def]
    """Fill the row TIME_RATE on a part next to a turn that is ``h`` long, and return whether it is resolved, and the
    force much larger than its rounding error.
    """
    if not extent(work, W_FACTOR)[0] > NOISE_OF_FORCE * size_of(work, N0):
        return False
    rate_row(work, TIME_RATE, Q_RATE, W_FACTOR, h)
    return examine(work, TIME_RATE, size_of(work, TIME_RATE))[2]


@Inner
def time_to_turn(width, share, work):  # type: ignore[no-untyped-def]
    """Return the time from the start of a gap to a turn at a share of its width, and V**2 at the start, given the rows
    DS, EXPM1_Q, FORCE and N0; the time is NaN if it is not resolved.
    """
    v2 = -width * share * fill_beside_turn(share, -share, work)
    if not are_rates_resolved(width * share, work):
        return nan, v2
    to_time(work, TIME_RATE, work, TAILS)
    return work[TAILS], v2


@Inner
def reverse(work, out, row):  # type: ignore[no-untyped-def]
    """Fill a row with the values at the nodes of another one in the opposite order."""
    for j in range(COUNT):
        work[out + j] = work[row + COUNT - 1 - j]


@Inner
def keep_series(store, k, is_ahead, work):  # type: ignore[no-untyped-def]
    """Keep the series of E and ds on a gap, and that of the mean of exp(q) P from its start, or else from its end, as
    number k, with E at its end and the mean over it.
    """
    at, last, mean, means = k * ROOM_FOR_SERIES, work[EXPM1_Q + COUNT], work[MEAN + COUNT], MEAN
    if not is_ahead:
        reverse(work, P, FORCE)
        to_means(work, P, work, Q_RATE)
        reverse(work, P, Q_RATE)
        means = P
    for j, row in enumerate((means, EXPM1_Q, DS)):
        to_coefficients(work, row, work, SERIES)
        copy(store, at + j * WIDE, work, SERIES)
    store[at + COUNT], store[at + WIDE + COUNT] = last, mean


@Inner
def lay_series(store, at, out, work):  # type: ignore[no-untyped-def]
    """Fill a row with a series that is kept, at the places in the row GRADED."""
    copy(work, SERIES, store, at)
    series_at(work, out, GRADED, SERIES)


@Inner
def time_near_turn(far, width, v2, is_ahead, store, k, work):  # type: ignore[no-untyped-def]
    """Return the time over the gap number k that begins (``is_ahead``) or ends at the distance ``far`` from a turn,
    where V**2 is ``v2``, and V**2 at its start; the time is NaN if it is not resolved.
    """
    first, at = sqrt(far), k * ROOM_FOR_SERIES
    rise, step = width / (sqrt(far + width) + first), 4.0 / width
    distance_row(work, FORCE, NODES, first, rise)
    linear_row(work, GRADED, FORCE, -2.0 if is_ahead else 2.0, step if is_ahead else -step)
    lay_series(store, at + WIDE, TIME_RATE, work)
    lay_series(store, at + 2 * WIDE, Q_RATE, work)
    lay_series(store, at, SPEED, work)
    end = v2 if is_ahead else v2 * (1.0 + store[at + COUNT])  # E is 0 at the start
    from_end_row(work, W_FACTOR, FORCE, SPEED, TIME_RATE, end, 1.0 if is_ahead else -1.0)
    start = v2 if is_ahead else end - width * store[at + WIDE + COUNT]
    if not extent(work, W_FACTOR)[0] > 0.0:
        return nan, start
    linear_row(work, FORCE, NODES, first, rise)
    root_rate_row(work, TIME_RATE, Q_RATE, FORCE, W_FACTOR)
    fine = examine(work, TIME_RATE, size_of(work, TIME_RATE))[2]
    return (rise * work[TAILS + 6] if fine else nan), start


@Inner
def leave_turn(forces, to, width, gaps, at, work):  # type: ignore[no-untyped-def]
    """Return the time from a turn in a gap at the distance ``to`` from its end, to the end, and V**2 there, and fill
    the row W; the time is NaN if it is not resolved.
    """
    share, begin = to / width, (width - to) / width
    if forces.linear:
        read_gained(width, gaps, at, work)
        fill_beside_turn(begin, share, work)
    else:
        read_friction_rows(gaps, at, work)
        shorten(begin, share, work)
        if not solve_on_rows(forces, 0.0, to, work):
            return nan, nan
        damped_row(work, W_FACTOR, MEAN, EXPM1_Q)
        copy(work, Q_RATE, work, DS)
    product(work, OFFSET, NODES, to)
    product(work, W, W_FACTOR, OFFSET)
    if not are_rates_resolved(to, work):
        return nan, nan
    to_time(work, TIME_RATE, work, TAILS)
    return work[TAILS], work[W + COUNT]
