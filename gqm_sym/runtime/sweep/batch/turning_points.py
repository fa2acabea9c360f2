"""The turning points of many orbits at once.

By their closed form where there is one (`derivation.swing`), which symbols prove; else guessed by Newton's method, and
proved by interval bounds.
"""

from math import fabs, inf, nan

from gqm_sym.runtime.compiled.calls import (
    call_bounds_batch,
    call_potential_divdiff1_batch,
    call_turning_by_closed_form_batch,
)
from gqm_sym.runtime.compiled.intrinsics import choose, fma, whole_below
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.launch.ends import MAX_AXIS_STEP_SHARE, NEAR_AXIS, distance_to_axis
from gqm_sym.runtime.launch.zeros import CONSTANT_SHARE
from gqm_sym.runtime.quadrature.trapezoid import CIRCULATION
from gqm_sym.runtime.sweep.batch.rows import (
    AHEAD,
    AXIS,
    BACK,
    BEHIND,
    CLOSED,
    FOUND,
    LEAST,
    LEFT,
    MOST,
    NOWHERE,
    REACH,
    RIGHT,
    SEEKING,
    SPEED,
    START,
    STATE,
    STEP,
    TRIAL,
    WAY,
    A,
    B,
    any_is,
)

# Trials of a search, and the relative step after which the next would be below rounding.
TRIALS, CLOSE = 40, 1e-9

# Roundings by which the middle of an orbit may miss the axis that makes it its own mirror image.
ROUNDINGS = 8.0 * 2.0**-52

# An orbit about one axis that reaches its neighbours, twice a step apart, is at rest there.
NEIGHBOURING = 1.999

# A body that comes this near to the top, by the square of a sine, is left to the search. Above the other share rounding
# of that square moves the turning point by more than its own.
TOP, STEEP = 1e-9, 0.5


@Inner
def by_closed_form(fns, n, s, p, known, work):  # type: ignore[no-untyped-def]
    """Set AHEAD and BEHIND, and WAY of bodies at rest, by how wide the orbit about the nearest well is; else NaN.

    The state is NOWHERE for bodies that pass over the top, and SEEKING for all others.
    """
    start, w0, way, state = s[START, :n], s[SPEED, :n], s[WAY, :n], s[STATE, :n]
    ahead, behind, axis = s[AHEAD, :n], s[BEHIND, :n], s[AXIS, :n]
    places, places_low, steps = known[3, :n], known[4, :n], known[5, :n]
    rows, halves, offsets, steep = work[:3].reshape(-1)[: 3 * n].reshape(3, n), work[3, :n], work[4, :n], work[5, :n]
    for j in range(n):
        axis[j] = (start[j] - places[j]) - places_low[j]
    call_turning_by_closed_form_batch(fns.turning_point, n, axis, w0, p, rows)
    for j in range(n):
        turn, rests = 2.0 * steps[j], w0[j] == 0.0
        turns = choose(turn > 0.0, whole_below(axis[j] / turn + 0.5), 0.0)
        offsets[j] = fma(-turns, turn, axis[j])
        halves[j] = choose(rests & (turns == 0.0), fabs(axis[j]), rows[0, j])
        ahead[j] = choose(rests, choose(offsets[j] < 0.0, 1.0, -1.0), way[j])
        steep[j] = choose((turns == 0.0) & (w0[j] > 0.0) & (rows[2, j] > STEEP), 1.0, 0.0)
    if any_is(steep, 1.0):
        near, ends, widths = work[6, :n], work[7, :n], work[8, :n]
        rise = work[9:12].reshape(-1)[: 3 * n].reshape(3, n)
        for j in range(n):
            near[j], ends[j] = places[j] + offsets[j], places[j] + ahead[j] * halves[j]
            widths[j] = ahead[j] * halves[j] - offsets[j]
        call_potential_divdiff1_batch(fns.potential_divdiff1, n, near, ends, widths, p, rise)
        for j in range(n):
            missed = ahead[j] * ((w0[j] - widths[j] * rise[0, j]) / rise[2, j])
            halves[j] += choose(steep[j] == 1.0, missed, 0.0)
    for j in range(n):
        offset, half, sense, step, rests = offsets[j], halves[j], ahead[j], steps[j], w0[j] == 0.0
        size, alone = fabs(offset), step == 0.0
        well = (rows[1, j] > 0.0) & (alone | (size < step))
        clear = (size > NEAR_AXIS * (fabs(start[j]) + fabs(places[j]))) & (alone | (size < MAX_AXIS_STEP_SHARE * step))
        inside = choose(size > half, half, size)  # many turns away the offset is rounded more than the width
        uphill = choose(sense * offset < 0.0, -inside, inside)
        known_well = well & ((rests & clear) | ((w0[j] > 0.0) & (rows[2, j] < 1.0 - TOP)))
        ahead[j], behind[j] = choose(known_well, half - uphill, 0.0), choose(known_well, half + uphill, nan)
        way[j] = choose(known_well, sense, way[j])
        axis[j] = -sense * offset
        state[j] = choose(well & (rows[2, j] > 1.0 + TOP), NOWHERE, SEEKING)


