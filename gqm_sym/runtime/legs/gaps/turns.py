"""Turns that are found by the data kept of the gaps between two breaks of the curve."""

from math import inf

from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.legs.gaps.blocks import kept_gap
from gqm_sym.runtime.legs.gaps.data import FILLED, fill_load, read_rows, solve_towards_turn
from gqm_sym.runtime.legs.panels.breaks import offset
from gqm_sym.runtime.legs.panels.equation import LOAD, MEAN, SERIES, W
from gqm_sym.runtime.legs.panels.point import ZERO_TOLERANCE
from gqm_sym.runtime.legs.panels.polynomials import COUNT, extent, size_of, sum_and_slope, to_coefficients
from gqm_sym.runtime.legs.panels.resolution import CANCELLATION_NOISE, first_change_of
from gqm_sym.runtime.legs.runs.route import CurveAhead

# A turn nearer to the start of a gap than this share of it is sought with the mean force from there, which must be more
# than a share of its largest values.
SHORT_SHARE, LEAST_MEAN = 0.25, 0.125

# The number of gaps on which a turn is sought. Gaps before the one with the turn are passed as elsewhere.
GAPS_TO_TURN = 4


@Inner
def distance_to_turn(v2, turn, width, work):  # type: ignore[no-untyped-def]
    """Return the distance from the start of a gap or of its first part, where V**2 is ``v2``, at which it vanishes,
    near the zero x = ``turn`` of the series of W; infinity if that has none, and 0 if the distance is not resolved.

    Of a short distance that series has few digits. But the force times exp(q) has the mean ``-v2/d`` up to the distance
    d where V**2 vanishes, and this mean has its digits if it is not small.
    """
    share = 0.5 * (1.0 + turn)
    if share > SHORT_SHARE:
        return width * share if share <= 1.0 else inf
    to_coefficients(work, MEAN, work, SERIES)
    c = work[SERIES : SERIES + COUNT]
    far = v2 / -sum_and_slope(c, turn)[0]
    # A step of Newton's method, written so that nothing is subtracted from the distance.
    share = far / width
    mean, slope = sum_and_slope(c, 2.0 * share - 1.0)
    far = (v2 - 2.0 * share * far * slope) / -(mean + 2.0 * share * slope)
    return far if -mean >= LEAST_MEAN * size_of(work, MEAN) else 0.0


@Inner
def turn_on_gaps(forces, march, route, timed, largest_v2, ahead, work):  # type: ignore[no-untyped-def]
    """Return the distance at which a body that becomes slower turns, by the rows kept of the next gaps, and the data of
    the curve ahead of it there; the distance is 0 if they do not show a turn, or N may change its sign before.

    V**2 is a polynomial on each gap, so that the curve is not evaluated.

    Parameters
    ----------
    timed : LastTimed
        The break at which the body is, with V**2 and the sign of N there.
    largest_v2 : float
        The largest V**2 so far.
    ahead : CurveAhead
    """
    v, nu, v2, first, breaks = march.direction, timed.contact_sign, timed.v2, ahead.upcoming, route.breaks
    if nu in (0, -route.only_sign) or route.gaps.size == 0 or first + 1 >= breaks.size:
        return 0.0, ahead
    # If a panel is laid once more, the break at which the body is lies behind already.
    if offset(breaks[first], march.origin, v) != timed.distance:
        return 0.0, ahead
    for upcoming in range(first, min(first + GAPS_TO_TURN, breaks.size - 1)):
        begin = offset(breaks[upcoming], march.origin, v)
        at, width = kept_gap(forces, route, upcoming, v, nu, work)
        if route.gaps[at] != FILLED:
            break
        part = width
        if forces.linear:
            read_rows(v2, width, route.gaps, at, work)
        else:
            part = solve_towards_turn(forces, v2, width, route.gaps, at, work)
        if part == 0.0:
            break
        noise = CANCELLATION_NOISE * max(largest_v2, extent(work, W)[1])
        turn, _, touch = first_change_of(work, W, 1, noise)
        far = distance_to_turn(v2, turn, part, work)
        fill_load(work)
        load, _, no_load = first_change_of(work, LOAD, nu, ZERO_TOLERANCE * extent(work, MEAN)[1])
        # Behind the turn V**2 is negative, and N may be anything.
        if not (touch > 1.0 and min(load, no_load) > min(turn, 1.0) and far > 0.0):
            break
        if far < inf:
            return begin + far, CurveAhead(upcoming + 1, ahead.span, inf, True)
        v2 = work[W + COUNT]
        # Where the body does not become slower, this is not the end of its leg.
        if part < width or not noise < v2 <= work[W]:
            break
    return 0.0, ahead
