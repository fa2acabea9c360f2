"""Divided differences on tapes agree with mpmath, and their derivatives with differences of these."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

from gqm_sym.runtime.compiled.uncompiled import plain_by_address
from gqm_sym.runtime.double_double.interpreter import BLOCK, INTERPRETER, LOW, ROW
from gqm_sym.runtime.gradients.lanes.assembly import LaneProgram, assemble
from gqm_sym.runtime.gradients.lanes.differences import Places
from gqm_sym.runtime.gradients.lanes.interpreter import LANES_INTERPRETER
from gqm_sym.runtime.gradients.lanes.operations import LaneRecorder, WithoutRuleError
from gqm_sym.runtime.gradients.lanes.programs import changes, quotient_with_root, root_of_quotient

# Formulas of a place u between 0.3 and 2.3 and a parameter p.
FORMULAS: dict[str, Callable[..., Any]] = {
    "polynomial": lambda op, u, p: p[0] * u**4 - 2 * u**3 + u / 3 - 5,
    "waves": lambda op, u, p: p[0] * op.sin(u) - op.cos(2 * u + p[0]),
    "a square of waves": lambda op, u, p: (op.sin(u) + p[0]) ** 2 + op.cos(u) * op.sin(3 * u),
    "hyperbolic": lambda op, u, p: op.cosh(u * p[0]) + op.sinh(u) - op.tanh(u / 2),
    "exponential": lambda op, u, p: op.exp(-u * p[0]) + op.exp(u / 2) + op.exp(p[0]) * u**2,
    "quotients": lambda op, u, p: 1 / (1 + p[0] * u**2) + u / (3 - u) - u**-2,
    "roots": lambda op, u, p: op.sqrt(1 + p[0] * u**2) + (1 + u) ** (op.mpf(-3) / 2) + op.sqrt(p[0]) * u**2,
    "waves of waves": lambda op, u, p: op.sin(p[0] * op.cos(u)) + op.tan(u / 4) + op.pi * u**2,
}
P, PLACE = 0.7, (-0.6, 0.64)

# Widths of orbits and phase angles. The widest reaches over more than half a wave of 3*u.
ORBITS = ((1e-6, 1.1), (0.01, 1.1), (0.5, 1.1), (1.9, 1.1), (2.6, 2.9))


def carried_out(
    program: LaneProgram, run: Callable[..., None], p: float, ends: tuple[float, float], place: tuple[float, float]
) -> Any:
    """Return the results of a program in the first lane, at a place given by its two coordinates."""
    work = program.work.copy()
    for k, value in enumerate((p, *ends)):
        work[k * ROW : k * ROW + LOW] = value
    for at, coordinate in zip(program.coordinates, place, strict=True):
        work[at : at + BLOCK] = coordinate
    INTERPRETER.call(program.before.ctypes.data, 0, len(program.before), work.ctypes.data, BLOCK)
    run(program.nodes.ctypes.data, 0, len(program.nodes), work.ctypes.data, BLOCK)
    return work[program.outputs]


def recorded(name: str) -> LaneProgram:
    """Return the program of a second divided difference, and of its derivatives with respect to p and both ends."""
    op = LaneRecorder(3, 2)
    second = Places(op, (op.values[1], op.values[2]), *op.places).of(FORMULAS[name], op.values[:1]).second
    moves = [[op.number(int(j == k)) for j in range(3)] for k in range(3)]
    return assemble(op, [second, *changes(op, [(second, op.number(1))], op.values, moves)])


@pytest.mark.parametrize("name", FORMULAS)
def test_differences_of_formulas(name: str) -> None:
    """Second divided differences and their derivatives keep their digits, however near to each other the places are."""
    program = recorded(name)
    for width, phi in ORBITS:
        ends = (0.35, 0.35 + width)
        found = carried_out(program, LANES_INTERPRETER.call, P, ends, (-np.cos(phi), np.sin(phi) ** 2))
        with mp.workdps(60):

            def second(p: Any, a: Any, b: Any, phi: float = phi) -> mpf:
                u = a + (b - a) * (1 - mpf(np.cos(phi))) / 2
                f = [FORMULAS[name](mp, place, [p]) for place in (a, u, b)]
                return ((f[2] - f[1]) / (b - u) - (f[1] - f[0]) / (u - a)) / (b - a)

            given = [mpf(P), mpf(ends[0]), mpf(ends[1])]
            wanted, step = [second(*given)], mpf(10) ** -15
            for k in range(3):
                up, down = ([x + sign * step * (j == k) for j, x in enumerate(given)] for sign in (1, -1))
                wanted.append((second(*up) - second(*down)) / (2 * step))
            size = max(map(abs, wanted))
            for value, true in zip(found, wanted, strict=True):
                assert abs(value - true) <= 1e-14 * size


@pytest.mark.sample(4)
@pytest.mark.parametrize("name", FORMULAS)
def test_python_gives_the_same_bits(name: str) -> None:
    """Programs carried out by plain Python and by compiled code have the same results."""
    program, ends = recorded(name), (0.35, 1.25)
    in_python = plain_by_address(LANES_INTERPRETER.function, LANES_INTERPRETER.signature, LANES_INTERPRETER.text)
    assert in_python is not None
    LANES_INTERPRETER.compile()
    plain, compiled = (carried_out(program, run, P, ends, PLACE) for run in (in_python, LANES_INTERPRETER.call))
    np.testing.assert_array_equal(plain, compiled)


@pytest.mark.parametrize(
    "formula", [lambda op, u, p: op.log(u), lambda op, u, p: abs(u), lambda op, u, p: 2**u, lambda op, u, p: u ** p[0]]
)
def test_formulas_without_a_rule(formula: Any) -> None:
    """Other functions are refused, so that other arithmetic is used."""
    op = LaneRecorder(3, 2)
    with pytest.raises(WithoutRuleError):
        Places(op, (op.values[1], op.values[2]), *op.places).of(formula, op.values[:1])


@pytest.mark.parametrize("scale", [1.0, -1.0, 1e100, -1e-100])
@pytest.mark.parametrize("with_root", [False, True])
def test_roots_of_quotients(scale: float, with_root: bool) -> None:
    """Roots of quotients of two numbers of either sign, and quotients by roots, have the digits of doubles, and so have
    their derivatives; plain Python gives the same bits.
    """
    op = LaneRecorder(3, 2)
    (p, a, b), (share, rest) = op.values, op.places
    above, below = scale * (a + p * share), scale * (b + p * rest)
    if with_root:
        rate, given = quotient_with_root(op, a + p * share, scale * below)
    else:
        rate, given = root_of_quotient(op, above, below)
    moves = [[op.number(int(j == k)) for j in range(3)] for k in range(3)]
    program, phi = assemble(op, [rate, *changes(op, given, op.values, moves)]), 0.9
    place = np.sin(phi / 2) ** 2, np.cos(phi / 2) ** 2
    found = carried_out(program, LANES_INTERPRETER.call, P, (0.35, 1.25), place)
    in_python = plain_by_address(LANES_INTERPRETER.function, LANES_INTERPRETER.signature, LANES_INTERPRETER.text)
    np.testing.assert_array_equal(carried_out(program, in_python, P, (0.35, 1.25), place), found)
    share, rest = place
    x, y = 0.35 + P * share, 1.25 + P * rest
    root = x / (abs(scale) * np.sqrt(y)) if with_root else np.sqrt(x / y)
    by_x, by_y = root / x * (1.0 if with_root else 0.5), -root / (2 * y)
    np.testing.assert_allclose(found, [root, by_x * share + by_y * rest, by_x, by_y], rtol=4e-15)


def test_a_root_of_a_number_that_is_not_normal() -> None:
    """The inverse root of zero, of a negative number and of a subnormal one is no number."""
    op = LaneRecorder(3, 2)
    program = assemble(op, [root_of_quotient(op, op.values[0] * op.places[0], op.number(1))[0]])
    for p in (0.0, -1.0, 1e-310):
        assert np.isnan(carried_out(program, LANES_INTERPRETER.call, p, (0.35, 1.25), (0.2, 0.8))).all()