@Inner
def launch(fns, n, s, p, known, monotone, work):  # type: ignore[no-untyped-def]
    """Set up the search ahead: a body released at rest goes where it falls. ``known`` has the columns FIRST to NEXT.

    Where V**2 is ``monotone`` between axes it comes to rest at its mirror image, and nothing is to be searched.
    """
    start, w0, way, state = s[START, :n], s[SPEED, :n], s[WAY, :n], s[STATE, :n]
    reach, back, trial = s[REACH, :n], s[BACK, :n], s[TRIAL, :n]
    lows, highs, periods = known[0, :n], known[1, :n], known[2, :n]
    places, places_low, steps = known[3, :n], known[4, :n], known[5, :n]
    axis, next_axis, zero, behind = s[AXIS, :n], s[STEP, :n], s[AHEAD, :n], s[BEHIND, :n]
    if monotone and fns.turning_point:
        by_closed_form(fns, n, s, p, known, work)
    else:
        behind[:], zero[:], state[:] = nan, 0.0, SEEKING
    none, undecided, rows = work[0, :n], work[1, :n], work[2:5].reshape(-1)[: 3 * n].reshape(3, n)
    for j in range(n):
        undecided[j] = choose((w0[j] == 0.0) & (behind[j] != behind[j]), 1.0, 0.0)
    if any_is(undecided, 1.0):
        none[:] = 0.0
        call_potential_divdiff1_batch(fns.potential_divdiff1, n, start, start, none, p, rows)
        for j in range(n):
            falls = (rows[2, j] < 0.0) * 1.0 - (rows[2, j] > 0.0) * 1.0
            way[j] = choose(undecided[j] == 1.0, falls, way[j])
    for j in range(n):
        low, high, period = lows[j], highs[j], periods[j]
        forwards, closed, length = way[j] > 0.0, period > 0.0, high - low
        reach[j] = choose(closed, period, choose(forwards, high - start[j], start[j] - low))
        back[j] = choose(closed, CLOSED, choose(forwards, start[j] - low, high - start[j]))
        trial[j] = choose(closed, 0.125 * period, choose(length < inf, 0.125 * length, 1.0))
        state[j] = choose((way[j] != 0.0) & (low <= start[j]) & (start[j] <= high), state[j], NOWHERE)
    for j in range(n):
        step, low, itself = steps[j], places_low[j], way[j] * (places[j] - start[j])
        first = distance_to_axis(start[j], way[j], places[j], step)
        known_well = monotone & (low == low) & (first == itself)  # steps are rounded, and so are axes by them
        first += choose(known_well, way[j] * low, 0.0)
        # Released at rest it falls towards the axis, and comes to rest on the other side.
        mirrored = choose((w0[j] == 0.0) & (first > 0.0), 2.0 * first, trial[j])
        trial[j] = choose(mirrored < reach[j], mirrored, reach[j])
        away = (first > NEAR_AXIS * (fabs(start[j]) + fabs(places[j]))) & (
            (step == 0.0) | (first < MAX_AXIS_STEP_SHARE * step)
        )
        given = behind[j] == behind[j]
        there = given | (known_well & (w0[j] == 0.0) & away)
        zero[j] = choose(given, zero[j], mirrored)
        state[j] = choose(there & (zero[j] <= reach[j]) & (state[j] == SEEKING), FOUND, state[j])
        axis[j], next_axis[j] = choose(given, axis[j], first), step


