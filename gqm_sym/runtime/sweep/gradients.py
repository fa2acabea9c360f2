"""Sweeps of periods with their gradients: the values as ever, then the derivatives at the same launches."""

from contextlib import suppress
from math import nan
from typing import TYPE_CHECKING, Any

import numpy as np

from gqm_sym.errors import SolutionError
from gqm_sym.runtime.gradients.orbit import source_of
from gqm_sym.runtime.gradients.quantities import selected
from gqm_sym.runtime.gradients.sweep import checked, period_gradients
from gqm_sym.runtime.launch.request import LaunchRequest
from gqm_sym.runtime.sweep.quantities import ANSWERED
from gqm_sym.runtime.sweep.result import Sweep
from gqm_sym.runtime.sweep.sweep import Solve, as_doubles, sweep

if TYPE_CHECKING:
    from gqm_sym.runtime.launch.formulas import Formulas


def sweep_with_gradient(
    formulas: "Formulas",
    quantity: str,
    launches: LaunchRequest,
    parameters: tuple[Any, ...],
    wrt: Any,
    solve: Solve,
    client: Any,
) -> Sweep:
    """Half periods or periods, and their derivatives.

    Parameters
    ----------
    formulas, quantity, launches, parameters, solve
        As for `gqm_sym.runtime.sweep.sweep.sweep`.
    wrt : str or sequence of str
        What the derivatives are by.
    client
        A cluster, which is refused.
    """
    rows, halves = selected(formulas.parameters, wrt), checked(quantity, client)
    if formulas.dissipation is not None:
        raise SolutionError("gradients: motions with losses have none yet")
    source_of(formulas)
    found = sweep(formulas, quantity, launches, parameters, None, solve)
    spans = sweep(formulas, "turning_points", launches, parameters, None, solve).values.reshape(-1, 2)
    names = (*formulas.parameters, "lam0", "v0", "direction")
    given = (*parameters, launches.lam0, launches.v0, launches.direction)
    columns = [
        np.broadcast_to(as_doubles(v, n), found.status.shape).reshape(-1) for v, n in zip(given, names, strict=True)
    ]
    answered = np.flatnonzero(found.status.reshape(-1) == ANSWERED)
    gradient = np.full((found.status.size, len(rows)), nan)
    table = np.stack(columns, axis=1)[answered]
    gradient[answered] = period_gradients(formulas, table[:, :-1], table[:, -1], spans[answered], tuple(rows.values()))
    gradient[answered] *= np.where(np.isnan(spans[answered, :1]), 1.0, halves)
    for k in answered[np.isnan(gradient[answered]).any(axis=1)].tolist():
        *p, lam0, v0, direction = (column[k].item() for column in columns)
        motion = solve(LaunchRequest(lam0, v0, int(direction), None, None, launches.contact), tuple(p))
        with suppress(SolutionError):
            gradient[k] = list(motion.gradient(quantity, tuple(rows)).values())
    found.gradient = gradient.reshape(*found.status.shape, len(rows))
    return found
