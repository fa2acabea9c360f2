"""The selection of the smoothing: the weight of roughness, and the distance between the knots that it requires.

A weight is described by its width w: the spline keeps waves longer than about 2 pi w and removes shorter ones. Widths
are tried on knots that are close enough for them and not much closer, from coarse to fine: knots at every one of a
million points would cost time and digits, and would not give more information than a few hundred.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from gqm_sym.budgets import check_budget
from gqm_sym.errors import DeclarationError
from gqm_sym.smoothing.splines import ORDER, Array, Basis, Fit, Smoother

# The number of pieces of the coarsest grid of knots, and the factor by which it grows from one grid to the next.
COARSEST_PIECES = 8
REFINEMENT = 4
# A grid is used for widths of at least this many of its pieces, and the next coarser one from REFINEMENT times
# as many on.
PIECES = 2.0
# The ratio of one tried width to the next. The criteria are so flat that no width in between is much better.
RATIO = 1.12
# The smallest width that is tried, in typical distances of points, for which the spline interpolates them.
MIN_WIDTH = 0.003
# The smallest distance between knots at the points, as a share of the usual distance between points.
MIN_KNOT_DISTANCE = 0.05
# The cost of a fitted number in the criteria. For the places of points it would be 1. Curvature requires somewhat more
# smoothing, and cross-validation with 1 sometimes takes noise for bends (Kim and Gu 2004: 1.4).
PARAMETER_COST = 1.4
# Grids finer than this many pieces are tried as long as they find better widths.
ENOUGH_PIECES = 2000
# The value of cross-validation for points that are met exactly.
MIN_SCORE = 1e-300


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """A smoothing spline, and the criterion by which it was chosen.

    Attributes
    ----------
    smoother, fit
        The maker of the spline, and the spline.
    weight, width : float
        The weight of roughness, and the corresponding width.
    score : float
        The value of the criterion, the smallest of all that were tried.
    places : array or None
        The places of its knots, if these are at points.
    """

    smoother: Smoother
    fit: Fit
    weight: float
    width: float
    score: float
    places: Array | None


@dataclass(frozen=True, slots=True)
class Criterion:
    """The function to be minimised.

    With a standard deviation s of the points it is Mallows' C_p, residual + 2 s**2 freedom, which is up to a constant
    an unbiased estimate of the distance of the spline from the true places of the points. (The discrepancy principle,
    which requires a residual of n s**2, fails for many points, because s is never known accurately enough.) Without s
    it is generalised cross-validation: the distance of each point from the spline through all other points. Maximum
    likelihood was tried as well; it lets so much noise through that the errors of loads are two to four times as large.

    Only the component of the noise across the track remains in the residual, because the places along it are those
    nearest to the points. A point therefore contributes one number and not two, or in space two and not three; this
    number is ``across``.
    """

    count: int
    deviation: float | None
    across: int

    def __call__(self, fit: Fit) -> float:
        """Return the logarithm of the function that is smallest for the best spline."""
        if self.deviation is not None:
            total = fit.residual + 2.0 * PARAMETER_COST * self.across * self.deviation**2 * fit.freedom
            return float(np.log(max(total / self.count, MIN_SCORE)))
        left = 1.0 - PARAMETER_COST * fit.freedom / self.count
        return float(np.log(max(fit.residual / self.count, MIN_SCORE)) - 2.0 * np.log(left)) if left > 0.0 else np.inf


def choose(u: Array, points: Array, period: float | None, deviations: Sequence[float | None]) -> Choice:
    """Return the best smoothing spline through points at places; with several criteria, the smoothest of their best
    splines.

    Parameters
    ----------
    u : (n,) array
        The places of the points, within one period if there is one.
    points : (n, d) array
    period : float or None
        The period of a closed track; None for an open one.
    deviations : floats or None
        Standard deviations of the points; None to use cross-validation.
    """
    low = float(u.min())
    high = float(u.max()) if period is None else low + period
    per_length = len(u) / (high - low)
    best: dict[float | None, Choice] = {}
    top = high - low
    for sites, bottom, places in _grids(u, low, high, period is not None):
        check_budget()
        basis = Basis.between(sites, closed=period is not None)
        widths = top * RATIO ** -np.arange(np.ceil(np.log(top / bottom) / np.log(RATIO)) + 1.0)
        weights = per_length * widths ** (2 * ORDER)
        top = bottom
        try:
            smoother = Smoother(u, points, basis, float(weights[-1]))
            fits = [smoother.fit(float(weight)) for weight in weights]
        except np.linalg.LinAlgError:  # the knots would be closer than doubles resolve
            break
        better = False
        for deviation in deviations:
            criterion = Criterion(len(u), deviation, points.shape[1] - 1)
            scores = [criterion(fit) for fit in fits]
            k = int(np.argmin(scores))
            if deviation not in best or scores[k] < best[deviation].score:
                better = True
                best[deviation] = Choice(
                    smoother=smoother,
                    fit=fits[k],
                    weight=float(weights[k]),
                    width=float(widths[k]),
                    score=scores[k],
                    places=places,
                )
        if basis.size > ENOUGH_PIECES and not better:
            break
    if not best:
        raise DeclarationError(
            "sampled: smoothing: no smooth track was found; are the points in order along it? If their scatter goes on "
            "from point to point, give its standard deviation"
        )
    return max(best.values(), key=lambda choice: choice.width)


def _grids(u: Array, low: float, high: float, closed: bool) -> Iterator[tuple[Array, float, Array | None]]:
    """Yield knots, the smallest width for which they are used, and the places of points if these are the knots."""
    length = high - low
    usual = max(float(np.median(np.diff(np.sort(u)))), length / (4.0 * len(u)))
    pieces = COARSEST_PIECES
    while length / pieces > REFINEMENT * usual and pieces * REFINEMENT < len(u):
        yield np.linspace(low, high, pieces + 1), PIECES * length / pieces, None
        pieces *= REFINEMENT
    places = _spaced(u, MIN_KNOT_DISTANCE * usual, high if closed else None)
    # These are the knots of an interpolating spline, which omits two places at each end.
    sites = np.append(places, high) if closed else np.concatenate([places[:1], places[ORDER:-ORDER], places[-1:]])
    yield sites, MIN_WIDTH * usual, places


def _spaced(u: Array, least: float, high: float | None) -> Array:
    """Return places in order, without those that are too near to the one before or to the end of the lap."""
    places = np.unique(u)
    kept = [float(places[0])]
    for place in places[1:].tolist():
        if place - kept[-1] > least and (high is None or high - place > least):
            kept.append(place)
    if high is None:
        kept[-1] = float(places[-1])
    return np.array(kept)
