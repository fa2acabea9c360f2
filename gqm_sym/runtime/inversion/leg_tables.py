"""The state of a body at any times on a trajectory of many segments, in one call from Python.

The data of all segments are stored in one record (`records.record`), because passing many arrays would take longer than
reading them. The segments are of all kinds but FROM_SLOW and FROM_SLOW_TURN (`quadrature.substitution`), and have
polynomials for the phase angle over time (`table`), and for arc length and speed over the phase angle. The intervals of
time follow each other, beginning at launch.

=================== ========================================================================================
section             contents
=================== ========================================================================================
FUNCTION            address of the module's `path_and_contact_force`: an integer
LAUNCH              place, signed speed and arc length at launch; the time in s up to which the record holds
SLOTS               the first interval of each of many equal parts of that time: integers
INTERVALS           a row for each interval, by which places are found
STATES              a row for each interval, by which the rest of the state is found
PANELS              a row for each panel: edge, half width, arc length there, and the series of arc length and speed
=================== ========================================================================================
"""

import numpy as np
from numba import types

from gqm_sym.runtime.arithmetic.clenshaw import growth_beside_rest, legendre_growth, legendre_sum
from gqm_sym.runtime.arithmetic.elementary import cos, exp, sin
from gqm_sym.runtime.compiled.calls import call_path_and_contact_force
from gqm_sym.runtime.compiled.intrinsics import choose, fma, item_at
from gqm_sym.runtime.compiled.jit import Inlined, Inner, entry
from gqm_sym.runtime.compiled.types import MATRIX, VECTOR
from gqm_sym.runtime.inversion.records import error_of_place, section
from gqm_sym.runtime.inversion.table import LAST, TERMS
from gqm_sym.runtime.quadrature.lengths import BESIDE_EDGE
from gqm_sym.runtime.quadrature.substitution import TO_EQUILIBRIUM, TURN_TURN

FUNCTION, LAUNCH, SLOTS, INTERVALS, STATES, PANELS = range(6)

# Columns of an interval: its end; its middle as two doubles, and one over half its length; the last phase angle phi;
# the kind of the segment; for the kinds FROM_TURN and REGULAR the coefficients of the share of the segment,
# phi (phi SQUARE + LINEAR); both ends of the segment, as two doubles, and its width; the increase of the place by whole
# laps; and the coefficients of phi in powers of time.
UNTIL, MIDDLE, MIDDLE_LOW, SCALE, STOP, KIND, SQUARE, LINEAR = range(8)
PLACE_A, PLACE_A_LOW, PLACE_B, PLACE_B_LOW, WIDTH, LAPS, POWERS = range(8, 15)
INTERVAL_COLUMNS = POWERS + TERMS

# Columns of a state: its panel; the sign of dlam/dphi, and that of dlam/dt; the arc length at the end ``a``; the
# coefficients of the speed, which is Y (GROWTH phi + FIRST_GROWTH), but Y sin(phi) between two turning points and
# Y exp(-phi) towards an equilibrium; and the errors of the time and of the place.
PANEL, DIRECTION, HEADING, ARC_A, GROWTH, FIRST_GROWTH, TIME_ERROR, PLACE_ERROR, STATE_COLUMNS = range(9)

# Columns of a panel; the two series have WIDE terms each.
EDGE, HALF, ARC, SERIES = range(4)
WIDE = 24
PANEL_COLUMNS = SERIES + 2 * WIDE

# A phase angle whose relative distance from the last one is below this is the last one.
ROUNDED = 4e-16

# A time is at most this many half lengths from the middle of its interval. It is further away where the rounding of the
# time is longer than the interval, as beside a cusp, and polynomials have no meaning there.
FARTHEST = 1.0 + 2.0**-10

# The number of states that are found together.
BLOCK = 64


@Inlined
def interval_at(intervals, slots, rate, t):  # type: ignore[no-untyped-def]
    """Return the index at which the row of the interval that contains a time begins."""
    # If the motion ends where it begins the rate is infinite: the first slot is then read at the launch, else the last.
    slot = choose(t > 0.0, min(slots.size - 1.0, t * rate), 0.0)
    at, last = item_at(slots, np.int64(slot)), intervals.size - INTERVAL_COLUMNS
    while at < last and t >= item_at(intervals, at + UNTIL):
        at += INTERVAL_COLUMNS
    return at


