"""Extremes of speed and contact force along a motion."""

from collections.abc import Callable
from functools import partial
from math import copysign
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gqm_sym.runtime.arithmetic.doubledouble import ULP
from gqm_sym.runtime.charts.chart import CORNER_ROUNDINGS
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.poles import pole_ahead
from gqm_sym.runtime.motion.events import contact_force_at, contact_force_on
from gqm_sym.runtime.motion.parts.before_joint import loss_at_joint
from gqm_sym.runtime.motion.parts.beside_cusp import force_beside_cusp
from gqm_sym.runtime.motion.parts.peaks import peak_between
from gqm_sym.runtime.motion.parts.searched import EQUAL_ROUNDINGS, samples, size_of, trajectory_with_extreme
from gqm_sym.runtime.motion.parts.stationary_speeds import exact_speed
from gqm_sym.runtime.motion.segments.segment import Segment
from gqm_sym.runtime.motion.trajectory import TimedSegment, Trajectory

if TYPE_CHECKING:
    from gqm_sym.runtime.launch.problem import Problem

# The number of the largest samples near which an extreme is searched for.
MAX_PEAKS = 4

# A sample is not a peak to be located if a peak beside it would have to exceed it by more than so many times what its
# lower neighbour lacks to it. A parabola exceeds it by an eighth of that at most.
MAX_EXCESS = 4.0

# The distance from an end of a segment within which a peak counts as being at the end, as a share of the segment.
END_SHARE = 1e-9

# The least share of a segment before a joint at which contact is lost in which loads are not searched.
BEFORE_JOINT = 1e-13

# The share of the contact force by which it must jump at a joint; the pieces of a smooth chart differ by less.
LEAST_JUMP = 1e-11

# A body comes to rest at a cusp if V**2 there is at most so many roundings of its largest value.
STOPPED_ROUNDINGS = 64.0

# Where the contact force at a cusp is this many times its largest value before, it grows without bound there. The place
# of a cusp is rounded, and the force there is a large number, unless that place is 0.
UNBOUNDED_GROWTH = 1e6

# At a pole of the potential the speed is infinite, and so is the contact force if it grows by this factor on the last
# segment.
POLE_GROWTH = 1.2


class Extreme(NamedTuple):
    """The largest or the least value of a quantity along a motion.

    Attributes
    ----------
    value : float
        The value, in its SI unit.
    t : float
        The time in s from launch at which it is first reached.
    lam : float
        The curve parameter there, in its unit; in circulation laps are counted.
    """

    value: float
    t: float
    lam: float


class Quantity(NamedTuple):
    """A quantity with a largest or least value along a motion.

    Attributes
    ----------
    at : callable
        ``at(timed, phi, share)`` gives the values at phase angles of a timed segment, or what they would be at a share
        of the speed.
    of_state : callable
        ``of_state(state)`` gives the value in a state.
    beside : callable, optional
        If the quantity jumps at joints of the curve, ``beside(timed, phi, places)`` gives the values at places beside
        those of the phase angles.
    is_quadratic : bool
        Whether the quantity is a quadratic polynomial of the speed at each place.
    is_length : bool
        Whether its square is a quadratic polynomial of V**2 at each place, as that of a contact force in space.
    is_even : bool
        Whether it is known to be the same for both directions of motion at each place.
    grows_with_speed : bool
        Whether it is at each place the larger, the faster the body is, and the same wherever the body stands still.
    """

    at: Callable[..., Array]
    of_state: Callable[[Any], float]
    beside: Callable[[TimedSegment, Array, Array], Array] | None = None
    is_quadratic: bool = True
    is_length: bool = False
    is_even: bool = False
    grows_with_speed: bool = False


def _speeds(timed: TimedSegment, phi: Array, share: float = 1.0) -> Array:
    return share * timed.segment.speeds(phi)


