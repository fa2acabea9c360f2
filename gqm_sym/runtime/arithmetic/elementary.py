"""Sines, cosines, arc tangents and exponentials that vectorise.

numba calls the C library for ``math.sin``, one number at a time, so a loop over it is not vectorised. The functions
here are polynomials of a reduced argument without branches; LLVM inlines them into a loop and vectorises it.

The argument is reduced by a multiple of pi/2 (or log 2) that is held in parts (Cody and Waite, Software Manual for the
Elementary Functions, 1980), and the rounding error of the reduction is kept in a second double. The error is below one
unit in the last place, for sin and cos if ``|x|`` < 1e9; for larger arguments the result is the sine or cosine of
``x*(1 + eps)``, where eps is a few roundings. All functions give NaN for NaN. At infinities sin and cos give NaN, and
the others their limits.
"""

from math import fabs, factorial, inf, pi, sqrt

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.compiled.intrinsics import bits, choose, fma, from_bits, polynomial
from gqm_sym.runtime.compiled.jit import Inlined, Inner

# Adding this constant rounds a number to an integer, which the lowest bits of the sum then contain.
ROUND = 1.5 * 2.0**52

# pi/2 as the sum of three doubles. The first difference of the reduction is exact, since its product is fused.
HALF_PI = (1.5707963267948966, 6.123233995736766e-17, -1.4973849048591833e-33)
TWO_OVER_PI = 0.6366197723675814

# Minimax polynomials on |r| <= pi/4, highest power first: (1 - sin(r)/r)/r**2, (cos(r) - 1 + r**2/2)/r**4.
# The coefficients are those of fdlibm (Sun Microsystems, 1993: k_sin.c, k_cos.c).
SINE = (
    -1.58969099521155010221e-10,
    2.50507602534068634195e-08,
    -2.75573137070700676789e-06,
    1.98412698298579493134e-04,
    -8.33333333332248946124e-03,
    1.66666666666666324348e-01,
)
COSINE = (
    -1.13596475577881948265e-11,
    2.08757232129817482790e-09,
    -2.75573143513906633035e-07,
    2.48015872894767294178e-05,
    -1.38888888888741095749e-03,
    4.16666666666666019037e-02,
)

# (atan(z)/z - 1)/z**2 in z**2 for |z| <= 1/2, highest power first, interpolated at Chebyshev points: within 2e-19.
ARC = (
    0.007652045927107981,
    -0.02167557997633693,
    0.0339817401335798,
    -0.04183153509507902,
    0.04729905909510015,
    -0.052587105453942753,
    0.05881912329940347,
    -0.06666636006378054,
    0.07692306236122758,
    -0.09090909045918692,
    0.11111111110275738,
    -0.1428571428570617,
    0.19999999999999968,
    -0.3333333333333333,
)

# The arc tangent is taken of -1/x beyond MIN_INVERTED, of (x - 1)/(x + 1) from MAX_DIRECT on, and of x itself below.
# Beyond MAX_ARGUMENT it is pi/2 to the last bit.
MIN_INVERTED, MAX_DIRECT, MAX_ARGUMENT = 2.0, 0.5, 2.0**60

# (exp(r) - 1 - r)/r**2 for |r| <= log(2)/2, highest power first, interpolated at Chebyshev points: within 4e-19 of exp.
EXPONENTIAL = (
    2.091467944897855e-09,
    2.5105206475334834e-08,
    2.7557273661174726e-07,
    2.75572554255029e-06,
    2.4801587325533502e-05,
    0.00019841269874800683,
    0.0013888888888883752,
    0.008333333333326141,
    0.04166666666666667,
    0.1666666666666667,
    0.5,
)

# log 2 as the sum of two doubles. The first ends in zeros, so that its product with an integer below 2**11 is exact.
LOG2, LOG2_LOW, ONE_OVER_LOG2 = 0.6931471803691238, 1.9082149292705877e-10, 1.4426950408889634

# (log(m) - f + f**2/2)/s - f**2/2 in s**2 without its factor s**2, where m = 1 + f, s = f/(2 + f) and m is between
# sqrt(1/2) and sqrt(2), highest power first. The coefficients are those of fdlibm (Sun Microsystems, 1993: s_log1p.c).
LOGARITHM = (
    1.479819860511658591e-01,
    1.531383769920937332e-01,
    1.818357216161805012e-01,
    2.222219843214978396e-01,
    2.857142874366239149e-01,
    3.999999999940941908e-01,
    6.666666666666735130e-01,
)
ROOT_HALF_BITS = 0x3FE6A09E667F3BCD

