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
from gqm_sym.runtime.legs.runs.whole_tables import grade_of

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
    assert all(grade_of(int(run.record[WHOLE])) == 1 for run in motion._driver.runs.all())
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


# A pendulum of length 1 whose resistance is k times a power of V**2: the first three turns from an angle and their
# times, the largest speed and contact force per mass, and the times at half the angle and at -0.7 of it. Found in 40
# digits by collocation in a variable u with ``dy/du = 140 u**3 (1 - u)**3``.
POWERS = {
    ("3/4", 0.1, 1.0): (
        ("-0.91690632110426504142", "0.84471788972637116645", "-0.781401588417958959"),
        ("1.0645943571793896953", "2.1191776169625434639", "3.1658459663468902448"),
        ("2.8865229264125563962", "18.133840226262923081", "0.3624343649562476231", "0.82586814116953464845"),
    ),
    ("3/2", 0.1, 1.0): (
        ("-0.75389394205087813852", "0.63135273351692911713", "-0.5543367386093445098"),
        ("1.0643840093097013434", "2.1024997931548862964", "3.1302275407821173128"),
        ("2.6316896150372291217", "16.62284980444196253", "0.36506560814749188458", "0.93712449905495304922"),
    ),
    ("5/4", 0.02, 0.7): (
        ("-0.682073942822295026", "0.66527152106237333705", "-0.64948281937582163573"),
        ("1.0338946563692184772", "2.0662144303471477162", "3.0970967670507922818"),
        ("2.121436064938866509", "14.309906971425108081", "0.34685316725346264711", "0.77945949041226821489"),
    ),
}


@pytest.mark.parametrize(("power", "k", "start"), POWERS)
def test_roots_of_v2(power: str, k: float, start: float, build: Build) -> None:
    """Turns, times and extremes by laws with other roots of V**2 are right to a few units in the last place."""
    module = build(
        "power_" + power.replace("/", "_"), gqm.families.circle(L=1), gqm.Kernel.law(f"-direction*k*W**({power})")
    )
    turns, times, (fastest, heaviest, *passages) = POWERS[power, k, start]
    legs = module.solve(start, t_max=4.0, k=k).legs[:3]
    assert [leg.lam_end for leg in legs] == pytest.approx([float(turn) for turn in turns], abs=1e-15)
    assert [leg.t_end for leg in legs] == pytest.approx([float(t) for t in times], rel=1e-15)
    swept = {q: module.sweep(q, [start], t_max=4.0, k=k).values[0] for q in ("v_max", "normal_force_max")}
    assert swept == pytest.approx({"v_max": float(fastest), "normal_force_max": float(heaviest)}, rel=1e-15)
    places = [0.5 * start, -0.7 * start]
    found = module.sweep("time_at", [start, start], lam=places, k=k).values
    assert found == pytest.approx([float(t) for t in passages], rel=2e-15)


def test_the_largest_force_of_a_law_with_fourth_roots(build: Build) -> None:
    """On an ellipse the contact force needs more nodes than the motion; its extreme, found as above in 40 digits, is
    right to the last place.
    """
    ellipse = gqm.Curve.parametric(x="2*cos(u)", z="sin(u)", parameter="u", period="2*pi")
    module = build("power_on_an_ellipse", ellipse, gqm.Kernel.law("-direction*k*W**(3/4)"))
    found = module.sweep("normal_force_max", [-0.9], t_max=4.0, k=0.1)
    assert found.values == pytest.approx([10.750304633696166883], rel=5e-16)
