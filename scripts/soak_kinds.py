"""Hold random motions of many kinds against closed forms: losses, charts, contact, space, gradients, sweeps, threads.

``soak_kinds.py [COUNT] [SEED]``. The closed forms stand here and not in the package; they are evaluated with forty
digits, for the very doubles that the package is given. Places at some times must lie within the bounds that the motion
states, periods within roundings, sweeps must say what solved motions say, next to separatrices too, and six threads
that read one motion must read what one thread reads. What fails is printed with the seed that shows it again, and the
counts: checks, refusals by kind, and the longest call.
"""

import random
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from fractions import Fraction
from itertools import pairwise
from operator import attrgetter, methodcaller
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from mpmath import mp, mpf

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import gqm_sym as gqm
from gqm_sym.errors import GQMError, LaunchError

DIGITS = 40
G = "9.81"
# Times at which a motion is looked at, readers of one motion, and the longest time that a call may take, in s.
TIMES, READERS, MAX_SECONDS = 8, 6, 10.0
# Motions of a kind after which its functions are compiled.
FIRST = 20
# Periods against closed forms, and sweeps against solved motions: relative, per unit of the condition number.
ROUNDINGS = 4.0 * 2.0**-52
POINTS = [("-2", "2"), ("-1", "0"), ("0", "1"), ("2", "0"), ("4", "3")]
SLOPE = [("-4", "-3"), ("-2", "-1.5"), ("0", "0"), ("1.2", "0.9"), ("2.8", "2.1"), ("4", "3")]
PIPE = [gqm.arc(radius="1", angle="pi/2"), gqm.line(length="2"), gqm.arc(radius="1", angle="pi/2")]
PIPE_IN_SPACE = [
    gqm.transition(length="pi/2", pitch="1"),
    gqm.line(length="2"),
    gqm.transition(length="pi/2", pitch="1"),
]
# Derivatives, relative to the largest of them, per unit of the condition number.
SLOPES = 2e-13

Modules = dict[str, ModuleType]
Truth = Callable[[Any], Any]
Kind = Callable[[random.Random, Modules], tuple[list[str], int]]


def build(folder: str | Path) -> Modules:
    """Return the modules of all kinds."""
    gravity, line = gqm.Gravity(), gqm.Curve.graph("a*x", parameter="x")
    level = gqm.Curve.graph("0*x", parameter="x", domain=(None, None))
    planes = gqm.Curve.sampled(POINTS, kind="linear")
    viscous = gqm.Kernel.law("-direction*c*sqrt(W)", parameters={"c": "1"})
    declared = {
        "ramp": (gqm.Curve.graph("a*x", parameter="x", domain=("-1", "1/3")), gravity),
        "rough": (line, gravity + gqm.CoulombFriction()),
        "damped": (level, gravity + gqm.Potential("k*x**2/2") + viscous),
        "circle": (gqm.Curve.parametric(x="sin(u)", z="-cos(u)", parameter="u", period="2*pi"), gravity),
        "planes": (planes, gravity),
        "rough_planes": (planes, gravity + gqm.CoulombFriction()),
        "wells": (gqm.Curve.graph("x**4/4 - x**2/2 + t*x", parameter="x"), gravity),
        "rough_track": (gqm.Curve.sampled(SLOPE), gravity + gqm.CoulombFriction()),
        "rim": (
            gqm.Curve.implicit("x**2 + z**2 - 1", start=(0, -1)),
            gravity + gqm.CoulombFriction() + gqm.QuadraticDrag(),
        ),
        "pipe": (gqm.Curve.piecewise(PIPE, heading="-pi/2"), gravity),
        "pipe_in_space": (gqm.Curve.piecewise(PIPE_IN_SPACE, start=("1", "2", "3"), heading=("1/3", "-pi/2")), gravity),
        "train": (
            gqm.Curve.parametric(x="R*sin(u)", z="-R*cos(u)", parameter="u", period="2*pi", domain=None),
            gravity + gqm.Train(length="ell", cars=3),
        ),
        "coil": (gqm.Curve.space(x="c*u", y="R*sin(u)", z="-R*cos(u)", parameter="u"), gravity),
    }
    return {
        name: gqm.build(gqm.derive(*parts), name=f"soaked_{name}", folder=folder) for name, parts in declared.items()
    }


