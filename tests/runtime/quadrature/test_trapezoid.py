"""The nodes of the trapezoidal rule."""

import numpy as np
from mpmath import mp, mpf

from gqm_sym.runtime.quadrature import trapezoid


def test_nodes_are_correctly_rounded() -> None:
    """The squares of sines and cosines of all phase angles, and of half of them, are the doubles nearest to them."""
    rows = (
        (trapezoid.OFFSETS_FROM_A, lambda share: mp.sin(mp.pi * share / 2)),
        (trapezoid.OFFSETS_TO_B, lambda share: mp.cos(mp.pi * share / 2)),
        (trapezoid.SINES_SQUARED, lambda share: mp.sinpi(share)),
        (trapezoid.COSINES_SQUARED, lambda share: mp.cospi(share)),
    )
    with mp.workdps(60):
        for values, wave in rows:
            truth = [wave(mpf(float(share))) ** 2 for share in trapezoid.NODE_SHARES]
            assert np.array_equal(values, [float(square) if square > mpf(10) ** -100 else 0.0 for square in truth])
