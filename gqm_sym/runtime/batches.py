"""Turning points and times of many orbits at once, an orbit in each lane of a vector register.

Orbits for which `batch_search` proves no turning points, or whose time does not converge, are left to `swift`, which
takes them one by one. Columns of a batch are whole registers: the last orbit is repeated to fill one.
"""

from math import fabs, inf, nan, pi, sqrt

import numpy as np
from numba import types

from gqm_sym.runtime.batch_search import (
    AHEAD,
    AXIS,
    BACK,
    CHANGE,
    CLOSED,
    FOUND,
    HIGH,
    LASTING,
    LEAST,
    LOW,
    MOST,
    NOWHERE,
    REACH,
    ROWS,
    SPEED,
    START,
    STATE,
    STEP,
    SUM,
    TRIAL,
    VALUE,
    WAY,
    WHO,
    A,
    B,
    any_is,
    launch,
    prove,
    seek,
    turn_round,
)
from gqm_sym.runtime.columns import DIRECTION, FIRST, LAM0, PARAMETERS, V0, fill_row
from gqm_sym.runtime.crossing import call_bend_each, call_orbit_each, call_rise_each, call_swing_each, call_top_each
from gqm_sym.runtime.fused import choose
from gqm_sym.runtime.jit import Inner, entry
from gqm_sym.runtime.swift import (
    CIRCULATION,
    DONE,
    FEWEST,
    FROM_A,
    FROM_B,
    HARD,
    LEAST_BALANCE,
    LIBRATION,
    MOST_NODES,
    PASSING,
    PLACES,
    SHARES,
    WHOLE,
    settled,
)

# Orbits of a batch: its arrays stay in the first-level cache. Orbits of a full register, at most.
BATCH, LANES = 128, 8
# Pieces of an orbit, or of half a mirrored one, for its proof: a few first, more where those do not suffice.
FEW_PIECES, FEW_OF_HALF, MANY_PIECES = 3, 2, 12
# Roundings by which the middle of an orbit may miss the axis that makes it its own mirror image.
ROUNDINGS = 8.0 * 2.0**-52
# An orbit about one axis that reaches its neighbours, twice a step apart, is at rest there.
NEIGHBOURING = 1.999
# Kinds of orbits, beside those that `swift` knows: about an axis of symmetry, by the integral without sines. Of each
# the rows of a batch that the rule needs.
SWING = 2
NEEDED = (START, LASTING, LEAST)
# The sines of that integral, squared: where y is at its largest, and at the axis half a turn later.
FALL, RISE = np.cos(pi * SHARES) ** 2, np.sin(pi * SHARES) ** 2
# What becomes of an orbit after a level of the rule.
GOES_ON, SETTLED, LOST = 0.0, 1.0, 2.0


