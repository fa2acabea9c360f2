"""The record of a leg: one line of numbers that compiled code fills, and Python reads when it is needed.

==================== ============================================================================================
number               meaning
==================== ============================================================================================
START, START_LOW     where the leg begins, as two doubles within one lap
START_V2             V**2 there
LAPS_BEFORE          the whole laps before it
HEADING              the sign of dlam/dt
BEGIN, BEGIN_LOW     the time from launch at which it begins, as two doubles
END, END_LOW         where the leg ends, as two doubles
MIDDLE, MIDDLE_LOW   the place up to which time is counted from the start, as two doubles
HALF_C               c/2 of the march variable (`panels.equation.March`); inf where it is the distance itself
TIME_FROM_START      the time from the start to the middle
TIME_FROM_END        the time from the middle to a turn
CHANGE_COUNT         how often N changes sign
WHOLE                0; or, if the record has no panels but rows of the whole leg from HEAD on, their form
                     (`runs.whole_tables`). The rows are, as far as they are read, the coefficients of the
                     time per phase angle, V**2, and N per mass. Where panels are read, they are those of
                     `runs.whole_panels`
WHOLE_WIDTH          the width of a leg with rows from which panels can be made, or along which places of extremes are
                     located; else 0
RISING, FALLING,     of the variable of a leg with rows (`runs.leg_variable.LegVariable`)
EXTENT
AHEAD, BACK          how many panels there are from the start, and how many panels or rows of a field from the end; if
                     there are rows, both are ROWS_COUNT_AS
USED                 the number of elements of a record of a solved motion that other legs follow
from HEAD on         the panels from the start; after them what was followed back from the end: panels from a turn, or
                     the field next to an equilibrium
at the end           the places at which N changes sign, the first one last
==================== ============================================================================================

A panel is a row of COLUMNS numbers. It has, at its nodes, the rates of time and of arc length, Y, and the contact force
per mass (from NORMAL_LOAD on). After each of the first three there is one more number: RIGHT (the march variable at the
panel's end), TIME, and TIME_ERROR (the error of the time). The last number is INHERITED (`leg_errors`). A panel that
was passed by the data kept of a gap (`gaps.passing`) has its nodes in terms of distance, V in place of Y, no rates, and
TIME_ERROR = NO_RATES; with NO_VALUES it has RIGHT and TIME alone. A leg past kinks (`kinks.parts`) has one panel
like the latter, or with TIME_ERROR = KNOWN_PEAK and the peak that is read in place of Y.

A row of the field of V**2 next to an equilibrium has FIELD_COLUMNS numbers: the distances from the equilibrium between
which it holds, and the Chebyshev coefficients of V**2/d**2 and of ds/dlam there (`quadrature.equilibrium` reads them).
"""

from gqm_sym.runtime.arithmetic.doubledouble import two_sum
from gqm_sym.runtime.compiled.jit import Inlined, Inner
from gqm_sym.runtime.legs.panels.equation import (
    ARC_RATE,
    KAPPA,
    MEAN,
    N0,
    SPEED,
    TAILS,
    TIME_RATE,
    W,
    copy,
    load_per_mass_row,
)
from gqm_sym.runtime.legs.panels.polynomials import COUNT, WIDE, to_tails
from gqm_sym.runtime.legs.panels.resolution import tail_of
from gqm_sym.runtime.legs.runs.whole_tables import blocks_of

START, START_LOW, START_V2, LAPS_BEFORE, HEADING, BEGIN, BEGIN_LOW = range(7)
END, END_LOW, MIDDLE, MIDDLE_LOW, HALF_C, TIME_FROM_START, TIME_FROM_END, CHANGE_COUNT = range(7, 15)
WHOLE, WHOLE_WIDTH, RISING, FALLING, EXTENT, AHEAD, BACK, USED, HEAD = range(15, 24)

# The data that are read from a record (`runs.route.Reading`): the times and places between which the leg runs; also the
# place at the last time; the largest or smallest speed or contact force; the time at which the body passes a place;
# everything that panels contain; or that for a leg which is followed in a way that gives it, else PLACES.
TIMES, PLACES, PEAKS, PASSAGE, PANELS, ROWS = range(6)

COLUMNS = 4 * WIDE
MAX_ROWS, ROWS_COUNT_AS = 4, 2
RIGHT, TIME, TIME_ERROR = range(COUNT, 3 * WIDE, WIDE)
Y_ROW, NORMAL_LOAD, INHERITED = 2 * WIDE, 3 * WIDE, 3 * WIDE + COUNT
FIELD_COLUMNS = 2 + 2 * COUNT
NO_RATES, NO_VALUES, KNOWN_PEAK = -1.0, -2.0, -3.0


@Inlined
def has_space(record, used, change_count):  # type: ignore[no-untyped-def]
    """Return whether the record has space for one more panel and one more change of sign."""
    return used + COLUMNS + change_count < record.size


@Inlined
def change_at(record, k):  # type: ignore[no-untyped-def]
    """Return the index of the k-th change of N's sign in a record."""
    return record.size - 1 - k


@Inner
def add_panel(record, at, right, width, work):  # type: ignore[no-untyped-def]
    """Write a panel that ends at w = ``right`` into the record, from ``at`` on."""
    to_tails(work, TIME_RATE, work, TAILS)
    copy(record, at, work, TIME_RATE)
    copy(record, at + WIDE, work, ARC_RATE)
    copy(record, at + Y_ROW, work, SPEED)
    load_per_mass_row(work, MEAN, N0, KAPPA, W)
    copy(record, at + NORMAL_LOAD, work, MEAN)
    record[at + RIGHT] = right
    record[at + TIME], record[at + TIME_ERROR] = width * work[TAILS + 6], width * tail_of(work)


@Inner
def total_time(record, begin, count):  # type: ignore[no-untyped-def]
    """Return the time on ``count`` panels, the first of which is at ``begin`` in the record."""
    high, low = 0.0, 0.0
    for k in range(count):
        high, rounding = two_sum(high, record[begin + k * COLUMNS + TIME])
        low += rounding
    return high + low


@Inner
def pack(record):  # type: ignore[no-untyped-def]
    """Move the changes of N's sign on a leg that turns directly behind its rows or panels, and set USED."""
    changes, wide = int(record[CHANGE_COUNT]), blocks_of(int(record[WHOLE])) * WIDE
    used = HEAD + (MAX_ROWS * wide if wide > 0 else int(record[AHEAD] + record[BACK]) * COLUMNS)
    for k in range(changes):
        record[used + k] = record[record.size - changes + k]
    record[USED] = used + changes
