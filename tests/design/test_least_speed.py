"""The least launch speed is that with which contact holds everywhere."""

from math import acos, cos, cosh, sin, sinh, sqrt
from pathlib import Path
from types import ModuleType

import pytest

import generated.catenary
import generated.circle
import generated.circle_coulomb
import generated.cycloid
import generated.ellipse
import generated.parabola
import generated.rolling_circle
import gqm_sym as gqm
from gqm_sym.errors import GQMError, InputError, LaunchError, ParameterError, SolutionError

# The tolerance is in roundings of the square of the speed.
SHARE = 4e-16


def near(actual: float, expected: float) -> bool:
    """Return whether a speed is the expected one to rounding."""
    return abs(actual - expected) <= SHARE * expected


def test_loop_the_loop() -> None:
    """From the lowest point v0² is 5 g L; it is 4 g L for a bead on a ring, and (1 + 4/(1 + β)) g L for a rolling
    body.
    """
    circle = generated.circle
    assert near(gqm.least_speed(circle, 0, L=1.5, g=9.81), sqrt(5 * 9.81 * 1.5))
    assert near(gqm.least_speed(circle, 0, L=1.5, g=9.81, contact="bilateral"), sqrt(4 * 9.81 * 1.5))
    beta = 0.4
    rolling = sqrt(9.81 * 2 * (1 + 4 / (1 + beta)))
    assert near(gqm.least_speed(generated.rolling_circle, 0, L=2, beta=beta, g=9.81), rolling)


def test_from_any_place_of_the_loop() -> None:
    """By conservation of energy v0² is g L (3 + 2 cos θ0)."""
    expected = sqrt(9.81 * 0.9 * (3 + 2 * 0.5403023058681398))
    assert near(gqm.least_speed(generated.circle, 1, between=(-4, 4)), expected)


@pytest.mark.extended
def test_loop_the_ellipse() -> None:
    """At the top κ is b/a², so that v0² is g a²/b + 4 g b from the lowest point."""
    a, b, g = 1.0, 2.0, 9.81
    assert near(gqm.least_speed(generated.ellipse, "-pi/2", a=a, b=b, g=g), sqrt(g * a**2 / b + 4 * g * b))


def test_in_a_valley_the_ends_decide() -> None:
    """In a valley contact from above always holds, so that V² must only suffice to reach the higher end."""
    c, g = 0.8, 9.81
    speed = gqm.least_speed(generated.catenary, 0, between=(-1, 0.5), c=c, g=g)
    assert near(speed, sqrt(2 * g * c * (cosh(1 / c) - 1)))
    assert gqm.least_speed(generated.catenary, 1, between=(-1, 1), c=c, g=g) == 0.0


def test_the_motion_agrees() -> None:
    """A slightly faster body goes round, and a slightly slower one lifts off."""
    speed = gqm.least_speed(generated.circle, 0)
    assert generated.circle.solve(0, speed * (1 + 1e-9), contact="above").kind == "circulation"
    assert generated.circle.solve(0, speed * (1 - 1e-9), contact="above").events[-1].kind == "liftoff"


@pytest.mark.extended
def test_a_hump_asks_for_less_and_not_for_more() -> None:
    """On an arch of a cycloid no speed keeps a body on all of it, and any small speed does so near its top."""
    with pytest.raises(SolutionError, match=r"no speed.*at most|no speed.*low enough"):
        gqm.least_speed(generated.cycloid, 3, between=(1, 5))
    assert gqm.least_speed(generated.cycloid, "pi", between=(3, "2*pi - 3")) == 0.0


def sizes(derivatives: dict[str, float], wanted: dict[str, float]) -> bool:
    """Return whether derivatives are the expected ones to rounding."""
    return derivatives == pytest.approx(wanted, rel=1e-14, abs=1e-15)


@pytest.mark.extended
def test_derivatives_of_loops() -> None:
    """The derivatives are those of the closed forms above."""
    circle, speed = generated.circle, sqrt(5 * 9.81 * 1.5)
    found = gqm.least_speed_gradient(circle, 0, L=1.5, g=9.81)
    assert sizes(found, {"m": 0.0, "g": speed / (2 * 9.81), "L": speed / 3, "lam0": 0.0})
    speed = sqrt(9.81 * 0.9 * (3 + 2 * cos(1)))
    found = gqm.least_speed_gradient(circle, 1, ("lam0", "g"), between=(-4, 4))
    assert sizes(found, {"lam0": -9.81 * 0.9 * sin(1) / speed, "g": speed / (2 * 9.81)})
    g, length, beta = 9.81, 2.0, 0.4
    speed = sqrt(g * length * (1 + 4 / (1 + beta)))
    found = gqm.least_speed_gradient(generated.rolling_circle, 0, "beta", L=length, beta=beta, g=g)
    assert sizes(found, {"beta": -2 * g * length / (1 + beta) ** 2 / speed})
    a, b = 1.0, 2.0
    speed = sqrt(g * a**2 / b + 4 * g * b)
    found = gqm.least_speed_gradient(generated.ellipse, "-pi/2", ("a", "b"), a=a, b=b, g=g)
    assert sizes(found, {"a": g * a / b / speed, "b": (4 * g - g * a**2 / b**2) / (2 * speed)})


