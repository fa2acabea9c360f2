"""Dry friction between a body and its track."""

from gqm_sym.arguments import checked
from gqm_sym.kernels.base import Kernel, parameter
from gqm_sym.parameters import Given


@checked("CoulombFriction")
def CoulombFriction(*, mu: Given | None = None, mu_static: Given | None = None) -> Kernel:
    """Return sliding friction ``mu*|N|``, and static friction up to ``mu_static*|N|``.

    Parameters
    ----------
    mu
        The coefficient of sliding friction, or another name for this parameter.
    mu_static
        The coefficient of static friction, never below ``mu``, or another name for it; by default it is ``mu``.

    Returns
    -------
    Kernel

    Raises
    ------
    DeclarationError
        If a name or a value is not allowed.

    Notes
    -----
    The row "Coulomb friction" of the paper's Table 2, with the signs of velocity and contact force (MATHS, section 2).
    """
    sliding, pair = parameter(mu, "mu", where="coulomb")
    holding, other = (sliding, pair) if mu_static is None else parameter(mu_static, "mu_static", where="coulomb")
    return Kernel(
        terms=(("coulomb", f"friction {sliding} times the contact force"),),
        friction=sliding,
        static_friction=holding,
        defaults=tuple(dict.fromkeys((pair, other))),
        at_least=((pair[0], "0"), (other[0], pair[0])) if other != pair else ((pair[0], "0"),),
    )
