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
TABLE_ERRORS, OWNERS     the table's, segment by segment; the panel that each segment is of: whole numbers
======================== ===================================================================================
"""

from math import fabs, pi

import numpy as np
from numba import types

from gqm_sym.runtime.arithmetic.doubledouble import ULP, two_sum
from gqm_sym.runtime.arithmetic.elementary import cos, sin
from gqm_sym.runtime.compiled.calls import call_path_and_contact_force
from gqm_sym.runtime.compiled.intrinsics import choose, fma, nearest_whole
from gqm_sym.runtime.compiled.jit import Inlined, Inner, entry
from gqm_sym.runtime.compiled.streaming import put
from gqm_sym.runtime.compiled.types import MATRIX, VECTOR, Array
from gqm_sym.runtime.interface import Addresses
from gqm_sym.runtime.inversion.fourier import sum_wave
from gqm_sym.runtime.inversion.table import TERMS, look_up
from gqm_sym.runtime.quadrature.integrands import TURN_TURN, speeds
from gqm_sym.runtime.quadrature.time_panels import DEGREE, read_off_block

BLOCK = 128
FUNCTIONS, SHAPE, LAUNCH, DIAL, COSINES, SINES, CLOCK = range(7)
MIDDLES, LOWS, SCALES, POWERS, INDEX, ENDS = range(7, 13)
EDGES, LENGTHS, ARCS, CLOCK_ERRORS, TABLE_ERRORS, OWNERS = range(13, 19)
SECTIONS = 19
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
def anomalies_at(clock, kind, table, t, n, phi, sense, laps, work, segments):  # type: ignore[no-untyped-def]
    """The anomaly, the sense of motion along the stretch and the count of laps at n times.

    ``clock`` holds the period, the phase from the stretch's end ``a`` and the whole time by the stretch's own clock,
    each as two doubles, the last anomaly and by how much that clock is fast.
    """
    period, period_low, phase, phase_low = clock[0], clock[1], clock[2], clock[3]
    whole, whole_low, stop, pace = clock[4], clock[5], clock[6], clock[7]
    back, rests, lows = kind == TURN_TURN, work[0], work[1]
    for i in range(n):
        s, low = two_sum(t[i], phase)
        low += phase_low
        count = nearest_whole(s / period)
        # The first is exact: a whole number of last places, and at most half a period.
        r, low = two_sum(fma(-count, period, s), fma(-count, period_low, low))
        before = r + low < 0.0
        sign = choose(before, -1.0, 1.0)
        if back:  # before the end ``a`` it is on its way there; the quotient's rounding may pass the other end
            r, low = sign * r, sign * low
            over = r > 0.5 * period
            other, rest = two_sum(period, -r)
            rest += period_low - low
            sense[i], laps[i] = choose(over, -sign, sign), count
        else:
            over = before
            other, rest = two_sum(period, r)
            rest += period_low + low
            sense[i], laps[i] = 1.0, choose(over, count - 1.0, count)
        rests[i] = choose(over, other, r)
        lows[i] = choose(over, rest, low) + rests[i] * pace
    look_up(*table, rests, lows, n, segments, work[2], phi)
    for i in range(n):
        r, low = rests[i], lows[i]
        inside = min(max(phi[i], 0.0), stop)
        ended = choose((r - whole) + (low - whole_low) >= 0.0, stop, inside)
        phi[i] = choose(r + low <= 0.0, 0.0, ended)


@Inlined
def place_at(kind, a, b, phi):  # type: ignore[no-untyped-def]
    """The curve's parameter at an anomaly, from the nearer end."""
    width = b - a
    if kind == TURN_TURN:
        s, c = sin(0.5 * phi), cos(0.5 * phi)
        return choose(phi < 0.5 * pi, a + width * (s * s), b - width * (c * c))
    return choose(phi <= 0.5, a + width * phi, b - width * (1.0 - phi))


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
    spare, segments = np.empty((3, size)), np.empty(size, dtype=np.int64)
    for start in range(begin, end, BLOCK):
        n = min(BLOCK, end - start)
        anomalies_at(clock, kind, table, t[start:], n, phi, sense, laps, spare, segments)
        for i in range(n):
            place = place_at(kind, a, b, phi[i]) + laps[i] * lap
            out[start + i] = launch if t[start + i] == 0.0 else place


