"""The smallest and largest speed or contact force on a tabulated curve: the best sample, refined on its panel."""

from math import asin, fabs, inf, pi, sqrt
from typing import NamedTuple

from gqm_sym.runtime.arithmetic.elementary import sin
from gqm_sym.runtime.compiled.calls import call_path_in_space
from gqm_sym.runtime.compiled.jit import Inlined, Inner
from gqm_sym.runtime.sweep.single.orbit_extremes import (
    FORCE,
    FORCE_SQUARED,
    STEP_RATIO,
    V2,
    fill_force,
    fill_squares,
    frame_buffer,
    line_buffer,
    point_buffer,
    vector_buffer,
)
from gqm_sym.runtime.sweep.tables.layout import (
    HALF,
    KAPPA_SAMPLES,
    KAPPA_TERMS,
    LEFT_TERMS,
    LOAD_SAMPLES,
    LOAD_TERMS,
    POTENTIAL_SAMPLES,
    RIGHT_TERMS,
    SAMPLE_POINTS,
    SAMPLES,
)
from gqm_sym.runtime.sweep.tables.liftoff import launch_on
from gqm_sym.runtime.sweep.tables.panel_forces import AT_REST, FAR, LOAD, MOVING, NEAR, TURNING, VECTORS, prepare
from gqm_sym.runtime.sweep.tables.passage import BOTH, LOWER, UPPER
from gqm_sym.runtime.sweep.tables.potential import rise_on, value_on

# Half the widths of the first and of the last parabola on a panel of a tabulated curve, whose width is 2, and the
# largest number of parabolas. One whose vertex is far away is followed by one of the same width there.
FIRST_STEP, LAST_STEP, MAX_PARABOLAS = 0.25, 1e-3, 10

# The distance from the end of a panel at which formulas are evaluated, as a share of the places there.
CLEARANCE = 4e-16

# The last step for the smallest square of a force. It may almost vanish, and then the force is not flat there.
LAST_STEP_OF_SQUARE = 1e-8


class Stretch(NamedTuple):
    """The part of a passage along which a body moves.

    Attributes
    ----------
    low, high : (j, x)
        The panels of both ends, and the places on them.
    begin : (j, x)
        The end at which the body begins, with a speed that is known; j is -1 if it turns before it leaves the track, or
        if it stays on it.
    turns : bool
        Whether the body is at a turning point, at which its speed is 0.
    is_lap : bool
        Whether it is a whole lap, the ends of which are the same place.
    """

    low: tuple[int, float]
    high: tuple[int, float]
    begin: tuple[int, float]
    turns: bool
    is_lap: bool


@Inner
def end_of(stop, onwards, begin):  # type: ignore[no-untyped-def]
    """Return the panel of a `Stop` and the place there; the body stops before the load beyond a joint acts."""
    end = stop.panel, stop.x
    if stop.x == (-1.0 if onwards else 1.0) and begin != end:
        return (stop.panel - 1, 1.0) if onwards else (stop.panel + 1, -1.0)
    return end


@Inner
def stretch_of(curve, orbit, passage, stop):  # type: ignore[no-untyped-def]
    """Return the `Stretch` of a body up to a `Stop`."""
    low, high, begin, stops = (0, passage.low_x), (passage.panels - 1, passage.high_x), (-1, 0.0), stop.panel >= 0
    passes_once = orbit.circulates or orbit.leaves == orbit.direction
    passes_once = stop.turns == 0 if stops else passes_once
    upwards = orbit.direction > 0
    if passes_once and (stops or not orbit.circulates):
        begin = launch_on(curve, orbit, passage)
        low, high = (begin, high) if upwards else (low, begin)
    if stops and stop.turns < 2:
        onwards = upwards == (stop.turns == 0)
        end = end_of(stop, onwards, begin)
        if stop.turns == 1 and upwards == (stop.place > orbit.lam0):  # it has not come back to its launch
            end = launch_on(curve, orbit, passage)
        low, high = (low, end) if onwards else (end, high)
    return Stretch(low, high, begin, orbit.v2 == 0.0 or not passes_once, orbit.circulates and not stops)


