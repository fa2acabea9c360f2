"""The second derivatives of the half period of a libration along a chart, or of the time of a lap."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from gqm_sym.runtime.arithmetic.doubledouble import add, two_product
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.double_double.arithmetic import UNIT
from gqm_sym.runtime.gradients.charts.programs import ChartSource
from gqm_sym.runtime.gradients.charts.second_programs import (
    chart_circulation_seconds,
    chart_joint_program,
    chart_libration_seconds,
    chart_turn_seconds,
)
from gqm_sym.runtime.gradients.charts.shaped_bends import ShapedBends
from gqm_sym.runtime.gradients.evaluation import fill_values
from gqm_sym.runtime.gradients.orbit import pairs
from gqm_sym.runtime.gradients.panels import Panels
from gqm_sym.runtime.gradients.programs import Program

# A function that integrates: it takes values at shares and places, and the results that have to be resolved.
Resolve = Callable[[Callable[[Array, Array], Array], NDArray[np.intp]], Panels]


class SecondDurations:
    """The second derivatives of one orbit.

    Parameters
    ----------
    source : ChartSource
        The formulas of the motion. The parameters that shape the curve are those among ``rows``.
    rows : tuple of int
        The variables; there is a derivative for each of their pairs (`second_programs.pairs_of`).
    shape : ShapedBends
        The curve.
    variables : array
        The variables as inputs of programs.
    start : (3, 1) array
        The place of the launch.
    """

    def __init__(
        self, source: ChartSource, rows: tuple[int, ...], shape: ShapedBends, variables: Array, start: Array
    ) -> None:
        self._source, self._rows, self._shape = source, rows, shape
        launch = np.concatenate([shape.coordinates(start), shape.lengthened(start)])[:, 0].reshape(-1, 2)
        given = pairs(*((high, low, UNIT * abs(high)) for high, low in launch.tolist()))
        self._inputs = np.hstack([variables, given])

    def _values(self, program: Program, more: list[Array], shares: Array, places: Array) -> Array:
        """Return the results of a program with more inputs at places: two doubles each, and bounds on the errors."""
        inputs = np.ascontiguousarray(np.hstack([self._inputs, *more]))
        coordinates = np.ascontiguousarray(np.concatenate([shares, self._shape.coordinates(places)]))
        found = np.empty((program.outputs.size, 3, places.shape[1]))
        fill_values(program.operands, program.work, inputs, coordinates, found)
        return found

    def _integrals(self, program: Program, more: Array, resolve: Resolve) -> Array:
        found = resolve(lambda *places: self._values(program, [more], *places), np.arange(program.outputs.size))
        return found.integrals[1:]

    def of_lap(self, lap: Array, resolve: Resolve) -> Array:
        """Return the second derivatives of the time of a lap.

        Parameters
        ----------
        lap : array
            The length of the lap as an input of programs.
        resolve : callable
            What integrates over the orbit.
        """
        return self._integrals(chart_circulation_seconds(self._source, self._rows), lap, resolve)

    def of_libration(self, turns: Array, width: Array, range_of: Callable[[Array], Array], resolve: Resolve) -> Array:
        """Return the second derivatives of the half period.

        Parameters
        ----------
        turns : (3, 2) array
            The places of both turning points.
        width : (2,) array
            The arc length between them, as two doubles.
        range_of : callable
            It returns the turning points with their derivatives as inputs of programs.
        resolve : callable
            What integrates over the orbit.
        """
        ends = self._values(chart_turn_seconds(self._source, self._rows), [], np.zeros((2, 2)), turns)
        between = range_of(ends)
        found = self._integrals(chart_libration_seconds(self._source, self._rows), between, resolve)
        numbers = np.arange(*turns[0].astype(np.int64))
        if not numbers.size or not self._source.shaping:
            return found
        # Strains jump at joints, whose phases change too.
        ones = np.ones(numbers.size)
        sides = [np.array([numbers + side, (1.0 - 2.0 * side) * ones, 0.0 * ones]) for side in (0.0, 1.0)]
        arcs = self._shape.arcs(np.hstack([turns[:, :1], sides[0]]))
        distances = add.py_func(arcs[0, 1:], arcs[1, 1:], -arcs[0, 0], -arcs[1, 0])
        shares = _quotients(*distances, *width)
        program = chart_joint_program(self._source, self._rows)
        before, after = (self._values(program, [between], shares, side)[:, :2].sum(axis=2) for side in sides)
        total: Array = found + (after - before).sum(axis=1)
        return total


def _quotients(high: Array, low: Array, by: float, by_low: float) -> Array:
    """Return numbers of two doubles each over one of them."""
    quotients = high / by
    product, rounding = two_product.py_func(quotients, by)
    return np.array([quotients, (((high - product) - rounding) + low - quotients * by_low) / by])
