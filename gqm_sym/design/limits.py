"""Limits on height, slope, curvature and contact force at places along a track, with their derivatives by its
unknowns.
"""

from collections.abc import Callable, Mapping, Sequence
from math import inf, isfinite
from typing import Any, NamedTuple

import numpy as np

from gqm_sym.arguments import short, unknown_argument
from gqm_sym.design.limit_programs import POINT, rows_at, shape_program, track_program
from gqm_sym.design.shape import SplineChanges
from gqm_sym.design.tracks import read_constant
from gqm_sym.errors import DeclarationError, GQMError
from gqm_sym.literals.namespaces import ARRAYS
from gqm_sym.literals.numbers import read_number
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.double_double.arithmetic import UNIT
from gqm_sym.runtime.gradients.charts.programs import ChartSource
from gqm_sym.runtime.gradients.evaluation import values as results
from gqm_sym.runtime.gradients.formula_orbit import source_of, variables_of
from gqm_sym.runtime.gradients.orbit import pairs
from gqm_sym.runtime.gradients.programs import extreme_program, range_program
from gqm_sym.runtime.interface import ExactFormulas, ExactLaw
from gqm_sym.runtime.launch.formulas import Formulas, ParameterValues
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.launch.request import LaunchRequest, read_launch
from gqm_sym.runtime.legs.variations.answers import forces_at_places
from gqm_sym.runtime.model import CompiledModel

# The quantities that may be limited, with their units, in the order of programs (`limit_programs`).
LIMITS = {"height": "m", "slope": "1", "curvature": "1/m", "normal_force": "N"}

# The number of places along the track at which limits are imposed.
PLACES = 201

# A margin counts as at most this number of limits, where a track is vertical.
LARGEST_MARGIN = 1e6


class Limit(NamedTuple):
    """A limit on one of the quantities."""

    name: str
    low: float
    high: float

    @property
    def scale(self) -> float:
        """The size of the limit, by which its margin is measured."""
        return max((abs(end) for end in (self.low, self.high) if isfinite(end)), default=1.0) or 1.0

    @property
    def unit(self) -> str:
        """The unit, as it stands behind a number."""
        return "" if LIMITS[self.name] == "1" else f" {LIMITS[self.name]}"

    def margins(self, values: Array | None) -> Array:
        """Return the margins to both ends at all places, as shares of the size; -1 where there is no value."""
        if values is None:
            return np.full(2 * PLACES, -1.0)
        both = np.concatenate([values - self.low, self.high - values]) / self.scale
        found: Array = np.where(np.isnan(both), -1.0, np.clip(both, -LARGEST_MARGIN, LARGEST_MARGIN))
        return found

    def slopes(self, values: Array, slopes: Array) -> Array:
        """Return the derivatives of `margins`, given those of the values: a row for each margin."""
        both = np.concatenate([slopes, -slopes]) / self.scale
        ends = np.concatenate([values - self.low, self.high - values]) / self.scale
        counts = (np.abs(ends) < LARGEST_MARGIN)[:, None] & np.isfinite(both)
        found: Array = np.where(counts, both, 0.0)
        return found


class Limited(NamedTuple):
    """The quantities at places along one track.

    Attributes
    ----------
    values : dict
        For each name the values.
    slopes : dict
        For each name the derivatives by the unknowns of the track, a row for each place; names without exact
        derivatives are missing.
    """

    values: dict[str, Array]
    slopes: dict[str, Array]


def read_limits(limits: Mapping[str, tuple[Any, Any]], where: str) -> list[Limit]:
    """Read the limits on load and shape."""
    found = []
    for name, pair in limits.items():
        if name not in LIMITS:
            raise DeclarationError(unknown_argument(f"{where}: limits", str(name), LIMITS, what="limit"))
        if not isinstance(pair, tuple | list) or len(pair) != 2:
            raise DeclarationError(
                f"{where}: limits: {name}: must be (low, high), either of them None, got {short(pair)}"
            )
        low, high = (
            side if end is None else float(read_constant(end, f"limits: {name}", where=where, unit=LIMITS[name]))
            for end, side in zip(pair, (-inf, inf), strict=True)
        )
        if not low < high:
            raise DeclarationError(
                f"{where}: limits: {name}: the limits contradict each other, got ({low!r}, {high!r})"
            )
        found.append(Limit(name, low, high))
    return found


