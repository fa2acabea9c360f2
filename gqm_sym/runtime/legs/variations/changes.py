"""Changes of a motion with losses from leg to leg: of its turning points, their times, and its states between them."""

from collections.abc import Sequence
from functools import cached_property
from itertools import accumulate
from math import inf, log2
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.legs.leg_record import END, HEADING, RIGHT, START
from gqm_sym.runtime.legs.leg_segments import Run
from gqm_sym.runtime.legs.panels.polynomials import COUNT, TO_COEFFICIENTS, WIDE
from gqm_sym.runtime.legs.runs.ends import END_ASYMPTOTE
from gqm_sym.runtime.legs.variations.chain import ORIGIN_ROWS, STATE_ROWS, fill_along, fill_states, follow_changes
from gqm_sym.runtime.legs.variations.chart_law import law_of
from gqm_sym.runtime.legs.variations.equation import CONTACT_SIGN, MARKS, PANEL_COLUMNS, end_speed, lay_panels
from gqm_sym.runtime.legs.variations.law import LawRows, states_of


class Origin(NamedTuple):
    """The changes of the end of a run; each field has a number for each variable.

    The variables are the run-time parameters, lam0 and v0.

    Attributes
    ----------
    sigma : array
        The change of the place.
    y : array
        The change of V**2 at the moving place.
    delay : array
        The change of the time at the moving place.
    arc : array
        The change of the arc length from launch, less ds/dlam times the change of the place.
    """

    sigma: Array
    y: Array
    delay: Array
    arc: Array


class ChangesAlong(NamedTuple):
    """The changes of some states.

    Attributes
    ----------
    changes : (ORIGIN_ROWS, variables, n) array
        As in `Origin`, at given distances from the origin, with ``y`` as a share of V**2.
    states : (5, n) array
        The states (`law.states_of`).
    """

    changes: Array
    states: Array


