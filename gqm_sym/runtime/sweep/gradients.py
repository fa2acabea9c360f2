"""Sweeps with gradients: the values as without gradients, then the derivatives at the same launches.

Compiled code computes those of periods, turning points, extremes and first times at places of periodic motions along
curves with formulas. For all other quantities, and if its digits do not suffice, each launch is solved.
"""

from contextlib import suppress
from math import nan
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gqm_sym.arguments import one_of
from gqm_sym.errors import GQMError, InputError
from gqm_sym.runtime.compiled.strided import lay_out, widen
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.gradients.lanes.launches import launches_of
from gqm_sym.runtime.gradients.orbit import check_force
from gqm_sym.runtime.gradients.quantities import selected
from gqm_sym.runtime.gradients.sweep import COMPILED, PERIODS, launch_gradients
from gqm_sym.runtime.launch.kinds import LOAD_EXTREMES
from gqm_sym.runtime.launch.request import LaunchRequest
from gqm_sym.runtime.sweep.columns import as_doubles
from gqm_sym.runtime.sweep.quantities import ANSWERED, LOWER_END, QUANTITIES, SOLVE, UPPER_END
from gqm_sym.runtime.sweep.result import Sweep
from gqm_sym.runtime.sweep.sweep import Solve, sweep, sweep_with_columns

if TYPE_CHECKING:
    from gqm_sym.runtime.launch.formulas import Formulas


def sweep_with_gradient(
    formulas: "Formulas",
    quantity: str,
    launches: LaunchRequest,
    parameters: tuple[Any, ...],
    lam: Any,
    solve: Solve,
    wrt: Any,
) -> Sweep:
    """Return a sweep of a quantity with its derivatives.

    Parameters
    ----------
    formulas, quantity, launches, parameters, lam, solve
        As for `gqm_sym.runtime.sweep.sweep.sweep`.
    wrt : str or sequence of str
        The variables of differentiation.
    """
    one_of(quantity, tuple(QUANTITIES), where="quantity")
    rows = selected(formulas.parameters, wrt)
    if quantity in LOAD_EXTREMES:
        raise InputError(f"gradient: there is none of {quantity}, which is a load on a rider; leave gradient out")
    check_force(formulas, quantity)
    is_whole = quantity in PERIODS or (launches.t_max is None and launches.contact == "bilateral")
    is_compiled = quantity in COMPILED and is_whole and formulas.dissipation is None and formulas.chart is None
    width = UPPER_END + 1 if is_compiled and quantity in PERIODS else 0
    found, table = sweep_with_columns(formulas, quantity, launches, parameters, lam, solve, width)
    names = (*formulas.parameters, "lam0", "v0", "direction", "lam")
    given = (*parameters, launches.lam0, launches.v0, launches.direction, 0.0 if lam is None else lam)
    size, shape = found.status.size, (*found.values.shape[found.status.ndim :], len(rows))  # two turning points
    columns = [widen(as_doubles(value, name), found.status.shape) for value, name in zip(given, names, strict=True)]
    lines = lay_out(columns, 0, size)
    answered, route = np.flatnonzero(found.status.reshape(-1) == ANSWERED), found.route.reshape(-1)
    slopes, which = None, answered
    if is_compiled:
        values = found.values.reshape(size, *shape[:-1])
        ends = values if quantity == "turning_points" else table[:, LOWER_END:]
        if quantity not in (*PERIODS, "turning_points"):
            width = UPPER_END + 1
            periods, table = sweep_with_columns(formulas, "period", launches, parameters, None, solve, width)
            ends, which = table[:, LOWER_END:], answered[periods.status.reshape(-1)[answered] == ANSWERED]
        some: Any = slice(None) if which.size == size else which
        launched = [line if line.size == 1 else line[some] for line in lines]
        values, ends = values[some], ends[some]
        several, missing = launches_of(formulas, launched[:-2], launched[-2], ends)
        if missing:
            _fill_missing_ends(formulas, launched, ends, solve)
            several, _ = launches_of(formulas, launched[:-2], launched[-2], ends)
        if which.size:
            slopes = launch_gradients(formulas, quantity, several, values, tuple(rows.values()), launched[-1])
    if slopes is not None and which.size == size:
        gradient = slopes
    else:
        gradient = np.full((size, *shape), nan)
        if slopes is not None:
            gradient[which] = slopes
    for k in answered[_are_open(gradient, answered)].tolist():
        *p, lam0, v0, direction, place = (float(line[k % line.size]) for line in lines)
        motion = solve(LaunchRequest(lam0, v0, int(direction), None, launches.t_max, launches.contact), tuple(p))
        route[k] = SOLVE
        with suppress(GQMError):
            by = motion._known_gradient(quantity, tuple(rows), None if lam is None else place)
            by_name = np.stack(list(by.values()), axis=-1)
            falls = quantity == "turning_points" and motion.turning_points[0] > motion.turning_points[1]
            gradient[k] = by_name[::-1] if falls else by_name
    found.route[...] = route.reshape(found.status.shape)
    found.gradient = gradient.reshape(*found.status.shape, *shape)
    return found


def _fill_missing_ends(formulas: "Formulas", lines: list[Array], ends: Array, solve: Solve) -> None:
    """Fill the turning points of launches for which batches have found none.

    The ``lines`` are the run-time parameters, lam0, v0, the direction and a place.
    """
    missing = np.flatnonzero(np.isnan(ends).all(axis=1))
    *parameters, lam0, v0, direction, _ = (line[missing if line.size > 1 else [0] * missing.size] for line in lines)
    ends[missing] = sweep(
        formulas, "turning_points", LaunchRequest(lam0, v0, direction), tuple(parameters), None, solve
    ).values


def _are_open(gradient: Array, answered: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Return which of the answered launches lack a derivative."""
    if answered.size == len(gradient) and not np.isnan(gradient.sum()):  # one sum is much faster than one for each
        return np.zeros(answered.size, dtype=np.bool_)
    return np.asarray(np.isnan(gradient[answered]).any(axis=tuple(range(1, gradient.ndim))))
