"""Half periods, periods and loop times of many orbits at once.

They are computed by the trapezoidal rule, or by the arithmetic-geometric mean if the model gives its two arguments.
"""

from math import fabs, inf, nan, sqrt

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.arithmetic.elementary import HALF_PI
from gqm_sym.runtime.compiled.calls import (
    call_integrand_invariants_batch,
    call_orbit_invariants_batch,
    call_potential_divdiff1_batch,
    call_potential_divdiff2_batch,
    call_time_integrand_batch,
)
from gqm_sym.runtime.compiled.intrinsics import choose, fma
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.quadrature.time_panels import MIN_CANCELLATION_RATIO
from gqm_sym.runtime.quadrature.trapezoid import (
    CIRCULATION,
    COSINES_SQUARED,
    LIBRATION,
    MAX_CHANGE_BEFORE,
    MAX_NODES,
    MIN_INTERVALS,
    NODE_SHARES,
    OFFSETS_FROM_A,
    OFFSETS_TO_B,
    SINES_SQUARED,
    has_converged,
)
from gqm_sym.runtime.sweep.batch.exact_nodes import CHECKED, fill_exact_integrand, load_block
from gqm_sym.runtime.sweep.batch.rows import (
    AXIS_LIBRATION_ROWS,
    CHANGE,
    CHECK_HIGH,
    CHECK_LOW,
    END_HIGH,
    END_LOW,
    FACTOR_AT_TURN,
    FACTOR_HIGH,
    FACTOR_LOW,
    HALF_REST,
    HALF_WIDTH,
    INDEX,
    LACKING,
    LAUNCH_PLACE,
    LAUNCH_V2,
    OFFSET_HIGH,
    OFFSET_LOW,
    REST,
    ROWS,
    SUM,
    TIME_ROWS,
    VALUE,
    append,
    contains,
    has_tape,
    shrink,
)
from gqm_sym.runtime.sweep.batch.wide_orbits import replace_on_wide_orbits
from gqm_sym.runtime.sweep.quantities import ANSWERED, PERIOD, UNDECIDED

# Kinds of orbits in addition to those of `trapezoid`. Both are librations about an axis of symmetry: one with a time
# integrand that needs no sines, the other with a half period of pi over an arithmetic-geometric mean.
AXIS_LIBRATION, AGM_LIBRATION = 2, 3

# For each kind except the last, the number of rows of a batch that the trapezoidal rule needs.
NEEDED_ROWS = (TIME_ROWS, TIME_ROWS, AXIS_LIBRATION_ROWS)

# The number of nodes at which the integrand is also found in double-double arithmetic. What it lacks in doubles is so
# small that few digits of the mean of that are enough.
EXACT_NODES = 4 * MIN_INTERVALS

# Pi as two doubles.
PI_HIGH, PI_LOW = 2.0 * HALF_PI[0], 2.0 * HALF_PI[1]

# The verdict on an orbit after a level of the rule.
CONTINUES, CONVERGED, FAILED = 0.0, 1.0, 2.0

# The ratio of the smallest to the largest regular factor of V**2 above which roundings do not matter, for librations in
# wells that are not even and for laps; and that of the factor at turning points which are rounded. Those of a launch
# from rest are exact where it starts, and both are in an even well.
MIN_RATIO, MIN_LAP_RATIO, MIN_TURN_RATIO, MIN_EVEN_RATIO, MIN_AXIS_RATIO = 0.15, 0.1, 0.4, 0.5, 0.9

# The same for librations whose integrand is corrected by values from double-double arithmetic.
MIN_EXACT_RATIO = 0.03

# The largest relative error of V**2 in doubles where it is checked.
MAX_FACTOR_ERROR = 3.0 * 2.0**-53


@Inner
def contains_nan(row):  # type: ignore[no-untyped-def]
    """Return whether a number in a row is NaN."""
    found = False
    for v in row:
        found |= v != v
    return found


