"""Slow and simple calculations say what a motion must be, from mpmath and SymPy alone, never from gqm_sym."""

import math
from collections.abc import Callable, Iterable
from functools import cache
from typing import Any, NamedTuple

import sympy as sp
from mpmath import mp, mpf
from problems import DIGITS, Problem, Track, number


class Point(NamedTuple):
    """Everything that is known at one place."""

    x: mpf
    z: mpf
    ds: mpf
    kappa: mpf
    v2: mpf
    normal_force: mpf


@cache
def _geometry(track: Track) -> Callable[..., list[mpf]]:
    """Return coordinates and their derivatives, as SymPy gives them without any simplification."""
    names = sp.symbols([track.parameter, *track.parameters], real=True)
    known = {symbol.name: symbol for symbol in names}
    x, z = (sp.sympify(text, locals=known, rational=True) for text in (track.x, track.z))
    lam = names[0]
    derivatives = [sp.diff(c, lam, order) for order in (0, 1, 2) for c in (x, z)]
    return sp.lambdify(names, derivatives, "mpmath")


def point(problem: Problem, track: Track, lam: mpf | float | str) -> Point:
    """Return the values at ``lam`` by the definitions, to 50 digits: V**2 = v0**2 - 2*g*(z - z0) and so on."""
    given = dict(problem.parameters)
    with mp.workdps(DIGITS):
        geometry = _geometry(track)
        values = [number(given[name]) for name in track.parameters]
        g, m = number(given.get("g", "9.81")), number(given.get("m", "1"))
        place = lam if isinstance(lam, mpf) else number(lam)
        x, z, dx, dz, ddx, ddz = geometry(place, *values)
        z0 = geometry(number(problem.lam0), *values)[1]
        ds = mp.sqrt(dx**2 + dz**2)
        kappa = (dx * ddz - dz * ddx) / ds**3
        v2 = number(problem.v0) ** 2 - 2 * g * (z - z0)
        return Point(x, z, ds, kappa, v2, m * (g * dx / ds + kappa * v2))


class Scale(NamedTuple):
    """The scales to which "of its scale" refers (a time's scale is the time itself)."""

    lam: float
    place: float
    v: float


@cache
def scale(problem: Problem, track: Track) -> Scale:
    """Return the largest |lam|, the extent of the orbit in the plane, and the largest speed.

    A body at rest has no extent; the distance from the origin takes its place.
    """
    seen = [number(row.lam) for row in (*problem.positions, *problem.samples)]
    seen += [number(text) for text in problem.turning_points or ()]
    seen.append(number(problem.lam0))
    if track.period is not None and problem.kind == "circulation":
        seen.append(seen[-1] + number(track.period))
    low, high = min(seen), max(seen)
    orbit = [point(problem, track, low + (high - low) * k / 32) for k in range(33)]
    width = max(p.x for p in orbit) - min(p.x for p in orbit)
    height = max(p.z for p in orbit) - min(p.z for p in orbit)
    if problem.kind == "rest":
        width, height = (abs(c) for c in orbit[0][:2])
    return Scale(
        lam=float(max(*(abs(lam) for lam in seen), high - low)),
        place=float(max(width, height)),
        v=float(mp.sqrt(max(*(p.v2 for p in orbit), mpf(0)))),
    )


def pendulum(amplitude: mpf | float, frequency: mpf | float, t: mpf | float) -> mpf:
    """Return the angle from the vertical after release at ``amplitude``, 2*asin(k*cd(omega*t, k))."""
    with mp.workdps(DIGITS):
        k = mp.sin(mpf(amplitude) / 2)
        u = mpf(frequency) * mpf(t)
        cn, dn = mp.ellipfun("cn", u, m=k**2), mp.ellipfun("dn", u, m=k**2)
        return 2 * mp.asin(k * cn / dn)


def pendulum_half_period(amplitude: mpf | float, frequency: mpf | float) -> mpf:
    """Return the half period of a pendulum, 2*K(sin(A/2))/omega."""
    with mp.workdps(DIGITS):
        return 2 * mp.ellipk(mp.sin(mpf(amplitude) / 2) ** 2) / mpf(frequency)


def error(actual: float, expected: str | mpf) -> float:
    """Return |actual - expected|, subtracted at 50 digits."""
    with mp.workdps(DIGITS):
        truth = expected if isinstance(expected, mpf) else mpf(expected)
        return float(abs(mpf(float(actual)) - truth))


def ulps(actual: float, expected: str | mpf) -> float:
    """Return the same in units of the last place of the expected value."""
    return error(actual, expected) / math.ulp(float(expected))


def overstatement(motion: Any, positions: Iterable[tuple[str, str]], scale: float) -> float:
    """Return the largest ratio of ``error_bound`` to what it should be.

    That is the larger of one unit in the last place of the scale and the largest error in the same decade of time.
    """
    decades: dict[int | None, list[tuple[float, float]]] = {}
    for t, lam in positions:
        decade = math.floor(math.log10(abs(float(t)))) if float(t) else None
        pair = (error(motion.lam(t), lam), motion.error_bound(t) / max(1.0, abs(float(lam)) / scale))
        decades.setdefault(decade, []).append(pair)
    unit = math.ulp(scale)
    return max(max(b for _, b in rows) / max(unit, *(e for e, _ in rows)) for rows in decades.values())
