"""The track of a train: its chart is followed by charts of means over the train, as functions of the place of its
middle.

The mean height h(s) of a train of length l is the mean of z over [s - l/2, s + l/2], so that h' and h'' are the divided
differences of z and dz/ds over its ends. These keep all their digits however short the train is. A piece of the chart
of h ends where either end of the train passes from one piece of the track to the next. Other parts of a potential are
charted along the track first, on pieces that resolve them, and have such means too. With friction, the places at which
the middle of a car passes a break of a rail are breaks too.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numba import types
from numpy.polynomial.chebyshev import chebder
from numpy.typing import NDArray

from gqm_sym.errors import ParameterError
from gqm_sym.literals.namespaces import ARRAYS, FLOATS
from gqm_sym.literals.numbers import Number
from gqm_sym.runtime.charts.chart import AT_NODES, FIT, NODES, WEIGHTS, Chart, ChartMaker, SpaceChart, blocks_of
from gqm_sym.runtime.charts.differences import divdiff1_chart_alpha, divdiff1_chart_z, divdiff2_chart_z
from gqm_sym.runtime.charts.evaluate import TERMS, chart_alpha, chart_rows
from gqm_sym.runtime.compiled.jit import entry
from gqm_sym.runtime.compiled.types import MATRIX, REAL, VECTOR, Array
from gqm_sym.runtime.interface import ExactPotential

# The places of the ends of a train ahead of its middle, as shares of its length.
ENDS = (-0.5, 0.5)

# Edges nearer to each other than this share of the track count as one, because they differ by rounding only.
SAME_EDGE = 1e-13
# The largest ratio of the widths of neighbouring pieces.
MAX_RATIO = 16.0

# A piece resolves a part of a potential if the last two Chebyshev coefficients of its second derivative are below this
# share of it, or of what roundings of the part and of its slope make of it; other pieces are halved, so many times.
# Where a part almost vanishes, roundings of the coordinates make more of it: after the last number of halvings the
# share is of its largest value on the track.
MAX_TAIL, MAX_HALVINGS, HALVINGS_OF_SMALL_PARTS = 4e-16, 40, 8


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
        ``f(op, p)``: the length of the train, the acceleration of gravity, the coefficient of friction, the rate of the
        rotating frame, and the factors of the other parts of the potential.
    length : int
        The index of the length among the run-time parameters.
    parts, optional
        ``f(op, ..., p)``: these parts at a place, each with its first two derivatives by arc length; with friction
        also, for each component of the load across the track under them, their sum, the component and its derivative.
        In a plane the place is given by x, z, dx/ds, dz/ds and the curvature, in space by x, y and z and their first
        two derivatives.
    held : tuple of int
        The indices of the run-time parameters that they depend on.
    friction : bool
        Whether there is friction on the cars, which jumps where one of them passes a jump of the curvature.
    body : ExactPotential, optional
        The potential of a body at one place of the track, if there are no losses.
    """

    track: ChartMaker
    cars: int
    numbers: Callable[..., Any]
    length: int
    parts: Callable[..., Any] | None = None
    held: tuple[int, ...] = ()
    friction: bool = False
    body: ExactPotential | None = None

    @property
    def shaped_by(self) -> tuple[int, ...] | None:
        """The run-time parameters that the chart depends on, by their place; None if that is not known."""
        shaping = self.track.shaped_by
        return None if shaping is None else tuple(sorted({*shaping, self.length, *self.held}))

    def chart(self, p: tuple[float, ...]) -> Chart:
        """Return the chart, whose range is that of the middle of the train.

        Raises
        ------
        ParameterError
            If the train is longer than the track, the track has corners, or the potential is infinite on it.
        """
        track, length = self.track.chart(p), float(p[self.length])
        if track.corners.size:
            raise ParameterError("train: a track with corners would bend it in one place; give a smooth track")
        whole = track.high - track.low
        if not length < whole:
            raise ParameterError(
                f"train: length: {length!r} m is not shorter than the track, which is {whole!r} m long"
            )
        size = int(track.block[0])
        height = Charted(track.block[:size], track.edges, isinstance(track, SpaceChart))
        others, count = self._charted_parts(track, p), len(self.numbers(FLOATS, p)) - 4
        charted, loads = (height, *others[:count]), others[count:]
        edges = edges_of_means(track, charted[-1].edges, length)
        block = np.concatenate([mean_over_train(one, edges, length, track.period) for one in charted])
        # At the points of a spline only the fifth derivative jumps, which panels resolve faster than so many breaks.
        rubs = self.friction and not track.from_points
        cars = (np.arange(self.cars) + 0.5) / self.cars - 0.5 if rubs else np.empty(0)
        kinks = _passages(track, track.breaks, length, [*ENDS, 0.0, *cars])[1:-1]
        joints = _merged(np.concatenate([edges, _inside(track.edges, edges), kinks]), whole)
        return replace(
            track,
            block=np.concatenate([track.block, block, *(load.block for load in loads)]),
            low=float(edges[0]),
            high=float(edges[-1]),
            ends=("domain-end", "domain-end"),
            breaks=joints[np.unique(np.searchsorted(0.5 * (joints[:-1] + joints[1:]), kinks))],
            origins=np.empty((0, 3)),
            joints=joints,
        )

    def _along(self, track: Chart, p: Sequence[float], s: Array) -> Array:
        """Return the parts of the potential besides the height at arc lengths, each with two derivatives, and what
        follows them, as rows.
        """
        if self.parts is None:
            return np.empty((0, s.size))
        if isinstance(track, SpaceChart):
            point = np.concatenate([track.derivatives(s, order)[:3] for order in range(3)])
        else:
            x, z, angle, curvature = track.points(s)
            point = np.stack([x, z, np.cos(angle), np.sin(angle), curvature])
        with np.errstate(all="ignore"):
            rows = np.stack([np.broadcast_to(row, s.shape) for row in self.parts(ARRAYS, *point, p)])
        if not np.isfinite(rows).all():
            raise ParameterError("train: the potential is not finite everywhere on the track; keep it off its centre")
        return rows

    def _charted_parts(self, track: Chart, p: tuple[float, ...]) -> "list[Charted]":
        """Return the charts of these parts along the track, and of the load across it. The angle of such a chart is the
        derivative of the part, or the component of the load.
        """
        if self.parts is None:
            return []
        edges = track.edges
        for halvings in range(MAX_HALVINGS):
            half = 0.5 * np.diff(edges)
            places = edges[:-1, None] + half[:, None] * (1.0 + NODES)
            rows = self._along(track, p, places.ravel()).reshape(-1, 3, *places.shape)
            coefficients = rows[:, 2] @ FIT.T
            values, slopes, bends = np.abs(rows).max(axis=3).swapaxes(0, 1)
            sizes = bends + slopes / half + values / half**2
            if halvings >= HALVINGS_OF_SMALL_PARTS:
                sizes = np.maximum(sizes, bends.max(axis=1, keepdims=True))
            above = np.abs(coefficients) > MAX_TAIL * sizes[:, :, None]
            coarse = above[:, :, -2:].any(axis=(0, 2))
            if not coarse.any():
                break
            edges = np.sort(np.append(edges, (edges[:-1] + half)[coarse]))
        else:
            raise ParameterError("train: the potential changes too fast along the track; keep it off its centre")
        # Powers of u would magnify the noise in trailing coefficients.
        bends = up_to_last(above, coefficients) @ AT_NODES
        first = self._along(track, p, edges[:1])[::3, 0]
        blocks = blocks_of_functions(edges, first, rows[:, 1].swapaxes(0, 1), bends.swapaxes(0, 1), track.period)
        return [Charted(block, edges, True) for block in blocks]

    def potential(self, chart: Chart, p: Sequence[float], s: Array) -> tuple[Array, Array]:
        """Return the potential energy per unit mass of a body at arc lengths, and its derivative by arc length.

        Parameters
        ----------
        chart : Chart
            The chart of the track.
        p : sequence of float
            The run-time parameters.
        s : array
            Arc lengths, of any shape.
        """
        _, gravity, _, _, *factors = self.numbers(FLOATS, p)
        places = s.ravel()
        height, slope = chart.points(places)[1:3]
        if not isinstance(chart, SpaceChart):  # there it is an angle
            slope = np.sin(slope)
        rows = self._along(chart, p, places)[: 3 * len(factors)]
        energy = gravity * height + sum(factor * row for factor, row in zip(factors, rows[::3], strict=True))
        change = gravity * slope + sum(factor * row for factor, row in zip(factors, rows[1::3], strict=True))
        return energy.reshape(s.shape), change.reshape(s.shape)

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


