"""One number a launch, for many launches in one compiled loop: what `sweep` asks for.

Doubles alone, no tables kept. An orbit that doubles cannot decide, or cannot time to the last places, is left to the
exact problem (`sweeping`).
"""

from math import fabs, inf, isfinite, pi, sqrt

import numpy as np
from numba import types

from gqm_sym.runtime.columns import DIRECTION, FIRST, LAM0, LAST, NEXT, PARAMETERS, PERIOD, PLACE, TARGET, V0, element
from gqm_sym.runtime.crossing import call_bend, call_frame, call_rise
from gqm_sym.runtime.entries import ends
from gqm_sym.runtime.jit import Inner, entry
from gqm_sym.runtime.panels import FLOOR, REGULAR, TURN_TURN, lay, read_off
from gqm_sym.runtime.search import LIMIT, TURN

# What is asked of each launch.
HALF, WHOLE, PLACES, SPEEDS, FORCES, ARRIVAL = range(6)
# What each launch came to: answered; left to the exact problem; never repeats; not numbers; outside the domain;
# never at the place asked for.
DONE, HARD, PASSING, MEANINGLESS, OUTSIDE, ELSEWHERE = range(6)
# Kinds of orbits.
LIBRATION, CIRCULATION = range(2)

# The trapezoidal rule doubles its nodes so often, from FEWEST intervals on.
FEWEST, DOUBLINGS = 8, 7
MOST_NODES = FEWEST * 2**DOUBLINGS
# The rule's error is a sum of terms c*r**nodes, times a cosine of the nodes. It squares with each doubling, over c,
# which branch points of ds make as small as 1e-5. A change may also be small by accident; two in a row hardly are.
LAST_CHANGE, CHANGE_BEFORE = 1e-11, 3e-6
# Below this balance of V**2 doubles lose last places that matter (`stretch.LEAST_BALANCE`).
LEAST_BALANCE = 1e-2
# Places looked at for an extreme, before the best is refined.
LOOKED_AT = 64
REFINED = 40

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
    flat = work.reshape(-1)
    da, db, rows = flat[:n], flat[n : 2 * n], flat[2 * n : 4 * n].reshape(2, n)
    low, high = inf, 0.0
    if kind == LIBRATION:
        for i in range(n):
            da[i], db[i] = width * FROM_A[first + i], width * FROM_B[first + i]
        call_bend(fns[3], n, a, b, da, db, p, rows)
        for i in range(n):
            rates[i] = pi * rows[1, i] / sqrt(rows[0, i])
            low, high = min(low, rows[0, i]), max(high, rows[0, i])
    else:
        for i in range(n):
            db[i] = width * SHARES[first + i]
            da[i] = lam0 + db[i]
        call_rise(fns[2], n, lam0, da, db, p, rows)
        for i in range(n):
            lost = db[i] * rows[0, i]
            rates[i] = fabs(width) * rows[1, i] / sqrt(w0 - lost)
            low = min(low, (w0 - lost) / (w0 + fabs(lost)))
        high = 1.0
    return low, high


@Inner
def settled(before, change):  # type: ignore[no-untyped-def]
    """Whether the trapezoidal rule has come to its value, by its last two relative changes."""
    return (before <= CHANGE_BEFORE) & (change <= LAST_CHANGE)


@Inner
def time_once(fns, p, kind, lam0, w0, a, b, width, work, rates):  # type: ignore[no-untyped-def]
    """Half period or loop time by the trapezoidal rule; NaN where it did not converge or V**2 all but vanishes."""
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
    if kind == LIBRATION:
        panels = lay(fns, p, TURN_TURN, a, b, a, 0.0, np.empty((0, 0)), np.array([0.0, pi]))
    else:
        panels = lay(fns, p, REGULAR, lam0, b, lam0, w0, np.empty((0, 0)), np.array([0.0, 1.0]))
    if panels[7] >= FLOOR or panels[6] < LEAST_BALANCE:
        return np.nan
    return panels[1][-1]


@Inner
def arrival(fns, p, kind, direction, lam0, w0, a, b, place):  # type: ignore[no-untyped-def]
    """When the body is first at a place; NaN for the exact problem, infinity if never."""
    if place == lam0:
        return 0.0
    if kind == CIRCULATION:
        ahead = (place - lam0) * direction
        lap = fabs(b - a)
        laps = np.floor(ahead / lap)
        if laps < 0.0:
            return inf
        panels = lay(fns, p, REGULAR, lam0, b, lam0, w0, np.empty((0, 0)), np.array([0.0, 1.0]))
        if panels[7] >= FLOOR or panels[6] < LEAST_BALANCE:
            return np.nan
        return laps * panels[1][-1] + read_off(panels[0], panels[1], panels[3], ahead / lap - laps)
    if not a <= place <= b:
        return inf
    panels = lay(fns, p, TURN_TURN, a, b, a, 0.0, np.empty((0, 0)), np.array([0.0, pi]))
    if panels[7] >= FLOOR or panels[6] < LEAST_BALANCE:
        return np.nan
    whole = panels[1][-1]
    start = read_off(panels[0], panels[1], panels[3], anomaly(a, b, lam0))
    stop = read_off(panels[0], panels[1], panels[3], anomaly(a, b, place))
    if direction > 0:
        return stop - start if place > lam0 else (whole - start) + (whole - stop)
    return start - stop if place < lam0 else start + stop


@Inner
def anomaly(a, b, place):  # type: ignore[no-untyped-def]
    """The anomaly of a place between two turning points."""
    return 2.0 * np.arctan2(sqrt(max(place - a, 0.0)), sqrt(max(b - place, 0.0)))


