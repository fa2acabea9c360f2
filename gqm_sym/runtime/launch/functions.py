"""The compiled functions of one module, bound to the values of its parameters."""

from typing import NamedTuple

import numpy as np

from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.interface import Addresses, Dissipation
from gqm_sym.runtime.multiprecision.exact_problem import NOWHERE, ExactProblem


class BoundFunctions(NamedTuple):
    """The compiled functions of one module with the values that they take.

    Attributes
    ----------
    addresses : Addresses
        The addresses of the compiled functions.
    p : array
        The values of the run-time parameters, followed by the curve's chart if it has one.
    exact : ExactProblem or None
        The same problem in extended precision; None if the curve is known in doubles only.
    breaks, corners : arrays
        The places at which the curve is not smooth, and those at which its tangent jumps, within one period.
    period : float
        The period of a closed curve in units of its parameter, 0 otherwise.
    bends : array
        The sign of the tangent's turn at each corner: 1 where the curve bends to the left.
    dissipation : Dissipation or None
        The data of a dissipative model for compiled code; None for a conservative one.
    chart, joints : arrays
        The chart, and the places at which its pieces meet, within one period; empty for a curve with formulas.
    mass : float
        The mass of the body in kg.
    """

    addresses: Addresses
    p: Array
    exact: ExactProblem | None = None
    breaks: Array = NOWHERE
    corners: Array = NOWHERE
    period: float = 0.0
    bends: Array = NOWHERE
    dissipation: Dissipation | None = None
    chart: Array = NOWHERE
    joints: Array = NOWHERE
    mass: float = 1.0

    def liftoff_corners(self, only_sign: int) -> Array:
        """Return the corners at which a moving body leaves a track that can push with one sign of N only (0: with
        both).
        """
        return self.corners[self.bends * only_sign < 0.0] if only_sign and self.corners.size else NOWHERE

    def between(self, places: Array, a: float, b: float) -> Array:
        """Return the places that lie strictly between a and b; on a closed curve they are repeated with the period."""
        if not places.size:
            return places
        low, high = min(a, b), max(a, b)
        if self.period:
            laps = np.arange(np.floor((low - places[-1]) / self.period), np.ceil((high - places[0]) / self.period) + 1)
            places = (places[None, :] + laps[:, None] * self.period).ravel()
        return places[(places > low) & (places < high)]
