"""Extremes of speed and of the contact force, their times and places agree with closed forms and dense samples."""

from importlib import import_module
from math import cos, pi, sin, sqrt
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import gqm_sym as gqm
from gqm_sym.building import transient
from gqm_sym.errors import SolutionError
from gqm_sym.runtime import Motion

NAMES = ("v_max", "v_min", "normal_force_max", "normal_force_min")


@pytest.fixture(scope="module")
def swing(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """Return a pendulum of one metre."""
    return gqm.build(
        gqm.derive(gqm.families.circle(L=1), gqm.Gravity()), name="swing", folder=tmp_path_factory.mktemp("a")
    )


def test_a_pendulum(swing: ModuleType) -> None:
    """A pendulum has its largest speed and load at the bottom after a quarter of the period, and its smallest at
    launch.
    """
    motion = swing.solve(1)
    top, quarter = 2 * 9.81 * (1 - cos(1)), motion.period / 4
    assert motion.v_max.value == pytest.approx(sqrt(top), rel=1e-15)
    assert motion.v_max.lam == pytest.approx(0.0, abs=1e-12)
    assert motion.v_max.t == pytest.approx(quarter, rel=1e-12)
    assert motion.normal_force_max.value == pytest.approx(9.81 + top, rel=1e-14)
    assert motion.normal_force_max.t == pytest.approx(quarter, rel=1e-12)
    assert motion.v_min == (0.0, 0.0, 1.0)
    assert motion.normal_force_min == (pytest.approx(9.81 * cos(1), rel=1e-14), 0.0, 1.0)


def test_a_circulation(swing: ModuleType) -> None:
    """A circulation is slowest at the top, and its places count laps."""
    motion = swing.solve(0, 8)
    assert motion.v_min.value == pytest.approx(sqrt(64 - 4 * 9.81), rel=1e-14)
    assert motion.v_min.t == pytest.approx(motion.period / 2, rel=1e-12)
    assert motion.v_min.lam == pytest.approx(pi, rel=1e-12)
    assert motion.v_max == (8.0, 0.0, 0.0)


@pytest.mark.extended
def test_near_the_separatrix_the_peak_is_short(swing: ModuleType) -> None:
    """The fast part of the motion, a thousandth of the period, is found."""
    motion = swing.solve("pi - 1/1000000000000")
    assert motion.v_max.value == pytest.approx(sqrt(4 * 9.81), rel=1e-14)
    assert motion.v_max.lam == pytest.approx(0.0, abs=1e-9)


def sampled(motion: Motion, name: str) -> float:
    """Return the extreme among very many states."""
    end = min(motion.t_end, motion.period) if motion.kind in ("libration", "circulation") else motion.t_end
    state = motion.state(np.linspace(0.0, end, 20001))
    values = np.abs(state.v) if name.startswith("v_") else state.normal_force
    return float(values.max() if name.endswith("max") else values.min())


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", NAMES)
def test_against_many_states(name: str, swing: ModuleType, tmp_path: Path) -> None:
    """No state exceeds an extreme, some are close to it, and the state at its time and place has its value."""
    force = gqm.Gravity() + gqm.CoulombFriction(mu="1/5")
    rough = gqm.build(gqm.derive(gqm.families.ellipse(a=2, b=1), force), name="rough", folder=tmp_path)
    motions = [
        swing.solve("1/3", 3),
        swing.solve(1, 9, -1),
        swing.solve(1, t_max="1/5"),
        swing.solve("1/3", 30, t_max=5),
        rough.solve("1/4", 2),
        rough.solve("-1/4", 7, -1, t_max="3/2"),
        swing.solve("3*pi/4", 0, contact="above"),
    ]
    for motion in motions:
        found, sign = getattr(motion, name), 1 if name.endswith("max") else -1
        size = max(abs(found.value), 1.0)
        assert sign * (sampled(motion, name) - found.value) <= 1e-13 * size
        assert sign * (found.value - sampled(motion, name)) <= 2e-3 * size  # at a turning point speeds are steep
        state = motion.state(found.t)
        there = abs(state.v) if name.startswith("v_") else state.normal_force
        # At a turning point the slope of the speed is the acceleration, so that a rounding of the time is one of the
        # speed.
        assert there == pytest.approx(found.value, rel=1e-12, abs=1e-12)
        assert state.lam == pytest.approx(found.lam, rel=1e-9, abs=1e-9)


@pytest.mark.extended
@pytest.mark.sample(1)
@pytest.mark.parametrize("v0", [9.5, 13])
def test_first_legs_of_a_swing_that_dies_away(v0: float, tmp_path: Path) -> None:
    """After some laps a pendulum swings within its earlier swings, which have all extremes, and only they are read."""
    circle = gqm.derive(gqm.families.circle(L=1), gqm.Gravity() + gqm.QuadraticDrag())
    motion = gqm.build(circle, name="laps_then_swings", folder=tmp_path).solve("pi/3", v0, b=0.05, t_max=25)
    speeds, forces = (motion.v_min.value, motion.v_max.value), (motion.normal_force_min.value, motion.normal_force_max)
    assert len(motion._layout.runs) < len(motion.legs) / 2
    state = motion.state(np.r_[np.linspace(0, 8, 401), np.linspace(8, 25, 50)])
    assert speeds == (0.0, v0)
    assert forces[0] <= state.normal_force.min()
    assert forces[0] == pytest.approx(state.normal_force.min(), abs=0.05)
    assert forces[1] == (pytest.approx(9.81 * cos(pi / 3) + v0**2, rel=1e-14), 0.0, pytest.approx(pi / 3, rel=1e-15))


def test_a_bend_that_is_shorter_than_steps_of_a_grid() -> None:
    """At the rounded edge of a valley N agrees with its formula (sweeps returned a 300th of it, from a grid too
    coarse).
    """
    module = transient(gqm.derive(gqm.Curve.graph("sqrt(x**2 + 1/1000000) + x/3", parameter="x"), gqm.Gravity()))
    x = np.linspace(-2e-3, 2e-3, 1_000_001)
    radius = np.hypot(x, 1e-3)
    slope = x / radius + 1 / 3
    kappa = 1e-6 / radius**3 / (1 + slope**2) ** 1.5
    for launch in (1.0, 0.3):
        v2 = 2 * 9.81 * (np.hypot(launch, 1e-3) + launch / 3 - radius - x / 3)
        true = {
            "normal_force_max": np.max(kappa * v2 + 9.81 / np.hypot(1, slope)),
            "v_max": np.sqrt(np.max(v2)),
        }
        for name, value in true.items():
            assert module.sweep(name, launch).values == pytest.approx(value, rel=1e-9)
            assert getattr(module.solve(launch), name).value == pytest.approx(value, rel=1e-9)


def test_rest_and_motions_without_end(swing: ModuleType, tmp_path: Path) -> None:
    """A body at rest has its weight, and a motion to infinity needs a horizon."""
    still = swing.solve(0)
    assert still.v_max == (0.0, 0.0, 0.0)
    assert still.normal_force_max.value == pytest.approx(9.81)
    slope = gqm.build(gqm.derive(gqm.Curve.graph("x"), gqm.Gravity()), name="slope", folder=tmp_path)
    with pytest.raises(SolutionError, match="t_max"):
        _ = slope.solve(0).v_max
    assert slope.solve(0, t_max=2).v_max.value == pytest.approx(2 * 9.81 * sqrt(0.5), rel=1e-14)


@pytest.mark.extended
def test_into_the_centre_of_a_spiral(tmp_path: Path) -> None:
    """The body ends where arc length and time converge; it was fastest at the lowest place of the spiral before."""
    spiral = gqm.build(gqm.derive(gqm.families.log_spiral(), gqm.Gravity()), name="wound", folder=tmp_path)
    motion = spiral.solve(1.6664575248551055, 0.7925274260475293, r0=1, b="3/20")
    assert motion.events[-1].kind == "cusp"
    states = motion.state(np.linspace(0.0, motion.t_end * (1.0 - 1e-9), 20_001))
    assert motion.v_max.value == pytest.approx(np.abs(states.v).max(), rel=1e-6)
    assert motion.v_max.value >= np.abs(states.v).max()


CUSP_FORCES = {
    "none": gqm.Gravity(),
    "drag": gqm.Gravity() + gqm.QuadraticDrag(b=0.02),
    "friction": gqm.Gravity() + gqm.CoulombFriction(mu="0.4"),
    "rotating": gqm.Gravity() + gqm.RotatingFrame(Omega="0.7") + gqm.CoulombFriction(mu="0.4"),
}


@pytest.mark.extended
@pytest.mark.parametrize("force", CUSP_FORCES)
@pytest.mark.parametrize(("lam0", "direction"), [(-1.5, 1), (1.25, -1)])
def test_a_load_that_grows_without_bound(force: str, lam0: float, direction: int, tmp_path: Path) -> None:
    """A body that comes to a cusp with a speed presses on the curve there with an infinite force; its speed just before
    is that of the equation of motion, solved by DOP853 as a function of the place.
    """
    curve = gqm.Curve.parametric(x="u - sin(u)", z="-cos(u)", parameter="u")
    module = gqm.build(gqm.derive(curve, CUSP_FORCES[force]), name=f"cusp_{force}", folder=tmp_path)
    motion = module.solve(lam0, 2.0, direction, t_max=4.0)
    assert motion.legs[-1].end == "cusp"
    assert abs(motion.legs[-1].lam_end) < 1e-15
    least = motion.normal_force_min
    assert least.value == -np.inf
    assert least.t == motion.t_end
    assert motion.normal_force_max.t == 0.0
    with pytest.raises(SolutionError, match="cusp"):
        motion.gradient("normal_force_min")
    sweep = module.sweep("normal_force_min", [lam0], 2.0, direction, t_max=4.0, gradient="g")
    assert sweep.values == [-np.inf]
    assert np.isnan(sweep.gradient).all()

    g, drag, mu = 9.81, 0.02 * (force == "drag"), 0.4 * (force in ("friction", "rotating"))
    omega = 0.7 * (force == "rotating")

    def rate(u: float, w: np.ndarray) -> np.ndarray:
        ds = 2.0 * abs(sin(0.5 * u))
        along_x, along_z, x = (1.0 - cos(u)) / ds, sin(u) / ds, u - sin(u)
        inside = -w / (2.0 * ds) + g * along_x + omega**2 * x * along_z
        load = np.hypot(inside, 2.0 * omega * np.sqrt(w) * along_x)
        pull = -g * along_z + omega**2 * x * along_x
        slope: np.ndarray = 2.0 * ds * (pull - direction * (mu * load + drag * w))
        return slope

    before = motion.state(motion.t_end * (1.0 - 1e-9))
    assert abs(before.lam) < 1e-3
    found = solve_ivp(rate, (lam0, before.lam), [4.0], method="DOP853", rtol=1e-12, atol=1e-12)
    assert abs(before.v) == pytest.approx(sqrt(found.y[0, -1]), rel=1e-11)
    # The time at the end is rounded, which moves the place by up to 1e-7.
    assert abs(motion.state(motion.t_end).v) == pytest.approx(abs(before.v), rel=1e-4)


def test_a_load_that_jumps_at_a_joint(tmp_path: Path) -> None:
    """Down a wall and through a quarter of a circle to the floor, N is largest at the end of the circle, on its
    side.
    """
    pieces = [gqm.line(length=1), gqm.arc(radius=3, angle="pi/2"), gqm.line(length=4)]
    curve = gqm.Curve.piecewise(pieces, start=(0, 0), heading="-pi/2")
    motion = gqm.build(gqm.derive(curve, gqm.Gravity()), name="wall_peak", folder=tmp_path).solve("0.2")
    peak = motion.normal_force_max
    assert peak.value == pytest.approx(9.81 * (1 + 2 * 3.8 / 3), rel=1e-13)
    assert peak.lam == pytest.approx(1 + 1.5 * pi, rel=1e-12)


@pytest.mark.parametrize("mu", [0.0, 0.05])
def test_a_load_that_jumps_where_a_joint_is_passed_backwards(mu: float, tmp_path: Path) -> None:
    """A body that slides from an arc into a narrower one, in which it turns, has its largest load where that begins.

    Its V**2 on the wider arc follows from the closed form of friction on a circle: with the angle u from the lowest
    point, V**2 = A cos(u) + B sin(u) + C exp(2 mu u).
    """
    radius, begin, end, g = 3.0, 0.5, -0.05, 9.81
    pieces = [gqm.arc(radius="1", angle="6/5"), gqm.arc(radius=radius, angle="1")]
    force = gqm.Gravity() + gqm.CoulombFriction(mu=mu) if mu else gqm.Gravity()
    model = gqm.derive(gqm.Curve.piecewise(pieces, heading="-5/4"), force)
    module = gqm.build(model, name=f"joint_backwards_{bool(mu)}", folder=tmp_path)
    launch = 1.2 + radius * (begin - end)
    b = 6 * mu * g * radius / (1 + 4 * mu * mu)
    a = 2 * g * radius - 2 * mu * b
    c = -(a * np.cos(begin) + b * np.sin(begin)) * np.exp(-2 * mu * begin)
    load = g * np.cos(end) + (a * np.cos(end) + b * np.sin(end) + c * np.exp(2 * mu * end)) / 1.0
    peak = module.solve(launch, t_max=20.0).normal_force_max
    assert peak.value == pytest.approx(load, rel=4e-15)
    assert peak.lam == pytest.approx(1.2, rel=4e-15)
    assert module.sweep("normal_force_max", [launch], t_max=20.0).values[0] == pytest.approx(load, rel=4e-15)


@pytest.mark.parametrize("mu", [0.0, 0.2])
def test_a_load_that_falls_up_to_a_joint(mu: float, tmp_path: Path) -> None:
    """On a clothoid N falls up to the joint with an arc, where it jumps: its limit there is the least contact force.

    It was only seen as far as the last sample before the joint, and not at all if a level part had almost that value.
    """
    line, length, first, last, heading, v0, g = 0.75, 0.75, 0.25, -0.0625, -1.25, 1.0, 9.81
    pieces = [
        gqm.line(length=line),
        gqm.clothoid(length=length, kappa_start=first, kappa_end=last),
        gqm.arc(radius=2, angle="4/5"),
    ]
    force = gqm.Gravity() + gqm.CoulombFriction(mu=mu) if mu else gqm.Gravity()
    curve = gqm.Curve.piecewise(pieces, heading=str(heading))
    module = gqm.build(gqm.derive(curve, force), name=f"falling_load_{bool(mu)}", folder=tmp_path)

    def bend(r: float) -> tuple[float, float]:
        """Return the heading and the curvature at the length r on the clothoid."""
        rate = (last - first) / length
        return heading + first * r + 0.5 * rate * r * r, first + rate * r

    def slope(r: float, w: np.ndarray) -> list[float]:
        angle, kappa = bend(r)
        return [-2.0 * g * sin(angle) - 2.0 * mu * (g * cos(angle) + kappa * w[0])]

    v2 = v0**2 + 2.0 * line * g * (-sin(heading) - mu * cos(heading))
    run = solve_ivp(slope, (0.0, length), [v2], "DOP853", rtol=3e-14, atol=1e-14)
    angle, kappa = bend(length)
    least = g * cos(angle) + kappa * run.y[0, -1]
    found = module.solve(0.0, v0, 1).normal_force_min
    assert found.value == pytest.approx(least, rel=4e-14)
    assert found.lam == line + length
    assert module.sweep("normal_force_min", [0.0], v0, 1).values[0] == pytest.approx(found.value, rel=1e-14)


@pytest.fixture(scope="module")
def stadium(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """Return a closed rail of two level lines and two half circles of 1 m."""
    line, bend = gqm.line(length=3), gqm.arc(radius=1, angle="pi")
    rail = gqm.Curve.piecewise([line, bend, line, bend], closed=True)
    return gqm.build(gqm.derive(rail, gqm.Gravity()), name="stadium", folder=tmp_path_factory.mktemp("a"))


@pytest.mark.parametrize("before", [1e-2, 1e-4, 1e-6, 1e-8])
def test_a_body_that_leaves_at_once_at_a_joint(stadium: ModuleType, before: float) -> None:
    """The load on the line behind the bend does not act, however short the way to it is."""
    motion = stadium.solve(3 + pi - before, 6.5, contact="above")
    assert motion.events[-1].kind == "liftoff"
    load = 6.5**2 - 9.81 * (3 - 2 * cos(before))  # V**2/R less the weight, before the joint
    assert motion.normal_force_min.value == pytest.approx(load, rel=2e-14)


def test_the_load_at_a_loss_of_contact_is_that_of_arrival(stadium: ModuleType) -> None:
    """The state at the end is that on the bend, whatever the rounding of the time and of the joint's place, for one and
    for many times. It was that on the line in 44 of 80 launches.
    """
    for before in np.linspace(1e-3, 1.2, 9).tolist():
        motion = stadium.solve(3 + pi - before, 6.5, contact="above")
        load = 6.5**2 - 9.81 * (3 - 2 * cos(before))
        assert motion.state(motion.t_end).normal_force == pytest.approx(load, rel=1e-13)
        assert motion.state(np.array([0.0, motion.t_end])).normal_force[1] == pytest.approx(load, rel=1e-13)


@pytest.mark.parametrize("before", [0.3, 0.04, 1e-3])
def test_a_speed_is_largest_soon_after_the_launch(stadium: ModuleType, before: float) -> None:
    """Along a chart too, where the samples beside the launch are farther away than the bottom of the bend."""
    place, v0, given = 3 + before, 6.5, {"contact": "above", "t_max": 0.4}
    true = sqrt(v0**2 + 2 * 9.81 * (1 - cos(before)))
    assert stadium.solve(place, v0, direction=-1, **given).v_max.value == pytest.approx(true, rel=1e-15)
    assert stadium.sweep("v_max", [place], [v0], direction=-1, **given).values[0] == pytest.approx(true, rel=1e-15)


@pytest.mark.parametrize("v0", [0.001, 0.1, 0.3])
def test_the_speed_on_a_level_line(stadium: ModuleType, v0: float) -> None:
    """The launch is part of the motion, so that roundings of other speeds do not exclude the launch speed."""
    motion = stadium.solve(0.5, v0, t_max=0.1)
    least, largest = motion.v_min.value, motion.v_max.value
    assert least <= v0 <= largest
    assert (least, largest) == pytest.approx((v0, v0), rel=1e-13)


@pytest.mark.parametrize(("place", "speed"), [(-0.5, 0.0), (0.875, 0.34), (-0.4, 4.4)])
@pytest.mark.parametrize("direction", [1, -1])
def test_a_constant_force_is_extreme_at_the_launch(place: float, speed: float, direction: int) -> None:
    """A contact force that is constant has its largest and its least value at the launch, where it is first reached,
    whichever way the body moves.
    """
    motion = import_module("generated.line_spring").solve(place, speed, direction)
    for found in (motion.normal_force_max, motion.normal_force_min):
        assert found == (pytest.approx(2.704, rel=1e-15), 0.0, place)
