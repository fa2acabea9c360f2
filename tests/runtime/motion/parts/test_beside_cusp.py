"""States, extremes and their derivatives just after releases at rest, from cusps and elsewhere."""

from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import gqm_sym as gqm
from gqm_sym.errors import SolutionError

G, R = 9.81, 0.5
W = np.sqrt(G / R)

# Relative errors of places and speeds however soon after the release: those of the coefficients of time in the phase.
SOON = 2e-14
TIMES = np.array([1e-12, 1e-9, 1e-7, 1e-5, 1e-3, 0.1])


@pytest.fixture(scope="module")
def wheel(generated_folder: Path) -> ModuleType:
    """A cycloid that hangs between its cusps."""
    curve = gqm.Curve.parametric(
        x="R*(u - sin(u))", z="R*(cos(u) - 1)", parameter="u", domain=("-2*pi", "2*pi"), parameters={"R": "1/2"}
    )
    return gqm.build(gqm.derive(curve, gqm.Gravity()), name="beside_cusps", folder=generated_folder)


RUBBING = gqm.Gravity() + gqm.CoulombFriction(mu="1/10")


@pytest.mark.parametrize(
    ("force", "share"), [(gqm.Gravity(), 1.0), pytest.param(RUBBING, 0.9, marks=pytest.mark.extended)]
)
def test_soon_after_a_release_on_a_plane(force: gqm.Kernel, share: float, generated_folder: Path) -> None:
    """Down a plane at 45 degrees, speed and place have all their digits at any time. They were 5e-10 off after 1e-7 s,
    and 7e-5 after 1e-12 s.
    """
    curve = gqm.Curve.parametric(x="u", z="-u", parameter="u", domain=(0, 3))
    module = gqm.build(gqm.derive(curve, force), name=f"soon_on_a_plane_{share < 1}", folder=generated_folder)
    motion, speed = module.solve(0), share * G / np.sqrt(2.0) * TIMES
    state = motion.state(TIMES)
    np.testing.assert_allclose(state.v, speed, rtol=SOON)
    np.testing.assert_allclose(state.lam, speed * TIMES / np.sqrt(8.0), rtol=SOON)


def test_soon_after_a_release_from_a_cusp(wheel: ModuleType) -> None:
    """The angle of the wheel is sqrt(g/R) times the time. Place and speed were 6e-11 off after 1e-7 s, and the contact
    force at the launch was NaN. At the other cusp, which is as high, the body is at rest again.
    """
    motion = wheel.solve(0)
    angle = W * TIMES
    state = motion.state(TIMES)
    np.testing.assert_allclose(state.lam, angle, rtol=SOON)
    np.testing.assert_allclose(state.v, 2.0 * R * W * np.sin(0.5 * angle), rtol=SOON)
    np.testing.assert_allclose(state.normal_force, 2.0 * G * np.sin(0.5 * angle), rtol=1e-13)
    assert abs(motion.state(0.0).normal_force) < 1e-14
    assert abs(motion.state([0.0, 0.1]).normal_force[0]) < 1e-14


@pytest.mark.parametrize("start", ["2*pi", "-2*pi"])
def test_where_the_place_of_a_cusp_is_rounded(start: str, wheel: ModuleType) -> None:
    """The body is at rest again at the other cusp, where the contact force vanishes as it does at the first one. Its
    largest value, at the bottom, was replaced by infinity at the second cusp.
    """
    motion = wheel.solve(start)
    places = motion.lam(TIMES) - motion.problem.lam0
    np.testing.assert_allclose(places, motion.direction * W * TIMES, atol=2e-15)
    most, least = motion.normal_force_max, motion.normal_force_min
    assert (most.value, most.t) == (pytest.approx(2.0 * G, rel=1e-15), pytest.approx(np.pi / W, rel=1e-12))
    assert abs(least.value) < 1e-14
    assert motion.gradient("normal_force_max", ("g", "R")) == pytest.approx({"g": 2.0, "R": 0.0}, abs=1e-15)


def test_derivatives_of_the_force_at_a_release_from_a_cusp(generated_folder: Path) -> None:
    """At a cusp whose tangent falls by 45 degrees, the force at the release is the least one, -m g/sqrt(2). Its
    derivatives were refused, as if the body were thrown. With respect to place and speed of the launch there are none.
    """
    curve = gqm.Curve.parametric(x="u**2", z="u**3/2 - u**2", parameter="u", domain=(-1, 0))
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="force_at_a_cusp", folder=generated_folder)
    motion = module.solve(0, 0, -1)
    least = motion.normal_force_min
    assert (least.value, least.t) == (pytest.approx(-G / np.sqrt(2.0), rel=2e-15), 0.0)
    assert motion.state(0.0).normal_force == least.value
    wanted = {"g": -np.sqrt(0.5), "m": least.value}
    assert motion.gradient("normal_force_min", ("g", "m")) == pytest.approx(wanted, rel=2e-15)
    with pytest.raises(SolutionError, match="respect to lam0, v0, because the contact force jumps at the cusp"):
        motion.gradient("normal_force_min")