# Beyond MAX_EXPONENT exp overflows or underflows; beyond MAX_HYPERBOLIC sinh and cosh overflow.
MAX_EXPONENT, MAX_HYPERBOLIC = 1000.0, 710.4758600739439

# Beyond this value sinh and cosh have the same double or neighbouring ones.
LARGE_SINH = 1e9

# Below this argument exp is less than half an ulp of 1.
NEGLIGIBLE_EXPONENT = -45.0

# (sinh(x) - x)/x**3 in powers of x**2 for |x| <= 1; the omitted terms are below 1e-19.
SINHC = tuple(1.0 / factorial(2 * k + 1) for k in reversed(range(1, 10)))


@Inlined
def reduced(x):  # type: ignore[no-untyped-def]
    """Return the number of quarter turns in x, modulo 4; the remainder r of x; and the rounding error by which r is too
    large.
    """
    shifted = fma(x, TWO_OVER_PI, ROUND)
    k = shifted - ROUND
    t = fma(-k, HALF_PI[0], x)
    p = k * HALF_PI[1]
    r = t - p  # the rounding error of this is a double, since t is a multiple of 2**-53 or p is zero
    over = fma(k, HALF_PI[2], fma(k, HALF_PI[1], -p)) - ((t - r) - p)
    lost = fabs(r) > 1.0  # beyond 1e15 the number of turns is not known to 1
    return bits(shifted), choose(lost, 1.0, r), choose(lost, 0.0, over)


@Inlined
def sine_kernel(r, over):  # type: ignore[no-untyped-def]
    """sin(r - over), ``|r|`` <= pi/4."""
    z = r * r
    return r - fma(z * r, polynomial(SINE, z), fma(-0.5, z, 1.0) * over)


@Inlined
def cosine_kernel(r, over):  # type: ignore[no-untyped-def]
    """cos(r - over), ``|r|`` <= pi/4."""
    z = r * r
    lead = fma(-0.5, z, 1.0)
    low = fma(r, over, fma(-0.5, z, 1.0 - lead))
    return lead + fma(z * z, polynomial(COSINE, z), low)


@Inlined
def sin(x):  # type: ignore[no-untyped-def]
    """Return the sine."""
    turns, r, over = reduced(x)
    value = choose(turns & 1 == 1, cosine_kernel(r, over), sine_kernel(r, over))
    return choose(turns & 2 == 2, -value, value)


@Inlined
def cos(x):  # type: ignore[no-untyped-def]
    """Return the cosine."""
    turns, r, over = reduced(x)
    value = choose(turns & 1 == 1, sine_kernel(r, over), cosine_kernel(r, over))
    return choose((turns + 1) & 2 == 2, -value, value)


@Inlined
def square_beside_quarter_turns(x):  # type: ignore[no-untyped-def]
    """Return whether an angle from 0 to pi/2 is nearer to pi/2, and the square of the sine of its distance from the
    nearer of both: sin(x)**2 or cos(x)**2, the smaller one.
    """
    turns, r, over = reduced(x)
    root = sine_kernel(r, over)
    return turns & 1 == 1, root * root


@Inlined
def reduced_sum(phase, rate, middle, middle_low, offset):  # type: ignore[no-untyped-def]
    """Return what `reduced` would for ``phase + rate*(middle + middle_low + offset)`` if that were computed exactly.

    The argument is formed in two doubles, so that its rounding errors do not count.
    """
    place, place_low = two_sum(middle, offset)
    product = rate * place
    total, total_low = two_sum(phase, product)
    turns, r, over = reduced(total)
    r, r_low = two_sum(r, fma(rate, middle_low + place_low, fma(rate, place, -product)) + total_low)
    return turns, r, over - r_low


@Inlined
def sin_of_sum(phase, rate, middle, middle_low, offset):  # type: ignore[no-untyped-def]
    """The sine of ``phase + rate*(middle + middle_low + offset)``."""
    turns, r, over = reduced_sum(phase, rate, middle, middle_low, offset)
    value = choose(turns & 1 == 1, cosine_kernel(r, over), sine_kernel(r, over))
    return choose(turns & 2 == 2, -value, value)


@Inlined
def cos_of_sum(phase, rate, middle, middle_low, offset):  # type: ignore[no-untyped-def]
    """The cosine of ``phase + rate*(middle + middle_low + offset)``."""
    turns, r, over = reduced_sum(phase, rate, middle, middle_low, offset)
    value = choose(turns & 1 == 1, sine_kernel(r, over), cosine_kernel(r, over))
    return choose((turns + 1) & 2 == 2, -value, value)


