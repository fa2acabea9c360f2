"""Second derivatives of half periods and times of laps along charts, recorded as tapes (`programs`).

The variables are those that do not shape the curve. The coordinates of a point are those of its place and their first
two derivatives with respect to u; from these the second derivative of the potential over arc length follows.
"""

from collections.abc import Sequence
from functools import lru_cache

from gqm_sym.runtime.double_double.recording import Recorder, TapeNumber, scalar_product
from gqm_sym.runtime.gradients.adjoints import gradient
from gqm_sym.runtime.gradients.charts.programs import ChartSource
from gqm_sym.runtime.gradients.programs import LAUNCH_VARIABLES, Program, assemble
from gqm_sym.runtime.gradients.second_programs import pairs_of


class _PotentialAt:
    """The potential at a point with its derivatives by arc length (slope, bend) and by run-time parameters."""

    def __init__(self, op: Recorder, source: ChartSource, numbers: Sequence[TapeNumber]) -> None:
        d = source.dimension
        place, rates, bends = numbers[:d], numbers[d : 2 * d], numbers[2 * d :]
        self._op, self._p = op, op.values[: source.parameters]
        self.value, *by_place = map(op.number, source.potential(op, *place, self._p))
        square = scalar_product(rates, rates)
        speed, share = op.sqrt(square), scalar_product(bends, rates) / square
        tangent = [rate / speed for rate in rates]
        turn = [(bend - share * rate) / square for bend, rate in zip(bends, rates, strict=True)]
        self.slope = scalar_product(by_place, tangent)
        stiffness = [scalar_product(gradient(op, by, place), tangent) for by in by_place]
        self.bend = scalar_product(stiffness, tangent) + scalar_product(by_place, turn)
        self.partials = gradient(op, self.value, self._p)
        self.partial_slopes = [scalar_product(gradient(op, part, place), tangent) for part in self.partials]

    def seconds(self, i: int) -> list[TapeNumber]:
        """Return the derivatives of a derivative by a run-time parameter with respect to all of them."""
        return gradient(self._op, self.partials[i], self._p)


class _Half:
    """Half of V**2 at a point with its first and second derivatives by the place and the variables."""

    def __init__(self, op: Recorder, source: ChartSource) -> None:
        n, count, size = source.variables, source.parameters, 3 * source.dimension
        here, start = (_PotentialAt(op, source, part) for part in (op.places[1:], op.values[n : n + size]))
        v0, energy = op.values[count + 1 : n]
        zero, one = op.number(0), op.number(1)
        self.half = (v0 * v0 / 2 + energy) + (start.value - here.value)
        self.slope, self.bend = -here.slope, -here.bend
        changes = [b - a for a, b in zip(here.partials, start.partials, strict=True)]
        self.partials = [*changes, start.slope, v0, one]
        self.partial_slopes = [*(-part for part in here.partial_slopes), *[zero] * LAUNCH_VARIABLES]
        self._here, self._start, self._count, self._zero, self._one = here, start, count, zero, one

    def second(self, i: int, j: int) -> TapeNumber:
        """Return a second derivative by two variables at a fixed place."""
        count, (i, j) = self._count, sorted((i, j))
        if j < count:
            return self._start.seconds(i)[j] - self._here.seconds(i)[j]
        if j == count:
            return self._start.bend if i == count else self._start.partial_slopes[i]
        return self._one if i == j == count + 1 else self._zero


@lru_cache(maxsize=16)
def chart_turn_seconds(source: ChartSource, rows: tuple[int, ...]) -> Program:
    """Return the program of the derivatives of a turning point with respect to all variables, and then its second
    derivatives with respect to the pairs of variables in ``rows``.

    The inputs are the variables and the point of the launch.
    """
    size = 3 * source.dimension
    op = Recorder(source.variables + size, 1 + size)
    here = _Half(op, source)
    moves = [-(part / here.slope) for part in here.partials]
    seconds = []
    for i, j in pairs_of(rows):
        change = here.second(i, j) + here.partial_slopes[i] * moves[j]
        steeper = here.partial_slopes[j] + here.bend * moves[j]
        seconds.append(-((change + moves[i] * steeper) / here.slope))
    return assemble(op, [*moves, *seconds])


@lru_cache(maxsize=16)
def chart_libration_seconds(source: ChartSource, rows: tuple[int, ...]) -> Program:
    """Return the program of dt/dphi and its second derivatives, as `second_programs.libration_seconds` does.

    The inputs are the variables, the point of the launch, both turning points as distances from the lower one, and the
    derivatives of each as `chart_turn_seconds` gives them.
    """
    n, pairs, size = source.variables, pairs_of(rows), 3 * source.dimension
    op = Recorder(n + size + 2 * (1 + n + len(pairs)), 1 + size)
    a, b, *ends = op.values[n + size :]
    low, high, share, here = ends[: len(ends) // 2], ends[len(ends) // 2 :], op.place, _Half(op, source)
    width, half = b - a, here.half
    rate = width * op.sqrt(share * (1 - share)) / op.sqrt(2 * half)
    moved = [at_low + (at_high - at_low) * share for at_low, at_high in zip(low, high, strict=True)]
    wider = [(at_high - at_low) / width for at_low, at_high in zip(low, high, strict=True)]
    # The changes of half of V**2 are computed as a whole, because their parts are large near the turning points.
    faster = [part + here.slope * move for part, move in zip(here.partials, moved, strict=False)]
    log_rates = [wider[k] - faster[k] / (2 * half) for k in range(n)]
    outputs = [rate]
    for k, (i, j) in enumerate(pairs, start=n):
        by_half = here.second(i, j) + here.partial_slopes[j] * moved[i]
        by_half = by_half + (here.partial_slopes[i] + here.bend * moved[i]) * moved[j] + here.slope * moved[k]
        change = wider[k] - wider[i] * wider[j] - (by_half - faster[i] * faster[j] / half) / (2 * half)
        outputs.append(rate * (log_rates[i] * log_rates[j] + change))
    return assemble(op, outputs)


@lru_cache(maxsize=16)
def chart_circulation_seconds(source: ChartSource, rows: tuple[int, ...]) -> Program:
    """Return the program of dt/dshare and its second derivatives at the same share of a lap, with respect to the pairs
    of variables in ``rows``.

    The inputs are the variables, the point of the launch, and the length of the lap.
    """
    size = 3 * source.dimension
    op = Recorder(source.variables + size + 1, 1 + size)
    here = _Half(op, source)
    half, rate, outputs = here.half, op.values[-1] / op.sqrt(2 * here.half), list[TapeNumber]()
    for i, j in pairs_of(rows):
        product = here.partials[i] * here.partials[j] / half
        outputs.append(rate * ((3 * product - 2 * here.second(i, j)) / (4 * half)))
    return assemble(op, [rate, *outputs])
