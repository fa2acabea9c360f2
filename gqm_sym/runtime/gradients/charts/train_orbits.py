"""The periodic orbits of trains with derivatives, on the curve of the means of a train (`means`, `trains`).

The points of this curve have no displacements. The two coordinates that the programs of other curves take for the
displacement by a parameter are the derivative of the potential at a fixed label, and that of the relative change of
arc lengths.
"""

from collections.abc import Sequence

import numpy as np

from gqm_sym.runtime.arithmetic.doubledouble import two_product, two_sum
from gqm_sym.runtime.charts.double_double.making import TruePieces
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.double_double.recording import Recorder, TapeNumber
from gqm_sym.runtime.gradients.charts.orbit import ChartOrbitDerivatives, source_along
from gqm_sym.runtime.gradients.charts.programs import ChartSource
from gqm_sym.runtime.gradients.charts.shaped_pieces import ShapedPieces
from gqm_sym.runtime.gradients.charts.space_programs import SpaceSource
from gqm_sym.runtime.gradients.charts.trains import ChangesOfTrain, changes_of
from gqm_sym.runtime.gradients.path import PathRows
from gqm_sym.runtime.launch.problem import Problem


class TrainSource(ChartSource):
    """The formulas of a train with one mean, with the known derivatives with respect to parameters that shape it."""

    __slots__ = ()

    def _at(self, op: Recorder, numbers: Sequence[TapeNumber]) -> tuple[TapeNumber, TapeNumber, list[TapeNumber]]:
        value, slope, partials = super(TrainSource, self._replace(shaping=()))._at(op, numbers)
        for k, (change, *_) in zip(self.shaping, self._moves(numbers), strict=True):
            partials[k] = change
        return value, slope, partials

    def _strains(self, op: Recorder, numbers: Sequence[TapeNumber]) -> list[tuple[int, TapeNumber]]:
        return [(k, moved[1]) for k, moved in zip(self.shaping, self._moves(numbers), strict=True)]


class TrainSourceInSpace(TrainSource, SpaceSource):  # type: ignore[misc]
    """The formulas of a train with two means."""


class CurveOfTrain(ShapedPieces):
    """The curve of means with the changes of the potential along it.

    Parameters
    ----------
    problem : Problem
        The launch on this curve.
    pieces : TruePieces
        The curve.
    shaping : tuple of int
        The parameters that shape it.
    changes : ChangesOfTrain
        The changes.
    """

    def __init__(self, problem: Problem, pieces: TruePieces, shaping: tuple[int, ...], changes: ChangesOfTrain) -> None:
        super().__init__(problem, pieces, ())
        self._shaping, self._changes = shaping, changes
        self._strains = changes.strains[list(shaping)]

    def unknown(self, first: int, last: int) -> list[int]:
        """See `ShapedPieces`."""
        self._make(first, last)
        return [i for i, k in enumerate(self._shaping) if self._changes.unknown[k]]

    def _labels(self, places: Array) -> tuple[Array, Array]:
        """Return the labels of places within a lap, as two doubles each, and the numbers of laps before."""
        curve, (numbers, u, u_low) = self.pieces.curve, places
        laps, pieces = np.divmod(numbers.astype(np.int64), len(curve.counts))
        low, high = 0.5 * curve.edges[pieces], 0.5 * curve.edges[pieces + 1]
        (middle, middle_low), (half, half_low) = two_sum.py_func(low, high), two_sum.py_func(high, -low)
        ahead, ahead_low = two_product.py_func(half, u)
        label, rounding = two_sum.py_func(middle, ahead)
        return np.array([label, rounding + (middle_low + ahead_low + half * u_low + half_low * u)]), laps

    def coordinates(self, places: Array) -> Array:
        """See `ShapedPieces`; derivatives of the potential and strains take the place of displacements."""
        found = np.zeros((len(self._shaping), self.dimension, 2, places.shape[1]))
        found[:, 0] = self._changes.pairs_at(self._labels(places)[0], self._shaping)
        found[:, 1, 0] = self._strains[:, None]
        return np.concatenate([super().coordinates(places), found.reshape(-1, places.shape[1])])

    def arc_length_changes(self, places: Array) -> Array:
        """See `ShapedPieces`."""
        (labels, _), laps = self._labels(places)
        changes: Array = self._strains[:, None] * (labels + laps * self.pieces.curve.period)
        return changes

    def shifts(self, places: Array) -> Array:
        """See `ShapedPieces`; labels are not displaced."""
        return self.arc_length_changes(places)


class TrainOrbitDerivatives(ChartOrbitDerivatives):
    """A libration or circulation of a train, with derivatives with respect to all variables."""

    @property
    def _has_neighbours(self) -> bool:
        return False

    def _source_along(self, problem: Problem) -> ChartSource:
        kind = TrainSource if problem.formulas.path_in_space is None else TrainSourceInSpace
        return kind(*source_along(problem))

    def _shaped(self, problem: Problem, pieces: TruePieces) -> ShapedPieces:
        shaping = self.source.shaping
        # The changes are dear, and derivatives for a fixed shape follow from the formulas alone.
        if not shaping:
            return super()._shaped(problem, pieces)
        return CurveOfTrain(problem, pieces, shaping, changes_of(problem))

    def at_places(self, lam: Array) -> PathRows:
        """Return `path_rows` of the middle of the train at labels."""
        return changes_of(self._problem).path(lam)
