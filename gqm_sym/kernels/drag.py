"""Drag of a medium, quadratic in the speed."""

from gqm_sym.arguments import checked
from gqm_sym.kernels.base import MASS, Kernel, parameter
from gqm_sym.parameters import Given


@checked("QuadraticDrag")
def QuadraticDrag(*, b: Given | None = None) -> Kernel:
    """Return the drag force ``b*V**2`` against the motion.

    Parameters
    ----------
    b
        Another name for its coefficient, or a value; the deceleration is ``b*V**2/m``.
    """
    coefficient, pair = parameter(b, "b", where="drag")
    return Kernel(
        terms=(("drag", f"drag {coefficient}*V**2 against the motion"),),
        drag=coefficient / MASS,
        defaults=(pair,),
        at_least=((pair[0], "0"),),
    )
