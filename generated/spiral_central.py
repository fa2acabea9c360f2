# Made by gqm-gen for "spiral_central". Do not edit: change its declaration and generate again.
# interface 8, input a75a85ae8f6e, body 887b8c75a3e7
"""Bead on a logarithmic spiral, drawn to its pole

x              = r0*exp(b*theta)*cos(theta)
z              = r0*exp(b*theta)*sin(theta)
ds/dtheta      = r0*sqrt(b**2 + 1)*exp(b*theta)
dx/ds          = (b*cos(theta) - sin(theta))/sqrt(b**2 + 1)
dz/ds          = (b*sin(theta) + cos(theta))/sqrt(b**2 + 1)
kappa          = exp(-b*theta)/(r0*sqrt(b**2 + 1))
Theta          = -lam0 + theta
V**2           = 2*k*(exp(-b*theta)/sqrt(sin(theta)**2 + cos(theta)**2) - exp(-b*lam0)/sqrt(sin(lam0)**2 + cos(lam0)**2))/Abs(r0) + v0**2
N              = m*(k*(-(b*sin(theta) + cos(theta))*cos(theta) + (b*cos(theta) - sin(theta))*sin(theta))*exp(-2*b*theta)*Abs(r0)/(r0**3*sqrt(b**2 + 1)*(sin(theta)**2 + cos(theta)**2)**(3/2)) + (2*k*(exp(-b*theta)/sqrt(sin(theta)**2 + cos(theta)**2) - exp(-b*lam0)/sqrt(sin(lam0)**2 + cos(lam0)**2))/Abs(r0) + v0**2)*exp(-b*theta)/(r0*sqrt(b**2 + 1)))
A              = -k*((b*sin(theta) + cos(theta))*sin(theta) + (b*cos(theta) - sin(theta))*cos(theta))*exp(-2*b*theta)*Abs(r0)/(r0**3*sqrt(b**2 + 1)*(sin(theta)**2 + cos(theta)**2)**(3/2))
dt/dtheta      = r0*sqrt(b**2 + 1)*exp(b*theta)/sqrt(2*k*(exp(-b*theta)/sqrt(sin(theta)**2 + cos(theta)**2) - exp(-b*lam0)/sqrt(sin(lam0)**2 + cos(lam0)**2))/Abs(r0) + v0**2)
turning points : 2*k*(exp(-b*theta)/sqrt(sin(theta)**2 + cos(theta)**2) - exp(-b*lam0)/sqrt(sin(lam0)**2 + cos(lam0)**2))/Abs(r0) + v0**2 = 0
liftoff        : k*(-(b*sin(theta) + cos(theta))*cos(theta) + (b*cos(theta) - sin(theta))*sin(theta))*exp(-2*b*theta)*Abs(r0)/(r0**3*sqrt(b**2 + 1)*(sin(theta)**2 + cos(theta)**2)**(3/2)) + (2*k*(exp(-b*theta)/sqrt(sin(theta)**2 + cos(theta)**2) - exp(-b*lam0)/sqrt(sin(lam0)**2 + cos(lam0)**2))/Abs(r0) + v0**2)*exp(-b*theta)/(r0*sqrt(b**2 + 1)) = 0
"""

from math import fabs, sqrt
from typing import TYPE_CHECKING, Any

from numba import carray

from gqm_sym.runtime import compiler

# Before anything else is asked of the runtime, so that another version of it is told from a broken one.
compiled = compiler(__file__, interface=8)

from gqm_sym.runtime.vocabulary import (
    BEND, BEND_EACH, BOUNDS, BOUNDS_EACH, CLIMB, FRAME, LOADS, ORBIT_EACH, RISE, RISE_EACH, Addresses, CompiledModel,
    Each, ExactFormulas, LaunchRequest, Pass1, cos, cos1, cos2, exp, exp1, exp2, iabs, iadd, iconst, icos, iexp, imul,
    ipow, isin, isqrt, left_of, near_even, near_odd, near_sinc, nearest, sin, sin1, sin2,
)

if TYPE_CHECKING:
    from gqm_sym.runtime import Motion, Sweep

