"""Turning points and times of many orbits at once, an orbit in each lane of a vector register.

Orbits without proved turning points, or whose time does not converge, are left to the loop over single launches
(`scalar`).
"""

from math import inf, nan

import numpy as np
from numba import types

from gqm_sym.runtime.compiled.intrinsics import choose, fma
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.registers import borrowed
from gqm_sym.runtime.compiled.strided import DIRECTION, DOMAIN_LOW, LAM0, PARAMETERS, V0, fill_row
from gqm_sym.runtime.compiled.types import BATCH_ADDRESSES
from gqm_sym.runtime.quadrature.trapezoid import CIRCULATION, LIBRATION
from gqm_sym.runtime.sweep.batch.agm_times import half_periods_by_agm
from gqm_sym.runtime.sweep.batch.arrivals import answer_arrivals
from gqm_sym.runtime.sweep.batch.exact_ends import find_exact_ends, keeps_ends, refines_ends
from gqm_sym.runtime.sweep.batch.exact_nodes import fill_checks, leave_unchecked
from gqm_sym.runtime.sweep.batch.first_trials import start_at_first_hill
from gqm_sym.runtime.sweep.batch.known_turns import fill_axis_offsets
from gqm_sym.runtime.sweep.batch.rows import (
    BATCH,
    END_HIGH,
    END_LOW,
    FOUND,
    HALF_WIDTH,
    INDEX,
    LANES,
    LAUNCH_PLACE,
    LAUNCH_V2,
    NOWHERE,
    OFFSET_HIGH,
    OFFSET_LOW,
    ROWS,
    SEARCH_DIRECTION,
    SEARCH_LENGTH,
    SEEKING,
    STATE,
    TIME_ROWS,
    TRIAL,
    V2_REST,
    ZERO_BEHIND,
    OrbitKind,
    Orbits,
    Scratch,
    borrowed_orbits,
    borrowed_waiting,
    contains,
    gather,
    has_tape,
    partition,
    shrink,
    waiting_room,
)
from gqm_sym.runtime.sweep.batch.times import (
    AGM_LIBRATION,
    AXIS_LIBRATION,
    times_by_trapezoid,
)
from gqm_sym.runtime.sweep.batch.turning_points import (
    classify,
    prove,
    search,
    set_ends,
    start_search,
    start_search_behind,
)
from gqm_sym.runtime.sweep.batch.waiting import answer_exact_times, answer_waiting, no_room
from gqm_sym.runtime.sweep.batch.wells import (
    borrowed_wells,
    prove_about_axis,
    prove_in_well,
    set_ends_from_rest,
    wells_of,
)
from gqm_sym.runtime.sweep.quantities import (
    ANSWERED,
    ANSWERS,
    ARRIVAL_TIME,
    LOWER_END,
    NOT_PERIODIC,
    PERIOD,
    SPAN_KNOWN,
    SPANS,
    TURNING_POINTS,
    UNDECIDED,
    UPPER_END,
    Answers,
)
from gqm_sym.runtime.sweep.single.arrivals import MAX_TERMS
from gqm_sym.runtime.sweep.single.slow_places import EXACT, RecordedFormulas

# The numbers of pieces into which an orbit, or half of an even one, is cut for its proof: first few, then many, which
# are halved or doubled in width, with so many trials altogether. No pieces stand for the proofs that all orbits of a
# well share.
SHARED, FEW_PIECES, FEW_PIECES_OF_HALF, MANY_PIECES, MAX_PIECES = 0, 3, 2, 12, 32


