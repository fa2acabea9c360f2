"""Hold the error bounds of random librations against times of flight with sixty digits.

``soak_bounds.py [COUNT] [SEED]``. Curves, forces and launches are drawn over many decades of size, speed and condition
number. The time from the launch to some places, and to the turning points, is integrated with mpmath from formulas that
stand here and not in the package. The motion is asked for these very times: each place must lie within the bound that
the motion states, and the bound must be of some use. What fails is printed as the call that shows it again.
"""

import math
import random
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from mpmath import mp, mpf

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import gqm_sym as gqm
from gqm_sym.errors import GQMError

DIGITS = 60
# Nodes of the Gauss-Legendre rule on each panel (14 take the least time; with fewer, panels are halved), and the share
# of the whole time that may be missed by a panel.
NODES, TOLERANCE = 14, mpf(10) ** -19
MAX_DEPTH = 40
# Places on the way to the next turning point at which a motion is looked at, as shares of the phase angle.
SHARES = (0.003, 0.01, 0.03, 0.1, 0.2, 0.4, 0.6, 0.8, 0.9, 0.97, 0.99, 1.0)
# A bound of more than this share of the width, per unit of the condition number, is of no use; nor is one of more than
# so much, if a curve is known in doubles only.
USELESS, USELESS_ROUNDED = 1e-11, 2e-14

Formula = Callable[[Any, dict[str, Any]], Any]


@dataclass(frozen=True)
class Family:
    """Curves with forces: how they are declared, and their potential per unit mass and ds/dlam as formulas."""

    curve: Any
    force: Any
    potential: Formula
    ds: Formula
    draw: Callable[[random.Random], dict[str, Any]]
    rounded: bool = False


def _signed(draw: random.Random, low: float, high: float) -> float:
    """Return a number of either sign, its logarithm evenly distributed."""
    return draw.choice((1.0, -1.0)) * 10.0 ** draw.uniform(low, high)


def _polynomial(draw: random.Random) -> dict[str, float]:
    return {
        "c1": draw.choice((0.0, _signed(draw, -2.0, 0.5))),
        "c2": _signed(draw, -2.0, 1.5),
        "c3": draw.choice((0.0, _signed(draw, -2.0, 0.0))),
        "c4": 10.0 ** draw.uniform(-2.0, 1.0),
        "k": draw.choice((0.0, 10.0 ** draw.uniform(-2.0, 2.0))),
    }


def _height(x: Any, p: dict[str, Any]) -> Any:
    return x * (p["c1"] + x * (p["c2"] + x * (p["c3"] + x * p["c4"])))


def _balanced(a: float, k: float, middle: float) -> dict[str, float]:
    return {"a": a, "k": k, "c": 9.81 * a / k + middle}


