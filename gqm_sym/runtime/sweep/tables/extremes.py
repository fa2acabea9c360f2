"""The smallest and largest speed or contact force on a tabulated curve: the best sample, refined on its panel."""

from math import asin, fabs, inf, nan, pi, sqrt

from gqm_sym.runtime.arithmetic.elementary import sin
from gqm_sym.runtime.compiled.calls import call_path_in_space, call_potential_divdiff1
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
def place_at(u, span, turns):  # type: ignore[no-untyped-def]
    """Return the place on a panel for the variable of `refined`."""
    (low, high), (at_low, at_high) = span, turns
    if not (at_low or at_high):
        return u
    share = sin(0.5 * pi * u) ** 2 if at_low and at_high else u * u
    return low + (high - low) * share if at_low else high - (high - low) * share


@Inlined
def variable_at(x, span, turns):  # type: ignore[no-untyped-def]
    """Return the variable of `refined` for a place on a panel."""
    (low, high), (at_low, at_high) = span, turns
    if not (at_low or at_high):
        return x
    root = sqrt(min(max((x - low if at_low else high - x) / (high - low), 0.0), 1.0)) if high > low else 0.0
    return 2.0 / pi * asin(root) if at_low and at_high else root


@Inner
def refined(curve, k, level, sought, sign, x, ends, variable):  # type: ignore[no-untyped-def]
    """Return the largest (``sign`` 1) or smallest (-1) value near a place between two ends on panel k, by
    parabolas, times ``sign``; and where it is.

    The variable is the place, unless the force changes with V and the panel has a turning point. Then it is one in
    which V is smooth: the root of the distance from it, or the phase angle between two turning points, as shares of a
    span. ``variable`` has the span, and whether its lower and its upper end are turning points.
    """
    prepare(curve, k, NEAR)
    span, turns = variable
    u, low, high = variable_at(x, span, turns), variable_at(ends[0], span, turns), variable_at(ends[1], span, turns)
    low, high, step = min(low, high), max(low, high), 0.5 * FIRST_STEP if turns[0] or turns[1] else FIRST_STEP
    best = sign * load_on(curve, k, level, sought, x)
    last = LAST_STEP_OF_SQUARE if sought[0] == FORCE_SQUARED and sign < 0.0 else LAST_STEP
    for _ in range(MAX_PARABOLAS):
        before_step = u
        left, right = max(u - step, low), min(u + step, high)
        if not left < u < right:
            u = 0.5 * (left + right)
        x0, x1, x2 = place_at(left, span, turns), place_at(u, span, turns), place_at(right, span, turns)
        f0, f1, f2 = loads_on(curve, k, level, sought, x0, x1, x2)
        for place, value in ((x0, sign * f0), (x1, sign * f1), (x2, sign * f2)):
            if value > best:
                best, x = value, place
        before, after = (u - left) * (f1 - f2), (u - right) * (f1 - f0)
        if before != after:
            vertex = u - 0.5 * ((u - left) * before - (u - right) * after) / (before - after)
            u = min(max(vertex, left), right)
        if step <= last:
            break
        step = min(step, max(step / STEP_RATIO, fabs(u - before_step)))
    place = place_at(u, span, turns)
    value = sign * load_on(curve, k, level, sought, place)
    return (value, place) if value > best else (best, x)


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
    for i in range(SAMPLES):
        places[i] = SAMPLE_POINTS[i]
        if not inside and (i == SAMPLES - 1 or not squared or i == 0):
            # The end itself is sampled, because the next panel shares it.
            places[i] = low + (high - low) * i / (SAMPLES - 1) if i < SAMPLES - 1 else high
            values[i] = load_on(curve, k, level_on(passage, half_v2_at_edges, j), sought, places[i])
        if not low <= places[i] <= high:
            values[i] = nan


@Inner
def limit_beside(values, sign, i, is_end):  # type: ignore[no-untyped-def]
    """Return a number that ``sign`` times a function does not exceed next to sample i of a panel; minus infinity if one
    of its neighbours is larger, beside which it is looked for then.

    Between samples the function exceeds them by less than they differ from those around; at an end of the stretch,
    beside which it may change with the root of the distance, from the next two.
    """
    here, before, after = sign * values[i], sign * values[max(i - 1, 0)], sign * values[min(i + 1, SAMPLES - 1)]
    if before > here or after > here:
        return -inf
    if is_end:  # samples beyond it are NaN
        before, after = min(sign * values[max(i - 2, 0)], before), min(sign * values[min(i + 2, SAMPLES - 1)], after)
    drop = here - before if before == before else 0.0
    return here + max(drop, here - after if after == after else 0.0)


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
        for i in range(SAMPLES):
            value = sign * samples[1][i]
            if value > best:
                rival = max(rival, limit)
                best, best_j, best_x = value, j, samples[0][i]
                limit = limit_beside(samples[1], sign, i, j in (first, last))
            elif value == value:
                rival = max(rival, limit_beside(samples[1], sign, i, j in (first, last)))
    return best, best_j, best_x, rival


