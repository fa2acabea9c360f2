"""Interval arithmetic for proofs about signs: each result holds every value over the arguments.

An interval is a tuple ``(lo, hi)`` of floats, infinities allowed, never NaN. Ends are rounded
outwards by a few units in the last place. A function met outside its domain, even on a part of the
interval, gives ``(-inf, inf)``: nothing may be proved across a gap in the domain. Zeros that are
exact stay exact, so that signs are not lost to rounding.
"""

from math import acos, acosh, asin, asinh, atan, atanh, fabs, inf, log, pi, sqrt, tan, tanh
from math import pow as power

from gqm_sym.runtime.arithmetic.elementary import cos, cosh, exp, sin, sinh
from gqm_sym.runtime.compiled.intrinsics import choose, whole_below
from gqm_sym.runtime.compiled.jit import Inlined, Inner

# One rounding is at most 2**-53 of the result; the C library's functions stay within four ulps.
ROUNDED = 2.0**-52
LIBRARY = 2.0**-50

# Four subnormal steps: what relative widening cannot give to the smallest numbers.
LEAST = 2e-323
MOST = 1.7976931348623157e308

# Beyond this the phase of a sine is not worth its reduction.
FAR_PHASE = 1e8


@Inlined
def lower(v, share):  # type: ignore[no-untyped-def]
    """A lower bound of what was rounded to v: a zero is exact, infinity an overflow."""
    bound = v - fabs(v) * share - LEAST
    bound = choose(bound == bound, bound, choose(v > 0.0, MOST, -inf))
    return choose(v == 0.0, 0.0, bound)


@Inlined
def upper(v, share):  # type: ignore[no-untyped-def]
    """An upper bound of what was rounded to v, mirrored."""
    return -lower(-v, share)


@Inlined
def kept(v, sign):  # type: ignore[no-untyped-def]
    """The float v, or a tiny one of the given sign if it underflowed to zero."""
    return choose(v != 0.0, v, choose(sign < 0.0, -LEAST, LEAST))


@Inlined
def least(x, y):  # type: ignore[no-untyped-def]
    """The smaller of two ends."""
    return choose(x < y, x, y)


@Inlined
def greatest(x, y):  # type: ignore[no-untyped-def]
    """The larger of two ends."""
    return choose(x > y, x, y)


@Inlined
def ordinary(a):  # type: ignore[no-untyped-def]
    """Whether both ends are numbers."""
    return (a[0] == a[0]) & (a[1] == a[1])


@Inlined
def product(u, v):  # type: ignore[no-untyped-def]
    """The product of two ends; an infinite end is never reached, so zero times it is zero."""
    return choose((u != 0.0) & (v != 0.0), kept(u * v, choose(u < 0.0, -v, v)), 0.0)


@Inlined
def iconst(c):  # type: ignore[no-untyped-def]
    """A number that is exactly c."""
    return (float(c), float(c)) if c == c else (-inf, inf)


@Inlined
def ipoint(v):  # type: ignore[no-untyped-def]
    """A number whose nearest float is v."""
    return lower(float(v), ROUNDED), upper(float(v), ROUNDED)


@Inlined
def ipi():  # type: ignore[no-untyped-def]
    """The number pi, which lies just above its nearest float."""
    return pi, 3.1415926535897936


@Inlined
def iadd(a, b):  # type: ignore[no-untyped-def]
    """The sum a + b."""
    return lower(a[0] + b[0], ROUNDED), upper(a[1] + b[1], ROUNDED)


@Inlined
def imul(a, b):  # type: ignore[no-untyped-def]
    """The product a*b."""
    p, q = product(a[0], b[0]), product(a[0], b[1])
    r, s = product(a[1], b[0]), product(a[1], b[1])
    known = ordinary(a) & ordinary(b)
    return (
        choose(known, lower(least(least(p, q), least(r, s)), ROUNDED), -inf),
        choose(known, upper(greatest(greatest(p, q), greatest(r, s)), ROUNDED), inf),
    )