PARAMETERS = {
    'r0': '1',
    'b': '0.15',
    'k': '2',
    'm': '1',
}


@compiled(FRAME)
def frame(n, places, speeds, p, out):
    """x, z, ds/dtheta, signed curvature and contact force, given V**2 (paper, eq. 15)."""
    places, speeds, p, out = carray(places, n), carray(speeds, n), carray(p, 4), carray(out, (5, n))
    r0, b, k, m = p[0], p[1], p[2], p[3]
    _t0 = sqrt(b**2 + 1)
    _c0 = fabs(r0)
    _c1 = 1/_t0
    _c2 = _t0
    for i in range(n):
        theta = places[i]
        v2 = speeds[i]
        _t1 = cos(theta)
        _t2 = b*theta
        _t3 = r0*exp(_t2)
        _t4 = sin(theta)
        _t5 = _c1*exp(-_t2)/r0
        out[0, i] = _t1*_t3
        out[1, i] = _t3*_t4
        out[2, i] = _c2*_t3
        out[3, i] = _t5
        out[4, i] = m*(_c0*_c1*k*(-_t1*(_t1 + _t4*b) + _t4*(_t1*b - _t4))*exp(-2*_t2)/(r0**3*sqrt(_t1**2 + _t4**2)**3) + _t5*v2)


@compiled(LOADS, later=True)
def loads(n, w0, level, places, p, out):
    """x, z, ds/dtheta, signed curvature, V**2, contact force (paper, eq. 15), and the size of the heights in V**2."""
    places, p, out = carray(places, n), carray(p, 4), carray(out, (7, n))
    r0, b, k, m = p[0], p[1], p[2], p[3]
    _t0 = sqrt(b**2 + 1)
    _c0 = fabs(k)
    _c1 = fabs(r0)
    _c2 = 1/_t0
    _c3 = _t0
    for i in range(n):
        theta = places[i]
        e0 = exp(b*theta)
        _t1 = cos(theta)
        _t2 = e0*r0
        _t3 = sin(theta)
        _t4 = 1/e0
        _t5 = _c2*_t4/r0
        _t6 = _t1**2 + _t3**2
        _t7 = 2*_t4/(_c1*sqrt(_t6))
        _t8 = left_of(w0, -_t7*k, level)
        out[0, i] = _t1*_t2
        out[1, i] = _t2*_t3
        out[2, i] = _c3*_t2
        out[3, i] = _t5
        out[4, i] = _t8
        out[5, i] = m*(_c1*_c2*k*(-_t1*(_t1 + _t3*b) + _t3*(_t1*b - _t3))*exp(-2*b*theta)/(r0**3*sqrt(_t6)**3) + _t5*_t8)
        out[6, i] = _c0*_t7


@compiled(CLIMB)
def climb(n, places, p, out):
    """What V**2 loses in climbing to theta, up to a constant, and its derivative (paper, eq. 13)."""
    places, p, out = carray(places, n), carray(p, 4), carray(out, (2, n))
    r0, b, k = p[0], p[1], p[2]
    _c0 = fabs(r0)
    for i in range(n):
        theta = places[i]
        _t0 = sin(theta)
        _t1 = cos(theta)
        _t2 = _t0**2 + _t1**2
        _t3 = 2*k*exp(-b*theta)
        out[0, i] = -_t3/(_c0*sqrt(_t2))
        out[1, i] = _c0*_t3*(_t0*(_t0*b + _t1) + _t1*(-_t0 + _t1*b))/(r0**2*sqrt(_t2)**3)


