"""Rails put together from pieces agree with Fresnel integrals, closed forms and an integration in time."""

import math
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import ellipk, mp, mpc, mpf
from railed import LOOP, built, chart_of
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import gqm_sym as gqm

ULP = 2.0**-52
G = 9.81


@cache
def standard_step(angle: mpf, first: mpf, bent: mpf, part: mpf) -> mpc:
    """Return the vector over a length of a segment, the same for all places behind the segment."""
    steps = mp.linspace(0, part, 2 + int(abs(first) * part + abs(first + 2 * bent * part) * part))
    return mp.quad(lambda t: mp.expj(angle + first * t + bent * t * t), steps, method="gauss-legendre")


def standard_truth(segments: list[tuple[mpf, mpf, mpf]], s: mpf, x: mpf, z: mpf, angle: mpf) -> tuple[mpf, ...]:
    """Return x, z, angle and curvature along lengths with given end curvatures, by quadrature in 30 digits."""
    for length, first, last in segments:
        part = min(length, s)
        bent = (last - first) / (2 * length)
        step = standard_step(angle, first, bent, part)
        x, z, angle, s = x + step.real, z + step.imag, angle + first * part + bent * part * part, s - part
        if s <= 0:
            break
    return x, z, angle, first + 2 * bent * part


def test_standard_pieces(tmp_path: Path) -> None:
    """Every row is right to rounding for lines, arcs in both directions and clothoids through zero curvature in
    sequence.
    """
    module = built(
        tmp_path,
        "standard",
        [
            gqm.line(length="2/3"),
            gqm.clothoid(length=2, kappa_start=0, kappa_end="1/R"),
            gqm.arc(radius="R", angle="3*pi/2"),
            gqm.clothoid(length="3", kappa_start="1/R", kappa_end=-1.5),
            gqm.arc(radius=2, angle="-turn"),
        ],
        start=(1, "-1/3"),
        heading="pi/6",
        parameters={"R": "7/5", "turn": 9},
    )
    chart = chart_of(module)
    with mp.workdps(30):
        bend = mpf(5) / 7
        segments = [
            (mpf(2) / 3, mpf(0), mpf(0)),
            (mpf(2), mpf(0), bend),
            (3 * mp.pi / 2 / bend, bend, bend),
            (mpf(3), bend, mpf("-1.5")),
            (mpf(18), mpf("-0.5"), mpf("-0.5")),
        ]
        ends = [sum(length for length, _, _ in segments[: k + 1]) for k in range(5)]
        assert abs(chart.high - ends[-1]) <= 2 * ULP * chart.high
        assert np.abs(chart.breaks - np.array([float(end) for end in ends[:-1]])).max() <= 2 * ULP * chart.high
        for s in np.linspace(0.01, chart.high - 0.01, 60):
            truth = standard_truth(segments, mpf(float(s)), mpf(1), -mpf(1) / 3, mp.pi / 6)
            row = chart.points([s])[:, 0]
            assert abs(mp.mpc(row[0] - truth[0], row[1] - truth[1])) <= 20 * ULP
            assert abs(row[2] - truth[2]) <= 4 * ULP * (1 + abs(truth[2])) + ULP * s
            assert abs(row[3] - truth[3]) <= 4 * ULP + ULP * s
    assert chart.corners.size == 0


def test_a_ring_is_a_circle(tmp_path: Path) -> None:
    """A closed arc all the way round has the pendulum's half period, and the loop time of a fast round."""
    module = built(tmp_path, "ring", [gqm.arc(radius="R", angle="2*pi")], closed=True, parameters={"R": 2})
    chart = chart_of(module)
    assert chart.period == chart.high
    with mp.workdps(30):
        half = 2 * mp.sqrt(mpf(2) / mpf("9.81")) * ellipk(mp.sin(mpf("0.5")) ** 2)
        # V**2 = 100 (1 - k sin(angle/2)**2)
        around = 2 * 2 * 2 / mpf(10) * ellipk(8 * mpf("9.81") / 100)
    assert abs(module.solve(lam0=2.0).half_period - half) <= 8 * ULP * half
    loop = module.solve(lam0=0.0, v0=10.0)
    assert loop.kind == "circulation"
    assert abs(loop.period - around) <= 8 * ULP * loop.period


