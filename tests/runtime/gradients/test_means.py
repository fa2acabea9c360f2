"""Derivatives of the times of trains agree with closed forms and with 30-digit derivatives of quadratures."""

from collections.abc import Callable
from types import ModuleType
from typing import Any

import pytest
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym.errors import SolutionError

# The means are known in doubles, to some units in the last place, and derivatives are a few times as sensitive.
ROUNDING = 2e-14

RADIUS, LENGTH, PLACE = mpf(2), mpf(3) / 2, mpf(6) / 5
CONSTANTS = {"g": mpf("9.81"), "k": mpf(3) / 4, "Omega": mpf(1) / 2}


@pytest.fixture(scope="module")
def hoop(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """Return a train on a circle that rotates about the vertical through its centre, with a spring."""
    law = gqm.Gravity() + gqm.Potential("(k - Omega**2)*x**2/2", parameters=["k", "Omega"]) + gqm.Train(cars=3)
    folder = tmp_path_factory.mktemp("gradients")
    return gqm.build(gqm.derive(gqm.families.circle(), law), name="derivatives_on_hoop", folder=folder)


def energy(s: Any, g: Any, k: Any, Omega: Any) -> Any:
    """Return the mean potential of a train, which has the form of that of a body."""
    half, whole = mp.sinc(LENGTH / (2 * RADIUS)), mp.sinc(LENGTH / RADIUS)
    return -g * RADIUS * half * mp.cos(s / RADIUS) - (k - Omega**2) * RADIUS**2 * whole * mp.cos(2 * s / RADIUS) / 4


def climb(s: Any, end: Any, g: Any, k: Any, Omega: Any) -> Any:
    """Return the energy at one place less that at another one, without a subtraction."""
    half, whole, sides = mp.sinc(LENGTH / (2 * RADIUS)), mp.sinc(LENGTH / RADIUS), ((end + s), (end - s))
    one, two = (mp.sin(side / (2 * RADIUS)) for side in sides), (mp.sin(side / RADIUS) for side in sides)
    return 2 * g * RADIUS * half * mp.fprod(one) + (k - Omega**2) * RADIUS**2 * whole * mp.fprod(two) / 2


def rate(angle: Any, end: Any, **constants: Any) -> Any:
    """Return the time per angle where the place is the turning point times the sine of the angle."""
    return end * mp.cos(angle) / mp.sqrt(2 * climb(end * mp.sin(angle), end, **constants))


def turning_point(lam0: Any, v0: Any, **constants: Any) -> Any:
    """Return the upper turning point."""
    level = v0**2 / 2 + energy(lam0, **constants)
    return mp.findroot(lambda s: energy(s, **constants) - level, lam0) if v0 else lam0


def half_period(lam0: Any, v0: Any, **constants: Any) -> Any:
    """Return the time between both turning points, by the trapezoidal rule for a periodic function."""
    end, count = turning_point(lam0, v0, **constants), 60
    angles = ((2 * i + 1) * mp.pi / (4 * count) for i in range(count))
    return mp.pi / count * mp.fsum(rate(angle, end, **constants) for angle in angles)


def arrival(lam0: Any, v0: Any, **constants: Any) -> Any:
    """Return the time from the launch upwards to the lowest place."""
    end = turning_point(lam0, v0, **constants)
    parts = [mp.asin(lam0 / end), mp.pi / 2], [0, mp.pi / 4, mp.pi / 2]
    return sum(mp.quad(lambda angle: rate(angle, end, **constants), part, method="gauss-legendre") for part in parts)


def lap(lam0: Any, v0: Any, **constants: Any) -> Any:
    """Return the time of a lap."""
    level = v0**2 + 2 * energy(lam0, **constants)
    return 2 * mp.quad(lambda s: 1 / mp.sqrt(level - 2 * energy(s, **constants)), mp.linspace(0, mp.pi * RADIUS, 5))


def derivative(time: Callable[..., Any], name: str, v0: Any, constants: dict[str, Any]) -> float:
    """Return the derivative of a time with respect to a parameter."""
    at = {"lam0": PLACE, "v0": mpf(v0), **constants}
    return float(mp.diff(lambda value: time(**{**at, name: value}), at[name]))


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("time", "quantity", "v0", "changed"),
    [
        (half_period, "half_period", 0, {}),
        (half_period, "half_period", 1, {"k": 0, "Omega": 0}),
        (lap, "period", 12, {}),
    ],
)
def test_periods(hoop: ModuleType, time: Callable[..., Any], quantity: str, v0: int, changed: dict[str, int]) -> None:
    """Half periods and laps have derivatives with respect to the launch and to the parameters of all forces."""
    constants = {**CONSTANTS, **{name: mpf(value) for name, value in changed.items()}}
    names = ["lam0", *(["v0"] if v0 else []), "g", "k", "Omega"]
    given = {"L": 2, "length": "3/2", **{name: str(value) for name, value in constants.items()}}
    motion = hoop.solve("6/5", v0, **given)
    with mp.workdps(30):
        truth = [derivative(time, name, v0, constants) for name in names]
    found = motion.gradient(quantity, names)
    assert [found[name] for name in names] == pytest.approx(truth, rel=ROUNDING, abs=ROUNDING)
    assert motion.gradient(quantity, "m") == {"m": 0.0}
    swept = hoop.sweep(quantity, [1.2], v0, gradient=names, **given)
    assert swept.gradient[0] == pytest.approx(truth, rel=ROUNDING, abs=ROUNDING)


