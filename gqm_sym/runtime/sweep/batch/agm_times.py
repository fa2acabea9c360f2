"""Half periods and periods of many orbits about an axis at once, by the arithmetic-geometric mean."""

from math import inf, nan, sqrt

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.compiled.calls import call_agm_arguments_batch
from gqm_sym.runtime.compiled.intrinsics import choose, fma
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.quadrature.time_panels import MIN_CANCELLATION_RATIO
from gqm_sym.runtime.sweep.batch.rows import HALF_REST, INDEX, LAUNCH_V2
from gqm_sym.runtime.sweep.batch.times import MIN_AXIS_RATIO, PI_HIGH, PI_LOW, fill_halves, relative_rests
from gqm_sym.runtime.sweep.quantities import ANSWERED, PERIOD, UNDECIDED

# The number of steps of the arithmetic-geometric mean. For two numbers in the ratio 1 : 10, the square root of
# MIN_CANCELLATION_RATIO, the relative difference becomes 9e-1, 6e-1, 4e-2, 2e-4, 4e-9. One more arithmetic mean is then
# exact to half an ulp, because its error is the square of that.
AGM_STEPS = 4


@Inner
def half_periods_by_agm(fns, orbits, scratch, quantity, answers):  # type: ignore[no-untyped-def]
    """Fill half periods or periods by the arithmetic-geometric mean; orbits next to a separatrix stay undecided."""
    count, n, rows, work = scratch.param_count, orbits.size, orbits.rows, scratch.work
    p, halves = orbits.params[: count * n].reshape(count, n), work[:2].reshape(-1)[: 2 * n]
    pair, clear, times = work[2:4].reshape(-1)[: 2 * n].reshape(2, n), work[4, :n], work[5, :n]
    rests, from_thrown = work[6, :n], MIN_CANCELLATION_RATIO if scratch.careful else MIN_AXIS_RATIO
    fill_halves(n, rows, halves[:n])
    halves[n:] = rows[HALF_REST, :n]
    call_agm_arguments_batch(fns.agm_arguments, n, halves, p, pair)
    for j in range(n):
        a, b = pair[0, j], pair[1, j]
        least = choose(rows[LAUNCH_V2, j] == 0.0, MIN_CANCELLATION_RATIO, from_thrown)
        balanced = (b > least * a) & (a > least * b) & (a + b < inf)
        clear[j] = choose(balanced, 1.0, 0.0)
        pair[0, j], pair[1, j] = sqrt(a), sqrt(b)
    for _ in range(AGM_STEPS):
        for j in range(n):
            a, b = pair[0, j], pair[1, j]
            pair[0, j], pair[1, j] = 0.5 * (a + b), sqrt(a * b)
    factor = 2.0 if quantity != PERIOD else 4.0
    high, low = factor * PI_HIGH, factor * PI_LOW
    relative_rests(orbits.params, scratch.layout[2], rests)
    for j in range(n):
        total, rounding = two_sum(pair[0, j], pair[1, j])
        time = high / total
        rest = (fma(-time, total, high) + fma(-time, rounding, low)) / total
        times[j] = choose(clear[j] == 1.0, time + fma(time, rests[j], rest), nan)
    for j in range(n):
        k = int(rows[INDEX, j])
        answers.values[k, 0] = times[j]
        answers.status[k] = ANSWERED if clear[j] == 1.0 else UNDECIDED
