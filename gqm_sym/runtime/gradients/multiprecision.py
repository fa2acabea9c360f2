"""The means of an orbit's program in mpmath, for orbits on which double-double arithmetic does not have enough
digits.
"""

from collections.abc import Iterator, Sequence
from functools import cached_property
from math import ceil, log10
from typing import Any

import numpy as np

from gqm_sym.budgets import budget
from gqm_sym.errors import SolutionError
from gqm_sym.literals.numbers import Number
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.double_double import interpreter
from gqm_sym.runtime.double_double.interpreter import ROW
from gqm_sym.runtime.double_double.nodes import LEVELS
from gqm_sym.runtime.gradients.evaluation import MAX_NEXT_CHANGE, MAX_RATIO
from gqm_sym.runtime.gradients.programs import Program, Source

# The message for an orbit without derivatives.
UNDECIDED = (
    "gradients: the motion comes too near to an equilibrium, or bends too sharply along its orbit; "
    "launch a little farther from there"
)

# The number of digits, and the factors by which it is multiplied until two precisions agree to the share AGREEMENT of
# the means of absolute values. On a small orbit V**2 loses as many digits as the square of the orbit's width, and its
# derivatives lose as many again.
DIGITS, DIGIT_FACTORS, AGREEMENT = 60, (1, 2, 4), 1e-19

# With so many nodes or more, changes must be below MAX_CHANGE; otherwise the largest number of nodes will not suffice.
NODES_BEFORE_CHECK, MAX_CHANGE = 256, 1e-2

# A number counts as zero if it vanishes to this share of the digits.
ZERO_DIGITS = 0.6

# The largest change that counts as rounding, as a share of the mean of the absolute values.
MAX_ROUNDING = 1e-30

# The number of Newton steps to the turning points, each of which doubles the digits, starting with those of doubles.
NEWTON_STEPS = 6


