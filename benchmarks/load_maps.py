"""Pass 1 at many places, for all families, compared with hand-written loops and lambdified NumPy."""

import importlib
from collections.abc import Callable
from math import cos, cosh, exp, pi, sin, sqrt
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np
import sympy as sp
from measure import Row, apart, on_one_core
from mpmath import mp, mpf
from numba import njit

PLACES = 1_000_000
G, SPEED = 9.81, 8.0


# Of a place u: x, z, ds/du, signed curvature, and the cosine of the slope.
def circle(u, L):  # type: ignore[no-untyped-def]  # noqa: D103
    return L * sin(u), -L * cos(u), L, 1 / L, cos(u)


def ellipse(u, a, b):  # type: ignore[no-untyped-def]  # noqa: D103
    s, c = sin(u), cos(u)
    ds = sqrt(a * a * s * s + b * b * c * c)
    return a * c, b * s, ds, a * b / (ds * ds * ds), -a * s / ds


def parabola(u, a):  # type: ignore[no-untyped-def]  # noqa: D103
    ds = sqrt(1 + 4 * a * a * u * u)
    return u, a * u * u, ds, 2 * a / (ds * ds * ds), 1 / ds


def catenary(u, c):  # type: ignore[no-untyped-def]  # noqa: D103
    ds = cosh(u / c)
    return u, c * ds, ds, 1 / (c * ds * ds), 1 / ds


def cycloid(u, R):  # type: ignore[no-untyped-def]  # noqa: D103
    half = sin(u / 2)
    return R * (u - sin(u)), 2 * R * half * half, 2 * R * half, -1 / (4 * R * half), half


def log_spiral(u, r0, b):  # type: ignore[no-untyped-def]  # noqa: D103
    r, s, c = r0 * exp(b * u), sin(u), cos(u)
    n = sqrt(1 + b * b)
    return r * c, r * s, n * r, 1 / (n * r), (b * c - s) / n


def quartic(u):  # type: ignore[no-untyped-def]  # noqa: D103
    slope = 4 * u * u * u
    ds = sqrt(1 + slope * slope)
    return u, u * u * u * u, ds, 12 * u * u / (ds * ds * ds), 1 / ds


class Range(NamedTuple):
    """Return the textbook formulas of a family, and the places at which they are evaluated."""

    form: Callable[..., Any]
    low: float
    high: float


RANGES = (
    Range(circle, -pi, pi),
    Range(ellipse, -pi, pi),
    Range(parabola, -2.0, 2.0),
    Range(catenary, -2.0, 2.0),
    Range(cycloid, 0.5, 5.75),
    Range(log_spiral, -pi, pi),
    Range(quartic, -2.0, 2.0),
)


def by_hand(form: Callable[..., Any]) -> Callable[..., Any]:
    """Return the loop that one would write from textbook formulas."""
    inner = njit(error_model="numpy")(form)

    @njit(error_model="numpy")
    def loop(lam: Any, lam0: float, v0: float, p: Any, g: float, m: float) -> Any:
        out = np.empty((6, lam.size))
        top = v0 * v0 + 2 * g * inner(lam0, *p)[1]
        for i in range(lam.size):
            x, z, ds, kappa, slope = inner(lam[i], *p)
            v2 = top - 2 * g * z
            out[0, i], out[1, i], out[2, i], out[3, i] = x, z, ds, kappa
            out[4, i], out[5, i] = v2, m * (kappa * v2 + g * slope)
        return out

    return loop  # type: ignore[no-any-return]


def lambdified(form: Callable[..., Any], count: int) -> Callable[..., Any]:
    """Return the same formulas as SymPy prints them for NumPy."""
    u, start, v0, g, m, *p = sp.symbols(f"u start v0 g m p:{count}", positive=True)
    of = FunctionType(form.__code__, {name: getattr(sp, name, None) for name in form.__code__.co_names})
    x, z, ds, kappa, slope = of(u, *p)
    v2 = v0**2 + 2 * g * (of(start, *p)[1] - z)
    printed = sp.lambdify(
        (u, start, v0, p, g, m), (x, z, ds, kappa, v2, m * (kappa * v2 + g * slope)), "numpy", cse=True
    )
    return printed  # type: ignore[no-any-return]


def truths(form: Callable[..., Any], lam: Any, lam0: float, p: tuple[float, ...], g: float, m: float) -> list[mpf]:
    """Return contact forces to 40 digits."""
    of = FunctionType(form.__code__, {name: getattr(mp, name, None) for name in form.__code__.co_names})
    exact = tuple(map(mpf, p))
    top = mpf(SPEED) ** 2 + 2 * mpf(g) * of(mpf(lam0), *exact)[1]
    found = []
    for place in lam:
        _, z, _, kappa, slope = of(mpf(float(place)), *exact)
        found.append(mpf(m) * (kappa * (top - 2 * mpf(g) * z) + mpf(g) * slope))
    return found


def rows_of(family: Range) -> list[Row]:
    """Return the rows for the load map of one family."""
    name = family.form.__name__
    module = importlib.import_module(f"generated.{name}")
    given = {key: float(value) for key, value in module.PARAMETERS.items()}
    g, m = given.pop("g"), given.pop("m")
    p, lam0 = tuple(given.values()), 0.5 * (family.low + family.high)
    lam = np.linspace(family.low, family.high, PLACES)
    few = slice(0, PLACES, 5000)
    known = truths(family.form, lam[few], lam0, p, g, m)
    scale = float(max(map(abs, known)))

    def error(values: Any) -> float:
        return apart(np.asarray(values[5])[few], known, scale)

    loop, printed = by_hand(family.form), lambdified(family.form, len(p))
    work = f"load map, {name.replace('_', ' ')}, per place"
    field = module.pass1(lam, lam0, SPEED)
    calls: tuple[tuple[str, Callable[[], Any], float], ...] = (
        ("`pass1`, one core", on_one_core(lambda: module.pass1(lam, lam0, SPEED)), 1e-15),
        ("`pass1(..., out=field)`, one core", on_one_core(lambda: module.pass1(lam, lam0, SPEED, out=field)), 1e-15),
        ("`pass1`, all cores", lambda: module.pass1(lam, lam0, SPEED), 1e-15),
        ("a hand-written numba loop, one core", lambda: loop(lam, lam0, SPEED, p, g, m), np.inf),
        ("`lambdify(..., cse=True)` to NumPy", lambda: printed(lam, lam0, SPEED, p, g, m), np.inf),
    )
    return [Row(work, who, call, error, each=PLACES, line=line, unit="of scale") for who, call, line in calls]


def load_maps() -> list[Row]:
    """Return the rows of all families."""
    return [row for family in RANGES for row in rows_of(family)]
