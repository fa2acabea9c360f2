"""How far a motion reaches each way from its launch, and what ends it there."""

from dataclasses import dataclass
from math import fabs, inf, isfinite
from typing import Any

import numpy as np
from numba import types

from gqm_sym.errors import LaunchError, SolutionError
from gqm_sym.runtime.compiled.calls import call_effective_potential
from gqm_sym.runtime.compiled.intrinsics import choose, whole_below
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.types import ADDRESSES, REAL, VECTOR
from gqm_sym.runtime.launch import zeros
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.launch.speed import path_and_force_at
from gqm_sym.runtime.launch.zeros import CRITICAL, LIMIT, TURN, first_zero, speed_squared
from gqm_sym.runtime.multiprecision.exact_panels import DIGITS

END_TYPE = types.Tuple((types.int64, REAL, REAL))

# A launch from rest on a slope below this share of the climb's size may be an equilibrium: exact numbers decide.
FLAT = 1e-12

# A launch this near to an axis is not mirrored by what doubles know of it, nor one beyond this share of the way to the
# next: there it may be an equilibrium.
UNCLEAR, ALL_BUT = 1e-6, 0.9


@Inner
def first_step(low, high, period):  # type: ignore[no-untyped-def]
    """A step to begin a walk with: an eighth of the curve where that is known."""
    if period > 0.0:
        return period / 8.0
    if isfinite(high - low):
        return (high - low) / 8.0
    return 1.0


@entry(END_TYPE(ADDRESSES, VECTOR, REAL, REAL, types.int64, REAL, REAL, REAL))
def first_zero_from(fns, p, lam0, w0, direction, begin, reach, step):  # type: ignore[no-untyped-def]
    """`search.walk`, for Python."""
    return first_zero(fns, p, lam0, w0, direction, begin, reach, step)


@Inner
def distance_to_axis(start, way, place, step):  # type: ignore[no-untyped-def]
    """How far the first axis of symmetry is ahead; of a lone one (``step`` 0) less than nothing where it is behind."""
    away = way * (place - start)
    return choose(step > 0.0, away - step * whole_below(away / step), away)


@Inner
def mirror_image(fns, p, lam0, direction, reach, place, step):  # type: ignore[no-untyped-def]
    """How far a body released at rest comes in an even well, beyond the first axis ahead; 0 where walking must tell.

    V**2 rises all the way to the axis and falls all the way to the next, ``step`` farther (0: there is no other).
    """
    ahead = distance_to_axis(lam0, float(direction), place, step)
    guess = 2.0 * ahead
    # NaN where no axis is known; next to one, or to where the body would just come over the next, walking is safer.
    if not (ahead > UNCLEAR * (fabs(lam0) + fabs(place)) and guess <= reach) or (step > 0.0 and ahead > ALL_BUT * step):
        return 0.0
    guess *= direction
    spot, rows = np.empty(2), np.empty((2, 1))
    left, _size = speed_squared(fns, p, lam0, 0.0, guess, spot, rows)
    call_effective_potential(fns.effective_potential, 1, spot, p, rows)
    more = left / rows[1, 0]  # a step of Newton's method, for what the axis is rounded by
    return guess + more if fabs(more) <= UNCLEAR * fabs(guess) else 0.0


@Inner
def ends(fns, p, lam0, v0, direction, low, high, period, place, step):  # type: ignore[no-untyped-def]
    """How far a motion reaches each way, and which way it goes.

    ``place`` and ``step`` are of even wells between whose axes V**2 rises or falls all the way; else ``place`` is NaN.

    Returns
    -------
    direction : int
        The sign of ds/dt after launch (a body released at rest goes where it falls); 0 where exact numbers must decide.
    ahead, behind : (what, near, far)
        As `search.walk` returns them; ``behind`` is walked only if ``ahead`` is a turning point.
    """
    nothing = (LIMIT, 0.0, 0.0)
    w0 = v0 * v0
    begin = first_step(low, high, period)
    if w0 == 0.0:
        rows, size = np.empty((2, 3)), 0.0
        call_effective_potential(fns.effective_potential, 3, lam0 + begin * np.array([0.0, 1.0, -1.0]), p, rows)
        for height in rows[0]:
            if isfinite(height):
                size = max(size, fabs(height))
        if not fabs(rows[1, 0]) * begin > FLAT * size:
            return 0, (CRITICAL, 0.0, 0.0), nothing
        direction = -1 if rows[1, 0] > 0.0 else 1
    reach = period if period > 0.0 else (high - lam0 if direction > 0 else lam0 - low)
    if w0 == 0.0:
        turn = mirror_image(fns, p, lam0, direction, reach, place, step)
        if turn != 0.0:
            return direction, (TURN, turn, turn), (TURN, 0.0, 0.0)
    ahead = first_zero(fns, p, lam0, w0, direction, 0.0, reach, begin)
    if ahead[0] != TURN:
        return direction, ahead, nothing
    if w0 == 0.0:
        return direction, ahead, (TURN, 0.0, 0.0)
    reach = period - fabs(ahead[1]) if period > 0.0 else (lam0 - low if direction > 0 else high - lam0)
    return direction, ahead, first_zero(fns, p, lam0, w0, -direction, 0.0, reach, begin)


