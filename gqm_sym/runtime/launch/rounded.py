"""What doubles cannot decide, decided to rounding: for curves that are known by doubles only."""

from dataclasses import dataclass

import numpy as np

from gqm_sym.runtime.launch.functions import BoundFunctions
from gqm_sym.runtime.launch.speed import potential_at, speed_squared_at
from gqm_sym.runtime.multiprecision.exact_problem import End

# Shares of the effective potential's size, or of its slope's, that count as nothing.
NOTHING = 2e-14


@dataclass(frozen=True, slots=True)
class RoundedProblem:
    """One launch on a charted curve: the same questions as `ExactProblem` answers."""

    functions: BoundFunctions
    lam0: float
    w0: float

    def slope_sign(self) -> int:
        """The sign of the effective potential's slope at the launch place; 0 where it is level to rounding."""
        value, slope = self._potential(self.lam0)
        return 0 if abs(slope) <= NOTHING * (0.5 + abs(value)) else int(np.sign(slope))

    def resolve(self, near: float, far: float, direction: int) -> End:
        """What lies between two places that doubles cannot tell apart from an equilibrium."""
        width = abs(far - near)
        top = self._level(near, far + direction * width)
        beyond = far if top is None else top
        w = self._speed_squared(beyond)
        size = self.w0 + 2.0 * (abs(self._potential(beyond)[0]) + abs(self._potential(self.lam0)[0]))
        if top is not None and abs(w) <= NOTHING * size:
            return End("equilibrium", top)
        if w > 0.0 and (far - beyond) * direction > 0.0 and self._speed_squared(far) < 0.0:
            return End("turn", self._zero(beyond, far))  # a bottom, and a wall behind it
        return End("clear") if w > 0.0 else End("turn", self._zero(near, beyond))

    def _potential(self, place: float) -> tuple[float, float]:
        rows = potential_at(self.functions.addresses, self.functions.p, np.array([place]))
        return float(rows[0, 0]), float(rows[1, 0])

    def _speed_squared(self, place: float) -> float:
        f = self.functions
        offset = np.array([place - self.lam0])
        return float(speed_squared_at(f.addresses, f.p, self.lam0, 0.0, self.w0, np.array([place]), offset)[0])

    def _level(self, near: float, far: float) -> float | None:
        """Where the effective potential's slope changes sign between two places, if it does."""
        sign = np.sign(self._potential(near)[1])
        if sign == np.sign(self._potential(far)[1]):
            return None
        while True:
            middle = 0.5 * (near + far)
            if middle in (near, far):
                return middle
            near, far = (middle, far) if np.sign(self._potential(middle)[1]) == sign else (near, middle)

    def _zero(self, near: float, far: float) -> float:
        """The zero of V**2 between a place where it is positive and one where it is not."""
        while True:
            middle = 0.5 * (near + far)
            if middle in (near, far):
                return near
            near, far = (middle, far) if self._speed_squared(middle) > 0.0 else (near, middle)