@Inner
def answer_spans(orbits, kind, quantity, answers):  # type: ignore[no-untyped-def]
    """Fill the answers to SPANS and TURNING_POINTS, or the status that circulations have no half period."""
    rows, out, status = orbits.rows, answers.values, answers.status
    circulates = kind == CIRCULATION
    if quantity in (SPANS, ARRIVAL_TIME):
        for j in range(orbits.size):
            k, low, high = int(rows[INDEX, j]), rows[OFFSET_LOW, j], rows[OFFSET_HIGH, j]
            out[k, 0] = low + high if circulates else low
            out[k, 1], status[k] = choose(circulates, nan, high), choose(low < high, SPAN_KNOWN, UNDECIDED)
    elif circulates:
        for j in range(orbits.size):
            status[int(rows[INDEX, j])] = NOT_PERIODIC
    else:
        for j in range(orbits.size):
            k, low, high = int(rows[INDEX, j]), rows[END_LOW, j], rows[END_HIGH, j]
            out[k, 0], out[k, 1], status[k] = low, high, choose(low < high, ANSWERED, UNDECIDED)


@Inner
def fill_ends(orbits, kind, answers):  # type: ignore[no-untyped-def]
    """Fill the turning points beside times if there are columns for them; laps have NaN and infinity there, and orbits
    whose ends were not found NaN.
    """
    rows, out, laps = orbits.rows, answers.values, kind == CIRCULATION
    if out.shape[1] > UPPER_END:
        for j in range(orbits.size):
            k, low, high = int(rows[INDEX, j]), rows[END_LOW, j], rows[END_HIGH, j]
            out[k, LOWER_END] = choose(laps | (high != high), nan, low)
            out[k, UPPER_END] = choose(laps, inf, choose(low != low, nan, high))


@Inner
def answer_times(fns, kind, refined, orbits, spares, scratch, quantity, answers):  # type: ignore[no-untyped-def]
    """Fill half periods, periods or loop times.

    If their ends are ``refined``, orbits whose V**2 in doubles is too rough wait for double-double arithmetic.
    """
    if kind.kind == AGM_LIBRATION:
        half_periods_by_agm(fns, orbits, scratch, quantity, answers)
        return
    _, block, pairs = spares
    waiting = pairs[1] if kind.mirrored else pairs[0]
    rough = waiting if refined and kind.kind == LIBRATION else no_room(waiting)
    times_by_trapezoid(fns, (kind.kind, kind.mirrored, False), orbits, rough, scratch, quantity, answers)
    if waiting.number[0] >= BATCH:
        answer_waiting(fns, kind.mirrored, waiting, block, scratch, quantity, answers)


@Inner
def answer_orbits(fns, kind, orbits, spares, wells, scratch, quantity, answers):  # type: ignore[no-untyped-def]
    """Prove orbits of one kind, and fill the answers for those that are proved; ``spares`` store the others and copies
    meanwhile.
    """
    count, (spare, block, pair) = scratch.param_count, spares
    for pieces in (SHARED, FEW_PIECES_OF_HALF if kind.mirrored else FEW_PIECES, MANY_PIECES):
        if pieces == SHARED and not kind.shared:
            continue
        n, rows = orbits.size, orbits.rows
        proved, unproved = n, 0
        if not kind.proved:
            if pieces == SHARED and kind.about_axis:
                prove_about_axis(fns, wells, n, rows, scratch.work)
            elif pieces == SHARED:
                prove_in_well(fns, wells, n, rows, scratch.work)
            else:
                p = orbits.params[: count * n].reshape(count, n)
                cuts = pieces, MAX_PIECES if pieces == MANY_PIECES else pieces
                prove(fns, kind.kind, kind.mirrored, cuts, n, rows, p, scratch.work)
            proved, unproved = partition(rows[STATE, :n], scratch.chosen, scratch.others)
        waiting = gather(orbits, count, scratch.others, unproved, spare, ROWS)
        refined = has_tape(scratch) and refines_ends(kind, quantity, orbits, scratch.careful)
        orbits = shrink(orbits, count, scratch.chosen, proved, ROWS if refined else TIME_ROWS)
        if refined and orbits.size:
            kept = keeps_ends(kind, quantity)
            find_exact_ends(scratch.exact, count, kept, orbits, scratch.ends, scratch.others)
        if quantity == ARRIVAL_TIME and kind.kind != CIRCULATION:
            if orbits.size:
                answer_arrivals(fns, orbits, scratch, answers)
        elif quantity in (SPANS, TURNING_POINTS, ARRIVAL_TIME) or (quantity != PERIOD and kind.kind == CIRCULATION):
            answer_spans(orbits, kind.kind, quantity, answers)
        elif orbits.size:
            fill_ends(orbits, kind.kind, answers)
            if kind.kind == LIBRATION and scratch.careful:
                exactly = orbits.size, block, pair[0]
                answer_exact_times(fns, kind.mirrored, orbits, exactly, scratch, quantity, answers)
            else:
                if refined:
                    fill_checks(scratch.exact, count, orbits, scratch.ends, scratch.others)
                else:
                    leave_unchecked(orbits)
                answer_times(fns, kind, refined, orbits, (spare, block, pair), scratch, quantity, answers)
        if unproved == 0:
            return
        orbits, spare = Orbits(waiting, spare.rows, spare.params), orbits