@dataclass(frozen=True, slots=True)
class EndOfMotion:
    """How far the motion goes one way, and what is there.

    ``what`` is "turn", "equilibrium", "domain-end", "singular-point", "cusp", "closed", or "open" (towards infinity or
    a pole). ``level`` marks a cusp at which V**2 vanishes as well: it is reached in finite time all the same.
    ``offset`` is a turning point's from the launch, which keeps its digits where both are one place in doubles.
    """

    what: str
    place: float
    exact: Any = None
    level: bool = False
    offset: float = 0.0


# ds at an end of the domain, against its value at the launch, that makes the end a cusp.
CUSP_SHARE = 1e-7

# How far from a place ds is looked at to tell whether it is a cusp, and where a walk from one begins; in first steps.
NEAR_CUSP = 1e-3


def starting_step(problem: Problem) -> float:
    """A step along the curve to begin with."""
    step: float = first_step.py_func(*problem.domain[:3])
    return step


def _room(problem: Problem, direction: int) -> float:
    return problem.high - problem.lam0 if direction > 0 else problem.lam0 - problem.low


def _reach(problem: Problem, direction: int, walked: tuple[int, float, float]) -> EndOfMotion:
    """What a walk found, with the exact problem asked where doubles could not decide."""
    f, lam0 = problem.functions, problem.lam0
    limit = problem.period or _room(problem, direction)
    for _ in range(100):
        what, near, far = walked
        if what == zeros.CRITICAL:
            end = problem.decider.resolve(lam0 + near, lam0 + far, direction)
            if end.what == "equilibrium" and _is_cusp(problem, float(end.place)):
                return EndOfMotion("cusp", float(end.place), end.place, level=True)
            if end.what != "clear":
                origin = lam0 if f.exact is None else f.exact.at(DIGITS).lam0
                return EndOfMotion(end.what, float(end.place), end.place, offset=float(end.place - origin))
            walked = first_zero_from(
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
        if what == zeros.TURN:
            return EndOfMotion("turn", lam0 + near, offset=near)
        if what == zeros.LIMIT:
            if problem.period and problem.w0 == 0.0:  # back at the launch place, where V**2 is zero again
                walked = (zeros.CRITICAL, near * (1.0 - 1e-4), near)
                continue
            if problem.period:
                return EndOfMotion("closed", lam0 + direction * problem.period)
            return domain_end(problem, direction)
        if what == zeros.CUSP:
            return EndOfMotion("cusp", lam0 + far)
        if what == zeros.MARCHED:
            return EndOfMotion("open", direction * inf)
        return EndOfMotion("open", lam0 + far)  # a pole: how long it takes to get there, stretch by stretch
    raise SolutionError(
        f"turning points from {problem.formulas.parameter} = {lam0!r}: too many places at which V**2 nearly vanishes"
    )


def domain_end(problem: Problem, direction: int) -> EndOfMotion:
    """The end of the domain one way: what is there."""
    place, name = (problem.high, problem.domain.ends[1]) if direction > 0 else (problem.low, problem.domain.ends[0])
    if not isfinite(place):
        return EndOfMotion("open", place)
    f = problem.functions
    here = np.array([problem.lam0, place])
    ds = path_and_force_at(f.addresses, f.p, here, np.zeros(2))[2]
    return EndOfMotion("cusp" if ds[1] <= CUSP_SHARE * ds[0] else name, place)


def _is_cusp(problem: Problem, place: float) -> bool:
    """Whether ds vanishes at a place, against its values near by."""
    f, near = problem.functions, NEAR_CUSP * starting_step(problem)
    ds = path_and_force_at(f.addresses, f.p, place + near * np.array([0.0, -1.0, 1.0]), np.zeros(3))[2]
    return bool(ds[0] <= 1e-10 * np.nanmax(ds[1:]))


def leaving_at_once(problem: Problem, direction: int, what: str) -> LaunchError:
    """What to say where a launch would leave the curve at once."""
    return LaunchError(
        f"lam0: {problem.lam0!r} is the {what} itself, and the motion would leave through it at once; "
        f"launch with direction={-direction} or from a place inside the domain"
    )
