"""Limits along curves without formulas have the derivatives of closed forms."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym.design.limits import LIMITS, PLACES, Limited
from gqm_sym.design.optimum import _Family, _Tracks

SOME = slice(0, PLACES, 25)
GRAVITY, MASS, SPEED = mpf("9.81"), mpf(2), mpf(3)


def all_limited(tracks: _Tracks, between: Any = None) -> Limited:
    """Return what limits are imposed on along the first guess."""
    found = tracks.limited(tracks.start, between)
    assert found is not None
    return found


def slopes_of(function: Any, at: list[Any]) -> list[list[Any]]:
    """Return the derivatives of functions by differences of 40 digits: a row for each function."""
    step, columns = mpf(10) ** -12, []
    for k in range(len(at)):
        ends = [function(*(x + sign * step * (i == k) for i, x in enumerate(at))) for sign in (1, -1)]
        columns.append([(up - down) / (2 * step) for up, down in zip(*ends, strict=True)])
    return [list(row) for row in zip(*columns, strict=True)]


def compare(found: Limited, place: int, values: list[Any], wanted: list[list[Any]], names: tuple[str, ...]) -> None:
    """Check quantities and derivatives at a place; those of the contact force contain a curvature."""
    for name, value, slopes in zip(names, values, wanted, strict=True):
        scale = max(1.0, float(abs(value)))
        assert abs(found.values[name][place] - value) <= 1e-12 * scale, (place, name)
        enough = 1e-9 if name in ("curvature", "normal_force") else 1e-12
        for got, slope in zip(found.slopes[name][place], slopes, strict=True):
            assert abs(got - slope) <= enough * max(scale, float(abs(slope))), (place, name)


@pytest.mark.extended
@pytest.mark.parametrize("between", [None, (-0.5, 1.25)])
@pytest.mark.parametrize("given", [{}, {"lam0": "-1/4"}])
def test_along_an_implicit_curve(between: Any, given: dict[str, Any], tmp_path: Path) -> None:
    """On an ellipse whose ends, launch and shape change with its parameters, all derivatives agree with differences of
    40 digits.
    """
    curve = gqm.Curve.implicit(
        "x**2/a**2 + z**2/b**2 - 1", start=(0, "-b"), domain=("-a/2", "a"), parameters={"a": "5/4", "b": 1}
    )
    free = {"a": (1, 1.25, 2), "b": (0.5, 1, 2)}
    tracks = _Family(curve, gqm.Gravity(), free, {"v0": 3, "m": 2, "g": "9.81"} | given, str(tmp_path))
    found = all_limited(tracks, between)
    found_before: dict[Any, Any] = {}  # angles, where iterations for almost the same curve begin

    def angle(s: Any, a: Any, b: Any, where: Any) -> Any:
        """Return u, with x = a sin(u) and z = -b cos(u), at an arc length, by Newton's method."""
        u, change = found_before.get(where, s / a), mpf(1)
        while abs(change) > mpf(10) ** -21:  # the next one would be its square
            change = (a * mp.ellipe(u, 1 - (b / a) ** 2) - s) / mp.hypot(a * mp.cos(u), b * mp.sin(u))
            u -= change
        found_before[where] = u
        return u

    with mp.workdps(40):
        at = [mpf(x) for x in tracks.start.tolist()]
        for k in range(PLACES)[SOME]:
            share = mpf(k) / (PLACES - 1)

            def quantities(a: Any, b: Any, share: Any = share) -> list[Any]:
                low, high = (-a / 2, a) if between is None else (mpf("-0.5"), mpf("1.25"))
                start = angle(mpf(-1) / 4 if given else -a / 2, a, b, "start")
                u = angle(low + share * (high - low), a, b, share)
                across, rise = a * mp.cos(u), b * mp.sin(u)
                speed = mp.hypot(across, rise)
                w = SPEED**2 + 2 * GRAVITY * b * (mp.cos(u) - mp.cos(start))
                curvature = a * b / speed**3
                return [-b * mp.cos(u), rise / across, curvature, MASS * (curvature * w + GRAVITY * across / speed)]

            compare(found, k, quantities(*at), slopes_of(quantities, at), tuple(LIMITS))


