"""A run of the body along the curve where forces dissipate: panel after panel, until it turns, ends or may pause.

Time is counted on the way as long as V**2 is large. After V**2 has begun to decrease for good, the run is only followed
to its end, from which time is then counted back (`follow`).
"""

from math import inf, sqrt

from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.legs.gaps.passing import RunState, is_read_inside, pass_gaps
from gqm_sym.runtime.legs.gaps.turns import begin_on_gaps, turn_on_gaps
from gqm_sym.runtime.legs.leg_record import (
    BACK,
    COLUMNS,
    HEAD,
    NO_VALUES,
    RIGHT,
    TIME,
    TIME_ERROR,
    add_panel,
    change_at,
    has_space,
    total_time,
)
from gqm_sym.runtime.legs.panels.equation import (
    EXPM1_Q,
    LOAD,
    Panel,
    W,
    distance,
    fill_length,
    marched,
    panel_buffer,
    set_nodes,
    slope_at,
)
from gqm_sym.runtime.legs.panels.point import ZERO_TOLERANCE, point_buffer
from gqm_sym.runtime.legs.panels.polynomials import COUNT, extent
from gqm_sym.runtime.legs.panels.resolution import first_change_of, size_at
from gqm_sym.runtime.legs.panels.widest import ALWAYS, HIGH_V2_RATIO, MAX_PANELS, MAYBE, NEVER, PanelRequest
from gqm_sym.runtime.legs.runs.changes import changes_at_once, cut_panel, first_changes
from gqm_sym.runtime.legs.runs.ends import (
    END_NONE,
    END_TOO_MANY_PANELS,
    END_TURN,
    End,
    LastTimed,
    conclude,
    may_pause,
    turn_below_noise,
    what_after,
    what_before,
)
from gqm_sym.runtime.legs.runs.route import CurveAhead, begin, limited, pass_break
from gqm_sym.runtime.legs.runs.turn_ahead import panel_or_end

# The number of panels after which a run pauses.
PANELS_PER_RUN = 512


@Inner
def enter_change(record, count, place):  # type: ignore[no-untyped-def]
    """Store a place at which N changes its sign in the record; return the number of changes."""
    record[change_at(record, count)] = place
    return count + 1


@Inner
def enter_panel(forces, march, panel, reading, record, count, right, work):  # type: ignore[no-untyped-def]
    """Store a panel that ends at w = ``right`` in the record; return the number of panels."""
    width = right - panel.left
    if reading.length:
        fill_length(forces, march, panel, work)
    add_panel(record, HEAD + count * COLUMNS, right, width, work)
    return count + 1


@Inner
def enter_turn(route, march, turn, run_length, left, record, count):  # type: ignore[no-untyped-def]
    """Return the state of a run after a turn that kept rows show; store the time up to it from the distance
    ``run_length`` behind the panels of the record, as one from the turn, if it is known and nothing else is read there.
    """
    at, place, v = HEAD + count * COLUMNS, march.origin[0] + march.origin[1], march.direction
    spent, far, time = total_time(record, HEAD, count), turn.distance, turn.time
    ends = place + v * run_length, place + v * far
    if time >= 0.0 and has_space(record, at, 0) and not is_read_inside(route, ends, (spent, spent + time)):
        record[at + RIGHT], record[at + TIME], record[at + TIME_ERROR] = sqrt(far - run_length), time, NO_VALUES
        record[BACK] = 1.0
    return END_TURN, far, 0.0, marched(far, march) - left, turn.ahead


@Inner
def largest_after(largest_v2, v2, ends_here, work):  # type: ignore[no-untyped-def]
    """Return the largest V**2 so far after a panel that begins with ``v2``; resistance alone reduces the value before
    by the factor exp(-q).
    """
    damped = largest_v2 if ends_here else largest_v2 / (1.0 + work[EXPM1_Q + COUNT])
    return max(damped, max(v2, extent(work, W)[1]))


