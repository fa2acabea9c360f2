"""Second derivatives of periods agree with those of closed forms in mpmath."""

from fractions import Fraction
from itertools import combinations_with_replacement
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from mpmath import mp, mpf
from paths import ROOT

import gqm_sym as gqm
from gqm_sym.errors import GQMError, InputError, SolutionError
from gqm_sym.loading import load

ULP = 2.0**-52


@pytest.fixture(scope="module")
def circle() -> ModuleType:
    """Return a bead on a circle."""
    return load(str(ROOT / "generated" / "circle.py"), "circle")


def swing(lam0: Any, v0: Any, L: Any, g: Any) -> Any:
    """Return a quarter of the period of a pendulum."""
    return mp.sqrt(L / g) * mp.ellipk(mp.sin(lam0 / 2) ** 2 + v0**2 / (4 * g * L))


def lap(lam0: Any, v0: Any, L: Any, g: Any) -> Any:
    """Return the time of a lap of a pendulum."""
    square = v0**2 + 2 * g * L * (1 - mp.cos(lam0))
    return 4 * L * mp.ellipk(4 * g * L / square) / mp.sqrt(square)


def second(function: Any, at: dict[str, Any], one: str, other: str) -> Any:
    """Return the second derivative with respect to two of the arguments, by differences of 60 digits."""
    step = mpf(10) ** -15

    def value(**moves: Any) -> Any:
        return function(**{name: x + moves.get(name, 0) for name, x in at.items()})

    if one == other:
        return (value(**{one: step}) - 2 * value() + value(**{one: -step})) / step**2
    corners = [(i * j, value(**{one: i * step, other: j * step})) for i in (1, -1) for j in (1, -1)]
    return sum(sign * found for sign, found in corners) / (4 * step**2)


LAUNCHES = [("6/5", "0"), ("1/10", "1/2"), ("-2", "3"), ("1/1000", "0"), ("314/100", "0"), ("1", "9")]


@pytest.mark.parametrize("launch", LAUNCHES)
def test_a_pendulum(launch: tuple[str, str], circle: ModuleType) -> None:
    """Second derivatives are right for small and large swings, one near the top, and rounds, for all pairs of lam0, v0,
    L and g.
    """
    motion = circle.solve(lam0=launch[0], v0=launch[1], L="5/4", g="9.81")
    found = motion.gradient("period", ("lam0", "v0", "L", "g"), order=2)
    with mp.workdps(60):
        numbers = [Fraction(text) for text in (*launch, "5/4", "9.81")]
        at = {name: mpf(x.numerator) / x.denominator for name, x in zip(("lam0", "v0", "L", "g"), numbers, strict=True)}
        function, share = (lap, 1) if motion.kind == "circulation" else (swing, 4)
        for one, other in combinations_with_replacement(at, 2):
            wanted = share * second(function, at, one, other)
            size = abs(wanted) + abs(share * function(**at)) * 1e-3
            assert abs(found[one][other] - wanted) <= 4 * ULP * size, (one, other)
            assert found[one][other] == found[other][one]


def test_the_reference_number(circle: ModuleType) -> None:
    """For the pendulum of 1.2 rad at rest, the second derivative with respect to v0 is the first with respect to the
    energy.
    """
    motion = circle.solve(lam0="6/5", L=1, g="9.81")
    found = motion.gradient("half_period", ("lam0", "v0"), order=2)
    wanted = mpf("0.20564724295197262477075024369")
    assert abs(found["lam0"]["lam0"] - wanted) <= 2 * ULP * wanted
    assert found["lam0"]["v0"] == 0.0
    assert found["v0"]["v0"] == pytest.approx(0.5 * motion.period_slope, rel=2 * ULP)


