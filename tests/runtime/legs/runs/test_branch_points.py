"""Branch points of ds are found from its values on a leg."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpc, mpf

from gqm_sym.runtime.legs.panels.polynomials import SHARES, TO_COEFFICIENTS
from gqm_sym.runtime.legs.runs.branch_points import first_guess, zero_of_series

CURVES: list[tuple[Callable[[Any], Any], tuple[float, float], tuple[str, str]]] = [
    (lambda x: 1 + 4 * x * x, (-1.1, 1.0), ("0", "0.5")),
    (lambda x: 1 + (x + mpf(3) / 10 * mp.cos(3 * x)) ** 2, (-1.0, 0.9), ("-0.34", "0.48")),
    (lambda x: 1 + (x + mpf(3) / 10 * mp.cos(3 * x)) ** 2, (0.4, -0.7), ("-0.34", "0.48")),
    (lambda x: 1 + (x / mp.sqrt(1 + x * x) + mp.cos(x) / 5) ** 2, (1.25, -1.5), ("-0.2", "0.7")),
]


@pytest.mark.parametrize(("square", "leg", "near"), CURVES)
def test_branch_points(square: Any, leg: tuple[float, float], near: tuple[str, str]) -> None:
    """The zero of ds**2 that is nearest to a leg is found from values at 23 nodes, within 2 % of its height."""
    middle, half = 0.5 * (leg[0] + leg[1]), 0.5 * (leg[1] - leg[0])
    values = np.array([float(square(mpf(middle + half * (2.0 * y - 1.0)))) for y in SHARES])
    x, y = zero_of_series(TO_COEFFICIENTS @ values, *first_guess(values))
    expected = mp.findroot(square, mpc(*near))
    assert abs(mpc(middle + half * x, abs(half) * y) - mpc(expected.real, abs(expected.imag))) <= 0.02 * abs(
        expected.imag
    )
