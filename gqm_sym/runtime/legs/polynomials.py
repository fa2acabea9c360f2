"""Polynomials on a panel: from values at Chebyshev nodes to coefficients, running means, and proven changes of sign.

The nodes are those of the first kind, so that no sum ever asks for a function at a panel's ends: one of them may be a
cusp, or the end of the domain. ``x`` runs from -1 at the end where the panel begins to 1.
"""

from math import cos, fabs, fsum, pi, sin

import numpy as np

from gqm_sym.runtime.arithmetic.matrices import largest, multiply, span
from gqm_sym.runtime.compiled.intrinsics import fma
from gqm_sym.runtime.compiled.jit import Inner

# With the panel's end these fill three registers.
COUNT = 23


def _tables() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The nodes as shares of the panel, the matrices of running means, and that of Chebyshev coefficients.

    In whole numbers, and rounded at the end: an error of some roundings here would be one of every integral.
    """
    quarter = [
        sin(0.5 * pi * m / COUNT) if 2 * m <= COUNT else cos(0.5 * pi * (COUNT - m) / COUNT) for m in range(COUNT)
    ]
    quarter.append(1.0)
    wave = [*quarter, *quarter[-2::-1]]
    sines = np.array([*wave, *(-value for value in wave[1:-1])])  # sin(pi m / (2 COUNT))
    degree, odd = np.arange(COUNT), 2 * np.arange(COUNT) + 1
    shares = np.array([sin(0.25 * pi * m / COUNT) ** 2 for m in odd])
    # T_k at node j, with x = -cos(angle).
    at_nodes = (-1.0) ** degree[:, None] * sines[(np.outer(degree, odd) + COUNT) % (4 * COUNT)]
    coefficients = at_nodes * (2.0 / COUNT)
    coefficients[0] *= 0.5
    one = 1 << 240

    def both_means(share: float) -> tuple[list[float], list[float]]:
        """Means of all T_k over [0, y], y a share of the panel, by the measures dy and d(y**2)."""
        top, bottom = share.as_integer_ratio()
        y = one // bottom * top
        values = [one, 2 * y - one]  # T_(k+1) = (4 y - 2) T_k - T_(k-1)
        for _ in range(COUNT):
            values.append((4 * y - 2 * one) * values[-1] // one - values[-2])
        from_start = [value - (-1) ** k * one for k, value in enumerate(values)]
        areas = [y, y * y // one - y]
        areas += [(from_start[k + 1] // (k + 1) - from_start[k - 1] // (k - 1)) // 4 for k in range(2, COUNT + 1)]
        # y T_k = T_k/2 + (T_(k+1) + T_(k-1))/4, with T_(-1) = T_1.
        moments = [(2 * areas[k] + areas[k + 1] + areas[abs(k - 1)]) // 4 for k in range(COUNT)]
        return [area / y for area in areas[:COUNT]], [2 * moment * one / (y * y) for moment in moments]

    means, graded = (np.array(rows) for rows in zip(*map(both_means, (*shares.tolist(), 1.0)), strict=True))
    times = [[fsum(row * column) for column in coefficients.T] for row in means]
    graded_times = [[fsum(row * column) for column in coefficients.T] for row in graded]
    return shares, np.array(times), np.array(graded_times), coefficients


# Node j lies at ``SHARES[j]`` of the panel. Row j of ``MEANS`` gives the mean from the panel's start to that node, the
# last row that over the whole panel; ``GRADED_MEANS`` those with respect to the square of the share.
SHARES, MEANS, GRADED_MEANS, TO_COEFFICIENTS = _tables()

# A row of values at the nodes is padded to whole registers, behind them the panel's end; so are what tables make of it.
WIDE = 24
ENDS_BY_NODE = np.pad(np.append(SHARES, 1.0), (0, WIDE - COUNT - 1))
to_means, to_graded_means, to_coefficients = (multiply(table.T) for table in (MEANS, GRADED_MEANS, TO_COEFFICIENTS))

# Coefficients that tell how well a function is resolved, three at the end and three in the middle; the mean over
# the panel.
LAST, MIDDLE = slice(COUNT - 3, COUNT), slice(14, 17)
to_tails = multiply(np.vstack([TO_COEFFICIENTS[LAST], TO_COEFFICIENTS[MIDDLE], MEANS[COUNT]]).T)
extent, size_of = span(COUNT), largest(COUNT)

# A polynomial on the panel is nowhere further from a number than this many times its values at the nodes.
LEBESGUE = 3.0

# How finely a panel is searched for a change of sign that bounds cannot settle.
FINEST = 2.0**-30

# Where a search keeps the part it looks at, what that is told from, and the ends of parts that wait.
PART, TWICE, ABOVE, BELOW, WAITING = range(0, 5 * WIDE, WIDE)
ROOM = WAITING + 64

# The last step of Newton's method for a zero in [-1, 1]: the next would be of the size of its square.
NEWTON = 1e-9


@Inner
def _at_ends(c):  # type: ignore[no-untyped-def]
    """The series at -1 and at 1."""
    even, odd = c[0], 0.0
    for k in range(1, COUNT - 1, 2):
        odd += c[k]
        even += c[k + 1]
    return even - odd, even + odd


@Inner
def _restrict(c, lo, hi, room):  # type: ignore[no-untyped-def]
    """The series' coefficients on [lo, hi] alone, at ``room[PART]``."""
    for j in range(WIDE):
        room[TWICE + j] = 2.0 * (lo + (hi - lo) * ENDS_BY_NODE[j])
        room[ABOVE + j], room[BELOW + j] = 0.0, 0.0
    for k in range(COUNT - 1, 0, -1):
        term = c[k]
        for j in range(WIDE):
            before = room[ABOVE + j]
            room[ABOVE + j], room[BELOW + j] = term + room[TWICE + j] * before - room[BELOW + j], before
    for j in range(WIDE):
        room[TWICE + j] = c[0] + 0.5 * room[TWICE + j] * room[ABOVE + j] - room[BELOW + j]
    to_coefficients(room, TWICE, room, PART)


