"""Digits are right for extreme motions: near separatrices, tiny, flat, eccentric, far from unit size, and late."""

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import sympy as sp
from mpmath import mp, mpf
from naive import error, overstatement, ulps
from paths import DATA
from problems import TRACKS, Track

import gqm_sym as gqm
from gqm_sym.errors import SolutionError

# The tolerances of half periods: nearly all are within 1 unit in the last place, all within 2. Worst measured: 0.5.
MOST_ULPS, MOST_SHARE = 1.0, 0.95
ALL_ULPS = 2.0

# The tolerances of positions at any time, relative to their scales (MATHS, section 7). The coordinates of a short arc
# far from the origin are rounded to more than that of its extent: to so many units in the last place of the coordinate
# and of the parameter.
POSITION = 8e-15
COORDINATE_ULPS = 2.0

TURNING_POINT_ULPS = 1.0

# The largest ratio of the error bound to the larger of a last place of the scale and the decade's largest error.
USEFUL = 100.0

OWN = (
    Track(name="double_well_of", x="lam", z="p*lam**4 - q*lam**2", parameters=("p", "q")),
    Track(name="sextic", x="lam", z="lam**6"),
    Track(name="hilltop", x="lam", z="-(lam - 1)**2"),
    Track(name="cubic_well", x="lam", z="lam**3 - 3*lam"),
    Track(name="kepler", x="cos(lam) - f", z="h*sin(lam)", parameters=("f", "h"), period="2*pi"),
)
CURVES = TRACKS | {track.name: track for track in OWN}

