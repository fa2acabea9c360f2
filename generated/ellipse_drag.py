# Made by gqm-gen for "ellipse_drag". Do not edit: change its declaration and generate again.
# interface 21, input f2717a5ad91f, body c8374aaf001b
"""Bead on an ellipse, in air

x              = a*cos(theta)
z              = b*sin(theta)
ds/dtheta      = sqrt(a**2*sin(theta)**2 + b**2*cos(theta)**2)
dx/ds          = -a*sin(theta)/sqrt(a**2*sin(theta)**2 + b**2*cos(theta)**2)
dz/ds          = b*cos(theta)/sqrt(a**2*sin(theta)**2 + b**2*cos(theta)**2)
kappa          = a*b/(a**2*sin(theta)**2 + b**2*cos(theta)**2)**(3/2)
Theta          = -lam0 + theta + atan((-a + b)*sin(2*lam0)/(2*(a + (-a + b)*cos(lam0)**2))) - atan((-a + b)*sin(2*theta)/(2*(a + (-a + b)*cos(theta)**2)))
W = V**2       = v0**2*exp(-Integral(2*b_air*direction*sqrt(a**2*sin(__theta)**2 + b**2*cos(__theta)**2)/m, (__theta, lam0, theta))) + Integral(-2*b*g*exp(-Integral(2*b_air*direction*sqrt(a**2*sin(__theta)**2 + b**2*cos(__theta)**2)/m, (__theta, _theta, theta)))*cos(_theta), (_theta, lam0, theta))
N              = m*(W*a*b/(a**2*sin(theta)**2 + b**2*cos(theta)**2)**(3/2) - a*g*sin(theta)/sqrt(a**2*sin(theta)**2 + b**2*cos(theta)**2))
A              = -W*b_air*direction/m - b*g*cos(theta)/sqrt(a**2*sin(theta)**2 + b**2*cos(theta)**2)
dt/dtheta      = sqrt(a**2*sin(theta)**2 + b**2*cos(theta)**2)/sqrt(W)
turning points : W = 0
liftoff        : W*a*b/(a**2*sin(theta)**2 + b**2*cos(theta)**2)**(3/2) - a*g*sin(theta)/sqrt(a**2*sin(theta)**2 + b**2*cos(theta)**2) = 0

V**2: spectral antiderivative, no elementary form found; direction is the sign of ds/dt
"""

from math import sqrt
from typing import TYPE_CHECKING, Any

from numba import carray

from gqm_sym.runtime import compiler

# Before anything else is asked of the runtime, so that another version of it is told from a broken one.
compiled = compiler(__file__, interface=21)

from gqm_sym.runtime.vocabulary import (
    BOUNDS, EFFECTIVE_POTENTIAL, PATH_AND_CONTACT_FORCE, SPEED_EQUATION, STATIC_BALANCE, CompiledFunctions,
    CompiledModel, DissipativeFunctions, ExactLaw, Pass1, cos, iadd, icos, imul, ipow, isin, isqrt, sin,
)

if TYPE_CHECKING:
    from gqm_sym.runtime import Equilibrium, Motion, Sweep

# The run-time parameters and their defaults; pass1, solve, sweep and equilibria take them by keyword.
PARAMETERS = {'a': '1.5', 'b': '1', 'b_air': '0.3', 'g': '9.81', 'm': '2'}


@compiled(PATH_AND_CONTACT_FORCE)
def path_and_contact_force(n, places, speeds, p, out):
    """x, z, ds/dtheta, curvature kappa, contact force N = m*(kappa*V**2 + n0), given V**2 (paper, eqs. 8, 15)."""
    places, speeds, p, out = carray(places, n), carray(speeds, n), carray(p, 5), carray(out, (5, n))
    a, b, g, m = p[0], p[1], p[3], p[4]
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


@compiled(SPEED_EQUATION)
def speed_equation(n, places, speeds, v, nu, p, out):
    """ds/dtheta, P, Q, n0, kappa: dV**2/dtheta = P - Q*V**2, N = m*(kappa*V**2 + n0) (paper, eq. 19); v = sgn(ds/dt), nu = sgn(N)."""
    places, p, out = carray(places, n), carray(p, 5), carray(out, (5, n))
    a, b, b_air, g, m = p[0], p[1], p[2], p[3], p[4]
    for i in range(n):
        theta = places[i]
        _t0 = sin(theta)
        _t1 = cos(theta)
        _t2 = _t0**2*a**2 + _t1**2*b**2
        ds = sqrt(_t2)
        _t4 = g/ds
        kappa = a*b/sqrt(_t2)**3
        push = -_t1*_t4*b
        n0 = -_t0*_t4*a
        out[0, i] = ds
        out[1, i] = 2*ds*push
        out[2, i] = 2*b_air*ds*v/m
        out[3, i] = n0
        out[4, i] = kappa


