"""Interval arithmetic for proofs about signs: each result contains all values of the function over the arguments.

An interval is a tuple ``(lo, hi)`` of floats, which may be infinite but never NaN. Ends are rounded outwards by a few
units in the last place. A function gives ``(-inf, inf)`` where a part of the interval lies outside its domain, because
nothing may be proved across a gap in the domain. Exact zeros stay exact, so that rounding does not hide a sign.
"""

from math import acos, acosh, asin, asinh, atan, atanh, fabs, inf, log, pi, sqrt, tan, tanh
from math import pow as power

from gqm_sym.runtime.arithmetic.elementary import cos, cosh, exp, sin, sinh
from gqm_sym.runtime.compiled.intrinsics import choose, floor_of
from gqm_sym.runtime.compiled.jit import Inlined, Inner

# The relative error of one operation, which is at most 2**-53, and that of the C library's functions, which are
# accurate to four ulps; both have a margin.
ROUNDING_ERROR = 2.0**-52
LIBRARY_ERROR = 2.0**-50

# Four times the smallest subnormal number, by which ends are widened in addition; and the largest number.
SMALLEST = 2e-323
LARGEST = 1.7976931348623157e308

# Beyond this argument sines are bounded by -1 and 1 only.
MAX_ARGUMENT = 1e8


@Inlined
def lower(v, share):  # type: ignore[no-untyped-def]
    """Return a lower bound of the number that was rounded to v. A zero is taken as exact, an infinity as an
    overflow.
    """
    bound = v - fabs(v) * share - SMALLEST
    bound = choose(bound == bound, bound, choose(v > 0.0, LARGEST, -inf))
    return choose(v == 0.0, 0.0, bound)


@Inlined
def upper(v, share):  # type: ignore[no-untyped-def]
    """Return an upper bound of the number that was rounded to v."""
    return -lower(-v, share)


@Inlined
def not_underflowed(v, sign):  # type: ignore[no-untyped-def]
    """Return the float v; if it underflowed to zero, the smallest one of the given sign."""
    return choose(v != 0.0, v, choose(sign < 0.0, -SMALLEST, SMALLEST))


@Inlined
def smaller(x, y):  # type: ignore[no-untyped-def]
    """Return the smaller of two ends."""
    return choose(x < y, x, y)


@Inlined
def larger(x, y):  # type: ignore[no-untyped-def]
    """Return the larger of two ends."""
    return choose(x > y, x, y)


@Inlined
def is_known(a):  # type: ignore[no-untyped-def]
    """Return whether neither end is NaN."""
    return (a[0] == a[0]) & (a[1] == a[1])


@Inlined
def product(u, v):  # type: ignore[no-untyped-def]
    """Return the product of two ends. Zero times an infinite end is zero, since the interval does not contain
    infinity.
    """
    return choose((u != 0.0) & (v != 0.0), not_underflowed(u * v, choose(u < 0.0, -v, v)), 0.0)


@Inlined
def iconst(c):  # type: ignore[no-untyped-def]
    """Return the interval of the exact number c."""
    return (float(c), float(c)) if c == c else (-inf, inf)


@Inlined
def ipoint(v):  # type: ignore[no-untyped-def]
    """Return an interval that holds every number whose nearest float is v."""
    return lower(float(v), ROUNDING_ERROR), upper(float(v), ROUNDING_ERROR)


@Inlined
def ipi():  # type: ignore[no-untyped-def]
    """Return an interval that holds pi, which lies just above its nearest float."""
    return pi, 3.1415926535897936


@Inlined
def iadd(a, b):  # type: ignore[no-untyped-def]
    """Return the sum a + b."""
    return lower(a[0] + b[0], ROUNDING_ERROR), upper(a[1] + b[1], ROUNDING_ERROR)


@Inlined
def imul(a, b):  # type: ignore[no-untyped-def]
    """Return the product a*b."""
    p, q = product(a[0], b[0]), product(a[0], b[1])
    r, s = product(a[1], b[0]), product(a[1], b[1])
    known = is_known(a) & is_known(b)
    return (
        choose(known, lower(smaller(smaller(p, q), smaller(r, s)), ROUNDING_ERROR), -inf),
        choose(known, upper(larger(larger(p, q), larger(r, s)), ROUNDING_ERROR), inf),
    )


