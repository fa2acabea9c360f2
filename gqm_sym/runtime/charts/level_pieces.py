"""One piece of a curve F(x, z) = 0 in arc length: r' = T(r), where T is the unit tangent across grad F.

This equation is solved at Chebyshev nodes: the tangents there are integrated, and are evaluated again at the resulting
places, until nothing changes. The tangents have unit length to rounding, so arc length is preserved, and rounding of F
enters only the direction. Along the exact solution F is constant. The mean of its values at the nodes, in which
rounding averages out, is the distance of the piece from F = 0, and the piece is moved by that along the gradient. Since
the rounding of F is a distance times the gradient, each value has the weight of the gradient's inverse square.
"""

from math import fabs, inf, isfinite, sqrt
from typing import Any, NamedTuple

import numpy as np

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.charts.evaluate import TERMS
from gqm_sym.runtime.compiled.calls import call_field
from gqm_sym.runtime.compiled.jit import Inner

# Points of a piece: the nodes, then its right end, then its left end, the anchor.
END = TERMS
ANCHOR = TERMS + 1
POINTS = TERMS + 2
ROWS = 6
"""Rows of ``field``."""

# The largest number of iterations; a piece that needs more is too long.
MAX_ITERATIONS = 40

# The iteration has converged when places change by less than the first share of the length, and not more than before;
# or by less than the second share if they are rounding: the change was not smaller for so many iterations.
MAX_LAST_CHANGE = 4e-16
MAX_ROUNDING_CHANGE = 1e-8
MIN_STALLED = 3

# The n-th change is that before times K/n, where K is the length times the derivative of the tangent across the curve.
# A piece is too long if one of the first changes is so many times that before, and more than this share of the length:
# rounding would be amplified too.
FIRST_CHANGES, MAX_RISE, MIN_RISEN_CHANGE = 4, 1.5, 4e-16

# The largest shift of a piece onto F = 0, as a share of its length.
MAX_SHIFT = 1e-3

# A piece is resolved if the last two Chebyshev coefficients of a row are below this share of the size of its terms.
MAX_TAIL_RATIO = 1e-15

# Last coefficients below the first share are rounding noise if they exceed the second share of those before them.
MAX_NOISE_RATIO = 1e-9
MIN_FLAT_RATIO = 0.2

# The number of coefficients that a piece should need, and limits of the change of length from a piece to the next.
IDEAL_TERMS = 14
MAX_GROWTH = 3.0
MIN_GROWTH = 0.3

# Smaller jumps are taken for rounding: the first is that of the tangent at a corner; the others are those of the
# curvature at a break, as a share of its size and as the resulting turn over the piece.
MIN_TANGENT_JUMP = 1e-6
MIN_CURVATURE_JUMP = 1e-5
MIN_TURN_JUMP = 1e-12
SMOOTH, BREAK, CORNER = range(3)
_FIT = (2.0 / TERMS) * np.cos(np.pi * np.outer(np.arange(TERMS), np.arange(TERMS) + 0.5) / TERMS)
_FIT[0] *= 0.5


def _integrals() -> np.ndarray:
    """Return the integrals of the Chebyshev polynomials from -1 to the nodes and to 1, accurate near -1 too.

    With x = -cos(phi), the integral of T_k is (-1)**k (S(k+1) - S(k-1)), where S(n) = sin(n phi/2)**2/n.
    """
    phi = np.pi * np.append((TERMS - 0.5 - np.arange(TERMS)) / TERMS, 1.0)
    n = np.arange(-1, TERMS + 1)
    waves = np.sin(0.5 * np.outer(phi, n)) ** 2 / np.where(n == 0, 1, n)
    return (-1.0) ** np.arange(TERMS) * (waves[:, 2:] - waves[:, :-2])


_INTEGRALS = _integrals()

# 1 + x at the nodes, and the matrix from values at the nodes to the integral from the left end.
_FROM_LEFT = np.ascontiguousarray(_INTEGRALS[:, 0])
_INTEGRATION = np.ascontiguousarray(_INTEGRALS @ _FIT)

# The matrix from values at the nodes to those at the left and the right end.
_ENDS = np.ascontiguousarray(np.array([(-1.0) ** np.arange(TERMS), np.ones(TERMS)]) @ _FIT)


