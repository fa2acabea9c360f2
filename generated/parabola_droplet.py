# Made by gqm-gen for "parabola_droplet". Do not edit: change its declaration and generate again.
# interface 21, input 016fa3c6503a, body b4c136902479
"""Droplet in a parabolic channel

x              = x
z              = a*x**2
ds/dx          = sqrt(4*a**2*x**2 + 1)
dx/ds          = 1/sqrt(4*a**2*x**2 + 1)
dz/ds          = 2*a*x/sqrt(4*a**2*x**2 + 1)
kappa          = 2*a/(4*a**2*x**2 + 1)**(3/2)
Theta          = -atan(2*a*lam0) + atan(2*a*x)
W = V**2       = 2*a*g*lam0**2 - 2*a*g*x**2 + v0**2 + 2*direction*ell_c**2*gamma*Abs(a)*atan(2*a*lam0)/(a*m) - 2*direction*ell_c**2*gamma*Abs(a)*atan(2*a*x)/(a*m)
N              = m*(2*W*a/(4*a**2*x**2 + 1)**(3/2) + g/sqrt(4*a**2*x**2 + 1))
A              = -2*a*g*x/sqrt(4*a**2*x**2 + 1) - 2*direction*ell_c**2*gamma*Abs(a)/(m*(4*a**2*x**2 + 1)**(3/2))
dt/dx          = sqrt(4*a**2*x**2 + 1)/sqrt(W)
turning points : W = 0
liftoff        : 2*W*a/(4*a**2*x**2 + 1)**(3/2) + g/sqrt(4*a**2*x**2 + 1) = 0

V**2: closed form; direction is the sign of ds/dt
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
PARAMETERS = {'a': '0.5', 'gamma': '0.5', 'ell_c': '1', 'g': '9.81', 'm': '1'}


@compiled(PATH_AND_CONTACT_FORCE)
def path_and_contact_force(n, places, speeds, p, out):
    """x, z, ds/dx, curvature kappa, contact force N = m*(kappa*V**2 + n0), given V**2 (paper, eqs. 8, 15)."""
    places, speeds, p, out = carray(places, n), carray(speeds, n), carray(p, 5), carray(out, (5, n))
    a, g, m = p[0], p[3], p[4]
    for i in range(n):
        x, v2 = places[i], speeds[i]
        _t0 = x**2
        _t1 = 4*_t0*a**2 + 1
        _t2 = sqrt(_t1)
        _t3 = 2*a/sqrt(_t1)**3
        out[0, i] = x
        out[1, i] = _t0*a
        out[2, i] = _t2
        out[3, i] = _t3
        out[4, i] = m*(_t3*v2 + g/_t2)


@compiled(SPEED_EQUATION)
def speed_equation(n, places, speeds, v, nu, p, out):
    """ds/dx, P, Q, n0, kappa: dV**2/dx = P - Q*V**2, N = m*(kappa*V**2 + n0) (paper, eq. 19); v = sgn(ds/dt), nu = sgn(N)."""
    places, p, out = carray(places, n), carray(p, 5), carray(out, (5, n))
    a, gamma, ell_c, g, m = p[0], p[1], p[2], p[3], p[4]
    _t2 = 2*a
    for i in range(n):
        x = places[i]
        _t0 = 4*a**2*x**2 + 1
        ds = sqrt(_t0)
        _t3 = g/ds
        kappa = _t2/sqrt(_t0)**3
        turn = _t2/_t0
        push = -_t2*_t3*x
        n0 = _t3
        out[0, i] = ds
        out[1, i] = 2*ds*push - 2*ell_c**2*gamma*v*fabs(turn)/m
        out[2, i] = 0
        out[3, i] = n0
        out[4, i] = kappa


@compiled(STATIC_BALANCE)
def static_balance(n, places, p, out):
    """Acceleration from rest forwards, and backwards: a body rests where the first is <= 0 and the second >= 0."""
    places, p, out = carray(places, n), carray(p, 5), carray(out, (2, n))
    a, gamma, ell_c, g, m = p[0], p[1], p[2], p[3], p[4]
    _t1 = 2*a
    for i in range(n):
        x = places[i]
        _t0 = 4*a**2*x**2 + 1
        kappa = _t1/sqrt(_t0)**3
        push = -_t1*g*x/sqrt(_t0)
        out[0, i] = -ell_c**2*gamma*fabs(kappa)/m + push
        out[1, i] = ell_c**2*gamma*fabs(kappa)/m + push


@compiled(EFFECTIVE_POTENTIAL)
def effective_potential(n, places, p, out):
    """U per unit mass, V**2 = v0**2 - 2*(U(x) - U(lam0)), and dU/dx (paper, eq. 13)."""
    places, p, out = carray(places, n), carray(p, 5), carray(out, (2, n))
    a, g = p[0], p[3]
    _t0 = a*g
    for i in range(n):
        x = places[i]
        out[0, i] = _t0*x**2
        out[1, i] = 2*_t0*x


@compiled(BOUNDS)
def bounds(lo, hi, p, out):
    """Bounds of dU/dx and ds/dx for lo <= x <= hi, by interval arithmetic."""
    p, out = carray(p, 5), carray(out, 4)
    x = (lo, hi)
    a, g = (p[0], p[0]), (p[3], p[3])
    out[0], out[1] = imul(imul(imul(iconst(2.0), a), g), x)
    out[2], out[3] = isqrt(iadd(imul(imul(iconst(4.0), ipow(a, 2)), ipow(x, 2)), iconst(1.0)))


# The same formulas over a namespace of operations, for extended precision.

def exact_x(op, x, p):
    """Horizontal coordinate."""
    return x

def exact_z(op, x, p):
    """Height."""
    a = p[0]
    return a*x**2

def exact_ds(op, x, p):
    """ds/dx."""
    a = p[0]
    return op.sqrt(4*a**2*x**2 + 1)

def exact_kappa(op, x, p):
    """Signed curvature (paper, eq. 8)."""
    a = p[0]
    return 2*a/(4*a**2*x**2 + 1)**(op.mpf(3)/2)

def exact_static_normal_load(op, x, p):
    """n0 = N/m of a body at rest, so that N = m*(kappa*V**2 + n0) (paper, eq. 15)."""
    a, g = p[0], p[3]
    return g/op.sqrt(4*a**2*x**2 + 1)

def exact_speed_slope(op, x, w, v, nu, p):
    """dV**2/dx where V**2 = w, v = sgn(ds/dt) and nu = sgn(N) (paper, eq. 19)."""
    a, gamma, ell_c, g, m = p[0], p[1], p[2], p[3], p[4]
    _t0 = 4*a**2*x**2 + 1
    _t1 = op.sqrt(_t0)
    return 2*_t1*(-2*a*g*x/_t1 - 2*ell_c**2*gamma*v*abs(a)/(_t0**(op.mpf(3)/2)*m))

def exact_domain(op, p):
    """Both ends of the domain and the period; None for an open end or without a period."""
    return None, None, None


def pass1(lam: Any = None, lam0: Any = None, v0: Any = 0.0, direction: int = 1, *, out: Any = None, a: Any = '0.5', gamma: Any = '0.5', ell_c: Any = '1', g: Any = '9.81', m: Any = '1', **unknown: Any) -> Pass1:
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
    return MODEL.pass1((lam0, v0, direction), (a, gamma, ell_c, g, m), lam, out, unknown)


def solve(
    lam0: Any = None, v0: Any = 0.0, direction: int = 1, *, point: Any = None, t_max: Any = None,
    contact: str = "bilateral", a: Any = '0.5', gamma: Any = '0.5', ell_c: Any = '1', g: Any = '9.81', m: Any = '1',
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
    return MODEL.solve((lam0, v0, direction, point, t_max, contact), (a, gamma, ell_c, g, m), unknown)


def sweep(
    quantity: Any = None, lam0: Any = None, v0: Any = 0.0, direction: Any = 1, *, lam: Any = None, t_max: Any = None,
    contact: str = "bilateral", gradient: Any = None, client: Any = None, a: Any = '0.5', gamma: Any = '0.5',
    ell_c: Any = '1', g: Any = '9.81', m: Any = '1', **unknown: Any,
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
    return MODEL.sweep(quantity, launches, (a, gamma, ell_c, g, m), lam=lam, client=client, gradient=gradient, unknown=unknown)


def equilibria(*, between: Any = None, a: Any = '0.5', gamma: Any = '0.5', ell_c: Any = '1', g: Any = '9.81', m: Any = '1', **unknown: Any) -> "tuple[Equilibrium, ...]":
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
    return MODEL.equilibria((a, gamma, ell_c, g, m), between, unknown)


MODEL = CompiledModel(
    name='parabola_droplet', parameter='x', parameters=PARAMETERS, positive=(), source=__file__,
    units={'a': '1/m', 'ell_c': 'm', 'g': 'm/s**2', 'gamma': 'N/m', 'm': 'kg', 'x': 'm'},
    at_least=(('gamma', '0'), ('ell_c', '0')),
    functions=CompiledFunctions(
        path_and_contact_force,
    ),
    effective_potential=effective_potential, bounds=bounds,
    domain_of=exact_domain,
    dissipation=DissipativeFunctions(speed_equation, static_balance, friction=False, kinked=True, linear=True),
    exact=ExactLaw(
        exact_x, exact_z, exact_ds, exact_kappa, exact_static_normal_load, exact_speed_slope,
    ),
)
