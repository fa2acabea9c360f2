"""Where a body goes on a tabulated curve, and how long that takes (`curve_table`).

On a panel far from turning points V**2 is evaluated at the panel's own Gauss points. On other panels the Gauss points
are phase angles of the orbit, and V**2 is a divided difference of the panel's polynomial next to a turning point, so
that nothing cancels.
"""

from math import atan2, fabs, floor, pi, sqrt
from typing import NamedTuple

import numpy as np

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.arithmetic.elementary import cos, inverse_root, sin
from gqm_sym.runtime.compiled.intrinsics import choose
from gqm_sym.runtime.compiled.jit import Inlined, Inner
from gqm_sym.runtime.compiled.registers import hidden, on_stack
from gqm_sym.runtime.launch.zeros import CONSTANT_SHARE, CRITICAL, LIMIT, TURN
from gqm_sym.runtime.quadrature.time_panels import MIN_CANCELLATION_RATIO
from gqm_sym.runtime.sweep.curve_table import (
    BASE,
    BASE_LOW,
    BASE_SIZE,
    DS_TERMS,
    FEW_NODES,
    FEW_POTENTIAL,
    FEW_REACH,
    FEW_WEIGHTS,
    FIT,
    GAUSS_WEIGHTS,
    HALF,
    INCREASE,
    LEFT_TERMS,
    MIDDLE,
    MIDDLE_TERMS,
    NODES,
    POINTS,
    POTENTIAL,
    REACH,
    RIGHT_TERMS,
    SPREAD,
    WEIGHTS,
    difference_from,
    difference_on,
    potential_on,
    rise_on,
    value_on,
)
from gqm_sym.runtime.sweep.orbit import NO_ENDS, Orbit
from gqm_sym.runtime.sweep.panel_forces import CONVEX_FROM, FAR, HIGHEST, NEAR, SLOPE_SIGN, TOP, prepare

# By how much V**2 at the middle of a panel must exceed what the panel's rule needs.
SAFETY = 1.05

# The last Legendre coefficients of an integrand, as a share of the first, up to which its integral is accurate to
# rounding: they belong to degrees 14 and 15, the error to degree 32. Otherwise the part is halved, so often at most.
MAX_TAIL_RATIO, MAX_HALVINGS = 2e-8, 5

# The largest ratio of phase angles at both ends of a part behind an edge that lies next to a turning point.
MAX_PHASE_RATIO = 4.0

# What their extrapolation to that degree may be, and what counts as rounding noise.
MAX_ERROR_RATIO, NOISE_RATIO = 2e-16, 2e-15

# The last step of Newton's method to a turning point, in halves of the panel: the error is about its square.
MAX_LAST_STEP = 2.0**-32

# By how much the potential may differ between turning points that doubles found, as a share of what it falls from them.
MAX_MISMATCH = 1e-14

# How many steps follow from where the body comes from: in flat wells the place before them has few digits.
LAST_STEPS = 2

# How near to an equilibrium a turning point may lie, as a share of the panel, for doubles to decide that it is one.
MAX_ZERO_ERROR = 1e-6

# The slope of the potential at a launch from rest, as a share of what it spreads over on the panel, above which the
# body certainly falls.
MIN_SLOPE_SHARE = 1e-6

few_rates = on_stack(FEW_NODES)
rates_buffer, angle_buffer, place_buffer, fall_buffer = (on_stack(NODES) for _ in range(4))


# Which ends of a passage are turning points.
BOTH, LOWER, UPPER, NEITHER = range(4)

# V**2 at an end of the curve, as a share of the size of its terms, above which a body certainly leaves there.
MIN_LEAVING_SHARE = 1e-9


