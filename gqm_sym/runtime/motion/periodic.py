"""Motions that repeat: libration between two turning points, and circulation round a closed curve."""

from collections.abc import Iterable
from functools import partial
from math import inf
from typing import Any

import numpy as np

from gqm_sym.errors import InputError, SolutionError
from gqm_sym.literals.namespaces import FLOATS
from gqm_sym.literals.numbers import read_number
from gqm_sym.runtime.arithmetic.doubledouble import ULP
from gqm_sym.runtime.charts.train import TrackOfTrain
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.gradients.charts.means import on_curve_of_means
from gqm_sym.runtime.gradients.charts.orbit import ChartOrbitDerivatives
from gqm_sym.runtime.gradients.charts.shaped_pieces import shaping_of
from gqm_sym.runtime.gradients.charts.train_orbits import TrainOrbitDerivatives
from gqm_sym.runtime.gradients.formula_orbit import FormulaOrbitDerivatives
from gqm_sym.runtime.gradients.one_orbit import period_gradient
from gqm_sym.runtime.gradients.orbit import OrbitDerivatives, requested_quantity, without_formulas
from gqm_sym.runtime.gradients.panels import UNDECIDED
from gqm_sym.runtime.gradients.passages.arrival import arrival_slopes
from gqm_sym.runtime.gradients.quantities import PERIODS, gradient, second_gradient, selected
from gqm_sym.runtime.gradients.sensitivity import OrbitSensitivity, Sensitivity, points_of
from gqm_sym.runtime.gradients.spectrum import Fourier, fourier
from gqm_sym.runtime.interface import ExactFormulas
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.motion import timing
from gqm_sym.runtime.motion.events import Event
from gqm_sym.runtime.motion.locking import computed_once, lock_of, locked
from gqm_sym.runtime.motion.periodic_times import PeriodicTimes, Times
from gqm_sym.runtime.motion.rows import Rows
from gqm_sym.runtime.motion.sampler import Sampler, plain_time, plain_times
from gqm_sym.runtime.motion.state import State
from gqm_sym.runtime.multiprecision.exact_problem import NOWHERE

# The largest difference between a turning point and the rounded end of the segment, as a share of the turning point's
# value.
MAX_TURN_ROUNDING = 1e-14

# The smallest distance between two edges of a chart, as a share of the phase; closer ones are the same edge.
MIN_PANEL = 1e-13

# The largest number of events that `events_between` lists.
MAX_EVENTS = 1_000_000


