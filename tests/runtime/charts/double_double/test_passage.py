"""Half periods along charts in double-double arithmetic agree with closed forms, formulas, and extended precision."""

from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp, mpf
from selection import examples

import gqm_sym as gqm
from gqm_sym.runtime.charts.double_double.passage import ChartPassage
from gqm_sym.runtime.double_double.orbit_time import BoundedNumber
from gqm_sym.runtime.launch.formulas import _chart_with
from gqm_sym.runtime.motion import timing

G = "9.81"
DIGITS = 50

# A double-double number has some 31 digits, and a sum over many pieces has fewer.
USEFUL_ERROR = 1e-23


def passage(motion: Any) -> ChartPassage:
    """Return the orbit of a motion along a chart, found in double-double arithmetic."""
    found = timing.passage_of(motion.problem, motion.kind, motion.direction, motion._offsets)
    assert found is not None
    return found


def holds(motion: Any, truth: mpf) -> None:
    """Return whether the duration is within its bound, and rounded correctly."""
    orbit = passage(motion).orbit
    assert orbit is not None
    duration = orbit.duration
    assert abs(mpf(duration.high) + mpf(duration.low) - truth) <= duration.error <= USEFUL_ERROR * truth
    assert duration.is_decided
    assert duration.high == float(truth)


@pytest.fixture(scope="module")
def module_for(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., ModuleType]:
    """Return a function that makes a module for motion under gravity along a curve."""
    folder: Path = tmp_path_factory.mktemp("passage")
    made: dict[str, ModuleType] = {}

    def module(curve: gqm.Curve, name: str) -> ModuleType:
        if name not in made:
            made[name] = gqm.build(gqm.derive(curve, gqm.Gravity()), name=name, folder=folder)
        return made[name]

    return module


@pytest.fixture(scope="module")
def ring(module_for: Callable[..., ModuleType]) -> ModuleType:
    """Return a pendulum's circle as x**2 + z**2 = 1, with arc length from its lowest point."""
    return module_for(gqm.Curve.implicit("x**2 + z**2 - 1", start=(0, "-1"), tangent=-1), "true_ring")


def pendulum(angle: Any, speed: Any) -> mpf:
    """Return the half period, or the time of a round, of a pendulum of length 1 by Legendre's integral."""
    g = mpf(G)
    k2 = (mpf(speed) ** 2 + 4 * g * mp.sin(mpf(angle) / 2) ** 2) / (4 * g)
    return 2 * mp.ellipk(k2) / mp.sqrt(g) if k2 < 1 else 2 * mp.ellipk(1 / k2) / mp.sqrt(g * k2)


@given(
    angle=st.floats(1e-3, 3.1), speed=st.one_of(st.just(0.0), st.floats(1e-3, 9.0)), direction=st.sampled_from([1, -1])
)
@examples(60)
def test_an_implicit_circle(angle: float, speed: float, direction: int, ring: ModuleType) -> None:
    """Swings and rounds on x**2 + z**2 = 1 are those of a pendulum, wherever turning points lie on the pieces."""
    with mp.workdps(DIGITS):
        motion = ring.solve(lam0=angle, v0=speed, direction=direction)
        truth = pendulum(angle, speed)
        if abs(truth - 4) < 2:  # not next to the separatrix
            holds(motion, truth)


def test_a_launch_by_coordinates(ring: ModuleType) -> None:
    """A launch by a point of the circle is that by its angle; turning points are arc lengths."""
    with mp.workdps(DIGITS):
        motion = ring.solve(point=("3/5", "-4/5"), v0="1/2")
        angle = mp.asin(mpf(3) / 5)
        holds(motion, pendulum(angle, mpf(1) / 2))
        orbit = passage(motion).orbit
        assert orbit is not None
        top = 2 * mp.asin(mp.sqrt(mp.sin(angle / 2) ** 2 + mpf(1) / 16 / mpf(G)))
        for bounded, truth in ((orbit.low, -top), (orbit.high, top)):
            assert isinstance(bounded, BoundedNumber)
            assert abs(mpf(bounded.high) + mpf(bounded.low) - truth) <= bounded.error <= 1e-26
        assert motion.turning_points == (float(top), float(-top))


