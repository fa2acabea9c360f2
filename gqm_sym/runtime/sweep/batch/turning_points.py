"""The turning points of many orbits at once.

They are computed by a closed form if there is one (`derivation.wells.symmetric_orbits`), which is proved symbolically.
Otherwise they are approximated by Newton's method and then proved by interval bounds.
"""

from math import fabs, inf, nan

from gqm_sym.runtime.compiled.calls import call_bounds_batch, call_potential_divdiff1_batch, call_turning_point_batch
from gqm_sym.runtime.compiled.intrinsics import choose, floor_of, fma
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.launch.ends import distance_to_axis
from gqm_sym.runtime.launch.zeros import CONSTANT_SHARE, CUSP_SHARE
from gqm_sym.runtime.quadrature.trapezoid import CIRCULATION
from gqm_sym.runtime.sweep.batch.rows import (
    AXIS_DISTANCE,
    AXIS_NUMBER,
    AXIS_SPACING,
    BRACKET_HIGH,
    BRACKET_LOW,
    CLOSED,
    END_HIGH,
    END_LOW,
    FOUND,
    HALF_WIDTH,
    LAUNCH_PLACE,
    LAUNCH_V2,
    LENGTH_BEHIND,
    NOWHERE,
    OFFSET_HIGH,
    OFFSET_LOW,
    SEARCH_DIRECTION,
    SEARCH_LENGTH,
    SEEKING,
    STATE,
    TRIAL,
    V2_REST,
    ZERO,
    ZERO_BEHIND,
    contains,
)
from gqm_sym.runtime.sweep.batch.wells import find_proved, is_clear_of_axes

# The largest number of trials of a search, and the relative step after which the next one would be below rounding.
MAX_TRIALS, LAST_STEP = 40, 1e-9

# The largest distance of the middle of an orbit from the axis about which it is even, relative to the places.
EVEN_TOLERANCE = 8.0 * 2.0**-52

# The largest width of an orbit about one axis, in distances between axes; a wider one may reach the neighbouring axes.
MAX_WIDTH = 1.999

# The turning point is given by the square of a sine, which is 1 at a potential maximum. Within NEAR_MAXIMUM of 1 the
# closed form is not used.
NEAR_MAXIMUM = 1e-9


@Inner
def by_closed_form(fns, n, rows, p, domain, monotone, work):  # type: ignore[no-untyped-def]
    """Set both zeros, and the direction of bodies at rest, from the closed form of the width of the orbit in its well.

    If that form does not apply, ZERO_BEHIND is NaN. The state is NOWHERE for bodies that pass the maximum next to the
    well, and SEEKING for all others. Each root of a thrown body is improved by a step of Newton's method, because its
    roundings are those of the whole energy, and V**2 at launch may be much less. Unless V**2 is ``monotone`` between
    axes for all parameters, launches in other periods are left to the search.
    """
    start, w0, direction, state, roundings = (
        rows[LAUNCH_PLACE, :n],
        rows[LAUNCH_V2, :n],
        rows[SEARCH_DIRECTION, :n],
        rows[STATE, :n],
        rows[V2_REST, :n],
    )
    ahead, behind, axis = rows[ZERO, :n], rows[ZERO_BEHIND, :n], rows[AXIS_DISTANCE, :n]
    places, places_low, steps = domain[3, :n], domain[4, :n], domain[5, :n]
    out, halves, offsets, thrown = (
        work[:3].reshape(-1)[: 3 * n].reshape(3, n),
        work[3, :n],
        work[4, :n],
        work[5, :n],
    )
    for j in range(n):
        axis[j] = (start[j] - places[j]) - places_low[j]
    call_turning_point_batch(fns.turning_point, n, axis, w0, p, out)
    for j in range(n):
        period, rests = 2.0 * steps[j], w0[j] == 0.0
        periods = choose(period > 0.0, floor_of(axis[j] / period + 0.5), 0.0)
        offsets[j] = fma(-periods, period, axis[j])
        halves[j] = choose(rests & (periods == 0.0), fabs(axis[j]), out[0, j])
        ahead[j] = choose(rests, choose(offsets[j] < 0.0, 1.0, -1.0), direction[j])
        thrown[j] = choose((periods == 0.0) & (w0[j] > 0.0), 1.0, 0.0)
    if contains(thrown, 1.0):
        ends, away = work[7, :n], work[8, :n]
        slopes = work[9:12].reshape(-1)[: 3 * n].reshape(3, n)
        for j in range(n):
            away[j] = ahead[j] * halves[j] - offsets[j]
            ends[j] = start[j] + away[j]
        call_potential_divdiff1_batch(fns.potential_divdiff1, n, start, ends, away, p, slopes)
        for j in range(n):
            left = fma(-2.0 * away[j], slopes[0, j], w0[j]) + roundings[j]
            missed = ahead[j] * (left / (2.0 * slopes[2, j]))
            halves[j] += choose(thrown[j] == 1.0, missed, 0.0)
    widths = rows[HALF_WIDTH, :n]
    for j in range(n):
        offset, half, sense, step, rests = offsets[j], halves[j], ahead[j], steps[j], w0[j] == 0.0
        size, alone = fabs(offset), step == 0.0
        well = (out[1, j] > 0.0) & (alone | (size < step)) & (monotone | (offset == axis[j]))
        clear = is_clear_of_axes(size, start[j], places[j], step)
        inside = choose(size > half, half, size)  # many periods away the offset has the larger rounding error
        ascent = choose(sense * offset < 0.0, -inside, inside)
        known_well = well & ((rests & clear) | ((w0[j] > 0.0) & (out[2, j] < 1.0 - NEAR_MAXIMUM)))
        ahead[j], behind[j] = choose(known_well, half - ascent, 0.0), choose(known_well, half + ascent, nan)
        widths[j] = choose(known_well, half, nan)
        direction[j] = choose(known_well, sense, direction[j])
        axis[j] = -sense * offset
        state[j] = choose(well & (out[2, j] > 1.0 + NEAR_MAXIMUM), NOWHERE, SEEKING)


