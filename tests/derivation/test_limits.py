"""Derivation and emission refuse some input, and leave other checks to run time."""

import importlib
import os
import subprocess
import sys
from pathlib import Path

import pytest
import sympy as sp
from confined import confined
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym.derivation.algebra.difference import Differences
from gqm_sym.derivation.forces import speed
from gqm_sym.derivation.forces.speed import V0
from gqm_sym.emission import sharing
from gqm_sym.errors import DeclarationError, EmissionError

render = importlib.import_module("gqm_sym.emission.render")  # beside a function of that name
t, a = (sp.Symbol(name, real=True) for name in "ta")


def test_a_domain_that_is_known_at_run_time() -> None:
    """If the ends of the domain are known at run time only, the launch is checked then, instead of the curve before."""
    model = gqm.derive(gqm.Curve.graph("sqrt(q - x)", domain=(None, "q")), gqm.Gravity())
    assert model.parameters == ("q", "g", "m")


@pytest.mark.parametrize("z", ["exp(exp(exp(90*x)))", "sin(exp(exp(90*x)))", "asin(sin(10**200*x))", "abs(x)**900"])
def test_whether_it_is_real_is_soon_known(z: str) -> None:
    """A place is found quickly where the curve is real, though at others its values are towers, or sines of hundreds of
    digits.
    """
    with confined(10.0):
        assert gqm.derive(gqm.Curve.graph(z), gqm.Gravity()).z == gqm.Curve.graph(z).z


@pytest.mark.parametrize(
    "z", ["cosh(10**10*x)/10**10", "exp(10**8*x) - exp(-10**8*x)", "sqrt(x - 10**6)", "log(-x - 10**11)"]
)
def test_curves_of_any_size(z: str) -> None:
    """A curve may be real, within the range of doubles, on less than a nanometre or from a thousand kilometres on."""
    assert gqm.derive(gqm.Curve.graph(z), gqm.Gravity()).z == gqm.Curve.graph(z).z


def test_a_curve_that_is_real_nowhere() -> None:
    """A curve that is complex everywhere is refused."""
    with confined(10.0), pytest.raises(DeclarationError, match=r"z: asin.* is not a real number at any place tried"):
        gqm.derive(gqm.Curve.graph("asin(2 + x**2)"), gqm.Gravity())


def test_the_mass_is_no_curve_s_parameter() -> None:
    """The mass cannot be a curve's parameter, because it means the same everywhere."""
    with pytest.raises(DeclarationError, match="'m' means mass everywhere; give the curve's parameter another name"):
        gqm.derive(gqm.Curve.graph("m**2", parameter="m"), gqm.Gravity())


def test_gravity_may_be_in_the_curve_too() -> None:
    """If the height of a curve contains g, this is the same parameter as gravity."""
    model = gqm.derive(gqm.Curve.graph("x**2/g"), gqm.Gravity())
    assert model.parameters == ("g", "m")
    assert sp.simplify(model.effective_potential_slope - 2 * sp.Symbol("x", real=True)) == 0


@pytest.mark.parametrize(
    ("x", "z"),
    [("cosh(u) - 2*u", "sinh(u)"), ("sinh(u) - 2*u", "cosh(u) + u"), ("cosh(u)**2 - u", "cosh(u) - 2*sinh(u)")],
)
def test_an_angle_without_a_frame_that_turns(x: str, z: str) -> None:
    """Hyperbolic functions rotate nothing, so that the angle is that of the derivatives, up to half turns."""
    model = gqm.derive(gqm.Curve.parametric(x=x, z=z, parameter="u"), gqm.Gravity())
    u = model.parameter
    for place in (-2, sp.Rational(-1, 3), sp.Rational(1, 7), 3):
        want = sp.atan2(sp.diff(model.z, u), sp.diff(model.x, u)).subs(u, place).evalf(30)
        off = (model.turning_angle.subs(u, place) - model.turning_angle.subs(u, 1)).evalf(30) - (
            want - sp.atan2(sp.diff(model.z, u), sp.diff(model.x, u)).subs(u, 1).evalf(30)
        )
        assert abs(off / sp.pi - round(off / sp.pi)) < 1e-25


# Closed forms that are tried


@pytest.fixture(scope="module")
def drag() -> gqm.Model:
    """Return a pendulum with quadratic drag, for which V² has a closed form."""
    return gqm.derive(gqm.families.circle(L=2), gqm.Gravity() + gqm.QuadraticDrag(b="0.1"))


@pytest.mark.parametrize(
    ("added", "agrees"),
    [(0, True), (t, False), (sp.Float(1e-9) * sp.sin(t), False), (sp.sqrt(-1 - t**2), False)],
)
def test_a_closed_form_is_tried_before_it_is_kept(drag: gqm.Model, added: sp.Expr, agrees: bool) -> None:
    """A closed form is kept only if its derivative is that of the law and it is real somewhere."""
    loss = drag.dissipation
    assert loss is not None
    lam, tried = drag.parameter, drag.speed_squared + sp.sympify(added).subs(t, drag.parameter)
    assert speed._agrees(tried, loss, lam, drag.domain) is agrees


