"""Half periods and lap times in double-double arithmetic, with turning points and bounds on the errors.

The time is found by the trapezoidal rule (`quadrature`), or in parts where the body is slow (`slow_passages`).
"""

from math import fabs, nan
from typing import NamedTuple

import numpy as np
from numba import types

from gqm_sym.literals.numbers import Number
from gqm_sym.runtime.arithmetic.elementary import HALF_PI
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.registers import borrowed
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, REAL, VECTOR, Array
from gqm_sym.runtime.double_double.arithmetic import UNIT, add, divide, multiply, square_root
from gqm_sym.runtime.double_double.interpreter import ERROR, LOW, call_interpreter
from gqm_sym.runtime.double_double.nodes import panel_rule, powers, trapezoidal_nodes
from gqm_sym.runtime.double_double.quadrature import (
    TAPE,
    Integrand,
    energy_level,
    fill_parameters,
    mean_by_trapezoid,
    phase_angle,
    time_between,
)
from gqm_sym.runtime.double_double.recording import BoundTape
from gqm_sym.runtime.double_double.slow_passages import time_in_parts
from gqm_sym.runtime.quadrature.trapezoid import CIRCULATION, LIBRATION

# The number of places that are evaluated together at the ends: both turning points, the launch, and the launch again to
# fill a register.
ENDS = 8

# The largest relative error of a time; a less accurate one is not used.
MAX_ERROR = 1e-17

# The relative errors of the trapezoidal rule and of Gauss's rules that are small enough if all digits are wanted.
MAX_RULE_ERROR, MAX_PANEL_ERROR = 1e-27, 1e-24

# The number of Newton iterations, each of which doubles the digits, starting with those of a double, of which few are
# right next to a hilltop. They may move a turning point by at most this share of the orbit's width.
MAX_STEPS, MAX_STEP = 6, 1e-6

# Types of what compiled functions take: a number with its error, and an orbit.
BOUNDED = types.UniTuple(REAL, 3)
LEVEL_AND_INTERVAL = types.Tuple((BOUNDED, types.UniTuple(REAL, 2), types.UniTuple(REAL, 2)))

NO_TIMES = np.empty((3, 0))


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
    level, moved, residual = (0.0, 0.0, 0.0), np.zeros(2), np.zeros(2)
    for _ in range(MAX_STEPS):
        for i in range(ENDS):
            work[place + ERROR + i] = 0.25 * UNIT * fabs(work[place + i])
        call_interpreter(address, operations, parts[0], parts[2], work, ENDS)
        level, has_converged = energy_level(work, registers, launch, 2), True
        for i in range(2):
            u, at, up = potential + i, place + i, slope + i
            half, half_low = add(level[0], level[1], -work[u], -work[u + LOW])
            move, move_low = divide(half, half_low, work[up], work[up + LOW])
            work[at], work[at + LOW] = add(work[at], work[at + LOW], move, move_low)
            moved[i] += move
            rounding = level[2] + work[u + ERROR]
            has_converged = has_converged and fabs(half) <= rounding
            residual[i] = rounding + fabs(half)
            if offsets[i] == 0.0 and launch[2] == 0.0:  # the launch itself, which is exact up to its own rounding
                residual[i] = 0.25 * UNIT * fabs(lam0 * work[up]) if lam0_low != 0.0 else 0.0
            if not fabs(moved[i]) <= MAX_STEP * fabs(offsets[1] - offsets[0]):
                residual[i] = nan
        if has_converged:  # the other formulas are then known at the turning points themselves
            break
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
    behind, behind_low = add(launch[0], launch[1], -integrand.start[0], -integrand.start[1])
    thrown_at = phase_angle(integrand, LIBRATION, behind, behind_low) if is_thrown else angle
    for k in range(1, times.shape[1] + 1):
        is_last = k == times.shape[1]
        if is_thrown and (is_last or thrown_at[0] < times[0, k]):
            part, part_low, of_part = time_between(integrand, kind, last_angle, thrown_at, rule, MAX_PANEL_ERROR)
            times[1, 0], times[2, 0] = add(high, low, part, part_low)
            is_thrown, of_launch = False, error + of_part
        if not is_last:
            # The upper turning point is at the angle pi itself.
            angle = (times[0, k], 2.0 * HALF_PI[1] if times[0, k] == 2.0 * HALF_PI[0] else 0.0)
            part, part_low, of_part = time_between(integrand, kind, last_angle, angle, rule, MAX_PANEL_ERROR)
            high, low = add(high, low, part, part_low)
            times[1, k], times[2, k], last_angle, error = high, low, angle, error + of_part
    return max(error, of_launch)