@Inner
def by_symmetry(fns, n, rows, domain, wells, work):  # type: ignore[no-untyped-def]
    """Set both zeros of bodies released at rest in a well that is proved to rise on both sides of its axis.

    Such a body turns at its mirror image. For others ZERO_BEHIND stays NaN.
    """
    start, w0, places, places_low, steps = (
        rows[LAUNCH_PLACE, :n],
        rows[LAUNCH_V2, :n],
        domain[3, :n],
        domain[4, :n],
        domain[5, :n],
    )
    offsets, distances, proved = work[0, :n], work[1, :n], work[2, :n]
    for j in range(n):
        offset, step = (start[j] - places[j]) - places_low[j], steps[j]
        size = fabs(offset)
        clear = is_clear_of_axes(size, start[j], places[j], step)
        offsets[j], distances[j] = offset, choose(clear & (w0[j] == 0.0), size, nan)
    find_proved(fns, wells.about_axis, distances, proved)
    for j in range(n):
        if proved[j] == FOUND:
            size = distances[j]
            rows[SEARCH_DIRECTION, j] = 1.0 if offsets[j] < 0.0 else -1.0
            rows[ZERO, j], rows[ZERO_BEHIND, j], rows[AXIS_DISTANCE, j] = 2.0 * size, 0.0, size


@Inner
def start_at_axes(fns, n, rows, p, axes, work):  # type: ignore[no-untyped-def]
    """Let searches that would begin at a mirror image begin at the axis of symmetry if V**2 < 0 there.

    The image has the same V**2, and belongs to another orbit then. ``axes`` has the distances of the axes from the
    launches, and those of other searches, which stay as they are, have TRIAL there.
    """
    offsets, places, out = work[0, :n], work[1, :n], work[2:5].reshape(-1)[: 3 * n].reshape(3, n)
    start, w0, direction, trial = (
        rows[LAUNCH_PLACE, :n],
        rows[LAUNCH_V2, :n],
        rows[SEARCH_DIRECTION, :n],
        rows[TRIAL, :n],
    )
    any_axis = False
    for j in range(n):
        offsets[j] = direction[j] * axes[j]
        places[j] = start[j] + offsets[j]
        any_axis |= axes[j] != trial[j]
    if not any_axis:
        return
    call_potential_divdiff1_batch(fns.potential_divdiff1, n, start, places, offsets, p, out)
    for j in range(n):
        trial[j] = choose(w0[j] - 2.0 * offsets[j] * out[0, j] < 0.0, axes[j], trial[j])


