"""A run of the body along the curve where forces dissipate: panel after panel, until it turns, ends or may pause.

Time is counted on the way as long as V**2 is large. From where V**2 decreases for good the run is only followed to its
end, from which time is then counted back (`follow`).
"""

from math import fabs, inf, sqrt
from typing import NamedTuple

from gqm_sym.runtime.arithmetic.clenshaw import chebyshev_sum
from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.compiled.calls import call_speed_equation
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import on_stack
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.legs.leg_breaks import clearance, located, offset, span_before, within
from gqm_sym.runtime.legs.leg_equation import (
    EXPM1_Q,
    FORCE,
    KAPPA,
    LOAD,
    MEAN,
    N0,
    OFFSET,
    SERIES,
    SPEED,
    W_FACTOR,
    March,
    P,
    Panel,
    Q,
    W,
    as_factor,
    begin_panel,
    distance,
    fill_rates,
    load_per_mass_row,
    marched,
    panel_buffer,
    set_nodes,
    slope_at,
    solve_panel,
)
from gqm_sym.runtime.legs.leg_panels import (
    ALWAYS,
    CANCELLATION_NOISE,
    END_EXPM1,
    GAP_COLUMNS,
    GAP_V2_RATIO,
    HIGH_V2_RATIO,
    MAX_PANELS,
    MAYBE,
    MIN_RELATIVE_WIDTH,
    NEVER,
    PanelRequest,
    fill_gap,
    first_change_of,
    next_panel,
    pass_by_powers,
    pass_by_rows,
    size_at,
)
from gqm_sym.runtime.legs.leg_record import (
    COLUMNS,
    HEAD,
    NO_RATES,
    NO_VALUES,
    NORMAL_LOAD,
    PASSAGE,
    PEAKS,
    RIGHT,
    TIME,
    TIME_ERROR,
    Y_ROW,
    add_panel,
    change_at,
    copy,
    has_space,
)
from gqm_sym.runtime.legs.polynomials import COUNT, extent, size_of, to_coefficients

# What ended a run:
#
# ========== ==================================================================================================
# TURN       V**2 vanished, and the body turns or rests
# LIMIT      the end of the domain, or of the range of breaks that were given
# LIFTOFF    N took the sign that it cannot have
# ASYMPTOTE  V**2 and the force vanish together: the body approaches an equilibrium; by a law that is not linear in
#            V**2, it is closer to it than its place in doubles can tell
# PAUSED     it has run far enough for once
# NARROWED   a place where the functions are not smooth: no panel that doubles can represent is narrow enough
# SPENT      too many panels were needed
# SLOWED     the body becomes slow from the place given, but does not turn; it has to be run again from there
# FULL       the record is full
# ========== ==================================================================================================
#
# GOES_ON is the code of a run that has not ended.
TURN, LIMIT, LIFTOFF, ASYMPTOTE, PAUSED, NARROWED, SPENT, SLOWED, FULL = range(9)
GOES_ON = -1

# The ratio of N to the sum of the sizes of its parts below which it counts as zero: the curvature of a chart has a
# digit less than doubles.
ZERO_TOLERANCE = 5e-14

# A body this close to a turn, as a share of the distance it has run, counts as being there; some laws have no value
# beyond a turn.
NEAR_TURN = 1e-11

# The width of the first panel of a leg, and of the first one after a break, against the distance on which the
# acceleration there would stop the body.
STOPPING_SHARE = 2.0

# A body whose place is smaller than where the run began by this factor, and which goes on by hardly more than that, is
# on its way to an equilibrium at 0: places that are counted from farther away would lose their digits.
CLOSE_SHARE = 2.0**-10

# The number of panels after which a run pauses.
PANELS_PER_RUN = 512

# The steps by which it is found where a body that moves slowly would have been at rest.
REST_STEPS = 4

# How far, as a share, times may be off that are summed in another order.
ROUNDINGS_OF_TIMES = 1e-12

# V**2 of a body at rest, for laws that take its root.
LEAST_V2 = 1e-300

# A buffer for one place, V**2 there, and the five numbers of the speed equation.
point_buffer = on_stack(7)


