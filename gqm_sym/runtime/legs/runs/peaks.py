"""The largest or smallest speed or contact force on a leg, from its record.

The polynomial of a whole leg tells where the contact force is largest or smallest, and the law gives it at this place.
A small contact force, as at a launch from rest on a steep place, would have the rounding errors of the largest one.
On a leg with a stretched variable (`leg_variable`), its singularities stay branches, and it is resolved only so far.
"""

from math import cos, fabs, inf, nan, sin, sqrt
from typing import NamedTuple

from gqm_sym.runtime.arithmetic.clenshaw import chebyshev_sum
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import on_stack
from gqm_sym.runtime.legs.leg_reading import MAX_STEPS, edge, marched_in, phase_of_rows, variable_of_rows
from gqm_sym.runtime.legs.leg_record import (
    AHEAD,
    BACK,
    COLUMNS,
    END,
    END_LOW,
    HALF_C,
    HEAD,
    HEADING,
    KNOWN_PEAK,
    NO_VALUES,
    NORMAL_LOAD,
    RIGHT,
    START,
    START_LOW,
    TIME_ERROR,
    TIME_FROM_END,
    TIME_FROM_START,
    WHOLE,
    WHOLE_WIDTH,
    Y_ROW,
)
from gqm_sym.runtime.legs.panels.equation import KAPPA, MEAN, N0, W, copy, load_per_mass_row
from gqm_sym.runtime.legs.panels.point import LEAST_V2, point_buffer, slope_of_v2
from gqm_sym.runtime.legs.panels.polynomials import COUNT, SHARES, WIDE, sum_and_slope
from gqm_sym.runtime.legs.runs.leg_variable import LegVariable, distance_at, reversed_variable
from gqm_sym.runtime.legs.runs.whole_rows import LEBESGUE, LOCATED_RATIO
from gqm_sym.runtime.legs.runs.whole_tables import (
    IN_SHARE,
    MAX_BLOCKS,
    blocks_of,
    grade_of,
    phase_at,
    to_coefficients,
    to_nodes,
    variable_at,
)

# Buffers for values at nodes of a panel or leg, their series and the nodes; and for a series.
sample_buffer, speed_buffer = on_stack(3 * MAX_BLOCKS * WIDE), on_stack(MAX_BLOCKS * WIDE)

# The functions whose extremes are read: the speed, and the contact force per mass, which has a sign or a length.
SPEED, LOAD, LENGTH = range(3)

# The largest share of the last two coefficients of a function that a panel resolves.
MAX_TAIL = 1e-13

# The smallest square of a length as a share of the largest on the panel that has enough digits; and a length as a share
# of the largest that cannot be told from zero.
LEAST_SQUARE, ROUNDING = 1e-3, 4e-16

# An extreme is located to this share of a panel, which suffices because the function is flat there.
FLAT_PART = 1e-9

# The error of values of a contact force that is only located, as a share of its size.
LOCATED_ERROR = 20.0 * LOCATED_RATIO


@Inner
def peak(terms, lo, hi, sign):  # type: ignore[no-untyped-def]
    """Return the largest value of ``sign`` times a Chebyshev series that has at most one extreme between two places,
    and where that is.
    """
    left, rise = sum_and_slope(terms, lo)
    right, fall = sum_and_slope(terms, hi)
    best, rise, fall = max(sign * left, sign * right), sign * rise, sign * fall
    if not rise > 0.0 > fall:
        return best, lo if sign * left >= sign * right else hi
    # The zero of the slope by the method of false position; if an end of the bracket stays, its slope is halved
    # (Illinois method).
    moved, x = 0, lo
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
    return best, x


@Inner
def may_exceed(blocks, values, sign, best):  # type: ignore[no-untyped-def]
    """Return whether ``sign`` times a function, given at nodes, may exceed ``best``, and by how much at most it exceeds
    its values at the nodes.
    """
    top, bottom, count = -inf, inf, blocks * WIDE - 1
    for j in range(count):
        top, bottom = max(top, sign * values[j]), min(bottom, sign * values[j])
    # Between the nodes a polynomial exceeds the values there by less than a multiple of their spread.
    spread = 0.5 * (LEBESGUE - 1.0) * (top - bottom)
    if top + spread <= best:
        return False, spread
    # Nodes are equally spaced in an angle, and the series is even at both ends. Next to a node it exceeds the value
    # there by an eighth of the second difference, or little more.
    exceeds = False
    for j in range(count):
        bend = (values[max(j - 1, 0)] - values[j]) + (values[min(j + 1, count - 1)] - values[j])
        exceeds = exceeds or sign * values[j] + fabs(bend) > best
    return exceeds, spread


