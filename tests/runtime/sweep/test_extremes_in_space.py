"""The smallest and largest contact force on orbits in space, where the force has a length and no sign."""

from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import gqm_sym as gqm

Build = Callable[..., ModuleType]

# A wire that winds about the level x axis. Its rise per radian is a run-time parameter.
WIRE = gqm.Curve.space(x="a*t", y="sin(t)", z="-cos(t)", parameter="t", parameters={"a": None})


def extremes_of_wire(a: float, start: float, g: float) -> tuple[Any, Any]:
    """Return the smallest and the largest contact force per mass on the wire, from rest, with forty digits.

    With s' = sqrt(1 + a**2), the square of the force is a quadratic function of c = cos(t): the curvature is 1/s'**2,
    dz/ds = sin(t)/s', d2z/ds2 = c/s'**2, and V**2 = 2 g (c - cos(start)).
    """
    with mp.workdps(40):
        s2, low, g = 1 + mpf(a) ** 2, mp.cos(mpf(start)), mpf(g)

        def square(c: Any) -> Any:
            v2 = 2 * g * (c - low)
            return (v2 / s2) ** 2 + 2 * g * c / s2 * v2 + g**2 * (1 - (1 - c * c) / s2)

        second = (square(mpf(1)) + square(mpf(-1))) / 2 - square(mpf(0))
        vertex = -(square(mpf(1)) - square(mpf(-1))) / (4 * second)
        places = [low, mpf(1)] + [vertex] * (low < vertex < 1)
        values = [mp.sqrt(square(c)) for c in places]
        return min(values), max(values)


@pytest.mark.extended
def test_on_a_wire_about_a_level_axis(build: Build) -> None:
    """Both extremes are exact to a few roundings of the largest force, also where the force almost vanishes."""
    module = build("level_wire_extremes", WIRE, gqm.Potential("0"))
    rng = np.random.default_rng(5)
    a, start = rng.uniform(0.05, 3.0, 300), rng.uniform(0.05, 3.0, 300)
    found = [module.sweep(f"normal_force_{end}", start, 0.0, a=a) for end in ("min", "max")]
    assert all((sweep.status == 0).all() and (sweep.route < 2).all() for sweep in found)
    for k in range(a.size):
        least, largest = extremes_of_wire(float(a[k]), float(start[k]), 9.81)
        assert abs(found[0].values[k] - least) <= 4e-15 * largest
        assert abs(found[1].values[k] - largest) <= 4e-15 * largest


SURVEY = gqm.Curve.sampled([[u, 0.3 * np.sin(u), 0.5 * u * u] for u in np.linspace(-2.0, 2.0, 41).tolist()])
HALF_PIPE = gqm.Curve.piecewise(
    [
        gqm.transition(length="1"),
        gqm.transition(length="4", yaw="0.1", pitch="pi/8"),
        gqm.transition(length="4", yaw="-0.1", pitch="pi/8"),
        gqm.transition(length="1"),
    ],
    start=("0", "0", "4"),
    heading=("0", "-pi/2"),
)


def test_at_a_joint_both_sides_count(build: Build) -> None:
    """An arc in an inclined plane ends where the body is fastest; the straight piece behind it does not hide the force
    at its end.
    """
    pieces, slope = [gqm.transition(length="3", yaw="0.5"), gqm.transition(length="2")], np.sin(0.25)
    curve = gqm.Curve.piecewise(pieces, start=("0", "0", "4"), heading=("0", "-1/4"))
    module, g, v0 = build("inclined_arc", curve, gqm.Potential("0")), 9.81, np.array([0.0, 0.5, 2.0])
    bend = 0.5 * (v0 * v0 + 4.0 * g * slope * (np.sin(1.5) - np.sin(0.25)))
    square = bend**2 + 2.0 * bend * g * slope * np.sin(1.5) + g * g * (1.0 - (slope * np.cos(1.5)) ** 2)
    assert module.sweep("normal_force_max", 0.5, v0).values == pytest.approx(np.sqrt(square), rel=4e-15)


