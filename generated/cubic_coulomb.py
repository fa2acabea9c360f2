# Made by gqm-gen for "cubic_coulomb". Do not edit: change its declaration and generate again.
# interface 21, input f472752dd3ba, body cf9ee3175f08
"""Cubic track with Coulomb friction

x              = x
z              = x**3
ds/dx          = sqrt(9*x**4 + 1)
dx/ds          = 1/sqrt(9*x**4 + 1)
dz/ds          = 3*x**2/sqrt(9*x**4 + 1)
kappa          = 6*x/(9*x**4 + 1)**(3/2)
Theta          = -atan(3*lam0**2) + atan(3*x**2)
W = V**2       = v0**2*exp(-2*contact_sign*direction*mu*(-atan(3*lam0**2) + atan(3*x**2))) + Integral(-2*g*(3*_x**2 + contact_sign*direction*mu)*exp(-2*contact_sign*direction*mu*(-atan(3*_x**2) + atan(3*x**2))), (_x, lam0, x))
N              = m*(6*W*x/(9*x**4 + 1)**(3/2) + g/sqrt(9*x**4 + 1))
A              = -contact_sign*direction*mu*(6*W*x/(9*x**4 + 1)**(3/2) + g/sqrt(9*x**4 + 1)) - 3*g*x**2/sqrt(9*x**4 + 1)
dt/dx          = sqrt(9*x**4 + 1)/sqrt(W)
turning points : W = 0
liftoff        : 6*W*x/(9*x**4 + 1)**(3/2) + g/sqrt(9*x**4 + 1) = 0

V**2: spectral antiderivative, no elementary form found; direction is the sign of ds/dt; contact_sign is the sign of N
"""

from math import fabs, sqrt
from typing import TYPE_CHECKING, Any

from numba import carray

from gqm_sym.runtime import compiler

# Before anything else is asked of the runtime, so that another version of it is told from a broken one.
compiled = compiler(__file__, interface=21)

from gqm_sym.runtime.vocabulary import (
    BOUNDS, EFFECTIVE_POTENTIAL, PATH_AND_CONTACT_FORCE, SPEED_EQUATION, STATIC_BALANCE, CompiledFunctions,
    CompiledModel, DissipativeFunctions, ExactLaw, Pass1, iadd, iconst, imul, ipow, isqrt,
)

if TYPE_CHECKING:
    from gqm_sym.runtime import Equilibrium, Motion, Sweep

# The run-time parameters and their defaults; pass1, solve, sweep and equilibria take them by keyword.
PARAMETERS = {'mu': '0.1', 'g': '9.81', 'm': '1'}


@compiled(PATH_AND_CONTACT_FORCE)
def path_and_contact_force(n, places, speeds, p, out):
    """x, z, ds/dx, curvature kappa, contact force N = m*(kappa*V**2 + n0), given V**2 (paper, eqs. 8, 15)."""
    places, speeds, p, out = carray(places, n), carray(speeds, n), carray(p, 3), carray(out, (5, n))
    g, m = p[1], p[2]
    for i in range(n):
        x, v2 = places[i], speeds[i]
        _t0 = 9*x**4 + 1
        _t1 = sqrt(_t0)
        _t2 = 6*x/sqrt(_t0)**3
        out[0, i] = x
        out[1, i] = x**3
        out[2, i] = _t1
        out[3, i] = _t2
        out[4, i] = m*(_t2*v2 + g/_t1)


@compiled(SPEED_EQUATION)
def speed_equation(n, places, speeds, v, nu, p, out):
    """ds/dx, P, Q, n0, kappa: dV**2/dx = P - Q*V**2, N = m*(kappa*V**2 + n0) (paper, eq. 19); v = sgn(ds/dt), nu = sgn(N)."""
    places, p, out = carray(places, n), carray(p, 3), carray(out, (5, n))
    mu, g = p[0], p[1]
    for i in range(n):
        x = places[i]
        _t0 = 9*x**4 + 1
        ds = sqrt(_t0)
        _t2 = 6*x
        _t3 = g/ds
        kappa = _t2/sqrt(_t0)**3
        turn = _t2/_t0
        push = -3*_t3*x**2
        n0 = _t3
        out[0, i] = ds
        out[1, i] = 2*ds*(-mu*n0*nu*v + push)
        out[2, i] = 2*mu*nu*turn*v
        out[3, i] = n0
        out[4, i] = kappa


