# Made by gqm-gen for "rotating_parabola". Do not edit: change its declaration and generate again.
# interface 21, input 33421e752297, body 0f3531a261a8
"""Bead in a turning parabolic bowl

x              = x
z              = a*x**2
ds/dx          = sqrt(4*a**2*x**2 + 1)
dx/ds          = 1/sqrt(4*a**2*x**2 + 1)
dz/ds          = 2*a*x/sqrt(4*a**2*x**2 + 1)
kappa          = 2*a/(4*a**2*x**2 + 1)**(3/2)
Theta          = -atan(2*a*lam0) + atan(2*a*x)
V**2           = v0**2 + 2*(-Omega**2/2 + a*g)*(lam0**2 - x**2)
N              = m*(2*a*(v0**2 + 2*(-Omega**2/2 + a*g)*(lam0**2 - x**2))/(4*a**2*x**2 + 1)**(3/2) + (2*Omega**2*a*x**2 + g)/sqrt(4*a**2*x**2 + 1))
N_b            = 2*Omega*direction*m*sqrt(v0**2 + 2*(-Omega**2/2 + a*g)*(lam0**2 - x**2))/sqrt(4*a**2*x**2 + 1)
A              = -x*(-Omega**2 + 2*a*g)/sqrt(4*a**2*x**2 + 1)
dt/dx          = sqrt(4*a**2*x**2 + 1)/sqrt(v0**2 + 2*(-Omega**2/2 + a*g)*(lam0**2 - x**2))
turning points : v0**2 + 2*(-Omega**2/2 + a*g)*(lam0**2 - x**2) = 0
liftoff        : 2*a*(v0**2 + 2*(-Omega**2/2 + a*g)*(lam0**2 - x**2))/(4*a**2*x**2 + 1)**(3/2) + (2*Omega**2*a*x**2 + g)/sqrt(4*a**2*x**2 + 1) = 0
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
    TURNING_POINT_BATCH, BatchFunctions, CompiledFunctions, CompiledModel, ExactFormulas, Pass1, iadd, iconst, imul,
    ipow, isqrt, place_from_ends, speed_squared_from_potential,
)

if TYPE_CHECKING:
    from gqm_sym.runtime import Equilibrium, Motion, Sweep

# The run-time parameters and their defaults; pass1, solve, sweep and equilibria take them by keyword.
PARAMETERS = {'a': '0.6', 'Omega': '2.5', 'g': '9.81', 'm': '1.4'}


@compiled(PATH_AND_CONTACT_FORCE)
def path_and_contact_force(n, places, speeds, p, out):
    """x, z, ds/dx, curvature kappa, contact force N = m*(kappa*V**2 + n0), given V**2 (paper, eqs. 8, 15)."""
    places, speeds, p, out = carray(places, n), carray(speeds, n), carray(p, 4), carray(out, (5, n))
    a, Omega, g, m = p[0], p[1], p[2], p[3]
    for i in range(n):
        x, v2 = places[i], speeds[i]
        _t0 = x**2
        _t1 = _t0*a
        _t2 = 4*_t0*a**2 + 1
        _t3 = sqrt(_t2)
        _t4 = 2*a/sqrt(_t2)**3
        out[0, i] = x
        out[1, i] = _t1
        out[2, i] = _t3
        out[3, i] = _t4
        out[4, i] = m*(_t4*v2 + (2*Omega**2*_t1 + g)/_t3)


@compiled(EFFECTIVE_POTENTIAL)
def effective_potential(n, places, p, out):
    """U per unit mass, V**2 = v0**2 - 2*(U(x) - U(lam0)), and dU/dx (paper, eq. 13)."""
    places, p, out = carray(places, n), carray(p, 4), carray(out, (2, n))
    a, Omega, g = p[0], p[1], p[2]
    _t0 = Omega**2
    for i in range(n):
        x = places[i]
        out[0, i] = x**2*(-_t0/2 + a*g)
        out[1, i] = x*(-_t0 + 2*a*g)


@compiled(POTENTIAL_DIVDIFF1)
def potential_divdiff1(n, _a, places, offsets, p, out):
    """U[a, x] = (U(x) - U(a))/(x - a) without cancellation, and ds/dx (MATHS, s. 3)."""
    places, offsets, p, out = carray(places, n), carray(offsets, n), carray(p, 4), carray(out, (2, n))
    a, Omega, g = p[0], p[1], p[2]
    for i in range(n):
        x = places[i]
        out[0, i] = (-Omega**2/2 + a*g)*(_a + x)
        out[1, i] = sqrt(4*a**2*x**2 + 1)


@compiled(POTENTIAL_DIVDIFF2)
def potential_divdiff2(n, _a, b, left, right, p, out):
    """U[a, x, b] = V**2/(2*(x - a)*(b - x)) from turn a to turn b, and ds/dx (MATHS, s. 3)."""
    left, right, p, out = carray(left, n), carray(right, n), carray(p, 4), carray(out, (2, n))
    a, Omega, g = p[0], p[1], p[2]
    for i in range(n):
        da, db = left[i], right[i]
        x = place_from_ends(_a, b, da, db)
        out[0, i] = -Omega**2/2 + a*g
        out[1, i] = sqrt(4*a**2*x**2 + 1)


@compiled(BOUNDS)
def bounds(lo, hi, p, out):
    """Bounds of dU/dx and ds/dx for lo <= x <= hi, by interval arithmetic."""
    p, out = carray(p, 4), carray(out, 4)
    x = (lo, hi)
    a, Omega, g = (p[0], p[0]), (p[1], p[1]), (p[2], p[2])
    out[0], out[1] = imul(x, iadd(imul(iconst(-1.0), ipow(Omega, 2)), imul(imul(iconst(2.0), a), g)))
    out[2], out[3] = isqrt(iadd(imul(imul(iconst(4.0), ipow(a, 2)), ipow(x, 2)), iconst(1.0)))


# The same formulas over a namespace of operations, for extended precision.

def exact_x(op, x, p):
    """Horizontal coordinate."""
    return x

def exact_z(op, x, p):
    """Height."""
    a = p[0]
    return a*x**2

def exact_ds(op, x, p):
    """ds/dx."""
    a = p[0]
    return op.sqrt(4*a**2*x**2 + 1)

def exact_kappa(op, x, p):
    """Signed curvature (paper, eq. 8)."""
    a = p[0]
    return 2*a/(4*a**2*x**2 + 1)**(op.mpf(3)/2)

def exact_static_normal_load(op, x, p):
    """n0 = N/m of a body at rest, so that N = m*(kappa*V**2 + n0) (paper, eq. 15)."""
    a, Omega, g = p[0], p[1], p[2]
    _t0 = x**2
    return (2*Omega**2*_t0*a + g)/op.sqrt(4*_t0*a**2 + 1)

def exact_effective_potential(op, x, p):
    """U, so that V**2 + 2*U is constant (paper, eq. 13)."""
    a, Omega, g = p[0], p[1], p[2]
    return x**2*(-Omega**2/2 + a*g)

def exact_effective_potential_slope(op, x, p):
    """dU/dx."""
    a, Omega, g = p[0], p[1], p[2]
    return x*(-Omega**2 + 2*a*g)

def exact_domain(op, p):
    """Both ends of the domain and the period; None for an open end or without a period."""
    return None, None, None

def exact_axes(op, p):
    """A place about which V**2 and ds are even, and the distance to the next (None if there is no other)."""
    return 0, None


def pass1(lam: Any = None, lam0: Any = None, v0: Any = 0.0, direction: int = 1, *, out: Any = None, a: Any = '0.6', Omega: Any = '2.5', g: Any = '9.81', m: Any = '1.4', **unknown: Any) -> Pass1:
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
    return MODEL.pass1((lam0, v0, direction), (a, Omega, g, m), lam, out, unknown)


def solve(
    lam0: Any = None, v0: Any = 0.0, direction: int = 1, *, point: Any = None, t_max: Any = None,
    contact: str = "bilateral", a: Any = '0.6', Omega: Any = '2.5', g: Any = '9.81', m: Any = '1.4', **unknown: Any,
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
    return MODEL.solve((lam0, v0, direction, point, t_max, contact), (a, Omega, g, m), unknown)


def sweep(
    quantity: Any = None, lam0: Any = None, v0: Any = 0.0, direction: Any = 1, *, lam: Any = None, t_max: Any = None,
    contact: str = "bilateral", gradient: Any = None, client: Any = None, a: Any = '0.6', Omega: Any = '2.5',
    g: Any = '9.81', m: Any = '1.4', **unknown: Any,
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
    return MODEL.sweep(quantity, launches, (a, Omega, g, m), lam=lam, client=client, gradient=gradient, unknown=unknown)


def equilibria(*, between: Any = None, a: Any = '0.6', Omega: Any = '2.5', g: Any = '9.81', m: Any = '1.4', **unknown: Any) -> "tuple[Equilibrium, ...]":
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
    return MODEL.equilibria((a, Omega, g, m), between, unknown)


# ---- The same formulas once more, only for speed: a load map in one call, and many orbits at once for sweeps. ----


@compiled(LOAD_MAP)
def load_map(n, w0, level, places, p, out):
    """x, z, ds/dx, kappa, V**2 = w0 - 2*(U - level), N (paper, eqs. 8, 13, 15), size of U's terms."""
    places, p, out = carray(places, n), carray(p, 4), carray(out, (7, n))
    a, Omega, g, m = p[0], p[1], p[2], p[3]
    _t5 = Omega**2
    _c0 = fabs(a)
    _c1 = fabs(g)
    _t6 = _t5/2
    for i in range(n):
        x = places[i]
        _t0 = x**2
        _t1 = _t0*a
        _t2 = 4*_t0*a**2 + 1
        _t3 = sqrt(_t2)
        _t4 = 2*a/sqrt(_t2)**3
        _t7 = speed_squared_from_potential(w0, _t0*(-_t6 + a*g), level)
        out[0, i] = x
        out[1, i] = _t1
        out[2, i] = _t3
        out[3, i] = _t4
        out[4, i] = _t7
        out[5, i] = m*(_t4*_t7 + (2*_t1*_t5 + g)/_t3)
        out[6, i] = _t0*(_c0*_c1 + _t6)


