"""A periodic orbit along a chart with its derivatives: Gauss's rules on panels of the phase angle.

Displacements of the curve's points come from neighbouring curves (`shaped_pieces`). All other derivatives are those of
formulas (`programs`).
"""

from collections.abc import Callable
from fractions import Fraction
from functools import cached_property

import numpy as np
from numba import types
from numpy.typing import NDArray

from gqm_sym.errors import SolutionError
from gqm_sym.runtime.charts.double_double.making import TruePieces
from gqm_sym.runtime.charts.double_double.passage import ChartPassage
from gqm_sym.runtime.charts.double_double.pieces import (
    TRUE_CURVE,
    arc_between,
    place_at,
    unshared,
)
from gqm_sym.runtime.charts.double_double.turning_points import AHEAD, BEHIND, LAUNCH, LOWER, UPPER
from gqm_sym.runtime.compiled.jit import entry
from gqm_sym.runtime.compiled.types import MATRIX, Array
from gqm_sym.runtime.double_double.arithmetic import UNIT, add, multiply
from gqm_sym.runtime.gradients.charts.programs import (
    ChartSource,
    chart_circulation_program,
    chart_path_program,
    speed_program,
)
from gqm_sym.runtime.gradients.charts.second_durations import SecondDurations
from gqm_sym.runtime.gradients.charts.shaped_bends import ShapedBends
from gqm_sym.runtime.gradients.charts.shaped_pieces import PLACE, ShapedPieces, shaped_pieces, shaping_of
from gqm_sym.runtime.gradients.charts.space_programs import SpaceSource, space_path_program
from gqm_sym.runtime.gradients.evaluation import fill_values, values
from gqm_sym.runtime.gradients.orbit import OrbitDerivatives, SeriesOf, pairs
from gqm_sym.runtime.gradients.panels import Panels, resolved
from gqm_sym.runtime.gradients.path import ASIDE, PRODUCT, PathRows, squared_force
from gqm_sym.runtime.gradients.programs import LAUNCH_VARIABLES, Program, libration_program, turning_point_program
from gqm_sym.runtime.gradients.series import PanelSeries
from gqm_sym.runtime.interface import ExactPotential
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.quadrature.trapezoid import CIRCULATION, LIBRATION

# A place this near to the edge of a piece counts as the edge.
AT_EDGE = 1e-15

# The step of the difference quotient for the second derivative at an extreme, as a share of the orbit's width.
DIFFERENCE_STEP_SHARE = 2.0**-20


@entry(types.void(TRUE_CURVE, MATRIX, types.UniTuple(types.float64, 4), MATRIX), checked=False)
def fill_places(curve, shares, orbit, places):  # type: ignore[no-untyped-def]
    """Fill the places of nodes.

    Parameters
    ----------
    curve : TrueCurve
        The curve.
    shares : (2, n) array
        The share of the orbit's width at each node, as two doubles.
    orbit : tuple of float
        The orbit's width in arc length as two doubles with a sign, and the piece on which the phase begins.
    places : (PLACE, n) array
        Filled. On entry, its first column is the place at which the phase begins.
    """
    curve, width, width_low, number = unshared(curve), orbit[0], orbit[1], int(orbit[2])
    base, _ = arc_between(curve, number, (-1.0, 0.0), number, (places[1, 0], places[2, 0]))
    for i in range(shares.shape[1]):
        distance, distance_low = multiply(shares[0, i], shares[1, i], width, width_low)
        piece, place = place_at(curve, number, add(base[0], base[1], distance, distance_low))
        places[0, i], places[1, i], places[2, i] = piece, place[0], place[1]


def source_along(problem: Problem) -> ChartSource:
    """Return the formulas from which the programs of motions along the chart of a module are recorded."""
    formulas = problem.formulas
    assert isinstance(formulas.exact, ExactPotential)
    names = list(formulas.parameters)
    kind, exact = ChartSource if formulas.path_in_space is None else SpaceSource, formulas.exact
    of_module = formulas.inertia, len(names), names.index("m"), shaping_of(formulas)
    return kind(exact.effective_potential, *of_module, exact.coriolis)


def path_along(source: ChartSource, shape: ShapedPieces, parameters: Array, lam: Array) -> PathRows:
    """Return `path_rows` at arc lengths, with derivatives at the points of the curve."""
    path = shape.path(shape.places(lam))
    program = space_path_program(source) if isinstance(source, SpaceSource) else chart_path_program(source)
    found = values(program, parameters, path[0], None, *path[1:], parts=1)
    return PathRows(found.reshape(-1, source.parameters + 2, lam.size))


