"""How the pieces of the curve behind a chart (`pieces`) are made, by polynomials through samples of its coordinates.

A piece is made when a motion first passes it, and kept for all motions along the curve.
"""

from bisect import bisect_right
from collections.abc import Callable
from functools import cache, cached_property
from math import fabs, floor, nan
from typing import Any

import numpy as np
from numba import types
from numpy.polynomial.chebyshev import cheb2poly
from numpy.polynomial.legendre import legval

from gqm_sym.runtime.arithmetic.doubledouble import ZERO, Pair
from gqm_sym.runtime.arithmetic.elementary import HALF_PI
from gqm_sym.runtime.charts.chart import Chart
from gqm_sym.runtime.charts.double_double.pieces import NODES, ROWS_IN_SPACE, TRUE_CURVE, TrueCurve, arc_on, length_to
from gqm_sym.runtime.compiled.jit import entry
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, REAL, Array
from gqm_sym.runtime.double_double.arithmetic import UNIT, add, multiply, sine_and_cosine
from gqm_sym.runtime.double_double.nodes import RULE, panel_rule

# The number of decimal digits to which mpmath computes the starting values of double-double arithmetic.
DIGITS = 40

# Powers of u whose coefficients are below this share of those of u itself are summed in doubles.
MAX_DOUBLE_SHARE = 2.0**-57


def starting_context() -> Any:
    """Return an mpmath context with the digits to which starting values of double-double arithmetic are computed."""
    from mpmath.ctx_mp import MPContext

    context = MPContext()
    context.dps = DIGITS
    return context


@entry(types.Tuple((MATRIX, types.float64[:, :, ::1]))())
def chebyshev_tables():  # type: ignore[no-untyped-def]
    """Return the Chebyshev points, and the matrix that takes values there to coefficients, as two doubles each."""
    nodes, fit = np.empty((2, NODES)), np.empty((2, NODES, NODES))
    for j in range(NODES):
        for k in range(NODES):
            quarters = (j * (2 * k + 1)) % (4 * NODES) / NODES
            _, _, c, c_low = sine_and_cosine(*multiply(quarters, 0.0, HALF_PI[0], HALF_PI[1]))
            share = (1.0 if j == 0 else 2.0) / NODES
            fit[0, j, k], fit[1, j, k] = share * c, share * c_low
            if j == 1:
                nodes[0, k], nodes[1, k] = c, c_low
    return nodes, fit


@entry(types.void(TRUE_CURVE, INTEGER, types.float64[:, :, ::1], REAL, types.float64[:, :, ::1], MATRIX))
def fill_piece(curve, k, samples, error, fit, powers):  # type: ignore[no-untyped-def]
    """Fill a piece.

    Parameters
    ----------
    curve : TrueCurve
        The curve.
    k : int
        The piece.
    samples : (d, 2, NODES) array
        x and z, and y in space, at the Chebyshev points: the high doubles of each, then the low ones.
    error : float
        A bound on their errors.
    fit, powers : arrays
        The matrices that map values to Chebyshev coefficients, and these to coefficients of powers.
    """
    terms, series, count, rounding = curve.terms[k], np.zeros((2, NODES)), 2, error
    dimension = samples.shape[0]
    for row in range(dimension):
        first, first_low, size = samples[row, 0, 0], samples[row, 1, 0], 0.0
        for j in range(NODES):
            high, low = 0.0, 0.0
            for i in range(NODES):
                gap, gap_low = add(samples[row, 0, i], samples[row, 1, i], -first, -first_low)
                size = max(size, fabs(gap))
                gap, gap_low = multiply(gap, gap_low, fit[0, j, i], fit[1, j, i])
                high, low = add(high, low, gap, gap_low)
            series[0, j], series[1, j] = high, low
        rounding += 8.0 * UNIT * size + UNIT * fabs(first) + fabs(series[0, NODES - 1]) + fabs(series[0, NODES - 2])
        used = NODES
        while used > 1 and fabs(series[0, used - 1]) <= 8.0 * UNIT * size:
            used -= 1
        count = max(count, used)
        for i in range(NODES):
            high, low = (first, first_low) if i == 0 else (0.0, 0.0)
            for j in range(i, used):
                part, part_low = multiply(series[0, j], series[1, j], powers[j, i], 0.0)
                high, low = add(high, low, part, part_low)
            terms[2 * row, i], terms[2 * row + 1, i] = high, low
    high_terms = np.abs(terms[: 2 * dimension : 2])
    enough, precise = MAX_DOUBLE_SHARE * high_terms[:, 1].sum(), count
    while precise > 2 and high_terms[:, precise - 1].max() <= enough:
        precise -= 1
    curve.counts[k, 0], curve.counts[k, 1] = precise, count
    curve.errors[k, 0], curve.errors[k, 1] = rounding, NODES * rounding
    (high, low), error = arc_on(curve, k, (-1.0, 0.0), (1.0, 0.0))
    curve.lengths[k, 0], curve.lengths[k, 1], curve.lengths[k, 2] = high, low, error


