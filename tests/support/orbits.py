"""Half periods, laps and actions in mpmath come from separate formulas, with derivatives by differences.

Each track gives its effective potential U, ds/dlam and 1 + beta as functions of the place and of all run-time
parameters by name, beginning with a launch. Nothing here comes from gqm_sym.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from mpmath import mp, mpf

# The number of nodes of the midpoint rule, which gives 35 digits on all orbits here.
NODES = 128


@dataclass(frozen=True)
class Formula:
    """A track with its force, and where to launch on it: ranges of lam0, v0 and all other numbers.

    On an ``even`` track both sides of each orbit are mirror images.
    """

    potential: Callable[..., Any]
    ds: Callable[..., Any]
    ranges: Mapping[str, tuple[float, float]]
    inertia: Callable[..., Any] = lambda **p: 1
    ends: tuple[float, float] = field(default=(-4.0, 4.0))
    even: bool = False


def _slope(lam: mpf, a: Any) -> Any:
    return mp.sqrt(1 + (2 * a * lam) ** 2)


ROLLING = {"beta": (0.1, 1.0), "g": (5.0, 15.0)}
FORMULAS = {
    "ellipse": Formula(
        lambda lam, a, b, g, **_: b * g * mp.sin(lam),
        lambda lam, a, b, **_: mp.sqrt((a * mp.sin(lam)) ** 2 + (b * mp.cos(lam)) ** 2),
        {"lam0": (-2.4, -0.8), "v0": (0.0, 2.0), "a": (1.0, 2.0), "b": (0.7, 1.5), "g": (5.0, 15.0)},
        even=True,
    ),
    "parabola": Formula(
        lambda lam, a, g, **_: g * a * lam**2,
        lambda lam, a, **_: _slope(lam, a),
        {"lam0": (-0.8, 0.8), "v0": (0.5, 2.0), "a": (0.3, 0.8), "g": (5.0, 15.0)},
        even=True,
    ),
    "catenary": Formula(
        lambda lam, c, g, **_: g * c * mp.cosh(lam / c),
        lambda lam, c, **_: mp.cosh(lam / c),
        {"lam0": (-1.0, 1.0), "v0": (0.5, 2.0), "c": (0.6, 1.4), "g": (5.0, 15.0)},
        even=True,
    ),
    "double_well": Formula(
        lambda lam, h, g, **_: g * h * (lam**4 - 2 * lam**2),
        lambda lam, h, **_: mp.sqrt(1 + (4 * h * (lam**3 - lam)) ** 2),
        {"lam0": (0.5, 0.8), "v0": (0.0, 0.5), "h": (0.2, 0.4), "g": (5.0, 15.0)},
    ),
    "circle_spring": Formula(
        lambda lam, L, w, h, g, **_: -g * L * mp.cos(lam) + w**2 * (L**2 + h**2 + 2 * L * h * mp.cos(lam)) / 2,
        lambda lam, L, **_: L + 0 * lam,
        {"lam0": (0.1, 1.2), "v0": (0.0, 1.0), "L": (0.8, 1.2), "w": (1.0, 2.0), "h": (0.2, 0.5), "g": (7.0, 12.0)},
        even=True,
    ),
    "rolling_circle": Formula(
        lambda lam, L, beta, g, **_: -g * L * mp.cos(lam) / (1 + beta),
        lambda lam, L, **_: L + 0 * lam,
        {"lam0": (0.1, 1.5), "v0": (0.0, 1.0), "L": (0.8, 1.2), **ROLLING},
        inertia=lambda beta, **_: 1 + beta,
        even=True,
    ),
    "parabola_rolling": Formula(
        lambda lam, a, beta, rho, g, **_: g * (a * lam**2 + rho / _slope(lam, a)) / (1 + beta),
        lambda lam, a, rho, **_: _slope(lam, a) - 2 * a * rho / _slope(lam, a) ** 2,
        {"lam0": (0.1, 1.0), "v0": (0.0, 1.0), "a": (0.3, 0.8), "rho": (0.1, 0.4), **ROLLING},
        inertia=lambda beta, **_: 1 + beta,
        even=True,
    ),
}


def turning_point(name: str, launch: Mapping[str, Any], near: float) -> mpf:
    """Return the place where V**2 vanishes, from a double beside it."""
    potential, lam = FORMULAS[name].potential, mpf(near)
    level = potential(launch["lam0"], **launch) + launch["v0"] ** 2 / 2
    return mp.findroot(lambda u: potential(u, **launch) - level, lam)


def half_orbit(name: str, launch: Mapping[str, Any], near: tuple[float, float]) -> tuple[mpf, mpf, mpf, mpf]:
    """Return half period, action, and both turning points of a libration, from doubles beside these."""
    formula = FORMULAS[name]
    a, b = sorted(turning_point(name, launch, end) for end in near)
    w0 = launch["v0"] ** 2 + 2 * formula.potential(launch["lam0"], **launch)
    time = action = mpf(0)
    count = NODES // 2 if formula.even else NODES
    for k in range(count):
        phi = mp.pi * (k + mpf(1) / 2) / NODES
        lam = (a + b) / 2 - (b - a) / 2 * mp.cos(phi)
        ds = formula.ds(lam, **launch) * (b - a) / 2 * mp.sin(phi)
        v = mp.sqrt(w0 - 2 * formula.potential(lam, **launch))
        time, action = time + ds / v, action + ds * v
    factor = mp.pi / count
    return factor * time, 2 * factor * action * formula.inertia(**launch), a, b


def by_differences(
    function: Callable[[dict[str, mpf]], Any], launch: Mapping[str, float], name: str, digits: int = 12
) -> list[mpf]:
    """Return the derivatives of some numbers with respect to one of a launch's; the step has so many digits."""
    step, numbers = mpf(10) ** -digits, {key: mpf(value) for key, value in launch.items()}
    after, before = (function({**numbers, name: numbers[name] + sign * step}) for sign in (1, -1))
    return [(up - down) / (2 * step) for up, down in zip(after, before, strict=True)]
