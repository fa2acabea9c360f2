"""The end of a run: its code and its place."""

from math import fabs, inf, log1p
from typing import NamedTuple

from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.legs.panels.breaks import located, within
from gqm_sym.runtime.legs.panels.equation import EXPM1_Q, slope_at
from gqm_sym.runtime.legs.panels.point import LEAST_V2, slope_of_v2
from gqm_sym.runtime.legs.panels.polynomials import COUNT
from gqm_sym.runtime.legs.panels.widest import ds_at

# The codes of the end of a run:
#
# ==================== ========================================================================================
# END_TURN             V**2 vanished, and the body turns or rests
# END_LIMIT            the end of the domain, or of the range of breaks that were given
# END_LIFTOFF          N took the sign that it cannot have
# END_ASYMPTOTE        V**2 and the force vanish together: the body approaches an equilibrium; by a law that is not
#                      linear in V**2, it is closer to it than doubles resolve its place
# END_PAUSE            it has run as far as one run may go
# END_TOO_NARROW       a place where the functions are not smooth: no panel that doubles can represent is narrow enough
# END_TOO_MANY_PANELS  too many panels were needed
# END_SLOW             the body becomes slow from the place given, but does not turn; it has to be run again from there
# END_RECORD_FULL      the record is full
# ==================== ========================================================================================
#
# END_NONE is the code of a run that has not ended.
(
    END_TURN,
    END_LIMIT,
    END_LIFTOFF,
    END_ASYMPTOTE,
    END_PAUSE,
    END_TOO_NARROW,
    END_TOO_MANY_PANELS,
    END_SLOW,
    END_RECORD_FULL,
) = range(9)
END_NONE = -1

# A body this close to a turn, as a share of the distance run, counts as being there, because some laws have no value
# beyond a turn.
NEAR_TURN = 1e-11

# If the place of a body is smaller by the first factor than the start of its run, and the next step is hardly longer
# than the place, the body is on its way to an equilibrium at 0. (Close to a cusp at 0 it is not; ds/dlam is smaller by
# the second factor there.) Its run pauses, because places that are counted from a farther origin would lose their
# digits.
CLOSE_SHARE, CUSP_SHARE = 2.0**-10, 2.0**-5

# What slows a body down may be a resistance alone, so that no more than a share of the slope of V**2 is left without
# speed. If it falls to this share where V**2 is smaller by the factor, V**2 vanishes like the square of the distance,
# and the body never comes to where it does.
SHARE_AT_REST, SLOWER_FACTOR, SLOWER_SHARE = 1e-6, 2.0**-4, 0.2501

# A resistance below this share of the force on a body at rest does not count next to a turn.
LEAST_RESISTANCE = 1e-6


class LastTimed(NamedTuple):
    """The last point of a run up to which time is counted.

    Attributes
    ----------
    distance, v2 : float
        The distance from the origin, and V**2 there.
    contact_sign, change_count : int
        The sign of N there, and how often it has changed so far.
    """

    distance: float
    v2: float
    contact_sign: int
    change_count: int


class End(NamedTuple):
    """The end of a run, with the state of the body there.

    Attributes
    ----------
    what : int
        One of the codes from END_TURN to END_RECORD_FULL.
    place : (float, float)
        The place as two doubles.
    v2 : float
        V**2 there.
    contact_sign : int
        The sign of N there.
    step, no_turn_until : float
        As in `Start`, for the next run.
    middle : (float, float)
        The place up to which time is counted, as two doubles.
    half_c : float
        c/2 of the march variable (`panels.equation.March`); infinite if that is the distance itself.
    change_count, panel_count : int
        The number of sign changes of N, and of recorded panels.
    upcoming : int
        The index of the next break.
    """

    what: int
    place: tuple[float, float]
    v2: float
    contact_sign: int
    step: float
    no_turn_until: float
    middle: tuple[float, float]
    half_c: float
    change_count: int
    panel_count: int
    upcoming: int


@Inner
def short_way_to_turn(v2, slope, at_rest):  # type: ignore[no-untyped-def]
    """Return the distance to a turn next to which a constant force and a resistance in proportion to speed act, from
    V**2, its slope, and its slope for a body at rest.

    The time would be that of ``dV/dt = -a - r V``. Where the resistance is much the larger one, the distance is nearly
    twice that by the slope alone.
    """
    resistance = at_rest - slope
    if resistance <= LEAST_RESISTANCE * -at_rest:
        return -v2 / slope
    ratio = resistance / -at_rest
    return 2.0 * v2 / resistance * (1.0 - log1p(ratio) / ratio)