# |ds/dt| in m/s.
SPEED = Quantity(_speeds, lambda state: abs(state.v), is_even=True, grows_with_speed=True)


def force_of(problem: "Problem") -> Quantity:
    """Return the contact force in N, as a quantity along motions."""
    at, beside = partial(contact_force_on, problem), partial(contact_force_at, problem)
    signed, directed = bool(problem.formulas.signed), bool(problem.formulas.directed)
    is_length = not (signed or directed)
    return Quantity(at, lambda state: float(state.normal_force), beside, signed, is_length, not directed)


def extreme(motion: Any, quantity: Quantity, sign: int) -> Extreme:
    """Find the largest (sign 1) or least (-1) value over one period, or from launch to the end.

    The search is over phase angles, for which panels resolve the motion even where it is slow or short.

    Parameters
    ----------
    motion : motion.Motion
        The motion.
    quantity : Quantity
        The quantity whose extreme is found.
    sign : int
        1 for the largest value, -1 for the least.

    Raises
    ------
    SolutionError
        If the motion goes on for ever without repeating, and it is not known that later values are less extreme.
    """
    if motion.kind == "rest" or motion._end_of_legs() == 0.0:  # the body stays, or lifts off at once
        state = motion.state(0.0)
        return Extreme(quantity.of_state(state), 0.0, state.lam)
    if quantity is SPEED and sign < 0 and motion.problem.launch.v0.value == 0.0:
        return Extreme(0.0, 0.0, motion.problem.launch.lam0.value)
    trajectory, end = trajectory_with_extreme(motion, quantity, sign)
    last = trajectory.segments[-1]
    if last.end == "singular-point" and last.t_stop[0] <= end and _falls_into_pole(motion.problem, last):
        first, value = sign * quantity.at(last, np.array([last.phi_start, last.phi_stop]))
        if value > 0.0 and (quantity is SPEED or value > POLE_GROWTH * abs(first)):
            return _extreme_at(last, trajectory, last.phi_stop, sign * np.inf)
    best: Extreme | None = None
    searched: dict[int, list[tuple[float, float]]] = {}
    for timed in trajectory.segments:
        if timed.t_start[0] >= end and best is not None:
            break
        ends = sorted(phases(timed, trajectory, end))
        before = searched.setdefault(id(timed.segment), [])
        if any(low <= ends[0] and ends[1] <= high for low, high in before) and quantity.is_even:
            continue  # the body comes back the same way
        before.append((ends[0], ends[1]))
        least = -np.inf if best is None else sign * best.value
        size, peaks = _on_segment(motion.problem, timed, trajectory, quantity, sign, (end, least))
        for value, t, lam in peaks:
            if best is None or sign * (value - best.value) > EQUAL_ROUNDINGS * ULP * size:
                best = Extreme(value, min(t, end), lam)  # the time of the end itself may be rounded up
    assert best is not None
    launch, value = motion.problem.launch, best.value
    is_given = quantity is SPEED and sign * (launch.v0.value - value) > 0.0  # along a level line, to rounding
    if best.t == 0.0 or is_given:  # as it was given, without rounding
        if quantity is SPEED:
            value = launch.v0.value
        elif motion._is_released_at_cusp:  # where the force is the limit after the release
            value = quantity.of_state(motion.state(0.0))
        return Extreme(value, 0.0, launch.lam0.value)
    return best