def log_uniform(draw: random.Random, low: float, high: float) -> float:
    """Return a positive number whose decimal logarithm is evenly distributed."""
    return 10.0 ** draw.uniform(low, high)


def signed(draw: random.Random, low: float, high: float) -> float:
    """Return the same with either sign."""
    return draw.choice((1.0, -1.0)) * log_uniform(draw, low, high)


def outside(motion: Any, truth: Truth, times: list[float]) -> list[str]:
    """Return a message for each time at which the true place lies outside the motion's error bound."""
    found = []
    for t in times:
        error, bound = abs(mpf(float(motion.lam(t))) - truth(mpf(t))), motion.error_bound(t)
        if not error <= bound:
            found.append(f"outside its bound by a factor of {float(error / mpf(bound)) if bound > 0 else bound:.2g}")
    return found


def slides(draw: random.Random, modules: Modules) -> tuple[list[str], int]:
    """Launch along an incline with friction, which is in some cases almost enough to hold the body."""
    a, v0, lam0 = signed(draw, -3.0, 1.0), log_uniform(draw, -6.0, 2.0), draw.uniform(-3.0, 3.0)
    mu, direction = log_uniform(draw, -4.0, 0.0), draw.choice((1, -1))
    if draw.random() < 0.3:
        mu = abs(a) * (1.0 + signed(draw, -12.0, -1.0))
    return slide(modules, {"lam0": lam0, "v0": v0, "direction": direction, "a": a, "mu": mu}, draw), TIMES


def slide(modules: Modules, launch: dict[str, Any], draw: random.Random) -> list[str]:
    """Return the defects of one motion along an incline: constant acceleration up, then down or rest."""
    motion = modules["rough"].solve(**launch)
    lam0, v0, u, a, mu = (mpf(launch[name]) for name in ("lam0", "v0", "direction", "a", "mu"))
    slope = mp.sqrt(1 + a**2)
    pull, drag = -mpf(G) * a / slope, mpf(G) * mu / slope
    onwards = pull - u * drag  # the acceleration along x's sense while it moves in the direction of launch
    turn = -u * v0 / onwards if onwards * u < 0 else mp.inf
    back = 0 if abs(pull) <= drag else pull + u * drag
    reach = float(turn) if turn < mp.inf else float(v0 / abs(onwards)) if onwards else 1.0

    def place(t: Any) -> Any:
        first = min(t, turn)
        gone = u * v0 * first + onwards * first**2 / 2 + (back * (t - turn) ** 2 / 2 if t > turn else 0)
        return lam0 + gone / slope

    end = min(2.5 * reach, motion.t_end)
    return outside(motion, place, [draw.uniform(0.0, end) for _ in range(TIMES)])


def falls(draw: random.Random, modules: Modules) -> tuple[list[str], int]:
    """Launch on an incline with two ends: at the ends, next to them and between, also from places between doubles."""
    a, end = signed(draw, -3.0, 1.0), draw.choice(("-1", "1/3"))
    inwards = Fraction(draw.randint(1, 9), 10 ** draw.randint(1, 15)) * (1 if end == "-1" else -1)
    lam0: str | float = draw.choice((end, str(Fraction(end) + inwards), "1/7", "-1/7", float(Fraction(end) + inwards)))
    if float(Fraction(lam0)) == float(Fraction(end)):
        lam0 = end
    v0 = draw.choice((0.0, log_uniform(draw, -30.0, 1.0)))
    return fall(modules, {"lam0": lam0, "v0": v0, "direction": draw.choice((1, -1)), "a": a}, draw)