@Inlined
def atan(x):  # type: ignore[no-untyped-def]
    """Return the arc tangent, by that of -1/x where x is large and that of (x - 1)/(x + 1) where x is near 1."""
    size = choose(fabs(x) > MAX_ARGUMENT, MAX_ARGUMENT, fabs(x))
    far, near = size > MIN_INVERTED, size <= MAX_DIRECT
    more = size + 1.0
    top = choose(far, -1.0, choose(near, size, size - 1.0))
    bottom = choose(far, size, choose(near, 1.0, more))
    lost = choose(far | near, 0.0, choose(size > 1.0, 1.0 - (more - size), size - (more - 1.0)))
    inverse = 1.0 / bottom
    z = top * inverse
    low = (fma(-z, bottom, top) - z * lost) * inverse  # the rounding error of the quotient
    start = choose(far, 1.0, choose(near, 0.0, 0.5))
    lead = start * HALF_PI[0] + z
    rounded = (start * HALF_PI[0] - lead) + z
    w = z * z
    value = lead + (rounded + fma(z * w, polynomial(ARC, w), fma(start, HALF_PI[1], low)))
    return choose(x < 0.0, -value, choose(x == 0.0, x, value))


@Inlined
def atan2(y, x):  # type: ignore[no-untyped-def]
    """Return the angle from the first axis to the direction (x, y), between -pi and pi; 0 if both are 0.

    Its error is below two units in the last place.
    """
    steep = fabs(y) > fabs(x)
    below = choose(steep, y, x)
    ratio = choose(steep, -x, y) / choose(below == 0.0, 1.0, below)
    turns = choose(steep, 1.0, choose(x < 0.0, 2.0, 0.0))
    turns = choose(y < 0.0, -turns, turns)
    return turns * HALF_PI[0] + (atan(ratio) + turns * HALF_PI[1])


@Inlined
def scaled_exp(x):  # type: ignore[no-untyped-def]
    """exp(x) = (lead + low)*2**k for ``|x| <= MAX_EXPONENT``; the bits of k are those that `power_of_two` takes."""
    shifted = fma(x, ONE_OVER_LOG2, ROUND)
    k = shifted - ROUND
    high, low = fma(-k, LOG2, x), -k * LOG2_LOW
    r = high + low
    lost = low - (r - high)
    tail = fma(polynomial(EXPONENTIAL, r), r * r, lost)
    lead = 1.0 + r
    return lead, (r - (lead - 1.0)) + tail, bits(shifted)


@Inlined
def power_of_two(k):  # type: ignore[no-untyped-def]
    """2**k where that is a normal number; only the lowest twelve bits of k are read."""
    return from_bits((k + 1023) << 52)


@Inlined
def exp(x):  # type: ignore[no-untyped-def]
    """Return the exponential; subnormal results are rounded twice."""
    below = choose(x > MAX_EXPONENT, MAX_EXPONENT, x)
    lead, low, k = scaled_exp(choose(below < -MAX_EXPONENT, -MAX_EXPONENT, below))
    half = k >> 1
    return (lead + low) * power_of_two(half) * power_of_two(k - half)


@Inlined
def expm1_below(x):  # type: ignore[no-untyped-def]
    """exp(x) - 1 for x <= 0, without cancellation next to zero."""
    lead, low, k = scaled_exp(choose(x < NEGLIGIBLE_EXPONENT, NEGLIGIBLE_EXPONENT, x))
    return ((lead - power_of_two(-k)) + low) * power_of_two(k)


@Inlined
def half_exp(x):  # type: ignore[no-untyped-def]
    """exp(x)/2 and exp(-x)/2 for ``0 <= x <= MAX_HYPERBOLIC``, the first as two doubles."""
    lead, low, k = scaled_exp(x)
    high = lead + low
    scale = power_of_two(k - 2)
    return 2.0 * (high * scale), 2.0 * ((low - (high - lead)) * scale), 0.125 / (high * scale)


@Inlined
def cosh(x):  # type: ignore[no-untyped-def]
    """Return the hyperbolic cosine."""
    size = fabs(x)
    up, low, down = half_exp(choose(size > MAX_HYPERBOLIC, MAX_HYPERBOLIC, size))
    return choose(size > MAX_HYPERBOLIC, inf, up + (down + low))


