"""The curve behind a chart in double-double arithmetic: polynomials of its coordinates on each piece.

A chart is accurate to the rounding of doubles. Here the coordinates of the curve itself are sampled on each piece of
the chart, in a parameter u in [-1, 1] that the kind of the curve chooses, and a polynomial of degree 31 goes through
the samples. As the chart's polynomials of degree 15 are accurate to 16 digits, these are accurate to some 31
(`making`).
"""

from math import fabs, sqrt
from typing import Any, NamedTuple

from numba import types

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.compiled.intrinsics import fma
from gqm_sym.runtime.compiled.jit import Inlined, Inner, entry
from gqm_sym.runtime.compiled.registers import borrowed, on_stack
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, REAL, VECTOR
from gqm_sym.runtime.double_double.arithmetic import UNIT, add, fast_sum, multiply, square_root
from gqm_sym.runtime.double_double.nodes import RULE

# Chebyshev points of the first kind at which a piece is sampled.
NODES = 32

# A place on a piece has converged when Newton's method moves it by less than this, because the next step would be
# rounding.
MAX_LAST_STEP, MAX_STEPS = 1e-17, 12

# The tangent turns by no larger angle on a piece that polynomials of degree 15 resolve.
MAX_PIECE_TURN = 4.0

# Columns of the points that `fill_points` fills: x, z and their derivatives with respect to u, two doubles each; then
# the length of the path over that of the curve, which `offset_path.fill_path` adds; and y with its derivative, for a
# curve in space.
X, X_LOW, Z, Z_LOW, DX, DX_LOW, DZ, DZ_LOW, SHARE, Y, Y_LOW, DY, DY_LOW = range(0, 13 * RULE, RULE)

# The rows of the terms of a curve in space: two for each coordinate, in the order x, z, y.
ROWS_IN_SPACE = 6
# The coordinates x, y and z in this order.
IN_SAMPLES = (0, 2, 1)

stacked_points, stacked_places = on_stack(13 * RULE), on_stack(2 * RULE)


class TrueCurve(NamedTuple):
    """The pieces of a curve as compiled code takes them. Pieces that have not been made have the length NaN.

    Attributes
    ----------
    terms : (n, 4, NODES) or (n, ROWS_IN_SPACE, NODES) array
        Powers of u for x and z, and for y if the curve is in space, the high doubles of each before the low ones.
    counts : (n, 2) array of int
        The number of powers that need two doubles, and the number of all powers.
    errors : (n, 2) array
        Bounds on the errors of the coordinates, and on those of their derivatives with respect to u.
    lengths : (n, 3) array
        Arc length as two doubles, and a bound on its error.
    edges : (n+1,) array
        Arc lengths at the edges of the chart's pieces, in doubles.
    period : float
        The period of a closed curve in arc length, 0 for an open one.
    rule : (4, RULE) array
        The nodes and weights of a Gauss-Legendre rule (`nodes.legendre_rule`).
    tails : (2, RULE) array
        Factors that take weighted values at its nodes to the last two Legendre coefficients.
    offset : (float, float)
        The distance of the body's path to the left of the curve, as two doubles: the radius of a rolling body, else 0.
    """

    terms: Any
    counts: Any
    errors: Any
    lengths: Any
    edges: Any
    period: Any
    rule: Any
    tails: Any
    offset: Any = (0.0, 0.0)


TRUE_CURVE = types.NamedTuple(
    (
        *(types.float64[:, :, ::1], types.int64[:, ::1], MATRIX, MATRIX, VECTOR, REAL, MATRIX, MATRIX),
        types.UniTuple(REAL, 2),
    ),
    TrueCurve,
)


@Inlined
def sloppy_add(a, a_low, b, b_low):  # type: ignore[no-untyped-def]
    """Return the sum within 2 UNIT of the larger term, faster than `add`."""
    s, e = two_sum(a, b)
    return fast_sum(s, e + (a_low + b_low))


