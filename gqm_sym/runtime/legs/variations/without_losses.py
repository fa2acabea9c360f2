"""A motion along a chart without losses, followed as one with losses that vanish, so that it has derivatives.

A motion that does not repeat has no period over which to integrate its derivatives. As legs it has those of motions
with losses: the law of motion is dW/ds = -2 dU/ds, with the potential and the contact force of the conservative module.
Python evaluates it for compiled code, a whole panel at a time.
"""

import ctypes
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from gqm_sym.runtime.charts.train import TrackOfTrain
from gqm_sym.runtime.compiled.emitted import Emitted, RunByPython
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.double_double.recording import scalar_product
from gqm_sym.runtime.gradients.charts.means import on_curve_of_means
from gqm_sym.runtime.gradients.orbit import without_formulas
from gqm_sym.runtime.interface import (
    PATH_ROWS,
    RIDER_ROWS,
    SPEED_EQUATION,
    SQUARED_CONTACT,
    STATIC_BALANCE,
    CompiledFunctions,
    DissipativeFunctions,
    ExactChartLaw,
    ExactPotential,
)
from gqm_sym.runtime.launch.formulas import ParameterValues
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.launch.rider import STANDARD_GRAVITY
from gqm_sym.runtime.legs.dissipative import dissipate
from gqm_sym.runtime.motion.motion import Motion

# V**2 in m2/s2 at which the factor of V**2 in a load is told from the load at rest; a power of 2.
FAST = 1024.0

# A number that keeps the square of a force that vanishes from being zero.
LEAST_SQUARE = 1e-300


def followed_in_legs(problem: Problem) -> Motion:
    """Return the motion of a conservative module along a chart as one with losses that vanish.

    Parameters
    ----------
    problem : Problem
        The launch.

    Raises
    ------
    SolutionError
        If the curve is known in doubles only.
    """
    if isinstance(problem.formulas.chart, TrackOfTrain):
        problem = on_curve_of_means(problem)
    formulas = problem.formulas
    if not isinstance(formulas.exact, ExactPotential) or formulas.rolling_radius or problem.true_pieces is None:
        raise without_formulas()
    mass = list(formulas.parameters).index("m")
    in_space = formulas.path_in_space is not None
    exact = _chart_law(formulas.exact, formulas.inertia, in_space=in_space)
    can_leave = not formulas.signed and problem.launch.contact != "bilateral"
    rider = formulas.rider_loads if can_leave else None
    functions = _without_losses(formulas.functions, mass, formulas.signed, formulas.directed, rider)
    lossless = replace(formulas, dissipation=functions, exact=exact)
    p = ParameterValues(problem.p)
    p.values, p.conditions = problem.p.values, {}
    return dissipate(lossless, p, problem.launch)


@lru_cache(maxsize=16)
def _without_losses(
    functions: CompiledFunctions, mass: int, is_signed: bool, is_directed: bool, rider: Emitted | None
) -> DissipativeFunctions:
    """Return the functions of motions with losses (`interface`) from those of a conservative module.

    Parameters
    ----------
    functions : CompiledFunctions
        The functions of the module.
    mass : int
        The index of the mass among the run-time parameters.
    is_signed, is_directed : bool
        As `Formulas` has them.
    rider : Emitted or None
        The loads on riders, if the body can leave the track to the side to which their vertical load is negative.
    """
    is_linear = rider is None or not is_directed

    def path(n: int, places: int, speeds: Array, p: int) -> Array:
        rows = np.empty((PATH_ROWS, n))
        functions.path_and_contact_force.call(n, places, speeds.ctypes.data, p, rows.ctypes.data)
        rows[-1] /= _numbers(p, mass + 1)[mass]
        return rows

    def slopes(n: int, places: int, p: int) -> Array:
        rows = np.empty((2, n))
        functions.effective_potential.call(n, places, p, rows.ctypes.data)
        slope: Array = rows[1]
        return slope

    def upright(n: int, places: int, speeds: int, v: float, p: int) -> Array:
        assert rider is not None
        rows = np.empty((RIDER_ROWS, n))
        rider.call(n, places, speeds, v, 0.0, p, rows.ctypes.data)
        force: Array = STANDARD_GRAVITY * rows[0]
        return force

    def speed_equation(n: int, places: int, speeds: int, v: float, _nu: float, p: int, out: int) -> None:
        _, _, ds, kappa, load = path(n, places, np.zeros(n), p)
        if rider is not None and is_linear:
            at_rest, moving = np.zeros(n), np.full(n, FAST)
            load = upright(n, places, at_rest.ctypes.data, v, p)
            kappa = (upright(n, places, moving.ctypes.data, v, p) - load) / FAST
        elif rider is not None:
            load, kappa = upright(n, places, speeds, v, p), np.zeros(n)
        _numbers(out, 5 * n).reshape(5, n)[:] = ds, -2.0 * slopes(n, places, p), np.zeros(n), load, kappa

    def static_balance(n: int, places: int, p: int, out: int) -> None:
        ds, push = path(n, places, np.zeros(n), p)[2], -slopes(n, places, p)
        _numbers(out, 2 * n).reshape(2, n)[:] = push / ds

    def squared_contact(n: int, places: int, p: int, out: int) -> None:
        _, _, _, kappa, load = path(n, places, np.zeros(n), p)
        w = np.where(kappa > 0.0, load / np.maximum(kappa, LEAST_SQUARE), 0.0)
        w = np.where((w > 0.0) & np.isfinite(w), w, 1.0)
        square, bend = load * load, kappa * kappa
        twice = (path(n, places, w, p)[-1] ** 2 - square - bend * w * w) / w
        _numbers(out, 4 * n).reshape(4, n)[:] = square, twice, bend, np.zeros(n)

    return DissipativeFunctions(
        RunByPython(speed_equation, SPEED_EQUATION),
        RunByPython(static_balance, STATIC_BALANCE),
        friction=False,
        kinked=False,
        linear=is_linear,
        squared_contact=None if is_signed or is_directed else RunByPython(squared_contact, SQUARED_CONTACT),
    )


