# Made by gqm-gen for "spiral_central". Do not edit: change its declaration and generate again.
# interface 21, input cd2a37956d84, body 81f0637e14b7
"""Bead on a logarithmic spiral, drawn to its pole

x              = r0*exp(b*theta)*cos(theta)
z              = r0*exp(b*theta)*sin(theta)
ds/dtheta      = r0*sqrt(b**2 + 1)*exp(b*theta)
dx/ds          = (b*cos(theta) - sin(theta))/sqrt(b**2 + 1)
dz/ds          = (b*sin(theta) + cos(theta))/sqrt(b**2 + 1)
kappa          = exp(-b*theta)/(r0*sqrt(b**2 + 1))
Theta          = -lam0 + theta
V**2           = 2*k*(exp(-b*theta) - exp(-b*lam0))/Abs(r0) + v0**2
N              = m*(-k*exp(-2*b*theta)*Abs(r0)/(r0**3*sqrt(b**2 + 1)) + (2*k*(exp(-b*theta) - exp(-b*lam0))/Abs(r0) + v0**2)*exp(-b*theta)/(r0*sqrt(b**2 + 1)))
A              = -b*k*exp(-2*b*theta)/(r0*sqrt(b**2 + 1)*Abs(r0))
dt/dtheta      = r0*sqrt(b**2 + 1)*exp(b*theta)/sqrt(2*k*(exp(-b*theta) - exp(-b*lam0))/Abs(r0) + v0**2)
turning points : 2*k*(exp(-b*theta) - exp(-b*lam0))/Abs(r0) + v0**2 = 0
liftoff        : -k*exp(-2*b*theta)*Abs(r0)/(r0**3*sqrt(b**2 + 1)) + (2*k*(exp(-b*theta) - exp(-b*lam0))/Abs(r0) + v0**2)*exp(-b*theta)/(r0*sqrt(b**2 + 1)) = 0
"""

from math import fabs, sqrt
from typing import TYPE_CHECKING, Any

from numba import carray

from gqm_sym.runtime import compiler

# Before anything else is asked of the runtime, so that another version of it is told from a broken one.
compiled = compiler(__file__, interface=21)

from gqm_sym.runtime.vocabulary import (
    BOUNDS, BOUNDS_BATCH, EFFECTIVE_POTENTIAL, LOAD_MAP, ORBIT_INVARIANTS_BATCH, PATH_AND_CONTACT_FORCE,
    POTENTIAL_DIVDIFF1, POTENTIAL_DIVDIFF1_BATCH, POTENTIAL_DIVDIFF2, POTENTIAL_DIVDIFF2_BATCH, BatchFunctions,
    CompiledFunctions, CompiledModel, ExactFormulas, Pass1, cos, divdiff1_cosh_in_square, divdiff1_exp,
    divdiff1_sinhc_in_square, divdiff2_exp, exp, iabs, iadd, iconst, idiv, iexp, imul, ipow, isqrt, place_from_ends,
    sin, speed_squared_from_potential,
)

if TYPE_CHECKING:
    from gqm_sym.runtime import Equilibrium, Motion, Sweep

# The run-time parameters and their defaults; pass1, solve, sweep and equilibria take them by keyword.
PARAMETERS = {'r0': '1', 'b': '0.15', 'k': '2', 'm': '1'}


@compiled(PATH_AND_CONTACT_FORCE)
def path_and_contact_force(n, places, speeds, p, out):
    """x, z, ds/dtheta, curvature kappa, contact force N = m*(kappa*V**2 + n0), given V**2 (paper, eqs. 8, 15)."""
    places, speeds, p, out = carray(places, n), carray(speeds, n), carray(p, 4), carray(out, (5, n))
    r0, b, k, m = p[0], p[1], p[2], p[3]
    _t0 = sqrt(b**2 + 1)
    _t3 = 1/r0
    _c0 = fabs(r0)
    _c1 = 1/_t0
    _c2 = _t0
    for i in range(n):
        theta, v2 = places[i], speeds[i]
        _t1 = b*theta
        _t2 = r0*exp(_t1)
        _t4 = exp(-_t1)
        out[0, i] = _t2*cos(theta)
        out[1, i] = _t2*sin(theta)
        out[2, i] = _c2*_t2
        out[3, i] = _c1*_t3*_t4
        out[4, i] = m*(-_c0*_c1*k*exp(-2*_t1)/r0**3 + _c1*_t3*_t4*v2)


