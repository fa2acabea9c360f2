"""A stretch of the curve that is run through in one direction, with its clock."""

from copy import copy
from dataclasses import dataclass, field
from math import exp, inf, pi
from typing import Any

import numpy as np

from gqm_sym.errors import SolutionError
from gqm_sym.runtime.arithmetic.doubledouble import ULP, running_totals
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.inversion.table import MAX_TIME_ERROR, build_table, phase_angles
from gqm_sym.runtime.launch.functions import BoundFunctions
from gqm_sym.runtime.motion.conditioning import magnified, off_launch
from gqm_sym.runtime.multiprecision.exact_panels import DIGITS, exact_ends, lay_exactly
from gqm_sym.runtime.quadrature.integrands import speeds_along, speeds_at
from gqm_sym.runtime.quadrature.substitution import (
    FROM_TURN,
    REGULAR,
    TO_EQUILIBRIUM,
    TURN_TURN,
    phase_angle_of,
    places_at,
)
from gqm_sym.runtime.quadrature.time_panels import (
    FAILED,
    ILL_CONDITIONED,
    MIN_CANCELLATION_RATIO,
    lay_along,
    lay_panels,
    read_off_many,
    slopes,
)

# Below this share of its ends, the width of a stretch is too rounded for a speed, and for a time from one turn.
LEAST_WIDTH = 1.0 / 32.0
LEAST_TIMED = 2.0**-10


