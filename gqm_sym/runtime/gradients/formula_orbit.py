"""A periodic orbit along a curve with formulas, with its derivatives: means over equal steps of the phase angle."""

from collections.abc import Callable
from contextlib import suppress
from functools import cached_property, partial

import numpy as np

from gqm_sym.errors import SolutionError
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.double_double.arithmetic import UNIT
from gqm_sym.runtime.double_double.nodes import LEVELS, trapezoidal_nodes
from gqm_sym.runtime.double_double.orbit_time import Orbit
from gqm_sym.runtime.gradients.evaluation import (
    LOST_DIGITS,
    MEAN,
    fill_means,
    fill_panel_means,
    values,
)
from gqm_sym.runtime.gradients.multiprecision import MultiprecisionOrbit
from gqm_sym.runtime.gradients.orbit import (
    OrbitDerivatives,
    SeriesOf,
    pairs,
    without_formulas,
)
from gqm_sym.runtime.gradients.panels import Panels, resolved, rule_with_tails
from gqm_sym.runtime.gradients.passages.from_turns import from_turn_program, on_both_sides, values_from_turns
from gqm_sym.runtime.gradients.passages.slow_orbits import MAX_SHARE
from gqm_sym.runtime.gradients.path import PathRows, path_rows
from gqm_sym.runtime.gradients.programs import (
    Program,
    Source,
    circulation_program,
    extreme_program,
    libration_program,
    path_program,
    turning_point_program,
)
from gqm_sym.runtime.gradients.second_programs import circulation_seconds, libration_seconds, turning_point_seconds
from gqm_sym.runtime.gradients.series import PanelSeries, Series
from gqm_sym.runtime.interface import ExactFormulas
from gqm_sym.runtime.launch.formulas import Formulas
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.quadrature.trapezoid import CIRCULATION, LIBRATION

# What stands for a number of nodes that double-double arithmetic does not tell.
UNKNOWN = -1

# Pi as two doubles.
PI, PI_LOW = np.pi, 1.2246467991473532e-16


def source_of(formulas: Formulas) -> Source:
    """Return the formulas from which the programs of a module are recorded.

    Raises
    ------
    SolutionError
        If its curve has no formulas.
    """
    if not isinstance(formulas.exact, ExactFormulas) or formulas.domain_of is None:
        raise without_formulas()
    names = list(formulas.parameters)
    return Source(formulas.exact, formulas.domain_of, formulas.inertia, len(names), names.index("m"))


def variables_of(problem: Problem) -> Array:
    """Return the variables of a launch as inputs of programs; the change of the energy is zero."""
    numbers = (*problem.p, problem.launch.lam0, problem.launch.v0)
    return pairs(*((n.value, n.low, 0.25 * UNIT * abs(n.value) if n.low else 0.0) for n in numbers), (0.0, 0.0, 0.0))


