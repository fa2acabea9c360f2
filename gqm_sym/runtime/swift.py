"""One number a launch, for many launches in one compiled loop: what `sweep` asks for.

Doubles alone, no tables kept. An orbit that doubles cannot decide, or cannot time to the last places, is left to the
exact problem (`sweeping`).
"""

from math import fabs, inf, isfinite, pi, sqrt

import numpy as np
from numba import types

from gqm_sym.runtime.arrivals import arrival, orbit_panels, to_rounding
from gqm_sym.runtime.columns import DIRECTION, FIRST, LAM0, LAST, NEXT, PARAMETERS, PERIOD, PLACE, TARGET, V0, element
from gqm_sym.runtime.crossing import call_bend, call_rise
from gqm_sym.runtime.entries import ends
from gqm_sym.runtime.jit import Inner, entry
from gqm_sym.runtime.lanes import on_stack, uncounted
from gqm_sym.runtime.orbit_extremes import extreme
from gqm_sym.runtime.panels import LEAST_BALANCE
from gqm_sym.runtime.search import LIMIT, TURN

# What is asked of each launch. Of batches also SPANS: the offsets of both ends from the launch, or of a lap and NaN.
HALF, WHOLE, PLACES, ARRIVAL, SLOWEST, FASTEST, WEAKEST, STRONGEST, SPANS = range(9)
# What each launch came to: answered; left to the exact problem; never repeats; not numbers; outside the domain;
# never at the place asked for. Of batches also SPANNED: its span is known.
DONE, HARD, PASSING, MEANINGLESS, OUTSIDE, ELSEWHERE = range(6)
SPANNED = -1
# Kinds of orbits.
LIBRATION, CIRCULATION = range(2)

# The trapezoidal rule doubles its nodes so often, from FEWEST intervals on.
FEWEST, DOUBLINGS = 8, 7
MOST_NODES = FEWEST * 2**DOUBLINGS
# The rule's error is a sum of terms c*r**nodes, times a cosine of the nodes. It squares with each doubling, over c,
# which branch points of ds make as small as 1e-5. A change may also be small by accident; two in a row hardly are.
LAST_CHANGE, CHANGE_BEFORE = 1e-11, 3e-6

work_room, rate_room = on_stack(4 * MOST_NODES), on_stack(MOST_NODES)

_ADDRESSES = types.UniTuple(types.int64, 5)
_LINE = types.float64[::1]
_ROWS = types.float64[:, ::1]


def _anomalies() -> np.ndarray:
    """Anomalies of all levels of the rule over [0, 1] half periods: the first's, then what each doubling adds."""
    levels = [np.arange(FEWEST + 1) / FEWEST]
    for k in range(DOUBLINGS):
        n = FEWEST * 2**k
        levels.append((np.arange(n) + 0.5) / n)
    return np.concatenate(levels)


SHARES = _anomalies()
FROM_A, FROM_B = np.sin(0.5 * pi * SHARES) ** 2, np.cos(0.5 * pi * SHARES) ** 2


@Inner
def fill(fns, p, kind, lam0, w0, a, b, width, first, n, work, rates):  # type: ignore[no-untyped-def]
    """dt/dphi at n nodes of the rule from the ``first`` on; returns the least and largest regular factor of V**2.

    ``width`` is the orbit's, from offsets: closer than the difference of its rounded ends.
    """
    da, db, rows = work[:n], work[n : 2 * n], work[2 * n : 4 * n]
    low, high = inf, 0.0
    if kind == LIBRATION:
        for i in range(n):
            da[i], db[i] = width * FROM_A[first + i], width * FROM_B[first + i]
        call_bend(fns[3], n, a, b, da, db, p, rows)
        for i in range(n):
            rates[i] = pi * rows[n + i] / sqrt(rows[i])
            low, high = min(low, rows[i]), max(high, rows[i])
    else:
        for i in range(n):
            db[i] = width * SHARES[first + i]
            da[i] = lam0 + db[i]
        call_rise(fns[2], n, lam0, da, db, p, rows)
        for i in range(n):
            lost = db[i] * rows[i]
            rates[i] = fabs(width) * rows[n + i] / sqrt(w0 - lost)
            low = min(low, (w0 - lost) / (w0 + fabs(lost)))
        high = 1.0
    return low, high


@Inner
def settled(before, change):  # type: ignore[no-untyped-def]
    """Whether the trapezoidal rule has come to its value, by its last two relative changes."""
    return (before <= CHANGE_BEFORE) & (change <= LAST_CHANGE)


