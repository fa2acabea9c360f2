"""Charts, which are curves known by numbers only, give the results of the same curves with formulas in all stages."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from types import ModuleType

import numpy as np
import pytest
import sympy as sp
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym.emission import charts
from gqm_sym.emission.ir import ChartIR
from gqm_sym.errors import LaunchError, SolutionError
from gqm_sym.runtime import vocabulary
from gqm_sym.runtime.charts import differences, evaluate
from gqm_sym.runtime.charts.chart import MAGNIFIED, NODES, Chart, PieceData, assemble
from gqm_sym.sympy_charts import chart_x, chart_z

ULP = 2.0**-52
RADIUS = 1.3


@dataclass(frozen=True)
class Ring:
    """The chart of a circle, counter-clockwise from the lowest point, in a given number of pieces."""

    pieces: int = 9
    closed: bool = True
    shaped_by: tuple[int, ...] = (0,)

    def chart(self, p: tuple[float, ...]) -> Chart:
        """Return the chart, with its radius as the first run-time parameter."""
        radius = p[0]
        edges = np.linspace(0.0, 2.0 * np.pi * radius, self.pieces + 1)
        s = edges[:-1, None] + 0.5 * np.diff(edges)[:, None] * (1.0 + NODES)
        start = edges[:-1] / radius
        return assemble(
            edges,
            PieceData(
                anchors=np.stack([radius * np.sin(start), -radius * np.cos(start)], axis=1),
                angles=s / radius,
                curvatures=np.full_like(s, 1.0 / radius),
            ),
            period=edges[-1] if self.closed else 0.0,
            turn=2.0 * np.pi,
        )

    def is_exact(self, chart: Chart) -> bool:
        """Return false, because only the chart is known."""
        return False

    def true_pieces(self, p: object, chart: Chart) -> None:
        """Return None, because the curve is known in doubles only."""


@pytest.mark.parametrize("radius", [1e-3, 1.3, 700.0])
def test_rows_are_off_by_no_more_than_they_may(radius: float) -> None:
    """In each row the changed charts of a circle are farther from it than the chart itself is."""
    chart = Ring().chart((radius,))
    s = np.linspace(0.0, 2.0 * np.pi * radius, 400, endpoint=False)
    angle = s.astype(np.longdouble) / np.longdouble(radius)
    exact = [radius * np.sin(angle), -radius * np.cos(angle), angle, np.full_like(angle, 1.0 / radius)]
    found = chart.points(s)
    for row, block in enumerate(chart.rounded()[:4]):
        changed = replace(chart, block=block).points(s)
        assert np.all(np.abs(found[row] - exact[row]) <= np.abs(changed[row] - found[row]) / MAGNIFIED)
        assert np.array_equal(np.delete(changed, row, 0), np.delete(found, row, 0))


@pytest.fixture(scope="module")
def ring(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ModuleType]:
    """Return a pendulum whose circle is known by its chart only."""
    s = sp.Symbol("s", real=True)
    curve = gqm.Curve(
        kind="ring", x=chart_x(s), z=chart_z(s), parameter=s, defaults=(("R", "13/10"),), definition="a circle"
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(charts.MAKERS, "ring", lambda _: ChartIR(statement="Ring()", imports=("Ring",)))
        patch.setattr(vocabulary, "Ring", Ring, raising=False)
        yield gqm.build(gqm.derive(curve, gqm.Gravity()), name="ring", folder=tmp_path_factory.mktemp("ring"))


@pytest.fixture(scope="module")
def pendulum(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """Return the same pendulum with formulas."""
    curve = gqm.Curve.parametric(x="R*sin(s/R)", z="-R*cos(s/R)", parameter="s", period="2*pi*R", positive=["R"])
    model = gqm.derive(curve, gqm.Gravity(), parameters={"R": "13/10"})
    return gqm.build(model, name="formulas", folder=tmp_path_factory.mktemp("formulas"))


def test_rows() -> None:
    """A chart's rows are those of the curve, lap after lap."""
    chart = Ring().chart((RADIUS,))
    s = np.linspace(-20.0, 20.0, 501)
    x, z, alpha, kappa = chart.points(s)
    # A place reduced by the period has an error of an ulp of the original place.
    assert np.abs(x - RADIUS * np.sin(s / RADIUS)).max() <= 20.0 * ULP
    assert np.abs(z + RADIUS * np.cos(s / RADIUS)).max() <= 20.0 * ULP
    assert np.abs(alpha - s / RADIUS).max() <= 20.0 * ULP
    assert np.abs(kappa - 1.0 / RADIUS).max() <= ULP


