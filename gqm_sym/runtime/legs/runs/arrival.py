"""The time from a turn to a place before the next turn, as one polynomial.

With the distance h of the place and the share y of it that lies behind the body, ``W = h y C`` with a smooth C > 0, and
the time is the integral of ``f = ds sqrt(h/C)`` over ``y**-0.5 dy``. Nothing is subtracted on the way, so this holds as
long as V**2 at the place is not small. The width is given, which takes fewer values of the forces than a whole leg
(`whole_leg`), whose other turn has to be found first.
"""

from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.legs.kinks.curvature import curvature_sign
from gqm_sym.runtime.legs.kinks.places import note_kinks
from gqm_sym.runtime.legs.leg_record import ROWS_COUNT_AS, TIME_FROM_END, TIME_FROM_START
from gqm_sym.runtime.legs.panels.breaks import offset, span_before
from gqm_sym.runtime.legs.panels.equation import (
    FORCE,
    TAILS,
    TIME_RATE,
    W_FACTOR,
    March,
    Panel,
    W,
)
from gqm_sym.runtime.legs.panels.point import point_buffer, sign_of_load
from gqm_sym.runtime.legs.panels.polynomials import WIDE
from gqm_sym.runtime.legs.panels.resolution import CANCELLATION_NOISE
from gqm_sym.runtime.legs.panels.solving import is_settled
from gqm_sym.runtime.legs.panels.widest import HIGH_V2_RATIO
from gqm_sym.runtime.legs.runs.branch_points import NOT_TRIED, Attempt, carry_v2, first_attempt, next_attempt
from gqm_sym.runtime.legs.runs.ends import END_NONE, END_PAUSE, End
from gqm_sym.runtime.legs.runs.whole_rows import (
    FROM_TURN,
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
    keeps_sign,
    load_sign,
    sample_leg,
    size_of_row,
    whole_buffer,
)
from gqm_sym.runtime.legs.runs.whole_tables import to_arrival_time

# The largest number of times that V**2 is computed from forces that depend on it, and the change of V**2 as a share of
# its largest value that is rounding only.
MAX_TRIES, SETTLED = 12, 1e-15


@Inner
def reaches(forces, march, panel, blocks, variable, work):  # type: ignore[no-untyped-def]
    """Fill the rows up to W for the place at the end of a variable, with the nodes and V**2 to begin with in the
    rows NODES and W; return whether the body is fast there.
    """
    change = 0.0
    for _ in range(MAX_TRIES):
        if not sample_leg(forces, march, panel, blocks, variable, work):
            return False
        before = change
        change, size = fill_v2(blocks, variable.width, FROM_TURN, work)
        if not work[blocks * W + blocks * WIDE - 1] >= HIGH_V2_RATIO * size:
            return False
        settled = change <= SETTLED * size or is_settled(change, before, size, forces.squared_contact != 0)
        if forces.linear or settled:
            return True
    return False


@Inner
def is_resolved(forces, march, panel, blocks, variable, kinks, work):  # type: ignore[no-untyped-def]
    """Fill the rows LOAD and TIME_RATE; return whether all rows are resolved and V**2 and N each have one sign up to
    the place; the number of blocks to try next, 0 for none, or HAS_KINKS; and the largest ratio of middle coefficients
    to sizes.
    """
    h, is_stretched = variable.width, variable.extent > 0.0
    curve_fine, bends_one_way, curve_ratio = True, True, 0.0
    if forces.kinked:
        curve_fine, bends_one_way, curve_ratio = curvature_sign(is_stretched, blocks, NO_KINKS, work)
        if not bends_one_way and note_kinks(forces, march, blocks, variable, kinks, work):
            return False, HAS_KINKS, 1.0
    fill_load(blocks, work)
    fine, ratio = are_rows_resolved(blocks, h, work)
    load_fine, is_kept, load_ratio = load_sign(is_stretched, blocks, panel.contact_sign, work)
    if not (fine and load_fine):
        return False, blocks_for(max(ratio, load_ratio), blocks, is_stretched, work[GRADE]), ratio
    noise = CANCELLATION_NOISE * size_of_row(blocks, work, FORCE)
    if not (is_kept and keeps_sign(blocks, work, W_FACTOR, 1, noise) and fits_on_leg(forces, blocks, work)):
        return False, 0, 1.0
    if not (curve_fine and bends_one_way):
        return False, blocks_for(curve_ratio, blocks, is_stretched, work[GRADE]), curve_ratio
    fine, ratio = fill_times(blocks, h, work)
    return fine, blocks_for(ratio, blocks, is_stretched, work[GRADE]), ratio


@Inner
def run_to_target(forces, start, branch, rest, route, off, record):  # type: ignore[no-untyped-def]
    """Follow the body from a turn to the place whose passage is to be found, if it passes it fast on one polynomial.

    Parameters and Returns are those of `whole_leg.run_whole`; the end, if there is one, has the code END_PAUSE.
    """
    breaks, origin, v, upcoming = route.breaks, (start.place, start.place_low), start.direction, 0
    while upcoming < breaks.size and offset(breaks[upcoming], origin, v) <= 0.0:
        upcoming += 1
    room = offset(route.limit if upcoming == breaks.size else breaks[upcoming], origin, v)
    h, nu, what, blocks = offset(route.target, origin, v), start.contact_sign, END_NONE, 0
    march, span, place, v2 = March(origin, v, 0.0, 1.0), span_before(breaks, upcoming, v, off), (route.target, 0.0), 0.0
    if 0.0 < h < room:
        if nu == 0:
            nu = sign_of_load(forces, start.place, 0.0, point_buffer())
        work, panel, blocks = whole_buffer(), Panel(0.0, 0.0, nu, span), 1 if nu != 0 and nu != -route.only_sign else 0
        attempt = first_attempt(blocks, branch, march, h)
        choose_variable(rest, h, work)
        begin_leg(1, work)
        while attempt.blocks > 0:
            blocks, variable = attempt.blocks, attempt.variable
            if not reaches(forces, march, panel, blocks, variable, work):
                blocks = 0
                break
            fine, onwards, ratio = is_resolved(forces, march, panel, blocks, variable, start.kinks, work)
            if fine:
                what, v2 = END_PAUSE, work[blocks * W + blocks * WIDE - 1]
                to_arrival_time(form_of(blocks, work), work, blocks * TIME_RATE, work, blocks * TAILS)
                record[TIME_FROM_START], record[TIME_FROM_END] = work[blocks * TAILS], 0.0
                break
            if onwards == HAS_KINKS:
                blocks = 0
                break
            if onwards == 0 or attempt.plain_blocks != NOT_TRIED:
                attempt = next_attempt(attempt, onwards, ratio, march, work)
            else:  # for a single leg, a map would take as long as more nodes
                attempt = Attempt(onwards, variable, attempt.branch, NOT_TRIED, 1.0)
            carry_v2(forces, blocks, variable, attempt.blocks, attempt.variable, FROM_TURN, work)
            blocks = attempt.blocks
        branch = attempt.branch
    return End(what, place, v2, nu, h, 0.0, place, 0.0, 0, ROWS_COUNT_AS, upcoming), blocks, branch
