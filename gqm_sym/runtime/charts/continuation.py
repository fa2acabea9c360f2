"""Continuation of a curve F(x, z) = 0 piece by piece from its start in one direction, until it closes or ends."""

from math import cos, fabs, inf, isfinite, pi
from typing import Any, NamedTuple

import numpy as np
from numba import types

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.charts.evaluate import TERMS
from gqm_sym.runtime.charts.level_pieces import (
    ANCHOR,
    BREAK,
    END,
    POINTS,
    SMOOTH,
    LevelCurve,
    compare,
    evaluate_points,
    growth,
    solve_piece,
)
from gqm_sym.runtime.compiled.jit import Inlined, Inner, entry
from gqm_sym.runtime.compiled.types import MATRIX, VECTOR

# The largest number of pieces that are laid in one direction.
MAX_PIECES = 2000

# An open curve without a limit is followed over this many times the length of its first piece.
MAX_REACH = 1e9

# Why the continuation ended: at the limit, back at the start, at a singular point, after MAX_PIECES or MAX_REACH, or
# where F is no longer real.
LIMIT, CLOSED, SINGULAR, FAR, UNREAL = range(5)
PIECE_ROWS = 11

# A point where grad F vanishes is predicted from the fall of |grad F|; no piece covers more than this share of the way.
MAX_APPROACH = 0.75

# Relative to the size of the coordinates: the continuation ends at a singular point that is nearer than the first, or
# nearer than the second if no piece can be laid; pieces shorter than the third are not laid.
MAX_SINGULAR_DISTANCE = 1e-10
MAX_SINGULAR_AHEAD = 1e-4
MIN_LENGTH = 1e-15

# Pieces become shorter than the first only where F is not smooth. Such edges closer than the second are one break.
MAX_BREAK_PIECE = 1e-12
BREAK_DISTANCE = 1e-9

# The curve ends where so many steps over a break are not enough to lay a piece again: F is no longer finite there.
MAX_STEPS_OVER = 8

# The curve is closed if it returns to the start in the same direction, with at most this gap, as a share of a piece.
MAX_GAP = 1e-9

# If the start lies within this many lengths of a piece, the rest of the way is divided into equal pieces.
MAX_RETURN = 1.25

# Places that differ by less than this share of a piece, or of the whole length, differ by rounding only.
MAX_SAME_PLACE = 1e-6
MAX_SAME_LENGTH = 1e-12


@Inner
def predicted_distance(piece, point):  # type: ignore[no-untyped-def]
    """Return the distance to a singular point if |grad F| fell linearly; infinite if it grows."""
    slope = piece[8, point]
    return -piece[7, point] / slope if slope < 0.0 else inf


@Inner
def _advance(at, piece):  # type: ignore[no-untyped-def]
    """Return the right end of a piece: x and z as two doubles each."""
    out = np.empty(4)
    for row in range(2):
        s, e = two_sum(at[2 * row], piece[row, END])
        out[2 * row], out[2 * row + 1] = two_sum(s, e + at[2 * row + 1])
    return out


@Inner
def _gap(start, at, along, across):  # type: ignore[no-untyped-def]
    """Return how far a place lies behind the start along the tangent there, and how far beside it."""
    dx = (start[0] - at[0]) + (start[1] - at[1])
    dz = (start[2] - at[2]) + (start[3] - at[3])
    return dx * along + dz * across, dz * along - dx * across


@Inner
def _return(start, at, piece, length):  # type: ignore[no-untyped-def]
    """Estimate the length at which a piece, or its continuation, returns to the start; negative if it does not."""
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
    if fabs(beside) > 0.5 * fabs(behind) + MAX_GAP * length:
        return -1.0
    share = 1.0 if where == END else cos(0.5 * pi * (where + 0.5) / TERMS) ** 2
    place = share * length + behind
    return place if place <= MAX_RETURN * length else -1.0


@Inner
def _close(curve, start, at, length, direction, piece):  # type: ignore[no-untyped-def]
    """Lay the piece that ends at the start, and return its length; negative if the curve passes beside the start."""
    for _ in range(8):
        if not (length > 0.0 and solve_piece(curve, at, length, piece)):
            return -1.0
        end = _advance(at, piece)
        behind, beside = _gap(start, end, direction[0], direction[1])
        if fabs(beside) > MAX_GAP * length + fabs(behind):
            return -1.0
        if fabs(behind) <= 1e-17 * (fabs(start[0]) + fabs(start[2]) + length):
            break
        length += behind
    level = piece[2, END] * direction[0] + piece[3, END] * direction[1]
    return length if level > 0.99 and fabs(beside) <= MAX_GAP * length else -1.0


