"""V**2 and the time on a short part of the curve with friction in space, by rows of a single register.

A part between two joints of a sampled curve is so short that polynomials through 7 nodes resolve the law on it. With
the length L of the contact force per mass, the law is ``dW/dd = P - Q W - f L`` along the distance d. With an L that
changes evenly from its value at the start to about that at the end, W follows from integrals that are kept. From there
one step of Newton's method for the actual L leads to W with an error below rounding, because L depends on W almost
linearly; where it does not, the second derivative of L with respect to W is taken into account too. Bounds of all this
are tested, and longer parts have more nodes (`solving`).

Time is the integral of ``ds/sqrt(W)`` by a Gauss-Legendre rule with 8 nodes, from the polynomial W.
"""

from math import fabs, inf, nan, sqrt
from typing import NamedTuple

import numpy as np

from gqm_sym.runtime.arithmetic.matrices import largest, multiply, span
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import LANES, copied, on_stack, over_rows
from gqm_sym.runtime.legs.panels.equation import (
    AT_REST,
    DS,
    KAPPA,
    MIXED,
    N0,
    PLAIN_P,
    PLAIN_Q,
    RUBBING,
    SERIES,
    TURNING,
)
from gqm_sym.runtime.legs.panels.polynomials import COUNT, LEBESGUE, TO_COEFFICIENTS, size_of, tables, to_coefficients
from gqm_sym.runtime.legs.panels.resolution import ONE_SIGN_RATIO

# The number of nodes; together with the end of the part they fill a register.
FEW = LANES - 1

# With x from -1 to 1, the nodes and weights of the integral of time.
_HALF_OF_NODES = (0.9602898564975363, 0.7966664774136267, 0.525532409916329, 0.1834346424956498)
_HALF_OF_WEIGHTS = (0.10122853629037626, 0.22238103445337448, 0.31370664587788727, 0.362683783378362)
GAUSS_NODES = np.array([*(-x for x in _HALF_OF_NODES), *_HALF_OF_NODES[::-1]])
GAUSS_WEIGHTS = np.array([*_HALF_OF_WEIGHTS, *_HALF_OF_WEIGHTS[::-1]])


def _series_at(places: np.ndarray, terms: int) -> np.ndarray:
    """Return the matrix that gives a Chebyshev series with this number of terms at some places."""
    return np.polynomial.chebyshev.chebvander(places, terms - 1)


_SHARES, _MEANS, _, _FEW_COEFFICIENTS = tables(FEW)
ENDS = np.append(_SHARES, 1.0)

# From the values at the nodes of a panel: those at fewer nodes and at the end, and at the nodes of the integral of
# time. Higher terms, which are rounding errors, are left out.
to_few = multiply((_series_at(2.0 * ENDS - 1.0, FEW) @ TO_COEFFICIENTS[:FEW]).T)
to_few_gauss = multiply((_series_at(GAUSS_NODES, FEW) @ TO_COEFFICIENTS[:FEW]).T)

# From the values at few nodes: the integrals from the start in units of the width, the last two Chebyshev coefficients,
# slopes, and the values at the nodes of the integral of time; from the values there, the mean and the last two Legendre
# coefficients.
to_integrals = multiply((ENDS[:, None] * _MEANS).T)
to_last = multiply(_FEW_COEFFICIENTS[-2:].T)
to_slopes = multiply((_series_at(2.0 * ENDS - 1.0, FEW - 1) @ np.polynomial.chebyshev.chebder(_FEW_COEFFICIENTS)).T)
to_gauss = multiply((_series_at(GAUSS_NODES, FEW) @ _FEW_COEFFICIENTS).T)
_LEGENDRE = np.polynomial.legendre.legvander(GAUSS_NODES, FEW) * GAUSS_WEIGHTS[:, None]
to_mean = multiply(_LEGENDRE[:, [0, FEW - 1, FEW]] * (np.array([0, FEW - 1, FEW]) + 0.5))

copy = copied(LANES)
extent, size_of_few = span(LANES), largest(LANES)

