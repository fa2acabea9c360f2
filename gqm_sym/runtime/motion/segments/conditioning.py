"""The effect of the rounding of a launch on V**2 on a segment on which V**2 is measured from one place."""

import numpy as np

from gqm_sym.literals.numbers import Number
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.speed import potential_at, speed_squared_at

# Shares of a segment at which V**2 is examined; they are halved repeatedly, because the part with small V**2 may be
# short.
SHARES = 0.5 ** np.arange(48)


def v2_correction(addresses: tuple[int, ...], p: Array, lam0: Number) -> float:
    """Return the difference between V**2 at the double nearest to the launch place and V**2 at the launch place
    itself.
    """
    return 2.0 * lam0.low * float(potential_at(addresses, p, np.array([lam0.value]))[1, 0]) if lam0.low else 0.0


def launch_condition_number(
    addresses: tuple[int, ...], p: Array, a: float, b: float, ref: float, ref_v2: float
) -> float:
    """Return the largest relative change of V**2 between a and b per relative change of ``ref``, the place where V**2
    is ``ref_v2``.

    V**2 = ref_v2 - 2*(lam - ref)*U[ref, lam], with the divided difference of the effective potential U. A shift of both
    places changes this by twice the difference of the slopes at them, which is large in comparison with V**2 next to a
    maximum of the potential.
    """
    offsets = (a - ref) + (b - a) * SHARES
    places = np.append(ref + offsets, ref)
    slopes = 2.0 * potential_at(addresses, p, places)[1]
    with np.errstate(all="ignore"):
        ratio = np.abs(
            (slopes[:-1] - slopes[-1]) * ref / speed_squared_at(addresses, p, ref, 0.0, ref_v2, places[:-1], offsets)
        )
    return float(np.max(ratio, initial=1.0, where=np.isfinite(ratio)))
