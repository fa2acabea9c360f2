"""Polynomials on a panel, given by values at Chebyshev nodes: their coefficients, running means, and proved changes of
sign.

The nodes are those of the first kind, so that no function is ever needed at a panel's ends, one of which may be a cusp
or the end of the domain. ``x`` runs from -1 at the beginning of the panel to 1 at its end.
"""

from functools import cache
from math import cos, fabs, fsum, inf, pi, sin

import numpy as np

from gqm_sym.runtime.arithmetic.matrices import largest, multiply, span
from gqm_sym.runtime.compiled.intrinsics import fma
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import on_stack, over_rows
from gqm_sym.runtime.compiled.series_rows import series_rows
from gqm_sym.runtime.compiled.types import Array

# The number of nodes; together with the panel's end they fill three registers.
COUNT = 23

# The number of binary places of the tables in fixed-point arithmetic, and pi in it.
BITS = 240
PI = 31415926535897932384626433832795028841971693993751058209749445923078164062862 * (1 << BITS) // 10**76


def share_at_angle(angle: int) -> int:
    """Return ``sin(angle/2)**2`` in fixed-point arithmetic."""
    square = angle**2 >> BITS
    total, term, n = 0, square // 2, 2
    while term:
        total, term, n = total + term, -(term * square >> BITS) // ((n + 1) * (n + 2)), n + 2
    return total // 2


