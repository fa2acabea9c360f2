"""Attraction towards a point by the inverse square of the distance."""

from collections.abc import Iterable

import sympy as sp

from gqm_sym.arguments import checked, several
from gqm_sym.errors import DeclarationError
from gqm_sym.expressions import read_expression
from gqm_sym.kernels.base import Kernel, X, Z, parameter
from gqm_sym.parameters import COORDINATES, Given, names_in_order, read_parameters


@checked("CentralForce")
def CentralForce(*, centre: Iterable[str | int | sp.Expr] = (0, 0), k: Given | None = None) -> Kernel:
    """Return the attraction ``k/r**2`` towards ``centre``.

    Parameters
    ----------
    centre
        Its two coordinates: numbers, or expressions in run-time parameters.
    k
        The strength (G times the mass of the centre), or another name for it.
    """
    where = "central_force: centre"
    given = several(centre, where=where, what="two coordinates (x, z)")
    if len(given) != 2:
        raise DeclarationError(f"{where}: must be two coordinates (x, z), got {len(given)}")
    place = tuple(read_expression(part, where=where, unit="m") for part in given)
    found = names_in_order(*place)
    for name in COORDINATES:
        if name in found:
            raise DeclarationError(f"central_force: centre: must not depend on the coordinate {name!r}")
    strength, pair = parameter(k, "k", where="central_force")
    distance = sp.sqrt((X - place[0]) ** 2 + (Z - place[1]) ** 2)
    own = Kernel(terms=(), defaults=read_parameters(None, found=found, where="central_force"))
    return own + Kernel(
        terms=(("central_force", f"attraction {strength}/r**2 to ({place[0]}, {place[1]})"),),
        potential=-strength / distance,
        defaults=(pair,),
    )