@Inlined
def unshared(curve):  # type: ignore[no-untyped-def]
    """Return a curve to whose arrays numba does not count references."""
    return TrueCurve(
        borrowed(curve.terms),
        borrowed(curve.counts),
        borrowed(curve.errors),
        borrowed(curve.lengths),
        borrowed(curve.edges),
        curve.period,
        borrowed(curve.rule),
        borrowed(curve.tails),
        curve.offset,
    )


@Inlined
def is_in_space(curve):  # type: ignore[no-untyped-def]
    """Return whether a curve has a third coordinate, y."""
    return curve.terms.shape[1] == ROWS_IN_SPACE


@Inner
def piece_of(curve, number):  # type: ignore[no-untyped-def]
    """Return the index of a piece; on a closed curve the numbers continue beyond the last piece."""
    return number % curve.counts.shape[0]


@Inner
def fill_points(curve, number, n, u, points):  # type: ignore[no-untyped-def]
    """Fill the points at the places ``u`` (the high doubles, then the low ones) on a piece."""
    k = piece_of(curve, number)
    precise, count = curve.counts[k, 0], curve.counts[k, 1]
    for row in range(curve.terms.shape[1] // 2):
        first, second = (X + 2 * row * RULE, DX + 2 * row * RULE) if row < 2 else (Y, DY)
        value, value_low = points[first:], points[first + RULE :]
        slope, slope_low = points[second:], points[second + RULE :]
        for i in range(n):
            value[i], value_low[i], slope[i], slope_low[i] = 0.0, 0.0, 0.0, 0.0
        for j in range(count - 1, precise - 1, -1):
            term = curve.terms[k, 2 * row, j]
            for i in range(n):
                slope[i] = fma(slope[i], u[i], value[i])
                value[i] = fma(value[i], u[i], term)
        for j in range(precise - 1, -1, -1):
            term, term_low = curve.terms[k, 2 * row, j], curve.terms[k, 2 * row + 1, j]
            for i in range(n):
                s, s_low = multiply(slope[i], slope_low[i], u[i], u[RULE + i])
                slope[i], slope_low[i] = sloppy_add(s, s_low, value[i], value_low[i])
                s, s_low = multiply(value[i], value_low[i], u[i], u[RULE + i])
                value[i], value_low[i] = sloppy_add(s, s_low, term, term_low)


@Inlined
def squared_rate(curve, points, i):  # type: ignore[no-untyped-def]
    """Return the square of the derivative of arc length with respect to u at a point, as two doubles."""
    s, s_low = multiply(points[DX + i], points[DX_LOW + i], points[DX + i], points[DX_LOW + i])
    t, t_low = multiply(points[DZ + i], points[DZ_LOW + i], points[DZ + i], points[DZ_LOW + i])
    s, s_low = sloppy_add(s, s_low, t, t_low)
    if is_in_space(curve):
        t, t_low = multiply(points[DY + i], points[DY_LOW + i], points[DY + i], points[DY_LOW + i])
        s, s_low = sloppy_add(s, s_low, t, t_low)
    return s, s_low


@Inner
def arc_on(curve, number, left, right):  # type: ignore[no-untyped-def]
    """Return the arc length from one place on a piece to another, with its error.

    Errors of the coordinates along the tangent count at both ends; errors across it count in proportion to the angle by
    which the tangent turns.
    """
    rule, u, points = curve.rule, stacked_places(), stacked_points()
    width, width_low = add(right[0], right[1], -left[0], -left[1])
    for i in range(RULE):
        distance, distance_low = multiply(width, width_low, rule[0, i], rule[1, i])
        u[i], u[RULE + i] = add(left[0], left[1], distance, distance_low)
    fill_points(curve, number, RULE, u, points)
    total, low, one, two = 0.0, 0.0, 0.0, 0.0
    for i in range(RULE):
        s, s_low = square_root(*squared_rate(curve, points, i))
        s, s_low = multiply(s, s_low, rule[2, i], rule[3, i])
        total, low = add(total, low, s, s_low)
        one += curve.tails[0, i] * s
        two += curve.tails[1, i] * s
    tail = (fabs(one) + fabs(two)) / total
    arc, arc_low = multiply(total, low, width, width_low)
    k = piece_of(curve, number)
    error = (2.0 + MAX_PIECE_TURN) * curve.errors[k, 0] + fabs(width) * total * (tail * tail + 16.0 * UNIT)
    return (arc, arc_low), error


@Inner
def speed_at(curve, number, place):  # type: ignore[no-untyped-def]
    """Return the derivative of arc length with respect to u at a place, as a double."""
    u, points = stacked_places(), stacked_points()
    u[0], u[RULE] = place
    fill_points(curve, number, 1, u, points)
    return sqrt(squared_rate(curve, points, 0)[0])


@Inner
def place_at(curve, number, length):  # type: ignore[no-untyped-def]
    """Return the piece and the place on it at an arc length (two doubles) from the left edge of a piece.

    The place is NaN if a piece between them has not been made.
    """
    count, lengths = curve.counts.shape[0], curve.lengths
    while length[0] < 0.0 and (curve.period > 0.0 or number > 0):
        number -= 1
        k = piece_of(curve, number)
        length = add(length[0], length[1], lengths[k, 0], lengths[k, 1])
    k = piece_of(curve, number)
    while length[0] >= lengths[k, 0] and (curve.period > 0.0 or number < count - 1):
        remainder = add(length[0], length[1], -lengths[k, 0], -lengths[k, 1])
        if remainder[0] < 0.0:
            break
        length, number = remainder, number + 1
        k = piece_of(curve, number)
    place, begin = (2.0 * length[0] / lengths[k, 0] - 1.0, 0.0), (-1.0, 0.0)
    for _ in range(MAX_STEPS):
        arc, _ = arc_on(curve, number, begin, place)
        remainder = add(length[0], length[1], -arc[0], -arc[1])
        speed = speed_at(curve, number, place)
        step = remainder[0] / speed
        place = add(place[0], place[1], step, remainder[1] / speed)
        if not fabs(step) > MAX_LAST_STEP:
            break
    return number, place


@Inner
def arc_between(curve, number, place, other, to):  # type: ignore[no-untyped-def]
    """Return the arc length from a place on a piece to one on the same or a later piece, with its error."""
    if number == other:
        return arc_on(curve, number, place, to)
    (high, low), error = arc_on(curve, number, place, (1.0, 0.0))
    for between in range(number + 1, other):
        k = piece_of(curve, between)
        high, low = add(high, low, curve.lengths[k, 0], curve.lengths[k, 1])
        error += curve.lengths[k, 2]
    part, part_error = arc_on(curve, other, (-1.0, 0.0), to)
    high, low = add(high, low, part[0], part[1])
    return (high, low), error + part_error + UNIT * high


@Inner
def foot(curve, number, place, point):  # type: ignore[no-untyped-def]
    """Return the place on a piece of a planar curve, near a place on it, where the perpendicular from a point meets the
    curve.
    """
    x, x_low, z, z_low = point
    u, points = stacked_places(), stacked_points()
    for _ in range(MAX_STEPS):
        u[0], u[RULE] = place
        fill_points(curve, number, 1, u, points)
        x_gap, x_gap_low = add(x, x_low, -points[X], -points[X_LOW])
        z_gap, z_gap_low = add(z, z_low, -points[Z], -points[Z_LOW])
        s, s_low = multiply(x_gap, x_gap_low, points[DX], points[DX_LOW])
        t, t_low = multiply(z_gap, z_gap_low, points[DZ], points[DZ_LOW])
        s, s_low = add(s, s_low, t, t_low)
        square = points[DX] * points[DX] + points[DZ] * points[DZ]
        step, step_low = s / square, s_low / square
        place = add(place[0], place[1], step, step_low)
        if not fabs(step) > 1e-30:
            break
    return place


@entry(types.UniTuple(REAL, 2)(TRUE_CURVE, INTEGER, types.UniTuple(REAL, 4)))
def length_to(curve, number, point):  # type: ignore[no-untyped-def]
    """Return the arc length from the left edge of a piece to a point that is near it."""
    arc, _ = arc_on(curve, number, (-1.0, 0.0), foot(curve, number, (-1.0, 0.0), point))
    return arc
