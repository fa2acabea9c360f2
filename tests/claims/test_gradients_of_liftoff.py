"""Derivatives of ends by lift-off from banked tracks in space, against their definition with complex steps.

A body on a track that pushes upwards only leaves it where the component of N along the track's upward direction u
vanishes, although the sides of the track still push.
"""

from collections.abc import Callable
from itertools import pairwise
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from newton import Newton

import gqm_sym as gqm

Build = Callable[[str, Any, Any], ModuleType]
Numbers = dict[str, Any]

FRAME = gqm.Gravity() + gqm.RotatingFrame()
HILL = gqm.Curve.space(x="10*u", y="4*sin(u/2)", z="h*cos(u)", parameter="u", roll="r*u")
# Both pieces turn and roll at constant rates; the first one ends at s = a.
PIECES = [
    gqm.transition(length="a", yaw="1/200", pitch="-1/200", roll="q"),
    gqm.transition(length=60, yaw="1/100", pitch="-c", roll="1/200"),
]
RAIL = gqm.Curve.piecewise(PIECES, start=(0, 0, 0), roll="pieces")
# The same rail with a roll angle that is a function of the arc length.
LEANING = gqm.Curve.piecewise(PIECES, start=(0, 0, 0), roll="q*s")

# A step along the imaginary axis: its square is far below rounding.
STEP = 1e-30


def leaning(t: Any, roll: Any) -> Any:
    """Return the upward direction that leans to the left of the level by an angle."""
    left = np.array([-t[1], t[0], 0.0]) / np.sqrt(t[0] ** 2 + t[1] ** 2)
    return np.cross(t, left) * np.cos(roll) + left * np.sin(roll)


class Body:
    """A body on a track in a frame that turns; ``way`` is the sign of ds/dt."""

    def __init__(self, given: Numbers, way: int = 1) -> None:
        self.given, self.way = given, way

    def at(self, u: Any) -> tuple[Any, Any, Any, Any]:
        """Return place, derivative, curvature vector and upward direction."""
        raise NotImplementedError

    def square(self, place: Any) -> Any:
        """Return V²."""
        given, there = self.given, self.at(self.given["lam0"])[0]
        out = place[0] ** 2 + place[1] ** 2 - there[0] ** 2 - there[1] ** 2
        return given["v0"] ** 2 + 2 * given["g"] * (there[2] - place[2]) + given["Omega"] ** 2 * out

    def rate(self, u: Any) -> Any:
        """Return dt/du."""
        place, first, _, _ = self.at(u)
        return np.sqrt(first @ first / self.square(place))

    def force(self, u: Any) -> Any:
        """Return N/m, and a vector along the tangent in addition."""
        place, first, bend, _ = self.at(u)
        w, g, omega = self.square(place), self.given["g"], self.given["Omega"]
        x, y, _ = first * self.way * np.sqrt(w / (first @ first))
        return w * bend - np.array([omega**2 * place[0] + 2 * omega * y, omega**2 * place[1] - 2 * omega * x, -g])

    def upward(self, u: Any) -> Any:
        """Return the component of N/m along the upward direction."""
        return self.force(u) @ self.at(u)[3]

    def length(self, u: Any) -> Any:
        """Return |N|/m."""
        force, first = self.force(u), self.at(u)[1]
        across = force - first * (force @ first) / (first @ first)
        return np.sqrt(across @ across)


def derivative(body: Callable[[Numbers], Body], given: Numbers, name: str, near: float, joint: str) -> float:
    """Return the derivative of the time of lift-off with respect to a number, given the place and a joint before."""
    fixed, place = body(given), near
    for _ in range(3):
        slope = fixed.upward(place + STEP * 1j).imag / STEP
        place -= fixed.upward(place) / slope
    moved = body({**given, name: given[name] + STEP * 1j})
    end = place - 1j * moved.upward(place).imag / slope
    points, total = (moved.given["lam0"], moved.given[joint], end), 0.0
    for a, b in pairwise(points):
        for node, weight in zip(*np.polynomial.legendre.leggauss(40), strict=True):
            total = total + 0.5 * (b - a) * weight * moved.rate(a + 0.5 * (b - a) * (1 + node))
    return float((total * moved.way).imag / STEP)


class OnHill(Body):
    """A body on the hill."""

    def at(self, u: Any) -> tuple[Any, Any, Any, Any]:
        """See `Body`."""
        h = self.given["h"]
        place = np.array([10 * u, 4 * np.sin(u / 2), h * np.cos(u)])
        first = np.array([10.0, 2 * np.cos(u / 2), -h * np.sin(u)])
        second = np.array([0.0, -np.sin(u / 2), -h * np.cos(u)])
        square = first @ first
        bend = (second - first * (first @ second) / square) / square
        return place, first, bend, leaning(first / np.sqrt(square), self.given["r"] * u)


class OnRail(Body):
    """A body on the rail.

    The rates of the frame's rows t, l and u are constant on a piece, so that these rotate about a fixed axis, and dt/ds
    is yaw l + pitch u.
    """

    is_leaning = False

    def at(self, s: Any) -> tuple[Any, Any, Any, Any]:
        """See `Body`."""
        a, q, c = (self.given[name] for name in ("a", "q", "c"))
        pieces = [(1 / 200, -1 / 200, q, s)]
        if np.real(s) > np.real(a):
            pieces = [(1 / 200, -1 / 200, q, a), (1 / 100, -c, 1 / 200, s - a)]
        frame, place = np.eye(3), np.zeros(3)
        for yaw, pitch, roll, length in pieces:
            turn = np.array([[0, yaw, pitch], [-yaw, 0, -roll], [-pitch, roll, 0]])
            w, twice = np.sqrt(yaw**2 + pitch**2 + roll**2), turn @ turn
            sine, versine = np.sin(w * length) / w, (1 - np.cos(w * length)) / w**2
            place = place + (np.eye(3) * length + turn * versine + twice * ((length - sine) / w**2))[0] @ frame
            frame = (np.eye(3) + turn * sine + twice * versine) @ frame
        t, left, up = frame
        return place, t, yaw * left + pitch * up, leaning(t, q * s) if self.is_leaning else up


