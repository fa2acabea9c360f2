"""Loads on riders of tracks through measured points in space agree with Newton's law and the curves of the points."""

from itertools import pairwise
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym.building import transient
from gqm_sym.errors import DeclarationError
from gqm_sym.runtime.charts.chart import SpaceChart
from gqm_sym.runtime.charts.sampled import Sampled

G0 = 9.80665
RADIUS, TILT = 5.0, 0.4
HEIGHT = 0.9


def ring(count: int) -> np.ndarray:
    """Return points of a tilted circle, with a roll angle that grows by one turn in each lap."""
    u = 2.0 * np.pi * np.arange(count) / count
    places = RADIUS * np.stack([np.cos(u), np.cos(TILT) * np.sin(u), np.sin(TILT) * np.sin(u)], axis=1)
    return np.column_stack([places, 0.3 + u + 0.2 * np.sin(u)])


def derivatives(chart: SpaceChart, s: np.ndarray) -> np.ndarray:
    """Return x, y, z and the roll angle at arc lengths with their first three derivatives, as (4, 4, n)."""
    return np.stack([chart.derivatives(s, order) for order in range(4)])


def chart_of(points: np.ndarray, *, closed: bool) -> SpaceChart:
    """Return the chart of points with roll angles."""
    text = "\n".join(" ".join(map(repr, row)) for row in points.tolist())
    chart = Sampled(text, closed=closed, in_space=True, banked=True).chart(())
    assert isinstance(chart, SpaceChart)
    return chart


def test_charts_converge_to_their_curve() -> None:
    """The coordinates, the roll and their first three derivatives converge at their orders; a lap adds whole turns to
    the roll.
    """
    errors = []
    for count in (48, 96, 192):
        chart = chart_of(ring(count), closed=True)
        s = np.linspace(0.0, chart.period, 1000, endpoint=False)
        found, u = derivatives(chart, s), s / RADIUS
        waves = [(np.cos(u), np.sin(u)), (-np.sin(u), np.cos(u)), (-np.cos(u), -np.sin(u)), (np.sin(u), -np.cos(u))]
        turned = [u + 0.3, np.ones_like(u), 0.0, 0.0]
        for order, (cosine, sine) in enumerate(waves):
            true = RADIUS * np.stack([cosine, np.cos(TILT) * sine, np.sin(TILT) * sine, 0.2 / RADIUS * sine])
            true[3] += turned[order]
            errors.append(np.abs(found[order] - true / RADIUS**order).max())
    for order, least in enumerate((60.0, 30.0, 15.0, 7.5)):
        one, two, three = errors[order::4]
        assert one <= 1e-6
        assert min(one / two, two / three) >= least, order


@pytest.fixture(scope="module")
def banked() -> ModuleType:
    """Return the tilted circle through 384 points, banked by an angle at each, under gravity."""
    points = ring(384)
    curve = gqm.Curve.sampled(points[:, :3], closed=True, roll=points[:, 3], heartline="h", parameters={"h": HEIGHT})
    return transient(gqm.derive(curve, gqm.Gravity()))


def newton(rows: Any, w: Any) -> tuple[list[Any], Any]:
    """Return loads and the rider's upward direction by Newton's law, from place, roll and their derivatives at one
    place.
    """
    tangent, bend = mp.matrix(rows[1][:3]), mp.matrix(rows[2][:3])
    up = mp.matrix([0, 0, 1])
    felt = w * bend + mpf("9.81") * (up - tangent * tangent[2])
    left = mp.matrix([-tangent[1], tangent[0], 0])
    left /= mp.norm(left)
    above = mp.matrix([-tangent[2] * left[1], tangent[2] * left[0], tangent[0] * left[1] - tangent[1] * left[0]])
    upright = above * mp.cos(rows[0][3]) + left * mp.sin(rows[0][3])
    beside = left * mp.cos(rows[0][3]) - above * mp.sin(rows[0][3])
    loads = [sum(felt[k] * axis[k] for k in range(3)) / mpf(G0) for axis in (upright, beside)]
    return loads, upright


