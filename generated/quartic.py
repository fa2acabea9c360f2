# Made by gqm-gen for "quartic". Do not edit: change its declaration and generate again.
# interface 21, input 79764b04feb4, body 6b8c8cfb6cb2
"""Bead in a quartic bowl

x              = x
z              = x**4
ds/dx          = sqrt(16*x**6 + 1)
dx/ds          = 1/sqrt(16*x**6 + 1)
dz/ds          = 4*x**3/sqrt(16*x**6 + 1)
kappa          = 12*x**2/(16*x**6 + 1)**(3/2)
Theta          = -atan(4*lam0**3) + atan(4*x**3)
V**2           = 2*g*(lam0**4 - x**4) + v0**2
N              = m*(g/sqrt(16*x**6 + 1) + 12*x**2*(2*g*(lam0**4 - x**4) + v0**2)/(16*x**6 + 1)**(3/2))
A              = -4*g*x**3/sqrt(16*x**6 + 1)
dt/dx          = sqrt(16*x**6 + 1)/sqrt(2*g*(lam0**4 - x**4) + v0**2)
turning points : 2*g*(lam0**4 - x**4) + v0**2 = 0
liftoff        : g/sqrt(16*x**6 + 1) + 12*x**2*(2*g*(lam0**4 - x**4) + v0**2)/(16*x**6 + 1)**(3/2) = 0
"""

from math import fabs, sqrt
from typing import TYPE_CHECKING, Any

from numba import carray

from gqm_sym.runtime import compiler

# Before anything else is asked of the runtime, so that another version of it is told from a broken one.
compiled = compiler(__file__, interface=21)

from gqm_sym.runtime.vocabulary import (
    BOUNDS, BOUNDS_BATCH, EFFECTIVE_POTENTIAL, INTEGRAND_INVARIANTS_BATCH, LOAD_MAP, PATH_AND_CONTACT_FORCE,
    POTENTIAL_DIVDIFF1, POTENTIAL_DIVDIFF1_BATCH, POTENTIAL_DIVDIFF2, POTENTIAL_DIVDIFF2_BATCH, TIME_INTEGRAND_BATCH,
    TURNING_POINT_BATCH, BatchFunctions, CompiledFunctions, CompiledModel, ExactFormulas, Pass1, divdiff1_ipow, iadd,
    iconst, imul, ipow, isqrt, place_from_ends, speed_squared_from_potential,
)

if TYPE_CHECKING:
    from gqm_sym.runtime import Equilibrium, Motion, Sweep

# The run-time parameters and their defaults; pass1, solve, sweep and equilibria take them by keyword.
PARAMETERS = {'g': '9.81', 'm': '1'}


@compiled(PATH_AND_CONTACT_FORCE)
def path_and_contact_force(n, places, speeds, p, out):
    """x, z, ds/dx, curvature kappa, contact force N = m*(kappa*V**2 + n0), given V**2 (paper, eqs. 8, 15)."""
    places, speeds, p, out = carray(places, n), carray(speeds, n), carray(p, 2), carray(out, (5, n))
    g, m = p[0], p[1]
    for i in range(n):
        x, v2 = places[i], speeds[i]
        _t0 = 16*x**6 + 1
        _t1 = sqrt(_t0)
        _t2 = 12*x**2/sqrt(_t0)**3
        out[0, i] = x
        out[1, i] = x**4
        out[2, i] = _t1
        out[3, i] = _t2
        out[4, i] = m*(_t2*v2 + g/_t1)


@compiled(EFFECTIVE_POTENTIAL)
def effective_potential(n, places, p, out):
    """U per unit mass, V**2 = v0**2 - 2*(U(x) - U(lam0)), and dU/dx (paper, eq. 13)."""
    places, p, out = carray(places, n), carray(p, 2), carray(out, (2, n))
    g = p[0]
    for i in range(n):
        x = places[i]
        out[0, i] = g*x**4
        out[1, i] = 4*g*x**3


@compiled(POTENTIAL_DIVDIFF1)
def potential_divdiff1(n, a, places, offsets, p, out):
    """U[a, x] = (U(x) - U(a))/(x - a) without cancellation, and ds/dx (MATHS, s. 3)."""
    places, offsets, p, out = carray(places, n), carray(offsets, n), carray(p, 2), carray(out, (2, n))
    g = p[0]
    for i in range(n):
        x, d = places[i], offsets[i]
        out[0, i] = g*divdiff1_ipow(a, x, d, 4)
        out[1, i] = sqrt(16*x**6 + 1)


@compiled(POTENTIAL_DIVDIFF2)
def potential_divdiff2(n, a, b, left, right, p, out):
    """U[a, x, b] = V**2/(2*(x - a)*(b - x)) from turn a to turn b, and ds/dx (MATHS, s. 3)."""
    left, right, p, out = carray(left, n), carray(right, n), carray(p, 2), carray(out, (2, n))
    g = p[0]
    for i in range(n):
        da, db = left[i], right[i]
        x = place_from_ends(a, b, da, db)
        out[0, i] = g*(a**2 + a*b + a*x + b**2 + b*x + x**2)
        out[1, i] = sqrt(16*x**6 + 1)