def test_times_on_the_way(ring: ModuleType) -> None:
    """The times from the lower turning point to any phase angle, and to the launch, agree with elliptic integrals."""
    with mp.workdps(DIGITS):
        motion = ring.solve(lam0=0.25, v0=2.0)
        found = passage(motion)
        k = mp.sqrt((mpf(4) + 4 * mpf(G) * mp.sin(mpf(1) / 8) ** 2) / (4 * mpf(G)))
        top = 2 * mp.asin(k)

        def time_to(place: mpf) -> mpf:
            return (mp.ellipk(k**2) + mp.ellipf(mp.asin(mp.sin(place / 2) / k), k**2)) / mp.sqrt(mpf(G))

        phases = np.array([0.3, 1.0, 2.0, 3.0])
        times = found.times_at(phases, is_thrown=True)
        assert times is not None
        places = [-top + 2 * top * mp.sin(mpf(phi) / 2) ** 2 for phi in phases.tolist()]
        for row, place in zip(times.tolist(), [*places, mpf(0.25)], strict=True):
            assert abs(mpf(row[0]) + mpf(row[1]) - time_to(place)) <= 1e-26


@pytest.mark.extended
@given(height=st.floats(0.01, 1.4), side=st.sampled_from([-1, 1]))
@examples(40)
def test_two_planes(height: float, side: int, module_for: Callable[..., ModuleType]) -> None:
    """Between two planes the times are those of constant acceleration, from any height, to and over a corner."""
    module = module_for(gqm.Curve.sampled([("-3", "1.5"), ("0", "0"), ("1", "1.5")], kind="linear"), "true_planes")
    with mp.workdps(DIGITS):
        left, right = mp.sqrt(9 + mpf(9) / 4), mp.sqrt(1 + mpf(9) / 4)
        shares = left / mpf("1.5"), right / mpf("1.5")
        lam0 = float(left + (right if side > 0 else -left) / mpf("1.5") * mpf(height))
        motion = module.solve(lam0=lam0)
        assert motion.kind == "libration"
        top = abs(mpf(lam0) - left) / shares[side > 0]
        holds(motion, sum(share * mp.sqrt(2 * top / mpf(G)) for share in shares))


@given(angle=st.floats(1e-2, 1.4))
@examples(25)
def test_an_arc_between_lines(angle: float, module_for: Callable[..., ModuleType]) -> None:
    """On an arc of a rail a body swings as a pendulum; the line beside it adds the time that the closed form gives."""
    rail = [gqm.line(length=2), gqm.arc(radius=1, angle="pi"), gqm.line(length=2)]
    module = module_for(gqm.Curve.piecewise(rail, start=(-1, 2), heading="-pi/2"), "true_rail")
    with mp.workdps(DIGITS):
        g, lam0 = mpf(G), float(2 + mp.pi / 2 - mpf(angle))
        holds(module.solve(lam0=lam0), pendulum(2 + mp.pi / 2 - mpf(lam0), 0))
        height = mpf(angle)  # above the ends of the arc
        on_line = module.solve(lam0=float(2 - height))
        w = 2 * g * (2 - mpf(float(2 - height)))
        k2 = (w + 2 * g) / (4 * g)
        swing = 2 * mp.ellipf(mp.pi / 4, 1 / k2) / mp.sqrt(g * k2)
        holds(on_line, swing + 2 * mp.sqrt(w) / g)


@pytest.mark.extended
@pytest.mark.parametrize("launch", [{"lam0": 3.3}, {"lam0": 4.05}, {"lam0": 2.2, "v0": 2.5}])
def test_a_spline(launch: dict[str, float], module_for: Callable[..., ModuleType]) -> None:
    """Extended precision, which knows the spline by other formulas and integrates it by other rules, agrees."""
    x = np.linspace(-2, 2, 81)
    points = np.column_stack([x, 0.5 * x * x + 0.05 * np.cos(3 * x)])
    motion = module_for(gqm.Curve.sampled(points), "true_spline").solve(**launch)
    exact = timing.in_multiprecision(motion.problem, motion.kind, motion.direction, motion._segment)
    found = timing.in_double_double(motion.problem, motion.kind, motion.direction, motion._segment, motion._offsets)
    assert found is not None
    for one, other in ((found.duration, exact.duration), (found.phase_time, exact.phase_time)):
        assert abs((one[0] - other[0]) + (one[1] - other[1])) <= 1e-24
    assert found.offsets == pytest.approx(exact.offsets, rel=1e-14)
    assert found.edge_times is not None
    assert exact.edge_times is not None
    # The edges of panels are doubles, so that places differ by the chart's rounding.
    assert np.abs(found.edge_times[0] - exact.edge_times[0]).max() <= 1e-15


@pytest.mark.extended
def test_a_curve_of_many_pieces(module_for: Callable[..., ModuleType]) -> None:
    """A passage over more pieces than mpmath would integrate has the half period of the same curve as a graph."""
    text = "x**2/200 + sin(9*x)/90"
    graph = module_for(gqm.Curve.graph(text, parameter="x"), "true_waves")
    implicit = module_for(gqm.Curve.implicit(f"z - ({text})", start=(0, 0)), "true_waves_implicit")
    motion = implicit.solve(point=("24", "2.88 + sin(216)/90"))
    assert not motion._has_multiprecision
    assert motion.half_period == graph.solve(lam0=24).half_period
    late = 1e7 * motion.period
    assert motion.lam(late) == pytest.approx(motion.lam(0.0), rel=1e-13)