@Inner
def fill_integrand_batch(fns, kind, n, node, rows, p, work):  # type: ignore[no-untyped-def]
    """Fill the time integrand of each orbit at one node of the rule, in doubles.

    The rows for the smallest and the largest regular factor of V**2 are updated.
    """
    da, db, rates, out = work[0, :n], work[1, :n], work[2, :n], work[3:6].reshape(-1)
    start, w0, offset_low, offset_high = (
        rows[LAUNCH_PLACE, :n],
        rows[LAUNCH_V2, :n],
        rows[OFFSET_LOW, :n],
        rows[OFFSET_HIGH, :n],
    )
    low, high = rows[FACTOR_LOW, :n], rows[FACTOR_HIGH, :n]
    if kind == LIBRATION:
        from_a, from_b, two = OFFSETS_FROM_A[node], OFFSETS_TO_B[node], out[: 2 * n].reshape(2, n)
        for j in range(n):
            width = offset_high[j] - offset_low[j]
            da[j], db[j] = width * from_a, width * from_b
        a, b = rows[END_LOW, :n], rows[END_HIGH, :n]
        call_potential_divdiff2_batch(fns.potential_divdiff2, n, a, b, da, db, p, two)
        if contains_nan(two[0]):
            replace_on_wide_orbits(fns, n, node, rows, p, two, work)
        for j in range(n):
            q = two[0, j]
            rates[j] = two[1, j] / sqrt(2.0 * q)
            low[j], high[j] = choose(q >= low[j], low[j], q), choose(q > high[j], q, high[j])
    elif kind == AXIS_LIBRATION:
        two = out[: 2 * n].reshape(2, n)
        call_time_integrand_batch(fns.time_integrand, n, COSINES_SQUARED[node], SINES_SQUARED[node], p, two)
        for j in range(n):
            q = two[1, j]
            rates[j] = sqrt(two[0, j])
            low[j], high[j] = choose(q >= low[j], low[j], q), choose(q > high[j], q, high[j])
    else:
        share, three = NODE_SHARES[node], out[: 3 * n].reshape(3, n)
        for j in range(n):
            db[j] = offset_low[j] + share * (offset_high[j] - offset_low[j])
            da[j] = start[j] + db[j]
        call_potential_divdiff1_batch(fns.potential_divdiff1, n, start, da, db, p, three)
        for j in range(n):
            lost = 2.0 * db[j] * three[0, j]
            rates[j] = (offset_high[j] - offset_low[j]) * three[1, j] / sqrt(w0[j] - lost)
            q = (w0[j] - lost) / (w0[j] + fabs(lost))
            low[j], high[j] = choose(q >= low[j], low[j], q), 1.0
    return rates


@Inner
def fill_halves(n, rows, halves):  # type: ignore[no-untyped-def]
    """Fill half of each orbit's width."""
    for j in range(n):
        known = rows[HALF_WIDTH, j]
        halves[j] = choose(known == known, known, 0.5 * (rows[OFFSET_HIGH, j] - rows[OFFSET_LOW, j]))


