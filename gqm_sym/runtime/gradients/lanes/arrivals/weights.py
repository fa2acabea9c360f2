"""The weights of a quadrature of times between places of an orbit, whose nodes do not depend on the places.

The time per phase angle at the midpoints of n equal steps determines a sum of cosines, or for a lap of cosines and
sines. Its integrals up to the phases of the launch and of a place are sums over the nodes, with weights that the time
and all of its derivatives have in common.
"""

from math import cos, floor, pi, sin

import numpy as np

from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.quadrature.trapezoid import CIRCULATION

# The numbers of nodes that are tried in turn; those to begin with, and those after which orbits that are open are left
# to the next pass, in successive passes. The first one of a lap only shows how much the second one changes.
NODES, PASSES = (16, 32, 64, 128, 256, 512), ((16, 64), (64, 512))
MOST = NODES[-1]

# The last terms of a series, which must be small.
TAIL = 8

# The cosines of the multiples of pi/(2*MOST) up to a whole turn.
TURN = 4 * MOST
COSINES = np.array([cos(0.5 * pi * m / MOST) for m in range(TURN)])

# The rows of what the weights of an orbit depend on: the phases of the launch and of the place, the signs of the times
# from the end of a libration to these in what is asked for, the number of half periods in it, and the sign of the odd
# cosines, which is -1 if phases begin at the upper end. For a lap the phase of the place is a share of laps, and it is
# the only row used.
LAUNCH, PLACE, LAUNCH_SIGN, PLACE_SIGN, WHOLE, FLIP, ROWS = range(7)

# The rows of work: the cosines and sines of both phases, those of their multiples, the factors of a term, and its sign.
WAVES = 11


@Inner
def cosine(m):  # type: ignore[no-untyped-def]
    """Return the cosine of a multiple of pi/(2*MOST)."""
    return COSINES[m % TURN]


@Inner
def turn_on(waves, at, to, lanes):  # type: ignore[no-untyped-def]
    """Add the angle whose cosine and sine are the rows from ``at`` on to those whose are the rows from ``to`` on."""
    for i in range(lanes):
        c, s = waves[to, i], waves[to + 1, i]
        waves[to, i] = c * waves[at, i] - s * waves[at + 1, i]
        waves[to + 1, i] = s * waves[at, i] + c * waves[at + 1, i]


@Inner
def fill_swing_weights(n, lanes, state, waves, weights):  # type: ignore[no-untyped-def]
    """Fill the weights of a sum of times along librations."""
    begin, stop, to_launch, to_place = state[LAUNCH], state[PLACE], state[LAUNCH_SIGN], state[PLACE_SIGN]
    factor, sign = waves[8], waves[10]
    for i in range(lanes):
        waves[0, i], waves[1, i], waves[2, i], waves[3, i] = cos(begin[i]), sin(begin[i]), cos(stop[i]), sin(stop[i])
        waves[4, i], waves[5, i], waves[6, i], waves[7, i] = waves[0, i], waves[1, i], waves[2, i], waves[3, i]
        factor[i] = (to_launch[i] * begin[i] + to_place[i] * stop[i] + state[WHOLE, i] * pi) / n
        sign[i] = 1.0
    for j in range(n):
        weights[j, :lanes] = factor[:lanes]
    for k in range(1, n):
        for i in range(lanes):
            sign[i] *= state[FLIP, i]
            factor[i] = 2.0 / (n * k) * (sign[i] * (to_launch[i] * waves[5, i] + to_place[i] * waves[7, i]))
        for j in range(n):
            wave, row = cosine(k * (2 * j + 1) * (MOST // n)), weights[j]
            for i in range(lanes):
                row[i] += factor[i] * wave
        turn_on(waves, 0, 4, lanes)
        turn_on(waves, 2, 6, lanes)


@Inner
def fill_lap_weights(n, lanes, state, waves, weights):  # type: ignore[no-untyped-def]
    """Fill the weights of times from the beginning of laps on."""
    share, by_cosine, by_sine = state[PLACE], waves[8], waves[9]
    for i in range(lanes):
        half = pi * (share[i] - floor(share[i]))
        waves[0, i], waves[1, i] = cos(half), sin(half)
        waves[4, i], waves[5, i] = waves[0, i], waves[1, i]
    for j in range(n):
        for i in range(lanes):
            weights[j, i] = share[i] / n
    for k in range(1, n // 2):
        for i in range(lanes):
            factor = 2.0 / (pi * (n * k)) * waves[5, i]
            by_cosine[i], by_sine[i] = factor * waves[4, i], factor * waves[5, i]
        for j in range(n):
            m, row = 2 * k * (2 * j + 1) * (MOST // n), weights[j]
            one, other = cosine(m), cosine(m - MOST)
            for i in range(lanes):
                row[i] += by_cosine[i] * one + by_sine[i] * other
        turn_on(waves, 0, 4, lanes)


@Inner
def fill_weights(kind, n, lanes, state, waves, weights):  # type: ignore[no-untyped-def]
    """Fill the weights of n nodes for some orbits.

    Parameters
    ----------
    kind : int
        LIBRATION or CIRCULATION.
    n : int
        The number of nodes, one of NODES.
    lanes : int
        The number of orbits.
    state : (ROWS, m) array
        What the weights depend on.
    waves : (WAVES, m) array
        Work space.
    weights : (MOST, m) array
        Filled with a row for each node.
    """
    if kind == CIRCULATION:
        fill_lap_weights(n, lanes, state, waves, weights)
    else:
        fill_swing_weights(n, lanes, state, waves, weights)


@Inner
def tail_size(kind):  # type: ignore[no-untyped-def]
    """Return the number of factors of `fill_tail`."""
    return 2 * TAIL if kind == CIRCULATION else TAIL


@Inner
def fill_tail(kind, n, node, factors):  # type: ignore[no-untyped-def]
    """Fill the factors of the value at a node in the last terms of the series: TAIL cosines, and for a lap as many
    sines.
    """
    step = (2 * node + 1) * (MOST // n)
    for q in range(TAIL):
        if kind == CIRCULATION:
            m = 2 * (n // 2 - 1 - q) * step
            factors[q], factors[TAIL + q] = cosine(m), cosine(m - MOST)
        else:
            factors[q] = cosine((n - 1 - q) * step)
