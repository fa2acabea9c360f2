# Made by gqm-gen for "kepler". Do not edit: change its declaration and generate again.
# interface 21, input a0162e77d64e, body bf4da3814f1a
"""Planet on its own ellipse, by the eccentric anomaly

x              = a*(-ecc + cos(E))
z              = a*sqrt(1 - ecc**2)*sin(E)
ds/dE          = a*sqrt((1 - ecc**2)*cos(E)**2 + sin(E)**2)
dx/ds          = -sin(E)/sqrt((1 - ecc**2)*cos(E)**2 + sin(E)**2)
dz/ds          = sqrt(1 - ecc**2)*cos(E)/sqrt((1 - ecc**2)*cos(E)**2 + sin(E)**2)
kappa          = sqrt(1 - ecc**2)/(a*((1 - ecc**2)*cos(E)**2 + sin(E)**2)**(3/2))
Theta          = atan2(sqrt(1 - ecc**2)*cos(E), -sin(E)) - atan2(sqrt(1 - ecc**2)*cos(lam0), -sin(lam0))
V**2           = 2*k*(-1/sqrt((1 - ecc**2)*sin(lam0)**2 + (-ecc + cos(lam0))**2) + 1/sqrt((1 - ecc**2)*sin(E)**2 + (-ecc + cos(E))**2))/Abs(a) + v0**2
N              = m*(sqrt(1 - ecc**2)*(2*k*(-1/sqrt((1 - ecc**2)*sin(lam0)**2 + (-ecc + cos(lam0))**2) + 1/sqrt((1 - ecc**2)*sin(E)**2 + (-ecc + cos(E))**2))/Abs(a) + v0**2)/(a*((1 - ecc**2)*cos(E)**2 + sin(E)**2)**(3/2)) - k*sqrt(1 - ecc**2)*((-ecc + cos(E))*cos(E) + sin(E)**2)*Abs(a)/(a**3*((1 - ecc**2)*sin(E)**2 + (-ecc + cos(E))**2)**(3/2)*sqrt((1 - ecc**2)*cos(E)**2 + sin(E)**2)))
A              = -k*(ecc + (1 - ecc**2)*cos(E) - cos(E))*sin(E)*Abs(a)/(a**3*((1 - ecc**2)*sin(E)**2 + (-ecc + cos(E))**2)**(3/2)*sqrt((1 - ecc**2)*cos(E)**2 + sin(E)**2))
dt/dE          = a*sqrt((1 - ecc**2)*cos(E)**2 + sin(E)**2)/sqrt(2*k*(-1/sqrt((1 - ecc**2)*sin(lam0)**2 + (-ecc + cos(lam0))**2) + 1/sqrt((1 - ecc**2)*sin(E)**2 + (-ecc + cos(E))**2))/Abs(a) + v0**2)
turning points : 2*k*(-1/sqrt((1 - ecc**2)*sin(lam0)**2 + (-ecc + cos(lam0))**2) + 1/sqrt((1 - ecc**2)*sin(E)**2 + (-ecc + cos(E))**2))/Abs(a) + v0**2 = 0
liftoff        : sqrt(1 - ecc**2)*(2*k*(-1/sqrt((1 - ecc**2)*sin(lam0)**2 + (-ecc + cos(lam0))**2) + 1/sqrt((1 - ecc**2)*sin(E)**2 + (-ecc + cos(E))**2))/Abs(a) + v0**2)/(a*((1 - ecc**2)*cos(E)**2 + sin(E)**2)**(3/2)) - k*sqrt(1 - ecc**2)*((-ecc + cos(E))*cos(E) + sin(E)**2)*Abs(a)/(a**3*((1 - ecc**2)*sin(E)**2 + (-ecc + cos(E))**2)**(3/2)*sqrt((1 - ecc**2)*cos(E)**2 + sin(E)**2)) = 0
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
    TIME_INTEGRAND_BATCH, BatchFunctions, CompiledFunctions, CompiledModel, ExactFormulas, Pass1, cos, cos_of_sum,
    divdiff1_cos, divdiff1_cos_in_square, divdiff1_cos_of_sum, divdiff1_sin, divdiff1_sin_of_sum,
    divdiff1_sinc_in_square, divdiff2_cos, divdiff2_sin, iabs, iadd, iconst, icos, imul, ipow, isin, isqrt,
    place_from_ends, sin, sin_of_sum, sinc_near, speed_squared_from_potential,
)

if TYPE_CHECKING:
    from gqm_sym.runtime import Equilibrium, Motion, Sweep

# The run-time parameters and their defaults; pass1, solve, sweep and equilibria take them by keyword.
PARAMETERS = {'a': '3/2', 'ecc': '3/5', 'k': '7/2', 'm': '1'}


@compiled(PATH_AND_CONTACT_FORCE)
def path_and_contact_force(n, places, speeds, p, out):
    """x, z, ds/dE, curvature kappa, contact force N = m*(kappa*V**2 + n0), given V**2 (paper, eqs. 8, 15)."""
    places, speeds, p, out = carray(places, n), carray(speeds, n), carray(p, 4), carray(out, (5, n))
    a, ecc, k, m = p[0], p[1], p[2], p[3]
    _t0 = 1 - ecc**2
    _t7 = 1/a
    _c0 = fabs(a)
    _c1 = sqrt(_t0)
    for i in range(n):
        E, v2 = places[i], speeds[i]
        _t1 = cos(E)
        _t2 = _t1 - ecc
        _t3 = sin(E)
        _t4 = _t3**2
        _t5 = _t0*_t1**2 + _t4
        _t6 = sqrt(_t5)
        _t8 = 1/sqrt(_t5)**3
        out[0, i] = _t2*a
        out[1, i] = _c1*_t3*a
        out[2, i] = _t6*a
        out[3, i] = _c1*_t7*_t8
        out[4, i] = m*(-_c0*_c1*k*(_t1*_t2 + _t4)/(_t6*a**3*sqrt(_t0*_t4 + _t2**2)**3) + _c1*_t7*_t8*v2)


@compiled(EFFECTIVE_POTENTIAL)
def effective_potential(n, places, p, out):
    """U per unit mass, V**2 = v0**2 - 2*(U(E) - U(lam0)), and dU/dE (paper, eq. 13)."""
    places, p, out = carray(places, n), carray(p, 4), carray(out, (2, n))
    a, ecc, k = p[0], p[1], p[2]
    _t3 = 1 - ecc**2
    _c0 = fabs(a)
    for i in range(n):
        E = places[i]
        _t0 = cos(E)
        _t1 = -_t0 + ecc
        _t2 = sin(E)
        _t4 = _t1**2 + _t2**2*_t3
        out[0, i] = -k/(_c0*sqrt(_t4))
        out[1, i] = _c0*_t2*k*(_t0*_t3 + _t1)/(a**2*sqrt(_t4)**3)


@compiled(POTENTIAL_DIVDIFF1)
def potential_divdiff1(n, _a, places, offsets, p, out):
    """U[a, E] = (U(E) - U(a))/(E - a) without cancellation, and ds/dE (MATHS, s. 3)."""
    places, offsets, p, out = carray(places, n), carray(offsets, n), carray(p, 4), carray(out, (2, n))
    a, ecc, k = p[0], p[1], p[2]
    _t0 = cos(_a)
    _t1 = sin(_a)
    _t2 = 1 - ecc**2
    _c0 = fabs(a)
    _t3 = sqrt(_t1**2*_t2 + (_t0 - ecc)**2)
    _c3 = _t1
    _c4 = _t0
    _c1 = 1/_t3
    _c2 = _t3
    for i in range(n):
        E, d = places[i], offsets[i]
        _t4 = cos(E)
        _t5 = sin(E)
        _t6 = _t5**2
        _t7 = sqrt(_t2*_t6 + (_t4 - ecc)**2)
        out[0, i] = _c1*k*(_t2*(_c3 + _t5)*divdiff1_sin(_a, E, d) + (_c4 + _t4 - 2*ecc)*divdiff1_cos(_a, E, d))/(_c0*_t7*(_c2 + _t7))
        out[1, i] = a*sqrt(_t2*_t4**2 + _t6)


@compiled(POTENTIAL_DIVDIFF2)
def potential_divdiff2(n, _a, b, left, right, p, out):
    """U[a, E, b] = V**2/(2*(E - a)*(b - E)) from turn a to turn b, and ds/dE (MATHS, s. 3)."""
    left, right, p, out = carray(left, n), carray(right, n), carray(p, 4), carray(out, (2, n))
    a, ecc, k = p[0], p[1], p[2]
    _t0 = -_a + b
    _t1 = cos(_a)
    _t2 = sin(_a)
    _t3 = 1 - ecc**2
    _t5 = cos(b)
    _t6 = sin(b)
    _t13 = -2*ecc
    _c0 = fabs(a)
    _t4 = sqrt(_t2**2*_t3 + (_t1 - ecc)**2)
    _t7 = sqrt(_t3*_t6**2 + (_t5 - ecc)**2)
    _c1 = divdiff1_cos(_a, b, _t0)
    _c2 = divdiff1_sin(_a, b, _t0)
    _c7 = _t2
    _c8 = _t6
    _c9 = _t1
    _c10 = _t5
    _t14 = _c10 + _t13
    _c3 = 1/_t4
    _c4 = _t4
    _c5 = 1/_t7
    _c6 = _t7
    for i in range(n):
        da, db = left[i], right[i]
        E = place_from_ends(_a, b, da, db)
        _t8 = cos(E)
        _t9 = sin(E)
        _t10 = _t9**2
        _t11 = sqrt(_t10*_t3 + (_t8 - ecc)**2)
        _t12 = _c5/_t11
        _t15 = divdiff1_cos(_a, E, da)
        _t16 = divdiff1_sin(_a, E, da)
        _t17 = (_c1*(_c9 + _t14) + _c2*_t3*(_c7 + _c8))*(_t15*(_c9 + _t13 + _t8) + _t16*_t3*(_c7 + _t9))/((_c4 + _c6)*(_c4 + _t11))
        _t18 = 1/(_c6 + _t11)
        out[0, i] = -k*(_c3*_t12*_t17 - _t12*(-_t17*_t18 + _t18*(_c1*_t15 + _t3*(_c2*_t16 + (_c8 + _t9)*divdiff2_sin(_a, E, b, da, db)) + (_t14 + _t8)*divdiff2_cos(_a, E, b, da, db))))/_c0
        out[1, i] = a*sqrt(_t10 + _t3*_t8**2)


@compiled(BOUNDS)
def bounds(lo, hi, p, out):
    """Bounds of dU/dE and ds/dE for lo <= E <= hi, by interval arithmetic."""
    p, out = carray(p, 4), carray(out, 4)
    E = (lo, hi)
    a, ecc, k = (p[0], p[0]), (p[1], p[1]), (p[2], p[2])
    _t0 = isin(E)
    _t1 = icos(E)
    _t2 = iadd(iconst(1.0), imul(iconst(-1.0), ipow(ecc, 2)))
    _t3 = iadd(imul(iconst(-1.0), _t1), ecc)
    _t4 = ipow(_t0, 2)
    out[0], out[1] = imul(imul(imul(imul(imul(_t0, ipow(a, -2)), k), iadd(imul(_t1, _t2), _t3)), ipow(isqrt(iadd(imul(_t2, _t4), ipow(_t3, 2))), -3)), iabs(a))
    out[2], out[3] = imul(a, isqrt(iadd(imul(ipow(_t1, 2), _t2), _t4)))


# The same formulas over a namespace of operations, for extended precision.

def exact_x(op, E, p):
    """Horizontal coordinate."""
    a, ecc = p[0], p[1]
    return a*(-ecc + op.cos(E))

def exact_z(op, E, p):
    """Height."""
    a, ecc = p[0], p[1]
    return a*op.sqrt(1 - ecc**2)*op.sin(E)

def exact_ds(op, E, p):
    """ds/dE."""
    a, ecc = p[0], p[1]
    return a*op.sqrt((1 - ecc**2)*op.cos(E)**2 + op.sin(E)**2)

def exact_kappa(op, E, p):
    """Signed curvature (paper, eq. 8)."""
    a, ecc = p[0], p[1]
    _t0 = 1 - ecc**2
    return op.sqrt(_t0)/(a*(_t0*op.cos(E)**2 + op.sin(E)**2)**(op.mpf(3)/2))

def exact_static_normal_load(op, E, p):
    """n0 = N/m of a body at rest, so that N = m*(kappa*V**2 + n0) (paper, eq. 15)."""
    a, ecc, k = p[0], p[1], p[2]
    _t0 = 1 - ecc**2
    _t1 = op.sin(E)**2
    _t2 = op.cos(E)
    _t3 = _t2 - ecc
    return -op.sqrt(_t0)*k*(_t1 + _t2*_t3)*abs(a)/(a**3*(_t0*_t1 + _t3**2)**(op.mpf(3)/2)*op.sqrt(_t0*_t2**2 + _t1))

def exact_effective_potential(op, E, p):
    """U, so that V**2 + 2*U is constant (paper, eq. 13)."""
    a, ecc, k = p[0], p[1], p[2]
    return -k/(op.sqrt((1 - ecc**2)*op.sin(E)**2 + (-ecc + op.cos(E))**2)*abs(a))

def exact_effective_potential_slope(op, E, p):
    """dU/dE."""
    a, ecc, k = p[0], p[1], p[2]
    _t0 = op.sin(E)
    _t1 = op.cos(E)
    _t2 = 1 - ecc**2
    _t3 = -_t1 + ecc
    return _t0*k*(_t1*_t2 + _t3)*abs(a)/(a**2*(_t0**2*_t2 + _t3**2)**(op.mpf(3)/2))

def exact_domain(op, p):
    """Both ends of the domain and the period; None for an open end or without a period."""
    return None, None, 2*op.pi

def exact_axes(op, p):
    """A place about which V**2 and ds are even, and the distance to the next (None if there is no other)."""
    return 0, op.pi


def pass1(lam: Any = None, lam0: Any = None, v0: Any = 0.0, direction: int = 1, *, out: Any = None, a: Any = '3/2', ecc: Any = '3/5', k: Any = '7/2', m: Any = '1', **unknown: Any) -> Pass1:
    """Position, metric, curvature, V**2 and contact force at places of the curve (Pass 1, no quadrature).

    Parameters
    ----------
    lam : array_like
        Places on the curve, as values of its parameter E.
    lam0, v0, direction
        Launch place, speed and direction (+1 or -1: the sign of ds/dt).
    out : Pass1, optional
        The result of a call before, or six arrays like it, to be filled again.

    Returns
    -------
    Pass1
        Arrays x, z, ds, kappa, v2 and normal_force.
    """
    return MODEL.pass1((lam0, v0, direction), (a, ecc, k, m), lam, out, unknown)


def solve(
    lam0: Any = None, v0: Any = 0.0, direction: int = 1, *, point: Any = None, t_max: Any = None,
    contact: str = "bilateral", a: Any = '3/2', ecc: Any = '3/5', k: Any = '7/2', m: Any = '1', **unknown: Any,
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
    return MODEL.solve((lam0, v0, direction, point, t_max, contact), (a, ecc, k, m), unknown)


def sweep(
    quantity: Any = None, lam0: Any = None, v0: Any = 0.0, direction: Any = 1, *, lam: Any = None, t_max: Any = None,
    contact: str = "bilateral", gradient: Any = None, client: Any = None, a: Any = '3/2', ecc: Any = '3/5',
    k: Any = '7/2', m: Any = '1', **unknown: Any,
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
    return MODEL.sweep(quantity, launches, (a, ecc, k, m), lam=lam, client=client, gradient=gradient, unknown=unknown)


def equilibria(*, between: Any = None, a: Any = '3/2', ecc: Any = '3/5', k: Any = '7/2', m: Any = '1', **unknown: Any) -> "tuple[Equilibrium, ...]":
    """Where a body at rest stays, whether it is stable there, and the frequency of small oscillations.

    Parameters
    ----------
    between : pair of numbers, optional
        The range of E to look in: the whole domain, or one period, if not given.

    Returns
    -------
    tuple of Equilibrium
        Each with lam, stable and frequency (rad/s).
    """
    return MODEL.equilibria((a, ecc, k, m), between, unknown)


# ---- The same formulas once more, only for speed: a load map in one call, and many orbits at once for sweeps. ----


@compiled(LOAD_MAP)
def load_map(n, w0, level, places, p, out):
    """x, z, ds/dE, kappa, V**2 = w0 - 2*(U - level), N (paper, eqs. 8, 13, 15), size of U's terms."""
    places, p, out = carray(places, n), carray(p, 4), carray(out, (7, n))
    a, ecc, k, m = p[0], p[1], p[2], p[3]
    _t0 = ecc**2
    _t8 = 1/a
    _c0 = fabs(a)
    _c1 = fabs(ecc)
    _c2 = fabs(k)
    _t1 = 1 - _t0
    _t10 = 1/_c0
    _c3 = sqrt(_t1)
    for i in range(n):
        E = places[i]
        _t2 = cos(E)
        _t3 = _t2 - ecc
        _t4 = sin(E)
        _t5 = _t4**2
        _t6 = _t1*_t2**2 + _t5
        _t7 = sqrt(_t6)
        _t9 = 1/sqrt(_t6)**3
        _t11 = _t1*_t5 + _t3**2
        _t12 = speed_squared_from_potential(w0, -_t10*k/sqrt(_t11), level)
        out[0, i] = _t3*a
        out[1, i] = _c3*_t4*a
        out[2, i] = _t7*a
        out[3, i] = _c3*_t8*_t9
        out[4, i] = _t12
        out[5, i] = m*(-_c0*_c3*k*(_t2*_t3 + _t5)/(_t7*a**3*sqrt(_t11)**3) + _c3*_t12*_t8*_t9)
        out[6, i] = _c2*_t10*(_t5*(_t0 + 1) + (_c1 + fabs(_t2))**2)/sqrt(fabs(_t11))**3


