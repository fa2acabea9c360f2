"""Derivatives of the contact force on space curves in frames that turn, against 40 digits and Newton's law.

The contact force per unit mass is W K + L + V A with A = 2 Ω (ẑ × t), so its square is a polynomial in the velocity V.
"""

from collections.abc import Callable
from types import ModuleType
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from newton import Newton, viviani

import gqm_sym as gqm

Build = Callable[[str, Any, Any], ModuleType]
Numbers = dict[str, Any]

VIVIANI = gqm.Curve.space(x="1 + cos(u)", y="sin(u)", z="2*sin(u/2)", parameter="u")
FRAME = gqm.Gravity() + gqm.RotatingFrame()


class Truth:
    """A body on Viviani's curve in a frame that turns, without losses, in mpmath; ``way`` is the sign of ds/dt."""

    def __init__(self, given: Numbers, way: int) -> None:
        self.omega, self.g, self.m, self.lam0, self.v0 = (
            mp.mpf(given[name]) for name in ("Omega", "g", "m", "lam0", "v0")
        )
        self.way = way

    def derivatives(self, u: Any) -> tuple[Any, Any, Any]:
        """Return place, first and second derivative as vectors."""
        c, s, half = mp.cos(u), mp.sin(u), u / 2
        return (
            mp.matrix([1 + c, s, 2 * mp.sin(half)]),
            mp.matrix([-s, c, mp.cos(half)]),
            mp.matrix([-c, -s, -mp.sin(half) / 2]),
        )

    def square(self, u: Any) -> Any:
        """Return V²."""
        here, there = self.derivatives(u)[0], self.derivatives(self.lam0)[0]
        fall = self.g * (there[2] - here[2])
        out = self.omega**2 * (here[0] ** 2 + here[1] ** 2 - there[0] ** 2 - there[1] ** 2) / 2
        return self.v0**2 + 2 * (fall + out)

    def size(self, u: Any) -> Any:
        """Return ds/du."""
        return mp.norm(self.derivatives(u)[1])

    def force(self, u: Any, way: int) -> Any:
        """Return the length of the contact force by its definition as a vector."""
        place, first, second = self.derivatives(u)
        rate = way * mp.sqrt(self.square(u)) / self.size(u)
        applied = mp.matrix(
            [
                self.omega**2 * place[0] + 2 * self.omega * rate * first[1],
                self.omega**2 * place[1] - 2 * self.omega * rate * first[0],
                -self.g,
            ]
        )
        missing = second * rate**2 - applied
        share = (missing.T * first)[0] / (first.T * first)[0]
        return self.m * mp.norm(missing - share * first)

    def extreme(self, near: float, way: int) -> Any:
        """Return the extreme of the contact force near a place."""
        place = mp.findroot(
            lambda u: mp.diff(lambda w: self.force(w, way), u), (mp.mpf(near), near + mp.mpf("1e-13")), tol=1e-30
        )
        return self.force(place, way)

    def place(self, t: Any, near: float) -> Any:
        """Return the place at a time before the first turn, by Newton's method from one that is right to doubles."""
        place = mp.mpf(near)
        for _ in range(3):
            passed = mp.quad(self.slowness, [self.lam0, place], method="gauss-legendre")
            place += (t - self.way * passed) / (self.way * self.slowness(place))
        return place

    def slowness(self, u: Any) -> Any:
        """Return the length of dt/du."""
        return self.size(u) / mp.sqrt(self.square(u))


def difference(of: Callable[[Numbers], Any], given: Numbers, name: str) -> float:
    """Return a derivative by a central difference in 40 digits."""
    step = mp.mpf("1e-15")
    more, less = ({**given, name: mp.mpf(given[name]) + sign * step} for sign in (1, -1))
    return float((of(more) - of(less)) / (2 * step))


GIVEN = {"lam0": -2, "v0": 4, "Omega": 1.5, "g": 9.81, "m": 2}


# With 1/10 the least force is passed so close to a turn that it is sought in time.
@pytest.mark.extended
@pytest.mark.parametrize("omega", [1.5, -1.5, 0.25, 0.1])
@pytest.mark.parametrize("quantity", ["normal_force_max", "normal_force_min"])
def test_extremes(quantity: str, omega: float, built: Build) -> None:
    """The derivatives of the extremes of the contact force are right to 12 digits."""
    module, given = built("turning", VIVIANI, FRAME), {**GIVEN, "Omega": omega}
    motion = module.solve(**given)
    found, extreme = motion.gradient(quantity), getattr(motion, quantity)
    way = int(np.sign(motion.state(extreme.t).v))
    with mp.workdps(40):
        assert extreme.value == pytest.approx(float(Truth(given, 1).extreme(extreme.lam, way)), rel=1e-14)
        for name, slope in found.items():
            truth = difference(lambda o: Truth(o, 1).extreme(extreme.lam, way), given, name)
            assert slope == pytest.approx(truth, rel=1e-12, abs=1e-12 * abs(extreme.value)), name


