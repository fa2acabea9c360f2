"""A body that stays where it is launched, or that a track which can push from one side only lets go at once."""

from collections.abc import Sequence
from math import inf
from typing import Any

import numpy as np

from gqm_sym.runtime.arithmetic.doubledouble import ZERO
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.launch.request import ONLY_SIGN
from gqm_sym.runtime.motion.events import Event, Leg, sided_force
from gqm_sym.runtime.motion.locking import computed_once
from gqm_sym.runtime.motion.motion import Motion
from gqm_sym.runtime.motion.rows import Rows
from gqm_sym.runtime.motion.sampler import plain_time
from gqm_sym.runtime.motion.state import State
from gqm_sym.runtime.motion.trajectory import PhasePoints, TimedSegment, Trajectory


class MotionAtRest(Motion):
    """A body that stays where it is."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem, "rest", problem.launch.direction)
        self._lifts_off = _is_pulled(problem)
        if self._lifts_off:
            self.kind = "transit"

    def lam(self, t: Any) -> Any:
        """Return the curve parameter at times; see `Motion.lam`."""
        return self.problem.lam0 if self._is_plain(t) else super().lam(t)

    def state(self, t: Any) -> State:
        """Return the state of the body at times; see `Motion.state`."""
        return self._state_at((float(t), *self._column)) if self._is_plain(t) else super().state(t)

    def _is_plain(self, t: Any) -> bool:
        """Return whether this is one time from launch on, as a double, at which the body is still there."""
        time = plain_time(t)
        return time is not None and 0.0 <= time < inf and time <= self._known_end()

    @computed_once
    def _column(self) -> list[float]:
        """The items of a column of `_rows_of_states` at any time."""
        column: list[float] = self._rows_of_states(np.zeros(1), np.zeros(1))[:, 0].tolist()
        return column

    def _phase_points(self, t: Array, t_low: Array) -> PhasePoints:
        return PhasePoints((), np.ones(t.shape, dtype=bool), np.zeros_like(t), self._trajectory(0.0), t, t_low)

    def _trajectory(self, end_time: float) -> Trajectory:
        return Trajectory(segments=(), period=None if self._lifts_off else ZERO)

    def _known_end(self) -> float:
        return 0.0 if self._lifts_off else super()._known_end()

    def _time_error(self, t: Array) -> Array:
        return np.zeros_like(t)

    @property
    def legs(self) -> tuple[Leg, ...]:
        """Empty, or one leg of no length if contact is lost at once."""
        lam0 = self.problem.lam0
        return Rows([Leg(lam0, lam0, 0.0, 0.0, self.direction, "liftoff")] if self._lifts_off else [])

    @property
    def events(self) -> tuple[Event, ...]:
        """The one event at the launch: "rest", or "liftoff" if the track would have to pull the body."""
        state = self.state(0.0)
        return Rows([Event("liftoff" if self._lifts_off else "rest", 0.0, state.lam, state.x, state.z)])

    def _events_along(self, segments: Sequence[TimedSegment], until: float = inf) -> list[Event]:
        return list(self.events)

    def _end_text(self) -> str:
        return f"liftoff at {self.problem.formulas.parameter} = {self.problem.lam0!r}"

    def _extent_text(self) -> str:
        return f"it {'lifts off' if self._lifts_off else 'rests'} at {self.problem.lam0!r}"


def _is_pulled(problem: Problem) -> bool:
    """Return whether a track that can push from one side only would have to pull a body at rest at the launch place."""
    f, side = problem.functions, ONLY_SIGN[problem.launch.contact]
    if not side:
        return False
    return bool(side * sided_force(problem.formulas, f, np.array([problem.lam0]), np.zeros(1), 1)[0] < 0.0)
