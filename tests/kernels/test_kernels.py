"""The slots of force laws add up, and their names must not clash."""

import pytest
import sympy as sp

from gqm_sym.declare import Curve, families
from gqm_sym.derivation import derive
from gqm_sym.errors import DeclarationError, DerivationError, InputError
from gqm_sym.kernels import (
    KERNELS,
    CentralForce,
    CoulombFriction,
    Gravity,
    Kernel,
    LinearDrag,
    Potential,
    QuadraticDrag,
    Rolling,
    RotatingFrame,
    SurfaceTension,
)
from gqm_sym.kernels.base import KAPPA, MASS, W, Y, units_of

x, z, g, k, beta, Omega = (sp.Symbol(name, real=True) for name in ("x", "z", "g", "k", "beta", "Omega"))
mu, b, gamma, ell_c = (sp.Symbol(name, real=True) for name in ("mu", "b", "gamma", "ell_c"))


def test_gravity_has_the_exact_default():
    """The default is exactly 9.81, not the nearest double."""
    assert Gravity().potential == g * z
    assert Gravity().defaults == (("g", "9.81"),)


@pytest.mark.parametrize(
    ("given", "pair"),
    [(1.62, ("g", 1.62)), ("g_moon", ("g_moon", "9.81")), ("1.62", ("g", "1.62"))],
)
def test_gravity_takes_a_name_or_a_value(given, pair):
    """Gravity takes a name or a value, as every argument of a kernel does."""
    assert Gravity(g=given).defaults == (pair,)


def test_slots_add():
    """Potentials add, inertias add their excess over 1, parameters keep their order."""
    both = Gravity() + Rolling() + RotatingFrame()
    assert both.potential == g * z - Omega**2 * (x**2 + Y**2) / 2
    assert both.inertia == 1 + beta
    assert both.parameters == ("g", "beta", "Omega")
    assert [name for name, _ in both.terms] == ["gravity", "rolling", "rotating_frame"]


def test_adding_is_associative():
    """The sum is the same whichever part of it is formed first."""
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
    """A name with two meanings is refused, with the remedy in the message."""
    with pytest.raises(DeclarationError, match=r"another name|once"):
        add()


def test_curve_and_kernel_must_not_share_a_name():
    """A curve and a kernel must not use one name for two things, as the ellipse's b and another b."""
    with pytest.raises(DeclarationError, match=r"'b'.*another name"):
        derive(families.ellipse(), Potential("b*z"))
    with pytest.raises(DeclarationError, match="theta"):
        derive(families.circle(), Potential("theta*z"))


@pytest.mark.parametrize("centre", [(0,), (0, 0, 0, 0), ("x", 0), (0, "y", 0)])
def test_a_centre_is_two_numbers(centre):
    """A centre is two numbers in a plane, or three in space, and does not move with the body."""
    with pytest.raises(InputError, match="centre"):
        CentralForce(centre=centre)


def test_a_centre_may_have_units():
    """The coordinates of a centre are lengths and may have units (the unit was refused)."""
    assert CentralForce(centre=("50 cm", "1 m")) == CentralForce(centre=("1/2", 1))
    with pytest.raises(InputError, match="must be in m"):
        CentralForce(centre=("2 s", 0))


def test_only_kernels_add():
    """Adding anything else raises a TypeError, like Python's own."""
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
    """On z = sinh(x), A is F·t and n₀ is -F·n with F = -∇U, by SymPy's own derivatives."""
    model = derive(Curve.graph("sinh(x)"), kernel)
    place = {x: sp.Rational(7, 10), Omega: 2, k: 3, g: sp.Rational(981, 100)}
    push = [-sp.diff(potential, along).subs(z, sp.sinh(x)).subs(place).evalf(40) for along in (x, z)]
    tangent = [sp.S.One, sp.cosh(x).subs(place).evalf(40)]
    length = sp.sqrt(tangent[0] ** 2 + tangent[1] ** 2)
    along = (push[0] * tangent[0] + push[1] * tangent[1]) / length
    normal = (-push[0] * tangent[1] + push[1] * tangent[0]) / length
    assert abs(model.tangential_acceleration.subs(place).evalf(40) - along) < 1e-37
    assert abs(model.static_normal_load.subs(place).evalf(40) + normal) < 1e-37


