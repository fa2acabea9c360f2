# Made by gqm-gen for "ellipse". Do not edit: change its declaration and generate again.
# interface 21, input 81dc4ee20e82, body 0608e1ca6da0
"""Bead on an ellipse, by the eccentric angle

x              = a*cos(theta)
z              = b*sin(theta)
ds/dtheta      = sqrt(a**2*sin(theta)**2 + b**2*cos(theta)**2)
dx/ds          = -a*sin(theta)/sqrt(a**2*sin(theta)**2 + b**2*cos(theta)**2)
dz/ds          = b*cos(theta)/sqrt(a**2*sin(theta)**2 + b**2*cos(theta)**2)
kappa          = a*b/(a**2*sin(theta)**2 + b**2*cos(theta)**2)**(3/2)
Theta          = -lam0 + theta + atan((-a + b)*sin(2*lam0)/(2*(a + (-a + b)*cos(lam0)**2))) - atan((-a + b)*sin(2*theta)/(2*(a + (-a + b)*cos(theta)**2)))
V**2           = 2*b*g*(sin(lam0) - sin(theta)) + v0**2
N              = m*(a*b*(2*b*g*(sin(lam0) - sin(theta)) + v0**2)/(a**2*sin(theta)**2 + b**2*cos(theta)**2)**(3/2) - a*g*sin(theta)/sqrt(a**2*sin(theta)**2 + b**2*cos(theta)**2))
A              = -b*g*cos(theta)/sqrt(a**2*sin(theta)**2 + b**2*cos(theta)**2)
dt/dtheta      = sqrt(a**2*sin(theta)**2 + b**2*cos(theta)**2)/sqrt(2*b*g*(sin(lam0) - sin(theta)) + v0**2)
turning points : 2*b*g*(sin(lam0) - sin(theta)) + v0**2 = 0
liftoff        : a*b*(2*b*g*(sin(lam0) - sin(theta)) + v0**2)/(a**2*sin(theta)**2 + b**2*cos(theta)**2)**(3/2) - a*g*sin(theta)/sqrt(a**2*sin(theta)**2 + b**2*cos(theta)**2) = 0
"""

from math import fabs, sqrt
from typing import TYPE_CHECKING, Any

from numba import carray

from gqm_sym.runtime import compiler

# Before anything else is asked of the runtime, so that another version of it is told from a broken one.
compiled = compiler(__file__, interface=21)

from gqm_sym.runtime.vocabulary import (
    BOUNDS, BOUNDS_BATCH, EFFECTIVE_POTENTIAL, INTEGRAND_INVARIANTS_BATCH, LOAD_MAP, ORBIT_INVARIANTS_BATCH,
    PATH_AND_CONTACT_FORCE, POTENTIAL_DIVDIFF1, POTENTIAL_DIVDIFF1_BATCH, POTENTIAL_DIVDIFF2, POTENTIAL_DIVDIFF2_BATCH,
    TIME_INTEGRAND_BATCH, TURNING_POINT_BATCH, BatchFunctions, CompiledFunctions, CompiledModel, ExactFormulas, Pass1,
    atan, cos, cos_of_sum, divdiff1_cos_in_square, divdiff1_sin, divdiff1_sin_of_sum, divdiff1_sinc_in_square,
    divdiff2_sin, iadd, icos, imul, ipow, isin, isqrt, place_from_ends, sin, sin_of_sum, sinc_near,
    speed_squared_from_potential,
)

if TYPE_CHECKING:
    from gqm_sym.runtime import Equilibrium, Motion, Sweep

# The run-time parameters and their defaults; pass1, solve, sweep and equilibria take them by keyword.
PARAMETERS = {'a': '2', 'b': '1', 'g': '9.81', 'm': '1'}


