"""Times over gaps between breaks of the curve, and over blocks of them, by data that are kept."""

from pathlib import Path

import numba
import numpy as np
import pytest
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym.runtime.legs.gaps.data import (
    FACTORS,
    FILLED,
    LARGEST_REST,
    MAX_SHARE,
    MIDDLE_GAINED,
    MOMENTS,
    MOST_DAMPING,
    MOST_N0,
    POWERS,
    to_time_coefficients,
)
from gqm_sym.runtime.legs.gaps.passing import pass_by_powers
from gqm_sym.runtime.model import CompiledModel

PIECES, LENGTH = 60, 6.0


@numba.njit
def pass_with_moments(v2: float, work: np.ndarray, gaps: np.ndarray) -> tuple[float, float]:
    """Return the time over a gap, and V**2 at its end, for these integrals of powers of H."""
    to_time_coefficients(work, MOMENTS, gaps, FACTORS)
    return pass_by_powers(v2, 1, gaps, 0)[:2]


@pytest.mark.parametrize("share", [0.0, 1e-9, 0.01, 0.1, 0.2, 0.29, MAX_SHARE])
def test_the_polynomial_is_as_accurate_as_the_series(share: float) -> None:
    """V**2 that grows evenly, with H from -share to share and u = 1, over a distance of 1."""
    work, gaps = np.zeros(MOMENTS + POWERS), np.zeros(64)
    work[MOMENTS : MOMENTS + POWERS : 2] = 1.0 / np.arange(1, POWERS + 1, 2)
    gaps[[0, MIDDLE_GAINED, LARGEST_REST, MOST_DAMPING, MOST_N0 - 1, MOST_N0]] = FILLED, 0.5, share, 1.0, 1.0, 1.0
    with mp.workdps(40):
        true = (mp.sqrt(1 + mpf(share)) - mp.sqrt(1 - mpf(share))) / share if share else mpf(1)
    time, end = pass_with_moments(0.5, work, gaps)
    assert end == 0.5
    np.testing.assert_allclose(time, float(true), rtol=3e-16)


@pytest.fixture(scope="module")
def plane(tmp_path_factory: pytest.TempPathFactory) -> CompiledModel:
    """An inclined plane that is put together from short lines."""
    lines = [gqm.line(length=str(LENGTH / PIECES))] * PIECES
    curve = gqm.Curve.piecewise(lines, start=("0", "0"), heading="-pi/6")
    model = gqm.derive(curve, gqm.Gravity() + gqm.CoulombFriction() + gqm.QuadraticDrag(b="c"))
    return gqm.build(model, name="plane", folder=Path(tmp_path_factory.mktemp("plane")))


@pytest.mark.extended
@pytest.mark.parametrize("down", [True, False])
def test_times_on_an_inclined_plane(plane: CompiledModel, *, down: bool) -> None:
    """The force is ``a - c V**2`` downhill and ``-a - c V**2`` uphill, for which time has a closed form."""
    g, mu, c, start, end = mpf("9.81"), mpf("0.1"), mpf("0.07"), mpf("0.13"), mpf("5.77")
    speeds = np.linspace(0.5, 12.0, 24) if down else np.linspace(11.0, 20.0, 24)
    lam0, lam = (start, end) if down else (end, start)
    with mp.workdps(40):
        share = mp.mpf(1) / 2 + (-mu if down else mu) * mp.sqrt(3) / 2
        a, root = g * share, mp.sqrt(g * share * c)
        true = []
        for speed in speeds.tolist():
            fast = mp.exp(-2 * c * (end - start))
            if down:
                last = mp.sqrt(a / c + (mpf(speed) ** 2 - a / c) * fast)
                grown = (mp.log(abs((root / c + v) / (root / c - v))) for v in (last, mpf(speed)))
                true.append((next(grown) - next(grown)) / (2 * root))
            else:
                last = mp.sqrt(-a / c + (mpf(speed) ** 2 + a / c) * fast)
                true.append((mp.atan(speed * c / root) - mp.atan(last * c / root)) / root)
    given = {"lam": float(lam), "direction": 1 if down else -1, "g": 9.81, "mu": 0.1, "c": 0.07}
    swept = plane.sweep("time_at", float(lam0), speeds, **given)
    np.testing.assert_allclose(swept.values, list(map(float, true)), rtol=1e-15)
