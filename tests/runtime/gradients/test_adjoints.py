"""Derivatives recorded on a tape agree with mpmath's own, for every function that a formula may contain."""

from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

from gqm_sym.runtime.double_double.recording import Recorder
from gqm_sym.runtime.gradients.adjoints import gradient
from gqm_sym.runtime.gradients.evaluation import values
from gqm_sym.runtime.gradients.orbit import pairs
from gqm_sym.runtime.gradients.programs import assemble

# Each formula is tested for places between 1.1 and 1.9, and a parameter of 1.4.
FUNCTIONS = {
    "trigonometric": lambda op, u, p: op.sin(u) * op.cos(p * u) + op.tan(u / 2) + op.cos(u * u),
    "inverse trigonometric": lambda op, u, p: op.asin(u / 4) + op.acos(p / 3) * op.atan(u),
    "hyperbolic": lambda op, u, p: op.sinh(u) / op.cosh(p) - op.tanh(u * p),
    "inverse hyperbolic": lambda op, u, p: op.asinh(u) + op.acosh(u + p) * op.atanh(u / 5),
    "exponential": lambda op, u, p: op.exp(-u * p) * op.log(u + p) + op.e**u,
    "powers": lambda op, u, p: u**5 - p / u**2 + u ** (op.mpf(3) / 2) + op.sqrt(u) ** -3 + 2**u + u**0,
    "other powers": lambda op, u, p: p * u ** (op.mpf(1) / 3) + u**p + 1 / (3 - u) ** 7,
    "absolute values": lambda op, u, p: abs(p - 7) * u + abs(u - p * u) / 3,
    "the same twice": lambda op, u, p: (u + p) * (u + p) - (u - u) / p + p,
    "nothing": lambda op, u, p: op.mpf(5) / 7,
}
PLACES = np.random.default_rng(3).uniform(1.1, 1.9, 70)
PARAMETER = 1.4375


def found(formula: Any, order: int) -> np.ndarray:
    """Return first derivatives with respect to place and parameter, or second ones with respect to the place and
    either.
    """
    op = Recorder(1)
    result = formula(op, op.place, op.values[0])
    for _ in range(order - 1):
        (result,) = gradient(op, result, [op.place])
    program = assemble(op, gradient(op, result, [op.place, op.values[0]]))
    return values(program, pairs((PARAMETER, 0.0, 0.0)), PLACES)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("name", FUNCTIONS)
def test_derivatives(name: str, order: int) -> None:
    """Derivatives at 70 places have 28 digits and lie within the bounds, also derivatives of derivatives."""
    rows = found(FUNCTIONS[name], order)
    with mp.workdps(60):
        for k in range(0, PLACES.size, 23):
            for row, counts in zip(rows, ((order, 0), (order - 1, 1)), strict=True):
                wanted = mp.diff(lambda u, p: FUNCTIONS[name](mp, u, p), (mpf(PLACES[k]), mpf(PARAMETER)), counts)
                error = abs(mpf(row[0, k]) + mpf(row[1, k]) - wanted)
                assert error <= 1e-28 * max(1, abs(wanted))
                assert error <= row[2, k] + mpf(10) ** -38


def test_variables_that_depend_on_others() -> None:
    """A derivative with respect to a variable is for fixed values of the others, also of one computed from it."""
    op = Recorder(1)
    p, u = op.values[0], op.place
    product = p * u
    program = assemble(op, gradient(op, op.sin(product) + p, [product, p, u]))
    by_product, by_p, by_u = values(program, pairs((PARAMETER, 0.0, 0.0)), PLACES)[:, 0]
    np.testing.assert_allclose(by_product, np.cos(PARAMETER * PLACES), rtol=0, atol=1e-15)
    assert (by_p == 1.0).all()
    assert (by_u == 0.0).all()
