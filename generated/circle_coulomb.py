# Made by gqm-gen for "circle_coulomb". Do not edit: change its declaration and generate again.
# interface 21, input b0d8ff0ac753, body f6e4bc9f66fc
"""Bead on a rough ring

x              = L*sin(theta)
z              = -L*cos(theta)
ds/dtheta      = L
dx/ds          = cos(theta)
dz/ds          = sin(theta)
kappa          = 1/L
Theta          = -lam0 + theta
W = V**2       = -2*L*g*(3*contact_sign*direction*mu*sin(theta) + (2*mu**2 - 1)*cos(theta))/(4*mu**2 + 1) + (2*L*g*(3*contact_sign*direction*mu*sin(lam0) + (2*mu**2 - 1)*cos(lam0))/(4*mu**2 + 1) + v0**2)*exp(-2*contact_sign*direction*mu*(-lam0 + theta))
N              = m*(g*cos(theta) + W/L)
A              = -contact_sign*direction*mu*(g*cos(theta) + W/L) - g*sin(theta)
dt/dtheta      = L/sqrt(W)
turning points : W = 0
liftoff        : g*cos(theta) + W/L = 0

V**2: closed form; direction is the sign of ds/dt; contact_sign is the sign of N
"""

from math import fabs
from typing import TYPE_CHECKING, Any

from numba import carray

from gqm_sym.runtime import compiler

# Before anything else is asked of the runtime, so that another version of it is told from a broken one.
compiled = compiler(__file__, interface=21)

from gqm_sym.runtime.vocabulary import (
    BOUNDS, EFFECTIVE_POTENTIAL, PATH_AND_CONTACT_FORCE, SPEED_EQUATION, STATIC_BALANCE, CompiledFunctions,
    CompiledModel, DissipativeFunctions, ExactLaw, Pass1, cos, imul, isin, sin,
)

if TYPE_CHECKING:
    from gqm_sym.runtime import Equilibrium, Motion, Sweep

# The run-time parameters and their defaults; pass1, solve, sweep and equilibria take them by keyword.
PARAMETERS = {'L': '1', 'mu': '0.15', 'mu_static': '0.2', 'g': '9.81', 'm': '1'}


@compiled(PATH_AND_CONTACT_FORCE)
def path_and_contact_force(n, places, speeds, p, out):
    """x, z, ds/dtheta, curvature kappa, contact force N = m*(kappa*V**2 + n0), given V**2 (paper, eqs. 8, 15)."""
    places, speeds, p, out = carray(places, n), carray(speeds, n), carray(p, 5), carray(out, (5, n))
    L, g, m = p[0], p[3], p[4]
    _t1 = 1/L
    for i in range(n):
        theta, v2 = places[i], speeds[i]
        _t0 = cos(theta)
        out[0, i] = L*sin(theta)
        out[1, i] = -L*_t0
        out[2, i] = L
        out[3, i] = _t1
        out[4, i] = m*(_t0*g + _t1*v2)


@compiled(SPEED_EQUATION)
def speed_equation(n, places, speeds, v, nu, p, out):
    """ds/dtheta, P, Q, n0, kappa: dV**2/dtheta = P - Q*V**2, N = m*(kappa*V**2 + n0) (paper, eq. 19); v = sgn(ds/dt), nu = sgn(N)."""
    places, p, out = carray(places, n), carray(p, 5), carray(out, (5, n))
    L, mu, g = p[0], p[1], p[3]
    for i in range(n):
        theta = places[i]
        ds = L
        kappa = 1/L
        push = -g*sin(theta)
        n0 = g*cos(theta)
        out[0, i] = ds
        out[1, i] = 2*ds*(-mu*n0*nu*v + push)
        out[2, i] = 2*mu*nu*v
        out[3, i] = n0
        out[4, i] = kappa


@compiled(STATIC_BALANCE)
def static_balance(n, places, p, out):
    """Acceleration from rest forwards, and backwards: a body rests where the first is <= 0 and the second >= 0."""
    places, p, out = carray(places, n), carray(p, 5), carray(out, (2, n))
    mu_static, g = p[2], p[3]
    for i in range(n):
        theta = places[i]
        push = -g*sin(theta)
        n0 = g*cos(theta)
        out[0, i] = -mu_static*fabs(n0) + push
        out[1, i] = mu_static*fabs(n0) + push


