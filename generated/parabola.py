# Made by gqm-gen for "parabola". Do not edit: change its declaration and generate again.
# interface 8, input 638613fc8598, body 2512cf9f3437
"""Bead in a parabolic bowl

x              = x
z              = a*x**2
ds/dx          = sqrt(4*a**2*x**2 + 1)
dx/ds          = 1/sqrt(4*a**2*x**2 + 1)
dz/ds          = 2*a*x/sqrt(4*a**2*x**2 + 1)
kappa          = 2*a/(4*a**2*x**2 + 1)**(3/2)
Theta          = -atan(2*a*lam0) + atan(2*a*x)
V**2           = 2*a*g*(lam0**2 - x**2) + v0**2
N              = m*(2*a*(2*a*g*(lam0**2 - x**2) + v0**2)/(4*a**2*x**2 + 1)**(3/2) + g/sqrt(4*a**2*x**2 + 1))
A              = -2*a*g*x/sqrt(4*a**2*x**2 + 1)
dt/dx          = sqrt(4*a**2*x**2 + 1)/sqrt(2*a*g*(lam0**2 - x**2) + v0**2)
turning points : 2*a*g*(lam0**2 - x**2) + v0**2 = 0
liftoff        : 2*a*(2*a*g*(lam0**2 - x**2) + v0**2)/(4*a**2*x**2 + 1)**(3/2) + g/sqrt(4*a**2*x**2 + 1) = 0
"""

from math import fabs, sqrt
from typing import TYPE_CHECKING, Any

from numba import carray

from gqm_sym.runtime import compiler

# Before anything else is asked of the runtime, so that another version of it is told from a broken one.
compiled = compiler(__file__, interface=8)

from gqm_sym.runtime.vocabulary import (
    BEND, BEND_EACH, BOUNDS, BOUNDS_EACH, CLIMB, CREST_EACH, FRAME, LOADS, RISE, RISE_EACH, SWING_EACH, TOP_EACH,
    Addresses, CompiledModel, Each, ExactFormulas, LaunchRequest, Pass1, iadd, iconst, imul, ipow, isqrt, left_of,
    nearest,
)

if TYPE_CHECKING:
    from gqm_sym.runtime import Motion, Sweep

PARAMETERS = {
    'a': '0.7',
    'g': '9.81',
    'm': '2',
}


@compiled(FRAME)
def frame(n, places, speeds, p, out):
    """x, z, ds/dx, signed curvature and contact force, given V**2 (paper, eq. 15)."""
    places, speeds, p, out = carray(places, n), carray(speeds, n), carray(p, 3), carray(out, (5, n))
    a, g, m = p[0], p[1], p[2]
    for i in range(n):
        x = places[i]
        v2 = speeds[i]
        _t0 = x**2
        _t1 = 4*_t0*a**2 + 1
        _t2 = sqrt(_t1)
        _t3 = 2*a/sqrt(_t1)**3
        out[0, i] = x
        out[1, i] = _t0*a
        out[2, i] = _t2
        out[3, i] = _t3
        out[4, i] = m*(_t3*v2 + g/_t2)


@compiled(LOADS, later=True)
def loads(n, w0, level, places, p, out):
    """x, z, ds/dx, signed curvature, V**2, contact force (paper, eq. 15), and the size of the heights in V**2."""
    places, p, out = carray(places, n), carray(p, 3), carray(out, (7, n))
    a, g, m = p[0], p[1], p[2]
    _c0 = fabs(a)
    _c1 = fabs(g)
    for i in range(n):
        x = places[i]
        _t0 = x**2
        _t1 = _t0*a
        _t2 = 4*_t0*a**2 + 1
        _t3 = sqrt(_t2)
        _t4 = 2*a/sqrt(_t2)**3
        _t5 = left_of(w0, 2*_t1*g, level)
        out[0, i] = x
        out[1, i] = _t1
        out[2, i] = _t3
        out[3, i] = _t4
        out[4, i] = _t5
        out[5, i] = m*(_t4*_t5 + g/_t3)
        out[6, i] = 2*_c0*_c1*_t0


@compiled(CLIMB)
def climb(n, places, p, out):
    """What V**2 loses in climbing to x, up to a constant, and its derivative (paper, eq. 13)."""
    places, p, out = carray(places, n), carray(p, 3), carray(out, (2, n))
    a, g = p[0], p[1]
    _t0 = a*g
    for i in range(n):
        x = places[i]
        out[0, i] = 2*_t0*x**2
        out[1, i] = 4*_t0*x