Expected = dict[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Edge:
    """A launch, and the expected results."""

    slug: str
    track: str
    hard: str
    parameters: dict[str, str]
    launch: Expected
    expected: Expected

    @property
    def lam_scale(self) -> float:
        """Return the scale of the parameter: its largest value on the orbit, or its range."""
        expected = self.expected
        if expected["kind"] == "libration":
            low, high = (float(text) for text in expected["turning_points"])
            return max(abs(low), abs(high), high - low)
        if expected["kind"] == "circulation":
            return 2 * math.pi
        return max(abs(float(row["lam"])) for row in expected["positions"])


EDGES = [Edge(**case) for case in json.loads((DATA / "degenerate.json").read_text(encoding="ascii"))]
EVERY_EDGE = pytest.mark.parametrize("edge", EDGES, ids=[edge.slug for edge in EDGES])
PERIODIC = [edge for edge in EDGES if edge.expected["kind"] != "transit"]

MotionOf = Callable[[Edge], Any]


@pytest.fixture(scope="module")
def edge_motion(generated_folder: Path) -> MotionOf:
    """Return a motion of the table, solved once."""
    built: dict[str, ModuleType] = {}
    solved: dict[str, Any] = {}

    def motion(edge: Edge) -> Any:
        if edge.track not in built:
            force = gqm.CentralForce() if edge.track == "kepler" else gqm.Gravity()
            model = gqm.derive(CURVES[edge.track].declare(), force)
            built[edge.track] = gqm.build(model, name=f"edge_{edge.track}", folder=generated_folder)
        if edge.slug not in solved:
            solved[edge.slug] = built[edge.track].solve(**edge.launch, **edge.parameters)
        return solved[edge.slug]

    return motion


@cache
def coordinates(track: Track) -> Callable[..., tuple[mpf, mpf, mpf]]:
    """Return x, z and ds of a track, from SymPy."""
    names = sp.symbols([track.parameter, *track.parameters], real=True)
    known = {symbol.name: symbol for symbol in names}
    x, z = (sp.sympify(text, locals=known, rational=True) for text in (track.x, track.z))
    return sp.lambdify(names, [x, z, sp.sqrt(sp.diff(x, names[0]) ** 2 + sp.diff(z, names[0]) ** 2)], "mpmath")


def test_the_table_has_what_is_hard() -> None:
    """The table has periodic motions and passages of each extreme kind."""
    assert len(EDGES) >= 45
    assert {edge.expected["kind"] for edge in EDGES} == {"libration", "circulation", "transit"}


@pytest.mark.sample(9)
@EVERY_EDGE
def test_kind_and_turning_points(edge: Edge, edge_motion: MotionOf) -> None:
    """The motion has the kind of the exact launch, and its turning points are the doubles nearest to the exact ones."""
    motion, expected = edge_motion(edge), edge.expected
    assert motion.kind == expected["kind"]
    points = sorted(expected.get("turning_points", ()), key=float)
    assert len(motion.turning_points) == len(points)
    for lam, truth in zip(sorted(motion.turning_points), points, strict=True):
        assert ulps(lam, truth) <= TURNING_POINT_ULPS


@pytest.mark.extended
def test_periods(edge_motion: MotionOf) -> None:
    """Half periods and loop times are right to the last place, a few of them to the last but one."""
    lost = []
    for edge in PERIODIC:
        motion, expected = edge_motion(edge), edge.expected
        if "half_period" in expected:
            lost.append(ulps(motion.half_period, expected["half_period"]))
        else:
            lost.append(ulps(motion.period, expected["loop_time"]))
    assert max(lost) <= ALL_ULPS
    assert sum(u <= MOST_ULPS for u in lost) >= MOST_SHARE * len(lost)


@pytest.mark.sample(6)
@EVERY_EDGE
def test_positions(edge: Edge, edge_motion: MotionOf) -> None:
    """lam, x, z and v are right at any time: early, late, and at times of fast motion."""
    motion, rows = edge_motion(edge), edge.expected["positions"]
    track = CURVES[edge.track]
    state = motion.state([row["t"] for row in rows])
    fastest = max(abs(float(row["v"])) for row in rows)
    with mp.workdps(50):
        given = [mpf(sp.sympify(edge.parameters.get(name, "1"), rational=True).evalf(50)) for name in track.parameters]
        truths = [coordinates(track)(mpf(row["lam"]), *given) for row in rows]
        extent = float(max(max(c) - min(c) for c in list(zip(*truths, strict=True))[:2]))
    for k, row in enumerate(rows):
        along = POSITION * max(edge.lam_scale, abs(float(row["lam"])))
        assert error(motion.lam(row["t"]), row["lam"]) <= along
        assert error(state.lam[k], row["lam"]) <= along
        assert error(state.v[k], row["v"]) <= POSITION * fastest
        x, z, ds = truths[k]
        for actual, expected in ((state.x[k], x), (state.z[k], z)):
            place = math.ulp(float(expected)) + float(ds) * math.ulp(float(row["lam"]))
            assert error(actual, expected) <= POSITION * extent + COORDINATE_ULPS * place


@pytest.mark.sample(3)
@EVERY_EDGE
def test_the_error_bound_is_honest(edge: Edge, edge_motion: MotionOf) -> None:
    """No position has a larger error than ``error_bound`` says."""
    motion = edge_motion(edge)
    for row in edge.expected["positions"]:
        assert error(motion.lam(row["t"]), row["lam"]) <= motion.error_bound(row["t"])


@pytest.mark.sample(18)
@EVERY_EDGE
def test_the_error_bound_is_useful(edge: Edge, edge_motion: MotionOf) -> None:
    """The error bound is at most a hundred times the error. The worst ratio measured is 63."""
    rows = [(row["t"], row["lam"]) for row in edge.expected["positions"]]
    assert overstatement(edge_motion(edge), rows, edge.lam_scale) <= USEFUL


@pytest.mark.extended
def test_separatrices_are_ill_conditioned_and_say_so(edge_motion: MotionOf) -> None:
    """A launch within 1e-14 of a hilltop magnifies its own rounding error; the condition number says so, and the
    quadrature adds nothing.
    """
    for edge in EDGES:
        motion = edge_motion(edge)
        assert motion.quadrature_error < 1e-14
        if edge.hard.startswith("1e-14"):
            assert motion.condition_number > 1e5


@pytest.mark.parametrize("short", [1e-3, 1e-6, 1e-9])
def test_a_swing_that_almost_reaches_the_top(short: float, module_of: Callable[[str], ModuleType]) -> None:
    """A body launched at the bottom turns at the place that its energy determines, to the last place of that number."""
    v0 = math.sqrt(4 * 9.81) * (1.0 - short)
    motion = module_of("circle").solve(0, v0, L=1)
    with mp.workdps(40):
        top = 2 * mp.asin(mpf(v0) / (2 * mp.sqrt(mpf("9.81"))))
        assert abs(max(motion.turning_points) - top) <= math.ulp(3.0)
        assert abs(mpf(float(motion.lam(motion.period / 4))) - top) <= 2 * math.ulp(3.0)


@pytest.mark.sample(3)
@pytest.mark.parametrize("g", ["9.81", 9.81, 6.3221])
@pytest.mark.parametrize("v0", [3e-3, 1.2e-7, 5.8e-12, 2.3e-14])
def test_a_slow_launch_from_a_bottom(v0: float, g: Any, module_of: Callable[[str], ModuleType]) -> None:
    """The bottom is not taken for a barrier that was passed. ``make soak`` found turning points 35 times as far out."""
    with mp.workdps(60):
        height = mpf(v0) ** 2 / (2 * mpf(g))
        flat, round_ = height ** (mpf(1) / 4), mpf(2) * mp.acosh(1 + height / 2)
    swings = (
        (module_of("quartic").solve(0.0, v0, -1, g=g), flat),
        (module_of("catenary").solve(0.0, v0, -1, c=2, g=g), round_),
    )
    for motion, end in swings:
        low, high = motion.turning_points
        assert ulps(low, -end) <= TURNING_POINT_ULPS
        assert ulps(high, end) <= TURNING_POINT_ULPS
        quarter = motion.legs[0].t_end
        assert motion.lam(quarter) == pytest.approx(-float(end), rel=1e-13)
        assert motion.state(quarter / 3.0).v2 <= v0 * v0


@pytest.mark.parametrize("size", [1e-45, pytest.param(1e-80, marks=pytest.mark.extended), 1e-100, 1e-200])
def test_the_smallest_swings(size: float, module_of: Callable[[str], ModuleType]) -> None:
    """A swing to 1e-200 has the half period and the places of small swings, as in a sweep. It counted as rest, and
    smaller ones than 1e-80, and throws of 1e-30 m/s, were refused or counted as asymptotic.
    """
    circle, catenary = module_of("circle"), module_of("catenary")
    with mp.workdps(40):
        half = mp.pi / mp.sqrt(mpf("9.81"))
        there = float(size * mp.cos(mp.sqrt(mpf("9.81")) * mpf(0.3)))
        end = float(mpf(size) / mp.sqrt(mpf("9.81") / 2))
    motion = circle.solve(size, L=1, g="9.81")
    assert ulps(motion.half_period, half) <= MOST_ULPS
    assert ulps(circle.sweep("half_period", size, L=1, g=9.81).values.item(), half) <= MOST_ULPS
    assert motion.turning_points == (size, -size)
    assert motion.lam(0.3) == pytest.approx(there, rel=1e-13, abs=0.0)
    if size > 1e-150:  # V**2 is a double
        thrown = catenary.solve(0, size, c=2, g="9.81")
        assert thrown.turning_points == pytest.approx((end, -end), rel=1e-15, abs=0.0)


def test_speeds_whose_square_is_beyond_doubles(module_of: Callable[[str], ModuleType]) -> None:
    """Such a launch is refused, and there is no largest speed of a motion that reaches no other, in a sweep neither.
    The speed had fewer digits or was 0, a throw counted as rest, and sweeps and motions differed. The half period and
    the contact force of a swing of 1e-158 took 20 seconds, because the speed was the root of a product that underflows.
    """
    circle = module_of("circle")
    speeds = [1e-149, 1e-155, 1e-170]
    swept = circle.sweep("v_max", 0.0, speeds, L=1)
    np.testing.assert_array_equal(swept.values, [1e-149, np.nan, np.nan])
    released = circle.sweep("v_max", [1e-100, 1e-155, 1e-170], L=1, g=9.81)
    np.testing.assert_allclose(released.values, [math.sqrt(9.81) * 1e-100, np.nan, np.nan], rtol=1e-15)
    for size in (1e-155, 1e-158, 1e-170):
        slow = circle.solve(size, L=1, g=9.81)
        with pytest.raises(SolutionError, match="v_max: the speed is below 1e-150 m/s"):
            _ = slow.v_max
        assert slow.v_min == (0.0, 0.0, size)
        assert "_in_multiprecision" not in vars(slow)
        assert slow.normal_force_max.value == slow.normal_force_min.value == 9.81
        assert slow.half_period == pytest.approx(math.pi / math.sqrt(9.81), rel=1e-15)
        assert slow.state(0.25 * slow.period).v == pytest.approx(-math.sqrt(9.81) * size, rel=1e-13, abs=0.0)


@pytest.mark.parametrize("v0", [1e-2, 1e-5, 1e-7, 1e-10])
def test_a_slow_launch_from_a_slope(v0: float, module_of: Callable[[str], ModuleType]) -> None:
    """Although the launch and its turning point are the same place in doubles, the time between them is right:
    sin(lam/2) = k*sn(u).

    Beside what ``make soak`` found, positions after it had errors of up to 1e-9.
    """
    motion = module_of("circle").solve(1.0, v0, 1, L=1, g="9.81")
    with mp.workdps(40):
        g = mpf("9.81")
        m = (1 - mp.cos(1) + mpf(v0) ** 2 / (2 * g)) / 2
        start = mp.ellipf(mp.asin(mp.sin(mpf(1) / 2) / mp.sqrt(m)), m)
        for t in (0.0, 0.1, 0.3, 0.5):
            state = motion.state(t)
            truth = 2 * mp.asin(mp.sqrt(m) * mp.ellipfun("sn", start + mp.sqrt(g) * mpf(t), m=m))
            assert abs(mpf(state.lam) - truth) <= state.error, (t, float(mpf(state.lam) - truth))
            assert state.error <= 2.0 * POSITION


@pytest.mark.extended
@pytest.mark.parametrize(("exponent", "side"), [(15, 1), (17, -1), (20, 1), (30, 1), (30, -1), (40, 1)])
def test_from_beside_the_top(exponent: int, side: int, module_of: Callable[[str], ModuleType]) -> None:
    """A launch next to the top is right on either side, whichever double is nearest (on one side it failed)."""
    near = f"1/10**{exponent}"
    motion, other = (module_of("circle").solve(f"{side}*(pi {sign} {near})", L=1) for sign in "-+")
    with mp.workdps(100):
        half = 2 * mp.ellipk(mp.cos(mpf(10) ** -exponent / 2) ** 2) / mp.sqrt(mpf("9.81"))
        ends = float(mp.pi - mpf(10) ** -exponent), float(mp.pi + mpf(10) ** -exponent)
        far = float(3 * mp.pi - mpf(10) ** -exponent)
    assert ulps(motion.half_period, half) <= MOST_ULPS
    assert motion.turning_points == (side * ends[0], -side * ends[0])
    assert ulps(other.half_period, half) <= MOST_ULPS
    assert other.turning_points == (side * ends[1], side * far)


def test_nearer_to_the_top_than_can_be_told(module_of: Callable[[str], ModuleType]) -> None:
    """A launch nearer to the top than 80 digits of V**2 can tell is refused, and the message says what would be right
    (V**2 was divided by although it was zero).
    """
    with pytest.raises(SolutionError, match="launch a little farther from the equilibrium"):
        module_of("circle").solve("pi - 1/10**60", L=1).lam(1.0)
