"""Curves that are written about a place far from zero: their forms, and the digits of sweeps on them.

The references are the definitions in 40 digits, in mpmath.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy
from mpmath import mp, mpf

import gqm_sym as gqm

G = mpf("9.81")


@pytest.mark.sample(5)
@pytest.mark.parametrize(
    ("height", "origin"),
    [
        ("cosh(x - 40) + x/7", "40"),
        ("(x - 40)**2/2 - exp(-(x - 40 - 1/4)**2)/3", "161/4"),
        ("b*(2*x - 81)**4 + sin(x)", "81/2"),
        ("exp(-(x - mu)**2) + x/3", "mu"),
        ("x**2 - 80*x + 1600", "0"),
        ("cosh(x - 40) + x**2", "0"),
        ("(x - 40)**2*(x - 2)**2", "0"),
        ("(x - a)**2*(x - b)**2", "0"),
        ("sin(x - 40)", "0"),
    ],
)
def test_origins(height: str, origin: str) -> None:
    """A model's origin is the place about which its curve is written; a place is none if another is far from it."""
    model = gqm.derive(gqm.Curve.graph(height, parameter="x"), gqm.Gravity())
    assert str(model.origin) == origin


@pytest.mark.parametrize(
    "curve",
    [
        gqm.Curve.polar("(theta - 40)/5", parameter="theta", domain=("41", "60")),
        gqm.Curve.parametric(x="(t - 40)*cos(t)", z="(t - 40)*sin(t)/2", parameter="t", domain=("41", "60")),
        gqm.Curve.space(x="cos(t)", y="sin(t)", z="(t - 40)**4/50 + t/30", parameter="t"),
    ],
)
def test_slopes_are_derivatives(curve: gqm.Curve) -> None:
    """The slope of the potential and ds are those of the coordinates as declared."""
    model = gqm.derive(curve, gqm.Gravity())
    place = {model.parameter: sympy.Rational(4321, 100)}
    rates = [sympy.diff(form, model.parameter).xreplace(place).evalf(30) for form in curve.point]
    length = sympy.sqrt(sum(rate**2 for rate in rates))
    assert abs(model.ds.xreplace(place).evalf(30) - length) < 1e-20
    slope = model.effective_potential_slope.xreplace({**place, sympy.Symbol("g", real=True): sympy.S.One})
    assert abs(slope.evalf(30) - rates[-1]) < 1e-20


def test_no_origin_where_forces_contain_the_place() -> None:
    """A turning frame, a spring or a law by the place itself has digits about zero."""
    curve = gqm.Curve.graph("cosh(x - 40)", parameter="x")
    for law in (gqm.RotatingFrame(), gqm.Potential("9*z + x**2"), gqm.Kernel.law("-x")):
        assert gqm.derive(curve, gqm.Gravity() + law).origin == 0


@pytest.mark.parametrize(
    "law",
    [gqm.Gravity(), gqm.Gravity() + gqm.Rolling(radius="rho"), gqm.Gravity() + gqm.QuadraticDrag(b="c_d")],
)
def test_forms_about_a_place(law: gqm.Kernel) -> None:
    """All closed forms are those of the same curve about zero, at a place less the origin."""
    far = gqm.derive(gqm.Curve.graph("(x - 40)**4/5 + x/7", parameter="x", domain=("36", "46")), law)
    near = gqm.derive(gqm.Curve.graph("x**4/5 + x/7 + 40/7", parameter="x", domain=("-4", "6")), law)
    assert far.domain == (36, 46)
    moved = {far.parameter: far.parameter + 40, far.lam0: far.lam0 + 40}
    for (label, form), (_, other) in zip(far.closed_forms(), near.closed_forms(), strict=True):
        if label == "x" or form.has(sympy.Integral):
            continue
        parts = zip(form.args, other.args, strict=True) if isinstance(form, sympy.Eq) else [(form, other)]
        for one, same in parts:
            values = {s: sympy.Rational(3 + k, 7) for k, s in enumerate(sorted(same.free_symbols, key=str))}
            assert abs((one.xreplace(moved) - same).xreplace(values).evalf(30)) < 1e-20, label


WELLS: dict[str, Callable[[Any], Any]] = {
    "sin(Y)/4 + Y**2": lambda y: mp.sin(y) / 4 + y**2,
    "Y**2 + Y**3/5": lambda y: y**2 + y**3 / 5,
    "Y**2/2 + tanh(Y)/3 + x/7": lambda y: y**2 / 2 + mp.tanh(y) / 3 + y / 7,
    "cosh(3*Y) + x/5": lambda y: mp.cosh(3 * y) + y / 5,  # wider than closed forms of second differences allow
}


def half_period(height: Callable[[Any], Any], start: mpf, speed: mpf, ends: list[mpf]) -> mpf:
    """Return the half period of a body on a graph, by the trapezoidal rule, from approximate turning points."""
    energy = speed**2 / 2 + G * height(start)
    low, high = (mp.findroot(lambda y: energy - G * height(y), end) for end in ends)
    middle, half, number = (low + high) / 2, (high - low) / 2, 160
    total = mpf(0)
    for k in range(number):
        angle = (k + mpf(1) / 2) * mp.pi / number
        y = middle + half * mp.cos(angle)
        slope = mp.diff(height, y)
        total += mp.sqrt((1 + slope**2) / (2 * (energy - G * height(y)))) * half * mp.sin(angle)
    return total * mp.pi / number


@pytest.mark.extended
@pytest.mark.parametrize("height", list(WELLS))
@pytest.mark.parametrize("origin", ["40", "c"])
def test_sweeps_about_a_place(height: str, origin: str, tmp_path: Path) -> None:
    """Half periods on narrow orbits at 40 are within 2 units in the last place, from rest and thrown."""
    if origin == "c" and height != "Y**2 + Y**3/5":
        return
    curve = gqm.Curve.graph(height.replace("Y", f"(x - {origin})"), parameter="x")
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="about", folder=tmp_path)
    given = {"c": 40.0} if origin == "c" else {}
    rng = np.random.default_rng(5)
    lam0 = rng.uniform(40.3, 41.0, 24)
    v0 = np.where(np.arange(24) % 2, rng.uniform(0.2, 1.0, 24), 0.0)
    found = module.sweep("half_period", lam0, v0, **given)
    ends = module.sweep("turning_points", lam0, v0, **given).values
    with mp.workdps(40):
        for k in range(24):
            known = [mpf(end) - 40 for end in ends[k].tolist()]
            exact = half_period(WELLS[height], mpf(lam0[k]) - 40, mpf(v0[k]), known)
            assert abs(mpf(found.values[k]) - exact) <= 2 * np.spacing(float(exact)), k
