"""Bodies driven along the curve by compiled code: a few legs of one body, or one number for each of many."""

from math import inf
from typing import NamedTuple

import numpy as np
from numba import types

from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.registers import borrowed
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, VECTOR, Array
from gqm_sym.runtime.interface import Dissipation
from gqm_sym.runtime.legs.advance import (
    DISSIPATION,
    END_OUT_OF_DOMAIN,
    END_OVERFLOW,
    END_REST,
    NO_NUMBERS,
    Joints,
    advance,
    launch,
    room_ahead,
)
from gqm_sym.runtime.legs.body import (
    DIRECTION,
    ELAPSED,
    ENDING,
    HORIZON,
    LAM0,
    LAST_AT,
    LEG_BEFORE,
    PANEL_COUNT,
    RETRY_WIDTH,
    SIZE,
    STATUS,
    STEP,
    TARGET,
    TOTAL,
    VALUE,
)
from gqm_sym.runtime.legs.frames.local_frame import distance_of_search, may_be_small
from gqm_sym.runtime.legs.frames.tiny_legs import is_tiny, slides_little
from gqm_sym.runtime.legs.gaps.data import forget
from gqm_sym.runtime.legs.gaps.rooms import room_for
from gqm_sym.runtime.legs.leg_record import AHEAD, BACK, PANELS, PASSAGE, PEAKS, PLACES, ROWS, TIMES, USED, pack
from gqm_sym.runtime.legs.questions import (
    ARRIVAL,
    FIRST_LEGS,
    FOUND,
    LEAST_LOAD,
    LEAST_SPEED,
    LEFT,
    LEGS,
    MOST_SPEED,
    MOST_TURNS,
    NEAR,
    REST_PLACE,
    RUN_AGAIN,
    Findings,
    after_leg,
    at_rest,
    conclude,
    conclude_at_rest,
    fits,
    force_is_unbounded,
    goes_on,
    has_passed,
    sought_extreme,
)
from gqm_sym.runtime.legs.runs.ends import END_LIMIT, END_RECORD_FULL, END_TOO_MANY_PANELS, END_TOO_NARROW, END_TURN
from gqm_sym.runtime.legs.runs.peaks import LENGTH, SPEED
from gqm_sym.runtime.legs.runs.rest_on_corners import predicted_rest
from gqm_sym.runtime.legs.runs.route import Reading

# The code for a body whose launch is so near to an equilibrium that it may be followed by its distance from that.
END_NEAR_EQUILIBRIUM = 14

# The largest number of legs of one body; and of one whose motion has no horizon if its end is asked for.
MAX_LEGS, MOST_LEGS = 250_000, 4 * MOST_TURNS

# The number of successive predictions of the time of rest on a corner that must agree with the one before.
AGREEMENTS = 2

JOINTS = types.NamedUniTuple(VECTOR, 5, Joints)

# The joints of a curve that is smooth everywhere, for compiled code.
SMOOTH = Joints(NO_NUMBERS, NO_NUMBERS, NO_NUMBERS, NO_NUMBERS)


class Track(NamedTuple):
    """The curve along which bodies are driven, and where it is not smooth.

    Attributes
    ----------
    chart : array
        The chart that follows the run-time parameters; empty for a curve with formulas, which has no breaks.
    breaks, corners, liftoff_corners : arrays
        As in `legs.advance.Joints`.
    keeps_blocks : bool
        Whether data of blocks of gaps are kept, too; they pay only if many bodies have the same run-time parameters.
    """

    chart: Array
    breaks: Array
    corners: Array
    liftoff_corners: Array
    keeps_blocks: bool = True

    def is_kept(self, dissipation: Dissipation) -> bool:
        """Return whether data of the gaps between breaks are kept, by which most legs are followed."""
        is_possible = dissipation.linear or dissipation.squared_contact != 0 or self.keeps_blocks
        return is_possible and self.breaks.size > 0 and self.chart.size > 0

    def has_kinks(self, dissipation: Dissipation) -> bool:
        """Return whether legs may be followed past kinks of the law without panels (`kinks.parts`)."""
        return dissipation.kinked and dissipation.linear and not self.breaks.size


