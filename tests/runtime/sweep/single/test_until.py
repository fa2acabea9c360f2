"""Sweeps of motions without losses up to a last time, and of motions that go on for ever."""

from collections.abc import Callable
from types import ModuleType

import mpmath as mp
import numpy as np
import pytest

import gqm_sym as gqm
from gqm_sym.runtime.sweep.quantities import STATUS_SENTENCES

ModuleOf = Callable[[str], ModuleType]

# Some roundings of a place or of a time.
ROUNDED = 2e-14


def pendulum(start: float, t: float) -> tuple[float, float]:
    """Return angle and speed at a time of a pendulum of length 1 m that is released at rest."""
    k, rate = mp.sin(mp.mpf(start) / 2), mp.sqrt(mp.mpf(9.81))
    half = k * mp.ellipfun("cd", rate * t, k=k)
    # The sine of half the angle is k cd(rate*t, k), and V**2 is 4 rate**2 times what its square is less than k**2.
    return float(2 * mp.asin(half)), float(2 * rate * mp.sqrt(k * k - half * half))


def test_a_pendulum_up_to_a_time(module_of: ModuleOf) -> None:
    """Before the bottom the speed is largest, and the track pulls most, where the body is at the last time; later the
    extremes are those of the whole orbit. No launch is solved by itself.
    """
    circle, starts, last = module_of("circle"), np.array([0.4, 1.0, 2.0]), 0.3
    with mp.workdps(30):
        states = [pendulum(start, last) for start in starts.tolist()]
    swept = {name: circle.sweep(name, starts, L=1, g=9.81, t_max=last) for name in ("v_max", "normal_force_max")}
    for name, values in (
        ("v_max", [v for _, v in states]),
        ("normal_force_max", [9.81 * np.cos(a) + v * v for a, v in states]),
    ):
        assert (swept[name].route == 1).all()
        assert swept[name].values == pytest.approx(np.array(values), rel=ROUNDED)
    later, whole = (circle.sweep("normal_force_max", starts, L=1, g=9.81, t_max=t_max) for t_max in (1.5, None))
    assert np.array_equal(later.values, whole.values)
    assert (later.route == 1).all()


def test_from_beside_a_hilltop_up_to_a_time(module_of: ModuleOf) -> None:
    """A pendulum that is released beside its top, where doubles lose digits of the time, has passed the bottom: its
    extremes there do not depend on where it is at the last time.
    """
    circle, beside = module_of("circle"), np.array([0.02, 0.005, 0.002])
    with mp.workdps(30):
        squares = [2 * mp.mpf(9.81) * (1 - mp.cos(start)) for start in (np.pi - beside).tolist()]
    for name, values in (("v_max", [mp.sqrt(w) for w in squares]), ("normal_force_max", [9.81 + w for w in squares])):
        swept = circle.sweep(name, np.pi - beside, L=1, g=9.81, t_max=4.0)
        assert (swept.route == 1).all()
        assert swept.values == pytest.approx([float(value) for value in values], rel=1e-15)


def test_an_arrival_after_the_last_time_is_none(module_of: ModuleOf) -> None:
    """What is reached in time is reached at the same time as without a last one."""
    circle, starts = module_of("circle"), np.array([0.4, 1.0, 2.0])
    whole = circle.sweep("time_at", starts, lam=0.1, L=1).values
    last = float(whole[1]) + 1e-6
    swept = circle.sweep("time_at", starts, lam=0.1, L=1, t_max=last)
    assert np.array_equal(swept.values, np.where(whole <= last, whole, np.nan), equal_nan=True)
    assert swept.status_counts() == {STATUS_SENTENCES[5]: int((whole > last).sum())}
    assert (swept.route == 0).all()
    for quantity in ("half_period", "period", "turning_points"):
        one, other = (circle.sweep(quantity, starts, L=1, t_max=t_max).values for t_max in (0.1, None))
        assert np.array_equal(one, other)


