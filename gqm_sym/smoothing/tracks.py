"""Conversion of surveyed points to a smooth track: the place of each point along it, the spline, and its errors.

The places of the points along the track are unknown as well. Chord lengths from point to point are a first
approximation, but noise lengthens them; so the track is fitted again a few times, each time at the arc lengths of its
places nearest to the points. Noise that is once taken for bends of the track would remain in all further fits.
Therefore the first fits, in which noise along the track is in the residual too, use the smoother of the splines by
cross-validation and by the given standard deviation.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import reduce
from math import ceil, pi, sqrt
from typing import Any, NamedTuple

import numpy as np

from gqm_sym.budgets import check_budget
from gqm_sym.errors import DeclarationError
from gqm_sym.smoothing.report import Smoothing
from gqm_sym.smoothing.selection import MIN_KNOT_DISTANCE, Choice, choose
from gqm_sym.smoothing.splines import Array, Smoother

# The number of coordinates of a track that is not in space.
PLANE = 2
# The number of fits; after the second little changes.
FITS = 4
LAST = 2
# The distance from an end within which the largest third derivative is found, in widths.
END_WIDTHS = 6.0
# The number of Newton steps to the place nearest to a point.
STEPS = 4
# The smallest value used for the derivative of a distance, as a share of its value on a straight track.
MIN_SLOPE_SHARE = 0.3
# The number of nodes for the length of half a piece of the spline.
NODES = 6
# The number of points of the smoothed track in a width, for which the interpolant has the curvature to some 1e-4.
POINTS_PER_WIDTH = 4.0
# The smallest number of points of a smoothed track, and of places at which its errors are stated.
MIN_POINTS = 16
# A point is an outlier if its distance from the track is this many times the usual one, and this share of the usual
# chord.
OUTLIER_RATIO = 10.0
OUTLIER_SHARE = 0.1
# The standard deviation of a normal variable, in medians of its absolute value.
MEDIAN = 1.4826
# A track that turns by more than this within its width, or from point to point, is out of order.
MAX_TURN = 0.5 * pi
# The largest number of places at which errors are stated, and the limit of work for them.
PLACES = 2000
MAX_WORK = 100_000_000


class _Track(NamedTuple):
    """A spline through points, their places along it, and its period if it has one."""

    choice: Choice
    spline: Any
    u: Array
    period: float | None

    def at(self, u: Array) -> Array:
        """Return points of the track, which is straight beyond open ends."""
        basis = self.choice.smoother.basis
        inside = u if basis.closed else np.clip(u, basis.low, basis.high)
        points: Array = self.spline(inside) + self.spline(inside, 1) * (u - inside)[:, None]
        return points

    def heading(self, u: Array) -> Array:
        """Return the unit tangents of the track."""
        basis = self.choice.smoother.basis
        first = self.spline(u if basis.closed else np.clip(u, basis.low, basis.high), 1)
        tangents: Array = first / _length(first)[:, None]
        return tangents


def smooth(
    given: Sequence[Sequence[float]],
    rows: Sequence[int],
    *,
    closed: bool,
    deviation: float | None,
    angles: Sequence[float] = (),
) -> tuple[Array, Smoothing]:
    """Smooth the points of a track.

    Parameters
    ----------
    given : (n, d) array
        Points; a closed track does not repeat its first one.
    rows : (n,) ints
        The numbers of the points in messages.
    closed : bool
        Whether the track continues from the last point to the first.
    deviation : float or None
        The standard deviation of the points in each coordinate; None to find it by cross-validation.
    angles : n floats, optional
        The roll angle at each point, which is smoothed as much as the coordinates.

    Returns
    -------
    places : (m, d) array
        Points of the smooth track, as many as an interpolating spline needs to represent it; with angles there is one
        more column.
    report : Smoothing
        The changes that smoothing made, and the accuracy of the track.

    Raises
    ------
    DeclarationError
        If a point is far away from the track through the others, or the track turns too sharply.
    """
    points: Array = np.asarray(given, dtype=np.float64)
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    centred = points - middle  # the shape then keeps all digits
    track = _fitted(centred, closed, deviation)
    nearest = track.at(track.u)
    off, along = centred - nearest, track.heading(track.u)
    shifts = _across(along, off)
    _check_shifts(np.abs(shifts), centred, rows, deviation)
    places = _places(track, closed)
    report = _report(track, places, deviation, shifts)
    _check_turns(track, report, rows)
    smoothed = middle + track.at(places)
    if len(angles):
        smoothed = np.column_stack([smoothed, _roll_angles(track, np.asarray(angles, dtype=np.float64), places)])
    return smoothed, replace(report, points=points, places=middle + nearest)


def _length(vectors: Array) -> Array:
    """Return the lengths of vectors in rows."""
    length: Array = reduce(np.hypot, vectors.T)
    return length


def _across(along: Array, off: Array) -> Array:
    """Return the distances of vectors from directions: in a plane positive to the left, in space without a sign."""
    if off.shape[1] == PLANE:
        left: Array = along[:, 0] * off[:, 1] - along[:, 1] * off[:, 0]
        return left
    return _length(np.cross(along, off))


def _roll_angles(track: _Track, angles: Array, places: Array) -> Array:
    """Return roll angles at places of a track, from those measured at its points."""
    choice, u, rate = track.choice, track.u, 0.0
    basis = choice.smoother.basis
    angles = np.unwrap(np.append(angles, angles[0]))
    if basis.closed:  # the increase over a lap is taken as linear, and the rest is periodic
        rate = (angles[-1] - angles[0]) / (basis.high - basis.low)
    smoother = Smoother(u, (angles[:-1] - rate * u)[:, None], basis, choice.weight)
    found: Array = basis.spline(smoother.fit(choice.weight).coefficients)(places)[:, 0] + rate * places
    return found


def _fitted(points: Array, closed: bool, deviation: float | None) -> _Track:
    """Return the smooth track, in its own arc length from the place of the first point."""
    around = np.concatenate([points, points[:1]]) if closed else points
    lengths = np.concatenate([[0.0], np.cumsum(_length(np.diff(around, axis=0)))])
    dimension = points.shape[1]
    u, period = lengths[: len(points)], float(lengths[-1]) if closed else None
    for count in range(1, FITS + 1):
        deviations = [deviation]
        if deviation is not None and count <= FITS - LAST:
            deviations = [None, sqrt(dimension / (dimension - 1)) * deviation]
        choice = choose(u, points, period, deviations)
        track = _Track(choice, choice.smoother.basis.spline(choice.fit.coefficients), u, period)
        u = _nearest(track, points)
        if count < FITS:
            u, period = _measured(track, u)
    return track._replace(u=u)


def _nearest(track: _Track, points: Array) -> Array:
    """Return the places of a track that are nearest to points, by Newton's method from the previous places."""
    basis, u = track.choice.smoother.basis, track.u
    for _ in range(STEPS):
        check_budget()
        inside = u if basis.closed else np.clip(u, basis.low, basis.high)
        first, second, off = track.spline(inside, 1), track.spline(inside, 2), points - track.at(u)
        square = np.square(first).sum(axis=1)
        slope = square - np.where(u == inside, (off * second).sum(axis=1), 0.0)
        farthest = np.sqrt(np.square(off).sum(axis=1) / square)
        u = u + np.clip((off * first).sum(axis=1) / np.maximum(slope, MIN_SLOPE_SHARE * square), -farthest, farthest)
    return u


