"""One launch in extended precision, for decisions that doubles cannot make and for more digits than a double has.

A generated module contains its formulas as plain Python over a namespace of operations. Here they are evaluated with
mpmath, for exactly the numbers that the user gave. mpmath is imported when it is first needed, not with the runtime.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import floor, log10
from typing import Any

import numpy as np

from gqm_sym.budgets import budget, check_budget
from gqm_sym.errors import SolutionError
from gqm_sym.literals.numbers import Number
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.double_double.recording import BoundTape
from gqm_sym.runtime.multiprecision.exact_tracks import Track, TrackMaker
from gqm_sym.runtime.multiprecision.gauss_legendre import gauss
from gqm_sym.runtime.quadrature.substitution import FROM_TURN, REGULAR, TURN_TURN

NOWHERE: Array = np.empty(0)

# The numbers of decimal digits with which a sign is determined, tried in turn; a value that is zero with the last one
# counts as zero.
PRECISIONS = (40, 80, 210)

# A launch at a place or with a speed below this takes more digits than are asked for, four for each power of ten: in
# V**2 those of its square cancel against the potential, and Newton's steps to a turning point end where half of all
# digits are right.
MIN_LAUNCH, DIGITS_OF_TINY = 1e-20, 4

# The number of digits that rounding and cancellation may cost.
GUARD_DIGITS = 15

# The share of the way from the launch to a place at which the potential's size is evaluated. It is no round number,
# because potentials may agree at round shares.
SHARE_OF_WAY = 0.7390851332151607

# A segment with more panels than this has a peak for which the trapezoidal rule would need too many nodes.
MAX_SMOOTH_PANELS = 8

# The largest number of Newton steps to a turning point; if the potential is flat there, each of them reduces the error
# only by a small share.
MAX_NEWTON_STEPS = 2000

# The largest number of nodes of the trapezoidal rule at up to 128 digits, if the curve is not smooth.
MAX_NODES = 1 << 13


@dataclass(frozen=True, slots=True)
class End:
    """The obstacle ahead of a place of the curve: ``what`` is "turn", "equilibrium" or "clear", at ``place``."""

    what: str
    place: Any = None


@dataclass(slots=True)
class ExactProblem:
    """One launch of one model, which can be evaluated with any precision.

    Attributes
    ----------
    track
        A function that makes the curve with its forces at a given precision.
    edges : array
        Edges of the pieces of a charted curve, in arc length; each piece must be integrated by itself.
    parameters : tuple of Number
        Run-time parameters.
    lam0, v0 : Number
        Launch place and speed in m/s.
    tape : callable
        A function that returns the formulas for double-double arithmetic; None for charted curves, and if they are too
        long.
    along_chart : callable
        A function of the kind of a segment (`quadrature.substitution`) and its ends as doubles. It returns the
        segment's integrands along a charted curve in double-double arithmetic; None for formulas, and if such
        arithmetic does not suffice.
    """

    track: TrackMaker
    edges: Array
    parameters: tuple[Number, ...]
    lam0: Number
    v0: Number
    tape: Callable[[], BoundTape | None]
    along_chart: Callable[[int, tuple[float, float]], Any] = lambda kind, ends: None
    _scales: dict[int, "Arithmetic"] = field(default_factory=dict)

    def at(self, digits: int) -> "Arithmetic":
        """Return the problem at a working precision of this number of decimal digits, or more of them for a tiny
        launch.
        """
        if digits not in self._scales:
            sizes = [abs(number.value) for number in (self.lam0, self.v0) if number.value != 0.0]
            smallest = min(sizes, default=1.0)
            more = 0 if smallest >= MIN_LAUNCH else -DIGITS_OF_TINY * floor(log10(smallest))
            self._scales[digits] = Arithmetic(self, digits + more)
        return self._scales[digits]

    def slope_sign(self) -> int:
        """Return the sign of the effective potential's slope at the launch place, which may be zero."""
        for digits in PRECISIONS:
            a, finer = self.at(digits), self.at(digits + GUARD_DIGITS)
            slope = a.effective_potential_slope(a.lam0)
            error = abs(finer.effective_potential_slope(finer.lam0) - finer.mpf(slope))
            if abs(slope) > a.mpf(10) ** GUARD_DIGITS * error:
                return 1 if slope > 0 else -1
        return 0

    @budget("search for turning points", 60.0, "launch a little farther from the equilibrium")
    def resolve(self, near: float, far: float, direction: int) -> End:
        """Decide which obstacle lies between two places that doubles cannot distinguish from an equilibrium.

        Parameters
        ----------
        near, far : float
            Places on the curve; V**2 >= 0 at the first of them.
        direction : int
            The sign of far - near.
        """
        for digits in PRECISIONS:
            a = self.at(digits)
            here, there = a.track.place(near), a.track.place(far)
            top = a.equilibrium(here, there)
            if top is not None and (top - here) * direction <= 0:
                top = None  # the equilibrium lies behind the first place
            if top is None:  # V**2 is monotone, so its sign at the far place decides
                w = a.speed_squared(there)
                guess = here + (there - here) / 2
            else:
                w = a.speed_squared(top)
                curvature = abs(a.potential_curvature(top))
                guess = top - direction * a.sqrt(abs(w) / curvature) if curvature else here
            lost = a.mpf(10) ** (2 * GUARD_DIGITS) * a.error_of_speed_squared(there if top is None else top)
            # So slow a body turns at a place where cancellation leaves fewer digits of the potential than a double has.
            if abs(w) <= lost or (0 < a.w0 <= lost and digits < PRECISIONS[-1]):
                continue
            if w > 0 and top is not None and a.speed_squared(there) < 0:
                guess, w = there, -w  # there is a minimum of the potential, and a turning point beyond it
            if w > 0:
                return End("clear")
            return End("turn", a.turning_point(guess))
        return End("equilibrium", top)


