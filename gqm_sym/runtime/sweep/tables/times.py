"""The time that a body takes on a tabulated curve.

On a panel far from turning points V**2 is evaluated at the panel's own Gauss points. On other panels the Gauss points
are phase angles of the orbit, and V**2 is a divided difference of the panel's polynomial next to a turning point, so
that nothing cancels.
"""

from math import atan2, fabs, floor, pi, sqrt

import numpy as np

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.arithmetic.elementary import cos, inverse_root, sin
from gqm_sym.runtime.compiled.intrinsics import choose
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import on_stack, opaque
from gqm_sym.runtime.sweep.tables.layout import (
    DS_TERMS,
    FEW_NODES,
    FEW_POTENTIAL,
    FEW_REACH,
    FEW_WEIGHTS,
    FIT,
    GAUSS_WEIGHTS,
    HALF,
    LEFT_TERMS,
    MIDDLE,
    MIDDLE_TERMS,
    NODES,
    POINTS,
    POTENTIAL,
    REACH,
    RIGHT_TERMS,
    WEIGHTS,
)
from gqm_sym.runtime.sweep.tables.panel_forces import NEAR, prepare
from gqm_sym.runtime.sweep.tables.passage import BOTH, NEITHER
from gqm_sym.runtime.sweep.tables.places import edge_distance, neighbour
from gqm_sym.runtime.sweep.tables.potential import difference_from, potential_on, rise_on, value_on

# The factor by which V**2 at the middle of a panel must exceed the value that the panel's rule requires.
SAFETY = 1.05

# The largest last Legendre coefficients of an integrand, as a share of the first, for which its integral is accurate to
# rounding: they belong to degrees 14 and 15, the error to degree 32. Otherwise the part is halved, at most this many
# times.
MAX_TAIL_RATIO, MAX_HALVINGS = 2e-8, 5

# The largest ratio of phase angles at the ends of a part that follows an edge next to a turning point.
MAX_PHASE_RATIO = 4.0

# The largest extrapolation of these coefficients to degree 32, and the share below which they count as rounding noise.
MAX_ERROR_RATIO, NOISE_RATIO = 2e-16, 2e-15

few_rates = on_stack(FEW_NODES)
rates_buffer, angle_buffer, place_buffer, fall_buffer = (on_stack(NODES) for _ in range(4))


@Inner
def fill_falls_from_turn(rows, k, end, sign, x, falls):  # type: ignore[no-untyped-def]
    """Fill the decreases of the potential of panel k from a turning point on it to places x at increasing distances.

    ``end`` contains the turning point and its distance from the edge on whose side the places are, both in units of
    half the panel; ``sign`` is 1 if the places lie above it. Divided differences are computed from the nearer edge.
    """
    y, to_edge = end
    inner, outer, edge = (RIGHT_TERMS, LEFT_TERMS, -1.0) if sign > 0.0 else (LEFT_TERMS, RIGHT_TERMS, 1.0)
    n, q, from_other_edge = opaque(NODES), -sign * to_edge, y - edge
    for i in range(n):
        distance = falls[i]
        falls[i] = -sign * difference_from(rows, k, inner, q + distance, q)
    if (x[0] + y < 0.0) != (sign < 0.0):
        for i in range(n):
            fall = -sign * difference_from(rows, k, outer, from_other_edge, x[i] - edge)
            falls[i] = choose((x[i] + y < 0.0) != (sign < 0.0), fall, falls[i])


