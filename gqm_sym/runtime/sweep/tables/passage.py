"""The panels that an orbit passes on a tabulated curve, and V**2 at their edges."""

from math import fabs
from typing import NamedTuple

import numpy as np

from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.launch.zeros import LIMIT, TURN
from gqm_sym.runtime.quadrature.time_panels import MIN_CANCELLATION_RATIO
from gqm_sym.runtime.sweep.orbit import Orbit
from gqm_sym.runtime.sweep.tables.layout import HALF, LEFT_TERMS, RIGHT_TERMS
from gqm_sym.runtime.sweep.tables.panel_forces import FAR, NEAR, SLOPE_SIGN, prepare
from gqm_sym.runtime.sweep.tables.places import from_left, from_right, locate, neighbour
from gqm_sym.runtime.sweep.tables.potential import difference_on, potential_on, rise_between, rise_on
from gqm_sym.runtime.sweep.tables.turning_points import downhill, end_ahead, polished, turn_from

# The largest difference of the potential between turning points found in doubles, as a share of its decrease from them.
MAX_MISMATCH = 1e-14

# Codes for the ends of a passage that are turning points.
BOTH, LOWER, UPPER, NEITHER = range(4)


class Passage(NamedTuple):
    """The panels that an orbit passes, from its lower end to its upper one.

    Attributes
    ----------
    first, panels : int
        The index of the first panel, and the number of panels. On a closed curve indices continue from lap to lap.
    low_x, high_x : float
        The places of both ends on their panels, in [-1, 1].
    low_to_edge, high_from_edge : float
        The distances from the lower end to the right edge of its panel, and from the left edge of the last panel to the
        upper end, in units of half these panels.
    width : float
        The distance between both ends.
    turns : int
        The ends that are turning points: BOTH, LOWER or UPPER; NEITHER for a lap and for a body that passes through.
    v2 : float
        V**2 at the lower end if NEITHER is.
    is_polished : bool
        Whether both ends are accurate to all digits.
    middle : int
        The last panel on which time is measured from the lower end. On an orbit with two turning points this is the
        panel in the middle, on which time is measured from both ends, and on later panels it is measured from the upper
        end. -1 if it is measured from the upper end only.
    """

    first: int
    panels: int
    low_x: float
    high_x: float
    low_to_edge: float
    high_from_edge: float
    width: float
    turns: int
    v2: float
    is_polished: bool
    middle: int


NOWHERE = Passage(0, 0, 0.0, 0.0, 0.0, 0.0, 0.0, BOTH, 0.0, False, 0)


@Inner
def middle_of(curve, orbit, first, panels, turns):  # type: ignore[no-untyped-def]
    """Return the number ``middle`` of a passage."""
    if turns != BOTH:
        return -1 if turns == UPPER else panels - 1
    found = locate(curve.table, curve.period, orbit.lam0 + 0.5 * (orbit.low + orbit.high))
    return min(max(found[0] - first, 0), panels - 1)


@Inner
def find_passage(curve, lam0, v0, direction):  # type: ignore[no-untyped-def]
    """Return the orbit of a launch and the panels that it passes; no panels if the table does not decide."""
    table, w0 = curve.table, v0 * v0
    count = curve.levels.size
    none = Orbit(False, False, direction, lam0, w0, 0.0, 0.0, 0), NOWHERE
    if count == 0:
        return none
    launch = locate(table, curve.period, lam0)
    start, x, near = launch
    if w0 == 0.0:
        direction = downhill(curve, start % count, x)
        if direction == 0 or near == 0.0:
            return none
    ahead, index, zero = turn_from(curve, launch, w0, direction)
    if ahead == LIMIT and curve.period > 0.0 and w0 > 0.0:
        lap = direction * curve.period
        orbit = Orbit(True, False, direction, lam0, w0, min(lap, 0.0), max(lap, 0.0), 0)
        first, rests = start if direction > 0 else start - count, (from_right(x, near), from_left(x, near))
        return orbit, Passage(first, count + 1, x, x, rests[0], rests[1], curve.period, NEITHER, w0, True, count)
    leaves, turns, v2 = 0, BOTH, w0
    if ahead == TURN:
        offset, front = polished(curve, launch, w0, index, zero, direction)
    else:
        leaves = direction
        offset, front, v2 = end_ahead(curve, launch, w0, direction)
    other, back, behind = 0.0, launch, TURN
    if w0 > 0.0:
        behind, index, zero = turn_from(curve, launch, w0, -direction)
        if behind == TURN:
            other, back = polished(curve, launch, w0, index, zero, -direction)
        elif leaves != 0:
            turns = NEITHER
        else:
            leaves = -direction
            other, back, v2 = end_ahead(curve, launch, w0, -direction)
    signs = curve.rows[front[0] % count, SLOPE_SIGN], curve.rows[back[0] % count, SLOPE_SIGN]
    if leaves == 0 and not table.is_exact and (signs[0] == 0.0 or signs[1] == 0.0):
        return none  # a swing about the lowest place of a panel is more accurate without the table
    last_end = ahead if leaves == direction else behind
    if leaves != 0 and not (last_end == LIMIT and v2 > 0.0 and curve.period == 0.0):
        return none
    low, lower, high, upper = (other, back, offset, front) if direction > 0 else (offset, front, other, back)
    if leaves != 0 and turns != NEITHER:
        turns = LOWER if leaves > 0 else UPPER
    orbit = Orbit(False, False, direction, lam0, w0, low, high, leaves)
    rests = from_right(lower[1], lower[2]), from_left(upper[1], upper[2])
    first, panels, v2 = lower[0], upper[0] - lower[0] + 1, v2 if direction < 0 else w0
    middle = middle_of(curve, orbit, first, panels, turns)
    return orbit, Passage(first, panels, lower[1], upper[1], rests[0], rests[1], high - low, turns, v2, True, middle)