@Inlined
def iinv(a):  # type: ignore[no-untyped-def]
    """Return the inverse 1/a. It is unbounded on both sides if zero lies inside of a, and on one side if zero is an
    end.
    """
    lo, hi = a
    known = is_known(a) & ((lo >= 0.0) | (hi <= 0.0))
    below = choose(known & (hi != 0.0), lower(not_underflowed(1.0 / hi, hi), ROUNDING_ERROR), -inf)
    above = choose(known & (lo != 0.0), upper(not_underflowed(1.0 / lo, lo), ROUNDING_ERROR), inf)
    return below, above


@Inlined
def idiv(a, b):  # type: ignore[no-untyped-def]
    """Return the quotient a/b."""
    return imul(a, iinv(b))


@Inlined
def iabs(a):  # type: ignore[no-untyped-def]
    """Return the absolute value of a."""
    return larger(larger(a[0], -a[1]), 0.0), larger(-a[0], a[1])


@Inlined
def widened(lo, hi):  # type: ignore[no-untyped-def]
    """Return the interval between two values that are accurate to LIBRARY_ERROR."""
    return lower(lo, LIBRARY_ERROR), upper(hi, LIBRARY_ERROR)


@Inlined
def natural_power(x, n):  # type: ignore[no-untyped-def]
    """Return the power x**n for an integer n > 0. It is zero only where x is."""
    value = x
    for _ in range(n - 1):
        value *= x
    return choose(x != 0.0, not_underflowed(value, choose(n % 2 == 1, x, 1.0)), 0.0)


@Inlined
def natural_ipow(a, n):  # type: ignore[no-untyped-def]
    """Return the power a**n for an integer n > 0, which takes n - 1 roundings."""
    b, share = a if n % 2 else iabs(a), ROUNDING_ERROR * n
    return lower(natural_power(b[0], n), share), upper(natural_power(b[1], n), share)


@Inlined
def ipow(a, n):  # type: ignore[no-untyped-def]
    """Return the power a**n, n an integer."""
    if n == 0:
        return 1.0, 1.0
    return natural_ipow(a, n) if n > 0 else iinv(natural_ipow(a, -n))


@Inner
def real_power(x, p):  # type: ignore[no-untyped-def]
    """Return the power x**p for x >= 0, which is zero only where x is, and its relative error."""
    if x == 0.0 or x == inf:
        return power(x, p), LIBRARY_ERROR
    return not_underflowed(power(x, p), 1.0), LIBRARY_ERROR + ROUNDING_ERROR * fabs(p * log(x))


@Inner
def irpow(a, p):  # type: ignore[no-untyped-def]
    """Return the power a**p, a >= 0; p may be a rounded number."""
    if not a[0] >= 0.0:
        return -inf, inf
    below, slack = real_power(a[0] if p >= 0.0 else a[1], p)
    above, share = real_power(a[1] if p >= 0.0 else a[0], p)
    return lower(below, slack), upper(above, share)


@Inlined
def isqrt(a):  # type: ignore[no-untyped-def]
    """Return an enclosure of sqrt over a."""
    known = a[0] >= 0.0
    return choose(known, lower(sqrt(a[0]), ROUNDING_ERROR), -inf), choose(known, upper(sqrt(a[1]), ROUNDING_ERROR), inf)


@Inlined
def iexp(a):  # type: ignore[no-untyped-def]
    """Return an enclosure of exp over a."""
    return widened(not_underflowed(exp(a[0]), 1.0), not_underflowed(exp(a[1]), 1.0))


@Inner
def ilog(a):  # type: ignore[no-untyped-def]
    """Return an enclosure of log over a."""
    return widened(log(a[0]), log(a[1])) if a[0] >= 0.0 and a[1] > 0.0 else (-inf, inf)


