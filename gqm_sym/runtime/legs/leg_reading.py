"""Quantities that are read from the record of a leg: the time at a place, the place at a time, and the largest speed or
contact force.
"""

from math import asin, cos, fabs, inf, nan, pi, sin, sqrt

import numpy as np
from numba import types

from gqm_sym.runtime.arithmetic.clenshaw import chebyshev_sum, legendre_sum
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
    NO_VALUES,
    NORMAL_LOAD,
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
    Y_ROW,
)
from gqm_sym.runtime.legs.panels.breaks import offset
from gqm_sym.runtime.legs.panels.equation import March, copy, distance, marched
from gqm_sym.runtime.legs.panels.polynomials import COUNT, SHARES, TO_COEFFICIENTS, WIDE, sum_and_slope
from gqm_sym.runtime.legs.runs.leg_variable import LegVariable, distance_at, reversed_variable, share_at
from gqm_sym.runtime.legs.runs.whole_rows import LEBESGUE, whole_time_row
from gqm_sym.runtime.legs.runs.whole_tables import MAX_BLOCKS, to_coefficients, to_nodes


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

# Buffers for two series of a panel; and for values at nodes of a panel or leg, their series and the nodes.
terms_buffer, sample_buffer = on_stack(2 * WIDE), on_stack(3 * MAX_BLOCKS * WIDE)

# The largest number of steps of a search within a panel, and the share of the panel at which the search stops.
MAX_STEPS, LAST_STEP = 60, 4e-16

# The functions whose extremes are read: the speed, and the contact force per mass, which has a sign or a length.
SPEED, LOAD, LENGTH = range(3)

# The largest share of the last two coefficients of a function that a panel resolves.
MAX_TAIL = 1e-13

# The smallest square of a length as a share of the largest on the panel that has enough digits; and a length as a share
# of the largest that cannot be told from zero.
LEAST_SQUARE, ROUNDING = 1e-3, 4e-16

# An extreme is located to this share of a panel, which suffices because the function is flat there.
FLAT_PART = 1e-9


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
    return time + 0.5 * (right - left) * legendre_sum(terms[:WIDE], 2.0 * (w - left) / (right - left) - 1.0)


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
    lo, hi, share = -1.0, 1.0, time / record[at + TIME]
    x = min(max(2.0 * share - 1.0, -1.0), 1.0)
    for _ in range(MAX_STEPS):
        late = half * legendre_sum(terms[:WIDE], x) - time
        lo, hi = (lo, x) if late > 0.0 else (x, hi)
        new = x - late / (half * legendre_sum(terms[WIDE:], x))
        if not lo <= new <= hi:
            new = 0.5 * (lo + hi)
        if fabs(new - x) <= LAST_STEP:
            break
        x = new
    return edge(record, begin, k) + half * (1.0 + x)


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
def peak(terms, lo, hi, sign):  # type: ignore[no-untyped-def]
    """Return the largest value of ``sign`` times a Chebyshev series that has at most one extreme between two places."""
    left, rise = sum_and_slope(terms, lo)
    right, fall = sum_and_slope(terms, hi)
    best, rise, fall = max(sign * left, sign * right), sign * rise, sign * fall
    if not rise > 0.0 > fall:
        return best
    # The zero of the slope by the method of false position; if an end of the bracket stays, its slope is halved
    # (Illinois method).
    moved = 0
    for _ in range(MAX_STEPS):
        x = min(max(lo + (hi - lo) * (rise / (rise - fall)), lo), hi)
        value, slope = sum_and_slope(terms, x)
        best, slope = max(best, sign * value), sign * slope
        if slope > 0.0:
            done, lo, rise, fall, moved = x - lo, x, slope, 0.5 * fall if moved == 1 else fall, 1
        else:
            done, hi, fall, rise, moved = hi - x, x, slope, 0.5 * rise if moved == -1 else rise, -1
        if done <= FLAT_PART or slope == 0.0:
            break
    return best


