"""One launch of one module, and how far a motion reaches from it."""

from dataclasses import dataclass
from typing import Any

from gqm_sym.runtime.formulas import Formulas, Launch
from gqm_sym.runtime.numbers import Number
from gqm_sym.runtime.stretch import Functions


@dataclass(frozen=True, slots=True)
class Reach:
    """How far the motion goes one way, and what is there.

    ``what`` is "turn", "equilibrium", "domain-end", "cusp", "closed", or "open" (towards infinity or a pole).
    """

    what: str
    place: float
    exact: Any = None


@dataclass(slots=True, kw_only=True)
class Problem:
    """One launch of one module, in doubles and exactly."""

    formulas: Formulas
    launch: Launch
    p: tuple[Number, ...]
    functions: Functions
    low: float
    high: float
    period: float

    @property
    def lam0(self) -> float:
        """The launch place, as the nearest double."""
        return self.launch.lam0.value

    @property
    def w0(self) -> float:
        """V**2 at launch."""
        return self.launch.v0.value**2