@Inlined
def meets(a, point, period):  # type: ignore[no-untyped-def]
    """Return whether point + k*period may lie in the interval for an integer k; the answer is true in case of doubt."""
    slack = 1e-15 * (2.0 + fabs(a[0]) + fabs(a[1]))
    return floor_of((a[1] - point) / period + slack) >= (a[0] - point) / period - slack


@Inlined
def spans_a_turn(a):  # type: ignore[no-untyped-def]
    """Return whether the interval is a turn wide or wider, lies beyond MAX_ARGUMENT, or is not known."""
    return not ((a[0] >= -MAX_ARGUMENT) & (a[1] <= MAX_ARGUMENT) & (a[1] - a[0] < 2.0 * pi))


@Inlined
def between_extremes(a, left, right, lowest, highest):  # type: ignore[no-untyped-def]
    """Return an enclosure of a sine or cosine whose values at the ends are left and right; in each turn it is -1 at
    lowest and 1 at highest.
    """
    lo, hi = widened(smaller(left, right), larger(left, right))
    unknown = spans_a_turn(a)
    return (
        choose(unknown | meets(a, lowest, 2.0 * pi), -1.0, larger(lo, -1.0)),
        choose(unknown | meets(a, highest, 2.0 * pi), 1.0, smaller(hi, 1.0)),
    )


@Inlined
def isin(a):  # type: ignore[no-untyped-def]
    """Return an enclosure of sin over a."""
    return between_extremes(a, sin(a[0]), sin(a[1]), -0.5 * pi, 0.5 * pi)


@Inlined
def icos(a):  # type: ignore[no-untyped-def]
    """Return an enclosure of cos over a."""
    return between_extremes(a, cos(a[0]), cos(a[1]), pi, 0.0)


@Inner
def itan(a):  # type: ignore[no-untyped-def]
    """Return an enclosure of tan over a."""
    return (-inf, inf) if spans_a_turn(a) or meets(a, 0.5 * pi, pi) else widened(tan(a[0]), tan(a[1]))


@Inner
def iatan(a):  # type: ignore[no-untyped-def]
    """Return an enclosure of atan over a."""
    return widened(atan(a[0]), atan(a[1]))


@Inner
def iasin(a):  # type: ignore[no-untyped-def]
    """Return an enclosure of asin over a."""
    return widened(asin(a[0]), asin(a[1])) if a[0] >= -1.0 and a[1] <= 1.0 else (-inf, inf)


@Inner
def iacos(a):  # type: ignore[no-untyped-def]
    """Return an enclosure of acos over a."""
    return widened(acos(a[1]), acos(a[0])) if a[0] >= -1.0 and a[1] <= 1.0 else (-inf, inf)


@Inlined
def isinh(a):  # type: ignore[no-untyped-def]
    """Return an enclosure of sinh over a."""
    return widened(sinh(a[0]), sinh(a[1]))


@Inlined
def icosh(a):  # type: ignore[no-untyped-def]
    """Return an enclosure of cosh over a."""
    b = iabs(a)
    lo, hi = widened(cosh(b[0]), cosh(b[1]))
    return larger(lo, 1.0), hi


@Inner
def itanh(a):  # type: ignore[no-untyped-def]
    """Return an enclosure of tanh over a."""
    lo, hi = widened(tanh(a[0]), tanh(a[1]))
    return max(lo, -1.0), min(hi, 1.0)


@Inner
def iasinh(a):  # type: ignore[no-untyped-def]
    """Return an enclosure of asinh over a."""
    return widened(asinh(a[0]), asinh(a[1]))


@Inner
def iacosh(a):  # type: ignore[no-untyped-def]
    """Return an enclosure of acosh over a."""
    return widened(acosh(a[0]), acosh(a[1])) if a[0] >= 1.0 else (-inf, inf)


@Inner
def iatanh(a):  # type: ignore[no-untyped-def]
    """Return an enclosure of atanh over a."""
    return widened(atanh(a[0]), atanh(a[1])) if a[0] >= -1.0 and a[1] <= 1.0 else (-inf, inf)
