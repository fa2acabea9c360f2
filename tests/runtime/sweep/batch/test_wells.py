"""Proofs that the orbits of a sweep share find each turning point, and none that is not there."""

from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import gqm_sym as gqm
from generated import circle, cycloid_inverted, parabola_rolling

ULPS = 4.0
ROLLING = {"a": 1.0, "beta": 0.4, "rho": 0.05, "g": 9.81, "m": 1.0}


def _half_period(amplitude: float) -> mpf:
    """Return the half period of the ball in the parabolic bowl from the integral of ds/V."""
    with mp.workdps(30):
        h, rho, g, inertia = mpf(amplitude), mpf(0.05), mpf(9.81), 1 + mpf(0.4)

        def height(x: mpf) -> mpf:
            return x**2 + rho / mp.sqrt(1 + 4 * x**2)

        def rate(phi: mpf) -> mpf:
            x = h * mp.sin(phi)
            root = mp.sqrt(1 + 4 * x**2)
            v2 = 2 * g * (height(h) - height(x)) / inertia
            return (root - 2 * rho / root**2) * h * mp.cos(phi) / mp.sqrt(v2)

        return 2 * mp.quad(rate, [0, 0.8, mp.pi / 2], method="gauss-legendre")


@pytest.mark.parametrize("amplitude", [1e-3, 0.24999, 0.25, 0.9, 3.0])
def test_half_periods_in_a_proved_well(amplitude: float) -> None:
    """Half periods on both sides of the distances at which proofs end are those of the integral."""
    got = parabola_rolling.sweep("half_period", [amplitude, -amplitude], **ROLLING)
    truth = _half_period(amplitude)
    assert got.route_counts() == {"batch": 2}
    for value in got.values:
        assert abs(mpf(float(value)) - truth) <= ULPS * np.spacing(float(truth))


def test_a_launch_alone_has_the_same_bits() -> None:
    """Neither other launches nor their number change an answer; nor do parameters that are arrays, but for rounding."""
    rng = np.random.default_rng(8)
    lam0, v0 = rng.uniform(-2, 2, 300), np.where(rng.random(300) < 0.5, 0.0, rng.uniform(0, 3, 300))
    for quantity in ("half_period", "turning_points"):
        together = parabola_rolling.sweep(quantity, lam0, v0, **ROLLING)
        alone = [parabola_rolling.sweep(quantity, [x], [v], **ROLLING).values[0] for x, v in zip(lam0, v0, strict=True)]
        assert np.array_equal(together.values, alone)
        singly = parabola_rolling.sweep(quantity, lam0, v0, **{**ROLLING, "rho": np.full(300, 0.05)})
        assert singly.values == pytest.approx(together.values, rel=5e-16, abs=0.0)


@pytest.mark.extended
@pytest.mark.parametrize("count", [1, 8, 131])
def test_bodies_that_all_rest_have_the_same_bits(count: int) -> None:
    """Where all bodies are released at rest, in their well or beyond the ends of the curve, no zero is searched; one
    that is thrown among them changes no answer.
    """
    places = np.linspace(0.05, 6.2, count)
    for module, given in ((cycloid_inverted, {"R": 1.0}), (parabola_rolling, ROLLING), (circle, {"L": 1.0})):
        for lam0 in (places, np.append(places, -3.5), np.append(places, np.nan)):
            searched, speeds = np.append(lam0, 1.0), np.append(np.zeros(lam0.size), 1e-3)
            for quantity in ("half_period", "turning_points"):
                rest = module.sweep(quantity, lam0, **given)
                mixed = module.sweep(quantity, searched, speeds, **given)
                assert np.array_equal(rest.values, mixed.values[:-1], equal_nan=True)
                assert np.array_equal(rest.status, mixed.status[:-1])


def test_a_cycloid_is_a_tautochrone() -> None:
    """Between the cusps of a cycloid all half periods are 2 pi sqrt(R/g); nothing swings across a cusp."""
    rng = np.random.default_rng(6)
    lam0, v0 = rng.uniform(0.3, 6.0, 200), np.where(rng.random(200) < 0.5, 0.0, rng.uniform(0.0, 4.0, 200))
    got = cycloid_inverted.sweep("half_period", lam0, v0, R=1)
    swings = v0**2 < 2 * 9.81 * (1 - np.cos(lam0))  # the rest reach a cusp, at height 0
    assert swings.any()
    assert not swings.all()
    assert (got.status == 0).tolist() == swings.tolist()
    assert got.values[swings] == pytest.approx(2 * np.pi / np.sqrt(9.81), rel=ULPS * 2.0**-52, abs=0.0)


@pytest.mark.extended
def test_bits_do_not_depend_on_the_well_of_the_first_orbit(tmp_path: Path) -> None:
    """The proofs of one well serve its orbits alone; those of the other well have the same bits beside them."""
    curve = gqm.Curve.graph("x**4 - x**2 + x/9", parameter="x")
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="two_unlike_wells", folder=tmp_path)
    lam0 = np.random.default_rng(2).uniform(-1.4, 1.4, 150)
    for quantity in ("half_period", "turning_points"):
        one, other = (module.sweep(quantity, np.append(first, lam0)).values[1:] for first in (-0.9, 0.75))
        alone = [module.sweep(quantity, [place]).values[0] for place in lam0]
        assert np.array_equal(one, other)
        assert np.array_equal(one, alone)
    times = module.sweep("half_period", lam0)
    assert times.route_counts()["batch"] > 100
    for place, value in zip(lam0[:20].tolist(), times.values, strict=False):
        truth = module.solve(place).half_period
        assert abs(value - truth) <= ULPS * np.spacing(truth)


# With the size 11/400 nothing but a very flat bottom is left of the dents, and with 23/800 a very low hilltop at 0.
@pytest.mark.extended
@pytest.mark.parametrize(("size", "tilt"), [("1/6", 0), ("1/6", "1/3"), ("11/400", 0), ("23/800", 0)])
def test_orbits_stay_in_their_dents(size: str, tilt: int | str, tmp_path: Path) -> None:
    """In a bowl with dents, bodies released at rest turn at the next place of the same height, found by a search on a
    fine grid.
    """
    curve = gqm.Curve.graph(f"x**2/2 + {size}*cos(6*x) + {tilt}*x", parameter="x")
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="dented_bowl", folder=tmp_path)
    lean, dent = float(Fraction(tilt)), float(Fraction(size))

    def height(x: Any) -> Any:
        return x**2 / 2 + dent * np.cos(6 * x) + lean * x

    lam0 = np.concatenate([np.random.default_rng(4).uniform(0.01, 3.0, 200), [0.5, 1.0, 2.0]])
    got = module.sweep("turning_points", lam0)
    for (low, high), start in zip(got.values.tolist(), lam0.tolist(), strict=True):
        way = -np.sign(start - 6 * dent * np.sin(6 * start) + lean)
        places = start + way * np.linspace(1e-3, 7.0, 70_000)
        turn = places[np.argmax(height(places) > height(start))]
        assert (low if way < 0 else high) == pytest.approx(turn, abs=2e-4)
        assert (high if way < 0 else low) == pytest.approx(start, rel=1e-15)
