#!/usr/bin/env python3
"""Count the launches of sweeps that no compiled loop answers, over the famous curves and the example curves.

    python benchmarks/routes.py                    all curves with formulas on which no energy is lost
    python benchmarks/routes.py --curve Parabola   those whose name contains this
    python benchmarks/routes.py --force rolling    with this force only; the example curves have their own

Launches are uniform over the energies between the bottom of each well and the next hilltop, which the end of a domain
may be too. Each figure is the share of launches that were solved one by one, in percent, and after a slash the share
that a compiled loop answered singly where batches might have. ``passing`` launches have up to twice that energy above
the bottom, so that they leave the well; ``above`` asks them when a body that the track can only push lifts off. A
figure above 1 % is marked ``!``, and the exit code is then 1.
"""

import argparse
import importlib
import json
import sys
from collections.abc import Iterator
from itertools import chain, pairwise
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import gqm_sym as gqm

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT))
# How far is looked for wells on curves without ends, at how many places, and how many launches each well gets.
REACH, PLACES, LAUNCHES = 4.0, 4001, 300
# The largest share of launches that may be solved one by one.
ALLOWED = 0.01
# Quantities asked of launches within a well, and of those that pass the next hilltop.
WITHIN = ("half_period", "turning_points", "normal_force_max", "v_min", "time_at")
PASSING = ("period", "normal_force_max", "v_min", "time_at", "t_end")
FORCES = {
    "gravity": (lambda: gqm.Gravity(), {}),
    "rolling radius": (lambda: gqm.Gravity() + gqm.Rolling(radius="rho"), {"beta": 0.4, "rho": 0.01}),
    "rotating": (lambda: gqm.Gravity() + gqm.RotatingFrame(), {"Omega": 0.7}),
}
# What the example curves require beside their defaults.
REQUIRED = 1.0


class SweptModule(NamedTuple):
    """A module, what it is asked with, and the range of places on which wells are looked for."""

    name: str
    module: ModuleType
    given: dict[str, Any]
    low: float
    high: float


def famous(curve: str, force: str) -> Iterator[SweptModule]:
    """Yield each curve of the corpus that has formulas, with each force."""
    for entry in json.loads((ROOT / "tests/data/curves.json").read_text()):
        for law, (made, parameters) in FORCES.items():
            if entry["kind"] == "implicit" or curve not in entry["name"] or force not in law:
                continue
            ends = {"period": entry["period"]} if entry["period"] else {"domain": tuple(entry["domain"])}
            texts = {key: entry[key] for key in ("x", "z") if entry["kind"] == "parametric"}
            formula = () if texts else (entry["expr"],)
            declared = getattr(gqm.Curve, entry["kind"])(*formula, **texts, parameter=entry["parameter"], **ends)
            model = gqm.derive(declared, made(), parameters=entry["params"])
            name = "".join(c if c.isalnum() else "_" for c in f"routes_{entry['name']}_{law}".lower())
            low, high = map(float, entry["domain"])
            yield SweptModule(f"{entry['name']}, {law}", gqm.build(model, name=name), parameters, low, high)


def examples(curve: str, force: str) -> Iterator[SweptModule]:
    """Yield each example curve that has formulas and loses no energy."""
    for path in sorted((ROOT / "curves").glob("*.yaml")):
        module = importlib.import_module(f"generated.{path.stem}")
        model, asked_for = module.MODEL, curve in path.stem and force in "own"
        if asked_for and model.chart is None and model.dissipation is None and model.signed:
            given = {name: REQUIRED for name, value in module.PARAMETERS.items() if value is None}
            yield SweptModule(path.stem, module, given, -REACH, REACH)


def wells(swept: SweptModule) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Return places and potentials from one hilltop to the next."""
    places = np.linspace(swept.low, swept.high, PLACES)[1:-1]
    lam0 = float(places[PLACES // 2]) if swept.low < 0.0 else float(places[PLACES // 3])
    level = -0.5 * swept.module.pass1(places, lam0, 0.0, **swept.given).v2
    tops = [0, *(np.flatnonzero((level[1:-1] >= level[:-2]) & (level[1:-1] > level[2:])) + 1), level.size - 1]
    for first, last in pairwise(tops):
        part = slice(first, last + 1)
        if np.isfinite(level[part]).all() and 2 < level[part].argmin() < last - first - 2:
            yield places[part], level[part]


def launches(swept: SweptModule, most: float, rng: np.random.Generator) -> list[NDArray[np.float64]]:
    """Return places, speeds and directions of launches, and a place that each body passes."""
    found = [np.empty((4, 0))]
    for places, level in wells(swept):
        bottom = level.argmin()
        depth = min(level[0], level[-1]) - level[bottom]
        energy = level[bottom] + depth * rng.uniform(most - 1.0, most, LAUNCHES)
        first = np.array([np.flatnonzero(level[: bottom + 1] <= e)[0] for e in energy])
        last = np.array([bottom + np.flatnonzero(level[bottom:] <= e)[-1] for e in energy])
        at = rng.integers(first, last + 1)
        v2 = 2.0 * (energy - level[at])
        rest = rng.random(LAUNCHES) < (0.5 if most == 1.0 else 0.0)
        at, v2 = np.where(rest, np.where(rng.random(LAUNCHES) < 0.5, first, last), at), np.where(rest, 0.0, v2)
        found.append(
            np.array([places[at], np.sqrt(v2), rng.choice([-1.0, 1.0], LAUNCHES), np.full(LAUNCHES, places[bottom])])
        )
    return list(np.concatenate(found, axis=1))


def shares(swept: SweptModule, quantity: str, some: list[NDArray[np.float64]], **given: Any) -> tuple[float, float]:
    """Return the shares of launches that were solved one by one, and singly."""
    lam0, v0, direction, place = some
    extra = {"lam": place} if quantity == "time_at" else {}
    found = swept.module.sweep(quantity, lam0, v0, direction, **extra, **swept.given, **given)
    return float((found.route == 2).mean()), float((found.route == 1).mean())


def main() -> int:
    """Count, print, and say which curves exceed the limit."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--curve", default="", help="curves whose name contains this")
    parser.add_argument("--force", default="", help="forces whose name contains this")
    args = parser.parse_args()
    over = []
    for swept in chain(famous(args.curve, args.force), examples(args.curve, args.force)):
        rng = np.random.default_rng(1)
        said = [f"{swept.name:40s}"]
        for label, most, quantities, given in (
            ("", 1.0, WITHIN, {}),
            ("passing ", 2.0, PASSING, {}),
            ("above ", 1.0, ("t_end",), {"contact": "above", "t_max": 5.0}),
            ("above passing ", 2.0, ("t_end",), {"contact": "above", "t_max": 5.0}),
        ):
            some = launches(swept, most, rng)
            for quantity in quantities if some[0].size else ():
                solved, single = shares(swept, quantity, some, **given)
                bad = solved > ALLOWED
                said.append(f"{label}{quantity} {solved:.1%}/{single:.0%}{'!' if bad else ''}".replace("%", ""))
                over += [f"{swept.name}: {label}{quantity} {solved:.1%}"] if bad else []
        print("  ".join(said), flush=True)
    print(f"\n{len(over)} figures above {ALLOWED:.0%}", *over, sep="\n  ")
    return 1 if over else 0


if __name__ == "__main__":
    sys.exit(main())
