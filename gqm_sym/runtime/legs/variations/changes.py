"""Changes of a motion with losses from leg to leg: of its turning points, their times, and its states between them."""

from collections.abc import Sequence
from itertools import accumulate
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.legs.leg_record import END, HEADING, START
from gqm_sym.runtime.legs.leg_segments import Run
from gqm_sym.runtime.legs.panels.polynomials import COUNT, TO_COEFFICIENTS
from gqm_sym.runtime.legs.runs.ends import END_ASYMPTOTE
from gqm_sym.runtime.legs.variations.chain import ORIGIN_ROWS, SPEED_ROW, STATE_ROWS, fill_along, fill_states
from gqm_sym.runtime.legs.variations.chart_law import law_of
from gqm_sym.runtime.legs.variations.equation import CONTACT_SIGN, end_speed
from gqm_sym.runtime.legs.variations.law import FormulaLaw, states_of
from gqm_sym.runtime.motion.locking import computed_once

# Where the record of a single run begins.
FIRST = np.zeros(1, dtype=np.int64)


def joined(runs: Sequence[Run]) -> tuple[Array, NDArray[np.int64]]:
    """Return the records of runs, one after the other, and the indices at which they begin."""
    if len(runs) == 1:
        return runs[0].record, FIRST
    records = [run.record for run in runs]
    return np.concatenate(records), np.array([0, *accumulate([record.size for record in records[:-1]])])


def changes_of_turns(problem: Problem, runs: Sequence[Run]) -> Array:
    """Return the changes of the turns at which runs along a curve with formulas end, beginning with the run of the
    launch: a row for each run, with respect to all variables.

    Laps of a closed curve count. Of a run that does not end at a turn, the row has no meaning.
    """
    law = law_of(problem)
    assert isinstance(law, FormulaLaw)
    line, begins = joined(runs)
    if not problem.period:
        return law.turns(line, begins, problem.launch, law.no_change)
    lap = np.append(law.ranges[2], [0.0, 0.0])
    laps = np.array([run.laps for run in runs])
    found: Array = law.turns(line, begins, problem.launch, lap) + laps[:, None] * lap
    return found


class ChangesAlong(NamedTuple):
    """The changes of some states.

    Attributes
    ----------
    changes : (ORIGIN_ROWS, variables, n) array
        As of origins (`chain`), at given distances from them, with ``y`` as a share of V**2.
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
        The runs in the order of time, up to an approach to an equilibrium; along charts they have panels.

    Attributes
    ----------
    law : Law
        The law of motion.
    followed : int
        The number of runs, including approaches to an equilibrium.
    runs : list of Run
        The runs.
    ends : (runs, ORIGIN_ROWS, variables) array
        For each run, the changes of its end (`chain`): of the turn, or of a place that moves with the origin of its
        last half.
    """

    def __init__(self, problem: Problem, runs: Sequence[Run]) -> None:
        self.law, self._problem = law_of(problem), problem
        self.followed, self.runs = len(runs), [run for run in runs if run.what != END_ASYMPTOTE]
        lap = self.lap if problem.period else np.zeros(self.variables)
        self._followed = self.law.followed(*joined(self.runs), problem.launch, lap, self.breaks)
        self.ends = self._followed.ends

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

    @computed_once
    def ranges(self) -> Array:
        """The derivatives of both ends of the parameter's range and of its period: a row for each, by all variables."""
        return self.by_all(self.law.ranges.T).T

    @computed_once
    def lap(self) -> Array:
        """The derivatives of the period of the curve's parameter."""
        lap: Array = self.ranges[2] if self._problem.period else np.zeros(self.variables)
        return lap

    def at_end(self, k: int) -> tuple[Array, float]:
        """Return the state at the end of the k-th run, and the speed there."""
        _, _, first, panels = self._followed.laid
        run, panel = self.runs[k], panels[first[2 * k + 1] - 1]
        speed = float(end_speed.py_func(panel))
        numbers = *run.pair(END), speed**2, float(run.record[HEADING]), float(panel[CONTACT_SIGN])
        return states_of(*(np.array([number]) for number in numbers)), speed

    def parameter_change(self, sigma: Array, arc: Array, laps: Array | float) -> Array:
        """Return the change of a place in the curve's parameter, from the changes of its label and of the arc length to
        it (`chain`).
        """
        if not self.law.by_arc_length:
            changed: Array = sigma + laps * self.lap.reshape(-1, *[1] * (sigma.ndim - 1))
            return changed
        changed = sigma + arc
        changed[self.law.count] += 1.0  # the change of the launch place itself, from the start point
        return changed

    @computed_once
    def _series(self) -> Array:
        """Return the Chebyshev coefficients of the solutions."""
        return np.ascontiguousarray((self._followed.solutions[:, :, :COUNT] @ TO_COEFFICIENTS.T).swapaxes(1, 2))

    def along(self, halves: NDArray[np.int64], w: Array, v: Array, *, whole: bool = True) -> ChangesAlong:
        """Return the changes of states at march variables w on halves with given numbers; unless ``whole``, those of
        places and times only.
        """
        found, states = np.empty((ORIGIN_ROWS, self.variables, w.size)), np.empty((5, w.size))
        rows = self._series.shape[2] if whole else self.variables
        laid, origins = self._followed.laid, self._followed.origins
        fill_along(laid, self._series, origins, halves, np.array([w, v * v]), rows, found, states)
        return ChangesAlong(found, states)

    def states(self, along: ChangesAlong, law: Array, v: Array) -> Array:
        """Return the changes of states at given times (`chain.fill_states`), given the law and the velocities there."""
        path = self.law.path(*along.states[:2])
        found = np.empty((STATE_ROWS, self.variables, v.size))
        fill_states(along.changes, law, path.rows, v, found)
        launch = self._problem.launch
        at_cusp = (law[0] == 0.0) & (v == 0.0) & (along.states[0] == launch.lam0.value)
        # The change of the speed does not follow from ds/dlam and dW/dlam, which vanish there.
        found[SPEED_ROW, :, at_cusp] = 0.0
        found[SPEED_ROW, -1, at_cusp] = launch.direction
        return found