@Inner
def _step_over(curve, at, last, piece, length):  # type: ignore[no-untyped-def]
    """Move ``at`` beyond a place where F is not smooth; return whether the curve continues there."""
    at[0] += length * last[0]
    at[2] += length * last[1]
    piece[:2] = 0.0
    for _ in range(4):
        if not evaluate_points(curve, at, piece):
            return False
        shift = -curve.sign * piece[6, ANCHOR] / piece[7, ANCHOR]
        at[0] += shift * piece[3, ANCHOR]
        at[2] -= shift * piece[2, ANCHOR]
    return True


@Inner
def _mark(jumps, edges, at, what, distance):  # type: ignore[no-untyped-def]
    """Record the kind of an edge; of edges closer than ``distance``, keep the worst, or the one with the shortest piece
    before it.
    """
    k = at - 1
    while k > 0 and edges[at] - edges[k] <= distance:
        shorter = edges[k] - edges[k - 1] <= edges[at] - edges[at - 1]
        if jumps[k] > what or (jumps[k] == what and shorter):
            return
        jumps[k] = SMOOTH
        k -= 1
    jumps[at] = max(jumps[at], what)


@Inner
def _first_length(piece, size):  # type: ignore[no-untyped-def]
    """Return the length of the first piece, from the radius of curvature and the scale on which |grad F| changes."""
    length = 0.5 * min(1.0 / piece[5, ANCHOR], piece[7, ANCHOR] / fabs(piece[8, ANCHOR]))
    return length if isfinite(length) else max(size, 1.0)


@Inlined
def _next_edge(s, limit, length, distance):  # type: ignore[no-untyped-def]
    """Return the length at which the next piece should end: before a singular point, and in halves before the limit."""
    remaining = limit - s
    length = min(length, MAX_APPROACH * distance)
    if remaining < 1.5 * length:
        length = remaining if remaining <= length else 0.5 * remaining
    return limit if length == remaining else s + length


@Inner
def _try_piece(curve, here, length, piece, after_break):  # type: ignore[no-untyped-def]
    """Solve for a piece from ``here``; return the change of length for the next one, negative if this one is too long.

    F may fail to be smooth between the beginning and the first node; this is not checked directly after a break.
    """
    if not solve_piece(curve, here, length, piece):
        return -0.5
    change = growth(piece, length)
    if not after_break and compare(piece[2, ANCHOR], piece[3, ANCHOR], piece[4, ANCHOR], piece, 0, length) != SMOOTH:
        return -0.5
    return change


@Inlined
def _distance_to_singular(before, distance, length):  # type: ignore[no-untyped-def]
    """Return the distance to a singular point from the predictions at both ends of a piece.

    |grad F| falls like some power of the distance, and two predictions determine the power.
    """
    if isfinite(before) and isfinite(distance) and before > distance:
        return distance * min(max(length / (before - distance), 0.2), 20.0)
    return distance


class Trace(NamedTuple):
    """Pieces that have been laid, as `trace_one_way` returns them."""

    edges: Any
    anchors: Any
    nodes: Any
    jumps: Any


@Inner
def _pass_break(curve, at, last, piece, trace, count, size):  # type: ignore[no-untyped-def]
    """Move ``at`` over a place where F is not smooth by a straight piece; return whether the curve continues there."""
    trace.anchors[count] = at
    trace.nodes[count, 0], trace.nodes[count, 1], trace.nodes[count, 2] = last[0], last[1], last[2]
    length = 2.0 * MIN_LENGTH * size
    if not _step_over(curve, at, last, piece, length):
        return False
    trace.edges[count + 1] = trace.edges[count] + length
    _mark(trace.jumps, trace.edges, count + 1, BREAK, BREAK_DISTANCE * size)
    return True


@Inner
def _append(trace, count, here, last, piece, length, size):  # type: ignore[no-untyped-def]
    """Store a piece that begins ``here``, and the kind of its left edge; ``last`` is filled with the values at its
    right edge.
    """
    anchors, nodes = trace.anchors, trace.nodes
    anchors[count] = here
    nodes[count, 0], nodes[count, 1], nodes[count, 2] = piece[2, :TERMS], piece[3, :TERMS], piece[4, :TERMS]
    if count > 0:
        jump = compare(last[0], last[1], last[2], piece, 0, length)
        _mark(trace.jumps, trace.edges, count, jump, BREAK_DISTANCE * size)
    last[0], last[1], last[2] = piece[2, END], piece[3, END], piece[4, END]


