"""The means of an orbit's program in mpmath, for orbits on which double-double arithmetic does not have enough
digits.

They are means over equal steps of the phase angle. Near a separatrix, where these would be too many, they are integrals
over panels of it.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import cached_property, partial
from itertools import pairwise
from math import ceil, log10
from typing import Any

import numpy as np

from gqm_sym.budgets import budget, check_budget
from gqm_sym.errors import SolutionError
from gqm_sym.literals.numbers import Number
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.double_double import interpreter
from gqm_sym.runtime.double_double.interpreter import ROW
from gqm_sym.runtime.double_double.nodes import LEVELS, RULE
from gqm_sym.runtime.gradients.evaluation import MAX_NEXT_CHANGE, MAX_RATIO
from gqm_sym.runtime.gradients.panels import UNDECIDED, Panels, resolved
from gqm_sym.runtime.gradients.programs import Program, Source
from gqm_sym.runtime.quadrature.trapezoid import CIRCULATION, LIBRATION

# The codes of sums, differences, products and quotients.
ARITHMETIC = interpreter.ADD, interpreter.SUBTRACT, interpreter.MULTIPLY, interpreter.DIVIDE

# The number of digits, and the factors by which it is multiplied until two precisions agree to the share AGREEMENT of
# the means of absolute values. On a small orbit V**2 loses as many digits as the square of the orbit's width, and its
# derivatives lose as many again.
DIGITS, DIGIT_FACTORS, AGREEMENT = 60, (1, 2, 4), 1e-19

# With so many nodes or more, changes must be below MAX_CHANGE; otherwise the largest number of nodes will not suffice.
NODES_BEFORE_CHECK, MAX_CHANGE = 256, 1e-2

# On a panel the results are found to two numbers of digits at every node whose number is a multiple of this one.
CHECKED = 5

# This limits the time that the quadrature of an orbit takes.
limited = budget(
    "quadrature", 60.0, "launch a little farther from the equilibrium, or cut the curve at its narrow places"
)

# A number counts as zero if it vanishes to this share of the digits.
ZERO_DIGITS = 0.6

# The largest change that counts as rounding, as a share of the mean of the absolute values.
MAX_ROUNDING = 1e-30

# The largest number of Newton steps to a turning point. Each doubles the digits; the last one is smaller than the width
# of the orbit by this share of the digits.
NEWTON_STEPS, LAST_STEP = 16, 0.5


def executed(context: Any, program: Program, inputs: Sequence[Any], places: Sequence[Any]) -> Iterator[list[Any]]:
    """Yield the results of a program at each of some places, as numbers of an mpmath context."""
    registers: list[Any] = [None] * (program.work.size // ROW)
    for slot, value in program.constants:
        given = getattr(context, value) if isinstance(value, str) else context.mpf(value.numerator) / value.denominator
        registers[slot] = +given
    registers[: len(inputs)] = inputs
    rows, others = program.operations.copy(), _functions(context)
    rows[:, 1:] //= ROW
    operations = rows.tolist()
    before, at_places = operations[: program.first], operations[program.first :]
    _execute(context, before, others, registers)
    outputs = (program.outputs // ROW).tolist()
    for place in places:
        check_budget()
        registers[program.inputs] = place
        _execute(context, at_places, others, registers)
        yield [registers[output] for output in outputs]


def _functions(context: Any) -> dict[int, Callable[[Any], Any]]:
    """Return the functions of one number in a context, by the codes of their operations."""
    return {
        interpreter.SQUARE_ROOT: context.sqrt,
        interpreter.EXPONENTIAL: context.exp,
        interpreter.LOGARITHM: context.log,
        interpreter.ARC_TANGENT: context.atan,
        interpreter.ABSOLUTE: abs,
    }


def _execute(
    context: Any, rows: list[list[int]], functions: dict[int, Callable[[Any], Any]], registers: list[Any]
) -> None:
    """Carry out operations, each given as its code and the numbers of its registers."""
    add, subtract, multiply, divide = ARITHMETIC
    for code, out, left, right in rows:
        if code == multiply:
            registers[out] = registers[left] * registers[right]
        elif code == add:
            registers[out] = registers[left] + registers[right]
        elif code == subtract:
            registers[out] = registers[left] - registers[right]
        elif code == divide:
            registers[out] = registers[left] / registers[right]
        elif code == interpreter.SINE_COSINE:
            registers[out + 1], registers[out] = context.cos_sin(registers[left])
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
    edges : callable
        It returns the phase angles between which the speed changes smoothly, from the first to the last.
    needs_panels : bool
        Whether equal steps of the phase angle are known to be too many.
    """

    def __init__(
        self,
        source: Source,
        program: Program,
        turns: Program,
        numbers: Sequence[Number],
        direction: int,
        offsets: tuple[float, float],
        edges: Callable[[], Array],
        *,
        needs_panels: bool,
    ) -> None:
        from mpmath import MPContext

        self._source, self._program, self._turns, self._numbers = source, program, turns, numbers
        self._direction, self._offsets, self._edges, self._needs_panels = direction, offsets, edges, needs_panels
        self._context = MPContext()

    def _inputs(self) -> list[Any]:
        """Return the inputs of the program in the precision of the context."""
        context = self._context
        variables = [*(number.at(context) for number in self._numbers), context.mpf(0)]
        lam0 = variables[self._source.parameters]
        if self._direction:
            return [*variables, lam0]
        turns, ends, rows = self._turns, [], []
        smallest = sum(self._offsets) * context.mpf(10) ** (-LAST_STEP * context.dps)
        for side, offset in zip((-1, 1), self._offsets, strict=True):
            place, step = lam0 + side * offset, context.inf
            for _ in range(NEWTON_STEPS):
                ((step, *_),) = executed(context, turns, variables, [place])
                place += step
                if abs(step) <= smallest:
                    break
            ((_, *row),) = executed(context, turns, variables, [place])
            # With more energy the orbit is wider.
            if not (abs(step) <= smallest and side * row[self._source.variables - 1] > 0):
                raise ArithmeticError
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
    def means_over_steps(self) -> tuple[Array, int, list[Any]] | None:
        """The means over equal steps of the phase angle in the form of `evaluation.fill_means`, their number, and the
        inputs; None if these would be too many.
        """
        return None if self._needs_panels else self._decided(self._over_steps)

    @cached_property
    def means(self) -> tuple[Array, int, list[Any]]:
        """What `means_over_steps` is; with 0 as the number of steps if the means are found on panels."""
        return self.means_over_steps or self._decided(self._over_panels)

    @limited
    def _decided(self, find: Callable[[], Any]) -> Any:
        try:
            return find()
        except (ArithmeticError, TypeError, ValueError):  # a root of a negative number, or a division by zero
            raise SolutionError(UNDECIDED) from None

    def _over_steps(self) -> tuple[Array, int, list[Any]] | None:
        last: list[Any] | None = None
        for factor in DIGIT_FACTORS:
            inputs = self._inputs_of(factor)
            means, sizes, n = self._means(inputs)
            if not n:
                break
            if last is not None and self._share_of_change(means, last, sizes) <= AGREEMENT:
                means = [mean if abs(mean) > self._zero else mean * 0 for mean in means]
                return self._as_doubles(means, sizes, self._zero), n, inputs
            last = means
        return None

    def _over_panels(self) -> tuple[Array, int, list[Any]]:
        panels, inputs = self.panels(everywhere=False)
        whole = 1 if self._direction else self._context.pi
        means = [self._context.mpf(integral) / whole for integral in panels.integrals.tolist()]
        return self._as_doubles(means, np.abs(panels.integrals) / float(whole), 0.0), 0, inputs

    def _inputs_of(self, factor: int) -> list[Any]:
        """Set this multiple of the number of digits, and return the inputs of the program."""
        self._context.dps = factor * (DIGITS + 4 * ceil(max(0.0, -log10(sum(self._offsets) or 1.0))))
        return self._inputs()

    def _as_doubles(self, means: Sequence[Any], sizes: Array, error: float) -> Array:
        """Return means in the form of `evaluation.fill_means`."""
        high = np.array([float(mean) for mean in means])
        low = np.array([float(mean - value) for mean, value in zip(means, high.tolist(), strict=True)])
        return np.stack([high, low, np.full_like(sizes, error), sizes], axis=1)

    @limited
    def panels(self, *, everywhere: bool) -> tuple[Panels, list[Any]]:
        """Return the results on panels of the phase that resolve them (`panels.resolved`), and the inputs."""
        kind, wanted = CIRCULATION if self._direction else LIBRATION, np.arange(self._program.outputs.size)
        for factors in pairwise(DIGIT_FACTORS):
            both = [(self._inputs_of(factor), self._context.dps) for factor in factors]
            with suppress(SolutionError):
                found = resolved(kind, self._edges(), partial(self._on_nodes, both), wanted, everywhere=everywhere)
                return found, both[-1][0]
        raise SolutionError(UNDECIDED)

    def _on_nodes(self, both: Sequence[tuple[list[Any], int]], shares: Array) -> Array:
        """Return results in the form of `evaluation.values`.

        Parameters
        ----------
        both : two pairs
            The inputs of the program to two numbers of digits, and these. The error of the results on a panel is the
            largest difference between both at some of its nodes.
        shares : (2, n) array
            The shares of the orbit's width, as two doubles each.
        """
        context, found = self._context, np.empty((self._program.outputs.size, 3, shares.shape[1]))
        places = [context.mpf(high) + context.mpf(low) for high, low in shares.T.tolist()]
        checked = [k for k in range(len(places)) if k % RULE % CHECKED == 0]
        rough_inputs, context.dps = both[0]
        rough = [*executed(context, self._program, rough_inputs, [places[k] for k in checked])]
        inputs, context.dps = both[1]
        exact = [*executed(context, self._program, inputs, places)]
        for k, row in enumerate(exact):
            high = [float(value) for value in row]
            found[:, 0, k], found[:, 1, k] = high, [float(value - h) for value, h in zip(row, high, strict=True)]
        pairs = zip(rough, [exact[k] for k in checked], strict=True)
        errors = np.array([[float(abs(a - b)) for a, b in zip(*rows, strict=True)] for rows in pairs]).T
        of_panels = errors.reshape(len(errors), shares.shape[1] // RULE, -1).max(axis=2)
        found[:, 2] = np.repeat(of_panels, RULE, axis=1)
        return found

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
