"""Limits on height, slope, curvature and contact force have the derivatives of differences with 40 digits."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym.design.limits import LIMITS, PLACES, Limited
from gqm_sym.design.optimum import _Family, _Points, _Tracks
from gqm_sym.runtime.charts import interpolation

# The derivatives of a track with its unknowns a and b, at every 20th place.
SOME = slice(0, PLACES, 20)
GRAVITY, MASS, MU, SPEED = mpf("9.81"), mpf(2), mpf("0.1"), mpf(3)

# A track whose lower end is at -a, and its upper end at 1 + b.
BENT = gqm.Curve.graph("-x/2 + a*sin(x) + b*x**2/5", domain=("-a", "1 + b"), parameters={"a": "1/3", "b": "1/2"})
FREE = {"a": (0.1, 1 / 3, 1), "b": (0.1, 0.5, 1)}


def height(x: Any, a: Any, b: Any) -> Any:
    """Return the height of the track."""
    return -x / 2 + a * mp.sin(x) + b * x**2 / 5


def at_place(share: Any, a: Any, b: Any, start: Any, mu: Any) -> list[Any]:
    """Return height, slope, curvature and contact force at a share of the track, for a launch at x = start; with
    friction by an integral over the angle of the tangent.
    """
    x = -a + share * (1 + a + b)

    def slope(x: Any) -> Any:
        return -mpf(1) / 2 + a * mp.cos(x) + 2 * b * x / 5

    def angle(x: Any) -> Any:
        return mp.atan(slope(x))

    def loss(x: Any) -> Any:
        alpha = angle(x)
        return 2 * GRAVITY * (mp.sin(alpha) + mu * mp.cos(alpha)) * mp.exp(2 * mu * alpha) / mp.cos(alpha)

    w = SPEED**2 * mp.exp(2 * mu * (angle(start) - angle(x)))
    w -= mp.exp(-2 * mu * angle(x)) * mp.quad(loss, [start, x]) if x != start else 0
    curvature = (-a * mp.sin(x) + 2 * b / 5) / mp.sqrt(1 + slope(x) ** 2) ** 3
    load = curvature * w + GRAVITY * mp.cos(angle(x))
    return [height(x, a, b), slope(x), curvature, MASS * load]


def differences(function: Callable[..., list[Any]], at: list[Any]) -> list[list[Any]]:
    """Return the derivatives of functions by differences of 40 digits: a column for each argument."""
    step, columns = mpf(10) ** -12, []
    for k in range(len(at)):
        ends = [function(*(x + sign * step * (i == k) for i, x in enumerate(at))) for sign in (1, -1)]
        columns.append([(up - down) / (2 * step) for up, down in zip(*ends, strict=True)])
    return columns


def all_limited(tracks: _Tracks, between: Any = None) -> Limited:
    """Return what limits are imposed on along the first guess."""
    found = tracks.limited(tracks.start, between)
    assert found is not None
    return found


@pytest.mark.extended
@pytest.mark.parametrize("mu", [MU, 0])
@pytest.mark.parametrize("given", [{}, {"lam0": "-1/4"}])
def test_derivatives_along_a_family(mu: Any, given: dict[str, Any], tmp_path: Path) -> None:
    """All derivatives agree with differences, also where the launch and the places move with the ends of the curve."""
    force = gqm.Gravity() + gqm.CoulombFriction(mu="1/10") if mu else gqm.Gravity()
    tracks = _Family(BENT, force, FREE, {"v0": 3, "m": 2, "g": "9.81"} | given, str(tmp_path))
    found = all_limited(tracks)
    with mp.workdps(40):
        at = [mpf(x) for x in tracks.start.tolist()]
        for k in range(PLACES)[SOME]:
            share = mpf(k) / (PLACES - 1)
            if given and share == 0 and mu:
                continue  # the launch is beyond this place

            def quantities(a: Any, b: Any, share: Any = share) -> list[Any]:
                return at_place(share, a, b, mpf(-1) / 4 if given else -a, mu)

            values, wanted = quantities(*at), differences(quantities, at)
            for row, name in enumerate(LIMITS):
                scale = max(1.0, float(abs(values[row])))
                assert abs(found.values[name][k] - values[row]) <= 1e-13 * scale, (k, name)
                for column in range(2):
                    slope = found.slopes[name][k, column]
                    assert abs(slope - wanted[column][row]) <= 1e-12 * max(scale, abs(wanted[column][row])), (k, name)


def test_places_between(tmp_path: Path) -> None:
    """Between given places the derivatives are those at fixed places."""
    tracks = _Family(BENT, gqm.Gravity(), FREE, {"v0": 3}, str(tmp_path))
    found, x = all_limited(tracks, (0, 1)), np.linspace(0.0, 1.0, PLACES)
    np.testing.assert_allclose(found.slopes["height"], np.column_stack([np.sin(x), x * x / 5]), rtol=1e-14, atol=1e-16)


def test_a_launch_that_moves(tmp_path: Path) -> None:
    """The time from the lower end of a plane at 45 degrees to a place on it changes because that end moves."""
    plane, force = gqm.Curve.graph("-x", domain=("a", 3), parameters={"a": 1}), gqm.Gravity() + gqm.CoulombFriction()
    tracks = _Family(plane, force, {"a": (0, 1, 2)}, {"lam": 2, "g": 9, "mu": "1/2"}, str(tmp_path))
    # The acceleration along x is g (1 - mu)/2.
    assert tracks.gradient("time_at", np.array([1.0])) == pytest.approx([-np.sqrt(2 / 2.25) / 2], rel=1e-12)


@pytest.mark.extended
@pytest.mark.parametrize("force", [gqm.Gravity(), gqm.Gravity() + gqm.Rolling(beta="2/5")])
@pytest.mark.parametrize("between", [None, (0.2, 1.1)])
def test_derivatives_along_a_spline(force: Any, between: Any, tmp_path: Path, monkeypatch: Any) -> None:
    """The values are those of the chart, and the derivatives by heights agree with differences of them, as far as
    the lengths of splines are accurate.
    """
    monkeypatch.setattr(interpolation, "MAX_LAST_CHANGE", 1e-15)
    monkeypatch.setattr(interpolation, "MAX_ITERATIONS", 16)  # lengths have converged to rounding after ten
    x = np.linspace(0.0, 1.5, 9)
    points = np.column_stack([x, -0.8 * x + 0.2 * np.sin(3.0 * x)])
    tracks = _Points(points, force, range(1, 9), {"v0": 0.5, "m": 2, "lam0": 0.1}, str(tmp_path))
    found, of_chart = all_limited(tracks, between), super(_Points, tracks)._limited(tracks.start, between)
    for name in ("height", "curvature", "normal_force"):
        scale = np.abs(of_chart.values[name]).max()
        np.testing.assert_allclose(found.values[name], of_chart.values[name], rtol=0, atol=1e-12 * scale)
    step = 2e-4
    for k in range(8)[:: 1 if between is None else 3]:
        ends = {}
        for n in (-2, -1, 1, 2):
            moved = tracks.limited(tracks.start + n * step * np.eye(8)[k], between)
            assert moved is not None
            ends[n] = moved.values
        for name in LIMITS:
            wanted = (8 * (ends[1][name] - ends[-1][name]) - (ends[2][name] - ends[-2][name])) / (12 * step)
            atol = 1e-6 * np.abs(found.slopes[name]).max()
            np.testing.assert_allclose(found.slopes[name][:, k], wanted, rtol=0, atol=atol)
