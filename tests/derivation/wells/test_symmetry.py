"""Forms are even about places of symmetry, and slopes that are said to vanish only there do."""

import pytest
import sympy as sp
from mpmath import mp, mpf

import gqm_sym as gqm

PENDULUM = gqm.Curve.parametric(x="L*cos(theta)", z="L*sin(theta)", parameter="theta", parameters={"L": 1})
# A row has a curve, a place of symmetry, the step to the next, and whether heights between them are monotone.
CASES = {
    "pendulum": (PENDULUM, -sp.pi / 2, sp.pi, True),
    "parabola": (gqm.Curve.graph("x**2", parameter="x"), 0, None, True),
    "parabola, shifted": (gqm.Curve.graph("3*x**2 - x", parameter="x"), sp.Rational(1, 6), None, False),
    "double well": (gqm.Curve.graph("x**4 - 2*x**2", parameter="x"), 0, None, False),
    "cycloid": (gqm.families.cycloid(R=1, inverted=True), sp.pi, sp.pi, False),  # inside its domain, between cusps
    "catenary": (gqm.Curve.graph("cosh(x/2)", parameter="x"), 0, None, True),
    "wave": (gqm.Curve.graph("sin(3*x)", parameter="x"), -sp.pi / 6, sp.pi / 3, True),
    "two waves": (gqm.Curve.graph("cos(x) + cos(2*x)", parameter="x"), 0, sp.pi, False),
    "two waves out of step": (gqm.Curve.graph("sin(x) + cos(3*x)/2 + x/9", parameter="x"), None, None, False),
    "cubic": (gqm.Curve.graph("x**3", parameter="x"), None, None, False),
    "cycloid whose wells have cusps": (
        gqm.Curve.parametric(x="u - sin(u)", z="-cos(u)", parameter="u"),
        -sp.pi,
        sp.pi,
        False,
    ),
    "semicubical parabola": (gqm.Curve.parametric(x="u**3", z="u**2", parameter="u"), None, None, False),
    "conchoid, whose loop hangs": (
        gqm.Curve.polar("b/sin(theta) - a", parameter="theta", parameters={"a": 2, "b": 1}),
        sp.pi / 2,
        sp.pi,
        True,
    ),
    "spiral": (gqm.Curve.polar("exp(theta/5)", parameter="theta"), None, None, False),
}


@pytest.mark.sample(7)
@pytest.mark.parametrize("name", CASES)
def test_symmetry(name: str) -> None:
    """The places are those of textbooks, and numerical values agree."""
    curve, place, step, monotone = CASES[name]
    model = gqm.derive(curve, gqm.Gravity())
    found = model.symmetry
    if place is None:
        assert found is None
        return
    assert found is not None
    assert (found.place, found.step, found.monotone) == (place, step, monotone)
    values = {
        sp.Symbol(key, real=True): value
        for key, value in (("L", sp.Rational(7, 5)), ("R", sp.S.One), ("g", sp.Rational(981, 100)), ("a", 2), ("b", 1))
    }
    with mp.workdps(30):
        potential, ds, slope = (
            sp.lambdify(model.parameter, form.xreplace(values), "mpmath")
            for form in (model.effective_potential, model.ds, model.effective_potential_slope)
        )
        axes = [mpf(sp.N(place + k * (step or 0), 40)) for k in (0, 1, -3)]
        for axis in axes:
            for away in map(mpf, ("0.3", "1.7", "2.9")):
                for form in (potential, lambda place: ds(place) ** 2):
                    assert abs(form(axis + away) - form(axis - away)) <= mpf("1e-25") * (1 + abs(form(axis + away)))
                assert abs(ds(axes[0] + away) - ds(axes[0] - away)) <= mpf("1e-25") * (1 + abs(ds(axes[0] + away)))
        signs = {mp.sign(slope(axes[0] + (axes[1] - axes[0] or 9) * mpf(k) / 10)) for k in range(1, 10)}
    assert not monotone or len(signs) == 1


def test_a_rolling_body_of_unknown_radius_swings_about_the_bottom_of_its_track() -> None:
    """The radius of a body is less than that of a circle in which it rolls, so the well of its centre is at 0, too."""
    model = gqm.derive(gqm.families.circle(L=1), gqm.Gravity() + gqm.Rolling(radius="rho"))
    assert model.symmetry is not None
    assert model.symmetry.place == 0
