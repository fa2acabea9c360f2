"""Closed forms agree with textbooks, with the corpus, and with numerical differentiation."""

import json
import os
import runpy
import subprocess
import sys

import pytest
import sympy as sp
from mpmath import mp, mpf
from paths import DATA

from gqm_sym.declare import Curve, families
from gqm_sym.derivation import Model, derive
from gqm_sym.errors import DeclarationError, DerivationError, GQMError
from gqm_sym.expressions import read_expression
from gqm_sym.kernels import Gravity

CORPUS = {
    entry["name"]: entry for entry in json.loads((DATA / "curves.json").read_text()) if entry["kind"] != "implicit"
}
# The corpus gives 34 digits; the closed forms are evaluated with 45.
CORPUS_TOLERANCE = mpf("2e-33")
# Differences of the eighth order with steps of 1e-12 in 80 digits leave 1e-56 of the value.
DIFFERENCE_TOLERANCE = mpf("1e-40")


def read(text: str) -> sp.Expr:
    """Read an expression as a user would write it."""
    return read_expression(text, where="test")


def real(name: str) -> sp.Symbol:
    """Return the symbol of a parameter."""
    return sp.Symbol(name, real=True)


def declare(entry: dict) -> Curve:
    """Declare a curve of the corpus."""
    common = {
        "parameter": entry["parameter"],
        "parameters": entry["params"],
        "domain": entry["domain"],
    }
    if entry["kind"] == "graph":
        return Curve.graph(entry["expr"], **common)
    common["period"] = entry["period"]
    if entry["kind"] == "polar":
        return Curve.polar(entry["expr"], **common)
    return Curve.parametric(x=entry["x"], z=entry["z"], **common)


def value(form: sp.Expr, place: dict[sp.Symbol, sp.Expr]) -> mpf:
    """Evaluate a closed form at exact values to 45 digits."""
    return mpf(form.subs(place).evalf(45))


def defaults(model: Model) -> dict[sp.Symbol, sp.Expr]:
    """Return the exact values of the parameters that have one."""
    return {real(name): read(str(given)) for name, given in model.defaults if given is not None}


@pytest.mark.sample(5)
@pytest.mark.parametrize("name", CORPUS)
def test_the_corpus(name):
    """ds, κ, V² and N have all the digits that the corpus gives, on every explicit curve."""
    entry = CORPUS[name]
    model = derive(declare(entry), Gravity(g=entry["g"]), parameters={"m": entry["m"]})
    assert model.notes == ()
    launch = {model.lam0: read(entry["launch"]["lam0"]), model.v0: read(entry["launch"]["v0"])}
    with mp.workdps(45):
        for sample in entry["expect"]["samples"]:
            place = {**defaults(model), **launch, model.parameter: read(sample["lam"])}
            for form, expected in (
                (model.x, sample["x"]),
                (model.z, sample["z"]),
                (model.ds, sample["ds"]),
                (model.kappa, sample["kappa"]),
                (model.speed_squared, sample["v2"]),
                (model.normal_force, sample["normal_force"]),
            ):
                scale = max(1, abs(mpf(expected)))
                assert abs(value(form, place) - mpf(expected)) < CORPUS_TOLERANCE * scale


OTHERS = {
    "cusp": Curve.parametric(x="t**3", z="t**2", parameter="t"),
    "involute": Curve.parametric(x="cos(t) + t*sin(t)", z="sin(t) - t*cos(t)", parameter="t"),
    "semicircle": Curve.graph("-sqrt(R**2 - x**2)", parameters={"R": 4}),
    "power": Curve.graph("a*x**p", parameters={"a": 2, "p": "8/3"}, domain=(0, None)),
    "sech": Curve.graph("-a/cosh(x)**2", parameters={"a": 2}),
    "gaussians": Curve.graph("a*exp(-(x - 1)**2) + b*x**2", parameters={"a": 1, "b": "1/5"}),
    "kink": Curve.graph("abs(x)**3 + x"),
    "trochoid": Curve.parametric(x="R*t - d*sin(t)", z="R - d*cos(t)", parameter="t", parameters={"R": 1, "d": 2}),
    "limacon": Curve.polar("a + b*cos(theta)", parameters={"a": 1, "b": 3}),
    "hypocycloid": Curve.parametric(x="4*cos(t) + cos(4*t)", z="4*sin(t) - sin(4*t)", parameter="t"),
    "epicycloid": Curve.parametric(
        x="(R + r)*cos(t) - r*cos((R + r)/r*t)",
        z="(R + r)*sin(t) - r*sin((R + r)/r*t)",
        parameter="t",
        parameters={"R": 3, "r": 2},
    ),
    "squircle": Curve.parametric(
        x="cos(u)*(cos(u)**4 + sin(u)**4)**(-1/4)",
        z="sin(u)*(cos(u)**4 + sin(u)**4)**(-1/4)",
        parameter="u",
    ),
    "inverse functions": Curve.parametric(x="asinh(t) + log(2 + t**2)", z="atan(t)*sqrt(1 + t**2)", parameter="t"),
    "exponent": Curve.parametric(x="2**t", z="t**t", parameter="t"),
    "upside down": families.catenary(c=2, inverted=True),
    "spiral": families.log_spiral(r0=1, b="-3/20", inverted=True),
}