class Passage(NamedTuple):
    """The panels that an orbit passes, from its lower end to its upper one.

    Attributes
    ----------
    first, panels : int
        The index of the first panel, and how many there are. On a closed curve indices go on from lap to lap.
    low_x, high_x : float
        The places of both ends on their panels, in [-1, 1].
    low_rest, high_rest : float
        From the lower end to the right edge of its panel, and from the left edge of the last panel to the upper end, in
        halves of these panels.
    width : float
        The distance between both ends.
    turns : int
        Which ends are turning points: BOTH, LOWER or UPPER, or NEITHER of a lap and of a body that runs through.
    v2 : float
        V**2 at the lower end if NEITHER is.
    is_polished : bool
        Whether both ends have all digits.
    middle : int
        The last panel on which time is measured from the lower end, and the first on which it is from the upper one: on
        that in the middle of an orbit with two turning points it is from either. -1 if it is from the upper end only.
    """

    first: int
    panels: int
    low_x: float
    high_x: float
    low_rest: float
    high_rest: float
    width: float
    turns: int
    v2: float
    is_polished: bool
    middle: int


NOWHERE = Passage(0, 0, 0.0, 0.0, 0.0, 0.0, 0.0, BOTH, 0.0, False, 0)

# A place on a table is the index of its panel, x in [-1, 1] on it, and the distance from the nearer edge in halves of
# the panel: the left one if x is not positive. A small distance from an edge has all its digits.


@Inner
def locate(table, period, place):  # type: ignore[no-untyped-def]
    """A place in lam as a place on the table."""
    edges, lows = table.edges, table.edge_lows
    count, laps = edges.size - 1, 0.0
    if period > 0.0:
        laps = floor((place - edges[0]) / period)
        place = place - laps * period
    below, above = 0, count
    while above - below > 1:
        middle = (below + above) // 2
        if place >= edges[middle]:
            below = middle
        else:
            above = middle
    before, behind = (place - edges[below]) - lows[below], (edges[below + 1] - place) + lows[below + 1]
    near = min(max(min(before, behind), 0.0) / table.paths[below, HALF], 1.0)
    return below + int(laps) * count, near - 1.0 if before <= behind else 1.0 - near, near


@Inlined
def neighbour(k, direction, count):  # type: ignore[no-untyped-def]
    """The panel next to panel k; on a closed curve the first is next to the last."""
    k += direction
    if k == count:
        return 0
    return k if k >= 0 else count - 1


@Inner
def edge_place(table, period, index):  # type: ignore[no-untyped-def]
    """The place of the left edge of a panel; on a closed curve by its index over all laps."""
    count = table.edges.size - 1
    if period == 0.0:
        return table.edges[index]
    lap = index // count
    return table.edges[index - lap * count] + lap * period


@Inner
def edge_distance(table, one, other):  # type: ignore[no-untyped-def]
    """The distance from the left edge of a panel to that of the same or a later one, at most a lap further."""
    edges, lows, count = table.edges, table.edge_lows, table.edges.size - 1
    lap = one // count
    one, other = one - lap * count, other - lap * count
    if other <= count:
        return (edges[other] - edges[one]) + (lows[other] - lows[one])
    other -= count
    rest = (edges[count] - edges[one]) + (lows[count] - lows[one])
    return rest + ((edges[other] - edges[0]) + (lows[other] - lows[0]))


@Inlined
def from_left(x, near):  # type: ignore[no-untyped-def]
    """The distance of a place from the left edge of its panel, in halves of the panel."""
    return near if x <= 0.0 else 2.0 - near


@Inlined
def from_right(x, near):  # type: ignore[no-untyped-def]
    """The distance of a place from the right edge of its panel, in halves of the panel."""
    return near if x > 0.0 else 2.0 - near


@Inner
def way_between(table, lower, higher):  # type: ignore[no-untyped-def]
    """The distance from a place on a table to a higher one."""
    (i, x, near), (j, y, close) = lower, higher
    count, paths = table.edges.size - 1, table.paths
    if i == j:
        way = from_right(x, near) - from_right(y, close) if x > 0.0 else from_left(y, close) - from_left(x, near)
        return way * paths[i % count, HALF]
    way = from_right(x, near) * paths[i % count, HALF] + from_left(y, close) * paths[j % count, HALF]
    return way + edge_distance(table, i + 1, j)


@Inner
def rise_from_left(rows, k, x, near):  # type: ignore[no-untyped-def]
    """The potential at a place of panel k above that of the left edge."""
    if x <= 0.0:
        return rise_on(rows, k, LEFT_TERMS, near)
    return rows[k, INCREASE] + rise_on(rows, k, RIGHT_TERMS, -near)


