"""The law of a motion with losses in given states, with its derivatives, in double-double arithmetic."""

from abc import ABC, abstractmethod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gqm_sym.runtime.arithmetic.doubledouble import ULP
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.gradients.evaluation import fill_signed_values, values
from gqm_sym.runtime.gradients.orbit import pairs, without_formulas
from gqm_sym.runtime.gradients.path import PathRows, path_rows
from gqm_sym.runtime.gradients.programs import Program, range_program
from gqm_sym.runtime.interface import ExactLaw
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.launch.request import Launch
from gqm_sym.runtime.legs.leg_record import HEADING
from gqm_sym.runtime.legs.leg_segments import Run
from gqm_sym.runtime.legs.panels.point import LEAST_V2
from gqm_sym.runtime.legs.runs.ends import END_ASYMPTOTE
from gqm_sym.runtime.legs.variations.chain import SIGMA, divide, follow_changes, join_law, lay
from gqm_sym.runtime.legs.variations.divided import MAX_DIVISIONS
from gqm_sym.runtime.legs.variations.equation import MARKS
from gqm_sym.runtime.legs.variations.force_errors import ROUNDING_RATIO, force_errors_on
from gqm_sym.runtime.legs.variations.formula_changes import changes_along_formulas
from gqm_sym.runtime.legs.variations.programs import (
    force_program,
    law_in_doubles,
    law_program,
    load_program,
    rates_program,
    sided_program,
)
from gqm_sym.runtime.motion.locking import computed_once

# The largest relative error of the force at which panels still distinguish rounding from structure.
MAX_FORCE_ERROR = 1e-11


class LawRows(NamedTuple):
    """The law of motion in states, with its derivatives: a column for each.

    Attributes
    ----------
    matrix : (2 * k + 5, n) array
        ds/dlam, its derivative with respect to the place and those with respect to the k run-time parameters, then F =
        dW/dlam and its derivatives with respect to the place, W and the parameters.
    """

    matrix: Array

    @property
    def ds(self) -> Array:
        """ds/dlam."""
        ds: Array = self.matrix[0]
        return ds

    @property
    def force(self) -> Array:
        """F and its derivatives with respect to the place and W: a row for each."""
        first = (len(self.matrix) - 1) // 2
        force: Array = self.matrix[first : first + 3]
        return force


class Followed(NamedTuple):
    """The changes of a motion along its runs.

    Attributes
    ----------
    laid : tuple
        The runs and their panels (`equation.PANELS_OF_RUNS`).
    solutions, origins, ends : arrays
        As `chain.follow` returns them.
    """

    laid: tuple[Array, NDArray[np.int64], NDArray[np.int64], Array]
    solutions: Array
    origins: Array
    ends: Array


def states_of(high: Array, low: Array, w: Array, heading: Array, contact_sign: Array) -> Array:
    """Return the states for which the law is evaluated, from places of two doubles each, V**2, and the signs of dlam/dt
    and of N.
    """
    return np.array([high, low, w, heading, contact_sign])


