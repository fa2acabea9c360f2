"""The turning points of orbits in wells about axes of symmetry, without a search.

There is a closed form (`derivation.wells.symmetric_orbits`), which is proved symbolically, or the body is released at
rest and turns at its mirror image.
"""

from math import fabs, nan

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.compiled.calls import call_potential_divdiff1_batch, call_turning_point_batch
from gqm_sym.runtime.compiled.intrinsics import choose, floor_of, fma
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.sweep.batch.rows import (
    AXIS_DISTANCE,
    AXIS_OFFSET,
    FOUND,
    HALF_REST,
    HALF_WIDTH,
    LAUNCH_PLACE,
    LAUNCH_V2,
    NOWHERE,
    SEARCH_DIRECTION,
    SEEKING,
    STATE,
    V2_REST,
    ZERO,
    ZERO_BEHIND,
    contains,
)
from gqm_sym.runtime.sweep.batch.wells import find_proved, is_clear_of_axes

# The turning point is given by the square of a sine, which is 1 at a potential maximum. Within NEAR_MAXIMUM of 1 the
# closed form is not used.
NEAR_MAXIMUM = 1e-9


@Inner
def fill_axis_offsets(n, rows, domain, monotone, with_rests):  # type: ignore[no-untyped-def]
    """Fill the offsets of launches from the axis of symmetry in their own period, and ``with_rests`` also what rounding
    took from those of bodies at rest.

    In other periods than that of the known axis they are NaN unless V**2 is ``monotone`` between axes. There, what
    rounding takes from the place may be many roundings of the offset. ``domain`` has the rows DOMAIN_LOW to
    AXIS_STEP_LOW of `strided`.
    """
    start, offsets, rests = rows[LAUNCH_PLACE, :n], rows[AXIS_OFFSET, :n], rows[HALF_REST, :n]
    places, places_low, steps, steps_low = domain[3, :n], domain[4, :n], domain[5, :n], domain[6, :n]
    w0, any_other = rows[LAUNCH_V2, :n], with_rests
    for j in range(n):
        offsets[j] = (start[j] - places[j]) - places_low[j]
        any_other |= (steps[j] > 0.0) & (fabs(offsets[j]) > steps[j])
    if any_other:
        for j in range(n):
            distance, rounding = two_sum(start[j], -places[j])
            distance, lost = two_sum(distance, -places_low[j])
            period = 2.0 * steps[j]
            periods = choose(period > 0.0, floor_of(distance / period + 0.5), 0.0)
            lacking = (rounding + lost) - periods * (2.0 * steps_low[j])
            offset, rest = two_sum(fma(-periods, period, distance), lacking)
            offsets[j] = choose(monotone | (periods == 0.0), offset, nan)
            known = (w0[j] == 0.0) & (offset == offsets[j])  # otherwise there is no axis in this period
            rests[j] = choose(known, choose(offset < 0.0, -rest, rest), 0.0)


@Inner
def by_closed_form(fns, n, rows, p, domain, work):  # type: ignore[no-untyped-def]
    """Set both zeros, and the direction of bodies at rest, from the closed form of the width of the orbit in its well.

    If that form does not apply, ZERO_BEHIND is NaN. The state is NOWHERE for bodies that pass the maximum next to the
    well, and SEEKING for all others. Each root of a thrown body is improved by a step of Newton's method, because its
    roundings are those of the whole energy, and V**2 at launch may be much less.
    """
    start, w0, direction, state, roundings = (
        rows[LAUNCH_PLACE, :n],
        rows[LAUNCH_V2, :n],
        rows[SEARCH_DIRECTION, :n],
        rows[STATE, :n],
        rows[V2_REST, :n],
    )
    ahead, behind, axis = rows[ZERO, :n], rows[ZERO_BEHIND, :n], rows[AXIS_DISTANCE, :n]
    places, steps, offsets = domain[3, :n], domain[5, :n], rows[AXIS_OFFSET, :n]
    out, halves, thrown = work[:3].reshape(-1)[: 3 * n].reshape(3, n), work[3, :n], work[5, :n]
    rests = rows[HALF_REST, :n]
    call_turning_point_batch(fns.turning_point, n, offsets, w0, p, out)
    for j in range(n):
        at_rest = w0[j] == 0.0
        halves[j] = choose(at_rest, fabs(offsets[j]), out[0, j])
        ahead[j] = choose(at_rest, choose(offsets[j] < 0.0, 1.0, -1.0), direction[j])
        thrown[j] = choose((offsets[j] == offsets[j]) & (w0[j] > 0.0), 1.0, 0.0)
    if contains(thrown, 1.0):
        ends, away = work[7, :n], work[8, :n]
        slopes = work[9:12].reshape(-1)[: 3 * n].reshape(3, n)
        for j in range(n):
            away[j] = ahead[j] * halves[j] - offsets[j]
            ends[j] = start[j] + away[j]
        call_potential_divdiff1_batch(fns.potential_divdiff1, n, start, ends, away, p, slopes)
        for j in range(n):
            left = fma(-2.0 * away[j], slopes[0, j], w0[j]) + roundings[j]
            missed = choose(thrown[j] == 1.0, ahead[j] * (left / (2.0 * slopes[2, j])), 0.0)
            halves[j], rounding = two_sum(halves[j], missed)
            rests[j] = choose(thrown[j] == 1.0, rounding, rests[j])
    widths = rows[HALF_WIDTH, :n]
    for j in range(n):
        offset, half, sense, step, at_rest = offsets[j], halves[j], ahead[j], steps[j], w0[j] == 0.0
        size, alone = fabs(offset), step == 0.0
        well = (out[1, j] > 0.0) & (alone | (size < step))
        clear = is_clear_of_axes(size, start[j], places[j], step)
        inside = choose(size > half, half, size)  # many periods away the offset has the larger rounding error
        ascent = choose(sense * offset < 0.0, -inside, inside)
        known_well = well & ((at_rest & clear) | ((w0[j] > 0.0) & (out[2, j] < 1.0 - NEAR_MAXIMUM)))
        ahead[j], behind[j] = choose(known_well, half - ascent, 0.0), choose(known_well, half + ascent, nan)
        widths[j], rests[j] = choose(known_well, half, nan), choose(known_well | at_rest, rests[j], 0.0)
        direction[j] = choose(known_well, sense, direction[j])
        axis[j] = -sense * offset
        state[j] = choose(well & (out[2, j] > 1.0 + NEAR_MAXIMUM), NOWHERE, SEEKING)


@Inner
def by_symmetry(fns, n, rows, domain, wells, work):  # type: ignore[no-untyped-def]
    """Set both zeros of bodies released at rest in a well that is proved to rise on both sides of its axis.

    Such a body turns at its mirror image. For others ZERO_BEHIND stays NaN.
    """
    start, w0, places, steps = rows[LAUNCH_PLACE, :n], rows[LAUNCH_V2, :n], domain[3, :n], domain[5, :n]
    offsets, distances, proved = rows[AXIS_OFFSET, :n], work[1, :n], work[2, :n]
    for j in range(n):
        size = fabs(offsets[j])
        clear = is_clear_of_axes(size, start[j], places[j], steps[j])
        distances[j] = choose(clear & (w0[j] == 0.0), size, nan)
    find_proved(fns, wells.about_axis, distances, proved)
    for j in range(n):
        if proved[j] == FOUND:
            size = distances[j]
            rows[SEARCH_DIRECTION, j] = 1.0 if offsets[j] < 0.0 else -1.0
            rows[ZERO, j], rows[ZERO_BEHIND, j], rows[AXIS_DISTANCE, j] = 2.0 * size, 0.0, size
