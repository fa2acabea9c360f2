"""Turns by a law that contains the speed itself."""

from collections.abc import Callable
from typing import Any

import mpmath as mp
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from mpmath import mpf

import gqm_sym as gqm

Build = Callable[..., Any]
ULP = 2.0**-52
ELLIPSE = gqm.Curve.parametric(x="3/2*cos(u)", z="sin(u)", parameter="u", period="2*pi")
HELIX = gqm.Curve.space(x="cos(u)", y="sin(u)", z="u**2/5", parameter="u")
FRICTION = gqm.Gravity() + gqm.CoulombFriction(mu="1/8")


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


@pytest.mark.parametrize(
    ("curve", "term", "launches"),
    [
        (ELLIPSE, gqm.LinearDrag(c=0), [(0.7411654652888897, 0.0, 1), (0.9914846944768181, 0.0, 1)]),
        (
            ELLIPSE,
            gqm.Kernel.law("-direction*k*W**(3/4)", parameters={"k": 0}),
            [(-2.6068268445611213, 0.07900794932924482, -1)],
        ),
        (HELIX, gqm.RotatingFrame(Omega=0), [(-2.6917607456319788, 0.0, 1), (2.351478941983469, 0.0, 1)]),
    ],
    ids=["drag", "power", "frame"],
)
def test_a_root_of_v2_with_the_coefficient_zero_changes_nothing(curve, term, launches, tmp_path):
    """The law has no values beyond the turn, which a panel did go beyond if V**2 > 0 at one of its nodes only."""
    plain = gqm.build(gqm.derive(curve, FRICTION), name="without_root", folder=tmp_path)
    with_root = gqm.build(gqm.derive(curve, FRICTION + term), name="with_root", folder=tmp_path)
    for lam0, v0, direction in launches:
        legs = with_root.solve(lam0, v0, direction=direction).legs
        wanted = plain.solve(lam0, v0, direction=direction).legs
        assert [leg.end for leg in legs] == [leg.end for leg in wanted]
        assert [leg.lam_end for leg in legs] == pytest.approx([leg.lam_end for leg in wanted], rel=0.0, abs=4e-15)
        assert [leg.t_end for leg in legs] == pytest.approx([leg.t_end for leg in wanted], rel=2e-15)
