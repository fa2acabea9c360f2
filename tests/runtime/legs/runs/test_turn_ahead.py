"""Turns by a law that contains the speed itself agree with closed forms."""

from collections.abc import Callable
from typing import Any

import mpmath as mp
from hypothesis import example, given, settings
from hypothesis import strategies as st
from mpmath import mpf

import gqm_sym as gqm

Build = Callable[..., Any]
ULP = 2.0**-52


@settings(max_examples=40)
@given(st.floats(-1, 2), st.floats(-3, -0.05), st.floats(-3, 2))
@example(-0.297, -0.0628, -0.6487)
def test_turns_of_a_spring_with_linear_drag(build: Build, stiffness: float, ratio: float, size: float) -> None:
    """Weakly and strongly damped, every turn and its time are right to some units in the last place of the leg's width
    and of the time; a leg took some sixty panels, because the root of V**2 was followed up to the turn ahead.
    """
    k = 10.0**stiffness
    c, lam0 = 2.0 * 10.0**ratio * k**0.5, 10.0**size
    spring = build("changing_damper", gqm.Curve.graph("0*x"), gqm.Potential("k*x**2/2") + gqm.LinearDrag())
    legs = spring.solve(lam0, t_max=10.0 / k**0.5, k=k, c=c).legs
    assert len(legs) > 1 or ratio > -0.3
    with mp.workdps(40):
        decay = mpf(c) / 2
        omega, before = mp.sqrt(mpf(k) - decay**2), mpf(lam0)
        for n, leg in enumerate(legs[:-1], 1):
            t = n * mp.pi / omega
            place = mpf(lam0) * mp.exp(-decay * t) * (-1) ** n
            assert leg.end == "turn"
            assert abs(leg.lam_end - place) <= 4 * ULP * abs(before)
            assert abs(leg.t_end - t) <= 8 * ULP * t
            before = place
