"""The start of a run, and the curve ahead of it and of each of its panels."""

from math import inf, sqrt
from typing import NamedTuple

from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.legs.panels.breaks import offset, span_before, within
from gqm_sym.runtime.legs.panels.equation import March, marched
from gqm_sym.runtime.legs.panels.point import LEAST_V2, point_buffer, sign_of_load, slope_of_v2
from gqm_sym.runtime.legs.runs.leg_variable import BranchPoint

# The largest width of the first panel of a leg, and of the first one after a break, as a share of the distance over
# which the acceleration there would stop the body.
STOPPING_SHARE = 2.0

# The share of a panel before a turn below which the panel is limited to the surroundings of the turn; the smallest
# share of it that is tried next; and the least V**2 at its start, as a share of the largest before, for which that is
# done.
LEAST_SHARE_TO_TURN, NARROWER, KNOWN_V2_SHARE = 1.0 / 16.0, 2.0**-20, 2.0**-10

# The number of integration steps to the place at which a slowly moving body would have been at rest.
REST_STEPS = 4


class RunStart(NamedTuple):
    """The start of a run.

    Attributes
    ----------
    place, place_low : float
        The place as two doubles.
    v2 : float
        V**2.
    direction : int
        The sign of dlam/dt.
    contact_sign : int
        The sign of N; 0 if it has to be determined.
    step : float
        The first width to try, as a distance.
    no_turn_until : float
        The distance up to which no turn is expected, however slow the body becomes.
    width : float
        The approximate length of the leg, if it begins at a turn; 0 if that is unknown.
    blocks : int
        The number of blocks (`whole_tables`) with which the leg is first tried as one polynomial, if it begins at a
        turn; 0 if it is not.
    branch : BranchPoint
        The branch point of ds that the leg before has passed by.
    kinks : array
        What is known of kinks (`kinks.places`); those found are added. It has a single element if no leg is followed
        past them in parts.
    """

    place: float
    place_low: float
    v2: float
    direction: int
    contact_sign: int
    step: float
    no_turn_until: float
    width: float
    blocks: int
    branch: BranchPoint
    kinks: Array


class Reading(NamedTuple):
    """The data that are read from the record of a leg.

    Attributes
    ----------
    what : int
        TIMES to PANELS (`leg_record`).
    force : bool
        For PEAKS, whether the contact force is read in place of the speed.
    length : bool
        Whether that is the length of the contact force, which the law need not contain (`equation.fill_length`).
    sign : float
        1 for the largest, -1 for the smallest.
    best : float
        ``sign`` times the largest or smallest value so far; parts that do not exceed it need not be in the record.
    """

    what: int
    force: bool
    length: bool
    sign: float
    best: float


class Route(NamedTuple):
    """The curve ahead of a run.

    Attributes
    ----------
    breaks : array
        Places at which panels have to begin, in the order in which they are passed; some may lie behind.
    limit : float
        The end of the domain.
    pause : float
        The distance from which on the run may pause.
    only_sign : int
        The only sign that N can have; 0 if it can have both.
    reading : Reading
    until, target : float
        The time from the leg's start up to which it is read, and the place whose passage is to be found.
    gaps : array
        The data kept of the gaps between breaks (`gaps`); empty if they are not used.
    first_break : int
        The index of the first break of the route among all of the curve.
    all_breaks : array
        All breaks of the curve, within one lap.
    period : float
        The length of a lap; 0 on an open curve.
    """

    breaks: Array
    limit: float
    pause: float
    only_sign: int
    reading: Reading
    until: float
    target: float
    gaps: Array
    first_break: int
    all_breaks: Array
    period: float


class CurveAhead(NamedTuple):
    """The data of the curve ahead of a panel.

    Attributes
    ----------
    upcoming : int
        The index of the next break.
    span : (float, float)
        The places between which the curve may be evaluated (`panels.breaks`).
    widest : float
        The largest width that the panel may have; infinite except for the first panel and those after a break.
    is_limited : bool
        Whether ``widest`` has been found. After a break it is found only if the panel turns out to contain a turn.
    """

    upcoming: int
    span: tuple[float, float]
    widest: float
    is_limited: bool


