"""Symbolic declaration, closed forms and generated numba code for motion along given curves.

Importing this package loads no SymPy: names are fetched when first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gqm_sym import design, figures, jax, torch
    from gqm_sym.building import build
    from gqm_sym.declare import Curve, arc, clothoid, families, line, transition
    from gqm_sym.derivation import Model, derive
    from gqm_sym.design.least_speed import least_speed, least_speed_gradient
    from gqm_sym.emission import emit
    from gqm_sym.errors import GQMError
    from gqm_sym.fitting.fit import fit
    from gqm_sym.fitting.uncertainty import uncertainty
    from gqm_sym.kernels import (
        CentralForce,
        CoulombFriction,
        Gravity,
        Kernel,
        LinearDrag,
        Potential,
        QuadraticDrag,
        Rolling,
        RotatingFrame,
        SurfaceTension,
        Train,
    )
    from gqm_sym.specfile import read_spec, read_track
    from gqm_sym.studies import read_sweep

__version__ = "0.1.0"

_HOMES = {
    "CentralForce": "gqm_sym.kernels",
    "CoulombFriction": "gqm_sym.kernels",
    "Curve": "gqm_sym.declare",
    "GQMError": "gqm_sym.errors",
    "Gravity": "gqm_sym.kernels",
    "Kernel": "gqm_sym.kernels",
    "LinearDrag": "gqm_sym.kernels",
    "Model": "gqm_sym.derivation",
    "Potential": "gqm_sym.kernels",
    "QuadraticDrag": "gqm_sym.kernels",
    "Rolling": "gqm_sym.kernels",
    "RotatingFrame": "gqm_sym.kernels",
    "SurfaceTension": "gqm_sym.kernels",
    "Train": "gqm_sym.kernels",
    "arc": "gqm_sym.declare",
    "build": "gqm_sym.building",
    "clothoid": "gqm_sym.declare",
    "derive": "gqm_sym.derivation",
    "design": "gqm_sym.design",
    "emit": "gqm_sym.emission",
    "families": "gqm_sym.declare",
    "figures": "gqm_sym.figures",
    "fit": "gqm_sym.fitting.fit",
    "jax": "gqm_sym.jax",
    "least_speed": "gqm_sym.design.least_speed",
    "least_speed_gradient": "gqm_sym.design.least_speed",
    "line": "gqm_sym.declare",
    "read_spec": "gqm_sym.specfile",
    "read_sweep": "gqm_sym.studies",
    "read_track": "gqm_sym.specfile",
    "torch": "gqm_sym.torch",
    "transition": "gqm_sym.declare",
    "uncertainty": "gqm_sym.fitting.uncertainty",
}

__all__ = [
    "CentralForce",
    "CoulombFriction",
    "Curve",
    "GQMError",
    "Gravity",
    "Kernel",
    "LinearDrag",
    "Model",
    "Potential",
    "QuadraticDrag",
    "Rolling",
    "RotatingFrame",
    "SurfaceTension",
    "Train",
    "arc",
    "build",
    "clothoid",
    "derive",
    "design",
    "emit",
    "families",
    "figures",
    "fit",
    "jax",
    "least_speed",
    "least_speed_gradient",
    "line",
    "read_spec",
    "read_sweep",
    "read_track",
    "torch",
    "transition",
    "uncertainty",
]


def __getattr__(name: str) -> Any:
    """Fetch a public name from the module that defines it."""
    if name not in _HOMES:
        from gqm_sym.arguments import nearest

        near = nearest(name, __all__)
        hint = f"; did you mean {near}?" if near else ""
        raise AttributeError(f"module 'gqm_sym' has no attribute {name!r}{hint}")
    home = import_module(_HOMES[name])
    return home if home.__name__ == f"gqm_sym.{name}" else getattr(home, name)


def __dir__() -> list[str]:
    return sorted(__all__)