@compiled(RISE)
def rise(n, _a, places, offsets, p, out):
    """climb[a, x] = (climb(x) - climb(a))/(x - a) without cancellation, and ds/dx."""
    places, offsets, p, out = carray(places, n), carray(offsets, n), carray(p, 3), carray(out, (2, n))
    a, g = p[0], p[1]
    for i in range(n):
        x = places[i]
        out[0, i] = 2*a*g*(_a + x)
        out[1, i] = sqrt(4*a**2*x**2 + 1)


@compiled(BEND)
def bend(n, _a, b, left, right, p, out):
    """climb[a, x, b] = V**2/((x - a)*(b - x)) between turning points, without cancellation, and ds/dx."""
    left, right, p, out = carray(left, n), carray(right, n), carray(p, 3), carray(out, (2, n))
    a, g = p[0], p[1]
    for i in range(n):
        da = left[i]
        db = right[i]
        x = nearest(_a, b, da, db)
        out[0, i] = 2*a*g
        out[1, i] = sqrt(4*a**2*x**2 + 1)


@compiled(RISE_EACH, later=True)
def rise_each(n, starts, places, offsets, p, out):
    """climb[a, x], ds/dx and the climb's derivative, each for a launch of its own."""
    starts, places, offsets, p, out = carray(starts, n), carray(places, n), carray(offsets, n), carray(p, (3, n)), carray(out, (3, n))
    for i in range(n):
        a = p[0, i]
        g = p[1, i]
        _a = starts[i]
        x = places[i]
        _t0 = a*g
        out[0, i] = 2*_t0*(_a + x)
        out[1, i] = sqrt(4*a**2*x**2 + 1)
        out[2, i] = 4*_t0*x


@compiled(BEND_EACH, later=True)
def bend_each(n, lows, highs, left, right, p, out):
    """climb[a, x, b] and ds/dx, each for an orbit of its own; NaN where the closed form ends."""
    lows, highs, left, right, p, out = carray(lows, n), carray(highs, n), carray(left, n), carray(right, n), carray(p, (3, n)), carray(out, (2, n))
    for i in range(n):
        a = p[0, i]
        g = p[1, i]
        _a = lows[i]
        b = highs[i]
        da = left[i]
        db = right[i]
        x = nearest(_a, b, da, db)
        out[0, i] = 2*a*g
        out[1, i] = sqrt(4*a**2*x**2 + 1)


@compiled(SWING_EACH, later=True)
def swing_each(n, fall, rise, p, out):
    """(dt/du)**2 where sin(u)**2 = fall = 1 - rise, and what that is divided by, each for an orbit of its own."""
    p, out = carray(p, (4, n)), carray(out, (2, n))
    for i in range(n):
        a = p[0, i]
        g = p[1, i]
        top = p[3, i]
        out[0, i] = (4*a**2*fall*top + 1)/(2*a*g)
        out[1, i] = 2*a*g


@compiled(TOP_EACH, later=True)
def top_each(n, halves, p, out):
    """What is the same all along a swing: ``swing_each`` finds it behind the run-time parameters."""
    halves, p, out = carray(halves, n), carray(p, (3, n)), carray(out, (1, n))
    for i in range(n):
        half = halves[i]
        out[0, i] = half**2


@compiled(CREST_EACH, later=True)
def crest_each(n, offsets, launches, p, out):
    """Half an orbit's width, where V**2 at an offset is used up; how the climb grows; above 1 where it never is."""
    offsets, launches, p, out = carray(offsets, n), carray(launches, n), carray(p, (3, n)), carray(out, (3, n))
    for i in range(n):
        a = p[0, i]
        g = p[1, i]
        offset = offsets[i]
        launch = launches[i]
        out[0, i] = sqrt(offset**2 + launch/(2*a*g))
        out[1, i] = 2*a*g
        out[2, i] = 0


@compiled(BOUNDS)
def bounds(lo, hi, p, out):
    """Bounds of the climb's slope and of ds/dx for lo <= x <= hi."""
    p, out = carray(p, 3), carray(out, 4)
    x = (lo, hi)
    a = (p[0], p[0])
    g = (p[1], p[1])
    out[0], out[1] = imul(imul(imul(iconst(4.0), a), g), x)
    out[2], out[3] = isqrt(iadd(imul(imul(iconst(4.0), ipow(a, 2)), ipow(x, 2)), iconst(1.0)))


