"""One orbit along a chart in double-double arithmetic: half period or lap time, turning points, and times along the
orbit.
"""

from functools import cached_property
from math import nan
from typing import Any, NamedTuple

import numpy as np
from numba import types

from gqm_sym.literals.numbers import Number
from gqm_sym.runtime.arithmetic.doubledouble import Pair, minus, plus
from gqm_sym.runtime.charts.double_double.making import TruePieces
from gqm_sym.runtime.charts.double_double.pieces import (
    TRUE_CURVE,
    arc_between,
    place_at,
    unshared,
)
from gqm_sym.runtime.charts.double_double.potential import Path
from gqm_sym.runtime.charts.double_double.times import time_on_piece
from gqm_sym.runtime.charts.double_double.turning_points import (
    AHEAD,
    BEHIND,
    COLUMNS,
    LAUNCH,
    LEVEL,
    LOWER,
    MIDDLE,
    PLACE,
    ROWS,
    UPPER,
    locate,
)
from gqm_sym.runtime.compiled.jit import entry
from gqm_sym.runtime.compiled.registers import borrowed
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, REAL, VECTOR, Array
from gqm_sym.runtime.double_double.arithmetic import UNIT, add, multiply, sine_and_cosine
from gqm_sym.runtime.double_double.orbit_time import MAX_ERROR, BoundedNumber, Orbit
from gqm_sym.runtime.double_double.quadrature import TAPE, fill_parameters
from gqm_sym.runtime.double_double.recording import BoundTape

# The largest difference between distances of turning points from the launch and those in doubles, as a share of the
# orbit's width. A larger one means that another turning point was found.
MAX_MISMATCH = 1e-6

# Launches that are more laps away than this are left to multiprecision.
MAX_LAPS = 100


@entry(types.void(TRUE_CURVE, MATRIX, VECTOR, types.UniTuple(REAL, 3), MATRIX), checked=False)
def fill_stops(curve, found, phases, width, stops):  # type: ignore[no-untyped-def]
    """Fill the places (piece, place as two doubles) at phase angles, or at shares of a lap.

    ``width`` contains the orbit's width in arc length as two doubles, negative for a lap backwards, and then 1 for a
    libration and 0 for a lap.
    """
    curve, found = unshared(curve), borrowed(found)
    row = LOWER if width[2] != 0.0 else LAUNCH
    number, place = int(found[row, 0]), (found[row, 1], found[row, 2])
    base, _ = arc_between(curve, number, (-1.0, 0.0), number, place)
    for i in range(phases.size):
        share, share_low = phases[i], 0.0
        if width[2] != 0.0:
            s, s_low, _, _ = sine_and_cosine(0.5 * share, 0.0)
            share, share_low = multiply(s, s_low, s, s_low)
        distance, distance_low = multiply(share, share_low, width[0], width[1])
        other, to = place_at(curve, number, add(base[0], base[1], distance, distance_low))
        stops[i, 0], stops[i, 1], stops[i, 2] = other, to[0], to[1]


@entry(types.void(TRUE_CURVE, TAPE, VECTOR, MATRIX, MATRIX, MATRIX, MATRIX, INTEGER), checked=False)
def fill_passage(curve, tape, work, p, found, stops, times, middle):  # type: ignore[no-untyped-def]
    """Fill the times (two doubles, error) from the lower turning point, or from the launch of a lap, to some stops.

    Parameters
    ----------
    curve, tape, work, p, found
        As for `locate`.
    stops : (n, 3) array
        Places, in ascending order; for a lap backwards in descending order.
    times : (n, 3) array
        Filled.
    middle : int
        The number of the first stop that is nearer to the upper turning point; -1 for a lap.
    """
    curve, work, found = unshared(curve), borrowed(work), borrowed(found)
    stops, times = borrowed(stops), borrowed(times)
    address, operations, parts, registers = tape
    tape = (address, borrowed(operations), parts, registers)
    fill_parameters(tape, borrowed(p), work)
    path = Path(curve, tape, work, (found[LEVEL, 0], found[LEVEL, 1], found[LEVEL, 2], found[LEVEL, 3]))
    row = LOWER if middle >= 0 else LAUNCH
    number, place = int(found[row, 0]), (found[row, 1], found[row, 2])
    direction = -1 if stops[stops.shape[0] - 1, 0] < number else 1
    high, low, error = 0.0, 0.0, 0.0
    for j in range(stops.shape[0]):
        inward = 0 if middle < 0 else 1 if j <= middle else -1
        end = LOWER if inward >= 0 else UPPER
        turn = int(found[end, 0]) if inward != 0 else 0, found[end, 1], found[end, 2]
        last = int(stops[j, 0])
        while True:
            to = (stops[j, 1], stops[j, 2]) if number == last else (float(direction), 0.0)
            if to[0] != place[0] or to[1] != place[1]:
                one, other = (place, to) if direction > 0 else (to, place)
                part, rounding = time_on_piece(path, number, one, other, turn, inward)
                high, low = add(high, low, part[0], part[1])
                error += rounding + UNIT * high
            place = to
            if number == last or high != high:
                break
            number, place = number + direction, (-float(direction), 0.0)
        times[j, 0], times[j, 1], times[j, 2] = high, low, error