@compiled(RISE)
def rise(n, a, places, offsets, p, out):
    """climb[a, theta] = (climb(theta) - climb(a))/(theta - a) without cancellation, and ds/dtheta."""
    places, offsets, p, out = carray(places, n), carray(offsets, n), carray(p, 4), carray(out, (2, n))
    r0, b, k = p[0], p[1], p[2]
    _t0 = -a*b
    _t1 = sin(a)
    _t2 = cos(a)
    _c0 = fabs(r0)
    _c2 = sqrt(b**2 + 1)
    _t3 = sqrt(_t1**2 + _t2**2)
    _c1 = exp(_t0)
    _c5 = _t1
    _c6 = _t2
    _c3 = 1/_t3
    _c4 = _t3
    for i in range(n):
        theta = places[i]
        d = offsets[i]
        _t4 = sin(theta)
        _t5 = cos(theta)
        _t6 = sqrt(_t4**2 + _t5**2)
        _t7 = 1/_t6
        _t8 = b*theta
        out[0, i] = -2*k*(-_c1*_c3*_t7*((_c5 + _t4)*sin1(a, theta, d) + (_c6 + _t5)*cos1(a, theta, d))/(_c4 + _t6) - _t7*b*exp1(_t0, -_t8, -b*d))/_c0
        out[1, i] = _c2*r0*exp(_t8)


@compiled(BEND)
def bend(n, a, _b, left, right, p, out):
    """climb[a, theta, b] = V**2/((theta - a)*(b - theta)) between turning points, without cancellation, and ds/dtheta."""
    left, right, p, out = carray(left, n), carray(right, n), carray(p, 4), carray(out, (2, n))
    r0, b, k = p[0], p[1], p[2]
    _t0 = -a*b
    _t1 = b**2
    _t2 = _b - a
    _t3 = sin(_b)
    _t4 = cos(_b)
    _t6 = sin(a)
    _t7 = cos(a)
    _c0 = fabs(r0)
    _t5 = sqrt(_t3**2 + _t4**2)
    _t8 = sqrt(_t6**2 + _t7**2)
    _c1 = exp(_t0)
    _c2 = sqrt(_t1 + 1)
    _c3 = cos1(a, _b, _t2)
    _c4 = sin1(a, _b, _t2)
    _c9 = _t3
    _c10 = _t6
    _c11 = _t4
    _c12 = _t7
    _c5 = 1/_t5
    _c6 = _t5
    _c7 = 1/_t8
    _c8 = _t8
    for i in range(n):
        da = left[i]
        db = right[i]
        theta = nearest(a, _b, da, db)
        _t9 = b*theta
        _t10 = -_t9
        _t11 = -b*da
        _t12 = sin(theta)
        _t13 = cos(theta)
        _t14 = sqrt(_t12**2 + _t13**2)
        _t15 = 1/(_c6 + _t14)
        _t16 = _c11 + _t13
        _t17 = _c9 + _t12
        _t18 = _c5/_t14
        _t19 = sin1(a, theta, da)
        _t20 = cos1(a, theta, da)
        _t21 = (_c3*(_c11 + _c12) + _c4*(_c10 + _c9))*(_t19*(_c10 + _t12) + _t20*(_c12 + _t13))/((_c6 + _c8)*(_c8 + _t14))
        out[0, i] = -2*k*(_c1*(_c7*_t18*_t21 - _t18*(-_t15*_t21 + _t15*(_c3*_t20 + _c4*_t19 + _t16*cos2(a, theta, _b, da, db) + _t17*sin2(a, theta, _b, da, db)))) + _c5*_t1*exp2(_t0, _t10, -_b*b, _t11, -b*db) + _t15*_t18*b*(_t16*cos1(theta, _b, db) + _t17*sin1(theta, _b, db))*exp1(_t0, _t10, _t11))/_c0
        out[1, i] = _c2*r0*exp(_t9)


@compiled(RISE_EACH, later=True)
def rise_each(n, starts, places, offsets, p, out):
    """climb[a, theta], ds/dtheta and the climb's derivative, each for a launch of its own."""
    starts, places, offsets, p, out = carray(starts, n), carray(places, n), carray(offsets, n), carray(p, (4, n)), carray(out, (3, n))
    for i in range(n):
        r0 = p[0, i]
        b = p[1, i]
        k = p[2, i]
        a = starts[i]
        theta = places[i]
        d = offsets[i]
        _t0 = fabs(r0)
        _t1 = sin(theta)
        _t2 = cos(theta)
        _t3 = _t1**2 + _t2**2
        _t4 = sqrt(_t3)
        _t5 = 1/_t4
        _t6 = -a*b
        _t7 = b*theta
        _t8 = -_t7
        _t9 = sin(a)
        _t10 = cos(a)
        _t11 = sqrt(_t10**2 + _t9**2)
        _t12 = 2*k
        out[0, i] = -_t12*(-_t5*b*exp1(_t6, _t8, -b*d) - _t5*((_t1 + _t9)*sin1(a, theta, d) + (_t10 + _t2)*cos1(a, theta, d))*exp(_t6)/(_t11*(_t11 + _t4)))/_t0
        out[1, i] = r0*sqrt(b**2 + 1)*exp(_t7)
        out[2, i] = _t0*_t12*(_t1*(_t1*b + _t2) + _t2*(-_t1 + _t2*b))*exp(_t8)/(r0**2*sqrt(_t3)**3)


