"""Swings that die away for ever have the extremes of their first swings, or approach them without end."""

from math import cos, exp, sin, sqrt
from pathlib import Path

import numpy as np
import pytest
from paths import ROOT

import gqm_sym as gqm
from gqm_sym.building import transient
from gqm_sym.errors import SolutionError
from gqm_sym.loading import load
from gqm_sym.runtime.motion.parts.searched import samples

NAMES = ("v_max", "v_min", "normal_force_max", "normal_force_min")


@pytest.mark.parametrize(
    ("lam0", "v0"),
    [(1.0, 0.0), *(pytest.param(*launch, marks=pytest.mark.extended) for launch in [(0.3, 2.0), (0.0, 12.0)])],
)
def test_a_swing_that_dies_away_for_ever(lam0: float, v0: float) -> None:
    """Its extremes are those of its first swings, in sweeps too, which compiled code answers, and so are their
    derivatives; the largest speed from rest is that of the closed form.
    """
    module = load(str(ROOT / "generated" / "circle_drag.py"), "circle_drag")
    motion, whole = module.solve(lam0, v0), module.solve(lam0, v0, t_max=60)
    for name in NAMES:
        assert getattr(motion, name) == getattr(whole, name)
        swept = module.sweep(name, [lam0], v0)
        assert swept.values == pytest.approx([getattr(whole, name).value], rel=1e-15)
        assert swept.route_counts() == {"single": 1}
        assert motion.gradient(name) == pytest.approx(whole.gradient(name), rel=1e-13, abs=1e-14)
    if v0 == 0.0:  # V**2 = 2gL/(1 + k**2) (cos(u) + k*sin(u) - exp(k (u - 1)) (cos(1) + k*sin(1))) on the way down
        k, place = 0.2, motion.v_max.lam  # k = 2bL/m
        left = (cos(place) + k * sin(place) - exp(k * (place - 1)) * (cos(1) + k * sin(1))) / (1 + k**2)
        assert motion.v_max.value == pytest.approx(sqrt(2 * 9.81 * left), rel=1e-14)


def test_a_load_that_is_approached_without_end() -> None:
    """In a valley where a spring pushes the body outwards, the load falls towards that at rest for ever."""
    curve, field = gqm.Curve.graph("x**2/2", parameter="x"), gqm.Potential("z - 2*x**2/5")
    module = transient(gqm.derive(curve, field + gqm.QuadraticDrag(b="1/5")))
    motion = module.solve("1/2")
    assert motion.v_max == module.solve("1/2", t_max=30).v_max
    assert motion.normal_force_max.value > 1.0
    with pytest.raises(SolutionError, match=r"goes on for ever.*t_max"):
        _ = motion.normal_force_min
    assert np.isnan(module.sweep("normal_force_min", [0.5]).values).all()


def test_samples_are_apart() -> None:
    """A segment that begins or ends at a panel's edge to a rounding has one sample there."""

    class Panels:
        edges = np.array([0.0, 0.25, 0.75, 1.0])

    for low, high in ((np.nextafter(0.25, 0.0), 1.0), (0.1, np.nextafter(0.75, 1.0)), (0.25, 0.75)):
        phi = samples(Panels, np.empty(0), float(low), float(high))
        assert phi[0] == low
        assert phi[-1] == high
        assert np.diff(phi).min() > 1e-3


@pytest.mark.extended
def test_a_peak_just_behind_a_change_of_contact(tmp_path: Path) -> None:
    """The largest speed is found a few milliseconds after N changes its sign, at the end of a panel (it was missed by
    5e-5, because two samples were a rounding apart).
    """
    curve = gqm.Curve.graph("sqrt(1+x**2)-exp(-x**2)", parameter="x")
    force = gqm.Potential("4*x**2+exp(z)") + gqm.RotatingFrame() + gqm.QuadraticDrag()
    module = gqm.build(gqm.derive(curve, force), name="peak_behind_change", folder=tmp_path)
    for b in (0.99, 0.9999, 0.99999):
        motion = module.solve(0.8764613586840031, 0, -1, t_max=4, Omega=0.3, b=b)
        speeds = np.abs(motion.state(np.linspace(0.59, 0.62, 3001)).v)
        assert motion.v_max.value == pytest.approx(speeds.max(), rel=1e-8)
        assert motion.v_max.value >= speeds.max() * (1 - 1e-14)
