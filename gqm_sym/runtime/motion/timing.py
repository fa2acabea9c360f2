"""The period of a motion, and the time from a turning point to the launch, in doubles or in extended precision."""

from collections.abc import Sequence
from itertools import accumulate
from math import atan2, ceil, inf, nan, sqrt
from typing import Any, NamedTuple

import numpy as np

from gqm_sym.arguments import short
from gqm_sym.budgets import budget
from gqm_sym.errors import InputError, SolutionError
from gqm_sym.runtime.arithmetic.doubledouble import ZERO, Pair, minus, plus
from gqm_sym.runtime.charts.double_double.passage import ChartPassage, pass_along
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.double_double.orbit_time import (
    MAX_ERROR,
    NO_TIMES,
    BoundedNumber,
    Orbit,
    find_turning_points,
    time_orbit,
)
from gqm_sym.runtime.gradients.formula_orbit import source_of, variables_of
from gqm_sym.runtime.gradients.passages.from_turns import time_beside, times_from_turns
from gqm_sym.runtime.interface import ExactFormulas
from gqm_sym.runtime.launch.problem import Problem, launch_on_chart
from gqm_sym.runtime.motion.segments.segment import Segment
from gqm_sym.runtime.multiprecision.exact_panels import DIGITS, exact_ends
from gqm_sym.runtime.multiprecision.exact_problem import MAX_SMOOTH_PANELS, NOWHERE, Arithmetic, two_doubles
from gqm_sym.runtime.quadrature.substitution import REGULAR, TURN_TURN

# Digits of a period as two doubles, and of the time from a turning point to the launch; the latter needs fewer, because
# it is not multiplied by the number of periods.
PERIOD_DIGITS = 34
PHASE_DIGITS = 22
MAX_DIGITS = 1000

# The number of digits of V**2 that may cancel over a whole segment before the working precision is raised.
MAX_LOST_DIGITS = 4

# V**2 has digits if it is larger than this multiple of its error.
MIN_V2_ERRORS = 1e3

# The largest error of a turning point in double-double arithmetic, as a share of the width of the libration.
MAX_TURN_ERROR = 2.0**-54

# The relative error of a number of two doubles that was rounded from extended precision.
EXACT_ERROR = 2.0**-104


class Timing(NamedTuple):
    """Times of a periodic motion, each as two doubles.

    Attributes
    ----------
    duration : pair of float
        Half period of a libration or loop time of a circulation, in s.
    phase_time : pair of float
        Time in s from the lower turning point to the launch (libration).
    offsets : (float, float)
        The distances of the launch place from both ends of the segment: ``lam0 - a`` and ``b - lam0``.
    edge_times : pair of arrays, or None
        The time at each edge of the segment's panels, if there are many panels: the relative error of their times in
        doubles then differs from panel to panel.
    relative_error : float
        Bound on the relative error of the duration.
    """

    duration: Pair
    phase_time: Pair
    offsets: tuple[float, float]
    edge_times: tuple[Array, Array] | None = None
    relative_error: float = EXACT_ERROR

    @property
    def max_time(self) -> float:
        """The time in s up to which a phase is as accurate as doubles, whatever the number of periods."""
        return inf if self.relative_error <= EXACT_ERROR else self.duration[0] * 2.0**-54 / self.relative_error


def in_doubles(kind: str, segment: Segment, offsets: tuple[float, float]) -> Timing:
    """Return the times in doubles, from the segment's own quadrature."""
    duration = (segment.duration, 0.0)
    if kind == "circulation" or offsets[0] == 0.0:
        return Timing(duration, ZERO, offsets)
    if offsets[1] == 0.0:
        return Timing(duration, duration, offsets)
    # The time is scaled to the duration, from which that of the panels may differ by some roundings.
    scale = duration[0] / segment.total_time[0]
    phase_time = scale * float(segment.times(np.array([segment.phase_angle_of(*offsets)]))[0])
    # Next to a turning point it may exceed the duration by a rounding; no time from launch may be negative.
    return Timing(duration, (min(phase_time, duration[0]), 0.0), offsets)


def passage_of(problem: Problem, kind: str, direction: int, offsets: tuple[float, float]) -> ChartPassage | None:
    """Return the orbit along a chart in double-double arithmetic; None if that does not suffice, and for formulas."""
    launch = launch_on_chart(problem.formulas, problem.p, problem.launch)
    if launch is None:
        return None
    sense = direction if kind == "circulation" else 0
    distances = (0.0, direction * problem.period) if sense else (-offsets[0], offsets[1])
    low, high = sorted(launch.lam0.value + distance for distance in distances)
    return pass_along(launch, (low, high), sense)


