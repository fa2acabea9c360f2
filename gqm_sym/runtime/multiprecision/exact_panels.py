"""Panels of time, arc length and speed laid in extended precision, for segments on which doubles cannot resolve V**2
(near a separatrix).

The panels are those of `time_panels`, but the integrands at their nodes are accurate to the last bit. They are computed
in double-double arithmetic, or with mpmath if too many of its digits cancel.
"""

from collections.abc import Sequence
from functools import cache, cached_property
from typing import Any, Protocol

import numpy as np

from gqm_sym.budgets import budget
from gqm_sym.errors import SolutionError
from gqm_sym.literals.numbers import Number
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.double_double.panel_rates import panel_rates
from gqm_sym.runtime.multiprecision.exact_problem import ExactProblem, two_doubles
from gqm_sym.runtime.multiprecision.slow_rates import SlowRates
from gqm_sym.runtime.quadrature.kronrod import KRONROD_WEIGHTS, NODES
from gqm_sym.runtime.quadrature.substitution import FROM_TURN, REGULAR, TURN_TURN
from gqm_sym.runtime.quadrature.time_panels import (
    CONVERGED,
    COUNT,
    DEGREE,
    EXHAUSTED,
    MAX_PANELS,
    MAX_TAIL_RATIO,
    NEGLIGIBLE_SHARE,
    Panels,
    antiderivative,
)

# The number of decimal digits, which is enough for all digits of a double at a distance of 1e-30 from a barrier.
DIGITS = 80

ALL_NODES = np.concatenate([-NODES[:0:-1], NODES])


def turns_of(kind: int) -> tuple[bool, bool]:
    """Return which ends of a segment of a kind (`substitution`) are turning points."""
    return {TURN_TURN: (True, True), FROM_TURN: (True, False)}.get(kind, (False, False))


def is_launch_place(place: float, is_turn: bool, lam0: Number, v0: Number) -> bool:
    """Return whether an end of a segment is the launch place; a turning point may be the same double."""
    return place == lam0.value and not (is_turn and bool(v0.value))


def exact_ends(
    exact: ExactProblem, digits: int, kind: int, a: float, b: float, known: tuple[Any, Any]
) -> tuple[Any, Any]:
    """Return the ends of a segment in extended precision.

    Parameters
    ----------
    exact : ExactProblem
        The launch.
    digits : int
        Decimal digits.
    kind : int
        The segment's kind (`substitution`).
    a, b : float
        Its ends as doubles. For an end that is the launch place, the exact launch place is used.
    known : pair
        Its ends in extended precision, or None for each that is not known.
    """
    scale = exact.at(digits)
    out = []
    for place, is_turn, more in zip((a, b), turns_of(kind), known, strict=True):
        if more is None and is_launch_place(place, is_turn, exact.lam0, exact.v0):
            out.append(scale.lam0)
        elif is_turn:
            out.append(scale.turning_point(place if more is None else more))
        else:
            out.append(scale.mpf(place if more is None else more))
    return out[0], out[1]


@cache
def _mpmath_context() -> Any:
    from mpmath.ctx_mp import MPContext

    context = MPContext()
    context.dps = DIGITS
    return context


class Rates(Protocol):
    """The integrands of time and arc length, and the speed, at the nodes of panels of one segment, accurate to the last
    bit.

    Attributes
    ----------
    kind : int
        The segment's kind (`substitution`), which is not TO_EQUILIBRIUM.
    context : mpmath.MPContext
        The arithmetic of the phase angles.
    places : (float, float)
        The segment's ends, each the double nearest to it.
    joints : sequence
        The phase angles at which panels must begin.
    """

    kind: int
    context: Any
    places: tuple[float, float]
    joints: Sequence[Any]

    def __call__(self, middle: Any, reach: Any) -> Array:
        """Return rows of dt/dphi, ds/dphi and the regular factor of the speed, as `panel_rates`."""


