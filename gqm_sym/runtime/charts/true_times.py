"""Half periods and lap times along charts in double-double arithmetic, with turning points and a bound.

V**2 is the plain difference of effective potentials, as for curves with formulas. The time is integrated piece by
piece (`true_pieces`) by Gauss-Legendre rules. Near a turning point the rules' nodes are spread by ``u = c + y**2``,
where c is the zero of V**2, or on a later piece where V**2 would vanish if the force were constant; there ``y/V`` is
smooth.
"""

from functools import cached_property
from math import fabs, nan, sqrt
from typing import Any, NamedTuple

import numpy as np
from numba import types

from gqm_sym.literals.numbers import Number
from gqm_sym.runtime.arithmetic.doubledouble import ZERO, Pair, minus, plus
from gqm_sym.runtime.charts.true_pieces import (
    DX,
    DX_LOW,
    DZ,
    DZ_LOW,
    SHARE,
    TRUE_CURVE,
    X_LOW,
    Z_LOW,
    TruePieces,
    X,
    Z,
    arc_between,
    fill_path,
    foot,
    piece_of,
    place_at,
    stacked_places,
    stacked_points,
    unshared,
)
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.registers import on_stack, uncounted
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, REAL, VECTOR, Array
from gqm_sym.runtime.double_double.arithmetic import UNIT, add, divide, multiply, sine_and_cosine, square_root
from gqm_sym.runtime.double_double.interpreter import ERROR, LOW, ROW, call_interpreter
from gqm_sym.runtime.double_double.nodes import RULE
from gqm_sym.runtime.double_double.orbit_time import MAX_ERROR, TAPE, Bounded, Orbit, fill_parameters
from gqm_sym.runtime.double_double.recording import BoundTape

# A panel is resolved if its last two Legendre coefficients are below this share of the first: the error of the rule is
# about the square of that. Others are halved, as often as this.
MAX_TAIL, MAX_HALVINGS = 1e-13, 40

# The largest ratio of the values of y at both ends of a panel behind a turning point on another piece; a power of 2.
MAX_RATIO = 2.0

# On a piece that is nearer to a turning point than so many of its lengths, the nodes are spread for that.
MAX_NEAR = 4.0

# On a panel from a turning point, how much more the force changes than its mean over the distance from there.
MAX_FORCE_RATIO = 4.0

# Steps of Newton's method to a turning point, of which the last but one moves it by less than this; and how often it
# may go to a neighbouring piece.
MAX_STEPS, MAX_LAST_STEP, MAX_MOVES = 12, 1e-15, 4

# A place this close to the edge of a piece is at the edge.
AT_EDGE = 2.0**-98

# The largest difference between distances of turning points from the launch and those in doubles, as a share of the
# orbit's width. More means another turning point.
MAX_MISMATCH = 1e-6

# Rows of what `locate` finds: the launch, the lower and the upper turning point, and a place between them (number of
# the piece, place on it as two doubles, error); the energy level with both errors of `Path`, and the arc lengths from
# the lower turning point to the launch, from there to the upper one, and from the left edge of the piece where it
# begins to the launch (two doubles, error).
LAUNCH, LOWER, UPPER, MIDDLE, LEVEL, BEHIND, AHEAD, PLACE = range(8)
ROWS, COLUMNS = 8, 4

# Launches more laps away than this are left to multiprecision.
MAX_LAPS = 100

stacked_sums = on_stack(3 * RULE)


class Path(NamedTuple):
    """What the time along a curve depends on: the curve, the tape of the potential, its registers, and the level.

    The energy level is two doubles, a bound on what differences from it are off by at turning points, and one on its
    own error, by which turning points are shifted.
    """

    curve: Any
    tape: Any
    work: Any
    level: Any


@Inner
def fill_registers(tape, work, n, points, error):  # type: ignore[no-untyped-def]
    """Fill the registers of the coordinates from points."""
    place = tape[3][1]
    for i in range(n):
        x, z = place + i, place + ROW + i
        work[x], work[x + LOW], work[x + ERROR] = points[X + i], points[X_LOW + i], error
        work[z], work[z + LOW], work[z + ERROR] = points[Z + i], points[Z_LOW + i], error