@Inner
def peak_of_values(blocks, values, first, last, sign, best):  # type: ignore[no-untyped-def]
    """Return the larger of ``best`` and the largest value of ``sign`` times a function on a part of a panel or leg.

    Parameters
    ----------
    blocks : int
        The number of blocks of a row (`runs.whole_tables`).
    values : array
        The function at the nodes, and room for its series and for the nodes.
    first, last : float
        The ends of the part, within [-1, 1].
    """
    top, bottom, count, wide = -inf, inf, blocks * WIDE - 1, blocks * WIDE
    for j in range(count):
        top, bottom = max(top, sign * values[j]), min(bottom, sign * values[j])
    # Between the nodes a polynomial exceeds the values there by less than a multiple of their spread.
    spread = 0.5 * (LEBESGUE - 1.0) * (top - bottom)
    if top + spread <= best:
        return best
    # Nodes are equally spaced in an angle, and the series is even at both ends. Next to a node it exceeds the value
    # there by an eighth of the second difference, or little more.
    may_exceed = False
    for j in range(count):
        bend = (values[max(j - 1, 0)] - values[j]) + (values[min(j + 1, count - 1)] - values[j])
        may_exceed = may_exceed or sign * values[j] + fabs(bend) > best
    if not may_exceed:
        return best
    values[wide] = 1.0
    to_nodes(blocks, values, wide, values, 2 * wide)
    to_coefficients(blocks, values, 0, values, wide)
    terms, shares = values[wide : wide + count], values[2 * wide : 2 * wide + count]
    best = max(best, max(sign * chebyshev_sum(terms, first), sign * chebyshev_sum(terms, last)))
    for j in range(count):
        before, after = sign * values[max(j - 1, 0)], sign * values[min(j + 1, count - 1)]
        here, x = sign * values[j], 2.0 * shares[j] - 1.0
        if first < x < last:
            best = max(best, here)
            if here >= before and here >= after and here + spread > best:
                lo = 2.0 * shares[j - 1] - 1.0 if j > 0 else -1.0
                hi = 2.0 * shares[j + 1] - 1.0 if j < count - 1 else 1.0
                best = max(best, peak(terms, max(lo, first), min(hi, last), sign))
    return best


@Inner
def peak_of_function(blocks, values, part, asked, best):  # type: ignore[no-untyped-def]
    """Return `peak_of_values` for a function on a part of a panel; NaN for a length whose square is not resolved, or so
    small that it has too few digits.

    The square of a length is smooth also where the length almost vanishes. The panels of a leg resolve its law, of
    which the contact force is a small part if friction is small.
    """
    (function, sign), (first, last), wide = asked, part, blocks * WIDE
    if function != LENGTH:
        return peak_of_values(blocks, values, first, last, sign, best)
    largest = 0.0
    for j in range(wide - 1):
        values[j] *= values[j]
        largest = max(largest, values[j])
    to_coefficients(blocks, values, 0, values, wide)
    if not fabs(values[2 * wide - 2]) + fabs(values[2 * wide - 3]) <= MAX_TAIL * largest:
        return nan
    square = peak_of_values(blocks, values, first, last, sign, best * fabs(best))
    if sign < 0.0 and square > best * fabs(best) and -square < LEAST_SQUARE * largest:
        return best if -best <= ROUNDING * sqrt(largest) else nan
    return sqrt(square) if square >= 0.0 else -sqrt(-square)


@Inner
def peak_between(record, panels, half_c, between, asked, best):  # type: ignore[no-untyped-def]
    """Return the larger of ``best`` and the peak of some panels between two values of the march variable.

    Parameters
    ----------
    panels : (int, int)
        The position of the first of the panels in the record, and their number.
    half_c : float
        c/2 of their march variable; infinite if that is the distance.
    between : (float, float)
    asked : (int, float)
        SPEED, LOAD or LENGTH; 1 for the largest, -1 for the smallest.
    """
    (begin, count), (low, high), (function, sign) = panels, between, asked
    values = sample_buffer()
    if half_c == 0.0 and low == 0.0 and sign < 0.0 and function == SPEED:
        return max(best, 0.0)  # the body is slowest where it turns
    for k in range(count):
        at, left = begin + k * COLUMNS, edge(record, begin, k)
        width = record[at + RIGHT] - left
        first, last = 2.0 * (low - left) / width - 1.0, 2.0 * (high - left) / width - 1.0
        if first > 1.0 or last < -1.0 or record[at + TIME_ERROR] == NO_VALUES:
            continue
        for j in range(COUNT):
            growth = left + width * SHARES[j] + half_c if half_c < inf and record[at + TIME_ERROR] >= 0.0 else 1.0
            values[j] = growth * record[at + Y_ROW + j] if function == SPEED else record[at + NORMAL_LOAD + j]
        best = peak_of_function(1, values, (max(first, -1.0), min(last, 1.0)), (function, sign), best)
        if best != best:
            break
    return best


