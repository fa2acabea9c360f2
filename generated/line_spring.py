# Made by gqm-gen for "line_spring". Do not edit: change its declaration and generate again.
# interface 21, input 702c9ef6b67b, body 0a0be5b5034f
"""Bead on a sloping line, tied to the origin by a spring

x              = x
z              = 3*x/4 + 2
ds/dx          = 5/4
dx/ds          = 4/5
dz/ds          = 3/5
kappa          = 0
Theta          = 0
V**2           = v0**2 + w**2*(lam0**2 - x**2 + (3*lam0 + 8)**2/16 - (3*x + 8)**2/16)
N              = 8*m*w**2/5
A              = -w**2*(25*x/4 + 6)/5
dt/dx          = 5/(4*sqrt(v0**2 + w**2*(lam0**2 - x**2 + (3*lam0 + 8)**2/16 - (3*x + 8)**2/16)))
turning points : v0**2 + w**2*(lam0**2 - x**2 + (3*lam0 + 8)**2/16 - (3*x + 8)**2/16) = 0
liftoff        : 8*w**2/5 = 0
"""

from math import fabs, sqrt
from typing import TYPE_CHECKING, Any

from numba import carray

from gqm_sym.runtime import compiler

# Before anything else is asked of the runtime, so that another version of it is told from a broken one.
compiled = compiler(__file__, interface=21)

from gqm_sym.runtime.vocabulary import (
    AGM_ARGUMENTS_BATCH, BOUNDS, BOUNDS_BATCH, EFFECTIVE_POTENTIAL, LOAD_MAP, PATH_AND_CONTACT_FORCE,
    POTENTIAL_DIVDIFF1, POTENTIAL_DIVDIFF1_BATCH, POTENTIAL_DIVDIFF2, POTENTIAL_DIVDIFF2_BATCH, TURNING_POINT_BATCH,
    BatchFunctions, CompiledFunctions, CompiledModel, ExactFormulas, Pass1, iadd, iconst, idiv, imul, ipow,
    speed_squared_from_potential,
)

if TYPE_CHECKING:
    from gqm_sym.runtime import Equilibrium, Motion, Sweep

# The run-time parameters and their defaults; pass1, solve, sweep and equilibria take them by keyword.
PARAMETERS = {'w': '1.3', 'm': '1'}


@compiled(PATH_AND_CONTACT_FORCE)
def path_and_contact_force(n, places, speeds, p, out):
    """x, z, ds/dx, curvature kappa, contact force N = m*(kappa*V**2 + n0), given V**2 (paper, eqs. 8, 15)."""
    places, speeds, p, out = carray(places, n), carray(speeds, n), carray(p, 2), carray(out, (5, n))
    w, m = p[0], p[1]
    for i in range(n):
        x = places[i]
        out[0, i] = x
        out[1, i] = 3*x/4 + 2
        out[2, i] = 5/4
        out[3, i] = 0
        out[4, i] = 8*m*w**2/5


@compiled(EFFECTIVE_POTENTIAL)
def effective_potential(n, places, p, out):
    """U per unit mass, V**2 = v0**2 - 2*(U(x) - U(lam0)), and dU/dx (paper, eq. 13)."""
    places, p, out = carray(places, n), carray(p, 2), carray(out, (2, n))
    w = p[0]
    _t0 = w**2
    for i in range(n):
        x = places[i]
        out[0, i] = _t0*(x**2 + (3*x/4 + 2)**2)/2
        out[1, i] = _t0*(25*x/4 + 6)/4


@compiled(POTENTIAL_DIVDIFF1)
def potential_divdiff1(n, a, places, offsets, p, out):
    """U[a, x] = (U(x) - U(a))/(x - a) without cancellation, and ds/dx (MATHS, s. 3)."""
    places, offsets, p, out = carray(places, n), carray(offsets, n), carray(p, 2), carray(out, (2, n))
    w = p[0]
    for i in range(n):
        x = places[i]
        out[0, i] = w**2*(25*a/16 + 25*x/16 + 3)/2
        out[1, i] = 5/4


