"""The path of a rolling body's centre, which lies beside a chart, in double-double arithmetic."""

from math import fabs

from gqm_sym.runtime.charts.double_double.pieces import (
    DX,
    DX_LOW,
    DZ,
    DZ_LOW,
    NODES,
    SHARE,
    X_LOW,
    Z_LOW,
    X,
    Z,
    fill_points,
    piece_of,
    sloppy_add,
    squared_rate,
)
from gqm_sym.runtime.compiled.intrinsics import fma
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import on_stack
from gqm_sym.runtime.double_double.arithmetic import UNIT, add, divide, multiply, square_root
from gqm_sym.runtime.double_double.nodes import RULE

stacked_bends = on_stack(4 * RULE)


@Inner
def fill_bends(curve, number, n, u, bends):  # type: ignore[no-untyped-def]
    """Fill the second derivatives of x and z with respect to u at places on a piece, two doubles each."""
    k = piece_of(curve, number)
    precise, count = curve.counts[k, 0], curve.counts[k, 1]
    for row in range(2):
        bend, bend_low = bends[2 * row * RULE :], bends[(2 * row + 1) * RULE :]
        for i in range(n):
            bend[i], bend_low[i] = 0.0, 0.0
        for j in range(count - 1, 1, -1):
            term, term_low = multiply(curve.terms[k, 2 * row, j], curve.terms[k, 2 * row + 1, j], j * (j - 1.0), 0.0)
            for i in range(n):
                if j >= precise:
                    bend[i] = fma(bend[i], u[i], term)
                else:
                    s, s_low = multiply(bend[i], bend_low[i], u[i], u[RULE + i])
                    bend[i], bend_low[i] = sloppy_add(s, s_low, term, term_low)


@Inner
def fill_path(curve, number, n, u, points):  # type: ignore[no-untyped-def]
    """Fill the points of a body's path at places on a piece of the curve, as `fill_points` does those of the curve.

    A path at a distance h to the left is r + h*n with the unit normal n; its arc length element is ``1 - h*kappa``
    times that of the curve.

    Returns
    -------
    (float, float)
        Bounds on the errors of the coordinates, and of their derivatives with respect to u.
    """
    fill_points(curve, number, n, u, points)
    k, (h, h_low) = piece_of(curve, number), curve.offset
    error, rate_error = curve.errors[k, 0], curve.errors[k, 1]
    if h == 0.0:
        points[SHARE : SHARE + n] = 1.0
        return error, rate_error
    bends, away, away_rate = stacked_bends(), 0.0, 0.0
    fill_bends(curve, number, n, u, bends)
    for i in range(n):
        dx, dz = (points[DX + i], points[DX_LOW + i]), (points[DZ + i], points[DZ_LOW + i])
        square, square_low = squared_rate(curve, points, i)
        speed, speed_low = square_root(square, square_low)
        ahead, ahead_low = divide(h, h_low, speed, speed_low)
        s, s_low = multiply(dx[0], dx[1], bends[2 * RULE + i], bends[3 * RULE + i])
        t, t_low = multiply(dz[0], dz[1], bends[i], bends[RULE + i])
        turn, turn_low = add(s, s_low, -t, -t_low)
        turn, turn_low = divide(turn, turn_low, square, square_low)
        s, s_low = multiply(ahead, ahead_low, turn, turn_low)
        share, share_low = add(1.0, 0.0, -s, -s_low)
        bend = fabs(bends[i]) + fabs(bends[2 * RULE + i])
        # Second derivatives have an error of up to NODES**2 times that of the first ones, by Markov's inequality.
        angle_error = fabs(ahead) * rate_error
        turn_error = fabs(ahead) * (rate_error * (NODES**2 + 4.0 * bend / speed) + 16.0 * UNIT * bend)
        away = max(away, angle_error + 8.0 * UNIT * fabs(h))
        away_rate = max(away_rate, fabs(share) * rate_error + turn_error + 8.0 * UNIT * speed)
        s, s_low = multiply(ahead, ahead_low, dz[0], dz[1])
        points[X + i], points[X_LOW + i] = add(points[X + i], points[X_LOW + i], -s, -s_low)
        s, s_low = multiply(ahead, ahead_low, dx[0], dx[1])
        points[Z + i], points[Z_LOW + i] = add(points[Z + i], points[Z_LOW + i], s, s_low)
        points[DX + i], points[DX_LOW + i] = multiply(dx[0], dx[1], share, share_low)
        points[DZ + i], points[DZ_LOW + i] = multiply(dz[0], dz[1], share, share_low)
        points[SHARE + i] = share
    return error + away, away_rate
