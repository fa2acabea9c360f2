"""A track that turns about the vertical axis x = y = 0."""

from gqm_sym.arguments import checked
from gqm_sym.kernels.base import Kernel, X, Y, parameter
from gqm_sym.parameters import Given


@checked("RotatingFrame")
def RotatingFrame(*, Omega: Given | None = None) -> Kernel:
    """Return the centrifugal force of a track that turns about the z axis.

    Its Coriolis force presses the body out of the plane of a planar track: friction feels that too. On a space curve it
    is part of the contact force, which then depends on the direction of motion.

    Parameters
    ----------
    Omega
        The angular velocity.
    """
    rate, pair = parameter(Omega, "Omega", where="rotating_frame")
    return Kernel(
        terms=(("rotating_frame", f"frame turning about the z axis at {rate}"),),
        potential=-(rate**2) * (X**2 + Y**2) / 2,
        spin=rate,
        defaults=(pair,),
    )
