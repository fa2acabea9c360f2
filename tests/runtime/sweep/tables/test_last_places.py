"""Extremes of speed and contact force up to a last time agree with closed forms, on rails."""

from math import pi
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from mpmath import ellipfun, mp, mpf
from railed import built

import gqm_sym as gqm

G = 9.81

# The relative tolerance of closed forms, and of those of a pendulum at one time.
FEW, AT_TIME = 4e-15, 2e-14


@pytest.fixture(scope="module")
def bowl(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """Return half a circle of radius 1 that is open above, in six parts."""
    arcs = [gqm.arc(radius=1, angle="pi/6")] * 6
    return built(tmp_path_factory.mktemp("bowl"), "bowl_of_arcs", arcs, start=(-1, 0), heading="-pi/2")


def speed_of_pendulum(v0: float, t: float) -> float:
    """Return |V| of a pendulum of length 1 that passes its lowest place with v0."""
    with mp.workdps(30):
        k = mpf(v0) / (2 * mp.sqrt(mpf(G)))
        return float(abs(v0 * ellipfun("cn", mp.sqrt(mpf(G)) * mpf(t), m=k * k)))


@pytest.mark.parametrize("contact", ["bilateral", "above"])
def test_a_swing_in_a_bowl(contact: str, bowl: ModuleType) -> None:
    """The body slows down until it turns and is fastest at the bottom; N = m (V**2 + g cos(s)), V**2 = v0**2 - 2 g (1 -
    cos(s)). Each launch was solved by itself.
    """
    v0, times = 4.0, np.array([0.1, 0.3, 0.45])
    speeds = np.array([speed_of_pendulum(v0, t) for t in times])
    bottom = 0.5 * pi
    for time, speed in zip(times, speeds, strict=True):
        asked = {"contact": contact, "t_max": float(time)}
        found = {q: bowl.sweep(q, bottom, v0, 1, **asked) for q in ("v_max", "v_min", "normal_force_min")}
        assert all(one.route_counts() == {"single": 1} for one in found.values())
        assert found["v_max"].values == pytest.approx(v0, rel=FEW)
        assert found["v_min"].values == pytest.approx(speed, rel=AT_TIME)
        cosine = 1.0 - (v0**2 - speed**2) / (2.0 * G)
        assert found["normal_force_min"].values == pytest.approx(speed**2 + G * cosine, rel=AT_TIME)
    # From rest 60 degrees aside, a quarter of a period before its lowest place.
    with mp.workdps(30):
        quarter = float(mp.ellipk(mp.sin(mp.pi / 6) ** 2) / mp.sqrt(mpf(G)))
    fastest = speed_of_pendulum(np.sqrt(G), quarter - 0.2)
    assert bowl.sweep("v_max", bottom - pi / 3, 0.0, 1, contact=contact, t_max=0.2).values == pytest.approx(
        fastest, rel=AT_TIME
    )
    # After the turn: up to a place that it has passed, and beyond its launch.
    load = v0**2 + G
    for time in (0.7, 1.1, 1.6, 30.0):
        asked = {"contact": contact, "t_max": time}
        assert bowl.sweep("v_min", bottom, v0, 1, **asked).values == 0.0
        assert bowl.sweep("normal_force_max", bottom, v0, 1, **asked).values == pytest.approx(load, rel=FEW)


def test_the_last_time_is_before_contact_is_lost(tmp_path: Path) -> None:
    """On an incline in three parts, V = v0 + g t / 2; behind it an arc bends away, on which the body loses contact."""
    pieces = [*[gqm.line(length=2)] * 3, gqm.arc(radius="1/2", angle="-pi/3")]
    module = built(tmp_path, "slide", pieces, start=(0, 0), heading="-pi/6")
    t_end = (np.sqrt(1.0 + G * 5.5) - 1.0) / (0.5 * G)
    times, found = [0.2, 0.7, 5.0], []
    for time in times:
        swept = module.sweep("v_max", 0.5, 1.0, 1, contact="above", t_max=time)
        assert swept.route_counts() == {"single": 1}
        found.append(float(swept.values))
    assert found == pytest.approx([1.0 + 0.5 * G * min(t, t_end) for t in times], rel=FEW)
    assert float(module.sweep("t_end", 0.5, 1.0, 1, contact="above").values) == pytest.approx(t_end, rel=FEW)
