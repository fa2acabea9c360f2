"""Between places on a stretch and its anomaly (`integrands`)."""

from math import atan2, inf, log, pi, sqrt

import numpy as np

from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.quadrature.integrands import FROM_TURN, REGULAR, TO_EQUILIBRIUM, TURN_TURN


def phase_angle_of(kind: int, slack: float, ahead: float, behind: float, whole: float) -> float:
    """The anomaly of a place by its distances from both ends of a stretch, neither of them negative."""
    if kind == TURN_TURN:
        return 2.0 * atan2(sqrt(ahead), sqrt(behind))
    if kind == TO_EQUILIBRIUM:
        return -log(behind / whole) if behind > 0.0 else inf
    share = ahead / whole if ahead <= behind else 1.0 - behind / whole
    if kind == REGULAR or share <= 0.0:
        return share
    most = share * (1.0 + 2.0 * slack)
    return most / (slack + sqrt(slack**2 + most))


def places_at(
    kind: int, slack: float, start: tuple[float, float], stop: tuple[float, float], width: float, phi: Array
) -> Array:
    """The curve's parameter at anomalies, from the nearer end; the ends as two doubles each."""
    (a, a_low), (b, b_low) = start, stop
    if kind == TURN_TURN:
        ahead, behind = width * np.sin(0.5 * phi) ** 2, width * np.cos(0.5 * phi) ** 2
        return np.where(phi < 0.5 * pi, a + (a_low + ahead), b - (behind - b_low))
    if kind == TO_EQUILIBRIUM:
        away: Array = b - width * np.exp(-phi)
        return away
    share = phi * (phi + 2.0 * slack) / (1.0 + 2.0 * slack) if kind == FROM_TURN else phi
    return np.where(share <= 0.5, a + (a_low + width * share), b - (width * (1.0 - share) - b_low))
