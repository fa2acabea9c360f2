"""A periodic orbit with its derivatives: those of turning points, duration and action, and of the path and the time
along the orbit.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

from gqm_sym.errors import SolutionError
from gqm_sym.runtime.charts.train import TrackOfTrain
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.gradients.path import PathRows
from gqm_sym.runtime.gradients.programs import AnySource
from gqm_sym.runtime.interface import ExactPotential
from gqm_sym.runtime.launch.formulas import Formulas


@contextmanager
def requested_quantity(name: str) -> Iterator[None]:
    """Name the requested quantity in errors about gradients."""
    try:
        yield
    except SolutionError as error:
        raise SolutionError(str(error).replace("gradients:", f"{name}:", 1)) from None


def without_formulas() -> SolutionError:
    """Return the error for curves that have no gradients."""
    return SolutionError(
        "gradients: there are none along tracks of rolling bodies with a radius, of trains with losses, and along "
        "curves that are known in doubles only; declare the curve by formulas"
    )


# What depends on the derivatives of the contact force.
OF_FORCE = ("sensitivity", "normal_force_max", "normal_force_min")


def check_force(formulas: Formulas, quantity: str) -> None:
    """Refuse derivatives of a contact force that has neither a sign nor a formula.

    Raises
    ------
    SolutionError
        If the quantity depends on the contact force, and that has neither a sign nor a formula.
    """
    if quantity not in OF_FORCE:
        return
    exact = formulas.exact
    if isinstance(formulas.chart, TrackOfTrain):
        exact = formulas.chart.body
    has_force = formulas.signed or isinstance(exact, ExactPotential)
    has_force = has_force or getattr(exact, "load_along_curvature", None) is not None
    if formulas.directed:
        aside = "coriolis" if isinstance(exact, ExactPotential) else "coriolis_loads"
        has_force = getattr(exact, aside, None) is not None
    if not has_force:
        if not formulas.directed:
            raise without_formulas()
        raise SolutionError(
            f"gradients: there are none of {quantity}, because the contact force has no known derivatives on a space "
            "curve in a rotating frame"
        )


def pairs(*numbers: tuple[float, float, float]) -> Array:
    """Return numbers, each given as two doubles and a bound on the error, as inputs of a program."""
    return np.ascontiguousarray(np.array(numbers, dtype=float).reshape(-1, 3).T)


# The type of a function that returns, for shares of the phase, the values of functions and their integrals from the
# beginning of the phase: a row for each function.
SeriesOf = Callable[[Array], Array]


class OrbitDerivatives(ABC):
    """A libration or circulation with derivatives with respect to all variables.

    The variables are the run-time parameters, lam0, v0, and the energy per unit mass over 1 + beta (`programs`).

    Attributes
    ----------
    direction : int
        0 for a libration, else the sign of ds/dt.
    source : AnySource
        What programs are recorded from.
    by_arc_length : bool
        Whether the parameter of the curve is its arc length. In that case run-time parameters may move the curve's
        points, and derivatives at the points of the curve differ from those at given arc lengths.
    """

    direction: int
    source: AnySource
    by_arc_length = False

    @property
    @abstractmethod
    def ends(self) -> Array:
        """The derivatives of the lower and of the upper turning point of a libration, as columns."""

    @property
    @abstractmethod
    def turning_points(self) -> tuple[float, float]:
        """The lower and the upper turning point of a libration."""

    @property
    @abstractmethod
    def width(self) -> float:
        """The width of a libration, or the length of a lap with its sign, in units of the curve parameter."""

    @property
    @abstractmethod
    def series(self) -> tuple[SeriesOf, Array]:
        """The series of the time per phase and its derivatives and then of those of arc length per share; and the
        derivatives of the lap.
        """

    @abstractmethod
    def at_places(self, lam: Array) -> PathRows:
        """Return `path_rows` at places."""

    @abstractmethod
    def extreme_rows(self, place: Array, *, of_speed: bool, direction: int = 1) -> Array:
        """Return half of V**2, or the contact force, at places, with two derivatives with respect to the place and
        those with respect to all variables; ``direction`` is the sign of ds/dt.
        """

    @abstractmethod
    def _integrals(self, first: int, count: int) -> Array:
        """Return the integrals of results over a half period, or over a lap."""

    @property
    def moved_ends(self) -> Array:
        """The derivatives of the turning points of a libration, relative to the points of the curve."""
        return self.ends

    @property
    def launch_changes(self) -> Array:
        """The change of the launch place relative to the points of the curve."""
        moves = np.zeros(self.source.variables)
        moves[self.source.parameters] = 1.0
        return moves

    @property
    def duration_gradient(self) -> Array:
        """The derivatives of the half period of a libration, or of the time of a lap."""
        return self._integrals(1, self.source.variables)

    @abstractmethod
    def second_durations(self, rows: tuple[int, ...]) -> Array:
        """Return the second derivatives of the half period of a libration, or of the time of a lap.

        Parameters
        ----------
        rows : tuple of int
            The variables; there is a derivative for each of their pairs, in the order of `second_programs.pairs_of`.
        """

    @property
    def action(self) -> float:
        """The integral of V**2 (1 + beta) dt over a period."""
        return float(self._period_share * self._integrals(1 + self.source.variables, 1)[0])

    @property
    def action_gradient(self) -> Array:
        """The derivatives of the action."""
        n = self.source.variables
        return self._period_share * self._integrals(2 + n, n)

    @property
    def period_gradient(self) -> Array:
        """The derivatives of the period."""
        return self._period_share * self.duration_gradient

    @property
    def _period_share(self) -> float:
        """The number of half periods, or of laps, in a period."""
        return 1.0 if self.direction else 2.0

    def relative_change(self, moved: Array, lam: Array) -> Array:
        """Convert the change of a place's parameter to the change of the place relative to the points of the curve."""
        return moved
