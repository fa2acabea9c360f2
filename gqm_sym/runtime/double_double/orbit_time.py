"""Half periods and lap times in double-double arithmetic by the trapezoidal rule, with turning points and a bound.

V**2 is the plain difference of effective potentials, because many of the 31 digits may be lost; a bound on the loss is
computed along with it. The nodes are phase angles (MATHS, section 4), whose sines are tabulated.
"""

from math import copysign, fabs, inf, nan
from typing import Any, NamedTuple

import numpy as np
from numba import types

from gqm_sym.literals.numbers import Number
from gqm_sym.runtime.arithmetic.elementary import HALF_PI, atan
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.registers import borrowed, on_stack
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, REAL, VECTOR, Array
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
from gqm_sym.runtime.double_double.nodes import LEVELS, RULE, panel_rule, trapezoidal_nodes
from gqm_sym.runtime.double_double.recording import BoundTape
from gqm_sym.runtime.quadrature.trapezoid import CIRCULATION, LIBRATION

# The trapezoidal rule has converged if two successive changes have shrunk by this factor and the next one would be
# smaller than a share of the value, which is the second number if all digits are wanted, or if the last change is
# rounding only and the one before was below the third number.
MAX_RATIO, MAX_NEXT_CHANGE, MAX_CHANGE_BEFORE = 1e-3, 1e-27, 1e-20

# The number of places that are evaluated together at the ends: both turning points, the launch, and the launch again to
# fill a register.
ENDS = 8

# The number of panels of an interval is doubled from MIN_PANELS to MAX_PANELS at most, until the next change would be
# smaller than this share of the time, or than its rounding.
MIN_PANELS, MAX_PANELS, MAX_PANEL_CHANGE = 2, 128, 1e-24

# The largest relative error of a time; a less accurate one is not used.
MAX_ERROR = 1e-17

# The number of Newton iterations, each of which doubles the digits, starting with those of a double. A step may be at
# most this share of the orbit's width.
NEWTON_STEPS, MAX_STEP = 2, 1e-6

# Types of what compiled functions take: a tape behind the interpreter's address, a number with its error, and an orbit.
TAPE = types.Tuple((INTEGER, types.int64[:, ::1], types.UniTuple(INTEGER, 3), types.UniTuple(INTEGER, 6)))
BOUNDED = types.UniTuple(REAL, 3)
LEVEL_AND_INTERVAL = types.Tuple((BOUNDED, types.UniTuple(REAL, 2), types.UniTuple(REAL, 2)))

stacked_sums = on_stack(ROW)
NO_TIMES = np.empty((3, 0))


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


class BoundedNumber(NamedTuple):
    """A number as two doubles, with a bound on its error."""

    high: float
    low: float
    error: float

    @property
    def is_decided(self) -> bool:
        """Whether ``high`` is certainly the double nearest to the number."""
        return self.high + (self.low - self.error) == self.high == self.high + (self.low + self.error)


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
def find_turns(tape, work, launch, offsets):  # type: ignore[no-untyped-def]
    """Find both turning points by Newton's method from the doubles next to them.

    They are left in the register of places, and the values of the formulas there in the other registers.

    Returns
    -------
    level : (high, low, error)
        The energy level. Its error includes a bound on half V**2 at the turning points.
    errors : (float, float)
        Bounds on the errors of the turning points.
    """
    address, operations, parts, registers = tape
    _, place, potential, _, slope, _ = registers
    lam0, lam0_low = launch[0], launch[1]
    for i in range(ENDS):
        work[place + i], work[place + LOW + i] = add(lam0, lam0_low, offsets[i] if i < 2 else 0.0, 0.0)
    level, step, residual = (0.0, 0.0, 0.0), np.zeros(2), np.zeros(2)
    for _ in range(NEWTON_STEPS):
        for i in range(ENDS):
            work[place + ERROR + i] = 0.25 * UNIT * fabs(work[place + i])
        call_interpreter(address, operations, parts[0], parts[2], work, ENDS)
        level = energy_level(work, registers, launch, 2)
        for i in range(2):
            u, at, up = potential + i, place + i, slope + i
            half, half_low = add(level[0], level[1], -work[u], -work[u + LOW])
            move, move_low = divide(half, half_low, work[up], work[up + LOW])
            work[at], work[at + LOW] = add(work[at], work[at + LOW], move, move_low)
            # Each step reduces V**2 by the square of the ratio of the steps.
            ratio = fabs(move) / step[i] if step[i] > 0.0 else 0.0
            if not fabs(move) <= MAX_STEP * fabs(offsets[1] - offsets[0]):
                ratio = nan
            step[i], residual[i] = fabs(move), fabs(half) * ratio * ratio + level[2] + work[u + ERROR]
    errors = residual[0] / fabs(work[slope]), residual[1] / fabs(work[slope + 1])
    return (level[0], level[1], level[2] + residual[0] + residual[1]), errors


