"""The periods of closed curves are found, and periods that are wrong are refused."""

import math
from fractions import Fraction

import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp, mpf
from selection import examples

import gqm_sym as gqm
from gqm_sym.errors import DeclarationError
from gqm_sym.expressions import common_measure
from gqm_sym.specfile import read_spec


def drawn(x, z, **options):
    """Return a parametric curve."""
    return gqm.Curve.parametric(x=x, z=z, parameter="u", **options)


FOUND = {
    "circle": (drawn("cos(u)", "sin(u)"), "2*pi"),
    "squares": (drawn("cos(u)**2", "sin(2*u)"), "pi"),
    "lissajous": (drawn("sin(3*u)", "sin(2*u)"), "2*pi"),
    "slow": (drawn("cos(u/2)", "sin(u/3)"), "12*pi"),
    "rate": (drawn("R*cos(w*u)", "R*sin(w*u + phi)"), "2*pi/abs(w)"),
    "lemniscate": (drawn("a*cos(u)/(1 + sin(u)**2)", "a*sin(u)*cos(u)/(1 + sin(u)**2)"), "2*pi"),
    "exponential": (drawn("exp(cos(u))", "sin(u)"), "2*pi"),
    "astroid": (drawn("cos(u)**3", "sin(u)**3"), "2*pi"),
    "three petals": (gqm.Curve.polar("cos(3*theta)"), "pi"),
    "four petals": (gqm.Curve.polar("a*cos(2*theta)"), "2*pi"),
    "limacon": (gqm.Curve.polar("a + b*cos(theta)"), "2*pi"),
    "kepler": (drawn("a*(cos(u) - ecc)", "a*sqrt(1 - ecc**2)*sin(u)"), "2*pi"),
    "long": (gqm.Curve.polar("2 + cos(theta/3)"), "6*pi"),
}
OPEN = {
    "incommensurate": drawn("cos(u)", "sin(sqrt(2)*u)"),
    "parameters": drawn("cos(p*u)", "sin(q*u)"),
    "involute": drawn("cos(u) + u*sin(u)", "sin(u) - u*cos(u)"),
    "a pole, perhaps": drawn("cos(u)/(1 + ecc*sin(u))", "sin(u)"),
    "conic": gqm.Curve.polar("p/(1 + ecc*cos(theta))"),
    "not real everywhere": gqm.Curve.polar("sqrt(cos(2*theta))"),
    "tangent": drawn("tan(u)", "sin(u)"),
    "spiral": gqm.Curve.polar("a*theta"),
    "an arc": drawn("cos(u)", "sin(u)", domain=(0, 1)),
    "a point": drawn("sin(u)**2 + cos(u)**2", "a"),
    "nowhere real": drawn("cos(u)*sqrt(-1 - a**2)", "sin(u)"),
    "a graph": gqm.Curve.graph("sin(x)"),
}


@pytest.mark.parametrize("name", FOUND)
def test_the_least_period_is_found(name):
    """The period found is the smallest after which every coordinate is the same."""
    curve, period = FOUND[name]
    assert sp.simplify(curve.period - sp.sympify(period, {"w": sp.Symbol("w", real=True)})) == 0


@pytest.mark.parametrize("name", OPEN)
def test_what_does_not_close_for_certain_stays_open(name):
    """A curve stays open if it does not certainly close, also if it may have a pole or be complex somewhere."""
    assert OPEN[name].period is None


