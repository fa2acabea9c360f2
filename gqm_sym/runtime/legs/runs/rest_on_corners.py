"""Corners and other breaks of the curve around a body, and its rest on a corner between two planes.

Between two planes a body that loses energy turns infinitely often in a finite time. The times from turn to turn
decrease geometrically, in both directions by the same factor, if the forces are constant; other forces become so as
the swings become smaller. So the time at which the body rests follows from three successive times.
"""

from math import fabs, nan

import numpy as np

from gqm_sym.runtime.arithmetic.doubledouble import ULP
from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.legs.body import ELAPSED, HIGH, LAST_LEG, LEG_BEFORE, LEG_TIME, LOW, ONLY_SIGN, PERIOD
from gqm_sym.runtime.legs.leg_record import END, HEADING, LAPS_BEFORE, START
from gqm_sym.runtime.legs.panels.breaks import clearance
from gqm_sym.runtime.legs.panels.equation import forces_on
from gqm_sym.runtime.legs.panels.point import point_buffer, sign_of_load
from gqm_sym.runtime.legs.runs.follow import direction_from_rest

# The largest part of the whole time that a predicted time to rest may be, divided by the share of a swing by which the
# next but one is shorter. The prediction then has hardly more roundings than a sum of the times of all swings.
PREDICTED_SHARE = 2.0**-4


@Inner
def breaks_before(breaks, ahead, period, direction, begin, limit):  # type: ignore[no-untyped-def]
    """Return the breaks strictly between two places, in the order in which they are passed, and the index of the first
    among all breaks.
    """
    count, first_break = 0, 0
    low, high = min(begin, limit), max(begin, limit)
    first_lap, last_lap = 0, 0
    if period > 0.0 and breaks.size > 0:
        first_lap, last_lap = int((low - breaks[-1]) // period), -int((breaks[0] - high) // period)
    for i in range(last_lap - first_lap + 1):
        lap = (first_lap + i if direction > 0 else last_lap - i) * period
        # One more break is taken on either side, because the subtraction of a lap is rounded.
        from_k = max(np.searchsorted(breaks, low - lap) - 1, 0)
        to_k = min(np.searchsorted(breaks, high - lap) + 1, breaks.size)
        while from_k < to_k and not breaks[from_k] + lap > low:
            from_k += 1
        while from_k < to_k and not breaks[to_k - 1] + lap < high:
            to_k -= 1
        first, step = (from_k, 1) if direction > 0 else (to_k - 1, -1)
        first_break = first if count == 0 else first_break
        passed = min(to_k - from_k, ahead.size - count)
        for j in range(passed):
            ahead[count + j] = breaks[first + step * j] + lap
        count += passed
    return ahead[:count], first_break


@Inner
def is_break(breaks, period, place):  # type: ignore[no-untyped-def]
    """Return whether the curve is not smooth at a place."""
    for known in breaks:
        lap = period * round((place - known) / period) if period > 0.0 else 0.0
        if known + lap == place:
            return True
    return False


@Inner
def leaving(dissipation, p, joints, body, place, preferred):  # type: ignore[no-untyped-def]
    """Return the direction in which a body at rest leaves a place; 0 if it stays.

    At a corner the planes on both sides decide; if the body could slide down either of them, it takes the ``preferred``
    direction.
    """
    off, period = 0.0, body[PERIOD]
    if is_break(joints.breaks, period, place):
        off = clearance(place, period if period > 0.0 else max(fabs(body[LOW]), fabs(body[HIGH])))
    return direction_from_rest(dissipation.static_balance, p, place - off, place + off, preferred)[0]


@Inner
def time_to_rest(before, last, this):  # type: ignore[no-untyped-def]
    """Return the sum of all times from turn to turn that follow three successive ones."""
    return this * (last + this) / (before - this)


@Inner
def rests_on_corner(dissipation, p, joints, body, place):  # type: ignore[no-untyped-def]
    """Return whether the body, which turns at a place, has come to rest on a corner there within the resolution of
    times: the sum of all times that follow is less than a rounding of the time.
    """
    before, last, now = body[LEG_BEFORE], body[LAST_LEG], body[ELAPSED]
    this = body[LEG_TIME]
    if joints.corners.size == 0 or not this < before:
        return False
    if now + time_to_rest(before, last, this) != now or not is_break(joints.breaks, body[PERIOD], place):
        return False
    return leaving(dissipation, p, joints, body, place, 0) == 0


@Inner
def holds_at_rest(dissipation, p, body, corner):  # type: ignore[no-untyped-def]
    """Return whether a track that can only push, if it is one, supports a body at rest on either side of a corner."""
    only_sign, forces, point = int(body[ONLY_SIGN]), forces_on(dissipation, p, 1), point_buffer()
    off = clearance(corner, body[PERIOD] if body[PERIOD] > 0.0 else max(fabs(body[LOW]), fabs(body[HIGH])))
    for side in (-off, off):
        if only_sign != 0 and sign_of_load(forces, corner + side, 0.0, point) != only_sign:
            return False
    return True


@Inner
def predicted_rest(dissipation, p, joints, body, before, earlier, record):  # type: ignore[no-untyped-def]
    """Predict when and where a body that has turned comes to rest.

    Parameters
    ----------
    dissipation, p, joints, body
        As in `advance.advance`, after the turn.
    before : float
        The time from turn to turn before the last two.
    earlier : float
        The prediction at the turn before, or NaN.
    record : array
        The record of the last leg (`leg_record`).

    Returns
    -------
    time : float
        The time from launch in s; NaN if the last leg did not pass one corner, and nothing else at which the curve is
        not smooth, or if the prediction has too many roundings.
    place : float
        The corner.
    agrees : bool
        Whether the change since the earlier prediction, and all that may follow, are below a rounding of the time.
    """
    last, this, period = body[LEG_BEFORE], body[LAST_LEG], body[PERIOD]
    if joints.corners.size == 0 or not this < before:
        return nan, nan, False
    left, decrease = time_to_rest(before, last, this), (before - this) / before
    time = body[ELAPSED] + left
    if not left <= PREDICTED_SHARE * decrease * time:
        return nan, nan, False
    passed, _ = breaks_before(joints.breaks, joints.ahead, period, int(record[HEADING]), record[START], record[END])
    if passed.size != 1 or not is_break(joints.corners, period, passed[0]):
        return nan, nan, False
    if leaving(dissipation, p, joints, body, passed[0], 0) != 0 or not holds_at_rest(dissipation, p, body, passed[0]):
        return nan, nan, False
    return time, passed[0] + record[LAPS_BEFORE] * period, fabs(time - earlier) <= ULP * decrease * time