@compiled(STATIC_BALANCE)
def static_balance(n, places, p, out):
    """Acceleration from rest forwards, and backwards: a body rests where the first is <= 0 and the second >= 0."""
    places, p, out = carray(places, n), carray(p, 3), carray(out, (2, n))
    mu, g = p[0], p[1]
    for i in range(n):
        x = places[i]
        _t0 = g/sqrt(9*x**4 + 1)
        push = -3*_t0*x**2
        n0 = _t0
        out[0, i] = -mu*fabs(n0) + push
        out[1, i] = mu*fabs(n0) + push


@compiled(EFFECTIVE_POTENTIAL)
def effective_potential(n, places, p, out):
    """U per unit mass, V**2 = v0**2 - 2*(U(x) - U(lam0)), and dU/dx (paper, eq. 13)."""
    places, p, out = carray(places, n), carray(p, 3), carray(out, (2, n))
    g = p[1]
    for i in range(n):
        x = places[i]
        out[0, i] = g*x**3
        out[1, i] = 3*g*x**2


@compiled(BOUNDS)
def bounds(lo, hi, p, out):
    """Bounds of dU/dx and ds/dx for lo <= x <= hi, by interval arithmetic."""
    p, out = carray(p, 3), carray(out, 4)
    x = (lo, hi)
    g = (p[1], p[1])
    out[0], out[1] = imul(imul(iconst(3.0), g), ipow(x, 2))
    out[2], out[3] = isqrt(iadd(imul(iconst(9.0), ipow(x, 4)), iconst(1.0)))


# The same formulas over a namespace of operations, for extended precision.

def exact_x(op, x, p):
    """Horizontal coordinate."""
    return x

def exact_z(op, x, p):
    """Height."""
    return x**3

def exact_ds(op, x, p):
    """ds/dx."""
    return op.sqrt(9*x**4 + 1)

def exact_kappa(op, x, p):
    """Signed curvature (paper, eq. 8)."""
    return 6*x/(9*x**4 + 1)**(op.mpf(3)/2)

def exact_static_normal_load(op, x, p):
    """n0 = N/m of a body at rest, so that N = m*(kappa*V**2 + n0) (paper, eq. 15)."""
    g = p[1]
    return g/op.sqrt(9*x**4 + 1)

def exact_speed_slope(op, x, w, v, nu, p):
    """dV**2/dx where V**2 = w, v = sgn(ds/dt) and nu = sgn(N) (paper, eq. 19)."""
    mu, g = p[0], p[1]
    _t0 = 9*x**4 + 1
    _t1 = op.sqrt(_t0)
    _t2 = g/_t1
    return 2*_t1*(-3*_t2*x**2 - mu*nu*v*(_t2 + 6*w*x/_t0**(op.mpf(3)/2)))

def exact_domain(op, p):
    """Both ends of the domain and the period; None for an open end or without a period."""
    return None, None, None


def pass1(lam: Any = None, lam0: Any = None, v0: Any = 0.0, direction: int = 1, *, out: Any = None, mu: Any = '0.1', g: Any = '9.81', m: Any = '1', **unknown: Any) -> Pass1:
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
    return MODEL.pass1((lam0, v0, direction), (mu, g, m), lam, out, unknown)


def solve(
    lam0: Any = None, v0: Any = 0.0, direction: int = 1, *, point: Any = None, t_max: Any = None,
    contact: str = "bilateral", mu: Any = '0.1', g: Any = '9.81', m: Any = '1', **unknown: Any,
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
    return MODEL.solve((lam0, v0, direction, point, t_max, contact), (mu, g, m), unknown)


def sweep(
    quantity: Any = None, lam0: Any = None, v0: Any = 0.0, direction: Any = 1, *, lam: Any = None, t_max: Any = None,
    contact: str = "bilateral", gradient: Any = None, client: Any = None, mu: Any = '0.1', g: Any = '9.81',
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
    return MODEL.sweep(quantity, launches, (mu, g, m), lam=lam, client=client, gradient=gradient, unknown=unknown)


def equilibria(*, between: Any = None, mu: Any = '0.1', g: Any = '9.81', m: Any = '1', **unknown: Any) -> "tuple[Equilibrium, ...]":
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
    return MODEL.equilibria((mu, g, m), between, unknown)


MODEL = CompiledModel(
    name='cubic_coulomb', parameter='x', parameters=PARAMETERS, positive=(), source=__file__,
    units={'g': 'm/s**2', 'm': 'kg', 'mu': '1', 'x': 'm'},
    at_least=(('mu', '0'),),
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
