"""The selection of smoothing: the weight of roughness, and the distance of the knots that it needs.

A weight is described by its width w: the spline keeps waves longer than about 2 pi w and removes shorter ones. Widths
are tried on knots that are close enough for them and not much closer, from coarse to fine: knots at every one of a
million points would cost time and digits, and say nothing that a few hundred do not.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from gqm_sym.budgets import spend
from gqm_sym.errors import DeclarationError
from gqm_sym.smoothing.splines import ORDER, Array, Basis, Fit, Smoother

# Pieces of the coarsest grid of knots, and how many times as many the next one has.
COARSEST = 8
FINER = 4
# A grid is for widths from this many of its pieces on; the next coarser one for those beyond FINER times as many.
PIECES = 2.0
# Between one width that is tried and the next. The criteria are so flat that nothing between them is better by much.
RATIO = 1.12
# The least width that is tried, in typical distances of points: the spline interpolates them.
LEAST = 0.003
# Knots at the points are at least this share of their usual distance apart.
APART = 0.05
# How much a fitted number is charged. 1 would be fair for the places of points. Curvature asks for somewhat more
# smoothing, and cross-validation that charges 1 now and then takes noise for bends (Kim and Gu 2004: 1.4).
CHARGE = 1.4
# Grids finer than this many pieces are tried as long as they find better widths.
ENOUGH = 2000
# Cross-validation of points that are met exactly.
TINY = 1e-300


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """A smoothing spline, and what it was chosen by.

    Attributes
    ----------
    smoother, fit
        What makes the spline, and the spline.
    weight, width : float
        Of its roughness, and the width that this means.
    score : float
        The criterion, least of all that were tried.
    places : array or None
        The places that its knots are at, where these are the points' own.
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

    For a standard deviation s of the points it is Mallows' C_p, residual + 2 s**2 freedom: up to a constant an unbiased
    estimate of the distance of the spline from the true places of the points. (To ask for a residual of n s**2, the
    discrepancy principle, fails where there are many points, as s is never known well enough for it.) Without one it is
    generalised cross-validation: how far splines through all points but one are from that one. The largest likelihood
    was tried as well; it lets so much noise through that loads are two to four times as wrong.

    Of noise only the part across the track is left in the residual, as the places along it are those nearest to the
    points: a point brings one number, and not two, or in space two, and not three. So many ``across`` the track are.
    """

    count: int
    deviation: float | None
    across: int

    def __call__(self, fit: Fit) -> float:
        """The logarithm of what is least for the best spline."""
        if self.deviation is not None:
            total = fit.residual + 2.0 * CHARGE * self.across * self.deviation**2 * fit.freedom
            return float(np.log(max(total / self.count, TINY)))
        left = 1.0 - CHARGE * fit.freedom / self.count
        return float(np.log(max(fit.residual / self.count, TINY)) - 2.0 * np.log(left)) if left > 0.0 else np.inf


def choose(u: Array, points: Array, period: float | None, deviations: Sequence[float | None]) -> Choice:
    """The best smoothing spline through points at places; of several criteria' best ones the smoothest.

    Parameters
    ----------
    u : (n,) array
        Within one period, if there is one.
    points : (n, d) array
    period : float or None
        Of a closed track.
    deviations : floats or None
        Standard deviations of the points; None: by cross-validation.
    """
    low = float(u.min())
    high = float(u.max()) if period is None else low + period
    per_length = len(u) / (high - low)
    best: dict[float | None, Choice] = {}
    top = high - low
    for sites, bottom, places in _grids(u, low, high, period is not None):
        spend()
        basis = Basis.between(sites, closed=period is not None)
        widths = top * RATIO ** -np.arange(np.ceil(np.log(top / bottom) / np.log(RATIO)) + 1.0)
        weights = per_length * widths ** (2 * ORDER)
        top = bottom
        try:
            smoother = Smoother(u, points, basis, float(weights[-1]))
            fits = [smoother.fit(float(weight)) for weight in weights]
        except np.linalg.LinAlgError:  # knots closer than doubles resolve
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
        if basis.size > ENOUGH and not better:
            break
    if not best:
        raise DeclarationError(
            "sampled: smoothing: no smooth track was found; are the points in order along it? If their scatter goes on "
            "from point to point, give its standard deviation"
        )
    return max(best.values(), key=lambda choice: choice.width)


def _grids(u: Array, low: float, high: float, closed: bool) -> Iterator[tuple[Array, float, Array | None]]:
    """Knots, the least width that they are for, and the places of points where these are the knots."""
    length = high - low
    usual = max(float(np.median(np.diff(np.sort(u)))), length / (4.0 * len(u)))
    pieces = COARSEST
    while length / pieces > FINER * usual and pieces * FINER < len(u):
        yield np.linspace(low, high, pieces + 1), PIECES * length / pieces, None
        pieces *= FINER
    places = _apart(u, APART * usual, high if closed else None)
    # The knots of an interpolating spline, which leaves out two at each end.
    sites = np.append(places, high) if closed else np.concatenate([places[:1], places[ORDER:-ORDER], places[-1:]])
    yield sites, LEAST * usual, places


def _apart(u: Array, least: float, high: float | None) -> Array:
    """Places in order without those that are too near to the one before, or to the end of the round."""
    places = np.unique(u)
    kept = [float(places[0])]
    for place in places[1:].tolist():
        if place - kept[-1] > least and (high is None or high - place > least):
            kept.append(place)
    if high is None:
        kept[-1] = float(places[-1])
    return np.array(kept)
