"""The stretched variable of a leg agrees with sinh in 60 digits."""

from itertools import product as pairs
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

from gqm_sym.runtime.legs.runs.leg_variable import (
    BranchPoint,
    LegVariable,
    distance_at,
    lengthened,
    reversed_variable,
    share_at,
    variable_for,
    width_at,
)

PLACES = [0.0, 1e-9, 0.125, 0.5, 0.75, 1.0]


def _exact(variable: LegVariable, y: float) -> Any:
    """Return the distance at a share and its derivative."""
    t = mpf(variable.extent) * y
    up, down = mpf(variable.rising), mpf(variable.falling)
    slope = mpf(variable.extent) * (up * mp.exp(t) + down * mp.exp(-t))
    return up * mp.expm1(t) - down * mp.expm1(-t), slope


@pytest.mark.parametrize(("place", "height"), [*pairs([-1.2, -0.6, 0.0, 0.7], [0.125, 0.5, 0.9])])
def test_map(place: float, height: float) -> None:
    """Distances, their inverse and the width are those of ``c + b sinh(u)``, to a few roundings."""
    origin, width = (-1.125, 3e-17), 1.75
    variable = variable_for(BranchPoint(place, height), origin, 1, width)
    assert variable.width == width
    with mp.workdps(60):
        c, b = mpf(place) - mpf(origin[0]) - mpf(origin[1]), mpf(height)
        begin, end = mp.asinh(-c / b), mp.asinh((width - c) / b)
        assert variable.extent == pytest.approx(float(end - begin), rel=1e-15)
        assert abs(width_at(*variable[1:]) - _exact(variable, 1.0)[0]) <= 0.51 * np.spacing(width)
        for y in PLACES:
            d = distance_at(variable, y)
            assert d == pytest.approx(float(b * (mp.sinh(begin + (end - begin) * y) + c / b)), rel=1e-15)
            share, slope = share_at(variable, d)
            assert share == pytest.approx(y, rel=1e-15)
            assert slope == pytest.approx(float(_exact(variable, y)[1] / width), rel=2e-15)
            assert distance_at(reversed_variable(variable), 1.0 - y) == pytest.approx(width - d, rel=0.0, abs=2e-15)
        longer = lengthened(variable, 1.0625, 2.5)
        assert longer[1:3] == variable[1:3]
        assert longer.width == pytest.approx(float(_exact(variable, 1.0625)[0]), rel=1e-15)
        assert lengthened(variable, 1.0625, 1.76).width == 1.76


def test_other_legs_are_not_stretched() -> None:
    """A leg is not stretched without a known branch point, beside one that is high above it, or far from one."""
    for branch in (BranchPoint(0.5, 0.0), BranchPoint(0.5, np.inf), BranchPoint(0.5, 1.5), BranchPoint(1.75, 0.5)):
        assert variable_for(branch, (0.0, 0.0), 1, 1.25) == LegVariable(1.25, 0.0, 0.0, 0.0)