@Inner
def run(forces, start, route, off, record):  # type: ignore[no-untyped-def]
    """Follow the body from a start to the first turn, end or pause.

    Parameters
    ----------
    forces : Forces
    start : Start
    route : Route
    off : float
        The distance from breaks at which the curve is evaluated (`panels.breaks`).
    record : array
        Filled with panels up to the middle, and changes of N's sign (`leg_record`).

    Returns
    -------
    End
    """
    work, point, v = panel_buffer(), point_buffer(), start.direction
    set_nodes(work)
    march, nu, ahead = begin(forces, start, route, off, point)
    left, run_length, v2, largest_v2, ahead, recorded = begin_on_gaps(
        *(forces, march, route, nu, RunState(0.0, 0.0, start.v2, start.v2, ahead, 0), record, work)
    )
    # When time is not counted any more, a turn is searched for.
    what, panel_count, change_count, searching, at_stop = END_NONE, 0, 0, False, recorded > 0
    # Time on the second half of a leg is counted from its end, unless breaks limit its panels anyway; with laws that
    # are not linear only the part next to the end is.
    middle = 0.5 * start.width if forces.linear and start.v2 == 0.0 and start.width > 0.0 else inf
    timed, step = LastTimed(run_length, v2, nu, change_count), left if at_stop else marched(start.step, march)
    for _ in range(MAX_PANELS):
        if at_stop and not searching:
            left, run_length, v2, largest_v2, ahead, recorded = pass_gaps(
                *(forces, march, route, nu, RunState(left, run_length, v2, largest_v2, ahead, recorded), record, work)
            )
            timed = LastTimed(run_length, v2, nu, change_count)
            turn = turn_on_gaps(forces, march, route, timed, largest_v2, ahead, work)
            if turn.distance > run_length:
                what, run_length, v2, step, ahead = enter_turn(
                    *(route, march, turn, run_length, left, record, recorded)
                )
                break
        late = v2 < HIGH_V2_RATIO * largest_v2 or (run_length >= middle and (searching or not at_stop))
        ahead, at_end, stop = pass_break(march, route, off, v2, ahead, run_length)
        what = what_before(
            nu,
            route.only_sign,
            has_space(record, HEAD + recorded * COLUMNS, change_count),
            searching and not late,
            stop <= run_length,
        )
        if what != END_NONE:
            break
        panel, max_width = Panel(left, v2, nu, ahead.span), marched(stop, march) - left
        timing = ALWAYS if run_length < start.no_turn_until else (NEVER if searching or late else MAYBE)
        request = PanelRequest(
            *(min(max_width, ahead.widest), step, largest_v2, timing, True, route.reading.force, route.reading.length)
        )
        width, step, is_timed, (what, run_length, v2) = panel_or_end(
            forces, march, panel, request, start, (run_length, stop), work, point
        )
        if width == 0.0:
            break
        load_change, sign, _ = first_change_of(work, LOAD, nu, ZERO_TOLERANCE * work[size_at(LOAD)])
        if nu == 0 and sign != 0:
            nu = sign
            if forces.friction or nu == -route.only_sign:
                continue  # with the forces for this sign
        change = first_changes(march, panel, largest_v2, load_change, work)
        what, run_length, v2 = turn_below_noise(forces, march, panel, change, run_length, point)
        if what == END_TURN:
            break
        ahead = limited(forces, march, panel, width, ahead, change, run_length, largest_v2)
        if ahead.widest < width:
            continue
        if changes_at_once(march, panel, width, change, run_length):
            change_count, nu = (
                enter_change(record, change_count, start.place + v * run_length) if left > 0.0 else change_count,
                -nu,
            )
            continue
        if not searching and timing != ALWAYS and (late or not is_timed):
            searching, timed = True, LastTimed(run_length, v2, nu, change_count)
        right, ends_here = left + width, change.first <= 1.0
        if ends_here:
            right = cut_panel(forces, march, Panel(left, v2, nu, ahead.span), width, change, run_length, work, point)
        recorded = (
            recorded if searching else enter_panel(forces, march, panel, route.reading, record, recorded, right, work)
        )
        at_stop, panel_count = not ends_here and width == max_width, panel_count + 1
        largest_v2 = largest_after(largest_v2, v2, ends_here, work)
        v2, left, run_length = max(work[W + COUNT], 0.0), right, stop if at_stop else distance(right, march)
        ahead, timed = (
            CurveAhead(ahead.upcoming, ahead.span, inf, True),
            timed if searching else LastTimed(run_length, v2, nu, change_count),
        )
        what = what_after(
            change,
            at_stop and at_end,
            panel_count >= PANELS_PER_RUN
            or may_pause(forces, march, route, run_length, (v2, largest_v2), panel, (left, step), work),
        )
        if what != END_NONE:
            v2 = 0.0 if ends_here else v2
            break
        if ends_here:
            change_count, nu = enter_change(record, change_count, start.place + v * run_length), -nu
    what, half_c = END_TOO_MANY_PANELS if what == END_NONE else what, 0.5 * march.c if march.g > 0.0 else inf
    onwards = step * (slope_at(left, march) + march.g * step)
    end = (what, march.origin, v2, nu, onwards, start.no_turn_until, march.origin, half_c, change_count, recorded)
    return conclude(forces, route, march, End(*end, ahead.upcoming), timed, searching, run_length)
