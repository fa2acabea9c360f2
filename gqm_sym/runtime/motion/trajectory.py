"""A motion as segments in the order of time, repeated if the motion is periodic."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gqm_sym.runtime.arithmetic.doubledouble import ZERO, Pair, minus, plus, reduce_many, two_sum
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.inversion.table import BESIDE_END, angles_to_end
from gqm_sym.runtime.motion.segments.segment import Segment
from gqm_sym.runtime.quadrature.substitution import TURN_TURN


class TimedSegment(NamedTuple):
    """A segment, or a part of one, that the body moves through once, with its times.

    Attributes
    ----------
    segment : Segment
        The segment.
    sense : int
        +1 if the body moves away from the segment's end ``a``, -1 if towards it.
    r_start, r_stop : pair of float
        Time in s from the segment's end ``a`` at the start and at the stop, each as two doubles.
    phi_start, phi_stop : float
        The phase angles there.
    t_start, t_stop : pair of float
        Time in s from launch at the start and at the stop, each as two doubles (`stop_time`).
    s_a : float
        Arc length in m from the launch to the segment's end ``a``.
    end : str
        The name of its end, one of `launch.kinds.LEG_ENDS`; empty if the next segment continues it.
    laps : int
        The number of laps of a closed curve before it; places on the segment are within one lap.
    leg : int
        For motions that lose energy, the number of the leg that it is part of.
    """

    segment: Segment
    sense: int
    r_start: Pair
    r_stop: Pair
    phi_start: float
    phi_stop: float
    t_start: Pair
    t_stop: Pair
    s_a: float
    end: str
    laps: int = 0
    leg: int = 0

    @property
    def direction(self) -> int:
        """The sign of ds/dt."""
        return self.sense * self.segment.direction


def stop_time(sense: int, r_start: Pair, r_stop: Pair, t_start: Pair) -> Pair:
    """Return the time from launch at the stop of a timed segment, whose attributes the arguments are."""
    spent = minus(r_stop, r_start)
    return plus(t_start, (sense * spent[0], sense * spent[1]))


class Repeated(NamedTuple):
    """The one segment of a periodic motion.

    Attributes
    ----------
    segment : Segment
        The segment.
    period, lap, time_scale_error
        As in `Trajectory`.
    """

    segment: Segment
    period: Pair
    lap: float
    time_scale_error: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Trajectory:
    """The timed segments of a motion.

    Attributes
    ----------
    segments : tuple of TimedSegment
        The segments in the order of time.
    period : pair of float or None
        The time in s after which they repeat, as two doubles; None if they do not.
    lap, lap_length : float
        The growth of the curve parameter and of the arc length (in m) in one period of a circulation, 0 otherwise.
    time_scale_error : float
        The relative error of the times of the segments' own quadrature, where the exact time is known.
    """

    segments: tuple[TimedSegment, ...]
    period: Pair | None = None
    lap: float = 0.0
    lap_length: float = 0.0
    time_scale_error: float = 0.0

    def reduce(self, t: Array, t_low: Array) -> tuple[Array, Array, Array]:
        """Return the number of whole periods in each time, and the remaining time as two doubles."""
        if self.period is None:
            return np.zeros_like(t), t, t_low
        count, reduced, reduced_low = reduce_many(t, t_low, *self.period)
        return count, reduced, reduced_low

    def segment_indices(self, reduced: Array) -> np.ndarray:
        """Return the index of the segment on which each reduced time falls."""
        starts = np.array([timed.t_start[0] for timed in self.segments])
        return np.clip(np.searchsorted(starts, reduced, side="right") - 1, 0, len(self.segments) - 1)

    def segment_times(self, timed: TimedSegment, reduced: Array, reduced_low: Array) -> tuple[Array, Array]:
        """Return the times of the segment's table at reduced times, from its end ``a``, as two doubles each."""
        s, e = two_sum.py_func(reduced, -timed.t_start[0])
        e = e + (reduced_low - timed.t_start[1])
        r, low = two_sum.py_func(timed.r_start[0], timed.sense * s)
        low = low + (timed.r_start[1] + timed.sense * e)
        # The table has the times of the segment's own quadrature, whose total may be wrong in the last place.
        low = low + r * self.time_scale_error
        return np.ascontiguousarray(r), np.ascontiguousarray(low)

    def phase_angles(self, timed: TimedSegment, reduced: Array, reduced_low: Array) -> Array:
        """Return the phase angles on a timed segment at reduced times."""
        return timed.segment.phase_angle(*self.segment_times(timed, reduced, reduced_low))

    def time_of(self, timed: TimedSegment, phi: float) -> float:
        """Return the time in s from launch of a phase angle of a timed segment."""
        if phi == timed.phi_start:
            return timed.t_start[0]
        if phi == timed.phi_stop:
            return timed.t_stop[0]
        r = float(timed.segment.times(np.array([phi]))[0])
        spent = minus((r, -r * self.time_scale_error), timed.r_start)
        return plus(timed.t_start, (timed.sense * spent[0], timed.sense * spent[1]))[0]

    @property
    def panel_times(self) -> Array:
        """The times in s from launch at which panels begin and end, in increasing order.

        Between two of them all that moves with the body is a smooth function of time.
        """
        times = []
        for timed in self.segments:
            low, high = sorted((timed.phi_start, timed.phi_stop))
            edges = timed.segment.edges
            inside = edges[(low < edges) & (edges < high)].tolist()
            times += [self.time_of(timed, phi) for phi in (low, *inside, high)]
        return np.unique(times)


