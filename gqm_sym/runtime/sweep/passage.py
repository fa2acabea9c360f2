"""Where a body goes on a tabulated curve, and how long that takes (`curve_table`).

On a panel far from turning points V**2 is evaluated at the panel's own Gauss points. On other panels the Gauss points
are phase angles of the orbit, and V**2 is a divided difference of the panel's polynomial next to a turning point, so
that nothing cancels.
"""

from math import atan2, fabs, floor, sqrt
from typing import NamedTuple

import numpy as np

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.arithmetic.elementary import cos, sin
from gqm_sym.runtime.compiled.calls import call_effective_potential, call_potential_divdiff1
from gqm_sym.runtime.compiled.jit import Inlined, Inner
from gqm_sym.runtime.compiled.registers import on_stack
from gqm_sym.runtime.launch.zeros import CONSTANT_SHARE, CRITICAL, LIMIT, TURN
from gqm_sym.runtime.quadrature.time_panels import MIN_CANCELLATION_RATIO
from gqm_sym.runtime.sweep.curve_table import (
    BASE,
    BASE_SIZE,
    DS_TERMS,
    FEW_NODES,
    FEW_POTENTIAL,
    FEW_REACH,
    FEW_WEIGHTS,
    FIT,
    GAUSS_WEIGHTS,
    INCREASE,
    LEFT_TERMS,
    MIDDLE,
    NODES,
    POINTS,
    POTENTIAL,
    REACH,
    SPREAD,
    WEIGHTS,
    difference_on,
    potential_on,
    value_on,
)
from gqm_sym.runtime.sweep.orbit import NO_ENDS, Orbit
from gqm_sym.runtime.sweep.panel_forces import CONVEX, FAR, HIGHEST, NEAR, SLOPE_SIGN, TOP, prepare

# By how much V**2 at the middle of a panel must exceed what the panel's rule needs.
SAFETY = 1.05

# The last Legendre coefficients of an integrand, as a share of the first, up to which its integral is accurate to
# rounding: they belong to degrees 14 and 15, the error to degree 32. Otherwise the part is halved, so often at most.
MAX_TAIL_RATIO, MAX_HALVINGS = 2e-8, 5

# What their extrapolation to that degree may be, and what counts as rounding noise.
MAX_ERROR_RATIO, NOISE_RATIO = 2e-16, 2e-15

# How near to an equilibrium a turning point may lie, as a share of the panel, for doubles to decide that it is one.
MAX_ZERO_ERROR = 1e-6

# The slope of the potential at a launch from rest, as a share of what it spreads over on the panel, above which the
# body certainly falls.
MIN_SLOPE_SHARE = 1e-6

