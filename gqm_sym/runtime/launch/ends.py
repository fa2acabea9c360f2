"""The ends of a motion in each direction from its launch."""

from dataclasses import dataclass
from math import fabs, inf, isfinite
from typing import Any, cast

import numpy as np
from numba import types

from gqm_sym.budgets import check_budget
from gqm_sym.errors import LaunchError, SolutionError
from gqm_sym.runtime.compiled.calls import call_bounds, call_effective_potential
from gqm_sym.runtime.compiled.intrinsics import choose, floor_of
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.types import ADDRESSES, REAL, VECTOR
from gqm_sym.runtime.launch import zeros
from gqm_sym.runtime.launch.kinds import EndKind
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.launch.rounded import ZERO_SHARE
from gqm_sym.runtime.launch.speed import path_and_force_at, potential_at, speed_squared_at
from gqm_sym.runtime.launch.zeros import (
    CRITICAL,
    LIMIT,
    MIN_STEP_SHARE,
    TURN,
    FoundEnd,
    SearchArrays,
    first_zero,
    speed_squared,
)
from gqm_sym.runtime.multiprecision.exact_panels import DIGITS
from gqm_sym.runtime.multiprecision.exact_problem import End
from gqm_sym.runtime.quadrature.trapezoid import CIRCULATION, LIBRATION

# A `FoundEnd` as Python receives it; making a plain tuple is faster.
END_TYPE = types.Tuple((types.int64, REAL, REAL))

# `orbit_kind` of a motion that is not periodic, or that doubles cannot decide.
NO_ORBIT = -1

# A launch from rest may be an equilibrium if the change of the effective potential over the first step, by its slope,
# is below this share of the potential's size: the problem in extended precision then decides.
FLAT_SHARE = 1e-12

# The mirror image of a launch from rest is not used if the launch is this near to an axis (as a share of the
# parameter), or beyond the second share of the way from one axis to the next: it may be an equilibrium there.
NEAR_AXIS, MAX_AXIS_STEP_SHARE = 1e-6, 0.9

# ds at an end of the domain, as a share of its value at the launch, up to which the end is a cusp.
CUSP_SHARE = 1e-7

# The share of the gains and losses of V**2 on the way to an end of the domain above which V**2 at that end excludes a
# turning point; and the number of places on the way at which the slope of the potential is evaluated.
DOMAIN_END_V2_SHARE, GAIN_SAMPLES = 1e-12, 5

# The distance from a place at which ds is compared with ds at the place itself to decide whether that is a cusp, as a
# share of the first step; and, on a curve of unknown size, smaller distances as shares of that one.
NEAR_CUSP, NEARER_TO_CUSP = 1e-3, 2.0 ** (-10.0 * np.arange(1.0, 7.0))

# ds has no bound next to a place if it grows by more than the first factor each time that the distance decreases by the
# second one, twice, to the third as a share of the parameter. It grows by less next to the pole of a logarithm, and
# next to that of a power above -1/8.
STEEP_GROWTH, STEEP_RATIO, STEEP_DISTANCE = 2.0**0.5, 16.0, 2.0**-28

# The largest number of places with nearly vanishing V**2 that a search passes.
MAX_BARRIERS = 100


@Inner
def first_step(domain):  # type: ignore[no-untyped-def]
    """Return the step with which a search begins: an eighth of the curve if its length is known."""
    if domain.period > 0.0:
        return domain.period / 8.0
    if isfinite(domain.high - domain.low):
        return (domain.high - domain.low) / 8.0
    return 1.0


@entry(END_TYPE(ADDRESSES, VECTOR, REAL, REAL, types.int64, REAL, REAL, REAL))
def first_zero_from(fns, p, lam0, w0, direction, begin, length, step):  # type: ignore[no-untyped-def]
    """Call `zeros.first_zero` from Python."""
    found = first_zero(fns, p, lam0, w0, direction, begin, length, step)
    return found.what, found.near, found.far


@Inner
def distance_to_axis(start, direction, axis, step):  # type: ignore[no-untyped-def]
    """Return the distance to the first axis of symmetry ahead; negative if the only axis (``step`` 0) is behind."""
    away = direction * (axis - start)
    return choose(step > 0.0, away - step * floor_of(away / step), away)


