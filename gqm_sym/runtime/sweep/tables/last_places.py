"""The place on a tabulated curve at which a body is at the last time."""

from math import fabs

import numpy as np

from gqm_sym.runtime.arithmetic.elementary import cos, sin
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.sweep.tables.liftoff import NO_STOP, Stop, place_in_lam
from gqm_sym.runtime.sweep.tables.places import locate
from gqm_sym.runtime.sweep.tables.times import phase_of, time_along

# The largest number of steps of the search for a place, the share of the time that its error is, and the step with
# which the search bisects.
MAX_STEPS, TIME_ERROR, EVERY = 64, 4e-16, 4


@Inner
def distances_after(curve, passage, half_v2_at_edges, ends, time, whole):  # type: ignore[no-untyped-def]
    """Return the distances from both ends of an orbit of the place that a body reaches after a time; NaN if that is not
    accurate.

    Parameters
    ----------
    ends : (here, ahead)
        Those distances of the place at which it begins, and of the end towards which it moves.
    time, whole : float
        The time, and that up to the end.
    """
    (here, ahead), width = ends, passage.width
    before, behind = phase_of(here[0], here[1]), phase_of(ahead[0], ahead[1])
    low, high, last = -time, whole - time, 0
    there = ahead
    for step in range(MAX_STEPS):
        phi = before - low * (behind - before) / (high - low)
        if step % EVERY == EVERY - 1 or not min(before, behind) < phi < max(before, behind):
            phi = 0.5 * (before + behind)
        s, c = sin(0.5 * phi), cos(0.5 * phi)
        there = width * s * s, width * c * c
        late = time_along(curve, passage, half_v2_at_edges, (here, there, ahead), 0) - time
        if late != late:
            return np.nan, np.nan
        if fabs(late) <= TIME_ERROR * time or phi in (before, behind):
            break
        # The value at the end that is kept twice is halved (the Illinois method).
        if late < 0.0:
            before, low, high = phi, late, 0.5 * high if last < 0 else high
            last = -1
        else:
            behind, high, low = phi, late, 0.5 * low if last > 0 else low
            last = 1
    return there


@Inner
def stop_at(curve, orbit, passage, half_v2_at_edges, t_max):  # type: ignore[no-untyped-def]
    """Return whether it is decided where a body is at the last time, before which it does not pass its whole orbit; and
    that place as a `Stop`.

    Where no force depends on the direction of motion, that is the farthest place that it has passed.
    """
    width, last = passage.width, passage.panels - 1
    start, end, here = (0.0, width), (width, 0.0), (-orbit.low, orbit.high)
    ahead, behind = (end, start) if orbit.direction > 0 else (start, end)
    passes_once, turns = orbit.circulates or orbit.leaves == orbit.direction, 0
    whole, time = time_along(curve, passage, half_v2_at_edges, (here, ahead, ahead), 0), t_max
    while time >= whole and not passes_once and turns < 2:
        if turns == 0 and not curve.directed and time < 2.0 * whole:
            j, x = (last, passage.high_x) if orbit.direction > 0 else (0, passage.low_x)
            return True, Stop(place_in_lam(curve, passage, j, x), j, x, 1)
        time, turns = time - whole, turns + 1
        here, ahead, behind = ahead, behind, ahead
        whole = time_along(curve, passage, half_v2_at_edges, (here, ahead, ahead), 0)
    if turns == 2 and not curve.directed:
        return True, NO_STOP
    if not 0.0 < time < whole:
        return False, NO_STOP
    below, above = distances_after(curve, passage, half_v2_at_edges, (here, ahead), time, whole)
    if not below >= 0.0:
        return False, NO_STOP
    place = orbit.lam0 + (orbit.low + below if below < above else orbit.high - above)
    index, x, _ = locate(curve.table, curve.period, place)
    j = index - passage.first
    if not 0 <= j <= last:
        return False, NO_STOP
    if j == 0:
        x = max(x, passage.low_x)
    if j == last:
        x = min(x, passage.high_x)
    return True, Stop(place, j, x, turns)