@compiled(PATH_AND_CONTACT_FORCE)
def path_and_contact_force(n, places, speeds, p, out):
    """x, z, ds/dtheta, curvature kappa, contact force N = m*(kappa*V**2 + n0), given V**2 (paper, eqs. 8, 15)."""
    places, speeds, p, out = carray(places, n), carray(speeds, n), carray(p, 4), carray(out, (5, n))
    a, b, g, m = p[0], p[1], p[2], p[3]
    for i in range(n):
        theta, v2 = places[i], speeds[i]
        _t0 = cos(theta)
        _t1 = sin(theta)
        _t2 = _t0**2*b**2 + _t1**2*a**2
        _t3 = sqrt(_t2)
        _t4 = a*b/sqrt(_t2)**3
        out[0, i] = _t0*a
        out[1, i] = _t1*b
        out[2, i] = _t3
        out[3, i] = _t4
        out[4, i] = m*(-_t1*a*g/_t3 + _t4*v2)


@compiled(EFFECTIVE_POTENTIAL)
def effective_potential(n, places, p, out):
    """U per unit mass, V**2 = v0**2 - 2*(U(theta) - U(lam0)), and dU/dtheta (paper, eq. 13)."""
    places, p, out = carray(places, n), carray(p, 4), carray(out, (2, n))
    b, g = p[1], p[2]
    _t0 = b*g
    for i in range(n):
        theta = places[i]
        out[0, i] = _t0*sin(theta)
        out[1, i] = _t0*cos(theta)


@compiled(POTENTIAL_DIVDIFF1)
def potential_divdiff1(n, _a, places, offsets, p, out):
    """U[a, theta] = (U(theta) - U(a))/(theta - a) without cancellation, and ds/dtheta (MATHS, s. 3)."""
    places, offsets, p, out = carray(places, n), carray(offsets, n), carray(p, 4), carray(out, (2, n))
    a, b, g = p[0], p[1], p[2]
    for i in range(n):
        theta, d = places[i], offsets[i]
        out[0, i] = b*g*divdiff1_sin(_a, theta, d)
        out[1, i] = sqrt(a**2*sin(theta)**2 + b**2*cos(theta)**2)


@compiled(POTENTIAL_DIVDIFF2)
def potential_divdiff2(n, _a, _b, left, right, p, out):
    """U[a, theta, b] = V**2/(2*(theta - a)*(b - theta)) from turn a to turn b, and ds/dtheta (MATHS, s. 3)."""
    left, right, p, out = carray(left, n), carray(right, n), carray(p, 4), carray(out, (2, n))
    a, b, g = p[0], p[1], p[2]
    for i in range(n):
        da, db = left[i], right[i]
        theta = place_from_ends(_a, _b, da, db)
        out[0, i] = b*g*divdiff2_sin(_a, theta, _b, da, db)
        out[1, i] = sqrt(a**2*sin(theta)**2 + b**2*cos(theta)**2)


@compiled(BOUNDS)
def bounds(lo, hi, p, out):
    """Bounds of dU/dtheta and ds/dtheta for lo <= theta <= hi, by interval arithmetic."""
    p, out = carray(p, 4), carray(out, 4)
    theta = (lo, hi)
    a, b, g = (p[0], p[0]), (p[1], p[1]), (p[2], p[2])
    _t0 = icos(theta)
    out[0], out[1] = imul(imul(_t0, b), g)
    out[2], out[3] = isqrt(iadd(imul(ipow(_t0, 2), ipow(b, 2)), imul(ipow(a, 2), ipow(isin(theta), 2))))


# The same formulas over a namespace of operations, for extended precision.

def exact_x(op, theta, p):
    """Horizontal coordinate."""
    a = p[0]
    return a*op.cos(theta)

def exact_z(op, theta, p):
    """Height."""
    b = p[1]
    return b*op.sin(theta)

def exact_ds(op, theta, p):
    """ds/dtheta."""
    a, b = p[0], p[1]
    return op.sqrt(a**2*op.sin(theta)**2 + b**2*op.cos(theta)**2)

