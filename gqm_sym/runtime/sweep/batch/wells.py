"""Proofs that the potential rises on both sides of a place, which hold for all orbits of a sweep.

The place is an axis of symmetry, or the bottom of a well. An orbit about it is proved if the potential rises from the
place, or from one that is much nearer to it, up to both turning points: then V**2 vanishes at the ends of the orbit
only. The distances at which proofs end are multiples of an eighth of a power of two, so that a proof serves all orbits
that end just before, and the result for an orbit does not depend on the other orbits of the sweep.
"""

from math import fabs, nan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gqm_sym.runtime.compiled.calls import call_bounds_batch, call_potential_divdiff1_batch
from gqm_sym.runtime.compiled.intrinsics import bits, choose, from_bits
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import borrowed
from gqm_sym.runtime.compiled.strided import AXIS, PARAMETERS, PLACE_LOW, element
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.ends import MAX_AXIS_STEP_SHARE, NEAR_AXIS
from gqm_sym.runtime.launch.zeros import CUSP_SHARE
from gqm_sym.runtime.sweep.batch.rows import (
    AXIS_OFFSET,
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


# The largest number of steps in which the bottom of a well is found, and the width, relative to the place, of the
# interval in which it is known then. Ends of orbits may be rounded by END_ROUNDING of places.
MAX_STEPS, BOTTOM_WIDTH, END_ROUNDING = 20, 2.0**-51, 4.0 * 2.0**-52

# The number of ranges, each of them half as far from the place as the one before, that are divided into LANES parts
# where bounds on the whole ranges do not prove that the potential rises.
DIVIDED_RANGES = 6


class WellSide(NamedTuple):
    """What is known of one side of a place, or of both sides of an axis of symmetry.

    Attributes
    ----------
    proofs : int array
        UNTRIED, PROVED or FAILED for each distance at which proofs end; empty if launches differ in their parameters,
        or if there is no such place.
    place : (1,) array
        The place; NaN while it is not known.
    sign : float
        1 for the side above the place and for axes, -1 for the side below it.
    params : (count, LANES) array
        The parameters of all launches, once for each lane.
    work : (8, LANES) array
        Work space.
    """

    proofs: NDArray[np.int8]
    place: Array
    sign: float
    params: Array
    work: Array


class Wells(NamedTuple):
    """The wells of a sweep: the one about its axis of symmetry, and the sides of the well of its first orbit."""

    about_axis: WellSide
    above: WellSide
    below: WellSide


@Inner
def wells_of(columns):  # type: ignore[no-untyped-def]
    """Return the wells of the launches in ``columns``, of which nothing is known yet."""
    count, known = columns.shape[0] - PARAMETERS, True
    params, work = np.empty((count, LANES)), np.empty((8, LANES))
    for row in range(count):
        known = known and columns[PARAMETERS + row, 1] == 0
        params[row] = element(columns, PARAMETERS + row, 0) if known else nan
    axis, size, of_axis = np.full(1, nan), PARTS * (LARGEST_EXPONENT - LEAST_EXPONENT) if known else 0, 0
    if known and columns[AXIS, 1] == 0 and columns[PLACE_LOW, 1] == 0:
        axis[0], low = element(columns, AXIS, 0), element(columns, PLACE_LOW, 0)
        of_axis = size if axis[0] - axis[0] == 0.0 and low == low else 0
    bottom = np.full(1, nan)
    return Wells(
        WellSide(np.zeros(of_axis, dtype=np.int8), axis, 1.0, params, work),
        WellSide(np.zeros(size, dtype=np.int8), bottom, 1.0, params, work),
        WellSide(np.zeros(size, dtype=np.int8), bottom, -1.0, params, work),
    )


@Inner
def borrowed_side(side):  # type: ignore[no-untyped-def]
    """Return a side with arrays whose references numba does not count."""
    place, params, work = borrowed(side.place), borrowed(side.params), borrowed(side.work)
    return WellSide(borrowed(side.proofs), place, side.sign, params, work)


@Inner
def borrowed_wells(wells):  # type: ignore[no-untyped-def]
    """Return the wells with arrays whose references numba does not count."""
    return Wells(borrowed_side(wells.about_axis), borrowed_side(wells.above), borrowed_side(wells.below))


@Inner
def rises_up_to(fns, side, distance, inner):  # type: ignore[no-untyped-def]
    """Return whether the potential rises up to a distance from the place and ds is positive there.

    ``inner`` is a smaller distance. The first lane contains the range between both; each of the others, except the
    last, contains the outer half of what remains. In the last one the potential may fall, from rounding of the place,
    by less than it rises in the lane before.
    """
    near, far, rises, box = side.work[0], side.work[1], side.work[2], side.work[4:8]
    place, above = side.place[0], side.sign > 0.0
    far[0] = place + side.sign * distance
    for i in range(1, LANES):
        near[i - 1] = far[i] = place + side.sign * inner
        inner *= 0.5
    near[LANES - 1] = place
    call_bounds_batch(fns.bounds, LANES, near if above else far, far if above else near, side.params, box)
    good = True
    for i in range(LANES):
        rises[i] = box[0, i] if above else -box[1, i]
        good = good and box[2, i] > CUSP_SHARE * box[3, i]
    for i in range(LANES - 1):
        good = good and rises[i] > 0.0
    return good and -rises[LANES - 1] < rises[LANES - 2]


@Inner
def rises_in_parts(fns, side, distance, inner):  # type: ignore[no-untyped-def]
    """Return what `rises_up_to` does, by bounds on parts of each range.

    Where terms of the potential cancel, bounds on whole ranges are too wide. Close to the place the potential may fall
    by less than it rises farther out, up to ``inner``.
    """
    near, far, box, rise = side.work[0], side.work[1], side.work[4:8], 0.0
    place, above = side.place[0], side.sign > 0.0
    for k in range(DIVIDED_RANGES + 1):
        is_last = k == DIVIDED_RANGES
        step = 0.0 if is_last else (distance - inner) / LANES
        for i in range(LANES):
            far[i] = place + side.sign * (distance - i * step)
            near[i] = place + side.sign * (distance - (i + 1) * step)
        near[LANES - 1] = place if is_last else place + side.sign * inner
        call_bounds_batch(fns.bounds, LANES, near if above else far, far if above else near, side.params, box)
        for i in range(LANES):
            rises = box[0, i] if above else -box[1, i]
            if not (box[2, i] > CUSP_SHARE * box[3, i] and (rises > 0.0 or is_last)):
                return False
            rise += step * rises if k > 0 else 0.0
        distance, inner = distance if is_last else inner, 0.5 * inner
    last = box[0, LANES - 1] if above else -box[1, LANES - 1]
    return -last * distance < rise


@Inner
def try_proof(fns, side, k):  # type: ignore[no-untyped-def]
    """Set what is known of the proof number k."""
    part = FIRST_PART + k
    inner = from_bits(part // PARTS * PARTS << PART_BITS)
    distance = from_bits((part + 1) << PART_BITS)
    good = rises_up_to(fns, side, distance, inner) or rises_in_parts(fns, side, distance, inner)
    side.proofs[k] = PROVED if good else FAILED


@Inner
def find_proved(fns, side, distances, state):  # type: ignore[no-untyped-def]
    """Set ``state`` to FOUND for each orbit that is proved not to end before its distance from the place, and to
    NOWHERE for others; distances may be NaN. About an axis the same is proved of its mirror image.
    """
    proofs = side.proofs
    for j in range(distances.size):  # numba counts references to arrays at each call, so there is none in this loop
        k, state[j] = (bits(distances[j]) >> PART_BITS) - FIRST_PART, NOWHERE
        if 0 <= k < proofs.size:
            if proofs[k] == UNTRIED:
                try_proof(fns, side, k)
            state[j] = choose(proofs[k] == PROVED, FOUND, NOWHERE)


@Inner
def find_bottom(fns, side, low, high):  # type: ignore[no-untyped-def]
    """Set the place of a side to a minimum of the potential between two turning points."""
    places, none, out = side.work[0], side.work[1], side.work[2:5]
    none[:] = 0.0
    for _ in range(MAX_STEPS):
        step = (high - low) / (LANES + 1)
        for i in range(LANES):
            places[i] = low + (i + 1) * step
        call_potential_divdiff1_batch(fns.potential_divdiff1, LANES, places, places, none, side.params, out)
        for i in range(LANES):  # up to the first place where the potential rises
            if places[i] < high:
                low, high = (places[i], high) if out[2, i] < 0.0 else (low, places[i])
        if not high - low > BOTTOM_WIDTH * (fabs(low) + fabs(high)):
            break
    side.place[0] = low


@Inner
def prove_in_well(fns, wells, n, rows, work):  # type: ignore[no-untyped-def]
    """Set STATE to FOUND for orbits that are proved to lie in the well of the first orbit of the sweep, else to
    NOWHERE.
    """
    a, b, state = rows[END_LOW, :n], rows[END_HIGH, :n], rows[STATE, :n]
    if wells.above.place[0] != wells.above.place[0]:
        find_bottom(fns, wells.above, a[0], b[0])
    place, distances, proved_below = wells.above.place[0], work[0, :n], work[1, :n]
    for j in range(n):
        distances[j] = (place - a[j]) + END_ROUNDING * (fabs(place) + fabs(a[j]))
    find_proved(fns, wells.below, distances, proved_below)
    for j in range(n):
        distances[j] = (b[j] - place) + END_ROUNDING * (fabs(place) + fabs(b[j]))
    find_proved(fns, wells.above, distances, state)
    for j in range(n):
        state[j] = choose(proved_below[j] == FOUND, state[j], NOWHERE)


@Inner
def prove_about_axis(fns, wells, n, rows, work):  # type: ignore[no-untyped-def]
    """Set STATE to FOUND for orbits about the axis that are proved, else to NOWHERE."""
    distances = work[0, :n]
    for j in range(n):
        distances[j] = 0.5 * (rows[OFFSET_HIGH, j] - rows[OFFSET_LOW, j])
    find_proved(fns, wells.about_axis, distances, rows[STATE, :n])


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

    Such a body turns at its mirror image, so no zero is searched. ``domain`` has the rows DOMAIN_LOW to AXIS_STEP_LOW
    of `strided`. If V**2 is ``monotone`` between axes, it is enough that the potential rises half way to the next axis.
    """
    if wells.about_axis.proofs.size == 0:
        return False
    start, w0, direction = rows[LAUNCH_PLACE, :n], rows[LAUNCH_V2, :n], rows[SEARCH_DIRECTION, :n]
    low, high, a, b = rows[OFFSET_LOW, :n], rows[OFFSET_HIGH, :n], rows[END_LOW, :n], rows[END_HIGH, :n]
    firsts, lasts, periods = domain[0, :n], domain[1, :n], domain[2, :n]
    places, steps, offsets, distances = domain[3, :n], domain[5, :n], rows[AXIS_OFFSET, :n], work[0, :n]
    for j in range(n):
        size, image, closed = fabs(offsets[j]), -2.0 * offsets[j], periods[j] > 0.0
        clear = is_clear_of_axes(size, start[j], places[j], steps[j])
        length = choose(closed, periods[j], choose(image > 0.0, lasts[j] - start[j], start[j] - firsts[j]))
        inside = (firsts[j] <= start[j]) & (start[j] <= lasts[j]) & (fabs(image) <= length)
        good = (w0[j] == 0.0) & (direction[j] != 0.0) & clear & inside
        far = choose(monotone & (0.5 * steps[j] < size) & (steps[j] > 0.0), 0.5 * steps[j], size)
        distances[j] = choose(good, far, nan)
        low[j], high[j] = choose(image < 0.0, image, 0.0), choose(image < 0.0, 0.0, image)
        a[j], b[j] = start[j] + low[j], start[j] + high[j]
    find_proved(fns, wells.about_axis, distances, rows[STATE, :n])
    return not contains(rows[STATE, :n], NOWHERE)
