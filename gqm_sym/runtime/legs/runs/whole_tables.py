"""Products with constant matrices for legs from turn to turn as one polynomial (`whole_leg`).

A row has one value at each of 23, 47 or 71 Chebyshev nodes and one at the end of the leg, which makes its length a
number of *blocks* of `polynomials.WIDE` numbers: 1, 2 or 3. Rows are polynomials in the share y of the way, or in the
phase angle phi, where ``y = sin(phi/2)**2`` (IN_PHASE). Each product is a function ``f(form, values, at, out, to)``,
where the *form* is the number of blocks, plus IN_PHASE for rows in the phase angle.
"""

from collections.abc import Callable, Iterable
from functools import cache, partial
from math import fsum, isqrt, pi, sin
from typing import Any, NamedTuple

import numpy as np

from gqm_sym.runtime.arithmetic.matrices import multiply_one_of
from gqm_sym.runtime.compiled.jit import Inlined
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.legs.panels.polynomials import (
    BITS,
    COUNT,
    LAST,
    MIDDLE,
    PI,
    WIDE,
    arrival_weights,
    node,
    share_at_angle,
    tables,
)

# The largest number of blocks. Where more nodes would be needed, panels take less time.
MAX_BLOCKS = 3
BLOCKS = range(1, MAX_BLOCKS + 1)

# What is added to the number of blocks for rows in the share of the way, and for rows in the phase angle.
IN_SHARE, IN_PHASE = 0, MAX_BLOCKS

# The number of terms of the Taylor series at a leg's end.
TERMS = 6

