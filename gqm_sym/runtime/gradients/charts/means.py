"""A train as a body on another curve, whose coordinates are the means of the parts of its potential.

The speed of a train depends on its place through these means alone, as that of a body on a curve in arc length depends
on its coordinates. The means, made small by powers of 2, are one or two coordinates of such a curve, and a further one,
in which there is no force, makes its speed one: x' = sqrt(1 - z'**2 - y'**2). So whatever is known of the times of
bodies along charts is known of the times of trains. The contact force on the other curve means nothing.

The polynomials of the means are taken as they are in the chart of the train, so that results have the accuracy of
doubles.

Derivatives with respect to parameters that shape the means, as the length of the train does, follow from the change of
the potential along the track (`trains`). If the potential has more parts than there are coordinates, the whole of it is
the one coordinate, and all parameters shape it.
"""

from collections.abc import Callable, Sequence
from ctypes import memset
from dataclasses import dataclass, replace
from functools import lru_cache
from math import frexp, nan
from typing import Any

import numpy as np
from numba import types

from gqm_sym.literals.namespaces import FLOATS
from gqm_sym.literals.numbers import Number
from gqm_sym.runtime.arithmetic.doubledouble import Pair, two_sum
from gqm_sym.runtime.charts.chart import Chart, SpaceChart
from gqm_sym.runtime.charts.double_double.making import Samples, TruePieces, sample_places, starting_context
from gqm_sym.runtime.charts.double_double.pieces import NODES
from gqm_sym.runtime.charts.evaluate import EDGES, RECORD, TERMS
from gqm_sym.runtime.charts.train import TrackOfTrain
from gqm_sym.runtime.compiled.emitted import RunByPython
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.types import MATRIX, REAL, VECTOR, Array
from gqm_sym.runtime.double_double.arithmetic import UNIT, add, multiply, square_root
from gqm_sym.runtime.interface import PATH_IN_SPACE, SPACE_ROWS, ExactPotential
from gqm_sym.runtime.launch.formulas import Formulas, ParameterValues, chart_with, shape_of
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.multiprecision.exact_problem import two_doubles

# The slope of a coordinate that is a mean is no larger than this, so that the remaining one changes evenly.
MAX_SLOPE = 0.5

# A curve in space has one coordinate without a force and two with one.
MOST_MEANS = 2

# The largest difference of functions on both sides of an edge, as a share of their values, that is rounding.
MAX_ROUNDING = 1e-13


def on_curve_of_means(problem: Problem) -> Problem:
    """Return the launch of a body whose times are those of a train. Its curve is kept with the run-time parameters.

    Parameters
    ----------
    problem : Problem
        The launch of a train.
    """
    kept = problem.p.conditions
    if "means" not in kept:
        kept["means"] = _with_curve_of_means(problem.formulas, problem.p)
    formulas, p = kept["means"]
    return Problem(formulas, problem.launch, p, problem.domain)


def _with_curve_of_means(formulas: Formulas, given: ParameterValues) -> tuple[Formulas, ParameterValues]:
    """Return the formulas of motions along the curve of means, and run-time parameters that keep what belongs to it."""
    values, train = tuple(given.values.tolist()), formulas.chart
    assert isinstance(train, TrackOfTrain)
    means = _means_of(train, len(values))
    chart = chart_with(train, values)
    records, _ = _coordinates_of(train, chart, values, means, formulas.inertia)
    steepest = (float(np.abs(record[:, 6 + 2 * TERMS : 6 + 3 * TERMS]).sum(axis=1).max()) for record in records)
    scales = tuple(2.0 ** (frexp(slope / MAX_SLOPE)[1]) if slope else 1.0 for slope in steepest)
    shape = shape_of(train, values, 1.0) if means else values
    curve = CurveOfMeans(train, means, scales, formulas.inertia, shape)
    potential = _Potential(train, formulas.inertia, means, scales)
    other = replace(
        formulas,
        chart=curve,
        exact=ExactPotential(potential),
        path_in_space=path_not_asked_for() if len(means) > 1 else None,
    )
    p = ParameterValues(given)
    p.values, p.conditions = given.values, {}
    return other, p


@lru_cache(maxsize=1)
def path_not_asked_for() -> RunByPython:
    """Return the function for y and the contact force on the other curve, which are not asked for."""

    def zeros(n: int, _places: int, _speeds: int, _v: float, _p: int, out: int) -> None:
        memset(out, 0, 8 * SPACE_ROWS * n)

    return RunByPython(zeros, PATH_IN_SPACE)