@pytest.mark.extended
def test_loads_are_those_of_newton(banked: ModuleType) -> None:
    """Loads of states and of the load map, their rates and the track below the rider are right to rounding."""
    motion = banked.solve(0.0, 14.0)
    assert motion.kind == "circulation"
    state = motion.state(np.linspace(0.05, 1.7 * motion.period, 9))
    found = derivatives(motion.problem.formulas.chart.chart(()), np.mod(state.lam, motion.problem.period))
    path = banked.pass1(state.lam, lam0=0.0, v0=14.0)
    for k in range(state.t.size):
        with mp.workdps(40):
            rows = [[mpf(value) for value in row] for row in found[:, :, k].tolist()]
            w, v = mpf(state.v2[k]), mpf(state.v[k])
            loads, upright = newton(rows, w)

            def nearby(h: Any, load: int, rows: Any = rows, w: Any = w) -> Any:
                """Return the load at the distance h along the track."""
                ahead = [[one + h * other for one, other in zip(*pair, strict=True)] for pair in pairwise(rows)]
                return newton(ahead, w - 2 * mpf("9.81") * rows[1][2] * h)[0][load]

            onsets = [v * mp.diff(lambda h, load=load: nearby(h, load), 0) for load in range(2)]
            below = [rows[0][axis] - mpf(HEIGHT) * upright[axis] for axis in range(3)]
        for shown in (state, path):
            assert [shown.n_vertical[k], shown.n_lateral[k]] == pytest.approx([float(n) for n in loads], rel=1e-13)
            assert [shown.onset_vertical[k], shown.onset_lateral[k]] == pytest.approx(
                [float(onset) for onset in onsets], rel=1e-12
            )
            track = [shown.track_x[k], shown.track_y[k], shown.track_z[k]]
            assert track == pytest.approx([float(part) for part in below], rel=1e-13, abs=1e-14)
        assert np.cos(state.roll[k] - found[0, 3, k]) == pytest.approx(1.0, abs=1e-14)


@pytest.mark.extended
def test_loads_and_levels_of_the_circle(banked: ModuleType) -> None:
    """Loads and levels are those of the circle itself, with known tangent, curvature and V**2, to the points' order."""
    motion = banked.solve(0.0, 14.0)

    def vertical(u: np.ndarray) -> np.ndarray:
        w = 14.0**2 - 2.0 * 9.81 * RADIUS * np.sin(TILT) * np.sin(u)
        inward = -np.stack([np.cos(u), np.cos(TILT) * np.sin(u), np.sin(TILT) * np.sin(u)])
        ahead = np.stack([-np.sin(u), np.cos(TILT) * np.cos(u), np.sin(TILT) * np.cos(u)])
        felt = w / RADIUS * inward + 9.81 * (np.array([[0.0], [0.0], [1.0]]) - ahead[2] * ahead)
        left = np.stack([-ahead[1], ahead[0], np.zeros_like(u)]) / np.hypot(ahead[0], ahead[1])
        roll = 0.3 + u + 0.2 * np.sin(u)
        return (felt * (np.cross(ahead, left, axis=0) * np.cos(roll) + left * np.sin(roll))).sum(axis=0) / G0

    u = 2.0 * np.pi * (np.arange(200_000) + 0.5) / 200_000
    rate = np.sqrt(14.0**2 - 2.0 * 9.81 * RADIUS * np.sin(TILT) * np.sin(u))
    times = 2.0 * np.pi / 200_000 * RADIUS / rate
    assert motion.period == pytest.approx(times.sum(), rel=1e-12)
    assert motion.n_vertical_max.value == pytest.approx(vertical(u).max(), rel=1e-9)
    for level in (-2.0, 0.0, 3.0):
        found = motion.exceedance("vertical", level)
        assert found.total == pytest.approx(times[vertical(u) > level].sum(), abs=4.0 * times.max())


def test_formulas_along_points() -> None:
    """A roll angle may be a formula in arc length with parameters, or the one without lateral force."""
    points = ring(48)[:, :3]
    leaning = gqm.derive(gqm.Curve.sampled(points, closed=True, roll="psi*s/5"), gqm.Gravity())
    assert leaning.units["psi"] == "1/m"
    level = gqm.derive(gqm.Curve.sampled(points, closed=True, roll="coordinated", heartline="h"), gqm.Gravity())
    assert level.units["h"] == "m"
    assert level.rider is not None
    assert level.rider.loads[1] == 0
    table = dict(zip(("x", "y", "z", "roll"), ring(48).T, strict=True))
    assert gqm.Curve.sampled(table) == gqm.Curve.sampled(ring(48)[:, :3], roll=ring(48)[:, 3])
    assert gqm.Curve.sampled(table, roll="coordinated").banking.angle is None


