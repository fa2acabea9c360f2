"""Graphs whose slope is a sum of terms of different growth: V² and N far away from the launch have their digits.

The references are the definitions in 50 digits: heights and slopes by mpmath's own derivatives.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import gqm_sym as gqm

LAUNCH, SPEED, G = 0.5, 3.0, mpf("9.81")
HEIGHTS: dict[str, Callable[[Any], Any]] = {
    "tanh(x)": mp.tanh,
    "x*tanh(x)": lambda x: x * mp.tanh(x),
    "1/cosh(x)": mp.sech,
    "exp(-x**2)": lambda x: mp.exp(-(x**2)),
    "1/(1+exp(-x))": lambda x: 1 / (1 + mp.exp(-x)),
    "sin(x)+1/(1+x**2)": lambda x: mp.sin(x) + 1 / (1 + x**2),
    "tanh(x)/6-cos(2*x)/3": lambda x: mp.tanh(x) / 6 - mp.cos(2 * x) / 3,
}


def centre(height: str, place: float, radius: mpf) -> tuple[mpf, mpf, mpf]:
    """Return the height of the centre of a body on the graph, the path's curvature, and the cosine of its slope."""
    z = HEIGHTS[height]
    first, second = mp.diff(z, place), mp.diff(z, place, 2)
    root = mp.sqrt(1 + first**2)
    kappa = second / root**3
    return z(mpf(place)) + radius / root, kappa / (1 - kappa * radius), 1 / root


@pytest.mark.sample(1)
@pytest.mark.parametrize("rolls", [False, True])
@pytest.mark.parametrize("height", list(HEIGHTS))
def test_speeds_and_contact_forces(height: str, rolls: bool, tmp_path: Path) -> None:
    """They are within a few roundings of the terms of their definitions at distances up to 200."""
    law = gqm.Gravity() + gqm.Rolling(radius="1/100", beta="2/5") if rolls else gqm.Gravity()
    module = gqm.build(gqm.derive(gqm.Curve.graph(height, parameter="x"), law), name="far", folder=tmp_path)
    places = np.array([5.0, 12.0, 20.0, 50.0, 119.0, 200.0])
    places = np.concatenate([-places[::-1], places])
    found = module.pass1(places, lam0=LAUNCH, v0=SPEED)
    with mp.workdps(50):
        radius, beta = (mpf(1) / 100, mpf(2) / 5) if rolls else (mpf(0), mpf(0))
        start, _, _ = centre(height, LAUNCH, radius)
        for k, place in enumerate(places.tolist()):
            at, kappa, cosine = centre(height, place, radius)
            size = SPEED**2 + 2 * G * (abs(start) + abs(at))
            v2 = SPEED**2 - 2 * G * (at - start) / (1 + beta)
            assert abs(found.v2[k] - v2) <= 1e-15 * size, place
            assert abs(found.normal_force[k] - (G * cosine + kappa * v2)) <= 2e-15 * (G + abs(kappa) * size), place


@pytest.mark.extended
def test_a_motion_that_needs_them(tmp_path: Path) -> None:
    """A body that rolls over the hills of a wavy graph with a step is found to leave, and not to turn 14 m away."""
    curve = gqm.Curve.graph("tanh(x)/6-cos(2*x)/3", parameter="x")
    law = gqm.Potential("9*z + x/3") + gqm.Rolling(radius="1/100", beta="2/5")
    module = gqm.build(gqm.derive(curve, law), name="leaves", folder=tmp_path)
    launch = 1.0888733968648474, 1.2345081526089026
    motion = module.solve(*launch)
    assert motion.kind == "transit"
    swept = module.sweep("half_period", *launch)
    assert np.isnan(swept.values).all()
    # V² at the place where the body was said to turn, by the definition in 50 digits.
    with mp.workdps(50):

        def energy(place: float) -> mpf:
            height, _, cosine = centre("tanh(x)/6-cos(2*x)/3", place, mpf(1) / 100)
            slope = 2 * mp.sin(2 * mpf(place)) / 3 + mp.sech(mpf(place)) ** 2 / 6
            return 9 * height + (mpf(place) - slope * cosine / 100) / 3

        v2 = launch[1] ** 2 - 2 * (energy(-12.94289844) - energy(launch[0])) / mpf("1.4")
    assert v2 > 1
    assert module.pass1(np.array([-12.94289844]), *launch).v2[0] == pytest.approx(float(v2), rel=1e-14)
