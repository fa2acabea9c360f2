"""Panels of a leg that was followed as one polynomial, made when places on it are asked for.

The record of such a leg (`leg_record`) has four rows instead of panels: C of `whole_leg` (W_FACTOR), FORCE, the contact
force per mass, and ds. From each end to the middle, the march variable is the root of the distance. Parts of this range
become panels if polynomials with 23 nodes resolve what their record contains. The values at their nodes come from the
polynomials of the leg, so that panels and leg are the same motion up to rounding. On a leg with a stretched variable
(`leg_variable`), C, FORCE and ds are those with respect to it, and the middle is where it is 1/2.
"""

from math import asin, fabs, pi, sqrt

import numpy as np

from gqm_sym.runtime.compiled.jit import Inlined, Inner, entry
from gqm_sym.runtime.compiled.registers import borrowed, fused, on_stack, over_rows
from gqm_sym.runtime.compiled.types import VECTOR
from gqm_sym.runtime.legs.leg_record import (
    AHEAD,
    BACK,
    COLUMNS,
    EXTENT,
    FALLING,
    HEAD,
    NORMAL_LOAD,
    RIGHT,
    RISING,
    TIME,
    TIME_ERROR,
    TIME_FROM_END,
    TIME_FROM_START,
    WHOLE,
    WHOLE_WIDTH,
    Y_ROW,
)
from gqm_sym.runtime.legs.panels.equation import (
    ARC_RATE,
    DS,
    FORCE,
    GRADED,
    KAPPA,
    LOAD,
    MEAN,
    N0,
    NODES,
    OFFSET,
    SPEED,
    TAILS,
    TIME_RATE,
    W_FACTOR,
    copy,
    copy_row,
    linear_row,
    panel_buffer,
    product,
    root_row,
    set_nodes,
    time_rate_row,
)
from gqm_sym.runtime.legs.panels.polynomials import WIDE, size_of
from gqm_sym.runtime.legs.panels.resolution import examine, growth, narrower
from gqm_sym.runtime.legs.runs.leg_variable import LegVariable, distance_at, reversed_variable, share_at
from gqm_sym.runtime.legs.runs.whole_tables import MAX_BLOCKS, blocks_of, to_coefficients

# The functions of a leg in its record, in the order of their rows.
ROWS = W_FACTOR, FORCE, MEAN, DS
ROW_COUNT = len(ROWS)
series_buffer = on_stack(ROW_COUNT * MAX_BLOCKS * WIDE)

# The width of the first part to try, and the least width of a part, as shares of the march variable in the middle.
FIRST_SHARE, LEAST_SHARE = 0.625, 0.0625
MAX_PARTS = int(1.0 / LEAST_SHARE)

# A part up to the middle is tried if it is at most this many times as wide as expected.
LAST_STRETCH = 1.25

# Twice the place in [-1, 1] on the leg at the share s of the value that the march variable has in the middle.
twice_place_row = over_rows(lambda s: 2.0 * (s * s) - 2.0, WIDE)
next_sum_row = over_rows(lambda twice, after, before, term: fused(twice, after, term - before), WIDE)
last_sum_row = over_rows(lambda twice, after, before, term: fused(0.5 * twice, after, term - before), WIDE)

quotient_row = over_rows(lambda one, other: one / other, WIDE)

# Y, and the rate of arc length.
part_speed_row = over_rows(lambda factor, s: np.sqrt(factor - 0.5 * factor * (s * s)), WIDE)
part_arc_row = over_rows(lambda ds, s, slope: ds * (s * slope), WIDE)


@Inner
def fill_series(record, blocks, series):  # type: ignore[no-untyped-def]
    """Fill in the Chebyshev series of the functions of a leg; return the size of FORCE."""
    wide, size = blocks * WIDE, 0.0
    for k in range(ROW_COUNT):
        to_coefficients(blocks, record, HEAD + k * wide, series, k * wide)
    for j in range(HEAD + wide, HEAD + 2 * wide - 1):
        size = max(size, fabs(record[j]))
    return size


@Inner
def reverse_series(blocks, series):  # type: ignore[no-untyped-def]
    """Replace the series by those of the leg seen from its end."""
    for k in range(ROW_COUNT):
        for j in range(k * blocks * WIDE + 1, (k + 1) * blocks * WIDE, 2):
            series[j] = -series[j]


@Inner
def fill_row(series, begin, count, work, row):  # type: ignore[no-untyped-def]
    """Fill a row with a series at the places in GRADED, by Clenshaw's recurrence."""
    after, before = LOAD, row
    copy_row(work, after, 0.0)
    copy_row(work, before, 0.0)
    for k in range(begin + count - 1, begin, -2):  # each sum replaces the last but one
        next_sum_row(work, before, GRADED, after, before, series[k])
        next_sum_row(work, after, GRADED, before, after, series[k - 1])
    last_sum_row(work, row, GRADED, after, before, series[begin])


@Inlined
def twice_phase(root):  # type: ignore[no-untyped-def]
    """Return twice the place in [-1, 1] of a phase angle, given the root of its share of the way."""
    return 8.0 / pi * asin(min(root, 1.0)) - 2.0


