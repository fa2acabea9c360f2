"""Second divided differences of the elementary functions, without subtracting nearly equal numbers.

``divdiff2_f(x, y, w, h1, h2)`` is ``f[x,y,w]``. The points may have any order and may coincide. The gaps ``h1 = y - x``
and ``h2 = w - y`` are trusted to their last digit and never formed again from the points (MATHS, section 3).

For points near each other there is a closed form that holds in any order: the sum of two products of well-conditioned
numbers, one of which is a divided difference of an even series.

- sin, cos, sinh, cosh, exp, tan, tanh take it from `trigonometric.symmetric_parts`;
- log, atan, asin, acos, asinh, acosh, atanh from `divdiff2_of_quotients`: their differences are the atanh or
  the atan of a quotient.

Points farther apart are sorted; there ``(f[b,c] - f[a,b])/(c - a)`` loses no digits. Roots, integer powers and the
absolute value have closed forms everywhere; real powers of points near each other are found by quadrature.
"""

from math import fabs
from math import pow as power

import numpy as np

from gqm_sym.runtime.arithmetic.divided_differences.first import (
    divdiff1_acosh,
    divdiff1_asin,
    divdiff1_asinh,
    divdiff1_atan,
    divdiff1_atanh,
    divdiff1_ipow_sum,
    divdiff1_log,
    divdiff1_rpow,
    one_less_product,
    root_above,
    root_below,
    root_beyond,
)
from gqm_sym.runtime.arithmetic.divided_differences.points import around, ordered, series_pair
from gqm_sym.runtime.compiled.intrinsics import choose
from gqm_sym.runtime.compiled.jit import Inlined, Inner

# Square of r up to which `divdiff2_of_quotients` may be used: the rest of its series is below 4e-18 there.
NEAR_SQUARE = 1.0 / 9.0

# Coefficients of atanh(t)/t in t**2, highest power first.
ATANH_SERIES = tuple(1.0 / (2 * k + 1) for k in reversed(range(17)))

# The Gauss-Legendre rule on [0, 1], whose weights are multiplied by the node. It is exact to the last digit for powers
# on [x, 2x].
_LEGENDRE = np.polynomial.legendre.leggauss(12)
NODES = tuple(float(0.5 + 0.5 * t) for t in _LEGENDRE[0])
WEIGHTS = tuple(float(0.5 * c * (0.5 + 0.5 * t)) for t, c in zip(*_LEGENDRE, strict=True))


@Inlined
def quotients_are_small(h1, h2, p, q):  # type: ignore[no-untyped-def]
    """Return whether `divdiff2_of_quotients` may be used: r1 = h1/P and r2 = h2/Q are small."""
    return (h1 * h1 <= NEAR_SQUARE * p * p) & (h2 * h2 <= NEAR_SQUARE * q * q)


@Inlined
def divdiff2_of_quotients(h1, h2, p, q, k, sign):  # type: ignore[no-untyped-def]
    """(A(r2)/h2 - A(r1)/h1)/(h1+h2) for r1 = h1/P, r2 = h2/Q, A = atanh (sign 1) or atan (sign -1).

    K = (P-Q)/(h1+h2) is given, as P and Q are close. With T(r**2) = A(r)/r the numerator is
    T(r2**2)/Q - T(r1**2)/P, that is ((T2+T1)(P-Q) + (T2-T1)(P+Q))/(2PQ). There T2 - T1 has the
    factor r2**2 - r1**2 = (h1+h2) E F/(PQ)**2, where E = (h2 P + h1 Q)/(h1+h2) and
    F = h2 P - h1 Q are written by P+Q and K.
    """
    up, uq = 1.0 / p, 1.0 / q
    r1, r2 = h1 * up, h2 * uq
    total, gaps, skew = p + q, h1 + h2, h2 - h1
    both, slope = series_pair(ATANH_SERIES, sign * r1 * r1, sign * r2 * r2)
    e = 0.5 * (total + skew * k) * up
    f = 0.5 * (skew * total + gaps * gaps * k) * up * uq
    return 0.5 * (sign * slope * e * f * (total * uq) + both * k) * up * uq


