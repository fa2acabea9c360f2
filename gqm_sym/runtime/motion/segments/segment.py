"""A segment of the curve that the body moves through in one direction, with the times along it."""

from copy import copy
from dataclasses import dataclass, field
from math import inf
from typing import Any

import numpy as np

from gqm_sym.errors import SolutionError
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.inversion.table import build_table, phase_angles
from gqm_sym.runtime.launch.functions import BoundFunctions
from gqm_sym.runtime.motion.segments.conditioning import launch_condition_number, v2_correction
from gqm_sym.runtime.multiprecision.exact_panels import DIGITS, exact_ends, lay_exactly
from gqm_sym.runtime.quadrature.integrands import speeds_along, speeds_at
from gqm_sym.runtime.quadrature.lengths import lengths_from_edges
from gqm_sym.runtime.quadrature.regular_factors import regular_factors
from gqm_sym.runtime.quadrature.running_totals import running_totals
from gqm_sym.runtime.quadrature.substitution import (
    FROM_TURN,
    REGULAR,
    TURN_TURN,
    phase_angle_of,
    phase_angles_of,
    places_at,
)
from gqm_sym.runtime.quadrature.time_panels import (
    FAILED,
    ILL_CONDITIONED,
    MIN_CANCELLATION_RATIO,
    lay_along,
    lay_panels,
    read_off_many,
)

# Widths of a segment, as shares of its ends, below which the rounding of the ends spoils its speeds, and below which it
# spoils the times from a single turning point.
MIN_WIDTH_SHARE = 1.0 / 32.0
MIN_TIMED_WIDTH_SHARE = 2.0**-10

# The distance from a turning point, as a share of the width, within which offsets are computed from the exact one.
NEAR_TURN = 1e-3

# The largest difference between V**2 at the double next to a launch place and V**2 at the launch place, as a share of
# the latter.
MAX_CORRECTION_SHARE = 2.0**-10

# The rounding of a place that is given by text, as two doubles.
MAX_TEXT_ROUNDING = 2.0**-105


