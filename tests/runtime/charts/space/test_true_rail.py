"""Half periods on rails in space, in double-double arithmetic, agree with closed forms."""

from pathlib import Path
from typing import Any

import pytest
from mpmath import mp, mpf
from naive import ulps
from railed import built

import gqm_sym as gqm
from gqm_sym.errors import SolutionError

# Half periods in sweeps, in units in the last place.
MAX_ULPS = 2.0
# Digits of a period that double-double arithmetic decides.
KNOWN = 17

COIL = {"pitch": "R/(R**2 + c**2)", "roll": "c/(R**2 + c**2)"}
COILED = {"start": (0, 0, "-R"), "heading": ("atan(R/c)", 0), "parameters": {"R": "2", "c": "3/4"}}
WAVES = {"x": "c*(u - 4)", "y": "R*sin(u - 4)", "z": "-R*cos(u - 4)", "parameter": "u", "domain": (0, 4)}


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    "pieces",
    [
        [gqm.transition(length=60, **COIL)],
        [gqm.Curve.space(**WAVES), gqm.transition(length=30, **COIL)],
    ],
)
def test_half_periods_of_a_coil(tmp_path: Path, pieces: list[Any]) -> None:
    """On a helix about a level axis half periods are correctly rounded (a pendulum's; they were up to 304 units in the
    last place off).

    This holds also many turns from the start, and across the end of a piece with formulas.
    """
    given = COILED if len(pieces) == 1 else {"parameters": COILED["parameters"]}
    module = built(tmp_path, f"coil_of_{len(pieces)}", pieces, **given)
    launches = (13.0, 26.3, 40.0, 41.9, 55.5) if len(pieces) == 1 else (6.3, 8.55, 8.6, 10.2)
    swept = module.sweep("half_period", launches).values
    with mp.workdps(40):
        rate = mp.sqrt(mpf(4) + mpf(9) / 16)
        for launch, value in zip(launches, swept, strict=True):
            angle = mpf(launch) / rate - (4 if len(pieces) == 2 else 0)
            angle -= 2 * mp.pi * mp.nint(angle / (2 * mp.pi))
            truth = 2 * mp.ellipk(mp.sin(angle / 2) ** 2) * rate / mp.sqrt(2 * mpf("9.81"))
            motion = module.solve(launch)
            assert motion.half_period == float(truth)
            assert motion.period_to(KNOWN) == mp.nstr(2 * truth, KNOWN, strip_zeros=False)
            with pytest.raises(SolutionError, match=r"the period is known to \d+ digits; ask for no more"):
                motion.period_to(40)
            assert ulps(value, truth) <= MAX_ULPS
