"""A leg from turn to turn as one polynomial, if that has enough terms.

V**2 is smooth along a leg; only its square root is not. With the width h of the leg and the share y of it that lies
behind the body, ``W = h y (1 - y) C`` with a smooth C > 0. With ``y = sin(phi/2)**2`` the time is the integral of ``f =
ds sqrt(h/C)`` over phi, which Gauss-Chebyshev quadrature gives from the nodes. C is computed from running means of
exp(q) P (`panels.equation`) from the nearer turn, so that nothing is subtracted. The width is that for which the mean
over the whole leg vanishes; Newton's method finds it. Where branch points of ds are near, y is another variable, and
ds, P and Q are those with respect to it (`leg_variable`).

If the law contains roots of V**2, y is as the square or the fourth power of the variable at turns (`whole_tables`).

The polynomial has 23 nodes, or 47 or 71 where those resolve a leg that fewer do not (`whole_tables`). It has at most 47
where the time at a place is read, because with more nodes that takes longer than panels that are laid one by one. For a
solved motion the record gets rows from which panels are made when they are needed (`whole_panels`).
"""

from math import fabs, sqrt

import numpy as np

from gqm_sym.runtime.arithmetic.doubledouble import ULP
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.legs.kinks.curvature import curvature_sign
from gqm_sym.runtime.legs.kinks.places import note_kinks
from gqm_sym.runtime.legs.leg_record import (
    EXTENT,
    FALLING,
    HEAD,
    MAX_ROWS,
    PANELS,
    PASSAGE,
    PEAKS,
    RISING,
    ROWS_COUNT_AS,
    TIME_FROM_END,
    TIME_FROM_START,
    WHOLE,
    WHOLE_WIDTH,
)
from gqm_sym.runtime.legs.panels.breaks import CLEARANCE_SHARE, located, offset, span_before, within
from gqm_sym.runtime.legs.panels.equation import (
    DS,
    FORCE,
    KAPPA,
    MEAN,
    N0,
    NODES,
    TAILS,
    TIME_RATE,
    W_FACTOR,
    March,
    Panel,
    W,
    copy,
    load_per_mass_row,
)
from gqm_sym.runtime.legs.panels.point import LawAtRest, point_buffer, sign_of_load
from gqm_sym.runtime.legs.panels.polynomials import WIDE
from gqm_sym.runtime.legs.panels.resolution import CANCELLATION_NOISE, NOISE_LEVEL
from gqm_sym.runtime.legs.panels.solving import is_settled
from gqm_sym.runtime.legs.runs.branch_points import (
    NOT_TRIED,
    Attempt,
    carry_v2,
    first_attempt,
    next_attempt,
    note_branch_of_turning,
)
from gqm_sym.runtime.legs.runs.ends import END_NONE, END_TURN, End
from gqm_sym.runtime.legs.runs.leg_variable import distance_at, lengthened, unstretched
from gqm_sym.runtime.legs.runs.whole_rows import (
    BETWEEN_TURNS,
    GRADE,
    HAS_KINKS,
    NO_KINKS,
    are_rows_resolved,
    begin_leg,
    blocks_for,
    choose_variable,
    fill_load,
    fill_times,
    fill_v2,
    fits_on_leg,
    form_of,
    is_contact_force_resolved,
    keeps_sign,
    load_sign,
    move_v2,
    sample_leg,
    size_of_row,
    whole_buffer,
)
from gqm_sym.runtime.legs.runs.whole_tables import (
    MAX_BLOCKS,
    MAX_GRADE,
    to_coefficients,
    to_end_terms,
    to_half_times,
    to_means,
)

# The first width to try if none is known, in units of the first panel's width.
FIRST_WIDTH = 2.0

# The largest number of widths that are tried for a leg.
MAX_TRIES = 12

# The largest step of Newton's method as a share of the width; a turn farther away is searched for among the nodes.
MAX_STEP = 0.125

# After a step this short the next one would be rounding only.
LAST_STEP = 1e-3

# If the step itself changes by this little, the next one would be about its square.
LAST_CHANGE = 1e-9

# The largest step of Newton's method after which a width is close enough to begin with more nodes, for linear and for
# other forces. For the latter V**2 must be close too, and steps with few nodes take less time.
ROUGH_STEP, NEXT_STEP = 0.03, 1e-5

# The change of V**2 found with fewer nodes, or by a step with as many, as a share of its largest value, that is the
# last one: its square is rounding only.
CHECKED = 1e-9

# What is sought of the variable of a leg: its width, roughly or to the last digit, or whether the one found with fewer
# nodes is right. With linear forces, the latter means the first width at which V**2 vanishes to rounding.
ROUGH, FIND, CHECK = range(3)

