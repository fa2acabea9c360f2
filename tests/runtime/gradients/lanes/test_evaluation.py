"""Gradients in double precision agree with closed forms and with differences in mpmath, whatever their neighbours."""

from types import ModuleType

import numpy as np
import pytest
from mpmath import mp, mpf
from orbits import FORMULAS, by_differences, half_orbit
from paths import ROOT

from gqm_sym.loading import load
from gqm_sym.runtime.gradients import sweep as swept

ULP = 2.0**-52


def generated(name: str) -> ModuleType:
    """Return a module of the repository."""
    return load(str(ROOT / "generated" / f"{name}.py"), name)


@pytest.fixture
def answered(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Return a list to which each sweep adds the share of its half periods that have derivatives in doubles."""
    shares: list[float] = []
    in_lanes = swept.in_lanes

    def counted(*arguments: object) -> np.ndarray:
        found = in_lanes(*arguments)
        shares.append(float(np.isfinite(found).all(axis=1).mean()))
        return found

    monkeypatch.setattr(swept, "in_lanes", counted)
    return shares


@pytest.mark.parametrize(("low", "high"), [(1e-3, 0.1), (0.1, 1.0), (1.0, 2.4)])
def test_pendulums(low: float, high: float, answered: list[float]) -> None:
    """For random pendulums, dtau/dA and dtau/dL are within 2 ulp of complete elliptic integrals, also for small
    swings.
    """
    random, count = np.random.default_rng(7), 150
    amplitude, length, g = (
        random.uniform(low, high, count),
        random.uniform(0.1, 10, count),
        random.uniform(1, 25, count),
    )
    found = generated("circle").sweep(
        "half_period", lam0=amplitude, L=length, g=g, gradient=("lam0", "L", "g", "v0", "m")
    )
    assert answered[0] > 0.95
    with mp.workdps(40):
        for k in range(count):
            a, scale = mpf(amplitude[k]), mp.sqrt(mpf(length[k]) / mpf(g[k]))
            modulus = mp.sin(a / 2)
            first, second = mp.ellipk(modulus**2), mp.ellipe(modulus**2)
            by_amplitude = scale * mp.cos(a / 2) * (second / (modulus * (1 - modulus**2)) - first / modulus)
            wanted = by_amplitude, scale * first / mpf(length[k]), -scale * first / mpf(g[k])
            for value, true in zip(found.gradient[k, :3], wanted, strict=True):
                assert abs(value - true) <= 2 * ULP * abs(true)
    np.testing.assert_array_equal(found.gradient[:, 3:], 0.0)


@pytest.mark.parametrize("name", ["ellipse", "parabola", "catenary", "double_well", "rolling_circle"])
def test_random_launches(name: str, answered: list[float]) -> None:
    """For random launches on wells with and without symmetry, derivatives are within 4 ulp of differences in mpmath.

    These have 2 ulp of the integral of the absolute values, which may be twice the integral.
    """
    formula, random = FORMULAS[name], np.random.default_rng(11)
    given = {key: random.uniform(*ends, 5) for key, ends in formula.ranges.items()}
    ends = generated(name).sweep("turning_points", **given)
    found = generated(name).sweep("half_period", **given, gradient=tuple(given))
    for k in np.flatnonzero(found.status == 0):
        launch = {key: float(values[k]) for key, values in given.items()}
        with mp.workdps(40):
            for column, key in enumerate(launch):
                near = tuple(ends.values[k])
                wanted = by_differences(lambda numbers, near=near: half_orbit(name, numbers, near), launch, key)[0]
                assert abs(found.gradient[k, column] - wanted) <= 4 * ULP * abs(wanted)
    assert answered[0] >= 0.2


def test_neighbours_do_not_matter() -> None:
    """The same launch has the same derivatives, to the last bit, alone and anywhere among others."""
    module, random = generated("pendulum"), np.random.default_rng(3)
    lam0, v0 = random.uniform(-2.6, -0.6, 200), random.choice([0.0, 1.0, 2.0], 200)
    names = ("lam0", "v0", "L")
    together = module.sweep("half_period", lam0=lam0, v0=v0, gradient=names).gradient
    order = random.permutation(200)
    shuffled = module.sweep("half_period", lam0=lam0[order], v0=v0[order], gradient=names).gradient
    np.testing.assert_array_equal(shuffled, together[order])
    for k in (0, 70, 199):
        alone = module.sweep("half_period", lam0=lam0[k], v0=v0[k], gradient=names).gradient
        np.testing.assert_array_equal(alone, together[k])
    one_by_one = [module.sweep("half_period", lam0=lam0, v0=v0, gradient=name).gradient[:, 0] for name in names]
    for column, wanted in zip(one_by_one, together.T, strict=True):
        np.testing.assert_allclose(column, wanted, rtol=4 * ULP)