few_rates, rates_buffer, angle_buffer = on_stack(FEW_NODES), on_stack(NODES), on_stack(NODES)


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
    width : float
        The distance between both ends.
    turns : int
        Which ends are turning points: BOTH, LOWER or UPPER, or NEITHER of a lap and of a body that runs through.
    v2 : float
        V**2 at the lower end if NEITHER is.
    """

    first: int
    panels: int
    low_x: float
    high_x: float
    width: float
    turns: int
    v2: float


@Inner
def locate(table, period, place):  # type: ignore[no-untyped-def]
    """The index of the panel that a place lies on, and where in [-1, 1] on it."""
    edges = table.edges
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
    left, right = edges[below], edges[below + 1]
    x = ((place - left) - (right - place)) / (right - left)
    return below + int(laps) * count, min(max(x, -1.0), 1.0)


@Inner
def edge_place(table, period, index):  # type: ignore[no-untyped-def]
    """The place of the left edge of a panel; on a closed curve by its index over all laps."""
    count = table.edges.size - 1
    if period == 0.0:
        return table.edges[index]
    lap = index // count
    return table.edges[index - lap * count] + lap * period


@Inner
def zero_on_panel(rows, k, slack, near, far):  # type: ignore[no-untyped-def]
    """Where the potential of panel k reaches ``slack`` between a place below it and one above it."""
    x = 0.5 * (near + far)
    for _ in range(60):
        value, slope = 0.0, 0.0
        for j in range(NODES - 1, -1, -1):
            slope = slope * x + value
            value = value * x + rows[k, LEFT_TERMS + j]
        slope, value = value + (1.0 + x) * slope, (1.0 + x) * value
        if value < slack:
            near = x
        else:
            far = x
        new = x - (value - slack) / slope
        if not min(near, far) < new < max(near, far):
            new = 0.5 * (near + far)
        if fabs(new - x) <= 2.0**-52:
            return new
        x = new
    return x


@Inner
def turn_from(curve, start, x, w0, direction):  # type: ignore[no-untyped-def]
    """What ends a motion in one direction from a place on the table: what it is, the panel, and the place on it.

    It is TURN, LIMIT (an end of the curve, or a whole lap) or CRITICAL where the table does not decide it.
    """
    rows, count, period = curve.rows, curve.levels.size, curve.period
    index = start
    k = index % count
    prepare(curve, k, FAR | NEAR)
    energy = 0.5 * w0 + rows[k, BASE] + potential_on(rows, k, x)
    margin = CONSTANT_SHARE * (0.5 * w0 + max(fabs(energy), rows[k, BASE_SIZE]))
    for passed in range(count + 1):
        prepare(curve, k, FAR)
        error = margin + CONSTANT_SHARE * rows[k, BASE_SIZE]
        may_turn = not rows[k, HIGHEST] < energy - error
        if may_turn:
            prepare(curve, k, NEAR)
        if may_turn and not rows[k, TOP] < energy - error:
            sign, slack = rows[k, SLOPE_SIGN] * direction, energy - rows[k, BASE]
            if sign == 0.0 and rows[k, CONVEX] == 1.0:
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
        k = index % count
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
def polished(curve, lam0, w0, index, x):  # type: ignore[no-untyped-def]
    """The offset of a turning point from the launch, and its place on its panel, by a step of Newton's method."""
    table = curve.table
    k = index % curve.levels.size
    left, half = edge_place(table, curve.period, index), 0.5 * (table.edges[k + 1] - table.edges[k])
    place, offset, out = np.empty(1), np.empty(1), np.empty((2, 1))
    offset[0] = (left - lam0) + half * (1.0 + x)
    place[0] = lam0 + offset[0]
    call_potential_divdiff1(curve.fns.potential_divdiff1, 1, lam0, place, offset, curve.p, out)
    step = (0.5 * w0 - offset[0] * out[0, 0]) / (difference_on(curve.rows, k, x, x) / half)
    return offset[0] + step, x + step / half


@Inner
def end_ahead(curve, lam0, w0, direction):  # type: ignore[no-untyped-def]
    """The offset of the end of the curve in one direction, and V**2 there; NaN if a body may not leave there."""
    edges, place, offset, out = curve.table.edges, np.empty(2), np.empty(1), np.empty((2, 2))
    place[0], place[1] = edges[-1] if direction > 0 else edges[0], lam0
    offset[0] = place[0] - lam0
    call_effective_potential(curve.fns.effective_potential, 2, place, curve.p, out)
    size = w0 + 2.0 * (fabs(out[0, 0]) + fabs(out[0, 1]))
    call_potential_divdiff1(curve.fns.potential_divdiff1, 1, lam0, place, offset, curve.p, out.reshape(4))
    v2 = w0 - 2.0 * offset[0] * out[0, 0]
    certain = curve.ends != NO_ENDS and offset[0] != 0.0 and v2 > MIN_LEAVING_SHARE * size
    return offset[0], v2 if certain else np.nan