@Inner
def fill_rates(curve, passage, j, from_above, slack, gap, u, out):  # type: ignore[no-untyped-def]
    """Fill the time per unit of u on panel j of a passage at the Gauss points u, which ascend.

    u is the orbit's phase angle, or the place on the panel if the passage has no turning point. Phase angles are
    measured from the nearer turning point, because a small time next to it requires a small angle with all digits;
    ``from_above`` says whether that is the upper one. ``slack`` and ``gap`` belong to the panel's edge that is nearer
    to it: V**2/2 there, and the distance from the turning point. An end of the curve takes the place of a missing
    turning point.
    """
    rows, paths, last = curve.rows, curve.table.paths, passage.panels - 1
    k = (passage.first + j) % curve.levels.size
    x, falls, half, n = place_buffer(), fall_buffer(), paths[k, HALF], opaque(NODES)
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
        end = (passage.high_x, passage.high_from_edge) if from_above else (passage.low_x, passage.low_to_edge)
        for i in range(n):
            s, c = sin(0.5 * u[i]), cos(0.5 * u[i])
            near, far = width * s * s, width * c * c
            # V**2/2 is its value at a turning point or an edge plus the decrease of the potential from there.
            distance = near / half if on_panel else (near - gap) / half
            x[i], falls[i] = (end[0] if on_panel else -sign) + sign * distance, sign * distance
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
    """Fill places at phase angles u on a panel k that contains both turning points, and V**2/2 as in `fill_rates`.

    V**2/2 is (x - low)*(high - x) times the second divided difference of the potential, whose coefficients are computed
    once.
    """
    low, high, terms, first, second = passage.low_x, passage.high_x, rates_buffer(), 0.0, 0.0
    for j in range(NODES, 1, -1):
        # The powers of the potential divided by x - low, and then by x - high.
        first = first * low + rows[k, MIDDLE_TERMS + j - 1]
        second = second * high + first
        terms[j - 2] = second
    for i in range(opaque(NODES)):
        s, c = sin(0.5 * u[i]), cos(0.5 * u[i])
        x[i], falls[i] = low * c * c + high * s * s, 0.0
        for j in range(NODES - 2, -1, -1):
            falls[i] = falls[i] * x[i] + terms[j]


@Inner
def time_on_part(curve, passage, j, from_above, slack, gap, begin, end):  # type: ignore[no-untyped-def]
    """Return the time between two values of u (`fill_rates`) on panel j of a passage; NaN if it is not accurate."""
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
            # The weights add up to 2. Only the differences from one of the rates are summed, because they, and so their
            # rounding, are smaller.
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
            # This is the size of the terms sixteen degrees further on if they continue to decrease as over the last
            # four. Next to a turning point beyond a joint they decrease more slowly than the first ones.
            beyond = tail * (tail / middle) ** 4 if tail > NOISE_RATIO * size else 0.0
            resolved &= tail <= MAX_TAIL_RATIO * size and beyond <= MAX_ERROR_RATIO * size
        if resolved:
            return total
        parts *= 2
    return np.nan


@Inner
def time_behind_edge(curve, passage, j, from_above, slack, gap, begin, end):  # type: ignore[no-untyped-def]
    """Return the result of `time_on_part` for a panel next to one that has a turning point very near their common edge.

    If the curvature jumps at that edge, dt/du has terms in gap/u**2.
    """
    total = 0.0
    while begin > 0.0 and end > MAX_PHASE_RATIO * begin:
        total += time_on_part(curve, passage, j, from_above, slack, gap, begin, MAX_PHASE_RATIO * begin)
        begin *= MAX_PHASE_RATIO
    return total + time_on_part(curve, passage, j, from_above, slack, gap, begin, end)


@Inner
def time_on_panel_of_both(curve, passage):  # type: ignore[no-untyped-def]
    """Return the half period of a body with both turning points on one panel; NaN if it is not accurate."""
    return time_on_part(curve, passage, 0, False, 0.0, 0.0, 0.0, pi)


@Inner
def time_on_panel(curve, k, slack):  # type: ignore[no-untyped-def]
    """Return the time on a whole panel far from turning points by its own Gauss points; NaN if a turning point is too
    near.
    """
    rows, paths = curve.rows, curve.table.paths
    distance, total = slack - rows[k, MIDDLE], 0.0
    if distance > SAFETY * rows[k, FEW_REACH]:
        few = few_rates()
        for i in range(opaque(FEW_NODES)):
            few[i] = paths[k, FEW_WEIGHTS + i] * inverse_root(2.0 * (slack - rows[k, FEW_POTENTIAL + i]))
        for i in range(FEW_NODES):
            total += few[i]
        return total
    if distance > SAFETY * rows[k, REACH]:
        prepare(curve, k, NEAR)
        rates = rates_buffer()
        for i in range(opaque(NODES)):
            rates[i] = paths[k, WEIGHTS + i] * inverse_root(2.0 * (slack - rows[k, POTENTIAL + i]))
        for i in range(NODES):
            total += rates[i]
        return total
    return np.nan


