"""Tapes of formulas have the values of the formulas themselves in mpmath, at many places."""

from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

from gqm_sym.literals.numbers import read_number
from gqm_sym.runtime.double_double import interpreter
from gqm_sym.runtime.double_double.interpreter import BLOCK, ERROR, LOW, ROW
from gqm_sym.runtime.double_double.recording import MAX_REGISTERS, BoundTape
from gqm_sym.runtime.double_double.tapes import bind, record
from gqm_sym.runtime.interface import ExactFormulas

# These are all functions that a formula may contain, for places between 1.1 and 1.9.
FUNCTIONS = {
    "trigonometric": lambda op, u, p: op.sin(u) * op.cos(p[0] * u) + op.tan(u / 2),
    "inverse trigonometric": lambda op, u, p: op.asin(u / 4) + op.acos(p[0] / 3) * op.atan(u),
    "hyperbolic": lambda op, u, p: op.sinh(u) / op.cosh(p[0]) - op.tanh(u),
    "inverse hyperbolic": lambda op, u, p: op.asinh(u) + op.acosh(u + 1) * op.atanh(u / 5),
    "exponential": lambda op, u, p: op.exp(-u) * op.log(u + p[0]) + op.e**u,
    "powers": lambda op, u, p: u**5 - p[0] / u**2 + u ** (op.mpf(3) / 2) + op.sqrt(u) ** -3 + 2**u + u**0,
    "other powers": lambda op, u, p: u ** (op.mpf(1) / 3) + u ** p[0] + 1 / (3 - u) ** 7,
    "numbers": lambda op, u, p: op.mpf(1) / 3 + op.pi * u - abs(p[0] - 7) / 9 + abs(op.mpf(-2)) + -u,
    "nothing": lambda op, u, p: op.mpf(5) / 7,
}
PARAMETER = "7/5"


def values(tape: BoundTape, places: np.ndarray) -> tuple[list[mpf], np.ndarray]:
    """Return the effective potential at places, by the interpreter, and the bounds on its errors."""
    first, place, potential, *_ = tape.tape.registers
    work = tape.work
    for k, (high, low) in enumerate(tape.parameters.T):
        row = work[first + k * ROW : first + (k + 1) * ROW]
        row[:LOW], row[LOW:ERROR], row[ERROR:] = high, low, 2.0**-106 * abs(high)
    work[place : place + LOW], work[place + LOW : place + ROW] = places, 0.0
    run = interpreter.INTERPRETER.call
    run(tape.tape.operations.ctypes.data, 0, tape.tape.parts[2], work.ctypes.data, BLOCK)
    out = work[potential : potential + ROW]
    return [mpf(h) + mpf(low) for h, low in out[:ERROR].reshape(2, -1).T.tolist()], out[ERROR:]


def recorded(formula: Any, parameters: int = 1) -> BoundTape | None:
    """Return the tape of one formula, which stands for all."""
    numbers = [read_number(PARAMETER, where="p")] * parameters
    found = record(ExactFormulas(*[formula] * 7), lambda op, p: (None, None, 2 * op.pi), len(numbers))
    return bind(found, numbers)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_tape_is_its_formula(name: str) -> None:
    """At 64 places a tape gives its formula within the bound, which promises 29 digits."""
    tape = recorded(FUNCTIONS[name])
    assert tape is not None
    places = np.random.default_rng(1).uniform(1.1, 1.9, BLOCK)
    with mp.workdps(50):
        found, bounds = values(tape, places)
        p = (mpf(7) / 5,)
        for u, value, bound in zip(places.tolist(), found, bounds, strict=True):
            wanted = FUNCTIONS[name](mp, mpf(u), p)
            assert abs(value - wanted) <= bound <= 1e-29 * max(1, abs(wanted))


def test_what_occurs_twice_is_computed_once() -> None:
    """A sine and a cosine of the same angle are one operation, and so is a formula that is another's part."""
    tape = recorded(lambda op, u, p: op.sin(u) * op.cos(u) + (op.sin(u) * op.cos(u)) ** 2)
    assert tape is not None
    codes = tape.tape.operations[:, 0].tolist()
    assert codes.count(interpreter.SINE_COSINE) == 1
    assert len(codes) == 4 + 1  # and the period


def test_what_is_constant_is_not_computed_at_each_place() -> None:
    """Operations on parameters alone come first, and those on rational numbers are carried out exactly when they are
    recorded.
    """
    tape = recorded(lambda op, u, p: u * op.sqrt(p[0] + op.mpf(1) / 3 + op.mpf(2) / 3))
    assert tape is not None
    constant, with_place, everything = tape.tape.parts
    assert (constant - 1, with_place, everything) == (3, constant + 1, with_place)  # the period is constant too


def test_long_formulas_are_left_to_mpmath() -> None:
    """A formula whose tape would not fit into the caches has no tape."""

    def long(op: Any, u: Any, p: Any) -> Any:
        return sum(op.sin(k * u) for k in range(1, MAX_REGISTERS))

    assert recorded(long) is None
