"""The gradients of sweeps and motions serve SciPy's optimisers as ``jac``, and these find what closed forms say."""

from types import ModuleType

import numpy as np
import pytest
from mpmath import mp, mpf
from paths import ROOT
from scipy.optimize import check_grad, least_squares, minimize

from gqm_sym.loading import load


@pytest.fixture(scope="module")
def circle() -> ModuleType:
    """Return a bead on a circle."""
    return load(str(ROOT / "generated" / "circle.py"), "circle")


def test_least_squares(circle: ModuleType) -> None:
    """A length and an offset of all amplitudes follow from periods that are complete elliptic integrals."""
    amplitudes, length, offset = np.array([0.4, 0.9, 1.3, 1.9]), 1.25, -0.02
    with mp.workdps(30):
        periods = [
            4 * mp.sqrt(mpf(length) / mpf("9.81")) * mp.ellipk(mp.sin((a + offset) / 2) ** 2) for a in amplitudes
        ]

    def swept(x: np.ndarray) -> object:
        return circle.sweep("period", lam0=amplitudes + x[1], L=x[0], gradient=("L", "lam0"))

    measured = np.array(periods, dtype=float)
    found = least_squares(
        lambda x: swept(x).values - measured, (1.0, 0.0), jac=lambda x: swept(x).gradient, xtol=1e-15, gtol=1e-15
    )
    np.testing.assert_allclose(found.x, [length, offset], rtol=0, atol=1e-12)
    assert found.nfev < 12


def test_minimize(circle: ModuleType) -> None:
    """The amplitude with a given period is found from values with their gradients, and both agree."""
    with mp.workdps(30):
        period = float(4 / mp.sqrt(mpf("9.81")) * mp.ellipk(mp.sin(mpf("0.7")) ** 2))

    def gap(x: np.ndarray) -> tuple[float, np.ndarray]:
        found = circle.sweep("period", lam0=x[0], L=1, gradient="lam0")
        off = float(found.values - period)
        return off**2, 2 * off * found.gradient

    assert check_grad(lambda x: gap(x)[0], lambda x: gap(x)[1], np.array([1.1])) < 1e-6
    found = minimize(gap, (1.0,), jac=True, tol=1e-14)
    assert abs(found.x[0] - 1.4) < 1e-6


def test_motions_with_losses() -> None:
    """The friction with which a body stops at a place on a circle satisfies the closed form of its motion."""
    module = load(str(ROOT / "generated" / "circle_coulomb.py"), "circle_coulomb")

    def rest(x: np.ndarray) -> tuple[float, np.ndarray]:
        motion = module.solve(lam0=0.2, v0=1.0, mu=float(x[0]), mu_static=0.9)
        slope = motion.gradient("rest_position", "mu")["mu"]
        off = motion.rest_position - 0.3
        return off**2, np.array([2 * off * slope])

    found = minimize(rest, (0.05,), jac=True, tol=1e-16)
    mu = found.x[0]
    # W = K exp(-2 mu theta) + A cos(theta) + B sin(theta) vanishes at the turning point.
    a, b = 2 * 9.81 * (1 - 2 * mu**2) / (1 + 4 * mu**2), -6 * mu * 9.81 / (1 + 4 * mu**2)
    start = 1.0 - a * np.cos(0.2) - b * np.sin(0.2)
    assert abs(start * np.exp(-0.2 * mu) + a * np.cos(0.3) + b * np.sin(0.3)) < 1e-5