@Inner
def start_search(fns, n, rows, p, domain, monotone, wells, work):  # type: ignore[no-untyped-def]
    """Set up the search ahead of each launch. A body at rest starts in the direction of the force.

    ``domain`` has the rows DOMAIN_LOW to AXIS_STEP of `strided`. If V**2 is ``monotone`` between axes, a body released
    at rest turns at its mirror image, and no search is needed.
    """
    start, w0, direction, state = (
        rows[LAUNCH_PLACE, :n],
        rows[LAUNCH_V2, :n],
        rows[SEARCH_DIRECTION, :n],
        rows[STATE, :n],
    )
    length, length_behind, trial = rows[SEARCH_LENGTH, :n], rows[LENGTH_BEHIND, :n], rows[TRIAL, :n]
    lows, highs, periods = domain[0, :n], domain[1, :n], domain[2, :n]
    places, places_low, steps = domain[3, :n], domain[4, :n], domain[5, :n]
    axis, next_axis, number, zero, behind = (
        rows[AXIS_DISTANCE, :n],
        rows[AXIS_SPACING, :n],
        rows[AXIS_NUMBER, :n],
        rows[ZERO, :n],
        rows[ZERO_BEHIND, :n],
    )
    if fns.turning_point:
        by_closed_form(fns, n, rows, p, domain, monotone, work)
    else:
        behind[:], zero[:], state[:] = nan, 0.0, SEEKING
        if wells.about_axis.proofs.size > 0 and not monotone:
            by_symmetry(fns, n, rows, domain, wells, work)
    none, undecided, out = work[0, :n], work[1, :n], work[2:5].reshape(-1)[: 3 * n].reshape(3, n)
    axes = work[5, :n]
    for j in range(n):
        undecided[j] = choose((w0[j] == 0.0) & (behind[j] != behind[j]), 1.0, 0.0)
    if contains(undecided, 1.0):
        none[:] = 0.0
        call_potential_divdiff1_batch(fns.potential_divdiff1, n, start, start, none, p, out)
        for j in range(n):
            falls = (out[2, j] < 0.0) * 1.0 - (out[2, j] > 0.0) * 1.0
            direction[j] = choose(undecided[j] == 1.0, falls, direction[j])
    for j in range(n):
        low, high, period = lows[j], highs[j], periods[j]
        forwards, closed, extent = direction[j] > 0.0, period > 0.0, high - low
        length[j] = choose(closed, period, choose(forwards, high - start[j], start[j] - low))
        length_behind[j] = choose(closed, CLOSED, choose(forwards, start[j] - low, high - start[j]))
        trial[j] = choose(closed, 0.125 * period, choose(extent < inf, 0.125 * extent, 1.0))
        state[j] = choose((direction[j] != 0.0) & (low <= start[j]) & (start[j] <= high), state[j], NOWHERE)
    for j in range(n):
        step, low, itself = steps[j], places_low[j], direction[j] * (places[j] - start[j])
        first = distance_to_axis(start[j], direction[j], places[j], step)
        passed = floor_of((first - itself) / step + 0.5)  # steps from the known axis to the first ahead
        known_well = monotone & (low == low) & (first == itself)  # axes have the rounding of steps
        first += choose(known_well, direction[j] * low, 0.0)
        # A body released at rest moves towards the axis and turns on the other side of it.
        mirrored = choose((w0[j] == 0.0) & (first > 0.0), 2.0 * first, trial[j])
        trial[j] = choose(mirrored < length[j], mirrored, length[j])
        away = is_clear_of_axes(first, start[j], places[j], step)
        known = behind[j] == behind[j]
        decided = known | (known_well & (w0[j] == 0.0) & away)
        zero[j] = choose(known, zero[j], mirrored)
        state[j] = choose(decided & (zero[j] <= length[j]) & (state[j] == SEEKING), FOUND, state[j])
        axis[j], next_axis[j] = choose(known, axis[j], first), step
        number[j] = choose(known | (step == 0.0), 0.0, direction[j] * passed)
        axes[j] = choose((w0[j] == 0.0) & (first > 0.0) & (first < length[j]), first, trial[j])
    if not monotone and contains(state, SEEKING):
        start_at_axes(fns, n, rows, p, axes, work)


@Inner
def start_search_behind(fns, n, rows, p, monotone, work):  # type: ignore[no-untyped-def]
    """Set up the search behind each launch; a launch from rest needs none.

    The zero ahead is stored as an offset in END_LOW. AXIS_DISTANCE becomes the offset of the last axis before it; the
    mirror image of the zero about this axis is the first trial.
    """
    direction, length, length_behind, state = (
        rows[SEARCH_DIRECTION, :n],
        rows[SEARCH_LENGTH, :n],
        rows[LENGTH_BEHIND, :n],
        rows[STATE, :n],
    )
    trial, zero, axis, next_axis, number, end, w0 = (
        rows[TRIAL, :n],
        rows[ZERO, :n],
        rows[AXIS_DISTANCE, :n],
        rows[AXIS_SPACING, :n],
        rows[AXIS_NUMBER, :n],
        rows[END_LOW, :n],
        rows[LAUNCH_V2, :n],
    )
    behind, axes = rows[ZERO_BEHIND, :n], work[5, :n]
    for j in range(n):
        ahead, step = zero[j], next_axis[j]
        passed = choose(step > 0.0, floor_of((ahead - axis[j]) / step), 0.0)
        last, number[j] = axis[j] + step * passed, number[j] + direction[j] * passed
        end[j], axis[j] = direction[j] * ahead, direction[j] * last
        length[j] = choose(length_behind[j] == CLOSED, length[j] - ahead, length_behind[j])
        mirrored = choose(ahead > 2.0 * last, ahead - 2.0 * last, ahead)
        trial[j] = choose(mirrored < length[j], mirrored, length[j])
        axes[j] = choose((last < 0.0) & (-last < length[j]), -last, trial[j])
    for j in range(n):
        known = behind[j] == behind[j]
        direction[j], zero[j] = -direction[j], choose(known, behind[j], 0.0)
        state[j] = choose((w0[j] > 0.0) & (behind[j] != behind[j]), SEEKING, FOUND)
    if not monotone and contains(state, SEEKING):
        start_at_axes(fns, n, rows, p, axes, work)