def test_angles_are_determined_up_to_whole_turns() -> None:
    """An angle that jumps by a turn from point to point is the same roll."""
    points = ring(48)
    wrapped = np.column_stack([points[:, :3], np.remainder(points[:, 3] + np.pi, 2.0 * np.pi) - np.pi])
    s = np.linspace(0.0, 31.0, 50)
    one, two = (derivatives(chart_of(given, closed=True), s)[:, 3] for given in (points, wrapped))
    assert two == pytest.approx(one, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"roll": [0.1, 0.2, 0.3]}, "roll: must be an angle for each point, got 3 for 48"),
        ({"roll": [0.1] * 47 + [float("nan")]}, "row 48: nan is not finite"),
        ({"roll": {"at": 1}}, "roll: must be an angle for each point, a formula in s or 'coordinated', got"),
        ({"roll": ("flat", 3)}, r"roll: must be an angle, 'coordinated' or \('coordinated', speed\)"),
        ({"roll": "pieces"}, "roll: 'pieces' is the roll of the pieces of a rail"),
        ({"heartline": "9/10"}, "heartline: 9/10 is measured across the banked track; declare roll too"),
    ],
)
def test_rolls_that_are_none(options: dict[str, Any], message: str) -> None:
    """Each declaration that is no roll is refused with a reason."""
    with pytest.raises(DeclarationError, match=f"^sampled: {message}"):
        gqm.Curve.sampled(ring(48)[:, :3], **options)


@pytest.mark.parametrize("roll", ["coordinated", [0.1] * 48])
def test_planar_tracks_are_not_banked(roll: Any) -> None:
    """Banking of planar tracks is refused, because lateral loads on riders are known for tracks in space only."""
    with pytest.raises(DeclarationError, match=r"^sampled: roll: is for tracks in space; give rows of x, y and z"):
        gqm.Curve.sampled(ring(48)[:, [0, 2]], roll=roll)


@pytest.mark.extended
def test_work_of_friction_over_a_circuit() -> None:
    """Along a circuit of surveyed points the lost energy is the work of friction, by Gauss's rule between the points,
    with the contact force by Newton's law from the derivatives of the track.
    """
    mu, g, speed = 0.02, 9.81, 24.0
    u = 2.0 * np.pi * np.arange(96) / 96
    across, along, up = 32 * np.cos(u) + 8 * np.cos(2 * u), 50 * np.sin(u), 9 * np.cos(u) + 4 * np.cos(3 * u)
    points = np.stack([across, along, up], axis=1)
    curve = gqm.Curve.sampled(points, closed=True)
    module = transient(gqm.derive(curve, gqm.Gravity() + gqm.CoulombFriction()))
    motion = module.solve(0, speed, mu=mu, g=g, t_max=100)
    chart = motion.problem.formulas.chart.chart(())
    edges = np.array([motion.time_at(place) if place else 0.0 for place in np.append(chart.edges[:-1], chart.period)])
    nodes, weights = np.polynomial.legendre.leggauss(12)
    half = np.diff(edges)[:, None] / 2
    times = edges[:-1, None] + half * (nodes + 1)
    state = motion.state(times)
    _, ahead, bend = (chart.derivatives(state.lam.ravel(), order)[:3] for order in range(3))
    force = state.v2.ravel() * bend + g * (np.array([[0.0], [0.0], [1.0]]) - ahead[2] * ahead)
    work = mu * (np.linalg.norm(force, axis=0).reshape(times.shape) * np.abs(state.v) * weights * half).sum()
    assert motion.energy(edges[-1]).lost == pytest.approx(work, rel=1e-13)
    end = motion.state(edges[-1])
    assert [end.x, end.y, end.z] == pytest.approx(points[0], abs=1e-12)
    assert (speed**2 - end.v2) / 2 == pytest.approx(work, rel=1e-13)
