"""Tracks through points in space agree with curves with formulas, planar tracks, and their own splines in mpmath."""

from pathlib import Path

import numpy as np
import pytest
from mpmath import mp, mpf
from scipy.interpolate import make_interp_spline

import gqm_sym as gqm
from gqm_sym.building import transient
from gqm_sym.errors import DeclarationError, LaunchError
from gqm_sym.runtime.charts.sampled import Sampled

ULP = 2.0**-52
X = np.linspace(0.0, 6.0, 61)
VALLEY = np.stack([X, np.round(1.3 * np.cos(X) + 0.2 * np.sin(2 * X), 3)], axis=1)
KNOT = {"x": "(2 + cos(3*u)/2)*cos(u)", "y": "(2 + cos(3*u)/2)*sin(u)", "z": "sin(3*u)/2 + sin(u)"}
START = -1.2


def knot(count: int) -> np.ndarray:
    """Return points of the closed curve whose formulas are above, beginning at ``START``."""
    u = START + 2.0 * np.pi * np.arange(count) / count
    radius = 2.0 + 0.5 * np.cos(3.0 * u)
    return np.stack([radius * np.cos(u), radius * np.sin(u), 0.5 * np.sin(3.0 * u) + np.sin(u)], axis=1)


def module(points: object, force: gqm.Kernel | None = None, **options: object) -> object:
    """Return a module for motion along a track, under gravity and another force."""
    law = gqm.Gravity() if force is None else gqm.Gravity() + force
    return transient(gqm.derive(gqm.Curve.sampled(points, **options), law))


@pytest.fixture(scope="module")
def smooth() -> object:
    """Return the curve of the formulas, under gravity."""
    return transient(gqm.derive(gqm.Curve.space(**KNOT, parameter="u"), gqm.Gravity()))


@pytest.mark.extended
def test_points_converge_to_their_curve(smooth: object) -> None:
    """The period and the states converge at the sixth order, also of laps."""
    true, errors = smooth.solve(START), []
    for count in (100, 200, 400):
        motion = module(knot(count), closed=True).solve(0.0)
        errors.append(abs(motion.half_period / true.half_period - 1.0))
    assert errors[0] <= 1e-7
    assert errors[1] <= errors[0] / 50
    assert errors[2] <= errors[1] / 50
    states = motion.state(0.7), true.state(0.7)
    for names, allowed in ((("x", "y", "z", "v"), 1e-10), (("normal_x", "normal_y", "normal_z"), 2e-6)):
        for name in names:  # the remaining difference is that of the spline, and of its curvature, from the curve
            found, wanted = (getattr(state, name) for state in states)
            assert found == pytest.approx(wanted, abs=allowed), name
    track = module(knot(400), closed=True)
    for quantity in ("half_period", "normal_force_max"):  # sweeps are the numbers of single motions
        swept = track.sweep(quantity, lam0=[-0.5, 0.25]).values
        single = [getattr(track.solve(place), quantity) for place in (-0.5, 0.25)]
        assert swept == pytest.approx([getattr(value, "value", value) for value in single], rel=4 * ULP)
    lap = track.solve(0.0, 12.0)
    assert lap.kind == "circulation"
    assert lap.period == pytest.approx(smooth.solve(START, 12.0).period, rel=1e-13)


@pytest.mark.extended
def test_losses_along_points_in_space() -> None:
    """With friction and drag the motion is that along the formulas, as far as the spline is that curve."""
    force = gqm.CoulombFriction(mu="1/20") + gqm.QuadraticDrag(b="1/10")
    motion = module(knot(400), force, closed=True).solve(0.0, t_max=3.0)
    curve = gqm.Curve.space(**KNOT, parameter="u")
    true = transient(gqm.derive(curve, gqm.Gravity() + force)).solve(START, t_max=3.0)
    times = np.array([0.5, 1.3, 2.7])
    found, wanted = motion.state(times), true.state(times)
    for name, allowed in (("x", 1e-9), ("y", 1e-9), ("z", 1e-9), ("v", 1e-8), ("normal_z", 1e-5)):
        assert np.abs(getattr(found, name) - getattr(wanted, name)).max() <= allowed, name


