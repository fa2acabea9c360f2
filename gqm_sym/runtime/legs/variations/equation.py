"""The variational equation along the panels of legs, in the march variable in which the legs were found.

The law of motion is dW/dlam = F(lam, W; p), where W is V**2. If the beginning of a half of a leg (its *origin*: the
start, or the turn at the end) moves by sigma, then W at a given distance d from the origin changes by y with

    dy/dd = u (F_W y + F_p + F_lam sigma),

where u is the direction in which d grows. This is the equation of the leg itself with another right-hand side, so that
the same integrating factor solves it. From a turning point y begins with 0 and vanishes as W does, so that y/W and the
change of the time per w, ``dt/dw (ds_p/ds + ds_lam sigma/ds - y/(2 W))``, are smooth in the march variable w there too.
The solutions for each parameter (with sigma = 0), for sigma = 1 alone, and for y = 1 at the origin are found for all
panels at once; the change of a leg is a linear combination of them (`changes`).
"""

from collections.abc import Sequence
from functools import cached_property
from itertools import pairwise
from math import ceil, inf, log2

import numpy as np
from numba import types
from numpy.polynomial.chebyshev import chebvander
from numpy.typing import NDArray

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.compiled.jit import entry
from gqm_sym.runtime.compiled.types import MATRIX, VECTOR, Array
from gqm_sym.runtime.legs.leg_record import END, HEADING, NORMAL_LOAD, RIGHT, START, Y_ROW
from gqm_sym.runtime.legs.leg_segments import Run
from gqm_sym.runtime.legs.panels.polynomials import COUNT, GRADED_MEANS, MEANS, SHARES, TO_COEFFICIENTS
from gqm_sym.runtime.legs.variations.law import LawRows, States

# The nodes of a panel and its end, as shares of it.
POINTS = np.append(SHARES, 1.0)

# The matrix that maps values at the nodes to those at both ends of a panel.
TO_START, TO_END = (-1.0) ** np.arange(COUNT) @ TO_COEFFICIENTS, TO_COEFFICIENTS.sum(axis=0)

# A panel that begins this near to a break of the curve, as a share of the place, counts as beginning there.
AT_BREAK = 1e-12


@entry(types.void(types.float64[:, :, ::1], types.int64[::1], VECTOR, MATRIX), checked=False)
def fill_sums(series, panels, x, out):  # type: ignore[no-untyped-def]
    """Fill the sums of Chebyshev series of panels at places x in [-1, 1] on them: a row for each series of a panel."""
    waves = np.ones(COUNT)
    for i in range(x.size):
        waves[1] = x[i]
        for j in range(2, COUNT):
            waves[j] = 2.0 * x[i] * waves[j - 1] - waves[j - 2]
        terms = series[panels[i]]
        for row in range(out.shape[0]):
            total = 0.0
            for j in range(COUNT - 1, -1, -1):
                total += terms[row, j] * waves[j]
            out[row, i] = total


