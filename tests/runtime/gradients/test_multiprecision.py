"""Derivatives of orbits that lose more digits than double-double arithmetic has are right."""

from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from orbits import by_differences
from paths import ROOT

from gqm_sym.budgets import budget
from gqm_sym.errors import BudgetError, SolutionError
from gqm_sym.loading import load
from gqm_sym.runtime.gradients.evaluation import values
from gqm_sym.runtime.gradients.formula_orbit import FormulaOrbitDerivatives

ULP = 2.0**-52


def generated(name: str) -> ModuleType:
    """Return a module of the repository."""
    return load(str(ROOT / "generated" / f"{name}.py"), name)


@pytest.mark.parametrize("amplitude", [1e-3, 1e-9, 1e-30])
def test_small_swings(amplitude: float) -> None:
    """dtau/dA has its closed form, and d theta/dA is cos(w t) to second order in the amplitude."""
    motion = generated("circle").solve(lam0=amplitude, L=1, g="9.81")
    with mp.workdps(120):
        k, rate = mp.sin(mpf(amplitude) / 2), mp.sqrt(mpf("9.81"))
        shape = mp.ellipe(k**2) / (k * (1 - k**2)) - mp.ellipk(k**2) / k
        wanted = mp.cos(mpf(amplitude) / 2) / rate * shape
        assert abs(motion.gradient("half_period")["lam0"] - wanted) <= 2 * ULP * wanted
    times = np.linspace(0.0, 5.0, 11)
    found = motion.sensitivity(times, ("lam0", "m"))
    np.testing.assert_allclose(found.lam[0], np.cos(float(rate) * times), atol=1e-14 + 4 * amplitude**2)
    assert not found.lam[1].any()


def test_launches_from_rest_in_the_middle() -> None:
    """For circulations from lam0 = 1e-300, dT/dlam0 is dT/dE g sin(lam0)."""
    motion = generated("circle").solve(lam0=1e-300, v0=9.0, L=1, g="9.81")
    assert motion.gradient("period", "lam0")["lam0"] == pytest.approx(motion.period_slope * 9.81e-300, rel=4 * ULP)


@pytest.mark.sample(2)
@pytest.mark.parametrize(("name", "v0"), [("ellipse", 1.0), ("ellipse", 9.0), ("parabola_rolling", 0.5)])
def test_the_same_as_in_double_double(name: str, v0: float) -> None:
    """If both arithmetics have enough digits, all means, ends and samples agree."""
    motion = generated(name).solve(lam0=0.25 if name == "parabola_rolling" else -1.25, v0=v0)
    direction = motion.direction if motion.kind == "circulation" else 0
    fast, slow = (
        motion._derivatives,
        FormulaOrbitDerivatives(motion.problem, None, direction, motion._offsets, lambda: motion._segment.edges),
    )
    assert fast._means[2]
    assert not slow._means[2]
    np.testing.assert_allclose(slow._means[0][:, 0], fast._means[0][:, 0], rtol=1e-15, atol=1e-25)
    if not direction:
        np.testing.assert_allclose(slow.ends, fast.ends, rtol=2 * ULP)
        assert slow.turning_points == fast.turning_points
    rows = (0, fast.source.parameters, fast.source.parameters + 1)
    np.testing.assert_allclose(slow.second_durations(rows), fast.second_durations(rows), rtol=1e-15, atol=1e-20)
    n = slow._means[1]
    slow_values = slow._multiprecision.samples(n)
    nodes = fast._rule[1][:2, n : 2 * n].copy()
    np.testing.assert_allclose(slow_values, values(fast._program, fast._rule[0], *nodes)[:, 0], rtol=1e-15, atol=1e-20)


@pytest.mark.extended
@pytest.mark.parametrize("launch", [{"lam0": "pi - 1/10**12"}, {"lam0": "3/10", "v0": 6.193843872478898}])
def test_beside_the_separatrix(launch: dict[str, Any]) -> None:
    """Half periods of swings that end beside the top, and periods of laps that just pass it, have all derivatives."""
    motion = generated("circle").solve(L=1, g="9.81", **launch)
    with mp.workdps(80):
        lam0 = mp.pi - mpf(10) ** -12 if "v0" not in launch else mpf("0.3")

        def duration(at: dict[str, Any]) -> list[Any]:
            w = mp.sqrt(at["g"] / at["L"])
            square = (at["v0"] / (2 * w * at["L"])) ** 2 + mp.sin(at["lam0"] / 2) ** 2
            if square < 1:
                return [2 * mp.ellipk(square) / w]
            return [2 * mp.ellipk(1 / square) / (w * mp.sqrt(square))]

        given = {"L": 1, "g": "9.81", "lam0": lam0, "v0": mpf(launch.get("v0", 0))}
        quantity = "half_period" if motion.kind == "libration" else "period"
        for name, found in motion.gradient(quantity, tuple(given)[: 3 if not given["v0"] else 4]).items():
            wanted = by_differences(duration, given, name, 40)[0]
            assert abs(found - wanted) <= 2 * ULP * abs(wanted), name


def test_the_time_is_limited() -> None:
    """Means in mpmath end when the time of a stage is used up."""
    motion = generated("circle").solve(lam0="pi - 1/10**12", L=1)
    assert motion.half_period > 0.0
    motion._segment.edges  # noqa: B018
    with pytest.raises(BudgetError, match="fitting: not done after"), budget("fitting", 0.05, "fit fewer numbers"):
        motion.gradient("half_period")


@pytest.mark.extended
def test_a_swing_that_comes_too_near_to_the_top() -> None:
    """A swing too near to the top is refused soon. A sweep has the derivatives as near as a double can be."""
    module = generated("circle")
    with pytest.raises(SolutionError, match="too near to an equilibrium"):
        module.solve(lam0="pi - 1/10**30", L=1).gradient("half_period")
    found = module.sweep("half_period", lam0=[1.0, 1e-9, 3.1415926], L=1, gradient=("lam0", "L"))
    assert np.isfinite(found.gradient).all()
    assert found.gradient[2, 1] == pytest.approx(0.5 * found.values[2], rel=2e-16)
    assert found.gradient[1, 0] == module.solve(lam0=1e-9, L=1).gradient("half_period")["lam0"]
