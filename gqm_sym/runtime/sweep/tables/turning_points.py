"""The first turning points of a body on a tabulated curve, or the ends through which it leaves the curve."""

from math import fabs

import numpy as np

from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.launch.zeros import CONSTANT_SHARE, CRITICAL, LIMIT, TURN
from gqm_sym.runtime.sweep.orbit import NO_ENDS
from gqm_sym.runtime.sweep.tables.layout import BASE, BASE_SIZE, HALF, INCREASE, LEFT_TERMS, NODES, RIGHT_TERMS, SPREAD
from gqm_sym.runtime.sweep.tables.panel_forces import CONVEX_FROM, FAR, HIGHEST, NEAR, SLOPE_SIGN, TOP, prepare
from gqm_sym.runtime.sweep.tables.places import distance_between, from_left, from_right, neighbour
from gqm_sym.runtime.sweep.tables.potential import (
    difference_from,
    difference_on,
    rise_between,
    rise_from_left,
    rise_from_right,
    rise_on,
)

# The last step of Newton's method to a turning point, in units of half the panel; the error is about its square.
MAX_LAST_STEP = 2.0**-32

# The number of further steps in which V**2 is measured from the side from which the body comes; before them the place
# has few digits in flat wells.
LAST_STEPS = 2

# The largest rounding error of a turning point, as a share of the panel, for which doubles distinguish it from an
# equilibrium.
MAX_ZERO_ERROR = 1e-6

# The slope of the potential at a launch from rest above which the body certainly moves, as a share of the range of the
# potential on the panel.
MIN_SLOPE_SHARE = 1e-6

# The value of V**2 at an end of the curve above which a body certainly leaves there, as a share of the size of its
# terms.
MIN_LEAVING_SHARE = 1e-9


@Inner
def zero_on_panel(rows, k, slack, near, far):  # type: ignore[no-untyped-def]
    """Return the place at which the potential of panel k reaches ``slack``, between a place below this level and one
    above it (see `polished`).
    """
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
    """Return the end of a motion in one direction from a place on the table: its kind, the panel, and the place on it.

    Its kind is TURN, LIMIT (an end of the curve, or a whole lap) or CRITICAL if the table does not decide it.
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
                sign = 1.0  # a convex potential rises where it reaches a level from below
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
    """Return the direction in which a body released at a place of panel k falls; 0 next to an equilibrium."""
    prepare(curve, k, FAR | NEAR)
    sign, slope = curve.rows[k, SLOPE_SIGN], difference_on(curve.rows, k, x, x)
    if sign == 0.0 and fabs(slope) > MIN_SLOPE_SHARE * curve.rows[k, SPREAD]:
        sign = 1.0 if slope > 0.0 else -1.0
    return -int(sign)


@Inner
def slack_at_edge(curve, launch, w0, index, direction):  # type: ignore[no-untyped-def]
    """Return V**2/2 at the edge through which a body enters a panel other than that of the launch."""
    rows, count = curve.rows, curve.levels.size
    start, x, near = launch
    k = start % count
    if direction > 0:
        return 0.5 * w0 + rise_from_right(rows, k, x, near) - rise_between(rows, (start + 1) % count, index % count)
    return 0.5 * w0 + rise_from_left(rows, k, x, near) - rise_between(rows, k, (index + 1) % count)


@Inner
def polished(curve, launch, w0, index, x, direction):  # type: ignore[no-untyped-def]
    """Return a turning point to all digits, by steps of Newton's method: its offset from the launch, and its place.

    V**2 is computed from the launch if that is on the same panel, else from the edge through which the body enters.
    """
    table, rows, count = curve.table, curve.rows, curve.levels.size
    k = index % count
    half, (start, at, near) = table.paths[k, HALF], launch
    if index == start:
        edge, to_edge, distance = LEFT_TERMS if at <= 0.0 else RIGHT_TERMS, near if at <= 0.0 else -near, x - at
        for _ in range(LAST_STEPS):
            y = to_edge + distance
            distance += (0.5 * w0 - distance * difference_from(rows, k, edge, to_edge, y)) / difference_from(
                rows, k, edge, y, y
            )
        gap = from_left(at, near) + distance
        gap = gap if gap <= 1.0 else from_right(at, near) - distance
        return half * distance, (index, at + distance, gap)
    gap, slack = 1.0 + direction * x, slack_at_edge(curve, launch, w0, index, direction)
    edge = LEFT_TERMS if direction > 0 else RIGHT_TERMS
    for _ in range(LAST_STEPS):
        y = direction * gap
        gap += direction * (slack - rise_on(rows, k, edge, y)) / difference_from(rows, k, edge, y, y)
    if direction > 0:
        turn = index, gap - 1.0, gap if gap <= 1.0 else 2.0 - gap
        return distance_between(table, launch, turn), turn
    turn = index, 1.0 - gap, gap if gap < 1.0 else 2.0 - gap
    return -distance_between(table, turn, launch), turn


@Inner
def end_ahead(curve, launch, w0, direction):  # type: ignore[no-untyped-def]
    """Return the offset of the end of the curve in one direction, its place, and V**2 there; NaN if the body may not
    leave there.
    """
    rows, last = curve.rows, curve.levels.size - 1
    start, x, near = launch
    if direction > 0:
        end, k = (last, 1.0, 0.0), last
        half_v2 = 0.5 * w0 + rise_from_right(rows, start, x, near)
        if start < last:
            half_v2 = slack_at_edge(curve, launch, w0, last, 1) - rows[last, INCREASE]
        offset = distance_between(curve.table, launch, end)
    else:
        end, k = (0, -1.0, 0.0), 0
        half_v2 = 0.5 * w0 + rise_from_left(rows, start, x, near)
        if start > 0:
            half_v2 = slack_at_edge(curve, launch, w0, 0, -1) + rows[0, INCREASE]
        offset = -distance_between(curve.table, end, launch)
    size = 0.5 * w0 + rows[start, BASE_SIZE] + rows[k, BASE_SIZE] + fabs(rows[k, INCREASE])
    certain = curve.ends != NO_ENDS and offset != 0.0 and half_v2 > MIN_LEAVING_SHARE * size
    return offset, end, 2.0 * half_v2 if certain else np.nan
