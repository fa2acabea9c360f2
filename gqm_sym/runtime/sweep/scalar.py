"""One number a launch, for many launches in one compiled loop: what `sweep` asks for.

Doubles alone, no tables kept. An orbit that doubles cannot decide, or cannot time to the last places, is left to the
exact problem (`sweeping`).
"""

from math import inf, isfinite

import numpy as np
from numba import types

from gqm_sym.runtime.compiled.jit import entry
from gqm_sym.runtime.compiled.registers import uncounted
from gqm_sym.runtime.compiled.strided import (
    AXIS,
    AXIS_STEP,
    DIRECTION,
    DOMAIN_HIGH,
    DOMAIN_LOW,
    DOMAIN_PERIOD,
    LAM0,
    PARAMETERS,
    TARGET,
    V0,
    element,
)
from gqm_sym.runtime.compiled.types import ADDRESSES, MATRIX, VECTOR
from gqm_sym.runtime.launch.domain import DomainNumbers
from gqm_sym.runtime.launch.ends import NO_ORBIT, ends, orbit_kind
from gqm_sym.runtime.quadrature.trapezoid import (
    CIRCULATION,
    LIBRATION,
    time_by_panels,
    time_by_trapezoid,
    trapezoid_rates,
    trapezoid_workspace,
)
from gqm_sym.runtime.sweep.arrivals import arrival
from gqm_sym.runtime.sweep.orbit_extremes import extreme
from gqm_sym.runtime.sweep.quantities import (
    ANSWERED,
    ARRIVAL_TIME,
    HALF_PERIOD,
    MAX_FORCE,
    MAX_SPEED,
    MIN_FORCE,
    NEVER_THERE,
    NOT_FINITE,
    NOT_PERIODIC,
    OUTSIDE_DOMAIN,
    PERIOD,
    SPAN_KNOWN,
    TURNING_POINTS,
    UNDECIDED,
)


@entry(
    types.void(
        *(ADDRESSES, types.int64[:, ::1], types.boolean, types.int64, MATRIX, MATRIX, types.int8[::1], VECTOR),
    ),
    nogil=True,
)
def answer_one_by_one(fns, columns, monotone, asked, spans, out, reasons, held):  # type: ignore[no-untyped-def]
    """Fill a row of ``out`` and of ``reasons`` for each launch that is HARD or SPANNED so far.

    ``columns`` are launches as `columns.pointers` gives them; V**2 is ``monotone`` between the axes of symmetry;
    ``spans`` are those that batches found. A row of ``out`` holds both turning points (PLACES), or one number. ``held``
    is room for the parameters of one launch.
    """
    work, series, p = trapezoid_workspace(), trapezoid_rates(), uncounted(held)
    for k in range(reasons.size):
        spanned = reasons[k] == SPAN_KNOWN
        if reasons[k] != UNDECIDED and not spanned:
            continue
        for row in range(p.size):
            p[row] = element(columns, PARAMETERS + row, k)
        lam0, v0, way = element(columns, LAM0, k), element(columns, V0, k), int(element(columns, DIRECTION, k))
        low, high, period = (
            element(columns, DOMAIN_LOW, k),
            element(columns, DOMAIN_HIGH, k),
            element(columns, DOMAIN_PERIOD, k),
        )
        mirror, step = element(columns, AXIS, k) if monotone else np.nan, element(columns, AXIS_STEP, k)
        if not (isfinite(lam0) and isfinite(v0) and isfinite(p.sum())):
            reasons[k] = NOT_FINITE
            continue
        if not low <= lam0 <= high:
            reasons[k] = OUTSIDE_DOMAIN
            continue
        if spanned:
            least, most = spans[k, 0], spans[k, 1]
            going_round = most != most
            if going_round:
                least, most = min(least, 0.0), max(least, 0.0)
            elif v0 == 0.0:
                way = 1 if most > -least else -1
        else:
            way, ahead, behind = ends(fns, p, lam0, v0, way, DomainNumbers(low, high, period, mirror, step))
            orbit = orbit_kind(way, ahead, behind, v0, period)
            if orbit == NO_ORBIT:
                reasons[k] = UNDECIDED
                continue
            going_round = orbit == CIRCULATION
            one, other = (way * period, 0.0) if going_round else (ahead.near, behind.near)
            least, most = min(one, other), max(one, other)
        if going_round and asked in (HALF_PERIOD, TURNING_POINTS):
            reasons[k] = NOT_PERIODIC
            continue
        reasons[k] = ANSWERED
        w0, a, b = v0 * v0, lam0 + least, lam0 + most
        if asked in (HALF_PERIOD, PERIOD):
            kind, width = (CIRCULATION, way * period) if going_round else (LIBRATION, most - least)
            a, b = (lam0, lam0 + width) if going_round else (a, b)
            value = time_by_trapezoid(fns, p, kind, lam0, w0, a, b, width)
            if not value > 0.0:
                value = time_by_panels(fns, p, kind, lam0, w0, a, b)
            out[k, 0] = 2.0 * value if asked == PERIOD and kind == LIBRATION else value
        elif asked == TURNING_POINTS:
            out[k, 0], out[k, 1] = a, b
        elif asked == ARRIVAL_TIME:
            place = element(columns, TARGET, k)
            out[k, 0] = arrival(fns, p, going_round, way, lam0, w0, least, most, place, work, series)
            if out[k, 0] == inf:
                out[k, 0], reasons[k] = np.nan, NEVER_THERE
                continue
        else:
            force, sign = asked in (MIN_FORCE, MAX_FORCE), 1.0 if asked in (MAX_SPEED, MAX_FORCE) else -1.0
            out[k, 0] = extreme(fns, p, going_round, mirror == mirror, lam0, w0, least, most, force, sign)
        if not isfinite(out[k, 0]):
            reasons[k] = UNDECIDED
