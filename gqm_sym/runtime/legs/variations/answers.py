"""Derivatives of a motion with losses: of states at given times, turning points, ends and extremes."""

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gqm_sym.errors import SolutionError
from gqm_sym.runtime.compiled.calls import call_static_balance
from gqm_sym.runtime.compiled.jit import entry
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, VECTOR, Array
from gqm_sym.runtime.gradients.sensitivity import Sensitivity
from gqm_sym.runtime.inversion.leg_tables import phases_along_legs
from gqm_sym.runtime.launch.kinds import EXTREMES, PERIODIC_QUANTITIES
from gqm_sym.runtime.launch.speed import path_and_force_at
from gqm_sym.runtime.legs.leg_record import END, HEADING
from gqm_sym.runtime.legs.variations.chain import ARC, DELAY, SIGMA
from gqm_sym.runtime.legs.variations.changes import Changes, changes_of_turns
from gqm_sym.runtime.legs.variations.law import LawRows
from gqm_sym.runtime.motion.events import Leg
from gqm_sym.runtime.motion.segments.tabulation import TabulatedPiece
from gqm_sym.runtime.motion.trajectory import PhasePoints

# An extreme inside a leg is improved by Newton's method, whose steps may be at most this share of the time of the
# motion.
MAX_STEP, NEWTON_STEPS = 1e-5, 3

# The number of points that are evaluated together; for more of them the system would provide memory anew each time.
BLOCK = 1024

# An extreme this near to the end of a motion, as a share of its time, counts as the end. An extreme this near to a jump
# of the force, as a share of the place, counts as being at the jump. At a time later or earlier by the third share, it
# is on one side of the jump.
AT_END, AT_BREAK, SIDE_SHARE = 1e-12, 1e-9, 1e-13

# Why there are no derivatives on an approach to an equilibrium.
NEAR_EQUILIBRIUM = "sensitivity: there is none yet where a motion tends to an equilibrium; ask for earlier times"


class Switch(NamedTuple):
    """The turn at which a motion with friction comes nearest to another number of legs.

    Attributes
    ----------
    t : float
        Time from launch in s.
    lam : float
        The place, in the unit of the curve's parameter.
    margin : float
        The excess of the driving force along the track over the largest force that can hold the body there, as a share
        of the latter. It is negative if the body stays. At 0 the number of legs changes, and derivatives are one-sided.
    """

    t: float
    lam: float
    margin: float


class MarchPoints(NamedTuple):
    """Some points of a motion with losses: a number for each.

    Attributes
    ----------
    half : array of int
        The halves of runs (`equation`) on which the points lie.
    w : array
        The march variables.
    v : array
        The velocities.
    laps : array
        The laps of a closed curve before them.
    """

    half: NDArray[np.int64]
    w: Array
    v: Array
    laps: Array

    def part(self, block: slice) -> "MarchPoints":
        """Return some of the points."""
        return MarchPoints(self.half[block], self.w[block], self.v[block], self.laps[block])


def points_by_record(record: Array, pieces: Sequence[TabulatedPiece], t: Array) -> MarchPoints:
    """Return the points of a motion at times, from the record of some of its pieces.

    Raises
    ------
    SolutionError
        As `points_of`.
    """
    number, phi, v = rows = np.empty((3, t.size))
    phases_along_legs(record, t, rows)
    of_pieces = np.array([(2 * piece.leg + (piece.sense < 0), piece.last, piece.laps) for piece in pieces])
    counts = [len(piece.intervals) for piece in pieces]
    half, last, laps = np.repeat(of_pieces, counts, axis=0)[number.astype(np.intp)].T
    if np.isnan(last).any():
        raise SolutionError(NEAR_EQUILIBRIUM)
    return MarchPoints(half.astype(np.int64), phi * last, v, laps)


def points_of(found: PhasePoints, v: Array) -> MarchPoints:
    """Return the points of a motion, given the velocities.

    Raises
    ------
    SolutionError
        If one of them lies where the motion tends to an equilibrium.
    """
    half, w = np.empty(v.size, dtype=np.int64), np.empty(v.size)
    for timed, here, phi in found.segments:
        if timed.segment.march_end is None:
            raise SolutionError(NEAR_EQUILIBRIUM)
        half[here], w[here] = 2 * timed.leg + (timed.sense < 0), phi * timed.segment.march_end
    return MarchPoints(half, w, v, found.laps)


