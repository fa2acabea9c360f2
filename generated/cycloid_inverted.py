# Made by gqm-gen for "cycloid_inverted". Do not edit: change its declaration and generate again.
# interface 21, input 01e055bdd46f, body 347cae9f26c2
"""Bead in an inverted cycloid

x              = R*(theta - sin(theta))
z              = -R*(1 - cos(theta))
ds/dtheta      = 2*R*sin(theta/2)
dx/ds          = sin(theta/2)
dz/ds          = -cos(theta/2)
kappa          = 1/(4*R*sin(theta/2))
Theta          = -lam0/2 + theta/2
V**2           = 2*R*g*(cos(lam0) - cos(theta)) + v0**2
N              = m*(g*sin(theta/2) + (2*R*g*(cos(lam0) - cos(theta)) + v0**2)/(4*R*sin(theta/2)))
A              = g*cos(theta/2)
dt/dtheta      = 2*R*sin(theta/2)/sqrt(2*R*g*(cos(lam0) - cos(theta)) + v0**2)
turning points : 2*R*g*(cos(lam0) - cos(theta)) + v0**2 = 0
liftoff        : g*sin(theta/2) + (2*R*g*(cos(lam0) - cos(theta)) + v0**2)/(4*R*sin(theta/2)) = 0
"""

from math import fabs
from typing import TYPE_CHECKING, Any

from numba import carray

from gqm_sym.runtime import compiler

# Before anything else is asked of the runtime, so that another version of it is told from a broken one.
compiled = compiler(__file__, interface=21)

from gqm_sym.runtime.vocabulary import (
    AGM_ARGUMENTS_BATCH, BOUNDS, BOUNDS_BATCH, EFFECTIVE_POTENTIAL, LOAD_MAP, ORBIT_INVARIANTS_BATCH,
    PATH_AND_CONTACT_FORCE, POTENTIAL_DIVDIFF1, POTENTIAL_DIVDIFF1_BATCH, POTENTIAL_DIVDIFF2, POTENTIAL_DIVDIFF2_BATCH,
    BatchFunctions, CompiledFunctions, CompiledModel, ExactFormulas, Pass1, cos, cos_of_sum, divdiff1_cos,
    divdiff1_cos_in_square, divdiff1_cos_of_sum, divdiff1_sinc_in_square, divdiff2_cos, iconst, icos, idiv, imul, isin,
    place_from_ends, sin, sin_of_sum, speed_squared_from_potential,
)

if TYPE_CHECKING:
    from gqm_sym.runtime import Equilibrium, Motion, Sweep

# The run-time parameters and their defaults; pass1, solve, sweep and equilibria take them by keyword.
PARAMETERS = {'R': '0.5', 'g': '9.81', 'm': '1'}


@compiled(PATH_AND_CONTACT_FORCE)
def path_and_contact_force(n, places, speeds, p, out):
    """x, z, ds/dtheta, curvature kappa, contact force N = m*(kappa*V**2 + n0), given V**2 (paper, eqs. 8, 15)."""
    places, speeds, p, out = carray(places, n), carray(speeds, n), carray(p, 3), carray(out, (5, n))
    R, g, m = p[0], p[1], p[2]
    for i in range(n):
        theta, v2 = places[i], speeds[i]
        _t0 = sin(theta/2)
        _t1 = 1/(4*R*_t0)
        out[0, i] = R*(theta - sin(theta))
        out[1, i] = -R*(1 - cos(theta))
        out[2, i] = 2*R*_t0
        out[3, i] = _t1
        out[4, i] = m*(_t0*g + _t1*v2)


@compiled(EFFECTIVE_POTENTIAL)
def effective_potential(n, places, p, out):
    """U per unit mass, V**2 = v0**2 - 2*(U(theta) - U(lam0)), and dU/dtheta (paper, eq. 13)."""
    places, p, out = carray(places, n), carray(p, 3), carray(out, (2, n))
    R, g = p[0], p[1]
    _t0 = R*g
    for i in range(n):
        theta = places[i]
        _t1 = theta/2
        out[0, i] = -_t0*(1 - cos(theta))
        out[1, i] = -2*_t0*sin(_t1)*cos(_t1)


@compiled(POTENTIAL_DIVDIFF1)
def potential_divdiff1(n, a, places, offsets, p, out):
    """U[a, theta] = (U(theta) - U(a))/(theta - a) without cancellation, and ds/dtheta (MATHS, s. 3)."""
    places, offsets, p, out = carray(places, n), carray(offsets, n), carray(p, 3), carray(out, (2, n))
    R, g = p[0], p[1]
    for i in range(n):
        theta, d = places[i], offsets[i]
        out[0, i] = R*g*divdiff1_cos(a, theta, d)
        out[1, i] = 2*R*sin(theta/2)


