#!/usr/bin/env python3
"""Time what users do, on every kind of curve with every kind of force: one core, compiled beforehand.

    python benchmarks/matrix.py                                   the whole table
    python benchmarks/matrix.py --curve circle --force drag       some cells
    python benchmarks/matrix.py --variant 7                       the same curves and forces with other numbers

Each figure is the least processor time of several calls, in microseconds: of a launch (``one``, ``legs``, the sweeps)
or of a time (``state``, ``lam``). A percentage after it is the share of launches without an answer; ``solved``
is the share of launches of a sweep that no compiled loop answered. ``call`` is what a sweep of a single launch takes,
that is, the fixed cost of a call. Goals are for a machine on which the reference work (SciPy's ``quad``, 21 evaluations
in Python) takes 5.5 us, and scale with what it takes in this run. A figure over 1.5 times its goal is marked ``!``; so
is a cell that raises. The exit code is 1 if any is.
"""

import argparse
import math
import os
import sys
import tempfile
import time
from collections.abc import Callable

os.environ.setdefault("NUMBA_NUM_THREADS", "1")

import numpy as np
from scipy.integrate import quad

import gqm_sym as gqm
from gqm_sym.runtime.sweep.quantities import ROUTES

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--curve", default="")
parser.add_argument("--force", default="")
parser.add_argument("--variant", type=int, default=0, help="seed of other numbers; 0: as written below")
parser.add_argument("--seconds", type=float, default=1.5, help="about how long a figure is timed")
args = parser.parse_args()
rng = np.random.default_rng(args.variant)


def num(value: float) -> str:
    """Return a constant: as written, or up to 10 % off in a variant."""
    return repr(round(value * (1 + (0.1 * rng.uniform(-1, 1) if args.variant else 0.0)), 6))


def survey() -> np.ndarray:
    """Return points of a sampled track."""
    x = np.linspace(-2, 2, 201)
    return np.column_stack([x, float(num(0.5)) * x * x + float(num(0.01)) * np.cos(3 * x)])


def half_pipe() -> gqm.Curve:
    """Return a rail of lines and arcs."""
    line, arc = gqm.line, gqm.arc
    pieces = [
        line(length="1"),
        arc(radius="3", angle="pi/2"),
        line(length=num(4)),
        arc(radius="3", angle="pi/2"),
        line(length="1"),
    ]
    return gqm.Curve.piecewise(pieces, start=("-5", "4"), heading="-pi/2")