class StateChanges:
    """The changes of the states at points of a motion with losses, at fixed times: a row for each variable.

    Parameters
    ----------
    changes : Changes
        The changes of its legs.
    points : MarchPoints
        The points of the motion at the times.

    Attributes
    ----------
    lam, s, x, z, v, normal_force, y : arrays
        As in `gradients.sensitivity.Sensitivity`, except that places are the labels of points, within the lap.
    labels, arc : array
        The changes of the labels of the places, and ``arc`` as in `changes.Origin`.
    states : array
        The points (`law.states_of`).
    law : LawRows
        The law there.
    """

    def __init__(self, changes: Changes, points: MarchPoints) -> None:
        along = changes.along(points.half, points.w, points.v)
        self.states, self.law = along.states, LawRows(changes.law.matrix(along.states))
        found = changes.states(along, self.law.matrix, points.v)
        self.lam, self.s, self.x, self.z, self.v, self.normal_force, self.y, self.arc = found
        self.labels = self.lam


def places_at(motion: Any, changes: Changes, points: MarchPoints, rows: list[int]) -> Array:
    """Return the changes of the places of a motion at points, with a row for each of some variables."""
    found = np.empty((len(rows), points.v.size))
    for block in _blocks(points.v.size):
        some = points.part(block)
        if changes.law.by_arc_length:  # the change of the arc length is needed too
            found[:, block] = states_at(changes, some).lam[rows]
        else:
            found[:, block] = _places(motion, changes, some)[rows]
    return found


def sensitivities_at(changes: Changes, points: MarchPoints, rows: list[int]) -> Array:
    """Return the changes of the states of a motion at points: for each field of `gradients.sensitivity.Sensitivity` a
    row for each of some variables.
    """
    fields = Sensitivity._fields[1:]
    found = np.empty((len(fields), len(rows), points.v.size))
    for block in _blocks(points.v.size):
        some = states_at(changes, points.part(block))
        for array, field in zip(found, fields, strict=True):
            array[:, block] = getattr(some, field)[rows]
    return found


def _blocks(count: int) -> Iterator[slice]:
    """Yield the parts of so many points that are evaluated together."""
    return (slice(start, start + BLOCK) for start in range(0, count, BLOCK))


def _places(motion: Any, changes: Changes, points: MarchPoints) -> Array:
    """Return the changes of places along a curve with formulas, with respect to all variables."""
    v, f = points.v, motion.problem.functions
    along = changes.along(points.half, points.w, v, whole=False)
    ds = path_and_force_at(f.addresses, f.p, along.states[0], v**2)[2]
    places: Array = along.changes[SIGMA] - v / ds * along.changes[DELAY] + points.laps * changes.lap[:, None]
    return places


def states_at(changes: Changes, points: MarchPoints) -> StateChanges:
    """Return the changes of the states of a motion at points."""
    found = StateChanges(changes, points)
    found.lam = changes.parameter_change(found.lam, found.arc, points.laps)
    if changes.law.by_arc_length:
        found.s = found.lam
    return found


def gradient(motion: Any, quantity: str) -> Array:
    """Return the derivatives of a quantity of a motion with respect to all variables.

    Parameters
    ----------
    motion : legs.dissipative.DissipativeMotion
        The motion.
    quantity : str
        One of `launch.kinds.QUANTITIES` except the turning points.
    """
    if quantity in PERIODIC_QUANTITIES:
        raise SolutionError(f"gradient: a motion with losses does not repeat, and so it has no {quantity}")
    if quantity in EXTREMES:
        return extreme(motion, quantity)
    changes = motion._changes
    if not motion._end_of_legs() < np.inf:
        raise SolutionError(
            f"gradient: this motion goes on for ever and has no {quantity}, or only after too many turns to follow its "
            "derivatives"
        )
    place, delay = end(motion, changes)
    if quantity == "t_end":
        return delay
    if motion.legs[-1].end != "rest":
        raise SolutionError(f"gradient: this motion has no rest_position; it ends with {motion.legs[-1].end!r}")
    return place


