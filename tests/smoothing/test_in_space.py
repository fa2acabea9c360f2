"""Smooth tracks through surveyed points in space lie within the stated errors of the curve that the points scatter
about.
"""

import warnings

import numpy as np
import pytest
import sympy as sp

import gqm_sym as gqm
from gqm_sym.errors import NoisyPointsWarning
from gqm_sym.runtime.charts.chart import SpaceChart
from gqm_sym.runtime.charts.sampled import Sampled

# The track is closed, some 150 m long, and has formulas that give tangent and curvature.
U = sp.Symbol("u", real=True)
KNOT = ((20 + 5 * sp.cos(3 * U)) * sp.cos(U), (20 + 5 * sp.cos(3 * U)) * sp.sin(U), 5 * sp.sin(3 * U) + 10 * sp.sin(U))
at, slope_at, bend_at = (
    sp.lambdify(U, [sp.diff(form, U, order) if order else form for form in KNOT]) for order in range(3)
)
COUNT = 400
FINE = np.linspace(0.0, 2.0 * np.pi, 200_001)
PLACES = np.stack(at(FINE), axis=1)
LENGTHS = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(PLACES, axis=0), axis=1))])


def roll(u: np.ndarray) -> np.ndarray:
    """Return a roll angle that grows by one turn in each lap."""
    return u + 0.5 * np.sin(u)


def surveyed(scatter: float, seed: int, stop: float) -> tuple[np.ndarray, np.ndarray]:
    """Return points at equal distances, each off by normal deviates in all coordinates, and the roll angles there."""
    closed = bool(stop == FINE[-1])
    wanted = np.linspace(0.0, np.interp(stop, FINE, LENGTHS), COUNT + closed)[:COUNT]
    u = np.interp(wanted, LENGTHS, FINE)
    noise = scatter * np.random.default_rng(seed).standard_normal((COUNT, 3))
    return np.stack(at(u), axis=1) + noise, roll(u)


def rows_of(curve: gqm.Curve, s: np.ndarray) -> np.ndarray:
    """Return x, y, z and roll at arc lengths with two derivatives, as (3, n, 4)."""
    track = curve.definition
    chart = Sampled(track.points, closed=track.closed, in_space=True, banked=True).chart(())
    assert isinstance(chart, SpaceChart)
    return np.stack([chart.derivatives(s, order).T for order in range(3)])


def parameter_near(places: np.ndarray) -> np.ndarray:
    """Return the parameter of the place on the knot that is nearest to each of some places, by Newton's method."""
    u = FINE[np.argmin(((places[:, None] - PLACES[::500]) ** 2).sum(axis=2), axis=1) * 500]
    for _ in range(6):
        off, first, second = (np.stack(f(u), axis=1) for f in (at, slope_at, bend_at))
        off = places - off
        u = u + (off * first).sum(axis=1) / (first**2 - off * second).sum(axis=1)
    return u


def test_points_that_scatter_are_noticed() -> None:
    """There is a warning for points that scatter by a centimetre, and for too small a deviation, and none without
    scatter or after smoothing.
    """
    scattered, _ = surveyed(0.01, 1, FINE[-1])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for scatter, stop in ((0.0, FINE[-1]), (1e-7, FINE[-1]), (0.0, 4.5), (1e-7, 4.5)):
            gqm.Curve.sampled(surveyed(scatter, 1, stop)[0])
        gqm.Curve.sampled(scattered, smoothing=0.01, closed=True)
    for points, closed in ((scattered, True), (surveyed(0.01, 1, 4.5)[0], False)):
        with pytest.warns(
            NoisyPointsWarning, match=r"^sampled: the curvature goes up and down .* smoothing, or 'auto'$"
        ):
            gqm.Curve.sampled(points, closed=closed)
    with pytest.warns(NoisyPointsWarning, match=r"smoothing 0\.001 is less than their scatter$"):
        gqm.Curve.sampled(scattered, smoothing=0.001, closed=True)


@pytest.mark.sample(1)
@pytest.mark.parametrize("scatter", [0.001, 0.01, 0.1])
@pytest.mark.parametrize(("stop", "known"), [(FINE[-1], True), (4.5, False)], ids=["closed-known", "open-auto"])
def test_loads_are_within_their_error(scatter: float, stop: float, known: bool) -> None:
    """One standard error holds at two of three places or more, and two at 19 of 20, and the errors are not too
    large.
    """
    ratios = []
    for seed in range(2):
        points, angles = surveyed(scatter, seed, stop)
        smoothing = scatter if known else "auto"
        curve = gqm.Curve.sampled(points, smoothing=smoothing, closed=bool(stop == FINE[-1]), roll=angles)
        report = curve.smoothing
        assert abs(report.standard_deviation / scatter - 1.0) < 0.1
        # Of three directions two are across the track.
        assert 1.0 < report.rms / scatter < np.sqrt(2.0)
        place, tangent, bend = rows_of(curve, report.s)
        u = parameter_near(place[:, :3])
        first, second = (np.stack(f(u), axis=1) for f in (slope_at, bend_at))
        square = (first**2).sum(axis=1, keepdims=True)
        true = (second - first * (first * second).sum(axis=1, keepdims=True) / square) / square
        aside = np.cross(tangent[:, :3], [0.0, 0.0, 1.0])
        aside /= np.linalg.norm(aside, axis=1, keepdims=True)
        for axis in (aside, np.cross(tangent[:, :3], aside)):
            ratios.append(((bend[:, :3] - true) * axis).sum(axis=1) / report.curvature_error)
        off = np.abs(np.remainder(place[:, 3] - roll(u) + np.pi, 2.0 * np.pi) - np.pi)
        assert off.max() < 0.1 * scatter + 1e-4  # the roll is smoothed like the coordinates
    size = np.abs(np.concatenate(ratios))
    assert np.mean(size < 1.0) > 0.68
    assert np.mean(size < 2.0) > 0.95
    assert 0.2 < np.sqrt(np.mean(size**2)) < 1.0


@pytest.mark.extended
def test_exact_points_stay() -> None:
    """Points without scatter are on the smooth track, and the track is rotated when they are."""
    points, _ = surveyed(0.0, 0, 4.5)
    track = gqm.Curve.sampled(points, smoothing="auto").smoothing
    assert track.largest_shift < 1e-5
    flat = np.column_stack([points[:, 0], np.zeros(COUNT), points[:, 2]])
    cosine, sine = 0.6, 0.8
    turned = np.column_stack([cosine * flat[:, 0], sine * flat[:, 0], flat[:, 2]])
    one, two = (gqm.Curve.sampled(given, smoothing=0.01).smoothing for given in (flat, turned))
    assert two.shifts == pytest.approx(one.shifts, abs=1e-9)
    assert two.curvature == pytest.approx(one.curvature, abs=1e-8)


def test_the_figure() -> None:
    """The figure shows the track from above, and how far points were shifted."""
    points, _ = surveyed(0.02, 1, FINE[-1])
    figure = gqm.figures.smoothing(gqm.Curve.sampled(points, smoothing="auto", closed=True))
    above, middle, below = figure.axes
    assert (above.get_ylabel(), middle.get_ylabel(), below.get_ylabel()) == ("y (m)", "shift (mm)", "curvature (1/m)")
    x, y = above.lines[0].get_data()
    assert np.hypot(x, y).max() < 25.1
