"""Tapes for double precision as programs: operations with registers, of which as few as possible are in use.

What does not depend on the place is computed once for each orbit in double-double arithmetic, because its roundings
would be common to all nodes. What depends on the place is computed in doubles, whose roundings average out.
"""

from collections import defaultdict
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.double_double import interpreter
from gqm_sym.runtime.double_double.interpreter import BLOCK, ERROR, INTERPRETER, LOW, ROW
from gqm_sym.runtime.double_double.recording import TapeNumber
from gqm_sym.runtime.gradients.lanes import rounding
from gqm_sym.runtime.gradients.lanes.interpreter import (
    FROM_PAIR,
    LANES_INTERPRETER,
    MINUS_PAIR,
    PAIR_MINUS,
    PAIR_OVER,
    PLUS_PAIR,
    SCALE,
    TIMES_PAIR,
)
from gqm_sym.runtime.gradients.lanes.operations import ERROR_BOUND, RESULTS, WAVE_DIFFERENCES, LaneRecorder
from gqm_sym.runtime.gradients.lanes.scaling import Terms, combined

Codes = NDArray[np.int64]

# The places of a program that is evaluated at none of its own.
NOWHERE: Array = np.zeros((2, 0))

# The operations with two operands of which only the left or only the right one depends on the place.
WITH_PAIR: dict[int, tuple[int, int]] = {
    interpreter.ADD: (PLUS_PAIR, PLUS_PAIR),
    interpreter.SUBTRACT: (MINUS_PAIR, PAIR_MINUS),
    interpreter.MULTIPLY: (TIMES_PAIR, TIMES_PAIR),
    interpreter.DIVIDE: (PAIR_OVER, PAIR_OVER),  # a pair in the denominator is a factor instead
    WAVE_DIFFERENCES: (WAVE_DIFFERENCES, WAVE_DIFFERENCES),
}


class LaneProgram(NamedTuple):
    """Formulas as operations, with their work space.

    Attributes
    ----------
    before : (m, 4) array of int
        The operations in double-double arithmetic, which do not depend on the place.
    nodes, noise : (m, 4) arrays of int
        The operations in doubles for the results, and for the variances of their rounding errors.
    coordinates, outputs, variances : arrays of int
        The positions in the work space of the coordinates of a place, the results, and the variances.
    places : (k, n) array
        The coordinates of the nodes of the trapezoidal rule.
    work : array
        The registers, of which those of constants are filled. The inputs come first.
    """

    before: Codes
    nodes: Codes
    noise: Codes
    coordinates: Codes
    outputs: Codes
    variances: Codes
    places: Array
    work: Array

    @property
    def operands(self) -> tuple[Any, ...]:
        """The arguments of compiled code, beginning with the addresses of the interpreters of all operations."""
        return (INTERPRETER.address, LANES_INTERPRETER.address, LANES_INTERPRETER.address), *self[:-1]


def assemble_rates(
    op: LaneRecorder, factor: TapeNumber, rates: Sequence[TapeNumber], terms: Sequence[Terms], places: Array
) -> LaneProgram:
    """Return the program of a factor and of sums of products, and of the variances of the latter.

    Parameters
    ----------
    op : LaneRecorder
        The tape.
    factor : TapeNumber
        The first result.
    rates : sequence of TapeNumber
        The numbers that the products contain.
    terms : sequence of Terms
        The products.
    places : (k, n) array
        The coordinates of the nodes.
    """
    results = [factor, *combined(op, terms, rates)]
    return assemble(op, results, rounding.variances(op, rates, terms), places)


