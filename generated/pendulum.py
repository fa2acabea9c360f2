# Made by gqm-gen for "pendulum". Do not edit: change its declaration and generate again.
# interface 8, input abbc42e6e84e, body ddd6ea9c6bf5
"""Simple pendulum, angle from the horizontal

x              = L*cos(theta)
z              = L*sin(theta)
ds/dtheta      = L
dx/ds          = -sin(theta)
dz/ds          = cos(theta)
kappa          = 1/L
Theta          = -lam0 + theta
V**2           = 2*L*g*(sin(lam0) - sin(theta)) + v0**2
N              = m*(-g*sin(theta) + (2*L*g*(sin(lam0) - sin(theta)) + v0**2)/L)
A              = -g*cos(theta)
dt/dtheta      = L/sqrt(2*L*g*(sin(lam0) - sin(theta)) + v0**2)
turning points : 2*L*g*(sin(lam0) - sin(theta)) + v0**2 = 0
liftoff        : -g*sin(theta) + (2*L*g*(sin(lam0) - sin(theta)) + v0**2)/L = 0
"""

from math import fabs, sqrt
from typing import TYPE_CHECKING, Any

from numba import carray

from gqm_sym.runtime import compiler

# Before anything else is asked of the runtime, so that another version of it is told from a broken one.
compiled = compiler(__file__, interface=8)

from gqm_sym.runtime.vocabulary import (
    BEND, BEND_EACH, BOUNDS, BOUNDS_EACH, CLIMB, CREST_EACH, FRAME, LOADS, MEAN_EACH, ORBIT_EACH, RISE, RISE_EACH,
    Addresses, CompiledModel, Each, ExactFormulas, LaunchRequest, Pass1, atan, cos, iconst, icos, imul, left_of,
    near_even, near_odd, nearest, sin, sin1, sin2,
)

if TYPE_CHECKING:
    from gqm_sym.runtime import Motion, Sweep

PARAMETERS = {
    'L': '1',
    'g': '9.81',
    'm': '1',
}


@compiled(FRAME)
def frame(n, places, speeds, p, out):
    """x, z, ds/dtheta, signed curvature and contact force, given V**2 (paper, eq. 15)."""
    places, speeds, p, out = carray(places, n), carray(speeds, n), carray(p, 3), carray(out, (5, n))
    L, g, m = p[0], p[1], p[2]
    _t1 = 1/L
    for i in range(n):
        theta = places[i]
        v2 = speeds[i]
        _t0 = sin(theta)
        out[0, i] = L*cos(theta)
        out[1, i] = L*_t0
        out[2, i] = L
        out[3, i] = _t1
        out[4, i] = m*(-_t0*g + _t1*v2)


@compiled(LOADS, later=True)
def loads(n, w0, level, places, p, out):
    """x, z, ds/dtheta, signed curvature, V**2, contact force (paper, eq. 15), and the size of the heights in V**2."""
    places, p, out = carray(places, n), carray(p, 3), carray(out, (7, n))
    L, g, m = p[0], p[1], p[2]
    _t2 = 1/L
    _c0 = fabs(L)
    _c1 = fabs(g)
    for i in range(n):
        theta = places[i]
        _t0 = sin(theta)
        _t1 = L*_t0
        _t3 = left_of(w0, 2*_t1*g, level)
        out[0, i] = L*cos(theta)
        out[1, i] = _t1
        out[2, i] = L
        out[3, i] = _t2
        out[4, i] = _t3
        out[5, i] = m*(-_t0*g + _t2*_t3)
        out[6, i] = 2*_c0*_c1*fabs(_t0)


@compiled(CLIMB)
def climb(n, places, p, out):
    """What V**2 loses in climbing to theta, up to a constant, and its derivative (paper, eq. 13)."""
    places, p, out = carray(places, n), carray(p, 3), carray(out, (2, n))
    L, g = p[0], p[1]
    _t0 = 2*L*g
    for i in range(n):
        theta = places[i]
        out[0, i] = _t0*sin(theta)
        out[1, i] = _t0*cos(theta)


@compiled(RISE)
def rise(n, a, places, offsets, p, out):
    """climb[a, theta] = (climb(theta) - climb(a))/(theta - a) without cancellation, and ds/dtheta."""
    places, offsets, p, out = carray(places, n), carray(offsets, n), carray(p, 3), carray(out, (2, n))
    L, g = p[0], p[1]
    for i in range(n):
        theta = places[i]
        d = offsets[i]
        out[0, i] = 2*L*g*sin1(a, theta, d)
        out[1, i] = L