@Inner
def rise_from_right(rows, k, x, near):  # type: ignore[no-untyped-def]
    """The potential at a place of panel k above that of the right edge."""
    if x > 0.0:
        return rise_on(rows, k, RIGHT_TERMS, -near)
    return rise_on(rows, k, LEFT_TERMS, near) - rows[k, INCREASE]


@Inlined
def rise_between(rows, k, other):  # type: ignore[no-untyped-def]
    """The potential at the left edge of another panel above that at the left edge of panel k."""
    return (rows[other, BASE] - rows[k, BASE]) + (rows[other, BASE_LOW] - rows[k, BASE_LOW])


@Inner
def zero_on_panel(rows, k, slack, near, far):  # type: ignore[no-untyped-def]
    """Where the potential of panel k reaches ``slack`` between a place below it and one above it (see `polished`)."""
    x = 0.5 * (near + far)
    for _ in range(60):
        value, slope, r = 0.0, 0.0, 1.0 + x
        for j in range(NODES - 1, -1, -1):
            slope = slope * r + value
            value = value * r + rows[k, LEFT_TERMS + j]
        slope = value + r * slope
        value *= r
        if value < slack:
            near = x
        else:
            far = x
        new = x - (value - slack) / slope
        if not min(near, far) < new < max(near, far):
            new = 0.5 * (near + far)
        if fabs(new - x) <= MAX_LAST_STEP:
            return new
        x = new
    return x


@Inner
def turn_from(curve, launch, w0, direction):  # type: ignore[no-untyped-def]
    """What ends a motion in one direction from a place on the table: what it is, the panel, and the place on it.

    It is TURN, LIMIT (an end of the curve, or a whole lap) or CRITICAL where the table does not decide it.
    """
    rows, count, period = curve.rows, curve.levels.size, curve.period
    index, x, near_edge = launch
    k = index % count
    prepare(curve, k, FAR | NEAR)
    energy = 0.5 * w0 + rows[k, BASE] + rise_from_left(rows, k, x, near_edge)
    margin = CONSTANT_SHARE * (0.5 * w0 + max(fabs(energy), rows[k, BASE_SIZE]))
    for passed in range(count + 1):
        error = margin + CONSTANT_SHARE * rows[k, BASE_SIZE]
        may_turn = not rows[k, HIGHEST] < energy - error
        if may_turn:
            prepare(curve, k, NEAR)
        if may_turn and not rows[k, TOP] < energy - error:
            sign, slack = rows[k, SLOPE_SIGN] * direction, energy - rows[k, BASE]
            if sign == 0.0 and energy - error > rows[k, CONVEX_FROM]:
                sign = 1.0  # where a convex potential reaches a level that it was below, it rises
            if sign == 0.0 or not rows[k, TOP] < np.inf:
                return CRITICAL, index, x
            if sign > 0.0:
                left = slack - (rows[k, INCREASE] if direction > 0 else 0.0)
                if fabs(left) <= error:
                    return CRITICAL, index, x
                if left < 0.0:
                    near = x if passed == 0 else -float(direction)
                    zero = zero_on_panel(rows, k, slack, near, float(direction))
                    is_simple = error <= MAX_ZERO_ERROR * fabs(difference_on(rows, k, zero, zero))
                    return TURN if is_simple else CRITICAL, index, zero
        if passed == count:
            break
        index += direction
        if period == 0.0 and not 0 <= index < count:
            break
        k = neighbour(k, direction, count)
        prepare(curve, k, FAR)
    return LIMIT, index, float(direction)


@Inner
def downhill(curve, k, x):  # type: ignore[no-untyped-def]
    """The direction in which a body released at a place of panel k falls; 0 next to an equilibrium."""
    prepare(curve, k, FAR | NEAR)
    sign, slope = curve.rows[k, SLOPE_SIGN], difference_on(curve.rows, k, x, x)
    if sign == 0.0 and fabs(slope) > MIN_SLOPE_SHARE * curve.rows[k, SPREAD]:
        sign = 1.0 if slope > 0.0 else -1.0
    return -int(sign)