FAMILIES = {
    "polynomial": Family(
        gqm.Curve.graph("c1*x + c2*x**2 + c3*x**3 + c4*x**4", parameter="x"),
        gqm.Gravity() + gqm.Potential("k*x**2/2"),
        lambda x, p: p["g"] * _height(x, p) + p["k"] * x**2 / 2,
        lambda x, p: mp.sqrt(1 + (p["c1"] + x * (2 * p["c2"] + x * (3 * p["c3"] + x * 4 * p["c4"]))) ** 2),
        _polynomial,
    ),
    "ellipse": Family(
        gqm.Curve.parametric(x="a*sin(u)", z="-b*cos(u)", parameter="u", period="2*pi"),
        gqm.Gravity() + gqm.Potential("k*x"),
        lambda u, p: -p["g"] * p["b"] * mp.cos(u) + p["k"] * p["a"] * mp.sin(u),
        lambda u, p: mp.sqrt((p["a"] * mp.cos(u)) ** 2 + (p["b"] * mp.sin(u)) ** 2),
        lambda draw: {
            "a": 10.0 ** draw.uniform(-1.0, 1.0),
            "b": 10.0 ** draw.uniform(-1.0, 1.0),
            "k": draw.choice((0.0, draw.uniform(-5.0, 5.0))),
        },
    ),
    "rotating": Family(
        gqm.Curve.graph("x**2/2", parameter="x"),
        gqm.Gravity() + gqm.RotatingFrame() + gqm.Potential("q*x**4"),
        lambda x, p: p["g"] * x**2 / 2 - p["Omega"] ** 2 * x**2 / 2 + p["q"] * x**4,
        lambda x, p: mp.sqrt(1 + x**2),
        lambda draw: {"Omega": draw.uniform(0.0, 8.0), "q": 10.0 ** draw.uniform(-2.0, 2.0)},
    ),
    "polar": Family(
        gqm.Curve.polar("1 + d*cos(u)", parameter="u", period="2*pi"),
        gqm.Gravity() + gqm.Potential("k*x"),
        lambda u, p: (1 + p["d"] * mp.cos(u)) * (p["g"] * mp.sin(u) + p["k"] * mp.cos(u)),
        lambda u, p: mp.sqrt((1 + p["d"] * mp.cos(u)) ** 2 + (p["d"] * mp.sin(u)) ** 2),
        lambda draw: {"d": _signed(draw, -3.0, -0.1), "k": draw.choice((0.0, draw.uniform(-5.0, 5.0)))},
    ),
    "central": Family(
        gqm.Curve.parametric(x="d + sin(u)", z="-cos(u)", parameter="u", period="2*pi"),
        gqm.Gravity() + gqm.CentralForce(k="k"),
        lambda u, p: -p["g"] * mp.cos(u) - p["k"] / mp.sqrt((p["d"] + mp.sin(u)) ** 2 + mp.cos(u) ** 2),
        lambda _u, _p: mpf(1),
        lambda draw: {"d": draw.choice((-1.0, 1.0)) * draw.uniform(1.1, 3.0), "k": 10.0 ** draw.uniform(-2.0, 2.0)},
    ),
    "ring": Family(
        gqm.Curve.implicit("x**2 + z**2 - 1", start=(0, -1)),
        gqm.Gravity() + gqm.Potential("k*x"),
        lambda s, p: -p["g"] * mp.cos(s) + p["k"] * mp.sin(s),
        lambda _s, _p: mpf(1),
        lambda draw: {"k": draw.choice((0.0, draw.uniform(-5.0, 5.0)))},
    ),
    "rolling": Family(
        gqm.Curve.implicit("x**2 + z**2 - 1", start=(0, -1)),
        gqm.Gravity() + gqm.Rolling(radius="a"),
        lambda s, p: -p["g"] * (1 - p["a"]) * mp.cos(s) / (1 + p["beta"]),
        lambda _s, p: 1 - p["a"],
        lambda draw: {"a": draw.uniform(0.01, 0.9), "beta": draw.uniform(0.0, 1.0)},
        rounded=True,
    ),
    # Gravity against a spring: about the equilibrium, which is next to 0, large forces cancel.
    "balance": Family(
        gqm.Curve.graph("a*x", parameter="x"),
        gqm.Gravity() + gqm.Potential("k*(x - c)**2/2"),
        lambda x, p: p["g"] * p["a"] * x + p["k"] * (x - p["c"]) ** 2 / 2,
        lambda _x, p: mp.sqrt(1 + p["a"] ** 2),
        lambda draw: _balanced(draw.uniform(-2.0, 2.0), 10.0 ** draw.uniform(-1.0, 2.0), draw.uniform(-1e-4, 1e-4)),
    ),
    # A smooth track through points of a line: it is known exactly, and has joints all the same.
    "track": Family(
        gqm.Curve.sampled([("-4", "-3"), ("-2", "-1.5"), ("0", "0"), ("1.2", "0.9"), ("2.8", "2.1"), ("4", "3")]),
        gqm.Gravity() + gqm.Potential("k*x**2/2"),
        lambda s, p: p["g"] * (s - 5) * 3 / 5 + p["k"] * ((s - 5) * 4 / 5) ** 2 / 2,
        lambda _s, _p: mpf(1),
        lambda draw: {"k": 10.0 ** draw.uniform(-0.5, 3.0), "lam0": draw.uniform(0.1, 9.9)},
    ),
}


