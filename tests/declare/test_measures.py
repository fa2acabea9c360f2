"""Curves, forces and models describe themselves, and can be copied and sent to another process."""

import copy
import pickle
import subprocess
import sys

import pytest

import gqm_sym as gqm
from gqm_sym.declare.measures import curve_formulas
from gqm_sym.dimensions import COMMON, found_dimensions, unit_of
from gqm_sym.kernels.base import kernel_formulas

GRAVITY = gqm.Gravity()
CURVES = {
    "graph": gqm.Curve.graph("a*x**2 + b*x", parameters={"a": 2}, domain=(-2, None)),
    "family": gqm.families.ellipse(a="3/2"),
    "polar": gqm.Curve.polar("p/(1 + ecc*cos(theta))"),
    "implicit": gqm.Curve.implicit("(x/a)**4 + (z/b)**4 - 1", start=("a", 0)),
    "sampled": gqm.Curve.sampled([(i, i * i / 10) for i in range(8)]),
    "rail": gqm.Curve.piecewise([gqm.line(length="a"), gqm.arc(radius="R", angle="pi/2")]),
}
FORCES = {
    "gravity": GRAVITY,
    "losses": GRAVITY + gqm.CoulombFriction(mu="mu_r") + gqm.QuadraticDrag() + gqm.SurfaceTension(),
    "law": GRAVITY + gqm.Kernel.law("-direction*(c1*W + c2*W**2)"),
    "frame": gqm.RotatingFrame() + gqm.CoulombFriction() + gqm.Potential("w**2*x**2/2"),
    "rolling": GRAVITY + gqm.Rolling(radius="rho", mu_static="1/2"),
}
SAID = {
    "graph": ["graph", "in x [m]", "z = a*x**2 + b*x", "-2 <= x <= oo", "a = 2 1/m", "b (no default)"],
    "family": ["Ellipse", "theta [rad]", "period 2*pi of theta", "a = 3/2 m", "b (m, no default)"],
    "polar": ["polar", "r = p/(ecc*cos(theta) + 1)", "p (m, no default)", "ecc (no default)"],
    "implicit": ["implicit", "F = -1 + ", "start = (a, 0)", "a (m, no default)"],
    "sampled": ["quintic spline through 8 points, open"],
    "rail": ["rail of 2 pieces (line, arc)", "R (m, no default)"],
}
TOLD = {
    "gravity": ["conservative", "g = 9.81 m/s**2"],
    "losses": ["dissipative", "mu_r (no default)", "b (kg/m, no default)", "gamma (N/m, no default)"],
    "law": ["c1 (1/m, no default)", "c2 (s**2/m**3, no default)"],
    "frame": ["Omega (1/s, no default)", "w (1/s, no default)"],
    "rolling": ["beta (no default)", "rho (m, no default)"],
}


@pytest.mark.parametrize("name", CURVES)
def test_a_curve_says_what_it_is(name):
    """A curve describes itself in a few lines, with units where its formulas determine them."""
    text = str(CURVES[name])
    assert len(text.splitlines()) <= 6
    assert all(len(line) < 120 for line in text.splitlines())
    for words in SAID[name]:
        assert words in text


@pytest.mark.parametrize("name", FORCES)
def test_a_force_says_what_it_is(name):
    """A force describes itself with one line for each term."""
    text = str(FORCES[name])
    assert len(text.splitlines()) == len(FORCES[name].terms) + 2
    for words in TOLD[name]:
        assert words in text


@pytest.mark.sample(3)
@pytest.mark.parametrize("curve", CURVES)
@pytest.mark.parametrize("force", ["gravity", "losses", "law"])
def test_a_model_says_what_it_is(curve, force):
    """A model prints its closed forms with their units, shortened, and its parameters."""
    track, law = CURVES[curve], FORCES[force]
    if set(track.parameters) & set(law.parameters):
        law = GRAVITY
    text = str(gqm.derive(track, law))
    assert "V**2 [m**2/s**2] = " in text
    assert "N [N] = " in text
    assert "m = 1 kg" in text
    assert len(text.splitlines()) <= 12


@pytest.mark.extended
@pytest.mark.parametrize("make", [copy.copy, copy.deepcopy, lambda thing: pickle.loads(pickle.dumps(thing))])
def test_everything_declared_can_be_copied(make):
    """Everything that is declared can be copied, and the copy is the same."""
    for thing in (*CURVES.values(), *FORCES.values()):
        assert make(thing) == thing
    for curve, force in (("family", "law"), ("implicit", "gravity"), ("rail", "losses"), ("polar", "frame")):
        model = gqm.derive(CURVES[curve], FORCES[force])
        assert make(model) == model
        assert gqm.emit(make(model), name="copied") == gqm.emit(model, name="copied")


