"""Second divided differences of sin, cos, sinh, cosh, exp, tan and tanh.

As in `second`, there is a closed form for points near each other, here by `symmetric_parts`, and for others the
difference of two first differences is taken. Both values are computed and one is chosen, so that a loop over them fills
vector registers. ``divdiff2_sin_near`` and its like are the closed forms alone: they are NaN for points too far apart.
"""

from math import fabs, factorial, nan

from gqm_sym.runtime.arithmetic.divided_differences.first import (
    divdiff1_cos,
    divdiff1_cosh,
    divdiff1_sin,
    divdiff1_sinh,
    divdiff1_tan,
    divdiff1_tanh,
    expc,
)
from gqm_sym.runtime.arithmetic.divided_differences.points import around, ascending_gaps, series_pair
from gqm_sym.runtime.arithmetic.elementary import cos, cosh, exp, sin, sinh
from gqm_sym.runtime.compiled.intrinsics import choose, polynomial
from gqm_sym.runtime.compiled.jit import Inlined

# |h1| + |h2| up to which `symmetric_parts` may be used: the rest of its series is below 1e-19 there.
MAX_SPAN = 1.0

# The same limit for sinh and cosh alone, about which bodies swing as widely.
MAX_HYPERBOLIC_SPAN = 2.0

# The same limit for sin and cos, whose parts do not cancel while the points span at most a whole turn, the widest
# swing of a pendulum.
MAX_WAVE_SPAN = 3.2


def _even(shift: int, terms: int) -> tuple[float, ...]:
    """Coefficients of the even series of a sinc (shift 1) or cosine (shift 0) in t**2, highest power first."""
    return tuple((-1.0) ** k / factorial(2 * k + shift) for k in reversed(range(terms)))


# The series of sinc, and of sinc and cosine of half the argument, with as many terms as MAX_SPAN, MAX_HYPERBOLIC_SPAN
# and MAX_WAVE_SPAN require.
NEAR_SERIES = (_even(1, 10), _even(1, 8), _even(0, 9))
HYPERBOLIC_SERIES = (_even(1, 13), _even(1, 10), _even(0, 11))
WIDE_SERIES = (_even(1, 16), _even(1, 12), _even(0, 12))

# The series of sinh(h)/h for arguments up to MAX_HYPERBOLIC_SPAN, and up to twice that.
SINHC, WIDE_SINHC = (tuple(map(fabs, _even(1, terms))) for terms in (13, 17))

# sinc as a polynomial in the square of its argument, highest power first. It interpolates at Chebyshev nodes for
# arguments up to MAX_WAVE_SPAN, and its error with rounded coefficients is below 3e-17.
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
def symmetric_parts(h1, h2, sign, sums):  # type: ignore[no-untyped-def]
    """Return the parts A and B of a second difference that are even and odd when the gaps h1 and h2 are swapped.

    A = S(H/2)*(S(h1) + S(h2))/2 and B = C(H/2)*(h2 - h1)*S~[h1**2, h2**2], with H = h1 + h2 and S~(t**2) = S(t). S and
    C are sinc and cosine (``sign`` 1) or their hyperbolic counterparts (``sign`` -1), and ``sums`` are their series
    (MATHS, section 3).
    """
    quarter = sign * 0.25 * (h1 + h2) * (h1 + h2)
    both, slope = series_pair(sums[0], sign * h1 * h1, sign * h2 * h2)
    even = 0.5 * polynomial(sums[1], quarter) * both
    return even, polynomial(sums[2], quarter) * (h2 - h1) * sign * slope


