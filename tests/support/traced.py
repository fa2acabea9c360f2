"""Tests trace charts of implicit curves from functions that are written out here."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import sympy as sp
from mpmath import mp, mpf
from naive import error
from numba import carray

from gqm_sym.runtime import compiler
from gqm_sym.runtime.charts.chart import Chart
from gqm_sym.runtime.charts.tracing import Traced
from gqm_sym.runtime.interface import FIELD, INTERFACE

# The tolerance relative to the curve's extent. Worst measured: 4e-16 if F is computed without cancellation.
ROUNDING = 1e-15

DEGREE = 6


compiled = compiler(__file__, interface=INTERFACE)


@compiled(FIELD)
def _polynomial(n, xs, zs, p, out):
    """Return F = sum of p[j, k] x**j z**k and its derivatives."""
    xs, zs, p, out = carray(xs, n), carray(zs, n), carray(p, (DEGREE + 1, DEGREE + 1)), carray(out, (6, n))
    for i in range(n):
        x, z = xs[i], zs[i]
        f = fx = fz = fxx = fxz = fzz = 0.0
        for j in range(DEGREE + 1):
            for k in range(DEGREE + 1):
                c = p[j, k]
                if c == 0.0:
                    continue
                f += c * x**j * z**k
                if j > 0:
                    fx += c * j * x ** (j - 1) * z**k
                if k > 0:
                    fz += c * k * x**j * z ** (k - 1)
                if j > 1:
                    fxx += c * j * (j - 1) * x ** (j - 2) * z**k
                if k > 1:
                    fzz += c * k * (k - 1) * x**j * z ** (k - 2)
                if j > 0 and k > 0:
                    fxz += c * j * k * x ** (j - 1) * z ** (k - 1)
        out[0, i], out[1, i], out[2, i], out[3, i], out[4, i], out[5, i] = f, fx, fz, fxx, fxz, fzz


SQUARE, BEND, ROOT, WAVE, WALLS = range(5)


@compiled(FIELD)
def _other(n, xs, zs, p, out):
    """Return |x| + |z| - 1, z - x|x|, z - sqrt(x), z - sin(x) or exp(z) - cosh(x), by the number p[0]."""
    xs, zs, p, out = carray(xs, n), carray(zs, n), carray(p, 1), carray(out, (6, n))
    for i in range(n):
        x, z, which = xs[i], zs[i], int(p[0])
        fx, fz, fxx, fzz = 0.0, 1.0, 0.0, 0.0
        if which == 0:
            f, fx, fz = abs(x) + abs(z) - 1.0, math.copysign(1.0, x), math.copysign(1.0, z)
        elif which == 1:
            f, fx, fxx = z - x * abs(x), -2.0 * abs(x), -2.0 * math.copysign(1.0, x)
        elif which == 2:
            f, fx, fxx = z - math.sqrt(x), -0.5 / math.sqrt(x), 0.25 * x**-1.5
        elif which == 3:
            f, fx, fxx = z - math.sin(x), -math.cos(x), math.sin(x)
        else:
            f, fx, fz, fxx, fzz = math.exp(z) - math.cosh(x), -math.sinh(x), math.exp(z), -math.cosh(x), math.exp(z)
        out[0, i], out[1, i], out[2, i], out[3, i], out[4, i], out[5, i] = f, fx, fz, fxx, 0.0, fzz


def trace(
    text: str,
    start: tuple[float, float],
    *,
    tangent: int = 1,
    domain: tuple[float | None, float | None] = (None, None),
    given: dict[str, Any] | None = None,
) -> Chart:
    """Return the chart of a polynomial's curve."""
    x, z = sp.symbols("x z")
    polynomial = sp.Poly(sp.sympify(text, rational=True).subs(given or {}), x, z)
    coefficients = np.zeros((DEGREE + 1, DEGREE + 1))
    for (j, k), value in polynomial.terms():
        coefficients[j, k] = float(value)
    return _maker(_polynomial, start, tangent, domain).chart(tuple(coefficients.ravel()))


def other(which: int, start: tuple[float, float], domain: tuple[float | None, float | None] = (None, None)) -> Chart:
    """Return the chart of a curve that is no polynomial's."""
    return _maker(_other, start, 1, domain).chart((float(which),))


def _maker(field: Any, start: tuple[float, float], tangent: int, domain: tuple[float | None, float | None]) -> Traced:
    return Traced(
        field=field.address,
        start=lambda op, p: start,
        tangent=tangent,
        level=lambda op, x, z, p: None,  # charts do without extended precision
        domain=lambda op, p: domain,
    )


def hold(chart: Chart, places: Any, truth: Callable[[int], tuple[Any, ...]], within: float = ROUNDING) -> None:
    """Check x, z, alpha (up to whole turns) and kappa against true values, x and z relative to their extent, kappa to
    its largest value.
    """
    rows = chart.points(places)
    wanted = [truth(k) for k in range(len(places))]
    extent = max(max(float(w[i]) for w in wanted) - min(float(w[i]) for w in wanted) for i in (0, 1))
    sharpest = max(abs(float(w[3])) for w in wanted)
    for k, (x, z, alpha, kappa) in enumerate(wanted):
        assert error(rows[0, k], x) <= within * extent
        assert error(rows[1, k], z) <= within * extent
        with mp.workdps(40):
            turns = mp.nint((mpf(float(rows[2, k])) - alpha) / (2 * mp.pi))
            assert abs(mpf(float(rows[2, k])) - alpha - 2 * mp.pi * turns) <= 4 * within
        assert error(rows[3, k], kappa) <= 10 * within * sharpest