# The smallest and the largest factor by which the width grows if no turn is found on it.
MIN_GROWTH, MAX_GROWTH = 1.05, 4.0

# The rounding error of a mean in units in the last place of its largest term.
MEAN_ROUNDINGS = 4.0


@Inner
def step_to_turn(work, at):  # type: ignore[no-untyped-def]
    """Return the step to the zero of V**2 by its Taylor series at the end, as a share of the width."""
    a, b, c, d, e, f = work[at], work[at + 1], work[at + 2], work[at + 3], work[at + 4], work[at + 5]
    s = -a / b
    for _ in range(3):
        value = a + s * (b + s * (c + s * (d + s * (e + s * f))))
        slope = b + s * (2.0 * c + s * (3.0 * d + s * (4.0 * e + s * (5.0 * f))))
        change = value / slope
        s -= change
        if fabs(change) <= LAST_CHANGE:
            break
    return s


@Inner
def factor_to_turn(blocks, start, work):  # type: ignore[no-untyped-def]
    """Return an estimate of the factor by which the width must change if the turn is not near; NaN if there is none.

    ``start`` is V**2 at the start over the width.
    """
    at = blocks * MEAN
    to_means(form_of(blocks, work), work, blocks * FORCE, work, at)
    for j in range(blocks * WIDE):
        mean = work[at + j] + start / work[blocks * NODES + j]
        if not mean > 0.0:
            if j == 0:
                return np.nan
            y = work[blocks * NODES + j - 1]
            before = work[at + j - 1] + start / y
            return y + (work[blocks * NODES + j] - y) * before / (before - mean)
    first, last = work[blocks * FORCE], work[blocks * TAILS + 1]
    if start > 0.0:
        square = first * first + 2.0 * (first - last) * start
        factor = 2.0 * start / (sqrt(square) - first) if square >= 0.0 and first < 0.0 else MAX_GROWTH
        return min(max(factor, MIN_GROWTH), MAX_GROWTH)
    # If the force were linear, the turn would be twice as far away as the zero of the force.
    factor = 2.0 * first / (first - last) if last < first else MAX_GROWTH
    return min(max(factor, MIN_GROWTH), MAX_GROWTH)


@Inner
def variable_of_leg(forces, march, panel, blocks, room, variable, aim, work):  # type: ignore[no-untyped-def]
    """Return the variable of a leg (`leg_variable`) whose width is about that of ``variable`` and at most ``room``, and
    fill FORCE and EXPM1_Q; the width is 0 if no turn is found.

    The leg may begin with a speed if the forces are linear (`kinks.parts`). With the ``aim`` ROUGH the width is the
    start for one with more nodes, and the rows are those of another width. If the forces are not linear in V**2, the
    same steps are those of Newton's method for V**2, which the row W holds to begin with; it has been found with fewer
    nodes, as the width has, if the aim is CHECK.
    """
    variable, at = lengthened(variable, 1.0, room), blocks * TAILS
    last, change, settled = 0.0 if aim == CHECK else np.inf, 0.0, forces.linear
    for _ in range(MAX_TRIES):
        h = variable.width
        if not sample_leg(forces, march, panel, blocks, variable, work):
            break
        if not forces.linear:
            before = change
            change, size = fill_v2(blocks, h, BETWEEN_TURNS, work)
            settled = is_settled(change, before, size, forces.squared_contact != 0)
            settled = settled or (aim == CHECK and change <= CHECKED * size)
        to_end_terms(form_of(blocks, work), work, blocks * FORCE, work, at)
        work[at] += panel.v2 / h
        factor = 0.0
        if work[at + 1] < 0.0:
            step = step_to_turn(work, at)
            rounding = ULP * (MEAN_ROUNDINGS + fabs(march.origin[0]) / h)
            if (
                settled
                and last <= LAST_STEP
                and fabs(step * work[at + 1]) <= rounding * size_of_row(blocks, work, FORCE)
            ):
                return variable
            is_near = fabs(step) <= ROUGH_STEP if forces.linear else fabs(step) <= NEXT_STEP or last <= LAST_STEP
            last = 0.0 if aim == CHECK and forces.linear else fabs(step)
            factor = 1.0 + step if fabs(step) <= MAX_STEP else 0.0
            if aim == ROUGH and is_near and factor > 0.0:
                if not forces.linear:
                    move_v2(forces, blocks, h, step, work)
                return lengthened(variable, factor, room)
        if factor == 0.0:
            factor = factor_to_turn(blocks, panel.v2 / h, work)
        if not factor > 0.0 or (h == room and factor > 1.0):
            break
        if not forces.linear:
            move_v2(forces, blocks, h, min(factor, 2.0) - 1.0, work)
        variable = lengthened(variable, factor, room)
    return unstretched(0.0)


