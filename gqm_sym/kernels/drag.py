"""Drag of a medium, linear or quadratic in the speed."""

import sympy as sp

from gqm_sym.arguments import checked
from gqm_sym.kernels.base import DIRECTION, MASS, Kernel, W, parameter
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


@checked("LinearDrag")
def LinearDrag(*, c: Given | None = None) -> Kernel:
    """Return the viscous drag force ``c*V`` against the motion; the deceleration is ``c*V/m``.

    Parameters
    ----------
    c
        The coefficient in kg/s, or another name for this parameter.

    Returns
    -------
    Kernel

    Raises
    ------
    DeclarationError
        If a name or a value is not allowed.

    Notes
    -----
    The force is not linear in V**2, so it enters as a tangential acceleration does (MATHS, section 2). It decreases
    the speed of a body on a level track by equal amounts in equal lengths, and the body comes to rest only in the
    limit of infinite time.

    Examples
    --------
    >>> LinearDrag(c="1/10").tangential_law
    -sqrt(W)*c*direction/m
    """
    coefficient, pair = parameter(c, "c", where="linear_drag")
    return Kernel(
        terms=(("linear_drag", f"drag {coefficient}*V against the motion"),),
        tangential_law=-DIRECTION * coefficient * sp.sqrt(W) / MASS,
        defaults=(pair,),
        at_least=((pair[0], "0"),),
    )
