"""The place of a body that leaves the track at a joint, on the side from which it comes.

The contact force jumps at a joint, and the place of the loss of contact is rounded. The body leaves before the load
beyond the joint acts.
"""

from math import nextafter
from typing import NamedTuple

import numpy as np

from gqm_sym.runtime.charts.chart import CORNER_ROUNDINGS
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.motion.trajectory import TimedSegment

# The share of a time by which it must precede the loss of contact to be earlier beyond doubt.
ROUNDED_TIME = 2.0**-44


class LossAtJoint(NamedTuple):
    """A joint at which contact is lost.

    Attributes
    ----------
    last : float
        The last place before the joint.
    near : float
        The distance from the end of the motion within which a place may be on either side.
    since : float
        The time in s from which on it may be.
    """

    last: float
    near: float
    since: float


def loss_at_joint(timed: TimedSegment) -> LossAtJoint | None:
    """Return the joint at which contact is lost at the end of a timed segment, if it is."""
    if timed.end != "liftoff" or not timed.segment.functions.joints.size:
        return None
    start, place = timed.segment.places(np.array([timed.phi_start, timed.phi_stop])).tolist()
    near, f = CORNER_ROUNDINGS * float(np.spacing(abs(place))), timed.segment.functions
    joints = f.between(f.joints, place - near, place + near)
    if not joints.size:
        return None
    begin, end = timed.t_start[0], timed.t_stop[0]
    slowness = (end - begin) / abs(place - start) if place != start else 0.0
    since = end - max(ROUNDED_TIME * end, 2.0 * near * slowness)
    return LossAtJoint(nextafter(float(joints[0]), start), near, since)


def before_joint(timed: TimedSegment, places: Array) -> Array:
    """Return places, but those that may be beyond the joint at which contact is lost before it."""
    loss = loss_at_joint(timed)
    if loss is None:
        return places
    return np.where(np.abs(places - loss.last) <= 2.0 * loss.near, loss.last, places)
