"""Smoothed tracks lie within the stated errors of the curves that the points scatter about."""

import copy
import math
import pickle
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import KDTree
from scipy.special import fresnel
from selection import examples

import gqm_sym as gqm
from gqm_sym.cli.gen import main
from gqm_sym.errors import DeclarationError, InputError, NoisyPointsWarning
from gqm_sym.runtime.charts.chart import Chart
from gqm_sym.runtime.charts.sampled import Sampled

G = 9.81
# Places are half a millimetre apart, which is how well the nearest one is known.
FINE = 200_001


@dataclass(frozen=True)
class Truth:
    """A curve by closed forms, at many places in order: coordinates, angle of the tangent and curvature."""

    x: np.ndarray
    z: np.ndarray
    angle: np.ndarray
    kappa: np.ndarray
    closed: bool = False

    def surveyed(self, count: int, scatter: float, seed: int) -> np.ndarray:
        """Return points at equal distances, each off by normal deviates in x and in z."""
        steps = np.hypot(np.diff(self.x), np.diff(self.z))
        s = np.concatenate([[0.0], np.cumsum(steps)])
        wanted = np.linspace(0.0, s[-1], count + self.closed)[:count]
        exact = np.stack([np.interp(wanted, s, self.x), np.interp(wanted, s, self.z)], axis=1)
        return exact + scatter * np.random.default_rng(seed).standard_normal(exact.shape)

    def nearest(self, x: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Return which of the places are nearest."""
        return self.tree.query(np.stack([x, z], axis=1))[1]

    @cached_property
    def tree(self) -> KDTree:
        """Return the places as a tree, for a search."""
        return KDTree(np.stack([self.x, self.z], axis=1))


def graph(low: float, high: float, z: Callable, slope: Callable, bend: Callable) -> Truth:
    """Return the curve z = z(x), by its derivatives."""
    x = np.linspace(low, high, FINE)
    return Truth(x, z(x), np.arctan(slope(x)), bend(x) / (1.0 + slope(x) ** 2) ** 1.5)


def hills() -> Truth:
    """Return some 80 m of a coaster, with hills 20 m long and 4 m high that become slowly lower."""
    k = 2.0 * np.pi / 20.0
    return graph(
        0.0,
        72.0,
        lambda x: 2.0 * np.cos(k * x) - 0.03 * x,
        lambda x: -2.0 * k * np.sin(k * x) - 0.03,
        lambda x: -2.0 * k * k * np.cos(k * x),
    )


def parabola() -> Truth:
    """Return a valley 10 m wide."""
    return graph(-5.0, 5.0, lambda x: 0.1 * x * x, lambda x: 0.2 * x, lambda x: 0.2 + 0.0 * x)


def circle() -> Truth:
    """Return a ring of radius 8 m, from its lowest point."""
    u = np.linspace(0.0, 2.0 * np.pi, FINE)
    return Truth(8.0 * np.sin(u), -8.0 * np.cos(u), u, np.full(FINE, 0.125), closed=True)


def loop() -> Truth:
    """Return a line, a clothoid up to the curvature of an arc of 6 m, the arc, and the mirror image of the first
    two.
    """
    radius, ramp, line = 6.0, 9.0, 8.0
    a = math.sqrt(2.0 * radius * ramp / 2.0)  # angle = (s/a)**2 / 2 * 1, kappa = s/a**2
    s = np.linspace(0.0, line + ramp, FINE // 2)
    t = np.maximum(s - line, 0.0) / (a * math.sqrt(math.pi))
    sine, cosine = fresnel(t)
    x = np.minimum(s, line) + a * math.sqrt(math.pi) * cosine
    z = a * math.sqrt(math.pi) * sine
    angle, kappa = 0.5 * math.pi * t * t, np.maximum(s - line, 0.0) / a**2
    end = angle[-1]
    turn = np.linspace(end, math.pi, FINE // 4)[1:]
    up = (x[-1] + radius * (np.sin(turn) - math.sin(end)), z[-1] - radius * (np.cos(turn) - math.cos(end)))
    half = [
        np.concatenate(pair)
        for pair in ((x, up[0]), (z, up[1]), (angle, turn), (kappa, np.full(turn.size, 1.0 / radius)))
    ]
    back = [2.0 * half[0][-1] - half[0][-2::-1], half[1][-2::-1], 2.0 * math.pi - half[2][-2::-1], half[3][-2::-1]]
    return Truth(*(np.concatenate(pair) for pair in zip(half, back, strict=True)))


TRACKS = {"hills": hills(), "parabola": parabola(), "circle": circle(), "loop": loop()}


def charted(curve: gqm.Curve) -> Chart:
    """Return the chart of a sampled curve."""
    track = curve.definition
    return Sampled(track.points, track.kind, track.closed).chart(())


def loads(truth: Truth, curve: gqm.Curve, s: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Return loads in g of a ride from rest half a metre above the top, on a track and at the nearest true places;
    V**2/g.
    """
    chart = charted(curve)
    s = np.linspace(0.0, chart.edges[-1], 2001) if s is None else s
    x, z, alpha, kappa = chart.points(s)
    at = truth.nearest(x, z)
    top = truth.z.max() + 0.5
    right = np.cos(truth.angle[at]) + 2.0 * (top - truth.z[at]) * truth.kappa[at]
    return np.cos(alpha) + 2.0 * (top - z) * kappa - right, 2.0 * (top - z)


@pytest.mark.sample(1)
@pytest.mark.parametrize("scatter", [0.001, 0.01, 0.1])
@pytest.mark.parametrize("name", TRACKS)
@pytest.mark.parametrize("known", [True, False], ids=["known", "auto"])
def test_loads_are_within_their_error(name: str, scatter: float, known: bool) -> None:
    """One standard error holds at two of three places or more, and two at 19 of 20, and the errors are not too
    large.
    """
    truth = TRACKS[name]
    ratios = []
    for seed in range(3):
        points = truth.surveyed(300, scatter, seed)
        curve = gqm.Curve.sampled(points, smoothing=scatter if known else "auto", closed=truth.closed)
        report = curve.smoothing
        assert abs(report.standard_deviation / scatter - 1.0) < 0.25
        assert report.rms < 1.2 * scatter
        off, factor = loads(truth, curve, report.s)
        ratios.append(off / (factor * report.curvature_error))
    size = np.abs(np.concatenate(ratios))
    assert np.mean(size < 1.0) > 0.68
    assert np.mean(size < 2.0) > 0.95
    assert 0.2 < np.sqrt(np.mean(size**2)) < 1.0


@pytest.mark.extended
@pytest.mark.parametrize("name", TRACKS)
def test_there_is_little_bias(name: str) -> None:
    """The bias of the curvature is less than half of the stated error.

    Where the mean squared error of a smoothing spline is smallest, its squared bias is at most a quarter of its
    variance (with a penalty on derivative m, one part in 4 m: both are powers of the smoothing parameter). Noise that
    is left in the mean over the surveys is subtracted by its variance.
    """
    truth = TRACKS[name]
    offs, errors = [], []
    for seed in range(8):
        curve = gqm.Curve.sampled(truth.surveyed(300, 0.01, seed), smoothing=0.01, closed=truth.closed)
        s = np.linspace(0.03, 0.97, 300) * charted(curve).edges[-1]
        off, factor = loads(truth, curve, s)
        offs.append(off / factor)
        errors.append(np.interp(s, curve.smoothing.s, curve.smoothing.curvature_error))
    squared_bias = np.mean(offs, axis=0) ** 2 - np.var(offs, axis=0, ddof=1) / len(offs)
    assert np.mean(squared_bias / np.mean(errors, axis=0) ** 2) < 0.25


@pytest.mark.sample(1)
@pytest.mark.parametrize(("count", "interpolated", "smoothed"), [(160, 0.8, 0.06), (400, 5.0, 0.05)])
def test_the_coaster_of_the_issue(tmp_path: Path, count: int, interpolated: float, smoothed: float) -> None:
    """With 1 cm of scatter, the error of contact forces is many g without smoothing, and hundredths of one with it."""
    truth = TRACKS["hills"]
    points = truth.surveyed(count, 0.01, 5)
    with pytest.warns(
        NoisyPointsWarning, match=r"^sampled: the curvature goes up and down .* as smoothing, or 'auto'$"
    ) as told:
        rough = gqm.Curve.sampled(points)
    assert told[0].filename == __file__  # where the user wrote it
    off, _ = loads(truth, rough)
    assert np.sqrt(np.mean(off**2)) > interpolated
    curve = gqm.Curve.sampled(points, smoothing=0.01)
    assert str(curve).startswith(f"Curve: a smoothing spline of {count} points, open")
    off, _ = loads(truth, curve)
    assert np.sqrt(np.mean(off**2)) < smoothed
    assert np.abs(off[30:-30]).max() < 6.0 * smoothed
    assert np.abs(off).max() < 0.6  # at the end, where the body is fast
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name=f"surveyed_{count}", folder=tmp_path)
    s = np.linspace(0.0, charted(curve).edges[-1], 501)
    found = module.pass1(s, lam0=0.0, v0=3.0)
    at = truth.nearest(found.x, found.z)
    v2 = 9.0 + 2.0 * G * (found.z[0] - truth.z[at])
    right = np.cos(truth.angle[at]) + v2 * truth.kappa[at] / G
    assert np.abs(found.normal_force / G - right)[8:-8].max() < 6.0 * smoothed