class Start(NamedTuple):
    """Where a run begins.

    Attributes
    ----------
    place, place_low : float
        The place as two doubles.
    v2 : float
        V**2.
    direction : int
        The sign of dlam/dt.
    contact_sign : int
        The sign of N; 0 if it has to be found out.
    step : float
        The distance to begin with.
    no_turn_until : float
        The distance up to which no turn is expected, however slow the body becomes.
    width : float
        About how long the leg is, if it begins at a turn; 0 if that is unknown.
    may_be_whole : bool
        Whether the leg is tried as one polynomial, if it begins at a turn.
    """

    place: float
    place_low: float
    v2: float
    direction: int
    contact_sign: int
    step: float
    no_turn_until: float
    width: float
    may_be_whole: bool


class Reading(NamedTuple):
    """What is read of the record of a leg.

    Attributes
    ----------
    what : int
        TIMES to PANELS (`leg_record`).
    force : bool
        Of PEAKS, whether the contact force is read instead of the speed.
    sign : float
        1 for the largest, -1 for the smallest.
    best : float
        ``sign`` times the largest or smallest so far; what does not exceed it need not be in the record.
    """

    what: int
    force: bool
    sign: float
    best: float


class Route(NamedTuple):
    """The curve ahead of a run.

    Attributes
    ----------
    breaks : array
        Places where panels have to begin, in the order in which they are passed; some may lie behind.
    limit : float
        The end of the domain.
    pause : float
        The distance from which on the run may pause.
    only_sign : int
        The only sign that N can have; 0 if it can have both.
    reading : Reading
    until, target : float
        The time from the leg's start up to which it is read, and the place whose passage is looked for.
    gaps : array
        What is kept of the curve between its breaks (`leg_panels`); empty if that is not used.
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


class Ahead(NamedTuple):
    """What is ahead of a panel.

    Attributes
    ----------
    upcoming : int
        The index of the next break.
    span : (float, float)
        The places between which the curve may be evaluated (`leg_breaks`).
    widest : float
        The width that the panel may have at most; infinite but for the first panel and those after a break.
    is_limited : bool
        Whether ``widest`` has been found. After a break this waits until the panel turns out to have a turn.
    """

    upcoming: int
    span: tuple[float, float]
    widest: float
    is_limited: bool


class Change(NamedTuple):
    """The first places on a panel, as x in [-1, 1], where something ends; 2 where it does not.

    Attributes
    ----------
    turn : float
        Where V**2 becomes negative.
    touch : float
        Where V**2 vanishes within its noise without changing its sign.
    load : float
        Where N changes its sign.
    first : float
        The smallest of these.
    """

    turn: float
    touch: float
    load: float
    first: float


class Timed(NamedTuple):
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


class Passed(NamedTuple):
    """How far a run has come.

    Attributes
    ----------
    left, run_length : float
        The march variable and the distance from the origin.
    v2, largest_v2 : float
        V**2 there, and the largest so far.
    ahead : Ahead
    panel_count : int
        How many panels were recorded.
    """

    left: float
    run_length: float
    v2: float
    largest_v2: float
    ahead: Ahead
    panel_count: int


class End(NamedTuple):
    """How a run ended.

    Attributes
    ----------
    what : int
        TURN to FULL.
    place : (float, float)
        The place as two doubles.
    v2 : float
        V**2 there.
    contact_sign : int
        The sign of N there.
    step, no_turn_until : float
        As in `Start`, from here on.
    middle : (float, float)
        The place up to which time is counted, as two doubles.
    half_c : float
        c/2 of the march variable (`leg_equation.March`); infinite where it is the distance itself.
    change_count, panel_count : int
        How often N has changed its sign, and how many panels were recorded.
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
def equilibrium_near(work, direction, touch):  # type: ignore[no-untyped-def]
    """The place x near ``touch`` where V**2, which almost vanishes there, is smallest, because the force vanishes."""
    for j in range(COUNT):
        work[MEAN + j] = direction * (work[P + j] - work[Q + j] * work[W + j])
    to_coefficients(work, MEAN, work, SERIES)
    c = work[SERIES : SERIES + COUNT]
    x, new = touch, touch + 1e-4
    before = chebyshev_sum(c, x)
    for _ in range(30):  # the secant method
        value = chebyshev_sum(c, new)
        if value == before:
            break
        x, before, new = new, value, new - value * (new - x) / (value - before)
    return new if fabs(new - touch) <= 1e-2 else touch