def _means_of(train: TrackOfTrain, parameters: int) -> tuple[int, ...]:
    """Return the numbers of the means that are coordinates: 0 for the height, then those of other parts; none if there
    are too many.
    """
    _, gravity, _, _, *factors = train.numbers(FLOATS, (nan,) * parameters)
    means = tuple(range(0 if gravity != 0 else 1, len(factors) + 1))
    return means if len(means) <= MOST_MEANS else ()


def _coordinates_of(
    train: TrackOfTrain,
    chart: Chart,
    values: tuple[float, ...],
    means: tuple[int, ...],
    inertia: Callable[..., Any] | None,
) -> tuple[list[Array], Array]:
    """Return the means that are coordinates, or the whole effective potential, as records of charts, and the edges of
    their pieces.
    """
    size = int(chart.block[0])
    start = size * (3 + chart.banked if isinstance(chart, SpaceChart) else 1)
    step, factors = int(chart.block[start]), _factors(train, inertia, FLOATS, values)
    found = [records_in(chart.block[start + mean * step :]) for mean in (means or range(len(factors)))]
    edges = chart.block[start + EDGES : start + EDGES + len(found[0]) + 1]
    return (found if means else [sum_of_records(list(zip(factors, found, strict=True)))]), edges


def _factors(train: TrackOfTrain, inertia: Callable[..., Any] | None, op: Any, p: Any) -> list[Any]:
    """Return the factors of all means in the effective potential."""
    _, gravity, _, _, *others = train.numbers(op, p)
    one_plus_beta = 1 if inertia is None else inertia(op, p)
    return [factor / one_plus_beta for factor in (gravity, *others)]


def records_in(block: Array) -> Array:
    """Return the records of the pieces in the block of a chart (`charts.evaluate`)."""
    count = int(block[1])
    first = EDGES + 3 * count + 2
    return block[first : first + count * RECORD].reshape(count, RECORD)


def sum_of_records(parts: Sequence[tuple[float, Array]]) -> Array:
    """Return the sum of functions, each times a factor, that are given by records of charts on the same pieces."""
    total = parts[0][1].copy()
    total[:, 6:] = sum(factor * records[:, 6:] for factor, records in parts)
    wide = sum(factor * records[:, 4].astype(np.longdouble) + factor * records[:, 5] for factor, records in parts)
    total[:, 4] = wide
    total[:, 5] = wide - total[:, 4]
    return total


def matched(records: Array, edges: Array, *, is_closed: bool) -> Array:
    """Return the records of functions with two more numbers each, by which functions on both sides of an edge agree.

    Where two polynomials meet they differ by their rounding. A body that turns there has V**2 = 0 on one of them only,
    and the integrals over its motion would have half the digits. The numbers are a constant and a slope, with respect
    to the variable of the piece, that are added to its polynomial. Larger differences are left as they are.

    Parameters
    ----------
    records : (k, pieces, RECORD) array
        The records.
    edges : (pieces + 1,) array
        The edges of the pieces.
    is_closed : bool
        Whether the first piece follows the last one.
    """
    count = edges.size - 1
    before = np.arange(count if is_closed else count - 1)
    after = (before + 1) % count
    found = np.concatenate([records, np.zeros((*records.shape[:2], 2))], axis=2)
    sides = np.empty((2, records.shape[0], 2, before.size))
    for side, pieces, places in zip(sides, (before, after), (edges[before + 1], edges[after]), strict=True):
        fill_functions(found, pieces, np.stack([places, np.zeros_like(places)]), side)
    jumps = (sides[0] - sides[1]).sum(axis=1)
    is_rounding = np.abs(jumps) <= MAX_ROUNDING * np.abs(sides[0, :, 0]).max(axis=1, initial=0.0, keepdims=True)
    ends = np.zeros((2, *records.shape[:2]))
    ends[0][:, after] = np.where(is_rounding, 0.5 * jumps, 0.0)
    ends[1][:, before] = -ends[0][:, after]
    found[:, :, RECORD:] = np.stack([0.5 * (ends[0] + ends[1]), 0.5 * (ends[1] - ends[0])], axis=2)
    return found


