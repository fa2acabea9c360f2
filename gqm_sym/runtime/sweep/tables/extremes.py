"""The smallest and largest speed or contact force on a tabulated curve: the best sample, refined on its panel."""

from math import fabs, inf, sqrt

from gqm_sym.runtime.compiled.jit import Inlined, Inner
from gqm_sym.runtime.sweep.orbit_extremes import (
    FORCE,
    FORCE_SQUARED,
    STEP_RATIO,
    V2,
    fill_force,
    frame_buffer,
    line_buffer,
    point_buffer,
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
from gqm_sym.runtime.sweep.tables.panel_forces import FAR, LOAD, NEAR, prepare
from gqm_sym.runtime.sweep.tables.places import locate
from gqm_sym.runtime.sweep.tables.potential import rise_on, value_on

# Half the widths of the first and of the last parabola on a panel of a tabulated curve, whose width is 2, and the
# largest number of parabolas. One whose vertex is far away is followed by one of the same width there.
FIRST_STEP, LAST_STEP, MAX_PARABOLAS = 0.25, 1e-3, 10

# The last step for the square of a force. The square may almost vanish, and then the force is not flat at its extreme.
LAST_STEP_OF_SQUARE = 1e-8


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
    """Return the place in lam of x on panel k."""
    half = curve.table.paths[k, HALF]
    return curve.table.edges[k] + half * (x + 1.0) if x <= 0.0 else curve.table.edges[k + 1] + half * (x - 1.0)


@Inner
def load_on(curve, k, level, sought, x):  # type: ignore[no-untyped-def]
    """Return V**2, the contact force per unit mass, or the square of its length, at a place of panel k.

    ``level`` is the result of `level_on`, and ``sought`` is explained in `orbit_extremes.fill_force`.
    """
    slack, at, edge = level
    v2 = 2.0 * (slack - rise_on(curve.rows, k, at, x - edge))
    if sought[0] == FORCE:
        return value_on(curve.table.paths, k, KAPPA_TERMS, x) * v2 + value_on(curve.rows, k, LOAD_TERMS, x)
    if sought[0] == FORCE_SQUARED:
        places, values, frame = point_buffer(), point_buffer(), frame_buffer()
        places[0], values[0] = place_on(curve, k, x), max(v2, 0.0)
        fill_force(curve, sought, 1, places, values, frame, values)
        return values[0] / curve.mass**2
    return v2


@Inner
def fill_samples(curve, k, slack, sought, out):  # type: ignore[no-untyped-def]
    """Fill the same as `load_on` at the samples of panel k, for V**2/2 at its left edge."""
    places, frame = line_buffer(), frame_buffer()
    for i in range(SAMPLES):
        out[i] = 2.0 * (slack - curve.rows[k, POTENTIAL_SAMPLES + i])
        if sought[0] == FORCE:
            out[i] = curve.table.paths[k, KAPPA_SAMPLES + i] * out[i] + curve.rows[k, LOAD_SAMPLES + i]
    if sought[0] == FORCE_SQUARED:
        for i in range(SAMPLES):
            places[i], out[i] = place_on(curve, k, SAMPLE_POINTS[i]), max(out[i], 0.0)
        fill_force(curve, sought, SAMPLES, places, out, frame, out)
        for i in range(SAMPLES):
            out[i] /= curve.mass**2


@Inner
def refined(curve, k, level, sought, sign, x, ends):  # type: ignore[no-untyped-def]
    """Return the largest (``sign`` 1) or smallest (-1) value near a place between two ends on panel k, by parabolas."""
    prepare(curve, k, NEAR)
    low, high = ends
    best, step = load_on(curve, k, level, sought, x), FIRST_STEP
    last = LAST_STEP_OF_SQUARE if sought[0] == FORCE_SQUARED else LAST_STEP
    for _ in range(MAX_PARABOLAS):
        x_before = x
        left, right = max(x - step, low), min(x + step, high)
        if not left < x < right:
            x = 0.5 * (left + right)
        f0 = load_on(curve, k, level, sought, left)
        f1 = load_on(curve, k, level, sought, x)
        f2 = load_on(curve, k, level, sought, right)
        before, after = (x - left) * (f1 - f2), (x - right) * (f1 - f0)
        if before != after:
            vertex = x - 0.5 * ((x - left) * before - (x - right) * after) / (before - after)
            x = min(max(vertex, left), right)
        found = load_on(curve, k, level, sought, x)
        best = sign * max(sign * best, sign * f0, sign * f1, sign * f2, sign * found)
        if step <= last:
            break
        step = min(step, max(step / STEP_RATIO, fabs(x - x_before)))
    return best


@Inner
def best_sample(curve, path, passage, half_v2_at_edges, sought, sign):  # type: ignore[no-untyped-def]
    """Return the largest value of ``sign`` times what `load_on` returns at the samples, its panel, and its place
    there.
    """
    samples, count = line_buffer(), curve.levels.size
    best, best_j, best_x = -inf, 0, 0.0
    (first, low_x), (last, high_x) = path
    for j in range(first, last + 1):
        k, slack = (passage.first + j) % count, half_v2_at_edges[j]
        low, high = low_x if j == first else -1.0, high_x if j == last else 1.0
        prepare(curve, k, (FAR | LOAD if sought[0] == FORCE else FAR) | (0 if first < j < last else NEAR))
        if first < j < last:
            fill_samples(curve, k, slack, sought, samples)
        for i in range(SAMPLES):
            x, value = SAMPLE_POINTS[i], samples[i]
            if not first < j < last:
                # The end itself is sampled, because the next panel shares it.
                x = low + (high - low) * i / (SAMPLES - 1) if i < SAMPLES - 1 else high
                value = load_on(curve, k, level_on(passage, half_v2_at_edges, j), sought, x)
            if sign * value > best:
                best, best_j, best_x = sign * value, j, x
    return best, best_j, best_x


@Inner
def passage_extreme(curve, orbit, passage, half_v2_at_edges, sought, sign):  # type: ignore[no-untyped-def]
    """Return the result of `orbit_extremes.extreme` on a tabulated curve: the best of all samples, refined on the
    panels to which it belongs.

    At a joint the values on both sides are compared.
    """
    count, last, force = curve.levels.size, passage.panels - 1, sought[0] != V2
    path, begin = ((0, passage.low_x), (last, passage.high_x)), (-1, 0.0)
    if orbit.leaves == orbit.direction:  # a body whose turning point is not ahead does not reach it
        index, x, _ = locate(curve.table, curve.period, orbit.lam0)
        begin = index - passage.first, x
        path = (begin, path[1]) if orbit.leaves > 0 else (path[0], begin)
    meets_turn = orbit.v2 == 0.0 or not (orbit.circulates or orbit.leaves == orbit.direction)
    if meets_turn and not (force or sign > 0.0):
        return 0.0
    best, best_j, best_x = best_sample(curve, path, passage, half_v2_at_edges, sought, sign)
    if orbit.leaves == orbit.direction and not force and (best_j, best_x) == begin:
        return sqrt(orbit.v2)
    for step in range(-1, 2):
        # The extreme is refined on the panel itself, and on the panel with which it shares the place.
        j, x, shared = best_j + step, best_x, step == 0
        if step != 0 and best_x == float(step):
            x, shared = -best_x, path[0][0] <= j <= path[1][0]
        if orbit.circulates and step != 0 and not 0 <= j <= last:
            j, shared = last - best_j, best_x in (passage.low_x, passage.high_x)
        if shared:
            ends = path[0][1] if j == path[0][0] else -1.0, path[1][1] if j == path[1][0] else 1.0
            k = (passage.first + j) % count
            best = max(best, sign * refined(curve, k, level_on(passage, half_v2_at_edges, j), sought, sign, x, ends))
    value = sign * best
    if sought[0] == V2:
        return sqrt(max(value, 0.0))
    return curve.mass * (value if sought[0] == FORCE else sqrt(max(value, 0.0)))