@Inner
def slope_of_v2(forces, place, v2, contact_sign, point):  # type: ignore[no-untyped-def]
    """By how much V**2 grows per distance run; also fills ``point`` from index 2 on with DS to KAPPA."""
    v, nu = float(forces.direction), float(contact_sign)
    point[0], point[1] = place, v2
    call_speed_equation(forces.speed_equation, 1, point, (0, 1, 2), v, nu, forces.params)
    return forces.direction * (point[3] - point[4] * v2)


@Inner
def sign_of_load(forces, place, v2, point):  # type: ignore[no-untyped-def]
    """The sign of N at a place; 0 where it is zero within rounding."""
    slope_of_v2(forces, place, v2, 0, point)
    load, centripetal = point[5], point[6] * v2
    if fabs(load + centripetal) > ZERO_TOLERANCE * (fabs(load) + fabs(centripetal)):
        return 1 if load + centripetal > 0.0 else -1
    return 0


@Inner
def distance_from_rest(forces, start, span, contact_sign, slope, point):  # type: ignore[no-untyped-def]
    """How far behind a start V**2 would vanish, by the steps of Runge and Kutta from speed to speed."""
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
    """The march variable from a start on, and the width that the first panel may have at most.

    After a slow launch the root of V**2 has its zero where the march variable is ``-c/2``: the speed over it would not
    be smooth if c were only about right, and panels are too wide to tell.
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
        # V**2 at launch is exact; a turn near the launch has all digits on a panel that is no wider than this.
        widest = STOPPING_SHARE * start.v2 / -slope if slope < 0.0 else inf
    return March(origin, start.direction, g, c), widest


@Inner
def begin(forces, start, route, off, point):  # type: ignore[no-untyped-def]
    """The march variable of a run, the sign of N with which it begins, and what is ahead of it."""
    breaks, origin, upcoming = route.breaks, (start.place, start.place_low), 0
    while upcoming < breaks.size and offset(breaks[upcoming], origin, start.direction) <= 0.0:
        upcoming += 1
    span, contact_sign = span_before(breaks, upcoming, start.direction, off), start.contact_sign
    place = within(start.place, span)
    if contact_sign == 0:
        contact_sign = sign_of_load(forces, place, start.v2, point)
    march, widest = begin_march(forces, start, place, span, contact_sign, point)
    return march, contact_sign, Ahead(upcoming, span, widest, True)


@Inner
def pass_break(march, route, off, v2, ahead, run_length):  # type: ignore[no-untyped-def]
    """What is ahead of a panel that begins at the distance ``run_length`` with V**2 = ``v2``."""
    upcoming, breaks, v = ahead.upcoming, route.breaks, march.direction
    if upcoming == breaks.size or offset(breaks[upcoming], march.origin, v) > run_length:
        return ahead
    return Ahead(upcoming + 1, span_before(breaks, upcoming + 1, v, off), inf, v2 == 0.0)


@Inner
def limited(forces, march, panel, ahead, change, run_length, point):  # type: ignore[no-untyped-def]
    """What is ahead of a panel that begins at the distance ``run_length`` and has these changes.

    V**2 at a break is as exact as at launch, so that a panel after it that has a turn is as narrow as the first one.
    """
    if ahead.is_limited or min(change.turn, change.touch) > 1.0:
        return ahead
    place, widest = within(march.origin[0] + march.direction * run_length, panel.span), inf
    slope = slope_of_v2(forces, place, panel.v2, panel.contact_sign, point)
    if slope < 0.0:
        widest = marched(run_length + STOPPING_SHARE * panel.v2 / -slope, march) - panel.left
    return Ahead(ahead.upcoming, ahead.span, widest, True)


@Inner
def end_at_once(forces, march, panel, run_length, point):  # type: ignore[no-untyped-def]
    """What ends a run where no panel can be laid, at what distance and with what V**2: a turn, if one is near.

    Where a body at rest would go on, it is no turn but an equilibrium, V**2 grows with the square of the distance from
    there, and the body never comes to it.
    """
    if not forces.linear and panel.v2 > 0.0:
        here = march.origin[0] + march.direction * run_length
        place = within(here, panel.span)
        goes_on = slope_of_v2(forces, place, LEAST_V2, panel.contact_sign, point) > 0.0
        slope = slope_of_v2(forces, place, panel.v2, panel.contact_sign, point)
        if slope < 0.0 and panel.v2 <= -slope * NEAR_TURN * max(fabs(here), run_length):
            return (ASYMPTOTE, run_length, panel.v2) if goes_on else (TURN, run_length - panel.v2 / slope, 0.0)
    return NARROWED, run_length, panel.v2


@Inner
def turn_below_noise(forces, march, panel, change, run_length, point):  # type: ignore[no-untyped-def]
    """`end_at_once` where V**2 is below its noise because the panel begins next to a turn; GOES_ON elsewhere."""
    if change.first == change.touch and not forces.linear:
        what, turn, v2 = end_at_once(forces, march, panel, run_length, point)
        if what == TURN:
            return what, turn, v2
    return GOES_ON, run_length, panel.v2


@Inner
def may_pause(forces, march, route, run_length, speeds, panel):  # type: ignore[no-untyped-def]
    """Whether a body has run far enough for once, or approaches an equilibrium at 0 that the run's start is far from.

    ``speeds`` are V**2 and the largest so far, ``panel`` where the next one begins and how wide it is to be.
    """
    here, (left, step) = fabs(march.origin[0] + march.direction * run_length), panel
    onwards = step * (slope_at(left, march) + march.g * step)
    is_close = not forces.linear and onwards <= here <= CLOSE_SHARE * fabs(march.origin[0])
    return is_close or (run_length >= route.pause and 2.0 * speeds[0] >= speeds[1])


@Inner
def first_changes(march, panel, largest_v2, load_change, work):  # type: ignore[no-untyped-def]
    """The first changes on a panel, on which N changes its sign at x = ``load_change``."""
    if panel.v2 == 0.0:
        scale = size_of(work, FORCE)
    else:
        scale = max(as_factor(largest_v2, march, panel.left), work[size_at(W_FACTOR)])
    turn, _, touch = first_change_of(work, W_FACTOR, 1, CANCELLATION_NOISE * scale)
    if touch <= -1.0 and panel.v2 == 0.0:
        touch = 2.0
    return Change(turn, touch, load_change, min(turn, touch, load_change))


@Inner
def changes_at_once(march, panel, width, change, run_length):  # type: ignore[no-untyped-def]
    """Whether N is zero at the panel's start, so that what follows decides its sign."""
    if change.first == change.load and change.first <= 1.0:
        where = distance(panel.left + width * (0.5 * (1.0 + change.first)), march)
        here = march.origin[0] + march.direction * run_length
        return where <= run_length + MIN_RELATIVE_WIDTH * max(fabs(here), run_length)
    return False