@dataclass(slots=True, kw_only=True)
class Segment:
    """One segment, along which time and arc length grow from its end ``a`` with the phase angle of the substitution
    lam(phi).

    Its panels hold time and arc length as polynomials of the phase angle (MATHS, section 4).

    Attributes
    ----------
    functions : BoundFunctions
        The model's functions.
    kind : int
        TURN_TURN, FROM_TURN, TO_EQUILIBRIUM or REGULAR (`quadrature.integrands`), by the ends at which V**2 vanishes.
    a, b : float
        Its ends. A single turning point is ``a``, and an equilibrium is ``b``.
    low_parts : (float, float)
        The low parts of both ends as two doubles.
    ref, ref_v2 : float
        If V**2 vanishes at neither end, a place, and V**2 there.
    stop : float
        The last phase angle; the first is 0.
    panel_breaks : tuple of float
        Places at which panels begin, in addition to those at which the curve is not smooth: the integrand changes there
        on a scale that equal steps would miss.
    v2 : array or None
        V**2 on the approach to an equilibrium with dissipative forces (`quadrature.equilibrium`).
    turn_offset : float
        If ``a`` is no turning point but the body is slow there, the phase angle from the place behind ``a`` at which
        the turning point would be to ``a``, as a share of the last phase angle.
    stored_panels : tuple, optional
        Its panels, if they were computed in extended precision or together with a leg.
    speed_terms : (n, k) array, optional
        For panels that were computed in extended precision or together with a leg, the Legendre coefficients of the
        regular factor of the speed: the speed is this times sin(phi) between two turning points, and times phi and
        ``march_end`` from a turning point.
    march_end : float, optional
        For panels computed together with a leg, the last value of the march variable (`legs.panels.equation`).
    known_edge_times : pair of arrays, optional
        The time in s from ``a`` to each edge of its panels, as two doubles, once they have been computed.
    known_duration : float, optional
        Its duration in s, if it was found accurately in doubles; panels are then computed when they are first needed.
    is_lazy : bool
        Whether panels are computed when they are first needed although the duration is not known.
    ends : pair
        Its ends in extended precision, where they are known.
    """

    functions: BoundFunctions
    kind: int
    a: float
    b: float
    low_parts: tuple[float, float] = (0.0, 0.0)
    ref: float = 0.0
    ref_v2: float = 0.0
    stop: float = 1.0
    panel_breaks: tuple[float, ...] = ()
    v2: Array | None = None
    turn_offset: float = 0.0
    stored_panels: Any = None
    speed_terms: Array | None = None
    march_end: float | None = None
    known_duration: float | None = None
    is_lazy: bool = False
    ends: tuple[Any, Any] = (None, None)
    _from_multiprecision: bool = False
    _condition_number: float = field(default=1.0, init=False)
    known_edge_times: Any = field(default=None, repr=False)
    has_given_times: bool = field(default=False, repr=False)
    _width_ratio: float | None = field(default=None, repr=False)
    _table: Any = field(default=None, repr=False)

    def __post_init__(self) -> None:
        if self.known_duration is None and not self.is_lazy:
            self._lay_panels()

    def _lay_panels(self) -> None:
        """Compute its panels, in extended precision where too much of V**2 cancels for doubles."""
        f = self.functions
        if self.march_end is not None:
            return
        self._from_multiprecision, is_beside_double = self.stored_panels is not None, False
        if self.v2 is not None:
            self.stored_panels = lay_along(self.a, self.b, self.v2, self._initial_edges())
        elif self.stored_panels is None:
            correction = self._v2_correction()
            is_beside_double = abs(correction) > MAX_CORRECTION_SHARE * self.ref_v2
            self.ref_v2 += correction
            self.stored_panels = lay_panels(
                f.addresses, f.p, self.kind, self.a, self.b, self.ref, self.ref_v2, self._initial_edges()
            )
        self._condition_number = max(1.0 / self.balance if self.balance > 0.0 else inf, self._launch_condition_number())
        needs_multiprecision = (
            self._condition_number > 1.0 / MIN_CANCELLATION_RATIO
            or is_beside_double
            or (self.kind == FROM_TURN and self._is_short(MIN_TIMED_WIDTH_SHARE))
        )
        if f.exact is not None and not self._from_multiprecision and needs_multiprecision:
            self.ends = exact_ends(f.exact, DIGITS, self.kind, self.a, self.b, self.ends)
            self.a, self.b = float(self.ends[0]), float(self.ends[1])
            self.stored_panels, self.speed_terms = lay_exactly(
                f.exact, self.kind, self.ends, self.stop, starts_at_cusp=self._starts_at_cusp
            )
            self._from_multiprecision = True
        if self.stored_panels[7] == ILL_CONDITIONED:
            raise SolutionError(
                f"time of flight from {self.a!r} to {self.b!r}: V**2 nearly vanishes between them, and this curve "
                "is known in doubles only; launch a little faster or slower, or declare the curve by formulas"
            )
        if self.stored_panels[7] == FAILED:
            raise SolutionError(
                f"time of flight from {self.a!r} to {self.b!r}: the integrand is not finite there; "
                "is the curve regular and the potential finite on this segment?"
            )

    def _with_panels(self) -> "Segment":
        """Return the segment itself, with its panels computed."""
        if self.stored_panels is None:
            self._lay_panels()
        return self

    @property
    def panels(self) -> Any:
        """Its panels, as `quadrature.time_panels.lay` returns them."""
        if self.stored_panels is None:
            self._lay_panels()
        return self.stored_panels

    @property
    def from_multiprecision(self) -> bool:
        """Whether its panels were computed in extended precision."""
        return self._with_panels()._from_multiprecision

    @property
    def condition_number(self) -> float:
        """The largest relative change of its times per relative change of the numbers that they depend on."""
        return self._with_panels()._condition_number

    def with_edge_times(self, edge_times: tuple[Array, Array]) -> "Segment":
        """Return the same segment with more accurate times at the edges of its panels."""
        other = copy(self._with_panels())
        other.known_edge_times, other._table, other.has_given_times, other.known_duration = edge_times, None, True, None
        return other

    @property
    def edge_times(self) -> tuple[Array, Array]:
        """The time in s from ``a`` to each edge of the panels, as two doubles."""
        if self.known_edge_times is None:
            self.known_edge_times = running_totals(self.panels[3], self.panels[1][-1])
        times, low = self.known_edge_times
        return times, low

    def _initial_edges(self) -> Array:
        """Return the first and the last phase angle, and those at which panels must begin, to the rounding of their
        places.
        """
        places = [*self.functions.between(self.functions.breaks, self.a, self.b).tolist(), *self.panel_breaks]
        if not places:
            return np.array([0.0, self.stop])
        inside = self._phase_angles([self._offsets_in_doubles(place) for place in places])
        return np.array(sorted({0.0, *(phi for phi in inside if 0.0 < phi < self.stop), self.stop}))

    @property
    def edges(self) -> Array:
        """The phase angles of the panels' edges."""
        edges: Array = self.panels[0]
        return edges

    @property
    def duration(self) -> float:
        """Time in s from one end to the other."""
        return self.total_time[0] if self.known_duration is None else self.known_duration

    @property
    def total_time(self) -> tuple[float, float]:
        """The time in s from one end to the other as two doubles, according to its panels."""
        if self.known_edge_times is None:
            return float(self.panels[1][-1]), 0.0
        return float(self.known_edge_times[0][-1]), float(self.known_edge_times[1][-1])

    @property
    def length(self) -> float:
        """Arc length in m from one end to the other."""
        return float(self.panels[2][-1])

    @property
    def relative_error(self) -> float:
        """Estimated relative error of the duration by quadrature."""
        return float(self.panels[5])

    @property
    def balance(self) -> float:
        """The smallest value of the regular factor of V**2 as a share of its terms, which is the part that cancellation
        leaves.
        """
        return float(self.panels[6])

    def _v2_correction(self) -> float:
        """Return the difference between V**2 at the double nearest to the launch place and V**2 at the launch place
        itself.
        """
        f = self.functions
        if f.exact is None or self.kind != REGULAR or self.ref != f.exact.lam0.value:
            return 0.0
        return v2_correction(f.addresses, f.p, f.exact.lam0)

    @property
    def growth(self) -> tuple[float, float]:
        """The coefficients of a factor of the speed, slope*phi + rest, which may vanish at the end ``a``."""
        if self.kind == FROM_TURN:
            slope = 1.0 if self.march_end is None else self.march_end
            return slope, slope * self.turn_offset
        return (1.0, 0.0) if self._starts_at_cusp else (0.0, 1.0)

    @property
    def _starts_at_cusp(self) -> bool:
        """Whether V**2 vanishes at the end ``a``, a cusp (`kinds.from_cusp`)."""
        return self.kind == REGULAR and self.march_end is None and (self.ref, self.ref_v2) == (self.a, 0.0)

    def _launch_condition_number(self) -> float:
        f, ref = self.functions, self.a if self.kind == FROM_TURN else self.ref
        # A cusp is where it is, and V**2 beside it is as small as its distance: their rounding moves the place alone.
        one_sided = self.kind in (FROM_TURN, REGULAR) and not self._starts_at_cusp
        return launch_condition_number(f.addresses, f.p, self.a, self.b, ref, self.ref_v2) if one_sided else 1.0

    @property
    def direction(self) -> int:
        """The sign of dlam/dphi."""
        return 1 if self.width > 0.0 else -1

    @property
    def width(self) -> float:
        """The change of the curve parameter from ``a`` to ``b``.

        If both ends are the same double, it is computed from the ends in extended precision.
        """
        if self.a == self.b and self.ends[0] is not None:
            return float(self.ends[1] - self.ends[0])
        return (self.b - self.a) + (self.low_parts[1] - self.low_parts[0])

    def offsets(self, place: float, low: float = 0.0) -> tuple[float, float]:
        """Return the signed distances of place + low from ``a`` and to ``b``; the double of an end means that end."""
        if low == 0.0 and place in (self.a, self.b):
            return (0.0, self.width) if place == self.a else (self.width, 0.0)
        ahead, behind = self._offsets_in_doubles(place, low)
        turns = {TURN_TURN: (ahead, behind), FROM_TURN: (ahead,)}.get(self.kind, ())
        if min(map(abs, turns), default=inf) > NEAR_TURN * abs(self.width) or not self._is_conservative:
            return ahead, behind
        return self._exact_offsets(place, low)

    def _offsets_in_doubles(self, place: Any, low: float = 0.0) -> tuple[Any, Any]:
        """Return `offsets` from the ends in doubles."""
        return (place - self.a) + (low - self.low_parts[0]), (self.b - place) + (self.low_parts[1] - low)

    @property
    def _is_conservative(self) -> bool:
        return self.functions.exact is not None and self.v2 is None and self.march_end is None

    def _exact_offsets(self, place: float, low: float) -> tuple[float, float]:
        """Return `offsets` from the exact ends; close to an end its rounding would be a large share of the time to
        it.
        """
        exact = self.functions.exact
        assert exact is not None
        start, stop = exact_ends(exact, DIGITS, self.kind, self.a, self.b, self.ends)
        at = exact.at(DIGITS).track.place(place) + low
        rounding = MAX_TEXT_ROUNDING * max(abs(self.a), abs(self.b))
        ahead, behind = float(at - start), float(stop - at)
        return (0.0 if abs(ahead) <= rounding else ahead), (0.0 if abs(behind) <= rounding else behind)

    def _is_short(self, share: float) -> bool:
        return abs(self.b - self.a) <= share * max(abs(self.a), abs(self.b))

    @property
    def table(self) -> Any:
        """The phase angle as a function of time, tabulated when it is first needed (MATHS, section 5)."""
        if self._table is None:
            self._table = build_table(self.panels[0], *self.edge_times, self.panels[3])
        return self._table

    def phase_angle(self, t: Array, t_low: Array) -> Array:
        """Return the phase angle at times t + t_low in s from the end ``a``; at both ends it is exact."""
        phi: Array = phase_angles(*self.table[:6], t, t_low)
        total_time = self.total_time
        phi[t + t_low <= 0.0] = 0.0
        phi[(t - total_time[0]) + (t_low - total_time[1]) >= 0.0] = self.edges[-1]
        return phi

    def phase_angle_of(self, offset_a: float, offset_b: float) -> float:
        """Return the phase angle of a place, which is given by its signed distances ``lam - a`` and ``b - lam``."""
        return self._phase_angles([(offset_a, offset_b)])[0]

    def phase_angles_of(self, places: Array) -> Array:
        """Return the phase angles of places within a lap."""
        ahead, behind = self._offsets_in_doubles(places)
        sign, width = self.direction, self.width
        ahead, behind = np.maximum(ahead * sign, 0.0), np.maximum(behind * sign, 0.0)
        ahead[places == self.a], behind[places == self.b] = 0.0, 0.0
        phi = phase_angles_of(self.kind, self.turn_offset, ahead, behind, abs(width))
        if self._is_conservative and self.kind in (TURN_TURN, FROM_TURN):
            for i in np.flatnonzero(np.minimum(ahead, behind) <= NEAR_TURN * abs(width)).tolist():
                phi[i] = self.phase_angle_of(*self.offsets(float(places[i])))
        return phi

    def _phase_angles(self, offsets: list[tuple[float, float]]) -> list[float]:
        kind, offset, width, sign = self.kind, self.turn_offset, abs(self.width), self.direction
        return [
            phase_angle_of(kind, offset, max(ahead * sign, 0.0), max(behind * sign, 0.0), width)
            for ahead, behind in offsets
        ]

    def places(self, phi: Array) -> Array:
        """Return the curve parameter at phase angles, computed from the nearer end."""
        return places_at(
            self.kind, self.turn_offset, (self.a, self.low_parts[0]), (self.b, self.low_parts[1]), self.width, phi
        )

    def speeds(self, phi: Array) -> Array:
        """Return |ds/dt| in m/s at phase angles."""
        f = self._with_panels().functions
        speeds: Array
        if self.v2 is not None:
            speeds = speeds_along(self.a, self.b, self.v2, phi)
        elif self.speed_terms is None:
            speeds = speeds_at(f.addresses, f.p, self.kind, self.a, self.b, self.ref, self.ref_v2, phi)
            speeds *= self.width_ratio
        else:
            speeds = regular_factors(self.edges, self.speed_terms, phi)
            slope, rest = self.growth
            speeds *= np.sin(phi) if self.kind == TURN_TURN else slope * phi + rest
        return speeds

    def times(self, phi: Array) -> Array:
        """Return the time in s from the end ``a`` to phase angles."""
        times: Array = read_off_many(self.panels[0], self.edge_times[0], self.panels[3], phi)
        return times

    def lengths(self, phi: Array) -> Array:
        """Return the arc length in m from the end ``a`` to phase angles."""
        whole, parts = self.lengths_from_edges(phi, self.panels[0][-1] - phi)
        return whole + parts

    def lengths_from_edges(self, phi: Array, to_end: Array) -> tuple[Array, Array]:
        """Return the arc length in m from the end ``a`` to edges of panels near phase angles, and from there to these,
        given what they lack to the last one.
        """
        edges, marks, terms, between = self.panels[0], self.panels[2], self.panels[4], self.kind == TURN_TURN
        whole, parts = lengths_from_edges(edges, marks, terms, (between or self.growth[1] == 0.0, between), phi, to_end)
        return whole * self.width_ratio, parts * self.width_ratio

    @property
    def width_ratio(self) -> float:
        """The exact width of a short segment between two turning points, divided by that of the rounded ends."""
        exact, width = self.functions.exact, self.b - self.a
        is_rounded = exact is not None and self.kind == TURN_TURN and self._is_short(MIN_WIDTH_SHARE)
        if exact is None or not is_rounded or self.from_multiprecision:
            return 1.0
        if self._width_ratio is None:
            low, high = exact_ends(exact, DIGITS, self.kind, self.a, self.b, self.ends)
            self._width_ratio = float((high - low) / width)
        return self._width_ratio