@compiled(POTENTIAL_DIVDIFF1_BATCH)
def potential_divdiff1_batch(n, starts, places, offsets, p, out):
    """U[a, E], ds/dE and dU/dE."""
    starts, places, offsets, p, out = carray(starts, n), carray(places, n), carray(offsets, n), carray(p, (4, n)), carray(out, (3, n))
    for i in range(n):
        a, ecc, k, _a, d = p[0, i], p[1, i], p[2, i], starts[i], offsets[i]
        _t0 = fabs(a)
        _t1 = cos(_a)
        _t2 = sin(_a)
        _t3 = 1 - ecc**2
        _t4 = sqrt(_t2**2*_t3 + (_t1 - ecc)**2)
        _t5 = cos_of_sum(0, 1, _a, 0, d)
        _t6 = -_t5 + ecc
        _t7 = sin_of_sum(0, 1, _a, 0, d)
        _t8 = _t7**2
        _t9 = _t3*_t8 + _t6**2
        _t10 = sqrt(_t9)
        out[0, i] = k*(_t3*(_t2 + _t7)*divdiff1_sin_of_sum(0, 1, _a, d) + (_t1 + _t5 - 2*ecc)*divdiff1_cos_of_sum(0, 1, _a, d))/(_t0*_t10*_t4*(_t10 + _t4))
        out[1, i] = a*sqrt(_t3*_t5**2 + _t8)
        out[2, i] = _t0*_t7*k*(_t3*_t5 + _t6)/(a**2*sqrt(_t9)**3)


