"""Questions about the motion of one body with losses: how long it is followed for each, and what the answer is."""

from math import fabs, inf, isfinite, sqrt
from typing import NamedTuple

import numpy as np

from gqm_sym.runtime.arithmetic.doubledouble import ULP
from gqm_sym.runtime.compiled.calls import call_path_in_space, call_squared_contact
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.legs.advance import END_LIFTOFF_AT_ONCE, END_REST
from gqm_sym.runtime.legs.body import (
    EARLY_WIDTH,
    ELAPSED,
    ENDING,
    FROM_REST,
    HORIZON,
    LAM0,
    LAPS,
    LAST_WIDTH,
    MAY_END,
    ONLY_SIGN,
    PAUSES,
    PERIOD,
    PLACE,
    TARGET,
    TURNS,
    V2,
    WIDTH_BEFORE,
)
from gqm_sym.runtime.legs.leg_reading import passage
from gqm_sym.runtime.legs.leg_record import (
    AHEAD,
    BACK,
    BEGIN,
    BEGIN_LOW,
    END,
    HEADING,
    LAPS_BEFORE,
    START,
    START_V2,
)
from gqm_sym.runtime.legs.panels.equation import forces_on
from gqm_sym.runtime.legs.panels.point import point_buffer, sign_of_load, slope_of_v2
from gqm_sym.runtime.legs.runs.ends import END_ASYMPTOTE
from gqm_sym.runtime.legs.runs.peaks import LENGTH, LOAD, SPEED, peak_of_leg

# The question for each body. LEGS means to advance by some legs, and FIRST_LEGS does so unless the launch is next to an
# equilibrium. RUN_AGAIN means to follow a leg, or a part of it, once more for its panels.
FIRST_LEGS, LEGS, RUN_AGAIN, END_TIME, REST_PLACE, ARRIVAL, LEAST_SPEED, MOST_SPEED, LEAST_LOAD, MOST_LOAD = range(10)
LEAST_LENGTH, MOST_LENGTH = 10, 11

# The status of an answer; LEFT is that of a body that the loop does not decide, and TOO_LONG that of one whose motion
# has more turns than are followed. NEAR is that of a body whose swing is small beside its place, so that its speed and
# its times would have few digits; it is to be driven by its distance from the equilibrium (`frames`). Its value is the
# distance within which that lies.
FOUND, LEFT, NONE, TOO_LONG, NEAR = range(5)

# On a curve without ends, the number of successive runs without a turn after which the search for an end stops.
MAX_PAUSES = 60

# The number of turns up to which legs are stored in search of an end of the motion, and the number of turns up to which
# the end is searched for without storing them.
MAX_TURNS, MOST_TURNS = 20_000, 1_000_000

# The numbers of turns between which the extremes of a swing that dies away for ever may become known.
FEWEST_TURNS, MOST_SWINGS = 3.0, 32.0

# The number of places, and the number of them for each panel and each break, at which the contact force on a body at
# rest is compared with an extreme; and the number of roundings up to which it is not beyond that.
PLACES, PLACES_PER_PANEL, PLACES_PER_BREAK, EQUAL_ROUNDINGS = 64, 16, 4, 8.0

# If at the present rate the swings would vanish after more turns than this, no loss of energy shows in doubles.
UNSEEN_TURNS = 2.0**50

# Where the contact force at the end of the domain is this many times its largest value at the nodes of panels, it grows
# without bound there, as at a cusp.
UNBOUNDED_GROWTH = 1e6


class Findings(NamedTuple):
    """The findings of the legs so far.

    Attributes
    ----------
    arrival : float
        The time of the first arrival at the target; infinite as long as there is none.
    peak : float
        The largest value of the quantity, or minus the smallest.
    """

    arrival: float
    peak: float


@Inner
def turns_at_this_rate(body):  # type: ignore[no-untyped-def]
    """Return the number of turns after which the swings of a body would vanish if they went on to become shorter as
    they have since its second turn; 0 if that is not known.
    """
    if body[EARLY_WIDTH] == 0.0:
        return 0.0
    shortened = 1.0 - body[LAST_WIDTH] / body[EARLY_WIDTH]
    return body[TURNS] / shortened if shortened * UNSEEN_TURNS > body[TURNS] else inf


@Inner
def may_still_end(body):  # type: ignore[no-untyped-def]
    """Return whether the end of a motion without a horizon is to be searched for beyond the last turn."""
    if body[PAUSES] >= MAX_PAUSES or (body[TURNS] > 0.0 and body[MAY_END] == 0.0):
        return False
    if body[TURNS] <= MAX_TURNS:
        return True
    return body[TURNS] <= MOST_TURNS and turns_at_this_rate(body) <= 2.0 * MOST_TURNS


