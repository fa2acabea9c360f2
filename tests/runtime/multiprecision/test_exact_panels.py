"""Extended precision lays panels over slow passages of hilltops."""

from types import ModuleType

import numpy as np
import pytest
from mpmath import mp, mpf
from paths import ROOT

import gqm_sym as gqm
from gqm_sym.building import transient
from gqm_sym.loading import load
from gqm_sym.runtime.multiprecision.gauss_legendre import legendre_rule

ENERGY, USEFUL = 2e-14, 1e-11
# A random run found these launches: from rest, and slightly faster than necessary at a hilltop.
LAUNCHES = ((5.725266733964419, 0.0, -1), (5.754549511786295, 0.43248306634587075, 1), (0.7953743236188708, 0.0, -1))


@pytest.fixture(scope="module")
def planes() -> ModuleType:
    """Return the example of the repository."""
    return load(ROOT / "generated" / "planes.py", "planes")


@pytest.mark.extended
@pytest.mark.parametrize(("lam0", "v0", "direction"), LAUNCHES)
def test_panels_begin_at_the_joints(lam0: float, v0: float, direction: int, planes: ModuleType) -> None:
    """V**2 along the motion is that of the height lost, and the bound on places is useful."""
    motion = planes.solve(lam0, v0, direction)
    t = np.linspace(0.0, min(motion.t_end, 10.0), 300)[1:-1]
    state, start = motion.state(t), planes.pass1(lam0, lam0, v0, direction)
    wanted = v0**2 + 2 * 9.81 * (start.z - state.z)
    assert np.abs(state.v2 - wanted).max() <= ENERGY * np.abs(wanted).max()
    assert np.max(motion.error_bound(t)) <= USEFUL


@pytest.mark.extended
def test_many_hills_and_a_slow_passage() -> None:
    """After 400 panels the rest of the orbit was left to one, on which nothing was right, or the launch was refused;
    now it is right.
    """
    module = transient(gqm.derive(gqm.Curve.graph("x**2/40 + cos(8*x)/2", parameter="x"), gqm.Gravity()))
    # The launch is a millimetre above the twelfth hilltop.
    motion = module.solve(10.063448508143175)
    state, start = motion.state(np.linspace(0.0, motion.period, 1000)), module.pass1(10.063448508143175, lam0=0).z
    wanted = 2 * 9.81 * (start - state.z)
    assert np.abs(state.v2 - wanted).max() <= ENERGY * wanted.max()
    x = np.linspace(0.3, 0.5, 200_001)
    lowest = (x**2 / 40 + np.cos(8 * x) / 2).min()
    assert motion.v_max.value == pytest.approx(np.sqrt(2 * 9.81 * (start - lowest)), rel=1e-10)


@pytest.mark.parametrize(("count", "digits"), [(20, 40), (48, 80), (96, 210)])
def test_gauss_legendre_rules(count: int, digits: int) -> None:
    """Rules have all requested digits: the nodes are zeros, and powers up to 2n - 1 are integrated exactly."""
    rule = legendre_rule(count, digits)
    with mp.workdps(digits + 10):
        tolerance = mpf(10) ** (1 - digits)
        for power in (0, 2, count, 2 * count - 2):
            assert abs(2 * mp.fsum(weight * x**power for x, weight, _ in rule) - mpf(2) / (power + 1)) <= tolerance
        for x, _, last in rule[:: count // 8]:
            assert abs(mp.legendre(count, x)) <= tolerance * count
            assert abs(mp.legendre(count - 1, x) - last) <= tolerance
