"""Places that are never reached, times beyond the last digit, and very slow launches are answered or refused."""

import math
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from naive import ulps

import gqm_sym as gqm
from gqm_sym.errors import InputError, LaunchError, SolutionError
from gqm_sym.runtime.motion import timing

# Twice the root of g L is the speed that leads from the lowest place exactly to the highest.
TO_THE_TOP = "2*sqrt(9.81)"


@pytest.fixture(scope="module")
def circle(module_of: Callable[[str], ModuleType]) -> ModuleType:
    """Return a bead on a circle; L is 1 in all launches here."""
    return module_of("circle")


def test_a_round_has_no_half(circle: ModuleType) -> None:
    """A round has no half period, and is never at a place behind its launch, because places count the rounds."""
    motion = circle.solve(lam0=0, v0=10, L=1)
    assert motion.kind == "circulation"
    with pytest.raises(SolutionError, match="only a libration has one; this motion is of kind 'circulation'"):
        _ = motion.half_period
    with pytest.raises(SolutionError, match=r"never at lam = -1\.0; it moves from 0\.0 to 6\.28"):
        motion.time_at(-1.0)


def test_rest_is_at_one_place(circle: ModuleType) -> None:
    """A body at rest is at its launch place from the launch on, and elsewhere never."""
    motion = circle.solve(lam0=0, L=1)
    assert motion.time_at(0) == 0.0
    with pytest.raises(SolutionError, match=r"never at lam = 1; it rests at 0\.0"):
        motion.time_at(1)


def test_lost_on_the_way_to_the_top(circle: ModuleType) -> None:
    """With V**2 = 2 g L (1 + cos), N vanishes inside the circle at a cosine of -2/3, so that the top is never
    approached.
    """
    motion = circle.solve(lam0=0, v0=TO_THE_TOP, L=1, contact="above")
    assert (motion.kind, motion.events[-1].kind) == ("transit", "liftoff")
    with mp.workdps(30):
        there = mp.acos(-mpf(2) / 3)
        assert ulps(motion.legs[-1].lam_end, there) <= 2.0
        # On the separatrix tan((pi + angle)/4) = exp(omega t).
        when = mp.log(mp.tan((mp.pi + there) / 4)) / mp.sqrt(mpf("9.81"))
        assert ulps(motion.t_end, when) <= 4.0


def test_an_approach_has_a_last_digit(circle: ModuleType) -> None:
    """At 5 s the distance to the top is known, and after 1000 s it has no digits left, unless a horizon ends the
    motion.
    """
    motion = circle.solve(lam0=0, v0=TO_THE_TOP, L=1)
    with mp.workdps(30):
        assert ulps(motion.lam(5.0), 4 * mp.atan(mp.exp(5 * mp.sqrt(mpf("9.81")))) - mp.pi) <= 2.0
    with pytest.raises(SolutionError, match=r"closer to the equilibrium at lam = 3\.14.* than doubles can tell"):
        motion.lam(1000.0)
    with pytest.raises(InputError, match=r"t: the motion ends at 3\.0 s \(the horizon t_max\), got 4\.0"):
        circle.solve(lam0=0, v0=TO_THE_TOP, L=1, t_max=3).lam(4.0)


def test_a_fall_without_an_end(tmp_path: Path) -> None:
    """Down a line the body moves g t**2/4 in x, as long as that is well inside the range of doubles."""
    motion = gqm.build(gqm.derive(gqm.Curve.graph("-x"), gqm.Gravity()), name="line", folder=tmp_path).solve(lam0=0)
    for t in (1.0, 1e3, 1e20):
        assert motion.lam(t) == pytest.approx(9.81 * t**2 / 4.0, rel=1e-15)
    with pytest.raises(SolutionError, match=r"leaves the range of doubles at x = .*; give a shorter t_max"):
        motion.lam(1e120)


@pytest.mark.extended
def test_a_fall_to_a_singular_point(tmp_path: Path) -> None:
    """The graph of x**(3/2) is passed from 1 to 0, where its curvature is infinite and the curve ends."""
    motion = gqm.build(gqm.derive(gqm.Curve.graph("x*sqrt(x)"), gqm.Gravity()), name="root", folder=tmp_path).solve(
        lam0=1
    )
    with pytest.raises(InputError, match=r"the motion ends at 0\.6.* s \(singular-point at x = .*\), got 1\.0"):
        motion.lam(1.0)
    with mp.workdps(20):
        time = mp.quad(
            lambda y: 2 * y * mp.sqrt((1 + mpf("2.25") * (1 - y * y)) / (2 * mpf("9.81") * (1 - (1 - y * y) ** 1.5))),
            [0, 1],
            method="gauss-legendre",
        )
    assert motion.t_end == pytest.approx(float(time), rel=1e-14)


