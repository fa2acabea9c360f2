"""Closed forms of V² of dissipative motion agree with a numerical integration of the textbook equation at 30 digits."""

import json
from collections.abc import Callable
from dataclasses import dataclass, field

import pytest
import sympy as sp
from mpmath import mp, mpf
from paths import DATA
from textbook import Textbook

import generated.circle_coulomb
import generated.circle_drag
import gqm_sym as gqm
from gqm_sym.derivation.forces.particular_solution import particular_solution

DIGITS = 30
# The tolerance of mpmath's quadrature, relative to the largest W on the way.
AGREED = mpf(10) ** -25
# The tolerance of the runtime in doubles, relative to the largest V².
MARCHED = 4e-15


@dataclass(frozen=True, kw_only=True)
class Row:
    """A model with a closed form, its values as numbers and as definitions, and an interval of the curve."""

    curve: Callable[[], gqm.Curve]
    force: Callable[[], gqm.Kernel]
    values: dict[str, str]
    truth: Callable[[], Textbook]
    ends: tuple[str, str]
    signs: tuple[tuple[int, int], ...] = ((1, 1), (-1, 1))
    names: dict[str, str] = field(default_factory=dict)


ROUGH = ((1, 1), (1, -1), (-1, 1))
CIRCLE = {"x": lambda t: mpf("1.25") * mp.sin(t), "z": lambda t: -mpf("1.25") * mp.cos(t)}
SPIRAL = {
    "x": lambda t: mpf(2) * mp.exp(t / 8) * mp.cos(t),
    "z": lambda t: mpf(2) * mp.exp(t / 8) * mp.sin(t),
}
ARCH = {"x": lambda t: (t - mp.sin(t)) / 2, "z": lambda t: (1 - mp.cos(t)) / 2}
BOWL = {"x": ARCH["x"], "z": lambda t: (mp.cos(t) - 1) / 2}
LINE = {"x": lambda t: t, "z": lambda t: 3 * t / 4}
CUBIC = {"x": lambda t: t, "z": lambda t: t**3}
ELLIPSE = {"x": lambda t: 2 * mp.cos(t), "z": lambda t: mp.sin(t)}
GRAVITY = gqm.Gravity()


def half(kappa: mpf) -> mpf:
    """Return a droplet's resistance."""
    return abs(kappa) / 2


