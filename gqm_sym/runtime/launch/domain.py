"""The range of the curve parameter."""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

from numba import types


class DomainNumbers(NamedTuple):
    """The range of the curve parameter λ in doubles, as compiled code takes it.

    Attributes
    ----------
    low, high : float
        The ends of the range, infinite where it is open.
    period : float
        The period of a closed curve, 0 otherwise.
    axis : float
        One λ about which V**2 and ds/dλ are even, if V**2 is also proved monotone between neighbouring axes; NaN
        otherwise.
    axis_step : float
        The distance from one axis to the next, 0 if there is only one.
    """

    low: float
    high: float
    period: float
    axis: float = math.nan
    axis_step: float = 0.0


# The same as the type of an argument of compiled functions.
DOMAIN: Any = types.NamedUniTuple(types.float64, len(DomainNumbers._fields), DomainNumbers)


@dataclass(frozen=True, slots=True)
class Domain:
    """The range of the curve parameter λ for one set of parameter values.

    Attributes
    ----------
    numbers : DomainNumbers
        The range, the period and the axes of symmetry.
    ends : (str, str)
        What lies at the lower and at the upper end: "domain-end", "cusp" or "singular-point".
    """

    numbers: DomainNumbers
    ends: tuple[str, str] = ("domain-end", "domain-end")

    @property
    def low(self) -> float:
        """The lower end of the range."""
        return self.numbers.low

    @property
    def high(self) -> float:
        """The upper end of the range."""
        return self.numbers.high

    @property
    def period(self) -> float:
        """The period of a closed curve, 0 otherwise."""
        return self.numbers.period
