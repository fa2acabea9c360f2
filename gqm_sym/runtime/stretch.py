"""A stretch of the curve that is run through in one direction, with its clock."""

from dataclasses import dataclass, field
from math import atan2, exp, inf, log, pi, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gqm_sym.errors import SolutionError
from gqm_sym.runtime.entries import anomalies, build_table, lay_panels, read_off_many, speeds_at
from gqm_sym.runtime.exact import ExactProblem
from gqm_sym.runtime.exact_panels import DIGITS, exact_ends, lay_exactly
from gqm_sym.runtime.panels import (
    FAILED,
    FROM_TURN,
    ILL_CONDITIONED,
    REGULAR,
    TO_EQUILIBRIUM,
    TURN_TURN,
)

Array = NDArray[np.float64]


# Below this balance the half period in doubles is off by more than a few units in the last place.
LEAST_BALANCE = 1e-2


@dataclass(frozen=True, slots=True)
class Functions:
    """One motion's compiled functions, its parameters, and the same problem exactly."""

    addresses: tuple[int, ...]
    p: Array
    exact: ExactProblem


@dataclass(slots=True, kw_only=True)
class Stretch:
    """One stretch: time and arc length grow from ``a``, with the anomaly.

    Attributes
    ----------
    kind : int
        Which of its ends are special (`panels`).
    a, b : float
        Its ends. ``a`` is the turning point where only one end is; ``b`` the equilibrium where there is one.
    ref, w : float
        Where no end is special: a place and V**2 there.
    stop : float
        The last anomaly.
    ends : pair
        Its ends in extended precision, where they are known.
    from_exact : bool
        Whether its panels were laid in extended precision.
    """

    functions: Functions
    kind: int
    a: float
    b: float
    ref: float = 0.0
    w: float = 0.0
    stop: float = 1.0
    panels: Any = None
    ends: tuple[Any, Any] = (None, None)
    from_exact: bool = False
    _table: Any = field(default=None, repr=False)

    def __post_init__(self) -> None:
        if self.panels is None:
            f = self.functions
            self.panels = lay_panels(f.addresses, f.p, self.kind, self.a, self.b, self.ref, self.w, 0.0, self.stop)
        if self.ill_conditioned:
            exact = self.functions.exact
            self.ends = exact_ends(exact, DIGITS, self.kind, self.a, self.b, self.ends)
            self.a, self.b = float(self.ends[0]), float(self.ends[1])
            self.panels = lay_exactly(exact, self.kind, self.ends, self.stop)
            self.from_exact = True
        if self.panels[7] == FAILED:
            raise SolutionError(
                f"time of flight from {self.a!r} to {self.b!r}: the integrand is not finite there; "
                "is the curve regular and the potential finite on this stretch?"
            )

    @property
    def edges(self) -> Array:
        """Panel edges in the anomaly."""
        edges: Array = self.panels[0]
        return edges

    @property
    def duration(self) -> float:
        """Time from one end to the other."""
        return float(self.panels[1][-1])

    @property
    def length(self) -> float:
        """Arc length from one end to the other."""
        return float(self.panels[2][-1])

    @property
    def relative_error(self) -> float:
        """Estimated relative error of the duration by quadrature."""
        return float(self.panels[5])

    @property
    def balance(self) -> float:
        """How much of V**2's regular factor is left where most of it cancels: this stretch's conditioning."""
        return float(self.panels[6])

    @property
    def ill_conditioned(self) -> bool:
        """Whether doubles lose digits of V**2 that matter."""
        return bool(self.panels[7] == ILL_CONDITIONED or self.panels[6] < LEAST_BALANCE)

    @property
    def direction(self) -> int:
        """The sign of dlam/dphi."""
        return 1 if self.b > self.a else -1

    @property
    def table(self) -> Any:
        """The anomaly over time, tabulated when first asked for."""
        if self._table is None:
            self._table = build_table(self.panels[0], self.panels[1], self.panels[3])
        return self._table

    def anomaly(self, t: Array, t_low: Array) -> Array:
        """The anomaly at times ``t + t_low`` from the end ``a``; exactly the first and the last one at both ends."""
        phi: Array = anomalies(*self.table[:5], t, t_low)
        phi[t + t_low <= 0.0] = 0.0
        phi[t + t_low >= self.duration] = self.edges[-1]
        return phi

    def anomaly_of(self, offset_a: float, offset_b: float) -> float:
        """The anomaly of a place given by its signed offsets ``lam - a`` and ``b - lam``."""
        share_a, share_b = max(offset_a * self.direction, 0.0), max(offset_b * self.direction, 0.0)
        if self.kind == TURN_TURN:
            return 2.0 * atan2(sqrt(share_a), sqrt(share_b))
        whole = abs(self.b - self.a)
        if self.kind == TO_EQUILIBRIUM:
            return -log(share_b / whole) if share_b > 0.0 else inf
        share = share_a / whole if share_a <= share_b else 1.0 - share_b / whole
        return sqrt(share) if self.kind == FROM_TURN else share

    def places(self, phi: Array) -> Array:
        """The curve's parameter at anomalies, from the nearer end."""
        width = self.b - self.a
        if self.kind == TURN_TURN:
            near = phi < 0.5 * pi
            return np.where(
                near,
                self.a + width * np.sin(0.5 * phi) ** 2,
                self.b - width * np.cos(0.5 * phi) ** 2,
            )
        if self.kind == TO_EQUILIBRIUM:
            return self.b - width * np.exp(-phi)
        share = phi**2 if self.kind == FROM_TURN else phi
        return np.where(share <= 0.5, self.a + width * share, self.b - width * (1.0 - share))

    def speeds(self, phi: Array) -> Array:
        """|ds/dt| at anomalies."""
        f = self.functions
        if self.from_exact:
            return self._paced(phi)
        speeds: Array = speeds_at(f.addresses, f.p, self.kind, self.a, self.b, self.ref, self.w, phi)
        return speeds

    def _paced(self, phi: Array) -> Array:
        """|ds/dt| from the panels themselves, where doubles cannot tell V**2 from nothing."""
        return slopes(self.edges, self.panels[4], phi) / slopes(self.edges, self.panels[3], phi)

    def times(self, phi: Array) -> Array:
        """Time from the end ``a`` to anomalies."""
        times: Array = read_off_many(self.panels[0], self.panels[1], self.panels[3], phi)
        return times

    def lengths(self, phi: Array) -> Array:
        """Arc length from the end ``a`` to anomalies."""
        lengths: Array = read_off_many(self.panels[0], self.panels[2], self.panels[4], phi)
        return lengths