CLOSED = {
    "coulomb line": Row(
        curve=lambda: gqm.Curve.graph("a*x"),
        force=lambda: GRAVITY + gqm.CoulombFriction(),
        values={"a": "3/4", "mu": "1/5"},
        truth=lambda: Textbook(**LINE, mu=mpf("0.2")),
        ends=("0.3", "1.7"),
        signs=ROUGH,
    ),
    "drag line": Row(
        curve=lambda: gqm.Curve.graph("a*x"),
        force=lambda: GRAVITY + gqm.QuadraticDrag(),
        values={"a": "3/4", "b": "1/5", "m": "2"},
        truth=lambda: Textbook(**LINE, drag=mpf("0.1")),
        ends=("0.3", "1.7"),
    ),
    "coulomb and drag line": Row(
        curve=lambda: gqm.Curve.graph("a*x"),
        force=lambda: GRAVITY + gqm.QuadraticDrag() + gqm.CoulombFriction(),
        values={"a": "3/4", "b": "1/5", "mu": "1/5"},
        truth=lambda: Textbook(**LINE, drag=mpf("0.2"), mu=mpf("0.2")),
        ends=("0.3", "1.7"),
        signs=ROUGH,
    ),
    "coulomb circle": Row(
        curve=gqm.families.circle,
        force=lambda: GRAVITY + gqm.CoulombFriction(),
        values={"L": "5/4", "mu": "1/5"},
        truth=lambda: Textbook(**CIRCLE, mu=mpf("0.2")),
        ends=("-0.5", "1.5"),
        signs=ROUGH,
    ),
    "drag circle": Row(
        curve=gqm.families.circle,
        force=lambda: GRAVITY + gqm.QuadraticDrag(),
        values={"L": "5/4", "b": "1/5", "m": "2"},
        truth=lambda: Textbook(**CIRCLE, drag=mpf("0.1")),
        ends=("-0.5", "1.5"),
    ),
    "everything on a circle": Row(
        curve=gqm.families.circle,
        force=lambda: GRAVITY + gqm.CoulombFriction() + gqm.QuadraticDrag() + gqm.SurfaceTension(),
        values={"L": "5/4", "mu": "1/5", "b": "1/5", "gamma": "1/2", "ell_c": "1"},
        truth=lambda: Textbook(**CIRCLE, drag=mpf("0.2"), mu=mpf("0.2"), resistance=half),
        ends=("-0.5", "1.5"),
        signs=ROUGH,
    ),
    "coulomb logarithmic spiral": Row(
        curve=lambda: gqm.families.log_spiral(b="c"),
        force=lambda: GRAVITY + gqm.CoulombFriction(),
        values={"r0": "2", "c": "1/8", "mu": "1/5"},
        truth=lambda: Textbook(**SPIRAL, mu=mpf("0.2")),
        ends=("-0.5", "1.5"),
        signs=ROUGH,
    ),
    "drag alone on a logarithmic spiral": Row(
        curve=lambda: gqm.families.log_spiral(b="c"),
        force=gqm.QuadraticDrag,
        values={"r0": "2", "c": "1/8", "b": "1/5", "m": "1"},
        truth=lambda: Textbook(**SPIRAL, drag=mpf("0.2"), push=lambda _x, _z: (mpf(0), mpf(0))),
        ends=("-0.5", "1.5"),
    ),
    "coulomb cycloid": Row(
        curve=gqm.families.cycloid,
        force=lambda: GRAVITY + gqm.CoulombFriction(),
        values={"R": "1/2", "mu": "1/5"},
        truth=lambda: Textbook(**ARCH, mu=mpf("0.2")),
        ends=("0.5", "4.5"),
        signs=ROUGH,
    ),
    "drag cycloid upside down": Row(
        curve=lambda: gqm.families.cycloid(inverted=True),
        force=lambda: GRAVITY + gqm.QuadraticDrag(),
        values={"R": "1/2", "b": "1/5", "m": "1"},
        truth=lambda: Textbook(**BOWL, drag=mpf("0.2")),
        ends=("0.5", "4.5"),
    ),
    "coulomb parabola": Row(
        curve=gqm.families.parabola,
        force=lambda: GRAVITY + gqm.CoulombFriction(),
        values={"a": "3/4", "mu": "1/5"},
        truth=lambda: Textbook(x=lambda t: t, z=lambda t: 3 * t**2 / 4, mu=mpf("0.2")),
        ends=("-0.5", "1.5"),
        signs=ROUGH,
    ),
    "coulomb cardioid": Row(
        curve=lambda: gqm.Curve.polar("a*(1 + cos(theta))", period="2*pi"),
        force=lambda: GRAVITY + gqm.CoulombFriction(),
        values={"a": "3/4", "mu": "1/5"},
        truth=lambda: Textbook(
            x=lambda t: mpf("0.75") * (1 + mp.cos(t)) * mp.cos(t),
            z=lambda t: mpf("0.75") * (1 + mp.cos(t)) * mp.sin(t),
            mu=mpf("0.2"),
        ),
        ends=("-0.5", "1.5"),
        signs=ROUGH,
    ),
    "coulomb involute": Row(
        curve=lambda: gqm.Curve.parametric(
            x="a*(cos(t) + t*sin(t))", z="a*(sin(t) - t*cos(t))", parameter="t", domain=(0, None)
        ),
        force=lambda: GRAVITY + gqm.CoulombFriction(),
        values={"a": "3/4", "mu": "1/5"},
        truth=lambda: Textbook(
            x=lambda t: mpf("0.75") * (mp.cos(t) + t * mp.sin(t)),
            z=lambda t: mpf("0.75") * (mp.sin(t) - t * mp.cos(t)),
            mu=mpf("0.2"),
        ),
        ends=("0.5", "2.5"),
        signs=ROUGH,
    ),
    "droplet cubic": Row(
        curve=lambda: gqm.Curve.graph("x**3"),
        force=lambda: GRAVITY + gqm.SurfaceTension(),
        values={"gamma": "1/2", "ell_c": "1"},
        truth=lambda: Textbook(**CUBIC, resistance=half),
        ends=("-1.25", "-0.25"),
    ),
    "printed droplet cubic": Row(
        curve=lambda: gqm.Curve.graph("x**3"),
        force=lambda: GRAVITY + gqm.SurfaceTension(form="printed"),
        values={"gamma": "1/2", "ell_c": "1/2", "m": "2"},
        truth=lambda: Textbook(**CUBIC, resistance=lambda kappa: kappa / 8),
        ends=("-1.25", "0.75"),
    ),
    "droplet ellipse": Row(
        curve=gqm.families.ellipse,
        force=lambda: GRAVITY + gqm.SurfaceTension(),
        values={"a": "2", "b": "1", "gamma": "1/2", "ell_c": "1"},
        truth=lambda: Textbook(**ELLIPSE, resistance=half),
        ends=("-2.5", "0.75"),
    ),
    "droplet that rolls in a central field": Row(
        curve=gqm.families.ellipse,
        force=lambda: GRAVITY + gqm.SurfaceTension() + gqm.Rolling() + gqm.CentralForce(centre=(0, 3)),
        values={"a": "2", "b": "1", "gamma": "1/2", "ell_c": "1", "beta": "2/5", "k": "3"},
        truth=lambda: Textbook(
            **ELLIPSE,
            resistance=half,
            inertia=mpf("1.4"),
            push=lambda x, z: (
                -3 * x / mp.hypot(x, z - 3) ** 3,
                -mpf("9.81") - 3 * (z - 3) / mp.hypot(x, z - 3) ** 3,
            ),
        ),
        ends=("-2.5", "0.75"),
    ),
    "linear law circle": Row(
        curve=gqm.families.circle,
        force=lambda: GRAVITY + gqm.Kernel.law("-direction*k*W + q*cos(theta)"),
        values={"L": "5/4", "k": "1/4", "q": "2"},
        truth=lambda: Textbook(**CIRCLE, law=lambda lam, _x, _z, w, v: -v * w / 4 + 2 * mp.cos(lam)),
        ends=("-0.5", "1.5"),
    ),
}