@examples(40)
@given(rates=st.lists(st.fractions(Fraction(1, 6), 6, max_denominator=6), min_size=1, max_size=3), polar=st.booleans())
def test_random_waves_close_after_their_least_common_period(rates, polar):
    """The period is the least common multiple of the periods, which for a sum of single waves is the smallest."""
    waves = " + ".join(f"{k + 2}*cos({rate}*u)" for k, rate in enumerate(rates))
    rates = [*rates, Fraction(1)]
    curve = gqm.Curve.polar(f"20 + {waves}", parameter="u") if polar else drawn(waves, "sin(u)")
    step = Fraction(math.gcd(*(r.numerator * 60 // r.denominator for r in rates)), 60)
    assert curve.period == 2 * sp.pi / sp.Rational(step.numerator, step.denominator)


@pytest.mark.parametrize(
    ("declare", "message"),
    [
        (lambda: drawn("cos(u)", "sin(u)", period=3), "after 3 of u .* give 2[*]pi"),
        (lambda: drawn("u", "u**2", period=2), "does not close"),
        (lambda: drawn("cos(u)", "sin(u)", period="6.28"), "give 2[*]pi"),
        (lambda: gqm.Curve.polar("2 + cos(theta/2)", period="2*pi"), "give 4[*]pi"),
        (lambda: gqm.Curve.polar("a*theta", period="2*pi"), "does not close"),
        (lambda: drawn("3*cos(u) + k*cos(3*u/k)", "sin(u)", period="2*pi", parameters={"k": 2}), "give 4[*]pi"),
    ],
)
def test_a_period_that_is_none_is_refused(declare, message):
    """The message gives the right period if there is one."""
    with pytest.raises(DeclarationError, match=message):
        declare()


@pytest.mark.parametrize("period", ["2*pi", "4*pi", "6*pi"])
def test_a_period_is_one_however_often_it_goes_round(period):
    """A declared period may count two rounds as one."""
    assert drawn("cos(u)", "sin(u)", period=period).period == sp.sympify(period)


@pytest.mark.extended
def test_what_run_time_values_decide_is_not_refused():
    """A period that depends on run-time values is accepted: a wheel of radius r inside one of radius R closes after one
    turn for whole R/r only.
    """
    wheel = {"x": "(R - r)*cos(u) + r*cos((R - r)*u/r)", "z": "(R - r)*sin(u) - r*sin((R - r)*u/r)"}
    curve = drawn(**wheel, period="2*pi")
    gqm.derive(curve, gqm.Gravity())
    gqm.derive(curve, gqm.Gravity(), parameters={"R": 3, "r": 1})
    with pytest.raises(DeclarationError, match=r"give 4[*]pi"):
        gqm.derive(curve, gqm.Gravity(), parameters={"R": 5, "r": 2})


def test_a_message_about_a_file_has_its_place(tmp_path):
    """The message for a mistake in a file gives line and column."""
    path = tmp_path / "ring.yaml"
    path.write_text(
        "name: ring\ncurve: {parametric: {x: cos(u), z: sin(u), parameter: u, period: 3}}\nkernel: {gravity: {}}\n"
    )
    with pytest.raises(gqm.GQMError, match=r"ring.yaml:2:\d+: curve.parametric.period: after 3 of u"):
        read_spec(path)


def test_rounds_of_a_ring_are_a_circulation(tmp_path):
    """The loop time is that of a ring with a declared period (the motion was a transit)."""
    silent, told = (
        gqm.build(gqm.derive(drawn("2*sin(u)", "-2*cos(u)", **given), gqm.Gravity()), name=f"ring_{n}", folder=tmp_path)
        for n, given in enumerate(({}, {"period": "2*pi"}))
    )
    one, two = (module.solve(0, 12) for module in (silent, told))
    assert one.kind == two.kind == "circulation"
    assert one.period == two.period
    assert silent.solve(0, 2).kind == "libration"


@examples(25, otherwise=2)
@given(rates=st.lists(st.fractions(Fraction(1, 6), 5, max_denominator=6), min_size=2, max_size=3))
def test_random_waves_are_derived_as_they_are(rates):
    """The line element of random waves agrees with mpmath (the common measure of 1, 3 and 7/6 is 1/6, and was taken for
    1).
    """
    curve = drawn(" + ".join(f"cos({rate}*u)/{k + 1}" for k, rate in enumerate(rates)), "3*sin(u)")
    ds = sp.lambdify(curve.parameter, gqm.derive(curve, gqm.Gravity()).ds, "mpmath")
    x, z = (sp.lambdify(curve.parameter, form, "mpmath") for form in (curve.x, curve.z))
    for place in (0.3, 1.7, -4.1):
        truth = mp.hypot(mp.diff(x, place), mp.diff(z, place))
        assert ds(mpf(place)) == pytest.approx(float(truth), rel=1e-9)


@pytest.mark.parametrize("numbers", [(1, 3, "7/6"), ("7/6", 3, 1), (1, 2, "9/4"), ("1/2", "1/3"), (4, 6), ("5/7",)])
def test_a_common_measure_goes_into_all_numbers(numbers):
    """The common measure does not depend on the order of the numbers; SymPy's gcd_list stops at a 1."""
    exact = [sp.Rational(number) for number in numbers]
    quotients = [number / common_measure(exact) for number in exact]
    assert all(quotient.is_Integer for quotient in quotients)
    assert math.gcd(*map(int, quotients)) == 1
