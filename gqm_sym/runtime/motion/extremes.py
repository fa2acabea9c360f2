"""Extremes of a function on an interval by ever finer grids, and of a quantity along a motion that ends."""

from collections.abc import Callable, Iterator
from math import isfinite, nan
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gqm_sym.runtime.compiled.types import Array

if TYPE_CHECKING:
    from gqm_sym.runtime.motion.motion import Motion, State

# Points of each of the finer grids, and how many of them follow each other: each is 64 times as fine as the one before.
GRID_POINTS, GRIDS = 129, 8

# Points of the first grid on each leg of a motion, and of how many of the largest values the surroundings are refined.
LEG_POINTS, MAX_PEAKS = 257, 4


class Peak(NamedTuple):
    """The largest value on a grid.

    Attributes
    ----------
    place, value : float
        Where it is, and the value.
    low, high : float
        The neighbouring grid points, between which the next grid lies.
    """

    place: float
    value: float
    low: float
    high: float


def grid_peaks(
    function: Callable[[Array], Array], low: float, high: float, points: int = GRID_POINTS, grids: int = GRIDS
) -> Iterator[Peak]:
    """Yield the largest values of a function on ever finer grids, each between the neighbours of the peak before.

    Parameters
    ----------
    function : callable
        Takes an array of places and returns an array of values. A NaN counts as the largest value.
    low, high : float
        The ends of the first grid.
    points, grids : int
        The number of points of each grid, and the number of grids.
    """
    for _ in range(grids):
        places = np.linspace(low, high, points)
        values = function(places)
        k = int(np.argmax(values))
        low, high = places[max(k - 1, 0)], places[min(k + 1, points - 1)]
        yield Peak(float(places[k]), float(values[k]), float(low), float(high))


def over_legs(motion: "Motion", quantity: Callable[["State"], Array], sign: int) -> float:
    """The largest (sign 1) or least (-1) value from launch to the end; NaN for a motion that does not end."""
    if motion.kind == "rest":
        return float(quantity(motion.state(0.0)))
    if not isfinite(motion.t_end):
        return nan

    def signed(times: Array) -> Array:
        return sign * quantity(motion.state(times))

    peaks: list[tuple[float, float, float]] = []
    for leg in motion.legs:
        # Equal steps of an angle over half a turn: a body is slow next to a turning point.
        times = leg.t_start + (leg.t_end - leg.t_start) * (0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, LEG_POINTS)))
        times[-1] = min(leg.t_end, motion.t_end)
        values = signed(times)
        padded = np.concatenate([[-np.inf], values, [-np.inf]])
        local = np.flatnonzero((values >= padded[:-2]) & (values >= padded[2:]))
        peaks += [(float(values[k]), times[max(k - 1, 0)], times[min(k + 1, LEG_POINTS - 1)]) for k in local.tolist()]
    peaks.sort(reverse=True)
    return sign * max(
        max(value, *(peak.value for peak in grid_peaks(signed, low, high))) for value, low, high in peaks[:MAX_PEAKS]
    )
