# Made by gqm-gen for "b_rail_rolling_radius". Do not edit: change its declaration and generate again.
# interface 10, input d541812c6383, body 745fe8691d9a
"""b_rail_rolling_radius

x              = -rho*sin(alpha(s)) + x(s)
z              = rho*cos(alpha(s)) + z(s)
ds/ds          = -rho*kappa(s) + 1
dx/ds          = cos(alpha(s))
dz/ds          = sin(alpha(s))
kappa          = kappa(s)/(-rho*kappa(s) + 1)
Theta          = -alpha(lam0) + alpha(s)
V**2           = 2*g*(rho*cos(alpha(lam0)) - rho*cos(alpha(s)) + z(lam0) - z(s))/(beta + 1) + v0**2
N              = m*(g*cos(alpha(s)) + (2*g*(rho*cos(alpha(lam0)) - rho*cos(alpha(s)) + z(lam0) - z(s))/(beta + 1) + v0**2)*kappa(s)/(-rho*kappa(s) + 1))
A              = -g*sin(alpha(s))/(beta + 1)
dt/ds          = (-rho*kappa(s) + 1)/sqrt(2*g*(rho*cos(alpha(lam0)) - rho*cos(alpha(s)) + z(lam0) - z(s))/(beta + 1) + v0**2)
turning points : 2*g*(rho*cos(alpha(lam0)) - rho*cos(alpha(s)) + z(lam0) - z(s))/(beta + 1) + v0**2 = 0
liftoff        : g*cos(alpha(s)) + (2*g*(rho*cos(alpha(lam0)) - rho*cos(alpha(s)) + z(lam0) - z(s))/(beta + 1) + v0**2)*kappa(s)/(-rho*kappa(s) + 1) = 0
"""

from typing import TYPE_CHECKING, Any

from numba import carray

from gqm_sym.runtime import compiler

# Before anything else is asked of the runtime, so that another version of it is told from a broken one.
compiled = compiler(__file__, interface=10)

from gqm_sym.runtime.vocabulary import (
    BOUNDS, EFFECTIVE_POTENTIAL, PATH_AND_CONTACT_FORCE, POTENTIAL_DIVDIFF1, POTENTIAL_DIVDIFF2, SEPARATED_TERMS,
    CompiledFunctions, CompiledModel, LaunchRequest, Pass1, Rail, SeparatedTerms, chart_alpha, chart_kappa, chart_of,
    chart_rows, chart_z, cos, divdiff1_chart_alpha, divdiff1_chart_z, divdiff1_cos, divdiff2_chart_alpha,
    divdiff2_chart_z, divdiff2_cos, iadd, ichart_alpha, ichart_kappa, iconst, idiv, imul, isin, place_from_ends, sin,
)

if TYPE_CHECKING:
    from gqm_sym.runtime import Equilibrium, Motion, Sweep

# The run-time parameters and their defaults; pass1, solve, sweep and equilibria take them by keyword.
PARAMETERS = {'beta': None, 'rho': None, 'g': '9.81', 'm': '1'}


@compiled(PATH_AND_CONTACT_FORCE)
def path_and_contact_force(n, places, speeds, p, out):
    """x, z, ds/ds, curvature kappa, contact force N = m*(kappa*V**2 + n0), given V**2 (paper, eqs. 8, 15)."""
    chart = chart_of(p, 4)
    places, speeds, p, out = carray(places, n), carray(speeds, n), carray(p, 4), carray(out, (5, n))
    rho, g, m = p[1], p[2], p[3]
    chart_rows(chart, (0, 1, 2, 3), places, out)
    for i in range(n):
        _chart_x, _chart_z, _t0, _t2, v2 = out[1, i], out[2, i], out[3, i], out[4, i], speeds[i]
        _t1 = cos(_t0)
        _t3 = -_t2*rho + 1
        _t4 = _t2/_t3
        out[0, i] = _chart_x - rho*sin(_t0)
        out[1, i] = _chart_z + _t1*rho
        out[2, i] = _t3
        out[3, i] = _t4
        out[4, i] = m*(_t1*g + _t4*v2)


