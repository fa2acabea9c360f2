"""A track that rotates about the vertical axis x = y = 0."""

from gqm_sym.arguments import checked
from gqm_sym.kernels.base import Kernel, X, Y, parameter
from gqm_sym.parameters import Given


@checked("RotatingFrame")
def RotatingFrame(*, Omega: Given | None = None) -> Kernel:
    """Return the centrifugal force of a track that rotates about the z axis.

    The Coriolis force presses the body sideways against a planar track, which increases friction. On a space curve it
    is part of the contact force, which then depends on the direction of motion.

    Parameters
    ----------
    Omega
        The angular velocity in rad/s, or another name for this parameter.

    Returns
    -------
    Kernel

    Raises
    ------
    DeclarationError
        If a name or a value is not allowed.

    Notes
    -----
    The centrifugal potential is ``-Omega**2*(x**2 + y**2)/2``, with y = 0 in a plane (MATHS, section 2).
    """
    rate, pair = parameter(Omega, "Omega", where="rotating_frame")
    return Kernel(
        terms=(("rotating_frame", f"frame turning about the z axis at {rate}"),),
        potential=-(rate**2) * (X**2 + Y**2) / 2,
        spin=rate,
        defaults=(pair,),
    )
