"""Answers do not depend on the units: in units that are powers of two, they have the same bits up to these powers."""

from collections.abc import Mapping
from math import ldexp
from types import MappingProxyType, ModuleType
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from selection import examples

import gqm_sym as gqm
from generated import circle, circle_coulomb, circle_drag, helix_coulomb, parabola, rotating_parabola, viviani

Dimension = tuple[int, int, int]  # powers of mass, length and time

TIME, SPEED, FORCE = (0, 0, 1), (0, 1, -1), (1, 1, -2)
DIMENSIONS: dict[str, Dimension] = {
    **{"g": (0, 1, -2), "m": (1, 0, 0), "mu": (0, 0, 0), "mu_static": (0, 0, 0), "Omega": (0, 0, -1)},
    **{"L": (0, 1, 0), "R": (0, 1, 0), "c": (0, 1, 0), "b": (1, -1, 0)},
}


class Case(NamedTuple):
    """A module, the power of length that its curve parameter is, places of launch, and its own parameters."""

    module: ModuleType
    lam: int
    places: tuple[float, float]
    dimensions: Mapping[str, Dimension] = MappingProxyType({})


CASES = {
    "circle": Case(circle, 0, (-3.0, 3.0)),
    "circle_coulomb": Case(circle_coulomb, 0, (-3.0, 3.0)),
    "circle_drag": Case(circle_drag, 0, (-3.0, 3.0)),
    "helix_coulomb": Case(helix_coulomb, 0, (-9.0, 9.0)),
    "viviani": Case(viviani, 0, (-3.0, 3.0), {"a": (0, 1, 0)}),
    "parabola": Case(parabola, 1, (-2.0, 2.0), {"a": (0, -1, 0)}),
    "rotating_parabola": Case(rotating_parabola, 1, (-2.0, 2.0), {"a": (0, -1, 0)}),
}


def not_tiny(number: float) -> bool:
    """Return whether squares of a number in other units are within the range of doubles."""
    return number == 0.0 or abs(number) > 1e-60


def scaled(number: float, dimension: Dimension, units: Dimension) -> float:
    """Return a quantity in units that are smaller by powers of two."""
    return ldexp(number, sum(power * unit for power, unit in zip(dimension, units, strict=True)))


def answers(module: ModuleType, lam: int, lam0: float, v0: float, units: Dimension, p: dict) -> dict:
    """Return what a motion is like in these units, in the units of metre, kilogram and second."""
    place, back = (0, lam, 0), tuple(-unit for unit in units)
    t_max = scaled(2.5, TIME, units)
    motion = module.solve(scaled(lam0, place, units), scaled(v0, SPEED, units), t_max=t_max, **p)
    found = {"kind": motion.kind, "events": [event.kind for event in motion.events]}
    if motion.kind in ("libration", "circulation"):
        found["half_period" if motion.kind == "libration" else "period"] = scaled(motion.period, TIME, back)
    last = min(t_max, motion.t_end)
    state = motion.state([0.3 * last, 0.9 * last])
    for name, dimension in (("lam", place), ("v", SPEED), ("normal_force", FORCE)):
        found[name] = [scaled(float(value), dimension, back) for value in getattr(state, name)]
    found["normal_force_max"] = scaled(float(motion.normal_force_max.value), FORCE, back)
    return found


@pytest.mark.parametrize("name", CASES)
@given(data=st.data())
@examples(3, 100)
def test_answers_have_the_same_bits_in_all_units(name, data):
    """Neither a tolerance nor a step of a search is an absolute number."""
    module, lam, places, own = CASES[name]
    units = data.draw(st.tuples(*[st.integers(-40, 40)] * 3), label="powers of two of mass, length and time")
    lam0 = data.draw(st.floats(*places).filter(not_tiny), label="lam0")
    v0 = data.draw(st.just(0.0) | st.floats(1e-9, 6.0), label="v0")
    dimensions = {**DIMENSIONS, **own}
    defaults = {key: float(value) for key, value in module.MODEL.parameters.items()}
    p = {key: scaled(value, dimensions[key], units) for key, value in defaults.items()}
    assert answers(module, lam, lam0, v0, units, p) == answers(module, lam, lam0, v0, (0, 0, 0), defaults)


