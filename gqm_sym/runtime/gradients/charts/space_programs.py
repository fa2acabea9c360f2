"""The programs of gradients along charts in space (`programs`), with three coordinates of each point.

They are x, y and z, their derivatives with respect to u, and the curvature as a vector K. With the applied force's
part across the curve, the vector -L per unit mass, the contact force is the length of m (V**2 K + L).
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

from gqm_sym.runtime.double_double.recording import Recorder, TapeNumber, scalar_product
from gqm_sym.runtime.gradients.adjoints import gradient
from gqm_sym.runtime.gradients.charts.programs import ChartSource
from gqm_sym.runtime.gradients.programs import Program, assemble

# A number that keeps the square of a length that vanishes from being zero.
LEAST_SQUARE = 1e-300


def _across(vector: Sequence[TapeNumber], along: Sequence[TapeNumber]) -> list[TapeNumber]:
    """Return the part of a vector across a direction."""
    share = scalar_product(vector, along) / scalar_product(along, along)
    return [a - share * b for a, b in zip(vector, along, strict=True)]


class SpaceSource(ChartSource):
    """The formulas that programs of motions along charts in space are recorded from.

    ``potential`` takes x, y and z, and gives derivatives with respect to each.
    """

    __slots__ = ()

    @property
    def dimension(self) -> int:
        """The number of coordinates of a place."""
        return 3

    def _at(self, op: Recorder, numbers: Sequence[TapeNumber]) -> tuple[TapeNumber, TapeNumber, list[TapeNumber]]:
        place, rates, p = numbers[:3], numbers[3:6], op.values[: self.parameters]
        value, *by_place = map(op.number, self.potential(op, *place, p))
        partials, speed = gradient(op, value, p), op.sqrt(scalar_product(rates, rates))
        for k, moved in zip(self.shaping, self._moves(numbers), strict=True):
            partials[k] = partials[k] + scalar_product(by_place, _across(moved, rates))
        return value, scalar_product(by_place, rates) / speed, partials

    def _strains(self, op: Recorder, numbers: Sequence[TapeNumber]) -> list[tuple[int, TapeNumber]]:
        rates, bend = numbers[3:6], numbers[6:9]
        moves = zip(self.shaping, self._moves(numbers), strict=True)
        return [(k, -scalar_product(bend, _across(moved, rates))) for k, moved in moves]


def _contact_products(
    op: Recorder,
    source: SpaceSource,
    bend: Sequence[TapeNumber],
    load: Sequence[TapeNumber],
    rates: Sequence[TapeNumber],
) -> list[TapeNumber]:
    """Return half of the factor of V**2, and in a rotating frame of those of V and V**3, in the square of N/m.

    N/m is the length of V**2 K + L + V A.
    """
    product, speed = scalar_product(bend, load), op.sqrt(scalar_product(rates, rates))
    if source.coriolis is None:
        return [product]
    t = [rate / speed for rate in rates]
    a = [op.number(part) for part in source.coriolis(op, *t, op.values[: source.parameters])]
    across = [a[i] * t[j] - a[j] * t[i] for i, j in ((1, 2), (2, 0), (0, 1))]
    return [product + scalar_product(a, a) / 2, scalar_product(load, across), scalar_product(bend, across)]


@lru_cache(maxsize=64)
def space_path_program(source: SpaceSource) -> Program:
    """Return the program of states at a point of a chart in space, as `programs.chart_path_program` does; y, the
    product of ``path.PRODUCT`` and in a rotating frame the quantities of ``path.ASIDE`` follow.

    The coordinates are x, y and z with their first three derivatives with respect to u, and for each parameter that
    shapes the curve the displacement of these with its first two.
    """
    p = source.parameters
    op = Recorder(p, 12 + 9 * len(source.shaping))
    values, places = op.values, op.places
    place, rates, bends, following = places[:3], places[3:6], places[6:9], places[3:12]
    square, mass = scalar_product(rates, rates), values[source.mass]
    speed = op.sqrt(square)
    value, *by_place = map(op.number, source.potential(op, *place, values))
    bend = [part / square for part in _across(bends, rates)]
    load = [source.one_plus_beta(op) * part for part in _across(by_place, rates)]
    curvature, still = (op.sqrt(scalar_product(part, part) + LEAST_SQUARE) for part in (bend, load))
    outputs: list[Any] = []
    quantities = [place[0], place[2], None, mass * curvature, mass * still, value, place[1]]
    quantities += [mass * mass * product for product in _contact_products(op, source, bend, load, rates)]
    for quantity in quantities:
        partials = [op.number(0)] * (p + 9) if quantity is None else gradient(op, quantity, [*values, *places[:9]])
        by_values, by_places = partials[:p], partials[p:]
        along = sum((a * b for a, b in zip(by_places, following, strict=True)), op.number(0)) / speed
        for i, k in enumerate(source.shaping):
            moved = places[12 + 9 * i : 21 + 9 * i]
            if quantity is None:
                by_values[k] = -scalar_product(bend, moved[:3])
                continue
            for a, b in zip(by_places, moved, strict=True):
                by_values[k] = by_values[k] + a * b
            by_values[k] = by_values[k] - along * scalar_product(moved[:3], rates) / speed
        outputs += [op.number(1) if quantity is None else quantity, *by_values, along]
    return assemble(op, outputs)
