"""Gradients of periods, turning points, extremes and times at places of many launches, by compiled loops in threads."""

import numpy as np

from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.gradients.lanes.arrivals.times import arrival_gradients
from gqm_sym.runtime.gradients.lanes.extremes import extreme_gradients
from gqm_sym.runtime.gradients.lanes.launches import Launches
from gqm_sym.runtime.gradients.lanes.periods import period_gradients, turn_gradients
from gqm_sym.runtime.launch.formulas import Formulas
from gqm_sym.runtime.launch.kinds import EXTREMES

# Quantities whose gradients compiled code computes: periods, each with its number of half periods, and others.
PERIODS = {"half_period": 1.0, "period": 2.0}
COMPILED = (*PERIODS, "turning_points", "time_at", *EXTREMES)


def launch_gradients(
    formulas: Formulas, quantity: str, launches: Launches, values: Array, rows: tuple[int, ...], places: Array
) -> Array:
    """Return the derivatives of a quantity: a row for each launch, NaN where double-double arithmetic does not suffice.

    Parameters
    ----------
    formulas : Formulas
        The model of a generated module.
    quantity : str
        One of COMPILED.
    launches : Launches
        The launches.
    values : array
        The quantity of each launch.
    rows : tuple of int
        The variables of differentiation.
    places : array
        The places for "time_at": a vector, or one number that all launches have in common.

    Returns
    -------
    array
        Of shape (m, k), or (m, 2, k) for turning points.
    """
    if quantity in PERIODS:
        slopes = period_gradients(formulas, launches, values.reshape(-1) / PERIODS[quantity], rows)
        if PERIODS[quantity] != 1.0:
            slopes *= np.where(launches.circulates, 1.0, PERIODS[quantity])[:, np.newaxis]
        return slopes
    if quantity == "turning_points":
        return turn_gradients(formulas, launches, rows)
    if quantity == "time_at":
        return arrival_gradients(formulas, launches, places, rows)
    return extreme_gradients(formulas, quantity, launches, values, rows)