def test_a_fall_beyond_what_can_be_summed(tmp_path: Path) -> None:
    """Down -exp(x), V**2 = 2 g (exp(x) - 1) over some e**300 m; beyond, the square of the height is beyond doubles."""
    motion = gqm.build(gqm.derive(gqm.Curve.graph("-exp(x)"), gqm.Gravity()), name="cliff", folder=tmp_path).solve(
        lam0=0
    )
    with mp.workdps(20):
        for place in (1.0, 100.0):
            time = mp.quad(
                lambda y: 2 * y * mp.sqrt((1 + mp.exp(2 * y * y)) / (2 * mpf("9.81") * mp.expm1(y * y))),
                mp.linspace(0, mp.sqrt(place), 9),
            )
            assert motion.time_at(place) == pytest.approx(float(time), rel=1e-14)
    with pytest.raises(SolutionError, match="the integrand is not finite there; is the curve regular"):
        motion.time_at(900)


@pytest.mark.parametrize("v0", ["1e-3", "1e-9", "1e-12", "1e-20"])
def test_out_of_a_cusp_however_slowly(v0: str, module_of: Callable[[str], ModuleType]) -> None:
    """The body turns at 2 asin(k) after 2 sqrt(R/g) atanh(k), with k = v0/(2 sqrt(g R))."""
    motion = module_of("cycloid_arch").solve(lam0=0, v0=v0, R=1)
    with mp.workdps(40):
        k = mpf(v0) / (2 * mp.sqrt(mpf("9.81")))
        assert ulps(motion.turning_points[0], 2 * mp.asin(k)) <= 2.0
        assert ulps(motion.legs[0].t_end, 2 / mp.sqrt(mpf("9.81")) * mp.atanh(k)) <= 4.0


def test_out_of_a_cusp_the_wrong_way(module_of: Callable[[str], ModuleType]) -> None:
    """The domain begins at the cusp; a body released there, at the lowest place, rests."""
    module = module_of("cycloid_arch")
    with pytest.raises(LaunchError, match=r"is the cusp itself, .* launch with direction=1 or from a place inside"):
        module.solve(lam0=0, v0=1, R=1, direction=-1)
    assert module.solve(lam0=0, R=1).kind == "rest"
    assert math.isinf(module.solve(lam0=0, R=1).t_end)


@pytest.mark.parametrize("launch", [(math.pi - 1e-7, 0.0, 1), (0.3, 6.193843872478277, -1)])
def test_times_beside_a_hilltop(
    circle: ModuleType, launch: tuple[float, float, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The times at the edges of all panels, and that of the launch, are elliptic integrals to 17 digits, although V**2
    loses more than half of its 31 digits, and without mpmath.
    """

    def refused(*_: Any, **__: Any) -> None:
        raise AssertionError("times are found in mpmath")

    monkeypatch.setattr(timing, "_durations", refused)
    lam0, v0, direction = launch
    motion = circle.solve(lam0=lam0, v0=v0, direction=direction, L=1)
    motion.state(0.4 * motion.period)
    found = motion._times_until(motion.period).timing
    with mp.workdps(50):
        rate = mp.sqrt(mpf("9.81"))
        square = (mpf(v0) / (2 * rate)) ** 2 + mp.sin(mpf(lam0) / 2) ** 2
        top = 2 * mp.asin(mp.sqrt(square))

        def time_to(place: Any) -> Any:
            share = min(max(mp.sin(place / 2) / mp.sqrt(square), -1), 1)
            return (mp.ellipk(square) + mp.ellipf(mp.asin(share), square)) / rate

        angles = [*motion._segment.edges[:-1].tolist(), mp.pi]
        exact = [time_to(top * (2 * mp.sin(mpf(angle) / 2) ** 2 - 1)) for angle in angles]
        times = [mpf(high) + mpf(low) for high, low in zip(*map(np.ndarray.tolist, found.edge_times), strict=True)]
        assert len(times) > 40
        assert max(abs(a - b) for a, b in zip(times, exact, strict=True)) < 1e-17 * exact[-1]
        assert abs(sum(map(mpf, found.phase_time)) - time_to(mpf(lam0))) < 1e-17 * exact[-1]