@Inner
def cut_panel(forces, march, panel, width, change, run_length, work, point):  # type: ignore[no-untyped-def]
    """Lay a panel once more, so that it ends at the first change; returns the march variable there.

    Its own sum has more digits than the series of a wider panel.
    """
    x = change.first
    if x == change.touch and x != change.turn:
        x = equilibrium_near(work, forces.direction, change.touch)
    right = panel.left + width * (0.5 * (1.0 + x))
    begin_panel(forces, march, panel, right - panel.left, work)
    solve_panel(forces, march, panel, work)
    fill_rates(march, panel, work)
    if change.first == change.turn and forces.linear:
        v2, there = work[W + COUNT], distance(right, march)
        place = within(march.origin[0] + march.direction * there, panel.span)
        slope = slope_of_v2(forces, place, v2, panel.contact_sign, point)
        if fabs(v2) < fabs(slope) * 1e-6 * (there - run_length):
            right = marched(there - v2 / slope, march)
    elif change.first == change.load and change.first != change.touch:
        # N at the panel's end has no error of a series, nor has the distance left to where it vanishes.
        load, load_before = work[LOAD + COUNT], work[LOAD + COUNT - 1]
        rate = (load - load_before) / (work[OFFSET + COUNT] - work[OFFSET + COUNT - 1])
        if fabs(load) < fabs(rate) * 1e-6 * (right - panel.left):
            right -= load / rate
    return right


