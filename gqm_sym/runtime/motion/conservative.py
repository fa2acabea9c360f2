"""From a launch to a motion: how far it reaches each way, of what kind it is, and the stretches it runs through."""

from math import inf, isfinite

import numpy as np

from gqm_sym.errors import LaunchError
from gqm_sym.runtime.launch import zeros
from gqm_sym.runtime.launch.ends import (
    EndOfMotion,
    _is_cusp,
    _reach,
    _room,
    first_zero_from,
    leaving_at_once,
    starting_step,
)
from gqm_sym.runtime.launch.formulas import Formulas, ParameterValues
from gqm_sym.runtime.launch.functions import BoundFunctions
from gqm_sym.runtime.launch.problem import Problem, bind
from gqm_sym.runtime.launch.request import Launch
from gqm_sym.runtime.launch.speed import path_and_force_at, speed_squared_at
from gqm_sym.runtime.launch.survey import survey
from gqm_sym.runtime.motion.aperiodic import AperiodicMotion, MotionAtRest, OpenEnd
from gqm_sym.runtime.motion.motion import Motion
from gqm_sym.runtime.motion.periodic import PeriodicMotion
from gqm_sym.runtime.motion.segment import Segment, between_turns, from_turn, through
from gqm_sym.runtime.multiprecision.exact_panels import DIGITS, lay_exactly
from gqm_sym.runtime.quadrature.substitution import REGULAR
from gqm_sym.runtime.quadrature.time_panels import MIN_CANCELLATION_RATIO

OFF_CUSP = 1e-6


def solve(formulas: Formulas, p: ParameterValues, launch: Launch) -> Motion:
    """The motion that a launch begins, as long as contact lasts."""
    motion = _bilateral(formulas, p, launch)
    if launch.contact == "bilateral" or not isinstance(motion, PeriodicMotion):
        return motion  # a passage looks after its contact itself
    passage = AperiodicMotion(motion.problem, "transit", motion.direction)
    for piece in motion.one_period:
        passage.append(piece)
    return passage.finish() if passage.lifted_off else motion


def _bilateral(formulas: Formulas, p: ParameterValues, launch: Launch) -> Motion:
    low, high, period, _, place, step = domain = formulas.domain(p)
    f = bind(formulas, p, launch)
    problem = Problem(formulas, launch, p, f, domain)
    lam0, v0 = launch.lam0.value, launch.v0.value
    if v0 == 0.0 and _is_in_corner(problem):
        return MotionAtRest(problem)
    direction, ahead, behind, time = survey(
        f.addresses, f.p, lam0, v0, launch.direction, low, high, period, place, step
    )
    stuck = ahead[0] in (zeros.CUSP, zeros.BROKEN) and ahead[1] == 0.0
    if direction == 0 or stuck or time != time:
        _check_place(problem)
    if (direction == 0 or stuck) and _is_cusp(problem, lam0):
        return _from_cusp(problem)
    if direction == 0:
        sign = problem.decider.slope_sign()
        if sign == 0:
            return MotionAtRest(problem)
        direction = -sign
        reach = period or _room(problem, direction)
        ahead = first_zero_from(f.addresses, f.p, lam0, 0.0, direction, 0.0, reach, starting_step(problem))
    known = time if time == time and f.breaks.size == 0 else None
    if known is not None and ahead[0] == zeros.TURN:  # a libration without difficulties
        a, b = lam0 + ahead[1], lam0 + behind[1]
        offsets = abs(min(ahead[1], behind[1])), abs(max(ahead[1], behind[1]))
        return PeriodicMotion(problem, "libration", direction, between_turns(f, min(a, b), max(a, b), known), offsets)
    front = _reach(problem, direction, ahead)
    if front.what == "closed":
        end = lam0 + direction * period
        stretch = through(f, lam0, end, lam0, problem.w0, known=known)
        return PeriodicMotion(problem, "circulation", direction, stretch)
    if front.what != "turn":
        return _outward(problem, direction, front)
    if problem.w0 == 0.0:
        back = EndOfMotion("turn", problem.lam0)
    else:
        step = starting_step(problem)
        limit = period - abs(front.place - problem.lam0) if period else _room(problem, -direction)
        start = first_zero_from(f.addresses, f.p, problem.lam0, problem.w0, -direction, 0.0, limit, step)
        back = _reach(problem, -direction, start)
    if back.what == "turn":
        ends = sorted((front, back), key=lambda reach: reach.place)
        exact = (ends[0].exact, ends[1].exact)
        return PeriodicMotion(
            problem,
            "libration",
            direction,
            between_turns(f, ends[0].place, ends[1].place, ends=exact),
            (abs(ends[0].offset), abs(ends[1].offset)),
        )
    return _returning(problem, direction, front, back)


