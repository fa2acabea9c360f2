"""V**2 along the legs of a dissipative motion, panel by panel: forwards to their ends, and back from their turns.

A leg is run once from its start (`run`), and time is counted on the way as long as V**2 is large. If the leg ends at a
turn, the rest of the time is counted back from there: next to a turn V**2 is a small difference when it is computed
from the start, but has all its digits when it is computed from the turn. A leg that tends to an equilibrium is followed
back from there as a field of polynomials (`leg_record`). Before all this, a leg that begins at a turn is tried as one
polynomial (`whole_leg`).
"""

from math import fabs, inf, sqrt
from typing import NamedTuple

from gqm_sym.runtime.arithmetic.clenshaw import chebyshev_sum
from gqm_sym.runtime.compiled.calls import call_static_balance
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.legs.kinks.parts import run_past_kinks
from gqm_sym.runtime.legs.kinks.places import next_kink
from gqm_sym.runtime.legs.leg_record import (
    AHEAD,
    BACK,
    CHANGE_COUNT,
    COLUMNS,
    END,
    END_LOW,
    FIELD_COLUMNS,
    HALF_C,
    HEAD,
    MIDDLE,
    MIDDLE_LOW,
    PANELS,
    PASSAGE,
    ROWS_COUNT_AS,
    TIME,
    TIME_FROM_END,
    TIME_FROM_START,
    WHOLE,
    add_panel,
    change_at,
    has_space,
    total_time,
)
from gqm_sym.runtime.legs.panels.breaks import clearance, offset, span_before, within
from gqm_sym.runtime.legs.panels.equation import (
    DS,
    OFFSET,
    SERIES,
    W_FACTOR,
    March,
    Panel,
    W,
    fill_length,
    forces_on,
    panel_buffer,
    set_nodes,
)
from gqm_sym.runtime.legs.panels.point import SMOOTH_AT_REST, law_at_rest, point_buffer
from gqm_sym.runtime.legs.panels.polynomials import COUNT, to_coefficients
from gqm_sym.runtime.legs.panels.widest import (
    ALWAYS,
    MAX_PANELS,
    MIN_RELATIVE_WIDTH,
    NEVER,
    PanelRequest,
    next_panel,
)
from gqm_sym.runtime.legs.runs.arrival import run_to_target
from gqm_sym.runtime.legs.runs.ends import (
    END_ASYMPTOTE,
    END_NONE,
    END_PAUSE,
    END_RECORD_FULL,
    END_SLOW,
    END_TOO_MANY_PANELS,
    END_TURN,
)
from gqm_sym.runtime.legs.runs.leg_variable import BranchPoint
from gqm_sym.runtime.legs.runs.route import RunStart
from gqm_sym.runtime.legs.runs.run import run
from gqm_sym.runtime.legs.runs.whole_leg import run_whole

# The width of the first panel, as a share of a leg of known width.
FIRST_PANEL_OF_LEG = 0.25

# A leg is tried as one polynomial only if the second break ahead is at least at this share of its width.
MAX_SHARE_TO_BREAK = 0.75

# The reasons for which a leg was not followed back.
NO_SPACE, LOST = -1, -2

# Stands for the number of blocks of a leg past kinks that was followed in parts.
IN_PARTS = -1


@Inner
def next_stop(march, passed, length_back, record, breaks, remaining):  # type: ignore[no-untyped-def]
    """Return the distance at which the next panel must end on the way back.

    Parameters
    ----------
    passed, length_back : float
        The distance that has been followed back so far, and the whole distance to follow back.
    remaining : (int, int, int)
        The index of the next change of N's sign, that of the next break, and the sign of N.

    Returns
    -------
    stop : float
    remaining : (int, int, int)
    """
    change, upcoming, contact_sign = remaining
    origin, u, stop = march.origin, march.direction, length_back
    # Distances are compared and not places, because the place of a stop may be rounded to a farther one.
    while change >= 0 and offset(record[change_at(record, change)], origin, u) <= passed:
        change, contact_sign = change - 1, -contact_sign
    while upcoming >= 0 and offset(breaks[upcoming], origin, u) <= passed:
        upcoming -= 1
    if change >= 0:
        to_change = offset(record[change_at(record, change)], origin, u)
        # Where the run ahead ended at this change, the two places may differ by their roundings.
        if length_back - to_change > MIN_RELATIVE_WIDTH * max(fabs(origin[0]), length_back):
            stop = min(stop, to_change)
    if upcoming >= 0:
        stop = min(stop, offset(breaks[upcoming], origin, u))
    return stop, (change, upcoming, contact_sign)