def differences(function, at: mpf) -> tuple[mpf, mpf]:
    """Return the first and the second derivative by differences of the eighth order."""
    step = mpf(10) ** -12
    first = [mpf(4) / 5, mpf(-1) / 5, mpf(4) / 105, mpf(-1) / 280]
    second = [mpf(8) / 5, mpf(-1) / 5, mpf(8) / 315, mpf(-1) / 560]
    sides = [(function(at + k * step), function(at - k * step)) for k in (1, 2, 3, 4)]
    slope = sum(w * (up - down) for w, (up, down) in zip(first, sides, strict=True))
    bend = sum(w * (up + down) for w, (up, down) in zip(second, sides, strict=True))
    return slope / step, (bend - mpf(205) / 72 * function(at)) / step**2


@pytest.mark.sample(4)
@pytest.mark.parametrize("name", OTHERS)
@pytest.mark.parametrize("place", ["1/3", "11/7"])
def test_forms_agree_with_numerical_differentiation(name, place):
    """Closed forms agree with numerical differentiation of the declared x and z, however the forms were found."""
    curve = OTHERS[name]
    model = derive(curve, Gravity())
    values = defaults(model)
    lam = read(place)

    with mp.workdps(80):

        def coordinate(form):
            return lambda at: mpf(form.subs(values).subs(model.parameter, sp.Float(at, 80)).evalf(78))

        at = mpf(int(lam.p)) / int(lam.q)
        dx, ddx = differences(coordinate(curve.x), at)
        dz, ddz = differences(coordinate(curve.z), at)
        ds = mp.sqrt(dx**2 + dz**2)
        turn = (dx * ddz - dz * ddx) / ds**2
        gravity = mpf("9.81")
        turned = sp.diff(model.turning_angle, model.parameter)
        for form, truth in (
            (model.ds, ds),
            (model.dxds, dx / ds),
            (model.dzds, dz / ds),
            (model.kappa, turn / ds),
            (model.turning_rate, turn),
            (turned, turn),
            (model.static_normal_load, gravity * dx / ds),
            (model.tangential_acceleration, -gravity * dz / ds),
            (model.effective_potential_slope, gravity * dz),
        ):
            error = abs(value(form, {**values, model.parameter: lam}) - truth)
            assert error < DIFFERENCE_TOLERANCE * max(1, abs(truth)), form


TEXTBOOK = {
    "circle": (families.circle(), "L", "1/L"),
    "ellipse": (
        families.ellipse(),
        "sqrt(a**2*sin(theta)**2 + b**2*cos(theta)**2)",
        "a*b/(a**2*sin(theta)**2 + b**2*cos(theta)**2)**(3/2)",
    ),
    "parabola": (families.parabola(), "sqrt(4*a**2*x**2 + 1)", "2*a/(4*a**2*x**2 + 1)**(3/2)"),
    "log spiral": (
        families.log_spiral(),
        "r0*sqrt(b**2 + 1)*exp(b*theta)",
        "exp(-b*theta)/(r0*sqrt(b**2 + 1))",
    ),
    "catenary": (families.catenary(), "cosh(x/c)", "1/(c*cosh(x/c)**2)"),
    "cycloid": (families.cycloid(), "2*R*sin(theta/2)", "-1/(4*R*sin(theta/2))"),
    "hanging cycloid": (
        families.cycloid(inverted=True),
        "2*R*sin(theta/2)",
        "1/(4*R*sin(theta/2))",
    ),
    "cycloid without a domain": (
        Curve.parametric(x="R*(u + sin(u))", z="R*(1 - cos(u))", parameter="u"),
        "2*R*abs(cos(u/2))",
        "1/(4*R*abs(cos(u/2)))",
    ),
    "cubic": (Curve.graph("x**3"), "sqrt(9*x**4 + 1)", "6*x/(9*x**4 + 1)**(3/2)"),
    "line": (Curve.graph("k*x + c"), "sqrt(k**2 + 1)", "0"),
    "cardioid": (
        Curve.polar("2*a*(1 + cos(theta))", domain=("-pi", "pi")),
        "4*a*cos(theta/2)",
        "3/(8*a*cos(theta/2))",
    ),
    "lemniscate": (
        Curve.parametric(x="a*cos(t)/(1 + sin(t)**2)", z="a*sin(t)*cos(t)/(1 + sin(t)**2)", parameter="t"),
        "a/sqrt(sin(t)**2 + 1)",
        "3*cos(t)/(a*sqrt(sin(t)**2 + 1))",
    ),
    "archimedes": (
        Curve.polar("a*theta"),
        "a*sqrt(theta**2 + 1)",
        "(theta**2 + 2)/(a*(theta**2 + 1)**(3/2))",
    ),
    "involute": (OTHERS["involute"], "abs(t)", "1/abs(t)"),
    "tractrix": (
        Curve.parametric(x="a*(t - tanh(t))", z="a/cosh(t)", parameter="t", domain=("0", None)),
        "a*sinh(t)/cosh(t)",
        "1/(a*sinh(t))",
    ),
    "epicycloid": (
        Curve.parametric(
            x="(R + r)*cos(t) - r*cos((R + r)/r*t)",
            z="(R + r)*sin(t) - r*sin((R + r)/r*t)",
            parameter="t",
        ),
        "2*(R + r)*abs(sin(R*t/(2*r)))",
        "(R + 2*r)/(4*r*(R + r)*abs(sin(R*t/(2*r))))",
    ),
}