@Inner
def time_once(fns, p, kind, lam0, w0, a, b, width):  # type: ignore[no-untyped-def]
    """Half period or loop time by the trapezoidal rule; NaN where it did not converge or V**2 all but vanishes."""
    work, rates = work_room(), rate_room()
    low, high = fill(fns, p, kind, lam0, w0, a, b, width, 0, FEWEST + 1, work, rates)
    total = 0.5 * (rates[0] + rates[FEWEST])
    half = total
    for i in range(1, FEWEST):
        total += rates[i]
        half += (i % 2 == 0) * rates[i]
    value, n, first = total / FEWEST, FEWEST, FEWEST + 1
    before = fabs(2.0 * half - total) / total
    while n < MOST_NODES:
        least, most = fill(fns, p, kind, lam0, w0, a, b, width, first, n, work, rates)
        low, high = min(low, least), max(high, most)
        if not low > LEAST_BALANCE * high:
            return np.nan
        more = 0.0
        for i in range(n):
            more += rates[i]
        total += more
        first += n
        n *= 2
        new = total / n
        change = fabs(new - value) / new
        value = new
        if settled(before, change):
            return value
        before = change
    return np.nan


@Inner
def time_adaptively(fns, p, kind, lam0, w0, a, b):  # type: ignore[no-untyped-def]
    """Half period or loop time by adaptive panels; NaN where they did not converge."""
    panels = orbit_panels(fns, p, kind == CIRCULATION, a, b, lam0, w0)
    if not to_rounding(panels):
        return np.nan
    return panels[1][-1]


@entry(
    types.void(
        *(_ADDRESSES, types.int64[:, ::1], types.boolean, types.int64, _ROWS, _ROWS, types.int8[::1], _LINE),
    ),
    nogil=True,
)
def answer_many(fns, columns, monotone, asked, spans, out, reasons, held):  # type: ignore[no-untyped-def]
    """Fill a row of ``out`` and of ``reasons`` for each launch that is HARD or SPANNED so far.

    ``columns`` are launches as `columns.pointers` gives them; V**2 is ``monotone`` between the axes of symmetry;
    ``spans`` are those that batches found. A row of ``out`` holds both turning points (PLACES), or one number. ``held``
    is room for the parameters of one launch.
    """
    work, series, p = work_room(), rate_room(), uncounted(held)
    for k in range(reasons.size):
        spanned = reasons[k] == SPANNED
        if reasons[k] != HARD and not spanned:
            continue
        for row in range(p.size):
            p[row] = element(columns, PARAMETERS + row, k)
        lam0, v0, way = element(columns, LAM0, k), element(columns, V0, k), int(element(columns, DIRECTION, k))
        low, high, period = element(columns, FIRST, k), element(columns, LAST, k), element(columns, PERIOD, k)
        mirror, step = element(columns, PLACE, k) if monotone else np.nan, element(columns, NEXT, k)
        if not (isfinite(lam0) and isfinite(v0) and isfinite(p.sum())):
            reasons[k] = MEANINGLESS
            continue
        if not low <= lam0 <= high:
            reasons[k] = OUTSIDE
            continue
        if spanned:
            least, most = spans[k, 0], spans[k, 1]
            going_round = most != most
            if going_round:
                least, most = min(least, 0.0), max(least, 0.0)
            elif v0 == 0.0:
                way = 1 if most > -least else -1
        else:
            way, ahead, behind = ends(fns, p, lam0, v0, way, low, high, period, mirror, step)
            going_round = way != 0 and ahead[0] == LIMIT and period > 0.0 and v0 > 0.0
            if not (going_round or (way != 0 and ahead[0] == TURN and behind[0] == TURN)):
                reasons[k] = HARD
                continue
            one, other = (way * period, 0.0) if going_round else (ahead[1], behind[1])
            least, most = min(one, other), max(one, other)
        if going_round and asked in (HALF, PLACES):
            reasons[k] = PASSING
            continue
        reasons[k] = DONE
        w0, a, b = v0 * v0, lam0 + least, lam0 + most
        if asked in (HALF, WHOLE):
            kind, width = (CIRCULATION, way * period) if going_round else (LIBRATION, most - least)
            a, b = (lam0, lam0 + width) if going_round else (a, b)
            value = time_once(fns, p, kind, lam0, w0, a, b, width)
            if not value > 0.0:
                value = time_adaptively(fns, p, kind, lam0, w0, a, b)
            out[k, 0] = 2.0 * value if asked == WHOLE and kind == LIBRATION else value
        elif asked == PLACES:
            out[k, 0], out[k, 1] = a, b
        elif asked == ARRIVAL:
            place = element(columns, TARGET, k)
            out[k, 0] = arrival(fns, p, going_round, way, lam0, w0, least, most, place, work, series)
            if out[k, 0] == inf:
                out[k, 0], reasons[k] = np.nan, ELSEWHERE
                continue
        else:
            force, sign = asked in (WEAKEST, STRONGEST), 1.0 if asked in (FASTEST, STRONGEST) else -1.0
            out[k, 0] = extreme(fns, p, going_round, mirror == mirror, lam0, w0, least, most, force, sign)
        if not isfinite(out[k, 0]):
            reasons[k] = HARD