@compiled(BEND_EACH, later=True)
def bend_each(n, lows, highs, left, right, p, out):
    """climb[a, theta, b] and ds/dtheta, each for an orbit of its own; NaN where the closed form ends."""
    lows, highs, left, right, p, out = carray(lows, n), carray(highs, n), carray(left, n), carray(right, n), carray(p, (21, n)), carray(out, (2, n))
    for i in range(n):
        r0 = p[0, i]
        b = p[1, i]
        k = p[2, i]
        _c0 = p[4, i]
        _c1 = p[5, i]
        _c2 = p[6, i]
        _c3 = p[7, i]
        _c4 = p[8, i]
        _c5 = p[9, i]
        _c6 = p[10, i]
        _c7 = p[11, i]
        _c8 = p[12, i]
        _c9 = p[13, i]
        _c10 = p[14, i]
        _c11 = p[15, i]
        _c12 = p[16, i]
        _c13 = p[17, i]
        _c14 = p[18, i]
        _c15 = p[19, i]
        _c16 = p[20, i]
        a = lows[i]
        _b = highs[i]
        da = left[i]
        db = right[i]
        theta = nearest(a, _b, da, db)
        _t0 = -a*b
        _t1 = b*theta
        _t2 = -_t1
        _t3 = -b*da
        _t4 = near_even(da, db)
        _t5 = da*db
        _t6 = _c7 - _t4*_t5
        _t7 = da/2 - db/2
        _t8 = _t7*near_odd(da, db)
        _t9 = _c4*_t7 - _t5*_t8
        _t10 = _c6*_t6 + _c8*_t9
        _t11 = _c6*_t9
        _t12 = sqrt(_t10**2 + (_c8*_t6 - _t11)**2)
        _t13 = 1/(_c10 + _t12)
        _t14 = _c13 + _t10
        _t15 = _c8*_t6 - _t11
        _t16 = _c15 + _t15
        _t17 = _c9/_t12
        _t18 = sin1(a, theta, da)
        _t19 = cos1(a, theta, da)
        _t20 = (_c3*(_c15 + _c16) + _c5*(_c13 + _c14))*(_t18*(_c14 + _t10) + _t19*(_c16 + _t15))/((_c10 + _c12)*(_c12 + _t12))
        out[0, i] = -2*k*(_c1*(_c11*_t17*_t20 - _t17*(-_t13*_t20 + _t13*(_c3*_t19 + _c5*_t18 + _t14*(_c6*_t4 + _c8*_t8) + _t16*(-_c6*_t8 + _c8*_t4)))) + _c9*b**2*exp2(_t0, _t2, -_b*b, _t3, -b*db) + _t13*_t17*b*(_t14*sin1(theta, _b, db) + _t16*cos1(theta, _b, db))*exp1(_t0, _t2, _t3))/_c0
        out[1, i] = _c2*r0*exp(_t1)