@Inlined
def divdiff2_sin_near(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """sin[x,y,w] = (B cos M - A sin M)/2, M = (x+2y+w)/4, A and B from half the gaps; NaN beyond `MAX_WAVE_SPAN`."""
    u, v = 0.5 * h1, 0.5 * h2
    even, odd = symmetric_parts(u, v, 1.0, WIDE_SERIES)
    m = 0.25 * (x + w + 2.0 * y)
    return choose(fabs(u) + fabs(v) <= MAX_WAVE_SPAN, 0.5 * (odd * cos(m) - even * sin(m)), nan)


@Inlined
def sinc_near(h):  # type: ignore[no-untyped-def]
    """sin(h)/h, for ``|h|`` <= `MAX_WAVE_SPAN`."""
    return polynomial(SINC, h * h)


@Inlined
def divdiff1_cos_in_square(h1, h2):  # type: ignore[no-untyped-def]
    """(cos v - cos h)/(v**2 - h**2): cos(sqrt(t))[h**2, v**2], with the gaps h1 = v + h and h2 = h - v.

    It is also the second difference of cos over -h, v, h. It is NaN where h is beyond `MAX_WAVE_SPAN`.
    """
    u, v = 0.5 * h1, 0.5 * h2
    return choose(fabs(u) + fabs(v) <= MAX_WAVE_SPAN, -0.5 * sinc_near(u) * sinc_near(v), nan)


@Inlined
def divdiff1_sinc_in_square(h1, h2):  # type: ignore[no-untyped-def]
    """(sinc v - sinc h)/(v**2 - h**2), as for the cosine; v times it is the second difference of sin over -h, v, h."""
    h, v = 0.5 * (h1 + h2), 0.5 * (h1 - h2)
    return series_pair(SINC, h * h, v * v)[1]


@Inlined
def divdiff2_cos_near(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """cos[x,y,w] = -(B sin M + A cos M)/2, as for the sine."""
    u, v = 0.5 * h1, 0.5 * h2
    even, odd = symmetric_parts(u, v, 1.0, WIDE_SERIES)
    m = 0.25 * (x + w + 2.0 * y)
    return choose(fabs(u) + fabs(v) <= MAX_WAVE_SPAN, -0.5 * (odd * sin(m) + even * cos(m)), nan)


@Inlined
def divdiff2_sin(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """sin[x,y,w], of points at any distance."""
    near = divdiff2_sin_near(x, y, w, h1, h2)
    p, q, first, r, s, second, d = around(x, y, w, h1, h2)
    return choose(near == near, near, (divdiff1_sin(r, s, second) - divdiff1_sin(p, q, first)) / d)


@Inlined
def divdiff2_cos(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """cos[x,y,w], of points at any distance."""
    near = divdiff2_cos_near(x, y, w, h1, h2)
    p, q, first, r, s, second, d = around(x, y, w, h1, h2)
    return choose(near == near, near, (divdiff1_cos(r, s, second) - divdiff1_cos(p, q, first)) / d)


@Inlined
def divdiff2_sinh_near(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """sinh[x,y,w] = (B cosh M + A sinh M)/2, as for the sine; NaN beyond `MAX_HYPERBOLIC_SPAN`."""
    u, v = 0.5 * h1, 0.5 * h2
    even, odd = symmetric_parts(u, v, -1.0, HYPERBOLIC_SERIES)
    m = 0.25 * (x + w + 2.0 * y)
    return choose(fabs(u) + fabs(v) <= MAX_HYPERBOLIC_SPAN, 0.5 * (odd * cosh(m) + even * sinh(m)), nan)


@Inlined
def divdiff2_cosh_near(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """cosh[x,y,w] = (B sinh M + A cosh M)/2, as for the sine; NaN beyond `MAX_HYPERBOLIC_SPAN`."""
    u, v = 0.5 * h1, 0.5 * h2
    even, odd = symmetric_parts(u, v, -1.0, HYPERBOLIC_SERIES)
    m = 0.25 * (x + w + 2.0 * y)
    return choose(fabs(u) + fabs(v) <= MAX_HYPERBOLIC_SPAN, 0.5 * (odd * sinh(m) + even * cosh(m)), nan)


@Inlined
def sinhc_near(h):  # type: ignore[no-untyped-def]
    """sinh(h)/h, for ``|h|`` <= `MAX_HYPERBOLIC_SPAN`."""
    return polynomial(SINHC, h * h)


@Inlined
def divdiff1_cosh_in_square(h1, h2):  # type: ignore[no-untyped-def]
    """(cosh v - cosh h)/(v**2 - h**2), as `divdiff1_cos_in_square`; NaN where h is beyond `MAX_HYPERBOLIC_SPAN`."""
    u, v = 0.5 * h1, 0.5 * h2
    return choose(fabs(u) + fabs(v) <= MAX_HYPERBOLIC_SPAN, 0.5 * sinhc_near(u) * sinhc_near(v), nan)


@Inlined
def divdiff1_sinhc_in_square(h1, h2):  # type: ignore[no-untyped-def]
    """(sinh(v)/v - sinh(h)/h)/(v**2 - h**2), as `divdiff1_sinc_in_square`."""
    h, v = 0.5 * (h1 + h2), 0.5 * (h1 - h2)
    return series_pair(SINHC, h * h, v * v)[1]


@Inlined
def sum_of_sinhc(h1, h2):  # type: ignore[no-untyped-def]
    """sinh(h1)/h1 + sinh(h2)/h2; NaN where the gaps together are beyond twice `MAX_HYPERBOLIC_SPAN`."""
    both = series_pair(WIDE_SINHC, h1 * h1, h2 * h2)[0]
    return choose(fabs(h1) + fabs(h2) <= 2.0 * MAX_HYPERBOLIC_SPAN, both, nan)


@Inlined
def difference_of_sinhc(h1, h2):  # type: ignore[no-untyped-def]
    """(sinh(h2)/h2 - sinh(h1)/h1)/(h1 + h2)."""
    return (h2 - h1) * series_pair(WIDE_SINHC, h1 * h1, h2 * h2)[1]


@Inlined
def mean_sech(x, w):  # type: ignore[no-untyped-def]
    """(1/cosh x + 1/cosh w)/2."""
    return 0.5 / cosh(x) + 0.5 / cosh(w)


@Inlined
def difference_of_sech(x, w, h):  # type: ignore[no-untyped-def]
    """sech[x,w] = -cosh[x,w]/(cosh x cosh w)."""
    return -divdiff1_cosh(x, w, h) / cosh(x) / cosh(w)


@Inlined
def divdiff2_sinh(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """sinh[x,y,w], of points at any distance."""
    near = divdiff2_sinh_near(x, y, w, h1, h2)
    p, q, first, r, s, second, d = around(x, y, w, h1, h2)
    return choose(near == near, near, (divdiff1_sinh(r, s, second) - divdiff1_sinh(p, q, first)) / d)


@Inlined
def divdiff2_cosh(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """cosh[x,y,w], of points at any distance."""
    near = divdiff2_cosh_near(x, y, w, h1, h2)
    p, q, first, r, s, second, d = around(x, y, w, h1, h2)
    return choose(near == near, near, (divdiff1_cosh(r, s, second) - divdiff1_cosh(p, q, first)) / d)


@Inlined
def divdiff2_exp(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """exp[x,y,w] = exp(M) (A + B)/2; points far apart share the factor exp of the highest."""
    even, odd = symmetric_parts(0.5 * h1, 0.5 * h2, -1.0, NEAR_SERIES)
    near = 0.5 * exp(0.25 * (x + w + 2.0 * y)) * (even + odd)
    u, v, top = ascending_gaps(x, y, w, h1, h2)
    upper = expc(v)
    far = exp(top) * (upper - (1.0 - v * upper) * expc(u)) / (u + v)
    return choose(0.5 * (fabs(h1) + fabs(h2)) <= MAX_SPAN, near, far)


@Inlined
def divdiff2_tan(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """tan[x,y,w] = (B cos m + A sin m)/(cos x cos y cos w), m = (x+w)/2, from whole gaps."""
    even, odd = symmetric_parts(h1, h2, 1.0, NEAR_SERIES)
    m = 0.5 * (x + w)
    near = (odd * cos(m) + even * sin(m)) / (cos(x) * cos(y) * cos(w))
    p, q, first, r, s, second, d = around(x, y, w, h1, h2)
    far = (divdiff1_tan(r, s, second) - divdiff1_tan(p, q, first)) / d
    return choose(fabs(h1) + fabs(h2) <= MAX_SPAN, near, far)


@Inlined
def divdiff2_tanh(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """tanh[x,y,w] = (B cosh m - A sinh m)/(cosh x cosh y cosh w), as for the tangent."""
    even, odd = symmetric_parts(h1, h2, -1.0, NEAR_SERIES)
    m = 0.5 * (x + w)
    near = (odd * cosh(m) - even * sinh(m)) / cosh(x) / (cosh(y) * cosh(w))
    p, q, first, r, s, second, d = around(x, y, w, h1, h2)
    far = (divdiff1_tanh(r, s, second) - divdiff1_tanh(p, q, first)) / d
    return choose(fabs(h1) + fabs(h2) <= MAX_SPAN, near, far)
