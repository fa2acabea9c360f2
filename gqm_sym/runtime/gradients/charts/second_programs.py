"""Second derivatives of half periods and times of laps along charts, recorded as tapes (`programs`).

A point of the curve is labelled by its arc length along the curve for the given parameters. The label lam stays with
the point when a parameter moves it, so that ds/dlam, which is 1, changes. The coordinates of a point are those of its
place and their first two derivatives with respect to the parameter u of its piece; then the displacement of the point
by each parameter that shapes the curve, likewise; and then its second derivatives by each pair of them, with one
derivative with respect to u.
"""

from collections.abc import Sequence
from functools import lru_cache

from gqm_sym.runtime.double_double.recording import Recorder, TapeNumber, scalar_product
from gqm_sym.runtime.gradients.adjoints import gradient
from gqm_sym.runtime.gradients.charts.programs import ChartSource
from gqm_sym.runtime.gradients.programs import LAUNCH_VARIABLES, Program, assemble
from gqm_sym.runtime.gradients.second_programs import pairs_of

# The derivatives with respect to u that a place and a displacement have, and those that a second displacement has, each
# beginning with order 0.
ORDERS, SECOND_ORDERS = 3, 2

Vector = Sequence[TapeNumber]


def size_of_bends(source: ChartSource) -> int:
    """Return the number of coordinates of a point."""
    moved, both = len(source.shaping), len(pairs_of(source.shaping))
    return source.dimension * (ORDERS * (1 + moved) + SECOND_ORDERS * both)


def inputs_of_launch(source: ChartSource) -> int:
    """Return the number of inputs that tell the launch: its point, and the changes of the arc length from the start
    point to the label by each parameter that shapes the curve, and by each pair of them.
    """
    return size_of_bends(source) + len(source.shaping) + len(pairs_of(source.shaping))


class _Point:
    """A point with the derivatives of its place, of ds/dlam and of the potential by its label (slopes, bends) and by
    the run-time parameters.
    """

    def __init__(self, op: Recorder, source: ChartSource, numbers: Sequence[TapeNumber]) -> None:
        d, parts = source.dimension, iter(numbers)
        self._op, self._p, self._zero = op, op.values[: source.parameters], op.number(0)
        place, rates, bends = ([next(parts) for _ in range(d)] for _ in range(ORDERS))
        self._place, self._square = place, scalar_product(rates, rates)
        self._speed = op.sqrt(self._square)
        self._share = scalar_product(bends, rates) / self._square
        self._tangent, self._turn = self._along(rates, bends)
        self._moves, self._move_rates, self._turned = dict[int, Vector](), dict[int, Vector](), dict[int, Vector]()
        for k in source.shaping:
            moves, *by_u = ([next(parts) for _ in range(d)] for _ in range(ORDERS))
            self._moves[k], (self._move_rates[k], self._turned[k]) = moves, self._along(*by_u)
        self._seconds = dict[tuple[int, int], tuple[Vector, Vector]]()
        for pair in pairs_of(source.shaping):
            twice, rate = ([next(parts) for _ in range(d)] for _ in range(SECOND_ORDERS))
            self._seconds[pair] = twice, [part / self._speed for part in rate]
        self.value, *self._by_place = map(op.number, source.potential(op, *self._place, self._p))
        self._by_p = gradient(op, self.value, self._p)
        self._stiffness = [gradient(op, by, self._place) for by in self._by_place]
        self.slope = scalar_product(self._by_place, self._tangent)
        self.bend = self._stiff(self._tangent, self._tangent) + scalar_product(self._by_place, self._turn)
        self.partials, self.partial_slopes = list(self._by_p), [self._across(k, self._tangent) for k in self._all]
        for k, moved in self._moves.items():
            self.partials[k] = self._by_p[k] + scalar_product(self._by_place, moved)
            steeper = self._stiff(moved, self._tangent) + scalar_product(self._by_place, self._move_rates[k])
            self.partial_slopes[k] = self.partial_slopes[k] + steeper
        self.strains = [self._zero] * source.variables
        self.strain_slopes = [self._zero] * source.variables
        for k, changed in self._move_rates.items():
            self.strains[k] = scalar_product(self._tangent, changed)
            turned = scalar_product(self._tangent, self._turned[k])
            self.strain_slopes[k] = scalar_product(self._turn, changed) + turned

    @property
    def _all(self) -> range:
        return range(len(self._p))

    def _along(self, rate: Vector, bend: Vector) -> tuple[Vector, Vector]:
        """Return two derivatives by the label of what has these derivatives by u."""
        turn = [(b - self._share * a) / self._square for a, b in zip(rate, bend, strict=True)]
        return [part / self._speed for part in rate], turn

    def _stiff(self, one: Vector, other: Vector) -> TapeNumber:
        """Return the second derivative of the potential along two vectors."""
        return scalar_product([scalar_product(row, one) for row in self._stiffness], other)

    def _across(self, k: int, along: Vector) -> TapeNumber:
        """Return the derivative by a run-time parameter of the slope of the potential along a vector."""
        return scalar_product(gradient(self._op, self._by_p[k], self._place), along)

    def second(self, i: int, j: int) -> TapeNumber:
        """Return the second derivative of the potential at the label by two run-time parameters, i <= j."""
        found = gradient(self._op, self._by_p[i], self._p)[j]
        for one, other in ((i, j), (j, i)):
            if other in self._moves:
                found = found + self._across(one, self._moves[other])
        if i in self._moves and j in self._moves:
            bent = scalar_product(self._by_place, self._seconds[i, j][0])
            found = found + (self._stiff(self._moves[i], self._moves[j]) + bent)
        return found

    def second_strain(self, i: int, j: int) -> TapeNumber:
        """Return the second derivative of ds/dlam at the label by two variables, i <= j."""
        if i not in self._moves or j not in self._moves:
            return self._zero
        one, other = self._move_rates[i], self._move_rates[j]
        turned = scalar_product(one, other) - self.strains[i] * self.strains[j]
        return turned + scalar_product(self._tangent, self._seconds[i, j][1])