@cache
def _tables() -> tuple[Array, Array, Array, Array]:
    """Return the Chebyshev points, both matrices that `fill_piece` takes, and `TrueCurve.tails`."""
    nodes, fit = chebyshev_tables()
    powers = np.array([np.pad(cheb2poly(row[: k + 1]), (0, NODES - 1 - k)) for k, row in enumerate(np.eye(NODES))])
    at = 2.0 * panel_rule()[0] - 1.0
    tails = np.array([(2 * k + 1) * legval(at, np.eye(RULE)[k]) for k in (RULE - 2, RULE - 1)])
    return nodes, fit, powers, tails


def sample_places() -> Array:
    """Return the Chebyshev points in [-1, 1] at which pieces are sampled, as rows of the high and the low doubles."""
    return _tables()[0]


def chebyshev_fit() -> Array:
    """Return the matrix that takes values at these points to Chebyshev coefficients, as two doubles each."""
    return _tables()[1]


def chebyshev_powers() -> Array:
    """Return the matrix that takes rows of Chebyshev coefficients to those of powers."""
    return _tables()[2]


# The coordinates of one piece at the Chebyshev points as an array (d, 2, NODES), in the order x, z, y, and a bound on
# their errors; and its type in compiled code.
Samples = tuple[Array, float]


SAMPLES = types.Tuple((types.float64[:, :, ::1], REAL))


class TruePieces:
    """The pieces of one curve, made as they are needed.

    Parameters
    ----------
    chart : Chart
        The chart.
    sample : callable
        ``sample(k)`` gives the `Samples` of piece k.
    start : tuple of float, optional
        x and z of the start point, two doubles each, near the left edge of the piece that begins at arc length 0; None
        if it is that edge.
    in_space : bool
        Whether the curve has a third coordinate.
    frame : callable, optional
        ``frame(k, u, u_low)`` gives the frame of a rail in space at a place on piece k.

    Attributes
    ----------
    shaped : dict
        The curve with its neighbours (`gradients.charts.shaped_pieces`), by the parameters that shape it.
    beside : dict
        The step of a parameter and the neighbours for it, by the parameter.
    around : dict
        The neighbours for second derivatives (`gradients.charts.shaped_bends`), by parameters and numbers of steps.
    """

    def __init__(
        self,
        chart: Chart,
        sample: Callable[[int], Samples],
        start: tuple[float, float, float, float] | None = None,
        *,
        in_space: bool = False,
        frame: Callable[[int, float, float], Array] | None = None,
    ) -> None:
        count, self._frame = chart.edges.size - 1, frame
        self._sample, self._point, self._tables = sample, start, _tables()
        self.curve = TrueCurve(
            np.zeros((count, ROWS_IN_SPACE if in_space else 4, NODES)),
            np.zeros((count, 2), dtype=np.int64),
            np.zeros((count, 2)),
            np.full((count, 3), nan),
            np.ascontiguousarray(chart.edges),
            chart.period,
            panel_rule(),
            self._tables[3],
        )
        self._made, self.doubt, self._edges = np.zeros(count, dtype=bool), 0.0, chart.edges.tolist()
        self.shaped: dict[tuple[int, ...], Any] = {}
        self.beside: dict[int, tuple[float, *tuple[TruePieces, ...]]] = {}
        self.around: dict[tuple[tuple[int, ...], tuple[int, ...]], TruePieces | None] = {}
        self.begin = min(int(np.argmin(np.abs(chart.edges))), count - 1)

    @cached_property
    def start_length(self) -> Pair:
        """The arc length from the left edge of the piece ``begin`` to the start point, from which it is measured."""
        if self._point is None:
            return ZERO
        self.make(self.begin, self.begin)
        length: Pair = length_to(self.curve, self.begin, self._point)
        return length

    def frame(self, k: int, u: float, u_low: float) -> Array:
        """Return the rows t, l and u of the frame of a rail in space at a place on piece k, as two doubles each."""
        assert self._frame is not None
        return self._frame(k, u, u_low)

    def number_of(self, place: float) -> int:
        """Return the number of the piece on which a place lies, given by its arc length in doubles."""
        edges, period, count = self._edges, self.curve.period, len(self._edges) - 1
        laps = floor((place - edges[0]) / period) if period else 0
        return min(max(bisect_right(edges, place - laps * period) - 1, 0), count - 1) + count * laps

    def make(self, first: int, last: int) -> None:
        """Make the pieces with these numbers and all between them, as far as they have not been made."""
        count = self._made.size
        if not self.curve.period:
            first, last = max(first, 0), min(last, count - 1)
        numbers = np.arange(first, min(last, first + count) + 1)
        if self._made.take(numbers, mode="wrap").all():
            return
        for k in (numbers % count).tolist():
            if not self._made[k]:
                samples, error = self._sample(k)
                fill_piece(self.curve, k, samples, error, self._tables[1], self._tables[2])
                self._made[k] = True
        # A bound on the error of an arc length from the start point.
        self.doubt = float(
            4.0 * UNIT * np.abs(self.curve.edges[[0, -1]]).max() + 2.0 * np.nansum(self.curve.lengths[:, 2])
        )
