"""Motions that repeat: libration between two turning points, and circulation round a closed curve."""

from typing import Any

import numpy as np

from gqm_sym.runtime import timing
from gqm_sym.runtime.course import ZERO, Course, Piece, libration
from gqm_sym.runtime.events import Event
from gqm_sym.runtime.motion import ULP, Motion
from gqm_sym.runtime.numbers import read_number
from gqm_sym.runtime.problem import Problem
from gqm_sym.runtime.stretch import Array, Stretch, slopes


class Periodic(Motion):
    """A libration or a circulation: one stretch, repeated for ever.

    Its course is first built from times in doubles. Beyond one period from launch the period is needed as two
    doubles; it is then evaluated once in extended precision.
    """

    def __init__(self, problem: Problem, kind: str, direction: int, stretch: Stretch) -> None:
        super().__init__(problem, kind, direction)
        self._stretch = stretch
        self._plain: Course | None = None
        self._precise: Course | None = None
        self._exact: timing.Timing | None = None

    @property
    def turning_points(self) -> tuple[float, ...]:
        """Both turning points of a libration, each the double nearest to the exact one."""
        if self.kind != "libration":
            return ()
        low, high = timing.turning_points(self.problem, self._stretch)
        met = (high, low) if self.direction > 0 else (low, high)
        return (self.problem.lam0, met[0]) if self.problem.w0 == 0.0 else met

    @property
    def _timing(self) -> timing.Timing:
        if self._exact is None:
            self._exact = timing.exact(self.problem, self.kind, self.direction, self._stretch)
        return self._exact

    @property
    def one_period(self) -> tuple[Piece, ...]:
        """The pieces of one period from launch."""
        return self._course(0.0).pieces

    @property
    def half_period(self) -> float:
        """Time from one turning point to the other, the double nearest to the exact one (libration only)."""
        if self.kind != "libration":
            return super().half_period
        return self._timing.duration[0]

    @property
    def period(self) -> float:
        """Time after which the motion repeats, the double nearest to the exact one."""
        duration = self._timing.duration[0]
        return 2.0 * duration if self.kind == "libration" else duration

    def period_to(self, digits: int) -> str:
        """The period as a decimal string with that many correct digits (up to 1000)."""
        return timing.period_to(self.problem, self.kind, self.direction, self._stretch, digits)

    def _course(self, reach: float) -> Course:
        whole = self._stretch.duration * (2.0 if self.kind == "libration" else 1.0)
        if self._precise is None and (reach > whole or self._exact is not None or self._stretch.from_exact):
            self._precise = self._build(self._timing)
        if self._precise is not None:
            return self._precise
        if self._plain is None:
            self._plain = self._build(timing.plain(self.problem, self.kind, self._stretch))
        return self._plain

    def _build(self, clock: timing.Timing) -> Course:
        stretch, tau = self._stretch, clock.duration
        pace = ((stretch.duration - tau[0]) - tau[1]) / tau[0]
        if self.kind == "libration":
            phi = stretch.anomaly_of(*clock.offsets)
            pieces = libration(stretch, direction=self.direction, tau=tau, phase=clock.phase, phi=phi)
            return Course(pieces=pieces, period=(2.0 * tau[0], 2.0 * tau[1]), pace=pace)
        piece = Piece(
            stretch=stretch,
            sense=1,
            r_start=ZERO,
            r_stop=tau,
            phi_start=0.0,
            phi_stop=stretch.stop,
            t_start=ZERO,
            s_a=0.0,
            end="horizon",
        )
        lap, length = self.direction * self.problem.period, self.direction * stretch.length
        return Course(pieces=(piece,), period=tau, lap=lap, lap_length=length, pace=pace)

    def _clock_error(self, t: Array) -> Array:
        course = self._course(float(np.abs(t).max()) if t.size else 0.0)
        assert course.period is not None
        period = course.period[0]
        # Within a period the stretch's clock counts, and the rounded anomaly of the launch; over many, the period.
        local = period * (self._stretch.relative_error + ULP)
        if course is not self._precise:
            start = np.array([course.pieces[0].phi_start])
            local += ULP * float(start[0] * slopes(self._stretch.edges, self._stretch.panels[3], start)[0])
        per_period = period * (2.0**-104 if course is self._precise else self._stretch.relative_error)
        return local + np.abs(t / period) * per_period

    def events_between(self, t1: Any, t2: Any) -> tuple[Event, ...]:
        """Events at times from t1 to t2, over as many periods as that takes."""
        start, stop = read_number(t1, where="t1").value, read_number(t2, where="t2").value
        period = self.period
        lap = self._course(0.0).lap
        out = []
        for k in range(int(np.floor(start / period)), int(np.floor(stop / period)) + 1):
            for event in self._one_period():
                t = event.t + k * period
                if start <= t <= min(stop, self.t_end):
                    out.append(Event(event.kind, t, event.lam + k * lap, event.x, event.z))
        return tuple(out)

    def _one_period(self) -> tuple[Event, ...]:
        return tuple(event for event in self.events if event.kind != "horizon")

    def _first_passages(self, lam: float, low: float) -> list[float]:
        lap = self._course(0.0).lap
        if not lap:
            return super()._first_passages(lam, low)
        count = np.floor((lam - self.problem.lam0) / lap)
        if count < 0:
            return []
        return [t + count * self.period for t in super()._first_passages(lam - count * lap, low)]
