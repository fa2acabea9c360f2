"""From a launch to a motion: how far it reaches each way, of what kind it is, and the stretches it runs through."""

from math import inf, isfinite

import numpy as np

from gqm_sym.errors import LaunchError, SolutionError
from gqm_sym.runtime import search
from gqm_sym.runtime.entries import first_step, frame_at, speed_squared_at, walk_on
from gqm_sym.runtime.exact_panels import DIGITS, lay_exactly
from gqm_sym.runtime.formulas import Formulas, Given, Launch
from gqm_sym.runtime.functions import Functions
from gqm_sym.runtime.motion import Motion
from gqm_sym.runtime.panels import LEAST_BALANCE, REGULAR
from gqm_sym.runtime.passage import OpenEnd, Passage
from gqm_sym.runtime.periodic import Periodic
from gqm_sym.runtime.problem import Problem, Reach
from gqm_sym.runtime.rest import Rest
from gqm_sym.runtime.stretch import Stretch
from gqm_sym.runtime.stretches import between_turns, from_turn, through
from gqm_sym.runtime.surveying import survey

# ds at an end of the domain, against its value at the launch, that makes the end a cusp.
CUSP_SHARE = 1e-7
# How far from a place ds is looked at to tell whether it is a cusp, and where a walk from one begins; in first steps.
NEAR_CUSP = 1e-3
OFF_CUSP = 1e-6


def solve(formulas: Formulas, p: Given, launch: Launch) -> Motion:
    """The motion that a launch begins, as long as contact lasts."""
    motion = _bilateral(formulas, p, launch)
    if launch.contact == "bilateral" or not isinstance(motion, Periodic):
        return motion  # a passage looks after its contact itself
    passage = Passage(motion.problem, "transit", motion.direction)
    for piece in motion.one_period:
        passage.append(piece)
    return passage.finish() if passage.lifted_off else motion