@Inner
def enter_change(record, count, place):  # type: ignore[no-untyped-def]
    """Enter a place where N changes its sign in the record; returns the number of changes."""
    record[change_at(record, count)] = place
    return count + 1


@Inner
def enter_panel(record, count, right, width, work):  # type: ignore[no-untyped-def]
    """Enter a panel that ends at w = ``right`` in the record; returns the number of panels."""
    add_panel(record, HEAD + count * COLUMNS, right, width, work)
    return count + 1


@Inner
def largest_after(largest_v2, v2, ends_here, work):  # type: ignore[no-untyped-def]
    """The largest V**2 so far, of which resistance alone leaves the share exp(-q) on a panel beginning with ``v2``."""
    damped = largest_v2 if ends_here else largest_v2 / (1.0 + work[EXPM1_Q + COUNT])
    return max(damped, max(v2, extent(work, W)[1]))


@Inner
def what_after(change, at_limit, pauses):  # type: ignore[no-untyped-def]
    """What ends a run after a panel, or GOES_ON."""
    if change.first <= 1.0:
        if change.first == change.turn:
            return TURN
        return ASYMPTOTE if change.first == change.touch else GOES_ON
    if at_limit:
        return LIMIT
    return PAUSED if pauses else GOES_ON


@Inner
def what_before(contact_sign, only_sign, has_room, fast_again, at_limit):  # type: ignore[no-untyped-def]
    """What ends a run before a panel, or GOES_ON."""
    if contact_sign != 0 and contact_sign == -only_sign:
        return LIFTOFF
    if not has_room:
        return FULL
    if fast_again:
        return SLOWED
    return LIMIT if at_limit else GOES_ON


@Inner
def conclude(forces, route, march, end, timed, searching, run_length):  # type: ignore[no-untyped-def]
    """The end of a run at the distance ``run_length``; ``end`` has all of it but the places."""
    breaks, v, what = route.breaks, march.direction, end.what
    middle = located(march.origin, v, timed.distance, breaks, end.upcoming)
    v2, sign, changes, no_turn_until = end.v2, end.contact_sign, end.change_count, end.no_turn_until - run_length
    place = middle
    if what == TURN or (what == ASYMPTOTE and forces.linear):
        place = located(march.origin, v, run_length, breaks, end.upcoming)
    elif searching and what != FULL:
        goes_on = what == PAUSED or what == SLOWED or (what == LIMIT and route.period > 0.0)
        no_turn_until = run_length - timed.distance if goes_on else inf
        what, v2, sign, changes = SLOWED, timed.v2, timed.contact_sign, timed.change_count
    else:
        place = (route.limit, 0.0) if what == LIMIT else located(march.origin, v, run_length, breaks, end.upcoming)
        middle = place
    count, upcoming = end.panel_count, end.upcoming
    return End(what, place, v2, sign, end.step, no_turn_until, middle, end.half_c, changes, count, upcoming)


@Inner
def ends_of_gap(all_breaks, period, gap):  # type: ignore[no-untyped-def]
    """Between which places a gap lies; the last one of a closed curve goes on to the first break of the next lap."""
    return all_breaks[gap], (all_breaks[gap + 1] if gap + 1 < all_breaks.size else all_breaks[0] + period)


@Inner
def may_be_peak(reading, bounds):  # type: ignore[no-untyped-def]
    """Whether what is looked for may be on a gap with these bounds."""
    if reading.force:
        return (bounds.most_load if reading.sign > 0.0 else -bounds.least_load) > reading.best
    return (sqrt(bounds.most_v2) if reading.sign > 0.0 else -sqrt(bounds.least_v2)) > reading.best


@Inner
def is_read_inside(route, places, times):  # type: ignore[no-untyped-def]
    """Whether a gap has the place or the time up to which a leg is read, which takes a panel."""
    if route.reading.what == PASSAGE:
        return min(places) <= route.target <= max(places)
    near = ROUNDINGS_OF_TIMES * times[1]
    return times[0] - near <= route.until <= times[1] + near


