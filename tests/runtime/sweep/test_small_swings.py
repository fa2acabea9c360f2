"""Speeds and times of swings that are small beside their place have all digits in sweeps."""

from pathlib import Path
from typing import Any

import mpmath as mp
import numpy as np
import pytest

import gqm_sym as gqm
from gqm_sym.runtime.compiled.types import Array

# About the bottom of this graph, terms of the slope cancel that are as large as one.
HEIGHT = "x**2/2 + cos(2*x)/8 - x"


def bottom() -> mp.mpf:
    """Return the place of the bottom."""
    return mp.findroot(lambda x: x - mp.sin(2 * x) / 4 - 1, 1.2)


def swings(place: float, width: float) -> Array:
    """Return launch places on both sides of a place."""
    return place + width * np.array([-1.3, -0.6, 0.5, 1.1])


@pytest.mark.parametrize(("drag", "force"), [("c", gqm.LinearDrag()), ("b", gqm.QuadraticDrag())])
def test_the_largest_speed_follows_from_the_energy(drag: str, force: gqm.Kernel, tmp_path: Path) -> None:
    """With a vanishing resistance the largest speed is that of the bottom, for widths of many decades."""
    graph = gqm.Curve.graph(HEIGHT, parameter="x")
    module = gqm.build(gqm.derive(graph, gqm.Gravity() + force), name=f"small_{drag}", folder=tmp_path)
    with mp.workdps(50):
        place = bottom()

        def energy(x: mp.mpf) -> mp.mpf:
            return mp.mpf(9.81) * (x**2 / 2 + mp.cos(2 * x) / 8 - x)

        for decade in range(1, 9):
            lam0 = swings(float(place), 10.0**-decade)
            found = module.sweep("v_max", lam0, t_max=10, **{drag: 1e-18})
            true = [float(mp.sqrt(2 * (energy(mp.mpf(x)) - energy(place)))) for x in lam0.tolist()]
            assert found.values == pytest.approx(true, rel=4e-15)
            assert found.route_counts().get("solve", 0) == 0


def points() -> gqm.Curve:
    """Return a track through points with a bottom."""
    x = np.linspace(-3, 3, 61)
    return gqm.Curve.sampled(np.column_stack([x, x * x / 4 + 0.05 * np.cos(2 * x)]))


@pytest.mark.parametrize(
    ("curve", "place"), [(gqm.Curve.graph(HEIGHT, parameter="x"), None), (points(), 5.0)], ids=["graph", "points"]
)
@pytest.mark.parametrize("width", [1e-2, 1e-6])
def test_they_are_those_of_solved_motions(curve: Any, place: float | None, width: float, tmp_path: Path) -> None:
    """They agree with those of `solve`, and have the same bits for one launch as for many."""
    force = gqm.Gravity() + gqm.LinearDrag()
    module = gqm.build(gqm.derive(curve, force), name=f"swings_{curve.parameter}", folder=tmp_path)
    place = float(bottom()) if place is None else module.solve(place, c=1e-15, t_max=10).v_max.lam
    v0, direction, target = np.array([0.0, width, 0.0, 2.0 * width]), [1, 1, -1, -1], place + 0.1 * width
    launches = swings(place, width), v0, np.array(direction)
    for quantity, more in (("v_max", {}), ("v_min", {"t_max": 0.2}), ("time_at", {"lam": target})):
        given: dict[str, Any] = {"c": 0.1, "t_max": 10, **more}
        found = module.sweep(quantity, *launches, **given)
        assert found.route_counts().get("solve", 0) == 0
        for k, launch in enumerate(zip(*(of.tolist() for of in launches), strict=True)):
            assert module.sweep(quantity, *launch, **given).values == found.values[k]
            motion = module.solve(*launch, c=0.1, t_max=given["t_max"])
            true = motion.time_at(target) if quantity == "time_at" else getattr(motion, quantity).value
            assert found.values[k] == pytest.approx(true, rel=6e-15), quantity


def test_wells_side_by_side(tmp_path: Path) -> None:
    """In many wells far from the origin, answers do not depend on the order of the launches."""
    graph = gqm.Curve.graph("sin(x) + x/50", parameter="x")
    module = gqm.build(gqm.derive(graph, gqm.Gravity() + gqm.LinearDrag()), name="wells", folder=tmp_path)
    wells = 2.0 * np.pi * np.array([1, 9, 40]) - np.pi / 2.0
    lam0 = (wells[:, None] + np.array([-1.4, -0.1, 0.02, 0.7])).ravel()
    order = np.random.default_rng(1).permutation(lam0.size)
    found = module.sweep("v_max", lam0, c=0.1, t_max=2).values
    assert (module.sweep("v_max", lam0[order], c=0.1, t_max=2).values == found[order]).all()
    true = [module.solve(place, c=0.1, t_max=2).v_max.value for place in lam0.tolist()]
    assert found == pytest.approx(true, rel=4e-15)
