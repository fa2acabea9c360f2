"""Numbers that record the operations on them: called with these, a formula becomes a tape for the interpreter."""

from collections.abc import Callable, Sequence
from fractions import Fraction
from itertools import accumulate, chain
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gqm_sym.runtime.arithmetic.elementary import HALF_PI
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.double_double import interpreter
from gqm_sym.runtime.double_double.arithmetic import UNIT, split
from gqm_sym.runtime.double_double.interpreter import ERROR, LOW, ROW

# pi and e as two doubles each.
PI, E = (2.0 * HALF_PI[0], 2.0 * HALF_PI[1]), (2.718281828459045, 1.4456468917292502e-16)

# In place of a register that does not exist.
NOWHERE = -1

# A tape with more registers is not used: its work space would not fit into the processor's caches.
MAX_REGISTERS = 1000


class Tape(NamedTuple):
    """The formulas of one module as operations.

    Attributes
    ----------
    operations : (m, 4) array of int
        The operations that `interpreter.evaluate` carries out: first those that do not depend on the place, then those
        for the effective potential and ds/dlam, then those for the potential's slope alone.
    parts : tuple of int
        The ends of these three parts.
    registers : tuple of int
        The positions in the work space of the registers of the first run-time parameter, the place, the effective
        potential U, ds/dlam, dU/dlam, and the period of the curve's parameter (negative if there is none). For a
        function of coordinates (`tapes.record_by_coordinates`): the first run-time parameter, x (z and y follow), the
        function, and its derivatives with respect to x, z and y (negative in a plane).
    """

    operations: NDArray[np.int64]
    parts: tuple[int, int, int]
    registers: tuple[int, int, int, int, int, int]


class BoundTape(NamedTuple):
    """A tape with its work space and the values of the run-time parameters.

    Attributes
    ----------
    tape : Tape
        The operations.
    work : array
        The registers, of which those of constants are filled. Compiled code changes the others; no other thread runs at
        the same time.
    parameters : (2, n) array
        The run-time parameters as two doubles each.
    """

    tape: Tape
    work: Array
    parameters: Array

    @property
    def operands(self) -> tuple[Any, ...]:
        """Return the arguments of compiled code: interpreter and tape, the work space, the parameters."""
        return (interpreter.INTERPRETER.address, *self.tape), self.work, self.parameters


Recorded = tuple[Tape, Array]
"""The type of a tape together with registers that contain its constants."""