def _measured(track: _Track, u: Array) -> tuple[Array, float | None]:
    """Return the arc length from the place of the first point to places of a track, within one lap, and the length of
    the lap.
    """
    from scipy.interpolate import CubicHermiteSpline

    basis, spline = track.choice.smoother.basis, track.spline
    sites = np.unique(basis.knots[(basis.low <= basis.knots) & (basis.knots <= basis.high)])
    edges = np.unique(np.concatenate([sites, 0.5 * (sites[1:] + sites[:-1])]))
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    half = 0.5 * np.diff(edges)
    inside = (edges[:-1] + half)[:, None] + half[:, None] * nodes
    lengths = np.concatenate([[0.0], np.cumsum(half * (_speed(spline, inside) @ weights))])
    speeds = _speed(spline, edges)
    length = CubicHermiteSpline(edges, lengths, speeds)
    if basis.closed:
        first, *_ = around = length(basis.low + np.remainder(u - basis.low, basis.high - basis.low))
        return np.remainder(around - first, lengths[-1]), float(lengths[-1])
    within = np.clip(u, basis.low, basis.high)
    ends = np.where(u < basis.low, speeds[0], speeds[-1])
    straight: Array = length(within) + (u - within) * ends
    return straight - straight[0], None


def _speed(spline: Any, u: Array) -> Array:
    first = np.moveaxis(spline(u, 1), -1, 0)
    speed: Array = reduce(np.hypot, first)
    return speed


