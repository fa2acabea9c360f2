"""The exact problem in extended precision: what doubles cannot decide, and digits beyond them.

A generated module carries its formulas as plain Python over a namespace of operations. Here they are evaluated with
mpmath
for exactly the numbers that were given. mpmath is imported when first asked for, never with the runtime.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from gqm_sym.budgets import budget, spend
from gqm_sym.errors import SolutionError
from gqm_sym.literals.numbers import Number
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.multiprecision.exact_tracks import Track, TrackMaker
from gqm_sym.runtime.multiprecision.gauss_legendre import gauss
from gqm_sym.runtime.quadrature.integrands import FROM_TURN, REGULAR, TURN_TURN

NOWHERE: Array = np.empty(0)

# Precisions at which a sign is asked for, in decimal digits; what is zero to the last counts as zero.
LADDER = (40, 80, 210)
SPARE = 15  # digits that evaluation and cancellation may cost at each rung

# A stretch that took this many panels has a peak that the trapezoidal rule would need too many nodes for.
SMOOTH_PANELS = 8
MOST_NODES = 1 << 13  # at 34 digits; a curve that is not smooth would take them without end


@dataclass(frozen=True, slots=True)
class End:
    """Where a walk along the curve ends, exactly: ``what`` is "turn", "equilibrium" or "clear"."""

    what: str
    place: Any = None


@dataclass(slots=True)
class ExactProblem:
    """One launch of one model, to be evaluated at any precision.

    ``edges`` are those of the pieces of a charted curve: each must be integrated by itself.
    """

    track: TrackMaker
    edges: Array
    parameters: tuple[Number, ...]
    lam0: Number
    v0: Number
    _scales: dict[int, "Arithmetic"] = field(default_factory=dict)

    def at(self, digits: int) -> "Arithmetic":
        """The problem's functions at a working precision of that many decimal digits."""
        if digits not in self._scales:
            self._scales[digits] = Arithmetic(self, digits)
        return self._scales[digits]

    def slope_sign(self) -> int:
        """The sign of the effective potential's slope at the launch place, zero included."""
        for digits in LADDER:
            a = self.at(digits)
            slope = a.effective_potential_slope(a.lam0)
            if abs(slope) > a.mpf(10) ** (SPARE - digits) * (a.mpf(0.5) + abs(a.effective_potential(a.lam0))):
                return 1 if slope > 0 else -1
        return 0

    @budget("search for turning points", 60.0, "launch a little farther from the equilibrium")
    def resolve(self, near: float, far: float, direction: int) -> End:
        """What lies between two places that doubles cannot tell apart from an equilibrium.

        Parameters
        ----------
        near, far : float
            Places on the curve with V**2 >= 0 at the first of them.
        """
        for digits in LADDER:
            a = self.at(digits)
            here, there = a.track.place(near), a.track.place(far)
            top = a.equilibrium(here, there)
            if top is not None and (top - here) * direction <= 0:
                top = None  # it lies behind
            if top is None:  # V**2 is monotonic: its sign at the far end decides
                w = a.speed_squared(there)
                guess = here + (there - here) / 2
            else:
                w = a.speed_squared(top)
                curvature = abs(a.potential_curvature(top))
                guess = top - direction * a.sqrt(abs(w) / curvature) if curvature else here
            lost = a.mpf(10) ** (2 * SPARE - digits) * a.size
            # A launch that slow turns where heights cancel to fewer digits than doubles have.
            if abs(w) <= lost or (0 < a.w0 <= lost and digits < LADDER[-1]):
                continue
            if w > 0 and top is not None and a.speed_squared(there) < 0:
                guess, w = there, -w  # a bottom, and a wall behind it
            if w > 0:
                return End("clear")
            return End("turn", a.turning_point(guess))
        return End("equilibrium", top)


