"""The programs of gradients in double precision: the derivatives of half periods, without cancellation.

Between turning points ``V**2 = 2 (lam - a) (b - lam) Q`` with the divided difference ``Q = U[a, lam, b]`` of the
potential, so that the time per phase angle is ``ds/dlam / sqrt(2 Q)``. Its derivatives at the same phase angle follow
by differentiating the formula of Q, in which nothing cancels.

About an axis of symmetry the time may be an integral without divided differences, or pi over an arithmetic-geometric
mean (`derivation.wells.symmetric_orbits`). The logarithmic derivatives of the latter follow from the same steps: with
the arguments a and b, ``c_0**2 = a**2 - b**2``, and half the differences c_1, c_2, ... of its further steps,

    d tau/tau = -(1/2 + r) da/a - (1/2 - r) db/b,   r = (c_1**2 + 2 c_2**2 + 4 c_3**2 + ...)/c_0**2.
"""

from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from gqm_sym.runtime.double_double.interpreter import DIVIDE, MULTIPLY, SQUARE_ROOT
from gqm_sym.runtime.double_double.recording import Recorder, TapeNumber
from gqm_sym.runtime.gradients.adjoints import gradient, partials
from gqm_sym.runtime.gradients.lanes.assembly import LaneProgram, assemble, assemble_rates
from gqm_sym.runtime.gradients.lanes.differences import Places
from gqm_sym.runtime.gradients.lanes.operations import LaneRecorder, WithoutRuleError
from gqm_sym.runtime.gradients.lanes.scaling import Plan, Terms, combined, terms_of
from gqm_sym.runtime.gradients.programs import Program, Source, on_lap
from gqm_sym.runtime.gradients.programs import assemble as in_double_double
from gqm_sym.runtime.quadrature.trapezoid import COSINES_SQUARED, NODE_SHARES, SINES_SQUARED

# The coordinates of the nodes of the trapezoidal rule: minus the cosine of the phase angle and the square of its sine,
# or the squares of the cosine and sine of the angle from an axis of symmetry.
ALONG = np.array([np.copysign(np.sqrt(COSINES_SQUARED), NODE_SHARES - 0.5), SINES_SQUARED])
FROM_AXIS = np.array([COSINES_SQUARED, SINES_SQUARED])

# Those of laps: the share of the lap, and nothing else.
OVER_LAP = np.array([NODE_SHARES, np.zeros(NODE_SHARES.size)])

# The steps of an arithmetic-geometric mean. The relative difference of two numbers in the ratio 1 : 10 is then 4e-9,
# and the square of this is the error of one more arithmetic mean.
MEAN_STEPS = 4


@lru_cache(maxsize=64)
def end_programs(source: Source, wanted: tuple[int, ...]) -> tuple[Program, Program]:
    """Return the programs of the Newton step from the place to a turning point, and of the turning point's derivatives
    with respect to the ``wanted`` variables (of which the energy is the third after the parameters).
    """
    programs = []
    for variables in ((), wanted):
        op = LaneRecorder(source.inputs, 1)
        half = source.half(op, op.place)
        slope, *by = gradient(op, half, [op.place, *(op.values[k] for k in variables)])
        programs.append(in_double_double(op, [-(part / slope) for part in (by if variables else [half])]))
    return programs[0], programs[1]


@lru_cache(maxsize=64)
def turn_program(source: Source, wanted: tuple[int, ...]) -> Program:
    """Return the program of the slope of the potential at the launch place, of the Newton step from a place to the
    turning point next to it, and of the turning point's derivatives with respect to the ``wanted`` variables.

    The place is the turning point as a double, so that one step suffices, and so do slopes to first order in the step.
    """
    op = LaneRecorder(source.inputs, 1)
    half = source.half(op, op.place)
    by_inputs = gradient(op, half, [op.place, *(op.values[k] for k in wanted)])
    step = -(half / by_inputs[0])
    slope, *by = [part + step * gradient(op, part, [op.place])[0] for part in by_inputs]
    at_launch = gradient(op, half, [op.values[source.parameters]])[0]
    return in_double_double(op, [at_launch, step, *(-(part / slope) for part in by)])


