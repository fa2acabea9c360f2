"""Quantities that are read from the record of a leg: the time at a place, and the place at a time."""

from math import asin, cos, fabs, inf, pi, sin, sqrt

import numpy as np
from numba import types

from gqm_sym.runtime.arithmetic.clenshaw import legendre_growth, legendre_sum
from gqm_sym.runtime.arithmetic.matrices import multiply
from gqm_sym.runtime.compiled.intrinsics import fma
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.registers import borrowed, on_stack
from gqm_sym.runtime.compiled.types import VECTOR, Array
from gqm_sym.runtime.legs.leg_record import (
    AHEAD,
    BACK,
    COLUMNS,
    END,
    END_LOW,
    EXTENT,
    FALLING,
    HALF_C,
    HEAD,
    HEADING,
    MIDDLE,
    MIDDLE_LOW,
    RIGHT,
    RISING,
    START,
    START_LOW,
    TIME,
    TIME_ERROR,
    TIME_FROM_END,
    TIME_FROM_START,
    WHOLE,
    WHOLE_WIDTH,
)
from gqm_sym.runtime.legs.panels.breaks import offset
from gqm_sym.runtime.legs.panels.equation import March, copy, distance, marched
from gqm_sym.runtime.legs.panels.polynomials import COUNT, TO_COEFFICIENTS, WIDE
from gqm_sym.runtime.legs.runs.leg_variable import LegVariable, distance_at, reversed_variable, share_at
from gqm_sym.runtime.legs.runs.whole_rows import whole_time_row
from gqm_sym.runtime.legs.runs.whole_tables import MAX_BLOCKS, blocks_of, grade_of, to_coefficients, variable_at


def _to_legendre() -> tuple[Array, Array]:
    """Return the matrices that map values at a panel's nodes to Legendre coefficients of the function on [-1, 1] and of
    its integral from -1.
    """
    # x P_j = ((j + 1) P_(j+1) + j P_(j-1))/(2 j + 1), and T_(k+1) = 2 x T_k - T_(k-1).
    j = np.arange(WIDE + 1)
    series = np.zeros((COUNT, WIDE + 1))
    series[0, 0] = series[1, 1] = 1.0
    for k in range(2, COUNT):
        row = series[k - 1]
        series[k, 1:] += 2.0 * (j[1:] / (2 * j[1:] - 1)) * row[:-1]
        series[k, :-1] += 2.0 * (j[1:] / (2 * j[1:] + 1)) * row[1:]
        series[k] -= series[k - 2]
    plain = TO_COEFFICIENTS.T @ series
    integral = np.zeros((COUNT, WIDE))
    integral[:, 0] = plain[:, 0] - plain[:, 1] / 3.0
    i = np.arange(1, WIDE)
    integral[:, 1:] = plain[:, i - 1] / (2 * i - 1) - plain[:, i + 1] / (2 * i + 3)
    return np.ascontiguousarray(plain[:, :WIDE]), integral


PLAIN_BY_NODE, INTEGRAL_BY_NODE = _to_legendre()
to_plain, to_integral = multiply(PLAIN_BY_NODE), multiply(INTEGRAL_BY_NODE)

# Buffers for two series of a panel, and for rows of a leg.
terms_buffer, rows_buffer = on_stack(2 * WIDE), on_stack(3 * MAX_BLOCKS * WIDE)

# The largest number of steps of a search within a panel. A place on it is found to the square of the second number, as
# a share of the distance from its beginning, and a phase angle to the square of the third.
MAX_STEPS, LAST_STEP, LAST_PHASE = 60, 1e-9, 1e-9


@Inner
def edge(record, begin, k):  # type: ignore[no-untyped-def]
    """Return the march variable at the beginning of the k-th of some panels; the first of them is at ``begin`` in the
    record.
    """
    return record[begin + (k - 1) * COLUMNS + RIGHT] if k > 0 else 0.0


@Inner
def time_to(record, begin, count, w):  # type: ignore[no-untyped-def]
    """Return the time from the beginning of ``count`` panels to a march variable on one of them."""
    terms, time, k = terms_buffer(), 0.0, 0
    while k < count - 1 and record[begin + k * COLUMNS + RIGHT] <= w:
        time += record[begin + k * COLUMNS + TIME]
        k += 1
    left, right = edge(record, begin, k), record[begin + k * COLUMNS + RIGHT]
    if w >= right:
        return time + record[begin + k * COLUMNS + TIME]
    to_integral(record, begin + k * COLUMNS, terms, 0)
    return time + 0.5 * (right - left) * legendre_growth(terms[:WIDE], 2.0 * (w - left) / (right - left))


