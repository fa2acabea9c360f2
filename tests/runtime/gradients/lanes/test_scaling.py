"""Derivatives that follow from homogeneity agree with differences in mpmath, and are claimed only where they hold."""

from fractions import Fraction
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from mpmath import mp, mpf
from orbits import FORMULAS, Formula, by_differences, half_orbit
from paths import ROOT

import gqm_sym as gqm
from gqm_sym.loading import load
from gqm_sym.runtime.gradients.formula_orbit import source_of
from gqm_sym.runtime.gradients.lanes.scaling import Scaling, constants, plan_of, scalings

ULP, HALF = 2.0**-52, Fraction(1, 2)


def generated(name: str) -> ModuleType:
    """Return a module of the repository."""
    return load(str(ROOT / "generated" / f"{name}.py"), name)


def scalings_of(module: ModuleType, *names: str) -> dict[str, Scaling]:
    """Return the scalings of parameters by name."""
    parameters = list(module.MODEL.parameters)
    found = scalings(source_of(module.MODEL), tuple(parameters.index(name) for name in names))
    return {parameters[k]: scaling for k, scaling in found.items()}


def test_exponents() -> None:
    """The time of a pendulum is proportional to (L/g)**(1/2); that on a parabola a*x**2 is a function of a*x times
    (a*g)**(-1/2). The size of an ellipse scales both axes, so that one derivative gives the other one.
    """
    circle = scalings_of(generated("circle"), "L", "g", "m")
    assert circle["L"] == Scaling(HALF, Fraction(0), HALF)
    assert circle["g"] == Scaling(-HALF, Fraction(0), HALF)
    assert circle["m"] == Scaling(Fraction(0), Fraction(0), Fraction(0))
    parabola = scalings_of(generated("parabola"), "a", "g")
    assert parabola["a"] == Scaling(-HALF, Fraction(-1), -HALF)
    ellipse = generated("ellipse")
    a, b = (list(ellipse.MODEL.parameters).index(name) for name in "ab")
    assert scalings_of(ellipse, "a", "b") == {"b": Scaling(HALF, Fraction(0), HALF, ((a, Fraction(1)),))}
    assert scalings_of(ellipse, "b", "a") == {"a": Scaling(HALF, Fraction(0), HALF, ((b, Fraction(1)),))}
    assert "beta" not in scalings_of(generated("rolling_circle"), "beta")


def test_plans() -> None:
    """From rest, the derivatives of a pendulum's half period by all but the amplitude take no integral."""
    module = generated("circle")
    source, count = source_of(module.MODEL), len(module.MODEL.parameters)
    everything = tuple(range(count + 2))
    direct, plan = plan_of(source, everything, at_rest=True, is_scaled=True)
    assert len(direct.scaled) == count
    assert direct.zeros == (count + 1,)
    assert plan.wanted == (count,)
    assert plan.has_launch
    assert plan.tangents == ()
    direct, plan = plan_of(source, everything, at_rest=False, is_scaled=False)
    mass = list(module.MODEL.parameters).index("m")
    assert direct.zeros == (mass,)
    assert plan.wanted == tuple(k for k in everything if k != mass)
    assert plan.tangents == tuple(k for k in range(count) if k != mass)


def test_a_constant_of_the_potential(tmp_path: Path) -> None:
    """A parameter that only shifts the height has the derivative 0, and not a rounding."""
    curve = gqm.Curve.graph("a*x**2 + b*x + c", parameter="x", parameters={"a": 1, "b": "1/5", "c": "3/10"})
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="shifted", folder=tmp_path)
    names = list(module.MODEL.parameters)
    assert constants(source_of(module.MODEL)) == {names.index("c"), names.index("m")}
    found = module.sweep("half_period", [0.5, 0.7], [0.0, 1.0], gradient=("a", "c"))
    assert (found.gradient[:, 1] == 0.0).all()
    assert (found.gradient[:, 0] != 0.0).all()