class LevelCurve(NamedTuple):
    """A curve F(x, z) = 0 with a direction.

    Attributes
    ----------
    field : int
        Address of the compiled function that fills F and its derivatives.
    p : array
        Run-time parameters.
    sign : float
        +1 for the tangent (-F_z, F_x)/|grad F|, -1 for the opposite one.
    """

    field: Any
    p: Any
    sign: Any


@Inner
def evaluate_points(curve, at, piece):  # type: ignore[no-untyped-def]
    """Fill a piece with tangents, curvatures, values and scales of F at all its points; return whether all are finite.

    Parameters
    ----------
    curve : LevelCurve
        The curve.
    at : (4,) array
        x and z at the anchor, as two doubles each.
    piece : (11, POINTS) array
        Rows 0 and 1 are offsets from the anchor. The others are filled: tangent (2, 3), curvature (4), sum of the
        magnitudes of the curvature's terms (5), F (6), |grad F| (7), its derivative with respect to arc length (8),
        places (9, 10).
    """
    sign = curve.sign
    offsets, x, z = piece, piece[9], piece[10]
    lows = np.empty((2, POINTS))
    rows = np.empty((ROWS, POINTS))
    for i in range(POINTS):
        s, e = two_sum(at[0], offsets[0, i])
        x[i], lows[0, i] = two_sum(s, e + at[1])
        s, e = two_sum(at[2], offsets[1, i])
        z[i], lows[1, i] = two_sum(s, e + at[3])
    call_field(curve.field, POINTS, x, z, curve.p, rows)
    finite = True
    for i in range(POINTS):
        xx, xz, zz = rows[3, i], rows[4, i], rows[5, i]
        dx, dz = lows[0, i], lows[1, i]
        fx = rows[1, i] + (xx * dx + xz * dz)
        fz = rows[2, i] + (xz * dx + zz * dz)
        largest = max(fabs(fx), fabs(fz))
        if not (largest > 0.0 and isfinite(largest)):
            piece[7, i] = 0.0 if largest == 0.0 else inf
            finite = False
            continue
        size = largest * sqrt((fx / largest) ** 2 + (fz / largest) ** 2)
        a, b = fx / size, fz / size
        one, two, three = xx * b * b, -2.0 * xz * a * b, zz * a * a
        piece[2, i], piece[3, i] = -sign * b, sign * a
        piece[4, i] = sign * (one + two + three) / size
        piece[5, i] = (fabs(one) + fabs(two) + fabs(three)) / size
        piece[6, i] = rows[0, i] + (fx * dx + fz * dz)
        piece[7, i] = size
        piece[8, i] = sign * (xz * (a * a - b * b) + (zz - xx) * a * b)
        finite = finite and isfinite(piece[4, i]) and isfinite(piece[6, i])
    return finite


@Inner
def solve_piece(curve, start, length, piece):  # type: ignore[no-untyped-def]
    """Solve for the piece of a given length from ``start``, which is moved onto F = 0; return whether that succeeds."""
    half, sign = 0.5 * length, curve.sign
    piece[:2] = 0.0
    if not evaluate_points(curve, start, piece):
        return False
    kappa = piece[4, ANCHOR]
    for i in range(TERMS + 1):
        s = half * _FROM_LEFT[i]
        piece[0, i] = s * (piece[2, ANCHOR] - 0.5 * s * kappa * piece[3, ANCHOR])
        piece[1, i] = s * (piece[3, ANCHOR] + 0.5 * s * kappa * piece[2, ANCHOR])
    before, least, stalled, first, moved = 0.0, inf, 0, 0, False
    for n in range(MAX_ITERATIONS):
        if not evaluate_points(curve, start, piece):
            return False
        change = 0.0
        for row in range(2):
            base = piece[2 + row, ANCHOR]
            for i in range(TERMS + 1):
                gained = 0.0
                for j in range(TERMS):
                    gained += _INTEGRATION[i, j] * (piece[2 + row, j] - base)
                offset = half * (_FROM_LEFT[i] * base + gained)
                change = max(change, fabs(offset - piece[row, i]))
                piece[row, i] = offset
        if first < n <= first + FIRST_CHANGES and change > max(MAX_RISE * before, MIN_RISEN_CHANGE * length):
            return False
        stalled = stalled + 1 if change >= least else 0
        least = min(least, change)
        converged = (change <= MAX_LAST_CHANGE * length and change <= before) or (
            change <= MAX_ROUNDING_CHANGE * length and stalled >= MIN_STALLED
        )
        if converged and moved:
            return True
        if converged:
            moved = True
            level, weights = 0.0, 0.0
            for j in range(TERMS):
                weight = (piece[7, ANCHOR] / piece[7, j]) ** 2
                level, weights = level + weight * piece[6, j], weights + weight
            shift = -level / weights / piece[7, ANCHOR]
            if fabs(shift) > MAX_SHIFT * length:
                return False
            s, e = two_sum(start[0], sign * shift * piece[3, ANCHOR])
            start[0], start[1] = two_sum(s, e + start[1])
            s, e = two_sum(start[2], -sign * shift * piece[2, ANCHOR])
            start[2], start[3] = two_sum(s, e + start[3])
            change, least, stalled, first = 0.0, inf, 0, n + 1
        before = change
    return False


