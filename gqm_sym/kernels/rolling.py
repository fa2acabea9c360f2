"""Rolling without slipping."""

import sympy as sp

from gqm_sym.arguments import checked
from gqm_sym.kernels.base import Kernel, parameter
from gqm_sym.parameters import Given


@checked("Rolling")
def Rolling(*, beta: Given | None = None, radius: Given | None = None, mu_static: Given | None = None) -> Kernel:
    """Return the inertia ``1 + beta`` of a body that rolls without slipping.

    Parameters
    ----------
    beta
        The moment of inertia over mass and radius squared (sphere 2/5, cylinder 1/2, ring 1), or another name for it.
    radius
        The radius of the body in m, or another name for it. With it the curve is the track, and the centre of the body
        moves beside it, to the left of increasing λ, or to the right if the radius is negative; in space it moves above
        the track, along the upward direction of a track with a declared roll. Without it the curve is the path of the
        centre.
    mu_static
        The coefficient of static friction, or another name for it. With it, events of the kind "slip" mark the places
        where a conservative motion needs more friction; the motion continues as if the body still rolled.

    Returns
    -------
    Kernel

    Raises
    ------
    DeclarationError
        If a name or a value is not allowed.

    Notes
    -----
    The paper's section on rolling, with the path of the centre in place of the track (MATHS, section 2).
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
