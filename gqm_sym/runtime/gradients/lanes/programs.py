"""The programs of gradients in double precision: the derivatives of half periods, without cancellation.

Between turning points ``V**2 = 2 (lam - a) (b - lam) Q`` with the divided difference ``Q = U[a, lam, b]`` of the
potential, so that the time per phase angle is ``ds/dlam / sqrt(2 Q)``. Its derivatives at the same phase angle follow
by differentiating the formula of Q, in which nothing cancels.
"""

from collections.abc import Sequence
from functools import lru_cache

from gqm_sym.runtime.double_double.recording import Recorder, TapeNumber
from gqm_sym.runtime.gradients.adjoints import gradient, partials
from gqm_sym.runtime.gradients.lanes.assembly import LaneProgram, assemble
from gqm_sym.runtime.gradients.lanes.differences import Places, WithoutRuleError
from gqm_sym.runtime.gradients.lanes.operations import LaneRecorder
from gqm_sym.runtime.gradients.programs import Program, Source
from gqm_sym.runtime.gradients.programs import assemble as in_double_double


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
    over = Places(op, (a, b))
    try:
        factor, ds = over.of(source.formulas.effective_potential, p).second, over.of(source.formulas.ds, p).at[1]
    except WithoutRuleError:
        return None
    rate = ds / op.sqrt(2 * factor)
    moved = [(moves[j], moves[count + j], *(op.number(int(i == k)) for i in range(n))) for j, k in enumerate(wanted)]
    found = changes(op, rate, (a, b, *p), moved)
    return assemble(op, [factor, *found], found)


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
            change = sum((by * part for by, part in zip(by_inputs, move, strict=True)), op.number(0))
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
