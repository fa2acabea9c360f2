"""Integrals over the phase angles of an orbit in double-double arithmetic, with bounds on their errors.

V**2 is the plain difference of effective potentials, because many of the 31 digits may be lost; a bound on the loss is
computed along with it. The nodes are phase angles (MATHS, section 4), whose sines are tabulated.
"""

from math import copysign, fabs, inf, nan
from typing import Any, NamedTuple

import numpy as np
from numba import types

from gqm_sym.runtime.arithmetic.elementary import atan
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import on_stack
from gqm_sym.runtime.compiled.types import INTEGER
from gqm_sym.runtime.double_double.arithmetic import (
    UNIT,
    add,
    divide,
    improved_arc_tangent,
    multiply,
    sine_and_cosine,
    square_root,
)
from gqm_sym.runtime.double_double.interpreter import BLOCK, ERROR, LOW, ROW, call_interpreter
from gqm_sym.runtime.double_double.nodes import LEVELS, RULE
from gqm_sym.runtime.quadrature.trapezoid import LIBRATION

# The trapezoidal rule has converged if two successive changes have shrunk by this factor and the next one would be
# smaller than a share of the value, or if the last change is rounding only and the one before was below the second
# number.
MAX_RATIO, MAX_CHANGE_BEFORE = 1e-3, 1e-20

# A body is slow somewhere, so that the rule would need many nodes, if a change at the level of this number exceeds this
# share of the value.
EARLY_LEVEL, MAX_EARLY_CHANGE = 3, 1e-5

# The number of panels of an interval is doubled from MIN_PANELS to MAX_PANELS at most, until the next change would be
# smaller than a share of the time, or than its rounding.
MIN_PANELS, MAX_PANELS = 2, 128

# The largest factor by which the ratio of successive changes may grow from one doubling to the next.
SAFETY = 16.0

# The type of a tape behind the interpreter's address.
TAPE = types.Tuple((INTEGER, types.int64[:, ::1], types.UniTuple(INTEGER, 3), types.UniTuple(INTEGER, 6)))

stacked_sums = on_stack(ROW)


class Integrand(NamedTuple):
    """The inputs of the time per share of an interval.

    Attributes
    ----------
    tape : Tape
        The module's formulas.
    work : array
        The registers.
    level : (high, low, error)
        U + V**2/2, which is constant.
    start, width : (high, low)
        The start of the interval, and the increase of the curve's parameter over it.
    """

    tape: Any
    work: Any
    level: Any
    start: Any
    width: Any


@Inner
def fill_parameters(tape, p, work):  # type: ignore[no-untyped-def]
    """Fill the registers of the run-time parameters, and of all that does not depend on the place."""
    address, operations, parts, registers = tape
    for k in range(p.shape[1]):
        error = 0.25 * UNIT * fabs(p[0, k]) if p[1, k] != 0.0 else 0.0
        for i in range(BLOCK):
            at = registers[0] + k * ROW + i
            work[at], work[at + LOW], work[at + ERROR] = p[0, k], p[1, k], error
    call_interpreter(address, operations, 0, parts[0], work, BLOCK)


@Inner
def energy_level(work, registers, launch, i):  # type: ignore[no-untyped-def]
    """Return U + V**2/2, which is constant, with its error, from the place of the launch, which is number i."""
    _, _, v0, v0_low = launch
    half, half_low = multiply(v0, v0_low, 0.5 * v0, 0.5 * v0_low)
    u = registers[2] + i
    high, low = add(work[u], work[u + LOW], half, half_low)
    return high, low, work[u + ERROR] + UNIT * half


@Inner
def fill_places(n, start, width, nodes, first, place):  # type: ignore[no-untyped-def]
    """Fill a register with the places of nodes."""
    shares, shares_low = nodes[0, first : first + n], nodes[1, first : first + n]
    for i in range(n):
        distance, distance_low = multiply(width[0], width[1], shares[i], shares_low[i])
        place[i], place[LOW + i] = add(start[0], start[1], distance, distance_low)
        place[ERROR + i] = UNIT * (fabs(place[i]) + fabs(distance))


@Inner
def fill_integrand(n, level, nodes, first, potential, ds, out):  # type: ignore[no-untyped-def]
    """Fill a register with the time per share of the interval, divided by the width of the segment."""
    factor, factor_low = nodes[2, first : first + n], nodes[3, first : first + n]
    for i in range(n):
        half, half_low = add(level[0], level[1], -potential[i], -potential[LOW + i])
        root, root_low = square_root(2.0 * half, 2.0 * half_low)
        g, g_low = multiply(factor[i], factor_low[i], ds[i], ds[LOW + i])
        out[i], out[LOW + i] = divide(g, g_low, root, root_low)
        lost = 0.5 * (level[2] + potential[ERROR + i]) / half
        out[ERROR + i] = out[i] * (ds[ERROR + i] / ds[i] + lost + 8.0 * UNIT)