@Inner
def mean_at_ends(work, registers, width):  # type: ignore[no-untyped-def]
    """Return the mean of the integrand at both turning points, with its error."""
    _, _, _, ds, slope, _ = registers
    high, low, error = 0.0, 0.0, 0.0
    for i in range(2):
        up, on = slope + i, ds + i
        q, q_low = multiply(work[up], work[up + LOW], 2.0 * width[0], 2.0 * width[1])
        sign = 1.0 if i == 1 else -1.0
        root, root_low = square_root(sign * q, sign * q_low)
        g, g_low = divide(0.5 * work[on], 0.5 * work[on + LOW], root, root_low)
        high, low = add(high, low, g, g_low)
        error += g * (work[on + ERROR] / work[on] + 0.5 * work[up + ERROR] / fabs(work[up]) + 8.0 * UNIT)
    return high, low, error


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
def mean_by_trapezoid(integrand, nodes, ends, tolerance):  # type: ignore[no-untyped-def]
    """Return the mean of the integrand with its error by the trapezoidal rule; NaN if that does not converge."""
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
def time_between(integrand, kind, left, right, rule):  # type: ignore[no-untyped-def]
    """Return the time from one phase angle to another and its error; NaN if Gauss's rules do not converge."""
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
        following = min(change, change * (change / change_before)) if change_before > 0.0 else change
        if following <= max(MAX_PANEL_CHANGE * fabs(time), rounding):
            return fabs(time), copysign(low, time * low), rounding + following
        panels, before, before_low, change_before = 2 * panels, time, low, change
    return nan, nan, nan


@Inner
def launch_angle(integrand, launch):  # type: ignore[no-untyped-def]
    """Return the phase angle of the launch, 2 atan(sqrt((lam0 - a)/(b - lam0))) between turning points a and b."""
    start, width = integrand.start, integrand.width
    behind, behind_low = add(launch[0], launch[1], -start[0], -start[1])
    ahead, ahead_low = add(width[0], width[1], -behind, -behind_low)
    ratio, ratio_low = divide(behind, behind_low, ahead, ahead_low)
    root, root_low = square_root(ratio, ratio_low)
    guess = atan(root)
    s, s_low, c, c_low = sine_and_cosine(guess, 0.0)
    half, half_low = improved_arc_tangent(root, root_low, guess, (s, s_low), (c, c_low))
    return 2.0 * half, 2.0 * half_low