@Inner
def marched_in(record, begin, count, time):  # type: ignore[no-untyped-def]
    """Return the march variable at a time from the beginning of ``count`` panels, as the inverse of `time_to`; NaN
    without rates.
    """
    terms, k = terms_buffer(), 0
    while k < count - 1 and record[begin + k * COLUMNS + TIME] <= time:
        time -= record[begin + k * COLUMNS + TIME]
        k += 1
    at = begin + k * COLUMNS
    half = 0.5 * (record[at + RIGHT] - edge(record, begin, k))
    if record[at + TIME_ERROR] < 0.0:
        return np.nan
    to_integral(record, at, terms, 0)
    to_plain(record, at, terms, WIDE)
    # The distance from the beginning of the panel, as a share of half its width.
    lo, hi, x = 0.0, 2.0, min(max(2.0 * time / record[at + TIME], 0.0), 2.0)
    for _ in range(MAX_STEPS):
        late = half * legendre_growth(terms[:WIDE], x) - time
        lo, hi = (lo, x) if late > 0.0 else (x, hi)
        new = x - late / (half * legendre_sum(terms[WIDE:], x - 1.0))
        if not lo <= new <= hi:
            new = 0.5 * (lo + hi)
        step, x = fabs(new - x), new
        if step <= LAST_STEP * x:
            break
    return edge(record, begin, k) + half * x


@Inner
def march_of(record):  # type: ignore[no-untyped-def]
    """Return the march variable of the panels from a leg's start."""
    half_c, start, v = record[HALF_C], (record[START], record[START_LOW]), int(record[HEADING])
    return March(start, v, 1.0, 2.0 * half_c) if half_c < inf else March(start, v, 0.0, 1.0)


@Inner
def passage(record, place):  # type: ignore[no-untyped-def]
    """Return the time from a leg's start at which the body passes a place; inf if it does not, NaN if the record has no
    such time.
    """
    ahead, back, march = int(record[AHEAD]), int(record[BACK]), march_of(record)
    v, covered = march.direction, offset(place, march.origin, march.direction)
    left = 0.0 if place == record[END] else -offset(place, (record[END], record[END_LOW]), v)
    if covered <= 0.0 or left < 0.0:
        return inf
    if left == 0.0:
        return record[TIME_FROM_START] + record[TIME_FROM_END]
    if record[WHOLE] > 0.0:
        return passage_of_rows(record, covered, left)
    if offset(place, (record[MIDDLE], record[MIDDLE_LOW]), v) <= 0.0 and ahead > 0:
        return time_to(record, HEAD, ahead, marched(covered, march))
    if back == 0 or record[TIME_FROM_END] == 0.0:
        return np.nan
    from_end = time_to(record, HEAD + ahead * COLUMNS, back, sqrt(left))
    return record[TIME_FROM_START] + (record[TIME_FROM_END] - from_end)


@entry(types.float64(VECTOR, types.float64))
def place_at(record, time):  # type: ignore[no-untyped-def]
    """Return the place within the lap at a time in s from a leg's start; NaN if the record does not determine it."""
    record, ahead, back = borrowed(record), int(record[AHEAD]), int(record[BACK])
    march, v = march_of(record), record[HEADING]
    if record[WHOLE] > 0.0:
        return place_of_rows(record, time) if record[WHOLE_WIDTH] > 0.0 else np.nan
    if time <= record[TIME_FROM_START] and ahead > 0:
        return record[START] + (record[START_LOW] + v * distance(marched_in(record, HEAD, ahead, time), march))
    remaining = (record[TIME_FROM_START] - time) + record[TIME_FROM_END]
    if back == 0 or record[TIME_FROM_END] == 0.0 or remaining < 0.0:
        return np.nan
    w = marched_in(record, HEAD + ahead * COLUMNS, back, remaining)
    return record[END] + (record[END_LOW] - v * (w * w))


@Inner
def rate_of_variable(terms, grade, count, k):  # type: ignore[no-untyped-def]
    """Return a coefficient of the time per variable u over pi, given those of the time per phase angle."""
    here = terms[k] if k < count else 0.0
    if grade == 1:
        return here
    # The derivative of the phase angle is pi times 6 u (1 - u), which is (3/4)(1 - T_2(x)).
    beside = (terms[k + 2] if k + 2 < count else 0.0) + (terms[abs(k - 2)] if 0 < k < count + 2 else 0.0)
    return 0.75 * here - 0.375 * (beside + (terms[0] if k == 2 else 0.0))


