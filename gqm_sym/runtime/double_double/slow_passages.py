"""The duration of an orbit on which the body turns next to a hilltop or only just passes one, in double-double
arithmetic.

About such a slow place V**2 is a polynomial, whose roots next to the place are divided out: V**2 = (y**2 + b y + c)
K(y). The time is then a sum of integrals in closed form, the first of which is a logarithm, so that a body may come as
close to the hilltop as it likes. In between, the time is found by Gauss-Legendre rules.
"""

from math import copysign, fabs, inf, log, nan, pi, sin

import numpy as np

from gqm_sym.runtime.arithmetic.elementary import HALF_PI
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.double_double.arithmetic import (
    UNIT,
    add,
    divide,
    exponential,
    improved_logarithm,
    multiply,
    square_root,
)
from gqm_sym.runtime.double_double.interpreter import BLOCK, ERROR, LOW, call_interpreter
from gqm_sym.runtime.double_double.nodes import WINDOW
from gqm_sym.runtime.double_double.quadrature import phase_angle, time_between
from gqm_sym.runtime.quadrature.trapezoid import CIRCULATION, LIBRATION

# The first reach of a polynomial, as a share of the orbit, and the number of times that it is halved at most.
REACH, MAX_HALVINGS = 1.0 / 16.0, 8

# The largest of the last two coefficients of a polynomial, as a share of the polynomial, and the share of them that is
# the error at most.
MAX_TAIL, TAIL_ERROR = 2.0**-50, 2.0**-13

# A bound on the error of coefficients by the rounding of the table, as a share of the largest value.
TABLE_ERROR = 2.0**-80

# The largest coefficients b and c for which a place is slow, and the number of iterations that find them.
MAX_ROOTS, MAX_ITERATIONS = 0.125, 60

# A body may be slow where V**2 is smaller than this share of its largest value. The polynomial is laid about a place up
# to this distance from the hilltop, as a share of its reach, which is found by so many moves.
SLOW_SHARE, MAX_OFF_CENTRE, MAX_MOVES = 0.1, 1e-3, 6


@Inner
def fill_coefficients(table, values, errors, out):  # type: ignore[no-untyped-def]
    """Fill the coefficients of powers from values at the nodes, as rows of high parts, low parts and errors.

    Returns
    -------
    float
        A bound on the error of the polynomial itself, or NaN if its last coefficients are too large.
    """
    largest = 0.0
    for j in range(WINDOW):
        largest = max(largest, fabs(values[0, j]))
    for k in range(WINDOW):
        high, low, error = 0.0, 0.0, 0.0
        for j in range(WINDOW):
            part, part_low = multiply(table[1 + k, j], table[1 + WINDOW + k, j], values[0, j], values[1, j])
            high, low = add(high, low, part, part_low)
            error += fabs(table[1 + k, j]) * errors[j]
        out[0, k], out[1, k], out[2, k] = (
            high,
            low,
            error + (TABLE_ERROR * largest if k > 0 else 2.0 * UNIT * fabs(high)),
        )
    tail = max(fabs(out[0, WINDOW - 1]), fabs(out[0, WINDOW - 2]))
    return TAIL_ERROR * tail if tail <= MAX_TAIL * largest else nan


@Inner
def fill_slopes(integrand, place, reach, table, values, errors):  # type: ignore[no-untyped-def]
    """Fill the slope of the potential at the nodes about a place; all values are left in the registers."""
    (address, operations, parts, registers), work = integrand.tape, integrand.work
    at, slope = registers[1], registers[4]
    for j in range(WINDOW):
        distance, distance_low = multiply(reach, 0.0, table[0, j], 0.0)
        work[at + j], work[at + LOW + j] = add(place[0], place[1], distance, distance_low)
        work[at + ERROR + j] = UNIT * fabs(work[at + j]) if distance != 0.0 else 0.0
    call_interpreter(address, operations, parts[0], parts[2], work, WINDOW)
    for j in range(WINDOW):
        values[0, j], values[1, j], errors[j] = work[slope + j], work[slope + LOW + j], work[slope + ERROR + j]


