"""Optimal tracks agree with closed forms: the quickest plane with and without friction and under limits, and a
spline.
"""

from math import atan, pi, sqrt, tan
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gqm_sym as gqm
from gqm_sym.design.optimum import _Family, _Points
from gqm_sym.errors import GQMError

PLANE = gqm.Curve.graph("-k*x", domain=(0, 1), parameters={"k": 1})
START = {"k": (0.1, 0.5, 4)}


def steepness(force: Any, free: Any = None, **options: Any) -> float:
    """Return the slope of the quickest plane to a wall 1 m away."""
    best = gqm.design.minimise("time_at", PLANE, force, free=free or START, lam0=0, **options)
    return float(dict(best.defaults)["k"])


def test_the_quickest_plane() -> None:
    """The quickest plane has 45 degrees, under limits it is as steep as they allow, and the contact force is m g
    cos(alpha).
    """
    assert steepness(gqm.Gravity()) == pytest.approx(1.0, rel=1e-6)
    assert steepness(gqm.Gravity(), limits={"slope": (-0.8, None)}) == pytest.approx(0.8, rel=1e-9)
    assert steepness(gqm.Gravity(), limits={"height": ("-3/4", 0)}) == pytest.approx(0.75, rel=1e-9)
    load = {"normal_force": (0.75 * 9.81, None), "curvature": (-1, 1)}
    assert steepness(gqm.Gravity(), limits=load, between=(0.1, 0.9)) == pytest.approx(sqrt(1 / 0.5625 - 1), rel=1e-9)


def test_unknowns_in_nanometres() -> None:
    """An unknown that is a small number is found as others are: a plane to a wall 1 nm away falls by as much."""
    plane = gqm.Curve.graph("-h*x/1e-9", domain=(0, 1e-9), parameters={"h": 4e-10})
    best = gqm.design.minimise("time_at", plane, gqm.Gravity(), free={"h": (1e-10, 4e-10, 4e-9)}, lam0=0)
    assert float(dict(best.defaults)["h"]) == pytest.approx(1e-9, rel=1e-6, abs=0.0)


def test_with_friction() -> None:
    """With friction the quickest plane is steeper by half of the angle of friction."""
    force = gqm.Gravity() + gqm.CoulombFriction(mu="0.3")
    assert steepness(force, {"k": (0.5, 0.9, None)}) == pytest.approx(tan(pi / 4 + atan(0.3) / 2), rel=1e-6)


@pytest.mark.parametrize("given", [{}, {"lam": "1/2"}])
def test_times_with_friction_have_derivatives(given: dict[str, Any], tmp_path: Path) -> None:
    """Down a plane of slope k to x = c the time is sqrt(2 c (1 + k**2)/(g (k - mu)))."""
    force = gqm.Gravity() + gqm.CoulombFriction(mu="0.3")
    planes = _Family(PLANE, force, START, {"lam0": 0} | given, str(tmp_path))
    for k in (0.6, 1.5):
        found = planes.gradient("time_at", np.array([k]))
        time = sqrt(2 * (0.5 if given else 1.0) * (1 + k * k) / (9.81 * (k - 0.3)))
        assert found == pytest.approx(time * (k / (1 + k * k) - 0.5 / (k - 0.3)), rel=1e-12)


def test_exact_gradients() -> None:
    """The quickest pendulum within limits is the shortest one; periods have exact derivatives."""
    circle = gqm.families.circle()
    best = gqm.design.minimise("period", circle, gqm.Gravity(), free={"L": (0.5, 1, 2)}, lam0=1)
    assert dict(best.defaults)["L"] == 0.5
    assert best.period == circle.period


def test_points_that_move(tmp_path: Path) -> None:
    """The quickest spline through seven points is slower than the brachistochrone by a thousandth at most."""
    x = np.linspace(0.0, 1.0, 7)
    points = np.column_stack([x, -x])
    best = gqm.design.minimise("time_at", points, gqm.Gravity(), free=range(1, 6))
    heights = np.array([float(row.split()[1]) for row in best.definition.points.splitlines()])
    assert (heights[0], heights[-1]) == (0.0, -1.0)
    assert (np.diff(heights) < 0.0).all()
    tracks = _Points(points, gqm.Gravity(), range(1, 6), {}, str(tmp_path))
    least = 0.5828954631547427  # of the cycloid, sqrt(R/g) times the angle of its wheel
    assert 1.0 < tracks.answer("time_at", heights[1:-1]) / least < 1.001


BAD: dict[str, tuple[Any, Any, dict[str, Any], str]] = {
    "no limits are met": (PLANE, {"k": (0.9, 4)}, {"limits": {"slope": (-0.8, None)}}, "(-0.8, inf) by 0.1. Begin"),
    "contradiction": (PLANE, START, {"limits": {"height": (1, 0)}}, "limits contradict each other"),
    "an unknown limit": (PLANE, START, {"limits": {"speed": (0, 1)}}, "there is no limit 'speed'"),
    "half a limit": (PLANE, START, {"limits": {"slope": 1}}, "slope: must be (low, high)"),
    "an unknown parameter": (PLANE, {"q": (0, 1)}, {}, "there is no parameter 'q'"),
    "a guess alone": (PLANE, {"k": 1}, {}, "must be (low, high)"),
    "limits out of order": (PLANE, {"k": (2, 1)}, {}, "limits contradict each other"),
    "a guess outside": (PLANE, {"k": (0.1, 5, 4)}, {}, "k: the first guess 5.0 must lie between 0.1 and 4.0"),
    "no guess": (PLANE, {"k": (2, None)}, {}, "k: has no value to begin with"),
    "no number": (PLANE, {"k": ("low", 4)}, {}, "k: "),
    "nothing free": (PLANE, {}, {}, "free: must be a mapping"),
    "an unknown argument": (PLANE, START, {"L": 1}, "there is no argument 'L'"),
    "no such point": ([[k, -k] for k in range(7)], np.array([7]), {}, "7 is none of the points 0 to 6"),
    "no point": ([[k, -k] for k in range(7)], [], {}, "no point may move"),
    "upwards": (PLANE, {"k": (-2, -1)}, {}, "would leave through it at once"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_is_refused(case: str) -> None:
    """Input that cannot be used is refused with one clear error."""
    track, free, options, said = BAD[case]
    with pytest.raises(GQMError) as raised:
        gqm.design.minimise("time_at", track, gqm.Gravity(), free=free, lam0=0, **options)
    assert said in str(raised.value)