@Inlined
def phase_angle_at(intervals, at, t):  # type: ignore[no-untyped-def]
    """Return the phase angle at a time on the interval whose row begins at an index."""
    x = (t - item_at(intervals, at + MIDDLE)) - item_at(intervals, at + MIDDLE_LOW)
    x = min(max(x * item_at(intervals, at + SCALE), -FARTHEST), FARTHEST)
    phi, stop = item_at(intervals, at + POWERS + LAST), item_at(intervals, at + STOP)
    for m in range(LAST - 1, -1, -1):
        phi = fma(phi, x, item_at(intervals, at + POWERS + m))
    return choose(stop - phi <= ROUNDED * stop, stop, max(phi, 0.0))


@Inlined
def place_at(intervals, at, phi):  # type: ignore[no-untyped-def]
    """Return the curve parameter within a lap at a phase angle, from the nearer end."""
    kind = item_at(intervals, at + KIND)
    if kind == TO_EQUILIBRIUM:
        rest = exp(-phi)
        share = 1.0 - rest
    elif kind == TURN_TURN:
        s, c = sin(0.5 * phi), cos(0.5 * phi)
        share, rest = s * s, c * c
    else:
        share = phi * fma(phi, item_at(intervals, at + SQUARE), item_at(intervals, at + LINEAR))
        rest = 1.0 - share
    width, low_a = item_at(intervals, at + WIDTH), item_at(intervals, at + PLACE_A_LOW)
    low_b = item_at(intervals, at + PLACE_B_LOW)
    from_a = item_at(intervals, at + PLACE_A) + fma(width, share, low_a)
    to_b = item_at(intervals, at + PLACE_B) - fma(width, rest, -low_b)
    return choose(share <= 0.5, from_a, to_b)


@Inlined
def speed_at(states, panels, kind, of, phi):  # type: ignore[no-untyped-def]
    """Return the index of the panel of a phase angle, the place on it from 0 to 2, and the speed there.

    ``kind`` is that of the segment, and ``of`` the index at which the state of its interval begins.
    """
    panel = np.int64(states[of + PANEL]) * PANEL_COLUMNS
    x = (phi - panels[panel + EDGE]) / panels[panel + HALF]
    speed = legendre_sum(panels[panel + SERIES + WIDE : panel + SERIES + 2 * WIDE], x - 1.0)
    growth = fma(states[of + GROWTH], phi, states[of + FIRST_GROWTH])
    if kind == TO_EQUILIBRIUM:
        growth = exp(-phi)
    elif kind == TURN_TURN:
        growth = sin(phi)
    return panel, x, speed * growth


@Inner
def find_places(record, t, out, begin, end):  # type: ignore[no-untyped-def]
    """Fill ``out`` with the curve parameter at times, from the index ``begin`` to ``end``."""
    intervals, slots, launch = (
        section(record, INTERVALS),
        section(record, SLOTS).view(np.int64),
        section(record, LAUNCH),
    )
    lam0, rate = launch[0], (slots.size - 1) / launch[3]
    for i in range(begin, end):
        time = t[i]
        at = interval_at(intervals, slots, rate, time)
        place = place_at(intervals, at, phase_angle_at(intervals, at, time)) + item_at(intervals, at + LAPS)
        out[i] = choose(time == 0.0, lam0, place)


