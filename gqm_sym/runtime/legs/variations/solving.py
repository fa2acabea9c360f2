"""The solutions of the variational equation on the panels of legs (`equation`).

The solutions on a panel are rows of WIDE numbers, for its nodes and for its end: for each solution the change of the
time from the origin, then for each solution y/W at the nodes and y at the end, then for each parameter the integral of
the derivative of ds/dlam from the origin. A row of the law that is zero at all nodes takes no integral.

Where only the places of turns and ends are asked for, only y at the ends of panels is needed (`solve_end`), and no
times.
"""

from math import fabs, inf

import numpy as np

from gqm_sym.runtime.arithmetic.elementary import exp
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import borrowed, copied, on_stack, opaque, over_rows
from gqm_sym.runtime.legs.panels.polynomials import (
    COUNT,
    ENDS_BY_NODE,
    GRADED_MEANS,
    MEANS,
    WIDE,
    to_graded_means,
    to_means,
)
from gqm_sym.runtime.legs.variations.equation import (
    MOVES,
    OUTWARD,
    PANEL_BEGIN,
    PANEL_HALF_C,
    PANEL_HEADING,
    PANEL_WIDTH,
    SPEEDS,
    TO_END,
    TO_START,
    end_speed,
    place_on,
    value_at_end,
)

# The weights by which the values at the nodes of a panel give the mean over it, and that with respect to the square of
# the share.
MEAN_WEIGHTS, GRADED_WEIGHTS = (np.append(table[COUNT], 0.0) for table in (MEANS, GRADED_MEANS))

# A panel that begins this near to a break of the curve, as a share of the place, counts as beginning there.
AT_BREAK = 1e-12

# The rows of the work array of a panel:
#
# ========== ====================================================================================
# row        meaning
# ========== ====================================================================================
# NODES      the nodes and the end, as shares of the panel
# OFFSET     the march variable from the panel's start
# REACH      the same times the direction u
# GROWTH     V over Y
# SPEED      Y
# FACTOR     the integrating factor, exp of the integral of u F_W
# INVERSE    1 over it
# PER_W      1 over V**2
# PER_DS     1 over ds/dlam
# TIME_RATE  dt/dw
# STRAIN     the derivative of ds/dlam
# SOURCE     that of the force, then what is integrated
# MEAN       its means, then the integral; in `solve_end` the weights of an integral over the panel
# GRADED     its means with the measure of the march variable
# Y          y, then y/W
# ========== ====================================================================================
NODES, OFFSET, REACH, GROWTH, SPEED, FACTOR, INVERSE, PER_W, PER_DS, TIME_RATE, STRAIN, SOURCE, MEAN, GRADED, Y = range(
    0, 15 * WIDE, WIDE
)
solution_buffer = on_stack(15 * WIDE)

copy = copied(WIDE)
constant_row = over_rows(lambda row: row, WIDE)
linear_row = over_rows(lambda x, begin, slope: begin + slope * x, WIDE)
product_row = over_rows(lambda one, other: one * other, WIDE)
triple_row = over_rows(lambda one, other, factor: factor * one * other, WIDE)
inverse_row = over_rows(lambda row, one: one / row, WIDE)
inverse_square_row = over_rows(lambda speed, growth, one: one / ((speed * growth) * (speed * growth)), WIDE)
quotient_row = over_rows(lambda one, other, factor: factor * one / other, WIDE)
graded_integral_row = over_rows(lambda reach, mean, y, graded, slope: reach * (slope * mean + y * graded), WIDE)
solution_row = over_rows(lambda factor, gained, begin: factor * (gained + begin), WIDE)
slower_row = over_rows(lambda rate, share: -0.5 * share * rate, WIDE)
strained_row = over_rows(lambda rate, share, strain, per_ds: rate * (strain * per_ds - 0.5 * share), WIDE)


@Inner
def jump(panels, forces, breaks, one, other, weights):  # type: ignore[no-untyped-def]
    """Return the jump of the force from the end of a panel to an end of another one.

    At a given distance from a moving origin, V**2 changes there by the jump times the shift of the origin. The force at
    the nodes is ``forces``; the ``weights`` are those of one end of the other panel.
    """
    if breaks.size == 0:
        return 0.0
    panel = panels[one]
    place = place_on(panel, panel[PANEL_BEGIN] + panel[PANEL_WIDTH])[0]
    nearest, largest = inf, 0.0
    for at in breaks:
        nearest, largest = min(nearest, fabs(place - at)), max(largest, fabs(at))
    if nearest > AT_BREAK * (fabs(place) + largest):
        return 0.0
    return value_at_end(weights, forces, other * WIDE) - value_at_end(TO_END, forces, one * WIDE)


