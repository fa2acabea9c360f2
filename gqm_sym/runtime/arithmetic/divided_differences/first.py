"""First divided differences of the elementary functions, without subtracting nearly equal numbers.

``divdiff1_f(x, y, h)`` is ``f[x,y]``, the derivative where the points coincide. The gap ``h = y - x`` is
trusted to its last digit and never formed again from the points, which are only as good as their
own rounding (MATHS, section 3).
"""

from math import asinh, atan, atanh, expm1, fabs, log, sqrt
from math import atan2 as angle
from math import pow as power

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.arithmetic.elementary import (
    cos,
    cos_of_sum,
    cosh,
    exp,
    expm1_below,
    log1p,
    sin,
    sin_of_sum,
    sinh,
)
from gqm_sym.runtime.compiled.intrinsics import choose
from gqm_sym.runtime.compiled.jit import Inlined, Inner

# Below this t, 1 + t**2 is 1 to the last digit. The limit keeps quotients of subnormal numbers out.
TINY_ARGUMENT = 1e-9

# Beyond this, the atanh of a difference of logarithms loses digits and the logarithm does not.
FAR_QUOTIENT = 0.5


@Inlined
def sinc(t):  # type: ignore[no-untyped-def]
    """sin(t)/t."""
    ordinary = fabs(t) > TINY_ARGUMENT
    return choose(ordinary, sin(t) / choose(ordinary, t, 1.0), 1.0)


@Inlined
def sinhc(t):  # type: ignore[no-untyped-def]
    """sinh(t)/t."""
    ordinary = fabs(t) > TINY_ARGUMENT
    return choose(ordinary, sinh(t) / choose(ordinary, t, 1.0), 1.0)


@Inlined
def expc(t):  # type: ignore[no-untyped-def]
    """(1 - exp(-t))/t for t >= 0."""
    return choose(t == 0.0, 1.0, -expm1_below(-t) / choose(t == 0.0, 1.0, t))


@Inner
def atanc(t):  # type: ignore[no-untyped-def]
    """atan(t)/t."""
    return atan(t) / t if fabs(t) > TINY_ARGUMENT else 1.0


@Inner
def atanhc(t):  # type: ignore[no-untyped-def]
    """atanh(t)/t."""
    return atanh(t) / t if fabs(t) > TINY_ARGUMENT else 1.0


@Inlined
def divdiff1_sin(x, y, h):  # type: ignore[no-untyped-def]
    """sin[x,y] = cos((x+y)/2) sinc(h/2); near a zero of the cosine the rounding of x + y counts."""
    middle, middle_low = two_sum(x, y)
    return (cos(0.5 * middle) - 0.5 * middle_low * sin(0.5 * middle)) * sinc(0.5 * h)


@Inlined
def divdiff1_cos(x, y, h):  # type: ignore[no-untyped-def]
    """cos[x,y] = -sin((x+y)/2) sinc(h/2); near a zero of the sine the rounding of x + y counts."""
    middle, middle_low = two_sum(x, y)
    return -(sin(0.5 * middle) + 0.5 * middle_low * cos(0.5 * middle)) * sinc(0.5 * h)


@Inlined
def divdiff1_sin_of_sum(phase, rate, start, gap):  # type: ignore[no-untyped-def]
    """sin[x,y] with x = phase + rate*start and y = x + rate*gap; no rounding of x or y counts."""
    return cos_of_sum(phase, rate, start, 0.0, 0.5 * gap) * sinc(0.5 * rate * gap)


@Inlined
def divdiff1_cos_of_sum(phase, rate, start, gap):  # type: ignore[no-untyped-def]
    """cos[x,y], as for the sine."""
    return -sin_of_sum(phase, rate, start, 0.0, 0.5 * gap) * sinc(0.5 * rate * gap)


@Inlined
def divdiff1_tan(x, y, h):  # type: ignore[no-untyped-def]
    """tan[x,y] = sinc(h)/(cos x cos y)."""
    return sinc(h) / (cos(x) * cos(y))


@Inlined
def divdiff1_sinh(x, y, h):  # type: ignore[no-untyped-def]
    """sinh[x,y] = cosh((x+y)/2) sinhc(h/2)."""
    return cosh(0.5 * (x + y)) * sinhc(0.5 * h)


@Inlined
def divdiff1_cosh(x, y, h):  # type: ignore[no-untyped-def]
    """cosh[x,y] = sinh((x+y)/2) sinhc(h/2)."""
    return sinh(0.5 * (x + y)) * sinhc(0.5 * h)


@Inlined
def divdiff1_tanh(x, y, h):  # type: ignore[no-untyped-def]
    """tanh[x,y] = sinhc(h)/(cosh x cosh y), with the growing exponentials cancelled by hand."""
    p, q = exp(-2.0 * fabs(x)), exp(-2.0 * fabs(y))
    decay = choose(x * y > 0.0, choose(p > q, p, q), 1.0)
    return 4.0 * decay * expc(2.0 * fabs(h)) / ((1.0 + p) * (1.0 + q))


@Inlined
def divdiff1_exp(x, y, h):  # type: ignore[no-untyped-def]
    """exp[x,y] = exp(y) (1 - exp(-h))/h, y the larger."""
    return exp(choose(x > y, x, y)) * expc(fabs(h))


