"""Legs of a droplet past places where the curvature changes its sign, or almost vanishes in space, compared with
definitions of V**2.
"""

from collections.abc import Callable
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from quadrature import integral

import gqm_sym as gqm


class Droplet:
    """A droplet on the graph ``x**2/2 + sin(3 x)/8``, of which the curvature changes its sign at ``sin(3 x) = 8/9``.

    The curvature times ds is the change of the tangent angle. So V**2 is what gravity gains, less 2 b times all changes
    of that angle since the last turn, which are its differences between the places where the curvature changes sign.
    """

    def __init__(self, b: float) -> None:
        first = mp.asin(mpf(8) / 9)
        self.kinks = [(k - 2 * lap * mp.pi) / 3 for k in (first, mp.pi - first) for lap in (0, 1)]
        self.b, self.g = mpf(b), mpf("9.81")

    def height(self, x: Any) -> Any:
        """Return z."""
        return x * x / 2 + mp.sin(3 * x) / 8

    def slope(self, x: Any) -> Any:
        """Return dz/dx."""
        return x + 3 * mp.cos(3 * x) / 8

    def bend(self, x: Any) -> Any:
        """Return the curvature."""
        return (1 - 9 * mp.sin(3 * x) / 8) / (1 + self.slope(x) ** 2) ** 1.5

    def v2(self, a: mpf, x: Any) -> Any:
        """Return V**2 at x after a turn at a."""
        between = [a, *sorted((k for k in self.kinks if min(a, x) < k < max(a, x)), reverse=x < a), x]
        angles = [mp.atan(self.slope(place)) for place in between]
        bent = mp.fsum(abs(one - other) for one, other in pairwise(angles))
        return 2 * self.g * (self.height(a) - self.height(x)) - 2 * self.b * bent

    def turn(self, a: mpf) -> Any:
        """Return where the droplet turns after a turn at a: the first zero of V**2 on the other side of the well."""
        places = np.linspace(float(a), -1.8 if a > -0.25 else 1.8, 100)[5:].tolist()
        k = next(k for k, x in enumerate(places) if self.v2(a, mpf(x)) < 0)
        return mp.findroot(lambda x: self.v2(a, x), (places[k - 1], places[k]))

    def time(self, a: mpf, b: mpf, x: mpf) -> Any:
        """Return the time from a turn at a to x, on the way to one at b."""

        def rate(phase: mpf) -> Any:
            place = a + (b - a) * mp.sin(phase / 2) ** 2
            ds = mp.sqrt(1 + self.slope(place) ** 2)
            return abs(b - a) * mp.sin(phase) / 2 * ds / mp.sqrt(self.v2(a, place))

        phases = [2 * mp.asin(mp.sqrt((k - a) / (b - a))) for k in self.kinks if min(a, x) < k < max(a, x)]
        ends = [0, *sorted(phases), 2 * mp.asin(mp.sqrt((x - a) / (b - a)))]
        return mp.quad(rate, ends, method="gauss-legendre", maxdegree=5)

    def load(self, a: mpf, x: mpf) -> Any:
        """Return the contact force per mass."""
        return self.g / mp.sqrt(1 + self.slope(x) ** 2) + self.bend(x) * self.v2(a, x)


def largest(function: Callable[[Any], Any], a: mpf, b: mpf) -> float:
    """Return the largest value of a function between two places; it has one peak where it is largest at 50 places."""
    places = np.linspace(float(a), float(b), 52)[1:-1].tolist()
    best = max(places, key=function)
    return float(function(mp.findroot(lambda x: mp.diff(function, x), best)))


# The turns after the first of these launches lie beyond both kinks, and those after the others next to them or between
# them.
@pytest.mark.sample(1)
@pytest.mark.parametrize("start", [1.125, 0.6875, 0.5, 0.375])
def test_droplet_past_kinks(start: float, generated_folder: Path) -> None:
    """Turns, times, extremes and places agree wherever the turns lie with respect to the kinks."""
    model = gqm.derive(gqm.Curve.graph("x**2/2+sin(3*x)/8"), gqm.Gravity() + gqm.SurfaceTension())
    module = gqm.build(model, name="droplet_past_kinks", folder=generated_folder)
    given = {"gamma": 1.0, "ell_c": 0.25, "t_max": 10.0}

    def swept(quantity: str, **more: Any) -> float:
        return float(module.sweep(quantity, [start], 0.0, **(given | more)).values[0])

    with mp.workdps(28):
        body, turns = Droplet(0.0625), [mpf(start)]
        for _ in range(4):
            turns.append(body.turn(turns[-1]))
        times = [body.time(a, b, b) for a, b in pairwise(turns)]
        ends = [float(mp.fsum(times[: k + 1])) for k in range(len(times))]
        motion = module.solve(start, 0.0, **given)
        assert [leg.lam_end for leg in motion.legs[:4]] == pytest.approx(
            [float(x) for x in turns[1:]], rel=0.0, abs=4e-15
        )
        assert [leg.t_end for leg in motion.legs[:4]] == pytest.approx(ends, rel=2e-15)
        last = motion.legs[-1].lam_end  # the last leg alone is followed for its place at the horizon
        assert last == pytest.approx(motion.lam(10.0), rel=0.0, abs=2e-15)
        assert last == motion.legs[-1].lam_end  # with all panels too
        a, b = turns[:2]
        fastest = largest(lambda x: body.v2(a, x), a, b)
        assert swept("v_max") == pytest.approx(fastest**0.5, rel=1e-15)
        assert swept("v_max", t_max=0.5 * (ends[0] + ends[1])) == pytest.approx(fastest**0.5, rel=1e-15)
        assert swept("normal_force_max") == pytest.approx(largest(lambda x: body.load(a, x), a, b), rel=2e-15)
        for share in ("0.03125", "0.25", "0.5", "0.9375"):
            place = mpf(float(a + (b - a) * mpf(share)))
            time = float(body.time(a, b, place))
            assert swept("time_at", lam=float(place)) == pytest.approx(time, rel=2e-15)
            assert abs(motion.lam(time) - place) <= min(motion.error_bound(time), 2e-15)