@compiled(EFFECTIVE_POTENTIAL)
def effective_potential(n, places, p, out):
    """U per unit mass, V**2 = v0**2 - 2*(U(s) - U(lam0)), and dU/ds (paper, eq. 13)."""
    chart = chart_of(p, 4)
    places, p, out = carray(places, n), carray(p, 4), carray(out, (2, n))
    beta, rho, g = p[0], p[1], p[2]
    _t1 = g/(beta + 1)
    for i in range(n):
        s = places[i]
        _t0 = chart_alpha(chart, s)
        out[0, i] = _t1*(rho*cos(_t0) + chart_z(chart, s))
        out[1, i] = _t1*(-rho*chart_kappa(chart, s) + 1)*sin(_t0)


@compiled(POTENTIAL_DIVDIFF1)
def potential_divdiff1(n, a, places, offsets, p, out):
    """U[a, s] = (U(s) - U(a))/(s - a) without cancellation, and ds/ds (MATHS, s. 3)."""
    chart = chart_of(p, 4)
    places, offsets, p, out = carray(places, n), carray(offsets, n), carray(p, 4), carray(out, (2, n))
    beta, rho, g = p[0], p[1], p[2]
    _c0 = chart_alpha(chart, a)
    chart_rows(chart, (2, 3), places, out)
    for i in range(n):
        _chart_alpha, _chart_kappa, s, d = out[0, i], out[1, i], places[i], offsets[i]
        _t0 = divdiff1_chart_alpha(chart, a, s, d)
        out[0, i] = g*(_t0*rho*divdiff1_cos(_c0, _chart_alpha, _t0*d) + divdiff1_chart_z(chart, a, s, d))/(beta + 1)
        out[1, i] = -_chart_kappa*rho + 1


@compiled(POTENTIAL_DIVDIFF2)
def potential_divdiff2(n, a, b, left, right, p, out):
    """U[a, s, b] = V**2/(2*(s - a)*(b - s)) from turn a to turn b, and ds/ds (MATHS, s. 3)."""
    chart = chart_of(p, 4)
    left, right, p, out = carray(left, n), carray(right, n), carray(p, 4), carray(out, (2, n))
    beta, rho, g = p[0], p[1], p[2]
    _c0 = chart_alpha(chart, a)
    _c1 = chart_alpha(chart, b)
    _c2 = divdiff1_chart_alpha(chart, a, b, -a + b)
    for i in range(n):
        da, db = left[i], right[i]
        s = place_from_ends(a, b, da, db)
        _t0 = chart_alpha(chart, s)
        _t1 = db*divdiff1_chart_alpha(chart, s, b, db)
        _t2 = divdiff1_chart_alpha(chart, a, s, da)
        out[0, i] = g*(rho*(_c2*_t2*divdiff2_cos(_c0, _t0, _c1, _t2*da, _t1) + divdiff1_cos(_t0, _c1, _t1)*divdiff2_chart_alpha(chart, a, s, b, da, db)) + divdiff2_chart_z(chart, a, s, b, da, db))/(beta + 1)
        out[1, i] = -rho*chart_kappa(chart, s) + 1


@compiled(BOUNDS)
def bounds(lo, hi, p, out):
    """Bounds of dU/ds and ds/ds for lo <= s <= hi, by interval arithmetic."""
    chart = chart_of(p, 4)
    p, out = carray(p, 4), carray(out, 4)
    s = (lo, hi)
    beta, rho, g = (p[0], p[0]), (p[1], p[1]), (p[2], p[2])
    _t0 = iadd(imul(imul(iconst(-1.0), rho), ichart_kappa(chart, s)), iconst(1.0))
    out[0], out[1] = imul(imul(imul(_t0, g), idiv(iconst(1.0), iadd(beta, iconst(1.0)))), isin(ichart_alpha(chart, s)))
    out[2], out[3] = _t0


# The same formulas over a namespace of operations, for extended precision.

def exact_inertia(op, p):
    """1 + beta, so that the kinetic energy is m*(1 + beta)*V**2/2, and the potential energy m*(1 + beta)*U."""
    beta = p[0]
    return beta + 1