@pytest.mark.sample(1)
@pytest.mark.parametrize(("cosine", "sine"), [(1.0, 0.0), (0.6, 0.8)])
def test_points_in_a_vertical_plane(cosine: float, sine: float) -> None:
    """Points in a vertical plane give the planar answers: times to the rounding of coordinates, and the contact force
    as a vector.
    """
    flat = module(VALLEY)
    turned = module(np.stack([cosine * VALLEY[:, 0], sine * VALLEY[:, 0], VALLEY[:, 1]], axis=1))
    for place in (2.7, 3.0):
        plane, space = flat.solve(place), turned.solve(place)
        assert space.half_period == pytest.approx(plane.half_period, rel=4 * ULP)
        times = np.linspace(0.0, plane.half_period, 7)
        one, two = plane.state(times), space.state(times)
        assert np.abs(two.x - cosine * one.x).max() <= 20 * ULP * 6.0
        assert np.abs(two.y - sine * one.x).max() <= 20 * ULP * 6.0
        assert np.abs(two.z - one.z).max() <= 20 * ULP * 1.5
        # The curvature has the rounding of the points over the square of their distance.
        assert np.abs(two.normal_force - np.abs(one.normal_force)).max() <= 1e-12 * np.abs(one.normal_force).max()
        assert np.abs(cosine * two.normal_y - sine * two.normal_x).max() <= 1e-12 * np.abs(one.normal_force).max()


@pytest.mark.extended
def test_a_straight_track() -> None:
    """On a slope W is 2 g s sin(slope), and the contact force is that of the slope."""
    points = np.outer(np.arange(8.0), (3.0, 4.0, -12.0))
    state = module(points).solve(0.0).state(2.0)
    fall = 9.81 * 12 / 13
    assert state.s == pytest.approx(2.0 * fall, rel=4 * ULP)
    assert state.v == pytest.approx(2.0 * fall, rel=4 * ULP)
    wanted = 9.81 * np.array([12 * 3 / 169, 12 * 4 / 169, 25 / 169])
    # The second derivative of a quintic spline has the roundings of its coefficients, times up to 20, 40 and 20 next to
    # its ends, over the square of the distance of its points.
    noise = 64 * ULP * np.abs(points).max() / 13**2 * state.v**2
    assert np.abs(np.array([state.normal_x, state.normal_y, state.normal_z]) - wanted).max() <= noise


@pytest.mark.extended
def test_the_time_along_the_spline_itself() -> None:
    """The spline, evaluated with 30 digits by de Boor's algorithm, gives the same half period."""
    u = np.linspace(-2.0, 2.0, 97)
    points = np.stack([2.0 * np.cos(u), np.sin(2.0 * u), u * u], axis=1)
    chart = Sampled("\n".join(" ".join(map(repr, row)) for row in points.tolist()), in_space=True).chart(())
    # The arc lengths of the points are their knots, which for so many points are right to rounding.
    knots = np.array([_arc_length_at(chart, point) for point in points])
    spline = make_interp_spline(knots, points, k=5)
    nodes, weights = np.polynomial.legendre.leggauss(16)
    with mp.workdps(30):
        top, total = mpf(points[24, 2]), mpf(0)
        for k in range(24, 72):
            low, high = mpf(knots[k]), mpf(knots[k + 1])
            for node, weight in zip(nodes.tolist(), weights.tolist(), strict=True):
                share = (1 + mpf(node)) / 2
                # Next to a turning point the place is a square, which makes the rate smooth.
                place, gain = low + (high - low) * share, high - low
                if k == 24:
                    place, gain = low + (high - low) * share**2, 2 * share * (high - low)
                if k == 71:
                    place, gain = high - (high - low) * share**2, 2 * share * (high - low)
                at, rate = _de_boor(spline, k, place)
                speed = mp.sqrt(sum(part**2 for part in rate))
                total += mpf(weight) / 2 * gain * speed / mp.sqrt(2 * mpf("9.81") * (top - at[2]))
    motion = module(points).solve(float(knots[24]))
    assert motion.half_period == pytest.approx(float(total), rel=4e-16)


def _arc_length_at(chart: object, point: np.ndarray) -> float:
    """Return the edge of a chart that is at a point."""
    rows = chart.coordinates(chart.edges).T
    return float(chart.edges[np.abs(rows - point).max(axis=1).argmin()])


