"""The part of a passage through a table along which a body moves, up to a turning point or up to where it stops."""

from typing import NamedTuple

from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.sweep.tables.liftoff import launch_on


class Stretch(NamedTuple):
    """The part of a passage along which a body moves.

    Attributes
    ----------
    low, high : (j, x)
        The panels of both ends, and the places on them.
    begin : (j, x)
        The end at which the body begins, with a speed that is known; j is -1 if it turns before it leaves the track, or
        if it stays on it.
    turns : bool
        Whether the body is at a turning point, at which its speed is 0.
    is_lap : bool
        Whether it is a whole lap, the ends of which are the same place.
    """

    low: tuple[int, float]
    high: tuple[int, float]
    begin: tuple[int, float]
    turns: bool
    is_lap: bool


@Inner
def end_of(stop, onwards, begin):  # type: ignore[no-untyped-def]
    """Return the panel of a `Stop` and the place there; the body stops before the load beyond a joint acts."""
    end = stop.panel, stop.x
    if stop.x == (-1.0 if onwards else 1.0) and begin != end:
        return (stop.panel - 1, 1.0) if onwards else (stop.panel + 1, -1.0)
    return end


@Inner
def stretch_of(curve, orbit, passage, stop):  # type: ignore[no-untyped-def]
    """Return the `Stretch` of a body up to a `Stop`."""
    low, high, begin, stops = (0, passage.low_x), (passage.panels - 1, passage.high_x), (-1, 0.0), stop.panel >= 0
    passes_once = orbit.circulates or orbit.leaves == orbit.direction
    passes_once = stop.turns == 0 if stops else passes_once
    upwards = orbit.direction > 0
    if passes_once and (stops or not orbit.circulates):
        begin = launch_on(curve, orbit, passage)
        low, high = (begin, high) if upwards else (low, begin)
    if stops and stop.turns < 2:
        onwards = upwards == (stop.turns == 0)
        end = end_of(stop, onwards, begin)
        if stop.turns == 1 and upwards == (stop.place > orbit.lam0):  # it has not come back to its launch
            end = launch_on(curve, orbit, passage)
        low, high = (low, end) if onwards else (end, high)
    return Stretch(low, high, begin, orbit.v2 == 0.0 or not passes_once, orbit.circulates and not stops)


@Inner
def stretch_before_turn(curve, orbit, passage):  # type: ignore[no-untyped-def]
    """Return the `Stretch` of a body from its launch to the turning point ahead of it."""
    launch = launch_on(curve, orbit, passage)
    low, high = (0, passage.low_x), (passage.panels - 1, passage.high_x)
    low, high = (launch, high) if orbit.direction > 0 else (low, launch)
    return Stretch(low, high, launch, True, False)


@Inner
def stretch_after_turn(orbit, passage, stop):  # type: ignore[no-untyped-def]
    """Return the `Stretch` of a body from its last turning point to a `Stop`, or to the end of its orbit."""
    low, high, none = (0, passage.low_x), (passage.panels - 1, passage.high_x), (-1, 0.0)
    if stop.panel >= 0:
        onwards = (orbit.direction > 0) == (stop.turns != 1)
        end = end_of(stop, onwards, none)
        low, high = (low, end) if onwards else (end, high)
    return Stretch(low, high, none, True, False)
