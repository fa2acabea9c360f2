"""Half periods, periods and loop times of many orbits at once, by the trapezoidal rule."""

from math import fabs, inf, nan, pi, sqrt

import numpy as np

from gqm_sym.runtime.compiled.calls import (
    call_agm_arguments_batch,
    call_integrand_invariants_batch,
    call_orbit_invariants_batch,
    call_potential_divdiff1_batch,
    call_potential_divdiff2_batch,
    call_time_integrand_batch,
)
from gqm_sym.runtime.compiled.intrinsics import choose
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.quadrature.time_panels import MIN_CANCELLATION_RATIO
from gqm_sym.runtime.quadrature.trapezoid import (
    CIRCULATION,
    LIBRATION,
    MAX_NODES,
    MIN_INTERVALS,
    NODE_SHARES,
    OFFSETS_FROM_A,
    OFFSETS_TO_B,
    has_converged,
)
from gqm_sym.runtime.sweep.batch.rows import (
    CHANGE,
    HIGH,
    LASTING,
    LEAST,
    LOW,
    MOST,
    SPEED,
    START,
    SUM,
    VALUE,
    WHO,
    A,
    B,
    shrink,
)
from gqm_sym.runtime.sweep.quantities import ANSWERED, PERIOD, UNDECIDED

# Kinds of orbits, beside those that `swift` knows: about an axis of symmetry, by the integral without sines. Of each
# the rows of a batch that the rule needs.
SWING = 2
NEEDED = (START, LASTING, LEAST)

# The sines of that integral, squared: where y is at its largest, and at the axis half a turn later.
FALL, RISE = np.cos(pi * NODE_SHARES) ** 2, np.sin(pi * NODE_SHARES) ** 2

# What becomes of an orbit after a level of the rule.
GOES_ON, SETTLED, LOST = 0.0, 1.0, 2.0


@Inner
def fill(fns, kind, n, node, s, p, work):  # type: ignore[no-untyped-def]
    """The time per share of the orbit at one node of the rule, and the extremes so far of V**2's regular factor."""
    da, db, rates, rows = work[0, :n], work[1, :n], work[2, :n], work[3:6].reshape(-1)
    start, w0, least, most = s[START, :n], s[SPEED, :n], s[LEAST, :n], s[MOST, :n]
    low, high = s[LOW, :n], s[HIGH, :n]
    if kind == LIBRATION:
        from_a, from_b, two = OFFSETS_FROM_A[node], OFFSETS_TO_B[node], rows[: 2 * n].reshape(2, n)
        for j in range(n):
            width = most[j] - least[j]
            da[j], db[j] = width * from_a, width * from_b
        call_potential_divdiff2_batch(fns.potential_divdiff2, n, s[A, :n], s[B, :n], da, db, p, two)
        for j in range(n):
            q = two[0, j]
            rates[j] = pi * two[1, j] / sqrt(q)
            low[j], high[j] = choose(q >= low[j], low[j], q), choose(q > high[j], q, high[j])
    elif kind == SWING:
        two = rows[: 2 * n].reshape(2, n)
        call_time_integrand_batch(fns.time_integrand, n, FALL[node], RISE[node], p, two)
        for j in range(n):
            q = two[1, j]
            rates[j] = pi * sqrt(two[0, j])
            low[j], high[j] = choose(q >= low[j], low[j], q), choose(q > high[j], q, high[j])
    else:
        share, three = NODE_SHARES[node], rows[: 3 * n].reshape(3, n)
        for j in range(n):
            db[j] = least[j] + share * (most[j] - least[j])
            da[j] = start[j] + db[j]
        call_potential_divdiff1_batch(fns.potential_divdiff1, n, start, da, db, p, three)
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
            call_integrand_invariants_batch(fns.integrand_invariants, n, halves, p, rest)
        else:
            call_orbit_invariants_batch(fns.orbit_invariants, n, s[A, :n], s[B, :n], p, rest)
        count += fixed
    for j in range(n):
        s[SUM, j], s[VALUE, j], s[CHANGE, j], s[LOW, j], s[HIGH, j] = 0.0, 0.0, inf, inf, 0.0
    begin, nodes, whole = 0, MIN_INTERVALS, 2.0 if asked == PERIOD and kind != CIRCULATION else 1.0
    last, sides = (MIN_INTERVALS // 2, 2.0) if mirrored else (MIN_INTERVALS, 1.0)
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
                share = 2.0 * ends / MIN_INTERVALS
                for j in range(n):
                    s[VALUE, j] += share * rates[j]
        verdict = work[0, :n]
        for j in range(n):
            s[SUM, j] += more[j]
            value, before = s[SUM, j] / nodes, s[CHANGE, j]
            change = fabs(value - s[VALUE, j]) / value
            s[VALUE, j], s[CHANGE, j] = value, change
            clear = s[LOW, j] > MIN_CANCELLATION_RATIO * s[HIGH, j]
            verdict[j] = choose(clear, choose(has_converged(before, change), SETTLED, GOES_ON), LOST)
        if begin > 0:
            kept = 0
            for j in range(n):  # without branches, for none could be foreseen
                k, done = int(s[WHO, j]), verdict[j] == SETTLED
                out[k, 0] = choose(done, whole * s[VALUE, j], nan)
                reasons[k] = ANSWERED if done else UNDECIDED
                chosen[kept] = j
                kept += verdict[j] == GOES_ON
            if kept == 0 or nodes == MAX_NODES:
                return
            n = shrink(s, flat, count, n, chosen, kept, NEEDED[kind])
        begin, nodes, last = nodes + 1, 2 * nodes, nodes + (nodes // 2 if mirrored else nodes)


# The kind of such orbits, beside those of `swift` and `batch_times`.
MEANS = 3

# From numbers in a ratio of 1 : 10, the root of MIN_CANCELLATION_RATIO, both are the same to half an ulp after so many
# steps
# and one more arithmetic mean: their relative difference is 9e-1, 6e-1, 4e-2, 2e-4, 4e-9, and its square counts.
STEPS = 4


@Inner
def half_periods_by_agm(fns, n, s, flat, count, work, asked, out, reasons):  # type: ignore[no-untyped-def]
    """Half periods, or periods, into the rows of ``out`` that belong to the orbits; none next to a barrier."""
    p, halves, rows = flat[: count * n].reshape(count, n), work[0, :n], work[1:3].reshape(-1)[: 2 * n].reshape(2, n)
    clear, times = work[3, :n], work[4, :n]
    for j in range(n):
        halves[j] = 0.5 * (s[MOST, j] - s[LEAST, j])
    call_agm_arguments_batch(fns.agm_arguments, n, halves, p, rows)
    for j in range(n):
        a, b = rows[0, j], rows[1, j]
        balanced = (b > MIN_CANCELLATION_RATIO * a) & (a > MIN_CANCELLATION_RATIO * b) & (a + b < inf)
        clear[j] = choose(balanced, 1.0, 0.0)
        rows[0, j], rows[1, j] = sqrt(a), sqrt(b)
    for _ in range(STEPS):
        for j in range(n):
            a, b = rows[0, j], rows[1, j]
            rows[0, j], rows[1, j] = 0.5 * (a + b), sqrt(a * b)
    turn = 2.0 * pi if asked != PERIOD else 4.0 * pi
    for j in range(n):
        times[j] = choose(clear[j] == 1.0, turn / (rows[0, j] + rows[1, j]), nan)
    for j in range(n):
        k = int(s[WHO, j])
        out[k, 0] = times[j]
        reasons[k] = ANSWERED if clear[j] == 1.0 else UNDECIDED
