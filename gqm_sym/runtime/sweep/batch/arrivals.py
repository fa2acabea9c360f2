"""First times at places on many librations, by sine series in the phase angle."""

from math import inf, nan

from gqm_sym.runtime.compiled.intrinsics import choose
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import on_stack
from gqm_sym.runtime.compiled.strided import DIRECTION, TARGET, element
from gqm_sym.runtime.quadrature.time_panels import MIN_CANCELLATION_RATIO
from gqm_sym.runtime.quadrature.trapezoid import LIBRATION, NODE_SHARES
from gqm_sym.runtime.sweep.batch.rows import (
    FACTOR_HIGH,
    FACTOR_LOW,
    INDEX,
    LAUNCH_PLACE,
    LAUNCH_V2,
    OFFSET_HIGH,
    OFFSET_LOW,
    TIME_ROWS,
    shrink,
)
from gqm_sym.runtime.sweep.batch.times import add_invariants, fill_integrand_batch
from gqm_sym.runtime.sweep.quantities import ANSWERED, NEVER_THERE, SPAN_KNOWN, UNDECIDED
from gqm_sym.runtime.sweep.single.arrivals import (
    FEW_TERMS,
    MAX_TERMS,
    fill_cosine_series,
    first_passage,
    is_resolved,
    times_by_series,
)

# The rates of one orbit at all nodes, and the series of them.
stacked_rates, stacked_series = on_stack(MAX_TERMS + 8), on_stack(MAX_TERMS + 8)


@Inner
def answer_by_series(rows, j, series, n, columns, answers):  # type: ignore[no-untyped-def]
    """Fill the first time at the place asked for on one orbit, whose series is resolved."""
    k, lam0, low, high = int(rows[INDEX, j]), rows[LAUNCH_PLACE, j], rows[OFFSET_LOW, j], rows[OFFSET_HIGH, j]
    place, time = element(columns, TARGET, k), 0.0
    direction = element(columns, DIRECTION, k)
    if rows[LAUNCH_V2, j] == 0.0:
        direction = 1.0 if -low < high else -1.0
    ahead = place - lam0
    if ahead != 0.0:
        there = lam0 + low <= place <= lam0 + high
        time = first_passage(times_by_series(series, n, low, high, ahead), direction, ahead) if there else nan
    answers.values[k, 0], answers.status[k] = time, ANSWERED if time == time else NEVER_THERE


@Inner
def answer_arrivals(fns, orbits, scratch, answers):  # type: ignore[no-untyped-def]
    """Fill the first times at the places asked for; where a series is not resolved, or V**2 almost vanishes, the answer
    is that to SPANS.
    """
    count, rates, kept = add_invariants(fns, LIBRATION, orbits, scratch), scratch.rates, scratch.chosen
    rows, nodes, series = orbits.rows, stacked_rates(), stacked_series()
    rows[FACTOR_LOW, : orbits.size], rows[FACTOR_HIGH, : orbits.size] = inf, 0.0
    first, terms = 0, FEW_TERMS
    while True:
        n, step = orbits.size, MAX_TERMS // terms
        p = orbits.params[: count * n].reshape(count, n)
        for node in range(first, terms + 1):
            line = int(MAX_TERMS * NODE_SHARES[node])
            rates[line, :n] = fill_integrand_batch(fns, LIBRATION, n, node, rows, p, scratch.work)
        left = 0
        for j in range(n):
            for i in range(terms + 1):
                nodes[i] = rates[i * step, j]
            fill_cosine_series(terms, nodes, series)
            clear = rows[FACTOR_LOW, j] > MIN_CANCELLATION_RATIO * rows[FACTOR_HIGH, j]
            if clear and is_resolved(series, terms):
                answer_by_series(rows, j, series, terms, scratch.columns, answers)
            else:
                kept[left] = j
                left += 1
        if left == 0 or terms == MAX_TERMS:
            break
        orbits = shrink(orbits, count, kept, left, TIME_ROWS)
        for i in range(0, MAX_TERMS + 1, step):
            for j in range(left):
                rates[i, j] = rates[i, kept[j]]
            for j in range(left, orbits.size):
                rates[i, j] = rates[i, left - 1]
        first, terms = terms + 1, 2 * terms
    for i in range(left):
        j = kept[i]
        k, low, high = int(rows[INDEX, j]), rows[OFFSET_LOW, j], rows[OFFSET_HIGH, j]
        answers.values[k, 0], answers.values[k, 1] = low, high
        answers.status[k] = choose(low < high, SPAN_KNOWN, UNDECIDED)
