"""V**2 along the legs of a dissipative motion, panel after panel: to where they end, and back from where they turn.

A leg is run once from its start (`leg_runs`), and time is counted on the way, as long as V**2 is large. If it ends at a
turn, time is counted from there back to where it was left off: near a turn V**2 is a small difference when seen from
the start, and none when seen from the turn.
"""

from math import sqrt

from numba import types

from gqm_sym.runtime.compiled.calls import call_static_balance
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.registers import uncounted
from gqm_sym.runtime.compiled.types import INTEGER, REAL, VECTOR
from gqm_sym.runtime.legs.approach import LOST, NO_ROOM, approach
from gqm_sym.runtime.legs.leg_breaks import between, grain, within
from gqm_sym.runtime.legs.leg_equation import W, panel_room, set_nodes
from gqm_sym.runtime.legs.leg_panels import ALWAYS, MOST_TRIES, next_panel, next_stop
from gqm_sym.runtime.legs.leg_record import (
    AFTER,
    BEFORE,
    COLUMNS,
    END,
    END_LOW,
    HEAD,
    MET,
    MIDDLE,
    MIDDLE_LOW,
    SLACK,
    has_room,
    keep,
    total,
)
from gqm_sym.runtime.legs.leg_run import ASYMPTOTE, DIPPED, FULL, SPENT, TURN, run, spot_room
from gqm_sym.runtime.legs.polynomials import COUNT


@Inner
def run_back(drive, p, flags, turn, whole, v, nu, met, breaks, off, step, record, used):  # type: ignore[no-untyped-def]
    """Follow the leg that turns at ``turn``, two doubles, back from there over the distance ``whole``.

    ``nu`` is the sign of N at the turn, which has changed ``met`` times on the way. The panels are entered behind what
    is ``used`` of a record. Returns how many they are; NO_ROOM where there is none, LOST where it could not be
    followed. ``off`` is as `leg_breaks.between` has it.
    """
    work = panel_room()
    set_nodes(work)
    count, base, left, gone, u, step = 0, 0.0, 0.0, 0.0, -v, sqrt(step)
    coming, passed = met - 1, breaks.size - 1
    for _ in range(MOST_TRIES):
        stop, coming, passed, nu = next_stop(turn, u, gone, whole, record, breaks, coming, passed, nu)
        room, at = sqrt(stop) - left, used + count * COLUMNS
        if room <= 0.0:
            break
        if not has_room(record, at, met):
            return NO_ROOM
        span = between(breaks, passed + 1, v, off)
        width, step, _ = next_panel(
            *(drive, p, flags, turn, span, u, 1.0, 0.0, left, room, step, base, v, nu, 0.0, ALWAYS, False, work)
        )
        if width == 0.0:
            break
        gone, left = (stop, sqrt(stop)) if width == room else ((left + width) * (left + width), left + width)
        keep(record, at, left, width, work)
        count, base = count + 1, work[W + COUNT]
        if gone >= whole:
            break
    return count if left >= sqrt(whole) else LOST


@Inner
def released(hold, p, behind, ahead, asked):  # type: ignore[no-untyped-def]
    """Which way a body leaves a place where it is at rest, 0 if it stays; whether it could stay at some slope.

    The place is given by one on either side of it, which differ where it is a break. From a ridge it leaves either way:
    that which is ``asked``.
    """
    spot, rates = spot_room(), spot_room()
    spot[0] = ahead
    call_static_balance(hold, 1, spot, p, rates)
    forwards, backwards = rates[0], rates[1]
    if behind != ahead:
        spot[0] = behind
        call_static_balance(hold, 1, spot, p, rates)
        backwards = rates[1]
    if forwards <= 0.0 <= backwards:
        way = 0
    elif forwards > 0.0 > backwards:
        way = asked
    else:
        way = 1 if forwards > 0.0 else -1
    return way, forwards < backwards


@entry(INTEGER(INTEGER, VECTOR, REAL, REAL, INTEGER))
def way_from_rest(hold, p, behind, ahead, asked):  # type: ignore[no-untyped-def]
    """The way that `released` tells, for Python."""
    return released(hold, p, behind, ahead, asked)[0]


@entry(
    types.Tuple((INTEGER, INTEGER, INTEGER, types.boolean, INTEGER, INTEGER, REAL, REAL, REAL, REAL, REAL))(
        *(INTEGER, INTEGER, types.boolean, types.boolean, types.boolean, VECTOR, REAL, REAL, REAL, INTEGER, INTEGER),
        VECTOR,
        *(REAL, REAL, REAL, INTEGER, REAL, VECTOR),
    ),
    checked=False,
)
def follow(  # type: ignore[no-untyped-def]
    drive,
    hold,
    friction,
    kinked,
    linear,
    p,
    start,
    start_low,
    w,
    v,
    nu,
    breaks,
    limit,
    reach,
    step,
    side,
    strict,
    record,
):
    """`run`, and from where that ends with V**2 = 0 back to its ``middle``; what it finds stands in the record.

    It begins at ``start + start_low``. The forces are told of as by `interface.Dissipation`.

    Returns
    -------
    what, nu
        As `run` has them.
    way, held : int, bool
        At a turn, what `released` says; else the direction as it was, and True.
    ahead, back : int
        How many panels there are from the start, and how many panels or rows of a field from the end.
    place, w, step, strict
        As `run` has them, the place as the nearest double.
    time : float
        Of the whole leg.
    """
    flags, p, breaks, record = (friction, kinked, linear), uncounted(p), uncounted(breaks), uncounted(record)
    origin, off = (start, start_low), grain(start, limit) if breaks.size else 0.0
    while True:
        what, place, w1, n, onwards, next_strict, middle, slack, met, kept, coming = run(
            drive, p, flags, origin, w, v, nu, breaks, off, limit, reach, step, side, strict, record
        )
        if what != DIPPED or kept > 0:
            break
        strict = next_strict
    used, back, after, way, held = HEAD + kept * COLUMNS, 0, 0.0, v, True
    if what == TURN:
        # As `next_stop` has the distance of a break, if the middle is one.
        whole = v * ((place[0] - middle[0]) + place[1]) - v * middle[1]
        back = run_back(drive, p, flags, place, whole, v, n, met, breaks, off, onwards, record, used)
        after = total(record, used, back)
        here = within(place[0], between(breaks, coming, v, off))
        way, held = released(hold, p, here, here, v)
    elif what == ASYMPTOTE:
        back = approach(drive, p, flags, place[0], middle[0], v, n, met, breaks, off, onwards, record, used)
    before = total(record, HEAD, kept)
    record[END], record[END_LOW], record[MIDDLE], record[MIDDLE_LOW] = place[0], place[1], middle[0], middle[1]
    record[SLACK], record[BEFORE], record[AFTER], record[MET] = slack, before, after, met
    if back < 0:
        what = FULL if back == NO_ROOM else SPENT
    return what, n, way, held, kept, back, place[0], w1, onwards, next_strict, before + after