class Swing(NamedTuple):
    """The inputs of the program of a libration on its tape.

    Attributes
    ----------
    parameters : sequence of TapeNumber
        The run-time parameters.
    launch : pair of TapeNumber
        The launch place and the launch speed.
    ends : pair of TapeNumber
        Both turning points.
    moves : sequence of sequences
        The derivatives of the turning points and the parameters with respect to each of the variables by which the
        formulas are differentiated (`Plan.moves`).
    """

    parameters: Sequence[TapeNumber]
    launch: tuple[TapeNumber, TapeNumber]
    ends: tuple[TapeNumber, TapeNumber]
    moves: Sequence[Sequence[TapeNumber]]


def swing_inputs(source: Source, plan: Plan) -> int:
    """Return the number of inputs of the program of a libration."""
    return source.variables + 2 + 2 * len(moved_variables(source, plan))


def swing_of(op: Recorder, source: Source, plan: Plan) -> Swing:
    """Return the inputs of the program of a libration: the variables of the source, both turning points, and the
    derivatives of the lower and then of the upper turning point.
    """
    n, variables = source.parameters, moved_variables(source, plan)
    p, (lam0, v0, _, a, b), moves = op.values[:n], op.values[n : n + 5], op.values[n + 5 :]
    moved = [
        (moves[j], moves[len(variables) + j], *(op.number(int(i == k)) for i in range(n)))
        for j, k in enumerate(variables)
    ]
    return Swing(p, (lam0, v0), (a, b), moved)


def moved_variables(source: Source, plan: Plan) -> tuple[int, ...]:
    """Return the variables by which turning points are differentiated: the energy, and parameters."""
    return plan.moves(source.parameters + 2)


@lru_cache(maxsize=64)
def swing_program(source: Source, plan: Plan) -> LaneProgram | None:
    """Return the program of the time per phase angle of a libration, differentiated at the same phase angle.

    Its inputs are those of `swing_of`, and the slope of the potential at the launch place. A place has two coordinates:
    minus the cosine of the phase angle, and the square of its sine. The results are Q and the derivatives of the time
    per phase angle. It is None if the potential contains an operation without a rule for divided differences.
    """
    op = LaneRecorder(swing_inputs(source, plan) + 1, 2, by_inverses=True)
    p, launch, (a, b), moves = swing_of(op, source, plan)
    over = Places(op, (a, b), *op.places)
    try:
        factor, ds = over.of(source.formulas.effective_potential, p).second, over.of(source.formulas.ds, p).at
    except WithoutRuleError:
        return None
    rate, adjoints = quotient_with_root(op, ds, 2 * factor)
    rates = [rate, *changes(op, adjoints, (a, b, *p), moves)]
    return assemble_rates(op, factor, rates, terms_of(op, source, plan, launch, op.values[-1]), ALONG)


@lru_cache(maxsize=64)
def lap_program(source: Source, direction: int, plan: Plan) -> LaneProgram:
    """Return the program of the time per share of a lap over pi, differentiated at the same share.

    The inputs are those of `programs.circulation_program`. The first coordinate of a place is the share. The results
    are V**3 and the derivatives. V**3 may vary by a factor of ten (`evaluation.MIN_FACTOR_RATIO`): where V**2 varies by
    more than five, the nodes at which variances are found miss so much of a hilltop that they are too small.
    """
    n, variables = source.parameters, source.variables
    op = LaneRecorder(variables + 1, 2, by_inverses=True)
    inputs, (lap, ds, v2) = op.values[:variables], on_lap(op, source, direction, op.places[0])
    rate, adjoints = quotient_with_root(op, (direction * lap / op.pi) * ds, v2)
    moves = [[op.number(int(i == k)) for i in range(variables)] for k in plan.moves(n + 2)]
    rates = [rate, *changes(op, adjoints, inputs, moves)]
    terms = terms_of(op, source, plan, (inputs[n], inputs[n + 1]))
    return assemble_rates(op, v2 * op.sqrt(v2), rates, terms, OVER_LAP)


