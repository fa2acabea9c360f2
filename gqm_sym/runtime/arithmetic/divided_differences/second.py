"""Second divided differences of the elementary functions, without subtracting nearly equal numbers.

``f2(x, y, w, h1, h2)`` is ``f[x,y,w]``, the points in any order, coincident or not. The gaps
``h1 = y - x`` and ``h2 = w - y`` are trusted to their last digit and never formed again from the
points (MATHS, section 3).

Points near each other have a closed form, good in any order: the sum of two products of
well-conditioned numbers, one of which holds a divided difference of an even series.

- sin, cos, sinh, cosh, exp, tan, tanh take it from `wave_differences.wave_parts`;
- log, atan, asin, acos, asinh, acosh, atanh from `area_bend`: their differences are the atanh or
  the atan of a quotient.

Farther points are sorted, and ``(f[b,c] - f[a,b])/(c - a)`` does no harm. Roots, whole powers and
the absolute value have closed forms everywhere; real powers of near points take quadrature.
"""

from math import fabs
from math import pow as power

import numpy as np

from gqm_sym.runtime.arithmetic.divided_differences.first import (
    acosh1,
    asin1,
    asinh1,
    atan1,
    atanh1,
    ipow1_sum,
    log1,
    one_less_product,
    root_above,
    root_below,
    root_beyond,
    rpow1,
)
from gqm_sym.runtime.arithmetic.divided_differences.points import ordered, series_pair
from gqm_sym.runtime.compiled.jit import Inner

# Square of r up to which area_bend may be used: its series is cut below 4e-18 there.
NEAR_AREA = 1.0 / 9.0

# Coefficients of atanh(t)/t in t**2, highest power first.
AREA = tuple(1.0 / (2 * k + 1) for k in reversed(range(17)))

# Gauss-Legendre on [0, 1], weights times the place: to the last digit for powers on [x, 2x].
_LEGENDRE = np.polynomial.legendre.leggauss(12)
NODES = tuple(float(0.5 + 0.5 * t) for t in _LEGENDRE[0])
WEIGHTS = tuple(float(0.5 * c * (0.5 + 0.5 * t)) for t, c in zip(*_LEGENDRE, strict=True))


@Inner
def near_area(h1, h2, p, q):  # type: ignore[no-untyped-def]
    """Whether area_bend may be used: r1 = h1/P and r2 = h2/Q are small."""
    return h1 * h1 <= NEAR_AREA * p * p and h2 * h2 <= NEAR_AREA * q * q


@Inner
def area_bend(h1, h2, p, q, k, sign):  # type: ignore[no-untyped-def]
    """(A(r2)/h2 - A(r1)/h1)/(h1+h2) for r1 = h1/P, r2 = h2/Q, A = atanh (sign 1) or atan (sign -1).

    K = (P-Q)/(h1+h2) is given, as P and Q are close. With T(r**2) = A(r)/r the numerator is
    T(r2**2)/Q - T(r1**2)/P, that is ((T2+T1)(P-Q) + (T2-T1)(P+Q))/(2PQ). There T2 - T1 has the
    factor r2**2 - r1**2 = (h1+h2) E F/(PQ)**2, where E = (h2 P + h1 Q)/(h1+h2) and
    F = h2 P - h1 Q are written by P+Q and K.
    """
    up, uq = 1.0 / p, 1.0 / q
    r1, r2 = h1 * up, h2 * uq
    total, gaps, skew = p + q, h1 + h2, h2 - h1
    both, slope = series_pair(AREA, sign * r1 * r1, sign * r2 * r2)
    e = 0.5 * (total + skew * k) * up
    f = 0.5 * (skew * total + gaps * gaps * k) * up * uq
    return 0.5 * (sign * slope * e * f * (total * uq) + both * k) * up * uq