@Inner
def run_back(forces, end, breaks, off, reading, record, used):  # type: ignore[no-untyped-def]
    """Store the panels of a leg that turns, followed back from the turn to the middle of its run.

    Parameters and Returns are those of `approach`, with panels for rows, and what is read of them.
    """
    work = panel_buffer()
    set_nodes(work)
    v, march = forces.direction, March(end.place, -forces.direction, 1.0, 0.0)
    # The differences are those of `next_stop`, because the middle may be a break.
    length = v * ((end.place[0] - end.middle[0]) + end.place[1]) - v * end.middle[1]
    count, v2, left, passed, step = 0, 0.0, 0.0, 0.0, sqrt(end.step)
    remaining = (end.change_count - 1, breaks.size - 1, end.contact_sign)
    for _ in range(MAX_PANELS):
        stop, remaining = next_stop(march, passed, length, record, breaks, remaining)
        max_width, at = sqrt(stop) - left, used + count * COLUMNS
        if max_width <= 0.0:
            break
        if not has_space(record, at, end.change_count):
            return NO_SPACE
        panel = Panel(left, v2, remaining[2], span_before(breaks, remaining[1] + 1, v, off))
        request = PanelRequest(max_width, step, 0.0, ALWAYS, False, reading.force, reading.length)
        width, step, _timed = next_panel(forces, march, panel, request, work)
        if width == 0.0:
            break
        right = left + width
        passed, left = (stop, sqrt(stop)) if width == max_width else (right * right, right)
        if reading.length:
            fill_length(forces, march, panel, work)
        add_panel(record, at, left, width, work)
        count, v2 = count + 1, work[W + COUNT]
        if passed >= length:
            break
    return count if left >= sqrt(length) else LOST


@Inner
def approach(forces, end, breaks, off, record, used):  # type: ignore[no-untyped-def]
    """Store the field of a leg that tends to an equilibrium, followed back from there to the middle of its run.

    Parameters
    ----------
    forces : Forces
    end : runs.ends.End
        The end of the leg.
    breaks, off
        As in `runs.run.run`.
    record, used
        The record, and the number of its elements in use, after which the field is stored.

    Returns
    -------
    int
        The number of rows; NO_SPACE if they do not fit into the record, LOST if the leg could not be followed.
    """
    work = panel_buffer()
    set_nodes(work)
    march = March((end.place[0], 0.0), -forces.direction, 0.0, 1.0)
    count, v2, left, linear_part, step = 0, 0.0, 0.0, 0.0, end.step
    length = fabs(end.middle[0] - end.place[0])
    remaining = (end.change_count - 1, breaks.size - 1, end.contact_sign)
    for _ in range(MAX_PANELS):
        stop, remaining = next_stop(march, left, length, record, breaks, remaining)
        if stop <= left:
            break
        panel = Panel(left, v2, remaining[2], span_before(breaks, remaining[1] + 1, forces.direction, off))
        request = PanelRequest(stop - left, step, 0.0, NEVER, False, False, False)
        width, step, _timed = next_panel(forces, march, panel, request, work)
        if width == 0.0:
            break
        row, right = used + count * FIELD_COLUMNS, stop if width == stop - left else left + width
        if not has_space(record, row, end.change_count):
            return NO_SPACE
        record[row], record[row + 1] = left, right
        if count == 0:
            # V**2/d vanishes at the equilibrium, as the force does; its rounding error there is subtracted.
            to_coefficients(work, W_FACTOR, work, SERIES)
            linear_part = chebyshev_sum(work[SERIES : SERIES + COUNT], -1.0)
        for j in range(COUNT):
            d = left + work[OFFSET + j]
            work[W_FACTOR + j] = (work[W_FACTOR + j] - linear_part) / d if count == 0 else work[W + j] / (d * d)
        for begin, values in ((2, W_FACTOR), (2 + COUNT, DS)):
            to_coefficients(work, values, work, SERIES)
            for k in range(COUNT):
                record[row + begin + k] = work[SERIES + k]
        count, v2, left = count + 1, work[W + COUNT], right
    return count if left >= length else LOST


