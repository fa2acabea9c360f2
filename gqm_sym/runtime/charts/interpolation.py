"""The quintic spline through points, whose knots are its own arc lengths at the points.

The knots are the lengths of the chords at first, then the lengths of the spline found before, until they no longer
change. A closed spline is periodic. At the ends of an open one, three neighbouring polynomials are the same
("not-a-knot"), which is accurate where points are close. Through few points such a spline may swing next to its ends.
The natural spline, whose third and fourth derivatives vanish at the ends as those of a smoothing spline do, is taken
through at most FEW_POINTS points, so that it changes smoothly with them, and where the other one swings more and more.
"""

from collections.abc import Sequence
from functools import reduce
from math import sqrt
from typing import Any, Literal, TypeAlias

import numpy as np
from numba import types

from gqm_sym.budgets import check_budget
from gqm_sym.errors import SolutionError
from gqm_sym.runtime.charts.arc_length import summed
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.types import Array

DEGREE = 5
Ends: TypeAlias = Literal["periodic", "not-a-knot", "natural"]

# The lengths between points have converged when their relative change is below this; each iteration gains some digits.
MAX_LAST_CHANGE = 1e-9
MAX_ITERATIONS = 10

# An open spline through at most so many points is natural.
FEW_POINTS = 12

# The largest distance between a spline and its points, as a share of the largest coordinate, that is rounding.
MAX_MISSING = 2.0 * 2.0**-52

# A spline whose distance from a point is below this share of the track's length passes through it to rounding. No
# points are left out any more when only MIN_POINTS remain.
MAX_FIT_ERROR = 8.0 * 2.0**-52
MIN_POINTS = 64


def arc_length_knots(points: Array, closed: bool) -> tuple[Array, Ends]:
    """Return the arc lengths of the interpolating spline at its points, which are its knots, and what its ends are.

    Raises
    ------
    SolutionError
        If the splines swing more and more between the points.
    """
    choices: tuple[Ends, ...] = ("not-a-knot", "natural") if len(points) > FEW_POINTS else ("natural",)
    for ends in ("periodic",) if closed else choices:
        knots = _converged(points, ends)
        if knots is not None:
            return knots, ends
    raise SolutionError(
        "sampled: no smooth track through these points was found; give more of them where the track bends most, or "
        "declare planes (kind 'linear')"
    )


def _converged(points: Array, ends: Ends) -> Array | None:
    """Return the knots; None if the lengths between them change more and more."""
    knots, changes = summed(reduce(np.hypot, np.diff(points, axis=0).T)), [np.inf]
    while len(changes) <= MAX_ITERATIONS and changes[-1] > MAX_LAST_CHANGE:
        check_budget()
        try:
            lengths = _lengths(knots, polynomials(interpolated(points, knots, ends), knots))
        except (np.linalg.LinAlgError, ValueError):
            return None
        changes.append(float(np.abs(lengths / np.diff(knots) - 1.0).max()))
        if changes[-1] > max(1.0, changes[1]):
            return None
        knots = summed(lengths)
    return knots if changes[-1] <= changes[1] else None


def interpolated(points: Array, knots: Array, ends: Ends, at_end: Sequence[Any] = (0.0, 0.0)) -> Any:
    """Return the interpolating spline of each column of ``points``, as a `scipy.interpolate.BSpline`.

    ``at_end`` contains the third and the fourth derivative of a natural spline at its last knot. Where rounding makes
    the spline pass beside its points, that of what is missing is added, as in iterative refinement.
    """
    spline = _solved(points, knots, ends, at_end)
    missing = points - spline(knots)
    if np.abs(missing).max() > MAX_MISSING * np.abs(points).max():
        missing[-1] = missing[0] if ends == "periodic" else missing[-1]
        spline.c += _solved(missing, knots, ends, (0.0, 0.0)).c
    return spline


def _solved(points: Array, knots: Array, ends: Ends, at_end: Sequence[Any]) -> Any:
    """Return the interpolating spline as SciPy solves for it."""
    from scipy.interpolate import make_interp_spline

    conditions: Any = "periodic" if ends == "periodic" else None
    if ends == "natural":
        conditions = tuple(
            [(order, np.broadcast_to(value, points.shape[1:])) for order, value in zip((3, 4), side, strict=True)]
            for side in ((0.0, 0.0), at_end)
        )
    return make_interp_spline(knots, points, k=DEGREE, bc_type=conditions)


def polynomials(spline: Any, knots: Array) -> Array:
    """Return the coefficients of all columns of a spline between its knots, in powers of the distance from the knot
    before.
    """
    terms = np.empty((knots.size - 1, spline.c.shape[1], DEGREE + 1))
    share = 1.0
    for power in range(DEGREE + 1):
        terms[:, :, power] = share * spline(knots[:-1], power)
        share /= power + 1.0
    return terms


def thinned(points: Array, knots: Array, ends: Ends) -> tuple[Array, Array]:
    """Omit every second point as long as the spline through the others passes through all points to rounding.

    The rounding error of a spline's curvature is that of its points divided by the square of their distance. So points
    that are closer than necessary make it less accurate.
    """
    while len(knots) > MIN_POINTS:
        used = np.unique(np.append(np.arange(0, len(knots), 2), len(knots) - 1))
        spline = interpolated(points[used], knots[used], ends)
        if np.abs(spline(knots) - points).max() > MAX_FIT_ERROR * knots[-1]:
            break
        points, knots = points[used], knots[used]
    return points, knots


@Inner
def velocity(terms, t):  # type: ignore[no-untyped-def]
    """Return the first derivative of a polynomial."""
    total = 0.0
    for power in range(DEGREE, 0, -1):
        total = total * t + power * terms[power]
    return total


@entry(types.float64[::1](types.float64[::1], types.float64[:, :, ::1]))
def _measure(knots, terms):  # type: ignore[no-untyped-def]
    """Return the length of each polynomial, by Simpson's rule with one step of Richardson's extrapolation."""
    out = np.empty(knots.size - 1)
    for k in range(out.size):
        width = knots[k + 1] - knots[k]
        speeds = np.empty(9)
        for i in range(9):
            square = 0.0
            for row in range(terms.shape[1]):
                rate = velocity(terms[k, row], i * width / 8.0)
                square += rate * rate
            speeds[i] = sqrt(square)
        coarse = speeds[0] + 4.0 * (speeds[2] + speeds[6]) + 2.0 * speeds[4] + speeds[8]
        odd = speeds[1] + speeds[3] + speeds[5] + speeds[7]
        fine = speeds[0] + 4.0 * odd + 2.0 * (speeds[2] + speeds[4] + speeds[6]) + speeds[8]
        coarse, fine = coarse * width / 12.0, fine * width / 24.0
        out[k] = fine + (fine - coarse) / 15.0
    return out


def _lengths(knots: Array, terms: Array) -> Array:
    lengths: Array = _measure(knots, terms)
    return lengths
