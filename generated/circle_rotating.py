# Made by gqm-gen for "circle_rotating". Do not edit: change its declaration and generate again.
# interface 21, input a74aedd594f9, body 53a9b03955b1
"""Bead on a hoop that turns about its vertical diameter

x              = L*sin(theta)
z              = -L*cos(theta)
ds/dtheta      = L
dx/ds          = cos(theta)
dz/ds          = sin(theta)
kappa          = 1/L
Theta          = -lam0 + theta
V**2           = 2*L*(-L*Omega**2*sin(lam0)**2/2 + L*Omega**2*sin(theta)**2/2 - g*cos(lam0) + g*cos(theta)) + v0**2
N              = m*(L*Omega**2*sin(theta)**2 + g*cos(theta) + (2*L*(-L*Omega**2*sin(lam0)**2/2 + L*Omega**2*sin(theta)**2/2 - g*cos(lam0) + g*cos(theta)) + v0**2)/L)
N_b            = 2*Omega*direction*m*sqrt(2*L*(-L*Omega**2*sin(lam0)**2/2 + L*Omega**2*sin(theta)**2/2 - g*cos(lam0) + g*cos(theta)) + v0**2)*cos(theta)
A              = -(-L*Omega**2*cos(theta) + g)*sin(theta)
dt/dtheta      = L/sqrt(2*L*(-L*Omega**2*sin(lam0)**2/2 + L*Omega**2*sin(theta)**2/2 - g*cos(lam0) + g*cos(theta)) + v0**2)
turning points : 2*L*(-L*Omega**2*sin(lam0)**2/2 + L*Omega**2*sin(theta)**2/2 - g*cos(lam0) + g*cos(theta)) + v0**2 = 0
liftoff        : L*Omega**2*sin(theta)**2 + g*cos(theta) + (2*L*(-L*Omega**2*sin(lam0)**2/2 + L*Omega**2*sin(theta)**2/2 - g*cos(lam0) + g*cos(theta)) + v0**2)/L = 0
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
    atan, cos, cos_of_sum, divdiff1_cos, divdiff1_cos_in_square, divdiff1_cos_of_sum, divdiff1_sin,
    divdiff1_sinc_in_square, divdiff2_cos, divdiff2_sin, iadd, iconst, icos, imul, ipow, isin, place_from_ends, sin,
    sin_of_sum, speed_squared_from_potential,
)

if TYPE_CHECKING:
    from gqm_sym.runtime import Equilibrium, Motion, Sweep

# The run-time parameters and their defaults; pass1, solve, sweep and equilibria take them by keyword.
PARAMETERS = {'L': '1', 'Omega': '4', 'g': '9.81', 'm': '1'}


@compiled(PATH_AND_CONTACT_FORCE)
def path_and_contact_force(n, places, speeds, p, out):
    """x, z, ds/dtheta, curvature kappa, contact force N = m*(kappa*V**2 + n0), given V**2 (paper, eqs. 8, 15)."""
    places, speeds, p, out = carray(places, n), carray(speeds, n), carray(p, 4), carray(out, (5, n))
    L, Omega, g, m = p[0], p[1], p[2], p[3]
    _t2 = 1/L
    for i in range(n):
        theta, v2 = places[i], speeds[i]
        _t0 = sin(theta)
        _t1 = cos(theta)
        out[0, i] = L*_t0
        out[1, i] = -L*_t1
        out[2, i] = L
        out[3, i] = _t2
        out[4, i] = m*(L*Omega**2*_t0**2 + _t1*g + _t2*v2)


@compiled(EFFECTIVE_POTENTIAL)
def effective_potential(n, places, p, out):
    """U per unit mass, V**2 = v0**2 - 2*(U(theta) - U(lam0)), and dU/dtheta (paper, eq. 13)."""
    places, p, out = carray(places, n), carray(p, 4), carray(out, (2, n))
    L, Omega, g = p[0], p[1], p[2]
    _t2 = L*Omega**2
    for i in range(n):
        theta = places[i]
        _t0 = cos(theta)
        _t1 = sin(theta)
        out[0, i] = -L*(_t0*g + _t1**2*_t2/2)
        out[1, i] = L*_t1*(-_t0*_t2 + g)


@compiled(POTENTIAL_DIVDIFF1)
def potential_divdiff1(n, a, places, offsets, p, out):
    """U[a, theta] = (U(theta) - U(a))/(theta - a) without cancellation, and ds/dtheta (MATHS, s. 3)."""
    places, offsets, p, out = carray(places, n), carray(offsets, n), carray(p, 4), carray(out, (2, n))
    L, Omega, g = p[0], p[1], p[2]
    _c0 = sin(a)
    for i in range(n):
        theta, d = places[i], offsets[i]
        out[0, i] = -L*(L*Omega**2*(_c0 + sin(theta))*divdiff1_sin(a, theta, d)/2 + g*divdiff1_cos(a, theta, d))
        out[1, i] = L


@compiled(POTENTIAL_DIVDIFF2)
def potential_divdiff2(n, a, b, left, right, p, out):
    """U[a, theta, b] = V**2/(2*(theta - a)*(b - theta)) from turn a to turn b, and ds/dtheta (MATHS, s. 3)."""
    left, right, p, out = carray(left, n), carray(right, n), carray(p, 4), carray(out, (2, n))
    L, Omega, g = p[0], p[1], p[2]
    _c0 = sin(b)
    _c1 = divdiff1_sin(a, b, -a + b)
    for i in range(n):
        da, db = left[i], right[i]
        theta = place_from_ends(a, b, da, db)
        out[0, i] = -L*(L*Omega**2*(_c1*divdiff1_sin(a, theta, da) + (_c0 + sin(theta))*divdiff2_sin(a, theta, b, da, db))/2 + g*divdiff2_cos(a, theta, b, da, db))
        out[1, i] = L


@compiled(BOUNDS)
def bounds(lo, hi, p, out):
    """Bounds of dU/dtheta and ds/dtheta for lo <= theta <= hi, by interval arithmetic."""
    p, out = carray(p, 4), carray(out, 4)
    theta = (lo, hi)
    L, Omega, g = (p[0], p[0]), (p[1], p[1]), (p[2], p[2])
    out[0], out[1] = imul(imul(L, iadd(imul(imul(imul(iconst(-1.0), L), ipow(Omega, 2)), icos(theta)), g)), isin(theta))
    out[2], out[3] = L


# The same formulas over a namespace of operations, for extended precision.

def exact_x(op, theta, p):
    """Horizontal coordinate."""
    L = p[0]
    return L*op.sin(theta)

def exact_z(op, theta, p):
    """Height."""
    L = p[0]
    return -L*op.cos(theta)

def exact_ds(op, theta, p):
    """ds/dtheta."""
    L = p[0]
    return L

def exact_kappa(op, theta, p):
    """Signed curvature (paper, eq. 8)."""
    L = p[0]
    return 1/L

def exact_static_normal_load(op, theta, p):
    """n0 = N/m of a body at rest, so that N = m*(kappa*V**2 + n0) (paper, eq. 15)."""
    L, Omega, g = p[0], p[1], p[2]
    return L*Omega**2*op.sin(theta)**2 + g*op.cos(theta)

def exact_effective_potential(op, theta, p):
    """U, so that V**2 + 2*U is constant (paper, eq. 13)."""
    L, Omega, g = p[0], p[1], p[2]
    return -L*(L*Omega**2*op.sin(theta)**2/2 + g*op.cos(theta))

def exact_effective_potential_slope(op, theta, p):
    """dU/dtheta."""
    L, Omega, g = p[0], p[1], p[2]
    return L*(-L*Omega**2*op.cos(theta) + g)*op.sin(theta)

def exact_domain(op, p):
    """Both ends of the domain and the period; None for an open end or without a period."""
    return None, None, 2*op.pi

def exact_axes(op, p):
    """A place about which V**2 and ds are even, and the distance to the next (None if there is no other)."""
    return 0, op.pi


def pass1(lam: Any = None, lam0: Any = None, v0: Any = 0.0, direction: int = 1, *, out: Any = None, L: Any = '1', Omega: Any = '4', g: Any = '9.81', m: Any = '1', **unknown: Any) -> Pass1:
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
    return MODEL.pass1((lam0, v0, direction), (L, Omega, g, m), lam, out, unknown)


def solve(
    lam0: Any = None, v0: Any = 0.0, direction: int = 1, *, point: Any = None, t_max: Any = None,
    contact: str = "bilateral", L: Any = '1', Omega: Any = '4', g: Any = '9.81', m: Any = '1', **unknown: Any,
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
    return MODEL.solve((lam0, v0, direction, point, t_max, contact), (L, Omega, g, m), unknown)


def sweep(
    quantity: Any = None, lam0: Any = None, v0: Any = 0.0, direction: Any = 1, *, lam: Any = None, t_max: Any = None,
    contact: str = "bilateral", gradient: Any = None, client: Any = None, L: Any = '1', Omega: Any = '4',
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
    return MODEL.sweep(quantity, launches, (L, Omega, g, m), lam=lam, client=client, gradient=gradient, unknown=unknown)


def equilibria(*, between: Any = None, L: Any = '1', Omega: Any = '4', g: Any = '9.81', m: Any = '1', **unknown: Any) -> "tuple[Equilibrium, ...]":
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
    return MODEL.equilibria((L, Omega, g, m), between, unknown)


# ---- The same formulas once more, only for speed: a load map in one call, and many orbits at once for sweeps. ----


@compiled(LOAD_MAP)
def load_map(n, w0, level, places, p, out):
    """x, z, ds/dtheta, kappa, V**2 = w0 - 2*(U - level), N (paper, eqs. 8, 13, 15), size of U's terms."""
    places, p, out = carray(places, n), carray(p, 4), carray(out, (7, n))
    L, Omega, g, m = p[0], p[1], p[2], p[3]
    _t2 = 1/L
    _c0 = fabs(L)
    _c1 = fabs(g)
    for i in range(n):
        theta = places[i]
        _t0 = sin(theta)
        _t1 = cos(theta)
        _t3 = _t1*g
        _t4 = Omega**2*_t0**2
        _t5 = L*_t4
        _t6 = speed_squared_from_potential(w0, -L*(_t3 + _t5/2), level)
        out[0, i] = L*_t0
        out[1, i] = -L*_t1
        out[2, i] = L
        out[3, i] = _t2
        out[4, i] = _t6
        out[5, i] = m*(_t2*_t6 + _t3 + _t5)
        out[6, i] = _c0*(_c0*_t4/2 + _c1*fabs(_t1))


