"""Integrals without sines for orbits about an axis give the times of the motion."""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import sympy as sp
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym.derivation.wells.symmetric_orbits import (
    COSINE_TERM,
    HALF,
    LAUNCH,
    OFFSET,
    ONE_MINUS_T,
    ONE_MINUS_TT,
    ONE_MINUS_Y,
    ONE_MINUS_YT,
    T_MINUS_Y,
    T,
    Y,
)

ModuleOf = Callable[[str], ModuleType]


def graph(z: str) -> gqm.Curve:
    """Return a curve z(x)."""
    return gqm.Curve.graph(z, parameter="x")


CYCLOID = gqm.Curve.parametric(x="u + sin(u)", z="-cos(u)", parameter="u")
PENDULUM = gqm.Curve.parametric(x="L*cos(theta)", z="L*sin(theta)", parameter="theta", parameters={"L": 1})
ELLIPSE = gqm.Curve.parametric(x="2*cos(theta)", z="3*sin(theta)", parameter="theta")
GRAVITY = gqm.Gravity()
# A row has the curve, the force, and the distance of both turning points from the axis.
CASES: dict[str, tuple[gqm.Curve, Any, str]] = {
    "pendulum": (PENDULUM, GRAVITY, "2.8"),
    "cycloid": (CYCLOID, GRAVITY, "2.3"),
    "ellipse": (ELLIPSE, GRAVITY, "1.3"),
    "parabola": (graph("x**2"), GRAVITY, "1.7"),
    "parabola, shifted": (graph("3*x**2 - x"), GRAVITY, "0.8"),
    "quartic": (graph("x**4"), GRAVITY, "1.2"),
    "double well": (graph("x**4 - 2*x**2"), GRAVITY, "1.9"),
    "catenary": (graph("2*cosh(x/2)"), GRAVITY, "5"),
    "two rates, hyperbolic": (graph("cosh(x) + cosh(2*x)/5"), GRAVITY, "1.1"),
    "waves": (graph("-cos(3*x)/2"), GRAVITY, "0.9"),
    "two waves": (graph("-cos(x) - cos(2*x)/5"), GRAVITY, "2.5"),
    "squares of waves": (graph("-sin(x)**2/2"), GRAVITY, "1.4"),
    "root of a wave": (graph("-sqrt(2 + cos(x))"), GRAVITY, "2.1"),
    "kappa curve": (gqm.Curve.polar("tan(theta)", parameter="theta", domain=("-1.5", "1.5")), GRAVITY, "1.3"),
    "conchoid": (gqm.Curve.polar("1/sin(theta) - 2", parameter="theta", domain=("0.1", "3.04")), GRAVITY, "1.2"),
    "turning hoop": (PENDULUM, gqm.Gravity() + gqm.RotatingFrame(Omega=2), "2"),
    "Duffing": (graph("0*x"), gqm.Potential("2*x**2 + 3*x**4"), "1.3"),
    "spring": (graph("x**2/3"), gqm.Gravity() + gqm.Potential("3*(x**2 + (z - 1)**2)"), "1.5"),
}


@cache
def model_of(name: str) -> gqm.Model:
    """Return the model of a case, derived once."""
    curve, force, _ = CASES[name]
    return gqm.derive(curve, force)


def functions(model: gqm.Model, *forms: sp.Expr | None, by: tuple[sp.Symbol, ...]) -> list[Callable[..., Any]]:
    """Return forms as functions of extended precision, with the defaults put in."""
    values = {sp.Symbol(name, real=True): sp.Rational(str(value)) for name, value in model.defaults}
    return [sp.lambdify(by, sp.sympify(form or 0).xreplace(values), "mpmath") for form in forms]


def integral(rate: Callable[[Any], Any]) -> mpf:
    """Return the integral over a quarter turn; no node comes near its ends."""
    return mp.quad(rate, mp.linspace(0, mp.pi / 2, 7), method="gauss-legendre")


