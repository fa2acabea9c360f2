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

from gqm_sym.runtime.double_double.recording import Recorder, TapeNumber
from gqm_sym.runtime.gradients.adjoints import gradient, partials
from gqm_sym.runtime.gradients.lanes.assembly import LaneProgram, assemble
from gqm_sym.runtime.gradients.lanes.differences import Places, WithoutRuleError
from gqm_sym.runtime.gradients.lanes.operations import LaneRecorder
from gqm_sym.runtime.gradients.programs import Program, Source
from gqm_sym.runtime.gradients.programs import assemble as in_double_double
from gqm_sym.runtime.quadrature.trapezoid import COSINES_SQUARED, OFFSETS_FROM_A, OFFSETS_TO_B, SINES_SQUARED

# The coordinates of the nodes of the trapezoidal rule: the squares of the sine and cosine of half the phase angle, or
# of the angle from an axis of symmetry.
ALONG = np.array([OFFSETS_FROM_A, OFFSETS_TO_B])
FROM_AXIS = np.array([COSINES_SQUARED, SINES_SQUARED])

# The steps of an arithmetic-geometric mean. The relative difference of two numbers in the ratio 1 : 10 is then 4e-9,
# and the square of this is the error of one more arithmetic mean.
MEAN_STEPS = 4


@lru_cache(maxsize=64)
def end_programs(source: Source, wanted: tuple[int, ...]) -> tuple[Program, Program]:
    """Return the programs of the Newton step from the place to a turning point, and of the turning point's derivatives
    with respect to the ``wanted`` variables.
    """
    programs = []
    for variables in ((), wanted):
        op = Recorder(source.inputs)
        half = source.half(op, op.place)
        slope, *by = gradient(op, half, [op.place, *(op.values[k] for k in variables)])
        programs.append(in_double_double(op, [-(part / slope) for part in (by if variables else [half])]))
    return programs[0], programs[1]


