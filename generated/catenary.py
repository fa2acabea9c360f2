# Made by gqm-gen for "catenary". Do not edit: change its declaration and generate again.
# interface 21, input 2558bd3a8d44, body d1734211705e
"""Bead on a hanging chain

x              = x
z              = c*cosh(x/c)
ds/dx          = cosh(x/c)
dx/ds          = 1/cosh(x/c)
dz/ds          = sinh(x/c)/cosh(x/c)
kappa          = 1/(c*cosh(x/c)**2)
Theta          = -atan(sinh(lam0/c)) + atan(sinh(x/c))
V**2           = 2*c*g*(cosh(lam0/c) - cosh(x/c)) + v0**2
N              = m*(g/cosh(x/c) + (2*c*g*(cosh(lam0/c) - cosh(x/c)) + v0**2)/(c*cosh(x/c)**2))
A              = -g*sinh(x/c)/cosh(x/c)
dt/dx          = cosh(x/c)/sqrt(2*c*g*(cosh(lam0/c) - cosh(x/c)) + v0**2)
turning points : 2*c*g*(cosh(lam0/c) - cosh(x/c)) + v0**2 = 0
liftoff        : g/cosh(x/c) + (2*c*g*(cosh(lam0/c) - cosh(x/c)) + v0**2)/(c*cosh(x/c)**2) = 0
"""

from math import asinh, fabs, sqrt
from typing import TYPE_CHECKING, Any

from numba import carray

from gqm_sym.runtime import compiler

# Before anything else is asked of the runtime, so that another version of it is told from a broken one.
compiled = compiler(__file__, interface=21)

from gqm_sym.runtime.vocabulary import (
    BOUNDS, BOUNDS_BATCH, EFFECTIVE_POTENTIAL, INTEGRAND_INVARIANTS_BATCH, LOAD_MAP, ORBIT_INVARIANTS_BATCH,
    PATH_AND_CONTACT_FORCE, POTENTIAL_DIVDIFF1, POTENTIAL_DIVDIFF1_BATCH, POTENTIAL_DIVDIFF2, POTENTIAL_DIVDIFF2_BATCH,
    TIME_INTEGRAND_BATCH, TURNING_POINT_BATCH, BatchFunctions, CompiledFunctions, CompiledModel, ExactFormulas, Pass1,
    cosh, divdiff1_cosh, divdiff1_cosh_in_square, divdiff1_sinhc_in_square, divdiff2_cosh, iconst, icosh, idiv, imul,
    isinh, place_from_ends, sinh, sinh_of_ratio, speed_squared_from_potential,
)

if TYPE_CHECKING:
    from gqm_sym.runtime import Equilibrium, Motion, Sweep

# The run-time parameters and their defaults; pass1, solve, sweep and equilibria take them by keyword.
PARAMETERS = {'c': '0.8', 'g': '9.81', 'm': '1'}


@compiled(PATH_AND_CONTACT_FORCE)
def path_and_contact_force(n, places, speeds, p, out):
    """x, z, ds/dx, curvature kappa, contact force N = m*(kappa*V**2 + n0), given V**2 (paper, eqs. 8, 15)."""
    places, speeds, p, out = carray(places, n), carray(speeds, n), carray(p, 3), carray(out, (5, n))
    c, g, m = p[0], p[1], p[2]
    _t0 = 1/c
    for i in range(n):
        x, v2 = places[i], speeds[i]
        _t1 = cosh(_t0*x)
        _t2 = _t0/_t1**2
        out[0, i] = x
        out[1, i] = _t1*c
        out[2, i] = _t1
        out[3, i] = _t2
        out[4, i] = m*(_t2*v2 + g/_t1)


@compiled(EFFECTIVE_POTENTIAL)
def effective_potential(n, places, p, out):
    """U per unit mass, V**2 = v0**2 - 2*(U(x) - U(lam0)), and dU/dx (paper, eq. 13)."""
    places, p, out = carray(places, n), carray(p, 3), carray(out, (2, n))
    c, g = p[0], p[1]
    for i in range(n):
        x = places[i]
        _t0 = x/c
        out[0, i] = c*g*cosh(_t0)
        out[1, i] = g*sinh(_t0)