@dataclass(frozen=True, slots=True)
class _Potential:
    """The potential by coordinates (`interface.ExactPotential`): x, y and z, or x and z, of which x has no force.

    Attributes
    ----------
    train : TrackOfTrain
        What makes the train's chart.
    inertia : callable or None
        The factor of the inertia, ``f(op, p)``.
    means : tuple of int
        The numbers of the means that are the coordinates z and y.
    scales : tuple of float
        The means over these coordinates.
    """

    train: TrackOfTrain
    inertia: Callable[..., Any] | None
    means: tuple[int, ...]
    scales: tuple[float, ...]

    def __call__(self, op: Any, *arguments: Any) -> tuple[Any, ...]:
        *coordinates, p = arguments
        factors = _factors(self.train, self.inertia, op, p)
        chosen = [factors[mean] for mean in self.means] or [op.mpf(1)]
        slopes = [factor * scale for factor, scale in zip(chosen, self.scales, strict=True)]
        value = sum((slope * place for slope, place in zip(slopes, reversed(coordinates[1:]), strict=True)), op.mpf(0))
        return value, op.mpf(0), *reversed(slopes)


@dataclass(frozen=True, slots=True)
class CurveOfMeans:
    """The curve, which makes its chart: that of the train.

    Attributes
    ----------
    train, means, scales, inertia
        As `_Potential` has them.
    given : tuple of float
        The values of the run-time parameters for which the curve is made, as far as it depends on them; there are no
        neighbouring curves.
    """

    train: TrackOfTrain
    means: tuple[int, ...]
    scales: tuple[float, ...]
    inertia: Callable[..., Any] | None
    given: tuple[float, ...]

    @property
    def shaped_by(self) -> tuple[int, ...] | None:
        """The run-time parameters that the curve depends on, by their place; None if that is not known."""
        return self.train.shaped_by if self.means else None

    def chart(self, p: tuple[float, ...]) -> Chart:
        """Return the chart of the train."""
        return chart_with(self.train, p)

    def is_exact(self, chart: Chart) -> bool:
        """Return False: the means are known in doubles only."""
        return False

    def true_curve(self, context: Any, p: tuple[Any, ...], chart: Chart) -> Any:
        """Return None, because the means are known in doubles only."""
        return None

    def true_pieces(self, p: Sequence[Number], chart: Chart) -> TruePieces | None:
        """Return the curve in double-double arithmetic; None for other values of the parameters that shape it."""
        values = tuple(number.value for number in p)
        if shape_of(self, values, 1.0) != shape_of(self, self.given, 1.0):
            return None
        found, edges = _coordinates_of(self.train, chart, values, self.means, self.inertia)
        records = matched(np.stack(found), edges, is_closed=chart.period > 0.0)
        return _Pieces(chart, _sampler(chart, records, self.scales), in_space=len(self.means) > 1)


class _Pieces(TruePieces):
    """The pieces of such a curve. The middle of a train cannot be where arc length is 0 on an open track."""

    @property
    def start_length(self) -> Pair:
        """The arc length from the left edge of the piece ``begin`` to arc length 0."""
        return -float(self.curve.edges[self.begin]), 0.0


@Inner
def value_on(record, s, s_low):  # type: ignore[no-untyped-def]
    """Return a function and its slope at a place, two doubles each, from the record of a piece (`matched`)."""
    u, u_low = add(s, s_low, -record[0], 0.0)
    u, u_low = multiply(u, u_low, record[1], 0.0)
    value, value_low, slope, slope_low = 0.0, 0.0, 0.0, 0.0
    for j in range(TERMS - 1, -1, -1):
        slope, slope_low = multiply(slope, slope_low, u, u_low)
        slope, slope_low = add(slope, slope_low, value, value_low)
        value, value_low = multiply(value, value_low, u, u_low)
        value, value_low = add(value, value_low, record[6 + TERMS + j], 0.0)
    whole, whole_low = two_sum(record[4], record[5])
    value, value_low = add(value, value_low, whole, whole_low)
    value, value_low = add(value, value_low, record[RECORD] + record[RECORD + 1] * u, 0.0)
    slope, slope_low = add(slope, slope_low, record[RECORD + 1], 0.0)
    slope, slope_low = multiply(slope, slope_low, record[1], 0.0)
    return value, value_low, slope, slope_low


@entry(types.void(types.float64[:, :, ::1], types.int64[::1], MATRIX, types.float64[:, :, ::1]))
def fill_functions(records, pieces, s, found):  # type: ignore[no-untyped-def]
    """Fill functions at places of two doubles each, as two doubles each, from their records on all pieces."""
    for k in range(records.shape[0]):
        for i in range(pieces.size):
            found[k, 0, i], found[k, 1, i], _, _ = value_on(records[k, pieces[i]], s[0, i], s[1, i])