def build(folder: str | Path) -> dict[str, ModuleType]:
    """Return the module of each family."""
    return {
        name: gqm.build(gqm.derive(family.curve, family.force), name=f"soaked_{name}", folder=folder)
        for name, family in FAMILIES.items()
    }


def drawn(draw: random.Random) -> tuple[str, dict[str, Any]]:
    """Return a family with a launch, of many sizes; one in three nearly reaches an equilibrium."""
    name = draw.choice(list(FAMILIES))
    family = FAMILIES[name]
    p = {**family.draw(draw), "g": draw.choice((9.81, 1.62))}
    lam0 = draw.choice((draw.uniform(-3.0, 3.0), _signed(draw, -7.0, 0.0)))
    v0 = draw.choice((0.0, 0.0, 10.0 ** draw.uniform(-6.0, 1.0)))
    if draw.random() < 1.0 / 3.0:
        top = equilibrium(family, lam0, p)
        if top is not None:
            energy = float(family.potential(mpf(top), p) - family.potential(mpf(lam0), p))
            gap = 10.0 ** -draw.uniform(0.5, 4.5)
            v0 = math.sqrt(2.0 * energy * (1.0 - gap)) if energy > 0.0 else v0
    return name, {"lam0": lam0, "v0": v0, "direction": draw.choice((1, -1)), **p}


def equilibrium(family: Family, lam0: float, p: dict[str, float]) -> float | None:
    """Return a maximum of the potential near a place, if steps in doubles come upon one."""
    step, x = 0.05, lam0
    before, here = (float(family.potential(mpf(place), p)) for place in (x - step, x))
    for _ in range(80):
        after = float(family.potential(mpf(x + step), p))
        if before < here > after:
            return x
        x, before, here = x + step, here, after
    return None


def times(family: Family, p: dict[str, Any], ends: tuple[Any, Any], energy: Any, edges: list[Any]) -> list[Any]:
    """Return the time between each two neighbours of phase angles, between the turning points ``ends``."""
    a, b = ends
    nodes = _nodes()

    def rate(phi: Any) -> Any:
        left, right = mp.sin(phi / 2) ** 2, mp.cos(phi / 2) ** 2
        place = a + (b - a) * left
        return family.ds(place, p) * (b - a) * mp.sqrt(left * right / (2 * (energy - family.potential(place, p))))

    def rule(low: Any, high: Any) -> Any:
        middle, half = (low + high) / 2, (high - low) / 2
        return half * sum(weight * rate(middle + half * x) for x, weight in nodes)

    def panel(low: Any, high: Any, whole: Any, depth: int) -> Any:
        middle = (low + high) / 2
        parts = rule(low, middle), rule(middle, high)
        if abs(sum(parts) - whole) <= TOLERANCE * abs(whole) or depth == 0:
            return sum(parts)
        return panel(low, middle, parts[0], depth - 1) + panel(middle, high, parts[1], depth - 1)

    return [panel(low, high, rule(low, high), MAX_DEPTH) if low != high else mpf(0) for low, high in pairwise(edges)]


def _nodes() -> list[tuple[Any, Any]]:
    """Return the Gauss-Legendre rule of `NODES` nodes, by Newton's method from its nodes in doubles."""
    for guess in () if _RULE else np.polynomial.legendre.leggauss(NODES)[0].tolist():
        x = mpf(guess)
        for _ in range(3):
            before, value = mpf(1), x
            for n in range(2, NODES + 1):
                before, value = value, ((2 * n - 1) * x * value - (n - 1) * before) / n
            slope = NODES * (x * value - before) / (x**2 - 1)
            x -= value / slope
        _RULE.append((x, 2 / ((1 - x**2) * slope**2)))
    return _RULE