@Inner
def fill_without_roots(w, at_place, k):  # type: ignore[no-untyped-def]
    """Divide a polynomial by the factor y**2 + b y + c of its roots next to 0.

    Parameters
    ----------
    w : (3, n) array
        The coefficients of its powers from the first on.
    at_place : (high, low)
        Its value at 0; if that is zero, so is c.
    k : (2, n) array
        Filled with the coefficients of the quotient.

    Returns
    -------
    (b, b_low), (c, c_low)
    """
    b, b_low, c, c_low, before = 0.0, 0.0, 0.0, 0.0, inf
    for _ in range(MAX_ITERATIONS):
        k[0, WINDOW - 1], k[1, WINDOW - 1] = 0.0, 0.0
        one, one_low, two, two_low = 0.0, 0.0, 0.0, 0.0
        for i in range(WINDOW - 2, -1, -1):
            part, part_low = multiply(b, b_low, one, one_low)
            other, other_low = multiply(c, c_low, two, two_low)
            part, part_low = add(part, part_low, other, other_low)
            two, two_low = one, one_low
            one, one_low = add(w[0, i + 1], w[1, i + 1], -part, -part_low)
            k[0, i], k[1, i] = one, one_low
        new_c, new_c_low = divide(at_place[0], at_place[1], one, one_low)
        part, part_low = multiply(new_c, new_c_low, two, two_low)
        part, part_low = add(w[0, 0], w[1, 0], -part, -part_low)
        new_b, new_b_low = divide(part, part_low, one, one_low)
        change = fabs((new_b - b) + (new_b_low - b_low)) + fabs((new_c - c) + (new_c_low - c_low))
        b, b_low, c, c_low = new_b, new_b_low, new_c, new_c_low
        size = fabs(b) + fabs(c)
        if not size <= MAX_ROOTS or change == 0.0 or before <= change <= UNIT * size:
            break
        before = change
    return (b, b_low), (c, c_low)


@Inner
def logarithm(x, x_low):  # type: ignore[no-untyped-def]
    """Return the logarithm."""
    guess = log(x)
    e, e_low = exponential(-guess, 0.0)
    return improved_logarithm(x, x_low, guess, e, e_low)


@Inner
def root_at(y, b, c):  # type: ignore[no-untyped-def]
    """Return the square root of y**2 + b y + c at y = 1 or y = -1."""
    high, low = add(c[0], c[1], y * b[0], y * b[1])
    high, low = add(high, low, 1.0, 0.0)
    return square_root(high, low)


@Inner
def time_of_powers(f, b, c):  # type: ignore[no-untyped-def]
    """Return the integral of a polynomial divided by the root of y**2 + b y + c, with the part of its error that is due
    to the polynomial.

    It extends from -1 to 1, or from 0 to 1 if c is zero.
    """
    turns = c[0] == 0.0
    right, right_low = root_at(1.0, b, c)
    left, left_low = (0.0, 0.0) if turns else root_at(-1.0, b, c)
    ahead, ahead_low = add(2.0 * right, 2.0 * right_low, 2.0, 0.0)
    ahead, ahead_low = add(ahead, ahead_low, b[0], b[1])
    if turns:
        ratio, ratio_low = divide(ahead, ahead_low, b[0], b[1])
    else:
        behind, behind_low = add(2.0 * left, 2.0 * left_low, 2.0, 0.0)
        behind, behind_low = add(behind, behind_low, -b[0], -b[1])
        ahead, ahead_low = multiply(ahead, ahead_low, behind, behind_low)
        square, square_low = multiply(b[0], b[1], b[0], b[1])
        gap, gap_low = add(4.0 * c[0], 4.0 * c[1], -square, -square_low)
        ratio, ratio_low = divide(ahead, ahead_low, gap, gap_low)
    before, before_low = 0.0, 0.0
    this, this_low = logarithm(ratio, ratio_low) if ratio > 0.0 else (nan, nan)
    high, low = multiply(f[0, 0], f[1, 0], this, this_low)
    error = this * (f[2, 0] + 16.0 * UNIT * f[0, 0])
    for k in range(1, WINDOW):
        sign = 1.0 if k % 2 == 0 else -1.0
        edge, edge_low = add(right, right_low, sign * left, sign * left_low)
        part, part_low = multiply(b[0], b[1], this, this_low)
        part, part_low = multiply(part, part_low, 0.5 - k, 0.0)
        other, other_low = multiply(c[0], c[1], before, before_low)
        other, other_low = multiply(other, other_low, 1.0 - k, 0.0)
        part, part_low = add(part, part_low, other, other_low)
        part, part_low = add(part, part_low, edge, edge_low)
        before, before_low = this, this_low
        this, this_low = divide(part, part_low, float(k), 0.0)
        part, part_low = multiply(f[0, k], f[1, k], this, this_low)
        high, low = add(high, low, part, part_low)
        error += 2.0 / k * (f[2, k] + 16.0 * UNIT * fabs(f[0, k]))
    return high, low, error


