"""How times along splines change with the heights of their points agrees with differences and with brachistochrones."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gqm_sym as gqm
from gqm_sym.design.optimum import _Points
from gqm_sym.design.shape import time_gradient

PLACES = np.linspace(0.0, 1.0, 8)
HEIGHTS = -PLACES * (2.0 - PLACES) - 0.1 * PLACES**3
POINTS = np.column_stack([PLACES, HEIGHTS])


def slid(_: Any, x: Any, z: Any, p: Any) -> tuple[Any, Any, Any]:
    """Return the potential of gravity and of a wind, with its derivatives."""
    return p[0] * z - p[1] * x, -p[1], p[0]


@pytest.mark.sample(1)
@pytest.mark.parametrize("force", [gqm.Gravity(), gqm.Gravity() + gqm.Rolling(beta="2/5")])
@pytest.mark.parametrize("v0", [0.0, 0.7])
def test_times_of_solved_motions(force: gqm.Kernel, v0: float, tmp_path: Path) -> None:
    """The derivatives agree with differences of solved motions, also where the last point moves."""
    tracks = _Points(POINTS, force, range(1, 8), {"v0": v0}, str(tmp_path))
    found, step = tracks.gradient("time_at", tracks.start), 4e-4
    assert found is not None
    for k, value in enumerate(found):
        times = {n: tracks.answer("time_at", tracks.start + n * step * np.eye(7)[k]) for n in (-2, -1, 1, 2)}
        wanted = (8 * (times[1] - times[-1]) - (times[2] - times[-2])) / (12 * step)
        assert value == pytest.approx(wanted, abs=1e-5 * np.abs(found).max())


def test_the_time_with_friction(tmp_path: Path) -> None:
    """With friction the derivatives of the time are those of differences."""
    tracks = _Points(POINTS, gqm.Gravity() + gqm.CoulombFriction(mu="0.1"), [3], {}, str(tmp_path))
    found, step = tracks.gradient("time_at", HEIGHTS[3:4]), 4e-4
    times = {n: tracks.answer("time_at", HEIGHTS[3:4] + n * step) for n in (-2, -1, 1, 2)}
    assert found == pytest.approx((8 * (times[1] - times[-1]) - (times[2] - times[-2])) / (12 * step), rel=1e-5)


def test_a_brachistochrone() -> None:
    """On half an arch of a cycloid no height changes the time to first order, except by what the spline leaves out.

    The sharp bend at its beginning is left out.
    """
    angle = np.linspace(0.0, np.pi, 30)
    points = np.column_stack([angle - np.sin(angle), np.cos(angle) - 1.0])
    found = time_gradient(points, list(range(1, 29)), slid, (1.0, 0.0), 0.0)
    bent = points.copy()
    bent[15, 1] -= 0.02
    others = time_gradient(bent, list(range(1, 29)), slid, (1.0, 0.0), 0.0)
    assert np.abs(found[4:]).max() < 1e-3 * np.abs(others).max()


def test_second_derivatives_are_symmetric() -> None:
    """The change of one derivative by another point is the same the other way round, in a potential of x and z."""
    moved, step, sides = list(range(1, 8)), 1e-4, []
    for k in moved:
        ends = []
        for sign in (1, -1):
            points = POINTS.copy()
            points[k, 1] += sign * step
            ends.append(time_gradient(points, moved, slid, (9.81, 3.0), 0.5))
        sides.append((ends[0] - ends[1]) / (2 * step))
    seconds = np.array(sides)
    np.testing.assert_allclose(seconds, seconds.T, rtol=0, atol=1e-4 * np.abs(seconds).max())