@Inner
def add_nodes(integrand, nodes, first, stop, total):  # type: ignore[no-untyped-def]
    """Add the integrand at nodes number ``first`` to before ``stop`` to a sum with its error."""
    tape, work, level, start, width = integrand
    address, operations, parts, registers = tape
    _, place, potential, ds, _, _ = registers
    sums = stacked_sums()
    high, low, error = total
    for begin in range(first, stop, BLOCK):
        n = min(BLOCK, stop - begin)
        fill_places(n, start, width, nodes, begin, work[place : place + ROW])
        call_interpreter(address, operations, parts[0], parts[1], work, n)
        fill_integrand(n, level, nodes, begin, work[potential : potential + ROW], work[ds : ds + ROW], sums)
        while n > 1:  # n is a power of two
            n //= 2
            for i in range(n):
                sums[i], sums[LOW + i] = add(sums[i], sums[LOW + i], sums[n + i], sums[LOW + n + i])
                sums[ERROR + i] += sums[ERROR + n + i]
        high, low = add(high, low, sums[0], sums[LOW])
        error += sums[ERROR]
    return high, low, error


@Inner
def mean_by_trapezoid(integrand, nodes, ends, tolerance, gives_up):  # type: ignore[no-untyped-def]
    """Return the mean of the integrand with its error by the trapezoidal rule; NaN if that does not converge, or if it
    converges slowly and ``gives_up`` is true.
    """
    total, before, value, value_low = ends, inf, inf, 0.0
    for level in range(len(LEVELS) - 1):
        n = LEVELS[level + 1]
        total = add_nodes(integrand, nodes, LEVELS[level], n, total)
        high, low, rounding = total[0] / n, total[1] / n, total[2] / n
        change = fabs(add(high, low, -value, -value_low)[0]) if level > 0 else inf
        following = change * change / before
        if change <= MAX_RATIO * before and before < inf and following <= tolerance * high:
            return high, low, rounding + following
        if change <= rounding and before <= MAX_CHANGE_BEFORE * high:
            return high, low, rounding + change
        if gives_up and level == EARLY_LEVEL and not change <= MAX_EARLY_CHANGE * high:
            break
        before, value, value_low = change, high, low
    return nan, nan, nan


@Inner
def fill_panel(kind, left, step, panel, rule, nodes):  # type: ignore[no-untyped-def]
    """Fill the nodes, in the form of `node_tables`, of one of the panels of width ``step`` that follow an angle."""
    for k in range(RULE):
        i = panel * RULE + k
        share, share_low = add(rule[0, k], rule[1, k], float(panel), 0.0)
        angle, angle_low = multiply(step[0], step[1], share, share_low)
        angle, angle_low = add(left[0], left[1], angle, angle_low)
        nodes[0, i], nodes[1, i], nodes[2, i], nodes[3, i] = angle, angle_low, rule[2, k], rule[3, k]
        if kind == LIBRATION:
            s, s_low, c, c_low = sine_and_cosine(0.5 * angle, 0.5 * angle_low)
            nodes[0, i], nodes[1, i] = multiply(s, s_low, s, s_low)
            c, c_low = multiply(c, c_low, rule[2, k], rule[3, k])
            nodes[2, i], nodes[3, i] = multiply(s, s_low, c, c_low)


@Inner
def time_between(integrand, kind, left, right, rule, tolerance):  # type: ignore[no-untyped-def]
    """Return the time from one phase angle to another and its error; NaN if Gauss's rules do not converge to the
    tolerance, which is a relative error.
    """
    width = add(right[0], right[1], -left[0], -left[1])
    scale, scale_low = multiply(width[0], width[1], integrand.width[0], integrand.width[1])
    nodes = np.empty((4, RULE * MAX_PANELS))
    panels, before, before_low, change_before = MIN_PANELS, inf, 0.0, inf
    while panels <= MAX_PANELS:
        step, first = (width[0] / panels, width[1] / panels), LEVELS[0]
        for panel in range(panels):
            fill_panel(kind, left, step, panel, rule, nodes)
        total = add_nodes(integrand, nodes, first, RULE * panels, (0.0, 0.0, 0.0))
        time, low = multiply(scale, scale_low, total[0] / panels, total[1] / panels)
        rounding = fabs(scale) * total[2] / panels + 4.0 * UNIT * fabs(time)
        change = fabs(add(time, low, -before, -before_low)[0])
        ratio = min(1.0, SAFETY * (change / change_before)) if change_before > 0.0 else 1.0
        following = change * ratio
        if following <= max(tolerance * fabs(time), rounding):
            return fabs(time), copysign(low, time * low), rounding + following
        panels, before, before_low, change_before = 2 * panels, time, low, change
    return nan, nan, nan


@Inner
def phase_angle(integrand, kind, behind, behind_low):  # type: ignore[no-untyped-def]
    """Return the phase angle of a place at this distance from the start: 2 atan(sqrt((lam - a)/(b - lam))) between
    turning points a and b, or the share of a lap.
    """
    width = integrand.width
    if kind != LIBRATION:
        return divide(behind, behind_low, width[0], width[1])
    ahead, ahead_low = add(width[0], width[1], -behind, -behind_low)
    ratio, ratio_low = divide(behind, behind_low, ahead, ahead_low)
    root, root_low = square_root(ratio, ratio_low)
    guess = atan(root)
    s, s_low, c, c_low = sine_and_cosine(guess, 0.0)
    half, half_low = improved_arc_tangent(root, root_low, guess, (s, s_low), (c, c_low))
    return 2.0 * half, 2.0 * half_low
