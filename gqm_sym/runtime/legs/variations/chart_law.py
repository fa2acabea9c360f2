"""The law of a motion with losses along a chart, with its derivatives.

The label of a point is its arc length along the curve for the given parameters. If a parameter that shapes the curve
changes, a point keeps its value of u on its piece (`charts.double_double.pieces`), so that pieces keep their edges,
where forces may jump.
"""

import numpy as np

from gqm_sym.runtime.charts.chart import SpaceChart
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.gradients.charts.means import CurveOfMeans
from gqm_sym.runtime.gradients.charts.shaped_pieces import shaped_pieces, shaping_of
from gqm_sym.runtime.gradients.evaluation import fill_values
from gqm_sym.runtime.gradients.orbit import without_formulas
from gqm_sym.runtime.gradients.path import PathRows
from gqm_sym.runtime.interface import ExactChartLaw
from gqm_sym.runtime.launch.formulas import true_pieces_of
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.legs.variations.law import FormulaLaw, Law
from gqm_sym.runtime.legs.variations.programs import (
    ORDERS,
    ChartForces,
    chart_law_program,
    chart_load_program,
    chart_path_program,
    chart_sided_program,
)
from gqm_sym.runtime.legs.variations.train_law import TrainLaw

# The number of places whose coordinates are found together.
BLOCK = 4096


class ChartLaw(Law):
    """The law along a charted curve.

    Parameters
    ----------
    problem : Problem
        The launch with its module.
    shaping : tuple of int, optional
        The parameters by which the curve's shape is varied; by default all that shape it.
    """

    by_arc_length = True

    def __init__(self, problem: Problem, shaping: tuple[int, ...] | None = None) -> None:
        super().__init__(problem)
        formulas = problem.formulas
        maker, chart = formulas.chart, formulas.charted(problem.p)
        assert maker is not None
        pieces = true_pieces_of(maker, problem.p, chart)
        if not isinstance(formulas.exact, ExactChartLaw) or pieces is None:
            raise without_formulas()
        varied, dimension = (
            shaping_of(formulas) if shaping is None else shaping,
            2 if formulas.path_in_space is None else 3,
        )
        self._forces = ChartForces(formulas.exact, self.count, self.mass, varied, dimension)
        self._shape = shaped_pieces(problem, pieces, self._forces.shaping)
        self._launch, self._chart = problem.launch.lam0, chart

    @property
    def launch_changes(self) -> Array:
        """See `Law`. The launch place is a fixed arc length, so its label changes if points shift along the curve."""
        moves = np.zeros(self.count + 2)
        moves[self.count] = 1.0
        place = self._shape.places(np.array([self._launch.value]), self._launch.low)
        moves[list(self._forces.shaping)] = -self._shape.arc_length_changes(place)[:, 0]
        return moves

    @property
    def ranges(self) -> Array:
        """See `Law`. The ends of the curve keep their labels."""
        return np.zeros((3, self.count))

    def coordinates(self, states: Array) -> Array:
        """See `Law`."""
        return self._coordinates(*states[:2])

    def _coordinates(self, high: Array, low: Array) -> Array:
        """Return the coordinates of places, as two doubles each."""
        parts = []
        for start in range(0, max(high.size, 1), BLOCK):
            some = slice(start, start + BLOCK)
            parts.append(self._shape.path(self._shape.places(high[some], low[some]), ORDERS))
        found = np.concatenate(parts, axis=1)
        return np.stack([found, np.zeros_like(found)], axis=1).reshape(2 * found.shape[0], high.size)

    def matrix(self, states: Array) -> Array:
        """See `Law`."""
        n, found = self.count, self.values(chart_law_program(self._forces), states, parts=1)[:, 0]
        # Places are arc lengths along the curve for the given parameters.
        ds: Array = np.vstack([np.ones_like(found[0]), np.zeros_like(found[0])])
        return np.vstack([ds, found[:n], found[n:]])

    def loads(self, states: Array) -> Array:
        """See `Law`."""
        found: Array = self.values(chart_load_program(self._forces), states, parts=1)[:, 0]
        return found

    def sided(self, state: Array) -> Array:
        """See `Law`. The upward direction of riders also changes by the roll angle and the arc length at a point."""
        chart, arc = self._chart, float(state[0, 0])
        roll, roll_slope, banked = 0.0, 0.0, False
        if isinstance(chart, SpaceChart) and chart.banked:
            banked = True
            roll, roll_slope = (float(chart.derivatives([arc], order)[3, 0]) for order in (0, 1))
        found = self.values(chart_sided_program(self._forces), state, parts=1, more=(roll, arc))[:, 0, 0]
        by_roll, by_arc = found[-2:]
        rows: Array = found[:-2].copy()
        rows[0] += by_roll * roll_slope + by_arc
        if self._forces.shaping:
            place, shaped = self._shape.places(state[0], state[1]), [2 + k for k in self._forces.shaping]
            rows[shaped] += by_arc * self._shape.arc_length_changes(place)[:, 0]
            if banked:
                rows[shaped] += by_roll * self._shape.roll_changes(place)
        return rows

    def path(self, high: Array, low: Array) -> PathRows:
        """See `Law`."""
        program, places = chart_path_program(self._forces), self._coordinates(high, low)
        found = np.empty((program.outputs.size, 1, high.size))
        fill_values(program.operands, program.work, self.parameters, places, found)
        return PathRows(found.reshape(program.outputs.size // (self.count + 2), self.count + 2, high.size))


def law_of(problem: Problem) -> Law:
    """Return the law of the motion of a launch; along a curve with formulas it is kept with the run-time parameters."""
    if problem.formulas.chart is not None:
        return TrainLaw(problem) if isinstance(problem.formulas.chart, CurveOfMeans) else ChartLaw(problem)
    kept = problem.p.conditions
    known: Law | None = kept.get("law")
    if known is None:
        known = kept["law"] = FormulaLaw(problem)
    return known
