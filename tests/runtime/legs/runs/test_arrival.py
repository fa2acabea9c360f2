"""Swept times at places before the next turn agree with closed forms, and with the motions that turn before."""

from collections.abc import Callable
from math import acosh, cosh, exp, inf, sqrt
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import gqm_sym as gqm

G = 9.81


@pytest.fixture
def slope(generated_folder: Path) -> Callable[[Any, str], ModuleType]:
    """Return a function that builds a straight track of slope 3/4 with a force, down which bodies slide for ever."""

    def build(force: Any, name: str) -> ModuleType:
        curve = gqm.Curve.parametric(x="4*u/5", z="-3*u/5", parameter="u")
        return gqm.build(gqm.derive(curve, gqm.Gravity() + force), name=f"down_{name}", folder=generated_folder)

    return build


PLACES = np.array([1e-6, 0.01, 0.5, 2.0, 7.0, 30.0])


def test_friction_on_a_slope(slope: Callable[[Any, str], ModuleType]) -> None:
    """The acceleration is constant; behind the launch and at a turn that never comes there is no time."""
    swept = slope(gqm.CoulombFriction(), "friction").sweep("time_at", 0.0, lam=PLACES, mu=0.25)
    assert swept.values == pytest.approx(np.sqrt(2 * PLACES / (G * (0.6 - 0.25 * 0.8))), rel=1e-15)
    behind = slope(gqm.CoulombFriction(), "friction").sweep("time_at", 0.0, lam=-PLACES, mu=0.25, t_max=5.0)
    assert np.isnan(behind.values).all()


def test_drag_on_a_slope(slope: Callable[[Any, str], ModuleType]) -> None:
    """V**2 = a/c (1 - exp(-2 c s)), so the time is acosh(exp(c s))/sqrt(a c); up to V**2 = 0.98 of its limit."""
    a, c = 0.6 * G, 0.0625
    swept = slope(gqm.QuadraticDrag(b="c_d"), "drag").sweep("time_at", 0.0, lam=PLACES, c_d=c)
    assert swept.values[1:] == pytest.approx([acosh(exp(c * s)) / sqrt(a * c) for s in PLACES[1:]], rel=4e-15)
    s = PLACES[0]  # by the series of acosh(exp(y)) for small y
    assert swept.values[0] == pytest.approx(sqrt(2 * s / a) * (1 + c * s / 6), rel=1e-15)
    late = slope(gqm.QuadraticDrag(b="c_d"), "drag").sweep("time_at", 0.0, lam=PLACES, c_d=c, t_max=1.0)
    assert (np.isnan(late.values) == (cosh(sqrt(a * c)) < np.exp(c * PLACES))).all()


@pytest.mark.extended
@pytest.mark.parametrize("force", ["friction", "drag", "droplet"])
def test_places_before_and_behind_a_turn(force: str, generated_folder: Path) -> None:
    """In a bowl, places before the first turn are passed as the solved motion says, and places behind it are not."""
    law = {"friction": gqm.CoulombFriction(), "drag": gqm.QuadraticDrag(b="c_d"), "droplet": gqm.SurfaceTension()}
    given = {
        "friction": {"mu": 0.05},
        "drag": {"c_d": 0.05, "t_max": 5.0},
        "droplet": {"gamma": 0.05, "ell_c": 0.1, "t_max": 5.0},
    }
    curve = gqm.Curve.graph("x**2/2 + sin(3*x)/10")
    module = gqm.build(gqm.derive(curve, gqm.Gravity() + law[force]), name=f"bowl_{force}", folder=generated_folder)
    motion = module.solve(0.9, 0.0, **given[force])
    turn = float(motion.legs[0].lam_end)
    places = 0.9 + (turn - 0.9) * np.array([0.02, 0.2, 0.4, 0.5, 0.7, 0.9, 0.99, 1.01, 1.5])
    swept = module.sweep("time_at", 0.9, lam=places, **given[force])
    solved = [motion.time_at(place) if place > turn else inf for place in places.tolist()]
    assert (np.isnan(swept.values) == np.isinf(solved)).all()
    assert swept.values[:7] == pytest.approx(solved[:7], rel=2e-15, abs=0.0)