@Inner
def slack_at_edge(curve, launch, w0, index, direction):  # type: ignore[no-untyped-def]
    """V**2/2 at the edge through which a body comes to a panel, which is another one than that of the launch."""
    rows, count = curve.rows, curve.levels.size
    start, x, near = launch
    k = start % count
    if direction > 0:
        return 0.5 * w0 + rise_from_right(rows, k, x, near) - rise_between(rows, (start + 1) % count, index % count)
    return 0.5 * w0 + rise_from_left(rows, k, x, near) - rise_between(rows, k, (index + 1) % count)


@Inner
def polished(curve, launch, w0, index, x, direction):  # type: ignore[no-untyped-def]
    """A turning point with all digits, by steps of Newton's method: its offset from the launch, and its place.

    V**2 is measured from the launch if that is on the same panel, else from the edge through which the body comes.
    """
    table, rows, count = curve.table, curve.rows, curve.levels.size
    k = index % count
    half, (start, at, near) = table.paths[k, HALF], launch
    if index == start:
        edge, rest, way = LEFT_TERMS if at <= 0.0 else RIGHT_TERMS, near if at <= 0.0 else -near, x - at
        for _ in range(LAST_STEPS):
            y = rest + way
            way += (0.5 * w0 - way * difference_from(rows, k, edge, rest, y)) / difference_from(rows, k, edge, y, y)
        gap = from_left(at, near) + way
        gap = gap if gap <= 1.0 else from_right(at, near) - way
        return half * way, (index, at + way, gap)
    gap, slack = 1.0 + direction * x, slack_at_edge(curve, launch, w0, index, direction)
    edge = LEFT_TERMS if direction > 0 else RIGHT_TERMS
    for _ in range(LAST_STEPS):
        y = direction * gap
        gap += direction * (slack - rise_on(rows, k, edge, y)) / difference_from(rows, k, edge, y, y)
    if direction > 0:
        turn = index, gap - 1.0, gap if gap <= 1.0 else 2.0 - gap
        return way_between(table, launch, turn), turn
    turn = index, 1.0 - gap, gap if gap < 1.0 else 2.0 - gap
    return -way_between(table, turn, launch), turn


@Inner
def end_ahead(curve, launch, w0, direction):  # type: ignore[no-untyped-def]
    """The offset of the end of the curve in one direction, its place, and V**2 there; NaN if a body may not leave."""
    rows, last = curve.rows, curve.levels.size - 1
    start, x, near = launch
    if direction > 0:
        end, k = (last, 1.0, 0.0), last
        half_v2 = 0.5 * w0 + rise_from_right(rows, start, x, near)
        if start < last:
            half_v2 = slack_at_edge(curve, launch, w0, last, 1) - rows[last, INCREASE]
        offset = way_between(curve.table, launch, end)
    else:
        end, k = (0, -1.0, 0.0), 0
        half_v2 = 0.5 * w0 + rise_from_left(rows, start, x, near)
        if start > 0:
            half_v2 = slack_at_edge(curve, launch, w0, 0, -1) + rows[0, INCREASE]
        offset = -way_between(curve.table, end, launch)
    size = 0.5 * w0 + rows[start, BASE_SIZE] + rows[k, BASE_SIZE] + fabs(rows[k, INCREASE])
    certain = curve.ends != NO_ENDS and offset != 0.0 and half_v2 > MIN_LEAVING_SHARE * size
    return offset, end, 2.0 * half_v2 if certain else np.nan


@Inner
def middle_of(curve, orbit, first, panels, turns):  # type: ignore[no-untyped-def]
    """The number ``middle`` of a passage."""
    if turns != BOTH:
        return -1 if turns == UPPER else panels - 1
    found = locate(curve.table, curve.period, orbit.lam0 + 0.5 * (orbit.low + orbit.high))
    return min(max(found[0] - first, 0), panels - 1)