@Inner
def refined_beside(curve, passage, stretch, half_v2_at_edges, sought, sign, sample):  # type: ignore[no-untyped-def]
    """Return ``sign`` times the extreme next to a sample, which is a panel and a place there; and where it is.

    It is refined on the panel itself, and on the panel with which it shares the place: at a joint the values on both
    sides are compared.
    """
    (sample_j, sample_x), low, high, last = sample, stretch.low, stretch.high, passage.panels - 1
    best, best_k, best_x = -inf, 0, 0.0
    for step in range(-1, 2):
        j, x, shared = sample_j + step, sample_x, step == 0
        if step != 0 and sample_x == float(step):
            x, shared = -sample_x, low[0] <= j <= high[0]
        if stretch.is_lap and step != 0 and not 0 <= j <= last:
            j, shared = last - sample_j, sample_x in (passage.low_x, passage.high_x)
        if shared:
            ends = low[1] if j == low[0] else -1.0, high[1] if j == high[0] else 1.0
            k = (passage.first + j) % curve.levels.size
            level, turns, is_directed = level_on(passage, half_v2_at_edges, j), passage.turns, sought[1] != 0
            at_low = is_directed and turns in (BOTH, LOWER) and j == 0
            at_high = is_directed and turns in (BOTH, UPPER) and j == last
            span = passage.low_x if at_low else ends[0], passage.high_x if at_high else ends[1]
            value, x = refined(curve, k, level, sought, sign, x, ends, (span, (at_low, at_high)))
            if value > best:
                best, best_k, best_x = value, k, x
    return best, best_k, best_x


@Inner
def by_formulas(curve, orbit, function, k, x):  # type: ignore[no-untyped-def]
    """Return V**2, or the contact force per unit mass, at a place of panel k, to the last digits of the largest V**2.

    The curvature of a panel has fewer.
    """
    places, offsets, rows, v2, frame = point_buffer(), point_buffer(), line_buffer(), point_buffer(), frame_buffer()
    places[0] = place_on(curve, k, x)
    offsets[0] = places[0] - orbit.lam0
    call_potential_divdiff1(curve.fns.potential_divdiff1, 1, orbit.lam0, places, offsets, curve.p, rows)
    v2[0] = max(orbit.v2 - 2.0 * offsets[0] * rows[0], 0.0)
    if function == V2:
        return v2[0]
    fill_force(curve, FORCE, 1, places, v2, frame, rows)
    return rows[0] / curve.mass


@Inner
def passage_extreme(curve, orbit, passage, stretch, half_v2_at_edges, sought, sign):  # type: ignore[no-untyped-def]
    """Return the result of `orbit_extremes.extreme` on a stretch of a tabulated curve: the best of all samples,
    refined, and others beside which the function may be larger than that.
    """
    function, edges, k, x = sought[0], half_v2_at_edges, -1, 0.0
    if stretch.turns and function == V2 and sign < 0.0:
        return 0.0
    best, best_j, best_x, rival = best_sample(curve, stretch, passage, edges, sought, sign)
    if function == V2 and (best_j, best_x) == stretch.begin:
        best = sign * orbit.v2
    else:
        # A sample of squares is computed once more, to the last digits.
        best, k, x = refined_beside(curve, passage, stretch, edges, sought, sign, (best_j, best_x))
    if rival > best:
        samples = line_buffer(), line_buffer()
        for j in range(stretch.low[0], stretch.high[0] + 1):
            sample_panel(curve, stretch, passage, edges, sought, j, samples)
            for i in range(SAMPLES):
                at = j, samples[0][i]
                if limit_beside(samples[1], sign, i, j in (stretch.low[0], stretch.high[0])) > best and at != (
                    best_j,
                    best_x,
                ):
                    other, other_k, other_x = refined_beside(curve, passage, stretch, edges, sought, sign, at)
                    if other > best:
                        best, k, x = other, other_k, other_x
    value = sign * best
    if k >= 0 and (function == FORCE or (function == V2 and sign > 0.0)):
        value = by_formulas(curve, orbit, function, k, x)
    if function == V2:
        return sqrt(max(value, 0.0))
    return curve.mass * (value if function == FORCE else sqrt(max(value, 0.0)))
