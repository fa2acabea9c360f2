"""Force laws: each a small file that fills slots of one linear equation; they add with ``+``."""

from collections.abc import Callable
from dataclasses import dataclass

from gqm_sym.kernels.base import Kernel
from gqm_sym.kernels.central_force import CentralForce
from gqm_sym.kernels.gravity import Gravity
from gqm_sym.kernels.potential import Potential
from gqm_sym.kernels.rolling import Rolling
from gqm_sym.kernels.rotating_frame import RotatingFrame


@dataclass(frozen=True, slots=True, kw_only=True)
class KernelRow:
    """How a kernel is called in a YAML file and in Python, and what it is given."""

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
            arguments=("beta",),
            summary="rolling without slipping: inertia 1 + beta",
        ),
        KernelRow(
            name="rotating_frame",
            make=RotatingFrame,
            arguments=("Omega",),
            summary="the track turns about the z axis",
        ),
        KernelRow(
            name="potential",
            make=Potential,
            arguments=("U",),
            summary="a potential energy per unit mass, in x and z",
        ),
        KernelRow(
            name="central_force",
            make=CentralForce,
            arguments=("centre", "k"),
            summary="attraction k/r**2 towards a centre",
        ),
    )
}

__all__ = [
    "KERNELS",
    "CentralForce",
    "Gravity",
    "Kernel",
    "KernelRow",
    "Potential",
    "Rolling",
    "RotatingFrame",
]
