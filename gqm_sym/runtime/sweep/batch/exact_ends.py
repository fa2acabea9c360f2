"""Turning points of many orbits in double-double arithmetic.

Where terms of the potential cancel, as they do in shallow wells, the roundings of the energy in doubles are too much
for the last digits of turning points and times. The module's formulas as a tape (`double_double.recording`) give V**2
at the turning points with twice as many digits, two or three places for an orbit.

Where the time of an orbit changes by several times the share by which its width does, as it does towards a hilltop, the
roundings of turning points to doubles are too much. About an axis of symmetry half the width is given as two doubles
therefore. Otherwise what the turning points lack as doubles changes the time in proportion: the time of an orbit with
both ends moved the same way, but far enough for doubles, gives the factor.
"""

from math import fabs, nan

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.compiled.intrinsics import choose
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import on_stack
from gqm_sym.runtime.double_double.arithmetic import add, divide
from gqm_sym.runtime.double_double.interpreter import BLOCK, LOW, ROW, call_interpreter
from gqm_sym.runtime.quadrature.trapezoid import CIRCULATION, LIBRATION
from gqm_sym.runtime.sweep.batch.rows import (
    END_HIGH,
    END_LOW,
    HALF_REST,
    HALF_WIDTH,
    INDEX,
    LAUNCH_PLACE,
    LAUNCH_V2,
    OFFSET_HIGH,
    OFFSET_LOW,
    V2_REST,
    contains_positive,
)
from gqm_sym.runtime.sweep.batch.times import AGM_LIBRATION
from gqm_sym.runtime.sweep.quantities import ARRIVAL_TIME, SPANS, TURNING_POINTS, UNDECIDED

# The share of an orbit's width by which its ends are moved for the derivative of its time. It is so small that the
# trapezoidal rule converges on an even orbit of which only one half is evaluated, though it is not even then.
SHIFT = 2.0**-28

# The largest move of an end by a step of Newton's method, in widths of the orbit.
MAX_MOVE = 2.0**-20

stacked_levels = on_stack(2 * BLOCK)


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
def find_exact_ends(exact, count, kept_at_rest, orbits, lacks):  # type: ignore[no-untyped-def]
    """Improve both ends of all orbits by a step of Newton's method in double-double arithmetic.

    The ends become doubles again. The rows of ``lacks`` are filled with what is lacking from the offsets of the lower
    and the upper end, and from the ends as values of the curve's parameter. Ends are NaN if they would be moved far.
    ``kept_at_rest`` is that of `keeps_ends`.
    """
    (address, operations, parts, registers), work, p = exact
    first, at, u, _, slope, _ = registers
    n, rows, params, levels = orbits.size, orbits.rows, orbits.params, stacked_levels()
    start, v2, rests = rows[LAUNCH_PLACE, :n], rows[LAUNCH_V2, :n], rows[V2_REST, :n]
    below, above, lows, highs = rows[OFFSET_LOW, :n], rows[OFFSET_HIGH, :n], lacks[0, :n], lacks[1, :n]
    widths, halves_rest, kept = rows[HALF_WIDTH, :n], rows[HALF_REST, :n], lacks[4, :n]
    offsets, upper = lacks[5, :n], lacks[6, :n]
    for j in range(n):
        kept[j] = choose(kept_at_rest & (v2[j] == 0.0) & (widths[j] == widths[j]), 1.0, 0.0)
    for begin in range(0, n, BLOCK):
        size = min(BLOCK, n - begin)
        for k in range(count):
            for i in range(size):
                register = first + k * ROW + i
                work[register], work[register + LOW] = params[k * n + begin + i], p[1, k]
        call_interpreter(address, operations, 0, parts[0], work, size)
        lows[begin : begin + size] = 0.0
        fill_places(begin, size, start, lows, work[at : at + ROW])
        call_interpreter(address, operations, parts[0], parts[1], work, size)
        for i in range(size):
            half, rest = 0.5 * v2[begin + i], 0.5 * rests[begin + i]
            levels[i], levels[BLOCK + i] = add(work[u + i], work[u + LOW + i], half, rest)
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
                level, level_low, up = levels[i], levels[BLOCK + i], slope + i
                half, low = add(level, level_low, -work[u + i], -work[u + LOW + i])
                move, _ = divide(half, low, work[up], work[up + LOW])
                move = choose(fabs(move) < MAX_MOVE * (above[begin + i] - below[begin + i]), move, nan)
                offsets[begin + i] = choose(kept[begin + i] == 1.0, 0.0, move)
            for i in range(begin, begin + size):
                highs[i] = choose(upper[i] == 1.0, offsets[i], highs[i])
                lows[i] = choose(upper[i] == 1.0, lows[i], offsets[i])
    for side in range(2):
        sides, lost, ends = below if side == 0 else above, lacks[side, :n], rows[END_LOW + side, :n]
        for j in range(n):
            sides[j], lost[j] = two_sum(sides[j], lost[j])
            place, rounding = two_sum(start[j], sides[j])
            ends[j] = choose(kept[j] == 1.0, ends[j], place + (rounding + lost[j]))
            lacks[2 + side, j] = (place - ends[j]) + (rounding + lost[j])
    for j in range(n):  # the width is rounded too
        width, rounding = two_sum(above[j], -below[j])
        lows[j], highs[j] = lows[j] - 0.5 * rounding, highs[j] + 0.5 * rounding
        widths[j] = choose(kept[j] == 1.0, widths[j], 0.5 * width)
        halves_rest[j] = choose(kept[j] == 1.0, halves_rest[j], 0.5 * (highs[j] - lows[j]))


@Inner
def move_ends(n, rows, lacks, shares, indices):  # type: ignore[no-untyped-def]
    """Move both ends by a multiple of what they lack. Fill ``shares`` with the inverse of this number, and ``indices``
    with the indices of the launches.
    """
    below, above, low, high = rows[OFFSET_LOW, :n], rows[OFFSET_HIGH, :n], rows[END_LOW, :n], rows[END_HIGH, :n]
    for j in range(n):
        most = fabs(lacks[0, j]) + fabs(lacks[1, j]) + fabs(lacks[2, j]) + fabs(lacks[3, j])
        factor = choose(most > 0.0, SHIFT * (above[j] - below[j]) / choose(most > 0.0, most, 1.0), 0.0)
        below[j], above[j] = below[j] + factor * lacks[0, j], above[j] + factor * lacks[1, j]
        low[j], high[j] = low[j] + factor * lacks[2, j], high[j] + factor * lacks[3, j]
        rows[HALF_WIDTH, j] = 0.5 * (above[j] - below[j])
        shares[j], indices[j] = choose(factor > 0.0, 1.0 / choose(factor > 0.0, factor, 1.0), 0.0), rows[INDEX, j]


@Inner
def add_what_ends_lack(n, shares, indices, moved, answers):  # type: ignore[no-untyped-def]
    """Add to the times what the ends of the orbits lack, from the times with moved ends."""
    values, status = answers.values, answers.status
    for j in range(n):  # the last orbit is repeated
        time = values[int(indices[j]), 0]
        moved[j] = time + shares[j] * (moved[j] - time)
    for j in range(n):
        k = int(indices[j])
        values[k, 0], status[k] = moved[j], choose(moved[j] == moved[j], status[k], UNDECIDED)