@compiled(POTENTIAL_DIVDIFF1_BATCH)
def potential_divdiff1_batch(n, starts, places, offsets, p, out):
    """U[a, theta], ds/dtheta and dU/dtheta."""
    starts, places, offsets, p, out = carray(starts, n), carray(places, n), carray(offsets, n), carray(p, (4, n)), carray(out, (3, n))
    for i in range(n):
        L, Omega, g, a, d = p[0, i], p[1, i], p[2, i], starts[i], offsets[i]
        _t0 = Omega**2
        out[0, i] = L**2*_t0*divdiff1_cos_of_sum(0, 2, a, d)/2 - L*g*divdiff1_cos_of_sum(0, 1, a, d)
        out[1, i] = L
        out[2, i] = L*(-L*_t0*cos_of_sum(0, 1, a, 0, d) + g)*sin_of_sum(0, 1, a, 0, d)


@compiled(POTENTIAL_DIVDIFF2_BATCH)
def potential_divdiff2_batch(n, lows, highs, left, right, p, out):
    """U[a, theta, b] and ds/dtheta; NaN where the points lie too far apart for the closed form."""
    lows, highs, left, right, p, out = carray(lows, n), carray(highs, n), carray(left, n), carray(right, n), carray(p, (8, n)), carray(out, (2, n))
    for i in range(n):
        L, Omega, g, _c0, _c1, _c2, _c3, da = p[0, i], p[1, i], p[2, i], p[4, i], p[5, i], p[6, i], p[7, i], left[i]
        db = right[i]
        from_middle = da/2 - db/2
        _t0 = 2*da
        _t1 = 2*db
        out[0, i] = L**2*Omega**2*(-2*_c0*from_middle*divdiff1_sinc_in_square(_t0, _t1) + _c1*divdiff1_cos_in_square(_t0, _t1)) - L*g*(-_c2*(da/2 - db/2)*divdiff1_sinc_in_square(da, db) + _c3*divdiff1_cos_in_square(da, db))
        out[1, i] = L


