"""The fixed runtime that generated modules plug into: quadrature, turning points, tiling, inversion.

An island: it knows numpy, numba and itself, and mpmath only where exact digits are asked for.
"""

from gqm_sym.runtime.formulas import Formulas
from gqm_sym.runtime.interface import (
    BEND,
    BEND_EACH,
    BOUNDS,
    BOUNDS_EACH,
    CLIMB,
    DRIVE,
    FIELD,
    FRAME,
    HOLD,
    INTERFACE,
    LOADS,
    ORBIT_EACH,
    RISE,
    RISE_EACH,
    SEGMENT,
    SWING_EACH,
    TOP_EACH,
    Addresses,
    Dissipation,
    Each,
    ExactClimb,
    ExactFormulas,
)
from gqm_sym.runtime.jit import compiler
from gqm_sym.runtime.loads import Pass1
from gqm_sym.runtime.motion import Motion, State
from gqm_sym.runtime.rail import Rail
from gqm_sym.runtime.sampled import Sampled
from gqm_sym.runtime.sweeping import Sweep
from gqm_sym.runtime.tracing import Traced

__all__ = [
    "BEND",
    "BEND_EACH",
    "BOUNDS",
    "BOUNDS_EACH",
    "CLIMB",
    "DRIVE",
    "FIELD",
    "FRAME",
    "HOLD",
    "INTERFACE",
    "LOADS",
    "ORBIT_EACH",
    "RISE",
    "RISE_EACH",
    "SEGMENT",
    "SWING_EACH",
    "TOP_EACH",
    "Addresses",
    "Dissipation",
    "Each",
    "ExactClimb",
    "ExactFormulas",
    "Formulas",
    "Motion",
    "Pass1",
    "Rail",
    "Sampled",
    "State",
    "Sweep",
    "Traced",
    "compiler",
]