# The nodes from the one in the middle of three whose coefficients are examined, by the number of blocks.
MIDDLE_DEGREES = tuple((MIDDLE.start + 1) * (blocks * WIDE - 1) // COUNT for blocks in BLOCKS)

# One in fixed-point arithmetic.
ONE = 1 << BITS


@Inlined
def blocks_of(form):  # type: ignore[no-untyped-def]
    """Return the number of blocks of a row."""
    return form - IN_PHASE if form > MAX_BLOCKS else form


def coefficients(blocks: int) -> Array:
    """Return the matrix that gives the Chebyshev coefficients."""
    return tables(blocks * WIDE - 1)[3].T


def tails(blocks: int) -> Array:
    """Return the matrix that gives the last three coefficients, and three in the middle."""
    middle = MIDDLE_DEGREES[blocks - 1]
    return coefficients(blocks)[:, [LAST.start - COUNT, -2, -1, middle - 1, middle, middle + 1]]


def nodes(blocks: int) -> Array:
    """Return the row of the nodes and the end as shares of the leg, as a matrix."""
    return np.append(tables(blocks * WIDE - 1)[0], 1.0)[None]


def means(blocks: int) -> Array:
    """Return the matrix that gives the means from the leg's start to the nodes and to its end."""
    return tables(blocks * WIDE - 1)[1].T


def end_terms(blocks: int) -> Array:
    """Return the matrix that gives the Taylor series, at the leg's end, of the integral from its start, in units of its
    width.
    """
    _, from_start, _, by_node = tables(blocks * WIDE - 1)
    k = np.arange(len(by_node), dtype=np.float64)
    slope, columns = np.ones(len(by_node)), [from_start[-1]]
    for m in range(1, TERMS):
        columns.append(slope @ by_node / m)
        # T_k has the m-th derivative prod (k**2 - i**2)/(2 i + 1) at 1; a share of the leg is half of x.
        slope = slope * (k * k - (m - 1) ** 2) / (2 * m - 1) * 2.0 / m
    return np.array(columns).T


def _from_nearer_turn(shares: Array, from_start: Array) -> Array:
    """Return the matrix that gives C exp(q) from the means between each node and the nearer turn."""
    half = len(shares) // 2 + 1
    near = from_start[:half] / (1.0 - shares[:half, None])
    return np.vstack([near, -near[len(shares) - half - 1 :: -1, ::-1]]).T


def factors(blocks: int) -> Array:
    """Return the matrix that gives C exp(q)."""
    return _from_nearer_turn(*tables(blocks * WIDE - 1)[:2])


def half_times(blocks: int) -> Array:
    """Return the matrix that gives the times from the start to the middle, and from there to the end, from the values
    of f.
    """
    by_node = tables(blocks * WIDE - 1)[3]
    k = np.arange(1, len(by_node))
    terms = np.append(0.5 * pi, [(-1.0) ** j * round(sin(0.5 * pi * j)) / j for j in k])
    first = terms @ by_node
    return np.array([first, first[::-1]]).T


def arrival_time(blocks: int) -> Array:
    """Return the matrix that gives the time of an arrival (`polynomials.arrival_weights`)."""
    return arrival_weights(blocks * WIDE - 1)


def _wave(angle: int, first: int) -> dict[int, int]:
    """Return the Chebyshev series of ``cos(angle x)`` (``first`` is 0) or ``sin(angle x)`` (1), by degree, in
    fixed-point arithmetic: its coefficients are Bessel functions of the angle.
    """
    series, half = {}, angle // 2
    for n in range(first, 2 * WIDE, 2):
        term, total, s = ONE if n == 0 else 2 * ONE, 0, 0
        for k in range(1, n + 1):
            term = (term * half >> BITS) // k
        while term:
            total, s = total + term, s + 1
            term = -(((term * half >> BITS) * half >> BITS) // (s * (n + s)))
        series[n] = -total if (n - first) % 4 else total
    return series


def _areas(x: int, count: int) -> list[int]:
    """Return the integrals of ``count`` Chebyshev polynomials from -1 to x."""
    values = [ONE, x]
    for _ in range(count):
        values.append((2 * x * values[-1] >> BITS) - values[-2])
    above = [value - (-1) ** k * ONE for k, value in enumerate(values)]
    later = [(above[k + 1] // (k + 1) - above[k - 1] // (k - 1)) // 2 for k in range(2, count)]
    return [x + ONE, ((x * x >> BITS) - ONE) // 2, *later]


def _moments(weight: dict[int, int], areas: list[int], count: int) -> list[int]:
    """Return the integrals of ``count`` Chebyshev polynomials times a weight, given that of its own series."""
    return [
        sum(term * (areas[k + n] + areas[abs(k - n)]) // 2 for n, term in weight.items()) >> BITS for k in range(count)
    ]


class PhaseTables(NamedTuple):
    """Tables for nodes in the phase angle.

    Attributes
    ----------
    shares : array
        The nodes as shares of the way.
    means : array
        The matrix of running means with respect to the share of the way.
    mean_rates : array
        The matrix that gives the same from values that are multiplied by sin(phi).
    to_middle, arrival : arrays
        The weights of the time from the start to the middle, and of the time of an arrival.
    """

    shares: Array
    means: Array
    mean_rates: Array
    to_middle: Array
    arrival: Array


@cache
def phase_tables(blocks: int) -> PhaseTables:
    """Return the tables for a number of blocks, computed in integers like `polynomials.tables`."""
    count = blocks * WIDE - 1
    places, quarter = [node(2 * j + 1, count) for j in range(count)], PI // 4
    shares = [share_at_angle(PI * place >> BITS) for place in places]
    # With x from -1 to 1 at the angles 0 to pi, sin(phi) is cos(pi x/2), and cos(phi/2) is the difference of cosine and
    # sine of pi x/4 over the root of 2.
    sine, root = _wave(PI // 2, 0), isqrt(ONE * ONE // 2)
    cosine = {n: term * root >> BITS for n, term in _wave(quarter, 0).items()}
    cosine |= {n: -term * root >> BITS for n, term in _wave(quarter, 1).items()}

    def means_to(x: int, share: int) -> tuple[list[float], list[float]]:
        areas = _areas(x, count + 2 * WIDE)
        with_sine = _moments(sine, areas, count)
        return [quarter * area / (share << BITS) for area in with_sine], [
            quarter * area / (share << BITS) for area in areas[:count]
        ]

    ends = [(2 * place - ONE, share) for place, share in zip(places, shares, strict=True)]
    plain, rates = zip(*(means_to(x, share) for x, share in [*ends, (ONE, ONE)]), strict=True)
    to_middle = [2 * quarter * area / (ONE << BITS) for area in _areas(0, count)]
    arrival = [2 * quarter * area / (ONE << BITS) for area in _moments(cosine, _areas(ONE, count + 2 * WIDE), count)]

    def by_node(rows: Iterable[list[float]]) -> Array:
        return np.array([[fsum(row * column) for column in coefficients(blocks)] for row in np.array(list(rows))])

    return PhaseTables(
        np.array([share / ONE for share in shares]),
        by_node(plain),
        by_node(rates),
        by_node([to_middle])[0],
        by_node([arrival])[0],
    )


def phase_nodes(blocks: int) -> Array:
    """Return what `nodes` does."""
    return np.append(phase_tables(blocks).shares, 1.0)[None]


def phase_means(blocks: int) -> Array:
    """Return what `means` does."""
    return phase_tables(blocks).means.T


def mean_rates(blocks: int) -> Array:
    """Return what `means` does, for values that are multiplied by sin(phi)."""
    return phase_tables(blocks).mean_rates.T


def phase_end_terms(blocks: int) -> Array:
    """Return what `end_terms` does, up to the linear term: the integral is not smooth in the share at a turn."""
    columns = [phase_tables(blocks).means[-1], coefficients(blocks).sum(axis=1)]
    return np.array([*columns, *[np.zeros(len(columns[0]))] * (TERMS - 2)]).T


def phase_factors(blocks: int) -> Array:
    """Return what `factors` does."""
    return _from_nearer_turn(*phase_tables(blocks)[:2])


def phase_half_times(blocks: int) -> Array:
    """Return what `half_times` does."""
    first = phase_tables(blocks).to_middle
    return np.array([first, first[::-1]]).T


def phase_arrival_time(blocks: int) -> Array:
    """Return what `arrival_time` does."""
    return phase_tables(blocks).arrival[:, None]


def _product(in_share: Callable[[int], Array], in_phase: Callable[[int], Array]) -> Any:
    """Return the product with the matrices for all forms."""
    return multiply_one_of([partial(table, blocks) for table in (in_share, in_phase) for blocks in BLOCKS])


to_coefficients, to_tails = (multiply_one_of([partial(table, k) for k in BLOCKS]) for table in (coefficients, tails))
to_nodes, to_means = _product(nodes, phase_nodes), _product(means, phase_means)
# The means of the resistance per share of the way. In the phase angle it is multiplied by sin(phi), because it may be
# infinite for a body at rest.
to_mean_rates = _product(means, mean_rates)
to_end_terms, to_factors = _product(end_terms, phase_end_terms), _product(factors, phase_factors)
to_half_times, to_arrival_time = _product(half_times, phase_half_times), _product(arrival_time, phase_arrival_time)
