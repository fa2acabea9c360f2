"""The period of a motion and the time from its end to the launch, in doubles or in extended precision."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate
from math import ceil, log10
from typing import Any

import numpy as np

from gqm_sym.budgets import budget
from gqm_sym.errors import InputError, SolutionError
from gqm_sym.runtime.arithmetic.doubledouble import ZERO, Pair
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.problem import Problem
from gqm_sym.runtime.motion.segment import Segment
from gqm_sym.runtime.multiprecision.exact_panels import exact_ends
from gqm_sym.runtime.multiprecision.exact_problem import MAX_SMOOTH_PANELS, Arithmetic, two_doubles
from gqm_sym.runtime.quadrature.substitution import REGULAR, TURN_TURN

# Digits of a period as two doubles, and of the time from a turning point to the launch, which no count of periods
# multiplies.
PERIOD_DIGITS = 34
PHASE_DIGITS = 22
MOST_DIGITS = 1000

# Digits of V**2 that a stretch may lack throughout without being given more to work with.
SMALL = 4


@dataclass(frozen=True, slots=True)
class Timing:
    """Times of a periodic motion, each as two doubles.

    Attributes
    ----------
    duration : pair of float
        Half period of a libration, loop time of a circulation.
    phase : pair of float
        Time from the lower turning point to the launch (libration).
    offsets : (float, float)
        The launch place from both ends of the stretch: ``lam0 - a`` and ``b - lam0``.
    marks : pair of arrays, or None
        Time at each edge of the stretch's panels, where there are many: between them the pace varies.
    """

    duration: Pair
    phase: Pair
    offsets: tuple[float, float]
    marks: tuple[Array, Array] | None = None


def plain(kind: str, stretch: Segment, offsets: tuple[float, float]) -> Timing:
    """Times in doubles, from the stretch's own quadrature."""
    duration = (stretch.duration, 0.0)
    if kind == "circulation" or offsets[0] == 0.0:
        return Timing(duration, ZERO, offsets)
    if offsets[1] == 0.0:
        return Timing(duration, duration, offsets)
    phase = float(stretch.times(np.array([stretch.anomaly_of(*offsets)]))[0])
    return Timing(duration, (phase, 0.0), offsets)


@budget("quadrature", 60.0, "launch a little farther from the equilibrium, or cut the curve at its narrow places")
def exact(problem: Problem, kind: str, direction: int, stretch: Segment) -> Timing:
    """Times of the exact problem."""
    a = _arithmetic(problem, stretch, PERIOD_DIGITS)
    parts, low, high = _durations(a, problem, kind, direction, stretch, PERIOD_DIGITS)
    duration = sum(parts)
    marks = _marks(parts) if len(parts) > 1 else None
    if kind == "circulation":
        return Timing(two_doubles(duration), ZERO, (0.0, stretch.b - stretch.a), marks)
    offsets = (float(a.lam0 - low), float(high - a.lam0))
    if problem.w0 == 0.0:
        at_low = abs(a.lam0 - low) < abs(high - a.lam0)
        return Timing(two_doubles(duration), ZERO if at_low else two_doubles(duration), offsets, marks)
    c = a.context
    start = 2 * c.atan2(c.sqrt(a.lam0 - low), c.sqrt(high - a.lam0))
    edges = [a.mpf(float(e)) for e in stretch.edges if e < start]
    phase = sum(a.gauss(TURN_TURN, low, high, [*edges, start], PHASE_DIGITS))
    return Timing(two_doubles(duration), two_doubles(phase), offsets, marks)


def _marks(parts: Sequence[Any]) -> tuple[Array, Array]:
    """Running totals from zero, each as two doubles."""
    pairs = np.array([ZERO, *(two_doubles(total) for total in accumulate(parts))])
    return np.ascontiguousarray(pairs[:, 0]), np.ascontiguousarray(pairs[:, 1])


def turning_points(problem: Problem, stretch: Segment) -> tuple[float, float]:
    """Both turning points of a libration, each the double nearest to the exact one."""
    a = _arithmetic(problem, stretch, PERIOD_DIGITS)
    low, high = exact_ends(problem.exact, a.digits, TURN_TURN, stretch.a, stretch.b, stretch.ends)
    return float(low), float(high)


@budget("period_to", 600.0, "ask for fewer digits")
def period_to(problem: Problem, kind: str, direction: int, stretch: Segment, digits: int) -> str:
    """The period with that many correct digits."""
    if not isinstance(digits, int) or not 1 <= digits <= MOST_DIGITS:
        raise InputError(f"period_to: digits must be a whole number from 1 to {MOST_DIGITS}, got {digits!r}")
    a = _arithmetic(problem, stretch, digits + 5)
    duration = sum(_durations(a, problem, kind, direction, stretch, digits + 5)[0])
    value = 2 * duration if kind == "libration" else duration
    return str(a.context.nstr(value, digits, strip_zeros=False))


def _arithmetic(problem: Problem, stretch: Segment, digits: int) -> Arithmetic:
    """Arithmetic precise enough for V**2 by subtraction to keep that many digits at every node."""
    enough = digits + 20 + (60 if stretch.from_exact else 0)
    rough = problem.exact.at(enough)
    middle = rough.mpf(0.5 * (stretch.a + stretch.b))
    top = abs(rough.speed_squared(middle)) / rough.size
    lost = ceil(-log10(float(top))) if 0 < top < 1 else 0
    return problem.exact.at(enough + lost) if lost > SMALL else rough


def _durations(
    a: Arithmetic, problem: Problem, kind: str, direction: int, stretch: Segment, digits: int
) -> tuple[list[Any], Any, Any]:
    """Half period or loop time, whole or panel by panel, and the exact ends of the stretch."""
    if kind == "circulation":
        low, high, code, stop = a.lam0, a.lam0 + direction * a.track.period(), REGULAR, a.mpf(1)
    else:
        low, high = exact_ends(problem.exact, a.digits, TURN_TURN, stretch.a, stretch.b, stretch.ends)
        code, stop = TURN_TURN, a.context.pi
    few = len(stretch.edges) - 1 <= MAX_SMOOTH_PANELS
    if few and a.track.joints(low, high) is None:
        value = a.trapezoid(a.time_rate(code, low, high), stop, digits)
        if value is not None:
            return [value], low, high
    edges = [*(a.mpf(float(e)) for e in stretch.edges[:-1]), stop]
    parts = a.gauss(code, low, high, edges, digits)
    if not all(part > 0 for part in parts):
        raise SolutionError("period: extended precision gives no finite time; please report this launch")
    return [sum(parts)] if few else parts, low, high