@Inner
def is_whole(forces, march, panel, blocks, variable, reading, kinks, work):  # type: ignore[no-untyped-def]
    """Fill the other rows; return whether all are resolved and V**2 and N each have one sign on the leg; the number of
    blocks to try next, 0 for none, or HAS_KINKS; and the largest ratio of middle coefficients to sizes of the rows of
    the law.
    """
    h, is_stretched, curve_fine, curve_ratio = variable.width, variable.extent > 0.0, True, 0.0
    if forces.kinked:
        curve_fine, is_kept, curve_ratio = curvature_sign(is_stretched, blocks, NO_KINKS, work)
        if not is_kept and note_kinks(forces, march, blocks, variable, kinks, work):
            return False, HAS_KINKS, 1.0
        if curve_fine and not is_kept:
            return False, 0, 1.0
    if forces.linear:  # otherwise V**2 was filled with the last width
        fill_v2(blocks, h, BETWEEN_TURNS, work)
    reads_force = reading.what >= PANELS or (reading.what == PEAKS and reading.force)
    if reads_force and not forces.linear and size_of_row(blocks, work, KAPPA) == 0.0:
        # The contact force may be that for V**2 before its last change.
        sample_leg(forces, march, panel, blocks, variable, work)
    fill_load(blocks, work)
    fine, ratio = are_rows_resolved(blocks, h, work)
    load_fine, is_kept, load_ratio = load_sign(is_stretched, blocks, panel.contact_sign, work)
    if load_fine and reading.what == PEAKS and reading.force:
        load_fine, load_ratio = is_contact_force_resolved(forces, reading.length, is_stretched, blocks, work)
    if not (fine and load_fine and curve_fine):
        return False, blocks_for(max(ratio, curve_ratio, load_ratio), blocks, is_stretched, work[GRADE]), ratio
    noise = CANCELLATION_NOISE * size_of_row(blocks, work, FORCE)
    if not (is_kept and keeps_sign(blocks, work, W_FACTOR, 1, noise) and fits_on_leg(forces, blocks, work)):
        return False, 0, 1.0
    fine, ratio = fill_times(blocks, h, work)
    return fine, blocks_for(ratio, blocks, is_stretched, work[GRADE]), ratio


@Inner
def first_width(start):  # type: ignore[no-untyped-def]
    """Return the first width to try."""
    return start.width if start.width > 0.0 else FIRST_WIDTH * start.step


@Inner
def solve_leg(forces, march, panel, room, start, branch, reading, work):  # type: ignore[no-untyped-def]
    """Return the attempt that resolves a leg; it has 0 blocks if there is none."""
    most = 2 if reading.what == PASSAGE and work[GRADE] <= 1.0 else MAX_BLOCKS
    attempt = first_attempt(start.blocks, branch, march, first_width(start))
    variable = attempt.variable
    aim = FIND
    begin_leg(1, work)
    if 1 < attempt.blocks <= most:
        variable = variable_of_leg(forces, march, panel, 1, room, variable, ROUGH, work)
        is_known = carry_v2(forces, 1, variable, attempt.blocks, variable, BETWEEN_TURNS, work)
        aim = CHECK if is_known else FIND
    while 0 < attempt.blocks <= most and variable.width > 0.0:
        blocks = attempt.blocks
        is_first = not forces.linear and blocks == 1 and aim == FIND
        variable = variable_of_leg(forces, march, panel, blocks, room, variable, ROUGH if is_first else aim, work)
        if not variable.width > 0.0:
            break
        if is_first:
            fine, ratio = are_rows_resolved(1, variable.width, work)
            if fine:
                aim = CHECK
                continue
            onwards = blocks_for(ratio, 1, variable.extent > 0.0, work[GRADE])
        else:
            fine, onwards, ratio = is_whole(forces, march, panel, blocks, variable, reading, start.kinks, work)
        attempt = Attempt(blocks, variable, attempt.branch, attempt.plain_blocks, attempt.plain_ratio)
        if fine:
            return attempt
        if onwards == HAS_KINKS:
            break
        attempt = next_attempt(attempt, onwards, ratio, march, work)
        if (
            not 0 < attempt.blocks < MAX_BLOCKS
            and reading.what < PANELS
            and note_branch_of_turning(forces, march, panel, blocks, variable, start.kinks, work)
        ):
            break
        is_known = carry_v2(forces, blocks, variable, attempt.blocks, attempt.variable, BETWEEN_TURNS, work)
        aim = CHECK if is_known else FIND
        variable = attempt.variable
    return Attempt(0, variable, attempt.branch, NOT_TRIED, 1.0)


