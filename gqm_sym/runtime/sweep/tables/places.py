"""Places on a tabulated curve, and distances between them with all their digits.

A place is given by the index of its panel, x in [-1, 1] on it, and the distance from the nearer edge (the left one if x
is not positive) in units of half the panel. So a small distance from an edge keeps all its digits. On a closed curve
indices continue from lap to lap.
"""

from math import floor

from gqm_sym.runtime.compiled.jit import Inlined, Inner
from gqm_sym.runtime.sweep.tables.layout import HALF


@Inner
def locate(table, period, place):  # type: ignore[no-untyped-def]
    """Convert a place in lam to a place on the table."""
    edges, lows = table.edges, table.edge_lows
    count, laps = edges.size - 1, 0.0
    if period > 0.0:
        laps = floor((place - edges[0]) / period)
        place = place - laps * period
    below, above = 0, count
    while above - below > 1:
        middle = (below + above) // 2
        if place >= edges[middle]:
            below = middle
        else:
            above = middle
    before, behind = (place - edges[below]) - lows[below], (edges[below + 1] - place) + lows[below + 1]
    near = min(max(min(before, behind), 0.0) / table.paths[below, HALF], 1.0)
    return below + int(laps) * count, near - 1.0 if before <= behind else 1.0 - near, near


@Inlined
def neighbour(k, direction, count):  # type: ignore[no-untyped-def]
    """Return the panel next to panel k; on a closed curve the first panel follows the last one."""
    k += direction
    if k == count:
        return 0
    return k if k >= 0 else count - 1


@Inner
def edge_place(table, period, index):  # type: ignore[no-untyped-def]
    """Return the place of the left edge of a panel, which on a closed curve is given by its index over all laps."""
    count = table.edges.size - 1
    if period == 0.0:
        return table.edges[index]
    lap = index // count
    return table.edges[index - lap * count] + lap * period


@Inner
def edge_distance(table, one, other):  # type: ignore[no-untyped-def]
    """Return the distance from the left edge of a panel to that of the same or a later panel, at most a lap further."""
    edges, lows, count = table.edges, table.edge_lows, table.edges.size - 1
    lap = one // count
    one, other = one - lap * count, other - lap * count
    if other <= count:
        return (edges[other] - edges[one]) + (lows[other] - lows[one])
    other -= count
    to_end = (edges[count] - edges[one]) + (lows[count] - lows[one])
    return to_end + ((edges[other] - edges[0]) + (lows[other] - lows[0]))


@Inlined
def from_left(x, near):  # type: ignore[no-untyped-def]
    """Return the distance of a place from the left edge of its panel, in units of half the panel."""
    return near if x <= 0.0 else 2.0 - near


@Inlined
def from_right(x, near):  # type: ignore[no-untyped-def]
    """Return the distance of a place from the right edge of its panel, in units of half the panel."""
    return near if x > 0.0 else 2.0 - near


@Inner
def distance_between(table, lower, higher):  # type: ignore[no-untyped-def]
    """Return the distance from a place on a table to a higher one."""
    (i, x, near), (j, y, close) = lower, higher
    count, paths = table.edges.size - 1, table.paths
    if i == j:
        distance = from_right(x, near) - from_right(y, close) if x > 0.0 else from_left(y, close) - from_left(x, near)
        return distance * paths[i % count, HALF]
    distance = from_right(x, near) * paths[i % count, HALF] + from_left(y, close) * paths[j % count, HALF]
    return distance + edge_distance(table, i + 1, j)
