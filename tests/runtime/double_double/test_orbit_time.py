"""Half periods and turning points from double-double arithmetic agree with closed forms, and mpmath is used beyond
them.
"""

from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp, mpf
from naive import pendulum, pendulum_half_period
from paths import ROOT
from problems import number
from selection import examples

from gqm_sym.loading import load
from gqm_sym.runtime.double_double.nodes import LEVELS, panel_rule, trapezoidal_nodes
from gqm_sym.runtime.motion import timing
from gqm_sym.runtime.motion.periodic import PeriodicMotion
from gqm_sym.runtime.quadrature.trapezoid import CIRCULATION, LIBRATION

G = number("9.81")
AMPLITUDES = st.floats(1e-3, 3.1)
# In these modules a body swings from a place drawn between the first two numbers, with a speed up to the third.
SWINGS = {
    "ellipse": (-1.5, 1.5, 2.0),
    "parabola": (0.1, 2.0, 3.0),
    "catenary": (0.1, 2.0, 3.0),
    "line_spring": (0.2, 2.0, 3.0),
    "circle_spring": (0.2, 2.0, 1.0),
    "rolling_circle": (0.2, 2.0, 1.0),
    "quartic": (0.2, 1.5, 1.0),
    "parabola_rolling": (0.1, 1.0, 1.0),
}


@pytest.fixture(scope="module")
def circle(module_of: Callable[[str], ModuleType]) -> ModuleType:
    """Return a bead on a circle."""
    return module_of("circle")


def orbit(motion: Any) -> Any:
    """Return the orbit from double-double arithmetic, after a check that it was found there."""
    assert isinstance(motion, PeriodicMotion)
    found = motion._orbit
    assert found is not None
    return found


def is_within(found: Any, wanted: mpf) -> bool:
    """Return whether a number is within its bound of the true one."""
    return bool(abs(mpf(found.high) + mpf(found.low) - wanted) <= found.error)


@given(amplitude=AMPLITUDES)
@examples(100)
def test_a_swing_on_a_circle(amplitude: float, circle: ModuleType) -> None:
    """A swing's half period is 2 K(k) sqrt(L/g), correctly rounded and within the bound, at any amplitude."""
    motion = circle.solve(lam0=amplitude, L=1)
    with mp.workdps(50):
        wanted = pendulum_half_period(mpf(amplitude), mp.sqrt(G))
        assert motion.half_period == float(wanted)
        assert is_within(orbit(motion).duration, wanted)
        assert is_within(orbit(motion).low, -mpf(amplitude))


@given(share=st.floats(1.001, 5.0), lam0=st.floats(-3.0, 3.0), direction=st.sampled_from([1, -1]))
@examples(50)
def test_a_round_on_a_circle(share: float, lam0: float, direction: int, circle: ModuleType) -> None:
    """A round with the speed v at the bottom takes 4 K(4 g L/v**2) L/v."""
    with mp.workdps(50):
        v0 = float(mp.sqrt(4 * G * share - 2 * G * (1 - mp.cos(mpf(lam0)))))
        square = mpf(v0) ** 2 + 2 * G * (1 - mp.cos(mpf(lam0)))
        wanted = 4 * mp.ellipk(4 * G / square) / mp.sqrt(square)
        motion = circle.solve(lam0=lam0, v0=v0, L=1, direction=direction)
        assert motion.kind == "circulation"
        assert motion.period == float(wanted)
        assert is_within(orbit(motion).duration, wanted)