@compiled(BOUNDS_EACH, later=True)
def bounds_each(n, lo, hi, p, out):
    """Bounds over many intervals of the climb's slope and of ds/dx for lo <= x <= hi, each for parameters of its own."""
    lo, hi, p, out = carray(lo, n), carray(hi, n), carray(p, (3, n)), carray(out, (4, n))
    for i in range(n):
        x = (lo[i], hi[i])
        a = (p[0, i], p[0, i])
        g = (p[1, i], p[1, i])
        out[0, i], out[1, i] = imul(imul(imul(iconst(4.0), a), g), x)
        out[2, i], out[3, i] = isqrt(iadd(imul(imul(iconst(4.0), ipow(a, 2)), ipow(x, 2)), iconst(1.0)))


# The same formulas over a namespace of operations: extended precision evaluates these.


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
    """Signed curvature."""
    a = p[0]
    return 2*a/(4*a**2*x**2 + 1)**(op.mpf(3)/2)


def exact_reaction(op, x, p):
    """Contact force per unit mass of a body at rest."""
    a = p[0]
    g = p[1]
    return g/op.sqrt(4*a**2*x**2 + 1)


def exact_climb(op, x, p):
    """What V**2 loses in climbing, up to a constant."""
    a = p[0]
    g = p[1]
    return 2*a*g*x**2


def exact_climb_slope(op, x, p):
    """Its derivative by x."""
    a = p[0]
    g = p[1]
    return 4*a*g*x


def exact_domain(op, p):
    """Both ends of the domain, and the period; None where there is none."""
    return None, None, None


def exact_axes(op, p):
    """A place about which V**2 and ds are even, and the distance to the next; None where there is none."""
    return 0, None


MODEL = CompiledModel(
    name='parabola',
    parameter='x',
    parameters=PARAMETERS,
    positive=(),
    addresses=Addresses(frame.address, climb.address, rise.address, bend.address, bounds.address),
    loads=loads,
    each=Each(rise=rise_each, bend=bend_each, swing=swing_each, top=top_each, crest=crest_each, bounds=bounds_each, top_held=1),
    domain_of=exact_domain,
    axes_of=exact_axes,
    monotone=True,
    exact=ExactFormulas(exact_x, exact_z, exact_ds, exact_kappa, exact_reaction, exact_climb, exact_climb_slope),
)


def pass1(lam: Any, lam0: Any, v0: Any = 0.0, direction: int = 1, *, out: Any = None, a: Any = '0.7', g: Any = '9.81', m: Any = '2') -> Pass1:
    """Position, metric, curvature, V**2 and contact force at places of the curve (Pass 1, no quadrature).

    Parameters
    ----------
    lam : array_like
        Places on the curve, as values of its parameter x.
    lam0, v0, direction
        Launch place, speed and direction (+1 or -1: the sign of ds/dt).
    out : Pass1, optional
        The result of a call before, or six arrays like it, to be filled again.
    a, g, m
        Run-time parameters; `PARAMETERS` holds their defaults.

    Returns
    -------
    Pass1
        Arrays x, z, ds, kappa, v2 and normal_force.
    """
    return MODEL.pass1(LaunchRequest(lam0, v0, direction), (a, g, m,), lam, out)


def solve(
    lam0: Any = None,
    v0: Any = 0.0,
    direction: int = 1,
    *,
    point: Any = None,
    t_max: Any = None,
    contact: str = "bilateral",
    a: Any = '0.7', g: Any = '9.81', m: Any = '2',
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
    a, g, m
        Run-time parameters; `PARAMETERS` holds their defaults.

    Returns
    -------
    Motion

    Raises
    ------
    GQMError
        For a launch or a parameter that cannot be; the message says what would be right.
    """
    return MODEL.solve(LaunchRequest(lam0, v0, direction, point, t_max, contact), (a, g, m,))


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
    a: Any = '0.7', g: Any = '9.81', m: Any = '2',
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
    a, g, m
        Run-time parameters; `PARAMETERS` holds their defaults.

    Returns
    -------
    Sweep
        ``values``, NaN where there is none; ``status``, 0 where there is one, and ``route``, how each was found.
        ``status_counts()`` counts the launches without a value.
    """
    launches = LaunchRequest(lam0, v0, direction, None, t_max, contact)
    return MODEL.sweep(quantity, launches, (a, g, m,), lam=lam, client=client, source=__file__)
