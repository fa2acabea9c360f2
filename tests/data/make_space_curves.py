"""Make ``space_curves.json``, which has motions on twelve space curves, with true values to 40 digits.

Run as ``python tests/data/make_space_curves.py`` (a minute). Times are integrals of ds/dlam over V, by the midpoint
rule in an angle in which the integrand is smooth and periodic, and by Gauss-Legendre quadrature as a check; the contact
force is m*(acceleration) less the applied force, by coordinates. All is computed with 120 digits from exact inputs.
Nothing here imports ``gqm_sym``.
"""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import sympy as sp
from mpmath import mp, mpf

mp.dps = 120
G, DIGITS = sp.Rational(981, 100), 40
Row = dict[str, Any]

# A row has the name; x, y, z; the potential per unit mass; the place and speed of launch. The two of LAPS are closed,
# with laps of 2*pi.
CURVES: tuple[tuple[str, tuple[str, str, str], str, tuple[str, str]], ...] = (
    ("viviani", ("1 + cos(u)", "sin(u)", "2*sin(u/2)"), "g*z", ("3/10", "0")),
    ("trefoil", ("(2 + 3*cos(3*u)/4)*cos(2*u)", "(2 + 3*cos(3*u)/4)*sin(2*u)", "3*sin(3*u)/4"), "g*z", ("1/5", "1/2")),
    ("torus_knot", ("(3 + cos(2*u))*cos(3*u)", "(3 + cos(2*u))*sin(3*u)", "sin(2*u)"), "g*z", ("1/10", "13/2")),
    ("lying_helix", ("3*u/10", "cos(u)", "sin(u)"), "g*z", ("-1/2", "2")),
    ("saddle", ("cos(u)", "sin(u)", "cos(2*u)/2"), "g*z", ("1", "3/2")),
    ("saddle_lap", ("cos(u)", "sin(u)", "cos(2*u)/2"), "g*z", ("1", "5")),
    ("tilted_ring", ("5*cos(u)/4", "3*sin(u)/4", "sin(u)"), "g*z", ("-1/2", "1")),
    ("twisted_cubic", ("u", "u**3/3", "u**2/2"), "g*z", ("4/5", "1/3")),
    ("bowl_spiral", ("u*cos(4*u)", "u*sin(4*u)", "u**2"), "g*z", ("-9/10", "1")),
    ("catenary_weave", ("u", "sin(3*u)/3", "cosh(u)"), "g*z", ("1", "2")),
    ("sprung_helix", ("cos(u)", "sin(u)", "u/2"), "g*z + 3*((x - 1)**2 + 2*y**2 + z**2)", ("1/2", "1/2")),
    ("knot_and_centre", ("2*cos(u)", "sin(u)", "sin(2*u)/2"), "-5/sqrt((x - 1)**2 + y**2 + z**2)", ("1", "1")),
)
LAPS = ("torus_knot", "saddle_lap")


def text(value: mpf) -> str:
    """Return a number with forty digits."""
    return str(mp.nstr(value, DIGITS, min_fixed=-5, max_fixed=8))


def midpoints(function: Callable[[mpf], mpf], width: mpf) -> mpf:
    """Return the mean of a periodic function times ``width``, by midpoint rules with more and more nodes."""
    n, before = 64, mpf(0)
    while True:
        found = width * mp.fsum(function(width * (2 * k + 1) / (2 * n)) for k in range(n)) / n
        if abs(found - before) < mpf(10) ** -45 * abs(found):
            return found
        n, before = 2 * n, found


def panels(function: Callable[[mpf], mpf], width: mpf) -> mpf:
    """Return the same integral by panels."""
    return mp.quad(function, mp.linspace(0, width, 65), method="gauss-legendre")


def first_zero(function: Callable[[mpf], mpf], start: mpf, direction: int) -> mpf:
    """Return the first zero of a function that is positive next to a start, or the start itself if it is negative
    there.
    """
    step = mpf(direction) / 100
    if function(start + step / 10**6) < 0:
        return start
    while function(start + step) > 0:
        start += step
    return mp.findroot(function, (start, start + step), solver="anderson", tol=mpf(10) ** -200, verify=False)


def row(name: str, curve: tuple[str, str, str], potential: str, launch: tuple[str, str]) -> Row:
    """Return one case."""
    u, x, y, z = sp.symbols("u x y z", real=True)
    names = {"u": u, "x": x, "y": y, "z": z, "g": G}
    place = [sp.sympify(form, names) for form in curve]
    field = sp.sympify(potential, names)
    there = dict(zip((x, y, z), place, strict=True))
    level = field.subs(there, simultaneous=True)
    first, second = ([sp.diff(form, u, order) for form in place] for order in (1, 2))
    square = sum(part**2 for part in first)
    call = {
        key: sp.lambdify(u, form, "mpmath")
        for key, form in {
            "ds": sp.sqrt(square),
            "level": level,
            "square": square,
            "square_slope": sp.diff(square, u),
            "level_slope": sp.diff(level, u),
            "first": first,
            "second": second,
            "pull": [sp.diff(field, axis).subs(there, simultaneous=True) for axis in (x, y, z)],
        }.items()
    }
    lam0, v0 = (mpf(sp.Rational(number).p) / sp.Rational(number).q for number in launch)
    energy = v0**2 / 2 + call["level"](lam0)

    def v2(at: mpf) -> mpf:
        return 2 * (energy - call["level"](at))

    if name in LAPS:
        lap = 2 * mp.pi
        period = midpoints(lambda at: call["ds"](at) / mp.sqrt(v2(at)), lap)
        expected: Row = {"kind": "circulation", "period": text(period)}
        check = panels(lambda at: call["ds"](at) / mp.sqrt(v2(at)), lap)
        places, found = [lam0 + lap * k / 7 for k in range(3)], period
    else:
        exactly = [first_zero(v2, lam0, direction) for direction in (-1, 1)]
        assert all(abs(v2(end)) < mpf(10) ** -90 for end in exactly), name
        low, high = sorted(exactly)

        def rate(angle: mpf) -> mpf:
            at = (low + high) / 2 - (high - low) / 2 * mp.cos(angle)
            return call["ds"](at) * (high - low) / 2 * mp.sin(angle) / mp.sqrt(v2(at))

        found, check = midpoints(rate, mp.pi), panels(rate, mp.pi)
        expected = {"kind": "libration", "half_period": text(found), "turning_points": [text(low), text(high)]}
        places = [low + (high - low) * share / 10 for share in (1, 4, 8)]
    assert abs(found - check) < mpf(10) ** -42 * found, name

    def contact(at: mpf) -> Row:
        # r'' lam'**2 + r' lam'' is the acceleration; from half of square*lam'**2 + level comes lam''.
        square_here, rate_squared = call["square"](at), v2(at) / call["square"](at)
        bend = -(call["level_slope"](at) + call["square_slope"](at) * rate_squared / 2) / square_here
        parts = zip(call["first"](at), call["second"](at), call["pull"](at), strict=True)
        force = [second * rate_squared + first * bend + pull for first, second, pull in parts]
        return {"lam": text(at), "v2": text(v2(at)), "force": [text(mpf(part)) for part in force]}

    expected["places"] = [contact(mpf(text(at))) for at in places]
    given = {"lam0": launch[0], "v0": launch[1]}
    return {"name": name, "curve": curve, "potential": potential, "launch": given, "expected": expected}


if __name__ == "__main__":
    path = Path(__file__).with_suffix("").with_name("space_curves.json")
    path.write_text(json.dumps([row(*curve) for curve in CURVES], indent=1) + "\n", encoding="utf-8")
