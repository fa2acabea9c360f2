"""The integrands over panels of phase angles along a chart in double-double arithmetic.

They are those of `double_double.panel_rates`, for a segment between two places of a chart.
"""

from math import fabs, nan
from typing import Any

import numpy as np
from numba import types

from gqm_sym.runtime.arithmetic.doubledouble import Pair, minus, plus
from gqm_sym.runtime.charts.double_double.passage import LaunchOnChart, begin_orbit
from gqm_sym.runtime.charts.double_double.pieces import (
    TRUE_CURVE,
    arc_between,
    arc_on,
    fill_points,
    place_at,
    squared_rate,
    stacked_places,
    stacked_points,
    unshared,
)
from gqm_sym.runtime.charts.double_double.potential import Path, fill_potential
from gqm_sym.runtime.charts.double_double.turning_points import (
    COLUMNS,
    LAUNCH,
    LEVEL,
    LOWER,
    ROWS,
    UPPER,
    arc_from,
    find_turn,
)
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.registers import borrowed
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, REAL, VECTOR, Array
from gqm_sym.runtime.double_double.arithmetic import add, divide, multiply, square_root
from gqm_sym.runtime.double_double.interpreter import ERROR, LOW
from gqm_sym.runtime.double_double.nodes import RULE
from gqm_sym.runtime.double_double.panel_rates import GROWTHS, MAX_RATE_ERROR, PAIR, fill_shares
from gqm_sym.runtime.double_double.quadrature import TAPE, fill_parameters

# What an end of a segment is: a place, a turning point, the launch place, or the beginning or the end of an open curve.
# Neither of the last three need be a double.
PLACE, TURNING_POINT, LAUNCH_PLACE, CURVE_BEGIN, CURVE_END = 0.0, 1.0, 2.0, 3.0, 4.0

# Further rows of the array that `locate` fills, two doubles each: the arc length from the left edge of the piece on
# which the segment begins to its beginning; its width, which is negative for a motion backwards; and the arc lengths
# from the left edge of the starting piece to both of its ends.
BASE, WIDTH, FIRST, LAST = range(ROWS, ROWS + 4)


@entry(
    types.void(TRUE_CURVE, TAPE, VECTOR, MATRIX, types.UniTuple(types.UniTuple(REAL, 3), 2), INTEGER, MATRIX),
    checked=False,
)
def find_ends(curve, tape, work, p, ends, start, found):  # type: ignore[no-untyped-def]
    """Find the ends of a segment; they are NaN if a turning point is not found.

    Parameters
    ----------
    curve, tape, work, p, start
        As for `turning_points.locate`.
    ends : two tuples of float
        For each end the arc length from the left edge of the piece ``start``, two doubles, and what the end is, from
        PLACE to CURVE_END. The arc length of a turning point is a guess.
    found : (LAST + 1, COLUMNS) array
        The launch and the energy level, from `locate`. The ends are filled in the rows LOWER, which is that of the
        beginning, and UPPER; and the rows from BASE to LAST are filled.
    """
    curve, work, found = unshared(curve), borrowed(work), borrowed(found)
    address, operations, parts, registers = tape
    tape = (address, borrowed(operations), parts, registers)
    fill_parameters(tape, borrowed(p), work)
    path = Path(curve, tape, work, (found[LEVEL, 0], found[LEVEL, 1], found[LEVEL, 2], found[LEVEL, 3]))
    for i, row in ((0, LOWER), (1, UPPER)):
        number, place = int(found[LAUNCH, 0]), (found[LAUNCH, 1], found[LAUNCH, 2])
        arc, arc_low, what = ends[i]
        if what == CURVE_BEGIN:
            number, place = 0, (-1.0, 0.0)
        elif what == CURVE_END:
            number, place = curve.counts.shape[0] - 1, (1.0, 0.0)
        elif what != LAUNCH_PLACE:
            number, place = place_at(curve, start, (arc, arc_low))
        if what == TURNING_POINT:
            inward = 1 if ends[1 - i][0] > arc else -1
            turn, _, _ = find_turn(path, number, place, inward)
            number, place = turn[0], (turn[1], turn[2])
        found[row, 0], found[row, 1], found[row, 2] = number, place[0], place[1]
        found[FIRST + i, 0], found[FIRST + i, 1] = arc_from(curve, start, number, place)
    first, last = int(found[LOWER, 0]), int(found[UPPER, 0])
    a, b = (found[LOWER, 1], found[LOWER, 2]), (found[UPPER, 1], found[UPPER, 2])
    (found[BASE, 0], found[BASE, 1]), _ = arc_on(curve, first, (-1.0, 0.0), a)
    if last > first or (last == first and b[0] >= a[0]):
        width, _ = arc_between(curve, first, a, last, b)
    else:
        back, _ = arc_between(curve, last, b, first, a)
        width = -back[0], -back[1]
    found[WIDTH, 0], found[WIDTH, 1] = width