class PeriodicMotion(PeriodicTimes):
    """A libration or a circulation: one segment that is repeated for ever.

    Parameters
    ----------
    problem : Problem
        The launch with its module.
    kind : {"libration", "circulation"}
        The kind of motion.
    direction : int
        The sign of ds/dt after launch.
    segment : Segment or callable
        The segment from one turning point to the other, or a lap from the launch; or what makes it when it is needed.
    offsets : (float, float)
        The distances of a libration's lower and upper end from the launch, in units of the curve parameter.
    """

    _sampler: Sampler | None = None

    # The last sampler of sensitivities, and the phase angle of the launch by its times.
    _sampled: tuple[Sampler, float] | None = None

    @computed_once
    def _derivatives(self) -> OrbitDerivatives:
        """The orbit with its derivatives."""
        direction = self.direction if self.kind == "circulation" else 0
        if self.problem.formulas.chart is not None:
            return self._derivatives_along_chart(direction)
        segment = self._segment  # its panels, which are laid when edges are read, are needed near a separatrix only
        return FormulaOrbitDerivatives(self.problem, self._orbit, direction, self._offsets, lambda: segment.edges)

    @computed_once
    def _derivatives_of_one_shape(self) -> OrbitDerivatives:
        """The orbit with its derivatives but for those with respect to what shapes the curve, which may be dear."""
        if self.problem.formulas.chart is None or not shaping_of(self._timed.formulas):
            return self._derivatives
        return self._derivatives_along_chart(self.direction if self.kind == "circulation" else 0, ())

    def _derivatives_by(self, rows: Iterable[int]) -> OrbitDerivatives:
        """Return the orbit with its derivatives with respect to some variables at least."""
        if self.problem.formulas.chart is None or set(shaping_of(self._timed.formulas)).intersection(rows):
            return self._derivatives
        return self._derivatives_of_one_shape

    @property
    def _timed(self) -> Problem:
        """The launch of the body that has the times of this motion along a chart, which for a train is another one."""
        is_train = isinstance(self.problem.formulas.chart, TrackOfTrain)
        return on_curve_of_means(self.problem) if is_train else self.problem

    def _derivatives_along_chart(self, direction: int, shaping: tuple[int, ...] | None = None) -> ChartOrbitDerivatives:
        segment, f, problem = self._segment, self.problem.functions, self._timed
        kind = ChartOrbitDerivatives if problem is self.problem else TrainOrbitDerivatives
        if problem.formulas.rolling_radius or problem.true_pieces is None or problem.tape is None:
            raise without_formulas()
        passage = timing.passage_of(problem, self.kind, self.direction, self._offsets)
        if passage is None:
            raise SolutionError(UNDECIDED)
        # The places where pieces of the chart meet; on a closed chart the first and the last edge are the same place.
        ends = segment.a, segment.b
        places = f.between(self.problem.formulas.charted(self.problem.p).edges, *ends)
        last, edges = 1.0, np.sort((places - ends[0]) / (ends[1] - ends[0]))
        if not direction:
            last, edges = np.pi, 2.0 * np.arctan2(np.sqrt(places - ends[0]), np.sqrt(ends[1] - places))
        edges = edges[np.diff(edges, prepend=0.0) > MIN_PANEL * last]
        return kind(problem, passage, direction, np.concatenate([[0.0], edges, [last]]), shaping)

    @computed_once
    def _orbit_sensitivity(self) -> OrbitSensitivity:
        return OrbitSensitivity(self._derivatives)

    @locked
    def _gradient(self, quantity: str, wrt: Any) -> dict[str, Any]:
        found = self._period_gradient(quantity, wrt) if quantity in PERIODS else None
        if found is not None:
            return found
        rows = selected(self.problem.formulas.parameters, wrt)
        return gradient(self._derivatives_by(rows.values()), self, quantity, wrt)

    def _period_gradient(self, quantity: str, wrt: Any) -> dict[str, float] | None:
        """Return the derivatives of a period along a curve with formulas; None where they take more than one call of
        compiled code.
        """
        swings, formulas, lam0 = self.kind == "libration", self.problem.formulas, self.problem.lam0
        if not isinstance(formulas.exact, ExactFormulas) or not (swings or quantity == "period"):
            return None
        rows = selected(formulas.parameters, wrt)
        span = lam0 - self._given_offsets[0], lam0 + self._given_offsets[1]
        found = period_gradient(self.problem, 0 if swings else self.direction, span, tuple(rows.values()))
        if found is None:
            return None
        shares = 2.0 * found if swings and quantity == "period" else found
        return dict(zip(rows, shares.tolist(), strict=True))

    @locked
    def _slopes_of_arrival(self, state: Any, wrt: Any) -> dict[str, Any] | None:
        if self.kind != "libration" or not isinstance(derivatives := self._derivatives, FormulaOrbitDerivatives):
            return None
        rows = selected(self.problem.formulas.parameters, wrt)
        if state.v == 0.0 or self._is_turn(state.lam):
            return None
        found = arrival_slopes(self, derivatives, state.lam, state.v)
        return None if found is None else {name: float(found[row]) for name, row in rows.items()}

    def _is_turn(self, place: float) -> bool:
        turns = self.turning_points if self.kind == "libration" else ()
        return any(abs(place - turn) <= ULP * abs(turn) for turn in turns)

    @locked
    def _second_gradient(self, quantity: str, wrt: Any) -> dict[str, dict[str, float]]:
        return second_gradient(self._derivatives_of_one_shape, self, quantity, wrt)

    @property
    @locked
    def action(self) -> float:
        """The integral of (1 + beta) V ds over one period, per mass, in m2/s."""
        with requested_quantity("action"):
            return self._derivatives_of_one_shape.action

    @property
    @locked
    def period_slope(self) -> float:
        """dT/dE, the derivative of the period with respect to the energy per mass, in s3/m2."""
        formulas = self.problem.formulas
        inertia = 1.0 if formulas.inertia is None else formulas.inertia(FLOATS, self.problem.p.values.tolist())
        with requested_quantity("period_slope"):
            return float(self._derivatives_of_one_shape.period_gradient[-1] / inertia)

    @locked
    def _sensitivity(self, t: Any, wrt: Any) -> Sensitivity:
        rows = selected(self.problem.formulas.parameters, wrt)
        sampled = self._sampled_along_waves(t)
        if sampled is not None:
            sampler, times, phi, shape = sampled
            made = self._orbit_sensitivity.at_times(self, sampler.record, times, phi, tuple(rows.values()))
            return Sensitivity(tuple(rows), *(made.reshape(len(made), len(rows), *shape) if shape else made[:, :, 0]))
        points, phi, shape = self._orbit_points(t)
        found = self._orbit_sensitivity.at(self, points, phi, list(rows.values()))
        return Sensitivity(tuple(rows), *found.reshape(len(found), len(rows), *shape))

    @locked
    def place_changes(self, t: Any, wrt: Any = None) -> Array:
        """Return the derivatives of the curve parameter at given times; see `Motion.place_changes`."""
        sampled = self._sampled_along_waves(t)
        if sampled is None:
            return super().place_changes(t, wrt)
        rows, (sampler, times, phi, shape) = selected(self.problem.formulas.parameters, wrt), sampled
        found = self._orbit_sensitivity.places_at_times(self, sampler.record, times, phi, tuple(rows.values()))
        return found.reshape(len(rows), *shape)

    def _sampled_along_waves(self, t: Any) -> tuple[Sampler, Array, float, tuple[int, ...]] | None:
        """Return `_sampled_times` if the changes along the orbit are a Fourier series, else None."""
        has_waves = self.problem.formulas.chart is None and self._orbit_sensitivity.has_waves
        return self._sampled_times(t) if has_waves else None

    def _sampled_times(self, t: Any) -> tuple[Sampler, Array, float, tuple[int, ...]] | None:
        """Return the sampler for times, these, the phase angle of the launch, and their shape; None if there is no
        sampler.
        """
        time, known = plain_time(t), self._sampled
        if time is not None and known is not None and self._sampler_for(time, time) is known[0]:
            return known[0], np.array([time]), known[1], ()
        given = plain_times(t) if time is None else (np.array([time]), time, time)
        sampler = None if given is None else self._sampler_for(*given[1:])
        if given is None or sampler is None:
            return None
        trajectory, shape = self._trajectory(max(-given[1], given[2])), np.shape(given[0]) if time is None else ()
        self._sampled = sampler, trajectory.segments[0].phi_start
        return sampler, given[0].reshape(-1), self._sampled[1], shape

    def _orbit_points(self, t: Any) -> tuple[Array, float, tuple[int, ...]]:
        """Return points on the orbit at times, the phase angle of the launch, and the shape of the times."""
        sampled = self._sampled_times(t)
        if sampled is not None:
            sampler, sampled_times, phi, sampled_shape = sampled
            return sampler.phases(sampled_times), phi, sampled_shape
        times, low, shape = self._times(t)
        found = self._phase_points(times, low)
        points = points_of(found, self._places(found), self._velocities(found))
        return points, found.trajectory.segments[0].phi_start, shape

    @locked
    def fourier(self, quantity: str, n: int) -> Fourier:
        """Return the Fourier coefficients of a quantity over one period; see `Motion.fourier`."""
        is_smooth = self.problem.functions.breaks.size == 0
        return fourier(self, quantity, n, None if is_smooth else self._listed_trajectory.panel_times)

    def lam(self, t: Any) -> Any:
        """Return the curve parameter at times; see `Motion.lam`. For doubles this is one call of compiled code."""
        time = plain_time(t)
        if time is not None:
            sampler = self._sampler_for(time, time)
            return super().lam(t) if sampler is None else sampler.place(time)
        times = plain_times(t)
        sampler = None if times is None else self._sampler_for(times[1], times[2])
        if times is None or sampler is None:
            return super().lam(t)
        return sampler.places(times[0].reshape(-1)).reshape(times[0].shape)

    def state(self, t: Any) -> State:
        """Return the state of the body at times; see `Motion.state`. For doubles this is one call of compiled code."""
        time = plain_time(t)
        times = plain_times(t) if time is None else (NOWHERE, time, time)
        sampler = None if times is None else self._sampler_for(times[1], times[2])
        if times is None or sampler is None:
            return super().state(t)
        if time is not None:
            return self._state_at(sampler.state(time))
        return self._state_of(times[0], sampler.states(times[0].reshape(-1)))

    def _sampler_for(self, least: float, greatest: float) -> Sampler | None:
        """Return the sampler for times from ``least`` to ``greatest``; None if they are impossible or too late for
        doubles.
        """
        end_time = max(-least, greatest)
        if not (end_time < inf and greatest <= self.t_end):
            return None
        sampler = self._sampler
        if sampler is not None and sampler.min_time < end_time <= sampler.max_time:
            return sampler
        return self._new_sampler_for(end_time)

    @locked
    def _new_sampler_for(self, end_time: float) -> Sampler | None:
        """Return the sampler for times up to ``end_time``, which is made if there is none yet."""
        times = self._times_until(end_time)
        if times.sampler is None:
            of_states = partial(self._constants_of_states, times)
            times.sampler = Sampler(
                self.problem, times.repeated, times.timing, times.span, self.direction, of_states, lock_of(self)
            )
        self._sampler = times.sampler
        return self._sampler if end_time <= self._sampler.max_time else None

    def _constants_of_states(self, times: Times) -> tuple[float, ...]:
        return self._lap_length(times), self.problem.arc_origin, self._launch_on(times)[1], *self._time_drift(times)

    @locked
    def events_between(self, t1: Any, t2: Any) -> tuple[Event, ...]:
        """Return the events from time t1 to t2 over as many periods as necessary; see `Motion.events_between`."""
        start, stop = read_number(t1, where="t1", unit="s").value, read_number(t2, where="t2", unit="s").value
        period = self.period
        lap, within = self._listed_trajectory.lap, self._one_period()
        if not within:
            return Rows([])
        first, last = int(np.floor(start / period)), int(np.floor(min(stop, self.t_end) / period))
        if (last - first) * len(within) > MAX_EVENTS:
            raise InputError(
                f"events_between: {len(within)} events in each of {last - first} periods are more than {MAX_EVENTS}; "
                "ask for a shorter interval"
            )
        out = []
        for k in range(first, last + 1):
            for event in within:
                if k and event.kind == "slip" and event.t == 0.0:
                    continue  # a body that slips at launch begins to slip only then
                t = event.t + k * period
                if start <= t <= min(stop, self.t_end):
                    out.append(Event(event.kind, t, event.lam + k * lap, event.x, event.z))
        return Rows(out)

    def _one_period(self) -> tuple[Event, ...]:
        return tuple(event for event in self.events if event.kind != "horizon")

    def _at_end(self, lam: float, low: float) -> float:
        """Return the end of the segment if a place is a turning point as rounded by `turning_points`, else the
        place.
        """
        for end in (self._segment.a, self._segment.b):
            is_near = 0.0 < abs(lam - end) <= MAX_TURN_ROUNDING * abs(end)
            if is_near and low == 0.0 and lam in self.turning_points:
                return end
        return lam

    def _first_passages(self, lam: float, low: float) -> list[float]:
        lap = self._listed_trajectory.lap
        if not lap:
            return super()._first_passages(self._at_end(lam, low), low)
        count = np.floor((lam - self.problem.lam0) / lap)
        if count < 0:
            return []
        within = super()._first_passages(lam - count * lap, low)
        return [t + count * self.period for t in within] if count else within