@compiled(EFFECTIVE_POTENTIAL)
def effective_potential(n, places, p, out):
    """U per unit mass, V**2 = v0**2 - 2*(U(theta) - U(lam0)), and dU/dtheta (paper, eq. 13)."""
    places, p, out = carray(places, n), carray(p, 4), carray(out, (2, n))
    r0, b, k = p[0], p[1], p[2]
    _c0 = fabs(r0)
    for i in range(n):
        theta = places[i]
        _t0 = k*exp(-b*theta)/_c0
        out[0, i] = -_t0
        out[1, i] = _t0*b


@compiled(POTENTIAL_DIVDIFF1)
def potential_divdiff1(n, a, places, offsets, p, out):
    """U[a, theta] = (U(theta) - U(a))/(theta - a) without cancellation, and ds/dtheta (MATHS, s. 3)."""
    places, offsets, p, out = carray(places, n), carray(offsets, n), carray(p, 4), carray(out, (2, n))
    r0, b, k = p[0], p[1], p[2]
    _c0 = fabs(r0)
    _c1 = sqrt(b**2 + 1)
    for i in range(n):
        theta, d = places[i], offsets[i]
        _t0 = b*theta
        out[0, i] = b*k*divdiff1_exp(-a*b, -_t0, -b*d)/_c0
        out[1, i] = _c1*r0*exp(_t0)


@compiled(POTENTIAL_DIVDIFF2)
def potential_divdiff2(n, a, _b, left, right, p, out):
    """U[a, theta, b] = V**2/(2*(theta - a)*(b - theta)) from turn a to turn b, and ds/dtheta (MATHS, s. 3)."""
    left, right, p, out = carray(left, n), carray(right, n), carray(p, 4), carray(out, (2, n))
    r0, b, k = p[0], p[1], p[2]
    _t0 = b**2
    _c0 = fabs(r0)
    _c1 = sqrt(_t0 + 1)
    for i in range(n):
        da, db = left[i], right[i]
        theta = place_from_ends(a, _b, da, db)
        _t1 = b*theta
        out[0, i] = -_t0*k*divdiff2_exp(-a*b, -_t1, -_b*b, -b*da, -b*db)/_c0
        out[1, i] = _c1*r0*exp(_t1)


@compiled(BOUNDS)
def bounds(lo, hi, p, out):
    """Bounds of dU/dtheta and ds/dtheta for lo <= theta <= hi, by interval arithmetic."""
    p, out = carray(p, 4), carray(out, 4)
    theta = (lo, hi)
    r0, b, k = (p[0], p[0]), (p[1], p[1]), (p[2], p[2])
    _t0 = imul(b, theta)
    out[0], out[1] = imul(imul(imul(b, k), iexp(imul(iconst(-1.0), _t0))), idiv(iconst(1.0), iabs(r0)))
    out[2], out[3] = imul(imul(r0, isqrt(iadd(ipow(b, 2), iconst(1.0)))), iexp(_t0))


# The same formulas over a namespace of operations, for extended precision.

def exact_x(op, theta, p):
    """Horizontal coordinate."""
    r0, b = p[0], p[1]
    return r0*op.exp(b*theta)*op.cos(theta)

def exact_z(op, theta, p):
    """Height."""
    r0, b = p[0], p[1]
    return r0*op.exp(b*theta)*op.sin(theta)

def exact_ds(op, theta, p):
    """ds/dtheta."""
    r0, b = p[0], p[1]
    return r0*op.sqrt(b**2 + 1)*op.exp(b*theta)

def exact_kappa(op, theta, p):
    """Signed curvature (paper, eq. 8)."""
    r0, b = p[0], p[1]
    return op.exp(-b*theta)/(r0*op.sqrt(b**2 + 1))