def _on_segment(
    problem: "Problem",
    timed: TimedSegment,
    trajectory: Trajectory,
    quantity: Quantity,
    sign: int,
    limits: tuple[float, float],
) -> tuple[float, list[Extreme]]:
    """Return the size of a quantity on a timed segment up to a time, and its peaks in the order of time.

    The second of the ``limits`` is a value times the sign; of peaks that do not reach it, some may be left out.
    """
    segment, (end, least) = timed.segment, limits
    start, stop = phases(timed, trajectory, end)
    if timed.end == "liftoff" and quantity is not SPEED:
        stop -= _share_at_joint(timed) * (stop - start)  # the body leaves before the load beyond the joint acts
    low, high = min(start, stop), max(start, stop)
    joints, found = _limits_at_joints(timed, trajectory, quantity, low, high)
    phi = samples(segment, joints, low, high)

    def signed(angles: Array) -> Array:
        values = sign * quantity.at(timed, angles)
        if stops_at_cusp:
            values[np.abs(angles - stop) < clear] = limit
        return np.where(np.isnan(values), -np.inf, values)

    at_cusp = -1 if stop > start else 0
    ends_at_cusp = timed.end == "cusp" and timed.t_stop[0] <= end and quantity is not SPEED
    stops_at_cusp = ends_at_cusp and _stops(segment, phi, at_cusp)
    clear, limit = 0.0, 0.0
    if stops_at_cusp:
        cusp, heading = float(segment.places(np.array([stop]))[0]), timed.sense * segment.direction
        clear, limit = END_SHARE * (high - low), sign * force_beside_cusp(problem, cusp, -heading)
    values = signed(phi)
    if (
        ends_at_cusp
        and not stops_at_cusp
        and abs(values[at_cusp]) > UNBOUNDED_GROWTH * size_of(np.delete(values, at_cusp))
    ):
        values[at_cusp] = copysign(np.inf, values[at_cusp])
    size = size_of(values)
    if least > -np.inf and not _may_reach(values, least):
        return size, sorted(found, key=lambda peak: peak.t)
    in_time = np.arange(phi.size) if stop > start else np.arange(phi.size)[::-1]
    for k in in_time[_peaks(values[in_time], size)[:MAX_PEAKS]].tolist():
        if values[k] == np.inf:
            found.append(_extreme_at(timed, trajectory, stop, sign * np.inf))
            continue
        first, last = max(k - 1, 0), min(k + 1, phi.size - 1)
        if least > -np.inf and not _may_reach(values[first : last + 1], least):
            continue
        angle = peak_between(signed, float(phi[first]), float(phi[k]), float(phi[last]))
        if np.abs(joints - angle).min(initial=np.inf) < END_SHARE * (high - low):
            continue  # the limits at the joint count
        value = float(signed(np.array([angle]))[0])
        # Since a peak at an end of the segment may be flat, it may be found next to the end within rounding. At a joint
        # the quantity may jump, and what is found next to it is then the limit from the segment's side.
        near = min((start, stop), key=lambda end: abs(end - angle))
        if abs(near - angle) < END_SHARE * (high - low):
            angle, at_end = near, float(signed(np.array([near]))[0])
            value = value if value - at_end > EQUAL_ROUNDINGS * ULP * size else at_end
        elif quantity is SPEED and low < angle < high:
            angle, speed = exact_speed(problem, segment, phi, (angle, sign * value), sign)
            value = sign * speed
        at_turn = quantity is SPEED and timed.end == "turn" and angle == timed.phi_stop
        value = 0.0 if at_turn else sign * value
        found.append(_extreme_at(timed, trajectory, angle, value))
    return size, sorted(found, key=lambda peak: peak.t)


def _stops(segment: Segment, phi: Array, end: int) -> bool:
    """Return whether V**2 vanishes to rounding at one end of phase angles."""
    speeds = segment.speeds(phi)
    return bool(speeds[end] ** 2 <= STOPPED_ROUNDINGS * ULP * speeds.max() ** 2)


