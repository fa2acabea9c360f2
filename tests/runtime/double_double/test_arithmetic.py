"""Each operation of double-double arithmetic agrees with mpmath within the bound on its error."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

from gqm_sym.runtime.double_double import interpreter
from gqm_sym.runtime.double_double.arithmetic import UNIT
from gqm_sym.runtime.double_double.interpreter import BLOCK, ERROR, LOW, ROW

DIGITS = 60
# The registers: two operands, and the result.
A, B, OUT, OTHER = range(4)

# A row has an operation, its exact form, the ranges of its operands, and the limit of the error in units of 2**-104 of
# the result, or of one if the result may be much smaller than its terms.
Case = tuple[int, Callable[..., Any], tuple[tuple[float, float], ...], float, bool]
WIDE, POSITIVE = (-1e6, 1e6), (1e-6, 1e6)
CASES: dict[str, Case] = {
    "add": (interpreter.ADD, lambda a, b: a + b, (WIDE, WIDE), 1.0, False),
    "subtract": (interpreter.SUBTRACT, lambda a, b: a - b, ((1.0, 1.0 + 1e-9), (1.0, 1.0 + 1e-9)), 1.0, False),
    "multiply": (interpreter.MULTIPLY, lambda a, b: a * b, (WIDE, WIDE), 1.0, False),
    "divide": (interpreter.DIVIDE, lambda a, b: a / b, (WIDE, POSITIVE), 2.0, False),
    "square root": (interpreter.SQUARE_ROOT, mp.sqrt, (POSITIVE,), 1.0, False),
    "sine": (interpreter.SINE_COSINE, mp.sin, ((-20.0, 20.0),), 1.0, True),
    "sine of large angles": (interpreter.SINE_COSINE, mp.sin, ((-1e5, 1e5),), 1.0, True),
    "exponential": (interpreter.EXPONENTIAL, mp.exp, ((-600.0, 600.0),), 2.0, False),
    "logarithm": (interpreter.LOGARITHM, mp.log, ((1e-6, 20.0),), 2.0, True),
    "arc tangent": (interpreter.ARC_TANGENT, mp.atan, ((-30.0, 30.0),), 2.0, True),
    "absolute value": (interpreter.ABSOLUTE, abs, (WIDE,), 0.5, False),
}


def carry_out(operation: int, work: np.ndarray) -> None:
    """Carry out one operation on the registers A and B."""
    tape = np.array([[operation, ROW * OUT, ROW * A, ROW * B]], dtype=np.int64)
    run = interpreter.INTERPRETER.call
    run(tape.ctypes.data, 0, 1, work.ctypes.data, BLOCK)


def fill(work: np.ndarray, register: int, values: np.ndarray, lows: np.ndarray, errors: np.ndarray) -> None:
    """Fill a register."""
    row = work[ROW * register : ROW * (register + 1)]
    row[:LOW], row[LOW:ERROR], row[ERROR:] = values, lows, errors


def number(work: np.ndarray, register: int, i: int) -> mpf:
    """Return the exact value of a number in a register."""
    return mpf(float(work[ROW * register + i])) + mpf(float(work[ROW * register + LOW + i]))


def spread(rng: np.random.Generator, low: float, high: float) -> np.ndarray:
    """Return numbers of all sizes in a range."""
    if low > 0.0:
        return np.exp(rng.uniform(np.log(low), np.log(high), BLOCK))
    return rng.uniform(low, high, BLOCK) * 10.0 ** rng.uniform(-6.0, 0.0, BLOCK)


@pytest.mark.parametrize("name", CASES)
def test_operations_keep_their_digits(name: str) -> None:
    """The error is within its limit and within the bound, for some thousand arguments."""
    operation, exact, ranges, limit, is_absolute = CASES[name]
    rng, work = np.random.default_rng(len(name)), np.zeros(4 * ROW)
    with mp.workdps(DIGITS):
        for _ in range(30):
            for register, ends in enumerate(ranges):
                values = spread(rng, *ends)
                fill(work, register, values, 0.5 * np.spacing(values) * rng.uniform(-1.0, 1.0, BLOCK), np.zeros(BLOCK))
            carry_out(operation, work)
            for i in range(BLOCK):
                wanted = exact(*(number(work, register, i) for register in range(len(ranges))))
                error = abs(number(work, OUT, i) - wanted)
                size = max(mpf(1), abs(wanted)) if is_absolute else abs(wanted)
                assert error <= limit * UNIT * size
                assert error <= work[ROW * OUT + ERROR + i] * (1 + 1e-9) + mpf(UNIT) ** 2


def test_a_cosine_comes_with_each_sine() -> None:
    """The cosine is in the register after the sine, and their squares add up to one."""
    work = np.zeros(4 * ROW)
    fill(work, A, np.linspace(-9.0, 9.0, BLOCK), np.zeros(BLOCK), np.zeros(BLOCK))
    carry_out(interpreter.SINE_COSINE, work)
    with mp.workdps(DIGITS):
        for i in range(BLOCK):
            assert abs(number(work, OTHER, i) - mp.cos(number(work, A, i))) <= UNIT
            assert abs(number(work, OUT, i) ** 2 + number(work, OTHER, i) ** 2 - 1) <= 4 * UNIT


@pytest.mark.parametrize("name", CASES)
def test_errors_of_operands_are_passed_on(name: str) -> None:
    """If operands have errors, the exact result differs by no more than the bound."""
    operation, exact, ranges, _, _ = CASES[name]
    rng, work = np.random.default_rng(3), np.zeros(4 * ROW)
    for register, ends in enumerate(ranges):
        values = spread(rng, *ends)
        fill(work, register, values, np.zeros(BLOCK), 1e-20 * np.abs(values))
    carry_out(operation, work)
    with mp.workdps(DIGITS):
        for i in range(BLOCK):
            operands = [number(work, register, i) for register in range(len(ranges))]
            bound = work[ROW * OUT + ERROR + i]
            for signs in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
                moved = [x * (1 + sign * mpf("1e-20")) for x, sign in zip(operands, signs, strict=False)]
                assert abs(exact(*moved) - exact(*operands)) <= bound * (1 + 1e-9)
                largest = abs(exact(*moved) - exact(*operands))
            assert bound <= 4 * largest + 1e-19 * max(1.0, abs(work[ROW * OUT + i]))


@pytest.mark.parametrize(
    ("operation", "argument"),
    [
        (interpreter.SQUARE_ROOT, -1.0),
        (interpreter.LOGARITHM, -1.0),
        (interpreter.EXPONENTIAL, 800.0),
        (interpreter.EXPONENTIAL, -800.0),
        (interpreter.DIVIDE, 1.0),
    ],
)
def test_what_has_no_digits_is_not_a_number(operation: int, argument: float) -> None:
    """A root or a logarithm of a negative number, a quotient by zero and an exponential beyond doubles are NaN."""
    work = np.zeros(4 * ROW)
    fill(work, A, np.full(BLOCK, argument), np.zeros(BLOCK), np.zeros(BLOCK))
    carry_out(operation, work)
    assert not np.isfinite(work[ROW * OUT + LOW : ROW * OUT + ERROR]).any()