@entry(
    types.Tuple((types.int64, VECTOR, MATRIX, types.float64[:, :, ::1], types.int64[::1], VECTOR))(
        types.int64, VECTOR, types.float64, VECTOR, types.float64, types.boolean
    )
)
def trace_one_way(field, p, sign, start, limit, may_close):  # type: ignore[no-untyped-def]
    """Lay pieces from the start.

    Parameters
    ----------
    field : int
        Address of ``field``.
    p : array
        Run-time parameters.
    sign : float
        +1 along (-F_z, F_x)/|grad F|, -1 in the opposite direction.
    start : (4,) array
        x and z on the curve, two doubles each.
    limit : float
        Length at which to stop; infinite if there is none.
    may_close : bool
        Whether the curve may return to the start.

    Returns
    -------
    end : int
        LIMIT, CLOSED, SINGULAR, FAR or UNREAL.
    edges : (count + 1,) array
        Length at the edges of the pieces.
    anchors : (count + 1, 4) array
        x and z at the edges, two doubles each.
    nodes : (count, 3, TERMS) array
        Tangent and curvature at the nodes.
    jumps : (count + 1,) array
        The kinds of the edges: SMOOTH, BREAK or CORNER.
    last : (4,) array
        Tangent and curvature at the end, and the distance from there to the singular point.
    """
    curve = LevelCurve(field, p, sign)
    edges, jumps = np.zeros(MAX_PIECES + 1), np.zeros(MAX_PIECES + 1, dtype=np.int64)
    anchors, nodes = np.empty((MAX_PIECES + 1, 4)), np.empty((MAX_PIECES, 3, TERMS))
    trace = Trace(edges, anchors, nodes, jumps)
    piece, at = np.zeros((PIECE_ROWS, POINTS)), start.copy()
    evaluate_points(curve, at, piece)
    direction = piece[2:4, ANCHOR].copy()
    last = np.array([direction[0], direction[1], piece[4, ANCHOR], 0.0])
    size = max(fabs(at[0]), fabs(at[2]))
    distance, length = predicted_distance(piece, ANCHOR), _first_length(piece, size)
    count, end, s, reach, after_break, steps_over = 0, FAR, 0.0, inf, False, 0
    while count < MAX_PIECES and s < reach:
        if limit - s <= 0.0 or distance <= MAX_SINGULAR_DISTANCE * size:
            end = LIMIT if limit - s <= 0.0 else SINGULAR
            break
        edge = _next_edge(s, limit, length, distance)
        length = edge - s
        if length <= MIN_LENGTH * size or length == 0.0:
            if distance <= MAX_SINGULAR_AHEAD * size:
                end = SINGULAR
                break
            if steps_over == MAX_STEPS_OVER or not _pass_break(curve, at, last, piece, trace, count, size):
                count, end = count - steps_over, UNREAL
                at, jumps[count:] = anchors[count], SMOOTH
                break
            count, steps_over = count + 1, steps_over + 1
            s, after_break = edges[count], True
            distance, length = predicted_distance(piece, ANCHOR), _first_length(piece, size)
            continue
        here = at.copy()
        change = _try_piece(curve, here, length, piece, after_break)
        if change < 0.0:
            length *= -change
            continue
        back = _return(start, here, piece, length) if may_close and count > 0 else -1.0
        if back > (1.0 + MAX_SAME_PLACE) * length and edge < limit:
            length = 0.5 * back
            continue
        if back > 0.0 and (edge < limit or back <= length + MAX_SAME_LENGTH * limit):
            other, closing = at.copy(), np.zeros((PIECE_ROWS, POINTS))
            back = _close(curve, start, other, back, direction, closing)
            if back > 0.0:
                here, piece, edge, end = other, closing, s + back, CLOSED
        _append(trace, count, here, last, piece, edge - s, size)
        at = _advance(here, piece)
        size = max(size, fabs(at[0]), fabs(at[2]))
        before, distance = distance, predicted_distance(piece, END)
        last[3] = _distance_to_singular(before, distance, edge - s)
        count += 1
        edges[count], after_break, steps_over = edge, False, 0
        if edge - s <= MAX_BREAK_PIECE * size and edge < limit:
            _mark(jumps, edges, count, BREAK, BREAK_DISTANCE * size)
        s = edge
        if count == 1 and limit == inf:
            reach = MAX_REACH * length
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