@Inlined
def divdiff1_log(x, y, h):  # type: ignore[no-untyped-def]
    """log[x,y] = log1p(h/x)/h, x the smaller."""
    gap, least = fabs(h), choose(x < y, x, y)
    ratio = gap / least
    return choose(ratio > 0.1 * TINY_ARGUMENT * TINY_ARGUMENT, log1p(ratio) / gap, 1.0 / least)


@Inner
def divdiff1_atan(x, y, h):  # type: ignore[no-untyped-def]
    """atan[x,y] = atan(h/(1+xy))/h."""
    p = 1.0 + x * y
    return angle(h, p) / h if fabs(h) > FAR_QUOTIENT * p else atanc(h / p) / p


@Inner
def root_below(x):  # type: ignore[no-untyped-def]
    """sqrt(1 - x**2): the cosine of asin x."""
    return sqrt((1.0 - x) * (1.0 + x))


@Inner
def root_above(x):  # type: ignore[no-untyped-def]
    """sqrt(1 + x**2): the cosh of asinh x."""
    return sqrt(1.0 + x * x)


@Inner
def root_beyond(x):  # type: ignore[no-untyped-def]
    """sqrt(x**2 - 1): the sinh of acosh x."""
    return sqrt((x - 1.0) * (x + 1.0))


@Inner
def one_less_product(x, y):  # type: ignore[no-untyped-def]
    """Return 1 - xy with all its digits, for |x| <= 1 and |y| <= 1."""
    return (1.0 - x) + x * (1.0 - y) if x + y > 0.0 else (1.0 + x) - x * (1.0 + y)


@Inner
def divdiff1_asin(x, y, h):  # type: ignore[no-untyped-def]
    """asin[x,y] = 2 atan(h/(cx+cy))/h, c = sqrt(1 - x**2)."""
    p = root_below(x) + root_below(y)
    r = h / p
    return 2.0 * atan(r) / h if fabs(r) > FAR_QUOTIENT else 2.0 * atanc(r) / p


@Inner
def divdiff1_acos(x, y, h):  # type: ignore[no-untyped-def]
    """acos[x,y] = -asin[x,y]."""
    return -divdiff1_asin(x, y, h)


@Inner
def divdiff1_asinh(x, y, h):  # type: ignore[no-untyped-def]
    """asinh[x,y] = 2 atanh(h/(cx+cy))/h, c = sqrt(1 + x**2), or the quotient if far apart."""
    cx, cy = root_above(x), root_above(y)
    p = cx + cy
    r = h / p
    if fabs(r) <= FAR_QUOTIENT:
        return 2.0 * atanhc(r) / p
    if x * y < 0.0:
        return (asinh(y) - asinh(x)) / h
    return fabs(log((fabs(y) + cy) / (fabs(x) + cx)) / h)


@Inner
def divdiff1_acosh(x, y, h):  # type: ignore[no-untyped-def]
    """acosh[x,y] = 2 atanh(h/(sx+sy))/h, s = sqrt(x**2 - 1), or the quotient if far apart."""
    sx, sy = root_beyond(x), root_beyond(y)
    p = sx + sy
    r = h / p
    return log((y + sy) / (x + sx)) / h if fabs(r) > FAR_QUOTIENT else 2.0 * atanhc(r) / p


@Inner
def divdiff1_atanh(x, y, h):  # type: ignore[no-untyped-def]
    """atanh[x,y] = atanh(h/(1-xy))/h, or the quotient if far apart."""
    p = one_less_product(x, y)
    r = h / p
    if fabs(r) > FAR_QUOTIENT:
        return 0.5 * log((1.0 + y) * (1.0 - x) / ((1.0 - y) * (1.0 + x))) / h
    return atanhc(r) / p


@Inner
def divdiff1_abs(x, y, h):  # type: ignore[no-untyped-def]
    """|u|[x,y]: 1 or -1 if the points have the same sign, else (x+y)/|h|."""
    if min(x, y) >= 0.0:
        return 1.0
    return -1.0 if max(x, y) <= 0.0 else (x + y) / fabs(h)


@Inner
def divdiff1_ipow(x, y, h, n):  # type: ignore[no-untyped-def]
    """(u**n)[x,y], n an integer: the sum of x**i y**j over i+j = n-1; a negative n by 1/u."""
    if n < 0:
        return -divdiff1_ipow_sum(1.0 / x, 1.0 / y, -n) / (x * y)
    return divdiff1_ipow_sum(x, y, n)


@Inner
def divdiff1_ipow_sum(x, y, n):  # type: ignore[no-untyped-def]
    """Return the sum of x**i y**j over i+j = n-1, by (u**(k+1))[x,y] = y (u**k)[x,y] + x**k."""
    first, value = 0.0, 1.0
    for _ in range(n):
        first = first * y + value
        value *= x
    return first


@Inner
def divdiff1_rpow(x, y, h, p):  # type: ignore[no-untyped-def]
    """(u**p)[x,y] = x**p expm1(p log(y/x))/h, x the smaller, or the quotient if far."""
    gap, least = fabs(h), min(x, y)
    if gap * (1.0 + fabs(p)) <= TINY_ARGUMENT * least:
        middle = 0.5 * (x + y)
        return p * power(middle, p) / middle  # p - 1 would be rounded
    t = p * log1p(gap / least)
    if fabs(t) < 1.0:
        return power(least, p) * expm1(t) / gap
    return (power(y, p) - power(x, p)) / h
