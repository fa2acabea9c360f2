"""Branch points of ds beside a leg, and the order of attempts to resolve the leg as one polynomial."""

from math import fabs, inf, sqrt
from typing import NamedTuple

import numpy as np

from gqm_sym.runtime.compiled.jit import Inlined, Inner
from gqm_sym.runtime.compiled.registers import on_stack
from gqm_sym.runtime.legs.panels.equation import DS, SERIES, product
from gqm_sym.runtime.legs.panels.polynomials import COUNT, SHARES, WIDE, to_coefficients
from gqm_sym.runtime.legs.runs.leg_variable import BranchPoint, LegVariable, unstretched, variable_for
from gqm_sym.runtime.legs.runs.whole_rows import examine_row, size_of_row

# The largest number of steps of Newton's method to a branch point, and the last step as a share of its height. The map
# need not be that of the exact place.
MAX_STEPS, LAST_STEP = 12, 0.02

# The largest height from which that begins, and the one from which it begins where ds has no minimum, in half widths.
MAX_HEIGHT, SOME_HEIGHT = 2.0, 0.5

# The number of blocks of a leg that has not been tried without a map.
NOT_TRIED = -1

series_buffer = on_stack(WIDE)


class Attempt(NamedTuple):
    """How a leg is tried as one polynomial.

    Attributes
    ----------
    blocks : int
        The number of blocks (`whole_tables`); 0 if there is no further attempt.
    variable : LegVariable
    branch : BranchPoint
        The branch point of ds that is known.
    unstretched_blocks : int
        The number of blocks expected without a map, or 0 if there is none, after an attempt without one and before the
        next; otherwise NOT_TRIED.
    """

    blocks: int
    variable: LegVariable
    branch: BranchPoint
    unstretched_blocks: int


@Inner
def first_guess(squares):  # type: ignore[no-untyped-def]
    """Return where a parabola through the smallest of some values at the nodes, and those beside it, vanishes, as real
    and imaginary part of a place in [-1, 1].
    """
    j = 1
    for k in range(2, COUNT - 1):
        j = k if squares[k] < squares[j] else j
    before, here, after = 2.0 * SHARES[j - 1] - 1.0, 2.0 * SHARES[j] - 1.0, 2.0 * SHARES[j + 1] - 1.0
    slope = (squares[j] - squares[j - 1]) / (here - before)
    bend = ((squares[j + 1] - squares[j]) / (after - here) - slope) / (after - before)
    if not bend > 0.0:
        return here, SOME_HEIGHT
    middle = 0.5 * (before + here - slope / bend)
    least = squares[j] / bend - (here - middle) * (here - middle)
    if not (fabs(middle) <= 1.0 and least > 0.0):
        return here, SOME_HEIGHT
    return middle, min(sqrt(least), MAX_HEIGHT)


@Inner
def zero_of_series(terms, x, y):  # type: ignore[no-untyped-def]
    """Return the zero ``x + i y`` of a Chebyshev series by Newton's method from a place near it; NaN if it does not
    converge.
    """
    for _ in range(MAX_STEPS):
        # Clenshaw's recurrence for the series (b) and its derivative (d), in real and imaginary parts.
        b, bi, b_after, bi_after, d, di, d_after, di_after = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(COUNT - 1, 0, -1):
            d_next = 2.0 * (b + (x * d - y * di)) - d_after
            di_next = 2.0 * (bi + (x * di + y * d)) - di_after
            b_next = terms[k] + 2.0 * (x * b - y * bi) - b_after
            bi_next = 2.0 * (x * bi + y * b) - bi_after
            b, bi, b_after, bi_after = b_next, bi_next, b, bi
            d, di, d_after, di_after = d_next, di_next, d, di
        value, value_i = terms[0] + (x * b - y * bi) - b_after, (x * bi + y * b) - bi_after
        slope, slope_i = b + (x * d - y * di) - d_after, bi + (x * di + y * d) - di_after
        size = slope * slope + slope_i * slope_i
        step, step_i = (value * slope + value_i * slope_i) / size, (value_i * slope - value * slope_i) / size
        x, y = x - step, y - step_i
        if fabs(step) + fabs(step_i) <= LAST_STEP * fabs(y):
            return x, fabs(y)
    return np.nan, np.nan


@Inner
def branch_beside(march, width, work):  # type: ignore[no-untyped-def]
    """Return a branch point of ds beside a leg, given rows with 23 nodes without a map; its height is infinite if there
    is none, or ds is resolved.
    """
    terms, none = series_buffer(), BranchPoint(0.0, inf)
    if examine_row(1, work, DS, size_of_row(1, work, DS))[2]:
        return none
    product(work, SERIES, DS, DS)
    x, y = first_guess(work[SERIES : SERIES + COUNT])
    to_coefficients(work, SERIES, terms, 0)
    x, y = zero_of_series(terms, x, y)
    if not (fabs(x) <= 1.0 + y and 0.0 < y <= MAX_HEIGHT):
        return none
    distance = 0.5 * width * (1.0 + x)
    return BranchPoint(march.origin[0] + (march.direction * distance + march.origin[1]), 0.5 * width * y)


@Inlined
def is_fewer(blocks, others):  # type: ignore[no-untyped-def]
    """Return whether one expected number of blocks is less than another, where 0 means that there is none."""
    return blocks > 0 and (others == 0 or blocks < others)


@Inner
def next_attempt(attempt, onwards, march, work):  # type: ignore[no-untyped-def]
    """Return the attempt after one that has not resolved a leg.

    A leg is stretched if its own rows with 23 nodes show a branch point, and the map saves blocks.

    Parameters
    ----------
    attempt : Attempt
    onwards : int
        The number of blocks that are expected to resolve the leg with the variable of the attempt, or 0.
    march : March
    work : array
        The rows of the attempt.
    """
    blocks, variable, branch, unstretched_blocks = attempt
    if blocks == 1 and variable.extent == 0.0 and branch.height < inf:
        branch = branch_beside(march, variable.width, work)
        stretched = variable_for(branch, march.origin, march.direction, variable.width)
        if stretched.extent > 0.0:
            return Attempt(1, stretched, branch, onwards)
    elif unstretched_blocks != NOT_TRIED and not is_fewer(onwards, unstretched_blocks):
        return Attempt(unstretched_blocks, unstretched(variable.width), BranchPoint(0.0, inf), NOT_TRIED)
    return Attempt(onwards, variable, branch, NOT_TRIED)
