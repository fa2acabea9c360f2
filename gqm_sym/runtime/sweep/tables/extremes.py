"""The smallest and largest speed or contact force on a tabulated curve: the best sample, refined on its panel."""

from math import asin, fabs, inf, pi, sqrt

from gqm_sym.runtime.arithmetic.elementary import sin
from gqm_sym.runtime.compiled.calls import call_potential_divdiff1
from gqm_sym.runtime.compiled.jit import Inlined, Inner
from gqm_sym.runtime.sweep.single.orbit_extremes import (
    FORCE,
    FORCE_SQUARED,
    STEP_RATIO,
    V2,
    fill_force,
    frame_buffer,
    line_buffer,
    point_buffer,
)
from gqm_sym.runtime.sweep.tables.layout import SAMPLES
from gqm_sym.runtime.sweep.tables.panel_forces import NEAR, prepare
from gqm_sym.runtime.sweep.tables.passage import BOTH, LOWER, UPPER
from gqm_sym.runtime.sweep.tables.samples import (
    best_sample,
    is_same_joint,
    level_on,
    limit_beside,
    load_on,
    loads_on,
    place_on,
    sample_panel,
)

# Half the widths of the first and of the last parabola on a panel of a tabulated curve, whose width is 2, and the
# largest number of parabolas. One whose vertex is far away is followed by one of the same width there.
FIRST_STEP, LAST_STEP, MAX_PARABOLAS = 0.25, 1e-3, 10

# The last step for the smallest square of a force. It may almost vanish, and then the force is not flat there.
LAST_STEP_OF_SQUARE = 1e-8

# The share of an extreme up to which others are equal.
EQUAL = 1e-15


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
    best, last = -inf, LAST_STEP_OF_SQUARE if sought[0] == FORCE_SQUARED and sign < 0.0 else LAST_STEP
    for i in range(MAX_PARABOLAS):
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
        if i > 0 and u == before_step and (u - low) * (u - high) == 0.0:
            return best, x  # also in a smaller part of the panel, the function rises towards its end
        if step <= last:
            break
        step = min(step, max(step / STEP_RATIO, fabs(u - before_step)))
    place = place_at(u, span, turns)
    value = sign * load_on(curve, k, level, sought, place)
    return (value, place) if value > best else (best, x)


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
    function, edges = sought[0], half_v2_at_edges
    if stretch.turns and function == V2 and sign < 0.0:
        return 0.0
    best, best_j, best_x, rival = best_sample(curve, stretch, passage, edges, sought, sign)
    # A sample of squares is computed once more, to the last digits.
    best, k, x = refined_beside(curve, passage, stretch, edges, sought, sign, (best_j, best_x))
    if function == V2 and (best_j, best_x) == stretch.begin and best <= sign * orbit.v2 + EQUAL * orbit.v2:
        # The extreme is at the launch, where V**2 is known.
        best, k = sign * orbit.v2, -1
    if rival > best + EQUAL * fabs(best):
        samples = line_buffer(), line_buffer()
        for j in range(stretch.low[0], stretch.high[0] + 1):
            sample_panel(curve, stretch, passage, edges, sought, j, samples)
            is_rooted = sought[1] != 0 and j in (stretch.low[0], stretch.high[0])
            for i in range(SAMPLES):
                at = j, samples[0][i]
                is_best = at == (best_j, best_x) or is_same_joint(at, (best_j, best_x))
                if not is_best and limit_beside(samples, sign, i, is_rooted) > best + EQUAL * fabs(best):
                    other, other_k, other_x = refined_beside(curve, passage, stretch, edges, sought, sign, at)
                    if other > best:
                        best, k, x = other, other_k, other_x
    value = sign * best
    if k >= 0 and (function == FORCE or (function == V2 and sign > 0.0)):
        value = by_formulas(curve, orbit, function, k, x)
    if function == V2:
        return sqrt(max(value, 0.0))
    return curve.mass * (value if function == FORCE else sqrt(max(value, 0.0)))