@entry(types.void(MATRIX, VECTOR, REAL, REAL, MATRIX, types.float64[:, :, ::1], types.float64[:, :, ::1]))
def fill_samples(records, scales, low, high, nodes, integrals, samples):  # type: ignore[no-untyped-def]
    """Fill the samples of a piece (`charts.double_double.pieces`).

    Parameters
    ----------
    records : (d, RECORD + 2) array
        The pieces of the charts of all means there (`matched`).
    scales : (d,) array
        The means over the coordinates.
    low, high : float
        Both ends of the piece in arc length.
    nodes : (2, NODES) array
        The Chebyshev points, the high doubles before the low ones.
    integrals : (2, NODES, NODES) array
        The matrix that takes values at these points to integrals from the middle of the piece, likewise.
    samples : (1 + d, 2, NODES) array
        Filled.
    """
    middle, middle_low = two_sum(0.5 * low, 0.5 * high)
    half, half_low = two_sum(-0.5 * low, 0.5 * high)
    rates = np.zeros((2, NODES))
    for i in range(NODES):
        s, s_low = multiply(half, half_low, nodes[0, i], nodes[1, i])
        s, s_low = add(s, s_low, middle, middle_low)
        rate, rate_low = 1.0, 0.0
        for row in range(records.shape[0]):
            record = records[row]
            value, value_low, slope, slope_low = value_on(record, s, s_low)
            # The scales are powers of 2.
            samples[1 + row, 0, i], samples[1 + row, 1, i] = value / scales[row], value_low / scales[row]
            slope, slope_low = slope / scales[row], slope_low / scales[row]
            slope, slope_low = multiply(slope, slope_low, slope, slope_low)
            rate, rate_low = add(rate, rate_low, -slope, -slope_low)
        rates[0, i], rates[1, i] = square_root(rate, rate_low)
    for i in range(NODES):
        total, total_low = 0.0, 0.0
        for k in range(NODES):
            part, part_low = multiply(integrals[0, i, k], integrals[1, i, k], rates[0, k], rates[1, k])
            total, total_low = add(total, total_low, part, part_low)
        samples[0, 0, i], samples[0, 1, i] = multiply(total, total_low, half, half_low)


def _sampler(chart: Chart, records: Array, scales: tuple[float, ...]) -> Callable[[int], Samples]:
    """Return the function that samples a piece (`charts.double_double.pieces`)."""
    edges, sizes = chart.edges.tolist(), np.array(scales)

    def sample(k: int) -> Samples:
        low, high = edges[k], edges[k + 1]
        here = np.stack([_piece_at(record, 0.5 * (low + high)) for record in records])
        samples = np.empty((1 + len(records), 2, NODES))
        fill_samples(here, sizes, low, high, sample_places(), _integrals(), samples)
        return samples, 4.0 * UNIT * float(np.abs(samples).max())

    return sample


def _piece_at(records: Array, place: float) -> Array:
    """Return the record of the piece on which a place lies."""
    nearest: Array = records[np.argmin(np.abs(records[:, 0] - place) * records[:, 1])]
    return nearest


@lru_cache(maxsize=1)
def _integrals() -> Array:
    """Return the matrix that takes values at the Chebyshev points to integrals from 0 to these points, but for a
    constant, as two doubles each.
    """
    context = starting_context()
    angles = [context.pi * (2 * k + 1) / (2 * NODES) for k in range(NODES)]

    def integral(j: int, angle: Any) -> Any:  # of the Chebyshev polynomial of degree j
        if j < 2:
            return context.cos(angle) if j == 0 else context.cos(2 * angle) / 4
        return context.cos((j + 1) * angle) / (2 * (j + 1)) - context.cos((j - 1) * angle) / (2 * (j - 1))

    # The Chebyshev coefficients of a function are its values at these points times a table of cosines.
    shares = [[context.cos(j * angle) * (1 if j == 0 else 2) / NODES for j in range(NODES)] for angle in angles]
    series = [[integral(j, angle) for j in range(NODES)] for angle in angles]
    found = [[two_doubles(context.fdot(row, share)) for share in shares] for row in series]
    return np.ascontiguousarray(np.array(found).transpose(2, 0, 1))
