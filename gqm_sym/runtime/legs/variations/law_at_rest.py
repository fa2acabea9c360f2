"""The force on a body at rest in double-double arithmetic, and the places at which the curve is not smooth."""

from typing import Protocol

import numpy as np

from gqm_sym.errors import SolutionError
from gqm_sym.runtime.arithmetic.doubledouble import Pair, plus
from gqm_sym.runtime.charts.double_double.pieces import NODES
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.gradients.charts.shaped_pieces import fill_arcs
from gqm_sym.runtime.interface import ExactLaw
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.legs.variations.chart_law import ChartLaw
from gqm_sym.runtime.legs.variations.law import FormulaLaw, states_of
from gqm_sym.runtime.legs.variations.programs import chart_force_program


class LawAtRest(Protocol):
    """The force on a body at rest along a curve."""

    @property
    def place_error(self) -> float:
        """The error of a place that is found from the force, beyond that of two doubles."""

    def at_rest(self, high: Array, low: Array, sense: tuple[int, int]) -> tuple[Array, Array]:
        """Return the force dW/dlam and its derivative with respect to the place, at places of two doubles each, for the
        signs of dlam/dt and of N.
        """

    def nearest_break(self, place: float) -> Pair:
        """Return the place nearest to a double at which the curve is not smooth."""


class ChartAtRest(ChartLaw):
    """The force on a body at rest along a charted curve.

    Points and tangents come from the true pieces of the curve as two doubles each, because the terms of the force
    cancel next to an equilibrium.
    """

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem, shaping=())

    @property
    def place_error(self) -> float:
        """See `LawAtRest`."""
        # A tangent comes from the derivative of a polynomial of NODES terms.
        return NODES * float(self._shape.pieces.doubt)

    def at_rest(self, high: Array, low: Array, sense: tuple[int, int]) -> tuple[Array, Array]:
        """See `LawAtRest`."""
        ones = np.ones_like(high)
        states = states_of(high, low, 0.0 * ones, *(sign * ones for sign in sense))
        force, slope = self.values(chart_force_program(self._forces), states, parts=1)[:, 0]
        return force, slope

    def coordinates(self, states: Array) -> Array:
        """See `Law`."""
        places = self._shape.places(*states[:2])
        rows, exact = super().coordinates(states), self._shape.coordinates(places)[: 4 * self._shape.dimension]
        rows[: len(exact)] = exact
        return rows

    def nearest_break(self, place: float) -> Pair:
        """See `LawAtRest`."""
        pieces = self._shape.pieces
        number = pieces.number_of(place)
        edges = np.array([[number, number + 1.0], [-1.0, -1.0], [0.0, 0.0]])
        pieces.make(min(number, pieces.begin) - 1, max(number, pieces.begin) + 1)
        arcs, (start, start_low) = np.empty((2, 2)), pieces.start_length
        fill_arcs(pieces.curve, pieces.begin, edges, arcs)
        found = [plus((high, low), (-start, -start_low)) for high, low in arcs.T.tolist()]
        return min(found, key=lambda pair: abs(pair[0] - place))


class FormulaAtRest(FormulaLaw):
    """The force on a body at rest along a curve with formulas, which is smooth everywhere."""

    place_error = 0.0

    def nearest_break(self, place: float) -> Pair:
        """See `LawAtRest`."""
        return place, 0.0


def law_at_rest(problem: Problem, *, has_breaks: bool) -> LawAtRest | None:
    """Return the force on a body at rest about an equilibrium; None if it is known in doubles only.

    Along charts it is made only where there are breaks.
    """
    if problem.formulas.chart is None:
        return FormulaAtRest(problem) if isinstance(problem.formulas.exact, ExactLaw) else None
    try:
        return ChartAtRest(problem) if has_breaks else None
    except SolutionError:  # the curve is known in doubles only
        return None