def fall(modules: Modules, launch: dict[str, Any], draw: random.Random) -> tuple[list[str], int]:
    """Return the defects of one motion along an incline until it leaves it."""
    exact = Fraction(launch["lam0"])
    lam0, v0, a = mpf(exact.numerator) / exact.denominator, mpf(launch["v0"]), mpf(launch["a"])
    slope, (low, high) = mp.sqrt(1 + a**2), (mpf(-1), mpf(1) / 3)
    pull, u = -mpf(G) * a / slope**2, launch["direction"] * v0 / slope
    heading = mp.sign(u or pull)
    if lam0 == (high if heading > 0 else low):
        try:
            return [f"leaves its end as a {modules['ramp'].solve(**launch).kind}"], 1
        except LaunchError:
            return [], 1
    motion = modules["ramp"].solve(**launch)
    ahead = high if heading > 0 else low
    turns = u * pull < 0 and u**2 < 2 * abs(pull * (ahead - lam0))
    last = low + high - ahead if turns else ahead
    at_last = mp.sign(pull if turns else heading) * mp.sqrt(u**2 + 2 * pull * (last - lam0))
    # Without cancellation, from the speeds at both ends.
    spent = (at_last - u) / pull if turns else 2 * (last - lam0) / (u + at_last)
    found = outside(
        motion, lambda t: lam0 + u * t + pull * t**2 / 2, [draw.uniform(0.0, motion.t_end) for _ in range(TIMES)]
    )
    # The end is known to a rounding of its place.
    if not abs(motion.t_end - spent) <= 16.0 * ROUNDINGS * spent + 2.0**-53 / abs(at_last):
        found.append(f"ends at {motion.t_end!r}, where {float(spent)!r} is true")
    return found, TIMES + 1


def damps(draw: random.Random, modules: Modules) -> tuple[list[str], int]:
    """Check springs with viscous damping, on the level, over many decades of amplitude, speed and damping."""
    lam0, direction = signed(draw, -9.0, 1.0), draw.choice((1, -1))
    k, c = log_uniform(draw, -1.0, 2.0), log_uniform(draw, -3.0, 0.5)
    v0 = 0.0 if draw.random() < 0.5 else log_uniform(draw, -9.0, 1.0) * abs(lam0)
    return damp(modules, {"lam0": lam0, "v0": v0, "direction": direction, "k": k, "c": c}, draw), TIMES


def damp(modules: Modules, launch: dict[str, Any], draw: random.Random, last: float = 30.0) -> list[str]:
    """Return the defects of one motion on a damped spring: two exponentials, or a swing that decays."""
    motion = modules["damped"].solve(**launch)
    place = spring(launch["direction"], *(mpf(launch[name]) for name in ("lam0", "v0", "k", "c")))
    return outside(motion, place, [draw.uniform(0.0, last) for _ in range(TIMES)])


def spring(direction: int, lam0: Any, v0: Any, k: Any, c: Any) -> Truth:
    """Return the place on a damped spring, by time."""
    root = mp.sqrt(mp.mpc(c**2 / 4 - k))
    one, two = -c / 2 + root, -c / 2 - root
    share = (direction * v0 - two * lam0) / (one - two)
    return lambda t: (share * mp.exp(one * t) + (lam0 - share) * mp.exp(two * t)).real


def swings(draw: random.Random, modules: Modules) -> tuple[list[str], int]:
    """Check pendulums that swing or go round, near the separatrix too."""
    lam0 = draw.uniform(-3.0, 3.0)
    top = 2.0 * float(G) * (1.0 + np.cos(lam0))
    near = draw.choice((0.0, signed(draw, -8.0, -0.5), signed(draw, -2.0, 1.0)))
    v0 = float(np.sqrt(max(top * (1.0 + near), 0.0))) if near else 0.0
    motion = modules["circle"].solve(lam0, v0, draw.choice((1, -1)))
    if motion.kind not in ("libration", "circulation"):
        return [], 0
    g = mpf(G)
    m, true = mpf(v0) ** 2 / (4 * g) + mp.sin(mpf(lam0) / 2) ** 2, pendulum_period(mpf(lam0), mpf(v0), g)
    found = []
    if not abs(mpf(motion.period) - true) <= ROUNDINGS * true:
        found.append(f"period off by {float(motion.period / true - 1):.1e}")
    swept = modules["circle"].sweep("period", lam0=[lam0], v0=v0, direction=motion.direction)
    # Doubles know how far it is to the separatrix to a rounding of the energy.
    allowed = 4.0 * ROUNDINGS / float(abs(1 - m))
    if swept.status[0] == 0 and not abs(swept.values[0] / motion.period - 1.0) <= allowed:
        found.append(f"swept period off by {swept.values[0] / motion.period - 1.0:.1e}")
    return found, 2


