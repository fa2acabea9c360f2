"""Where the coefficient of a force is zero, derivatives are the limits of those for small coefficients, and those with
respect to the coefficient are one-sided differences of motions with the force.
"""

from types import ModuleType
from typing import Any

import numpy as np
import pytest

from generated import circle_coulomb, circle_drag, circle_rotating, helix_coulomb

# A coefficient by which derivatives change by less than this share of the largest.
SMALL, ALIKE = 2.0**-34, 1e-8

# The step of a one-sided difference of fifth order, with its weights, and what it explains.
STEP, WEIGHTS, BY_DIFFERENCE = 2.0**-10, (-137 / 60, 5.0, -5.0, 10 / 3, -5 / 4, 1 / 5), 1e-8

CASES = {
    "friction": (circle_coulomb, "mu", {"mu_static": 0.25}, 1.1),
    "drag": (circle_drag, "b", {}, 1.1),
    "frame": (circle_rotating, "Omega", {}, 1.1),
    "friction in space": (helix_coulomb, "mu", {}, 0.3),
}
TIMES = [0.7, 1.9]


def rows_of(module: ModuleType, given: dict[str, Any], names: tuple[str, ...]) -> dict[str, np.ndarray]:
    """Return the derivatives of extremes, turning points and states: a row for each name."""
    motion = module.solve(t_max=2.5, **given)
    found = {name: motion.gradient(name, names) for name in ("turning_points", "v_max", "normal_force_max")}
    rows = {name: np.array([np.atleast_1d(row) for row in by.values()]) for name, by in found.items()}
    changes = motion.sensitivity(TIMES, names)
    return rows | {name: getattr(changes, name) for name in ("lam", "v", "normal_force")}


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name == "drag" else pytest.mark.extended) for name in CASES]
)
@pytest.mark.parametrize("v0", [0.0, 0.75])
def test_a_coefficient_of_zero(name: str, v0: float) -> None:
    """All derivatives are limits."""
    module, coefficient, more, lam0 = CASES[name]
    launch = {"lam0": lam0, "v0": v0, **more}
    names = (*module.PARAMETERS, "lam0", "v0")
    at_zero, beside = (rows_of(module, {**launch, coefficient: value}, names) for value in (0.0, SMALL))
    for quantity, rows in at_zero.items():
        size = np.abs(beside[quantity]).max(initial=0.0)
        assert rows == pytest.approx(beside[quantity], rel=0, abs=ALIKE * size), quantity
    states = [module.solve(t_max=2.5, **launch, **{coefficient: k * STEP}).state(TIMES) for k in range(len(WEIGHTS))]
    for field in ("lam", "v", "normal_force"):
        difference = sum(weight * getattr(state, field) for weight, state in zip(WEIGHTS, states, strict=True)) / STEP
        row, size = at_zero[field][names.index(coefficient)], np.abs(at_zero[field]).max()
        assert row == pytest.approx(difference, rel=0, abs=BY_DIFFERENCE * size), field
