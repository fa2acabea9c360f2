"""Height, slope, curvature and contact force at places along curves without formulas, with their derivatives by
parameters of the curve.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gqm_sym.design.limit_programs import POINT, rows_at, track_program
from gqm_sym.design.limits import LIMITS, PLACES, Limited, end_slopes, inputs_of, places_between
from gqm_sym.errors import GQMError, SolutionError
from gqm_sym.runtime.charts.rail import Rail
from gqm_sym.runtime.charts.tracing import Traced
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.double_double.recording import Recorder
from gqm_sym.runtime.gradients.charts.orbit import source_along
from gqm_sym.runtime.gradients.charts.programs import ChartSource
from gqm_sym.runtime.gradients.charts.shaped_pieces import ShapedPieces, shaped_pieces, shaping_of
from gqm_sym.runtime.gradients.evaluation import values as results
from gqm_sym.runtime.gradients.programs import Program, range_program, with_derivatives
from gqm_sym.runtime.interface import ExactChartLaw, ExactPotential
from gqm_sym.runtime.launch.formulas import ParameterValues, true_pieces_of
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.launch.request import LaunchRequest, read_launch
from gqm_sym.runtime.legs.dissipative import dissipate
from gqm_sym.runtime.legs.variations.answers import forces_at_places
from gqm_sym.runtime.model import CompiledModel


def along_chart(
    model: CompiledModel,
    request: LaunchRequest,
    parameters: tuple[Any, ...],
    ends: tuple[float, float],
    between: Any,
) -> Limited:
    """Return the quantities along a curve without formulas, without their derivatives."""
    from scipy.interpolate import CubicSpline

    places = places_between(ends, between)
    found = model.pass1(request, parameters, places)
    rise, across = (CubicSpline(places, row)(places, 1) for row in (found.z, found.x))
    with np.errstate(divide="ignore"):
        slope = rise / across
    rows = found.z, slope, found.kappa, found.normal_force
    return Limited(dict(zip(LIMITS, rows, strict=True)), {})


def along_shaped_chart(
    model: CompiledModel,
    request: LaunchRequest,
    parameters: tuple[Any, ...],
    names: Sequence[str],
    between: Any,
    *,
    from_end: bool,
) -> Limited | None:
    """Return the quantities along a planar curve without formulas, with their derivatives by some of its parameters;
    None if it has none.

    With losses the contact force has derivatives if a motion that passes the places is found and has them.

    Parameters
    ----------
    model, request, parameters, names, between, from_end
        As for `limits.along_formulas`; places are arc lengths.
    """
    p, maker = model.numbers(parameters), model.chart
    problem = Problem(model, read_launch(model, p, request), p, model.domain(p))
    pieces = None if maker is None or model.rolling_radius else true_pieces_of(maker, p, model.charted(p))
    if pieces is None or model.path_in_space is not None or model.directed:
        return None
    shaping, columns = shaping_of(model), [list(model.parameters).index(name) for name in names]
    shape = shaped_pieces(problem, pieces, tuple(k for k in columns if k in shaping))
    need_ends = between is None or from_end
    ends = _end_changes(model, p, shape, columns) if need_ends else np.zeros((2, len(columns)))
    if ends is None:
        return None
    domain = model.domain(p).numbers
    places, shares = places_between((domain.low, domain.high), between), np.linspace(0.0, 1.0, PLACES)[:, None]
    start = problem.launch.lam0.value
    stretched = float(between is None) * ((1.0 - shares) * ends[0] + shares * ends[1])
    moved = np.vstack([stretched, float(from_end) * ends[:1]])
    shaped = [k in shaping for k in columns]
    at, changes = _at_lengths(shape, np.append(places, start), moved, shaped)
    shape_values, slopes = shape_slopes(at[:, :-1], changes[:, :-1])
    found = Limited(dict(zip(LIMITS, shape_values, strict=False)), dict(zip(LIMITS, slopes, strict=False)))
    found.values["normal_force"] = model.pass1(request, parameters, places).normal_force
    if isinstance(model.exact, ExactPotential):
        source = source_along(problem)._replace(shaping=())
        launch = problem.launch.v0.value, at[:2, -1], changes[:2, -1]
        found.slopes["normal_force"] = _force_slopes(source, inputs_of(p), launch, (at, changes), columns)
    elif isinstance(model.exact, ExactChartLaw):
        force = lossy_slopes(problem, places, np.isfinite(found.values["normal_force"]))
        if force is not None:
            by_launch = force[1 + len(p)][:, None] * moved[-1]
            found.slopes["normal_force"] = force[1:].T[:, columns] + by_launch + force[0][:, None] * stretched
    return found


def lossy_slopes(problem: Problem, places: Array, passed: NDArray[np.bool_]) -> Array | None:
    """Return the derivatives of the contact force with losses with respect to the place and to all variables at given
    arc lengths, with a column for each place that is passed; None if there are none.
    """
    found = np.zeros((len(problem.p) + 3, places.size))
    try:
        motion = dissipate(problem.formulas, problem.p, problem.launch)
        found[:, passed] = forces_at_places(motion, places[passed])
    except GQMError:
        return None
    return found


def _end_changes(model: CompiledModel, p: ParameterValues, shape: ShapedPieces, columns: list[int]) -> Array | None:
    """Return the derivatives of both ends of the curve in arc length; None if they are not known."""
    maker, found = model.chart, np.zeros((2, len(columns)))
    if isinstance(maker, Rail) and not shape.pieces.curve.period:
        last = len(shape.pieces.curve.counts) - 1.0
        changes = shape.arc_length_changes(np.array([[0.0, last], [-1.0, 1.0], [0.0, 0.0]]))
        found[:, [k in shaping_of(model) for k in columns]] = changes.T
        return found
    if isinstance(maker, Traced) and maker.domain is not None:
        rows = results(range_program(maker.domain, len(p)), inputs_of(p), np.zeros(1))[:, 0, 0]
        slopes: Array = rows.reshape(-1, 1 + len(p))[:2, 1:][:, columns]
        return slopes
    return None


def start_slopes(model: CompiledModel, p: ParameterValues, names: Sequence[str]) -> Array | None:
    """Return the derivatives of the lower end of a curve by some of its parameters; None if they are not known."""
    if model.domain_of is not None:
        slopes: Array = end_slopes(model, p, names)[0]
        return slopes
    maker = model.chart
    if isinstance(maker, Traced) and maker.domain is not None:
        rows = results(range_program(maker.domain, len(p)), inputs_of(p), np.zeros(1))[:, 0, 0]
        found: Array = rows[1 : 1 + len(p)][[list(model.parameters).index(name) for name in names]]
        return found
    return np.zeros(len(names)) if isinstance(maker, Rail) else None  # a rail begins with arc length 0


def _at_lengths(shape: ShapedPieces, lengths: Array, moved: Array, shaped: list[bool]) -> tuple[Array, Array]:
    """Return the coordinates of points at arc lengths with their first two derivatives along a piece, and the changes
    of these if the arc lengths change by ``moved``.

    Parameters
    ----------
    shape : ShapedPieces
        The curve.
    lengths : (m,) array
        The arc lengths.
    moved : (m, k) array
        Their changes with k parameters.
    shaped : list of bool
        Which of these shape the curve.
    """
    places = shape.places(lengths)
    path = shape.path(places)
    at, following, displaced = path[:POINT], path[2 : 2 + POINT], path[8:].reshape(-1, POINT, lengths.size)
    shifts, changes = moved.copy(), np.zeros((POINT, *moved.shape))
    shifts[:, shaped] -= shape.arc_length_changes(places).T
    changes[:, :, shaped] = np.moveaxis(displaced, 0, -1)
    changes += following[..., None] * (shifts / np.hypot(at[2], at[3])[:, None])
    if not np.isfinite(changes).all():
        raise SolutionError("design.minimise: the curve does not exist for neighbouring values of its parameters")
    return at, changes


def shape_slopes(at: Array, changes: Array) -> tuple[list[Array], list[Array]]:
    """Return height, slope and curvature at points (`_at_lengths`), and their changes."""
    _, z, dx, dz, bend_x, bend_z = at
    _, z_by, dx_by, dz_by, bend_x_by, bend_z_by = changes
    speed, cross = np.hypot(dx, dz), dx * bend_z - dz * bend_x
    with np.errstate(all="ignore"):
        slope_by = (dz_by * dx[:, None] - dz[:, None] * dx_by) / (dx * dx)[:, None]
        cross_by = dx_by * bend_z[:, None] + dx[:, None] * bend_z_by - dz_by * bend_x[:, None] - dz[:, None] * bend_x_by
        speed_by = (dx[:, None] * dx_by + dz[:, None] * dz_by) / speed[:, None]
        curvature_by = (cross_by - 3.0 * (cross / speed)[:, None] * speed_by) / (speed**3)[:, None]
        return [z, dz / dx, cross / speed**3], [z_by, slope_by, curvature_by]


@lru_cache(maxsize=64)
def _energy_program(source: ChartSource) -> Program:
    """Return the program of the potential with its derivatives by x, z and the run-time parameters."""
    op = Recorder(source.parameters, 2)
    value, *_ = source.potential(op, *op.places, op.values)
    return with_derivatives(op, [value], [*op.places, *op.values])


def _force_slopes(
    source: ChartSource,
    inputs: Array,
    launch: tuple[float, Array, Array],
    points: tuple[Array, Array],
    columns: list[int],
) -> Array:
    """Return the changes of the contact force at all points but the last one, the launch, which has a speed."""
    (v0, (x, z), moved), (at, changes) = launch, points
    energy, by_x, by_z, *by_parameters = results(_energy_program(source), inputs, np.array([x]), None, np.array([z]))[
        :, 0, 0
    ]
    by_launch = 2.0 * (by_x * moved[0] + by_z * moved[1] + np.array(by_parameters)[columns])
    total = np.array([[v0 * v0 + 2.0 * energy], [0.0], [0.0]])
    force = rows_at(track_program(source), np.hstack([inputs, total]), at[:, :-1])[-1]
    by_parameters = force[2 + POINT :][columns].T
    slopes: Array = np.einsum("ci,cik->ik", force[1 : 1 + POINT], changes[:, :-1]) + by_parameters
    slopes += force[1 + POINT][:, None] * by_launch
    return slopes