@compiled(POTENTIAL_DIVDIFF2_BATCH)
def potential_divdiff2_batch(n, lows, highs, left, right, p, out):
    """U[a, E, b] and ds/dE; NaN where the points lie too far apart for the closed form."""
    lows, highs, left, right, p, out = carray(lows, n), carray(highs, n), carray(left, n), carray(right, n), carray(p, (17, n)), carray(out, (2, n))
    for i in range(n):
        a, ecc, k, _c0, _c1, _c2, _c3, _c4 = p[0, i], p[1, i], p[2, i], p[4, i], p[5, i], p[6, i], p[7, i], p[8, i]
        _c5, _c6, _c7, _c8, _c9, _c10, _c11 = p[9, i], p[10, i], p[11, i], p[12, i], p[13, i], p[14, i], p[15, i]
        _c12, da, db = p[16, i], left[i], right[i]
        _t0 = divdiff1_cos_in_square(da, db)
        _t1 = da*db
        _t2 = _c3 - _t0*_t1
        _t3 = da/2 - db/2
        _t4 = _t3*divdiff1_sinc_in_square(da, db)
        _t5 = _c1*_t3 - _t1*_t4
        _t6 = _c2*_t5
        _t7 = -_c4*_t2 + _t6
        _t8 = 1 - ecc**2
        _t9 = _c2*_t2 + _c4*_t5
        _t10 = _t9**2
        _t11 = sqrt(_t10*_t8 + (-_t7 - ecc)**2)
        _t12 = _c7/_t11
        _t13 = _c1*_c2
        _t14 = -_c2*_t4 + _c4*_t0
        _t15 = -_t13 - _t14*db
        _t16 = -2*ecc
        _t17 = _c4*_t2 - _t6
        _t18 = _c1*_c4
        _t19 = _c2*_t0 + _c4*_t4
        _t20 = _t18 - _t19*db
        _t21 = _c12 + _t16
        _t22 = (_t15*(_c11 + _t16 + _t17) + _t20*_t8*(_c9 + _t9))*(_c1*_c4*_t8*(_c10 + _c9) - _t13*(_c11 + _t21))/((_c6 + _c8)*(_c6 + _t11))
        _t23 = 1/(_c8 + _t11)
        out[0, i] = -k*(_c5*_t12*_t22 - _t12*(-_t22*_t23 + _t23*(-_t13*_t15 + _t14*(_t17 + _t21) + _t8*(_t18*_t20 + _t19*(_c10 + _t9)))))/_c0
        out[1, i] = a*sqrt(_t10 + _t7**2*_t8)


