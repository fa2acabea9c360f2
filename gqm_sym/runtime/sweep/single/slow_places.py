"""The time between two places of an orbit on which V**2 almost vanishes, because the body only just passes a hilltop.

Near a hilltop V**2 is a small difference of large terms. The orbit is cut into parts, each of which begins at a local
minimum of V**2. There V**2 and the slope of the potential are found in double-double arithmetic, from the module's
formulas as a tape. From there on V**2 only grows; its growth is found from second divided differences in doubles, so
that nothing cancels.
"""

from math import fabs, nan, sqrt
from typing import Any, NamedTuple

import numpy as np
from numba import types

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.compiled.calls import call_effective_potential, call_potential_divdiff1
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import on_stack
from gqm_sym.runtime.compiled.types import MATRIX, VECTOR
from gqm_sym.runtime.double_double.arithmetic import add
from gqm_sym.runtime.double_double.interpreter import LOW, call_interpreter
from gqm_sym.runtime.double_double.quadrature import TAPE, energy_level, fill_parameters
from gqm_sym.runtime.quadrature.substitution import FROM_SLOW, FROM_SLOW_TURN
from gqm_sym.runtime.quadrature.time_panels import are_accurate, orbit_panels
from gqm_sym.runtime.sweep.orbit import Orbit
from gqm_sym.runtime.sweep.single.orbit_extremes import (
    GRID_INTERVALS,
    GRID_POINTS,
    V2,
    WHOLE,
    WIDTH_SHARES,
    sample_loads,
)

# The smallest V**2 between turning points for which its place and times are accurate, as a share of the largest V**2.
MIN_V2_SHARE = 1e-9

# The share of V**2 at launch below which V**2 elsewhere, as its difference from that, has lost digits; and the half
# width of the interval in which an equilibrium is sought where V**2 is smallest or largest, as a share of the orbit's
# width. In flat wells whose terms cancel that place is rough, and the interval is widened so many times by a factor.
MIN_SHARE_OF_LAUNCH, EQUILIBRIUM_SHARE = 0.25, 1e-5
WIDENINGS, WIDENED = 3, 16.0

# The largest number of parts of an orbit, and the number of times that the interval of the grid in which V**2 is
# smallest is halved.
MAX_PARTS, HALVINGS = 16, 36

# The largest number of steps of Newton's method to a turning point, and the share of the slope there by which a last
# step may change it.
MAX_STEPS, LAST_PLACES = 4, 2.0**-51


class RecordedFormulas(NamedTuple):
    """A module's formulas as a tape, with registers and parameters (`recording.BoundTape`). If there are no registers,
    there is no tape.
    """

    tape: Any
    work: Any
    parameters: Any


EXACT = types.NamedTuple((TAPE, VECTOR, MATRIX), RecordedFormulas)
NO_TAPE = RecordedFormulas((0, np.empty((0, 4), dtype=np.int64), (0,) * 3, (0,) * 6), np.empty(0), np.empty((2, 0)))

grid_buffer, place_buffer, point_buffer = on_stack(GRID_POINTS), on_stack(MAX_PARTS), on_stack(4)


@Inner
def fill_exactly(curve, lam0, places, lows, count, v2, slopes):  # type: ignore[no-untyped-def]
    """Fill in V**2 and the slope of the potential at some places, given in two doubles each, rounded from double-double
    arithmetic.
    """
    tape, work, p = curve.exact
    for k in range(p.shape[1]):
        p[0, k] = curve.p[k]
    fill_parameters(tape, p, work)
    address, operations, parts, registers = tape
    at = registers[1]
    work[at], work[at + LOW] = lam0, 0.0
    for i in range(count):
        work[at + 1 + i], work[at + 1 + i + LOW] = places[i], lows[i]
    call_interpreter(address, operations, parts[0], parts[2], work, count + 1)
    level, low, _ = energy_level(work, registers, (lam0, 0.0, curve.v0, 0.0), 0)
    for i in range(count):
        u = registers[2] + 1 + i
        high, high_low = add(level, low, -work[u], -work[u + LOW])
        v2[i], slopes[i] = 2.0 * (high + high_low), work[registers[4] + 1 + i]


@Inner
def slope_at(curve, place):  # type: ignore[no-untyped-def]
    """Return the slope of the effective potential at a place."""
    point = point_buffer()
    point[0] = place
    call_effective_potential(curve.fns.effective_potential, 1, point, curve.p, point[1:])
    return point[2]


