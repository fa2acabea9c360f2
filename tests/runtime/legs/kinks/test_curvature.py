"""The sign of the curvature on a leg is proved where it has one, kinks at the ends apart."""

import numpy as np
import pytest

from gqm_sym.runtime.legs.kinks.curvature import curvature_sign
from gqm_sym.runtime.legs.panels.equation import DS, KAPPA
from gqm_sym.runtime.legs.panels.point import SMOOTH_AT_REST
from gqm_sym.runtime.legs.panels.polynomials import WIDE
from gqm_sym.runtime.legs.runs.whole_rows import WORK, begin_leg, choose_variable
from gqm_sym.runtime.legs.runs.whole_tables import nodes


@pytest.mark.parametrize("blocks", [1, 2])
def test_zeros_inside_and_at_the_ends(blocks: int) -> None:
    """A zero inside shows, one at an end is divided out, and a curvature with a close pole is not resolved."""
    y, work = nodes(blocks)[0], np.zeros(WORK)
    choose_variable(SMOOTH_AT_REST, 0.0, work)
    begin_leg(blocks, work)
    work[blocks * DS : blocks * (DS + WIDE)] = 1.0
    for curvature, kinks, expected in (
        (1.0 + y, (False, False), (True, True)),
        (-1.0 - y, (False, False), (True, True)),
        (y - 0.4, (False, False), (True, False)),
        (y * (2.0 - y), (True, False), (True, True)),
        ((1.0 - y) * np.exp(y), (False, True), (True, True)),
        (y * (1.0 - y), (True, True), (True, True)),
        (y * (0.5 - y), (True, False), (True, False)),
        (1.0 / ((y - 0.5) ** 2 + 1e-6) - 10.0, (False, False), (False, False)),
    ):
        work[blocks * KAPPA : blocks * (KAPPA + WIDE)] = curvature
        with np.errstate(divide="ignore", invalid="ignore"):  # at the end of the leg, which is no node
            resolved, kept, ratio = curvature_sign(False, blocks, kinks, work)
        assert (resolved, kept) == expected
        assert (ratio == 0.0) == resolved
