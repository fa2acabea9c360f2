"""Straight lines between points in space, with closed forms and planar tracks beside; corners keep the speed."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import mpmath as mp
import numpy as np
import pytest

import gqm_sym as gqm

PLANAR = [(0, 3), (1, 0), (2, 1), (3, 0.5), (5, -0.25), (6, 4)]
POINTS = [(0, 0, 3), (1, 1, 0), (3, 0, -1), (3, 2, -1), (5, 3, 4)]


def built(folder: Path, name: str, points: Any, force: Any, **more: Any) -> Any:
    """Return the module of a track of straight lines."""
    return gqm.build(gqm.derive(gqm.Curve.sampled(points, kind="linear", **more), force), name=name, folder=folder)


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    "force",
    [gqm.Gravity(), gqm.Gravity() + gqm.CoulombFriction(mu="1/10"), gqm.Gravity() + gqm.QuadraticDrag(b="1/20")],
)
def test_in_a_vertical_plane_it_is_the_planar_track(force: Any, tmp_path: Path) -> None:
    """A planar track that is turned about the z axis gives the answers of the planar one."""
    turned = [(x * np.cos(0.7), x * np.sin(0.7), z) for x, z in PLANAR]
    plane, space = built(tmp_path, "planar", PLANAR, force), built(tmp_path, "turned", turned, force)
    for lam0, v0 in ((0.1, 0.0), (3.0, 0.0), (4.0, 5.0)):
        one, other = (module.solve(lam0, v0, t_max=8) for module in (plane, space))
        assert [event.kind for event in one.events] == [event.kind for event in other.events]
        state, same = (motion.state(np.linspace(0.1, 0.99 * min(one.t_end, 8.0), 40)) for motion in (one, other))
        assert same.lam == pytest.approx(state.lam, rel=1e-13, abs=1e-13)
        assert same.x == pytest.approx(state.x * np.cos(0.7), rel=1e-13, abs=1e-13)
        assert same.normal_force == pytest.approx(np.abs(state.normal_force), rel=1e-13)


@pytest.mark.extended
def test_the_period_is_the_sum_over_the_lines(tmp_path: Path) -> None:
    """A body slides down and up four lines with a constant acceleration on each."""
    motion = built(tmp_path, "zigzag", POINTS, gqm.Gravity()).solve(0.1, 0)
    with mp.workdps(40):
        corners = [mp.matrix(point) for point in POINTS]
        lengths = [mp.norm(b - a) for a, b in pairwise(corners)]
        heights = [point[2] for point in corners]
        heights[0] = heights[0] - mp.mpf(0.1) * (heights[0] - heights[1]) / lengths[0]
        whole, lengths[0] = lengths[-1], lengths[0] - mp.mpf(0.1)
        lengths[-1] = whole * (heights[0] - heights[-2]) / (heights[-1] - heights[-2])
        heights[-1] = heights[0]
        speeds = [mp.sqrt(2 * mp.mpf("9.81") * (heights[0] - height)) for height in heights]
        times = [2 * length / (a + b) for length, a, b in zip(lengths, speeds[:-1], speeds[1:], strict=True)]
        period = 2 * sum(times)
        assert motion.period == float(period)
        assert abs(mp.mpf(str(motion.period_to(20))) / period - 1) < mp.mpf("1e-19")
    assert [event.kind for event in motion.events] == ["corner"] * 3 + ["turn"] + ["corner"] * 3 + ["turn"]


@pytest.mark.extended
def test_friction_by_the_slope_of_each_line(tmp_path: Path) -> None:
    """Friction takes μ g cos(slope) from the acceleration, and the contact force is m g cos(slope) at any speed."""
    module = built(tmp_path, "rough_zigzag", POINTS, gqm.Gravity() + gqm.CoulombFriction(mu="1/10"))
    motion = module.solve(0, 0)
    v2, s = 0.0, 0.0
    for k, (begin, end) in enumerate(pairwise(POINTS[:4])):
        step = np.subtract(end, begin)
        length = float(np.linalg.norm(step))
        level = float(np.hypot(step[0], step[1]))
        v2 -= 2 * 9.81 * (step[2] + 0.1 * level)
        s += length
        state = motion.state(motion.time_at(s - 1e-9))
        assert state.v2 == pytest.approx(v2, rel=1e-7)
        assert state.normal_force == pytest.approx(9.81 * level / length, rel=1e-14)
        assert motion.events[k].kind == "corner"
        assert motion.events[k].lam == pytest.approx(s, rel=1e-14)


def test_a_closed_track_in_a_frame_that_turns(tmp_path: Path) -> None:
    """The energy in the frame is kept over many laps, and corners are passed in each of them."""
    ring = [(2, 0, 0), (0, 2, 0.5), (-2, 0, 1), (0, -2, 0.5)]
    module = built(tmp_path, "ring", ring, gqm.Gravity() + gqm.RotatingFrame(Omega="1/2"), closed=True)
    motion = module.solve(0.5, 9)
    assert motion.kind == "circulation"
    assert [event.kind for event in motion.events] == ["corner"] * 4
    state = motion.state(np.linspace(0.0, 40.0 * motion.period, 97))
    energy = state.v2 + 2 * 9.81 * state.z - (state.x**2 + state.y**2) / 4
    assert energy == pytest.approx(np.full(97, energy[0]), rel=1e-14)
    assert state.v2[0] == 81.0
