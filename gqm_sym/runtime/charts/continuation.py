"""Piece after piece along a curve F(x, z) = 0, one way from its start, until it closes or ends."""

from math import cos, fabs, inf, isfinite, pi

import numpy as np
from numba import types

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.charts.evaluate import TERMS
from gqm_sym.runtime.charts.level_pieces import ANCHOR, BREAK, END, POINTS, SMOOTH, compare, follow, growth, look
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.types import MATRIX, VECTOR

PIECES = 2000
"""Most pieces that are laid one way."""
REACH = 1e9
"""A curve that goes on is followed this many times the length of its first piece."""

# What ends a march.
LIMIT, CLOSED, SINGULAR, FAR, UNREAL = range(5)
PIECE_ROWS = 11

# A point where grad F vanishes is predicted by the fall of |grad F|; no piece goes farther towards it than this share.
TOWARDS = 0.75

# Of the size of the coordinates: the march ends at a singular point that is nearer than this, or nearer than that where
# no piece can be laid; a piece shorter than the least is none.
NEAR_SINGULAR = 1e-10
SINGULAR_AHEAD = 1e-4
LEAST = 1e-15

# Pieces get as short as this only where F is not smooth: one break in each such stretch.
SHORT = 1e-12
STRETCH = 1e-9

# The loop is closed when it comes back to the start in its direction, beside it by no more than this share of a piece.
BESIDE = 1e-9

# A piece that would leave less than a quarter of its length to the start leaves half of the way instead.
BEYOND = 1.25

# Places this share of a piece, or of the whole length, apart may differ by rounding alone.
SAME = 1e-6
SAME_LENGTH = 1e-12


@Inner
def ahead(piece, point):  # type: ignore[no-untyped-def]
    """How far ahead a singular point would be if |grad F| fell evenly; infinite where it grows."""
    slope = piece[8, point]
    return -piece[7, point] / slope if slope < 0.0 else inf


@Inner
def _advance(at, piece):  # type: ignore[no-untyped-def]
    """The right end of a piece: x and z as two doubles each."""
    out = np.empty(4)
    for row in range(2):
        s, e = two_sum(at[2 * row], piece[row, END])
        out[2 * row], out[2 * row + 1] = two_sum(s, e + at[2 * row + 1])
    return out


@Inner
def _gap(start, at, along, across):  # type: ignore[no-untyped-def]
    """How far a place is behind the start along its tangent, and how far beside it."""
    dx = (start[0] - at[0]) + (start[1] - at[1])
    dz = (start[2] - at[2]) + (start[3] - at[3])
    return dx * along + dz * across, dz * along - dx * across


@Inner
def _return(start, at, piece, length):  # type: ignore[no-untyped-def]
    """About where on a piece, or a little beyond it, it comes back to the start; negative where it does not."""
    nearest, where = inf, 0
    x = (start[0] - at[0]) + (start[1] - at[1])
    z = (start[2] - at[2]) + (start[3] - at[3])
    for i in range(TERMS + 1):
        away = fabs(x - piece[0, i]) + fabs(z - piece[1, i])
        if away < nearest:
            nearest, where = away, i
    if nearest > length:
        return -1.0
    dx, dz = x - piece[0, where], z - piece[1, where]
    behind = dx * piece[2, where] + dz * piece[3, where]
    beside = dz * piece[2, where] - dx * piece[3, where]
    if fabs(beside) > 0.5 * fabs(behind) + BESIDE * length:
        return -1.0
    share = 1.0 if where == END else cos(0.5 * pi * (where + 0.5) / TERMS) ** 2
    place = share * length + behind
    return place if place <= BEYOND * length else -1.0


@Inner
def _close(field, p, sign, start, at, length, way, piece):  # type: ignore[no-untyped-def]
    """The length of the piece that ends at the start, laid; negative where the curve passes beside it."""
    for _ in range(8):
        if not (length > 0.0 and follow(field, p, sign, at, length, piece)):
            return -1.0
        end = _advance(at, piece)
        behind, beside = _gap(start, end, way[0], way[1])
        if fabs(beside) > BESIDE * length + fabs(behind):
            return -1.0
        if fabs(behind) <= 1e-17 * (fabs(start[0]) + fabs(start[2]) + length):
            break
        length += behind
    level = piece[2, END] * way[0] + piece[3, END] * way[1]
    return length if level > 0.99 and fabs(beside) <= BESIDE * length else -1.0


@Inner
def _hop(field, p, sign, at, last, piece, length):  # type: ignore[no-untyped-def]
    """Step over a place where F is not smooth; whether the curve goes on there. Moves ``at``."""
    at[0] += length * last[0]
    at[2] += length * last[1]
    piece[:2] = 0.0
    for _ in range(4):
        if not look(field, p, sign, at, piece):
            return False
        shift = -sign * piece[6, ANCHOR] / piece[7, ANCHOR]
        at[0] += shift * piece[3, ANCHOR]
        at[2] -= shift * piece[2, ANCHOR]
    return True


@Inner
def _flag(jumps, edges, at, what, stretch):  # type: ignore[no-untyped-def]
    """Say what is at an edge: of edges close together, at that with the shortest piece before it."""
    k = at - 1
    while k > 0 and edges[at] - edges[k] <= stretch:
        shorter = edges[k] - edges[k - 1] <= edges[at] - edges[at - 1]
        if jumps[k] > what or (jumps[k] == what and shorter):
            return
        jumps[k] = SMOOTH
        k -= 1
    jumps[at] = max(jumps[at], what)