@Inner
def search(fns, n, rows, p, work):  # type: ignore[no-untyped-def]
    """Approximate the distance of the first zero of V**2 from each launch, beginning at TRIAL.

    Newton's method is applied to V**2/distance, which does not vanish at a launch from rest. As long as no trial has
    V**2 < 0, the next one is at most four times as far away.
    """
    offsets, places, out = work[0, :n], work[1, :n], work[2:5].reshape(-1)[: 3 * n].reshape(3, n)
    start, w0, rests, direction, length = (
        rows[LAUNCH_PLACE, :n],
        rows[LAUNCH_V2, :n],
        rows[V2_REST, :n],
        rows[SEARCH_DIRECTION, :n],
        rows[SEARCH_LENGTH, :n],
    )
    state, bracket_low, bracket_high, trial, zero = (
        rows[STATE, :n],
        rows[BRACKET_LOW, :n],
        rows[BRACKET_HIGH, :n],
        rows[TRIAL, :n],
        rows[ZERO, :n],
    )
    if not contains(state, SEEKING):
        return
    for j in range(n):
        bracket_low[j], bracket_high[j] = 0.0, inf
    for _ in range(MAX_TRIALS):
        for j in range(n):
            offsets[j] = direction[j] * trial[j]
            places[j] = start[j] + offsets[j]
        call_potential_divdiff1_batch(fns.potential_divdiff1, n, start, places, offsets, p, out)
        for j in range(n):
            guess, w = trial[j], fma(-2.0 * offsets[j], out[0, j], w0[j]) + rests[j]
            before = w > 0.0
            low, high = choose(before, guess, bracket_low[j]), choose(before, bracket_high[j], guess)
            better = guess + guess * (w / (2.0 * offsets[j] * out[2, j] + w))
            close = fabs(better - guess) <= LAST_STEP * guess
            bracketed = high < inf
            within = (better > low) & (better < choose(bracketed, high, 4.0 * guess))
            new = choose(within, better, choose(bracketed, 0.5 * (low + high), 2.0 * guess))
            new = choose(new > length[j], length[j], new)
            lost = (w != w) | (before & (guess >= length[j]))
            live = state[j] == SEEKING
            zero[j] = choose(live & close, better, zero[j])
            trial[j] = choose(live, new, guess)
            bracket_low[j], bracket_high[j] = low, high
            state[j] = choose(live, choose(close, FOUND, choose(lost, NOWHERE, SEEKING)), state[j])
        if not contains(state, SEEKING):
            return


@Inner
def classify(n, rows):  # type: ignore[no-untyped-def]
    """Set STATE to FOUND if there is a turning point ahead, and TRIAL to FOUND if the body circulates instead."""
    state, trial, zero, length = rows[STATE, :n], rows[TRIAL, :n], rows[ZERO, :n], rows[SEARCH_LENGTH, :n]
    direction, w0, length_behind = rows[SEARCH_DIRECTION, :n], rows[LAUNCH_V2, :n], rows[LENGTH_BEHIND, :n]
    for j in range(n):
        circulates = (state[j] == NOWHERE) & (direction[j] * w0[j] != 0.0) & (length_behind[j] == CLOSED)
        trial[j] = choose(circulates, FOUND, NOWHERE)
    for j in range(n):
        state[j] = choose((state[j] == FOUND) & (zero[j] <= length[j]), FOUND, NOWHERE)


