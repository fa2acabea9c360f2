"""Turning points and times of many orbits at once, an orbit in each lane of a vector register.

Every step is a loop over the orbits of a batch: it fills arrays by the module's functions ``_each``, and works on them
without branches. Zeros of V**2 are guessed by Newton's method; then bounds of the climb's slope over a few pieces of an
orbit prove that V**2 is positive between them. Orbits for which that does not succeed, or whose time does not
converge, are left to `swift`, which takes them one by one.

A batch is an array with a row for each quantity and a column for each orbit, beside the run-time parameters, a row
each. Columns are whole registers: the last orbit is repeated to fill one.
"""

from math import fabs, inf, isfinite, nan, pi, sqrt

import numpy as np
from numba import types

from gqm_sym.runtime.crossing import call_bend_each, call_bounds_each, call_rise_each
from gqm_sym.runtime.entries import first_step
from gqm_sym.runtime.fused import choose
from gqm_sym.runtime.jit import Inner, entry
from gqm_sym.runtime.search import UNRESOLVED
from gqm_sym.runtime.swift import (
    CIRCULATION,
    DONE,
    DOUBLINGS,
    FEWEST,
    FROM_A,
    FROM_B,
    LEAST_BALANCE,
    LIBRATION,
    PASSING,
    SAME,
    SHARES,
)

# Orbits of a batch: its arrays stay in the first-level cache. Orbits of a full register, at most.
BATCH, LANES = 256, 8
# Rows of a batch: which launch, its place and V**2, which way it goes, how far the curve reaches; the search's state,
# its bracket, its trial and the zero; offsets of both ends from the launch, the ends; what the quadrature keeps.
WHO, START, SPEED, WAY, REACH, STATE, LEFT, RIGHT, TRIAL, AHEAD, LEAST, MOST = range(12)
A, B, SUM, VALUE, CHANGE, LOW, HIGH, ROWS = range(12, 20)
# What a search has come to.
SEEKING, FOUND, NOWHERE = 0.0, 1.0, 2.0
# Trials of a search, and the relative step after which the next would be below rounding.
TRIALS, CLOSE = 40, 1e-9
# Pieces of an orbit for its proof: a few first, more where those do not suffice.
FEW_PIECES, MANY_PIECES = 3, 12
# A rule's change is foreseen from its last two, which fall geometrically: below this it is less than rounding. The
# first of them must be below FALLING, whose fourth power is that: one accidentally small change decides nothing.
FORESEEN, FALLING = 3e-17, 7e-5

_LINE = types.float64[::1]
_ROWS = types.float64[:, ::1]