@compiled(STATIC_BALANCE)
def static_balance(n, places, p, out):
    """Acceleration from rest forwards, and backwards: a body rests where the first is <= 0 and the second >= 0."""
    places, p, out = carray(places, n), carray(p, 5), carray(out, (2, n))
    a, b, g = p[0], p[1], p[3]
    for i in range(n):
        theta = places[i]
        _t0 = cos(theta)
        push = -_t0*b*g/sqrt(_t0**2*b**2 + a**2*sin(theta)**2)
        out[0, i] = push
        out[1, i] = push


@compiled(EFFECTIVE_POTENTIAL)
def effective_potential(n, places, p, out):
    """U per unit mass, V**2 = v0**2 - 2*(U(theta) - U(lam0)), and dU/dtheta (paper, eq. 13)."""
    places, p, out = carray(places, n), carray(p, 5), carray(out, (2, n))
    b, g = p[1], p[3]
    _t0 = b*g
    for i in range(n):
        theta = places[i]
        out[0, i] = _t0*sin(theta)
        out[1, i] = _t0*cos(theta)


@compiled(BOUNDS)
def bounds(lo, hi, p, out):
    """Bounds of dU/dtheta and ds/dtheta for lo <= theta <= hi, by interval arithmetic."""
    p, out = carray(p, 5), carray(out, 4)
    theta = (lo, hi)
    a, b, g = (p[0], p[0]), (p[1], p[1]), (p[3], p[3])
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
    a, b, g = p[0], p[1], p[3]
    _t0 = op.sin(theta)
    return -_t0*a*g/op.sqrt(_t0**2*a**2 + b**2*op.cos(theta)**2)

def exact_speed_slope(op, theta, w, v, nu, p):
    """dV**2/dtheta where V**2 = w, v = sgn(ds/dt) and nu = sgn(N) (paper, eq. 19)."""
    a, b, b_air, g, m = p[0], p[1], p[2], p[3], p[4]
    _t0 = op.cos(theta)
    _t1 = op.sqrt(_t0**2*b**2 + a**2*op.sin(theta)**2)
    return 2*_t1*(-_t0*b*g/_t1 - b_air*v*w/m)

def exact_domain(op, p):
    """Both ends of the domain and the period; None for an open end or without a period."""
    return None, None, 2*op.pi


def pass1(lam: Any = None, lam0: Any = None, v0: Any = 0.0, direction: int = 1, *, out: Any = None, a: Any = '1.5', b: Any = '1', b_air: Any = '0.3', g: Any = '9.81', m: Any = '2', **unknown: Any) -> Pass1:
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
    return MODEL.pass1((lam0, v0, direction), (a, b, b_air, g, m), lam, out, unknown)


def solve(
    lam0: Any = None, v0: Any = 0.0, direction: int = 1, *, point: Any = None, t_max: Any = None,
    contact: str = "bilateral", a: Any = '1.5', b: Any = '1', b_air: Any = '0.3', g: Any = '9.81', m: Any = '2',
    **unknown: Any,
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
    return MODEL.solve((lam0, v0, direction, point, t_max, contact), (a, b, b_air, g, m), unknown)


def sweep(
    quantity: Any = None, lam0: Any = None, v0: Any = 0.0, direction: Any = 1, *, lam: Any = None, t_max: Any = None,
    contact: str = "bilateral", gradient: Any = None, client: Any = None, a: Any = '1.5', b: Any = '1',
    b_air: Any = '0.3', g: Any = '9.81', m: Any = '2', **unknown: Any,
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
    return MODEL.sweep(quantity, launches, (a, b, b_air, g, m), lam=lam, client=client, gradient=gradient, unknown=unknown)


def equilibria(*, between: Any = None, a: Any = '1.5', b: Any = '1', b_air: Any = '0.3', g: Any = '9.81', m: Any = '2', **unknown: Any) -> "tuple[Equilibrium, ...]":
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
    return MODEL.equilibria((a, b, b_air, g, m), between, unknown)


MODEL = CompiledModel(
    name='ellipse_drag', parameter='theta', parameters=PARAMETERS, positive=('a', 'b'), source=__file__,
    units={'a': 'm', 'b': 'm', 'b_air': 'kg/m', 'g': 'm/s**2', 'm': 'kg', 'theta': '1'},
    at_least=(('b_air', '0'),),
    functions=CompiledFunctions(
        path_and_contact_force,
    ),
    effective_potential=effective_potential, bounds=bounds,
    domain_of=exact_domain,
    dissipation=DissipativeFunctions(speed_equation, static_balance, friction=False, kinked=False, linear=True),
    exact=ExactLaw(
        exact_x, exact_z, exact_ds, exact_kappa, exact_static_normal_load, exact_speed_slope,
    ),
)
