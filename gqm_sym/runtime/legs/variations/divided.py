"""Panels that are divided where the law of motion is not smooth enough for the variational equation (`equation`).

Friction in space has a kink where the contact force vanishes, and almost one where it almost vanishes. Panels of legs
are so narrow there that V**2 is found to rounding. The derivative of friction with respect to V**2 jumps at a kink
however, so that its integral over such a panel has an error as large as the panel is wide. V**2 itself is smooth there:
it is read off the panel, and the law is evaluated at the nodes of narrower panels around the kink until their width is
rounding only.
"""

from math import fabs, inf

import numpy as np

from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.legs.panels.polynomials import COUNT, SHARES, TO_COEFFICIENTS, WIDE, to_coefficients
from gqm_sym.runtime.legs.variations.equation import (
    PANEL_BEGIN,
    PANEL_HALF_C,
    PANEL_WIDTH,
    SPEEDS,
    lay_nodes,
    sum_series,
)

# How many of the last coefficients of a Chebyshev series show whether it is resolved, and the matrix that gives them.
TAIL = 3
TO_TAIL = TO_COEFFICIENTS[COUNT - TAIL :]

# The largest change of the logarithm of the integrating factor by the last coefficients of F_W on a panel that is
# rounding only.
RESOLVED = 1e-15

# A function is smooth on a panel if its last coefficients are a smaller share of its changes than this.
SMOOTH = 1e-6

# The largest number of divisions, each of which makes the panel around a kink some ten times as narrow.
MAX_DIVISIONS = 16

# How many panels take the place of one that is divided.
PARTS = 3


@Inner
def is_resolved(panel, slopes, at):  # type: ignore[no-untyped-def]
    """Return whether F_W, whose values at the nodes of a panel begin at an index of a line, is resolved on it."""
    half_c, width, last, low, high = panel[PANEL_HALF_C], panel[PANEL_WIDTH], np.zeros(TAIL), inf, -inf
    for j in range(COUNT):
        w = panel[PANEL_BEGIN] + width * SHARES[j]
        rate = slopes[at + j] * (1.0 if half_c == inf else 2.0 * (w + half_c))
        low, high = min(low, rate), max(high, rate)
        for k in range(TAIL):
            last[k] += TO_TAIL[k, j] * rate
    rough = max(fabs(last[0]), fabs(last[1]), fabs(last[2]))
    return not (rough * width > RESOLVED and rough > SMOOTH * (high - low))


@Inner
def steepest(slopes, at):  # type: ignore[no-untyped-def]
    """Return the shares of a panel between which F_W changes most from node to node."""
    node, largest = 0, -1.0
    for j in range(COUNT - 1):
        change = fabs(slopes[at + j + 1] - slopes[at + j])
        if change > largest:
            node, largest = j, change
    return SHARES[node], SHARES[node + 1]


@Inner
def lay_part(panel, terms, begin, end, out):  # type: ignore[no-untyped-def]
    """Fill the part of a panel between two shares of it; ``terms`` are the Chebyshev coefficients of Y on the panel."""
    out[:SPEEDS] = panel[:SPEEDS]
    out[PANEL_BEGIN] = panel[PANEL_BEGIN] + panel[PANEL_WIDTH] * begin
    out[PANEL_WIDTH] = panel[PANEL_WIDTH] * (end - begin)
    for j in range(COUNT):
        out[SPEEDS + j] = sum_series(terms, 0, 2.0 * (begin + (end - begin) * SHARES[j]) - 1.0)


@Inner
def divided(first, panels, slopes):  # type: ignore[no-untyped-def]
    """Divide panels on which F_W is not resolved.

    Parameters
    ----------
    first, panels : arrays
        As `equation.lay_panels` returns them.
    slopes : array
        F_W at the nodes of all panels.

    Returns
    -------
    first, panels : arrays
        The same with the parts of panels in their places.
    before : array of int
        For each panel the index that it had, or -1 for a part of one.
    """
    count, more = panels.shape[0], 0
    for k in range(count):
        if not is_resolved(panels[k], slopes, k * WIDE):
            more += PARTS - 1
    before = np.full(count + more, -1)
    if more == 0:
        for k in range(count):
            before[k] = k
        return first, panels, before
    starts, found = np.empty(first.size, dtype=np.int64), np.empty((count + more, panels.shape[1]))
    terms, at, half = np.empty(WIDE), 0, 0
    for k in range(count):
        while half < first.size and first[half] == k:
            starts[half], half = at, half + 1
        if is_resolved(panels[k], slopes, k * WIDE):
            found[at], before[at] = panels[k], k
            at += 1
            continue
        low, high = steepest(slopes, k * WIDE)
        to_coefficients(panels[k], SPEEDS, terms, 0)
        lay_part(panels[k], terms, 0.0, low, found[at])
        lay_part(panels[k], terms, low, high, found[at + 1])
        lay_part(panels[k], terms, high, 1.0, found[at + 2])
        at += PARTS
    while half < first.size:
        starts[half], half = at, half + 1
    return starts, found, before


@Inner
def states_of_parts(panels, before):  # type: ignore[no-untyped-def]
    """Return the states at the nodes of the panels that are parts of others (`divided`)."""
    parts = panels[before < 0]
    states = np.empty((5, WIDE * parts.shape[0]))
    lay_nodes(parts, states, 0)
    return states


@Inner
def joined_law(law, marks, of_parts, before):  # type: ignore[no-untyped-def]
    """Return the law in the states of panels after a division.

    Parameters
    ----------
    law : array
        The law in the states before.
    marks : int
        The number of states before those of the nodes.
    of_parts : array
        The law at the nodes of the panels that are parts of others.
    before : array of int
        The indices of panels before the division (`divided`).
    """
    found, part = np.empty((law.shape[0], marks + before.size * WIDE)), 0
    found[:, :marks] = law[:, :marks]
    for k in range(before.size):
        at = marks + k * WIDE
        if before[k] >= 0:
            start = marks + before[k] * WIDE
            found[:, at : at + WIDE] = law[:, start : start + WIDE]
        else:
            found[:, at : at + WIDE] = of_parts[:, part * WIDE : part * WIDE + WIDE]
            part += 1
    return found
