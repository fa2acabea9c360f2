"""The points of a curve with the second derivatives of their places by the parameters that shape it.

They are differences of the polynomials of neighbouring curves (`shaped_pieces`) of fourth order, for one parameter and
for two that change together: of a sum of two parameters, the second derivative has the mixed one.
"""

from typing import Any

import numpy as np

from gqm_sym.errors import SolutionError
from gqm_sym.runtime.arithmetic.doubledouble import add, two_product
from gqm_sym.runtime.charts.double_double.making import TruePieces
from gqm_sym.runtime.charts.double_double.pieces import NODES
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.gradients.charts.shaped_pieces import (
    arcs_from_start,
    fill_arcs,
    fill_coordinates,
    neighbour,
    step_of,
)
from gqm_sym.runtime.gradients.second_programs import pairs_of
from gqm_sym.runtime.launch.problem import Problem

# The step of the differences, as a share of the parameter. It is a power of 2; its fourth power, which is the
# truncation error, is some 1e-24, and the rounding error divided by its square is some 1e-19.
STEP = 2.0**-20

# The weights of the values at -2, -1, 0, 1 and 2 steps, of which the sum is 12 times a derivative.
FIRST, SECOND, DIVISOR = (1.0, -8.0, 0.0, 8.0, -1.0), (-1.0, 16.0, -30.0, 16.0, -1.0), 12.0

# Curves by the steps of their parameters.
Steps = tuple[int, ...]


