"""Second divided differences of sin, cos, sinh, cosh, exp, tan and tanh.

As in `second_differences`, near points have a closed form, here by `wave_parts`, and farther ones take first
differences. For sin, cos, sinh and cosh both are worked out and one is chosen, so that a loop over them vectorises;
``near_sin2`` and its like are the closed forms alone, and NaN for points too far apart.
"""

from math import fabs, factorial, nan

from gqm_sym.runtime.arithmetic.divided_differences.first import cos1, cosh1, expc, sin1, sinh1, tan1, tanh1
from gqm_sym.runtime.arithmetic.divided_differences.points import around, ordered, series_pair
from gqm_sym.runtime.arithmetic.elementary import cos, cosh, exp, sin, sinh
from gqm_sym.runtime.compiled.intrinsics import choose, polynomial
from gqm_sym.runtime.compiled.jit import Inlined, Inner

# |h1| + |h2| up to which wave_parts may be used: its series are cut below 1e-19 there.
NEAR = 1.0

# The same for sin and cos, whose parts do not cancel up to a whole turn of the points: a pendulum's widest swing.
WIDE = 3.2


def _even(shift: int, terms: int) -> tuple[float, ...]:
    """Coefficients of the even series of a sinc (shift 1) or cosine (shift 0) in t**2, highest power first."""
    return tuple((-1.0) ** k / factorial(2 * k + shift) for k in reversed(range(terms)))


# sinc, and sinc and cosine of half the argument: cut for NEAR, and for WIDE.
NEAR_SERIES = (_even(1, 10), _even(1, 8), _even(0, 9))
WIDE_SERIES = (_even(1, 16), _even(1, 12), _even(0, 12))

# sinc in the square of its argument, highest power first: the polynomial through its values at Chebyshev's nodes for
# arguments up to WIDE, rounded; off by less than 3e-17.
SINC = (
    -3.4909674184529875e-23,
    1.947320408026163e-20,
    -8.219107685896044e-18,
    2.8114423680956386e-15,
    -7.647162772058795e-13,
    1.60590437955048e-10,
    -2.5052108384270217e-08,
    2.7557319223964827e-06,
    -0.0001984126984126962,
    0.008333333333333331,
    -0.16666666666666666,
    1.0,
)


@Inlined
def wave_parts(h1, h2, sign, sums):  # type: ignore[no-untyped-def]
    """A = S(H/2) (S(h1)+S(h2))/2, B = C(H/2) (h2-h1) S~[h1**2,h2**2], H = h1+h2, S~(t**2) = S(t).

    S and C are sinc and cosine (sign 1) or their hyperbolic twins (sign -1).

    ``sums`` are their series. MATHS, section 3.
    """
    quarter = sign * 0.25 * (h1 + h2) * (h1 + h2)
    both, slope = series_pair(sums[0], sign * h1 * h1, sign * h2 * h2)
    even = 0.5 * polynomial(sums[1], quarter) * both
    return even, polynomial(sums[2], quarter) * (h2 - h1) * sign * slope


