"""Force laws, one file for each. Every law fills in terms of one linear equation, and laws are added with ``+``."""

from collections.abc import Callable
from dataclasses import dataclass

from gqm_sym.kernels.base import Kernel
from gqm_sym.kernels.central_force import CentralForce
from gqm_sym.kernels.coulomb import CoulombFriction
from gqm_sym.kernels.drag import LinearDrag, QuadraticDrag
from gqm_sym.kernels.gravity import Gravity
from gqm_sym.kernels.potential import Potential
from gqm_sym.kernels.rolling import Rolling
from gqm_sym.kernels.rotating_frame import RotatingFrame
from gqm_sym.kernels.surface_tension import SurfaceTension
from gqm_sym.kernels.train import Train


@dataclass(frozen=True, slots=True, kw_only=True)
class KernelRow:
    """The names of a force law in a YAML file and in Python, and its arguments."""

    name: str
    make: Callable[..., Kernel]
    arguments: tuple[str, ...]
    summary: str


KERNELS: dict[str, KernelRow] = {
    row.name: row
    for row in (
        KernelRow(
            name="gravity",
            make=Gravity,
            arguments=("g",),
            summary="uniform gravity, downwards",
        ),
        KernelRow(
            name="rolling",
            make=Rolling,
            arguments=("beta", "radius", "mu_static"),
            summary="rolling without slipping: the inertia is 1 + beta; with a radius, the curve is the track",
        ),
        KernelRow(
            name="train",
            make=Train,
            arguments=("length", "cars", "mass"),
            summary="a train whose mass is spread evenly along the track; lam is its middle",
        ),
        KernelRow(
            name="coulomb",
            make=CoulombFriction,
            arguments=("mu", "mu_static"),
            summary="sliding friction mu*|N|, and static friction up to mu_static*|N|",
        ),
        KernelRow(
            name="linear_drag",
            make=LinearDrag,
            arguments=("c",),
            summary="viscous drag c*V against the motion, in N",
        ),
        KernelRow(
            name="drag",
            make=QuadraticDrag,
            arguments=("b",),
            summary="drag b*V**2 against the motion, in N",
        ),
        KernelRow(
            name="surface_tension",
            make=SurfaceTension,
            arguments=("gamma", "ell_c", "form"),
            summary="resistance of a droplet, gamma*ell_c**2*|kappa|/m per unit mass",
        ),
        KernelRow(
            name="rotating_frame",
            make=RotatingFrame,
            arguments=("Omega",),
            summary="a track that rotates about the z axis",
        ),
        KernelRow(
            name="potential",
            make=Potential,
            arguments=("U",),
            summary="a potential energy per unit mass, as a function of x and z",
        ),
        KernelRow(
            name="central_force",
            make=CentralForce,
            arguments=("centre", "k"),
            summary="attraction k/r**2 towards a centre",
        ),
        KernelRow(
            name="law",
            make=Kernel.law,
            arguments=("A",),
            summary="a tangential acceleration, as a function of the curve's parameter, x, z, W = V**2 and direction",
        ),
    )
}

__all__ = [
    "KERNELS",
    "CentralForce",
    "CoulombFriction",
    "Gravity",
    "Kernel",
    "KernelRow",
    "LinearDrag",
    "Potential",
    "QuadraticDrag",
    "Rolling",
    "RotatingFrame",
    "SurfaceTension",
    "Train",
]
