# Made by gqm-gen for "superellipse". Do not edit: change its declaration and generate again.
# interface 21, input fe6d2f95d843, body 59f07fe00fdb
"""Bead inside a superellipse, flat at its lowest point

F              = -1 + z**4/b**4 + x**4/a**4
dF/dx          = 4*x**3/a**4
dF/dz          = 4*z**3/b**4
d2F/dx2        = 12*x**2/a**4
d2F/dxdz       = 0
d2F/dz2        = 12*z**2/b**4
x              = x(s)
z              = z(s)
ds/ds          = 1
dx/ds          = cos(alpha(s))
dz/ds          = sin(alpha(s))
kappa          = kappa(s)
Theta          = -alpha(lam0) + alpha(s)
V**2           = 2*g*(z(lam0) - z(s)) + v0**2
N              = m*(g*cos(alpha(s)) + (2*g*(z(lam0) - z(s)) + v0**2)*kappa(s))
A              = -g*sin(alpha(s))
dt/ds          = 1/sqrt(2*g*(z(lam0) - z(s)) + v0**2)
turning points : 2*g*(z(lam0) - z(s)) + v0**2 = 0
liftoff        : g*cos(alpha(s)) + (2*g*(z(lam0) - z(s)) + v0**2)*kappa(s) = 0

On F = 0 arc length is 0 at (0, -b) and grows along (-F_z, F_x)/|grad F|; kappa = (F_xx*F_z**2 - 2*F_xz*F_x*F_z + F_zz*F_x**2)/|grad F|**3.
"""

from typing import TYPE_CHECKING, Any

from numba import carray

from gqm_sym.runtime import compiler

# Before anything else is asked of the runtime, so that another version of it is told from a broken one.
compiled = compiler(__file__, interface=21)

from gqm_sym.runtime.vocabulary import (
    BOUNDS, EFFECTIVE_POTENTIAL, FIELD, PATH_AND_CONTACT_FORCE, POTENTIAL_DIVDIFF1, POTENTIAL_DIVDIFF2, SEPARATED_TERMS,
    CompiledFunctions, CompiledModel, ExactPotential, Pass1, SeparatedTerms, Traced, chart_differences, chart_of,
    chart_rows, cos, divdiff2_chart_z, ichart_alpha, iconst, imul, isin, place_from_ends, sin,
)

if TYPE_CHECKING:
    from gqm_sym.runtime import Equilibrium, Motion, Sweep

# The run-time parameters and their defaults; pass1, solve, sweep and equilibria take them by keyword.
PARAMETERS = {'a': '1.4', 'b': '0.9', 'g': '9.81', 'm': '1'}


@compiled(PATH_AND_CONTACT_FORCE)
def path_and_contact_force(n, places, speeds, p, out):
    """x, z, ds/ds, curvature kappa, contact force N = m*(kappa*V**2 + n0), given V**2 (paper, eqs. 8, 15)."""
    chart = chart_of(p, 4)
    places, speeds, p, out = carray(places, n), carray(speeds, n), carray(p, 4), carray(out, (5, n))
    g, m = p[2], p[3]
    chart_rows(chart, (0, 1, 2, 3), places, out)
    for i in range(n):
        _chart_x, _chart_z, _chart_alpha, _t0, v2 = out[1, i], out[2, i], out[3, i], out[4, i], speeds[i]
        out[0, i] = _chart_x
        out[1, i] = _chart_z
        out[2, i] = 1
        out[3, i] = _t0
        out[4, i] = m*(_t0*v2 + g*cos(_chart_alpha))


@compiled(EFFECTIVE_POTENTIAL)
def effective_potential(n, places, p, out):
    """U per unit mass, V**2 = v0**2 - 2*(U(s) - U(lam0)), and dU/ds (paper, eq. 13)."""
    chart = chart_of(p, 4)
    places, p, out = carray(places, n), carray(p, 4), carray(out, (2, n))
    g = p[2]
    chart_rows(chart, (1, 2), places, out)
    for i in range(n):
        _chart_z, _chart_alpha = out[0, i], out[1, i]
        out[0, i] = _chart_z*g
        out[1, i] = g*sin(_chart_alpha)