# name: (what makes the curve, launches from rest lie between these, class of goals)
CURVES = {
    "circle": (lambda: gqm.families.circle(L=num(1)), 0.2, 1.4, "symmetric"),
    "ellipse": (
        lambda: gqm.Curve.parametric(x=f"{num(2)}*cos(u)", z=f"{num(1)}*sin(u)", parameter="u", period="2*pi"),
        -1.2,
        -0.3,
        "symmetric",
    ),
    "parabola": (lambda: gqm.families.parabola(a=num(1)), 0.2, 1.2, "symmetric"),
    "catenary": (lambda: gqm.families.catenary(c=num(1)), 0.2, 1.2, "symmetric"),
    "cycloid": (lambda: gqm.families.cycloid(R=num(1), inverted=True), 3.4, 5.5, "symmetric"),
    "limacon": (
        lambda: gqm.Curve.polar(f"{num(2)}+{num(1)}*cos(th)", parameter="th", period="2*pi"),
        -1.2,
        -0.3,
        "formula",
    ),
    "lissajous": (
        lambda: gqm.Curve.parametric(x="sin(2*t)", z=f"-cos(3*t)/2-{num(1)}*cos(t)", parameter="t", period="2*pi"),
        0.1,
        0.4,
        "formula",
    ),
    "graph": (lambda: gqm.Curve.graph(f"x**2/{num(2)}+sin(3*x)/{num(10)}", parameter="x"), 0.3, 1.2, "formula"),
    "implicit": (lambda: gqm.Curve.implicit(f"x**4+z**4-{num(1)}*x*z/5-1", start=(0, -1)), 0.3, 1.0, "chart"),
    "sampled": (lambda: gqm.Curve.sampled(survey()), 3.3, 4.8, "chart"),
    "rail": (half_pipe, 0.3, 2.5, "chart"),
}
# name: (what makes the force, its parameters, whether energy is lost)
FORCES = {
    "gravity": (lambda: gqm.Gravity(), {}, False),
    "rolling radius": (lambda: gqm.Gravity() + gqm.Rolling(radius="rho"), {"beta": 0.4, "rho": 0.05}, False),
    "rotating": (lambda: gqm.Gravity() + gqm.RotatingFrame(), {"Omega": 0.7}, False),
    "potential": (lambda: gqm.Potential("G*z+x**4/8"), {"G": 9.81}, False),
    "coulomb": (lambda: gqm.Gravity() + gqm.CoulombFriction(), {"mu": 0.05}, True),
    "drag": (lambda: gqm.Gravity() + gqm.QuadraticDrag(b="c_d"), {"c_d": 0.05}, True),
    "coulomb+drag": (
        lambda: gqm.Gravity() + gqm.CoulombFriction() + gqm.QuadraticDrag(b="c_d"),
        {"mu": 0.05, "c_d": 0.05},
        True,
    ),
    "droplet": (lambda: gqm.Gravity() + gqm.SurfaceTension(), {"gamma": 0.05, "ell_c": 0.1}, True),
}
HORIZON = 10.0  # s, where energy is lost
# microseconds for the classes symmetric, formula, chart; "sweep" of motion with losses is per leg, 10 s of it
GOALS = {
    "one": (20, 40, 150),
    "legs": (40, 50, 100),
    "state": (6, 6, 8),
    "lam": (0.01, 0.01, 0.02),
    "call": (100, 100, 150),
    "half_period": (0.1, 1.2, 5),
    "normal_force_max": (2.5, 3, 8),
    "time_at": (2.5, 3, 10),
    "t_end": (2, 2.5, 5),
    "liftoff": (3, 4, 10),
}
CLASSES = ("symmetric", "formula", "chart")
# A function is compiled in the third launch that uses it.
CALLS_BEFORE = 4


def best(call: Callable[[], object], seconds: float = args.seconds) -> float:
    """Least processor time of a call, in microseconds, after the calls that get its functions compiled."""
    for _ in range(CALLS_BEFORE):
        call()
    start, least, count = time.perf_counter(), math.inf, 0
    while count < 3 or (time.perf_counter() - start < seconds / 3 and count < 500):
        begin = time.process_time()
        call()
        least = min(least, time.process_time() - begin)
        count += 1
        if time.perf_counter() - start > 3 * seconds:
            break
    return least * 1e6


def reference() -> float:
    """Time of the reference work."""
    k = math.sin(0.6) ** 2

    def work() -> float:
        return quad(lambda p: 1 / math.sqrt(1 - k * math.sin(p) ** 2), 0, math.pi / 2, epsabs=0, epsrel=1e-13)[0]

    return min(best(work) for _ in range(3))


SCALE = max(reference() / 5.5, 0.5)
SOLVED = ROUTES.index("solve")
over: list[str] = []


def shown(cell: str, what: str, kind: str, micro: float, share: float = 0.0, legs: float = 1.0) -> str:
    """Text of a figure, marked where it is over its goal."""
    goal = GOALS[what][CLASSES.index(kind)] * SCALE * legs
    bad = not micro <= 1.5 * goal
    if bad:
        over.append(f"{cell}: {what} {micro:.3g}, goal {goal:.3g}")
    return f"{what} {micro:.3g}" + (f" ({share:.0%} none)" if share else "") + ("!" if bad else "")