class FormulaOrbitDerivatives(OrbitDerivatives):
    """A libration or circulation along a curve with formulas, with derivatives with respect to all variables.

    The variables are the run-time parameters, lam0, v0, and the energy per unit mass over 1 + beta (`programs`).

    Parameters
    ----------
    problem : Problem
        The launch with its module.
    orbit : Orbit or None
        Duration and turning points in double-double arithmetic; None if that does not suffice.
    direction : int
        0 for a libration, else the sign of ds/dt.
    offsets : (float, float)
        The distances of both turning points from the launch, for a libration.
    edges : callable
        It returns the phase angles between which the speed changes smoothly, from the first to the last.
    """

    source: Source

    def __init__(
        self,
        problem: Problem,
        orbit: Orbit | None,
        direction: int,
        offsets: tuple[float, float],
        edges: Callable[[], Array],
    ) -> None:
        self.direction, self._edges = direction, edges
        self.source = source_of(problem.formulas)
        self._given = (*problem.p, problem.launch.lam0, problem.launch.v0)
        self.variables = variables_of(problem)
        self.parameters = np.ascontiguousarray(self.variables[:, : self.source.parameters])
        self._orbit, self._offsets = orbit, offsets

    @cached_property
    def _multiprecision(self) -> MultiprecisionOrbit:
        return self._in_multiprecision(self._program, turning_point_program(self.source), self._in_double_double[1])

    def _in_multiprecision(self, program: Program, turns: Program, nodes: int) -> MultiprecisionOrbit:
        given = self._given, self.direction, self._offsets, self._edges
        return MultiprecisionOrbit(self.source, program, turns, *given, needs_panels=nodes == 0)

    @cached_property
    def _end_rows(self) -> Array:
        """The derivatives of both turning points in double-double arithmetic."""
        return self._ends_by(turning_point_program(self.source))

    def _ends_by(self, turns: Program) -> Array:
        """Return the results of a program at both turning points except the first one, in double-double arithmetic."""
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
        """Return the integrand along the orbit."""
        return circulation_program(self.source, self.direction) if self.direction else libration_program(self.source)

    @property
    def _from_turns(self) -> Program | None:
        """The integrand along half of a libration, from each turning point; None if there is none."""
        return None if self.direction else from_turn_program(self.source)

    @cached_property
    def _rule(self) -> tuple[Array, Array]:
        """The inputs of the orbit's program in double-double arithmetic, and the table of nodes."""
        return self._rule_with(np.empty(0) if self.direction else self._end_rows)

    def _rule_with(self, ends: Array) -> tuple[Array, Array]:
        """Return the inputs of a program, including the derivatives of a libration's turning points, and the table of
        nodes.
        """
        if self.direction:
            inputs = np.hstack([self.variables, self.variables[:, [self.source.parameters]]])
            return np.ascontiguousarray(inputs), trapezoidal_nodes(CIRCULATION)
        assert self._orbit is not None
        places = np.array([self._orbit.low, self._orbit.high]).T
        inputs = np.hstack([self.variables, places, ends[:, :, 0].T, ends[:, :, 1].T])
        return np.ascontiguousarray(inputs), trapezoidal_nodes(LIBRATION)

    @cached_property
    def _in_double_double(self) -> tuple[Array | None, int]:
        return self._means_of(self._program, lambda: np.empty(0) if self.direction else self._end_rows)

    @cached_property
    def _means(self) -> tuple[Array, int, bool]:
        """The means of the orbit's program, the number of nodes, and whether double-double arithmetic found them.

        The number is 0 if the means were found on panels.
        """
        found, n = self._in_double_double
        return (*self._multiprecision.means[:2], False) if found is None else (found, n, True)

    @property
    def nodes(self) -> int:
        """The number of nodes by which means over the orbit are found; 0 if it needs panels instead."""
        n = self._in_double_double[1]
        if n != UNKNOWN:
            return n
        with suppress(SolutionError):
            return found[1] if (found := self._multiprecision.means_over_steps) else 0
        return 0

    def _means_of(self, program: Program, ends: Callable[[], Array]) -> tuple[Array | None, int]:
        """Return the means of a program, whose first result is the rate of time, in double-double arithmetic (None if
        digits are lost), and the number of nodes, which is 0 if it needs panels, or UNKNOWN.

        ``ends`` returns the derivatives of a libration's turning points (`_rule_with`).
        """
        if self._orbit is None:
            return None, UNKNOWN
        (inputs, nodes), found = self._rule_with(ends()), np.zeros((program.outputs.size, MEAN))
        kind = CIRCULATION if self.direction else LIBRATION
        n = fill_means(program.operands, program.work, inputs, kind, nodes, found)
        if n > 0:
            return found, n
        is_lost = n == LOST_DIGITS
        ways = [] if is_lost else [(program, inputs[np.newaxis])]
        if program is self._program and self._from_turns is not None:
            ways.insert(0, (self._from_turns, on_both_sides(inputs, self.source.inputs)))
        for program, sides in ways:
            if fill_panel_means(program.operands, program.work, sides, kind, rule_with_tails(), found) > 0:
                mean, _, error, _ = np.abs(found[1 : 1 + self.source.variables]).T
                if not is_lost or (error <= MAX_SHARE * mean).all():
                    return found, 0
        return None, UNKNOWN if is_lost else 0

    def second_durations(self, rows: tuple[int, ...]) -> Array:
        """Return the derivatives that `OrbitDerivatives.second_durations` describes."""
        turns = turning_point_seconds(self.source, rows)
        if self.direction:
            program = circulation_seconds(self.source, self.direction, rows)
        else:
            program = libration_seconds(self.source, rows)
        found, n = self._means_of(program, lambda: np.empty(0) if self.direction else self._ends_by(turns))
        means = self._in_multiprecision(program, turns, n).means[0] if found is None else found
        return self._over_phase(means)[1:]

    def _integrals(self, first: int, count: int) -> Array:
        """Return the integrals of results over a half period, or over a lap."""
        return self._over_phase(self._means[0][first : first + count])

    def _over_phase(self, found: Array) -> Array:
        """Return the integrals over a half period, or over a lap, from means."""
        high, low = found[:, :2].T
        integrals: Array = high + low if self.direction else PI * high + (PI * low + PI_LOW * high)
        return integrals

    @cached_property
    def samples(self) -> Array | Panels:
        """The results of the orbit's program at equal steps of the phase angle, over a whole turn of it; on panels of
        the phase where these would be too many.

        The steps are the midpoints of N intervals of [0, 2 pi], or of the share of a lap. In the second half of a
        libration the values occur again in reverse order.
        """
        # The means at n nodes are exact as soon as terms of order 2n vanish; twice as many nodes resolve these terms.
        means, count, is_double_double = self._means
        if not count:
            return self._on_panels() if is_double_double else self._multiprecision.panels(everywhere=True)[0]
        n = min(2 * count, LEVELS[-1] // 2)
        if is_double_double:
            inputs, nodes = self._rule
            found = values(self._program, inputs, *nodes[:2, n : 2 * n].copy())[:, 0]
        else:
            found = self._multiprecision.samples(n)
        found[means[:, 3] <= means[:, 2]] = 0.0  # they are rounding
        return found if self.direction else np.hstack([found, found[:, ::-1]])

    def _on_panels(self) -> Panels:
        """Return the results of the orbit's program on panels of the phase, in mpmath if double-double arithmetic
        loses digits.
        """
        kind, everything = CIRCULATION if self.direction else LIBRATION, np.arange(self._program.outputs.size)
        ways = [lambda shares: values(self._program, self._rule[0], *shares)]
        if self._from_turns is not None:
            ways.insert(0, self._values_from_turns)
        for evaluate in ways:
            with suppress(SolutionError):
                return resolved(kind, self._edges(), evaluate, everything, everywhere=True)
        return self._multiprecision.panels(everywhere=True)[0]

    def _values_from_turns(self, shares: Array) -> Array:
        """Return the results of `_from_turns` at shares of the orbit's width, which are two doubles each."""
        program = self._from_turns
        assert program is not None
        return values_from_turns(program, self._rule[0], self.source.inputs, shares)

    @property
    def width(self) -> float:
        """The width of a libration, or the length of a lap with its sign, in units of the curve parameter."""
        if self.direction:
            samples = self.samples
            rows = samples.samples if isinstance(samples, Panels) else samples
            return float(rows[3 * (1 + self.source.variables)].flat[0])
        low, high = self.turning_points
        return high - low

    @property
    def series(self) -> tuple[SeriesOf, Array]:
        """As `OrbitDerivatives.series`."""
        n, found = self.source.variables, self.samples
        if isinstance(found, Panels):
            samples, phases, whole = found.samples, found.phases, 1.0 if self.direction else 2.0 * np.pi
            make: Callable[[Array], SeriesOf] = partial(PanelSeries, found.edges, whole=whole)
        else:
            count = found.shape[1]
            samples, phases, make = found, 2.0 * np.pi * (np.arange(count) + 0.5) / count, Series
        rates, arcs = samples[: 1 + n], samples[2 * (1 + n) :]
        if self.direction:
            lap = arcs[2 + n :].reshape(-1, phases.size)[:, 0]
            return make(np.concatenate([rates, arcs[1 : 1 + n]])), lap
        others = np.zeros((n - self.source.parameters, *phases.shape))
        return make(np.concatenate([rates, 0.5 * self.width * np.sin(phases) * arcs, others])), np.zeros(n)

    @property
    def path_program(self) -> Program:
        """The program of the path."""
        return path_program(self.source.formulas, self.source.parameters, self.source.mass)

    def at_places(self, lam: Array) -> PathRows:
        """Return `path_rows` at places."""
        return path_rows(self.source.formulas, self.parameters, self.source.mass, lam)

    def extreme_rows(self, place: Array, *, of_speed: bool, direction: int = 1) -> Array:
        """Return what `OrbitDerivatives.extreme_rows` does."""
        return values(extreme_program(self.source, of_speed, direction), self.variables, place)[:, 0]
