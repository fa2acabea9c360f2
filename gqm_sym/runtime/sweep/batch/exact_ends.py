"""Turning points of many orbits in double-double arithmetic.

Where terms of the potential cancel, as they do in shallow wells, the roundings of the energy in doubles are too much
for the last digits of turning points and times. The module's formulas as a tape (`double_double.recording`) give V**2
at the turning points with twice as many digits, two or three places for an orbit.

Where the time of an orbit changes by several times the share by which its width does, as it does towards a hilltop, the
roundings of turning points to doubles are too much. About an axis of symmetry half the width is given as two doubles
therefore, and otherwise both ends are, for times in double-double arithmetic (`exact_nodes`).
"""

from math import fabs, inf, nan

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.compiled.intrinsics import choose
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.double_double.arithmetic import UNIT, add, divide
from gqm_sym.runtime.double_double.interpreter import BLOCK, ERROR, LOW, ROW, call_interpreter
from gqm_sym.runtime.quadrature.trapezoid import CIRCULATION, LIBRATION
from gqm_sym.runtime.sweep.batch.exact_nodes import load_parameters
from gqm_sym.runtime.sweep.batch.rows import (
    END_LOW,
    HALF_REST,
    HALF_WIDTH,
    LACK_HIGH,
    LACK_LOW,
    LAUNCH_PLACE,
    LAUNCH_V2,
    LEVEL,
    LEVEL_REST,
    OFFSET_HIGH,
    OFFSET_LOW,
    V2_REST,
    contains_positive,
)
from gqm_sym.runtime.sweep.batch.times import AGM_LIBRATION
from gqm_sym.runtime.sweep.quantities import ARRIVAL_TIME, SPANS, TURNING_POINTS

# The largest move of an end by a step of Newton's method, in widths of the orbit. Its square is what then is lacking.
MAX_MOVE = 2.0**-31


@Inner
def fill_places(begin, n, start, offsets, place):  # type: ignore[no-untyped-def]
    """Fill the register of places with those at offsets from the launches, which are sums of two doubles."""
    for i in range(n):
        place[i], place[LOW + i] = two_sum(start[begin + i], offsets[begin + i])


@Inner
def keeps_ends(kind, quantity):  # type: ignore[no-untyped-def]
    """Return whether bodies released at rest turn where an axis of symmetry says, and half the width of their orbits is
    known as two doubles or not needed.
    """
    return kind.about_axis and (kind.kind != LIBRATION or quantity in (SPANS, TURNING_POINTS, ARRIVAL_TIME))


@Inner
def refines_ends(kind, quantity, orbits, careful):  # type: ignore[no-untyped-def]
    """Return whether the ends of orbits are to be found in double-double arithmetic.

    Bodies released at rest turn at their mirror images about an axis, and what rounding takes from the width of their
    orbits matters next to a hilltop only. So it does for bodies thrown about an axis, for which it would take longer
    than their times by an arithmetic-geometric mean.
    """
    if kind.kind == CIRCULATION:
        return False
    thrown = contains_positive(orbits.rows[LAUNCH_V2, : orbits.size])
    if kind.about_axis and not (thrown or careful):
        return False
    return not keeps_ends(kind, quantity) or (
        thrown and (careful or kind.kind != AGM_LIBRATION or quantity == ARRIVAL_TIME)
    )