@Inlined
def iinv(a):  # type: ignore[no-untyped-def]
    """The inverse 1/a: everything if zero lies inside, half of it if zero is an end."""
    lo, hi = a
    known = ordinary(a) & ((lo >= 0.0) | (hi <= 0.0))
    below = choose(known & (hi != 0.0), lower(kept(1.0 / hi, hi), ROUNDED), -inf)
    above = choose(known & (lo != 0.0), upper(kept(1.0 / lo, lo), ROUNDED), inf)
    return below, above


@Inlined
def idiv(a, b):  # type: ignore[no-untyped-def]
    """The quotient a/b."""
    return imul(a, iinv(b))


@Inlined
def iabs(a):  # type: ignore[no-untyped-def]
    """The absolute value of a."""
    return greatest(greatest(a[0], -a[1]), 0.0), greatest(-a[0], a[1])


@Inlined
def grown(lo, hi):  # type: ignore[no-untyped-def]
    """From the values of the C library at the ends."""
    return lower(lo, LIBRARY), upper(hi, LIBRARY)


@Inlined
def natural_power(x, n):  # type: ignore[no-untyped-def]
    """The power x**n for n > 0, never an inexact zero."""
    value = x
    for _ in range(n - 1):
        value *= x
    return choose(x != 0.0, kept(value, choose(n % 2 == 1, x, 1.0)), 0.0)


@Inlined
def natural_ipow(a, n):  # type: ignore[no-untyped-def]
    """The power a**n for n > 0, rounded n - 1 times."""
    b, share = a if n % 2 else iabs(a), ROUNDED * n
    return lower(natural_power(b[0], n), share), upper(natural_power(b[1], n), share)


@Inlined
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


@Inlined
def isqrt(a):  # type: ignore[no-untyped-def]
    """The values of sqrt."""
    known = a[0] >= 0.0
    return choose(known, lower(sqrt(a[0]), ROUNDED), -inf), choose(known, upper(sqrt(a[1]), ROUNDED), inf)


@Inlined
def iexp(a):  # type: ignore[no-untyped-def]
    """The values of exp."""
    return grown(kept(exp(a[0]), 1.0), kept(exp(a[1]), 1.0))


@Inner
def ilog(a):  # type: ignore[no-untyped-def]
    """The values of log."""
    return grown(log(a[0]), log(a[1])) if a[0] >= 0.0 and a[1] > 0.0 else (-inf, inf)


@Inlined
def meets(a, point, period):  # type: ignore[no-untyped-def]
    """Whether point + k*period may lie in the interval for a whole k; yes when in doubt."""
    slack = 1e-15 * (2.0 + fabs(a[0]) + fabs(a[1]))
    return whole_below((a[1] - point) / period + slack) >= (a[0] - point) / period - slack


@Inlined
def unphased(a):  # type: ignore[no-untyped-def]
    """Whether the interval is too wide or too far out to know the phase (or not a number)."""
    return not ((a[0] >= -FAR_PHASE) & (a[1] <= FAR_PHASE) & (a[1] - a[0] < 2.0 * pi))


@Inlined
def wave(a, left, right, trough, crest):  # type: ignore[no-untyped-def]
    """A wave with the values left and right at the ends, and a trough and a crest once a turn."""
    lo, hi = grown(least(left, right), greatest(left, right))
    unknown = unphased(a)
    return (
        choose(unknown | meets(a, trough, 2.0 * pi), -1.0, greatest(lo, -1.0)),
        choose(unknown | meets(a, crest, 2.0 * pi), 1.0, least(hi, 1.0)),
    )


@Inlined
def isin(a):  # type: ignore[no-untyped-def]
    """The values of sin."""
    return wave(a, sin(a[0]), sin(a[1]), -0.5 * pi, 0.5 * pi)


@Inlined
def icos(a):  # type: ignore[no-untyped-def]
    """The values of cos."""
    return wave(a, cos(a[0]), cos(a[1]), pi, 0.0)


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


@Inlined
def isinh(a):  # type: ignore[no-untyped-def]
    """The values of sinh."""
    return grown(sinh(a[0]), sinh(a[1]))


@Inlined
def icosh(a):  # type: ignore[no-untyped-def]
    """The values of cosh."""
    b = iabs(a)
    lo, hi = grown(cosh(b[0]), cosh(b[1]))
    return greatest(lo, 1.0), hi


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
