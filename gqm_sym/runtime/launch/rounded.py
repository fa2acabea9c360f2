"""Decisions within rounding margins, for curves that are known in doubles only."""

from dataclasses import dataclass
from math import inf, isfinite

import numpy as np

from gqm_sym.runtime.launch.functions import BoundFunctions
from gqm_sym.runtime.launch.speed import path_and_force_at, potential_at, speed_squared_at
from gqm_sym.runtime.multiprecision.exact_problem import End

# V**2, or a slope of the effective potential, counts as zero below this share of the size of its terms.
ZERO_SHARE = 2e-14

# The slope counts as zero below this share of the slopes and forces nearby, some units in the last place. They are
# taken at this share of the length on which the curve changes its direction.
LEVEL_SHARE, ASIDE = 1e-15, 1.0 / 8.0


@dataclass(frozen=True, slots=True)
class RoundedProblem:
    """One launch on a charted curve; it answers the same questions as `ExactProblem`."""

    functions: BoundFunctions
    lam0: float
    w0: float
    domain: tuple[float, float] = (-inf, inf)

    def slope_sign(self) -> int:
        """Return the sign of the effective potential's slope at the launch place; 0 if it is zero within rounding.

        Its terms are as large as the force across the curve, which a rounding of the tangent turns along it, as the
        slope at some distance, and as the potential over the length on which the curve changes its direction.
        """
        f, place = self.functions, np.array([self.lam0])
        _, _, ds, bend, load = np.abs(path_and_force_at(f.addresses, f.p, place, np.zeros(1))[:, 0]).tolist()
        length = min(self.domain[1] - self.domain[0], 1.0 / bend if bend > 0.0 else inf)
        value, slope = self._potential(self.lam0)
        sides = (min(max(self.lam0 + side * ASIDE * length, self.domain[0]), self.domain[1]) for side in (-1.0, 1.0))
        beside = [abs(self._potential(place)[1]) for place in sides if isfinite(place)]
        limit = LEVEL_SHARE * max(ds * load / f.mass, *beside, 0.0) + ZERO_SHARE * abs(value) / length
        return 0 if abs(slope) <= limit else int(np.sign(slope))

    def resolve(self, near: float, far: float, direction: int) -> End:
        """Decide whether a turning point, an equilibrium or neither lies between two places with nearly vanishing
        V**2.
        """
        width = abs(far - near)
        equilibrium = self._equilibrium(near, far + direction * width)
        beyond = far if equilibrium is None else equilibrium
        v2 = self._speed_squared(beyond)
        size = self.w0 + 2.0 * (abs(self._potential(beyond)[0]) + abs(self._potential(self.lam0)[0]))
        if equilibrium is not None and abs(v2) <= ZERO_SHARE * size:
            return End("equilibrium", equilibrium)
        if v2 > 0.0 and (far - beyond) * direction > 0.0 and self._speed_squared(far) < 0.0:
            return End("turn", self._zero(beyond, far))  # V**2 is largest at the equilibrium and vanishes beyond it
        return End("clear") if v2 > 0.0 else End("turn", self._zero(near, beyond))

    def _potential(self, place: float) -> tuple[float, float]:
        rows = potential_at(self.functions.addresses, self.functions.p, np.array([place]))
        return float(rows[0, 0]), float(rows[1, 0])

    def _speed_squared(self, place: float) -> float:
        f = self.functions
        offset = np.array([place - self.lam0])
        return float(speed_squared_at(f.addresses, f.p, self.lam0, 0.0, self.w0, np.array([place]), offset)[0])

    def _equilibrium(self, near: float, far: float) -> float | None:
        """Return the place between two others where the potential's slope changes sign; None if it does not."""
        sign = np.sign(self._potential(near)[1])
        if sign == np.sign(self._potential(far)[1]):
            return None
        while True:
            middle = 0.5 * (near + far)
            if middle in (near, far):
                return middle
            near, far = (middle, far) if np.sign(self._potential(middle)[1]) == sign else (near, middle)

    def _zero(self, near: float, far: float) -> float:
        """Return the zero of V**2 between a place where V**2 is positive and one where it is not."""
        while True:
            middle = 0.5 * (near + far)
            if middle in (near, far):
                return near
            near, far = (middle, far) if self._speed_squared(middle) > 0.0 else (near, middle)
