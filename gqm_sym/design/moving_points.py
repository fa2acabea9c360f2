"""Tracks through points whose heights count as run-time parameters, so that motions have derivatives by them."""

from dataclasses import dataclass, replace
from functools import lru_cache
from math import factorial
from typing import Any

import numpy as np

from gqm_sym.design.charted_limits import lossy_slopes, shape_slopes
from gqm_sym.design.limits import LIMITS, PLACES, Limited, places_between
from gqm_sym.design.shape import SplineChanges
from gqm_sym.literals.numbers import read_number
from gqm_sym.runtime.arithmetic.doubledouble import two_product, two_sum
from gqm_sym.runtime.charts.chart import Chart
from gqm_sym.runtime.charts.exact_parts import Parts
from gqm_sym.runtime.charts.interpolation import DEGREE
from gqm_sym.runtime.charts.sampled import Sampled
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.gradients.charts.programs import ChartSource
from gqm_sym.runtime.interface import ExactPotential
from gqm_sym.runtime.launch.formulas import Formulas, ParameterValues
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.launch.request import LaunchRequest, read_launch
from gqm_sym.runtime.legs.dissipative import dissipate
from gqm_sym.runtime.model import CompiledModel
from gqm_sym.runtime.motion.conservative import solve


class PointDisplacements:
    """The displacements of the points of a spline's chart by the heights of the points that it passes through.

    Parameters
    ----------
    changes : SplineChanges
        The spline.
    origins : (n, 3) array
        For each piece of the chart the index of a knot, and the values of the spline's parameter at both ends.
    """

    def __init__(self, changes: SplineChanges, origins: Array) -> None:
        self._changes = changes
        _, low, high = origins.T
        self._middles, self._rates = middles, rates = low + 0.5 * (high - low), 0.5 * (high - low)
        # Each piece of the chart lies between two knots, and moves with them: at equal u the spline's parameter changes
        # by a linear function. So the displacement is a polynomial of u.
        knots, powers = changes.knots, rates[:, None] ** np.arange(DEGREE + 1)
        number = np.clip(np.searchsorted(knots, middles, side="right") - 1, 0, len(knots) - 2)
        slopes = (np.diff(changes.shifts, axis=0) / np.diff(knots)[:, None])[number]
        self._moved = changes.shifts[number] + slopes * (middles - knots[number])[:, None], slopes * rates[:, None]
        terms = np.array([changes.at(middles, k) * powers[:, [k]] / factorial(k) for k in range(DEGREE + 1)])
        for k in range(DEGREE):
            rate = (changes.spline(middles, k + 1) * powers[:, [k]]).T[:, :, None] / factorial(k)
            terms[k : k + 2] += [rate * moved for moved in self._moved]
        self._terms = np.moveaxis(terms, -1, 0)

    def pairs(self, places: Array) -> Array:
        """Return what `shaped_pieces.Displacements` describes."""
        terms, (number, u, u_low) = self._terms, places
        terms = terms[..., number.astype(np.int64)]
        high, low = terms[:, DEGREE], np.zeros_like(terms[:, DEGREE])
        for k in range(DEGREE - 1, -1, -1):
            product, rounding = two_product.py_func(high, u)
            low = rounding + (high * u_low + low * u)
            high, rounding = two_sum.py_func(terms[:, k], product)
            high, low = two_sum.py_func(high, low + rounding)
        both: Array = np.stack([high, low], axis=2)
        return both

    def points(self, places: Array, orders: int) -> Array:
        """Return what `shaped_pieces.Displacements` describes."""
        rows, powers, terms = [], np.vander(places[1], DEGREE + 1, increasing=True), self._terms
        for order in range(orders):
            chosen = terms[..., places[0].astype(np.int64)]
            rows.append(np.einsum("kjdn,nj->kdn", chosen, powers[:, : DEGREE + 1 - order]))
            terms = terms[:, 1:] * np.arange(1.0, DEGREE + 1 - order)[:, None, None]
        return np.concatenate(rows, axis=1)

    def arc_lengths(self, places: Array) -> Array:
        """Return what `shaped_pieces.Displacements` describes."""
        number, u = places[0].astype(np.int64), places[1] + places[2]
        place = self._middles[number] + u * self._rates[number]
        speed, (moved, slopes) = np.linalg.norm(self._changes.spline(place, 1), axis=-1), self._moved
        changes = self._changes.lengthened(place) + speed[:, None] * (moved[number] + slopes[number] * u[:, None])
        found: Array = changes.T
        return found


