"""Branch points of ds beside a leg, and the order of attempts to resolve the leg as one polynomial.

If the forces are not linear in V**2, an attempt begins with V**2 from the one before.
"""

from math import asin, cos, cosh, fabs, inf, log, pi, sin, sinh, sqrt
from typing import NamedTuple

import numpy as np

from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import on_stack, over_rows
from gqm_sym.runtime.legs.kinks.places import note_place
from gqm_sym.runtime.legs.panels.equation import (
    DS,
    EXPM1_Q,
    FORCE,
    KAPPA,
    MEAN,
    NODES,
    SERIES,
    SPEED,
    TAILS,
    D,
    W,
    copy_row,
    linear_row,
    product,
)
from gqm_sym.runtime.legs.panels.polynomials import COUNT, SHARES, WIDE, last_sum_row, next_sum_row
from gqm_sym.runtime.legs.runs.leg_variable import (
    BranchPoint,
    LegVariable,
    grown_row,
    stretched_row,
    unstretched,
    variable_for,
)
from gqm_sym.runtime.legs.runs.whole_rows import (
    BETWEEN_TURNS,
    GRADE,
    begin_leg,
    examine_row,
    keep_positive,
    sample_leg,
    size_of_row,
    size_row,
    v2_row,
)
from gqm_sym.runtime.legs.runs.whole_tables import (
    IN_SHARE,
    MAX_BLOCKS,
    to_coefficients,
    to_nodes,
    to_tails,
    variable_at,
)

# The largest number of steps of Newton's method to a branch point, and the last step as a share of its height. The map
# need not be that of the exact place.
MAX_STEPS, LAST_STEP = 12, 0.02

# The largest height of a branch point beside a leg, in half widths.
MAX_HEIGHT = 2.0

# The number of blocks of a leg that has not been tried without a map.
NOT_TRIED = -1

# The last coefficients of the force are those of the turning rate if they differ from a multiple of them by less than
# this share of their size.
MAX_DIFFERENCE = 0.5

# A branch point of the turning rate divides a leg if it is not beside this share of its half width, or less, at an end.
LEAST_PART = 0.1

# A map must be expected to save this factor of nodes, because estimates are rough, and other branch points may be as
# near.
LEAST_GAIN = 1.05

factor_of_v2_row = over_rows(lambda w, vanishing: w / vanishing, WIDE)
product_row = over_rows(lambda y: y - y * y, WIDE)

series_buffer, terms_buffer = on_stack(WIDE), on_stack(MAX_BLOCKS * WIDE)


class Attempt(NamedTuple):
    """How a leg is tried as one polynomial.

    Attributes
    ----------
    blocks : int
        The number of blocks (`whole_tables`); 0 if there is no further attempt.
    variable : LegVariable
    branch : BranchPoint
        The branch point of ds that is known.
    plain_blocks : int
        The number of blocks expected without a map, or 0 if there is none, in the first attempt with a map; otherwise
        NOT_TRIED.
    plain_ratio : float
        The ratio of middle coefficients to sizes without a map.
    """

    blocks: int
    variable: LegVariable
    branch: BranchPoint
    plain_blocks: int
    plain_ratio: float


@Inner
def first_guess(squares):  # type: ignore[no-untyped-def]
    """Return where a parabola through the smallest of some values at the nodes, and those beside it, vanishes, as real
    and imaginary part of a place in [-1, 1]; NaN if there is no minimum between the ends.
    """
    j = 0
    for k in range(1, COUNT):
        j = k if squares[k] < squares[j] else j
    if j == 0 or j == COUNT - 1:
        return np.nan, np.nan
    before, here, after = 2.0 * SHARES[j - 1] - 1.0, 2.0 * SHARES[j] - 1.0, 2.0 * SHARES[j + 1] - 1.0
    slope = (squares[j] - squares[j - 1]) / (here - before)
    bend = ((squares[j + 1] - squares[j]) / (after - here) - slope) / (after - before)
    middle = 0.5 * (before + here - slope / bend)
    least = squares[j] / bend - (here - middle) * (here - middle)
    return middle, min(sqrt(max(least, 0.0)), MAX_HEIGHT)


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
def zero_beside(work):  # type: ignore[no-untyped-def]
    """Return the zero of the row SERIES beside a leg, as real and imaginary part of a place in [-1, 1], given rows with
    23 nodes; NaN if there is none.
    """
    terms = series_buffer()
    x, y = first_guess(work[SERIES : SERIES + COUNT])
    if y > 0.0:
        to_coefficients(1, work, SERIES, terms, 0)
        x, y = zero_of_series(terms, x, y)
        if work[GRADE] > IN_SHARE:
            phase, height = 0.5 * pi * (1.0 + x), 0.5 * pi * y
            if work[GRADE] == 2.0:  # pi (3 u**2 - 2 u**3) = pi u**2 (3 - 2 u), with 2 u = 1 + x + i y
                u, v = 0.5 * (1.0 + x), 0.5 * y
                real, imaginary, rest = u * u - v * v, 2.0 * u * v, 3.0 - 2.0 * u
                phase = pi * (real * rest + 2.0 * v * imaginary)
                height = pi * (imaginary * rest - 2.0 * v * real)
            x, y = -cos(phase) * cosh(height), fabs(sin(phase) * sinh(height))
    return (x, y) if fabs(x) <= 1.0 and 0.0 < y <= MAX_HEIGHT else (np.nan, np.nan)


