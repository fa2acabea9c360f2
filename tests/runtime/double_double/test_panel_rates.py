"""Time and arc length on panels of phase angles in double-double arithmetic agree with mpmath and closed forms."""

from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp, mpf
from problems import number
from selection import examples

from gqm_sym.runtime.double_double.panel_rates import panel_rates
from gqm_sym.runtime.motion import timing
from gqm_sym.runtime.multiprecision.exact_panels import ALL_NODES
from gqm_sym.runtime.multiprecision.exact_problem import two_doubles
from gqm_sym.runtime.quadrature.substitution import FROM_TURN, REGULAR, TURN_TURN

G = number("9.81")
KINDS = {"between turns": TURN_TURN, "from a turn": FROM_TURN, "without turns": REGULAR}


@pytest.fixture(scope="module")
def circle(module_of: Callable[[str], ModuleType]) -> ModuleType:
    """Return a bead on a circle, whose angle is measured from the bottom."""
    return module_of("circle")


def rates(motion: Any, kind: int, ends: tuple[Any, Any], panel: tuple[Any, Any]) -> Any:
    """Return the rows of `panel_rates` on a panel from one phase angle to another."""
    a, b = ends
    low, high = panel
    pairs = [two_doubles(value) for value in (a, b - a, (low + high) / 2, (high - low) / 2)]
    launch = motion.problem.launch
    return panel_rates(motion.problem.tape, (launch.lam0, launch.v0), kind, tuple(pairs), ALL_NODES)


@pytest.mark.parametrize("name", KINDS)
@given(amplitude=st.floats(0.01, 3.1), low=st.floats(0.01, 0.98), width=st.floats(1e-6, 1.0))
@examples(40)
def test_the_last_bit(name: str, amplitude: float, low: float, width: float, circle: ModuleType) -> None:
    """Each rate is the double nearest to that with V**2 = 2 g (cos lam - cos amplitude) and ds = dlam, and so is the
    regular factor of the speed.
    """
    motion, kind = circle.solve(lam0=amplitude, L=1), KINDS[name]
    with mp.workdps(60):
        a, b = -mpf(amplitude), mpf(amplitude) if kind == TURN_TURN else mpf(amplitude) / 3
        a = a if kind != REGULAR else -mpf(amplitude) / 2
        stop = mp.pi if kind == TURN_TURN else mpf(1)
        start, end = stop * mpf(low), stop * min(mpf(low) + mpf(width), mpf("0.99"))
        found = rates(motion, kind, (a, b), (start, end))
        assert found is not None
        for i, node in enumerate(ALL_NODES.tolist()):
            phi = (start + end) / 2 + (end - start) / 2 * mpf(node)
            share = {TURN_TURN: mp.sin(phi / 2) ** 2, FROM_TURN: phi**2, REGULAR: phi}[kind]
            slope = {TURN_TURN: mp.sin(phi) / 2, FROM_TURN: 2 * phi, REGULAR: mpf(1)}[kind]
            speed = mp.sqrt(2 * G * (mp.cos(a + (b - a) * share) - mp.cos(amplitude)))
            length, growth = (b - a) * slope, {TURN_TURN: mp.sin(phi), FROM_TURN: phi, REGULAR: mpf(1)}[kind]
            for value, wanted in zip(found[:, i], (length / speed, length, speed / growth), strict=True):
                assert abs(mpf(float(value)) - wanted) <= mpf(np.spacing(float(wanted))) * mpf("0.75")


def test_what_cancels_is_left_alone(circle: ModuleType) -> None:
    """If V**2 is negative, or so small that too few of its digits are left, there is no answer."""
    motion = circle.solve(lam0=1, L=1)
    with mp.workdps(60):
        assert rates(motion, REGULAR, (mpf("1.1"), mpf("1.2")), (mpf(0), mpf(1))) is None
        assert rates(motion, REGULAR, (mpf(1), mpf(1) - mpf("1e-16")), (mpf(0), mpf(1))) is None


@pytest.mark.extended
@given(gap=st.floats(3.0, 11.0), lam0=st.floats(-2.5, 2.5), turns=st.booleans())
@examples(40)
def test_beside_the_separatrix(gap: float, lam0: float, turns: bool, circle: ModuleType) -> None:
    """For a swing nearly to the top, or a round that nearly stops there, the period is right to the last bit without
    mpmath.
    """
    with mp.workdps(60):
        share = 1 - mpf(10) ** -gap if turns else 1 + mpf(10) ** -gap
        v0 = float(mp.sqrt(4 * G * share - 2 * G * (1 - mp.cos(mpf(lam0)))))
        square = mpf(v0) ** 2 + 2 * G * (1 - mp.cos(mpf(lam0)))
        motion = circle.solve(lam0=lam0, v0=v0, L=1)
        k2 = square / (4 * G)
        wanted = 4 * mp.ellipk(k2) / mp.sqrt(G) if k2 < 1 else 2 * mp.ellipk(1 / k2) / mp.sqrt(G * k2)
        assert motion.kind == ("libration" if k2 < 1 else "circulation")
        found = timing.in_double_double(motion.problem, motion.kind, 1, motion._segment, motion._offsets)
        assert found is not None
        duration = wanted / 2 if k2 < 1 else wanted
        assert abs(mpf(found.duration[0]) + mpf(found.duration[1]) - duration) <= found.relative_error * duration
        assert found.relative_error <= 1e-17
        assert motion.period == float(wanted)