@compiled(POTENTIAL_DIVDIFF1)
def potential_divdiff1(n, _a, places, offsets, p, out):
    """U[a, s] = (U(s) - U(a))/(s - a) without cancellation, and ds/ds (MATHS, s. 3)."""
    chart = chart_of(p, 4)
    places, offsets, p, out = carray(places, n), carray(offsets, n), carray(p, 4), carray(out, (2, n))
    g = p[2]
    chart_differences(chart, (1,), _a, places, offsets, out)
    for i in range(n):
        _divdiff1_chart_z = out[1, i]
        out[0, i] = _divdiff1_chart_z*g
        out[1, i] = 1


@compiled(POTENTIAL_DIVDIFF2)
def potential_divdiff2(n, _a, _b, left, right, p, out):
    """U[a, s, b] = V**2/(2*(s - a)*(b - s)) from turn a to turn b, and ds/ds (MATHS, s. 3)."""
    chart = chart_of(p, 4)
    left, right, p, out = carray(left, n), carray(right, n), carray(p, 4), carray(out, (2, n))
    g = p[2]
    for i in range(n):
        da, db = left[i], right[i]
        s = place_from_ends(_a, _b, da, db)
        out[0, i] = g*divdiff2_chart_z(chart, _a, s, _b, da, db)
        out[1, i] = 1


@compiled(FIELD)
def field(n, xs, zs, p, out):
    """F, F_x, F_z, F_xx, F_xz and F_zz: the curve is F(x, z) = 0 (paper, eq. 36)."""
    xs, zs, p, out = carray(xs, n), carray(zs, n), carray(p, 4), carray(out, (6, n))
    a, b = p[0], p[1]
    _t0 = 1/a**4
    _t1 = 1/b**4
    for i in range(n):
        x, z = xs[i], zs[i]
        out[0, i] = _t0*x**4 + _t1*z**4 - 1
        out[1, i] = 4*_t0*x**3
        out[2, i] = 4*_t1*z**3
        out[3, i] = 12*_t0*x**2
        out[4, i] = 0
        out[5, i] = 12*_t1*z**2


@compiled(BOUNDS)
def bounds(lo, hi, p, out):
    """Bounds of dU/ds and ds/ds for lo <= s <= hi, by interval arithmetic."""
    chart = chart_of(p, 4)
    p, out = carray(p, 4), carray(out, 4)
    s = (lo, hi)
    g = (p[2], p[2])
    out[0], out[1] = imul(g, isin(ichart_alpha(chart, s)))
    out[2], out[3] = iconst(1.0)


# The same formulas over a namespace of operations, for extended precision.

def exact_effective_potential(op, x, z, p):
    """U, so that V**2 + 2*U is constant, and its derivatives with respect to x and z (paper, eq. 13)."""
    g = p[2]
    return g*z, 0, g

def exact_start(op, p):
    """Coordinates of the start point."""
    b = p[1]
    return 0, -b

def exact_level(op, x, z, p):
    """F, F_x and F_z."""
    a, b = p[0], p[1]
    _t0 = 1/a**4
    _t1 = 1/b**4
    return _t0*x**4 + _t1*z**4 - 1, 4*_t0*x**3, 4*_t1*z**3

def exact_factors(op, p):
    """Factors of the parts of U, then of the parts of n0."""
    g = p[2]
    return g, g

def exact_parts(op, x, z, p):
    """Parts of U, by coordinates."""
    return z


def pass1(lam: Any = None, lam0: Any = None, v0: Any = 0.0, direction: int = 1, *, out: Any = None, a: Any = '1.4', b: Any = '0.9', g: Any = '9.81', m: Any = '1', **unknown: Any) -> Pass1:
    """Position, metric, curvature, V**2 and contact force at places of the curve (Pass 1, no quadrature).

    Parameters
    ----------
    lam : array_like
        Places on the curve, as values of its parameter s.
    lam0, v0, direction
        Launch place, speed and direction (+1 or -1: the sign of ds/dt).
    out : Pass1, optional
        The result of a call before, or six arrays like it, to be filled again.

    Returns
    -------
    Pass1
        Arrays x, z, ds, kappa, v2 and normal_force.
    """
    return MODEL.pass1((lam0, v0, direction), (a, b, g, m), lam, out, unknown)


