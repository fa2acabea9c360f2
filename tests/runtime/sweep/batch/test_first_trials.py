"""Searches for turning points begin in the well of the launch, so that batches answer it at their first try."""

from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym.runtime.sweep import sweep

# The double well z = (x**2 - 1)**2/4 + 0.37*x, whose right well is shallow: terms of the potential cancel there.
HEIGHT = "(x**2-1)**2/4+0.37*x"
ULPS = 4.0


@pytest.fixture(scope="module")
def module(generated_folder: Path) -> ModuleType:
    """Motion along the double well."""
    model = gqm.derive(gqm.Curve.graph(HEIGHT, parameter="x"), gqm.Gravity())
    return gqm.build(model, name="shallow_well", folder=generated_folder)


@pytest.fixture
def tried(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Numbers of launches that batches try twice."""
    numbers, answer = [], sweep.answer_batches

    def counting(fns: Any, layout: Any, columns: Any, monotone: Any, code: Any, careful: bool, *rest: Any) -> None:
        if careful:
            numbers.append(rest[-1].status.size)
        answer(fns, layout, columns, monotone, code, careful, *rest)

    monkeypatch.setattr(sweep, "answer_batches", counting)
    return numbers


def height(x: Any) -> Any:
    """Return the height at a place."""
    return (x * x - 1) ** 2 / 4 + x * mpf("0.37")


def launches(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return launches in the right well, half of them from rest, up to 0.8 of the way to the hilltop."""
    _, hill, bottom = np.sort(np.roots([1.0, 0.0, -1.0, 0.37]).real)
    rng = np.random.default_rng(5)
    low, top = (float(height(mpf(float(x)))) for x in (bottom, hill))
    energies = low + rng.uniform(0.05, 0.8, count) * (top - low)
    ends = [np.sort(np.roots([0.25, 0.0, -0.5, 0.37, 0.25 - e]).real)[2:] for e in energies]
    shares = np.where(np.arange(count) % 2 == 0, 1.0 - 1e-9, rng.uniform(0.1, 0.9, count))
    lam0 = np.array([a + share * (b - a) for (a, b), share in zip(ends, shares, strict=True)])
    left = [e - float(height(mpf(float(x)))) for e, x in zip(energies, lam0, strict=True)]
    v0 = np.sqrt(2 * 9.81 * np.maximum(left, 0.0))
    return lam0, np.where(np.arange(count) % 2 == 0, 0.0, v0)


def test_turning_points_are_found_at_the_first_try(module: ModuleType, tried: list[int]) -> None:
    """No search passes over the hill into the other well, whether bodies are released or thrown."""
    lam0, v0 = launches(300)
    found = module.sweep("turning_points", lam0, v0)
    assert (tried, found.route_counts()) == ([], {"batch": 300})


def test_rough_orbits_are_corrected_at_the_first_try(module: ModuleType, tried: list[int]) -> None:
    """Half periods whose V**2 is rough in doubles wait for double-double arithmetic, and launches alone have the same
    bits.
    """
    lam0, v0 = launches(300)
    found = module.sweep("half_period", lam0, v0)
    assert (tried, found.route_counts()) == ([], {"batch": 300})
    some = range(0, 300, 7)
    assert [module.sweep("half_period", [lam0[k]], [v0[k]]).values[0] for k in some] == found.values[some].tolist()
    for k in range(4):
        with mp.workdps(30):
            energy = height(mpf(lam0[k])) + mpf(v0[k]) ** 2 / (2 * mpf("9.81"))
            roots = mp.polyroots(
                [mpf(1) / 4, 0, -mpf(1) / 2, mpf("0.37"), mpf(1) / 4 - energy], maxsteps=200, extraprec=60
            )
            d, c, a, b = sorted(mp.re(root) for root in roots)
            places = [(a + b) / 2 - (b - a) / 2 * mp.cos(mp.pi * (i + mpf(1) / 2) / 200) for i in range(200)]
            terms = [mp.hypot(1, x**3 - x + mpf("0.37")) / mp.sqrt(mpf("9.81") / 2 * (x - c) * (x - d)) for x in places]
            truth = mp.pi * mp.fsum(terms) / 200
        assert abs(mpf(float(found.values[k])) - truth) <= ULPS * np.spacing(float(truth))


def test_searches_come_back_from_poles(generated_folder: Path) -> None:
    """On the kappa curve, which ends at poles of the height, a search that steps to a pole finds the zero before it."""
    curve = gqm.Curve.polar("1.3*tan(theta)", parameter="theta", domain=("-pi/2", "pi/2"))
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="kappa_to_poles", folder=generated_folder)
    lam0, reach = np.linspace(-1.0, -0.3, 50), np.tile(np.linspace(1.38, 1.48, 10), 5)
    v0 = np.sqrt(2 * 9.81 * 1.3 * (np.sin(reach) * np.tan(reach) - np.sin(lam0) * np.tan(lam0)))
    found = module.sweep("turning_points", lam0, v0)
    assert found.route_counts() == {"batch": 50}
    np.testing.assert_allclose(found.values, np.column_stack([-reach, reach]), rtol=1e-14)