@Inner
def find_states(record, p, t, out, begin, end):  # type: ignore[no-untyped-def]
    """Fill the rows of ``out`` with lam, s, x, z, v, v**2, kappa, N/m and the error of lam, as `find_places`; a tenth
    one with the place within the lap.
    """
    intervals, slots, launch = (
        section(record, INTERVALS),
        section(record, SLOTS).view(np.int64),
        section(record, LAUNCH),
    )
    states, panels = section(record, STATES), section(record, PANELS)
    address, rate = section(record, FUNCTION).view(np.int64)[0], (slots.size - 1) / launch[3]
    size = min(BLOCK, end - begin)
    rows = np.empty(9 * size)
    for start in range(begin, end, BLOCK):
        n = min(BLOCK, end - start)
        for i in range(n):
            time, j = t[start + i], start + i
            launched, at = time == 0.0, interval_at(intervals, slots, rate, time)
            phi, of = phase_angle_at(intervals, at, time), at // INTERVAL_COLUMNS * STATE_COLUMNS
            panel, x, speed = speed_at(states, panels, item_at(intervals, at + KIND), of, phi)
            arc, terms = panels[panel + ARC], panels[panel + SERIES : panel + SERIES + WIDE]
            if x < BESIDE_EDGE and panels[panel + EDGE] == 0.0 and states[of + FIRST_GROWTH] == 0.0:
                arc += growth_beside_rest(terms, x, 1.0)
            else:
                arc += legendre_growth(terms, x)
            place = choose(launched, launch[0], place_at(intervals, at, phi))
            v = choose(launched, launch[1], states[of + HEADING] * speed)
            lam = choose(launched, place, place + item_at(intervals, at + LAPS))
            rows[i], rows[n + i] = place, v * v
            rows[7 * n + i], rows[8 * n + i] = states[of + TIME_ERROR], states[of + PLACE_ERROR]
            out[0, j], out[4, j], out[5, j] = lam, v, v * v
            out[1, j] = launch[2] + choose(launched, 0.0, states[of + ARC_A] + states[of + DIRECTION] * arc)
        frame = rows[2 * n : 7 * n].reshape((5, n))
        call_path_and_contact_force(address, n, rows, rows[n:], p, frame)
        for i in range(n):
            j, time_error, place_error = start + i, rows[7 * n + i], rows[8 * n + i]
            out[2, j], out[3, j], out[6, j], out[7, j] = frame[0, i], frame[1, i], frame[3, i], frame[4, i]
            out[8, j] = error_of_place(out[0, j], rows[i], out[4, j], frame[2, i], time_error, place_error)
            if out.shape[0] > 9:
                out[9, j] = rows[i]


@entry(types.void(VECTOR, VECTOR, VECTOR, types.int64, types.int64), nogil=True)
def places_along_legs(record, t, out, begin, end):  # type: ignore[no-untyped-def]
    """Call `find_places` from Python."""
    find_places(record, t, out, begin, end)


@entry(types.void(VECTOR, VECTOR, VECTOR, MATRIX, types.int64, types.int64), nogil=True)
def states_along_legs(record, p, t, out, begin, end):  # type: ignore[no-untyped-def]
    """Call `find_states` from Python."""
    find_states(record, p, t, out, begin, end)


@entry(types.float64(VECTOR, types.float64))
def place_on_leg(record, t):  # type: ignore[no-untyped-def]
    """Return the curve parameter at one time."""
    pair = np.empty(2)
    pair[0] = t
    find_places(record, pair[:1], pair[1:], 0, 1)
    return pair[1]


@entry(types.UniTuple(types.float64, 11)(VECTOR, VECTOR, types.float64))
def state_on_leg(record, p, t):  # type: ignore[no-untyped-def]
    """Return the time, and the ten numbers of `find_states` at it."""
    when, out = np.empty(1), np.empty((10, 1))
    when[0] = t
    find_states(record, p, when, out, 0, 1)
    r = out.reshape(-1)
    return t, r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8], r[9]


@entry(types.void(VECTOR, VECTOR, MATRIX))
def phases_along_legs(record, t, out):  # type: ignore[no-untyped-def]
    """Fill rows for times: the number of the interval, the phase angle, and the velocity."""
    intervals, slots, launch = (
        section(record, INTERVALS),
        section(record, SLOTS).view(np.int64),
        section(record, LAUNCH),
    )
    states, panels, rate = section(record, STATES), section(record, PANELS), (slots.size - 1) / launch[3]
    for i in range(t.size):
        at = interval_at(intervals, slots, rate, t[i])
        number, phi = at // INTERVAL_COLUMNS, phase_angle_at(intervals, at, t[i])
        of = number * STATE_COLUMNS
        v = states[of + HEADING] * speed_at(states, panels, item_at(intervals, at + KIND), of, phi)[2]
        out[0, i], out[1, i], out[2, i] = number, phi, choose(t[i] == 0.0, launch[1], v)