@Inner
def mirror_image(fns, p, lam0, direction, length, domain):  # type: ignore[no-untyped-def]
    """Return the offset of the turning point of a body that is released at rest in an even well; 0 if a search must
    find it.

    V**2 grows all the way to the first axis ahead and falls all the way from there to the next, so the turning point is
    the mirror image of the launch place.
    """
    axis, step = domain.axis, domain.axis_step
    ahead = distance_to_axis(lam0, float(direction), axis, step)
    guess = 2.0 * ahead
    # The first comparison is false (NaN) if no axis is known.
    near_axis = not (ahead > NEAR_AXIS * (fabs(lam0) + fabs(axis)) and guess <= length)
    if near_axis or (step > 0.0 and ahead > MAX_AXIS_STEP_SHARE * step):
        return 0.0
    guess *= direction
    arrays, middle = SearchArrays(np.empty(2), np.empty((2, 1)), np.empty(4)), lam0 + 0.5 * guess
    error = MIN_STEP_SHARE * (fabs(lam0) + fabs(middle))
    call_bounds(fns.bounds, middle - error, middle + error, p, arrays.bounds)
    if not isfinite(arrays.bounds[1] - arrays.bounds[0]):
        return 0.0  # the potential may have a pole there
    v2, _size = speed_squared(fns, p, lam0, 0.0, guess, arrays)
    call_effective_potential(fns.effective_potential, 1, arrays.point, p, arrays.rows)
    correction = v2 / (2.0 * arrays.rows[1, 0])  # one step of Newton's method, because the axis is rounded
    return guess + correction if fabs(correction) <= NEAR_AXIS * fabs(guess) else 0.0


@Inner
def downhill(fns, p, lam0, step):  # type: ignore[no-untyped-def]
    """Return the direction in which a body released at rest falls; 0 next to an equilibrium, where doubles cannot
    decide.
    """
    rows, size = np.empty((2, 3)), 0.0
    call_effective_potential(fns.effective_potential, 3, lam0 + step * np.array([0.0, 1.0, -1.0]), p, rows)
    for potential in rows[0]:
        if isfinite(potential):
            size = max(size, fabs(potential))
    if not fabs(rows[1, 0]) * step > FLAT_SHARE * size:
        return 0
    return -1 if rows[1, 0] > 0.0 else 1


@Inner
def ends(fns, p, lam0, v0, direction, domain):  # type: ignore[no-untyped-def]
    """Return the ends of a motion in each direction, and the direction in which it begins.

    Returns
    -------
    direction : int
        The sign of ds/dt after launch (a body released at rest moves in the direction in which it falls); 0 if doubles
        cannot decide.
    ahead, behind : FoundEnd
        The results of `zeros.first_zero` in this direction, and in the other one if ``ahead`` is a turning point.
    """
    nothing = FoundEnd(LIMIT, 0.0, 0.0)
    w0, period = v0 * v0, domain.period
    step = first_step(domain)
    if w0 == 0.0:
        direction = downhill(fns, p, lam0, step)
        if direction == 0:
            return 0, FoundEnd(CRITICAL, 0.0, 0.0), nothing
    length = period if period > 0.0 else (domain.high - lam0 if direction > 0 else lam0 - domain.low)
    if w0 == 0.0:
        turn = mirror_image(fns, p, lam0, direction, length, domain)
        if turn != 0.0:
            return direction, FoundEnd(TURN, turn, turn), FoundEnd(TURN, 0.0, 0.0)
    ahead = first_zero(fns, p, lam0, w0, direction, 0.0, length, step)
    if ahead.what != TURN:
        return direction, ahead, nothing
    if w0 == 0.0:
        return direction, ahead, FoundEnd(TURN, 0.0, 0.0)
    length = period - fabs(ahead.near) if period > 0.0 else (lam0 - domain.low if direction > 0 else domain.high - lam0)
    return direction, ahead, first_zero(fns, p, lam0, w0, -direction, 0.0, length, step)


@Inner
def orbit_kind(direction, ahead, behind, v0, period):  # type: ignore[no-untyped-def]
    """Return LIBRATION or CIRCULATION, given the results of `ends`; NO_ORBIT for any other motion, or if that is not
    decided.
    """
    if direction == 0:
        return NO_ORBIT
    if ahead.what == TURN and behind.what == TURN:
        return LIBRATION
    return CIRCULATION if ahead.what == LIMIT and period > 0.0 and v0 > 0.0 else NO_ORBIT


@dataclass(frozen=True, slots=True)
class EndOfMotion:
    """The end of the motion in one direction, and its kind.

    Attributes
    ----------
    what : str
        One of `kinds.EndKind`.
    place : float
        The curve parameter there, infinite if the motion goes on for ever.
    multiprecision : mpf or None
        The same in extended precision, if it was found that way.
    zero_v2 : bool
        For a cusp, whether V**2 vanishes there as well; the motion nevertheless reaches it in a finite time.
    offset : float
        For a turning point, its signed distance from the launch place, which is accurate even if both places are the
        same double.
    """

    what: EndKind
    place: float
    multiprecision: Any = None
    zero_v2: bool = False
    offset: float = 0.0


def starting_step(problem: Problem) -> float:
    """Return the step along the curve that a search begins with, in units of the curve parameter."""
    step: float = first_step.py_func(problem.domain.numbers)
    return step