@compiled(BOUNDS)
def bounds(lo, hi, p, out):
    """Bounds of dU/dx and ds/dx for lo <= x <= hi, by interval arithmetic."""
    p, out = carray(p, 2), carray(out, 4)
    x = (lo, hi)
    g = (p[0], p[0])
    out[0], out[1] = imul(imul(iconst(4.0), g), ipow(x, 3))
    out[2], out[3] = isqrt(iadd(imul(iconst(16.0), ipow(x, 6)), iconst(1.0)))


# The same formulas over a namespace of operations, for extended precision.

def exact_x(op, x, p):
    """Horizontal coordinate."""
    return x

def exact_z(op, x, p):
    """Height."""
    return x**4

def exact_ds(op, x, p):
    """ds/dx."""
    return op.sqrt(16*x**6 + 1)

def exact_kappa(op, x, p):
    """Signed curvature (paper, eq. 8)."""
    return 12*x**2/(16*x**6 + 1)**(op.mpf(3)/2)

def exact_static_normal_load(op, x, p):
    """n0 = N/m of a body at rest, so that N = m*(kappa*V**2 + n0) (paper, eq. 15)."""
    g = p[0]
    return g/op.sqrt(16*x**6 + 1)

def exact_effective_potential(op, x, p):
    """U, so that V**2 + 2*U is constant (paper, eq. 13)."""
    g = p[0]
    return g*x**4

def exact_effective_potential_slope(op, x, p):
    """dU/dx."""
    g = p[0]
    return 4*g*x**3

def exact_domain(op, p):
    """Both ends of the domain and the period; None for an open end or without a period."""
    return None, None, None

def exact_axes(op, p):
    """A place about which V**2 and ds are even, and the distance to the next (None if there is no other)."""
    return 0, None


def pass1(lam: Any = None, lam0: Any = None, v0: Any = 0.0, direction: int = 1, *, out: Any = None, g: Any = '9.81', m: Any = '1', **unknown: Any) -> Pass1:
    """Position, metric, curvature, V**2 and contact force at places of the curve (Pass 1, no quadrature).

    Parameters
    ----------
    lam : array_like
        Places on the curve, as values of its parameter x.
    lam0, v0, direction
        Launch place, speed and direction (+1 or -1: the sign of ds/dt).
    out : Pass1, optional
        The result of a call before, or six arrays like it, to be filled again.

    Returns
    -------
    Pass1
        Arrays x, z, ds, kappa, v2 and normal_force.
    """
    return MODEL.pass1((lam0, v0, direction), (g, m), lam, out, unknown)


