"""The entry points from Python into compiled code: explicit signatures, compiled once per installation.

Over arrays, and asked for when somebody wants to know; what every launch needs is found in one crossing (`surveying`).
"""

from math import fabs, isfinite

import numpy as np
from numba import types

from gqm_sym.runtime.crossing import call_climb, call_frame, call_rise
from gqm_sym.runtime.doubledouble import reduce
from gqm_sym.runtime.fused import choose, whole_below
from gqm_sym.runtime.integrands import TO_EQUILIBRIUM, speeds
from gqm_sym.runtime.inversion import derivative, look_up_many, tabulate
from gqm_sym.runtime.jit import Inner, entry
from gqm_sym.runtime.panels import lay, legendre_sum, panel_of, read_off
from gqm_sym.runtime.search import CRITICAL, LIMIT, TURN, speed_squared, walk

_ADDRESSES = types.UniTuple(types.int64, 5)
_LINE = types.float64[::1]
_ROWS = types.float64[:, ::1]
_FLOAT = types.float64
_PANELS = types.Tuple((_LINE, _LINE, _LINE, _ROWS, _ROWS, _FLOAT, _FLOAT, types.int64))
_WALK = types.Tuple((types.int64, _FLOAT, _FLOAT))
_TABLE = types.Tuple((_LINE, _LINE, _LINE, _ROWS, types.int64[::1], _LINE, _LINE))

# A launch from rest on a slope below this share of the climb's size may be an equilibrium: exact numbers decide.
FLAT = 1e-12
# A launch this near to an axis is not mirrored by what doubles know of it, nor one beyond this share of the way to the
# next: there it may be an equilibrium.
UNCLEAR, ALL_BUT = 1e-6, 0.9


@Inner
def first_step(low, high, period):  # type: ignore[no-untyped-def]
    """A step to begin a walk with: an eighth of the curve where that is known."""
    if period > 0.0:
        return period / 8.0
    if isfinite(high - low):
        return (high - low) / 8.0
    return 1.0


@entry(_WALK(_ADDRESSES, _LINE, _FLOAT, _FLOAT, types.int64, _FLOAT, _FLOAT, _FLOAT))
def walk_on(fns, p, lam0, w0, direction, begin, reach, step):  # type: ignore[no-untyped-def]
    """`search.walk`, for Python."""
    return walk(fns, p, lam0, w0, direction, begin, reach, step)


@Inner
def to_axis(start, way, place, step):  # type: ignore[no-untyped-def]
    """How far the first axis of symmetry is ahead; of a lone one (``step`` 0) less than nothing where it is behind."""
    away = way * (place - start)
    return choose(step > 0.0, away - step * whole_below(away / step), away)


@Inner
def mirrored(fns, p, lam0, direction, reach, place, step):  # type: ignore[no-untyped-def]
    """How far a body released at rest comes in an even well, beyond the first axis ahead; 0 where walking must tell.

    V**2 rises all the way to the axis and falls all the way to the next, ``step`` farther (0: there is no other).
    """
    ahead = to_axis(lam0, float(direction), place, step)
    guess = 2.0 * ahead
    # NaN where no axis is known; next to one, or to where the body would just come over the next, walking is safer.
    if not (ahead > UNCLEAR * (fabs(lam0) + fabs(place)) and guess <= reach) or (step > 0.0 and ahead > ALL_BUT * step):
        return 0.0
    guess *= direction
    spot, rows = np.empty(2), np.empty((2, 1))
    left, _size = speed_squared(fns, p, lam0, 0.0, guess, spot, rows)
    call_climb(fns[1], 1, spot, p, rows)
    more = left / rows[1, 0]  # a step of Newton's method, for what the axis is rounded by
    return guess + more if fabs(more) <= UNCLEAR * fabs(guess) else 0.0


@Inner
def ends(fns, p, lam0, v0, direction, low, high, period, place, step):  # type: ignore[no-untyped-def]
    """How far a motion reaches each way, and which way it goes.

    ``place`` and ``step`` are of even wells between whose axes V**2 rises or falls all the way; else ``place`` is NaN.

    Returns
    -------
    direction : int
        The sign of ds/dt after launch (a body released at rest goes where it falls); 0 where exact numbers must decide.
    ahead, behind : (what, near, far)
        As `search.walk` returns them; ``behind`` is walked only if ``ahead`` is a turning point.
    """
    nothing = (LIMIT, 0.0, 0.0)
    w0 = v0 * v0
    begin = first_step(low, high, period)
    if w0 == 0.0:
        rows, size = np.empty((2, 3)), 0.0
        call_climb(fns[1], 3, lam0 + begin * np.array([0.0, 1.0, -1.0]), p, rows)
        for height in rows[0]:
            if isfinite(height):
                size = max(size, fabs(height))
        if not fabs(rows[1, 0]) * begin > FLAT * size:
            return 0, (CRITICAL, 0.0, 0.0), nothing
        direction = -1 if rows[1, 0] > 0.0 else 1
    reach = period if period > 0.0 else (high - lam0 if direction > 0 else lam0 - low)
    if w0 == 0.0:
        turn = mirrored(fns, p, lam0, direction, reach, place, step)
        if turn != 0.0:
            return direction, (TURN, turn, turn), (TURN, 0.0, 0.0)
    ahead = walk(fns, p, lam0, w0, direction, 0.0, reach, begin)
    if ahead[0] != TURN:
        return direction, ahead, nothing
    if w0 == 0.0:
        return direction, ahead, (TURN, 0.0, 0.0)
    reach = period - fabs(ahead[1]) if period > 0.0 else (lam0 - low if direction > 0 else high - lam0)
    return direction, ahead, walk(fns, p, lam0, w0, -direction, 0.0, reach, begin)