@Inner
def find_exact_ends(exact, count, kept_at_rest, orbits, buffers, columns):  # type: ignore[no-untyped-def]
    """Improve both ends of all orbits by a step of Newton's method in double-double arithmetic.

    The ends become doubles again, and what they lack is kept, as is the energy level. Ends are NaN if they would be
    moved far. ``kept_at_rest`` is that of `keeps_ends`. The first of ``buffers`` is filled with an estimate of how many
    roundings of doubles the divided difference of V**2 may be off; the others are for intermediate results, as
    is ``columns``.
    """
    (address, operations, parts, registers), work, _ = exact
    _, at, u, _, slope, _ = registers
    n, rows = orbits.size, orbits.rows
    levels, levels_low = rows[LEVEL, :n], rows[LEVEL_REST, :n]
    start, v2, rests = rows[LAUNCH_PLACE, :n], rows[LAUNCH_V2, :n], rows[V2_REST, :n]
    below, above, lows, highs = rows[OFFSET_LOW, :n], rows[OFFSET_HIGH, :n], rows[LACK_LOW, :n], rows[LACK_HIGH, :n]
    widths, halves_rest = rows[HALF_WIDTH, :n], rows[HALF_REST, :n]
    rough, kept, offsets, upper = buffers[0, :n], buffers[1, :n], buffers[2, :n], buffers[3, :n]
    terms, slopes = buffers[4, :n], buffers[5, :n]
    for j in range(n):
        kept[j] = choose(kept_at_rest & (v2[j] == 0.0) & (widths[j] == widths[j]), 1.0, 0.0)
    for begin in range(0, n, BLOCK):
        size = min(BLOCK, n - begin)
        for i in range(size):
            columns[i] = begin + i
        load_parameters(exact, count, orbits, columns, size)
        lows[begin : begin + size] = 0.0
        fill_places(begin, size, start, lows, work[at : at + ROW])
        call_interpreter(address, operations, parts[0], parts[1], work, size)
        for i in range(size):
            terms[begin + i], slopes[begin + i] = 0.0, inf
            half, rest = 0.5 * v2[begin + i], 0.5 * rests[begin + i]
            levels[begin + i], levels_low[begin + i] = add(work[u + i], work[u + LOW + i], half, rest)
        here = slice(begin, begin + size)
        lows[here] = highs[here] = 0.0
        for k in range(2 if contains_positive(v2[here]) else 1):
            for i in range(begin, begin + size):
                # A body released at rest starts at one end, so that only the other one is sought.
                at_rest = (v2[i] == 0.0) & ((below[i] == 0.0) | (above[i] == 0.0))
                upper[i] = choose(at_rest, choose(below[i] == 0.0, 1.0, 0.0), 1.0 * k)
                offsets[i] = choose(upper[i] == 1.0, above[i], below[i])
            fill_places(begin, size, start, offsets, work[at : at + ROW])
            call_interpreter(address, operations, parts[0], parts[2], work, size)
            for i in range(size):
                level, level_low, up = levels[begin + i], levels_low[begin + i], slope + i
                half, low = add(level, level_low, -work[u + i], -work[u + LOW + i])
                steep, size_of_terms = fabs(work[up]), work[up + ERROR]
                slopes[begin + i] = choose(steep < slopes[begin + i], steep, slopes[begin + i])
                terms[begin + i] = choose(size_of_terms > terms[begin + i], size_of_terms, terms[begin + i])
                move, _ = divide(half, low, work[up], work[up + LOW])
                move = choose(fabs(move) < MAX_MOVE * (above[begin + i] - below[begin + i]), move, nan)
                offsets[begin + i] = choose(kept[begin + i] == 1.0, 0.0, move)
            for i in range(begin, begin + size):
                highs[i] = choose(upper[i] == 1.0, offsets[i], highs[i])
                lows[i] = choose(upper[i] == 1.0, lows[i], offsets[i])
    for side in range(2):
        sides, lost, ends = below if side == 0 else above, rows[LACK_LOW + side, :n], rows[END_LOW + side, :n]
        for j in range(n):
            sides[j], lost[j] = two_sum(sides[j], lost[j])
            place, rounding = two_sum(start[j], sides[j])
            ends[j] = choose(kept[j] == 1.0, ends[j], place + (rounding + lost[j]))
    for j in range(n):
        width, rounding = two_sum(above[j], -below[j])
        scale = max(width, fabs(start[j]))  # of the place, over which terms of the slope change by as much as they are
        rough[j] = choose(v2[j] > 0.0, 2.0, 1.0) * terms[j] / UNIT * width / (slopes[j] * scale)
        widths[j] = choose(kept[j] == 1.0, widths[j], 0.5 * width)
        halves_rest[j] = choose(kept[j] == 1.0, halves_rest[j], 0.5 * ((highs[j] - lows[j]) + rounding))