@Inner
def stretch_before_turn(curve, orbit, passage):  # type: ignore[no-untyped-def]
    """Return the `Stretch` of a body from its launch to the turning point ahead of it."""
    launch = launch_on(curve, orbit, passage)
    low, high = (0, passage.low_x), (passage.panels - 1, passage.high_x)
    low, high = (launch, high) if orbit.direction > 0 else (low, launch)
    return Stretch(low, high, launch, True, False)


@Inner
def stretch_after_turn(orbit, passage, stop):  # type: ignore[no-untyped-def]
    """Return the `Stretch` of a body from its last turning point to a `Stop`, or to the end of its orbit."""
    low, high, none = (0, passage.low_x), (passage.panels - 1, passage.high_x), (-1, 0.0)
    if stop.panel >= 0:
        onwards = (orbit.direction > 0) == (stop.turns != 1)
        end = end_of(stop, onwards, none)
        low, high = (low, end) if onwards else (end, high)
    return Stretch(low, high, none, True, False)


@Inlined
def level_on(passage, half_v2_at_edges, j):  # type: ignore[no-untyped-def]
    """Return V**2/2 at an edge of panel j of a passage, the column of the powers about that edge, and the edge's place
    on the panel.

    It is the edge that is farther from a turning point, because the lowest place of a small swing is near it.
    """
    if j == 0 and passage.panels > 1:
        return half_v2_at_edges[1], RIGHT_TERMS, 1.0
    return half_v2_at_edges[j], LEFT_TERMS, -1.0


@Inlined
def place_on(curve, k, x):  # type: ignore[no-untyped-def]
    """Return the place in lam of x on panel k.

    The last place is a little before the next panel, because at a joint formulas are those of the piece that begins.
    """
    half, first, last = curve.table.paths[k, HALF], curve.table.edges[k], curve.table.edges[k + 1]
    place = first + half * (x + 1.0) if x <= 0.0 else last + half * (x - 1.0)
    return min(place, max(last - CLEARANCE * max(fabs(first), fabs(last)), first))


@Inner
def v2_or_force_on(curve, k, level, function, x):  # type: ignore[no-untyped-def]
    """Return V**2, or the contact force per unit mass, at a place of panel k; ``level`` is the result of `level_on`."""
    slack, at, edge = level
    v2 = 2.0 * (slack - rise_on(curve.rows, k, at, x - edge))
    if function == FORCE:
        return value_on(curve.table.paths, k, KAPPA_TERMS, x) * v2 + value_on(curve.rows, k, LOAD_TERMS, x)
    return v2


@Inner
def fill_squares_on(curve, k, level, direction, n, points, out):  # type: ignore[no-untyped-def]
    """Fill the square of the contact force per unit mass at n places of panel k, for a direction of motion or for
    both.
    """
    places, frame = point_buffer(), frame_buffer()
    for i in range(n):
        places[i], out[i] = place_on(curve, k, points[i]), max(v2_or_force_on(curve, k, level, V2, points[i]), 0.0)
    if direction != 0:
        fill_squares(curve, direction, n, places, out, out)
    else:
        fill_force(curve, FORCE_SQUARED, n, places, out, frame, out)
    for i in range(n):
        out[i] /= curve.mass**2


@Inner
def loads_on(curve, k, level, sought, x0, x1, x2):  # type: ignore[no-untyped-def]
    """Return V**2, the contact force per unit mass, or the square of its length, at three places of panel k.

    `orbit_extremes.is_loop` explains ``sought``.
    """
    if sought[0] != FORCE_SQUARED:
        return (
            v2_or_force_on(curve, k, level, sought[0], x0),
            v2_or_force_on(curve, k, level, sought[0], x1),
            v2_or_force_on(curve, k, level, sought[0], x2),
        )
    points, out = point_buffer(), point_buffer()
    points[0], points[1], points[2] = x0, x1, x2
    fill_squares_on(curve, k, level, sought[1], 3, points, out)
    return out[0], out[1], out[2]


@Inner
def load_on(curve, k, level, sought, x):  # type: ignore[no-untyped-def]
    """Return what `loads_on` returns, at one place."""
    if sought[0] != FORCE_SQUARED:
        return v2_or_force_on(curve, k, level, sought[0], x)
    points, out = point_buffer(), point_buffer()
    points[0] = x
    fill_squares_on(curve, k, level, sought[1], 1, points, out)
    return out[0]