def exact_kappa(op, theta, p):
    """Signed curvature (paper, eq. 8)."""
    a, b = p[0], p[1]
    return a*b/(a**2*op.sin(theta)**2 + b**2*op.cos(theta)**2)**(op.mpf(3)/2)

def exact_static_normal_load(op, theta, p):
    """n0 = N/m of a body at rest, so that N = m*(kappa*V**2 + n0) (paper, eq. 15)."""
    a, b, g = p[0], p[1], p[2]
    _t0 = op.sin(theta)
    return -_t0*a*g/op.sqrt(_t0**2*a**2 + b**2*op.cos(theta)**2)

def exact_effective_potential(op, theta, p):
    """U, so that V**2 + 2*U is constant (paper, eq. 13)."""
    b, g = p[1], p[2]
    return b*g*op.sin(theta)

def exact_effective_potential_slope(op, theta, p):
    """dU/dtheta."""
    b, g = p[1], p[2]
    return b*g*op.cos(theta)

def exact_domain(op, p):
    """Both ends of the domain and the period; None for an open end or without a period."""
    return None, None, 2*op.pi

def exact_axes(op, p):
    """A place about which V**2 and ds are even, and the distance to the next (None if there is no other)."""
    return -op.pi/2, op.pi


def pass1(lam: Any = None, lam0: Any = None, v0: Any = 0.0, direction: int = 1, *, out: Any = None, a: Any = '2', b: Any = '1', g: Any = '9.81', m: Any = '1', **unknown: Any) -> Pass1:
    """Position, metric, curvature, V**2 and contact force at places of the curve (Pass 1, no quadrature).

    Parameters
    ----------
    lam : array_like
        Places on the curve, as values of its parameter theta.
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
    contact: str = "bilateral", a: Any = '2', b: Any = '1', g: Any = '9.81', m: Any = '1', **unknown: Any,
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
    contact: str = "bilateral", gradient: Any = None, client: Any = None, a: Any = '2', b: Any = '1', g: Any = '9.81',
    m: Any = '1', **unknown: Any,
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


def equilibria(*, between: Any = None, a: Any = '2', b: Any = '1', g: Any = '9.81', m: Any = '1', **unknown: Any) -> "tuple[Equilibrium, ...]":
    """Where a body at rest stays, whether it is stable there, and the frequency of small oscillations.

    Parameters
    ----------
    between : pair of numbers, optional
        The range of theta to look in: the whole domain, or one period, if not given.

    Returns
    -------
    tuple of Equilibrium
        Each with lam, stable and frequency (rad/s).
    """
    return MODEL.equilibria((a, b, g, m), between, unknown)


# ---- The same formulas once more, only for speed: a load map in one call, and many orbits at once for sweeps. ----


@compiled(LOAD_MAP)
def load_map(n, w0, level, places, p, out):
    """x, z, ds/dtheta, kappa, V**2 = w0 - 2*(U - level), N (paper, eqs. 8, 13, 15), size of U's terms."""
    places, p, out = carray(places, n), carray(p, 4), carray(out, (7, n))
    a, b, g, m = p[0], p[1], p[2], p[3]
    _c0 = fabs(b)
    _c1 = fabs(g)
    for i in range(n):
        theta = places[i]
        _t0 = cos(theta)
        _t1 = sin(theta)
        _t2 = _t1*b
        _t3 = _t0**2*b**2 + _t1**2*a**2
        _t4 = sqrt(_t3)
        _t5 = a*b/sqrt(_t3)**3
        _t6 = speed_squared_from_potential(w0, _t2*g, level)
        out[0, i] = _t0*a
        out[1, i] = _t2
        out[2, i] = _t4
        out[3, i] = _t5
        out[4, i] = _t6
        out[5, i] = m*(-_t1*a*g/_t4 + _t5*_t6)
        out[6, i] = _c0*_c1*fabs(_t1)