def bounces(draw: random.Random, modules: Modules) -> tuple[list[str], int]:
    """Launch on stitched planes, with or without friction: the acceleration is constant from corner to corner."""
    rough, direction = draw.random() < 0.5, draw.choice((1, -1))
    mu, v0 = (log_uniform(draw, -3.0, -0.3) if rough else 0.0), draw.choice((0.0, log_uniform(draw, -2.0, 1.0)))
    points = [(mpf(x), mpf(z)) for x, z in POINTS]
    lengths = [mp.hypot(q[0] - p[0], q[1] - p[1]) for p, q in pairwise(points)]
    edges = [sum(lengths[:k], mpf(0)) for k in range(len(points))]
    lam0 = draw.uniform(0.01, 0.99) * float(edges[-1])
    given = {"mu": mu} if rough else {}
    motion = modules["rough_planes" if rough else "planes"].solve(lam0, v0, direction, t_max=6.0, **given)
    marks = _planes((mpf(lam0), mpf(v0), direction), mpf(mu), edges, points)

    def place(t: Any) -> Any:
        begin, lam, u, v, pull = next(mark for mark in reversed(marks) if mark[0] <= t)
        return lam + u * (v * (t - begin)) + pull * (t - begin) ** 2 / 2

    end = min(motion.t_end, float(marks[-1][0]))
    return outside(motion, place, [draw.uniform(0.0, end) for _ in range(TIMES)]), TIMES


def _planes(start: tuple[Any, Any, int], mu: Any, edges: list[Any], points: list[Any]) -> list[tuple[Any, ...]]:
    """Time, place, direction, speed and acceleration from each corner, turn or place of rest on, for six seconds."""
    (lam, v, u), t, marks = start, mpf(0), []
    while t < 6 and len(marks) < 200:
        ahead = lam + u * mpf(10) ** -30
        if not edges[0] < ahead < edges[-1]:
            break
        k = max(k for k in range(len(edges) - 1) if edges[k] <= ahead)
        run, rise = points[k + 1][0] - points[k][0], points[k + 1][1] - points[k][1]
        length = edges[k + 1] - edges[k]
        pull, drag = -mpf(G) * rise / length, mpf(G) * mu * run / length
        if v == 0:
            if abs(pull) <= drag:
                marks.append((t, lam, u, mpf(0), mpf(0)))
                return [*marks, (mpf(6), lam, u, mpf(0), mpf(0))]
            u = 1 if pull > 0 else -1
        onwards = pull - u * drag
        marks.append((t, lam, u, v, onwards))
        edge = edges[k + 1] if u > 0 else edges[k]
        left = v**2 + 2 * onwards * (edge - lam)
        if left > 0:
            after = mp.sqrt(left)
            t, lam, v = t + 2 * abs(edge - lam) / (v + after), edge, after
        else:
            spent = -u * v / onwards
            t, lam, v = t + spent, lam + u * v * spent + onwards * spent**2 / 2, mpf(0)
    return [*marks, (t, lam, u, v, mpf(0))]


def tracks(draw: random.Random, modules: Modules) -> tuple[list[str], int]:
    """Launch with friction along a smooth track through points of an incline."""
    lam0, v0, mu = draw.uniform(0.1, 9.9), log_uniform(draw, -3.0, 1.0), log_uniform(draw, -4.0, 0.0)
    direction = draw.choice((1, -1))
    motion = modules["rough_track"].solve(lam0, v0, direction, mu=mu)
    begin, u, pull, drag = mpf(lam0), direction, -mpf(G) * 3 / 5, mpf(G) * mpf(mu) * 4 / 5
    onwards = pull - u * drag
    turn = -u * mpf(v0) / onwards if onwards * u < 0 else mp.inf
    back = 0 if abs(pull) <= drag else pull + u * drag

    def place(t: Any) -> Any:
        first = min(t, turn)
        gone = u * mpf(v0) * first + onwards * first**2 / 2
        return begin + gone + (back * (t - turn) ** 2 / 2 if t > turn else 0)

    end = min(motion.t_end, 5.0)
    return outside(motion, place, [draw.uniform(0.0, end) for _ in range(TIMES)]), TIMES


