"""Motion along a space curve in a rotating frame by Newton's law, integrated by DOP853."""

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

Vector = np.ndarray[Any, np.dtype[np.float64]]


class Newton:
    """A bead on a curve r(u) in a frame that rotates about the z axis, with its forces as vectors."""

    def __init__(
        self, curve: Callable[[float], tuple[Any, Any, Any]], omega: float = 0.0, mu: float = 0.0, g: float = 9.81
    ) -> None:
        self.curve, self.omega, self.mu, self.g = curve, np.array([0.0, 0.0, omega]), mu, g

    def forces(self, u: float, rate: float) -> tuple[Vector, Vector, Vector]:
        """Return the contact force, the tangent and the applied force, per unit mass."""
        place, first, second = (np.array(row) for row in self.curve(u))
        tangent, velocity = first / np.linalg.norm(first), first * rate
        applied = np.array([0.0, 0.0, -self.g]) - np.cross(self.omega, np.cross(self.omega, place) + 2.0 * velocity)
        missing = second * rate**2 - applied
        return missing - tangent * (tangent @ missing), tangent, applied

    def __call__(self, _: float, state: Vector) -> list[float]:
        """Return the rates of u, du/dt and the energy lost."""
        u, rate, _ = state
        _, first, second = (np.array(row) for row in self.curve(u))
        contact, tangent, applied = self.forces(u, rate)
        size, rubbing = float(np.linalg.norm(first)), self.mu * float(np.linalg.norm(contact))
        along = tangent @ applied - rubbing * np.sign(rate) - tangent @ second * rate**2
        return [rate, along / size, rubbing * size * abs(rate)]

    def follow(self, lam0: float, v0: float, times: Any, event: Any = None) -> Any:
        """Integrate from a launch."""
        size = np.linalg.norm(self.curve(lam0)[1])
        return solve_ivp(
            self, (0.0, max(times)), [lam0, v0 / size, 0.0], "DOP853", times, events=event, rtol=1e-13, atol=1e-14
        )


def viviani(u: float) -> tuple[Any, Any, Any]:
    """Return Viviani's curve with a radius of 1, and its first two derivatives."""
    return (
        (1.0 + np.cos(u), np.sin(u), 2.0 * np.sin(u / 2)),
        (-np.sin(u), np.cos(u), np.cos(u / 2)),
        (-np.cos(u), -np.sin(u), -np.sin(u / 2) / 2),
    )
