"""Bodies that slide between planes with friction come to rest on a corner after infinitely many turns; sweeps follow
them in compiled code.
"""

from collections.abc import Callable
from itertools import pairwise
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
import pytest
from mpmath import mp, mpf

import gqm_sym as gqm

POINTS = [(0, 3), (1, 0), (2, 1), (3, 0.5), (5, -0.25), (6, 4)]
MU = 0.15
# A time is a sum over some hundred slides.
ROUNDINGS = 1e-14

Build = Callable[..., ModuleType]


class Sliding(NamedTuple):
    """The answers for one launch; the place of rest is NaN if the body leaves the track."""

    t_end: float
    rest_position: float
    v_max: float


def slides(lam0: float, v0: float, direction: int) -> Sliding:
    """Slide from corner to corner with constant accelerations, in 80 digits, until no slide takes 1e-25 s any more."""
    with mp.workdps(80):
        places, slopes = [mpf(0)], []
        for (x, z), (x1, z1) in pairwise(POINTS):
            dx, dz = mpf(x1 - x), mpf(z1 - z)
            length = mp.sqrt(dx * dx + dz * dz)
            places.append(places[-1] + length)
            slopes.append((dx / length, dz / length))
        s, v, u, g, mu, t = mpf(lam0), mpf(v0), direction, mpf(9.81), mpf(MU), mpf(0)
        on = next(k for k in range(len(slopes)) if places[k + 1] > s)
        if v == 0:  # no plane holds a body by friction
            u = -1 if slopes[on][1] > 0 else 1
        fastest = v
        while True:
            c, n = slopes[on]
            a = -u * g * n - mu * g * c  # the increase of the speed
            ahead = (places[on + 1] - s) * u if u > 0 else (places[on] - s) * u
            if a < 0 and v * v / (-2 * a) < ahead:
                far, spent = v * v / (-2 * a), v / -a
                s, v, t, u = s + u * far, mpf(0), t + spent, -u
            else:
                after = mp.sqrt(v * v + 2 * a * ahead)
                spent = 2 * ahead / (v + after)
                s, v, t, on = places[on + (u > 0)], after, t + spent, on + u
                fastest = max(fastest, v)
                if not 0 <= on < len(slopes):
                    return Sliding(float(t), float("nan"), float(fastest))
            if spent < mpf("1e-25"):
                return Sliding(float(t), float(s), float(fastest))


def launches() -> tuple[Any, Any, Any]:
    """Return places, speeds and directions of twelve launches, a third of them from rest."""
    rng = np.random.default_rng(4)
    speeds = np.where(np.arange(12) % 3 == 0, 0.0, rng.uniform(0.0, 9.0, 12))
    return rng.uniform(0.1, 11.0, 12), speeds, np.where(rng.random(12) < 0.5, 1, -1)


def test_bodies_come_to_rest_on_corners(build: Build) -> None:
    """Time, place of rest and largest speed are those of the closed form, and no launch is solved by itself."""
    track = gqm.Curve.sampled(POINTS, kind="linear")
    module = build("swept_planes", track, gqm.CoulombFriction() + gqm.QuadraticDrag(b="c"))
    given, starts = {"mu": MU, "c": 0.0}, launches()
    expected = [slides(*launch) for launch in zip(*(column.tolist() for column in starts), strict=True)]
    assert len({round(each.rest_position, 6) for each in expected}) > 2  # both valleys, and the end of the track
    for quantity in Sliding._fields:
        swept = module.sweep(quantity, *starts, **given)
        assert swept.route_counts() == {"single": 12}
        exact = [getattr(each, quantity) for each in expected]
        assert swept.values == pytest.approx(exact, rel=ROUNDINGS, abs=0.0, nan_ok=True)
