"""Hold every quantity of a sweep against the motions that `solve` finds, for random curves and forces.

``soak_sweeps.py [COUNT] [SEED]``. COUNT modules are drawn: heights and forces are random sums, so that closed forms
meet in combinations that nobody has chosen; a third of the curves are tracks, rails and implicit curves, in a plane and
in space, and curves in space with formulas. Each module is swept over a few launches for each quantity. What differs by
more than roundings, or is refused by one and answered by the other, is printed with its launch.
"""

import math
import random
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import gqm_sym as gqm
from gqm_sym.errors import GQMError
from gqm_sym.runtime.launch import kinds
from gqm_sym.runtime.sweep.quantities import QUANTITIES

LAUNCHES, HORIZON = 6, 5.0
# The relative difference that roundings and conditions of such launches explain, with a least size of 0.01.
TOLERANCE, LEAST_SIZE = 1e-11, 1e-2

EVEN = ("x**2/2", "x**4/5", "cosh(x)", "cosh(2*x)/4", "-cos(x)", "-cos(2*x)/3", "-exp(-x**2)", "sqrt(1+x**2)")
OTHER = ("x/5", "sin(x)/7", "sinh(x)/9", "x**3/11", "tanh(x)/6", "atan(x)/5", "exp(x)/12")
PATHS = (
    ("2*cos(u)", "sin(u)"),
    ("sin(u)", "cos(2*u)/9 - cos(u)"),
    ("sin(2*u)", "-cos(u)"),
    ("u - sin(u)", "-cos(u)"),
    ("3*cos(u) - cos(3*u)/2", "3*sin(u) - sin(3*u)/2"),
    ("u + sin(u)", "-cos(u)"),
    ("sin(u) + u/3", "cosh(u)"),
)
PATHS_IN_SPACE = (
    ("cos(u)", "sin(u)", "u**2/3"),
    ("sin(u)", "u/3", "-cos(u)"),
    ("u", "sin(2*u)/4", "u**2/2"),
    ("2*sin(u)", "cos(u)**2/3", "-cos(u)"),
    ("(2 + cos(3*u))*cos(2*u)", "(2 + cos(3*u))*sin(2*u)", "sin(3*u)"),
    ("u", "u**2/5", "cosh(u)/2"),
)
RADII = ("2 + cos(th)", "1 + cos(2*th)/5", "exp(th/5)", "3/(2 + cos(th))", "2 - sin(3*th)/4")
FIELDS = ("x**2 + z**2 - 1", "x**2/4 + z**2 - 1", "x**4 + z**4 - 1", "x**2/3 + z**2 + x*z/4 - 1", "x**2 - z - 1")
# Families with the range of launches.
FAMILIES: tuple[tuple[Callable[[], Any], float, float], ...] = (
    (lambda: gqm.families.circle(L=1), -1.0, 1.3),
    (lambda: gqm.families.parabola(a="7/10"), -1.2, 1.2),
    (lambda: gqm.families.catenary(c="4/5"), -1.2, 1.2),
    (lambda: gqm.families.cycloid(R=1), -2.5, 2.5),
    (lambda: gqm.families.cycloid(R=1, inverted=True), 0.5, 5.5),
)
POTENTIALS = (
    "9*z + x**2/3",
    "9*z + x**4/8",
    "9*z - cos(x)/2",
    "9*z + cosh(x)/7",
    "5*(x**2 + z**2)",
    "9*z + x/3",
    "4*x**2 + exp(z)",
)


def drawn_rail(draw: random.Random) -> tuple[str, Any, float, float]:
    """Return a rail that begins downwards, with its description and the range of its launches."""
    pieces, said, length, heading = [], [], 0.0, -60
    for _ in range(draw.choice((2, 3, 4))):
        kind, size = draw.choice(("line", "arc", "arc", "clothoid")), draw.choice((4, 7, 11))
        if kind == "line":
            pieces.append(gqm.line(length=f"{size}/5"))
        elif kind == "arc":
            turn = draw.choice((15, 30, 45)) if heading < 30 else -30
            heading += turn
            pieces.append(gqm.arc(radius=f"{size}/6", angle=f"{turn}*pi/180"))
        else:
            pieces.append(gqm.clothoid(length=f"{size}/6", kappa_start="0", kappa_end="1/3"))
        length += size / 5 if kind == "line" else size / 6 * (1 if kind == "clothoid" else abs(turn) * math.pi / 180)
        said.append(f"{kind} {size}")
    return f"rail of {', '.join(said)}", gqm.Curve.piecewise(pieces, heading="-pi/3"), 0.05 * length, 0.95 * length


def drawn_points(draw: random.Random, *, in_space: bool) -> tuple[str, Any, float, float]:
    """Return a track through points of a random valley, with its description and the range of its launches."""
    count, amplitude, phase = draw.randint(7, 25), draw.uniform(0.1, 0.6), draw.uniform(-0.5, 0.5)
    x = np.linspace(-2.0, 2.0, count)
    z = 0.4 * x**2 + amplitude * np.sin(2.0 * x + phase)
    y = draw.uniform(0.2, 0.8) * np.cos(1.3 * x)
    points = np.round(np.column_stack([x, y, z] if in_space else [x, z]), 3)
    kind = "spline" if in_space or draw.random() < 0.7 else "linear"
    length = float(np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1)).sum())
    return f"{kind} track through {points.tolist()}", gqm.Curve.sampled(points, kind=kind), 0.1 * length, 0.9 * length