@pytest.mark.extended
def test_sweeps_have_the_same(built: Build) -> None:
    """Swept derivatives of extremes are those of single motions."""
    module = built("turning", VIVIANI, FRAME)
    swept = module.sweep("normal_force_max", lam0=-2, v0=[3.0, 4.0], Omega=1.5, gradient=("v0", "Omega"))
    for k, v0 in enumerate((3.0, 4.0)):
        single = module.solve(-2, v0, Omega=1.5).gradient("normal_force_max", ("v0", "Omega"))
        assert swept.gradient[k] == pytest.approx(list(single.values()), rel=1e-13)


@pytest.mark.extended
@pytest.mark.parametrize("way", [1, -1])
def test_sensitivities(way: int, built: Build) -> None:
    """The change of the contact force at a given time is right to 12 digits in both directions of motion."""
    module = built("turning", VIVIANI, FRAME)
    motion, t = module.solve(**GIVEN, direction=way), 0.2
    found, lam = motion.sensitivity(t), float(motion.state(t).lam)
    with mp.workdps(40):

        def force(numbers: Numbers) -> Any:
            truth = Truth(numbers, way)
            return truth.force(truth.place(mp.mpf(t), lam), way)

        for name, slope in zip(found.wrt, found.normal_force, strict=True):
            assert slope == pytest.approx(difference(force, GIVEN, name), rel=1e-12, abs=1e-12), name


@pytest.mark.extended
@pytest.mark.parametrize("lossy", [False, True])
def test_along_a_chart(lossy: bool, built: Build) -> None:
    """Along the same curve without its formulas the derivatives are the same."""
    curve = gqm.Curve.space(x="1 + cos(u)", y="sin(u)", z="2*sin(u/2)", parameter="u", domain=("-2*pi", "2*pi"))
    force = FRAME + gqm.CoulombFriction() if lossy else FRAME
    known = built(f"known_{lossy}", curve, force)
    charted = built(f"charted_{lossy}", curve.in_arc_length(), force)
    numbers = {"Omega": 1.5, "m": 2, **({"mu": 0.05} if lossy else {})}
    start = float(mp.quad(lambda u: mp.sqrt(1 + mp.cos(u / 2) ** 2), [-2 * mp.pi, -2]))
    one, other = known.solve(-2, 4, t_max=30, **numbers), charted.solve(start, 4, t_max=30, **numbers)
    wrt = ("v0", *numbers)
    for t in (0.3, 2.5, 7.0):
        assert other.state(t).normal_force == pytest.approx(one.state(t).normal_force, rel=1e-11)
        changes = (motion.sensitivity(t, wrt).normal_force for motion in (one, other))
        assert next(changes) == pytest.approx(next(changes), rel=1e-9, abs=1e-9)
    for quantity in ("normal_force_max", "normal_force_min"):
        slopes = [list(motion.gradient(quantity, wrt).values()) for motion in (one, other)]
        assert slopes[1] == pytest.approx(slopes[0], rel=1e-9, abs=1e-10)


def test_with_friction(built: Build) -> None:
    """With friction the change of the contact force agrees with differences of Newton's law, followed by DOP853 up to
    the first turn.
    """
    module = built("rough_turning", VIVIANI, FRAME + gqm.CoulombFriction())
    given = {**GIVEN, "mu": 0.1}
    motion, t = module.solve(**given), 0.4
    found = motion.sensitivity(t)

    def force(numbers: Numbers) -> float:
        newton = Newton(viviani, numbers["Omega"], numbers["mu"], numbers["g"])
        u, rate, _ = newton.follow(numbers["lam0"], numbers["v0"], [t]).y[:, 0]
        return float(numbers["m"] * np.linalg.norm(newton.forces(u, rate)[0]))

    for name, slope in zip(found.wrt, found.normal_force, strict=True):
        more, less = (force({**given, name: given[name] + step}) for step in (1e-4, -1e-4))
        assert slope == pytest.approx((more - less) / 2e-4, rel=1e-6, abs=1e-6), name
