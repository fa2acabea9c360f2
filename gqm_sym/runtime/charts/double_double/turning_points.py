"""The launch and the turning points of an orbit along a chart in double-double arithmetic, by Newton's method."""

from math import fabs, nan

from numba import types

from gqm_sym.runtime.charts.double_double.pieces import TRUE_CURVE, arc_between, foot, place_at, speed_at, unshared
from gqm_sym.runtime.charts.double_double.potential import Path, energy_at, position
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.registers import borrowed
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, REAL, VECTOR
from gqm_sym.runtime.double_double.arithmetic import UNIT, add, divide, multiply
from gqm_sym.runtime.double_double.quadrature import TAPE, fill_parameters

# The number of Newton steps to a turning point; the largest change in the last but one; and the number of times that
# the search may pass to a neighbouring piece.
MAX_STEPS, MAX_LAST_STEP, MAX_MOVES = 12, 1e-15, 4

# A place this close to the edge of a piece counts as the edge.
AT_EDGE = 2.0**-98

# Rows of the array that `locate` fills. LAUNCH, LOWER, UPPER and MIDDLE are the launch, the lower and the upper turning
# point and a place between them (number of the piece, place on it as two doubles, error). LEVEL is the energy level
# with both errors of `Path`. BEHIND, AHEAD and PLACE are the arc lengths from the lower turning point to the launch,
# from the launch to the upper turning point, and from the left edge of the starting piece to the launch (two doubles,
# error).
LAUNCH, LOWER, UPPER, MIDDLE, LEVEL, BEHIND, AHEAD, PLACE = range(8)
ROWS, COLUMNS = 8, 4


@Inner
def find_turn(path, number, place, inward):  # type: ignore[no-untyped-def]
    """Return the turning point (piece, place) near a place, a bound on half V**2 there, and its slope.

    ``inward`` is 1 if the motion lies above it, -1 if below. The place is NaN where Newton's method fails.
    """
    before, moves, side = 0.0, 0, float(inward)
    for _ in range(MAX_STEPS):
        (value, value_low, error), slope, speed = energy_at(path, number, place)
        half, half_low = add(path.level[0], path.level[1], -value, -value_low)
        step, step_low = divide(half, half_low, slope[0], slope[1])
        place = add(place[0], place[1], step, step_low)
        over = (side * place[0] - 1.0) + side * place[1] >= -AT_EDGE
        under = (side * place[0] + 1.0) + side * place[1] < -AT_EDGE
        if fabs(step) < 0.5 and moves < MAX_MOVES and (over or under):
            # The turning point lies on a neighbouring piece, or on the edge between the two pieces.
            direction = inward if over else -inward
            if path.curve.period > 0.0 or 0 <= number + direction < path.curve.counts.shape[0]:
                number, place, before, moves = number + direction, (-float(direction), 0.0), 0.0, moves + 1
                continue
        if 0.0 < before < MAX_LAST_STEP or step == 0.0:
            ratio = step / before if before > 0.0 else 0.0
            if side * place[0] < -1.0:
                place = (-side, 0.0)
            return (number, place[0], place[1]), fabs(half) * ratio * ratio + error, slope[0] / speed
        before = fabs(step)
    return (number, nan, nan), nan, nan