def _numbers(address: int, count: int) -> Array:
    """Return an array of the doubles at an address."""
    return np.ctypeslib.as_array((ctypes.c_double * count).from_address(address))


@lru_cache(maxsize=16)
def _chart_law(exact: ExactPotential, inertia: Callable[..., Any] | None, *, in_space: bool) -> ExactChartLaw:
    """Return the law without losses, and the contact force, of a potential in the coordinates of the plane or of
    space.
    """
    potential, dimension = exact.effective_potential, 3 if in_space else 2

    def slopes(op: Any, point: tuple[Any, ...], p: Any) -> list[Any]:
        return [op.number(part) for part in potential(op, *point[:dimension], p)[1:]]

    def heavier(op: Any, load: Any, p: Any) -> Any:
        return load if inertia is None else op.number(inertia(op, p)) * load

    def speed_slope(op: Any, *given: Any) -> Any:
        *point, _w, _v, _nu, p = given
        return -2 * scalar_product(slopes(op, tuple(point), p), point[dimension : 2 * dimension])

    def load_in_plane(op: Any, *given: Any) -> Any:
        *point, p = given
        by_x, by_z = slopes(op, tuple(point), p)
        return heavier(op, by_z * point[2] - by_x * point[3], p)

    def load_in_space(op: Any, *given: Any) -> Any:
        *point, p = given
        pull, tangent = slopes(op, tuple(point), p), point[3:6]
        along = scalar_product(pull, tangent)
        across = [force - along * part for force, part in zip(pull, tangent, strict=True)]
        return heavier(op, op.sqrt(scalar_product(across, across) + LEAST_SQUARE), p)

    def coriolis_across(op: Any, tangent: Any, p: Any) -> list[Any]:
        """Return the vector that ds/dt adds to N/m for each unit of it."""
        assert exact.coriolis is not None
        a = [op.number(part) for part in exact.coriolis(op, *tangent, p)]
        return [a[i] * tangent[j] - a[j] * tangent[i] for i, j in ((1, 2), (2, 0), (0, 1))]

    def load_along_curvature(op: Any, *given: Any) -> Any:
        *point, p = given
        found = heavier(op, scalar_product(slopes(op, tuple(point), p), point[6:9]), p)
        if exact.coriolis is None:
            return found
        aside = coriolis_across(op, point[3:6], p)
        return found + scalar_product(aside, aside) / 2

    def coriolis_loads(op: Any, *given: Any) -> Any:
        *point, p = given
        aside = coriolis_across(op, point[3:6], p)
        across = scalar_product(slopes(op, tuple(point), p), aside)  # the vector has no component along the tangent
        return heavier(op, across, p), scalar_product(point[6:9], aside)

    if in_space:
        aside = None if exact.coriolis is None else coriolis_loads
        return ExactChartLaw(load_in_space, speed_slope, load_along_curvature, aside, exact.upright_force)
    return ExactChartLaw(load_in_plane, speed_slope)