@Inner
def equilibrium_between(curve, low, high, before):  # type: ignore[no-untyped-def]
    """Return the place between two others at which the slope of the potential no longer has the sign of ``before``."""
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if slope_at(curve, middle) * before > 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@Inner
def exact_extreme_speed(curve, orbit, value, share):  # type: ignore[no-untyped-def]
    """Return the least or largest speed of an orbit, given its value in doubles and the share of the orbit's width at
    which it is; NaN if that has lost most of its digits and there is no tape.

    In doubles V**2 is the difference from its value at launch, whose terms cancel beside equilibria. Where V**2 is
    smallest or largest inside the orbit, the potential has an equilibrium, on which an error of the place does not
    count. In even wells the middle is such a place, and few potentials have terms that cancel there.
    """
    if not value > 0.0 or value * value == orbit.v2 or (orbit.even and not orbit.circulates):
        return value
    if curve.exact.work.size == 0:
        return value if value * value >= MIN_SHARE_OF_LAUNCH * orbit.v2 else nan
    width = orbit.high - orbit.low
    place, low_part = two_sum(orbit.lam0, orbit.low + width * share)
    reach, within = EQUILIBRIUM_SHARE * width, min(share, 1.0 - share) * width
    before, after = slope_at(curve, place - reach), slope_at(curve, place + reach)
    for _ in range(WIDENINGS):
        if before * after <= 0.0 or WIDENED * reach > within:
            break
        reach *= WIDENED
        before, after = slope_at(curve, place - reach), slope_at(curve, place + reach)
    if before < 0.0 and after > 0.0 and reach == EQUILIBRIUM_SHARE * width:
        # At the bottom of a well V**2 is large, and one step of the secant method does.
        place, low_part = place - reach * (after + before) / (after - before), 0.0
    elif before * after < 0.0:
        place, low_part = equilibrium_between(curve, place - reach, place + reach, before), 0.0
    places, lows, v2, slopes = place_buffer(), place_buffer(), place_buffer(), place_buffer()
    places[0], lows[0] = place, low_part
    fill_exactly(curve, orbit.lam0, places, lows, 1, v2, slopes)
    square = v2[0]
    return sqrt(square) if square > 0.0 else nan


@Inner
def rate_at(curve, orbit, place):  # type: ignore[no-untyped-def]
    """Return the time per unit of the parameter at a place where V**2 does not vanish; 0 if doubles do not resolve
    it.
    """
    point = point_buffer()
    point[0], point[1] = place, place - orbit.lam0
    call_potential_divdiff1(curve.fns.potential_divdiff1, 1, orbit.lam0, point[:1], point[1:2], curve.p, point[2:])
    v2 = orbit.v2 - 2.0 * point[1] * point[2]
    return point[3] / sqrt(v2) if v2 > 0.0 else 0.0


@Inner
def improve_turns(curve, orbit, turns, count, places, lows, v2, slopes):  # type: ignore[no-untyped-def]
    """Fill in V**2 and the slope of the potential at some places, after steps of Newton's method by which the first and
    the last one are turning points to twice the digits, if ``turns`` says that they are; return whether they are.

    Beside a hilltop a body turns where the slope is so small that a rounding of the place would tell.
    """
    before = slopes[0], slopes[count - 1]
    for step in range(MAX_STEPS):
        fill_exactly(curve, orbit.lam0, places, lows, count, v2, slopes)
        is_settled = True
        for end in range(2):
            k = count - 1 if end else 0
            if turns[end] and v2[k] != 0.0:
                lows[k] += 0.5 * v2[k] / slopes[k]
                is_settled &= step > 0 and fabs(slopes[k] - before[end]) <= LAST_PLACES * fabs(slopes[k])
        if is_settled:
            return True
        before = slopes[0], slopes[count - 1]
    return False