class SpaceDroplet(Droplet):
    """A droplet on the space curve ``(t, sin(2 t)/5, t**2/2 + sin(3 t)/10)``, which is almost straight at t = 0.24.

    Its turning rate, the length of ``r' x r''`` over ds**2, has branch points at 0.2436 + 0.2130 i there.
    """

    def __init__(self, b: float) -> None:
        super().__init__(b)
        self.kinks = [mpf("0.2436"), mpf("-0.39"), mpf("0.9")]  # where its integral is divided
        self.bent: dict[tuple[Any, Any], Any] = {}

    def height(self, t: Any) -> Any:
        """Return z."""
        return t * t / 2 + mp.sin(3 * t) / 10

    def rates(self, t: Any) -> tuple[Any, Any]:
        """Return the first and the second derivative of the coordinates."""
        first = (mpf(1), 2 * mp.cos(2 * t) / 5, t + 3 * mp.cos(3 * t) / 10)
        return first, (mpf(0), -4 * mp.sin(2 * t) / 5, 1 - 9 * mp.sin(3 * t) / 10)

    def ds(self, t: Any) -> Any:
        """Return ds/dt."""
        return mp.sqrt(mp.fsum(c * c for c in self.rates(t)[0]))

    def vector(self, t: Any) -> list[Any]:
        """Return the derivative of the unit tangent with respect to t."""
        (first, second), ds = self.rates(t), self.ds(t)
        along = mp.fsum(c * d for c, d in zip(first, second, strict=True)) / ds**2
        return [(d - along * c) / ds for c, d in zip(first, second, strict=True)]

    def turning(self, t: Any) -> Any:
        """Return the turning rate."""
        return mp.sqrt(mp.fsum(c * c for c in self.vector(t)))

    def v2(self, a: mpf, x: Any) -> Any:
        """Return V**2 at x after a turn at a."""
        ends = [min(a, x), *sorted(k for k in self.kinks if min(a, x) < k < max(a, x)), max(a, x)]
        for part in pairwise(ends):
            if part not in self.bent:
                self.bent[part] = integral(self.turning, part, 4)
        bent = mp.fsum(self.bent[part] for part in pairwise(ends))
        return 2 * self.g * (self.height(a) - self.height(x)) - 2 * self.b * bent

    def load(self, a: mpf, x: mpf) -> Any:
        """Return the contact force per mass."""
        tangent, ds, v2 = self.rates(x)[0], self.ds(x), self.v2(a, x)
        slope = tangent[2] / ds**2
        parts = [v2 * c / ds - self.g * slope * d for c, d in zip(self.vector(x), tangent, strict=True)]
        return mp.sqrt(parts[0] ** 2 + parts[1] ** 2 + (parts[2] + self.g) ** 2)


@pytest.mark.extended
@pytest.mark.parametrize(("start", "b"), [(1.125, 0.0625), (-1.0, 0.000625)])
def test_droplet_past_branch_points(start: float, b: float, generated_folder: Path) -> None:
    """Extremes and times on a space curve that is almost straight at one place agree, as long as a droplet swings."""
    curve = gqm.Curve.space(x="t", y="sin(2*t)/5", z="t**2/2+sin(3*t)/10", parameter="t")
    model = gqm.derive(curve, gqm.Gravity() + gqm.SurfaceTension())
    module = gqm.build(model, name="droplet_past_branch_points", folder=generated_folder)
    given = {"gamma": 1.0, "ell_c": b**0.5, "t_max": 10.0}

    def swept(quantity: str, **more: Any) -> float:
        return float(module.sweep(quantity, [start], 0.0, **(given | more)).values[0])

    with mp.workdps(20):
        body, a = SpaceDroplet(b), mpf(start)
        for quantity, function, power in (("v_max", body.v2, 0.5), ("normal_force_max", body.load, 1.0)):
            best = max(np.linspace(-0.9, 0.9, 31).tolist(), key=lambda x, f=function: f(a, mpf(x)))
            slope = partial(mp.diff, partial(function, a))
            top = mp.findroot(slope, mpf(best), tol=1e-16, verify=False)
            assert swept(quantity) == pytest.approx(float(function(a, top) ** power), rel=1e-15)
        target = mpf("-0.5") if start > 0 else mpf("0.5")

        def rate(y: mpf) -> Any:
            place = a + (target - a) * y * y  # there is a root of the distance in V**2 at the start
            return 2 * y * abs(target - a) * body.ds(place) / mp.sqrt(body.v2(a, place))

        ends = sorted(mp.sqrt((k - a) / (target - a)) for k in body.kinks if min(a, target) < k < max(a, target))
        time = integral(rate, [0, *ends, 1], 4)
        assert swept("time_at", lam=float(target)) == pytest.approx(float(time), rel=2e-15)