_RULE: list[tuple[Any, Any]] = []


def faults(module: ModuleType, family: Family, call: dict[str, Any]) -> tuple[list[str], int]:
    """Say which places lie outside their bounds, and which bounds are of no use; with the number of checks."""
    motion = module.solve(**call)
    if motion.kind != "libration":
        return [], 0
    with mp.workdps(DIGITS):
        p = {name: mpf(value) for name, value in call.items()}
        start, energy = p["lam0"], p["v0"] ** 2 / 2 + family.potential(p["lam0"], p)
        a, b = (root(family, p, energy, turn, start, call["v0"]) for turn in sorted(motion.turning_points))
        begin = 2 * mp.atan2(mp.sqrt(max(start - a, 0)), mp.sqrt(max(b - start, 0)))
        end = mp.pi if motion.direction > 0 else mpf(0)
        edges = [begin + (end - begin) * mpf(share) for share in (0.0, *SHARES)]
        found, spent = [], mpf(0)
        width = float(b - a)
        for share, phi, lasted in zip(SHARES, edges[1:], times(family, p, (a, b), energy, edges), strict=True):
            spent += abs(lasted)
            exactly = mp.nstr(spent, 40)
            error = abs(mpf(motion.lam(exactly)) - (a + (b - a) * mp.sin(phi / 2) ** 2))
            bound = motion.error_bound(exactly)
            if not error <= bound:
                found.append(f"outside its bound by a factor of {float(error / bound):.2g} at share {share}")
            useful = max(USELESS * max(width, abs(call["lam0"])), USELESS_ROUNDED if family.rounded else 0.0)
            if not bound <= useful * motion.condition_number:
                found.append(f"useless bound by {bound / width:.1e} of the width at share {share}")
    return found, len(SHARES)


def root(family: Family, p: dict[str, Any], energy: Any, guess: float, start: Any, v0: float) -> Any:
    """Return the turning point that a double is the rounding of; the launch from rest is one itself."""
    if v0 == 0.0 and guess == float(start):
        return start
    x = mpf(guess)
    for _ in range(60):
        slope = mp.diff(lambda place: family.potential(place, p), x)
        if slope == 0:
            break
        step = (energy - family.potential(x, p)) / slope
        x += step
        if abs(step) <= mpf(10) ** (8 - DIGITS) * abs(x):
            break
    return x


def soak(count: int, seed: int, modules: dict[str, ModuleType]) -> tuple[Counter[str], list[str]]:
    """Draw so many launches, or until it is interrupted; what came of them, and what failed, which is printed."""
    draw, tally, failed = random.Random(seed), Counter[str](), list[str]()
    with suppress(KeyboardInterrupt):
        for _ in range(count):
            name, call = drawn(draw)
            try:
                found, checks = faults(modules[name], FAMILIES[name], call)
                tally["checks"] += checks
                tally["librations" if checks else "other motions"] += 1
            except GQMError as error:
                tally[type(error).__name__] += 1
                found = []
            shown = ", ".join(f"{key}={value!r}" for key, value in call.items())
            failed += [f"{what}: {name}.solve({shown})" for what in found]
            if found:
                print(*failed[-len(found) :], sep="\n", flush=True)
    return tally, failed


def main(count: int, seed: int) -> int:
    """Print what failed and the counts; returns 1 if anything did."""
    with tempfile.TemporaryDirectory() as folder:
        tally, failed = soak(count, seed, build(folder))
    print(f"{dict(tally)}, {len(failed)} failures")
    return 1 if failed else 0


if __name__ == "__main__":
    asked = [int(word) for word in sys.argv[1:]]
    sys.exit(main(*(asked + [1000, 0][len(asked) :])))
