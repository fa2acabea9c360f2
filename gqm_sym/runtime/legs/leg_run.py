"""A run of the body along the curve where forces dissipate: panel after panel, to where it turns, ends or may pause.

Time is counted on the way, as long as V**2 is large; from where it falls for good the run is only followed to its end.
"""

from math import fabs, inf, sqrt

from gqm_sym.runtime.arithmetic.clenshaw import chebyshev_sum
from gqm_sym.runtime.compiled.calls import call_speed_equation
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import on_stack
from gqm_sym.runtime.legs.leg_breaks import between, located, offset, within
from gqm_sym.runtime.legs.leg_equation import (
    BARE,
    FORCE,
    LOAD,
    MEAN,
    PLACE,
    SERIES,
    SWELL,
    as_bare,
    begin_panel,
    distance,
    marched,
    pace,
    panel_room,
    set_nodes,
    solve_panel,
)
from gqm_sym.runtime.legs.leg_equation import P as GAIN
from gqm_sym.runtime.legs.leg_equation import Q as LOSS
from gqm_sym.runtime.legs.leg_equation import W as V2
from gqm_sym.runtime.legs.leg_panels import (
    ALWAYS,
    HIGH,
    MAYBE,
    MOST_TRIES,
    NARROW,
    NEVER,
    NOISE,
    change_of,
    next_panel,
    size_at,
)
from gqm_sym.runtime.legs.leg_record import COLUMNS, HEAD, change_at, has_room, keep
from gqm_sym.runtime.legs.polynomials import COUNT, extent, size_of, to_coefficients

# What ended a run along the curve.
TURN, LIMIT, LIFTOFF, ASYMPTOTE, PAUSED, NARROWED, SPENT, DIPPED, FULL = range(9)

# What may be left of N where it cancels, against the parts it is the sum of: the curvature of a chart has a digit less.
TOUCHED = 5e-14

# A body this close to a turn, as a share of what has been run, is there: for laws that have no value beyond it.
NEAR = 1e-11

# The first panel of a leg, and the first behind a break, against the way on which the acceleration there would stop the
# body.
SOONER = 2.0
MOST_PANELS = 512

# Room for one place, V**2, and what is found there.
spot_room = on_stack(7)


@Inner
def bottom(work, v, touch):  # type: ignore[no-untyped-def]
    """The place x near ``touch`` where V**2, all but zero there, is least: the force vanishes."""
    for j in range(COUNT):
        work[MEAN + j] = v * (work[GAIN + j] - work[LOSS + j] * work[V2 + j])
    to_coefficients(work, MEAN, work, SERIES)
    c = work[SERIES : SERIES + COUNT]
    x, new = touch, touch + 1e-4
    before = chebyshev_sum(c, x)
    for _ in range(30):
        slope = chebyshev_sum(c, new)
        if slope == before:
            break
        x, before, new = new, slope, new - slope * (new - x) / (slope - before)
    return new if fabs(new - touch) <= 1e-2 else touch


@Inner
def rise(drive, p, place, v2, v, nu, spot):  # type: ignore[no-untyped-def]
    """By how much V**2 grows per distance run in direction v."""
    spot[0], spot[1] = place, v2
    call_speed_equation(drive, 1, spot, (0, 1, 2), float(v), float(nu), p)
    return v * (spot[3] - spot[4] * v2)