def _bilateral(formulas: Formulas, p: Given, launch: Launch) -> Motion:
    low, high, period, _, place, step = domain = formulas.domain(p)
    f = formulas.functions(p, launch)
    problem = Problem(formulas, launch, p, f, domain)
    lam0, v0 = launch.lam0.value, launch.v0.value
    if v0 == 0.0 and _is_in_corner(problem):
        return Rest(problem)
    direction, ahead, behind, time = survey(
        f.addresses, f.p, lam0, v0, launch.direction, low, high, period, place, step
    )
    stuck = ahead[0] in (search.CUSP, search.BROKEN) and ahead[1] == 0.0
    if direction == 0 or stuck or time != time:
        _check_place(problem)
    if (direction == 0 or stuck) and _is_cusp(problem, lam0):
        return _from_cusp(problem)
    if direction == 0:
        sign = problem.decider.slope_sign()
        if sign == 0:
            return Rest(problem)
        direction = -sign
        reach = period or _room(problem, direction)
        ahead = walk_on(f.addresses, f.p, lam0, 0.0, direction, 0.0, reach, starting_step(problem))
    known = time if time == time and f.breaks.size == 0 else None
    if known is not None and ahead[0] == search.TURN:  # a libration without difficulties
        a, b = lam0 + ahead[1], lam0 + behind[1]
        offsets = abs(min(ahead[1], behind[1])), abs(max(ahead[1], behind[1]))
        return Periodic(problem, "libration", direction, between_turns(f, min(a, b), max(a, b), known), offsets)
    front = _reach(problem, direction, ahead)
    if front.what == "closed":
        end = lam0 + direction * period
        stretch = through(f, lam0, end, lam0, problem.w0, known=known)
        return Periodic(problem, "circulation", direction, stretch)
    if front.what != "turn":
        return _outward(problem, direction, front)
    if problem.w0 == 0.0:
        back = Reach("turn", problem.lam0)
    else:
        step = starting_step(problem)
        limit = period - abs(front.place - problem.lam0) if period else _room(problem, -direction)
        start = walk_on(f.addresses, f.p, problem.lam0, problem.w0, -direction, 0.0, limit, step)
        back = _reach(problem, -direction, start)
    if back.what == "turn":
        ends = sorted((front, back), key=lambda reach: reach.place)
        exact = (ends[0].exact, ends[1].exact)
        return Periodic(
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
    x, z = (float(row[0]) for row in frame_at(f.addresses, f.p, np.array([lam0]), np.zeros(1))[:2])
    if not (isfinite(x) and isfinite(z)):
        raise LaunchError(
            f"lam0: the curve has no point at {problem.formulas.parameter} = {lam0!r} with these parameters: "
            f"x = {x!r}, z = {z!r}"
        )


def starting_step(problem: Problem) -> float:
    """A step along the curve to begin with."""
    step: float = first_step.py_func(*problem.domain[:3])
    return step


def _room(problem: Problem, direction: int) -> float:
    return problem.high - problem.lam0 if direction > 0 else problem.lam0 - problem.low


def _reach(problem: Problem, direction: int, walked: tuple[int, float, float]) -> Reach:
    """What a walk found, with the exact problem asked where doubles could not decide."""
    f, lam0 = problem.functions, problem.lam0
    limit = problem.period or _room(problem, direction)
    for _ in range(100):
        what, near, far = walked
        if what == search.CRITICAL:
            end = problem.decider.resolve(lam0 + near, lam0 + far, direction)
            if end.what == "equilibrium" and _is_cusp(problem, float(end.place)):
                return Reach("cusp", float(end.place), end.place, level=True)
            if end.what != "clear":
                origin = lam0 if f.exact is None else f.exact.at(DIGITS).lam0
                return Reach(end.what, float(end.place), end.place, offset=float(end.place - origin))
            walked = walk_on(
                f.addresses,
                f.p,
                lam0,
                problem.w0,
                direction,
                max(abs(far), 1e-300),
                limit,
                starting_step(problem),
            )
            continue
        if what == search.TURN:
            return Reach("turn", lam0 + near, offset=near)
        if what == search.LIMIT:
            if problem.period and problem.w0 == 0.0:  # back at the launch place, where V**2 is zero again
                walked = (search.CRITICAL, near * (1.0 - 1e-4), near)
                continue
            if problem.period:
                return Reach("closed", lam0 + direction * problem.period)
            return domain_end(problem, direction)
        if what == search.CUSP:
            return Reach("cusp", lam0 + far)
        if what == search.MARCHED:
            return Reach("open", direction * inf)
        return Reach("open", lam0 + far)  # a pole: how long it takes to get there, stretch by stretch
    raise SolutionError(
        f"turning points from {problem.formulas.parameter} = {lam0!r}: too many places at which V**2 nearly vanishes"
    )


def domain_end(problem: Problem, direction: int) -> Reach:
    """The end of the domain one way: what is there."""
    place, name = (problem.high, problem.domain.ends[1]) if direction > 0 else (problem.low, problem.domain.ends[0])
    if not isfinite(place):
        return Reach("open", place)
    f = problem.functions
    here = np.array([problem.lam0, place])
    ds = frame_at(f.addresses, f.p, here, np.zeros(2))[2]
    return Reach("cusp" if ds[1] <= CUSP_SHARE * ds[0] else name, place)


def _is_cusp(problem: Problem, place: float) -> bool:
    """Whether ds vanishes at a place, against its values near by."""
    f, near = problem.functions, NEAR_CUSP * starting_step(problem)
    ds = frame_at(f.addresses, f.p, place + near * np.array([0.0, -1.0, 1.0]), np.zeros(3))[2]
    return bool(ds[0] <= 1e-10 * np.nanmax(ds[1:]))


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
            return Rest(problem)
        begin *= 1e-3  # so slow a launch turns sooner
    direction = ways[0] if w0 == 0.0 else asked
    if direction not in ways:
        raise leaving_at_once(problem, direction, "cusp")
    walked = walk_on(f.addresses, f.p, lam0, w0, direction, begin, problem.period or _room(problem, direction), begin)
    front = _reach(problem, direction, walked)
    passage = Passage(problem, "transit", direction)
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


def leaving_at_once(problem: Problem, direction: int, what: str) -> LaunchError:
    """What to say where a launch would leave the curve at once."""
    return LaunchError(
        f"lam0: {problem.lam0!r} is the {what} itself, and the motion would leave through it at once; "
        f"launch with direction={-direction} or from a place inside the domain"
    )


def _outward(problem: Problem, direction: int, front: Reach) -> Motion:
    """A motion that leaves the launch place for good, without turning."""
    f, lam0 = problem.functions, problem.lam0
    if abs(front.place - lam0) <= 1e-15 * max(abs(lam0), 1.0):
        raise leaving_at_once(problem, direction, front.what)
    kind = "asymptotic" if front.what == "equilibrium" else "transit"
    passage = Passage(problem, kind, direction)
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


def _swing(f: Functions, turn: float, end: Reach) -> Stretch:
    """From a turning point to an end: where V**2 vanishes there too, as between two turning points."""
    return between_turns(f, turn, end.place) if end.level else from_turn(f, turn, end.place)


def _gathering_speed(passage: Passage, top: float) -> float:
    """Run from a launch that is slow against what follows to half-way to the equilibrium; where that comes to.

    Seen from the equilibrium, V**2 at a slow launch is the small difference of large numbers.
    """
    problem, f, lam0, w0 = passage.problem, passage.problem.functions, passage.problem.lam0, passage.problem.w0
    middle = 0.5 * (lam0 + top)
    places = np.array([middle])
    fastest = speed_squared_at(f.addresses, f.p, lam0, problem.launch.lam0.low, w0, places, places - lam0)[0]
    if w0 >= fastest:
        return lam0
    if w0 >= LEAST_BALANCE * fastest or f.exact is None:
        passage.add(through(f, lam0, middle, lam0, w0), 1, "")
        return middle
    # As slow as this the launch is next to an equilibrium, its place to be taken as exactly as it was given.
    scale = f.exact.at(DIGITS)
    panels = lay_exactly(f.exact, REGULAR, (scale.lam0, scale.mpf(middle)), 1.0)
    slow = Stretch(functions=f, kind=REGULAR, a=lam0, b=middle, ref=lam0, w=w0, laid=panels)
    passage.add(slow, 1, "")
    return middle


def _returning(problem: Problem, direction: int, front: Reach, back: Reach) -> Motion:
    """A motion that turns once and leaves the other way."""
    f, lam0 = problem.functions, problem.lam0
    kind = "asymptotic" if back.what == "equilibrium" else "transit"
    passage = Passage(problem, kind, direction)
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