@entry(
    REAL(TAPE, VECTOR, MATRIX, types.UniTuple(REAL, 4), INTEGER, LEVEL_AND_INTERVAL, MATRIX, MATRIX),
    checked=False,
)
def fill_times(tape, work, p, launch, kind, orbit, rule, times):  # type: ignore[no-untyped-def]
    """Fill the times at phase angles of an orbit.

    Parameters
    ----------
    tape, work, p, launch
        As for `orbit_time`.
    kind : int
        LIBRATION or CIRCULATION.
    orbit : (level, start, width)
        As in `Integrand`, from `orbit_time`.
    rule : (4, n) array
        The nodes of panels (`nodes.legendre_rule`).
    times : (3, n) array
        The first row has phase angles, in ascending order from the second on. The others are filled with the time from
        the lower turning point, or from the launch of a lap, as two doubles. The first column is that of the launch,
        whose angle is computed unless zero is given.

    Returns
    -------
    float
        A bound on the error of the times.
    """
    work, p, rule, times = borrowed(work), borrowed(p), borrowed(rule), borrowed(times)
    address, operations, parts, registers = tape
    tape = (address, borrowed(operations), parts, registers)
    fill_parameters(tape, p, work)
    integrand = Integrand(tape, work, *orbit)
    angle, last_angle, high, low, error, of_launch = (0.0, 0.0), (0.0, 0.0), 0.0, 0.0, 0.0, 0.0
    times[1, 0], times[2, 0] = 0.0, 0.0
    is_thrown = times[0, 0] != 0.0
    thrown_at = launch_angle(integrand, launch) if is_thrown else angle
    for k in range(1, times.shape[1] + 1):
        is_last = k == times.shape[1]
        if is_thrown and (is_last or thrown_at[0] < times[0, k]):
            part, part_low, of_part = time_between(integrand, kind, last_angle, thrown_at, rule)
            times[1, 0], times[2, 0] = add(high, low, part, part_low)
            is_thrown, of_launch = False, error + of_part
        if not is_last:
            # The upper turning point is at the angle pi itself.
            angle = (times[0, k], 2.0 * HALF_PI[1] if times[0, k] == 2.0 * HALF_PI[0] else 0.0)
            part, part_low, of_part = time_between(integrand, kind, last_angle, angle, rule)
            high, low = add(high, low, part, part_low)
            times[1, k], times[2, k], last_angle, error = high, low, angle, error + of_part
    return max(error, of_launch)


@Inner
def find_orbit_time(tape, work, p, launch, offsets, direction, nodes, tolerance):  # type: ignore[no-untyped-def]
    """Return the duration and the turning points of an orbit, which are NaN if they are not found.

    Parameters
    ----------
    tape : (address, operations, parts, registers)
        The address of the interpreter, and the module's formulas (`recording.Tape`).
    work : array
        The registers, of which those of constants are filled.
    p : (2, n) array
        Run-time parameters as two doubles each.
    launch : (lam0, lam0_low, v0, v0_low)
        Launch place and speed in m/s as two doubles each.
    offsets : (float, float)
        Approximate distances of the lower and the upper turning point from the launch.
    direction : int
        0 for a libration, else the sign of ds/dt on a lap.
    nodes : (4, n) array
        The nodes of the trapezoidal rule (`nodes.trapezoidal_nodes`), or none if the duration is not wanted.
    tolerance : float
        The relative error of the trapezoidal rule that is small enough.

    Returns
    -------
    duration, low, high : (high, low, error)
        Half period or lap time, and both turning points, as two doubles each with a bound on the error.
    orbit : (level, start, width)
        The arguments of `fill_times` that describe the orbit.
    """
    address, operations, parts, registers = tape
    fill_parameters(tape, p, work)
    _, place, _, _, _, period = registers
    if direction == 0:
        level, errors = find_turns(tape, work, launch, offsets)
        start, end = (work[place], work[place + LOW]), (work[place + 1], work[place + LOW + 1])
        width = add(end[0], end[1], -start[0], -start[1])
        ends = mean_at_ends(work, registers, width)
        scale = multiply(width[0], width[1], 2.0 * HALF_PI[0], 2.0 * HALF_PI[1])
    else:
        for i in range(ENDS):
            at = place + i
            work[at], work[at + LOW], work[at + ERROR] = launch[0], launch[1], 0.25 * UNIT * fabs(launch[0])
        call_interpreter(address, operations, parts[0], parts[1], work, ENDS)
        level, errors, ends = energy_level(work, registers, launch, 2), (0.0, 0.0), (0.0, 0.0, 0.0)
        start, end, scale = (launch[0], launch[1]), (launch[0], launch[1]), (work[period], work[period + LOW])
        width = (direction * scale[0], direction * scale[1])
    mean = (nan, nan, nan)
    if nodes.shape[1] > 0:
        mean = mean_by_trapezoid(Integrand(tape, work, level, start, width), nodes, ends, tolerance)
    high, low = multiply(mean[0], mean[1], scale[0], scale[1])
    duration = (high, low, scale[0] * mean[2] + 4.0 * UNIT * high)
    low_error, high_error = errors[0] + UNIT * fabs(start[0]), errors[1] + UNIT * fabs(end[0])
    return duration, (start[0], start[1], low_error), (end[0], end[1], high_error), (level, start, width)


