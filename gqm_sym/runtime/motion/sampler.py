"""Places and states of a periodic motion at many times, with one call of compiled code."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any

import numpy as np

from gqm_sym.literals.numbers import doubles_at_once, flat_doubles
from gqm_sym.runtime.arithmetic.doubledouble import Pair, two_product
from gqm_sym.runtime.compiled.threads import run_in_threads
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.inversion import records
from gqm_sym.runtime.inversion.fourier import fit_wave
from gqm_sym.runtime.inversion.table import TERMS
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.motion.locking import locked
from gqm_sym.runtime.motion.segments import errors
from gqm_sym.runtime.motion.timing import Timing
from gqm_sym.runtime.motion.trajectory import Repeated
from gqm_sym.runtime.quadrature.substitution import TURN_TURN

# The smallest numbers of times for which another thread is started.
MIN_PLACES_PER_THREAD, MIN_STATES_PER_THREAD = 2**16, 2**12

# The largest number of periods after which compiled code reduces times exactly; later times are reduced one by one.
MAX_PERIODS = 2.0**50

# The powers of -1, which is the variable of the table's polynomials at the start of an interval.
ALTERNATING = (-1.0) ** np.arange(TERMS)

# The number of fields of a state other than the time, and with the place within the lap, which states in space need.
STATE_ROWS, STATE_ROWS_IN_SPACE = 9, 10

# The number of rows of `records.phases_along`.
PHASE_ROWS = 6


def plain_time(t: Any) -> float | None:
    """Return a time that is a double or equal to one; None for any other time."""
    if type(t) is float:
        return t
    if type(t) is np.float64 or (isinstance(t, np.ndarray) and t.ndim == 0 and t.dtype == np.float64):
        return float(t)
    return float(t) if type(t) is int and abs(t) < 2**53 else None


def plain_times(t: Any) -> tuple[Array, float, float] | None:
    """Return times that are doubles, with the smallest and the largest; None if they must be read one by one."""
    times = doubles_at_once(t)
    if times is None or not times.size or not times.ndim:
        return None
    return flat_doubles(times).reshape(times.shape), float(times.min()), float(times.max())


class Sampler:
    """The places and states of one periodic motion.

    ``of_states`` gives the numbers that only states need: the length of a lap, the arc length at launch, and that of
    the segment's end ``a`` from there; the error of the time at launch, and its growth with time.

    Attributes
    ----------
    min_time, max_time : float
        The sampler serves times whose distance in s from launch, later or earlier, is above the first number and at
        most the second.
    """

    def __init__(
        self,
        problem: Problem,
        repeated: Repeated,
        times: Timing,
        span: Pair,
        direction: int,
        of_states: Callable[[], tuple[float, ...]],
        lock: AbstractContextManager[Any],
    ) -> None:
        segment, period, lap, time_scale_error = repeated
        self.min_time, self.max_time = span[0], min(MAX_PERIODS * period[0], span[1])
        self._problem, self._segment = problem, segment
        there_and_back = segment.kind == TURN_TURN
        sign = direction if there_and_back else 1
        start, start_low = sign * times.phase_time[0], sign * times.phase_time[1]
        ends = (segment.a, segment.b, problem.lam0, lap)
        self._v0, self._of_states = direction * problem.launch.v0.value, of_states
        own_times = (*segment.total_time, segment.stop, time_scale_error)
        self._timing = (*period, start, start_low, *own_times)
        self._sections = {records.WAVE: np.array([*period, *_inverse(period), start, start_low, *ends])}
        f = problem.functions
        if not f.between(f.breaks, segment.a, segment.b).size:
            series = fit_wave(segment.edges, *segment.edge_times, segment.panels[3], there_and_back)
            self._sections[records.COSINES], self._sections[records.SINES] = series
        if not len(self._sections.get(records.COSINES, ())):
            self._tabulate()
        self._lock = lock
        self._place_record: Array | None = None
        self._state_record: Array | None = None

    def _tabulate(self) -> None:
        """Add the table, and what it is read with."""
        segment, names = self._segment, range(records.MIDDLES, records.ENDS + 1)
        self._sections.update(zip(names, segment.table[:6], strict=True))
        functions = (*self._problem.functions.addresses, segment.kind)
        self._sections[records.FUNCTIONS] = np.array(functions, dtype=np.int64)
        self._sections[records.TIMING] = np.array(self._timing)

    @property
    def _record_of_places(self) -> Array:
        """The record for places; two threads may both make it."""
        if self._place_record is None:
            self._place_record = records.record(self._sections)
        return self._place_record

    @property
    def record(self) -> Array:
        """The record for states, which contains more than that for places."""
        return self._make_state_record() if self._state_record is None else self._state_record

    @locked
    def _make_state_record(self) -> Array:
        """Make the record for states, unless another thread has made it meanwhile."""
        if self._state_record is None:
            self._tabulate()
            segment, panels, problem = self._segment, self._segment.panels, self._problem
            intervals = segment.table[3]
            owners = np.searchsorted(segment.edges[1:-1], intervals[:, 0], side="right")
            # The part of the error that changes within an interval of the table is largest at one of its ends, where
            # the powers are those of -1 and 1.
            starts, stops = intervals @ ALTERNATING, intervals.sum(axis=1)
            starts[0] = segment.edges[0]  # the powers of the first interval are those of 0 and 1
            both_ends = np.concatenate([starts + 1e-9 * (stops - starts), stops])
            self._sections |= {
                records.LAUNCH: np.array([problem.lam0, self._v0, *self._of_states()], dtype=np.float64),
                records.SHAPE: np.array([segment.a, segment.b, segment.ref, segment.ref_v2, segment.width_ratio]),
                records.EDGES: panels[0],
                records.LENGTHS: panels[2],
                records.ARCS: panels[4],
                records.SPEEDS: np.empty(0) if segment.speed_terms is None else segment.speed_terms,
                records.TIME_ERRORS: errors.time_errors_of_panels(segment),
                records.TABLE_ERRORS: errors.inversion_error(segment, both_ends).reshape(2, -1).max(axis=0),
                records.OWNERS: owners.astype(np.int64),
            }
            self._state_record = records.record(self._sections)
        return self._state_record

    def place(self, t: float) -> float:
        """Return the curve parameter at one time."""
        place: float = records.place_at_time(self._record_of_places, t)
        return place

    def places(self, t: Array) -> Array:
        """Return the curve parameter at times."""
        record, out = self._record_of_places, np.empty_like(t)
        run_in_threads(
            lambda part: records.places_along(record, t, out, part.start, part.stop),
            t.size,
            MIN_PLACES_PER_THREAD,
        )
        return out

    def state(self, t: float) -> tuple[float, ...]:
        """Return the time, the items of a column of `states`, and the place within the lap."""
        row = list(records.state_at_time(self.record, self._problem.functions.p, t))
        if self._problem.formulas.chart is not None:
            row[2] = row[1]
        return tuple(row)

    def states(self, t: Array) -> Array:
        """Return rows of lam, s, x, z, v, v**2, kappa, normal force and error of lam at times, and in space of the
        place within the lap.
        """
        rows = STATE_ROWS if self._problem.formulas.path_in_space is None else STATE_ROWS_IN_SPACE
        record, p, out = self.record, self._problem.functions.p, np.empty((rows, t.size))
        run_in_threads(
            lambda part: records.states_along(record, p, t, out, part.start, part.stop), t.size, MIN_STATES_PER_THREAD
        )
        if self._problem.formulas.chart is not None:
            out[1] = out[0]  # the parameter of a chart is its arc length
        return out

    def phases(self, t: Array) -> Array:
        """Return the rows of `records.phases_along` at times."""
        out = np.empty((PHASE_ROWS, t.size))
        records.phases_along(self.record, self._problem.functions.p, t, out)
        return out


def _inverse(period: Pair) -> Pair:
    """Return the inverse of a period, as two doubles."""
    inverse = 1.0 / period[0]
    product, rounding = two_product.py_func(inverse, period[0])
    return inverse, -((product - 1.0) + rounding + inverse * period[1]) * inverse