@pytest.mark.extended
def test_ends_do_not_swing() -> None:
    """The curvature's error at the ends is a few times that inside, and the stated error includes it."""
    truth = TRACKS["hills"]
    ends, inside, stated = [], [], []
    for seed in range(12):
        curve = gqm.Curve.sampled(truth.surveyed(400, 0.01, seed), smoothing="auto")
        off, factor = loads(truth, curve, curve.smoothing.s)
        ends += (off / factor)[[0, -1]].tolist()
        inside += (off / factor)[10:-10].tolist()
        stated += (curve.smoothing.curvature_error)[[0, -1]].tolist()
    assert np.sqrt(np.mean(np.square(ends))) < 10.0 * np.sqrt(np.mean(np.square(inside)))
    ratios = np.abs(ends) / stated
    assert np.mean(ratios < 1.0) > 0.68
    assert np.sqrt(np.mean(ratios**2)) > 0.2


def test_a_straight_line_stays_straight() -> None:
    """A straight line stays straight to rounding without scatter, and within the error with it."""
    line = np.stack([np.linspace(0.0, 40.0, 90), 7.0 - 0.75 * np.linspace(0.0, 40.0, 90)], axis=1)
    curve = gqm.Curve.sampled(line, smoothing="auto")
    assert np.abs(charted(curve).points(np.linspace(0.0, 50.0, 300))[3]).max() < 1e-12
    assert curve.smoothing.largest_shift < 1e-12
    rough = gqm.Curve.sampled(line + 0.05 * np.random.default_rng(1).standard_normal(line.shape), smoothing=0.05)
    report = rough.smoothing
    assert np.all(np.abs(report.curvature) < 3.0 * report.curvature_error)
    assert np.abs(report.curvature).max() < 0.01
    assert report.degrees_of_freedom < 8.0


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", TRACKS)
def test_exact_points_stay(name: str) -> None:
    """With very little scatter the track is the one through the points."""
    truth = TRACKS[name]
    points = truth.surveyed(120, 0.0, 0)
    plain = charted(gqm.Curve.sampled(points, closed=truth.closed))
    curve = gqm.Curve.sampled(points, smoothing=1e-12, closed=truth.closed)
    kept = np.array(curve.definition.points.split(), dtype=np.float64).reshape(-1, 2)
    assert np.abs(kept - points).max() < 1e-9
    found = charted(curve)
    assert found.edges[-1] == pytest.approx(plain.edges[-1], rel=1e-9)
    s = np.linspace(0.0, plain.edges[-1], 1001)
    assert np.abs(found.points(s)[3] - plain.points(s)[3]).max() < 1e-5
    assert curve.smoothing.largest_shift < 1e-9


