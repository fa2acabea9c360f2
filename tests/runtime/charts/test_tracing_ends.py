"""The tracer begins, ends and breaks at the right places: at starts, domains and corners, and at its limits."""

import math

import numpy as np
import pytest
from mpmath import mp
from naive import error, ulps
from traced import BEND, ROOT, ROUNDING, SQUARE, WALLS, WAVE, other, trace

from gqm_sym.errors import LaunchError, SolutionError
from gqm_sym.runtime.charts.continuation import MAX_PIECES


@pytest.mark.parametrize("domain", [(0, 2 * math.pi), (-1, 7), (0, None), (None, 7)])
def test_domain_longer_than_the_loop(domain: tuple[float | None, float | None]) -> None:
    """A closed curve whose domain holds it is closed."""
    assert ulps(trace("x**2 + z**2 - 1", (1.0, 0.0), domain=domain).period, 2 * mp.pi) <= 1.0


def test_domain_shorter_than_the_loop() -> None:
    """A part of a closed curve is open; one end may be the start."""
    chart = trace("x**2 + z**2 - 1", (1.0, 0.0), domain=(-2.0, 0.0))
    assert (chart.low, chart.high, chart.period) == (-2.0, 0.0, 0.0)
    assert np.abs(chart.points([-2.0])[:2, 0] - [np.cos(2.0), -np.sin(2.0)]).max() <= ROUNDING


def test_near_start_is_moved_onto_the_curve() -> None:
    """A start near the curve is moved to the foot of the perpendicular, which becomes s = 0."""
    chart = trace("x**2 + z**2 - 1", (0.6 + 1e-8, 0.8 + 1e-8))
    x, z = chart.points([0.0])[:2, 0]
    size = math.hypot(0.6 + 1e-8, 0.8 + 1e-8)
    assert abs(x - (0.6 + 1e-8) / size) <= ROUNDING
    assert abs(z - (0.8 + 1e-8) / size) <= ROUNDING


@pytest.mark.parametrize(
    ("text", "start", "message"),
    [
        ("x**2 + z**2 - 1", (0.3, 0.4), r"start: \(0\.3, 0\.4\) is not on the curve: it is 0\.5 from it; .*\(0\.6"),
        ("x**2 + z**2 + 1", (1.0, 0.0), "not on the curve, and no point of the curve was found near it"),
        ("x**2 - z**2", (0.0, 0.0), r"start: \(0\.0, 0\.0\) is a singular point: grad F vanishes there"),
        ("(x**2 + z**2 - 1)**2", (1.0, 0.0), "is a singular point"),
        ("x**2 + z**2 - 1", (math.nan, 0.0), "not a finite point"),
    ],
    ids=["off the curve", "no curve", "node", "square", "nan"],
)
def test_bad_start(text: str, start: tuple[float, float], message: str) -> None:
    """A bad start point is refused, and the message says how far off it is and where the curve is."""
    with pytest.raises(LaunchError, match=message):
        trace(text, start)


def test_domain_without_the_start() -> None:
    """Arc length is counted from the start point."""
    with pytest.raises(LaunchError, match=r"domain: must contain 0, where the start point is; got \[1\.0, 2\.0\]"):
        trace("x**2 + z**2 - 1", (1.0, 0.0), domain=(1.0, 2.0))


def test_corners() -> None:
    """|x| + |z| = 1 has four corners, each right to rounding, and the right perimeter."""
    chart = other(SQUARE, (0.3, 0.7))
    side = math.sqrt(2.0)
    first = 0.3 * side
    assert np.abs(chart.corners - (first + side * np.arange(-2, 2))).max() <= 1e-14
    assert np.array_equal(chart.breaks, chart.corners)
    assert abs(chart.period - 4.0 * side) <= 1e-14
    rows = chart.points(first + side * (np.arange(4) + 0.5))
    assert np.abs(np.abs(rows[:2]) - 0.5).max() <= 1e-14


@pytest.mark.parametrize("start", [-0.7, -0.703, -0.7111, -1.0])
def test_break(start: float) -> None:
    """On z = x|x| the curvature jumps at the origin, and only there."""
    chart = other(BEND, (start, -(start**2)), (-2.0 if start > -1.0 else -4.0, 1.0))
    where = -(math.asinh(-2 * start) / 4 - start * math.sqrt(1 + 4 * start**2) / 2)
    assert np.abs(chart.breaks - where).max() <= 1e-14
    assert chart.breaks.size == 1
    assert chart.corners.size == 0
    kappa = chart.points([where - 1e-6, where + 1e-6])[3]
    assert np.abs(np.abs(kappa) - 2.0).max() <= 1e-10
    assert kappa[0] * kappa[1] < 0.0


def test_end_of_what_is_real() -> None:
    """The root z = sqrt(x) ends at the origin."""
    chart = other(ROOT, (1.0, 1.0), (None, 5.0))
    assert chart.ends == ("domain-end", "domain-end")
    assert error(chart.high, mp.asinh(2) / 4 + mp.sqrt(5) / 2) <= 1e-14
    assert np.abs(chart.points([chart.high])[:2]).max() <= 1e-7


def test_budget() -> None:
    """A domain that takes too many pieces is refused; a wave without one is followed as far as they reach."""
    with pytest.raises(SolutionError, match=f"the end of its domain: {MAX_PIECES} pieces reach s = -"):
        other(WAVE, (0.0, 0.0), (-1e6, 0.0))
    chart = other(WAVE, (0.0, 0.0))
    assert chart.edges.size == 2 * MAX_PIECES + 1
    x, z, _, _ = chart.points(np.linspace(chart.low, chart.high, 999))
    assert np.abs(z - np.sin(x)).max() <= 2e-13


def test_between_walls_that_grow_exponentially() -> None:
    """On exp(z) = cosh(x) curvature falls as the gradient of F grows; the curve is smooth up to where F overflows.

    Its pieces were too long, 1e-5 beside the curve and with corners between them, and 2000 pieces of the length of
    roundings lay beside the end.
    """
    chart = other(WALLS, (0.0, 0.0))
    assert chart.breaks.size == 0
    assert chart.ends == ("domain-end", "domain-end")
    x, z = chart.points(np.linspace(-700.0, 700.0, 500))[:2]
    on_curve = np.abs(x) + np.log1p(np.exp(-2.0 * np.abs(x))) - math.log(2.0)
    assert np.abs(z - on_curve).max() <= ROUNDING * 700.0
    assert 709.0 < -chart.points([chart.high])[0, 0] < 711.0