@Inner
def prepare_vectors(curve, k):  # type: ignore[no-untyped-def]
    """Fill the vectors at the samples of panel k that the contact force per unit mass is made of, if still missing."""
    if curve.levels[k] & VECTORS:
        return
    curve.levels[k] |= VECTORS
    places, v2, ahead, back, row = line_buffer(), line_buffer(), vector_buffer(), vector_buffer(), curve.rows[k]
    for i in range(SAMPLES):
        places[i], v2[i] = place_on(curve, k, SAMPLE_POINTS[i]), 0.0
    call_path_in_space(curve.path_in_space, SAMPLES, places, v2, 1.0, curve.p, ahead)
    for j in range(3 * SAMPLES):
        row[AT_REST + j] = ahead[SAMPLES + j] / curve.mass
    for i in range(SAMPLES):
        v2[i] = 1.0
    call_path_in_space(curve.path_in_space, SAMPLES, places, v2, 1.0, curve.p, ahead)
    call_path_in_space(curve.path_in_space, SAMPLES, places, v2, -1.0, curve.p, back)
    for j in range(3 * SAMPLES):
        one, other = ahead[SAMPLES + j] / curve.mass, back[SAMPLES + j] / curve.mass
        row[TURNING + j], row[MOVING + j] = 0.5 * (one + other) - row[AT_REST + j], 0.5 * (one - other)


@Inner
def fill_samples(curve, k, slack, sought, out):  # type: ignore[no-untyped-def]
    """Fill the same as `loads_on` at the samples of panel k, for V**2/2 at its left edge; squares of lengths lose
    digits.
    """
    row, direction = curve.rows[k], float(sought[1])
    for i in range(SAMPLES):
        out[i] = 2.0 * (slack - row[POTENTIAL_SAMPLES + i])
        if sought[0] == FORCE:
            out[i] = curve.table.paths[k, KAPPA_SAMPLES + i] * out[i] + row[LOAD_SAMPLES + i]
    if sought[0] == FORCE_SQUARED:
        prepare_vectors(curve, k)
        for i in range(SAMPLES):
            v2, square = max(out[i], 0.0), 0.0
            v = direction * sqrt(v2)
            for j in range(i, 3 * SAMPLES, SAMPLES):
                part = row[AT_REST + j] + v2 * row[TURNING + j] + v * row[MOVING + j]
                square += part * part
            out[i] = square


@Inlined
def place_at(u, ends, turns):  # type: ignore[no-untyped-def]
    """Return the place on a panel for the variable of `refined`."""
    (low, high), (at_low, at_high) = ends, turns
    if not (at_low or at_high):
        return u
    share = sin(0.5 * pi * u) ** 2 if at_low and at_high else u * u
    return low + (high - low) * share if at_low else high - (high - low) * share


@Inner
def refined(curve, k, level, sought, sign, x, ends, turns):  # type: ignore[no-untyped-def]
    """Return the largest (``sign`` 1) or smallest (-1) value near a place between two ends on panel k, by parabolas.

    If one of the ends is a turning point next to which the force changes with V, which ``turns`` tells of both, the
    variable is one in which V is smooth: the root of the distance from it, or the phase angle between two turning
    points, as shares.
    """
    prepare(curve, k, NEAR)
    low, high = ends
    u, step = x, FIRST_STEP
    if turns[0] or turns[1]:
        share = min(max((x - low) / (high - low), 0.0), 1.0) if high > low else 0.0
        root = sqrt(share if turns[0] else 1.0 - share)
        u, low, high, step = 2.0 / pi * asin(root) if turns[0] and turns[1] else root, 0.0, 1.0, 0.5 * FIRST_STEP
    best = load_on(curve, k, level, sought, x)
    last = LAST_STEP_OF_SQUARE if sought[0] == FORCE_SQUARED and sign < 0.0 else LAST_STEP
    for _ in range(MAX_PARABOLAS):
        before_step = u
        left, right = max(u - step, low), min(u + step, high)
        if not left < u < right:
            u = 0.5 * (left + right)
        x0, x1, x2 = place_at(left, ends, turns), place_at(u, ends, turns), place_at(right, ends, turns)
        f0, f1, f2 = loads_on(curve, k, level, sought, x0, x1, x2)
        best = sign * max(sign * best, sign * f0, sign * f1, sign * f2)
        before, after = (u - left) * (f1 - f2), (u - right) * (f1 - f0)
        if before != after:
            vertex = u - 0.5 * ((u - left) * before - (u - right) * after) / (before - after)
            u = min(max(vertex, left), right)
        if step <= last:
            break
        step = min(step, max(step / STEP_RATIO, fabs(u - before_step)))
    return sign * max(sign * best, sign * load_on(curve, k, level, sought, place_at(u, ends, turns)))