@Inner
def turn_round(n, s):  # type: ignore[no-untyped-def]
    """Set up the search behind: none for a launch from rest. What was ahead is kept as an offset, in ``A``.

    The axis is the last before that, now as an offset; it mirrors what was found to the first trial.
    """
    way, reach, back, state = s[WAY, :n], s[REACH, :n], s[BACK, :n], s[STATE, :n]
    trial, zero, axis, next_axis, end, w0 = s[TRIAL, :n], s[AHEAD, :n], s[AXIS, :n], s[STEP, :n], s[A, :n], s[SPEED, :n]
    behind = s[BEHIND, :n]
    for j in range(n):
        ahead, step = zero[j], next_axis[j]
        last = axis[j] + choose(step > 0.0, step * whole_below((ahead - axis[j]) / step), 0.0)
        end[j], axis[j] = way[j] * ahead, way[j] * last
        reach[j] = choose(back[j] == CLOSED, reach[j] - ahead, back[j])
        mirrored = choose(ahead > 2.0 * last, ahead - 2.0 * last, ahead)
        trial[j] = choose(mirrored < reach[j], mirrored, reach[j])
    for j in range(n):
        given = behind[j] == behind[j]
        way[j], zero[j] = -way[j], choose(given, behind[j], 0.0)
        state[j] = choose((w0[j] > 0.0) & (behind[j] != behind[j]), SEEKING, FOUND)


@Inner
def seek(fns, n, s, p, work):  # type: ignore[no-untyped-def]
    """Guess how far the first zero of V**2 is from each launch, from first trials.

    Newton's method on V**2/distance, which has no zero at a launch from rest. Until a trial has V**2 < 0, trials go at
    most four times as far.
    """
    offsets, places, rows = work[0, :n], work[1, :n], work[2:5].reshape(-1)[: 3 * n].reshape(3, n)
    start, w0, way, reach = s[START, :n], s[SPEED, :n], s[WAY, :n], s[REACH, :n]
    state, left, right, trial, zero = s[STATE, :n], s[LEFT, :n], s[RIGHT, :n], s[TRIAL, :n], s[AHEAD, :n]
    if not any_is(state, SEEKING):
        return
    for j in range(n):
        left[j], right[j] = 0.0, inf
    for _ in range(TRIALS):
        for j in range(n):
            offsets[j] = way[j] * trial[j]
            places[j] = start[j] + offsets[j]
        call_potential_divdiff1_batch(fns.potential_divdiff1, n, start, places, offsets, p, rows)
        for j in range(n):
            at, w = trial[j], w0[j] - offsets[j] * rows[0, j]
            before = w > 0.0
            low, high = choose(before, at, left[j]), choose(before, right[j], at)
            better = at + at * (w / (offsets[j] * rows[2, j] + w))
            close = fabs(better - at) <= CLOSE * at
            bracketed = high < inf
            within = (better > low) & (better < choose(bracketed, high, 4.0 * at))
            new = choose(within, better, choose(bracketed, 0.5 * (low + high), 2.0 * at))
            new = choose(new > reach[j], reach[j], new)
            lost = (w != w) | (before & (at >= reach[j]))
            live = state[j] == SEEKING
            zero[j] = choose(live & close, better, zero[j])
            trial[j] = choose(live, new, at)
            left[j], right[j] = low, high
            state[j] = choose(live, choose(close, FOUND, choose(lost, NOWHERE, SEEKING)), state[j])
        if not any_is(state, SEEKING):
            return


@Inner
def judge(n, s):  # type: ignore[no-untyped-def]
    """Set the state by whether the turning point ahead is one, and the trial by whether the body goes round instead."""
    state, trial, zero, reach = s[STATE, :n], s[TRIAL, :n], s[AHEAD, :n], s[REACH, :n]
    way, w0, back = s[WAY, :n], s[SPEED, :n], s[BACK, :n]
    for j in range(n):
        round_it = (state[j] == NOWHERE) & (way[j] * w0[j] != 0.0) & (back[j] == CLOSED)
        trial[j] = choose(round_it, FOUND, NOWHERE)
    for j in range(n):
        state[j] = choose((state[j] == FOUND) & (zero[j] <= reach[j]), FOUND, NOWHERE)