@pytest.mark.extended
def test_a_model_arrives_in_another_process(tmp_path):
    """A model can be sent to another process and gives the same module there, unknown functions and charts included."""
    models = [
        gqm.derive(CURVES[curve], FORCES[force])
        for curve, force in (("family", "law"), ("rail", "losses"), ("implicit", "gravity"))
    ]
    (tmp_path / "models").write_bytes(pickle.dumps(models))
    code = (
        "import pickle, sys, gqm_sym; "
        f"models = pickle.load(open({str(tmp_path / 'models')!r}, 'rb')); "
        "sys.stdout.write(chr(10).join(gqm_sym.emit(model, name='sent') for model in models))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "\n".join(gqm.emit(model, name="sent") for model in models)


# Units by dimension


def units(formulas) -> dict[str, str]:
    """Return the units of everything that formulas determine."""
    return {name: unit_of(found) for name, found in found_dimensions(formulas, COMMON).items()}


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("a*x**2 + b*x + c", {"a": "1/m", "b": "1", "c": "m"}),
        ("A*cos(k*x + phi)", {"A": "m", "k": "1/m"}),
        ("a*exp(-x**2/(2*s**2))", {"a": "m", "s": "m"}),
        ("b*sqrt(1 + (x/a)**2)", {"a": "m", "b": "m"}),
        ("sqrt(x**2 + a**2)", {"a": "m"}),
        ("(a - 1/10)*sin(k*x)", {"a": "m", "k": "1/m"}),
        ("A*tanh(x/w) + B*x*(1 - x/q)", {"A": "m", "w": "m", "B": "1", "q": "m"}),
        ("x**3 + a", {"a": "m"}),
    ],
)
def test_a_graph_tells_the_units_of_its_parameters(text, told):
    """Each term of a graph determines the unit of its parameters."""
    assert told.items() <= units(curve_formulas(gqm.Curve.graph(text))).items()


@pytest.mark.parametrize("text", ["h*(x**4 - 2*x**2)", "h*(x**2 - 1)**2", "a*b*x", "x**3", "h*x**n", "cos(x)"])
def test_a_number_may_hide_a_unit(text):
    """h*(x**4 - 2*x**2) is in metres only if x counts metres, so that the unit of h is not determined."""
    names = {"h", "a", "b"} & set(gqm.Curve.graph(text).parameters)
    assert not names & units(curve_formulas(gqm.Curve.graph(text))).keys()


def test_formulas_that_contradict_each_other_tell_nothing():
    """If formulas use the same parameter as a slope and as a height, its unit is not determined."""
    assert "a" not in units(curve_formulas(gqm.Curve.graph("a*x + a*x**2")))


@pytest.mark.parametrize(
    ("kernel", "told"),
    [
        (gqm.Potential("w**2*(x**2 + (z - h)**2)/2"), {"w": "1/s", "h": "m"}),
        (gqm.Potential("mu_B*sqrt(1 + 3*z**2/(x**2 + z**2))/(x**2 + z**2)**(3/2)"), {"mu_B": "m**5/s**2"}),
        (gqm.CentralForce(centre=("cx", 0)), {"cx": "m", "k": "m**3/s**2"}),
        (gqm.Kernel.law("-direction*(c1*W + c2*W**2)"), {"c1": "1/m", "c2": "s**2/m**3"}),
        (gqm.QuadraticDrag(b="b_air"), {"b_air": "kg/m"}),
        (gqm.Rolling(radius="rho") + gqm.RotatingFrame(), {"rho": "m", "beta": "1", "Omega": "1/s"}),
    ],
)
def test_a_force_tells_the_units_of_its_parameters(kernel, told):
    """Energies and accelerations determine the units of a force's parameters."""
    assert told.items() <= units(kernel_formulas(kernel)).items()


def test_a_printed_model_is_no_promise_of_formulas():
    """A printed model shortens formulas that are too long with an ellipsis; they are complete in closed_forms()."""
    model = gqm.derive(gqm.Curve.graph("x**3"), GRAVITY + gqm.CoulombFriction())
    assert "..." in str(model)
    assert "..." not in str(dict(model.closed_forms())["W = V**2"])
    assert "_x" in str(dict(model.closed_forms())["W = V**2"])