class Orbits(NamedTuple):
    """The orbits about an axis of symmetry that a program is for.

    Attributes
    ----------
    source : Source
        The formulas.
    axes : callable
        ``f(op, p)`` gives a place of symmetry and the distance to the next (`Formulas.axes_of`).
    at_rest : bool
        Whether the launches are from rest. The inputs are then the run-time parameters, the launch place, the number of
        the axis, and the sign of the place's distance from it; otherwise the variables of the source, the number of the
        axis, the upper turning point, its derivatives, and in double precision the slope of the potential at the launch
        place.
    plan : Plan
        How derivatives are found.
    """

    source: Source
    axes: Callable[..., Any]
    at_rest: bool
    plan: Plan

    @property
    def inputs(self) -> int:
        """The number of inputs in double-double arithmetic."""
        variables = self.source.variables
        return variables if self.at_rest else variables + 2 + len(moved_variables(self.source, self.plan))

    def widths(self, op: Recorder) -> tuple[TapeNumber, list[list[TapeNumber]]]:
        """Record half the width of an orbit, and its changes and those of the parameters (`Plan.moves`)."""
        n, variables = self.source.parameters, self.source.variables
        p, moved = op.values[:n], self.plan.moves(n)
        parts = [[op.number(int(i == k)) for i in range(n)] for k in moved]
        if self.at_rest:
            end, number, sign = op.values[n:]
            changes = [op.number(int(k == n)) for k in moved]
        else:
            number, end, *changes = op.values[variables : self.inputs]
            sign = op.number(1)
        place, step = self.axes(op, p)
        axis = op.number(place) if step is None else place + number * step
        found = []
        for part, change in zip(parts, changes, strict=True):
            found.append([sign * (change - total_change(op, gradient(op, axis, p), part)), *part])
        return sign * (end - axis), found

    def terms(self, op: Recorder) -> list[Terms]:
        """Record the derivatives that are wanted as sums (`scaling.terms_of`)."""
        n = self.source.parameters
        launch = op.values[n], op.number(0) if self.at_rest else op.values[n + 1]
        slope = op.values[self.inputs] if len(op.values) > self.inputs else None
        return terms_of(op, self.source, self.plan, launch, slope)


def total_change(op: Recorder, by_inputs: Sequence[TapeNumber], move: Sequence[TapeNumber]) -> TapeNumber:
    """Record the change of a number with those of its inputs, given its partial derivatives."""
    return sum((by * part for by, part in zip(by_inputs, move, strict=True)), op.number(0))


@lru_cache(maxsize=64)
def axis_program(orbits: Orbits) -> LaneProgram | None:
    """Return the program of the time of a libration about an axis per angle, differentiated at the same angle.

    A place has two coordinates: the squares of the sine and of the cosine of the angle from the axis. The results are
    the divisor of the integrand, and the derivatives. It is None if the model has no such integrand, or if an operation
    in it has no rule for divided differences.
    """
    formula = orbits.source.formulas.time_integrand
    if formula is None:
        return None
    op = LaneRecorder(orbits.inputs if orbits.at_rest else orbits.inputs + 1, 2, by_inverses=True)
    p, (half, moves) = op.values[: orbits.source.parameters], orbits.widths(op)
    try:
        square, divisor = formula(op, half, *op.places, p)
    except WithoutRuleError:
        return None
    rate, adjoints = root_of_quotient(op, *_quotient(op, op.number(square)))
    rates = [rate, *changes(op, adjoints, (half, *p), moves)]
    return assemble_rates(op, divisor, rates, orbits.terms(op), FROM_AXIS)


