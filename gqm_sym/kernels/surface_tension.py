"""The resistance of surface tension to a droplet that moves along a curve."""

import sympy as sp

from gqm_sym.arguments import checked, one_of
from gqm_sym.kernels.base import KAPPA, MASS, Kernel, parameter
from gqm_sym.parameters import Given

FORMS = ("resistance", "printed")


@checked("SurfaceTension")
def SurfaceTension(*, gamma: Given | None = None, ell_c: Given | None = None, form: str = "resistance") -> Kernel:
    """Return the resistance of a droplet's contact line, which is proportional to the curvature.

    Parameters
    ----------
    gamma
        The surface tension in N/m, or another name for this parameter.
    ell_c
        The contact length in m, or another name for this parameter.
    form
        ``resistance``: ``gamma*ell_c**2*|kappa|/m`` per unit mass against the motion. ``printed``: the form
        ``gamma*ell_c*kappa/m`` of the paper's Table 2 with numbers in SI units, which drives a droplet where the
        curvature is negative.

    Returns
    -------
    Kernel

    Raises
    ------
    DeclarationError
        If a name or a value is not allowed.
    """
    one_of(form, FORMS, where="surface_tension: form")
    tension, first = parameter(gamma, "gamma", where="surface_tension")
    length, second = parameter(ell_c, "ell_c", where="surface_tension")
    coefficient = tension * length**2 if form == "resistance" else tension * length
    bend = sp.Abs(KAPPA) if form == "resistance" else KAPPA
    text = str(coefficient * (sp.Symbol("|kappa|") if form == "resistance" else sp.Symbol("kappa")))
    return Kernel(
        terms=(("surface_tension", f"resistance {text}/m to the motion of a droplet"),),
        resistance=coefficient * bend / MASS,
        defaults=(first, second),
        at_least=((first[0], "0"), (second[0], "0")),
    )
