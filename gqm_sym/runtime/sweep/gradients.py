"""Sweeps with gradients: the values as without gradients, then the derivatives at the same launches.

Compiled code computes those of periods, turning points and extremes of periodic motions along curves with formulas. For
all other quantities, and if its digits do not suffice, each launch is solved.
"""

from contextlib import suppress
from math import nan
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gqm_sym.errors import GQMError, InputError
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.gradients.lanes.launches import launches_of
from gqm_sym.runtime.gradients.orbit import check_force
from gqm_sym.runtime.gradients.quantities import selected
from gqm_sym.runtime.gradients.sweep import COMPILED, PERIODS, launch_gradients
from gqm_sym.runtime.launch.kinds import LOAD_EXTREMES
from gqm_sym.runtime.launch.request import LaunchRequest
from gqm_sym.runtime.sweep.columns import as_doubles
from gqm_sym.runtime.sweep.quantities import ANSWERED, SOLVE
from gqm_sym.runtime.sweep.result import Sweep
from gqm_sym.runtime.sweep.sweep import Solve, sweep

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
    rows = selected(formulas.parameters, wrt)
    if quantity in LOAD_EXTREMES:
        raise InputError(f"gradient: there is none of {quantity}, which is a load on a rider; leave gradient out")
    check_force(formulas, quantity)
    found = sweep(formulas, quantity, launches, parameters, lam, solve)
    names = (*formulas.parameters, "lam0", "v0", "direction", "lam")
    given = (*parameters, launches.lam0, launches.v0, launches.direction, 0.0 if lam is None else lam)
    size, shape = found.status.size, (*found.values.shape[found.status.ndim :], len(rows))  # two turning points
    table = np.empty((size, len(names)))
    by_launch = table.reshape(*found.status.shape, len(names))
    for column, (value, name) in enumerate(zip(given, names, strict=True)):
        by_launch[..., column] = as_doubles(value, name)
    answered = np.flatnonzero(found.status.reshape(-1) == ANSWERED)
    gradient, route = np.full((size, *shape), nan), found.route.reshape(-1)
    is_whole = quantity in PERIODS or (launches.t_max is None and launches.contact == "bilateral")
    if quantity in COMPILED and is_whole and formulas.dissipation is None and formulas.chart is None:
        spans = sweep(formulas, "turning_points", launches, parameters, None, solve)
        periods = found if quantity in PERIODS else sweep(formulas, "period", launches, parameters, None, solve)
        which = answered[periods.status.reshape(-1)[answered] == ANSWERED]
        some: Any = slice(None) if which.size == size else which
        ends, values = spans.values.reshape(-1, 2)[some], found.values.reshape(size, *shape[:-1])[some]
        several = launches_of(formulas, table[some, :-2], table[some, -2], ends)
        if which.size:
            gradient[some] = launch_gradients(formulas, quantity, several, values, tuple(rows.values()))
    for k in answered[_are_open(gradient, answered)].tolist():
        *p, lam0, v0, direction, place = table[k].tolist()
        motion = solve(LaunchRequest(lam0, v0, int(direction), None, launches.t_max, launches.contact), tuple(p))
        route[k] = SOLVE
        with suppress(GQMError):
            slopes = motion.gradient(quantity, tuple(rows), lam=None if lam is None else place)
            by_name = np.stack(list(slopes.values()), axis=-1)
            falls = quantity == "turning_points" and motion.turning_points[0] > motion.turning_points[1]
            gradient[k] = by_name[::-1] if falls else by_name
    found.route[...] = route.reshape(found.status.shape)
    found.gradient = gradient.reshape(*found.status.shape, *shape)
    return found


def _are_open(gradient: Array, answered: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Return which of the answered launches lack a derivative."""
    if answered.size == len(gradient) and not np.isnan(gradient.sum()):  # one sum is much faster than one for each
        return np.zeros(answered.size, dtype=np.bool_)
    return np.asarray(np.isnan(gradient[answered]).any(axis=tuple(range(1, gradient.ndim))))