@Inner
def end_at_once(forces, march, panel, run_length, point):  # type: ignore[no-untyped-def]
    """Return the end of a run at a place where no panel is possible, with its distance and V**2; it is a turn if one is
    near.

    If a body at rest would move on, or nothing but a resistance in proportion to speed acts, the end is not a turn but
    an equilibrium: V**2 grows with the square of the distance from there, and the body never reaches it.
    """
    if not forces.linear and panel.v2 > 0.0:
        here = march.origin[0] + march.direction * run_length
        place = within(here, panel.span)
        slope = slope_of_v2(forces, place, panel.v2, panel.contact_sign, point)
        if slope < 0.0 and panel.v2 <= -slope * NEAR_TURN * max(fabs(here), run_length):
            at_rest = slope_of_v2(forces, place, LEAST_V2, panel.contact_sign, point)
            slower = slope_of_v2(forces, place, SLOWER_FACTOR * panel.v2, panel.contact_sign, point)
            goes_on = at_rest > 0.0 or (at_rest >= SHARE_AT_REST * slope and slower >= SLOWER_SHARE * slope)
            if goes_on:
                return END_ASYMPTOTE, run_length, panel.v2
            return END_TURN, run_length + short_way_to_turn(panel.v2, slope, at_rest), 0.0
    return END_TOO_NARROW, run_length, panel.v2


@Inner
def turn_below_noise(forces, march, panel, change, run_length, point):  # type: ignore[no-untyped-def]
    """Return `end_at_once` if V**2 is below its noise because the panel begins next to a turn; otherwise END_NONE.

    Laws that contain the root of V**2 have no values beyond a turn, so that no change may be found there.
    """
    if change.first == change.touch and not forces.linear and (change.first <= 1.0 or forces.squared_contact == 0):
        what, turn, v2 = end_at_once(forces, march, panel, run_length, point)
        if what == END_TURN:
            return what, turn, v2
    return END_NONE, run_length, panel.v2


@Inner
def may_pause(forces, march, route, run_length, speeds, panel, ahead, work):  # type: ignore[no-untyped-def]
    """Return whether the run may pause: it is long enough, or approaches an equilibrium at 0 that is far from its
    start.

    ``speeds`` are V**2 and its largest value so far; ``panel`` is the last panel, and ``ahead`` the start and the width
    of the next one. If resistance alone has slowed the body down on its last panel, no turn is near.
    """
    here, (left, step) = fabs(march.origin[0] + march.direction * run_length), ahead
    onwards = step * (slope_at(left, march) + march.g * step)
    is_close = not forces.linear and onwards <= here <= CLOSE_SHARE * fabs(march.origin[0])
    if is_close:
        is_close = ds_at(forces, march, panel, run_length) >= CUSP_SHARE * ds_at(forces, march, panel, 0.0)
    undamped = speeds[0] * (1.0 + work[EXPM1_Q + COUNT])
    return is_close or (run_length >= route.pause and 2.0 * undamped >= speeds[1])


@Inner
def what_after(change, at_limit, pauses):  # type: ignore[no-untyped-def]
    """Return the code of the end of a run after a panel, or END_NONE."""
    if change.first <= 1.0:
        if change.first == change.turn:
            return END_TURN
        return END_ASYMPTOTE if change.first == change.touch else END_NONE
    if at_limit:
        return END_LIMIT
    return END_PAUSE if pauses else END_NONE


@Inner
def what_before(contact_sign, only_sign, has_room, fast_again, at_limit):  # type: ignore[no-untyped-def]
    """Return the code of the end of a run before a panel, or END_NONE."""
    if contact_sign != 0 and contact_sign == -only_sign:
        return END_LIFTOFF
    if not has_room:
        return END_RECORD_FULL
    if fast_again:
        return END_SLOW
    return END_LIMIT if at_limit else END_NONE


@Inner
def conclude(forces, route, march, end, timed, searching, run_length):  # type: ignore[no-untyped-def]
    """Return the end of a run at the distance ``run_length``; ``end`` has all of its data except the places."""
    breaks, v, what = route.breaks, march.direction, end.what
    middle = located(march.origin, v, timed.distance, breaks, end.upcoming)
    v2, sign, changes, no_turn_until = end.v2, end.contact_sign, end.change_count, end.no_turn_until - run_length
    place = middle
    if what == END_TURN or (what == END_ASYMPTOTE and forces.linear):
        place = located(march.origin, v, run_length, breaks, end.upcoming)
    elif searching and what != END_RECORD_FULL:
        goes_on = what == END_PAUSE or what == END_SLOW or (what == END_LIMIT and route.period > 0.0)
        no_turn_until = run_length - timed.distance if goes_on else inf
        what, v2, sign, changes = END_SLOW, timed.v2, timed.contact_sign, timed.change_count
    else:
        place = (route.limit, 0.0) if what == END_LIMIT else located(march.origin, v, run_length, breaks, end.upcoming)
        middle = place
    count, upcoming = end.panel_count, end.upcoming
    return End(what, place, v2, sign, end.step, no_turn_until, middle, end.half_c, changes, count, upcoming)