@compiled(ORBIT_INVARIANTS_BATCH)
def orbit_invariants_batch(n, lows, highs, middles, rests, halves, p, out):
    """Terms that are constant along an orbit; ``potential_divdiff2_batch`` reads them after the parameters."""
    lows, highs, middles, rests, halves, p, out = carray(lows, n), carray(highs, n), carray(middles, n), carray(rests, n), carray(halves, n), carray(p, (4, n)), carray(out, (4, n))
    for i in range(n):
        middle, rest = middles[i], rests[i]
        out[0, i] = sin_of_sum(0, 2, middle, rest, 0)
        out[1, i] = cos_of_sum(0, 2, middle, rest, 0)
        out[2, i] = sin_of_sum(0, 1, middle, rest, 0)
        out[3, i] = cos_of_sum(0, 1, middle, rest, 0)


@compiled(TIME_INTEGRAND_BATCH)
def time_integrand_batch(n, sine2, cosine2, p, out):
    """(dt/du)**2 at sine2 = sin(u)**2, and its divisor; dt/du integrates to the half period (paper, eq. 17)."""
    p, out = carray(p, (8, n)), carray(out, (2, n))
    for i in range(n):
        L, Omega, g, t, one_minus_tt, sine_squared = p[0, i], p[1, i], p[2, i], p[4, i], p[5, i], p[6, i]
        cosine_fourth = p[7, i]
        _t0 = cosine2 + one_minus_tt*sine2
        _t1 = sine2*t
        _t2 = (_t1 + 1)**2
        _t3 = Omega**2
        _t4 = L*_t3
        _t5 = L*_t2*_t3 - 4*_t1*_t4 - _t2*_t4*sine_squared - _t2*g
        out[0, i] = -L*_t2/(_t0*_t5*cosine_fourth)
        out[1, i] = -4*L*_t0*_t5/_t2