@Inner
def find_passage(curve, lam0, v0, direction):  # type: ignore[no-untyped-def]
    """The orbit of a launch and the panels that it passes; no panels where the table does not decide."""
    table, w0 = curve.table, v0 * v0
    count = curve.levels.size
    none = Orbit(False, False, direction, lam0, w0, 0.0, 0.0, 0), Passage(0, 0, 0.0, 0.0, 0.0, BOTH, 0.0)
    if count == 0:
        return none
    start, x = locate(table, curve.period, lam0)
    if w0 == 0.0:
        direction = downhill(curve, start % count, x)
        if direction == 0 or fabs(x) == 1.0:
            return none
    ahead, front, front_x = turn_from(curve, start, x, w0, direction)
    if ahead == LIMIT and curve.period > 0.0 and w0 > 0.0:
        lap = direction * curve.period
        orbit = Orbit(True, False, direction, lam0, w0, min(lap, 0.0), max(lap, 0.0), 0)
        return orbit, Passage(start if direction > 0 else start - count, count + 1, x, x, curve.period, NEITHER, w0)
    leaves, turns, v2, last = 0, BOTH, w0, count - 1
    if ahead == TURN:
        offset, front_x = polished(curve, lam0, w0, front, front_x)
    else:
        leaves, front, front_x = direction, last if direction > 0 else 0, float(direction)
        offset, v2 = end_ahead(curve, lam0, w0, direction)
    other, back, back_x, behind = 0.0, start, x, TURN
    if w0 > 0.0:
        behind, back, back_x = turn_from(curve, start, x, w0, -direction)
        if behind == TURN:
            other, back_x = polished(curve, lam0, w0, back, back_x)
        elif leaves != 0:
            turns, back, back_x = NEITHER, start, x
        else:
            leaves, back, back_x = -direction, 0 if direction > 0 else last, float(-direction)
            other, v2 = end_ahead(curve, lam0, w0, -direction)
    if leaves == 0 and (curve.rows[front % count, SLOPE_SIGN] == 0.0 or curve.rows[back % count, SLOPE_SIGN] == 0.0):
        return none  # a swing about the lowest place of a panel has more digits without the table
    last_end = ahead if leaves == direction else behind
    if leaves != 0 and not (last_end == LIMIT and v2 > 0.0 and curve.period == 0.0):
        return none
    low, first, low_x, high, end, high_x = other, back, back_x, offset, front, front_x
    if direction < 0:
        low, first, low_x, high, end, high_x = offset, front, front_x, other, back, back_x
    if leaves != 0 and turns != NEITHER:
        turns = LOWER if leaves > 0 else UPPER
    orbit = Orbit(False, False, direction, lam0, w0, low, high, leaves)
    v2 = v2 if direction < 0 else w0
    return orbit, Passage(first, end - first + 1, low_x, high_x, high - low, turns, v2)


@Inner
def passage_of(curve, orbit):  # type: ignore[no-untyped-def]
    """The panels that a known orbit passes; none if the curve is not tabulated."""
    table = curve.table
    if curve.levels.size == 0:
        return Passage(0, 0, 0.0, 0.0, 0.0, BOTH, 0.0)
    first, low_x = locate(table, curve.period, orbit.lam0 + orbit.low)
    if orbit.circulates:
        return Passage(first, curve.levels.size + 1, low_x, low_x, curve.period, NEITHER, orbit.v2)
    last, high_x = locate(table, curve.period, orbit.lam0 + orbit.high)
    inside = table.edges[0] <= orbit.lam0 + orbit.low and orbit.lam0 + orbit.high <= table.edges[-1]
    panels = last - first + 1 if inside or curve.period > 0.0 else 0
    return Passage(first, panels, low_x, high_x, orbit.high - orbit.low, BOTH, 0.0)


