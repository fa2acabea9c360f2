"""First times at places are answered in batches, by series of the orbits' own numbers of terms."""

from collections.abc import Callable
from types import ModuleType

import numpy as np
from mpmath import mp, mpf

ModuleOf = Callable[[str], ModuleType]

# The largest error of a time in units in the last place of it, or of the half period if that is longer.
MAX_ERROR = 4.0


def true_arrival(lam0: float, v0: float, direction: int, place: float) -> tuple[mpf, mpf]:
    """Return the first time at a place of a pendulum with L = 1 m, by elliptic integrals, and its half period."""
    with mp.workdps(40):
        g = mpf("9.81")
        m = mp.sin(mpf(lam0) / 2) ** 2 + mpf(v0) ** 2 / (4 * g)
        start, stop = (
            mp.ellipf(mp.asin(mp.sin(mpf(x) / 2) / mp.sqrt(m)), m) if v0 or x != lam0 else mp.sign(x) * mp.ellipk(m)
            for x in (lam0, place)
        )
        onwards = direction * (stop - start) > 0
        time = abs(stop - start) if onwards else 2 * mp.ellipk(m) - direction * (start + stop)
        return time / mp.sqrt(g), 2 * mp.ellipk(m) / mp.sqrt(g)


def test_pendulum(module_of: ModuleOf) -> None:
    """A pendulum is at a place at the time that elliptic integrals give, towards the place and
    after a turn.
    """
    rng = np.random.default_rng(6)
    reach, share, direction = rng.uniform(0.01, 2.2, 40), rng.uniform(-0.9, 0.9, 40), rng.choice((-1, 1), 40)
    lam0, place = share * reach, rng.uniform(-0.95, 0.95, 40) * reach
    v0 = np.sqrt(2 * 9.81 * (np.cos(lam0) - np.cos(reach)))
    lam0[:10], v0[:10], direction[:10] = reach[:10], 0.0, -1
    swept = module_of("circle").sweep("time_at", lam0, v0, direction, lam=place, L=1)
    assert swept.route_counts() == {"batch": 40}
    for value, *launch in zip(swept.values, lam0, v0, direction, place, strict=True):
        truth, half_period = true_arrival(*map(float, launch[:2]), int(launch[2]), float(launch[3]))
        assert abs(mpf(float(value)) - truth) <= MAX_ERROR * np.spacing(float(max(half_period, truth)))


def test_places_beyond_the_turning_points(module_of: ModuleOf) -> None:
    """A body is never at a place beyond its turning points, and at its launch place at once."""
    swept = module_of("circle").sweep("time_at", 1.0, 0.0, lam=[1.5, -1.5, 1.0, -0.5], L=1)
    assert np.isnan(swept.values).tolist() == [True, True, False, False]
    assert swept.values[2] == 0.0
    assert swept.status_counts() == {"the motion is never at the place asked for": 2}
