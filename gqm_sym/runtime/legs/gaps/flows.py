"""V**2 and the time on gaps as functions of the speed before them, for laws that depend on the speed (`places`).

Between two breaks of the curve, one number decides all that follows: the speed V at the break before, for a body that
passes one gap or more; or the place of the turn, for a body that leaves a turn in a gap, or arrives at one
(`turn_flows`). Over an octave of speeds, the relative change of V**2 and V times the time are analytic functions of
1/V. They are kept for all bodies as Chebyshev series through the values of a few bodies that are followed panel by
panel. What is kept does not depend on the bodies that ask for it.
"""

from math import fabs, frexp, inf, nan, sqrt
from typing import NamedTuple

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.compiled.intrinsics import fma
from gqm_sym.runtime.compiled.jit import Inlined, Inner
from gqm_sym.runtime.compiled.registers import on_stack
from gqm_sym.runtime.legs.gaps.blocks import ends_of_gap, gap_behind, kept_gap
from gqm_sym.runtime.legs.gaps.data import (
    BLOCK,
    FAR_SHARE,
    FILLED,
    FIRST_LINE,
    LEAST_KAPPA,
    LEAST_N0,
    LINE_COLUMNS,
    LINES,
    REFUSED,
    TAG,
    Bounds,
    fill_load,
    loads_on,
    range_of,
)
from gqm_sym.runtime.legs.panels.breaks import clearance
from gqm_sym.runtime.legs.panels.equation import (
    KAPPA,
    LOAD,
    MEAN,
    N0,
    TAILS,
    TIME_RATE,
    March,
    Panel,
    W,
    marched,
)
from gqm_sym.runtime.legs.panels.polynomials import COUNT, SHARES, WIDE, extent, size_of, to_coefficients
from gqm_sym.runtime.legs.panels.resolution import examine, first_change_of
from gqm_sym.runtime.legs.panels.widest import ALWAYS, PanelRequest, next_panel

# A line of numbers kept of a gap: what it holds (TAG), and whether it is FILLED, or REFUSED; bounds of V**2, less that
# at the break where it is given or sought; of turns, the least and the largest root of the distance from the end of the
# gap, and V**2 at the break for a turn at the latter, and for one at half of it; bounds of n0 and of the curvature,
# where a gap has them (LEAST_N0 to MOST_KAPPA); the number of terms; and the coefficients of two series.
STATE_OF_LINE, LOW_CHANGE, HIGH_CHANGE, BOTTOM, TOP, LIMIT, MIDDLE_LIMIT, TERMS = (*range(1, 7), 11, 12)
FIRST_SERIES = 13
SECOND_SERIES = FIRST_SERIES + WIDE

# The lines of a gap: turns that are left in it, and those that are reached from its start, by the number of gaps, from
# 1 on; those in the near and in the far half of the gap; octaves of speed at its start, and halves of octaves; and
# octaves of a block of gaps, for which there is room beside each of its gaps.
MAX_LEFT, MAX_REACHED, OCTAVES, OCTAVES_OF_BLOCK = 2, 3, 8, 2
LEFT, REACHED, HALVES = 0, MAX_LEFT, MAX_LEFT + MAX_REACHED
PASSED = 3 * HALVES
PASSED_IN_BLOCK = PASSED + 2 * OCTAVES
assert PASSED_IN_BLOCK + OCTAVES_OF_BLOCK == LINES

# Tags are positive: a binary exponent, plus this.
FIRST_TAG = 4096

# The largest of the last coefficients, as a share of the size of a function, with which those beyond are rounding only.
MAX_LAST = 2.0**-49

# The largest coefficients, as a share of the size of a function, that are left out.
LEFT_OUT = 2.0**-58

# The largest number of panels on a gap.
PANELS_ON_GAP = 16

# The values of two functions at the nodes.
FIRST, SECOND = 0, WIDE
value_buffer = on_stack(2 * WIDE)


class Trip(NamedTuple):
    """What a body does on some gaps.

    Attributes
    ----------
    time : float
        The time; NaN if the body does not pass, the panels do not resolve it, or N may change its sign.
    end : float
        V**2 at the end.
    bounds : Bounds
        Bounds of V**2 and of the contact force per mass.
    """

    time: float
    end: float
    bounds: Bounds


UNKNOWN = Bounds(0.0, inf, -inf, inf)


