"""Solve random launches of the committed modules and hold each motion to its laws.

``soak.py [COUNT] [SEED] [MODULE ...]``; all modules if none is named.

Launch, speed, direction and parameters are drawn at random. A solve may be refused by a GQMError (a launch outside the
domain, for one); a motion that is given must start as launched, keep its energy, its order and its error bounds.
Doubles tell that: heights are subtracted, which is another way than the motion's own. One motion in
five hundred is looked at closely: energy with forty digits, the exact period and turning points, more places and over a
second period, and now and then a sweep over launches around it, which must give the same period. What fails is printed
as the call that shows it again.

Modules whose motions often take extended precision are drawn less often, and most motions with losses end after ten
seconds. Progress is printed on the way, with memory after a tenth of the run and now.
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

from gqm_sym.errors import GQMError, InputError  # noqa: E402
from gqm_sym.runtime.launch.speed import path_and_force_at, potential_at  # noqa: E402

NAMES = sorted(path.stem for path in (ROOT / "generated").glob("*.py"))
# Of the largest V**2 on the way, and of a place of the curve: many roundings, and far above those of a right motion.
ENERGY = 1e-11
# The same where speeds are read off panels that extended precision laid.
PACED = 1e-9
# Periods of a sweep against those of the motions, relative: four units in the last place.
SWEPT = 4.0 * 2.0**-52
# One motion in so many is looked at closely, and of these one in so many is compared with a sweep.
CLOSELY, SWEEPS = 500, 8
# Heights by doubles, and those of charts, as a share of the largest of them.
ROUNDED = 1e-14
# A share of V**2 that doubles must tell.
LEFT = 1e-8
# Places and times against bounds that the motion states: a factor for what is not bounded, the formulas' rounding.
SLACK = 4.0
PLACE = 1e-12
# Times at which a motion is looked at: closely, and otherwise.
COLUMN, FEW = 12, 4
# Seconds after which a motion that does not repeat is not looked at.
LONG = 10.0
# Share of the motions with losses that end then.
SHORTENED = 0.998
# Drawn once where others are drawn so many times.
DEAR = 64
OFTEN_EXACT = {
    "circle_droplet",
    "circle_rotating",
    "circle_spring",
    "cycloid_inverted",
    "double_well",
    "loop",
    "parabola_law",
    "spiral_central",
    "superellipse",
}
# Launches from one line of progress to the next.
PROGRESS = 5_000


def drawn(module: ModuleType, draw: random.Random) -> dict[str, Any]:
    """Return a launch and parameters, of many sizes."""
    values: dict[str, Any] = {}
    for name, default in module.PARAMETERS.items():
        value = 1.0 if default is None else float(quotient(default))
        values[name] = value * math.exp(draw.gauss(0.0, 0.5)) if draw.random() < 0.5 else value
    lam0 = draw.choice(
        (draw.uniform(-1.5, 1.5), draw.gauss(0.0, 3.0), draw.choice((0.0, 1.0, -1.0)), 10.0 ** -draw.uniform(0, 9))
    )
    v0 = draw.choice((0.0, 0.0, draw.uniform(0, 5), math.exp(draw.gauss(0, 2)), 10.0 ** -draw.uniform(0, 12)))
    horizon = {"t_max": LONG} if module.MODEL.dissipation is not None and draw.random() < SHORTENED else {}
    return {"lam0": lam0, "v0": v0, "direction": draw.choice((1, -1)), **horizon, **values}


def quotient(text: str) -> float:
    """Return the value of a default, which may be a quotient."""
    top, _, bottom = text.partition("/")
    return float(top) / float(bottom or 1)


def faults(module: ModuleType, call: dict[str, Any], draw: random.Random, closely: bool) -> list[str]:
    """Say which laws a motion breaks; nothing where it keeps them all."""
    motion = module.solve(**call)
    found = []
    repeats = motion.kind in ("libration", "circulation")
    legs = motion.legs
    first = legs[-1].t_end if repeats else lasting(motion, LONG)
    span = motion.period if closely and repeats else first
    if not span > 0.0:
        return [] if motion.kind in ("rest", "equilibrium") or span == 0.0 else [f"span {span}"]
    count = COLUMN if closely else FEW
    t = np.array([0.0, *sorted(draw.uniform(0.0, 1.0) * span for _ in range(count))])
    state = motion.state(t)
    lam, v, v2, error = (np.asarray(row, dtype=float) for row in (state.lam, state.v, state.v2, state.error))
    if not all(np.isfinite(row).all() for row in (lam, state.x, state.z, v, v2, error)):
        return ["not finite"]
    if lam[0] != call["lam0"] or v2[0] != call["v0"] * call["v0"] or not np.all(error >= 0.0):
        found.append("not as launched")
    if motion.kind == "rest":
        return found if np.all(lam == call["lam0"]) and not np.any(v) else [*found, "moves at rest"]
    if any(not one.t_start <= one.t_end <= two.t_start <= two.t_end for one, two in pairwise(legs)):
        found.append("legs out of order")
    if any(abs(one.lam_end - two.lam_start) > PLACE * abs(one.lam_end) for one, two in pairwise(legs)):
        found.append("legs apart")
    # Near a place of rest a place's last bit is much of V**2, and of the way there.
    bit = np.maximum(2.0 * np.spacing(np.abs(lam)), error)
    most = max(call["v0"] ** 2, float(np.max(v2)))
    launch = {name: value for name, value in call.items() if name != "t_max"} | {"direction": legs[0].direction}
    told, unsure = speed_squared(module, motion, lam, bit, launch, closely, most)
    held = t <= t[-1]
    if module.MODEL.dissipation is not None:
        # With losses V**2 depends on the way: pass 1 tells that of the first leg, if places in doubles tell it apart.
        held = (t <= legs[0].t_end) & (abs(legs[0].lam_end - legs[0].lam_start) > SLACK * bit)
    share = PACED if any(timed.segment.from_multiprecision for timed in motion._trajectory(0.0).segments) else ENERGY
    if not np.all((np.abs(v2 - told) <= share * most + unsure)[held]):
        told, unsure = speed_squared(module, motion, lam, bit, launch, True, most)  # heights may cancel in themselves
    off = np.abs(v2 - told)[held]
    if not np.all(off <= (share * most + unsure)[held]):
        found.append(f"energy by {np.max(off) / most:.1e}")
    size = max(1e-300, float(np.max(np.abs(lam))), abs(call["lam0"]))
    ends = sorted(motion.turning_points if closely else [end for leg in legs for end in (leg.lam_start, leg.lam_end)])
    if motion.kind == "libration":
        over = max(ends[0] - lam.min(), lam.max() - ends[-1])
        if over > PLACE * size:
            found.append(f"beyond a turning point by {over:.1e}")
    for leg in legs:
        inside = (t > leg.t_start) & (t < leg.t_end)
        if np.any(-leg.direction * np.diff(lam[inside]) > PLACE * size):
            found.append("not monotone on a leg")
        if np.any(leg.direction * v[inside] < 0.0):
            found.append("runs against its leg")
    functions = motion.problem.functions
    ds = path_and_force_at(functions.addresses, functions.p, lam, v2)[2]
    if closely and motion.kind == "libration":
        if module.MODEL.dissipation is None and draw.random() < 1.0 / SWEEPS:
            found += swept(module, call, motion.period)
        again = np.asarray(motion.lam(t + span))
        allowed = SLACK * (error + np.asarray(motion.error_bound(t + span))) + PLACE * size
        rate = np.abs(v) * np.spacing(span) / np.maximum(ds, 1e-300)
        if np.any(np.abs(again - lam) > allowed + SLACK * rate):
            found.append(f"not periodic by {np.max(np.abs(again - lam)):.1e}, bound {np.max(error):.1e}")
    middle = 1 + count // 2
    late = SLACK * max(bit[middle], error[middle]) * ds[middle] / max(abs(v[middle]), 1e-300)
    passed = float(motion.time_at(float(lam[middle])))
    if not passed <= t[middle] + 1e-9 * span + late:
        found.append(f"first passage late by {passed - t[middle]:.1e}")
    return found


def lasting(motion: Any, reach: float) -> float:
    """Return the duration of a motion, at most ``reach``; one that leads to the centre of a spiral finds that out on
    the way.
    """
    if motion.t_end > reach:
        try:
            motion.lam(reach)
        except InputError:
            if motion.t_end > reach:
                raise
    return min(motion.t_end, reach)


def speed_squared(
    module: ModuleType, motion: Any, lam: Any, bit: Any, launch: dict[str, Any], closely: bool, most: float
) -> tuple[Any, Any]:
    """V**2 at places by another way than the motion's, and what roundings, those of the places among them, do to it.

    Heights are subtracted: in doubles, or with forty digits, if ``closely`` or where doubles leave little of ``most``.
    With losses there are none, and pass 1 of the first leg is asked.
    """
    if module.MODEL.dissipation is not None:
        told, *beside = module.pass1(np.array([lam, lam - bit, lam + bit]), **launch).v2
        return told, sum(np.nan_to_num(np.abs(other - told)) for other in beside)  # off the leg there is none
    functions, lam0 = motion.problem.functions, launch["lam0"]
    around = np.array([lam0 - 1.0, lam0 + 1.0, lam0, *lam])
    heights, slopes = 2.0 * potential_at(functions.addresses, functions.p, around)
    moved, rounding = 2.0 * bit * np.abs(slopes[3:]), ROUNDED * np.nanmax(np.abs(heights))
    if module.MODEL.exact is None or not (closely or rounding > LEFT * most):
        return launch["v0"] ** 2 + (heights[2] - heights[3:]), moved + rounding
    told, rounding = exactly(module, lam, launch)
    return told, moved + rounding


def exactly(module: ModuleType, lam: Any, launch: dict[str, Any]) -> tuple[Any, float]:
    """Return V**2 at places from exact heights, and the rounding of a chart."""
    with mp.workdps(40):
        p = tuple(mpf(launch[name]) for name in module.PARAMETERS)
        start, *heights = (lost(module, float(place), launch, p) for place in (launch["lam0"], *lam))
        size = 0.0 if hasattr(module.MODEL.exact, "x") else ROUNDED * float(max(map(abs, heights)))
        return np.array([float(mpf(launch["v0"]) ** 2 + start - height) for height in heights]), size


def lost(module: ModuleType, lam: float, launch: dict[str, Any], p: tuple[Any, ...]) -> Any:
    """Return the loss of V**2 on the way to a place, up to a constant; on charts it follows from the coordinates."""
    exact = module.MODEL.exact
    if hasattr(exact, "x"):
        return 2 * exact.effective_potential(mp, mpf(lam), p)
    frame = module.pass1(lam, **launch)
    return 2 * exact.effective_potential(mp, mpf(float(frame.x)), mpf(float(frame.z)), p)[0]


def swept(module: ModuleType, call: dict[str, Any], period: float) -> list[str]:
    """Say whether a sweep over launches, of which this is one, gives another period."""
    around = {**call, "lam0": call["lam0"] * np.array([1.0, 1.0 - 1e-9, 1.0 + 1e-6])}
    found = module.sweep("period", **around).values[0]
    return [] if abs(found - period) <= SWEPT * period else [f"swept period {found!r} by {found / period - 1.0:.1e}"]


def resident() -> float:
    """Memory in use, in MB."""
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * 4096 / 2**20


def main(count: int, seed: int, names: list[str]) -> int:
    """Run over some of the modules, print the counts, and return 1 if anything failed."""
    draw = random.Random(seed)
    modules = {name: import_module(f"generated.{name}") for name in names}
    weights = [1.0 / DEAR if name in OFTEN_EXACT else 1.0 for name in names]
    drawn_of, looked, refused, failed = Counter[str](), Counter[str](), Counter[str](), Counter[str]()
    begin, early = time.process_time(), 0.0

    def summary(number: int) -> str:
        took, (name, least) = time.process_time() - begin, drawn_of.most_common()[-1]
        return (
            f"{number} launches in {took:.0f} s of processor time ({number / took:.0f} a second), {least} or more of "
            f"each module ({name}): {looked['solved']} solved, {looked['closely']} looked at closely, "
            f"refused {dict(refused)}, failures {dict(failed)}; memory {early:.0f} MB, then {resident():.0f} MB"
        )

    for number in range(1, count + 1):
        name = draw.choices(names, weights)[0]
        drawn_of[name] += 1
        closely = drawn_of[name] % CLOSELY == 1
        call = drawn(modules[name], draw)
        shown = f"{name}.solve({', '.join(f'{key}={value!r}' for key, value in call.items())})"
        try:
            found = faults(modules[name], call, draw, closely)
            looked["solved"] += 1
            looked["closely"] += closely
        except GQMError as error:
            refused[type(error).__name__] += 1
            found = []
        except Exception as error:
            found = [f"{type(error).__name__}: {error}"]
        for what in found:
            failed[what.split(" by ")[0].split(":")[0]] += 1
            if sum(failed.values()) <= 200:
                print(f"{what}: {shown}", flush=True)
        if number == max(count // 10, 1):
            early = resident()
        if number % PROGRESS == 0 and number < count:
            print(summary(number), flush=True)
    print(summary(count))
    return 1 if failed else 0


if __name__ == "__main__":
    asked = sys.argv[1:]
    sys.exit(main(int(asked[0]) if asked else 100_000, int(asked[1]) if len(asked) > 1 else 0, asked[2:] or NAMES))