def assemble(
    op: LaneRecorder, results: Sequence[Any], variances: Sequence[TapeNumber] = (), places: Array = NOWHERE
) -> LaneProgram:
    """Return the program of results, and of the ``variances`` of some of them, for nodes at ``places``."""
    outputs, noise = ([op.register(result) for result in some] for some in (results, variances))
    live = _live(op, outputs) | _live(op, noise)
    pairs = [k for k in sorted(live | set(range(len(op.values)))) if not op.depends(k)]
    slots = {k: ROW * slot for slot, k in enumerate(pairs)}
    before = [k for k in pairs if not isinstance(op.entries[k][0], str)]
    codes = np.zeros((len(before), 4), dtype=np.int64)
    for row, k in zip(codes, before, strict=True):
        code, *operands = op.entries[k]
        row[: 2 + len(operands)] = code, slots[k], *(slots[operand] for operand in operands)
    first = ROW * len(slots)
    coordinates = {place.register: first + BLOCK * k for k, place in enumerate(op.places)}
    first += BLOCK * len(coordinates)
    exact, rounded = (_Lanes(op, slots, coordinates, first, wanted) for wanted in (outputs, noise))
    work = np.zeros(max(exact.size, rounded.size) + ROW)
    for k, slot in slots.items():
        code, *pair = op.entries[k]
        if code == "constant":
            work[slot : slot + LOW], work[slot + LOW : slot + ERROR] = pair
    positions = np.array(list(coordinates.values()), dtype=np.int64)
    return LaneProgram(codes, exact.codes, rounded.codes, positions, exact.outputs, rounded.outputs, places, work)


def _live(op: LaneRecorder, wanted: Sequence[int]) -> set[int]:
    """Return the registers from which the wanted ones are computed, including all results of each operation."""
    live, pending = set[int](), list(wanted)
    while pending:
        base, _ = op.base(pending.pop())
        if base in live:
            continue
        code, *operands = op.entries[base]
        live.update(range(base, base + RESULTS.get(code, 1)))
        if not isinstance(code, str):
            pending += operands
    return live


class _Lanes:
    """The operations in doubles for some results, with their registers.

    Parameters
    ----------
    op : LaneRecorder
        The tape.
    slots, coordinates : dict
        The positions of the registers that do not depend on the place, and of the coordinates.
    first : int
        The position from which on registers may be used.
    wanted : sequence of int
        The registers of the results.
    """

    def __init__(
        self, op: LaneRecorder, slots: dict[int, int], coordinates: dict[int, int], first: int, wanted: Sequence[int]
    ) -> None:
        self.op, self.slots, self.size = op, slots, first
        self.at, self._free = dict(coordinates), defaultdict[int, list[int]](list)
        order = [k for k in sorted(_live(op, wanted)) if op.depends(k) and not isinstance(op.entries[k][0], str)]
        last_use = self._last_uses(order, wanted)
        rows = []
        for k in order:
            code, *operands = op.entries[k]
            count = RESULTS.get(code, 1)
            position = self._taken(count)
            self.at.update({k + i: position + BLOCK * i for i in range(count)})
            rows.append(self._operation(k, code, operands))
            for base in {op.base(operand)[0] for operand in operands} | {k}:
                if last_use.get(base, -1) == k and base in self.at and base not in coordinates:
                    self._free[RESULTS.get(op.entries[base][0], 1)].append(self.at[base])
        found = []
        for k in wanted:
            if not op.depends(k):
                position = self._taken(1)
                rows.append([FROM_PAIR, position, position, slots[k]])
                found.append(position)
            else:
                found.append(self.at[k])
        self.codes = np.array(rows, dtype=np.int64).reshape(-1, 4)
        self.outputs = np.array(found, dtype=np.int64)

    def _last_uses(self, order: Sequence[int], wanted: Sequence[int]) -> dict[int, int]:
        """Return the operation after which the registers of each operation are free; those of results never are."""
        last = {k: k for k in order}
        for k in order:
            for operand in self.op.entries[k][1:]:
                last[self.op.base(operand)[0]] = k
        return last | {self.op.base(k)[0]: -1 for k in wanted}

    def _taken(self, count: int) -> int:
        """Return the position of so many registers that are free."""
        if self._free[count]:
            return self._free[count].pop()
        position, self.size = self.size, self.size + BLOCK * count
        return position

    def _operation(self, k: int, code: int, operands: Sequence[int]) -> list[int]:
        """Return an operation with the positions of its registers."""
        if code == ERROR_BOUND:
            return [code, self.at[k], *[self.slots[operands[0]]] * 2]
        out, on_places = self.at[k], [self.op.depends(operand) for operand in operands]
        if all(on_places):
            where = [self.at[operand] for operand in operands]
            return [code, out, *where, *where[-1:] * (2 - len(where))]
        node, pair = operands if on_places[0] else operands[::-1]
        kind = WITH_PAIR[code][0 if on_places[0] else 1]
        if kind == TIMES_PAIR and self.op.entries[pair][0] == "constant" and self.op.entries[pair][2] == 0.0:
            kind = SCALE
        return [kind, out, self.at[node], self.slots[pair]]
