"""Proofs that the potential rises on both sides of an axis of symmetry, which hold for all orbits of a sweep.

An orbit about the axis is proved if the slope of the potential is positive from the axis, or from a place that is much
nearer to it, up to the turning point: then V**2 vanishes at the ends of the orbit only. The distances at which proofs
end are multiples of an eighth of a power of two, so that a proof serves all orbits that end just before, and the result
for an orbit does not depend on the other orbits of the sweep.
"""

from math import frexp, nan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gqm_sym.runtime.compiled.calls import call_bounds_batch
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.strided import AXIS, PARAMETERS, PLACE_LOW, element
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.sweep.batch.rows import FOUND, LANES, NOWHERE, OFFSET_HIGH, OFFSET_LOW, STATE

# Distances from the axis lie between these powers of two, and proofs end at so many distances for each of them.
LEAST_EXPONENT, LARGEST_EXPONENT, PARTS = -64, 64, 8

# What is known of the proof up to a distance.
UNTRIED, PROVED, FAILED = range(3)


class Wells(NamedTuple):
    """What is known of the wells about the axis of symmetry of a sweep.

    Attributes
    ----------
    proofs : int array
        UNTRIED, PROVED or FAILED for each distance at which proofs end; empty if launches differ in their parameters,
        or if there is no axis.
    place : float
        The axis.
    params : (count, LANES) array
        The parameters of all launches, once for each lane.
    work : (6, LANES) array
        Work space.
    """

    proofs: NDArray[np.int64]
    place: float
    params: Array
    work: Array


@Inner
def wells_of(columns):  # type: ignore[no-untyped-def]
    """Return the wells of the launches in ``columns``, of which nothing is known yet."""
    count, known, place = columns.shape[0] - PARAMETERS, columns[AXIS, 1] == 0 and columns[PLACE_LOW, 1] == 0, nan
    params = np.empty((count, LANES))
    for row in range(count):
        known = known and columns[PARAMETERS + row, 1] == 0
        params[row] = element(columns, PARAMETERS + row, 0) if known else nan
    if known:
        place, low = element(columns, AXIS, 0), element(columns, PLACE_LOW, 0)
        known = place - place == 0.0 and low == low
    size = PARTS * (LARGEST_EXPONENT - LEAST_EXPONENT) if known else 0
    return Wells(np.zeros(size, dtype=np.int64), place, params, np.empty((6, LANES)))


@Inner
def rises_up_to(fns, wells, distance, inner):  # type: ignore[no-untyped-def]
    """Return whether the slope of the potential and ds are positive up to a distance from the axis.

    ``inner`` is a smaller distance. The first lane contains the range between both; each of the others, except the
    last, contains the outer half of what remains. In the last one the slope may be negative from rounding of the axis,
    by less than it is positive in the lane before.
    """
    lo, hi, box = wells.work[0], wells.work[1], wells.work[2:6]
    hi[0] = wells.place + distance
    for i in range(1, LANES):
        lo[i - 1] = hi[i] = wells.place + inner
        inner *= 0.5
    lo[LANES - 1] = wells.place
    call_bounds_batch(fns.bounds, LANES, lo, hi, wells.params, box)
    good = box[2, LANES - 1] > 0.0 and -box[0, LANES - 1] < box[0, LANES - 2]
    for i in range(LANES - 1):
        good = good and box[0, i] > 0.0 and box[2, i] > 0.0
    return good


@Inner
def is_proved(fns, wells, distance):  # type: ignore[no-untyped-def]
    """Return whether V**2 of an orbit that ends at a distance from the axis is proved to vanish there only."""
    share, exponent = frexp(distance)
    if not (distance > 0.0 and LEAST_EXPONENT <= exponent < LARGEST_EXPONENT):
        return False
    part = int((share - 0.5) * (2 * PARTS))
    k = (exponent - LEAST_EXPONENT) * PARTS + part
    if wells.proofs[k] == UNTRIED:
        inner = 0.5 * distance / share
        good = rises_up_to(fns, wells, inner * (1.0 + (part + 1) / PARTS), inner)
        wells.proofs[k] = PROVED if good else FAILED
    return wells.proofs[k] == PROVED


@Inner
def find_proved(fns, n, rows, wells):  # type: ignore[no-untyped-def]
    """Set STATE to FOUND for the orbits about the axis that are proved, and to NOWHERE for others."""
    for j in range(n):
        distance = 0.5 * (rows[OFFSET_HIGH, j] - rows[OFFSET_LOW, j])
        rows[STATE, j] = FOUND if is_proved(fns, wells, distance) else NOWHERE
