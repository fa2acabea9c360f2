"""A potential of the user's own."""

from collections.abc import Iterable, Mapping

import sympy as sp

from gqm_sym.arguments import checked
from gqm_sym.expressions import read_expression
from gqm_sym.kernels.base import Kernel
from gqm_sym.parameters import COORDINATES, Given, names_in_order, read_parameters


@checked("Potential")
def Potential(
    U: str | sp.Expr,
    *,
    parameters: Mapping[str, Given | None] | Iterable[str] | None = None,
) -> Kernel:
    """Return the force minus the gradient of ``U``.

    Parameters
    ----------
    U
        Potential energy per unit mass in ``x`` and ``z``, on space curves also in ``y``; its other symbols are
        parameters.
    parameters
        Their defaults, or their names in the order wanted.
    """
    energy = read_expression(U, where="potential: U")
    found = tuple(name for name in names_in_order(energy) if name not in COORDINATES)
    return Kernel(
        terms=(("potential", f"potential {energy} per unit mass"),),
        potential=energy,
        defaults=read_parameters(parameters, found=found, where="potential"),
    )