class ChartPassage:
    """One orbit along a chart in double-double arithmetic.

    Parameters
    ----------
    pieces : TruePieces
        The curve.
    located : tuple
        The result of `begin_orbit`.
    direction : int
        0 for a libration, else the sign of ds/dt on a lap.

    Attributes
    ----------
    found : (ROWS, COLUMNS) array
        The result of `locate`.
    """

    def __init__(self, pieces: TruePieces, located: tuple[Any, ...], direction: int) -> None:
        self._pieces, self._located, self._direction = pieces, located, direction
        self.found: Array = located[-1]

    def _times(self, stops: Array, middle: int) -> Array:
        """Return the times to stops, with errors (`fill_passage`)."""
        times = np.empty((len(stops), 3))
        fill_passage(*self._located, stops, times, middle)
        return times

    @property
    def offsets(self) -> tuple[float, float]:
        """The distances of the turning points from the launch in arc length."""
        return float(self.found[BEHIND, 0]), float(self.found[AHEAD, 0])

    @property
    def turning_points(self) -> tuple[BoundedNumber, BoundedNumber]:
        """The lower and the upper turning point of a libration in arc length."""
        found = self.found
        place = minus(found[PLACE, :2].tolist(), self._pieces.start_length)
        distances = minus((0.0, 0.0), found[BEHIND, :2].tolist()), found[AHEAD, :2].tolist()
        low, high = (found[PLACE, 2] + found[[BEHIND, AHEAD], 2]).tolist()
        return BoundedNumber(*plus(place, distances[0]), low), BoundedNumber(*plus(place, distances[1]), high)

    @cached_property
    def orbit(self) -> Orbit | None:
        """Return duration and turning points; None if double-double arithmetic does not suffice."""
        found = self.found
        if self._direction:
            count = len(self._pieces.curve.counts)
            stop = found[LAUNCH, :3] + (self._direction * count, 0.0, 0.0)
            duration = BoundedNumber(*self._times(stop[None], -1)[-1].tolist())
            ends = (BoundedNumber(nan, nan, nan),) * 2
        else:
            duration = BoundedNumber(*self._times(found[[MIDDLE, UPPER], :3], 0)[-1].tolist())
            ends = self.turning_points
        return Orbit(duration, *ends) if duration.error <= MAX_ERROR * duration.high else None

    def times_at(self, phases: Array, *, is_thrown: bool) -> Array | None:
        """Return the times at phase angles, or at shares of a lap, in ascending order, followed by the time of the
        launch.

        The time of the launch has no meaning unless the body is thrown: otherwise it starts from rest at a turning
        point.

        Returns
        -------
        (n+1, 3) array or None
            Two doubles each, with a bound on the error; None if one of them is not found.
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


class LaunchOnChart(NamedTuple):
    """A launch on a chart.

    Attributes
    ----------
    pieces : TruePieces
        The curve.
    formulas : BoundTape
        The effective potential as a function of the plane.
    lam0, v0 : Number
        Launch place, and speed in m/s.
    point : (Number, Number) or None
        The coordinates of the place if it was given by them.
    offset : pair of float
        The distance of the body's path to the left of the curve (`TrueCurve`).
    """

    pieces: TruePieces
    formulas: BoundTape
    lam0: Number
    v0: Number
    point: tuple[Number, Number] | None
    offset: Pair


def begin_orbit(launch: LaunchOnChart, ends: tuple[float, float], direction: int) -> tuple[Any, ...] | None:
    """Make the pieces of an orbit, and find its launch, its energy level and the turning points of a libration.

    The parameters are those of `pass_along`.

    Returns
    -------
    (curve, tape, work, p, found) or None
        The arguments of `locate` with its result; None if the orbit is too many laps away from the start.
    """
    pieces, formulas, lam0, v0, point, offset = launch
    begin, count = pieces.begin, len(pieces.curve.counts)
    numbers = [begin, *map(pieces.number_of, (lam0.value, *ends))]
    if max(numbers) - min(numbers) > MAX_LAPS * count:
        return None
    pieces.make(min(numbers) - 1, max(numbers) + 1)
    x, z = point or (lam0, lam0)
    length = plus(pieces.start_length, (lam0.value, lam0.low))
    place = *length, v0.value, v0.low, float(point is not None), x.value, x.low, z.value, z.low
    found = np.full((ROWS, COLUMNS), nan)
    found[LAUNCH, 3] = pieces.doubt + UNIT * max(abs(x.value), abs(z.value))
    given: Any = pieces.curve._replace(offset=offset), *formulas.operands
    locate(*given, place, (*ends, float(direction != 0)), begin, found)
    return *given, found


def pass_along(launch: LaunchOnChart, ends: tuple[float, float], direction: int) -> ChartPassage | None:
    """Return an orbit along a chart; None if double-double arithmetic does not suffice.

    Parameters
    ----------
    launch : LaunchOnChart
        The launch.
    ends : (float, float)
        The turning points of a libration, or the ends of a lap, as doubles know them.
    direction : int
        0 for a libration, else the sign of ds/dt on a lap.
    """
    located = begin_orbit(launch, ends, direction)
    if located is None:
        return None
    passage, lam0 = ChartPassage(launch.pieces, located, direction), launch.lam0
    if direction == 0:
        (behind, ahead), enough = passage.offsets, MAX_MISMATCH * (ends[1] - ends[0])
        if not (abs(behind - lam0.value + ends[0]) <= enough and abs(ahead - ends[1] + lam0.value) <= enough):
            return None
    return passage if passage.found[LAUNCH, 1] == passage.found[LAUNCH, 1] else None