@compiled(INTEGRAND_INVARIANTS_BATCH)
def integrand_invariants_batch(n, halves, p, out):
    """Terms that are constant along an orbit; ``time_integrand_batch`` reads them after the parameters."""
    halves, p, out = carray(halves, (2, n)), carray(p, (4, n)), carray(out, (4, n))
    for i in range(n):
        half, rest = halves[0, i], halves[1, i]
        _t0 = sin_of_sum(0, 1/2, half, rest, 0)**2
        _t1 = cos_of_sum(0, 1/2, half, rest, 0)
        _t2 = (_t1 + 1)**2
        _t3 = 1/_t2
        out[0, i] = _t0*_t3
        out[1, i] = 4*_t1*_t3
        out[2, i] = _t0
        out[3, i] = _t2/4


@compiled(TURNING_POINT_BATCH)
def turning_point_batch(n, offsets, launches, p, out):
    """From V**2 at an offset: half the orbit's width (paper, eq. 14), -dV**2/dq, and a sine's square q at the turn."""
    offsets, launches, p, out = carray(offsets, n), carray(launches, n), carray(p, (4, n)), carray(out, (3, n))
    for i in range(n):
        L, Omega, g, offset, launch = p[0, i], p[1, i], p[2, i], offsets[i], launches[i]
        _t0 = sin(offset/2)**2
        _t1 = Omega**2
        _t2 = 2*_t1
        _t3 = L*(L*_t2 - 2*g)
        _t4 = L**2
        _t5 = _t1*_t4
        _t6 = _t0*_t5
        _t7 = 2*_t3
        _t8 = _t0 + launch/(-_t3 + 4*_t6 + sqrt(16*_t5*launch + (8*_t6 - _t7)**2)/2)
        _t9 = fabs(_t3)
        _t10 = fabs(_t8)
        out[0, i] = 4*atan(sqrt(_t8)/(sqrt(1 - _t8) + 1))
        out[1, i] = 4*_t1*_t4*_t8 - _t10*_t5 - _t7 - _t9/4 - fabs(_t10*_t2*_t4 - 8*_t5*_t8 + _t9/2)/2
        out[2, i] = _t8