@Inner
def direction_from_rest(static_balance, p, behind, ahead, preferred):  # type: ignore[no-untyped-def]
    """Return the direction in which a body at rest leaves a place, or 0 if it stays; and whether it could stay on some
    slope.

    The place is given by one place on either side of it; the two differ if it is a break. From a ridge the body may
    leave in either direction, and takes the ``preferred`` one.
    """
    point, rates = point_buffer(), point_buffer()
    point[0] = ahead
    call_static_balance(static_balance, 1, point, p, rates)
    forwards, backwards = rates[0], rates[1]
    if behind != ahead:
        point[0] = behind
        call_static_balance(static_balance, 1, point, p, rates)
        backwards = rates[1]
    if forwards <= 0.0 <= backwards:
        direction = 0
    elif forwards > 0.0 > backwards:
        direction = preferred
    else:
        direction = 1 if forwards > 0.0 else -1
    return direction, forwards < backwards


@Inner
def run_to_end(forces, start, route, off, record):  # type: ignore[no-untyped-def]
    """Call `run`, and begin it again with a later expected turn if the body becomes slow before the first panel, or
    with a narrower first panel if a body at rest turns within that.
    """
    step, no_turn_until = start.step, start.no_turn_until
    while True:
        record[BACK] = 0.0
        end = run(forces, start, route, off, record)
        width = fabs((end.place[0] - start.place) + (end.place[1] - start.place_low))
        turns_at_once = end.what == END_TURN and start.v2 == 0.0 and FIRST_PANEL_OF_LEG * width < step
        if end.panel_count > 0 or not (end.what == END_SLOW or turns_at_once):
            return end
        if turns_at_once:
            step = FIRST_PANEL_OF_LEG * width
        else:
            no_turn_until = end.no_turn_until
        start = RunStart(
            *(start.place, start.place_low, start.v2, start.direction, start.contact_sign, step),
            *(no_turn_until, start.width, 0, start.branch, start.kinks),
        )


@Inner
def passes_kinks(start):  # type: ignore[no-untyped-def]
    """Return whether a leg is expected to pass known kinks of the law."""
    d = next_kink(start.kinks, (start.place, start.place_low), start.direction)[1]
    return d < inf and (start.width == 0.0 or d < start.width)


@Inner
def passes_breaks(start, width, route):  # type: ignore[no-untyped-def]
    """Return whether a leg of a width passes two breaks of the curve, so that it is not one polynomial."""
    count = 0
    for place in route.breaks:
        d = offset(place, (start.place, start.place_low), start.direction)
        if d >= MAX_SHARE_TO_BREAK * width:
            return False
        count += 1 if d > 0.0 else 0
        if count == 2:
            return True
    return False