def node(m: int, nodes: int) -> int:
    """Return ``sin(pi m/(4 nodes))**2`` in fixed-point arithmetic, because an error of the nodes would be one of every
    turning point.
    """
    return share_at_angle(PI * m // (2 * nodes))


@cache
def tables(nodes: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return ``nodes`` nodes as shares of the panel, the matrices of running means, and that of Chebyshev coefficients.

    They are computed in integers and rounded at the end, because an error here would be one of every integral.
    """
    quarter = [
        sin(0.5 * pi * m / nodes) if 2 * m <= nodes else cos(0.5 * pi * (nodes - m) / nodes) for m in range(nodes)
    ]
    quarter.append(1.0)
    wave = [*quarter, *quarter[-2::-1]]
    sines = np.array([*wave, *(-value for value in wave[1:-1])])  # sin(pi m / (2 nodes))
    degree, odd = np.arange(nodes), 2 * np.arange(nodes) + 1
    shares = np.array([node(m, nodes) / (1 << BITS) for m in odd.tolist()])
    # T_k at node j, with x = -cos(angle).
    at_nodes = (-1.0) ** degree[:, None] * sines[(np.outer(degree, odd) + nodes) % (4 * nodes)]
    coefficients = at_nodes * (2.0 / nodes)
    coefficients[0] *= 0.5
    one = 1 << BITS

    def both_means(share: float) -> tuple[list[float], list[float]]:
        """Return the means of all T_k over [0, y], where y is a share of the panel, with the measures dy and
        d(y**2).
        """
        top, bottom = share.as_integer_ratio()
        y = one // bottom * top
        values = [one, 2 * y - one]  # T_(k+1) = (4 y - 2) T_k - T_(k-1)
        for _ in range(nodes):
            values.append((4 * y - 2 * one) * values[-1] // one - values[-2])
        from_start = [value - (-1) ** k * one for k, value in enumerate(values)]
        areas = [y, y * y // one - y]
        areas += [(from_start[k + 1] // (k + 1) - from_start[k - 1] // (k - 1)) // 4 for k in range(2, nodes + 1)]
        # y T_k = T_k/2 + (T_(k+1) + T_(k-1))/4, with T_(-1) = T_1.
        moments = [(2 * areas[k] + areas[k + 1] + areas[abs(k - 1)]) // 4 for k in range(nodes)]
        return [area / y for area in areas[:nodes]], [2 * moment * one / (y * y) for moment in moments]

    means, graded = (np.array(rows) for rows in zip(*map(both_means, (*shares.tolist(), 1.0)), strict=True))
    times = [[fsum(row * column) for column in coefficients.T] for row in means]
    graded_times = [[fsum(row * column) for column in coefficients.T] for row in graded]
    return shares, np.array(times), np.array(graded_times), coefficients


# Node j lies at ``SHARES[j]`` of the panel. Row j of ``MEANS`` gives the mean from the panel's start to that node, the
# last row that over the whole panel; ``GRADED_MEANS`` those with respect to the square of the share.
SHARES, MEANS, GRADED_MEANS, TO_COEFFICIENTS = tables(COUNT)

# A row has the values at the nodes and one at the panel's end, which makes its length a multiple of a register.
WIDE = 24
ENDS_BY_NODE = np.pad(np.append(SHARES, 1.0), (0, WIDE - COUNT - 1))
to_means, to_graded_means, to_coefficients = (multiply(table.T) for table in (MEANS, GRADED_MEANS, TO_COEFFICIENTS))

# The coefficients that show how well a function is resolved, three at the end and three in the middle; `to_tails` also
# gives the mean over the panel.
LAST, MIDDLE = slice(COUNT - 3, COUNT), slice(14, 17)
to_tails = multiply(np.vstack([TO_COEFFICIENTS[LAST], TO_COEFFICIENTS[MIDDLE], MEANS[COUNT]]).T)
extent, size_of = span(COUNT), largest(COUNT)

# The same for WIDE values.
extent_of_block, size_of_block = span(WIDE), largest(WIDE)

# A bound on the Lebesgue constant: the polynomial nowhere differs from a number by more than this times the largest
# difference at the nodes.
LEBESGUE = 3.0

# The smallest part of a panel that is searched for a change of sign if bounds do not decide it.
MIN_PART = 2.0**-30

# A series that takes the sign it is to begin with before this place begins at its zero, which is known only so well.
AT_START = -1.0 + 1e-9

# Rows of the buffer of a search: the series on the part being searched, three rows of the Clenshaw recurrence by which
# it is found, and the ends of the parts still to be searched.
PART, TWICE_X, NEXT_SUM, SUM_AFTER, STACK = range(0, 5 * WIDE, WIDE)
search_buffer = on_stack(STACK + 64)

# A series at places.
series_at = series_rows(WIDE, COUNT)

next_sum_row = over_rows(lambda twice_x, next_sum, after, term: term + twice_x * next_sum - after, WIDE)
last_sum_row = over_rows(lambda twice_x, next_sum, after, term: term + 0.5 * twice_x * next_sum - after, WIDE)


def arrival_weights(nodes: int) -> Array:
    """Return the matrix with one column that gives the integral of f over ``y**-0.5 dy``, y from 0 to 1, from the
    values of f.
    """
    by_node = tables(nodes)[3]
    k = np.arange(len(by_node))
    return np.array([2.0 / (1.0 - 4.0 * k * k) @ by_node]).T


# Newton's method for a zero in [-1, 1] ends after a step this short, because the next one would be about its square.
LAST_STEP = 1e-9


# The conclusions from bounds of a series on a part of the panel (`_on_part`).
ONE_SIGN, TO_ZERO, OTHER_SIGN, CROSSES, ZERO, UNDECIDED = range(6)


@Inner
def _at_ends(c):  # type: ignore[no-untyped-def]
    """Return the series at -1 and at 1."""
    even, odd = c[0], 0.0
    for k in range(1, COUNT - 1, 2):
        odd += c[k]
        even += c[k + 1]
    return even - odd, even + odd


@Inner
def _restrict(c, lo, hi, buffer):  # type: ignore[no-untyped-def]
    """Fill ``buffer[PART]`` with the coefficients of the series on [lo, hi] alone."""
    for j in range(WIDE):
        buffer[TWICE_X + j] = 2.0 * (lo + (hi - lo) * ENDS_BY_NODE[j])
        buffer[NEXT_SUM + j], buffer[SUM_AFTER + j] = 0.0, 0.0
    for k in range(COUNT - 1, 0, -2):  # each sum replaces the last but one
        next_sum_row(buffer, SUM_AFTER, TWICE_X, NEXT_SUM, SUM_AFTER, c[k])
        next_sum_row(buffer, NEXT_SUM, TWICE_X, SUM_AFTER, NEXT_SUM, c[k - 1])
    last_sum_row(buffer, TWICE_X, TWICE_X, NEXT_SUM, SUM_AFTER, c[0])
    to_coefficients(buffer, TWICE_X, buffer, PART)


@Inner
def _is_monotone(c):  # type: ignore[no-untyped-def]
    """Return whether bounds of its derivative prove that the series is monotone."""
    # The derivative's coefficients are found from the last one down; each follows from the one two degrees higher.
    second, first, others = 0.0, 0.0, 0.0
    for k in range(c.size - 1, 0, -1):
        second, first = first, second + 2.0 * k * c[k]
        if k > 1:
            others += fabs(first)
    return fabs(0.5 * first) > others


@Inner
def sum_and_slope(c, x):  # type: ignore[no-untyped-def]
    """Return the series and its derivative at x."""
    value, value_after, slope, slope_after = 0.0, 0.0, 0.0, 0.0
    twice = 2.0 * x
    for k in range(c.size - 1, 0, -1):
        slope, slope_after = fma(twice, slope, fma(2.0, value, -slope_after)), slope
        value, value_after = fma(twice, value, c[k] - value_after), value
    return fma(x, value, c[0] - value_after), value + fma(x, slope, -slope_after)


@Inner
def _crossing(c, low, high):  # type: ignore[no-untyped-def]
    """Return the zero of a monotone series that changes from ``low`` to ``high``, by Newton's method inside a
    bracket.
    """
    lo, hi, rising = -1.0, 1.0, high > 0.0
    x = lo + (hi - lo) * (low / (low - high))
    for _ in range(60):
        value, slope = sum_and_slope(c, x)
        if value == 0.0:
            return x
        if (value > 0.0) == rising:
            hi = x
        else:
            lo = x
        new = x - value / slope
        if not lo <= new <= hi:
            new = 0.5 * (lo + hi)
        if fabs(new - x) <= LAST_STEP or hi - lo <= 2e-16:
            return new
        x = new
    return x


@Inner
def _sign(value, noise):  # type: ignore[no-untyped-def]
    """Return the sign of a number, or 0 if the number is within the noise."""
    return 0 if fabs(value) <= noise else (1 if value > 0.0 else -1)


@Inner
def _on_part(part, before, noise, smallest):  # type: ignore[no-untyped-def]
    """Return what bounds from the coefficients prove about the sign of a series on a part of the panel.

    Parameters
    ----------
    before : int
        The sign so far; 0 if none was definite.
    smallest : bool
        Whether the part must not be halved again.

    Returns
    -------
    verdict : int
        ONE_SIGN if the series has the sign so far up to its end; TO_ZERO if it does, but is within the noise at its
        end; OTHER_SIGN if it begins with the other sign; CROSSES if it changes from the sign so far to the other; ZERO
        if it is within the noise, undecided on a smallest part, or not known; else UNDECIDED.
    before : int
        The sign with which it starts, if it was not known before.
    x : float
        The place in [-1, 1] of the zero crossing; 2 if there is none.
    """
    spread = 0.0
    for k in range(1, COUNT):
        spread += fabs(part[k])
    if not fabs(part[0]) + spread < inf:  # such as beyond a turn, for a law that contains the root of V**2
        return ZERO, before, 2.0
    if fabs(part[0]) > spread + noise:
        found = 1 if part[0] > 0.0 else -1
        before = found if before == 0 else before
        return (ONE_SIGN if found == before else OTHER_SIGN), before, 2.0
    if fabs(part[0]) + spread > noise and _is_monotone(part):
        left, right = _at_ends(part)
        found_first, found = _sign(left, noise), _sign(right, noise)
        before = found_first if before == 0 else before
        if found_first != 0 and found_first != before:
            ended_before = found == before and _crossing(part, left, right) <= AT_START
            return (ONE_SIGN if ended_before else OTHER_SIGN), before, 2.0
        if found == 0:
            return TO_ZERO, before, 2.0
        before = found if before == 0 else before
        if found == before:
            return ONE_SIGN, before, 2.0
        return CROSSES, before, -1.0 if left * found >= 0.0 else _crossing(part, left, right)
    return (ZERO if fabs(part[0]) + spread <= noise or smallest else UNDECIDED), before, 2.0


@Inner
def first_change(c, sign, noise):  # type: ignore[no-untyped-def]
    """Find the first place in [-1, 1] where a series takes the other sign; none is missed.

    The panel is halved until bounds by the coefficients prove that the series has one sign or is monotone. On a part
    where the series is within the ``noise`` it has no sign, so that touching zero without a change of sign does not
    count.

    Parameters
    ----------
    c : array
        COUNT Chebyshev coefficients.
    sign : int
        The sign with which the series starts; 0 to take its first definite one.
    noise : float
        The size of errors of the series.

    Returns
    -------
    x : float
        The place at which it changes its sign; 2 if it does not.
    before : int
        The sign with which it starts.
    touch : float
        The first place before ``x`` where it is within the noise but is not proved to cross zero; 2 if there is none.
    """
    part, buffer, lo, hi, waiting, halved = c, c, -1.0, 1.0, 0, False
    before, zero_from, touch = sign, 2.0, 2.0
    while True:
        verdict, before, x = _on_part(part, before, noise, hi - lo <= MIN_PART)
        if verdict == CROSSES:
            return lo + 0.5 * (hi - lo) * (1.0 + x), before, touch
        if verdict == OTHER_SIGN:
            return (lo if zero_from > 1.0 else 0.5 * (zero_from + lo)), before, touch
        if verdict == ONE_SIGN:
            zero_from = 2.0
        elif verdict == ZERO:
            zero_from = lo if zero_from > 1.0 else zero_from
            touch = lo if touch > 1.0 else touch
        elif verdict == UNDECIDED:
            if not halved:
                buffer, halved = search_buffer(), True
                part = buffer[PART : PART + COUNT]
            buffer[STACK + waiting] = hi
            waiting += 1
            hi = 0.5 * (lo + hi)
            _restrict(c, lo, hi, buffer)
            continue
        if waiting == 0:
            return 2.0, before, touch
        lo, hi = hi, buffer[STACK + waiting - 1]
        waiting -= 1
        _restrict(c, lo, hi, buffer)