@Inner
def fill_slacks(curve, passage, slacks):  # type: ignore[no-untyped-def]
    """Fill V**2/2 at the left edge of each panel of a passage; returns whether they keep enough digits.

    They are sums of two doubles from the nearer turning point. On a panel that has one they are as if the curve went on
    beyond it.
    """
    rows, count, last = curve.rows, curve.levels.size, passage.panels - 1
    for j in range(passage.panels):
        prepare(curve, (passage.first + j) % count, FAR | NEAR if j in (0, last) else FAR)
    turns, edges = passage.turns, curve.table.edges
    middle = last // 2
    if turns != BOTH:
        middle = -1 if turns == UPPER else last
    k, high = passage.first % count, (passage.first + last) % count
    peak, top, least, slope, begin = 0.0, 0.0, 1.0, np.inf, 0.0
    if turns == NEITHER:
        peak = begin = 0.5 * passage.v2
    if turns != UPPER:
        slacks[0] = potential_on(rows, k, passage.low_x) + begin
        slack, low = (passage.low_x - 1.0) * difference_on(rows, k, passage.low_x, 1.0) + begin, 0.0
        for j in range(1, middle + 1):
            slacks[j] = slack
            peak = max(peak, slack)
            least = min(least, slack / peak)
            slack, error = two_sum(slack, -rows[(passage.first + j) % count, INCREASE])
            low += error
            slack, low = two_sum(slack, low)
        peak = max(peak, slack)
        if turns != BOTH:
            least = min(least, slack / peak)
        if turns != NEITHER:
            slope = -difference_on(rows, k, passage.low_x, passage.low_x) / (edges[k + 1] - edges[k])
    if turns in (BOTH, UPPER):
        slack, low = (passage.high_x + 1.0) * difference_on(rows, high, -1.0, passage.high_x), 0.0
        slacks[last] = slack
        for j in range(last - 1, middle, -1):
            top = max(top, slack)
            least = min(least, slack / top)
            slack, error = two_sum(slack, rows[(passage.first + j) % count, INCREASE])
            low += error
            slack, low = two_sum(slack, low)
            slacks[j] = slack
        top = max(top, slack)
        least = min(least, slack / top)
        slope_above = difference_on(rows, high, passage.high_x, passage.high_x) / (edges[high + 1] - edges[high])
        slope = min(slope, slope_above)
    # Neither turning point may be next to an equilibrium.
    enough = 0.5 * MIN_CANCELLATION_RATIO * max(top, peak)
    return least >= MIN_CANCELLATION_RATIO and slope * passage.width >= enough


@Inlined
def is_upper(passage, j):  # type: ignore[no-untyped-def]
    """Whether phase angles on panel j of a passage are counted from the upper end."""
    return passage.turns == UPPER or (passage.turns == BOTH and 2 * j >= passage.panels)


@Inner
def fill_rates(curve, passage, j, slack, gap, u, out):  # type: ignore[no-untyped-def]
    """Fill the time per unit of u on panel j of a passage at the Gauss points u.

    u is the orbit's phase angle, or the place on the panel if the passage has no turning point. Phase angles are
    counted from the nearer one, because a small time next to it needs a small angle with all digits. ``slack`` and
    ``gap`` belong to the panel's edge that is nearer to it: V**2/2 there, and the distance from the turning point. An
    end of the curve stands for a turning point that there is not.
    """
    rows, edges, last = curve.rows, curve.table.edges, passage.panels - 1
    k = (passage.first + j) % curve.levels.size
    half = 0.5 * (edges[k + 1] - edges[k])
    for i in range(NODES):
        x, numerator = u[i], half * half
        if passage.turns == NEITHER:
            fall = slack - potential_on(rows, k, x)
        else:
            s, c = sin(0.5 * u[i]), cos(0.5 * u[i])
            below, above = passage.width * s * s, passage.width * c * c
            if is_upper(passage, j):
                below, above = above, below
            # V**2/2 is its value at a turning point or an edge, and what the potential falls from there.
            if j == 0 and passage.turns != UPPER:
                x, y, at_y, factor, numerator = passage.low_x + below / half, passage.low_x, 0.0, -1.0, above * half
            elif j == last and passage.turns != LOWER:
                x, y, at_y, factor, numerator = passage.high_x - above / half, passage.high_x, 0.0, 1.0, below * half
            elif is_upper(passage, j):
                rest = (above - gap) / half
                x, y, at_y, factor, numerator = 1.0 - rest, 1.0, slack, rest, below * above
            else:
                rest = (below - gap) / half
                x, y, at_y, factor, numerator = rest - 1.0, -1.0, slack, -rest, below * above
            fall = at_y + factor * difference_on(rows, k, y, x)
        out[i] = value_on(curve.table.paths, k, DS_TERMS, x) * sqrt(numerator / (2.0 * fall))


