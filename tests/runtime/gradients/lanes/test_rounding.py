"""Variances of rounding errors agree with the errors themselves."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

from gqm_sym.runtime.double_double.interpreter import BLOCK, INTERPRETER, LOW
from gqm_sym.runtime.gradients.lanes.assembly import assemble
from gqm_sym.runtime.gradients.lanes.interpreter import LANES_INTERPRETER
from gqm_sym.runtime.gradients.lanes.operations import ROUNDING, LaneRecorder
from gqm_sym.runtime.gradients.lanes.rounding import variances

# Formulas of a place u between 0 and 1 and a parameter p. In the last two, numerator and denominator have errors in
# common, most of which cancel.
FORMULAS: dict[str, Callable[..., Any]] = {
    "sum": lambda op, u, p: (u + p) * (u + 2 * p) - p,
    "power": lambda op, u, p: op.sqrt(u + p) ** 8,
    "quotient": lambda op, u, p: op.sqrt(u + p) ** 8 / (op.sqrt(u + p) ** 7 * (1 + u)),
    "share": lambda op, u, p: op.sqrt(u + p) ** 8 / (op.sqrt(u + p) ** 8 + u / 50),
}
P, SAMPLES = 0.7, 20

# Between these the root mean square of errors lies, as a share of what the variances say. Most mantissas are larger
# than 1, so that roundings are smaller shares of numbers than is assumed.
LEAST, MOST = 0.35, 1.1


@pytest.mark.parametrize("name", FORMULAS)
def test_variances(name: str) -> None:
    """Over random places, rounding errors are as large as their variances say."""
    op = LaneRecorder(1, 2)
    result = op.number(FORMULAS[name](op, op.places[0], op.values[0]))
    program = assemble(op, [result], variances(op, [result], [[(op.number(1), 0)]]))
    shares, work, ratios = np.random.default_rng(2).uniform(0, 1, (SAMPLES, BLOCK)), program.work.copy(), []
    work[:LOW] = P
    INTERPRETER.call(program.before.ctypes.data, 0, len(program.before), work.ctypes.data, BLOCK)
    for places in shares:
        for operations, outputs in ((program.noise, program.variances), (program.nodes, program.outputs)):
            at = program.coordinates[0]
            work[at : at + BLOCK] = places
            LANES_INTERPRETER.call(operations.ctypes.data, 0, len(operations), work.ctypes.data, BLOCK)
            rows = work[outputs[0] : outputs[0] + BLOCK].copy()
            if outputs is program.variances:
                spread = ROUNDING * np.sqrt(rows)
        with mp.workdps(40):
            errors = [
                float(mpf(value) - FORMULAS[name](mp, mpf(u), mpf(P))) for value, u in zip(rows, places, strict=True)
            ]
        ratios.append(np.array(errors) / spread)
    assert LEAST <= np.sqrt(np.mean(np.square(ratios))) <= MOST