@Inner
def answer(dissipation, p, joints, question, body, record):  # type: ignore[no-untyped-def]
    """Return the answer for one body with its status."""
    # A body is at once where it is launched.
    findings = Findings(0.0 if question == ARRIVAL and body[TARGET] == body[LAM0] else inf, -inf)
    function, sign = sought_extreme(question)
    has_vector = function == LENGTH and dissipation.path_in_space != 0
    has_length = has_vector or (function == LENGTH and dissipation.squared_contact != 0)
    # Such a length depends on V, which is smooth on panels alone.
    extremes = PANELS if has_vector else PEAKS
    reads = extremes if question >= LEAST_SPEED else (PASSAGE if question == ARRIVAL else TIMES)
    predicted, agreements = np.nan, 0
    for _ in range(MAX_LEGS if question > REST_PLACE or body[HORIZON] < inf else MOST_LEGS):
        reading, before = Reading(reads, function != SPEED, has_length, sign, findings.peak), body[LEG_BEFORE]
        what = advance(dissipation, p, joints, body, reading, record)
        # For a run without room for a panel, `solve` decides whether the curve or the arithmetic ends there.
        if what in (END_RECORD_FULL, END_TOO_MANY_PANELS, END_TOO_NARROW, END_OUT_OF_DOMAIN, END_OVERFLOW):
            break
        if dissipation.friction and slides_little(dissipation, p, joints, record, body):
            break
        findings = after_leg(dissipation, p, body, question, findings, record)
        reads = TIMES if question == ARRIVAL and findings.arrival < inf else reads
        if findings.arrival != findings.arrival or findings.peak != findings.peak:
            break
        passed = question >= LEAST_SPEED and body[HORIZON] == inf
        passed = passed and has_passed(dissipation, p, joints.breaks, body, question, findings.peak, record)
        if not goes_on(body, question, findings.arrival, passed, dissipation.has_radius):
            is_at_limit = question >= LEAST_LOAD and body[ENDING] == END_LIMIT
            if is_at_limit and force_is_unbounded(dissipation, p, body, findings.peak):
                break
            return conclude(body, question, findings, passed)
        if what == END_TURN and question < LEAST_LOAD and question != ARRIVAL:
            predicted, place, agrees = predicted_rest(dissipation, p, joints, body, before, predicted, record)
            agreements = agreements + 1 if agrees else 0
            if agreements == AGREEMENTS and predicted < body[HORIZON]:
                return conclude_at_rest(question, findings, predicted, place), FOUND
    return np.nan, LEFT


@Inner
def follow_leg(dissipation, p, joints, body, before, record):  # type: ignore[no-untyped-def]
    """Advance a body by one leg, with the data kept of the gaps between breaks or past kinks; ``before`` becomes a copy
    of the body before the leg.

    A leg that ends at a turn, or at the limit of a run, may have a record without panels, which `RUN_AGAIN` fills in.
    """
    for k in range(SIZE):
        before[k] = body[k]
    reads = PLACES if joints.gaps.size > 0 else ROWS
    what = advance(dissipation, p, joints, body, Reading(reads, False, False, 1.0, -inf), record)
    if what in (END_TURN, END_REST, END_LIMIT, END_RECORD_FULL):
        return what
    for k in range(SIZE):
        body[k] = before[k]
    return advance(dissipation, p, joints, body, Reading(PANELS, False, False, 1.0, -inf), record)


@Inner
def follow_legs(dissipation, p, joints, bodies, records):  # type: ignore[no-untyped-def]
    """Advance a body by as many legs as there is space for, or up to a leg after which Python decides how to go on.

    The records follow each other, and each but the last takes as many elements as it needs (USED). A record begins only
    where there is space for a whole row of ``records``, so that how a leg is followed does not depend on those before.
    """
    what, count, used, body = END_REST, 0, 0, bodies[0]
    line, size = records.reshape(-1), records.shape[1]
    keeps = joints.gaps.size > 0 or (dissipation.kinked and bodies.shape[0] > 1)
    while used + size <= line.size and not (keeps and count + 1 >= bodies.shape[0]):
        record = line[used : used + size]
        if keeps:
            what = follow_leg(dissipation, p, joints, body, bodies[1 + count], record)
        else:
            what = advance(dissipation, p, joints, body, Reading(PANELS, False, False, 1.0, -inf), record)
        if what == END_RECORD_FULL:
            break
        count += 1
        record[USED] = size
        body[PANEL_COUNT] += 1.0 + record[AHEAD] + record[BACK]
        body[STATUS] = 1.0 if is_tiny(dissipation, p, joints, record, body) else 0.0
        if what in (END_TURN, END_REST):
            pack(record)
        body[LAST_AT] = used
        used += int(record[USED])
        if what != END_TURN or body[ENDING] != 0.0 or body[ELAPSED] >= body[HORIZON] or body[STATUS] != 0.0:
            break
    body[VALUE], body[TOTAL] = count, used
    return what


@Inner
def row_of(parameters, k, row, gaps):  # type: ignore[no-untyped-def]
    """Return the run-time parameters of body k, and after them the chart (`drive`).

    What is kept of the gaps between breaks holds for one set of parameters. Successive bodies with the same ones share
    it.
    """
    if row.size == 0:
        return parameters[k if parameters.shape[0] > 1 else 0]
    is_new = k == 0
    for i in range(parameters.shape[1]):
        is_new |= parameters[k, i] != row[i]
    if is_new:
        row[: parameters.shape[1]] = parameters[k]
        forget(gaps)
    return row


