"""Charted curves in extended precision: the normal of the chart at each of its places meets the curve itself once.

A chart is a curve of polynomials next to the true one. Where its normal at ``c`` meets the true curve is the place
``lam = c - shift`` there, with one shift for each piece of the chart, such that the curve goes on from piece to piece
without a gap. So ``lam`` is arc length to the chart's rounding, and ds/dlam, close to 1, is known exactly: between
joints everything is analytic in it, at any precision.
"""

from bisect import bisect_right
from collections.abc import Callable
from itertools import pairwise
from typing import Any, NamedTuple, Protocol

import numpy as np

from gqm_sym.errors import SolutionError
from gqm_sym.literals.numbers import Number
from gqm_sym.runtime.charts.chart import Chart, ChartMaker
from gqm_sym.runtime.charts.evaluate import EDGES, RECORD, TERMS
from gqm_sym.runtime.multiprecision.fixed_point import Polynomials
from gqm_sym.runtime.multiprecision.gauss_legendre import gauss

MOST_STEPS = 60

# Digits, of those worked with, that a part of a stretch must be longer than to be integrated by itself.
SLIVER = 10


class TrueCurve(Protocol):
    """What a chart is the chart of, at one precision."""

    start: tuple[Any, Any]

    def meet(self, k: int, u: float, x: Any, z: Any, dx: Any, dz: Any, size: float) -> tuple[Any, Any, Any, Any]:
        """Where the line through (x, z) across (dx, dz) meets the curve, and the unit tangent there.

        It does so next to that point, on piece k of the chart, about where ``u`` in [-1, 1] is on it. ``size`` is that
        of the coordinates and of the piece.
        """

    def ends(self, k: int) -> tuple[tuple[Any, Any], tuple[Any, Any]] | None:
        """The points at which piece k must begin and end; None where any two will do."""

    def length(self, k: int) -> Any:
        """The length between them; None where they are not given."""


class Spot(NamedTuple):
    """A place: coordinates, unit tangent, and ds/dlam."""

    x: Any
    z: Any
    tx: Any
    tz: Any
    ds: Any


