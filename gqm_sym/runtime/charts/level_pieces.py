"""One piece of a curve F(x, z) = 0 in arc length: r' = T(r), T the unit tangent across grad F.

Solved at Chebyshev nodes by integrating the tangents found there and looking again at the places this leads to, until
nothing moves. The tangents have unit length to rounding, so arc length is kept; rounding of F enters the direction
only. Along the exact solution F is constant: the mean of its values at the nodes, whose rounding averages out, says
how far the whole piece lies beside F = 0, and the piece is moved by as much along the gradient.
"""

from math import fabs, inf, isfinite, sqrt
from typing import Any, NamedTuple

import numpy as np

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.charts.evaluate import TERMS
from gqm_sym.runtime.compiled.calls import call_field
from gqm_sym.runtime.compiled.jit import Inner

# Behind the nodes come the piece's right end and its left end, the anchor.
END = TERMS
ANCHOR = TERMS + 1
POINTS = TERMS + 2
ROWS = 6
"""Rows of ``field``."""

# Rounds of integrating and looking again; a piece that takes more is too long.
ROUNDS = 40

# Of the piece's length: what counts as not moving, and what may be rounding once it no longer shrinks.
STILL = 4e-16
STALLED = 1e-8

# Most that a piece is moved onto F = 0.
MOST_SHIFT = 1e-3

# The last two Chebyshev coefficients of a resolved piece, of the size of what the row is a sum of.
TAIL = 1e-15

# Last coefficients that have stopped falling are rounding: below this size, and above this share of those before them.
ROUNDING = 1e-9
FLAT = 0.2

# How many coefficients a piece should need, and by how much the next may be longer or shorter.
WANTED = 14
LONGER = 3.0
SHORTER = 0.3

# Beside a place where F is not smooth: the tangent's jump at a corner; the curvature's at a break, of its size and as
# the turn it makes over the piece.
TURNED = 1e-6
BENT = 1e-5
BENT_TURN = 1e-12
SMOOTH, BREAK, CORNER = range(3)
_FIT = (2.0 / TERMS) * np.cos(np.pi * np.outer(np.arange(TERMS), np.arange(TERMS) + 0.5) / TERMS)
_FIT[0] *= 0.5


def _gains() -> np.ndarray:
    """Integrals of the Chebyshev polynomials from -1 to the nodes and to 1, each to its last digits near -1 too.

    With x = -cos(phi) the one of T_k is (-1)**k (S(k+1) - S(k-1)), S(n) = sin(n phi/2)**2/n.
    """
    phi = np.pi * np.append((TERMS - 0.5 - np.arange(TERMS)) / TERMS, 1.0)
    n = np.arange(-1, TERMS + 1)
    waves = np.sin(0.5 * np.outer(phi, n)) ** 2 / np.where(n == 0, 1, n)
    return (-1.0) ** np.arange(TERMS) * (waves[:, 2:] - waves[:, :-2])


_ALONG = _gains()

# From the left end: 1 + x, and the integral from values at the nodes.
_BEYOND = np.ascontiguousarray(_ALONG[:, 0])
_GAIN = np.ascontiguousarray(_ALONG @ _FIT)

