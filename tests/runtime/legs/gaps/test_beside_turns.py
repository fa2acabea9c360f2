"""Times on gaps next to a turn, from the rows kept of them, compared with integrals."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

from gqm_sym.runtime.legs.gaps.beside_turns import keep_series, time_near_turn, time_to_turn
from gqm_sym.runtime.legs.panels.equation import DS, EXPM1_Q, FORCE, MEAN, N0, NODES
from gqm_sym.runtime.legs.panels.polynomials import COUNT, ENDS_BY_NODE

WIDTH = 0.75
ROOM = 30 * 24


def loss(y: Any) -> Any:
    """Return E."""
    return (y + y * y / 3) / 20


def ds(y: Any) -> Any:
    """Return ds per unit of the place."""
    return 1 + y / 5 - y * y / 9


def rows(damped: Callable[[Any], Any]) -> Any:
    """Return the rows of a panel on which W (1 + E) is a function of the share of the panel."""
    work = np.zeros(ROOM)
    work[NODES : NODES + COUNT + 1] = ENDS_BY_NODE
    for j, share in enumerate(ENDS_BY_NODE[: COUNT + 1].tolist()):
        y = mpf(share)
        work[MEAN + j] = (damped(y) - damped(mpf(0))) / (WIDTH * y)
        work[EXPM1_Q + j], work[DS + j] = loss(y), ds(y)
        work[FORCE + j] = mp.diff(damped, y) / WIDTH
    return work


def time(damped: Callable[[Any], Any], turn: Any, low: Any, high: Any) -> float:
    """Return the time between two shares of the panel, given that of the turn, which may be one of them."""

    def rate(root: Any) -> Any:
        y = turn + root * abs(root) if low >= turn else turn - root * abs(root)
        return 2 * abs(root) * WIDTH * ds(y) / mp.sqrt(damped(y) / (1 + loss(y)))

    with mp.workdps(30):
        ends = sorted(mp.sqrt(abs(end - turn)) for end in (low, high))
        return float(mp.quad(rate, ends, method="gauss-legendre"))


@pytest.mark.parametrize("turn", ["1e-9", "0.03125", "0.6", "1"])
def test_the_time_to_a_turn(turn: str) -> None:
    """The time up to a turn has all digits however near to the start of the gap it is; V**2 there comes from it."""
    z = mpf(float(turn))

    def damped(y: Any) -> Any:
        return WIDTH * (z - y) * (4 + y + y * y / 4)

    got, v2 = time_to_turn(WIDTH, float(z), rows(damped))
    assert got == pytest.approx(time(damped, z, mpf(0), z), rel=2e-15)
    assert v2 == pytest.approx(float(damped(mpf(0))), rel=1e-15)


@pytest.mark.parametrize("far", ["0.001953125", "0.25", "3"])
def test_the_time_on_the_gap_beside_that_with_a_turn(far: str) -> None:
    """The time over a gap that ends, or begins, next to a turn has all digits; V**2 at its start comes from its end."""
    share, store = mpf(far) / WIDTH, np.zeros(9 * 24)

    def before(y: Any) -> Any:
        return WIDTH * (1 + share - y) * (4 + y + y * y / 4)

    def after(y: Any) -> Any:
        return WIDTH * (share + y) * (4 + y + y * y / 4)

    keep_series(store, 1, False, rows(before))
    at_end = float(before(mpf(1)) / (1 + loss(mpf(1))))
    got, v2 = time_near_turn(float(far), WIDTH, at_end, False, store, 1, rows(before))
    assert got == pytest.approx(time(before, 1 + share, mpf(0), mpf(1)), rel=2e-15)
    assert v2 == pytest.approx(float(before(mpf(0))), rel=2e-15)
    keep_series(store, 0, True, rows(after))
    got, _ = time_near_turn(float(far), WIDTH, float(after(mpf(0))), True, store, 0, rows(after))
    assert got == pytest.approx(time(after, -share, mpf(0), mpf(1)), rel=2e-15)


def test_no_time_from_rows_in_which_the_force_is_rounding() -> None:
    """Where friction almost balances the weight, the rows kept of a gap do not give the force to enough digits."""
    work = rows(lambda y: WIDTH * (1 - y) * (4 + y))
    assert time_to_turn(WIDTH, 1.0, work)[0] > 0.0
    work[N0 : N0 + COUNT] = 1e3
    assert np.isnan(time_to_turn(WIDTH, 1.0, work)[0])