@Inner
def is_near(dissipation, p, joints, question, body):  # type: ignore[no-untyped-def]
    """Return whether a body may have to be driven by its distance from an equilibrium, which has not been tried."""
    is_asked = question == ARRIVAL or question == LEAST_SPEED or question == MOST_SPEED
    is_possible = is_asked and not dissipation.friction and body[RETRY_WIDTH] == 0.0
    return is_possible and may_be_small(dissipation, p, joints.corners, body)


@entry(
    INTEGER(DISSIPATION, MATRIX, VECTOR, JOINTS, INTEGER, MATRIX, MATRIX),
    nogil=True,
    checked=False,
)
def drive(dissipation, parameters, row, joints, question, bodies, records):  # type: ignore[no-untyped-def]
    """Drive bodies along the curve, each of them until a question about its motion is answered.

    Parameters
    ----------
    dissipation : Dissipation
        The module's compiled functions, and the kind of its forces.
    parameters : array
        A row of run-time parameters for each body, or one for all of them, which is followed by the chart if there is
        one.
    row : array
        Work space for one row if there is a row for each body on a chart, which follows here; otherwise empty.
    joints : Joints
    question : int
        FIRST_LEGS to MOST_LENGTH. From END_TIME on, the answers are in VALUE and STATUS of each body; LEAST_LOAD to
        MOST_LENGTH mean the contact force per mass, which has a sign or a length. After FIRST_LEGS and LEGS, VALUE is
        the number of legs that have been followed, and STATUS is 1 if the last of them is tiny (`is_tiny`).
    bodies : (n, SIZE) array
        The bodies (`legs.body`), which are moved on. For questions up to RUN_AGAIN there is one body, in the first row;
        if legs may have to be followed again, there are other rows, which become copies of it before each leg.
    records : (n, size) array
        Filled with legs of the first body (`leg_record`), one directly behind the other; TOTAL is the number of
        elements that they take. For other questions the first row is work space.

    Returns
    -------
    int
        The code for the last leg of the last body (`advance`), or END_NEAR_EQUILIBRIUM.
    """
    breaks, corners, liftoff_corners, ahead, gaps = joints
    joints = Joints(borrowed(breaks), borrowed(corners), borrowed(liftoff_corners), borrowed(ahead), borrowed(gaps))
    parameters, bodies, records, what = borrowed(parameters), borrowed(bodies), borrowed(records), END_REST
    row = borrowed(row)
    for k in range(1 if question <= RUN_AGAIN else bodies.shape[0]):
        p, body = row_of(parameters, k, row, joints.gaps), bodies[k]
        if body[STEP] == 0.0:
            launch(dissipation, p, joints, body)
            is_swing = question == FIRST_LEGS and not dissipation.friction
            if is_swing and may_be_small(dissipation, p, joints.corners, body):
                return END_NEAR_EQUILIBRIUM
        if question <= LEGS:
            what = follow_legs(dissipation, p, joints, bodies, records) if body[DIRECTION] != 0.0 else END_REST
        elif question == RUN_AGAIN:
            what = advance(dissipation, p, joints, body, Reading(PANELS, False, False, 1.0, -inf), records[0])
        elif not fits(dissipation, p, body):
            body[VALUE], body[STATUS] = np.nan, LEFT
        elif is_near(dissipation, p, joints, question, body):
            body[VALUE], body[STATUS] = distance_of_search(joints.corners, body), NEAR
        elif body[DIRECTION] != 0.0:
            body[VALUE], body[STATUS] = answer(dissipation, p, joints, question, body, records[0])
        else:
            body[VALUE], body[STATUS] = at_rest(dissipation, p, body, question)
    return what


def drive_along(
    track: Track, dissipation: Dissipation, parameters: Array, question: int, bodies: Array, records: Array
) -> int:
    """Call `drive` for a curve, with the data kept of it for these forces and run-time parameters.

    If each body has a row of parameters, the chart does not follow them.
    """
    chart, breaks, corners, liftoff_corners, blocks = track
    has_own = chart.size > 0 and parameters.shape[0] > 1
    row = np.concatenate([parameters[0], chart]) if has_own else NO_NUMBERS
    if not breaks.size:
        what: int = drive(dissipation, parameters, row, SMOOTH, question, bodies, records)
        return what
    key = None if has_own else (dissipation, id(chart), parameters[0, : -chart.size].tobytes(), blocks)
    with room_for(chart, breaks.size if track.is_kept(dissipation) else 0, key, with_blocks=blocks) as kept:
        joints = Joints(breaks, corners, liftoff_corners, np.empty(room_ahead(breaks.size)), kept)
        what = drive(dissipation, parameters, row, joints, question, bodies, records)
    return what