@Inner
def has_passed(dissipation, p, breaks, body, question, peak, record):  # type: ignore[no-untyped-def]
    """Return whether a swing that dies away for ever has passed its extreme ``peak``, given the record of its last leg.

    Once a swing is within the one before, all later ones are, and the body is slower there
    (`motion.parts.searched`). Its load at a place then is between that at rest and one that it has had. The square of
    the length of a contact force is a parabola in V**2: it is largest at an end, and nowhere below its vertex.
    """
    is_within = 0.0 < body[LAST_WIDTH] < body[WIDTH_BEFORE]
    if not (dies_away(body) and is_within and body[TURNS] >= FEWEST_TURNS):
        return False
    if question < LEAST_LOAD:
        return True
    is_length, sign, point = question >= LEAST_LENGTH, sought_extreme(question)[1], point_buffer()
    if is_length and (dissipation.squared_contact == 0 or dissipation.path_in_space != 0):
        return False
    forces = forces_on(dissipation, p, 1)
    count = PLACES + PLACES_PER_PANEL * int(record[AHEAD] + record[BACK]) + PLACES_PER_BREAK * breaks.size
    for k in range(count):
        place = record[START] + k / (count - 1.0) * (record[END] - record[START])
        if is_length:
            point[0] = place
            call_squared_contact(dissipation.squared_contact, 1, point, p, point[2:])
            square = point[2]
            if sign < 0.0 and point[3] < 0.0 < point[4]:
                square -= 0.25 * point[3] ** 2 / point[4]
            load = sqrt(max(square, 0.0))
        else:
            slope_of_v2(forces, place, 0.0, 0, point)
            load = point[5]
        if not sign * load <= peak + EQUAL_ROUNDINGS * ULP * max(fabs(peak), fabs(load)):
            return False
    return True


@Inner
def is_confined(body):  # type: ignore[no-untyped-def]
    """Return whether a body has turned at two points, and reaches no place outside of them any more."""
    return body[TURNS] >= (1.0 if body[FROM_REST] else 2.0)


@Inner
def goes_on(body, question, arrival, passed, has_radius):  # type: ignore[no-untyped-def]
    """Return whether the next leg has to be followed too; ``passed`` is what `has_passed` returns.

    A body with a radius is followed after its arrival too, up to where it can reach no other place, because motions to
    where it does not fit into its track are refused.
    """
    if body[ENDING] != 0.0 or (question == ARRIVAL and is_confined(body)):
        return False
    if arrival < inf and (not has_radius or body[LAPS] != 0.0):
        return False
    if isfinite(body[HORIZON]):
        return body[ELAPSED] < body[HORIZON]
    if question == ARRIVAL and not arrival < inf:
        return True
    if question >= LEAST_SPEED and dies_away(body):
        return not passed and body[TURNS] < MOST_SWINGS
    return may_still_end(body) and (question <= REST_PLACE or body[TURNS] <= MAX_TURNS)


@Inner
def dies_away(body):  # type: ignore[no-untyped-def]
    """Return whether a body swings for ever and does not come to rest."""
    return body[TURNS] > 0.0 and body[MAY_END] == 0.0 and body[ENDING] == 0.0 and body[PAUSES] < MAX_PAUSES


@Inner
def sought_extreme(question):  # type: ignore[no-untyped-def]
    """Return the function that a question is about, and 1 if it is about the largest value, -1 if about the smallest
    one.
    """
    sign = 1.0 if question in (MOST_SPEED, MOST_LOAD, MOST_LENGTH) else -1.0
    return SPEED if question < LEAST_LOAD else LOAD if question < LEAST_LENGTH else LENGTH, sign


@Inner
def load_at(dissipation, p, question, place, direction, v2):  # type: ignore[no-untyped-def]
    """Return the contact force per mass, or its length, on a body at a place; the length of the contact force itself
    where `interface.Dissipation.path_in_space` gives it.
    """
    point = point_buffer()
    if question >= LEAST_LENGTH and dissipation.path_in_space != 0:
        point[0], point[1] = place, v2
        call_path_in_space(dissipation.path_in_space, 1, point, point[1:], float(direction), p, point[2:])
        return sqrt(point[3] ** 2 + point[4] ** 2 + point[5] ** 2)
    if question >= LEAST_LENGTH and dissipation.squared_contact != 0:
        point[0] = place
        call_squared_contact(dissipation.squared_contact, 1, point, p, point[2:])
        return sqrt(point[2] + v2 * (point[3] + v2 * point[4]))
    slope_of_v2(forces_on(dissipation, p, direction), place, v2, 0, point)
    return point[5] + point[6] * v2