@Inner
def extrapolate(values, end):  # type: ignore[no-untyped-def]
    """Return the value at the left end (0) or the right end (1) from those at the nodes."""
    total = 0.0
    for j in range(TERMS):
        total += _ENDS[end, j] * values[j]
    return total


@Inner
def curvature_size(piece):  # type: ignore[no-untyped-def]
    """Return the largest sum of magnitudes of the terms of a curvature on the piece."""
    curvature = 0.0
    for j in range(TERMS):
        curvature = max(curvature, piece[5, j])
    return curvature


@Inner
def compare(tx, tz, curvature, piece, end, length):  # type: ignore[no-untyped-def]
    """Compare a tangent and a curvature with those of a piece at its end 0 or 1: SMOOTH, BREAK or CORNER."""
    x, z = extrapolate(piece[2], end), extrapolate(piece[3], end)
    if fabs(tx * z - tz * x) > MIN_TANGENT_JUMP or tx * x + tz * z < 0.0:
        return CORNER
    if fabs(extrapolate(piece[4], end) - curvature) > max(
        MIN_CURVATURE_JUMP * curvature_size(piece), MIN_TURN_JUMP / length
    ):
        return BREAK
    return SMOOTH


@Inner
def _growth(values, size, noisy):  # type: ignore[no-untyped-def]
    """Return the factor by which a piece could be longer and still be resolved in this row; negative if this piece is
    not resolved.

    On a piece longer by this factor, coefficients would fall from ``size`` to the floor within ``IDEAL_TERMS`` terms.
    ``noisy`` is the size of the terms from which the row is computed.
    """
    coefficients = np.zeros(TERMS)
    for k in range(TERMS):
        for j in range(TERMS):
            coefficients[k] += _FIT[k, j] * values[j]
    tail = max(fabs(coefficients[TERMS - 2]), fabs(coefficients[TERMS - 1]))
    middle = max(fabs(coefficients[TERMS - 6]), fabs(coefficients[TERMS - 5]))
    if tail == 0.0:
        return MAX_GROWTH
    floor = MAX_TAIL_RATIO * size
    if tail <= MAX_NOISE_RATIO * noisy and tail >= MIN_FLAT_RATIO * middle:
        floor = max(floor, 4.0 * tail)
    if tail > floor:
        return -max(MIN_GROWTH, 0.9 * (floor / tail) ** (1.0 / (TERMS - 1)))
    needed = TERMS - 2
    while needed > 1 and fabs(coefficients[needed - 1]) <= floor:
        needed -= 1
    return max(MIN_GROWTH, min(MAX_GROWTH, (size / floor) ** (1.0 / needed - 1.0 / IDEAL_TERMS)))


@Inner
def growth(piece, length):  # type: ignore[no-untyped-def]
    """Return the factor by which the next piece may be longer; negative if this one is not resolved.

    It is judged by the tangent and by the curvature, the least smooth rows of a chart. An error of the curvature counts
    as the turn that it causes over the piece, so that a straight piece is resolved.
    """
    if compare(piece[2, END], piece[3, END], piece[4, END], piece, 1, length) != SMOOTH:
        return -0.5  # between the last node and the end, F is not smooth
    curvature = curvature_size(piece)
    change = _growth(piece[4], max(curvature, 1.0 / length), curvature)
    least, short = fabs(change), change < 0.0
    for row in range(2, 4):
        change = _growth(piece[row], 1.0, 1.0)
        short = short or change < 0.0
        least = min(least, fabs(change))
    return -least if short else least
