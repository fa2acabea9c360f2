"""Samples of the speed or the contact force on the panels of a tabulated curve, and how much larger the function may be
beside them.
"""

from math import fabs, inf, nan, sqrt

from gqm_sym.runtime.compiled.calls import call_path_in_space
from gqm_sym.runtime.compiled.jit import Inlined, Inner
from gqm_sym.runtime.sweep.single.orbit_extremes import (
    FORCE,
    FORCE_SQUARED,
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
from gqm_sym.runtime.sweep.tables.panel_forces import AT_REST, FAR, LOAD, MOVING, NEAR, TURNING, VECTORS, prepare
from gqm_sym.runtime.sweep.tables.potential import rise_on, value_on

# The distance from the end of a panel at which formulas are evaluated, as a share of the places there.
CLEARANCE = 4e-16

# The share of the slope at the end of a panel by which the parabola through three samples may be wrong.
SLOPE_MARGIN = 0.5


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


@Inner
def sample_panel(curve, stretch, passage, half_v2_at_edges, sought, j, samples):  # type: ignore[no-untyped-def]
    """Fill places on panel j of a passage, and what `load_on` returns there; outside of the stretch it is NaN.

    ``samples`` contains both rows.
    """
    k, slack, squared = (passage.first + j) % curve.levels.size, half_v2_at_edges[j], sought[0] == FORCE_SQUARED
    (places, values), (first, low_x), (last, high_x) = samples, stretch.low, stretch.high
    low, high, inside = low_x if j == first else -1.0, high_x if j == last else 1.0, first < j < last
    prepare(curve, k, (FAR | LOAD if sought[0] == FORCE else FAR) | (0 if inside else NEAR))
    if inside or squared:
        fill_samples(curve, k, slack, sought, values)
    begin, end = 0, SAMPLES - 1
    while squared and begin < end and SAMPLE_POINTS[begin + 1] <= low:
        begin += 1
    while squared and end > begin and SAMPLE_POINTS[end - 1] >= high:
        end -= 1
    for i in range(SAMPLES):
        places[i] = SAMPLE_POINTS[i]
        if not inside and (i in (begin, end) or not squared):
            # The end itself is sampled, because the next panel shares it.
            places[i] = low + (high - low) * i / (SAMPLES - 1) if begin < i < end else low if i == begin else high
            values[i] = load_on(curve, k, level_on(passage, half_v2_at_edges, j), sought, places[i])
        if not begin <= i <= end:
            values[i] = nan


@Inner
def rises_to(samples, sign, i, onwards):  # type: ignore[no-untyped-def]
    """Return whether ``sign`` times a function rises towards sample i at the end of a panel, from samples ``onwards``
    (1 or -1), beside which it is not larger.

    The slope of the parabola through the last three samples has the same sign there, by a margin for the error of it.
    """
    (places, values), j, k = samples, i + onwards, i + 2 * onwards
    if not 0 <= k < SAMPLES:
        return False
    near, width = onwards * (places[j] - places[i]), onwards * (places[k] - places[i])
    last, before = sign * (values[i] - values[j]) * (width - near), sign * (values[j] - values[k]) * near
    return last > 0.0 and before >= 0.0 and (before - last) * near <= SLOPE_MARGIN * last * width


@Inner
def limit_beside(samples, sign, i, is_rooted):  # type: ignore[no-untyped-def]
    """Return a number that ``sign`` times a function does not exceed next to sample i of a panel; minus infinity if one
    of its neighbours is larger, beside which it is looked for then.

    Between samples the function exceeds them by less than they differ from those around; at an end, and where
    it may change with the root of the distance from an end of the stretch (``is_rooted``), from the next two.
    """
    values, last = samples[1], SAMPLES - 1
    here, drop = sign * values[i], 0.0
    begins, ends = i == 0 or values[i - 1] != values[i - 1], i == last or values[i + 1] != values[i + 1]
    if (not begins and sign * values[i - 1] > here) or (not ends and sign * values[i + 1] > here):
        return -inf
    if begins != ends and not is_rooted and rises_to(samples, sign, i, 1 if begins else -1):
        return here
    reach = 2 if is_rooted or begins or ends else 1
    for j in range(max(i - reach, 0), min(i + reach, last) + 1):
        if here - sign * values[j] > drop:  # not NaN
            drop = here - sign * values[j]
    return here + drop


@Inlined
def is_same_joint(one, other):  # type: ignore[no-untyped-def]
    """Return whether two places, each a panel and a place there, are the two sides of the same joint."""
    return fabs(one[1]) == 1.0 and one[1] == -other[1] and one[0] + one[1] == other[0]


@Inner
def best_sample(curve, stretch, passage, half_v2_at_edges, sought, sign):  # type: ignore[no-untyped-def]
    """Return the largest value of ``sign`` times what `load_on` returns at the samples, its panel, and its place there;
    and the largest `limit_beside` the other samples.
    """
    samples = line_buffer(), line_buffer()
    best, best_j, best_x, limit, rival = -inf, 0, 0.0, -inf, -inf
    (first, _), (last, _) = stretch.low, stretch.high
    for j in range(first, last + 1):
        sample_panel(curve, stretch, passage, half_v2_at_edges, sought, j, samples)
        top, bottom = -inf, inf
        for i in range(SAMPLES):
            value = sign * samples[1][i]
            if value > top:
                top = value
            if value < bottom:
                bottom = value
        if not top + (top - bottom) > best:
            continue
        is_rooted = sought[1] != 0 and j in (first, last)
        for i in range(SAMPLES):
            value = sign * samples[1][i]
            is_shared = i == 0 and j == best_j + 1 and best_x == 1.0  # the best one, on the next panel
            if value > best:
                rival = max(rival, limit) if not is_shared else rival
                best, best_j, best_x = value, j, samples[0][i]
                limit = limit_beside(samples, sign, i, is_rooted)
            elif value == value and not is_shared:
                rival = max(rival, limit_beside(samples, sign, i, is_rooted))
    return best, best_j, best_x, rival
