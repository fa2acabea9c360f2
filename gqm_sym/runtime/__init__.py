"""The fixed runtime that generated modules plug into: quadrature, turning points, tiling, inversion.

An island: it knows numpy, numba and itself, and mpmath only where exact digits are asked for.
"""

from gqm_sym.runtime.formulas import Formulas, Pass1
from gqm_sym.runtime.interface import (
    BEND,
    BOUNDS,
    CLIMB,
    FRAME,
    INTERFACE,
    RISE,
    Addresses,
    ExactFormulas,
)
from gqm_sym.runtime.jit import compiler
from gqm_sym.runtime.motion import Motion, State

__all__ = [
    "BEND",
    "BOUNDS",
    "CLIMB",
    "FRAME",
    "INTERFACE",
    "RISE",
    "Addresses",
    "ExactFormulas",
    "Formulas",
    "Motion",
    "Pass1",
    "State",
    "compiler",
]
