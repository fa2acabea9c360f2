"""Turns that are found by the data kept of the gaps between breaks: friction on a circle that is an implicit curve.

With the angle from the bottom, dW/dtheta = -2 g sin(theta) - 2 v mu (W + g cos(theta)) for W = V**2 and v = the sign of
dtheta/dt. So W is K exp(-2 mu v theta) + A cos(theta) + B sin(theta); the body stays where tan|theta| <= mu.
"""

from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym.runtime.model import CompiledModel

G, MU = mpf("9.81"), mpf("0.05")

LAUNCHES = np.linspace(0.06, 1.2, 39)


@pytest.fixture(scope="module")
def module(tmp_path_factory: pytest.TempPathFactory) -> CompiledModel:
    """Friction on the unit circle, whose parameter is the arc length from the bottom."""
    curve = gqm.Curve.implicit("x**2 + z**2 - 1", start=("0", "-1"))
    folder: Path = tmp_path_factory.mktemp("gaps")
    return gqm.build(gqm.derive(curve, gqm.Gravity() + gqm.CoulombFriction()), name="circle_chart", folder=folder)


def speed_squared(start: mpf, v: int, theta: mpf) -> mpf:
    """Return W on a leg that begins at rest."""
    a, b = 2 * G * (1 - 2 * MU**2) / (1 + 4 * MU**2), -6 * v * MU * G / (1 + 4 * MU**2)
    rest = -a * mp.cos(start) - b * mp.sin(start)
    return rest * mp.exp(-2 * MU * v * (theta - start)) + a * mp.cos(theta) + b * mp.sin(theta)


def turns_to_rest(start: float) -> list[mpf]:
    """Return the places between which the body moves, from the launch to where it stays."""
    found = [mpf(start)]
    while mp.tan(abs(found[-1])) > MU:
        here, v = found[-1], -int(mp.sign(found[-1]))
        # The turn lies between the place where the forces balance and the mirror image of the start.
        found.append(mp.findroot(partial(speed_squared, here, v), (-v * mp.atan(MU), -here), solver="anderson"))
    return found


def test_bodies_rest_where_the_closed_form_says(module: CompiledModel) -> None:
    """Next to a turn the piece of the curve on which the body is decides whether it stays."""
    with mp.workdps(40):
        true = [turns_to_rest(start) for start in LAUNCHES.tolist()]
        swept = module.sweep("rest_position", LAUNCHES, 0.0, mu=0.05, g=9.81)
        np.testing.assert_allclose(swept.values, [float(turns[-1]) for turns in true], rtol=0, atol=2e-15)
        assert max(len(turns) for turns in true) > 5
    for start, turns in zip(LAUNCHES[::6].tolist(), true[::6], strict=True):
        motion = module.solve(start, 0.0, mu=0.05, g=9.81)
        np.testing.assert_allclose(motion.turning_points, list(map(float, turns[:-1])), rtol=0, atol=2e-15)


@pytest.mark.parametrize("start", [0.35, 0.7, 1.1])
def test_times_to_rest(start: float, module: CompiledModel) -> None:
    """The time up to a turn is counted back from there."""
    with mp.workdps(30):
        turns, time = turns_to_rest(start), mpf(0)
        for here, there in pairwise(turns):
            v, half = int(mp.sign(there - here)), (there - here) / 2

            def rate(angle: mpf, here: mpf = here, half: mpf = half, v: int = v) -> mpf:
                place = here + half * (1 - mp.cos(angle))
                return abs(half) * mp.sin(angle) / mp.sqrt(speed_squared(here, v, place))

            time += mp.quad(rate, [mpf(0), mp.pi / 2, mp.pi], method="gauss-legendre")
        np.testing.assert_allclose(module.sweep("t_end", start, 0.0, mu=0.05, g=9.81).values, float(time), rtol=4e-15)
