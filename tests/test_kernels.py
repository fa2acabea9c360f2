"""Force laws: slots that add, names that must not clash."""

import pytest
import sympy as sp

from gqm_sym.declare import Curve, families
from gqm_sym.derivation import derive
from gqm_sym.errors import DeclarationError, InputError
from gqm_sym.kernels import (
    KERNELS,
    CentralForce,
    Gravity,
    Kernel,
    Potential,
    Rolling,
    RotatingFrame,
)

x, z, g, k, beta, Omega = (sp.Symbol(name, real=True) for name in ("x", "z", "g", "k", "beta", "Omega"))


def test_gravity_has_the_exact_default():
    """It is 9.81, exactly: text, not its nearest double."""
    assert Gravity().potential == g * z
    assert Gravity().defaults == (("g", "9.81"),)


@pytest.mark.parametrize(
    ("given", "pair"),
    [(1.62, ("g", 1.62)), ("g_moon", ("g_moon", "9.81")), ("1.62", ("g", "1.62"))],
)
def test_gravity_takes_a_name_or_a_value(given, pair):
    """As every kernel's argument does."""
    assert Gravity(g=given).defaults == (pair,)


def test_slots_add():
    """Potentials add, inertias add their excess over 1, parameters keep their order."""
    both = Gravity() + Rolling() + RotatingFrame()
    assert both.potential == g * z - Omega**2 * x**2 / 2
    assert both.inertia == 1 + beta
    assert both.parameters == ("g", "beta", "Omega")
    assert [name for name, _ in both.terms] == ["gravity", "rolling", "rotating_frame"]


def test_adding_is_associative():
    """Whichever sum is formed first."""
    terms = Gravity(), Rolling(), CentralForce()
    assert (terms[0] + terms[1]) + terms[2] == terms[0] + (terms[1] + terms[2])


def test_gravity_is_shared_with_a_potential_that_names_it():
    """Everywhere g means gravity."""
    law = Gravity() + Potential("g*x/10 + c*x**2", parameters={"c": 2})
    assert law.defaults == (("g", "9.81"), ("c", 2))


@pytest.mark.parametrize(
    "add",
    [
        pytest.param(lambda: Gravity() + Gravity(), id="gravity twice"),
        pytest.param(lambda: CentralForce() + Potential("k*x"), id="k of both"),
        pytest.param(lambda: Gravity(g=1) + Potential("g*x"), id="two values of g"),
    ],
)
def test_a_name_that_means_two_things_is_refused(add):
    """With the remedy in the message."""
    with pytest.raises(DeclarationError, match=r"another name|once"):
        add()


def test_curve_and_kernel_must_not_share_a_name():
    """The ellipse's b and another b."""
    with pytest.raises(DeclarationError, match=r"'b'.*another name"):
        derive(families.ellipse(), Potential("b*z"))
    with pytest.raises(DeclarationError, match="theta"):
        derive(families.circle(), Potential("theta*z"))


@pytest.mark.parametrize("centre", [(0,), (0, 0, 0), ("x", 0)])
def test_a_centre_is_two_numbers(centre):
    """Of the plane, and not moving with the body."""
    with pytest.raises(InputError, match="centre"):
        CentralForce(centre=centre)


def test_only_kernels_add():
    """Anything else is a TypeError, as Python's own."""
    with pytest.raises(TypeError):
        Gravity() + 1


@pytest.mark.parametrize(
    ("kernel", "potential"),
    [
        pytest.param(Gravity(), g * z, id="gravity"),
        pytest.param(RotatingFrame(), -(Omega**2) * x**2 / 2, id="rotating frame"),
        pytest.param(Potential("k*x*z"), k * x * z, id="potential"),
        pytest.param(CentralForce(), -k / sp.sqrt(x**2 + z**2), id="central force"),
    ],
)
def test_the_force_along_a_curve_is_minus_the_gradient(kernel: Kernel, potential):
    """A = F·t and n₀ = -F·n with F = -∇U, on z = sinh(x), by SymPy's own derivatives."""
    model = derive(Curve.graph("sinh(x)"), kernel)
    place = {x: sp.Rational(7, 10), Omega: 2, k: 3, g: sp.Rational(981, 100)}
    push = [-sp.diff(potential, along).subs(z, sp.sinh(x)).subs(place).evalf(40) for along in (x, z)]
    tangent = [sp.S.One, sp.cosh(x).subs(place).evalf(40)]
    length = sp.sqrt(tangent[0] ** 2 + tangent[1] ** 2)
    along = (push[0] * tangent[0] + push[1] * tangent[1]) / length
    normal = (-push[0] * tangent[1] + push[1] * tangent[0]) / length
    assert abs(model.kernel.subs(place).evalf(40) - along) < 1e-37
    assert abs(model.reaction.subs(place).evalf(40) + normal) < 1e-37


def test_rolling_divides_what_drives_but_not_what_presses():
    """W and A are those of sliding over 1 + β; n₀ is that of sliding."""
    sliding = derive(families.parabola(), Gravity())
    rolling = derive(families.parabola(), Gravity() + Rolling())
    assert sp.simplify(rolling.climb * (1 + beta) - sliding.climb) == 0
    assert sp.simplify(rolling.kernel * (1 + beta) - sliding.kernel) == 0
    assert rolling.reaction == sliding.reaction


def test_the_table_of_kernels_makes_each_of_them():
    """Every row is a kernel that says its own name."""
    for name, row in KERNELS.items():
        kernel = row.make("z**2") if name == "potential" else row.make()
        assert kernel.terms[0][0] == name
        assert row.summary
