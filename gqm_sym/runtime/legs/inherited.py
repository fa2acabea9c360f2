"""The errors with which the legs of a motion with losses begin, each found from the errors before it."""

from contextlib import suppress
from functools import lru_cache
from math import inf, isnan

import numpy as np

from gqm_sym.errors import SolutionError
from gqm_sym.runtime.arithmetic.doubledouble import ULP
from gqm_sym.runtime.charts.chart import Chart
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.legs.advance import END_REST
from gqm_sym.runtime.legs.driver import Driver
from gqm_sym.runtime.legs.frames.local_frame import Frame, error_of_chart
from gqm_sym.runtime.legs.leg_errors import Errors, carry, rounding_share
from gqm_sym.runtime.legs.leg_record import INHERITED, TIME_FROM_END, TIME_FROM_START
from gqm_sym.runtime.legs.leg_segments import Run
from gqm_sym.runtime.legs.runs.ends import END_ASYMPTOTE, END_LIMIT, END_TURN
from gqm_sym.runtime.legs.variations.law import FormulaLaw
from gqm_sym.runtime.motion.trajectory import TimedSegment

NO_CHARTS: Array = np.empty((0, 0))


def _known(errors: tuple[float, float, float]) -> Errors:
    """Return bounds of errors, with infinity in place of NaN."""
    return Errors(*(inf if isnan(error) else error for error in errors))


@lru_cache(maxsize=2)
def _changed(chart: Chart, values: tuple[float, ...]) -> Array:
    """Return values with charts that are changed by their possible errors, as rows; a chart in space may take 20 MB."""
    return chart.rounded(values)


def _changed_charts(problem: Problem) -> Array:
    """Return the run-time parameters with charts that are changed by their possible errors, as rows."""
    if problem.formulas.chart is None:
        return NO_CHARTS
    return _changed(problem.formulas.charted(problem.p), tuple(problem.p.values.tolist()))


def _law_of(problem: Problem) -> FormulaLaw | None:
    """Return the law of motion, if there is a bound on the rounding of its force: not without formulas, or with very
    long ones.
    """
    with suppress(SolutionError):
        law = FormulaLaw(problem)
        if law.force is not None:
            return law
    return None


class InheritedErrors:
    """The errors with which legs begin, computed as far as required.

    Parameters
    ----------
    driver : Driver
        The body.
    runs : list of Run
        Its runs with panels; further ones may be appended.
    """

    def __init__(self, driver: Driver, runs: list[Run]) -> None:
        self._driver, self._runs = driver, runs
        self._errors = [self._at_launch()]
        self._law = _law_of(driver.problem)
        self._charts = _changed_charts(driver.problem)
        self._frame: tuple[Frame, float, float] | None = None

    def before(self, timed: TimedSegment, phi: Array) -> tuple[float, Array]:
        """Return bounds of the errors inherited by a timed segment: those of its place, and of the times at phase
        angles.
        """
        while len(self._errors) <= timed.leg + 1:
            self._errors.append(self._carried(len(self._errors) - 1))
        run, (before, after) = self._runs[timed.leg], self._errors[timed.leg : timed.leg + 2]
        if timed.segment.v2 is not None:  # the approach to an equilibrium
            return after.place, np.full_like(phi, after.time)
        of_frame = 0.0 if run.frame is None else self._errors_of(run.frame)[0]
        is_last = timed.leg == len(self._runs) - 1 and not len(self._driver.runs)
        swing = 2.0 * self._driver.last_swing if is_last else 0.0
        if swing and run.what != END_ASYMPTOTE:
            # The error of so small a V**2 may be below the range of doubles, but the body stays where it is.
            return before.place + of_frame + swing, np.zeros_like(phi)
        panels = run.panels_ahead if timed.sense > 0 else run.panels_back
        which = np.searchsorted(timed.segment.edges[1:-1], phi, side="right")
        inherited = panels[which, INHERITED]
        if timed.sense > 0:
            return before.place + of_frame + swing, before.time + inherited + self._time_error_of_force(run)
        return after.place + of_frame + swing, after.time + after.place * inherited

    def _at_launch(self) -> Errors:
        problem, known = self._driver.problem, self._driver.launch_error
        lam0, v0 = problem.launch[:2]
        return Errors(abs(lam0.low) if known is None else known, 2.0 * v0.value * abs(v0.low) + ULP * problem.w0, 0.0)

    def _time_error_of_force(self, run: Run) -> float:
        """Return the effect of the error of the force on the time in which a body departs from an equilibrium."""
        if run.frame is None or run.frame.is_stable:
            return 0.0
        return self._driver.force_error * float(run.record[TIME_FROM_START] + run.record[TIME_FROM_END])

    def _carried(self, leg: int) -> Errors:
        """Return the errors at the end of a leg, given those with which it begins; in a frame they are errors of
        distances.
        """
        run, before, driver = self._runs[leg], self._errors[leg], self._driver
        frame, turns = run.frame, run.what in (END_TURN, END_REST)
        share = rounding_share(driver.dissipation.linear)
        if frame is None:
            p = driver.problem.functions.p
            terms = self._law.force_errors_on(run, share) if self._law is not None else np.zeros(run.ahead + run.back)
            return _known(carry(driver.dissipation, p, turns, before, share, terms, self._charts, run.record))
        of_place, of_force = self._errors_of(frame)
        if leg == 0 or self._runs[leg - 1].frame is None:
            before = before._replace(place=before.place + of_place)
        frame.move(run.record, -1)
        terms = np.zeros(run.ahead + run.back)
        share += of_force + (0.0 if frame.is_stable else driver.force_error)
        after = _known(carry(frame.dissipation, frame.p, turns, before, share, terms, NO_CHARTS, run.record))
        after = after._replace(time=after.time + self._time_error_of_force(run))
        frame.move(run.record, 1)
        is_last = run.what == END_LIMIT or frame.dissipation.friction
        return after._replace(place=after.place + of_place) if is_last else after

    def _errors_of(self, frame: Frame) -> tuple[float, float]:
        """Return the error of the place of a frame's equilibrium, and the relative error of the force there due to the
        chart.
        """
        if self._frame is None or self._frame[0] is not frame:
            charts = NO_CHARTS if frame.is_sharp else self._charts
            self._frame = (frame, *error_of_chart(frame, self._driver.dissipation, charts))
        return self._frame[1:]