def distance_to_end(problem: Problem, direction: int) -> float:
    """Return the distance from the launch place to the end of the domain in one direction."""
    return problem.high - problem.lam0 if direction > 0 else problem.lam0 - problem.low


def search_beyond_barriers(
    problem: Problem, direction: int, found: tuple[int, float, float], length: float, step: float
) -> tuple[tuple[int, float, float], End | None]:
    """Continue a search beyond places that doubles cannot decide but at which V**2 is positive in extended precision.

    Parameters
    ----------
    found : (what, near, far)
        The result of the search so far (`zeros.FoundEnd`).
    length, step : float
        The distance from the launch up to which to search, and the first step beyond a place.

    Returns
    -------
    found : (what, near, far)
        The result of the continued search. If that is CRITICAL, extended precision has decided it.
    end : End or None
        The turning point or equilibrium that extended precision found.
    """
    f, lam0 = problem.functions, problem.lam0
    for _ in range(MAX_BARRIERS):
        check_budget()
        what, near, far = found
        if what != CRITICAL:
            return found, None
        end = problem.deciding_problem.resolve(lam0 + near, lam0 + far, direction)
        if end.what != "clear":
            return found, end
        begin = max(abs(far), 1e-300)
        found = first_zero_from(f.addresses, f.p, lam0, problem.w0, direction, begin, length, step)
    if not isfinite(length):  # the farthest that any search goes on an endless curve
        return (zeros.STEPS_SPENT, begin, begin), None
    raise _too_many_barriers(problem)


def _speed_overflows(problem: Problem, offset: float) -> bool:
    """Return whether V**2 is so large at an offset from the launch that numbers overflow beyond."""
    f, offsets = problem.functions, np.array([offset])
    v2 = speed_squared_at(f.addresses, f.p, problem.lam0, 0.0, problem.w0, problem.lam0 + offsets, offsets)[0]
    return not v2 <= zeros.OVERFLOW_V2


def _too_many_barriers(problem: Problem) -> SolutionError:
    """Return the error for a curve with too many places that doubles cannot decide."""
    return SolutionError(
        f"turning points from {problem.formulas.parameter} = {problem.lam0!r}: "
        "too many places at which V**2 nearly vanishes; launch a little higher, or with more speed"
    )


def end_of_motion(problem: Problem, direction: int, found: tuple[int, float, float]) -> EndOfMotion:
    """Return the end of the motion in one direction, from a search and, where needed, from extended precision."""
    lam0, period, step = problem.lam0, problem.period, starting_step(problem)
    length = period or distance_to_end(problem, direction)
    for _ in range(MAX_BARRIERS):
        found, end = search_beyond_barriers(problem, direction, found, length, step)
        if found[0] != LIMIT or not period or problem.w0 > 0.0:
            break
        # The search has returned to the launch place of a body released from rest, where V**2 is zero again.
        found = (CRITICAL, found[1] * (1.0 - 1e-4), found[1])
    else:
        raise _too_many_barriers(problem)
    if end is not None:
        return _decided_end(problem, end)
    what, near, far = found
    if what == zeros.TURN:
        return EndOfMotion("turn", lam0 + near, offset=near)
    if what == zeros.STEPS_SPENT and not _speed_overflows(problem, near):
        # On an endless curve a search that goes far shows that the body does too, unless its first step was too wide;
        # and steps become short where the curve is steep.
        goes_far = not isfinite(length) and (abs(near) >= step or is_steep(problem, direction, lam0 + near))
        if not goes_far:
            raise _too_many_barriers(problem)
    if what == zeros.LIMIT and period:
        return EndOfMotion("closed", lam0 + direction * period)
    place = lam0 + (near if what == zeros.STEPS_SPENT else far)
    if is_steep(problem, direction, place):
        if abs(place - lam0) <= STEEP_DISTANCE * abs(lam0):
            raise too_steep(problem, place)
        return EndOfMotion("open", place)
    if what == zeros.LIMIT:
        return _end_of_curve(problem, direction)
    if what == zeros.CUSP:
        return EndOfMotion("cusp", lam0 + far)
    if what == zeros.STEPS_SPENT:
        return EndOfMotion("open", direction * inf)
    return EndOfMotion("open", lam0 + far)  # a pole: the time to it is computed segment by segment