def test_an_endless_slope(generated_folder: object) -> None:
    """Down a straight line that has no end, place and speed are those of a constant acceleration."""
    curve = gqm.Curve.parametric(x="3*u", z="-4*u", parameter="u")
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="endless_slope", folder=generated_folder)
    v0, direction, pull = np.array([0.0, 3.0, 3.0, 0.5]), np.array([1, 1, -1, -1]), 9.81 * 0.8
    along = v0 * direction
    swept = module.sweep("time_at", 2.0, v0, direction, lam=102.0, g=9.81)
    assert (swept.route == 1).all()
    assert swept.values == pytest.approx((np.sqrt(along**2 + 2 * pull * 500) - along) / pull, rel=ROUNDED)
    for t_max in (0.01, 20.0):
        speeds = module.sweep("v_max", 2.0, v0, direction, t_max=t_max, g=9.81)
        assert (speeds.route == 1).all()
        assert speeds.values == pytest.approx(np.maximum(v0, np.abs(along + pull * t_max)), rel=ROUNDED)
        assert module.sweep("t_end", 2.0, v0, direction, t_max=t_max).values.tolist() == [t_max] * 4
    least = module.sweep("v_min", 2.0, v0, direction, t_max=0.2, g=9.81).values
    assert least == pytest.approx(np.where(along >= 0, v0, np.maximum(v0 - 0.2 * pull, 0.0)), rel=ROUNDED)


@pytest.mark.extended
@pytest.mark.parametrize("t_max", [0.2, 0.7, 2.0, 10.0])
def test_as_solved_motions(generated_folder: object, t_max: float) -> None:
    """On an endless wave that descends, and on one that rises on both sides, sweeps agree with solved motions."""
    rng = np.random.default_rng(2)
    for name, height in (("endless_wave", "-x/2 + sin(x)/4"), ("endless_bowl", "x**2/2 + sin(3*x)/10")):
        curve = gqm.Curve.graph(height, parameter="x")
        module = gqm.build(gqm.derive(curve, gqm.Gravity()), name=name, folder=generated_folder)
        starts, speeds, directions = (
            rng.uniform(0.1, 4, 12),
            rng.uniform(0, 3, 12),
            np.where(rng.random(12) < 0.5, -1, 1),
        )
        for quantity in ("t_end", "v_min", "v_max", "normal_force_min", "normal_force_max"):
            swept = module.sweep(quantity, starts, speeds, directions, t_max=t_max)
            assert (swept.route == 1).sum() >= 9
            for k, value in enumerate(swept.values.tolist()):
                motion = module.solve(starts[k], speeds[k], int(directions[k]), t_max=t_max)
                true = getattr(motion, quantity)
                assert value == pytest.approx(getattr(true, "value", true), rel=1e-12, abs=1e-12)


def squared_force_in_turning_frame(lam: float, v: float, heading: int, spin: float) -> float:
    """Return the square of the contact force of 1 kg on the wave (t, sin(2t)/4, sin(t) + t**2/8) in a frame that turns
    about the vertical: what is left of the acceleration across the tangent.
    """
    first = np.array([1.0, 0.5 * np.cos(2 * lam), np.cos(lam) + 0.25 * lam])
    second = np.array([0.0, -np.sin(2 * lam), 0.25 - np.sin(lam)])
    tangent, axis = first / np.linalg.norm(first), np.array([0.0, 0.0, spin])
    place = np.array([lam, 0.25 * np.sin(2 * lam), 0.0])
    bend = second / (first @ first)
    load = v * v * bend + 2.0 * heading * v * np.cross(axis, tangent) - spin**2 * place + np.array([0.0, 0.0, 9.81])
    return float(load @ load - (load @ tangent) ** 2)


@pytest.mark.extended
def test_a_force_that_depends_on_the_direction_up_to_a_time(generated_folder: object) -> None:
    """In a rotating frame the force differs on the way there and back, and just behind a launch from rest it may be
    smaller than anywhere else. All launches are answered by compiled code.
    """
    curve = gqm.Curve.space(x="t", y="sin(2*t)/4", z="sin(t)+t**2/8", parameter="t")
    law, spin = gqm.Gravity() + gqm.RotatingFrame(), 0.7
    module = gqm.build(gqm.derive(curve, law), name="wave_until", folder=generated_folder)
    starts, speeds, directions = [-0.6535684695279005, -1.0, -1.2], [0.0, 1.0, 2.0], [-1, 1, -1]
    for t_max in (0.4, 2.0):
        for sign, name in ((-1.0, "normal_force_min"), (1.0, "normal_force_max")):
            swept = module.sweep(name, starts, speeds, directions, Omega=spin, t_max=t_max)
            assert (swept.route == 1).all()
            for k, value in enumerate(swept.values.tolist()):
                motion = module.solve(starts[k], speeds[k], directions[k], Omega=spin, t_max=t_max)
                # Close to the launch from rest the times are close too.
                times = np.concatenate([np.linspace(0.0, 0.01, 51), np.linspace(0.01, t_max, 251)])
                states = motion.state(times)
                found = [
                    sign * np.sqrt(squared_force_in_turning_frame(lam, abs(v), 1 if v > 0 else -1, spin))
                    for lam, v in zip(states.lam.tolist(), states.v.tolist(), strict=True)
                ]
                assert sign * value == pytest.approx(max(found), rel=1e-3)
                assert sign * value >= max(found) - 1e-12 * abs(value)
                assert value == pytest.approx(getattr(motion, name).value, rel=1e-12)