@Inlined
def sinh(x):  # type: ignore[no-untyped-def]
    """Return the hyperbolic sine."""
    size = fabs(x)
    up, low, down = half_exp(choose(size > MAX_HYPERBOLIC, MAX_HYPERBOLIC, size))
    far = choose(size > MAX_HYPERBOLIC, inf, up - (down - low))
    return choose(size < 1.0, fma(x * (x * x), polynomial(SINHC, x * x), x), choose(x < 0.0, -far, far))


@Inlined
def sinh_of_ratio(above, x, below):  # type: ignore[no-untyped-def]
    """The hyperbolic sine of ``above*x/below``, without the roundings of this argument."""
    product = above * x
    ratio = product / below
    rest = (fma(-ratio, below, product) + fma(above, x, -product)) / below
    value = sinh(ratio)
    size = fabs(value)
    slope = choose(size < LARGE_SINH, sqrt(fma(value, value, 1.0)), size)
    return fma(rest, slope, value)


@Inlined
def tanh(x):  # type: ignore[no-untyped-def]
    """Return the hyperbolic tangent, -e/(2 + e) with e = exp(-2*abs(x)) - 1 as two doubles."""
    falling = -2.0 * fabs(x)
    lead, low, k = scaled_exp(choose(falling < NEGLIGIBLE_EXPONENT, NEGLIGIBLE_EXPONENT, falling))
    unit, scale = power_of_two(-k), power_of_two(k)
    gap = lead - unit
    lost = low + (lead - (gap + unit))
    total = gap + lost
    high, rest = total * scale, (lost - (total - gap)) * scale
    below = 2.0 + high
    value = -high / below
    error = fma(value, below, high) + (rest + value * ((high - (below - 2.0)) + rest))
    value -= error / below
    return choose(x < 0.0, -value, choose(x == 0.0, x, value))


@Inlined
def log1p(x):  # type: ignore[no-untyped-def]
    """Return log(1 + x) for x >= 0."""
    whole = 1.0 + x
    lost = choose(x < 1.0, x - (whole - 1.0), 1.0 - (whole - x))
    k = (bits(whole) - ROOT_HALF_BITS) >> 52
    f = from_bits(bits(whole) - (k << 52)) - 1.0
    s, half, n = f / (2.0 + f), 0.5 * f * f, float(k)
    rest = s * (half + (s * s) * polynomial(LOGARITHM, s * s))
    value = fma(n, LOG2, f - (half - (rest + fma(n, LOG2_LOW, lost / whole))))
    return choose(whole < inf, value, x)


# Half the bits of a number, subtracted from this constant, are the bits of its inverse square root within 4 %
# (Robertson, A Brief History of InvSqrt, 2012).
ROOT_BITS = 0x5FE6EB50C7B537A9


@Inlined
def inverse_root(x):  # type: ignore[no-untyped-def]
    """Return 1/sqrt(x) for normal numbers ``x > 0`` by Halley's and Newton's methods, because divisions and roots take
    longer.
    """
    y = from_bits(ROOT_BITS - (bits(x) >> 1))
    for _ in range(2):
        left = fma(-(x * y), y, 1.0)
        y = fma(y * left, fma(0.375, left, 0.5), y)
    return fma(0.5 * y, fma(-(x * y), y, 1.0), y)


# 2 pi as the sum of two doubles, and the Taylor coefficients of sin(2 pi g) from g**3 on. The omitted terms are below
# 2e-18 at g = 1/4.
ONE_TURN, ONE_TURN_LOW = 2.0 * pi, 2.4492935982947064e-16
TURN_SINE_SERIES = tuple((-1.0) ** k * ONE_TURN ** (2 * k + 1) / factorial(2 * k + 1) for k in reversed(range(1, 12)))


@Inner
def turn_sine(g, low):  # type: ignore[no-untyped-def]
    """sin(2 pi (g + low)) for ``|g|`` <= 1/4 and ``low`` of the size of its rounding error."""
    z = g * g
    slope = fma(fma(64.9, z, -19.7), z, 1.0)  # of the sine, accurate enough for a rounding error
    tail = 0.0
    for c in TURN_SINE_SERIES:
        tail = fma(tail, z, c)
    lead = ONE_TURN * g
    return lead + fma(tail, z * g, fma(ONE_TURN, g, -lead) + fma(ONE_TURN_LOW, g, ONE_TURN * slope * low))


@Inner
def turn_cosine(f, low):  # type: ignore[no-untyped-def]
    """cos(2 pi (f + low)) for ``|f|`` <= 1/2 and ``low`` of the size of its rounding error."""
    g = 0.25 - fabs(f)
    lost = (0.25 - g) - fabs(f)
    return turn_sine(g, lost + (low if f < 0.0 else -low))