def exact_rail(op, p):
    """The start of the rail, then the numbers of each piece."""
    _t0 = op.pi/2
    return -5, 4, -_t0, 1, 3, _t0, 4, 3, _t0, 1

def exact_factors(op, p):
    """What stands before the parts of U, then before those of n0."""
    beta, g = p[0], p[2]
    return g/(beta + 1), g


def pass1(lam: Any, lam0: Any, v0: Any = 0.0, direction: int = 1, *, out: Any = None, beta: Any = None, rho: Any = None, g: Any = '9.81', m: Any = '1', **unknown: Any) -> Pass1:
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
    return MODEL.pass1(LaunchRequest(lam0, v0, direction), (beta, rho, g, m), lam, out, unknown)


def solve(
    lam0: Any = None, v0: Any = 0.0, direction: int = 1, *, point: Any = None, t_max: Any = None,
    contact: str = "bilateral", beta: Any = None, rho: Any = None, g: Any = '9.81', m: Any = '1', **unknown: Any,
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

    Returns
    -------
    Motion

    Raises
    ------
    GQMError
        For a launch or a parameter that cannot be; the message says what would be right.
    """
    return MODEL.solve(LaunchRequest(lam0, v0, direction, point, t_max, contact), (beta, rho, g, m), unknown)


def sweep(
    quantity: str, lam0: Any, v0: Any = 0.0, direction: Any = 1, *, lam: Any = None, t_max: Any = None,
    contact: str = "bilateral", gradient: Any = None, client: Any = None, beta: Any = None, rho: Any = None,
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
    launches = LaunchRequest(lam0, v0, direction, None, t_max, contact)
    return MODEL.sweep(quantity, launches, (beta, rho, g, m), lam=lam, client=client, gradient=gradient, unknown=unknown)


def equilibria(*, between: Any = None, beta: Any = None, rho: Any = None, g: Any = '9.81', m: Any = '1', **unknown: Any) -> "tuple[Equilibrium, ...]":
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
    return MODEL.equilibria((beta, rho, g, m), between, unknown)


# ---- The same formulas once more, only for speed: a load map in one call, and many orbits at once for sweeps. ----


@compiled(SEPARATED_TERMS)
def separated_terms(n, a, places, offsets, p, out):
    """Parts of U[a, s] and of n0, whose factors are `exact_factors`; between them ds/ds and kappa."""
    chart = chart_of(p, 4)
    places, offsets, p, out = carray(places, n), carray(offsets, n), carray(p, 4), carray(out, (4, n))
    rho = p[1]
    _c0 = chart_alpha(chart, a)
    chart_rows(chart, (2, 3), places, out)
    for i in range(n):
        _t1, _t2, s, d = out[2, i], out[3, i], places[i], offsets[i]
        _t0 = divdiff1_chart_alpha(chart, a, s, d)
        _t3 = -_t2*rho + 1
        out[0, i] = _t0*rho*divdiff1_cos(_c0, _t1, _t0*d) + divdiff1_chart_z(chart, a, s, d)
        out[1, i] = _t3
        out[2, i] = _t2/_t3
        out[3, i] = cos(_t1)


CHART = Rail(
    numbers=exact_rail,
    placed=True,
    pieces=('line', 'arc', 'line', 'arc', 'line'),
    shaped_by=(),
)


MODEL = CompiledModel(
    name='b_rail_rolling_radius', parameter='s', parameters=PARAMETERS, positive=(),
    source=__file__,
    units={'beta': '1', 'g': 'm/s**2', 'm': 'kg', 'rho': 'm', 's': 'm'},
    at_least=(('beta', '0'),),
    rolling_radius='rho',
    functions=CompiledFunctions(
        path_and_contact_force, effective_potential, potential_divdiff1, potential_divdiff2, bounds,
    ),
    inertia=exact_inertia,
    chart=CHART,
    separated=SeparatedTerms(separated_terms, exact_factors, potentials=1, loads=1, held=(1,)),
)