@Inner
def time_in_parts(curve, orbit, ends, turns):  # type: ignore[no-untyped-def]
    """Return the time that the body takes from one place of its orbit to a higher one; NaN if it is not accurate.

    Parameters
    ----------
    curve : SweptCurve
        A curve with formulas.
    orbit : Orbit
        The orbit.
    ends : ((float, float), (float, float))
        Both places, as two doubles each.
    turns : (bool, bool)
        Whether each of them is a turning point.
    """
    fns, p, none, last = curve.fns, curve.p, curve.joints[:0], GRID_INTERVALS
    ((first, first_low), (final, final_low)), lam0 = ends, orbit.lam0
    begin, end = (first - lam0) + first_low, (final - lam0) + final_low
    if not begin < end:
        return 0.0 if begin == end else nan
    v2, cuts, places = grid_buffer(), place_buffer(), place_buffer()
    lows, slowest, slopes = place_buffer(), place_buffer(), place_buffer()
    part_orbit = Orbit(False, False, orbit.direction, lam0, orbit.v2, begin, end, 0)
    sample_loads(curve, part_orbit, (V2, 0, *WHOLE), WIDTH_SHARES, GRID_POINTS, v2, v2, False)
    count, peak, at_peak, largest = 0, -1.0, 0, 0.0
    for i in range(GRID_POINTS):
        largest = max(largest, v2[i])
        if v2[i] > peak:
            peak, at_peak = v2[i], i
        is_least = (i == 0 or v2[i] < v2[i - 1]) and (i == last or v2[i] <= v2[i + 1])
        if not is_least:
            continue
        if count == MAX_PARTS:
            return nan
        place = first if i == 0 else final
        if 0 < i < last:
            width = end - begin
            low, high = lam0 + (begin + width * WIDTH_SHARES[i - 1]), lam0 + (begin + width * WIDTH_SHARES[i + 1])
            place = equilibrium_between(curve, low, high, 1.0)
        places[count], lows[count] = place, 0.0
        cuts[count] = first if count == 0 else lam0 + (begin + (end - begin) * WIDTH_SHARES[at_peak])
        peak, count = v2[i], count + 1
    at_turns = turns[0] and places[0] == first, turns[1] and places[count - 1] == final
    lows[0] = first_low if at_turns[0] else lows[0]
    lows[count - 1] = final_low if at_turns[1] else lows[count - 1]
    if not improve_turns(curve, orbit, at_turns, count, places, lows, slowest, slopes):
        return nan
    total = 0.0
    for k in range(count):
        place, w = places[k], slowest[k]
        at_turn = (k == 0 and at_turns[0]) or (k == count - 1 and at_turns[1])
        if not (at_turn or w > MIN_V2_SHARE * largest):
            return nan
        for side in range(2):
            stop = cuts[k] if side == 0 else (cuts[k + 1] if k + 1 < count else final)
            if stop == place:
                continue
            panels = orbit_panels(fns, p, FROM_SLOW_TURN if at_turn else FROM_SLOW, place, stop, slopes[k], w, none)
            if not are_accurate(panels):
                return nan
            total += panels.times[-1]
    beside_first, beside_final = cuts[1] if count > 1 else final, cuts[count - 1]
    first_low = lows[0] if at_turns[0] else first_low
    final_low = lows[count - 1] if at_turns[1] else final_low
    total -= first_low * rate_at(curve, orbit, beside_first if turns[0] else first)
    return total + final_low * rate_at(curve, orbit, beside_final if turns[1] else final)


@Inner
def turns_at(orbit):  # type: ignore[no-untyped-def]
    """Return whether the lower and the upper end of an orbit are turning points that the body reaches."""
    if orbit.leaves == 0:
        return not orbit.circulates, not orbit.circulates
    turns = orbit.v2 == 0.0 or orbit.leaves != orbit.direction
    return turns and orbit.leaves > 0, turns and orbit.leaves < 0


@Inner
def passing_time(curve, orbit, place):  # type: ignore[no-untyped-def]
    """Return the first time at ``place`` or, if that is NaN, the time of half a period, of a lap or until the body
    leaves; NaN if it is not certain.

    The orbit's turning points must be accurate to all digits, and the body must reach the place.
    """
    low, high, direction, turns = orbit.low, orbit.high, orbit.direction, turns_at(orbit)
    launch, lower, upper = (orbit.lam0, 0.0), two_sum(orbit.lam0, low), two_sum(orbit.lam0, high)
    if place != place and orbit.leaves == 0:
        return time_in_parts(curve, orbit, (lower, upper), turns)
    ahead, laps, lap, target = place - orbit.lam0, 0.0, 0.0, (place, 0.0)
    if place != place:
        ahead, target = (high, upper) if orbit.leaves > 0 else (low, lower)
    elif orbit.circulates:
        width = high - low
        laps = np.floor(direction * ahead / width)
        ahead -= direction * laps * width
        target = two_sum(orbit.lam0, ahead)
        lap = time_in_parts(curve, orbit, (lower, upper), turns) if laps > 0.0 else 0.0
    at_low, at_high = turns[0] and ahead <= low, turns[1] and ahead >= high
    if direction * ahead >= 0.0:
        begins, stops = turns[0] and low == 0.0, turns[1] and high == 0.0
        ends = (launch, target) if direction > 0 else (target, launch)
        flags = (begins, at_high) if direction > 0 else (at_low, stops)
        return laps * lap + time_in_parts(curve, orbit, ends, flags)
    if direction > 0:
        there = time_in_parts(curve, orbit, (launch, upper), (False, True))
        return there + time_in_parts(curve, orbit, (target, upper), (at_low, True))
    there = time_in_parts(curve, orbit, (lower, launch), (True, False))
    return there + time_in_parts(curve, orbit, (lower, target), (True, at_high))
