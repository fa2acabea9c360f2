"""Forces about a pole, and turning along closed curves, have forms in which sines and cosines have combined."""

from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from mpmath import cos, mp, mpf, quad, sin, sqrt
from scipy.integrate import solve_ivp

import gqm_sym as gqm
from gqm_sym.derivation.algebra.rewrite import without_waves

U, V = sp.symbols("u v", real=True)
S, C = sp.sin, sp.cos

DIPOLE = gqm.Curve.polar("R*cos(th)**2", parameter="th", domain=("-pi/2", "pi/2"))
MIRROR = gqm.Potential("mu_B*sqrt(1 + 3*z**2/(x**2 + z**2))/(x**2 + z**2)**(3/2)")


@pytest.fixture(scope="module")
def field_line(tmp_path_factory):
    """Return the field line of a magnetic dipole about which a charge gyrates; its mirror force has a potential."""
    folder = Path(tmp_path_factory.mktemp("dipole"))
    return gqm.build(gqm.derive(DIPOLE, MIRROR), name="field_line", folder=folder)


def bounce(degrees: int) -> mpf:
    """Return a quarter of the bounce period at unit speed, by quadrature in 45 digits."""
    with mp.workdps(45):
        a = mp.radians(degrees)
        field = lambda th: sqrt(1 + 3 * sin(th) ** 2) / cos(th) ** 6  # noqa: E731
        left = lambda th: 1 - sin(a) ** 2 * field(th)  # noqa: E731
        excess = lambda th: mp.log(sin(a) ** 2 * field(th))  # noqa: E731
        mirror = mp.findroot(excess, (mpf(0), mp.pi / 2 - mpf("1e-3")), solver="anderson", tol=mpf(10) ** -70)
        # With th = mirror*sin(w) the root of V**2 at the mirror point cancels against the cosine.
        rate = lambda w: (  # noqa: E731
            cos(mirror * sin(w))
            * sqrt(1 + 3 * sin(mirror * sin(w)) ** 2)
            * mirror
            * cos(w)
            / sqrt(abs(left(mirror * sin(w))) + mpf(10) ** -45)
        )
        return quad(rate, mp.linspace(0, mp.pi / 2, 9))


@pytest.mark.sample(2)
@pytest.mark.parametrize(("degrees", "known"), [(15, "1.14488841"), (10, "1.20288213"), (5, "1.27032319")])
def test_the_quadrature_agrees_with_published_values(degrees, known):
    """The quadrature agrees with values found elsewhere."""
    assert abs(bounce(degrees) - mpf(known)) < 1e-8


@pytest.mark.extended
@pytest.mark.parametrize("degrees", [80, 60, 45, 30, 20, 16, 15, 10, 5, 3, 2, 1])
def test_a_field_line_has_mirror_points(degrees, field_line):
    """A field line has mirror points however far out they lie, where the potential grows without bounds."""
    a = np.radians(degrees)
    motion = field_line.solve(0, float(np.cos(a)), 1, mu_B=float(np.sin(a) ** 2 / 2), R=1)
    assert motion.kind == "libration"
    assert motion.half_period / 2 == pytest.approx(float(bounce(degrees)), rel=1e-13)


def test_no_form_keeps_what_adds_up_to_one():
    """x**2 + z**2 becomes r**2 in the potential, in its slope and in both forces."""
    model = gqm.derive(DIPOLE, MIRROR)
    for form in (
        model.potential,
        model.effective_potential_slope,
        model.tangential_acceleration,
        model.static_normal_load,
    ):
        assert not form.has(sp.cos(model.parameter) ** 2 + sp.sin(model.parameter) ** 2)
    spiral = gqm.derive(gqm.families.log_spiral(), gqm.CentralForce())
    assert not spiral.tangential_acceleration.has(sp.sin, sp.cos)
    assert not spiral.normal_force.has(sp.sin, sp.cos)


@pytest.mark.parametrize(
    ("form", "rewritten"),
    [
        (S(U) ** 2 + C(U) ** 2, sp.S.One),
        (V * S(U) ** 2 + V * C(U) ** 2 + V, 2 * V),
        (V * S(U) ** 2 * C(U) ** 4 + V * C(U) ** 6, V * C(U) ** 4),
        (sp.sqrt(1 + S(V) ** 2 + C(V) ** 2), sp.sqrt(2)),
        (S(U) ** 2 + C(V) ** 2, S(U) ** 2 + C(V) ** 2),
        (2 * S(U) ** 2 + C(U) ** 2, 2 * S(U) ** 2 + C(U) ** 2),
        (S(U) ** 2 - C(U) ** 2, S(U) ** 2 - C(U) ** 2),
        (S(U) + C(U), S(U) + C(U)),
        (sp.exp(-V * (S(U) ** 4 + S(U) ** 2 * C(U) ** 2)), sp.exp(-V * S(U) ** 2)),
    ],
)
def test_squares_of_sine_and_cosine_are_one(form, rewritten):
    """Squares of sine and cosine add up to one, with their common factors, and nothing else is changed."""
    assert without_waves(form) == rewritten


# A droplet where the tangent's angle has no closed form without jumps

DROPLET = gqm.SurfaceTension(gamma="1/2", ell_c="1/5")
CLOSED = {
    "limacon": gqm.Curve.polar("1 + 2*cos(theta)", period="2*pi"),
    "dimpled": gqm.Curve.polar("a + b*cos(theta)", period="2*pi", parameters={"a": 3, "b": 2}),
    "lissajous": gqm.Curve.parametric(x="sin(3*t)", z="sin(2*t)", parameter="t", period="2*pi"),
    "eight": gqm.Curve.parametric(
        x="A*sin(t)", z="B*sin(2*t)", parameter="t", period="2*pi", parameters={"A": 2, "B": 1}
    ),
}


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", CLOSED)
@pytest.mark.parametrize("form", ["resistance", "printed"])
def test_a_droplet_runs_along_a_closed_curve(name, form, tmp_path):
    """V**2 of a droplet agrees with DOP853 of dW/dlam on the first leg, through all changes of curvature."""
    curve = CLOSED[name]
    kernel = gqm.Gravity() + gqm.SurfaceTension(gamma="1/2", ell_c="1/5", form=form)
    model = gqm.derive(curve, kernel)
    module = gqm.build(model, name=f"droplet_{name}_{form}", folder=tmp_path)
    lam = curve.parameter
    values = {sp.Symbol(n, real=True): sp.sympify(v) for n, v in curve.defaults}
    dx, dz = (sp.diff(c.xreplace(values), lam) for c in (curve.x, curve.z))
    turn = dx * sp.diff(dz, lam) - dz * sp.diff(dx, lam)
    bend = (sp.Abs(turn) if form == "resistance" else turn) / (dx**2 + dz**2)
    share = sp.Rational(1, 2) * sp.Rational(1, 5) ** (2 if form == "resistance" else 1)
    slope = sp.lambdify(lam, -2 * sp.Float("9.81", 30) * dz - 2 * share * bend)
    places = np.linspace(0.3, 2.0, 9)
    truth = solve_ivp(lambda s, w: [slope(s)], (0.3, 2.0), [100.0], "DOP853", t_eval=places, rtol=1e-12, atol=1e-12)
    field = module.pass1(places, 0.3, 10.0)
    np.testing.assert_allclose(field.v2, truth.y[0], rtol=1e-9)