@lru_cache(maxsize=64)
def exact_axis_program(orbits: Orbits) -> Program | None:
    """Return dt/dphi and the derivatives of `axis_program` as a program in double-double arithmetic.

    The coordinate of a place is the square of the sine of half the phase angle (`programs.libration_program`).
    """
    formula = orbits.source.formulas.time_integrand
    if formula is None:
        return None
    op = LaneRecorder(orbits.inputs, 1)
    p, (half, moves) = op.values[: orbits.source.parameters], orbits.widths(op)
    share, tilt = op.place, 1 - 2 * op.place
    try:
        rate = op.sqrt(formula(op, half, tilt * tilt, 4 * (share * (1 - share)), p)[0])
    except WithoutRuleError:
        return None
    by_inputs = gradient(op, rate, [half, *p])
    rates = [rate, *(total_change(op, by_inputs, move) for move in moves)]
    return in_double_double(op, [rate, *combined(op, orbits.terms(op), rates)])


@lru_cache(maxsize=64)
def mean_program(orbits: Orbits) -> LaneProgram | None:
    """Return the program of the derivatives of a half period that is pi over an arithmetic-geometric mean.

    With the first mean a_1, it is pi/a_1 in double-double arithmetic plus a small share, and so are its derivatives,
    with the first term of r. These shares and the rest of r, which are small unless one number is far smaller than the
    other, are computed in doubles. The coordinate of a place
    is 1. The first result is half the relative difference of the two numbers before the last step, the square of which
    is the error of the derivatives. The next ones are positive where roundings matter. The program is None if the model
    has no such mean.
    """
    formula = orbits.source.formulas.agm_arguments
    if formula is None:
        return None
    op = LaneRecorder(orbits.inputs if orbits.at_rest else orbits.inputs + 1, 1)
    p, (half, moves) = op.values[: orbits.source.parameters], orbits.widths(op)
    squares = [op.number(square) for square in formula(op, half, p)]
    a, b = (op.sqrt(square) for square in squares)
    first_mean = (a + b) * Fraction(1, 2)
    first_time = op.pi / first_mean
    first_share = (a - b) / (8 * first_mean)
    difference, rest, more = _mean_in_doubles(op, a, b)
    # The derivatives of half the logarithms of both squares.
    logarithmic = [[part / (2 * square) for part in gradient(op, square, [half, *p])] for square in squares]
    rates, losses = [first_time * more + first_time], []
    for move in moves:
        first, second = (total_change(op, parts, move) for parts in logarithmic)
        apart = first_time * (second - first)
        together = first_share * apart - first_time * (first + second) * Fraction(1, 2)
        small = rest * apart
        rates.append((small + more * (small + together)) + together)
        losses.append(256 * (small * small) - rates[-1] * rates[-1])
    terms = orbits.terms(op)
    found = combined(op, terms, rates)
    for total, some in zip(found, terms, strict=True):
        if len(some) > 1:
            parts = [number * rates[which] for number, which in some]
            losses.append(sum((part * part for part in parts), op.number(0)) - 4 * (total * total))
    return assemble(op, [difference, *losses, *found])


def _mean_in_doubles(op: LaneRecorder, a: TapeNumber, b: TapeNumber) -> tuple[TapeNumber, TapeNumber, TapeNumber]:
    """Record, for the arithmetic-geometric mean of two numbers, half their relative difference before the last step,
    the sum r of squares of differences (see the beginning of this file) without its first term, and by which share the
    mean is smaller than the arithmetic one, as a share of itself.
    """
    one = op.place
    mean, difference = (a + b) * Fraction(1, 2) * one, (a - b) * Fraction(1, 2) * one
    first_mean, lost = mean, op.number(0)
    share, rest = difference / (4 * mean), op.number(0)  # of c_1**2 in c_0**2
    b = op.sqrt(a * b * one)
    for _ in range(MEAN_STEPS):
        following = (mean + b) * Fraction(1, 2)
        b, mean = op.sqrt(mean * b), following
        shrink = difference / (4 * mean)
        share, difference = 2 * (share * (shrink * shrink)), difference * shrink
        rest, lost = rest + share, lost + difference
    return difference / mean, rest, lost / (first_mean - lost)