@entry(
    types.Tuple((BOUNDED, BOUNDED, BOUNDED, LEVEL_AND_INTERVAL))(
        TAPE, VECTOR, MATRIX, types.UniTuple(REAL, 4), types.UniTuple(REAL, 2), INTEGER, MATRIX
    ),
    checked=False,
)
def orbit_time(tape, work, p, launch, offsets, direction, nodes):  # type: ignore[no-untyped-def]
    """Return what `find_orbit_time` returns."""
    address, operations, parts, registers = tape
    tape = (address, borrowed(operations), parts, registers)
    work, p, nodes = borrowed(work), borrowed(p), borrowed(nodes)
    return find_orbit_time(tape, work, p, launch, offsets, direction, nodes, MAX_NEXT_CHANGE)


class Orbit(NamedTuple):
    """The properties of an orbit in double-double arithmetic.

    Attributes
    ----------
    duration : BoundedNumber
        Half period or lap time in s.
    low, high : BoundedNumber
        The turning points of a libration.
    """

    duration: BoundedNumber
    low: BoundedNumber
    high: BoundedNumber


def find_turning_points(
    formulas: BoundTape, launch: tuple[Number, Number], offsets: tuple[float, float]
) -> tuple[BoundedNumber, BoundedNumber]:
    """Return the lower and the upper turning point of a libration; the arguments are those of `time_orbit`."""
    lam0, v0 = launch
    given = *formulas.operands, (lam0.value, lam0.low, v0.value, v0.low), (-offsets[0], offsets[1])
    _, low, high, _ = orbit_time(*given, 0, np.ascontiguousarray(trapezoidal_nodes(LIBRATION)[:, :0]))
    return BoundedNumber(*low), BoundedNumber(*high)


def time_orbit(
    formulas: BoundTape,
    launch: tuple[Number, Number],
    direction: int,
    offsets: tuple[float, float],
    times: Array = NO_TIMES,
) -> Orbit | None:
    """Return duration and turning points of an orbit; None if double-double arithmetic does not suffice.

    Parameters
    ----------
    formulas : BoundTape
        The formulas of the curve and its forces.
    launch : (Number, Number)
        Launch place, and speed in m/s.
    direction : int
        0 for a libration, else the sign of ds/dt on a lap.
    offsets : (float, float)
        The distances of the lower and the upper turning point from the launch, to the accuracy of doubles.
    times : (3, n) array
        Phase angles, and room for the times there (`fill_times`). If there are any besides that of the launch, they are
        the edges of panels up to the end of the orbit, and the duration is found by panels, not by the trapezoidal
        rule.
    """
    lam0, v0 = launch
    kind, by_panels = CIRCULATION if direction else LIBRATION, times.shape[1] > 1
    nodes = trapezoidal_nodes(kind)[:, :0] if by_panels else trapezoidal_nodes(kind)
    given = *formulas.operands, (lam0.value, lam0.low, v0.value, v0.low)
    *found, orbit = orbit_time(*given, (-offsets[0], offsets[1]), direction, np.ascontiguousarray(nodes))
    duration, low, high = map(BoundedNumber._make, found)
    if times.size:
        error = fill_times(*given, kind, orbit, panel_rule(), times)
        duration = BoundedNumber(float(times[1, -1]), float(times[2, -1]), error) if by_panels else duration
        if np.isnan(times).any():
            return None
    return Orbit(duration, low, high) if duration.error <= MAX_ERROR * duration.high else None