@Inner
def fill_series(blocks, values):  # type: ignore[no-untyped-def]
    """Fill the room behind values at nodes with their Chebyshev series and with the nodes; return both."""
    count, wide = blocks * WIDE - 1, blocks * WIDE
    values[wide] = 1.0
    to_nodes(blocks, values, wide, values, 2 * wide)
    to_coefficients(blocks, values, 0, values, wide)
    return values[wide : wide + count], values[2 * wide : 2 * wide + count]


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
    count = blocks * WIDE - 1
    exceeds, spread = may_exceed(blocks, values, sign, best)
    if not exceeds:
        return best
    terms, shares = fill_series(blocks, values)
    best = max(best, max(sign * chebyshev_sum(terms, first), sign * chebyshev_sum(terms, last)))
    for j in range(count):
        before, after = sign * values[max(j - 1, 0)], sign * values[min(j + 1, count - 1)]
        here, x = sign * values[j], 2.0 * shares[j] - 1.0
        if first < x < last:
            best = max(best, here)
        if here >= before and here >= after and here + spread > best:
            # The node may lie beyond an end of the part, and the extreme before that end.
            lo = max(2.0 * shares[j - 1] - 1.0 if j > 0 else -1.0, first)
            hi = min(2.0 * shares[j + 1] - 1.0 if j < count - 1 else 1.0, last)
            if lo < hi:
                best = max(best, peak(terms, lo, hi, sign)[0])
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
        if record[at + TIME_ERROR] == KNOWN_PEAK:
            best = max(best, record[at + Y_ROW])
            continue
        for j in range(COUNT):
            growth = left + width * SHARES[j] + half_c if half_c < inf and record[at + TIME_ERROR] >= 0.0 else 1.0
            values[j] = growth * record[at + Y_ROW + j] if function == SPEED else record[at + NORMAL_LOAD + j]
        best = peak_of_function(1, values, (max(first, -1.0), min(last, 1.0)), (function, sign), best)
        if best != best:
            break
    return best


@Inner
def place_in_rows(record, time):  # type: ignore[no-untyped-def]
    """Return the place in [-1, 1] at a time from the start of a leg whose record has rows, to some ten digits."""
    phase, backwards = phase_of_rows(record, record[HEAD:], time)
    grade = grade_of(int(record[WHOLE]))
    x = 2.0 * variable_at(grade, phase) - 1.0 if grade > IN_SHARE else -cos(phase)
    return -x if backwards else x


class Stretch(NamedTuple):
    """A part of the curve with a stretched variable.

    Attributes
    ----------
    start, end : (float, float)
        The places of its ends as two doubles.
    direction : float
        The sign of dlam/dt.
    variable : LegVariable
    """

    start: tuple[float, float]
    end: tuple[float, float]
    direction: float
    variable: LegVariable


@Inner
def force_at(forces, stretch, form, v2, x):  # type: ignore[no-untyped-def]
    """Return the contact force per mass at a place in [-1, 1], by the law; ``v2`` begins with V**2 at the nodes."""
    (start, end, v, variable), point, speeds, blocks = stretch, point_buffer(), speed_buffer(), blocks_of(form)
    to_coefficients(blocks, v2, 0, speeds, 0)
    share = 0.5 * (1.0 - fabs(x))
    if grade_of(form) > IN_SHARE:
        share = sin(0.5 * phase_at(grade_of(form), share)) ** 2
    if x <= 0.0:
        place = start[0] + (start[1] + v * distance_at(variable, share))
    else:
        left = distance_at(reversed_variable(variable), share)
        place = end[0] + (end[1] - v * left)
    w = max(chebyshev_sum(speeds[: blocks * WIDE - 1], x), LEAST_V2) if -1.0 < x < 1.0 else LEAST_V2
    slope_of_v2(forces, place, w, 0, point)
    return point[5] + point[6] * w


