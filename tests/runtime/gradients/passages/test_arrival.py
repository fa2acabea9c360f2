"""First times at places beside a hilltop that a body passes slowly, or turns at, change as integrals in mpmath do."""

from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from orbits import by_differences
from paths import ROOT
from quadrature import integral

from gqm_sym.loading import load
from gqm_sym.runtime.sweep.quantities import ROUTES

ULP = 2.0**-52


def first_time(place: float, *, turns: bool) -> Any:
    """Return the first time at a place of z = h (x**4 - 2 x**2), as a function of the launch.

    If the body turns on its way, it does so at the outer turning point b. With ``x = b - u**2`` the divided difference
    of z cancels nothing.
    """

    def time(at: dict[str, Any]) -> list[Any]:
        h, g, lam0 = at["h"], at["g"], at["lam0"]
        height = at["v0"] ** 2 / (2 * g) + h * lam0**2 * (lam0**2 - 2)

        def slope(x: Any) -> Any:
            return mp.sqrt(1 + (4 * h * x * (x * x - 1)) ** 2)

        if not turns:

            def direct(x: Any) -> Any:
                return slope(x) / mp.sqrt(2 * g * (height - h * x * x * (x * x - 2)))

            return [integral(direct, sorted([lam0, mpf(place)]), 5)]
        end = mp.sqrt(1 + mp.sqrt(1 + height / h))

        def by_end(u: Any) -> Any:
            x = end - u * u
            return 2 * slope(x) / mp.sqrt(2 * g * h * (end + x) * (end * end + x * x - 2))

        return [sum(integral(by_end, [0, mp.sqrt(end - x)], 5) for x in (lam0, mpf(place)))]

    return time


LAUNCHES = [(0.75, 1.1, 1), (1.2, 0.8, 1), (1.1, 0.7, -1)]


@pytest.mark.sample(1)
@pytest.mark.parametrize("height", [1e-3, 1e-6, 1e-10, -1e-4, -1e-7, -1e-11])
def test_beside_a_hilltop(height: float) -> None:
    """Above and below the top of the barrier, derivatives of times on one side of it are within 32 units in the last
    place, of times of the order of 1 that change by about as much; in sweeps too, without solving launches.

    Launches above by less than 1e-4 had none, or, turning beside the hilltop, lost up to ten digits.
    """
    module = load(str(ROOT / "generated" / "double_well.py"), "double_well")
    lam0, places, directions = (np.array(column) for column in zip(*LAUNCHES, strict=True))
    speeds = np.sqrt(2 * 9.81 * (height - 0.25 * lam0**2 * (lam0**2 - 2)))
    names = ("lam0", "v0", "h", "g")
    swept = module.sweep("time_at", lam0, speeds, directions, lam=places, h=0.25, g=9.81, gradient=names)
    assert not (swept.route == ROUTES.index("solve")).any()
    for place, direction, *launch, row in zip(places, directions, lam0, speeds, swept.gradient, strict=True):
        at = dict(zip(names, (*map(float, launch), 0.25, 9.81), strict=True))
        found = module.solve(**at, direction=int(direction)).gradient("time_at", names, lam=float(place))
        for name, by_sweep in zip(names, row, strict=True):
            with mp.workdps(40):
                wanted = by_differences(first_time(place, turns=direction * (place - launch[0]) < 0), at, name, 15)[0]
            allowed = 32 * ULP * max(abs(wanted), 0.3 / at[name])
            assert abs(found[name] - wanted) <= allowed, (name, place)
            assert abs(by_sweep - wanted) <= allowed, (name, place)


def times_from_inner_turn(place: float, *, turns: bool) -> Any:
    """Return the first time at a place of z = h (x**4 - 2 x**2), as a function of a launch towards the hilltop.

    The body does not pass it; with ``x = a cosh(u)`` its inner turning point a is no branch point.
    """

    def time(at: dict[str, Any]) -> list[Any]:
        h, g, lam0 = at["h"], at["g"], at["lam0"]
        level = at["v0"] ** 2 / (2 * g * h) + lam0**2 * (lam0**2 - 2)
        outer = 1 + mp.sqrt(1 + level)
        inner = mp.sqrt(-level / outer)

        def by_inner(u: Any) -> Any:
            x = inner * mp.cosh(u)
            return mp.sqrt((1 + (4 * h * x * (x * x - 1)) ** 2) / (2 * g * h * (outer - x * x)))

        there, here = (mp.acosh(x / inner) for x in (mpf(place), lam0))
        edges = [0, there / 2, there, 0, here / 2, here] if turns else [there, (there + here) / 2, here]
        return [sum(integral(by_inner, edges[k : k + 3], 5) for k in range(0, len(edges), 3))]

    return time


@pytest.mark.parametrize(
    ("launch", "place"),
    [
        ({"lam0": 0.566442954500135, "v0": 2.123534481164705, "h": 0.428055616650783, "g": 9.81}, 0.606328913907087),
        ({"lam0": 0.944374969813870, "v0": 1.695410665139764, "h": 0.161369383183444, "g": 9.012}, 0.178074611408902),
    ],
)
def test_towards_a_hilltop(launch: dict[str, float], place: float) -> None:
    """Swept derivatives are within 32 units in the last place where the end of the orbit lies beside that of the next
    well, and Gauss's rule converges slowly.

    They were off by some thousand units, because the rule was taken to converge faster than it does.
    """
    module, names = load(str(ROOT / "generated" / "double_well.py"), "double_well"), tuple(launch)
    swept = module.sweep("time_at", **launch, direction=-1, lam=place, gradient=names)
    assert swept.route != ROUTES.index("solve")
    for name, value in zip(names, np.ravel(swept.gradient), strict=True):
        with mp.workdps(40):
            wanted = by_differences(times_from_inner_turn(place, turns=place > launch["lam0"]), launch, name, 15)[0]
        assert abs(value - wanted) <= 32 * ULP * max(abs(wanted), 0.3 / launch[name]), name


def test_past_a_hilltop() -> None:
    """One derivative of the time to the other side is within 4 units in the last place, however slowly a body passes.

    It lost a digit for each digit by which the speed there is smaller. The truth is an integral over u, with
    ``x = c sinh(u)`` and the width c of the slow passage.
    """
    module, place, excess = load(str(ROOT / "generated" / "double_well.py"), "double_well"), mpf(-0.5), 1e-8

    def time(at: dict[str, Any]) -> list[Any]:
        h, g, lam0, width = at["h"], at["g"], at["lam0"], mp.sqrt(excess) / 2
        height = at["v0"] ** 2 / (2 * g) + h * lam0**2 * (lam0**2 - 2)

        def by_stretched(u: Any) -> Any:
            x = width * mp.sinh(u)
            speed = mp.sqrt(2 * g * (height - h * x * x * (x * x - 2)))
            return width * mp.cosh(u) * mp.sqrt(1 + (4 * h * x * (x * x - 1)) ** 2) / speed

        return [integral(by_stretched, mp.linspace(mp.asinh(place / width), mp.asinh(lam0 / width), 25), 4)]

    launch = {"lam0": 0.75, "v0": float(np.sqrt(2 * (9.8125 * 0.25 * 0.75**2 * (2 - 0.75**2) + excess)))}
    launch |= {"h": 0.25, "g": 9.8125}
    found = module.solve(**launch, direction=-1).gradient("time_at", ("v0", "h"), lam=float(place))
    for name, value in found.items():
        with mp.workdps(40):
            wanted = by_differences(time, launch, name, 18)[0]
        assert abs(value - wanted) <= 4 * ULP * abs(wanted), name