@compiled(POTENTIAL_DIVDIFF2)
def potential_divdiff2(n, a, b, left, right, p, out):
    """U[a, theta, b] = V**2/(2*(theta - a)*(b - theta)) from turn a to turn b, and ds/dtheta (MATHS, s. 3)."""
    left, right, p, out = carray(left, n), carray(right, n), carray(p, 3), carray(out, (2, n))
    R, g = p[0], p[1]
    for i in range(n):
        da, db = left[i], right[i]
        theta = place_from_ends(a, b, da, db)
        out[0, i] = R*g*divdiff2_cos(a, theta, b, da, db)
        out[1, i] = 2*R*sin(theta/2)


@compiled(BOUNDS)
def bounds(lo, hi, p, out):
    """Bounds of dU/dtheta and ds/dtheta for lo <= theta <= hi, by interval arithmetic."""
    p, out = carray(p, 3), carray(out, 4)
    theta = (lo, hi)
    R, g = (p[0], p[0]), (p[1], p[1])
    _t0 = imul(idiv(iconst(1.0), iconst(2.0)), theta)
    _t1 = imul(imul(iconst(2.0), R), isin(_t0))
    out[0], out[1] = imul(imul(imul(iconst(-1.0), _t1), g), icos(_t0))
    out[2], out[3] = _t1


# The same formulas over a namespace of operations, for extended precision.

def exact_x(op, theta, p):
    """Horizontal coordinate."""
    R = p[0]
    return R*(theta - op.sin(theta))

def exact_z(op, theta, p):
    """Height."""
    R = p[0]
    return -R*(1 - op.cos(theta))

def exact_ds(op, theta, p):
    """ds/dtheta."""
    R = p[0]
    return 2*R*op.sin(theta/2)

def exact_kappa(op, theta, p):
    """Signed curvature (paper, eq. 8)."""
    R = p[0]
    return 1/(4*R*op.sin(theta/2))

def exact_static_normal_load(op, theta, p):
    """n0 = N/m of a body at rest, so that N = m*(kappa*V**2 + n0) (paper, eq. 15)."""
    g = p[1]
    return g*op.sin(theta/2)

def exact_effective_potential(op, theta, p):
    """U, so that V**2 + 2*U is constant (paper, eq. 13)."""
    R, g = p[0], p[1]
    return -R*g*(1 - op.cos(theta))

def exact_effective_potential_slope(op, theta, p):
    """dU/dtheta."""
    R, g = p[0], p[1]
    _t0 = theta/2
    return -2*R*g*op.sin(_t0)*op.cos(_t0)

def exact_domain(op, p):
    """Both ends of the domain and the period; None for an open end or without a period."""
    return 0, 2*op.pi, None

def exact_axes(op, p):
    """A place about which V**2 and ds are even, and the distance to the next (None if there is no other)."""
    return op.pi, op.pi


def pass1(lam: Any = None, lam0: Any = None, v0: Any = 0.0, direction: int = 1, *, out: Any = None, R: Any = '0.5', g: Any = '9.81', m: Any = '1', **unknown: Any) -> Pass1:
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
    return MODEL.pass1((lam0, v0, direction), (R, g, m), lam, out, unknown)


