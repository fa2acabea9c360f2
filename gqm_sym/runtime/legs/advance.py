"""The advance of a body leg by leg: what it does after each leg, and what ends its motion."""

from math import fabs, inf, isfinite
from typing import NamedTuple

import numpy as np
from numba import types

from gqm_sym.runtime.arithmetic.doubledouble import add, two_sum
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.types import INTEGER, Array
from gqm_sym.runtime.interface import Dissipation
from gqm_sym.runtime.launch.domain import DomainNumbers
from gqm_sym.runtime.launch.ends import first_step
from gqm_sym.runtime.launch.zeros import MAX_PARAMETER
from gqm_sym.runtime.legs.body import (
    BRANCH,
    BRANCH_HEIGHT,
    CONTACT_SIGN,
    DIRECTION,
    EARLY_WIDTH,
    ELAPSED,
    ELAPSED_LOW,
    ENDING,
    FIRST_STEP,
    FROM_REST,
    HIGH,
    HORIZON,
    KINKS,
    LAM0,
    LAPS,
    LAST_LEG,
    LAST_WIDTH,
    LEG_BEFORE,
    LEG_TIME,
    LOW,
    MAY_END,
    NO_TURN_UNTIL,
    ONLY_SIGN,
    PAUSES,
    PERIOD,
    PLACE,
    PLACE_LOW,
    PREFERRED,
    REACH,
    STEP,
    TARGET,
    TURNS,
    UNRESOLVED,
    V2,
    WIDTH_BEFORE,
)
from gqm_sym.runtime.legs.kinks.places import ROOM_FOR_KINKS
from gqm_sym.runtime.legs.leg_record import (
    AHEAD,
    BACK,
    BEGIN,
    BEGIN_LOW,
    END,
    END_LOW,
    HEADING,
    LAPS_BEFORE,
    PANELS,
    START,
    START_LOW,
    START_V2,
    TIME_FROM_END,
    TIME_FROM_START,
)
from gqm_sym.runtime.legs.panels.breaks import CLEARANCE_SHARE, clearance
from gqm_sym.runtime.legs.panels.equation import forces_on
from gqm_sym.runtime.legs.panels.point import LEAST_V2, point_buffer, sign_of_load, slope_of_v2
from gqm_sym.runtime.legs.runs.ends import (
    END_ASYMPTOTE,
    END_LIFTOFF,
    END_LIMIT,
    END_PAUSE,
    END_RECORD_FULL,
    END_TOO_MANY_PANELS,
    END_TOO_NARROW,
    END_TURN,
)
from gqm_sym.runtime.legs.runs.follow import IN_PARTS, follow
from gqm_sym.runtime.legs.runs.leg_variable import BranchPoint
from gqm_sym.runtime.legs.runs.rest_on_corners import breaks_before, is_break, leaving, rests_on_corner
from gqm_sym.runtime.legs.runs.route import Route, RunStart
from gqm_sym.runtime.legs.runs.whole_tables import MAX_BLOCKS

# Codes for the result of an advance, in addition to those of `runs.ends`. END_REST takes the place of END_TURN if the
# body stays; ENDING has the same code if the motion ends. END_LIFTOFF_AT_ONCE: the track would have to pull the body at
# once, so that it lifts off at its place. END_OUT_OF_DOMAIN: the body would leave the domain at once. END_OVERFLOW: it
# has left the range of doubles.
END_REST, END_LIFTOFF_AT_ONCE, END_OUT_OF_DOMAIN, END_OVERFLOW = range(10, 14)

DISSIPATION = types.NamedTuple((INTEGER, INTEGER, *(types.boolean,) * 4, INTEGER, INTEGER), Dissipation)

# The width of the first panel as a share of the first step of a search. The narrower it is, the more digits early times
# have.
FIRST_PANEL_SHARE = 0.25

# The largest number of laps of a closed curve that are followed in one run, for which its breaks are listed. It is one
# lap if the gaps between breaks are kept, because there are many of them.
LAPS_AHEAD = 8

# The width of the first panel of a body released near an equilibrium, in units of the distance to it; the largest
# number of times that the step to it is halved; and the largest factor by which the force may grow over that step.
FIRST_STEPS, MAX_HALVINGS, MAX_FORCE_GROWTH = 8.0, 1000, 4.0

# The length of a panel, as a share of the first step of a search, at which a body that pauses creeps towards an
# equilibrium that it never reaches.
CREEPING_SHARE = 1e-6

# The number of pauses that a pause of a creeping body counts for, because such a body does not move on and on.
CREEPING_PAUSES = 5.0

