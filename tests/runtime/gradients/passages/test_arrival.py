"""First times at places beside a hilltop that a body passes slowly, or turns at, change as integrals in mpmath do."""

from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from orbits import by_differences
from paths import ROOT
from quadrature import integral

from gqm_sym.loading import load

ULP = 2.0**-52


def first_time(x0: float, place: float) -> Any:
    """Return the first time at a place of z = h (x**4 - 2 x**2), as a function of the launch, which is to the right.

    By the outer turning point b the body goes with ``x = b - u**2``; the divided difference of z cancels nothing.
    """

    def time(at: dict[str, Any]) -> list[Any]:
        h, g, lam0 = at["h"], at["g"], at["lam0"]
        height = at["v0"] ** 2 / (2 * g) + h * lam0**2 * (lam0**2 - 2)

        def slope(x: Any) -> Any:
            return mp.sqrt(1 + (4 * h * x * (x * x - 1)) ** 2)

        if place > x0:

            def direct(x: Any) -> Any:
                return slope(x) / mp.sqrt(2 * g * (height - h * x * x * (x * x - 2)))

            return [integral(direct, [lam0, place], 5)]
        end = mp.sqrt(1 + mp.sqrt(1 + height / h))

        def by_end(u: Any) -> Any:
            x = end - u * u
            return 2 * slope(x) / mp.sqrt(2 * g * h * (end + x) * (end * end + x * x - 2))

        return [sum(integral(by_end, [0, mp.sqrt(end - x)], 5) for x in (lam0, mpf(place)))]

    return time


LAUNCHES = [(0.75, 1.1), (1.2, 0.8)]


@pytest.mark.parametrize("height", [1e-3, 1e-6, 1e-10, -1e-4, -1e-7, -1e-11])
def test_beside_a_hilltop(height: float) -> None:
    """Above and below the top of the barrier, derivatives of times on one side of it are within 32 units in the last
    place, of times of the order of 1 that change by about as much.

    Launches below 1e-4 had none, or, turning beside the hilltop, lost up to ten digits.
    """
    module = load(str(ROOT / "generated" / "double_well.py"), "double_well")
    for lam0, place in LAUNCHES:
        speed = float(np.sqrt(2 * 9.81 * (height - 0.25 * lam0**2 * (lam0**2 - 2))))
        launch = {"lam0": lam0, "v0": speed, "h": 0.25, "g": 9.81}
        found = module.solve(**launch).gradient("time_at", tuple(launch), lam=place)
        for name, value in found.items():
            with mp.workdps(40):
                wanted = by_differences(first_time(lam0, place), launch, name, 15)[0]
            scale = max(abs(wanted), 0.3 / launch[name])
            assert abs(value - wanted) <= 32 * ULP * scale, (name, lam0)
