"""Branch points of ds are found from its values on a leg, and V**2 is carried from one attempt to the next."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpc, mpf

from gqm_sym.runtime.legs.panels.equation import Forces, W
from gqm_sym.runtime.legs.panels.point import SMOOTH_AT_REST, LawAtRest
from gqm_sym.runtime.legs.panels.polynomials import SHARES, TO_COEFFICIENTS, WIDE
from gqm_sym.runtime.legs.panels.resolution import NOISE_LEVEL
from gqm_sym.runtime.legs.runs.branch_points import BranchPoint, carry_v2, first_guess, zero_of_series
from gqm_sym.runtime.legs.runs.leg_variable import LegVariable, distance_at, unstretched, variable_for
from gqm_sym.runtime.legs.runs.whole_rows import BETWEEN_TURNS, WORK, begin_leg, choose_variable
from gqm_sym.runtime.legs.runs.whole_tables import nodes, phase_nodes

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


NONLINEAR = Forces(0, np.zeros(1), True, False, False, False, 1, 0, 0)
LINEAR = NONLINEAR._replace(linear=True)


def _carried(
    forces: Forces, old: LegVariable, known: int, new: LegVariable, blocks: int, *, in_phase: bool
) -> tuple[bool, Any]:
    """Return whether V**2 = d (2 - d) exp(d/5) is carried to another number of blocks, and its errors there."""
    shares = partial(phase_nodes, 1) if in_phase else nodes

    def v2(variable: LegVariable, blocks: int) -> Any:
        distances = np.array([distance_at(variable, float(y)) for y in shares(blocks)[0]])
        return distances * (2.0 - distances) * np.exp(0.2 * distances)

    work = np.zeros(WORK)
    choose_variable(LawAtRest(0.5, 1, NOISE_LEVEL) if in_phase else SMOOTH_AT_REST, 2.0, work)
    begin_leg(known, work)
    work[known * W : known * (W + WIDE)] = v2(old, known)
    is_known = carry_v2(forces, known, old, blocks, new, BETWEEN_TURNS, work)
    return is_known, work[blocks * W : blocks * (W + WIDE)] - (v2(new, blocks) if is_known else 0.0)


@pytest.mark.parametrize("in_phase", [False, True])
def test_v2_of_the_last_attempt(*, in_phase: bool) -> None:
    """The next attempt begins with V**2 from fewer nodes, or from a variable that is less stretched; otherwise with
    0, or with a parabola if the law contains the speed.
    """
    plain, stretched = unstretched(2.0), variable_for(BranchPoint(0.9, 0.8), (0.0, 0.0), 1, 2.0)
    for old, known, new, blocks in (
        (plain, 1, plain, 2),
        (plain, 1, plain, 3),
        (plain, 2, plain, 3),
        (plain, 1, stretched, 1),
        (stretched, 1, stretched, 3),
    ):
        # In the phase angle more nodes are needed, and some are so near to the end that the rounding of places shows.
        is_known, errors = _carried(NONLINEAR, old, known + in_phase, new, blocks, in_phase=in_phase)
        assert is_known
        assert np.abs(errors).max() <= (2e-12 if in_phase else 1e-14)
    for forces, old, new in ((LINEAR, plain, plain), (NONLINEAR, stretched, plain)):
        is_known, v2 = _carried(forces, old, 1, new, 2, in_phase=in_phase)
        assert not is_known
        assert v2.any() == in_phase