@pytest.mark.sample(8)
@pytest.mark.parametrize("name", TEXTBOOK)
def test_textbook_forms(name):
    """Formulas are written as in textbooks, not only equal to those."""
    curve, ds, kappa = TEXTBOOK[name]
    model = derive(curve, Gravity())
    assert model.ds == read(ds)
    assert model.kappa == read(kappa)


@pytest.mark.parametrize(
    ("curve", "angle"),
    [
        pytest.param(families.circle(), "theta - lam0", id="circle"),
        pytest.param(families.cycloid(), "lam0/2 - theta/2", id="cycloid"),
        pytest.param(families.log_spiral(), "theta - lam0", id="log spiral"),
        pytest.param(families.parabola(), "atan(2*a*x) - atan(2*a*lam0)", id="parabola"),
        pytest.param(
            Curve.polar("a*theta"),
            "theta + atan(theta) - lam0 - atan(lam0)",
            id="archimedes",
        ),
    ],
)
def test_turning_angles(curve, angle):
    """The angle turned since the launch has a closed form."""
    lam0 = sp.Symbol("lam0", real=True)
    # lam0 is reserved for users, so it has another name here.
    expected = read(angle.replace("lam0", "start")).xreplace({real("start"): lam0})
    assert derive(curve, Gravity()).turning_angle == expected


def test_the_ellipses_turning_angle_never_jumps():
    """After one round the tangent has turned by 2π, without a jump at a cut of atan2."""
    model = derive(families.ellipse(a=3, b=1), Gravity())
    assert not model.turning_angle.has(sp.atan2)
    assert model.parameter in model.turning_angle.args  # in a frame that rotates once with it, and not twice
    around = model.turning_angle.subs({**defaults(model), model.lam0: 0})
    assert around.subs(model.parameter, 2 * sp.pi).evalf(30) == pytest.approx(2 * sp.pi.evalf(30))


def test_the_pendulum_in_full():
    """The model has every form of the paper's first example."""
    model = derive(families.circle(), Gravity())
    theta, lam0, v0, length, g, m = (
        model.parameter,
        model.lam0,
        model.v0,
        real("L"),
        real("g"),
        real("m"),
    )
    assert (model.dxds, model.dzds) == (sp.cos(theta), sp.sin(theta))
    assert model.potential == -g * length * sp.cos(theta)
    assert model.effective_potential == -g * length * sp.cos(theta)
    assert model.effective_potential_slope == g * length * sp.sin(theta)
    assert model.static_normal_load == g * sp.cos(theta)
    assert model.tangential_acceleration == -g * sp.sin(theta)
    speed = v0**2 + 2 * g * length * (sp.cos(theta) - sp.cos(lam0))
    assert model.speed_squared == speed
    assert model.normal_force == m * (speed / length + g * sp.cos(theta))
    assert model.time_integrand == length / sp.sqrt(speed)
    assert model.turning_point_equation == sp.Eq(speed, 0)
    assert model.liftoff_equation == sp.Eq(speed / length + g * sp.cos(theta), 0)
    assert model.cusp is None
    assert model.defaults == (("L", None), ("g", "9.81"), ("m", "1"))
    assert model.positive == ("L",)
    assert model.period == 2 * sp.pi