def derived(row: Row) -> gqm.Model:
    """Return the model of a row."""
    return gqm.derive(row.curve(), row.force())


@pytest.mark.sample(3)
@pytest.mark.parametrize("row", CLOSED.values(), ids=[name.replace(" ", "-") for name in CLOSED])
def test_closed_form_is_the_integral(row: Row) -> None:
    """W(λ) - v0² is the integral of the textbook's dW/dλ, and W(lam0) is v0²."""
    model = derived(row)
    assert model.speed_squared_form == "closed"
    assert "V**2: closed form" in model.notes[-1]
    exact = {sp.Symbol(n, real=True): sp.Rational(v) for n, v in row.values.items()}
    exact |= {sp.Symbol("g", real=True): sp.Rational("9.81"), model.mass: sp.Rational(row.values.get("m", 1))}
    direction, contact = (sp.Symbol(name, real=True) for name in ("direction", "contact_sign"))
    with mp.workdps(DIGITS + 10):
        truth = row.truth()
        for v, nu in row.signs:
            launch = {model.lam0: sp.Rational(row.ends[0]), model.v0: sp.Rational(7, 2), direction: v, contact: nu}
            form = sp.lambdify(model.parameter, model.speed_squared.xreplace(exact | launch), "mpmath", cse=True)
            start, end = (mpf(text) for text in row.ends)
            assert abs(form(start) - mpf("12.25")) < AGREED
            rate = lambda lam, f=form, v=v, nu=nu: truth.rate(lam, f(lam), v, nu)  # noqa: E731
            total = mp.quad(rate, mp.linspace(start, end, 5), method="gauss-legendre")
            assert abs(form(end) - mpf("12.25") - total) < AGREED * (12 + abs(total))