@compiled(POTENTIAL_DIVDIFF1_BATCH)
def potential_divdiff1_batch(n, starts, places, offsets, p, out):
    """U[a, theta], ds/dtheta and dU/dtheta."""
    starts, places, offsets, p, out = carray(starts, n), carray(places, n), carray(offsets, n), carray(p, (4, n)), carray(out, (3, n))
    for i in range(n):
        a, b, g, _a, d = p[0, i], p[1, i], p[2, i], starts[i], offsets[i]
        _t0 = b*g
        _t1 = cos_of_sum(0, 1, _a, 0, d)
        out[0, i] = _t0*divdiff1_sin_of_sum(0, 1, _a, d)
        out[1, i] = sqrt(_t1**2*b**2 + a**2*sin_of_sum(0, 1, _a, 0, d)**2)
        out[2, i] = _t0*_t1


@compiled(POTENTIAL_DIVDIFF2_BATCH)
def potential_divdiff2_batch(n, lows, highs, left, right, p, out):
    """U[a, theta, b] and ds/dtheta; NaN where the points lie too far apart for the closed form."""
    lows, highs, left, right, p, out = carray(lows, n), carray(highs, n), carray(left, n), carray(right, n), carray(p, (8, n)), carray(out, (2, n))
    for i in range(n):
        a, b, g, _c0, _c1, _c2, _c3, da = p[0, i], p[1, i], p[2, i], p[4, i], p[5, i], p[6, i], p[7, i], left[i]
        db = right[i]
        _t0 = divdiff1_cos_in_square(da, db)
        _t1 = da/2 - db/2
        _t2 = _t1*divdiff1_sinc_in_square(da, db)
        _t3 = da*db
        _t4 = _c2 - _t0*_t3
        _t5 = _c0*_t1 - _t2*_t3
        out[0, i] = b*g*(_c1*_t0 + _c3*_t2)
        out[1, i] = sqrt(a**2*(_c1*_t4 + _c3*_t5)**2 + b**2*(-_c1*_t5 + _c3*_t4)**2)


@compiled(ORBIT_INVARIANTS_BATCH)
def orbit_invariants_batch(n, lows, highs, middles, rests, halves, p, out):
    """Terms that are constant along an orbit; ``potential_divdiff2_batch`` reads them after the parameters."""
    lows, highs, middles, rests, halves, p, out = carray(lows, n), carray(highs, n), carray(middles, n), carray(rests, n), carray(halves, n), carray(p, (4, n)), carray(out, (4, n))
    for i in range(n):
        middle, rest, half = middles[i], rests[i], halves[i]
        out[0, i] = sinc_near(half)
        out[1, i] = sin_of_sum(0, 1, middle, rest, 0)
        out[2, i] = cos(half)
        out[3, i] = cos_of_sum(0, 1, middle, rest, 0)


@compiled(TIME_INTEGRAND_BATCH)
def time_integrand_batch(n, sine2, cosine2, p, out):
    """(dt/du)**2 at sine2 = sin(u)**2, and its divisor; dt/du integrates to the half period (paper, eq. 17)."""
    p, out = carray(p, (8, n)), carray(out, (2, n))
    for i in range(n):
        a, b, g, t, one_minus_t, one_minus_tt = p[0, i], p[1, i], p[2, i], p[4, i], p[5, i], p[6, i]
        cosine_fourth = p[7, i]
        _t0 = cosine2 + one_minus_tt*sine2
        _t1 = sine2*t
        _t2 = (cosine2 + one_minus_t*sine2)**2
        out[0, i] = (16*_t1*_t2*b**2 + a**2*(-4*_t1 + _t2)**2)/(_t0*b*cosine_fourth*g*(_t1 + 1)**4)
        out[1, i] = 4*_t0*b*g