@Inner
def time_by_series(terms, grade, count, phase, backwards):  # type: ignore[no-untyped-def]
    """Return the result of `time_to_phase` for the ``count`` coefficients of a series in the variable of a grade."""
    x, odd = 2.0 * variable_at(grade, phase) - 1.0, -1.0 if backwards else 1.0
    rate, rate_after, time, time_after, at_start, here, after = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(count if grade == 1 else count + 2, 0, -1):
        before = rate_of_variable(terms, grade, count, k - 1)
        before = before if k % 2 == 1 else odd * before
        # The integral of the series has the coefficients (c_(k-1) - c_(k+1))/(2 k); c_0 counts twice.
        area = 0.5 * ((2.0 * before if k == 1 else before) - after) / k
        time, time_after = fma(2.0 * x, time, area - time_after), time
        at_start += area if k % 2 == 0 else -area
        after, here = here, before
    for k in range(count - 1, 0, -1):
        rate, rate_after = fma(2.0 * x, rate, (terms[k] if k % 2 == 0 else odd * terms[k]) - rate_after), rate
    return 0.5 * pi * (fma(x, time, -time_after) - at_start), fma(x, rate, terms[0] - rate_after)


@Inner
def time_to_phase(terms, form, phase, backwards):  # type: ignore[no-untyped-def]
    """Return the time from the start, or ``backwards`` from the end, of a leg to a phase angle of at most pi/2, and its
    derivative.

    ``terms`` begins with the coefficients of the time per phase angle, whose number the ``form`` tells
    (`runs.whole_tables`).
    """
    sign, count = 1.0 if backwards else -1.0, blocks_of(form) * WIDE - 1
    if form > MAX_BLOCKS:
        return time_by_series(terms, grade_of(form), count, phase, backwards)
    # The sum of c_k cos(k phase), with the signs of c_k that the direction requires, and its integral.
    c, s = cos(phase), sin(phase)
    rate, rate_after, time, time_after = 0.0, 0.0, 0.0, 0.0
    for k in range(count - 1, 0, -1):
        term = terms[k] if k % 2 == 0 else sign * terms[k]
        rate, rate_after = fma(2.0 * c, rate, term - rate_after), rate
        time, time_after = fma(2.0 * c, time, term / k - time_after), time
    constant = terms[0]
    return fma(constant, phase, s * time), fma(c, rate, constant - rate_after)


@Inner
def variable_of_rows(record, width):  # type: ignore[no-untyped-def]
    """Return the variable of a leg of this width whose record has rows."""
    return LegVariable(width, record[RISING], record[FALLING], record[EXTENT])


@Inner
def passage_of_rows(record, covered, left):  # type: ignore[no-untyped-def]
    """Return the time from the start of a leg whose record has rows to a place, given its distances from both ends."""
    terms, form = record[HEAD:], int(record[WHOLE])
    if record[EXTENT] > 0.0:
        # From here on these are the distances in the leg's variable.
        variable = variable_of_rows(record, covered + left)
        covered = share_at(variable, covered)[0]
        left = share_at(reversed_variable(variable), left)[0]
    if covered <= left:
        return time_to_phase(terms, form, 2.0 * asin(sqrt(covered / (covered + left))), False)[0]
    total = record[TIME_FROM_START] + record[TIME_FROM_END]
    return total - time_to_phase(terms, form, 2.0 * asin(sqrt(left / (covered + left))), True)[0]


@Inner
def phase_of_rows(record, terms, time):  # type: ignore[no-untyped-def]
    """Return the phase angle at a time from the start of a leg whose record has rows, from the nearer end, and whether
    that is the end of the leg.
    """
    total, form = record[TIME_FROM_START] + record[TIME_FROM_END], int(record[WHOLE])
    backwards = time > record[TIME_FROM_START]
    wanted = total - time if backwards else time
    phase = 0.5 * pi * wanted / (record[TIME_FROM_END] if backwards else record[TIME_FROM_START])
    for _ in range(MAX_STEPS):
        there, rate = time_to_phase(terms, form, phase, backwards)
        step = (there - wanted) / rate
        phase = min(max(phase - step, 0.0), 0.5 * pi)
        if fabs(step) <= LAST_PHASE:
            break
    return phase, backwards


@Inner
def place_of_rows(record, time):  # type: ignore[no-untyped-def]
    """Return the result of `place_at` for a record with the rows of a solved motion (`runs.whole_panels`)."""
    rows, blocks, h, v = rows_buffer(), blocks_of(int(record[WHOLE])), record[WHOLE_WIDTH], record[HEADING]
    wide = blocks * WIDE
    if not time <= record[TIME_FROM_START] + record[TIME_FROM_END]:
        return np.nan
    for at in range(0, wide, WIDE):
        copy(rows, wide + at, record, HEAD + at)
        copy(rows, 2 * wide + at, record, HEAD + 3 * wide + at)
        whole_time_row(rows, wide + at, 2 * wide + at, wide + at, h)
    to_coefficients(blocks, rows, wide, rows, 0)
    phase, backwards = phase_of_rows(record, rows, time)
    root = sin(0.5 * phase)
    variable = variable_of_rows(record, h)
    if backwards and variable.extent > 0.0:
        variable = reversed_variable(variable)
    covered = v * distance_at(variable, root * root)
    return record[END] + (record[END_LOW] - covered) if backwards else record[START] + (record[START_LOW] + covered)