@Inner
def run(drive, p, flags, origin, w, v, nu, breaks, off, limit, reach, step, side, strict, record):  # type: ignore[no-untyped-def]
    """Follow the body from ``origin``, two doubles, with V**2 = w in direction v, to the first turn, end or pause.

    Parameters
    ----------
    flags : (friction, kinked, linear)
        Of what kind the forces are.
    nu : int
        The sign of N; 0 to find it out.
    breaks : array
        Places at which panels must begin, in the order they are met; some may lie behind.
    off : float
        How far off them the curve is asked (`leg_breaks`).
    limit, reach : float
        The end of the domain; the distance from which on the run may pause.
    step : float
        A distance to begin with.
    side : int
        The only sign that N can have; 0 where it can have both.
    strict : float
        The distance up to which there is no turn to be expected, however slow the body gets.
    record : array
        For panels up to ``middle``, and changes of N's sign (`leg_records`).

    Returns
    -------
    what : int
        TURN, LIMIT, LIFTOFF, ASYMPTOTE (V**2 and the force vanish together), PAUSED, NARROWED (a place where the
        functions are not smooth), SPENT, DIPPED (the body gets slow from here on, but does not turn: to be run
        again), FULL (the record is).
    place, w, nu : (float, float), float, int
        Where, as two doubles, with what V**2, and the sign of N.
    step : float
        The distance to go on with.
    strict : float
        The same from here on.
    middle : (float, float)
        The place up to which time is counted, as two doubles.
    slack : float
        c/2 of the march variable (`leg_panels`); infinite where it is the distance itself.
    met, kept : int
        How many changes of N's sign there are on the way, and how many panels.
    coming : int
        Which break is next, where the run ends.
    """
    work, spot = panel_room(), spot_room()
    set_nodes(work)
    g, c, sooner, coming, start = 1.0, 0.0, inf, 0, origin[0]
    while coming < breaks.size and offset(breaks[coming], origin, v) <= 0.0:
        coming += 1
    span = between(breaks, coming, v, off)
    first = within(start, span)
    if nu == 0:
        rise(drive, p, first, w, v, nu, spot)
        load, turned = spot[5], spot[6] * w
        if fabs(load + turned) > TOUCHED * (fabs(load) + fabs(turned)):
            nu = 1 if load + turned > 0.0 else -1
    if w > 0.0:
        slope = rise(drive, p, first, w, v, nu, spot)
        slow = slope > 0.0 and w <= slope * step
        g, c = (1.0, 2.0 * sqrt(w / slope)) if slow else (0.0, 1.0)
        # V**2 at launch is exact: a turn that is near has its digits on a panel no wider than this.
        sooner = SOONER * w / -slope if slope < 0.0 else inf
    count, met, what = 0, 0, SPENT
    base, left, gone, ceiling, step = w, 0.0, 0.0, w, marched(step, g, c)
    # The last distance up to which time is counted, and what is known there; a turn is searched for beyond it.
    searching, kept, mark, mark_base, mark_nu, mark_met = False, 0, 0.0, w, nu, 0
    for _ in range(MOST_TRIES):
        if nu != 0 and nu == -side:
            what = LIFTOFF
            break
        if not has_room(record, HEAD + kept * COLUMNS, met):
            what = FULL
            break
        here, late = start + v * gone, base < HIGH * ceiling
        if searching and not late:
            what = DIPPED
            break
        if coming < breaks.size and offset(breaks[coming], origin, v) <= gone:
            coming += 1
            span = between(breaks, coming, v, off)
            slope = rise(drive, p, within(here, span), base, v, nu, spot) if base > 0.0 else 0.0
            # V**2 at a break is as exact as at launch.
            sooner = marched(gone + SOONER * base / -slope, g, c) - left if slope < 0.0 else inf
        stop = offset(breaks[coming] if coming < breaks.size else limit, origin, v)
        if stop <= gone:
            what = LIMIT
            break
        room = marched(stop, g, c) - left
        part = min(room, sooner)
        ask = ALWAYS if gone < strict else (NEVER if searching or late else MAYBE)
        width, step, timed = next_panel(
            *(drive, p, flags, origin, span, v, g, c, left, part, step, base, v, nu, ceiling, ask, True, work)
        )
        if width == 0.0:
            what = NARROWED
            if not flags[2] and base > 0.0:
                slope = rise(drive, p, within(here, span), base, v, nu, spot)
                if slope < 0.0 and base <= -slope * NEAR * max(fabs(here), gone):
                    what, gone, base = TURN, gone - base / slope, 0.0
            break
        turn_of_force, before, _ = change_of(work, LOAD, nu, TOUCHED * work[size_at(LOAD)])
        if nu == 0 and before != 0:
            nu = before
            if flags[0] or nu == -side:
                continue
        # V**2, or what it is divided by the distance from the turning point it begins with.
        scale = size_of(work, FORCE) if base == 0.0 else max(as_bare(ceiling, g, c, left), work[size_at(BARE)])
        at_rest, _, touch = change_of(work, BARE, 1, NOISE * scale)
        if touch <= -1.0 and base == 0.0:
            touch = 2.0
        end = min(at_rest, touch, turn_of_force)
        if end == turn_of_force and end <= 1.0:
            soon = distance(left + width * (0.5 * (1.0 + end)), g, c)
            if soon <= gone + NARROW * max(fabs(here), gone):
                nu = -nu  # N is zero here: what follows decides its sign
                if left > 0.0:
                    record[change_at(record, met)] = here
                    met += 1
                continue
        if not searching and ask != ALWAYS and (late or not timed):
            searching, mark, mark_base, mark_nu, mark_met = True, gone, base, nu, met
        right = left + width
        if end <= 1.0:
            x = bottom(work, v, touch) if end == touch and end != at_rest else end
            # Once more on a panel that ends there: its own sum has more digits than the series of a wider one.
            right = left + width * (0.5 * (1.0 + x))
            begin_panel(drive, p, flags[2], origin, span, v, g, c, left, right - left, base, v, nu, work)
            solve_panel(drive, p, flags[2], v, g, c, left, base, v, nu, work)
            pace(g, c, left, base, work)
            if end == at_rest and flags[2]:
                over, there = work[V2 + COUNT], distance(right, g, c)
                slope = rise(drive, p, within(start + v * there, span), over, v, nu, spot)
                if fabs(over) < fabs(slope) * 1e-6 * (there - gone):
                    right = marched(there - over / slope, g, c)
            elif end == turn_of_force and end != touch:
                # N at the panel's end has no error of a series, nor has what is left of the way to where it vanishes.
                end_load, before_end = work[LOAD + COUNT], work[LOAD + COUNT - 1]
                rate = (end_load - before_end) / (work[PLACE + COUNT] - work[PLACE + COUNT - 1])
                if fabs(end_load) < fabs(rate) * 1e-6 * (right - left):
                    right -= end_load / rate
        if not searching:
            keep(record, HEAD + kept * COLUMNS, right, right - left, work)
            kept += 1
        count += 1
        highest = max(base, extent(work, V2)[1])
        # What resistance alone leaves of it: exp(-q).
        ceiling = max(ceiling / (1.0 + work[SWELL + COUNT]) if end > 1.0 else ceiling, highest)
        full = end > 1.0 and width == room
        base, left = max(work[V2 + COUNT], 0.0), right
        gone, sooner = stop if full else distance(right, g, c), inf
        if not searching:
            mark = gone
        if end <= 1.0:
            if end == at_rest or end == touch:
                what, base = (TURN if end == at_rest else ASYMPTOTE), 0.0
                break
            record[change_at(record, met)] = start + v * gone
            met, nu = met + 1, -nu
        elif full and coming == breaks.size:
            what = LIMIT
            break
        elif (gone >= reach and 2.0 * base >= ceiling) or count >= MOST_PANELS:
            what = PAUSED
            break
    middle = located(origin, v, mark, breaks, coming)
    onwards, strict = step * (2.0 * g * left + c + g * step), strict - gone
    if what == TURN or what == ASYMPTOTE:
        place = located(origin, v, gone, breaks, coming)
    elif searching and what != FULL:
        strict = gone - mark if what == PAUSED or what == DIPPED else inf
        what, place, base, nu, met = DIPPED, middle, mark_base, mark_nu, mark_met
    else:
        place = (limit, 0.0) if what == LIMIT else located(origin, v, gone, breaks, coming)
        middle = place
    slack = 0.5 * c if g > 0.0 else inf
    return what, place, base, nu, onwards, strict, middle, slack, met, kept, coming