@Inner
def is_zero(work, row):  # type: ignore[no-untyped-def]
    """Return whether a row vanishes at all nodes."""
    zero = True
    for j in range(COUNT):
        zero = zero and work[row + j] == 0.0
    return zero


@Inner
def fill_integral(panel, work):  # type: ignore[no-untyped-def]
    """Fill MEAN with the integrals of u SOURCE over the distance, from the start of a panel to its nodes and end."""
    to_means(work, SOURCE, work, MEAN)
    half_c = panel[PANEL_HALF_C]
    if half_c == inf:
        product_row(work, MEAN, REACH, MEAN)
    else:
        to_graded_means(work, SOURCE, work, GRADED)
        slope = 2.0 * (panel[PANEL_BEGIN] + half_c)
        graded_integral_row(work, MEAN, REACH, MEAN, OFFSET, GRADED, slope)


@Inner
def fill_factor(panel, law, at, work):  # type: ignore[no-untyped-def]
    """Fill the rows OFFSET to GROWTH, FACTOR and INVERSE; F_W at the nodes is in the law, a line, from an index on."""
    half_c, width = panel[PANEL_HALF_C], panel[PANEL_WIDTH]
    twice = 1.0 if half_c == inf else 2.0
    product_row(work, OFFSET, NODES, width)
    product_row(work, REACH, OFFSET, panel[OUTWARD])
    if half_c == inf:
        constant_row(work, GROWTH, 1.0)
    else:
        linear_row(work, GROWTH, OFFSET, panel[PANEL_BEGIN] + half_c, 1.0)
    copy(work, SOURCE, law, at)
    # Integrals are over w and not over the distance: laws with the square root of W have a pole at a turn, which the
    # growth of the distance with w cancels.
    triple_row(work, SOURCE, GROWTH, SOURCE, twice)
    to_means(work, SOURCE, work, FACTOR)
    product_row(work, FACTOR, FACTOR, REACH)
    for j in range(opaque(WIDE)):
        work[FACTOR + j] = exp(work[FACTOR + j])
    inverse_row(work, INVERSE, FACTOR, 1.0)


@Inner
def prepare(panel, law, step, at, parameters, work):  # type: ignore[no-untyped-def]
    """Fill the rows up to TIME_RATE; the law is a line whose rows begin ``step`` apart, ``at`` a number in each."""
    twice = 1.0 if panel[PANEL_HALF_C] == inf else 2.0
    fill_factor(panel, law, (parameters + 4) * step + at, work)
    copy(work, SPEED, panel, SPEEDS)
    inverse_square_row(work, PER_W, SPEED, GROWTH, 1.0)
    copy(work, SOURCE, law, at)
    inverse_row(work, PER_DS, SOURCE, 1.0)
    quotient_row(work, TIME_RATE, SOURCE, SPEED, twice)


@Inner
def solve_panel(panel, law, step, at, state, out, work):  # type: ignore[no-untyped-def]
    """Fill the solutions on a panel (a row of WIDE numbers for each, as the module says).

    Parameters
    ----------
    panel : array
        The panel.
    law : array
        The law in states (`law.Law.matrix`), as a line.
    step : int
        The number of states.
    at : int
        The state at the first node of the panel.
    state : (3, n + 2) array
        The solutions at the beginning of the panel: y, the change of the time, and for each parameter the integral of
        ds/dlam. They are set to those at its end.
    out : array
        What is filled, as one line.
    work : array
        The rows of work, of which NODES is filled.
    """
    n = state.shape[1] - 2
    prepare(panel, law, step, at, n, work)
    by_distance = panel[PANEL_HALF_C] == inf
    for row in range(n + 2):
        # A row for each parameter, for sigma, and for the solution that begins with y = 1, which has no source.
        has_source, is_strained = row < n or (row == n and panel[MOVES] > 0.0), False
        is_forced = has_source
        if has_source:
            copy(work, STRAIN, law, (2 + row if row < n else 1) * step + at)
            copy(work, SOURCE, law, (n + 5 + row if row < n else n + 3) * step + at)
            is_forced, is_strained = not is_zero(work, SOURCE), not is_zero(work, STRAIN)
        if is_forced:
            product_row(work, SOURCE, SOURCE, INVERSE)
            fill_integral(panel, work)
            solution_row(work, Y, FACTOR, MEAN, state[0, row])
        else:
            product_row(work, Y, FACTOR, state[0, row])
        state[0, row] = work[Y + COUNT]
        times, shares = row * WIDE, (n + 2 + row) * WIDE
        # No solution begins with y = 1 where V**2 is 0.
        product_row(work, Y, Y, PER_W)
        if row == n + 1 and not by_distance:
            constant_row(work, Y, 0.0)
        copy(out, shares, work, Y)
        out[shares + COUNT] = state[0, row]
        if is_strained:
            strained_row(work, SOURCE, TIME_RATE, Y, STRAIN, PER_DS)
        else:
            slower_row(work, SOURCE, TIME_RATE, Y)
        to_means(work, SOURCE, work, MEAN)
        product_row(work, MEAN, MEAN, OFFSET)
        linear_row(work, MEAN, MEAN, state[1, row], 1.0)
        copy(out, times, work, MEAN)
        state[1, row] = work[MEAN + COUNT]
        if row < n:
            constant_row(work, MEAN, 0.0)
            if is_strained:
                constant_row(work, SOURCE, STRAIN)
                fill_integral(panel, work)
            linear_row(work, MEAN, MEAN, state[2, row], 1.0)
            copy(out, (2 * n + 4 + row) * WIDE, work, MEAN)
            state[2, row] = work[MEAN + COUNT]