@Inlined
def near_sin2(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """sin[x,y,w] = (B cos M - A sin M)/2, M = (x+2y+w)/4, A and B from half the gaps; NaN beyond `WIDE`."""
    u, v = 0.5 * h1, 0.5 * h2
    even, odd = wave_parts(u, v, 1.0, WIDE_SERIES)
    m = 0.25 * (x + w + 2.0 * y)
    return choose(fabs(u) + fabs(v) <= WIDE, 0.5 * (odd * cos(m) - even * sin(m)), nan)


@Inlined
def near_sinc(h):  # type: ignore[no-untyped-def]
    """sin(h)/h, for ``|h|`` <= `WIDE`."""
    return polynomial(SINC, h * h)


@Inlined
def near_even(h1, h2):  # type: ignore[no-untyped-def]
    """(cos v - cos h)/(v**2 - h**2), a second difference of cos over -h, v, h with h1 = v + h, h2 = h - v.

    NaN beyond `WIDE`.
    """
    u, v = 0.5 * h1, 0.5 * h2
    return choose(fabs(u) + fabs(v) <= WIDE, -0.5 * near_sinc(u) * near_sinc(v), nan)


@Inlined
def near_odd(h1, h2):  # type: ignore[no-untyped-def]
    """(sin(v)/v - sin(h)/h)/(v**2 - h**2), as for the cosine: v times it is a second difference of sin."""
    h, v = 0.5 * (h1 + h2), 0.5 * (h1 - h2)
    return series_pair(SINC, h * h, v * v)[1]


@Inlined
def near_cos2(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """cos[x,y,w] = -(B sin M + A cos M)/2, as for the sine."""
    u, v = 0.5 * h1, 0.5 * h2
    even, odd = wave_parts(u, v, 1.0, WIDE_SERIES)
    m = 0.25 * (x + w + 2.0 * y)
    return choose(fabs(u) + fabs(v) <= WIDE, -0.5 * (odd * sin(m) + even * cos(m)), nan)


@Inlined
def sin2(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """sin[x,y,w], of points at any distance."""
    near = near_sin2(x, y, w, h1, h2)
    p, q, first, r, s, second, d = around(x, y, w, h1, h2)
    return choose(near == near, near, (sin1(r, s, second) - sin1(p, q, first)) / d)


@Inlined
def cos2(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """cos[x,y,w], of points at any distance."""
    near = near_cos2(x, y, w, h1, h2)
    p, q, first, r, s, second, d = around(x, y, w, h1, h2)
    return choose(near == near, near, (cos1(r, s, second) - cos1(p, q, first)) / d)


@Inlined
def near_sinh2(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """sinh[x,y,w] = (B cosh M + A sinh M)/2, as for the sine; NaN beyond `NEAR`."""
    u, v = 0.5 * h1, 0.5 * h2
    even, odd = wave_parts(u, v, -1.0, NEAR_SERIES)
    m = 0.25 * (x + w + 2.0 * y)
    return choose(fabs(u) + fabs(v) <= NEAR, 0.5 * (odd * cosh(m) + even * sinh(m)), nan)


@Inlined
def near_cosh2(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """cosh[x,y,w] = (B sinh M + A cosh M)/2, as for the sine; NaN beyond `NEAR`."""
    u, v = 0.5 * h1, 0.5 * h2
    even, odd = wave_parts(u, v, -1.0, NEAR_SERIES)
    m = 0.25 * (x + w + 2.0 * y)
    return choose(fabs(u) + fabs(v) <= NEAR, 0.5 * (odd * sinh(m) + even * cosh(m)), nan)


@Inlined
def sinh2(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """sinh[x,y,w], of points at any distance."""
    near = near_sinh2(x, y, w, h1, h2)
    p, q, first, r, s, second, d = around(x, y, w, h1, h2)
    return choose(near == near, near, (sinh1(r, s, second) - sinh1(p, q, first)) / d)


@Inlined
def cosh2(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """cosh[x,y,w], of points at any distance."""
    near = near_cosh2(x, y, w, h1, h2)
    p, q, first, r, s, second, d = around(x, y, w, h1, h2)
    return choose(near == near, near, (cosh1(r, s, second) - cosh1(p, q, first)) / d)


@Inner
def exp2(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """exp[x,y,w] = exp(M) (A + B)/2; far points share the factor exp(w)."""
    u, v = 0.5 * h1, 0.5 * h2
    if fabs(u) + fabs(v) <= NEAR:
        even, odd = wave_parts(u, v, -1.0, NEAR_SERIES)
        return 0.5 * exp(0.25 * (x + w + 2.0 * y)) * (even + odd)
    _a, _b, c, u, v = ordered(x, y, w, h1, h2)
    upper = expc(v)
    return exp(c) * (upper - (1.0 - v * upper) * expc(u)) / (u + v)


@Inner
def tan2(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """tan[x,y,w] = (B cos m + A sin m)/(cos x cos y cos w), m = (x+w)/2, from whole gaps."""
    if fabs(h1) + fabs(h2) <= NEAR:
        even, odd = wave_parts(h1, h2, 1.0, NEAR_SERIES)
        m = 0.5 * (x + w)
        return (odd * cos(m) + even * sin(m)) / (cos(x) * cos(y) * cos(w))
    a, b, c, u, v = ordered(x, y, w, h1, h2)
    return (tan1(b, c, v) - tan1(a, b, u)) / (u + v)


@Inner
def tanh2(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """tanh[x,y,w] = (B cosh m - A sinh m)/(cosh x cosh y cosh w), as for the tangent."""
    if fabs(h1) + fabs(h2) <= NEAR:
        even, odd = wave_parts(h1, h2, -1.0, NEAR_SERIES)
        m = 0.5 * (x + w)
        return (odd * cosh(m) - even * sinh(m)) / cosh(x) / (cosh(y) * cosh(w))
    a, b, c, u, v = ordered(x, y, w, h1, h2)
    return (tanh1(b, c, v) - tanh1(a, b, u)) / (u + v)
