"""A track that turns about the vertical axis x = 0."""

from gqm_sym.arguments import checked
from gqm_sym.kernels.base import Kernel, X, parameter
from gqm_sym.parameters import Given


@checked("RotatingFrame")
def RotatingFrame(*, Omega: Given | None = None) -> Kernel:
    """Return the centrifugal force of a track that turns about the z axis.

    Its Coriolis force presses the body out of the plane: friction feels that too.

    Parameters
    ----------
    Omega
        The angular velocity.
    """
    rate, pair = parameter(Omega, "Omega", where="rotating_frame")
    return Kernel(
        terms=(("rotating_frame", f"frame turning about the z axis at {rate}"),),
        potential=-(rate**2) * X**2 / 2,
        spin=rate,
        defaults=(pair,),
    )
