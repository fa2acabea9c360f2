"""The search finds the first turning point in each direction, however narrow the barrier, and names what ends it."""

import math
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from mpmath import mp, mpf
from selection import examples

import gqm_sym as gqm
from gqm_sym.errors import LaunchError
from gqm_sym.runtime.launch.ends import first_zero_from
from gqm_sym.runtime.launch.problem import bind
from gqm_sym.runtime.launch.request import LaunchRequest, read_launch
from gqm_sym.runtime.launch.zeros import CUSP, LIMIT, STEPS_SPENT, TURN

ModuleOf = Callable[[str], ModuleType]

G = 9.81
# The tolerance of a turning point on a slope of order one: its last places, and those of V**2 over its slope.
TURN_PLACE = 1e-13
EPS = float(np.finfo(float).eps)
# Sampled values closer to zero than this share of v0**2 are left to the exact tests.
CLEAR = 1e-6

FIELDS = {
    "bump": "a*x**2/2 + h*exp(-((x - c)/w)**2)",
    "waves": "a*cos(x) + b*cos(2*x + c) + d*cos(5*x + f)",
    "quintic": "a*x + b*x**2 + c*x**3 + d*x**4 + f*x**5",
}


@pytest.fixture(scope="session")
def field(generated_folder: Any) -> Callable[[str], ModuleType]:
    """Return the module of a landscape z(x) by its name."""
    built: dict[str, ModuleType] = {}

    def module(name: str) -> ModuleType:
        if name not in built:
            model = gqm.derive(gqm.Curve.graph(FIELDS[name], parameter="x"), gqm.Gravity())
            built[name] = gqm.build(model, name=f"field_{name}", folder=generated_folder)
        return built[name]

    return module


def walk(module: ModuleType, lam0: float, v0: float, direction: int, reach: float, **given: float) -> Any:
    """Return the result of a search from a launch: its end, and the places before and beyond."""
    formulas = module.MODEL
    numbers = formulas.numbers(tuple((formulas.parameters | given).values()))
    functions = bind(formulas, numbers, read_launch(formulas, numbers, LaunchRequest(lam0, v0, direction)))
    step = reach / 8 if math.isfinite(reach) else 1.0
    what, near, far = first_zero_from(functions.addresses, functions.p, lam0, v0 * v0, direction, 0.0, reach, step)
    return what, lam0 + near, lam0 + far


@pytest.mark.sample(2)
@pytest.mark.parametrize("width", [1e-3, 1e-4, 1e-5, 1e-6])
@pytest.mark.parametrize("centre", [1.0, 0.123456789, -2.7182818])
@pytest.mark.parametrize("above", [1e-3, 1e-6, 1e-9])
def test_no_narrow_barrier_is_jumped(
    width: float, centre: float, above: float, field: Callable[[str], ModuleType]
) -> None:
    """A bump a thousandth to a millionth wide stops the body if its top is just above the energy, and not if it is just
    below.

    On the floor z = 0 a bump of height h is passed if v0**2 > 2 g h, and else turns the body where h exp(-((x -
    c)/w)**2) = v0**2/(2 g).
    """
    start, height, side = -4.0 * math.copysign(1.0, centre), 1.0, int(math.copysign(1.0, centre))
    bump = {"a": 0.0, "h": height, "c": centre, "w": width}
    over = walk(field("bump"), start, math.sqrt(2 * G * height * (1 + above)), side, 9.0, **bump)
    assert over[0] == LIMIT
    v0 = math.sqrt(2 * G * height * (1 - above))
    what, place, _ = walk(field("bump"), start, v0, side, 9.0, **bump)
    with mp.workdps(30):
        level = mpf(v0) ** 2 / (2 * mpf("9.81"))
        away = mp.sqrt(-mp.log(level))
        truth = mpf(centre) - side * mpf(width) * away
        # The tolerance is the rounding of the energy over the slope there, and that of the place.
        allowed = 2.0**-52 * (8 + width / float(away))
        assert what == TURN
        assert abs(mpf(place) - truth) <= allowed


@pytest.mark.extended
@pytest.mark.parametrize("width", [1e-3, 1e-6])
def test_a_motion_is_held_by_a_narrow_barrier(width: float, field: Callable[[str], ModuleType]) -> None:
    """In a wide bowl with a narrow spike the swing ends at the spike or goes on to the far side, as the energy
    determines.
    """
    bump = {"a": 1, "h": 3, "c": 1, "w": width}
    held = field("bump").solve(lam0=-2, v0=math.sqrt(2 * G * 1.499), direction=1, **bump)
    free = field("bump").solve(lam0=-2, v0=math.sqrt(2 * G * 1.501), direction=1, **bump)
    far = math.sqrt(2 * (2 + 1.501))
    assert held.kind == free.kind == "libration"
    assert 1 - 10 * width < held.turning_points[0] < 1
    assert free.turning_points == pytest.approx((far, -far), rel=1e-13)