@Inner
def add_invariants(fns, kind, orbits, scratch):  # type: ignore[no-untyped-def]
    """Append the terms that are constant along an orbit to the rows of parameters; return the new number of rows."""
    count, n, rows, params = scratch.param_count, orbits.size, orbits.rows, orbits.params
    more = 0 if kind == CIRCULATION else scratch.layout[kind // AXIS_LIBRATION]
    if more:
        p, pairs = params[: count * n].reshape(count, n), scratch.work[:2].reshape(-1)[: 2 * n]
        halves, middles, rests = pairs[:n], scratch.work[2, :n], scratch.work[3, :n]
        invariants = params[count * n : (count + more) * n].reshape(more, n)
        fill_halves(n, rows, halves)
        if kind == AXIS_LIBRATION:
            pairs[n:] = rows[HALF_REST, :n]
            call_integrand_invariants_batch(fns.integrand_invariants, n, pairs, p, invariants)
        else:
            for j in range(n):
                total, lost = two_sum(rows[OFFSET_LOW, j], rows[OFFSET_HIGH, j])
                middles[j], rounding = two_sum(rows[LAUNCH_PLACE, j], 0.5 * total)
                rests[j] = rounding + 0.5 * lost
            a, b = rows[END_LOW, :n], rows[END_HIGH, :n]
            call_orbit_invariants_batch(fns.orbit_invariants, n, a, b, middles, rests, halves, p, invariants)
    return count + more


@Inner
def keep_factor_at_turn(rule, n, node, rows, factors):  # type: ignore[no-untyped-def]
    """Keep the smallest factor of V**2 at turning points that are rounded: all but those at which a body is released.

    The ``rule`` is that of `times_by_trapezoid`, and the node is its first or its last one.
    """
    kind, mirrored, _ = rule
    if mirrored and node == 0:
        for j in range(n):
            rest, offset = rows[LAUNCH_V2, j] == 0.0, rows[OFFSET_LOW, j] + rows[OFFSET_HIGH, j]
            _, rounding = two_sum(rows[LAUNCH_PLACE, j], offset)
            exact = rest & ((kind == AXIS_LIBRATION) | (rounding == 0.0))
            rows[FACTOR_AT_TURN, j] = choose(exact, inf, rows[FACTOR_LOW, j])
    elif kind == LIBRATION:
        offset = OFFSET_LOW if node == 0 else OFFSET_HIGH
        for j in range(n):
            exact = (rows[LAUNCH_V2, j] == 0.0) & (rows[offset, j] == 0.0)
            factor, known = choose(exact, inf, factors[j]), rows[FACTOR_AT_TURN, j]
            rows[FACTOR_AT_TURN, j] = choose(factor < known, factor, known)


@Inner
def refuse_rough_factors(n, rows, check, factors, rests):  # type: ignore[no-untyped-def]
    """Let the smallest factor of V**2 be negative where a factor differs from that in the row ``check``.

    What the rounding of the inertia changes is left out, because times are corrected by it. ``rests`` are those of
    `relative_rests`.
    """
    low, exact = rows[FACTOR_LOW, :n], rows[check, :n]
    for j in range(n):
        lost = (factors[j] - exact[j]) - 2.0 * rests[j] * factors[j]
        rough = fabs(lost) > MAX_FACTOR_ERROR * exact[j]  # false for NaN
        low[j] = choose(rough, -1.0, low[j])


@Inner
def least_ratios(rule, with_tape):  # type: ignore[no-untyped-def]
    """Return the ratios of `judge_level` for a rule of `times_by_trapezoid`."""
    kind, mirrored, exactly = rule
    if with_tape and kind != CIRCULATION:
        least = MIN_CANCELLATION_RATIO if kind == AXIS_LIBRATION else MIN_EXACT_RATIO if exactly else MIN_RATIO
        return least, least, 0.0
    from_rest = MIN_RATIO if kind == LIBRATION else MIN_CANCELLATION_RATIO
    thrown = MIN_CANCELLATION_RATIO if mirrored else MIN_LAP_RATIO if kind == CIRCULATION else MIN_RATIO
    at_turns = MIN_AXIS_RATIO if kind == AXIS_LIBRATION else MIN_EVEN_RATIO if mirrored else MIN_TURN_RATIO
    return from_rest, thrown, at_turns


@Inner
def judge_level(rows, n, nodes, ratios, verdict):  # type: ignore[no-untyped-def]
    """Set the mean of each orbit's integrand by a level of the rule, and the verdict on it.

    ``ratios`` are the smallest ratios of factors that doubles permit, for a launch from rest, for another one, and at
    turning points in even wells.
    """
    from_rest, thrown, at_turns = ratios
    for j in range(n):
        value, before = rows[SUM, j] / nodes, rows[CHANGE, j]
        change = fabs(value - rows[VALUE, j]) / value
        rows[VALUE, j], rows[CHANGE, j] = value, change
        high, at_turn = rows[FACTOR_HIGH, j], rows[FACTOR_AT_TURN, j]
        least = choose(rows[LAUNCH_V2, j] == 0.0, from_rest, thrown)
        clear = (rows[FACTOR_LOW, j] > least * high) & (at_turn > at_turns * high)
        settled = has_converged(before, change, MAX_CHANGE_BEFORE)
        verdict[j] = choose(clear, choose(settled, CONVERGED, CONTINUES), FAILED)


@Inner
def relative_rests(params, row, rests):  # type: ignore[no-untyped-def]
    """Fill the changes of half periods, as shares of them, if the inertia 1 + beta is not rounded.

    Its rounding is common to all nodes and, for the same beta, to all orbits. ``row`` is that of beta; if it is
    negative, the changes are zero.
    """
    rests[:] = 0.0
    if row >= 0:
        for j in range(rests.size):
            total, rounding = two_sum(1.0, params[row * rests.size + j])
            rests[j] = 0.5 * rounding / total


@Inner
def set_times(rows, nodes, ranges, rests, times):  # type: ignore[no-untyped-def]
    """Set times from the means of the integrand, with one rounding.

    ``ranges`` is the range of the phase angle, or 1 for laps, as two doubles.
    """
    (high, low), corrected = ranges, min(nodes, EXACT_NODES)
    for j in range(times.size):
        mean = rows[VALUE, j]
        rest = mean * (low + high * rests[j]) + high * (rows[REST, j] / nodes + rows[LACKING, j] / corrected)
        times[j] = fma(mean, high, rest)


@Inner
def answer_level(rows, times, verdict, chosen, answers):  # type: ignore[no-untyped-def]
    """Fill the answers of orbits that have converged and list those that continue; return the number of the latter."""
    out, status, number = answers.values, answers.status, 0
    for j in range(times.size):  # there are no branches, because they would be unpredictable
        k, done = int(rows[INDEX, j]), verdict[j] == CONVERGED
        out[k, 0] = choose(done, times[j], nan)
        status[k] = ANSWERED if done else UNDECIDED
        chosen[number] = j
        number += verdict[j] == CONTINUES
    return number


@Inner
def fill_rates(fns, kind, n, node, rows, params, count, scratch):  # type: ignore[no-untyped-def]
    """Fill the time integrand of each orbit at one node of the rule, and check it."""
    rates = fill_integrand_batch(fns, kind, n, node, rows, params[: count * n].reshape(count, n), scratch.work)
    if kind == LIBRATION and node in CHECKED:
        rests = scratch.work[0, :n]
        relative_rests(params, scratch.layout[2], rests)
        refuse_rough_factors(n, rows, CHECK_LOW if node == CHECKED[0] else CHECK_HIGH, scratch.work[3, :n], rests)
    return rates


@Inner
def add_what_rates_lack(rows, node, weight, rates, scratch):  # type: ignore[no-untyped-def]
    """Add what the integrand lacks at a node to its sum; where that is not known, the smallest factor of V**2 becomes
    negative.
    """
    exact, lacking, low = scratch.work[8, : rates.size], rows[LACKING, : rates.size], rows[FACTOR_LOW, : rates.size]
    fill_exact_integrand(scratch.exact, node, rows, scratch.others, exact)
    for j in range(rates.size):
        known = exact[j] == exact[j]
        lacking[j] += weight * choose(known, exact[j] - rates[j], 0.0)
        low[j] = choose(known, low[j], -1.0)


@Inner
def start_sums(n, rows):  # type: ignore[no-untyped-def]
    """Set the rows of sums and extremes over nodes to those of no nodes."""
    for j in range(n):
        rows[SUM, j], rows[REST, j], rows[VALUE, j], rows[CHANGE, j], rows[LACKING, j] = 0.0, 0.0, 0.0, inf, 0.0
        rows[FACTOR_LOW, j], rows[FACTOR_HIGH, j] = inf, 0.0
        rows[FACTOR_AT_TURN, j] = inf


@Inner
def move_rough(orbits, scratch, rough):  # type: ignore[no-untyped-def]
    """Append orbits to ``rough`` for which double-double arithmetic may do what doubles have failed to, and list those
    that continue, by the verdicts in the first row of work space; return the number of the latter.
    """
    n, rows, verdict, continuing, moved = orbits.size, orbits.rows, scratch.work[0], 0, 0
    for j in range(n):
        low, failed = rows[FACTOR_LOW, j], verdict[j] == FAILED
        scratch.chosen[continuing] = scratch.others[moved] = j
        continuing += not failed
        usable = (low < 0.0) | (low > MIN_EXACT_RATIO * rows[FACTOR_HIGH, j])
        moved += failed & usable & (j == 0 or rows[INDEX, j] != rows[INDEX, j - 1])
    append(orbits, scratch.param_count, scratch.others, moved, rough)
    return continuing


@Inner
def times_by_trapezoid(fns, rule, orbits, rough, scratch, quantity, answers):  # type: ignore[no-untyped-def]
    """Fill half periods, periods or loop times by the trapezoidal rule.

    The number of nodes is doubled until the rule has converged. Orbits for which it has are removed, as are those on
    which V**2 almost vanishes. On orbits that are ``mirrored`` only nodes up to the middle are evaluated.
    Times are corrected ``exactly`` by the integrand in double-double arithmetic at the first nodes; the orbits are then
    a block at most. Otherwise orbits for which the first nodes show that they need this are moved to ``rough``, unless
    it has no rows. The ``rule`` is the kind of the orbits and whether they are mirrored and times are corrected.
    """
    kind, mirrored, exactly = rule
    count = add_invariants(fns, kind, orbits, scratch)
    n, rows, work, chosen = orbits.size, orbits.rows, scratch.work, scratch.chosen
    start_sums(n, rows)
    begin, nodes, factor = 0, MIN_INTERVALS, 2.0 if quantity == PERIOD else 1.0
    ranges = (1.0, 0.0) if kind == CIRCULATION else (factor * PI_HIGH, factor * PI_LOW)
    ratios = least_ratios(rule, has_tape(scratch))
    last, sides = (MIN_INTERVALS // 2, 2.0) if mirrored else (MIN_INTERVALS, 1.0)
    while True:
        more, lost = work[6, :n], work[7, :n]
        more[:] = lost[:] = 0.0
        corrected = exactly and nodes <= EXACT_NODES
        if corrected:
            load_block(scratch.exact, scratch.param_count, orbits, scratch.others)
        for node in range(begin, last + 1):
            rates = fill_rates(fns, kind, n, node, rows, orbits.params, count, scratch)
            if begin == 0 and node in (0, last):
                keep_factor_at_turn(rule, n, node, rows, work[3, :n])
            weight = 0.5 * sides if node == 0 or (node == last and begin == 0) else sides
            if corrected:
                add_what_rates_lack(rows, node, weight, rates, scratch)
            for j in range(n):  # Kahan's compensated summation
                term = weight * rates[j] - lost[j]
                total = more[j] + term
                more[j], lost[j] = total, (total - more[j]) - term
            if begin == 0 and node % 2 == 0:  # every other node gives a time for a first change
                share = 2.0 * weight / MIN_INTERVALS
                for j in range(n):
                    rows[VALUE, j] += share * rates[j]
        for j in range(n):
            total, rounding = two_sum(rows[SUM, j], more[j])
            rows[SUM, j], rows[REST, j] = total, rows[REST, j] + (rounding - lost[j])
        judge_level(rows, n, nodes, ratios, work[0, :n])
        if begin == 0 and rough.rows.size and contains(work[0, :n], FAILED):
            continuing = move_rough(orbits, scratch, rough)
            if continuing == 0:
                return
            orbits = shrink(orbits, count, chosen, continuing, ROWS)
            n = orbits.size
        if begin > 0:
            rests, times = work[1, :n], work[2, :n]
            # The inertia of the integrand in double-double arithmetic is not rounded.
            rounded = kind != CIRCULATION and not exactly
            relative_rests(orbits.params, scratch.layout[2] if rounded else -1, rests)
            set_times(rows, nodes, ranges, rests, times)
            continuing = answer_level(rows, times, work[0, :n], chosen, answers)
            if continuing == 0 or nodes == MAX_NODES:
                return
            orbits = shrink(orbits, count, chosen, continuing, ROWS if exactly else NEEDED_ROWS[kind])
            n = orbits.size
        begin, nodes, last = nodes + 1, 2 * nodes, nodes + (nodes // 2 if mirrored else nodes)
