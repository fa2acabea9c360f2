"""Turning points of many orbits in double-double arithmetic.

Where the time of an orbit changes by several times the share by which its width does, as it does towards a hilltop, the
roundings of the energy in doubles, and of the turning points to doubles, are too much for its last digits. The module's
formulas as a tape (`double_double.recording`) give V**2 at the turning points with twice as many digits, three places
for an orbit. What the turning points then lack as doubles changes the time in proportion: the time of an orbit with
both ends moved the same way, but far enough for doubles, gives the factor.
"""

from math import fabs

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.compiled.intrinsics import choose
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import on_stack
from gqm_sym.runtime.double_double.arithmetic import add, divide
from gqm_sym.runtime.double_double.interpreter import BLOCK, LOW, ROW, call_interpreter
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
)
from gqm_sym.runtime.sweep.quantities import UNDECIDED

# The share of an orbit's width by which its ends are moved for the derivative of its time. It is so small that the
# trapezoidal rule converges on an even orbit of which only one half is evaluated, though it is not even then.
SHIFT = 2.0**-28

stacked_levels = on_stack(2 * BLOCK)


@Inner
def fill_places(begin, n, start, offsets, place):  # type: ignore[no-untyped-def]
    """Fill the register of places with those at offsets from the launches, which are sums of two doubles."""
    for i in range(n):
        place[i], place[LOW + i] = two_sum(start[begin + i], offsets[begin + i])


@Inner
def find_exact_ends(exact, count, orbits, lacks):  # type: ignore[no-untyped-def]
    """Improve both ends of all orbits by a step of Newton's method in double-double arithmetic.

    The ends become doubles again. The rows of ``lacks`` are filled with what is lacking from the offsets of the lower
    and the upper end, and from the ends as values of the curve's parameter.
    """
    (address, operations, parts, registers), work, p = exact
    first, at, u, _, slope, _ = registers
    n, rows, params, levels = orbits.size, orbits.rows, orbits.params, stacked_levels()
    start, v2, rests = rows[LAUNCH_PLACE, :n], rows[LAUNCH_V2, :n], rows[V2_REST, :n]
    below, above, lows, highs = rows[OFFSET_LOW, :n], rows[OFFSET_HIGH, :n], lacks[0, :n], lacks[1, :n]
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
        for side in range(2):
            offsets, moves = below if side == 0 else above, lows if side == 0 else highs
            fill_places(begin, size, start, offsets, work[at : at + ROW])
            call_interpreter(address, operations, parts[0], parts[2], work, size)
            for i in range(size):
                level, level_low, up = levels[i], levels[BLOCK + i], slope + i
                half, low = add(level, level_low, -work[u + i], -work[u + LOW + i])
                move, _ = divide(half, low, work[up], work[up + LOW])
                exact_launch = (v2[begin + i] == 0.0) & (offsets[begin + i] == 0.0)
                moves[begin + i] = choose(exact_launch, 0.0, move)
    for side in range(2):
        offsets, lost, ends = below if side == 0 else above, lacks[side, :n], rows[END_LOW + side, :n]
        for j in range(n):
            offsets[j], lost[j] = two_sum(offsets[j], lost[j])
            place, rounding = two_sum(start[j], offsets[j])
            ends[j] = place + (rounding + lost[j])
            lacks[2 + side, j] = (place - ends[j]) + (rounding + lost[j])
    rows[HALF_REST, :n] = 0.0
    for j in range(n):  # the width is rounded too
        width, rounding = two_sum(above[j], -below[j])
        rows[HALF_WIDTH, j], lows[j], highs[j] = 0.5 * width, lows[j] - 0.5 * rounding, highs[j] + 0.5 * rounding


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