@pytest.mark.sample(1)
@pytest.mark.parametrize("seed", range(3))
def test_a_closed_track_closes(seed: int) -> None:
    """Place, angle, curvature and its first two derivatives are the same on both sides of the first point."""
    truth = TRACKS["circle"]
    chart = charted(gqm.Curve.sampled(truth.surveyed(200, 0.03, seed), smoothing="auto", closed=True))
    step = 0.02
    x, z, alpha, kappa = chart.points(np.arange(-4, 5) * step + np.array([0.0]))
    assert abs(x[5] - 2 * x[4] + x[3]) < step**2
    assert abs(z[5] - 2 * z[4] + z[3]) < step**2
    slope = np.gradient(kappa, step)
    bend = np.diff(kappa, 2) / step**2
    assert np.ptp(np.diff(alpha)) < 1e-4
    assert np.ptp(slope[1:-1]) < 8 * step * np.abs(bend).max() + 1e-9
    assert np.ptp(bend) < 0.5 * np.abs(bend).max() + 1e-4


@pytest.mark.extended
@examples(15, otherwise=2)
@given(
    angle=st.floats(-3.2, 3.2),
    scale=st.floats(1e-3, 1e3),
    shift=st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3)),
    name=st.sampled_from(["hills", "circle"]),
    known=st.booleans(),
)
def test_turned_moved_and_magnified(
    angle: float, scale: float, shift: tuple[float, float], name: str, known: bool
) -> None:
    """If the points are rotated, moved or magnified, so is the track, and nothing else changes."""
    truth = TRACKS[name]
    points = truth.surveyed(100, 0.02, 3)
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    moved = scale * (points @ turn.T + shift)
    pair = [
        gqm.Curve.sampled(given, smoothing=deviation if known else "auto", closed=truth.closed)
        for given, deviation in ((points, 0.02), (moved, 0.02 * scale))
    ]
    one, two = (np.array(curve.definition.points.split(), dtype=np.float64).reshape(-1, 2) for curve in pair)
    assert np.abs(scale * (one @ turn.T + shift) - two).max() < 1e-8 * scale
    reports = [curve.smoothing for curve in pair]
    assert reports[1].rms == pytest.approx(scale * reports[0].rms, rel=1e-6)
    assert reports[1].curvature_error * scale == pytest.approx(reports[0].curvature_error, rel=1e-4)