@Inner
def run_forwards(forces, start, route, off, record):  # type: ignore[no-untyped-def]
    """Run to the end, or to a place whose passage is to be found, as one polynomial if that suffices, in parts past
    kinks of the law, or else by `run_to_end`; return the end, the number of blocks of the polynomial (`whole_tables`),
    IN_PARTS or 0, and the branch point of ds that it passes by.
    """
    # Beside joints, curves are not evaluated at the ends of legs, as they are for legs that pass by a branch point.
    branch = start.branch if route.breaks.size == 0 else BranchPoint(0.0, inf)
    width, may_be_whole = start.width, start.v2 == 0.0 and start.blocks > 0
    rest = law_at_rest(forces, start.place, start.contact_sign) if may_be_whole else SMOOTH_AT_REST
    if may_be_whole and rest.slope >= 0.0:
        if route.reading.what == PASSAGE and not (forces.has_radius or passes_kinks(start)):
            end, blocks, branch = run_to_target(forces, start, branch, rest, route, off, record)
            if end.what == END_PAUSE:
                return end, blocks, branch
        if passes_breaks(start, start.width, route):
            end = run_to_end(forces, start, route, off, record)
            width = fabs((end.place[0] - start.place) + (end.place[1] - start.place_low))
            # A leg may be shorter than expected. Where friction almost balances the weight, one polynomial has fewer
            # rounding errors than parts.
            if end.what != END_TURN or passes_breaks(start, width, route):
                return end, 0, branch
        if not passes_kinks(start):
            end, blocks, branch = run_whole(forces, start, branch, rest, route, off, record)
            if end.what == END_TURN:
                return end, blocks, branch
            width = 2.0 * end.step
    if start.v2 == 0.0 and start.kinks[0] > 0.0 and route.reading.what != PANELS:
        end, branch = run_past_kinks(forces, start, branch, route, width, record)
        if end.what != END_NONE:
            return end, IN_PARTS, branch
    return run_to_end(forces, start, route, off, record), 0, branch


class Followed(NamedTuple):
    """The outcome of following a leg; other data are in the record.

    Attributes
    ----------
    what, contact_sign : int
        As in `runs.ends.End`.
    direction : int
        At a turn, the direction that `direction_from_rest` returns; otherwise that of the motion.
    could_stay : bool
        At a turn, whether the body could stay there on some slope; otherwise True.
    blocks : int
        The number of blocks of the leg (`whole_tables`) if it was one polynomial; IN_PARTS, or else 0.
    branch : BranchPoint
        The branch point of ds that it has passed by.
    step, no_turn_until, v2 : float
        As in `runs.ends.End`.
    """

    what: int
    contact_sign: int
    direction: int
    could_stay: bool
    blocks: int
    branch: BranchPoint
    step: float
    no_turn_until: float
    v2: float


@Inner
def follow(dissipation, p, start, route, record):  # type: ignore[no-untyped-def]
    """Run a leg, and follow it back from its end if V**2 vanishes there.

    Parameters
    ----------
    dissipation : Dissipation
        The module's compiled functions, and the kind of its forces.
    p : array
        Run-time parameters.
    start : RunStart
    route : Route
    record : array
        Filled in (`leg_record`).

    Returns
    -------
    Followed
    """
    breaks = route.breaks
    forces = forces_on(dissipation, p, start.direction)
    off = clearance(start.place, route.limit) if breaks.size else 0.0
    record[WHOLE] = 0.0
    end, blocks, branch = run_forwards(forces, start, route, off, record)
    is_whole = blocks > 0  # the record has rows and both times then
    what, used, back = end.what, HEAD + end.panel_count * COLUMNS, ROWS_COUNT_AS if is_whole else 0
    if not is_whole:
        record[TIME_FROM_START], record[TIME_FROM_END] = total_time(record, HEAD, end.panel_count), 0.0
    direction, could_stay = start.direction, True
    if what == END_TURN:
        if blocks == 0 and record[BACK] > 0.0:
            back, record[TIME_FROM_END] = 1, record[used + TIME]
        elif blocks == 0:
            back = run_back(forces, end, breaks, off, route.reading, record, used)
            record[TIME_FROM_END] = total_time(record, used, back)
        here = within(end.place[0], span_before(breaks, end.upcoming, direction, off))
        direction, could_stay = direction_from_rest(dissipation.static_balance, p, here, here, direction)
    elif what == END_ASYMPTOTE and dissipation.linear:
        back = approach(forces, end, breaks, off, record, used)
    record[END], record[END_LOW] = end.place
    record[MIDDLE], record[MIDDLE_LOW] = end.middle
    record[HALF_C], record[CHANGE_COUNT] = end.half_c, end.change_count
    record[AHEAD], record[BACK] = end.panel_count, max(back, 0)
    if back < 0:
        what = END_RECORD_FULL if back == NO_SPACE else END_TOO_MANY_PANELS
    sign, step = end.contact_sign, end.step
    return Followed(what, sign, direction, could_stay, blocks, branch, step, end.no_turn_until, end.v2)