@pytest.mark.extended
@pytest.mark.parametrize("name", SWINGS)
def test_the_same_as_with_more_digits(name: str) -> None:
    """Half periods, turning points, times to the launch and of panels are those of 34 digits, within the bound."""
    module, (low, high, speed) = load(ROOT / "generated" / f"{name}.py", name), SWINGS[name]
    rng = np.random.default_rng(5)
    for k in range(6):
        given = {name: 1 for name, value in module.PARAMETERS.items() if value is None}
        v0 = float(rng.uniform(0.0, speed)) if k % 2 else 0.0
        motion = module.solve(float(rng.uniform(low, high)), v0, **given)
        assert motion.kind == "libration"
        launch = motion.problem, motion.kind, motion.direction
        exact = timing.in_multiprecision(*launch, motion._segment)
        found = timing.in_double_double(*launch, motion._segment, motion._offsets)
        assert found is not None
        assert motion.half_period == exact.duration[0]
        assert motion.turning_points[-1] in timing.turning_points(motion.problem, motion._segment)
        assert orbit(motion).duration.error <= 1e-25 * exact.duration[0]
        with mp.workdps(40):
            assert is_within(orbit(motion).duration, mpf(exact.duration[0]) + mpf(exact.duration[1]))
            lag = sum(map(mpf, found.phase_time)) - sum(map(mpf, exact.phase_time))
            assert abs(lag) <= 1e-21 * exact.duration[0]
        assert (found.edge_times is None) == (exact.edge_times is None)
        if found.edge_times is not None and exact.edge_times is not None:
            (times, lows), (wanted, wanted_lows) = found.edge_times, exact.edge_times
            assert np.abs((times - wanted) + (lows - wanted_lows)).max() <= 1e-21 * exact.duration[0]


@pytest.mark.parametrize("amplitude", ["1e-6", "1e-9", "3.1415926", "1e-30"])
def test_what_has_too_few_digits_is_left_to_mpmath(amplitude: str, circle: ModuleType) -> None:
    """V**2 of a tiny swing, and beside the top, cancels so far that the bound shows it, and the answer is right."""
    motion = circle.solve(lam0=amplitude, L=1)
    found = motion._orbit
    with mp.workdps(60):
        wanted = pendulum_half_period(mpf(amplitude), mp.sqrt(G))
        assert found is None or is_within(found.duration, wanted)
        assert found is None or found.duration.error >= 1e-24 * found.duration.high
        assert motion.half_period == float(wanted)


def test_times_so_late_that_double_double_is_not_enough(circle: ModuleType) -> None:
    """The period of a small swing has 24 digits; for times after 1e12 periods it is computed again with more digits."""
    motion = circle.solve(lam0="1e-3", L=1)
    with mp.workdps(60):
        amplitude, frequency = mpf("1e-3"), mp.sqrt(G)
        late = float(1000000000000.23 * 2 * pendulum_half_period(amplitude, frequency))
        assert motion.lam(100.0) == pytest.approx(float(pendulum(amplitude, frequency, 100)), rel=1e-13)
        before = motion._times_until(100.0).timing
        assert before is not None
        assert before.max_time < late
        assert motion.lam(late) == pytest.approx(float(pendulum(amplitude, frequency, late)), rel=1e-13)
        assert motion._times_until(late).timing is not before


def test_tabulated_nodes() -> None:
    """The tables have the squares of sines at equal angles, each level between the nodes of the last one, and the
    angles of a lap.
    """
    shares, lows, factors, factor_lows = trapezoidal_nodes(LIBRATION)
    laps = trapezoidal_nodes(CIRCULATION)
    with mp.workdps(40):
        for k in (1, 2, 15, 16, 17, 31, 1000, 4095):
            level = next(n for n in LEVELS[1:] if k < n)
            share = mpf(k) / 16 if level == 16 else (2 * mpf(k) + 1) / level - 1
            sine, cosine = mp.sinpi(share / 2), mp.cospi(share / 2)
            assert abs(shares[k] + mpf(lows[k]) - sine**2) <= 1e-31
            assert abs(factors[k] + mpf(factor_lows[k]) - sine * cosine) <= 1e-31
            assert laps[0, k] == float(share)


def test_rule_of_panels() -> None:
    """Sixteen nodes integrate powers up to the 31st exactly, and no higher ones."""
    rule = panel_rule()
    with mp.workdps(40):
        nodes = [mpf(a) + mpf(b) for a, b in rule[:2].T.tolist()]
        weights = [mpf(a) + mpf(b) for a, b in rule[2:].T.tolist()]
        for power in range(33):
            error = sum(w * x**power for x, w in zip(nodes, weights, strict=True)) - mpf(1) / (power + 1)
            assert (abs(error) <= 1e-30) == (power < 32)