@Inner
def weighted_sum(law, at, work):  # type: ignore[no-untyped-def]
    """Return the sum of numbers of the law, from an index on, times the weights in the row MEAN."""
    first, second, third, fourth = 0.0, 0.0, 0.0, 0.0
    for j in range(0, WIDE, 4):
        first += work[MEAN + j] * law[at + j]
        second += work[MEAN + j + 1] * law[at + j + 1]
        third += work[MEAN + j + 2] * law[at + j + 2]
        fourth += work[MEAN + j + 3] * law[at + j + 3]
    return (first + second) + (third + fourth)


@Inner
def solve_end(panel, law, step, at, state, out, work):  # type: ignore[no-untyped-def]
    """Fill y at the end of a panel for all solutions, and zeros for what depends on times; the arguments are those of
    `solve_panel`.
    """
    n = state.shape[1] - 2
    fill_factor(panel, law, (n + 4) * step + at, work)
    half_c, width, reach, factor = panel[PANEL_HALF_C], work[OFFSET + COUNT], work[REACH + COUNT], work[FACTOR + COUNT]
    if half_c == inf:
        for j in range(WIDE):
            work[MEAN + j] = work[INVERSE + j] * (reach * MEAN_WEIGHTS[j])
    else:
        slope = 2.0 * (panel[PANEL_BEGIN] + half_c)
        for j in range(WIDE):
            work[MEAN + j] = work[INVERSE + j] * (reach * (slope * MEAN_WEIGHTS[j] + width * GRADED_WEIGHTS[j]))
    for row in range(n + 2):
        gained = 0.0
        if row < n or (row == n and panel[MOVES] > 0.0):
            gained = weighted_sum(law, (n + 5 + row if row < n else n + 3) * step + at, work)
        state[0, row] = factor * (gained + state[0, row])
        out[row * WIDE + COUNT], out[(n + 2 + row) * WIDE + COUNT] = 0.0, state[0, row]
        if row < n:
            out[(2 * n + 4 + row) * WIDE + COUNT] = 0.0


@Inner
def solve_panels(panels, first, law, parameters, breaks, solutions, timed):  # type: ignore[no-untyped-def]
    """Fill the solutions on all panels; unless they are ``timed``, only what the places of ends follow from, for which
    the law needs ds/dlam only where runs begin and end.
    """
    panels, law, solutions = borrowed(panels), borrowed(law), borrowed(solutions)
    n, step, size = parameters, law.shape[1], solutions.shape[1] * WIDE
    marks = step - WIDE * panels.shape[0]
    line, forces, state, work = law.reshape(law.size), law[n + 2, marks:], np.zeros((3, n + 2)), solution_buffer()
    for j in range(WIDE):
        work[NODES + j] = ENDS_BY_NODE[j]
    for half in range(first.size - 1):
        state[:, :] = 0.0
        state[0, n + 1] = 1.0
        for k in range(first[half], first[half + 1]):
            if k > first[half] and panels[k, MOVES] > 0.0:
                state[0, n] += jump(panels, forces, breaks, k - 1, k, TO_START)
            elif k > first[half] and panels[k - 1, MOVES] > 0.0:
                state[0, n] -= value_at_end(TO_END, forces, (k - 1) * WIDE)
                if timed:
                    ds = value_at_end(TO_END, law[0, marks:], (k - 1) * WIDE)
                    state[1, n] -= panels[k, PANEL_HEADING] * ds / end_speed(panels[k - 1])
            out = solutions[k].reshape(size)
            if timed:
                solve_panel(panels[k], line, step, marks + k * WIDE, state, out, work)
            else:
                solve_end(panels[k], line, step, marks + k * WIDE, state, out, work)
