"""The true pieces of a curve and how its points are displaced by the parameters that shape it.

The curve is known in double-double arithmetic, as polynomials of its pieces (`charts.double_double.pieces`). The
displacements are differences of these polynomials for neighbouring values of a parameter; they have some 20 digits,
because the polynomials have 31. Of some curves the maker of the chart knows the displacements.
"""

from collections.abc import Mapping
from fractions import Fraction
from typing import Any, Protocol

import numpy as np
from numba import types

from gqm_sym.literals.numbers import Number, read_number
from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.charts.chart import ChartMaker
from gqm_sym.runtime.charts.double_double.making import TruePieces, chebyshev_fit, chebyshev_powers, sample_places
from gqm_sym.runtime.charts.double_double.pieces import (
    DX,
    DY,
    DZ,
    IN_SAMPLES,
    NODES,
    TRUE_CURVE,
    X,
    Y,
    Z,
    fill_points,
    is_in_space,
    place_at,
    stacked_places,
    stacked_points,
    unshared,
)
from gqm_sym.runtime.charts.double_double.turning_points import arc_from
from gqm_sym.runtime.compiled.jit import entry
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, Array
from gqm_sym.runtime.double_double.arithmetic import add, multiply
from gqm_sym.runtime.double_double.nodes import RULE
from gqm_sym.runtime.gradients.charts.programs import size_of_point
from gqm_sym.runtime.launch.formulas import Formulas
from gqm_sym.runtime.launch.problem import Problem

# The step of a difference quotient of the curve's points in double-double arithmetic, as a share of the parameter. It
# is a power of 2; its square, which is the truncation error, is some 1e-18, and the rounding error divided by it is
# some 1e-20.
STEP = 2.0**-29

# Chebyshev coefficients of a displacement that are below this share of the largest are rounding if at least so many
# follow each other.
MAX_NOISE, TERMS_IN_A_ROW = 1e-19, 3

# Rows of a place: the number of its piece, and u on it as two doubles.
PLACE = 3


@entry(types.void(TRUE_CURVE, INTEGER, MATRIX, MATRIX), checked=False)
def fill_places(curve, number, lengths, places):  # type: ignore[no-untyped-def]
    """Fill the places (PLACE rows) at arc lengths, two doubles each, from the left edge of a piece."""
    curve = unshared(curve)
    for i in range(lengths.shape[1]):
        piece, place = place_at(curve, number, (lengths[0, i], lengths[1, i]))
        places[0, i], places[1, i], places[2, i] = piece, place[0], place[1]


@entry(types.void(TRUE_CURVE, MATRIX, MATRIX), checked=False)
def fill_coordinates(curve, places, rows):  # type: ignore[no-untyped-def]
    """Fill x and z, in space x, y and z, and then their derivatives with respect to u, two doubles each, at places."""
    curve, u, points = unshared(curve), stacked_places(), stacked_points()
    for i in range(places.shape[1]):
        u[0], u[RULE] = places[1, i], places[2, i]
        fill_points(curve, int(places[0, i]), 1, u, points)
        if is_in_space(curve):
            for k, column in enumerate((X, Y, Z, DX, DY, DZ)):
                rows[2 * k, i], rows[2 * k + 1, i] = points[column], points[column + RULE]
        else:
            for row in range(8):
                rows[row, i] = points[row * RULE]


@entry(types.void(TRUE_CURVE, INTEGER, MATRIX, MATRIX), checked=False)
def fill_arcs(curve, start, places, arcs):  # type: ignore[no-untyped-def]
    """Fill the arc lengths, two doubles each, from the left edge of a piece to places."""
    curve = unshared(curve)
    for i in range(places.shape[1]):
        arcs[0, i], arcs[1, i] = arc_from(curve, start, int(places[0, i]), (places[1, i], places[2, i]))


@entry(types.void(MATRIX, types.float64[:, :, ::1], MATRIX), checked=False)
def fill_series(samples, fit, series):  # type: ignore[no-untyped-def]
    """Fill the Chebyshev coefficients of functions, from their values at the Chebyshev points as two doubles each."""
    for row in range(series.shape[0]):
        for j in range(NODES):
            high, low = 0.0, 0.0
            for i in range(NODES):
                part, part_low = multiply(samples[2 * row, i], samples[2 * row + 1, i], fit[0, j, i], fit[1, j, i])
                high, low = add(high, low, part, part_low)
            series[row, j] = high