def executed(context: Any, program: Program, inputs: Sequence[Any], places: Sequence[Any]) -> Iterator[list[Any]]:
    """Yield the results of a program at each of some places, as numbers of an mpmath context."""
    registers: list[Any] = [None] * (program.work.size // ROW)
    for slot, value in program.constants:
        given = getattr(context, value) if isinstance(value, str) else context.mpf(value.numerator) / value.denominator
        registers[slot] = +given
    registers[: len(inputs)] = inputs
    rows = program.operations.tolist()
    _execute(context, rows[: program.first], registers)
    for place in places:
        registers[program.inputs] = place
        _execute(context, rows[program.first :], registers)
        yield [registers[output // ROW] for output in program.outputs]


def _execute(context: Any, rows: list[list[int]], registers: list[Any]) -> None:
    """Carry out operations."""
    functions = {
        interpreter.SQUARE_ROOT: context.sqrt,
        interpreter.EXPONENTIAL: context.exp,
        interpreter.LOGARITHM: context.log,
        interpreter.ARC_TANGENT: context.atan,
        interpreter.ABSOLUTE: abs,
    }
    for code, *slots in rows:
        out, left, right = (slot // ROW for slot in slots)
        if code == interpreter.ADD:
            registers[out] = registers[left] + registers[right]
        elif code == interpreter.SUBTRACT:
            registers[out] = registers[left] - registers[right]
        elif code == interpreter.MULTIPLY:
            registers[out] = registers[left] * registers[right]
        elif code == interpreter.DIVIDE:
            registers[out] = registers[left] / registers[right]
        elif code == interpreter.SINE_COSINE:
            registers[out], registers[out + 1] = context.sin(registers[left]), context.cos(registers[left])
        else:
            registers[out] = functions[code](registers[left])


class MultiprecisionOrbit:
    """An orbit with its derivatives in mpmath.

    Parameters
    ----------
    source : Source
        The formulas.
    program, turns : Program
        The program of the integrands along the orbit, and that of the Newton step to a turning point with its
        derivatives.
    numbers : sequence of Number
        The run-time parameters, the launch place and the launch speed.
    direction : int
        0 for a libration, else the sign of ds/dt.
    offsets : (float, float)
        The distances of both turning points from the launch, for a libration.
    """

    def __init__(
        self,
        source: Source,
        program: Program,
        turns: Program,
        numbers: Sequence[Number],
        direction: int,
        offsets: tuple[float, float],
    ) -> None:
        from mpmath import MPContext

        self._source, self._program, self._turns, self._numbers = source, program, turns, numbers
        self._direction, self._offsets = direction, offsets
        self._context = MPContext()

    def _inputs(self) -> list[Any]:
        """Return the inputs of the program in the precision of the context."""
        context = self._context
        variables = [*(number.at(context) for number in self._numbers), context.mpf(0)]
        lam0 = variables[self._source.parameters]
        if self._direction:
            return [*variables, lam0]
        turns, ends, rows = self._turns, [], []
        for offset in (-self._offsets[0], self._offsets[1]):
            place = lam0 + offset
            for _ in range(NEWTON_STEPS):
                ((step, *_),) = executed(context, turns, variables, [place])
                place += step
            ((_, *row),) = executed(context, turns, variables, [place])
            ends.append(place)
            rows += row
        return [*variables, *ends, *rows]

    def _values(self, inputs: Sequence[Any], n: int) -> list[list[Any]]:
        """Return the results at n midpoints."""
        shares = [(self._context.mpf(2 * k) + 1) / (2 * n) for k in range(n)]
        if not self._direction:
            shares = [self._context.sin(self._context.pi * share / 2) ** 2 for share in shares]
        return list(executed(self._context, self._program, inputs, shares))

    def _means(self, inputs: Sequence[Any]) -> tuple[list[Any], Array, int]:
        """Return the means of the results and of their absolute values, and the number of nodes; 0 if they do not
        converge.
        """
        before, last = np.inf, None
        for n in LEVELS[1:-1]:
            columns = list(zip(*self._values(inputs, n), strict=True))
            means = [sum(column) / n for column in columns]
            sizes = np.array([float(sum(map(abs, column)) / n) for column in columns])
            if last is not None:
                change = self._share_of_change(means, last, sizes)
                if change <= MAX_ROUNDING or (
                    change <= MAX_RATIO * before < np.inf and change**2 / before <= MAX_NEXT_CHANGE
                ):
                    return means, sizes, n
                if n >= NODES_BEFORE_CHECK and change > MAX_CHANGE:
                    break
                before = change
            last = means
        return [], np.empty(0), 0

    @cached_property
    def means(self) -> tuple[Array, int, list[Any]]:
        """The means as `evaluation.fill_means` gives them, the number of nodes, and the inputs."""
        return self._found()

    @budget("quadrature", 60.0, "launch a little farther from the equilibrium, or cut the curve at its narrow places")
    def _found(self) -> tuple[Array, int, list[Any]]:
        last: list[Any] | None = None
        try:
            for factor in DIGIT_FACTORS:
                self._context.dps = factor * (DIGITS + 4 * ceil(max(0.0, -log10(sum(self._offsets) or 1.0))))
                inputs = self._inputs()
                means, sizes, n = self._means(inputs)
                if n and last is not None and self._share_of_change(means, last, sizes) <= AGREEMENT:
                    means = [mean if abs(mean) > self._zero else mean * 0 for mean in means]
                    high = np.array([float(mean) for mean in means])
                    low = np.array([float(mean - value) for mean, value in zip(means, high.tolist(), strict=True)])
                    return np.stack([high, low, np.full_like(sizes, self._zero), sizes], axis=1), n, inputs
                last = means if n else None
        except (ArithmeticError, TypeError, ValueError):  # a root of a negative number, or a division by zero
            pass
        raise SolutionError(UNDECIDED)

    @property
    def _zero(self) -> float:
        """The size below which values are rounding."""
        return float(10.0 ** (-ZERO_DIGITS * self._context.dps))

    def _share_of_change(self, means: list[Any], last: list[Any], sizes: Array) -> float:
        """Return the largest change of a mean, as a share of the mean of the absolute values."""
        if len(means) != len(last):
            return np.inf
        rows = zip(means, last, sizes.tolist(), strict=True)
        return max((float(abs(a - b) / size) for a, b, size in rows if size > self._zero), default=0.0)

    @property
    def ends(self) -> Array:
        """Both turning points and, below them, their derivatives, as columns."""
        inputs, n = self.means[2], self._source.variables
        numbers = [float(value) for value in inputs[n:]]
        return np.column_stack([[numbers[k], *numbers[2 + k * n : 2 + (k + 1) * n]] for k in range(2)])

    def samples(self, n: int) -> Array:
        """Return the results at n midpoints as doubles, a row for each result."""
        return np.array([[float(value) for value in row] for row in self._values(self.means[2], n)]).T