@Inner
def set_ends(n, rows):  # type: ignore[no-untyped-def]
    """Set both ends. Set STATE to FOUND if the orbit is even, and TRIAL to FOUND if only a known axis lies within it.

    Wells about axes that are an odd number of spacings away from the known axis may have another shape than the well
    about it.
    """
    start, offset_low, offset_high, a, b = (
        rows[LAUNCH_PLACE, :n],
        rows[OFFSET_LOW, :n],
        rows[OFFSET_HIGH, :n],
        rows[END_LOW, :n],
        rows[END_HIGH, :n],
    )
    direction, zero, axis, step, number, state, trial = (
        rows[SEARCH_DIRECTION, :n],
        rows[ZERO, :n],
        rows[AXIS_DISTANCE, :n],
        rows[AXIS_SPACING, :n],
        rows[AXIS_NUMBER, :n],
        rows[STATE, :n],
        rows[TRIAL, :n],
    )
    for j in range(n):
        first, second = a[j], direction[j] * zero[j]
        missed = fabs(0.5 * (first + second) - axis[j])
        even = missed <= EVEN_TOLERANCE * (fabs(start[j]) + fabs(first) + fabs(second))
        known = number[j] == 2.0 * floor_of(0.5 * number[j])
        between = (step[j] == 0.0) | ((fabs(first - second) < MAX_WIDTH * step[j]) & known)
        state[j], trial[j] = choose(even, FOUND, NOWHERE), choose(between, FOUND, NOWHERE)
    for j in range(n):
        first, second = a[j], direction[j] * zero[j]
        offset_low[j], offset_high[j] = choose(first < second, first, second), choose(first < second, second, first)
        a[j], b[j] = start[j] + offset_low[j], start[j] + offset_high[j]


@Inner
def prove(fns, kind, mirrored, pieces, n, rows, p, work):  # type: ignore[no-untyped-def]
    """Set STATE to FOUND if V**2 > 0 and ds > 0 is certain between both ends, else to NOWHERE.

    V**2 is zero at both ends of a libration, and has its launch value at both ends of a lap. On the piece next to a
    zero the slope must have one sign throughout, so that the zero is simple and the only one there. For an orbit that
    is ``mirrored`` the half up to the axis is enough. Where ds is a small share of its largest value on a piece it may
    vanish at a place that rounding has moved out of the piece.
    """
    places, behind, lo, hi = work[0, :n], work[1, :n], work[2, :n], work[3, :n]
    offsets, speeds, box = work[4, :n], work[5, :n], work[6:10].reshape(-1)[: 4 * n].reshape(4, n)
    out = work[10:13].reshape(-1)[: 3 * n].reshape(3, n)
    start, w0, offset_low, state = rows[LAUNCH_PLACE, :n], rows[LAUNCH_V2, :n], rows[OFFSET_LOW, :n], rows[STATE, :n]
    offset_high = rows[AXIS_DISTANCE if mirrored else OFFSET_HIGH, :n]
    for j in range(n):
        behind[j], speeds[j], state[j] = start[j] + offset_low[j], w0[j], FOUND
    for k in range(1, pieces + 1):
        first, end = kind != CIRCULATION and k == 1, k == pieces
        last, half = kind != CIRCULATION and end and not mirrored, end and mirrored
        share = k / pieces
        for j in range(n):
            offsets[j] = offset_high[j] if end else offset_low[j] + share * (offset_high[j] - offset_low[j])
            places[j] = start[j] + offsets[j]
            lo[j], hi[j] = behind[j], places[j]
        call_bounds_batch(fns.bounds, n, lo, hi, p, box)
        if end:
            out[0] = 0.0
        else:
            call_potential_divdiff1_batch(fns.potential_divdiff1, n, start, places, offsets, p, out)
        for j in range(n):
            lost = 2.0 * offsets[j] * out[0, j]
            w, clear = w0[j] - lost, CONSTANT_SHARE * (w0[j] + fabs(lost))
            # Bounds on the rates at which V**2 may decrease and increase, and the smallest value that they allow.
            fall, growth, from_w = 2.0 * box[1, j], -2.0 * box[0, j], speeds[j]
            valley = (fall * w + growth * from_w - fall * growth * (hi[j] - lo[j])) / (fall + growth)
            lowest = choose((fall > 0.0) & (growth > 0.0), valley, choose(w < from_w, w, from_w))
            # Towards the axis V**2 increases, except for rounding.
            grown = 0.5 * from_w - choose(fall > 0.0, fall, 0.0) * (hi[j] - lo[j])
            good = choose(first, -fall, choose(last, -growth, choose(half, grown, lowest - clear))) > 0.0
            good = good & (last | half | (w > clear)) & (box[2, j] > CUSP_SHARE * box[3, j])
            state[j] = choose(good, state[j], NOWHERE)
            behind[j], speeds[j] = places[j], w
