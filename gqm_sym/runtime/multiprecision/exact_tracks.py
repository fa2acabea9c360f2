"""The curve and the effective potential along it in extended precision: what the exact problem asks of them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from gqm_sym.literals.numbers import Number
from gqm_sym.runtime.interface import ExactFormulas


class Track(Protocol):
    """A curve with its forces, at one precision and for one launch."""

    @property
    def lam0(self) -> Any:
        """The launch place."""

    def place(self, lam: float) -> Any:
        """The place that a double stands for."""

    def effective_potential(self, lam: Any) -> Any:
        """U, so that V**2 + 2*U is constant."""

    def effective_potential_slope(self, lam: Any) -> Any:
        """Its derivative."""

    def ds(self, lam: Any) -> Any:
        """ds/dlam."""

    def period(self) -> Any:
        """The period of the places of a closed curve."""

    def elsewhere(self) -> Any:
        """A place away from the launch: the effective potential there tells its size."""

    def joints(self, low: Any, high: Any) -> Sequence[Any] | None:
        """Places between two, in their order, at which the curve is not analytic; None where there can be none."""


TrackMaker = Callable[[Any, tuple[Any, ...]], Track]
"""From an mpmath context and the run-time parameters in it."""


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
        """The launch place."""
        return self.launch.at(self.context)

    def place(self, lam: float) -> Any:
        """The place that a double stands for: just that."""
        return self.context.mpf(lam)

    def effective_potential(self, lam: Any) -> Any:
        """U, so that V**2 + 2*U is constant."""
        return self.formulas.effective_potential(self.context, lam, self.values)

    def effective_potential_slope(self, lam: Any) -> Any:
        """Its derivative."""
        return self.formulas.effective_potential_slope(self.context, lam, self.values)

    def ds(self, lam: Any) -> Any:
        """ds/dlam."""
        return self.formulas.ds(self.context, lam, self.values)

    def period(self) -> Any:
        """The period of the parameter of a closed curve."""
        return self.domain(self.context, self.values)[2]

    def elsewhere(self) -> Any:
        """One unit of the parameter away."""
        return self.lam0 + 1

    def joints(self, low: Any, high: Any) -> None:
        """Formulas are analytic."""
        return