@Inner
def set_ends(n, s):  # type: ignore[no-untyped-def]
    """Set both ends; the state by whether the orbit is its own mirror image, the trial by whether about one axis."""
    start, least, most, a, b = s[START, :n], s[LEAST, :n], s[MOST, :n], s[A, :n], s[B, :n]
    way, zero, axis, step, state, trial = s[WAY, :n], s[AHEAD, :n], s[AXIS, :n], s[STEP, :n], s[STATE, :n], s[TRIAL, :n]
    for j in range(n):
        first, second = a[j], way[j] * zero[j]
        missed = fabs(0.5 * (first + second) - axis[j])
        even = missed <= ROUNDINGS * (fabs(start[j]) + fabs(first) + fabs(second))
        between = (step[j] == 0.0) | (fabs(first - second) < NEIGHBOURING * step[j])
        state[j], trial[j] = choose(even, FOUND, NOWHERE), choose(between, FOUND, NOWHERE)
    for j in range(n):
        first, second = a[j], way[j] * zero[j]
        least[j], most[j] = choose(first < second, first, second), choose(first < second, second, first)
        a[j], b[j] = start[j] + least[j], start[j] + most[j]


@Inner
def prove(fns, kind, mirrored, pieces, n, s, p, work):  # type: ignore[no-untyped-def]
    """Set the state to FOUND where V**2 > 0 and ds > 0 between both ends is certain, else to NOWHERE.

    V**2 is zero at both ends of a libration, and what it is at launch at both ends of a lap. Over the piece at a zero
    the slope must have its sign throughout: the zero is simple, and the only one there. Half of an orbit that is
    ``mirrored`` is enough, up to the axis.
    """
    places, behind, lo, hi = work[0, :n], work[1, :n], work[2, :n], work[3, :n]
    offsets, speeds, box = work[4, :n], work[5, :n], work[6:10].reshape(-1)[: 4 * n].reshape(4, n)
    rows = work[10:13].reshape(-1)[: 3 * n].reshape(3, n)
    start, w0, least, state = s[START, :n], s[SPEED, :n], s[LEAST, :n], s[STATE, :n]
    most = s[AXIS if mirrored else MOST, :n]
    for j in range(n):
        behind[j], speeds[j], state[j] = start[j] + least[j], w0[j], FOUND
    for k in range(1, pieces + 1):
        first, end = kind != CIRCULATION and k == 1, k == pieces
        last, half = kind != CIRCULATION and end and not mirrored, end and mirrored
        share = k / pieces
        for j in range(n):
            offsets[j] = most[j] if end else least[j] + share * (most[j] - least[j])
            places[j] = start[j] + offsets[j]
            lo[j], hi[j] = behind[j], places[j]
        call_bounds_batch(fns.bounds, n, lo, hi, p, box)
        if end:
            rows[0] = 0.0
        else:
            call_potential_divdiff1_batch(fns.potential_divdiff1, n, start, places, offsets, p, rows)
        for j in range(n):
            lost = offsets[j] * rows[0, j]
            w, clear = w0[j] - lost, CONSTANT_SHARE * (w0[j] + fabs(lost))
            # The most that V**2 may lose, and gain, for each unit of the parameter, and so the least it can be.
            loss, gain, from_w = box[1, j], -box[0, j], speeds[j]
            valley = (loss * w + gain * from_w - loss * gain * (hi[j] - lo[j])) / (loss + gain)
            lowest = choose((loss > 0.0) & (gain > 0.0), valley, choose(w < from_w, w, from_w))
            # On the way to the axis it grows, but for rounding.
            grown = 0.5 * from_w - choose(loss > 0.0, loss, 0.0) * (hi[j] - lo[j])
            good = choose(first, -loss, choose(last, -gain, choose(half, grown, lowest - clear))) > 0.0
            good = good & (last | half | (w > clear)) & (box[2, j] > 0.0)
            state[j] = choose(good, state[j], NOWHERE)
            behind[j], speeds[j] = places[j], w
