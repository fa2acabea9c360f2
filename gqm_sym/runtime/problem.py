"""One launch of one module, and how far a motion reaches from it."""

from dataclasses import dataclass
from typing import Any

from gqm_sym.runtime.exact import ExactProblem
from gqm_sym.runtime.formulas import Domain, Formulas, Given, Launch
from gqm_sym.runtime.functions import Functions
from gqm_sym.runtime.rounded import RoundedProblem


@dataclass(frozen=True, slots=True)
class Reach:
    """How far the motion goes one way, and what is there.

    ``what`` is "turn", "equilibrium", "domain-end", "singular-point", "cusp", "closed", or "open" (towards infinity or
    a pole). ``level`` marks a cusp at which V**2 vanishes as well: it is reached in finite time all the same.
    ``offset`` is a turning point's from the launch, which keeps its digits where both are one place in doubles.
    """

    what: str
    place: float
    exact: Any = None
    level: bool = False
    offset: float = 0.0


@dataclass(slots=True)
class Problem:
    """One launch of one module, in doubles and exactly."""

    formulas: Formulas
    launch: Launch
    p: Given
    functions: Functions
    domain: Domain

    @property
    def low(self) -> float:
        """The lower end of the parameter's range."""
        return self.domain.low

    @property
    def high(self) -> float:
        """The upper end of the parameter's range."""
        return self.domain.high

    @property
    def period(self) -> float:
        """The parameter's period; 0 where there is none."""
        return self.domain.period

    @property
    def exact(self) -> ExactProblem:
        """The exact problem, where there is one."""
        exact = self.functions.exact
        assert exact is not None
        return exact

    @property
    def arc_origin(self) -> float:
        """Arc length at launch: 0, or on a charted curve its distance from the start point."""
        return self.lam0 if self.formulas.chart is not None else 0.0

    @property
    def decider(self) -> ExactProblem | RoundedProblem:
        """Who answers what doubles cannot decide."""
        exact = self.functions.exact
        return RoundedProblem(self.functions, self.lam0, self.w0) if exact is None else exact

    @property
    def lam0(self) -> float:
        """The launch place, as the nearest double."""
        return self.launch.lam0.value

    @property
    def w0(self) -> float:
        """V**2 at launch."""
        return self.launch.v0.value**2
