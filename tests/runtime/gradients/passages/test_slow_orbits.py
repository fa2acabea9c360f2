"""Half periods and laps beside a hilltop change as closed forms and integrals in mpmath do, without mpmath."""

from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from orbits import by_differences
from paths import ROOT

from gqm_sym.loading import load
from gqm_sym.runtime.gradients import formula_orbit
from gqm_sym.runtime.gradients.evaluation import values
from gqm_sym.runtime.gradients.passages.from_turns import WaveRecorder
from gqm_sym.runtime.gradients.programs import with_derivatives
from gqm_sym.runtime.sweep.quantities import ROUTES

ULP = 2.0**-52

# The energies per mass above and below the hilltop.
ABOVE = (1e-5, 1e-8, 1e-11, -1e-11, -1e-8, -1e-5)


@pytest.fixture(autouse=True)
def without_mpmath(monkeypatch: pytest.MonkeyPatch) -> None:
    """Derivatives in mpmath are refused."""

    def refused(*_: Any, **__: Any) -> None:
        raise AssertionError("derivatives are found in mpmath")

    monkeypatch.setattr(formula_orbit, "MultiprecisionOrbit", refused)


def period_of_pendulum(at: dict[str, Any]) -> list[Any]:
    """Return the period of a pendulum, from its complete elliptic integral."""
    rate = mp.sqrt(at["g"] / at["L"])
    square = (at["v0"] / (2 * rate * at["L"])) ** 2 + mp.sin(at["lam0"] / 2) ** 2
    return [(4 * mp.ellipk(square) if square < 1 else 2 * mp.ellipk(1 / square) / mp.sqrt(square)) / rate]


def half_period_between_two_wells(at: dict[str, Any]) -> list[Any]:
    """Return the half period in one well of z = h (x**4 - 2 x**2).

    Both parts of the way are taken in a variable in which the turning point is no branch point.
    """
    h, g, lam0 = at["h"], at["g"], at["lam0"]
    level = at["v0"] ** 2 / (2 * g * h) + lam0**2 * (lam0**2 - 2)
    outer = 1 + mp.sqrt(1 + level)
    inner = -level / outer

    def stretch(x: Any) -> Any:
        return mp.sqrt((1 + (4 * h * x * (x * x - 1)) ** 2) / (2 * g * h))

    def by_inner(u: Any) -> Any:
        x = mp.sqrt(inner) * mp.cosh(u)
        return stretch(x) / mp.sqrt(outer - x * x)

    def by_outer(y: Any) -> Any:
        x = mp.sqrt(outer - y * y)
        return stretch(x) / (x * mp.sqrt(x * x - inner))

    end = mp.acosh(1 / mp.sqrt(inner))
    edges = [0, end / 2, 3 * end / 4, end - 1, end]
    return [mp.quad(by_inner, edges, maxdegree=5) + mp.quad(by_outer, [0, mp.sqrt(outer - 1)], maxdegree=5)]


def test_a_pendulum() -> None:
    """One launch and a sweep have the derivatives of the closed form, for swings and for laps beside the top."""
    module, names = load(str(ROOT / "generated" / "circle.py"), "circle"), ("g", "L", "lam0", "v0")
    lam0 = np.linspace(-0.75, 0.5, len(ABOVE))
    v0 = np.sqrt(2 * (9.8125 * 0.875 * (1 + np.cos(lam0)) + np.array(ABOVE)))
    swept = module.sweep("period", lam0, v0, g=9.8125, L=0.875, gradient=names)
    assert not (swept.route == ROUTES.index("solve")).any()
    for *launch, row in zip(lam0.tolist(), v0.tolist(), swept.gradient, strict=True):
        at = dict(zip(names, (9.8125, 0.875, *launch), strict=True))
        found = module.solve(**at).gradient("period", names)
        for name, by_sweep in zip(names, row, strict=True):
            with mp.workdps(60):
                wanted = by_differences(period_of_pendulum, at, name, 30)[0]
            assert abs(found[name] - wanted) <= 2 * ULP * abs(wanted), (name, launch)
            assert abs(by_sweep - wanted) <= 2 * ULP * abs(wanted), (name, launch)


def test_between_two_wells() -> None:
    """A body that turns beside the hilltop at one end only has the derivatives of its integral."""
    module, names = load(str(ROOT / "generated" / "double_well.py"), "double_well"), ("v0", "h")
    at = {"lam0": 0.75, "v0": float(np.sqrt(2 * (9.8125 * 0.25 * 0.75**2 * (2 - 0.75**2) - 1e-10))), "h": 0.25}
    at["g"] = 9.8125
    found = module.solve(**at).gradient("half_period", names)
    for name in names:
        with mp.workdps(40):
            wanted = by_differences(half_period_between_two_wells, at, name, 20)[0]
        assert abs(found[name] - wanted) <= 2 * ULP * abs(wanted), name


def test_states_of_a_pendulum_from_beside_the_top() -> None:
    """A half period later every angle has changed its sign, whatever the length is."""
    motion = load(str(ROOT / "generated" / "circle.py"), "circle").solve(lam0=3.1415, g=9.8125, L=1)
    times = motion.half_period * np.array([[0.0625, 0.25, 0.5, 0.9375], [1.0625, 1.25, 1.5, 1.9375]])
    early, late = motion.sensitivity(times, "L").lam[0]
    moved = late + motion.state(times[1]).v * motion.gradient("half_period", "L")["L"]
    np.testing.assert_allclose(moved, -early, atol=1e-14 * np.abs(late).max())


@pytest.mark.parametrize("sign", [1, -1])
def test_waves_of_small_arguments(sign: int) -> None:
    """sin(t)/t and sinh(t)/t keep their digits, and their changes with t as many as those of t have."""
    op, places = WaveRecorder(0), np.array([7.5, 1.0, 1e-3, 1e-6, 1e-12])
    (value, _, error), (slope, _, _) = values(
        with_derivatives(op, [op.sinc(op.place, sign)], [op.place]), np.empty((3, 0)), places
    )
    with mp.workdps(60):
        for k, t in enumerate(map(mpf, places.tolist())):
            odd, even = (mp.sin(t), mp.cos(t)) if sign > 0 else (mp.sinh(t), mp.cosh(t))
            assert abs(value[k] - odd / t) <= ULP * abs(odd / t)
            assert abs(slope[k] - (even - odd / t) / t) <= ULP * abs((even - odd / t) / t) + 1e-31 / t
            assert error[k] <= 1e-29 * even
