"""A periodic orbit with its derivatives: turning points, duration, action, and how they come about along the orbit."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from gqm_sym.errors import SolutionError
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.double_double.arithmetic import UNIT
from gqm_sym.runtime.double_double.nodes import LEVELS, panel_rule, trapezoidal_nodes
from gqm_sym.runtime.double_double.orbit_time import Orbit
from gqm_sym.runtime.gradients.evaluation import (
    LOST_DIGITS,
    MEAN,
    NOT_SMOOTH,
    fill_means,
    fill_panel_means,
    fill_values,
)
from gqm_sym.runtime.gradients.multiprecision import UNDECIDED, MultiprecisionOrbit
from gqm_sym.runtime.gradients.programs import (
    AnySource,
    Program,
    Source,
    circulation_program,
    circulation_seconds,
    extreme_program,
    libration_program,
    libration_seconds,
    path_program,
    turning_point_program,
    turning_point_seconds,
)
from gqm_sym.runtime.gradients.series import Series
from gqm_sym.runtime.interface import ExactFormulas, ExactLaw
from gqm_sym.runtime.launch.formulas import Formulas
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.quadrature.trapezoid import CIRCULATION, LIBRATION

# Pi as two doubles.
PI, PI_LOW = np.pi, 1.2246467991473532e-16


@contextmanager
def asked_for(name: str) -> Iterator[None]:
    """Have errors that speak of gradients name what was asked for."""
    try:
        yield
    except SolutionError as error:
        raise SolutionError(str(error).replace("gradients:", f"{name}:", 1)) from None


def without_formulas() -> SolutionError:
    """What is raised for curves that have no gradients."""
    return SolutionError(
        "gradients: there are none along curves without formulas if energy is lost, or if the curve is known in "
        "doubles only; declare the curve by formulas"
    )


def check_force(formulas: Formulas, quantity: str) -> None:
    """Refuse derivatives that hold a contact force without a sign.

    Raises
    ------
    SolutionError
        Unless the quantity has nothing to do with the contact force, or that has a formula.
    """
    has_force = formulas.signed or getattr(formulas.exact, "load_along_curvature", None) is not None
    if not has_force and quantity in ("sensitivity", "normal_force_max", "normal_force_min"):
        raise SolutionError(
            f"gradients: there are none of {quantity} along points in space, because it contains the contact force"
        )


def source_of(formulas: Formulas) -> Source:
    """What the programs of a module are recorded from.

    Raises
    ------
    SolutionError
        If its curve has no formulas.
    """
    if not isinstance(formulas.exact, ExactFormulas) or formulas.domain_of is None:
        raise without_formulas()
    names = list(formulas.parameters)
    return Source(formulas.exact, formulas.domain_of, formulas.inertia, len(names), names.index("m"))


def pairs(*numbers: tuple[float, float, float]) -> Array:
    """Numbers, as two doubles each with a bound on the error, as inputs of a program."""
    return np.ascontiguousarray(np.array(numbers, dtype=float).reshape(-1, 3).T)


def variables_of(problem: Problem) -> Array:
    """The variables of a launch as inputs of programs; the change of the energy is zero."""
    numbers = (*problem.p, problem.launch.lam0, problem.launch.v0)
    return pairs(*((n.value, n.low, 0.25 * UNIT * abs(n.value) if n.low else 0.0) for n in numbers), (0.0, 0.0, 0.0))


def values(program: Program, inputs: Array, high: Array, low: Array | None = None, *others: Array) -> Array:
    """The results of a program at places, one row for each; ``others`` are coordinates after the first, as doubles."""
    zero = np.zeros_like(high)
    places = np.array([high, zero if low is None else low, *(row for other in others for row in (other, zero))])
    found = np.empty((program.outputs.size, 3, high.size))
    fill_values(program.operands, program.work, inputs, places, found)
    return found


class PathRows(NamedTuple):
    """What `path_program` gives at n places, each an (m + 2, n) array: the values, and the derivatives by m parameters
    and by the place.

    Attributes
    ----------
    x, z, ds, curvature, load : array
        x, z, ds/dlam, m*kappa and m*n0.
    potential : array or None
        U; None of a motion with losses.
    y, product : array or None
        y of a space curve, and m**2 times ``load_along_curvature`` of one in no vertical plane; None of others.
    """

    x: Array
    z: Array
    ds: Array
    curvature: Array
    load: Array
    potential: Array | None = None
    y: Array | None = None
    product: Array | None = None

    def force_changes(self, v: Array, faster: Array, changed: Callable[[Array], Array]) -> Array:
        """How the contact force changes where the velocity changes by ``faster``; ``changed`` gives how rows do."""
        curvature, load = changed(self.curvature), changed(self.load)
        if self.product is None:
            force: Array = load + v**2 * curvature + 2.0 * v * self.curvature[0] * faster
            return force
        w, kappa, product = v**2, self.curvature[0], self.product[0]
        half_square = kappa * w * w * curvature + w * changed(self.product) + self.load[0] * load
        half_square += 2.0 * v * (kappa * kappa * w + product) * faster
        with np.errstate(divide="ignore", invalid="ignore"):  # |N| has a kink where it vanishes
            force = half_square / np.sqrt((kappa * w) ** 2 + 2.0 * product * w + self.load[0] ** 2)
        return force


def path_rows(
    formulas: ExactFormulas | ExactLaw, parameters: Array, mass: int, high: Array, low: Array | None = None
) -> PathRows:
    """The path at places, with derivatives."""
    count = parameters.shape[1]
    found = values(path_program(formulas, count, mass), parameters, high, low)[:, 0]
    rows: list[Any] = list(found.reshape(len(found) // (count + 2), count + 2, high.size))
    if isinstance(formulas, ExactLaw):
        rows.insert(5, None)  # no potential
    return PathRows(*rows)


# Values of functions at shares of the phase, and their integrals from the beginning of it: a row for each function.
SeriesOf = Callable[[Array], tuple[Array, Array]]


class OrbitDerivatives(ABC):
    """A libration or circulation with derivatives by all variables.

    The variables are the run-time parameters, lam0, v0, and the energy per unit mass over 1 + beta (`programs`).

    Attributes
    ----------
    direction : int
        0 for a libration, else the sign of ds/dt.
    source : AnySource
        What programs are recorded from.
    by_arc_length : bool
        Whether the parameter of the curve is its arc length. Then parameters may move the curve's points, and
        derivatives at the points of the curve are not those at given arc lengths.
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
    def series(self) -> tuple[SeriesOf, SeriesOf, Array]:
        """The time per phase with its derivatives, the derivatives of arc length per share, and those of the lap."""

    @abstractmethod
    def at_places(self, lam: Array) -> PathRows:
        """`path_rows` at places."""

    @abstractmethod
    def extreme_rows(self, place: Array, *, of_speed: bool) -> Array:
        """Half of V**2, or the contact force, at places: with two derivatives by the place, and those by variables."""

    @abstractmethod
    def _integrals(self, first: int, count: int) -> Array:
        """The integrals of results over a half period, or over a lap."""

    @property
    def moved_ends(self) -> Array:
        """The derivatives of the turning points of a libration at the points of the curve, which do not move."""
        return self.ends

    @property
    def launch_moves(self) -> Array:
        """How the place of the launch changes, at the points of the curve, which do not move."""
        moves = np.zeros(self.source.variables)
        moves[self.source.parameters] = 1.0
        return moves

    @property
    def duration_gradient(self) -> Array:
        """The derivatives of the half period of a libration, or of the time of a lap."""
        return self._integrals(1, self.source.variables)

    def second_durations(self, rows: tuple[int, ...]) -> Array:
        """The second derivatives of the half period of a libration, or of the time of a lap.

        Parameters
        ----------
        rows : tuple of int
            The variables, of which each pair has one, as `programs.pairs_of` them.
        """
        raise SolutionError("gradient: second derivatives along curves without formulas are not there yet")

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
        """How many of what is integrated over make a period."""
        return 1.0 if self.direction else 2.0

    def without_shift(self, moved: Array, lam: Array) -> Array:
        """How a place changes among the points of the curve, which do not move, from how its parameter changes."""
        return moved


