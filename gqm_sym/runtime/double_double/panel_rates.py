"""The integrands over a panel of phase angles, in double-double arithmetic: time and arc length, with a bound; and the
speed there.
"""

from math import fabs
from typing import Any

import numpy as np
from numba import types

from gqm_sym.literals.numbers import Number
from gqm_sym.runtime.compiled.jit import Inner, entry
from gqm_sym.runtime.compiled.registers import borrowed
from gqm_sym.runtime.compiled.types import INTEGER, MATRIX, REAL, VECTOR, Array
from gqm_sym.runtime.double_double.arithmetic import UNIT, add, divide, multiply, sine_and_cosine
from gqm_sym.runtime.double_double.interpreter import ERROR, LOW, ROW, call_interpreter
from gqm_sym.runtime.double_double.orbit_time import ENDS
from gqm_sym.runtime.double_double.quadrature import (
    TAPE,
    energy_level,
    fill_integrand,
    fill_parameters,
    fill_places,
)
from gqm_sym.runtime.double_double.recording import BoundTape
from gqm_sym.runtime.quadrature.substitution import FROM_TURN, TURN_TURN

Pair = tuple[float, float]

# The largest relative error of a rate. Rounded to a double, such a rate is as good as an exact one.
MAX_RATE_ERROR = 2.0**-54

# The derivative of the share of a segment with respect to phi, over the factor of the speed that is not regular: those
# of TURN_TURN, FROM_TURN and REGULAR segments.
GROWTHS = (0.5, 2.0, 1.0)

PAIR = types.UniTuple(REAL, 2)


@Inner
def fill_shares(kind, middle, reach, nodes, rows):  # type: ignore[no-untyped-def]
    """Fill the share of a segment at each node of a panel, and its derivative with respect to phi, two doubles each."""
    for i in range(nodes.size):
        phi, low = multiply(reach[0], reach[1], nodes[i], 0.0)
        phi, low = add(middle[0], middle[1], phi, low)
        rows[0, i], rows[1, i], rows[2, i], rows[3, i] = phi, low, 1.0, 0.0
        if kind == TURN_TURN:
            s, s_low, c, c_low = sine_and_cosine(0.5 * phi, 0.5 * low)
            rows[0, i], rows[1, i] = multiply(s, s_low, s, s_low)
            rows[2, i], rows[3, i] = multiply(s, s_low, c, c_low)
        elif kind == FROM_TURN:
            rows[0, i], rows[1, i] = multiply(phi, low, phi, low)
            rows[2, i], rows[3, i] = 2.0 * phi, 2.0 * low


@entry(
    types.boolean(TAPE, VECTOR, MATRIX, types.UniTuple(REAL, 4), INTEGER, types.UniTuple(PAIR, 4), VECTOR, MATRIX),
    checked=False,
)
def fill_rates(tape, work, p, launch, kind, panel, nodes, out):  # type: ignore[no-untyped-def]
    """Fill the rows of ``out`` with dt/dphi, ds/dphi and the regular factor of the speed at the nodes of a panel; see
    `panel_rates`.

    Parameters
    ----------
    tape, work, p, launch
        As for `orbit_time.orbit_time`.
    kind : int
        The segment's kind (`quadrature.substitution`).
    panel : four pairs of float
        The beginning of the segment, the increase of the curve's parameter over it, the phase angle in the middle of
        the panel, and the angle from there to its end; two doubles each.
    nodes : (n,) array
        Nodes between -1 and 1.

    Returns
    -------
    bool
        Whether the errors are small enough at all nodes, and V**2 is positive there.
    """
    work, p, nodes, out = borrowed(work), borrowed(p), borrowed(nodes), borrowed(out)
    address, operations, parts, registers = tape
    operations = borrowed(operations)
    tape = (address, operations, parts, registers)
    _, place, potential, ds, _, _ = registers
    fill_parameters(tape, p, work)
    for i in range(ENDS):
        at = place + i
        work[at], work[at + LOW], work[at + ERROR] = launch[0], launch[1], 0.25 * UNIT * fabs(launch[0])
    call_interpreter(address, operations, parts[0], parts[1], work, ENDS)
    level = energy_level(work, registers, launch, 0)
    start, width, middle, reach = panel
    n, rows, rates = nodes.size, np.empty((4, nodes.size)), np.empty(ROW)
    fill_shares(kind, middle, reach, nodes, rows)
    fill_places(n, start, width, rows, 0, work[place : place + ROW])
    call_interpreter(address, operations, parts[0], parts[1], work, n)
    metric = work[ds : ds + ROW]
    fill_integrand(n, level, rows, 0, work[potential : potential + ROW], metric, rates)
    for i in range(n):
        if not rates[ERROR + i] <= MAX_RATE_ERROR * rates[i]:
            return False
        time, _ = multiply(rates[i], rates[LOW + i], width[0], width[1])
        length, low = multiply(rows[2, i], rows[3, i], metric[i], metric[LOW + i])
        length, _ = multiply(length, low, width[0], width[1])
        out[0, i], out[1, i] = fabs(time), fabs(length)
        speed, _ = divide(metric[i], metric[LOW + i], rates[i], rates[LOW + i])
        out[2, i] = GROWTHS[kind] * speed
    return True


def panel_rates(
    formulas: BoundTape, launch: tuple[Number, Number], kind: int, panel: tuple[Pair, Pair, Pair, Pair], nodes: Array
) -> Array | None:
    """Return dt/dphi in s, ds/dphi in m and the regular factor of the speed in m/s at the nodes of a panel; None if
    the errors are too large.

    The speed is the regular factor times sin(phi) between two turning points, and times phi from a turning point.

    Parameters
    ----------
    formulas : BoundTape
        The formulas of the curve and its forces.
    launch : (Number, Number)
        Launch place, and speed in m/s.
    kind : int
        The kind of the segment (`quadrature.substitution`): TURN_TURN, FROM_TURN or REGULAR.
    panel : four pairs of float
        As for `fill_rates`.
    nodes : (n,) array
        Nodes between -1 and 1, at most as many as are evaluated together (`interpreter.BLOCK`).
    """
    lam0, v0 = launch
    given: Any = *formulas.operands, (lam0.value, lam0.low, v0.value, v0.low)
    out = np.empty((3, nodes.size))
    return out if fill_rates(*given, kind, panel, nodes, out) else None