def swept(module, quantity: str, lam0: np.ndarray, **given) -> tuple[float, float, float, int]:
    """Microseconds a launch, shares without an answer and solved one by one, launches: as many as the time allows."""
    many = lam0[[0, len(lam0) // 2, -1]]
    each = best(lambda: module.sweep(quantity, many, 0.0, **given), 0.2) / 3
    if each < 0.1 * args.seconds * 1e6:
        step = max(1, math.ceil(each * len(lam0) / (args.seconds * 1e6)))
        many = lam0[::step]
    found = module.sweep(quantity, many, 0.0, **given)
    return (
        best(lambda: module.sweep(quantity, many, 0.0, **given)) / len(many),
        float(np.isnan(found.values).mean()),
        float((found.route == SOLVED).mean()),
        len(many),
    )


def cell(curve: str, force: str) -> str:
    """Measure one curve with one force."""
    make, low, high, kind = CURVES[curve]
    law, parameters, loses = FORCES[force]
    name = f"{curve} / {force}"
    begin = time.perf_counter()
    module = gqm.build(gqm.derive(make(), law()), name="cell_" + "".join(c if c.isalnum() else "_" for c in name))
    said = [f"build {time.perf_counter() - begin:.1f} s"]
    given = {**parameters, **({"t_max": HORIZON} if loses else {})}
    launches = np.linspace(low, high, 20_000)
    middle = 0.5 * (low + high)
    if module.solve(middle, 0.0, 1, **given).kind not in ("libration", "dissipative"):
        return f"{said[0]}  no body that is released here comes back"
    next_launch = iter(np.random.default_rng(1).uniform(low, high, 100_000).tolist())

    def fresh():
        motion = module.solve(next(next_launch), 0.0, 1, **given)
        return motion.legs if loses else motion.half_period

    said.append(shown(name, "legs" if loses else "one", kind, best(fresh)))
    motion = module.solve(middle, 0.0, 1, **given)
    until = min(HORIZON, motion.t_end) * 0.999
    times = np.random.default_rng(0).uniform(0, until, 10_000)
    said.append(shown(name, "state", kind, best(lambda: motion.state(0.4 * until))))
    said.append(shown(name, "lam", kind, best(lambda: motion.lam(times)) / len(times)))
    first = "t_end" if loses else "half_period"
    said.append(shown(name, "call", kind, best(lambda: module.sweep(first, launches[:1], 0.0, **given))))
    legs = 1.0
    if loses:
        legs = float(np.mean([len(module.solve(x, 0.0, 1, **given).legs) for x in launches[::2000].tolist()]))
        said.append(f"{legs:.1f} legs")
    first_legs = [module.solve(x, 0.0, 1, **given).legs[:1] for x in launches[::2000].tolist()]
    spans = [sorted((float(leg.lam_start), float(leg.lam_end))) for legs_of_one in first_legs for leg in legs_of_one]
    crossed = 0.5 * (max(span[0] for span in spans) + min(span[1] for span in spans))
    for quantity in (first, "normal_force_max", "time_at"):
        extra = {"lam": crossed} if quantity == "time_at" else {}
        micro, share, slow, count = swept(module, quantity, launches, **extra, **given)
        said.append(shown(name, quantity, kind, micro, share, legs if quantity != "time_at" else 1.0))
        said[-1] += (f" ({slow:.1%} solved)" if slow else "") + ("" if count == len(launches) else f" [{count}]")
    if force in ("gravity", "coulomb") and kind != "symmetric":
        micro, share, slow, _ = swept(module, "t_end", launches, contact="above", **{**given, "t_max": 5.0})
        said.append(
            shown(name, "liftoff", kind, micro, share, max(1.0, legs)) + (f" ({slow:.1%} solved)" if slow else "")
        )
    return "  ".join(said)


def main() -> int:
    """Measure all cells that were asked for."""
    os.chdir(tempfile.mkdtemp())
    print(f"reference work {SCALE * 5.5:.1f} us; goals scaled by {SCALE:.2f}; microseconds", flush=True)
    for curve in CURVES:
        for force in FORCES:
            if args.curve in curve and args.force in force:
                try:
                    line = cell(curve, force)
                except Exception as error:
                    line = f"{type(error).__name__}: {str(error)[:120]} !"
                    over.append(f"{curve} / {force}: {type(error).__name__}")
                print(f"{curve:10s} {force:14s} {line}", flush=True)
    print(f"\n{len(over)} figures over 1.5 times their goal" + "".join(f"\n  {row}" for row in over))
    return 1 if over else 0


if __name__ == "__main__":
    sys.exit(main())