@entry(_PANELS(_ADDRESSES, _LINE, types.int64, _FLOAT, _FLOAT, _FLOAT, _FLOAT, _LINE))
def lay_panels(fns, p, kind, a, b, ref, w, marks):  # type: ignore[no-untyped-def]
    """`panels.lay`, for Python."""
    return lay(fns, p, kind, a, b, ref, w, np.empty((0, 0)), marks)


@entry(_LINE(_ADDRESSES, _LINE, types.int64, _FLOAT, _FLOAT, _FLOAT, _FLOAT, _LINE))
def speeds_at(fns, p, kind, a, b, ref, w, phi):  # type: ignore[no-untyped-def]
    """V at many anomalies of a stretch."""
    out = np.empty(phi.size)
    speeds(fns, p, kind, a, b, ref, w, np.empty((0, 0)), phi, np.empty((4, phi.size)), out)
    return out


@entry(_PANELS(_FLOAT, _FLOAT, _ROWS, _LINE))
def lay_along(a, b, field, marks):  # type: ignore[no-untyped-def]
    """`panels.lay` towards an equilibrium b where V**2 is a field."""
    return lay((0, 0, 0, 0, 0), np.empty(0), TO_EQUILIBRIUM, a, b, a, 0.0, field, marks)


@entry(_LINE(_FLOAT, _FLOAT, _ROWS, _LINE))
def speeds_along(a, b, field, phi):  # type: ignore[no-untyped-def]
    """V at many anomalies of a stretch towards an equilibrium b where V**2 is a field."""
    out, work = np.empty(phi.size), np.empty((4, phi.size))
    speeds((0, 0, 0, 0, 0), np.empty(0), TO_EQUILIBRIUM, a, b, a, 0.0, field, phi, work, out)
    return out


@entry(_LINE(_LINE, _ROWS, _LINE))
def slopes(edges, terms, phi):  # type: ignore[no-untyped-def]
    """Derivatives of the panels' Legendre series at anomalies."""
    out, series = np.empty(phi.size), np.empty(terms.shape[1])
    for i in range(phi.size):
        k = panel_of(edges, phi[i])
        half = 0.5 * (edges[k + 1] - edges[k])
        derivative(terms[k], series)
        out[i] = legendre_sum(series, ((phi[i] - edges[k]) - half) / half) / half
    return out


@entry(_LINE(_LINE, _LINE, _ROWS, _LINE))
def read_off_many(edges, marks, terms, phi):  # type: ignore[no-untyped-def]
    """Time or arc length from the first edge to many anomalies."""
    out = np.empty(phi.size)
    for i in range(phi.size):
        out[i] = read_off(edges, marks, terms, phi[i])
    return out


@entry(_TABLE(_LINE, _LINE, _LINE, _ROWS))
def build_table(edges, times, times_low, time_terms):  # type: ignore[no-untyped-def]
    """`inversion.tabulate`, for Python."""
    return tabulate(edges, times, times_low, time_terms)


@entry(_LINE(_LINE, _LINE, _LINE, _ROWS, types.int64[::1], _LINE, _LINE, _LINE))
def anomalies(middles, lows, scales, powers, index, ends, t, t_low):  # type: ignore[no-untyped-def]
    """`inversion.look_up_many`, for Python."""
    out = np.empty(t.size)
    look_up_many(middles, lows, scales, powers, index, ends, t, t_low, out)
    return out


@entry(types.Tuple((_LINE, _LINE, _LINE))(_LINE, _LINE, _FLOAT, _FLOAT))
def reduce_many(t, t_low, period, period_low):  # type: ignore[no-untyped-def]
    """Counts of whole periods and what is left, as two doubles each (`doubledouble.reduce`)."""
    count, rest, rest_low = np.empty(t.size), np.empty(t.size), np.empty(t.size)
    for i in range(t.size):
        count[i], rest[i], rest_low[i] = reduce(t[i], t_low[i], period, period_low)
    return count, rest, rest_low


@entry(_ROWS(_ADDRESSES, _LINE, _LINE, _LINE))
def frame_at(fns, p, lam, v2):  # type: ignore[no-untyped-def]
    """x, z, ds, kappa and the contact force at many places, given V**2 there."""
    out = np.empty((5, lam.size))
    call_frame(fns[0], lam.size, lam, v2, p, out)
    return out


@entry(_ROWS(_ADDRESSES, _LINE, _LINE))
def climb_at(fns, p, lam):  # type: ignore[no-untyped-def]
    """The climb and its slope at many places."""
    out = np.empty((2, lam.size))
    call_climb(fns[1], lam.size, lam, p, out)
    return out


@entry(_LINE(_ADDRESSES, _LINE, _FLOAT, _FLOAT, _FLOAT, _LINE, _LINE))
def speed_squared_at(fns, p, lam0, lam0_low, w0, places, offsets):  # type: ignore[no-untyped-def]
    """V**2 at many places and their offsets from lam0, launched from lam0 + lam0_low, without subtracting heights."""
    rows, launch = np.empty((2, offsets.size)), np.empty((2, 1))
    call_rise(fns[2], offsets.size, lam0, places, offsets, p, rows)
    call_climb(fns[1], 1, np.array([lam0]), p, launch)
    out = np.empty(offsets.size)
    for i in range(offsets.size):
        out[i] = w0 - (offsets[i] * rows[0, i] - lam0_low * launch[1, 0])
    return out