def shaping_of(formulas: Formulas) -> tuple[int, ...]:
    """Return the indices of the run-time parameters that shape a charted curve; those of all parameters if that is not
    known.
    """
    assert formulas.chart is not None
    shaped_by = formulas.chart.shaped_by
    return tuple(range(len(formulas.parameters))) if shaped_by is None else shaped_by


class Displacements(Protocol):
    """The displacements of the points of a chart by all parameters that shape it, which its maker knows."""

    def points(self, places: Array, orders: int) -> Array:
        """Return the displacements at places with their derivatives with respect to u below an order.

        Returns
        -------
        (parameters, orders * dimension, n) array
            For each parameter the rows of order 0, then those of order 1, and so on.
        """

    def pairs(self, places: Array) -> Array:
        """Return the displacements at places as two doubles each, of shape (parameters, dimension, 2, n)."""

    def arc_lengths(self, places: Array) -> Array:
        """Return the increase of the arc length from the start point to points of equal u: a row for each parameter."""


class ShapedPieces:
    """The true pieces of a curve, and those for neighbouring values of the parameters that shape it.

    Parameters
    ----------
    problem : Problem
        The launch with its module.
    pieces : TruePieces
        The curve.
    shaping : tuple of int
        The parameters. The displacement by a parameter is NaN where neighbouring curves do not exist: an exponent of a
        negative number may be an integer only.
    """

    def __init__(self, problem: Problem, pieces: TruePieces, shaping: tuple[int, ...]) -> None:
        self.pieces = pieces
        maker, chart = problem.formulas.chart, problem.formulas.charted(problem.p)
        assert maker is not None
        self._smoothed: dict[int, Array] = {}
        displacements = getattr(maker, "displacements", None) if shaping else None
        self._known: Displacements | None = None if displacements is None else displacements(chart)
        varied = shaping if self._known is None else ()
        for k in varied:
            if k not in pieces.beside:
                pieces.beside[k] = _beside(maker, problem.p, k, chart)
        self._beside = [pieces.beside[k] for k in varied]

    @property
    def dimension(self) -> int:
        """The number of coordinates."""
        rows: int = self.pieces.curve.terms.shape[1]
        return rows // 2

    @property
    def _terms(self) -> Array:
        """The coefficients of the coordinates in doubles."""
        terms: Array = self.pieces.curve.terms[:, ::2]
        return terms if self.dimension == 2 else terms[:, IN_SAMPLES]

    def _make(self, first: int, last: int) -> None:
        """Make the pieces of all curves from one piece number to another."""
        for side in (self.pieces, *(side for _, *sides in self._beside for side in sides)):
            side.make(first, last)

    def unknown(self, first: int, last: int) -> list[int]:
        """Return the indices of those of the parameters whose displacement is not known on all pieces from one number
        to another.
        """
        self._make(first, last)
        numbers = np.arange(first, last + 1) % len(self.pieces.curve.counts)
        return [
            i
            for i, (_, *sides) in enumerate(self._beside)
            if not sides or any(np.isnan(side.curve.lengths[numbers, 0]).any() for side in sides)
        ]

    def coordinates(self, places: Array) -> Array:
        """Return the points at places with their displacements, two doubles each, which are the coordinates that
        programs take.
        """
        self._make(int(places[0].min()), int(places[0].max()))
        d = self.dimension
        rows, curvature = [np.empty((4 * d, places.shape[1]))], np.zeros((2 if d == 2 else 6, places.shape[1]))
        fill_coordinates(self.pieces.curve, places, rows[0])
        if self._beside or self._known is not None:
            curvature[::2] = _curvature(_derivatives(self._terms, places, 3)[d:])
        rows.append(curvature)
        for step, *sides in self._beside:
            if not sides:
                rows.append(np.full((2 * d, places.shape[1]), np.nan))
                continue
            before, after = np.empty((2, *rows[0].shape))
            fill_coordinates(sides[0].curve, places, before)
            fill_coordinates(sides[1].curve, places, after)
            rows.append(_quotient(before[: 2 * d], after[: 2 * d], step))
        if self._known is not None:
            rows.append(self._known.pairs(places).reshape(-1, places.shape[1]))
        return np.concatenate(rows)

    def places(self, high: Array, low: Array | float = 0.0) -> Array:
        """Return the places (PLACE rows) at arc lengths from the start point."""
        pieces, places = self.pieces, np.empty((PLACE, high.size))
        numbers = [pieces.number_of(float(place)) for place in (high.min(), high.max())] if high.size else [0]
        pieces.make(min(*numbers, pieces.begin) - 1, max(*numbers, pieces.begin) + 1)
        (start, start_low), from_edge = pieces.start_length, np.empty((2, high.size))
        from_edge[0] = total = high + start
        from_edge[1] = (high - (total - start)) + (start - (total - (total - start))) + (start_low + low)
        fill_places(pieces.curve, pieces.begin, from_edge, places)
        return places

    def arc_length_changes(self, places: Array) -> Array:
        """Return the increase of the arc length from the start point to points of equal u: a row for each parameter."""
        self._make(int(places[0].min()), int(places[0].max()))
        if self._known is not None:
            return self._known.arc_lengths(places)
        found = []
        for step, *sides in self._beside:
            if not sides:
                found.append(np.full(places.shape[1], np.nan))
                continue
            before, after = (arcs_from_start(side, places) for side in sides)
            found.append(_quotient(before, after, step)[0])
        return np.array(found).reshape(-1, places.shape[1])

    def roll_changes(self, place: Array) -> Array:
        """Return the increase of the roll angle of a banked rail at the point of equal u, for one place: a number for
        each parameter.
        """
        number, (u, u_low) = int(place[0, 0]) % len(self.pieces.curve.counts), place[1:, 0].tolist()
        found, (left, up) = [], self.pieces.frame(number, u, u_low)[1:, 2, 0]
        for step, *sides in self._beside:
            if not sides:
                found.append(np.nan)
                continue
            # The vertical components of l and u are -sin(roll) and cos(roll), each times the same number.
            before, after = (side.frame(number, u, u_low)[1:, 2].reshape(-1, 1) for side in sides)
            by_left, by_up = _quotient(before, after, step)[::2, 0]
            found.append((left * by_up - up * by_left) / (left * left + up * up))
        return np.array(found)

    def shifts(self, places: Array) -> Array:
        """Return the increase of the arc length from the start point to the points of the curve at places: a row for
        each parameter.
        """
        rows, d = self.coordinates(places)[::2], self.dimension
        if d == 2:
            (dx, dz), moved = rows[2:4], rows[size_of_point(d) :]
            along = (moved[::2] * dx + moved[1::2] * dz) / np.hypot(dx, dz)
        else:
            rates, moved = rows[d : 2 * d], rows[size_of_point(d) :].reshape(-1, d, places.shape[1])
            along = (moved * rates).sum(axis=1) / np.sqrt((rates * rates).sum(axis=0))
        # Points of equal u are displaced along the curve as well.
        shifts: Array = self.arc_length_changes(places) - along
        return shifts

    def path(self, places: Array, orders: int = 4) -> Array:
        """Return the coordinates in doubles with all derivatives with respect to u below an order, and the
        displacements with two derivatives.
        """
        if places.size:
            self._make(int(places[0].min()), int(places[0].max()))
        d, rows = self.dimension, [_derivatives(self._terms, places, orders)]
        if self._beside:
            count = len(self.pieces.curve.counts)
            for k in np.unique(places[0].astype(np.int64) % count).tolist():
                if k not in self._smoothed:
                    self._smoothed[k] = self._smooth(k)
            terms = np.zeros((count, d * len(self._beside), NODES))
            for k, found in self._smoothed.items():
                terms[k] = found
            rows += [_derivatives(terms[:, d * i : d * i + d], places, 3) for i in range(len(self._beside))]
        if self._known is not None:
            rows.append(self._known.points(places, 3).reshape(-1, places.shape[1]))
        return np.concatenate(rows)

    def _smooth(self, k: int) -> Array:
        """Return the displacements of the coordinates on a piece, for each parameter, as coefficients of powers of u.

        The Chebyshev series are cut where their coefficients are rounding, so that derivatives do not amplify it.
        """
        places = np.array([np.full(NODES, float(k)), *sample_places()])
        samples = self.coordinates(places)[2 * size_of_point(self.dimension) :]
        series = np.empty((len(samples) // 2, NODES))
        fill_series(samples, chebyshev_fit(), series)
        is_large = np.abs(series) > MAX_NOISE * np.abs(series).max(axis=1, keepdims=True)
        ahead = np.pad(is_large, ((0, 0), (0, TERMS_IN_A_ROW - 1)))
        is_used = sum(ahead[:, k : k + NODES] for k in range(TERMS_IN_A_ROW))
        kept = np.where(np.logical_and.accumulate(is_used, axis=1) | np.isnan(series), series, 0.0)
        powers: Array = kept @ chebyshev_powers()
        return powers


def shaped_pieces(problem: Problem, pieces: TruePieces, shaping: tuple[int, ...]) -> ShapedPieces:
    """Return the true pieces of a curve with those of its neighbours, which are kept with them."""
    if shaping not in pieces.shaped:
        pieces.shaped[shaping] = ShapedPieces(problem, pieces, shaping)
    shape: ShapedPieces = pieces.shaped[shaping]
    return shape


def _beside(maker: ChartMaker, p: tuple[Number, ...], k: int, chart: Any) -> tuple[float, *tuple[TruePieces, ...]]:
    """Return the step of a parameter, and the curve for its values one step below and above; the step alone if there
    are no such curves.
    """
    step = step_of(p[k], STEP)
    sides = [neighbour(maker, p, {k: sign * step}, chart) for sign in (-1, 1)]
    found = [side for side in sides if side is not None]
    return (step, *found) if len(found) == len(sides) else (step,)


def arcs_from_start(pieces: TruePieces, places: Array) -> Array:
    """Return the arc lengths, two doubles each, from the start point of a curve to places."""
    pieces.make(min(int(places[0].min()), pieces.begin), max(int(places[0].max()), pieces.begin))
    arcs = np.empty((2, places.shape[1]))
    fill_arcs(pieces.curve, pieces.begin, places, arcs)
    start, start_low = pieces.start_length
    total, rounding = two_sum.py_func(arcs[0], -start)
    return np.array([total, arcs[1] + (rounding - start_low)])


def step_of(number: Number, share: float) -> float:
    """Return the step of a parameter as a share of the largest power of 2 that is not above it."""
    step: float = share * 2.0 ** np.floor(np.log2(abs(number.value) or 1.0))
    return step


def neighbour(maker: ChartMaker, p: tuple[Number, ...], moves: Mapping[int, float], chart: Any) -> TruePieces | None:
    """Return the curve for parameters that differ from those of a chart by ``moves``; None if there is no such curve.

    Parameters
    ----------
    maker : ChartMaker
        What has made the chart. If it has ``true_pieces_beside``, its displacements are smoother so.
    p : tuple of Number
        The parameters of the chart.
    moves : dict
        The differences, by the indices of the parameters.
    chart : Chart
        The chart.
    """
    numbers = list(p)
    for k, move in moves.items():
        value = p[k].fraction
        at = Fraction(p[k].value) + Fraction(p[k].low) if value is None else value
        numbers[k] = read_number(at + Fraction(move), where="p")
    beside = getattr(maker, "true_pieces_beside", None)
    found: TruePieces | None = (
        maker.true_pieces(tuple(numbers), chart) if beside is None else beside(tuple(numbers), chart, p)
    )
    return found


def _quotient(before: Array, after: Array, step: float) -> Array:
    """Return the difference quotient of rows of two doubles each, over twice the step, which is a power of 2."""
    high, low = after[::2] - before[::2], after[1::2] - before[1::2]
    total = high + low
    out = np.empty_like(before)
    out[::2], out[1::2] = total / (2.0 * step), ((high - total) + low) / (2.0 * step)
    return out


def _curvature(derivatives: Array) -> Array:
    """Return the curvature, in space as a vector, from the first two derivatives of the coordinates."""
    if len(derivatives) == 4:
        dx, dz, bend_x, bend_z = derivatives
        bend: Array = (dx * bend_z - dz * bend_x) / (dx * dx + dz * dz) ** 1.5
        return bend
    rates, bends = derivatives[:3], derivatives[3:]
    square = (rates * rates).sum(axis=0)
    across: Array = (bends - rates * ((rates * bends).sum(axis=0) / square)) / square
    return across


def _derivatives(terms: Array, places: Array, count: int) -> Array:
    """Return coordinates at places and their derivatives with respect to u, beginning with order 0, from coefficients
    in doubles.
    """
    chosen, u = terms[places[0].astype(np.int64) % len(terms)], places[1]
    rows, powers = [], np.vander(u, NODES, increasing=True)
    for _ in range(count):
        rows += np.einsum("nrj,nj->rn", chosen, powers).tolist()
        chosen = np.pad(chosen[:, :, 1:] * np.arange(1, NODES), ((0, 0), (0, 0), (0, 1)))
    return np.array(rows)