def test_a_curve_among_pieces(tmp_path: Path) -> None:
    """A parabola between a line and an arc is right to rounding, in arc length and with its own place."""
    pieces = [
        gqm.line(length="sqrt(5)"),
        gqm.Curve.graph("a*x**2", domain=(-1, 1), parameters={"a": 1}),
        gqm.arc(radius=1, angle=-1),
    ]
    module = built(tmp_path, "mixed", pieces, start=(-2, 3), heading="-atan(2)")
    chart = chart_of(module)

    def length(x: mpf) -> mpf:
        return (2 * x * mp.sqrt(1 + 4 * x**2) + mp.asinh(2 * x)) / 4

    with mp.workdps(30):
        for x in np.linspace(-1.0, 1.0, 23):
            s = mp.sqrt(5) + length(mpf(1)) + length(mpf(float(x)))
            row = chart.points([float(s)])[:, 0]
            assert abs(row[0] - x) <= 4 * ULP
            assert abs(row[1] - x * x) <= 8 * ULP
            # A place has an error of an ulp, over which the angle turns by up to twice that.
            assert abs(row[2] - mp.atan(2 * mpf(float(x)))) <= 4 * ULP + 2 * ULP * s
            if abs(x) < 1.0:  # curvature jumps at the joints
                assert abs(row[3] - 2 / (1 + 4 * mpf(float(x)) ** 2) ** mpf(1.5)) <= 16 * ULP + 4 * ULP * s
    motion = module.solve(lam0=float(mp.sqrt(5)), v0=0.0)
    parabola = gqm.build(gqm.derive(gqm.Curve.graph("x**2"), gqm.Gravity()), name="parabola", folder=tmp_path).solve(
        lam0=-1.0
    )
    assert abs(motion.half_period - parabola.half_period) <= 1e-14


def test_a_curve_comes_first(tmp_path: Path) -> None:
    """A first piece with formulas determines where the rail starts; parametric and polar curves may be pieces too, up
    to whole turns.
    """
    pieces = [
        gqm.Curve.parametric(x="2*sin(u)", z="-2*cos(u)", parameter="u", domain=("-pi/2", "5*pi/2")),
        gqm.Curve.polar("2", parameter="theta", domain=(0, "pi/2")),
        gqm.line(length=1),
    ]
    chart = chart_of(built(tmp_path, "first", pieces))
    x, z, alpha, kappa = chart.points([0.0, chart.high, chart.high - 1.5])
    assert np.abs(x[:2] - [-2.0, -1.0]).max() <= 16 * ULP
    assert np.abs(z[:2] - [0.0, 2.0]).max() <= 16 * ULP
    assert np.abs(alpha[:2] - [-math.pi / 2.0, 3.0 * math.pi]).max() <= 16 * ULP
    assert abs(kappa[2] - 0.5) <= 8 * ULP


def test_a_stadium(tmp_path: Path) -> None:
    """On two lines and two half circles, closed and upright, the time of a round agrees with constant acceleration and
    quadrature.
    """
    pieces = [gqm.line(length=3), gqm.arc(radius=1, angle="pi")] * 2
    module = built(tmp_path, "stadium", pieces, closed=True)
    joints = [0.0, 3.0, 3.0 + math.pi, 6.0 + math.pi]  # the curvature jumps at the start too
    chart = chart_of(module)
    assert chart.breaks == pytest.approx(joints, abs=8 * ULP)
    one, two = chart.points([0.5, 0.5 + chart.high])[2]
    assert two - one == pytest.approx(2.0 * math.pi, rel=4 * ULP)
    motion = module.solve(lam0=1.0, v0=8.0)
    with mp.workdps(30):
        top = mp.sqrt(64 - 4 * mpf("9.81"))
        bend = mp.quad(lambda a: 1 / mp.sqrt(64 - 2 * mpf("9.81") * (1 - mp.cos(a))), mp.linspace(0, mp.pi, 5))
        around = mpf(3) / 8 + 3 / top + 2 * bend
    assert motion.kind == "circulation"
    assert abs(motion.period - around) <= 8 * ULP * around


# The loop has these lengths of lines and clothoids, and this radius.
LINE, EASE, RADIUS = 2.0, 2.0, 1.5