def first_turn(height: Callable[[Any], Any], start: float, v0: float, direction: int, reach: float) -> float | None:
    """Return the first place where a dense sample of V**2 is below zero, narrowed down; infinite if there is none.

    The result is None if V**2 comes so close to zero without crossing that a sample proves nothing.
    """
    x = start + direction * np.linspace(0.0, reach, 100_001)
    w = v0**2 - 2 * G * (height(x) - height(start))
    slack = CLEAR * max(v0**2, 1.0)
    below = np.flatnonzero(w < 0)
    ahead = w[1 : below[0]] if below.size else w[1:]
    inner = ahead[1:-1][(ahead[1:-1] < ahead[:-2]) & (ahead[1:-1] <= ahead[2:])]
    if inner.size and inner.min() < slack:
        return None
    if not below.size:
        return math.inf if ahead[-1] > slack else None
    if w[below[0] : below[0] + 500].min() > -slack:
        return None
    lo, hi = float(x[below[0] - 1]), float(x[below[0]])
    for _ in range(60):
        middle = 0.5 * (lo + hi)
        if v0**2 - 2 * G * (height(middle) - height(start)) > 0:
            lo = middle
        else:
            hi = middle
    return lo


NUMBERS = st.floats(-1.0, 1.0)


@pytest.mark.extended
@pytest.mark.parametrize("name", ["waves", "quintic"])
@examples(80)
@given(
    abcdf=st.tuples(*[NUMBERS] * 5),
    start=st.floats(-2.0, 2.0),
    v0=st.floats(0.25, 6.0),
    direction=st.sampled_from([1, -1]),
)
def test_random_landscapes(
    name: str,
    field: Callable[[str], ModuleType],
    abcdf: tuple[float, ...],
    start: float,
    v0: float,
    direction: int,
) -> None:
    """On random waves and polynomials the search ends where a dense sample of V**2 first goes below zero."""
    a, b, c, d, f = abcdf
    heights = {
        "waves": lambda x: a * np.cos(x) + b * np.cos(2 * x + c) + d * np.cos(5 * x + f),
        "quintic": lambda x: x * (a + x * (b + x * (c + x * (d + x * f)))),  # powers would take most of the time
    }
    reach = 7.0
    truth = first_turn(heights[name], start, v0, direction, reach)
    given_ = {"a": a, "b": b, "c": c, "d": d, "f": f}
    what, place, _ = walk(field(name), start, v0, direction, reach, **given_)
    assume(truth is not None)  # otherwise the sample cannot decide
    if math.isinf(truth):
        assert what == LIMIT
    else:
        assert what == TURN
        slope = abs(heights[name](truth + 1e-7) - heights[name](truth - 1e-7)) / 2e-7
        size = v0**2 / (2 * G) + abs(heights[name](start)) + sum(abs(k) for k in abcdf) * max(1, abs(truth)) ** 5
        assert abs(place - truth) <= TURN_PLACE + 1e-14 * size / slope


@pytest.mark.extended
@pytest.mark.parametrize("gap", ["1e-6", "1e-10", "1e-14", "1e-20", "1e-40"])
def test_tops_that_all_but_touch_the_energy(gap: str, module_of: ModuleOf) -> None:
    """A pendulum with v0**2 = 4 g L (1 -+ gap) turns before the top or goes round; without a gap, it does neither."""
    circle = module_of("circle")
    short = circle.solve(lam0=0, v0=f"2*sqrt(9.81*(1 - {gap}))", L=1)
    round_ = circle.solve(lam0=0, v0=f"2*sqrt(9.81*(1 + {gap}))", L=1)
    assert (short.kind, round_.kind) == ("libration", "circulation")
    with mp.workdps(60):
        truth = 2 * mp.asin(mp.sqrt(1 - mpf(gap)))
        assert abs(mpf(short.turning_points[0]) - truth) <= math.ulp(math.pi)
    assert circle.solve(lam0=0, v0="2*sqrt(9.81)", L=1).kind == "asymptotic"


