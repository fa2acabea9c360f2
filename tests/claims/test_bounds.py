"""Bounds hold near separatrices, where a turning point is known to fewer digits than a double has.

The true time of flight to a place is computed by Gauss-Legendre rules with forty digits. The motion is asked for its
place at that time, which must be the true one within the bound that it states.
"""

import random
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from mpmath import mp, mpf

import gqm_sym as gqm

G = mpf("9.81")
# Places are tested at these shares of the phase angle from the launch to the turning point.
SHARES = (0.003, 0.05, 0.3, 0.7, 0.95, 1.0)

# A row has the curve, the force, the effective potential, ds/dlam, and the top of the barrier.
WELLS: dict[str, tuple[Any, Any, Callable[[Any], Any], Callable[[Any], Any], float]] = {
    "potential": (
        gqm.Curve.graph("u**2/2", parameter="u"),
        gqm.Potential("x**4 - x**2 + z"),
        lambda u: u**4 - u**2 / 2,
        lambda u: mp.sqrt(1 + u**2),
        0.5**0.5,
    ),
    "double well": (
        gqm.Curve.graph("(x**2 - 1)**2", parameter="x"),
        gqm.Gravity(),
        lambda x: G * (x**2 - 1) ** 2,
        lambda x: mp.sqrt(1 + (4 * x * (x**2 - 1)) ** 2),
        2.0**0.5,
    ),
    "pendulum": (
        gqm.Curve.parametric(x="sin(a)", z="-cos(a)", parameter="a", period="2*pi"),
        gqm.Gravity(),
        lambda a: -G * mp.cos(a),
        lambda a: mpf(1),
        3.14159265,
    ),
}


def drawn(count: int) -> list[tuple[str, str, str, int]]:
    """Draw launches from rest and with speed that nearly reach a barrier."""
    draw, out = random.Random(19), []
    while len(out) < count:
        name = draw.choice(list(WELLS))
        _, _, potential, _, top = WELLS[name]
        gap = 10.0 ** -draw.uniform(0.5, 4.0)
        if len(out) % 2:
            out.append((name, f"{top * (1.0 - gap / 3.0):.9f}", "0", 1))
            continue
        place = draw.uniform(0.2, 0.9) * top
        height = float(potential(mpf(0 if name != "pendulum" else top)) - potential(mpf(place)))
        if height > 0.0:
            out.append((name, f"{place:.6f}", f"{(2.0 * height * (1.0 - gap)) ** 0.5:.9f}", draw.choice((1, -1))))
    return out


NAMED = [("potential", "707/1000", "0", 1), ("double well", "1.4141", "0", 1), ("pendulum", "3.1", "0", 1)]


@pytest.fixture(scope="module")
def wells(tmp_path_factory: pytest.TempPathFactory) -> dict[str, ModuleType]:
    """Return the module of each well."""
    folder: Path = tmp_path_factory.mktemp("wells")
    return {
        name: gqm.build(gqm.derive(curve, force), name=name.replace(" ", "_"), folder=folder)
        for name, (curve, force, *_) in WELLS.items()
    }


@pytest.mark.sample(1)
@pytest.mark.parametrize(("name", "lam0", "v0", "direction"), [*NAMED, *drawn(15)])
def test_places_lie_within_their_bounds(
    name: str, lam0: str, v0: str, direction: int, wells: dict[str, ModuleType]
) -> None:
    """Places up to the turning point lie within their bounds, and the bounds are no larger than necessary."""
    _, _, potential, ds, _ = WELLS[name]
    motion = wells[name].solve(lam0, v0, direction)
    assert motion.kind == "libration"
    with mp.workdps(40):
        start = motion.problem.launch.lam0.at(mp)
        energy = mpf(v0) ** 2 / 2 + potential(start)
        w = lambda place: 2 * (energy - potential(place))  # noqa: E731
        with mp.workdps(60):
            turns = sorted(motion.turning_points)
            a, b = (mp.findroot(w, mpf(turn) + mpf(10) ** -30, tol=0, verify=False) for turn in turns)
        if v0 == "0":
            a, b = (start, b) if abs(start - a) < abs(start - b) else (a, start)

        def rate(phi: Any) -> Any:
            left, right = mp.sin(phi / 2) ** 2, mp.cos(phi / 2) ** 2
            return ds(a + (b - a) * left) * (b - a) * mp.sqrt(left * right / w(a + (b - a) * left))

        knots = [mp.pi * mpf(2) ** -k for k in range(8, 0, -1)]
        knots += [mp.pi - knot for knot in knots[-2::-1]]
        begin, end = 2 * mp.atan2(mp.sqrt(start - a), mp.sqrt(b - start)), mp.pi if motion.direction > 0 else mpf(0)
        time, passed = mpf(0), begin
        for share in SHARES:
            phi = begin + (end - begin) * share
            low, high = sorted((passed, phi))
            edges = [low, *(knot for knot in knots if low < knot < high), high]
            time += sum(mp.quad(rate, pair, method="gauss-legendre") for pair in pairwise(edges))
            passed = phi
            exactly = mp.nstr(time, 35)
            error = abs(mpf(motion.lam(exactly)) - (a + (b - a) * mp.sin(phi / 2) ** 2))
            bound = motion.error_bound(exactly)
            assert error <= 0.6 * bound, (share, float(error), bound)
            assert bound <= 300 * 2.2e-16 * motion.condition_number * max(1, float(b - a))