def test_cusps_are_zeros_of_one_factor():
    """The factor that vanishes at cusps is smooth and changes its sign, so that the runtime can find its zeros."""
    theta = real("theta")
    assert derive(families.cycloid(), Gravity()).cusp == sp.sin(theta / 2)
    assert derive(OTHERS["cusp"], Gravity()).cusp == real("t")
    assert derive(OTHERS["involute"], Gravity()).cusp == real("t")


def test_an_absolute_value_is_dropped_only_for_a_default_above_zero():
    """A circle declared with a negative radius keeps |R|."""
    text = {"x": "R*cos(t)", "z": "R*sin(t)", "parameter": "t"}
    free = derive(Curve.parametric(**text), Gravity())
    assert (free.ds, free.positive) == (real("R"), ("R",))
    negative = derive(Curve.parametric(**text, parameters={"R": -1}), Gravity())
    assert (negative.ds, negative.positive) == (sp.Abs(real("R")), ())


def test_defaults_can_be_replaced():
    """Defaults can be replaced by exact values, and by None for a parameter that must be given."""
    model = derive(families.circle(L=2), Gravity(), parameters={"L": "3/2", "g": None, "m": 0.5})
    assert model.defaults == (("L", "3/2"), ("g", None), ("m", 0.5))


@pytest.mark.parametrize(
    ("parameters", "word"),
    [({"q": 1}, "'q'"), ({"L": -1}, "positive"), ({"m": 0}, "positive")],
)
def test_wrong_defaults_are_refused(parameters, word):
    """Unknown names are refused, and so are negative values for what a family requires to be positive."""
    with pytest.raises(DeclarationError, match=word):
        derive(families.circle(), Gravity(), parameters=parameters)


def test_a_curve_that_is_nowhere_real_is_refused():
    """The refusal names the form that is not real."""
    with pytest.raises(DerivationError, match="contains I"):
        derive(Curve.graph("sqrt(-1 - x**2)"), Gravity())


def test_latex_is_one_aligned_block():
    """A notebook shows every form in one block, with the launch as θ₀ and V₀."""
    text = derive(families.circle(), Gravity())._repr_latex_()
    assert text.startswith("$\\displaystyle \\begin{aligned}")
    assert r"\theta_{0}" in text
    assert "V_{0}" in text
    assert text.count("&=") == 13


@pytest.mark.extended
def test_the_forms_are_the_same_under_every_hash_seed(tmp_path, capsys):
    """No order depends on a set: this process and another one, whose seeds differ, print the same."""
    script = (
        "from gqm_sym.declare import Curve, families\n"
        "from gqm_sym.derivation import derive\n"
        "from gqm_sym.kernels import *\n"
        "odd = Curve.parametric(x='b*sin(t)*exp(c*t)', z='a*sin(3*t + d)', parameter='t')\n"
        "for curve in (odd, families.ellipse(a='p'), Curve.polar('r1 + r2*cos(theta)')):\n"
        "    model = derive(curve, Gravity() + CentralForce(centre=('u', 'w')))\n"
        "    print(model.closed_forms(), model.defaults, model.positive, model.latex())\n"
    )
    seed = "2" if os.environ.get("PYTHONHASHSEED") == "1" else "1"
    environment = {**os.environ, "PYTHONHASHSEED": seed}
    done = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=True)
    (tmp_path / "script.py").write_text(script)
    runpy.run_path(str(tmp_path / "script.py"))
    assert capsys.readouterr().out == done.stdout
    assert len(done.stdout) > 1000


@pytest.mark.parametrize("z", ["log(-exp(x))", "asin(2 + x**2)", "acosh(sin(x)/2)", "sqrt(-1 - x**2)"])
def test_a_height_that_is_nowhere_real_is_refused(z: str) -> None:
    """An expression that is complex at every place is refused when it is derived, by name."""
    with pytest.raises(GQMError, match=r"z: |ds.dx: "):
        derive(Curve.graph(z, parameter="x"), Gravity())


def test_a_height_that_is_real_somewhere_is_kept() -> None:
    """A curve that is real on part of the line is accepted, and the motion ends where it is no longer real."""
    assert derive(Curve.graph("sqrt(x)", parameter="x"), Gravity()).z == sp.sqrt(sp.Symbol("x", real=True))


def test_a_parameter_without_a_default_is_not_guessed() -> None:
    """Nothing is refused before the parameters are given; sqrt(1 - ecc**2) is real for proper eccentricities."""
    model = derive(Curve.parametric(x="a*cos(u)", z="a*sqrt(1 - ecc**2)*sin(u)", parameter="u"), Gravity())
    assert model.parameters == ("a", "ecc", "g", "m")