def solve(
    lam0: Any = None, v0: Any = 0.0, direction: int = 1, *, point: Any = None, t_max: Any = None,
    contact: str = "bilateral", a: Any = '1.4', b: Any = '0.9', g: Any = '9.81', m: Any = '1', **unknown: Any,
) -> "Motion":
    """The motion that a launch begins (Passes 1 to 3).

    Parameters
    ----------
    lam0, v0, direction
        Launch place, speed (never negative) and direction (+1 or -1: the sign of ds/dt).
    point : pair of numbers, optional
        The launch place by its coordinates, instead of ``lam0``.
    t_max : number, optional
        Horizon of time.
    contact : {"bilateral", "above", "below"}
        Which side of the track can push.

    Raises
    ------
    GQMError
        For a launch or a parameter that cannot be; the message says what would be right.
    """
    return MODEL.solve((lam0, v0, direction, point, t_max, contact), (a, b, g, m), unknown)


def sweep(
    quantity: Any = None, lam0: Any = None, v0: Any = 0.0, direction: Any = 1, *, lam: Any = None, t_max: Any = None,
    contact: str = "bilateral", gradient: Any = None, client: Any = None, a: Any = '1.4', b: Any = '0.9',
    g: Any = '9.81', m: Any = '1', **unknown: Any,
) -> "Sweep":
    """One quantity over arrays of launches and parameters, on all cores; all arguments broadcast.

    Parameters
    ----------
    quantity : str
        "half_period", "period", "turning_points" (the lower, the upper: one more axis), "v_min", "v_max",
        "normal_force_min", "normal_force_max", "time_at", "t_end" or "rest_position".
    lam0, v0, direction
        Launch places, speeds and directions.
    lam
        For "time_at": the place, of which the first time there is asked.
    t_max, contact
        One for all launches, as of ``solve``.
    gradient : str or sequence of str, optional
        What derivatives of the quantity are by: run-time parameters, "lam0" and "v0".
    client : distributed.Client, optional
        A Dask cluster to do the work, with the same results.

    Returns
    -------
    Sweep
        ``values``, NaN where there is none; ``status``, 0 where there is one, and ``route``, how each was found.
        ``status_counts()`` counts the launches without a value. ``gradient``, if asked for, has one more axis.
    """
    launches = (lam0, v0, direction, None, t_max, contact)
    return MODEL.sweep(quantity, launches, (a, b, g, m), lam=lam, client=client, gradient=gradient, unknown=unknown)


def equilibria(*, between: Any = None, a: Any = '1.4', b: Any = '0.9', g: Any = '9.81', m: Any = '1', **unknown: Any) -> "tuple[Equilibrium, ...]":
    """Where a body at rest stays, whether it is stable there, and the frequency of small oscillations.

    Parameters
    ----------
    between : pair of numbers, optional
        The range of s to look in: the whole domain, or one period, if not given.

    Returns
    -------
    tuple of Equilibrium
        Each with lam, stable and frequency (rad/s).
    """
    return MODEL.equilibria((a, b, g, m), between, unknown)


# ---- The same formulas once more, only for speed: a load map in one call, and many orbits at once for sweeps. ----


@compiled(SEPARATED_TERMS)
def separated_terms(n, _a, places, offsets, p, out):
    """Parts of U[a, s] and of n0, whose factors are `exact_factors`; between them ds/ds and kappa."""
    chart = chart_of(p, 4)
    places, offsets, p, out = carray(places, n), carray(offsets, n), carray(p, 4), carray(out, (4, n))
    chart_rows(chart, (2, 3), places, out[:3])
    chart_differences(chart, (1,), _a, places, offsets, out)
    for i in range(n):
        _chart_alpha, _chart_kappa, _divdiff1_chart_z = out[1, i], out[2, i], out[3, i]
        out[0, i] = _divdiff1_chart_z
        out[1, i] = 1
        out[2, i] = _chart_kappa
        out[3, i] = cos(_chart_alpha)


CHART = Traced(field=field.address, start=exact_start, tangent=1, level=exact_level, shaped_by=(0, 1))


MODEL = CompiledModel(
    name='superellipse', parameter='s', parameters=PARAMETERS, positive=(), source=__file__,
    units={'a': 'm', 'b': 'm', 'g': 'm/s**2', 'm': 'kg', 's': 'm'},
    functions=CompiledFunctions(
        path_and_contact_force, effective_potential, potential_divdiff1, potential_divdiff2, bounds,
    ),
    chart=CHART,
    separated=SeparatedTerms(separated_terms, exact_factors, potentials=1, loads=1, held=(), parts=exact_parts),
    exact=ExactPotential(
        exact_effective_potential,
    ),
)
