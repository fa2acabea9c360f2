"""A body that stays where it was put."""

import numpy as np

from gqm_sym.runtime.course import ZERO, Course
from gqm_sym.runtime.display import Rows
from gqm_sym.runtime.events import Event
from gqm_sym.runtime.located import Located
from gqm_sym.runtime.motion import Motion
from gqm_sym.runtime.problem import Problem
from gqm_sym.runtime.stretch import Array


class Rest(Motion):
    """A body that stays where it is."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem, "rest", problem.launch.direction)

    def _located(self, t: Array, t_low: Array) -> Located:
        return Located((), np.ones(t.shape, dtype=bool), np.zeros_like(t), self._course(0.0))

    def _course(self, reach: float) -> Course:
        return Course(pieces=(), period=ZERO)

    def _clock_error(self, t: Array) -> Array:
        return np.zeros_like(t)

    @property
    def events(self) -> tuple[Event, ...]:
        """At rest from the launch on."""
        state = self.state(0.0)
        return Rows([Event("rest", 0.0, state.lam, state.x, state.z)])

    def _extent(self) -> str:
        return f"it rests at {self.problem.lam0!r}"