@compiled(BEND)
def bend(n, a, b, left, right, p, out):
    """climb[a, theta, b] = V**2/((theta - a)*(b - theta)) between turning points, without cancellation, and ds/dtheta."""
    left, right, p, out = carray(left, n), carray(right, n), carray(p, 3), carray(out, (2, n))
    L, g = p[0], p[1]
    for i in range(n):
        da = left[i]
        db = right[i]
        theta = nearest(a, b, da, db)
        out[0, i] = 2*L*g*sin2(a, theta, b, da, db)
        out[1, i] = L


@compiled(RISE_EACH, later=True)
def rise_each(n, starts, places, offsets, p, out):
    """climb[a, theta], ds/dtheta and the climb's derivative, each for a launch of its own."""
    starts, places, offsets, p, out = carray(starts, n), carray(places, n), carray(offsets, n), carray(p, (3, n)), carray(out, (3, n))
    for i in range(n):
        L = p[0, i]
        g = p[1, i]
        a = starts[i]
        theta = places[i]
        d = offsets[i]
        _t0 = 2*L*g
        out[0, i] = _t0*sin1(a, theta, d)
        out[1, i] = L
        out[2, i] = _t0*cos(theta)


@compiled(BEND_EACH, later=True)
def bend_each(n, lows, highs, left, right, p, out):
    """climb[a, theta, b] and ds/dtheta, each for an orbit of its own; NaN where the closed form ends."""
    lows, highs, left, right, p, out = carray(lows, n), carray(highs, n), carray(left, n), carray(right, n), carray(p, (5, n)), carray(out, (2, n))
    for i in range(n):
        L = p[0, i]
        g = p[1, i]
        _c0 = p[3, i]
        _c1 = p[4, i]
        da = left[i]
        db = right[i]
        out[0, i] = 2*L*g*(_c0*near_even(da, db) + _c1*(da/2 - db/2)*near_odd(da, db))
        out[1, i] = L


@compiled(ORBIT_EACH, later=True)
def orbit_each(n, lows, highs, p, out):
    """What is the same all along an orbit: ``bend_each`` finds it behind the run-time parameters."""
    lows, highs, p, out = carray(lows, n), carray(highs, n), carray(p, (3, n)), carray(out, (2, n))
    for i in range(n):
        a = lows[i]
        b = highs[i]
        _t0 = a/2 + b/2
        out[0, i] = sin(_t0)
        out[1, i] = cos(_t0)


@compiled(MEAN_EACH, later=True)
def mean_each(n, halves, p, out):
    """Squares of two numbers, each pair for an orbit of its own: its half period is pi over their agm (Gauss)."""
    halves, p, out = carray(halves, n), carray(p, (3, n)), carray(out, (2, n))
    for i in range(n):
        L = p[0, i]
        g = p[1, i]
        half = halves[i]
        _t0 = g/L
        out[0, i] = _t0*cos(half/4)**4
        out[1, i] = _t0*cos(half/2)


@compiled(CREST_EACH, later=True)
def crest_each(n, offsets, launches, p, out):
    """Half an orbit's width, where V**2 at an offset is used up; how the climb grows; above 1 where it never is."""
    offsets, launches, p, out = carray(offsets, n), carray(launches, n), carray(p, (3, n)), carray(out, (3, n))
    for i in range(n):
        L = p[0, i]
        g = p[1, i]
        offset = offsets[i]
        launch = launches[i]
        _t0 = sin(offset/2)**2 + launch/(4*L*g)
        out[0, i] = 4*atan(sqrt(_t0)/(sqrt(1 - _t0) + 1))
        out[1, i] = 4*L*g
        out[2, i] = _t0


@compiled(BOUNDS)
def bounds(lo, hi, p, out):
    """Bounds of the climb's slope and of ds/dtheta for lo <= theta <= hi."""
    p, out = carray(p, 3), carray(out, 4)
    theta = (lo, hi)
    L = (p[0], p[0])
    g = (p[1], p[1])
    out[0], out[1] = imul(imul(imul(iconst(2.0), L), g), icos(theta))
    out[2], out[3] = L


@compiled(BOUNDS_EACH, later=True)
def bounds_each(n, lo, hi, p, out):
    """Bounds over many intervals of the climb's slope and of ds/dtheta for lo <= theta <= hi, each for parameters of its own."""
    lo, hi, p, out = carray(lo, n), carray(hi, n), carray(p, (3, n)), carray(out, (4, n))
    for i in range(n):
        theta = (lo[i], hi[i])
        L = (p[0, i], p[0, i])
        g = (p[1, i], p[1, i])
        out[0, i], out[1, i] = imul(imul(imul(iconst(2.0), L), g), icos(theta))
        out[2, i], out[3, i] = L


