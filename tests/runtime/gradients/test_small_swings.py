"""Derivatives of the half periods of the smallest swings, about an equilibrium at which places are not 0."""

import math
from pathlib import Path

import numpy as np
import pytest

import gqm_sym as gqm

CURVES = {
    "graph": gqm.Curve.graph("(x - 1)**2/2 + (x - 1)**3/10", parameter="x"),
    "path": gqm.Curve.parametric(x="cos(u - 1/3)", z="sin(u - 1/3) + u/9", parameter="u"),
}


@pytest.mark.extended
@pytest.mark.parametrize("name", CURVES)
def test_no_swing_is_too_small_for_derivatives(name: str, tmp_path: Path) -> None:
    """The derivative by g is -T/(2 g), and that by the launch place grows in proportion to the distance.

    Below some 1e-9 double-double arithmetic has lost all digits of the rate of time, and the derivatives were zeros, or
    in sweeps wrong by orders of magnitude.
    """
    module = gqm.build(gqm.derive(CURVES[name], gqm.Gravity()), name=f"small_{name}", folder=tmp_path)
    bottom = 1.0 if name == "graph" else 1 / 3 - math.acos(-1 / 9)
    distances = 10.0 ** -np.arange(4.0, 13.0)
    distances = (bottom + distances) - bottom
    wrt = ("lam0", "g")
    swept = module.sweep("half_period", bottom + distances, gradient=wrt)
    solved = np.array(
        [list(module.solve(lam).gradient("half_period", wrt=wrt).values()) for lam in (bottom + distances).tolist()]
    )
    for found in (swept.gradient, solved):
        np.testing.assert_allclose(found[:, 1], -swept.values / (2.0 * 9.81), rtol=1e-15)
        # The bottom is known to a rounding, and next to it there are further terms.
        allowed = 10.0 * distances + 4e-16 / distances
        assert (np.abs(found[:, 0] / distances / (found[2, 0] / distances[2]) - 1.0) <= allowed + allowed[2]).all()
    second = module.solve(bottom + 1e-11).gradient("half_period", wrt=("lam0",), order=2)["lam0"]["lam0"]
    assert second == pytest.approx(solved[2, 0] / distances[2], rel=1e-4)


def test_compiled_code_suffices_next_to_a_bottom(tmp_path: Path) -> None:
    """At 2e-5 of the bottom of a limacon no launch is solved, which takes 26 ms in extended precision.

    The derivative by the launch place is proportional to the distance.
    """
    curve = gqm.Curve.polar("2 + cos(th)", parameter="th", period="2*pi")
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="small_limacon", folder=tmp_path)
    bottom = -math.acos((math.sqrt(3.0) - 1.0) / 2.0)
    distances = np.array([-2.2e-5, 2.2e-5, 1e-4])
    swept = module.sweep("half_period", bottom + distances, gradient=("lam0",))
    assert "solve" not in swept.route_counts()
    rates = swept.gradient[:, 0] / distances
    np.testing.assert_allclose(rates, rates[2], rtol=3e-4)