# The rows that are kept of a part, with the distance y in units of its width: Q, f and y f; the integrals of exp(q) P,
# exp(q) f and exp(q) y f, and exp(q) - 1, all over exp(q); the coefficients of the square of L; and ds, times the
# width, at the nodes of the integral of time.
RESISTANCE, FRICTION, FRICTION_1, GAINED, RUBBED, RUBBED_1, LOST = range(0, 7 * LANES, LANES)
SQUARE, SQUARE_1, SQUARE_2, LENGTHS = range(7 * LANES, 11 * LANES, LANES)
ROOM_FOR_FEW = 11 * LANES

# Further rows: the increase of W; W; the square of L, and L; rates; q; cosh q and sinh q; values for integrals.
INCREASE, V2, SQUARED, LENGTH, RATE, EXPONENT, EVEN, ODD, TERM, CHANGE, LAST = range(11 * LANES, 22 * LANES, LANES)
few_buffer = on_stack(22 * LANES)

# The largest q, with which the terms left out of its exponential function are below rounding.
MAX_EXPONENT = 2.0**-5

# The largest last two coefficients of friction as shares of V**2, with which the integrals of those beyond are below
# rounding; and the largest ones of the rate of time as a share of its mean. Its integral is right up to twice the
# degree, and has an error of about the square of them.
MAX_TAIL_BEFORE, MAX_TAIL, MAX_TAIL_OF_RATE = 2.0**-34, 2.0**-41, 2.0**-20

# A bound, as a share of V**2, of several times the error of the solution.
NEGLIGIBLE = 2.0**-54

scaled_row = over_rows(lambda row, factor: factor * row, LANES)
even_row = over_rows(lambda q: 1.0 + (q * q) * (0.5 + (q * q) * (1.0 / 24.0 + (q * q) * (1.0 / 720.0))), LANES)
odd_row = over_rows(lambda q: q * (1.0 + (q * q) * (1.0 / 6.0 + (q * q) * (1.0 / 120.0))), LANES)
grown_row = over_rows(lambda term, even, odd: term * (even + odd), LANES)
decayed_row = over_rows(lambda term, even, odd: term * (even - odd), LANES)
lost_row = over_rows(lambda even, odd: (odd + (even - 1.0)) * (even - odd), LANES)
gained_row = over_rows(lambda gained, lost, v2: gained - v2 * lost, LANES)
increase_row = over_rows(
    lambda gained, rubbed, rubbed_1, length, more: gained - length * rubbed - more * rubbed_1, LANES
)
corrected_row = over_rows(lambda increase, change: increase - change, LANES)
v2_row = over_rows(lambda increase, v2: v2 + increase, LANES)
square_row = over_rows(lambda a, b, c, w: a + w * (b + w * c), LANES)
root_row = over_rows(np.sqrt, LANES)
slope_row = over_rows(lambda b, c, w, length: (0.5 * b + w * c) / length, LANES)
rate_row = over_rows(lambda q, f, slope: q + f * slope, LANES)
excess_row = over_rows(lambda f, f_1, length, begin, more: f * (length - begin) - more * f_1, LANES)
discriminant_row = over_rows(lambda a, b, c: a * c - 0.25 * (b * b), LANES)
bent_row = over_rows(
    lambda f, bend, length, change: 0.5 * f * bend * ((change * change) / (length * length * length)), LANES
)
time_rate_row = over_rows(lambda ds, w: ds / np.sqrt(w), LANES)


class Passed(NamedTuple):
    """A short part that a body has passed.

    Attributes
    ----------
    time : float
        The time on it; NaN if it has to be passed in another way.
    end, low, high : float
        V**2 at its end, and bounds of V**2.
    lost : float
        exp(q) - 1 at the end, where q contains the effect of V**2 on friction.
    least_square, most_square : float
        Bounds of the square of the contact force per mass.
    """

    time: float
    end: float
    low: float
    high: float
    lost: float
    least_square: float
    most_square: float