@compiled(POTENTIAL_DIVDIFF1_BATCH)
def potential_divdiff1_batch(n, starts, places, offsets, p, out):
    """U[a, x], ds/dx and dU/dx."""
    starts, places, offsets, p, out = carray(starts, n), carray(places, n), carray(offsets, n), carray(p, (4, n)), carray(out, (3, n))
    for i in range(n):
        a, Omega, g, _a, x = p[0, i], p[1, i], p[2, i], starts[i], places[i]
        _t0 = Omega**2
        out[0, i] = (_a + x)*(-_t0/2 + a*g)
        out[1, i] = sqrt(4*a**2*x**2 + 1)
        out[2, i] = x*(-_t0 + 2*a*g)


@compiled(POTENTIAL_DIVDIFF2_BATCH)
def potential_divdiff2_batch(n, lows, highs, left, right, p, out):
    """U[a, x, b] and ds/dx; NaN where the points lie too far apart for the closed form."""
    lows, highs, left, right, p, out = carray(lows, n), carray(highs, n), carray(left, n), carray(right, n), carray(p, (4, n)), carray(out, (2, n))
    for i in range(n):
        a, Omega, g, _a, b, da, db = p[0, i], p[1, i], p[2, i], lows[i], highs[i], left[i], right[i]
        x = place_from_ends(_a, b, da, db)
        out[0, i] = -Omega**2/2 + a*g
        out[1, i] = sqrt(4*a**2*x**2 + 1)