def read_bounds(limits: Any, guess: float | None, name: str) -> tuple[float, float, float]:
    """Read the lower limit, first guess and upper limit of an unknown.

    Parameters
    ----------
    limits : tuple
        ``(low, high)`` or ``(low, guess, high)``; the limits may be None.
    guess : float or None
        The value to begin with if none is given and if it lies between the limits; otherwise it is their middle.
    name : str
        The unknown.

    Raises
    ------
    DeclarationError
        If the limits contradict each other or exclude the first guess, or if there is no value to begin with.
    """
    if not isinstance(limits, tuple | list) or len(limits) not in (2, 3):
        raise DeclarationError(
            f"design.minimise: free: {name}: must be (low, high) or (low, guess, high), got {limits!r}"
        )
    where = f"design.minimise: free: {name}"
    low, high = (
        side if end in (None, side) else read_number(end, where=where).value
        for end, side in zip((limits[0], limits[-1]), (-inf, inf), strict=True)
    )
    if not low < high:
        raise DeclarationError(f"{where}: the limits contradict each other, got {limits!r}")
    if len(limits) == 3 and limits[1] is not None:
        start = read_number(limits[1], where=where).value
        if not low <= start <= high:
            raise DeclarationError(f"{where}: the first guess {start!r} must lie between {low!r} and {high!r}")
    elif guess is not None and low <= guess <= high:
        start = guess
    elif isfinite(low) and isfinite(high):
        start = 0.5 * (low + high)
    else:
        raise DeclarationError(f"{where}: has no value to begin with; give (low, guess, high), got {limits!r}")
    return low, start, high


def places_between(ends: tuple[float, float], between: tuple[Any, Any] | None) -> Array:
    """Return the places along a track, between two of them or its ends, at which limits are imposed."""
    low, high = ends if between is None else sorted(float(end) for end in between)
    if not (isfinite(low) and isfinite(high)):
        raise DeclarationError("design.minimise: between: the curve is endless; say where the limits are held")
    return np.linspace(low, high, PLACES)


def along_spline(
    changes: SplineChanges,
    source: ChartSource,
    launch: tuple[tuple[float, ...], float, float],
    ends: tuple[float, float],
    between: Any,
) -> Limited:
    """Return the quantities along a spline, with their derivatives by the heights of the points that move.

    Parameters
    ----------
    changes : SplineChanges
        The spline.
    source : ChartSource
        The formulas of a body that loses no energy.
    launch : tuple
        The run-time parameters, the arc length of the launch, and the launch speed.
    ends : (float, float)
        The arc lengths of both ends of the spline.
    between : pair of numbers or None
        The arc lengths between which the places lie; None for the whole spline, whose length changes.
    """
    (p, start, v0), places = launch, places_between(ends, between)
    lengthening = changes.lengthening if between is None else np.zeros_like(changes.lengthening)
    shares = np.append(np.linspace(0.0, 1.0, PLACES), 0.0)
    at, moves = changes.at_lengths(np.append(places, start), shares[:, None] * lengthening)
    potential, by_x, by_z = (float(part) for part in source.potential(ARRAYS, *at[:2, -1].tolist(), p))
    energy, by_energy = v0 * v0 + 2.0 * potential, 2.0 * (by_x * moves[0, -1] + by_z * moves[1, -1])
    inputs = pairs(*((number, 0.0, 0.0) for number in (*p, energy)))
    rows = rows_at(track_program(source), inputs, at[:, :-1])
    slopes = np.einsum("qci,cik->qik", rows[:, 1 : 1 + POINT], moves[:, :-1]) + rows[:, 1 + POINT, :, None] * by_energy
    return Limited(*(dict(zip(LIMITS, part, strict=True)) for part in (rows[:, 0], slopes)))