@Inner
def load_launches(fns, columns, begin, number, orbits, domain, monotone, scratch):  # type: ignore[no-untyped-def]
    """Copy ``number`` launches into a batch; SEARCH_DIRECTION is 0 for those that are not finite."""
    n, rows, count = orbits.size, orbits.rows, scratch.param_count
    p = orbits.params[: count * n].reshape(count, n)
    for row in range(PARAMETERS - DOMAIN_LOW):
        if begin == 0 or columns[DOMAIN_LOW + row, 1] != 0:
            fill_row(columns, DOMAIN_LOW + row, begin, number, domain[row, :n])
    index, place, v2 = rows[INDEX, :n], rows[LAUNCH_PLACE, :n], rows[LAUNCH_V2, :n]
    direction, rests, total = rows[SEARCH_DIRECTION, :n], rows[V2_REST, :n], scratch.work[0, :n]
    rows[HALF_WIDTH, :n] = nan
    fill_row(columns, LAM0, begin, number, place)
    fill_row(columns, V0, begin, number, v2)
    fill_row(columns, DIRECTION, begin, number, direction)
    for j in range(n):
        rests[j] = fma(v2[j], v2[j], -(v2[j] * v2[j]))
    fill_axis_offsets(n, rows, domain, monotone, fns.time_integrand != 0 or fns.agm_arguments != 0)
    for j in range(n):
        index[j], total[j] = begin + min(j, number - 1), place[j] + v2[j]
        v2[j] *= v2[j]
    for row in range(count):
        values = p[row]
        fill_row(columns, PARAMETERS + row, begin, number, values)
        for j in range(n):
            total[j] += values[j]
    for j in range(n):
        direction[j] = choose(total[j] - total[j] == 0.0, direction[j], 0.0)


@Inner
def find_orbits(fns, orbits, laps, domain, monotone, wells, scratch):  # type: ignore[no-untyped-def]
    """Search both turning points of each launch; return the librations and the number of circulations.

    Circulations are copied to ``laps``. All other launches are dropped.
    """
    count, lap_count, careful = scratch.param_count, 0, scratch.careful
    for ahead in (True, False):
        n, rows = orbits.size, orbits.rows
        p = orbits.params[: count * n].reshape(count, n)
        if ahead:
            start_search(fns, n, rows, p, domain, monotone, wells, scratch.work)
        else:
            start_search_behind(fns, n, rows, p, monotone, scratch.work)
        if careful and contains(rows[STATE, :n], SEEKING):
            start_at_first_hill(fns, n, rows, p, scratch.work)
        search(fns, n, rows, p, careful, scratch.work)
        classify(n, rows)
        if ahead and contains(rows[TRIAL, :n], FOUND):
            lap_count, _ = partition(rows[TRIAL, :n], scratch.others, scratch.chosen)
            lap_count = gather(orbits, count, scratch.others, lap_count, laps, ROWS)
        found, _ = partition(rows[STATE, :n], scratch.chosen, scratch.others)
        orbits = shrink(orbits, count, scratch.chosen, found, ROWS)
        if orbits.size == 0:
            break
    set_ends(orbits.size, orbits.rows)
    for j in range(lap_count):
        lap = laps.rows[SEARCH_DIRECTION, j] * laps.rows[SEARCH_LENGTH, j]
        laps.rows[OFFSET_LOW, j], laps.rows[OFFSET_HIGH, j] = min(lap, 0.0), max(lap, 0.0)
    return orbits, lap_count