@Inner
def _is_monotone(c):  # type: ignore[no-untyped-def]
    """Whether bounds prove that the series rises or falls throughout."""
    # The derivative's coefficients, from the last one down; two apart they build on each other.
    second, first, rest = 0.0, 0.0, 0.0
    for k in range(c.size - 1, 0, -1):
        second, first = first, second + 2.0 * k * c[k]
        if k > 1:
            rest += fabs(first)
    return fabs(0.5 * first) > rest


@Inner
def _sum_and_slope(c, x):  # type: ignore[no-untyped-def]
    """The series and its derivative at x."""
    high, low, steep, flat = 0.0, 0.0, 0.0, 0.0
    twice = 2.0 * x
    for k in range(COUNT - 1, 0, -1):
        steep, flat = fma(twice, steep, fma(2.0, high, -flat)), steep
        high, low = fma(twice, high, c[k] - low), high
    return fma(x, high, c[0] - low), high + fma(x, steep, -flat)


@Inner
def _crossing(c, low, high):  # type: ignore[no-untyped-def]
    """The zero of a monotone series that goes from ``low`` to ``high``, by Newton's method inside a bracket."""
    lo, hi, rising = -1.0, 1.0, high > 0.0
    x = lo + (hi - lo) * (low / (low - high))
    for _ in range(60):
        value, slope = _sum_and_slope(c, x)
        if value == 0.0:
            return x
        if (value > 0.0) == rising:
            hi = x
        else:
            lo = x
        new = x - value / slope
        if not lo <= new <= hi:
            new = 0.5 * (lo + hi)
        if fabs(new - x) <= NEWTON or hi - lo <= 2e-16:
            return new
        x = new
    return x


@Inner
def first_change(c, sign, noise):  # type: ignore[no-untyped-def]
    """The first place in [-1, 1] where a series takes the other sign; none is missed.

    The panel is halved until bounds by the coefficients prove one sign, or a monotone run. A part where the series is
    nothing but ``noise`` has no sign of its own: zero touched without a change of sign is no change.

    Parameters
    ----------
    sign : int
        The sign it starts with; 0 to take its first definite one.

    Returns
    -------
    x : float
        Where it changes sign; 2 if it does not.
    before : int
        The sign it starts with.
    touch : float
        The first place before ``x`` where it is no more than noise and does not run through; 2 if there is none.
    """
    part, room, lo, hi, waiting, halved = c, c, -1.0, 1.0, 0, False
    before, unsure, touch = sign, 2.0, 2.0
    while True:
        spread = 0.0
        for k in range(1, COUNT):
            spread += fabs(part[k])
        if fabs(part[0]) > spread + noise:
            found = 1 if part[0] > 0.0 else -1
            if before == 0:
                before = found
            if found != before:
                return (lo if unsure > 1.0 else 0.5 * (unsure + lo)), before, touch
            unsure = 2.0
        elif fabs(part[0]) + spread > noise and _is_monotone(part):
            left, right = _at_ends(part)
            if before == 0:
                before = 0 if fabs(left) <= noise else (1 if left > 0.0 else -1)
            if fabs(right) > noise:
                found = 1 if right > 0.0 else -1
                if before == 0:
                    before = found
                if found != before:
                    if left * found >= 0.0:
                        return lo, before, touch
                    return lo + 0.5 * (hi - lo) * (1.0 + _crossing(part, left, right)), before, touch
                unsure = 2.0
        elif fabs(part[0]) + spread <= noise or hi - lo <= FINEST:
            if unsure > 1.0:
                unsure = lo
            if touch > 1.0:
                touch = lo
        else:
            if not halved:
                room, halved = np.empty(ROOM), True
                part = room[PART : PART + COUNT]
            room[WAITING + waiting] = hi
            waiting += 1
            hi = 0.5 * (lo + hi)
            _restrict(c, lo, hi, room)
            continue
        if waiting == 0:
            return 2.0, before, touch
        lo, hi = hi, room[WAITING + waiting - 1]
        waiting -= 1
        _restrict(c, lo, hi, room)
