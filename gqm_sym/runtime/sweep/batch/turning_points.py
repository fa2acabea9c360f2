"""The turning points of many orbits at once.

They are known without a search (`known_turns`), or are approximated by Newton's method and then proved by interval
bounds.
"""

from math import fabs, inf, nan

from gqm_sym.runtime.compiled.calls import call_bounds_batch, call_potential_divdiff1_batch
from gqm_sym.runtime.compiled.intrinsics import choose, floor_of, fma
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.launch.ends import distance_to_axis
from gqm_sym.runtime.launch.zeros import CONSTANT_SHARE, CUSP_SHARE
from gqm_sym.runtime.quadrature.trapezoid import CIRCULATION
from gqm_sym.runtime.sweep.batch.first_trials import fill_slopes, start_at_axes, start_at_harmonic_turns
from gqm_sym.runtime.sweep.batch.known_turns import by_closed_form, by_symmetry
from gqm_sym.runtime.sweep.batch.rows import (
    AXIS_DISTANCE,
    AXIS_NUMBER,
    AXIS_OFFSET,
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
from gqm_sym.runtime.sweep.batch.wells import is_clear_of_axes

# The largest number of trials of a search, and the relative step after which the next one would be below rounding.
MAX_TRIALS, LAST_STEP = 40, 1e-9

# The largest growth of the distance in a step of a careful search.
SMALL_GROWTH = 1.5

# The share of an orbit from which on a proof by pieces takes the rest of it as one piece.
ALMOST_WHOLE = 1.0 - 2.0**-30

# The largest distance of the middle of an orbit from the axis about which it is even, relative to the places.
EVEN_TOLERANCE = 8.0 * 2.0**-52

# The largest width of an orbit about one axis, in distances between axes; a wider one may reach the neighbouring axes.
MAX_WIDTH = 1.999


@Inner
def start_search(fns, n, rows, p, domain, monotone, wells, work):  # type: ignore[no-untyped-def]
    """Set up the search ahead of each launch. A body at rest starts in the direction of the force.

    ``domain`` has the rows DOMAIN_LOW to AXIS_STEP_LOW of `strided`. If V**2 is ``monotone`` between axes, a body
    released at rest turns at its mirror image, and no search is needed.
    """
    start, w0, direction, state = (
        rows[LAUNCH_PLACE, :n],
        rows[LAUNCH_V2, :n],
        rows[SEARCH_DIRECTION, :n],
        rows[STATE, :n],
    )
    length, length_behind, trial = rows[SEARCH_LENGTH, :n], rows[LENGTH_BEHIND, :n], rows[TRIAL, :n]
    lows, highs, periods = domain[0, :n], domain[1, :n], domain[2, :n]
    places, steps, offsets = domain[3, :n], domain[5, :n], rows[AXIS_OFFSET, :n]
    axis, next_axis, number, zero, behind = (
        rows[AXIS_DISTANCE, :n],
        rows[AXIS_SPACING, :n],
        rows[AXIS_NUMBER, :n],
        rows[ZERO, :n],
        rows[ZERO_BEHIND, :n],
    )
    if fns.turning_point:
        by_closed_form(fns, n, rows, p, domain, work)
    else:
        behind[:], zero[:], state[:] = nan, 0.0, SEEKING
        if wells.about_axis.proofs.size > 0 and not monotone:
            by_symmetry(fns, n, rows, domain, wells, work)
    unknown, axes, images, slopes = work[1, :n], work[5, :n], work[6, :n], work[7, :n]
    for j in range(n):
        unknown[j] = choose((behind[j] != behind[j]) & (state[j] == SEEKING), 1.0, 0.0)
    if contains(unknown, 1.0):
        fill_slopes(fns, n, rows, p, work)
        for j in range(n):
            falls = (slopes[j] < 0.0) * 1.0 - (slopes[j] > 0.0) * 1.0
            direction[j] = choose((w0[j] == 0.0) & (behind[j] != behind[j]), falls, direction[j])
    for j in range(n):
        low, high, period = lows[j], highs[j], periods[j]
        forwards, closed, extent = direction[j] > 0.0, period > 0.0, high - low
        length[j] = choose(closed, period, choose(forwards, high - start[j], start[j] - low))
        length_behind[j] = choose(closed, CLOSED, choose(forwards, start[j] - low, high - start[j]))
        trial[j] = choose(closed, 0.125 * period, choose(extent < inf, 0.125 * extent, 1.0))
        state[j] = choose((direction[j] != 0.0) & (low <= start[j]) & (start[j] <= high), state[j], NOWHERE)
    for j in range(n):
        step, itself, ahead = steps[j], direction[j] * (places[j] - start[j]), -direction[j] * offsets[j]
        first = distance_to_axis(start[j], direction[j], places[j], step)
        passed = floor_of((first - itself) / step + 0.5)  # steps from the known axis to the first ahead
        known_well = monotone & (ahead > 0.0)  # of other axes the distance has the rounding of the place
        first = choose(known_well, ahead, first)
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
        images[j] = choose(state[j] == SEEKING, choose((w0[j] == 0.0) & (first > 0.0), 1.0, 0.0), 1.0)
    if contains(images, 0.0):
        start_at_harmonic_turns(fns, n, rows, p, images, work)
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
    behind, axes, images = rows[ZERO_BEHIND, :n], work[5, :n], work[6, :n]
    for j in range(n):
        ahead, step = zero[j], next_axis[j]
        passed = choose(step > 0.0, floor_of((ahead - axis[j]) / step), 0.0)
        last, number[j] = axis[j] + step * passed, number[j] + direction[j] * passed
        end[j], axis[j] = direction[j] * ahead, direction[j] * last
        length[j] = choose(length_behind[j] == CLOSED, length[j] - ahead, length_behind[j])
        mirrored = choose(ahead > 2.0 * last, ahead - 2.0 * last, ahead)
        trial[j] = choose(mirrored < length[j], mirrored, length[j])
        axes[j] = choose((last < 0.0) & (-last < length[j]), -last, trial[j])
        images[j] = choose(ahead > 2.0 * last, 1.0, 0.0)
    for j in range(n):
        known = behind[j] == behind[j]
        direction[j], zero[j] = -direction[j], choose(known, behind[j], 0.0)
        state[j] = choose((w0[j] > 0.0) & (behind[j] != behind[j]), SEEKING, FOUND)
        images[j] = choose(state[j] == SEEKING, images[j], 1.0)
    if contains(images, 0.0):
        fill_slopes(fns, n, rows, p, work)
        start_at_harmonic_turns(fns, n, rows, p, images, work)
    if not monotone and contains(state, SEEKING):
        start_at_axes(fns, n, rows, p, axes, work)


@Inner
def search(fns, n, rows, p, careful, work):  # type: ignore[no-untyped-def]
    """Approximate the distance of the first zero of V**2 from each launch, beginning at TRIAL.

    Newton's method is applied to V**2/distance, which does not vanish at a launch from rest. As long as no trial has
    V**2 < 0, the next one is at most four times as far away, and in a ``careful`` search one and a half times.
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
    growth, step = (SMALL_GROWTH, SMALL_GROWTH) if careful else (4.0, 2.0)
    for j in range(n):
        bracket_low[j], bracket_high[j] = 0.0, inf
    for _ in range(MAX_TRIALS):
        for j in range(n):
            offsets[j] = direction[j] * trial[j]
            places[j] = start[j] + offsets[j]
        call_potential_divdiff1_batch(fns.potential_divdiff1, n, start, places, offsets, p, out)
        for j in range(n):
            guess, w = trial[j], fma(-2.0 * offsets[j], out[0, j], w0[j]) + rests[j]
            better = guess + guess * (w / (2.0 * offsets[j] * out[2, j] + w))
            tiny = fabs(better - guess) <= LAST_STEP * guess
            # There may be a pole at the end of the curve, where steps are tiny without being close to a zero.
            clipped = tiny & (guess >= length[j]) & (bracket_low[j] > 0.0)
            before, close = (w > 0.0) & (not clipped), tiny & (not clipped)
            low, high = choose(before, guess, bracket_low[j]), choose(before, bracket_high[j], guess)
            bracketed = high < inf
            within = (better > low) & (better < choose(bracketed, high, growth * guess)) & (not clipped)
            new = choose(within, better, choose(bracketed, 0.5 * (low + high), step * guess))
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
    w0, offsets, widths = rows[LAUNCH_V2, :n], rows[AXIS_OFFSET, :n], rows[HALF_WIDTH, :n]
    for j in range(n):
        first, second = a[j], direction[j] * zero[j]
        missed = fabs(0.5 * (first + second) - axis[j])
        even = missed <= EVEN_TOLERANCE * (fabs(start[j]) + fabs(first) + fabs(second))
        known = number[j] == 2.0 * floor_of(0.5 * number[j])
        between = (step[j] == 0.0) | ((fabs(first - second) < MAX_WIDTH * step[j]) & known)
        state[j], trial[j] = choose(even, FOUND, NOWHERE), choose(between, FOUND, NOWHERE)
        # From rest half the width is the distance from the axis, to more digits than a search gives.
        half, width = fabs(offsets[j]), fabs(first - second)
        mirrored = (w0[j] == 0.0) & even & between & (fabs(2.0 * half - width) <= EVEN_TOLERANCE * width)
        widths[j] = choose(mirrored, half, widths[j])
    for j in range(n):
        first, second = a[j], direction[j] * zero[j]
        offset_low[j], offset_high[j] = choose(first < second, first, second), choose(first < second, second, first)
        a[j], b[j] = start[j] + offset_low[j], start[j] + offset_high[j]


@Inner
def any_below_one(row):  # type: ignore[no-untyped-def]
    """Return whether a number in a row is below 1."""
    found = False
    for v in row:
        found |= v < 1.0
    return found


@Inner
def prove(fns, kind, mirrored, cuts, n, rows, p, work):  # type: ignore[no-untyped-def]
    """Set STATE to FOUND if V**2 > 0 and ds > 0 is certain between both ends, else to NOWHERE.

    V**2 is zero at both ends of a libration, and has its launch value at both ends of a lap. On the piece next to a
    zero the slope must have one sign throughout, so that the zero is simple and the only one there. For an orbit that
    is ``mirrored`` the half up to the axis is enough. Where ds is a small share of its largest value on a piece it may
    vanish at a place that rounding has moved out of the piece.

    ``cuts`` are the number of equal pieces, the first of which is tried first, and the number of trials. If there may
    be more trials than pieces, one that is not proved is tried again with half its width, and the next after a proved
    one is twice as wide, because bounds are too wide only next to a pole of the slope or where V**2 is small.
    """
    pieces, trials = cuts
    places, behind, ends, steps = work[0, :n], work[1, :n], work[2, :n], work[3, :n]
    offsets, speeds, box = work[4, :n], work[5, :n], work[6:10].reshape(-1)[: 4 * n].reshape(4, n)
    out = work[10:13].reshape(-1)[: 3 * n].reshape(3, n)
    start, w0, offset_low, shares = rows[LAUNCH_PLACE, :n], rows[LAUNCH_V2, :n], rows[OFFSET_LOW, :n], rows[STATE, :n]
    offset_high = rows[AXIS_DISTANCE if mirrored else OFFSET_HIGH, :n]
    librates, wider = kind != CIRCULATION, 2.0 if trials > pieces else 1.0
    for j in range(n):
        behind[j], speeds[j], shares[j], steps[j] = start[j] + offset_low[j], w0[j], 0.0, 1.0 / pieces
    for _ in range(trials):
        for j in range(n):
            share = shares[j] + steps[j]
            ends[j] = choose(share < ALMOST_WHOLE, share, 1.0)
            inside = offset_low[j] + share * (offset_high[j] - offset_low[j])
            offsets[j] = choose(ends[j] < 1.0, inside, offset_high[j])
            places[j] = start[j] + offsets[j]
        call_bounds_batch(fns.bounds, n, behind, places, p, box)
        if any_below_one(ends):
            call_potential_divdiff1_batch(fns.potential_divdiff1, n, start, places, offsets, p, out)
        else:
            out[0] = 0.0
        for j in range(n):
            end, width = ends[j] == 1.0, places[j] - behind[j]
            first, last, half = librates & (shares[j] == 0.0), librates & end & (not mirrored), end & mirrored
            lost = choose(end, 0.0, 2.0 * offsets[j] * out[0, j])
            w, clear = w0[j] - lost, CONSTANT_SHARE * (w0[j] + fabs(lost))
            # Bounds on the rates at which V**2 may decrease and increase, and the smallest value that they allow.
            fall, growth, from_w = 2.0 * box[1, j], -2.0 * box[0, j], speeds[j]
            valley = (fall * w + growth * from_w - fall * growth * width) / (fall + growth)
            lowest = choose((fall > 0.0) & (growth > 0.0), valley, choose(w < from_w, w, from_w))
            # Towards the axis V**2 increases, except for rounding.
            grown = 0.5 * from_w - choose(fall > 0.0, fall, 0.0) * width
            good = choose(first, -fall, choose(last, -growth, choose(half, grown, lowest - clear))) > 0.0
            good = good & (last | half | (w > clear)) & (box[2, j] > CUSP_SHARE * box[3, j]) & (shares[j] < 1.0)
            behind[j], speeds[j] = choose(good, places[j], behind[j]), choose(good, w, from_w)
            shares[j] = choose(good, ends[j], shares[j])
            steps[j] *= choose(good, wider, 0.5)
        if not any_below_one(shares):
            break
    for j in range(n):
        shares[j] = choose(shares[j] == 1.0, FOUND, NOWHERE)