def test_derivatives_where_the_ends_decide(tmp_path: Path) -> None:
    """At a given end the place is fixed; at an end of the curve it moves; where any speed suffices they are 0."""
    g, c, catenary = 9.81, 0.8, generated.catenary
    speed = sqrt(2 * g * c * (cosh(1 / c) - 1))
    found = gqm.least_speed_gradient(catenary, 0, "c", between=(-1, 0.5), c=c, g=g)
    assert sizes(found, {"c": g * (cosh(1 / c) - 1 - sinh(1 / c) / c) / speed})
    assert gqm.least_speed_gradient(catenary, 1, "c", between=(-1, 1), c=c, g=g) == {"c": 0.0}
    curve = gqm.Curve.graph("k*x**2", domain=(-1, "1 + k"), parameters={"k": 1})
    valley = gqm.build(gqm.derive(curve, gqm.Gravity()), name="valley_of_speeds", folder=str(tmp_path))
    k = 0.7
    speed = sqrt(2 * g * k) * (1 + k)
    wanted = {"k": speed / (2 * k) + sqrt(2 * g * k), "lam0": 0.0}
    assert sizes(gqm.least_speed_gradient(valley, 0, ("k", "lam0"), k=k, g=g), wanted)


@pytest.mark.extended
def test_derivatives_beyond_a_summit(tmp_path: Path) -> None:
    """A bead has to get over the summit of z = a sin(x) + x/5, where a cos(x) = -1/5."""
    curve = gqm.Curve.graph("a*sin(x) + x/5", domain=(-1, 3), parameters={"a": 1})
    hill = gqm.build(gqm.derive(curve, gqm.Gravity()), name="hill_of_speeds", folder=str(tmp_path))
    a, g, start = 0.8, 9.81, -0.3
    top = acos(-0.2 / a)
    speed = sqrt(2 * g * (a * (sin(top) - sin(start)) + (top - start) / 5))
    found = gqm.least_speed_gradient(hill, start, ("a", "lam0"), contact="bilateral", a=a, g=g)
    assert sizes(found, {"a": g * (sin(top) - sin(start)) / speed, "lam0": -g * (a * cos(start) + 0.2) / speed})


def test_derivatives_that_do_not_exist() -> None:
    """The speed itself is no variable, and neither are unknown names."""
    for name in ("v0", "q"):
        with pytest.raises(InputError, match="wrt"):
            gqm.least_speed_gradient(generated.circle, 0, name)


@pytest.mark.parametrize(
    ("module", "arguments", "kind", "message"),
    [
        (generated.parabola, {}, LaunchError, "between: .*extends to infinity"),
        (generated.circle, {"between": (1, 2)}, LaunchError, "between: .*contains lam0"),
        (generated.cycloid, {"between": (-1, 2)}, LaunchError, "between"),
        (generated.circle, {"contact": "inside"}, LaunchError, "contact: must be one of"),
        (generated.circle, {"q": 1}, ParameterError, "q: is not a parameter"),
        (generated.circle, {"L": -1}, ParameterError, "L: must be positive"),
        (generated.circle_coulomb, {}, SolutionError, "loses energy"),
    ],
)
def test_questions_without_an_answer(module: object, arguments: dict, kind: type[GQMError], message: str) -> None:
    """Each question without an answer is refused, and the message says what would be right."""
    with pytest.raises(kind, match=message):
        gqm.least_speed(module, 0, **arguments)


@pytest.fixture(scope="module")
def coil(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """Return the module of a helix about a level axis, on which riders lean towards the axis."""
    roll = "-u+atan(2*sin(u)*cos(u)/(5*cos(u)**2+3*sin(u)**2))"  # for R = 4 and c = 3
    track = gqm.Curve.space(x="3*u", y="4*sin(u)", z="-4*cos(u)", parameter="u", roll=roll)
    return gqm.build(gqm.derive(track, gqm.Gravity()), name="coil", folder=tmp_path_factory.mktemp("coil"))


@pytest.mark.extended
def test_corkscrew(coil: ModuleType) -> None:
    """On a helix about a level axis v0**2 from the lowest point is 4 g R + g (R**2 + c**2)/R, by the load on riders; a
    bead needs 4 g R.
    """
    assert near(gqm.least_speed(coil, 0, between=(-1, 4)), sqrt(9.81 * (16 + 25 / 4)))
    assert near(gqm.least_speed(coil, 0, between=(-1, 4), contact="bilateral"), sqrt(9.81 * 16))
    with pytest.raises(SolutionError, match="none of the load on a rider, which decides the least speed"):
        gqm.least_speed_gradient(coil, 0, between=(-1, 4))
    slopes = gqm.least_speed_gradient(coil, 0, between=(-1, 4), contact="bilateral")
    assert near(slopes["g"], sqrt(16 / 9.81) / 2)


@pytest.mark.extended
def test_motions_in_a_corkscrew(coil: ModuleType, tmp_path: Path) -> None:
    """A slightly faster body passes the top, and a slower one lifts off; a rail of pieces has the same least speed."""
    speed = sqrt(9.81 * (16 + 25 / 4))
    turning = gqm.transition(length=25, pitch="4/25", roll="3/25")
    rail = gqm.Curve.piecewise([turning], start=(0, 0, -4), heading=("atan(4/3)", 0), roll="pieces")
    coiled = gqm.build(gqm.derive(rail, gqm.Gravity()), name="coiled", folder=tmp_path)
    assert near(gqm.least_speed(coiled, 1), sqrt(9.81 * (16 + 25 / 4 - 8 * (1 - cos(1 / 5)))))
    for factor, end in ((1.001, "transit"), (0.999, "liftoff")):
        motion = coil.solve(0, factor * speed, contact="above")
        assert (motion.kind if end == "transit" else motion.events[-1].kind) == end
