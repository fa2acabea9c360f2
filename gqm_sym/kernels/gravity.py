"""Uniform gravity."""

from gqm_sym.arguments import checked
from gqm_sym.kernels.base import Kernel, Z, parameter
from gqm_sym.parameters import Given


@checked("Gravity")
def Gravity(*, g: Given | None = None) -> Kernel:
    """Return uniform gravity, downwards.

    Parameters
    ----------
    g
        Another name for its acceleration, or a value; 9.81 (exactly) if nothing is said.
    """
    strength, pair = parameter(g, "g", where="gravity")
    return Kernel(
        terms=(("gravity", f"gravity {strength}, downwards"),),
        potential=strength * Z,
        defaults=(pair,),
    )