@Inner
def find_orbit_time(tape, work, p, launch, offsets, direction, rules, tolerance):  # type: ignore[no-untyped-def]
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
    rules : (array, array, array)
        The nodes of the trapezoidal rule (`nodes.trapezoidal_nodes`), or none if the duration is not wanted; the nodes
        of panels (`nodes.panel_rule`); and what finds polynomials (`nodes.powers`).
    tolerance : (float, float)
        The relative errors of the trapezoidal rule and of Gauss's rules that are small enough.

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
    integrand, nodes, duration = Integrand(tape, work, level, start, width), rules[0], (nan, nan, nan)
    kind = CIRCULATION if direction else LIBRATION
    for attempt in range(3 if nodes.shape[1] > 0 else 0):
        if attempt == 1:
            duration = time_in_parts(integrand, kind, errors, rules[1:], tolerance[1])
        else:
            mean = mean_by_trapezoid(integrand, nodes, ends, tolerance[0], attempt == 0)
            high, low = multiply(mean[0], mean[1], scale[0], scale[1])
            duration = (high, low, scale[0] * mean[2] + 4.0 * UNIT * high)
        if duration[2] <= MAX_ERROR * duration[0]:
            break
    low_error, high_error = errors[0] + UNIT * fabs(start[0]), errors[1] + UNIT * fabs(end[0])
    return duration, (start[0], start[1], low_error), (end[0], end[1], high_error), (level, start, width)


@entry(
    types.Tuple((BOUNDED, BOUNDED, BOUNDED, LEVEL_AND_INTERVAL))(
        TAPE, VECTOR, MATRIX, types.UniTuple(REAL, 4), types.UniTuple(REAL, 2), INTEGER, types.UniTuple(MATRIX, 3)
    ),
    checked=False,
)
def orbit_time(tape, work, p, launch, offsets, direction, rules):  # type: ignore[no-untyped-def]
    """Return what `find_orbit_time` returns."""
    address, operations, parts, registers = tape
    tape = (address, borrowed(operations), parts, registers)
    work, p, rules = borrowed(work), borrowed(p), (borrowed(rules[0]), borrowed(rules[1]), borrowed(rules[2]))
    return find_orbit_time(tape, work, p, launch, offsets, direction, rules, (MAX_RULE_ERROR, MAX_PANEL_ERROR))


def rules_for(kind: int, *, wanted: bool = True) -> tuple[Array, Array, Array]:
    """Return the rules of `find_orbit_time` for a kind of orbit, with or without those of its duration."""
    nodes = trapezoidal_nodes(kind)
    return nodes if wanted else np.ascontiguousarray(nodes[:, :0]), panel_rule(), powers()


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
    _, low, high, _ = orbit_time(*given, 0, rules_for(LIBRATION, wanted=False))
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
    given = *formulas.operands, (lam0.value, lam0.low, v0.value, v0.low)
    *found, orbit = orbit_time(*given, (-offsets[0], offsets[1]), direction, rules_for(kind, wanted=not by_panels))
    duration, low, high = map(BoundedNumber._make, found)
    if times.size:
        error = fill_times(*given, kind, orbit, panel_rule(), times)
        duration = BoundedNumber(float(times[1, -1]), float(times[2, -1]), error) if by_panels else duration
        if np.isnan(times).any():
            return None
    return Orbit(duration, low, high) if duration.error <= MAX_ERROR * duration.high else None