@compiled(POTENTIAL_DIVDIFF2)
def potential_divdiff2(n, a, b, left, right, p, out):
    """U[a, x, b] = V**2/(2*(x - a)*(b - x)) from turn a to turn b, and ds/dx (MATHS, s. 3)."""
    left, right, p, out = carray(left, n), carray(right, n), carray(p, 2), carray(out, (2, n))
    w = p[0]
    for i in range(n):
        out[0, i] = 25*w**2/32
        out[1, i] = 5/4


@compiled(BOUNDS)
def bounds(lo, hi, p, out):
    """Bounds of dU/dx and ds/dx for lo <= x <= hi, by interval arithmetic."""
    p, out = carray(p, 2), carray(out, 4)
    x = (lo, hi)
    w = (p[0], p[0])
    out[0], out[1] = imul(imul(idiv(iconst(1.0), iconst(4.0)), ipow(w, 2)), iadd(imul(idiv(iconst(25.0), iconst(4.0)), x), iconst(6.0)))
    out[2], out[3] = idiv(iconst(5.0), iconst(4.0))


# The same formulas over a namespace of operations, for extended precision.

def exact_x(op, x, p):
    """Horizontal coordinate."""
    return x

def exact_z(op, x, p):
    """Height."""
    return 3*x/4 + 2

def exact_ds(op, x, p):
    """ds/dx."""
    return op.mpf(5)/4

def exact_kappa(op, x, p):
    """Signed curvature (paper, eq. 8)."""
    return 0

def exact_static_normal_load(op, x, p):
    """n0 = N/m of a body at rest, so that N = m*(kappa*V**2 + n0) (paper, eq. 15)."""
    w = p[0]
    return 8*w**2/5

def exact_effective_potential(op, x, p):
    """U, so that V**2 + 2*U is constant (paper, eq. 13)."""
    w = p[0]
    return w**2*(x**2 + (3*x/4 + 2)**2)/2

def exact_effective_potential_slope(op, x, p):
    """dU/dx."""
    w = p[0]
    return w**2*(25*x/4 + 6)/4

def exact_domain(op, p):
    """Both ends of the domain and the period; None for an open end or without a period."""
    return None, None, None

def exact_axes(op, p):
    """A place about which V**2 and ds are even, and the distance to the next (None if there is no other)."""
    return op.mpf(-24)/25, None


def pass1(lam: Any = None, lam0: Any = None, v0: Any = 0.0, direction: int = 1, *, out: Any = None, w: Any = '1.3', m: Any = '1', **unknown: Any) -> Pass1:
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
    return MODEL.pass1((lam0, v0, direction), (w, m), lam, out, unknown)


