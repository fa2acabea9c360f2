"""Speeds at the bottom of flat wells, in which the terms of the potential cancel, against 40-digit truth."""

from pathlib import Path
from types import ModuleType

import mpmath
import numpy as np
import pytest
from mpmath import mpf

import gqm_sym as gqm

# Launches from rest in the potential cos x + x**2/2, which is x**4/24 to first order beside its minimum.
PLACES = (1.3, 0.193, -0.1, 0.009)


@pytest.fixture(scope="module")
def flat(generated_folder: Path) -> ModuleType:
    """A body on a straight line in that potential."""
    line = gqm.Curve.parametric(x="x", z="0", parameter="x")
    return gqm.build(gqm.derive(line, gqm.Potential("cos(x)+x**2/2")), name="flat_bottom", folder=generated_folder)


def largest_speed(place: float) -> float:
    """Return the speed at the minimum after a launch from rest, rounded from 40 digits."""
    with mpmath.workdps(40):
        return float(mpmath.sqrt(2 * (mpmath.cos(mpf(place)) + mpf(place) ** 2 / 2 - 1)))


def test_largest_speed_in_a_flat_well(flat: ModuleType) -> None:
    """The speed at its bottom was off by 1e-11 at 0.009, 3e-13 at 0.1, alone and in sweeps."""
    truth = [largest_speed(place) for place in PLACES]
    alone = [flat.solve(place, 0, 1).v_max for place in PLACES]
    np.testing.assert_allclose([found.value for found in alone], truth, rtol=2.3e-15)
    np.testing.assert_allclose(flat.sweep("v_max", PLACES, 0.0).values, truth, rtol=2.3e-15)
    assert abs(alone[-1].lam) < 1e-5 * PLACES[-1]


def test_a_well_too_flat_for_a_search(flat: ModuleType) -> None:
    """Where steps are as short as the well is flat, the launch is refused for this; it was said to go on for ever."""
    with pytest.raises(gqm.errors.SolutionError, match=r"turning points from x = 0\.005: too many places"):
        flat.solve(0.005, 0, 1)