def _is_in_corner(problem: Problem) -> bool:
    """Whether the launch place is a corner from which the curve rises both ways."""
    f, lam0 = problem.functions, problem.lam0
    if not f.between(f.corners, *np.nextafter(lam0, (-inf, inf)).tolist()).size:
        return False
    offsets = OFF_CUSP * starting_step(problem) * np.array([-1.0, 1.0])
    w = speed_squared_at(f.addresses, f.p, lam0, problem.launch.lam0.low, 0.0, lam0 + offsets, offsets)
    return bool(np.all(w < 0.0))


def _check_place(problem: Problem) -> None:
    """Refuse a launch where the coordinates are no numbers: a root of what is negative with these parameters."""
    f, lam0 = problem.functions, problem.lam0
    x, z = (float(row[0]) for row in path_and_force_at(f.addresses, f.p, np.array([lam0]), np.zeros(1))[:2])
    if not (isfinite(x) and isfinite(z)):
        raise LaunchError(
            f"lam0: the curve has no point at {problem.formulas.parameter} = {lam0!r} with these parameters: "
            f"x = {x!r}, z = {z!r}"
        )


def _from_cusp(problem: Problem) -> Motion:
    """A motion that begins at a cusp: it leaves into the domain, and the way it falls if it is released there."""
    f, lam0, w0, asked = problem.functions, problem.lam0, problem.w0, problem.launch.direction
    begin = OFF_CUSP * starting_step(problem)
    while True:
        offsets = np.array([begin, -begin]) * asked
        w = speed_squared_at(f.addresses, f.p, lam0, problem.launch.lam0.low, w0, lam0 + offsets, offsets)
        ways = [way for way, rate in zip((asked, -asked), w, strict=True) if rate > 0.0 and _room(problem, way) > begin]
        if ways:
            break
        if w0 == 0.0:
            return MotionAtRest(problem)
        begin *= 1e-3  # so slow a launch turns sooner
    direction = ways[0] if w0 == 0.0 else asked
    if direction not in ways:
        raise leaving_at_once(problem, direction, "cusp")
    walked = first_zero_from(
        f.addresses, f.p, lam0, w0, direction, begin, problem.period or _room(problem, direction), begin
    )
    front = _reach(problem, direction, walked)
    passage = AperiodicMotion(problem, "transit", direction)
    if w0 > 0.0 and front.what in ("cusp", "domain-end", "singular-point"):
        # A slow body gathers and loses its speed over distances that even steps would miss: panels grow from both ends.
        steps = np.geomspace(1e-12, 0.25, 25) * (front.place - lam0)
        hints = (*(lam0 + steps), *(front.place - steps))
        passage.add(through(f, lam0, front.place, lam0, w0, hints=hints), 1, front.what)
        return passage.finish()
    if front.what != "turn":
        return _outward(problem, direction, front)
    if w0 == 0.0:
        swing, sense = between_turns(f, lam0, front.place), 1
    else:
        swing, sense = from_turn(f, front.place, lam0), -1
    passage.add(swing, sense, "turn")
    passage.add(swing, -sense, "cusp")
    return passage.finish()


