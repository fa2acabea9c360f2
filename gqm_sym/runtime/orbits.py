"""The state of a body on a periodic motion at many times, from the tables of its one stretch, in one compiled loop."""

from math import cos, fabs, pi, sin

import numpy as np
from numba import types

from gqm_sym.runtime.crossing import call_frame
from gqm_sym.runtime.doubledouble import add, reduce
from gqm_sym.runtime.inversion import look_up
from gqm_sym.runtime.jit import Inner, entry
from gqm_sym.runtime.panels import TURN_TURN, read_off, speeds

BLOCK = 64
ULP = 2.220446049250313e-16

_ADDRESSES = types.UniTuple(types.int64, 5)
_LINE = types.float64[::1]
_ROWS = types.float64[:, ::1]
_TABLE = types.Tuple((_LINE, _LINE, _LINE, _ROWS, types.int64[::1], _LINE))
_ARCS = types.Tuple((_LINE, _LINE, _ROWS))
_ERRORS = types.Tuple((_LINE, _LINE, _LINE))


@Inner
def anomalies_at(clock, kind, table, t, n, phi, sense, laps):  # type: ignore[no-untyped-def]
    """The anomaly, the sense of motion along the stretch and the count of laps at n times.

    ``clock`` holds the period, the phase from the stretch's end ``a`` and the whole time by the stretch's own clock,
    each as two doubles, the last anomaly and by how much that clock is fast.
    """
    period, period_low, phase, phase_low = clock[0], clock[1], clock[2], clock[3]
    whole, whole_low, stop, pace = clock[4], clock[5], clock[6], clock[7]
    middles, lows, scales, powers, index, ends = table
    for i in range(n):
        s, low = add(t[i], 0.0, phase, phase_low)
        laps[i], r, low = reduce(s, low, period, period_low)
        sense[i] = 1.0
        if kind == TURN_TURN and r > 0.5 * period:
            r, low = add(period, period_low, -r, -low)
            sense[i] = -1.0
        low += r * pace
        if r + low <= 0.0:
            phi[i] = 0.0
        elif (r - whole) + (low - whole_low) >= 0.0:
            phi[i] = stop
        else:
            phi[i] = min(max(look_up(middles, lows, scales, powers, index, ends, r, low), 0.0), stop)


@Inner
def place_at(kind, a, b, phi):  # type: ignore[no-untyped-def]
    """The curve's parameter at an anomaly, from the nearer end."""
    width = b - a
    if kind == TURN_TURN:
        if phi < 0.5 * pi:
            s = sin(0.5 * phi)
            return a + width * (s * s)
        c = cos(0.5 * phi)
        return b - width * (c * c)
    return a + width * phi if phi <= 0.5 else b - width * (1.0 - phi)


@entry(
    types.void(types.int64, types.float64, types.float64, types.float64, types.float64, _LINE, _TABLE, _LINE, _LINE),
    nogil=True,
)
def places_along(kind, a, b, launch, lap, clock, table, t, out):  # type: ignore[no-untyped-def]
    """Fill ``out`` with the curve's parameter at times ``t``."""
    phi, sense, laps = np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK)
    for start in range(0, t.size, BLOCK):
        n = min(BLOCK, t.size - start)
        anomalies_at(clock, kind, table, t[start:], n, phi, sense, laps)
        for i in range(n):
            place = place_at(kind, a, b, phi[i]) + laps[i] * lap
            out[start + i] = launch if t[start + i] == 0.0 else place


@entry(
    types.void(
        *(_ADDRESSES, _LINE, types.int64, types.UniTuple(types.float64, 5), _LINE, _LINE, _TABLE, _ARCS, _ERRORS),
        *(_LINE, types.int64, types.int64, _ROWS),
    ),
    nogil=True,
)
def states_along(  # type: ignore[no-untyped-def]
    fns, p, kind, stretch, launch, clock, table, arcs, errors, t, begin, end, out
):
    """Fill rows of ``out`` with s, x, z, v, v**2, kappa, normal force and error of lam at some of the times ``t``.

    Row 0 holds lam already. ``stretch`` holds its ends, a place with V**2 there, and its exact width against that of
    the rounded ends; ``launch`` the place and the signed speed there, the length of a lap, the arc length at launch and
    that of the stretch's end ``a``, the clock's error at launch and by how much it grows with time. ``errors`` are the
    clock's panel by panel, and the inversion's with the anomalies up to which each holds.
    """
    a, b, ref, w, spread = stretch
    lam0, v0, lap_length, s0, s_a = launch[0], launch[1], launch[2], launch[3], launch[4]
    late, drift = launch[5], launch[6]
    edges, lengths, length_terms = arcs
    clock_errors, reaches, inversion_errors = errors
    no_field = np.empty((0, 0))
    way = 1.0 if b > a else -1.0
    phi, sense, laps = np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK)
    v, reduced, v2 = np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK)
    work, rows = np.empty((4, BLOCK)), np.empty(5 * BLOCK)
    for start in range(begin, end, BLOCK):
        n = min(BLOCK, end - start)
        anomalies_at(clock, kind, table, t[start:], n, phi, sense, laps)
        # The functions of a generated module see rows of as many numbers as they are told.
        flat = work.reshape(-1)[: 4 * n].reshape(4, n)
        speeds(fns, p, kind, a, b, ref, w, no_field, phi[:n], flat, v)
        for i in range(n):
            v[i] *= way * sense[i] * spread
            reduced[i] = place_at(kind, a, b, phi[i])
            s = (s_a + way * spread * read_off(edges, lengths, length_terms, phi[i])) + laps[i] * lap_length
            if t[start + i] == 0.0:
                v[i], reduced[i], s = v0, lam0, 0.0
            v2[i] = v[i] * v[i]
            out[1, start + i] = s + s0
            out[4, start + i], out[5, start + i] = v[i], v2[i]
        frame = rows[: 5 * n].reshape(5, n)
        call_frame(fns[0], n, reduced, v2, p, frame)
        for i in range(n):
            out[2, start + i], out[3, start + i] = frame[0, i], frame[1, i]
            out[6, start + i], out[7, start + i] = frame[3, i], frame[4, i]
            panel = min(max(np.searchsorted(edges, phi[i], side="right") - 1, 0), edges.size - 2)
            part = min(np.searchsorted(reaches, phi[i]), reaches.size - 1)
            rate = fabs(v[i]) / frame[2, i] if frame[2, i] > 0.0 else 0.0
            rounding = ULP * (1.5 * fabs(out[0, start + i] - reduced[i]) + 2.0 * fabs(reduced[i]))
            error = rate * (late + drift * fabs(t[start + i]) + clock_errors[panel])
            out[8, start + i] = error + inversion_errors[part] + rounding