class OnLeaningRail(OnRail):
    """A body on the rail with a roll angle of its own."""

    is_leaning = True


@pytest.mark.extended
@pytest.mark.parametrize("way", [1, -1])
def test_along_a_curve_with_formulas(way: int, built: Build) -> None:
    """All derivatives of the time of lift-off are right to rounding, on both ways in a frame that turns; so are those
    of motions with losses that are zero.
    """
    given = {"h": 3.0, "r": 0.125 * way, "g": 9.8125, "Omega": 0.25, "lam0": -3.0 * way, "v0": 30.0}
    launch = {**given, "direction": way, "contact": "above"}
    motion = built("hill", HILL, FRAME).solve(**launch)
    rough = built("rough_hill", HILL, FRAME + gqm.CoulombFriction()).solve(mu=0.0, **launch)
    assert motion.events[-1].kind == rough.events[-1].kind == "liftoff"
    found, of_rough = motion.gradient("t_end"), rough.gradient("t_end")
    for name in given:
        truth = derivative(lambda numbers: OnHill(numbers, way), given, name, motion.events[-1].lam, "lam0")
        assert found[name] == pytest.approx(truth, rel=1e-13)
        assert of_rough[name] == pytest.approx(truth, rel=1e-13)
    assert found["m"] == 0.0


@pytest.mark.extended
def test_extremes_on_both_ways(built: Build) -> None:
    """Where it is smallest on a way backwards, the contact force in a frame that turns changes as at a fixed place and
    as at a fixed time; at the launch it changes as there.
    """
    given = {"h": 3.0, "r": 0.125, "g": 9.8125, "Omega": 0.25, "lam0": 3.0, "v0": 30.0}
    motion = built("hill", HILL, FRAME).solve(direction=-1, t_max=1.0, **given)
    least, first = motion.normal_force_min, motion.normal_force_max
    assert first.t == 0.0 < least.t < 1.0
    by_place, by_time = motion.gradient("normal_force_min"), motion.sensitivity(least.t, wrt=tuple(given)).normal_force
    at_launch = motion.gradient("normal_force_max")
    for at, name in zip(by_time, given, strict=True):
        moved = OnHill({**given, name: given[name] + STEP * 1j}, -1)
        truth = moved.length(least.lam).imag / STEP
        assert by_place[name] == pytest.approx(truth, rel=1e-12, abs=1e-13)
        assert at == pytest.approx(truth, abs=1e-6)
        if name != "lam0":
            assert at_launch[name] == pytest.approx(moved.length(3.0).imag / STEP, rel=1e-12, abs=1e-13)


def test_with_friction(built: Build) -> None:
    """The derivative with respect to the coefficient of friction is that of motions that DOP853 follows."""
    given = {"h": 3.0, "r": 0.125, "g": 9.81, "Omega": 0.0, "lam0": -3.0, "v0": 30.0}
    rough = built("rough_hill", HILL, FRAME + gqm.CoulombFriction())
    motion = rough.solve(contact="above", mu=0.05, **given)

    def hill(u: float) -> tuple[Any, Any, Any]:
        return (
            (10 * u, 4 * np.sin(u / 2), 3 * np.cos(u)),
            (10.0, 2 * np.cos(u / 2), -3 * np.sin(u)),
            (0.0, -np.sin(u / 2), -3 * np.cos(u)),
        )

    def end(mu: float) -> float:
        newton = Newton(hill, mu=mu)

        def lifts(_: float, state: Any) -> float:
            first = np.array(hill(state[0])[1])
            up = leaning(first / np.linalg.norm(first), state[0] / 8)
            return float(newton.forces(state[0], state[1])[0] @ up)

        lifts.terminal = True  # type: ignore[attr-defined]
        return float(newton.follow(-3.0, 30.0, [2.0], lifts).t_events[0][0])

    assert motion.t_end == pytest.approx(end(0.05), abs=1e-10)
    assert motion.gradient("t_end")["mu"] == pytest.approx((end(0.051) - end(0.049)) / 0.002, rel=1e-5)


@pytest.mark.extended
@pytest.mark.parametrize(("curve", "losses"), [(RAIL, ""), (RAIL, "drag"), (LEANING, "")])
def test_along_a_rail(curve: Any, losses: str, built: Build) -> None:
    """Derivatives of the time of lift-off from a rail, by its shape and its roll too, are right to rounding, without
    losses and with losses that are zero.
    """
    given = {"a": 20.0, "c": 0.05, "q": 0.002, "g": 9.8125, "Omega": 0.25, "lam0": 2.0, "v0": 12.0}
    force, more = (FRAME + gqm.QuadraticDrag(), {"b": 0.0}) if losses else (FRAME, {})
    module = built(f"{losses}rail" if curve is RAIL else "leaning", curve, force)
    motion = module.solve(contact="above", **given, **more)
    assert motion.events[-1].kind == "liftoff"
    assert motion.events[-1].lam > given["a"] + 1.0
    found = motion.gradient("t_end")
    for name in given:
        body = OnRail if curve is RAIL else OnLeaningRail
        truth = derivative(body, given, name, motion.events[-1].lam, "a")
        assert found[name] == pytest.approx(truth, rel=1e-12)
