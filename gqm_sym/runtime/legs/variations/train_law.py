"""The law of a train without losses, whose places are the labels of `gradients.charts.trains`."""

import numpy as np

from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.gradients.charts.trains import changes_of
from gqm_sym.runtime.gradients.orbit import without_formulas
from gqm_sym.runtime.gradients.path import PRODUCT, PathRows, squared_force
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.legs.panels.point import LEAST_V2
from gqm_sym.runtime.legs.variations.law import Law

# The steps of difference quotients by the place, in m, and by V**2, as shares of these where they are large; and how
# many of each step the points are away, the point itself first.
DIFFERENCE_STEP, DIFFERENCES = 2.0**-18, ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1))


class TrainLaw(Law):
    """The law of a train.

    Parameters
    ----------
    problem : Problem
        The launch on the curve of the means of the train.
    """

    by_arc_length = True

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem)
        self._changes, self._launch = changes_of(problem), problem.lam0

    @property
    def launch_changes(self) -> Array:
        """See `Law`."""
        return np.append(-self._changes.strains * self._launch, [1.0, 0.0])

    @property
    def ranges(self) -> Array:
        """See `Law`."""
        return np.vstack([self._changes.ranges, np.zeros(self.count)])

    def coordinates(self, states: Array) -> Array:
        """See `Law`."""
        return states[:2]

    def matrix(self, states: Array) -> Array:
        """See `Law`."""
        _, slopes, bends = self._changes.at(states[0])
        still = np.zeros(states.shape[1])
        strains = np.broadcast_to(self._changes.strains[:, None], slopes[1:].shape)
        matrix: Array = np.vstack(
            [still + 1.0, still, strains, -2.0 * slopes[0], -2.0 * bends[0], still, -2.0 * slopes[1:]]
        )
        return matrix

    def loads(self, states: Array) -> Array:
        """See `Law`. The derivatives are difference quotients, from which only Newton's method takes its steps."""
        s, _, w = states[:3]
        step, faster = DIFFERENCE_STEP * np.maximum(np.abs(s), 1.0), DIFFERENCE_STEP * np.maximum(w, 1.0)
        slopes = [self._load_slope(s + i * step, w + j * faster, states) for i, j in DIFFERENCES]
        here, after, before, fast, slow = slopes
        return np.stack([here, 0.5 * (after - before) / step, 0.5 * (fast - slow) / faster])

    def _load_slope(self, s: Array, w: Array, states: Array) -> Array:
        """Return the slope of the contact force per mass along the motion, of a body at the middle of the train."""
        path, slope = self._changes.path(s), -2.0 * self._changes.at(s)[1, 0]
        mass = self.parameters[0, self.mass]
        if len(path.rows) <= PRODUCT:
            along: Array = (path.curvature[-1] * w + path.load[-1] + path.curvature[0] * slope) / mass
            return along
        v = states[3] * np.sqrt(np.maximum(w, LEAST_V2))
        force = squared_force(path, v, v * v)
        half_change = force.half_change(path.rows)[-1] + 0.5 * (force.even + force.odd / v) * slope
        of_length: Array = half_change / (mass * np.sqrt(force.square))
        return of_length

    def sided(self, state: Array) -> Array:
        """See `Law`; a train does not leave its track."""
        raise without_formulas()

    def path(self, high: Array, low: Array) -> PathRows:
        """See `Law`."""
        return self._changes.path(high)