@Inner
def log2(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """log[x,y,w], from log[x,y] = 2 atanh(h/(x+y))/h."""
    p, q = x + y, y + w
    if near_area(h1, h2, p, q):
        return 2.0 * area_bend(h1, h2, p, q, -1.0, 1.0)
    a, b, c, u, v = ordered(x, y, w, h1, h2)
    return (log1(b, c, v) - log1(a, b, u)) / (u + v)


@Inner
def atan2(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """atan[x,y,w], from atan[x,y] = atan(h/(1+xy))/h."""
    p, q = 1.0 + x * y, 1.0 + y * w
    if p > 0.0 and q > 0.0 and near_area(h1, h2, p, q):
        return area_bend(h1, h2, p, q, -y, -1.0)
    a, b, c, u, v = ordered(x, y, w, h1, h2)
    return (atan1(b, c, v) - atan1(a, b, u)) / (u + v)


@Inner
def asin2(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """asin[x,y,w], from asin[x,y] = 2 atan(h/(cx+cy))/h, c = sqrt(1 - x**2)."""
    cx, cy, cw = root_below(x), root_below(y), root_below(w)
    p, q = cx + cy, cy + cw
    if near_area(h1, h2, p, q):
        return 2.0 * area_bend(h1, h2, p, q, (x + w) / (cx + cw), -1.0)
    a, b, c, u, v = ordered(x, y, w, h1, h2)
    return (asin1(b, c, v) - asin1(a, b, u)) / (u + v)


@Inner
def acos2(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """acos[x,y,w] = -asin[x,y,w]."""
    return -asin2(x, y, w, h1, h2)


@Inner
def asinh2(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """asinh[x,y,w], from asinh[x,y] = 2 atanh(h/(cx+cy))/h, c = sqrt(1 + x**2)."""
    cx, cy, cw = root_above(x), root_above(y), root_above(w)
    p, q = cx + cy, cy + cw
    if near_area(h1, h2, p, q):
        return 2.0 * area_bend(h1, h2, p, q, -(x + w) / (cx + cw), 1.0)
    a, b, c, u, v = ordered(x, y, w, h1, h2)
    return (asinh1(b, c, v) - asinh1(a, b, u)) / (u + v)


@Inner
def acosh2(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """acosh[x,y,w], from acosh[x,y] = 2 atanh(h/(sx+sy))/h, s = sqrt(x**2 - 1)."""
    sx, sy, sw = root_beyond(x), root_beyond(y), root_beyond(w)
    p, q = sx + sy, sy + sw
    if near_area(h1, h2, p, q):
        return 2.0 * area_bend(h1, h2, p, q, -(x + w) / (sx + sw), 1.0)
    a, b, c, u, v = ordered(x, y, w, h1, h2)
    return (acosh1(b, c, v) - acosh1(a, b, u)) / (u + v)


@Inner
def atanh2(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """atanh[x,y,w], from atanh[x,y] = atanh(h/(1-xy))/h."""
    p, q = one_less_product(x, y), one_less_product(y, w)
    if near_area(h1, h2, p, q):
        return area_bend(h1, h2, p, q, y, 1.0)
    a, b, c, u, v = ordered(x, y, w, h1, h2)
    return (atanh1(b, c, v) - atanh1(a, b, u)) / (u + v)


@Inner
def abs2(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """|u|[x,y,w]: 0 where the points have one sign, else by the point that stands alone."""
    a, b, c, u, v = ordered(x, y, w, h1, h2)
    if a >= 0.0 or c <= 0.0:
        return 0.0
    return -2.0 * a / (u * (u + v)) if b >= 0.0 else 2.0 * c / (v * (u + v))


@Inner
def ipow2(x, y, w, h1, h2, n):  # type: ignore[no-untyped-def]
    """(u**n)[x,y,w], n an integer: the sum of x**i y**j w**k, i+j+k = n-2; n < 0 by 1/u."""
    if n < 0:
        a, b, c = 1.0 / x, 1.0 / y, 1.0 / w
        return a * b * c * (ipow1_sum(b, c, -n) + a * ipow2_sum(a, b, c, -n))
    return ipow2_sum(x, y, w, n)


@Inner
def ipow2_sum(x, y, w, n):  # type: ignore[no-untyped-def]
    """The sum of x**i y**j w**k, i+j+k = n-2: (u**(k+1))[x,y,w] = w (u**k)[x,y,w] + (u**k)[x,y]."""
    second, first, value = 0.0, 0.0, 1.0
    for _ in range(n):
        second = second * w + first
        first = first * y + value
        value *= x
    return second


@Inner
def rpow2(x, y, w, h1, h2, p):  # type: ignore[no-untyped-def]
    """(u**p)[x,y,w], x, y, w >= 0: a mean of f'' whose weights grow from the ends to the middle."""
    a, b, c, u, v = ordered(x, y, w, h1, h2)
    spread = u + v
    if spread * (1.0 + 0.125 * fabs(p)) > a:
        return rpow2_far(a, b, c, u, v, p)
    share = u / spread if spread > 0.0 else 0.5
    mean = 0.0
    for i in range(len(NODES)):
        left, right = a + NODES[i] * u, c - NODES[i] * v
        rise, fall = power(left, p) / (left * left), power(right, p) / (right * right)
        mean += WEIGHTS[i] * (share * rise + (1.0 - share) * fall)
    return p * (p - 1.0) * mean


@Inner
def rpow2_far(a, b, c, u, v, p):  # type: ignore[no-untyped-def]
    """(u**p)[a,b,c] of sorted points far apart; where p may be near 1, as u times u**(p-1)."""
    if p < 0.5:
        return (rpow1(b, c, v, p) - rpow1(a, b, u, p)) / (u + v)
    return (c * rpow1(b, c, v, p - 1.0) - a * rpow1(a, b, u, p - 1.0)) / (u + v)