@Inner
def find_passage(curve, lam0, v0, direction):  # type: ignore[no-untyped-def]
    """The orbit of a launch and the panels that it passes; no panels where the table does not decide."""
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
        return none  # a swing about the lowest place of a panel has more digits without the table
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
def passage_of(curve, orbit):  # type: ignore[no-untyped-def]
    """The panels that a known orbit passes; none if the curve is not tabulated."""
    table, count = curve.table, curve.levels.size
    if count == 0:
        return NOWHERE
    first, x, near = locate(table, curve.period, orbit.lam0 + orbit.low)
    if orbit.circulates:
        rests = from_right(x, near), from_left(x, near)
        return Passage(first, count + 1, x, x, rests[0], rests[1], curve.period, NEITHER, orbit.v2, False, count)
    last, y, close = locate(table, curve.period, orbit.lam0 + orbit.high)
    if close == 0.0 and y < 0.0 and last > first:  # at an edge: nothing of the panel behind it is passed
        last, y = last - 1, 1.0
    inside = table.edges[0] <= orbit.lam0 + orbit.low and orbit.lam0 + orbit.high <= table.edges[-1]
    panels, rests = last - first + 1 if inside or curve.period > 0.0 else 0, (from_right(x, near), from_left(y, close))
    middle = middle_of(curve, orbit, first, panels, BOTH)
    return Passage(first, panels, x, y, rests[0], rests[1], orbit.high - orbit.low, BOTH, 0.0, False, middle)


@Inner
def are_level(curve, passage):  # type: ignore[no-untyped-def]
    """Whether the potential is the same at both turning points of a passage, as far as an exact table tells it."""
    if passage.panels < 2 or passage.turns != BOTH or not curve.table.is_exact:
        return True
    rows, count = curve.rows, curve.levels.size
    low, high = passage.first % count, (passage.first + passage.panels - 1) % count
    after = neighbour(low, 1, count)
    for k in (low, after, high):
        prepare(curve, k, FAR | NEAR)
    lower, upper = (
        rise_on(rows, low, RIGHT_TERMS, -passage.low_rest),
        rise_on(rows, high, LEFT_TERMS, passage.high_rest),
    )
    between = rise_between(rows, after, high)
    return fabs(lower - (between + upper)) <= MAX_MISMATCH * max(fabs(lower), fabs(upper), fabs(between))


