"""Uniform gravity."""

from gqm_sym.arguments import checked
from gqm_sym.kernels.base import Kernel, Z, parameter
from gqm_sym.parameters import Given


@checked("Gravity")
def Gravity(*, g: Given | None = None) -> Kernel:
    """Return uniform gravity, downwards: ``F = -g`` per unit mass along z (MATHS, section 2).

    Parameters
    ----------
    g
        The acceleration in m/s², by default exactly 9.81; or another name for this parameter.

    Returns
    -------
    Kernel

    Raises
    ------
    DeclarationError
        If a name or a value is not allowed.
    """
    strength, pair = parameter(g, "g", where="gravity")
    return Kernel(
        terms=(("gravity", f"gravity {strength}, downwards"),),
        potential=strength * Z,
        defaults=(pair,),
    )