# The number of places between two turns at which the contact force on a body at rest is looked at.
SUPPORT_SAMPLES = 33

# A leg is not tried as one polynomial if it is longer than this share of one for which that failed.
MAX_WHOLE_SHARE = 0.9


NO_NUMBERS: Array = np.empty(0)


class Joints(NamedTuple):
    """The places where a curve is not smooth.

    Attributes
    ----------
    breaks, corners : arrays
        All such places, and those at which the tangent jumps, within one lap.
    liftoff_corners : array
        The corners at which a body that moves leaves the track, which can only push (`BoundFunctions.liftoff_corners`).
    ahead : array
        A buffer for the breaks ahead of a body; `room_ahead` returns the length that it must have.
    gaps : array
        The data kept of the gaps between breaks, for the run-time parameters of the body (`gaps.data.room_kept`); empty
        if nothing is kept.
    """

    breaks: Array
    corners: Array
    liftoff_corners: Array
    ahead: Array
    gaps: Array = NO_NUMBERS


def room_ahead(breaks: int) -> int:
    """Return the largest number of breaks ahead of a body on a curve with this number of breaks in each lap."""
    return (LAPS_AHEAD + 3) * breaks


@Inner
def gaps_on_leg(joints, reading):  # type: ignore[no-untyped-def]
    """Return the data kept of the gaps between breaks; empty if a leg cannot be followed by them, because its panels
    are read.
    """
    return joints.gaps if reading.what != PANELS else joints.gaps[:0]


@Inner
def near_start(dissipation, p, place, direction, v2, step):  # type: ignore[no-untyped-def]
    """Return a width for the first panel, based on a distance of at most ``step`` over which the force on a body, or
    else V**2, hardly changes.

    Next to an equilibrium the body turns, or moves on, over a distance that is unrelated to other lengths of the curve.
    """
    v, point = int(direction), point_buffer()
    forces = forces_on(dissipation, p, v)
    contact_sign = sign_of_load(forces, place, 0.0, point)
    slope = slope_of_v2(forces, place, LEAST_V2, contact_sign, point)
    for _ in range(MAX_HALVINGS):
        ahead = slope_of_v2(forces, place + v * step, LEAST_V2, contact_sign, point)
        grows_little = 0.0 < ahead <= MAX_FORCE_GROWTH * slope or (ahead * step <= v2 if v2 > 0.0 else not slope > 0.0)
        if grows_little or step <= CLEARANCE_SHARE * fabs(place):
            break
        step *= 0.5
    return FIRST_STEPS * step


@Inner
def launch(dissipation, p, joints, body):  # type: ignore[no-untyped-def]
    """Set the numbers of a body at its launch."""
    lam0, period = body[LAM0], body[PERIOD]
    step = first_step(DomainNumbers(body[LOW], body[HIGH], period, 0.0, 0.0))
    preferred = int(body[PREFERRED])
    body[PLACE], body[MAY_END], body[FIRST_STEP], body[STEP] = lam0, 1.0, step, FIRST_PANEL_SHARE * step
    body[REACH] = period if period > 0.0 else step
    body[FROM_REST], body[DIRECTION] = 1.0 if body[V2] == 0.0 else 0.0, preferred
    if body[V2] == 0.0:
        body[DIRECTION] = leaving(dissipation, p, joints, body, lam0, preferred)
    body[STEP] = min(body[STEP], near_start(dissipation, p, lam0, body[DIRECTION], body[V2], step))


@Inner
def fold(body):  # type: ignore[no-untyped-def]
    """Count whole laps of a closed curve separately, so that places keep their digits."""
    period = body[PERIOD]
    if period > 0.0:
        laps = float(int((body[PLACE] - body[LAM0]) / period))
        body[PLACE], low = two_sum(body[PLACE], -laps * period)
        body[PLACE_LOW] += low
        body[LAPS] += laps
        if laps != 0.0:
            body[KINKS] = 0.0


@Inner
def expected_width(body):  # type: ignore[no-untyped-def]
    """Return the expected width of the next leg from turn to turn, since widths decrease in a geometric sequence; 0 if
    it is unknown.
    """
    last, before = body[LAST_WIDTH], body[WIDTH_BEFORE]
    return last * (last / before) if last > 0.0 and before > 0.0 else last


@Inner
def blocks_to_try(body, width):  # type: ignore[no-untyped-def]
    """Return the smallest number of blocks with which a leg of a width may be one polynomial; 0 if there is none."""
    for k in range(MAX_BLOCKS):
        if width == 0.0 or body[UNRESOLVED + k] == 0.0 or width <= MAX_WHOLE_SHARE * body[UNRESOLVED + k]:
            return k + 1
    return 0