def turning_points(motion: Any) -> list[list[float]]:
    """Return the derivatives of the turning points of a motion: a list for each, with respect to all variables."""
    turns, runs = motion._turns_with_runs()
    problem = motion.problem
    found: list[list[float]] = []  # `list[list[float]]()` takes a microsecond
    if problem.launch.v0.value == 0.0:  # the launch is one
        found.append([*[0.0] * len(problem.p), 1.0, 0.0])
    if not turns:
        return found
    if problem.formulas.chart is None:
        rows = changes_of_turns(problem, runs).tolist()
        found += [rows[k] for k in turns]
        return found
    changes = motion._changes_along(runs)
    laps, ends = np.array([changes.runs[k].laps for k in turns]), changes.ends
    columns: Array = changes.parameter_change(ends[turns, SIGMA].T, ends[turns, ARC].T, laps)
    found += columns.T.tolist()
    return found


def end(motion: Any, changes: Changes) -> tuple[Array, Array]:
    """Return the derivatives of the place and the time at which a motion ends; zero if ``t_max`` ends it, or if it ends
    at once.
    """
    what, k, zero = motion.legs[-1].end, len(changes.runs) - 1, np.zeros(changes.variables)
    if what == "horizon" or motion._end_of_legs() == 0.0:
        return zero, zero
    run, (sigma, y, delay, arc) = changes.runs[k], changes.ends[k]
    if what == "rest":
        return changes.parameter_change(sigma, arc, run.laps), delay
    if what not in ("liftoff", "domain-end") or not run.ahead:
        raise SolutionError(f"gradient: the end of a motion by {what!r} has none")
    at_end, speed = changes.at_end(k)
    law, v, at = LawRows(changes.law.matrix(at_end)), run.record[HEADING], run.record[END]
    if what == "liftoff" and _is_at_break(changes, at):
        moved = zero  # the contact force changes its sign by a jump, the place of which is fixed
    elif what == "liftoff":
        by_place, by_w, *by_parameters = changes.law.sided(at_end)
        faster = y - law.force[0, 0] * sigma
        change = changes.by_all(np.array(by_parameters)) + by_w * faster
        moved = -change / (by_place + by_w * law.force[0, 0])
    else:
        moved = changes.ranges[0 if v < 0.0 else 1]
    return changes.parameter_change(moved, arc, run.laps), delay + v * law.ds[0] * (moved - sigma) / speed


def _is_at_break(changes: Changes, place: float) -> bool:
    """Return whether the force may jump at a place."""
    return bool(np.abs(place - changes.breaks).min(initial=np.inf) <= AT_BREAK * abs(place))


@entry(MATRIX(INTEGER, VECTOR, VECTOR))
def balance_at(static_balance, p, places):  # type: ignore[no-untyped-def]
    """Return the accelerations, at places, of a body at rest that is about to move forwards or backwards."""
    out = np.empty((2, places.size))
    call_static_balance(static_balance, places.size, places, p, out)
    return out


def nearest_switch(static_balance: int, p: Array, turns: Sequence[Leg], period: float) -> Switch | None:
    """Return the turn at which the number of legs is nearest to changing; None if no force can hold the body at any
    turn.

    Parameters
    ----------
    static_balance : int
        The address of the module's function.
    p : array
        Run-time parameters.
    turns : sequence of Leg
        The legs that end with a turn, or with rest.
    period : float
        That of the curve's parameter, or 0.
    """
    places = np.array([leg.lam_end for leg in turns])
    forwards, backwards = balance_at(static_balance, p, np.mod(places, period) if period else places)
    holds, pull = 0.5 * (backwards - forwards), 0.5 * np.abs(forwards + backwards)
    margins = np.divide(pull - holds, holds, where=holds > 0.0, out=np.full(places.size, np.inf))
    if not np.isfinite(margins).any():
        return None
    k = int(np.argmin(np.abs(margins)))
    return Switch(turns[k].t_end, float(places[k]), float(margins[k]))