@compiled(INTEGRAND_INVARIANTS_BATCH)
def integrand_invariants_batch(n, halves, p, out):
    """Terms that are constant along an orbit; ``time_integrand_batch`` reads them after the parameters."""
    halves, p, out = carray(halves, (2, n)), carray(p, (4, n)), carray(out, (4, n))
    for i in range(n):
        half, rest = halves[0, i], halves[1, i]
        _t0 = cos_of_sum(0, 1/2, half, rest, 0)
        _t1 = _t0 + 1
        _t2 = _t1**2
        _t3 = 1/_t2
        out[0, i] = _t3*sin_of_sum(0, 1/2, half, rest, 0)**2
        out[1, i] = 2*_t0/_t1
        out[2, i] = 4*_t0*_t3
        out[3, i] = _t2/4


@compiled(TURNING_POINT_BATCH)
def turning_point_batch(n, offsets, launches, p, out):
    """From V**2 at an offset: half the orbit's width (paper, eq. 14), -dV**2/dq, and a sine's square q at the turn."""
    offsets, launches, p, out = carray(offsets, n), carray(launches, n), carray(p, (4, n)), carray(out, (3, n))
    for i in range(n):
        b, g, offset, launch = p[1, i], p[2, i], offsets[i], launches[i]
        _t0 = sin(offset/2)**2 + launch/(4*b*g)
        out[0, i] = 4*atan(sqrt(_t0)/(sqrt(1 - _t0) + 1))
        out[1, i] = 4*b*g
        out[2, i] = _t0


@compiled(BOUNDS_BATCH)
def bounds_batch(n, lo, hi, p, out):
    """Bounds of dU/dtheta and ds/dtheta for lo <= theta <= hi."""
    lo, hi, p, out = carray(lo, n), carray(hi, n), carray(p, (4, n)), carray(out, (4, n))
    for i in range(n):
        theta = (lo[i], hi[i])
        a, b, g = (p[0, i], p[0, i]), (p[1, i], p[1, i]), (p[2, i], p[2, i])
        _t0 = icos(theta)
        out[0, i], out[1, i] = imul(imul(_t0, b), g)
        out[2, i], out[3, i] = isqrt(iadd(imul(ipow(_t0, 2), ipow(b, 2)), imul(ipow(a, 2), ipow(isin(theta), 2))))


def exact_time_integrand(op, half, sine2, cosine2, p):
    """(dt/du)**2 at sine2 = sin(u)**2, and its divisor; dt/du integrates to the half period (paper, eq. 17)."""
    a, b, g = p[0], p[1], p[2]
    _t0 = half/2
    _t1 = op.cos(_t0)
    _t2 = _t1 + 1
    _t3 = 1/_t2**2
    _t4 = _t3*sine2
    _t5 = 4*_t1*_t4 + cosine2
    _t6 = _t4*op.sin(_t0)**2
    _t7 = (2*_t1*sine2/_t2 + cosine2)**2
    return 4*_t3*(16*_t6*_t7*b**2 + a**2*(-4*_t6 + _t7)**2)/(_t5*b*g*(_t6 + 1)**4), 4*_t5*b*g


MODEL = CompiledModel(
    name='ellipse', parameter='theta', parameters=PARAMETERS, positive=('a', 'b'), source=__file__,
    units={'a': 'm', 'b': 'm', 'g': 'm/s**2', 'm': 'kg', 'theta': '1'},
    functions=CompiledFunctions(
        path_and_contact_force, effective_potential, potential_divdiff1, potential_divdiff2, bounds,
    ),
    batch=BatchFunctions(
        potential_divdiff1=potential_divdiff1_batch, potential_divdiff2=potential_divdiff2_batch,
        orbit_invariants=orbit_invariants_batch, time_integrand=time_integrand_batch,
        integrand_invariants=integrand_invariants_batch, turning_point=turning_point_batch, bounds=bounds_batch,
        orbit_rows=4, integrand_rows=4,
    ),
    domain_of=exact_domain, load_map=load_map, axes_of=exact_axes, monotone=True,
    exact=ExactFormulas(
        exact_x, exact_z, exact_ds, exact_kappa, exact_static_normal_load, exact_effective_potential,
        exact_effective_potential_slope, time_integrand=exact_time_integrand,
    ),
)