@compiled(ORBIT_EACH, later=True)
def orbit_each(n, lows, highs, p, out):
    """What is the same all along an orbit: ``bend_each`` finds it behind the run-time parameters."""
    lows, highs, p, out = carray(lows, n), carray(highs, n), carray(p, (4, n)), carray(out, (17, n))
    for i in range(n):
        r0 = p[0, i]
        b = p[1, i]
        a = lows[i]
        _b = highs[i]
        _t0 = _b - a
        _t1 = _b/2
        _t2 = a/2
        _t3 = _t1 - _t2
        _t4 = _t1 + _t2
        _t5 = sin(_b)
        _t6 = cos(_b)
        _t7 = sqrt(_t5**2 + _t6**2)
        _t8 = sin(a)
        _t9 = cos(a)
        _t10 = sqrt(_t8**2 + _t9**2)
        out[0, i] = fabs(r0)
        out[1, i] = exp(-a*b)
        out[2, i] = sqrt(b**2 + 1)
        out[3, i] = cos1(a, _b, _t0)
        out[4, i] = near_sinc(_t3)
        out[5, i] = sin1(a, _b, _t0)
        out[6, i] = sin(_t4)
        out[7, i] = cos(_t3)
        out[8, i] = cos(_t4)
        out[9, i] = 1/_t7
        out[10, i] = _t7
        out[11, i] = 1/_t10
        out[12, i] = _t10
        out[13, i] = _t5
        out[14, i] = _t8
        out[15, i] = _t6
        out[16, i] = _t9


@compiled(BOUNDS)
def bounds(lo, hi, p, out):
    """Bounds of the climb's slope and of ds/dtheta for lo <= theta <= hi."""
    p, out = carray(p, 4), carray(out, 4)
    theta = (lo, hi)
    r0 = (p[0], p[0])
    b = (p[1], p[1])
    k = (p[2], p[2])
    _t0 = imul(b, theta)
    _t1 = isin(theta)
    _t2 = icos(theta)
    out[0], out[1] = imul(imul(imul(imul(imul(imul(iconst(2.0), k), ipow(r0, -2)), ipow(isqrt(iadd(ipow(_t1, 2), ipow(_t2, 2))), -3)), iadd(imul(_t1, iadd(imul(_t1, b), _t2)), imul(_t2, iadd(imul(iconst(-1.0), _t1), imul(_t2, b))))), iexp(imul(iconst(-1.0), _t0))), iabs(r0))
    out[2], out[3] = imul(imul(r0, isqrt(iadd(ipow(b, 2), iconst(1.0)))), iexp(_t0))


@compiled(BOUNDS_EACH, later=True)
def bounds_each(n, lo, hi, p, out):
    """Bounds over many intervals of the climb's slope and of ds/dtheta for lo <= theta <= hi, each for parameters of its own."""
    lo, hi, p, out = carray(lo, n), carray(hi, n), carray(p, (4, n)), carray(out, (4, n))
    for i in range(n):
        theta = (lo[i], hi[i])
        r0 = (p[0, i], p[0, i])
        b = (p[1, i], p[1, i])
        k = (p[2, i], p[2, i])
        _t0 = imul(b, theta)
        _t1 = isin(theta)
        _t2 = icos(theta)
        out[0, i], out[1, i] = imul(imul(imul(imul(imul(imul(iconst(2.0), k), ipow(r0, -2)), ipow(isqrt(iadd(ipow(_t1, 2), ipow(_t2, 2))), -3)), iadd(imul(_t1, iadd(imul(_t1, b), _t2)), imul(_t2, iadd(imul(iconst(-1.0), _t1), imul(_t2, b))))), iexp(imul(iconst(-1.0), _t0))), iabs(r0))
        out[2, i], out[3, i] = imul(imul(r0, isqrt(iadd(ipow(b, 2), iconst(1.0)))), iexp(_t0))


# The same formulas over a namespace of operations: extended precision evaluates these.


def exact_x(op, theta, p):
    """Horizontal coordinate."""
    r0 = p[0]
    b = p[1]
    return r0*op.exp(b*theta)*op.cos(theta)


def exact_z(op, theta, p):
    """Height."""
    r0 = p[0]
    b = p[1]
    return r0*op.exp(b*theta)*op.sin(theta)


def exact_ds(op, theta, p):
    """ds/dtheta."""
    r0 = p[0]
    b = p[1]
    return r0*op.sqrt(b**2 + 1)*op.exp(b*theta)


def exact_kappa(op, theta, p):
    """Signed curvature."""
    r0 = p[0]
    b = p[1]
    return op.exp(-b*theta)/(r0*op.sqrt(b**2 + 1))


