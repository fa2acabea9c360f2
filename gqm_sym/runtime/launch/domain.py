"""The range of the curve parameter."""

import math
from typing import NamedTuple


class Domain(NamedTuple):
    """The range of the curve parameter λ for one set of parameter values.

    Attributes
    ----------
    low, high : float
        The ends of the range, infinite where it is open.
    period : float
        The period of a closed curve, 0 otherwise.
    ends : (str, str)
        What lies at each end: "domain-end", "cusp", "singular-point".
    axis : float
        One λ about which V**2 and ds/dλ are even, if V**2 is also proved monotone between neighbouring axes; NaN
        otherwise.
    axis_step : float
        The distance from one axis to the next, 0 if there is only one.
    """

    low: float
    high: float
    period: float
    ends: tuple[str, str] = ("domain-end", "domain-end")
    axis: float = math.nan
    axis_step: float = 0.0