@dataclass(slots=True, kw_only=True)
class Segment:
    """One stretch: time and arc length grow from ``a``, with the anomaly.

    Attributes
    ----------
    kind : int
        Which of its ends are special (`panels`).
    a, b : float
        Its ends. ``a`` is the turning point where only one end is; ``b`` the equilibrium where there is one.
    lows : (float, float)
        What its ends are more than those doubles.
    ref, w : float
        Where no end is special: a place and V**2 there.
    stop : float
        The last anomaly.
    hints : tuple of float
        Places at which panels begin besides the curve's own breaks: the rate changes there on a scale that even steps
        would miss.
    v2 : array or None
        V**2 towards an equilibrium where forces dissipate: a field (`fields`).
    slack : float
        Where ``a`` is no turning point but the body is slow there: how far behind ``a`` one would be, as a share of the
        last anomaly, in the anomaly.
    laid : tuple, optional
        Its panels, if they were laid in extended precision, or with a leg.
    paces : (float, array), optional
        Of panels laid with a leg: the last value of the march variable, and the Legendre coefficients of Y (`legs`).
    known : float, optional
        Its duration, where that is known to be good in doubles: panels are then laid when first asked for.
    ends : pair
        Its ends in extended precision, where they are known.
    """

    functions: BoundFunctions
    kind: int
    a: float
    b: float
    lows: tuple[float, float] = (0.0, 0.0)
    ref: float = 0.0
    w: float = 0.0
    stop: float = 1.0
    hints: tuple[float, ...] = ()
    v2: Array | None = None
    slack: float = 0.0
    laid: Any = None
    paces: tuple[float, Array] | None = None
    known: float | None = None
    ends: tuple[Any, Any] = (None, None)
    _from_exact: bool = False
    _conditioning: float = field(default=1.0, init=False)
    _clock: Any = field(default=None, repr=False)
    _is_timed: bool = field(default=False, repr=False)
    _stretched: float | None = field(default=None, repr=False)
    _table: Any = field(default=None, repr=False)

    def __post_init__(self) -> None:
        if self.known is None:
            self._settle()

    def _settle(self) -> None:
        """Lay its panels, in extended precision where doubles would lose too much."""
        f = self.functions
        if self.paces is not None:
            return
        self._from_exact = self.laid is not None
        if self.v2 is not None:
            self.laid = lay_along(self.a, self.b, self.v2, self._marks())
        elif self.laid is None:
            self.w += self._off_launch()
            self.laid = lay_panels(f.addresses, f.p, self.kind, self.a, self.b, self.ref, self.w, self._marks())
        self._conditioning = max(1.0 / self.balance if self.balance > 0.0 else inf, self._magnified())
        hard = self._conditioning > 1.0 / MIN_CANCELLATION_RATIO or (
            self.kind == FROM_TURN and self._is_short(LEAST_TIMED)
        )
        if f.exact is not None and not self._from_exact and hard:
            self.ends = exact_ends(f.exact, DIGITS, self.kind, self.a, self.b, self.ends)
            self.a, self.b = float(self.ends[0]), float(self.ends[1])
            self.laid = lay_exactly(f.exact, self.kind, self.ends, self.stop)
            self._from_exact = True
        if self.laid[7] == ILL_CONDITIONED:
            raise SolutionError(
                f"time of flight from {self.a!r} to {self.b!r}: V**2 all but vanishes inside, and this curve is known "
                "by doubles only; launch a little faster or slower, or declare the curve by formulas"
            )
        if self.laid[7] == FAILED:
            raise SolutionError(
                f"time of flight from {self.a!r} to {self.b!r}: the integrand is not finite there; "
                "is the curve regular and the potential finite on this stretch?"
            )

    def _ready(self) -> "Segment":
        """Itself, its panels laid."""
        if self.laid is None:
            self._settle()
        return self

    @property
    def panels(self) -> Any:
        """Its panels, as `panels.lay` returns them."""
        return self._ready().laid

    @property
    def from_exact(self) -> bool:
        """Whether its panels were laid in extended precision."""
        return self._ready()._from_exact

    @property
    def conditioning(self) -> float:
        """How many times its times magnify, at most, the rounding of what they depend on."""
        return self._ready()._conditioning

    def timed(self, clock: tuple[Array, Array]) -> "Segment":
        """The same stretch by a better clock."""
        better = copy(self._ready())
        better._clock, better._table, better._is_timed, better.known = clock, None, True, None
        return better

    @property
    def clock(self) -> tuple[Array, Array]:
        """Time at the panels' edges, each as two doubles."""
        if self._clock is None:
            self._clock = running_totals(self.panels[1], self.panels[3])
        times, low = self._clock
        return times, low

    def _marks(self) -> Array:
        """The first and the last anomaly, and those at which the curve is not smooth."""
        places = self.functions.between(self.functions.breaks, self.a, self.b)
        inside = [self.anomaly_of(*self.offsets(place)) for place in (*places, *self.hints)]
        return np.array(sorted({0.0, *(phi for phi in inside if 0.0 < phi < self.stop), self.stop}))

    @property
    def edges(self) -> Array:
        """Panel edges in the anomaly."""
        edges: Array = self.panels[0]
        return edges

    @property
    def duration(self) -> float:
        """Time from one end to the other."""
        return self.whole[0] if self.known is None else self.known

    @property
    def whole(self) -> tuple[float, float]:
        """The same as two doubles, as its clock shows it."""
        if self._clock is None:  # not asked for yet
            return float(self.panels[1][-1]), 0.0
        return float(self._clock[0][-1]), float(self._clock[1][-1])

    @property
    def length(self) -> float:
        """Arc length from one end to the other."""
        return float(self.panels[2][-1])

    @property
    def relative_error(self) -> float:
        """Estimated relative error of the duration by quadrature."""
        return float(self.panels[5])

    def clock_error(self, phi: Array) -> Array:
        """Estimated error of its clock at anomalies: of the whole time, or of the panel's where its edges are exact."""
        error = self.relative_error + ULP + MAX_TIME_ERROR
        which = np.clip(np.searchsorted(self.edges, phi, side="right") - 1, 0, len(self.edges) - 2)
        times = self.clock[0]
        if self._is_timed:
            spans: Array = np.diff(times)[which]
        elif self.kind == TO_EQUILIBRIUM:  # how far it goes on was a matter of choice
            spans = times[which + 1]
        else:
            spans = np.full_like(phi, self.duration)
        return error * spans

    def inversion_error(self, phi: Array) -> Array:
        """Estimated error of the table at anomalies, in the curve's parameter, rounding included."""
        ends = self.table[3].sum(axis=1)
        errors = self.table[6][np.clip(np.searchsorted(ends, phi), 0, len(ends) - 1)]
        width = abs(self.width)
        if self.kind == TO_EQUILIBRIUM:
            left: Array = width * np.exp(-phi) * (errors + 3.0 * ULP * np.maximum(phi, 1.0))
            return left
        swing = {TURN_TURN: 0.5, FROM_TURN: 2.0, REGULAR: 1.0}[self.kind]  # dlam/dphi at most, in widths
        moved: Array = width * (swing * errors + 3.0 * ULP)
        return moved

    @property
    def balance(self) -> float:
        """How much of V**2's regular factor is left where most of it cancels: this stretch's conditioning."""
        return float(self.panels[6])

    def _off_launch(self) -> float:
        """What V**2 at the double nearest to the launch place has over that at the launch place itself."""
        f = self.functions
        if f.exact is None or self.kind != REGULAR or self.ref != f.exact.lam0.value:
            return 0.0
        return off_launch(f.addresses, f.p, f.exact.lam0)

    def _magnified(self) -> float:
        f, ref = self.functions, self.a if self.kind == FROM_TURN else self.ref
        one_sided = self.kind in (FROM_TURN, REGULAR)
        return magnified(f.addresses, f.p, self.a, self.b, ref, self.w) if one_sided else 1.0

    @property
    def direction(self) -> int:
        """The sign of dlam/dphi."""
        return 1 if self.width > 0.0 else -1

    @property
    def width(self) -> float:
        """The change of the parameter from end to end: of exact ends where those in doubles are one place."""
        if self.a == self.b and self.ends[0] is not None:
            return float(self.ends[1] - self.ends[0])
        return (self.b - self.a) + (self.lows[1] - self.lows[0])

    def offsets(self, place: float, low: float = 0.0) -> tuple[float, float]:
        """A place's signed distances from the end ``a`` and to the end ``b``; the double next to an end is that end."""
        if low == 0.0 and place in (self.a, self.b):
            return (0.0, self.width) if place == self.a else (self.width, 0.0)
        return (place - self.a) + (low - self.lows[0]), (self.b - place) + (self.lows[1] - low)

    def _is_short(self, share: float) -> bool:
        return abs(self.b - self.a) <= share * max(abs(self.a), abs(self.b))

    @property
    def table(self) -> Any:
        """The anomaly over time, tabulated when first asked for."""
        if self._table is None:
            self._table = build_table(self.panels[0], *self.clock, self.panels[3])
        return self._table

    def anomaly(self, t: Array, t_low: Array) -> Array:
        """The anomaly at times ``t + t_low`` from the end ``a``; exactly the first and the last one at both ends."""
        phi: Array = phase_angles(*self.table[:6], t, t_low)
        whole = self.whole
        phi[t + t_low <= 0.0] = 0.0
        phi[(t - whole[0]) + (t_low - whole[1]) >= 0.0] = self.edges[-1]
        return phi

    def anomaly_of(self, offset_a: float, offset_b: float) -> float:
        """The anomaly of a place given by its signed offsets ``lam - a`` and ``b - lam``."""
        ahead, behind = max(offset_a * self.direction, 0.0), max(offset_b * self.direction, 0.0)
        return phase_angle_of(self.kind, self.slack, ahead, behind, abs(self.width))

    def places(self, phi: Array) -> Array:
        """The curve's parameter at anomalies, from the nearer end."""
        return places_at(self.kind, self.slack, (self.a, self.lows[0]), (self.b, self.lows[1]), self.width, phi)

    def speeds(self, phi: Array) -> Array:
        """|ds/dt| at anomalies."""
        f = self.functions
        if self.from_exact:
            return self._paced(phi)
        if self.v2 is not None:
            along: Array = speeds_along(self.a, self.b, self.v2, phi)
            return along
        if self.paces is not None:
            last, terms = self.paces
            smooth: Array = read_off_many(self.edges, np.zeros_like(self.edges), terms, phi)
            return smooth * (last * (phi + self.slack)) if self.kind == FROM_TURN else smooth
        speeds: Array = speeds_at(f.addresses, f.p, self.kind, self.a, self.b, self.ref, self.w, phi)
        return speeds * self.spread

    def _paced(self, phi: Array) -> Array:
        """|ds/dt| from the panels themselves, where doubles cannot tell V**2 from nothing."""
        paced: Array = slopes(self.edges, self.panels[4], phi) / slopes(self.edges, self.panels[3], phi)
        return paced

    def times(self, phi: Array) -> Array:
        """Time from the end ``a`` to anomalies."""
        times: Array = read_off_many(self.panels[0], self.clock[0], self.panels[3], phi)
        return times

    def lengths(self, phi: Array) -> Array:
        """Arc length from the end ``a`` to anomalies."""
        lengths: Array = read_off_many(self.panels[0], self.panels[2], self.panels[4], phi)
        return lengths * self.spread

    @property
    def spread(self) -> float:
        """The exact width of a short stretch between two turning points, against that of the rounded ones."""
        exact, width = self.functions.exact, self.b - self.a
        if exact is None or self.kind != TURN_TURN or not self._is_short(LEAST_WIDTH):
            return 1.0
        if self._stretched is None:
            low, high = exact_ends(exact, DIGITS, self.kind, self.a, self.b, self.ends)
            self._stretched = float((high - low) / width)
        return self._stretched