def drawn_chart(draw: random.Random) -> tuple[str, Any, float, float]:
    """Return a curve whose parameter is arc length, or one in space, with its description and the range of its
    launches.
    """
    which = draw.choice(("rail", "points", "implicit", "points in space", "space", "space"))
    if which == "rail":
        return drawn_rail(draw)
    if which.startswith("points"):
        return drawn_points(draw, in_space=which != "points")
    if which == "implicit":
        field = draw.choice(FIELDS)
        return field, gqm.Curve.implicit(field, start=(0, -1)), -1.5, 1.5
    x, y, z = draw.choice(PATHS_IN_SPACE)
    return f"({x}, {y}, {z})", gqm.Curve.space(x=x, y=y, z=z, parameter="u"), -1.5, 1.2


def drawn_curve(draw: random.Random) -> tuple[str, Any, float, float]:
    """Return a curve with its description and the range of its launches."""
    if draw.random() < 1 / 3:
        return drawn_chart(draw)
    which = draw.random()
    if which < 0.55:
        z = "+".join(draw.sample(EVEN, draw.choice((1, 1, 2))) + draw.sample(OTHER, int(which < 0.2)))
        return z, gqm.Curve.graph(z, parameter="x"), -1.2, 1.2
    if which < 0.7:
        x, z = draw.choice(PATHS)
        return f"({x}, {z})", gqm.Curve.parametric(x=x, z=z, parameter="u"), -2.5, 1.2
    if which < 0.8:
        radius = draw.choice(RADII)
        return f"r = {radius}", gqm.Curve.polar(radius, parameter="th"), -3.0, 1.5
    make, low, high = draw.choice(FAMILIES)
    curve = make()
    return repr(curve), curve, low, high


def drawn_force(draw: random.Random) -> tuple[str, Any, bool]:
    """Return a force with its description, and whether energy is lost."""
    which = draw.random()
    if which < 0.5:
        said, force = ["gravity"], gqm.Gravity()
    elif which < 0.6:
        said, force = ["central force"], gqm.CentralForce(centre=(0, "-1/3"), k=4)
    else:
        said = [draw.choice(POTENTIALS)]
        force = gqm.Potential(said[0])
    added: list[tuple[str, float, Any]] = [
        ("rotating frame", 0.35, gqm.RotatingFrame(Omega=draw.choice(("3/10", "7/10")))),
        ("friction", 0.25, gqm.CoulombFriction(mu=draw.choice(("1/20", "1/20", "2/5")))),
        ("drag", 0.25, gqm.QuadraticDrag(b=draw.choice(("1/20", "1/20", "1")))),
        ("droplet", 0.1, gqm.SurfaceTension(gamma="1/20", ell_c="1/10")),
    ]
    if draw.random() < 0.25:  # a body that rolls does not slide
        added[1] = ("radius", 1.0, gqm.Rolling(radius=draw.choice(("1/20", "1/100")), beta="2/5"))
    for name, share, kernel in added:
        if draw.random() < share:
            said.append(name)
            force += kernel
    return ", ".join(said), force, bool({"friction", "drag", "droplet"}.intersection(said))


def difference(swept: Any, expected: Any) -> float:
    """Return the relative difference; 0 if both have no value."""
    swept, expected = np.atleast_1d(swept), np.atleast_1d(np.asarray(expected, dtype=float))
    same = (swept == expected) | (np.isnan(swept) & np.isnan(expected))
    with np.errstate(invalid="ignore"):
        apart = np.abs(swept - expected) / np.maximum(np.abs(expected), LEAST_SIZE)
    return float(np.where(same, 0.0, np.where(np.isnan(apart), math.inf, apart)).max())


def check(module: ModuleType, places: Any, speeds: Any, direction: int, given: dict[str, Any]) -> list[str]:
    """Return what sweeps and solved motions do not agree in."""
    failures = []
    target = float(np.mean(places))
    for quantity in kinds.QUANTITIES:
        where = {"lam": target} if quantity == "time_at" else {}
        try:
            swept = module.sweep(quantity, places, speeds, direction, **given, **where).values
        except GQMError:  # no launch has this quantity
            swept = np.full(places.size, np.nan)
        for place, speed, value in zip(places.tolist(), speeds.tolist(), swept, strict=True):
            try:
                expected = QUANTITIES[quantity].of_motion(module.solve(place, speed, direction, **given), target)
            except GQMError:
                expected = np.full(np.shape(value), np.nan)
            if difference(value, expected) > TOLERANCE:
                failures.append(f"{quantity} from {place!r} at {speed!r}, {direction}: {value} and {expected}")
    return failures


def main() -> int:
    """Draw modules, and return 1 if a sweep and a motion differ."""
    count, seed = int((sys.argv[1:] or ["100"])[0]), int((sys.argv[2:] or ["0"])[0])
    draw, failed = random.Random(seed), 0
    with tempfile.TemporaryDirectory() as folder:
        for number in range(count):
            try:
                said, curve, low, high = drawn_curve(draw)
            except GQMError as error:
                print(f"refused: {error}", flush=True)
                continue
            laws, force, loses = drawn_force(draw)
            places = np.array([draw.uniform(low, high) for _ in range(LAUNCHES)])
            speeds = np.array([abs(draw.gauss(0.0, 1.0)) * (draw.random() < 0.4) for _ in range(LAUNCHES)])
            horizon = HORIZON if draw.random() < (0.7 if loses else 0.3) else None
            given = {"t_max": horizon, "contact": draw.choice(("bilateral", "bilateral", "above"))}
            try:
                model = gqm.derive(curve, force)
            except GQMError:  # a body with a radius does not roll over a cusp, or along a curve in space
                continue
            module = gqm.build(model, name=f"drawn_{number}", folder=Path(folder))
            failures = check(module, places, speeds, draw.choice((1, -1)), given)
            failed += len(failures)
            for failure in failures:
                print(f"{said} with {laws}, {given}: {failure}", flush=True)
    print(f"{count} modules (seed {seed}): {failed} differences")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