@compiled(POTENTIAL_DIVDIFF1)
def potential_divdiff1(n, a, places, offsets, p, out):
    """U[a, x] = (U(x) - U(a))/(x - a) without cancellation, and ds/dx (MATHS, s. 3)."""
    places, offsets, p, out = carray(places, n), carray(offsets, n), carray(p, 3), carray(out, (2, n))
    c, g = p[0], p[1]
    _t0 = 1/c
    for i in range(n):
        x, d = places[i], offsets[i]
        _t1 = _t0*x
        out[0, i] = g*divdiff1_cosh(_t0*a, _t1, _t0*d)
        out[1, i] = cosh(_t1)


@compiled(POTENTIAL_DIVDIFF2)
def potential_divdiff2(n, a, b, left, right, p, out):
    """U[a, x, b] = V**2/(2*(x - a)*(b - x)) from turn a to turn b, and ds/dx (MATHS, s. 3)."""
    left, right, p, out = carray(left, n), carray(right, n), carray(p, 3), carray(out, (2, n))
    c, g = p[0], p[1]
    _t0 = 1/c
    for i in range(n):
        da, db = left[i], right[i]
        x = place_from_ends(a, b, da, db)
        _t1 = _t0*x
        out[0, i] = _t0*g*divdiff2_cosh(_t0*a, _t1, _t0*b, _t0*da, _t0*db)
        out[1, i] = cosh(_t1)


@compiled(BOUNDS)
def bounds(lo, hi, p, out):
    """Bounds of dU/dx and ds/dx for lo <= x <= hi, by interval arithmetic."""
    p, out = carray(p, 3), carray(out, 4)
    x = (lo, hi)
    c, g = (p[0], p[0]), (p[1], p[1])
    _t0 = imul(idiv(iconst(1.0), c), x)
    out[0], out[1] = imul(g, isinh(_t0))
    out[2], out[3] = icosh(_t0)


# The same formulas over a namespace of operations, for extended precision.

def exact_x(op, x, p):
    """Horizontal coordinate."""
    return x

def exact_z(op, x, p):
    """Height."""
    c = p[0]
    return c*op.cosh(x/c)

def exact_ds(op, x, p):
    """ds/dx."""
    c = p[0]
    return op.cosh(x/c)

def exact_kappa(op, x, p):
    """Signed curvature (paper, eq. 8)."""
    c = p[0]
    _t0 = 1/c
    return _t0/op.cosh(_t0*x)**2

def exact_static_normal_load(op, x, p):
    """n0 = N/m of a body at rest, so that N = m*(kappa*V**2 + n0) (paper, eq. 15)."""
    c, g = p[0], p[1]
    return g/op.cosh(x/c)

def exact_effective_potential(op, x, p):
    """U, so that V**2 + 2*U is constant (paper, eq. 13)."""
    c, g = p[0], p[1]
    return c*g*op.cosh(x/c)

def exact_effective_potential_slope(op, x, p):
    """dU/dx."""
    c, g = p[0], p[1]
    return g*op.sinh(x/c)

def exact_domain(op, p):
    """Both ends of the domain and the period; None for an open end or without a period."""
    return None, None, None

def exact_axes(op, p):
    """A place about which V**2 and ds are even, and the distance to the next (None if there is no other)."""
    return 0, None


def pass1(lam: Any = None, lam0: Any = None, v0: Any = 0.0, direction: int = 1, *, out: Any = None, c: Any = '0.8', g: Any = '9.81', m: Any = '1', **unknown: Any) -> Pass1:
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
    return MODEL.pass1((lam0, v0, direction), (c, g, m), lam, out, unknown)