def times_along(segment: Segment, *, is_thrown: bool) -> Array:
    """Return an array for the times at the launch and, if the trapezoidal rule does not suffice, at the edges of the
    panels.

    It is for `double_double.orbit_time.fill_times`; a launch from a turning point needs none.
    """
    edges = segment.edges[1:] if len(segment.edges) - 1 > MAX_SMOOTH_PANELS else NOWHERE
    if not is_thrown and not edges.size:
        return NO_TIMES
    times = np.zeros((3, 1 + len(edges)))
    times[0, 0], times[0, 1:] = 1.0 if is_thrown else 0.0, edges
    return times


def orbit_of(
    problem: Problem, kind: str, direction: int, offsets: tuple[float, float], times: Array = NO_TIMES
) -> Orbit | None:
    """Return the duration and the turning points in double-double arithmetic; None if that does not suffice.

    Parameters
    ----------
    offsets : (float, float)
        The distances of a libration's turning points from the launch.
    times : (3, n) array
        From `times_along`; not used for charts.
    """
    if problem.tape is None:
        return None
    if problem.formulas.chart is not None:
        passage = passage_of(problem, kind, direction, offsets)
        return None if passage is None else passage.orbit
    sense, launch = direction if kind == "circulation" else 0, (problem.launch.lam0, problem.launch.v0)
    return time_orbit(problem.tape, launch, sense, offsets, times)


def orbit_beside_hilltop(problem: Problem, offsets: tuple[float, float], times: Array) -> Orbit | None:
    """Return a libration along a curve with formulas that passes a hilltop slowly or turns beside one, and fill the
    times at its launch and at the edges of its panels; None if double-double arithmetic does not suffice.

    The duration in parts and the times of all panels, in which V**2 is a divided difference, have nothing in common,
    and have to agree.
    """
    orbit = orbit_of(problem, "libration", 0, offsets)
    if orbit is None or not isinstance(problem.formulas.exact, ExactFormulas):
        return None
    given = source_of(problem.formulas), variables_of(problem), np.array([orbit.low, orbit.high]).T
    lam0, phase = (problem.launch.lam0.value, problem.launch.lam0.low), 0.0
    edges = np.concatenate([[0.0], times[0, 1:]])
    behind, ahead = minus(lam0, orbit.low[:2]), minus(orbit.high[:2], lam0)
    if times[0, 0]:
        if not min(behind[0], ahead[0]) > 0.0:
            return None
        phase = 2.0 * atan2(sqrt(behind[0]), sqrt(ahead[0]))
    marks = np.unique(np.append(edges, phase))
    found = times_from_turns(*given, marks, MAX_ERROR * orbit.duration.high)
    if found is None:
        return None
    rows, error = found
    off = (rows[0, -1] - orbit.duration.high) + (rows[1, -1] - orbit.duration.low)
    times[1:, 1:] = rows[:, np.searchsorted(marks, edges[1:])]
    if phase:
        at_phase = rows[:, np.searchsorted(marks, phase)].tolist()
        times[1:, 0] = plus(tuple(at_phase), (time_beside(*given, phase, behind), 0.0))
    return orbit if abs(off) <= error + orbit.duration.error else None


def true_turning_points(
    problem: Problem, segment: Segment, offsets: tuple[float, float], orbit: Orbit | None
) -> tuple[Pair, Pair] | None:
    """Return the lower and the upper turning point of a libration as two doubles each; None if they are known in
    doubles only.

    They come from double-double arithmetic or, if that does not suffice for a curve with formulas, from extended
    precision. ``offsets`` are their distances from the launch to the accuracy of doubles, and ``orbit`` is the result
    of `orbit_of` for these, if it has been called.
    """
    low = high = BoundedNumber(nan, nan, nan)
    if problem.formulas.chart is not None:
        passage = passage_of(problem, "libration", 0, offsets)
        if passage is not None:
            low, high = passage.turning_points
    elif orbit is not None:
        low, high = orbit.low, orbit.high
    elif problem.tape is not None:
        low, high = find_turning_points(problem.tape, (problem.launch.lam0, problem.launch.v0), offsets)
    largest, error = MAX_TURN_ERROR * (high.high - low.high), max(low.error, high.error)
    # Along a chart the turning points in doubles may be off by much more than this error, even if it is large for so
    # small a swing.
    off = max(abs(segment.a - low.high), abs(segment.b - high.high)) if problem.formulas.chart is not None else 0.0
    if error <= largest or off > 2.0 * error:
        return low[:2], high[:2]
    if problem.formulas.chart is not None or problem.functions.exact is None:
        return None
    a, b = exact_ends(problem.exact, DIGITS, TURN_TURN, segment.a, segment.b, segment.ends)
    return two_doubles(a), two_doubles(b)