@Inner
def branch_beside(march, width, work):  # type: ignore[no-untyped-def]
    """Return a branch point of ds beside a leg, given rows with 23 nodes without a map; its height is infinite if there
    is none, or ds is resolved.
    """
    none = BranchPoint(0.0, inf)
    if examine_row(1, work, DS, size_of_row(1, work, DS))[2]:
        return none
    product(work, SERIES, DS, DS)
    x, y = zero_beside(work)
    if not y > 0.0:
        return none
    distance = 0.5 * width * (1.0 + x)
    return BranchPoint(march.origin[0] + (march.direction * distance + march.origin[1]), 0.5 * width * y)


@Inner
def is_bent_by_turning(blocks, work):  # type: ignore[no-untyped-def]
    """Return whether the last coefficients of the force on a leg are mostly those of a multiple of the turning rate, ds
    times the curvature.
    """
    at, rate = blocks * TAILS, blocks * SERIES
    for k in range(0, blocks * WIDE, WIDE):
        product(work, rate + k, blocks * DS + k, blocks * KAPPA + k)
    to_tails(blocks, work, rate, work, at)
    a, b, c = work[at], work[at + 1], work[at + 2]
    to_tails(blocks, work, blocks * FORCE, work, at)
    d, e, f = work[at], work[at + 1], work[at + 2]
    one, other, both = a * a + b * b + c * c, d * d + e * e + f * f, a * d + b * e + c * f
    # The square of the difference is less by the square of the multiple.
    return one * other - both * both <= MAX_DIFFERENCE * MAX_DIFFERENCE * one * other and both != 0.0


@Inner
def branch_of_turning(march, width, work):  # type: ignore[no-untyped-def]
    """Return the place beside a leg over which the turning rate of a space curve, the root of a sum of squares, has a
    branch point, given rows with 23 nodes without a map; NaN if there is none.
    """
    product(work, SERIES, DS, DS)
    product(work, SERIES, SERIES, DS)
    product(work, SERIES, SERIES, KAPPA)  # in its square nothing is divided by ds
    product(work, SERIES, SERIES, SERIES)
    x, _ = zero_beside(work)
    distance = 0.5 * width * (1.0 + x)
    place = march.origin[0] + (march.direction * distance + march.origin[1])
    return place if fabs(x) <= 1.0 - LEAST_PART else np.nan


@Inner
def note_branch_of_turning(forces, march, panel, blocks, variable, kinks, work):  # type: ignore[no-untyped-def]
    """Note the place beside a leg over which the turning rate has a branch point, if that is what the last coefficients
    of the force are due to; return whether there is one.

    The turning rate of a planar curve has a sign, and no branch points; legs past places where it vanishes are those
    past kinks.
    """
    if forces.squared_contact == 0 or not forces.linear or kinks.size == 1 or kinks[0] < 0.0:
        return False
    if not (sample_leg(forces, march, panel, blocks, variable, work) and is_bent_by_turning(blocks, work)):
        return False
    begin_leg(1, work)
    h = variable.width
    if not sample_leg(forces, march, panel, 1, unstretched(h), work):
        return False
    place = branch_of_turning(march, h, work)
    return place == place and note_place(place, kinks)


@Inner
def first_attempt(blocks, branch, march, width):  # type: ignore[no-untyped-def]
    """Return the first attempt to resolve a leg of about this width."""
    variable = variable_for(branch, march.origin, march.direction, width)
    return Attempt(blocks, variable, branch, NOT_TRIED, 1.0)


@Inner
def is_better(attempt, onwards, ratio):  # type: ignore[no-untyped-def]
    """Return whether the first attempt with a map shows that it saves nodes."""
    if onwards == 0 or attempt.plain_blocks == 0:
        return onwards > 0
    return onwards <= attempt.plain_blocks and log(ratio) <= LEAST_GAIN * log(attempt.plain_ratio)