@Inner
def note_blocks(body, width, blocks):  # type: ignore[no-untyped-def]
    """Note that a leg of a width was one polynomial with so many blocks, or none if that is 0."""
    for k in range(MAX_BLOCKS):
        if 0 < blocks <= k + 1:
            body[UNRESOLVED + k] = 0.0
        elif body[UNRESOLVED + k] == 0.0 or width <= MAX_WHOLE_SHARE * body[UNRESOLVED + k]:
            body[UNRESOLVED + k] = width


@Inner
def next_leg(dissipation, p, joints, body, reading, record):  # type: ignore[no-untyped-def]
    """Follow a body to its next turn, or as far as one run goes.

    A body that the track would have to pull at once is followed over a short distance without contact, and ENDING is
    END_LIFTOFF_AT_ONCE.
    """
    place, direction, period = body[PLACE], int(body[DIRECTION]), body[PERIOD]
    end = body[HIGH] if direction > 0 else body[LOW]
    gaps = gaps_on_leg(joints, reading)
    limit = place + direction * (LAPS_AHEAD * period if joints.gaps.size == 0 else body[REACH]) if period > 0.0 else end
    liftoff_corners, _ = breaks_before(joints.liftoff_corners, joints.ahead, period, direction, place, limit)
    limit = liftoff_corners[0] if liftoff_corners.size else limit
    # Breaks a little behind the body show on which piece of the curve it is, and one at the limit shows the end of that
    # piece.
    begin, beyond = place - direction * body[FIRST_STEP], direction * clearance(place, limit)
    breaks, first_break = breaks_before(joints.breaks, joints.ahead, period, direction, begin, limit + beyond)
    record[START], record[START_LOW], record[LAPS_BEFORE] = place, body[PLACE_LOW], body[LAPS]
    record[START_V2] = body[V2]
    record[HEADING], record[BEGIN], record[BEGIN_LOW] = direction, body[ELAPSED], body[ELAPSED_LOW]
    pause, only_sign, no_turn_until = inf if isfinite(end) else body[REACH], int(body[ONLY_SIGN]), body[NO_TURN_UNTIL]
    width = expected_width(body)
    # From the rows of a leg from turn to turn, functions of V**2 are read, not those of V.
    has_v = reading.length and dissipation.path_in_space != 0
    blocks, branch = 0 if has_v else blocks_to_try(body, width), BranchPoint(body[BRANCH], body[BRANCH_HEIGHT])
    # Along a chart, legs are followed by other data.
    may_divide = dissipation.kinked or dissipation.squared_contact != 0
    has_kinks = may_divide and dissipation.linear and joints.breaks.size == 0
    kinks = body[KINKS : KINKS + (ROOM_FOR_KINKS if has_kinks else 1)]
    until, target = body[HORIZON] - body[ELAPSED], body[TARGET] - body[LAPS] * period
    while True:
        start = RunStart(
            *(place, body[PLACE_LOW], body[V2], direction, int(body[CONTACT_SIGN]), body[STEP], no_turn_until),
            *(width, blocks, branch, kinks),
        )
        route = Route(breaks, limit, pause, only_sign, reading, until, target, gaps, first_break, joints.breaks, period)
        found = follow(dissipation, p, start, route, record)
        if found.what == END_LIFTOFF and record[AHEAD] == 0.0:
            pause, only_sign, no_turn_until, until, body[ENDING] = 0.0, 0, inf, 0.0, END_LIFTOFF_AT_ONCE
        else:
            return found


@Inner
def may_end(dissipation, p, body, record):  # type: ignore[no-untyped-def]
    """Return whether a body that turns, and cannot rest, may still come to an end of its motion, of the curve or of
    contact.

    Between two turns it is confined to the way between them. There it loses contact only where the track would have to
    pull a body at rest; that is looked for at `SUPPORT_SAMPLES` places.
    """
    if record[START_V2] != 0.0:
        return body[TURNS] < 2.0 or body[ONLY_SIGN] != 0.0
    if body[ONLY_SIGN] == 0.0:
        return False
    point, forces = point_buffer(), forces_on(dissipation, p, int(record[HEADING]))
    for k in range(SUPPORT_SAMPLES):
        place = record[START] + k / (SUPPORT_SAMPLES - 1.0) * (record[END] - record[START])
        if body[ONLY_SIGN] * sign_of_load(forces, place, 0.0, point) < 0.0:
            return True
    return False