class Law(ABC):
    """The law of a motion with losses, with its derivatives.

    Places are labels of points of the curve. For a curve with formulas they are values of its parameter; otherwise they
    are arc lengths along the curve for the given parameters. In that case parameters that shape the curve move its
    points and change the arc lengths between them.

    Parameters
    ----------
    problem : Problem
        The launch with its module.

    Attributes
    ----------
    count : int
        The number of run-time parameters.
    mass : int
        The index of the mass among them.
    parameters : (3, count) array
        Their values as inputs of programs.
    by_arc_length : bool
        Whether places are arc lengths, which then are not fixed to the points of the curve.
    is_rough : bool
        Whether the law may have kinks within panels, as friction in space has.
    """

    by_arc_length: bool

    def __init__(self, problem: Problem) -> None:
        self.count, self.mass = len(problem.p), list(problem.formulas.parameters).index("m")
        self.parameters = pairs(*((n.value, n.low, 0.0) for n in problem.p))
        losses = problem.formulas.dissipation
        self.is_rough = losses is not None and not losses.linear

    @property
    @abstractmethod
    def launch_changes(self) -> Array:
        """The derivatives of the label of the launch with respect to each variable."""

    @property
    @abstractmethod
    def ranges(self) -> Array:
        """The derivatives of both ends of the range of labels and of their period: a row for each, by parameters."""

    @abstractmethod
    def matrix(self, states: Array) -> Array:
        """Return the law in states, as `LawRows.matrix`."""

    def followed(
        self, records: Array, begins: NDArray[np.int64], launch: Launch, lap: Array, breaks: Array
    ) -> Followed:
        """Return the changes of a motion along its runs.

        Parameters
        ----------
        records, begins
            The records of the runs, and the indices at which they begin.
        launch : Launch
            The launch.
        lap : array
            The change of the period of the curve's parameter.
        breaks : array
            The places at which the force may jump.
        """
        first, panels, states = lay(records, begins)
        first, panels, law = self._resolved(first, panels, self.matrix(states), MARKS * begins.size)
        v0, heading = launch.v0.value, float(records[begins[0] + HEADING])
        other_force = 0.0
        if v0 == 0.0 and launch.direction != heading:
            start = states[:, :1]
            turned = states_of(start[0], start[1], np.zeros(1), np.array([-heading]), start[4])
            other_force = float(LawRows(self.matrix(turned)).force[0, 0])
        laid, thrown = (records, begins, first, panels), (v0, float(launch.direction), other_force)
        return Followed(laid, *follow_changes(laid, law, self.launch_changes, thrown, lap, breaks))

    def _resolved(
        self, first: NDArray[np.int64], panels: Array, law: Array, marks: int
    ) -> tuple[NDArray[np.int64], Array, Array]:
        """Return panels on which the law is resolved, with the law in their states (`divided`)."""
        for _ in range(MAX_DIVISIONS if self.is_rough else 0):
            first, panels, before, states = divide(first, panels, law[self.count + 4, marks:])
            if not states.size:
                break
            law = join_law(law, marks, self.matrix(states), before)
        return first, panels, law

    @abstractmethod
    def loads(self, states: Array) -> Array:
        """Return the slope of the contact force per mass along the motion, and its derivatives with respect to the
        place and W.
        """

    @abstractmethod
    def sided(self, state: Array) -> Array:
        """Return the derivatives of the force per mass whose sign shows on which side of the track a body is, in one
        state, with respect to the place, W and the parameters.
        """

    @abstractmethod
    def path(self, high: Array, low: Array) -> PathRows:
        """Return the path at places of two doubles each, with derivatives at points with fixed labels."""

    @abstractmethod
    def coordinates(self, states: Array) -> Array:
        """Return the coordinates that programs take, as two doubles each except for the last one, which is V**2."""

    def values(
        self,
        program: Program,
        states: Array,
        errors: Array | None = None,
        *,
        parts: int = 3,
        more: tuple[float, ...] = (),
    ) -> Array:
        """Return the results of a program in states (`evaluation.values`), given bounds on the errors of parameters and
        the inputs between the parameters and the signs.
        """
        found = np.empty((program.outputs.size, parts, states.shape[1]))
        w = np.maximum(states[2], LEAST_V2)  # laws may contain its square root
        places = np.concatenate([self.coordinates(states), w[None], np.zeros((1, w.size))])
        inputs = np.concatenate([self.parameters, np.zeros((3, len(more) + 2))], axis=1)
        inputs[0, self.count : -2] = more
        if errors is not None:
            inputs[2, : self.count] = errors
        fill_signed_values(program.operands, program.work, inputs, places, states, found)
        return found