@dataclass(slots=True)
class Arithmetic:
    """A launch at one precision.

    Attributes
    ----------
    context
        An mpmath context.
    track : Track
        The curve with its forces.
    lam0, w0
        The launch place, and V**2 there.
    base
        The effective potential at the launch place.
    """

    problem: ExactProblem
    digits: int
    context: Any = field(init=False)
    track: Track = field(init=False)
    lam0: Any = field(init=False)
    w0: Any = field(init=False)
    base: Any = field(init=False)

    def __post_init__(self) -> None:
        from mpmath.ctx_mp import MPContext

        self.context = MPContext()
        self.context.dps = self.digits
        values = tuple(number.at(self.context) for number in self.problem.parameters)
        self.track = self.problem.track(self.context, values)
        self.lam0 = self.track.lam0
        self.w0 = self.problem.v0.at(self.context) ** 2
        self.base = self.effective_potential(self.lam0)

    def mpf(self, value: Any) -> Any:
        """Return a number of this precision."""
        return self.context.mpf(value)

    def sqrt(self, value: Any) -> Any:
        """Return the square root."""
        return self.context.sqrt(value)

    def effective_potential(self, lam: Any) -> Any:
        """Return U = Phi/(1 + beta) per unit mass, for which V**2 + 2*U is constant.

        Raises
        ------
        SolutionError
            If it has a pole there, as a central force has at its centre.
        """
        check_budget()
        try:
            return self.track.effective_potential(lam)
        except ZeroDivisionError:
            raise SolutionError(
                f"motion: the potential energy is infinite at the place {float(lam)!r} of the curve; "
                "launch the body where it does not come there, or move the centre of the force away from the curve"
            ) from None

    def effective_potential_slope(self, lam: Any) -> Any:
        """Return the derivative of U with respect to lam."""
        check_budget()
        return self.track.effective_potential_slope(lam)

    def potential_curvature(self, lam: Any) -> Any:
        """Return the second derivative of U with respect to lam."""
        return self.context.diff(self.effective_potential_slope, lam)

    def ds(self, lam: Any) -> Any:
        """Return ds/dlam."""
        return self.track.ds(lam)

    def speed_squared(self, lam: Any) -> Any:
        """Return V**2, by subtraction."""
        return self.w0 + 2 * self.base - 2 * self.effective_potential(lam)

    def error_of_speed_squared(self, lam: Any) -> Any:
        """Return how much rounding may change V**2 at a place: a rounding of its terms and of both places, and the
        change of both potentials if they are evaluated with more digits.
        """
        finer, between = self.problem.at(self.digits + GUARD_DIGITS), self.lam0 + SHARE_OF_WAY * (lam - self.lam0)
        terms = self.w0 + 2 * abs(self.base) + 2 * abs(self.effective_potential(between) - self.base)
        terms += sum(2 * abs(self.effective_potential_slope(place) * place) for place in (self.lam0, lam))
        changes = [
            abs(finer.effective_potential(finer.mpf(place)) - finer.mpf(self.effective_potential(place)))
            for place in (self.lam0, lam)
        ]
        return self.mpf(10) ** -self.digits * terms + 2 * self.mpf(sum(changes))

    def equilibrium(self, near: Any, far: Any) -> Any | None:
        """Return the zero of the effective potential's slope near two places, or None if there is none."""
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
            step = slope * first / below  # Schroeder's method converges quadratically at a flat maximum too
            y -= step
            if abs(y - near) > 1000 * width + abs(far) * self.mpf(10) ** -6:
                return None
            if abs(step) <= tolerance * (abs(y) + width):
                return y
        return None

    def turning_point(self, guess: Any) -> Any:
        """Return the zero of V**2 that Newton's method reaches from ``guess``."""
        x = self.mpf(guess)
        tolerance = self.mpf(10) ** (
            -(self.digits // 2)
        )  # convergence is quadratic, so after such a step only rounding remains
        for _ in range(MAX_NEWTON_STEPS):
            slope = 2 * self.effective_potential_slope(x)
            if slope == 0:
                break
            step = self.speed_squared(x) / slope
            x += step
            if abs(step) <= tolerance * (abs(x) + abs(x - self.lam0)):
                return x
        raise SolutionError(f"turning point near {float(guess)!r}: extended precision does not converge to it")

    def time_rate(self, kind: int, a: Any, b: Any) -> Callable[[Any], tuple[Any, Any]]:
        """Return a function of phi that gives dt/dphi and V**2 on a segment, by subtraction of potentials."""
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
        """Integrate over [0, stop] a function that is smooth and periodic, or even about both ends.

        Halving the spacing squares the error, so the last but one difference bounds it. The result is None if too many
        nodes would be needed.
        """
        n = 16
        total = (rate(self.mpf(0))[0] + rate(stop)[0]) / 2 + sum(rate(stop * k / n)[0] for k in range(1, n))
        value, before = total * stop / n, None
        while n < max(MAX_NODES, 64 * digits):
            total += sum(rate(stop * (2 * k + 1) / (2 * n))[0] for k in range(n))
            n *= 2
            new = total * stop / n
            change = abs(new - value)
            value = new
            if before is not None:
                # If the changes decrease geometrically, the next one is at most this one times their ratio.
                ratio = change / before if change < before / 1000 else 1
                if change * ratio <= abs(value) * self.mpf(10) ** (-digits - 2):
                    return value
            before = change
        return None

    def phase_angles(self, kind: int, a: Any, b: Any, places: Sequence[Any]) -> list[Any]:
        """Return the phase angles of places on a segment from a to b (`substitution`)."""
        c = self.context
        shares = [(place - a) / (b - a) for place in places]
        if kind == TURN_TURN:
            return [2 * c.atan2(c.sqrt(share), c.sqrt(1 - share)) for share in shares]
        return [c.sqrt(share) for share in shares] if kind == FROM_TURN else shares

    def gauss(self, kind: int, a: Any, b: Any, edges: Sequence[Any], digits: int) -> list[Any]:
        """Return the time on each panel by Gauss-Legendre rules.

        Parameters
        ----------
        kind, a, b
            The segment.
        edges : sequence
            Phase angles at the edges of the panels. A panel is divided at joints of the curve.
        digits : int
            Decimal digits of the result.
        """
        rate = self.time_rate(kind, a, b)
        joints = self.phase_angles(kind, a, b, self.track.joints(a, b) or ())
        parts = []
        for left, right in pairwise(edges):
            cuts = [left, *(phi for phi in joints if left < phi < right), right]
            parts.append(sum(gauss(self.context, lambda phi: rate(phi)[0], cuts, digits)))
        return parts


def two_doubles(value: Any) -> tuple[float, float]:
    """Return a number of extended precision as the sum of two doubles."""
    high = float(value)
    return high, float(value - high)
