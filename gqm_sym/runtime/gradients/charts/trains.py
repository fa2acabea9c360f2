"""How the potential of a train changes with the run-time parameters.

A train has the times of a body whose potential U is the mean over the train (`means`). Its places are labels: on an
open track a label is the arc length at the middle of the train, and on a closed track the arc lengths of all labels
grow in the same ratio as a lap does. What is needed is the derivative of U at fixed labels with respect to each
parameter. It is the mean of that of the potential of a body at one place, which follows from the displacements of the
points of the track (`shaped_pieces`); that with respect to the length of the train is a divided difference. The
coordinates of the middle of the train, and the contact force there, are those of a body on the track.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gqm_sym.runtime.charts.chart import AT_NODES, FIT, NODES, Chart, SpaceChart
from gqm_sym.runtime.charts.evaluate import RECORD, TERMS
from gqm_sym.runtime.charts.train import (
    Charted,
    blocks_of_functions,
    edges_of_means,
    fitted_slopes,
    mean_over_train,
    slopes_by_length,
    up_to_last,
)
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.gradients.charts.means import (
    CurveOfMeans,
    fill_functions,
    matched,
    path_not_asked_for,
    records_in,
    sum_of_records,
)
from gqm_sym.runtime.gradients.charts.orbit import path_along, source_along
from gqm_sym.runtime.gradients.charts.shaped_pieces import shaped_pieces
from gqm_sym.runtime.gradients.orbit import pairs, without_formulas
from gqm_sym.runtime.gradients.path import DS, POTENTIAL, PathRows
from gqm_sym.runtime.launch.formulas import ParameterValues, chart_with
from gqm_sym.runtime.launch.problem import Problem

# The number of places that are evaluated together.
BLOCK = 4096

# A piece resolves a function of the place along the track if its last two Chebyshev coefficients are below this share
# of the function's largest value; other pieces are halved, at most so many times.
MAX_TAIL, MAX_HALVINGS = 1e-15, 12


class TrackOfBody:
    """The path of a body that is alone on the track of a train.

    Parameters
    ----------
    problem : Problem
        The launch on the curve of the means of the train.

    Raises
    ------
    SolutionError
        If the track is known in doubles only.
    """

    def __init__(self, problem: Problem) -> None:
        formulas, p = problem.formulas, ParameterValues(problem.p)
        assert isinstance(formulas.chart, CurveOfMeans)
        self.train = formulas.chart.train
        p.values, p.conditions = problem.p.values, {}
        self.chart: Chart = chart_with(self.train.track, tuple(p.values.tolist()))
        in_space = path_not_asked_for() if isinstance(self.chart, SpaceChart) else None
        alone = replace(formulas, chart=self.train.track, exact=self.train.body, path_in_space=in_space)
        body = Problem(alone, problem.launch, p, problem.domain)
        pieces = body.true_pieces
        if pieces is None:
            raise without_formulas()
        self._source = source_along(body)
        self._shape = shaped_pieces(body, pieces, self._source.shaping)
        self._parameters = pairs(*((n.value, n.low, 0.0) for n in p))

    @property
    def ends(self) -> Array:
        """The derivatives of the arc length at both ends of the chart, or of a lap: a row for each, by parameters."""
        found = np.zeros((2, self._source.parameters))
        last = self.chart.edges.size - 2
        edges = np.array([[0.0, last], [-1.0, 1.0], [0.0, 0.0]])
        if self._source.shaping:
            found[:, list(self._source.shaping)] = self._shape.arc_length_changes(edges).T
        return found

    def path(self, s: Array) -> Array:
        """Return the rows of `PathRows` at arc lengths, with derivatives at fixed arc lengths."""
        parts = []
        for start in range(0, max(s.size, 1), BLOCK):
            some = s[start : start + BLOCK]
            rows = path_along(self._source, self._shape, self._parameters, some).rows
            if self._source.shaping:
                shifts = self._shape.shifts(self._shape.places(some))
                for k, shift in zip(self._source.shaping, shifts, strict=True):
                    rows[:, 1 + k] -= shift * rows[:, -1]
            parts.append(rows)
        return np.concatenate(parts, axis=2)


class ChangesOfTrain:
    """The potential of a train as a function of its label, and the derivatives of it by the run-time parameters.

    Parameters
    ----------
    problem : Problem
        The launch on the curve of the means of the train.

    Attributes
    ----------
    strains : (n,) array
        The derivatives of the relative change of arc lengths by the run-time parameters.
    ranges : (2, n) array
        Those of the labels at both ends of the range of the train's middle.
    records : (1 + n, pieces, RECORD + 2) array
        The potential and its derivatives as functions of the label, as records of charts (`means.matched`).
    """

    def __init__(self, problem: Problem) -> None:
        self._body = body = TrackOfBody(problem)
        train, track, p = body.train, body.chart, problem.p.values
        self._length, self.count = float(p[train.length]), len(problem.p)
        self._period, ends = track.period, body.ends
        self.strains = (ends[1] - ends[0]) / track.period if track.period else np.zeros(self.count)
        self.ranges = np.zeros((2, self.count))
        if not track.period:
            self.ranges[:] = ends
            self.ranges[:, train.length] += 0.5, -0.5
        charted = self._along_track(track)
        edges = edges_of_means(track, charted[0].edges, self._length)
        by_length = records_in(self._by_length(charted[0], edges))
        found = [records_in(mean_over_train(chart, edges, self._length, track.period)) for chart in charted]
        for k in range(self.count):
            share = float(k == train.length) - self.strains[k] * self._length
            found[1 + k] = sum_of_records([(1.0, found[1 + k]), (share, by_length)])
        self.records = matched(np.stack(found), edges, is_closed=track.period > 0.0)
        self._edges = edges

    def _along_track(self, track: Chart) -> list[Charted]:
        """Return charts of the potential of a body, and of its derivatives by all parameters at fixed labels, as
        functions of the place along the track.
        """
        edges = track.edges
        for _ in range(MAX_HALVINGS + 1):
            half = 0.5 * np.diff(edges)
            places = edges[:-1, None] + half[:, None] * (1.0 + NODES)
            rows = self._body.path(places.ravel())[POTENTIAL]
            functions = rows[: 1 + self.count]
            functions[1:] += rows[-1] * self.strains[:, None] * places.ravel()
            functions = functions.reshape(-1, *places.shape)
            coefficients = functions @ FIT.T
            above = np.abs(coefficients) > MAX_TAIL * np.abs(functions).max(axis=(1, 2))[:, None, None]
            coarse = above[:, :, -2:].any(axis=(0, 2))
            if not coarse.any():
                break
            edges = np.sort(np.append(edges, (edges[:-1] + half)[coarse]))
        # Derivatives would magnify the noise in trailing coefficients.
        coefficients = up_to_last(above, coefficients)
        slopes = fitted_slopes(coefficients @ AT_NODES) / half[:, None]
        slopes[0] = rows[-1].reshape(places.shape)
        bends = fitted_slopes(slopes) / half[:, None]
        first = (coefficients[:, 0] * (-1.0) ** np.arange(TERMS)).sum(axis=1)
        blocks = blocks_of_functions(edges, first, slopes.swapaxes(0, 1), bends.swapaxes(0, 1), track.period)
        return [Charted(block, edges, True, is_fitted=k > 0) for k, block in enumerate(blocks)]

    def _by_length(self, potential: Charted, edges: Array) -> Array:
        """Return the block of a chart of the derivative of the mean of the potential with respect to the length of the
        train.
        """
        half, block = 0.5 * np.diff(edges), np.ascontiguousarray(potential.block)
        places = edges[:-1, None] + half[:, None] * (1.0 + NODES)
        slopes = slopes_by_length(block, places.ravel(), self._length).reshape(places.shape)
        bends = fitted_slopes(slopes) / half[:, None]
        (made,) = blocks_of_functions(edges, np.zeros(1), slopes[:, None], bends[:, None], self._period)
        return made

    @property
    def unknown(self) -> Array:
        """Whether there is no such track near the value of a parameter: a truth value for each."""
        unknown: Array = np.isnan(self.records[1:, 0, 4])
        return unknown

    def reduced(self, s: Array) -> Array:
        """Return labels within the range of the chart."""
        return s - self._period * np.floor((s - self._edges[0]) / self._period) if self._period else s

    def _pieces(self, s: Array) -> Array:
        """Return the pieces on which labels lie that are within the range of the chart."""
        return np.clip(np.searchsorted(self._edges, s, side="right") - 1, 0, self._edges.size - 2)

    def at(self, s: Array) -> Array:
        """Return the potential and its derivatives by all parameters at labels, and the first two derivatives of these
        by the label, as an array of shape (3, 1 + n, places).
        """
        s = self.reduced(s)
        rows = self.records[:, self._pieces(s)]
        powers = np.vander((s - rows[0, :, 0]) * rows[0, :, 1], TERMS, increasing=True)
        terms = rows[:, :, 6 + TERMS : RECORD].reshape(*rows.shape[:2], -1, TERMS)
        found: Array = np.einsum("knrj,nj->rkn", terms, powers)
        found[0] += rows[:, :, 4]
        return found

    def pairs_at(self, s: Array, rows: Sequence[int]) -> Array:
        """Return the derivatives of the potential by some parameters as two doubles each, at labels of two doubles
        within the range of the chart, as an array of shape (k, 2, n).
        """
        found = np.empty((len(rows), 2, s.shape[1]))
        fill_functions(np.ascontiguousarray(self.records[[1 + k for k in rows]]), self._pieces(s[0]), s, found)
        return found

    def path(self, s: Array) -> PathRows:
        """Return the path of the middle of the train at labels, with derivatives at fixed labels."""
        n, within, (potential, slopes, _) = self.count, self.reduced(s), self.at(s)
        rows = self._body.path(within)
        rows[:, 1 : 1 + n] += self.strains[:, None] * within * rows[:, -1:]
        rows[DS, 1 : 1 + n], rows[DS, -1] = self.strains[:, None], 0.0
        rows[POTENTIAL, : 1 + n], rows[POTENTIAL, -1] = potential, slopes[0]
        return PathRows(rows)


def changes_of(problem: Problem) -> ChangesOfTrain:
    """Return the changes for a launch on the curve of means, which are kept with the run-time parameters."""
    kept = problem.p.conditions
    if "changes" not in kept:
        kept["changes"] = ChangesOfTrain(problem)
    changes: ChangesOfTrain = kept["changes"]
    return changes