@pytest.mark.extended
@pytest.mark.parametrize("friction", [False, True])
def test_along_a_rail(friction: bool, tmp_path: Path) -> None:
    """On a line and an arc, whose lengths are parameters, derivatives are those of closed forms, with friction too."""
    pieces = [gqm.line(length="p"), gqm.arc(radius="r", angle="6/5")]
    curve = gqm.Curve.piecewise(pieces, heading="-h", parameters={"p": 2, "r": "3/2", "h": "3/10"})
    force = gqm.Gravity() + gqm.CoulombFriction(mu="1/100") if friction else gqm.Gravity()
    free = {"p": (1, 2, 3), "r": (1, 1.5, 2), "h": (0.1, 0.3, 0.5)}
    tracks = _Family(curve, force, free, {"v0": 3, "m": 2, "g": "9.81"}, str(tmp_path))
    found = all_limited(tracks)
    mu = mpf("0.01") if friction else mpf(0)
    with mp.workdps(40):
        at = [mpf(x) for x in tracks.start.tolist()]
        for k in range(PLACES)[SOME]:
            share = mpf(k) / (PLACES - 1)

            def quantities(p: Any, r: Any, h: Any, share: Any = share) -> list[Any]:
                s = share * (p + r * mpf("1.2"))
                alpha = -h + (max(s - p, 0) / r)
                z = -min(s, p) * mp.sin(h) + (r * (mp.cos(h) - mp.cos(alpha)) if s > p else 0)
                curvature = 1 / r if s > p else mpf(0)
                w = SPEED**2 + 2 * GRAVITY * min(s, p) * (mp.sin(h) - mu * mp.cos(h))
                if s > p:  # dW/dalpha = -2 g r (sin(alpha) + mu cos(alpha)) - 2 mu W
                    sines, cosines = 3 * mu, 1 - 2 * mu**2

                    def balanced(angle: Any) -> Any:
                        part = cosines * mp.cos(angle) - sines * mp.sin(angle)
                        return 2 * GRAVITY * r * part / (1 + 4 * mu**2)

                    w = balanced(alpha) + (w - balanced(-h)) * mp.exp(-2 * mu * (alpha + h))
                return [z, mp.tan(alpha), curvature, MASS * (curvature * w + GRAVITY * mp.cos(alpha))]

            compare(found, k, quantities(*at), slopes_of(quantities, at), tuple(LIMITS))


def test_a_time_along_a_rail(tmp_path: Path) -> None:
    """Down a line, from its beginning to its end, t = sqrt(2 q/(g sin)); its derivative by the length is exact."""
    curve = gqm.Curve.piecewise([gqm.line(length="q")], heading="-pi/6", parameters={"q": 2})
    tracks = _Family(curve, gqm.Gravity(), {"q": (1, 3)}, {}, str(tmp_path))
    found = tracks.gradient("time_at", tracks.start)
    assert found is not None
    assert found[0] == pytest.approx(0.5 / np.sqrt(2 * 9.81 / 4), rel=1e-14)


@pytest.mark.extended
def test_a_minimum_with_limits(tmp_path: Path) -> None:
    """The lowest arc on which the load stays below a limit is found: a rail that leads a body round a bend."""
    pieces = [gqm.line(length=1), gqm.arc(radius="r", angle="1")]
    curve = gqm.Curve.piecewise(pieces, heading="-1/2", parameters={"r": 2})
    best = gqm.design.minimise(
        "time_at", curve, gqm.Gravity(), free={"r": (0.5, 2, 5)}, limits={"normal_force": (None, 30)}, v0=3, g="9.81"
    )
    r = float(dict(best.defaults)["r"])
    w = 9.0 + 2 * 9.81 * (np.sin(0.5) + r * (1.0 - np.cos(0.5)))
    assert w / r + 9.81 == pytest.approx(30.0, rel=1e-4)