@Inlined
def divdiff2_log(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """log[x,y,w], from log[x,y] = 2 atanh(h/(x+y))/h. There are no branches, so that loops fill vector registers."""
    p, q = x + y, y + w
    near = 2.0 * divdiff2_of_quotients(h1, h2, p, q, -1.0, 1.0)
    a, b, first, c, d, second, whole = around(x, y, w, h1, h2)
    far = (divdiff1_log(c, d, second) - divdiff1_log(a, b, first)) / whole
    return choose(quotients_are_small(h1, h2, p, q), near, far)


@Inner
def divdiff2_atan(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """atan[x,y,w], from atan[x,y] = atan(h/(1+xy))/h."""
    p, q = 1.0 + x * y, 1.0 + y * w
    if p > 0.0 and q > 0.0 and quotients_are_small(h1, h2, p, q):
        return divdiff2_of_quotients(h1, h2, p, q, -y, -1.0)
    a, b, c, u, v = ordered(x, y, w, h1, h2)
    return (divdiff1_atan(b, c, v) - divdiff1_atan(a, b, u)) / (u + v)


@Inner
def divdiff2_asin(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """asin[x,y,w], from asin[x,y] = 2 atan(h/(cx+cy))/h, c = sqrt(1 - x**2)."""
    cx, cy, cw = root_below(x), root_below(y), root_below(w)
    p, q = cx + cy, cy + cw
    if quotients_are_small(h1, h2, p, q):
        return 2.0 * divdiff2_of_quotients(h1, h2, p, q, (x + w) / (cx + cw), -1.0)
    a, b, c, u, v = ordered(x, y, w, h1, h2)
    return (divdiff1_asin(b, c, v) - divdiff1_asin(a, b, u)) / (u + v)


@Inner
def divdiff2_acos(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """acos[x,y,w] = -asin[x,y,w]."""
    return -divdiff2_asin(x, y, w, h1, h2)


@Inner
def divdiff2_asinh(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """asinh[x,y,w], from asinh[x,y] = 2 atanh(h/(cx+cy))/h, c = sqrt(1 + x**2)."""
    cx, cy, cw = root_above(x), root_above(y), root_above(w)
    p, q = cx + cy, cy + cw
    if quotients_are_small(h1, h2, p, q):
        return 2.0 * divdiff2_of_quotients(h1, h2, p, q, -(x + w) / (cx + cw), 1.0)
    a, b, c, u, v = ordered(x, y, w, h1, h2)
    return (divdiff1_asinh(b, c, v) - divdiff1_asinh(a, b, u)) / (u + v)


@Inner
def divdiff2_acosh(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """acosh[x,y,w], from acosh[x,y] = 2 atanh(h/(sx+sy))/h, s = sqrt(x**2 - 1)."""
    sx, sy, sw = root_beyond(x), root_beyond(y), root_beyond(w)
    p, q = sx + sy, sy + sw
    if quotients_are_small(h1, h2, p, q):
        return 2.0 * divdiff2_of_quotients(h1, h2, p, q, -(x + w) / (sx + sw), 1.0)
    a, b, c, u, v = ordered(x, y, w, h1, h2)
    return (divdiff1_acosh(b, c, v) - divdiff1_acosh(a, b, u)) / (u + v)


@Inner
def divdiff2_atanh(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """atanh[x,y,w], from atanh[x,y] = atanh(h/(1-xy))/h."""
    p, q = one_less_product(x, y), one_less_product(y, w)
    if quotients_are_small(h1, h2, p, q):
        return divdiff2_of_quotients(h1, h2, p, q, y, 1.0)
    a, b, c, u, v = ordered(x, y, w, h1, h2)
    return (divdiff1_atanh(b, c, v) - divdiff1_atanh(a, b, u)) / (u + v)


@Inner
def divdiff2_abs(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """|u|[x,y,w]: 0 if all points have the same sign, otherwise computed from the point whose sign differs."""
    a, b, c, u, v = ordered(x, y, w, h1, h2)
    if a >= 0.0 or c <= 0.0:
        return 0.0
    return -2.0 * a / (u * (u + v)) if b >= 0.0 else 2.0 * c / (v * (u + v))


@Inner
def divdiff2_ipow(x, y, w, h1, h2, n):  # type: ignore[no-untyped-def]
    """(u**n)[x,y,w], n an integer: the sum of x**i y**j w**k, i+j+k = n-2; n < 0 by 1/u."""
    if n < 0:
        a, b, c = 1.0 / x, 1.0 / y, 1.0 / w
        return a * b * c * (divdiff1_ipow_sum(b, c, -n) + a * divdiff2_ipow_sum(a, b, c, -n))
    return divdiff2_ipow_sum(x, y, w, n)


@Inner
def divdiff2_ipow_sum(x, y, w, n):  # type: ignore[no-untyped-def]
    """Return the sum of x**i y**j w**k, i+j+k = n-2: (u**(k+1))[x,y,w] = w (u**k)[x,y,w] + (u**k)[x,y]."""
    second, first, value = 0.0, 0.0, 1.0
    for _ in range(n):
        second = second * w + first
        first = first * y + value
        value *= x
    return second


@Inner
def divdiff2_rpow(x, y, w, h1, h2, p):  # type: ignore[no-untyped-def]
    """(u**p)[x,y,w], x, y, w >= 0: a mean of f'' whose weights grow from the ends to the middle."""
    a, b, c, u, v = ordered(x, y, w, h1, h2)
    spread = u + v
    if spread * (1.0 + 0.125 * fabs(p)) > a:
        return divdiff2_rpow_far(a, b, c, u, v, p)
    share = u / spread if spread > 0.0 else 0.5
    mean = 0.0
    for i in range(len(NODES)):
        left, right = a + NODES[i] * u, c - NODES[i] * v
        rise, fall = power(left, p) / (left * left), power(right, p) / (right * right)
        mean += WEIGHTS[i] * (share * rise + (1.0 - share) * fall)
    return p * (p - 1.0) * mean


@Inner
def divdiff2_rpow_far(a, b, c, u, v, p):  # type: ignore[no-untyped-def]
    """(u**p)[a,b,c] of sorted points far apart; for p >= 0.5, which may be near 1, from u times u**(p-1)."""
    if p < 0.5:
        return (divdiff1_rpow(b, c, v, p) - divdiff1_rpow(a, b, u, p)) / (u + v)
    return (c * divdiff1_rpow(b, c, v, p - 1.0) - a * divdiff1_rpow(a, b, u, p - 1.0)) / (u + v)
