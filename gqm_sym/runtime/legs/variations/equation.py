"""The variational equation along the panels of legs, in the march variable in which the legs were found.

The law of motion is dW/dlam = F(lam, W; p), where W is V**2. If the beginning of a half of a leg (its *origin*: the
start, or the turn at the end) moves by sigma, then W at a given distance d from the origin changes by y with

    dy/dd = u (F_W y + F_p + F_lam sigma),

where u is the direction in which d grows. This is the equation of the leg itself with another right-hand side, so that
the same integrating factor solves it. From a turning point y begins with 0 and vanishes as W does, so that y/W and the
change of the time per w, ``dt/dw (ds_p/ds + ds_lam sigma/ds - y/(2 W))``, are smooth in the march variable w there too.
The solutions for each parameter (with sigma = 0), for sigma = 1 alone, and for y = 1 at the origin are found for all
panels; the change of a leg is a linear combination of them (`chain`).

A body that comes to no turn may slow down on its way to an equilibrium, where the change of the time grows as the speed
decreases: the place of the body would be a small difference of two large changes. From the panel on which the speed
decreases, sigma is therefore replaced by the changes of W and of the time at a given *place*, which are ``y - F sigma``
and ``delay - v sigma ds/V`` (`chain`); the origin does not move any more.

Each run has two *halves*: number 2k is that of run k from its start, 2k + 1 that from its end. Either may have no
panels. A panel is a row of PANEL_COLUMNS numbers: the march variable at its beginning, its width, the place of the
origin as two doubles, u, the signs of dlam/dt and of N, c/2 of the march variable (infinite if that is the distance),
and 1 if sigma moves the origin (0 from the panel on which a body slows down without a turn); from SPEEDS on, Y at its
nodes.

The solutions on a panel are rows of WIDE numbers, for its nodes and for its end: for each solution the change of the
time from the origin, then for each solution y/W at the nodes and y at the end, then for each parameter the integral of
the derivative of ds/dlam from the origin.
"""

from math import exp, fabs, inf

import numpy as np
from numba import types

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.types import MATRIX, VECTOR
from gqm_sym.runtime.legs.leg_record import (
    AHEAD,
    BACK,
    COLUMNS,
    END,
    HALF_C,
    HEAD,
    HEADING,
    MIDDLE,
    NORMAL_LOAD,
    RIGHT,
    START,
    START_V2,
    Y_ROW,
)
from gqm_sym.runtime.legs.panels.polynomials import (
    COUNT,
    ENDS_BY_NODE,
    SHARES,
    TO_COEFFICIENTS,
    WIDE,
    to_coefficients,
    to_graded_means,
    to_means,
)

# The matrix that maps values at the nodes to those at both ends of a panel.
TO_START, TO_END = (-1.0) ** np.arange(COUNT) @ TO_COEFFICIENTS, TO_COEFFICIENTS.sum(axis=0)

# A panel that begins this near to a break of the curve, as a share of the place, counts as beginning there.
AT_BREAK = 1e-12

PANEL_BEGIN, PANEL_WIDTH, ORIGIN, ORIGIN_LOW, OUTWARD, PANEL_HEADING, CONTACT_SIGN, PANEL_HALF_C, MOVES = range(9)
SPEEDS, PANEL_COLUMNS = WIDE, 2 * WIDE

# The rows of states (`law.states_of`).
PLACE, PLACE_LOW, W, STATE_HEADING, STATE_SIGN = range(5)

# The number of states of each run before those of the nodes: its start, its end and its middle.
MARKS = 3

CUBE, WHOLE = types.float64[:, :, ::1], types.int64[::1]


@Inner
def distance_at(panel, w):  # type: ignore[no-untyped-def]
    """Return the distance from the origin at a march variable, and V over Y there."""
    half_c = panel[PANEL_HALF_C]
    return (w, 1.0) if half_c == inf else (w * (w + 2.0 * half_c), w + half_c)


