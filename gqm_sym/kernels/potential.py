"""A user's own potential."""

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
    """Return the force ``-grad U`` per unit mass (MATHS, section 2).

    Parameters
    ----------
    U
        The potential energy per unit mass in m²/s², as a function of ``x`` and ``z``, on space curves also of ``y``;
        its other symbols are run-time parameters.
    parameters
        Defaults of these parameters in SI units, or their names in order.

    Returns
    -------
    Kernel

    Raises
    ------
    DeclarationError
        If a name or a value is not allowed.
    """
    energy = read_expression(U, where="potential: U")
    found = tuple(name for name in names_in_order(energy) if name not in COORDINATES)
    return Kernel(
        terms=(("potential", f"potential {energy} per unit mass"),),
        potential=energy,
        defaults=read_parameters(parameters, found=found, where="potential"),
    )
