"""Brachistochrones with and without friction have the right times, are cycloids, and are faster than other curves."""

from math import cos, pi, sin, sqrt
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

import gqm_sym as gqm
from gqm_sym.errors import GQMError

# These are upper bounds of the least times with mu = 0.3, found by optimisation over splines.
TIMES = {("1", "-1"): 0.6757788612, ("1", "-0.6"): 0.7222327080, ("1", "-0.45"): 0.804359295}


@pytest.mark.sample(2)
@pytest.mark.parametrize("to", TIMES)
def test_with_friction(to: tuple[str, str], tmp_path: Path) -> None:
    """The body arrives at that time, and presses on the track all along."""
    track = gqm.design.brachistochrone(to, mu="0.3")
    force = gqm.Gravity() + gqm.CoulombFriction(mu="0.3")
    motion = gqm.build(gqm.derive(track, force), name="quickest", folder=tmp_path).solve(0, 0)
    end = motion.state(motion.t_end)
    assert motion.events[-1].kind == "domain-end"
    assert (end.x, end.z) == pytest.approx((float(to[0]), float(to[1])), rel=4e-16)
    assert end.t == pytest.approx(TIMES[to], rel=2e-10)
    assert end.t <= TIMES[to] + 5e-11
    assert (motion.state(np.linspace(0.01, end.t, 100)).normal_force > 0.0).all()


# These are the times at which a body with mu = 0.3 reaches the same places on the textbook's curve.
TEXTBOOK = {("1", "-1"): 0.6805584516, ("1", "-0.6"): 0.7434743316}


def test_the_curve_of_textbooks(tmp_path: Path) -> None:
    """The textbooks' curve neglects the contact force due to curvature: the body is slow, and does not even reach (1,
    -0.45).
    """
    x, z = "R*(q - sin(q) + 3/10*(1 - cos(q)))", "-R*(1 - cos(q) + 3/10*(q + sin(q)))"
    curve = gqm.Curve.parametric(x=x, z=z, parameter="q", domain=(0, "9/2"), parameters={"R": 1})
    model = gqm.derive(curve, gqm.Gravity() + gqm.CoulombFriction(mu="3/10"))
    track = gqm.build(model, name="textbook", folder=tmp_path)

    def ends(to: tuple[str, str]) -> tuple[float, float]:
        """Return the parameter at a place, and the size of the curve."""
        across, down = lambda q: q - sin(q) + 0.3 * (1 - cos(q)), lambda q: 1 - cos(q) + 0.3 * (q + sin(q))
        end = brentq(lambda q: float(to[1]) * across(q) + down(q), 1, 4.5)
        return end, 1.0 / across(end)

    for to, true in TEXTBOOK.items():
        end, size = ends(to)
        assert track.solve(0, 0, R=size).time_at(end) == pytest.approx(true, rel=1e-9)
    _, size = ends(("1", "-0.45"))
    motion = track.solve(0, 0, R=size)
    assert motion.state(motion.legs[0].t_end).x == pytest.approx(0.9587808959, rel=1e-9)


def test_without_friction(tmp_path: Path) -> None:
    """Without friction the curve is a cycloid, also to the left; its time is sqrt(R/g) times the wheel's angle, and the
    load is twice the static one.
    """
    track = gqm.design.brachistochrone((-3, -1))
    motion = gqm.build(gqm.derive(track, gqm.Gravity()), name="cycloid_down", folder=tmp_path).solve(0, 0)
    angle = 2 * float(track.domain[1])
    radius = 1 / (1 - cos(angle))
    assert radius * (angle - sin(angle)) == pytest.approx(3, rel=1e-14)
    end = motion.time_at(float(track.domain[1]))
    assert end == pytest.approx(angle * sqrt(radius / 9.81), rel=1e-14)
    state = motion.state(np.linspace(0.1, 0.99, 20) * end)
    level = -np.cos(0.5 * state.t * sqrt(9.81 / radius) - pi / 2)  # dx/ds, of a body that goes to the left
    assert state.normal_force == pytest.approx(2 * 9.81 * level, rel=1e-12)


BAD = {
    "above": (((1, 1),), "more than mu"),
    "too flat": (((1, "-0.2"), "0.3"), "mu.* = 0.3 m below it"),
    "straight down": (((0, -1),), "beside the start"),
    "one number": (((1,),), "a pair"),
    "no pair": ((1,), "a pair"),
    "negative friction": (((1, -1), -1), "mu: must not be negative"),
    "a name": ((("a", -1),), "to: must be a number"),
    "almost vertical": ((("1e-9", -1),), "too steep"),
}


@pytest.mark.parametrize("case", BAD)
def test_places_that_cannot_be_reached(case: str) -> None:
    """Each place that cannot be reached gives one clear error."""
    (to, *mu), said = BAD[case]
    with pytest.raises(GQMError, match=said):
        gqm.design.brachistochrone(to, mu=mu[0] if mu else 0)