def along_formulas(
    model: CompiledModel,
    request: LaunchRequest,
    parameters: tuple[Any, ...],
    names: Sequence[str],
    between: Any,
    *,
    from_end: bool,
) -> Limited:
    """Return the quantities along a curve with formulas, with their derivatives by some of its parameters.

    Parameters
    ----------
    model, request, parameters
        The model, the launch and the run-time parameters.
    names : sequence of str
        The parameters of differentiation.
    between : pair of numbers or None
        The places between which the limits are imposed; None for the whole curve, whose ends may change.
    from_end : bool
        Whether the launch is at the lower end of the curve, and moves with it.
    """
    exact, p, count = model.exact, model.numbers(parameters), len(model.parameters)
    assert isinstance(exact, ExactFormulas | ExactLaw)
    columns = _columns(model, names)
    places = places_between(model.domain(p).numbers[:2], between)
    low, high = end_slopes(model, p, names)
    shares = np.linspace(0.0, 1.0, PLACES)[:, None]
    moved = (1.0 - shares) * low + shares * high if between is None else np.zeros((1, len(columns)))
    shape = rows_at(shape_program(exact, count), inputs_of(p), places[None])
    rows = dict(zip(("height", "slope", "curvature"), shape, strict=True))
    values = {name: row[0] for name, row in rows.items()}
    slopes = {name: row[2:].T[:, columns] + row[1][:, None] * moved for name, row in rows.items()}
    found = model.pass1(request, parameters, places)
    values["normal_force"] = found.normal_force
    force = _force_slopes(model, request, parameters, places, found.v2)
    if force is not None:
        by_place, by_launch = force[0][:, None], force[1 + count][:, None] * (low if from_end else 0.0)
        slopes["normal_force"] = force[1:].T[:, columns] + by_launch + by_place * moved
    return Limited(values, slopes)


def end_slopes(model: Formulas, p: ParameterValues, names: Sequence[str]) -> Array:
    """Return the derivatives of both ends of a curve with formulas by some of its parameters; 0 for ends that do not
    exist.
    """
    assert model.domain_of is not None
    found = results(range_program(model.domain_of, len(p)), inputs_of(p), np.zeros(1))[:, 0, 0]
    slopes: Array = found.reshape(-1, 1 + len(p))[:2, 1:][:, _columns(model, names)]
    return slopes


def _columns(model: Formulas, names: Sequence[str]) -> list[int]:
    """Return the numbers of some parameters among all of them."""
    return [list(model.parameters).index(name) for name in names]


def inputs_of(p: ParameterValues) -> Array:
    """Return run-time parameters as inputs of programs."""
    return pairs(*((n.value, n.low, 0.25 * UNIT * abs(n.value) if n.low else 0.0) for n in p))


def _force_slopes(
    model: CompiledModel, request: LaunchRequest, parameters: tuple[Any, ...], places: Array, v2: Array
) -> Array | None:
    """Return the derivatives of the contact force with respect to the place and the variables (`programs.Source`), with
    a column for each place; None if there are none.
    """
    p, passed = model.numbers(parameters), np.isfinite(v2)
    found = np.zeros((len(p) + 3, places.size))
    if isinstance(model.exact, ExactLaw):
        try:
            motion = model.solve(request, parameters)
            found[:, passed] = forces_at_places(motion, places[passed])
        except GQMError:
            return None
        return found
    if model.directed and getattr(model.exact, "coriolis_loads", None) is None:
        return None
    problem = Problem(model, read_launch(model, p, request), p, model.domain(p))
    program = extreme_program(source_of(model), of_speed=False, direction=problem.launch.direction)
    rows = results(program, variables_of(problem), places)[:, 0]
    found[0], found[1:] = rows[1], rows[3:-1]
    return found


def margins_of(held: list[Limit], found: Limited | None) -> list[Array]:
    """Return the margins to each limit; -1 where the motion does not exist."""
    return [limit.margins(None if found is None else found.values[limit.name]) for limit in held]


def slopes_of(held: list[Limit], found: Limited | None, quotients: Callable[[Limit], Array], size: int) -> list[Array]:
    """Return the derivatives of the margins by all unknowns, of which there are ``size``.

    Parameters
    ----------
    held : list of Limit
        The limits.
    found : Limited or None
        The quantities along the track; None where the motion does not exist.
    quotients : callable
        The derivatives for limits without exact ones.
    """
    if found is None:
        return [np.zeros((2 * PLACES, size)) for _ in held]
    return [
        limit.slopes(found.values[limit.name], found.slopes[limit.name])
        if limit.name in found.slopes
        else quotients(limit)
        for limit in held
    ]
