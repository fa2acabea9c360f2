# Made by gqm-gen for "helix_coulomb". Do not edit: change its declaration and generate again.
# interface 21, input 3f2dfaf376e9, body 772527bd25ad
"""Bead on a rough helix

x              = R*cos(theta)
y              = R*sin(theta)
z              = c*theta
ds/dtheta      = sqrt(R**2 + c**2)
dx/ds          = -R*sin(theta)/sqrt(R**2 + c**2)
dy/ds          = R*cos(theta)/sqrt(R**2 + c**2)
dz/ds          = c/sqrt(R**2 + c**2)
kappa          = R/(R**2 + c**2)
W = V**2       = W(theta)
|N|            = m*sqrt(R**4*W**2/(R**2 + c**2)**2 + (R*W*c*sin(theta)/(R**2 + c**2) + R*g*cos(theta))**2 + (-R*W*c*cos(theta)/(R**2 + c**2) + R*g*sin(theta))**2)/sqrt(R**2 + c**2)
A              = -c*g/sqrt(R**2 + c**2) - direction*mu*sqrt(R**4*W**2/(R**2 + c**2)**2 + (R*W*c*sin(theta)/(R**2 + c**2) + R*g*cos(theta))**2 + (-R*W*c*cos(theta)/(R**2 + c**2) + R*g*sin(theta))**2)/sqrt(R**2 + c**2)
dt/dtheta      = sqrt(R**2 + c**2)/sqrt(W)
turning points : W = 0

V**2: solved in space, for dV**2/ds = 2*A is not linear in it
"""

from math import fabs, sqrt
from typing import TYPE_CHECKING, Any

from numba import carray

from gqm_sym.runtime import compiler

# Before anything else is asked of the runtime, so that another version of it is told from a broken one.
compiled = compiler(__file__, interface=21)

from gqm_sym.runtime.vocabulary import (
    BOUNDS, EFFECTIVE_POTENTIAL, PATH_AND_CONTACT_FORCE, PATH_IN_SPACE, SPEED_EQUATION, SQUARED_CONTACT, STATIC_BALANCE,
    CompiledFunctions, CompiledModel, DissipativeFunctions, ExactLaw, Pass1InSpace, cos, iadd, imul, ipow, isqrt, sin,
)

if TYPE_CHECKING:
    from gqm_sym.runtime import Equilibrium, Motion, Sweep

# The run-time parameters and their defaults; pass1, solve, sweep and equilibria take them by keyword.
PARAMETERS = {'R': '2', 'c': '-1.1', 'mu': '0.2', 'g': '9.81', 'm': '1'}


@compiled(PATH_AND_CONTACT_FORCE)
def path_and_contact_force(n, places, speeds, p, out):
    """x, z, ds/dtheta, curvature kappa, contact force |N|, given V**2 (paper, eqs. 8, 15)."""
    places, speeds, p, out = carray(places, n), carray(speeds, n), carray(p, 5), carray(out, (5, n))
    R, c, g, m = p[0], p[1], p[3], p[4]
    _t0 = c**2
    _t1 = R**2 + _t0
    _t3 = 1/_t1
    _c0 = sqrt(_t1)
    _t4 = R*_t3
    _t5 = _t3*g
    for i in range(n):
        theta, v2 = places[i], speeds[i]
        _t2 = R*cos(theta)
        _t6 = _t4*sin(theta)
        out[0, i] = _t2
        out[1, i] = c*theta
        out[2, i] = _c0
        out[3, i] = _t4
        out[4, i] = m*sqrt((-_t0*_t5 + g)**2 + (-_t2*_t3*v2 + _t6*c*g)**2 + (-_t2*_t5*c - _t6*v2)**2)


@compiled(PATH_IN_SPACE)
def path_in_space(n, places, speeds, v, p, out):
    """y, and the contact force along x, y and z, given V**2 and the sign v = sgn(ds/dt)."""
    places, speeds, p, out = carray(places, n), carray(speeds, n), carray(p, 5), carray(out, (4, n))
    R, c, g, m = p[0], p[1], p[3], p[4]
    _t1 = c**2
    _t2 = 1/(R**2 + _t1)
    _t5 = _t2*g
    _t6 = _t5*c
    for i in range(n):
        theta, v2 = places[i], speeds[i]
        _t0 = R*sin(theta)
        _t3 = _t2*v2
        _t4 = R*cos(theta)
        out[0, i] = _t0
        out[1, i] = m*(_t0*_t6 - _t3*_t4)
        out[2, i] = m*(-_t0*_t3 - _t4*_t6)
        out[3, i] = m*(-_t1*_t5 + g)


