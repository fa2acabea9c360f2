"""Curves read, keep and refuse what they should."""

import pytest
import sympy as sp

import gqm_sym as gqm
from gqm_sym.declare import Curve, families
from gqm_sym.errors import DeclarationError, InputError, NumberError

x, theta, L, R = (sp.Symbol(name, real=True) for name in ("x", "theta", "L", "R"))


def test_graph_and_its_parametric_form_have_the_same_coordinates():
    """A graph is the parametric curve (x, z(x))."""
    graph = Curve.graph("a*x**2", parameter="x")
    parametric = Curve.parametric(x="x", z="a*x**2", parameter="x")
    assert (parametric.x, parametric.z) == (graph.x, graph.z)
    assert (graph.kind, parametric.kind) == ("graph", "parametric")


def test_polar_keeps_its_radius():
    """The coordinates are r cos θ and r sin θ, and r is kept for the derivation."""
    curve = Curve.polar("a*theta")
    a = sp.Symbol("a", real=True)
    assert curve.radius == a * theta
    assert curve.x == a * theta * sp.cos(theta)
    assert curve.z == a * theta * sp.sin(theta)


def test_expressions_of_sympy_are_taken_like_text():
    """Complex symbols of the user's become real ones."""
    t, radius = sp.symbols("t R")
    assert Curve.parametric(x=radius * sp.cos(t), z=radius * sp.sin(t), parameter="t") == (
        Curve.parametric(x="R*cos(t)", z="R*sin(t)", parameter="t")
    )


def test_parameters_keep_the_order_of_their_declaration():
    """The order of the mapping comes first, and then the other parameters in order of appearance."""
    curve = Curve.graph("a*x**2 + b*x + c", parameters={"c": 1, "a": "1/3"})
    assert curve.defaults == (("c", 1), ("a", "1/3"), ("b", None))
    assert curve.parameters == ("c", "a", "b")


def test_domain_and_period_may_contain_parameters():
    """Ends of a domain are expressions in run-time parameters, and either end may be open."""
    curve = Curve.parametric(x="L*cos(u)", z="L*sin(u)", parameter="u", period="2*pi", domain=(None, "w"))
    assert curve.domain == (None, sp.Symbol("w", real=True))
    assert curve.period == 2 * sp.pi
    assert curve.parameters == ("L", "w")


def test_gravity_in_a_curve_has_its_usual_default():
    """In every curve m and g mean mass and gravity."""
    assert Curve.graph("x**2/g").defaults == (("g", "9.81"),)


def test_lam_is_a_name_for_a_curves_parameter_only():
    """Only a curve's parameter may be called lam, because emitted functions call their argument so."""
    assert Curve.graph("lam**2", parameter="lam").parameter.name == "lam"
    with pytest.raises(InputError, match="lam"):
        Curve.graph("lam*x**2", parameter="x")


@pytest.mark.parametrize(
    ("declare", "words"),
    [
        pytest.param(lambda: Curve.parametric(x="a", z="b", parameter="t"), ["'t'", "point"], id="a point"),
        pytest.param(lambda: Curve.graph("x", parameters={"q": 1}), ["'q'", "not used"], id="unused"),
        pytest.param(lambda: Curve.graph("x", domain=("x", 1)), ["domain", "'x'"], id="domain in x"),
        pytest.param(lambda: Curve.graph("x", domain=(1, 1)), ["lo < hi"], id="empty domain"),
        pytest.param(lambda: Curve.graph("x", domain=(1,)), ["two ends"], id="one end"),
        pytest.param(lambda: Curve.graph("x", domain="01"), ["two ends"], id="text for a domain"),
        pytest.param(
            lambda: Curve.parametric(x="cos(t)", z="sin(t)", parameter="t", period="-1"),
            ["period", "positive"],
            id="negative period",
        ),
        pytest.param(
            lambda: Curve.parametric(x="x*t", z="t", parameter="t"),
            ["'x'", "coordinate"],
            id="a coordinate as a parameter",
        ),
        pytest.param(lambda: Curve.graph("x", parameter="sin"), ["sin"], id="a function's name"),
        pytest.param(lambda: Curve.graph("k*x", parameters={"k": "j"}), ["'j'"], id="no number"),
        pytest.param(lambda: Curve.graph("x", positive=("a",)), ["'a'", "positive"], id="idle promise"),
    ],
)
def test_a_wrong_declaration_is_refused(declare, words):
    """The message names what is wrong."""
    with pytest.raises(InputError) as caught:
        declare()
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), True, [1]])
def test_a_default_must_be_a_finite_number(value):
    """NaN, infinities, truth values and lists are no numbers."""
    with pytest.raises(NumberError):
        Curve.graph("k*x", parameters={"k": value})