def libration(
    segment: Segment, direction: int, duration: Pair, phase_time: Pair, phi: float, s_a: float
) -> tuple[TimedSegment, ...]:
    """Return one period between two turning points, beginning with the launch.

    ``duration`` is the half period, and ``phase_time`` the time from the end ``a`` to the launch place, whose phase
    angle is ``phi``; ``s_a`` is the arc length from there to the end ``a``.
    """
    a, b, launch = (ZERO, 0.0), (duration, segment.stop), (phase_time, phi)
    first, second = (a, b) if direction > 0 else (b, a)
    runs = [
        (direction, launch, second, "turn"),
        (-direction, second, first, "turn"),
        (direction, first, launch, "horizon"),
    ]
    segments: list[TimedSegment] = []
    t = ZERO
    for sense, (start, phi_start), (stop, phi_stop), end in runs:
        if start == stop:
            continue
        t_start, t = t, stop_time(sense, start, stop, t)
        timed = TimedSegment(
            segment=segment,
            sense=sense,
            r_start=start,
            r_stop=stop,
            phi_start=phi_start,
            phi_stop=phi_stop,
            t_start=t_start,
            t_stop=t,
            s_a=s_a,
            end=end,
        )
        segments.append(timed)
    return tuple(segments)


def circulation(segment: Segment, duration: Pair) -> TimedSegment:
    """Return one lap from the launch, which takes the time ``duration``."""
    return TimedSegment(
        segment=segment,
        sense=1,
        r_start=ZERO,
        r_stop=duration,
        phi_start=0.0,
        phi_stop=segment.stop,
        t_start=ZERO,
        t_stop=stop_time(1, ZERO, duration, ZERO),
        s_a=0.0,
        end="horizon",
    )


@dataclass(frozen=True, slots=True)
class PhasePoints:
    """The places of a motion at given times.

    Attributes
    ----------
    segments : tuple
        For each timed segment on which times fall: the segment, a mask of these times, and their phase angles.
    at_launch : array of bool
        A mask of the times that are those of the launch, or of a return to it after whole periods.
    laps : array
        The number of laps at each time.
    trajectory : Trajectory
        The trajectory to which the segments belong.
    reduced, reduced_low : arrays
        The times without whole periods, as two doubles each.
    """

    segments: tuple[tuple[TimedSegment, NDArray[np.bool_], Array], ...]
    at_launch: NDArray[np.bool_]
    laps: Array
    trajectory: Trajectory
    reduced: Array
    reduced_low: Array

    def places(self, launch: float) -> Array:
        """Return the curve parameter within the lap; at launch it is exactly the launch place."""
        lam = np.full_like(self.laps, launch)
        for timed, mask, phi in self.segments:
            lam[mask] = timed.segment.places(phi)
        lam[self.at_launch] = launch
        return lam

    def arc_lengths(self) -> Array:
        """Return the arc length in m from the launch, within the lap."""
        s = np.zeros_like(self.laps)
        for timed, mask, phi in self.segments:
            direction = timed.segment.direction
            whole, parts = timed.segment.lengths_from_edges(phi, self._to_end(timed, mask, phi))
            s[mask] = (timed.s_a + direction * whole) + direction * parts
        s[self.at_launch] = 0.0
        return s

    def velocities(self, launch: float) -> Array:
        """Return ds/dt in m/s; at launch it is exactly that of the launch."""
        v = np.zeros_like(self.laps)
        for timed, mask, phi in self.segments:
            v[mask] = timed.direction * self._speeds(timed, mask, phi)
        v[self.at_launch] = launch
        return v

    def _speeds(self, timed: TimedSegment, mask: NDArray[np.bool_], phi: Array) -> Array:
        """Return |ds/dt| in m/s on a timed segment; beside the turning point at its end, from the time that is left."""
        speeds, beside = timed.segment.speeds(phi), phi > BESIDE_END
        if timed.segment.kind == TURN_TURN and beside.any():
            speeds[beside] *= np.sin(self._to_end(timed, mask, phi)[beside]) / np.sin(phi[beside])
        return speeds

    def _to_end(self, timed: TimedSegment, mask: NDArray[np.bool_], phi: Array) -> Array:
        """Return what phase angles lack to the last one; beside a turning point there, from the time that is left."""
        segment = timed.segment
        if segment.kind != TURN_TURN:
            lack: Array = segment.edges[-1] - phi
            return lack
        r, low = self.trajectory.segment_times(timed, self.reduced[mask], self.reduced_low[mask])
        (_, _, scales, powers, *_), total = segment.table, segment.total_time
        exact: Array = angles_to_end(scales, powers, (total[0] - r) + (total[1] - low), phi)
        return exact


def locate(trajectory: Trajectory, t: Array, t_low: Array) -> PhasePoints:
    """Return the segments and phase angles on which times fall; a time is t + t_low."""
    laps, reduced, reduced_low = trajectory.reduce(t, t_low)
    which = trajectory.segment_indices(reduced)
    segments = []
    for k in np.unique(which):
        timed, mask = trajectory.segments[k], which == k
        laps[mask] += timed.laps
        phi = trajectory.phase_angles(timed, reduced[mask], reduced_low[mask])
        segments.append((timed, mask, np.clip(phi, 0.0, timed.segment.edges[-1])))
    at_launch = (reduced == 0.0) & (reduced_low == 0.0)
    return PhasePoints(tuple(segments), at_launch, laps, trajectory, reduced, reduced_low)
