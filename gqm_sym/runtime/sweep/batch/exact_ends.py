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
    HALF_WIDTH,
    INDEX,
    LAUNCH_PLACE,
    LAUNCH_V2,
    OFFSET_HIGH,
    OFFSET_LOW,
    V2_REST,
)
from gqm_sym.runtime.sweep.quantities import UNDECIDED

# The share of an orbit's width by which its ends are moved for the derivative of its time.
SHIFT = 2.0**-12

stacked_levels = on_stack(2 * BLOCK)


@Inner
def fill_places(begin, n, start, offsets, place):  # type: ignore[no-untyped-def]
    """Fill the register of places with those at offsets from the launches, which are sums of two doubles."""
    for i in range(n):
        place[i], place[LOW + i] = two_sum(start[begin + i], offsets[begin + i])


@Inner
def find_exact_ends(exact, count, orbits, mirrored, lows, highs):  # type: ignore[no-untyped-def]
    """Improve both ends of all orbits by a step of Newton's method in double-double arithmetic.

    The ends become doubles again, and ``lows`` and ``highs`` are filled with what they lack. For orbits that are
    ``mirrored`` this is what half of the width lacks on either side.
    """
    (address, operations, parts, registers), work, p = exact
    first, at, u, _, slope, _ = registers
    n, rows, params, levels = orbits.size, orbits.rows, orbits.params, stacked_levels()
    start, v2, rests = rows[LAUNCH_PLACE, :n], rows[LAUNCH_V2, :n], rows[V2_REST, :n]
    below, above = rows[OFFSET_LOW, :n], rows[OFFSET_HIGH, :n]
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
    for j in range(n):
        below[j], lows[j] = two_sum(below[j], lows[j])
        above[j], highs[j] = two_sum(above[j], highs[j])
        width = above[j] - below[j]
        total, lost = two_sum(above[j], -below[j])
        rows[HALF_WIDTH, j] = 0.5 * width
        rest = 0.5 * ((total - width) + lost)
        lows[j], highs[j] = lows[j] - rest, highs[j] + rest
        half = 0.5 * (highs[j] - lows[j])
        lows[j], highs[j] = choose(mirrored, -half, lows[j]), choose(mirrored, half, highs[j])
        rows[END_LOW, j], rows[END_HIGH, j] = start[j] + below[j], start[j] + above[j]


@Inner
def move_ends(n, rows, lows, highs, shares, indices):  # type: ignore[no-untyped-def]
    """Move both ends by multiples of what they lack. Fill ``shares`` with what of that is lacking, and ``indices`` with
    the indices of the launches.
    """
    start, below, above = rows[LAUNCH_PLACE, :n], rows[OFFSET_LOW, :n], rows[OFFSET_HIGH, :n]
    for j in range(n):
        most = choose(fabs(lows[j]) > fabs(highs[j]), fabs(lows[j]), fabs(highs[j]))
        factor = choose(most > 0.0, SHIFT * (above[j] - below[j]) / choose(most > 0.0, most, 1.0), 0.0)
        below[j], above[j] = below[j] + factor * lows[j], above[j] + factor * highs[j]
        rows[HALF_WIDTH, j] = 0.5 * (above[j] - below[j])
        rows[END_LOW, j], rows[END_HIGH, j] = start[j] + below[j], start[j] + above[j]
        shares[j], indices[j] = choose(factor > 0.0, 1.0 / choose(factor > 0.0, factor, 1.0), 0.0), rows[INDEX, j]


@Inner
def add_what_ends_lack(n, shares, indices, moved, answers):  # type: ignore[no-untyped-def]
    """Add to the times what the ends of the orbits lack, from the times with moved ends."""
    for j in range(n):  # the last orbit is repeated
        moved[j] = answers.values[int(indices[j]), 0] + shares[j] * (moved[j] - answers.values[int(indices[j]), 0])
    for j in range(n):
        k = int(indices[j])
        answers.values[k, 0] = moved[j]
        answers.status[k] = answers.status[k] if moved[j] == moved[j] else UNDECIDED