@pytest.fixture(scope="module")
def loop(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """Return the rail of a loop."""
    return built(tmp_path_factory.mktemp("loop"), "loop", LOOP, parameters={"a": 2, "c": 2, "R": "3/2"})


def bend_at(s: float) -> float:
    """Return the curvature along the loop, as it was declared."""
    around = RADIUS * 2.0 * math.pi - EASE
    if s < LINE:
        return 0.0
    if s < LINE + EASE:
        return (s - LINE) / EASE / RADIUS
    if s < LINE + EASE + around:
        return 1.0 / RADIUS
    if s < LINE + 2.0 * EASE + around:
        return (LINE + 2.0 * EASE + around - s) / EASE / RADIUS
    return 0.0


def integrated(speed: float) -> Any:
    """Integrate the motion along the loop as an initial value problem: x, z, angle, s and V, piece by piece."""
    ends = np.cumsum([LINE, EASE, RADIUS * 2.0 * math.pi - EASE, EASE, LINE])
    state, t, runs = np.array([0.0, 0.0, 0.0, 0.0, speed]), 0.0, []
    for end in ends:

        def rates(_: float, y: np.ndarray, high: float = end) -> list[float]:
            v = y[4]
            kappa = bend_at(min(y[3], high - 1e-13))
            return [v * math.cos(y[2]), v * math.sin(y[2]), v * kappa, v, -G * math.sin(y[2])]

        def arrived(_: float, y: np.ndarray, high: float = end) -> float:
            return float(y[3] - high)

        arrived.terminal = True
        run = solve_ivp(
            rates, (t, t + 10.0), state, method="DOP853", rtol=1e-13, atol=1e-13, events=arrived, dense_output=True
        )
        runs.append(run)
        state, t = run.y[:, -1], float(run.t[-1])
    return runs


@pytest.mark.extended
def test_force_along_a_loop(loop: ModuleType) -> None:
    """Time, place, speed and N along the loop agree with an integration in time; N is smallest at the top."""
    motion = loop.solve(lam0=0.0, v0=9.3)
    runs = integrated(9.3)
    assert abs(motion.legs[-1].t_end - runs[-1].t[-1]) <= 1e-11
    least = math.inf
    for run in runs:
        t = np.linspace(run.t[0], run.t[-1], 42)[1:-1]
        x, z, angle, s, v = run.sol(t)
        force = G * np.cos(angle) + np.array([bend_at(place) for place in s]) * v**2
        state = motion.state(t)
        for got, want in ((state.x, x), (state.z, z), (state.s, s), (state.v, v)):
            assert np.abs(got - want).max() <= 2e-11
        assert np.abs(state.normal_force - force).max() <= 1e-9
        least = min(least, force.min())
    s = np.linspace(0.0, chart_of(loop).high, 20_001)
    forces = loop.pass1(s, lam0=0.0, v0=9.3).normal_force
    top = LINE + EASE + 0.5 * (RADIUS * 2.0 * math.pi - EASE)
    assert abs(s[np.argmin(forces)] - top) <= s[1]
    assert forces.min() <= least + 1e-9


def test_launch_speed_that_keeps_contact(loop: ModuleType) -> None:
    """A slower body leaves a unilateral rail at the top, where N vanishes according to the integration."""
    with mp.workdps(30):
        # The height of the top follows from the Fresnel integrals of the clothoid.
        size, ease, radius = mp.sqrt(2 * mpf(EASE) * RADIUS), mpf(EASE), mpf(RADIUS)
        turned = ease / (2 * radius)
        rise = size * mp.quad(lambda w: mp.sin(w * w), [0, ease / size])
        height = rise + radius * (1 + mp.cos(turned))
        least = mp.sqrt(2 * mpf("9.81") * height + mpf("9.81") * radius)
    for share, kept in ((1e-12, True), (-1e-12, False)):
        motion = loop.solve(lam0=0.0, v0=float(least) * (1.0 + share), contact="above")
        assert (motion.events[-1].kind == "domain-end") is kept
        if not kept:
            assert motion.events[-1].kind == "liftoff"
    lost = loop.solve(lam0=0.0, v0=0.97 * float(least), contact="above").events[-1]
    assert lost.kind == "liftoff"
    run = integrated(0.97 * float(least))[2]

    def force(t: float) -> float:
        _, _, angle, s, v = run.sol(t)
        return G * math.cos(angle) + bend_at(s) * v**2

    assert abs(lost.t - brentq(force, run.t[0], 0.5 * (run.t[0] + run.t[-1]), xtol=1e-15)) <= 1e-10


@pytest.mark.extended
@pytest.mark.parametrize(("s0", "v0"), [(2.5, 1e-5), (2.5, 1e-8), (1.0 - 2.0**-30, 0.0)])
def test_slow_motion_along_a_level_line(s0: float, v0: float, tmp_path: Path) -> None:
    """Between two arcs a body turns after a pendulum's quarter period on each, however slowly it crosses the line.

    On the arcs of radius R it is a pendulum, with sin(amplitude/2)**2 = E/(2 g R); on the line its speed is sqrt(2 E).
    """
    pieces = [gqm.arc(radius=2, angle="1/2"), gqm.line(length=3), gqm.arc(radius=2, angle="1/2")]
    rail = gqm.Curve.piecewise(pieces, heading="-1/2")
    motion = gqm.build(gqm.derive(rail, gqm.Gravity()), name="level_line", folder=tmp_path).solve(s0, v0, 1)
    with mp.workdps(40):
        g, before = mpf("9.81"), max(1 - mpf(s0), 0) / 2
        energy = mpf(v0) ** 2 / 2 + 4 * g * mp.sin(before / 2) ** 2
        k = mp.sqrt(energy / (4 * g))
        truth = 2 * mp.sqrt(2 / g) * ellipk(k * k) + 3 / mp.sqrt(2 * energy)
        away = 4 * mp.asin(k)
        places = sorted(motion.turning_points)
        assert motion.kind == "libration"
        assert abs(places[0] - (1 - away)) <= ULP
        assert abs(places[1] - (4 + away)) <= 4 * ULP
        assert abs(motion.half_period / truth - 1) <= ULP
