"""Derivatives of half periods of small swings agree with a time integral in mpmath, and none is left to it."""

from pathlib import Path

import numpy as np
from mpmath import mp, mpf

import gqm_sym as gqm

ULP = 2.0**-52


def test_small_swings_in_a_well_without_symmetry(tmp_path: Path) -> None:
    """Next to an equilibrium, where V**2 as a difference of potentials has few digits, derivatives are those of a time
    integral in mpmath.
    """
    curve = gqm.Curve.graph("x**2/2 + sin(3*x)/10", parameter="x")
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="uneven_well", folder=tmp_path)
    bottom = min((e.lam for e in module.equilibria() if e.stable), key=abs)
    places = bottom + np.array([1e-3, -5e-4, 2e-4, -1e-4, 4e-5])
    found = module.sweep("half_period", places, gradient=("lam0", "g", "v0"))
    assert found.route_counts() == {"batch": places.size}
    with mp.workdps(70):
        g = mpf("9.81")

        def height(x: mpf) -> mpf:
            return x**2 / 2 + mp.sin(3 * x) / 10

        def slope(x: mpf) -> mpf:
            return x + 3 * mp.cos(3 * x) / 10

        def half_period(start: mpf) -> mpf:
            turn, total = 2 * mp.findroot(slope, bottom) - start, mpf(0)
            for _ in range(8):
                turn -= (height(turn) - height(start)) / slope(turn)
            for k in range(32):
                x = start + (turn - start) * mp.sin(mp.pi * (2 * k + 1) / 128) ** 2
                level = (height(start) - height(x)) / ((x - start) * (turn - x))
                total += mp.pi / 32 * mp.sqrt((1 + slope(x) ** 2) / (2 * g * level))
            return total

        for place, (by_place, by_g, by_speed) in zip(places, found.gradient.tolist(), strict=True):
            start, step = mpf(place), mpf("1e-16")
            truth = (half_period(start + step) - half_period(start - step)) / (2 * step)
            assert abs(by_place - truth) <= ULP * abs(truth)
            assert abs(by_g + half_period(start) / (2 * g)) <= ULP * abs(by_g)
            assert by_speed == 0.0