def in_double_double(
    problem: Problem,
    kind: str,
    direction: int,
    segment: Segment,
    offsets: tuple[float, float],
    known: Orbit | None = None,
) -> Timing | None:
    """Return the times from double-double arithmetic; None if that does not suffice.

    ``known`` is the result of `orbit_of` without panels, if it has been called.
    """
    is_smooth = len(segment.edges) - 1 <= MAX_SMOOTH_PANELS
    is_thrown, lam0 = kind == "libration" and problem.w0 > 0.0, problem.launch.lam0
    if problem.formulas.chart is not None:
        inner = segment.edges[1:-1] if not is_smooth else NOWHERE
        passage = passage_of(problem, kind, direction, offsets)
        orbit = None if passage is None else passage.orbit
        rows = None if passage is None or orbit is None else passage.times_at(inner, is_thrown=is_thrown)
        if passage is None or orbit is None or rows is None:
            return None
        found, phase_time, offsets = rows[:-1, :2].T, rows[-1, :2].tolist(), passage.offsets
    else:
        times = times_along(segment, is_thrown=is_thrown)
        orbit = known if known is not None and not times.size else orbit_of(problem, kind, direction, offsets, times)
        if orbit is None and times.shape[1] > 1 and kind == "libration":
            orbit = orbit_beside_hilltop(problem, offsets, times)
        if orbit is None:
            return None
        a, b, found, phase_time = orbit.low, orbit.high, times[1:, 1:-1], times[1:, :1].ravel().tolist()
        offsets = (lam0.value - a.high) + (lam0.low - a.low), (b.high - lam0.value) + (b.low - lam0.low)
    duration = orbit.duration[:2]
    edge_times = None
    if not is_smooth:
        high, low = (np.append([0.0, *found[row]], duration[row]) for row in (0, 1))
        edge_times = high, low
    if kind == "circulation":
        phase_time, offsets = ZERO, (0.0, segment.b - segment.a)
    elif not is_thrown:
        phase_time = ZERO if offsets[0] < offsets[1] else duration
    return Timing(duration, tuple(phase_time), offsets, edge_times, orbit.duration.error / duration[0])


@budget("quadrature", 60.0, "launch a little farther from the equilibrium, or cut the curve at its narrow places")
def in_multiprecision(problem: Problem, kind: str, direction: int, segment: Segment) -> Timing:
    """Return the times from extended precision."""
    a = _arithmetic(problem, segment, PERIOD_DIGITS)
    parts, low, high = _durations(a, problem, kind, direction, segment, PERIOD_DIGITS)
    duration = sum(parts)
    edge_times = _running_totals(parts) if len(parts) > 1 else None
    if kind == "circulation":
        return Timing(two_doubles(duration), ZERO, (0.0, segment.b - segment.a), edge_times)
    offsets = (float(a.lam0 - low), float(high - a.lam0))
    if problem.w0 == 0.0:
        at_low = abs(a.lam0 - low) < abs(high - a.lam0)
        return Timing(two_doubles(duration), ZERO if at_low else two_doubles(duration), offsets, edge_times)
    c = a.context
    start = 2 * c.atan2(c.sqrt(a.lam0 - low), c.sqrt(high - a.lam0))
    edges = [a.mpf(float(e)) for e in segment.edges if e < start]
    phase_time = sum(a.gauss(TURN_TURN, low, high, [*edges, start], PHASE_DIGITS))
    return Timing(two_doubles(duration), two_doubles(phase_time), offsets, edge_times)


def _running_totals(parts: Sequence[Any]) -> tuple[Array, Array]:
    """Return the partial sums, beginning with zero, each as two doubles."""
    pairs = np.array([ZERO, *(two_doubles(total) for total in accumulate(parts))])
    return np.ascontiguousarray(pairs[:, 0]), np.ascontiguousarray(pairs[:, 1])