@pytest.mark.sample(3)
@pytest.mark.parametrize(
    ("curve", "force"),
    [
        pytest.param(lambda: gqm.Curve.graph("x**3"), gqm.CoulombFriction, id="coulomb cubic"),
        pytest.param(gqm.families.catenary, gqm.CoulombFriction, id="coulomb catenary"),
        pytest.param(gqm.families.ellipse, gqm.CoulombFriction, id="coulomb ellipse"),
        pytest.param(gqm.families.parabola, gqm.QuadraticDrag, id="drag parabola"),
        pytest.param(lambda: gqm.families.log_spiral(b="c"), gqm.QuadraticDrag, id="drag spiral"),
        pytest.param(
            lambda: gqm.Curve.graph("sin(x)*exp(-x**2/5) + cosh(x)/(3 + x**4)"), gqm.CoulombFriction, id="beyond budget"
        ),
    ],
)
def test_elsewhere_it_is_an_integral(curve: Callable[[], gqm.Curve], force: Callable[[], gqm.Kernel]) -> None:
    """If there is no closed form, V² is given as an integral; the model says so, and its text can be read."""
    model = gqm.derive(curve(), gqm.Gravity() + force())
    assert model.speed_squared_form == "quadrature"
    assert model.speed_squared.has(sp.Integral)
    assert "V**2: spectral antiderivative" in model.notes[-1]
    assert r"\int" in model.latex()
    assert model.liftoff_speed_squared is None
    assert sp.Symbol("W", real=True) in model.normal_force.free_symbols


def test_the_integral_is_the_paper_s_second_example() -> None:
    """W is correct at the first place where N vanishes, which the reference tables give (N < 0 at launch)."""
    cases = json.loads((DATA / "paper_cases.json").read_text(encoding="ascii"))["cases"]
    (case,) = (case for case in cases if case["id"] == "example2_cubic_coulomb")
    event = case["expected"]["events"][0]
    model = gqm.derive(gqm.Curve.graph("x**3"), gqm.Gravity() + gqm.CoulombFriction(mu="0.1"))
    at = {"lam0": "-1", "v0": "6.2088", "direction": "1", "contact_sign": "-1", "mu": "0.1", "g": "9.81"}
    form = model.speed_squared.subs({sp.Symbol(n, real=True): sp.Rational(v) for n, v in at.items()})
    with mp.workdps(DIGITS):
        w = sp.lambdify(model.parameter, form, "mpmath")(mpf(event["lam"]))
        assert abs(w - mpf(event["V2"])) < mpf(10) ** -25


def test_a_law_that_is_not_linear_is_an_equation() -> None:
    """Under a law that is not linear in W, V² has a name but no closed form, and A contains it as W."""
    model = gqm.derive(gqm.families.circle(), gqm.Gravity() + gqm.CoulombFriction() + gqm.RotatingFrame())
    assert model.speed_squared_form == "equation"
    assert "not linear" in model.notes[-1]
    assert sp.Symbol("W", real=True) in model.tangential_acceleration.free_symbols
    assert not model.dissipation.linear
    assert r"\sqrt{W}" in model.latex()