def _end_of_curve(problem: Problem, direction: int) -> EndOfMotion:
    """Return the end of the domain, or a turning point if V**2 vanishes there, as for a body released at one lip of a
    half pipe.

    The ends of a chart are known to a rounding only; V**2 counts as zero there if it is zero within that. Its size is
    compared with the gains and losses of V**2 on the way, because a body launched next to the end has a small V**2
    there anyway.
    """
    end, exact, f, lam0 = domain_end(problem, direction), problem.functions.exact, problem.functions, problem.lam0
    offset = end.place - lam0
    if end.what != "domain-end" or offset == 0.0:
        return end
    places = np.array([lam0, end.place])
    v2 = speed_squared_at(f.addresses, f.p, lam0, problem.launch.lam0.low, problem.w0, places[1:], places[1:] - lam0)[0]
    slopes = potential_at(f.addresses, f.p, lam0 + offset * np.linspace(0.0, 1.0, GAIN_SAMPLES))[1]
    size = problem.w0 + 2.0 * abs(offset) * float(np.abs(slopes[np.isfinite(slopes)]).max(initial=0.0))
    if v2 > DOMAIN_END_V2_SHARE * size:
        return end
    if exact is None or problem.formulas.domain_of is None:
        stops = abs(v2) <= ZERO_SHARE * size
    else:
        scale = exact.at(DIGITS)
        ends = problem.formulas.domain_of(scale.context, tuple(number.at(scale.context) for number in problem.p))
        v2_there = scale.speed_squared(ends[1 if direction > 0 else 0])
        stops = v2_there <= scale.mpf(10) ** (-DIGITS // 2) * size
    return EndOfMotion("turn", end.place, offset=offset) if stops else end


def _decided_end(problem: Problem, end: End) -> EndOfMotion:
    """Return the turning point or the equilibrium that was found in extended precision."""
    place = min(max(float(end.place), problem.low), problem.high)
    if end.what == "equilibrium" and is_cusp(problem, place):
        return EndOfMotion("cusp", place, end.place, zero_v2=True)
    exact = problem.functions.exact
    origin = problem.lam0 if exact is None else exact.at(DIGITS).lam0
    what: EndKind = "equilibrium" if end.what == "equilibrium" else "turn"
    return EndOfMotion(what, place, end.place, offset=float(end.place - origin))


def domain_end(problem: Problem, direction: int) -> EndOfMotion:
    """Return the end of the domain in one direction, and its kind."""
    upper = direction > 0
    place = problem.high if upper else problem.low
    if not isfinite(place):
        return EndOfMotion("open", place)
    f = problem.functions
    here = np.array([problem.lam0, place])
    ds = path_and_force_at(f.addresses, f.p, here, np.zeros(2))[2]
    if ds[1] <= CUSP_SHARE * ds[0]:
        return EndOfMotion("cusp", place)
    return EndOfMotion(cast(EndKind, problem.domain.ends[1 if upper else 0]), place)


def is_steep(problem: Problem, direction: int, place: float) -> bool:
    """Return whether ds/dlam has no bound next to a place ahead, as where the graph of a root is vertical."""
    f, size = problem.functions, max(abs(problem.lam0), abs(place))
    places = place - direction * STEEP_DISTANCE * size * STEEP_RATIO ** np.arange(3)
    near, middle, far = path_and_force_at(f.addresses, f.p, places, np.zeros(3))[2]
    return bool(near > STEEP_GROWTH * middle and middle > STEEP_GROWTH * far)


def too_steep(problem: Problem, place: float) -> SolutionError:
    """Return the error for a motion that comes to such a place.

    Since the place is rounded, the time and the length of the rest of the way would be known to a few digits only.
    """
    name = problem.formulas.parameter
    return SolutionError(
        f"the motion comes to {name} = {place!r}, next to which ds/d{name} has no bound, so that it cannot be followed "
        f"by {name}; declare the curve by another parameter (x = u**2, z = u for z = sqrt(x)), or give a shorter "
        "t_max, or a domain that ends before that place"
    )


def is_cusp(problem: Problem, place: float) -> bool:
    """Return whether ds vanishes at a place that is known to rounding.

    Where the domain does not tell how large the curve is, ds is compared at smaller distances too: a tiny smooth curve
    has the same ds at some of them as at the place itself.
    """
    distances = [NEAR_CUSP * starting_step(problem)]
    if not (problem.period or isfinite(problem.high - problem.low)):
        distances += [d for d in distances[0] * NEARER_TO_CUSP if d >= NEAR_CUSP * abs(place)]
    return all(vanishes(problem, place, 1e-10, distance) for distance in distances)


def vanishes(problem: Problem, place: float, share: float, distance: float) -> bool:
    """Return whether ds at a place is at most a share of its values at a distance from there."""
    f, places = problem.functions, place + distance * np.array([0.0, -1.0, 1.0])
    ds = path_and_force_at(f.addresses, f.p, places, np.zeros(3))[2]
    return bool(ds[0] <= share * np.nanmax(ds[1:]))


def leaving_at_once(problem: Problem, direction: int, what: str) -> LaunchError:
    """Return the error for a launch that would leave the curve at once."""
    return LaunchError(
        f"lam0: {problem.lam0!r} is the {what} itself, and the motion would leave through it at once; "
        f"launch with direction={-direction} or from a place inside the domain"
    )
