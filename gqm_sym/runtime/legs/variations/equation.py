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

The law is needed in states at the start, the end and the middle of each run, and at the nodes of all panels; the last
node of a panel occurs twice, so that the states of a panel fill whole registers. The solutions are found in `solving`.
"""

from math import inf, log2

import numpy as np
from numba import types

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.compiled.jit import Inner
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
    SHARES,
    TO_COEFFICIENTS,
    WIDE,
    to_coefficients,
)

# The matrix that maps values at the nodes to those at both ends of a panel.
TO_START, TO_END = (-1.0) ** np.arange(COUNT) @ TO_COEFFICIENTS, TO_COEFFICIENTS.sum(axis=0)

PANEL_BEGIN, PANEL_WIDTH, ORIGIN, ORIGIN_LOW, OUTWARD, PANEL_HEADING, CONTACT_SIGN, PANEL_HALF_C, MOVES = range(9)
SPEEDS, PANEL_COLUMNS = WIDE, 2 * WIDE

# The rows of states (`law.states_of`).
PLACE, PLACE_LOW, W, STATE_HEADING, STATE_SIGN = range(5)

# The number of states of each run before those of the nodes: its start, its end and its middle.
MARKS = 3

CUBE, WHOLE = types.float64[:, :, ::1], types.int64[::1]

# The records of runs, the indices at which they begin and at which the panels of each half begin, and the panels.
PANELS_OF_RUNS = types.Tuple((VECTOR, WHOLE, WHOLE, MATRIX))


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


@Inner
def most_panels(records, begins):  # type: ignore[no-untyped-def]
    """Return the largest number of panels of some runs; those of a slow launch are divided (`lay_half`)."""
    total = 0
    for k in range(begins.size):
        record = records[begins[k] :]
        ahead, half_c = int(record[AHEAD]), record[HALF_C]
        total += ahead + int(record[BACK])
        if ahead > 0 and 0.0 < half_c < inf:
            total += int(log2(record[HEAD + (ahead - 1) * COLUMNS + RIGHT] / half_c + 1.0)) + 1
    return total


@Inner
def lay_panels(records, begins):  # type: ignore[no-untyped-def]
    """Return the panels of runs.

    Parameters
    ----------
    records : array
        The records of all runs, one after the other.
    begins : array of int
        The indices at which these begin.

    Returns
    -------
    first : array of int
        The indices at which the panels of each half begin; the last item is the number of panels.
    panels : array
        The panels.
    """
    runs, head, first = begins.size, np.zeros(WIDE), np.empty(2 * begins.size + 1, dtype=np.int64)
    panels = np.empty((most_panels(records, begins), PANEL_COLUMNS))
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
    return first, panels[: first[2 * runs]]


@Inner
def lay_nodes(panels, states, first):  # type: ignore[no-untyped-def]
    """Fill the states at the nodes of panels, from an index on."""
    for k in range(panels.shape[0]):
        panel = panels[k]
        for j in range(WIDE):
            at, node = first + k * WIDE + j, min(j, COUNT - 1)
            w = panel[PANEL_BEGIN] + panel[PANEL_WIDTH] * SHARES[node]
            states[PLACE, at], states[PLACE_LOW, at] = place_on(panel, w)
            states[W, at] = (panel[SPEEDS + node] * distance_at(panel, w)[1]) ** 2
            states[STATE_HEADING, at], states[STATE_SIGN, at] = panel[PANEL_HEADING], panel[CONTACT_SIGN]


@Inner
def lay_states(records, begins, first, panels):  # type: ignore[no-untyped-def]
    """Return the states (`law.states_of`) in which the law is needed.

    They are those at the start of each run, at the end of each, in the middle of each, and at the nodes of all panels.
    """
    runs, count = begins.size, panels.shape[0]
    states = np.empty((5, MARKS * runs + WIDE * count))
    for k in range(runs):
        record, one, other = records[begins[k] :], first[2 * k], first[2 * k + 1]
        v2, first_panel, at_end = record[START_V2], panels[one], panels[other if record[BACK] > 0.0 else one]
        # If there are no panels from the start, the start is the middle.
        mark_state(states, k, record, START, v2, first_panel)
        mark_state(states, runs + k, record, END, 0.0, at_end)
        middle_v2 = end_speed(panels[other - 1]) ** 2 if record[AHEAD] > 0.0 else v2
        mark_state(states, 2 * runs + k, record, MIDDLE, middle_v2, first_panel)
    lay_nodes(panels, states, MARKS * runs)
    return states
