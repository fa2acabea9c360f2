"""Tracks given by points, as splines and stitched planes, agree with the curves from which the points were taken."""

import math
from collections.abc import Iterable
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from mpmath import ellipe, ellipk, mp, mpf
from numpy.polynomial.legendre import leggauss

import gqm_sym as gqm
from gqm_sym.errors import DeclarationError
from gqm_sym.runtime.charts.chart import Chart
from gqm_sym.runtime.charts.sampled import Sampled

ULP = 2.0**-52
G = 9.81
# The semi-axes of the ellipse from which points are taken.
A, B = 2.0, 1.0


def ellipse(count: int, phase: float = 0.1) -> np.ndarray:
    """Return points of an ellipse, counter-clockwise."""
    theta = phase + 2.0 * np.pi * np.arange(count) / count
    return np.stack([A * np.cos(theta), B * np.sin(theta)], axis=1)


def text(points: Iterable[Iterable[float]]) -> str:
    """Return points as a module stores them."""
    return "\n".join(" ".join(repr(float(value)) for value in row) for row in points)


def charted(points: np.ndarray, kind: str = "spline", *, closed: bool = False) -> Chart:
    """Return the chart of a track."""
    return Sampled(text(points), kind, closed).chart(())


def built(folder: Path, name: str, points: Iterable[Iterable[float]], **options: object) -> ModuleType:
    """Return a module for motion under gravity along a track."""
    return gqm.build(gqm.derive(gqm.Curve.sampled(points, **options), gqm.Gravity()), name=name, folder=folder)


def test_a_spline_goes_through_its_points() -> None:
    """The edges of a spline's pieces are the points, in order; angle, coordinates and curvature at the edges agree."""
    points = np.stack([np.linspace(0.0, 6.0, 25), np.sin(np.linspace(0.0, 6.0, 25)) + 5.0], axis=1)
    chart = charted(points)
    found = chart.points(chart.edges)[:2].T
    assert max(np.abs(found - point).max(axis=1).min() for point in points) <= 4 * ULP * 6.0
    nodes, weights = leggauss(30)
    half = 0.5 * np.diff(chart.edges)
    s = chart.edges[:-1, None] + half[:, None] * (1.0 + nodes)
    rows = chart.points(s).reshape(4, *s.shape)
    ends = np.diff(chart.points(chart.edges)[:3], axis=1)
    for row, rate in ((0, np.cos(rows[2])), (1, np.sin(rows[2])), (2, rows[3])):
        assert np.abs(half * (rate @ weights) - ends[row]).max() <= 1e-14


def test_a_spline_converges_to_the_curve() -> None:
    """The length converges at order six, and the curvature at order four."""
    with mp.workdps(30):
        length = 4 * A * ellipe(1 - mpf(B) ** 2 / A**2)
    errors = []
    for count in (50, 100, 200):
        chart = charted(ellipse(count), closed=True)
        x, z, alpha, kappa = chart.points(np.linspace(0.0, chart.period, 2001))
        cosine, sine = x / A, z / B
        bend = A * B / ((A * sine) ** 2 + (B * cosine) ** 2) ** 1.5
        errors.append((abs(float(chart.period - length)), np.abs(kappa - bend).max()))
        assert abs(alpha[-1] - alpha[0] - 2.0 * np.pi) <= 8 * ULP
    orders = np.log2(np.array(errors)[:-1] / np.array(errors)[1:])
    assert np.all(orders[:, 0] > 5.5)
    assert np.all(orders[:, 1] > 3.8)


@pytest.mark.parametrize("count", [8, 9, 10, 11])
def test_a_spline_through_few_points(count: int) -> None:
    """Few points of a smooth valley have a spline near it, at order four."""

    def valley(x: np.ndarray) -> np.ndarray:
        return 0.4 * x**2 + 0.55 * np.sin(2.0 * x + 0.15)

    x = np.linspace(-2.0, 2.0, count)
    points = np.column_stack([x, valley(x)])
    chart = charted(points)
    found = chart.points(chart.edges)[:2].T
    assert max(np.abs(found - point).max(axis=1).min() for point in points) <= 8 * ULP * 6.0
    x, z = chart.points(np.linspace(chart.edges[0], chart.edges[-1], 2001))[:2]
    assert np.abs(z - valley(x)).max() <= 4.0 * (4.0 / (count - 1)) ** 4


