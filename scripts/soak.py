"""Solve random launches of the committed modules and hold each motion to its laws: ``soak.py [COUNT] [SEED]``.

Launch, speed, direction and parameters are drawn at random. A solve may be refused by a GQMError (a launch outside the
domain, for one); a motion that is given must keep its energy, its order, its period and its error bounds, and a sweep
over launches around it must give the same period. One motion in a hundred is looked at over a second period, the others
over the first. What fails is printed as the call that shows it again.
Memory is reported at a tenth of the run and at its end.
"""

import math
import random
import sys
import time
from collections import Counter
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from mpmath import mp, mpf

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from gqm_sym.errors import GQMError  # noqa: E402

NAMES = sorted(path.stem for path in (ROOT / "generated").glob("*.py"))
# Of the largest V**2 on the way, and of a place of the curve: many roundings, and far above those of a right motion.
ENERGY = 1e-11
# Periods of a sweep against those of the motions, relative: four units in the last place.
SWEPT = 4.0 * 2.0**-52
# One motion in so many is looked at closely, and of these one in so many is compared with a sweep.
CLOSELY, SWEEPS = 100, 8
# Heights of charts, as a share of the largest of them.
ROUNDED = 1e-14
# Places and times against bounds that the motion states: a factor for what is not bounded, the formulas' rounding.
SLACK = 4.0
PLACE = 1e-12
# Times at which a motion is looked at: closely, and otherwise.
COLUMN, FEW = 12, 4


def drawn(module: ModuleType, draw: random.Random) -> dict[str, Any]:
    """A launch and parameters, of many sizes."""
    values: dict[str, Any] = {}
    for name, default in module.PARAMETERS.items():
        value = 1.0 if default is None else float(quotient(default))
        values[name] = value * math.exp(draw.gauss(0.0, 0.5)) if draw.random() < 0.5 else value
    lam0 = draw.choice(
        (draw.uniform(-1.5, 1.5), draw.gauss(0.0, 3.0), draw.choice((0.0, 1.0, -1.0)), 10.0 ** -draw.uniform(0, 9))
    )
    v0 = draw.choice((0.0, 0.0, draw.uniform(0, 5), math.exp(draw.gauss(0, 2)), 10.0 ** -draw.uniform(0, 12)))
    return {"lam0": lam0, "v0": v0, "direction": draw.choice((1, -1)), **values}


def quotient(text: str) -> float:
    """The value of a default, which may be a quotient."""
    top, _, bottom = text.partition("/")
    return float(top) / float(bottom or 1)


def faults(module: ModuleType, call: dict[str, Any], draw: random.Random, closely: bool) -> list[str]:
    """Say which laws a motion breaks; nothing where it keeps them all."""
    motion = module.solve(**call)
    found = []
    repeats = motion.kind in ("libration", "circulation")
    first = motion.legs[-1].t_end if repeats else min(motion.t_end, 10.0)
    span = motion.period if closely and repeats else first
    if not span > 0.0:
        return [] if motion.kind in ("rest", "equilibrium") or span == 0.0 else [f"span {span}"]
    count = COLUMN if closely else FEW
    t = np.sort([draw.uniform(0.0, 1.0) * span for _ in range(count)])
    state = motion.state(t)
    values = [np.asarray(row, dtype=float) for row in (state.lam, state.x, state.z, state.v, state.v2)]
    if not all(np.isfinite(row).all() for row in values):
        return ["not finite"]
    lam, v2 = values[0], values[4]
    if motion.kind == "rest":
        return [] if np.all(lam == call["lam0"]) and not np.any(values[3]) else ["moves at rest"]
    legs = motion.legs
    launch = {**call, "direction": legs[0].direction}
    ds = module.pass1(lam, **launch).ds
    # Near a place of rest a place's last bit is much of V**2, and of the way there.
    bit = 2.0 * np.spacing(np.abs(lam))
    told, *beside = (speed_squared(module, lam + side * bit, launch) for side in (0.0, -1.0, 1.0))
    told, rounding = told
    unsure = rounding + sum(np.abs(other - told) for other, _ in beside)
    late = SLACK * bit * ds / np.maximum(np.abs(values[3]), 1e-300)
    most = max(call["v0"] ** 2, float(np.nanmax(np.abs(told))), float(np.max(v2)))
    # With losses V**2 depends on the way, and pass 1 tells that of the first leg.
    held = t <= (legs[0].t_end if module.MODEL.dissipation is not None else t[-1])
    if np.any((np.abs(v2 - told) > ENERGY * most + unsure)[held]):
        found.append(f"energy {np.max(np.abs(v2 - told)) / most:.1e}")
    size = max(1e-300, float(np.max(np.abs(lam))), abs(call["lam0"]))
    turns = sorted(motion.turning_points)
    if motion.kind == "libration":
        over = max(turns[0] - lam.min(), lam.max() - turns[1])
        if over > PLACE * size:
            found.append(f"beyond a turning point by {over:.1e}")
    if any(one.t_end > two.t_start or one.t_start > one.t_end for one, two in pairwise(legs)):
        found.append("legs out of order")
    for leg in legs:
        inside = (t > leg.t_start) & (t < leg.t_end)
        steps = np.diff(lam[inside])
        if np.any(-leg.direction * steps > PLACE * size):
            found.append("not monotone on a leg")
    if closely and motion.kind == "libration":
        bound = np.asarray(motion.error_bound(t))
        if module.MODEL.dissipation is None and draw.random() < 1.0 / SWEEPS:
            found += swept(module, call, motion.period)
        again = np.asarray(motion.lam(t + span))
        allowed = SLACK * (bound + np.asarray(motion.error_bound(t + span))) + PLACE * size
        rate = np.abs(np.asarray(state.v)) * np.spacing(span) / np.maximum(ds, 1e-300)
        if np.any(np.abs(again - lam) > allowed + SLACK * rate):
            found.append(f"not periodic by {np.max(np.abs(again - lam)):.1e}, bound {np.max(bound):.1e}")
    middle = count // 2
    passed = float(motion.time_at(float(lam[middle])))
    if passed > t[middle] + 1e-9 * span + late[middle]:
        found.append(f"first passage late by {passed - t[middle]:.1e}")
    return found