@pytest.mark.parametrize("excess", [1e-1, 1e-5, 1e-11])
def test_the_least_speed_of_a_lap(module_of: ModuleOf, excess: float) -> None:
    """A pendulum that only just goes over its top is slowest there, where V**2 is a small difference of large terms:
    by the energy V**2 is V0**2 - 4 g L.
    """
    circle = module_of("circle")
    start, v0 = 0.5, np.sqrt(2 * 9.81 * (1 + np.cos(0.5)) * (1 + excess))
    with mp.workdps(40):
        least = mp.sqrt(mp.mpf(v0) ** 2 - 2 * mp.mpf(9.81) * (1 + mp.cos(start)))
    swept = circle.sweep("v_min", [start], v0, L=1, g=9.81)
    assert swept.route[0] == 1
    assert swept.values[0] == pytest.approx(float(least), rel=4e-16, abs=0.0)


@pytest.mark.parametrize("v0", [0.0, 1e-4])
def test_the_largest_speed_beside_the_bottom_of_a_well(module_of: ModuleOf, v0: float) -> None:
    """A body that is launched beside the bottom of an uneven well is fastest there, although the terms of the potential
    almost cancel between both places: by the energy V**2 is V0**2 + 2 g (start**2 - 1/2)**2.
    """
    starts = [0.65, 0.7055, 0.70712, 0.7086, 0.77]
    with mp.workdps(40):
        drops = [(mp.mpf(start) ** 2 - 0.5) ** 2 for start in starts]
        largest = [float(mp.sqrt(mp.mpf(v0) ** 2 + 2 * mp.mpf(9.81) * drop)) for drop in drops]
    swept = module_of("double_well").sweep("v_max", starts, v0, g=9.81)
    assert (swept.route == 1).all()
    assert swept.values == pytest.approx(largest, rel=4e-16, abs=0.0)


def test_a_turn_before_the_last_time_is_rest(module_of: ModuleOf) -> None:
    """A body that turns before the last time, or is released, has been at rest, however slowly it has passed a hilltop;
    one that is still on its way has not.
    """
    well = module_of("double_well")
    slow = well.sweep("v_min", [-1.2, 0.054, -1.0005], [0.0, 0.304, 0.0], -1, t_max=20.0)
    assert slow.values.tolist() == [0.0, 0.0, 0.0]
    assert (slow.route == 1).all()
    moving = well.sweep("v_min", 0.054, 0.304, 1, t_max=0.1)
    assert moving.values == pytest.approx(0.304, rel=0.0)


def test_whether_a_place_comes_before_a_loss_of_contact(module_of: ModuleOf) -> None:
    """A body that is released beside the top between two wells stays on the track, and comes to places when it does so
    on a track that can pull; one that is launched over the top comes to none beyond the place where it leaves.
    """
    well = module_of("double_well")
    places = np.array([0.1, 0.3, 0.6, 0.9])
    free, held = (well.sweep("time_at", 0.0514, lam=places, contact=c) for c in ("bilateral", "above"))
    assert (held.route == 1).all()
    assert held.values == pytest.approx(free.values, rel=ROUNDED)
    leaves = well.solve(-0.5, 6.0, contact="above")
    end = leaves.state(leaves.t_end).lam
    places = np.array([-0.45, 0.5 * (end - 0.5), end - 1e-9, end + 1e-9, 0.9])
    free, held = (well.sweep("time_at", -0.5, 6.0, lam=places, contact=c) for c in ("bilateral", "above"))
    assert (held.route == 1).all()
    assert np.isnan(held.values).tolist() == [False, False, False, True, True]
    assert held.values[:3] == pytest.approx(free.values[:3], rel=ROUNDED)
