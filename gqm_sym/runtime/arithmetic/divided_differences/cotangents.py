"""The parts of divided differences of x*cot(x) that have no pole at 0 (MATHS, section 3).

With S(p, h) = (sinc p - sinc h)/(p**2 - h**2), the first difference of f(x) = x*cot(x) is ::

    f[x,y] = 2*(x + y) * S(x + y, y - x) * (x/sin x) * (y/sin y),

in which the poles of the cotangent, which cancel at 0, are gone. As (x + y)**2 - (y - x)**2 = 4*x*y, S is
(sinc(x + y) - sinc(y - x))/(4*x*y), too. The second difference of f follows by the rule for products from the
difference of S over x and w.
"""

from math import fabs

from gqm_sym.runtime.arithmetic.divided_differences.first import sinc
from gqm_sym.runtime.arithmetic.divided_differences.points import series_pair
from gqm_sym.runtime.arithmetic.elementary import cos
from gqm_sym.runtime.compiled.intrinsics import choose
from gqm_sym.runtime.compiled.jit import Inlined

# sinc(t) as a polynomial in t**2 - CENTER, highest power first, for |t| <= MAX_ARGUMENT: sums of two places on the
# branch of the cotangent about 0 are below a whole turn, where powers about 0 would cancel. It interpolates at
# Chebyshev nodes; with rounded coefficients, it is right to 2e-17.
CENTER, MAX_ARGUMENT = 20.0, 6.32
SINC_OF_TURN = (
    -7.378518043090475e-41,
    8.644917575461041e-38,
    -8.957947546876071e-35,
    8.165100109926567e-32,
    -6.479573842156587e-29,
    4.4297768707942675e-26,
    -2.577001039112062e-23,
    1.2571840820670277e-20,
    -5.053397053242648e-18,
    1.6377445383001085e-15,
    -4.163589473909516e-13,
    8.009828342051534e-11,
    -1.1096366150366797e-08,
    1.0283643963311109e-06,
    -5.6288050695253104e-05,
    0.001376868308722764,
    -0.0005191018407337898,
    -0.2171843183512395,
)


@Inlined
def sinc_in_square(p, h):  # type: ignore[no-untyped-def]
    """(sinc p - sinc h)/(p**2 - h**2), for arguments up to `MAX_ARGUMENT`."""
    return series_pair(SINC_OF_TURN, p * p - CENTER, h * h - CENTER)[1]


@Inlined
def second_differences(r, s, t, u):  # type: ignore[no-untyped-def]
    """Return the second differences over r, s, u and r, t, u of the polynomial `SINC_OF_TURN`."""
    value, first_s, first_t, second_s, second_t = 0.0, 0.0, 0.0, 0.0, 0.0
    for coefficient in SINC_OF_TURN:
        second_s, second_t = second_s * u + first_s, second_t * u + first_t
        first_s, first_t = first_s * s + value, first_t * t + value
        value = value * r + coefficient
    return second_s, second_t


@Inlined
def difference_of_sinc(x, y, h):  # type: ignore[no-untyped-def]
    """(sinc(x + y) - sinc(h))/(4*x*y) with h = y - x; beyond a turn of x + y nothing cancels."""
    p = x + y
    far = (sinc(p) - sinc(h)) / (4.0 * x * y)
    return choose((fabs(p) <= MAX_ARGUMENT) & (fabs(h) <= MAX_ARGUMENT), sinc_in_square(p, h), far)


@Inlined
def divdiff1_difference_of_sinc(x, y, w, h1, h2):  # type: ignore[no-untyped-def]
    """(S(y, w) - S(x, y))/(w - x), S(x, y) = `difference_of_sinc` of x, y, with h1 = y - x and h2 = w - y.

    Near 0 it is a sum of second differences in the squares of the arguments, elsewhere the difference of quotients.
    """
    p, q, gap = x + y, y + w, h1 + h2
    by_sums, by_gaps = second_differences(p * p - CENTER, q * q - CENTER, h1 * h1 - CENTER, h2 * h2 - CENTER)
    near = (p + q) * by_sums + (h2 - h1) * by_gaps
    of_sums = (cos(0.5 * (p + q)) * sinc(0.5 * gap) - sinc(p)) / q
    of_gaps = (h2 - h1) * sinc_in_square(h1, h2)
    far = ((of_sums - of_gaps) / w - (sinc(p) - sinc(h1)) / (x * w)) / (4.0 * y)
    sums = (fabs(p) <= MAX_ARGUMENT) & (fabs(q) <= MAX_ARGUMENT)
    return choose(sums & (fabs(h1) <= MAX_ARGUMENT) & (fabs(h2) <= MAX_ARGUMENT), near, far)