@compiled(ORBIT_INVARIANTS_BATCH)
def orbit_invariants_batch(n, lows, highs, middles, rests, halves, p, out):
    """Terms that are constant along an orbit; ``potential_divdiff2_batch`` reads them after the parameters."""
    lows, highs, middles, rests, halves, p, out = carray(lows, n), carray(highs, n), carray(middles, n), carray(rests, n), carray(halves, n), carray(p, (4, n)), carray(out, (13, n))
    for i in range(n):
        a, ecc, middle, rest, half, _a, b = p[0, i], p[1, i], middles[i], rests[i], halves[i], lows[i], highs[i]
        _t0 = 1 - ecc**2
        _t1 = sqrt(_t0*sin(_a)**2 + (-ecc + cos(_a))**2)
        _t2 = sqrt(_t0*sin(b)**2 + (-ecc + cos(b))**2)
        _t3 = -half
        out[0, i] = fabs(a)
        out[1, i] = sinc_near(half)
        out[2, i] = sin_of_sum(0, 1, middle, rest, 0)
        out[3, i] = cos(half)
        out[4, i] = cos_of_sum(0, 1, middle, rest, 0)
        out[5, i] = 1/_t1
        out[6, i] = _t1
        out[7, i] = 1/_t2
        out[8, i] = _t2
        out[9, i] = sin_of_sum(0, 1, middle, rest, _t3)
    for i in range(n):
        middle, rest, half = middles[i], rests[i], halves[i]
        _t3 = -half
        out[10, i] = sin_of_sum(0, 1, middle, rest, half)
        out[11, i] = cos_of_sum(0, 1, middle, rest, _t3)
        out[12, i] = cos_of_sum(0, 1, middle, rest, half)


