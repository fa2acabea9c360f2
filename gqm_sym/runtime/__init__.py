"""The fixed runtime that generated modules plug into: quadrature, turning points, tiling, inversion.

An island: it knows numpy, numba and itself, and mpmath only where exact digits are asked for. What most motions never
need is imported when it is asked for.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from gqm_sym.runtime.formulas import Formulas, Pass1
from gqm_sym.runtime.interface import (
    BEND,
    BEND_EACH,
    BOUNDS,
    BOUNDS_EACH,
    CLIMB,
    CREST_EACH,
    DRIVE,
    FIELD,
    FRAME,
    HOLD,
    INTERFACE,
    MEAN_EACH,
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
from gqm_sym.runtime.motion import Motion, State

if TYPE_CHECKING:
    from gqm_sym.runtime.rail import Rail
    from gqm_sym.runtime.sampled import Sampled
    from gqm_sym.runtime.sweeping import Sweep
    from gqm_sym.runtime.tracing import Traced

LATER = {"Rail": "rail", "Sampled": "sampled", "Sweep": "sweeping", "Traced": "tracing"}

__all__ = [
    "BEND",
    "BEND_EACH",
    "BOUNDS",
    "BOUNDS_EACH",
    "CLIMB",
    "CREST_EACH",
    "DRIVE",
    "FIELD",
    "FRAME",
    "HOLD",
    "INTERFACE",
    "MEAN_EACH",
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


def __getattr__(name: str) -> Any:
    if name not in LATER:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{LATER[name]}"), name)