@Inner
def distance_from_rest(forces, start, span, contact_sign, slope, point):  # type: ignore[no-untyped-def]
    """Return the distance behind a start at which V**2 would vanish, by Runge-Kutta steps in the speed."""
    d, u, v = 0.0, sqrt(start.v2), start.direction
    step, moved, sums = u / REST_STEPS, 2.0 * u / slope, 0.0
    for k in range(REST_STEPS):
        for stage in range(4):
            if k + stage > 0:
                share = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
                speed = u - share * step if k + 1 < REST_STEPS or stage < 3 else 0.0
                place = within(start.place - v * (d + share * step * moved), span)
                there = slope_of_v2(forces, place, max(speed * speed, LEAST_V2), contact_sign, point)
                moved = 2.0 * speed / there
            sums = moved if stage == 0 else sums + (1.0 if stage == 3 else 2.0) * moved
        d, u = d + step * sums / 6.0, u - step
    return d


@Inner
def begin_march(forces, start, place, span, contact_sign, point):  # type: ignore[no-untyped-def]
    """Return the march variable from a start on, and the largest width of the first panel.

    After a slow launch the speed vanishes at the march variable ``-c/2``. If c were only approximate, the speed divided
    by the distance from there would not be smooth, and panels are too wide to detect that.
    """
    origin, g, c, widest = (start.place, start.place_low), 1.0, 0.0, inf
    if start.v2 > 0.0:
        slope = slope_of_v2(forces, place, start.v2, contact_sign, point)
        slow = slope > 0.0 and start.v2 <= slope * start.step
        if slow:
            behind = distance_from_rest(forces, start, span, contact_sign, slope, point)
            g, c = 1.0, 2.0 * sqrt(behind if 0.0 < behind <= start.step else start.v2 / slope)
        else:
            g, c = 0.0, 1.0
        # V**2 at launch is exact; a turn near the launch is accurate to all digits on a panel that is no wider than
        # this.
        widest = STOPPING_SHARE * start.v2 / -slope if slope < 0.0 else inf
    return March(origin, start.direction, g, c), widest


@Inner
def begin(forces, start, route, off, point):  # type: ignore[no-untyped-def]
    """Return the march variable of a run, the sign of N with which it begins, and the data ahead of its first panel."""
    breaks, origin, upcoming = route.breaks, (start.place, start.place_low), 0
    while upcoming < breaks.size and offset(breaks[upcoming], origin, start.direction) <= 0.0:
        upcoming += 1
    span, contact_sign = span_before(breaks, upcoming, start.direction, off), start.contact_sign
    place = within(start.place, span)
    if contact_sign == 0:
        contact_sign = sign_of_load(forces, place, start.v2, point)
    march, widest = begin_march(forces, start, place, span, contact_sign, point)
    return march, contact_sign, CurveAhead(upcoming, span, widest, True)


@Inner
def pass_break(march, route, off, v2, ahead, run_length):  # type: ignore[no-untyped-def]
    """Return the data ahead of a panel that begins at the distance ``run_length`` with V**2 = ``v2``; whether there is
    no break ahead; and the distance of the next break, or of the end.
    """
    upcoming, breaks, v = ahead.upcoming, route.breaks, march.direction
    if upcoming < breaks.size and offset(breaks[upcoming], march.origin, v) <= run_length:
        upcoming += 1
        ahead = CurveAhead(upcoming, span_before(breaks, upcoming, v, off), inf, v2 == 0.0)
    at_end = upcoming == breaks.size
    return ahead, at_end, offset(route.limit if at_end else breaks[upcoming], march.origin, v)


@Inner
def limited(forces, march, panel, width, ahead, change, run_length, largest_v2):  # type: ignore[no-untyped-def]
    """Return the data ahead of a panel of a width that begins at the distance ``run_length`` and has these changes.

    V**2 at a break is as exact as at launch, so a panel after it that contains a turn is limited like the first one.
    Where a turn lies next to the start of a panel, as that of a body thrown slowly from an equilibrium, the place of
    the turn is known to the roundings of the whole width only, and the panel is limited to the turn's surroundings.
    """
    x = min(change.turn, change.touch)
    if x > 1.0:
        return ahead
    widest = inf
    if panel.v2 > KNOWN_V2_SHARE * largest_v2 and 0.5 * (1.0 + x) < LEAST_SHARE_TO_TURN:
        widest = width * max(1.0 + x, NARROWER)
    if not ahead.is_limited:
        place = within(march.origin[0] + march.direction * run_length, panel.span)
        slope = slope_of_v2(forces, place, panel.v2, panel.contact_sign, point_buffer())
        if slope < 0.0:
            widest = min(widest, marched(run_length + STOPPING_SHARE * panel.v2 / -slope, march) - panel.left)
    elif widest == inf:
        return ahead
    return CurveAhead(ahead.upcoming, ahead.span, widest, True)
