"""The time along a chart in double-double arithmetic, with a bound on its error.

V**2 is the plain difference of effective potentials, as for curves with formulas. The time is integrated piece by piece
(`pieces`) by Gauss-Legendre rules. Near a turning point the rules' nodes are spread by ``u = c + y**2``, so that
``y/V`` is smooth. Here c is the zero of V**2, or on a later piece the place at which V**2 would vanish if the force
were constant.
"""

from math import fabs, nan, sqrt

import numpy as np

from gqm_sym.runtime.charts.double_double.pieces import (
    squared_rate,
    stacked_places,
    stacked_points,
)
from gqm_sym.runtime.charts.double_double.potential import energy_at, fill_potential, position
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import on_stack
from gqm_sym.runtime.double_double.arithmetic import UNIT, add, divide, multiply, square_root
from gqm_sym.runtime.double_double.interpreter import ERROR, LOW, ROW
from gqm_sym.runtime.double_double.nodes import RULE

# A panel is resolved if its last two Legendre coefficients are below this share of the first: the error of the rule is
# about the square of that. Other panels are halved, at most this many times.
MAX_TAIL, MAX_HALVINGS = 1e-13, 40

# The largest ratio of the values of y at both ends of a panel after a turning point on another piece; a power of 2.
MAX_RATIO = 2.0

# The nodes on a piece are spread for a turning point if that is nearer than so many lengths of the piece.
MAX_NEAR = 4.0

# On a panel that begins at a turning point, a bound on the change of the force relative to the mean change over the
# distance from there.
MAX_FORCE_RATIO = 4.0

stacked_sums = on_stack(3 * RULE)


@Inner
def fill_places(curve, left, width, spread, u, factors):  # type: ignore[no-untyped-def]
    """Fill the places of a panel's nodes, and the factors (two doubles each) of the integrand there.

    ``spread`` is (sign, origin, origin_low). If the sign is 0, the panel is an interval of u; else it is one of y, with
    u = origin + sign*y**2.
    """
    rule, (sign, origin, origin_low) = curve.rule, spread
    for i in range(RULE):
        angle, angle_low = multiply(width[0], width[1], rule[0, i], rule[1, i])
        u[i], u[RULE + i] = add(left[0], left[1], angle, angle_low)
        factors[i], factors[RULE + i] = rule[2, i], rule[3, i]
    if sign != 0.0:
        for i in range(RULE):
            y, y_low = u[i], u[RULE + i]
            factors[i], factors[RULE + i] = multiply(2.0 * y, 2.0 * y_low, factors[i], factors[RULE + i])
            square, square_low = multiply(y, y_low, y, y_low)
            u[i], u[RULE + i] = add(origin, origin_low, sign * square, sign * square_low)


@Inner
def panel_time(path, number, left, right, spread):  # type: ignore[no-untyped-def]
    """Return the time on a panel of a piece, its error, and its last Legendre coefficients as a share of the first.

    Where the panel begins at a turning point, V**2/2 is q*d at the distance d from there. An error e of the level moves
    the turning point by e/q. At the same distance from the turning point, V**2 then changes only as much as the force
    changes over the shift.
    """
    curve, tape, work, level = path
    u, points, factors, sums = stacked_places(), stacked_points(), stacked_places(), stacked_sums()
    width = add(right[0], right[1], -left[0], -left[1])
    fill_places(curve, left, width, spread, u, factors)
    _, rate_error = fill_potential(path, number, RULE, u, points, tape[2][1])
    potential = work[tape[3][2] : tape[3][2] + ROW]
    from_turn, q, shift, rate = spread[0] != 0.0 and left[0] == 0.0, 1.0, level[3], 0.0
    for i in range(RULE):
        half, half_low = add(level[0], level[1], -potential[i], -potential[LOW + i])
        s, s_low = squared_rate(curve, points, i)
        t, t_low = divide(0.5 * s, 0.5 * s_low, half, half_low)
        t, t_low = square_root(t, t_low)
        rate = t
        if from_turn:
            d = (width[0] * curve.rule[0, i]) ** 2
            q = half / d if i == 0 else q
            shift = level[3] * MAX_FORCE_RATIO * fabs(1.0 - half / (q * d))
        g, g_low = multiply(t, t_low, factors[i], factors[RULE + i])
        sums[i], sums[RULE + i] = g, g_low
        lost = 0.5 * (level[2] + shift + potential[ERROR + i]) / half + 2.0 * rate_error / sqrt(s)
        sums[2 * RULE + i] = fabs(g) * (lost + 16.0 * UNIT)
    one, two, tails = 0.0, 0.0, curve.tails
    for i in range(RULE):
        one += tails[0, i] * sums[i]
        two += tails[1, i] * sums[i]
    n = RULE
    while n > 1:
        n //= 2
        for i in range(n):
            sums[i], sums[RULE + i] = add(sums[i], sums[RULE + i], sums[n + i], sums[RULE + n + i])
            sums[2 * RULE + i] += sums[2 * RULE + n + i]
    time = multiply(sums[0], sums[RULE], width[0], width[1])
    error = fabs(width[0]) * sums[2 * RULE] + (level[3] / q * rate if from_turn else 0.0)
    return time, error, (fabs(one) + fabs(two)) / fabs(sums[0])


