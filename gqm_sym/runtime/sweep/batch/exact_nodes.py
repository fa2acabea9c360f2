"""V**2 of many orbits at the nodes of the trapezoidal rule in double-double arithmetic, from the module's formulas.

There V**2 is a plain difference of effective potentials, because half of the digits may be lost. A place is given by
its distance from the nearer turning point.
"""

from math import fabs, nan, sqrt

from gqm_sym.runtime.compiled.intrinsics import choose
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.double_double.arithmetic import UNIT, add, multiply
from gqm_sym.runtime.double_double.interpreter import BLOCK, ERROR, LOW, ROW, call_interpreter
from gqm_sym.runtime.quadrature.trapezoid import MIN_INTERVALS, NODE_SHARES, OFFSETS_FROM_A, OFFSETS_TO_B
from gqm_sym.runtime.sweep.batch.rows import (
    CHECK_HIGH,
    CHECK_LOW,
    LACK_HIGH,
    LACK_LOW,
    LAUNCH_PLACE,
    LEVEL,
    LEVEL_REST,
    OFFSET_HIGH,
    OFFSET_LOW,
)

# The nodes at which V**2 in doubles is checked: those a quarter and three quarters of the way in phase. Errors of
# turning points, and of what all nodes of an orbit have in common, seldom cancel at both.
CHECKED = (MIN_INTERVALS // 4, 3 * MIN_INTERVALS // 4)

# The number of roundings of the divided difference of V**2 above which it is checked, by the estimate of
# `find_exact_ends`. On curves of the corpus no more than 1 % of times need a check below it.
MIN_ROUGHNESS = 12.0

# The largest relative error of V**2, bounded by the errors of the formulas.
MAX_V2_ERROR = 2.0**-55


@Inner
def load_parameters(exact, count, orbits, columns, size):  # type: ignore[no-untyped-def]
    """Fill the registers of the parameters of some orbits, a block at most, and of all that depends on these alone."""
    (address, operations, parts, registers), work, p = exact
    params, n = orbits.params, orbits.size
    for k in range(count):
        for i in range(size):
            register = registers[0] + k * ROW + i
            work[register], work[register + LOW] = params[k * n + columns[i]], p[1, k]
    call_interpreter(address, operations, 0, parts[0], work, size)


@Inner
def load_block(exact, count, orbits, columns):  # type: ignore[no-untyped-def]
    """Load the parameters of all orbits, which are a block at most, and list them in ``columns``."""
    for j in range(orbits.size):
        columns[j] = j
    load_parameters(exact, count, orbits, columns, orbits.size)


@Inner
def fill_factors(exact, rows, columns, size, node, factors):  # type: ignore[no-untyped-def]
    """Fill the regular factor of V**2 of some orbits at a node, a block at most; NaN where its error is too large.

    The parameters of these orbits must be loaded. The register of ds is filled too.
    """
    (address, operations, parts, registers), work, _ = exact
    _, at, u, _, slope, _ = registers
    below = NODE_SHARES[node] <= 0.5
    share, end = (OFFSETS_FROM_A[node], OFFSET_LOW) if below else (-OFFSETS_TO_B[node], OFFSET_HIGH)
    lack = LACK_LOW if below else LACK_HIGH
    for i in range(size):
        j = columns[i]
        low, high = (rows[OFFSET_LOW, j], rows[LACK_LOW, j]), (rows[OFFSET_HIGH, j], rows[LACK_HIGH, j])
        width, width_low = add(high[0], high[1], -low[0], -low[1])
        moved, moved_low = multiply(width, width_low, share, 0.0)
        offset, offset_low = add(rows[end, j], rows[lack, j], moved, moved_low)
        work[at + i], work[at + LOW + i] = add(rows[LAUNCH_PLACE, j], 0.0, offset, offset_low)
        factors[i] = width
    if share == 0.0:
        call_interpreter(address, operations, parts[0], parts[2], work, size)
        sign = -1.0 if below else 1.0
        for i in range(size):
            up = sign * work[slope + i]
            factors[i] = choose(work[slope + ERROR + i] <= MAX_V2_ERROR * up, up / factors[i], nan)
        return
    call_interpreter(address, operations, parts[0], parts[1], work, size)
    for i in range(size):
        level, level_low = rows[LEVEL, columns[i]], rows[LEVEL_REST, columns[i]]
        half, _ = add(level, level_low, -work[u + i], -work[u + LOW + i])
        width, near = factors[i], factors[i] * fabs(share)
        error = 2.0 * work[u + ERROR + i] + UNIT * (fabs(level) + fabs(work[u + i]))
        factors[i] = choose(error <= MAX_V2_ERROR * half, half / (near * (width - near)), nan)


@Inner
def fill_checks(exact, count, orbits, buffers, columns):  # type: ignore[no-untyped-def]
    """Fill the rows by which V**2 in doubles is checked, for orbits on which it may be off by several roundings.

    The ends of the orbits must be known as two doubles each. ``buffers`` are those of `find_exact_ends`.
    """
    leave_unchecked(orbits)
    rough, factors, j = buffers[0], buffers[1], 0
    while j < orbits.size:
        size = 0
        while j < orbits.size and size < BLOCK:
            columns[size] = j
            size += rough[j] > MIN_ROUGHNESS
            j += 1
        if size:
            load_parameters(exact, count, orbits, columns, size)
            for k in range(2):
                fill_factors(exact, orbits.rows, columns, size, CHECKED[k], factors)
                for i in range(size):
                    orbits.rows[CHECK_LOW + k, columns[i]] = factors[i]


@Inner
def leave_unchecked(orbits):  # type: ignore[no-untyped-def]
    """Let V**2 in doubles not be checked."""
    rows = orbits.rows
    for j in range(orbits.size):
        rows[CHECK_LOW, j] = rows[CHECK_HIGH, j] = nan


@Inner
def fill_exact_integrand(exact, node, rows, columns, rates):  # type: ignore[no-untyped-def]
    """Fill the time integrand of each orbit at one node of the rule; they are a block at most, and are loaded."""
    n, ds = rates.size, exact.tape[3][3]
    fill_factors(exact, rows, columns, n, node, rates)
    for j in range(n):
        rates[j] = exact.work[ds + j] / sqrt(2.0 * rates[j])
