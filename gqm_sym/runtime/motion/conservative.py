"""The motion of a conservative model that begins with a launch: its ends, its kind, and its segments."""

from collections.abc import Callable
from math import inf, isfinite, ulp

import numpy as np

from gqm_sym.errors import LaunchError, SolutionError
from gqm_sym.literals.numbers import read_number
from gqm_sym.runtime.arithmetic.doubledouble import ULP
from gqm_sym.runtime.charts.chart import CORNER_ROUNDINGS
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch import zeros
from gqm_sym.runtime.launch.ends import (
    EndOfMotion,
    distance_to_end,
    end_of_motion,
    first_zero_from,
    is_cusp,
    leaving_at_once,
    starting_step,
    too_steep,
)
from gqm_sym.runtime.launch.formulas import Formulas, ParameterValues
from gqm_sym.runtime.launch.kinds import MotionKind
from gqm_sym.runtime.launch.problem import Problem, bind_all
from gqm_sym.runtime.launch.request import Launch
from gqm_sym.runtime.launch.speed import path_and_force_at, potential_at, speed_squared_at
from gqm_sym.runtime.launch.survey import survey
from gqm_sym.runtime.motion.aperiodic import AperiodicMotion, OpenEnd
from gqm_sym.runtime.motion.at_rest import MotionAtRest
from gqm_sym.runtime.motion.motion import Motion
from gqm_sym.runtime.motion.periodic import PeriodicMotion
from gqm_sym.runtime.motion.segments.kinds import between_turns, from_cusp, from_turn, through
from gqm_sym.runtime.motion.segments.segment import Segment
from gqm_sym.runtime.multiprecision.exact_panels import lay_exactly, rates_between
from gqm_sym.runtime.quadrature.substitution import REGULAR
from gqm_sym.runtime.quadrature.time_panels import MIN_CANCELLATION_RATIO

# Distance from a cusp or a corner, as a share of the first step, at which V**2 is evaluated and a search begins.
NEAR_CUSP = 1e-6

# The smaller of two distances from a cusp, as a share of the first step, at which the tangential forces are compared.
FORCE_SHARE = 1e-4

# A corner within so many roundings of an end of the motion counts as that end; a body comes to rest on a corner if V**2
# there is at most so many roundings of its terms.
RIDGE_ROUNDINGS = 16.0

# The distance beyond the double nearest to a launch place at which V**2 is evaluated, in units of the double's last
# place.
HILLTOP_ROUNDINGS = 64.0


def solve(formulas: Formulas, p: ParameterValues, launch: Launch) -> Motion:
    """Compute the motion that begins with a launch, as long as contact lasts.

    Parameters
    ----------
    formulas : Formulas
        The record of a conservative module.
    p : ParameterValues
        The exact values of its run-time parameters.
    launch : Launch
        The launch of the motion.

    Returns
    -------
    Motion
        The motion, which computes its answers on request.

    Raises
    ------
    LaunchError
        If the curve has no point at the launch place, or the motion would leave the domain at once.
    SolutionError
        If the kind of the motion cannot be decided.
    """
    motion = _as_bilateral(formulas, p, launch)
    if launch.contact == "bilateral" or not isinstance(motion, PeriodicMotion):
        return motion  # an aperiodic motion itself finds the place where contact is lost
    until_liftoff = AperiodicMotion(motion.problem, "transit", motion.direction)
    for timed in motion.one_period:
        until_liftoff._append(timed)
    return until_liftoff._finish() if until_liftoff._lifted_off else motion