@Inner
def time_by_panels(path, number, left, right, spread):  # type: ignore[no-untyped-def]
    """Return the time between two places of a piece with its error, by panels that are halved until they are resolved.

    After a turning point very near the edge of another piece, the integrand has terms in 1/y**2 if the curvature jumps
    at that edge. The values of y at the ends of a panel must not differ too much, because its nodes would miss these
    terms.
    """
    ends = np.empty((2 * MAX_HALVINGS + 1, 2))
    ends[0, 0], ends[0, 1] = right
    pending, high, low, error = 1, 0.0, 0.0, 0.0
    while spread[0] != 0.0 and ends[pending - 1, 0] > MAX_RATIO * left[0] > 0.0 and pending <= MAX_HALVINGS:
        ends[pending, 0], ends[pending, 1] = ends[pending - 1, 0] / MAX_RATIO, ends[pending - 1, 1] / MAX_RATIO
        pending += 1
    while pending > 0:
        right = ends[pending - 1, 0], ends[pending - 1, 1]
        time, rounding, tail = panel_time(path, number, left, right, spread)
        if tail != tail:
            return (nan, nan), nan
        if tail <= MAX_TAIL or tail * fabs(time[0]) <= 4.0 * rounding:
            high, low = add(high, low, time[0], time[1])
            error += rounding + tail * tail * fabs(time[0])
            left, pending = right, pending - 1
        elif pending > 2 * MAX_HALVINGS:
            return (nan, nan), nan
        else:
            half = add(left[0], left[1], right[0], right[1])
            ends[pending, 0], ends[pending, 1] = 0.5 * half[0], 0.5 * half[1]
            pending += 1
    return (high, low), error


@Inner
def root_of_gap(one, other):  # type: ignore[no-untyped-def]
    """Return the square root of the distance between two places of a piece."""
    gap, gap_low = add(one[0], one[1], -other[0], -other[1])
    sign = -1.0 if gap < 0.0 else 1.0
    return square_root(sign * gap, sign * gap_low) if gap != 0.0 else (0.0, 0.0)


@Inner
def time_on_piece(path, number, low, high, turn, inward):  # type: ignore[no-untyped-def]
    """Return the time from one place of a piece to a higher one, with its error.

    ``turn`` is the nearest turning point (piece, place), which lies below if ``inward`` is 1 and above if it is -1; it
    is 0 if there is none.
    """
    spread = (0.0, 0.0, 0.0)
    near, far = (low, high) if inward >= 0 else (high, low)
    sign = float(inward)
    if inward != 0 and turn[0] == number:
        spread = (sign, turn[1], turn[2])
    elif inward != 0:
        here, there = position(path.curve, number, near[0]), position(path.curve, number, far[0])
        if fabs(here - position(path.curve, turn[0], turn[1])) <= MAX_NEAR * fabs(there - here):
            (value, value_low, _), slope, _ = energy_at(path, number, near)
            correction = ((path.level[0] - value) + (path.level[1] - value_low)) / (-sign * slope[0])
            if 0.0 < correction <= MAX_NEAR * 2.0:
                origin, origin_low = add(near[0], near[1], -sign * correction, 0.0)
                spread = (sign, origin, origin_low)
    if spread[0] == 0.0:
        return time_by_panels(path, number, low, high, spread)
    origin = spread[1], spread[2]
    return time_by_panels(path, number, root_of_gap(near, origin), root_of_gap(far, origin), spread)
