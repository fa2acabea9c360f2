"""The derivatives of a formula on a tape, recorded as formulas on the same tape (reverse differentiation).

The adjoint of an operation is the derivative of the formula with respect to the operation's result. Each operation
passes its adjoint, times its partial derivatives, to its operands. So all first derivatives of a formula together take
a few times as many operations as the formula itself, however many they are.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from typing import Any

from gqm_sym.runtime.double_double import interpreter
from gqm_sym.runtime.double_double.recording import Recorder, TapeNumber


class RecorderOfMore(Recorder, ABC):
    """A tape with operations that `Recorder` does not have."""

    @abstractmethod
    def is_other(self, register: int) -> bool:
        """Return whether a register is filled by one of these operations."""

    @abstractmethod
    def other_partials(self, register: int) -> Iterator[tuple[int, TapeNumber]]:
        """Yield the operands of such an operation, each with the result's partial derivative by it."""


def gradient(op: Recorder, formula: Any, variables: Sequence[TapeNumber]) -> list[TapeNumber]:
    """Return the derivatives of a formula with respect to numbers of its tape, each for fixed values of the others.

    Parameters
    ----------
    op : Recorder
        The tape, to which the derivatives are added.
    formula : TapeNumber
        The formula.
    variables : sequence of TapeNumber
        The variables of differentiation. One of them may be computed from others.
    """
    result, ends = op.number(formula), {variable.register for variable in variables}
    adjoints: dict[int, TapeNumber] = {}
    if result.known is None:
        adjoints[result.register] = op.number(1)
    for k in range(result.register, -1, -1):
        if k in adjoints and k not in ends:
            for operand, partial in partials(op, k):
                part = _times(adjoints[k], partial)
                adjoints[operand] = adjoints[operand] + part if operand in adjoints else part
    return [adjoints.get(variable.register, op.number(0)) for variable in variables]


def _times(a: TapeNumber, b: TapeNumber) -> TapeNumber:
    """Return the product; a factor of 1 takes no operation."""
    if a.known == 1:
        return b
    return a if b.known == 1 else a * b


def partials(op: Recorder, k: int) -> Iterator[tuple[int, TapeNumber]]:
    """Yield the operands of an entry of a tape, as registers, each with the entry's partial derivative by it."""
    code, *operands = op.entries[k]
    if code in ("parameter", "place", "constant"):
        return
    if isinstance(op, RecorderOfMore) and op.is_other(k):
        yield from op.other_partials(k)
        return
    out, (a, *others) = op.at(k), (op.at(operand) for operand in operands)
    if code == "cosine":
        yield operands[0], -op.at(k - 1)
    elif code in (interpreter.ADD, interpreter.SUBTRACT):
        yield operands[0], op.number(1)
        yield operands[1], op.number(1 if code == interpreter.ADD else -1)
    elif code == interpreter.MULTIPLY:
        yield operands[0], others[0]
        yield operands[1], a
    elif code == interpreter.DIVIDE:
        yield operands[0], 1 / others[0]
        yield operands[1], -(out / others[0])
    else:
        yield operands[0], _slope(op, code, a, out, k)


def _slope(op: Recorder, code: int, a: TapeNumber, out: TapeNumber, k: int) -> TapeNumber:
    """Return the derivative of a function of one number ``a``, whose value is ``out`` and is in register ``k``."""
    if code == interpreter.SQUARE_ROOT:
        return 1 / (2 * out)
    if code == interpreter.SINE_COSINE:
        return op.at(k + 1)
    if code == interpreter.EXPONENTIAL:
        return out
    if code == interpreter.LOGARITHM:
        return 1 / a
    if code == interpreter.ARC_TANGENT:
        return 1 / (1 + a * a)
    return a / out  # of the absolute value
