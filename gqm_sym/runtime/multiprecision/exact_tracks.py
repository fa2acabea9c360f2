"""A curve with its forces in extended precision: the effective potential and ds/dlam at a place."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from gqm_sym.literals.numbers import Number
from gqm_sym.runtime.interface import ExactFormulas


class Track(Protocol):
    """A curve with its forces, at one precision and for one launch."""

    @property
    def lam0(self) -> Any:
        """Return the launch place."""

    def place(self, lam: float) -> Any:
        """Return the place that a double stands for."""

    def effective_potential(self, lam: Any) -> Any:
        """Return U = Phi/(1 + beta) per unit mass, for which V**2 + 2*U is constant."""

    def effective_potential_slope(self, lam: Any) -> Any:
        """Return the derivative of U with respect to lam."""

    def ds(self, lam: Any) -> Any:
        """Return ds/dlam."""

    def period(self) -> Any:
        """Return the period of lam on a closed curve."""

    def joints(self, low: Any, high: Any) -> Sequence[Any] | None:
        """Return the places between two others at which the curve is not analytic; None if there are none anywhere."""


TrackMaker = Callable[[Any, tuple[Any, ...]], Track]
"""A function of an mpmath context and of the run-time parameters in it."""


@dataclass(frozen=True, slots=True)
class FormulaTrack:
    """A curve that has formulas."""

    formulas: ExactFormulas
    domain: Callable[..., Any]
    launch: Number
    context: Any
    values: tuple[Any, ...]

    @property
    def lam0(self) -> Any:
        """Return the launch place."""
        return self.launch.at(self.context)

    def place(self, lam: float) -> Any:
        """Return the exact value of a double."""
        return self.context.mpf(lam)

    def effective_potential(self, lam: Any) -> Any:
        """Return U = Phi/(1 + beta) per unit mass, for which V**2 + 2*U is constant."""
        return self.formulas.effective_potential(self.context, lam, self.values)

    def effective_potential_slope(self, lam: Any) -> Any:
        """Return the derivative of U with respect to lam."""
        return self.formulas.effective_potential_slope(self.context, lam, self.values)

    def ds(self, lam: Any) -> Any:
        """Return ds/dlam."""
        return self.formulas.ds(self.context, lam, self.values)

    def period(self) -> Any:
        """Return the period of lam on a closed curve."""
        return self.domain(self.context, self.values)[2]

    def joints(self, low: Any, high: Any) -> None:
        """Return None, because formulas are analytic."""
        return
