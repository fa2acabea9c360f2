"""Equilibria of a model, which are the stationary points of its effective potential; their stability, and the frequency
of small oscillations about them.

The zeros of dU/dlam are isolated by interval bounds, as the zeros of V**2 are (`zeros`): an interval on which the
bounds exclude zero has none, and any other is halved until it is tiny. So none is missed. Friction, drag and resistance
are ignored: they vanish at rest, or also hold a body near an equilibrium.
"""

from collections.abc import Iterator
from ctypes import POINTER, c_double
from dataclasses import dataclass, replace
from itertools import pairwise
from math import inf, nan, sqrt
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev

from gqm_sym.errors import InputError, SolutionError
from gqm_sym.literals.numbers import read_number
from gqm_sym.runtime.arithmetic.doubledouble import ULP
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.formulas import Formulas, ParameterValues
from gqm_sym.runtime.launch.problem import bind_all

_MANY = POINTER(c_double)

# On an open curve, equilibria beyond this value of the curve parameter are not searched for.
MAX_PLACE = 2.0**40

# The width below which an interval is not halved any more, as a share of the width of the first intervals.
MIN_WIDTH = 2.0**-32

# The largest number of intervals that are examined, and of equilibria that are listed.
MAX_INTERVALS, MAX_EQUILIBRIA = 40_000, 200

# The number of first intervals of a bounded range.
PIECES = 64

# The number of nodes of the polynomial from which the derivative of the slope is taken, and the share of the last
# coefficients below which it counts as accurate.
NODES, MAX_TAIL = 17, 1e-13

# The share of a period after its start at which a closed curve is cut. The start itself is often an equilibrium, or
# opposite to one.
SHIFT = 0.01234

# A slope of this size has underflowed and is not used.
TINY = 1e-290

# A slope, or a stiffness, below this share of its value a piece away is rounding.
ROUNDING = 1e-11


@dataclass(frozen=True, slots=True)
class Equilibrium:
    """A place where a body at rest stays.

    Attributes
    ----------
    lam : float
        The curve parameter there, in its unit.
    stable : bool
        Whether the effective potential rises in both directions.
    frequency : float
        Angular frequency of small oscillations about it in rad/s: the limit of 2*pi/period. NaN if the equilibrium is
        unstable, 0 if the restoring force is weaker than linear, and infinite at a corner or a cusp.
    """

    lam: float
    stable: bool
    frequency: float


class Potential:
    """The effective potential of a model with given parameters, called from Python.

    Parameters
    ----------
    formulas : Formulas
        The model.
    p : ParameterValues
        The values of its run-time parameters.
    """

    def __init__(self, formulas: Formulas, p: ParameterValues) -> None:
        self.bound = bind_all(formulas, p)
        potential, bounds = formulas.effective_potential, formulas.bounds
        self._potential = (potential or formulas.functions.effective_potential).call
        self._bounds = (bounds or formulas.functions.bounds).call
        self._p = self.bound.p.ctypes.data_as(_MANY)

    def rows(self, places: Any) -> Array:
        """Return U in m**2/s**2 and dU/dlam at places, as rows."""
        lam = np.ascontiguousarray(places, dtype=np.float64).reshape(-1)
        out = np.empty((2, lam.size))
        self._potential(lam.size, lam.ctypes.data_as(_MANY), self._p, out.ctypes.data_as(_MANY))
        return out

    def slope(self, lam: float) -> float:
        """Return dU/dlam at a place."""
        return float(self.rows([lam])[1, 0])

    def bounds(self, low: float, high: float) -> Array:
        """Lower and upper bound of dU/dlam, then of ds/dlam."""
        out = np.empty(4)
        self._bounds(low, high, self._p, out.ctypes.data_as(_MANY))
        return out