def _limits_at_joints(
    timed: TimedSegment, trajectory: Trajectory, quantity: Quantity, low: float, high: float
) -> tuple[Array, list[Extreme]]:
    """Return the phase angles of the joints between two phase angles of a timed segment at which a quantity jumps, and
    its limits from both sides there.
    """
    segment = timed.segment
    f, edges = segment.functions, segment.edges
    if quantity.beside is None or not f.joints.size:
        return np.empty(0), []
    joints = f.between(f.joints, *segment.places(np.array([low, high])).tolist())
    distances, clear = np.abs(segment.places(edges)[:, None] - joints), CORNER_ROUNDINGS * np.spacing(np.abs(joints))
    phi, is_edge = edges[distances.argmin(axis=0)], distances.min(axis=0, initial=np.inf) <= clear
    phi, joints, clear = phi[is_edge], joints[is_edge], clear[is_edge]  # the quantity does not jump inside a panel
    limits = np.array([quantity.beside(timed, phi, joints + side * clear) for side in (-1.0, 1.0)])
    jumps = np.abs(limits[1] - limits[0]) > LEAST_JUMP * np.abs(limits).max(axis=0)
    phi, places, limits = phi[jumps], joints[jumps] + timed.laps * trajectory.lap, limits[:, jumps]
    times = [trajectory.time_of(timed, angle) for angle in phi.tolist()]
    return phi, [
        Extreme(*one) for values in limits.tolist() for one in zip(values, times, places.tolist(), strict=True)
    ]


def _may_reach(values: Array, least: float) -> bool:
    """Return whether a quantity may reach a value beside one of its samples."""
    padded = np.concatenate([values[:1], values, values[-1:]])
    with np.errstate(invalid="ignore"):  # infinite values
        reach = values + MAX_EXCESS * (values - np.minimum(padded[:-2], padded[2:]))
    return bool((reach >= least).any())


def _peaks(values: Array, size: float) -> list[int]:
    """Return the indices of samples in the order of time that no neighbour exceeds, the largest first; of samples side
    by side that are equal within rounding, at most the first and the largest.
    """
    padded = np.concatenate([[-np.inf], values, [-np.inf]])
    peaks = np.flatnonzero((values >= padded[:-2]) & (values >= padded[2:])).tolist()
    with np.errstate(invalid="ignore"):  # infinite values
        level = np.cumsum(np.abs(np.diff(values, prepend=values[:1])) > EQUAL_ROUNDINGS * ULP * size).tolist()
    by_value = sorted(peaks, key=lambda k: -float(values[k]))
    largest = {level[k]: k for k in reversed(by_value)}
    first = {level[k]: k for k in reversed(peaks)}
    kept = {*largest.values(), *first.values()}
    return [k for k in by_value if k in kept]


def _falls_into_pole(problem: "Problem", timed: TimedSegment) -> bool:
    """Return whether the potential has a pole where the last segment of a motion ends."""
    first, last = timed.segment.places(np.array([timed.phi_start, timed.phi_stop])).tolist()
    return pole_ahead(problem, 1 if last > first else -1, last) is not None


def phases(timed: TimedSegment, trajectory: Trajectory, end: float) -> tuple[float, float]:
    """Return the phase angles at which a timed segment begins, and at which it or the time ``end`` stops."""
    if timed.t_stop[0] <= end:
        return timed.phi_start, timed.phi_stop
    return timed.phi_start, float(trajectory.phase_angles(timed, np.array([end]), np.zeros(1))[0])


def _share_at_joint(timed: TimedSegment) -> float:
    """Return the share of a timed segment next to its end in which loads are not searched: 0, unless the curve is not
    smooth at the end, to rounding.
    """
    loss = loss_at_joint(timed)
    if loss is None:
        return 0.0
    start = float(timed.segment.places(np.array([timed.phi_start]))[0])
    return min(max(BEFORE_JOINT, 2.0 * loss.near / abs(loss.last - start)), 0.5) if loss.last != start else 0.5


def _extreme_at(timed: TimedSegment, trajectory: Trajectory, phi: float, value: float) -> Extreme:
    """Return an extreme with the time and the place of a phase angle."""
    lam = float(timed.segment.places(np.array([phi]))[0]) + timed.laps * trajectory.lap
    return Extreme(value, trajectory.time_of(timed, phi), lam)
