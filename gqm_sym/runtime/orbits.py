"""The state of a body on a periodic motion at any times, from the tables of its one stretch, in one crossing.

All that is known of a motion is one *record*, an array of doubles: unpacking twenty arrays would take longer than
reading them. It begins with where its sections begin; whole numbers are kept by their bits.

======================== ===================================================================================
section                  what it holds
======================== ===================================================================================
FUNCTIONS                addresses of the module's functions, and the kind of stretch: whole numbers
SHAPE                    both ends, a place with V**2 there, the exact width against that of the rounded ends
LAUNCH                   place, signed speed, length of a lap, arc length at launch and of the stretch's end
                         ``a`` from there, error of the clock at launch and by how much it grows with time
DIAL, COSINES, SINES     as `waves.sum_wave` takes them; no cosines where the table is to be used
CLOCK                    period, phase from the end ``a``, whole time by the stretch's own clock, two doubles
                         each; the last anomaly, and by how much that clock is fast
MIDDLES ... ENDS         the table (`inversion.tabulate`)
EDGES, LENGTHS, ARCS     the panels' arc lengths
CLOCK_ERRORS             of the clock, panel by panel
REACHES, TABLE_ERRORS    the table's, with the anomalies up to which each holds
======================== ===================================================================================
"""

from math import cos, fabs, pi, sin

import numpy as np
from numba import types

from gqm_sym.runtime.clocks import Array
from gqm_sym.runtime.crossing import call_frame
from gqm_sym.runtime.doubledouble import add, reduce
from gqm_sym.runtime.integrands import TURN_TURN, speeds
from gqm_sym.runtime.inversion import TERMS, look_up
from gqm_sym.runtime.jit import Inner, entry
from gqm_sym.runtime.panels import DEGREE, panel_of, read_off
from gqm_sym.runtime.waves import sum_wave

BLOCK = 64
ULP = 2.220446049250313e-16

FUNCTIONS, SHAPE, LAUNCH, DIAL, COSINES, SINES, CLOCK = range(7)
MIDDLES, LOWS, SCALES, POWERS, INDEX, ENDS = range(7, 13)
EDGES, LENGTHS, ARCS, CLOCK_ERRORS, REACHES, TABLE_ERRORS = range(13, 19)
SECTIONS = 19

_LINE = types.float64[::1]
_ROWS = types.float64[:, ::1]
_STATE = types.UniTuple(types.float64, 10)


def record(sections: dict[int, Array]) -> Array:
    """A record of some sections; the others are empty."""
    marks = np.empty(SECTIONS + 1, dtype=np.int64)
    parts, end = [marks.view(np.float64)], SECTIONS + 1
    for k in range(SECTIONS):
        marks[k] = end
        if k in sections:
            parts.append(sections[k].reshape(-1).view(np.float64))
            end += sections[k].size
    marks[SECTIONS] = end
    return np.concatenate(parts)


@Inner
def section(record, k):  # type: ignore[no-untyped-def]
    """A section of a record."""
    marks = record[k : k + 2].view(np.int64)
    return record[marks[0] : marks[1]]