def test_any_constant_of_integration_agrees(drag: gqm.Model) -> None:
    """Any constant of integration agrees, because another launch speed is another solution of the same law."""
    loss = drag.dissipation
    assert loss is not None
    faster = drag.speed_squared.subs(V0, V0 + 1)
    assert speed._agrees(faster, loss, drag.parameter, drag.domain)


def test_a_form_that_does_not_agree_becomes_a_quadrature(drag: gqm.Model, monkeypatch: pytest.MonkeyPatch) -> None:
    """A closed form that does not agree is replaced by an integral with the right values."""
    monkeypatch.setattr(speed, "_agrees", lambda *_: False)
    again = gqm.derive(drag.curve, drag.force)
    assert (drag.speed_squared_form, again.speed_squared_form) == ("closed", "quadrature")
    at = {
        "lam0": 0.3,
        "v0": 2,
        "direction": 1,
        "sigma": 1,
        "L": 2,
        "b": 0.1,
        "g": 9.81,
        "m": 1,
        drag.parameter.name: 0.8,
    }
    values = [_number(model.speed_squared, at) for model in (drag, again)]
    with mp.workdps(30):
        assert abs(values[0] - values[1]) < 1e-25


def test_a_speed_that_only_falls() -> None:
    """With drag alone along x**4, V falls by exp(-b/m times the length), which no elementary function gives."""
    model = gqm.derive(gqm.Curve.graph("x**4"), gqm.QuadraticDrag())
    assert model.speed_squared_form == "quadrature"
    found = _number(model.speed_squared, {"lam0": 0, "v0": 3, "direction": 1, "b": 0.5, "m": 2, "x": 1})
    with mp.workdps(30):
        length = mp.quad(lambda x: mp.sqrt(1 + 16 * x**6), [0, 1])
        assert abs(found - 9 * mp.exp(-length / 2)) < 1e-25


def _number(form: sp.Expr, at: dict[str, float]) -> mpf:
    """Return a form at values of its symbols, with its integrals by quadrature."""
    values = {symbol: sp.Rational(str(at[symbol.name])) for symbol in form.free_symbols}
    number = form.xreplace(values).replace(
        lambda part: isinstance(part, sp.Integral), lambda part: sp.Float(part.evalf(30), 30)
    )
    with mp.workdps(30):
        return mpf(str(number.evalf(30)))


# Emission


def test_a_function_without_a_rule_is_named() -> None:
    """A function without a rule is named, because divided differences are known of the grammar's functions only."""
    with pytest.raises(EmissionError, match="gamma: no rule for its divided difference"):
        Differences(t, (a, t), {}).first(sp.gamma(t), 0, 1)


def test_a_formula_that_is_too_large_is_counted_and_not_walked() -> None:
    """A formula of 2**40 parts, of which only forty are different, is counted without a walk over all of them."""
    shared = t
    for _ in range(40):
        shared = sp.Function("f")(shared, shared)
    with pytest.raises(EmissionError, match=f"potential: a formula of {2**41 - 1} operations, and at most"):
        sharing.check_size([shared], where="potential")


def test_templates_that_are_missing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """If templates are missing, the error names them and says what to do."""
    monkeypatch.setattr(render, "__file__", str(tmp_path / "gqm_sym" / "emission" / "render.py"))
    with pytest.raises(EmissionError, match="its templates are missing; install gqm_sym again"):
        render._environment()


def test_templates_of_another_version(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A template gets exactly the variables that it uses."""
    (tmp_path / "templates").mkdir()
    (tmp_path / "templates" / "old").write_text("{{ name }} {{ gone }}", encoding="utf-8")
    monkeypatch.setattr(render, "__file__", str(tmp_path / "gqm_sym" / "emission" / "render.py"))
    environment = render._environment()
    with pytest.raises(EmissionError, match=r"old: wants \['gone', 'name'\], is given \['name'\]"):
        render._fill(environment, "old", {"name": "n"})
    assert render._fill(environment, "old", {"name": "n", "gone": 1}) == "n 1"


def test_what_sympy_takes_as_a_double_is_refused() -> None:
    """Numbers that SymPy would take as doubles are refused: with gmpy2's integers it finds roots by a logarithm in
    doubles.
    """
    pytest.importorskip("gmpy2")
    code = "import gqm_sym as gqm; gqm.derive(gqm.Curve.graph('1e400*u', parameter='u'), gqm.Gravity())"
    environment = {**os.environ, "SYMPY_GROUND_TYPES": "gmpy"}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)
    assert done.stderr.splitlines()[-1] == (
        "gqm_sym.errors.DerivationError: derive: a number is beyond the range of doubles, 10**308; "
        "declare the curve and the forces in other units"
    )