class ChartOrbitDerivatives(OrbitDerivatives):
    """A libration or circulation along a chart, with derivatives with respect to all variables.

    Parameters
    ----------
    problem : Problem
        The launch with its module.
    passage : ChartPassage
        The orbit in double-double arithmetic.
    direction : int
        0 for a libration, else the sign of ds/dt.
    edges : array
        Phase angles, or shares of a lap, between which the speed changes smoothly, from the first to the last.
    shaping : tuple of int, optional
        The parameters by which the curve's shape is varied; by default all that shape it. Derivatives with respect to
        others that shape it mean nothing.
    """

    source: ChartSource
    by_arc_length = True

    def __init__(
        self,
        problem: Problem,
        passage: ChartPassage,
        direction: int,
        edges: Array,
        shaping: tuple[int, ...] | None = None,
    ) -> None:
        pieces, launch = problem.true_pieces, problem.launch
        assert pieces is not None
        self.direction, self._edges, self._passage, self._problem = direction, edges, passage, problem
        source = self._source_along(problem)
        self.source = source if shaping is None else source._replace(shaping=shaping)
        self._shaped_by = source.shaping
        self._shape = self._shaped(problem, pieces)
        self._found = passage.found
        numbers = [
            (n.value, n.low, 0.25 * UNIT * abs(n.value) if n.low else 0.0) for n in (*problem.p, launch.lam0, launch.v0)
        ]
        self.variables = pairs(*numbers, (0.0, 0.0, 0.0))
        self.parameters = np.ascontiguousarray(self.variables[:, : self.source.parameters])
        start = np.ascontiguousarray(self._found[[LAUNCH], :PLACE].T)
        self._shifts = self._shape.shifts(start)[:, 0]
        point = self._shape.coordinates(start)[:, 0].reshape(-1, 2)
        given = [(high, low, UNIT * abs(high)) for high, low in point.tolist()]
        self._inputs = np.hstack([self.variables, pairs(*given), pairs(*((s, 0.0, 0.0) for s in self._shifts))])

    @property
    def _has_neighbours(self) -> bool:
        """Whether the curve is known for neighbouring values of the parameters that shape it."""
        return getattr(self._problem.formulas.chart, "displacements", None) is None

    def _source_along(self, problem: Problem) -> ChartSource:
        return source_along(problem)

    def _shaped(self, problem: Problem, pieces: TruePieces) -> ShapedPieces:
        return shaped_pieces(problem, pieces, self.source.shaping)

    @property
    def launch_changes(self) -> Array:
        """The change of the launch place relative to the points of the curve."""
        moves = np.zeros(self.source.variables)
        moves[self.source.parameters] = 1.0
        moves[list(self.source.shaping)] = -self._shifts
        return moves

    def _values(self, program: Program, inputs: Array, shares: Array, places: Array) -> Array:
        """Return the results of a program at places: values as two doubles, and bounds on the errors."""
        rows = np.ascontiguousarray(np.concatenate([shares, self._shape.coordinates(places)]))
        found = np.empty((program.outputs.size, 3, places.shape[1]))
        fill_values(program.operands, program.work, np.ascontiguousarray(inputs), rows, found)
        return found

    @cached_property
    def _turns(self) -> Array:
        """The places of both turning points; one at which two pieces meet is given on the piece that the motion passes.

        In this way the rounding of the displacements, which differs between pieces, does not spoil the small V**2
        nearby.
        """
        turns = self._found[[LOWER, UPPER], :PLACE].T.copy()
        for column, edge in zip(turns.T, (1.0, -1.0), strict=True):
            beyond = (column[1] - edge) + column[2]
            if abs(beyond) <= AT_EDGE:
                both = np.array([[column[0], column[0] + edge], [edge, -edge], [0.0, 0.0]])
                d = self._shape.dimension
                rates = self._shape.coordinates(both)[2 * d : 4 * d : 2]
                speeds = np.hypot(*rates) if d == 2 else np.linalg.norm(rates, axis=0)
                column[:] = column[0] + edge, -edge, beyond * speeds[0] / speeds[1]
        return turns

    @cached_property
    def _end_rows(self) -> Array:
        """The derivatives of both turning points at the points of the curve, in double-double arithmetic."""
        program = turning_point_program(self.source)
        return self._values(program, self._inputs, np.zeros((2, 2)), self._turns)[1:]

    @property
    def moved_ends(self) -> Array:
        """The derivatives of both turning points at the points of the curve, as columns."""
        return self._end_rows[:, 0]

    @property
    def ends(self) -> Array:
        """The derivatives of the lower and of the upper turning point of a libration, as columns."""
        ends = self._end_rows[:, 0].copy()
        ends[list(self.source.shaping)] += self._shape.shifts(self._turns)
        return ends

    @property
    def turning_points(self) -> tuple[float, float]:
        """The lower and the upper turning point of a libration."""
        low, high = self._passage.turning_points
        return low.high, high.high

    @property
    def _program(self) -> Program:
        return chart_circulation_program(self.source) if self.direction else libration_program(self.source)

    @cached_property
    def _wanted(self) -> NDArray[np.intp]:
        """The results of the program that must be resolved: those of all variables whose displacement is known."""
        n, first, last = self.source.variables, 0, len(self._shape.pieces.curve.counts) - 1
        if not self.direction:
            first, last = int(self._found[LOWER, 0]), int(self._found[UPPER, 0])
        begin = self._shape.pieces.begin
        unknown = [self.source.shaping[i] for i in self._shape.unknown(min(first, begin), max(last, begin))]
        return np.setdiff1d(np.arange(2 + 2 * n), [row + k for k in unknown for row in (1, 2 + n)])

    @cached_property
    def _panels(self) -> Panels:
        """All integrands on panels that resolve them.

        Raises
        ------
        SolutionError
            If there are no such panels, or digits are lost.
        """
        inputs = np.hstack([self._inputs, self._range(self._end_rows if not self.direction else None)])
        return self._resolved(lambda *places: self._values(self._program, inputs, *places), self._wanted)

    @cached_property
    def _width(self) -> Array:
        """The width of the orbit in arc length, with the sign of a lap, as two doubles."""
        if self.direction:
            lap: Array = self.direction * self._shape.pieces.curve.lengths[:, :2].sum(axis=0)
            return lap
        both = self._found[[BEHIND, AHEAD], :2]
        return np.array(_sum(both[0], both[1]))

    def _range(self, ends: Array | None) -> Array:
        """Return the inputs of programs by which they know the range of the phase: the length of a lap, or both turning
        points as distances from the lower one, followed by their derivatives.
        """
        high, low = self._width
        if ends is None:
            return pairs((abs(high), abs(low), 0.0))
        return np.hstack([pairs((0.0, 0.0, 0.0), (high, low, UNIT * high)), ends[:, :, 0].T, ends[:, :, 1].T])

    def _resolved(self, evaluate: Callable[[Array, Array], Array], wanted: NDArray[np.intp]) -> Panels:
        """Return integrands on panels, of which the ``wanted`` are resolved, given their values as two doubles each
        and bounds on the errors for shares of the orbit's width and places.
        """
        curve, found, width = self._shape.pieces.curve, self._found, self._width
        row, kind = (LAUNCH, CIRCULATION) if self.direction else (LOWER, LIBRATION)

        def at_shares(shares: Array) -> Array:
            places = np.empty((PLACE, shares.shape[1]))
            places[:, 0] = found[row, :PLACE]
            fill_places(curve, shares, (width[0], width[1], found[row, 0], 0.0), places)
            return evaluate(shares, places)

        return resolved(kind, self._edges, at_shares, wanted, everywhere=False)

    def _integrals(self, first: int, count: int) -> Array:
        return self._panels.integrals[first : first + count]

    def second_durations(self, rows: tuple[int, ...]) -> Array:
        """Return the derivatives that `OrbitDerivatives.second_durations` describes.

        Raises
        ------
        SolutionError
            If one of the variables shapes the curve of a train, or there are no neighbouring curves.
        """
        shaping = tuple(k for k in self._shaped_by if k in rows)
        if shaping and not self._has_neighbours:
            raise SolutionError(
                "gradient: there are no second derivatives with respect to parameters that shape the curve of a train, "
                "or to heights of points; name the others in wrt, or take differences of the first derivatives, which "
                "are right to a few last places"
            )
        shape = ShapedBends(self._problem, self._shape.pieces, shaping)
        start = np.ascontiguousarray(self._found[[LAUNCH], :PLACE].T)
        found = SecondDurations(self.source._replace(shaping=shaping), rows, shape, self.variables, start)
        if self.direction:
            return found.of_lap(self._range(None), self._resolved)
        return found.of_libration(self._turns, self._width, self._range, self._resolved)

    @property
    def series(self) -> tuple[SeriesOf, Array]:
        """As `OrbitDerivatives.series`."""
        panels, n = self._panels, self.source.variables
        whole, samples = 1.0 if self.direction else 2.0 * np.pi, panels.samples
        arcs = np.concatenate([samples[2 + 2 * n :], np.zeros((n - self.source.parameters, *samples.shape[1:]))])
        if self.direction:
            arcs *= self.width
        else:
            arcs *= 0.5 * self.width * np.sin(panels.phases)
        return PanelSeries(panels.edges, np.concatenate([samples[: 1 + n], arcs]), whole), np.zeros(n)

    @property
    def width(self) -> float:
        """The width of a libration, or the length of a lap with its sign."""
        if self.direction:
            return float(self.direction * self._shape.pieces.curve.lengths[:, 0].sum())
        low, high = self.turning_points
        return high - low

    def at_places(self, lam: Array) -> PathRows:
        """Return `path_rows` at arc lengths, with derivatives at the points of the curve."""
        return path_along(self.source, self._shape, self.parameters, lam)

    def extreme_rows(self, place: Array, *, of_speed: bool, direction: int = 1) -> Array:
        """Return the rows of `OrbitDerivatives.extreme_rows` at the points of the curve; the second derivative is a
        difference quotient.
        """
        steps = DIFFERENCE_STEP_SHARE * self.width * np.array([[0.0], [-1.0], [1.0]])
        lam = (place + steps).ravel()
        places = self._shape.places(lam)
        rows = self._values(speed_program(self.source), self._inputs, np.zeros((2, lam.size)), places)[:, 0]
        if not of_speed:
            path = self.at_places(lam)
            mass_curvature, load = path.curvature, path.load
            by_variables = np.zeros((LAUNCH_VARIABLES, lam.size))
            force = [2.0 * rows[0] * mass_curvature[0] + load[0]]
            force.append(2.0 * (rows[1] * mass_curvature[0] + rows[0] * mass_curvature[-1]) + load[-1])
            partials = [np.vstack([row[1:-1], by_variables]) for row in (mass_curvature, load)]
            of_variables = 2.0 * (rows[2:] * mass_curvature[0] + rows[0] * partials[0]) + partials[1]
            if len(path.rows) > PRODUCT:
                force, of_variables = _length_rows(path, rows, direction)
            rows = np.vstack([*force, of_variables])
        here, before, after = np.moveaxis(rows.reshape(len(rows), 3, place.size), 1, 0)
        curvature = (after[1] - before[1]) / (steps[2] - steps[1])
        return np.vstack([here[:2], curvature, here[2:]])

    def relative_change(self, moved: Array, lam: Array) -> Array:
        """Return the change that `OrbitDerivatives.relative_change` describes."""
        moved = moved.copy()
        moved[list(self.source.shaping)] -= self._shape.shifts(self._shape.places(lam))[:, 0]
        return moved


def _length_rows(path: PathRows, rows: Array, direction: int) -> tuple[list[Array], Array]:
    """Return the length of the contact force along a path and its derivative with respect to the place, and those with
    respect to all variables, given half of V**2 with its derivatives in the same order, and the sign of ds/dt.
    """
    w = 2.0 * rows[0]
    v = direction * np.sqrt(np.maximum(w, 0.0))  # at a turn rounding may leave W below zero
    force = squared_force(path, v, w)
    by_half = force.even + force.odd / v if len(path.rows) > ASIDE else force.even
    length, of_path = np.sqrt(force.square), force.half_change(path.rows)
    along = (of_path[-1] + by_half * rows[1]) / length
    by_variables = np.vstack([of_path[1:-1], np.zeros((LAUNCH_VARIABLES, length.size))])
    return [length, along], (by_variables + by_half * rows[2:]) / length


def _sum(a: NDArray[np.float64], b: NDArray[np.float64]) -> tuple[float, float]:
    """Return the sum of two numbers of two doubles each."""
    exact = sum(map(Fraction, (*a.tolist(), *b.tolist())), Fraction(0))
    high = float(exact)
    return high, float(exact - Fraction(high))