@Inner
def after_leg(dissipation, p, body, question, findings, record):  # type: ignore[no-untyped-def]
    """Return the findings of the legs so far after one more leg."""
    begin, low = record[BEGIN], record[BEGIN_LOW]
    if question < LEAST_SPEED:
        if question != ARRIVAL or findings.arrival < inf or body[ENDING] == END_LIFTOFF_AT_ONCE:
            return findings
        spent = passage(record, body[TARGET] - record[LAPS_BEFORE] * body[PERIOD])
        return Findings(begin + (low + spent), findings.peak)
    function, sign = sought_extreme(question)
    if body[ENDING] != END_LIFTOFF_AT_ONCE:
        until = (body[HORIZON] - begin) - low
        forces = forces_on(dissipation, p, int(record[HEADING]))
        return Findings(findings.arrival, peak_of_leg(forces, record, until, (function, sign), findings.peak))
    v2 = record[START_V2]
    if function == SPEED:
        value = sqrt(v2)
    else:
        value = load_at(dissipation, p, question, record[START], int(record[HEADING]), v2)
    return Findings(findings.arrival, max(findings.peak, sign * value))


@Inner
def fits(dissipation, p, body):  # type: ignore[no-untyped-def]
    """Return whether a body fits into its track at the launch: ds/dlam is negative where one with a radius does not."""
    if not dissipation.has_radius:
        return True
    point = point_buffer()
    slope_of_v2(forces_on(dissipation, p, 1), body[LAM0], body[V2], 0, point)
    return point[2] > 0.0


@Inner
def at_rest(dissipation, p, body, question):  # type: ignore[no-untyped-def]
    """Return the answer for a body that stays where it is, or that the track would have to pull there at once, and its
    status.
    """
    if body[ONLY_SIGN] != 0.0:
        contact_sign = sign_of_load(forces_on(dissipation, p, 1), body[LAM0], 0.0, point_buffer())
        if contact_sign == 0:
            return np.nan, LEFT
        if contact_sign != body[ONLY_SIGN] and question in (END_TIME, REST_PLACE):
            return (0.0, FOUND) if question == END_TIME else (np.nan, NONE)
    if question == END_TIME:
        return (body[HORIZON], FOUND) if isfinite(body[HORIZON]) else (np.nan, NONE)
    if question == REST_PLACE:
        return body[LAM0], FOUND
    if question == ARRIVAL:
        return (0.0, FOUND) if body[TARGET] == body[LAM0] else (np.nan, NONE)
    if question < LEAST_LOAD:
        return 0.0, FOUND
    return load_at(dissipation, p, question, body[LAM0], 1, 0.0), FOUND


@Inner
def conclude(body, question, findings, passed):  # type: ignore[no-untyped-def]
    """Return the answer for a body that has been followed long enough, and its status; ``passed`` is what `has_passed`
    returns.
    """
    if question == ARRIVAL:
        is_there = findings.arrival < inf and findings.arrival <= body[HORIZON]
        return (findings.arrival, FOUND) if is_there else (np.nan, NONE)
    ends = body[ENDING] != 0.0 and body[ENDING] != END_ASYMPTOTE
    end = min(body[HORIZON], body[ELAPSED] if ends else inf)
    if not isfinite(end) and question >= LEAST_SPEED and dies_away(body):
        if not passed:
            return np.nan, LEFT
    elif not isfinite(end):
        is_slow = body[TURNS] > MAX_TURNS and body[MAY_END] != 0.0 and turns_at_this_rate(body) < inf
        return np.nan, TOO_LONG if question <= REST_PLACE and is_slow else NONE
    if question == END_TIME:
        return end, FOUND
    if question == REST_PLACE:
        rests = body[ENDING] == END_REST and body[ELAPSED] <= body[HORIZON]
        return (body[PLACE] + body[LAPS] * body[PERIOD], FOUND) if rests else (np.nan, NONE)
    if body[ENDING] == END_ASYMPTOTE:
        return np.nan, LEFT
    return findings.peak if sought_extreme(question)[1] > 0.0 else 0.0 - findings.peak, FOUND


@Inner
def force_is_unbounded(dissipation, p, body, peak):  # type: ignore[no-untyped-def]
    """Return whether the contact force grows without bound towards the end of the domain at which the body is."""
    point = point_buffer()
    slope_of_v2(forces_on(dissipation, p, 1), body[PLACE], body[V2], 0, point)
    return not fabs(point[5]) + fabs(point[6]) * body[V2] <= UNBOUNDED_GROWTH * fabs(peak)


@Inner
def conclude_at_rest(question, findings, time, place):  # type: ignore[no-untyped-def]
    """Return the answer for a body that comes to rest at a place after ever slower swings."""
    if question == END_TIME:
        return time
    if question == REST_PLACE:
        return place
    return findings.peak if sought_extreme(question)[1] > 0.0 else 0.0 - findings.peak
