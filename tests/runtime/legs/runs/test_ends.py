"""The place at which a run ends at a turn."""

import mpmath as mp
import numpy as np
import pytest

import gqm_sym as gqm
from gqm_sym.runtime.legs.runs.ends import short_way_to_turn


@pytest.mark.parametrize("resistance", [0.0, 1e-9, 1e-5, 1e-3, 0.3, 1.0, 40.0, 1e4, 1e8])
def test_the_way_to_a_turn(resistance):
    """With a constant force and a resistance in proportion to speed, the way is an integral over the speed."""
    v2, force = 3e-7, 2.5
    with mp.workdps(40):
        v = mp.sqrt(v2)
        rate = 0.5 * force * mp.mpf(resistance) / v
        true = mp.quad(lambda u: u / (0.5 * force + rate * u), [0, v * 1e-6, v * 1e-3, v])
    slope = -force * (1.0 + resistance)
    assert short_way_to_turn.py_func(v2, slope, -force) == pytest.approx(float(true), rel=1e-6)


@pytest.mark.extended
def test_a_body_that_creeps_to_rest_on_a_level_line(tmp_path):
    """The line behind half a circle is level but for the rounding of pi, so that the body turns where it is slower than
    1e-15 m/s. The truth is the law of motion on an arc and a level line, in 25 digits.
    """
    line, arc = gqm.line, gqm.arc
    back = [line(length=3), arc(radius=1, angle="pi"), line(length="3/2")]
    track = gqm.Curve.piecewise([line(length="3/2"), arc(radius=1, angle="pi"), *back], closed=True)
    parted = gqm.Curve.piecewise([line(length=1), line(length="1/2"), arc(radius=1, angle="pi"), *back], closed=True)
    forces = gqm.Gravity(g="981/100") + gqm.LinearDrag(c="1/5")
    for name, curve in (("level", track), ("level_parted", parted)):
        module = gqm.build(gqm.derive(curve, forces), name=name, folder=tmp_path)
        motion = module.solve(11.4902949869346, 0.5, t_max=20.0)
        assert motion.state([15.0, 19.33]).v == pytest.approx(
            [-0.02752140558082502552, -0.01157634841177674611], rel=2e-12
        )
        last = motion.state(np.array([19.3, 19.35])).v
        assert last[1] / last[0] == pytest.approx(np.exp(-0.05 / 5.0), rel=1e-12)
