"""The integrands at the nodes of panels where a body turns beside a hilltop, or only just passes one, in doubles.

There V**2 and ds/dlam are polynomials of the distance from the turning point or the hilltop, whose coefficients are
found in extended precision. With the root of V**2 at a turning point divided out nothing cancels in them, so that few
operations in doubles give what digits beyond double-double arithmetic would be needed for by subtraction.
"""

from fractions import Fraction
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.multiprecision.exact_problem import Arithmetic
from gqm_sym.runtime.quadrature.substitution import FROM_TURN, REGULAR, TURN_TURN

# The number of coefficients, and the range in which the values that they follow from are computed, as a share of the
# segment.
TERMS, RANGE = 9, 1e-7

# The last two terms of a sum and the errors of its coefficients are at most this share of it; the sum of the absolute
# values of its terms is at most so many times as large.
MAX_REST, MAX_CANCELLATION = 2.0**-56, 2.0

# The roundings of a coefficient, in units of the last of all digits of the terms of V**2: by far more than there are,
# so that V**2 by subtraction, from which durations follow, has enough digits too wherever polynomials are used.
ROUNDINGS = 1e9

# The number of steps of Newton's method to a hilltop.
NEWTON_STEPS = 4


class Powers(NamedTuple):
    """Functions as polynomials of the distance from a place.

    Attributes
    ----------
    place : mpf
        The place.
    v2, ds : (TERMS,) array
        The coefficients of V**2 and ds/dlam.
    errors : (TERMS,) array
        Bounds of the errors of those of V**2 that are due to the number of digits.
    """

    place: Any
    v2: Array
    ds: Array
    errors: Array