@Inner
def gather(s, p, count, n, chosen, kept, t, q):  # type: ignore[no-untyped-def]
    """Copy the first ``kept`` of ``chosen`` columns and their parameters; returns how many columns that fills."""
    full = -(-kept // LANES) * LANES
    for row in range(ROWS):
        for j in range(kept):
            t[row, j] = s[row, chosen[j]]
        for j in range(kept, full):
            t[row, j] = t[row, kept - 1]
    for row in range(count):
        for j in range(kept):
            q[row * full + j] = p[row * n + chosen[j]]
        for j in range(kept, full):
            q[row * full + j] = q[row * full + kept - 1]
    return full


@Inner
def shrink(s, p, count, n, chosen, kept):  # type: ignore[no-untyped-def]
    """Close up to the ``kept`` columns that are ``chosen``, in ascending order; returns how many columns are left."""
    return n if kept == n else gather(s, p, count, n, chosen, kept, s, p)


@Inner
def launch(fns, n, s, p, domains, work):  # type: ignore[no-untyped-def]
    """Set up the search ahead: a body released at rest goes where it falls."""
    at_rest = 0.0
    for j in range(n):
        at_rest += choose(s[SPEED, j] == 0.0, 1.0, 0.0)
    if at_rest > 0.0:
        none, rows = work[0, :n], work[1:4].reshape(-1)[: 3 * n].reshape(3, n)
        none[:] = 0.0
        call_rise_each(fns[0], n, s[START, :n], s[START, :n], none, p, rows)
        for j in range(n):
            if s[SPEED, j] == 0.0:
                s[WAY, j] = (rows[2, j] < 0.0) * 1.0 - (rows[2, j] > 0.0) * 1.0
    for j in range(n):
        low, high, period = domains[int(s[WHO, j]), 0], domains[int(s[WHO, j]), 1], domains[int(s[WHO, j]), 2]
        s[REACH, j] = period if period > 0.0 else (high - s[START, j] if s[WAY, j] > 0.0 else s[START, j] - low)
        s[TRIAL, j] = min(first_step(low, high, period), s[REACH, j])
        s[AHEAD, j], s[STATE, j] = 0.0, SEEKING if s[WAY, j] != 0.0 else NOWHERE


@Inner
def turn_round(n, s, domains):  # type: ignore[no-untyped-def]
    """Set up the search behind: none for a launch from rest. What was ahead is kept as an offset, in ``A``."""
    for j in range(n):
        low, high, period = domains[int(s[WHO, j]), 0], domains[int(s[WHO, j]), 1], domains[int(s[WHO, j]), 2]
        s[A, j] = s[WAY, j] * s[AHEAD, j]
        s[WAY, j] = -s[WAY, j]
        rest = high - s[START, j] if s[WAY, j] > 0.0 else s[START, j] - low
        s[REACH, j] = period - s[AHEAD, j] if period > 0.0 else rest
        s[TRIAL, j] = min(s[AHEAD, j], s[REACH, j])
        s[AHEAD, j], s[STATE, j] = 0.0, SEEKING if s[SPEED, j] > 0.0 else FOUND


@Inner
def seek(fns, n, s, p, work):  # type: ignore[no-untyped-def]
    """Guess how far the first zero of V**2 is from each launch, from first trials.

    Newton's method on V**2/distance, which has no zero at a launch from rest. Until a trial has V**2 < 0, trials go at
    most four times as far.
    """
    offsets, places, rows = work[0, :n], work[1, :n], work[2:5].reshape(-1)[: 3 * n].reshape(3, n)
    start, w0, way, reach = s[START, :n], s[SPEED, :n], s[WAY, :n], s[REACH, :n]
    state, left, right, trial, zero = s[STATE, :n], s[LEFT, :n], s[RIGHT, :n], s[TRIAL, :n], s[AHEAD, :n]
    for j in range(n):
        left[j], right[j] = 0.0, inf
    for _ in range(TRIALS):
        for j in range(n):
            offsets[j] = way[j] * trial[j]
            places[j] = start[j] + offsets[j]
        call_rise_each(fns[0], n, start, places, offsets, p, rows)
        seeking = 0.0
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
            seeking += choose(state[j] == SEEKING, 1.0, 0.0)
        if seeking == 0.0:
            return


@Inner
def prove(fns, kind, pieces, n, s, p, work):  # type: ignore[no-untyped-def]
    """Set the state to FOUND where V**2 > 0 and ds > 0 between both ends is certain, else to NOWHERE.

    V**2 is zero at both ends of a libration, and what it is at launch at both ends of a lap. Over the piece at a zero
    the slope must have its sign throughout: the zero is simple, and the only one there.
    """
    places, behind, lo, hi = work[0, :n], work[1, :n], work[2, :n], work[3, :n]
    offsets, speeds, box = work[4, :n], work[5, :n], work[6:10].reshape(-1)[: 4 * n].reshape(4, n)
    rows = work[10:13].reshape(-1)[: 3 * n].reshape(3, n)
    start, w0, least, most, state = s[START, :n], s[SPEED, :n], s[LEAST, :n], s[MOST, :n], s[STATE, :n]
    for j in range(n):
        behind[j], speeds[j], state[j] = start[j] + least[j], w0[j], FOUND
    for k in range(1, pieces + 1):
        first, last = kind == LIBRATION and k == 1, kind == LIBRATION and k == pieces
        share = k / pieces
        for j in range(n):
            offsets[j] = most[j] if k == pieces else least[j] + share * (most[j] - least[j])
            places[j] = start[j] + offsets[j]
            lo[j], hi[j] = behind[j], places[j]
        call_bounds_each(fns[2], n, lo, hi, p, box)
        if k < pieces:
            call_rise_each(fns[0], n, start, places, offsets, p, rows)
        else:
            rows[0] = 0.0
        for j in range(n):
            lost = offsets[j] * rows[0, j]
            w, clear = w0[j] - lost, UNRESOLVED * (w0[j] + fabs(lost))
            # The most that V**2 may lose, and gain, for each unit of the parameter, and so the least it can be.
            loss, gain, from_w = box[1, j], -box[0, j], speeds[j]
            valley = (loss * w + gain * from_w - loss * gain * (hi[j] - lo[j])) / (loss + gain)
            lowest = choose((loss > 0.0) & (gain > 0.0), valley, choose(w < from_w, w, from_w))
            good = choose(first, -loss, choose(last, -gain, lowest - clear)) > 0.0
            good = good & (last | (w > clear)) & (box[2, j] > 0.0)
            state[j] = choose(good, state[j], NOWHERE)
            behind[j], speeds[j] = places[j], w


@Inner
def fill(fns, kind, n, node, s, p, work):  # type: ignore[no-untyped-def]
    """The time per share of the orbit at one node of the rule, and the extremes so far of V**2's regular factor."""
    da, db, rates, rows = work[0, :n], work[1, :n], work[2, :n], work[3:6].reshape(-1)
    start, w0, least, most = s[START, :n], s[SPEED, :n], s[LEAST, :n], s[MOST, :n]
    low, high = s[LOW, :n], s[HIGH, :n]
    if kind == LIBRATION:
        from_a, from_b, two = FROM_A[node], FROM_B[node], rows[: 2 * n].reshape(2, n)
        for j in range(n):
            width = most[j] - least[j]
            da[j], db[j] = width * from_a, width * from_b
        call_bend_each(fns[1], n, s[A, :n], s[B, :n], da, db, p, two)
        for j in range(n):
            q = two[0, j]
            rates[j] = pi * two[1, j] / sqrt(q)
            low[j], high[j] = choose(q >= low[j], low[j], q), choose(q > high[j], q, high[j])
    else:
        share, three = SHARES[node], rows[: 3 * n].reshape(3, n)
        for j in range(n):
            db[j] = least[j] + share * (most[j] - least[j])
            da[j] = start[j] + db[j]
        call_rise_each(fns[0], n, start, da, db, p, three)
        for j in range(n):
            lost = db[j] * three[0, j]
            rates[j] = (most[j] - least[j]) * three[1, j] / sqrt(w0[j] - lost)
            q = (w0[j] - lost) / (w0[j] + fabs(lost))
            low[j], high[j] = choose(q >= low[j], low[j], q), 1.0
    return rates


@Inner
def times(fns, kind, n, s, flat, count, chosen, work, out, reasons):  # type: ignore[no-untyped-def]
    """Half periods or loop times by the trapezoidal rule, into the rows of ``out`` that belong to the orbits.

    Nodes are doubled until the next change is foreseen to be below rounding; orbits for which that is so drop out, and
    those whose V**2 all but vanishes.
    """
    p = flat[: count * n].reshape(count, n)
    for j in range(n):
        s[SUM, j], s[VALUE, j], s[CHANGE, j], s[LOW, j], s[HIGH, j] = 0.0, 0.0, 0.0, inf, 0.0
    for node in range(FEWEST + 1):
        rates = fill(fns, kind, n, node, s, p, work)
        ends = 0.5 if node in (0, FEWEST) else 1.0
        half, quarter = ends * (node % 2 == 0), ends * (node % 4 == 0)
        for j in range(n):
            s[SUM, j] += ends * rates[j]
            s[VALUE, j] += half * rates[j]
            s[CHANGE, j] += quarter * rates[j]
    for j in range(n):
        rough, rougher = s[VALUE, j] * 2 / FEWEST, s[CHANGE, j] * 4 / FEWEST
        s[VALUE, j], s[CHANGE, j] = rough, fabs(rough - rougher) / rough
    nodes = FEWEST
    while True:
        kept = 0
        for j in range(n):
            value, before = s[SUM, j] / nodes, s[CHANGE, j]
            change = fabs(value - s[VALUE, j]) / value
            s[VALUE, j], s[CHANGE, j] = value, change
            if before <= FALLING and (change <= SAME or change * (change / before) ** 2 <= FORESEEN):
                if s[LOW, j] > LEAST_BALANCE * s[HIGH, j]:
                    k = int(s[WHO, j])
                    out[k, 0], reasons[k] = value, DONE
            elif s[LOW, j] > LEAST_BALANCE * s[HIGH, j]:
                chosen[kept] = j
                kept += 1
        if kept == 0 or nodes == FEWEST * 2**DOUBLINGS:
            return
        n = shrink(s, flat, count, n, chosen, kept)
        p = flat[: count * n].reshape(count, n)
        for node in range(nodes + 1, 2 * nodes + 1):
            rates = fill(fns, kind, n, node, s, p, work)
            for j in range(n):
                s[SUM, j] += rates[j]
        nodes *= 2


@Inner
def settle(fns, kind, n, s, flat, count, chosen, work, t, spare, timed, out, reasons):  # type: ignore[no-untyped-def]
    """Prove orbits of one kind, and answer for those that are proved."""
    for pieces in (FEW_PIECES, MANY_PIECES):
        prove(fns, kind, pieces, n, s, flat[: count * n].reshape(count, n), work)
        proved = 0
        for j in range(n):
            if s[STATE, j] == FOUND:
                chosen[proved] = j
                proved += 1
                k = int(s[WHO, j])
                if timed:
                    out[k, 1] = kind
                elif kind == LIBRATION:
                    out[k, 0], out[k, 1], reasons[k] = s[A, j], s[B, j], DONE
                else:
                    reasons[k] = PASSING
        if proved == n:
            if timed:
                times(fns, kind, n, s, flat, count, chosen, work, out, reasons)
            return
        if proved and timed:
            m = gather(s, flat, count, n, chosen, proved, t, spare)
            times(fns, kind, m, t, spare, count, chosen, work, out, reasons)
        left = 0
        for j in range(n):
            if s[STATE, j] != FOUND:
                chosen[left] = j
                left += 1
        n = shrink(s, flat, count, n, chosen, left)


@entry(
    types.void(
        *(types.UniTuple(types.int64, 3), _ROWS, _LINE, _LINE, types.int64[::1], _ROWS, types.boolean),
        *(_ROWS, types.int8[::1]),
    ),
    nogil=True,
)
def answer_batches(fns, ps, lam0s, v0s, ways, domains, timed, out, reasons):  # type: ignore[no-untyped-def]
    """Fill rows of ``out`` and of ``reasons`` for the launches that this can answer, as `swift.answer_many` does.

    The others keep their reason. ``timed`` asks for times, else for turning points.
    """
    count = ps.shape[1]
    s, t, u = np.empty((ROWS, BATCH)), np.empty((ROWS, BATCH)), np.empty((ROWS, BATCH))
    flat, spare, other = np.empty(count * BATCH), np.empty(count * BATCH), np.empty(count * BATCH)
    work, chosen, others = np.empty((13, BATCH)), np.empty(BATCH, dtype=np.int64), np.empty(BATCH, dtype=np.int64)
    for begin in range(0, lam0s.size, BATCH):
        filled = 0
        for k in range(begin, min(begin + BATCH, lam0s.size)):
            out[k, 0] = out[k, 1] = nan
            low, high = domains[k, 0], domains[k, 1]
            if isfinite(v0s[k]) and isfinite(ps[k].sum()) and low <= lam0s[k] <= high and isfinite(lam0s[k]):
                s[WHO, filled], s[START, filled], s[SPEED, filled] = k, lam0s[k], v0s[k] * v0s[k]
                s[WAY, filled] = ways[k]
                chosen[filled] = filled
                filled += 1
        if filled == 0:
            continue
        n = -(-filled // LANES) * LANES
        gather(s, flat, 0, n, chosen, filled, s, flat)
        for j in range(n):
            for row in range(count):
                flat[row * n + j] = ps[int(s[WHO, j]), row]
        p = flat[: count * n].reshape(count, n)
        launch(fns, n, s, p, domains, work)
        seek(fns, n, s, p, work)
        kept, laps = 0, 0
        for j in range(n):  # what is found beyond the reach is not on the curve
            period = domains[int(s[WHO, j]), 2]
            if s[STATE, j] == FOUND and s[AHEAD, j] < s[REACH, j]:
                chosen[kept] = j
                kept += 1
            elif s[STATE, j] == NOWHERE and period > 0.0 and s[SPEED, j] > 0.0:
                s[LEAST, j], s[MOST, j] = min(s[WAY, j] * period, 0.0), max(s[WAY, j] * period, 0.0)
                others[laps] = j
                laps += 1
        if laps:
            m = gather(s, flat, count, n, others, laps, u, other)
            settle(fns, CIRCULATION, m, u, other, count, others, work, t, spare, timed, out, reasons)
        if kept == 0:
            continue
        n = shrink(s, flat, count, n, chosen, kept)
        turn_round(n, s, domains)
        seek(fns, n, s, flat[: count * n].reshape(count, n), work)
        kept = 0
        for j in range(n):
            if s[STATE, j] == FOUND and s[AHEAD, j] <= s[REACH, j]:
                ahead, behind = s[A, j], s[WAY, j] * s[AHEAD, j]
                s[LEAST, j], s[MOST, j] = min(ahead, behind), max(ahead, behind)
                s[A, j], s[B, j] = s[START, j] + s[LEAST, j], s[START, j] + s[MOST, j]
                chosen[kept] = j
                kept += 1
        if kept:
            n = shrink(s, flat, count, n, chosen, kept)
            settle(fns, LIBRATION, n, s, flat, count, chosen, work, t, spare, timed, out, reasons)
