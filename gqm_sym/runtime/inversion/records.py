"""The state of a body at any times of a periodic motion, from the tables of its one segment, in one call from Python.

All data are stored in one *record*, an array of doubles, because passing twenty arrays would take longer than reading
them. A record begins with the positions of its sections; integers are stored by their bits.

======================== ===================================================================================
section                  contents
======================== ===================================================================================
FUNCTIONS                addresses of the module's functions, and the kind of segment: integers
SHAPE                    both ends, a place and V**2 there, the exact width over that of the rounded ends
LAUNCH                   place, signed speed, length of a lap, arc length at launch, and arc length of the end
                         ``a`` measured from the launch; error of the time at launch, and its growth with time
WAVE                     the constants of `fourier.sum_wave`
COSINES, SINES           Fourier coefficients of the place; none where the table is to be used
TIMING                   the constants of `phase_angles_at`
MIDDLES ... ENDS         the table (`table.Table`), which comes with FUNCTIONS and TIMING
EDGES, LENGTHS, ARCS     panels of the arc length: edges, lengths there, and Legendre coefficients
SPEEDS                   Legendre coefficients of the regular factor of the speed on the same panels; none where V**2
                         is computed at each time
TIME_ERRORS              error of the time on each panel
TABLE_ERRORS, OWNERS     error of the table on each of its segments, and the panel of each segment: integers
======================== ===================================================================================
"""

from collections.abc import Mapping
from itertools import accumulate
from math import fabs, inf
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from gqm_sym.runtime.arithmetic.doubledouble import ULP, two_sum
from gqm_sym.runtime.arithmetic.elementary import sin
from gqm_sym.runtime.compiled.calls import call_path_and_contact_force
from gqm_sym.runtime.compiled.intrinsics import choose, fma, nearest_whole
from gqm_sym.runtime.compiled.jit import Inlined, Inner, entry
from gqm_sym.runtime.compiled.streaming import put
from gqm_sym.runtime.compiled.types import MATRIX, VECTOR, Array
from gqm_sym.runtime.interface import Addresses
from gqm_sym.runtime.inversion.fourier import sum_wave
from gqm_sym.runtime.inversion.table import BESIDE_END, TERMS, Table, angle_to_end, look_up
from gqm_sym.runtime.quadrature.integrands import Integrand, fill_speeds
from gqm_sym.runtime.quadrature.lengths import BESIDE_EDGE, length_from_edge
from gqm_sym.runtime.quadrature.substitution import TURN_TURN, place_at, place_on_libration
from gqm_sym.runtime.quadrature.time_panels import DEGREE, sum_block

# The number of times for which states are found together.
BLOCK = 128
FUNCTIONS, SHAPE, LAUNCH, WAVE, COSINES, SINES, TIMING = range(7)
MIDDLES, LOWS, SCALES, POWERS, INDEX, ENDS = range(7, 13)
EDGES, LENGTHS, ARCS, SPEEDS, TIME_ERRORS, TABLE_ERRORS, OWNERS = range(13, 20)
SECTIONS = 20
_STATE = types.UniTuple(types.float64, 11)


class Phases(NamedTuple):
    """The positions of a block of n times on the segment of a periodic motion.

    Attributes
    ----------
    phi : (n,) array
        Phase angles.
    sense : (n,) array
        +1 where the body moves from ``a`` to ``b``, -1 where it moves back.
    laps : (n,) array
        Number of laps, or of periods.
    work : (3, n) array
        Work space.
    segments : (n,) array of int
        The table's segment of each time.
    """

    phi: Any
    sense: Any
    laps: Any
    work: Any
    segments: Any


def record(sections: Mapping[int, Array | NDArray[np.int64]]) -> Array:
    """Return a record of some sections; the others are empty."""
    sizes = [0] * SECTIONS
    for k, contents in sections.items():
        sizes[k] = contents.size
    marks = [*accumulate(sizes, initial=SECTIONS + 1)]
    found = np.empty(marks[-1])
    integers = found.view(np.int64)
    integers[: SECTIONS + 1] = marks
    for k, contents in sections.items():
        (found if contents.dtype.kind == "f" else integers)[marks[k] : marks[k + 1]] = contents.ravel()
    return found


@Inner
def section(record, k):  # type: ignore[no-untyped-def]
    """Return a section of a record."""
    marks = record[k : k + 2].view(np.int64)
    return record[marks[0] : marks[1]]