@Inner
def loads(fns, p, kind, lam0, w0, a, b, width, asked, phi, work, out):  # type: ignore[no-untyped-def]
    """V or the contact force at shares ``phi`` of the orbit in time-like steps."""
    n = phi.size
    flat = work.reshape(-1)
    da, db, rows = flat[:n], flat[n : 2 * n], flat[2 * n : 4 * n].reshape(2, n)
    v2, lam = np.empty(n), np.empty(n)
    if kind == LIBRATION:
        for i in range(n):
            s, c = np.sin(0.5 * pi * phi[i]), np.cos(0.5 * pi * phi[i])
            da[i], db[i] = width * s * s, width * c * c
            lam[i] = a + da[i] if da[i] <= db[i] else b - db[i]
        call_bend(fns[3], n, a, b, da, db, p, rows)
        for i in range(n):
            v2[i] = da[i] * db[i] * rows[0, i]
    else:
        for i in range(n):
            db[i] = width * phi[i]
            lam[i] = lam0 + db[i]
        call_rise(fns[2], n, lam0, lam, db, p, rows)
        for i in range(n):
            v2[i] = w0 - db[i] * rows[0, i]
    if asked == SPEEDS:
        for i in range(n):
            out[i] = sqrt(max(v2[i], 0.0))
    else:
        frame = np.empty((5, n))
        call_frame(fns[0], n, lam, v2, p, frame)
        for i in range(n):
            out[i] = frame[4, i]


@Inner
def extreme(fns, p, kind, lam0, w0, a, b, width, asked, sign, work):  # type: ignore[no-untyped-def]
    """The largest (sign 1) or least (sign -1) V or contact force on an orbit: the best of many places, refined."""
    phi, values = np.empty(LOOKED_AT + 1), np.empty(LOOKED_AT + 1)
    for i in range(LOOKED_AT + 1):
        phi[i] = i / LOOKED_AT
    loads(fns, p, kind, lam0, w0, a, b, width, asked, phi, work, values)
    best = 0
    for i in range(LOOKED_AT + 1):
        if sign * values[i] > sign * values[best]:
            best = i
    # Golden section on both sides of the best place; a load is flat there, so its value has every digit long before.
    lo, hi, ratio = max(phi[best] - 1.0 / LOOKED_AT, 0.0), min(phi[best] + 1.0 / LOOKED_AT, 1.0), 0.6180339887498949
    pair, found, top = np.empty(2), np.empty(2), values[best]
    for _ in range(REFINED):
        pair[0], pair[1] = hi - ratio * (hi - lo), lo + ratio * (hi - lo)
        loads(fns, p, kind, lam0, w0, a, b, width, asked, pair, work, found)
        if sign * found[0] > sign * found[1]:
            hi = pair[1]
        else:
            lo = pair[0]
        top = max(top, found[0], found[1]) if sign > 0 else min(top, found[0], found[1])
    return top


@entry(
    types.void(
        *(_ADDRESSES, types.int64[:, ::1], types.boolean, types.int64, _ROWS, types.int8[::1]),
    ),
    nogil=True,
)
def answer_many(fns, columns, monotone, asked, out, reasons):  # type: ignore[no-untyped-def]
    """Fill a row of ``out`` and of ``reasons`` for each launch that is HARD so far.

    ``columns`` are launches as `columns.pointers` gives them; V**2 is ``monotone`` between the axes of symmetry. A row
    of ``out`` holds both turning points (PLACES), the least and the greatest (SPEEDS, FORCES), or a time.
    """
    work, rates, p = np.empty((4, MOST_NODES)), np.empty(MOST_NODES), np.empty(columns.shape[0] - PARAMETERS)
    for k in range(reasons.size):
        if reasons[k] != HARD:
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
        way, ahead, behind = ends(fns, p, lam0, v0, way, low, high, period, mirror, step)
        if way != 0 and ahead[0] == LIMIT and period > 0.0 and v0 > 0.0:
            kind, a, b, width = CIRCULATION, lam0, lam0 + way * period, way * period
        elif way != 0 and ahead[0] == TURN and behind[0] == TURN:
            kind = LIBRATION
            least, most = min(ahead[1], behind[1]), max(ahead[1], behind[1])
            a, b, width = lam0 + least, lam0 + most, most - least
        else:
            reasons[k] = HARD
            continue
        if kind == CIRCULATION and asked in (HALF, PLACES):
            reasons[k] = PASSING
            continue
        reasons[k] = DONE
        w0 = v0 * v0
        if asked in (HALF, WHOLE):
            value = time_once(fns, p, kind, lam0, w0, a, b, width, work, rates)
            if not value > 0.0:
                value = time_adaptively(fns, p, kind, lam0, w0, a, b)
            out[k, 0] = 2.0 * value if asked == WHOLE and kind == LIBRATION else value
        elif asked == PLACES:
            out[k, 0], out[k, 1] = a, b
        elif asked == ARRIVAL:
            out[k, 0] = arrival(fns, p, kind, way, lam0, w0, a, b, element(columns, TARGET, k))
            if out[k, 0] == inf:
                out[k, 0], reasons[k] = np.nan, ELSEWHERE
                continue
        else:
            for j in range(2):
                out[k, j] = extreme(fns, p, kind, lam0, w0, a, b, width, asked, 2 * j - 1, work)
        if not isfinite(out[k, 0]):
            reasons[k] = HARD