class ChartTrack:
    """A charted curve with its forces, at one precision.

    Parameters
    ----------
    maker, chart
        What made the curve's chart, and the chart.
    potential
        ``f(op, x, z, p)``: the effective potential and its derivatives by x and z.
    point, lam0
        The launch by its coordinates, where it was given so, and by arc length from the start point.
    context, values
        An mpmath context, and the run-time parameters in it.
    """

    def __init__(
        self,
        maker: ChartMaker,
        chart: Chart,
        potential: Callable[..., Any],
        point: tuple[Number, Number] | None,
        lam0: Number,
        context: Any,
        values: tuple[Any, ...],
    ) -> None:
        curve: TrueCurve = maker.true_curve(context, values, chart)
        self._context, self._values, self._chart, self._curve = context, values, chart, curve
        self._potential = potential
        self._near = lam0.value
        self._edges = chart.edges.tolist()
        count = len(self._edges) - 1
        self._polynomials: list[Any] = [None] * count
        self._period: Any = None
        self._last: tuple[Any, Spot] | None = None  # lam and ds are asked for together
        # The start point is a joint; from it on pieces are joined as far as is asked for, both ways.
        begin = int(np.argmin(np.abs(chart.edges)))
        self._joints: list[Any] = [None] * (count + 1)
        self._joints[begin] = context.mpf(0)
        self._lowest = self._highest = min(begin, count - 1)
        self._shifts = [None] * count
        self._shifts[self._lowest] = self._meeting_of(self._lowest, *curve.start, context.mpf(self._edges[begin]))
        self.lam0 = self._by_length(lam0.at(context)) if point is None else self._by_point(*point)

    # -- what the exact problem asks ----------------------------------------------------------

    def place(self, lam: float) -> Any:
        """The place that a double stands for: as far from the launch as from the launch's double."""
        return self.lam0 + (self._context.mpf(lam) - self._near)

    def effective_potential(self, lam: Any) -> Any:
        """U, so that V**2 + 2*U is constant."""
        spot = self.spot(lam)
        return self._potential(self._context, spot.x, spot.z, self._values)[0]

    def effective_potential_slope(self, lam: Any) -> Any:
        """Its derivative."""
        spot = self.spot(lam)
        _, by_x, by_z = self._potential(self._context, spot.x, spot.z, self._values)
        return (by_x * spot.tx + by_z * spot.tz) * spot.ds

    def ds(self, lam: Any) -> Any:
        """ds/dlam, where lam is arc length to rounding."""
        return self.spot(lam).ds

    def period(self) -> Any:
        """Once round a closed curve."""
        if self._period is None:
            last = len(self._edges) - 2
            begin, end = self._bound(0)[0], self._bound(last)[1]
            # The last piece goes on to where the first one begins.
            x, z = self._end(0, 0, begin)
            self._period = self._meeting_of(last, x, z, end + self._shifts[last]) - self._shifts[last] - begin
        return self._period

    def elsewhere(self) -> Any:
        """The farther end of the piece that is launched on, but no end of the curve, which may be singular."""
        k, last = self._piece(self.lam0), len(self._edges) - 1
        ends = [self._edges[j] for j in (k, k + 1) if self._chart.period or 0 < j < last] or self._edges[k : k + 2]
        return self._context.mpf(max(ends, key=lambda edge: abs(edge - self._near)))

    def joints(self, low: Any, high: Any) -> list[Any]:
        """Joints of pieces between two places, in their order."""
        if high < low:
            return self.joints(high, low)[::-1]
        # A joint this close to an end is none: V**2 may vanish there, and is noise on so short a part.
        near = (high - low) * self._context.mpf(10) ** (SLIVER - self._context.dps)
        out: list[Any] = []
        lap, k = self._lap(low), self._piece(low)
        while True:
            joint = lap + self._bound(k)[1]
            k += 1
            if k == len(self._edges) - 1:
                if not self._chart.period:
                    return out
                lap, k = lap + self.period(), 0
                joint = lap + self._bound(0)[0]
            if joint >= high - near:
                return out
            if joint > low + near:
                out.append(joint)

    def spot(self, lam: Any) -> Spot:
        """What is at a place."""
        key = lam, self._context.prec  # mpmath raises the precision to differentiate
        if self._last is None or self._last[0] != key:
            k = self._piece(lam)
            self._last = key, self._on(k, lam - self._lap(lam) + self._shifts[k])
        return self._last[1]

    def arc(self, low: Any, high: Any) -> Any:
        """The true arc length between two places."""
        context = self._context
        if high < low:
            return -self.arc(high, low)
        edges = [low, *self.joints(low, high), high]
        total = context.mpf(0)
        for k, (left, right) in enumerate(pairwise(edges)):
            inside = 0 < k < len(edges) - 2
            whole = self._curve.length(self._piece((left + right) / 2)) if inside else None
            total += gauss(context, self.ds, (left, right), context.dps)[0] if whole is None else whole
        return total

    # -- places -------------------------------------------------------------------------------

    def _by_point(self, x: Number, z: Number) -> Any:
        """The place next to the launch's double to which the perpendicular goes from a point."""
        guess = self._context.mpf(self._near)
        k = self._piece(guess)
        c = guess - self._lap(guess) + self._shifts[k]
        return self._meeting_of(k, x.at(self._context), z.at(self._context), c) - self._shifts[k]

    def _by_length(self, wanted: Any) -> Any:
        """The place at an arc length from the start point."""
        if wanted == 0:
            return wanted
        lam, length = wanted, self.arc(self._context.mpf(0), wanted)
        for _ in range(3):  # from rounding, each step squares what is off
            nearer = lam + (wanted - length) / self.ds(lam)
            length += self.arc(lam, nearer)
            lam = nearer
        return lam

    def _lap(self, lam: Any) -> Any:
        """What to take from a place on a closed curve for it to lie on the chart."""
        low, high = self._edges[0], self._edges[-1]
        if not self._chart.period or low + 1e-9 * (high - low) < lam < high - 1e-9 * (high - low):
            return 0
        period = self.period()
        return period * self._context.floor((lam - self._bound(0)[0]) / period)

    def _piece(self, lam: Any) -> int:
        """The piece of the chart that a place lies on."""
        lam -= self._lap(lam)
        last = len(self._edges) - 2
        k = min(max(bisect_right(self._edges, float(lam)) - 1, 0), last)
        while k > 0 and lam < self._bound(k)[0]:
            k -= 1
        while k < last and lam >= self._bound(k)[1]:
            k += 1
        return k

    def _bound(self, k: int) -> tuple[Any, Any]:
        """The places between which a piece lies."""
        while k > self._highest:
            self._join(self._highest, 1)
            self._highest += 1
        while k < self._lowest:
            self._join(self._lowest, 0)
            self._lowest -= 1
        return self._joint(k, 0), self._joint(k, 1)

    def _joint(self, k: int, side: int) -> Any:
        """The place where a joined piece begins (side 0) or ends (side 1)."""
        if self._joints[k + side] is None:
            edge, ends = self._context.mpf(self._edges[k + side]), self._curve.ends(k)
            c = edge if ends is None else self._meeting_of(k, *ends[side], edge)
            self._joints[k + side] = c - self._shifts[k]
        return self._joints[k + side]

    def _end(self, k: int, side: int, joint: Any) -> tuple[Any, Any]:
        """The point where a joined piece begins or ends."""
        ends = self._curve.ends(k)
        return self._on(k, joint + self._shifts[k])[:2] if ends is None else ends[side]

    def _join(self, k: int, side: int) -> None:
        """Join the piece before (side 0) or behind (side 1) a joined one to it."""
        joint, other = self._joint(k, side), k + 2 * side - 1
        ends = self._curve.ends(other)
        x, z = self._end(k, side, joint) if ends is None else ends[1 - side]
        self._shifts[other] = self._meeting_of(other, x, z, self._context.mpf(self._edges[k + side])) - joint

    def _meeting_of(self, k: int, x: Any, z: Any, c: Any) -> Any:
        """The place of the chart on piece k whose normal goes to a point of the curve."""
        tolerance = self._context.ldexp(self._size(k), -self._context.prec // 2)
        for _ in range(MOST_STEPS):
            spot = self._on(k, c)
            step = ((x - spot.x) * spot.tx + (z - spot.z) * spot.tz) / spot.ds
            c += step
            if abs(step) <= tolerance:
                return c
        raise SolutionError(f"the curve near ({float(x)!r}, {float(z)!r}): extended precision does not settle on it")

    # -- pieces -------------------------------------------------------------------------------

    def _size(self, k: int) -> float:
        """The size of a piece and of its coordinates."""
        record = self._record(k)
        return float(1.0 / record[1] + abs(record[2]) + abs(record[4]))

    def _record(self, k: int) -> Any:
        start = EDGES + 3 * (len(self._edges) - 1) + 2 + k * RECORD
        return self._chart.block[start : start + RECORD]

    def _on(self, k: int, c: Any) -> Spot:
        """Where the chart's normal at a place of its piece k meets the curve."""
        middle, scale, rows = self._polynomials[k] = self._polynomials[k] or self._read(k)
        u = (c - middle) * scale
        (x, dx, ddx), (z, dz, ddz) = ((value, first * scale, second * scale**2) for value, first, second in rows(u))
        at_x, at_z, tx, tz = self._curve.meet(k, float(u), x, z, dx, dz, self._size(k))
        ds = (dx * dx + dz * dz - (at_x - x) * ddx - (at_z - z) * ddz) / (tx * dx + tz * dz)
        return Spot(at_x, at_z, tx, tz, ds)

    def _read(self, k: int) -> tuple[Any, Any, Polynomials]:
        """A piece of the chart: its middle, one over its half length, and its coordinates' polynomials."""
        record = [self._context.mpf(number) for number in self._record(k).tolist()]
        rows = ((record[2 + 2 * i] + record[3 + 2 * i], *record[7 + i * TERMS : 6 + (i + 1) * TERMS]) for i in (0, 1))
        return record[0], record[1], Polynomials(self._context, list(rows))
