"""A motion along a chart without losses, followed as one with losses that vanish, so that it has derivatives.

A motion that does not repeat has no period over which to integrate its derivatives. As legs it has those of motions
with losses: the law of motion is dW/ds = -2 dU/ds, with the potential and the contact force of the conservative module.
Python evaluates it for compiled code, a whole panel at a time.
"""

import ctypes
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from math import inf
from typing import Any

import numpy as np

from gqm_sym.errors import SolutionError
from gqm_sym.literals.numbers import read_number
from gqm_sym.runtime.compiled.emitted import RunByPython
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.double_double.recording import scalar_product
from gqm_sym.runtime.gradients.orbit import without_formulas
from gqm_sym.runtime.interface import (
    PATH_ROWS,
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
from gqm_sym.runtime.legs.dissipative import dissipate
from gqm_sym.runtime.motion.motion import Motion

# A number that keeps the square of a force that vanishes from being zero.
LEAST_SQUARE = 1e-300


def followed_in_legs(problem: Problem, t_end: float) -> Motion:
    """Return the motion of a conservative module along a chart as one with losses that vanish.

    Parameters
    ----------
    problem : Problem
        The launch.
    t_end : float
        The time at which the motion ends; infinite if it does not.

    Raises
    ------
    SolutionError
        If the curve is known in doubles only; in space also if the frame rotates or the body can leave the track.
    """
    formulas = problem.formulas
    if not isinstance(formulas.exact, ExactPotential) or formulas.rolling_radius or problem.true_pieces is None:
        raise without_formulas()
    if formulas.directed or (not formulas.signed and problem.launch.contact != "bilateral"):
        raise SolutionError(
            "gradients: there are none of motions without losses that do not repeat, along tracks in space in a "
            "rotating frame or with contact on one side; there are if QuadraticDrag(b=0) is added to the forces"
        )
    mass = list(formulas.parameters).index("m")
    exact = _chart_law(formulas.exact, formulas.inertia, in_space=formulas.path_in_space is not None)
    functions = _without_losses(formulas.functions, mass, is_signed=formulas.signed)
    lossless = replace(formulas, dissipation=functions, exact=exact)
    p = ParameterValues(problem.p)
    p.values, p.conditions = problem.p.values, {}
    launch = problem.launch
    ends_by_itself = 0.0 < t_end < inf and (launch.t_max is None or t_end < launch.t_max.value)
    if ends_by_itself:  # without a horizon, nothing beyond the first turn would be searched for the end
        launch = launch._replace(t_max=read_number(2.0 * t_end, where="t_max"))
    return dissipate(lossless, p, launch)


@lru_cache(maxsize=16)
def _without_losses(functions: CompiledFunctions, mass: int, *, is_signed: bool) -> DissipativeFunctions:
    """Return the functions of motions with losses (`interface`) from those of a conservative module.

    ``mass`` is the index of the mass among the run-time parameters.
    """

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

    def speed_equation(n: int, places: int, _speeds: int, _v: float, _nu: float, p: int, out: int) -> None:
        _, _, ds, kappa, load = path(n, places, np.zeros(n), p)
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
        linear=True,
        squared_contact=None if is_signed else RunByPython(squared_contact, SQUARED_CONTACT),
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

    def load_along_curvature(op: Any, *given: Any) -> Any:
        *point, p = given
        return heavier(op, scalar_product(slopes(op, tuple(point), p), point[6:9]), p)

    if in_space:
        return ExactChartLaw(load_in_space, speed_slope, load_along_curvature)
    return ExactChartLaw(load_in_plane, speed_slope)