class SlowRates:
    """The integrands of a segment next to its turning points, or to the hilltop on it.

    Parameters
    ----------
    scale : Arithmetic
        The launch, to some digits.
    kind : int
        The segment's kind (`substitution`).
    ends : pair
        Its ends, in extended precision.
    """

    def __init__(self, scale: Arithmetic, kind: int, ends: tuple[Any, Any]) -> None:
        self._scale, self._kind, self._ends = scale, kind, ends
        self._at_ends: list[Powers | None] = [None, None]
        self._hilltops: list[Powers] = []

    def __call__(self, middle: Any, reach: Any, nodes: Array) -> Array | None:
        """Return rows of dt/dphi, ds/dphi and the regular factor of the speed, as `panel_rates`; None where the
        polynomials do not hold.
        """
        beside_turn = None if self._kind == REGULAR else self._beside_turn(middle, reach, nodes)
        return self._by_hilltop(middle, reach, nodes) if beside_turn is None else beside_turn

    def _beside_turn(self, middle: Any, reach: Any, nodes: Array) -> Array | None:
        (a, b), context = self._ends, self._scale.context
        is_last = self._kind == TURN_TURN and 2 * middle > context.pi
        # The phase from the turn. Next to it 1 + node and 1 - node have more digits than the phase of a node.
        nearer, shares = (context.pi - middle, 1.0 - nodes) if is_last else (middle, 1.0 + nodes)
        phase, powers = float(nearer - reach) + float(reach) * shares, self._powers(int(is_last))
        width, sense = abs(float(b - a)), -1.0 if (b < a) != is_last else 1.0
        if self._kind == FROM_TURN:
            distance, slope, growth = width * phase**2, np.full_like(phase, 2.0), np.ones_like(phase)
        else:
            slope = np.cos(0.5 * phase)
            distance, growth = width * np.sin(0.5 * phase) ** 2, 2.0 * slope
        quotient, ds = (
            _value(sense * powers.v2[1:], sense * distance, powers.errors[1:]),
            _value(powers.ds, sense * distance),
        )
        if quotient is None or ds is None:
            return None
        root, length = np.sqrt(quotient), np.sqrt(width) * slope * ds
        return np.array([length / root, length * np.sqrt(distance), np.sqrt(width) * root / growth])

    def _by_hilltop(self, middle: Any, reach: Any, nodes: Array) -> Array | None:
        a, b = self._ends
        edges = [(self._place(phi), phi) for phi in (middle - reach, middle + reach)]
        known, place = tuple(self._hilltops), (edges[0][0] + edges[1][0]) / 2
        for powers in known:
            found = self._about_place(powers, edges, reach, nodes)
            if found is not None:
                return found
        if any(abs(powers.place - place) <= RANGE * abs(b - a) for powers in known):
            return None
        new = self._hilltop(place)
        return None if new is None else self._about_place(new, edges, reach, nodes)

    def _place(self, phase: Any) -> Any:
        """Return the place at a phase."""
        a, b = self._ends
        if self._kind == REGULAR:
            return a + (b - a) * phase
        return a + (b - a) * (phase if self._kind == FROM_TURN else self._scale.context.sin(phase / 2)) ** 2

    def _about_place(self, powers: Powers, edges: list[tuple[Any, Any]], reach: Any, nodes: Array) -> Array | None:
        """Return the rows from polynomials about a place, given the edges of the panel, as places and phases."""
        # Distances are counted from the edge of the panel that is nearer to the hilltop.
        is_last = abs(edges[1][0] - powers.place) < abs(edges[0][0] - powers.place)
        edge, at_edge = edges[is_last][0], float(edges[is_last][1])
        start, width = float(edge - powers.place), float(self._ends[1] - self._ends[0])
        step = float(reach) * (nodes - 1.0 if is_last else nodes + 1.0)
        phase = at_edge + step
        if self._kind == REGULAR:
            distance, slope, growth = step, np.ones_like(step), np.ones_like(step)
        elif self._kind == FROM_TURN:
            distance, slope, growth = step * (phase + at_edge), 2.0 * phase, phase
        else:
            distance, growth = np.sin(0.5 * step) * np.sin(0.5 * (phase + at_edge)), np.sin(phase)
            slope = 0.5 * growth
        distance = start + width * distance
        v2, ds = _value(powers.v2, distance, powers.errors), _value(powers.ds, distance)
        if v2 is None or ds is None:
            return None
        speed, length = np.sqrt(v2), abs(width) * slope * ds
        return np.array([length / speed, length, speed / growth])

    def _powers(self, number: int) -> Powers:
        """Return the polynomials about an end of the segment."""
        found = self._at_ends[number]
        if found is None:
            a, b = self._ends
            found = self._at_ends[number] = self._about(self._ends[number], 1 if (a < b) == (number == 0) else -1)
        return found

    def _hilltop(self, place: Any) -> Powers | None:
        """Return the polynomials about the hilltop next to a place; None if there is none."""
        (a, b), room = self._ends, abs(self._ends[1] - self._ends[0]) * self._scale.mpf(RANGE)
        for _ in range(NEWTON_STEPS):
            powers = self._about(place, 0)
            if not powers.v2[2] > 0.0:
                return None
            step = -powers.v2[1] / (2.0 * powers.v2[2])
            if not min(a, b) - room < place + step < max(a, b) + room:
                return None
            if abs(step) <= RANGE * room:
                self._hilltops.append(powers)
                return powers
            place += step
        return None

    def _about(self, place: Any, side: int) -> Powers:
        """Return the polynomials about a place from values on one side of it, or on both."""
        scale, (a, b) = self._scale, self._ends
        context, step = scale.context, abs(b - a) * scale.mpf(RANGE) / TERMS
        shares = [side * k if side else k - TERMS // 2 for k in range(TERMS)]
        places = [place + share * step for share in shares]
        v2, ds = [scale.speed_squared(at) for at in places], [scale.ds(at) for at in places]
        weights = [[scale.mpf(number.numerator) / number.denominator for number in row] for row in _powers_of(*shares)]
        v2_terms, ds_terms = (
            np.array([float(context.fdot(row, values) / step**k) for k, row in enumerate(weights)])
            for values in (v2, ds)
        )
        rounding = (
            scale.mpf(10) ** -scale.digits * ROUNDINGS * (abs(scale.w0) + 4 * abs(scale.base) + max(map(abs, v2)))
        )
        return Powers(place, v2_terms, ds_terms, np.array([float(rounding / step**k) for k in range(TERMS)]))


@cache
def _powers_of(*nodes: int) -> list[list[Fraction]]:
    """Return the matrix that turns values at nodes into coefficients of powers."""
    columns = []
    for node in nodes:
        basis = [Fraction(1)]
        for other in nodes:
            if other != node:  # times (x - other)/(node - other)
                shifted, same = [Fraction(0), *basis], [*basis, Fraction(0)]
                basis = [(up - other * term) / (node - other) for up, term in zip(shifted, same, strict=True)]
        columns.append(basis)
    return [list(row) for row in zip(*columns, strict=True)]


def _value(terms: Array, x: Array, errors: Array | None = None) -> Array | None:
    """Return the values of a positive polynomial; None if its terms cancel, or more terms or digits would be needed."""
    if not (np.isfinite(terms).all() and (errors is None or np.isfinite(errors).all())):
        return None
    powers = x ** np.arange(terms.size)[:, np.newaxis]
    parts = terms[:, np.newaxis] * powers
    total, sizes = parts.sum(axis=0), np.abs(parts)
    rest = sizes[-2:].sum(axis=0) + (0.0 if errors is None else errors @ np.abs(powers))
    found: Array = total
    holds = (sizes.sum(axis=0) <= MAX_CANCELLATION * total) & (rest <= MAX_REST * total)
    return found if holds.all() else None