@pytest.mark.extended
def test_a_motion_on_a_spline_converges(tmp_path: Path) -> None:
    """Half period and contact force converge to those of the curve at the spline's orders."""
    curve = gqm.Curve.parametric(x=f"{A}*cos(u)", z=f"{B}*sin(u)", parameter="u", period="2*pi")
    smooth = gqm.build(gqm.derive(curve, gqm.Gravity()), name="smooth", folder=tmp_path).solve(lam0=-0.3)
    start = (A * math.cos(-0.3), B * math.sin(-0.3))
    errors = []
    for count in (200, 400, 800):
        module = built(tmp_path, f"spline_{count}", ellipse(count), closed=True)
        chart = module.CHART.chart(())
        motion = module.solve(lam0=chart.nearest(*start)[0])
        found = module.pass1(np.linspace(0.0, chart.period, 1501), lam0=motion.turning_points[0])
        sine, cosine = found.z / B, found.x / A
        rate = np.hypot(A * sine, B * cosine)
        force = -G * A * sine / rate + 2.0 * G * (start[1] - found.z) * A * B / rate**3
        errors.append((abs(motion.half_period - smooth.half_period), np.abs(found.normal_force - force).max()))
        # The jumps of its fifth derivative do not affect the motion on the spline itself.
        assert motion.error_bound(motion.half_period) <= 1e-13
    errors_of_period, errors_of_force = np.array(errors).T
    assert np.all(errors_of_period[1:] < errors_of_period[:-1] / 2.0**4.5)
    assert np.all(errors_of_force[1:] < errors_of_force[:-1] / 2.0**3.5)


def test_points_closer_than_needed_are_thinned() -> None:
    """Thousands of points of a smooth curve give a chart of few pieces, whose curvature is as good as their digits."""
    chart = charted(ellipse(20_000), closed=True)
    assert chart.edges.size < 3000
    x, z, _, kappa = chart.points(np.linspace(0.0, chart.period, 5000))
    assert (
        np.abs(kappa - A * B / ((A * z / B) ** 2 + (B * x / A) ** 2) ** 1.5).max()
        <= 2.0 * ULP * A / (chart.period / 20_000) ** 2
    )
    assert np.abs((x / A) ** 2 + (z / B) ** 2 - 1.0).max() <= 1e-14


VALLEY = [(-3.0, 4.0), (0.0, 0.0), (2.0, 0.0), (7.0, 12.0)]


@pytest.mark.parametrize(("lam0", "direction"), [(0.0, 1), (2.5, -1)])
def test_stitched_planes(tmp_path: Path, lam0: float, direction: int) -> None:
    """Down a slope of 4:3, over a level and up a slope of 12:5, eq. (1) holds plane by plane, and V is kept at
    corners.
    """
    motion = built(tmp_path, "valley", VALLEY, kind="linear").solve(lam0=lam0, direction=direction)
    height = 4.0 * (1.0 - lam0 / 5.0)
    fast = math.sqrt(2.0 * G * height)
    half = fast / G * (5.0 / 4.0) + 2.0 / fast + fast / G * (13.0 / 12.0)
    assert motion.kind == "libration"
    assert abs(motion.half_period - half) <= 4 * ULP * half
    assert abs(max(motion.turning_points) - (7.0 + height * 13.0 / 12.0)) <= 8 * ULP * 12.0
    corners = [event for event in motion.events if event.kind == "corner"]
    first = fast / G * (5.0 / 4.0)
    level = 2.0 / fast
    back = first + level + 2.0 * fast / G * (13.0 / 12.0)
    if lam0 == 0.0:
        passed = ((5.0, first), (7.0, first + level), (7.0, back), (5.0, back + level))
        for event, (place, t) in zip(corners, passed, strict=True):
            assert abs(event.lam - place) <= 2 * ULP * place
            assert abs(event.t - t) <= 8 * ULP * motion.period
        state = motion.state([0.5 * first, first + 0.5 * level])
        assert abs(state.v[1] - fast) <= 4 * ULP * fast
        assert np.all(state.kappa == 0.0)
        assert abs(state.normal_force[0] - G * 0.6) <= 8 * ULP * G
        assert abs(state.normal_force[1] - G) <= 8 * ULP * G


