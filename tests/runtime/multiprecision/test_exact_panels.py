"""Extended precision lays panels over slow passages of hilltops."""

import math
from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest
from mpmath import mp, mpf
from paths import ROOT

import gqm_sym as gqm
from gqm_sym.building import transient
from gqm_sym.loading import load
from gqm_sym.runtime.multiprecision.exact_panels import ALL_NODES, DIGITS, ExactRates, exact_ends
from gqm_sym.runtime.multiprecision.gauss_legendre import legendre_rule
from gqm_sym.runtime.quadrature.substitution import FROM_TURN, REGULAR, TURN_TURN

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


@pytest.mark.parametrize(
    ("lam0", "v0", "kind", "ends"),
    [
        (math.pi, 0.0, TURN_TURN, (-math.pi, math.pi)),  # released 1e-16 beside the hilltop
        (0.0, 2.0 * math.sqrt(9.81), REGULAR, (0.0, 2.0 * math.pi)),  # passes it with 1e-8 m/s
        (math.pi, 0.0, FROM_TURN, (math.pi, 1.0)),
    ],
)
def test_the_integrands_where_the_body_is_slow(
    lam0: float, v0: float, kind: int, ends: tuple[float, float], module_of: Callable[[str], ModuleType]
) -> None:
    """By polynomials of the distance from a turning point or a hilltop they are those of 80 digits, which took up to
    half a second a motion.
    """
    problem = module_of("circle").solve(lam0, v0, L=1, g=9.81).problem
    exact = problem.functions.exact
    known = exact_ends(exact, DIGITS, kind, *ends, (None, None))
    rates, scale = ExactRates(exact, kind, known), exact.at(DIGITS)
    assert rates.slow is not None
    begin = scale.context.pi / 2 if kind == REGULAR else scale.mpf(0)
    for size in (1e-9, 1e-7, 1e-5):
        middle, reach = begin + scale.mpf(1.5 * size), scale.mpf(0.5 * size)
        if kind == REGULAR:
            middle = scale.mpf(0.5) + middle - begin
        found = rates.slow(middle, reach, ALL_NODES)
        assert found is not None
        np.testing.assert_allclose(found, rates._by_mpmath(middle, reach), rtol=1e-15)
