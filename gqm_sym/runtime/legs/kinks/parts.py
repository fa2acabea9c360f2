"""A leg from one turn to the next past kinks of the law (`kinks.places`), or past places beside which it has branch
points, as a polynomial for each part between them.

On the first part, ``W = h y C`` as in `arrival`; between two kinks W begins with its value at the first. On the last
part, the distance h to the turn is sought as the width of a whole leg is (`whole_leg`), and ``W = h (1 - y) C`` comes
from means towards the turn, so that W has all its digits there too. Parts have 23, 47 or 71 nodes, and a stretched
variable (`leg_variable`) where a branch point of ds is near.

The record gets the time on the leg, and the extreme that is read of it. Where panels are needed, the leg is followed
again (`run`).
"""

from math import inf, log1p, sqrt
from typing import NamedTuple

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import over_rows
from gqm_sym.runtime.legs.gaps.passing import ROUNDINGS_OF_TIMES
from gqm_sym.runtime.legs.kinks.curvature import curvature_sign
from gqm_sym.runtime.legs.kinks.places import next_kink, note_kinks
from gqm_sym.runtime.legs.leg_record import HEAD, KNOWN_PEAK, NO_VALUES, PASSAGE, PEAKS, RIGHT, TIME, TIME_ERROR, Y_ROW
from gqm_sym.runtime.legs.panels.breaks import offset, place_after
from gqm_sym.runtime.legs.panels.equation import (
    EXPM1_Q,
    FORCE,
    MEAN,
    NODES,
    OFFSET,
    SPEED,
    TAILS,
    TIME_RATE,
    W_FACTOR,
    March,
    Panel,
    W,
    copy,
    copy_row,
    damped_row,
    product,
    solution_row,
)
from gqm_sym.runtime.legs.panels.point import SMOOTH_AT_REST, point_buffer, sign_of_load
from gqm_sym.runtime.legs.panels.polynomials import WIDE
from gqm_sym.runtime.legs.panels.resolution import CANCELLATION_NOISE
from gqm_sym.runtime.legs.runs.branch_points import branch_beside
from gqm_sym.runtime.legs.runs.ends import END_NONE, END_PAUSE, END_TURN, End
from gqm_sym.runtime.legs.runs.leg_variable import LegVariable, unstretched, variable_for
from gqm_sym.runtime.legs.runs.peaks import Stretch, peak_of_part
from gqm_sym.runtime.legs.runs.whole_leg import CHECK, variable_of_leg
from gqm_sym.runtime.legs.runs.whole_rows import (
    FROM_TURN,
    are_rows_resolved,
    begin_leg,
    blocks_for,
    choose_variable,
    extent_of_row,
    fill_load,
    fill_times,
    fill_v2,
    is_contact_force_resolved,
    keeps_sign,
    load_sign,
    sample_leg,
    size_of_row,
    whole_buffer,
)
from gqm_sym.runtime.legs.runs.whole_tables import IN_SHARE, MAX_BLOCKS, to_arrival_time, to_means

# The least ratio of V**2 between two parts to the largest so far. A rounding of the latter has an effect on the time
# that grows with the root of its inverse.
LEAST_RATIO = 2.0**-9

# The largest number of attempts for the parts of a leg.
MAX_TRIES = 16

# A part is tried with more nodes if it is longer than this share of one that fewer have not resolved.
MIN_SHARE = 0.9

# The share of the way to the next kink at which a turn is sought if V**2 vanishes before that.
TO_SEEK = 0.75

# The largest ratio of the length of a part to its distance from a turn behind or ahead of it. A longer one is divided,
# and what is not next to the turn then has a smaller ratio. For the other part the logarithm of the distance from the
# turn is the variable.
MAX_GRADING, GRADING = 3.0, 2.7

# What is at the end of a part.
AT_KINK, AT_TARGET, AT_LIMIT, BETWEEN = range(4)

# Whether a part is resolved, or V**2, N or the curvature may change its sign on it.
RESOLVED, UNRESOLVED, CHANGES_SIGN = range(3)

left_row = over_rows(lambda factor, y, h: factor * (h * (y - 1.0)), WIDE)


class PartStart(NamedTuple):
    """The start of a part of a leg.

    Attributes
    ----------
    place : (float, float)
        The place as two doubles.
    v2 : float
        V**2.
    is_kink : bool
        Whether it is a kink.
    passed : float
        Its distance from the leg's start.
    largest_v2 : float
        The largest V**2 on the leg so far.
    time, time_low : float
        The time from the leg's start, as two doubles.
    peak : float
        The extreme that is read of the leg so far, as in `Reading.best`.
    """

    place: tuple[float, float]
    v2: float
    is_kink: bool
    passed: float
    largest_v2: float
    time: float
    time_low: float
    peak: float