@pytest.mark.parametrize("ring_", [Ring(1), Ring(2), Ring(9), Ring(9, closed=False)])
def test_rows_in_any_order(ring_: Ring) -> None:
    """The values of a chart at a place do not depend on the other places of a call, outside of an open curve too."""
    chart, s = ring_.chart((RADIUS,)), np.random.default_rng(5).uniform(-9.0, 12.0, 200)
    one_by_one = np.hstack([chart.points([place]) for place in s])
    for order in (np.arange(s.size), np.argsort(s), np.argsort(-s)):
        assert np.array_equal(chart.points(s[order]), one_by_one[:, order])


@pytest.mark.parametrize("size", [3.0, 0.3, 1e-2, 1e-5, 1e-8])
def test_divided_differences(size: float) -> None:
    """Differences within a piece, over a joint, over many pieces and over the closing point do not cancel."""
    chart = Ring().chart((RADIUS,))
    rng = np.random.default_rng(7)
    period = mpf(chart.period)

    def height(s: mpf) -> mpf:
        return -period / (2 * mp.pi) * mp.cos(2 * mp.pi * s / period)

    with mp.workdps(60):
        for k in range(60):
            a = float(chart.edges[k % 10] - size * rng.uniform() if k % 2 else rng.uniform(-10.0, 10.0))
            b = a + size * rng.uniform()
            c = b + size * rng.uniform()
            first = (height(mpf(b)) - height(mpf(a))) / (mpf(b) - mpf(a))
            second = ((height(mpf(c)) - height(mpf(b))) / (mpf(c) - mpf(b)) - first) / (mpf(c) - mpf(a))
            assert abs(differences.divdiff1_chart_z(chart.block, a, b, b - a) - first) <= 16 * ULP
            # Next to a joint a second difference is a derivative of the fit, which with 16 nodes loses three digits.
            assert abs(differences.divdiff2_chart_z(chart.block, a, b, c, b - a, c - b) - second) <= 4e-13
            swapped = differences.divdiff2_chart_z(chart.block, c, a, b, a - c, b - a)
            assert abs(swapped - second) <= 4e-13


@pytest.mark.extended
@pytest.mark.parametrize("ring_", [Ring(3), Ring(9), Ring(9, closed=False)])
def test_differences_over_one_place_and_many(ring_: Ring) -> None:
    """The differences of height, x and angle over a place and many others, in any order, are those of the circle."""
    chart, rng = ring_.chart((RADIUS,)), np.random.default_rng(11)
    whole = float(chart.edges[-1])
    low, high = (-whole, 2.0 * whole) if ring_.closed else (0.0, whole)
    for start in (0.3 * whole, float(chart.edges[1]), 0.0):
        places = np.concatenate([rng.uniform(low, high, 60), np.sort(start + rng.uniform(0.0, 1e-6, 30))])
        places = places[(places >= low) & (places <= high) & (places != start)]
        gaps, out = places - start, np.zeros((4, places.size))
        differences.chart_differences(chart.block, (1, 0, 2), start, places, gaps, out)
        few = np.zeros((1, 3))
        differences.chart_differences(chart.block, (1,), start, places[-3:], gaps[-3:], few)
        mean, half = (places + start) / (2.0 * RADIUS), gaps / (2.0 * RADIUS)
        sinc = np.sinc(half / np.pi)
        truth = np.stack([np.sin(mean) * sinc, np.cos(mean) * sinc, np.full_like(mean, 1.0 / RADIUS)])
        # A place that is reduced by laps has an error of an ulp of the original place.
        assert np.abs(out[1:] - truth).max() <= 32.0 * ULP
        assert np.abs(few[0] - truth[0, -3:]).max() <= 32.0 * ULP
        assert not out[0].any()


def test_differences_far_from_the_origin() -> None:
    """If coordinates are a million times the distances, differences keep their digits, because constants are two
    doubles.
    """
    edges = np.linspace(0.0, 2.0 * np.pi * RADIUS, 10)
    s = edges[:-1, None] + 0.5 * np.diff(edges)[:, None] * (1.0 + NODES)

    def x(s: float) -> mpf:
        return 10**6 + RADIUS * mp.sin(mpf(s) / RADIUS)

    with mp.workdps(40):
        anchors = np.array([float(x(start)) for start in edges[:-1]])
        rests = np.array([float(x(start) - mpf(float(anchor))) for start, anchor in zip(edges, anchors, strict=False)])
        chart = assemble(
            edges,
            PieceData(
                anchors=np.stack([anchors, -RADIUS * np.cos(edges[:-1] / RADIUS)], axis=1),
                anchor_lows=np.stack([rests, np.zeros(9)], axis=1),
                angles=s / RADIUS,
                curvatures=np.full_like(s, 1.0 / RADIUS),
            ),
        )
        for k in range(6):
            a, b = float(edges[k] + 0.3), float(edges[k + 3] - 0.2)
            assert (
                abs(differences.divdiff1_chart_x(chart.block, a, b, b - a) - (x(b) - x(a)) / (mpf(b) - mpf(a)))
                <= 16 * ULP
            )