# The values at the left and the right end.
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
    """Fill a piece with tangents, curvatures, values and scales of F at all its points; whether all are finite.

    Parameters
    ----------
    curve : LevelCurve
        The curve.
    at : (4,) array
        The anchor: x and z as two doubles each.
    piece : (11, POINTS) array
        Rows 0 and 1 are offsets from the anchor; the others are filled: tangent (2, 3), curvature (4), sum of the
        magnitudes of the curvature's terms (5), F (6), |grad F| (7), its derivative by arc length (8), places (9, 10).
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
def solve_piece(curve, at, length, piece):  # type: ignore[no-untyped-def]
    """Solve for the piece of a given length from ``at``; whether that succeeds. ``at`` is moved onto F = 0."""
    half, sign = 0.5 * length, curve.sign
    piece[:2] = 0.0
    if not evaluate_points(curve, at, piece):
        return False
    bend = piece[4, ANCHOR]
    for i in range(TERMS + 1):
        s = half * _BEYOND[i]
        piece[0, i] = s * (piece[2, ANCHOR] - 0.5 * s * bend * piece[3, ANCHOR])
        piece[1, i] = s * (piece[3, ANCHOR] + 0.5 * s * bend * piece[2, ANCHOR])
    before, moved = inf, False
    for _ in range(ROUNDS):
        if not evaluate_points(curve, at, piece):
            return False
        change = 0.0
        for row in range(2):
            base = piece[2 + row, ANCHOR]
            for i in range(TERMS + 1):
                gained = 0.0
                for j in range(TERMS):
                    gained += _GAIN[i, j] * (piece[2 + row, j] - base)
                offset = half * (_BEYOND[i] * base + gained)
                change = max(change, fabs(offset - piece[row, i]))
                piece[row, i] = offset
        still = change <= STILL * length or (change <= STALLED * length and change >= 0.5 * before)
        if still and moved:
            return True
        if still:
            moved = True
            level = 0.0
            for j in range(TERMS):
                level += piece[6, j] / TERMS
            shift = -level / piece[7, ANCHOR]
            if fabs(shift) > MOST_SHIFT * length:
                return False
            s, e = two_sum(at[0], sign * shift * piece[3, ANCHOR])
            at[0], at[1] = two_sum(s, e + at[1])
            s, e = two_sum(at[2], -sign * shift * piece[2, ANCHOR])
            at[2], at[3] = two_sum(s, e + at[3])
            change = inf
        before = change
    return False


@Inner
def seen_from(values, end):  # type: ignore[no-untyped-def]
    """The value at the left end (0) or the right end (1), as those at the nodes say."""
    total = 0.0
    for j in range(TERMS):
        total += _ENDS[end, j] * values[j]
    return total


@Inner
def bends_of(piece):  # type: ignore[no-untyped-def]
    """The largest sum of magnitudes that a curvature of the piece is made of."""
    bends = 0.0
    for j in range(TERMS):
        bends = max(bends, piece[5, j])
    return bends


@Inner
def compare(tx, tz, curvature, piece, end, length):  # type: ignore[no-untyped-def]
    """What lies between a tangent and curvature and those that the nodes of a piece say at its end."""
    x, z = seen_from(piece[2], end), seen_from(piece[3], end)
    if fabs(tx * z - tz * x) > TURNED or tx * x + tz * z < 0.0:
        return CORNER
    if fabs(seen_from(piece[4], end) - curvature) > max(BENT * bends_of(piece), BENT_TURN / length):
        return BREAK
    return SMOOTH


@Inner
def _growth(values, size, noisy):  # type: ignore[no-untyped-def]
    """By how much longer or shorter a piece would be just resolved in this row; negative where this one is not.

    Coefficients that fall from ``size`` to the floor within ``needed`` terms do so within ``WANTED`` on a longer piece.
    ``noisy`` is the size of what the row is computed from.
    """
    coefficients = np.zeros(TERMS)
    for k in range(TERMS):
        for j in range(TERMS):
            coefficients[k] += _FIT[k, j] * values[j]
    tail = max(fabs(coefficients[TERMS - 2]), fabs(coefficients[TERMS - 1]))
    middle = max(fabs(coefficients[TERMS - 6]), fabs(coefficients[TERMS - 5]))
    if tail == 0.0:
        return LONGER
    floor = TAIL * size
    if tail <= ROUNDING * noisy and tail >= FLAT * middle:
        floor = max(floor, 4.0 * tail)
    if tail > floor:
        return -max(SHORTER, 0.9 * (floor / tail) ** (1.0 / (TERMS - 1)))
    needed = TERMS - 2
    while needed > 1 and fabs(coefficients[needed - 1]) <= floor:
        needed -= 1
    return max(SHORTER, min(LONGER, (size / floor) ** (1.0 / needed - 1.0 / WANTED)))


@Inner
def growth(piece, length):  # type: ignore[no-untyped-def]
    """By how much longer or shorter the next piece may be; negative where this one is not resolved.

    Judged by the tangent and by the curvature, which is the least smooth of what a chart holds. An error of the
    curvature counts as the turn it makes over the piece, so that a curve may be as straight as it likes.
    """
    if compare(piece[2, END], piece[3, END], piece[4, END], piece, 1, length) != SMOOTH:
        return -0.5  # between the last node and the end, F is not smooth
    bends = bends_of(piece)
    change = _growth(piece[4], max(bends, 1.0 / length), bends)
    least, short = fabs(change), change < 0.0
    for row in range(2, 4):
        change = _growth(piece[row], 1.0, 1.0)
        short = short or change < 0.0
        least = min(least, fabs(change))
    return -least if short else least