class ShapedBends:
    """The true pieces of a curve, with the derivatives of its points by the parameters that shape it.

    Parameters
    ----------
    problem : Problem
        The launch with its module.
    pieces : TruePieces
        The curve.
    shaping : tuple of int
        The parameters.

    Raises
    ------
    SolutionError
        If there are no neighbouring curves.
    """

    def __init__(self, problem: Problem, pieces: TruePieces, shaping: tuple[int, ...]) -> None:
        self._pieces, self._shaping, self._problem = pieces, shaping, problem
        self._sizes = [step_of(problem.p[k], STEP) for k in shaping]
        self._pairs = pairs_of(tuple(range(len(shaping))))
        self._polynomials: list[tuple[Array, int]] = []
        self._made = (0, -1)

    def _curve(self, steps: Steps) -> TruePieces:
        """Return the curve for values of the parameters that differ by these numbers of steps."""
        if not any(steps):
            return self._pieces
        key, formulas, p = (self._shaping, steps), self._problem.formulas, self._problem.p
        if key not in self._pieces.around:
            assert formulas.chart is not None
            rows = zip(self._shaping, steps, self._sizes, strict=True)
            moves = {k: count * size for k, count, size in rows if count}
            self._pieces.around[key] = neighbour(formulas.chart, p, moves, formulas.charted(p))
        found: TruePieces | None = self._pieces.around[key]
        if found is None:
            raise self._without_neighbours(steps)
        return found

    def _without_neighbours(self, steps: Steps) -> SolutionError:
        names = list(self._problem.formulas.parameters)
        moved = ", ".join(names[k] for k, count in zip(self._shaping, steps, strict=True) if count)
        return SolutionError(
            f"gradient: there is no second derivative with respect to {moved}, because the curve does not exist for "
            "neighbouring values (an exponent of a negative number must be an integer); name the others in wrt"
        )

    def _differences(self, value: Any) -> tuple[list[Array], list[Array]]:
        """Return the first derivatives of rows of two doubles each by all parameters, and the second ones by all pairs.

        Parameters
        ----------
        value : callable
            ``value(curve, steps)`` gives the rows of a curve.
        """
        count, sizes = len(self._shaping), self._sizes

        def along(*moved: int) -> list[Array]:
            steps = [tuple(k * (i in moved) for i in range(count)) for k in range(-2, 3)]
            return [value(self._curve(step), step) for step in steps]

        lines = [along(i) for i in range(count)]
        twice = [_weighted(SECOND, line) for line in lines]
        firsts = [_weighted(FIRST, line) / size for line, size in zip(lines, sizes, strict=True)]
        seconds = []
        for i, j in self._pairs:
            found = twice[i]
            if i != j:
                found = 0.5 * _sum([(1.0, _weighted(SECOND, along(i, j))), (-1.0, twice[i]), (-1.0, twice[j])])
            seconds.append(found / (sizes[i] * sizes[j]))
        return firsts, seconds

    def _make(self, first: int, last: int) -> None:
        """Make the polynomials of the derivatives on the pieces from one number to another."""
        if self._made[0] <= first and last <= self._made[1]:
            return
        if self._polynomials:
            first, last = min(first, self._made[0]), max(last, self._made[1])
        numbers = np.arange(first, last + 1) % len(self._pieces.curve.counts)

        def terms(curve: TruePieces, steps: Steps) -> Array:
            curve.make(first, last)
            if np.isnan(curve.curve.lengths[numbers, 0]).any():
                raise self._without_neighbours(steps)
            found: Array = np.moveaxis(curve.curve.terms, 1, 0)
            return found

        firsts, seconds = self._differences(terms)
        found = [(self._pieces.curve.terms, 2), *((np.moveaxis(row, 0, 1), 2) for row in firsts)]
        self._polynomials = [*found, *((np.moveaxis(row, 0, 1), 1) for row in seconds)]
        self._made = first, last

    def coordinates(self, places: Array) -> Array:
        """Return the points at places as `second_programs` takes them: two doubles for each coordinate."""
        self._make(int(places[0].min()), int(places[0].max()))
        curve, rows = self._pieces.curve, []
        counts = np.full_like(curve.counts, NODES)
        for terms, orders in self._polynomials:
            half = terms.shape[1]
            for order in range(orders):
                chosen = terms if order == 0 else _differentiated(terms)
                found = np.empty((2 * half, places.shape[1]))
                fill_coordinates(curve._replace(terms=np.ascontiguousarray(chosen), counts=counts), places, found)
                rows.append(found if order == 0 else found[half:])
        return np.concatenate(rows)

    def arcs(self, places: Array) -> Array:
        """Return the arc lengths, two doubles each, from the left edge of the piece of the first place to places."""
        found = np.empty((2, places.shape[1]))
        fill_arcs(self._pieces.curve, int(places[0, 0]), places, found)
        return found

    def lengthened(self, places: Array) -> Array:
        """Return the derivatives of the arc length from the start point to the points at places, two doubles each: the
        first ones by all parameters, and the second ones by all pairs.
        """
        firsts, seconds = self._differences(lambda curve, _: arcs_from_start(curve, places))
        return np.concatenate([*firsts, *seconds]) if firsts else np.empty((0, places.shape[1]))


def _weighted(weights: tuple[float, ...], values: list[Array]) -> Array:
    """Return a derivative times the step, or the square of it, from rows of two doubles each at five places."""
    total = _sum([(weight, rows) for weight, rows in zip(weights, values, strict=True) if weight])
    high, low = total[::2], total[1::2]
    found = np.empty_like(total)
    found[::2] = high / DIVISOR
    product, rounding = two_product.py_func(found[::2], DIVISOR)
    found[1::2] = (((high - product) - rounding) + low) / DIVISOR
    return found


def _sum(parts: list[tuple[float, Array]]) -> Array:
    """Return a sum of rows of two doubles each, times numbers that are small integers."""
    total = np.zeros_like(parts[0][1])
    for weight, rows in parts:
        high, low = two_product.py_func(rows[::2], weight)
        total[::2], total[1::2] = add.py_func(total[::2], total[1::2], high, low + weight * rows[1::2])
    return total


def _differentiated(terms: Array) -> Array:
    """Return the coefficients of the derivatives of polynomials whose coefficients are two doubles each."""
    orders, found = np.arange(1.0, NODES), np.zeros_like(terms)
    high, low = two_product.py_func(terms[:, ::2, 1:], orders)
    found[:, ::2, :-1], found[:, 1::2, :-1] = high, low + terms[:, 1::2, 1:] * orders
    return found
