"""Times on the gaps next to a turn, by the rows kept of them.

With the mean M of exp(q) P from the start of a gap up to the share y of its width h, ``W (1 + E) = v2 + h y M``. Up to
a turn at y = z this is ``h (z - y)`` times ``-(M(z) + y (M(z) - M(y))/(z - y))``, in which nothing is subtracted: the
quotient is a polynomial that follows from the series of M. So V**2 has all its digits next to the turn, and the time
is an integral over the root of the distance from there, as in `runs.arrival`. After a turn the same holds with the
other sign.

On the gap before that with the turn, or after it, time is not resolved by a polynomial in y, because the turn is near,
but by one in the root of the distance from there. From its end W is ``W(1) (1 + E(1)) - e (M(1) + y (M(1) - M(y))/(1 -
y))`` over 1 + E, at the distance e from the end.
"""

from math import nan, sqrt

import numpy as np

from gqm_sym.runtime.arithmetic.matrices import multiply
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import on_stack, over_rows
from gqm_sym.runtime.legs.gaps.data import read_friction_rows, read_gained, shorten, solve_on_rows
from gqm_sym.runtime.legs.panels.equation import (
    DS,
    EXPM1_Q,
    FORCE,
    GRADED,
    MEAN,
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
)
from gqm_sym.runtime.legs.panels.resolution import examine

# From the values at the nodes, which are as far from the end as others are from the start.
to_time_after, to_time_before = multiply(arrival_weights(COUNT)), multiply(arrival_weights(COUNT)[::-1])

# The largest number of gaps before that with a turn, and the room for the series of M, E and ds on a gap.
GAPS_BEFORE, ROOM_FOR_SERIES = 3, 3 * WIDE
series_store = on_stack(GAPS_BEFORE * ROOM_FOR_SERIES)

beside_turn_row = over_rows(lambda quotient, y, expm1, mean, twice: (mean + twice * y * quotient) / (1.0 + expm1), WIDE)
rate_row = over_rows(lambda ds, factor, h: ds * np.sqrt(h / factor), WIDE)
distance_row = over_rows(lambda y, first, rise: (rise * y) * (2.0 * first + rise * y), WIDE)
ahead_row = over_rows(lambda e, mean, expm1, v2: (v2 + e * mean) / (1.0 + expm1), WIDE)
behind_row = over_rows(lambda e, graded, expm1, v2, mean: (v2 - e * (mean + graded)) / (1.0 + expm1), WIDE)
root_rate_row = over_rows(lambda ds, root, w: 2.0 * root * ds / np.sqrt(w), WIDE)


@Inner
def divide_series(c, x):  # type: ignore[no-untyped-def]
    """Return a Chebyshev series at x, and replace it by the quotient of its difference from there by that of the
    places.
    """
    value, after = 0.0, 0.0
    for k in range(COUNT - 1, 0, -1):  # Clenshaw's recurrence, whose sums are the terms of the quotient
        value, after = c[k] + (2.0 * x * value - after), value
        c[k] = 2.0 * value
    total = c[0] + (x * value - after)
    for k in range(COUNT - 1):
        c[k] = c[k + 1]
    c[0], c[COUNT - 1] = 0.5 * c[0], 0.0
    return total


@Inner
def fill_beside_turn(begin, share, turn, sign, work):  # type: ignore[no-untyped-def]
    """Fill the rows Q_RATE and W_FACTOR with ds and with W over the distance from a turn, on the part of a gap that
    begins at the share ``begin`` of it; ``turn`` is the share at which the turn is, and the sign that of the force.
    Return M at the turn.
    """
    linear_row(work, GRADED, NODES, 4.0 * begin - 2.0, 4.0 * share)
    linear_row(work, P, NODES, begin, share)
    for row, to in ((DS, Q_RATE), (EXPM1_Q, TIME_RATE)):
        to_coefficients(work, row, work, SERIES)
        series_at(work, to, GRADED, SERIES)
    to_coefficients(work, MEAN, work, SERIES)
    mean = divide_series(work[SERIES : SERIES + COUNT], 2.0 * turn - 1.0)
    series_at(work, SPEED, GRADED, SERIES)
    beside_turn_row(work, W_FACTOR, SPEED, P, TIME_RATE, sign * mean, sign * 2.0)
    return mean


@Inner
def are_rates_resolved(h, work):  # type: ignore[no-untyped-def]
    """Fill the row TIME_RATE on a part next to a turn that is ``h`` long, and return whether it is resolved."""
    if not extent(work, W_FACTOR)[0] > 0.0:
        return False
    rate_row(work, TIME_RATE, Q_RATE, W_FACTOR, h)
    return examine(work, TIME_RATE, size_of(work, TIME_RATE))[2]


@Inner
def time_to_turn(width, share, work):  # type: ignore[no-untyped-def]
    """Return the time from the start of a gap to a turn at a share of its width, and V**2 at the start, given the rows
    DS, EXPM1_Q and MEAN; the time is NaN if it is not resolved.
    """
    v2 = -width * share * fill_beside_turn(0.0, share, share, -1.0, work)
    if not are_rates_resolved(width * share, work):
        return nan, v2
    to_time_before(work, TIME_RATE, work, TAILS)
    return work[TAILS], v2


@Inner
def keep_series(store, k, work):  # type: ignore[no-untyped-def]
    """Keep the series of M, E and ds on a gap, with E at its end, as number k."""
    at, last = k * ROOM_FOR_SERIES, work[EXPM1_Q + COUNT]
    for j, row in enumerate((MEAN, EXPM1_Q, DS)):
        to_coefficients(work, row, work, SERIES)
        copy(store, at + j * WIDE, work, SERIES)
    store[at + COUNT] = last


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
    start = v2
    if is_ahead:
        lay_series(store, at, SPEED, work)
        ahead_row(work, W_FACTOR, FORCE, SPEED, TIME_RATE, v2)
    else:
        copy(work, SERIES, store, at)
        mean, at_end = divide_series(work[SERIES : SERIES + COUNT], 1.0), v2 * (1.0 + store[at + COUNT])
        series_at(work, SPEED, GRADED, SERIES)
        linear_row(work, P, FORCE, 2.0, -2.0 / width)
        product(work, SPEED, SPEED, P)
        behind_row(work, W_FACTOR, FORCE, SPEED, TIME_RATE, at_end, mean)
        start = at_end - width * mean  # E is 0 there
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
        fill_beside_turn(begin, share, begin, 1.0, work)
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
    to_time_after(work, TIME_RATE, work, TAILS)
    return work[TAILS], work[W + COUNT]
