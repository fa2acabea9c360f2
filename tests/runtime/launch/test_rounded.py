"""Curves that are not smooth are known in doubles only, and decisions next to an equilibrium are right to rounding."""

from math import asinh, sqrt
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import gqm_sym as gqm

# The curve is z = -3 x**2/4 right of the hilltop and -x**2/4 left of it, so that the curvature jumps at the
# equilibrium; the launch is at 0.8.
X0, Z0, G = 0.8, -0.48, 9.81
# The accuracy of a place and a time near the top that the rounding of the speed allows.
PLACE = 2e-8


@pytest.fixture(scope="module")
def hill(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """Return the hill with a break, under gravity."""
    track = gqm.Curve.implicit("z + x**2/2 + x*abs(x)/4", start=("4/5", "-12/25"))
    return gqm.build(gqm.derive(track, gqm.Gravity()), name="broken_hill", folder=tmp_path_factory.mktemp("broken"))


def way(x: float) -> float:
    """Return the arc length from x to the top of a parabola, in closed form."""
    u = 1.5 * x
    return (u * sqrt(1 + u * u) + asinh(u)) / 3.0


def time_to(x: float) -> float:
    """Return the time from 0.8 to x with V**2 = 3 g x**2/2, in closed form."""
    one, two = (sqrt(1 + u * u) - asinh(1 / u) for u in (1.5 * X0, 1.5 * x))
    return (one - two) / sqrt(1.5 * G)


@pytest.mark.extended
@pytest.mark.parametrize("off", [0.0, 1e-15, -1e-15])
def test_the_speed_that_just_reaches_the_top(hill: ModuleType, off: float) -> None:
    """With the speed that just reaches the top, the body comes as near as doubles can resolve, after any time."""
    motion = hill.solve(0, sqrt(-2 * G * Z0) * (1 + off))
    assert motion.kind == "asymptotic"
    assert motion.t_end == np.inf
    for t in (0.5, 1.0, 2.0, 3.0):
        assert time_to(motion.state(t).x) == pytest.approx(t, rel=PLACE)
    with pytest.raises(gqm.GQMError, match="closer to the equilibrium"):
        motion.lam(1e3)


@pytest.mark.parametrize("short", [1e-4, 1e-6, 1e-9, 1e-12])
def test_a_little_slower_it_turns(hill: ModuleType, short: float) -> None:
    """A slightly slower body turns at the height of its energy, V0**2 = 2 g (z - z0) on the parabola."""
    motion = hill.solve(0, sqrt(-2 * G * Z0) * (1 - short))
    assert motion.kind == "transit"
    x = sqrt(-Z0 * short * (2 - short) / 0.75)
    (turn,) = motion.turning_points
    assert turn == pytest.approx(way(X0) - way(x), rel=1e-12, abs=1e-14 / sqrt(short))


@pytest.mark.parametrize("more", [1e-4, 1e-6, 1e-9])
def test_a_little_faster_it_passes(hill: ModuleType, more: float) -> None:
    """A slightly faster body passes the top and goes down the other side."""
    motion = hill.solve(0, sqrt(-2 * G * Z0) * (1 + more))
    assert motion.kind == "transit"
    assert motion.turning_points == ()
    over = motion.time_at(2 * way(X0))
    assert motion.state(over).x < 0.0
    assert motion.state(over).v ** 2 == pytest.approx(
        -2 * G * (motion.state(over).z + Z0 * more * (2 + more)), rel=1e-9
    )


def test_released_on_top_it_rests(hill: ModuleType) -> None:
    """A body released on top stays if it is level to rounding there; beside the top it falls to its own side."""
    assert hill.solve(way(X0)).kind == "rest"
    for side in (1, -1):
        motion = hill.solve(way(X0) - side * 1e-3)
        assert motion.kind == "transit"
        assert side * motion.state(0.3).x > 1e-3


@pytest.mark.parametrize("power", [-100, -10, 0, 10, 100])
def test_released_on_top_in_any_units(power: int, hill: ModuleType) -> None:
    """Whether a body stays on the top does not depend on the unit of time. A slope of 1e-14 m/s**2 counted as none, so
    that bodies moved away from the top or stayed beside it.
    """
    motions = [hill.solve(way(X0) - aside, g=G * 2.0**power) for aside in (0.0, 1e-13, -1e-13)]
    assert [(motion.kind, motion.direction) for motion in motions] == [("rest", 1), ("transit", -1), ("transit", 1)]


@pytest.mark.parametrize("size", [1.0, 1e-8, 1e8])
def test_a_break_is_seen_at_any_size(size: float, tmp_path: Path) -> None:
    """The curvature jumps once, at the top, whatever the size of the hill."""
    start = tuple(f"{c}*{size:.0e}" for c in ("4/5", "-12/25"))
    track = gqm.Curve.implicit(f"z + (x**2/2 + x*abs(x)/4)/{size:.0e}", start=start)
    module = gqm.build(gqm.derive(track, gqm.Gravity()), name="hill_of_a_size", folder=tmp_path)
    chart = module.CHART.chart((G, 1.0))
    assert chart.corners.size == 0
    assert chart.breaks / size == pytest.approx([way(X0)], rel=1e-9)