@Inner
def place_on(panel, w):  # type: ignore[no-untyped-def]
    """Return the place at a march variable, as two doubles."""
    high, low = two_sum(panel[ORIGIN], panel[OUTWARD] * distance_at(panel, w)[0])
    return high, low + panel[ORIGIN_LOW]


@Inner
def value_at_end(weights, line, at):  # type: ignore[no-untyped-def]
    """Return a function at an end of a panel, from its values at the nodes, which begin at an index of a line."""
    total = 0.0
    for j in range(COUNT):
        total += weights[j] * line[at + j]
    return total


@Inner
def end_speed(panel):  # type: ignore[no-untyped-def]
    """Return V at the end of a panel."""
    return distance_at(panel, panel[PANEL_BEGIN] + panel[PANEL_WIDTH])[1] * value_at_end(TO_END, panel, SPEEDS)


@Inner
def sum_series(terms, at, x):  # type: ignore[no-untyped-def]
    """Return the sum of the Chebyshev series whose coefficients begin at an index of a line."""
    following, after = 0.0, 0.0
    for j in range(COUNT - 1, 0, -1):
        following, after = terms[at + j] + 2.0 * x * following - after, following
    return terms[at] + x * following - after


@Inner
def lay_half(records, at, count, head, panels, k):  # type: ignore[no-untyped-def]
    """Fill the panels of a half from row k on, and return the next free row; ``head`` has what they have in common.

    The march variable of a slow launch begins near a zero of V**2 behind it, at -c/2. Y is smooth there, but its
    changes are not, so panels must be no wider than their distance from this zero.
    """
    terms, half_c, left = np.empty(WIDE), head[PANEL_HALF_C], 0.0
    mark = half_c if half_c > 0.0 else inf
    for i in range(count):
        row = at + i * COLUMNS
        right, begin = records[row + RIGHT], left
        while begin < right:
            while mark <= begin:
                mark = 2.0 * mark + half_c
            stop, panel = min(mark, right), panels[k]
            panel[:SPEEDS] = head
            panel[PANEL_BEGIN], panel[PANEL_WIDTH] = begin, stop - begin
            panel[CONTACT_SIGN] = 1.0 if records[row + NORMAL_LOAD + COUNT // 2] > 0.0 else -1.0
            if stop - begin == right - left:
                panel[SPEEDS:] = records[row + Y_ROW : row + Y_ROW + WIDE]
            else:
                to_coefficients(records, row + Y_ROW, terms, 0)
                for j in range(COUNT):
                    x = 2.0 * ((begin - left) + (stop - begin) * SHARES[j]) / (right - left) - 1.0
                    panel[SPEEDS + j] = sum_series(terms, 0, x)
            begin, k = stop, k + 1
        left = right
    return k


@Inner
def fix_places(panels, begin, end):  # type: ignore[no-untyped-def]
    """Let the origin move no more from the first panel on, after the one at ``begin``, on which the speed decreases."""
    for k in range(begin + 1, end):
        slows_down = panels[k - 1, MOVES] == 0.0 or end_speed(panels[k]) < end_speed(panels[k - 1])
        panels[k, MOVES] = 0.0 if slows_down else 1.0


@Inner
def mark_state(states, at, record, mark, v2, panel):  # type: ignore[no-untyped-def]
    """Fill the state at a place of a record, on the side of a panel."""
    states[PLACE, at], states[PLACE_LOW, at], states[W, at] = record[mark], record[mark + 1], v2
    states[STATE_HEADING, at], states[STATE_SIGN, at] = record[HEADING], panel[CONTACT_SIGN]


@entry(MATRIX(VECTOR, WHOLE, WHOLE, MATRIX), checked=False)
def lay_panels(records, begins, first, panels):  # type: ignore[no-untyped-def]
    """Fill the panels of all halves, and return the states (`law.states_of`) in which the law is needed.

    Parameters
    ----------
    records : array
        The records of all runs, one after the other.
    begins : array of int
        The indices at which these begin.
    first : array of int
        The indices at which the panels of each half begin; the last item is the number of panels. They are filled.
    panels : array
        The panels, which are filled.

    Returns
    -------
    array
        The states at the start of each run, at the end of each, in the middle of each, and at the nodes of all panels.
    """
    runs, head = begins.size, np.zeros(WIDE)
    first[0], head[MOVES] = 0, 1.0
    for k in range(runs):
        record = records[begins[k] :]
        ahead, back, v = int(record[AHEAD]), int(record[BACK]), record[HEADING]
        head[ORIGIN], head[ORIGIN_LOW], head[OUTWARD], head[PANEL_HEADING] = record[START], record[START + 1], v, v
        head[PANEL_HALF_C] = record[HALF_C]
        first[2 * k + 1] = lay_half(records, begins[k] + HEAD, ahead, head, panels, first[2 * k])
        if back == 0:
            fix_places(panels, first[2 * k], first[2 * k + 1])
        head[ORIGIN], head[ORIGIN_LOW], head[OUTWARD], head[PANEL_HALF_C] = record[END], record[END + 1], -v, 0.0
        back_from = begins[k] + HEAD + ahead * COLUMNS
        first[2 * k + 2] = lay_half(records, back_from, back, head, panels, first[2 * k + 1])
    count = first[2 * runs]
    states = np.empty((5, MARKS * runs + COUNT * count))
    for k in range(runs):
        record, one, other = records[begins[k] :], first[2 * k], first[2 * k + 1]
        v2, first_panel, at_end = record[START_V2], panels[one], panels[other if record[BACK] > 0.0 else one]
        # If there are no panels from the start, the start is the middle.
        mark_state(states, k, record, START, v2, first_panel)
        mark_state(states, runs + k, record, END, 0.0, at_end)
        middle_v2 = end_speed(panels[other - 1]) ** 2 if record[AHEAD] > 0.0 else v2
        mark_state(states, 2 * runs + k, record, MIDDLE, middle_v2, first_panel)
    for k in range(count):
        panel = panels[k]
        for j in range(COUNT):
            at, w = MARKS * runs + k * COUNT + j, panel[PANEL_BEGIN] + panel[PANEL_WIDTH] * SHARES[j]
            states[PLACE, at], states[PLACE_LOW, at] = place_on(panel, w)
            states[W, at] = (panel[SPEEDS + j] * distance_at(panel, w)[1]) ** 2
            states[STATE_HEADING, at], states[STATE_SIGN, at] = panel[PANEL_HEADING], panel[CONTACT_SIGN]
    return states


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
    return value_at_end(weights, forces, other * COUNT) - value_at_end(TO_END, forces, one * COUNT)


@Inner
def integrate(panel, rows, at, out, to):  # type: ignore[no-untyped-def]
    """Fill the integrals of u times a function over the distance, from the start of a panel to its nodes and end.

    The values at the nodes begin at an index of a line, the integrals too.
    """
    graded, half_c = np.empty(WIDE), panel[PANEL_HALF_C]
    to_means(rows, at, out, to)
    u, width = panel[OUTWARD], panel[PANEL_WIDTH]
    if half_c == inf:
        for j in range(WIDE):
            out[to + j] *= u * (width * ENDS_BY_NODE[j])
        return
    to_graded_means(rows, at, graded, 0)
    slope = 2.0 * (panel[PANEL_BEGIN] + half_c)
    for j in range(WIDE):
        offset = width * ENDS_BY_NODE[j]
        out[to + j] = u * offset * (slope * out[to + j] + offset * graded[j])


@Inner
def solve_panel(panel, law, at, parameters, start, before, arcs, out):  # type: ignore[no-untyped-def]
    """Fill the solutions on a panel (a row of WIDE numbers for each, as the module says).

    Parameters
    ----------
    panel : array
        The panel.
    law : array
        The law in states (`law.Law.matrix`).
    at : int
        The state at the first node of the panel.
    parameters : int
        The number of run-time parameters.
    start, before : (n + 2,) arrays
        y of the solutions, and the change of the time, at the beginning of the panel; they are set to those at its end.
    arcs : (n,) array
        The same of the integrals of ds/dlam.
    out : array
        What is filled, as one line.
    """
    n, work = parameters, np.empty(5 * WIDE)
    factor, rate, source, gained, growth = 0, WIDE, 2 * WIDE, 3 * WIDE, 4 * WIDE
    by_distance, width, u = panel[PANEL_HALF_C] == inf, panel[PANEL_WIDTH], panel[OUTWARD]
    twice = 1.0 if by_distance else 2.0
    for j in range(COUNT):
        work[growth + j] = distance_at(panel, panel[PANEL_BEGIN] + width * SHARES[j])[1]
        # Integrals are over w and not over the distance: laws with the square root of W have a pole at a turn, which
        # the growth of the distance with w cancels.
        work[rate + j] = twice * work[growth + j] * law[n + 4, at + j]
    to_means(work, rate, work, factor)
    for j in range(WIDE):
        work[factor + j] = exp(u * (width * ENDS_BY_NODE[j]) * work[factor + j])
    for row in range(n + 2):
        # A row for each parameter, for sigma, and for the solution that begins with y = 1, which has no source.
        force, strain = (n + 5 + row, 2 + row) if row < n else (n + 3, 1)
        has_source = row < n or (row == n and panel[MOVES] > 0.0)
        if has_source:
            for j in range(COUNT):
                work[source + j] = law[force, at + j] / work[factor + j]
            integrate(panel, work, source, work, gained)
        else:
            work[gained : gained + WIDE] = 0.0
        times, shares = row * WIDE, (n + 2 + row) * WIDE
        for j in range(COUNT):
            y = work[factor + j] * (work[gained + j] + start[row])
            share = y / (panel[SPEEDS + j] * work[growth + j]) ** 2
            # No solution begins with y = 1 where V**2 is 0.
            out[shares + j] = share if by_distance or row <= n else 0.0
            strain_share = law[strain, at + j] / law[0, at + j] if has_source else 0.0
            work[rate + j] = twice * law[0, at + j] / panel[SPEEDS + j] * (strain_share - 0.5 * out[shares + j])
        start[row] = work[factor + COUNT] * (work[gained + COUNT] + start[row])
        out[shares + COUNT] = start[row]
        to_means(work, rate, out, times)
        for j in range(WIDE):
            out[times + j] = width * ENDS_BY_NODE[j] * out[times + j] + before[row]
        before[row] = out[times + COUNT]
    for row in range(n):
        to = (2 * n + 4 + row) * WIDE
        for j in range(COUNT):
            work[source + j] = law[2 + row, at + j]
        integrate(panel, work, source, out, to)
        for j in range(WIDE):
            out[to + j] += arcs[row]
        arcs[row] = out[to + COUNT]


@Inner
def solve_panels(panels, first, law, parameters, breaks, solutions):  # type: ignore[no-untyped-def]
    """Fill the solutions on all panels."""
    n, half = parameters, 0
    states = law.shape[1] - COUNT * panels.shape[0]
    forces = law[n + 2, states:]
    start, before, arcs = np.zeros(n + 2), np.zeros(n + 2), np.zeros(n)
    for half in range(first.size - 1):
        start[:], before[:], arcs[:] = 0.0, 0.0, 0.0
        start[n + 1] = 1.0
        for k in range(first[half], first[half + 1]):
            if k > first[half] and panels[k, MOVES] > 0.0:
                start[n] += jump(panels, forces, breaks, k - 1, k, TO_START)
            elif k > first[half] and panels[k - 1, MOVES] > 0.0:
                start[n] -= value_at_end(TO_END, forces, (k - 1) * COUNT)
                ds = value_at_end(TO_END, law[0, states:], (k - 1) * COUNT)
                before[n] -= panels[k, PANEL_HEADING] * ds / end_speed(panels[k - 1])
            out = solutions[k].reshape(solutions.shape[1] * WIDE)
            solve_panel(panels[k], law, states + k * COUNT, n, start, before, arcs, out)