@compiled(TIME_INTEGRAND_BATCH)
def time_integrand_batch(n, sine2, cosine2, p, out):
    """(dt/du)**2 at sine2 = sin(u)**2, and its divisor; dt/du integrates to the half period (paper, eq. 17)."""
    p, out = carray(p, (11, n)), carray(out, (2, n))
    for i in range(n):
        a, ecc, k, t, one_minus_t, one_minus_tt = p[0, i], p[1, i], p[2, i], p[4, i], p[5, i], p[6, i]
        sine_squared, cosine_fourth, _c0, _c1 = p[7, i], p[8, i], p[9, i], p[10, i]
        _t0 = sine2*t
        _t1 = _t0 + 1
        _t2 = 1 - ecc**2
        _t3 = 4*_t0
        _t4 = _t1**2
        _t5 = -_t4
        _t6 = 16*_t0
        _t7 = _t4*ecc
        _t8 = sqrt((_t2*_t6*(-_t3 - _t5) + (-8*_t0 - _t5 - _t7)**2)/_t1**4)
        _t9 = cosine2 + one_minus_tt*sine2
        _t10 = _t3*ecc + _t4 + _t7*sine_squared - _t7
        _t11 = _c1 + _t8
        _t12 = (cosine2 + one_minus_t*sine2)**2
        _t13 = _c0*_c1/_t4
        out[0, i] = _t11*_t13*_t8*a**2*(_t12*_t6 + _t2*(_t12 - _t3)**2)/(2*_t10*_t9*cosine_fourth*ecc*k)
        out[1, i] = 8*_t10*_t13*_t9*ecc*k/(_t11*_t8)