def _passages(track: Chart, places: Array, length: float, shares: Sequence[float]) -> Array:
    """Return the places of the train's middle at which some points of it pass given places, and the ends of the
    middle's range.

    Parameters
    ----------
    track
        The chart of the track.
    places
        Arc lengths.
    length
        The length of the train.
    shares
        The distance of each point ahead of the middle, as a share of this length.
    """
    found = (places - length * np.array(shares)[:, None]).ravel()
    if track.period:
        low, high = track.low, track.low + track.period
        found = low + np.mod(found - low, track.period)
    else:
        low, high = track.low + 0.5 * length, track.high - 0.5 * length
    return _merged(np.concatenate([[low, high], _inside(found, np.array([low, high]))]), high - low)


def edges_of_means(track: Chart, edges: Array, length: float) -> Array:
    """Return the edges of the pieces of a mean over a train, of a function of the place along a track between edges."""
    return _graded(_passages(track, edges, length, ENDS), track.period > 0.0)


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


@entry(VECTOR(VECTOR, VECTOR, REAL))
def slopes_by_length(chart, places, length):  # type: ignore[no-untyped-def]
    """Return the derivative with respect to the place, then to the length of a train, of a mean over it.

    It is half of z[a, b, b] - z[a, a, b] with both ends a and b, in which nothing is divided by a small length.
    """
    out = np.empty(places.size)
    for i in range(places.size):
        back = places[i] - 0.5 * length
        front = back + length
        ahead = divdiff2_chart_z(chart, back, front, front, length, 0.0)
        out[i] = 0.5 * (ahead - divdiff2_chart_z(chart, back, back, front, 0.0, length))
    return out


