"""Arc lengths keep their digits next to turning points, where they grow with the square of the phase angle."""

import numpy as np
import pytest
from mpmath import mp, mpf

from gqm_sym.runtime.arithmetic.clenshaw import growth_beside_rest
from gqm_sym.runtime.arithmetic.doubledouble import ULP
from gqm_sym.runtime.quadrature.lengths import lengths_from_edges

# The terms of a series with this ratio that vanishes with its slope at -1: its second polynomial is chosen so.
RATIO = 6.0


def series() -> list[mpf]:
    """Return the coefficients of a series whose slope at -1 is zero."""
    terms = [mpf((-RATIO) ** -k) for k in range(24)]
    terms[1] = -mp.fsum(terms[k] * (-1) ** (k + 1) * mpf(k * (k + 1)) / 2 for k in range(2, 24))
    return terms


@pytest.mark.parametrize("heading", [1.0, -1.0])
@pytest.mark.parametrize("distance", [1e-12, 1e-7, 1e-3, 0.03])
def test_a_series_beside_an_end_without_slope(distance: float, heading: float) -> None:
    """The growth of a series from -1, or that of its mirror image from 1, keeps its digits however near the place is,
    although its coefficients are rounded.
    """
    with mp.workdps(60):
        terms = series()
        truth = mp.fsum(c * (mp.legendre(k, mpf(distance) - 1) - (-1) ** k) for k, c in enumerate(terms))
        rounded = np.array([float(c) * heading**k for k, c in enumerate(terms)])
    found = growth_beside_rest(rounded, distance, heading)
    assert abs(found / truth - 1) <= 8 * ULP


def test_lengths_beside_both_ends() -> None:
    """Along 1 - cos(phi) on two panels the length from the first edge is 2 sin(phi/2)**2, and from the last one as
    small as that.
    """
    edges, marks = np.array([0.0, 0.5 * np.pi, np.pi]), np.array([0.0, 1.0, 2.0])
    half, terms = mp.pi / 4, np.empty((2, 22))
    for k in range(22):
        size = (2 * k + 1) * mp.sqrt(mp.pi / (2 * half)) * mp.besselj(k + mpf(1) / 2, half)
        for panel in range(2):
            terms[panel, k] = -size * mp.cos((2 * panel + 1) * half + k * mp.pi / 2)
    terms[0, 0] += 1.0
    small = np.array([1e-9, 1e-5, 0.02])
    from_start = lengths_from_edges(edges, marks, terms, (True, True), small, np.pi - small)
    to_end = lengths_from_edges(edges, marks, terms, (True, True), np.pi - small, small)
    wanted = 2.0 * np.sin(0.5 * small) ** 2
    np.testing.assert_array_equal([from_start[0], to_end[0]], [np.zeros(3), np.full(3, 2.0)])
    np.testing.assert_allclose([from_start[1], -to_end[1]], [wanted, wanted], rtol=1e-13, atol=0.0)