@Inner
def _first_length(piece, size):  # type: ignore[no-untyped-def]
    """A length to begin with: of the radius of curvature, and of where |grad F| changes."""
    length = 0.5 * min(1.0 / piece[5, ANCHOR], piece[7, ANCHOR] / fabs(piece[8, ANCHOR]))
    return length if isfinite(length) else max(size, 1.0)


@entry(
    types.Tuple((types.int64, VECTOR, MATRIX, types.float64[:, :, ::1], types.int64[::1], VECTOR))(
        types.int64, VECTOR, types.float64, VECTOR, types.float64, types.boolean
    )
)
def march(field, p, sign, start, limit, may_close):  # type: ignore[no-untyped-def]
    """Lay pieces from the start on.

    Parameters
    ----------
    field : int
        Address of ``field``.
    p : array
        Run-time parameters.
    sign : float
        +1 along (-F_z, F_x)/|grad F|, -1 the other way.
    start : (4,) array
        x and z on the curve, two doubles each.
    limit : float
        Length after which to stop; infinite where there is none.
    may_close : bool
        Whether to look for the return to the start.

    Returns
    -------
    end : int
        LIMIT, CLOSED, SINGULAR, FAR (as far as curves are followed) or UNREAL (F is not real and regular beyond).
    edges : (count + 1,) array
        Length at the edges of the pieces.
    anchors : (count + 1, 4) array
        x and z at the edges, two doubles each.
    nodes : (count, 3, TERMS) array
        Tangent and curvature at the nodes.
    jumps : (count + 1,) array
        What is at the edges: SMOOTH, BREAK or CORNER.
    last : (4,) array
        Tangent and curvature at the end, and how far beyond it the singular point is.
    """
    edges = np.zeros(PIECES + 1)
    anchors = np.empty((PIECES + 1, 4))
    nodes = np.empty((PIECES, 3, TERMS))
    jumps = np.zeros(PIECES + 1, dtype=np.int64)
    piece = np.zeros((PIECE_ROWS, POINTS))
    at = start.copy()
    look(field, p, sign, at, piece)
    way = piece[2:4, ANCHOR].copy()
    last = np.array([way[0], way[1], piece[4, ANCHOR], 0.0])
    size = max(fabs(at[0]), fabs(at[2]))
    distance = ahead(piece, ANCHOR)
    length = _first_length(piece, size)
    count, end, s, reach, hopped = 0, FAR, 0.0, inf, False
    while count < PIECES and s < reach:
        rest = limit - s
        if rest <= 0.0:
            end = LIMIT
            break
        if distance <= NEAR_SINGULAR * size:
            end = SINGULAR
            break
        length = min(length, TOWARDS * distance)
        if rest < 1.5 * length:
            length = rest if rest <= length else 0.5 * rest
        edge = limit if length == rest else s + length
        length = edge - s
        if length <= LEAST * size or length == 0.0:
            if distance <= SINGULAR_AHEAD * size:
                end = SINGULAR
                break
            # Something is there that is not smooth: go over it by a piece that is straight.
            anchors[count] = at
            nodes[count, 0], nodes[count, 1], nodes[count, 2] = last[0], last[1], last[2]
            hop = 2.0 * LEAST * size
            if not _hop(field, p, sign, at, last, piece, hop):
                end = UNREAL
                break
            s += hop
            count += 1
            edges[count], hopped = s, True
            _flag(jumps, edges, count, BREAK, STRETCH * size)
            distance, length = ahead(piece, ANCHOR), _first_length(piece, size)
            continue
        here = at.copy()
        if not follow(field, p, sign, here, length, piece):
            length *= 0.5
            continue
        change = growth(piece, length)
        if not hopped and compare(piece[2, ANCHOR], piece[3, ANCHOR], piece[4, ANCHOR], piece, 0, length) != SMOOTH:
            change = -0.5  # between the beginning and the first node, F is not smooth
        if change < 0.0:
            length *= -change
            continue
        back = _return(start, here, piece, length) if may_close and count > 0 else -1.0
        if back > (1.0 + SAME) * length and edge < limit:
            length = 0.5 * back
            continue
        if back > 0.0 and (edge < limit or back <= length + SAME_LENGTH * limit):
            other = at.copy()
            closing = np.zeros((PIECE_ROWS, POINTS))
            back = _close(field, p, sign, start, other, back, way, closing)
            if back > 0.0:
                here, piece, edge, end = other, closing, s + back, CLOSED
        anchors[count] = here
        nodes[count, 0], nodes[count, 1], nodes[count, 2] = piece[2, :TERMS], piece[3, :TERMS], piece[4, :TERMS]
        at = _advance(here, piece)
        if count > 0:
            _flag(jumps, edges, count, compare(last[0], last[1], last[2], piece, 0, edge - s), STRETCH * size)
        last[0], last[1], last[2] = piece[2, END], piece[3, END], piece[4, END]
        size = max(size, fabs(at[0]), fabs(at[2]))
        before, distance = distance, ahead(piece, END)
        # |grad F| falls as some power of the distance: two predictions tell which.
        last[3] = distance
        if isfinite(before) and isfinite(distance) and before > distance:
            last[3] = distance * min(max((edge - s) / (before - distance), 0.2), 20.0)
        count += 1
        edges[count], hopped = edge, False
        if edge - s <= SHORT * size and edge < limit:
            _flag(jumps, edges, count, BREAK, STRETCH * size)
        s = edge
        if count == 1 and limit == inf:
            reach = REACH * length
        if end == CLOSED:
            break
        length *= change
    anchors[count] = at
    return (
        end,
        edges[: count + 1].copy(),
        anchors[: count + 1].copy(),
        nodes[:count].copy(),
        jumps[: count + 1].copy(),
        last,
    )