@Inner
def turns_of(orbit):  # type: ignore[no-untyped-def]
    """Return which ends of a known orbit are turning points."""
    if orbit.leaves == 0:
        return BOTH
    if orbit.leaves == orbit.direction and orbit.v2 > 0.0:
        return NEITHER
    return LOWER if orbit.leaves > 0 else UPPER


@Inner
def passage_of(curve, orbit):  # type: ignore[no-untyped-def]
    """Return the panels that a known orbit passes; none if the curve is not tabulated."""
    table, count = curve.table, curve.levels.size
    if count == 0:
        return NOWHERE
    begin, end = orbit.lam0 + orbit.low, orbit.lam0 + orbit.high
    turns, v2 = turns_of(orbit), 0.0
    if orbit.leaves != 0:
        begin, end = max(begin, table.edges[0]), min(end, table.edges[-1])
        v2 = orbit.v2
        if turns == NEITHER and orbit.leaves < 0:
            launch = locate(table, curve.period, orbit.lam0)
            prepare(curve, launch[0], FAR | NEAR)
            prepare(curve, 0, FAR)
            v2 = end_ahead(curve, launch, orbit.v2, -1)[2]
    first, x, near = locate(table, curve.period, begin)
    if orbit.circulates:
        rests = from_right(x, near), from_left(x, near)
        return Passage(first, count + 1, x, x, rests[0], rests[1], curve.period, NEITHER, orbit.v2, False, count)
    last, y, close = locate(table, curve.period, end)
    if close == 0.0 and y < 0.0 and last > first:  # at an edge, the body passes nothing of the panel beyond
        last, y = last - 1, 1.0
    inside = table.edges[0] <= begin and end <= table.edges[-1]
    panels, rests = last - first + 1 if inside or curve.period > 0.0 else 0, (from_right(x, near), from_left(y, close))
    middle = middle_of(curve, orbit, first, panels, turns)
    return Passage(first, panels, x, y, rests[0], rests[1], orbit.high - orbit.low, turns, v2, False, middle)


@Inner
def are_level(curve, passage):  # type: ignore[no-untyped-def]
    """Return whether the potential is the same at both turning points of a passage, as far as an exact table determines
    it.
    """
    if passage.panels < 2 or passage.turns != BOTH or not curve.table.is_exact:
        return True
    rows, count = curve.rows, curve.levels.size
    low, high = passage.first % count, (passage.first + passage.panels - 1) % count
    after = neighbour(low, 1, count)
    for k in (low, after, high):
        prepare(curve, k, FAR | NEAR)
    lower, upper = (
        rise_on(rows, low, RIGHT_TERMS, -passage.low_to_edge),
        rise_on(rows, high, LEFT_TERMS, passage.high_from_edge),
    )
    between = rise_between(rows, after, high)
    return fabs(lower - (between + upper)) <= MAX_MISMATCH * max(fabs(lower), fabs(upper), fabs(between))


@Inner
def fill_half_v2_at_edges(curve, passage, half_v2_at_edges):  # type: ignore[no-untyped-def]
    """Fill V**2/2 at the left edge of each panel of a passage; return whether all values keep enough digits.

    They are computed from the nearer turning point. On a panel with a turning point, the value is that of the potential
    continued beyond it. Where a body is slow, the potential must have digits of its own.
    """
    rows, count, last = curve.rows, curve.levels.size, passage.panels - 1
    turns, paths, middle, enough = passage.turns, curve.table.paths, passage.middle, True
    k, high, begin = passage.first % count, (passage.first + last) % count, 0.0
    at = k
    for _ in range(passage.panels):
        prepare(curve, at, FAR)
        at = neighbour(at, 1, count)
    prepare(curve, k, NEAR)
    prepare(curve, high, NEAR)
    peak, slope, least = 0.0, np.inf, curve.table.least_slope
    if turns == NEITHER:
        peak = begin = 0.5 * passage.v2
        start = fabs(difference_on(rows, k, passage.low_x, passage.low_x))
        enough = max(start, begin) >= least * paths[k, HALF]
    if turns != UPPER:
        half_v2_at_edges[0] = potential_on(rows, k, passage.low_x) + begin
        slack, after = begin + rise_on(rows, k, RIGHT_TERMS, -passage.low_to_edge), neighbour(k, 1, count)
        at = after
        for j in range(1, middle + 1):
            half_v2_at_edges[j] = slack - rise_between(rows, after, at)
            peak, at = max(peak, half_v2_at_edges[j]), neighbour(at, 1, count)
            enough &= half_v2_at_edges[j] >= MIN_CANCELLATION_RATIO * peak
        if last > 0:
            peak = max(peak, slack)
        if turns != NEITHER:
            slope = -difference_on(rows, k, passage.low_x, passage.low_x) / paths[k, HALF]
    if turns in (BOTH, UPPER):
        top = slack = rise_on(rows, high, LEFT_TERMS, passage.high_from_edge)
        at = high
        for j in range(last, middle, -1):
            half_v2_at_edges[j] = slack - rise_between(rows, high, at)
            top, at = max(top, half_v2_at_edges[j]), neighbour(at, -1, count)
            enough &= half_v2_at_edges[j] >= MIN_CANCELLATION_RATIO * top
        slope_above = difference_on(rows, high, passage.high_x, passage.high_x) / paths[high, HALF]
        slope, peak = min(slope, slope_above), max(peak, top)
    # Neither turning point may be next to an equilibrium.
    return enough and slope * passage.width >= MIN_CANCELLATION_RATIO * peak and slope >= least