def _places(track: _Track, closed: bool) -> Array:
    """Return the places at which the track is sampled from its spline: those of the points, or as many as its width
    requires.
    """
    choice, basis = track.choice, track.choice.smoother.basis
    low, high = track.u[0], track.u[-1]
    if closed:
        high = low + basis.high - basis.low
    else:
        low, high = max(low, basis.low), min(high, basis.high)
    if choice.places is not None and choice.width < np.median(np.diff(choice.places)):
        period = basis.high - basis.low
        inner = np.sort(low + np.remainder(choice.places - low, period)) if closed else choice.places
        least = MIN_KNOT_DISTANCE * float(np.median(np.diff(inner)))
        inner = inner[(inner > low + least) & (inner < high - least)]
        places = np.concatenate([[low], inner, [high]])
    else:
        places = np.linspace(low, high, max(MIN_POINTS, ceil(POINTS_PER_WIDTH * (high - low) / choice.width)) + 1)
    return places[:-1] if closed else places


def _report(track: _Track, places: Array, deviation: float | None, shifts: Array) -> Smoothing:
    """Return the report on a smooth track, to which the caller adds the points."""
    choice = track.choice
    fit = choice.fit
    across = track.spline.c.shape[1] - 1
    estimate = sqrt(fit.residual / (across * max(len(shifts) - fit.freedom, 1.0)))
    most = max(MIN_POINTS, min(PLACES, MAX_WORK // choice.smoother.basis.size))
    reported = places if len(places) <= most else places[np.linspace(0, len(places) - 1, most).astype(np.int64)]
    first, second = track.spline(reported, 1), track.spline(reported, 2)
    speed = _length(first)
    lengths, _ = _measured(track._replace(u=reported), reported)
    scatter = estimate if deviation is None else deviation
    return Smoothing(
        given=deviation,
        standard_deviation=estimate,
        rms=sqrt(float(np.square(shifts).mean())),
        largest_shift=float(np.abs(shifts).max()),
        parameter=choice.weight,
        width=choice.width,
        degrees_of_freedom=fit.freedom,
        s=lengths,
        curvature=_across(first, second) / speed**3,
        curvature_error=np.hypot(scatter * choice.smoother.spread(fit, reported, 2), _end_errors(track, reported))
        / speed**2,
        points=np.empty((0, across + 1)),
        places=np.empty((0, across + 1)),
        places_s=_measured(track, track.u)[0],
        shifts=shifts,
    )


def _end_errors(track: _Track, u: Array) -> Array:
    """Return the error of the second derivative near open ends that is due to the condition of a vanishing third
    derivative there.

    If the true third derivative is b, the error is 2 b times the width at the end, and decays within some widths: it is
    the solution of ``d = width**6 D^6 d`` that has ``D^3 d = -b`` and no higher derivatives there. The largest third
    derivative nearby is used for b. (It was tried to prescribe the third derivative at the ends from values inside, but
    that is wrong as often.)
    """
    choice, basis = track.choice, track.choice.smoother.basis
    errors: Array = np.zeros(len(u))
    if basis.closed:
        return errors
    for end, sign in ((basis.low, 1.0), (basis.high, -1.0)):
        near = np.clip(
            end + sign * np.linspace(0.0, END_WIDTHS, 10 * int(END_WIDTHS)) * choice.width, basis.low, basis.high
        )
        largest = float(_length(track.spline(near, 3)).max())
        x = np.maximum(sign * (u - end), 0.0) / choice.width
        turn = 0.5 * sqrt(3.0) * x
        taken = np.exp(-x) + np.exp(-0.5 * x) * (np.cos(turn) + np.sin(turn) / sqrt(3.0))
        errors = np.hypot(errors, choice.width * largest * taken)
    return errors


def _check_shifts(shifts: Array, points: Array, rows: Sequence[int], deviation: float | None) -> None:
    """Refuse a point that is far away from the track through all of them."""
    usual = max(MEDIAN * float(np.median(shifts)), deviation or 0.0)
    worst = int(shifts.argmax())
    chord = float(np.median(_length(np.diff(points, axis=0))))
    if shifts[worst] > max(OUTLIER_RATIO * usual, OUTLIER_SHARE * chord):
        raise DeclarationError(
            f"sampled: row {rows[worst]}: is {shifts[worst]:.3g} m from the smooth track, where the points scatter by "
            f"{usual:.3g} m; leave it out if it is stray, or give the standard deviation as smoothing"
        )


def _check_turns(track: _Track, report: Smoothing, rows: Sequence[int]) -> None:
    """Refuse a track that folds back."""
    k = int(np.abs(report.curvature).argmax())
    usual = float(np.median(np.abs(np.diff(track.u))))
    turn = abs(float(report.curvature[k])) * max(report.width, usual)
    if turn > MAX_TURN:
        row = rows[int(np.abs(report.places_s - report.s[k]).argmin())]
        raise DeclarationError(
            f"sampled: row {row}: the smooth track turns by {turn * 180.0 / pi:.0f} degrees there within "
            f"{max(report.width, usual):.3g} m; are the points in "
            "order along it, without a stray one, and is smoothing as large as their scatter?"
        )
