"""V**2 behind a block of short gaps with friction in space, and the time over it, as functions of V**2 before it.

With such friction the law is not linear in V**2, and bodies pass short gaps one by one (`panels.few_nodes`). But V**2 =
w at the start of a block decides all that follows, and the more smoothly, the larger w is: the relative change of V**2
and the time, in units of 1/sqrt(w), are analytic functions of 1/w up to 1/w = 0, apart from where V**2 or N vanish for
complex w. On each octave of w they are polynomials in 1/w, through values from passages gap by gap. These are kept for
all bodies, in a line for each octave, which another octave may take over; what is kept does not depend on the bodies.
"""

from math import fabs, frexp, inf, nan, pi, sqrt

import numpy as np

from gqm_sym.runtime.arithmetic.matrices import multiply, span
from gqm_sym.runtime.compiled.intrinsics import fma
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import on_stack
from gqm_sym.runtime.legs.gaps.data import (
    BLOCK,
    FILLED,
    FIRST_OF_BLOCK,
    FIRST_OF_FEW,
    FIRST_OF_OCTAVES,
    GAP_COLUMNS,
    OCTAVE_COLUMNS,
    OCTAVE_TERMS,
    OCTAVES_OF_GAP,
    REFUSED,
    Bounds,
    lengths_on,
)
from gqm_sym.runtime.legs.panels.few_nodes import few_buffer, pass_few, widened

# The line of an octave: a number that identifies it, and whether it is FILLED or REFUSED; bounds of V**2 on the block
# less w; exp(q) - 1 at the end, roughly; and the coefficients for the relative change of V**2 and for the time.
TAG, STATE_OF_OCTAVE, LOW_CHANGE, HIGH_CHANGE, LOST_ON_BLOCK = range(5)
CHANGES, TIMES_IN_UNITS = 8, 8 + OCTAVE_TERMS

# Tags are positive: a binary exponent, plus this.
FIRST_TAG = 4096

# The smallest ratio of V**2 at the end of a block to w. With a smaller one, the end would lose digits.
LEAST_RATIO = 0.25

# The largest of the last coefficients, as a share of the size of a function, with which those beyond are rounding only.
MAX_LAST = 2.0**-49

# From the values at the Chebyshev nodes to Chebyshev coefficients, and from these to those of the powers of x. The
# product of the two matrices has large numbers, with which digits would be lost.
_ODD = 2 * np.arange(OCTAVE_TERMS) + 1
_ANGLES = pi / (2 * OCTAVE_TERMS) * (np.outer(_ODD, np.arange(OCTAVE_TERMS)) % (4 * OCTAVE_TERMS))
_SERIES = np.cos(_ANGLES) * np.append(1.0, np.full(OCTAVE_TERMS - 1, 2.0)) / OCTAVE_TERMS
_POLYNOMIALS = [np.polynomial.chebyshev.cheb2poly(row) for row in np.eye(OCTAVE_TERMS)]
_POWERS = np.array([np.pad(row, (0, OCTAVE_TERMS - row.size)) for row in _POLYNOMIALS])
# 1/w at the nodes, as a share of its largest value.
RECIPROCALS = 0.25 * (np.cos(_ANGLES[:, 1]) + 3.0)

to_series, to_powers = multiply(_SERIES), multiply(_POWERS)
extent = span(OCTAVE_TERMS)

# V**2 at the start, so far and changes, and the time so far, of the bodies from which the polynomials follow.
BEGIN, SO_FAR, LOWEST, HIGHEST, SPENT, SERIES = range(0, 6 * OCTAVE_TERMS, OCTAVE_TERMS)
octave_buffer = on_stack(6 * OCTAVE_TERMS)