class TapeNumber:
    """A number in a formula that is being recorded: a rational number, or the register that will contain it."""

    __slots__ = ("_tape", "known", "register")

    def __init__(self, tape: "_Recorder", register: int = -1, known: Fraction | None = None) -> None:
        self._tape, self.register, self.known = tape, register, known

    def _with(self, code: int, other: Any, *, turned: bool = False) -> "TapeNumber":
        other = self._tape.number(other)
        a, b = (other, self) if turned else (self, other)
        if a.known is not None and b.known is not None and not (code == interpreter.DIVIDE and b.known == 0):
            exact: dict[int, Callable[[Any], Any]] = {
                interpreter.ADD: a.known.__add__,
                interpreter.SUBTRACT: a.known.__sub__,
                interpreter.MULTIPLY: a.known.__mul__,
                interpreter.DIVIDE: a.known.__truediv__,
            }
            return self._tape.number(exact[code](b.known))
        return self._tape.result(code, a, b)

    def __add__(self, other: Any) -> "TapeNumber":
        return self._with(interpreter.ADD, other)

    def __sub__(self, other: Any) -> "TapeNumber":
        return self._with(interpreter.SUBTRACT, other)

    def __rsub__(self, other: Any) -> "TapeNumber":
        return self._with(interpreter.SUBTRACT, other, turned=True)

    def __mul__(self, other: Any) -> "TapeNumber":
        return self._with(interpreter.MULTIPLY, other)

    def __truediv__(self, other: Any) -> "TapeNumber":
        return self._with(interpreter.DIVIDE, other)

    def __rtruediv__(self, other: Any) -> "TapeNumber":
        return self._with(interpreter.DIVIDE, other, turned=True)

    __radd__, __rmul__ = __add__, __mul__

    def __neg__(self) -> "TapeNumber":
        return -1 * self

    def __abs__(self) -> "TapeNumber":
        return self._tape.result(interpreter.ABSOLUTE, self)

    def __pow__(self, other: Any) -> "TapeNumber":
        exponent = self._tape.number(other)
        if exponent.known is None:
            self._tape.exponents |= self._tape.parameters_of(exponent.register)
        if exponent.known is None or exponent.known.denominator > 2:
            return self._tape.exp(exponent * self._tape.log(self))
        base = self if exponent.known.denominator == 1 else self._tape.sqrt(self)
        power = base.to(abs(exponent.known.numerator))
        return 1 / power if exponent.known < 0 else power

    def __rpow__(self, other: Any) -> "TapeNumber":
        return self._tape.number(other) ** self

    def to(self, count: int) -> "TapeNumber":
        """Return the power with a positive integer exponent, as a product of so many factors."""
        if count < 2:
            return self if count else self._tape.number(1)
        half = self.to(count // 2)
        return half * half * self if count % 2 else half * half


def scalar_product(a: Sequence[TapeNumber], b: Sequence[TapeNumber]) -> TapeNumber:
    """Return the scalar product of two vectors."""
    total = a[0] * b[0]
    for one, other in zip(a[1:], b[1:], strict=True):
        total = total + one * other
    return total


class _Recorder:
    """The namespace of operations with which formulas are recorded. Its functions have the names that mpmath uses.

    Parameters
    ----------
    parameters, coordinates : int
        The numbers of run-time parameters and of coordinates of a place.
    known : sequence of (int, Fraction)
        Run-time parameters whose values belong to the formulas.

    Attributes
    ----------
    exponents : set of int
        The run-time parameters on which exponents depend.
    """

    def __init__(self, parameters: int, coordinates: int = 1, known: Sequence[tuple[int, Fraction]] = ()) -> None:
        self.exponents: set[int] = set()
        # Each entry is an operation and the registers of its operands. The entry of a constant has its doubles.
        self.entries: list[tuple[Any, ...]] = [
            *(("parameter", k) for k in range(parameters)),
            *(("place", k) for k in range(coordinates)),
        ]
        self._known: dict[tuple[Any, ...], int] = {entry: k for k, entry in enumerate(self.entries)}
        given = dict(known)
        self.values = tuple(
            TapeNumber(self, known=given[k]) if k in given else TapeNumber(self, k) for k in range(parameters)
        )
        self.places = tuple(TapeNumber(self, parameters + k) for k in range(coordinates))
        self.place = self.places[0]
        self.pi, self.e = self._constant(PI), self._constant(E)

    def _entry(self, *entry: Any) -> int:
        if entry not in self._known:
            self._known[entry] = len(self.entries)
            self.entries.append(entry)
            if entry[0] == interpreter.SINE_COSINE:
                self.entries.append(("cosine", entry[1]))
        return self._known[entry]

    def _constant(self, pair: tuple[float, float]) -> TapeNumber:
        return TapeNumber(self, self._entry("constant", *pair))

    def number(self, value: Any) -> TapeNumber:
        """Return an operand as a number of this tape."""
        return value if isinstance(value, TapeNumber) else TapeNumber(self, known=Fraction(value))

    mpf = number

    def register(self, value: Any) -> int:
        """Return the register of an operand."""
        number = self.number(value)
        return number.register if number.known is None else self._entry("constant", *split(number.known))

    def result(self, code: int, *operands: TapeNumber) -> TapeNumber:
        """Record an operation, unless it has been recorded before, and return its result."""
        return TapeNumber(self, self._entry(code, *map(self.register, operands)))

    def sqrt(self, x: Any) -> TapeNumber:
        return self.result(interpreter.SQUARE_ROOT, self.number(x))

    def exp(self, x: Any) -> TapeNumber:
        return self.result(interpreter.EXPONENTIAL, self.number(x))

    def log(self, x: Any) -> TapeNumber:
        return self.result(interpreter.LOGARITHM, self.number(x))

    def sin(self, x: Any) -> TapeNumber:
        return self.result(interpreter.SINE_COSINE, self.number(x))

    def cos(self, x: Any) -> TapeNumber:
        return TapeNumber(self, self.sin(x).register + 1)

    def tan(self, x: Any) -> TapeNumber:
        return self.sin(x) / self.cos(x)

    def atan(self, x: Any) -> TapeNumber:
        return self.result(interpreter.ARC_TANGENT, self.number(x))

    def asin(self, x: Any) -> TapeNumber:
        return self.atan(x / self.sqrt(1 - x * x))

    def acos(self, x: Any) -> TapeNumber:
        return self.pi / 2 - self.asin(x)

    def cosh(self, x: Any) -> TapeNumber:
        return (self.exp(x) + 1 / self.exp(x)) / 2

    def sinh(self, x: Any) -> TapeNumber:
        return (self.exp(x) - 1 / self.exp(x)) / 2

    def tanh(self, x: Any) -> TapeNumber:
        return self.sinh(x) / self.cosh(x)

    def asinh(self, x: Any) -> TapeNumber:
        return self.log(x + self.sqrt(x * x + 1))

    def acosh(self, x: Any) -> TapeNumber:
        return self.log(x + self.sqrt(x * x - 1))

    def atanh(self, x: Any) -> TapeNumber:
        return self.log((1 + x) / (1 - x)) / 2

    def depend_on_place(self) -> list[bool]:
        """Return, for each entry, whether it depends on the place."""
        depends: list[bool] = []
        for code, *operands in self.entries:
            is_operation = not isinstance(code, str) or code == "cosine"
            depends.append(any(depends[k] for k in operands) if is_operation else code == "place")
        return depends

    def parameters_of(self, register: int) -> set[int]:
        """Return the run-time parameters on which a register depends."""
        entries = [self.entries[k] for k in self.needed_by([register])]
        return {entry[1] for entry in entries if entry[0] == "parameter"}

    def needed_by(self, registers: Sequence[int]) -> set[int]:
        """Return the given registers and all entries that they are computed from."""
        needed, pending = set[int](), list(registers)
        while pending:
            k = pending.pop()
            if k in needed:
                continue
            needed.add(k)
            code, *operands = self.entries[k]
            if code == "cosine":
                pending.append(k - 1)  # a cosine is computed together with the sine before it
            elif not isinstance(code, str):
                pending.extend(operands)
        return needed

    def finished(self, values: Sequence[int], others: Sequence[int], period: int = NOWHERE) -> Recorded | None:
        """Return the tape and registers with its constants; None if it is too long.

        Parameters
        ----------
        values, others : sequences of int
            Registers of the values that are needed at each place, and of those that are needed at few places only.
        period : int
            The register of the period, if there is one.
        """
        if len(self.entries) > MAX_REGISTERS:
            return None
        depends, needed = self.depend_on_place(), self.needed_by(values)
        operations = [k for k, entry in enumerate(self.entries) if not isinstance(entry[0], str)]
        groups = (
            [k for k in operations if not depends[k]],
            [k for k in operations if depends[k] and k in needed],
            [k for k in operations if depends[k] and k not in needed],
        )
        codes = np.zeros((len(operations), 4), dtype=np.int64)
        for row, k in zip(codes, chain(*groups), strict=True):
            code, *operands = self.entries[k]
            row[: 2 + len(operands)] = code, ROW * k, *(ROW * operand for operand in operands)
        work = np.zeros(ROW * len(self.entries))
        for k, (code, *pair) in enumerate(self.entries):
            if code == "constant":
                register = work[ROW * k : ROW * (k + 1)]
                register[:LOW], register[LOW:ERROR], register[ERROR:] = (
                    *pair,
                    0.25 * UNIT * abs(pair[0]) if pair[1] else 0.0,
                )
        first, second, third = accumulate(len(group) for group in groups)
        found = [ROW * register for register in (*values, *others, period)]
        return Tape(codes, (first, second, third), (0, ROW * len(self.values), *found)), work  # type: ignore[arg-type]


class Recorder(_Recorder):
    """A tape that is being recorded, whose entries may be read to record more of them.

    Attributes
    ----------
    exact : dict
        For the register of each constant, its value or its name.
    """

    def __init__(self, parameters: int, coordinates: int = 1, known: Sequence[tuple[int, Fraction]] = ()) -> None:
        super().__init__(parameters, coordinates, known)
        self.exact: dict[int, Fraction | str] = {self.pi.register: "pi", self.e.register: "e"}

    def register(self, value: Any) -> int:
        """Return the register of an operand."""
        number, register = self.number(value), super().register(value)
        if number.known is not None:
            self.exact[register] = number.known
        return register

    def at(self, register: int) -> TapeNumber:
        """Return the number that a register will contain."""
        return TapeNumber(self, register)
