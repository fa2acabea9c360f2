"""Changes of a motion with losses from leg to leg: of its turning points, their times, and its states between them.

Here y, sigma and ``delay`` are the changes of W, of the place and of the time at a given distance from a moving origin
(`equation`). At a given place W changes by ``y - F sigma``, and the time by ``delay - v sigma ds/V`` with v =
sgn(dlam/dt). Both halves of a leg must agree on these in the middle, which determines the change of the turn at the
end. A body that is thrown slowly and speeds up is followed from the place at which it would have been at rest, so that
nothing is divided by its speed.
"""

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gqm_sym.errors import SolutionError
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.legs.leg_record import END, HEADING, MIDDLE, START, START_V2
from gqm_sym.runtime.legs.leg_segments import Run
from gqm_sym.runtime.legs.runs.ends import ASYMPTOTE
from gqm_sym.runtime.legs.variations.chart_law import law_of
from gqm_sym.runtime.legs.variations.equation import Panels
from gqm_sym.runtime.legs.variations.law import LawRows, States, one_state


class Origin(NamedTuple):
    """The changes of the beginning of a half of a leg; each field has a number, or a row, for each variable.

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


class Along(NamedTuple):
    """The changes of some states: a row for each variable.

    Attributes
    ----------
    sigma, y, delay, arc : arrays
        As in `Origin`, at given distances from the origin, with ``y`` as a share of V**2.
    places : (array, array)
        The places as two doubles each.
    heading, contact_sign : arrays
        The signs of dlam/dt and of N.
    """

    sigma: Array
    y: Array
    delay: Array
    arc: Array
    places: tuple[Array, Array]
    heading: Array
    contact_sign: Array


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
        self.followed, self.runs = len(runs), [run for run in runs if run.what != ASYMPTOTE]
        counts = [(run.ahead, run.back) for run in self.runs]
        halves = [(k, is_back) for k, count in enumerate(counts) for is_back in (False, True) if count[is_back]]
        self._where = {half: i for i, half in enumerate(halves)}
        self.panels = Panels([(self.runs[k], is_back) for k, is_back in halves])
        self._origins: list[Origin] = []
        self.ends: list[Origin] = []
        self._follow()
        self._stacked = np.array(self._origins).transpose(1, 2, 0)

    @property
    def variables(self) -> int:
        """The number of variables."""
        return self.law.count + 2

    def _marks(self, marks: Sequence[tuple[int, list[float], bool]]) -> States:
        """Return places of the records of all runs, each with V**2 there and whether it is on the last half."""
        places = np.array([run.pair(at) for at, _, _ in marks for run in self.runs]).T
        heading = np.array([run.record[HEADING] for run in self.runs] * len(marks))
        v2 = np.concatenate([speeds for _, speeds, _ in marks])
        first = [
            self._half(k, run.back > 0 if is_back else run.ahead == 0)[0]
            for _, _, is_back in marks
            for k, run in enumerate(self.runs)
        ]
        return States(places[0], places[1], v2, heading, self.panels.contact_sign[first])

    def _half(self, run: int, is_back: bool) -> tuple[int, int]:
        """Return the index of the first panel of a half of run k, and the index after its last panel."""
        k = self._where[run, is_back]
        return self.panels.first[k], self.panels.first[k + 1]

    def _mixed(self, origin: Origin, rows: Array) -> Array:
        """Return the sum of solutions (`equation`) for each variable."""
        n = self.law.count
        found: Array = origin.sigma * rows[n] + origin.y * rows[n + 1]
        found[:n] += rows[:n]
        return found

    def by_all(self, rows: Array) -> Array:
        """Extend derivatives by the run-time parameters to derivatives by all variables, where the others are zero."""
        return np.concatenate([rows, np.zeros((2, *rows.shape[1:]))])

    def _follow(self) -> None:
        runs, panels = self.runs, self.panels
        speeds = panels.end_speeds
        start_v2 = [float(run.record[START_V2]) for run in runs]
        # If there are no panels from the start, the start is the middle.
        middle = [
            float(speeds[self._half(k, False)[1] - 1]) if run.ahead else start_v2[k] ** 0.5
            for k, run in enumerate(runs)
        ]
        middle_v2, zeros = [v**2 for v in middle], [0.0] * len(runs)
        marks = self._marks([(START, start_v2, False), (END, zeros, True), (MIDDLE, middle_v2, False)])
        # One call evaluates the law at the marks and at the nodes of all panels.
        rows = self.law.rows(States(*map(np.concatenate, zip(marks, panels.nodes, strict=True))))
        count = len(runs)
        starts, ends, middles = (rows.part(k * count, (k + 1) * count) for k in range(3))
        panels.solve(rows.part(3 * count, None), self.breaks)
        laps, zero, origin = 0, np.zeros(self.variables), self._launched(starts)
        for k, run in enumerate(runs):
            v = float(run.record[HEADING])
            folded = (run.laps - laps) * self.lap
            laps = run.laps
            origin = origin._replace(sigma=origin.sigma - folded, arc=origin.arc + starts.ds[k] * folded)
            if run.ahead:
                if k and not runs[k - 1].back:  # the run begins at the end of the last one
                    jump = panels.jump(self._half(k - 1, False)[1] - 1, self._half(k, False)[0], 0)
                    origin = origin._replace(y=origin.y + jump * origin.sigma)
                if start_v2[k] > 0.0 and np.isfinite(run.half_c):
                    moved = -origin.y / starts.slope[k]
                    later = origin.delay + v * starts.ds[k] * moved / start_v2[k] ** 0.5
                    origin = Origin(origin.sigma + moved, zero, later, origin.arc)
                self._origins.append(origin)
                last = self._half(k, False)[1] - 1
                origin = Origin(
                    origin.sigma,
                    self._mixed(origin, panels.ends[:, last]),
                    origin.delay + self._mixed(origin, panels.times[:, last, -1]),
                    origin.arc + self.by_all(panels.arcs[:, last, -1]),
                )
            if run.back:
                # The end moves with the middle, and in addition by the amount for which both halves agree in the
                # middle.
                last = self._half(k, True)[1] - 1
                still = origin._replace(y=zero)
                more = self._mixed(still, panels.ends[:, last]) - origin.y
                if run.ahead:
                    more -= panels.jump(self._half(k, False)[1] - 1, last, 1) * origin.sigma
                more /= ends.slope[k] * panels.ends[-1, last]
                still = still._replace(sigma=origin.sigma + more)
                delay = (
                    origin.delay + self._mixed(still, panels.times[:, last, -1]) + v * middles.ds[k] * more / middle[k]
                )
                arc = origin.arc - self.by_all(panels.arcs[:, last, -1])
                origin = Origin(still.sigma, zero, delay, arc)
                self._origins.append(origin)
            self.ends.append(origin)

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

    @property
    def lap(self) -> Array:
        """The derivatives of the period of the curve's parameter."""
        lap: Array = self.ranges[2]
        return lap

    def at_end(self, k: int) -> tuple[States, float]:
        """Return the state at the end of the k-th run, and the speed there."""
        run, last = self.runs[k], self._half(k, False)[1] - 1
        speed = float(self.panels.end_speeds[last])
        sign = float(self.panels.contact_sign[last])
        return one_state(run.pair(END), speed**2, float(run.record[HEADING]), sign), speed

    def _launched(self, starts: LawRows) -> Origin:
        """Return the changes of the launch."""
        n, launch = self.law.count, self._problem.launch
        sigma, y, delay, arc = np.zeros((4, n + 2))
        sigma += self.law.launch_moves
        arc -= starts.ds[0] * sigma
        y[n + 1] = 2.0 * launch.v0.value
        if launch.v0.value == 0.0:
            heading = float(self.runs[0].record[HEADING])
            slope = starts.slope[0]
            if launch.direction == heading:
                delay[n + 1] = -2.0 * starts.ds[0] / abs(slope)
            else:  # a body thrown the other way comes back with little less speed
                contact_sign = float(self.panels.contact_sign[0])
                upwards = self.law.rows(one_state(self.runs[0].pair(START), 0.0, -heading, contact_sign)).slope[0]
                delay[n + 1] = 2.0 * starts.ds[0] / abs(upwards)
        return Origin(sigma, y, delay, arc)

    def told(self, sigma: Array, arc: Array, laps: Array | float) -> Array:
        """Return the change of a place in the curve's parameter, from the changes of its label and of the arc length to
        it (`Origin`).
        """
        if not self.law.by_arc_length:
            changed: Array = sigma + laps * self.lap.reshape(-1, *[1] * (sigma.ndim - 1))
            return changed
        changed = sigma + arc
        changed[self.law.count] += 1.0  # the change of the launch place itself, from the start point
        return changed

    def half(self, leg: int, is_back: bool) -> int:
        """Return the number of a half of the run with a given number.

        Raises
        ------
        SolutionError
            If the run tends to an equilibrium.
        """
        if (leg, is_back) not in self._where:
            raise SolutionError(
                "sensitivity: there is none yet where a motion tends to an equilibrium; ask for earlier times"
            )
        return self._where[leg, is_back]

    def along(self, half: NDArray[np.intp], w: Array) -> Along:
        """Return the changes of states at march variables on halves with given numbers."""
        panels = self.panels
        k = panels.panel_at(half, w)
        shares, times, arcs = panels.at(k, w)
        origin = Origin(*self._stacked[:, :, half])
        v = panels.heading[k]
        return Along(
            sigma=origin.sigma,
            y=self._mixed(origin, shares),
            delay=origin.delay + v * panels.u[k] * self._mixed(origin, times),
            arc=origin.arc + self.by_all(arcs),
            places=panels.places(k, w),
            heading=v,
            contact_sign=panels.contact_sign[k],
        )

    def delays(self, half: NDArray[np.intp], w: Array) -> tuple[Array, Array, Array]:
        """Return the places of `along` as doubles, and the changes of places and times."""
        panels = self.panels
        k = panels.panel_at(half, w)
        origin = Origin(*self._stacked[:, :, half])
        delay = origin.delay + panels.heading[k] * panels.u[k] * self._mixed(origin, panels.times_at(k, w))
        return panels.places(k, w)[0], origin.sigma, delay
