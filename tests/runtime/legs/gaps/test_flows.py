"""Sweeps along charts with laws that depend on the speed: closed forms of motion with linear drag on a plane of several
lines.
"""

from pathlib import Path

import numpy as np
import pytest
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym.runtime.model import CompiledModel

ULP = 2.0**-52
G, DRAG, MU, SLOPE = mpf("9.81"), mpf("0.4"), mpf("0.8"), mpf("0.5")
LENGTHS = ("1.0", "0.7", "1.3", "1.0", "0.5", "1.1", "0.9", "1.0", "1.0", "1.5")
START = 1.25

# From turns in the first gap ahead to those behind a block of gaps.
SPEEDS = np.linspace(1.0, 9.0, 33)


def plane(folder: Path, *, rubs: bool) -> CompiledModel:
    """Return the module of a plane with linear drag, and with friction on which bodies stay where it ``rubs``."""
    law = gqm.Gravity() + gqm.LinearDrag(c="0.4")
    law = law + gqm.CoulombFriction(mu="0.8") if rubs else law
    curve = gqm.Curve.piecewise([gqm.line(length=x) for x in LENGTHS], start=("0", "0"), heading="0.5")
    return gqm.build(gqm.derive(curve, law), name=f"plane_{rubs}", folder=folder)


def passage(v0: float, acceleration: mpf, distance: mpf) -> mpf:
    """Return the time on a distance for a body with a speed and an acceleration at rest, with linear drag."""
    final = acceleration / DRAG
    # A first estimate without drag.
    root = mp.sqrt(mpf(v0) ** 2 + 2 * acceleration * distance)
    return mp.findroot(
        lambda t: final * t + (mpf(v0) - final) * -mp.expm1(-DRAG * t) / DRAG - distance, 2 * distance / (root + v0)
    )


def turn(v0: float, acceleration: mpf) -> tuple[mpf, mpf]:
    """Return the distance and the time up to a turn for a body with a speed that decreases."""
    time = mp.log1p(DRAG * mpf(v0) / -acceleration) / DRAG
    return (mpf(v0) + acceleration * time) / DRAG, time


def difference(values: np.ndarray, truths: list[mpf]) -> float:
    """Return the largest difference in units in the last place."""
    return max(float(abs(mpf(float(value)) - truth) / truth) for value, truth in zip(values, truths, strict=True)) / ULP


def test_up_and_down_a_plane(tmp_path: Path) -> None:
    """Bodies that turn and slide back to the end of the track, and pass places on the way."""
    with mp.workdps(30):
        module, pull = plane(tmp_path, rubs=False), G * mp.sin(SLOPE)
        turns = [turn(v0, -pull) for v0 in SPEEDS.tolist()]
        whole = [time + passage(0.0, pull, far + mpf(START)) for far, time in turns]
        assert difference(module.sweep("t_end", lam0=START, v0=SPEEDS).values, whole) <= 4
        above = SPEEDS[20:]
        times = [passage(v0, -pull, mpf("1.25")) for v0 in above.tolist()]
        assert difference(module.sweep("time_at", lam0=START, v0=above, lam=2.5).values, times) <= 4
        downwards = [passage(v0, pull, mpf(START)) for v0 in SPEEDS.tolist()]
        swept = module.sweep("t_end", lam0=START, v0=SPEEDS, direction=-1)
        assert difference(swept.values, downwards) <= 4


def test_bodies_that_stay_on_a_plane(tmp_path: Path) -> None:
    """They stay where friction stops them."""
    with mp.workdps(30):
        module, pull = plane(tmp_path, rubs=True), G * (mp.sin(SLOPE) + MU * mp.cos(SLOPE))
        turns = [turn(v0, -pull) for v0 in SPEEDS.tolist()]
        assert difference(module.sweep("t_end", lam0=START, v0=SPEEDS).values, [time for _, time in turns]) <= 4
        places = [far + mpf(START) for far, _ in turns]
        assert difference(module.sweep("rest_position", lam0=START, v0=SPEEDS).values, places) <= 4


@pytest.mark.extended
def test_a_turn_between_arcs(tmp_path: Path) -> None:
    """Bodies that rise on a circle of several arcs, turn, and pass a place on the other side: a pendulum."""
    arcs = [gqm.arc(radius="2", angle=angle) for angle in ("pi/4", "pi/6", "pi/3", "pi/4")]
    curve = gqm.Curve.piecewise(arcs, start=("0", "0"), heading="-pi/2")
    model = gqm.derive(curve, gqm.Gravity() + gqm.LinearDrag(c="0.4"))
    module = gqm.build(model, name="arcs_with_drag", folder=tmp_path)
    with mp.workdps(25):
        begin, end, speeds = mpf("2.5"), mpf(4), [3.4, 3.8, 4.2, 4.6]
        times = []
        for v0 in speeds:
            # The angle from the bottom is s/2 - pi/2.
            swing = mp.odefun(
                lambda _t, y: [y[1], -G / 2 * mp.sin(y[0]) - DRAG * y[1]], 0, [begin / 2 - mp.pi / 2, -mpf(v0) / 2]
            )
            guess = next(mpf(k) / 20 for k in range(60) if swing(mpf(k) / 20)[0] > end / 2 - mp.pi / 2)
            times.append(mp.findroot(lambda t, swing=swing: swing(t)[0] - (end / 2 - mp.pi / 2), guess))
    swept = module.sweep("time_at", lam0=2.5, v0=np.array(speeds), direction=-1, lam=4.0)
    assert difference(swept.values, times) <= 6