@Inner
def table_of(record):  # type: ignore[no-untyped-def]
    """A record's table, as `inversion.look_up` takes it."""
    powers = section(record, POWERS)
    return (
        section(record, MIDDLES),
        section(record, LOWS),
        section(record, SCALES),
        powers.reshape((powers.size // TERMS, TERMS)),
        section(record, INDEX).view(np.int64),
        section(record, ENDS),
    )


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


@Inner
def find_places(record, t, out, begin, end):  # type: ignore[no-untyped-def]
    """Fill ``out`` with the curve's parameter at times ``t``, from the index ``begin`` to ``end``."""
    cosines = section(record, COSINES)
    if cosines.size:
        sum_wave(section(record, DIAL), cosines, section(record, SINES), t, out, begin, end)
        return
    kind, table = section(record, FUNCTIONS).view(np.int64)[5], table_of(record)
    clock, dial = section(record, CLOCK), section(record, DIAL)
    a, b, launch, lap = dial[6], dial[7], dial[8], dial[9]
    size = min(BLOCK, end - begin)
    phi, sense, laps = np.empty(size), np.empty(size), np.empty(size)
    for start in range(begin, end, BLOCK):
        n = min(BLOCK, end - start)
        anomalies_at(clock, kind, table, t[start:], n, phi, sense, laps)
        for i in range(n):
            place = place_at(kind, a, b, phi[i]) + laps[i] * lap
            out[start + i] = launch if t[start + i] == 0.0 else place


@Inner
def find_states(record, p, t, out, begin, end):  # type: ignore[no-untyped-def]
    """Fill rows of ``out`` with lam, s, x, z, v, v**2, kappa, normal force and error of lam at some of the times."""
    find_places(record, t, out[0], begin, end)
    bits, shape, launch = section(record, FUNCTIONS).view(np.int64), section(record, SHAPE), section(record, LAUNCH)
    fns, kind = (bits[0], bits[1], bits[2], bits[3], bits[4]), bits[5]
    a, b, ref, w, spread = shape[0], shape[1], shape[2], shape[3], shape[4]
    lam0, v0, lap_length, s0, s_a = launch[0], launch[1], launch[2], launch[3], launch[4]
    late, drift = launch[5], launch[6]
    clock, table, arcs = section(record, CLOCK), table_of(record), section(record, ARCS)
    edges, lengths, length_terms = (
        section(record, EDGES),
        section(record, LENGTHS),
        arcs.reshape((arcs.size // DEGREE, DEGREE)),
    )
    clock_errors, reaches, table_errors = (
        section(record, CLOCK_ERRORS),
        section(record, REACHES),
        section(record, TABLE_ERRORS),
    )
    no_field = np.empty((0, 0))
    way = 1.0 if b > a else -1.0
    size = min(BLOCK, end - begin)
    phi, sense, laps = np.empty(size), np.empty(size), np.empty(size)
    v, reduced, v2 = np.empty(size), np.empty(size), np.empty(size)
    work, rows = np.empty((4, size)), np.empty(5 * size)
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
            panel = panel_of(edges, phi[i])
            part = min(np.searchsorted(reaches, phi[i]), reaches.size - 1)
            rate = fabs(v[i]) / frame[2, i] if frame[2, i] > 0.0 else 0.0
            rounding = ULP * (1.5 * fabs(out[0, start + i] - reduced[i]) + 2.0 * fabs(reduced[i]))
            error = rate * (late + drift * fabs(t[start + i]) + clock_errors[panel])
            out[8, start + i] = error + table_errors[part] + rounding


@entry(types.void(_LINE, _LINE, _LINE, types.int64, types.int64), nogil=True)
def places_along(record, t, out, begin, end):  # type: ignore[no-untyped-def]
    """`find_places`, for Python."""
    find_places(record, t, out, begin, end)


@entry(types.void(_LINE, _LINE, _LINE, _ROWS, types.int64, types.int64), nogil=True)
def states_along(record, p, t, out, begin, end):  # type: ignore[no-untyped-def]
    """`find_states`, for Python."""
    find_states(record, p, t, out, begin, end)


@entry(types.float64(_LINE, types.float64))
def place_at_time(record, t):  # type: ignore[no-untyped-def]
    """The curve's parameter at one time."""
    pair = np.empty(2)
    pair[0] = t
    find_places(record, pair[:1], pair[1:], 0, 1)
    return pair[1]


@entry(_STATE(_LINE, _LINE, types.float64))
def state_at_time(record, p, t):  # type: ignore[no-untyped-def]
    """The time, and what `find_states` says of it."""
    when, out = np.empty(1), np.empty((9, 1))
    when[0] = t
    find_states(record, p, when, out, 0, 1)
    r = out.reshape(-1)
    return t, r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8]