def _as_bilateral(formulas: Formulas, p: ParameterValues, launch: Launch) -> Motion:
    """Return the motion if contact is never lost; if it is aperiodic, only the part for which contact lasts."""
    f, domain = bind_all(formulas, p), formulas.domain(p)
    problem = Problem(formulas, launch, p, domain)
    lam0, v0 = launch.lam0.value, launch.v0.value
    near = CORNER_ROUNDINGS * ulp(lam0)
    if v0 == 0.0 and f.corners.size and f.between(f.corners, lam0 - near, lam0 + near).size:
        behind_v2, ahead_v2 = _speeds_beside(problem)
        if behind_v2 < 0.0 and ahead_v2 < 0.0:
            return MotionAtRest(problem)
        # The body slides down the plane that descends, and from a ridge in the direction of launch. It is placed next
        # to the corner, on that plane. No double is the corner itself, and more digits might place it on the other
        # plane.
        direction = launch.direction if behind_v2 > 0.0 and ahead_v2 > 0.0 else 1 if ahead_v2 > behind_v2 else -1
        lam0 += direction * near
        problem = Problem(formulas, launch._replace(lam0=read_number(lam0, where="lam0"), point=None), p, domain, f)
    is_smooth = f.breaks.size == 0
    direction, ahead, behind, time = survey(f.addresses, f.p, lam0, v0, launch.direction, domain.numbers, is_smooth)
    is_stuck = ahead[0] in (zeros.CUSP, zeros.NOT_FINITE) and ahead[1] == 0.0
    if direction == 0 or is_stuck or (is_smooth and time != time):
        _check_place(problem)
    if (direction == 0 or is_stuck) and is_cusp(problem, lam0):
        return _from_cusp(problem)
    if direction == 0:
        sign = problem.deciding_problem.slope_sign()
        if sign == 0:
            return MotionAtRest(problem)
        direction = -sign
        length = problem.period or distance_to_end(problem, direction)
        begin = _beyond_hilltop(problem, direction)
        ahead = first_zero_from(f.addresses, f.p, lam0, 0.0, direction, begin, length, starting_step(problem))
    known_duration = time if time == time else None
    if known_duration is not None and ahead[0] == zeros.TURN:  # doubles have determined the libration completely
        near, far = min(ahead[1], behind[1]), max(ahead[1], behind[1])
        ends = lam0 + near, lam0 + far
        return PeriodicMotion(
            problem,
            "libration",
            direction,
            lambda: between_turns(problem.functions, *ends, known_duration),
            (abs(near), abs(far)),
        )
    f = problem.functions
    front = end_of_motion(problem, direction, ahead)
    _check_ridges(problem, front.place)
    if front.what == "closed":
        end = lam0 + direction * problem.period
        segment = through(f, lam0, end, lam0, problem.w0, known_duration=known_duration)
        return PeriodicMotion(problem, "circulation", direction, segment)
    if front.what != "turn":
        return _without_turn(problem, direction, front)
    back = _opposite_end(problem, direction, front)
    _check_ridges(problem, back.place)
    if back.what != "turn":
        return _with_one_turn(problem, direction, front, back)
    low, high = sorted((front, back), key=lambda end: end.place)
    ends = low.multiprecision, high.multiprecision
    # A curve with many joints has as many panels, which are not needed for the half period: it is computed from the
    # true curve.
    is_lazy = f.breaks.size > 0 and ends == (None, None) and (f.exact is not None or problem.true_pieces is not None)
    segment = between_turns(f, low.place, high.place, ends=ends, is_lazy=is_lazy)
    return PeriodicMotion(problem, "libration", direction, segment, (abs(low.offset), abs(high.offset)))


def _check_ridges(problem: Problem, end: float) -> None:
    """Refuse a motion that comes to rest on a corner between its launch and an end, because it may slide off in either
    direction.

    On a smooth curve a body takes an infinite time to reach such a place, which is the end of its motion. A corner is
    reached in finite time, with a V**2 that is zero within rounding.
    """
    f, lam0 = problem.functions, problem.lam0
    if not f.corners.size or not isfinite(end):
        return
    near = RIDGE_ROUNDINGS * ulp(max(abs(lam0), abs(end)))
    corners = f.between(f.corners, *sorted((lam0, end)))
    # A body that is launched at rest on a ridge slides in the direction of launch whenever it comes back.
    corners = corners[(np.abs(corners - lam0) > near) & (np.abs(corners - end) > near)]
    if corners.size:
        v2 = speed_squared_at(f.addresses, f.p, lam0, problem.launch.lam0.low, problem.w0, corners, corners - lam0)
        heights = np.abs(potential_at(f.addresses, f.p, np.append(corners, lam0))[0])
        ridges = corners[np.abs(v2) <= RIDGE_ROUNDINGS * ULP * (problem.w0 + 2.0 * heights.max())]
        if ridges.size:
            raise SolutionError(
                f"the body comes to rest on the corner at {problem.formulas.parameter} = {float(ridges[0])!r}, from "
                "where it may slide either way; launch it a little higher or faster to pass the corner, or lower to "
                "turn before it"
            )


def _opposite_end(problem: Problem, direction: int, front: EndOfMotion) -> EndOfMotion:
    """Return the end of the motion behind the launch place, if there is a turning point ahead."""
    if problem.w0 == 0.0:
        return EndOfMotion("turn", problem.lam0)
    f, period = problem.functions, problem.period
    length = period - abs(front.place - problem.lam0) if period else distance_to_end(problem, -direction)
    step = starting_step(problem)
    found = first_zero_from(f.addresses, f.p, problem.lam0, problem.w0, -direction, 0.0, length, step)
    return end_of_motion(problem, -direction, found)


def _speeds_beside(problem: Problem) -> Array:
    """Return V**2 a little before and after the launch place, which is a corner, for a body at rest there."""
    f, lam0 = problem.functions, problem.lam0
    offsets = NEAR_CUSP * starting_step(problem) * np.array([-1.0, 1.0])
    v2: Array = speed_squared_at(f.addresses, f.p, lam0, problem.launch.lam0.low, 0.0, lam0 + offsets, offsets)
    return v2


