"""The times for which a load on the rider is beyond a level: between the places where it equals that level.

Along each segment of a motion the load is a smooth function of the phase angle. It is written as Chebyshev polynomials
on parts that are halved until they resolve it; all roots of these are found, and a few secant steps on the load itself
make each of them exact to rounding.
"""

from collections.abc import Callable, Sequence
from math import inf
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.polynomial import chebyshev

from gqm_sym.arguments import one_of, short
from gqm_sym.errors import InputError
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.motion.extremes import Quantity, phases
from gqm_sym.runtime.motion.parts.searched import whole_trajectory
from gqm_sym.runtime.motion.riding.loads import load_of
from gqm_sym.runtime.motion.trajectory import TimedSegment, Trajectory

# The number of nodes of each polynomial, the share of its last coefficients below which it resolves the load well
# enough to separate its roots, and the largest number of times that a part is halved.
NODES, MAX_TAIL, MAX_HALVINGS = 16, 1e-9, 10

# The nodes of a polynomial on [-1, 1], and the matrix that takes values there to Chebyshev coefficients.
_ANGLES = np.pi * (np.arange(NODES) + 0.5) / NODES
_AT, _FIT = np.cos(_ANGLES), (2.0 / NODES) * np.cos(np.outer(_ANGLES, np.arange(NODES)))
_FIT[:, 0] *= 0.5

# The number of steps that make a root exact, and the distance by which rounding may put a root of the polynomial
# outside of its part.
STEPS, OUTSIDE = 3, 1e-9

# Spans of time that are separated by less than this share of the time are joined, because segments of a motion follow
# each other to rounding.
SAME_TIME = 1e-13

Span: TypeAlias = tuple[float, float]


class Exceedance(NamedTuple):
    """The times for which a load is beyond each of some levels.

    Attributes
    ----------
    levels : float or array
        The levels in units of 9.80665 m/s**2.
    total : float or array
        The times in s for which the load is beyond them, over one period or over the whole motion.
    longest : float or array
        The longest of these times without interruption, in s. It is infinite if a motion that repeats is always beyond
        the level.
    allowed : float or array or None
        The longest time in s that the limits allow at each level: infinite below all of them, 0 above. None if no
        limits were given.
    """

    levels: Any
    total: Any
    longest: Any
    allowed: Any = None

    @property
    def within(self) -> Any:
        """Whether the longest time is within the limits, for each level.

        Raises
        ------
        InputError
            If no limits were given.
        """
        if self.allowed is None:
            raise InputError("within: no limits were given; give pairs of a duration and a level as limits")
        return self.longest <= self.allowed


class _Parts(NamedTuple):
    """Polynomials that represent the load between phase angles: their Chebyshev coefficients are rows of ``terms``."""

    low: Array
    high: Array
    terms: Array


def exceedance(motion: Any, load: str, levels: Any, side: str, limits: Any) -> Exceedance:
    """Return the times for which a load is beyond levels; the arguments are those of `Motion.exceedance`."""
    quantity, sign = load_of(load, motion.problem), _sign(side)
    asked = _numbers(levels, "levels")
    allowed = None if limits is None else _allowed(asked.reshape(-1), _limits(limits, sign), sign).reshape(asked.shape)
    found = [_times_beyond(*spans) for spans in _spans(motion, quantity, asked.reshape(-1), sign)]
    total, longest = np.array(found).reshape(-1, 2).T
    if asked.ndim:
        return Exceedance(asked, total.reshape(asked.shape), longest.reshape(asked.shape), allowed)
    return Exceedance(float(asked), float(total[0]), float(longest[0]), None if allowed is None else float(allowed))


def _sign(side: str) -> int:
    one_of(side, ("above", "below"), where="exceedance: side")
    return 1 if side == "above" else -1


def _numbers(given: Any, what: str) -> Array:
    try:
        found = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError):
        found = np.full(1, np.nan)
    if not np.isfinite(found).all():
        raise InputError(f"exceedance: {what}: must be finite numbers, got {short(given)}")
    return found


def _limits(given: Any, sign: int) -> Array:
    """Check durations and levels, and return them in the order of durations."""
    pairs = _numbers(given, "limits")
    if pairs.ndim != 2 or pairs.shape[1] != 2 or not len(pairs):
        raise InputError(f"exceedance: limits: must be pairs of a duration in s and a level, got {short(given)}")
    pairs = pairs[np.argsort(pairs[:, 0], kind="stable")]
    if pairs[0, 0] < 0.0 or (np.diff(pairs[:, 0]) <= 0.0).any() or (sign * np.diff(pairs[:, 1]) > 0.0).any():
        raise InputError(
            "exceedance: limits: durations must be different and not negative, and a longer duration must not "
            f"have a wider limit, got {short(given)}"
        )
    return pairs


def _allowed(levels: Array, limits: Array, sign: int) -> Array:
    """Return the longest time that limits allow at levels."""
    durations, bounds = limits[:, 0], sign * limits[:, 1]
    # For each level this is the longest duration at which the level is not beyond the limit, which decreases as
    # durations grow.
    found = np.interp(sign * levels, bounds[::-1], durations[::-1])
    found[sign * levels <= bounds[-1]] = inf
    found[sign * levels > bounds[0]] = 0.0
    return found