@Inner
def is_row_short(work, row, size):  # type: ignore[no-untyped-def]
    """Return whether few nodes resolve a row of a panel, apart from a rounding of ``size``."""
    to_coefficients(work, row, work, SERIES)
    tail = 0.0
    for k in range(FEW, COUNT):
        tail = max(tail, fabs(work[SERIES + k]))
    return tail <= ONE_SIGN_RATIO * size


@Inner
def is_law_short(width, work):  # type: ignore[no-untyped-def]
    """Return whether few nodes resolve the law on a panel, which has the rows of `solving.split_law`."""
    at_rest, turning = size_of(work, AT_REST), size_of(work, TURNING)
    force = max(size_of(work, PLAIN_P), sqrt(at_rest))
    if not (size_of(work, KAPPA) == 0.0 and work[N0] > 0.0):
        return False
    for row, size in (
        (PLAIN_P, force),
        (PLAIN_Q, 1.0 / width),
        (RUBBING, size_of(work, RUBBING)),
        (DS, size_of(work, DS)),
    ):
        if not is_row_short(work, row, size):
            return False
    # Only the share f of an error of L is one of the law.
    share = 1.0 / size_of(work, RUBBING)
    for row, size in ((AT_REST, at_rest), (MIXED, 2.0 * sqrt(at_rest * turning)), (TURNING, turning)):
        if not is_row_short(work, row, share * size):
            return False
    return True


@Inner
def exponentiate(few):  # type: ignore[no-untyped-def]
    """Fill the rows EVEN and ODD from the row EXPONENT; return whether that is small enough."""
    even_row(few, EVEN, EXPONENT)
    odd_row(few, ODD, EXPONENT)
    return size_of_few(few, EXPONENT) <= MAX_EXPONENT


@Inner
def keep_few(width, direction, work, gaps, at):  # type: ignore[no-untyped-def]
    """Keep the rows of a part from those of a panel, from ``gaps[at]`` on; return whether few nodes suffice."""
    if not is_law_short(width, work):
        return False
    few, h = few_buffer(), width * float(direction)
    for row, to in ((PLAIN_Q, RESISTANCE), (RUBBING, FRICTION), (PLAIN_P, TERM)):
        to_few(work, row, few, to)
        scaled_row(few, to, to, h)
    for row, to in ((AT_REST, SQUARE), (MIXED, SQUARE_1), (TURNING, SQUARE_2)):
        to_few(work, row, few, to)
    to_few_gauss(work, DS, few, LENGTHS)
    scaled_row(few, LENGTHS, LENGTHS, width)
    to_integrals(few, RESISTANCE, few, EXPONENT)
    if not exponentiate(few):
        return False
    lost_row(few, LOST, EVEN, ODD)
    for j in range(LANES):
        few[FRICTION_1 + j] = few[FRICTION + j] * ENDS[j]
    for row, to in ((TERM, GAINED), (FRICTION, RUBBED), (FRICTION_1, RUBBED_1)):
        grown_row(few, CHANGE, row, EVEN, ODD)
        to_integrals(few, CHANGE, few, to)
        decayed_row(few, to, to, EVEN, ODD)
    for row in range(0, ROOM_FOR_FEW, LANES):
        copy(gaps, at + row, few, row)
    return True


@Inner
def widened(low, high):  # type: ignore[no-untyped-def]
    """Return bounds of a polynomial whose values at the nodes are between two numbers."""
    beyond = 0.5 * (LEBESGUE - 1.0) * (high - low)
    return low - beyond, high + beyond


@Inner
def rises(few, row, sign):  # type: ignore[no-untyped-def]
    """Return whether the function with the sign ``sign`` is proved to increase all over the part."""
    to_slopes(few, row, few, TERM)
    low, high = extent(few, TERM)
    low, high = widened(low, high)
    return low > 0.0 if sign > 0.0 else high < 0.0