@dataclass(slots=True)
class Arithmetic:
    """An exact problem at one precision."""

    problem: ExactProblem
    digits: int
    context: Any = field(init=False)
    track: Track = field(init=False)
    lam0: Any = field(init=False)
    w0: Any = field(init=False)
    base: Any = field(init=False)
    size: Any = field(init=False)

    def __post_init__(self) -> None:
        from mpmath.ctx_mp import MPContext

        self.context = MPContext()
        self.context.dps = self.digits
        values = tuple(number.at(self.context) for number in self.problem.parameters)
        self.track = self.problem.track(self.context, values)
        self.lam0 = self.track.lam0
        self.w0 = self.problem.v0.at(self.context) ** 2
        self.base = self.effective_potential(self.lam0)
        self.size = self.w0 + 2 * abs(self.base) + 2 * abs(self.effective_potential(self.track.elsewhere()) - self.base)

    def mpf(self, value: Any) -> Any:
        """A number of this precision."""
        return self.context.mpf(value)

    def sqrt(self, value: Any) -> Any:
        """Square root."""
        return self.context.sqrt(value)

    def effective_potential(self, lam: Any) -> Any:
        """U, so that V**2 + 2*U is constant."""
        spend()
        return self.track.effective_potential(lam)

    def effective_potential_slope(self, lam: Any) -> Any:
        """Its derivative."""
        spend()
        return self.track.effective_potential_slope(lam)

    def potential_curvature(self, lam: Any) -> Any:
        """Its second derivative, to about half of the digits."""
        h = self.mpf(10) ** (-(self.digits // 3))
        return (self.effective_potential_slope(lam + h) - self.effective_potential_slope(lam - h)) / (2 * h)

    def ds(self, lam: Any) -> Any:
        """ds/dlam."""
        return self.track.ds(lam)

    def speed_squared(self, lam: Any) -> Any:
        """V**2, by subtraction."""
        return self.w0 + 2 * self.base - 2 * self.effective_potential(lam)

    def equilibrium(self, near: Any, far: Any) -> Any | None:
        """The zero of the effective potential's slope next to two places, or None if there is none."""
        y, width = far, abs(far - near)
        tolerance = self.mpf(10) ** (-(self.digits // 2))
        for _ in range(60):
            slope = self.effective_potential_slope(y)
            if slope == 0:
                return y
            first, second = (
                self.context.diff(self.effective_potential_slope, y, 1),
                self.context.diff(self.effective_potential_slope, y, 2),
            )
            below = first**2 - slope * second
            if below == 0:
                return None
            step = slope * first / below  # Schroeder's: quadratic at a flat top as well
            y -= step
            if abs(y - near) > 1000 * width + abs(far) * self.mpf(10) ** -6:
                return None
            if abs(step) <= tolerance * (abs(y) + width):
                return y
        return None

    def turning_point(self, guess: Any) -> Any:
        """The zero of V**2 that Newton's method reaches from ``guess``."""
        x = self.mpf(guess)
        tolerance = self.mpf(10) ** (-(self.digits // 2))  # quadratic: the step that is this small leaves rounding only
        for _ in range(100):
            slope = 2 * self.effective_potential_slope(x)
            if slope == 0:
                break
            step = self.speed_squared(x) / slope
            x += step
            if abs(step) <= tolerance * (abs(x) + abs(x - self.lam0)):
                return x
        raise SolutionError(f"turning point near {float(guess)!r}: extended precision does not settle on it")

    def anomaly_rate(self, kind: int, a: Any, b: Any) -> Callable[[Any], tuple[Any, Any]]:
        """dt/dphi and V**2 along a stretch, as `panels` has them, by subtraction at the working precision."""
        context = self.context

        def turn_turn(phi: Any) -> tuple[Any, Any]:
            c, s = context.cos_sin(phi / 2)
            left, right = (b - a) * s**2, (b - a) * c**2
            lam = a + left
            if s == 0:
                w, q = self.mpf(0), -2 * self.effective_potential_slope(a) / (b - a)
            elif phi == context.pi:
                w, q = self.mpf(0), 2 * self.effective_potential_slope(b) / (b - a)
            else:
                w = self.speed_squared(lam)
                q = w / (left * right)
            return self.ds(lam) / context.sqrt(q), w

        def from_turn(phi: Any) -> tuple[Any, Any]:
            offset = (b - a) * phi**2
            w = self.speed_squared(a + offset)
            return self.ds(a + offset) * 2 * abs(b - a) * phi / context.sqrt(w), w

        def regular(phi: Any) -> tuple[Any, Any]:
            lam = a + (b - a) * phi
            w = self.speed_squared(lam)
            return self.ds(lam) * abs(b - a) / context.sqrt(w), w

        return {TURN_TURN: turn_turn, FROM_TURN: from_turn, REGULAR: regular}[kind]

    def trapezoid(self, rate: Callable[[Any], tuple[Any, Any]], stop: Any, digits: int) -> Any | None:
        """The integral over [0, stop] of a rate that is smooth and periodic (or even about both ends).

        Halving the spacing squares the error, so the next-to-last difference bounds it; None if the nodes run out.
        """
        n = 16
        total = (rate(self.mpf(0))[0] + rate(stop)[0]) / 2 + sum(rate(stop * k / n)[0] for k in range(1, n))
        value, before = total * stop / n, None
        while n < max(MOST_NODES, 64 * digits):
            total += sum(rate(stop * (2 * k + 1) / (2 * n))[0] for k in range(n))
            n *= 2
            new = total * stop / n
            change = abs(new - value)
            value = new
            if before is not None:
                # Where it falls geometrically, the next change is at most this one times their ratio.
                ratio = change / before if change < before / 1000 else 1
                if change * ratio <= abs(value) * self.mpf(10) ** (-digits - 2):
                    return value
            before = change
        return None

    def anomalies(self, kind: int, a: Any, b: Any, places: Sequence[Any]) -> list[Any]:
        """The anomalies of places on a stretch from a to b."""
        c = self.context
        shares = [(place - a) / (b - a) for place in places]
        if kind == TURN_TURN:
            return [2 * c.atan2(c.sqrt(share), c.sqrt(1 - share)) for share in shares]
        return [c.sqrt(share) for share in shares] if kind == FROM_TURN else shares

    def gauss(self, kind: int, a: Any, b: Any, edges: Sequence[Any], digits: int) -> list[Any]:
        """Time over each panel of those that resolved its rate in doubles, by Gauss-Legendre rules.

        At joints of the curve the panels are parted.
        """
        rate = self.anomaly_rate(kind, a, b)
        joints = self.anomalies(kind, a, b, self.track.joints(a, b) or ())
        parts = []
        for left, right in pairwise(edges):
            cuts = [left, *(phi for phi in joints if left < phi < right), right]
            parts.append(sum(gauss(self.context, lambda phi: rate(phi)[0], cuts, digits)))
        return parts


def two_doubles(value: Any) -> tuple[float, float]:
    """A number of extended precision as an unevaluated sum of two doubles."""
    high = float(value)
    return high, float(value - high)