@Inner
def fastest_method(fns):  # type: ignore[no-untyped-def]
    """Return the kind of orbits about an axis for which the model has the fastest method."""
    return AGM_LIBRATION if fns.agm_arguments else AXIS_LIBRATION if fns.time_integrand else LIBRATION


@Inner
def kind_of_librations(fns, orbits, monotone, wells):  # type: ignore[no-untyped-def]
    """Return the common data of librations: whether all are even, and the fastest method for their time."""
    n, rows = orbits.size, orbits.rows
    mirrored, one_axis = not contains(rows[STATE, :n], NOWHERE), not contains(rows[TRIAL, :n], NOWHERE)
    about_axis = mirrored and one_axis
    # If no search gave the turning points, V**2 is monotone on either side of the axis.
    known = True
    for j in range(n):
        known &= rows[ZERO_BEHIND, j] == rows[ZERO_BEHIND, j]
    kind = fastest_method(fns) if about_axis else LIBRATION
    side = wells.about_axis if about_axis else wells.above
    return OrbitKind(kind, mirrored, (monotone or known) and about_axis, about_axis, side.proofs.size > 0)


@Inner
def answer_librations(fns, orbits, buffers, monotone, wells, scratch, quantity, answers):  # type: ignore[no-untyped-def]
    """Answer orbits about an axis of symmetry, other even orbits, and the rest, each by its own method, so that no
    answer depends on the other orbits of a batch.
    """
    rest, spares = buffers
    for even, about_axis in ((FOUND, FOUND), (FOUND, NOWHERE), (NOWHERE, NOWHERE)):
        n, rows, count = orbits.size, orbits.rows, scratch.param_count
        if n == 0:
            return
        wanted = scratch.work[0, :n]
        for j in range(n):
            axis = choose(rows[STATE, j] == FOUND, rows[TRIAL, j], NOWHERE)
            wanted[j] = choose((rows[STATE, j] == even) & (axis == about_axis), FOUND, NOWHERE)
        if not contains(wanted, FOUND):
            continue
        number, others = partition(wanted, scratch.chosen, scratch.others)
        waiting = gather(orbits, count, scratch.others, others, rest, ROWS)
        orbits = shrink(orbits, count, scratch.chosen, number, ROWS)
        kind = kind_of_librations(fns, orbits, monotone, wells)
        answer_orbits(fns, kind, orbits, spares, wells, scratch, quantity, answers)
        orbits, rest = Orbits(waiting, rest.rows, rest.params), orbits


