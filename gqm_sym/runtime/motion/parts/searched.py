"""The part of a motion in which an extreme is searched for, and the phase angles at which quantities are sampled."""

from math import isfinite, sqrt
from typing import Any

import numpy as np

from gqm_sym.errors import SolutionError
from gqm_sym.runtime.arithmetic.doubledouble import ULP
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.speed import potential_at
from gqm_sym.runtime.motion.trajectory import TimedSegment, Trajectory

# The places of the samples on each panel of a segment, as shares of its width.
STEPS = np.arange(16) / 16

# The distance from a joint at which a quantity that jumps there is sampled, as a share of the segment.
BESIDE_EDGE = 5e-10

# The least distance of a sample from both ends, as a share of the segment. The end of one may be a panel's edge to a
# rounding, and two samples there would hide a peak beside them.
LEAST_DISTANCE = 1e-12

# The numbers of turns after which it is asked whether a swing that dies away for ever has passed its extremes.
TURNS_OF_SEARCH = (3, 4, 6, 8, 12, 16, 24, 32)

# Values that differ by less than so many roundings count as equal, and the earlier one is returned.
EQUAL_ROUNDINGS = 8


def whole_trajectory(motion: Any) -> tuple[Trajectory, float]:
    """Return the trajectory of one period, or from launch to the end, and the time in s of its end.

    Raises
    ------
    SolutionError
        If the motion goes on for ever without repeating.
    """
    if _is_endless(motion):
        raise SolutionError(
            "this motion goes on for ever, or for too many turns to search them all, and does not repeat; launch it "
            "with a horizon, t_max, for its extremes"
        )
    end = motion._end_of_legs()
    if _repeats(motion):
        return motion._listed_trajectory, min(end, motion.period)
    return motion._trajectory(end), end


def _repeats(motion: Any) -> bool:
    return motion.kind in ("libration", "circulation")


def _is_endless(motion: Any) -> bool:
    """Return whether a motion goes on for ever without repeating."""
    return not _repeats(motion) and not isfinite(motion._end_of_legs())


def trajectory_with_extreme(motion: Any, quantity: Any, sign: int) -> tuple[Trajectory, float]:
    """Return the trajectory of a motion up to a time after which a quantity is nowhere more extreme, and that time.

    A swing that dies away has its extremes in its first swings, or approaches them. The quantity is an
    `extremes.Quantity`.

    Raises
    ------
    SolutionError
        As `extreme`.
    """
    if (quantity.is_quadratic or quantity.is_length) and not _repeats(motion):
        end = motion._end_of_legs()
        for turns in TURNS_OF_SEARCH:
            trajectory = motion._up_to_turn(turns)
            if trajectory is None:
                break
            segments = trajectory.segments
            if segments[-1].t_stop[0] > end:
                break
            ends = [k for k, timed in enumerate(segments) if timed.end == "turn"][turns - 3 :]
            before, across, after = (_place_of_turn(segments[k], trajectory.lap) for k in ends)
            if not min(before, across) < after < max(before, across):
                continue
            if quantity.grows_with_speed or not _is_exceeded(quantity, sign, segments, ends[0] + 1):
                return trajectory, segments[-1].t_stop[0]
            if isfinite(end):  # the search of the whole motion takes less time than further attempts
                break
    return whole_trajectory(motion)


def swings_below(motion: Any, speed: float) -> bool:
    """Return whether a body between two turning points is certainly slower than a speed whose square is next to the
    smallest doubles: V**2 is at most twice the width of the well times the steepest slope of the potential, which in so
    small a well is that at a turning point.
    """
    problem, (low, high) = motion.problem, motion.turning_points
    slopes = potential_at(problem.functions.addresses, problem.functions.p, np.array([low, high]))[1]
    return bool(sqrt(2.0 * abs(high - low)) * sqrt(float(np.abs(slopes).max())) < speed)


def _place_of_turn(timed: TimedSegment, lap: float) -> float:
    return float(timed.segment.places(np.array([timed.phi_stop]))[0]) + timed.laps * lap


def _is_exceeded(quantity: Any, sign: int, segments: tuple[TimedSegment, ...], begin: int) -> bool:
    """Return whether a quantity may be more extreme after a motion than during it.

    Two paths of a body in the plane of place and speed do not cross. If the last two legs, which are the segments from
    ``begin`` on, end nearer to the place where they began, all later states lie between them: at each place the body is
    slower than it was there. Three values then show the largest one of a parabola in V, or of the square of a length,
    which is one in V**2.
    """
    middle, power = (sqrt(0.5), 2) if quantity.is_length else (0.5, 1)
    reached = inside = -np.inf
    size = 0.0
    for k, timed in enumerate(segments):
        low, high = min(timed.phi_start, timed.phi_stop), max(timed.phi_start, timed.phi_stop)
        phi = samples(timed.segment, np.empty(0), low, high)
        full = sign * quantity.at(timed, phi, 1.0) ** power
        reached, size = max(reached, float(full.max())), max(size, size_of(full))
        if k >= begin:
            none, half = (sign * quantity.at(timed, phi, share) ** power for share in (0.0, middle))
            bend, rise = 2.0 * (none - 2.0 * half + full), 4.0 * half - 3.0 * none - full
            has_top = (bend < 0.0) & (rise > 0.0) & (rise < -2.0 * bend)
            top = none - np.divide(rise**2, 4.0 * bend, where=has_top, out=np.zeros_like(bend))
            inside = max(inside, float(np.maximum(none, top).max()))
    return not inside <= reached + EQUAL_ROUNDINGS * ULP * size


def samples(segment: Any, joints: Array, low: float, high: float) -> Array:
    """Return the phase angles between two of a segment at which a quantity is sampled, in order; places on both sides
    of the joints, at which it jumps, are among them.
    """
    edges, close = segment.edges, LEAST_DISTANCE * (high - low)
    inside = (edges[:-1, None] + (edges[1:] - edges[:-1])[:, None] * STEPS).ravel()
    first, last = inside.searchsorted(low + close, side="right"), inside.searchsorted(high - close, side="left")
    found = np.empty(max(last - first, 0) + 2)
    found[0], found[1:-1], found[-1] = low, inside[first:last], high
    if not joints.size:
        return found
    beside = BESIDE_EDGE * (high - low)
    beside_joints = np.concatenate([joints - beside, joints + beside])
    return np.unique(
        np.concatenate([found, beside_joints[(beside_joints > low + close) & (beside_joints < high - close)]])
    )


def size_of(values: Array) -> float:
    """Return the largest absolute value among the finite values of a quantity."""
    return float(np.abs(values[np.isfinite(values)]).max(initial=0.0))