def equilibria(formulas: Formulas, p: ParameterValues, between: Any = None) -> tuple[Equilibrium, ...]:
    """Return the equilibria of a model, in ascending order.

    Parameters
    ----------
    formulas : Formulas
        The model.
    p : ParameterValues
        The values of its run-time parameters.
    between : pair of numbers, optional
        The range of the curve parameter to search. By default it is the whole domain, or one period from -period/2 (on
        a charted curve from 0).

    Raises
    ------
    InputError
        If the range is not a pair of numbers in ascending order.
    SolutionError
        If the potential is constant, or has too many equilibria to be listed. (Equilibria on parts of constant
        potential are omitted if the potential varies elsewhere.)
    """
    potential = Potential(formulas, p)
    domain = formulas.domain(p).numbers
    low, high = _range(formulas, domain, between)
    breaks = potential.bound.between(potential.bound.breaks, low, high)
    starts = sorted({low, high, *_cuts(low, high), *breaks.tolist()})
    clusters = list(_clusters(potential, starts))
    found: list[Equilibrium] = []
    for a, b in clusters:
        place = _located(potential, a, b, (domain.low, domain.high))
        if place[1] != (0, 0):
            found.append(_described(potential, *place, spacing=_spacing(place[0], clusters, starts)))
    if between is not None or not domain.period:
        return tuple(found)
    top = (1.0 if formulas.chart is not None else 0.5) * domain.period * (1.0 + MIN_WIDTH)
    moved = (replace(one, lam=one.lam - domain.period) if one.lam > top else one for one in found)
    return tuple(sorted(moved, key=lambda one: one.lam))


def _range(formulas: Formulas, domain: Any, between: Any) -> tuple[float, float]:
    """Return the ends of the range to search; infinite ones are replaced by the limits of the search."""
    if between is None:
        if domain.period:
            low = (SHIFT - (0.0 if formulas.chart is not None else 0.5)) * domain.period
            return low, low + domain.period
        return max(domain.low, -MAX_PLACE), min(domain.high, MAX_PLACE)
    try:
        low, high = (
            read_number(value, where="between", unit=formulas.units.get(formulas.parameter)).value for value in between
        )
    except (TypeError, ValueError):
        raise InputError(f"between: must be a pair of numbers (low, high), got {between!r}") from None
    if not domain.low <= low < high <= domain.high:
        ends = f"[{domain.low!r}, {domain.high!r}]"
        raise InputError(f"between: must be two places of the domain {ends} in order, got ({low!r}, {high!r})")
    return low, high


def _cuts(low: float, high: float) -> Iterator[float]:
    """Return the places at which the range is cut first: at equal distances, and by octaves if it is very large."""
    if high - low <= MAX_PLACE**0.5:
        yield from np.linspace(low, high, PIECES + 1)[1:-1].tolist()
        return
    for power in np.arange(-4.0, 41.0, 0.25):
        yield from (float(place) for place in (-(2.0**power), 2.0**power) if low < place < high)
    if low < 0.0 < high:
        yield 0.0


def _clusters(potential: Potential, starts: list[float]) -> Iterator[tuple[float, float]]:
    """Return tiny intervals that contain all zeros of the slope, in ascending order; neighbouring ones are joined."""
    waiting = [(a, b, (b - a) * MIN_WIDTH) for a, b in pairwise(starts)][::-1]
    current: tuple[float, float] | None = None
    looked = found = 0
    flat = True
    while waiting:
        a, b, least = waiting.pop()
        looked += 1
        if looked > MAX_INTERVALS or found > MAX_EQUILIBRIA:
            what = (
                f"more than {MAX_EQUILIBRIA} of them"
                if found > MAX_EQUILIBRIA
                else "on a level part of the curve all places are"
            )
            raise SolutionError(f"equilibria: {what}; give the range to look in as between=(low, high)")
        bottom, top = potential.bounds(a, b)[:2]
        flat = flat and bottom == 0.0 == top
        if max(abs(bottom), abs(top)) < TINY or bottom > 0.0 or top < 0.0 or not _is_real(potential, a, b):
            continue
        middle = 0.5 * (a + b)
        if b - a <= least or not a < middle < b:
            if current is not None and a - current[1] <= least:
                current = current[0], b
                continue
            if current is not None:
                found += 1
                yield current
            current = a, b
            continue
        waiting += [(middle, b, least), (a, middle, least)]
    if flat:
        raise SolutionError("equilibria: the potential is the same everywhere, so a body rests anywhere")
    if current is not None:
        yield current


def _is_real(potential: Potential, a: float, b: float) -> bool:
    """Return whether the potential has a slope somewhere in an interval, judged at a few places."""
    return bool(np.isfinite(potential.rows(np.linspace(a, b, 5))[1]).any())