def test_two_places_at_one_joint() -> None:
    """If two places differ from a joint by rounding only, the first difference is the slope there."""
    chart = Ring().chart((RADIUS,))
    for edge in map(float, chart.edges[1:-1]):
        beside = np.nextafter(edge, 0.0)
        slope = differences.divdiff1_chart_z(chart.block, beside, edge, 0.1 * (edge - beside))
        assert abs(slope - np.sin(edge / RADIUS)) <= 1e-14


@pytest.mark.parametrize("size", [1e-3, 1e-6, 1e-9])
def test_differences_of_the_angle_across_joints(size: float) -> None:
    """The angle's differences are right across jumps of curvature; the difference of two neighbouring fits is taken for
    rounding, not for a jump.

    A line becomes a clothoid, which winds up, unwinds and becomes a line again, which becomes an arc.
    """
    edges = np.array([0.0, 0.4, 1.1, 1.9, 2.2, 3.0, 4.6, 5.25, 7.5, 8.3, 9.0, 9.9, 10.5])
    s = edges[:-1, None] + 0.5 * np.diff(edges)[:, None] * (1.0 + NODES)
    jump = 9.0

    def angle(s: Fraction) -> Fraction:
        """Return the integral of the curvature."""
        winding = sum(times * max(s - Fraction(at), Fraction(0)) ** 2 for times, at in ((1, 3.0), (-2, 5.25), (1, 7.5)))
        return Fraction(0.3) * winding / 2 + Fraction(0.7) * max(s - Fraction(jump), Fraction(0))

    chart = assemble(
        edges,
        PieceData(
            anchors=np.zeros((edges.size - 1, 2)),
            angles=[[float(angle(Fraction(place))) for place in row] for row in s],
            curvatures=0.3 * np.maximum(2.25 - np.abs(s - 5.25), 0.0) + np.where(s > jump, 0.7, 0.0),
        ),
    )
    for joint in edges[1:-1]:
        for shares in ((-0.7, -0.2, 0.9), (-0.6, 0.3, 0.8)):
            a, b, c = (float(joint) + size * share for share in shares)
            u, v, w = map(Fraction, (a, b, c))
            truth = float(((angle(w) - angle(v)) / (w - v) - (angle(v) - angle(u)) / (v - u)) / (w - u))
            found = differences.divdiff2_chart_alpha(chart.block, a, b, c, b - a, c - b)
            # The tangent is a derivative of the fit, which costs short pieces five digits; distances from the joint
            # count too, with errors of an ulp of the place.
            assert abs(found - truth) <= 2e-11 + abs(truth) * 8 * ULP / size


def test_bounds_enclose() -> None:
    """Coordinates and angle lie within their bounds."""
    chart = Ring().chart((RADIUS,))
    rng = np.random.default_rng(3)
    for low, width in zip(rng.uniform(-9.0, 9.0, 40), rng.uniform(0.0, 4.0, 40), strict=True):
        s = np.linspace(low, low + width, 33)
        rows = chart.points(s)
        for row, enclosure in enumerate((evaluate.ichart_x, evaluate.ichart_z, evaluate.ichart_alpha)):
            lo, hi = enclosure(chart.block, (low, low + width))
            assert lo <= rows[row].min()
            assert rows[row].max() <= hi
            assert hi - lo <= width * max(1.0, 1.0 / RADIUS) * 1.001 + 1e-11


def test_a_line_along_an_axis_has_no_slope() -> None:
    """The angle of such a line is known exactly within the line, whatever the rest of the chart is like."""
    flat, bent = np.zeros(NODES.size), 0.5 * (1.0 + NODES)
    chart = assemble([0.0, 1.0, 2.0], PieceData([[0.0, 0.0], [1.0, 0.0]], [flat, bent], [flat, np.ones(NODES.size)]))
    assert evaluate.ichart_alpha(chart.block, (0.25, 0.75)) == (0.0, 0.0)
    low, high = evaluate.ichart_alpha(chart.block, (0.75, 1.25))
    assert low <= 0.0 <= 0.25 <= high <= 0.51