class FormulaLaw(Law):
    """The law along a curve with formulas."""

    by_arc_length = False

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem)
        formulas = problem.formulas
        if not isinstance(formulas.exact, ExactLaw):
            raise without_formulas()
        self._exact, self._domain = formulas.exact, formulas.domain_of

    @computed_once
    def launch_changes(self) -> Array:
        """See `Law`."""
        moves = np.zeros(self.count + 2)
        moves[self.count] = 1.0
        return moves

    @computed_once
    def no_change(self) -> Array:
        """Zero for each variable."""
        return np.zeros(self.count + 2)

    @computed_once
    def ranges(self) -> Array:
        """See `Law`."""
        assert self._domain is not None
        found = values(range_program(self._domain, self.count), self.parameters, np.zeros(1))[:, 0, 0]
        return found.reshape(3, -1)[:, 1:]

    def coordinates(self, states: Array) -> Array:
        """See `Law`."""
        return states[:2]

    def matrix(self, states: Array) -> Array:
        """See `Law`."""
        found: Array = self.values(law_program(self._exact, self.count), states, parts=1)[:, 0]
        return found

    def followed(
        self, records: Array, begins: NDArray[np.int64], launch: Launch, lap: Array, breaks: Array
    ) -> Followed:
        """See `Law`. Along formulas this is one call of compiled code."""
        return self._changes(records, begins, launch, lap, timed=True)

    def turns(self, records: Array, begins: NDArray[np.int64], launch: Launch, lap: Array) -> Array:
        """Return the changes of the labels of the turns at which runs end: a row for each run.

        The arguments are those of `followed`. Changes of times are not needed for this, so that it takes less.
        """
        return self._changes(records, begins, launch, lap, timed=False).ends[:, SIGMA]

    def _changes(
        self, records: Array, begins: NDArray[np.int64], launch: Launch, lap: Array, *, timed: bool
    ) -> Followed:
        """Return what compiled code finds along formulas, with or without the changes of times."""
        thrown = launch.v0.value, float(launch.direction), self.is_rough
        programs = self._programs if timed else self._untimed
        first, panels, found = changes_along_formulas(
            records, begins, programs, self._inputs, thrown, self.launch_changes, lap, timed
        )
        return Followed((records, begins, first, panels), *found)

    @computed_once
    def _programs(self) -> tuple[Any, ...]:
        """The programs of compiled code (`formula_changes.PROGRAMS`)."""
        return self._with_doubles(timed=True)

    @computed_once
    def _untimed(self) -> tuple[Any, ...]:
        """The programs for changes without times."""
        return self._with_doubles(timed=False)

    def _with_doubles(self, *, timed: bool) -> tuple[Any, ...]:
        given = self._exact, self.count
        programs = law_in_doubles(*given, timed=timed), law_program(*given), rates_program(*given)
        return tuple(part for program in programs for part in (program.operands, program.work))

    @computed_once
    def _inputs(self) -> Array:
        """The inputs of the programs in double-double arithmetic; the last two are signs that compiled code sets."""
        inputs: Array = np.concatenate([self.parameters, np.zeros((3, 2))], axis=1)
        return inputs

    def loads(self, states: Array) -> Array:
        """See `Law`."""
        found: Array = self.values(load_program(self._exact, self.count), states, parts=1)[:, 0]
        return found

    def sided(self, state: Array) -> Array:
        """See `Law`."""
        found: Array = self.values(sided_program(self._exact, self.count), state, parts=1)[:, 0, 0]
        return found

    def path(self, high: Array, low: Array) -> PathRows:
        """See `Law`."""
        return path_rows(self._exact, self.parameters, self.mass, high, low)

    def force_errors_on(self, run: Run, share: float) -> Array:
        """Return, for each panel of a run, the error of the force on a body at rest, as a multiple of ``share``
        (`force_errors.force_errors_on`).
        """
        operands, work, by_field = self.force.operands, self.force.work, run.what == END_ASYMPTOTE
        errors: Array = force_errors_on(operands, work, self._inexact_inputs, by_field, share, run.record)
        return errors

    @computed_once
    def force(self) -> Program:
        """The program of dW/dlam.

        Raises
        ------
        SolutionError
            If the formulas are too long.
        """
        return force_program(self._exact, self.count)

    @computed_once
    def _inexact_inputs(self) -> Array:
        """The inputs of `force` with their errors in doubles, which lack the low parts."""
        inputs: Array = np.concatenate([self.parameters, np.zeros((3, 2))], axis=1)
        inputs[2, : self.count] = np.abs(self.parameters[1]) / ROUNDING_RATIO
        return inputs

    def _forces(self, places: Array, v: Array, nu: Array) -> tuple[Array, Array]:
        """Return the force dW/dlam on a body at rest, and its errors.

        Double-double arithmetic has a running bound on the error of each number, which grows with the unit of rounding.
        """
        states = states_of(places, np.zeros_like(places), np.zeros_like(places), v, nu)
        lows = np.abs(self.parameters[1]) / ROUNDING_RATIO  # doubles lack the low parts
        force, slope = self.values(self.force, states, lows)
        return force[0], ROUNDING_RATIO * force[2] + 0.5 * ULP * np.abs(places * slope[0])

    def at_rest(self, high: Array, low: Array, sense: tuple[int, int]) -> tuple[Array, Array]:
        """Return the force dW/dlam on a body at rest, and its derivative with respect to the place.

        Places are given as two doubles each; ``sense`` is the sign of dlam/dt and that of N.
        """
        ones = np.ones_like(high)
        states = states_of(high, low, 0.0 * ones, *(sign * ones for sign in sense))
        force, slope = self.values(self.force, states)
        return force[0], slope[0]

    def cancels(self, place: float, heading: int) -> bool:
        """Return whether terms of the force on a body at rest cancel so far at a place that their rounding looks like
        structure.
        """
        both = np.array([-1.0, 1.0])
        forces, errors = self._forces(np.full(2, place), np.full(2, float(heading)), both)
        return bool(np.all(errors > MAX_FORCE_ERROR * np.abs(forces)))