@Inner
def best_sample(curve, stretch, passage, half_v2_at_edges, sought, sign):  # type: ignore[no-untyped-def]
    """Return the largest value of ``sign`` times what `load_on` returns at the samples, its panel, and its place
    there.
    """
    samples, count, squared = line_buffer(), curve.levels.size, sought[0] == FORCE_SQUARED
    best, best_j, best_x = -inf, 0, 0.0
    (first, low_x), (last, high_x) = stretch.low, stretch.high
    for j in range(first, last + 1):
        k, slack, inside = (passage.first + j) % count, half_v2_at_edges[j], first < j < last
        low, high = low_x if j == first else -1.0, high_x if j == last else 1.0
        prepare(curve, k, (FAR | LOAD if sought[0] == FORCE else FAR) | (0 if inside else NEAR))
        if inside or squared:
            fill_samples(curve, k, slack, sought, samples)
        for i in range(SAMPLES):
            x, value = SAMPLE_POINTS[i], samples[i]
            is_end = i == SAMPLES - 1 or (squared and i == 0)
            if not inside and (is_end or not squared):
                # The end itself is sampled, because the next panel shares it.
                x = low + (high - low) * i / (SAMPLES - 1) if i < SAMPLES - 1 else high
                value = load_on(curve, k, level_on(passage, half_v2_at_edges, j), sought, x)
            if sign * value > best and low <= x <= high:
                best, best_j, best_x = sign * value, j, x
    return best, best_j, best_x


@Inner
def passage_extreme(curve, orbit, passage, stretch, half_v2_at_edges, sought, sign):  # type: ignore[no-untyped-def]
    """Return the result of `orbit_extremes.extreme` on a stretch of a tabulated curve: the best of all samples, refined
    on the panels to which it belongs.

    At a joint the values on both sides are compared.
    """
    count, last, force = curve.levels.size, passage.panels - 1, sought[0] != V2
    is_directed, low, high = sought[1] != 0, stretch.low, stretch.high
    if stretch.turns and not (force or sign > 0.0):
        return 0.0
    best, best_j, best_x = best_sample(curve, stretch, passage, half_v2_at_edges, sought, sign)
    if sought[0] == FORCE_SQUARED:
        best = -inf  # the sample is computed once more, to the last digits
    if not force and (best_j, best_x) == stretch.begin:
        return sqrt(orbit.v2)
    for step in range(-1, 2):
        # The extreme is refined on the panel itself, and on the panel with which it shares the place.
        j, x, shared = best_j + step, best_x, step == 0
        if step != 0 and best_x == float(step):
            x, shared = -best_x, low[0] <= j <= high[0]
        if stretch.is_lap and step != 0 and not 0 <= j <= last:
            j, shared = last - best_j, best_x in (passage.low_x, passage.high_x)
        if shared:
            ends = low[1] if j == low[0] else -1.0, high[1] if j == high[0] else 1.0
            k = (passage.first + j) % count
            level, turns = level_on(passage, half_v2_at_edges, j), passage.turns
            at_low = is_directed and turns in (BOTH, LOWER) and (j, ends[0]) == (0, passage.low_x)
            at_high = is_directed and turns in (BOTH, UPPER) and (j, ends[1]) == (last, passage.high_x)
            best = max(best, sign * refined(curve, k, level, sought, sign, x, ends, (at_low, at_high)))
    value = sign * best
    if sought[0] == V2:
        return sqrt(max(value, 0.0))
    return curve.mass * (value if sought[0] == FORCE else sqrt(max(value, 0.0)))