def exact_static_normal_load(op, theta, p):
    """n0 = N/m of a body at rest, so that N = m*(kappa*V**2 + n0) (paper, eq. 15)."""
    r0, b, k = p[0], p[1], p[2]
    return -k*op.exp(-2*b*theta)*abs(r0)/(r0**3*op.sqrt(b**2 + 1))

def exact_effective_potential(op, theta, p):
    """U, so that V**2 + 2*U is constant (paper, eq. 13)."""
    r0, b, k = p[0], p[1], p[2]
    return -k*op.exp(-b*theta)/abs(r0)

def exact_effective_potential_slope(op, theta, p):
    """dU/dtheta."""
    r0, b, k = p[0], p[1], p[2]
    return b*k*op.exp(-b*theta)/abs(r0)

def exact_domain(op, p):
    """Both ends of the domain and the period; None for an open end or without a period."""
    return None, None, None


def pass1(lam: Any = None, lam0: Any = None, v0: Any = 0.0, direction: int = 1, *, out: Any = None, r0: Any = '1', b: Any = '0.15', k: Any = '2', m: Any = '1', **unknown: Any) -> Pass1:
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
    return MODEL.pass1((lam0, v0, direction), (r0, b, k, m), lam, out, unknown)


def solve(
    lam0: Any = None, v0: Any = 0.0, direction: int = 1, *, point: Any = None, t_max: Any = None,
    contact: str = "bilateral", r0: Any = '1', b: Any = '0.15', k: Any = '2', m: Any = '1', **unknown: Any,
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
    return MODEL.solve((lam0, v0, direction, point, t_max, contact), (r0, b, k, m), unknown)


def sweep(
    quantity: Any = None, lam0: Any = None, v0: Any = 0.0, direction: Any = 1, *, lam: Any = None, t_max: Any = None,
    contact: str = "bilateral", gradient: Any = None, client: Any = None, r0: Any = '1', b: Any = '0.15', k: Any = '2',
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
    return MODEL.sweep(quantity, launches, (r0, b, k, m), lam=lam, client=client, gradient=gradient, unknown=unknown)


def equilibria(*, between: Any = None, r0: Any = '1', b: Any = '0.15', k: Any = '2', m: Any = '1', **unknown: Any) -> "tuple[Equilibrium, ...]":
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
    return MODEL.equilibria((r0, b, k, m), between, unknown)


# ---- The same formulas once more, only for speed: a load map in one call, and many orbits at once for sweeps. ----


@compiled(LOAD_MAP)
def load_map(n, w0, level, places, p, out):
    """x, z, ds/dtheta, kappa, V**2 = w0 - 2*(U - level), N (paper, eqs. 8, 13, 15), size of U's terms."""
    places, p, out = carray(places, n), carray(p, 4), carray(out, (7, n))
    r0, b, k, m = p[0], p[1], p[2], p[3]
    _t0 = sqrt(b**2 + 1)
    _t3 = 1/r0
    _c0 = fabs(k)
    _c1 = fabs(r0)
    _c2 = 1/_t0
    _c3 = _t0
    for i in range(n):
        theta = places[i]
        e0 = exp(b*theta)
        _t1 = e0*r0
        _t2 = 1/e0
        _t4 = _t2/_c1
        _t5 = speed_squared_from_potential(w0, -_t4*k, level)
        out[0, i] = _t1*cos(theta)
        out[1, i] = _t1*sin(theta)
        out[2, i] = _c3*_t1
        out[3, i] = _c2*_t2*_t3
        out[4, i] = _t5
        out[5, i] = m*(-_c1*_c2*k*exp(-2*b*theta)/r0**3 + _c2*_t2*_t3*_t5)
        out[6, i] = _c0*_t4


@compiled(POTENTIAL_DIVDIFF1_BATCH)
def potential_divdiff1_batch(n, starts, places, offsets, p, out):
    """U[a, theta], ds/dtheta and dU/dtheta."""
    starts, places, offsets, p, out = carray(starts, n), carray(places, n), carray(offsets, n), carray(p, (4, n)), carray(out, (3, n))
    for i in range(n):
        r0, b, k, a, theta, d = p[0, i], p[1, i], p[2, i], starts[i], places[i], offsets[i]
        _t0 = b*theta
        _t1 = -_t0
        _t2 = b*k/fabs(r0)
        out[0, i] = _t2*divdiff1_exp(-a*b, _t1, -b*d)
        out[1, i] = r0*sqrt(b**2 + 1)*exp(_t0)
        out[2, i] = _t2*exp(_t1)


@compiled(POTENTIAL_DIVDIFF2_BATCH)
def potential_divdiff2_batch(n, lows, highs, left, right, p, out):
    """U[a, theta, b] and ds/dtheta; NaN where the points lie too far apart for the closed form."""
    lows, highs, left, right, p, out = carray(lows, n), carray(highs, n), carray(left, n), carray(right, n), carray(p, (7, n)), carray(out, (2, n))
    for i in range(n):
        r0, b, k, _c0, _c1, _c2, a, _b = p[0, i], p[1, i], p[2, i], p[4, i], p[5, i], p[6, i], lows[i], highs[i]
        da, db = left[i], right[i]
        from_middle = da/2 - db/2
        theta = place_from_ends(a, _b, da, db)
        _t0 = -b*da
        _t1 = -b*db
        out[0, i] = -_c2*b**2*k*(-b*from_middle*divdiff1_sinhc_in_square(_t0, _t1) + divdiff1_cosh_in_square(_t0, _t1))/_c0
        out[1, i] = _c1*r0*exp(b*theta)


@compiled(ORBIT_INVARIANTS_BATCH)
def orbit_invariants_batch(n, lows, highs, middles, rests, halves, p, out):
    """Terms that are constant along an orbit; ``potential_divdiff2_batch`` reads them after the parameters."""
    lows, highs, middles, rests, halves, p, out = carray(lows, n), carray(highs, n), carray(middles, n), carray(rests, n), carray(halves, n), carray(p, (4, n)), carray(out, (3, n))
    for i in range(n):
        r0, b, middle, rest = p[0, i], p[1, i], middles[i], rests[i]
        _t0 = exp(-b*middle)
        out[0, i] = fabs(r0)
        out[1, i] = sqrt(b**2 + 1)
        out[2, i] = -_t0*b*rest + _t0


@compiled(BOUNDS_BATCH)
def bounds_batch(n, lo, hi, p, out):
    """Bounds of dU/dtheta and ds/dtheta for lo <= theta <= hi."""
    lo, hi, p, out = carray(lo, n), carray(hi, n), carray(p, (4, n)), carray(out, (4, n))
    for i in range(n):
        theta = (lo[i], hi[i])
        r0, b, k = (p[0, i], p[0, i]), (p[1, i], p[1, i]), (p[2, i], p[2, i])
        _t0 = imul(b, theta)
        out[0, i], out[1, i] = imul(imul(imul(b, k), iexp(imul(iconst(-1.0), _t0))), idiv(iconst(1.0), iabs(r0)))
        out[2, i], out[3, i] = imul(imul(r0, isqrt(iadd(ipow(b, 2), iconst(1.0)))), iexp(_t0))


MODEL = CompiledModel(
    name='spiral_central', parameter='theta', parameters=PARAMETERS, positive=('r0',), source=__file__,
    units={'b': '1', 'g': 'm/s**2', 'k': 'm**3/s**2', 'm': 'kg', 'r0': 'm', 'theta': '1'},
    functions=CompiledFunctions(
        path_and_contact_force, effective_potential, potential_divdiff1, potential_divdiff2, bounds,
    ),
    batch=BatchFunctions(
        potential_divdiff1=potential_divdiff1_batch, potential_divdiff2=potential_divdiff2_batch,
        orbit_invariants=orbit_invariants_batch, bounds=bounds_batch, orbit_rows=3,
    ),
    domain_of=exact_domain, load_map=load_map,
    exact=ExactFormulas(
        exact_x, exact_z, exact_ds, exact_kappa, exact_static_normal_load, exact_effective_potential,
        exact_effective_potential_slope,
    ),
)