@Inner
def time_to_phase(terms, count, phase, backwards):  # type: ignore[no-untyped-def]
    """Return the time from the start, or ``backwards`` from the end, of a leg to a phase angle of at most pi/2, and its
    derivative.

    ``terms`` begins with the ``count`` coefficients of the time per phase angle.
    """
    sign = 1.0 if backwards else -1.0
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
    terms, count = record[HEAD:], int(record[WHOLE]) * WIDE - 1
    if record[EXTENT] > 0.0:
        # From here on these are the distances in the leg's variable.
        variable = variable_of_rows(record, covered + left)
        covered = share_at(variable, covered)[0]
        left = share_at(reversed_variable(variable), left)[0]
    if covered <= left:
        return time_to_phase(terms, count, 2.0 * asin(sqrt(covered / (covered + left))), False)[0]
    total = record[TIME_FROM_START] + record[TIME_FROM_END]
    return total - time_to_phase(terms, count, 2.0 * asin(sqrt(left / (covered + left))), True)[0]


@Inner
def phase_of_rows(record, terms, time):  # type: ignore[no-untyped-def]
    """Return the phase angle at a time from the start of a leg whose record has rows, from the nearer end, and whether
    that is the end of the leg.
    """
    total, count = record[TIME_FROM_START] + record[TIME_FROM_END], int(record[WHOLE]) * WIDE - 1
    backwards = time > record[TIME_FROM_START]
    wanted = total - time if backwards else time
    phase = 0.5 * pi * wanted / (record[TIME_FROM_END] if backwards else record[TIME_FROM_START])
    for _ in range(MAX_STEPS):
        there, rate = time_to_phase(terms, count, phase, backwards)
        step = (there - wanted) / rate
        phase = min(max(phase - step, 0.0), 0.5 * pi)
        if fabs(step) <= FLAT_PART:
            break
    return phase, backwards


@Inner
def place_in_rows(record, time):  # type: ignore[no-untyped-def]
    """Return the place in [-1, 1] at a time from the start of a leg whose record has rows, to some ten digits."""
    phase, backwards = phase_of_rows(record, record[HEAD:], time)
    return cos(phase) if backwards else -cos(phase)


@Inner
def place_of_rows(record, time):  # type: ignore[no-untyped-def]
    """Return the result of `place_at` for a record with the rows of a solved motion (`runs.whole_panels`)."""
    rows, blocks, h, v = sample_buffer(), int(record[WHOLE]), record[WHOLE_WIDTH], record[HEADING]
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


@Inner
def peak_of_rows(record, until, asked, best):  # type: ignore[no-untyped-def]
    """Return `peak_of_leg` for a leg from turn to turn whose record has rows."""
    values, (function, sign), blocks = sample_buffer(), asked, int(record[WHOLE])
    if sign < 0.0 and function == SPEED:
        return max(best, 0.0)  # the body is slowest where it turns
    for at in range(0, blocks * WIDE, WIDE):
        copy(values, at, record, HEAD + (1 if function == SPEED else 2) * blocks * WIDE + at)
    last = 1.0 if until >= record[TIME_FROM_START] + record[TIME_FROM_END] else place_in_rows(record, max(until, 0.0))
    if function != SPEED:
        return peak_of_function(blocks, values, (-1.0, last), asked, best)
    return max(best, sqrt(peak_of_values(blocks, values, -1.0, last, sign, max(best, 0.0) ** 2)))


@Inner
def peak_of_leg(record, until, asked, best):  # type: ignore[no-untyped-def]
    """Return the larger of ``best`` and the peak of a leg up to a time from its start; ``asked`` is as in
    `peak_between`.

    With the sign -1, the peak is minus the smallest value.
    """
    if record[WHOLE] > 0.0:
        return peak_of_rows(record, until, asked, best)
    ahead, back = int(record[AHEAD]), int(record[BACK])
    if ahead > 0:
        whole = until >= record[TIME_FROM_START]
        last = edge(record, HEAD, ahead) if whole else marched_in(record, HEAD, ahead, max(until, 0.0))
        best = peak_between(record, (HEAD, ahead), record[HALF_C], (0.0, last), asked, best)
    remaining = record[TIME_FROM_START] + record[TIME_FROM_END] - until
    if back > 0 and remaining <= record[TIME_FROM_END] and best == best:
        begin = HEAD + ahead * COLUMNS
        first = marched_in(record, begin, back, remaining) if remaining > 0.0 else 0.0
        best = peak_between(record, (begin, back), 0.0, (first, edge(record, begin, back)), asked, best)
    return best