def by_integral(model: gqm.Model, half: mpf) -> mpf:
    """Return the half period by the integral over u."""
    orbits = model.symmetric_orbits
    assert orbits is not None
    at_ends = dict(
        zip(dict(orbits.invariants), functions(model, *dict(orbits.invariants).values(), by=(HALF,)), strict=True)
    )
    ends = {symbol: value(half) for symbol, value in at_ends.items()}
    places = (Y, T_MINUS_Y, ONE_MINUS_Y, ONE_MINUS_YT, COSINE_TERM)
    (integrand,) = functions(model, orbits.time_integrand, by=(*places, *ends))

    def rate(u: mpf) -> mpf:
        sine2, cosine2 = mp.sin(u) ** 2, mp.cos(u) ** 2
        rest = [cosine2 + ends.get(symbol, 0) * sine2 for symbol in (ONE_MINUS_T, ONE_MINUS_TT)]
        place = [ends[T] * sine2, ends[T] * cosine2, *rest]
        return mp.sqrt(integrand(*place, (1 - place[0]) ** 2 - 4 * place[0], *ends.values()))

    return 2 * integral(rate)


def by_heights(model: gqm.Model, half: mpf) -> mpf:
    """Return the half period as the integral of ds/V over an angle, with plenty of digits for cancellation."""
    assert model.symmetry is not None
    potential, ds = functions(model, model.effective_potential, model.ds, by=(model.parameter,))
    axis = mpf(sp.N(model.symmetry.place, mp.dps))

    def rate(u: mpf) -> mpf:
        place = axis + half * mp.sin(u)
        return ds(place) * half * mp.cos(u) / mp.sqrt(2 * (potential(axis + half) - potential(place)))

    return 2 * integral(rate)


@pytest.mark.sample(3)
@pytest.mark.parametrize("name", CASES)
def test_the_time_is_that_of_the_motion(name: str) -> None:
    """Both integrals have the same value."""
    model, half = model_of(name), CASES[name][-1]
    with mp.workdps(60):
        truth = by_heights(model, mpf(half))
    with mp.workdps(30):
        assert abs(by_integral(model, mpf(half)) / truth - 1) < mpf("1e-20")


AGM = ["pendulum", "cycloid", "Duffing"]
TURNING_POINTS = [name for name in CASES if name not in ("root of a wave", "kappa curve")]
# In these the potential falls beside the axis, or grows so little at the turning point that a root loses digits.
NOT_GROWING = ["double well", "two waves"]


def test_which_have_closed_forms() -> None:
    """Pendulum and Duffing's oscillator are elliptic of the first kind; V**2 = 0 is solved up to squares."""
    orbits_of = {name: model_of(name).symmetric_orbits for name in CASES}
    assert [name for name, orbits in orbits_of.items() if orbits is not None and orbits.agm_arguments] == AGM
    assert [name for name, orbits in orbits_of.items() if orbits is not None and orbits.turning_point] == TURNING_POINTS


@pytest.mark.parametrize("name", AGM)
def test_a_half_period_is_pi_over_a_mean(name: str) -> None:
    """A half period is pi over the arithmetic-geometric mean of two numbers."""
    model, half = model_of(name), CASES[name][-1]
    assert model.symmetric_orbits is not None
    assert model.symmetric_orbits.agm_arguments is not None
    with mp.workdps(30):
        one, other = (
            square(mpf(half)) for square in functions(model, *model.symmetric_orbits.agm_arguments, by=(HALF,))
        )
        with mp.workdps(60):
            truth = by_heights(model, mpf(half))
        assert abs(mp.pi / mp.agm(mp.sqrt(one), mp.sqrt(other)) / truth - 1) < mpf("1e-25")


def test_a_cycloid_has_one_period() -> None:
    """The squares of both numbers are the square of the frequency, g/4 for the radius 1, without the width."""
    orbits = model_of("cycloid").symmetric_orbits
    assert orbits is not None
    assert orbits.agm_arguments is not None
    assert {str(4 * square) for square in orbits.agm_arguments} == {"g"}


@pytest.mark.sample(16)
@pytest.mark.parametrize("name", TURNING_POINTS)
@pytest.mark.parametrize("share", ["-0.99", "-1/3", "0", "0.7"])
def test_where_a_body_comes_to_rest(name: str, share: str) -> None:
    """An orbit launched anywhere in the well, with the V**2 of that place, has the well's width."""
    model, half = model_of(name), CASES[name][-1]
    assert model.symmetric_orbits is not None
    assert model.symmetric_orbits.turning_point is not None
    assert model.symmetry is not None
    (potential,) = functions(model, model.effective_potential, by=(model.parameter,))
    width, growth, square = functions(model, *model.symmetric_orbits.turning_point, by=(OFFSET, LAUNCH))
    with mp.workdps(40):
        axis, offset = mpf(sp.N(model.symmetry.place, 40)), mpf(half) * mp.mpf(sp.Rational(share))
        left = 2 * (potential(axis + mpf(half)) - potential(axis + offset))
        assert abs(width(offset, left) / mpf(half) - 1) < mpf("1e-30")
        assert (growth(offset, left) > 0) == (name not in NOT_GROWING)
        assert 0 <= square(offset, left) < 1