@compiled(BOUNDS_BATCH)
def bounds_batch(n, lo, hi, p, out):
    """Bounds of dU/dtheta and ds/dtheta for lo <= theta <= hi."""
    lo, hi, p, out = carray(lo, n), carray(hi, n), carray(p, (4, n)), carray(out, (4, n))
    for i in range(n):
        theta = (lo[i], hi[i])
        L, Omega, g = (p[0, i], p[0, i]), (p[1, i], p[1, i]), (p[2, i], p[2, i])
        out[0, i], out[1, i] = imul(imul(L, iadd(imul(imul(imul(iconst(-1.0), L), ipow(Omega, 2)), icos(theta)), g)), isin(theta))
        out[2, i], out[3, i] = L


def exact_time_integrand(op, half, sine2, cosine2, p):
    """(dt/du)**2 at sine2 = sin(u)**2, and its divisor; dt/du integrates to the half period (paper, eq. 17)."""
    L, Omega, g = p[0], p[1], p[2]
    _t0 = half/2
    _t1 = op.sin(_t0)**2
    _t2 = op.cos(_t0)
    _t3 = 1/(_t2 + 1)**2
    _t4 = _t3*sine2
    _t5 = _t1*_t4
    _t6 = (_t5 + 1)**2
    _t7 = 4*_t2*_t4 + cosine2
    _t8 = Omega**2
    _t9 = L*_t8
    _t10 = L*_t6*_t8 - _t1*_t6*_t9 - 4*_t5*_t9 - _t6*g
    _t11 = 4*L
    return -_t11*_t3*_t6/(_t10*_t7), -_t10*_t11*_t7/_t6


MODEL = CompiledModel(
    name='circle_rotating', parameter='theta', parameters=PARAMETERS, positive=('L',), source=__file__,
    units={'L': 'm', 'Omega': '1/s', 'g': 'm/s**2', 'm': 'kg', 'theta': '1'},
    functions=CompiledFunctions(
        path_and_contact_force, effective_potential, potential_divdiff1, potential_divdiff2, bounds,
    ),
    batch=BatchFunctions(
        potential_divdiff1=potential_divdiff1_batch, potential_divdiff2=potential_divdiff2_batch,
        orbit_invariants=orbit_invariants_batch, time_integrand=time_integrand_batch,
        integrand_invariants=integrand_invariants_batch, turning_point=turning_point_batch, bounds=bounds_batch,
        orbit_rows=4, integrand_rows=4,
    ),
    domain_of=exact_domain, load_map=load_map, axes_of=exact_axes,
    exact=ExactFormulas(
        exact_x, exact_z, exact_ds, exact_kappa, exact_static_normal_load, exact_effective_potential,
        exact_effective_potential_slope, time_integrand=exact_time_integrand,
    ),
)