class Travelled(NamedTuple):
    """What a body does on some gaps, panel by panel.

    Attributes
    ----------
    time, end : float
        As in `Trip`.
    v2, n0, kappa : (float, float)
        Bounds of V**2, of n0 and of the curvature.
    """

    time: float
    end: float
    v2: tuple[float, float]
    n0: tuple[float, float]
    kappa: tuple[float, float]


NOTHING = (inf, -inf)


@Inlined
def united(one, other):  # type: ignore[no-untyped-def]
    """Return bounds of the values that are between one or other bounds."""
    return min(one[0], other[0]), max(one[1], other[1])


@Inner
def travel(forces, route, march, v2, first, way, contact_sign, work):  # type: ignore[no-untyped-def]
    """Return what a body does (`Travelled`) over some gaps, or back from a turn if the march runs against the motion.

    It begins at the origin of the march with ``v2``, at the distance ``first`` from the end of the first gap. The
    ``way`` is the index of that gap and the number of gaps.
    """
    (gap, count), u, failed = way, march.direction, Travelled(nan, nan, NOTHING, NOTHING, NOTHING)
    left, passed, time, time_low = 0.0, 0.0, 0.0, 0.0
    of_v2, of_n0, of_kappa = (v2, v2), NOTHING, NOTHING
    for k in range(count):
        if not 0 <= gap + u * k < route.all_breaks.size:
            return failed
        low, high = ends_of_gap(route.all_breaks, route.period, gap + u * k)
        off = clearance(low, high)
        passed += first if k == 0 else high - low
        stop, is_passed = marched(passed, march), False
        for _ in range(PANELS_ON_GAP):
            panel, rest = Panel(left, v2, contact_sign, (low + off, high - off)), stop - left
            request = PanelRequest(rest, rest, of_v2[1], ALWAYS, True, False, False)
            width, _step, timed = next_panel(forces, march, panel, request, work)
            if width == 0.0 or not timed:
                return failed
            examine(work, TIME_RATE, 1.0)
            time, rounding = two_sum(time, width * work[TAILS + 6])
            time_low += rounding
            fill_load(work)
            change, found, touch = first_change_of(work, LOAD, contact_sign, FAR_SHARE * extent(work, MEAN)[1])
            if not (found == contact_sign and min(change, touch) > 1.0):
                return failed
            v2, of_v2 = work[W + COUNT], united(of_v2, range_of(work, W))
            of_n0, of_kappa = united(of_n0, range_of(work, N0)), united(of_kappa, range_of(work, KAPPA))
            is_passed = width == rest
            left = stop if is_passed else left + width
            if is_passed:
                break
        if not (is_passed and v2 > 0.0):
            return failed
    return Travelled(time + time_low, v2, of_v2, of_n0, of_kappa)


@Inner
def widen(gaps, to, at_break, trip, is_first):  # type: ignore[no-untyped-def]
    """Widen the bounds kept in a line for one more body, which has V**2 = ``at_break`` at the break."""
    change = trip.v2[0] - at_break, trip.v2[1] - at_break
    for low, bounds in ((LOW_CHANGE, change), (LEAST_N0, trip.n0), (LEAST_KAPPA, trip.kappa)):
        before = NOTHING if is_first else (gaps[to + low], gaps[to + low + 1])
        gaps[to + low], gaps[to + low + 1] = united(before, bounds)


@Inner
def bounds_in(gaps, to, at_break):  # type: ignore[no-untyped-def]
    """Return the bounds that follow from a line for a body with V**2 = ``at_break`` at the break."""
    return loads_on(gaps, to, max(at_break + gaps[to + LOW_CHANGE], 0.0), at_break + gaps[to + HIGH_CHANGE])


@Inner
def keep_series(values, size, gaps, to):  # type: ignore[no-untyped-def]
    """Keep the series through the values of two functions in a line; return whether what is left out is rounding only.

    ``size`` is what the first one is compared with.
    """
    to_coefficients(values, FIRST, gaps, to + FIRST_SERIES)
    to_coefficients(values, SECOND, gaps, to + SECOND_SERIES)
    last, terms, time_size = 0.0, 1, size_of(values, SECOND)
    for k in range(COUNT):
        share = max(fabs(gaps[to + FIRST_SERIES + k]) / size, fabs(gaps[to + SECOND_SERIES + k]) / time_size)
        terms = k + 1 if share > LEFT_OUT else terms
        last = max(last, share) if k >= COUNT - 3 else last
    gaps[to + TERMS] = terms
    return last <= MAX_LAST