@Inner
def rate_at(path, number, place):  # type: ignore[no-untyped-def]
    """Return V**2 and ds/dlam at a place on a piece, two doubles each, and a bound on the error of V**2.

    The curve parameter lam is the arc length of the curve, and ds that of the body's path.
    """
    curve, tape, work, level = path
    u, points, value = stacked_places(), stacked_points(), tape[3][2]
    u[0], u[RULE] = place
    fill_potential(path, number, 1, u, points, tape[2][1])
    half, half_low = add(level[0], level[1], -work[value], -work[value + LOW])
    metric, metric_low = 1.0, 0.0
    if curve.offset[0] != 0.0:
        s, s_low = squared_rate(curve, points, 0)
        fill_points(curve, number, 1, u, points)
        t, t_low = squared_rate(curve, points, 0)
        metric, metric_low = divide(s, s_low, t, t_low)
        metric, metric_low = square_root(metric, metric_low)
    return (2.0 * half, 2.0 * half_low), (metric, metric_low), 2.0 * (level[2] + level[3] + work[value + ERROR])


@entry(
    types.boolean(TRUE_CURVE, TAPE, VECTOR, MATRIX, MATRIX, types.Tuple((INTEGER, PAIR, PAIR)), VECTOR, MATRIX),
    checked=False,
)
def fill_rates(curve, tape, work, p, found, panel, nodes, out):  # type: ignore[no-untyped-def]
    """Fill the rows of ``out`` with dt/dphi, ds/dphi and the regular factor of the speed at the nodes of a panel.

    Parameters
    ----------
    curve, tape, work, p, found
        As for `find_ends`.
    panel : (kind, middle, reach)
        The segment's kind (`quadrature.substitution`), the phase angle in the middle of the panel, and the angle from
        there to its end, two doubles each.
    nodes : (n,) array
        Nodes between -1 and 1.
    out : (3, n) array
        Filled.

    Returns
    -------
    bool
        Whether the errors are small enough at all nodes, and V**2 is positive there.
    """
    curve, work, found = unshared(curve), borrowed(work), borrowed(found)
    nodes, out = borrowed(nodes), borrowed(out)
    address, operations, parts, registers = tape
    tape = (address, borrowed(operations), parts, registers)
    fill_parameters(tape, borrowed(p), work)
    path = Path(curve, tape, work, (found[LEVEL, 0], found[LEVEL, 1], found[LEVEL, 2], found[LEVEL, 3]))
    first, base, width = int(found[LOWER, 0]), (found[BASE, 0], found[BASE, 1]), (found[WIDTH, 0], found[WIDTH, 1])
    n, rows = nodes.size, np.empty((4, nodes.size))
    kind, middle, reach = panel
    fill_shares(kind, middle, reach, nodes, rows)
    for i in range(n):
        ahead, ahead_low = multiply(rows[0, i], rows[1, i], width[0], width[1])
        number, place = place_at(curve, first, add(base[0], base[1], ahead, ahead_low))
        square, metric, error = rate_at(path, number, place)
        if not 0.5 * error <= MAX_RATE_ERROR * square[0]:
            return False
        speed, speed_low = square_root(square[0], square[1])
        length, low = multiply(rows[2, i], rows[3, i], metric[0], metric[1])
        length, low = multiply(length, low, width[0], width[1])
        time, _ = divide(length, low, speed, speed_low)
        factor, _ = divide(speed, speed_low, rows[2, i], rows[3, i])
        out[0, i], out[1, i], out[2, i] = fabs(time), fabs(length), GROWTHS[kind] * factor
    return True


class ChartRates:
    """The integrands at the nodes of panels of one segment of a chart.

    Parameters
    ----------
    launch : LaunchOnChart
        The launch.
    kind : int
        The segment's kind (`quadrature.substitution`).
    ends : (float, float)
        Its ends as doubles.
    whats : (float, float)
        What they are, from PLACE to CURVE_END.

    Attributes
    ----------
    is_known : bool
        Whether both ends were found.
    ends : (float, float)
        The ends, each the double nearest to it.
    """

    def __init__(self, launch: LaunchOnChart, kind: int, ends: tuple[float, float], whats: tuple[float, float]) -> None:
        self._kind, self.is_known, pieces = kind, False, launch.pieces
        located = begin_orbit(launch, ends, 1)
        if located is None:
            return
        found = np.full((LAST + 1, COLUMNS), nan)
        found[:ROWS] = located[-1]
        self._given: Any = *located[:-1], found
        a, b = ((*plus(pieces.start_length, (end, 0.0)), what) for end, what in zip(ends, whats, strict=True))
        find_ends(*located[:-1], (a, b), pieces.begin, found)
        self.is_known = bool(np.isfinite(found[BASE:, :2]).all())
        places = [minus(found[row, :2].tolist(), pieces.start_length)[0] for row in (FIRST, LAST)]
        turns = [what == TURNING_POINT for what in whats]
        self.ends = places[0] if turns[0] else ends[0], places[1] if turns[1] else ends[1]

    def __call__(self, middle: Pair, reach: Pair, nodes: Array) -> Array | None:
        """Return dt/dphi in s, ds/dphi in m and the regular factor of the speed in m/s at the nodes of a panel; None
        if the errors are too large.

        Parameters
        ----------
        middle, reach : pair of float
            The phase angle in the middle of the panel, and the angle from there to its end.
        nodes : (n,) array
            Nodes between -1 and 1.
        """
        out = np.empty((3, nodes.size))
        return out if fill_rates(*self._given, (self._kind, middle, reach), nodes, out) else None
