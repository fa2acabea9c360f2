"""A law of motion with friction in space along a short part of a curve, its rows, and its solution in many digits."""

from typing import Any

import numpy as np
from mpmath import mp, mpf

from gqm_sym.runtime.legs.panels import equation as rows
from gqm_sym.runtime.legs.panels.polynomials import ENDS_BY_NODE, WIDE


def law(place: Any, lib: Any) -> dict[str, Any]:
    """Return P, Q and f of a law, and the coefficients of the square of the contact force."""
    return {
        "PLAIN_P": 9.75 * lib.sin(0.25 + place),
        "PLAIN_Q": 0.125 * lib.cos(place),
        "RUBBING": 0.125 + 0.0625 * place,
        "AT_REST": 80 + 24 * lib.sin(place),
        "MIXED": 11 * lib.cos(2 * place),
        "TURNING": 0.5 + 0.5 * place,
        "DS": 1 + 0.25 * place,
    }


def panel(width: float, direction: int, number: int = 0) -> np.ndarray:
    """Return the rows of the panel with this number ahead of the place 0."""
    work = np.zeros(30 * WIDE)
    for name, values in {"N0": 1.0, **law(direction * width * (number + ENDS_BY_NODE), np)}.items():
        at = getattr(rows, name)
        # The factor of friction has the sign of the direction.
        work[at : at + WIDE] = values * (direction if name == "RUBBING" else 1)
    return work


def solution(distance: float, direction: int, v2: float, digits: int) -> Any:
    """Return V**2 at a distance from the place 0, given V**2 there, and the time."""

    def slopes(d: Any, y: Any) -> Any:
        at = law(direction * d, mp)
        load = mp.sqrt(at["AT_REST"] + y[0] * (at["MIXED"] + y[0] * at["TURNING"]))
        slope = direction * (at["PLAIN_P"] - at["PLAIN_Q"] * y[0]) - at["RUBBING"] * load
        return [slope, at["DS"] / mp.sqrt(y[0])]

    with mp.workdps(digits):
        return mp.odefun(slopes, 0, [mpf(v2), mpf(0)])(mpf(distance))