def test_every_family_declares_itself():
    """Each row of the table gives a curve with its arguments as parameters, lengths positive."""
    for name, row in families.FAMILIES.items():
        curve = getattr(families, name)()
        assert curve.parameters == row.arguments, name
        assert curve.positive == tuple(a for a in row.arguments if a not in row.signed), name
        assert curve.title, name


def test_a_family_takes_names_and_values():
    """Each argument takes another name or a value, which is a default."""
    curve = families.ellipse(a=2, b="b_e")
    assert curve.defaults == (("a", 2), ("b_e", None))
    assert curve.z == sp.Symbol("b_e", real=True) * sp.sin(theta)


def test_the_circle_is_measured_from_the_downward_vertical():
    """The circle is that of Table 3, row 2, with its angle from the downward vertical."""
    curve = families.circle()
    assert (curve.x, curve.z) == (L * sp.sin(theta), -L * sp.cos(theta))
    assert curve.period == 2 * sp.pi


def test_the_inverted_cycloid_hangs():
    """inverted=True turns the printed arch upside down, which gives the tautochrone."""
    arch, hanging = families.cycloid(), families.cycloid(inverted=True)
    assert arch.z == R * (1 - sp.cos(theta))
    assert hanging.z == -arch.z
    assert hanging.x == arch.x
    assert hanging.domain == arch.domain == (0, 2 * sp.pi)


def test_cartesian_graph_is_graph():
    """``cartesian_graph`` is the paper's name for ``graph``."""
    assert families.cartesian_graph("a*x**4") == Curve.graph("a*x**4")


@pytest.mark.parametrize(
    ("declare", "word"),
    [
        pytest.param(lambda: families.circle(R=1), "'R'", id="unknown argument"),
        pytest.param(lambda: families.ellipse(a="q", b="q"), "two things", id="one name twice"),
        pytest.param(lambda: families.circle(L="theta"), "two things", id="the parameter's name"),
    ],
)
def test_a_wrong_family_call_is_refused(declare, word):
    """Unknown arguments and names with two meanings are refused."""
    with pytest.raises(DeclarationError, match=word):
        declare()


def test_an_unknown_family_is_no_attribute():
    """The message for an unknown family lists the families."""
    with pytest.raises(AttributeError, match="cycloid"):
        families.spirograph  # noqa: B018


def test_names_that_are_listed() -> None:
    """Every name that `dir` lists can be fetched, and the families are listed by their module."""
    assert dir(gqm) == sorted(gqm.__all__)
    for name in dir(gqm):
        assert getattr(gqm, name) is not None
    assert {"circle", "ellipse", "cycloid"} <= set(dir(gqm.families))


def test_objects_are_displayed_in_one_line():
    """Curves, laws and models are shown by what they are, however many points or terms they have."""
    points = [[u / 100.0, (u / 100.0) ** 2] for u in range(500)]
    track, law = gqm.Curve.sampled(points), gqm.Gravity() + gqm.CoulombFriction()
    assert repr(track) == "<Curve: a quintic spline through 500 points, open, in arc length s [m]>"
    assert repr(law) == "<Force law, dissipative: gravity, coulomb>"
    assert repr(gqm.derive(track, gqm.Gravity())).startswith("<Model: sampled curve, gravity")