def rims(draw: random.Random, modules: Modules) -> tuple[list[str], int]:
    """Launch in a round valley declared as F = 0, on a track that can only push, with friction and drag: turns,
    liftoff, rest.
    """
    lam0, v0 = draw.uniform(-1.5, 1.5), draw.choice((0.0, log_uniform(draw, -3.0, 1.0)))
    mu, b = (draw.choice((0.0, log_uniform(draw, -3.0, -0.3))) for _ in range(2))
    given = {"mu": mu, "b": b, "contact": "above", "t_max": 20.0}
    motion = modules["rim"].solve(lam0, v0, draw.choice((1, -1)), **given)
    found, count, w, at = [], 0, mpf(v0) ** 2, mpf(lam0)
    for leg in [leg for leg in motion.legs if leg.end not in ("horizon", "asymptote") and leg.t_end > 0.0][:6]:
        what, at, resolved = rim_end(w, at, leg, mpf(mu), mpf(mu) + mpf(b))
        # The circle is a chart of doubles, whose radius is 1: its tangent has a rounding of its own everywhere.
        error, bound = abs(mpf(leg.lam_end) - at), motion.error_bound(leg.t_end) + 2.0**-52 + resolved
        count, w = count + 1, mpf(0)
        if leg.end not in what:
            found.append(f"{leg.end} for {what[0]}")
        if not error <= bound:
            found.append(f"{leg.end} outside its bound by a factor of {float(error / bound):.2g}")
        if leg.end != "turn":
            break
    return found, count


def rim_end(w: Any, start: Any, leg: Any, mu: Any, c: Any) -> tuple[tuple[str, ...], Any, float]:
    """Return how and where a leg ends, and to what distance doubles resolve it; V**2 solves a linear equation.

    The bound of a place at a time says nothing of where contact is lost: next to the top the contact force changes so
    slowly that a rounding of its terms moves that place by many roundings.
    """
    g, u = mpf(G), leg.direction
    a = (2 * g - 4 * c * mu * g) / (1 + 4 * c**2)
    b = -2 * u * mu * g - 2 * u * c * a

    def speed(s: Any) -> Any:
        free = w - a * mp.cos(start) - b * mp.sin(start)
        return a * mp.cos(s) + b * mp.sin(s) + free * mp.exp(-2 * u * c * (s - start))

    def load(s: Any) -> Any:
        return speed(s) + g * mp.cos(s)

    def root(function: Callable[[Any], Any]) -> Any:
        return mp.findroot(function, mpf(leg.lam_end))

    if leg.end == "liftoff":
        at = root(load)
        return ("liftoff",), at, float(ROUNDINGS * (speed(at) + g) / abs(mp.diff(load, at)))
    at = root(speed)
    return ("rest",) if abs(mp.sin(at)) <= mu * mp.cos(at) else ("turn",), at, 0.0


def hills(draw: random.Random, modules: Modules) -> tuple[list[str], int]:
    """Launch from beside a hilltop with viscous resistance: the motion is two exponentials, and one of them grows."""
    lam0, direction = signed(draw, -30.0, -1.0), draw.choice((1, -1))
    k, c = -log_uniform(draw, -1.0, 1.5), log_uniform(draw, -3.0, 0.5)
    launch = {"lam0": lam0, "v0": 0.0, "direction": direction, "k": k, "c": c}
    growth = float(np.sqrt(c * c / 4.0 - k) - c / 2.0)
    return damp(modules, launch, draw, float(np.log(1.0 / abs(lam0))) / growth), TIMES


