"""Widths of panels next to where a run begins."""

import pytest

from generated import circle_drag


@pytest.mark.parametrize("lam0", [0.0, 1e-30, -1e-18])
@pytest.mark.parametrize("v0", [1e-12, 1e-9, 1e-8, 1e-7])
def test_a_slow_throw_from_an_equilibrium_turns_where_it_should(lam0: float, v0: float) -> None:
    """For small speeds the turn is at v/omega*(1 - 2/3*beta*v/omega) with beta = b/m: W' = -2*beta*W - 2*omega**2*x, to
    the second order in beta. A first panel of an eighth of the curve knew the turn to three digits, or not at all.
    """
    g, beta = 9.81, 0.1
    omega = g**0.5
    legs = circle_drag.solve(lam0, v0, t_max=0.6).legs
    turn = v0 / omega * (1.0 - 2.0 / 3.0 * beta * v0 / omega)
    assert legs[0].end == "turn"
    assert legs[0].lam_end == pytest.approx(turn, rel=3e-15, abs=abs(lam0) * 2.0)
