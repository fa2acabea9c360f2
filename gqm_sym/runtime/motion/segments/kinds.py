"""Segments for each combination of ends: turning points, an equilibrium, or places where the body moves."""

from math import exp, log, pi
from typing import Any

from gqm_sym.runtime.launch.functions import BoundFunctions
from gqm_sym.runtime.motion.segments.segment import Segment
from gqm_sym.runtime.quadrature.substitution import FROM_TURN, REGULAR, TO_EQUILIBRIUM, TURN_TURN

# The distance from an equilibrium up to which an approach to it is computed. It is near the smallest distance that
# doubles resolve.
MIN_EQUILIBRIUM_DISTANCE = 1e-300

# Phase angles of such an approach at which panels begin, because panels must be short near its start.
APPROACH_MARKS = (8.0, 16.0, 32.0, 64.0, 128.0, 256.0)


def toward_equilibrium(functions: BoundFunctions, start: float, equilibrium: float) -> Segment:
    """Return a segment from ``start`` towards an equilibrium, up to the resolution of doubles."""
    stop = log(abs(start - equilibrium) / MIN_EQUILIBRIUM_DISTANCE)
    marks = tuple(equilibrium + (start - equilibrium) * exp(-phi) for phi in APPROACH_MARKS)
    return Segment(functions=functions, kind=TO_EQUILIBRIUM, a=start, b=equilibrium, stop=stop, panel_breaks=marks)


def between_turns(
    functions: BoundFunctions,
    a: float,
    b: float,
    known_duration: float | None = None,
    ends: tuple[Any, Any] = (None, None),
    *,
    is_lazy: bool = False,
) -> Segment:
    """Return a segment between two turning points."""
    return Segment(
        functions=functions,
        kind=TURN_TURN,
        a=a,
        b=b,
        stop=pi,
        known_duration=known_duration,
        is_lazy=is_lazy,
        ends=ends,
    )


def from_turn(functions: BoundFunctions, turn: float, end: float) -> Segment:
    """Return a segment from a turning point to a place where the speed is not zero."""
    return Segment(functions=functions, kind=FROM_TURN, a=turn, b=end)


def from_cusp(functions: BoundFunctions, cusp: float, end: float) -> Segment:
    """Return a segment from a cusp at which V**2 vanishes, to a place where the speed is not zero.

    The time from there grows as the distance, because ds/dlam vanishes too, so that the segment is as smooth as one
    whose speed is not zero at either end.
    """
    return through(functions, cusp, end, cusp, 0.0)


def through(
    functions: BoundFunctions,
    start: float,
    end: float,
    ref: float,
    ref_v2: float,
    *,
    known_duration: float | None = None,
    panel_breaks: tuple[float, ...] = (),
) -> Segment:
    """Return a segment whose speed is not zero at either end; ``ref_v2`` is V**2 at ``ref``."""
    return Segment(
        functions=functions,
        kind=REGULAR,
        a=start,
        b=end,
        ref=ref,
        ref_v2=ref_v2,
        known_duration=known_duration,
        panel_breaks=panel_breaks,
    )


def with_turning_points(segment: Segment, a: float, b: float, duration: float | None) -> Segment:
    """Return the same segment between two turning points that are given by other doubles, with its duration if that is
    known.

    The duration for the old doubles is not kept, because near a separatrix a rounding of the ends causes many roundings
    of the duration.
    """
    return between_turns(segment.functions, a, b, duration, is_lazy=segment.stored_panels is None)