def _outward(problem: Problem, direction: int, front: EndOfMotion) -> Motion:
    """A motion that leaves the launch place for good, without turning."""
    f, lam0 = problem.functions, problem.lam0
    if abs(front.place - lam0) <= 1e-15 * max(abs(lam0), 1.0):
        raise leaving_at_once(problem, direction, front.what)
    kind = "asymptotic" if front.what == "equilibrium" else "transit"
    passage = AperiodicMotion(problem, kind, direction)
    if problem.w0 > 0.0:
        if front.what == "equilibrium":
            passage.approach(_gathering_speed(passage, front.place), front.place)
        elif front.what == "open":
            passage.open_end = OpenEnd(lam0, direction, front.place)
        else:
            ref, w = (front.place, 0.0) if front.level else (lam0, problem.w0)
            passage.add(through(f, lam0, front.place, ref, w), 1, front.what)
        return passage.finish()
    if front.what == "equilibrium":
        middle = 0.5 * (lam0 + front.place)
        passage.add(from_turn(f, lam0, middle), 1, "")
        passage.approach(middle, front.place)
    elif front.what == "open":
        middle = lam0 + direction * min(1.0, 0.5 * abs(front.place - lam0))
        passage.add(from_turn(f, lam0, middle), 1, "")
        passage.open_end = OpenEnd(middle, direction, front.place)
    else:
        passage.add(_swing(f, lam0, front), 1, front.what)
    return passage.finish()


def _swing(f: BoundFunctions, turn: float, end: EndOfMotion) -> Segment:
    """From a turning point to an end: where V**2 vanishes there too, as between two turning points."""
    return between_turns(f, turn, end.place) if end.level else from_turn(f, turn, end.place)


def _gathering_speed(passage: AperiodicMotion, top: float) -> float:
    """Run from a launch that is slow against what follows to half-way to the equilibrium; where that comes to.

    Seen from the equilibrium, V**2 at a slow launch is the small difference of large numbers.
    """
    problem, f, lam0, w0 = passage.problem, passage.problem.functions, passage.problem.lam0, passage.problem.w0
    middle = 0.5 * (lam0 + top)
    places = np.array([middle])
    fastest = speed_squared_at(f.addresses, f.p, lam0, problem.launch.lam0.low, w0, places, places - lam0)[0]
    if w0 >= fastest:
        return lam0
    if w0 >= MIN_CANCELLATION_RATIO * fastest or f.exact is None:
        passage.add(through(f, lam0, middle, lam0, w0), 1, "")
        return middle
    # As slow as this the launch is next to an equilibrium, its place to be taken as exactly as it was given.
    scale = f.exact.at(DIGITS)
    panels = lay_exactly(f.exact, REGULAR, (scale.lam0, scale.mpf(middle)), 1.0)
    slow = Segment(functions=f, kind=REGULAR, a=lam0, b=middle, ref=lam0, w=w0, laid=panels)
    passage.add(slow, 1, "")
    return middle


def _returning(problem: Problem, direction: int, front: EndOfMotion, back: EndOfMotion) -> Motion:
    """A motion that turns once and leaves the other way."""
    f, lam0 = problem.functions, problem.lam0
    kind = "asymptotic" if back.what == "equilibrium" else "transit"
    passage = AperiodicMotion(problem, kind, direction)
    inbound = from_turn(f, front.place, lam0)
    passage.add(inbound, -1, "turn")
    if back.what == "open":
        passage.add(inbound, 1, "")
        passage.open_end = OpenEnd(lam0, -direction, back.place)
    elif back.what == "equilibrium":
        middle = 0.5 * (front.place + back.place)
        passage.add(from_turn(f, front.place, middle), 1, "")
        passage.approach(middle, back.place)
    else:
        passage.add(_swing(f, front.place, back), 1, back.what)
    return passage.finish()