@pytest.mark.parametrize("far", [1e2, 1e5, 1e8])
def test_a_walk_without_end_goes_on(far: float, module_of: ModuleOf) -> None:
    """Up a gentle line the turn is found wherever it is; down the line the search exhausts its steps with V**2 > 0."""
    line = module_of("line")
    v0 = 10.0
    slope = v0**2 / (2 * G * far)
    what, place, _ = walk(line, 0.0, v0, 1, math.inf, k=slope, c=0.0)
    assert what == TURN
    assert place == pytest.approx(far, rel=1e-14)
    assert walk(line, 0.0, v0, -1, math.inf, k=slope, c=0.0)[0] == STEPS_SPENT
    assert walk(module_of("cubic"), -1.0, 1.0, -1, math.inf)[0] == STEPS_SPENT


def test_the_end_of_the_domain_is_the_limit(module_of: ModuleOf) -> None:
    """A search that finds nothing ends exactly at the given length."""
    well = module_of("frequency")
    assert walk(well, -1.0, 9.0, 1, 6.0, a=1.0) == (LIMIT, 5.0, 5.0)
    assert walk(well, -1.0, 9.0, -1, 4.0, a=1.0) == (LIMIT, -5.0, -5.0)


@pytest.mark.parametrize(("start", "cusp", "direction"), [(2.0, 0.0, -1), (4.0, 2 * math.pi, 1), (6.2831853, 0.0, -1)])
def test_a_cusp_stops_the_walk(start: float, cusp: float, direction: int, module_of: ModuleOf) -> None:
    """On a cycloid the search ends at the cusp where the arches meet, from either side, though V**2 continues."""
    what, near, far = walk(module_of("cycloid_arch"), start, 20.0, direction, 7.0, R=1.0)
    assert what == CUSP
    assert (near - cusp) * direction <= 4e-15
    assert abs(far - cusp) <= 1e-14


@pytest.mark.extended
def test_a_curve_that_is_not_there(generated_folder: Path) -> None:
    """If a parameter makes a coordinate the root of a negative number, an error says so, from rest and moving."""
    ellipse = gqm.Curve.parametric(
        x="cos(E) - ecc", z="sqrt(1 - ecc**2)*sin(E)", parameter="E", period="2*pi", parameters={"ecc": "3/5"}
    )
    module = gqm.build(gqm.derive(ellipse, gqm.CentralForce(k=1)), name="beyond", folder=generated_folder)
    for v0 in (0.0, 1.0):
        with pytest.raises(LaunchError, match=r"^lam0: the curve has no point at E = -1\.0 .* z = nan$"):
            module.solve(lam0=-1.0, v0=v0, ecc=1.2)


@pytest.mark.parametrize("middle", [-2, 2])
def test_a_valley_in_a_domain_on_one_side_of_zero(middle: int, tmp_path: Path) -> None:
    """The first steps are shares of the domain's length, wherever it lies."""
    curve = gqm.Curve.graph(f"(x - {middle})**2", parameter="x", domain=(middle - 1, middle + 1))
    valley = gqm.build(gqm.derive(curve, gqm.Gravity()), name="valley_aside", folder=tmp_path)
    motion = valley.solve(middle + 0.5, 0.0)
    assert motion.kind == "libration"
    assert sorted(motion.turning_points) == [middle - 0.5, middle + 0.5]


@pytest.mark.extended
@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("scale", [1e3, 1.0, 1e-3, 1e-6, 1e-12])
def test_an_exponential_wall_of_any_width(generated_folder: Any, scale: float, direction: int) -> None:
    """A body turns where it is due on walls far narrower than the first step of the search, on which Newton's steps are
    all equal.
    """
    model = gqm.derive(gqm.Curve.graph("S*(cosh(x/S) - 1)", parameter="x"), gqm.Gravity())
    module = gqm.build(model, name="wall", folder=generated_folder)
    speed = math.sqrt(G * scale) * 1e-3
    motion = module.solve(0.5 * scale, speed, direction, S=scale)
    with mp.workdps(60):
        s, place = mpf(scale), mpf(0.5 * scale)
        turn = float(s * mp.acosh(mp.cosh(place / s) + mpf(speed) ** 2 / (2 * mpf(G) * s)))
        fastest = float(mp.sqrt(mpf(speed) ** 2 + 2 * mpf(G) * s * (mp.cosh(place / s) - 1)))
    assert motion.turning_points == pytest.approx((direction * turn, -direction * turn), rel=2 * EPS, abs=0.0)
    assert [leg.lam_end for leg in motion.legs][:2] == pytest.approx(
        [direction * turn, -direction * turn], rel=2 * EPS, abs=0.0
    )
    assert motion.v_max.value == pytest.approx(fastest, rel=4 * EPS, abs=0.0)