class _Half:
    """Half of V**2 at a point with its first and second derivatives by the label and the variables.

    Attributes
    ----------
    point : _Point
        The point.
    half, slope, bend, partials, partial_slopes
        Half of V**2 with its derivatives by the label, and those by the variables.
    """

    def __init__(self, op: Recorder, source: ChartSource) -> None:
        n, count, size = source.variables, source.parameters, size_of_bends(source)
        here, start = (_Point(op, source, part) for part in (op.places[1:], op.values[n : n + size]))
        v0, energy = op.values[count + 1 : n]
        self._zero, self._one = op.number(0), op.number(1)
        # The label of the launch changes so that its arc length from the start point does not.
        lengthened = iter(op.values[n + size :])
        self._moves = [self._zero] * count + [self._one]
        for k in source.shaping:
            self._moves[k] = -next(lengthened)
        self._lengthened = dict(zip(pairs_of(source.shaping), lengthened, strict=False))
        self.point, self._start, self._count = here, start, count
        self.half = (v0 * v0 / 2 + energy) + (start.value - here.value)
        self.slope, self.bend = -here.slope, -here.bend
        launched = [*start.partials, self._zero]
        for k in (*source.shaping, count):
            launched[k] = launched[k] + start.slope * self._moves[k]
        here_partials = [*here.partials, self._zero]
        changes = [b - a for a, b in zip(here_partials, launched, strict=True)]
        self.partials = [*changes, v0, self._one]
        self.partial_slopes = [*(-part for part in here.partial_slopes), *[self._zero] * LAUNCH_VARIABLES]

    def second(self, i: int, j: int) -> TapeNumber:
        """Return a second derivative by two variables at a fixed label."""
        count, (i, j) = self._count, sorted((i, j))
        if j > count:
            return self._one if i == j == count + 1 else self._zero
        start, moves = self._start, self._moves
        slopes = [*start.partial_slopes, self._zero]
        moved = -(self._lengthened.get((i, j), self._zero) + start.strains[i] * moves[j] + start.strains[j] * moves[i])
        found = slopes[i] * moves[j] + slopes[j] * moves[i] + start.bend * moves[i] * moves[j] + start.slope * moved
        return found if j == count else (start.second(i, j) - self.point.second(i, j)) + found


def _tape(source: ChartSource, more: int) -> Recorder:
    """Return a tape with the inputs of the launch, and more."""
    return Recorder(source.variables + inputs_of_launch(source) + more, 1 + size_of_bends(source))


@lru_cache(maxsize=16)
def chart_turn_seconds(source: ChartSource, rows: tuple[int, ...]) -> Program:
    """Return the program of the derivatives of a turning point with respect to all variables, and then its second
    derivatives with respect to the pairs of variables in ``rows``.

    The inputs are the variables and those of the launch.
    """
    op = _tape(source, 0)
    here = _Half(op, source)
    moves = [-(part / here.slope) for part in here.partials]
    seconds = []
    for i, j in pairs_of(rows):
        change = here.second(i, j) + here.partial_slopes[i] * moves[j]
        steeper = here.partial_slopes[j] + here.bend * moves[j]
        seconds.append(-((change + moves[i] * steeper) / here.slope))
    return assemble(op, [*moves, *seconds])