def test_the_other_way_round() -> None:
    """Points in reverse order give the same track with curvature of the other sign."""
    points = TRACKS["hills"].surveyed(150, 0.02, 2)
    one, two = (gqm.Curve.sampled(rows, smoothing=0.02) for rows in (points, points[::-1]))
    forwards, backwards = (np.array(curve.definition.points.split(), dtype=np.float64) for curve in (one, two))
    assert np.abs(forwards.reshape(-1, 2) - backwards.reshape(-1, 2)[::-1]).max() < 1e-6
    assert np.abs(one.smoothing.curvature + two.smoothing.curvature[::-1]).max() < 1e-5


@pytest.mark.extended
def test_many_points() -> None:
    """Tens of thousands of points closer together than their scatter leave few points, and a tenth of the error."""
    truth = TRACKS["hills"]
    curve = gqm.Curve.sampled(truth.surveyed(40_000, 0.03, 0), smoothing="auto")
    assert curve.definition.points.count("\n") < 1000
    off, _ = loads(truth, curve)
    assert np.sqrt(np.mean(off[50:-50] ** 2)) < 0.02
    assert curve.smoothing.standard_deviation == pytest.approx(0.03, rel=0.02)


@pytest.mark.extended
def test_a_place_measured_twice_is_no_mistake() -> None:
    """Rows that repeat the one before are no new points, but messages count them; neighbours may be in any order."""
    points = np.round(TRACKS["parabola"].surveyed(2000, 0.01, 0), 2)
    curve = gqm.Curve.sampled(np.repeat(points, 2, axis=0), smoothing="auto")
    off, _ = loads(TRACKS["parabola"], curve)
    assert np.abs(off).max() < 0.1
    assert len(curve.smoothing.points) <= 2000
    rows = np.repeat(np.array(POINTS), 2, axis=0)
    rows[100:102] += 9.0
    with pytest.raises(DeclarationError, match=r"row 101: the track turns by 1.. degrees"):
        gqm.Curve.sampled(rows, smoothing="auto")


