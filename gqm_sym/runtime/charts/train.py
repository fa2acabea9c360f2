"""The track of a train: its chart is followed by a chart of the train's mean height as a function of the place of its
middle.

The mean height h(s) of a train of length l is the mean of z over [s - l/2, s + l/2], so that h' and h'' are the divided
differences of z and dz/ds over its ends. These keep all their digits however short the train is. A piece of the chart
of h ends where either end of the train passes from one piece of the track to the next.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numba import types

from gqm_sym.errors import ParameterError
from gqm_sym.literals.namespaces import FLOATS
from gqm_sym.literals.numbers import Number
from gqm_sym.runtime.charts.chart import NODES, WEIGHTS, Chart, ChartMaker, SpaceChart, blocks_of
from gqm_sym.runtime.charts.evaluate import TERMS, chart_alpha, chart_rows, divdiff1_chart_alpha, divdiff1_chart_z
from gqm_sym.runtime.compiled.jit import entry
from gqm_sym.runtime.compiled.types import MATRIX, REAL, VECTOR, Array

# Edges nearer to each other than this share of the track count as one, because they differ by rounding only.
SAME_EDGE = 1e-13
# The largest ratio of the widths of neighbouring pieces.
MAX_RATIO = 16.0


@dataclass(frozen=True, slots=True)
class TrackOfTrain:
    """The track of a train, which makes its chart.

    Attributes
    ----------
    track : ChartMaker
        The track by itself.
    cars : int
        The number of equal cars of the train.
    numbers
        ``f(op, p)``: the length of the train, the acceleration of gravity, and the coefficient of friction.
    length : int
        The index of the length among the run-time parameters.
    """

    track: ChartMaker
    cars: int
    numbers: Callable[..., Any]
    length: int

    @property
    def shaped_by(self) -> tuple[int, ...] | None:
        """The run-time parameters that the chart depends on, by their place; None if that is not known."""
        shaping = self.track.shaped_by
        return None if shaping is None else tuple(sorted({*shaping, self.length}))

    def chart(self, p: tuple[float, ...]) -> Chart:
        """Return the chart, whose range is that of the middle of the train.

        Raises
        ------
        ParameterError
            If the train is longer than the track, or the track has corners.
        """
        track, length = self.track.chart(p), float(self.numbers(FLOATS, p)[0])
        if track.corners.size:
            raise ParameterError("train: a track with corners would bend it in one place; give a smooth track")
        whole = track.high - track.low
        if not length < whole:
            raise ParameterError(
                f"train: length: {length!r} m is not shorter than the track, which is {whole!r} m long"
            )
        edges = _graded(_edges(track, track.edges, length), track.period > 0.0)
        block = _mean_height(track, edges, length)
        joints = _merged(np.concatenate([edges, _inside(track.edges, edges)]), whole)
        kinks = np.concatenate([_edges(track, track.breaks, length)[1:-1], _inside(track.breaks, edges)])
        breaks = joints[np.unique(np.abs(joints[:, None] - kinks).argmin(axis=0))] if kinks.size else kinks
        return replace(
            track,
            block=np.concatenate([track.block, block]),
            low=float(edges[0]),
            high=float(edges[-1]),
            ends=("domain-end", "domain-end"),
            breaks=breaks,
            origins=np.empty((0, 3)),
            joints=joints,
        )

    def is_exact(self, chart: Chart) -> bool:
        """Return False: the mean height is known in doubles only."""
        return False

    def true_curve(self, context: Any, p: tuple[Any, ...], chart: Chart) -> Any:
        """Return None, because the mean height is known in doubles only."""
        return None

    def true_pieces(self, p: Sequence[Number], chart: Chart) -> Any:
        """Return None, because the mean height is known in doubles only."""
        return None


def _inside(places: Array, edges: Array) -> Array:
    found: Array = places[(places > edges[0]) & (places < edges[-1])]
    return found


def _merged(places: Array, whole: float) -> Array:
    """Return places in ascending order, only the first of those that differ by rounding; the last place is always
    kept.
    """
    places = np.sort(places)
    kept = np.append(np.diff(places) > SAME_EDGE * whole, True)
    kept[0] = True
    if not kept[-2] or places.size == 2:
        kept[-2:] = places.size == 2, True
    merged: Array = places[kept]
    return merged


def _edges(track: Chart, places: Array, length: float) -> Array:
    """Return the places of the train's middle at which one of its ends passes given places, and the ends of the
    middle's range.
    """
    ends = np.concatenate([places - 0.5 * length, places + 0.5 * length])
    if track.period:
        low, high = track.low, track.low + track.period
        ends = low + np.mod(ends - low, track.period)
    else:
        low, high = track.low + 0.5 * length, track.high - 0.5 * length
    return _merged(np.concatenate([[low, high], _inside(ends, np.array([low, high]))]), high - low)


def _graded(edges: Array, is_closed: bool) -> Array:
    """Return edges with further ones between them, so that no piece is much wider than the next one.

    The values on a piece are only as accurate as its width requires, and a body that turns just beyond an edge may have
    moved over no more than the narrow piece before it.
    """
    while True:
        widths = np.diff(edges)
        around = np.concatenate([widths[-1:], widths, widths[:1]]) if is_closed else np.pad(widths, 1, mode="edge")
        before, after = around[:-2], around[2:]
        begins, ends = widths > MAX_RATIO * before, widths > MAX_RATIO * after
        if not (begins.any() or ends.any()):
            return edges
        share = 0.5 * MAX_RATIO
        cuts = [edges[:-1][begins] + share * before[begins], edges[1:][ends] - share * after[ends]]
        edges = np.sort(np.concatenate([edges, *cuts]))


@entry(types.Tuple((MATRIX, MATRIX))(VECTOR, VECTOR, REAL))
def _over_train(chart, places, length):  # type: ignore[no-untyped-def]
    """Return divided differences over the ends of a train, of z and alpha, and alpha at both ends, as rows.

    The second array is z at the places themselves.
    """
    out, heights = np.empty((4, places.size)), np.empty((1, places.size))
    for i in range(places.size):
        back = places[i] - 0.5 * length
        front = back + length
        out[0, i] = divdiff1_chart_z(chart, back, front, length)
        out[1, i] = divdiff1_chart_alpha(chart, back, front, length)
        out[2, i], out[3, i] = chart_alpha(chart, back), chart_alpha(chart, front)
    chart_rows(chart, (1,), places, heights)
    return out, heights


def _mean_height(track: Chart, edges: Array, length: float) -> Array:
    """Return the block of the chart of the mean height, whose pieces end at ``edges``."""
    block = np.ascontiguousarray(track.block[: int(track.block[0])])
    half = 0.5 * np.diff(edges)
    places = edges[:-1, None] + half[:, None] * (1.0 + NODES)
    (slopes, turns, back, front), _ = _over_train(block, places.ravel(), length)
    if isinstance(track, SpaceChart):  # there alpha is dz/ds
        bends = turns
    else:  # the divided difference of sin alpha
        bends = turns * np.cos(0.5 * (front + back)) * np.sinc((front - back) / (2.0 * np.pi))
    slopes, bends = slopes.reshape(places.shape), bends.reshape(places.shape)
    gains = np.append(_first_height(track, block, edges[0], length), half * (slopes @ WEIGHTS))
    heights = np.cumsum(gains, dtype=np.longdouble)
    if track.period:
        # A lap gains nothing but the roundings of all pieces. They must not come together where the chart begins and
        # ends, because small swings about that place would lose as many digits as their height is smaller than a lap's.
        heights -= (heights[-1] - heights[0]) * ((edges - edges[0]) / track.period)
    heights = heights[:-1]
    anchors = heights.astype(np.float64)
    lows = (heights - anchors).astype(np.float64)
    (made,) = blocks_of(edges, (anchors[:, None], lows[:, None]), (slopes[:, None], bends[:, None]), track.period)
    return made


def _first_height(track: Chart, block: Array, middle: float, length: float) -> float:
    """Return the mean height of the train at the beginning of its chart."""
    back, front = middle - 0.5 * length, middle + 0.5 * length
    laps = (-1.0, 0.0, 1.0) if track.period else (0.0,)
    edges = np.concatenate([track.edges + lap * track.period for lap in laps])
    ends = np.unique(np.concatenate([[back, front], _inside(edges, np.array([back, front]))]))
    half = 0.5 * np.diff(ends)
    _, heights = _over_train(block, (ends[:-1, None] + half[:, None] * (1.0 + NODES)).ravel(), length)
    return float((half * (heights.reshape(-1, TERMS) @ WEIGHTS)).sum() / length)