class Panels:
    """The panels of all halves of some runs, one after the other, with the solutions of the variational equation.

    Parameters
    ----------
    halves : sequence of (Run, bool)
        Runs, each with True for the half from its end.

    Attributes
    ----------
    first : list of int
        The indices at which the panels of each half begin; the last item is the number of panels.
    begin, width, contact_sign : (n,) arrays
        The march variable at the beginning of each panel, the panel's width, and the sign of N on it.
    nodes : States
        The nodes of all panels.
    shares : (k+2, n, COUNT) array
        For each solution and panel y/W at the nodes.
    times : (k+2, n, COUNT+1) array
        For each solution and panel the change of the time from the origin to the nodes, and to the panel's end.
    arcs : (k, n, COUNT+1) array
        For each parameter and panel the integral of the derivative of ds/dlam from the origin to there.
    ends : (k+2, n) array
        For each solution and panel y at the panel's end.
    """

    shares: Array
    times: Array
    arcs: Array
    ends: Array

    def __init__(self, halves: Sequence[tuple[Run, bool]]) -> None:
        rows, tables = [], []
        for run, is_back in halves:
            place, low = run.pair(END if is_back else START)
            heading = float(run.record[HEADING])
            u, half_c = (-heading, 0.0) if is_back else (heading, run.half_c)
            tables.append(run.panels_back if is_back else run.panels_ahead)
            rows.append((place, low, u, heading, half_c))
        panels, counts = _as_followed(tables), [len(table) for table in tables]
        if any(0.0 < row[-1] < inf for row in rows):
            parts = np.split(panels, np.cumsum(counts)[:-1])
            parts = [_divided(part, row[-1]) for part, row in zip(parts, rows, strict=True)]
            panels, counts = np.concatenate(parts), [len(part) for part in parts]
        self.first = np.cumsum([0, *counts]).tolist()
        self.place, self._low, self.u, self.heading, half_c = np.repeat(np.array(rows), counts, axis=0).T.copy()
        self._is_distance = half_c == inf
        self._half_c = np.where(self._is_distance, 0.0, half_c)
        (self.begin, self.width, self.contact_sign), self._y = panels[:, :3].T, panels[:, 3:]
        w = self.begin[:, None] + self.width[:, None] * SHARES
        self._growth = np.where(self._is_distance[:, None], 1.0, w + self._half_c[:, None])
        signs = np.repeat(self.heading, COUNT), np.repeat(self.contact_sign, COUNT)
        places = self.places(np.repeat(np.arange(len(self.width)), COUNT), w.ravel())
        self.nodes = States(*places, ((self._y * self._growth) ** 2).ravel(), *signs)

    @property
    def end_speeds(self) -> Array:
        """V at the end of each panel."""
        growth = np.where(self._is_distance, 1.0, self.begin + self.width + self._half_c)
        speeds: Array = growth * (self._y @ TO_END)
        return speeds

    def panel_at(self, half: NDArray[np.intp], w: Array) -> NDArray[np.intp]:
        """Return the panels at march variables w on halves with given numbers."""
        low, high = np.array(self.first)[half], np.array(self.first)[half + 1] - 1
        while (low < high).any():  # by bisection
            middle = (low + high + 1) // 2
            is_behind = self.begin[middle] <= w
            low, high = np.where(is_behind, middle, low), np.where(is_behind, high, middle - 1)
        return low

    def distances(self, k: NDArray[np.intp], w: Array) -> tuple[Array, Array]:
        """Return the distances from the origin at march variables w on panels k, and V over Y there."""
        distance = np.where(self._is_distance[k], w, w * (w + 2.0 * self._half_c[k]))
        return distance, np.where(self._is_distance[k], 1.0, w + self._half_c[k])

    def places(self, k: NDArray[np.intp], w: Array) -> tuple[Array, Array]:
        """Return the places at march variables w on panels k, as two doubles each."""
        high, low = two_sum.py_func(self.place[k], self.u[k] * self.distances(k, w)[0])
        return high, low + self._low[k]

    def solve(self, rows: LawRows, breaks: Array) -> None:
        """Solve the variational equation.

        Parameters
        ----------
        rows : LawRows
            The law at all nodes.
        breaks : array
            The places at which it may jump.
        """
        n, count = len(rows.by_parameters), len(self.width)
        offset, zero = self.width[:, None] * POINTS, np.zeros_like(rows.ds)
        twice = np.where(self._is_distance, 1.0, 2.0)[:, None]
        ds = rows.ds.reshape(count, COUNT)
        # Integrals are over w and not over the distance: laws with the square root of W have a pole at a turn, which
        # the growth of the distance with w cancels.
        rate = twice * self._growth * rows.by_w.reshape(count, COUNT)
        factor = np.exp(self.u[:, None] * offset * (rate @ MEANS.T))
        # The sources for each parameter and for sigma; the solution that begins with y = 1 has none.
        sources = np.vstack([rows.by_parameters, rows.by_place, zero]).reshape(n + 2, count, COUNT)
        gained = self._over_distance(sources / factor[:, :COUNT])
        slopes = rows.slope.reshape(count, COUNT)
        self._breaks, self._slopes = breaks, np.stack([slopes @ TO_START, slopes @ TO_END])
        panels = np.arange(1, count)
        jumps = np.append(0.0, self.jumps(panels - 1, panels, 0))
        y = factor * (gained + self._chained(gained[:, :, -1], factor[:, -1], jumps)[:, :, None])
        self.shares, self.ends = y[:, :, :COUNT] / self.nodes.w.reshape(count, COUNT), y[:, :, -1]
        self.shares[n + 1, ~self._is_distance] = 0.0  # no solution begins there with y = 1
        stretch = np.vstack([rows.ds_by_parameters, rows.ds_by_place, zero]).reshape(n + 2, count, COUNT)
        changes = twice * ds / self._y * (stretch / ds - 0.5 * self.shares)
        times = offset * (changes @ MEANS.T)
        arcs = self._over_distance(rows.ds_by_parameters.reshape(n, count, COUNT))
        self.times, self.arcs = times + self._before(times), arcs + self._before(arcs)

    @cached_property
    def _series(self) -> tuple[Array, Array]:
        """Return Chebyshev coefficients on each panel: rows for ``times``, and for ``shares`` and ``arcs``."""
        others = np.concatenate([self.shares, self.arcs[:, :, :COUNT]])
        parts = (self.times[:, :, :COUNT], others)
        times, others = (np.ascontiguousarray(np.moveaxis(part @ TO_COEFFICIENTS.T, 0, 1)) for part in parts)
        return times, others

    def _sums(self, series: Array, k: NDArray[np.intp], w: Array) -> Array:
        out = np.empty((series.shape[1], k.size))
        fill_sums(series, k, np.clip(2.0 * (w - self.begin[k]) / self.width[k] - 1.0, -1.0, 1.0), out)
        return out

    def times_at(self, k: NDArray[np.intp], w: Array) -> Array:
        """Return ``times`` at march variables w on panels k."""
        return self._sums(self._series[0], k, w)

    def at(self, k: NDArray[np.intp], w: Array) -> tuple[Array, Array, Array]:
        """Return ``shares``, ``times`` and ``arcs`` at march variables w on panels k."""
        others = self._sums(self._series[1], k, w)
        count = len(self.shares)
        return others[:count], self.times_at(k, w), others[count:]

    def _over_distance(self, rows: Array) -> Array:
        """Return the integrals of u times rows over the distance, from the start of each panel to its points."""
        offset = self.width[:, None] * POINTS
        slope = np.where(self._is_distance, 1.0, 2.0 * (self.begin + self._half_c))[:, None]
        graded = np.where(self._is_distance, 0.0, 1.0)[:, None] * offset * (rows @ GRADED_MEANS.T)
        integrals: Array = self.u[:, None] * offset * (slope * (rows @ MEANS.T) + graded)
        return integrals

    def _before(self, integrals: Array) -> Array:
        """Return the values of integrals before each panel of their half."""
        before = np.zeros((*integrals.shape[:2], 1))
        for first, stop in pairwise(self.first):
            before[:, first + 1 : stop, 0] = np.cumsum(integrals[:, first : stop - 1, -1], axis=1)
        return before

    def jumps(self, one: NDArray[np.intp], other: NDArray[np.intp], end: int) -> Array:
        """Return the jumps of the force between the ends of some panels and the beginnings (or ends) of others.

        At a given distance from a moving origin, V**2 changes there by the jump times the shift of the origin.
        """
        if not self._breaks.size:
            return np.zeros(one.size)
        places = self.places(one, self.begin[one] + self.width[one])[0]
        nearest = np.abs(places[:, None] - self._breaks).min(axis=1)
        at_break = nearest <= AT_BREAK * (np.abs(places) + np.abs(self._breaks).max())
        return np.where(at_break, self._slopes[end, other] - self._slopes[1, one], 0.0)

    def jump(self, one: int, other: int, end: int) -> float:
        """Return the jump of the force between two panels, as in `jumps`."""
        return float(self.jumps(np.array([one]), np.array([other]), end)[0])

    def _chained(self, gained: Array, factors: Array, jumps: Array) -> Array:
        """Return the values of y with which panels begin: 0 at the origin, but 1 for the last solution."""
        start = np.zeros_like(gained)
        for first, stop in pairwise(self.first):
            start[-1, first] = 1.0
            for k in range(first + 1, stop):
                start[:, k] = factors[k - 1] * (start[:, k - 1] + gained[:, k - 1])
                start[-2, k] += jumps[k]
        return start