@Inner
def answer_all(fns, columns, monotone, quantity, answers, buffers):  # type: ignore[no-untyped-def]
    """Answer batch after batch; the first four arguments and the last but one are those of `answer_batches`.

    The buffers belong to the caller. Otherwise numba would count references to arrays at each call, by instructions
    that wait for memory.
    """
    (first, spare, laps, rest), pair, scratch, domain, wells = buffers
    columns, domain = borrowed(columns), borrowed(domain)
    answers = Answers(borrowed(answers.values), borrowed(answers.status), borrowed(answers.route))
    first, spare, laps = borrowed_orbits(first), borrowed_orbits(spare), borrowed_orbits(laps)
    rest = borrowed_orbits(rest)
    chosen, others, work = borrowed(scratch.chosen), borrowed(scratch.others), borrowed(scratch.work)
    (address, operations, parts, registers), registers_of_places, p = scratch.exact
    tape = address, borrowed(operations), parts, registers
    exact = RecordedFormulas(tape, borrowed(registers_of_places), borrowed(p))
    made = scratch.param_count, scratch.layout, chosen, others, work, borrowed(scratch.ends)
    scratch = Scratch(*made, scratch.careful, exact, columns, borrowed(scratch.rates))
    wells, pair = borrowed_wells(wells), (borrowed_waiting(pair[0]), borrowed_waiting(pair[1]))
    spares = spare, laps, pair
    for begin in range(0, answers.status.size, BATCH):
        number = min(BATCH, answers.status.size - begin)
        orbits = Orbits(-(-number // LANES) * LANES, first.rows, first.params)
        load_launches(fns, columns, begin, number, orbits, domain, monotone, scratch)
        if set_ends_from_rest(fns, orbits.size, orbits.rows, domain, monotone, wells, scratch.work):
            kind = OrbitKind(fastest_method(fns), True, True, True, True)
            answer_orbits(fns, kind, orbits, spares, wells, scratch, quantity, answers)
            continue
        orbits, lap_count = find_orbits(fns, orbits, laps, domain, monotone, wells, scratch)
        if lap_count:
            laps_found = Orbits(lap_count, laps.rows, laps.params)
            kind = OrbitKind(CIRCULATION, False, False, False, False)
            answer_orbits(fns, kind, laps_found, spares, wells, scratch, quantity, answers)
        answer_librations(fns, orbits, (rest, spares), monotone, wells, scratch, quantity, answers)
    for mirrored in (False, True):
        waiting = pair[1] if mirrored else pair[0]
        answer_waiting(fns, mirrored, waiting, laps, scratch, quantity, answers)


@entry(
    types.void(
        *(BATCH_ADDRESSES, types.UniTuple(types.int64, 3), types.int64[:, ::1], types.boolean),
        *(types.int64, types.boolean, EXACT, ANSWERS),
    ),
    nogil=True,
)
def answer_batches(fns, layout, columns, monotone, quantity, careful, exact, answers):  # type: ignore[no-untyped-def]
    """Answer the launches that batches can answer; the others keep their status.

    Parameters
    ----------
    fns : BatchAddresses
        The module's compiled functions for batches.
    layout : (int, int, int)
        As in `rows.Scratch`.
    columns : array
        The launches, as `strided.pointers` gives them.
    monotone : bool
        Whether V**2 is monotone between neighbouring axes of symmetry and ds vanishes nowhere.
    quantity : int
        HALF_PERIOD, PERIOD, TURNING_POINTS, ARRIVAL_TIME or SPANS.
    careful : bool
        Whether batches have left these launches before. The search for turning points then makes smaller steps, and
        times are corrected by double-double arithmetic.
    exact : RecordedFormulas
        The module's formulas as a tape, by which turning points are found in double-double arithmetic; empty if there
        is none.
    answers : Answers
        Filled in: the quantity, or instead of ARRIVAL_TIME that to SPANS; and beside times, if there are columns for
        them, both turning points.
    """
    count = columns.shape[0] - PARAMETERS
    size = (count + max(layout[0], layout[1])) * BATCH
    domain = np.empty((PARAMETERS - DOMAIN_LOW, BATCH))
    chosen, others = np.empty(BATCH, dtype=np.int64), np.empty(BATCH, dtype=np.int64)
    work, ends = np.empty((13, BATCH)), np.empty((6, BATCH))
    rates = np.empty((MAX_TERMS + 1 if quantity == ARRIVAL_TIME else 0, BATCH))
    scratch = Scratch(count, layout, chosen, others, work, ends, careful, exact, columns, rates)
    first = Orbits(0, np.empty((ROWS, BATCH)), np.empty(size))
    spare = Orbits(0, np.empty((ROWS, BATCH)), np.empty(size))
    laps = Orbits(0, np.empty((ROWS, BATCH)), np.empty(size))
    rest = Orbits(0, np.empty((ROWS, BATCH)), np.empty(size))
    pair = waiting_room(count), waiting_room(count)
    buffers = (first, spare, laps, rest), pair, scratch, domain, wells_of(columns)
    answer_all(fns, columns, monotone, quantity, answers, buffers)