@Inner
def time_on_part(curve, passage, j, slack, gap, begin, end):  # type: ignore[no-untyped-def]
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
            fill_rates(curve, passage, j, slack, gap, u, rates)
            size, last, before, earlier, earliest = 0.0, 0.0, 0.0, 0.0, 0.0
            for i in range(NODES):
                size += GAUSS_WEIGHTS[i] * rates[i]
                last += FIT[i, NODES - 1] * rates[i]
                before += FIT[i, NODES - 2] * rates[i]
                earlier += FIT[i, NODES - 5] * rates[i]
                earliest += FIT[i, NODES - 6] * rates[i]
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
def time_on_panel(curve, k, slack):  # type: ignore[no-untyped-def]
    """The time on a whole panel far from turning points by its own Gauss points; NaN if it is too near to one."""
    rows, paths = curve.rows, curve.table.paths
    distance, total = slack - rows[k, MIDDLE], 0.0
    if distance > SAFETY * rows[k, FEW_REACH]:
        few = few_rates()
        for i in range(FEW_NODES):
            few[i] = paths[k, FEW_WEIGHTS + i] / sqrt(2.0 * (slack - rows[k, FEW_POTENTIAL + i]))
        for i in range(FEW_NODES):
            total += few[i]
        return total
    if distance > SAFETY * rows[k, REACH]:
        prepare(curve, k, NEAR)
        rates = rates_buffer()
        for i in range(NODES):
            rates[i] = paths[k, WEIGHTS + i] / sqrt(2.0 * (slack - rows[k, POTENTIAL + i]))
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
    table, total, low = curve.table, 0.0, 0.0
    count, last, right = curve.levels.size, passage.panels - 1, 0.0
    for j in range(passage.panels):
        k = (passage.first + j) % count
        size = table.edges[k + 1] - table.edges[k]
        left = right if j > 0 else -0.5 * (1.0 + passage.low_x) * size
        right = left + size if j > 0 else 0.5 * (1.0 - passage.low_x) * size
        if left >= upper[0]:
            break
        if right <= lower[0]:
            continue
        begins, ends = left <= lower[0], right >= upper[0]
        if not (begins or ends):
            time = time_on_panel(curve, k, slacks[j])
            if time == time:
                total, error = two_sum(total, time)
                low += error
                continue
        slack, gap = slacks[j], left
        if passage.turns == NEITHER:
            half = 0.5 * size
            begin = (lower[0] - left) / half - 1.0 if begins else -1.0
            end = (upper[0] - left) / half - 1.0 if ends else 1.0
        else:
            first = lower if begins else (left, passage.width - left)
            second = upper if ends else (right, passage.width - right)
            if is_upper(passage, j):
                first, second = (second[1], second[0]), (first[1], first[0])
                if j < last:
                    slack = slacks[j + 1]
                    beyond = (passage.first + last) % count
                    rest = 0.5 * (1.0 + passage.high_x) * (table.edges[beyond + 1] - table.edges[beyond])
                    gap = rest if j == last - 1 else passage.width - right
            begin, end = phase_of(first[0], first[1]), phase_of(second[0], second[1])
        total, error = two_sum(total, time_on_part(curve, passage, j, slack, gap, begin, end))
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