class ExactRates:
    """The integrands of a segment between two ends that are known in extended precision; see `Rates`.

    Parameters
    ----------
    exact : ExactProblem
        The launch.
    kind : int
        The segment's kind.
    ends : pair
        Its ends, from `exact_ends`.
    """

    def __init__(self, exact: ExactProblem, kind: int, ends: tuple[Any, Any]) -> None:
        self.scale, self.kind, self.ends = exact.at(DIGITS), kind, ends
        self.context, self.places = self.scale.context, (float(ends[0]), float(ends[1]))
        self.joints: Sequence[Any] = self.scale.phase_angles(kind, *ends, self.scale.track.joints(*ends) or ())
        self.launch, self.tape = (exact.lam0, exact.v0), exact.tape()
        self.segment = two_doubles(ends[0]), two_doubles(ends[1] - ends[0])
        self.slow = None if self.tape is None or len(self.joints) else SlowRates(self.scale, kind, ends)

    def __call__(self, middle: Any, reach: Any) -> Array:
        """Return rows of dt/dphi, ds/dphi and the regular factor of the speed, as `panel_rates`."""
        values = None
        if self.tape is not None:
            panel = *self.segment, two_doubles(middle), two_doubles(reach)
            values = panel_rates(self.tape, self.launch, self.kind, panel, ALL_NODES)
        if values is None and self.slow is not None:
            values = self.slow(middle, reach, ALL_NODES)
        return self._by_mpmath(middle, reach) if values is None else values

    def _by_mpmath(self, middle: Any, reach: Any) -> Array:
        rate, values = self.scale.time_rate(self.kind, *self.ends), np.empty((3, COUNT))
        growth = {TURN_TURN: self.scale.context.sin, FROM_TURN: self.scale.mpf, REGULAR: lambda _: 1}[self.kind]
        for i, x in enumerate(ALL_NODES.tolist()):
            phi = middle + reach * x
            try:
                duration, w = rate(phi)
            except ZeroDivisionError:  # V**2 is zero to this number of digits
                duration = w = self.scale.mpf(0)
            if duration.imag or w.imag or not (duration > 0 and w > 0):
                raise SolutionError(
                    f"time of flight from {float(self.ends[0])!r} to {float(self.ends[1])!r}: V**2 is not positive "
                    f"inside this segment, as far as {DIGITS} digits tell; launch a little farther from the equilibrium"
                )
            speed = self.scale.sqrt(w)
            values[:, i] = float(duration), float(duration * speed), float(speed / growth(phi))
        return values


class _RatesAlongChart:
    """The integrands along a charted curve in double-double arithmetic, or by mpmath where that does not suffice."""

    def __init__(
        self,
        exact: ExactProblem,
        kind: int,
        known: tuple[tuple[float, float], tuple[Any, Any]],
        along: Any,
        joints: Any,
    ) -> None:
        self.kind, self.context, self.places, self.joints = kind, _mpmath_context(), along.ends, joints
        self._exact, self._known, self._along = exact, known, along

    def __call__(self, middle: Any, reach: Any) -> Array:
        values: Array | None = self._along(two_doubles(middle), two_doubles(reach), ALL_NODES)
        return self._precise(middle, reach) if values is None else values

    @cached_property
    def _precise(self) -> ExactRates:
        (a, b), ends = self._known
        return ExactRates(self._exact, self.kind, exact_ends(self._exact, DIGITS, self.kind, a, b, ends))


def rates_between(
    exact: ExactProblem, kind: int, places: tuple[float, float], ends: tuple[Any, Any], joints: Sequence[float]
) -> tuple[Rates, tuple[Any, Any]]:
    """Return the integrands of a segment, and its ends as far as they are known in extended precision.

    Parameters
    ----------
    exact, kind
        As for `ExactRates`.
    places : (float, float)
        The ends of the segment as doubles.
    ends : pair
        Its ends in extended precision, or None for each that is not known.
    joints : sequence of float
        The phase angles of the edges of a charted curve's pieces.
    """
    along = exact.along_chart(kind, places) if ends == (None, None) else None
    if along is not None:
        return _RatesAlongChart(exact, kind, (places, ends), along, joints), ends
    ends = exact_ends(exact, DIGITS, kind, *places, ends)
    return ExactRates(exact, kind, ends), ends