@Inner
def gather(s, p, count, n, chosen, kept, t, q, rows):  # type: ignore[no-untyped-def]
    """Copy ``chosen`` columns, ``kept`` of them, and their parameters; returns how many columns that fills."""
    full = -(-kept // LANES) * LANES
    for row in range(rows):
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
def shrink(s, p, count, n, chosen, kept, rows):  # type: ignore[no-untyped-def]
    """Close up to the ``kept`` columns that are ``chosen``, in ascending order; returns how many columns are left."""
    return n if kept == n else gather(s, p, count, n, chosen, kept, s, p, rows)


@Inner
def part(state, found, others):  # type: ignore[no-untyped-def]
    """List the columns whose state is FOUND, and the others; returns how many there are of each."""
    if not any_is(state, NOWHERE):
        for j in range(state.size):
            found[j] = j
        return state.size, 0
    kept, left = 0, 0
    for j in range(state.size):
        found[kept] = others[left] = j
        kept += state[j] == FOUND
        left += state[j] != FOUND
    return kept, left


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
    elif kind == SWING:
        two = rows[: 2 * n].reshape(2, n)
        call_swing_each(fns[4], n, FALL[node], RISE[node], p, two)
        for j in range(n):
            q = two[1, j]
            rates[j] = pi * sqrt(two[0, j])
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
def times(fns, kind, mirrored, n, s, flat, count, held, chosen, work, asked, out, reasons):  # type: ignore[no-untyped-def]
    """Half periods, periods or loop times by the trapezoidal rule, into the rows of ``out`` that belong to the orbits.

    Nodes are doubled until the rule has settled. Orbits for which it has drop out, and those whose V**2 all but
    vanishes. Of orbits that are ``mirrored`` only nodes up to the middle are looked at.
    """
    fixed = 0 if kind == CIRCULATION else held[kind // SWING]
    if fixed:
        p, halves = flat[: count * n].reshape(count, n), work[0, :n]
        rest = flat[count * n : (count + fixed) * n].reshape(fixed, n)
        if kind == SWING:
            for j in range(n):
                halves[j] = 0.5 * (s[MOST, j] - s[LEAST, j])
            call_top_each(fns[5], n, halves, p, rest)
        else:
            call_orbit_each(fns[3], n, s[A, :n], s[B, :n], p, rest)
        count += fixed
    for j in range(n):
        s[SUM, j], s[VALUE, j], s[CHANGE, j], s[LOW, j], s[HIGH, j] = 0.0, 0.0, inf, inf, 0.0
    begin, nodes, whole = 0, FEWEST, 2.0 if asked == WHOLE and kind != CIRCULATION else 1.0
    last, sides = (FEWEST // 2, 2.0) if mirrored else (FEWEST, 1.0)
    while True:
        p, more, lost = flat[: count * n].reshape(count, n), work[6, :n], work[7, :n]
        more[:] = lost[:] = 0.0
        for node in range(begin, last + 1):
            rates = fill(fns, kind, n, node, s, p, work)
            ends = 0.5 * sides if node == 0 or (node == last and begin == 0) else sides
            for j in range(n):  # a sum that keeps what it rounds off
                term = ends * rates[j] - lost[j]
                total = more[j] + term
                more[j], lost[j] = total, (total - more[j]) - term
            if begin == 0 and node % 2 == 0:  # half of the nodes, for a first change
                share = 2.0 * ends / FEWEST
                for j in range(n):
                    s[VALUE, j] += share * rates[j]
        verdict = work[0, :n]
        for j in range(n):
            s[SUM, j] += more[j]
            value, before = s[SUM, j] / nodes, s[CHANGE, j]
            change = fabs(value - s[VALUE, j]) / value
            s[VALUE, j], s[CHANGE, j] = value, change
            clear = s[LOW, j] > LEAST_BALANCE * s[HIGH, j]
            verdict[j] = choose(clear, choose(settled(before, change), SETTLED, GOES_ON), LOST)
        if begin > 0:
            kept = 0
            for j in range(n):  # without branches, for none could be foreseen
                k, done = int(s[WHO, j]), verdict[j] == SETTLED
                out[k, 0] = choose(done, whole * s[VALUE, j], nan)
                reasons[k] = DONE if done else HARD
                chosen[kept] = j
                kept += verdict[j] == GOES_ON
            if kept == 0 or nodes == MOST_NODES:
                return
            n = shrink(s, flat, count, n, chosen, kept, NEEDED[kind])
        begin, nodes, last = nodes + 1, 2 * nodes, nodes + (nodes // 2 if mirrored else nodes)


@Inner
def settle(fns, kind, mirrored, known, n, s, flat, t, spare, count, held, chosen, others, work, asked, out, reasons):  # type: ignore[no-untyped-def]
    """Prove orbits of one kind that are not ``known``, and answer for those that are proved.

    ``t`` and ``spare`` take the others meanwhile.
    """
    for pieces in (FEW_OF_HALF if mirrored else FEW_PIECES, MANY_PIECES):
        proved, left = n, 0
        if not known:
            prove(fns, kind, mirrored, pieces, n, s, flat[: count * n].reshape(count, n), work)
            proved, left = part(s[STATE, :n], chosen, others)
        rest = gather(s, flat, count, n, others, left, t, spare, ROWS)
        m = shrink(s, flat, count, n, chosen, proved, LASTING)
        if asked != WHOLE and kind == CIRCULATION:
            for j in range(m):
                reasons[int(s[WHO, j])] = PASSING
        elif asked == PLACES:
            for j in range(m):
                k = int(s[WHO, j])
                out[k, 0], out[k, 1], reasons[k] = s[A, j], s[B, j], DONE
        elif m:
            times(fns, kind, mirrored, m, s, flat, count, held, chosen, work, asked, out, reasons)
        if left == 0:
            return
        n, s, flat, t, spare = rest, t, spare, s, flat


@entry(
    types.void(
        *(
            types.UniTuple(types.int64, 6),
            types.UniTuple(types.int64, 2),
            types.int64[:, ::1],
            types.boolean,
            types.int64,
        ),
        *(types.float64[:, ::1], types.int8[::1]),
    ),
    nogil=True,
)
def answer_batches(fns, held, columns, monotone, asked, out, reasons):  # type: ignore[no-untyped-def]
    """Fill rows of ``out`` and of ``reasons`` for the launches that this can answer, as `swift.answer_many` does.

    The others keep their reason. ``monotone`` says that V**2 rises or falls all the way between axes of symmetry and
    that ds is nowhere 0; ``asked`` is HALF, WHOLE or PLACES.
    """
    count = columns.shape[0] - PARAMETERS
    rows = count + max(held[0], held[1])
    s, t, u = np.empty((ROWS, BATCH)), np.empty((ROWS, BATCH)), np.empty((ROWS, BATCH))
    flat, spare, other = np.empty(rows * BATCH), np.empty(rows * BATCH), np.empty(rows * BATCH)
    known, work = np.empty((PARAMETERS - FIRST, BATCH)), np.empty((13, BATCH))
    chosen, others = np.empty(BATCH, dtype=np.int64), np.empty(BATCH, dtype=np.int64)
    for begin in range(0, reasons.size, BATCH):
        m = min(BATCH, reasons.size - begin)
        n = -(-m // LANES) * LANES
        p = flat[: count * n].reshape(count, n)
        for row in range(PARAMETERS - FIRST):
            if begin == 0 or columns[FIRST + row, 1] != 0:
                fill_row(columns, FIRST + row, begin, m, known[row, :n])
        who, start, speed, way, total = s[WHO, :n], s[START, :n], s[SPEED, :n], s[WAY, :n], work[0, :n]
        fill_row(columns, LAM0, begin, m, start)
        fill_row(columns, V0, begin, m, speed)
        fill_row(columns, DIRECTION, begin, m, way)
        for j in range(n):
            who[j], total[j] = begin + min(j, m - 1), start[j] + speed[j]
            speed[j] *= speed[j]
        for row in range(count):
            given = p[row]
            fill_row(columns, PARAMETERS + row, begin, m, given)
            for j in range(n):
                total[j] += given[j]
        for j in range(n):
            way[j] = choose(total[j] - total[j] == 0.0, way[j], 0.0)
        laps = 0
        for ahead in (True, False):
            p = flat[: count * n].reshape(count, n)
            if ahead:
                launch(fns, n, s, p, known, monotone, work)
            else:
                turn_round(n, s)
            seek(fns, n, s, p, work)
            judge(n, s)
            if ahead and any_is(s[TRIAL, :n], FOUND):
                laps, _rest = part(s[TRIAL, :n], others, chosen)
                laps = gather(s, flat, count, n, others, laps, u, other, ROWS)
            kept, _rest = part(s[STATE, :n], chosen, others)
            n = shrink(s, flat, count, n, chosen, kept, ROWS)
            if n == 0:
                break
        set_ends(n, s)
        mirrored, alone = not any_is(s[STATE, :n], NOWHERE), not any_is(s[TRIAL, :n], NOWHERE)
        about_one = SWING if mirrored and alone and fns[4] else LIBRATION
        for j in range(laps):
            lap = u[WAY, j] * u[REACH, j]
            u[LEAST, j], u[MOST, j] = min(lap, 0.0), max(lap, 0.0)
        for kind in (about_one, CIRCULATION):
            if kind == CIRCULATION:
                n, s, flat, u, other, mirrored = laps, u, other, s, flat, False
            if n:
                settle(
                    fns,
                    kind,
                    mirrored,
                    monotone and mirrored and alone,
                    n,
                    s,
                    flat,
                    t,
                    spare,
                    count,
                    held,
                    chosen,
                    others,
                    work,
                    asked,
                    out,
                    reasons,
                )
