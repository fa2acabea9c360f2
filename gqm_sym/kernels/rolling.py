"""Rolling without slipping, on the path of the body's centre."""

from gqm_sym.kernels.base import Kernel, parameter
from gqm_sym.parameters import Given


def Rolling(*, beta: Given | None = None) -> Kernel:
    """Return the inertia of a body that rolls; the curve is the path of its centre.

    Parameters
    ----------
    beta
        Moment of inertia over mass and radius squared: sphere 2/5, cylinder 1/2, ring 1.
    """
    symbol, pair = parameter(beta, "beta", where="rolling")
    return Kernel(
        terms=(("rolling", f"rolling without slipping, inertia 1 + {symbol}"),),
        inertia=1 + symbol,
        defaults=(pair,),
    )