def test_what_is_reported() -> None:
    """The shifts are the distances from points to places, and the report prints, copies and pickles."""
    curve = gqm.Curve.sampled(TRACKS["hills"].surveyed(200, 0.01, 0), smoothing=0.01)
    report = curve.smoothing
    off = np.hypot(*(report.points - report.places).T)
    assert np.abs(report.shifts) == pytest.approx(off, abs=1e-9)
    assert report.rms == pytest.approx(math.sqrt(np.mean(off**2)), rel=1e-6)
    assert report.largest_shift == pytest.approx(off.max(), abs=1e-9)
    assert report.load_error(10.0) == pytest.approx(report.curvature_error * 100.0 / 9.80665)
    found = charted(curve).points(report.s)[3]
    assert np.abs(found - report.curvature).max() < 0.01 * report.curvature_error.max()
    assert "200 points, smoothed (given 0.01 m)" in str(report)
    shown = f"standard deviation {report.standard_deviation:.3g} m, largest shift {report.largest_shift:.3g} m"
    assert repr(report) == f"<smoothing of 200 points: {shown}>"
    other = pickle.loads(pickle.dumps(curve))
    assert other == curve
    assert other.smoothing.rms == report.rms
    assert copy.deepcopy(curve) == curve
    assert gqm.Curve.sampled(report.places).smoothing is None
    assert gqm.Curve.graph("x**2").smoothing is None


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", TRACKS)
@pytest.mark.parametrize("count", [40, 160, 400])
def test_the_warning(name: str, count: int) -> None:
    """There is a warning for noticeable scatter, and none without scatter, with less, or after smoothing."""
    truth = TRACKS[name]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for scatter in (0.0, 1e-7):
            gqm.Curve.sampled(truth.surveyed(count, scatter, 1), closed=truth.closed)
        gqm.Curve.sampled(truth.surveyed(count, 0.01, 1), smoothing="auto", closed=truth.closed)
    scattered = truth.surveyed(count, 0.01, 1)
    if (count, name) == (160, "parabola"):  # so much that the points zigzag
        with pytest.raises(DeclarationError, match="smoothing takes it out"):
            gqm.Curve.sampled(scattered, closed=truth.closed)
    elif count == 160:
        with pytest.warns(NoisyPointsWarning, match="smoothing"):
            gqm.Curve.sampled(scattered, closed=truth.closed)


def test_too_small_a_deviation_is_reported() -> None:
    """With a stated deviation of a hundredth of the scatter, all scatter is kept."""
    with pytest.warns(NoisyPointsWarning, match=r"smoothing 0\.0001 is less than their scatter$"):
        gqm.Curve.sampled(TRACKS["hills"].surveyed(160, 0.01, 1), smoothing=0.0001)


POINTS = [(float(x), float(z)) for x, z in TRACKS["hills"].surveyed(100, 0.02, 0)]


@pytest.mark.parametrize(
    ("points", "options", "message"),
    [
        (POINTS, {"smoothing": -0.01}, r"smoothing: must be the standard deviation .* got -0\.01"),
        (POINTS, {"smoothing": 0}, "smoothing: must be the standard deviation .* got 0"),
        (POINTS, {"smoothing": math.nan}, "smoothing: must be the standard deviation .* got nan"),
        (POINTS, {"smoothing": math.inf}, "smoothing: must be the standard deviation .* got inf"),
        (POINTS, {"smoothing": "automatic"}, "smoothing: must be the standard deviation .* got 'automatic'"),
        (POINTS, {"smoothing": True}, "smoothing: must be the standard deviation .* got True"),
        (POINTS, {"smoothing": [0.1]}, r"smoothing: must be the standard deviation .* got \[0\.1\]"),
        (POINTS, {"smoothing": 0.1, "kind": "linear"}, "smoothing: is for kind 'spline'"),
        (POINTS[:5], {"smoothing": 0.1}, "5 different points; an open track of smoothing 0.1 needs 6 or more"),
        (POINTS[:11], {"smoothing": "auto"}, "11 different points; an open track of smoothing 'auto' needs 12"),
        ([*POINTS[:50], (45.0, 9.0), *POINTS[51:]], {"smoothing": "auto"}, "row 51: the track turns by 1.. degrees"),
        ([*POINTS[:50], (30000.0, 9.0), *POINTS[51:]], {"smoothing": 0.1}, r"row 51: is 3e\+04 from row 50"),
        ([*POINTS[:50], (math.nan, 9.0), *POINTS[51:]], {"smoothing": 0.1}, "row 51: nan is not finite"),
        ([*POINTS[60:], *POINTS[:60]], {"smoothing": "auto"}, "row 4.: the track turns by 1.. degrees"),
    ],
)
def test_bad_input_is_refused(points: object, options: dict[str, object], message: str) -> None:
    """Bad input is refused with its row, or with what was given."""
    with pytest.raises(DeclarationError, match=f"^sampled: {message}"):
        gqm.Curve.sampled(points, **options)