@dataclass(frozen=True, slots=True)
class Charted:
    """A function of the place along a track, of which a train has the mean.

    Attributes
    ----------
    block : array
        A chart whose height is the function.
    edges : array
        The edges of its pieces.
    has_slope : bool
        Whether the angle of this chart is the derivative of the function; otherwise that is the sine of the angle.
    is_fitted : bool
        Whether this derivative follows from values of the function, and is less accurate than these.
    """

    block: Array
    edges: Array
    has_slope: bool
    is_fitted: bool = False


def mean_over_train(charted: Charted, edges: Array, length: float, period: float) -> Array:
    """Return the block of the chart of a mean, whose pieces end at ``edges``."""
    block = np.ascontiguousarray(charted.block)
    half = 0.5 * np.diff(edges)
    places = edges[:-1, None] + half[:, None] * (1.0 + NODES)
    (slopes, turns, back, front), _ = _over_train(block, places.ravel(), length)
    slopes = slopes.reshape(places.shape)
    if charted.is_fitted:
        bends = fitted_slopes(slopes) / half[:, None]
    elif charted.has_slope:
        bends = turns.reshape(places.shape)
    else:  # the divided difference of sin alpha
        bends = (turns * np.cos(0.5 * (front + back)) * np.sinc((front - back) / (2.0 * np.pi))).reshape(places.shape)
    first = _first_mean(charted, block, (edges[0] - 0.5 * length, edges[0] + 0.5 * length), period)
    (made,) = blocks_of_functions(edges, np.array([first]), slopes[:, None], bends[:, None], period)
    return made


def up_to_last(above: NDArray[np.bool_], coefficients: Array) -> Array:
    """Return coefficients (the last axis), with zeros for those behind the last one that is ``above`` the noise."""
    used = np.flip(np.logical_or.accumulate(np.flip(above, axis=-1), axis=-1), axis=-1)
    found: Array = np.where(used, coefficients, 0.0)
    return found


def fitted_slopes(values: Array) -> Array:
    """Return the derivatives with respect to u at the nodes of functions with given values there (the last axis)."""
    slopes: Array = np.asarray(chebder(values @ FIT.T, axis=-1)) @ AT_NODES[:-1]
    return slopes


def blocks_of_functions(edges: Array, first: Array, slopes: Array, bends: Array, period: float) -> list[Array]:
    """Return the blocks of charts of functions, from their values at the first edge and from derivatives at the nodes.

    Parameters
    ----------
    edges : (n+1,) array
        The edges of the pieces.
    first : (d,) array
        The functions at the first edge.
    slopes, bends : (n, d, TERMS) arrays
        Their first two derivatives.
    period : float
        The period of a closed track; 0 for an open one.
    """
    gains = 0.5 * np.diff(edges)[:, None] * (slopes @ WEIGHTS)
    values = np.cumsum(np.concatenate([first[None], gains]), axis=0, dtype=np.longdouble)
    if period:
        # A lap gains nothing but the roundings of all pieces. They must not come together where the chart begins and
        # ends, because small swings about that place would lose as many digits as their height is smaller than a lap's.
        values -= (values[-1] - values[0]) * ((edges - edges[0]) / period)[:, None]
    anchors = values[:-1].astype(np.float64)
    lows = (values[:-1] - anchors).astype(np.float64)
    return blocks_of(edges, (anchors, lows), (slopes, bends), period)


def _first_mean(charted: Charted, block: Array, ends: tuple[float, float], period: float) -> float:
    """Return the mean over a train whose ends are given."""
    laps = (-1.0, 0.0, 1.0) if period else (0.0,)
    edges = np.concatenate([charted.edges + lap * period for lap in laps])
    parts = np.unique(np.concatenate([ends, _inside(edges, np.array(ends))]))
    half, length = 0.5 * np.diff(parts), ends[1] - ends[0]
    _, values = _over_train(block, (parts[:-1, None] + half[:, None] * (1.0 + NODES)).ravel(), length)
    return float((half * (values.reshape(-1, TERMS) @ WEIGHTS)).sum() / length)