def _libration(
    source: ChartSource, pairs: int
) -> tuple[Recorder, _Half, tuple[TapeNumber, TapeNumber], list[TapeNumber], list[TapeNumber]]:
    """Return the tape of `chart_libration_seconds` for a number of pairs, half of V**2 at a share of the width, both
    turning points, the derivatives of the label at this share, and those of the width over the width.
    """
    n = source.variables
    op = _tape(source, 2 * (1 + n + pairs))
    a, b, *ends = op.values[n + inputs_of_launch(source) :]
    low, high, share = ends[: len(ends) // 2], ends[len(ends) // 2 :], op.place
    moved = [at_low + (at_high - at_low) * share for at_low, at_high in zip(low, high, strict=True)]
    wider = [(at_high - at_low) / (b - a) for at_low, at_high in zip(low, high, strict=True)]
    return op, _Half(op, source), (a, b), moved, wider


@lru_cache(maxsize=16)
def chart_libration_seconds(source: ChartSource, rows: tuple[int, ...]) -> Program:
    """Return the program of dt/dphi and its second derivatives, as `second_programs.libration_seconds` does.

    The inputs are the variables, those of the launch, both turning points as distances from the lower one, and the
    derivatives of each as `chart_turn_seconds` gives them.
    """
    n, pairs = source.variables, pairs_of(rows)
    op, here, (a, b), moved, wider = _libration(source, len(pairs))
    share, width, half, point = op.place, b - a, here.half, here.point
    rate = width * op.sqrt(share * (1 - share)) / op.sqrt(2 * half)
    # The changes of half of V**2 are computed as a whole, because their parts are large near the turning points.
    faster = [part + here.slope * move for part, move in zip(here.partials, moved, strict=False)]
    log_rates = [wider[k] + point.strains[k] - faster[k] / (2 * half) for k in range(n)]
    outputs = [rate]
    for k, (i, j) in enumerate(pairs, start=n):
        by_half = here.second(i, j) + here.partial_slopes[j] * moved[i]
        by_half = by_half + (here.partial_slopes[i] + here.bend * moved[i]) * moved[j] + here.slope * moved[k]
        longer = point.second_strain(i, j) - point.strains[i] * point.strains[j]
        longer = longer + point.strain_slopes[i] * moved[j] + point.strain_slopes[j] * moved[i]
        change = wider[k] - wider[i] * wider[j] - (by_half - faster[i] * faster[j] / half) / (2 * half)
        outputs.append(rate * (log_rates[i] * log_rates[j] + change + longer))
    return assemble(op, outputs)


@lru_cache(maxsize=16)
def chart_circulation_seconds(source: ChartSource, rows: tuple[int, ...]) -> Program:
    """Return the program of dt/dshare and its second derivatives at the same share of a lap, with respect to the pairs
    of variables in ``rows``.

    The inputs are the variables, those of the launch, and the length of the lap.
    """
    op = _tape(source, 1)
    here = _Half(op, source)
    half, point, outputs = here.half, here.point, list[TapeNumber]()
    rate = op.values[-1] / op.sqrt(2 * half)
    for i, j in pairs_of(rows):
        product = here.partials[i] * here.partials[j] / half
        slower = (3 * product - 2 * here.second(i, j)) / (4 * half)
        crossed = point.strains[i] * here.partials[j] + point.strains[j] * here.partials[i]
        outputs.append(rate * (slower + point.second_strain(i, j) - crossed / (2 * half)))
    return assemble(op, [rate, *outputs])


@lru_cache(maxsize=16)
def chart_joint_program(source: ChartSource, rows: tuple[int, ...]) -> Program:
    """Return the program of what jumps at joints where pieces of the curve meet, for the pairs of variables in
    ``rows``: its jumps are the second derivatives of the half period that come from the change of the joint's phase.

    The first derivatives of the integrand at a fixed phase jump there, as those of ds/dlam do. The inputs are those of
    `chart_libration_seconds`.
    """
    pairs = pairs_of(rows)
    op, here, _, moved, _ = _libration(source, len(pairs))
    strains, speed = here.point.strains, op.sqrt(2 * here.half)
    return assemble(op, [(strains[i] * moved[j] + strains[j] * moved[i]) / speed for i, j in pairs])
