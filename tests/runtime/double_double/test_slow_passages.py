"""Half periods and laps are right for bodies that turn next to a hilltop, or barely pass one."""

from collections.abc import Callable
from fractions import Fraction
from types import ModuleType

import numpy as np
import pytest
from mpmath import mp, mpf
from naive import pendulum_half_period
from problems import number

from gqm_sym.runtime.double_double.nodes import WINDOW, powers
from gqm_sym.runtime.double_double.orbit_time import BoundedNumber
from gqm_sym.runtime.motion import timing
from gqm_sym.runtime.motion.periodic import PeriodicMotion

G = number("9.81")
EXPONENTS = np.linspace(1.0, 13.5, 26)


@pytest.fixture(scope="module")
def circle(module_of: Callable[[str], ModuleType]) -> ModuleType:
    """Return a bead on a circle."""
    return module_of("circle")


@pytest.fixture(scope="module")
def double_well(module_of: Callable[[str], ModuleType]) -> ModuleType:
    """Return a bead between two wells."""
    return module_of("double_well")


def assert_found(motion: object, wanted: mpf, answer: float) -> None:
    """Assert that double-double arithmetic has found the duration, within its bound, and that the answer is rounded
    from it.
    """
    assert isinstance(motion, PeriodicMotion)
    assert motion._orbit is not None
    found: BoundedNumber = motion._orbit.duration
    assert abs(mpf(found.high) + mpf(found.low) - wanted) <= found.error
    assert answer == float(wanted)


@pytest.mark.parametrize("exponent", EXPONENTS[EXPONENTS < 7.0])
def test_released_beside_the_top(exponent: float, circle: ModuleType) -> None:
    """The half period is 2 K(k) sqrt(L/g), with both turning points at the top."""
    amplitude = float(np.pi - 10.0**-exponent)
    motion = circle.solve(lam0=amplitude, L=1)
    with mp.workdps(50):
        assert_found(motion, pendulum_half_period(mpf(amplitude), mp.sqrt(G)), motion.half_period)


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_thrown_up_to_the_top(exponent: float, circle: ModuleType) -> None:
    """With a speed v at the bottom that does not suffice, the half period is 2 K(v**2/(4 g L)) sqrt(L/g)."""
    speed = float(np.sqrt(4 * 9.81) * (1.0 - 10.0**-exponent))
    motion = circle.solve(lam0=0, v0=speed, L=1)
    assert motion.kind == "libration"
    with mp.workdps(50):
        assert_found(motion, 2 * mp.ellipk(mpf(speed) ** 2 / (4 * G)) / mp.sqrt(G), motion.half_period)


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_round_and_slowly_over_the_top(exponent: float, circle: ModuleType) -> None:
    """With a higher speed a round takes 4 K(4 g L/v**2) L/v, in whichever place and direction the body is launched."""
    speed = float(np.sqrt(4 * 9.81) * (1.0 + 10.0**-exponent))
    motion = circle.solve(lam0=0, v0=speed, L=1, direction=(-1) ** int(2 * exponent))
    assert motion.kind == "circulation"
    with mp.workdps(50):
        assert_found(motion, 4 * mp.ellipk(4 * G / mpf(speed) ** 2) / speed, motion.period)


@pytest.mark.parametrize("offset", [1e-2, -1e-5, 3e-8, 1e-11])
def test_a_hill_between_two_wells(offset: float, double_well: ModuleType) -> None:
    """A body that starts at the foot of one well turns beside the hill, or passes it slowly to the other well."""
    speed = float(np.sqrt(2 * 9.81 * 0.25) * (1.0 + offset))
    motion = double_well.solve(lam0=1, v0=speed)
    times = timing.in_multiprecision(motion.problem, motion.kind, motion.direction, motion._segment).duration
    with mp.workdps(40):
        assert_found(motion, sum(map(mpf, times)), motion.half_period)


def test_what_cancels_too_far_is_left_to_mpmath(circle: ModuleType) -> None:
    """The height of the other top is known to 31 digits only, of which V**2 there may need more."""
    motion = circle.solve(lam0="3.14159265358", L=1)
    assert motion._orbit is None
    with mp.workdps(50):
        assert motion.half_period == float(pendulum_half_period(mpf("3.14159265358"), mp.sqrt(G)))


def test_coefficients_of_powers() -> None:
    """Each column has the coefficients of Lagrange's polynomial of its node; the first row picks the value at 0."""
    table = powers()
    nodes = [Fraction(y) for y in table[0].tolist()]
    assert nodes[WINDOW // 2] == 0
    for j in (0, 5, 8, 16):
        found = [
            Fraction(a) + Fraction(b) for a, b in zip(table[1 : 1 + WINDOW, j], table[1 + WINDOW :, j], strict=True)
        ]
        for i, node in enumerate(nodes):
            value = sum(c * node**k for k, c in enumerate(found))
            assert abs(value - (i == j)) <= 1e-24
        assert found[0] == pytest.approx(int(j == WINDOW // 2), abs=1e-31)