def solve(
    lam0: Any = None, v0: Any = 0.0, direction: int = 1, *, point: Any = None, t_max: Any = None,
    contact: str = "bilateral", c: Any = '0.8', g: Any = '9.81', m: Any = '1', **unknown: Any,
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
    return MODEL.solve((lam0, v0, direction, point, t_max, contact), (c, g, m), unknown)


def sweep(
    quantity: Any = None, lam0: Any = None, v0: Any = 0.0, direction: Any = 1, *, lam: Any = None, t_max: Any = None,
    contact: str = "bilateral", gradient: Any = None, client: Any = None, c: Any = '0.8', g: Any = '9.81', m: Any = '1',
    **unknown: Any,
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
    return MODEL.sweep(quantity, launches, (c, g, m), lam=lam, client=client, gradient=gradient, unknown=unknown)


def equilibria(*, between: Any = None, c: Any = '0.8', g: Any = '9.81', m: Any = '1', **unknown: Any) -> "tuple[Equilibrium, ...]":
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
    return MODEL.equilibria((c, g, m), between, unknown)


# ---- The same formulas once more, only for speed: a load map in one call, and many orbits at once for sweeps. ----


@compiled(LOAD_MAP)
def load_map(n, w0, level, places, p, out):
    """x, z, ds/dx, kappa, V**2 = w0 - 2*(U - level), N (paper, eqs. 8, 13, 15), size of U's terms."""
    places, p, out = carray(places, n), carray(p, 3), carray(out, (7, n))
    c, g, m = p[0], p[1], p[2]
    _t0 = 1/c
    _c0 = fabs(c)
    _c1 = fabs(g)
    for i in range(n):
        x = places[i]
        _t1 = cosh(_t0*x)
        _t2 = _t1*c
        _t3 = _t0/_t1**2
        _t4 = speed_squared_from_potential(w0, _t2*g, level)
        out[0, i] = x
        out[1, i] = _t2
        out[2, i] = _t1
        out[3, i] = _t3
        out[4, i] = _t4
        out[5, i] = m*(_t3*_t4 + g/_t1)
        out[6, i] = _c0*_c1*_t1


@compiled(POTENTIAL_DIVDIFF1_BATCH)
def potential_divdiff1_batch(n, starts, places, offsets, p, out):
    """U[a, x], ds/dx and dU/dx."""
    starts, places, offsets, p, out = carray(starts, n), carray(places, n), carray(offsets, n), carray(p, (3, n)), carray(out, (3, n))
    for i in range(n):
        c, g, a, x, d = p[0, i], p[1, i], starts[i], places[i], offsets[i]
        _t0 = 1/c
        _t1 = _t0*x
        out[0, i] = g*divdiff1_cosh(_t0*a, _t1, _t0*d)
        out[1, i] = cosh(_t1)
        out[2, i] = g*sinh(_t1)


@compiled(POTENTIAL_DIVDIFF2_BATCH)
def potential_divdiff2_batch(n, lows, highs, left, right, p, out):
    """U[a, x, b] and ds/dx; NaN where the points lie too far apart for the closed form."""
    lows, highs, left, right, p, out = carray(lows, n), carray(highs, n), carray(left, n), carray(right, n), carray(p, (5, n)), carray(out, (2, n))
    for i in range(n):
        c, g, _c0, _c1, a, b, da, db = p[0, i], p[1, i], p[3, i], p[4, i], lows[i], highs[i], left[i], right[i]
        from_middle = da/2 - db/2
        x = place_from_ends(a, b, da, db)
        _t0 = 1/c
        _t1 = _t0*da
        _t2 = _t0*db
        out[0, i] = _t0*g*(_c0*_t0*from_middle*divdiff1_sinhc_in_square(_t1, _t2) + _c1*divdiff1_cosh_in_square(_t1, _t2))
        out[1, i] = cosh(_t0*x)


@compiled(ORBIT_INVARIANTS_BATCH)
def orbit_invariants_batch(n, lows, highs, middles, rests, halves, p, out):
    """Terms that are constant along an orbit; ``potential_divdiff2_batch`` reads them after the parameters."""
    lows, highs, middles, rests, halves, p, out = carray(lows, n), carray(highs, n), carray(middles, n), carray(rests, n), carray(halves, n), carray(p, (3, n)), carray(out, (2, n))
    for i in range(n):
        c, middle, rest = p[0, i], middles[i], rests[i]
        _t0 = 1/c
        _t1 = _t0*middle
        _t2 = sinh(_t1)
        _t3 = cosh(_t1)
        _t4 = _t0*rest
        out[0, i] = _t2 + _t3*_t4
        out[1, i] = _t2*_t4 + _t3


@compiled(TIME_INTEGRAND_BATCH)
def time_integrand_batch(n, sine2, cosine2, p, out):
    """(dt/du)**2 at sine2 = sin(u)**2, and its divisor; dt/du integrates to the half period (paper, eq. 17)."""
    p, out = carray(p, (7, n)), carray(out, (2, n))
    for i in range(n):
        c, g, t, one_minus_t, one_minus_tt, cosine_fourth = p[0, i], p[1, i], p[3, i], p[4, i], p[5, i], p[6, i]
        _t0 = cosine2 + one_minus_tt*sine2
        _t1 = sine2*t
        out[0, i] = c*(4*_t1 + (_t1 + 1)**2)**2/(_t0*cosine_fourth*g*(cosine2 + one_minus_t*sine2)**4)
        out[1, i] = 4*_t0*c*g


@compiled(INTEGRAND_INVARIANTS_BATCH)
def integrand_invariants_batch(n, halves, p, out):
    """Terms that are constant along an orbit; ``time_integrand_batch`` reads them after the parameters."""
    halves, p, out = carray(halves, (2, n)), carray(p, (3, n)), carray(out, (4, n))
    for i in range(n):
        c, half, rest = p[0, i], halves[0, i], halves[1, i]
        _t0 = 1/(4*c)
        _t1 = (_t0*rest*cosh(_t0*half) + sinh_of_ratio(1, half, 4*c))**2
        _t2 = _t1 + 1
        _t3 = 1/_t2
        _t4 = _t2**2
        out[0, i] = _t1*_t3
        out[1, i] = _t3
        out[2, i] = (2*_t1 + 1)/_t4
        out[3, i] = _t4


@compiled(TURNING_POINT_BATCH)
def turning_point_batch(n, offsets, launches, p, out):
    """From V**2 at an offset: half the orbit's width (paper, eq. 14), -dV**2/dq, and a sine's square q at the turn."""
    offsets, launches, p, out = carray(offsets, n), carray(launches, n), carray(p, (3, n)), carray(out, (3, n))
    for i in range(n):
        c, g, offset, launch = p[0, i], p[1, i], offsets[i], launches[i]
        _t0 = 1/c
        out[0, i] = 2*fabs(c)*asinh(sqrt(_t0*launch/(4*g) + sinh(_t0*offset/2)**2))
        out[1, i] = 4*c*g
        out[2, i] = 0


@compiled(BOUNDS_BATCH)
def bounds_batch(n, lo, hi, p, out):
    """Bounds of dU/dx and ds/dx for lo <= x <= hi."""
    lo, hi, p, out = carray(lo, n), carray(hi, n), carray(p, (3, n)), carray(out, (4, n))
    for i in range(n):
        x = (lo[i], hi[i])
        c, g = (p[0, i], p[0, i]), (p[1, i], p[1, i])
        _t0 = imul(idiv(iconst(1.0), c), x)
        out[0, i], out[1, i] = imul(g, isinh(_t0))
        out[2, i], out[3, i] = icosh(_t0)


def exact_time_integrand(op, half, sine2, cosine2, p):
    """(dt/du)**2 at sine2 = sin(u)**2, and its divisor; dt/du integrates to the half period (paper, eq. 17)."""
    c, g = p[0], p[1]
    _t0 = op.sinh(half/(4*c))**2
    _t1 = _t0 + 1
    _t2 = 1/_t1**2
    _t3 = sine2/_t1
    _t4 = _t2*sine2*(2*_t0 + 1) + cosine2
    _t5 = _t0*_t3
    return _t2*c*(4*_t5 + (_t5 + 1)**2)**2/(_t4*g*(_t3 + cosine2)**4), 4*_t4*c*g


MODEL = CompiledModel(
    name='catenary', parameter='x', parameters=PARAMETERS, positive=('c',), source=__file__,
    units={'c': 'm', 'g': 'm/s**2', 'm': 'kg', 'x': 'm'},
    functions=CompiledFunctions(
        path_and_contact_force, effective_potential, potential_divdiff1, potential_divdiff2, bounds,
    ),
    batch=BatchFunctions(
        potential_divdiff1=potential_divdiff1_batch, potential_divdiff2=potential_divdiff2_batch,
        orbit_invariants=orbit_invariants_batch, time_integrand=time_integrand_batch,
        integrand_invariants=integrand_invariants_batch, turning_point=turning_point_batch, bounds=bounds_batch,
        orbit_rows=2, integrand_rows=4,
    ),
    domain_of=exact_domain, load_map=load_map, axes_of=exact_axes, monotone=True,
    exact=ExactFormulas(
        exact_x, exact_z, exact_ds, exact_kappa, exact_static_normal_load, exact_effective_potential,
        exact_effective_potential_slope, time_integrand=exact_time_integrand,
    ),
)
