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
        Another name for the coefficient of friction of a body that slides, or a value.
    mu_static
        The same of a body at rest, never below ``mu``; that of sliding if nothing is said.
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
