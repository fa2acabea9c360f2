"""Small swings that one call of compiled code follows turn where a closed form says."""

from pathlib import Path

import pytest
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym.runtime.legs.frames import swings

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