@pytest.mark.sample(1)
@pytest.mark.parametrize("is_thrown", [False, True])
@pytest.mark.parametrize("name", ["ellipse", "parabola", "catenary", "double_well", "circle_spring", "rolling_circle"])
def test_random_launches(name: str, *, is_thrown: bool) -> None:
    """Derivatives are within 2 ulp of the integral of the absolute values, from rest and not."""
    formula, random = FORMULAS[name], np.random.default_rng(23)
    given = {key: random.uniform(*ends, 4) for key, ends in formula.ranges.items()}
    if not is_thrown:
        given["v0"] = np.zeros(4)
    ends = generated(name).sweep("turning_points", **given)
    found = generated(name).sweep("half_period", **given, gradient=tuple(given))
    assert np.isfinite(found.gradient[found.status == 0]).all()
    for k in np.flatnonzero(found.status == 0):
        launch, near = {key: float(values[k]) for key, values in given.items()}, tuple(ends.values[k])
        with mp.workdps(40):
            for column, key in enumerate(launch):
                wanted = by_differences(lambda numbers, near=near: half_orbit(name, numbers, near), launch, key)[0]
                if key == "v0" and not is_thrown:
                    assert found.gradient[k, column] == 0.0
                    continue
                assert abs(found.gradient[k, column] - wanted) <= 4 * ULP * abs(wanted)


@pytest.mark.extended
@pytest.mark.parametrize("rate", [1, 3])
def test_thrown_along_waves(rate: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Multiples of half the width of an orbit are differentiated, whatever constants they are joined with."""
    formula = Formula(
        lambda lam, g, **_: -g * mp.cos(rate * lam) / 2,
        lambda lam, **_: mp.sqrt(1 + (rate * mp.sin(rate * lam) / 2) ** 2),
        {},
    )
    monkeypatch.setitem(FORMULAS, "waves", formula)
    curve = gqm.Curve.graph(f"-cos({rate}*x)/2", parameter="x")
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name=f"waves_{rate}", folder=tmp_path)
    lam0, v0 = np.array([0.1, 0.3, 0.6]) / rate, np.array([0.4, 1.0, 0.2])
    found = module.sweep("half_period", lam0, v0, gradient=("g", "lam0", "v0"))
    ends = module.sweep("turning_points", lam0, v0).values
    for k in range(3):
        launch = {"g": 9.81, "lam0": float(lam0[k]), "v0": float(v0[k])}
        with mp.workdps(40):
            for column, key in enumerate(launch):
                near = tuple(ends[k])
                wanted = by_differences(lambda numbers, near=near: half_orbit("waves", numbers, near), launch, key)[0]
                assert abs(found.gradient[k, column] - wanted) <= 4 * ULP * abs(wanted)


def test_a_parameter_that_is_zero() -> None:
    """Where a parameter is zero, its derivative does not follow from others; neighbours do not matter."""
    module, name = generated("circle_spring"), "circle_spring"
    launch = {"lam0": 0.7, "v0": 0.0, "L": 1.0, "w": 0.0, "h": 0.3, "g": 9.81}
    given = {key: np.array([value, value]) for key, value in launch.items()} | {"w": np.array([0.0, 1.5])}
    names = tuple(launch)
    together = module.sweep("half_period", **given, gradient=names).gradient
    for k in range(2):
        alone = {key: float(values[k]) for key, values in given.items()}
        np.testing.assert_array_equal(module.sweep("half_period", **alone, gradient=names).gradient, together[k])
        with mp.workdps(40):
            for column, key in enumerate(names):
                near = (-0.7, 0.7)
                wanted = by_differences(lambda numbers, near=near: half_orbit(name, numbers, near), alone, key)[0]
                size = abs(wanted) if key not in ("v0", "w") else mpf(1)
                assert abs(together[k, column] - wanted) <= 4 * ULP * size
