"""V**2 behind a block of short gaps with friction in space, and the time over it, agree with solutions of the law in 20
digits.
"""

from functools import cache
from typing import Any

import numba
import numpy as np
import pytest
from friction_in_space import panel, solution

from gqm_sym.runtime.legs.gaps import octaves
from gqm_sym.runtime.legs.gaps.data import BLOCK, FILLED, FIRST_OF_BLOCK, FIRST_OF_FEW, GAP_COLUMNS
from gqm_sym.runtime.legs.panels.few_nodes import keep_few

ULP, WIDTH = 2.0**-52, 2.0**-6


@numba.njit
def kept(direction: int, work: Any, gaps: Any, at: int) -> bool:
    """Keep a gap."""
    return keep_few(WIDTH, direction, work, gaps, at + FIRST_OF_FEW)


@numba.njit
def passed(v2: float, direction: int, gaps: Any, first: int) -> Any:
    """Return the time over a block, V**2 at its end, and bounds of V**2."""
    time, end, bounds, _ = octaves.pass_by_octave(v2, direction, gaps, first)
    return time, end, bounds.least_v2, bounds.most_v2


@cache
def block(direction: int) -> tuple[np.ndarray, int]:
    """Return the data kept of a block, and where those of its first gap begin."""
    gaps, first = np.zeros(4 * BLOCK * GAP_COLUMNS), 0 if direction > 0 else 4 * (BLOCK - 1) * GAP_COLUMNS
    for k in range(BLOCK):
        assert kept(direction, panel(WIDTH, direction, k), gaps, first + 4 * direction * k * GAP_COLUMNS)
    gaps[first + FIRST_OF_BLOCK] = FILLED
    return gaps, first


@pytest.mark.sample(3)
@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("v2", [4.0, 7.9375, 40.0, 1000.0])
def test_a_block(direction: int, v2: float) -> None:
    """The rounding errors are those of the result, also at the ends of an octave."""
    time, end, low, high = passed(v2, direction, *block(direction))
    true_end, true_time = solution(BLOCK * WIDTH, direction, v2, 20)
    assert abs(end - true_end) <= 2 * ULP * max(v2, end)
    assert abs(time - true_time) <= 2 * ULP * true_time
    assert low <= min(v2, true_end) <= max(v2, true_end) <= high


def test_slow_bodies_are_not_passed() -> None:
    """On the octave on which some bodies turn, or lose most of their V**2, none is passed."""
    assert np.isnan([passed(v2, -1, *block(-1))[0] for v2 in (0.01, 0.3, 0.5)]).all()


def test_a_line_taken_over_by_another_octave() -> None:
    """What is kept of an octave does not depend on what was there before."""
    gaps, first = block(1)
    begin, further = passed(20.0, 1, gaps, first), 20.0 * 2.0 ** (BLOCK * octaves.OCTAVES_OF_GAP)
    assert passed(further, 1, gaps, first)[1] != begin[1]
    assert passed(20.0, 1, gaps, first) == begin