def _located(potential: Potential, a: float, b: float, domain: tuple[float, float]) -> tuple[float, tuple[int, int]]:
    """Return the zero of the slope in a cluster, and the slope's signs before and after it; they are (0, 0) if there is
    no zero.
    """
    width = max(b - a, 4.0 * np.spacing(max(abs(a), abs(b))))
    low, high = max(a - width, domain[0]), min(b + width, domain[1])
    before, behind = potential.slope(low), potential.slope(high)
    signs = int(np.sign(before)), int(np.sign(behind))
    if domain[0] == low == a or domain[1] == high == b:  # beyond the end of a curve there is no force
        inside = signs[1] if low == domain[0] else signs[0]
        end = low if low == domain[0] else high
        at_end = abs(potential.slope(end)) <= ROUNDING * max(abs(before), abs(behind), 1e-300)
        return (end, (-inside, inside) if end == low else (inside, -inside)) if at_end else (end, (0, 0))
    if signs[0] == signs[1] or 0 in signs:
        wide = 2.0**20 * width
        around = potential.rows([low - wide, high + wide])[1]
        inner = potential.rows(np.linspace(low, high, 9))[1]
        k = int(np.argmin(np.abs(inner)))
        touches = abs(inner[k]) <= ROUNDING * np.abs(around).max()
        return float(np.linspace(low, high, 9)[k]), tuple(np.sign(around).astype(int).tolist()) if touches else (0, 0)
    while True:
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        if low < 0.0 < high and high - low < ULP * width:
            return 0.0, signs
        slope = potential.slope(middle)
        if slope == 0.0:
            return middle, signs
        low, high = (low, middle) if slope * before < 0.0 else (middle, high)
    return (low if abs(potential.slope(low)) <= abs(potential.slope(high)) else high), signs


def _spacing(place: float, clusters: list[tuple[float, float]], starts: list[float]) -> float:
    """Return a distance from a place within which the slope has no other zero: half the distance to the next zero or to
    an end.
    """
    others = [end for cluster in clusters if not cluster[0] <= place <= cluster[1] for end in cluster]
    ends = [place for place in (starts[0], starts[-1]) if abs(place) < MAX_PLACE]
    gaps = [abs(other - place) for other in (*others, *ends) if other != place]
    return 0.5 * min(gaps, default=max(1.0, abs(place)))


def _described(potential: Potential, lam: float, signs: tuple[int, int], *, spacing: float) -> Equilibrium:
    """Return an equilibrium with its stability and its frequency."""
    if signs != (-1, 1):
        return Equilibrium(lam, False, nan)
    ds = 0.5 * float(potential.bounds(lam, lam)[2:].sum())
    breaks, bound = potential.bound.breaks, potential.bound
    near = bound.between(breaks, lam - spacing, lam + spacing)
    tiny = 1e-9 * spacing
    reach = min((abs(place - lam) for place in near if abs(place - lam) > tiny), default=spacing)
    if not (np.abs(near - lam) <= tiny).any():
        stiffness = [_derivative(potential, lam, -reach, reach)]
    else:
        stiffness = [_derivative(potential, lam, 0.0, reach), _derivative(potential, lam, -reach, 0.0)]
    jump = abs(potential.slope(lam + tiny) - potential.slope(lam - tiny))
    if ds <= ROUNDING or jump > 1e-3 * abs(potential.slope(lam + reach) - potential.slope(lam - reach)):
        return Equilibrium(lam, True, inf)
    rates = [sqrt(max(value, 0.0)) / ds for value in stiffness]
    # Half a period on either side.
    return Equilibrium(lam, True, 0.0 if 0.0 in rates else len(rates) / sum(1.0 / rate for rate in rates))


def _derivative(potential: Potential, lam: float, left: float, right: float) -> float:
    """Return the derivative of the slope at a place, from a polynomial through values between lam + left and lam +
    right.
    """
    nodes = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)
    best, best_tail = nan, inf
    for _ in range(12):
        half, middle = 0.5 * (right - left), 0.5 * (right + left)
        slopes = potential.rows(lam + middle + half * nodes)[1]
        if np.isfinite(slopes).all():
            terms = chebyshev.chebfit(nodes, slopes, NODES - 1)
            size = float(np.abs(terms).max())
            tail = float(np.abs(terms[-3:]).max()) / size if size else 0.0
            value = float(chebyshev.chebval(-middle / half, chebyshev.chebder(terms))) / half
            if abs(value) * half <= ROUNDING * size:
                value = 0.0
            if tail < best_tail:
                best, best_tail = value, tail
            if tail <= MAX_TAIL:
                return value
        left, right = 0.5 * left, 0.5 * right
    return best