# The least share of the largest derivative of a quantity that counts. Most have the same bits; states of a body that
# moves to and fro in a turning frame differ by 4e-16.
BETWEEN_UNITS = 4e-15


def derivatives(name: str, lam0: float, v0: float, units: Dimension) -> dict[str, np.ndarray]:
    """Return derivatives of what a motion is like in these units, in the units of metre, kilogram and second, or
    nothing of those that do not exist.
    """
    module, lam, _, own = CASES[name]
    place, length, defaults = (0, lam, 0), (0, 1, 0), module.MODEL.parameters
    by = {key: (DIMENSIONS | {**own})[key] for key in defaults} | {"lam0": place, "v0": SPEED}
    p = {key: scaled(float(value), by[key], units) for key, value in defaults.items()}
    t_max, found = scaled(2.5, TIME, units), {}
    motion = module.solve(scaled(lam0, place, units), scaled(v0, SPEED, units), t_max=t_max, **p)

    def in_metres(rows: np.ndarray, dimension: Dimension) -> np.ndarray:
        powers = [
            sum((one - of) * unit for one, of, unit in zip(dimension, row, units, strict=True)) for row in by.values()
        ]
        return np.ldexp(rows, -np.array(powers)[:, None])

    if motion.kind == "rest":
        return found
    asked = {"v_max": SPEED, "normal_force_max": FORCE}
    asked |= {} if motion.kind == "circulation" else {"turning_points": place}
    asked |= {"period": TIME} if motion.kind in ("libration", "circulation") else {}
    for quantity, dimension in asked.items():
        rows = motion.gradient(quantity, tuple(by)).values()
        found[quantity] = in_metres(np.array([np.atleast_1d(row) for row in rows]), dimension)
    last = min(t_max, motion.t_end)
    changes = motion.sensitivity([0.3 * last, 0.9 * last], tuple(by))
    for field, dimension in (("lam", place), ("s", length), ("v", SPEED), ("normal_force", FORCE)):
        found[field] = in_metres(getattr(changes, field), dimension)
    return found


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name == "circle_drag" else pytest.mark.extended) for name in CASES]
)
@given(data=st.data())
@examples(8, otherwise=1)
def test_derivatives_do_not_depend_on_the_units(name, data):
    """In units that are powers of two, derivatives are multiplied by these powers."""
    units = data.draw(st.tuples(*[st.integers(-40, 40)] * 3), label="powers of two of mass, length and time")
    lam0 = data.draw(st.floats(*CASES[name].places).filter(not_tiny), label="lam0")
    v0 = data.draw(st.just(0.0) | st.floats(1e-3, 6.0), label="v0")
    assume(abs(lam0) > 1e-3)
    wanted, found = (derivatives(name, lam0, v0, of) for of in ((0, 0, 0), units))
    assert wanted.keys() == found.keys()
    for quantity, rows in wanted.items():
        size = np.abs(rows).max(initial=0.0)
        assert found[quantity] == pytest.approx(rows, rel=0, abs=BETWEEN_UNITS * size), quantity


@pytest.mark.parametrize("power", [-60, -40, -25, -22, 0, 25, 60])
def test_a_tiny_curve_without_a_domain_is_not_taken_for_a_cusp(power, tmp_path):
    """On a curve of nanometres ds grows by many orders of magnitude within a thousandth of a metre."""
    curve = gqm.Curve.graph("a*x**4 - b*x**2 + c*x", parameters={"a": 1, "b": "1.3", "c": "0.2"})
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="tiny_wells", folder=tmp_path)
    metre = ldexp(1.0, power)
    in_metres = module.solve(1.25, a=0.8, b=1.3, c=0.25)
    motion = module.solve(1.25 * metre, a=0.8 / metre**3, b=1.3 / metre, c=0.25, g=9.81 * metre)
    assert (motion.kind, motion.half_period) == ("libration", in_metres.half_period)
    assert [turn / metre for turn in motion.turning_points] == list(in_metres.turning_points)
    thrown = module.solve(1.25 * metre, 2.0 * metre, a=0.8 / metre**3, b=1.3 / metre, c=0.25, g=9.81 * metre)
    assert thrown.half_period == module.solve(1.25, 2.0, a=0.8, b=1.3, c=0.25).half_period
