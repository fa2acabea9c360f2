"""Periods of one motion have the same derivatives in one call of compiled code as by all steps one after the other."""

from typing import Any

import numpy as np
import pytest
from paths import ROOT

from gqm_sym.loading import load
from gqm_sym.runtime.gradients.one_orbit import period_gradient
from gqm_sym.runtime.gradients.quantities import gradient

CASES: list[tuple[str, dict[str, Any]]] = [
    ("circle", {"lam0": "6/5", "g": "9.81"}),
    ("circle", {"lam0": "1/10", "v0": "1/3"}),
    ("circle", {"lam0": "1/2", "v0": 9, "direction": -1}),
    ("double_well", {"lam0": "3/4", "v0": "1/8"}),
    ("rolling_circle", {"lam0": -1}),
    ("rotating_parabola", {"lam0": "2/5", "v0": "1/5"}),
    ("viviani", {"lam0": "4/5"}),
]


@pytest.mark.parametrize(("name", "launch"), CASES)
@pytest.mark.parametrize("quantity", ["half_period", "period"])
def test_the_same_as_step_by_step(name: str, launch: dict[str, Any], quantity: str) -> None:
    """All derivatives agree to a unit in the last place, whichever are asked for."""
    motion = load(str(ROOT / "generated" / f"{name}.py"), name).solve(**launch)
    if motion.kind == "circulation" and quantity == "half_period":
        return
    found = motion.gradient(quantity)
    assert found == {by: motion.gradient(quantity, by)[by] for by in found}
    wanted = gradient(motion._derivatives, motion, quantity, None)
    assert list(found) == list(wanted)
    np.testing.assert_array_max_ulp(np.array(list(found.values())), np.array(list(wanted.values())))


def test_an_orbit_that_loses_digits() -> None:
    """In small swings, where double-double arithmetic does not suffice, multiprecision takes over."""
    motion = load(str(ROOT / "generated" / "circle.py"), "circle").solve(lam0="1e-8", L=1, g="9.81")
    assert period_gradient(motion.problem, 0, (-motion.problem.lam0, motion.problem.lam0), (0,)) is None
    assert motion.gradient("half_period", "L")["L"] == pytest.approx(0.5 * np.pi / np.sqrt(9.81), rel=1e-15)
