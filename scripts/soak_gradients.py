"""Hold the derivatives of random motions against differences of solved motions, and swept derivatives against both.

``soak_gradients.py [COUNT] [SEED]``. COUNT modules are drawn as in ``soak_sweeps.py``. For each launch and quantity the
gradient is compared with a difference of fourth order of motions whose launch or parameters are changed a little, and
with the gradient of a sweep. What differs by more than such a difference can explain is printed with its launch, and at
the end the refusals are counted.
"""

import math
import random
import re
import sys
import tempfile
from collections import Counter
from fractions import Fraction
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from soak_sweeps import drawn_curve, drawn_force

import gqm_sym as gqm
from gqm_sym.errors import GQMError
from gqm_sym.runtime.launch import kinds
from gqm_sym.runtime.sweep.quantities import QUANTITIES

LAUNCHES, HORIZON = 3, 4.0
# The step of a difference as a share of the argument, and the least size of an argument.
STEP, LEAST_ARGUMENT = 1e-4, 0.1
# What a difference explains, and what separates two gradients, relative to the largest derivative or the value; with a
# least size.
BY_DIFFERENCE, BETWEEN_GRADIENTS, LEAST_SIZE = 3e-6, 1e-10, 1e-2
# The weights of a difference of fourth order at 2, 1, -1 and -2 steps.
WEIGHTS = {2: -1 / 12, 1: 8 / 12, -1: -8 / 12, -2: 1 / 12}

Given = dict[str, Any]


class Quantity:
    """A quantity of a module's motions, as a function of the launch and the run-time parameters."""

    def __init__(self, module: ModuleType, name: str, target: float) -> None:
        self.module, self.name, self.target = module, name, target
        self.where = {"lam": target} if name == "time_at" else {}

    def value(self, given: Given) -> tuple[Any, np.ndarray]:
        """Return a motion, and the quantity in the order of sweeps."""
        motion = self.module.solve(**given)
        return motion, np.atleast_1d(np.asarray(QUANTITIES[self.name].of_motion(motion, self.target), dtype=float))

    def gradient(self, motion: Any, names: list[str]) -> np.ndarray:
        """Return the derivatives: a row for each name."""
        found = motion.gradient(self.name, tuple(names), **self.where)
        rows = np.array([np.atleast_1d(found[name]) for name in names])
        is_reversed = self.name == "turning_points" and motion.turning_points[0] > motion.turning_points[1]
        return rows[:, ::-1] if is_reversed else rows

    def difference(self, given: Given, name: str) -> np.ndarray | None:
        """Return the derivative by one argument; None if the motions beside the given one are of other kinds."""
        step, found, seen = STEP * max(abs(given[name]), LEAST_ARGUMENT), 0.0, set()
        if name == "v0" and given[name] < 2.0 * step:
            return None
        for count, weight in {0: 0.0, **WEIGHTS}.items():
            motion, value = self.value(given | {name: given[name] + count * step})
            found = found + weight * value / step
            ends = tuple(leg.end for leg in motion.legs) if math.isfinite(motion.t_end) else ()
            seen.add((motion.kind, ends))
        return found if len(seen) == 1 and np.isfinite(found).all() else None


def is_apart(one: np.ndarray, other: np.ndarray, size: float, allowed: float) -> bool:
    """Return whether two arrays differ by more than is allowed; a NaN in either counts as a difference."""
    return not float(np.abs(one - other).max(initial=0.0)) <= allowed * size


def check(quantity: Quantity, launches: list[Given], names: list[str], refused: Counter[str]) -> list[str]:
    """Return the gradients that are not confirmed."""
    failures, swept = [], None
    shared = {key: value for key, value in launches[0].items() if key not in ("lam0", "v0")}
    places, speeds = ([given[key] for given in launches] for key in ("lam0", "v0"))
    try:
        swept = quantity.module.sweep(
            quantity.name, places, speeds, gradient=tuple(names), **shared, **quantity.where
        ).gradient
    except GQMError as error:
        refused[reason(error)] += 1
    for k, given in enumerate(launches):
        said = f"{quantity.name} of {given}"
        try:
            motion, value = quantity.value(given)
            if quantity.name == "turning_points" and motion.kind != "libration":
                continue  # sweeps have those of librations only
            rows = quantity.gradient(motion, names)
        except GQMError as error:
            refused[reason(error)] += 1
            continue
        size = max(np.abs(rows).max(), np.abs(value).max(), LEAST_SIZE)
        if swept is not None and is_apart(
            rows, of_sweep := swept[k].reshape(-1, len(names)).T, size, BETWEEN_GRADIENTS
        ):
            failures.append(f"swept {said}: {of_sweep.tolist()} and {rows.tolist()}")
        for name, row in zip(names, rows, strict=True):
            try:
                wanted = quantity.difference(given, name)
            except GQMError:
                continue
            if wanted is not None and is_apart(row, wanted, size, BY_DIFFERENCE):
                failures.append(f"{said} by {name}: {row.tolist()} and {wanted.tolist()}")
    return failures


def reason(error: GQMError) -> str:
    """Return a message without its numbers, so that equal refusals are counted together."""
    return re.sub(r"-?\d+(\.\d+)?(e-?\d+)?", "#", str(error))


def main() -> int:
    """Draw modules, and return 1 if a gradient is not confirmed."""
    count, seed = int((sys.argv[1:] or ["100"])[0]), int((sys.argv[2:] or ["0"])[0])
    draw, failed, refused = random.Random(seed), 0, Counter[str]()
    with tempfile.TemporaryDirectory() as folder:
        for number in range(count):
            try:
                said, curve, low, high = drawn_curve(draw)
            except GQMError:
                continue
            laws, force, loses = drawn_force(draw)
            shared = {
                "direction": draw.choice((1, -1)),
                "t_max": HORIZON if loses else None,
                "contact": draw.choice(("bilateral", "bilateral", "above")),
            }
            try:
                model = gqm.derive(curve, force)
            except GQMError:  # a body with a radius does not roll over a cusp, or along a curve in space
                continue
            module = gqm.build(model, name=f"drawn_{number}", folder=Path(folder))
            shared |= {name: float(Fraction(text)) for name, text in module.PARAMETERS.items()}
            launches = []
            for _ in range(LAUNCHES):
                speed = abs(draw.gauss(0.0, 1.0)) * (draw.random() < 0.5)
                launches.append({"lam0": draw.uniform(low, high), "v0": speed, **shared})
            names, target = ["lam0", "v0", *module.PARAMETERS], float(np.mean([given["lam0"] for given in launches]))
            for quantity in kinds.QUANTITIES:
                for failure in check(Quantity(module, quantity, target), launches, names, refused):
                    failed += 1
                    print(f"{said} with {laws}: {failure}", flush=True)
    for text, times in refused.most_common():
        print(f"refused {times} times: {text}")
    print(f"{count} modules (seed {seed}): {failed} differences")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