def test_a_shape_with_a_cosine_of_a_parameter(module_for: Callable[..., ModuleType]) -> None:
    """The values that compiled functions read after the parameters shape the curve too."""
    curve = gqm.Curve.implicit("x**2 + z**2 - 4*cos(alpha)**2", start=(0, "-2*cos(alpha)"), tangent=-1)
    module = module_for(curve, "true_cosine")
    with mp.workdps(DIGITS):
        for angle, length in (("pi/3", mpf(1)), ("pi/4", mp.sqrt(2)), ("pi/3", mpf(1))):
            k = mp.sin(mpf("0.75") / (2 * length))
            holds(module.solve(lam0=0.75, alpha=angle), 2 * mp.ellipk(k**2) * mp.sqrt(length / mpf(G)))


@pytest.mark.extended
def test_other_parameters_share_a_chart(module_for: Callable[..., ModuleType]) -> None:
    """Launches that differ in mass or gravity only are swept along one chart, and get what each gets alone."""
    curve = gqm.Curve.implicit("x**2 + z**2 - R**2", start=(0, "-R"), parameters={"R": 1}, tangent=-1)
    module, before = module_for(curve, "true_shared"), _chart_with.cache_info().misses
    lam0, g, m = np.linspace(0.3, 2.5, 40), np.linspace(1.6, 24.8, 40), np.linspace(0.5, 2.0, 40)
    swept = module.sweep("half_period", lam0, g=g, m=m)
    assert _chart_with.cache_info().misses == before + 1
    assert swept.route_counts() == {"single": 40}
    alone = [module.solve(*launch[:1], g=launch[1], m=launch[2]).half_period for launch in zip(lam0, g, m, strict=True)]
    assert (np.abs(swept.values - alone) <= 2.0 * 2.0**-52 * np.array(alone)).all()
    assert _chart_with.cache_info().misses == before + 1
    # Two shapes have two charts.
    half = module.sweep("half_period", np.repeat([0.5, 1.0], 20), g=g, R=np.repeat([0.5, 1.0], 20)).values
    assert half[:20] * np.sqrt(g[:20]) == pytest.approx(half[0] * np.sqrt(g[0]), rel=2e-15)
    assert half[20:] * np.sqrt(g[20:]) == pytest.approx(half[0] * np.sqrt(2 * g[0]), rel=2e-15)
    assert _chart_with.cache_info().misses == before + 2


@pytest.mark.extended
@pytest.mark.filterwarnings("ignore::gqm_sym.errors.NoisyPointsWarning")
@pytest.mark.parametrize("launch", [{"lam0": 2.0}, {"lam0": 5.0, "v0": 1.0}])
def test_the_bound_along_a_track_of_scattered_points(
    launch: dict[str, float], module_for: Callable[..., ModuleType]
) -> None:
    """Roundings on many pieces add up to a few units of the thirtieth digit; the bound was 1e7 times as large."""
    x = np.linspace(0.0, 10.0, 60)
    z = 0.04 * (x - 5.0) ** 2 + 1e-2 * np.sin(1e4 * x)
    motion = module_for(gqm.Curve.sampled(x, z), "scattered").solve(**launch)
    duration = passage(motion).orbit.duration
    with mp.workdps(40):
        truth = mpf(motion.period_to(36)) / 2
        assert abs(mpf(duration.high) + mpf(duration.low) - truth) <= duration.error <= 1e-24 * truth


@pytest.mark.extended
@pytest.mark.parametrize("g", [0.4, 1.62, 9.81])
def test_swings_too_small_for_doubles_along_a_chart(g: float, ring: ModuleType) -> None:
    """In doubles the bottom has an error of 1e-16, which the bound did not include if no extended precision was
    requested.
    """
    for lam0 in np.geomspace(1e-8, 1e-6, 41).tolist():
        motion = ring.solve(lam0, g=g)
        state = motion.state(1.0)
        with mp.workdps(40):
            # The reference is right to the third order in the amplitude.
            size, omega = mpf(lam0), mp.sqrt(mpf(g))
            place = size * mp.cos(omega * (1 - size**2 / 16)) + size**3 / 192 * (mp.cos(omega) - mp.cos(3 * omega))
            assert abs(state.lam - place) <= state.error + size**5
        assert state.error <= 1e-13 * lam0
