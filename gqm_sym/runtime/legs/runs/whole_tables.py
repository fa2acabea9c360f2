"""Products with constant matrices for legs from turn to turn as one polynomial (`whole_leg`).

A row has one value at each of 23, 47 or 71 Chebyshev nodes and one at the end of the leg, which makes its length a
number of *blocks* of `polynomials.WIDE` numbers: 1, 2 or 3. Rows are polynomials in the share y of the way; or, with
the *grade* 1 or 2, in a variable u from 0 to 1 of which the phase angle phi, with ``y = sin(phi/2)**2``, is a
polynomial: pi u, or ``pi (3 u**2 - 2 u**3)``. At a turn V**2 is as y, and therefore as u**2 or u**4 with the grades 1
and 2, so that its square roots, or its fourth roots, are smooth there.

Each product is a function ``f(form, values, at, out, to)``, where the *form* is the number of blocks, plus MAX_BLOCKS
times the grade.
"""

from collections.abc import Callable, Iterable
from functools import cache, partial
from math import asin, cos, fsum, pi, sin, sqrt
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

# The largest grade, and that of rows in the share of the way.
MAX_GRADE, IN_SHARE = 2, 0

# The number of terms of the Taylor series at a leg's end.
TERMS = 6

# The nodes from the one in the middle of three whose coefficients are examined, by the number of blocks.
MIDDLE_DEGREES = tuple((MIDDLE.start + 1) * (blocks * WIDE - 1) // COUNT for blocks in BLOCKS)

# One in fixed-point arithmetic.
ONE = 1 << BITS

# The number of terms of the Chebyshev series of weights, the last of which are far below one rounding.
TERMS_OF_WEIGHT = 4 * WIDE


@Inlined
def grade_of(form):  # type: ignore[no-untyped-def]
    """Return the grade of rows."""
    return (form - 1) // MAX_BLOCKS


@Inlined
def blocks_of(form):  # type: ignore[no-untyped-def]
    """Return the number of blocks of a row; 0 for the form 0."""
    return form - MAX_BLOCKS * grade_of(form) if form > 0 else 0


@Inlined
def phase_at(grade, u):  # type: ignore[no-untyped-def]
    """Return the phase angle, given the variable u of a grade."""
    return pi * (u if grade == 1 else u * u * (3.0 - 2.0 * u))


@Inlined
def variable_at(grade, phase):  # type: ignore[no-untyped-def]
    """Return the variable u of a grade, given the phase angle."""
    if grade == 1:
        return phase / pi
    # With 1 - 2 phi/pi = cos(a), u is 1/2 - sin(pi/6 - a/3).
    third = asin(sqrt(min(phase / pi, 1.0))) / 3.0
    return 2.0 * cos(0.5 * (pi / 3.0) - third) * sin(third)


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


def products(blocks: int) -> Array:
    """Return the row of ``y (1 - y)`` at the nodes and at the end, as a matrix."""
    places = [node(2 * j + 1, blocks * WIDE - 1) for j in range(blocks * WIDE - 1)]
    return np.append([(place * (ONE - place) >> BITS) / ONE for place in places], 0.0)[None]


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


def _cosine(angle: int) -> int:
    """Return a cosine in fixed-point arithmetic."""
    return ONE - 2 * share_at_angle(abs(angle))


def _series(values: list[int]) -> list[int]:
    """Return the Chebyshev series through values at as many nodes, in fixed-point arithmetic."""
    count = len(values)
    wave = [_cosine(PI * m // (2 * count)) for m in range(4 * count)]
    # T_k at node j is (-1)**k times the cosine of its angle from the beginning.
    series = [
        (-1) ** k * 2 * sum(value * wave[k * (2 * j + 1) % (4 * count)] for j, value in enumerate(values)) // count
        for k in range(count)
    ]
    return [series[0] // 2 >> BITS, *(term >> BITS for term in series[1:])]


def _areas(x: int, count: int) -> list[int]:
    """Return the integrals of ``count`` Chebyshev polynomials from -1 to x."""
    values = [ONE, x]
    for _ in range(count):
        values.append((2 * x * values[-1] >> BITS) - values[-2])
    above = [value - (-1) ** k * ONE for k, value in enumerate(values)]
    later = [(above[k + 1] // (k + 1) - above[k - 1] // (k - 1)) // 2 for k in range(2, count)]
    return [x + ONE, ((x * x >> BITS) - ONE) // 2, *later]


def _moments(weight: list[int], areas: list[int], count: int) -> list[int]:
    """Return the integrals of ``count`` Chebyshev polynomials times a weight, given that of its own series."""
    return [
        sum(term * (areas[k + n] + areas[abs(k - n)]) // 2 for n, term in enumerate(weight)) >> BITS
        for k in range(count)
    ]


class PhaseTables(NamedTuple):
    """Tables for nodes in the variable u of a grade.

    Attributes
    ----------
    shares, products : array
        The nodes as shares y of the way, and ``y (1 - y)`` there.
    means : array
        The matrix of running means with respect to the share of the way.
    mean_rates : array
        The matrix that gives the same from values that are multiplied by sin(phi).
    to_middle, arrival : arrays
        The weights of the time from the start to the middle, and of the time of an arrival.
    """

    shares: Array
    products: Array
    means: Array
    mean_rates: Array
    to_middle: Array
    arrival: Array


def _phase(grade: int, u: int) -> tuple[int, int]:
    """Return the phase angle and its derivative with respect to u, in fixed-point arithmetic."""
    if grade == 1:
        return PI * u >> BITS, PI
    square = u * u >> BITS
    return PI * (3 * square - 2 * (square * u >> BITS)) >> BITS, 6 * PI * (u - square) >> BITS


@cache
def phase_tables(grade: int, blocks: int) -> PhaseTables:
    """Return the tables for a grade and a number of blocks, computed in integers like `polynomials.tables`."""
    count = blocks * WIDE - 1
    places = [node(2 * j + 1, count) for j in range(count)]
    angles = [_phase(grade, place)[0] for place in places]
    # The weights of integrals over x, which runs from -1 to 1: two times u is x + 1.
    sampled = [_phase(grade, node(2 * j + 1, TERMS_OF_WEIGHT)) for j in range(TERMS_OF_WEIGHT)]
    rate = _series([slope // 4 for _, slope in sampled])
    share = _series([_cosine(angle - PI // 2) * slope // 4 >> BITS for angle, slope in sampled])
    at_start = _series([_cosine(angle // 2) * slope // 2 >> BITS for angle, slope in sampled])

    def means_to(x: int, y: int) -> tuple[list[float], list[float]]:
        areas = _areas(x, count + TERMS_OF_WEIGHT)
        return [area / y for area in _moments(share, areas, count)], [area / y for area in _moments(rate, areas, count)]

    ends = [(2 * place - ONE, share_at_angle(angle)) for place, angle in zip(places, angles, strict=True)]
    plain, rates = zip(*(means_to(*end) for end in [*ends, (ONE, ONE)]), strict=True)
    to_middle = [2 * area / ONE for area in _moments(rate, _areas(0, count + TERMS_OF_WEIGHT), count)]
    arrival = [area / ONE for area in _moments(at_start, _areas(ONE, count + TERMS_OF_WEIGHT), count)]

    def by_node(rows: Iterable[list[float]]) -> Array:
        return np.array([[fsum(row * column) for column in coefficients(blocks)] for row in np.array(list(rows))])

    return PhaseTables(
        np.array([y / ONE for _, y in ends]),
        np.array([share_at_angle(2 * angle) / (4 * ONE) for angle in angles]),
        by_node(plain),
        by_node(rates),
        by_node([to_middle])[0],
        by_node([arrival])[0],
    )


def phase_nodes(grade: int, blocks: int) -> Array:
    """Return what `nodes` does."""
    return np.append(phase_tables(grade, blocks).shares, 1.0)[None]


def phase_products(grade: int, blocks: int) -> Array:
    """Return what `products` does."""
    return np.append(phase_tables(grade, blocks).products, 0.0)[None]


def phase_means(grade: int, blocks: int) -> Array:
    """Return what `means` does."""
    return phase_tables(grade, blocks).means.T


def mean_rates(grade: int, blocks: int) -> Array:
    """Return what `means` does, for values that are multiplied by sin(phi)."""
    return phase_tables(grade, blocks).mean_rates.T


def phase_end_terms(grade: int, blocks: int) -> Array:
    """Return what `end_terms` does, up to the linear term: the integral is not smooth in the share at a turn."""
    columns = [phase_tables(grade, blocks).means[-1], coefficients(blocks).sum(axis=1)]
    return np.array([*columns, *[np.zeros(len(columns[0]))] * (TERMS - 2)]).T


def phase_factors(grade: int, blocks: int) -> Array:
    """Return what `factors` does."""
    tables_of_grade = phase_tables(grade, blocks)
    return _from_nearer_turn(tables_of_grade.shares, tables_of_grade.means)


def phase_half_times(grade: int, blocks: int) -> Array:
    """Return what `half_times` does."""
    first = phase_tables(grade, blocks).to_middle
    return np.array([first, first[::-1]]).T


def phase_arrival_time(grade: int, blocks: int) -> Array:
    """Return what `arrival_time` does."""
    return phase_tables(grade, blocks).arrival[:, None]


def _product(in_share: Callable[[int], Array], in_phase: Callable[[int, int], Array]) -> Any:
    """Return the product with the matrices for all forms."""
    in_phases = [partial(in_phase, grade, blocks) for grade in range(1, MAX_GRADE + 1) for blocks in BLOCKS]
    return multiply_one_of([*(partial(in_share, blocks) for blocks in BLOCKS), *in_phases])


to_coefficients, to_tails = (multiply_one_of([partial(table, k) for k in BLOCKS]) for table in (coefficients, tails))
to_nodes, to_products = _product(nodes, phase_nodes), _product(products, phase_products)
to_means = _product(means, phase_means)
# The means of the resistance per share of the way. In the phase angle it is multiplied by sin(phi), because it may be
# infinite for a body at rest.
to_mean_rates = _product(means, mean_rates)
to_end_terms, to_factors = _product(end_terms, phase_end_terms), _product(factors, phase_factors)
to_half_times, to_arrival_time = _product(half_times, phase_half_times), _product(arrival_time, phase_arrival_time)
