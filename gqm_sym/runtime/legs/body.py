"""A body on its way along the curve: one line of numbers that compiled code reads and rewrites leg after leg.

===================== ===========================================================================================
number                meaning
===================== ===========================================================================================
LAM0                  the launch place
LOW, HIGH, PERIOD     the range of the curve parameter; the period is 0 on an open curve
PREFERRED             the direction of the launch, which a body released on a ridge takes
ONLY_SIGN             the only sign that N can have; 0 if it can have both
HORIZON               the time at which the motion ends at the latest, infinite if there is none
TARGET                the place whose time of arrival is asked for
V2                    V**2 where the body is
===================== ===========================================================================================

These are set at the launch, as by `launched`; all other numbers are zero until the first leg.

===================== ===========================================================================================
number                meaning
===================== ===========================================================================================
PLACE, PLACE_LOW      the place, as two doubles, within one lap
LAPS                  the whole laps before it
DIRECTION             the sign of dlam/dt of the next leg; 0 if the body stays where it is
CONTACT_SIGN, STEP,   as of `runs.route.Start`
NO_TURN_UNTIL
FIRST_STEP            the step of a search along the curve (`launch.ends.first_step`)
REACH                 on a curve without ends, the distance after which a run pauses or, by kept data, ends
ELAPSED, ELAPSED_LOW  the time from launch, as two doubles
LEG_TIME              the time since the last turn
LAST_LEG, LEG_BEFORE  the times of the last leg from turn to turn, and of the one before it; 0 if there was none
LAST_WIDTH,           the distances in the curve parameter from turn to turn of the last leg, and of the one before it;
WIDTH_BEFORE          0 if there was none
UNRESOLVED, ..._2,    that of the last leg that was not one polynomial with so many blocks (`runs.whole_tables`); 0 if
..._3                 the last one was
TURNS, PAUSES         how often the body has turned, and how many runs without an end have paused since
EARLY_WIDTH           the distance in the curve parameter between the first two turns; 0 if it is not known
MAY_END               whether the motion may end after the last turn without a horizon (`advance.may_end`); 1 before the
                      first turn
FROM_REST             1 if the launch was from rest
ENDING                the code of what has ended the motion (`advance`), or 0
PANEL_COUNT           how many panels the records of the legs had, with one more for each (counted for `solve`)
LEAST_SIZE            a size of places below which their roundings do not decrease; 0 on a curve with formulas
RETRY_WIDTH           the width of a leg below which the body may be followed by its distance from an equilibrium, as it
                      could not on a wider one; 0 if that was not tried
TOTAL, LAST_AT        how many elements the records of the last call take, and where the last of them begins (counted
                      for `solve`)
BRANCH, BRANCH_HEIGHT the branch point of ds that the last leg passed by (`runs.leg_variable`)
KINKS                 the beginning of what is known of kinks of the law (`kinks.places`)
VALUE, STATUS         the quantity that was asked for, and whether it has a value (`answers`)
===================== ===========================================================================================
"""

from collections.abc import Sequence

import numpy as np

from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.legs.kinks.places import ROOM_FOR_KINKS

LAM0, LOW, HIGH, PERIOD, PREFERRED, ONLY_SIGN, HORIZON, TARGET, V2 = range(9)
PLACE, PLACE_LOW, LAPS, DIRECTION, CONTACT_SIGN, STEP, NO_TURN_UNTIL, FIRST_STEP, REACH = range(9, 18)
ELAPSED, ELAPSED_LOW, LEG_TIME, LAST_LEG, LEG_BEFORE, TURNS, PAUSES, MAY_END = range(18, 26)
LAST_WIDTH, WIDTH_BEFORE, FROM_REST, ENDING, PANEL_COUNT, LEAST_SIZE, VALUE, STATUS = range(26, 34)
UNRESOLVED, UNRESOLVED_2, UNRESOLVED_3, TOTAL, LAST_AT, BRANCH, BRANCH_HEIGHT, RETRY_WIDTH = range(34, 42)
EARLY_WIDTH, KINKS = 42, 43
SIZE = KINKS + ROOM_FOR_KINKS

# A swing about an equilibrium at 0 has died away when it is so small that V**2 and its errors approach the smallest
# doubles.
LEAST_SWING = 1e-110


def launched(given: Sequence[Sequence[float]] | Array, lines: int = 0) -> Array:
    """Return bodies at their launch.

    Parameters
    ----------
    given : (n, PLACE) array or sequence of sequences
        LAM0 to V2 of each body.
    lines : int
        The number of additional lines.

    Returns
    -------
    (n + lines, SIZE) array
    """
    bodies = np.zeros((len(given) + lines, SIZE))
    bodies[: len(given), :PLACE] = given
    return bodies