def test_planes_from_end_to_end(tmp_path: Path) -> None:
    """A launch that leaves over all corners, in both directions: times add up plane by plane."""
    module = built(tmp_path, "planes", VALLEY, kind="linear")
    for lam0, direction, speed, path in ((0.0, 1, 20.0, VALLEY), (20.0, -1, 3.0, VALLEY[::-1])):
        motion = module.solve(lam0=lam0, v0=speed, direction=direction)
        total, v = 0.0, speed
        for (x, z), (x_next, z_next) in pairwise(path):
            after = math.sqrt(v * v - 2.0 * G * (z_next - z))
            total += 2.0 * math.hypot(x_next - x, z_next - z) / (v + after)
            v = after
        assert motion.legs[-1].end == "domain-end"
        assert abs(motion.legs[-1].t_end - total) <= 8 * ULP * total


def test_refined_planes_converge(tmp_path: Path) -> None:
    """Planes through points of a circle have the half period of the pendulum, at order 1.5 if the body turns at
    points.
    """
    with mp.workdps(30):
        half = float(2 * ellipk(mp.sin(mpf("0.5")) ** 2) / mp.sqrt(mpf("9.81")))
    errors = []
    for count in (64, 256, 1024):
        theta = -1.0 + 2.0 / count * np.arange(count * 9 // 8)
        points = np.stack([np.sin(theta), -np.cos(theta)], axis=1)
        motion = built(tmp_path, f"planes_{count}", points, kind="linear").solve(lam0=0.0)
        errors.append(abs(motion.half_period - half))
    orders = np.log2(np.array(errors)[:-1] / np.array(errors)[1:]) / 2.0
    assert np.all(orders > 1.45)


def test_closed_planes(tmp_path: Path) -> None:
    """On a triangle the first point is a corner too, and the time of a round is that of its planes."""
    points = [(0.0, 0.0), (4.0, 0.0), (0.0, 3.0)]
    module = built(tmp_path, "triangle", points, kind="linear", closed=True)
    chart = module.CHART.chart(())
    assert chart.period == 12.0
    assert chart.corners.tolist() == [0.0, 4.0, 9.0]
    motion = module.solve(lam0=1.0, v0=10.0)
    top = math.sqrt(100.0 - 2.0 * G * 3.0)
    total = 4.0 / 10.0 + 2.0 * (5.0 + 3.0) / (10.0 + top)
    assert motion.kind == "circulation"
    assert abs(motion.period - total) <= 8 * ULP * total


@pytest.mark.parametrize(("start", "corners"), [((), [2.0, 4.0, 6.0]), (((0.0, -1.0),), [1.0, 3.0, 5.0, 7.0])])
def test_a_square_turns_once(start: tuple[tuple[float, float], ...], corners: list[float]) -> None:
    """A closed square turns by 2 pi in each lap, whether its first point is a corner or lies on a side."""
    ring = [(1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)]
    chart = charted(np.array([*start, *ring]), "linear", closed=True)
    assert chart.corners[chart.corners > 0.0].tolist() == corners
    assert (0.0 in chart.corners) == (not start)
    one, two = chart.points([0.5, 8.5])[2]
    assert two - one == pytest.approx(2 * np.pi, rel=4 * ULP)


def test_a_repeated_point_closes_the_track() -> None:
    """A first point repeated at the end closes the track, unless the track is declared open."""
    points = ellipse(40)
    ring = np.concatenate([points, points[:1]])
    for given, options, closed, rows in (
        (ring, {}, True, 40),
        (points, {}, False, 40),
        (points, {"closed": True}, True, 40),
        (ring, {"closed": True}, True, 40),
        (ring, {"closed": False}, False, 41),
    ):
        track = gqm.Curve.sampled(given, **options).definition
        assert (track.closed, len(track.points.splitlines())) == (closed, rows)


def test_text_travels_as_it_is(tmp_path: Path) -> None:
    """Decimal text is kept unchanged in the declaration and in the module, and other numbers by their doubles."""
    rows = [("0.10", "1"), ("+2.50000000000000000001", "1e-3"), (3, Fraction(1, 3))]
    curve = gqm.Curve.sampled(rows, kind="linear")
    kept = "0.10 1\n+2.50000000000000000001 1e-3\n3 0.333333333333333314829616256247390992939472198486328125"
    assert curve.definition.points == kept
    source = gqm.emit(gqm.derive(curve, gqm.Gravity()), name="exact")
    assert f'POINTS = """\n{kept}\n"""' in source
    other = gqm.emit(gqm.derive(gqm.Curve.sampled([*rows[:2], (3, 0.5)], kind="linear"), gqm.Gravity()), name="exact")
    assert other.splitlines()[1] != source.splitlines()[1]


LINE = [(float(i), 0.1 * i * i) for i in range(12)]


@pytest.mark.parametrize(
    ("points", "options", "message"),
    [
        ([*LINE[:4], (4.0, math.nan), *LINE[5:]], {}, "row 5: nan is not finite"),
        ([*LINE[:4], (4.0, "1e999"), *LINE[5:]], {}, "row 5: '1e999' is not finite"),
        ([*LINE[:4], (4.0, "0x10"), *LINE[5:]], {}, "row 5: '0x10' is not a decimal number"),
        ([*LINE[:4], (4.0, None), *LINE[5:]], {}, "row 5: None is not a number"),
        ([*LINE[:4], (4.0, True), *LINE[5:]], {}, "row 5: True is not a number"),
        ([*LINE[:4], (4.0, 1.6, 0.0), *LINE[5:]], {}, "row 5: must be two numbers, x and z, got"),
        ([*LINE[:4], "12", *LINE[5:]], {}, "row 5: must be two numbers, x and z, got '12'"),
        ([*LINE[:4], LINE[3], *LINE[4:]], {}, "row 5: repeats row 4; leave one of them out"),
        (
            [*LINE[:3], LINE[6], *LINE[4:6], LINE[3], *LINE[7:]],
            {},
            "row 4: the track turns by 174 degrees there; are the",
        ),
        (
            [*LINE[:6], (6.0, 3000.0), *LINE[7:]],
            {},
            "row 7: is 3e\\+03 from row 6, where half of all points are within",
        ),
        ([(1e90 * x, 1e90 * z) for x, z in LINE], {}, r"the points span 1\.21e\+91 m; a track spans 1e-60 to 1e\+60 m"),
        ([(1e-90 * x, 1e-90 * z) for x, z in LINE], {"smoothing": "auto"}, r"the points span 1\.21e-89 m; a track"),
        ([*LINE[:6], (3.2, 6.0), *LINE[7:]], {}, "row 7: the track turns by 1.. degrees there"),
        (LINE[:5], {}, "5 different points; an open track of kind 'spline' needs 6 or more"),
        ([], {}, "0 different points"),
        (LINE[:2], {"kind": "linear", "closed": True}, "2 different points; a closed track of kind 'linear' needs 3"),
        ([*LINE[:4], LINE[2]], {"kind": "linear"}, "row 4: the track turns by 180 degrees"),
        (7, {}, "points: must be rows of x and z, got 7"),
        (LINE, {"kind": "cubic"}, "kind: must be one of spline, linear, got 'cubic'"),
        (LINE, {"closed": "yes"}, "closed: must be True, False or None, got 'yes'"),
    ],
)
def test_bad_points_are_refused(points: object, options: dict[str, object], message: str) -> None:
    """Bad points are refused with their row, counted from 1."""
    with pytest.raises(DeclarationError, match=f"^sampled: {message}"):
        gqm.Curve.sampled(points, **options)


YAML = "name: track\ncurve: {{points: {points}}}\nkernel: {{gravity: {{}}}}\n"


def spec(folder: Path, points: str, data: bytes | str | None, file: str = "track.csv") -> gqm.Curve:
    """Return the curve of a YAML file with a file of points beside it."""
    if data is not None:
        (folder / file).write_bytes(data if isinstance(data, bytes) else data.encode())
    (folder / "track.yaml").write_text(YAML.format(points=points))
    return gqm.read_spec(folder / "track.yaml").curve


# A file has decimal text, which is exact, and not the doubles nearest to it.
TEXTS = [(repr(x), repr(z)) for x, z in LINE]
ROWS = "\n".join(f"{x},{z}" for x, z in TEXTS)


@pytest.mark.parametrize(
    "data", [ROWS, f"x,z\n{ROWS}\n", f"\ufeffX; Z\r\n{ROWS}\n\n".replace(",", " ; "), ROWS.replace(",", "\t")]
)
def test_points_of_a_file(tmp_path: Path, data: str) -> None:
    """A file of points may have a header; columns are separated by commas, semicolons or blanks."""
    assert spec(tmp_path, "track.csv", data).definition == gqm.Curve.sampled(TEXTS).definition


def test_options_of_a_file(tmp_path: Path) -> None:
    """The kind, whether the track closes, and a file in a subfolder are read from the YAML file."""
    (tmp_path / "data").mkdir()
    track = spec(tmp_path, "{file: data/a.csv, kind: linear, closed: true}", ROWS, "data/a.csv").definition
    assert track == gqm.Curve.sampled(TEXTS, kind="linear", closed=True).definition


@pytest.mark.parametrize(
    ("points", "data", "message"),
    [
        ("track.csv", None, "'track.csv': there is no such file in this folder"),
        ("track.csv", "x,z\n1,2\n2,oops", "'track.csv', row 3: 'oops' is not a decimal number"),
        ("track.csv", f"x,z\n{ROWS}\n11,12.1", "'track.csv', row 14: repeats row 13"),
        ("track.csv", "1,2\n1,2,3", "'track.csv', row 2: must be two numbers"),
        ("track.csv", "1,2\n\n2,3", "'track.csv', row 2: must be two numbers"),
        ("track.csv", "", "'track.csv', row 1: must be two numbers"),
        (
            "track.csv",
            "z,y\n1,2",
            "'track.csv', row 1: the columns must be x, z, or x, y, z, perhaps with roll, got 'z,y'",
        ),
        ("track.csv", "1,2\n" + "9" * 300, "'track.csv', row 2: is longer than 200 characters"),
        ("track.csv", b"1,2\n\xff\xfe", "'track.csv', row 2: is not UTF-8 text"),
        ("track.csv", "1,2\n" * 500_001, "'track.csv': has 500001 rows; 500000 is the most"),
        ("../track.csv", ROWS, "'../track.csv': must be a path inside the YAML file's folder"),
        ("/etc/passwd", ROWS, "'/etc/passwd': must be a path inside the YAML file's folder"),
        ("inside", None, "'inside': is not a plain file|'inside': cannot be read"),
        ("{file: track.csv, kind: round}", ROWS, "curve.points.kind: must be 'spline' or 'linear', got 'round'"),
        ("{kind: linear}", ROWS, "curve.points: file is missing; add file: track.csv"),
    ],
)
def test_bad_files_are_refused(tmp_path: Path, points: str, data: bytes | str | None, message: str) -> None:
    """Bad files are refused with the place in the YAML, the file and its row; nothing outside the folder is read."""
    folder = tmp_path / "here"
    (folder / "inside").mkdir(parents=True)
    with pytest.raises(gqm.GQMError, match=message):
        spec(folder, points, data, "../track.csv" if points.startswith("..") else "track.csv")


@pytest.mark.extended
def test_long_files_are_read(tmp_path: Path) -> None:
    """A file of points has its own limits, because reading it takes longer than a YAML file may."""
    rows = "\n".join(f"{x},{x % 2}" for x in range(120_000))
    assert spec(tmp_path, "{file: track.csv, kind: linear}", rows).definition.points.count("\n") == 119_999


def test_links_and_pipes_are_refused(tmp_path: Path) -> None:
    """A link out of the folder and a pipe without end are refused."""
    import os

    folder = tmp_path / "here"
    folder.mkdir()
    (tmp_path / "outside.csv").write_text(ROWS)
    (folder / "link.csv").symlink_to(tmp_path / "outside.csv")
    os.mkfifo(folder / "pipe.csv")
    with pytest.raises(gqm.GQMError, match=r"'link\.csv': leads out of the YAML file's folder by a link"):
        spec(folder, "link.csv", None)
    with pytest.raises(gqm.GQMError, match=r"'pipe\.csv': is not a plain file"):
        spec(folder, "pipe.csv", None)