def speed_squared(module: ModuleType, lam: Any, launch: dict[str, Any]) -> tuple[Any, float]:
    """V**2 at places by another way than the motion's, from heights where there are formulas; and its roundings.

    With losses there are none: what pass 1 says of the first leg.
    """
    exact = module.MODEL.exact
    if exact is None or module.MODEL.dissipation is not None:
        return module.pass1(lam, **launch).v2, 0.0
    with mp.workdps(40):
        p = tuple(mpf(launch[name]) for name in module.PARAMETERS)
        start, *heights = (climb(module, float(place), launch, p) for place in (launch["lam0"], *lam))
        size = 0.0 if hasattr(exact, "x") else ROUNDED * float(max(map(abs, heights)))  # a chart is one of doubles
        return np.array([float(mpf(launch["v0"]) ** 2 + start - height) for height in heights]), size


def climb(module: ModuleType, lam: float, launch: dict[str, Any], p: tuple[Any, ...]) -> Any:
    """What V**2 loses in climbing to a place, up to a constant; on charts by its coordinates."""
    exact = module.MODEL.exact
    if hasattr(exact, "x"):
        return exact.climb(mp, mpf(lam), p)
    frame = module.pass1(lam, **launch)
    return exact.climb(mp, mpf(float(frame.x)), mpf(float(frame.z)), p)[0]


def swept(module: ModuleType, call: dict[str, Any], period: float) -> list[str]:
    """Say whether a sweep over launches, of which this is one, gives another period."""
    around = {**call, "lam0": call["lam0"] * np.array([1.0, 1.0 - 1e-9, 1.0 + 1e-6])}
    found = module.sweep("period", **around).values[0]
    return [] if abs(found - period) <= SWEPT * period else [f"swept period {found!r} by {found / period - 1.0:.1e}"]


def resident() -> float:
    """Memory in use, in MB."""
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * 4096 / 2**20


def main(count: int, seed: int) -> int:
    """Run, print the counts, and return 1 if anything failed."""
    draw = random.Random(seed)
    modules = {name: import_module(f"generated.{name}") for name in NAMES}
    kinds, refused, failed = Counter[str](), Counter[str](), Counter[str]()
    start, early = time.monotonic(), 0.0
    for number in range(count):
        name = draw.choice(NAMES)
        call = drawn(modules[name], draw)
        shown = f"{name}.solve({', '.join(f'{key}={value!r}' for key, value in call.items())})"
        try:
            found = faults(modules[name], call, draw, closely=number % CLOSELY == 0)
            kinds["solved"] += 1
        except GQMError as error:
            refused[type(error).__name__] += 1
            found = []
        except Exception as error:
            found = [f"{type(error).__name__}: {error}"]
        for what in found:
            failed[what.split(" by ")[0].split(":")[0]] += 1
            if sum(failed.values()) <= 200:
                print(f"{what}: {shown}", flush=True)
        if number == count // 10:
            early = resident()
    took = time.monotonic() - start
    print(
        f"{count} launches in {took:.0f} s ({count / took:.0f} a second): {kinds['solved']} solved, "
        f"refused {dict(refused)}, failures {dict(failed)}; memory {early:.0f} MB, then {resident():.0f} MB"
    )
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 100_000, int(sys.argv[2]) if len(sys.argv) > 2 else 0))
