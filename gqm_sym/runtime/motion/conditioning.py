"""What the rounding of a launch does to V**2 on a stretch that is measured from one place."""

import numpy as np

from gqm_sym.literals.numbers import Number
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.speed import potential_at, speed_squared_at

# Shares of a stretch at which it is looked at: a slow start may be short.
LOOKS = 0.5 ** np.arange(48)


def off_launch(addresses: tuple[int, ...], p: Array, lam0: Number) -> float:
    """What V**2 at the double nearest to the launch place has over that at the launch place itself."""
    return 2.0 * lam0.low * float(potential_at(addresses, p, np.array([lam0.value]))[1, 0]) if lam0.low else 0.0


def magnified(addresses: tuple[int, ...], p: Array, a: float, b: float, ref: float, w: float) -> float:
    """How many times V**2 magnifies a relative change of ``ref``, where it is ``w``, at most from a to b.

    V**2 = w - 2*(lam - ref)*U[ref, lam]: a shift of both places changes it by twice the difference of U's slopes
    there. Beside a hilltop that is much against V**2 itself.
    """
    offsets = (a - ref) + (b - a) * LOOKS
    places = np.append(ref + offsets, ref)
    slopes = 2.0 * potential_at(addresses, p, places)[1]
    with np.errstate(all="ignore"):
        ratio = np.abs(
            (slopes[:-1] - slopes[-1]) * ref / speed_squared_at(addresses, p, ref, 0.0, w, places[:-1], offsets)
        )
    return float(np.max(ratio, initial=1.0, where=np.isfinite(ratio)))