@compiled(EFFECTIVE_POTENTIAL)
def effective_potential(n, places, p, out):
    """U per unit mass, V**2 = v0**2 - 2*(U(theta) - U(lam0)), and dU/dtheta (paper, eq. 13)."""
    places, p, out = carray(places, n), carray(p, 5), carray(out, (2, n))
    L, g = p[0], p[3]
    _t0 = L*g
    for i in range(n):
        theta = places[i]
        out[0, i] = -_t0*cos(theta)
        out[1, i] = _t0*sin(theta)


@compiled(BOUNDS)
def bounds(lo, hi, p, out):
    """Bounds of dU/dtheta and ds/dtheta for lo <= theta <= hi, by interval arithmetic."""
    p, out = carray(p, 5), carray(out, 4)
    theta = (lo, hi)
    L, g = (p[0], p[0]), (p[3], p[3])
    out[0], out[1] = imul(imul(L, g), isin(theta))
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
    g = p[3]
    return g*op.cos(theta)

def exact_speed_slope(op, theta, w, v, nu, p):
    """dV**2/dtheta where V**2 = w, v = sgn(ds/dt) and nu = sgn(N) (paper, eq. 19)."""
    L, mu, g = p[0], p[1], p[3]
    return 2*L*(-g*op.sin(theta) - mu*nu*v*(g*op.cos(theta) + w/L))

def exact_domain(op, p):
    """Both ends of the domain and the period; None for an open end or without a period."""
    return None, None, 2*op.pi


def pass1(lam: Any = None, lam0: Any = None, v0: Any = 0.0, direction: int = 1, *, out: Any = None, L: Any = '1', mu: Any = '0.15', mu_static: Any = '0.2', g: Any = '9.81', m: Any = '1', **unknown: Any) -> Pass1:
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
    return MODEL.pass1((lam0, v0, direction), (L, mu, mu_static, g, m), lam, out, unknown)


def solve(
    lam0: Any = None, v0: Any = 0.0, direction: int = 1, *, point: Any = None, t_max: Any = None,
    contact: str = "bilateral", L: Any = '1', mu: Any = '0.15', mu_static: Any = '0.2', g: Any = '9.81', m: Any = '1',
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
    return MODEL.solve((lam0, v0, direction, point, t_max, contact), (L, mu, mu_static, g, m), unknown)


def sweep(
    quantity: Any = None, lam0: Any = None, v0: Any = 0.0, direction: Any = 1, *, lam: Any = None, t_max: Any = None,
    contact: str = "bilateral", gradient: Any = None, client: Any = None, L: Any = '1', mu: Any = '0.15',
    mu_static: Any = '0.2', g: Any = '9.81', m: Any = '1', **unknown: Any,
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
    return MODEL.sweep(quantity, launches, (L, mu, mu_static, g, m), lam=lam, client=client, gradient=gradient, unknown=unknown)


def equilibria(*, between: Any = None, L: Any = '1', mu: Any = '0.15', mu_static: Any = '0.2', g: Any = '9.81', m: Any = '1', **unknown: Any) -> "tuple[Equilibrium, ...]":
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
    return MODEL.equilibria((L, mu, mu_static, g, m), between, unknown)


MODEL = CompiledModel(
    name='circle_coulomb', parameter='theta', parameters=PARAMETERS, positive=('L',), source=__file__,
    units={'L': 'm', 'g': 'm/s**2', 'm': 'kg', 'mu': '1', 'mu_static': '1', 'theta': '1'},
    at_least=(('mu', '0'), ('mu_static', 'mu')),
    functions=CompiledFunctions(
        path_and_contact_force,
    ),
    effective_potential=effective_potential, bounds=bounds,
    domain_of=exact_domain,
    dissipation=DissipativeFunctions(speed_equation, static_balance, friction=True, kinked=False, linear=True),
    exact=ExactLaw(
        exact_x, exact_z, exact_ds, exact_kappa, exact_static_normal_load, exact_speed_slope,
    ),
)