def _as_followed(tables: Sequence[Array]) -> Array:
    """Return the panels of all halves: the beginning and the width of each, the sign of N on it, and Y at its nodes."""
    table = np.concatenate(tables)
    right = table[:, RIGHT]
    begin = np.append(0.0, right[:-1])
    begin[np.cumsum([0, *(len(part) for part in tables)])[:-1]] = 0.0
    sign = np.where(table[:, NORMAL_LOAD + COUNT // 2] > 0.0, 1.0, -1.0)
    return np.column_stack([begin, right - begin, sign, table[:, Y_ROW : Y_ROW + COUNT]])


def _divided(panels: Array, half_c: float) -> Array:
    """Return the panels of a half, divided further after a slow launch.

    The march variable of a slow launch begins near a zero of V**2 behind it, at -half_c. Y is smooth there, but its
    changes are not, so panels must be no wider than their distance from this zero.
    """
    if not 0.0 < half_c < inf:
        return panels
    left, sign, y = panels[:, 0], panels[:, 2], panels[:, 3:]
    right = np.append(left[1:], left[-1] + panels[-1, 1])
    marks = half_c * (2.0 ** np.arange(1, ceil(log2(right[-1] / half_c + 2.0))) - 1.0)
    edges = np.unique([*left, right[-1], *marks[marks < right[-1]]])
    if edges.size == left.size + 1:
        return panels
    begin, width = edges[:-1], np.diff(edges)
    owner = np.searchsorted(right, begin, side="right")
    x = 2.0 * ((begin - left[owner])[:, None] + width[:, None] * SHARES) / (right - left)[owner, None] - 1.0
    y = np.einsum("pj,jk,pik->pi", y[owner], TO_COEFFICIENTS.T, chebvander(x, COUNT - 1))
    return np.column_stack([begin, width, sign[owner], y])
