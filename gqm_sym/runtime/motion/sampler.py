"""Sampling of periodic motions: times in, places or states out, one crossing into compiled code a call."""

from collections.abc import Callable
from typing import Any

import numpy as np

from gqm_sym.runtime.arithmetic.doubledouble import Pair, two_product
from gqm_sym.runtime.compiled.threads import run_in_threads
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.inversion import records
from gqm_sym.runtime.inversion.fourier import fit_wave
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.motion.trajectory import Trajectory
from gqm_sym.runtime.quadrature.substitution import TURN_TURN

# Times a thread is worth starting for.
PLACES, STATES = 2**16, 2**12

# Counts of periods beyond which times are reduced one by one.
MOST_PERIODS = 2.0**50
ROWS = 9


def plain_time(t: Any) -> float | None:
    """A time that is a double as it stands; None for any other."""
    if type(t) is float:
        return t
    return float(t) if type(t) is int and abs(t) < 2**53 else None


def plain_times(t: Any) -> tuple[Array, float, float] | None:
    """Times that are doubles as they stand, the least and the greatest; None where they need reading."""
    if isinstance(t, np.ndarray) and t.dtype == np.float64 and t.size:
        flat = np.ascontiguousarray(t).reshape(-1)
        return flat, float(flat.min()), float(flat.max())
    return None


class Sampler:
    """Where one periodic motion is.

    Attributes
    ----------
    course : Course
        Whose times it goes by.
    reach : float
        Times this far from launch either way are reduced to rounding.
    """

    def __init__(
        self, problem: Problem, course: Trajectory, phase: Pair, direction: int, drift: Callable[[], Pair]
    ) -> None:
        assert course.period is not None
        stretch = course.pieces[0].stretch
        self.course = course
        self.reach = MOST_PERIODS * course.period[0]
        self._problem, self._stretch = problem, stretch
        there_and_back = stretch.kind == TURN_TURN
        way = direction if there_and_back else 1
        start, start_low = way * phase[0], way * phase[1]
        ends = (stretch.a, stretch.b, problem.lam0, course.lap)
        self._v0, self._drift = direction * problem.launch.v0.value, drift
        self._sections = {
            records.FUNCTIONS: np.array([*problem.functions.addresses, stretch.kind], dtype=np.int64),
            records.WAVE: np.array([*course.period, *_inverse(course.period), start, start_low, *ends]),
            records.CLOCK: np.array([*course.period, start, start_low, *stretch.whole, stretch.stop, course.pace]),
        }
        f = problem.functions
        if not f.between(f.breaks, stretch.a, stretch.b).size:
            series = fit_wave(stretch.edges, *stretch.clock, stretch.panels[3], there_and_back)
            self._sections[records.COSINES], self._sections[records.SINES] = series
        if not len(self._sections.get(records.COSINES, ())):
            self._tabulate()
        self._short = records.record(self._sections)
        self._whole: Array | None = None

    def _tabulate(self) -> None:
        names = (records.MIDDLES, records.LOWS, records.SCALES, records.POWERS, records.INDEX, records.ENDS)
        self._sections.update(zip(names, self._stretch.table[:6], strict=True))

    @property
    def _record(self) -> Array:
        """All that is known, for states; places take less."""
        if self._whole is None:
            self._tabulate()
            stretch, panels, problem = self._stretch, self._stretch.panels, self._problem
            lengths = self.course.lap_length, problem.arc_origin, self.course.pieces[0].s_a
            segments = stretch.table[3]
            owners = np.clip(np.searchsorted(stretch.edges, segments[:, 0], side="right") - 1, 0, len(panels[2]) - 2)
            middles = 0.5 * (stretch.edges[1:] + stretch.edges[:-1])
            self._sections |= {
                records.LAUNCH: np.array([problem.lam0, self._v0, *lengths, *self._drift()], dtype=np.float64),
                records.SHAPE: np.array([stretch.a, stretch.b, stretch.ref, stretch.w, stretch.spread]),
                records.EDGES: panels[0],
                records.LENGTHS: panels[2],
                records.ARCS: panels[4],
                records.TIME_ERRORS: stretch.clock_error(middles),
                records.TABLE_ERRORS: stretch.inversion_error(segments.sum(axis=1)),
                records.OWNERS: owners.astype(np.int64),
            }
            self._whole = records.record(self._sections)
        return self._whole

    def place(self, t: float) -> float:
        """The curve's parameter at one time."""
        place: float = records.place_at_time(self._short, t)
        return place

    def places(self, t: Array) -> Array:
        """The curve's parameter at times."""
        out = np.empty_like(t)
        run_in_threads(lambda part: records.places_along(self._short, t, out, part.start, part.stop), t.size, PLACES)
        return out

    def state(self, t: float) -> tuple[float, ...]:
        """The time, and as `states` has it: what there is to say of it."""
        row = list(records.state_at_time(self._record, self._problem.functions.p, t))
        if self._problem.formulas.chart is not None:
            row[2] = row[1]
        return tuple(row)

    def states(self, t: Array) -> Array:
        """Rows of lam, s, x, z, v, v**2, kappa, normal force and error of lam at times."""
        record, p, out = self._record, self._problem.functions.p, np.empty((ROWS, t.size))
        run_in_threads(lambda part: records.states_along(record, p, t, out, part.start, part.stop), t.size, STATES)
        if self._problem.formulas.chart is not None:
            out[1] = out[0]  # a chart's parameter is its arc length
        return out


def _inverse(period: Pair) -> Pair:
    """One over a period, as two doubles."""
    inverse = 1.0 / period[0]
    product, rest = two_product.py_func(inverse, period[0])
    return inverse, -((product - 1.0) + rest + inverse * period[1]) * inverse
