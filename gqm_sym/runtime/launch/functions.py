"""The compiled functions of one motion, bound to what they are given."""

from typing import NamedTuple

import numpy as np

from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.interface import Addresses
from gqm_sym.runtime.multiprecision.exact_problem import NOWHERE, ExactProblem


class BoundFunctions(NamedTuple):
    """One motion's compiled functions and what they are given.

    Attributes
    ----------
    addresses : Addresses
        Of the compiled functions.
    p : array
        The run-time parameters, and behind them the curve's chart where it has one.
    exact : ExactProblem or None
        The same problem exactly; None where the curve is known by doubles only.
    breaks, corners : arrays
        Places at which the curve is not smooth, and those where its tangent jumps; repeated with the period.
    period : float
        Of a closed curve, else 0.
    """

    addresses: Addresses
    p: Array
    exact: ExactProblem | None = None
    breaks: Array = NOWHERE
    corners: Array = NOWHERE
    period: float = 0.0

    def between(self, places: Array, a: float, b: float) -> Array:
        """Those of some places that lie strictly between two, round a closed curve as often as it takes."""
        low, high = min(a, b), max(a, b)
        if self.period and places.size:
            laps = np.arange(np.floor((low - places[-1]) / self.period), np.ceil((high - places[0]) / self.period) + 1)
            places = (places[None, :] + laps[:, None] * self.period).ravel()
        return places[(places > low) & (places < high)]