@Inner
def find_states(record, p, t, out, begin, end):  # type: ignore[no-untyped-def]
    """Fill rows of ``out`` with lam, s, x, z, v, v**2, kappa, normal force and error of lam at some of the times."""
    find_places(record, t, out[0], begin, end)
    bits, shape, launch = section(record, FUNCTIONS).view(np.int64), section(record, SHAPE), section(record, LAUNCH)
    fns, kind = Addresses(bits[0], bits[1], bits[2], bits[3], bits[4]), bits[5]
    a, b, ref, w, spread = shape[0], shape[1], shape[2], shape[3], shape[4]
    lam0, v0, lap_length, s0, s_a = launch[0], launch[1], launch[2], launch[3], launch[4]
    late, drift = launch[5], launch[6]
    clock, table, arcs = section(record, CLOCK), table_of(record), section(record, ARCS)
    edges, lengths, length_terms = (
        section(record, EDGES),
        section(record, LENGTHS),
        arcs.reshape((arcs.size // DEGREE, DEGREE)),
    )
    clock_errors, table_errors = section(record, CLOCK_ERRORS), section(record, TABLE_ERRORS)
    owners = section(record, OWNERS).view(np.int64)
    no_field = np.empty((0, 0))
    way = 1.0 if b > a else -1.0
    size = min(BLOCK, end - begin)
    # Arrays of their own would take as long as a time.
    room, whole = np.empty((19, size)), np.empty((2, size), dtype=np.int64)
    phi, sense, laps, v, reduced, v2, arc = room[0], room[1], room[2], room[3], room[4], room[5], room[6]
    spare, work, rows, segments, panels = room[7:10], room[10:14], room[14:19], whole[0], whole[1]
    for start in range(begin, end, BLOCK):
        n = min(BLOCK, end - start)
        anomalies_at(clock, kind, table, t[start:], n, phi, sense, laps, spare, segments)
        # The functions of a generated module see rows of as many numbers as they are told.
        flat, frame = work.reshape(-1)[: 4 * n].reshape(4, n), rows.reshape(-1)[: 5 * n].reshape(5, n)
        speeds(fns, p, kind, a, b, ref, w, no_field, phi[:n], flat, v)
        for i in range(n):
            panels[i] = owners[segments[i]]
        read_off_block(edges, lengths, length_terms, phi, n, panels, spare, arc)
        when, lam = t[start : start + n], out[0, start : start + n]
        for i in range(n):
            launched = when[i] == 0.0
            place, speed = place_at(kind, a, b, phi[i]), v[i] * (way * sense[i] * spread)
            s = (s_a + way * spread * arc[i]) + laps[i] * lap_length
            reduced[i], v[i] = choose(launched, lam0, place), choose(launched, v0, speed)
            v2[i], arc[i] = v[i] * v[i], choose(launched, s0, s + s0)
        call_path_and_contact_force(fns.path_and_contact_force, n, reduced, v2, p, frame)
        for i in range(n):
            ds = frame[2, i]
            rate = choose(ds > 0.0, fabs(v[i]) / ds, 0.0)
            rounding = ULP * (1.5 * fabs(lam[i] - reduced[i]) + 2.0 * fabs(reduced[i]))
            error = rate * (late + drift * fabs(when[i]) + clock_errors[panels[i]])
            spare[0, i] = error + table_errors[segments[i]] + rounding
        found = (arc, frame[0], frame[1], v, v2, frame[3], frame[4], spare[0])
        for k in range(8):
            put(out[k + 1], start, found[k], 0, n, False)


@entry(types.void(VECTOR, VECTOR, VECTOR, types.int64, types.int64), nogil=True)
def places_along(record, t, out, begin, end):  # type: ignore[no-untyped-def]
    """`find_places`, for Python."""
    find_places(record, t, out, begin, end)


@entry(types.void(VECTOR, VECTOR, VECTOR, MATRIX, types.int64, types.int64), nogil=True)
def states_along(record, p, t, out, begin, end):  # type: ignore[no-untyped-def]
    """`find_states`, for Python."""
    find_states(record, p, t, out, begin, end)


@entry(types.float64(VECTOR, types.float64))
def place_at_time(record, t):  # type: ignore[no-untyped-def]
    """The curve's parameter at one time."""
    pair = np.empty(2)
    pair[0] = t
    find_places(record, pair[:1], pair[1:], 0, 1)
    return pair[1]


@entry(_STATE(VECTOR, VECTOR, types.float64))
def state_at_time(record, p, t):  # type: ignore[no-untyped-def]
    """The time, and what `find_states` says of it."""
    when, out = np.empty(1), np.empty((9, 1))
    when[0] = t
    find_states(record, p, when, out, 0, 1)
    r = out.reshape(-1)
    return t, r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8]
