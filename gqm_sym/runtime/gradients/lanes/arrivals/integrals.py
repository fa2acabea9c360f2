"""The integrals of the time per phase angle, and of its derivatives, between the phases of launches and places."""

from math import fabs

import numpy as np

from gqm_sym.runtime.compiled.intrinsics import choose
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.double_double.arithmetic import UNIT
from gqm_sym.runtime.double_double.interpreter import BLOCK, ROW, call_interpreter
from gqm_sym.runtime.gradients.evaluation import is_significant, rounding_of
from gqm_sym.runtime.gradients.lanes.arrivals.weights import (
    MOST,
    NODES,
    TAIL,
    WAVES,
    fill_tail,
    fill_weights,
    tail_size,
)
from gqm_sym.runtime.gradients.lanes.evaluation import rows_of
from gqm_sym.runtime.quadrature.trapezoid import LIBRATION

# The largest size of the last terms of a series, and the largest change of an integral by the last doubling of the
# number of nodes, as shares of the sums of absolute values; integrals converge geometrically, and faster than terms.
MAX_TERM, MAX_CHANGE = 5e-15, 1e-6

# The largest rounding errors of values at nodes, as a share of the sum of absolute values. These are bounds, which are
# far larger than the errors themselves.
MAX_ROUNDING = 1e-15

# The rows of sums over nodes: with weights; of absolute values, without and with weights; of errors; and the last terms
# of the series.
TOTAL, SIZE, MASS, ERRORS, TERMS, SUMS = 0, 1, 2, 3, 4, 4 + 2 * TAIL

# The rows of the integrals of an orbit: each, and that of absolute values. The states of the quadrature.
VALUE, SCALE, INTEGRALS = range(3)
OPEN, DONE, LOST = range(3)


@Inner
def fold_weights(n, mirrored, lanes, weights):  # type: ignore[no-untyped-def]
    """Add the weights of both nodes of each pair, for orbits that are mirror images of themselves."""
    for j in range(n // 2):
        first, second = weights[j], weights[n - 1 - j]
        for i in range(lanes):
            is_even = mirrored[i] == 1.0
            first[i] += choose(is_even, second[i], 0.0)
            second[i] = choose(is_even, 0.0, second[i])


@Inner
def add_node(program, work, node, factors, lanes, sums):  # type: ignore[no-untyped-def]
    """Add the results at one node to the sums.

    The ``node`` is three rows: the weights, and how often the node counts in terms with even and odd numbers. The
    numbers of the last terms alternate, beginning with an odd one.
    """
    weights, even, odd = node
    for j in range(program[4].size):
        values, _, errors = rows_of(work, program[4][j])
        total, size, mass, error = sums[j, TOTAL], sums[j, SIZE], sums[j, MASS], sums[j, ERRORS]
        for i in range(lanes):
            part = weights[i] * values[i]
            total[i] += part
            mass[i] += fabs(part)
            size[i] += even[i] * fabs(values[i])
            error[i] += even[i] * errors[i]
        for q in range(factors.size):
            term, factor, count = sums[j, TERMS + q], factors[q], odd if q % 2 == 0 else even
            for i in range(lanes):
                term[i] += factor * (count[i] * values[i])


@Inner
def judge(kind, is_first, lanes, sums, found, states):  # type: ignore[no-untyped-def]
    """Take the integrals of a level for orbits for which the quadrature has not converged; return how many are left.

    The terms of a lap may vanish unless their number is a multiple of some other one, so that the last of them are not
    enough.
    """
    left, terms = 0, tail_size(kind)
    for i in range(lanes):
        if states[i] != OPEN:
            continue
        has_converged, is_exact = kind == LIBRATION or not is_first, True
        for j in range(sums.shape[0]):
            size, error = sums[j, SIZE, i], sums[j, ERRORS, i]
            is_exact = is_exact and rounding_of(j, size, error, sums[0, SIZE, i]) <= MAX_ROUNDING
            change, total, mass = sums[j, TOTAL, i] - found[j, VALUE, i], sums[j, TOTAL, i], sums[j, MASS, i]
            if not is_significant(j, size, error):
                found[j, VALUE, i], found[j, SCALE, i] = 0.0, mass
                continue
            for q in range(terms):
                has_converged = has_converged and fabs(sums[j, TERMS + q, i]) <= MAX_TERM * size
            has_converged = has_converged and (kind == LIBRATION or fabs(change) <= MAX_CHANGE * mass)
            found[j, VALUE, i], found[j, SCALE, i] = total, mass
        states[i] = (DONE if has_converged else OPEN) if is_exact else LOST
        left += states[i] == OPEN
    return left


@Inner
def integrate(program, work, rule, lanes, state, spaces, found):  # type: ignore[no-untyped-def]
    """Fill the integrals of all results of a program between the phases of launch and place.

    Parameters
    ----------
    program, work
        The program of the time per phase, whose inputs are filled.
    rule : (int, (4, n) array, (int, int))
        LIBRATION or CIRCULATION; the table of shares (`nodes.trapezoidal_nodes`); the number of nodes to begin with,
        and the largest one (`weights.PASSES`).
    lanes : int
        The number of orbits.
    state : (ROWS, BLOCK) array
        The phases (`weights`).
    spaces : tuple of arrays
        Work space for waves, weights, counts and sums; whether each orbit is a mirror image of itself; and the states
        of the quadrature, which are filled.
    found : (k, INTEGRALS, BLOCK) array
        Filled.
    """
    (kind, nodes, limits), (waves, weights, counts, sums, mirrored, states) = rule, spaces
    (share, rest, error), factors, all_even = rows_of(work, program[3] * ROW), np.zeros(tail_size(kind)), 1.0
    call_interpreter(program[0], program[1], 0, program[2], work, lanes)
    for i in range(lanes):
        all_even = choose(mirrored[i] == 1.0, all_even, 0.0)
    states[:], found[:, :, :] = OPEN, 0.0
    for n in NODES:
        if n < limits[0]:
            continue
        sums[:, :, :] = 0.0
        fill_weights(kind, n, lanes, state, waves, weights)
        fold_weights(n, mirrored, lanes, weights)
        for node in range(n // 2 if all_even == 1.0 else n):
            for i in range(lanes):
                share[i], rest[i], error[i] = nodes[0, n + node], nodes[1, n + node], UNIT * nodes[0, n + node]
                once = choose(mirrored[i] == 1.0, 0.0, 1.0)
                counts[0, i], counts[1, i] = choose(node < n // 2, 2.0 - once, once), once
            call_interpreter(program[0], program[1], program[2], program[1].shape[0], work, lanes)
            fill_tail(kind, n, node, factors)
            add_node(program, work, (weights[node], counts[0], counts[1]), factors, lanes, sums)
        left = judge(kind, n == limits[0], lanes, sums, found, states)
        if left == 0 or n >= limits[1]:
            return


@Inner
def work_space(functions):  # type: ignore[no-untyped-def]
    """Return the work space of `integrate` for so many functions."""
    waves, weights, counts = np.empty((WAVES, BLOCK)), np.empty((MOST, BLOCK)), np.empty((2, BLOCK))
    return waves, weights, counts, np.empty((functions, SUMS, BLOCK)), np.zeros(BLOCK), np.empty(BLOCK, dtype=np.int64)