@Inner
def reverse_row(blocks, work, row):  # type: ignore[no-untyped-def]
    """Reverse the values at the nodes of a row."""
    first, last = blocks * row, blocks * row + blocks * WIDE - 2
    for j in range((blocks * WIDE - 1) // 2):
        work[first + j], work[last - j] = work[last - j], work[first + j]


@Inner
def fill_v2_to_turn(blocks, v2, h, work):  # type: ignore[no-untyped-def]
    """Fill the rows W_FACTOR and W of a part that ends at a turn.

    On its first half W comes from the value ``v2`` at its start, so that the rounding of the turn has no effect there.
    """
    last = blocks * WIDE - 1
    for at in range(0, last, WIDE):
        copy(work, blocks * MEAN + at, work, blocks * FORCE + at)
    reverse_row(blocks, work, MEAN)
    to_means(blocks, work, blocks * MEAN, work, blocks * W_FACTOR)
    reverse_row(blocks, work, W_FACTOR)
    work[blocks * W_FACTOR + last] = work[blocks * FORCE + last]
    for at in range(0, last, WIDE):
        factor = blocks * W_FACTOR + at
        product(work, factor, factor, -1.0)
        damped_row(work, factor, factor, blocks * EXPM1_Q + at)
        left_row(work, blocks * W + at, factor, blocks * NODES + at, -h)
    fill_gained(blocks, v2, SPEED, work)
    for j in range(last // 2):
        w = work[blocks * SPEED + j]
        work[blocks * W + j], work[blocks * W_FACTOR + j] = w, w / (h * (1.0 - work[blocks * NODES + j]))


@Inner
def fill_gained(blocks, v2, row, work):  # type: ignore[no-untyped-def]
    """Fill a row with W, which begins with the value ``v2``."""
    to_means(blocks, work, blocks * FORCE, work, blocks * SPEED)
    for at in range(0, blocks * WIDE, WIDE):
        gained = blocks * SPEED + at
        product(work, gained, gained, blocks * OFFSET + at)
        solution_row(work, blocks * row + at, gained, blocks * EXPM1_Q + at, v2)


@Inner
def fill_v2_onwards(blocks, v2, work):  # type: ignore[no-untyped-def]
    """Fill the rows W_FACTOR and W of a part between two kinks with W, which begins with the value ``v2``."""
    fill_gained(blocks, v2, W, work)
    for at in range(0, blocks * WIDE, WIDE):
        copy_row(work, blocks * W_FACTOR + at, blocks * W + at)


@Inner
def verdict_on_part(forces, blocks, nu, variable, reading, work):  # type: ignore[no-untyped-def]
    """Fill the other rows; return whether they are resolved and V**2 and N each have one sign on a part; or else the
    largest ratio of middle coefficients to sizes of rows that are not resolved.
    """
    h, is_stretched = variable.width, variable.extent > 0.0
    fill_load(blocks, work)
    fine, worst = are_rows_resolved(blocks, h, work)
    load_fine, is_kept, load_ratio = load_sign(is_stretched, blocks, nu, work)
    if load_fine and reading.what == PEAKS and reading.force:
        load_fine, load_ratio = is_contact_force_resolved(forces, reading.length, is_stretched, blocks, work)
    if not (fine and load_fine):
        return UNRESOLVED, max(worst, load_ratio)
    noise = CANCELLATION_NOISE * size_of_row(blocks, work, W_FACTOR)
    if not (is_kept and keeps_sign(blocks, work, W_FACTOR, 1, noise)):
        return CHANGES_SIGN, 0.0
    fine, ratio = fill_times(blocks, h, work)
    return RESOLVED if fine else UNRESOLVED, ratio


@Inner
def time_of_part(blocks, v2, h, is_last, work):  # type: ignore[no-untyped-def]
    """Return the time on a part from the row TIME_RATE."""
    if v2 > 0.0 and not is_last:
        to_means(blocks, work, blocks * TIME_RATE, work, blocks * MEAN)
        return sqrt(h) * work[blocks * MEAN + blocks * WIDE - 1]
    if is_last:
        reverse_row(blocks, work, TIME_RATE)
    to_arrival_time(blocks, work, blocks * TIME_RATE, work, blocks * TAILS)
    return work[blocks * TAILS]


@Inner
def blocks_to_try(kinks, width):  # type: ignore[no-untyped-def]
    """Return the number of blocks with which a part of about a width is first tried."""
    blocks = 1
    while blocks < MAX_BLOCKS and 0.0 < MIN_SHARE * kinks[blocks] < width:
        blocks += 1
    return blocks


@Inner
def variable_between(branch, march, passed, room, rest):  # type: ignore[no-untyped-def]
    """Return the variable of a part between two kinks; next to a turn behind or ahead of it, the logarithm of the
    distance from there.
    """
    ahead = rest - room
    if passed < min(room, ahead):
        return LegVariable(room, passed, 0.0, log1p(room / passed))
    if 0.0 < ahead < room:
        return LegVariable(room, 0.0, rest, log1p(room / ahead))
    return variable_for(branch, march.origin, march.direction, room)


@Inner
def lay_part(forces, march, panel, blocks, distances, branch, work):  # type: ignore[no-untyped-def]
    """Fill the rows of the law on a part; return its variable, and whether it ends at a turn.

    The ``distances`` are those of the leg's start, of the end of the part unless there is a turn before, and of the
    expected turn. The width is infinite if there is no end, or 0 without rows.
    """
    passed, room, rest = distances
    begin_leg(blocks, work)
    if panel.v2 > 0.0 and rest <= room:
        variable = variable_for(branch, march.origin, march.direction, rest)
        variable = variable_of_leg(forces, march, panel, blocks, room, variable, CHECK, work)
        if variable.width > 0.0:
            return variable, True
    if not room < inf:
        return unstretched(room), False
    if passed > 0.0:
        variable = variable_between(branch, march, passed, room, rest)
    else:
        variable = variable_for(branch, march.origin, march.direction, room)
    if not sample_leg(forces, march, panel, blocks, variable, work):
        return unstretched(0.0), False
    return variable, False


@Inner
def solve_part(part, blocks, h, is_last, work):  # type: ignore[no-untyped-def]
    """Fill the rows W_FACTOR and W of a part; return V**2 at its end, and the largest on the leg so far."""
    if is_last:
        fill_v2_to_turn(blocks, part.v2, h, work)
    elif part.v2 == 0.0:
        fill_v2(blocks, h, FROM_TURN, work)
    else:
        fill_v2_onwards(blocks, part.v2, work)
    return work[blocks * W + blocks * WIDE - 1], max(part.largest_v2, extent_of_row(blocks, work, W)[1])


@Inner
def graded(near, far):  # type: ignore[no-untyped-def]
    """Return the length of the part next to a turn, at the distance ``near`` from it, that makes the part of the length
    ``far`` short enough as compared with its distance from the turn.
    """
    return max((far - GRADING * near) / (1.0 + GRADING), near)


@Inner
def divided(passed, room, rest):  # type: ignore[no-untyped-def]
    """Return a distance at which a part may end, so that it is not much longer than its distances from turns, or than
    that from the one farther away if its variable is a logarithm of the other (`variable_between`).
    """
    ahead = rest - room
    if min(passed, ahead) > 0.0 and MAX_GRADING * max(passed, ahead) >= room:
        return room
    if passed > 0.0 and (ahead <= 0.0 or passed <= ahead):
        far = min(room, rest)
        return graded(passed, far) if MAX_GRADING * passed < far else room
    return room - graded(ahead, room) if 0.0 < MAX_GRADING * ahead < room else room


@Inner
def stop_ahead(start, route, part, rest):  # type: ignore[no-untyped-def]
    """Return where a part must end if there is no turn before: the place as two doubles, its distance, which may be
    infinite, and what is there.
    """
    v, what = start.direction, AT_KINK
    room, (place, to_kink) = offset(route.limit, part.place, v), next_kink(start.kinks, part.place, v)
    if not to_kink < room:
        place, to_kink, what = route.limit, room, AT_LIMIT
    if route.reading.what == PASSAGE:
        d = offset(route.target, part.place, v)
        if 0.0 < d < to_kink:
            place, to_kink, what = route.target, d, AT_TARGET
    room = divided(part.passed, to_kink, rest)
    if room < to_kink:
        return place_after(part.place, v * room), room, BETWEEN
    return (place, 0.0), room, what


@Inner
def verdict_on_curve(forces, march, blocks, variable, ends, kinks, work):  # type: ignore[no-untyped-def]
    """Return whether the curvature is resolved on a part as far as its sign requires, and has one sign there; the ratio
    of its middle coefficients if it is not resolved; and whether kinks have been found on the part. ``ends`` says
    which of its ends are kinks.
    """
    fine, is_kept, ratio = curvature_sign(variable.extent > 0.0, blocks, ends, work)
    known = kinks[0]
    if not is_kept:
        note_kinks(forces, march, blocks, variable, kinks, work)
    return RESOLVED if fine and is_kept else CHANGES_SIGN if fine else UNRESOLVED, ratio, kinks[0] > known


@Inner
def try_next(march, kinks, variable, blocks, branch, ratio, work):  # type: ignore[no-untyped-def]
    """Return the number of blocks to try next on a part that is not resolved, or 0; and the branch point that is known.

    What is not resolved is noted.
    """
    h = variable.width
    if blocks == 1 and branch.height == 0.0 and variable.extent == 0.0:
        branch = branch_beside(march, h, work)
        if variable_for(branch, march.origin, march.direction, h).extent > 0.0:
            return 1, branch
    more = blocks_for(ratio, blocks, variable.extent > 0.0, IN_SHARE)
    for k in range(blocks, more):
        kinks[k] = min(h, kinks[k]) if kinks[k] > 0.0 else h
    if more == 0:
        kinks[0] = -1.0
    return more, branch


@Inner
def run_past_kinks(forces, start, branch, route, expected, record):  # type: ignore[no-untyped-def]
    """Follow the body from a turn past known kinks to the next turn, or to the place whose passage is to be found.

    Parameters
    ----------
    forces : Forces
        They are linear in V**2.
    start, route, record
        As in `runs.run.run`, on a curve without breaks.
    branch : BranchPoint
        The branch point of ds that is known.
    expected : float
        About the width of the leg; 0 if it is unknown.

    Returns
    -------
    end : End
        Its code is END_NONE if the leg must be followed panel by panel.
    branch : BranchPoint
        The branch point of ds that the leg passes by.
    """
    reading, v, nu, what, kinks = route.reading, start.direction, start.contact_sign, END_NONE, start.kinks
    if nu == 0:
        nu = sign_of_load(forces, start.place, 0.0, point_buffer())
    part = PartStart((start.place, start.place_low), 0.0, False, 0.0, 0.0, 0.0, 0.0, reading.best)
    work, blocks, rest = whole_buffer(), 0, expected if expected > 0.0 else inf
    choose_variable(SMOOTH_AT_REST, 0.0, work)
    for _ in range(MAX_TRIES if nu != 0 and nu != -route.only_sign else 0):
        march, panel = March(part.place, v, 0.0, 1.0), Panel(0.0, part.v2, nu, (-inf, inf))
        place, room, stop = stop_ahead(start, route, part, rest)
        rest = rest if room < inf or rest < inf else part.passed
        blocks = blocks if blocks > 0 else blocks_to_try(kinks, min(room, rest))
        variable, is_last = lay_part(forces, march, panel, blocks, (part.passed, room, rest), branch, work)
        h = variable.width
        if h == 0.0 or (stop == AT_LIMIT and not is_last):
            break
        end, largest = solve_part(part, blocks, h, is_last, work)
        if not (is_last or end >= LEAST_RATIO * largest):
            if part.v2 == 0.0 or rest <= room:
                break
            rest = TO_SEEK * room
            continue
        ends = (part.is_kink, stop == AT_KINK and not is_last)
        verdict, ratio, has_more = RESOLVED, 0.0, False
        if forces.kinked:
            verdict, ratio, has_more = verdict_on_curve(forces, march, blocks, variable, ends, kinks, work)
        if has_more:
            continue
        if verdict == RESOLVED:
            verdict, ratio = verdict_on_part(forces, blocks, nu, variable, reading, work)
        if verdict == UNRESOLVED:
            blocks, branch = try_next(march, kinks, variable, blocks, branch, ratio, work)
            if blocks > 0:
                continue
        if verdict != RESOLVED:
            break
        place = place_after(part.place, v * h) if is_last else place
        time, rounding = two_sum(part.time, time_of_part(blocks, part.v2, h, is_last, work))
        peak = part.peak
        if reading.what == PEAKS:
            stretch = Stretch(part.place, place, float(v), variable)
            peak = peak_of_part(forces, stretch, blocks, reading, peak, work)
        part = PartStart(place, end, stop == AT_KINK, part.passed + h, largest, time, part.time_low + rounding, peak)
        rest, blocks = rest - h if rest > h else TO_SEEK * h, 0
        if is_last or stop == AT_TARGET:
            what = END_TURN if is_last else END_PAUSE
            break
    if part.peak > reading.best and not route.until > part.time * (1.0 + ROUNDINGS_OF_TIMES):
        what = END_NONE  # only panels tell where the body is at that time
    record[HEAD + RIGHT], record[HEAD + TIME], record[HEAD + Y_ROW] = part.passed, part.time + part.time_low, part.peak
    record[HEAD + TIME_ERROR] = KNOWN_PEAK if reading.what == PEAKS else NO_VALUES
    v2 = 0.0 if what == END_TURN else part.v2
    return End(what, part.place, v2, nu, 0.5 * part.passed, 0.0, part.place, 0.0, 0, 1, 0), branch
