"""Charted curves in extended precision: the normal at each place of the chart meets the true curve once.

A chart consists of polynomials close to the true curve. The place ``lam = c - shift`` denotes the point at which the
chart's normal at ``c`` meets the true curve. There is one shift for each piece of the chart, chosen such that the true
curve continues from piece to piece without a gap. So ``lam`` is the arc length up to the chart's rounding, and ds/dlam
is close to 1 and known exactly. Between joints everything is an analytic function of ``lam``, at any precision.
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

# Steps of Newton's method.
MAX_STEPS = 60

# The number of bits of a difference quotient beyond those that are lost in it.
EXTRA_BITS = 24

# A part of a segment is integrated separately unless it is so short that only this many of the working digits resolve
# it.
MIN_PART_DIGITS = 10


class TrueCurve(Protocol):
    """The curve that a chart approximates, at one precision."""

    start: tuple[Any, Any]

    def intersect_normal(
        self, k: int, u: float, x: Any, z: Any, dx: Any, dz: Any, size: float
    ) -> tuple[Any, Any, Any, Any, Any]:
        """Return the point at which the line through (x, z) perpendicular to (dx, dz) meets the curve, the unit tangent
        there, and the arc length to it from a place that all pieces of one part of the curve have in common; None if
        this has no closed form.

        Parameters
        ----------
        k, u
            A piece of the chart, and the place in [-1, 1] on it near which they meet.
        size : float
            The size of the coordinates and of the piece.
        """

    def ends(self, k: int) -> tuple[tuple[Any, Any], tuple[Any, Any]] | None:
        """Return the points at which piece k must begin and end; None if they may be chosen freely."""

    def length(self, k: int) -> Any:
        """Return the arc length between them; None if they are not prescribed."""


class CurvePoint(NamedTuple):
    """A point of the true curve: coordinates, unit tangent, ds/dlam, and arc length on its part of the curve, if it has
    a closed form.
    """

    x: Any
    z: Any
    tx: Any
    tz: Any
    ds: Any
    length: Any


class ChartTrack:
    """A charted curve with its forces, at one precision.

    Parameters
    ----------
    maker, chart
        The maker of the curve's chart, and the chart.
    potential
        ``f(op, x, z, p)``: the effective potential and its derivatives with respect to x and z.
    offset : Number or None
        The distance of the body's path to the left of the curve; x and z are coordinates of that path. None if the path
        is the curve itself.
    launch : (Number, (Number, Number) or None)
        The launch by arc length from the start point, and by its coordinates if it was given so.
    context, values
        An mpmath context, and the run-time parameters in it.
    """

    def __init__(
        self,
        maker: ChartMaker,
        chart: Chart,
        potential: Callable[..., Any],
        offset: Number | None,
        launch: tuple[Number, tuple[Number, Number] | None],
        context: Any,
        values: tuple[Any, ...],
    ) -> None:
        curve: TrueCurve = maker.true_curve(context, values, chart)
        lam0, point = launch
        self._offset = context.mpf(0) if offset is None else offset.at(context)
        self._context, self._values, self._chart, self._curve = context, values, chart, curve
        self._potential = potential
        self._near = lam0.value
        self._edges = chart.edges.tolist()
        count = len(self._edges) - 1
        self._polynomials: list[Any] = [None] * count
        self._period: Any = None
        self._last: tuple[Any, CurvePoint] | None = None  # the potential and ds/dlam are evaluated at the same place
        # The start point is a joint. Pieces are joined from there in both directions, as far as they are needed.
        begin = int(np.argmin(np.abs(chart.edges)))
        self._joints: list[Any] = [None] * (count + 1)
        self._joints[begin] = context.mpf(0)
        self._lowest = self._highest = min(begin, count - 1)
        self._shifts = [None] * count
        self._shifts[self._lowest] = self._meeting_of(self._lowest, *curve.start, context.mpf(self._edges[begin]))
        self.lam0 = self._by_length(lam0.at(context)) if point is None else self._by_point(*point)

    # -- Track (`exact_tracks`) ---------------------------------------------------------------

    def place(self, lam: float) -> Any:
        """Return the exact place that a double stands for: it is as far from the launch as the double is from the
        launch's double.
        """
        return self.lam0 + (self._context.mpf(lam) - self._near)

    def effective_potential(self, lam: Any) -> Any:
        """Return U, for which V**2 + 2*U is constant."""
        return self._potential(self._context, *self._beside(self.point(lam)), self._values)[0]

    def effective_potential_slope(self, lam: Any) -> Any:
        """Return the derivative of U."""
        spot = self.point(lam)
        _, by_x, by_z = self._potential(self._context, *self._beside(spot), self._values)
        return (by_x * spot.tx + by_z * spot.tz) * self.ds(lam)

    def ds(self, lam: Any) -> Any:
        """Return ds/dlam of the body's path, which is close to 1 on the curve itself."""
        return self.point(lam).ds - self._offset * self._turning_rate(lam) if self._offset else self.point(lam).ds

    def period(self) -> Any:
        """Return the period of lam on a closed curve."""
        if self._period is None:
            last = len(self._edges) - 2
            begin, end = self._bound(0)[0], self._bound(last)[1]
            # The last piece continues to the beginning of the first one.
            x, z = self._end(0, 0, begin)
            self._period = self._meeting_of(last, x, z, end + self._shifts[last]) - self._shifts[last] - begin
        return self._period

    def joints(self, low: Any, high: Any) -> list[Any]:
        """Return the joints of pieces between two places, in their order."""
        if high < low:
            return self.joints(high, low)[::-1]
        # Joints this close to an end are omitted: V**2 may vanish at the end, and is mere rounding noise on so short a
        # part.
        near = (high - low) * self._context.mpf(10) ** (MIN_PART_DIGITS - self._context.dps)
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

    def point(self, lam: Any) -> CurvePoint:
        """Return the point of the curve at a place."""
        key = lam, self._context.prec  # mpmath raises the precision to differentiate
        if self._last is None or self._last[0] != key:
            k = self._piece(lam)
            self._last = key, self._on(k, lam - self._lap(lam) + self._shifts[k])
        return self._last[1]

    def arc(self, low: Any, high: Any) -> Any:
        """Return the true arc length between two places."""
        context = self._context
        if high < low:
            return -self.arc(high, low)
        edges = [low, *self.joints(low, high), high]
        total = context.mpf(0)
        for k, (left, right) in enumerate(pairwise(edges)):
            inside = 0 < k < len(edges) - 2
            whole = self._curve.length(self._piece((left + right) / 2)) if inside else self._length_on(left, right)
            total += gauss(context, self._length_rate, (left, right), context.dps)[0] if whole is None else whole
        return total

    def _length_on(self, left: Any, right: Any) -> Any:
        """Return the arc length between two places on one piece of the chart; None if it has no closed form."""
        k = self._piece((left + right) / 2)
        back = self._shifts[k] - self._lap((left + right) / 2)
        begin, end = self._on(k, left + back).length, self._on(k, right + back).length
        return None if begin is None else end - begin

    def _length_rate(self, lam: Any) -> Any:
        """Return the derivative of arc length with respect to lam, which is close to 1."""
        return self.point(lam).ds

    def _beside(self, spot: CurvePoint) -> tuple[Any, Any]:
        """Return the coordinates of the body's path beside a point of the curve."""
        return spot.x - self._offset * spot.tz, spot.z + self._offset * spot.tx

    def _turning_rate(self, lam: Any) -> Any:
        """Return the derivative of the tangent's angle with respect to lam, from the tangents on both sides of a
        place.
        """
        context, k = self._context, self._piece(lam)
        c, precision = lam - self._lap(lam) + self._shifts[k], context.prec
        with context.workprec(precision + precision // 2 + EXTRA_BITS):
            step = context.ldexp(1 / context.mpf(self._record(k)[1]), -precision // 2)
            before, after = self._on(k, c - step), self._on(k, c + step)
            return (before.tx * after.tz - before.tz * after.tx) / (2 * step)

    # -- places -------------------------------------------------------------------------------

    def _by_point(self, x: Number, z: Number) -> Any:
        """Return the foot of the perpendicular from a point to the curve, near the launch's double."""
        guess = self._context.mpf(self._near)
        k = self._piece(guess)
        c = guess - self._lap(guess) + self._shifts[k]
        return self._meeting_of(k, x.at(self._context), z.at(self._context), c) - self._shifts[k]

    def _by_length(self, wanted: Any) -> Any:
        """Return the place at an arc length from the start point."""
        if wanted == 0:
            return wanted
        lam, length = wanted, self.arc(self._context.mpf(0), wanted)
        for _ in range(3):  # the first error is rounding, and each step squares it
            nearer = lam + (wanted - length) / self._length_rate(lam)
            length += self.arc(lam, nearer)
            lam = nearer
        return lam

    def _lap(self, lam: Any) -> Any:
        """Return the multiple of the period by which a place on a closed curve lies outside the chart."""
        low, high = self._edges[0], self._edges[-1]
        if not self._chart.period or low + 1e-9 * (high - low) < lam < high - 1e-9 * (high - low):
            return 0
        period = self.period()
        return period * self._context.floor((lam - self._bound(0)[0]) / period)

    def _piece(self, lam: Any) -> int:
        """Return the piece of the chart on which a place lies."""
        lam -= self._lap(lam)
        last = len(self._edges) - 2
        k = min(max(bisect_right(self._edges, float(lam)) - 1, 0), last)
        while k > 0 and lam < self._bound(k)[0]:
            k -= 1
        while k < last and lam >= self._bound(k)[1]:
            k += 1
        return k

    def _bound(self, k: int) -> tuple[Any, Any]:
        """Return the places at which a piece begins and ends."""
        while k > self._highest:
            self._join(self._highest, 1)
            self._highest += 1
        while k < self._lowest:
            self._join(self._lowest, 0)
            self._lowest -= 1
        return self._joint(k, 0), self._joint(k, 1)

    def _joint(self, k: int, side: int) -> Any:
        """Return the place where a joined piece begins (side 0) or ends (side 1)."""
        if self._joints[k + side] is None:
            edge, ends = self._context.mpf(self._edges[k + side]), self._curve.ends(k)
            c = edge if ends is None else self._meeting_of(k, *ends[side], edge)
            self._joints[k + side] = c - self._shifts[k]
        return self._joints[k + side]

    def _end(self, k: int, side: int, joint: Any) -> tuple[Any, Any]:
        """Return the point where a joined piece begins (side 0) or ends (side 1)."""
        ends = self._curve.ends(k)
        return self._on(k, joint + self._shifts[k])[:2] if ends is None else ends[side]

    def _join(self, k: int, side: int) -> None:
        """Join to a joined piece the one before it (side 0) or after it (side 1)."""
        joint, other = self._joint(k, side), k + 2 * side - 1
        ends = self._curve.ends(other)
        x, z = self._end(k, side, joint) if ends is None else ends[1 - side]
        self._shifts[other] = self._meeting_of(other, x, z, self._context.mpf(self._edges[k + side])) - joint

    def _meeting_of(self, k: int, x: Any, z: Any, c: Any) -> Any:
        """Return the place c on piece k at which the chart's normal goes through a point of the curve."""
        tolerance = self._context.ldexp(self._size(k), -self._context.prec // 2)
        for _ in range(MAX_STEPS):
            here = self._on(k, c)
            step = ((x - here.x) * here.tx + (z - here.z) * here.tz) / here.ds
            c += step
            if abs(step) <= tolerance:
                return c
        raise SolutionError(f"the curve near ({float(x)!r}, {float(z)!r}): extended precision does not converge to it")

    # -- pieces -------------------------------------------------------------------------------

    def _size(self, k: int) -> float:
        """Return the size of a piece and of its coordinates."""
        record = self._record(k)
        return float(1.0 / record[1] + abs(record[2]) + abs(record[4]))

    def _record(self, k: int) -> Any:
        start = EDGES + 3 * (len(self._edges) - 1) + 2 + k * RECORD
        return self._chart.block[start : start + RECORD]

    def _on(self, k: int, c: Any) -> CurvePoint:
        """Return the point where the normal of the chart at the place c of piece k meets the curve."""
        middle, scale, rows = self._polynomials[k] = self._polynomials[k] or self._read(k)
        u = (c - middle) * scale
        (x, dx, ddx), (z, dz, ddz) = ((value, first * scale, second * scale**2) for value, first, second in rows(u))
        at_x, at_z, tx, tz, length = self._curve.intersect_normal(k, float(u), x, z, dx, dz, self._size(k))
        ds = (dx * dx + dz * dz - (at_x - x) * ddx - (at_z - z) * ddz) / (tx * dx + tz * dz)
        return CurvePoint(at_x, at_z, tx, tz, ds, length)

    def _read(self, k: int) -> tuple[Any, Any, Polynomials]:
        """Return the middle of a piece, one over its half length, and the polynomials of its coordinates."""
        record = [self._context.mpf(number) for number in self._record(k).tolist()]
        rows = ((record[2 + 2 * i] + record[3 + 2 * i], *record[7 + i * TERMS : 6 + (i + 1) * TERMS]) for i in (0, 1))
        return record[0], record[1], Polynomials(self._context, list(rows))