def turning_points(problem: Problem, segment: Segment) -> tuple[float, float]:
    """Return the lower and the upper turning point of a libration, each the double nearest to the exact one."""
    a = _arithmetic(problem, segment, PERIOD_DIGITS)
    low, high = exact_ends(problem.exact, a.digits, TURN_TURN, segment.a, segment.b, segment.ends)
    return float(low), float(high)


@budget("period_to", 600.0, "ask for fewer digits")
def period_to(problem: Problem, kind: str, direction: int, segment: Segment, digits: int) -> str:
    """Return the period in s as a decimal string with that many correct digits; see `Motion.period_to`."""
    _check_digits(digits)
    a = _arithmetic(problem, segment, digits + 5)
    duration = sum(_durations(a, problem, kind, direction, segment, digits + 5)[0])
    value = 2 * duration if kind == "libration" else duration
    return str(a.context.nstr(value, digits, strip_zeros=False))


def period_from(duration: BoundedNumber, kind: str, digits: int) -> str:
    """Return the period as `period_to` does, from a half period or loop time in double-double arithmetic."""
    _check_digits(digits)
    from mpmath.ctx_mp import MPContext

    context = MPContext()
    context.dps = 2 * PERIOD_DIGITS
    value, error = context.mpf(duration.high) + context.mpf(duration.low), context.mpf(duration.error)
    bounds = [2 * bound if kind == "libration" else bound for bound in (value - error, value + error)]

    def decided(count: int) -> str | None:
        low, high = (context.nstr(bound, count, strip_zeros=False) for bound in bounds)
        return str(low) if low == high else None

    found = decided(digits) if digits <= PERIOD_DIGITS else None
    if found is not None:
        return found
    known = next((count for count in range(PERIOD_DIGITS, 0, -1) if decided(count) is not None), 0)
    raise SolutionError(
        f"period_to: along this track the period is known to {known} digits; ask for no more, or declare the curve by "
        "formulas"
    )


def _check_digits(digits: int) -> None:
    if not isinstance(digits, int) or not 1 <= digits <= MAX_DIGITS:
        raise InputError(f"period_to: digits must be a whole number from 1 to {MAX_DIGITS}, got {short(digits)}")


def _arithmetic(problem: Problem, segment: Segment, digits: int) -> Arithmetic:
    """Return arithmetic in which V**2, by subtraction of potentials, keeps that many digits at every node."""
    working_digits = digits + 20 + (60 if segment.from_multiprecision else 0)
    middle, rough = 0.5 * (segment.a + segment.b), problem.exact.at(working_digits)
    while True:
        place = rough.mpf(middle)
        v2, error = abs(rough.speed_squared(place)), rough.error_of_speed_squared(place)
        if v2 > MIN_V2_ERRORS * error or rough.digits >= MAX_DIGITS:
            break
        rough = problem.exact.at(2 * rough.digits)  # all digits cancel
    # The search for a turning point stops at half of the digits of its place. On a narrow orbit it needs twice the
    # digits by which the place is larger than the orbit: V**2 is the curvature times the square of the orbit's width.
    curvature = sum(abs(rough.potential_curvature(lam)) for lam in (place, rough.lam0))
    size = error * rough.mpf(10) ** rough.digits + curvature * place**2
    lost = ceil(rough.context.log10(size / v2)) if v2 and size else 0
    return problem.exact.at(working_digits + lost) if lost > MAX_LOST_DIGITS else rough


def _durations(
    a: Arithmetic, problem: Problem, kind: str, direction: int, segment: Segment, digits: int
) -> tuple[list[Any], Any, Any]:
    """Return the half period or loop time, as a whole or panel by panel, and both ends of the segment in extended
    precision.
    """
    if kind == "circulation":
        low, high, code, stop = a.lam0, a.lam0 + direction * a.track.period(), REGULAR, a.mpf(1)
    else:
        low, high = exact_ends(problem.exact, a.digits, TURN_TURN, segment.a, segment.b, segment.ends)
        code, stop = TURN_TURN, a.context.pi
    is_smooth = len(segment.edges) - 1 <= MAX_SMOOTH_PANELS
    if is_smooth and a.track.joints(low, high) is None:
        value = a.trapezoid(a.time_rate(code, low, high), stop, digits)
        if value is not None:
            return [value], low, high
    edges = [*(a.mpf(float(e)) for e in segment.edges[:-1]), stop]
    parts = a.gauss(code, low, high, edges, digits)
    if not all(part > 0 for part in parts):
        raise SolutionError("period: extended precision gives no finite time; please report this launch")
    return [sum(parts)] if is_smooth else parts, low, high