def on_ellipse(lam0: Any, v0: Any, a: Any, b: Any, g: Any) -> Any:
    """Return the period of a bead on an ellipse x = a cos(lam), z = b sin(lam), by the trapezoidal rule.

    The nodes of one half or quarter suffice, of which the others are mirror images.
    """
    n, square = 96, v0**2 / (2 * g * b) + (1 + mp.sin(lam0))

    def ds(cosine: Any) -> Any:
        return mp.sqrt(a**2 * cosine**2 + b**2 * (1 - cosine**2))

    if square > 2:
        cosines = [mp.cos(mp.pi * (2 * k + 1) / n) for k in range(n // 2)]
        return mp.fsum(ds(c) / mp.sqrt(2 * g * b * (square - 1 + c)) for c in cosines) * 4 * mp.pi / n
    # sin(u/2) is a share, which is the sine of the new variable, of its value at the turning point.
    shares = [square * mp.sin(mp.pi * (2 * k + 1) / n) ** 2 for k in range(n // 4)]
    return mp.fsum(ds(1 - s) / mp.sqrt(1 - s / 2) for s in shares) * 8 * mp.pi / n / mp.sqrt(g * b)


@pytest.mark.parametrize("launch", [("-2/5", "0"), ("-9/4", "2"), ("1/2", "13")])
def test_parameters_that_shape_a_curve(launch: tuple[str, str]) -> None:
    """On an ellipse, the second derivatives with respect to its axes are those of differences of 60 digits."""
    at = {"lam0": launch[0], "v0": launch[1], "a": "5/4", "b": "3/4", "g": "9.81"}
    module = load(str(ROOT / "generated" / "ellipse.py"), "ellipse")
    check_seconds(module.solve(**at).gradient("period", tuple(at), order=2), on_ellipse, at)


def test_an_asymmetric_well(generated_folder: Path) -> None:
    """On z = x**2 + c*x**3 second derivatives agree with differences of first derivatives, which are exact."""
    module = gqm.build(
        gqm.derive(gqm.Curve.graph("x**2 + c*x**3"), gqm.Gravity() + gqm.Rolling()),
        name="second_well",
        folder=generated_folder,
    )
    at = {"lam0": -0.8, "v0": 0.25, "c": 0.3, "beta": 0.4, "g": 9.81}
    found = module.solve(**at).gradient("half_period", tuple(at), order=2)
    for name in at:
        step = 2.0**-20
        sides = [module.solve(**{**at, name: at[name] + d}).gradient("half_period", tuple(at)) for d in (step, -step)]
        for other in at:
            quotient = (sides[0][other] - sides[1][other]) / (2 * step)
            assert found[name][other] == pytest.approx(quotient, rel=1e-8, abs=1e-9), (name, other)


@pytest.mark.parametrize("launch", [("6/5", "0"), ("1/10", "1/2"), ("-2", "3"), ("3", "0"), ("1", "9")])
def test_along_a_chart(launch: tuple[str, str], generated_folder: Path) -> None:
    """A circle without formulas has the second derivatives of the pendulum, whose angle is arc length over radius."""
    curve = gqm.Curve.implicit("x**2 + z**2 - R**2", start=(0, "-R"), parameters={"R": 1})
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="second_ring", folder=generated_folder)
    motion, names = module.solve(lam0=launch[0], v0=launch[1], R="5/4", g="9.81"), ("lam0", "v0", "R", "g")
    found = motion.gradient("period", names, order=2)
    law, share = (lap, 1) if motion.kind == "circulation" else (swing, 4)

    def function(lam0: Any, v0: Any, R: Any, g: Any) -> Any:
        return share * law(lam0 / R, v0, R, g)

    check_seconds(found, function, dict(zip(names, (*launch, "5/4", "9.81"), strict=True)))


def check_seconds(found: dict[str, dict[str, float]], function: Any, at: dict[str, str], last_places: int = 4) -> None:
    """Check second derivatives against those of a function by differences of 60 digits."""
    with mp.workdps(60):
        fractions = {name: Fraction(text) for name, text in at.items()}
        numbers = {name: mpf(x.numerator) / x.denominator for name, x in fractions.items()}
        for one, other in combinations_with_replacement(at, 2):
            wanted = second(function, numbers, one, other)
            size = abs(wanted) + abs(function(**numbers)) * 1e-3
            assert abs(found[one][other] - wanted) <= last_places * ULP * size, (one, other)
            assert found[one][other] == found[other][one]


def on_two_arcs(lam0: Any, v0: Any, r: Any, q: Any, A: Any, g: Any) -> Any:
    """Return the half period on an arc of radius r, which begins at the angle -A, and one of radius q behind it."""
    angle, radius = (A - lam0 / r, r) if lam0 < A * r else ((lam0 - A * r) / q, q)
    height = radius * (1 - mp.cos(angle)) + v0**2 / (2 * g)
    return sum(mp.sqrt(radius / g) * mp.ellipk(height / (2 * radius)) for radius in (r, q))


def test_parameters_that_shape_a_rail(generated_folder: Path) -> None:
    """On a rail of two arcs, second derivatives by radii and an angle are right, although the joint between them moves
    along the rail and its points are not displaced smoothly there.

    The terms that come from the motion of the joint are up to eight times as large as their sums with the others.
    """
    pieces = [gqm.arc(radius="r", angle="A"), gqm.arc(radius="q", angle="5/4")]
    curve = gqm.Curve.piecewise(pieces, heading="-A", parameters={"r": "3/2", "q": "1/2", "A": "6/5"})
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="second_rail", folder=generated_folder)
    for launch in (("3/2", "1/4"), ("2", "0")):
        at = dict(zip(("lam0", "v0", "r", "q", "A", "g"), (*launch, "3/2", "3/4", "6/5", "9.81"), strict=True))
        found = module.solve(**at).gradient("half_period", tuple(at), order=2)
        check_seconds(found, on_two_arcs, at, last_places=64)


@pytest.mark.extended
def test_along_points_in_space(generated_folder: Path) -> None:
    """Along points, second derivatives agree with differences of first derivatives, which are exact."""
    turns = [0.4 * k for k in range(-8, 9)]
    points = [(mp.sin(u) * 2, mp.cos(u), 0.3 * u * u + 0.05 * mp.sin(3 * u)) for u in turns]
    curve = gqm.Curve.sampled([[float(x) for x in point] for point in points])
    force = gqm.Gravity() + gqm.Rolling(beta="2/5") + gqm.Potential("k*(x**2 + z**2)/2", parameters={"k": "3/2"})
    module = gqm.build(gqm.derive(curve, force), name="second_points", folder=generated_folder)
    at = {"lam0": 5.5, "v0": 0.75, "k": 1.5, "g": 9.81, "m": 1.25, "beta": 0.4}
    found = module.solve(**at).gradient("half_period", tuple(at), order=2)
    for name in at:
        step = 2.0**-14
        slopes = [module.solve(**{**at, name: at[name] + k * step}).gradient("half_period") for k in (-2, -1, 1, 2)]
        for other in at:
            rows = [row[other] for row in slopes]
            quotient = (rows[0] - 8 * rows[1] + 8 * rows[2] - rows[3]) / (12 * step)
            assert found[name][other] == pytest.approx(quotient, rel=1e-9, abs=1e-10), (name, other)


def test_what_is_not_there(circle: ModuleType) -> None:
    """Each second derivative that does not exist gives one clear error."""
    motion = circle.solve(lam0=1.0)
    with pytest.raises(InputError, match="order must be 1 or 2, got 3"):
        motion.gradient("period", order=3)
    with pytest.raises(GQMError, match="order=2: quantity: must be one of half_period, period, got 'v_max'"):
        motion.gradient("v_max", order=2)
    with pytest.raises(SolutionError, match="only a libration has half_period"):
        circle.solve(lam0=1.0, v0=9.0).gradient("half_period", order=2)
    with pytest.raises(SolutionError, match="only periodic motions have second derivatives; this one is 'dissipative'"):
        load(str(ROOT / "generated" / "circle_drag.py"), "circle_drag").solve(lam0=1.0).gradient("t_end", order=2)
