"""The law of a motion with losses in given states, with its derivatives, in double-double arithmetic."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import cached_property
from math import inf
from typing import NamedTuple

import numpy as np

from gqm_sym.runtime.arithmetic.doubledouble import ULP, Pair
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.double_double.arithmetic import UNIT
from gqm_sym.runtime.gradients.evaluation import fill_values
from gqm_sym.runtime.gradients.orbit import PathRows, pairs, path_rows, values, without_formulas
from gqm_sym.runtime.gradients.programs import Program
from gqm_sym.runtime.interface import ExactLaw
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.legs.leg_record import END, HEADING, NORMAL_LOAD, RIGHT, START
from gqm_sym.runtime.legs.leg_segments import Run
from gqm_sym.runtime.legs.panels.point import LEAST_V2
from gqm_sym.runtime.legs.panels.polynomials import COUNT
from gqm_sym.runtime.legs.runs.ends import ASYMPTOTE
from gqm_sym.runtime.legs.variations.programs import force_program, law_program, load_program, range_program

# The ratio of the rounding errors of doubles to those of double-double arithmetic.
COARSER = 0.5 * ULP / UNIT

# The largest relative error of the force at which panels still distinguish rounding from structure.
MAX_FORCE_ERROR = 1e-11


class LawRows(NamedTuple):
    """The law of motion at places: a column for each.

    Attributes
    ----------
    ds, ds_by_place : (n,) arrays
        ds/dlam and its derivative by the place.
    ds_by_parameters : (k, n) array
        Its derivatives by the run-time parameters.
    slope, by_place, by_w : (n,) arrays
        F = dW/dlam and its derivatives by the place and by W.
    by_parameters : (k, n) array
        Its derivatives by the run-time parameters.
    """

    ds: Array
    ds_by_place: Array
    ds_by_parameters: Array
    slope: Array
    by_place: Array
    by_w: Array
    by_parameters: Array

    def part(self, first: int, last: int | None) -> "LawRows":
        """Return the law at some of the places."""
        return LawRows(*(row[..., first:last] for row in self))


class States(NamedTuple):
    """The states for which the law is evaluated: a number for each.

    Attributes
    ----------
    high, low : (n,) arrays
        The places as two doubles each.
    w : (n,) array
        V**2 there.
    heading, contact_sign : (n,) arrays
        The signs of dlam/dt and of N.
    """

    high: Array
    low: Array
    w: Array
    heading: Array
    contact_sign: Array


def one_state(place: Pair, w: float, heading: float, contact_sign: float) -> States:
    """Return one state, at a place of two doubles."""
    return States(*(np.array([number]) for number in (*place, w, heading, contact_sign)))


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
    """

    by_arc_length: bool

    def __init__(self, problem: Problem) -> None:
        self.count, self.mass = len(problem.p), list(problem.formulas.parameters).index("m")
        self.parameters = pairs(*((n.value, n.low, 0.0) for n in problem.p))

    @property
    @abstractmethod
    def launch_moves(self) -> Array:
        """The derivatives of the label of the launch by each variable."""

    @property
    @abstractmethod
    def ranges(self) -> Array:
        """The derivatives of both ends of the range of labels and of their period: a row for each, by parameters."""

    @abstractmethod
    def rows(self, states: States) -> LawRows:
        """Return the law in states."""

    @abstractmethod
    def loads(self, states: States) -> Array:
        """Return the slope of the contact force per mass along the motion, and its derivatives by the place and by
        W.
        """

    @abstractmethod
    def path(self, high: Array, low: Array) -> PathRows:
        """Return the path at places of two doubles each, with derivatives at points with fixed labels."""

    @abstractmethod
    def coordinates(self, states: States) -> Array:
        """Return the coordinates that programs take, as two doubles each except for the last one, which is V**2."""

    def values(self, program: Program, states: States, errors: Array | None = None) -> Array:
        """Return the results of a program in states (`orbit.values`), for parameters with bounds on their errors."""
        signs, found = 2.0 * states.heading + states.contact_sign, np.empty((program.outputs.size, 3, states.w.size))
        w = np.maximum(states.w, LEAST_V2)  # laws may contain its square root
        places = np.vstack([self.coordinates(states), [w, np.zeros_like(w)]])
        for heading in (-1.0, 1.0):
            for contact_sign in (-1.0, 1.0):
                here = np.flatnonzero(signs == 2.0 * heading + contact_sign)
                if here.size:
                    inputs = np.hstack([self.parameters, [[heading, contact_sign], [0.0, 0.0], [0.0, 0.0]]])
                    if errors is not None:
                        inputs[2, : self.count] = errors
                    some = np.empty((program.outputs.size, 3, here.size))
                    fill_values(program.operands, program.work, inputs, np.ascontiguousarray(places[:, here]), some)
                    found[:, :, here] = some
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

    @property
    def launch_moves(self) -> Array:
        """See `Law`."""
        moves = np.zeros(self.count + 2)
        moves[self.count] = 1.0
        return moves

    @cached_property
    def ranges(self) -> Array:
        """See `Law`."""
        assert self._domain is not None
        found = values(range_program(self._domain, self.count), self.parameters, np.zeros(1))[:, 0, 0]
        return found.reshape(3, -1)[:, 1:]

    def coordinates(self, states: States) -> Array:
        """See `Law`."""
        return np.array([states.high, states.low])

    def rows(self, states: States) -> LawRows:
        """See `Law`."""
        n = self.count
        found = self.values(law_program(self._exact, n), states)[:, 0]
        ds, slope = found[: n + 2], found[n + 2 :]
        return LawRows(ds[0], ds[1], ds[2:], slope[0], slope[1], slope[2], slope[3:])

    def loads(self, states: States) -> Array:
        """See `Law`."""
        found: Array = self.values(load_program(self._exact, self.count), states)[:, 0]
        return found

    def path(self, high: Array, low: Array) -> PathRows:
        """See `Law`."""
        return path_rows(self._exact, self.parameters, self.mass, high, low)

    def force_errors_along(self, runs: Sequence[Run]) -> list[Array]:
        """Return `force_errors` on the panels of each run, beginning with those from its start: the largest at three
        places of each.
        """
        places, signs, counts = [], [], []
        for run in runs:
            v, halves = run.record[HEADING], [(run.record[START], run.half_c, run.panels_ahead)]
            if run.what != ASYMPTOTE:
                halves.append((run.record[END], 0.0, run.panels_back))
            counts.append(sum(len(panels) for *_, panels in halves))
            for sense, (origin, half_c, panels) in zip((v, -v), halves, strict=False):
                right = panels[:, RIGHT]
                left = np.append(0.0, right)[:-1]
                w = np.array([left, 0.5 * (left + right), right])
                places.append(origin + sense * (w if half_c == inf else w * (w + 2.0 * half_c)))
                nu = np.where(panels[:, NORMAL_LOAD + COUNT // 2] > 0.0, 1.0, -1.0)
                signs.append(np.array([np.full_like(nu, v), nu]))
        (v, nu), at = np.hstack(signs), np.hstack(places)
        errors = self.force_errors(at.ravel(), np.tile(v, 3), np.tile(nu, 3)).reshape(at.shape)
        return np.split(errors.max(axis=0), np.cumsum(counts)[:-1])

    def force_errors(self, places: Array, v: Array, nu: Array) -> Array:
        """Return the errors of dW/dlam of a body at rest in doubles: by rounding, and by the rounding of the place."""
        return np.nan_to_num(self._forces(places, v, nu)[1], posinf=0.0)

    def _forces(self, places: Array, v: Array, nu: Array) -> tuple[Array, Array]:
        """Return the force dW/dlam on a body at rest, and its errors.

        Double-double arithmetic has a running bound on the error of each number, which grows with the unit of rounding.
        """
        states = States(places, np.zeros_like(places), np.zeros_like(places), v, nu)
        lows = np.abs(self.parameters[1]) / COARSER  # doubles lack the low parts
        force, slope = self.values(force_program(self._exact, self.count), states, lows)
        return force[0], COARSER * force[2] + 0.5 * ULP * np.abs(places * slope[0])

    def at_rest(self, high: Array, low: Array) -> tuple[Array, Array]:
        """Return the force dW/dlam on a body at rest, without friction, and its derivative by the place.

        Places are given as two doubles each.
        """
        ones = np.ones_like(high)
        force, slope = self.values(force_program(self._exact, self.count), States(high, low, 0.0 * ones, ones, ones))
        return force[0], slope[0]

    def cancels(self, place: float, heading: int) -> bool:
        """Return whether terms of the force on a body at rest cancel so far at a place that their rounding looks like
        structure.
        """
        both = np.array([-1.0, 1.0])
        forces, errors = self._forces(np.full(2, place), np.full(2, float(heading)), both)
        return bool(np.all(errors > MAX_FORCE_ERROR * np.abs(forces)))