@compiled(TIME_INTEGRAND_BATCH)
def time_integrand_batch(n, sine2, cosine2, p, out):
    """(dt/du)**2 at sine2 = sin(u)**2, and its divisor; dt/du integrates to the half period (paper, eq. 17)."""
    p, out = carray(p, (5, n)), carray(out, (2, n))
    for i in range(n):
        a, Omega, g, t = p[0, i], p[1, i], p[2, i], p[4, i]
        _t0 = -Omega**2 + 2*a*g
        out[0, i] = (4*a**2*sine2*t + 1)/_t0
        out[1, i] = _t0


@compiled(INTEGRAND_INVARIANTS_BATCH)
def integrand_invariants_batch(n, halves, p, out):
    """Terms that are constant along an orbit; ``time_integrand_batch`` reads them after the parameters."""
    halves, p, out = carray(halves, (2, n)), carray(p, (4, n)), carray(out, (1, n))
    for i in range(n):
        half, rest = halves[0, i], halves[1, i]
        out[0, i] = half*(half + 2*rest)


@compiled(TURNING_POINT_BATCH)
def turning_point_batch(n, offsets, launches, p, out):
    """From V**2 at an offset: half the orbit's width (paper, eq. 14), -dV**2/dq, and a sine's square q at the turn."""
    offsets, launches, p, out = carray(offsets, n), carray(launches, n), carray(p, (4, n)), carray(out, (3, n))
    for i in range(n):
        a, Omega, g, offset, launch = p[0, i], p[1, i], p[2, i], offsets[i], launches[i]
        _t0 = -Omega**2 + 2*a*g
        out[0, i] = sqrt(offset**2 + launch/_t0)
        out[1, i] = _t0
        out[2, i] = 0


@compiled(BOUNDS_BATCH)
def bounds_batch(n, lo, hi, p, out):
    """Bounds of dU/dx and ds/dx for lo <= x <= hi."""
    lo, hi, p, out = carray(lo, n), carray(hi, n), carray(p, (4, n)), carray(out, (4, n))
    for i in range(n):
        x = (lo[i], hi[i])
        a, Omega, g = (p[0, i], p[0, i]), (p[1, i], p[1, i]), (p[2, i], p[2, i])
        out[0, i], out[1, i] = imul(x, iadd(imul(iconst(-1.0), ipow(Omega, 2)), imul(imul(iconst(2.0), a), g)))
        out[2, i], out[3, i] = isqrt(iadd(imul(imul(iconst(4.0), ipow(a, 2)), ipow(x, 2)), iconst(1.0)))


def exact_time_integrand(op, half, sine2, cosine2, p):
    """(dt/du)**2 at sine2 = sin(u)**2, and its divisor; dt/du integrates to the half period (paper, eq. 17)."""
    a, Omega, g = p[0], p[1], p[2]
    _t0 = -Omega**2 + 2*a*g
    return (4*a**2*half**2*sine2 + 1)/_t0, _t0


MODEL = CompiledModel(
    name='rotating_parabola', parameter='x', parameters=PARAMETERS, positive=(), source=__file__,
    units={'Omega': '1/s', 'a': '1/m', 'g': 'm/s**2', 'm': 'kg', 'x': 'm'},
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
