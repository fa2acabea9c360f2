"""A circle is the same curve as one formula and as a closed rail of arcs."""

from types import ModuleType

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from selection import examples

import gqm_sym as gqm
from generated import circle_coulomb, circle_drag

FORCES = {
    "coulomb": (circle_coulomb, gqm.Gravity() + gqm.CoulombFriction(mu="1/5"), {"mu": 0.2, "mu_static": 0.2}),
    "drag": (circle_drag, gqm.Gravity() + gqm.QuadraticDrag(b="1/7"), {"b": 1 / 7}),
}


@pytest.fixture(scope="module", params=[("drag", 1), ("drag", 5), ("coulomb", 1), ("coulomb", 3)], ids=str)
def pair(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[ModuleType, dict, ModuleType]:
    """Return a module of the circle by its formula, with its parameters, and one of the rail of so many arcs."""
    name, count = request.param
    module, force, parameters = FORCES[name]
    rail = gqm.Curve.piecewise([gqm.arc(radius=1, angle=f"2*pi/{count}")] * count, closed=True)
    return (
        module,
        parameters,
        gqm.build(gqm.derive(rail, force), name=f"arcs_{count}_{name}", folder=tmp_path_factory.mktemp("rail")),
    )


def agree(pair: tuple[ModuleType, dict, ModuleType], place: float, v0: float, direction: int) -> None:
    """Compare the states of both, and the extremes."""
    module, parameters, rail = pair
    formula = module.solve(place, v0, direction=direction, t_max=20.0, **parameters)
    arcs = rail.solve(place, v0, direction=direction, t_max=20.0)
    assert arcs.t_end == pytest.approx(formula.t_end, rel=1e-13)
    times = np.linspace(0.0, min(formula.t_end, arcs.t_end), 201)
    one, other = formula.state(times), arcs.state(times)
    assert other.lam == pytest.approx(one.lam, abs=2e-13)
    assert other.normal_force == pytest.approx(one.normal_force, abs=1e-12 * np.abs(one.normal_force).max())
    for name in ("normal_force_max", "normal_force_min"):
        assert getattr(arcs, name).value == pytest.approx(getattr(formula, name).value, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("place", [0.20259184390198196, 0.5514139922604785])
def test_after_several_laps(pair, place):
    """The run on which the body turns begins a lap before its end, and is followed again from the next lap."""
    agree(pair, place, 9.0, -1)


@pytest.mark.extended
@given(
    place=st.floats(0.01, 6.27),
    v0=st.sampled_from([0.0, 0.5, 2.0, 4.0, 6.5, 9.0, 12.0]),
    direction=st.sampled_from([1, -1]),
)
@examples(1, 60)
def test_from_anywhere(pair, place, v0, direction):
    """Every launch moves alike."""
    agree(pair, place, v0, direction)