@entry(
    types.void(TRUE_CURVE, TAPE, VECTOR, MATRIX, types.UniTuple(REAL, 9), types.UniTuple(REAL, 3), INTEGER, MATRIX),
    checked=False,
)
def locate(curve, tape, work, p, launch, ends, start, found):  # type: ignore[no-untyped-def]
    """Find the launch of an orbit, its energy level, and its turning points; values that are not found are NaN.

    Parameters
    ----------
    curve : TrueCurve
        The curve.
    tape : (address, operations, parts, registers)
        The address of the interpreter, and the potential by coordinates
        (`tapes.record_by_coordinates`).
    work, p
        As for `orbit_time.orbit_time`.
    launch : tuple of float
        The launch's arc length from the left edge of the piece ``start``, and its speed, two doubles each; 1 if the
        launch is given by coordinates (the arc length is then a guess), else 0; and x and z, two doubles each.
    ends : (low, high, is_closed)
        Both turning points in arc length, to the accuracy of doubles. ``is_closed`` is 0 for a libration; otherwise
        there are no turning points to be found.
    start : int
        The piece from whose left edge arc length is measured.
    found : (ROWS, COLUMNS) array
        Filled. On entry it contains the error of the launch in arc length.
    """
    curve, work, found = unshared(curve), borrowed(work), borrowed(found)
    address, operations, parts, registers = tape
    tape = (address, borrowed(operations), parts, registers)
    fill_parameters(tape, borrowed(p), work)
    length, length_low, v0, v0_low, by_point, x, x_low, z, z_low = launch
    uncertainty = found[LAUNCH, 3]
    number, launch_place = place_at(curve, start, (length, length_low))
    if by_point != 0.0:
        launch_place = foot(curve, number, launch_place, (x, x_low, z, z_low))
    path = Path(curve, tape, work, (0.0, 0.0, 0.0, 0.0))
    (value, value_low, error), slope, speed = energy_at(path, number, launch_place)
    half, half_low = multiply(v0, v0_low, 0.5 * v0, 0.5 * v0_low)
    high, low = add(value, value_low, half, half_low)
    level = (high, low, 0.0, error + UNIT * half + fabs(slope[0]) * (uncertainty / speed + 4.0 * UNIT))
    found[:] = nan
    found[LAUNCH, 0], found[LAUNCH, 1], found[LAUNCH, 2], found[LAUNCH, 3] = (
        number,
        launch_place[0],
        launch_place[1],
        uncertainty,
    )
    if by_point != 0.0:
        length, length_low = arc_from(curve, start, number, launch_place)
    found[PLACE, 0], found[PLACE, 1], found[PLACE, 2] = length, length_low, uncertainty
    if ends[2] == 0.0:
        path, residual = Path(curve, tape, work, level), 0.0
        for row, place, inward in ((LOWER, ends[0], 1), (UPPER, ends[1], -1)):
            guess, near = place_at(curve, number, (place - position(curve, number, -1.0), 0.0))
            turn, left, fall = find_turn(path, guess, near, inward)
            found[row, 0], found[row, 1], found[row, 2], found[row, 3] = (
                turn[0],
                turn[1],
                turn[2],
                (left + level[3]) / fabs(fall),
            )
            residual = max(residual, left)
        level = (level[0], level[1], residual, level[3])
        fill_middle(curve, found)
    found[LEVEL, 0], found[LEVEL, 1], found[LEVEL, 2], found[LEVEL, 3] = level


@Inner
def arc_from(curve, start, number, place):  # type: ignore[no-untyped-def]
    """Return the arc length from the left edge of a piece to a place before or behind it."""
    edge = (-1.0, 0.0)
    if number >= start:
        return arc_between(curve, start, edge, number, place)[0]
    arc, _ = arc_between(curve, number, place, start, edge)
    return -arc[0], -arc[1]


@Inner
def move_launch(curve, found, first, last):  # type: ignore[no-untyped-def]
    """Move a launch on the edge of two pieces to that piece of the motion which it is not on."""
    number = int(found[LAUNCH, 0])
    edge = 1.0 if number == first - 1 else -1.0 if number == last + 1 else 0.0
    beyond = (found[LAUNCH, 1] - edge) + found[LAUNCH, 2]
    if edge != 0.0 and edge * beyond >= -AT_EDGE:
        other = number + int(edge)
        beyond *= speed_at(curve, number, (edge, 0.0)) / speed_at(curve, other, (-edge, 0.0))
        found[LAUNCH, 0], found[LAUNCH, 1], found[LAUNCH, 2] = other, -edge, beyond


@Inner
def fill_middle(curve, found):  # type: ignore[no-untyped-def]
    """Fill the arc lengths between launch and turning points, and a place between these."""
    first, last = int(found[LOWER, 0]), int(found[UPPER, 0])
    move_launch(curve, found, first, last)
    number = int(found[LAUNCH, 0])
    low, high = (found[LOWER, 1], found[LOWER, 2]), (found[UPPER, 1], found[UPPER, 2])
    place = found[LAUNCH, 1], found[LAUNCH, 2]
    if not (low[0] == low[0] and high[0] == high[0] and first <= number <= last):
        found[LOWER, 1] = nan
        return
    arc, error = arc_between(curve, first, low, number, place)
    found[BEHIND, 0], found[BEHIND, 1], found[BEHIND, 2] = arc[0], arc[1], error + found[LAUNCH, 3] + found[LOWER, 3]
    arc, error = arc_between(curve, number, place, last, high)
    found[AHEAD, 0], found[AHEAD, 1], found[AHEAD, 2] = arc[0], arc[1], error + found[LAUNCH, 3] + found[UPPER, 3]
    middle = 0.5 * (low[0] + high[0])
    if first != last:
        target = 0.5 * (position(curve, first, low[0]) + position(curve, last, high[0]))
        between = first
        while between < last and position(curve, between, 1.0) <= target:
            between += 1
        edge = position(curve, between, -1.0)
        middle = 2.0 * (target - edge) / (position(curve, between, 1.0) - edge) - 1.0
        middle = max(-0.9, min(0.9, middle))
        if between == first:
            middle = max(middle, 0.5 * (low[0] + 1.0))
        elif between == last:
            middle = min(middle, 0.5 * (high[0] - 1.0))
        first = between
    found[MIDDLE, 0], found[MIDDLE, 1], found[MIDDLE, 2] = first, middle, 0.0
