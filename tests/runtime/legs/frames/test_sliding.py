"""A body that is released, or turns, a little beyond the angle of friction slides over a distance of the same size.

On a circle with sliding friction V**2 has a closed form, from which truth comes by quadrature at 60 digits.
"""

import math
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from mpmath import mp, mpf

import gqm_sym as gqm

MU, G = 0.05, 9.81
ANGLE = math.atan(MU)


@pytest.fixture(scope="module")
def circle(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """Return the module of a circle with friction and drag."""
    forces = gqm.Gravity() + gqm.CoulombFriction() + gqm.QuadraticDrag(b="c_d")
    model = gqm.derive(gqm.families.circle(L=1), forces)
    module: ModuleType = gqm.build(model, name="sliding_circle", folder=tmp_path_factory.mktemp("sliding"))
    return module


def slide_from(lam0: float) -> tuple[mpf, mpf]:
    """Return the place and the time at which a body comes to rest that slides down from rest, without drag.

    With friction ``dW/dlam = 2 mu W - 2 g (sin(lam) - mu cos(lam))``, which has the solution
    ``a cos(lam) + b sin(lam) + c exp(2 mu lam)``.
    """
    start, mu, g = mpf(lam0), mpf(MU), mpf(G)
    a = 2 * g * (1 - 2 * mu**2) / (1 + 4 * mu**2)
    b = 2 * mu * (g + a)
    at_start = a * mp.cos(start) + b * mp.sin(start)

    def v2(lam: mpf) -> mpf:
        return a * mp.cos(lam) + b * mp.sin(lam) - at_start * mp.exp(2 * mu * (lam - start))

    mirrored = 2 * mp.atan(mu) - start
    end = mp.findroot(v2, (mirrored, mirrored + (start - mirrored) / 1000), tol=mpf(10) ** -110)
    middle, half = (start + end) / 2, (start - end) / 2

    def rate(u: mpf) -> mpf:
        return half * mp.sin(u) / mp.sqrt(v2(middle + half * mp.cos(u)))

    return end, mp.quad(rate, [0, mp.pi], method="gauss-legendre")


@pytest.mark.extended
@pytest.mark.parametrize("distance", [1e-13, 1e-11, 1e-9, 3e-8, 1e-7, 6e-7, 1e-6, 1e-5])
def test_a_short_slide_has_all_digits(distance: float, circle: ModuleType) -> None:
    """The place of rest is that of truth to a few roundings of places, and the time has twelve digits and more, all of
    them where the distance is below the share at which the slide is followed by its distance.
    """
    lam0 = ANGLE + distance
    with mp.workdps(60):
        end, time = slide_from(lam0)
    motion = circle.solve(lam0, mu=MU, c_d=0, g=G)
    assert abs(motion.rest_position - end) <= 2 * math.ulp(ANGLE)
    assert abs(motion.t_end / time - 1) <= (1e-15 if distance < 7e-7 else 2e-12)


def test_a_swing_that_turns_beyond_the_angle_of_friction_comes_to_rest(circle: ModuleType) -> None:
    """A leg that is 3e-8 long after a leg a million times as long was refused.

    The time of rest is a smooth function of the launch, on whose tangent the neighbours lie.
    """
    lam0 = np.linspace(0.2, 1.4, 1_000_000)[509173]
    launches = lam0 + np.array([-3e-8, -1e-8, 0.0, 1e-8, 3e-8, 9e-8])
    swept = circle.sweep("t_end", lam0=launches, mu=MU, c_d=0.05)
    assert not np.isnan(swept.values).any()
    assert [circle.solve(lam, mu=MU, c_d=0.05).t_end for lam in launches.tolist()] == swept.values.tolist()
    slopes = np.diff(swept.values) / np.diff(launches)
    np.testing.assert_allclose(slopes, slopes[-1], rtol=1e-6)


def test_a_short_slide_on_a_graph_agrees_with_its_scaled_copy(tmp_path: Path) -> None:
    """Next to the angle of friction a curve is its osculating circle: the slide takes half the period of a small swing,
    but for terms of the order of its size.
    """
    model = gqm.derive(gqm.Curve.graph("x**2/2", parameter="x"), gqm.Gravity() + gqm.CoulombFriction())
    module = gqm.build(model, name="sliding_graph", folder=tmp_path)
    # With W in place of the distance, dW/dx = 2 mu kappa ds W - 2 g (x - mu), where ds = sqrt(1 + x**2).
    motion = module.solve(MU + 1e-10, mu=MU, g=G)
    assert motion.rest_position == pytest.approx(MU - 1e-10, abs=1e-17)
    assert motion.t_end == pytest.approx(math.pi * math.sqrt((1.0 + MU**2) / G), rel=1e-9)