@compiled(SPEED_EQUATION)
def speed_equation(n, places, speeds, v, nu, p, out):
    """ds/dtheta, P, Q, |N|/m, 0: dV**2/dtheta = P - Q*V**2, linearised at V**2 = w (paper, eq. 19); v = sgn(ds/dt), nu = sgn(N)."""
    places, speeds, p, out = carray(places, n), carray(speeds, n), carray(p, 5), carray(out, (5, n))
    R, c, mu, g = p[0], p[1], p[2], p[3]
    _t0 = R**2
    _t1 = _t0 + c**2
    _t2 = sqrt(_t1)
    _t5 = 1/_t1
    _t6 = _t5*c
    _c0 = 1/_t2
    _c1 = _t2
    _t3 = _c0*g
    for i in range(n):
        theta, w = places[i], speeds[i]
        _t4 = R*sin(theta)
        _t7 = R*cos(theta)
        ds = _c1
        push = -_t3*c
        turn_x = _t4*_t6
        turn_y = -_t6*_t7
        turn_z = _t0*_t5
        load_x = _t3*_t7
        load_y = _t3*_t4
        _u0 = turn_z**2
        _u1 = ds*load_x
        _u2 = turn_x*w
        _u3 = ds*load_y
        _u4 = turn_y*w
        _u5 = sqrt(_u0*w**2 + (_u1 + _u2)**2 + (_u3 + _u4)**2)
        _u6 = mu*v
        _u7 = _u6*(2*_u0*w + turn_x*(2*_u1 + 2*_u2) + turn_y*(2*_u3 + 2*_u4))/_u5
        out[0, i] = ds
        out[1, i] = -2*_u5*_u6 + _u7*w + 2*ds*push
        out[2, i] = _u7
        out[3, i] = _u5/ds
        out[4, i] = 0


@compiled(SQUARED_CONTACT)
def squared_contact(n, places, p, out):
    """Coefficients of 1, V**2 and V**4 in (N/m)**2, and the factor of -v*|N|/m in dV**2/dtheta; v = sgn(ds/dt)."""
    places, p, out = carray(places, n), carray(p, 5), carray(out, (4, n))
    R, c, mu, g = p[0], p[1], p[2], p[3]
    _t0 = R**2
    _t1 = _t0 + c**2
    _t2 = sqrt(_t1)
    _t4 = 1/_t1
    _t5 = _t4*c
    _c0 = 1/_t2
    _c1 = _t2
    _t7 = _c0*g
    for i in range(n):
        theta = places[i]
        _t3 = R*sin(theta)
        _t6 = R*cos(theta)
        ds = _c1
        turn_x = _t3*_t5
        turn_y = -_t5*_t6
        turn_z = _t0*_t4
        load_x = _t6*_t7
        load_y = _t3*_t7
        out[0, i] = load_x**2 + load_y**2
        out[1, i] = (2*load_x*turn_x + 2*load_y*turn_y)/ds
        out[2, i] = (turn_x**2 + turn_y**2 + turn_z**2)/ds**2
        out[3, i] = 2*ds*mu


@compiled(STATIC_BALANCE)
def static_balance(n, places, p, out):
    """Acceleration from rest forwards, and backwards: a body rests where the first is <= 0 and the second >= 0."""
    places, p, out = carray(places, n), carray(p, 5), carray(out, (2, n))
    R, c, mu, g = p[0], p[1], p[2], p[3]
    _c0 = fabs(R)
    _c1 = fabs(g)
    _c2 = 1/sqrt(R**2 + c**2)
    for i in range(n):
        push = -_c2*c*g
        n0 = _c0*_c1*_c2
        _u0 = mu*fabs(n0)
        out[0, i] = -_u0 + push
        out[1, i] = _u0 + push


@compiled(EFFECTIVE_POTENTIAL)
def effective_potential(n, places, p, out):
    """U per unit mass, V**2 = v0**2 - 2*(U(theta) - U(lam0)), and dU/dtheta (paper, eq. 13)."""
    places, p, out = carray(places, n), carray(p, 5), carray(out, (2, n))
    c, g = p[1], p[3]
    _t0 = c*g
    for i in range(n):
        theta = places[i]
        out[0, i] = _t0*theta
        out[1, i] = _t0


@compiled(BOUNDS)
def bounds(lo, hi, p, out):
    """Bounds of dU/dtheta and ds/dtheta for lo <= theta <= hi, by interval arithmetic."""
    p, out = carray(p, 5), carray(out, 4)
    R, c, g = (p[0], p[0]), (p[1], p[1]), (p[3], p[3])
    out[0], out[1] = imul(c, g)
    out[2], out[3] = isqrt(iadd(ipow(R, 2), ipow(c, 2)))


# The same formulas over a namespace of operations, for extended precision.

def exact_x(op, theta, p):
    """Horizontal coordinate."""
    R = p[0]
    return R*op.cos(theta)

def exact_z(op, theta, p):
    """Height."""
    c = p[1]
    return c*theta

