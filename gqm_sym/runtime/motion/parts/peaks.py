"""The place of the peak of a function between two places: that of a polynomial, or by successively finer grids."""

from collections.abc import Callable, Iterator, Sequence
from math import fabs
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from gqm_sym.runtime.arithmetic.doubledouble import ULP
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.motion.parts.searched import size_of

# The number of points of each of the finer grids, and the number of these grids, each of which is 64 times as fine as
# the one before.
GRID_POINTS, GRIDS = 129, 8

# The number of nodes of the polynomial by which a peak is located, and the share of its last coefficients below which
# it counts as exact.
PEAK_NODES, MAX_TAIL = 13, 1e-12

# The distance from a sample at which a value belongs to its own side, if the quantity jumps at the sample; as a share
# of the phase angle.
BESIDE_JOINT = 64.0 * ULP

# Newton's method for the place of a peak ends with a step this short: the error after it is the square of the step.
LAST_STEP, MAX_STEPS = 1e-8, 16

# The nodes from -1 to 1, the matrix from values there to Chebyshev coefficients, and those from these to the
# coefficients of the first and second derivative.
NODES = np.cos(np.pi * (np.arange(PEAK_NODES) + 0.5) / PEAK_NODES)
TO_TERMS = np.linalg.inv(chebyshev.chebvander(NODES, PEAK_NODES - 1))
TO_SLOPE, TO_BEND = (chebyshev.chebder(np.eye(PEAK_NODES), order) for order in (1, 2))

# The largest second derivatives of the polynomials from degree 3 on.
BENDS = np.array([k * k * (k * k - 1.0) / 3.0 for k in range(3, PEAK_NODES)])


class Peak(NamedTuple):
    """The largest value on a grid.

    Attributes
    ----------
    place, value : float
        The place of the largest value, and the value.
    low, high : float
        The neighbouring grid points, between which the next grid lies.
    """

    place: float
    value: float
    low: float
    high: float


def grid_peaks(
    function: Callable[[Array], Array], low: float, high: float, points: int = GRID_POINTS, grids: int = GRIDS
) -> Iterator[Peak]:
    """Yield the largest values of a function on successively finer grids, each between the neighbours of the peak
    before.

    Parameters
    ----------
    function : callable
        A function that takes an array of places and returns an array of values. A NaN counts as the largest value.
    low, high : float
        The ends of the first grid.
    points, grids : int
        The number of points of each grid, and the number of grids.
    """
    for _ in range(grids):
        places = np.linspace(low, high, points)
        values = function(places)
        k = int(np.argmax(values))
        low, high = places[max(k - 1, 0)], places[min(k + 1, points - 1)]
        yield Peak(float(places[k]), float(values[k]), float(low), float(high))


def peak_between(function: Callable[[Array], Array], low: float, middle: float, high: float) -> float:
    """Return the place at which a function is largest between two places, given its largest sample between them."""
    if low == high:
        return middle
    centre, half = 0.5 * (low + high), 0.5 * (high - low)
    values = function(centre + half * NODES)
    if values.max() - values.min() <= 2.0 * ULP * size_of(values):
        return middle  # the function is constant
    beside = min(BESIDE_JOINT * max(abs(low), abs(high)), half)
    candidates = [low + beside, high - beside, low, middle, high]
    if np.isfinite(values).all():
        # Without the differences the rounding of the matrix would be that of the values.
        terms = TO_TERMS @ (values - values[PEAK_NODES // 2])
        sizes = np.abs(terms)
        if sizes[-2:].max() <= MAX_TAIL * np.abs(values).max():
            candidates += [centre + half * x for x in _level_places(terms, sizes)]
            return _largest(function, candidates)
    *_, peak = grid_peaks(function, low, high)
    return _largest(function, [*candidates, peak.place])


def _level_places(terms: Array, sizes: Array) -> Sequence[float]:
    """Return the places from -1 to 1 at which the slope of a Chebyshev series is zero.

    ``sizes`` are the absolute values of its coefficients. By these it may be known that the series is concave, and its
    only such place then is found by Newton's method.
    """
    second = float(terms[2])
    if not BENDS @ sizes[3:] < -4.0 * second:
        roots = chebyshev.chebroots(TO_SLOPE @ terms)
        found: list[float] = roots.real[(np.abs(roots.imag) < 1e-6) & (np.abs(roots.real) <= 1.0)].tolist()
        return found
    slope, bend = (TO_SLOPE @ terms).tolist(), (TO_BEND @ terms).tolist()
    x = min(max(-0.25 * float(terms[1]) / second, -1.0), 1.0)
    for _ in range(MAX_STEPS):
        step = _sum(slope, x) / _sum(bend, x)
        new = min(max(x - step, -1.0), 1.0)
        if fabs(step) <= LAST_STEP:
            return (new,)
        if new == x:  # the slope has one sign
            return ()
        x = new
    return (x,)


def _sum(terms: Sequence[float], x: float) -> float:
    """Return the sum of a Chebyshev series by Clenshaw's recurrence."""
    here = before = 0.0
    for term in terms[:0:-1]:
        here, before = term + 2.0 * x * here - before, here
    return terms[0] + x * here - before


def _largest(function: Callable[[Array], Array], places: list[float]) -> float:
    """Return the place with the largest value; if several are equal within rounding, the last one, which was computed
    most carefully.
    """
    values = function(np.array(places))
    limit = values.max() - 2.0 * ULP * size_of(values)
    return [place for place, value in zip(places, values, strict=True) if value >= limit][-1]