@Inner
def energy_at(path, number, at):  # type: ignore[no-untyped-def]
    """Return at a place on a piece the potential (two doubles, error), its derivative by u, and that of arc length.

    The potential is that of the body's path, arc length that of the curve.
    """
    curve, tape, work, _ = path
    address, operations, parts, registers = tape
    u, points = stacked_places(), stacked_points()
    u[0], u[RULE] = at
    error, _ = fill_path(curve, number, 1, u, points)
    fill_registers(tape, work, 1, points, error)
    call_interpreter(address, operations, parts[0], parts[2], work, 1)
    value, by_x, by_z = registers[2], registers[3], registers[4]
    s, s_low = multiply(work[by_x], work[by_x + LOW], points[DX], points[DX_LOW])
    t, t_low = multiply(work[by_z], work[by_z + LOW], points[DZ], points[DZ_LOW])
    slope = add(s, s_low, t, t_low)
    speed = sqrt(points[DX] * points[DX] + points[DZ] * points[DZ]) / fabs(points[SHARE])
    return (work[value], work[value + LOW], work[value + ERROR]), slope, speed


@Inner
def fill_places(curve, left, width, spread, u, factors):  # type: ignore[no-untyped-def]
    """Fill the places of a panel's nodes, and the factors (two doubles each) of the integrand there.

    ``spread`` is (sign, origin, origin_low): with sign 0 the panel is one of u, else of y, u = origin + sign*y**2.
    """
    rule, (sign, origin, origin_low) = curve.rule, spread
    for i in range(RULE):
        way, way_low = multiply(width[0], width[1], rule[0, i], rule[1, i])
        u[i], u[RULE + i] = add(left[0], left[1], way, way_low)
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
    the turning point by e/q, so that V**2 changes, at the same distance, only as the force does on the way.
    """
    curve, tape, work, level = path
    address, operations, parts, registers = tape
    u, points, factors, sums = stacked_places(), stacked_points(), stacked_places(), stacked_sums()
    width = add(right[0], right[1], -left[0], -left[1])
    fill_places(curve, left, width, spread, u, factors)
    error, rate_error = fill_path(curve, number, RULE, u, points)
    fill_registers(tape, work, RULE, points, error)
    call_interpreter(address, operations, parts[0], parts[1], work, RULE)
    potential = work[registers[2] : registers[2] + ROW]
    from_turn, q, shift, rate = spread[0] != 0.0 and left[0] == 0.0, 1.0, level[3], 0.0
    for i in range(RULE):
        half, half_low = add(level[0], level[1], -potential[i], -potential[LOW + i])
        s, s_low = multiply(points[DX + i], points[DX_LOW + i], points[DX + i], points[DX_LOW + i])
        t, t_low = multiply(points[DZ + i], points[DZ_LOW + i], points[DZ + i], points[DZ_LOW + i])
        s, s_low = add(s, s_low, t, t_low)
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
    """Return the time between two places of a piece, in panels that are halved until resolved, with its error.

    Behind a turning point very near the edge of another piece the integrand has terms in 1/y**2 if the curvature jumps
    there: no panel has ends of too different y, because its nodes would miss them.
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
def position(curve, number, at):  # type: ignore[no-untyped-def]
    """Return a place in arc length, roughly."""
    count = curve.counts.shape[0]
    k = piece_of(curve, number)
    low, high = curve.edges[k], curve.edges[k + 1]
    return low + 0.5 * (1.0 + at) * (high - low) + (number // count) * curve.period


@Inner
def root_of_gap(one, other):  # type: ignore[no-untyped-def]
    """Return the square root of the distance of two places of a piece."""
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
            rest = ((path.level[0] - value) + (path.level[1] - value_low)) / (-sign * slope[0])
            if 0.0 < rest <= MAX_NEAR * 2.0:
                origin, origin_low = add(near[0], near[1], -sign * rest, 0.0)
                spread = (sign, origin, origin_low)
    if spread[0] == 0.0:
        return time_by_panels(path, number, low, high, spread)
    origin = spread[1], spread[2]
    return time_by_panels(path, number, root_of_gap(near, origin), root_of_gap(far, origin), spread)


@Inner
def find_turn(path, number, at, inward):  # type: ignore[no-untyped-def]
    """Return the turning point near a place (piece, place), and a bound on half V**2 there with its slope.

    ``inward`` is 1 if the motion lies above it, -1 if below. The place is NaN where Newton's method fails.
    """
    before, moves, side = 0.0, 0, float(inward)
    for _ in range(MAX_STEPS):
        (value, value_low, error), slope, speed = energy_at(path, number, at)
        half, half_low = add(path.level[0], path.level[1], -value, -value_low)
        step, step_low = divide(half, half_low, slope[0], slope[1])
        at = add(at[0], at[1], step, step_low)
        over = side * at[0] - 1.0 + side * at[1]
        if fabs(step) < 0.5 and moves < MAX_MOVES and (over >= -AT_EDGE or over < -2.0 - AT_EDGE):
            # The turning point lies on a neighbouring piece, or on the edge that it has in common with it.
            way = inward if over >= -AT_EDGE else -inward
            if path.curve.period > 0.0 or 0 <= number + way < path.curve.counts.shape[0]:
                number, at, before, moves = number + way, (-float(way), 0.0), 0.0, moves + 1
                continue
        if 0.0 < before < MAX_LAST_STEP or step == 0.0:
            ratio = step / before if before > 0.0 else 0.0
            if side * at[0] < -1.0:
                at = (-side, 0.0)
            return (number, at[0], at[1]), fabs(half) * ratio * ratio + error, slope[0] / speed
        before = fabs(step)
    return (number, nan, nan), nan, nan


@entry(
    types.void(TRUE_CURVE, TAPE, VECTOR, MATRIX, types.UniTuple(REAL, 9), types.UniTuple(REAL, 3), INTEGER, MATRIX),
    checked=False,
)
def locate(curve, tape, work, p, launch, ends, start, found):  # type: ignore[no-untyped-def]
    """Find the launch of an orbit, its energy level, and its turning points; what is not found is NaN.

    Parameters
    ----------
    curve : TrueCurve
        The curve.
    tape : (address, operations, parts, registers)
        The address of the interpreter, and the potential as a function of the plane (`recording.record_in_plane`).
    work, p
        As for `orbit_time.orbit_time`.
    launch : tuple of float
        The launch's arc length from the left edge of the piece ``start``, and its speed, two doubles each; whether it
        is given by coordinates (then the arc length is a guess), and x and z, two doubles each.
    ends : (low, high, is_closed)
        Both turning points in arc length as doubles know them; or whether the motion goes round instead.
    start : int
        The piece from whose left edge arc length is measured.
    found : (ROWS, COLUMNS) array
        Filled; of the launch the error in arc length is given.
    """
    curve, work, found = unshared(curve), uncounted(work), uncounted(found)
    address, operations, parts, registers = tape
    tape = (address, uncounted(operations), parts, registers)
    fill_parameters(tape, uncounted(p), work)
    length, length_low, v0, v0_low, by_point, x, x_low, z, z_low = launch
    doubt = found[LAUNCH, 3]
    number, at = place_at(curve, start, (length, length_low))
    if by_point != 0.0:
        at = foot(curve, number, at, (x, x_low, z, z_low))
    path = Path(curve, tape, work, (0.0, 0.0, 0.0, 0.0))
    (value, value_low, error), slope, speed = energy_at(path, number, at)
    half, half_low = multiply(v0, v0_low, 0.5 * v0, 0.5 * v0_low)
    high, low = add(value, value_low, half, half_low)
    level = (high, low, 0.0, error + UNIT * half + fabs(slope[0]) * (doubt / speed + 4.0 * UNIT))
    found[:] = nan
    found[LAUNCH, 0], found[LAUNCH, 1], found[LAUNCH, 2], found[LAUNCH, 3] = number, at[0], at[1], doubt
    if by_point != 0.0:
        length, length_low = arc_from(curve, start, number, at)
    found[PLACE, 0], found[PLACE, 1], found[PLACE, 2] = length, length_low, doubt
    if ends[2] == 0.0:
        path, rest = Path(curve, tape, work, level), 0.0
        for row, place, inward in ((LOWER, ends[0], 1), (UPPER, ends[1], -1)):
            guess, near = place_at(curve, number, (place - position(curve, number, -1.0), 0.0))
            turn, left, fall = find_turn(path, guess, near, inward)
            found[row, 0], found[row, 1], found[row, 2], found[row, 3] = (
                turn[0],
                turn[1],
                turn[2],
                (left + level[3]) / fabs(fall),
            )
            rest = max(rest, left)
        level = (level[0], level[1], rest, level[3])
        fill_middle(curve, found)
    found[LEVEL, 0], found[LEVEL, 1], found[LEVEL, 2], found[LEVEL, 3] = level


@Inner
def arc_from(curve, start, number, at):  # type: ignore[no-untyped-def]
    """Return the arc length from the left edge of a piece to a place before or behind it."""
    edge = (-1.0, 0.0)
    if number >= start:
        return arc_between(curve, start, edge, number, at)[0]
    arc, _ = arc_between(curve, number, at, start, edge)
    return -arc[0], -arc[1]


@Inner
def fill_middle(curve, found):  # type: ignore[no-untyped-def]
    """Fill the arc lengths between launch and turning points, and a place between these."""
    first, last, number = int(found[LOWER, 0]), int(found[UPPER, 0]), int(found[LAUNCH, 0])
    low, high = (found[LOWER, 1], found[LOWER, 2]), (found[UPPER, 1], found[UPPER, 2])
    at = found[LAUNCH, 1], found[LAUNCH, 2]
    if not (low[0] == low[0] and high[0] == high[0] and first <= number <= last):
        found[LOWER, 1] = nan
        return
    arc, error = arc_between(curve, first, low, number, at)
    found[BEHIND, 0], found[BEHIND, 1], found[BEHIND, 2] = arc[0], arc[1], error + found[LAUNCH, 3] + found[LOWER, 3]
    arc, error = arc_between(curve, number, at, last, high)
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


@entry(types.void(TRUE_CURVE, MATRIX, VECTOR, types.UniTuple(REAL, 3), MATRIX), checked=False)
def fill_stops(curve, found, phases, width, stops):  # type: ignore[no-untyped-def]
    """Fill the places (piece, place as two doubles) at phase angles, or shares of a lap.

    ``width`` is the orbit's width in arc length as two doubles, negative for a lap backwards; then 1 for a libration.
    """
    curve, found = unshared(curve), uncounted(found)
    row = LOWER if width[2] != 0.0 else LAUNCH
    number, at = int(found[row, 0]), (found[row, 1], found[row, 2])
    base, _ = arc_between(curve, number, (-1.0, 0.0), number, at)
    for i in range(phases.size):
        share, share_low = phases[i], 0.0
        if width[2] != 0.0:
            s, s_low, _, _ = sine_and_cosine(0.5 * share, 0.0)
            share, share_low = multiply(s, s_low, s, s_low)
        way, way_low = multiply(share, share_low, width[0], width[1])
        other, to = place_at(curve, number, add(base[0], base[1], way, way_low))
        stops[i, 0], stops[i, 1], stops[i, 2] = other, to[0], to[1]


@entry(types.void(TRUE_CURVE, TAPE, VECTOR, MATRIX, MATRIX, MATRIX, MATRIX, INTEGER), checked=False)
def fill_passage(curve, tape, work, p, found, stops, times, middle):  # type: ignore[no-untyped-def]
    """Fill the times (two doubles, error) from the lower turning point, or from the launch of a lap, to some stops.

    Parameters
    ----------
    curve, tape, work, p, found
        As for `locate`.
    stops : (n, 3) array
        Places, in ascending order; of a lap backwards in descending order.
    times : (n, 3) array
        Filled.
    middle : int
        The number of the stop from which on the upper turning point is the nearer one; -1 for a lap.
    """
    curve, work, found = unshared(curve), uncounted(work), uncounted(found)
    stops, times = uncounted(stops), uncounted(times)
    address, operations, parts, registers = tape
    tape = (address, uncounted(operations), parts, registers)
    fill_parameters(tape, uncounted(p), work)
    path = Path(curve, tape, work, (found[LEVEL, 0], found[LEVEL, 1], found[LEVEL, 2], found[LEVEL, 3]))
    row = LOWER if middle >= 0 else LAUNCH
    number, at = int(found[row, 0]), (found[row, 1], found[row, 2])
    way = -1 if stops[stops.shape[0] - 1, 0] < number else 1
    high, low, error = 0.0, 0.0, 0.0
    for j in range(stops.shape[0]):
        inward = 0 if middle < 0 else 1 if j <= middle else -1
        end = LOWER if inward >= 0 else UPPER
        turn = int(found[end, 0]) if inward != 0 else 0, found[end, 1], found[end, 2]
        last = int(stops[j, 0])
        while True:
            to = (stops[j, 1], stops[j, 2]) if number == last else (float(way), 0.0)
            if to[0] != at[0] or to[1] != at[1]:
                one, other = (at, to) if way > 0 else (to, at)
                part, rounding = time_on_piece(path, number, one, other, turn, inward)
                high, low = add(high, low, part[0], part[1])
                error += rounding + UNIT * high
            at = to
            if number == last or high != high:
                break
            number, at = number + way, (-float(way), 0.0)
        times[j, 0], times[j, 1], times[j, 2] = high, low, error


class ChartPassage:
    """One orbit along a chart in double-double arithmetic.

    Parameters
    ----------
    pieces : TruePieces
        The curve.
    formulas : BoundTape
        The effective potential as a function of the plane.
    found : (ROWS, COLUMNS) array
        What `locate` has found; it is an attribute, too.
    direction : int
        0 for a libration, else the sign of ds/dt on a lap.
    offset : pair of float
        How far to the left of the curve the body's path lies (`TrueCurve`).
    """

    def __init__(
        self, pieces: TruePieces, formulas: BoundTape, found: Array, direction: int, offset: Pair = ZERO
    ) -> None:
        self._pieces, self.found, self._direction = pieces, found, direction
        self._given = pieces.curve._replace(offset=offset), *formulas.operands, found

    def _times(self, stops: Array, middle: int) -> Array:
        """The times to stops, with errors (`fill_passage`)."""
        times = np.empty((len(stops), 3))
        fill_passage(*self._given, stops, times, middle)
        return times

    @property
    def offsets(self) -> tuple[float, float]:
        """The distances of the turning points from the launch in arc length."""
        return float(self.found[BEHIND, 0]), float(self.found[AHEAD, 0])

    @property
    def turning_points(self) -> tuple[Bounded, Bounded]:
        """The lower and the upper turning point of a libration in arc length."""
        found = self.found
        place = minus(found[PLACE, :2].tolist(), self._pieces.start_length)
        ways = minus((0.0, 0.0), found[BEHIND, :2].tolist()), found[AHEAD, :2].tolist()
        low, high = (found[PLACE, 2] + found[[BEHIND, AHEAD], 2]).tolist()
        return Bounded(*plus(place, ways[0]), low), Bounded(*plus(place, ways[1]), high)

    @cached_property
    def orbit(self) -> Orbit | None:
        """Duration and turning points; None where double-double arithmetic does not suffice."""
        found = self.found
        if self._direction:
            count = len(self._pieces.curve.counts)
            stop = found[LAUNCH, :3] + (self._direction * count, 0.0, 0.0)
            duration = Bounded(*self._times(stop[None], -1)[-1].tolist())
            ends = (Bounded(nan, nan, nan),) * 2
        else:
            duration = Bounded(*self._times(found[[MIDDLE, UPPER], :3], 0)[-1].tolist())
            ends = self.turning_points
        return Orbit(duration, *ends) if duration.error <= MAX_ERROR * duration.high else None

    def times_at(self, phases: Array, *, is_thrown: bool) -> Array | None:
        """The times at phase angles, or shares of a lap, in ascending order, and last that of the launch.

        The last one means nothing unless the body is thrown: it is at rest at a turning point else.

        Returns
        -------
        (n+1, 3) array or None
            Two doubles each, with a bound on the error; None where one is not found.
        """
        found, curve = self.found, self._pieces.curve
        if self._direction and not len(phases):
            return np.zeros((1, 3))
        if self._direction:
            stops = np.empty((len(phases), 3))
            total = np.sum(curve.lengths[:, 0])
            fill_stops(curve, found, phases, (self._direction * total, 0.0, 0.0), stops)
            times = self._times(stops, -1)
            return None if np.isnan(times).any() else np.append(times, np.zeros((1, 3)), axis=0)
        width = plus(found[BEHIND, :2].tolist(), found[AHEAD, :2].tolist())
        stops = np.empty((len(phases) + 2, 3))
        fill_stops(curve, found, phases, (*width, 1.0), stops[:-2])
        stops[-2:] = found[[LAUNCH if is_thrown else MIDDLE, MIDDLE], :3]
        order = np.lexsort((stops[:, 1], stops[:, 0]))
        times = np.empty_like(stops)
        times[order] = self._times(np.ascontiguousarray(stops[order]), int(np.argmax(order == len(phases) + 1)))
        return None if np.isnan(times).any() else times[:-1]


def pass_along(
    pieces: TruePieces,
    formulas: BoundTape,
    launch: tuple[Number, Number, tuple[Number, Number] | None],
    ends: tuple[float, float],
    direction: int,
    offset: Pair = ZERO,
) -> ChartPassage | None:
    """Return an orbit along a chart; None where double-double arithmetic does not suffice.

    Parameters
    ----------
    pieces : TruePieces
        The curve.
    formulas : BoundTape
        The effective potential as a function of the plane.
    launch : (Number, Number, (Number, Number) or None)
        Launch place and speed in m/s, and the coordinates of the place if it was given by them.
    ends : (float, float)
        The turning points of a libration, or the ends of a lap, as doubles know them.
    direction : int
        0 for a libration, else the sign of ds/dt on a lap.
    offset : pair of float
        How far to the left of the curve the body's path lies.
    """
    lam0, v0, point = launch
    begin, count = pieces.begin, len(pieces.curve.counts)
    numbers = [begin, *map(pieces.number_of, (lam0.value, *ends))]
    if max(numbers) - min(numbers) > MAX_LAPS * count:
        return None
    pieces.make(min(numbers) - 1, max(numbers) + 1)
    x, z = point or (lam0, lam0)
    length = plus(pieces.start_length, (lam0.value, lam0.low))
    given = *length, v0.value, v0.low, float(point is not None), x.value, x.low, z.value, z.low
    found = np.full((ROWS, COLUMNS), nan)
    found[LAUNCH, 3] = pieces.doubt + UNIT * max(abs(x.value), abs(z.value))
    passage = ChartPassage(pieces, formulas, found, direction, offset)
    curve, tape, work, p, _ = passage._given
    locate(curve, tape, work, p, given, (*ends, float(direction != 0)), begin, found)
    if direction == 0:
        (behind, ahead), enough = passage.offsets, MAX_MISMATCH * (ends[1] - ends[0])
        if not (abs(behind - lam0.value + ends[0]) <= enough and abs(ahead - ends[1] + lam0.value) <= enough):
            return None
    return passage if found[LAUNCH, 1] == found[LAUNCH, 1] else None
