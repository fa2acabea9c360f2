"""Interval arithmetic for proofs about signs: each result holds every value over the arguments.

An interval is a tuple ``(lo, hi)`` of floats, infinities allowed, never NaN. Ends are rounded
outwards by a few units in the last place. A function met outside its domain, even on a part of the
interval, gives ``(-inf, inf)``: nothing may be proved across a gap in the domain. Zeros that are
exact stay exact, so that signs are not lost to rounding.
"""

from math import (
    acos,
    acosh,
    asin,
    asinh,
    atan,
    atanh,
    ceil,
    copysign,
    cos,
    cosh,
    exp,
    fabs,
    floor,
    inf,
    log,
    pi,
    sin,
    sinh,
    sqrt,
    tan,
    tanh,
)
from math import pow as power

from gqm_sym.runtime.jit import Inner

# One rounding is at most 2**-53 of the result; the C library's functions stay within four ulps.
ROUNDED = 2.0**-52
LIBRARY = 2.0**-50
# Four subnormal steps: what relative widening cannot give to the smallest numbers.
LEAST = 2e-323
MOST = 1.7976931348623157e308
# Beyond this the phase of a sine is not worth its reduction.
FAR_PHASE = 1e8


@Inner
def lower(v, share):  # type: ignore[no-untyped-def]
    """A lower bound of what was rounded to v: a zero is exact, infinity an overflow."""
    if v == 0.0:
        return 0.0
    bound = v - fabs(v) * share - LEAST
    if bound == bound:
        return bound
    return MOST if v > 0.0 else -inf


@Inner
def upper(v, share):  # type: ignore[no-untyped-def]
    """An upper bound of what was rounded to v, mirrored."""
    if v == 0.0:
        return 0.0
    bound = v + fabs(v) * share + LEAST
    if bound == bound:
        return bound
    return -MOST if v < 0.0 else inf


@Inner
def kept(v, sign):  # type: ignore[no-untyped-def]
    """The float v, or a tiny one of the given sign if it underflowed to zero."""
    return v if v != 0.0 else copysign(LEAST, sign)


@Inner
def ordinary(a):  # type: ignore[no-untyped-def]
    """Whether both ends are numbers."""
    return a[0] == a[0] and a[1] == a[1]


@Inner
def product(u, v):  # type: ignore[no-untyped-def]
    """The product of two ends; an infinite end is never reached, so zero times it is zero."""
    return kept(u * v, copysign(1.0, u) * v) if u != 0.0 and v != 0.0 else 0.0


@Inner
def iconst(c):  # type: ignore[no-untyped-def]
    """A number that is exactly c."""
    return (float(c), float(c)) if c == c else (-inf, inf)


@Inner
def ipoint(v):  # type: ignore[no-untyped-def]
    """A number whose nearest float is v."""
    return lower(float(v), ROUNDED), upper(float(v), ROUNDED)


@Inner
def ipi():  # type: ignore[no-untyped-def]
    """The number pi, which lies just above its nearest float."""
    return pi, 3.1415926535897936


@Inner
def ineg(a):  # type: ignore[no-untyped-def]
    """The negative of a."""
    return -a[1], -a[0]


@Inner
def iadd(a, b):  # type: ignore[no-untyped-def]
    """The sum a + b."""
    return lower(a[0] + b[0], ROUNDED), upper(a[1] + b[1], ROUNDED)


@Inner
def isub(a, b):  # type: ignore[no-untyped-def]
    """The difference a - b."""
    return lower(a[0] - b[1], ROUNDED), upper(a[1] - b[0], ROUNDED)


@Inner
def imul(a, b):  # type: ignore[no-untyped-def]
    """The product a*b."""
    p, q = product(a[0], b[0]), product(a[0], b[1])
    r, s = product(a[1], b[0]), product(a[1], b[1])
    if not (ordinary(a) and ordinary(b)):
        return -inf, inf
    return lower(min(min(p, q), min(r, s)), ROUNDED), upper(max(max(p, q), max(r, s)), ROUNDED)


@Inner
def iinv(a):  # type: ignore[no-untyped-def]
    """The inverse 1/a: everything if zero lies inside, half of it if zero is an end."""
    lo, hi = a
    if lo < 0.0 < hi or not ordinary(a):
        return -inf, inf
    below = lower(kept(1.0 / hi, hi), ROUNDED) if hi != 0.0 else -inf
    above = upper(kept(1.0 / lo, lo), ROUNDED) if lo != 0.0 else inf
    return below, above


@Inner
def idiv(a, b):  # type: ignore[no-untyped-def]
    """The quotient a/b."""
    return imul(a, iinv(b))


@Inner
def iabs(a):  # type: ignore[no-untyped-def]
    """The absolute value of a."""
    if a[0] >= 0.0:
        return a
    return ineg(a) if a[1] <= 0.0 else (0.0, max(-a[0], a[1]))


@Inner
def grown(lo, hi):  # type: ignore[no-untyped-def]
    """From the values of the C library at the ends."""
    return lower(lo, LIBRARY), upper(hi, LIBRARY)


@Inner
def natural_power(x, n):  # type: ignore[no-untyped-def]
    """The power x**n for n > 0, never an inexact zero."""
    return kept(power(x, float(n)), x if n % 2 else 1.0) if x != 0.0 else 0.0


@Inner
def natural_ipow(a, n):  # type: ignore[no-untyped-def]
    """The power a**n for n > 0."""
    b = a if n % 2 else iabs(a)
    return grown(natural_power(b[0], n), natural_power(b[1], n))