@pytest.mark.extended
@pytest.mark.parametrize(
    ("name", "curve", "force", "low", "high"),
    [
        ("turned_wire", WIRE, gqm.RotatingFrame(), 0.2, 2.0),
        (
            "knotted",
            gqm.Curve.space(
                x="(2+cos(3*t))*cos(2*t)",
                y="(2+cos(3*t))*sin(2*t)",
                z="sin(3*t)+sin(t)/5",
                parameter="t",
                period="2*pi",
            ),
            gqm.Potential("0"),
            -0.45,
            -0.2,
        ),
        ("surveyed", SURVEY, gqm.Potential("0"), 3.3, 4.6),
        ("surveyed_turning", SURVEY, gqm.RotatingFrame(Omega="7/10"), 3.3, 4.6),
        ("half_pipe_in_space", HALF_PIPE, gqm.Potential("0"), 0.5, 2.5),
        ("turning_half_pipe", HALF_PIPE, gqm.RotatingFrame(Omega="7/10"), 0.5, 2.5),
    ],
)
def test_as_solved_motions(build: Build, name: str, curve: Any, force: Any, low: float, high: float) -> None:
    """The extremes are those of solved motions, which are searched on the panels of each motion."""
    module = build(f"{name}_extremes", curve, force)
    given = {"a": 0.4, "Omega": 0.7} if name == "turned_wire" else {}
    for v0 in (0.0, 0.8):
        places = np.random.default_rng(3).uniform(low, high, 6)
        swept = [module.sweep(f"normal_force_{end}", places, v0, **given) for end in ("min", "max")]
        assert all((sweep.route < 2).all() for sweep in swept)
        for place, least, largest in zip(places.tolist(), *(sweep.values.tolist() for sweep in swept), strict=True):
            motion = module.solve(place, v0, 1, **given)
            force = motion.normal_force_max.value
            assert abs(least - motion.normal_force_min.value) <= 2e-13 * force
            assert abs(largest - force) <= 2e-13 * force


WAVY = gqm.Curve.sampled(
    [[u, 0.3 * np.sin(u), 0.5 * u * u + 0.01 * np.cos(3.0 * u)] for u in np.linspace(-2.0, 2.0, 81).tolist()]
)


@pytest.mark.extended
@pytest.mark.parametrize(("place", "v0", "way", "t_max"), [(1.86, 0.0, -1, 1.287222), (3.28, 0.67, 1, 0.261904)])
def test_beside_a_turn_that_is_no_sample(build: Build, place: float, v0: float, way: int, t_max: float) -> None:
    """In a rotating frame the force changes with V, and is smallest a little before the body turns. In the first motion
    it is almost as small at the launch, where the sample is smaller; the second one ends before the turn.
    """
    module = build("wavy_turning_extremes", WAVY, gqm.RotatingFrame(Omega="7/10"))
    swept = module.sweep("normal_force_min", [place], v0, way, t_max=t_max)
    least = module.solve(place, v0, way, t_max=t_max).normal_force_min
    assert swept.route_counts() == {"single": 1}
    assert 0.9 * t_max < least.t < t_max
    assert swept.values[0] == pytest.approx(least.value, rel=2e-14)


@pytest.mark.extended
@pytest.mark.parametrize("name", ["rough_wire", "rough_track"])
def test_with_friction_as_solved_motions(build: Build, name: str) -> None:
    """Bodies that slide to rest have the extremes of solved motions within roundings of the largest force."""
    curve, given, low, high = (WIRE, {"a": 0.4}, 0.2, 2.0) if name == "rough_wire" else (SURVEY, {}, 3.3, 4.6)
    module = build(f"{name}_extremes", curve, gqm.CoulombFriction(mu="1/20"))
    places = np.random.default_rng(4).uniform(low, high, 6)
    for t_max in (None, 1.7):
        swept = [module.sweep(f"normal_force_{end}", places, 0.0, t_max=t_max, **given) for end in ("min", "max")]
        assert all((sweep.route == 1).all() for sweep in swept)
        for place, least, largest in zip(places.tolist(), *(sweep.values.tolist() for sweep in swept), strict=True):
            motion = module.solve(place, 0.0, 1, t_max=t_max, **given)
            force = motion.normal_force_max.value
            assert abs(least - motion.normal_force_min.value) <= 2e-15 * force
            assert abs(largest - force) <= 2e-15 * force
