"""Turning points and times of many orbits at once, an orbit in each lane of a vector register.

Orbits for which `batch_search` proves no turning points, or whose time does not converge, are left to `swift`, which
takes them one by one. Columns of a batch are whole registers: the last orbit is repeated to fill one.
"""

from math import nan

import numpy as np
from numba import types

from gqm_sym.runtime.compiled.intrinsics import choose
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.strided import DIRECTION, DOMAIN_LOW, LAM0, PARAMETERS, V0, fill_row
from gqm_sym.runtime.compiled.types import BATCH_ADDRESSES
from gqm_sym.runtime.quadrature.trapezoid import CIRCULATION, LIBRATION
from gqm_sym.runtime.sweep.batch.rows import (
    BATCH,
    FOUND,
    LANES,
    LASTING,
    LEAST,
    MOST,
    NOWHERE,
    REACH,
    ROWS,
    SPEED,
    START,
    STATE,
    TRIAL,
    WAY,
    WHO,
    A,
    B,
    any_is,
    gather,
    part,
    shrink,
)
from gqm_sym.runtime.sweep.batch.times import MEANS, SWING, half_periods_by_agm, times
from gqm_sym.runtime.sweep.batch.turning_points import judge, launch, prove, seek, set_ends, turn_round
from gqm_sym.runtime.sweep.quantities import ANSWERED, NOT_PERIODIC, PERIOD, SPAN_KNOWN, SPANS, TURNING_POINTS

# Pieces of an orbit, or of half a mirrored one, for its proof: a few first, more where those do not suffice.
FEW_PIECES, FEW_OF_HALF, MANY_PIECES = 3, 2, 12


@Inner
def settle(fns, kind, mirrored, known, n, s, flat, t, spare, count, held, chosen, others, work, asked, out, reasons):  # type: ignore[no-untyped-def]
    """Prove orbits of one kind that are not ``known``, and answer for those that are proved.

    ``t`` and ``spare`` take the others meanwhile.
    """
    for pieces in (FEW_OF_HALF if mirrored else FEW_PIECES, MANY_PIECES):
        proved, left = n, 0
        if not known:
            prove(fns, kind, mirrored, pieces, n, s, flat[: count * n].reshape(count, n), work)
            proved, left = part(s[STATE, :n], chosen, others)
        rest = gather(s, flat, count, n, others, left, t, spare, ROWS)
        m = shrink(s, flat, count, n, chosen, proved, LASTING)
        if asked == SPANS:
            for j in range(m):
                k, least, most = int(s[WHO, j]), s[LEAST, j], s[MOST, j]
                going_round = kind == CIRCULATION
                out[k, 0] = least + most if going_round else least
                out[k, 1], reasons[k] = choose(going_round, nan, most), SPAN_KNOWN
        elif asked != PERIOD and kind == CIRCULATION:
            for j in range(m):
                reasons[int(s[WHO, j])] = NOT_PERIODIC
        elif asked == TURNING_POINTS:
            for j in range(m):
                k = int(s[WHO, j])
                out[k, 0], out[k, 1], reasons[k] = s[A, j], s[B, j], ANSWERED
        elif m and kind == MEANS:
            half_periods_by_agm(fns, m, s, flat, count, work, asked, out, reasons)
        elif m:
            times(fns, kind, mirrored, m, s, flat, count, held, chosen, work, asked, out, reasons)
        if left == 0:
            return
        n, s, flat, t, spare = rest, t, spare, s, flat


@entry(
    types.void(
        *(
            BATCH_ADDRESSES,
            types.UniTuple(types.int64, 2),
            types.int64[:, ::1],
            types.boolean,
            types.int64,
        ),
        *(types.float64[:, ::1], types.int8[::1]),
    ),
    nogil=True,
)
def answer_batches(fns, held, columns, monotone, asked, out, reasons):  # type: ignore[no-untyped-def]
    """Fill rows of ``out`` and of ``reasons`` for the launches that this can answer, as `swift.answer_many` does.

    The others keep their reason. ``monotone`` says that V**2 rises or falls all the way between axes of symmetry and
    that ds is nowhere 0; ``asked`` is HALF, WHOLE, PLACES or SPANS.
    """
    count = columns.shape[0] - PARAMETERS
    rows = count + max(held[0], held[1])
    s, t, u = np.empty((ROWS, BATCH)), np.empty((ROWS, BATCH)), np.empty((ROWS, BATCH))
    flat, spare, other = np.empty(rows * BATCH), np.empty(rows * BATCH), np.empty(rows * BATCH)
    known, work = np.empty((PARAMETERS - DOMAIN_LOW, BATCH)), np.empty((13, BATCH))
    chosen, others = np.empty(BATCH, dtype=np.int64), np.empty(BATCH, dtype=np.int64)
    for begin in range(0, reasons.size, BATCH):
        m = min(BATCH, reasons.size - begin)
        n = -(-m // LANES) * LANES
        p = flat[: count * n].reshape(count, n)
        for row in range(PARAMETERS - DOMAIN_LOW):
            if begin == 0 or columns[DOMAIN_LOW + row, 1] != 0:
                fill_row(columns, DOMAIN_LOW + row, begin, m, known[row, :n])
        who, start, speed, way, total = s[WHO, :n], s[START, :n], s[SPEED, :n], s[WAY, :n], work[0, :n]
        fill_row(columns, LAM0, begin, m, start)
        fill_row(columns, V0, begin, m, speed)
        fill_row(columns, DIRECTION, begin, m, way)
        for j in range(n):
            who[j], total[j] = begin + min(j, m - 1), start[j] + speed[j]
            speed[j] *= speed[j]
        for row in range(count):
            given = p[row]
            fill_row(columns, PARAMETERS + row, begin, m, given)
            for j in range(n):
                total[j] += given[j]
        for j in range(n):
            way[j] = choose(total[j] - total[j] == 0.0, way[j], 0.0)
        laps = 0
        for ahead in (True, False):
            p = flat[: count * n].reshape(count, n)
            if ahead:
                launch(fns, n, s, p, known, monotone, work)
            else:
                turn_round(n, s)
            seek(fns, n, s, p, work)
            judge(n, s)
            if ahead and any_is(s[TRIAL, :n], FOUND):
                laps, _rest = part(s[TRIAL, :n], others, chosen)
                laps = gather(s, flat, count, n, others, laps, u, other, ROWS)
            kept, _rest = part(s[STATE, :n], chosen, others)
            n = shrink(s, flat, count, n, chosen, kept, ROWS)
            if n == 0:
                break
        set_ends(n, s)
        mirrored, alone = not any_is(s[STATE, :n], NOWHERE), not any_is(s[TRIAL, :n], NOWHERE)
        about_one = LIBRATION
        if mirrored and alone and (fns.time_integrand or fns.agm_arguments):
            about_one = MEANS if fns.agm_arguments else SWING
        for j in range(laps):
            lap = u[WAY, j] * u[REACH, j]
            u[LEAST, j], u[MOST, j] = min(lap, 0.0), max(lap, 0.0)
        for kind in (about_one, CIRCULATION):
            if kind == CIRCULATION:
                n, s, flat, u, other, mirrored = laps, u, other, s, flat, False
            if n:
                settle(
                    fns,
                    kind,
                    mirrored,
                    monotone and mirrored and alone,
                    n,
                    s,
                    flat,
                    t,
                    spare,
                    count,
                    held,
                    chosen,
                    others,
                    work,
                    asked,
                    out,
                    reasons,
                )