class Changes:
    """The changes of a motion with losses along some of its runs, beginning with the run of the launch.

    Parameters
    ----------
    problem : Problem
        The launch.
    runs : sequence of Run
        The runs in the order of time, up to an approach to an equilibrium.

    Attributes
    ----------
    law : Law
        The law of motion.
    followed : int
        The number of runs, including approaches to an equilibrium.
    runs : list of Run
        The runs.
    ends : list of Origin
        For each run, the changes of its end: of the turn, or of a place that moves with the origin of its last half.
    """

    def __init__(self, problem: Problem, runs: Sequence[Run]) -> None:
        self.law, self._problem = law_of(problem), problem
        self.followed, self.runs = len(runs), [run for run in runs if run.what != END_ASYMPTOTE]
        records = [run.record for run in self.runs]
        begins = np.array([0, *accumulate(record.size for record in records[:-1])], dtype=np.int64)
        self._first = np.empty(2 * len(records) + 1, dtype=np.int64)
        panels = np.empty((sum(map(_most_panels, self.runs)), PANEL_COLUMNS))
        line = np.concatenate(records)
        states = lay_panels(line, begins, self._first, panels)
        self._panels = panels[: self._first[-1]]
        self._laid = line, begins, self._first, self._panels
        law, n = self.law.matrix_on_panels(states, MARKS * len(records)), self.law.count
        self._solutions = np.empty((len(self._panels), 3 * n + 4, WIDE))
        self._origins = np.empty((2 * len(records), ORIGIN_ROWS, n + 2))
        ends = np.empty((len(records), ORIGIN_ROWS, n + 2))
        launched = self._launched(LawRows(law[:, :1]), states[:, :1])
        follow_changes(self._laid, law, launched, self.lap, self.breaks, self._solutions, self._origins, ends)
        self.ends = [Origin(*end) for end in ends]

    @property
    def variables(self) -> int:
        """The number of variables."""
        return self.law.count + 2

    def by_all(self, rows: Array) -> Array:
        """Extend derivatives with respect to the run-time parameters to derivatives with respect to all variables,
        where the others are zero.
        """
        return np.concatenate([rows, np.zeros((2, *rows.shape[1:]))])

    @property
    def breaks(self) -> Array:
        """The places at which the force may jump, on all laps that the motion takes."""
        breaks, period = self._problem.functions.breaks, self._problem.period
        if not period or not breaks.size:
            return breaks
        ends = [run.record[at] for run in self.runs for at in (START, END)]
        laps = np.arange(np.floor(min(ends) / period) - 1.0, np.floor(max(ends) / period) + 2.0)
        everywhere: Array = (breaks + period * laps[:, None]).ravel()
        return everywhere

    @cached_property
    def ranges(self) -> Array:
        """The derivatives of both ends of the parameter's range and of its period: a row for each, by all variables."""
        return self.by_all(self.law.ranges.T).T

    @cached_property
    def lap(self) -> Array:
        """The derivatives of the period of the curve's parameter."""
        lap: Array = self.ranges[2] if self._problem.period else np.zeros(self.variables)
        return lap

    def at_end(self, k: int) -> tuple[Array, float]:
        """Return the state at the end of the k-th run, and the speed there."""
        run, panel = self.runs[k], self._panels[self._first[2 * k + 1] - 1]
        speed = float(end_speed.py_func(panel))
        numbers = *run.pair(END), speed**2, float(run.record[HEADING]), float(panel[CONTACT_SIGN])
        return states_of(*(np.array([number]) for number in numbers)), speed

    def _launched(self, start: LawRows, state: Array) -> Array:
        """Return the changes of the launch: a row for each field of an `Origin`."""
        n, launch = self.law.count, self._problem.launch
        changes = np.zeros((ORIGIN_ROWS, n + 2))
        sigma, y, delay, arc = changes
        sigma += self.law.launch_changes
        arc -= start.ds[0] * sigma
        y[n + 1] = 2.0 * launch.v0.value
        if launch.v0.value == 0.0:
            heading = float(self.runs[0].record[HEADING])
            slope = start.force[0, 0]
            if launch.direction == heading:
                delay[n + 1] = -2.0 * start.ds[0] / abs(slope)
            else:  # a body thrown the other way comes back with little less speed
                state = states_of(state[0], state[1], np.zeros(1), np.array([-heading]), state[4])
                delay[n + 1] = 2.0 * start.ds[0] / abs(LawRows(self.law.matrix(state)).force[0, 0])
        return changes

    def parameter_change(self, sigma: Array, arc: Array, laps: Array | float) -> Array:
        """Return the change of a place in the curve's parameter, from the changes of its label and of the arc length to
        it (`Origin`).
        """
        if not self.law.by_arc_length:
            changed: Array = sigma + laps * self.lap.reshape(-1, *[1] * (sigma.ndim - 1))
            return changed
        changed = sigma + arc
        changed[self.law.count] += 1.0  # the change of the launch place itself, from the start point
        return changed

    @cached_property
    def _series(self) -> Array:
        """Return the Chebyshev coefficients of the solutions."""
        return np.ascontiguousarray((self._solutions[:, :, :COUNT] @ TO_COEFFICIENTS.T).swapaxes(1, 2))

    def along(self, halves: NDArray[np.int64], w: Array, v: Array, *, whole: bool = True) -> ChangesAlong:
        """Return the changes of states at march variables w on halves with given numbers; unless ``whole``, those of
        places and times only.
        """
        found, states = np.empty((ORIGIN_ROWS, self.variables, w.size)), np.empty((5, w.size))
        rows = self._series.shape[2] if whole else self.variables
        fill_along(self._laid, self._series, self._origins, halves, np.array([w, v * v]), rows, found, states)
        return ChangesAlong(found, states)

    def states(self, along: ChangesAlong, law: Array, v: Array) -> Array:
        """Return the changes of states at given times (`chain.fill_states`), given the law and the velocities there."""
        path = self.law.path(*along.states[:2])
        found = np.empty((STATE_ROWS, self.variables, v.size))
        fill_states(along.changes, law, path.rows, v, found)
        return found


def _most_panels(run: Run) -> int:
    """Return the largest number of panels of a run; those of a slow launch are divided (`equation.lay_half`)."""
    is_slow = run.ahead and 0.0 < run.half_c < inf
    return run.ahead + run.back + (int(log2(run.panels_ahead[-1, RIGHT] / run.half_c + 1.0)) + 1 if is_slow else 0)