def solve(
    lam0: Any = None, v0: Any = 0.0, direction: int = 1, *, point: Any = None, t_max: Any = None,
    contact: str = "bilateral", R: Any = '0.5', g: Any = '9.81', m: Any = '1', **unknown: Any,
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
    return MODEL.solve((lam0, v0, direction, point, t_max, contact), (R, g, m), unknown)


def sweep(
    quantity: Any = None, lam0: Any = None, v0: Any = 0.0, direction: Any = 1, *, lam: Any = None, t_max: Any = None,
    contact: str = "bilateral", gradient: Any = None, client: Any = None, R: Any = '0.5', g: Any = '9.81', m: Any = '1',
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
    return MODEL.sweep(quantity, launches, (R, g, m), lam=lam, client=client, gradient=gradient, unknown=unknown)


def equilibria(*, between: Any = None, R: Any = '0.5', g: Any = '9.81', m: Any = '1', **unknown: Any) -> "tuple[Equilibrium, ...]":
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
    return MODEL.equilibria((R, g, m), between, unknown)


# ---- The same formulas once more, only for speed: a load map in one call, and many orbits at once for sweeps. ----


@compiled(LOAD_MAP)
def load_map(n, w0, level, places, p, out):
    """x, z, ds/dtheta, kappa, V**2 = w0 - 2*(U - level), N (paper, eqs. 8, 13, 15), size of U's terms."""
    places, p, out = carray(places, n), carray(p, 3), carray(out, (7, n))
    R, g, m = p[0], p[1], p[2]
    _c0 = fabs(R)
    _c1 = fabs(g)
    for i in range(n):
        theta = places[i]
        _t0 = cos(theta)
        _t1 = sin(theta/2)
        _t2 = 1/(4*R*_t1)
        _t3 = speed_squared_from_potential(w0, R*_t0*g, level)
        out[0, i] = R*(theta - sin(theta))
        out[1, i] = -R*(1 - _t0)
        out[2, i] = 2*R*_t1
        out[3, i] = _t2
        out[4, i] = _t3
        out[5, i] = m*(_t1*g + _t2*_t3)
        out[6, i] = _c0*_c1*fabs(_t0)


@compiled(POTENTIAL_DIVDIFF1_BATCH)
def potential_divdiff1_batch(n, starts, places, offsets, p, out):
    """U[a, theta], ds/dtheta and dU/dtheta."""
    starts, places, offsets, p, out = carray(starts, n), carray(places, n), carray(offsets, n), carray(p, (3, n)), carray(out, (3, n))
    for i in range(n):
        R, g, a, d = p[0, i], p[1, i], starts[i], offsets[i]
        _t0 = R*g
        _t1 = 2*sin_of_sum(0, 1/2, a, 0, d)
        out[0, i] = _t0*divdiff1_cos_of_sum(0, 1, a, d)
        out[1, i] = R*_t1
        out[2, i] = -_t0*_t1*cos_of_sum(0, 1/2, a, 0, d)


@compiled(POTENTIAL_DIVDIFF2_BATCH)
def potential_divdiff2_batch(n, lows, highs, left, right, p, out):
    """U[a, theta, b] and ds/dtheta; NaN where the points lie too far apart for the closed form."""
    lows, highs, left, right, p, out = carray(lows, n), carray(highs, n), carray(left, n), carray(right, n), carray(p, (7, n)), carray(out, (2, n))
    for i in range(n):
        R, g, _c0, _c1, middle, rest, da, db = p[0, i], p[1, i], p[3, i], p[4, i], p[5, i], p[6, i], left[i], right[i]
        _t0 = da/2 - db/2
        out[0, i] = R*g*(-_c0*_t0*divdiff1_sinc_in_square(da, db) + _c1*divdiff1_cos_in_square(da, db))
        out[1, i] = 2*R*sin_of_sum(0, 1/2, middle, rest, _t0)


@compiled(ORBIT_INVARIANTS_BATCH)
def orbit_invariants_batch(n, lows, highs, middles, rests, halves, p, out):
    """Terms that are constant along an orbit; ``potential_divdiff2_batch`` reads them after the parameters."""
    lows, highs, middles, rests, halves, p, out = carray(lows, n), carray(highs, n), carray(middles, n), carray(rests, n), carray(halves, n), carray(p, (3, n)), carray(out, (4, n))
    for i in range(n):
        middle, rest = middles[i], rests[i]
        out[0, i] = sin_of_sum(0, 1, middle, rest, 0)
        out[1, i] = cos_of_sum(0, 1, middle, rest, 0)
        out[2, i] = middle
        out[3, i] = rest


@compiled(AGM_ARGUMENTS_BATCH)
def agm_arguments_batch(n, halves, p, out):
    """a**2, b**2: the half period (paper, eq. 17) is pi over the arithmetic-geometric mean of a and b (Gauss)."""
    halves, p, out = carray(halves, (2, n)), carray(p, (3, n)), carray(out, (2, n))
    for i in range(n):
        R, g = p[0, i], p[1, i]
        _t0 = g/(4*R)
        out[0, i] = _t0
        out[1, i] = _t0


@compiled(BOUNDS_BATCH)
def bounds_batch(n, lo, hi, p, out):
    """Bounds of dU/dtheta and ds/dtheta for lo <= theta <= hi."""
    lo, hi, p, out = carray(lo, n), carray(hi, n), carray(p, (3, n)), carray(out, (4, n))
    for i in range(n):
        theta = (lo[i], hi[i])
        R, g = (p[0, i], p[0, i]), (p[1, i], p[1, i])
        _t0 = imul(idiv(iconst(1.0), iconst(2.0)), theta)
        _t1 = imul(imul(iconst(2.0), R), isin(_t0))
        out[0, i], out[1, i] = imul(imul(imul(iconst(-1.0), _t1), g), icos(_t0))
        out[2, i], out[3, i] = _t1


def exact_agm_arguments(op, half, p):
    """a**2, b**2: the half period (paper, eq. 17) is pi over the arithmetic-geometric mean of a and b (Gauss)."""
    R, g = p[0], p[1]
    return g/(4*R), g/(4*R)


MODEL = CompiledModel(
    name='cycloid_inverted', parameter='theta', parameters=PARAMETERS, positive=('R',), source=__file__,
    units={'R': 'm', 'g': 'm/s**2', 'm': 'kg', 'theta': '1'},
    functions=CompiledFunctions(
        path_and_contact_force, effective_potential, potential_divdiff1, potential_divdiff2, bounds,
    ),
    batch=BatchFunctions(
        potential_divdiff1=potential_divdiff1_batch, potential_divdiff2=potential_divdiff2_batch,
        orbit_invariants=orbit_invariants_batch, agm_arguments=agm_arguments_batch, bounds=bounds_batch,
        orbit_rows=4,
    ),
    domain_of=exact_domain, load_map=load_map, axes_of=exact_axes,
    exact=ExactFormulas(
        exact_x, exact_z, exact_ds, exact_kappa, exact_static_normal_load, exact_effective_potential,
        exact_effective_potential_slope, agm_arguments=exact_agm_arguments,
    ),
)