def toward_equilibrium(functions: BoundFunctions, start: float, top: float, duration: float) -> Segment:
    """A stretch from ``start`` that comes as close to an equilibrium as takes at least ``duration``."""
    stop = 8.0
    while True:
        stretch = Segment(functions=functions, kind=TO_EQUILIBRIUM, a=start, b=top, stop=stop)
        if stretch.duration > duration or exp(-stop) * abs(start - top) < 1e-300:
            return stretch
        stop *= 2.0


def between_turns(
    functions: BoundFunctions,
    a: float,
    b: float,
    known: float | None = None,
    ends: tuple[Any, Any] = (None, None),
) -> Segment:
    """A stretch between two turning points."""
    return Segment(functions=functions, kind=TURN_TURN, a=a, b=b, stop=pi, known=known, ends=ends)


def from_turn(functions: BoundFunctions, turn: float, end: float) -> Segment:
    """A stretch from a turning point to a place where the speed is not zero."""
    return Segment(functions=functions, kind=FROM_TURN, a=turn, b=end)


def through(
    functions: BoundFunctions,
    start: float,
    end: float,
    ref: float,
    w: float,
    *,
    known: float | None = None,
    hints: tuple[float, ...] = (),
) -> Segment:
    """A stretch without special ends; ``w`` is V**2 at ``ref``."""
    return Segment(functions=functions, kind=REGULAR, a=start, b=end, ref=ref, w=w, known=known, hints=hints)