@Inner
def fill_slacks(curve, passage, slacks):  # type: ignore[no-untyped-def]
    """Fill V**2/2 at the left edge of each panel of a passage; returns whether they keep enough digits.

    They are measured from the nearer turning point. On a panel that has one they are as if the curve went on beyond it.
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
    peak, slope = 0.0, np.inf
    if turns == NEITHER:
        peak = begin = 0.5 * passage.v2
    if turns != UPPER:
        slacks[0] = potential_on(rows, k, passage.low_x) + begin
        slack, after = begin + rise_on(rows, k, RIGHT_TERMS, -passage.low_rest), neighbour(k, 1, count)
        at = after
        for j in range(1, middle + 1):
            slacks[j] = slack - rise_between(rows, after, at)
            peak, at = max(peak, slacks[j]), neighbour(at, 1, count)
            enough &= slacks[j] >= MIN_CANCELLATION_RATIO * peak
        if last > 0:
            peak = max(peak, slack)
        if turns != NEITHER:
            slope = -difference_on(rows, k, passage.low_x, passage.low_x) / (2.0 * paths[k, HALF])
    if turns in (BOTH, UPPER):
        top = slack = rise_on(rows, high, LEFT_TERMS, passage.high_rest)
        at = high
        for j in range(last, middle, -1):
            slacks[j] = slack - rise_between(rows, high, at)
            top, at = max(top, slacks[j]), neighbour(at, -1, count)
            enough &= slacks[j] >= MIN_CANCELLATION_RATIO * top
        slope_above = difference_on(rows, high, passage.high_x, passage.high_x) / (2.0 * paths[high, HALF])
        slope, peak = min(slope, slope_above), max(peak, top)
    # Neither turning point may be next to an equilibrium.
    return enough and slope * passage.width >= 0.5 * MIN_CANCELLATION_RATIO * peak


@Inner
def fill_falls_from_turn(rows, k, end, sign, x, falls):  # type: ignore[no-untyped-def]
    """Fill what the potential of panel k falls from a turning point on it to places x, ever farther from it.

    ``end`` is the turning point, and how far it is from the edge on whose side the places are, both in halves of the
    panel; ``sign`` is 1 if they lie above it. Divided differences are taken from the edge that is nearer.
    """
    y, rest = end
    inner, outer, edge = (RIGHT_TERMS, LEFT_TERMS, -1.0) if sign > 0.0 else (LEFT_TERMS, RIGHT_TERMS, 1.0)
    n, q, gone = hidden(NODES), -sign * rest, y - edge
    for i in range(n):
        way = falls[i]
        falls[i] = -sign * difference_from(rows, k, inner, q + way, q)
    if (x[0] + y < 0.0) != (sign < 0.0):
        for i in range(n):
            fall = -sign * difference_from(rows, k, outer, gone, x[i] - edge)
            falls[i] = choose((x[i] + y < 0.0) != (sign < 0.0), fall, falls[i])


@Inner
def fill_rates(curve, passage, j, from_above, slack, gap, u, out):  # type: ignore[no-untyped-def]
    """Fill the time per unit of u on panel j of a passage at the Gauss points u, which ascend.

    u is the orbit's phase angle, or the place on the panel if the passage has no turning point. Phase angles are
    counted from the nearer one, because a small time next to it needs a small angle with all digits; ``from_above``
    says whether that is the upper one. ``slack`` and
    ``gap`` belong to the panel's edge that is nearer to it: V**2/2 there, and the distance from the turning point. An
    end of the curve stands for a turning point that there is not.
    """
    rows, paths, last = curve.rows, curve.table.paths, passage.panels - 1
    k = (passage.first + j) % curve.levels.size
    x, falls, half, n = place_buffer(), fall_buffer(), paths[k, HALF], hidden(NODES)
    if passage.turns == NEITHER:
        for i in range(n):
            x[i], falls[i], out[i] = u[i], slack - potential_on(rows, k, u[i]), half * half
    elif last == 0 and passage.turns == BOTH:
        fill_falls_within(rows, k, passage, u, x, falls)
        for i in range(n):
            out[i] = half * half
    else:
        sign, width = -1.0 if from_above else 1.0, passage.width
        on_panel, edge = j == (last if from_above else 0), LEFT_TERMS if sign > 0.0 else RIGHT_TERMS
        end = (passage.high_x, passage.high_rest) if from_above else (passage.low_x, passage.low_rest)
        for i in range(n):
            s, c = sin(0.5 * u[i]), cos(0.5 * u[i])
            near, far = width * s * s, width * c * c
            # V**2/2 is its value at a turning point or an edge, and what the potential falls from there.
            way = near / half if on_panel else (near - gap) / half
            x[i], falls[i] = (end[0] if on_panel else -sign) + sign * way, sign * way
            out[i] = far * half if on_panel else near * far
        if on_panel:
            fill_falls_from_turn(rows, k, end, sign, x, falls)
        else:
            for i in range(n):
                falls[i] = slack - rise_on(rows, k, edge, falls[i])
    for i in range(n):
        out[i] = value_on(paths, k, DS_TERMS, x[i]) * sqrt(out[i] / (2.0 * falls[i]))


@Inner
def fill_falls_within(rows, k, passage, u, x, falls):  # type: ignore[no-untyped-def]
    """Fill places at phase angles u where panel k has both turning points, and V**2/2 as in `fill_rates`.

    V**2/2 is (x - low)*(high - x) times the second divided difference of the potential, whose powers are found once.
    """
    low, high, terms, first, second = passage.low_x, passage.high_x, rates_buffer(), 0.0, 0.0
    for j in range(NODES, 1, -1):
        # The powers of the potential divided by x - low, and then by x - high.
        first = first * low + rows[k, MIDDLE_TERMS + j - 1]
        second = second * high + first
        terms[j - 2] = second
    for i in range(hidden(NODES)):
        s, c = sin(0.5 * u[i]), cos(0.5 * u[i])
        x[i], falls[i] = low * c * c + high * s * s, 0.0
        for j in range(NODES - 2, -1, -1):
            falls[i] = falls[i] * x[i] + terms[j]


@Inner
def time_on_part(curve, passage, j, from_above, slack, gap, begin, end):  # type: ignore[no-untyped-def]
    """The time between two values of u (`fill_rates`) on panel j of a passage; NaN where it is not accurate."""
    u, rates = angle_buffer(), rates_buffer()
    prepare(curve, (passage.first + j) % curve.levels.size, NEAR)
    parts = 1
    for _ in range(MAX_HALVINGS):
        total, resolved = 0.0, True
        half = 0.5 * (end - begin) / parts
        for part in range(parts):
            middle = begin + (2 * part + 1) * half
            for i in range(NODES):
                u[i] = middle + half * POINTS[i]
            fill_rates(curve, passage, j, from_above, slack, gap, u, rates)
            # The weights add up to 2: what differs from one rate is less than a sum of all, and so is its rounding.
            usual, size, last, before, earlier, earliest = rates[NODES // 2], 0.0, 0.0, 0.0, 0.0, 0.0
            for i in range(NODES):
                size += GAUSS_WEIGHTS[i] * (rates[i] - usual)
                last += FIT[i, NODES - 1] * rates[i]
                before += FIT[i, NODES - 2] * rates[i]
                earlier += FIT[i, NODES - 5] * rates[i]
                earliest += FIT[i, NODES - 6] * rates[i]
            size += 2.0 * usual
            total += half * size
            tail, middle = max(fabs(last), fabs(before)), max(fabs(earlier), fabs(earliest))
            # Sixteen degrees on, the terms are these if they go on to decrease as they do over the last four. Next to a
            # turning point behind a joint they decrease more slowly than the first ones.
            beyond = tail * (tail / middle) ** 4 if tail > NOISE_RATIO * size else 0.0
            resolved &= tail <= MAX_TAIL_RATIO * size and beyond <= MAX_ERROR_RATIO * size
        if resolved:
            return total
        parts *= 2
    return np.nan


@Inner
def time_behind_edge(curve, passage, j, from_above, slack, gap, begin, end):  # type: ignore[no-untyped-def]
    """As `time_on_part`, for a panel that is next to one with a turning point very near the edge.

    Where the curvature jumps at that edge, dt/du has terms in gap/u**2.
    """
    total = 0.0
    while begin > 0.0 and end > MAX_PHASE_RATIO * begin:
        total += time_on_part(curve, passage, j, from_above, slack, gap, begin, MAX_PHASE_RATIO * begin)
        begin *= MAX_PHASE_RATIO
    return total + time_on_part(curve, passage, j, from_above, slack, gap, begin, end)


@Inner
def time_on_panel_of_both(curve, passage):  # type: ignore[no-untyped-def]
    """The half period of a body both of whose turning points are on one panel; NaN where it is not accurate."""
    return time_on_part(curve, passage, 0, False, 0.0, 0.0, 0.0, pi)


@Inner
def time_on_panel(curve, k, slack):  # type: ignore[no-untyped-def]
    """The time on a whole panel far from turning points by its own Gauss points; NaN if it is too near to one."""
    rows, paths = curve.rows, curve.table.paths
    distance, total = slack - rows[k, MIDDLE], 0.0
    if distance > SAFETY * rows[k, FEW_REACH]:
        few = few_rates()
        for i in range(hidden(FEW_NODES)):
            few[i] = paths[k, FEW_WEIGHTS + i] * inverse_root(2.0 * (slack - rows[k, FEW_POTENTIAL + i]))
        for i in range(FEW_NODES):
            total += few[i]
        return total
    if distance > SAFETY * rows[k, REACH]:
        prepare(curve, k, NEAR)
        rates = rates_buffer()
        for i in range(hidden(NODES)):
            rates[i] = paths[k, WEIGHTS + i] * inverse_root(2.0 * (slack - rows[k, POTENTIAL + i]))
        for i in range(NODES):
            total += rates[i]
        return total
    return np.nan


@Inner
def phase_of(below, above):  # type: ignore[no-untyped-def]
    """The phase angle of a place by its distances from the lower and the upper end."""
    return 2.0 * atan2(sqrt(max(below, 0.0)), sqrt(max(above, 0.0)))


@Inner
def time_between(curve, passage, slacks, lower, upper):  # type: ignore[no-untyped-def]
    """The time that a body takes from one place of its orbit to a higher one; NaN where it is not accurate.

    ``lower`` and ``upper`` are the distances of each from both ends of the orbit.
    """
    table, total, low, width = curve.table, 0.0, 0.0, passage.width
    paths, count, last = table.paths, curve.levels.size, passage.panels - 1
    first, end = passage.first + 1, passage.first + last
    to_edge = passage.low_rest * paths[(first - 1) % count, HALF]
    from_edge = passage.high_rest * paths[end % count, HALF]
    right, after = 0.0, passage.first % count
    for j in range(passage.panels):
        k, after = after, neighbour(after, 1, count)
        half = paths[k, HALF]
        left = right if j > 0 else to_edge - 2.0 * half
        right = left + 2.0 * half
        if left >= upper[0]:
            break
        if right <= lower[0]:
            continue
        begins, ends = j == 0 or left <= lower[0], j == last or right >= upper[0]
        if not (begins or ends):
            time = time_on_panel(curve, k, slacks[j])
            if time == time:
                total, error = two_sum(total, time)
                low += error
                continue
        part = 0.0
        if passage.turns == NEITHER:
            begin = (lower[0] - left) / half - 1.0 if begins else -1.0
            stop = (upper[0] - left) / half - 1.0 if ends else 1.0
            part = time_on_part(curve, passage, j, False, slacks[j], left, begin, stop)
        for side in range(2 if passage.turns != NEITHER else 0):
            from_above, is_middle = side == 1, passage.turns == BOTH and j == passage.middle
            if from_above != (j > passage.middle) and not (is_middle and last > 0):
                continue
            slack, gap, one, other = slacks[j], 0.0, lower, upper
            from_one, from_other, beyond = begins, ends, to_edge
            if from_above:
                one, other = (upper[1], upper[0]), (lower[1], lower[0])
                from_one, from_other, beyond = ends, begins, from_edge
            if from_above and j < last:
                slack, gap = slacks[j + 1], from_edge + edge_distance(table, first + j, end)
            elif not from_above and j > 0:
                gap = to_edge + edge_distance(table, first, first + j - 1)
            if gap > 0.0:
                beyond = gap + 2.0 * half
            begin = phase_of(one[0], one[1]) if from_one else phase_of(gap, width - gap)
            stop = phase_of(other[0], other[1]) if from_other else phase_of(beyond, width - beyond)
            if is_middle and last > 0:
                stop = min(stop, 0.5 * pi)
            if begin < stop:
                part += time_behind_edge(curve, passage, j, from_above, slack, gap, begin, stop)
        total, error = two_sum(total, part)
        low += error
    return total + low


@Inner
def travel_time(curve, orbit, passage, slacks, place):  # type: ignore[no-untyped-def]
    """The first time at which a body is at a place, or for NaN the time of half a period, of a lap or until it leaves.

    It is NaN where it is not accurate, and inf if the body is never there.
    """
    width, laps, onwards = passage.width, 0.0, True
    here, there, start, end = (0.0, width), (width, 0.0), (0.0, width), (width, 0.0)
    if orbit.leaves != 0 and place != place:
        here, there = (-orbit.low, orbit.high), end if orbit.leaves > 0 else start
        onwards = orbit.leaves == orbit.direction
    if place == place:
        ahead = place - orbit.lam0
        if orbit.circulates:
            laps = floor(orbit.direction * ahead / width)
            ahead -= orbit.direction * laps * width
        here, there = (-orbit.low, orbit.high), (ahead - orbit.low, orbit.high - ahead)
        if laps < 0.0 or not (there[0] >= 0.0 and there[1] >= 0.0):
            return np.inf
        onwards = orbit.direction * ahead >= 0.0
        if not onwards and orbit.leaves == orbit.direction:
            return np.inf
    turn = end if orbit.direction > 0 else start
    time = 0.0
    # To the place, or to the end ahead and back from there to the place; then all laps before that.
    for stretch in range(1 if onwards and laps == 0.0 else 2):
        first, last = here, there
        if not onwards:
            first, last = (here if stretch == 0 else there), turn
        elif stretch == 1:
            first, last = start, end
        lower, upper = (first, last) if first[0] < last[0] else (last, first)
        part = time_between(curve, passage, slacks, lower, upper)
        time += laps * part if onwards and stretch == 1 else part
    return time