def _beyond_hilltop(problem: Problem, direction: int) -> float:
    """Return the distance from the launch at which a search begins, beyond a hilltop that lies between the launch and
    the double nearest to it.
    """
    f, lam0 = problem.functions, problem.lam0
    if not problem.launch.lam0.low:
        return 0.0
    beyond = HILLTOP_ROUNDINGS * ulp(lam0)
    offset = np.array([direction * beyond])
    v2 = speed_squared_at(f.addresses, f.p, lam0, 0.0, 0.0, lam0 + offset, offset)
    return beyond if v2[0] > 0.0 else 0.0


def _check_place(problem: Problem) -> None:
    """Refuse a launch at a place where the curve has no point, because a coordinate is the root of a negative
    number, or where ds/dlam is infinite.
    """
    f, lam0 = problem.functions, problem.lam0
    x, z, ds = (float(row[0]) for row in path_and_force_at(f.addresses, f.p, np.array([lam0]), np.zeros(1))[:3])
    if not (isfinite(x) and isfinite(z)):
        raise LaunchError(
            f"lam0: the curve has no point at {problem.formulas.parameter} = {lam0!r} with these parameters: "
            f"x = {x!r}, z = {z!r}"
        )
    if ds == inf:
        raise too_steep(problem, lam0)


def _from_cusp(problem: Problem) -> Motion:
    """Return a motion that begins at a cusp: it leads into the domain, and downhill if the body is released there."""
    f, lam0, w0 = problem.functions, problem.lam0, problem.w0
    begin, directions = _directions_from_cusp(problem)
    if not directions or (w0 == 0.0 and _is_level_cusp(problem)):
        return MotionAtRest(problem)
    direction = directions[0] if w0 == 0.0 else problem.launch.direction
    if direction not in directions:
        raise leaving_at_once(problem, direction, "cusp")
    length = problem.period or distance_to_end(problem, direction)
    front = end_of_motion(
        problem, direction, first_zero_from(f.addresses, f.p, lam0, w0, direction, begin, length, begin)
    )
    motion = AperiodicMotion(problem, "transit", direction)
    if w0 > 0.0 and front.what in ("cusp", "domain-end", "singular-point"):
        # A slow body gains and loses its speed over distances that equal steps would miss, so the width of panels grows
        # from both ends.
        steps = np.geomspace(1e-12, 0.25, 25) * (front.place - lam0)
        panel_breaks = (*(lam0 + steps), *(front.place - steps))
        motion._add(through(f, lam0, front.place, lam0, w0, panel_breaks=panel_breaks), 1, front.what)
        return motion._finish()
    if front.what != "turn":
        return _without_turn(problem, direction, front, from_cusp)
    if w0 == 0.0:
        middle = 0.5 * (lam0 + front.place)
        beside_cusp, beside_turn = from_cusp(f, lam0, middle), from_turn(f, front.place, middle)
        parts = [(beside_cusp, 1, ""), (beside_turn, -1, "turn"), (beside_turn, 1, ""), (beside_cusp, -1, "cusp")]
    else:
        whole = from_turn(f, front.place, lam0)
        parts = [(whole, -1, "turn"), (whole, 1, "cusp")]
    for segment, sense, end in parts:
        motion._add(segment, sense, end)
    return motion._finish()


def _is_level_cusp(problem: Problem) -> bool:
    """Return whether the tangential force vanishes at the cusp at which the body is at rest, so that the body stays.

    If the tangent of a cusp is horizontal, the force decreases to zero with the distance; otherwise it tends to a
    nonzero limit.
    """
    f, step = problem.functions, starting_step(problem)
    places = problem.lam0 + step * np.array([[FORCE_SHARE, -FORCE_SHARE], [10.0 * FORCE_SHARE, -10.0 * FORCE_SHARE]])
    slopes = potential_at(f.addresses, f.p, places.ravel())[1]
    ds = path_and_force_at(f.addresses, f.p, places.ravel(), np.zeros(4))[2]
    nearer, farther = np.abs(slopes / ds).reshape(2, 2)
    return not np.any(nearer > 0.5 * farther)


def _directions_from_cusp(problem: Problem) -> tuple[float, list[int]]:
    """Return a distance from the cusp, and the directions in which V**2 > 0 at that distance; that of the launch comes
    first.
    """
    f, lam0, w0, first = problem.functions, problem.lam0, problem.w0, problem.launch.direction
    distance = NEAR_CUSP * starting_step(problem)
    while True:
        offsets = np.array([distance, -distance]) * first
        v2 = speed_squared_at(f.addresses, f.p, lam0, problem.launch.lam0.low, w0, lam0 + offsets, offsets)
        directions = [
            direction
            for direction, value in zip((first, -first), v2, strict=True)
            if value > 0.0 and distance_to_end(problem, direction) > distance
        ]
        if directions or w0 == 0.0:
            return distance, directions
        distance *= 1e-3  # the slower the launch is, the sooner the body turns


