"""The answers of a motion with losses do not depend on earlier questions."""

from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from selection import examples

import gqm_sym as gqm

# The motions are a swing that rests, two that go on for ever, one that dies away, and an approach without a swing.
KERNELS = {
    "friction": gqm.CoulombFriction(),
    "drag": gqm.QuadraticDrag(),
    "viscous": gqm.Kernel.law("-direction*c*sqrt(W)", parameters=("c",)),
}
LAUNCHES: dict[str, tuple[str, dict[str, Any]]] = {
    "rests": ("friction", {"mu": "1/50"}),
    "goes on": ("drag", {"b": "1/10"}),
    "goes on slowly": ("viscous", {"c": "1/10"}),
    "dies away": ("viscous", {"c": 6}),
    "creeps": ("viscous", {"c": 40}),
}
LATEST = 30.0


@pytest.fixture(scope="module")
def modules(tmp_path_factory: pytest.TempPathFactory) -> dict[str, ModuleType]:
    """Return a parabola z = x**2/2 with each force."""
    folder: Path = tmp_path_factory.mktemp("order")
    curve = gqm.Curve.graph("x**2/2", parameter="x")
    return {
        name: gqm.build(gqm.derive(curve, gqm.Gravity() + force), name=f"order_{name}", folder=folder)
        for name, force in KERNELS.items()
    }


def asked(motion: Any, end: float) -> dict[str, Callable[[], Any]]:
    """Return questions to a motion; each computes as much of the motion as it needs."""
    times = np.linspace(0.0, end, 41)
    return {
        "a time": lambda: motion.state(0.3 * end),
        "a place": lambda: motion.lam(0.011 * end),
        "an exact time": lambda: motion.state("1/3"),
        "times": lambda: [row.tolist() for row in motion.state(times)],
        "errors": lambda: motion.error_bound(times).tolist(),
        "legs": lambda: list(motion.legs),
        "turning points": lambda: motion.turning_points,
        "events": lambda: list(motion.events),
        "events between": lambda: [repr(event) for event in motion.events_between(0, end / 3)],
        "condition": lambda: (motion.condition_number, motion.quadrature_error),
        "an arrival": lambda: motion.time_at(motion.lam(0.02 * end)),
        "end": lambda: motion.t_end,
        "derivatives of turning points": lambda: motion.gradient("turning_points"),
        "largest speed": lambda: motion.v_max,
        "least contact force": lambda: motion.normal_force_min,
        "derivatives of a state": lambda: [row.tolist() for row in motion.sensitivity(0.02 * end)[1:]],
    }


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", LAUNCHES)
@examples(12)
@given(order=st.permutations(range(16)), launch=st.sampled_from([("1/2", 0), ("-1/3", 1), ("1/4", "7/3")]))
def test_any_order(name: str, modules: dict[str, ModuleType], order: list[int], launch: tuple[Any, Any]) -> None:
    """Each question alone, of a motion that was asked nothing else, gives the same digits."""
    module, parameters = modules[LAUNCHES[name][0]], LAUNCHES[name][1]

    def solved() -> Any:
        return module.solve(launch[0], launch[1], 1, **parameters)

    end = min(solved().t_end, LATEST)
    motion = solved()
    questions, names = asked(motion, end), list(asked(motion, end))
    for question in (names[k] for k in order):
        assert questions[question]() == asked(solved(), end)[question](), question


@pytest.mark.extended
def test_times_that_grow(modules: dict[str, ModuleType]) -> None:
    """Each of several increasing times has the digits that it has among many, before and after the part that was
    followed.
    """
    for name, (kernel, parameters) in LAUNCHES.items():
        times = np.linspace(0.0, 20.0, 201)
        motion, other = (modules[kernel].solve("1/2", "1/3", 1, **parameters) for _ in range(2))
        times = times[times <= other.t_end]
        whole = np.array(other.state(times))
        one_by_one = np.array([motion.state(t) for t in times.tolist()]).T
        assert np.array_equal(one_by_one, whole), name
        assert motion.error_bound(times).tolist() == whole[-1].tolist()
