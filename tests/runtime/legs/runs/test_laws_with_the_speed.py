"""Legs by laws that contain the speed itself, as one polynomial in the phase angle, agree with closed forms with 30
digits, and with Taylor series.
"""

from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym.runtime.legs.leg_record import WHOLE
from gqm_sym.runtime.legs.runs.whole_tables import IN_PHASE

Build = Callable[..., ModuleType]


class Tautochrone:
    """A bead on a cycloid with linear drag: in arc length it is a damped oscillator."""

    def __init__(self, start: float, c: float) -> None:
        self.decay = mpf(c) / 2
        self.omega = mp.sqrt(mpf("9.81") / 4 - self.decay**2)
        self.arc = -4 * mp.cos(mpf(start) / 2)

    def arc_at(self, t: mpf) -> mpf:
        """Return the arc length from the bottom at a time."""
        phase = self.omega * t
        return self.arc * mp.exp(-self.decay * t) * (mp.cos(phase) + self.decay / self.omega * mp.sin(phase))

    def place(self, t: mpf) -> mpf:
        """Return the angle of the wheel."""
        return 2 * mp.acos(-self.arc_at(t) / 4)

    def speed(self, t: mpf) -> mpf:
        """Return the speed."""
        return abs(mp.diff(self.arc_at, t))

    def load(self, t: mpf) -> mpf:
        """Return the contact force per mass."""
        upright = mp.sqrt(1 - (self.arc_at(t) / 4) ** 2)
        return mpf("9.81") * upright + self.speed(t) ** 2 / (4 * upright)

    def largest(self, function: Any) -> float:
        """Return the largest value of a function of time on the first leg."""
        times = [mp.pi / self.omega * k / 32 for k in range(1, 32)]
        near = max(times, key=function)
        return float(function(mp.findroot(lambda t: mp.diff(function, t), near)))


@pytest.mark.parametrize(
    ("start", "c"),
    [
        (2.9, 0.05),
        *(pytest.param(*case, marks=pytest.mark.extended) for case in [(1.0, 0.3), (5.6, 0.02), (0.6, 0.3)]),
    ],
)
def test_a_tautochrone_with_linear_drag(start: float, c: float, build: Build) -> None:
    """Turns, places, times and extremes are right to a few units in the last place, by one polynomial for each leg."""
    module = build("viscous_tautochrone", gqm.families.cycloid(R=1, inverted=True), gqm.LinearDrag())
    motion = module.solve(start, t_max=9.0, c=c)
    assert len(motion.legs) >= 4
    assert all(run.record[WHOLE] > IN_PHASE for run in motion._driver.runs.all())
    with mp.workdps(30):
        bead = Tautochrone(start, c)
        half = mp.pi / bead.omega
        turns = [float(bead.place(half * k)) for k in range(1, len(motion.legs))]
        when = np.linspace(0.05, 8.95, 40)
        there = [float(bead.place(mpf(t))) for t in when]
        expected = {
            "v_max": bead.largest(bead.speed),
            "normal_force_max": bead.largest(bead.load),
        }
        passed = mpf(0.3) * half
        place = float(bead.place(passed))
    assert [leg.lam_end for leg in motion.legs[:-1]] == pytest.approx(turns, abs=2e-15)
    assert [leg.t_end for leg in motion.legs[:-1]] == pytest.approx(
        [float(half * k) for k in range(1, len(motion.legs))], rel=2e-15
    )
    assert motion.lam(when) == pytest.approx(there, abs=4e-15)
    assert (np.abs(motion.lam(when) - there) <= motion.error_bound(when)).all()
    for quantity, value in expected.items():
        assert module.sweep(quantity, [start], t_max=9.0, c=c).values[0] == pytest.approx(value, rel=2e-15)
    assert module.sweep("time_at", [start], lam=place, c=c).values[0] == pytest.approx(float(passed), rel=4e-15)