def _without_turn(
    problem: Problem, direction: int, front: EndOfMotion, from_rest: Callable[..., Segment] = from_turn
) -> Motion:
    """Return a motion that has no turning point ahead; ``from_rest`` makes the segment from a launch at rest."""
    f, lam0 = problem.functions, problem.lam0
    if front.place == lam0:
        raise leaving_at_once(problem, direction, front.what)
    kind: MotionKind = "asymptotic" if front.what == "equilibrium" else "transit"
    motion = AperiodicMotion(problem, kind, direction)
    if problem.w0 > 0.0:
        if front.what == "equilibrium":
            motion._approach(_to_half_way(motion, front.place), front.place)
        elif front.what == "open":
            motion._leave_open(OpenEnd(lam0, direction, front.place))
        else:
            ref, ref_v2 = (front.place, 0.0) if front.zero_v2 else (lam0, problem.w0)
            motion._add(through(f, lam0, front.place, ref, ref_v2), 1, front.what)
        return motion._finish()
    if front.what == "equilibrium":
        middle = 0.5 * (lam0 + front.place)
        motion._add(from_rest(f, lam0, middle), 1, "")
        motion._approach(middle, front.place)
    elif front.what == "open":
        middle = lam0 + direction * min(1.0, 0.5 * abs(front.place - lam0))
        motion._add(from_rest(f, lam0, middle), 1, "")
        motion._leave_open(OpenEnd(middle, direction, front.place))
    else:
        _add_way_to_end(motion, from_rest, lam0, front)
    return motion._finish()


def _add_way_to_end(motion: AperiodicMotion, from_rest: Callable[..., Segment], turn: float, end: EndOfMotion) -> None:
    """Add the way from a place at rest to an end; V**2 vanishes there too if it is a cusp as high as that place."""
    f, middle = motion.problem.functions, 0.5 * (turn + end.place)
    if end.zero_v2:
        motion._add(from_rest(f, turn, middle), 1, "")
        motion._add(from_cusp(f, end.place, middle), -1, end.what)
    else:
        motion._add(from_rest(f, turn, end.place), 1, end.what)


def _to_half_way(motion: AperiodicMotion, equilibrium: float) -> float:
    """Add the first half of the way to an equilibrium if the launch is slow; return the place at which the rest begins.

    If V**2 were computed from the equilibrium, it would be a small difference of large numbers at a slow launch.
    """
    problem, f, lam0, w0 = motion.problem, motion.problem.functions, motion.problem.lam0, motion.problem.w0
    middle = 0.5 * (lam0 + equilibrium)
    places = np.array([middle])
    middle_v2 = speed_squared_at(f.addresses, f.p, lam0, problem.launch.lam0.low, w0, places, places - lam0)[0]
    if w0 >= middle_v2:
        return lam0
    if w0 >= MIN_CANCELLATION_RATIO * middle_v2 or f.exact is None:
        motion._add(through(f, lam0, middle, lam0, w0), 1, "")
        return middle
    # So slow a launch is next to another equilibrium, and its place is needed as exactly as it was given.
    joints = ((f.between(f.breaks, lam0, middle) - lam0) / (middle - lam0)).tolist()
    rates, _ = rates_between(f.exact, REGULAR, (lam0, middle), (None, None), joints)
    panels, speed_terms = lay_exactly(rates, 1.0)
    slow = Segment(
        functions=f, kind=REGULAR, a=lam0, b=middle, ref=lam0, ref_v2=w0, stored_panels=panels, speed_terms=speed_terms
    )
    motion._add(slow, 1, "")
    return middle


def _with_one_turn(problem: Problem, direction: int, front: EndOfMotion, back: EndOfMotion) -> Motion:
    """Return a motion that has a turning point ahead and none behind the launch place."""
    f, lam0 = problem.functions, problem.lam0
    kind: MotionKind = "asymptotic" if back.what == "equilibrium" else "transit"
    motion = AperiodicMotion(problem, kind, direction)
    inbound = from_turn(f, front.place, lam0)
    motion._add(inbound, -1, "turn")
    if back.what == "open":
        motion._add(inbound, 1, "")
        motion._leave_open(OpenEnd(lam0, -direction, back.place))
    elif back.what == "equilibrium":
        middle = 0.5 * (front.place + back.place)
        motion._add(from_turn(f, front.place, middle), 1, "")
        motion._approach(middle, back.place)
    else:
        _add_way_to_end(motion, from_turn, front.place, back)
    return motion._finish()