class FormulaOrbitDerivatives(OrbitDerivatives):
    """A libration or circulation along a curve with formulas, with derivatives by all variables.

    The variables are the run-time parameters, lam0, v0, and the energy per unit mass over 1 + beta (`programs`).

    Parameters
    ----------
    problem : Problem
        The launch with its module.
    orbit : Orbit or None
        Duration and turning points in double-double arithmetic, if that suffices.
    direction : int
        0 for a libration, else the sign of ds/dt.
    offsets : (float, float)
        The distances of both turning points from the launch, for a libration.
    edges : array
        Phase angles between which the speed changes smoothly, from the first to the last.
    """

    source: Source

    def __init__(
        self, problem: Problem, orbit: Orbit | None, direction: int, offsets: tuple[float, float], edges: Array
    ) -> None:
        self.direction, self._edges = direction, edges
        self.source = source_of(problem.formulas)
        self._given = (*problem.p, problem.launch.lam0, problem.launch.v0)
        self.variables = variables_of(problem)
        self.parameters = np.ascontiguousarray(self.variables[:, : self.source.parameters])
        self._orbit, self._offsets = orbit, offsets

    @cached_property
    def _multiprecision(self) -> MultiprecisionOrbit:
        return self._in_multiprecision(self._program, turning_point_program(self.source))

    def _in_multiprecision(self, program: Program, turns: Program) -> MultiprecisionOrbit:
        return MultiprecisionOrbit(self.source, program, turns, self._given, self.direction, self._offsets)

    @cached_property
    def _end_rows(self) -> Array:
        """The derivatives of both turning points in double-double arithmetic."""
        return self._ends_by(turning_point_program(self.source))

    def _ends_by(self, turns: Program) -> Array:
        """What a program gives at both turning points, in double-double arithmetic, but for its first result."""
        assert self._orbit is not None
        high, low = np.array([self._orbit.low[:2], self._orbit.high[:2]]).T
        return values(turns, self.variables, high.copy(), low.copy())[1:]

    @property
    def ends(self) -> Array:
        """The derivatives of the lower and of the upper turning point of a libration, as columns."""
        return self._multiprecision.ends[1:] if self._orbit is None else self._end_rows[:, 0]

    @property
    def turning_points(self) -> tuple[float, float]:
        """The lower and the upper turning point of a libration."""
        if self._orbit is not None:
            return self._orbit.low.high, self._orbit.high.high
        low, high = self._multiprecision.ends[0].tolist()
        return low, high

    @property
    def _program(self) -> Program:
        """What is integrated along the orbit."""
        return circulation_program(self.source, self.direction) if self.direction else libration_program(self.source)

    @cached_property
    def _rule(self) -> tuple[Array, Array]:
        """The inputs of the orbit's program in double-double arithmetic, and the table of nodes."""
        return self._rule_with(np.empty(0) if self.direction else self._end_rows)

    def _rule_with(self, ends: Array) -> tuple[Array, Array]:
        """The inputs of a program and the table of nodes, with what it takes of the turning points of a libration."""
        if self.direction:
            inputs = np.hstack([self.variables, self.variables[:, [self.source.parameters]]])
            return np.ascontiguousarray(inputs), trapezoidal_nodes(CIRCULATION)
        assert self._orbit is not None
        places = np.array([self._orbit.low, self._orbit.high]).T
        inputs = np.hstack([self.variables, places, ends[:, :, 0].T, ends[:, :, 1].T])
        return np.ascontiguousarray(inputs), trapezoidal_nodes(LIBRATION)

    @cached_property
    def _means(self) -> tuple[Array, int, bool]:
        """The means of the orbit's program, the number of nodes, and whether double-double arithmetic found them.

        The number is 0 if they are those of panels.
        """
        found = None if self._orbit is None else self._means_of(self._program, *self._rule)
        return found or (*self._multiprecision.means[:2], False)

    def _means_of(self, program: Program, inputs: Array, nodes: Array) -> tuple[Array, int, bool] | None:
        """`_means` of any program in double-double arithmetic; None where digits are lost."""
        found = np.zeros((program.outputs.size, MEAN))
        n = fill_means(program.operands, program.work, inputs, nodes, found)
        if n == NOT_SMOOTH:
            kind = CIRCULATION if self.direction else LIBRATION
            n = fill_panel_means(program.operands, program.work, inputs, kind, self._edges, panel_rule(), found)
            if n > 0:
                return found, 0, True
            raise SolutionError(UNDECIDED)
        return None if n == LOST_DIGITS else (found, n, True)

    def second_durations(self, rows: tuple[int, ...]) -> Array:
        """As `OrbitDerivatives.second_durations`."""
        turns = turning_point_seconds(self.source, rows)
        if self.direction:
            program = circulation_seconds(self.source, self.direction, rows)
        else:
            program = libration_seconds(self.source, rows)
        found = None
        if self._orbit is not None:
            found = self._means_of(program, *self._rule_with(np.empty(0) if self.direction else self._ends_by(turns)))
        return self._over_phase(found[0] if found else self._in_multiprecision(program, turns).means[0])

    def _integrals(self, first: int, count: int) -> Array:
        """The integrals of results over a half period, or over a lap."""
        return self._over_phase(self._means[0][first : first + count])

    def _over_phase(self, found: Array) -> Array:
        """The integrals over a half period, or over a lap, from means."""
        is_zero = np.abs(found[:, 0]) <= found[:, 2]  # as far as double-double arithmetic can tell
        high, low = np.where(is_zero, 0.0, found[:, :2].T)
        integrals: Array = high + low if self.direction else PI * high + (PI * low + PI_LOW * high)
        return integrals

    @cached_property
    def samples(self) -> Array:
        """The results of the orbit's program at equal steps of the phase angle, over a whole turn of it.

        They are the midpoints of N intervals of [0, 2 pi], or of the share of a lap. In the second half of a libration
        the values return.
        """
        # The means at n nodes are exact as soon as terms of order 2n vanish: twice the nodes show these terms.
        means, count, is_double_double = self._means
        if not count:
            raise SolutionError(UNDECIDED)
        n = min(2 * count, LEVELS[-1] // 2)
        if is_double_double:
            inputs, nodes = self._rule
            found = values(self._program, inputs, *nodes[:2, n : 2 * n].copy())[:, 0]
        else:
            found = self._multiprecision.samples(n)
        found[means[:, 3] <= means[:, 2]] = 0.0  # they are rounding
        return found if self.direction else np.hstack([found, found[:, ::-1]])

    @property
    def width(self) -> float:
        """The width of a libration, or the length of a lap with its sign, in units of the curve parameter."""
        if self.direction:
            return float(self.samples[3 * (1 + self.source.variables), 0])
        low, high = self.turning_points
        return high - low

    @property
    def series(self) -> tuple[SeriesOf, SeriesOf, Array]:
        """The time per phase with its derivatives, the derivatives of arc length per share, and those of the lap."""
        n, samples = self.source.variables, self.samples
        rates, arcs = samples[: 1 + n], samples[2 * (1 + n) :]
        if self.direction:
            return Series(rates), Series(arcs[1 : 1 + n]), arcs[2 + n :, :1]
        count = samples.shape[1]
        rise = 0.5 * self.width * np.sin(2.0 * np.pi * (np.arange(count) + 0.5) / count)
        others = np.zeros((n - self.source.parameters, count))
        return Series(rates), Series(np.vstack([rise * arcs, others])), np.zeros((n, 1))

    def at_places(self, lam: Array) -> PathRows:
        """`path_rows` at places."""
        return path_rows(self.source.formulas, self.parameters, self.source.mass, lam)

    def extreme_rows(self, place: Array, *, of_speed: bool) -> Array:
        """Half of V**2, or the contact force, at places: with two derivatives by the place, and those by variables."""
        return values(extreme_program(self.source, of_speed), self.variables, place)[:, 0]
