"""Small swings that one call of compiled code follows turn where a closed form says."""

from math import log1p
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym.runtime.legs.frames import entering, swings
from gqm_sym.runtime.legs.frames.fitting import frame_near

# The relative tolerance of distances of turns, which are read off places. Worst of 299 turns: 1.9e-14.
ENDS_OF_SWINGS = 4e-14


def test_many_swings_in_one_call(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Swings on a cycloid, followed many at a time, turn where the closed form of its law says; the bits are those of
    swings followed one at a time.
    """
    curve = gqm.Curve.parametric(x="t - 1 + sin(t - 1)", z="-cos(t - 1)", parameter="t", domain=(-1.5, 3.5))
    model = gqm.derive(curve, gqm.Gravity() + gqm.QuadraticDrag(b="c"))
    module = gqm.build(model, name="many_swings", folder=tmp_path)
    together = module.solve("3/2", c=0.25, t_max=600.0).legs
    monkeypatch.setattr(swings, "SWINGS_PER_CALL", 1)
    assert module.solve("3/2", c=0.25, t_max=600.0).legs == together
    assert len(together) == 300
    with mp.workdps(30):
        # With the arc length s from the bottom d(W)/ds = -s g/2 - 2 c W, so that (1 + q) exp(-q) is the same for the
        # turns q = 2 c s of a swing, one of which is negative.
        turn = 2 * mpf(0.25) * 4 * mp.sin(mpf(1) / 4)
        for leg in together[:-1]:
            kept, guess = (1 + turn) * mp.exp(-turn), turn - 2 * turn**2 / 3
            turn = mp.findroot(lambda q, kept=kept: (1 - q) * mp.exp(q) - kept, guess)
            truth = 2 * mp.asin(turn / (8 * mpf(0.25)))
            assert abs(abs(mpf(leg.lam_end) - 1) / truth - 1) <= ENDS_OF_SWINGS


@pytest.mark.extended
def test_swings_that_are_too_wide_for_a_frame(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Through points of a cycloid, swings wider than the pieces next to the bottom are followed by places, without an
    attempt to fit the force there after each of them; they turn as on the cycloid, but for the error of the spline.
    """
    attempts = []

    def counted(*arguments: Any) -> Any:
        attempts.append(frame_near(*arguments))
        return attempts[-1]

    monkeypatch.setattr(entering, "frame_near", counted)
    t = np.linspace(-2.5, 2.5, 201)
    model = gqm.derive(
        gqm.Curve.sampled(np.column_stack([t + np.sin(t), -np.cos(t)])), gqm.Gravity() + gqm.QuadraticDrag(b="c")
    )
    module = gqm.build(model, name="cycloid_points", folder=tmp_path)
    bottom, drag = 4.0 * np.sin(1.25), 0.1
    legs = module.solve(bottom + 1.0, c=drag, t_max=600.0).legs
    assert len(legs) > 150
    assert len(attempts) < 0.2 * len(legs)
    for leg in legs[:-1]:
        # See the test above; s is the arc length from the bottom.
        before, turn = (2.0 * drag * abs(place - bottom) for place in (leg.lam_start, leg.lam_end))
        lost = (log1p(before) - before) - (log1p(-turn) + turn)
        assert abs(lost) <= 1e-8 * before**2
