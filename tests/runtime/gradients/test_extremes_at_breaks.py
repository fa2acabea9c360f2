"""Gradients of extremes at the corner of two planes, where the contact force jumps and the slope of V**2 does."""

from itertools import pairwise
from math import hypot, sqrt
from pathlib import Path
from types import ModuleType

import pytest

import gqm_sym as gqm

G, M = 9.81, 1.0
# Two planes that meet in a corner, and four with corners beside the lowest one.
POINTS = {
    "two": [(-2.0, 2.0), (0.0, -0.1), (2.3, 1.7)],
    "four": [(-2.0, 2.0), (-0.5, 0.3), (0.0, -0.1), (0.4, 0.0), (2.3, 1.7)],
}


@pytest.fixture(scope="module", params=POINTS)
def planes(request: pytest.FixtureRequest, generated_folder: Path) -> tuple[ModuleType, list[tuple[float, float]]]:
    """Return a module of planes, and their points."""
    points = POINTS[request.param]
    model = gqm.derive(gqm.Curve.sampled(points, kind="linear"), gqm.Gravity())
    return gqm.build(model, name=f"{request.param}_planes", folder=generated_folder), points


@pytest.mark.sample(3)
@pytest.mark.parametrize("height", [0.5, 1.2])
@pytest.mark.parametrize("v0", [0.0, 0.9])
def test_gradients_at_corners(planes: tuple[ModuleType, list[tuple[float, float]]], height: float, v0: float) -> None:
    """The gradients are those of closed forms, by one motion and by a sweep."""
    module, points = planes
    pairs = list(pairwise(points))
    lengths = [hypot(x1 - x0, z1 - z0) for (x0, z0), (x1, z1) in pairs]
    slope = (points[1][1] - points[0][1]) / lengths[0]
    lam0, top, fall = (height - points[0][1]) / slope, height + v0**2 / (2.0 * G), height + 0.1
    motion = module.solve(lam0, v0)
    assert motion.kind == "libration"
    v_max = sqrt(v0**2 + 2.0 * G * fall)
    wanted = {"g": fall / v_max, "m": 0.0, "lam0": G * slope / v_max, "v0": v0 / v_max}
    assert motion.gradient("v_max") == pytest.approx(wanted, rel=1e-13, abs=1e-15)
    cosines = [
        (x1 - x0) / length for ((x0, z0), (x1, z1)), length in zip(pairs, lengths, strict=True) if min(z0, z1) < top
    ]
    for quantity, cosine in (("normal_force_max", max(cosines)), ("normal_force_min", min(cosines))):
        wanted = {"g": M * cosine, "m": G * cosine, "lam0": 0.0, "v0": 0.0}
        assert getattr(motion, quantity).value == pytest.approx(M * G * cosine, rel=1e-15)
        assert motion.gradient(quantity) == pytest.approx(wanted, rel=1e-13, abs=1e-15)
        swept = module.sweep(quantity, [lam0], v0, gradient=("g", "m"))
        assert swept.gradient[0] == pytest.approx([wanted["g"], wanted["m"]], rel=1e-13)