@compiled(INTEGRAND_INVARIANTS_BATCH)
def integrand_invariants_batch(n, halves, p, out):
    """Terms that are constant along an orbit; ``time_integrand_batch`` reads them after the parameters."""
    halves, p, out = carray(halves, (2, n)), carray(p, (4, n)), carray(out, (7, n))
    for i in range(n):
        a, ecc, half, rest = p[0, i], p[1, i], halves[0, i], halves[1, i]
        _t0 = sin_of_sum(0, 1/2, half, rest, 0)**2
        _t1 = cos_of_sum(0, 1/2, half, rest, 0)
        _t2 = _t1 + 1
        _t3 = _t2**2
        _t4 = 1/_t3
        out[0, i] = _t0*_t4
        out[1, i] = 2*_t1/_t2
        out[2, i] = 4*_t1*_t4
        out[3, i] = _t0
        out[4, i] = _t3/4
        out[5, i] = fabs(a)
        out[6, i] = sqrt(4*_t0*(1 - _t0)*(1 - ecc**2) + (-2*_t0 - ecc + 1)**2)


@compiled(BOUNDS_BATCH)
def bounds_batch(n, lo, hi, p, out):
    """Bounds of dU/dE and ds/dE for lo <= E <= hi."""
    lo, hi, p, out = carray(lo, n), carray(hi, n), carray(p, (4, n)), carray(out, (4, n))
    for i in range(n):
        E = (lo[i], hi[i])
        a, ecc, k = (p[0, i], p[0, i]), (p[1, i], p[1, i]), (p[2, i], p[2, i])
        _t0 = isin(E)
        _t1 = icos(E)
        _t2 = iadd(iconst(1.0), imul(iconst(-1.0), ipow(ecc, 2)))
        _t3 = iadd(imul(iconst(-1.0), _t1), ecc)
        _t4 = ipow(_t0, 2)
        out[0, i], out[1, i] = imul(imul(imul(imul(imul(_t0, ipow(a, -2)), k), iadd(imul(_t1, _t2), _t3)), ipow(isqrt(iadd(imul(_t2, _t4), ipow(_t3, 2))), -3)), iabs(a))
        out[2, i], out[3, i] = imul(a, isqrt(iadd(imul(ipow(_t1, 2), _t2), _t4)))