@Inner
def next_attempt(attempt, onwards, ratio, march, work):  # type: ignore[no-untyped-def]
    """Return the attempt after one that has not resolved a leg.

    A leg is stretched if its own rows with 23 nodes show a branch point, and the map saves nodes or nothing else
    resolves the leg.

    Parameters
    ----------
    attempt : Attempt
    onwards : int
        The number of blocks that are expected to resolve the leg with the variable of the attempt, or 0.
    ratio : float
        The largest ratio of middle coefficients to sizes of the rows of the law.
    march : March
    work : array
        The rows of the attempt.
    """
    blocks, variable, branch = attempt.blocks, attempt.variable, attempt.branch
    unused = BranchPoint(branch.place, -branch.height)
    if blocks == 1 and variable.extent == 0.0 and 0.0 <= branch.height < inf:
        branch = branch_beside(march, variable.width, work)
        stretched = variable_for(branch, march.origin, march.direction, variable.width)
        if stretched.extent > 0.0:
            return Attempt(1, stretched, branch, onwards, ratio)
    elif attempt.plain_blocks != NOT_TRIED and not is_better(attempt, onwards, ratio):
        return Attempt(attempt.plain_blocks, unstretched(variable.width), unused, NOT_TRIED, 1.0)
    elif onwards == 0 and branch.height < 0.0:
        stretched = variable_for(unused, march.origin, march.direction, variable.width)
        if stretched.extent > 0.0:
            return Attempt(MAX_BLOCKS, stretched, unused, NOT_TRIED, 1.0)
    return Attempt(onwards, variable, branch, NOT_TRIED, 1.0)


@Inner
def fill_variable(work, row, shares):  # type: ignore[no-untyped-def]
    """Fill a row with the variable u of the grade of a leg at a row of shares of the way."""
    for j in range(WIDE):
        work[row + j] = variable_at(int(work[GRADE]), 2.0 * asin(sqrt(min(work[shares + j], 1.0))))


@Inner
def carry_v2(forces, known, old, blocks, new, vanishing, work):  # type: ignore[no-untyped-def]
    """Fill in the nodes, and the row W as far as it is known; return whether it is.

    It is not carried into a variable that is less stretched, nor if the forces are linear in V**2. What is carried is
    W over ``y (1 - y)``, or over y, because the law may depend on the digits of the root of W beside a turn.

    Parameters
    ----------
    forces : Forces
    known : int
        The number of blocks with which V**2 is known.
    old : LegVariable
        The variable of the leg for that.
    blocks, new
        The same for the rows to be filled.
    vanishing : int
        As in `whole_rows.fill_v2`.
    work : array
    """
    if blocks == 0:
        return False
    if forces.linear or not (old.extent == 0.0 or new.extent == old.extent):
        begin_leg(blocks, work)
        return False
    terms = terms_buffer()
    for at in range(0, known * WIDE, WIDE):
        factor_of_v2_row(work, known * W + at, known * W + at, known * vanishing + at)
    to_coefficients(known, work, known * W, terms, 0)
    begin_leg(blocks, work)
    to_nodes(blocks, work, 0, work, blocks * D)
    for at in range(0, blocks * WIDE, WIDE):
        # Clenshaw's recurrence at the places in [-1, 1] that belong to the new nodes.
        twice_x, one, other, factor = blocks * D + at, blocks * MEAN + at, blocks * SPEED + at, blocks * vanishing + at
        if new.extent != old.extent:
            factor = shares = blocks * EXPM1_Q + at
            grown_row(work, shares, blocks * NODES + at, new.extent)
            stretched_row(work, shares, shares, new.rising, new.falling)
            product(work, shares, shares, 1.0 / new.width)
            copy_row(work, twice_x, shares)
            if work[GRADE] > IN_SHARE:
                fill_variable(work, twice_x, shares)
            if vanishing == BETWEEN_TURNS:
                product_row(work, factor, shares)
        linear_row(work, twice_x, twice_x, -2.0, 4.0)
        copy_row(work, one, 0.0)
        copy_row(work, other, 0.0)
        for k in range(known * WIDE - 2, 0, -2):  # each sum replaces the last but one
            next_sum_row(work, other, twice_x, one, other, terms[k])
            next_sum_row(work, one, twice_x, other, one, terms[k - 1])
        last_sum_row(work, twice_x, twice_x, one, other, terms[0])
        v2_row(work, blocks * W + at, twice_x, factor, 1.0)
        size_row(work, blocks * W + at, blocks * W + at)
    keep_positive(blocks, work)
    return True
