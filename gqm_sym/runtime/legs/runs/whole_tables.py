"""Products with constant matrices for legs from turn to turn as one polynomial (`whole_leg`).

A row has one value at each of the 23, 47 or 71 Chebyshev nodes of the leg and one at its end, which makes its length a
number of *blocks* of `polynomials.WIDE` numbers: 1, 2 or 3. Each product is a function ``f(blocks, values, at, out,
to)``.
"""

from functools import partial
from math import pi, sin

import numpy as np

from gqm_sym.runtime.arithmetic.matrices import multiply_one_of
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.legs.panels.polynomials import COUNT, LAST, MIDDLE, WIDE, arrival_weights, tables

# The largest number of blocks. Where more nodes would be needed, panels take less time.
MAX_BLOCKS = 3
BLOCKS = range(1, MAX_BLOCKS + 1)

# The number of terms of the Taylor series at a leg's end.
TERMS = 6

# The nodes from the one in the middle of three whose coefficients are examined, by the number of blocks.
MIDDLE_DEGREES = tuple((MIDDLE.start + 1) * (blocks * WIDE - 1) // COUNT for blocks in BLOCKS)


def nodes(blocks: int) -> Array:
    """Return the row of the nodes and the end as shares of the leg, as a matrix."""
    return np.append(tables(blocks * WIDE - 1)[0], 1.0)[None]


def means(blocks: int) -> Array:
    """Return the matrix that gives the means from the leg's start to the nodes and to its end."""
    return tables(blocks * WIDE - 1)[1].T


def coefficients(blocks: int) -> Array:
    """Return the matrix that gives the Chebyshev coefficients."""
    return tables(blocks * WIDE - 1)[3].T


def tails(blocks: int) -> Array:
    """Return the matrix that gives the last three coefficients, and three in the middle."""
    middle = MIDDLE_DEGREES[blocks - 1]
    return coefficients(blocks)[:, [LAST.start - COUNT, -2, -1, middle - 1, middle, middle + 1]]


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


def factors(blocks: int) -> Array:
    """Return the matrix that gives C exp(q) from the means between each node and the nearer turn."""
    shares, from_start, *_ = tables(blocks * WIDE - 1)
    half = len(shares) // 2 + 1
    near = from_start[:half] / (1.0 - shares[:half, None])
    return np.vstack([near, -near[len(shares) - half - 1 :: -1, ::-1]]).T


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


to_nodes, to_means, to_coefficients, to_tails, to_end_terms, to_factors, to_half_times, to_arrival_time = (
    multiply_one_of([partial(table, blocks) for blocks in BLOCKS])
    for table in (nodes, means, coefficients, tails, end_terms, factors, half_times, arrival_time)
)