def coils(draw: random.Random, modules: Modules) -> tuple[list[str], int]:
    """Check helices about a level axis, along which a body is a pendulum with a longer path."""
    lam0, radius, pitch = signed(draw, -6.0, 0.45), log_uniform(draw, -1.0, 1.0), log_uniform(draw, -2.0, 1.0)
    motion = modules["coil"].solve(lam0, R=radius, c=pitch)
    rate = mp.sqrt(mpf(G) * mpf(radius) / (mpf(radius) ** 2 + mpf(pitch) ** 2))
    m = mp.sin(mpf(lam0) / 2) ** 2
    found, true = [], 4 * mp.ellipk(m) / rate
    if not abs(mpf(motion.period) - true) <= ROUNDINGS * true:
        found.append(f"period off by {float(motion.period / true - 1):.1e}")

    def place(t: Any) -> Any:
        return 2 * mp.asin(mp.sqrt(m) * mp.ellipfun("cd", rate * t, m=m)) * mp.sign(lam0)

    return found + outside(motion, place, [draw.uniform(0.0, 3.0) * motion.period for _ in range(3)]), 4


def gradients(draw: random.Random, modules: Modules) -> tuple[list[str], int]:
    """Check derivatives of pendulums' periods and actions, solved and swept, and of damped springs' places."""
    lam0, v0, direction = draw.uniform(0.01, 3.0), draw.uniform(0.0, 12.0), draw.choice((1, -1))
    names, found = ("lam0", "v0", "g"), []
    motion = modules["circle"].solve(lam0, v0, direction)
    given = tuple(mpf(value) for value in (lam0, v0, float(G)))
    allowed = SLOPES * motion.condition_number
    for quantity, law in (("period", pendulum_period), ("action", pendulum_action)):
        slopes = list(motion.gradient(quantity, names).values())
        true = [mp.diff(law, given, order) for order in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]
        found += unequal(f"gradient of {quantity}", slopes, true, allowed)
        swept = modules["circle"].sweep(quantity, [lam0], v0, direction, gradient=names)
        found += unequal(f"swept gradient of {quantity}", swept.gradient[0], true, allowed)
    # With weaker damping one leg in some hundreds has nine digits, as its bound says, and its derivatives have none.
    k, c, t = log_uniform(draw, -1.0, 2.0), log_uniform(draw, -1.0, 0.5), draw.uniform(0.0, 10.0)
    damped = modules["damped"].solve(lam0, v0, direction, k=k, c=c)

    def place(*numbers: Any) -> Any:
        return spring(direction, *numbers)(mpf(t))

    numbers = tuple(mpf(value) for value in (lam0, v0, k, c))
    true = [mp.diff(place, numbers, tuple(int(i == j) for j in range(4))) for i in range(4)]
    changes = damped.sensitivity(t, ("lam0", "v0", "k", "c"))
    # Of places that died away roundings of the launch are left.
    size = mp.exp(-numbers[3] * mpf(t) / 4)
    return found + unequal("sensitivity", changes.lam, [*true, size], allowed), 5


def unequal(what: str, slopes: Any, true: Any, allowed: float) -> list[str]:
    """Return a message if derivatives differ from the true ones; more entries of ``true`` count for the scale only."""
    size = max(map(abs, true))
    off = float(max(abs(mpf(float(one)) - other) for one, other in zip(slopes, true, strict=False)) / size)
    return [] if off <= allowed else [f"{what} off by {off:.1e}"]


def pendulum_period(lam0: Any, v0: Any, g: Any) -> Any:
    """Return the period of a pendulum of one metre."""
    m = v0**2 / (4 * g) + mp.sin(lam0 / 2) ** 2
    return 4 * mp.ellipk(m) / mp.sqrt(g) if m < 1 else 2 * mp.ellipk(1 / m) / mp.sqrt(g * m)


def pendulum_action(lam0: Any, v0: Any, g: Any) -> Any:
    """Return the integral of V ds over the period of such a pendulum."""
    m = v0**2 / (4 * g) + mp.sin(lam0 / 2) ** 2
    if m > 1:
        return 8 * mp.sqrt(g * m) * mp.ellipe(1 / m)
    return 16 * mp.sqrt(g) * (mp.ellipe(m) - (1 - m) * mp.ellipk(m))