@lru_cache(maxsize=64)
def swing_program(source: Source, wanted: tuple[int, ...]) -> LaneProgram | None:
    """Return the program of the time per phase angle of a libration, differentiated at the same phase angle.

    The inputs are the run-time parameters, both turning points, and the derivatives of the lower and then of the upper
    turning point with respect to each of the ``wanted`` variables. A place has two coordinates: the squares of the sine
    and of the cosine of half the phase angle. The results are Q and the derivatives of the time per phase angle. It is
    None if the potential contains an operation without a rule for divided differences.
    """
    n, count = source.parameters, len(wanted)
    op = LaneRecorder(n + 2 + 2 * count, 2)
    p, (a, b), moves = op.values[:n], op.values[n : n + 2], op.values[n + 2 :]
    over = Places(op, (a, b), (op.places[0], op.places[1]))
    try:
        factor, ds = over.of(source.formulas.effective_potential, p).second, over.of(source.formulas.ds, p).at[1]
    except WithoutRuleError:
        return None
    rate = ds / op.sqrt(2 * factor)
    moved = [(moves[j], moves[count + j], *(op.number(int(i == k)) for i in range(n))) for j, k in enumerate(wanted)]
    found = changes(op, rate, (a, b, *p), moved)
    return assemble(op, [factor, *found], found, ALONG)


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
        the axis, and the sign of the place's distance from it; otherwise those of `swing_program`.
    wanted : tuple of int
        The variables of differentiation.
    """

    source: Source
    axes: Callable[..., Any]
    at_rest: bool
    wanted: tuple[int, ...]

    @property
    def inputs(self) -> int:
        """The number of inputs."""
        return self.source.parameters + (3 if self.at_rest else 2 + 2 * len(self.wanted))

    def widths(self, op: Recorder) -> tuple[TapeNumber, list[list[TapeNumber]]]:
        """Record half the width of an orbit, and for each wanted variable its change and those of the parameters."""
        n, count = self.source.parameters, len(self.wanted)
        p, others = op.values[:n], op.values[n:]
        moves = [[op.number(int(i == k)) for i in range(n)] for k in self.wanted]
        if not self.at_rest:
            ends = others[2:]
            changes = [(ends[count + j] - ends[j]) * Fraction(1, 2) for j in range(count)]
            return (others[1] - others[0]) * Fraction(1, 2), [[c, *m] for c, m in zip(changes, moves, strict=True)]
        lam0, number, sign = others
        place, step = self.axes(op, p)
        axis = op.number(place) if step is None else place + number * step
        changes = []
        for move, k in zip(moves, self.wanted, strict=True):
            changes.append(sign * (int(k == n) - total_change(op, gradient(op, axis, p), move)))
        return sign * (lam0 - axis), [[c, *m] for c, m in zip(changes, moves, strict=True)]


def total_change(op: Recorder, by_inputs: Sequence[TapeNumber], move: Sequence[TapeNumber]) -> TapeNumber:
    """Record the change of a number with those of its inputs, given its partial derivatives."""
    return sum((by * part for by, part in zip(by_inputs, move, strict=True)), op.number(0))


@lru_cache(maxsize=64)
def axis_program(orbits: Orbits) -> LaneProgram | None:
    """Return the program of the time of a libration about an axis per angle, differentiated at the same angle.

    A place has two coordinates: the squares of the sine and of the cosine of the angle from the axis. The results are
    the divisor of the integrand, and the derivatives. It is None if the model has no such integrand.
    """
    formula = orbits.source.formulas.time_integrand
    if formula is None:
        return None
    op = LaneRecorder(orbits.inputs, 2)
    p, (half, moves) = op.values[: orbits.source.parameters], orbits.widths(op)
    square, divisor = formula(op, half, *op.places, p)
    found = changes(op, op.sqrt(square), (half, *p), moves)
    return assemble(op, [divisor, *found], found, FROM_AXIS)


@lru_cache(maxsize=64)
def exact_axis_program(orbits: Orbits) -> Program | None:
    """Return dt/dphi and the derivatives of `axis_program` as a program in double-double arithmetic.

    The coordinate of a place is the square of the sine of half the phase angle (`programs.libration_program`).
    """
    formula = orbits.source.formulas.time_integrand
    if formula is None:
        return None
    op = Recorder(orbits.inputs)
    p, (half, moves) = op.values[: orbits.source.parameters], orbits.widths(op)
    share, tilt = op.place, 1 - 2 * op.place
    rate = op.sqrt(formula(op, half, tilt * tilt, 4 * (share * (1 - share)), p)[0])
    by_inputs = gradient(op, rate, [half, *p])
    return in_double_double(op, [rate, *(total_change(op, by_inputs, move) for move in moves)])


@lru_cache(maxsize=64)
def mean_program(orbits: Orbits) -> Program | None:
    """Return the program of the derivatives of a half period that is pi over an arithmetic-geometric mean.

    The first result is half the relative difference of the two numbers before the last step, the square of which is the
    error of the others. It is None if the model has no such mean.
    """
    formula = orbits.source.formulas.agm_arguments
    if formula is None:
        return None
    op = Recorder(orbits.inputs)
    p, (half, moves) = op.values[: orbits.source.parameters], orbits.widths(op)
    squares = [op.number(square) for square in formula(op, half, p)]
    a, b = (op.sqrt(square) for square in squares)
    difference = (a - b) / 2
    share = difference / (2 * (a + b))  # of c_1**2 in c_0**2
    rest = share
    a, b = (a + b) / 2, op.sqrt(a * b)
    for _ in range(MEAN_STEPS):
        a, b = (a + b) / 2, op.sqrt(a * b)
        shrink = difference / (4 * a)
        share, difference = 2 * (share * (shrink * shrink)), difference * shrink
        rest = rest + share
    half_period = op.pi / a
    # Minus the derivatives of the half period with respect to both squares.
    weights = [
        half_period * share / (2 * square)
        for share, square in zip((Fraction(1, 2) + rest, Fraction(1, 2) - rest), squares, strict=True)
    ]
    partials_of = [gradient(op, square, [half, *p]) for square in squares]
    found = [op.number(0)] * len(moves)
    for j, move in enumerate(moves):
        for weight, parts in zip(weights, partials_of, strict=True):
            found[j] = found[j] - weight * total_change(op, parts, move)
    return in_double_double(op, [difference / a, *found])


def changes(
    op: LaneRecorder, formula: TapeNumber, inputs: Sequence[TapeNumber], moves: Sequence[Sequence[TapeNumber]]
) -> list[TapeNumber]:
    """Return the changes of a formula at fixed coordinates of the place.

    Parameters
    ----------
    op : LaneRecorder
        The tape, to which the changes are added.
    formula : TapeNumber
        The formula.
    inputs : sequence of TapeNumber
        The inputs on which it depends.
    moves : sequence of sequences
        For each change wanted, that of each input.
    """
    found = [op.number(0)] * len(moves)
    for leaf, adjoint in leaf_adjoints(op, formula).items():
        by_inputs = gradient(op, leaf, inputs)
        for j, move in enumerate(moves):
            change = total_change(op, by_inputs, move)
            found[j] = found[j] + adjoint * change
            if change.known is None:
                op.uncertain.add(change.register)
    return found


def leaf_adjoints(op: LaneRecorder, formula: TapeNumber) -> dict[TapeNumber, TapeNumber]:
    """Return the derivatives of a formula with respect to what does not depend on the place.

    Its own changes are computed in double-double arithmetic, because parts of them may cancel.
    """
    adjoints = {formula.register: op.number(1)}
    leaves: dict[TapeNumber, TapeNumber] = {}
    for k in range(formula.register, -1, -1):
        if k not in adjoints:
            continue
        if not op.depends(k):
            leaves[op.at(k)] = adjoints[k]
            continue
        for operand, partial in partials(op, k):
            part = adjoints[k] * partial
            adjoints[operand] = adjoints[operand] + part if operand in adjoints else part
    return leaves