def extreme(motion: Any, quantity: str) -> Array:
    """Return the derivatives of an extreme of a motion.

    Inside a leg the extreme changes as the quantity does at a fixed time, because the quantity is stationary there
    (envelope theorem); the same holds if the horizon cuts the motion there. If the motion ends by itself there, the
    time of the extreme changes too. An extreme at a jump of the force stays there, also if the body leaves the track
    at the jump.
    """
    found, of_speed = getattr(motion, quantity), quantity.startswith("v_")
    if of_speed and found.value == 0.0:
        return np.zeros(len(motion.problem.p) + 2)
    changes = motion._changes_at(motion._march_points(found.t)[0])
    t_end, moved = _searched_until(motion), np.zeros((changes.variables, 1))
    at_end, at_break = abs(t_end - found.t) <= AT_END * t_end, _is_at_break(changes, found.lam)
    if at_end and not (at_break and motion.legs[-1].end == "liftoff"):
        t, moved = t_end, end(motion, motion._changes)[1][:, None]
    else:
        t, is_stationary = _improved(motion, of_speed, found)
        if not is_stationary and at_break:
            # It is evaluated at two times on the side of the extreme, and extrapolated to the time of the extreme
            # itself.
            sides = found.t + np.array([[-1.0, -2.0], [1.0, 2.0]])[: 1 if at_end else 2] * SIDE_SHARE * t_end
            states = [motion.state(side[0]) for side in sides]
            values = [abs(state.v) if of_speed else state.normal_force for state in states]
            near, far = _changed(motion, of_speed, sides[np.argmin(np.abs(np.subtract(values, found.value)))]).T
            on_place: Array = 2.0 * near - far
            return on_place
    at_time: Array = _changed(motion, of_speed, np.array([t]), moved)[:, 0]
    return at_time


def _states_at_times(motion: Any, t: Array) -> tuple[Changes, StateChanges]:
    """Return the changes of a motion's legs, as far as they are needed, and of its states at times."""
    points, _ = motion._march_points(t)
    changes = motion._changes_at(points)
    return changes, states_at(changes, points)


def _changed(motion: Any, of_speed: bool, t: Array, moved: Array | None = None) -> Array:
    """Return the changes of the speed or the contact force at times that change by ``moved``; without it, the places
    stay fixed.
    """
    (changes, changed), v = _states_at_times(motion, t), motion.state(t).v
    if moved is None:
        moved = -changed.labels * changed.law.ds / v
    if of_speed:
        faster: Array = np.sign(v) * (changed.v + 0.5 * changed.law.force[0] / changed.law.ds * moved)
        return faster
    law = changes.law
    rate = law.parameters[0, law.mass] * law.loads(changed.states)[0] * v / changed.law.ds
    stronger: Array = changed.normal_force + rate * moved
    return stronger


def forces_at_places(motion: Any, places: Array) -> Array:
    """Return the derivatives of the contact force along the motion and at fixed places of its launch leg: a row for the
    place, and one for each variable.
    """
    changes, changed = _states_at_times(motion, np.array([motion.time_at(place) for place in places.tolist()]))
    law = changes.law
    by_place = law.parameters[0, law.mass] * law.loads(changed.states)[0]
    found: Array = np.vstack([by_place, changed.normal_force - by_place * changed.lam])
    return found


def _searched_until(motion: Any) -> float:
    """Return the time in s up to which extremes are searched for, or of the third turn of a swing that dies away for
    ever.
    """
    t_end: float = motion._end_of_legs()
    return t_end if t_end < np.inf else float(motion._up_to_turn(3).segments[-1].t_stop[0])


def _improved(motion: Any, of_speed: bool, found: Any) -> tuple[float, bool]:
    """Return the time of an extreme inside a leg by Newton's method, and whether the quantity is stationary there.

    The time is left where it is not.
    """
    t, t_end = found.t, _searched_until(motion)
    for _ in range(NEWTON_STEPS):
        changes, changed = _states_at_times(motion, np.array([t]))
        law = changed.law
        slope, by_place, by_w = law.force if of_speed else changes.law.loads(changed.states)
        slope_rate, v = by_place[0] + by_w[0] * law.force[0, 0], motion.state(t).v
        step = -slope[0] / slope_rate * law.ds[0] / v if slope_rate and v else np.inf
        if not abs(step) <= MAX_STEP * t_end or not 0.0 <= t + step <= t_end:
            return float(found.t), False
        t += step
    return float(t), True