Adjoints = list[tuple[TapeNumber, TapeNumber]]
"""Numbers on which a formula depends, each with the formula's derivative with respect to it."""


def root_of_quotient(op: LaneRecorder, above: TapeNumber, below: TapeNumber) -> tuple[TapeNumber, Adjoints]:
    """Record sqrt(above/below) with its derivatives, which take no division of their own."""
    half = Fraction(1, 2)
    rate, inverse = op.root_of_quotient(above, below)
    return rate, [(above, half * inverse), (below, -half * (rate * (rate * inverse)))]


def quotient_with_root(op: LaneRecorder, above: TapeNumber, below: TapeNumber) -> tuple[TapeNumber, Adjoints]:
    """Record above/sqrt(below) in the same way; ``above`` may be a root."""
    code, *operands = op.entries[above.register] if above.known is None else (None,)
    if code == SQUARE_ROOT:
        return root_of_quotient(op, op.at(operands[0]), below)
    _, inverse = op.root_of_quotient(op.number(1), below)
    rate = above * inverse
    return rate, [(above, inverse), (below, Fraction(-1, 2) * (rate * (inverse * inverse)))]


def _quotient(op: LaneRecorder, number: TapeNumber) -> tuple[TapeNumber, TapeNumber]:
    """Return numerator and denominator of what was recorded as a quotient by a number that depends on the place; other
    numbers have the denominator 1.
    """
    code, *operands = op.entries[number.register] if number.known is None else (None,)
    for one, inverse in (operands, operands[::-1]) if code == MULTIPLY else ():
        kind, *parts = op.entries[inverse]
        if kind == DIVIDE and op.at(parts[0]).known == 1 and op.depends(parts[1]):
            return op.at(one), op.at(parts[1])
    return number, op.number(1)


def changes(
    op: LaneRecorder, given: Adjoints, inputs: Sequence[TapeNumber], moves: Sequence[Sequence[TapeNumber]]
) -> list[TapeNumber]:
    """Return the changes of a formula at fixed coordinates of the place.

    Parameters
    ----------
    op : LaneRecorder
        The tape, to which the changes are added.
    given : Adjoints
        Numbers that the formula consists of, with its derivatives.
    inputs : sequence of TapeNumber
        The inputs on which it depends.
    moves : sequence of sequences
        For each change wanted, that of each input.
    """
    found = [op.number(0)] * len(moves)
    for leaf, adjoint in leaf_adjoints(op, given).items():
        by_inputs = gradient(op, leaf, inputs)
        for j, move in enumerate(moves):
            change = total_change(op, by_inputs, move)
            found[j] = found[j] + adjoint * change
            if change.known is None:
                op.uncertain.add(change.register)
    return found


def leaf_adjoints(op: LaneRecorder, given: Adjoints) -> dict[TapeNumber, TapeNumber]:
    """Return the derivatives of a formula with respect to what does not depend on the place.

    The changes of these numbers are computed in double-double arithmetic, because parts of them may cancel.
    """
    adjoints: dict[int, TapeNumber] = {}
    for number, adjoint in given:
        if number.known is None:
            adjoints[number.register] = adjoints.get(number.register, op.number(0)) + adjoint
    leaves: dict[TapeNumber, TapeNumber] = {}
    for k in range(max(adjoints, default=-1), -1, -1):
        if k not in adjoints:
            continue
        if not op.depends(k):
            leaves[op.at(k)] = adjoints[k]
            continue
        for operand, partial in partials(op, k):
            part = adjoints[k] * partial
            adjoints[operand] = adjoints[operand] + part if operand in adjoints else part
    return leaves