@pytest.mark.sample(3)
@pytest.mark.parametrize(
    "z", ["x**3", "exp(x)", "cos(x) + x**2", "cos(x) + cosh(x)", "cos(x) + cos(9*x)", "exp(-x**2)"]
)
def test_there_is_none(z: str) -> None:
    """Wells that are not even, unlike functions, and waves of very different frequencies have no such form."""
    assert gqm.derive(graph(z), gqm.Gravity()).symmetric_orbits is None


HEIGHTS = ["x**2/2", "x**4/5", "cosh(x)", "cosh(2*x)/4", "-cos(x)", "-sin(x)**2/2"]
FORCES = [
    gqm.Gravity(),
    gqm.Gravity() + gqm.RotatingFrame(Omega="1/4"),
    gqm.Potential("9*z + x**2/3"),
    gqm.Potential("9*z + x**4/8"),
    gqm.Potential("9*z - cos(x)/2"),
    gqm.Potential("9*z + cosh(x)/7"),
]


@pytest.mark.extended
@pytest.mark.parametrize("axis", ["x", "catenary"])
@pytest.mark.parametrize("force", range(len(FORCES)))
def test_powers_and_waves_together(axis: str, force: int) -> None:
    """Whatever an even curve and an even force are made of, there is no such integral, or it is the motion's."""
    heights = HEIGHTS if axis == "x" else ["catenary"]
    for z in heights:
        curve = gqm.families.catenary(c="4/5") if axis == "catenary" else graph(z)
        model, half = gqm.derive(curve, FORCES[force]), mpf("0.7")
        if model.symmetric_orbits is None or model.symmetric_orbits.time_integrand is None:
            continue
        assert model.symmetry is not None
        (potential,) = functions(model, model.effective_potential, by=(model.parameter,))
        axis_place = mpf(sp.N(model.symmetry.place, 40))
        if potential(axis_place + half) < potential(axis_place):
            continue  # a hill
        with mp.workdps(40):
            truth = by_heights(model, half)
        with mp.workdps(25):
            assert abs(by_integral(model, half) / truth - 1) < mpf("1e-18"), z


def test_the_rotating_frame_of_a_catenary_is_not_left_out(tmp_path: Path) -> None:
    """Sweeps over a catenary in a rotating frame gave the half periods of gravity alone."""
    model = gqm.derive(gqm.families.catenary(c=1), gqm.Gravity() + gqm.RotatingFrame())
    assert model.symmetric_orbits is None
    module = gqm.build(model, name="turning_catenary", folder=tmp_path)
    places = [0.2, 0.7, 1.2]
    swept = module.sweep("half_period", places, Omega=0.7).values
    with mp.workdps(40):

        def height(x: mpf) -> mpf:
            return mpf("9.81") * mp.cosh(x) - mpf(0.7) ** 2 * x**2 / 2

        for value, place in zip(swept, places, strict=True):
            start = mpf(place)

            def rate(u: mpf, start: mpf = start) -> mpf:
                x = start * mp.sin(u)
                return mp.cosh(x) * start * mp.cos(u) / mp.sqrt(2 * (height(start) - height(x)))

            truth = 2 * integral(rate)
            assert abs(mpf(float(value)) - truth) <= 2 * np.spacing(float(truth))


def test_a_pendulum_has_the_elliptic_integral() -> None:
    """After Landen's transformation the integrand is (1 + k1)**2/(1 - k1**2*sin(u)**2) with k1 = tan(half/2/2)**2."""
    orbits = gqm.derive(PENDULUM, gqm.Gravity()).symmetric_orbits
    assert orbits is not None
    length, g = sp.Symbol("L", real=True), sp.Symbol("g", real=True)
    cosine_fourth = dict(orbits.invariants)[
        orbits.time_integrand.free_symbols.difference({ONE_MINUS_YT, length, g}).pop()
    ]
    assert orbits.time_integrand.free_symbols >= {ONE_MINUS_YT, length, g}
    quarter = sp.Symbol("quarter", real=True)
    by_quarter = [form.xreplace({HALF: 4 * quarter}) for form in (cosine_fourth, dict(orbits.invariants)[T])]
    squares = [sp.cos(quarter) ** 4, sp.tan(quarter) ** 2]
    assert [sp.simplify(a - b) for a, b in zip(by_quarter, squares, strict=True)] == [0, 0]