@Inner
def table_of(record):  # type: ignore[no-untyped-def]
    """Return the table of a record."""
    powers = section(record, POWERS)
    return Table(
        section(record, MIDDLES),
        section(record, LOWS),
        section(record, SCALES),
        powers.reshape((powers.size // TERMS, TERMS)),
        section(record, INDEX).view(np.int64),
        section(record, ENDS),
    )


@Inner
def phase_angles_at(timing, kind, table, t, n, phases):  # type: ignore[no-untyped-def]
    """Fill ``phases`` for n times.

    Parameters
    ----------
    timing : (8,) array
        The period, the time from the end ``a`` to the launch and the duration of the segment, in s and as two doubles
        each; the last phase angle; and the relative correction from the period's time to the segment's time.
    kind : int
        The segment's kind.
    table : Table
        The segment's table.
    t : array
        Times from launch in s, n of them at least.
    phases : Phases
        What is filled.
    """
    phi, sense, laps, work, segments = phases
    period, period_low, phase, phase_low = timing[0], timing[1], timing[2], timing[3]
    duration, duration_low, stop, correction = timing[4], timing[5], timing[6], timing[7]
    is_libration, times, lows = kind == TURN_TURN, work[0], work[1]
    for i in range(n):
        s, low = two_sum(t[i], phase)
        low += phase_low
        count = nearest_whole(s / period)
        # The first product is exact: a multiple of the last place, and at most half a period.
        r, low = two_sum(fma(-count, period, s), fma(-count, period_low, low))
        before = r + low < 0.0
        sign = choose(before, -1.0, 1.0)
        # Before the body reaches ``a``, it is on its way back to it. The rounded quotient may lie beyond the other end.
        if is_libration:
            r, low = sign * r, sign * low
            over = r > 0.5 * period
            other, other_low = two_sum(period, -r)
            other_low += period_low - low
            sense[i], laps[i] = choose(over, -sign, sign), count
        else:
            over = before
            other, other_low = two_sum(period, r)
            other_low += period_low + low
            sense[i], laps[i] = 1.0, choose(over, count - 1.0, count)
        times[i] = choose(over, other, r)
        lows[i] = choose(over, other_low, low) + times[i] * correction
    look_up(table, times, lows, n, segments, phi)
    for i in range(n):
        r, low = times[i], lows[i]
        inside = min(max(phi[i], 0.0), stop)
        clipped = choose((r - duration) + (low - duration_low) >= 0.0, stop, inside)
        phi[i] = choose(r + low <= 0.0, 0.0, clipped)


@Inner
def find_places(record, t, out, begin, end):  # type: ignore[no-untyped-def]
    """Fill ``out`` with the curve's parameter at times ``t``, from the index ``begin`` to ``end``."""
    cosines = section(record, COSINES)
    if cosines.size:
        sum_wave(section(record, WAVE), cosines, section(record, SINES), t, out, begin, end)
        return
    kind, table = section(record, FUNCTIONS).view(np.int64)[5], table_of(record)
    timing, wave = section(record, TIMING), section(record, WAVE)
    a, b, launch, lap = wave[6], wave[7], wave[8], wave[9]
    size = min(BLOCK, end - begin)
    phi, laps = np.empty(size), np.empty(size)
    phases = Phases(phi, np.empty(size), laps, np.empty((3, size)), np.empty(size, dtype=np.int64))
    for start in range(begin, end, BLOCK):
        n = min(BLOCK, end - start)
        phase_angles_at(timing, kind, table, t[start:], n, phases)
        if kind == TURN_TURN:
            for i in range(n):
                out[start + i] = choose(t[start + i] == 0.0, launch, place_on_libration(a, b, phi[i]))
        else:
            for i in range(n):
                place = place_at(kind, a, b, phi[i]) + laps[i] * lap
                out[start + i] = choose(t[start + i] == 0.0, launch, place)


@Inlined
def error_of_place(lam, in_lap, v, ds, time_error, table_error):  # type: ignore[no-untyped-def]
    """Return the bound on the error of a curve parameter, from the errors of the time and of the table, and from its
    rounding.
    """
    rate = choose(ds > 0.0, fabs(v) / ds, 0.0)
    of_time = choose(time_error < inf, rate * time_error, inf)  # if the time is unknown, so is the place of rest
    return of_time + table_error + ULP * (1.5 * fabs(lam - in_lap) + 2.0 * fabs(in_lap))


@Inner
def fill_motion(record, p, t, n, phases, panels, work, found):  # type: ignore[no-untyped-def]
    """Fill the phases at n times, the panels of the phase angles, and rows of the place within the lap, of the velocity
    and of its square.

    ``work`` is an array of 4 rows of n numbers at least.
    """
    bits, shape, launch = section(record, FUNCTIONS).view(np.int64), section(record, SHAPE), section(record, LAUNCH)
    fns, kind = Addresses(bits[0], bits[1], bits[2], bits[3], bits[4]), bits[5]
    a, b, ref, w0, width_ratio = shape[0], shape[1], shape[2], shape[3], shape[4]
    integrand = Integrand(fns, p, kind, a, b, ref, w0, np.empty((0, 0)))
    direction, (reduced, v, v2) = 1.0 if b > a else -1.0, (found[0], found[1], found[2])
    phase_angles_at(section(record, TIMING), kind, table_of(record), t, n, phases)
    owners, speeds = section(record, OWNERS).view(np.int64), section(record, SPEEDS)
    for i in range(n):
        panels[i] = owners[phases.segments[i]]
    if speeds.size:
        sum_block(section(record, EDGES), speeds.reshape((-1, DEGREE)), phases.phi, n, panels, work, v)
        for i in range(n):
            v[i] *= sin(phases.phi[i]) if kind == TURN_TURN else 1.0
    else:
        # The functions of a generated module take rows of exactly n numbers.
        fill_speeds(integrand, phases.phi[:n], work.reshape(-1)[: 4 * n].reshape(4, n), v)
    if kind == TURN_TURN:
        table, timing = table_of(record), section(record, TIMING)
        for i in range(n):
            if phases.phi[i] > BESIDE_END:
                left = (timing[4] - phases.work[0, i]) + (timing[5] - phases.work[1, i])
                to_end = phases.work[2, i] = angle_to_end(table.scales, table.powers, left, phases.phi[i])
                v[i] *= sin(to_end) / sin(phases.phi[i])
    for i in range(n):
        launched = t[i] == 0.0
        place, speed = place_at(kind, a, b, phases.phi[i]), v[i] * (direction * phases.sense[i] * width_ratio)
        reduced[i], v[i] = choose(launched, launch[0], place), choose(launched, launch[1], speed)
        v2[i] = v[i] * v[i]


@Inner
def find_states(record, p, t, out, begin, end):  # type: ignore[no-untyped-def]
    """Fill ``out`` with states at the times from the index ``begin`` to ``end``.

    Parameters
    ----------
    record : array
        The motion's record.
    p : array
        Run-time parameters.
    t : (n,) array
        Times from launch in s.
    out : (9, n) or (10, n) array
        Its rows are filled with lam, s, x, z, v, v**2, kappa, N/m and the error of lam, in SI units; a tenth one with
        the place within the lap.
    """
    find_places(record, t, out[0], begin, end)
    shape, launch, address = (
        section(record, SHAPE),
        section(record, LAUNCH),
        section(record, FUNCTIONS).view(np.int64)[0],
    )
    width_ratio, lap_length, s0, s_a = shape[4], launch[2], launch[3], launch[4]
    time_error, drift = launch[5], launch[6]
    arcs = section(record, ARCS)
    edges, lengths, length_terms = (
        section(record, EDGES),
        section(record, LENGTHS),
        arcs.reshape((arcs.size // DEGREE, DEGREE)),
    )
    time_errors, table_errors = section(record, TIME_ERRORS), section(record, TABLE_ERRORS)
    scale = width_ratio if shape[1] > shape[0] else -width_ratio
    turns = section(record, FUNCTIONS).view(np.int64)[5] == TURN_TURN
    first, last = BESIDE_EDGE * 0.5 * edges[1], edges[-1] - BESIDE_EDGE * 0.5 * (edges[-1] - edges[-2])
    size = min(BLOCK, end - begin)
    # Two arrays serve as all work space, because making an array for each row would take as long as finding the state
    # at one time.
    buffer, indices = np.empty((19, size)), np.empty((2, size), dtype=np.int64)
    phi, sense, laps, motion, arc = buffer[0], buffer[1], buffer[2], buffer[3:6], buffer[6]
    reduced, v, v2 = motion[0], motion[1], motion[2]
    spare, work, rows, segments, panels = buffer[7:10], buffer[10:14], buffer[14:19], indices[0], indices[1]
    phases = Phases(phi, sense, laps, spare, segments)
    for start in range(begin, end, BLOCK):
        n = min(BLOCK, end - start)
        block, lam = t[start : start + n], out[0, start : start + n]
        fill_motion(record, p, block, n, phases, panels, work, motion)
        sum_block(edges, length_terms, phi, n, panels, work, arc)
        for i in range(n):
            edge, part = panels[i], arc[i]
            if turns and not first <= phi[i] <= last:
                edge, part = length_from_edge(edges, length_terms, edge, phi[i], spare[2, i], (turns, turns))
            s = ((s_a + scale * lengths[edge]) + scale * part) + laps[i] * lap_length
            arc[i] = choose(block[i] == 0.0, s0, s + s0)
        frame = rows.reshape(-1)[: 5 * n].reshape(5, n)
        call_path_and_contact_force(address, n, reduced, v2, p, frame)
        for i in range(n):
            of_time = time_error + drift * fabs(block[i]) + time_errors[panels[i]]
            spare[0, i] = error_of_place(lam[i], reduced[i], v[i], frame[2, i], of_time, table_errors[segments[i]])
        found = (arc, frame[0], frame[1], v, v2, frame[3], frame[4], spare[0])
        for k in range(8):
            put(out[k + 1], start, found[k], 0, n, False)
        if out.shape[0] > 9:
            put(out[9], start, reduced, 0, n, False)


@Inner
def find_phases(record, p, t, out):  # type: ignore[no-untyped-def]
    """Fill rows for times: the phase angle, the velocity, and the sign of the change of the phase angle with time.

    The next rows are the number of half periods (or laps) before the phase, the number of periods, and the place within
    the lap. The half periods are counted from the segment's end ``a``.
    """
    kind, timing = section(record, FUNCTIONS).view(np.int64)[5], section(record, TIMING)
    size = min(BLOCK, t.size)
    buffer, indices = np.empty((13, size)), np.empty((2, size), dtype=np.int64)
    motion, spare = buffer[3:6], buffer[6:9]
    phases = Phases(buffer[0], buffer[1], buffer[2], spare, indices[0])
    for start in range(0, t.size, BLOCK):
        n = min(BLOCK, t.size - start)
        block = t[start : start + n]
        fill_motion(record, p, block, n, phases, indices[1], buffer[9:13], motion)
        for i in range(n):
            turns = phases.laps[i]
            if kind == TURN_TURN:
                turns = 2.0 * nearest_whole((block[i] + timing[2] - phases.sense[i] * spare[0, i]) / timing[0])
            found = (phases.phi[i], motion[1, i], phases.sense[i], turns, phases.laps[i], motion[0, i])
            for k in range(6):
                out[k, start + i] = found[k]


@entry(types.void(VECTOR, VECTOR, VECTOR, MATRIX))
def phases_along(record, p, t, out):  # type: ignore[no-untyped-def]
    """Call `find_phases` from Python."""
    find_phases(record, p, t, out)


@entry(types.void(VECTOR, VECTOR, VECTOR, types.int64, types.int64), nogil=True)
def places_along(record, t, out, begin, end):  # type: ignore[no-untyped-def]
    """Call `find_places` from Python."""
    find_places(record, t, out, begin, end)


@entry(types.void(VECTOR, VECTOR, VECTOR, MATRIX, types.int64, types.int64), nogil=True)
def states_along(record, p, t, out, begin, end):  # type: ignore[no-untyped-def]
    """Call `find_states` from Python."""
    find_states(record, p, t, out, begin, end)


@entry(types.float64(VECTOR, types.float64))
def place_at_time(record, t):  # type: ignore[no-untyped-def]
    """Return the curve parameter at one time."""
    pair = np.empty(2)
    pair[0] = t
    find_places(record, pair[:1], pair[1:], 0, 1)
    return pair[1]


@entry(_STATE(VECTOR, VECTOR, types.float64))
def state_at_time(record, p, t):  # type: ignore[no-untyped-def]
    """Return the time, and the ten numbers of `find_states` at it."""
    when, out = np.empty(1), np.empty((10, 1))
    when[0] = t
    find_states(record, p, when, out, 0, 1)
    r = out.reshape(-1)
    return t, r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8], r[9]