def slopes(edges: Array, terms: Array, phi: Array) -> Array:
    """Derivatives of the panels' Legendre series at anomalies."""
    out = np.empty_like(phi)
    which = np.clip(np.searchsorted(edges, phi, side="right") - 1, 0, len(edges) - 2)
    for k in np.unique(which):
        half = 0.5 * (edges[k + 1] - edges[k])
        x = ((phi[which == k] - edges[k]) - half) / half
        out[which == k] = np.polynomial.legendre.legval(x, np.polynomial.legendre.legder(terms[k])) / half
    return out


def toward_equilibrium(functions: Functions, start: float, top: float, duration: float) -> Stretch:
    """A stretch from ``start`` that comes as close to an equilibrium as takes at least ``duration``."""
    stop = 8.0
    while True:
        stretch = Stretch(functions=functions, kind=TO_EQUILIBRIUM, a=start, b=top, stop=stop)
        if stretch.duration > duration or exp(-stop) * abs(start - top) < 1e-300:
            return stretch
        stop *= 2.0


def between_turns(
    functions: Functions,
    a: float,
    b: float,
    panels: Any = None,
    ends: tuple[Any, Any] = (None, None),
) -> Stretch:
    """A stretch between two turning points."""
    return Stretch(functions=functions, kind=TURN_TURN, a=a, b=b, stop=pi, panels=panels, ends=ends)


def from_turn(functions: Functions, turn: float, end: float) -> Stretch:
    """A stretch from a turning point to a place where the speed is not zero."""
    return Stretch(functions=functions, kind=FROM_TURN, a=turn, b=end)


def through(functions: Functions, start: float, end: float, ref: float, w: float, panels: Any = None) -> Stretch:
    """A stretch without special ends; ``w`` is V**2 at ``ref``."""
    return Stretch(functions=functions, kind=REGULAR, a=start, b=end, ref=ref, w=w, panels=panels)