def test_rolling_divides_what_drives_but_not_what_presses():
    """W and A are those of sliding over 1 + β; n₀ is that of sliding."""
    sliding = derive(families.parabola(), Gravity())
    rolling = derive(families.parabola(), Gravity() + Rolling())
    assert sp.simplify(rolling.effective_potential * (1 + beta) - sliding.effective_potential) == 0
    assert sp.simplify(rolling.tangential_acceleration * (1 + beta) - sliding.tangential_acceleration) == 0
    assert rolling.static_normal_load == sliding.static_normal_load


def test_the_table_of_kernels_makes_each_of_them():
    """Every row is a kernel that says its own name."""
    for name, row in KERNELS.items():
        kernel = row.make("z**2") if name in ("potential", "law") else row.make()
        assert kernel.terms[0][0] == name
        assert row.summary


# Forces with losses --------------------------------------------------------------------------


def test_lossy_slots_add() -> None:
    """Each force fills its own slot."""
    law = Gravity() + CoulombFriction(mu_static="mu_s") + QuadraticDrag() + SurfaceTension() + Kernel.law("k*W")
    assert (law.friction, law.static_friction) == (mu, sp.Symbol("mu_s", real=True))
    assert (law.drag, law.resistance) == (b / MASS, gamma * ell_c**2 * sp.Abs(KAPPA) / MASS)
    assert (law.tangential_law, law.potential, law.inertia) == (k * W, g * z, 1)
    assert law.parameters == ("g", "mu", "mu_s", "b", "gamma", "ell_c", "k")
    assert not law.conservative
    assert (Gravity() + Rolling() + RotatingFrame() + CentralForce()).conservative


def test_linear_drag_is_a_law_of_the_speed() -> None:
    """Viscous drag is its tangential acceleration written out, with a unit and a bound for its coefficient."""
    law = Gravity() + LinearDrag(c="1/10")
    assert law.tangential_law == Kernel.law("-direction*c*sqrt(W)/m").tangential_law
    assert (law.parameters, law.at_least, law.conservative) == (("g", "c"), (("c", "0"),), False)
    assert units_of(law)["c"] == "kg/s"


def test_static_friction_is_that_of_sliding_if_nothing_is_said() -> None:
    """If static friction is not given, both coefficients are one parameter."""
    law = CoulombFriction(mu="mu_rail")
    assert law.parameters == ("mu_rail",)
    assert law.friction == law.static_friction == sp.Symbol("mu_rail", real=True)


def test_the_printed_droplet_is_signed() -> None:
    """The printed droplet has the sign of the paper; it drives the body where the curvature is negative."""
    assert SurfaceTension(form="printed").resistance == gamma * ell_c * KAPPA / MASS


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: CoulombFriction(mu=-1), r"'mu' must be at least 0, got -1"),
        (lambda: CoulombFriction(mu="0.3", mu_static="0.2"), r"'mu_static' must be at least mu = 0.3, got 0.2"),
        (lambda: QuadraticDrag(b="-1/2"), r"'b' must be at least 0"),
        (lambda: LinearDrag(c=-1), r"'c' must be at least 0"),
        (lambda: SurfaceTension(gamma=-1), r"'gamma' must be at least 0"),
        (lambda: SurfaceTension(form="wet"), r"form: must be one of resistance, printed, got 'wet'"),
        (lambda: Rolling(beta="-0.1"), r"'beta' must be at least 0"),
        (lambda: Rolling(mu_static=-1), r"'mu_static' must be at least 0"),
        (lambda: CoulombFriction() + CoulombFriction(mu="mu2"), r"coulomb is given twice"),
        (lambda: Gravity() + Rolling() + CoulombFriction(), r"rolling and coulomb exclude each other"),
        (lambda: CoulombFriction() + Gravity() + Rolling(), r"rolling and coulomb exclude each other"),
        (lambda: Kernel.law("k*direction*lam0"), r"'lam0' cannot be a name"),
    ],
)
def test_what_no_force_can_be_is_refused(make, message) -> None:
    """An impossible force is refused at its declaration, with the bound or the remedy."""
    with pytest.raises(InputError, match=message):
        make()


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"mu": -1}, r"'mu' must be at least 0"),
        ({"mu": "0.5", "mu_s": "0.4"}, r"'mu_s' must be at least mu = 0.5, got 0.4"),
        ({"m": 0}, r"'m' must be positive"),
        ({"b": "-1"}, r"'b' must be at least 0"),
    ],
)
def test_defaults_out_of_their_range_are_refused(parameters, message) -> None:
    """Defaults out of their range are refused, also if the model gives them."""
    force = Gravity() + CoulombFriction(mu_static="mu_s") + QuadraticDrag()
    with pytest.raises(DeclarationError, match=message):
        derive(families.parabola(), force, parameters=parameters)