def _times_beyond(spans: Sequence[Span], period: float | None) -> tuple[float, float]:
    """Return the sum and the longest of spans of time, which repeat after a period if there is one."""
    lengths = [stop - start for start, stop in spans]
    total, longest = sum(lengths), max(lengths, default=0.0)
    if period is not None and spans and spans[0][0] == 0.0 and spans[-1][1] >= period:
        longest = inf if len(spans) == 1 else max(longest, lengths[0] + lengths[-1])
    return total, longest


def _spans(motion: Any, quantity: Quantity, levels: Array, sign: int) -> list[tuple[list[Span], float | None]]:
    """Return, for each level, the spans of time in which the load is beyond it, and the period if they repeat."""
    if motion.kind == "rest" or motion._end_of_legs() == 0.0:
        here = quantity.of_state(motion.state(0.0))
        return [([(0.0, motion.t_end)] if sign * (here - level) > 0.0 else [], None) for level in levels.tolist()]
    trajectory, end = whole_trajectory(motion)
    period = end if motion.kind in ("libration", "circulation") else None
    spans: list[list[Span]] = [[] for _ in levels]
    for timed in trajectory.segments:
        start, stop = phases(timed, trajectory, end)
        if timed.t_start[0] >= end or start == stop:
            continue

        def load(phi: Array, timed: TimedSegment = timed) -> Array:
            return quantity.at(timed, phi)

        low, high = min(start, stop), max(start, stop)
        parts = _parts(load, timed.segment.edges, low, high)
        for level, theirs in zip(levels.tolist(), spans, strict=True):
            for span in _beyond(parts, load, level, sign, (low, high)):
                times = sorted(_time(timed, trajectory, phi, end) for phi in span)
                theirs.append((times[0], times[1]))
    return [(_joined(sorted(theirs)), period) for theirs in spans]


def _time(timed: TimedSegment, trajectory: Trajectory, phi: float, end: float) -> float:
    return min(trajectory.time_of(timed, phi), end)


def _parts(load: Callable[[Array], Array], edges: Array, low: float, high: float) -> _Parts:
    """Return polynomials that resolve a load between two phase angles."""
    ends, found = np.concatenate([[low], edges[(edges > low) & (edges < high)], [high]]), list[_Parts]()
    a, b = ends[:-1], ends[1:]
    for halvings in range(MAX_HALVINGS + 1):
        middle = 0.5 * (a + b)
        phi = middle[:, None] + 0.5 * (b - a)[:, None] * _AT
        terms = load(phi.ravel()).reshape(phi.shape) @ _FIT
        sizes = np.abs(terms)
        waits = sizes[:, -2:].max(axis=1) > MAX_TAIL * np.maximum(sizes.max(axis=1), 1.0)
        waits &= (halvings < MAX_HALVINGS) & (a < middle) & (middle < b)
        found.append(_Parts(a[~waits], b[~waits], terms[~waits]))
        if not waits.any():
            break
        a, b = np.concatenate([a[waits], middle[waits]]), np.concatenate([middle[waits], b[waits]])
    return _Parts(*map(np.concatenate, zip(*found, strict=True)))


def _beyond(
    parts: _Parts, load: Callable[[Array], Array], level: float, sign: int, ends: tuple[float, float]
) -> list[Span]:
    """Return the phase angles between which a load is beyond a level."""
    (low, high), terms = ends, parts.terms
    may_cross = np.abs(terms[:, 1:]).sum(axis=1) >= np.abs(terms[:, 0] - level)
    crossed = zip(parts.low[may_cross], parts.high[may_cross], terms[may_cross], strict=True)
    roots = np.array([root for a, b, row in crossed for root in _roots(a, b, row, load, level)])
    marks = np.unique(np.concatenate([[low], roots[(roots > low) & (roots < high)], [high]]))
    middles = 0.5 * (marks[:-1] + marks[1:])
    beyond = sign * (load(middles) - level) > 0.0
    return [(float(a), float(b)) for a, b, out in zip(marks, marks[1:], beyond, strict=False) if out]


def _roots(low: float, high: float, terms: Array, load: Callable[[Array], Array], level: float) -> list[float]:
    """Return the phase angles of one part at which a load equals a level."""
    terms = terms.copy()
    terms[0] -= level
    kept = np.flatnonzero(np.abs(terms) > 1e-15 * np.abs(terms).max())
    if not kept.size or kept[-1] == 0:
        return []
    found = chebyshev.chebroots(terms[: kept[-1] + 1])
    real = found.real[(np.abs(found.imag) < 1e-7) & (np.abs(found.real) <= 1.0 + OUTSIDE)]
    slope, half, middle = chebyshev.chebder(terms), 0.5 * (high - low), 0.5 * (low + high)
    phi = middle + half * np.clip(real, -1.0, 1.0)
    for _ in range(STEPS if phi.size else 0):
        rate = chebyshev.chebval((phi - middle) / half, slope) / half
        step = np.divide(load(phi) - level, rate, out=np.zeros_like(phi), where=rate != 0.0)
        phi = np.clip(phi - np.where(np.abs(step) < 1e-3 * half, step, 0.0), low, high)
    angles: list[float] = phi.tolist()
    return angles


def _joined(spans: Sequence[Span]) -> list[Span]:
    """Join spans of time, so that each of them begins after the one before has ended."""
    joined: list[Span] = []
    for start, stop in spans:
        if joined and start <= joined[-1][1] + SAME_TIME * stop:
            joined[-1] = joined[-1][0], max(stop, joined[-1][1])
        else:
            joined.append((start, stop))
    return joined