def sweeps(draw: random.Random, modules: Modules) -> tuple[list[str], int]:
    """Check sweeps against solved motions in two wells, next to the separatrix between them."""
    module, t = modules["wells"], draw.choice((0.0, draw.uniform(-0.3, 0.3)))
    lam0 = draw.uniform(-1.6, 1.6)
    hill = float(np.roots([1.0, 0.0, -1.0, t]).real[np.abs(np.roots([1.0, 0.0, -1.0, t])).argmin()])
    energy = [x**4 / 4 - x**2 / 2 + t * x for x in (hill, lam0)]
    top = 2.0 * float(G) * (energy[0] - energy[1])
    v0 = float(np.sqrt(top * (1.0 + signed(draw, -9.0, -1.0)))) if top > 0.0 else log_uniform(draw, -3.0, 0.5)
    launch = {"lam0": lam0, "v0": v0, "direction": draw.choice((1, -1)), "t": t}
    motion, found, count = module.solve(**launch), [], 0
    if motion.kind != "libration":
        return [], 0
    for quantity in ("half_period", "turning_points", "v_max", "v_min"):
        swept = module.sweep(quantity, **launch)
        solved = getattr(motion, quantity)
        solved = sorted(solved[-2:]) if quantity == "turning_points" else getattr(solved, "value", solved)
        count += 1
        size = 4.0 * ROUNDINGS * motion.condition_number * np.max(np.abs(solved))
        if swept.status != 0 or not np.all(np.abs(swept.values - solved) <= size):
            found.append(f"swept {quantity} {swept.values} for {solved}, status {swept.status}")
    return found, count