@Inner
def peak_of_force(forces, stretch, form, values, v2, last, sign, best):  # type: ignore[no-untyped-def]
    """Return the larger of ``best`` and the largest value of ``sign`` times the contact force per mass up to a place in
    [-1, 1], given at nodes and with room behind as in `peak_of_values`; ``v2`` is as in `force_at`.
    """
    size, blocks = 0.0, blocks_of(form)
    count = blocks * WIDE - 1
    if not may_exceed(blocks, values, sign, best)[0]:
        return best
    terms, shares = fill_series(blocks, values)
    for j in range(count):
        size = max(size, fabs(values[j]))
        if 2.0 * shares[j] - 1.0 < last:
            best = max(best, sign * values[j])
    margin = LOCATED_ERROR * size
    for j in range(count):
        before, after, here = sign * values[max(j - 1, 0)], sign * values[min(j + 1, count - 1)], sign * values[j]
        lo = 2.0 * shares[j - 1] - 1.0 if j > 0 else -1.0
        hi = 2.0 * shares[j + 1] - 1.0 if j < count - 1 else 1.0
        is_cut, is_top = last < 1.0 and lo < last <= hi, here >= before and here >= after and hi <= last
        # The function exceeds its value at a node by an eighth of the second difference, or little more.
        if is_cut or (is_top and here + fabs((before - here) + (after - here)) + margin > best):
            value, x = peak(terms, lo, min(hi, last), sign)
            if value + margin > best:
                best = max(best, sign * force_at(forces, stretch, form, v2, x))
    return best


@Inner
def peak_of_part(forces, stretch, blocks, reading, best, work):  # type: ignore[no-untyped-def]
    """Return the larger of ``best`` and the extreme that is read of a part of a leg from a turn to a turn.

    ``work`` has the rows of the part, one block after the other.
    """
    values, row = sample_buffer(), MEAN if reading.force else W
    if reading.sign < 0.0 and not reading.force:
        return max(best, 0.0)  # the body is slowest where it turns
    for at in range(0, blocks * WIDE, WIDE):
        load_per_mass_row(work, blocks * MEAN + at, blocks * N0 + at, blocks * KAPPA + at, blocks * W + at)
        copy(values, at, work, blocks * row + at)
    if reading.length:
        return peak_of_function(blocks, values, (-1.0, 1.0), (LENGTH, reading.sign), best)
    if reading.force and stretch.variable.extent > 0.0:
        return peak_of_force(forces, stretch, blocks, values, work[blocks * W :], 1.0, reading.sign, best)
    if reading.force:
        return peak_of_values(blocks, values, -1.0, 1.0, reading.sign, best)
    return max(best, sqrt(peak_of_values(blocks, values, -1.0, 1.0, 1.0, max(best, 0.0) ** 2)))


@Inner
def peak_of_rows(forces, record, until, asked, best):  # type: ignore[no-untyped-def]
    """Return `peak_of_leg` for a leg from turn to turn whose record has rows."""
    values, (function, sign), form = sample_buffer(), asked, int(record[WHOLE])
    blocks = blocks_of(form)
    if sign < 0.0 and function == SPEED:
        return max(best, 0.0)  # the body is slowest where it turns
    for at in range(0, blocks * WIDE, WIDE):
        copy(values, at, record, HEAD + (1 if function == SPEED else 2) * blocks * WIDE + at)
    last = 1.0 if until >= record[TIME_FROM_START] + record[TIME_FROM_END] else place_in_rows(record, max(until, 0.0))
    if function == LOAD and record[WHOLE_WIDTH] > 0.0:
        ends = (record[START], record[START_LOW]), (record[END], record[END_LOW])
        stretch = Stretch(*ends, record[HEADING], variable_of_rows(record, record[WHOLE_WIDTH]))
        return peak_of_force(forces, stretch, form, values, record[HEAD + blocks * WIDE :], last, sign, best)
    if function != SPEED:
        return peak_of_function(blocks, values, (-1.0, last), asked, best)
    return max(best, sqrt(peak_of_values(blocks, values, -1.0, last, sign, max(best, 0.0) ** 2)))


@Inner
def peak_of_leg(forces, record, until, asked, best):  # type: ignore[no-untyped-def]
    """Return the larger of ``best`` and the peak of a leg up to a time from its start; ``asked`` is as in
    `peak_between`, and the forces are those on the leg.

    With the sign -1, the peak is minus the smallest value.
    """
    if record[WHOLE] > 0.0:
        return peak_of_rows(forces, record, until, asked, best)
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