def test_a_law_knows_the_curve_s_parameter_and_coordinates() -> None:
    """In a law, the curve's own parameter comes first, x and z are the place, and other names are run-time
    parameters.
    """
    law = Gravity() + Kernel.law("q*theta + k*z*W - direction*x")
    assert law.parameters == ("g", "q", "theta", "k")
    model = derive(families.circle(), law)
    assert model.parameters == ("L", "q", "k", "g", "m")
    assert model.dissipation.linear
    # z is the name of this curve's own parameter.
    upright = derive(Curve.parametric(x="z**2", z="z", parameter="z"), Gravity() + Kernel.law("-k*z*W"))
    assert upright.parameters == ("k", "g", "m")


@pytest.mark.parametrize(
    ("declare", "message"),
    [
        (lambda: derive(families.circle(), Kernel.law("k*lam*W")), r"law: 'lam' is not known .* parameter is 'theta'"),
        (lambda: derive(Curve.graph("W*x**2"), Gravity() + QuadraticDrag()), r"'W' means V\*\*2"),
        (
            lambda: derive(Curve.graph("contact_sign*x"), Gravity() + CoulombFriction()),
            r"'contact_sign' means the sign of the contact force",
        ),
        (lambda: derive(families.circle(), Potential("theta*z") + Kernel.law("theta*W")), r"'theta' means one thing"),
    ],
)
def test_names_that_forces_need_are_refused(declare, message) -> None:
    """Names that forces need are refused, with their meaning."""
    with pytest.raises(DeclarationError, match=message):
        declare()


def test_a_law_that_is_infinite_at_rest_is_refused() -> None:
    """A law that is infinite at rest is refused, because nothing could be computed for a body that stops."""
    with pytest.raises(DerivationError, match="at rest"):
        derive(families.circle(), Gravity() + Kernel.law("-k*direction/sqrt(W)"))


def test_the_load_across_a_rotating_track() -> None:
    """On a rotating track the Coriolis force acts sideways: N_b = 2 m Ω V dx/ds."""
    model = derive(families.circle(), Gravity() + RotatingFrame())
    v = model.side_force / (2 * MASS * Omega * model.dxds)
    assert sp.simplify(v**2 - sp.Symbol("direction", real=True) ** 2 * model.speed_squared) == 0
    assert "N_b" in dict(model.closed_forms())
    assert derive(families.circle(), Gravity()).side_force == 0


@pytest.mark.parametrize(
    ("owner", "old", "new"),
    [
        (Gravity(), "extra", "tangential_law"),
        (Gravity(), "grip", "static_friction_limit"),
        (derive(families.circle(), Gravity()), "kernel", "tangential_acceleration"),
        (derive(families.circle(), Gravity()), "climb", "effective_potential"),
        (derive(families.circle(), Gravity()), "reaction", "static_normal_load"),
    ],
)
def test_an_old_name_says_the_new_one(owner, old, new):
    """An earlier name raises an AttributeError with the new name, and any other an ordinary one."""
    with pytest.raises(AttributeError, match=rf"{old!r}; it is called '(2\*)?{new}' now$"):
        getattr(owner, old)
    with pytest.raises(AttributeError, match=r"has no attribute 'other'$"):
        owner.other  # noqa: B018
    assert hasattr(owner, new)