@Inner
def pass_gaps(forces, march, route, contact_sign, before, record, work):  # type: ignore[no-untyped-def]
    """Go on from the break ahead, from one to the next, as far as V**2 is large and follows from what is kept."""
    (left, run_length, v2, largest_v2, ahead, count), v, spent = before, march.direction, 0.0
    breaks, gaps, upcoming, reads = route.breaks, route.gaps, ahead.upcoming, route.reading.what
    to, total, total_low, may_join = HEAD + count * COLUMNS, 0.0, 0.0, False
    for k in range(count):
        spent += record[HEAD + k * COLUMNS + TIME]
    while gaps.size > 0 and upcoming + 1 < breaks.size and v2 >= GAP_V2_RATIO * largest_v2:
        start, stop = breaks[upcoming], breaks[upcoming + 1]
        # A break lies behind already where a panel is laid once more.
        is_ahead = offset(start, march.origin, v) == run_length
        if contact_sign in (0, -route.only_sign) or not (is_ahead and has_space(record, to, 0)):
            break
        gap = (route.first_break + (upcoming if v > 0 else -upcoming - 1)) % route.all_breaks.size
        low, high = ends_of_gap(route.all_breaks, route.period, gap)
        at, width = GAP_COLUMNS * (4 * gap + (v + 1) + (contact_sign + 1) // 2), high - low
        if gaps[at] == 0.0:
            off, begin_at = clearance(low, high), low if v > 0 else high
            panel = Panel(0.0, 0.0, contact_sign, (low + off, high - off))
            fill_gap(forces, March((begin_at, 0.0), v, 0.0, 1.0), panel, width, gaps, at, work)
        time, end, bounds = pass_by_powers(v2, contact_sign, gaps, at)
        top, has_values = bounds.most_v2, reads == PEAKS and not (time > 0.0 and not may_be_peak(route.reading, bounds))
        if has_values or not time > 0.0:
            time, end, top = pass_by_rows(v2, contact_sign, width, gaps, at, work)
        if not time > 0.0 or is_read_inside(route, (start, stop), (spent, spent + time)):
            break
        largest_v2 = max(largest_v2 / (1.0 + gaps[at + END_EXPM1]), max(v2, top))
        v2, upcoming, spent = end, upcoming + 1, spent + time
        run_length = offset(stop, march.origin, v)
        # Gaps of which nothing is read but the time are one entry.
        to += COLUMNS if may_join and has_values else 0
        total, rounding = two_sum(total if may_join and not has_values else 0.0, time)
        total_low = rounding + (total_low if may_join and not has_values else 0.0)
        if has_values:
            load_per_mass_row(work, MEAN, N0, KAPPA, W)
            copy(record, to + Y_ROW, work, SPEED)
            copy(record, to + NORMAL_LOAD, work, MEAN)
        record[to + RIGHT], record[to + TIME] = marched(run_length, march), total + total_low
        record[to + TIME_ERROR], may_join = NO_RATES if has_values else NO_VALUES, not has_values
        to += COLUMNS if has_values else 0
    if upcoming > ahead.upcoming:
        left, ahead = marched(run_length, march), Ahead(upcoming, ahead.span, inf, True)
        count = (to - HEAD) // COLUMNS + (1 if may_join else 0)
    return Passed(left, run_length, v2, largest_v2, ahead, count)


@Inner
def run(forces, start, route, off, record):  # type: ignore[no-untyped-def]
    """Follow the body from a start to the first turn, end or pause.

    Parameters
    ----------
    forces : Forces
    start : Start
    route : Route
    off : float
        How far from the breaks the curve is evaluated (`leg_breaks`).
    record : array
        Filled with panels up to the middle, and changes of N's sign (`leg_record`).

    Returns
    -------
    End
    """
    work, point, v = panel_buffer(), point_buffer(), start.direction
    set_nodes(work)
    march, nu, ahead = begin(forces, start, route, off, point)
    v2, left, run_length, largest_v2, step = start.v2, 0.0, 0.0, start.v2, marched(start.step, march)
    # Once time is not counted any more, a turn is searched for.
    what, panel_count, recorded, change_count, searching, at_stop = GOES_ON, 0, 0, 0, False, False
    # Time on the second half of a leg is counted from its end, unless breaks limit its panels anyway; laws that are not
    # linear keep to what is next to it.
    middle = 0.5 * start.width if forces.linear and start.v2 == 0.0 and start.width > 0.0 else inf
    timed = Timed(run_length, v2, nu, change_count)
    for _ in range(MAX_PANELS):
        if at_stop and not searching:
            left, run_length, v2, largest_v2, ahead, recorded = pass_gaps(
                *(forces, march, route, nu, Passed(left, run_length, v2, largest_v2, ahead, recorded), record, work)
            )
            timed = Timed(run_length, v2, nu, change_count)
        late = v2 < HIGH_V2_RATIO * largest_v2 or (run_length >= middle and (searching or not at_stop))
        ahead = pass_break(march, route, off, v2, ahead, run_length)
        at_end = ahead.upcoming == route.breaks.size
        stop = offset(route.limit if at_end else route.breaks[ahead.upcoming], march.origin, v)
        has_room = has_space(record, HEAD + recorded * COLUMNS, change_count)
        what = what_before(nu, route.only_sign, has_room, searching and not late, stop <= run_length)
        if what != GOES_ON:
            break
        panel, max_width = Panel(left, v2, nu, ahead.span), marched(stop, march) - left
        timing = ALWAYS if run_length < start.no_turn_until else (NEVER if searching or late else MAYBE)
        width, step, is_timed = next_panel(
            forces, march, panel, PanelRequest(min(max_width, ahead.widest), step, largest_v2, timing, True), work
        )
        if width == 0.0:
            what, run_length, v2 = end_at_once(forces, march, panel, run_length, point)
            break
        load_change, sign, _ = first_change_of(work, LOAD, nu, ZERO_TOLERANCE * work[size_at(LOAD)])
        if nu == 0 and sign != 0:
            nu = sign
            if forces.friction or nu == -route.only_sign:
                continue  # with forces of this sign
        change = first_changes(march, panel, largest_v2, load_change, work)
        what, run_length, v2 = turn_below_noise(forces, march, panel, change, run_length, point)
        if what == TURN:
            break
        ahead = limited(forces, march, panel, ahead, change, run_length, point)
        if ahead.widest < width:
            continue
        if changes_at_once(march, panel, width, change, run_length):
            change_count, nu = (
                enter_change(record, change_count, start.place + v * run_length) if left > 0.0 else change_count,
                -nu,
            )
            continue
        if not searching and timing != ALWAYS and (late or not is_timed):
            searching, timed = True, Timed(run_length, v2, nu, change_count)
        right, ends_here = left + width, change.first <= 1.0
        if ends_here:
            right = cut_panel(forces, march, Panel(left, v2, nu, ahead.span), width, change, run_length, work, point)
        recorded = recorded if searching else enter_panel(record, recorded, right, right - left, work)
        at_stop, panel_count = not ends_here and width == max_width, panel_count + 1
        largest_v2 = largest_after(largest_v2, v2, ends_here, work)
        v2, left, run_length = max(work[W + COUNT], 0.0), right, stop if at_stop else distance(right, march)
        ahead, timed = (
            Ahead(ahead.upcoming, ahead.span, inf, True),
            timed if searching else Timed(run_length, v2, nu, change_count),
        )
        pauses = may_pause(forces, march, route, run_length, (v2, largest_v2), (left, step))
        what = what_after(change, at_stop and at_end, pauses or panel_count >= PANELS_PER_RUN)
        if what != GOES_ON:
            v2 = 0.0 if ends_here else v2
            break
        if ends_here:
            change_count, nu = enter_change(record, change_count, start.place + v * run_length), -nu
    onwards, half_c = step * (slope_at(left, march) + march.g * step), 0.5 * march.c if march.g > 0.0 else inf
    ends = (SPENT if what == GOES_ON else what, march.origin, v2, nu, onwards, start.no_turn_until, march.origin)
    end = End(*ends, half_c, change_count, recorded, ahead.upcoming)
    return conclude(forces, route, march, end, timed, searching, run_length)
