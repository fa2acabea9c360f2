"""Attraction towards a point by the inverse square of the distance."""

from collections.abc import Iterable

import sympy as sp

from gqm_sym.arguments import checked, several
from gqm_sym.errors import DeclarationError
from gqm_sym.expressions import read_expression
from gqm_sym.kernels.base import Kernel, X, Y, Z, parameter
from gqm_sym.parameters import COORDINATES, Given, names_in_order, read_parameters


@checked("CentralForce")
def CentralForce(*, centre: Iterable[str | int | sp.Expr] = (0, 0), k: Given | None = None) -> Kernel:
    """Return the attraction ``k/r**2`` per unit mass towards a centre.

    Parameters
    ----------
    centre
        The coordinates x and z of the centre in m, or x, y and z: numbers, or expressions in run-time parameters.
    k
        The strength in m³/s² (the gravitational constant times the mass of the centre), or another name for it.

    Returns
    -------
    Kernel

    Raises
    ------
    DeclarationError
        If a name or a value is not allowed.
    """
    where = "central_force: centre"
    given = several(centre, where=where, what="two coordinates (x, z), or three (x, y, z)")
    if len(given) not in (2, 3):
        raise DeclarationError(f"{where}: must be two coordinates (x, z), or three (x, y, z), got {len(given)}")
    place = tuple(read_expression(part, where=where, unit="m") for part in given)
    found = names_in_order(*place)
    for name in (*COORDINATES, *(["y"] if len(place) == 3 else [])):
        if name in found:
            raise DeclarationError(f"central_force: centre: must not depend on the coordinate {name!r}")
    strength, pair = parameter(k, "k", where="central_force")
    middle = place[1] if len(place) == 3 else sp.S.Zero
    distance = sp.sqrt((X - place[0]) ** 2 + (Y - middle) ** 2 + (Z - place[-1]) ** 2)
    own = Kernel(terms=(), defaults=read_parameters(None, found=found, where="central_force"))
    return own + Kernel(
        terms=(("central_force", f"attraction {strength}/r**2 to ({', '.join(map(str, place))})"),),
        potential=-strength / distance,
        defaults=(pair,),
    )