def exact_time_integrand(op, half, sine2, cosine2, p):
    """(dt/du)**2 at sine2 = sin(u)**2, and its divisor; dt/du integrates to the half period (paper, eq. 17)."""
    a, ecc, k = p[0], p[1], p[2]
    _t0 = abs(a)
    _t1 = half/2
    _t2 = op.cos(_t1)
    _t3 = _t2 + 1
    _t4 = 1/_t3**2
    _t5 = _t4*sine2
    _t6 = 4*_t2*_t5 + cosine2
    _t7 = op.sin(_t1)**2
    _t8 = _t5*_t7
    _t9 = _t8 + 1
    _t10 = _t9**2
    _t11 = 1/_t10
    _t12 = 1 - ecc**2
    _t13 = op.sqrt(4*_t12*_t7*(1 - _t7) + (-2*_t7 - ecc + 1)**2)
    _t14 = (2*_t2*sine2/_t3 + cosine2)**2
    _t15 = 16*_t8
    _t16 = 4*_t8
    _t17 = _t10*ecc
    _t18 = _t10 + _t16*ecc + _t17*_t7 - _t17
    _t19 = -_t10
    _t20 = op.sqrt((_t12*_t15*(-_t16 - _t19) + (-_t17 - _t19 - 8*_t8)**2)/_t9**4)
    _t21 = _t13 + _t20
    return 2*_t0*_t11*_t13*_t20*_t21*_t4*a**2*(_t12*(_t14 - _t16)**2 + _t14*_t15)/(_t18*_t6*ecc*k), 8*_t11*_t18*_t6*ecc*k/(_t0*_t13*_t20*_t21)


MODEL = CompiledModel(
    name='kepler', parameter='E', parameters=PARAMETERS, positive=('a',), source=__file__,
    units={'E': '1', 'a': 'm', 'ecc': '1', 'g': 'm/s**2', 'k': 'm**3/s**2', 'm': 'kg'},
    functions=CompiledFunctions(
        path_and_contact_force, effective_potential, potential_divdiff1, potential_divdiff2, bounds,
    ),
    batch=BatchFunctions(
        potential_divdiff1=potential_divdiff1_batch, potential_divdiff2=potential_divdiff2_batch,
        orbit_invariants=orbit_invariants_batch, time_integrand=time_integrand_batch,
        integrand_invariants=integrand_invariants_batch, bounds=bounds_batch, orbit_rows=13, integrand_rows=7,
    ),
    domain_of=exact_domain, load_map=load_map, axes_of=exact_axes,
    exact=ExactFormulas(
        exact_x, exact_z, exact_ds, exact_kappa, exact_static_normal_load, exact_effective_potential,
        exact_effective_potential_slope, time_integrand=exact_time_integrand,
    ),
)