# The same formulas over a namespace of operations: extended precision evaluates these.


def exact_x(op, theta, p):
    """Horizontal coordinate."""
    L = p[0]
    return L*op.cos(theta)


def exact_z(op, theta, p):
    """Height."""
    L = p[0]
    return L*op.sin(theta)


def exact_ds(op, theta, p):
    """ds/dtheta."""
    L = p[0]
    return L


def exact_kappa(op, theta, p):
    """Signed curvature."""
    L = p[0]
    return 1/L


def exact_reaction(op, theta, p):
    """Contact force per unit mass of a body at rest."""
    g = p[1]
    return -g*op.sin(theta)


def exact_climb(op, theta, p):
    """What V**2 loses in climbing, up to a constant."""
    L = p[0]
    g = p[1]
    return 2*L*g*op.sin(theta)


def exact_climb_slope(op, theta, p):
    """Its derivative by theta."""
    L = p[0]
    g = p[1]
    return 2*L*g*op.cos(theta)


def exact_domain(op, p):
    """Both ends of the domain, and the period; None where there is none."""
    return None, None, 2*op.pi


def exact_axes(op, p):
    """A place about which V**2 and ds are even, and the distance to the next; None where there is none."""
    return -op.pi/2, op.pi


MODEL = CompiledModel(
    name='pendulum',
    parameter='theta',
    parameters=PARAMETERS,
    positive=('L',),
    addresses=Addresses(frame.address, climb.address, rise.address, bend.address, bounds.address),
    loads=loads,
    each=Each(rise=rise_each, bend=bend_each, orbit=orbit_each, mean=mean_each, crest=crest_each, bounds=bounds_each, held=2),
    domain_of=exact_domain,
    axes_of=exact_axes,
    monotone=True,
    exact=ExactFormulas(exact_x, exact_z, exact_ds, exact_kappa, exact_reaction, exact_climb, exact_climb_slope),
)


def pass1(lam: Any, lam0: Any, v0: Any = 0.0, direction: int = 1, *, out: Any = None, L: Any = '1', g: Any = '9.81', m: Any = '1') -> Pass1:
    """Position, metric, curvature, V**2 and contact force at places of the curve (Pass 1, no quadrature).

    Parameters
    ----------
    lam : array_like
        Places on the curve, as values of its parameter theta.
    lam0, v0, direction
        Launch place, speed and direction (+1 or -1: the sign of ds/dt).
    out : Pass1, optional
        The result of a call before, or six arrays like it, to be filled again.
    L, g, m
        Run-time parameters; `PARAMETERS` holds their defaults.

    Returns
    -------
    Pass1
        Arrays x, z, ds, kappa, v2 and normal_force.
    """
    return MODEL.pass1(LaunchRequest(lam0, v0, direction), (L, g, m,), lam, out)


def solve(
    lam0: Any = None,
    v0: Any = 0.0,
    direction: int = 1,
    *,
    point: Any = None,
    t_max: Any = None,
    contact: str = "bilateral",
    L: Any = '1', g: Any = '9.81', m: Any = '1',
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
    L, g, m
        Run-time parameters; `PARAMETERS` holds their defaults.

    Returns
    -------
    Motion

    Raises
    ------
    GQMError
        For a launch or a parameter that cannot be; the message says what would be right.
    """
    return MODEL.solve(LaunchRequest(lam0, v0, direction, point, t_max, contact), (L, g, m,))


def sweep(
    quantity: str,
    lam0: Any,
    v0: Any = 0.0,
    direction: Any = 1,
    *,
    lam: Any = None,
    t_max: Any = None,
    contact: str = "bilateral",
    client: Any = None,
    L: Any = '1', g: Any = '9.81', m: Any = '1',
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
    client : distributed.Client, optional
        A Dask cluster to do the work, with the same results.
    L, g, m
        Run-time parameters; `PARAMETERS` holds their defaults.

    Returns
    -------
    Sweep
        ``values``, NaN where there is none; ``status``, 0 where there is one, and ``route``, how each was found.
        ``status_counts()`` counts the launches without a value.
    """
    launches = LaunchRequest(lam0, v0, direction, None, t_max, contact)
    return MODEL.sweep(quantity, launches, (L, g, m,), lam=lam, client=client, source=__file__)
