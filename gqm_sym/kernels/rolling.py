"""Rolling without slipping."""

import sympy as sp

from gqm_sym.arguments import checked
from gqm_sym.kernels.base import Kernel, parameter
from gqm_sym.parameters import Given


@checked("Rolling")
def Rolling(*, beta: Given | None = None, radius: Given | None = None, mu_static: Given | None = None) -> Kernel:
    """Return the inertia of a body that rolls.

    Parameters
    ----------
    beta
        Moment of inertia over mass and radius squared: sphere 2/5, cylinder 1/2, ring 1.
    radius
        Of the body, a name or a value: then the curve is the track, and the body's centre moves beside it, to the left
        of growing λ (to the right if negative). Without it the curve is the path of the centre.
    mu_static
        Coefficient of static friction, a name or a value: then events of the kind "slip" tell where a conservative
        motion asks for more. It goes on as if the body still rolled.
    """
    symbol, pair = parameter(beta, "beta", where="rolling")
    size, limit = sp.S.Zero, None
    pairs, text = [pair], ""
    if radius is not None:
        size, another = parameter(radius, "radius", where="rolling")
        pairs.append(another)
        text = f", a body of radius {size}"
    if mu_static is not None:
        _, another = parameter(mu_static, "mu_static", where="rolling")
        limit = (pair[0], another[0])
        pairs.append(another)
    return Kernel(
        terms=(("rolling", f"rolling without slipping, inertia 1 + {symbol}{text}"),),
        inertia=1 + symbol,
        radius=size,
        static_friction_limit=limit,
        defaults=tuple(pairs),
        at_least=tuple((name, "0") for name, _ in pairs if name != str(size)),
    )