def exact_reaction(op, theta, p):
    """Contact force per unit mass of a body at rest."""
    r0 = p[0]
    b = p[1]
    k = p[2]
    _t0 = op.sin(theta)
    _t1 = op.cos(theta)
    return k*(_t0*(-_t0 + _t1*b) - _t1*(_t0*b + _t1))*op.exp(-2*b*theta)*abs(r0)/(r0**3*(_t0**2 + _t1**2)**(op.mpf(3)/2)*op.sqrt(b**2 + 1))


def exact_climb(op, theta, p):
    """What V**2 loses in climbing, up to a constant."""
    r0 = p[0]
    b = p[1]
    k = p[2]
    return -2*k*op.exp(-b*theta)/(op.sqrt(op.sin(theta)**2 + op.cos(theta)**2)*abs(r0))


def exact_climb_slope(op, theta, p):
    """Its derivative by theta."""
    r0 = p[0]
    b = p[1]
    k = p[2]
    _t0 = op.sin(theta)
    _t1 = op.cos(theta)
    return 2*k*(_t0*(_t0*b + _t1) + _t1*(-_t0 + _t1*b))*op.exp(-b*theta)*abs(r0)/(r0**2*(_t0**2 + _t1**2)**(op.mpf(3)/2))


def exact_domain(op, p):
    """Both ends of the domain, and the period; None where there is none."""
    return None, None, None


MODEL = CompiledModel(
    name='spiral_central',
    parameter='theta',
    parameters=PARAMETERS,
    positive=('r0',),
    addresses=Addresses(frame.address, climb.address, rise.address, bend.address, bounds.address),
    loads=loads,
    each=Each(rise=rise_each, bend=bend_each, orbit=orbit_each, bounds=bounds_each, held=17),
    domain_of=exact_domain,
    exact=ExactFormulas(exact_x, exact_z, exact_ds, exact_kappa, exact_reaction, exact_climb, exact_climb_slope),
)


def pass1(lam: Any, lam0: Any, v0: Any = 0.0, direction: int = 1, *, out: Any = None, r0: Any = '1', b: Any = '0.15', k: Any = '2', m: Any = '1') -> Pass1:
    """Position, metric, curvature, V**2 and contact force at places of the curve (Pass 1, no quadrature).

    Parameters
    ----------
    lam : array_like
        Places on the curve, as values of its parameter theta.
    lam0, v0, direction
        Launch place, speed and direction (+1 or -1: the sign of ds/dt).
    out : Pass1, optional
        The result of a call before, or six arrays like it, to be filled again.
    r0, b, k, m
        Run-time parameters; `PARAMETERS` holds their defaults.

    Returns
    -------
    Pass1
        Arrays x, z, ds, kappa, v2 and normal_force.
    """
    return MODEL.pass1(LaunchRequest(lam0, v0, direction), (r0, b, k, m,), lam, out)


def solve(
    lam0: Any = None,
    v0: Any = 0.0,
    direction: int = 1,
    *,
    point: Any = None,
    t_max: Any = None,
    contact: str = "bilateral",
    r0: Any = '1', b: Any = '0.15', k: Any = '2', m: Any = '1',
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
    r0, b, k, m
        Run-time parameters; `PARAMETERS` holds their defaults.

    Returns
    -------
    Motion

    Raises
    ------
    GQMError
        For a launch or a parameter that cannot be; the message says what would be right.
    """
    return MODEL.solve(LaunchRequest(lam0, v0, direction, point, t_max, contact), (r0, b, k, m,))


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
    r0: Any = '1', b: Any = '0.15', k: Any = '2', m: Any = '1',
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
    r0, b, k, m
        Run-time parameters; `PARAMETERS` holds their defaults.

    Returns
    -------
    Sweep
        ``values``, NaN where there is none; ``status``, 0 where there is one, and ``route``, how each was found.
        ``status_counts()`` counts the launches without a value.
    """
    launches = LaunchRequest(lam0, v0, direction, None, t_max, contact)
    return MODEL.sweep(quantity, launches, (r0, b, k, m,), lam=lam, client=client, source=__file__)
