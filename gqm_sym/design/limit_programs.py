"""Height, slope, curvature and contact force at given places, with their derivatives with respect to what shapes a
track.
"""

from functools import lru_cache

import numpy as np

from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.double_double.recording import Recorder
from gqm_sym.runtime.gradients.adjoints import gradient
from gqm_sym.runtime.gradients.charts.programs import ChartSource
from gqm_sym.runtime.gradients.evaluation import values
from gqm_sym.runtime.gradients.programs import Program, with_derivatives
from gqm_sym.runtime.interface import ExactFormulas, ExactLaw

# The number of coordinates of a point of a track: x, z, their first derivatives, and their second ones.
POINT = 6


@lru_cache(maxsize=64)
def shape_program(formulas: ExactFormulas | ExactLaw, parameters: int) -> Program:
    """Return the program of height, slope and curvature at a place, each with its derivatives with respect to the place
    and the run-time parameters, which are the inputs.
    """
    op = Recorder(parameters)
    arguments = op, op.place, op.values
    x, z, curvature = (op.number(f(*arguments)) for f in (formulas.x, formulas.z, formulas.kappa))
    ((across,), (rise,)) = (gradient(op, q, [op.place]) for q in (x, z))
    return with_derivatives(op, [z, rise / across, curvature], [op.place, *op.values])


@lru_cache(maxsize=64)
def track_program(source: ChartSource) -> Program:
    """Return the program of height, slope, curvature and contact force at a point of a track.

    The inputs are the run-time parameters, and V**2 + 2 U, which is the same at all places. Each quantity is followed
    by its derivatives with respect to the coordinates of the point, to that sum, and to the run-time parameters.
    """
    op = Recorder(source.parameters + 1, POINT)
    (x, z, dx, dz, bend_x, bend_z), p, energy = op.places, op.values[:-1], op.values[-1]
    square = dx * dx + dz * dz
    speed = op.sqrt(square)
    curvature = (dx * bend_z - dz * bend_x) / (square * speed)
    value, by_x, by_z = map(op.number, source.potential(op, x, z, p))
    load = source.one_plus_beta(op) * (by_z * dx - by_x * dz) / speed
    force = p[source.mass] * (curvature * (energy - 2 * value) + load)
    return with_derivatives(op, [z, dz / dx, curvature, force], [*op.places, energy, *p])


def rows_at(program: Program, inputs: Array, places: Array) -> Array:
    """Return the results of one of the programs, of shape (quantities, 1 + variables, places).

    Parameters
    ----------
    program : Program
        The program of three or four quantities.
    inputs : (3, m) array
        The inputs, as two doubles and a bound on the error each.
    places : (k, n) array
        The coordinates of the places.
    """
    with np.errstate(all="ignore"):  # a track may be vertical
        found = values(program, inputs, places[0], None, *places[1:], parts=1)
    quantities = 3 if len(places) == 1 else 4
    return found.reshape(quantities, -1, places.shape[1])
