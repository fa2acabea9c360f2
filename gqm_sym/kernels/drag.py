"""Drag of a medium, quadratic in the speed."""

from gqm_sym.arguments import checked
from gqm_sym.kernels.base import MASS, Kernel, parameter
from gqm_sym.parameters import Given


@checked("QuadraticDrag")
def QuadraticDrag(*, b: Given | None = None) -> Kernel:
    """Return the drag force ``b*V**2`` against the motion; the deceleration is ``b*V**2/m``.

    Parameters
    ----------
    b
        The coefficient in kg/m, or another name for this parameter.

    Returns
    -------
    Kernel

    Raises
    ------
    DeclarationError
        If a name or a value is not allowed.

    Notes
    -----
    The row "drag" of the paper's Table 2, with the sign of the velocity (MATHS, section 2).
    """
    coefficient, pair = parameter(b, "b", where="drag")
    return Kernel(
        terms=(("drag", f"drag {coefficient}*V**2 against the motion"),),
        drag=coefficient / MASS,
        defaults=(pair,),
        at_least=((pair[0], "0"),),
    )
