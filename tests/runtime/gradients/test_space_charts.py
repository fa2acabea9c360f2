"""Gradients of motions along points and rails in space agree with planar ones and with differences of exact answers."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gqm_sym as gqm

GIVEN = np.linspace(-2.0, 2.0, 41)
HEIGHT = 0.5 * GIVEN**2 + 0.01 * np.cos(3.0 * GIVEN)
STEP = 2.0**-8
FIELDS = ("lam", "x", "y", "z", "v", "normal_force")


def slope(answer: Callable[[float], Any], at: float) -> Any:
    """Return the derivative by a central difference of the order 6."""
    terms = [(3, 1.0), (2, -9.0), (1, 45.0)]
    total = sum(c * (np.asarray(answer(at + k * STEP)) - np.asarray(answer(at - k * STEP))) for k, c in terms)
    return total / (60.0 * STEP)


def test_a_vertical_plane_is_the_planar_case(generated_folder: Path) -> None:
    """Points in a vertical plane that is turned about the vertical have the gradients of points in the plane."""
    flat, turned = (GIVEN, HEIGHT), (0.6 * GIVEN, 0.8 * GIVEN, HEIGHT)
    motions = []
    for name, points in (("flat", flat), ("turned", turned)):
        model = gqm.derive(gqm.Curve.sampled(np.column_stack(points)), gqm.Gravity())
        motions.append(gqm.build(model, name=f"gradient_{name}", folder=generated_folder).solve(4.0, 0.5))
    for quantity in ("half_period", "turning_points", "v_max", "normal_force_max"):
        one, other = (motion.gradient(quantity) for motion in motions)
        assert other.keys() == one.keys()
        for name, value in one.items():
            assert np.asarray(other[name]) == pytest.approx(np.asarray(value), rel=1e-13, abs=1e-15)
    one, other = (motion.sensitivity(1.3) for motion in motions)
    assert other.x == pytest.approx(0.6 * one.x, rel=1e-12)
    assert other.y == pytest.approx(0.8 * one.x, rel=1e-12)
    for field in ("lam", "z", "v", "normal_force"):
        assert getattr(other, field) == pytest.approx(getattr(one, field), rel=1e-12)


@pytest.mark.extended
def test_points_in_space(generated_folder: Path) -> None:
    """The derivatives with respect to the launch place are those of differences."""
    points = np.column_stack([GIVEN, 0.3 * np.sin(GIVEN), HEIGHT])
    model = gqm.derive(gqm.Curve.sampled(points), gqm.Potential("G*z + x**2/5 + y/3"))
    module = gqm.build(model, name="gradient_points", folder=generated_folder)

    def state(x: float) -> Any:
        return np.array([getattr(module.solve(x, 0.5, G=9.81).state(2.3), field) for field in FIELDS])

    middle = module.solve(4.0, 0.5, G=9.81)
    found = middle.gradient("half_period")
    expected = slope(lambda x: module.solve(x, 0.5, G=9.81).half_period, 4.0)
    assert found["lam0"] == pytest.approx(expected, rel=1e-11)
    largest = slope(lambda x: module.solve(x, 0.5, G=9.81).normal_force_max.value, 4.0)
    assert middle.gradient("normal_force_max")["lam0"] == pytest.approx(largest, rel=1e-10)
    changes = middle.sensitivity(2.3)
    assert [getattr(changes, field)[0] for field in FIELDS] == pytest.approx(slope(state, 4.0), rel=1e-9)
    swept = module.sweep("half_period", [4.0], 0.5, G=9.81, gradient=("lam0", "G")).gradient[0]
    assert swept == pytest.approx([found["lam0"], found["G"]], rel=1e-14)


@pytest.mark.extended
def test_a_rail_that_parameters_shape(generated_folder: Path) -> None:
    """Lengths and rates of pieces in space displace the points of the rail and change its arc length."""
    pieces = [
        gqm.transition(length="1"),
        gqm.transition(length="L", yaw="q", pitch="pi/8"),
        gqm.transition(length="4", yaw="-1/10", pitch="pi/8"),
        gqm.transition(length="2"),
    ]
    rail = gqm.Curve.piecewise(pieces, start=("0", "0", "4"), heading=("0", "-pi/2"))
    module = gqm.build(gqm.derive(rail, gqm.Gravity()), name="gradient_rail", folder=generated_folder)
    given = {"L": 4.0, "q": 0.125}
    motion = module.solve(2.0, 0.25, **given)
    ends, force, changes = (
        motion.gradient("turning_points"),
        motion.gradient("normal_force_max"),
        motion.sensitivity(2.3),
    )
    period, seconds = motion.gradient("half_period"), motion.gradient("half_period", ("lam0", *given), order=2)
    for name, value in given.items():

        def answers(x: float, name: str = name) -> Any:
            moved = module.solve(2.0, 0.25, **{**given, name: x})
            state = moved.state(2.3)
            one = [moved.half_period, *moved.turning_points, moved.normal_force_max.value]
            slopes = moved.gradient("half_period", ("lam0", *given)).values()
            return np.array([*one, *slopes, *(getattr(state, field) for field in FIELDS)])

        at = changes.wrt.index(name)
        one = [period[name], *ends[name], force[name], *seconds[name].values()]
        found = [*one, *(getattr(changes, field)[at] for field in FIELDS)]
        assert found == pytest.approx(slope(answers, value), rel=1e-9, abs=1e-9)