def threads(draw: random.Random, modules: Modules) -> tuple[list[str], int]:
    """Many threads read a motion as one does, to the last digit.

    Between they ask for what is made when it is first asked for: events, legs, arrivals, derivatives.
    """
    name = draw.choice(("circle", "damped", "planes", "wells", "rough"))
    given = {"rough": {"a": 0.1, "mu": 0.01}, "damped": {"k": 10.0, "c": 0.1}, "wells": {"t": 0.1}}.get(name, {})
    launch = {"lam0": draw.uniform(0.2, 1.2), "v0": draw.uniform(0.0, 2.0), "direction": draw.choice((1, -1)), **given}
    shared, alone = (modules[name].solve(**launch) for _ in range(2))
    end = min(alone.t_end, 10.0)
    times = [draw.uniform(0.0, end) for _ in range(24)]
    others = (attrgetter("events"), attrgetter("legs"), attrgetter("turning_points"), methodcaller("energy", 0.5))
    others += (methodcaller("sensitivity", 0.5, "lam0"), methodcaller("time_at", float(alone.lam(0.3 * end))))

    def read_between(k: int) -> float:
        if k % 3 == 0:
            with suppress(GQMError):
                others[k // 3 % len(others)](shared)
        return float(shared.state(times[k % len(times)]).lam)

    with ThreadPoolExecutor(READERS) as pool:
        read = np.array(list(pool.map(read_between, range(len(times) * READERS))))
    expected = np.array([float(alone.state(t).lam) for t in times] * READERS)
    return [f"threads read otherwise on {name}"] if np.any(read != expected) else [], 1


def pipes(draw: random.Random, modules: Modules) -> tuple[list[str], int]:
    """Launch from rest in a half pipe of pieces, in a plane and in space: two pendulums and a level line between."""
    name, lam0 = (
        draw.choice(("pipe", "pipe_in_space")),
        draw.choice((draw.uniform(0.0, 1.5), log_uniform(draw, -6.0, 0.0))),
    )
    motion = modules[name].solve(lam0)
    corner = mp.pi / 2
    angle, rate = corner - mpf(lam0), mp.sqrt(mpf(G))
    m = mp.sin(angle / 2) ** 2
    quarter, fastest = mp.ellipk(m) / rate, 2 * rate * mp.sqrt(m)
    half = 2 * quarter + 2 / fastest

    def place(t: Any) -> Any:
        rest = t - 2 * half * mp.floor(t / (2 * half))
        if rest > half:
            return 2 * corner + 2 - place(rest - half)
        if rest < quarter:
            return corner - 2 * mp.asin(mp.sqrt(m) * mp.ellipfun("cd", rate * rest, m=m))
        if rest < half - quarter:
            return corner + fastest * (rest - quarter)
        return corner + 2 + 2 * mp.asin(mp.sqrt(m) * mp.ellipfun("sn", rate * (rest - half + quarter), m=m))

    found = outside(motion, place, [draw.uniform(0.0, 3.0) * motion.period for _ in range(3)])
    swept = modules[name].sweep("half_period", [lam0])
    for what, value in (("half period", motion.half_period), ("swept half period", swept.values[0])):
        if not abs(mpf(float(value)) - half) <= ROUNDINGS * half:
            found.append(f"{what} off by {float(value / half - 1):.1e}")
    return found, 5


def trains(draw: random.Random, modules: Modules) -> tuple[list[str], int]:
    """Check trains on a circle, which are pendulums whose gravity is less by the mean of the cosine over the length."""
    lam0, radius, share = signed(draw, -6.0, 0.45), log_uniform(draw, -1.0, 2.0), log_uniform(draw, -3.0, 0.3)
    size = share * radius
    motion = modules["train"].solve(lam0 * radius, R=radius, ell=size)
    half = mpf(size) / (2 * mpf(radius))
    true = pendulum_period(mpf(lam0 * radius) / mpf(radius), mpf(0), mpf(G) * mp.sin(half) / half / mpf(radius))
    swept = modules["train"].sweep("period", [lam0 * radius], R=radius, ell=size)
    found = []
    for what, value in (("period", motion.period), ("swept period", swept.values[0])):
        # At the lowest place the chart begins and ends: a place is rounded there as the length of a lap is.
        seam = 2.0**-53 * 2.0 * np.pi / abs(lam0)
        if not abs(mpf(float(value)) - true) <= (4.0 * ROUNDINGS * motion.condition_number + seam) * true:
            found.append(f"{what} off by {float(value / true - 1):.1e}")
    return found, 2


KINDS = (slides, falls, damps, swings, bounces, tracks, rims, hills, coils, gradients, sweeps, threads)
# These make many charts: ``make soak`` draws them, and no test.
CHARTED = (pipes, trains)
# Gradients and threads are dear, and told by few.
WEIGHTS = (4, 4, 4, 4, 4, 4, 4, 4, 4, 1, 4, 1, 4, 4)


def soak(
    count: int, seed: int, modules: Modules, kinds: tuple[Kind, ...] = KINDS
) -> tuple[Counter[str], list[str], float]:
    """Draw so many motions, or until it is interrupted; what came of them, what failed, and the longest call in s.

    What fails is printed at once. Times are those of the processor.
    """
    draw, tally, failed, longest = random.Random(seed), Counter[str](), list[str](), 0.0
    with suppress(KeyboardInterrupt):
        for _ in range(count):
            kind, own = draw.choices(kinds, WEIGHTS[: len(kinds)])[0], draw.getrandbits(48)
            begin = time.process_time()
            found = _told(kind, own, modules, tally)
            # The first calls compile.
            longest = max(longest, time.process_time() - begin) if tally[kind.__name__] > FIRST else longest
            shown = [f"{what}: {kind.__name__}(random.Random({own}))" for what in found]
            failed += shown
            if shown:
                print(*shown, sep="\n", flush=True)
    return tally, failed, longest


def _told(kind: Kind, own: int, modules: Modules, tally: Counter[str]) -> list[str]:
    """Return the defects of one motion, and count its outcome."""
    with mp.workdps(DIGITS):
        try:
            found, checks = kind(random.Random(own), modules)
            tally[kind.__name__] += 1
            tally["checks"] += checks
        except GQMError as error:
            found = []
            tally[f"{kind.__name__}: {type(error).__name__}"] += 1
        except Exception as error:
            found = [f"{type(error).__name__}: {error}"]
    return found


def main(count: int, seed: int) -> int:
    """Print what failed and the counts; returns 1 if anything did."""
    with tempfile.TemporaryDirectory() as folder:
        tally, failed, longest = soak(count, seed, build(folder), KINDS + CHARTED)
    if longest > MAX_SECONDS:
        failed.append(f"a call took {longest:.0f} s")
    print(f"{dict(tally)}, {len(failed)} failures, {longest:.1f} s the longest")
    return 1 if failed else 0


if __name__ == "__main__":
    asked = [int(word) for word in sys.argv[1:]]
    sys.exit(main(*(asked + [1000, 0][len(asked) :])))