def _de_boor(spline: object, k: int, place: mpf) -> tuple[list[mpf], list[mpf]]:
    """Return a quintic spline and its derivative between its points k and k+1."""
    t, c, degree = spline.t, spline.c, 5
    j = int(np.clip(np.searchsorted(t, t[degree] + 0.0, side="right") - 1, degree, None))
    while j < len(t) - degree - 2 and mpf(float(t[j + 1])) <= place:
        j += 1
    values = [[mpf(float(v)) for v in row] for row in c[j - degree : j + 1]]
    slopes = [[mpf(0)] * 3 for _ in values]
    for order in range(1, degree + 1):
        for i in range(degree, order - 1, -1):
            left, right = mpf(float(t[j - degree + i])), mpf(float(t[j + 1 + i - order]))
            share = (place - left) / (right - left)
            for axis in range(3):
                change = values[i][axis] - values[i - 1][axis]
                slopes[i][axis] = (
                    slopes[i - 1][axis] + (slopes[i][axis] - slopes[i - 1][axis]) * share + change / (right - left)
                )
                values[i][axis] = values[i - 1][axis] + change * share
    return values[degree], slopes[degree]


LINE = [(float(k), 0.5 * k, -1.0 * k) for k in range(9)]


@pytest.mark.parametrize(
    ("points", "options", "message"),
    [
        (LINE[:5], {}, "5 different points; an open track of kind 'spline' needs 6 or more"),
        ([*LINE[:4], LINE[3], *LINE[4:]], {}, "row 5: repeats row 4; leave one of them out"),
        ([*LINE[:4], (4.0, np.float64("nan"), -4.0), *LINE[5:]], {}, "row 5: nan is not finite"),
        ([*LINE[:4], (4.0, 2.0), *LINE[5:]], {}, "row 5: must be three numbers, x, y and z, as in row 1, got"),
        ([(*row, 0.0) for row in LINE], {}, "row 1: must be two numbers, x and z, or in space three, x, y and z, got"),
        ([*LINE[:4], (1.0, 0.5, 9.0), *LINE[5:]], {}, r"row \d: the track turns by 1\d\d degrees there"),
        (LINE, {"kind": "linear", "roll": 0}, "roll: a track of kind 'linear' has corners"),
    ],
)
def test_bad_points_are_refused(points: object, options: dict[str, object], message: str) -> None:
    """Bad points are refused with their row, counted from 1."""
    with pytest.raises(DeclarationError, match=f"^sampled: {message}"):
        gqm.Curve.sampled(points, **options)


def test_a_table_with_a_column_y(tmp_path: Path) -> None:
    """A table with a column y is a track in space, in a module too, and a launch is by arc length."""
    table = dict(zip("xyz", np.array(LINE).T.tolist(), strict=True))
    curve = gqm.Curve.sampled(table)
    assert curve.in_space
    assert curve == gqm.Curve.sampled(LINE)
    assert not gqm.Curve.sampled({"x": table["x"], "z": table["z"]}).in_space
    built = gqm.build(gqm.derive(curve, gqm.Gravity()), name="line_in_space", folder=tmp_path)
    assert built.solve(0.0).state(1.0).y > 0.0
    with pytest.raises(LaunchError, match="point: is for planar curves; launch on this track in space by lam0"):
        built.solve(point=(0.0, 0.0))


@pytest.mark.extended
def test_half_periods_in_a_vertical_plane() -> None:
    """Points over the line y = 3x/4 are a planar track: the same half periods, but for the rounding of knots."""
    steps = [k / 4 for k in range(-8, 9)]
    height = [x**2 / 2 + x**3 / 32 for x in steps]
    flat = module([(1.25 * x, z) for x, z in zip(steps, height, strict=True)])
    inclined = module([(x, 0.75 * x, z) for x, z in zip(steps, height, strict=True)])
    launches = [1.1, 2.0, 2.9, 3.7, 4.4]
    for launch, value in zip(launches, inclined.sweep("half_period", launches).values, strict=True):
        expected = flat.solve(launch).half_period
        assert inclined.solve(launch).half_period == pytest.approx(expected, rel=ULP)
        assert value == pytest.approx(expected, rel=2 * ULP)