@Inner
def phase_of(below, above):  # type: ignore[no-untyped-def]
    """Return the phase angle of a place, given its distances from the lower and the upper end."""
    return 2.0 * atan2(sqrt(max(below, 0.0)), sqrt(max(above, 0.0)))


@Inner
def time_between(curve, passage, half_v2_at_edges, lower, upper):  # type: ignore[no-untyped-def]
    """Return the time that a body takes from one place of its orbit to a higher one; NaN if it is not accurate.

    ``lower`` and ``upper`` are the distances of each from both ends of the orbit.
    """
    table, total, low, width = curve.table, 0.0, 0.0, passage.width
    paths, count, last = table.paths, curve.levels.size, passage.panels - 1
    first, end = passage.first + 1, passage.first + last
    to_edge = passage.low_to_edge * paths[(first - 1) % count, HALF]
    from_edge = passage.high_from_edge * paths[end % count, HALF]
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
            time = time_on_panel(curve, k, half_v2_at_edges[j])
            if time == time:
                total, error = two_sum(total, time)
                low += error
                continue
        part = 0.0
        if passage.turns == NEITHER:
            begin = (lower[0] - left) / half - 1.0 if begins else -1.0
            stop = (upper[0] - left) / half - 1.0 if ends else 1.0
            part = time_on_part(curve, passage, j, False, half_v2_at_edges[j], left, begin, stop)
        for side in range(2 if passage.turns != NEITHER else 0):
            from_above, is_middle = side == 1, passage.turns == BOTH and j == passage.middle
            if from_above != (j > passage.middle) and not (is_middle and last > 0):
                continue
            slack, gap, one, other = half_v2_at_edges[j], 0.0, lower, upper
            from_one, from_other, beyond = begins, ends, to_edge
            if from_above:
                one, other = (upper[1], upper[0]), (lower[1], lower[0])
                from_one, from_other, beyond = ends, begins, from_edge
            if from_above and j < last:
                slack, gap = half_v2_at_edges[j + 1], from_edge + edge_distance(table, first + j, end)
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
def time_along(curve, passage, half_v2_at_edges, ends, turns):  # type: ignore[no-untyped-def]
    """Return the time that a body takes from one place of its orbit to another, with so many turns on its way; NaN if
    it is not accurate.

    Parameters
    ----------
    ends : (here, there, ahead)
        The distances of both places from both ends of the orbit, and those of the end towards which it moves first.
    turns : int
        0 if it moves on to the other place, 1 if it turns at the end ahead before, 2 if also at the other end.
    """
    here, there, ahead = ends
    time, behind = 0.0, (ahead[1], ahead[0])
    for k in range(turns + 1):
        first, last = here if k == 0 else behind, there if k == turns else ahead
        if k % 2 == 1:
            first, last = ahead, there if k == turns else behind
        lower, upper = (first, last) if first[0] < last[0] else (last, first)
        time += time_between(curve, passage, half_v2_at_edges, lower, upper)
    return time


@Inner
def travel_time(curve, orbit, passage, half_v2_at_edges, place, again):  # type: ignore[no-untyped-def]
    """Return the first time at which a body is at a place or, if that is NaN, the time of half a period, of a lap or
    until it leaves.

    It is NaN if it is not accurate, and inf if the body never reaches the place. If a body that turns comes to the
    place ``again``, it is the time at which it passes it in the other direction.
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
    ends = here, there, end if orbit.direction > 0 else start
    time = time_along(curve, passage, half_v2_at_edges, ends, (0 if onwards else 1) + (1 if again else 0))
    if laps != 0.0:
        time += laps * time_between(curve, passage, half_v2_at_edges, start, end)
    return time