def solve(
    lam0: Any = None, v0: Any = 0.0, direction: int = 1, *, point: Any = None, t_max: Any = None,
    contact: str = "bilateral", g: Any = '9.81', m: Any = '1', **unknown: Any,
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
    return MODEL.solve((lam0, v0, direction, point, t_max, contact), (g, m), unknown)


def sweep(
    quantity: Any = None, lam0: Any = None, v0: Any = 0.0, direction: Any = 1, *, lam: Any = None, t_max: Any = None,
    contact: str = "bilateral", gradient: Any = None, client: Any = None, g: Any = '9.81', m: Any = '1', **unknown: Any,
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
    return MODEL.sweep(quantity, launches, (g, m), lam=lam, client=client, gradient=gradient, unknown=unknown)


def equilibria(*, between: Any = None, g: Any = '9.81', m: Any = '1', **unknown: Any) -> "tuple[Equilibrium, ...]":
    """Where a body at rest stays, whether it is stable there, and the frequency of small oscillations.

    Parameters
    ----------
    between : pair of numbers, optional
        The range of x to look in: the whole domain, or one period, if not given.

    Returns
    -------
    tuple of Equilibrium
        Each with lam, stable and frequency (rad/s).
    """
    return MODEL.equilibria((g, m), between, unknown)


# ---- The same formulas once more, only for speed: a load map in one call, and many orbits at once for sweeps. ----


@compiled(LOAD_MAP)
def load_map(n, w0, level, places, p, out):
    """x, z, ds/dx, kappa, V**2 = w0 - 2*(U - level), N (paper, eqs. 8, 13, 15), size of U's terms."""
    places, p, out = carray(places, n), carray(p, 2), carray(out, (7, n))
    g, m = p[0], p[1]
    _c0 = fabs(g)
    for i in range(n):
        x = places[i]
        _t0 = x**4
        _t1 = 16*x**6 + 1
        _t2 = sqrt(_t1)
        _t3 = 12*x**2/sqrt(_t1)**3
        _t4 = speed_squared_from_potential(w0, _t0*g, level)
        out[0, i] = x
        out[1, i] = _t0
        out[2, i] = _t2
        out[3, i] = _t3
        out[4, i] = _t4
        out[5, i] = m*(_t3*_t4 + g/_t2)
        out[6, i] = _c0*_t0


@compiled(POTENTIAL_DIVDIFF1_BATCH)
def potential_divdiff1_batch(n, starts, places, offsets, p, out):
    """U[a, x], ds/dx and dU/dx."""
    starts, places, offsets, p, out = carray(starts, n), carray(places, n), carray(offsets, n), carray(p, (2, n)), carray(out, (3, n))
    for i in range(n):
        g, a, x, d = p[0, i], starts[i], places[i], offsets[i]
        out[0, i] = g*divdiff1_ipow(a, x, d, 4)
        out[1, i] = sqrt(16*x**6 + 1)
        out[2, i] = 4*g*x**3


@compiled(POTENTIAL_DIVDIFF2_BATCH)
def potential_divdiff2_batch(n, lows, highs, left, right, p, out):
    """U[a, x, b] and ds/dx; NaN where the points lie too far apart for the closed form."""
    lows, highs, left, right, p, out = carray(lows, n), carray(highs, n), carray(left, n), carray(right, n), carray(p, (2, n)), carray(out, (2, n))
    for i in range(n):
        g, a, b, da, db = p[0, i], lows[i], highs[i], left[i], right[i]
        x = place_from_ends(a, b, da, db)
        out[0, i] = g*(a**2 + a*b + a*x + b**2 + b*x + x**2)
        out[1, i] = sqrt(16*x**6 + 1)


@compiled(TIME_INTEGRAND_BATCH)
def time_integrand_batch(n, sine2, cosine2, p, out):
    """(dt/du)**2 at sine2 = sin(u)**2, and its divisor; dt/du integrates to the half period (paper, eq. 17)."""
    p, out = carray(p, (3, n)), carray(out, (2, n))
    for i in range(n):
        g, t = p[0, i], p[2, i]
        _t0 = sine2*t + t
        out[0, i] = (16*sine2**3*t**3 + 1)/(2*_t0*g)
        out[1, i] = 2*_t0*g


@compiled(INTEGRAND_INVARIANTS_BATCH)
def integrand_invariants_batch(n, halves, p, out):
    """Terms that are constant along an orbit; ``time_integrand_batch`` reads them after the parameters."""
    halves, p, out = carray(halves, (2, n)), carray(p, (2, n)), carray(out, (1, n))
    for i in range(n):
        half, rest = halves[0, i], halves[1, i]
        out[0, i] = half*(half + 2*rest)


@compiled(TURNING_POINT_BATCH)
def turning_point_batch(n, offsets, launches, p, out):
    """From V**2 at an offset: half the orbit's width (paper, eq. 14), -dV**2/dq, and a sine's square q at the turn."""
    offsets, launches, p, out = carray(offsets, n), carray(launches, n), carray(p, (2, n)), carray(out, (3, n))
    for i in range(n):
        g, offset, launch = p[0, i], offsets[i], launches[i]
        _t0 = offset**2
        _t1 = 2*_t0*g + sqrt(16*g**2*offset**4 + 8*g*launch)/2
        out[0, i] = sqrt(_t0 + launch/_t1)
        out[1, i] = _t1
        out[2, i] = 0


@compiled(BOUNDS_BATCH)
def bounds_batch(n, lo, hi, p, out):
    """Bounds of dU/dx and ds/dx for lo <= x <= hi."""
    lo, hi, p, out = carray(lo, n), carray(hi, n), carray(p, (2, n)), carray(out, (4, n))
    for i in range(n):
        x = (lo[i], hi[i])
        g = (p[0, i], p[0, i])
        out[0, i], out[1, i] = imul(imul(iconst(4.0), g), ipow(x, 3))
        out[2, i], out[3, i] = isqrt(iadd(imul(iconst(16.0), ipow(x, 6)), iconst(1.0)))


def exact_time_integrand(op, half, sine2, cosine2, p):
    """(dt/du)**2 at sine2 = sin(u)**2, and its divisor; dt/du integrates to the half period (paper, eq. 17)."""
    g = p[0]
    _t0 = half**2
    _t1 = _t0*sine2 + _t0
    return (16*half**6*sine2**3 + 1)/(2*_t1*g), 2*_t1*g


MODEL = CompiledModel(
    name='quartic', parameter='x', parameters=PARAMETERS, positive=(), source=__file__,
    units={'g': 'm/s**2', 'm': 'kg', 'x': 'm'},
    functions=CompiledFunctions(
        path_and_contact_force, effective_potential, potential_divdiff1, potential_divdiff2, bounds,
    ),
    batch=BatchFunctions(
        potential_divdiff1=potential_divdiff1_batch, potential_divdiff2=potential_divdiff2_batch,
        time_integrand=time_integrand_batch, integrand_invariants=integrand_invariants_batch,
        turning_point=turning_point_batch, bounds=bounds_batch, integrand_rows=1,
    ),
    domain_of=exact_domain, load_map=load_map, axes_of=exact_axes, monotone=True,
    exact=ExactFormulas(
        exact_x, exact_z, exact_ds, exact_kappa, exact_static_normal_load, exact_effective_potential,
        exact_effective_potential_slope, time_integrand=exact_time_integrand,
    ),
)