@pytest.mark.extended
def test_parameters_with_the_names_of_variables_of_an_orbit(tmp_path: Path) -> None:
    """Run-time parameters may have the names of the variables of an orbit."""
    names = ["fall", "half", "halves", "top", "top_lack", "top_apart", "top_sine", "stretch", "scale"]
    curve = gqm.Curve.graph(f"-({'+'.join(names)})*cos(x)", parameter="x", parameters=dict.fromkeys(names, "1/8"))
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="ours", folder=tmp_path)
    places = [0.5, 1.2, 2.4]
    swept = module.sweep("half_period", places, half=[0.1, 0.2, 0.3], top=0.5).values
    for value, place, half in zip(swept, places, (0.1, 0.2, 0.3), strict=True):
        truth = module.solve(place, half=half, top=0.5).half_period
        assert abs(value - float(truth)) <= 5 * np.spacing(value)


# The times of these orbits were taken for converged when one change of the rule was small by accident.
@pytest.mark.extended
@pytest.mark.parametrize(
    ("track", "z", "places"),
    [
        ("quartic", "x**4", [2.0814481583684215, 3.5243237278237127, *np.linspace(0.5, 4.5, 15)]),
        ("double_well", "x**4 - x**2", np.linspace(1.05, 3.5, 25).tolist()),
    ],
)
def test_half_periods_have_settled(track: str, z: str, places: list[float], module_of: ModuleOf) -> None:
    """Half periods converge to some last places, although branch points of ds make the rule's error oscillate."""
    model = gqm.derive(graph(z), gqm.Gravity())
    swept = module_of(track).sweep("half_period", places).values
    for value, place in zip(swept, places, strict=True):
        with mp.workdps(60):
            truth = by_heights(model, mpf(place))
        assert abs(mpf(float(value)) - truth) <= 4 * np.spacing(float(truth))


WAVES = gqm.Curve.parametric(x="sin(2*t)", z="-cos(t) - cos(3*t)/2", parameter="t", period="2*pi")


@pytest.mark.sample(1)
@pytest.mark.parametrize("force", [GRAVITY, GRAVITY + gqm.Rolling(radius="rho")])
def test_high_powers_of_a_square_are_not_evaluated(force: Any) -> None:
    """Three times a rate and its square in ds, also under a root, are not evaluated as such, because they cancel and
    second differences of waves do not.
    """
    orbits = gqm.derive(WAVES, force).symmetric_orbits
    assert orbits is not None
    assert orbits.time_integrand is None
    assert orbits.agm_arguments is None


@pytest.mark.extended
def test_a_ball_on_waves(tmp_path: Path) -> None:
    """The half period of a ball is that of its centre, which is at a distance of its radius from the track."""
    module = gqm.build(gqm.derive(WAVES, GRAVITY + gqm.Rolling(radius="rho")), name="ball_on_waves", folder=tmp_path)
    places, beta, rho = [0.1, 0.1259, 0.2, 0.4], mpf(0.4), mpf(0.05)
    swept = module.sweep("half_period", places, beta=0.4, rho=0.05).values

    def slopes(t: Any) -> tuple[Any, Any]:
        return 2 * mp.cos(2 * t), mp.sin(t) + 3 * mp.sin(3 * t) / 2

    def height(t: Any) -> Any:
        dx, dz = slopes(t)
        return -mp.cos(t) - mp.cos(3 * t) / 2 + rho * dx / mp.hypot(dx, dz)

    for value, h in zip(swept, map(mpf, places), strict=True):

        def rate(phi: Any, h: Any = h) -> Any:
            t = h * mp.sin(phi)
            dx, dz = slopes(t)
            bend = dx * (mp.cos(t) + 9 * mp.cos(3 * t) / 2) + dz * 4 * mp.sin(2 * t)
            speed = mp.hypot(dx, dz) - rho * bend / (dx**2 + dz**2)
            return speed * h * mp.cos(phi) / mp.sqrt(2 * mpf(9.81) * (height(h) - height(t)) / (1 + beta))

        with mp.workdps(40):
            truth = 2 * mp.quad(rate, [0, 0.8, mp.pi / 2], method="gauss-legendre")
        assert abs(mpf(float(value)) - truth) <= 4 * np.spacing(float(truth))