@Inner
def correct(v2, few):  # type: ignore[no-untyped-def]
    """Correct W, the row V2, for a term of the law that has been left out, the row TERM, and fill in the change."""
    grown_row(few, TERM, TERM, EVEN, ODD)
    to_integrals(few, TERM, few, CHANGE)
    decayed_row(few, CHANGE, CHANGE, EVEN, ODD)
    corrected_row(few, INCREASE, INCREASE, CHANGE)
    v2_row(few, V2, INCREASE, v2)


@Inner
def pass_few(v2, gaps, at, few):  # type: ignore[no-untyped-def]
    """Return the passage of a part, at whose start V**2 is ``v2``, by the rows kept from ``gaps[at]`` on; ``few`` is a
    `few_buffer`, and gets the rows V2 and SQUARED.
    """
    for row in range(0, ROOM_FOR_FEW, LANES):
        copy(few, row, gaps, at + row)
    length = sqrt(few[SQUARE] + v2 * (few[SQUARE_1] + v2 * few[SQUARE_2]))
    gained_row(few, INCREASE, GAINED, LOST, v2)
    w = v2 + (few[INCREASE + FEW] - length * few[RUBBED + FEW])
    more = sqrt(few[SQUARE + FEW] + w * (few[SQUARE_1 + FEW] + w * few[SQUARE_2 + FEW])) - length
    increase_row(few, INCREASE, INCREASE, RUBBED, RUBBED_1, length, more)
    v2_row(few, V2, INCREASE, v2)
    square_row(few, SQUARED, SQUARE, SQUARE_1, SQUARE_2, V2)
    root_row(few, LENGTH, SQUARED)
    slope_row(few, RATE, SQUARE_1, SQUARE_2, V2, LENGTH)
    rate_row(few, RATE, RESISTANCE, FRICTION, RATE)
    to_integrals(few, RATE, few, EXPONENT)
    is_small = exponentiate(few)
    excess_row(few, TERM, FRICTION, FRICTION_1, LENGTH, length, more)
    correct(v2, few)
    end, (low, high), change = few[V2 + FEW], extent(few, V2), size_of_few(few, CHANGE)
    to_last(few, TERM, few, LAST)
    is_short = fabs(few[LAST]) <= MAX_TAIL_BEFORE * low and fabs(few[LAST + 1]) <= MAX_TAIL * low
    # The second derivative of f L with respect to W, times L**3.
    bend = few[FRICTION + FEW] * (few[SQUARE + FEW] * few[SQUARE_2 + FEW] - 0.25 * few[SQUARE_1 + FEW] ** 2)
    left, allowed = bend * change * change, NEGLIGIBLE * end * few[SQUARED + FEW] * few[LENGTH + FEW]
    if is_small and is_short and left > allowed:
        discriminant_row(few, TERM, SQUARE, SQUARE_1, SQUARE_2)
        bent_row(few, TERM, FRICTION, TERM, LENGTH, CHANGE)
        correct(v2, few)
        end, (low, high) = few[V2 + FEW], extent(few, V2)
        # The third derivative is the second one times -3 dL/dW over L.
        left *= change * fabs(0.5 * few[SQUARE_1 + FEW] + w * few[SQUARE_2 + FEW]) / few[SQUARED + FEW]
    is_solved = is_small and left <= allowed
    if not (is_solved and is_short and low > 0.0):
        return Passed(nan, end, low, high, 0.0, 0.0, inf)
    to_gauss(few, V2, few, TERM)
    time_rate_row(few, RATE, LENGTHS, TERM)
    to_mean(few, RATE, few, LAST)
    is_resolved = max(fabs(few[LAST + 1]), fabs(few[LAST + 2])) <= MAX_TAIL_OF_RATE * few[LAST]
    low, high = widened(min(low, v2), max(high, v2))
    square_row(few, SQUARED, SQUARE, SQUARE_1, SQUARE_2, V2)
    least, most = extent(few, SQUARED)
    least, most = widened(min(least, length * length), max(most, length * length))
    lost = few[EVEN + FEW] - 1.0 + few[ODD + FEW]
    return Passed(few[LAST] if is_resolved else nan, end, low, high, lost, least, most)