@Inner
def is_read(route, origin, v, h, time):  # type: ignore[no-untyped-def]
    """Return whether times on a leg of the width ``h`` are read."""
    if route.reading.what == PASSAGE:
        return 0.0 <= offset(route.target, origin, v) <= h * (1.0 + CLEARANCE_SHARE)
    return route.reading.what == PEAKS and time > route.until


@Inner
def enter_rows(record, blocks, route, is_read, work):  # type: ignore[no-untyped-def]
    """Write what is read of a leg into the record as rows."""
    wide, reads = blocks * WIDE, route.reading.what
    record[WHOLE] = form_of(blocks, work)
    if is_read:
        to_coefficients(blocks, work, blocks * TIME_RATE, record, HEAD)
    if reads == PEAKS or reads >= PANELS:
        for at in range(0, wide, WIDE):
            load_per_mass_row(work, blocks * MEAN + at, blocks * N0 + at, blocks * KAPPA + at, blocks * W + at)
            copy(record, HEAD + 2 * wide + at, work, blocks * MEAN + at)
            copy(record, HEAD + wide + at, work, blocks * (W if reads == PEAKS else FORCE) + at)
    if reads >= PANELS:
        for at in range(0, wide, WIDE):
            copy(record, HEAD + at, work, blocks * W_FACTOR + at)
            copy(record, HEAD + 3 * wide + at, work, blocks * DS + at)


@Inner
def enter_leg(record, route, origin, v, blocks, variable, work):  # type: ignore[no-untyped-def]
    """Write a leg into the record."""
    h = variable.width
    to_half_times(form_of(blocks, work), work, blocks * TIME_RATE, work, blocks * TAILS)
    first, second = work[blocks * TAILS], work[blocks * TAILS + 1]
    enter_rows(record, blocks, route, is_read(route, origin, v, h, first + second), work)
    is_located = variable.extent > 0.0 or work[GRADE] > 1.0
    # Beside joints, the law is not evaluated at the ends of a leg.
    by_law = is_located or (route.reading.force and route.breaks.size == 0)
    is_wanted = route.reading.what >= PANELS or (route.reading.what == PEAKS and by_law)
    record[WHOLE_WIDTH] = h if is_wanted else 0.0
    record[RISING], record[FALLING], record[EXTENT] = variable.rising, variable.falling, variable.extent
    record[TIME_FROM_START], record[TIME_FROM_END] = first, second


@Inner
def run_whole(forces, start, branch, rest, route, off, record):  # type: ignore[no-untyped-def]
    """Follow the body from one turn to the next, if that takes one polynomial only.

    The parameters are those of `runs.run.run`; the branch point of ds that the leg may pass by; and what the law is at
    rest. Panels cannot be made from rows with the grade 2.

    Returns
    -------
    end : End
        Its code is END_NONE if the leg must be followed in another way. The step is then half of what may be its width.
    blocks : int
        The number of blocks (`whole_tables`) that resolve the leg; 0 if there is none.
    branch : BranchPoint
        The branch point that it passes by.
    """
    breaks, origin, v, upcoming = route.breaks, (start.place, start.place_low), start.direction, 0
    while upcoming < breaks.size and offset(breaks[upcoming], origin, v) <= 0.0:
        upcoming += 1
    room = offset(route.limit if upcoming == breaks.size else breaks[upcoming], origin, v)
    march, span, nu = March(origin, v, 0.0, 1.0), span_before(breaks, upcoming, v, off), start.contact_sign
    what, middle, h, blocks = END_NONE, origin, 0.0, 0
    if nu == 0:
        nu = sign_of_load(forces, within(start.place, span), 0.0, point_buffer())
    if nu != 0 and nu != -route.only_sign and record.size >= HEAD + MAX_ROWS * MAX_BLOCKS * WIDE:
        work = whole_buffer()
        panel, found = Panel(0.0, 0.0, nu, span), Attempt(0, unstretched(0.0), branch, NOT_TRIED, 1.0)
        for grade in range(rest.grade, (1 if route.reading.what >= PANELS else MAX_GRADE) + 1):
            choose_variable(LawAtRest(rest.slope, grade, rest.noise), first_width(start), work)
            found = solve_leg(forces, march, panel, room, start, branch, route.reading, work)
            if found.blocks > 0 or rest.noise == NOISE_LEVEL:
                break
        blocks, variable, branch, h = found.blocks, found.variable, found.branch, found.variable.width
        if blocks > 0:
            enter_leg(record, route, origin, v, blocks, variable, work)
            what, middle = END_TURN, located(origin, v, distance_at(variable, 0.5), breaks, upcoming)
    place = located(origin, v, h, breaks, upcoming)
    return End(what, place, 0.0, nu, 0.5 * h, 0.0, middle, 0.0, 0, ROWS_COUNT_AS, upcoming), blocks, branch