@Inner
def both_series(x, gaps, to):  # type: ignore[no-untyped-def]
    """Return the sums of the two series of a line (`arithmetic.clenshaw`), side by side."""
    first, first_after, second, second_after, twice = 0.0, 0.0, 0.0, 0.0, 2.0 * x
    for k in range(int(gaps[to + TERMS]) - 1, 0, -1):
        first, first_after = fma(twice, first, gaps[to + FIRST_SERIES + k] - first_after), first
        second, second_after = fma(twice, second, gaps[to + SECOND_SERIES + k] - second_after), second
    first = fma(x, first, gaps[to + FIRST_SERIES] - first_after)
    return first, fma(x, second, gaps[to + SECOND_SERIES] - second_after)


@Inner
def fill_octave(forces, route, cell, way, contact_sign, to, work):  # type: ignore[no-untyped-def]
    """Fill the line of an octave of speeds or a part of it, on the ``way`` of `travel`.

    The speeds of the ``cell`` are L/y with the first of its numbers, L, and y from the second to the third.
    """
    (slowest, begin, end), gap = cell, way[0]
    gaps, v, values, size = route.gaps, forces.direction, value_buffer(), 1.0
    gaps[to + STATE_OF_LINE] = REFUSED
    low, high = ends_of_gap(route.all_breaks, route.period, gap)
    march = March((low if v > 0 else high, 0.0), v, 0.0, 1.0)
    # If the slowest body cannot pass, the others need not be followed.
    for j in range(COUNT - 1, -1, -1):
        speed = slowest / (begin + (end - begin) * SHARES[j])
        v2 = speed * speed
        trip = travel(forces, route, march, v2, high - low, way, contact_sign, work)
        if not trip.time > 0.0:
            return
        values[FIRST + j], values[SECOND + j] = (trip.end - v2) / v2, speed * trip.time
        size = max(size, trip.end / v2)
        widen(gaps, to, v2, trip, j == COUNT - 1)
    if keep_series(values, size, gaps, to):
        gaps[to + STATE_OF_LINE] = FILLED


@Inner
def pass_by_flow(forces, route, upcoming, v2, contact_sign, count, work):  # type: ignore[no-untyped-def]
    """Return the `Trip` of a body over 1 gap or BLOCK gaps ahead of the break at ``upcoming``, where V**2 is ``v2``.

    Where not all bodies of its octave can pass, the line is that of half of it.
    """
    v, gaps, speed = forces.direction, route.gaps, sqrt(v2)
    gap, (mantissa, exponent) = gap_behind(route, upcoming, v), frexp(speed)
    if count > 1 and not (gap % BLOCK == (0 if v > 0 else BLOCK - 1) and upcoming + count < route.breaks.size):
        return Trip(nan, nan, UNKNOWN)
    tag, y = exponent + FIRST_TAG, 0.5 / mantissa
    slot = tag % (BLOCK * OCTAVES_OF_BLOCK)
    at, _ = kept_gap(forces, route, upcoming + (slot // OCTAVES_OF_BLOCK if count > 1 else 0), v, contact_sign, work)
    line = PASSED_IN_BLOCK + slot % OCTAVES_OF_BLOCK if count > 1 else PASSED + tag % OCTAVES
    begin, width = 0.5, 0.5
    for level in range(2 if count == 1 else 1):
        if level > 0:
            width = 0.25
            begin = 0.5 if y <= 0.75 else 0.75
            tag = 2 * tag + (0 if y <= 0.75 else 1)
            line = PASSED + OCTAVES + tag % OCTAVES
        to = at + FIRST_LINE + line * LINE_COLUMNS
        if gaps[to + TAG] != tag:
            gaps[to + TAG] = tag
            cell = 0.5 * (speed / mantissa), begin, begin + width
            fill_octave(forces, route, cell, (gap, count), contact_sign, to, work)
        if gaps[to + STATE_OF_LINE] == FILLED:
            x = 2.0 * ((y - begin) / width) - 1.0
            change, time = both_series(x, gaps, to)
            return Trip(time / speed, v2 + v2 * change, bounds_in(gaps, to, v2))
    return Trip(nan, nan, UNKNOWN)