@dataclass(frozen=True, slots=True)
class MovingPoints:
    """A track through points, some of which have heights that are run-time parameters (`charts.chart.ChartMaker`).

    Attributes
    ----------
    track : Sampled
        The track for the present heights.
    moved : tuple of int
        The points with such heights.
    first : int
        The index of the first height among the run-time parameters; the others follow it.
    """

    track: Sampled
    moved: tuple[int, ...]
    first: int

    @property
    def shaped_by(self) -> tuple[int, ...]:
        """The heights shape the track."""
        return tuple(range(self.first, self.first + len(self.moved)))

    def chart(self, p: tuple[float, ...]) -> Chart:
        """Return the chart for the present heights."""
        return self.track.chart(p)

    def is_exact(self, chart: Chart) -> bool:
        """Return what `Sampled.is_exact` does."""
        return self.track.is_exact(chart)

    def true_curve(self, context: Any, p: tuple[Any, ...], chart: Chart) -> Parts:
        """Return what `Sampled.true_curve` does."""
        return self.track.true_curve(context, p, chart)

    def true_pieces(self, p: Any, chart: Chart) -> Any:
        """Return what `Sampled.true_pieces` does."""
        return self.track.true_pieces(p, chart)

    @property
    def changes(self) -> SplineChanges:
        """The changes of the spline."""
        return _changes(self)

    def displacements(self, chart: Chart) -> PointDisplacements:
        """Return the displacements of the chart's points by all heights."""
        return PointDisplacements(self.changes, chart.origins)


@lru_cache(maxsize=2)
def _changes(chart: MovingPoints) -> SplineChanges:
    return SplineChanges(np.array(chart.track.points.split(), dtype=np.float64).reshape(-1, 2), list(chart.moved))


def problem_of(
    model: CompiledModel, request: LaunchRequest, parameters: tuple[Any, ...], points: Array, moved: list[int]
) -> Problem:
    """Return the problem of a launch on a track through points, the heights of which are run-time parameters.

    ``model`` has that track as its chart. Compiled functions read the other run-time parameters only.
    """
    numbers = model.numbers(parameters)
    assert isinstance(model.chart, Sampled)
    chart, heights = MovingPoints(model.chart, tuple(moved), len(numbers)), points[moved, 1].tolist()
    names = [f"height of point {number}" for number in moved]
    formulas = replace(model, parameters={**model.parameters, **dict.fromkeys(names)}, chart=chart)
    p = ParameterValues((*numbers, *(read_number(height, where="height") for height in heights)))
    p.values, p.conditions = numbers.values, {}
    return Problem(formulas, read_launch(model, numbers, request), p, formulas.domain(p))


def changes_of(problem: Problem) -> SplineChanges:
    """Return the changes of the spline of a problem."""
    chart = problem.formulas.chart
    assert isinstance(chart, MovingPoints)
    return chart.changes


def source_along(formulas: Formulas) -> ChartSource:
    """Return the formulas of a body that loses no energy, along a curve that has one shape."""
    assert isinstance(formulas.exact, ExactPotential)
    names = list(formulas.parameters)
    return ChartSource(formulas.exact.effective_potential, formulas.inertia, len(names), names.index("m"), ())


def slopes_by_heights(problem: Problem, quantity: str, lam: Any) -> Array:
    """Return the derivatives of a quantity of a motion by all heights.

    Parameters
    ----------
    problem : Problem
        As `problem_of` makes it.
    quantity, lam
        As for `Motion.gradient`.
    """
    names, is_lossless = list(problem.formulas.parameters), problem.formulas.dissipation is None
    motion = (solve if is_lossless else dissipate)(problem.formulas, problem.p, problem.launch)
    found = motion.gradient(quantity, names[len(names) - len(changes_of(problem).lengthening) :], lam=lam)
    return np.array(list(found.values()))


def lossy_limits(problem: Problem, force: Array, between: Any) -> Limited:
    """Return the quantities along a spline of a body that loses energy, with their derivatives by all heights.

    Parameters
    ----------
    problem : Problem
        As `problem_of` makes it.
    force : (PLACES,) array
        The contact force at the places; NaN where the body does not come.
    between : pair of numbers or None
        As for `limits.along_spline`.
    """
    changes = changes_of(problem)
    places, count = places_between((problem.low, problem.high), between), len(changes.lengthening)
    stretched = np.zeros((PLACES, count))
    if between is None:
        stretched = np.linspace(0.0, 1.0, PLACES)[:, None] * changes.lengthening
    values, slopes = shape_slopes(*changes.at_lengths(places, stretched))
    found = Limited(dict(zip(LIMITS, values, strict=False)), dict(zip(LIMITS, slopes, strict=False)))
    found.values["normal_force"] = force
    rows = lossy_slopes(problem, places, np.isfinite(force))
    if rows is not None:
        found.slopes["normal_force"] = rows[1:-2].T[:, -count:] + rows[0][:, None] * stretched
    return found