@Inner
def line_of_octave(first, v, tag):  # type: ignore[no-untyped-def]
    """Return the position of the line of an octave, given that of the data of the first gap of its block."""
    slot = tag % (BLOCK * OCTAVES_OF_GAP)
    of_gap = first + v * 4 * GAP_COLUMNS * (slot // OCTAVES_OF_GAP)
    return of_gap + FIRST_OF_OCTAVES + OCTAVE_COLUMNS * (slot % OCTAVES_OF_GAP)


@Inner
def forget_octaves(gaps, first, v):  # type: ignore[no-untyped-def]
    """Forget all octaves of a block."""
    for slot in range(BLOCK * OCTAVES_OF_GAP):
        gaps[line_of_octave(first, v, slot) + TAG] = 0.0


@Inner
def follow_bodies(bodies, v, gaps, first, work):  # type: ignore[no-untyped-def]
    """Pass a block with some bodies, the first and the last of which are given; return whether that is possible, and
    1 + E of the last one at the end, roughly.
    """
    undamped, few = 1.0, few_buffer()
    for gap in range(BLOCK):
        at = first + v * 4 * GAP_COLUMNS * gap + FIRST_OF_FEW
        for k in range(bodies[0], bodies[1] + 1):
            passed, begin = pass_few(work[SO_FAR + k], gaps, at, few), work[BEGIN + k]
            if not (passed.time > 0.0 and passed.end >= LEAST_RATIO * begin):
                return False, undamped
            work[LOWEST + k] = min(work[LOWEST + k], passed.low - begin)
            work[HIGHEST + k] = max(work[HIGHEST + k], passed.high - begin)
            work[SO_FAR + k], work[SPENT + k] = passed.end, work[SPENT + k] + passed.time
            undamped *= 1.0 + passed.lost if k == bodies[1] else 1.0
    return True, undamped


@Inner
def fill_functions(half, v, gaps, first, work):  # type: ignore[no-untyped-def]
    """Fill the rows SO_FAR and SPENT with the relative change of V**2 on a block and the time in units of 1/sqrt(w), at
    the nodes of an octave from w = 2 ``half`` on; return whether that is possible, and about 1 + E at the end.
    """
    for k in range(OCTAVE_TERMS):
        work[BEGIN + k] = half / RECIPROCALS[k]
        work[SO_FAR + k], work[SPENT + k], work[LOWEST + k], work[HIGHEST + k] = work[BEGIN + k], 0.0, 0.0, 0.0
    # If the slowest body cannot pass, the others need not be followed.
    if not follow_bodies((0, 0), v, gaps, first, work)[0]:
        return False, 1.0
    is_passed, undamped = follow_bodies((1, OCTAVE_TERMS - 1), v, gaps, first, work)
    for k in range(OCTAVE_TERMS):
        begin = work[BEGIN + k]
        work[SO_FAR + k], work[SPENT + k] = (work[SO_FAR + k] - begin) / begin, work[SPENT + k] * sqrt(begin)
    return is_passed, undamped


@Inner
def to_polynomial(row, size, work, out, at):  # type: ignore[no-untyped-def]
    """Fill in the coefficients of a function of 1/w, from ``out[at]`` on, given its values; return whether what is left
    out is as small as a rounding error of ``size``.
    """
    # Sums of the differences from one of the values have smaller rounding errors than those of the values.
    middle = work[row + OCTAVE_TERMS // 2]
    for k in range(OCTAVE_TERMS):
        work[row + k] -= middle
    to_series(work, row, work, SERIES)
    to_powers(work, SERIES, out, at)
    out[at] += middle
    last = SERIES + OCTAVE_TERMS - 1
    return max(fabs(work[last]), max(fabs(work[last - 1]), fabs(work[last - 2]))) <= MAX_LAST * size


@Inner
def fill_octave(half, v, gaps, first, to):  # type: ignore[no-untyped-def]
    """Fill the line of an octave from w = 2 ``half`` on, apart from its tag."""
    work = octave_buffer()
    gaps[to + STATE_OF_OCTAVE] = REFUSED
    is_passed, undamped = fill_functions(half, v, gaps, first, work)
    if not is_passed:
        return
    change_size, time_size = max(1.0 + extent(work, SO_FAR)[0], 1.0), extent(work, SPENT)[0]
    is_fine = to_polynomial(SO_FAR, change_size, work, gaps, to + CHANGES)
    if not (to_polynomial(SPENT, time_size, work, gaps, to + TIMES_IN_UNITS) and is_fine):
        return
    gaps[to + LOST_ON_BLOCK] = undamped - 1.0
    lowest, highest = extent(work, LOWEST), extent(work, HIGHEST)
    gaps[to + LOW_CHANGE], _ = widened(lowest[0], lowest[1])
    _, gaps[to + HIGH_CHANGE] = widened(highest[0], highest[1])
    gaps[to + STATE_OF_OCTAVE] = FILLED


@Inner
def sum_of_powers(x, gaps, at):  # type: ignore[no-untyped-def]
    """Return a polynomial in x; the terms of even and of odd degree are summed side by side."""
    even, odd = 0.0, 0.0
    for k in range(OCTAVE_TERMS - 2, -1, -2):
        odd = fma(odd, x * x, gaps[at + k + 1])
        even = fma(even, x * x, gaps[at + k])
    return fma(odd, x, even)


@Inner
def pass_by_octave(v2, v, gaps, first):  # type: ignore[no-untyped-def]
    """Return the time over a block at whose start V**2 is ``v2``, V**2 at its end, bounds on it, and about exp(q) - 1
    at the end.

    The time is NaN if V**2 changes too much. ``first`` is the position of the data kept of the block's first gap.
    """
    unknown = Bounds(0.0, inf, 0.0, inf)
    if gaps[first + FIRST_OF_BLOCK] != FILLED:
        return nan, nan, unknown, 0.0
    # This is w = 2**e/y with y from 1 to 1/2.
    mantissa, exponent = frexp(v2)
    to = line_of_octave(first, v, exponent + FIRST_TAG)
    if gaps[to + TAG] != exponent + FIRST_TAG:
        gaps[to + TAG] = exponent + FIRST_TAG
        fill_octave(0.5 * (v2 / mantissa), v, gaps, first, to)
    if gaps[to + STATE_OF_OCTAVE] != FILLED:
        return nan, nan, unknown, 0.0
    x = 2.0 / mantissa - 3.0
    end, time = v2 + v2 * sum_of_powers(x, gaps, to + CHANGES), sum_of_powers(x, gaps, to + TIMES_IN_UNITS) / sqrt(v2)
    low, high = max(v2 + gaps[to + LOW_CHANGE], 0.0), v2 + gaps[to + HIGH_CHANGE]
    return time, end, lengths_on(gaps, first + FIRST_OF_BLOCK, low, high), gaps[to + LOST_ON_BLOCK]