@Inner
def ipow(a, n):  # type: ignore[no-untyped-def]
    """The power a**n, n an integer."""
    if n == 0:
        return 1.0, 1.0
    return natural_ipow(a, n) if n > 0 else iinv(natural_ipow(a, -n))


@Inner
def real_power(x, p):  # type: ignore[no-untyped-def]
    """The power x**p for x >= 0, never an inexact zero, and the share by which it may be off."""
    if x == 0.0 or x == inf:
        return power(x, p), LIBRARY
    return kept(power(x, p), 1.0), LIBRARY + ROUNDED * fabs(p * log(x))


@Inner
def irpow(a, p):  # type: ignore[no-untyped-def]
    """The power a**p, a >= 0; p may be a rounded number."""
    if not a[0] >= 0.0:
        return -inf, inf
    below, slack = real_power(a[0] if p >= 0.0 else a[1], p)
    above, share = real_power(a[1] if p >= 0.0 else a[0], p)
    return lower(below, slack), upper(above, share)


@Inner
def isqrt(a):  # type: ignore[no-untyped-def]
    """The values of sqrt."""
    if not a[0] >= 0.0:
        return -inf, inf
    return lower(sqrt(a[0]), ROUNDED), upper(sqrt(a[1]), ROUNDED)


@Inner
def iexp(a):  # type: ignore[no-untyped-def]
    """The values of exp."""
    return grown(kept(exp(a[0]), 1.0), kept(exp(a[1]), 1.0))


@Inner
def ilog(a):  # type: ignore[no-untyped-def]
    """The values of log."""
    return grown(log(a[0]), log(a[1])) if a[0] >= 0.0 and a[1] > 0.0 else (-inf, inf)


@Inner
def meets(a, point, period):  # type: ignore[no-untyped-def]
    """Whether point + k*period may lie in the interval for a whole k; yes when in doubt."""
    slack = 1e-15 * (2.0 + fabs(a[0]) + fabs(a[1]))
    return floor((a[1] - point) / period + slack) >= ceil((a[0] - point) / period - slack)


@Inner
def unphased(a):  # type: ignore[no-untyped-def]
    """Whether the interval is too wide or too far out to know the phase (or not a number)."""
    return not (a[0] >= -FAR_PHASE and a[1] <= FAR_PHASE and a[1] - a[0] < 2.0 * pi)


@Inner
def wave(a, left, right, trough, crest):  # type: ignore[no-untyped-def]
    """A wave with the values left and right at the ends, and a trough and a crest once a turn."""
    lo, hi = grown(min(left, right), max(left, right))
    below = -1.0 if meets(a, trough, 2.0 * pi) else max(lo, -1.0)
    return below, 1.0 if meets(a, crest, 2.0 * pi) else min(hi, 1.0)


@Inner
def isin(a):  # type: ignore[no-untyped-def]
    """The values of sin."""
    return (-1.0, 1.0) if unphased(a) else wave(a, sin(a[0]), sin(a[1]), -0.5 * pi, 0.5 * pi)


@Inner
def icos(a):  # type: ignore[no-untyped-def]
    """The values of cos."""
    return (-1.0, 1.0) if unphased(a) else wave(a, cos(a[0]), cos(a[1]), pi, 0.0)


@Inner
def itan(a):  # type: ignore[no-untyped-def]
    """The values of tan."""
    return (-inf, inf) if unphased(a) or meets(a, 0.5 * pi, pi) else grown(tan(a[0]), tan(a[1]))


@Inner
def iatan(a):  # type: ignore[no-untyped-def]
    """The values of atan."""
    return grown(atan(a[0]), atan(a[1]))


@Inner
def iasin(a):  # type: ignore[no-untyped-def]
    """The values of asin."""
    return grown(asin(a[0]), asin(a[1])) if a[0] >= -1.0 and a[1] <= 1.0 else (-inf, inf)


@Inner
def iacos(a):  # type: ignore[no-untyped-def]
    """The values of acos."""
    return grown(acos(a[1]), acos(a[0])) if a[0] >= -1.0 and a[1] <= 1.0 else (-inf, inf)


@Inner
def isinh(a):  # type: ignore[no-untyped-def]
    """The values of sinh."""
    return grown(sinh(a[0]), sinh(a[1]))


@Inner
def icosh(a):  # type: ignore[no-untyped-def]
    """The values of cosh."""
    b = iabs(a)
    lo, hi = grown(cosh(b[0]), cosh(b[1]))
    return max(lo, 1.0), hi


@Inner
def itanh(a):  # type: ignore[no-untyped-def]
    """The values of tanh."""
    lo, hi = grown(tanh(a[0]), tanh(a[1]))
    return max(lo, -1.0), min(hi, 1.0)


@Inner
def iasinh(a):  # type: ignore[no-untyped-def]
    """The values of asinh."""
    return grown(asinh(a[0]), asinh(a[1]))


@Inner
def iacosh(a):  # type: ignore[no-untyped-def]
    """The values of acosh."""
    return grown(acosh(a[0]), acosh(a[1])) if a[0] >= 1.0 else (-inf, inf)


@Inner
def iatanh(a):  # type: ignore[no-untyped-def]
    """The values of atanh."""
    return grown(atanh(a[0]), atanh(a[1])) if a[0] >= -1.0 and a[1] <= 1.0 else (-inf, inf)
