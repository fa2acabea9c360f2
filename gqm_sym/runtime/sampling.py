"""Sampling of periodic motions: times in, places or states out, one crossing into compiled code a call."""

from typing import Any

import numpy as np

from gqm_sym.runtime.course import Course, Pair
from gqm_sym.runtime.doubledouble import two_product
from gqm_sym.runtime.exact import SMOOTH_PANELS
from gqm_sym.runtime.orbits import places_along, states_along
from gqm_sym.runtime.panels import TURN_TURN
from gqm_sym.runtime.problem import Problem
from gqm_sym.runtime.stretch import Array
from gqm_sym.runtime.threads import spread
from gqm_sym.runtime.waves import fit_wave, sum_wave

# Times a thread is worth starting for.
PLACES, STATES = 2**16, 2**12
# Counts of periods beyond which times are reduced one by one.
MOST_PERIODS = 2.0**50
ROWS = 9


def plain_times(t: Any) -> tuple[Array, float, float] | None:
    """Times that are doubles as they stand, the least and the greatest; None where they need reading."""
    if type(t) is float:
        return np.array((t,)), t, t
    if isinstance(t, np.ndarray) and t.dtype == np.float64 and t.size:
        flat = np.ascontiguousarray(t).reshape(-1)
        return flat, float(flat.min()), float(flat.max())
    if type(t) is int and abs(t) < 2**53:
        return np.array((float(t),)), float(t), float(t)
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
        self, problem: Problem, course: Course, phase: Pair, direction: int, clock_error: tuple[float, float]
    ) -> None:
        assert course.period is not None
        stretch = course.pieces[0].stretch
        self.course = course
        self.reach = MOST_PERIODS * course.period[0]
        self._problem, self._stretch = problem, stretch
        v0, s_a = direction * problem.launch.v0.value, course.pieces[0].s_a
        self._launch = np.array([problem.lam0, v0, course.lap_length, problem.arc_origin, s_a, *clock_error])
        there_and_back = stretch.kind == TURN_TURN
        way = direction if there_and_back else 1
        start, start_low = way * phase[0], way * phase[1]
        if len(stretch.edges) - 1 > SMOOTH_PANELS:
            self._cosines = self._sines = np.empty(0)
        else:
            self._cosines, self._sines = fit_wave(stretch.edges, *stretch.clock, stretch.panels[3], there_and_back)
        self._dial = np.array(
            [
                *course.period,
                *_inverse(course.period),
                *(start, start_low, stretch.a, stretch.b, problem.lam0, course.lap),
            ]
        )
        self._clock = np.array([*course.period, start, start_low, *stretch.whole, stretch.stop, course.pace])

    def places(self, t: Array) -> Array:
        """The curve's parameter at times."""
        out = np.empty_like(t)
        if self._cosines.size:
            spread(
                lambda part: sum_wave(self._dial, self._cosines, self._sines, t, out, part.start, part.stop),
                t.size,
                PLACES,
            )
            return out
        s, lap, lam0 = self._stretch, self.course.lap, self._problem.lam0
        table = s.table[:6]
        spread(
            lambda part: places_along(s.kind, s.a, s.b, lam0, lap, self._clock, table, t[part], out[part]),
            t.size,
            PLACES,
        )
        return out

    def states(self, t: Array) -> Array:
        """Rows of lam, s, x, z, v, v**2, kappa, normal force and error of lam at times."""
        stretch, problem = self._stretch, self._problem
        f, panels = problem.functions, stretch.panels
        table, arcs = stretch.table[:6], (panels[0], panels[2], panels[4])
        shape = (stretch.a, stretch.b, stretch.ref, stretch.w, stretch.spread)
        reaches = stretch.table[3].sum(axis=1)
        middles = 0.5 * (stretch.edges[1:] + stretch.edges[:-1])
        errors = (stretch.clock_error(middles), reaches, stretch.inversion_error(reaches))
        out = np.empty((ROWS, t.size))
        out[0] = self.places(t)

        def along(part: slice) -> None:
            states_along(
                f.addresses,
                f.p,
                stretch.kind,
                shape,
                self._launch,
                self._clock,
                table,
                arcs,
                errors,
                t,
                part.start,
                part.stop,
                out,
            )

        spread(along, t.size, STATES)
        if problem.formulas.chart is not None:
            out[1] = out[0]  # a chart's parameter is its arc length
        return out


def _inverse(period: Pair) -> Pair:
    """One over a period, as two doubles."""
    inverse = 1.0 / period[0]
    product, rest = two_product.py_func(inverse, period[0])
    return inverse, -((product - 1.0) + rest + inverse * period[1]) * inverse