@Inner
def after_turn(dissipation, p, joints, body, found, record):  # type: ignore[no-untyped-def]
    """Return whether a body rests where V**2 has vanished; if it turns, store the data of the turn."""
    place, low = record[END], record[END_LOW]
    stays = found.direction == 0 or (place == body[PLACE] and low == body[PLACE_LOW] and body[V2] == 0.0)
    rests = stays or rests_on_corner(dissipation, p, joints, body, place)
    body[LEG_BEFORE], body[LAST_LEG], body[LEG_TIME] = body[LAST_LEG], body[LEG_TIME], 0.0
    width = fabs((place - body[PLACE]) + (low - body[PLACE_LOW]))
    body[WIDTH_BEFORE], body[LAST_WIDTH] = body[LAST_WIDTH], width if body[V2] == 0.0 else 0.0
    if found.blocks != IN_PARTS:
        note_blocks(body, body[LAST_WIDTH], found.blocks)
    body[BRANCH], body[BRANCH_HEIGHT] = found.branch
    body[TURNS] += 1.0
    if body[TURNS] == 2.0:
        body[EARLY_WIDTH] = body[LAST_WIDTH]
    body[PAUSES], body[NO_TURN_UNTIL] = 0.0, 0.0
    body[MAY_END] = 1.0 if found.could_stay or may_end(dissipation, p, body, record) else 0.0
    return rests


@Inner
def advance(dissipation, p, joints, body, reading, record):  # type: ignore[no-untyped-def]
    """Take a body to its next turn, to the end of its motion, or as far as one run goes.

    Parameters
    ----------
    dissipation : Dissipation
        The module's compiled functions, and the kind of its forces.
    p : array
        Run-time parameters.
    joints : Joints
    body : array
        The line of the body (`legs.body`), which has been launched. It is unchanged if the record is END_RECORD_FULL.
    reading : runs.route.Reading
    record : array
        Filled in (`leg_record`).

    Returns
    -------
    int
        END_REST if the body comes to rest, one of the codes of `runs.ends` for the end of the run, END_OUT_OF_DOMAIN or
        END_OVERFLOW; END_TOO_MANY_PANELS if the body could not be followed.
    """
    found, period = next_leg(dissipation, p, joints, body, reading, record), body[PERIOD]
    what, ahead, back, place = found.what, record[AHEAD] > 0.0, record[BACK] > 0.0, record[END]
    if what == END_LIMIT and is_break(joints.liftoff_corners, period, place):
        what = END_LIFTOFF
    if what == END_RECORD_FULL or body[ENDING] == END_LIFTOFF_AT_ONCE:
        return END_LIFTOFF_AT_ONCE if body[ENDING] == END_LIFTOFF_AT_ONCE else END_RECORD_FULL
    if what == END_LIMIT and not ahead:
        return END_OUT_OF_DOMAIN
    if (
        what == END_TOO_MANY_PANELS
        or not (ahead or back)
        or (what == END_ASYMPTOTE and dissipation.linear and not back)
    ):
        return END_TOO_MANY_PANELS
    body[LEG_TIME] += record[TIME_FROM_START] + record[TIME_FROM_END]
    elapsed, low = add(body[ELAPSED], body[ELAPSED_LOW], record[TIME_FROM_START], 0.0)
    body[ELAPSED], body[ELAPSED_LOW] = add(elapsed, low, record[TIME_FROM_END], 0.0)
    body[NO_TURN_UNTIL] = found.no_turn_until
    if what == END_TURN:
        what = END_REST if after_turn(dissipation, p, joints, body, found, record) else END_TURN
    else:
        is_open = period == 0.0 and not isfinite(body[HIGH] if body[DIRECTION] > 0.0 else body[LOW])
        creeps = found.step <= CREEPING_SHARE * body[FIRST_STEP]
        endless = what == END_PAUSE and (is_open or creeps)
        body[PAUSES] = body[PAUSES] + (CREEPING_PAUSES if creeps else 1.0) if endless else 0.0
    body[PLACE], body[PLACE_LOW], body[V2], body[DIRECTION] = place, record[END_LOW], found.v2, found.direction
    body[CONTACT_SIGN], body[STEP] = found.contact_sign, found.step
    if what in (END_REST, END_TOO_NARROW, END_LIFTOFF, END_ASYMPTOTE) or (what == END_LIMIT and period == 0.0):
        body[ENDING] = what
        return what
    fold(body)
    if fabs(body[PLACE]) > MAX_PARAMETER and fabs(body[PLACE]) > MAX_PARAMETER * fabs(body[LAM0]):
        return END_OVERFLOW
    if what == END_PAUSE and period == 0.0:
        body[REACH] *= 2.0
    return what