def test_conservative_forms_stay_as_they_are() -> None:
    """Conservative forms have no signs and no notes; a launch that just loses contact in a loop has V**2 = 5 g L."""
    model = gqm.derive(gqm.families.circle(), gqm.Gravity())
    assert (model.speed_squared_form, model.notes, model.dissipation) == ("closed", (), None)
    length, g = sp.Symbol("L", real=True), sp.Symbol("g", real=True)
    top = model.liftoff_speed_squared.subs({model.parameter: sp.pi, model.lam0: 0})
    assert sp.simplify(top - 5 * g * length) == 0


def test_liftoff_speed_under_friction() -> None:
    """The liftoff speed at a place is the launch speed for which N vanishes there."""
    model = gqm.derive(gqm.families.circle(), gqm.Gravity() + gqm.CoulombFriction())
    force = model.normal_force.subs(model.v0, sp.sqrt(model.liftoff_speed_squared))
    at = {"theta": 2, "lam0": sp.Rational(1, 3), "L": 2, "mu": sp.Rational(1, 5), "g": 10, "m": 3}
    at |= {"direction": 1, "contact_sign": 1}
    assert abs(force.subs({sp.Symbol(n, real=True): v for n, v in at.items()}).evalf(40)) < 1e-35


X, A, K = sp.symbols("x a k", real=True)


@pytest.mark.parametrize(
    ("source", "decay", "solution"),
    [
        pytest.param(X**2, sp.S.Zero, X**3 / 3, id="antiderivative"),
        pytest.param(sp.S.Zero, K, sp.S.Zero, id="nothing"),
        pytest.param(A, K, A / K, id="constant"),
        pytest.param(sp.exp(A * X), K, sp.exp(A * X) / (A + K), id="exponential"),
        pytest.param(sp.sqrt(1 + A * X), sp.S.Zero, 2 * (A * X + 1) ** sp.Rational(3, 2) / (3 * A), id="root"),
        pytest.param(1 / X, sp.S.Zero, None, id="logarithm"),
        pytest.param(sp.exp(X**2), sp.S.Zero, None, id="error function"),
        pytest.param(X**41, K, None, id="too high a power"),
    ],
)
def test_particular_solutions(source: sp.Expr, decay: sp.Expr, solution: sp.Expr | None) -> None:
    """U' + Q U = P is solved if U is a sum of products of functions in P and Q; otherwise the result is None."""
    found = particular_solution(source, decay, X)
    assert (found is None) == (solution is None)
    if solution is not None:
        assert sp.simplify(found - solution) == 0


@pytest.mark.extended
def test_the_march_follows_the_closed_form() -> None:
    """V² of the runtime agrees with the closed form on a leg in each direction and beyond a change of contact sign."""
    for name, lam0, v0, v, places in (
        ("drag", "-2", "0", 1, ("-1.9", "-1", "0", "1.25", "1.45")),
        ("drag", "1.5", "4", -1, ("1.4", "0.5", "-1")),
        ("coulomb", "0.5", "9.5", 1, ("0.6", "1.2", "1.6")),
        ("coulomb", "0", "2", -1, ("-0.2", "-0.4")),
    ):
        module = {"drag": generated.circle_drag, "coulomb": generated.circle_coulomb}[name]
        force = gqm.QuadraticDrag() if name == "drag" else gqm.CoulombFriction()
        model = gqm.derive(gqm.families.circle(), gqm.Gravity() + force)
        values = {n: sp.Rational(str(value)) for n, value in module.PARAMETERS.items()}
        values |= {"lam0": sp.Rational(lam0), "v0": sp.Rational(v0), "direction": v, "contact_sign": 1}
        form = model.speed_squared.subs({sp.Symbol(n, real=True): value for n, value in values.items()})
        field = module.pass1(list(places), lam0, v0, v)
        scale = float(form.subs(model.parameter, 0).evalf(30))
        for actual, place in zip(field.v2, places, strict=True):
            truth = form.subs(model.parameter, sp.Rational(place)).evalf(30)
            assert abs(sp.Rational(float(actual)) - truth) <= MARCHED * scale