def test_turning_points_and_times(hoop: ModuleType) -> None:
    """A turning point moves as the energy does, and a time at a place by the quadrature to there."""
    given = {"L": 2, "length": "3/2", "g": "9.81", "k": "3/4", "Omega": "1/2"}
    motion = hoop.solve("6/5", 1, **given)
    with mp.workdps(30):
        end = turning_point(PLACE, mpf(1), **CONSTANTS)
        slope = mp.diff(lambda s: energy(s, **CONSTANTS), end)
        by_v0 = float(1 / slope)
        at_launch = mp.diff(lambda s: energy(s, **CONSTANTS), PLACE)
    found = motion.gradient("turning_points", ("v0", "lam0"))
    low, high = sorted(found["v0"])
    assert (low, high) == pytest.approx((-by_v0, by_v0), rel=ROUNDING)
    assert sorted(found["lam0"]) == pytest.approx([-float(at_launch / slope), float(at_launch / slope)], rel=ROUNDING)

    with mp.workdps(30):
        truth = derivative(arrival, "v0", 1, CONSTANTS)
    assert motion.gradient("time_at", "v0", lam=0)["v0"] == pytest.approx(truth, rel=ROUNDING)


@pytest.mark.extended
def test_a_train_that_leaves_a_helix(tmp_path_factory: pytest.TempPathFactory) -> None:
    """The time to the end of the track has derivatives too, although it does not repeat."""
    helix = gqm.families.helix(R="2", c="3/4", domain=(0, 12))
    folder = tmp_path_factory.mktemp("helix")
    module = gqm.build(gqm.derive(helix, gqm.Gravity() + gqm.Train(length=3)), name="train_leaves", folder=folder)
    motion = module.solve(20)
    distance, slope = 20 - 1.5, 0.75 / (4 + 0.75**2) ** 0.5
    time = (2 * distance / (9.81 * slope)) ** 0.5
    found = motion.gradient("t_end", ("g", "lam0", "length"))
    assert motion.t_end == pytest.approx(time, rel=1e-14)
    assert (found["g"], found["lam0"]) == pytest.approx((-time / (2 * 9.81), time / (2 * distance)), rel=ROUNDING)
    # The middle of a longer train is nearer to the end of the track.
    assert found["length"] == pytest.approx(-time / (4 * distance), rel=ROUNDING)


def test_what_has_no_derivatives(hoop: ModuleType) -> None:
    """Contact forces have none, nor has anything by what shapes the means, nor a train under three potentials."""
    motion = hoop.solve("6/5", L=2, length="3/2", k=1, Omega=0)
    for call, message in (
        (lambda: motion.gradient("normal_force_max", "g"), "of a train, whose contact force"),
        (lambda: motion.sensitivity(1.0, "g"), "of a train, whose contact force"),
        (lambda: motion.gradient("half_period"), "respect to L, length, because the means over a train"),
    ):
        with pytest.raises(SolutionError, match=message):
            call()