def test_nearest_point() -> None:
    """The nearest point is the foot of the perpendicular, and its distance is right."""
    s, distance = Ring().chart((RADIUS,)).nearest(0.5, -0.9)
    assert abs(s - RADIUS * np.arctan2(0.5, 0.9)) <= 4 * ULP
    assert abs(distance - (RADIUS - np.hypot(0.5, 0.9))) <= 4 * ULP
    flat = np.zeros((2, NODES.size))
    line = assemble([0.0, 1.0, 2.0], PieceData([[0.0, 0.0], [1.0, 0.0]], flat, flat))
    for x, end in ((-1.0, 0.0), (3.0, 2.0)):  # beyond an end, the end is the nearest point
        assert line.nearest(x, 1.0) == pytest.approx((end, np.sqrt(2.0)), rel=4 * ULP)


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    "launch",
    [
        {"lam0": 1.1, "v0": 0.0},
        {"lam0": -0.4, "v0": 2.5, "direction": -1},
        {"lam0": 4.0, "v0": 0.3},
        {"lam0": 0.2, "v0": 9.0},
    ],
)
def test_motion_as_with_formulas(ring: ModuleType, pendulum: ModuleType, launch: dict[str, float]) -> None:
    """Kind, period, positions and forces are those of the same curve with formulas."""
    one, two = ring.solve(**launch), pendulum.solve(**launch)
    assert one.kind == two.kind
    assert abs(one.period - two.period) <= 6 * ULP * two.period
    t = np.linspace(0.0, 5.0, 60) * two.period
    got, want = one.state(t), two.state(t)
    width = max(np.abs(want.lam).max(), 1e-300)
    assert np.abs(got.lam - want.lam).max() <= 5e-14 * width
    for name in ("x", "z", "v", "normal_force"):
        a, b = getattr(got, name), getattr(want, name)
        assert np.abs(a - b).max() <= 1e-13 * np.abs(b).max(), name
    assert np.abs(got.s - got.lam).max() <= 4 * ULP * np.abs(got.lam).max()
    assert np.all(np.abs(got.lam - want.lam) <= one.error_bound(t) + two.error_bound(t))


def test_small_swings(ring: ModuleType, pendulum: ModuleType) -> None:
    """On swings small against a piece, V**2 depends on the curvature of the fit, which has three digits less."""
    assert abs(ring.solve(lam0=1e-6).period - pendulum.solve(lam0=1e-6).period) <= 1e-12


def test_pass1(ring: ModuleType, pendulum: ModuleType) -> None:
    """Pass 1 reads the chart."""
    s = np.linspace(-3.0, 5.0, 40)
    got, want = ring.pass1(s, lam0=0.3, v0=2), pendulum.pass1(s, lam0=0.3, v0=2)
    for a, b in zip(got, want, strict=True):
        assert np.abs(a - b).max() <= 1e-14 * max(1.0, np.abs(b).max())


def test_launch_by_point(ring: ModuleType) -> None:
    """A launch by a point of the curve is at its place; a point off the curve is refused, and the message gives the
    nearest one.
    """
    s = 0.7
    point = (RADIUS * np.sin(s / RADIUS), -RADIUS * np.cos(s / RADIUS))
    assert abs(ring.solve(point=point).half_period - ring.solve(lam0=s).half_period) <= 4 * ULP
    with pytest.raises(LaunchError, match=r"point: \(0\.5, -0\.9\) is 0\.27 off the curve; the nearest point"):
        ring.solve(point=(0.5, -0.9))
    with pytest.raises(LaunchError, match="lam0, point: give one of them"):
        ring.solve(lam0=s, point=point)
    with pytest.raises(LaunchError, match="point: must be a pair of numbers"):
        ring.solve(point=(1.0, 0.0, 0.0))


def test_equilibria(ring: ModuleType) -> None:
    """A body at rest on top or at the bottom stays; the period has no more digits than doubles."""
    assert ring.solve(lam0=0.0).kind == "rest"
    assert ring.solve(lam0=np.pi * RADIUS).kind == "rest"
    with pytest.raises(SolutionError, match="no more digits are known than those of `period`"):
        ring.solve(lam0=1.0).period_to(30)


def test_header_reads_as_a_textbook(ring: ModuleType) -> None:
    """The closed forms name the chart's rows as functions of arc length."""
    text = ring.__doc__ or ""
    assert "N              = m*(g*cos(alpha(s)) + (2*g*(z(lam0) - z(s)) + v0**2)*kappa(s))" in text
    assert "V**2           = 2*g*(z(lam0) - z(s)) + v0**2" in text
