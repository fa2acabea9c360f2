"""Proofs that the potential rises on both sides of an axis of symmetry, which hold for all orbits of a sweep.

An orbit about the axis is proved if the slope of the potential is positive from the axis, or from a place that is much
nearer to it, up to the turning point: then V**2 vanishes at the ends of the orbit only. The distances at which proofs
end are multiples of an eighth of a power of two, so that a proof serves all orbits that end just before, and the result
for an orbit does not depend on the other orbits of the sweep.
"""

from math import fabs, nan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gqm_sym.runtime.compiled.calls import call_bounds_batch
from gqm_sym.runtime.compiled.intrinsics import bits, choose, from_bits
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.strided import AXIS, PARAMETERS, PLACE_LOW, element
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.ends import MAX_AXIS_STEP_SHARE, NEAR_AXIS
from gqm_sym.runtime.sweep.batch.rows import (
    END_HIGH,
    END_LOW,
    FOUND,
    LANES,
    LAUNCH_PLACE,
    LAUNCH_V2,
    NOWHERE,
    OFFSET_HIGH,
    OFFSET_LOW,
    SEARCH_DIRECTION,
    STATE,
    contains,
)

# Distances from the axis lie between these powers of two, and proofs end at PARTS distances for each of them, that is,
# where the bits of a double from PART_BITS on change: those of its exponent and the first three of its fraction.
LEAST_EXPONENT, LARGEST_EXPONENT, PARTS, PART_BITS = -64, 64, 8, 49
FIRST_PART = (1023 + LEAST_EXPONENT) * PARTS

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
def try_proof(fns, wells, k):  # type: ignore[no-untyped-def]
    """Set what is known of the proof number k."""
    part = FIRST_PART + k
    inner = from_bits(part // PARTS * PARTS << PART_BITS)
    good = rises_up_to(fns, wells, from_bits((part + 1) << PART_BITS), inner)
    wells.proofs[k] = PROVED if good else FAILED


@Inner
def find_proved(fns, wells, distances, state):  # type: ignore[no-untyped-def]
    """Set ``state`` to FOUND for each orbit about the axis that is proved to end at its distance from it, and at its
    mirror image, and to NOWHERE for others; distances may be NaN.
    """
    proofs = wells.proofs
    for j in range(distances.size):  # numba counts references to arrays at each call, so there is none in this loop
        k, state[j] = (bits(distances[j]) >> PART_BITS) - FIRST_PART, NOWHERE
        if 0 <= k < proofs.size:
            if proofs[k] == UNTRIED:
                try_proof(fns, wells, k)
            state[j] = choose(proofs[k] == PROVED, FOUND, NOWHERE)


@Inner
def is_clear_of_axes(distance, start, place, step):  # type: ignore[no-untyped-def]
    """Return whether a body at rest is neither next to an axis at a place nor next to another one, a step away."""
    return (distance > NEAR_AXIS * (fabs(start) + fabs(place))) & (
        (step == 0.0) | (distance < MAX_AXIS_STEP_SHARE * step)
    )


@Inner
def set_ends_from_rest(fns, n, rows, domain, monotone, wells, work):  # type: ignore[no-untyped-def]
    """Set both ends of all orbits if each body is released at rest in a well that is proved to rise on both sides of
    its axis; return whether this is so.

    Such a body turns at its mirror image, so no zero is searched. ``domain`` has the rows DOMAIN_LOW to AXIS_STEP of
    `strided`. If V**2 is ``monotone`` between axes, it is enough that the potential rises half way to the next axis.
    """
    if wells.proofs.size == 0:
        return False
    start, w0, direction = rows[LAUNCH_PLACE, :n], rows[LAUNCH_V2, :n], rows[SEARCH_DIRECTION, :n]
    low, high, a, b = rows[OFFSET_LOW, :n], rows[OFFSET_HIGH, :n], rows[END_LOW, :n], rows[END_HIGH, :n]
    firsts, lasts, periods = domain[0, :n], domain[1, :n], domain[2, :n]
    places, places_low, steps, distances = domain[3, :n], domain[4, :n], domain[5, :n], work[0, :n]
    for j in range(n):
        offset = (start[j] - places[j]) - places_low[j]
        size, image, closed = fabs(offset), -2.0 * offset, periods[j] > 0.0
        clear = is_clear_of_axes(size, start[j], places[j], steps[j])
        length = choose(closed, periods[j], choose(image > 0.0, lasts[j] - start[j], start[j] - firsts[j]))
        inside = (firsts[j] <= start[j]) & (start[j] <= lasts[j]) & (fabs(image) <= length)
        good = (w0[j] == 0.0) & (direction[j] != 0.0) & clear & inside
        far = choose(monotone & (0.5 * steps[j] < size) & (steps[j] > 0.0), 0.5 * steps[j], size)
        distances[j] = choose(good, far, nan)
        low[j], high[j] = choose(image < 0.0, image, 0.0), choose(image < 0.0, 0.0, image)
        a[j], b[j] = start[j] + low[j], start[j] + high[j]
    find_proved(fns, wells, distances, rows[STATE, :n])
    return not contains(rows[STATE, :n], NOWHERE)