def solve(
    lam0: Any = None, v0: Any = 0.0, direction: int = 1, *, point: Any = None, t_max: Any = None,
    contact: str = "bilateral", w: Any = '1.3', m: Any = '1', **unknown: Any,
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
    return MODEL.solve((lam0, v0, direction, point, t_max, contact), (w, m), unknown)


def sweep(
    quantity: Any = None, lam0: Any = None, v0: Any = 0.0, direction: Any = 1, *, lam: Any = None, t_max: Any = None,
    contact: str = "bilateral", gradient: Any = None, client: Any = None, w: Any = '1.3', m: Any = '1', **unknown: Any,
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
    return MODEL.sweep(quantity, launches, (w, m), lam=lam, client=client, gradient=gradient, unknown=unknown)


def equilibria(*, between: Any = None, w: Any = '1.3', m: Any = '1', **unknown: Any) -> "tuple[Equilibrium, ...]":
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
    return MODEL.equilibria((w, m), between, unknown)


# ---- The same formulas once more, only for speed: a load map in one call, and many orbits at once for sweeps. ----


@compiled(LOAD_MAP)
def load_map(n, w0, level, places, p, out):
    """x, z, ds/dx, kappa, V**2 = w0 - 2*(U - level), N (paper, eqs. 8, 13, 15), size of U's terms."""
    places, p, out = carray(places, n), carray(p, 2), carray(out, (7, n))
    w, m = p[0], p[1]
    _t2 = w**2
    _t3 = _t2/2
    for i in range(n):
        x = places[i]
        _t0 = 3*x/4 + 2
        _t1 = x**2
        out[0, i] = x
        out[1, i] = _t0
        out[2, i] = 5/4
        out[3, i] = 0
        out[4, i] = speed_squared_from_potential(w0, _t3*(_t0**2 + _t1), level)
        out[5, i] = 8*_t2*m/5
        out[6, i] = _t3*(_t1 + (3*fabs(x)/4 + 2)**2)


@compiled(POTENTIAL_DIVDIFF1_BATCH)
def potential_divdiff1_batch(n, starts, places, offsets, p, out):
    """U[a, x], ds/dx and dU/dx."""
    starts, places, offsets, p, out = carray(starts, n), carray(places, n), carray(offsets, n), carray(p, (2, n)), carray(out, (3, n))
    for i in range(n):
        w, a, x = p[0, i], starts[i], places[i]
        _t0 = w**2
        out[0, i] = _t0*(25*a/16 + 25*x/16 + 3)/2
        out[1, i] = 5/4
        out[2, i] = _t0*(25*x/4 + 6)/4


@compiled(POTENTIAL_DIVDIFF2_BATCH)
def potential_divdiff2_batch(n, lows, highs, left, right, p, out):
    """U[a, x, b] and ds/dx; NaN where the points lie too far apart for the closed form."""
    lows, highs, left, right, p, out = carray(lows, n), carray(highs, n), carray(left, n), carray(right, n), carray(p, (2, n)), carray(out, (2, n))
    for i in range(n):
        w = p[0, i]
        out[0, i] = 25*w**2/32
        out[1, i] = 5/4


@compiled(AGM_ARGUMENTS_BATCH)
def agm_arguments_batch(n, halves, p, out):
    """a**2, b**2: the half period (paper, eq. 17) is pi over the arithmetic-geometric mean of a and b (Gauss)."""
    halves, p, out = carray(halves, (2, n)), carray(p, (2, n)), carray(out, (2, n))
    for i in range(n):
        w = p[0, i]
        _t0 = w**2
        out[0, i] = _t0
        out[1, i] = _t0


@compiled(TURNING_POINT_BATCH)
def turning_point_batch(n, offsets, launches, p, out):
    """From V**2 at an offset: half the orbit's width (paper, eq. 14), -dV**2/dq, and a sine's square q at the turn."""
    offsets, launches, p, out = carray(offsets, n), carray(launches, n), carray(p, (2, n)), carray(out, (3, n))
    for i in range(n):
        w, offset, launch = p[0, i], offsets[i], launches[i]
        _t0 = w**2
        out[0, i] = sqrt(offset**2 + 16*launch/(25*_t0))
        out[1, i] = 25*_t0/16
        out[2, i] = 0


@compiled(BOUNDS_BATCH)
def bounds_batch(n, lo, hi, p, out):
    """Bounds of dU/dx and ds/dx for lo <= x <= hi."""
    lo, hi, p, out = carray(lo, n), carray(hi, n), carray(p, (2, n)), carray(out, (4, n))
    for i in range(n):
        x = (lo[i], hi[i])
        w = (p[0, i], p[0, i])
        out[0, i], out[1, i] = imul(imul(idiv(iconst(1.0), iconst(4.0)), ipow(w, 2)), iadd(imul(idiv(iconst(25.0), iconst(4.0)), x), iconst(6.0)))
        out[2, i], out[3, i] = idiv(iconst(5.0), iconst(4.0))


def exact_agm_arguments(op, half, p):
    """a**2, b**2: the half period (paper, eq. 17) is pi over the arithmetic-geometric mean of a and b (Gauss)."""
    w = p[0]
    return w**2, w**2


MODEL = CompiledModel(
    name='line_spring', parameter='x', parameters=PARAMETERS, positive=(), source=__file__,
    units={'g': 'm/s**2', 'm': 'kg', 'w': '1/s', 'x': 'm'},
    functions=CompiledFunctions(
        path_and_contact_force, effective_potential, potential_divdiff1, potential_divdiff2, bounds,
    ),
    batch=BatchFunctions(
        potential_divdiff1=potential_divdiff1_batch, potential_divdiff2=potential_divdiff2_batch,
        agm_arguments=agm_arguments_batch, turning_point=turning_point_batch, bounds=bounds_batch,
    ),
    domain_of=exact_domain, load_map=load_map, axes_of=exact_axes,
    exact=ExactFormulas(
        exact_x, exact_z, exact_ds, exact_kappa, exact_static_normal_load, exact_effective_potential,
        exact_effective_potential_slope, agm_arguments=exact_agm_arguments,
    ),
)