@Inner
def time_about(integrand, place, reach, place_error, table):  # type: ignore[no-untyped-def]
    """Return the time next to a slow place, with its error; NaN if the place is not slow, or the reach too large.

    Parameters
    ----------
    integrand : Integrand
        The orbit.
    place : (high, low)
        A turning point, or a place next to a hilltop.
    reach : float
        The distance from a turning point to the end of the part, whose sign is that of the direction, or the distance
        from the other place to both ends of the part.
    place_error : float
        A bound on the error of a turning point; infinity if the place is none.
    table : array
        From `nodes.powers`.
    """
    (_, _, _, registers), work, level = integrand.tape, integrand.work, integrand.level
    values, errors, w = np.empty((2, WINDOW)), np.empty(WINDOW), np.empty((3, WINDOW))
    slopes, k, f = np.empty((3, WINDOW)), np.empty((2, WINDOW)), np.empty((3, WINDOW))
    fill_slopes(integrand, place, reach, table, values, errors)
    v2, of_v2 = (0.0, 0.0), place_error * 2.0 * fabs(values[0, WINDOW // 2])
    if place_error == inf:
        u = registers[2] + WINDOW // 2
        half, half_low = add(level[0], level[1], -work[u], -work[u + LOW])
        v2, of_v2 = (2.0 * half, 2.0 * half_low), 2.0 * (level[2] + work[u + ERROR])
    of_k = 2.0 * fabs(reach) * fill_coefficients(table, values, errors, slopes)
    for i in range(WINDOW):
        share, share_low = divide(-2.0 * reach, 0.0, i + 1.0, 0.0)
        w[0, i], w[1, i] = multiply(share, share_low, slopes[0, i], slopes[1, i])
        w[2, i] = fabs(share) * slopes[2, i]
        of_k += w[2, i] if i > 0 else 0.0
    b, c = fill_without_roots(w, v2, k)
    is_slow = fabs(b[0]) + fabs(c[0]) <= MAX_ROOTS and k[0, 0] > 0.0
    if not is_slow or (place_error < inf and not b[0] > 0.0):
        return nan, nan, nan
    least = k[0, 0]
    for j in range(WINDOW):
        high, low, ds = 0.0, 0.0, registers[3] + j
        for i in range(WINDOW - 2, -1, -1):
            high, low = multiply(high, low, table[0, j], 0.0)
            high, low = add(high, low, k[0, i], k[1, i])
        root, root_low = square_root(high, low)
        values[0, j], values[1, j] = divide(work[ds], work[ds + LOW], root, root_low)
        errors[j], least = values[0, j] * (work[ds + ERROR] / work[ds] + 8.0 * UNIT), min(least, high)
    of_polynomial = fill_coefficients(table, values, errors, f)
    high, low, error = time_of_powers(f, b, c)
    # The error of the logarithm of b**2 - 4 c, from V**2 at the place, its slope there and its curvature.
    square, gap = b[0] * b[0], fabs(b[0] * b[0] - 4.0 * c[0])
    of_gap = 4.0 * of_v2 + 2.0 * fabs(b[0]) * w[2, 0] + (square + 4.0 * fabs(c[0])) * of_k
    error += (
        f[0, 0] * (of_gap / (k[0, 0] * gap) + UNIT * fabs(place[0] / reach)) + 4.0 * of_polynomial + high * of_k / least
    )
    high, low = multiply(high, low, fabs(reach), 0.0)
    return high, low, fabs(reach) * error


@Inner
def time_beside_turn(integrand, place, reach, place_error, table):  # type: ignore[no-untyped-def]
    """Return the time next to a turning point with its error, and the reach for which it was found; see
    `time_about`.
    """
    for _ in range(MAX_HALVINGS):
        high, low, error = time_about(integrand, place, reach, place_error, table)
        if error == error:
            return (high, low, error), reach
        reach *= 0.5
    return (nan, nan, nan), reach


@Inner
def hilltop_near(integrand, place, reach, table):  # type: ignore[no-untyped-def]
    """Return a place next to the hilltop that is within reach of another one; NaN if there is none."""
    values, errors, slopes = np.empty((2, WINDOW)), np.empty(WINDOW), np.empty((3, WINDOW))
    for _ in range(MAX_MOVES):
        fill_slopes(integrand, place, reach, table, values, errors)
        fill_coefficients(table, values, errors, slopes)
        y = 0.0
        for _ in range(MAX_MOVES):
            value, slope = 0.0, 0.0
            for i in range(WINDOW - 1, -1, -1):
                slope, value = slope * y + value, value * y + slopes[0, i]
            y = min(max(y - value / slope, -1.0), 1.0)
        if fabs(y) <= MAX_OFF_CENTRE:
            return place
        place = add(place[0], place[1], reach * y, 0.0)
    return nan, nan


@Inner
def time_over_hilltop(integrand, place, reach, table):  # type: ignore[no-untyped-def]
    """Return the time on both sides of the hilltop near a place with its error, the hilltop and the reach; see
    `time_about`.
    """
    for _ in range(MAX_HALVINGS):
        top = hilltop_near(integrand, place, reach, table)
        high, low, error = time_about(integrand, top, reach, inf, table)
        if error == error:
            return (high, low, error), top, reach
        reach *= 0.5
    return (nan, nan, nan), place, reach


@Inner
def fill_speeds(integrand, kind, v2):  # type: ignore[no-untyped-def]
    """Fill V**2 at places all over an orbit, and return the largest; the places are left in their register."""
    (address, operations, parts, registers), work, level, start, width = integrand
    place, potential, largest = registers[1], registers[2], 0.0
    for i in range(BLOCK):
        share = (i + 0.5) / BLOCK
        share = share if kind == CIRCULATION else sin(0.5 * pi * share) ** 2
        distance, distance_low = multiply(width[0], width[1], share, 0.0)
        at = place + i
        work[at], work[at + LOW] = add(start[0], start[1], distance, distance_low)
        work[at + ERROR] = 0.0
    call_interpreter(address, operations, parts[0], parts[1], work, BLOCK)
    for i in range(BLOCK):
        v2[i] = 2.0 * ((level[0] - work[potential + i]) + (level[1] - work[potential + LOW + i]))
        largest = max(largest, v2[i])
    return largest


@Inner
def sum_of(a, b):  # type: ignore[no-untyped-def]
    """Return the sum of two times with their errors."""
    high, low = add(a[0], a[1], b[0], b[1])
    return high, low, a[2] + b[2]


@Inner
def time_in_parts(integrand, kind, errors, rules, tolerance):  # type: ignore[no-untyped-def]
    """Return the duration of an orbit with its error; NaN if the body is slow nowhere, or it is not found.

    Parameters
    ----------
    integrand : Integrand
        The orbit.
    kind : int
        LIBRATION or CIRCULATION.
    errors : (float, float)
        Bounds on the errors of the turning points of a libration.
    rules : (array, array)
        From `nodes.panel_rule` and `nodes.powers`.
    tolerance : float
        The relative error of Gauss's rules that is small enough.
    """
    (_, _, _, registers), work, start, width = integrand.tape, integrand.work, integrand.start, integrand.width
    rule, table = rules
    total, begin, stop, count = (0.0, 0.0, 0.0), (0.0, 0.0), (1.0, 0.0), 0
    first = REACH * fabs(width[0])
    if kind == LIBRATION:
        stop = 2.0 * HALF_PI[0], 2.0 * HALF_PI[1]
        part, reach = time_beside_turn(integrand, start, first, errors[0], table)
        if part[2] == part[2]:
            total, begin, count = sum_of(total, part), phase_angle(integrand, kind, reach, 0.0), 1
        end = add(start[0], start[1], width[0], width[1])
        part, reach = time_beside_turn(integrand, end, -first, errors[1], table)
        if part[2] == part[2]:
            behind = add(width[0], width[1], reach, 0.0)
            total, stop, count = sum_of(total, part), phase_angle(integrand, kind, behind[0], behind[1]), count + 1
    v2, places, place = np.empty(BLOCK), np.empty((2, BLOCK)), registers[1]
    largest = fill_speeds(integrand, kind, v2)
    for i in range(BLOCK):
        places[0, i], places[1, i] = work[place + i], work[place + LOW + i]
    for i in range(BLOCK):
        before, after = v2[i - 1], v2[(i + 1) % BLOCK]
        is_inside = kind == CIRCULATION or 0 < i < BLOCK - 1
        if not (is_inside and v2[i] < before and v2[i] <= after and v2[i] < SLOW_SHARE * largest):
            continue
        part, top, reach = time_over_hilltop(integrand, (places[0, i], places[1, i]), first, table)
        if part[2] != part[2]:
            continue
        side = copysign(reach, width[0])
        behind = add(top[0], top[1], -start[0], -start[1])
        near = add(behind[0], behind[1], -side, 0.0)
        far = add(behind[0], behind[1], side, 0.0)
        near, far = phase_angle(integrand, kind, near[0], near[1]), phase_angle(integrand, kind, far[0], far[1])
        if kind == CIRCULATION and count == 0:
            stop = add(near[0], near[1], 1.0, 0.0)
        elif begin[0] < near[0]:
            total = sum_of(total, time_between(integrand, kind, begin, near, rule, tolerance))
        else:
            return nan, nan, nan
        total, begin, count = sum_of(total, part), far, count + 1
    if count == 0 or not begin[0] < stop[0]:
        return nan, nan, nan
    return sum_of(total, time_between(integrand, kind, begin, stop, rule, tolerance))