@budget("quadrature", 60.0, "launch a little farther from the equilibrium")
def lay_exactly(rates: Rates, stop: float, *, starts_at_cusp: bool = False) -> tuple[Panels, Array]:
    """Lay panels over a segment in extended precision.

    Parameters
    ----------
    rates : Rates
        The integrands of the segment.
    stop : float
        Its last phase angle.
    starts_at_cusp : bool
        Whether a REGULAR segment begins at a cusp where V**2 vanishes; the phase angle is then a factor of the speed.

    Returns
    -------
    Panels
        Its panels.
    (n, DEGREE) array
        The Legendre coefficients of the regular factor of the speed on each of them.

    Raises
    ------
    SolutionError
        If V**2 is not positive inside the segment, or changes so often there that panels do not resolve it.
    """
    context, kind = rates.context, rates.kind
    weights = np.concatenate([KRONROD_WEIGHTS[:0:-1], KRONROD_WEIGHTS])
    edges, times, lengths = [0.0], [0.0], [0.0]
    all_terms = []
    # The last phase angle is pi itself and not its nearest double, because near a barrier the body takes a long time
    # for the difference.
    end = context.pi if kind == TURN_TURN else context.mpf(stop)
    pending = [stop, *reversed([phi for phi in rates.joints if 0 < phi < stop])]
    left, error, status, max_panels = 0.0, 0.0, CONVERGED, MAX_PANELS + len(pending)
    while pending:
        right = pending[-1]
        # The nodes are not rounded to doubles, because the rounding would be visible as noise next to a peak of width
        # 1e-6.
        high = end if right == stop else context.mpf(right)
        reach, middle = (high - left) / 2, (high + left) / 2
        half, values = float(reach), rates(middle, reach)
        if starts_at_cusp:
            values[2] /= float(middle) + half * ALL_NODES
        series, terms = np.empty(DEGREE + 1), np.empty((3, DEGREE))
        speed_size, speed_tail, _ = antiderivative(values[2], half, series, terms[2])
        terms[2] = series[:DEGREE]
        length_size, length_tail, _ = antiderivative(values[1], half, series, terms[1])
        size, tail, _ = antiderivative(values[0], half, series, terms[0])
        resolved = (
            tail <= MAX_TAIL_RATIO * size
            and length_tail <= 10.0 * MAX_TAIL_RATIO * length_size
            and speed_tail <= 10.0 * MAX_TAIL_RATIO * speed_size
        )
        time, length = half * (weights @ values[0]), half * (weights @ values[1])
        resolved = resolved or (time <= NEGLIGIBLE_SHARE * times[-1] and length <= NEGLIGIBLE_SHARE * lengths[-1])
        if not resolved and half > 2.0**-50 * right:
            if len(edges) + len(pending) >= max_panels:
                raise SolutionError(
                    f"time of flight from {rates.places[0]!r} to {rates.places[1]!r}: is not resolved by {MAX_PANELS} "
                    "panels; launch so that the body passes fewer hills and dips"
                )
            pending.append((left + right) / 2)
            continue
        status = status if resolved else EXHAUSTED
        error += tail / size * float(time) if size else 0.0
        edges.append(float(right))
        times.append(times[-1] + float(time))
        lengths.append(lengths[-1] + float(length))
        all_terms.append(terms)
        left = pending.pop()
    time_terms, length_terms, speed_terms = np.moveaxis(np.array(all_terms), 1, 0)
    panels = Panels(
        np.array(edges),
        np.array(times),
        np.array(lengths),
        np.ascontiguousarray(time_terms),
        np.ascontiguousarray(length_terms),
        error / times[-1] + 2.3e-16,
        1.0,
        status,
    )
    return panels, np.ascontiguousarray(speed_terms)