@Inner
def lay_part(form, variable, w, begin, end, work):  # type: ignore[no-untyped-def]
    """Fill the rows of a part between two shares that depend on the leg's variable alone: OFFSET, GRADED, and if it is
    stretched J (N0) and ``y (1 - y)`` times the width over the distance (KAPPA).
    """
    linear_row(work, OFFSET, NODES, begin, end - begin)
    if variable.extent == 0.0 and form <= MAX_BLOCKS:
        twice_place_row(work, GRADED, OFFSET)
    elif variable.extent == 0.0:
        for j in range(WIDE):
            work[GRADED + j] = twice_phase(sqrt(0.5) * work[OFFSET + j])
    else:
        for j in range(WIDE):
            root = w * work[OFFSET + j]
            y, work[N0 + j] = share_at(variable, root * root)
            work[GRADED + j] = 4.0 * y - 2.0 if form <= MAX_BLOCKS else twice_phase(sqrt(y))
            work[KAPPA + j] = y * (1.0 - y) * variable.width / (root * root)


@Inner
def fill_part(form, series, variable, w, force_size, begin, end, work):  # type: ignore[no-untyped-def]
    """Fill the rows of the part between two shares; return whether they are resolved, and the largest ratio of their
    middle coefficients to their sizes.
    """
    wide, resolved, worst = blocks_of(form) * WIDE, True, 0.0
    lay_part(form, variable, w, begin, end, work)
    fill_row(series, 0, wide - 1, work, W_FACTOR)
    fill_row(series, wide, wide - 1, work, FORCE)
    fill_row(series, 2 * wide, wide - 1, work, MEAN)
    fill_row(series, 3 * wide, wide - 1, work, DS)
    if variable.extent == 0.0:
        part_speed_row(work, SPEED, W_FACTOR, OFFSET)
    else:
        quotient_row(work, FORCE, FORCE, N0)
        quotient_row(work, DS, DS, N0)
        product(work, SPEED, W_FACTOR, KAPPA)
        root_row(work, SPEED, SPEED)
    for row in (FORCE, DS):
        size = force_size if row == FORCE else size_of(work, row)
        _tail, middle, fine = examine(work, row, size)
        resolved, worst = resolved and fine, max(worst, middle / size)
    time_rate_row(work, TIME_RATE, DS, SPEED, 2.0)
    size = size_of(work, TIME_RATE)
    _tail, middle, fine = examine(work, TIME_RATE, size)
    return resolved and fine, max(worst, middle / size)


@Inner
def enter_part(record, at, begin, end, w, work):  # type: ignore[no-untyped-def]
    """Write a part into the record as a panel; ``w`` is the march variable in the middle. Return the time on it."""
    width = (end - begin) * w
    part_arc_row(work, ARC_RATE, DS, OFFSET, 2.0 * w)
    copy(record, at, work, TIME_RATE)
    copy(record, at + WIDE, work, ARC_RATE)
    copy(record, at + Y_ROW, work, SPEED)
    copy(record, at + NORMAL_LOAD, work, MEAN)
    record[at + RIGHT] = end * w
    tail = max(fabs(work[TAILS]), max(fabs(work[TAILS + 1]), fabs(work[TAILS + 2])))
    record[at + TIME_ERROR] = width * tail
    return width * work[TAILS + 6]


@Inner
def lay_half(record, to, form, series, variable, force_size, time):  # type: ignore[no-untyped-def]
    """Write panels from an end of a leg to its middle into the record; return their number.

    Parameters
    ----------
    record : array
    to : int
        The index from which on panels are written.
    form : int
        The form of the rows (`whole_tables`).
    series : array
        As filled by `fill_series`, seen from the end at which the panels begin.
    variable : LegVariable
        Seen from there too.
    force_size : float
        The size of FORCE.
    time : float
        The time to the middle.
    """
    w = sqrt(distance_at(variable, 0.5))  # the march variable in the middle
    work, count, begin, width, passed = panel_buffer(), 0, 0.0, FIRST_SHARE, 0.0
    stretch = LAST_STRETCH
    set_nodes(work)
    while begin < 1.0:
        end = 1.0 if 1.0 - begin <= stretch * width else begin + width
        fine, ratio = fill_part(form, series, variable, w, force_size, begin, end, work)
        factor = growth(ratio)
        if not fine and width > LEAST_SHARE:
            width, stretch = max(narrower(end - begin, factor), LEAST_SHARE), 1.0
            continue
        at = to + count * COLUMNS
        spent = enter_part(record, at, begin, end, w, work)
        record[at + TIME] = spent if end < 1.0 else time - passed
        width, passed, begin, count = max((end - begin) * factor, LEAST_SHARE), passed + spent, end, count + 1
        stretch = LAST_STRETCH
    return count


@Inner
def with_panels(record):  # type: ignore[no-untyped-def]
    """Return the record with panels in place of rows of the whole leg."""
    out, series = np.empty(HEAD + 2 * MAX_PARTS * COLUMNS), series_buffer()
    form = int(record[WHOLE])
    blocks = blocks_of(form)
    variable = LegVariable(record[WHOLE_WIDTH], record[RISING], record[FALLING], record[EXTENT])
    for k in range(HEAD):
        out[k] = record[k]
    size = fill_series(record, blocks, series)
    ahead = lay_half(out, HEAD, form, series, variable, size, record[TIME_FROM_START])
    reverse_series(blocks, series)
    if variable.extent > 0.0:
        variable = reversed_variable(variable)
    back = lay_half(out, HEAD + ahead * COLUMNS, form, series, variable, size, record[TIME_FROM_END])
    out[WHOLE], out[AHEAD], out[BACK] = 0.0, ahead, back
    return out[: HEAD + (ahead + back) * COLUMNS].copy()


@entry(VECTOR(VECTOR), checked=False)
def lay_panels(record):  # type: ignore[no-untyped-def]
    """Return what `with_panels` does."""
    return with_panels(borrowed(record))