def exact_ds(op, theta, p):
    """ds/dtheta."""
    R, c = p[0], p[1]
    return op.sqrt(R**2 + c**2)

def exact_kappa(op, theta, p):
    """Curvature (paper, eq. 8)."""
    R, c = p[0], p[1]
    return R/(R**2 + c**2)

def exact_static_normal_load(op, theta, p):
    """|N|/m of a body at rest (paper, eq. 15)."""
    R, c, g = p[0], p[1], p[3]
    return abs(R)*abs(g)/op.sqrt(R**2 + c**2)

def exact_speed_slope(op, theta, w, v, nu, p):
    """dV**2/dtheta where V**2 = w, v = sgn(ds/dt) and nu = sgn(N) (paper, eq. 19)."""
    R, c, mu, g = p[0], p[1], p[2], p[3]
    _t0 = R**2 + c**2
    _t1 = op.sqrt(_t0)
    _t2 = 1/_t1
    _t3 = op.cos(theta)
    _t4 = op.sin(theta)
    _t5 = R*c*w/_t0
    return 2*_t1*(-_t2*c*g - _t2*mu*v*op.sqrt(R**4*w**2/_t0**2 + (R*_t3*g + _t4*_t5)**2 + (R*_t4*g - _t3*_t5)**2))

def exact_y(op, theta, p):
    """Second horizontal coordinate."""
    R = p[0]
    return R*op.sin(theta)

def exact_load_along_curvature(op, theta, p):
    """c, so that |N|**2 = m**2*(kappa**2*V**4 + 2*c*V**2 + n0**2), where n0 is |N|/m at rest."""
    return 0

def exact_domain(op, p):
    """Both ends of the domain and the period; None for an open end or without a period."""
    return None, None, None


def pass1(lam: Any = None, lam0: Any = None, v0: Any = 0.0, direction: int = 1, *, out: Any = None, R: Any = '2', c: Any = '-1.1', mu: Any = '0.2', g: Any = '9.81', m: Any = '1', **unknown: Any) -> Pass1InSpace:
    """Position, metric, curvature, V**2 and contact force at places of the curve (Pass 1, no quadrature).

    Parameters
    ----------
    lam : array_like
        Places on the curve, as values of its parameter theta.
    lam0, v0, direction
        Launch place, speed and direction (+1 or -1: the sign of ds/dt).
    out : Pass1InSpace, optional
        The result of a call before, or ten arrays like it, to be filled again.

    Returns
    -------
    Pass1InSpace
        Arrays x, z, ds, kappa, v2 and normal_force; y, normal_x, normal_y and normal_z.
    """
    return MODEL.pass1((lam0, v0, direction), (R, c, mu, g, m), lam, out, unknown)


def solve(
    lam0: Any = None, v0: Any = 0.0, direction: int = 1, *, point: Any = None, t_max: Any = None,
    contact: str = "bilateral", R: Any = '2', c: Any = '-1.1', mu: Any = '0.2', g: Any = '9.81', m: Any = '1',
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
    return MODEL.solve((lam0, v0, direction, point, t_max, contact), (R, c, mu, g, m), unknown)


def sweep(
    quantity: Any = None, lam0: Any = None, v0: Any = 0.0, direction: Any = 1, *, lam: Any = None, t_max: Any = None,
    contact: str = "bilateral", gradient: Any = None, client: Any = None, R: Any = '2', c: Any = '-1.1',
    mu: Any = '0.2', g: Any = '9.81', m: Any = '1', **unknown: Any,
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
    return MODEL.sweep(quantity, launches, (R, c, mu, g, m), lam=lam, client=client, gradient=gradient, unknown=unknown)


def equilibria(*, between: Any = None, R: Any = '2', c: Any = '-1.1', mu: Any = '0.2', g: Any = '9.81', m: Any = '1', **unknown: Any) -> "tuple[Equilibrium, ...]":
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
    return MODEL.equilibria((R, c, mu, g, m), between, unknown)


MODEL = CompiledModel(
    name='helix_coulomb', parameter='theta', parameters=PARAMETERS, positive=('R',), source=__file__,
    units={'R': 'm', 'c': 'm', 'g': 'm/s**2', 'm': 'kg', 'mu': '1', 'theta': '1'},
    at_least=(('mu', '0'),),
    functions=CompiledFunctions(
        path_and_contact_force,
    ),
    path_in_space=path_in_space, signed=False, sided=False,
    effective_potential=effective_potential, bounds=bounds,
    domain_of=exact_domain,
    dissipation=DissipativeFunctions(speed_equation, static_balance, friction=True, kinked=False, linear=False, squared_contact=squared_contact),
    exact=ExactLaw(
        exact_x, exact_z, exact_ds, exact_kappa, exact_static_normal_load, exact_speed_slope, exact_y,
        exact_load_along_curvature,
    ),
)
