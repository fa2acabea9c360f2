"""Legs so short that the body may have to be followed by its distance from an equilibrium."""

from math import fabs

from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.legs.body import (
    DIRECTION,
    FIRST_STEP,
    LEAST_SIZE,
    LEAST_SWING,
    PLACE,
    RETRY_WIDTH,
    V2,
)
from gqm_sym.runtime.legs.frames.local_frame import LEAST_RETRY_SHARE, SMALL_SHARE, may_be_small
from gqm_sym.runtime.legs.leg_record import END, HEADING, START, START_V2

# With friction, a leg that is shorter than this share of its place, and of the first step of a search, loses digits of
# its time: those of the force, which is a difference.
SLIDING_SHARE = 2.0**-15


@Inner
def slides_little(dissipation, p, joints, record, body):  # type: ignore[no-untyped-def]
    """Return whether a leg from rest is so short that, with friction, it may have to be followed by the distance from
    where friction balances the other forces. Between two planes legs are as short, but there is no such place nearby.
    """
    width, size = fabs(record[END] - record[START]), max(fabs(record[END]), body[LEAST_SIZE])
    if not (record[START_V2] == 0.0 and width < SLIDING_SHARE * min(size, body[FIRST_STEP])):
        return False
    place, direction, v2 = body[PLACE], body[DIRECTION], body[V2]
    body[PLACE], body[DIRECTION], body[V2] = record[START], record[HEADING], 0.0
    is_near_balance = may_be_small(dissipation, p, joints.corners, body)
    body[PLACE], body[DIRECTION], body[V2] = place, direction, v2
    return is_near_balance


@Inner
def is_tiny(dissipation, p, joints, record, body):  # type: ignore[no-untyped-def]
    """Return whether a leg is so short that the next one, or with friction this one, may have to be followed by the
    distance from an equilibrium, or cannot be followed at all.
    """
    start, end = record[START], record[END]
    if max(fabs(start), fabs(end)) < LEAST_SWING:
        return True
    if dissipation.friction:
        return slides_little(dissipation, p, joints, record, body)
    width = fabs(end - start)
    is_too_wide = body[RETRY_WIDTH] < width <= body[RETRY_WIDTH] / LEAST_RETRY_SHARE
    return width < SMALL_SHARE * max(fabs(end), body[LEAST_SIZE]) and not is_too_wide