YAML = "name: track\ntitle: Surveyed\ncurve: {{points: {{file: track.csv{}}}}}\nkernel: {{gravity: {{}}}}\n"


def written(folder: Path, smoothing: str) -> Path:
    """Write a curve file with its points beside it."""
    rows = "\n".join(f"{x!r},{z!r}" for x, z in POINTS)
    (folder / "track.csv").write_text(f"x,z\n{rows}\n")
    (folder / "track.yaml").write_text(YAML.format(smoothing and f", smoothing: {smoothing}"))
    return folder / "track.yaml"


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("text", "smoothing"),
    [("0.02", 0.02), ("auto", "auto"), ("1/50", 0.02), ("{value: 20, unit: mm}", 0.02), ("{value: auto}", "auto")],
)
def test_curve_files(tmp_path: Path, text: str, smoothing: float | str) -> None:
    """In curve files the deviation is a number in metres, or with its unit, or "auto"."""
    curve = gqm.read_spec(written(tmp_path, text)).curve
    assert curve.definition == gqm.Curve.sampled(POINTS, smoothing=smoothing).definition
    assert curve.smoothing.given == (None if smoothing == "auto" else smoothing)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("-1", "3:.*curve.points.smoothing: must be a standard deviation, a positive number, or auto, got '-1'"),
        ("none", "curve.points.smoothing: must be a standard deviation, a positive number, or auto, got 'none'"),
        ("{value: 1, unit: kg}", "curve.points.smoothing.unit: must be in m or a multiple of it, got kg"),
        ("{value: auto, unit: m}", "curve.points.smoothing.unit: auto has none"),
        ("{unit: m}", "curve.points.smoothing: value is missing; add value: 0.01"),
        ("0.01, kind: linear", "curve.points.smoothing: is for kind 'spline'"),
    ],
)
def test_bad_curve_files(tmp_path: Path, text: str, message: str) -> None:
    """Bad curve files give one line each, with the place."""
    with pytest.raises(gqm.GQMError, match=message):
        gqm.read_spec(written(tmp_path, text))


def test_the_command_line_prints_the_changes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The changes by smoothing are printed with the closed forms; a warning is one line that names the file."""
    assert main([str(written(tmp_path, "auto")), "-o", str(tmp_path)]) == 0
    out, err = capsys.readouterr()
    assert "100 points, smoothed (by cross-validation)" in out
    assert err == ""
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        assert main([str(written(tmp_path, "")), "-o", str(tmp_path)]) == 0
    err = capsys.readouterr().err
    assert err.startswith("gqm-gen: warning: 'track.csv', the curvature goes up and down from point to point")
    assert err.count("\n") == 1


@pytest.mark.extended
def test_the_figure() -> None:
    """The figure has three panels: the track, shifts in millimetres and curvature with its band; axes of the caller are
    accepted.
    """
    from matplotlib.figure import Figure

    curve = gqm.Curve.sampled(POINTS, smoothing="auto")
    figure = gqm.figures.smoothing(curve)
    figure.draw_without_rendering()
    above, middle, below = figure.axes
    assert max(np.abs(middle.lines[0].get_ydata())) == pytest.approx(1e3 * curve.smoothing.largest_shift)
    assert below.lines[0].get_ydata() == pytest.approx(curve.smoothing.curvature)
    assert "enlarged" in above.get_legend().get_texts()[1].get_text()
    own = Figure()
    assert gqm.figures.smoothing(curve, own.subplots(3, 1)) is own
    with pytest.raises(InputError, match="smoothing: the curve was not smoothed"):
        gqm.figures.smoothing(gqm.Curve.graph("x**2"))
